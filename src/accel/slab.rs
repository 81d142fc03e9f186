//! Ray against axis-aligned boxes, conservatively.
//!
//! The triangle test works in a sheared space where each vertex is off by a few roundings (Woop, Benthin & Wald 2013, §3.3).
//! Boxes are therefore widened, per ray, by a bound on that error: the origin is moved back for the near planes and on for
//! the far planes, so that the test costs no more than an exact one. All steps are monotonic in the planes; hence the
//! interval of a box contains that of every box inside it, bit for bit.

use super::simd::Simd;
use super::{Ray, Rays};
use crate::math::robust::UNIT_ROUNDOFF;
use crate::math::{LANES, Vec3};

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) lo: Vec3,
    pub(crate) hi: Vec3,
}

impl Bounds {
    pub(crate) const EMPTY: Self = Self { lo: Vec3::INFINITY, hi: Vec3::NEG_INFINITY };

    pub(crate) fn union(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    pub(crate) fn half_area(self) -> f32 {
        let d = self.hi - self.lo;
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

/// Per-ray constants of the box test.
pub(crate) struct Slabs {
    near_origin: [f32; 3],
    far_origin: [f32; 3],
    near_rcp: [f32; 3],
    far_rcp: [f32; 3],
    /// 1 where the direction's sign bit is set (also for −0): then the near plane is the upper one.
    negative: [usize; 3],
}

impl Slabs {
    /// For boxes inside `scene`.
    #[inline(always)]
    pub(crate) fn new(ray: &Ray, scene: &Bounds) -> Self {
        let (o, d) = (ray.origin.to_array(), ray.direction.to_array());
        let reach = (scene.lo - ray.origin).abs().max((scene.hi - ray.origin).abs()).to_array();
        let rcp = [1.0 / d[0], 1.0 / d[1], 1.0 / d[2]];
        let z = longest_axis(ray.direction);
        let slope = match z {
            0 => rcp[0].abs() * reach[0],
            1 => rcp[1].abs() * reach[1],
            _ => rcp[2].abs() * reach[2],
        };
        // Shear error: 2u|v−o| + 5u|d/dz|·|vz−oz|; the last term covers the rounding of o ± pad.
        let mut slabs = Self { near_origin: o, far_origin: o, near_rcp: rcp, far_rcp: rcp, negative: [0; 3] };
        for a in 0..3 {
            let error = UNIT_ROUNDOFF * (4.0 * reach[a] + 8.0 * d[a].abs() * slope + 2.0 * o[a].abs());
            let pad = error.copysign(d[a]);
            slabs.near_origin[a] += pad;
            slabs.far_origin[a] -= pad;
            // Four roundings in (plane − origin)·rcp·factor.
            slabs.near_rcp[a] *= 1.0 - 6.0 * UNIT_ROUNDOFF;
            slabs.far_rcp[a] *= 1.0 + 6.0 * UNIT_ROUNDOFF;
            slabs.negative[a] = usize::from(d[a].is_sign_negative());
        }
        slabs
    }

    /// The interval of one box: same bits as a lane of [`WideSlabs`].
    #[inline(always)]
    pub(crate) fn interval(&self, bounds: &Bounds) -> (f32, f32) {
        let planes = [bounds.lo.to_array(), bounds.hi.to_array()];
        let (mut near, mut far) = (0.0f32, f32::INFINITY);
        for a in 0..3 {
            let t0 = (planes[self.negative[a]][a] - self.near_origin[a]) * self.near_rcp[a];
            let t1 = (planes[1 - self.negative[a]][a] - self.far_origin[a]) * self.far_rcp[a];
            near = if t0 > near { t0 } else { near };
            far = if t1 < far { t1 } else { far };
        }
        (near, far)
    }
}

/// [`Slabs`] spread over lanes.
pub(crate) struct WideSlabs<S: Simd<N>, const N: usize = 8> {
    near_origin: [S::F; 3],
    far_origin: [S::F; 3],
    near_rcp: [S::F; 3],
    far_rcp: [S::F; 3],
    /// 1 or 0 where the lanes belong to one ray, else a bit for each lane.
    negative: [usize; 3],
}

impl<S: Simd<LANES>> WideSlabs<S, LANES> {
    /// Of a packet of rays, for [`Self::one_box`].
    #[inline(always)]
    pub(crate) fn of_rays(s: S, rays: &Rays, scene: &Bounds) -> Self {
        let mut constants = [[[0.0; LANES]; 3]; 4];
        let mut negative = [0; 3];
        for lane in 0..LANES {
            let slabs = Slabs::new(&rays.get(lane), scene);
            for axis in 0..3 {
                constants[0][axis][lane] = slabs.near_origin[axis];
                constants[1][axis][lane] = slabs.far_origin[axis];
                constants[2][axis][lane] = slabs.near_rcp[axis];
                constants[3][axis][lane] = slabs.far_rcp[axis];
            }
        }
        for (axis, negative) in negative.iter_mut().enumerate() {
            let d = [&rays.direction.x, &rays.direction.y, &rays.direction.z][axis];
            *negative = (0..LANES).fold(0, |bits, lane| bits | usize::from(d[lane].is_sign_negative()) << lane);
        }
        let load = |c: usize| [s.load(&constants[c][0]), s.load(&constants[c][1]), s.load(&constants[c][2])];
        Self { near_origin: load(0), far_origin: load(1), near_rcp: load(2), far_rcp: load(3), negative }
    }

    /// Near (not below 0) and far distances of one box for a packet of rays: lanes have the bits of [`Slabs::interval`].
    #[inline(always)]
    pub(crate) fn one_box(&self, s: S, bounds: &Bounds) -> (S::F, S::F) {
        let (mut near, mut far) = (s.splat(0.0), s.splat(f32::INFINITY));
        for axis in 0..3 {
            let (lower, upper) = (s.splat(bounds.lo[axis]), s.splat(bounds.hi[axis]));
            let negative = self.negative[axis] as u32;
            let (entry, exit) = (s.select(negative, upper, lower), s.select(negative, lower, upper));
            (near, far) = self.clip(s, axis, entry, exit, near, far);
        }
        (near, far)
    }
}

impl<const N: usize, S: Simd<N>> WideSlabs<S, N> {
    /// The part of [near, far] between two planes.
    #[inline(always)]
    fn clip(&self, s: S, axis: usize, entry: S::F, exit: S::F, near: S::F, far: S::F) -> (S::F, S::F) {
        let t0 = s.mul(s.sub(entry, self.near_origin[axis]), self.near_rcp[axis]);
        let t1 = s.mul(s.sub(exit, self.far_origin[axis]), self.far_rcp[axis]);
        (s.max(t0, near), s.min(t1, far))
    }
}

impl<S: Simd> WideSlabs<S> {
    #[inline(always)]
    pub(crate) fn new(s: S, slabs: &Slabs) -> Self {
        Self {
            near_origin: splat3(s, slabs.near_origin),
            far_origin: splat3(s, slabs.far_origin),
            near_rcp: splat3(s, slabs.near_rcp),
            far_rcp: splat3(s, slabs.far_rcp),
            negative: slabs.negative,
        }
    }

    /// Near (not below 0) and far (not above `limit`) distances of eight boxes, planes as `[axis][lower, upper]`.
    /// A NaN (0·∞: origin on a plane that the ray is parallel to) is ignored by the order of the min/max operands.
    #[inline(always)]
    pub(crate) fn boxes(&self, s: S, planes: &[[[f32; 8]; 2]; 3], limit: f32) -> (S::F, S::F) {
        let (mut near, mut far) = (s.splat(0.0), s.splat(limit));
        for (axis, planes) in planes.iter().enumerate() {
            let negative = self.negative[axis];
            let (entry, exit) = (s.load(&planes[negative]), s.load(&planes[1 - negative]));
            (near, far) = self.clip(s, axis, entry, exit, near, far);
        }
        (near, far)
    }

    /// The same for the boxes of eight triangles, vertices as `[vertex][axis]`.
    #[inline(always)]
    pub(crate) fn triangles(&self, s: S, vertex: &[[[f32; 8]; 3]; 3]) -> (S::F, S::F) {
        let (mut near, mut far) = (s.splat(0.0), s.splat(f32::INFINITY));
        let [a, b, c] = vertex;
        for (axis, ((a, b), c)) in a.iter().zip(b).zip(c).enumerate() {
            let (a, b, c) = (s.load(a), s.load(b), s.load(c));
            let (lower, upper) = (s.min(s.min(a, b), c), s.max(s.max(a, b), c));
            let (entry, exit) = if self.negative[axis] == 1 { (upper, lower) } else { (lower, upper) };
            (near, far) = self.clip(s, axis, entry, exit, near, far);
        }
        (near, far)
    }
}

#[inline(always)]
fn splat3<S: Simd>(s: S, x: [f32; 3]) -> [S::F; 3] {
    [s.splat(x[0]), s.splat(x[1]), s.splat(x[2])]
}

/// Axis of the largest direction component.
#[inline(always)]
pub(crate) fn longest_axis(d: Vec3) -> u32 {
    let d = d.abs();
    if d.x >= d.y {
        if d.x >= d.z { 0 } else { 2 }
    } else if d.y >= d.z {
        1
    } else {
        2
    }
}
