//! Smooth conductors and mirrors: all light goes where a mirror sends it.

use super::{Scattered, fresnel};
use crate::math::{Rgb, Vec3};

#[inline(always)]
pub(super) fn sample(eta: Rgb, k: Rgb, reflectance: Rgb, wo: Vec3) -> Option<Scattered> {
    if wo.z <= 0.0 {
        return None;
    }
    let value = reflectance * fresnel::conductor(wo.z, eta, k);
    Some(Scattered { wi: Vec3::new(-wo.x, -wo.y, wo.z), pdf: 1.0, value, delta: true, eta: 1.0 })
}
