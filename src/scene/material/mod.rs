//! Surface materials: one file per kind.

mod conductor;
mod dielectric;
mod diffuse;
mod fresnel;
mod microfacet;
mod plastic;
mod rough_conductor;
mod rough_dielectric;
mod thin_dielectric;
mod transmittance;

use crate::math::{Rgb, Vec3};
use crate::sampling::strategy::Directions;

pub(crate) use microfacet::ROUGHNESS;
pub use microfacet::{Distribution, Microfacets};
pub use plastic::Coat;
pub use transmittance::{Transmittance, diffuse_reflectance, diffuse_rough_reflectance};

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
    /// A rough metal.
    RoughConductor {
        /// Its microfacets.
        facets: Microfacets,
        /// Real part of the index of refraction per channel, relative to the medium before it.
        eta: Rgb,
        /// Its imaginary part.
        k: Rgb,
        /// Factor of what is reflected, in \[0, 1\].
        reflectance: Rgb,
    },
    /// A rough interface between dielectrics.
    RoughDielectric {
        /// Its microfacets.
        facets: Microfacets,
        /// Index of refraction of the other side over that of this one; not 1.
        eta: f32,
        /// Factor of what is reflected, in \[0, 1\].
        reflectance: Rgb,
        /// Factor of what is refracted, in \[0, 1\].
        transmittance: Rgb,
    },
    /// A diffuse base under a smooth dielectric coat.
    Plastic {
        /// The coat.
        coat: Coat,
        /// Albedo of the base, in \[0, 1\].
        reflectance: Rgb,
        /// Factor of what the coat reflects, in \[0, 1\].
        specular: Rgb,
    },
    /// A diffuse base under a rough dielectric coat.
    RoughPlastic {
        /// Microfacets of the coat.
        facets: Microfacets,
        /// The coat.
        coat: Coat,
        /// What passes the coat; index into [`super::Scene::transmittances`].
        table: u32,
        /// Albedo of the base, in \[0, 1\].
        reflectance: Rgb,
        /// Factor of what the coat reflects, in \[0, 1\].
        specular: Rgb,
    },
}

/// A BSDF for one pair of directions, without delta lobes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evaluated {
    /// The BSDF times |cos θi|.
    pub value: Rgb,
    /// Density with which [`Material::sample`] draws `wi`, sr⁻¹.
    pub pdf: f32,
}

impl Evaluated {
    /// No light, never drawn.
    const NOTHING: Self = Self { value: Rgb::ZERO, pdf: 0.0 };
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
/// Densities are over solid angle. `tables`: [`super::Scene::transmittances`].
impl Material {
    /// The BSDF and its density, without delta lobes.
    #[inline(always)]
    pub fn eval(&self, tables: &[Transmittance], directions: Directions, wo: Vec3, wi: Vec3) -> Evaluated {
        match *self {
            Self::Diffuse { reflectance } => diffuse::eval(directions, reflectance, wo, wi),
            Self::Black | Self::Conductor { .. } | Self::Dielectric { .. } => Evaluated::NOTHING,
            Self::ThinDielectric { .. } | Self::Null => Evaluated::NOTHING,
            _ => self.eval_coated(tables, directions, wo, wi),
        }
    }

    /// What is too long to be repeated in every loop over lanes.
    #[inline(never)]
    fn eval_coated(&self, tables: &[Transmittance], directions: Directions, wo: Vec3, wi: Vec3) -> Evaluated {
        match self {
            Self::RoughConductor { facets, eta, k, reflectance } => {
                rough_conductor::eval(directions, facets, [*eta, *k, *reflectance], wo, wi)
            }
            Self::RoughDielectric { facets, eta, reflectance, transmittance } => {
                rough_dielectric::eval(directions, facets, *eta, [*reflectance, *transmittance], wo, wi)
            }
            Self::Plastic { coat, reflectance, .. } => plastic::eval(directions, coat, *reflectance, wo, wi),
            Self::RoughPlastic { facets, coat, table, reflectance, specular } => {
                let coat = (coat, &tables[*table as usize]);
                plastic::eval_rough(directions, facets, coat, [*reflectance, *specular], wo, wi)
            }
            _ => Evaluated::NOTHING,
        }
    }

    /// A direction, from words 0 and 1, and from word 2 which lobe. `None` where nothing is scattered.
    #[inline(always)]
    pub fn sample(
        &self,
        tables: &[Transmittance],
        directions: Directions,
        wo: Vec3,
        words: [u32; 4],
    ) -> Option<Scattered> {
        match *self {
            Self::Black => None,
            Self::Diffuse { .. } => self.toward(tables, directions, wo, diffuse::direction(directions, words)),
            Self::Conductor { eta, k, reflectance } => conductor::sample(eta, k, reflectance, wo),
            Self::Dielectric { eta, reflectance, transmittance } => {
                dielectric::sample(eta, reflectance, transmittance, wo, words[2])
            }
            Self::ThinDielectric { eta, reflectance, transmittance } => {
                thin_dielectric::sample(eta, reflectance, transmittance, wo, words[2])
            }
            Self::Null => Some(Scattered::straight(wo, 1.0, Rgb::ONE)),
            _ => self.sample_coated(tables, directions, wo, words),
        }
    }

    #[inline(never)]
    fn sample_coated(
        &self,
        tables: &[Transmittance],
        directions: Directions,
        wo: Vec3,
        words: [u32; 4],
    ) -> Option<Scattered> {
        let wi = match self {
            Self::RoughConductor { facets, .. } => rough_conductor::sample(directions, facets, wo, words)?,
            Self::RoughDielectric { facets, eta, .. } => rough_dielectric::sample(directions, facets, *eta, wo, words)?,
            Self::Plastic { coat, specular, .. } => match plastic::sample(directions, coat, *specular, wo, words)? {
                Ok(mirrored) => return Some(mirrored),
                Err(below) => below,
            },
            Self::RoughPlastic { facets, coat, table, .. } => {
                plastic::sample_rough(directions, facets, (coat, &tables[*table as usize]), wo, words)?
            }
            _ => return None,
        };
        self.toward(tables, directions, wo, wi)
    }

    /// The drawn direction `wi` with its value and density; `None` where the density is 0.
    #[inline(always)]
    fn toward(&self, tables: &[Transmittance], directions: Directions, wo: Vec3, wi: Vec3) -> Option<Scattered> {
        let Evaluated { value, pdf } = self.eval(tables, directions, wo, wi);
        let eta = match self {
            Self::RoughDielectric { eta, .. } if wi.z < 0.0 => *eta,
            _ => 1.0,
        };
        (pdf > 0.0).then_some(Scattered { wi, pdf, value, delta: false, eta })
    }
}
