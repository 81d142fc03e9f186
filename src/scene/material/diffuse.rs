//! Lambertian reflection: f = ρ/π on the side of `wo`, 0 on the other.

use super::Scattered;
use crate::math::{Rgb, Vec3, warp};
use crate::sampling::rng::unit_f32;
use crate::sampling::strategy::Directions;
use std::f32::consts::FRAC_1_PI;

#[inline(always)]
pub(super) fn eval(reflectance: Rgb, wo: Vec3, wi: Vec3) -> Rgb {
    // `&` and a selected factor: loops over lanes have no branch.
    let cos = if (wo.z > 0.0) & (wi.z > 0.0) { wi.z } else { 0.0 };
    reflectance * (cos * FRAC_1_PI)
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
pub(super) fn sample(directions: Directions, reflectance: Rgb, wo: Vec3, words: [u32; 4]) -> Option<Scattered> {
    let u = [unit_f32(words[0]), unit_f32(words[1])];
    let wi = match directions {
        Directions::Uniform => warp::sample_uniform_hemisphere(u),
        Directions::Cosine | Directions::Bsdf => warp::sample_cosine_hemisphere(u),
    };
    let pdf = pdf(directions, wo, wi);
    let value = eval(reflectance, wo, wi);
    (pdf > 0.0).then_some(Scattered { wi, pdf, value, delta: false, eta: 1.0 })
}
