//! Texture coordinates of hits and how the surface runs along them, as Mitsuba defines them.

use super::{Hit, SurfacePoint};
use crate::math::trig::atan2;
use crate::math::{Frame, Vec2, Vec3};
use crate::scene::{Geometry, Scene, Shape};
use std::f32::consts::{PI, TAU};

/// 1/2π, turns per radian.
const TURNS: f32 = 1.0 / TAU;

/// The texture coordinates of a surface point and the derivatives of its position with respect to them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameterization {
    /// Texture coordinates. Meshes without any: the barycentric weights of vertices 1 and 2.
    pub uv: Vec2,
    /// ∂p/∂u, scene units. Where there are no texture coordinates, or they do not span the triangle: a unit tangent.
    pub dp_du: Vec3,
    /// ∂p/∂v, scene units; likewise.
    pub dp_dv: Vec3,
}

impl Scene {
    /// Of the surface point `at` that `hit` has.
    ///
    /// # Panics
    /// Where `hit` is not of this scene.
    pub fn parameterization(&self, hit: &Hit, at: &SurfacePoint) -> Parameterization {
        let shape = &self.shapes[at.shape as usize];
        let Some(triangle) = self.triangles.get(hit.primitive as usize) else {
            return QuadricMap::new(shape).map_or_else(|| panic!("shape {} is flat", at.shape), |map| map.at(at.p));
        };
        let [p0, p1, p2] = triangle.vertices.map(|v| self.positions[v as usize]);
        let uvs = (has_uvs(self, shape)).then(|| triangle.vertices.map(|v| self.uvs[v as usize]));
        of_triangle([p1 - p0, p2 - p0], at.ng, uvs, hit)
    }
}

/// Whether the vertices of a shape have texture coordinates.
pub(super) fn has_uvs(scene: &Scene, shape: &Shape) -> bool {
    !scene.uvs.is_empty() && matches!(shape.geometry, Geometry::Mesh { uvs: true, .. } | Geometry::Rectangle { .. })
}

/// Of a triangle with these edges from vertex 0 to vertices 1 and 2.
fn of_triangle([e1, e2]: [Vec3; 2], ng: Vec3, uvs: Option<[Vec2; 3]>, hit: &Hit) -> Parameterization {
    let frame = Frame::new(ng);
    let (dp_du, dp_dv) = (frame.s, frame.t);
    let Some([uv0, uv1, uv2]) = uvs else {
        return Parameterization { uv: Vec2::new(hit.u, hit.v), dp_du, dp_dv };
    };
    let uv = uv0 * (1.0 - hit.u - hit.v) + uv1 * hit.u + uv2 * hit.v;
    let (d1, d2) = (uv1 - uv0, uv2 - uv0);
    let inverse = 1.0 / (d1.x * d2.y - d1.y * d2.x);
    if !inverse.is_finite() {
        return Parameterization { uv, dp_du, dp_dv };
    }
    let (dp_du, dp_dv) = ((e1 * d2.y - e2 * d1.y) * inverse, (e2 * d1.x - e1 * d2.x) * inverse);
    Parameterization { uv, dp_du, dp_dv }
}

/// Between a sphere, disk or cylinder and the unit one. GPUs get the same words.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct QuadricMap {
    /// What the unit shape's origin becomes.
    origin: [f32; 3],
    /// 0 sphere, 1 disk, 2 cylinder, as for `Quadric` on GPUs.
    kind: u32,
    /// What its axes become.
    axes: [[f32; 3]; 3],
    /// Rows of the inverse.
    inverse: [[f32; 3]; 3],
}

impl QuadricMap {
    /// `None` for shapes made of triangles.
    pub fn new(shape: &Shape) -> Option<Self> {
        let (origin, kind) = match shape.geometry {
            Geometry::Mesh { .. } | Geometry::Rectangle { .. } => return None,
            Geometry::Sphere { center, .. } => (center, 0),
            Geometry::Disk { center, .. } => (center, 1),
            Geometry::Cylinder { p0, .. } => (p0, 2),
        };
        let inverse = shape.axes.as_dmat3().inverse().as_mat3();
        let axes = shape.axes.to_cols_array_2d();
        Some(Self { origin: origin.into(), kind, axes, inverse: inverse.transpose().to_cols_array_2d() })
    }

    /// Of the point `p` of the surface. Sphere: azimuth in turns and polar angle in half turns. Disk: radius and azimuth.
    /// Cylinder: azimuth and height. Azimuths are from 0 to 1, 0 on the axis.
    fn at(&self, p: Vec3) -> Parameterization {
        let q = p - Vec3::from(self.origin);
        let [x, y, z] = self.inverse.map(|row| Vec3::from(row).dot(q));
        let r = (x * x + y * y).sqrt();
        let (cos, sin) = if r > 0.0 { (x / r, y / r) } else { (1.0, 0.0) };
        let turn = if r > 0.0 { atan2(y, x) * TURNS } else { 0.0 };
        let azimuth = if turn < 0.0 { turn + 1.0 } else { turn };
        let around = Vec3::new(-y, x, 0.0) * TAU;
        let (uv, du, dv) = match self.kind {
            0 => (Vec2::new(azimuth, atan2(r, z) * (2.0 * TURNS)), around, Vec3::new(z * cos, z * sin, -r) * PI),
            1 => (Vec2::new(r, azimuth), Vec3::new(cos, sin, 0.0), around),
            _ => (Vec2::new(azimuth, z), around, Vec3::Z),
        };
        let [a, b, c] = self.axes.map(Vec3::from);
        let image = |d: Vec3| a * d.x + b * d.y + c * d.z;
        Parameterization { uv, dp_du: image(du), dp_dv: image(dv) }
    }
}
