//! Surface materials: one file per kind.

use crate::math::Rgb;

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
