//! A diffuse base under a dielectric coat, smooth or rough: light that enters is scattered by the base, reflected inside again
//! and again, and leaves. Mitsuba 3, plugins `plastic` and `roughplastic`; the share that is reflected inside is that of
//! diffuse light.

use super::microfacet::{self, Microfacets};
use super::transmittance::Transmittance;
use super::{Evaluated, Scattered, diffuse, fresnel};
use crate::math::{Rgb, Vec3};
use crate::sampling::rng::happens;
use crate::sampling::strategy::Directions;
use std::f32::consts::FRAC_1_PI;

/// A dielectric coat over a diffuse base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    /// Index of refraction of the coat over that around it.
    pub eta: f32,
    /// Share of diffuse light that the coat reflects back to the base.
    pub internal: f32,
    /// Whether colours shift by the reflections inside.
    pub nonlinear: bool,
    /// Weight of reflection by the coat where a lobe is chosen, in \[0, 1\]; 1 minus that is the base's.
    pub specular_weight: f32,
}

impl Coat {
    /// Radiance of the base per light that enters and, of what gets to the coat, leaves; without the two passages.
    #[inline(always)]
    fn base(&self, reflectance: Rgb) -> Rgb {
        let inside = if self.nonlinear { reflectance * self.internal } else { Rgb::splat(self.internal) };
        reflectance / ((Rgb::ONE - inside) * (self.eta * self.eta))
    }

    /// Probability of the coat's lobe where it reflects the share `r`.
    #[inline(always)]
    fn choice(&self, r: f32) -> f32 {
        let (coat, base) = (r * self.specular_weight, (1.0 - r) * (1.0 - self.specular_weight));
        if coat + base > 0.0 { coat / (coat + base) } else { 1.0 }
    }
}

/// Smooth coat: the base alone, without the delta lobe.
pub(super) fn eval(directions: Directions, coat: &Coat, reflectance: Rgb, wo: Vec3, wi: Vec3) -> Evaluated {
    if !(wo.z > 0.0 && wi.z > 0.0) {
        return Evaluated::NOTHING;
    }
    let (r_o, r_i) = (fresnel::dielectric(wo.z, coat.eta).0, fresnel::dielectric(wi.z, coat.eta).0);
    let value = coat.base(reflectance) * ((1.0 - r_o) * (1.0 - r_i) * wi.z * FRAC_1_PI);
    Evaluated { value, pdf: (1.0 - coat.choice(r_o)) * diffuse::pdf(directions, wo, wi) }
}

/// Smooth coat: a mirror direction, complete, or one of the base.
pub(super) fn sample(
    directions: Directions,
    coat: &Coat,
    specular: Rgb,
    wo: Vec3,
    words: [u32; 4],
) -> Option<Result<Scattered, Vec3>> {
    if wo.z <= 0.0 {
        return None;
    }
    let (r, _) = fresnel::dielectric(wo.z, coat.eta);
    let p = coat.choice(r);
    Some(match happens(words[2], p) {
        true => Ok(Scattered { pdf: p, ..Scattered::reflected(wo, r, specular) }),
        false => Err(diffuse::direction(directions, words)),
    })
}

/// Rough coat.
pub(super) fn eval_rough(
    directions: Directions,
    facets: &Microfacets,
    (coat, table): (&Coat, &Transmittance),
    [reflectance, specular]: [Rgb; 2],
    wo: Vec3,
    wi: Vec3,
) -> Evaluated {
    if !(wo.z > 0.0 && wi.z > 0.0) {
        return Evaluated::NOTHING;
    }
    let t_o = table.at(wo.z);
    let base = coat.base(reflectance) * (t_o * table.at(wi.z) * wi.z * FRAC_1_PI);
    let p = coat.choice(1.0 - t_o);
    let below = (1.0 - p) * diffuse::pdf(directions, wo, wi);
    // Two directions above the surface always have a half vector there.
    let Some(half) = facets.half(wo, wi, 1.0) else { return Evaluated { value: base, pdf: below } };
    let quarter = 0.25 * half.d * half.visible_o;
    let (r, _) = fresnel::dielectric(half.cos_o, coat.eta);
    let pdf =
        if directions == Directions::Bsdf { p * quarter + below } else { microfacet::other_pdf(directions, wi, false) };
    Evaluated { value: specular * (r * quarter * half.g_i) + base, pdf }
}

/// Rough coat.
pub(super) fn sample_rough(
    directions: Directions,
    facets: &Microfacets,
    (coat, table): (&Coat, &Transmittance),
    wo: Vec3,
    words: [u32; 4],
) -> Option<Vec3> {
    if wo.z <= 0.0 {
        return None;
    }
    let coated = directions == Directions::Bsdf && happens(words[2], coat.choice(1.0 - table.at(wo.z)));
    Some(match coated {
        true => microfacet::mirrored(wo, facets.sample_visible(wo, words)),
        false => diffuse::direction(directions, words),
    })
}
