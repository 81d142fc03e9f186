//! Lambertian reflection: f = ρ/π on the side of `wo`, 0 on the other.

use super::Evaluated;
use crate::math::{Rgb, Vec3, warp};
use crate::sampling::rng::unit_f32;
use crate::sampling::strategy::Directions;
use std::f32::consts::FRAC_1_PI;

#[inline(always)]
pub(super) fn eval(directions: Directions, reflectance: Rgb, wo: Vec3, wi: Vec3) -> Evaluated {
    // `&` and a selected factor: loops over lanes have no branch.
    let cos = if (wo.z > 0.0) & (wi.z > 0.0) { wi.z } else { 0.0 };
    Evaluated { value: reflectance * (cos * FRAC_1_PI), pdf: pdf(directions, wo, wi) }
}

#[inline(always)]
pub(super) fn pdf(directions: Directions, wo: Vec3, wi: Vec3) -> f32 {
    let pdf = match directions {
        Directions::Uniform => warp::uniform_hemisphere_pdf(),
        Directions::Cosine | Directions::Bsdf => warp::cosine_hemisphere_pdf(wi.z),
    };
    if (wo.z > 0.0) & (wi.z > 0.0) { pdf } else { 0.0 }
}

#[inline(always)]
pub(super) fn direction(directions: Directions, words: [u32; 4]) -> Vec3 {
    let u = [unit_f32(words[0]), unit_f32(words[1])];
    match directions {
        Directions::Uniform => warp::sample_uniform_hemisphere(u),
        Directions::Cosine | Directions::Bsdf => warp::sample_cosine_hemisphere(u),
    }
}
