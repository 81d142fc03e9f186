//! Mitsuba 3 XML (versions 0.x to 3.x): <https://mitsuba.readthedocs.io/en/stable/src/key_topics/scene_format.html>.

mod attribute;
mod camera;
mod ior;
mod light;
mod reader;
mod relief;
mod shape;
mod surface;
mod texture;
mod tree;
mod value;

use super::Options;
use super::mesh::Mesh;
use crate::error::{Error, Place, Result};
use crate::scene::{Depth, Scene};
use std::collections::HashMap;
use std::path::Path;
use texture::Textures;
use tree::{Node, Tree};

/// Reads a scene and checks it; see [`super::load`].
///
/// # Errors
/// [`Error::Input`] with file, line, what was found and what is allowed; [`Error::Io`] where a file cannot be read.
pub fn load(path: &Path, options: &Options) -> Result<Scene> {
    parse_str(&reader::text(super::read(path)?, path)?, path, options)
}

/// [`load`] from text. `path` names the text in messages; relative file names are looked up beside it.
///
/// # Errors
/// As [`load`].
pub fn parse_str(text: &str, path: &Path, options: &Options) -> Result<Scene> {
    let tree = reader::read(text, path, options)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let scene = Scene { name, materials: vec![crate::scene::Material::BLACK], ..Default::default() };
    let mut builder = Builder {
        tree,
        scene,
        size: options.size,
        surfaces: HashMap::new(),
        open_surfaces: Vec::new(),
        default_surface: None,
        textures: Textures::default(),
        meshes: HashMap::new(),
    };
    builder.scene()?;
    builder.finish_textures()?;
    let Builder { tree, mut scene, .. } = builder;
    scene.sources = tree.sources;
    scene.warnings.splice(0..0, tree.warnings);
    scene.validate().map_err(|problems| Error::input(Place::file(path), problems.join("; ")))?;
    let flat = scene.zero_area_triangles();
    if flat > 0 {
        scene.warnings.push(format!("{}: {flat} triangles have no area", path.display()));
    }
    Ok(scene)
}

/// Makes the scene from the tree.
struct Builder {
    tree: Tree,
    scene: Scene,
    /// Film size that replaces the file's.
    size: Option<[u32; 2]>,
    /// Front and back material of the BSDFs built so far, by node.
    surfaces: HashMap<usize, [u32; 2]>,
    /// BSDFs that are being built, each inside the one before it.
    open_surfaces: Vec<usize>,
    /// Material of shapes without BSDF.
    default_surface: Option<u32>,
    textures: Textures,
    /// Meshes of groups, by node.
    meshes: HashMap<usize, Mesh>,
}

impl Builder {
    fn scene(&mut self) -> Result<()> {
        let mut sensor = None;
        let mut integrator = None;
        let mut environment = None;
        for i in 0..self.tree.nodes[0].children.len() {
            let index = self.tree.resolve(&self.tree.nodes[0].children[i])?;
            let node = &self.tree.nodes[index];
            match (node.tag.as_str(), node.plugin.as_str()) {
                ("sensor", _) if sensor.is_none() => sensor = Some(index),
                ("sensor", _) => self.warn(&node.place.clone(), "only the first sensor counts"),
                ("integrator", _) if integrator.is_none() => integrator = Some(index),
                ("integrator", _) => return Err(node.error("a second integrator; a scene has one")),
                ("shape", _) => self.shape(index)?,
                ("emitter", "constant" | "envmap") => {
                    if let Some(first) = environment.replace(node.place.clone()) {
                        return Err(node.error(format!("a second environment; a scene has one (first: {first})")));
                    }
                    self.light(index)?;
                }
                ("emitter", "point" | "spot" | "directional") => self.light(index)?,
                // An area light shines where a shape refers to it.
                ("emitter", "area") => {}
                ("emitter", other) => return Err(node.unsupported(other, light::LIGHTS)),
                // Nothing of these unless something refers to them.
                _ => {}
            }
        }
        let nowhere = || Error::input(self.tree.nodes[0].place.clone(), "the scene has no <sensor>");
        self.sensor(sensor.ok_or_else(nowhere)?)?;
        if let Some(integrator) = integrator {
            self.scene.depth = self.integrator(integrator)?;
        }
        if self.scene.lights.is_empty() {
            if self.scene.shapes.is_empty() {
                return Err(Error::input(
                    self.tree.nodes[0].place.clone(),
                    "the scene is empty: no shape and no light",
                ));
            }
            self.warn(&self.tree.nodes[0].place.clone(), "the scene has no light source");
        }
        Ok(())
    }

    /// Of an integrator only the path lengths count: how paths are sampled is the experiment's business.
    fn integrator(&mut self, index: usize) -> Result<Depth> {
        let node = &self.tree.nodes[index];
        let allowed = "path, volpath, volpathmis, direct, or aov and moment around one of them";
        if matches!(node.plugin.as_str(), "aov" | "moment") {
            self.finish(index, &["aovs"]);
            let inner = self.tree.nodes[index].children.iter().map(|c| self.tree.resolve(c));
            let inner = inner.collect::<Result<Vec<_>>>()?;
            let inner = inner.into_iter().find(|&i| self.tree.nodes[i].tag == "integrator" && i != index);
            // One level only: these plugins are not nested in each other.
            return match inner {
                Some(i) if !matches!(self.tree.nodes[i].plugin.as_str(), "aov" | "moment") => self.integrator(i),
                _ => Err(self.tree.nodes[index].error(format!("no usable integrator inside; allowed: {allowed}"))),
            };
        }
        if node.boolean("hide_emitters")?.unwrap_or(false) {
            return Err(node.error("hide_emitters is not supported: emitters are always seen"));
        }
        let mut depth = Depth::default();
        match node.plugin.as_str() {
            "path" | "volpath" | "volpathmis" => {
                let max = node.integer("max_depth")?.unwrap_or(-1);
                if max != -1 {
                    let max = u32::try_from(max).ok().filter(|&m| m <= i32::MAX as u32);
                    depth.max = Some(max.ok_or_else(|| node.error("max_depth must be -1 (no limit) or at least 0"))?);
                }
                let roulette = node.integer("rr_depth")?.unwrap_or(i64::from(depth.roulette));
                let roulette = u32::try_from(roulette).ok().filter(|r| (1..=i32::MAX as u32).contains(r));
                depth.roulette = roulette.ok_or_else(|| node.error("rr_depth must be at least 1"))?;
            }
            "direct" => depth.max = Some(2),
            other => return Err(node.unsupported(other, allowed)),
        }
        let quiet = ["samples_per_pass", "block_size", "timeout", "shading_samples", "emitter_samples", "bsdf_samples"];
        self.finish(index, &quiet);
        Ok(depth)
    }

    fn warn(&mut self, place: &Place, message: &str) {
        self.scene.warnings.push(format!("{place}: {message}"));
    }

    /// Call when all of a node's properties have been read: warns of those that nobody asked for, but for `quiet` ones
    /// that are known to have no effect on what is measured.
    fn finish(&mut self, index: usize, quiet: &[&str]) {
        let node = &self.tree.nodes[index];
        for property in node.properties.iter().filter(|p| !p.used.replace(true) && !quiet.contains(&p.name.as_str())) {
            let (place, name) = (&property.place, super::shorten(&property.name));
            self.scene.warnings.push(format!("{place}: `{name}` of {} has no effect", node.title()));
        }
    }
}
