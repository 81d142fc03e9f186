//! Surface materials: one file per kind.

mod diffuse;

use crate::math::lanes::lane_of;
use crate::math::{LANES, Rgb, Vec3, Vec3Lanes};
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

    /// [`Self::sample`] for lanes; `words` as `[word][lane]`. Density 0 where nothing is reflected.
    #[inline(always)]
    pub fn sample_lanes(
        materials: &[Self; LANES],
        directions: Directions,
        wo: &Vec3Lanes,
        words: &[[u32; LANES]; 4],
    ) -> (Vec3Lanes, [f32; LANES]) {
        // One loop for each technique, so that each can become vector code.
        #[inline(always)]
        fn each(
            materials: &[Material; LANES],
            directions: Directions,
            wo: &Vec3Lanes,
            words: &[[u32; LANES]; 4],
        ) -> (Vec3Lanes, [f32; LANES]) {
            let (mut wi, mut pdf) = (Vec3Lanes::ZERO, [0.0; LANES]);
            for lane in 0..LANES {
                let sample = materials[lane].sample(directions, wo.get(lane), lane_of(words, lane));
                let (direction, density) = sample.unwrap_or((Vec3::Z, 0.0));
                wi.set(lane, direction);
                pdf[lane] = density;
            }
            (wi, pdf)
        }
        match directions {
            Directions::Uniform => each(materials, Directions::Uniform, wo, words),
            Directions::Cosine => each(materials, Directions::Cosine, wo, words),
            Directions::Bsdf => each(materials, Directions::Bsdf, wo, words),
        }
    }
}
