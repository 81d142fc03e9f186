//! A scene and a strategy in device memory, in the layout of `shaders/transport/tracer.glsl`.

use super::buffer::Buffer;
use super::commands::Commands;
use crate::accel::QuadricMap;
use crate::accel::compact::{CompactBvh, CompactTree};
use crate::accel::surface::Surface;
use crate::error::Result;
use crate::math::{Rgb, Vec2, Vec3, warp};
use crate::sampling::strategy::{Heuristic, Lights, Strategy};
use crate::sampling::{Sequence, strategy::Directions};
use crate::scene::light::{LightTables, environment};
use crate::scene::material::{Coat, Distribution, Microfacets, Relief, ReliefMap};
use crate::scene::texture::{Input, PackedTexture};
use crate::scene::{Bsdf, Camera, Effects, EnvironmentMap, Filter, Geometry, Light, Material, Projection, Scene};
use bytemuck::{Pod, Zeroable};
use std::borrow::Cow;

/// The scene's part, shared by all strategies.
pub(super) struct SceneBuffers {
    quantiles: Buffer,
    triangle_nodes: Buffer,
    quadric_nodes: Buffer,
    triangles: Buffer,
    quadrics: Buffer,
    surfaces: Buffer,
    vertices: Buffer,
    normals: Buffer,
    shapes: Buffer,
    materials: Buffer,
    transmittances: Buffer,
    uvs: Buffer,
    quadric_maps: Buffer,
    textures: Buffer,
    texels: Buffer,
    attributes: Buffer,
    radiances: Buffer,
    environment_map: Option<EnvironmentMapBuffers>,
    triangle_tree: (u32, [[f32; 3]; 2]),
    quadric_tree: (u32, [[f32; 3]; 2]),
    /// Entries that a walk's stack needs at most.
    pub(super) stack: u32,
    /// Boxes of the quadrics: lower and upper corners.
    pub(super) boxes: Vec<[[f32; 3]; 2]>,
}

impl SceneBuffers {
    pub(super) fn new(commands: &mut Commands, scene: &Scene, bvh: &CompactBvh) -> Result<Self> {
        let mut up = |bytes: &[u8]| commands.upload(bytes);
        let effects = Effects::of(scene, false);
        let smooth = effects.contains(Effects::SMOOTH_NORMALS);
        let mapped = effects.intersects(Effects::TEXTURES.with(Effects::TANGENTS).with(Effects::RELIEFS));
        let indexed = smooth || mapped;
        let vertices: Vec<[u32; 3]> =
            if indexed { scene.triangles.iter().map(|t| t.vertices).collect() } else { Vec::new() };
        let uvs: &[Vec2] = if mapped { &scene.uvs } else { &[] };
        // Kernels that have more effects than the scene calls for look up every surface, so what is not there must not be named.
        let surfaces: Cow<'_, [Surface]> = match mapped || scene.uvs.is_empty() {
            true => Cow::Borrowed(&bvh.surfaces),
            false => bvh.surfaces.iter().map(Surface::without_uvs).collect(),
        };
        let quadric_maps: Vec<QuadricMap> = scene.shapes.iter().filter_map(QuadricMap::new).collect();
        let textures: Vec<PackedTexture> = scene.textures.iter().map(PackedTexture::from).collect();
        let normals: &[Vec3] = if smooth { &scene.normals } else { &[] };
        let mut quadrics = 0..;
        let shapes: Vec<[u32; 4]> = scene
            .shapes
            .iter()
            .map(|s| {
                let flat = matches!(s.geometry, Geometry::Mesh { .. } | Geometry::Rectangle { .. });
                let quadric = if flat { None } else { quadrics.next() };
                [s.front, s.back, s.light.unwrap_or(u32::MAX), quadric.unwrap_or(u32::MAX)]
            })
            .collect();
        let materials: Vec<MaterialAt> = scene.materials.iter().map(MaterialAt::of).collect();
        let transmittances: Vec<f32> = scene.transmittances.iter().flat_map(|t| t.0).collect();
        let radiance = |l: &Light| match *l {
            Light::Area { radiance, .. } => radiance,
            _ => Rgb::ZERO,
        };
        let radiances: Vec<Rgb> = scene.lights.iter().map(radiance).collect();
        let map = scene.environment_map.as_deref().map(|map| EnvironmentMapBuffers::new(&mut up, map));
        let tree = |t: &CompactTree| (t.root, t.bounds);
        Ok(Self {
            environment_map: map.transpose()?,
            quantiles: up(bytemuck::cast_slice(warp::gaussian_quantiles()))?,
            triangle_nodes: up(bytemuck::cast_slice(&bvh.triangle_tree.nodes))?,
            quadric_nodes: up(bytemuck::cast_slice(&bvh.quadric_tree.nodes))?,
            triangles: up(bytemuck::cast_slice(&bvh.triangles))?,
            quadrics: up(bytemuck::cast_slice(&bvh.quadrics))?,
            surfaces: up(bytemuck::cast_slice(&surfaces))?,
            vertices: up(bytemuck::cast_slice(&vertices))?,
            normals: up(bytemuck::cast_slice(normals))?,
            shapes: up(bytemuck::cast_slice(&shapes))?,
            materials: up(bytemuck::cast_slice(&materials))?,
            transmittances: up(bytemuck::cast_slice(&transmittances))?,
            uvs: up(bytemuck::cast_slice(uvs))?,
            quadric_maps: up(bytemuck::cast_slice(&quadric_maps))?,
            textures: up(bytemuck::cast_slice(&textures))?,
            texels: up(bytemuck::cast_slice(&scene.texels))?,
            attributes: up(bytemuck::cast_slice(&scene.attributes))?,
            radiances: up(bytemuck::cast_slice(&radiances))?,
            triangle_tree: tree(&bvh.triangle_tree),
            quadric_tree: tree(&bvh.quadric_tree),
            stack: bvh.triangle_tree.depth.max(bvh.quadric_tree.depth).max(1),
            boxes: bvh.quadrics.iter().map(|q| q.bounds()).collect(),
        })
    }
}

/// An environment map and its distributions.
struct EnvironmentMapBuffers {
    _tables: [Buffer; 4],
    map: Buffer,
}

/// `EnvironmentMap` of `shaders/scene/scene.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct EnvironmentMapAt {
    axes: [[f32; 3]; 3],
    width: u32,
    band_count: u32,
    pad: u32,
    tables: [u64; 4],
}

impl EnvironmentMapBuffers {
    fn new(up: &mut impl FnMut(&[u8]) -> Result<Buffer>, map: &EnvironmentMap) -> Result<Self> {
        let (rows, columns) = map.thresholds();
        let tables = [
            up(bytemuck::cast_slice(map.texels()))?,
            up(bytemuck::cast_slice(map.bands()))?,
            up(bytemuck::cast_slice(rows))?,
            up(bytemuck::cast_slice(&columns))?,
        ];
        let frame = map.frame();
        let at = EnvironmentMapAt {
            axes: [frame.s, frame.t, frame.n].map(Into::into),
            width: map.width(),
            band_count: map.bands().len() as u32,
            pad: 0,
            tables: tables.each_ref().map(|t| t.address),
        };
        Ok(Self { map: up(bytemuck::bytes_of(&at))?, _tables: tables })
    }
}

/// A strategy's part.
pub(super) struct TracerBuffers {
    _lights: [Buffer; 6],
    pub(super) tracer: Buffer,
}

/// `Material` of shaders/scene/material/material.glsl.
#[derive(Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
struct MaterialAt {
    reflectance: [f32; 3],
    kind: u32,
    second: [f32; 3],
    eta: f32,
    k: [f32; 3],
    distribution: u32,
    alpha: [f32; 2],
    table: u32,
    nonlinear: u32,
    internal: f32,
    specular_weight: f32,
    /// Of `reflectance`, `second` and `alpha`; [`u32::MAX`] where they are the same everywhere.
    textures: [u32; 4],
    materials: [u32; 2],
    /// Scale of a bump map, or the colour of a constant normal map.
    relief: [f32; 3],
    /// 0 none, 1 bump map, 2 normal map; + 4 inward, + 8 flips, + 16 shadows.
    relief_mode: u32,
    /// Or [`u32::MAX`].
    relief_texture: u32,
}

impl MaterialAt {
    fn of(material: &Material) -> Self {
        Self::of_bsdf(&material.bsdf).bent(material.relief.as_ref())
    }

    fn bent(self, relief: Option<&Relief>) -> Self {
        let Some(relief) = relief else { return self };
        let (map, value) = match relief.map {
            ReliefMap::Bump { scale, .. } => (1, Rgb::splat(scale)),
            ReliefMap::Normal(Input::Value(value)) => (2, value),
            ReliefMap::Normal(Input::Texture(_)) => (2, Rgb::ZERO),
        };
        let flags = [(relief.inward, 4), (relief.flips, 8), (relief.shadows, 16)];
        let flags: u32 = flags.iter().filter(|f| f.0).map(|f| f.1).sum();
        let relief_texture = relief.texture().unwrap_or(u32::MAX);
        Self { relief: value.into(), relief_mode: map + flags, relief_texture, ..self }
    }

    fn of_bsdf(bsdf: &Bsdf<Input, Input>) -> Self {
        let zero = Self { textures: [u32::MAX; 4], relief_texture: u32::MAX, ..Self::default() };
        let (zero_input, split) = (Input::Value(Rgb::ZERO), |input: &Input| match *input {
            Input::Value(value) => (value.to_array(), u32::MAX),
            Input::Texture(index) => ([0.0; 3], index),
        });
        let plain = |kind, reflectance: &Input, second: &Input| {
            let ((reflectance, a), (second, b)) = (split(reflectance), split(second));
            Self { kind, reflectance, second, textures: [a, b, u32::MAX, u32::MAX], ..zero }
        };
        let conductor = |kind, eta: &Rgb, k: &Rgb, reflectance: &Input| Self {
            second: (*eta).into(),
            k: (*k).into(),
            ..plain(kind, reflectance, &zero_input)
        };
        match bsdf {
            Bsdf::Black => zero,
            Bsdf::Diffuse { reflectance } => plain(1, reflectance, &zero_input),
            Bsdf::Conductor { eta, k, reflectance } => conductor(2, eta, k, reflectance),
            Bsdf::Dielectric { eta, reflectance, transmittance } => {
                Self { eta: *eta, ..plain(3, reflectance, transmittance) }
            }
            Bsdf::ThinDielectric { eta, reflectance, transmittance } => {
                Self { eta: *eta, ..plain(4, reflectance, transmittance) }
            }
            Bsdf::Null => Self { kind: 5, ..zero },
            Bsdf::RoughConductor { facets, eta, k, reflectance } => conductor(6, eta, k, reflectance).rough(facets),
            Bsdf::RoughDielectric { facets, eta, reflectance, transmittance } => {
                Self { eta: *eta, ..plain(7, reflectance, transmittance) }.rough(facets)
            }
            Bsdf::Plastic { coat, reflectance, specular } => plain(8, reflectance, specular).coated(coat),
            Bsdf::RoughPlastic { facets, coat, table, reflectance, specular } => {
                Self { table: *table, ..plain(9, reflectance, specular) }.coated(coat).rough(facets)
            }
            Bsdf::Mixture { weight, materials } => {
                Self { kind: 10, materials: *materials, ..zero }.numbers([*weight, zero_input])
            }
        }
    }

    /// With these for `alpha`.
    fn numbers(mut self, inputs: [Input; 2]) -> Self {
        for (k, input) in inputs.into_iter().enumerate() {
            match input {
                Input::Value(value) => self.alpha[k] = value.x,
                Input::Texture(index) => self.textures[2 + k] = index,
            }
        }
        self
    }

    fn rough(self, facets: &Microfacets<Input>) -> Self {
        let distribution = u32::from(facets.distribution == Distribution::Beckmann);
        Self { distribution, ..self }.numbers(facets.alpha)
    }

    fn coated(self, coat: &Coat) -> Self {
        let Coat { eta, internal, nonlinear, specular_weight } = *coat;
        Self { eta, internal, nonlinear: nonlinear.into(), specular_weight, ..self }
    }
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct TreeAt {
    nodes: u64,
    bounds: [[f32; 3]; 2],
    root: u32,
    pad: u32,
}

/// `Camera` of `shaders/scene/scene.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct CameraAt {
    origin: [f32; 3],
    near: f32,
    corner: [f32; 3],
    far: f32,
    across: [f32; 3],
    down: [f32; 3],
    projection: u32,
    u: [f32; 3],
    v: [f32; 3],
    inverse_focus: f32,
}

impl CameraAt {
    fn of(camera: &Camera) -> Self {
        let (projection, [u, v], inverse_focus) = match camera.projection {
            Projection::Pinhole => (0, [Vec3::ZERO; 2], 0.0),
            Projection::ThinLens { radii, inverse_focus } => (1, radii, inverse_focus),
            Projection::Orthographic { direction } => (2, [direction, Vec3::ZERO], 0.0),
        };
        Self {
            origin: camera.origin.into(),
            near: camera.near,
            corner: camera.corner.into(),
            far: camera.far,
            across: camera.across.into(),
            down: camera.down.into(),
            projection,
            u: u.into(),
            v: v.into(),
            inverse_focus,
        }
    }
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Tracer {
    camera: CameraAt,
    film_size: [u32; 2],
    crop_offset: [u32; 2],
    crop_size: [u32; 2],
    filter_kind: u32,
    filter_width: f32,
    quantiles: u64,
    triangle_tree: TreeAt,
    quadric_tree: TreeAt,
    triangles: u64,
    quadrics: u64,
    surfaces: u64,
    vertices: u64,
    normals: u64,
    shapes: u64,
    materials: u64,
    transmittances: u64,
    uvs: u64,
    quadric_maps: u64,
    textures: u64,
    texels: u64,
    attributes: u64,
    radiances: u64,
    top_level: u64,
    lights: LightsAt,
    environment: [f32; 3],
    triangle_count: u32,
}

/// `LightSampler` of `shaders/scene/scene.glsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct LightsAt {
    tables: [u64; 6],
    entry_count: u32,
    environment_pdf: f32,
    environment_map: u64,
}

/// What a strategy does, in the order of the specialization constants from [`FIRST_SETTING`] on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Settings {
    directions: u32,
    lights: u32,
    heuristic: u32,
    sequence: u32,
    max_depth: u32,
    roulette_depth: u32,
}

/// Ids of specialization constants: see `shaders/transport/specialise.glsl` and `shaders/accel/tree.glsl`.
pub(super) const EFFECTS: u32 = 2;
pub(super) const LIGHT_KINDS: u32 = 3;
const FIRST_SETTING: u32 = 4;
pub(super) const STACK: u32 = 10;

impl Settings {
    pub(super) fn new(strategy: &Strategy, (max_depth, roulette_depth): (u32, u32)) -> Self {
        Self {
            directions: match strategy.directions {
                Directions::Uniform => 0,
                Directions::Cosine => 1,
                Directions::Bsdf => 2,
            },
            lights: match strategy.lights {
                Lights::None => 0,
                Lights::Area => 1,
                Lights::SolidAngle => 2,
            },
            heuristic: match strategy.heuristic {
                Heuristic::None => 0,
                Heuristic::Balance => 1,
                Heuristic::Power => 2,
                Heuristic::Cutoff => 3,
                Heuristic::Maximum => 4,
            },
            sequence: match strategy.sequence {
                Sequence::Independent => 0,
                Sequence::Stratified => 1,
                Sequence::LatinHypercube => 2,
                Sequence::Sobol => 3,
            },
            max_depth,
            roulette_depth,
        }
    }

    /// As specialization constants (id, value).
    pub(super) fn constants(&self) -> impl Iterator<Item = (u32, u32)> + use<> {
        let words: [u32; 6] = bytemuck::cast(*self);
        (FIRST_SETTING..).zip(words)
    }
}

impl TracerBuffers {
    pub(super) fn new(
        commands: &mut Commands,
        scene: &Scene,
        buffers: &SceneBuffers,
        lights: &LightTables,
        top_level: u64,
    ) -> Result<Self> {
        let mut up = |bytes: &[u8]| commands.upload(bytes);
        let tables = [
            up(bytemuck::cast_slice(&lights.entries))?,
            up(bytemuck::cast_slice(&lights.choice))?,
            up(bytemuck::cast_slice(&lights.of_shape))?,
            up(bytemuck::cast_slice(&lights.drawn_triangles))?,
            up(bytemuck::cast_slice(&lights.drawn_first))?,
            up(bytemuck::cast_slice(&lights.densities))?,
        ];
        let (film, b) = (&scene.film, buffers);
        let (filter_kind, filter_width) = match film.filter {
            Filter::Box => (0, 0.0),
            Filter::Tent { radius } => (1, radius),
            Filter::Gaussian { stddev } => (2, stddev),
        };
        let tree = |(root, bounds): (u32, _), nodes: &Buffer| TreeAt { nodes: nodes.address, bounds, root, pad: 0 };
        let tracer = Tracer {
            camera: CameraAt::of(&scene.camera),
            film_size: film.size,
            crop_offset: film.crop_offset,
            crop_size: film.crop_size,
            filter_kind,
            filter_width,
            quantiles: b.quantiles.address,
            triangle_tree: tree(b.triangle_tree, &b.triangle_nodes),
            quadric_tree: tree(b.quadric_tree, &b.quadric_nodes),
            triangles: b.triangles.address,
            quadrics: b.quadrics.address,
            surfaces: b.surfaces.address,
            vertices: b.vertices.address,
            normals: b.normals.address,
            shapes: b.shapes.address,
            materials: b.materials.address,
            transmittances: b.transmittances.address,
            uvs: b.uvs.address,
            quadric_maps: b.quadric_maps.address,
            textures: b.textures.address,
            texels: b.texels.address,
            attributes: b.attributes.address,
            radiances: b.radiances.address,
            top_level,
            lights: LightsAt {
                tables: tables.each_ref().map(|t| t.address),
                entry_count: lights.entries.len() as u32,
                environment_pdf: lights.environment_pdf,
                environment_map: b.environment_map.as_ref().map_or(0, |m| m.map.address),
            },
            environment: environment(scene).into(),
            triangle_count: scene.triangles.len() as u32,
        };
        let tracer = up(bytemuck::bytes_of(&tracer))?;
        Ok(Self { _lights: tables, tracer })
    }
}
