//! What a scene is made of: counts, bytes, and which of its objects call for which effects.

use super::light::samples_solid_angle;
use super::{Bsdf, Effects, Light, Projection, Scene, Shape};
use serde::Serialize;

/// Objects of one kind.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Count {
    /// The kind.
    pub kind: &'static str,
    /// How many.
    pub count: usize,
}

/// How many objects of which kinds a scene has.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Triangles, those of rectangles included.
    pub triangles: usize,
    /// Vertices of triangles.
    pub vertices: usize,
    /// Shapes by kind.
    pub shapes: Vec<Count>,
    /// Lights by kind.
    pub lights: Vec<Count>,
    /// Materials by kind, without the black one that every scene has.
    pub materials: Vec<Count>,
    /// Textures by kind.
    pub textures: Vec<Count>,
    /// Texels of all textures.
    pub texels: usize,
    /// Texels of the environment map.
    pub environment_texels: usize,
}

/// Bytes that a scene takes in memory, apart from names and warnings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Bytes {
    /// Triangles, and positions, normals and texture coordinates of their vertices.
    pub triangles: usize,
    /// Shapes, materials with their tables, and lights.
    pub objects: usize,
    /// Texels and mesh attributes.
    pub textures: usize,
    /// Texels of the environment map and the tables that it is sampled with.
    pub environment_map: usize,
}

/// An effect and the objects that call for it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cause {
    /// The effect.
    pub effect: Effects,
    /// Its name.
    pub name: &'static str,
    /// Names of the objects, in the order of the scene.
    pub objects: Vec<String>,
}

impl Counts {
    /// Of a scene.
    pub fn of(scene: &Scene) -> Self {
        Self {
            triangles: scene.triangles.len(),
            vertices: scene.positions.len(),
            shapes: by_kind(scene.shapes.iter().map(|s| s.geometry.kind())),
            lights: by_kind(scene.lights.iter().map(Light::kind)),
            materials: by_kind(scene.materials.iter().skip(1).map(|m| m.bsdf.kind())),
            textures: by_kind(scene.textures.iter().map(|t| t.kind())),
            texels: scene.texels.len(),
            environment_texels: scene.environment_map.as_ref().map_or(0, |m| m.texels().len()),
        }
    }
}

/// In order of first appearance.
fn by_kind(kinds: impl Iterator<Item = &'static str>) -> Vec<Count> {
    let mut counts: Vec<Count> = Vec::new();
    for kind in kinds {
        match counts.iter_mut().find(|c| c.kind == kind) {
            Some(count) => count.count += 1,
            None => counts.push(Count { kind, count: 1 }),
        }
    }
    counts
}

impl Bytes {
    /// Of a scene.
    pub fn of(scene: &Scene) -> Self {
        let (shapes, materials) = (size_of_val(&scene.shapes[..]), size_of_val(&scene.materials[..]));
        let vertices =
            size_of_val(&scene.positions[..]) + size_of_val(&scene.normals[..]) + size_of_val(&scene.uvs[..]);
        let tables = size_of_val(&scene.transmittances[..]);
        let textures = [&scene.texels, &scene.attributes].map(|c| size_of_val(&c[..])).iter().sum::<usize>();
        let map = scene.environment_map.as_ref();
        Self {
            triangles: vertices + size_of_val(&scene.triangles[..]),
            objects: shapes + materials + tables + size_of_val(&scene.lights[..]),
            textures: textures + size_of_val(&scene.textures[..]),
            environment_map: map.map_or(0, |m| m.bytes()),
        }
    }

    /// All together.
    pub fn total(&self) -> usize {
        self.triangles + self.objects + self.textures + self.environment_map
    }
}

/// The effects that a scene calls for, each with the objects because of which it does. `samples_lights`: as for
/// [`Effects::of`].
pub fn causes(scene: &Scene, samples_lights: bool) -> Vec<Cause> {
    let materials = with_mixed(scene);
    let mut objects: Vec<(Effects, String)> = Vec::new();
    let projection = match scene.camera.projection {
        Projection::Pinhole => "pinhole camera",
        Projection::ThinLens { .. } => "thin lens camera",
        Projection::Orthographic { .. } => "orthographic camera",
    };
    objects.push((Effects::of_camera(&scene.camera), projection.into()));
    for shape in &scene.shapes {
        let sides = [shape.front, shape.back].map(|m| materials[m as usize]);
        objects.push((Effects::of_shape(shape).with(sides[0]).with(sides[1]), shape.name.clone()));
    }
    for (i, light) in scene.lights.iter().enumerate() {
        let sampled = if samples_lights { Effects::SAMPLED_LIGHTS } else { Effects::NONE };
        objects.push((Effects::of_light(light).with(sampled), light_name(scene, i, light)));
    }
    let called = Effects::of(scene, samples_lights);
    let cause = |(effect, name): (Effects, &'static str)| {
        let calling = objects.iter().filter(|(e, _)| e.contains(effect));
        let mut objects: Vec<String> = calling.map(|(_, object)| object.clone()).collect();
        if objects.is_empty() {
            objects.push("a material that no shape has".into());
        }
        Cause { effect, name, objects }
    };
    Effects::ALL.into_iter().filter(|(e, _)| called.contains(*e)).map(cause).collect()
}

/// What each material calls for, together with those that it mixes.
fn with_mixed(scene: &Scene) -> Vec<Effects> {
    let mut effects: Vec<Effects> = Vec::with_capacity(scene.materials.len());
    for material in &scene.materials {
        let mut all = Effects::of_material(material);
        // Mixtures come after what they mix.
        if let Bsdf::Mixture { materials, .. } = material.bsdf {
            all = materials.iter().fold(all, |all, &m| all.with(effects[m as usize]));
        }
        effects.push(all);
    }
    effects
}

/// "lamp" of an area light, else kind and place in the list.
fn light_name(scene: &Scene, index: usize, light: &Light) -> String {
    match light {
        Light::Area { shape, .. } => scene.shapes[*shape as usize].name.clone(),
        Light::EnvironmentMap | Light::Constant { .. } => light.kind().into(),
        _ => format!("{} light {index}", light.kind()),
    }
}

/// Lights that are drawn by area where others are drawn by the solid angle that they subtend.
pub fn sampled_by_area(scene: &Scene) -> Vec<&Shape> {
    scene.shapes.iter().filter(|s| s.light.is_some() && !samples_solid_angle(&s.geometry)).collect()
}
