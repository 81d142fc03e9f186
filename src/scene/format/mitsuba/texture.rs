//! Textures, and inputs of materials that may be textures.

use super::super::picture::{self, Encoding, Picture};
use super::super::{mesh, shorten};
use super::value::Value;
use super::{Builder, Node};
use crate::error::{Error, Result};
use crate::math::Rgb;
use crate::math::rgb::luminance;
use crate::scene::Texture;
use crate::scene::texture::{Bitmap, Input, TextureFilter, UvTransform, Wrap};
use glam::{DAffine3, DVec3};
use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::path::PathBuf;

const TEXTURES: &str = "bitmap, checkerboard, mesh_attribute";
/// Texels of all textures together: 3 GiB.
const MOST_TEXELS: usize = 1 << 28;

/// What a material does with an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Use {
    Color,
    /// A number: the luminance of colours.
    Scalar,
    /// A vector: three channels.
    Normal,
}

/// What has been read for textures so far.
#[derive(Default)]
pub(super) struct Textures {
    /// Textures by node.
    known: HashMap<(usize, Use), u32>,
    /// First texel and size of the pictures.
    pictures: HashMap<(PathBuf, bool, Use), (u32, [u32; 2])>,
    /// Mesh attributes that textures ask for, in the order of their numbers, which stand for `first` until all meshes are known.
    wanted: Vec<String>,
    /// Mesh attributes with the index in the scene of the vertex or triangle that their first colour belongs to.
    given: Vec<(mesh::Attribute, u32)>,
    /// What textures are used for: node, texture, the material's property and its range.
    uses: Vec<(usize, u32, String, RangeInclusive<f32>)>,
}

impl Builder {
    /// The property `name` of a material: a colour or number in `range`, or a texture of them.
    pub(super) fn input(
        &mut self,
        index: usize,
        name: &str,
        default: f32,
        range: &RangeInclusive<f32>,
        usage: Use,
    ) -> Result<Input> {
        let node = &self.tree.nodes[index];
        if let Some(child) = node.children.iter().rfind(|c| c.name.as_deref() == Some(name)) {
            let inner = self.tree.resolve(child)?;
            if self.tree.nodes[inner].tag == "texture" {
                let texture = self.texture(inner, usage)?;
                self.textures.uses.push((inner, texture, name.to_owned(), range.clone()));
                return Ok(Input::Texture(texture));
            }
        }
        let value = self.value(index, name, default, range)?;
        Ok(Input::Value(if usage == Use::Scalar { grey(value) } else { value }))
    }

    pub(super) fn texture(&mut self, index: usize, usage: Use) -> Result<u32> {
        if let Some(&known) = self.textures.known.get(&(index, usage)) {
            return Ok(known);
        }
        let node = &self.tree.nodes[index];
        let texture = match node.plugin.as_str() {
            "bitmap" => self.bitmap(index, usage)?,
            "checkerboard" => self.checkerboard(index, usage)?,
            "mesh_attribute" => self.mesh_attribute(index)?,
            other => return Err(node.unsupported(other, TEXTURES)),
        };
        // `accel` and `format` are about Mitsuba's storage.
        self.finish(index, &["accel", "format"]);
        self.scene.textures.push(texture);
        let number = self.scene.textures.len() as u32 - 1;
        self.textures.known.insert((index, usage), number);
        Ok(number)
    }

    fn bitmap(&mut self, index: usize, usage: Use) -> Result<Texture> {
        self.only_colours(index, &[])?;
        let node = &self.tree.nodes[index];
        let name = node.string("filename")?.ok_or_else(|| node.error("lacks the property `filename`"))?;
        let filter = node.string("filter_type")?.unwrap_or_else(|| "bilinear".into());
        let (filter, warns) = match filter.as_str() {
            "nearest" => (TextureFilter::Nearest, false),
            "bilinear" => (TextureFilter::Bilinear, false),
            "trilinear" | "ewa" => (TextureFilter::Bilinear, true),
            other => {
                return Err(node.error(format!("filter_type is `{}`; allowed: nearest, bilinear", shorten(other))));
            }
        };
        let wrap = match node.string("wrap_mode")?.as_deref() {
            None | Some("repeat") => Wrap::Repeat,
            Some("mirror") => Wrap::Mirror,
            Some("clamp") => Wrap::Clamp,
            Some(other) => {
                return Err(node.error(format!("wrap_mode is `{}`; allowed: repeat, mirror, clamp", shorten(other))));
            }
        };
        // Mitsuba 0.x's `gamma`: 1 = linear.
        let linear = node.properties.iter().find(|p| p.name == "gamma" && matches!(p.value, Value::Float(1.0)));
        linear.inspect(|p| p.used.set(true));
        let raw = node.boolean("raw")?.unwrap_or(linear.is_some());
        let to_uv = to_uv(node)?;
        let place = node.place.clone();
        let path = self.tree.find_file(&name, &place)?;
        if warns {
            self.warn(&place, "this filter_type needs the footprint of rays; taken as bilinear");
        }
        let (first, size) = self.picture(path, raw, usage, index)?;
        Ok(Texture::Bitmap(Bitmap { first, size, filter, wrap, to_uv }))
    }

    /// First texel and size of a picture.
    fn picture(&mut self, path: PathBuf, raw: bool, usage: Use, index: usize) -> Result<(u32, [u32; 2])> {
        let key = (path.canonicalize().unwrap_or_else(|_| path.clone()), raw, usage);
        if let Some(&known) = self.textures.pictures.get(&key) {
            return Ok(known);
        }
        let node = &self.tree.nodes[index];
        let place = node.place.clone();
        let picture = if raw { picture::load_raw(&path, &place)? } else { picture::load(&path, &place)? };
        let Picture { width, height, encoding, grey: one_channel, mut texels, .. } = picture;
        if self.scene.texels.len() + texels.len() > MOST_TEXELS {
            return Err(node.error(format!("the scene's textures have more than {MOST_TEXELS} texels")));
        }
        if let Some(i) = texels.iter().position(|c| !c.is_finite()) {
            let (x, y) = (i % width as usize, i / width as usize);
            return Err(node.error(format!("pixel ({x}, {y}) of `{}` is not finite: {}", path.display(), texels[i])));
        }
        if usage == Use::Normal && one_channel {
            return Err(self.tree.nodes[index].error("has one channel; a normal map needs three"));
        }
        if usage == Use::Normal && !raw && encoding == Encoding::Srgb {
            self.warn(&place, "a normal map that is not `raw`: its values are decoded as sRGB colours");
        }
        if usage == Use::Scalar {
            texels.iter_mut().for_each(|c| *c = grey(*c));
        }
        self.tree.add_source(&path);
        let first = self.scene.texels.len() as u32;
        self.scene.texels.extend(texels);
        self.textures.pictures.insert(key, (first, [width, height]));
        Ok((first, [width, height]))
    }

    fn checkerboard(&mut self, index: usize, usage: Use) -> Result<Texture> {
        self.only_colours(index, &["color0", "color1"])?;
        let anything = f32::MIN..=f32::MAX;
        let mut colors = [self.value(index, "color0", 0.4, &anything)?, self.value(index, "color1", 0.2, &anything)?];
        let to_uv = to_uv(&self.tree.nodes[index])?;
        if usage == Use::Scalar {
            // Mitsuba 3 has the numbers the other way round than the colours.
            colors = [grey(colors[1]), grey(colors[0])];
        }
        let first = self.scene.texels.len() as u32;
        self.scene.texels.extend(colors);
        Ok(Texture::Checkerboard { first, to_uv })
    }

    fn mesh_attribute(&mut self, index: usize) -> Result<Texture> {
        self.only_colours(index, &[])?;
        let name = attribute_name(&self.tree.nodes[index])?;
        let scale = self.tree.nodes[index].float("scale")?.unwrap_or(1.0) as f32;
        let wanted = &mut self.textures.wanted;
        let number = wanted.iter().position(|w| *w == name).unwrap_or(wanted.len());
        if number == wanted.len() {
            wanted.push(name.clone());
        }
        let first = number as u32;
        let of_faces = name.starts_with("face_");
        Ok(if of_faces { Texture::FaceAttribute { first, scale } } else { Texture::VertexAttribute { first, scale } })
    }

    /// Keeps the attributes of a mesh whose first vertex and triangle have these indices in the scene.
    pub(super) fn keep_attributes(&mut self, attributes: Vec<mesh::Attribute>, vertex: u32, triangle: u32) {
        let at = |name: &str| if name.starts_with("face_") { triangle } else { vertex };
        for attribute in attributes {
            let first = at(&attribute.name);
            self.textures.given.push((attribute, first));
        }
    }

    /// Refuses a material for a shape that lacks an attribute which the material's textures ask for. `names`: those it has.
    pub(super) fn check_attributes(&self, shape: usize, surface: usize, names: &[String]) -> Result<()> {
        let mut open = vec![surface];
        let mut seen = Vec::new();
        while let Some(index) = open.pop() {
            if seen.contains(&index) {
                continue;
            }
            seen.push(index);
            let node = &self.tree.nodes[index];
            if node.tag == "texture" && node.plugin == "mesh_attribute" {
                let name = attribute_name(node)?;
                if !names.contains(&name) {
                    let all = if names.is_empty() { "none".into() } else { names.join(", ") };
                    let message =
                        format!("has no mesh attribute `{}` for its material (it has: {all})", shorten(&name));
                    return Err(self.tree.nodes[shape].error(message));
                }
            }
            for child in &node.children {
                open.push(self.tree.resolve(child)?);
            }
        }
        Ok(())
    }

    /// What remains to be done for textures when all meshes are known.
    pub(super) fn finish_textures(&mut self) -> Result<()> {
        self.textures
            .uses
            .iter()
            .try_for_each(|(node, texture, name, range)| self.check_range(*node, *texture, name, range))?;
        self.place_attributes()
    }

    /// Refuses colours that a material has no use for. Mitsuba only warns of them.
    fn check_range(&self, index: usize, texture: u32, name: &str, range: &RangeInclusive<f32>) -> Result<()> {
        let outside = |c: &Rgb| !c.to_array().iter().all(|v| range.contains(v));
        let found = match self.scene.textures[texture as usize] {
            Texture::Bitmap(Bitmap { first, size: [width, height], .. }) => {
                let texels = &self.scene.texels[first as usize..][..width as usize * height as usize];
                texels.iter().copied().find(outside)
            }
            Texture::Checkerboard { first, .. } => {
                self.scene.texels[first as usize..][..2].iter().copied().find(outside)
            }
            Texture::VertexAttribute { first, scale } | Texture::FaceAttribute { first, scale } => {
                let own = self.textures.given.iter().filter(|(a, _)| a.name == self.textures.wanted[first as usize]);
                own.flat_map(|(a, _)| &a.values).map(|&c| c * scale).find(outside)
            }
        };
        found.map_or(Ok(()), |found| {
            let (low, high) = (range.start(), range.end());
            let message = format!("has the colour {found}; {name} must be in [{low}, {high}] in each channel");
            Err(self.tree.nodes[index].error(message))
        })
    }

    /// Lays out the mesh attributes that textures ask for: each has a colour for every vertex or triangle of the scene.
    fn place_attributes(&mut self) -> Result<()> {
        let mut firsts = Vec::new();
        for name in &self.textures.wanted {
            let of_faces = name.starts_with("face_");
            let count = if of_faces { self.scene.triangles.len() } else { self.scene.positions.len() };
            let first = self.scene.attributes.len();
            if first + count > i32::MAX as usize {
                return Err(Error::input(self.tree.nodes[0].place.clone(), "more than 2³¹ values of mesh attributes"));
            }
            self.scene.attributes.resize(first + count, Rgb::ZERO);
            for (attribute, at) in self.textures.given.iter().filter(|(a, _)| a.name == *name) {
                let from = first + *at as usize;
                self.scene.attributes[from..from + attribute.values.len()].copy_from_slice(&attribute.values);
            }
            firsts.push(first as u32);
        }
        for texture in &mut self.scene.textures {
            if let Texture::VertexAttribute { first, .. } | Texture::FaceAttribute { first, .. } = texture {
                *first = firsts[*first as usize];
            }
        }
        Ok(())
    }
}

fn grey(color: Rgb) -> Rgb {
    // Also of colours that are grey already: their luminance is off by a rounding.
    if color.x == color.y && color.y == color.z { color } else { Rgb::splat(luminance(color)) }
}

fn attribute_name(node: &Node) -> Result<String> {
    let name = node.string("name")?.ok_or_else(|| node.error("lacks the property `name`"))?;
    if !name.starts_with("vertex_") && !name.starts_with("face_") {
        let message = format!("the attribute's name `{}` starts neither with vertex_ nor with face_", shorten(&name));
        return Err(node.error(message));
    }
    Ok(name)
}

/// `to_uv`, or the numbers that stood for it in Mitsuba 0.x, in the order in which Mitsuba 3 applies them. Only x and y count.
fn to_uv(node: &Node) -> Result<UvTransform> {
    let number = |name: &str, default: f64| Ok::<_, Error>(node.float(name)?.unwrap_or(default));
    let scale = DVec3::new(number("uscale", 1.0)?, number("vscale", 1.0)?, 1.0);
    let offset = DVec3::new(number("uoffset", 0.0)?, number("voffset", 0.0)?, 0.0);
    let old = DAffine3::from_scale(scale) * DAffine3::from_translation(offset);
    let transform = node.transform("to_uv")?.unwrap_or(old);
    let pair = |v: DVec3| v.truncate().as_vec2().to_array();
    let (matrix, origin) = (transform.matrix3, transform.translation);
    let map = UvTransform { u: pair(matrix.x_axis), v: pair(matrix.y_axis), origin: pair(origin) };
    if [map.u, map.v, map.origin].as_flattened().iter().all(|v| v.is_finite()) {
        Ok(map)
    } else {
        Err(node.error("to_uv is out of the range of 32-bit numbers"))
    }
}
