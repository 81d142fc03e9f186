//! Shapes: what rays hit and what area lights are made of.

use crate::math::{Mat3, Vec3};
use std::ops::Range;

/// An object of the scene.
#[derive(Clone, Debug)]
pub struct Shape {
    /// The surface.
    pub geometry: Geometry,
    /// Material of the side that the geometric normal points to; index into [`super::Scene::materials`].
    pub front: u32,
    /// Material of the other side (0 = black, as for Mitsuba's one-sided BSDFs).
    pub back: u32,
    /// Area light of this shape, if it emits; index into [`super::Scene::lights`]. Emission is on the front side.
    pub light: Option<u32>,
    /// Of a sphere, disk or cylinder: where its parameterization has the x, y and z axes of the unit sphere, of the unit disk
    /// in z = 0, of the cylinder of radius 1 from z = 0 to 1. Not used elsewhere.
    pub axes: Mat3,
    /// Name for messages: the file's `id`, or plugin and place.
    pub name: String,
}

/// Kinds of surfaces. All in world space, scene units.
#[derive(Clone, Debug)]
pub enum Geometry {
    /// Triangles `range` of [`super::Scene::triangles`].
    Mesh {
        /// Triangles of this mesh.
        range: Range<u32>,
        /// Whether the shading normals of its vertices count.
        smooth: bool,
        /// Whether its vertices have texture coordinates.
        uvs: bool,
    },
    /// A parallelogram, intersected as the two triangles `range`. Points: `corner + s·edge_u + t·edge_v`, s, t ∈ \[0, 1\];
    /// its normal is along `edge_u × edge_v`.
    Rectangle {
        /// Its two triangles.
        range: Range<u32>,
        /// A corner.
        corner: Vec3,
        /// One edge.
        edge_u: Vec3,
        /// The other edge.
        edge_v: Vec3,
    },
    /// A sphere.
    Sphere {
        /// Centre.
        center: Vec3,
        /// Radius, > 0.
        radius: f32,
        /// Normals point inwards.
        flip: bool,
    },
    /// An elliptic disk: `center + r(u cos φ + v sin φ)`, r ∈ \[0, 1\]; its normal is along `u × v`.
    Disk {
        /// Centre.
        center: Vec3,
        /// Image of the unit x axis.
        u: Vec3,
        /// Image of the unit y axis.
        v: Vec3,
    },
    /// An open circular cylinder from `p0` to `p0 + axis`.
    Cylinder {
        /// Centre of one end.
        p0: Vec3,
        /// From one end to the other.
        axis: Vec3,
        /// Radius, > 0.
        radius: f32,
        /// Normals point inwards.
        flip: bool,
    },
}

impl Geometry {
    /// The kind in words.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::Mesh { .. } => "mesh",
            Self::Rectangle { .. } => "rectangle",
            Self::Sphere { .. } => "sphere",
            Self::Disk { .. } => "disk",
            Self::Cylinder { .. } => "cylinder",
        }
    }
}
