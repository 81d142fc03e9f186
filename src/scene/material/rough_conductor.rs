//! Rough conductors: every microfacet is a smooth one.

use super::microfacet::{self, Microfacets};
use super::{Evaluated, diffuse, fresnel};
use crate::math::{Rgb, Vec3};
use crate::sampling::strategy::Directions;

pub(super) fn eval(
    directions: Directions,
    facets: &Microfacets,
    [eta, k, reflectance]: [Rgb; 3],
    wo: Vec3,
    wi: Vec3,
) -> Evaluated {
    if !(wo.z > 0.0 && wi.z > 0.0) {
        return Evaluated::NOTHING;
    }
    let Some(half) = facets.half(wo, wi, 1.0) else { return Evaluated::NOTHING };
    let quarter = 0.25 * half.d * half.visible_o;
    let value = reflectance * fresnel::conductor(half.cos_o, eta, k) * (quarter * half.g_i);
    let pdf = if directions == Directions::Bsdf { quarter } else { microfacet::other_pdf(directions, wi, false) };
    Evaluated { value, pdf }
}

pub(super) fn sample(directions: Directions, facets: &Microfacets, wo: Vec3, words: [u32; 4]) -> Option<Vec3> {
    if wo.z <= 0.0 {
        return None;
    }
    Some(match directions {
        Directions::Bsdf => microfacet::mirrored(wo, facets.sample_visible(wo, words)),
        _ => diffuse::direction(directions, words),
    })
}
