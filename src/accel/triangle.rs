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
//! - never the triangle that the ray says it starts or ends on.

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

/// Lanes whose triangle is crossed by the ray's line, not yet by the ray.
struct Crossed<S: Simd> {
    lanes: u32,
    /// Lanes whose box does not tell whether 0 ≤ t < t_max.
    doubtful: u32,
    /// Edge functions: barycentric weights times their sum.
    weight: [S::F; 3],
    /// Depths of the vertices, in units of t.
    depth: [S::F; 3],
    near: S::F,
    far: S::F,
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
    pub(crate) fn closest<S: Simd>(
        &self,
        s: S,
        ray: &TriangleRay<S>,
        slabs: &WideSlabs<S>,
        best: f32,
    ) -> Option<Candidates<S>> {
        let Crossed { mut lanes, doubtful, weight, depth, near, far } = self.crossed(s, ray, slabs, best)?;
        let mut t = distance(s, &weight, &depth, near, far);
        for lane in set_bits(doubtful) {
            let mut all = s.store(t);
            match self.decide(&ray.ray, lane, all[lane]) {
                Some(exact) => {
                    all[lane] = exact.max(s.store(near)[lane]).min(s.store(far)[lane]);
                    t = s.load(&all);
                }
                None => lanes &= !(1 << lane),
            }
        }
        let lanes = lanes & s.le(t, s.splat(best));
        let det = s.add(s.add(weight[0], weight[1]), weight[2]);
        Some(Candidates { lanes, t, u: s.div(weight[1], det), v: s.div(weight[2], det) })
    }

    /// Whether any lane has 0 ≤ t < t_max.
    #[inline(always)]
    pub(crate) fn any<S: Simd>(&self, s: S, ray: &TriangleRay<S>, slabs: &WideSlabs<S>) -> bool {
        let Some(Crossed { lanes, doubtful, weight, depth, near, far }) =
            self.crossed(s, ray, slabs, ray.ray.t_max.next_down())
        else {
            return false;
        };
        if lanes != doubtful {
            return true;
        }
        let t = s.store(distance(s, &weight, &depth, near, far));
        set_bits(doubtful).any(|lane| self.decide(&ray.ray, lane, t[lane]).is_some())
    }

    /// Lanes whose triangle the ray's line crosses and whose box lies at or before `best`.
    #[inline(always)]
    fn crossed<S: Simd>(&self, s: S, ray: &TriangleRay<S>, slabs: &WideSlabs<S>, best: f32) -> Option<Crossed<S>> {
        let zero = s.splat(0.0);
        let p = [self.shear(s, ray, 0), self.shear(s, ray, 1), self.shear(s, ray, 2)];
        let mut weight = [edge(s, &p[2], &p[1]), edge(s, &p[0], &p[2]), edge(s, &p[1], &p[0])];
        let least = s.min(s.min(weight[0], weight[1]), weight[2]);
        let most = s.max(s.max(weight[0], weight[1]), weight[2]);
        let mut lanes = s.le(zero, least) | s.le(most, zero);
        if lanes == 0 {
            return None;
        }
        let on_edge = lanes & (s.eq(least, zero) | s.eq(most, zero));
        if on_edge != 0 {
            let xy = [store_xy(s, &p[0]), store_xy(s, &p[1]), store_xy(s, &p[2])];
            let mut w = [s.store(weight[0]), s.store(weight[1]), s.store(weight[2])];
            lanes &= !exact_edges(&xy, on_edge, &mut w);
            weight = [s.load(&w[0]), s.load(&w[1]), s.load(&w[2])];
        }
        let (near, far) = slabs.triangles(s, &self.vertex);
        lanes &= s.le(near, far) & s.le(near, s.splat(best)) & !self.ends(&ray.ray);
        let doubtful = lanes & (s.le(near, zero) | s.le(s.splat(ray.ray.t_max), far));
        (lanes != 0).then_some(Crossed { lanes, doubtful, weight, depth: [p[0][2], p[1][2], p[2][2]], near, far })
    }

    /// Lanes of the triangles that the ray starts and ends on.
    #[inline(always)]
    fn ends(&self, ray: &Ray) -> u32 {
        let is_end = |&p: &u32| p == ray.from || p == ray.to;
        self.primitive.iter().enumerate().fold(0, |lanes, (i, p)| lanes | u32::from(is_end(p)) << i)
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

    /// t of a lane whose box contains the origin or the end, if 0 ≤ t < t_max, decided in f64 by the triangle's plane.
    /// `rough` is the f32 value; it stands where the ray is edge-on to the last bit and the plane says nothing.
    #[cold]
    #[inline(never)]
    fn decide(&self, ray: &Ray, lane: usize, rough: f32) -> Option<f32> {
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let [a, b, c] = self.triangle(lane).map(Vec3::as_dvec3);
        let n = (b - a).cross(c - a);
        let depth = n.dot(a - o) / n.dot(d);
        let exact = if depth.is_finite() { depth } else { f64::from(rough) };
        // Rounding to f32 must not reach t_max.
        (exact >= 0.0 && exact < f64::from(ray.t_max)).then(|| (exact as f32).min(ray.t_max.next_down()))
    }

    fn triangle(&self, lane: usize) -> [Vec3; 3] {
        [0, 1, 2].map(|v| Vec3::from_array([0, 1, 2].map(|a| self.vertex[v][a][lane])))
    }
}

/// Mix of the depths, clamped to the box interval.
#[inline(always)]
fn distance<S: Simd>(s: S, weight: &[S::F; 3], depth: &[S::F; 3], near: S::F, far: S::F) -> S::F {
    let det = s.add(s.add(weight[0], weight[1]), weight[2]);
    // Weights first: their products with the depths stay in range.
    let mix = s.add(
        s.add(s.mul(s.div(weight[0], det), depth[0]), s.mul(s.div(weight[1], det), depth[1])),
        s.mul(s.div(weight[2], det), depth[2]),
    );
    s.min(s.max(mix, near), far)
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
    for lane in set_bits(on_edge) {
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
pub(crate) fn set_bits(mut mask: u32) -> impl Iterator<Item = usize> {
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
