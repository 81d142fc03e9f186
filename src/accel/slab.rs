//! Ray against axis-aligned boxes, conservatively.
//!
//! The triangle test works in a sheared space where each vertex is off by a few roundings (Woop, Benthin & Wald 2013, §3.3).
//! Boxes are therefore widened, per ray, by a bound on that error: the origin is moved back for the near planes and on for
//! the far planes, so that the test costs no more than an exact one. All steps are monotonic in the planes; hence the
//! interval of a box contains that of every box inside it, bit for bit.

use super::Ray;
use super::simd::Simd;
use crate::math::Vec3;
use crate::math::robust::UNIT_ROUNDOFF;

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

/// What all tests want to know of a direction.
pub(crate) struct Axes {
    /// 1/direction.
    pub(crate) rcp: Vec3,
    /// Axis of the largest component.
    pub(crate) z: usize,
}

impl Axes {
    #[inline(always)]
    pub(crate) fn new(direction: Vec3) -> Self {
        let d = direction.abs();
        // Without branches: random directions would mispredict them.
        let xy = usize::from(d.y > d.x);
        let z = if d.z > d.x.max(d.y) { 2 } else { xy };
        Self { rcp: direction.recip(), z }
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
    pub(crate) fn new(ray: &Ray, axes: &Axes, scene: &Bounds) -> Self {
        let (o, d) = (ray.origin, ray.direction);
        let reach = (scene.lo - o).abs().max((scene.hi - o).abs());
        let (rcp_z, reach_z) = (axes.rcp.to_array()[axes.z].abs(), reach.to_array()[axes.z]);
        // Shear error: 2u|v−o| + 5u|d/dz|·|vz−oz|; the last term covers the rounding of o ± pad.
        let pad = (reach * 4.0 + d.abs() * rcp_z * (8.0 * reach_z) + o.abs() * 2.0) * UNIT_ROUNDOFF;
        let pad = pad.copysign(d);
        Self {
            near_origin: (o + pad).to_array(),
            far_origin: (o - pad).to_array(),
            // Four roundings in (plane − origin)·rcp·factor.
            near_rcp: (axes.rcp * (1.0 - 6.0 * UNIT_ROUNDOFF)).to_array(),
            far_rcp: (axes.rcp * (1.0 + 6.0 * UNIT_ROUNDOFF)).to_array(),
            negative: [d.x, d.y, d.z].map(|d| (d.to_bits() >> 31) as usize),
        }
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
pub(crate) struct WideSlabs<S: Simd> {
    near_origin: [S::F; 3],
    far_origin: [S::F; 3],
    near_rcp: [S::F; 3],
    far_rcp: [S::F; 3],
    negative: [usize; 3],
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
            let t0 = s.mul(s.sub(s.load(&planes[negative]), self.near_origin[axis]), self.near_rcp[axis]);
            let t1 = s.mul(s.sub(s.load(&planes[1 - negative]), self.far_origin[axis]), self.far_rcp[axis]);
            near = s.max(t0, near);
            far = s.min(t1, far);
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
            near = s.max(s.mul(s.sub(entry, self.near_origin[axis]), self.near_rcp[axis]), near);
            far = s.min(s.mul(s.sub(exit, self.far_origin[axis]), self.far_rcp[axis]), far);
        }
        (near, far)
    }
}

#[inline(always)]
fn splat3<S: Simd>(s: S, x: [f32; 3]) -> [S::F; 3] {
    [s.splat(x[0]), s.splat(x[1]), s.splat(x[2])]
}
