//! Smooth conductors and mirrors: all light goes where a mirror sends it.

use super::{Scattered, fresnel};
use crate::math::{Rgb, Vec3};

#[inline(always)]
pub(super) fn sample(eta: Rgb, k: Rgb, reflectance: Rgb, wo: Vec3) -> Option<Scattered> {
    if wo.z <= 0.0 {
        return None;
    }
    Some(Scattered::reflected(wo, 1.0, reflectance * fresnel::conductor(wo.z, eta, k)))
}
