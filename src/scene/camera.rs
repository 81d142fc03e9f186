//! Cameras and the film.

use crate::accel::Ray;
use crate::math::{Vec3, warp};

/// A camera. Film coordinates (s, t) ∈ \[0, 1\]² of the *full* film (t grows downwards) stand for the vector
/// `corner + s·across + t·down`; what it means says the projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Centre of projection (orthographic: of the film), world space.
    pub origin: Vec3,
    /// From there to the film's top left corner.
    pub corner: Vec3,
    /// From the left to the right edge of the film.
    pub across: Vec3,
    /// From the top to the bottom edge of the film.
    pub down: Vec3,
    /// Nothing nearer than this distance along the optical axis is seen; 0 unless the file asks.
    pub near: f32,
    /// Nothing farther than this distance along the optical axis is seen; infinite unless the file asks.
    pub far: f32,
    /// How film positions become rays.
    pub projection: Projection,
}

/// How film positions become rays.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Projection {
    /// All rays start at the camera's origin and go along the film vector (not normalised; the film lies at unit distance).
    #[default]
    Pinhole,
    /// Rays start at points of a round lens around the origin and meet where the pinhole's ray meets the plane in focus.
    ThinLens {
        /// Two radii of the lens at right angles to each other and to the optical axis, world space.
        radii: [Vec3; 2],
        /// One over the distance of the plane in focus along the optical axis; 0: infinitely far.
        inverse_focus: f32,
    },
    /// Rays start at the tip of the film vector and go along one direction.
    Orthographic {
        /// Unit vector along which the camera looks.
        direction: Vec3,
    },
}

impl Camera {
    /// The ray of film coordinates; `lens` places it on the lens, if there is one (\[0, 1)²).
    #[inline(always)]
    pub fn ray(&self, [s, t]: [f32; 2], lens: [f32; 2]) -> Ray {
        let film = self.corner + self.across * s + self.down * t;
        let (origin, direction) = match self.projection {
            Projection::Pinhole => (self.origin, film),
            Projection::ThinLens { radii: [u, v], inverse_focus } => {
                let at = warp::sample_uniform_disk(lens);
                let offset = u * at.x + v * at.y;
                (self.origin + offset, film - offset * inverse_focus)
            }
            Projection::Orthographic { direction } => (self.origin + film, direction),
        };
        Ray::new(origin + direction * self.near, direction, self.far - self.near)
    }
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
            projection: Projection::Pinhole,
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

impl Film {
    /// Film coordinates of a point of a pixel of the rendered part, drawn from the filter.
    #[inline(always)]
    pub fn sample(&self, pixel: u32, u: [f32; 2]) -> [f32; 2] {
        let [width, _] = self.crop_size;
        let offset = self.filter.sample(u);
        let x = (self.crop_offset[0] + pixel % width) as f32 + 0.5 + offset.x;
        let y = (self.crop_offset[1] + pixel / width) as f32 + 0.5 + offset.y;
        [x / self.size[0] as f32, y / self.size[1] as f32]
    }
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
