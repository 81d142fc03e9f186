//! Smooth interfaces between dielectrics: light is reflected as by a mirror, or refracted.

use super::{Scattered, fresnel};
use crate::math::{Rgb, Vec3};
use crate::sampling::rng::happens;

/// `eta`: index of the other side over that of the side of `wo`. Refraction changes radiance by η⁻² (Veach 1997, §5.2).
#[inline(always)]
pub(super) fn sample(eta: f32, reflectance: Rgb, transmittance: Rgb, wo: Vec3, word: u32) -> Option<Scattered> {
    if wo.z <= 0.0 {
        return None;
    }
    let (r, cos) = fresnel::dielectric(wo.z, eta);
    Some(if happens(word, r) {
        Scattered::reflected(wo, r, reflectance)
    } else {
        let (t, inverse) = (1.0 - r, 1.0 / eta);
        let wi = Vec3::new(-wo.x * inverse, -wo.y * inverse, -cos);
        Scattered { wi, pdf: t, value: transmittance * (t * inverse * inverse), delta: true, eta }
    })
}
