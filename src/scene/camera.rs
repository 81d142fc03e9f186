//! The perspective camera and the film.

use crate::math::Vec3;

/// A pinhole camera. The ray through film coordinates (s, t) ∈ \[0, 1\]² of the *full* film (t grows downwards)
/// starts at `origin` and goes along `corner + s·across + t·down` (not normalised; the image plane lies at unit distance).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Centre of projection, world space.
    pub origin: Vec3,
    /// Direction to the film's top left corner.
    pub corner: Vec3,
    /// From the left to the right edge of the film.
    pub across: Vec3,
    /// From the top to the bottom edge of the film.
    pub down: Vec3,
    /// Nothing nearer than this distance along the optical axis is seen; 0 unless the file asks.
    pub near: f32,
    /// Nothing farther than this distance along the optical axis is seen; infinite unless the file asks.
    pub far: f32,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            origin: Vec3::ZERO,
            corner: Vec3::new(-1.0, 1.0, -1.0),
            across: Vec3::new(2.0, 0.0, 0.0),
            down: Vec3::new(0.0, -2.0, 0.0),
            near: 0.0,
            far: f32::INFINITY,
        }
    }
}

/// Film size in pixels, the part of it that is rendered, and the pixel filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Film {
    /// Full size: width, height.
    pub size: [u32; 2],
    /// Upper left corner of the rendered part.
    pub crop_offset: [u32; 2],
    /// Size of the rendered part: width, height.
    pub crop_size: [u32; 2],
    /// Pixel filter, importance-sampled with weight 1, so that pixels stay independent.
    pub filter: Filter,
}

impl Default for Film {
    fn default() -> Self {
        Self { size: [768, 576], crop_offset: [0, 0], crop_size: [768, 576], filter: Filter::Box }
    }
}

/// Pixel filters without negative lobes. Lengths in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Filter {
    /// The pixel itself.
    #[default]
    Box,
    /// A tent that reaches `radius` pixels from the centre (Mitsuba: 1).
    Tent {
        /// Half width.
        radius: f32,
    },
    /// A Gaussian of standard deviation `stddev`, cut at 4·stddev and lowered to be 0 there (Mitsuba: 0.5).
    Gaussian {
        /// Standard deviation.
        stddev: f32,
    },
}
