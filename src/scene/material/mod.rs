//! Surface materials: one file per kind.

mod conductor;
mod dielectric;
mod diffuse;
mod fresnel;
mod thin_dielectric;

use crate::math::{Rgb, Vec3};
use crate::sampling::strategy::Directions;

/// Largest index of refraction, of either side over the other: beyond it squares leave the range of floats.
pub(crate) const LARGEST_INDEX: f32 = 1e6;

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
    /// A smooth metal; a perfect mirror where η = 0 and k = 1.
    Conductor {
        /// Real part of the index of refraction per channel, relative to the medium before it.
        eta: Rgb,
        /// Its imaginary part.
        k: Rgb,
        /// Factor of what is reflected, in \[0, 1\].
        reflectance: Rgb,
    },
    /// A smooth interface between dielectrics.
    Dielectric {
        /// Index of refraction of the other side over that of this one.
        eta: f32,
        /// Factor of what is reflected, in \[0, 1\].
        reflectance: Rgb,
        /// Factor of what is refracted, in \[0, 1\].
        transmittance: Rgb,
    },
    /// A pane that is too thin to bend light.
    ThinDielectric {
        /// Index of refraction of the pane over that around it.
        eta: f32,
        /// Factor of what is reflected, in \[0, 1\].
        reflectance: Rgb,
        /// Factor of what goes through, in \[0, 1\].
        transmittance: Rgb,
    },
    /// Nothing: light goes on.
    Null,
}

/// A drawn direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scattered {
    /// Unit vector.
    pub wi: Vec3,
    /// Density over solid angle, sr⁻¹; of a delta lobe its probability.
    pub pdf: f32,
    /// The BSDF times |cos θi|; of a delta lobe its factor times its probability. Over `pdf` it weights the sample.
    pub value: Rgb,
    /// Whether the direction is that of a delta lobe, which no other technique finds.
    pub delta: bool,
    /// Index of refraction of the side that the direction leads to over that of the side it came from.
    pub eta: f32,
}

impl Scattered {
    /// The share `share` of all light, as a mirror reflects it, times `factor`.
    #[inline(always)]
    fn reflected(wo: Vec3, share: f32, factor: Rgb) -> Self {
        Self { wi: Vec3::new(-wo.x, -wo.y, wo.z), pdf: share, value: factor * share, delta: true, eta: 1.0 }
    }

    /// The share `share` of all light, straight on, times `factor`.
    #[inline(always)]
    fn straight(wo: Vec3, share: f32, factor: Rgb) -> Self {
        Self { wi: -wo, pdf: share, value: factor * share, delta: true, eta: 1.0 }
    }
}

/// Directions are unit vectors that point away from the surface, in the local frame: z = the shading normal on the side of `wo`.
/// Densities are over solid angle.
impl Material {
    /// The BSDF times |cos θi|, without delta lobes.
    #[inline(always)]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Rgb {
        match *self {
            Self::Diffuse { reflectance } => diffuse::eval(reflectance, wo, wi),
            Self::Black | Self::Conductor { .. } | Self::Dielectric { .. } => Rgb::ZERO,
            Self::ThinDielectric { .. } | Self::Null => Rgb::ZERO,
        }
    }

    /// Density of `wi` under [`Self::sample`], sr⁻¹, without delta lobes.
    #[inline(always)]
    pub fn pdf(&self, directions: Directions, wo: Vec3, wi: Vec3) -> f32 {
        match self {
            Self::Diffuse { .. } => diffuse::pdf(directions, wo, wi),
            Self::Black | Self::Conductor { .. } | Self::Dielectric { .. } => 0.0,
            Self::ThinDielectric { .. } | Self::Null => 0.0,
        }
    }

    /// A direction, from words 0 and 1, and from word 2 which lobe. `None` where nothing is scattered.
    #[inline(always)]
    pub fn sample(&self, directions: Directions, wo: Vec3, words: [u32; 4]) -> Option<Scattered> {
        match *self {
            Self::Black => None,
            Self::Diffuse { reflectance } => diffuse::sample(directions, reflectance, wo, words),
            Self::Conductor { eta, k, reflectance } => conductor::sample(eta, k, reflectance, wo),
            Self::Dielectric { eta, reflectance, transmittance } => {
                dielectric::sample(eta, reflectance, transmittance, wo, words[2])
            }
            Self::ThinDielectric { eta, reflectance, transmittance } => {
                thin_dielectric::sample(eta, reflectance, transmittance, wo, words[2])
            }
            Self::Null => Some(Scattered::straight(wo, 1.0, Rgb::ONE)),
        }
    }
}
