//! From a hit to a surface point, and from surface points to the rays that leave them.

use super::parameterization::has_uvs;
use super::quadric::Quadric;
use super::simd::Registers;
use super::{Hit, Hits, NO_PRIMITIVE, Ray, Rays, SurfacePoint};
use crate::math::lanes::{bits, set_bits};
use crate::math::robust::{UNIT_ROUNDOFF, gamma, offset_origin};
use crate::math::{LANES, Vec3, Vec3Lanes};
use crate::scene::{Geometry, Scene};

/// One end of a ray or segment: a point, the bound on its error and the normal of the surface it lies on.
#[derive(Clone, Copy, Debug)]
pub struct Endpoint {
    /// Position, world space.
    pub p: Vec3,
    /// Bound on the absolute error of `p`, per axis.
    pub p_error: Vec3,
    /// Unit normal of the surface, either side (of a light: the emitting one); zero where there is no surface.
    pub ng: Vec3,
    /// Triangle that it lies on, or [`NO_PRIMITIVE`].
    pub triangle: u32,
}

impl Endpoint {
    /// A point in space: nothing to move off.
    #[inline(always)]
    pub fn free(p: Vec3) -> Self {
        Self { p, p_error: Vec3::ZERO, ng: Vec3::ZERO, triangle: NO_PRIMITIVE }
    }
}

/// [`Endpoint`] for lanes.
#[derive(Clone, Copy, Debug)]
pub struct EndpointLanes {
    /// See [`Endpoint::p`].
    pub p: Vec3Lanes,
    /// See [`Endpoint::p_error`].
    pub p_error: Vec3Lanes,
    /// See [`Endpoint::ng`].
    pub ng: Vec3Lanes,
    /// See [`Endpoint::triangle`].
    pub triangle: [u32; LANES],
}

impl EndpointLanes {
    /// Points at the origin, on no surface.
    pub const ZERO: Self = {
        let zero = Vec3Lanes::ZERO;
        Self { p: zero, p_error: zero, ng: zero, triangle: [0; LANES] }
    };

    /// The end of a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Endpoint {
        Endpoint {
            p: self.p.get(lane),
            p_error: self.p_error.get(lane),
            ng: self.ng.get(lane),
            triangle: self.triangle[lane],
        }
    }

    /// Replaces the end of a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, end: Endpoint) {
        self.p.set(lane, end.p);
        self.p_error.set(lane, end.p_error);
        self.ng.set(lane, end.ng);
        self.triangle[lane] = end.triangle;
    }
}

impl From<&SurfacePoint> for Endpoint {
    #[inline(always)]
    fn from(s: &SurfacePoint) -> Self {
        Self { p: s.p, p_error: s.p_error, ng: s.ng, triangle: s.triangle }
    }
}

/// The ray from a point into a direction, started off the point's surface so that it does not find it again.
#[inline(always)]
pub fn leave(from: impl Into<Endpoint>, direction: Vec3) -> Ray {
    let from = from.into();
    let origin = offset_origin(from.p, from.p_error, from.ng, direction);
    Ray { from: from.triangle, ..Ray::new(origin, direction, f32::INFINITY) }
}

/// The segment between two points, `t_max` = 1, both ends moved off their surfaces towards each other: neither surface
/// is on it, and everything between is. Its direction is not normalised.
#[inline(always)]
pub fn segment(from: impl Into<Endpoint>, to: impl Into<Endpoint>) -> Ray {
    let (from, to) = (from.into(), to.into());
    let across = to.p - from.p;
    let origin = offset_origin(from.p, from.p_error, from.ng, across);
    // The direction is rounded, so origin + 1·direction misses the end by half an ulp of it.
    let to_error = to.p_error + across.abs() * (4.0 * UNIT_ROUNDOFF);
    let end = offset_origin(to.p, to_error, to.ng, -across);
    Ray { origin, direction: end - origin, t_max: 1.0, from: from.triangle, to: to.triangle }
}

/// A triangle as shading needs it: sixteen words, one line of the cache. Made once per scene where that is small, else at each
/// hit. GPUs get the same words.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub struct Surface {
    p0: [f32; 3],
    /// From vertex 0 to vertices 1 and 2.
    edges: [[f32; 3]; 2],
    ng: [f32; 3],
    shape: u32,
    front: u32,
    back: u32,
    /// [`SMOOTH`], [`LIGHT`], [`UVS`].
    flags: u32,
}

/// Its normals are interpolated.
const SMOOTH: u32 = 1;
/// It emits.
const LIGHT: u32 = 2;
/// Its vertices have texture coordinates.
const UVS: u32 = 4;

impl Surface {
    pub(super) fn new(scene: &Scene, triangle: u32) -> Self {
        let triangle = &scene.triangles[triangle as usize];
        let [p0, p1, p2] = triangle.vertices.map(|v| scene.positions[v as usize]);
        let shape = &scene.shapes[triangle.shape as usize];
        // f64: the cross product of a sliver's edges cancels.
        let (e1, e2) = match shape.geometry {
            Geometry::Rectangle { edge_u, edge_v, .. } => (edge_u.as_dvec3(), edge_v.as_dvec3()),
            _ => (p1.as_dvec3() - p0.as_dvec3(), p2.as_dvec3() - p0.as_dvec3()),
        };
        let ng = e1.cross(e2).normalize_or_zero().as_vec3();
        let smooth = matches!(shape.geometry, Geometry::Mesh { smooth: true, .. });
        Self {
            p0: p0.into(),
            edges: [(p1 - p0).into(), (p2 - p0).into()],
            ng: ng.into(),
            shape: triangle.shape,
            front: shape.front,
            back: shape.back,
            flags: if smooth { SMOOTH } else { 0 }
                | if shape.light.is_some() { LIGHT } else { 0 }
                | if has_uvs(scene, shape) { UVS } else { 0 },
        }
    }

    /// The same, as if its vertices had no texture coordinates.
    pub fn without_uvs(&self) -> Self {
        Self { flags: self.flags & !UVS, ..*self }
    }

    /// See [`Scene::surface_point`].
    #[inline(always)]
    pub(super) fn point(&self, scene: &Scene, hit: &Hit) -> SurfacePoint {
        let [e1, e2] = self.edges.map(Vec3::from);
        let (p, p_error) = on_plane(self.p0.into(), e1, e2, hit.u, hit.v);
        let ng = self.ng.into();
        let ns = if self.flags & SMOOTH != 0 { interpolated_normal(scene, hit, ng) } else { ng };
        SurfacePoint { p, p_error, ng, ns, shape: self.shape, triangle: hit.primitive }
    }
}

/// A point of a triangle's plane and the bound on its error.
#[inline(always)]
fn on_plane(p0: Vec3, e1: Vec3, e2: Vec3, u: f32, v: f32) -> (Vec3, Vec3) {
    let (along1, along2) = (e1 * u, e2 * v);
    let p = p0 + (along1 + along2);
    // Any (u, v) is a point of the plane: only the roundings of this sum count, not those of u and v.
    (p, (along1.abs() + along2.abs()) * gamma(4) + p.abs() * gamma(1))
}

/// Where the rays of a packet hit: [`SurfacePoint`] for lanes, and what of the shapes every path asks for.
pub struct SurfaceLanes {
    /// Position, its error, geometric normal and triangle: where rays that leave start.
    pub end: EndpointLanes,
    /// See [`SurfacePoint::ns`].
    pub ns: Vec3Lanes,
    /// See [`SurfacePoint::shape`].
    pub shape: [u32; LANES],
    /// The shapes' materials on the front side.
    pub front: [u32; LANES],
    /// The shapes' materials on the back side.
    pub back: [u32; LANES],
    /// Bit i: the shape of lane i is a light.
    pub lights: u32,
}

impl SurfaceLanes {
    /// No surfaces.
    pub const NONE: Self = {
        let none = [0; LANES];
        Self { end: EndpointLanes::ZERO, ns: Vec3Lanes::ZERO, shape: none, front: none, back: none, lights: 0 }
    };

    /// The point of a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> SurfacePoint {
        let Endpoint { p, p_error, ng, triangle } = self.end.get(lane);
        SurfacePoint { p, p_error, ng, ns: self.ns.get(lane), shape: self.shape[lane], triangle }
    }

    /// The points of `live` lanes' hits; the others may hold anything. `surfaces`: those of all triangles, or none.
    #[inline(always)]
    pub(super) fn fill<R: Registers>(
        &mut self,
        registers: R,
        surfaces: &[Surface],
        scene: &Scene,
        rays: &Rays,
        hits: &Hits,
        live: u32,
    ) {
        let mut curved = live;
        self.lights = 0;
        let triangles = scene.triangles.len() as u32;
        if triangles > 0 {
            let mut made;
            let mut rows: [&[f32; 16]; LANES];
            if let Some(any) = surfaces.first() {
                rows = [bytemuck::cast_ref(any); LANES];
                for lane in 0..LANES {
                    if let Some(surface) = surfaces.get(hits.primitive[lane] as usize) {
                        rows[lane] = bytemuck::cast_ref(surface);
                        curved &= !(1 << lane);
                    }
                }
            } else {
                made = [bytemuck::Zeroable::zeroed(); LANES];
                for lane in set_bits(live) {
                    if hits.primitive[lane] < triangles {
                        made[lane] = Surface::new(scene, hits.primitive[lane]);
                        curved &= !(1 << lane);
                    }
                }
                rows = made.each_ref().map(|surface: &Surface| bytemuck::cast_ref(surface));
            }
            let columns = registers.columns(&rows);
            let vectors = |first: usize| Vec3Lanes { x: columns[first], y: columns[first + 1], z: columns[first + 2] };
            let (p0, e1, e2) = (vectors(0), vectors(3), vectors(6));
            (self.end.ng, self.ns) = (vectors(9), vectors(9));
            (self.shape, self.front, self.back) = (words(&columns[12]), words(&columns[13]), words(&columns[14]));
            self.end.triangle = hits.primitive;
            for lane in 0..LANES {
                let (p, p_error) = on_plane(p0.get(lane), e1.get(lane), e2.get(lane), hits.u[lane], hits.v[lane]);
                self.end.p.set(lane, p);
                self.end.p_error.set(lane, p_error);
            }
            let flags = words(&columns[15]);
            let (mut smooth, mut light) = ([0; LANES], [0; LANES]);
            for lane in 0..LANES {
                smooth[lane] = flags[lane] & SMOOTH;
                light[lane] = flags[lane] & LIGHT;
            }
            self.lights = live & !curved & bits(&light);
            for lane in set_bits(live & !curved & bits(&smooth)) {
                if let Some(hit) = hits.get(lane) {
                    self.ns.set(lane, interpolated_normal(scene, &hit, self.end.ng.get(lane)));
                }
            }
        }
        for lane in set_bits(curved) {
            if let Some(hit) = hits.get(lane) {
                let index = hit.primitive - triangles;
                let at = scene.quadric_point(&rays.get(lane), &hit, index);
                let shape = &scene.shapes[index as usize];
                self.end.set(lane, Endpoint::from(&at));
                self.ns.set(lane, at.ns);
                self.shape[lane] = at.shape;
                (self.front[lane], self.back[lane]) = (shape.front, shape.back);
                self.lights |= u32::from(shape.light.is_some()) << lane;
            }
        }
    }
}

#[inline(always)]
fn words(x: &[f32; LANES]) -> [u32; LANES] {
    bytemuck::cast(*x)
}

/// The vertices' normals mixed, in the hemisphere of `ng`.
fn interpolated_normal(scene: &Scene, hit: &Hit, ng: Vec3) -> Vec3 {
    let [n0, n1, n2] = scene.triangles[hit.primitive as usize].vertices.map(|v| scene.normals[v as usize]);
    let mixed = (n0 * (1.0 - hit.u - hit.v) + n1 * hit.u + n2 * hit.v).normalize_or(ng);
    if mixed.dot(ng) < 0.0 { -mixed } else { mixed }
}

impl Scene {
    /// Where `hit` of `ray` is: the point recomputed on the surface (not along the ray), its error bound (pbrt 4th ed. §6.8.5),
    /// geometric normal on the shape's front side (meshes: the side from which vertices run counter-clockwise), and shading
    /// normal: interpolated where the mesh is smooth and has normals, turned into the hemisphere of the geometric one.
    ///
    /// # Panics
    /// Where `hit` is not of this scene.
    pub fn surface_point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        match hit.primitive.checked_sub(self.triangles.len() as u32) {
            None => Surface::new(self, hit.primitive).point(self, hit),
            Some(shape) => self.quadric_point(ray, hit, shape),
        }
    }

    pub(super) fn quadric_point(&self, ray: &Ray, hit: &Hit, shape: u32) -> SurfacePoint {
        let Some(quadric) = Quadric::new(&self.shapes[shape as usize].geometry) else {
            panic!("the hit names shape {shape} of another scene");
        };
        // The f64 distance; the f32 one only if this is not the ray that hit.
        let t = quadric.distance(ray).unwrap_or(hit.t.into());
        let (p, n) = quadric.surface(ray, t);
        let (p, ng) = (p.as_vec3(), n.as_vec3());
        // One rounding from f64, with room for those in f64.
        SurfacePoint { p, p_error: p.abs() * gamma(2), ng, ns: ng, shape, triangle: NO_PRIMITIVE }
    }
}
