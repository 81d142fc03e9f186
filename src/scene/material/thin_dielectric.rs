//! Panes: two parallel interfaces so near to each other that light goes on where it would have gone.

use super::{Scattered, fresnel};
use crate::math::{Rgb, Vec3};
use crate::sampling::rng::happens;

/// `eta`: index inside over that around. All reflections inside together: R + T²R/(1 − R²) = 2R/(1 + R).
#[inline(always)]
pub(super) fn sample(eta: f32, reflectance: Rgb, transmittance: Rgb, wo: Vec3, word: u32) -> Option<Scattered> {
    if wo.z <= 0.0 {
        return None;
    }
    let (once, _) = fresnel::dielectric(wo.z, eta);
    let r = 2.0 * once / (1.0 + once);
    Some(match happens(word, r) {
        true => Scattered::reflected(wo, r, reflectance),
        false => Scattered::straight(wo, 1.0 - r, transmittance),
    })
}
