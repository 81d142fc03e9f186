//! From a hit to a surface point, and from surface points to the rays that leave them.

use super::quadric::Quadric;
use super::{Hit, Ray, SurfacePoint};
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
}

impl Endpoint {
    /// A point in space: nothing to move off.
    #[inline(always)]
    pub fn free(p: Vec3) -> Self {
        Self { p, p_error: Vec3::ZERO, ng: Vec3::ZERO }
    }
}

impl From<&SurfacePoint> for Endpoint {
    #[inline(always)]
    fn from(s: &SurfacePoint) -> Self {
        Self { p: s.p, p_error: s.p_error, ng: s.ng }
    }
}

/// The ray from a point into a direction, started off the point's surface so that it does not find it again.
#[inline(always)]
pub fn leave(from: impl Into<Endpoint>, direction: Vec3) -> Ray {
    let from = from.into();
    Ray { origin: offset_origin(from.p, from.p_error, from.ng, direction), direction, t_max: f32::INFINITY }
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
    Ray { origin, direction: end - origin, t_max: 1.0 }
}

impl Scene {
    /// Where `hit` of `ray` is: the point recomputed on the surface (not along the ray), its error bound (pbrt 4th ed. §6.8.5),
    /// geometric normal on the shape's front side (meshes: the side from which vertices run counter-clockwise), and shading
    /// normal: interpolated where the mesh is smooth and has normals, turned into the hemisphere of the geometric one.
    ///
    /// # Panics
    /// Where `hit` is not of this scene.
    pub fn surface_point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let triangles = self.triangles.len() as u32;
        if hit.primitive < triangles {
            self.triangle_point(hit.primitive, hit.u, hit.v)
        } else {
            self.quadric_point(ray, hit, hit.primitive - triangles)
        }
    }

    /// The point of a triangle with barycentric weights u of vertex 1 and v of vertex 2 (also for points sampled on lights).
    ///
    /// # Panics
    /// Where the scene has no such triangle.
    pub fn triangle_point(&self, triangle: u32, u: f32, v: f32) -> SurfacePoint {
        let triangle = &self.triangles[triangle as usize];
        let vertices = triangle.vertices.map(|v| v as usize);
        let [p0, p1, p2] = vertices.map(|v| self.positions[v]);
        let (along1, along2) = ((p1 - p0) * u, (p2 - p0) * v);
        let p = p0 + (along1 + along2);
        // Any (u, v) is a point of the plane: only the roundings of this sum count, not those of u and v.
        let p_error = (along1.abs() + along2.abs()) * gamma(4) + p.abs() * gamma(1);
        let geometry = &self.shapes[triangle.shape as usize].geometry;
        // f64: the cross product of a sliver's edges cancels.
        let (e1, e2) = match geometry {
            Geometry::Rectangle { edge_u, edge_v, .. } => (edge_u.as_dvec3(), edge_v.as_dvec3()),
            _ => (p1.as_dvec3() - p0.as_dvec3(), p2.as_dvec3() - p0.as_dvec3()),
        };
        let ng = e1.cross(e2).normalize_or_zero().as_vec3();
        let mut ns = ng;
        if matches!(geometry, Geometry::Mesh { smooth: true, .. }) {
            let [n0, n1, n2] = vertices.map(|v| self.normals[v]);
            let mixed = (n0 * (1.0 - u - v) + n1 * u + n2 * v).normalize_or(ng);
            ns = if mixed.dot(ng) < 0.0 { -mixed } else { mixed };
        }
        SurfacePoint { p, p_error, ng, ns, shape: triangle.shape }
    }

    fn quadric_point(&self, ray: &Ray, hit: &Hit, shape: u32) -> SurfacePoint {
        let Some(quadric) = Quadric::new(&self.shapes[shape as usize].geometry) else {
            panic!("the hit names shape {shape} of another scene");
        };
        // The f64 distance; the f32 one only if this is not the ray that hit.
        let t = quadric.distance(ray).unwrap_or(hit.t.into());
        let (p, n) = quadric.surface(ray, t);
        let (p, ng) = (p.as_vec3(), n.as_vec3());
        // One rounding from f64, with room for those in f64.
        SurfacePoint { p, p_error: p.abs() * gamma(2), ng, ns: ng, shape }
    }
}
