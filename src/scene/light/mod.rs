//! Light sources: one file per kind.

mod area;
mod choice;
mod constant;
mod environment_map;
mod lanes;
mod point;
mod spot;
mod tables;

pub use area::{emitted, samples_solid_angle};
pub use choice::{LightSample, LightSampler, LightTarget};
pub use constant::environment;
pub use environment_map::{Band, EnvironmentMap};
pub use lanes::LightSamples;
pub use spot::Beam;
pub use tables::{LightEntry, LightTables};

use crate::math::{Rgb, Vec3};

/// A light source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// A shape that emits from its front side, equally into all directions.
    Area {
        /// Index into [`super::Scene::shapes`].
        shape: u32,
        /// W m⁻² sr⁻¹.
        radiance: Rgb,
    },
    /// A point that emits equally into all directions.
    Point {
        /// World space.
        position: Vec3,
        /// W sr⁻¹.
        intensity: Rgb,
    },
    /// A point that emits into a cone.
    Spot {
        /// World space.
        position: Vec3,
        /// On the axis, W sr⁻¹.
        intensity: Rgb,
        /// The cone.
        beam: Beam,
    },
    /// Parallel light from outside the scene.
    Directional {
        /// Unit vector along which it travels.
        direction: Vec3,
        /// On a surface at right angles to it, W m⁻².
        irradiance: Rgb,
    },
    /// [`super::Scene::environment_map`].
    EnvironmentMap,
    /// The same radiance from every direction that no surface covers.
    Constant {
        /// W m⁻² sr⁻¹.
        radiance: Rgb,
    },
}

impl Light {
    /// The kind in words.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::Area { .. } => "area",
            Self::Point { .. } => "point",
            Self::Spot { .. } => "spot",
            Self::Directional { .. } => "directional",
            Self::EnvironmentMap => "environment map",
            Self::Constant { .. } => "constant environment",
        }
    }

    /// Whether no direction can meet it, so that only light sampling finds it.
    pub const fn is_delta(&self) -> bool {
        matches!(self, Self::Point { .. } | Self::Spot { .. } | Self::Directional { .. })
    }
}
