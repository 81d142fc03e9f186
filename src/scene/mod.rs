//! A scene as flat arrays, ready for upload, and the checks that make it safe to trace.

pub mod camera;
pub mod effects;
mod filter;
pub mod format;
pub mod inventory;
pub mod light;
pub mod material;
pub mod shape;
pub mod texture;
mod validate;

use crate::math::{Rgb, Vec2, Vec3};
use std::path::PathBuf;
use std::sync::Arc;

pub use camera::{Camera, Film, Filter, Projection};
pub use effects::Effects;
pub use light::{EnvironmentMap, Light};
use material::Transmittance;
pub use material::{Bsdf, Material};
pub use shape::{Geometry, Shape};
pub use texture::Texture;

/// Everything that a renderer needs. Indices are checked once, by [`Scene::validate`].
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Name for people: the file's stem.
    pub name: String,
    /// The camera.
    pub camera: Camera,
    /// Film size and pixel filter.
    pub film: Film,
    /// Depth settings that the file asks for.
    pub depth: Depth,
    /// Vertex positions of all meshes, in world space (scene units).
    pub positions: Vec<Vec3>,
    /// Shading normals, one per vertex, in world space, unit length; zero where a mesh has none (then the geometric normal counts).
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one per vertex; none at all where no shape has any.
    pub uvs: Vec<Vec2>,
    /// Triangles of all shapes that have some, grouped by shape.
    pub triangles: Vec<Triangle>,
    /// Objects.
    pub shapes: Vec<Shape>,
    /// Surface materials. Index 0 is always [`Material::BLACK`].
    pub materials: Vec<Material>,
    /// Tables of rough coats.
    pub transmittances: Vec<Transmittance>,
    /// Light sources.
    pub lights: Vec<Light>,
    /// What [`Light::EnvironmentMap`] shines with.
    pub environment_map: Option<Arc<EnvironmentMap>>,
    /// Textures that materials refer to.
    pub textures: Vec<Texture>,
    /// Colours of all textures.
    pub texels: Vec<Rgb>,
    /// Mesh attributes: for each of them a colour per vertex, or per triangle, of the scene.
    pub attributes: Vec<Rgb>,
    /// Files that determine the scene (the scene file, includes, meshes), for content hashes.
    pub sources: Vec<PathBuf>,
    /// What was read but has no effect, with its place.
    pub warnings: Vec<String>,
}

/// Path lengths, in edges: 1 = emission seen directly only (Mitsuba's convention).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Depth {
    /// Longest path; `None` = unbounded.
    pub max: Option<u32>,
    /// Depth from which Russian roulette may end a path.
    pub roulette: u32,
}

impl Default for Depth {
    /// Mitsuba's defaults: unbounded, roulette from depth 5.
    fn default() -> Self {
        Self { max: None, roulette: 5 }
    }
}

/// One triangle of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct Triangle {
    /// Indices into [`Scene::positions`] and [`Scene::normals`], counter-clockwise seen from outside.
    pub vertices: [u32; 3],
    /// Index into [`Scene::shapes`].
    pub shape: u32,
}
