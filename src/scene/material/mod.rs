//! Surface materials: one file per kind.

mod diffuse;

use crate::math::{Rgb, Vec3};
use crate::sampling::strategy::Directions;

/// What a surface does to light. One side of a shape; see [`super::Shape::front`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Material {
    /// Reflects nothing.
    Black,
    /// Lambertian reflection.
    Diffuse {
        /// Albedo per channel, in \[0, 1\].
        reflectance: Rgb,
    },
}

/// Directions are unit vectors that point away from the surface, in the local frame: z = the shading normal on the side of `wo`.
/// Densities are over solid angle.
impl Material {
    /// The BSDF times |cos θi|.
    #[inline(always)]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        match *self {
            Self::Black => Rgb::ZERO,
            Self::Diffuse { reflectance } => diffuse::eval(reflectance, wo, wi),
        }
    }

    /// Density of `wi` under [`Self::sample`], sr⁻¹.
    #[inline(always)]
    pub fn pdf(&self, directions: Directions, wo: Vec3, wi: Vec3) -> f32 {
        match self {
            Self::Black => 0.0,
            Self::Diffuse { .. } => diffuse::pdf(directions, wo, wi),
        }
    }

    /// A direction and its density, from words 0 and 1. `None` where nothing is reflected.
    #[inline(always)]
    pub fn sample(&self, directions: Directions, wo: Vec3, words: [u32; 4]) -> Option<(Vec3, f32)> {
        match self {
            Self::Black => None,
            Self::Diffuse { .. } => diffuse::sample(directions, wo, words),
        }
    }
}
