//! Rough interfaces between dielectrics: every microfacet is a smooth one. Walter et al. 2007, §5 (see `microfacet`).

use super::microfacet::{self, Microfacets};
use super::{Evaluated, diffuse, fresnel};
use crate::math::{Rgb, Vec3};
use crate::sampling::rng::happens;
use crate::sampling::strategy::Directions;

/// `eta`: index of the other side over that of the side of `wo`. Refraction changes radiance by η⁻² (Veach 1997, §5.2).
pub(super) fn eval(
    directions: Directions,
    facets: &Microfacets,
    eta: f32,
    [reflectance, transmittance]: [Rgb; 2],
    wo: Vec3,
    wi: Vec3,
) -> Evaluated {
    if !(wo.z > 0.0 && wi.z != 0.0) {
        return Evaluated::NOTHING;
    }
    let reflects = wi.z > 0.0;
    let (mut value, mut pdf) = (Rgb::ZERO, 0.0);
    if let Some(half) = facets.half(wo, wi, if reflects { 1.0 } else { eta }) {
        let (r, _) = fresnel::dielectric(half.cos_o, eta);
        if reflects {
            pdf = r * 0.25 * half.d * half.visible_o;
            value = reflectance * (pdf * half.g_i);
        } else {
            let through = (1.0 - r) * half.d * half.visible_o * (half.cos_o * -half.cos_i) / half.length2;
            pdf = through * (eta * eta);
            value = transmittance * (through * half.g_i);
        }
    }
    if directions != Directions::Bsdf {
        pdf = microfacet::other_pdf(directions, wi, true);
    }
    Evaluated { value, pdf }
}

/// `None` where a microfacet sends light to the wrong side.
pub(super) fn sample(
    directions: Directions,
    facets: &Microfacets,
    eta: f32,
    wo: Vec3,
    words: [u32; 4],
) -> Option<Vec3> {
    if wo.z <= 0.0 {
        return None;
    }
    if directions != Directions::Bsdf {
        let wi = diffuse::direction(directions, words);
        return Some(if words[2] >> 31 == 0 { wi } else { Vec3::new(wi.x, wi.y, -wi.z) });
    }
    let m = facets.sample_visible(wo, words);
    let cos_o = wo.dot(m);
    let (r, cos_t) = fresnel::dielectric(cos_o, eta);
    let reflects = happens(words[2], r);
    let inverse = 1.0 / eta;
    let wi = if reflects { microfacet::mirrored(wo, m) } else { m * (cos_o * inverse - cos_t) - wo * inverse };
    (reflects == (wi.z > 0.0)).then_some(wi)
}
