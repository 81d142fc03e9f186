//! From a hit to a surface point, and from surface points to the rays that leave them.

use super::quadric::Quadric;
use super::{Hit, NO_PRIMITIVE, Ray, SurfacePoint};
use crate::math::Vec3;
use crate::math::robust::{UNIT_ROUNDOFF, gamma, offset_origin};
use crate::scene::{Geometry, Scene};

/// One end of a ray or segment: a point, the bound on its error and the normal of the surface it lies on.
#[derive(Clone, Copy, Debug)]
pub struct Endpoint {
    /// Position, world space.
    pub p: Vec3,
    /// Bound on the absolute error of `p`, per axis.
    pub p_error: Vec3,
    /// Unit normal of the surface, either side; zero where there is no surface.
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

/// A triangle as shading needs it, made once per scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    p0: Vec3,
    /// From vertex 0 to vertices 1 and 2.
    edges: [Vec3; 2],
    ng: Vec3,
    shape: u32,
    smooth: bool,
}

impl Surface {
    pub(super) fn new(scene: &Scene, triangle: u32) -> Self {
        let triangle = &scene.triangles[triangle as usize];
        let [p0, p1, p2] = triangle.vertices.map(|v| scene.positions[v as usize]);
        let geometry = &scene.shapes[triangle.shape as usize].geometry;
        // f64: the cross product of a sliver's edges cancels.
        let (e1, e2) = match geometry {
            Geometry::Rectangle { edge_u, edge_v, .. } => (edge_u.as_dvec3(), edge_v.as_dvec3()),
            _ => (p1.as_dvec3() - p0.as_dvec3(), p2.as_dvec3() - p0.as_dvec3()),
        };
        let ng = e1.cross(e2).normalize_or_zero().as_vec3();
        let smooth = matches!(geometry, Geometry::Mesh { smooth: true, .. });
        Self { p0, edges: [p1 - p0, p2 - p0], ng, shape: triangle.shape, smooth }
    }

    /// See [`Scene::surface_point`].
    #[inline(always)]
    pub(super) fn point(&self, scene: &Scene, hit: &Hit) -> SurfacePoint {
        let (along1, along2) = (self.edges[0] * hit.u, self.edges[1] * hit.v);
        let p = self.p0 + (along1 + along2);
        // Any (u, v) is a point of the plane: only the roundings of this sum count, not those of u and v.
        let p_error = (along1.abs() + along2.abs()) * gamma(4) + p.abs() * gamma(1);
        let ng = self.ng;
        let ns = if self.smooth { interpolated_normal(scene, hit, ng) } else { ng };
        SurfacePoint { p, p_error, ng, ns, shape: self.shape, triangle: hit.primitive }
    }
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
