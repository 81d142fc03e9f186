//! Constant environments: the same radiance from all directions, drawn uniformly over the sphere, as Mitsuba does.

use super::super::Scene;
use super::Light;
use crate::math::{Rgb, Vec3, warp};
use crate::sampling::rng::unit_f32;

/// Radiance that arrives where no surface is: the sum over all constant lights.
pub fn environment(scene: &Scene) -> Rgb {
    let constant = |l: &Light| if let Light::Constant { radiance } = l { Some(*radiance) } else { None };
    scene.lights.iter().filter_map(constant).sum()
}

#[inline(always)]
pub(super) fn sample(words: [u32; 4]) -> Vec3 {
    warp::sample_uniform_sphere([unit_f32(words[0]), unit_f32(words[1])])
}

/// sr⁻¹.
#[inline(always)]
pub(super) fn pdf() -> f32 {
    warp::uniform_sphere_pdf()
}
