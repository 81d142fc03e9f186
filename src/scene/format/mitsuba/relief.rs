//! Bump and normal maps around BSDFs.

use super::texture::Use;
use super::{Builder, Node};
use crate::error::Result;
use crate::scene::material::{Relief, ReliefMap};
use crate::scene::texture::{Bitmap, TextureFilter};
use crate::scene::{Bsdf, Material, Texture};

impl Builder {
    /// Materials of front and back of a `bumpmap` or `normalmap`: those inside, each with the relief.
    pub(super) fn relief(&mut self, index: usize) -> Result<[u32; 2]> {
        let node = &self.tree.nodes[index];
        let (mut inside, mut texture) = (None, None);
        for child in &node.children {
            let found = self.tree.resolve(child)?;
            let slot = match self.tree.nodes[found].tag.as_str() {
                "bsdf" => &mut inside,
                "texture" | "spectrum" => &mut texture,
                _ => return Err(self.tree.nodes[found].error(format!("has no place in {}", node.title()))),
            };
            if slot.replace(found).is_some() {
                return Err(node.error("needs one BSDF and one texture inside, and nothing else"));
            }
        }
        let inside = inside.ok_or_else(|| node.error("needs a BSDF inside"))?;
        let map = if node.plugin == "bumpmap" { self.bump(index, texture)? } else { self.normals(index)? };
        let node = &self.tree.nodes[index];
        let option = |name: &str| Ok(node.boolean(name)?.unwrap_or(true));
        let (flips, shadows) = (option("flip_invalid_normals")?, option("use_shadowing_function")?);
        self.finish(index, &[]);
        let mut sides = self.surface(inside)?;
        for (side, inward) in sides.iter_mut().zip([false, true]) {
            *side = self.bent(index, *side, Relief { map, inward, flips, shadows })?;
        }
        Ok(sides)
    }

    fn bump(&mut self, index: usize, texture: Option<usize>) -> Result<ReliefMap> {
        let node = &self.tree.nodes[index];
        let scale = node.float("scale")?.unwrap_or(1.0) as f32;
        let bitmap = |node: &Node| node.tag == "texture" && node.plugin == "bitmap";
        let texture = texture.ok_or_else(|| node.error("needs a texture inside"))?;
        let (texture, factor) = self.unscaled(texture)?;
        if !bitmap(&self.tree.nodes[texture]) {
            return Err(self.tree.nodes[texture].error("has no slopes; a bump map must be a bitmap"));
        }
        if !(scale * factor).is_finite() {
            return Err(self.tree.nodes[index].error("scale is out of the range of 32-bit numbers"));
        }
        let number = self.texture(texture, Use::Scalar)?;
        if let Texture::Bitmap(Bitmap { filter: TextureFilter::Nearest, .. }) = self.scene.textures[number as usize] {
            let place = self.tree.nodes[texture].place.clone();
            self.warn(&place, "a bump map with filter_type nearest is flat");
        }
        Ok(ReliefMap::Bump { texture: number, scale: scale * factor })
    }

    /// The texture inside a `scale` of Mitsuba 0.x, where bump maps had no scale of their own, and its factor.
    fn unscaled(&mut self, index: usize) -> Result<(usize, f32)> {
        let node = &self.tree.nodes[index];
        if (node.tag.as_str(), node.plugin.as_str()) != ("texture", "scale") {
            return Ok((index, 1.0));
        }
        let factor = node.float("scale")?.unwrap_or(1.0) as f32;
        let [child] = &node.children[..] else { return Err(node.error("needs one texture inside, and nothing else")) };
        let inside = self.tree.resolve(child)?;
        let place = node.place.clone();
        self.warn(&place, "texture `scale` is of Mitsuba 0.x; Mitsuba 3 has the property `scale` of bumpmap");
        self.finish(index, &[]);
        Ok((inside, factor))
    }

    fn normals(&mut self, index: usize) -> Result<ReliefMap> {
        let node = &self.tree.nodes[index];
        let given = node.children.iter().any(|c| c.name.as_deref() == Some("normalmap"));
        if !given && !node.properties.iter().any(|p| p.name == "normalmap") {
            return Err(node.error("needs a texture that is named `normalmap` inside"));
        }
        let anything = f32::MIN..=f32::MAX;
        Ok(ReliefMap::Normal(self.input(index, "normalmap", 0.0, &anything, Use::Normal)?))
    }

    /// `material` and those it is mixed of, with a relief.
    fn bent(&mut self, index: usize, material: u32, relief: Relief) -> Result<u32> {
        if material == 0 {
            return Ok(0);
        }
        let bent = match self.scene.materials[material as usize] {
            Material { relief: Some(_), .. } => {
                return Err(self.tree.nodes[index].error("a relief inside another one is not supported"));
            }
            Material { bsdf: Bsdf::Mixture { weight, materials: [a, b] }, .. } => {
                let materials = [self.bent(index, a, relief)?, self.bent(index, b, relief)?];
                Bsdf::Mixture { weight, materials }.into()
            }
            plain => Material { relief: Some(relief), ..plain },
        };
        Ok(self.push_material(bent))
    }
}
