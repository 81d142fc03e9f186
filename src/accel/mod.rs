//! Ray intersection: a BVH, and the brute-force loop that judges it.

pub mod brute;
pub mod bvh;
pub mod compact;
mod few;
mod parameterization;
mod primitives;
mod quadric;
pub mod simd;
mod slab;
pub mod surface;
mod tree;
mod triangle;

pub use parameterization::{Parameterization, QuadricMap};
pub use surface::{Endpoint, EndpointLanes, SurfaceLanes, leave, segment};

use crate::math::lanes::bits;
use crate::math::{LANES, Vec3, Vec3Lanes};

/// Stands for no primitive: ends of rays in free space or on curved surfaces.
pub const NO_PRIMITIVE: u32 = u32::MAX;

/// A ray or segment: points `origin + t·direction`, `0 <= t < t_max`. The direction need not be normalised.
/// No smallest `t`: a ray that leaves a surface starts at an origin moved off it by the error bound of the hit point
/// ([`leave`], [`segment`]). Where a triangle's box does not tell, 0 <= t and t < t_max are decided in f64 by the side of its
/// plane that the origin and the end lie on.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Start, world space.
    pub origin: Vec3,
    /// Direction, finite and not zero.
    pub direction: Vec3,
    /// End of the segment, exclusive.
    pub t_max: f32,
    /// Triangle that the ray starts on, as in [`Hit::primitive`]: it is flat, so the ray cannot hit it again.
    pub from: u32,
    /// Triangle that the segment ends on: it does not block the segment.
    pub to: u32,
}

impl Ray {
    /// A ray that starts and ends in free space.
    #[inline(always)]
    pub fn new(origin: Vec3, direction: Vec3, t_max: f32) -> Self {
        Self { origin, direction, t_max, from: NO_PRIMITIVE, to: NO_PRIMITIVE }
    }
}

/// Rays side by side.
#[derive(Clone, Copy, Debug)]
pub struct Rays {
    /// See [`Ray::origin`].
    pub origin: Vec3Lanes,
    /// See [`Ray::direction`].
    pub direction: Vec3Lanes,
    /// See [`Ray::t_max`].
    pub t_max: [f32; LANES],
    /// See [`Ray::from`].
    pub from: [u32; LANES],
    /// See [`Ray::to`].
    pub to: [u32; LANES],
}

impl Rays {
    /// No rays: all directions are zero.
    pub const ZERO: Self = Self {
        origin: Vec3Lanes::ZERO,
        direction: Vec3Lanes::ZERO,
        t_max: [0.0; LANES],
        from: [0; LANES],
        to: [0; LANES],
    };

    /// The ray of a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Ray {
        Ray {
            origin: self.origin.get(lane),
            direction: self.direction.get(lane),
            t_max: self.t_max[lane],
            from: self.from[lane],
            to: self.to[lane],
        }
    }

    /// Replaces the ray of a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, ray: Ray) {
        self.origin.set(lane, ray.origin);
        self.direction.set(lane, ray.direction);
        self.t_max[lane] = ray.t_max;
        self.from[lane] = ray.from;
        self.to[lane] = ray.to;
    }
}

/// The nearest intersections of a packet of rays: see [`Hit`].
#[derive(Clone, Copy, Debug)]
pub struct Hits {
    /// Distances.
    pub t: [f32; LANES],
    /// Primitives; [`NO_PRIMITIVE`] where nothing was hit.
    pub primitive: [u32; LANES],
    /// Weights of vertex 1.
    pub u: [f32; LANES],
    /// Weights of vertex 2.
    pub v: [f32; LANES],
}

impl Hits {
    /// No hits.
    pub const NONE: Self =
        Self { t: [f32::INFINITY; LANES], primitive: [NO_PRIMITIVE; LANES], u: [0.0; LANES], v: [0.0; LANES] };

    /// Bit i: lane i hit something.
    #[inline(always)]
    pub fn lanes(&self) -> u32 {
        let mut hit = [0; LANES];
        for lane in 0..LANES {
            hit[lane] = self.primitive[lane] ^ NO_PRIMITIVE;
        }
        bits(&hit)
    }

    /// The hit of a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Option<Hit> {
        let hit = Hit { t: self.t[lane], primitive: self.primitive[lane], u: self.u[lane], v: self.v[lane] };
        (hit.primitive != NO_PRIMITIVE).then_some(hit)
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, hit: Hit) {
        (self.t[lane], self.primitive[lane], self.u[lane], self.v[lane]) = (hit.t, hit.primitive, hit.u, hit.v);
    }
}

/// The nearest intersection of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in units of the ray's direction.
    pub t: f32,
    /// What was hit: below `scene.triangles.len()` a triangle; above, minus that, an index into [`crate::scene::Scene::shapes`]
    /// of a sphere, disk or cylinder.
    pub primitive: u32,
    /// Triangles: barycentric weight of vertex 1. Others: unused, 0.
    pub u: f32,
    /// Triangles: barycentric weight of vertex 2.
    pub v: f32,
}

/// Finds what a ray meets first. Implementors: [`bvh::Bvh`], [`brute::Brute`].
pub trait Intersect: Sync {
    /// The nearest hit, or `None`.
    fn closest(&self, ray: &Ray) -> Option<Hit>;
    /// Whether anything lies on the segment.
    fn occluded(&self, ray: &Ray) -> bool;
}

/// A point on a surface, with what is needed to shade there and to leave from there.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Position, world space.
    pub p: Vec3,
    /// Bound on the absolute rounding error of `p`, per axis.
    pub p_error: Vec3,
    /// Geometric normal, unit length, on the shape's front side (not turned towards the ray).
    pub ng: Vec3,
    /// Shading normal, unit length, in the hemisphere of `ng`.
    pub ns: Vec3,
    /// Index into [`crate::scene::Scene::shapes`].
    pub shape: u32,
    /// The triangle it lies on, as in [`Hit::primitive`]; [`NO_PRIMITIVE`] on curved surfaces.
    pub triangle: u32,
}
