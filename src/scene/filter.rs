//! Pixel filters as densities: a sample's offset from the pixel centre is drawn from the filter, so its weight is 1.

use super::Filter;
use crate::math::{Vec2, warp};

impl Filter {
    /// Offset from the pixel centre, in pixels.
    #[inline(always)]
    pub fn sample(&self, u: [f32; 2]) -> Vec2 {
        match *self {
            Self::Box => Vec2::new(u[0] - 0.5, u[1] - 0.5),
            Self::Tent { radius } => radius * Vec2::new(warp::sample_tent(u[0]), warp::sample_tent(u[1])),
            Self::Gaussian { stddev } => stddev * Vec2::new(warp::sample_gaussian(u[0]), warp::sample_gaussian(u[1])),
        }
    }

    /// Density of an offset, per square pixel: the filter, normalised.
    pub fn pdf(&self, offset: Vec2) -> f32 {
        match *self {
            Self::Box => f32::from(u8::from(offset.abs().max_element() <= 0.5)),
            Self::Tent { radius } => {
                let x = offset / radius;
                warp::tent_pdf(x.x) * warp::tent_pdf(x.y) / (radius * radius)
            }
            Self::Gaussian { stddev } => {
                let x = offset / stddev;
                warp::gaussian_pdf(x.x) * warp::gaussian_pdf(x.y) / (stddev * stddev)
            }
        }
    }

    /// Inverse of [`Self::sample`].
    pub fn invert(&self, offset: Vec2) -> [f32; 2] {
        match *self {
            Self::Box => [offset.x + 0.5, offset.y + 0.5],
            Self::Tent { radius } => (offset / radius).to_array().map(warp::invert_tent),
            Self::Gaussian { stddev } => (offset / stddev).to_array().map(warp::invert_gaussian),
        }
    }
}
