//! Point lights: the same intensity into all directions.

use super::area::LightPoint;
use crate::accel::NO_PRIMITIVE;
use crate::math::{Rgb, Vec3};

/// The light's position, and the radiance times solid angle that arrives at `p`: I/d², W m⁻². `None` at the light itself.
#[inline(always)]
pub(super) fn sample(position: Vec3, intensity: Rgb, p: Vec3) -> Option<(LightPoint, Rgb)> {
    let distance2 = position.distance_squared(p);
    let at = LightPoint { p: position, p_error: Vec3::ZERO, ng: Vec3::ZERO, triangle: NO_PRIMITIVE };
    (distance2 > 0.0).then(|| (at, intensity / distance2))
}
