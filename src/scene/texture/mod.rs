//! Textures: what varies over a surface. The Vulkan twin is `shaders/scene/texture.glsl`.

mod bitmap;

use super::Scene;
use crate::accel::NO_PRIMITIVE;
use crate::math::{Rgb, Vec2};

pub use bitmap::{Bitmap, TextureFilter, Wrap};

/// An input of a material: the same everywhere, or a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Input {
    /// The same everywhere.
    Value(Rgb),
    /// Index into [`Scene::textures`].
    Texture(u32),
}

impl Input {
    /// The value at a surface point.
    #[inline]
    pub fn eval(&self, scene: &Scene, at: &Lookup) -> Rgb {
        match *self {
            Self::Value(value) => value,
            Self::Texture(index) => scene.textures[index as usize].eval(scene, at),
        }
    }
}

/// Where a texture is looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lookup {
    /// Texture coordinates of the surface ([`crate::accel::Parameterization::uv`]).
    pub uv: Vec2,
    /// The triangle, as in [`crate::accel::SurfacePoint::triangle`].
    pub triangle: u32,
    /// Barycentric weights of its vertices 1 and 2.
    pub barycentrics: Vec2,
}

/// A texture. Names and meanings are Mitsuba's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Texture {
    /// A picture.
    Bitmap(Bitmap),
    /// Squares of two colours, four to the unit square.
    Checkerboard {
        /// Index into [`Scene::texels`] of the two colours; the first is that of the square next to (0, 0).
        first: u32,
        /// From texture coordinates of the surface to the board's.
        to_uv: UvTransform,
    },
    /// Colours of the vertices of meshes, mixed over triangles.
    VertexAttribute {
        /// Index into [`Scene::attributes`] of the colour of the scene's vertex 0.
        first: u32,
        /// Factor.
        scale: f32,
    },
    /// Colours of triangles.
    FaceAttribute {
        /// Index into [`Scene::attributes`] of the colour of the scene's triangle 0.
        first: u32,
        /// Factor.
        scale: f32,
    },
}

impl Texture {
    /// The kind in words.
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::Bitmap(_) => "bitmap",
            Self::Checkerboard { .. } => "checkerboard",
            Self::VertexAttribute { .. } => "vertex attribute",
            Self::FaceAttribute { .. } => "face attribute",
        }
    }

    /// The colour at a surface point: finite for any texture coordinates; black where a mesh attribute is asked for off
    /// meshes.
    ///
    /// # Panics
    /// Where the texture or the triangle is not of this scene.
    pub fn eval(&self, scene: &Scene, at: &Lookup) -> Rgb {
        match *self {
            Self::Bitmap(ref bitmap) => bitmap.eval(&scene.texels, at.uv),
            Self::Checkerboard { first, to_uv } => {
                let uv = to_uv.apply(at.uv);
                // What is not finite is in the first half.
                let [s, t] = [uv.x, uv.y].map(|x| x - x.floor() > 0.5);
                scene.texels[first as usize + usize::from(s != t)]
            }
            Self::VertexAttribute { first, scale } => {
                if at.triangle == NO_PRIMITIVE {
                    return Rgb::ZERO;
                }
                let vertices = scene.triangles[at.triangle as usize].vertices;
                let [c0, c1, c2] = vertices.map(|v| scene.attributes[(first + v) as usize]);
                let [u, v] = at.barycentrics.to_array();
                (c0 * (1.0 - u - v) + c1 * u + c2 * v) * scale
            }
            Self::FaceAttribute { first, scale } => {
                if at.triangle == NO_PRIMITIVE {
                    return Rgb::ZERO;
                }
                scene.attributes[(first + at.triangle) as usize] * scale
            }
        }
    }
}

impl Texture {
    /// Derivatives of the first channel with respect to the texture coordinates of the surface, where it is a bilinear picture;
    /// zero elsewhere.
    ///
    /// # Panics
    /// Where the texture is not of this scene.
    pub fn gradient(&self, scene: &Scene, uv: Vec2) -> Vec2 {
        match self {
            Self::Bitmap(bitmap) => bitmap.gradient(&scene.texels, uv),
            _ => Vec2::ZERO,
        }
    }
}

/// An affine map of texture coordinates: `u·x + v·y + origin`.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct UvTransform {
    /// Image of (1, 0) − (0, 0).
    pub u: [f32; 2],
    /// Image of (0, 1) − (0, 0).
    pub v: [f32; 2],
    /// Image of (0, 0).
    pub origin: [f32; 2],
}

impl UvTransform {
    /// Changes nothing.
    pub const IDENTITY: Self = Self { u: [1.0, 0.0], v: [0.0, 1.0], origin: [0.0, 0.0] };

    /// The image of a point.
    #[inline]
    pub fn apply(&self, uv: Vec2) -> Vec2 {
        Vec2::from(self.u) * uv.x + Vec2::from(self.v) * uv.y + Vec2::from(self.origin)
    }
}

impl Default for UvTransform {
    fn default() -> Self {
        Self::IDENTITY
    }
}

/// A texture in device memory: `Texture` of `shaders/scene/texture.glsl`.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct PackedTexture {
    /// 0 bitmap, 1 checkerboard, 2 vertex attribute, 3 face attribute.
    kind: u32,
    /// Of bitmaps: wrap (0 repeat, 1 mirror, 2 clamp) + 4 if bilinear.
    mode: u32,
    size: [u32; 2],
    to_uv: UvTransform,
    first: u32,
    scale: f32,
}

impl From<&Texture> for PackedTexture {
    fn from(texture: &Texture) -> Self {
        match *texture {
            Texture::Bitmap(Bitmap { first, size, filter, wrap, to_uv }) => {
                let mode = wrap as u32 + 4 * u32::from(filter == TextureFilter::Bilinear);
                Self { kind: 0, mode, size, to_uv, first, scale: 1.0 }
            }
            Texture::Checkerboard { first, to_uv } => Self { kind: 1, to_uv, first, scale: 1.0, ..Self::default() },
            Texture::VertexAttribute { first, scale } => Self { kind: 2, first, scale, ..Self::default() },
            Texture::FaceAttribute { first, scale } => Self { kind: 3, first, scale, ..Self::default() },
        }
    }
}
