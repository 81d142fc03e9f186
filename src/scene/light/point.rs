//! Point lights: the same intensity into all directions.

use crate::accel::Endpoint;
use crate::math::{Rgb, Vec3};

/// The light's position, and the radiance times solid angle that arrives at `p`: I/d², W m⁻². `None` at the light itself.
#[inline(always)]
pub(super) fn sample(position: Vec3, intensity: Rgb, p: Vec3) -> Option<(Endpoint, Rgb)> {
    let distance2 = position.distance_squared(p);
    (distance2 > 0.0).then(|| (Endpoint::free(position), intensity / distance2))
}
