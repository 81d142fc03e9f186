//! Surface materials: one file per kind.

mod check;
mod conductor;
mod dielectric;
mod diffuse;
mod fresnel;
mod microfacet;
mod plastic;
mod relief;
mod rough_conductor;
mod rough_dielectric;
mod thin_dielectric;
mod transmittance;

use super::Scene;
use super::texture::{Input, Lookup};
use crate::math::{Rgb, Vec3};
use crate::sampling::strategy::Directions;

pub(super) use check::depth;
pub(crate) use microfacet::ROUGHNESS;
pub use microfacet::{Distribution, Microfacets};
pub use plastic::Coat;
pub use relief::{Bent, Relief, ReliefMap};
pub use transmittance::{Transmittance, diffuse_reflectance, diffuse_rough_reflectance};

/// Largest index of refraction, of either side over the other: beyond it squares leave the range of floats.
pub(crate) const LARGEST_INDEX: f32 = 1e6;

/// One side of a surface; see [`super::Shape::front`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// What it does to light.
    pub bsdf: Bsdf<Input, Input>,
    /// Bends the frame that the BSDF is in; not of mixtures.
    pub relief: Option<Relief>,
}

impl Material {
    /// Reflects nothing.
    pub const BLACK: Self = Self { bsdf: Bsdf::Black, relief: None };

    /// Its BSDF, if that is the same everywhere and in all frames.
    pub fn plain(&self) -> Option<Bsdf> {
        let varies = |i: &Input| matches!(i, Input::Texture(_));
        let value = |i: &Input| if let Input::Value(v) = i { *v } else { Rgb::ZERO };
        let bsdf = self.bsdf.map(value, |i| value(i).x);
        let plain = !self.bsdf.any(varies, varies) && !bsdf.is_anisotropic() && self.relief.is_none();
        (plain && !matches!(bsdf, Bsdf::Mixture { .. })).then_some(bsdf)
    }
}

impl From<Bsdf> for Material {
    /// The same everywhere.
    fn from(bsdf: Bsdf) -> Self {
        bsdf.map(|c| Input::Value(*c), |x| Input::Value(Rgb::splat(*x))).into()
    }
}

impl From<Bsdf<Input, Input>> for Material {
    /// Without relief.
    fn from(bsdf: Bsdf<Input, Input>) -> Self {
        Self { bsdf, relief: None }
    }
}

/// How light is scattered. `C`: its colours, and `S`: its numbers, that may vary over the surface; values at a point, or inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bsdf<C = Rgb, S = f32> {
    /// Reflects nothing.
    Black,
    /// Lambertian reflection.
    Diffuse {
        /// Albedo per channel, in \[0, 1\].
        reflectance: C,
    },
    /// A smooth metal; a perfect mirror where η = 0 and k = 1.
    Conductor {
        /// Real part of the index of refraction per channel, relative to the medium before it.
        eta: Rgb,
        /// Its imaginary part.
        k: Rgb,
        /// Factor of what is reflected, in \[0, 1\].
        reflectance: C,
    },
    /// A smooth interface between dielectrics.
    Dielectric {
        /// Index of refraction of the other side over that of this one.
        eta: f32,
        /// Factor of what is reflected, in \[0, 1\].
        reflectance: C,
        /// Factor of what is refracted, in \[0, 1\].
        transmittance: C,
    },
    /// A pane that is too thin to bend light.
    ThinDielectric {
        /// Index of refraction of the pane over that around it.
        eta: f32,
        /// Factor of what is reflected, in \[0, 1\].
        reflectance: C,
        /// Factor of what goes through, in \[0, 1\].
        transmittance: C,
    },
    /// Nothing: light goes on.
    Null,
    /// A rough metal.
    RoughConductor {
        /// Its microfacets.
        facets: Microfacets<S>,
        /// Real part of the index of refraction per channel, relative to the medium before it.
        eta: Rgb,
        /// Its imaginary part.
        k: Rgb,
        /// Factor of what is reflected, in \[0, 1\].
        reflectance: C,
    },
    /// A rough interface between dielectrics.
    RoughDielectric {
        /// Its microfacets.
        facets: Microfacets<S>,
        /// Index of refraction of the other side over that of this one; not 1.
        eta: f32,
        /// Factor of what is reflected, in \[0, 1\].
        reflectance: C,
        /// Factor of what is refracted, in \[0, 1\].
        transmittance: C,
    },
    /// A diffuse base under a smooth dielectric coat.
    Plastic {
        /// The coat.
        coat: Coat,
        /// Albedo of the base, in \[0, 1\].
        reflectance: C,
        /// Factor of what the coat reflects, in \[0, 1\].
        specular: C,
    },
    /// A diffuse base under a rough dielectric coat.
    RoughPlastic {
        /// Microfacets of the coat.
        facets: Microfacets<S>,
        /// The coat.
        coat: Coat,
        /// What passes the coat; index into [`super::Scene::transmittances`].
        table: u32,
        /// Albedo of the base, in \[0, 1\].
        reflectance: C,
        /// Factor of what the coat reflects, in \[0, 1\].
        specular: C,
    },
    /// One of two materials, chosen at each vertex.
    Mixture {
        /// Probability of the second, in \[0, 1\].
        weight: S,
        /// Indices into [`super::Scene::materials`], below its own.
        materials: [u32; 2],
    },
}

/// Mixtures inside mixtures.
pub(crate) const MIXTURE_DEPTH: usize = 4;

impl<C, S> Bsdf<C, S> {
    /// The kind in words.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::Black => "black",
            Self::Diffuse { .. } => "diffuse",
            Self::Conductor { .. } => "smooth conductor",
            Self::Dielectric { .. } => "smooth dielectric",
            Self::ThinDielectric { .. } => "thin dielectric",
            Self::Null => "null",
            Self::RoughConductor { .. } => "rough conductor",
            Self::RoughDielectric { .. } => "rough dielectric",
            Self::Plastic { .. } => "smooth plastic",
            Self::RoughPlastic { .. } => "rough plastic",
            Self::Mixture { .. } => "mixture",
        }
    }

    /// With other colours and numbers.
    #[inline(always)]
    pub fn map<D, T>(&self, color: impl Fn(&C) -> D, number: impl Fn(&S) -> T) -> Bsdf<D, T> {
        let rough = |facets: &Microfacets<S>| facets.map(&number);
        match self {
            Self::Black => Bsdf::Black,
            Self::Null => Bsdf::Null,
            Self::Diffuse { reflectance } => Bsdf::Diffuse { reflectance: color(reflectance) },
            Self::Conductor { eta, k, reflectance } => {
                Bsdf::Conductor { eta: *eta, k: *k, reflectance: color(reflectance) }
            }
            Self::Dielectric { eta, reflectance, transmittance } => {
                Bsdf::Dielectric { eta: *eta, reflectance: color(reflectance), transmittance: color(transmittance) }
            }
            Self::ThinDielectric { eta, reflectance, transmittance } => {
                Bsdf::ThinDielectric { eta: *eta, reflectance: color(reflectance), transmittance: color(transmittance) }
            }
            Self::RoughConductor { facets, eta, k, reflectance } => {
                Bsdf::RoughConductor { facets: rough(facets), eta: *eta, k: *k, reflectance: color(reflectance) }
            }
            Self::RoughDielectric { facets, eta, reflectance, transmittance } => Bsdf::RoughDielectric {
                facets: rough(facets),
                eta: *eta,
                reflectance: color(reflectance),
                transmittance: color(transmittance),
            },
            Self::Plastic { coat, reflectance, specular } => {
                Bsdf::Plastic { coat: *coat, reflectance: color(reflectance), specular: color(specular) }
            }
            Self::RoughPlastic { facets, coat, table, reflectance, specular } => Bsdf::RoughPlastic {
                facets: rough(facets),
                coat: *coat,
                table: *table,
                reflectance: color(reflectance),
                specular: color(specular),
            },
            Self::Mixture { weight, materials } => Bsdf::Mixture { weight: number(weight), materials: *materials },
        }
    }

    /// Whether an input is of some kind.
    pub fn any(&self, color: impl Fn(&C) -> bool, number: impl Fn(&S) -> bool) -> bool {
        let found = std::cell::Cell::new(false);
        self.map(|c| found.set(found.get() | color(c)), |x| found.set(found.get() | number(x)));
        found.get()
    }
}

impl<C, S: PartialEq> Bsdf<C, S> {
    /// Its microfacets.
    pub fn facets(&self) -> Option<&Microfacets<S>> {
        match self {
            Self::RoughConductor { facets, .. } => Some(facets),
            Self::RoughDielectric { facets, .. } | Self::RoughPlastic { facets, .. } => Some(facets),
            _ => None,
        }
    }

    /// Whether roughness differs along the axes of the frame.
    pub fn is_anisotropic(&self) -> bool {
        self.facets().is_some_and(|f| f.alpha[0] != f.alpha[1])
    }
}

impl Bsdf<Input, Input> {
    /// What it is at a surface point.
    pub fn at(&self, scene: &Scene, lookup: &Lookup) -> Bsdf {
        self.map(|c| c.eval(scene, lookup), |x| x.eval(scene, lookup).x).bounded()
    }
}

/// A BSDF for one pair of directions, without delta lobes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evaluated {
    /// The BSDF times |cos θi|.
    pub value: Rgb,
    /// Density with which [`Bsdf::sample`] draws `wi`, sr⁻¹.
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
impl Bsdf {
    /// With roughness that floats can hold, whatever a texture says.
    fn bounded(mut self) -> Self {
        match &mut self {
            Self::RoughConductor { facets, .. }
            | Self::RoughDielectric { facets, .. }
            | Self::RoughPlastic { facets, .. } => {
                facets.alpha = facets.alpha.map(|a| a.clamp(*ROUGHNESS.start(), *ROUGHNESS.end()));
            }
            _ => {}
        }
        self
    }

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
