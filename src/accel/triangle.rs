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
//! - never a triangle that lies wholly behind the origin or beyond the end along the longest axis;
//! - never the triangle that the ray says it starts or ends on.

use super::Ray;
use super::simd::Simd;
use super::slab::{Bounds, WideSlabs, longest_axis};
use crate::math::Vec3;
use crate::math::lanes::set_bits;
use crate::math::robust::UNIT_ROUNDOFF;
use glam::DVec3;

/// Eight triangles: `vertex[v][axis][lane]`. Unused lanes are NaN, which no comparison passes.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(crate) struct Packet {
    vertex: [[[f32; 8]; 3]; 3],
    pub(crate) primitive: [u32; 8],
}

/// The shear that makes a ray the z axis.
#[derive(Clone, Copy)]
pub(super) struct Shear {
    /// x, y, z axis of the sheared space; z is the direction's longest.
    pub(super) axes: [u32; 3],
    pub(super) origin: [f32; 3],
    /// dx/dz, dy/dz, 1/dz.
    pub(super) shear: [f32; 3],
}

impl Shear {
    #[inline(always)]
    pub(super) fn new(ray: &Ray) -> Self {
        let z = longest_axis(ray.direction);
        let x = if z == 2 { 0 } else { z + 1 };
        let y = if x == 2 { 0 } else { x + 1 };
        // Selections, not indices: they stay in registers.
        let pick = |v: Vec3, axis| match axis {
            0 => v.x,
            1 => v.y,
            _ => v.z,
        };
        let permute = |v| [pick(v, x), pick(v, y), pick(v, z)];
        let d = permute(ray.direction);
        let rcp = 1.0 / d[2];
        Self { axes: [x, y, z], origin: permute(ray.origin), shear: [d[0] * rcp, d[1] * rcp, rcp] }
    }
}

/// [`Shear`] for lanes: of one ray or of several.
pub(super) struct WideShear<S: Simd<N>, const N: usize = 8> {
    pub(super) origin: [S::F; 3],
    pub(super) shear: [S::F; 3],
}

impl<const N: usize, S: Simd<N>> WideShear<S, N> {
    /// A vertex relative to the origin, sheared so that the ray is the z axis; depth in units of t.
    #[inline(always)]
    pub(super) fn apply(&self, s: S, [x, y, z]: [S::F; 3]) -> [S::F; 3] {
        let depth = s.sub(z, self.origin[2]);
        [
            s.sub(s.sub(x, self.origin[0]), s.mul(self.shear[0], depth)),
            s.sub(s.sub(y, self.origin[1]), s.mul(self.shear[1], depth)),
            s.mul(self.shear[2], depth),
        ]
    }
}

/// Per-ray constants of the triangle test.
pub(crate) struct TriangleRay<S: Simd> {
    axes: [u32; 3],
    shear: WideShear<S>,
    ray: Ray,
}

impl<S: Simd> TriangleRay<S> {
    #[inline(always)]
    pub(crate) fn new(s: S, ray: &Ray) -> Self {
        let Shear { axes, origin: o, shear: k } = Shear::new(ray);
        let shear = WideShear {
            origin: [s.splat(o[0]), s.splat(o[1]), s.splat(o[2])],
            shear: [s.splat(k[0]), s.splat(k[1]), s.splat(k[2])],
        };
        Self { axes, shear, ray: *ray }
    }
}

/// Sheared triangles against the z axis.
pub(super) struct Crossing<S: Simd<N>, const N: usize = 8> {
    /// Where the axis crosses the triangle; edges that it meets to the last bit are not settled yet.
    pub(super) lanes: u32,
    /// Edge functions: barycentric weights times their sum.
    pub(super) weight: [S::F; 3],
    least: S::F,
    most: S::F,
}

impl<const N: usize, S: Simd<N>> Crossing<S, N> {
    #[inline(always)]
    pub(super) fn new(s: S, p: &[[S::F; 3]; 3]) -> Self {
        let weight = [edge(s, &p[2], &p[1]), edge(s, &p[0], &p[2]), edge(s, &p[1], &p[0])];
        let least = s.min(s.min(weight[0], weight[1]), weight[2]);
        let most = s.max(s.max(weight[0], weight[1]), weight[2]);
        let zero = s.splat(0.0);
        Self { lanes: s.le(zero, least) | s.le(most, zero), weight, least, most }
    }

    /// Settles lanes whose axis meets an edge.
    #[inline(always)]
    pub(super) fn settle(&mut self, s: S, p: &[[S::F; 3]; 3]) {
        let zero = s.splat(0.0);
        let on_edge = self.lanes & (s.eq(self.least, zero) | s.eq(self.most, zero));
        if on_edge != 0 {
            let xy = [store_xy(s, &p[0]), store_xy(s, &p[1]), store_xy(s, &p[2])];
            let mut w = [s.store(self.weight[0]), s.store(self.weight[1]), s.store(self.weight[2])];
            self.lanes &= !exact_edges(&xy, on_edge, &mut w);
            self.weight = [s.load(&w[0]), s.load(&w[1]), s.load(&w[2])];
        }
    }

    /// Barycentric weights of vertices 1 and 2.
    #[inline(always)]
    pub(super) fn barycentric(&self, s: S) -> [S::F; 2] {
        let det = s.add(s.add(self.weight[0], self.weight[1]), self.weight[2]);
        [s.div(self.weight[1], det), s.div(self.weight[2], det)]
    }
}

/// Lanes whose triangle is not wholly behind the origin or beyond `reach` along the longest axis. Signs of differences are
/// exact; [`REACH`] leaves room for the roundings of depths.
#[inline(always)]
pub(super) fn within<const N: usize, S: Simd<N>>(s: S, p: &[[S::F; 3]; 3], reach: S::F) -> u32 {
    let first = s.min(s.min(p[0][2], p[1][2]), p[2][2]);
    let last = s.max(s.max(p[0][2], p[1][2]), p[2][2]);
    s.le(s.splat(0.0), last) & s.le(first, reach)
}

/// `reach` over `t_max`: see [`within`].
pub(super) const REACH: f32 = 1.0 + 8.0 * UNIT_ROUNDOFF;

/// Lanes whose triangle is crossed by the ray's line, not yet by the ray.
struct Crossed<S: Simd> {
    lanes: u32,
    /// Lanes whose box does not tell whether 0 ≤ t < t_max.
    doubtful: u32,
    crossing: Crossing<S>,
    t: S::F,
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
        let Crossed { mut lanes, doubtful, crossing, mut t, near, far } = self.crossed(s, ray, slabs, best)?;
        if doubtful != 0 {
            (lanes, t) = settle_ends(s, lanes, doubtful, t, [near, far], |lane, rough| {
                decide(&ray.ray, self.triangle(lane), rough)
            });
        }
        let lanes = lanes & s.le(t, s.splat(best));
        let [u, v] = crossing.barycentric(s);
        Some(Candidates { lanes, t, u, v })
    }

    /// Whether any lane has 0 ≤ t < t_max.
    #[inline(always)]
    pub(crate) fn any<S: Simd>(&self, s: S, ray: &TriangleRay<S>, slabs: &WideSlabs<S>) -> bool {
        let Some(Crossed { lanes, doubtful, t, .. }) = self.crossed(s, ray, slabs, ray.ray.t_max.next_down()) else {
            return false;
        };
        if lanes != doubtful {
            return true;
        }
        let t = s.store(t);
        set_bits(doubtful).any(|lane| decide(&ray.ray, self.triangle(lane), t[lane]).is_some())
    }

    /// Lanes whose triangle the ray's line crosses and whose box lies at or before `best`.
    #[inline(always)]
    fn crossed<S: Simd>(&self, s: S, ray: &TriangleRay<S>, slabs: &WideSlabs<S>, best: f32) -> Option<Crossed<S>> {
        let p = [self.shear(s, ray, 0), self.shear(s, ray, 1), self.shear(s, ray, 2)];
        let mut crossing = Crossing::new(s, &p);
        if crossing.lanes == 0 {
            return None;
        }
        crossing.settle(s, &p);
        let (near, far) = slabs.triangles(s, &self.vertex);
        let mut lanes = crossing.lanes & within(s, &p, s.splat(ray.ray.t_max * REACH));
        lanes &= s.le(near, far) & s.le(near, s.splat(best)) & !self.ends(&ray.ray);
        if lanes == 0 {
            return None;
        }
        let doubtful = lanes & (s.le(near, s.splat(0.0)) | s.le(s.splat(ray.ray.t_max), far));
        let t = distance(s, &crossing.weight, &p, near, far);
        Some(Crossed { lanes, doubtful, crossing, t, near, far })
    }

    /// Lanes of the triangles that the ray starts and ends on.
    #[inline(always)]
    fn ends(&self, ray: &Ray) -> u32 {
        let is_end = |&p: &u32| p == ray.from || p == ray.to;
        self.primitive.iter().enumerate().fold(0, |lanes, (i, p)| lanes | u32::from(is_end(p)) << i)
    }

    #[inline(always)]
    fn shear<S: Simd>(&self, s: S, ray: &TriangleRay<S>, v: usize) -> [S::F; 3] {
        let [x, y, z] = ray.axes;
        let vertex = &self.vertex[v];
        ray.shear.apply(s, [s.load(&vertex[x as usize]), s.load(&vertex[y as usize]), s.load(&vertex[z as usize])])
    }

    fn triangle(&self, lane: usize) -> [Vec3; 3] {
        [0, 1, 2].map(|v| Vec3::from_array([0, 1, 2].map(|a| self.vertex[v][a][lane])))
    }
}

/// t of a triangle whose box contains the origin or the end, if 0 ≤ t < t_max, decided in f64 by the triangle's plane.
/// `rough` is the f32 value; it stands where the ray is edge-on to the last bit and the plane says nothing.
#[cold]
#[inline(never)]
pub(super) fn decide(ray: &Ray, triangle: [Vec3; 3], rough: f32) -> Option<f32> {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let [a, b, c] = triangle.map(Vec3::as_dvec3);
    let n = (b - a).cross(c - a);
    let depth = n.dot(a - o) / n.dot(d);
    let exact = if depth.is_finite() { depth } else { f64::from(rough) };
    // Rounding to f32 must not reach t_max.
    (exact >= 0.0 && exact < f64::from(ray.t_max)).then(|| (exact as f32).min(ray.t_max.next_down()))
}

/// Decides the doubtful lanes: lanes that remain, and t with the decided distances, still inside the box interval.
#[cold]
#[inline(always)]
pub(super) fn settle_ends<const N: usize, S: Simd<N>>(
    s: S,
    mut lanes: u32,
    doubtful: u32,
    t: S::F,
    [near, far]: [S::F; 2],
    decide: impl Fn(usize, f32) -> Option<f32>,
) -> (u32, S::F) {
    let (mut t, near, far) = (s.store(t), s.store(near), s.store(far));
    for lane in set_bits(doubtful) {
        match decide(lane, t[lane]) {
            Some(exact) => t[lane] = exact.max(near[lane]).min(far[lane]),
            None => lanes &= !(1 << lane),
        }
    }
    (lanes, s.load(&t))
}

/// Mix of the depths, clamped to the box interval.
#[inline(always)]
pub(super) fn distance<const N: usize, S: Simd<N>>(
    s: S,
    weight: &[S::F; 3],
    p: &[[S::F; 3]; 3],
    near: S::F,
    far: S::F,
) -> S::F {
    let det = s.add(s.add(weight[0], weight[1]), weight[2]);
    // Weights first: their products with the depths stay in range.
    let mix = s.add(
        s.add(s.mul(s.div(weight[0], det), p[0][2]), s.mul(s.div(weight[1], det), p[1][2])),
        s.mul(s.div(weight[2], det), p[2][2]),
    );
    s.min(s.max(mix, near), far)
}

/// Twice the signed area of the triangle (origin, b, a) in the xy plane.
#[inline(always)]
pub(super) fn edge<const N: usize, S: Simd<N>>(s: S, a: &[S::F; 3], b: &[S::F; 3]) -> S::F {
    s.sub(s.mul(a[0], b[1]), s.mul(a[1], b[0]))
}

#[inline(always)]
fn store_xy<const N: usize, S: Simd<N>>(s: S, p: &[S::F; 3]) -> [[f32; N]; 2] {
    [s.store(p[0]), s.store(p[1])]
}

/// Recomputes the edge functions of `on_edge` lanes in f64 from the sheared f32 vertices (same vertices, so still
/// consistent between neighbours). Returns the lanes that are outside or degenerate; scales the others' weights to ≤ 1.
#[cold]
#[inline(never)]
fn exact_edges<const N: usize>(xy: &[[[f32; N]; 2]; 3], on_edge: u32, weight: &mut [[f32; N]; 3]) -> u32 {
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

/// Box of a triangle.
pub(crate) fn bounds(t: &[Vec3; 3]) -> Bounds {
    Bounds { lo: t[0].min(t[1]).min(t[2]), hi: t[0].max(t[1]).max(t[2]) }
}
