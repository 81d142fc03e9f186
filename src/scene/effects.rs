//! What a scene calls for, of all that the path tracer can do.

use super::material::{Distribution, Microfacets};
use super::texture::Input;
use super::{Bsdf, Camera, Geometry, Light, Material, Projection, Scene, Shape};

/// The effects that a scene calls for, one bit each. GPU kernels leave out the rest; its twin is
/// `shaders/transport/specialise.glsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effects(u32);

impl Effects {
    /// None at all.
    pub const NONE: Self = Self(0);
    /// Surfaces made of triangles.
    pub const TRIANGLES: Self = Self(1);
    /// Spheres, disks and cylinders.
    pub const QUADRICS: Self = Self(2);
    /// Normals interpolated over triangles.
    pub const SMOOTH_NORMALS: Self = Self(4);
    /// Surfaces that emit.
    pub const EMITTING_SURFACES: Self = Self(8);
    /// Light from where no surface is.
    pub const ENVIRONMENT: Self = Self(16);
    /// Next-event estimation: the scene has lights that the strategy samples.
    pub const SAMPLED_LIGHTS: Self = Self(32);
    /// Diffuse materials.
    pub const DIFFUSE: Self = Self(64);
    /// Smooth conductors.
    pub const CONDUCTORS: Self = Self(128);
    /// Smooth dielectrics.
    pub const DIELECTRICS: Self = Self(256);
    /// Panes.
    pub const THIN_DIELECTRICS: Self = Self(512);
    /// Surfaces that let all light through.
    pub const NULL: Self = Self(1024);
    /// Inputs of materials that vary over surfaces.
    pub const TEXTURES: Self = Self(1 << 11);
    /// Frames turned along texture coordinates.
    pub const TANGENTS: Self = Self(1 << 12);
    /// Bump and normal maps.
    pub const RELIEFS: Self = Self(1 << 13);
    /// Materials in layers: masks and blends.
    pub const MIXTURES: Self = Self(1 << 14);
    /// Radiance from outside by direction.
    pub const ENVIRONMENT_MAP: Self = Self(1 << 15);
    /// Rays through a thin lens.
    pub const LENS: Self = Self(1 << 16);
    /// Parallel camera rays.
    pub const ORTHOGRAPHIC: Self = Self(1 << 17);
    /// Rough conductors.
    pub const ROUGH_CONDUCTORS: Self = Self(1 << 18);
    /// Rough dielectrics.
    pub const ROUGH_DIELECTRICS: Self = Self(1 << 19);
    /// Diffuse materials under smooth coats.
    pub const PLASTICS: Self = Self(1 << 20);
    /// Diffuse materials under rough coats.
    pub const ROUGH_PLASTICS: Self = Self(1 << 21);
    /// Microfacets with Gaussian slopes.
    pub const BECKMANN: Self = Self(1 << 22);
    /// Spot lights.
    pub const SPOTS: Self = Self(1 << 23);
    /// Light from one direction.
    pub const DIRECTIONAL: Self = Self(1 << 24);

    /// What the short variant of the GPU's kernels has: drivers take long for code even where constants switch it off.
    pub const SHORT: Self = Self((1 << 11) - 1);

    /// Every effect with its name.
    pub const ALL: [(Self, &str); 25] = [
        (Self::TRIANGLES, "triangles"),
        (Self::QUADRICS, "quadrics"),
        (Self::SMOOTH_NORMALS, "smooth normals"),
        (Self::EMITTING_SURFACES, "emitting surfaces"),
        (Self::ENVIRONMENT, "environment"),
        (Self::SAMPLED_LIGHTS, "sampled lights"),
        (Self::DIFFUSE, "diffuse materials"),
        (Self::CONDUCTORS, "smooth conductors"),
        (Self::DIELECTRICS, "smooth dielectrics"),
        (Self::THIN_DIELECTRICS, "thin dielectrics"),
        (Self::NULL, "null materials"),
        (Self::TEXTURES, "textures"),
        (Self::TANGENTS, "tangents"),
        (Self::RELIEFS, "bump and normal maps"),
        (Self::MIXTURES, "mixtures"),
        (Self::ENVIRONMENT_MAP, "environment map"),
        (Self::LENS, "lens"),
        (Self::ORTHOGRAPHIC, "orthographic camera"),
        (Self::ROUGH_CONDUCTORS, "rough conductors"),
        (Self::ROUGH_DIELECTRICS, "rough dielectrics"),
        (Self::PLASTICS, "smooth plastics"),
        (Self::ROUGH_PLASTICS, "rough plastics"),
        (Self::BECKMANN, "Beckmann microfacets"),
        (Self::SPOTS, "spot lights"),
        (Self::DIRECTIONAL, "directional lights"),
    ];

    /// All of them.
    pub const EVERY: Self = {
        let (mut all, mut i) = (Self::NONE, 0);
        while i < Self::ALL.len() {
            all = all.with(Self::ALL[i].0);
            i += 1;
        }
        all
    };

    /// What the scene calls for; `samples_lights`: whether the strategy has lights to sample there.
    pub fn of(scene: &Scene, samples_lights: bool) -> Self {
        let shapes = scene.shapes.iter().map(Self::of_shape);
        let lights = scene.lights.iter().map(Self::of_light);
        let sampled = if samples_lights { Self::SAMPLED_LIGHTS } else { Self::NONE };
        let rest = [Self::of_materials(scene), Self::of_camera(&scene.camera), sampled];
        shapes.chain(lights).chain(rest).fold(Self::NONE, Self::with)
    }

    /// What a shape calls for, apart from its materials.
    pub fn of_shape(shape: &Shape) -> Self {
        let surface = match shape.geometry {
            Geometry::Mesh { smooth: true, .. } => Self::TRIANGLES.with(Self::SMOOTH_NORMALS),
            Geometry::Mesh { .. } | Geometry::Rectangle { .. } => Self::TRIANGLES,
            Geometry::Sphere { .. } | Geometry::Disk { .. } | Geometry::Cylinder { .. } => Self::QUADRICS,
        };
        if shape.light.is_some() { surface.with(Self::EMITTING_SURFACES) } else { surface }
    }

    /// What a light calls for, apart from its shape and from being sampled.
    pub fn of_light(light: &Light) -> Self {
        match light {
            Light::Area { .. } | Light::Point { .. } => Self::NONE,
            Light::Spot { .. } => Self::SPOTS,
            Light::Directional { .. } => Self::DIRECTIONAL,
            Light::EnvironmentMap => Self::ENVIRONMENT.with(Self::ENVIRONMENT_MAP),
            Light::Constant { .. } => Self::ENVIRONMENT,
        }
    }

    /// What the camera calls for.
    pub fn of_camera(camera: &Camera) -> Self {
        match camera.projection {
            Projection::Pinhole => Self::NONE,
            Projection::ThinLens { .. } => Self::LENS,
            Projection::Orthographic { .. } => Self::ORTHOGRAPHIC,
        }
    }

    /// What the scene's materials call for.
    pub fn of_materials(scene: &Scene) -> Self {
        scene.materials.iter().map(Self::of_material).fold(Self::NONE, Self::with)
    }

    /// What a material calls for, apart from those that it mixes.
    pub fn of_material(material: &Material) -> Self {
        let slopes = |facets: &Microfacets<Input>| match facets.distribution {
            Distribution::Ggx => Self::NONE,
            Distribution::Beckmann => Self::BECKMANN,
        };
        let kind = match &material.bsdf {
            Bsdf::Black => Self::NONE,
            Bsdf::Diffuse { .. } => Self::DIFFUSE,
            Bsdf::Conductor { .. } => Self::CONDUCTORS,
            Bsdf::Dielectric { .. } => Self::DIELECTRICS,
            Bsdf::ThinDielectric { .. } => Self::THIN_DIELECTRICS,
            Bsdf::Null => Self::NULL,
            Bsdf::RoughConductor { facets, .. } => Self::ROUGH_CONDUCTORS.with(slopes(facets)),
            Bsdf::RoughDielectric { facets, .. } => Self::ROUGH_DIELECTRICS.with(slopes(facets)),
            Bsdf::Plastic { .. } => Self::PLASTICS,
            Bsdf::RoughPlastic { facets, .. } => Self::ROUGH_PLASTICS.with(slopes(facets)),
            Bsdf::Mixture { .. } => Self::MIXTURES,
        };
        let varies = |input: &Input| matches!(input, Input::Texture(_));
        let textured = if material.bsdf.any(varies, varies) { Self::TEXTURES } else { Self::NONE };
        let turned = if material.bsdf.is_anisotropic() { Self::TANGENTS } else { Self::NONE };
        let bent = if material.relief.is_some() { Self::RELIEFS } else { Self::NONE };
        kind.with(textured).with(turned).with(bent)
    }

    /// Whether materials that call for these are all diffuse or black.
    pub const fn are_diffuse(self) -> bool {
        Self::DIFFUSE.with(Self::TEXTURES).contains(self)
    }

    /// The names of these, in the order of [`Self::ALL`].
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        Self::ALL.into_iter().filter(move |(e, _)| self.contains(*e)).map(|(_, name)| name)
    }

    /// These and those of `other`.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// All but these.
    #[must_use]
    pub const fn left_out(self) -> Self {
        Self(Self::EVERY.0 & !self.0)
    }

    /// Whether all of `other` are among these.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether any of `other` are among these.
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// The bits.
    pub const fn bits(self) -> u32 {
        self.0
    }
}
