//! The watertight ray-triangle test of Woop, Benthin & Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013,
//! on packets of eight triangles.
//!
//! What it decides, as a pure function of ray and triangle (so that every intersector gives the same bits):
//! - inside or not: by the signs of the three edge functions in sheared space; where one is 0 all are recomputed in f64,
//!   where the products are exact. Edges belong to both triangles; zero-area and edge-on triangles are never hit.
//! - t: barycentric mix of the vertices' depths, clamped to the padded box interval of the triangle. The clamp makes a
//!   node's entry distance a true lower bound of the computed t of all that is inside, so culling changes no bit.
//! - in front or behind, before or beyond `t_max`: where the box interval leaves no doubt, by it; else by the side of the
//!   triangle's plane that origin (end) lies on, in f64. So a ray that starts off its surface by the error bound of the
//!   hit point does not find that surface again, however grazing, and one that starts 1e-30 before a wall finds it.

use super::Ray;
use super::simd::Simd;
use super::slab::{Bounds, WideSlabs, longest_axis};
use crate::math::Vec3;
use glam::DVec3;

/// Eight triangles: `vertex[v][axis][lane]`. Unused lanes are NaN, which no comparison passes.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(crate) struct Packet {
    vertex: [[[f32; 8]; 3]; 3],
    pub(crate) primitive: [u32; 8],
}

/// Per-ray constants of the triangle test.
pub(crate) struct TriangleRay<S: Simd> {
    /// x, y, z axis of the sheared space; z is the direction's longest.
    axes: [usize; 3],
    origin: [S::F; 3],
    /// dx/dz, dy/dz, 1/dz.
    shear: [S::F; 3],
    ray: Ray,
}

impl<S: Simd> TriangleRay<S> {
    #[inline(always)]
    pub(crate) fn new(s: S, ray: &Ray) -> Self {
        let (o, d) = (ray.origin.to_array(), ray.direction.to_array());
        let z = longest_axis(ray.direction);
        let x = if z == 2 { 0 } else { z + 1 };
        let y = if x == 2 { 0 } else { x + 1 };
        let rcp = 1.0 / d[z];
        Self {
            axes: [x, y, z],
            origin: [s.splat(o[x]), s.splat(o[y]), s.splat(o[z])],
            shear: [s.splat(d[x] * rcp), s.splat(d[y] * rcp), s.splat(rcp)],
            ray: *ray,
        }
    }
}

/// What a packet test found: lanes hit, with their distances and barycentric weights of vertices 1 and 2.
pub(crate) struct Candidates<S: Simd> {
    pub(crate) lanes: u32,
    pub(crate) t: S::F,
    pub(crate) u: S::F,
    pub(crate) v: S::F,
}

impl Packet {
    /// Up to eight triangles with their primitive indices.
    pub(crate) fn new(triangles: impl IntoIterator<Item = (u32, [Vec3; 3])>) -> Self {
        let mut packet = Self { vertex: [[[f32::NAN; 8]; 3]; 3], primitive: [u32::MAX; 8] };
        for (lane, (primitive, vertices)) in triangles.into_iter().enumerate() {
            packet.primitive[lane] = primitive;
            for (v, p) in vertices.iter().enumerate() {
                for a in 0..3 {
                    packet.vertex[v][a][lane] = p[a];
                }
            }
        }
        packet
    }

    /// Lanes with 0 ≤ t < t_max and t ≤ `best`.
    #[inline(always)]
    pub(crate) fn intersect<S: Simd>(
        &self,
        s: S,
        ray: &TriangleRay<S>,
        slabs: &WideSlabs<S>,
        best: f32,
    ) -> Candidates<S> {
        let zero = s.splat(0.0);
        let miss = Candidates { lanes: 0, t: zero, u: zero, v: zero };
        let p = [self.shear(s, ray, 0), self.shear(s, ray, 1), self.shear(s, ray, 2)];
        let mut weight = [edge(s, &p[2], &p[1]), edge(s, &p[0], &p[2]), edge(s, &p[1], &p[0])];
        let least = s.min(s.min(weight[0], weight[1]), weight[2]);
        let most = s.max(s.max(weight[0], weight[1]), weight[2]);
        let mut lanes = s.le(zero, least) | s.le(most, zero);
        if lanes == 0 {
            return miss;
        }
        let on_edge = lanes & (s.eq(least, zero) | s.eq(most, zero));
        if on_edge != 0 {
            let xy = [store_xy(s, &p[0]), store_xy(s, &p[1]), store_xy(s, &p[2])];
            let mut w = [s.store(weight[0]), s.store(weight[1]), s.store(weight[2])];
            lanes &= !exact_edges(&xy, on_edge, &mut w);
            weight = [s.load(&w[0]), s.load(&w[1]), s.load(&w[2])];
        }
        let det = s.add(s.add(weight[0], weight[1]), weight[2]);
        let b = [s.div(weight[0], det), s.div(weight[1], det), s.div(weight[2], det)];
        let t = s.add(s.add(s.mul(b[0], p[0][2]), s.mul(b[1], p[1][2])), s.mul(b[2], p[2][2]));

        let (near, far) = slabs.triangles(s, &self.vertex);
        lanes &= s.le(near, far) & s.le(near, s.splat(best));
        if lanes == 0 {
            return miss;
        }
        let mut t = s.min(s.max(t, near), far);
        let doubtful = lanes & (s.le(near, zero) | s.le(s.splat(ray.ray.t_max), far));
        if doubtful != 0 {
            let mut all = s.store(t);
            lanes &= !self.decide(&ray.ray, doubtful, &mut all, &s.store(near), &s.store(far));
            t = s.load(&all);
        }
        Candidates { lanes: lanes & s.le(t, s.splat(best)), t, u: b[1], v: b[2] }
    }

    /// Vertex `v` relative to the origin, sheared so that the ray is the z axis.
    #[inline(always)]
    fn shear<S: Simd>(&self, s: S, ray: &TriangleRay<S>, v: usize) -> [S::F; 3] {
        let [x, y, z] = ray.axes;
        let vertex = &self.vertex[v];
        let depth = s.sub(s.load(&vertex[z]), ray.origin[2]);
        [
            s.sub(s.sub(s.load(&vertex[x]), ray.origin[0]), s.mul(ray.shear[0], depth)),
            s.sub(s.sub(s.load(&vertex[y]), ray.origin[1]), s.mul(ray.shear[1], depth)),
            s.mul(ray.shear[2], depth),
        ]
    }

    /// Decides in f64 whether 0 ≤ t < t_max for lanes whose box contains the origin or the end. Returns the lanes that fail;
    /// writes t for the others.
    #[cold]
    #[inline(never)]
    fn decide(&self, ray: &Ray, doubtful: u32, t: &mut [f32; 8], near: &[f32; 8], far: &[f32; 8]) -> u32 {
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let mut failed = 0;
        for lane in lanes(doubtful) {
            let [a, b, c] = self.triangle(lane).map(Vec3::as_dvec3);
            let n = (b - a).cross(c - a);
            let depth = n.dot(a - o) / n.dot(d);
            // Edge-on to the last bit: the plane says nothing, the f32 value stands.
            let exact = if depth.is_finite() { depth } else { f64::from(t[lane]) };
            if exact >= 0.0 && exact < f64::from(ray.t_max) {
                // Rounding to f32 must not reach t_max; then into the box interval again.
                let rounded = (exact as f32).min(ray.t_max.next_down());
                t[lane] = rounded.max(near[lane]).min(far[lane]);
            } else {
                failed |= 1 << lane;
            }
        }
        failed
    }

    fn triangle(&self, lane: usize) -> [Vec3; 3] {
        [0, 1, 2].map(|v| Vec3::from_array([0, 1, 2].map(|a| self.vertex[v][a][lane])))
    }
}

/// Twice the signed area of the triangle (origin, b, a) in the xy plane.
#[inline(always)]
fn edge<S: Simd>(s: S, a: &[S::F; 3], b: &[S::F; 3]) -> S::F {
    s.sub(s.mul(a[0], b[1]), s.mul(a[1], b[0]))
}

#[inline(always)]
fn store_xy<S: Simd>(s: S, p: &[S::F; 3]) -> [[f32; 8]; 2] {
    [s.store(p[0]), s.store(p[1])]
}

/// Recomputes the edge functions of `on_edge` lanes in f64 from the sheared f32 vertices (same vertices, so still
/// consistent between neighbours). Returns the lanes that are outside or degenerate; scales the others' weights to ≤ 1.
#[cold]
#[inline(never)]
fn exact_edges(xy: &[[[f32; 8]; 2]; 3], on_edge: u32, weight: &mut [[f32; 8]; 3]) -> u32 {
    let mut outside = 0;
    for lane in lanes(on_edge) {
        let at = |v: usize, a: usize| f64::from(xy[v][a][lane]);
        let edge = |a: usize, b: usize| at(a, 0) * at(b, 1) - at(a, 1) * at(b, 0);
        let w = DVec3::new(edge(2, 1), edge(0, 2), edge(1, 0));
        let largest = w.abs().max_element();
        if (w.min_element() < 0.0 && w.max_element() > 0.0) || largest == 0.0 {
            outside |= 1 << lane;
        } else {
            for v in 0..3 {
                weight[v][lane] = (w[v] / largest) as f32;
            }
        }
    }
    outside
}

/// Indices of the set bits, lowest first.
#[inline(always)]
pub(crate) fn lanes(mut mask: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        (mask != 0).then(|| {
            let lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            lane
        })
    })
}

/// Box of a triangle.
pub(crate) fn bounds(t: &[Vec3; 3]) -> Bounds {
    Bounds { lo: t[0].min(t[1]).min(t[2]), hi: t[0].max(t[1]).max(t[2]) }
}
