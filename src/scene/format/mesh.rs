//! What mesh readers hand over, and the vertex normals of meshes that come without.

use crate::math::{Rgb, Vec2, Vec3};
use glam::{DAffine3, DVec3};

/// Normals nearer to each other than this are the same: files print six digits.
const FLAT: f64 = 2e-6;

/// A triangle mesh in object space.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions; all finite.
    pub positions: Vec<Vec3>,
    /// One per vertex, or none at all. Any length; zero where the file has none for a vertex.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one per vertex, or none at all; all finite.
    pub uvs: Vec<Vec2>,
    /// Indices into `positions`.
    pub triangles: Vec<[u32; 3]>,
    /// Colours of vertices or triangles, by the names that Mitsuba gives them.
    pub attributes: Vec<Attribute>,
}

/// Colours of vertices or triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute {
    /// `vertex_color`, `face_color` …: says what has the colours.
    pub name: String,
    /// One per vertex or triangle; grey where the file has one number for each.
    pub values: Vec<Rgb>,
}

/// How a shape places its mesh; Mitsuba's properties of the same names.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// Object to world space, not singular.
    pub to_world: DAffine3,
    /// Facets are seen: no shading normals.
    pub face_normals: bool,
    /// Front and back change places.
    pub flip_normals: bool,
    /// v is turned into 1 − v.
    pub flip_tex_coords: bool,
}

impl Mesh {
    /// The mesh in world space, with unit (or zero) normals unless `face_normals`; normals are computed where the file
    /// has none, and left out where they only repeat what the facets say. Triangles are wound so that `(p1 − p0) × (p2 − p0)` points to the front. Where a mesh has normals, the
    /// front is the side they are on, since Mitsuba takes sides by the shading normal: a mirror in `to_world` then does
    /// not turn the mesh inside out. Without normals the winding in world space decides, as in Mitsuba.
    pub fn place(mut self, placement: &Placement) -> Self {
        let Placement { to_world, face_normals, flip_normals, flip_tex_coords } = *placement;
        for p in &mut self.positions {
            *p = to_world.transform_point3(p.as_dvec3()).as_vec3();
        }
        if face_normals {
            self.normals.clear();
        } else if self.normals.is_empty() {
            self.normals = self.vertex_normals();
        } else {
            let matrix = to_world.matrix3.inverse().transpose();
            for n in &mut self.normals {
                *n = (matrix * n.as_dvec3()).normalize_or_zero().as_vec3();
            }
            self.wind_by_normals();
        }
        if self.is_flat() {
            self.normals.clear();
        }
        if flip_tex_coords {
            self.uvs.iter_mut().for_each(|uv| uv.y = 1.0 - uv.y);
        }
        if flip_normals {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            self.normals.iter_mut().for_each(|n| *n = -*n);
        }
        self
    }

    /// Corners of a triangle.
    fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|i| self.positions[i as usize].as_dvec3())
    }

    /// Turns the triangles whose vertex normals are on their back.
    fn wind_by_normals(&mut self) {
        for i in 0..self.triangles.len() {
            let [a, b, c] = self.corners(self.triangles[i]);
            let sum: DVec3 = self.triangles[i].iter().map(|&v| self.normals[v as usize].as_dvec3()).sum();
            if (b - a).cross(c - a).dot(sum) < 0.0 {
                self.triangles[i].swap(1, 2);
            }
        }
    }

    /// Whether every vertex normal is that of its triangles.
    fn is_flat(&self) -> bool {
        self.triangles.iter().all(|&t| {
            let [a, b, c] = self.corners(t);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let differs = |&v: &u32| self.normals.get(v as usize).is_some_and(|n| n.as_dvec3().distance(normal) > FLAT);
            !t.iter().any(differs)
        })
    }

    /// Vertex normals: face normals weighted by the angle at the vertex (Thürmer and Wüthrich, "Computing vertex
    /// normals from polygonal facets", JGT 3(1), 1998), as Mitsuba does. Zero for vertices of no proper triangle.
    fn vertex_normals(&self) -> Vec<Vec3> {
        let mut normals = vec![DVec3::ZERO; self.positions.len()];
        for &triangle in &self.triangles {
            let p = self.corners(triangle);
            let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
            for k in 0..3 {
                let (a, b) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
                // atan2 is exact for thin angles, where acos of the dot product is not.
                normals[triangle[k] as usize] += normal * a.cross(b).length().atan2(a.dot(b));
            }
        }
        normals.into_iter().map(|n| n.normalize_or_zero().as_vec3()).collect()
    }
}
