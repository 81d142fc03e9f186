//! Reflectance of smooth interfaces for unpolarised light. Cosines are ≥ 0.

use crate::math::{Rgb, Vec3};

/// Between dielectrics; `eta`: index behind the interface over that before it. With the cosine of refraction, 0 where
/// reflection is total. Born and Wolf, Principles of Optics, §1.5.2.
#[inline(always)]
pub(super) fn dielectric(cos: f32, eta: f32) -> (f32, f32) {
    // 1 − sin²/η² as a product, so that nothing is lost near grazing angles. Rounding may leave a cosine above 1.
    let sin2 = (1.0 - cos) * (1.0 + cos);
    let sin = (if sin2 > 0.0 { sin2 } else { 0.0 }).sqrt() / eta;
    let refracted2 = (1.0 - sin) * (1.0 + sin);
    if refracted2 <= 0.0 {
        return (1.0, 0.0);
    }
    let refracted = refracted2.sqrt();
    let s = (cos - eta * refracted) / (cos + eta * refracted);
    let p = (eta * cos - refracted) / (eta * cos + refracted);
    (0.5 * (s * s + p * p), refracted)
}

/// Of a conductor with the complex index `eta` + i·`k`, per channel, relative to the medium before it. Born and Wolf, §14.2;
/// a² + b² of the refracted wave is |√((η + ik)² − sin²)|².
#[inline(always)]
pub(super) fn conductor(cos: f32, eta: Rgb, k: Rgb) -> Rgb {
    let cos2 = cos * cos;
    let sin2 = (1.0 - cos) * (1.0 + cos);
    let real = eta * eta - k * k - Vec3::splat(sin2);
    let modulus = (real * real + eta * eta * k * k * 4.0).sqrt();
    let a = ((modulus + real) * 0.5).max(Vec3::ZERO).sqrt();
    let (sum, across) = (modulus + Vec3::splat(cos2), a * (2.0 * cos));
    let s = (sum - across) / (sum + across).max(TINY);
    let (sum, along) = (modulus * cos2 + Vec3::splat(sin2 * sin2), across * sin2);
    let p = s * ((sum - along) / (sum + along).max(TINY));
    // Where nothing is reflected, rounding may leave less.
    ((s + p) * 0.5).max(Vec3::ZERO)
}

/// Keeps 0/0 away, at grazing angles to nothing at all.
const TINY: Vec3 = Vec3::splat(f32::MIN_POSITIVE);
