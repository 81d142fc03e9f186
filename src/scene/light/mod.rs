//! Light sources: one file per kind.

mod area;
mod choice;
mod constant;
mod lanes;
mod point;
mod tables;

pub use area::emitted;
pub use choice::{LightSample, LightSampler, LightTarget};
pub use constant::environment;
pub use lanes::LightSamples;
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
    /// The same radiance from every direction that no surface covers.
    Constant {
        /// W m⁻² sr⁻¹.
        radiance: Rgb,
    },
}
