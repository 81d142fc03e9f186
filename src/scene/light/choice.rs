//! Which light is sampled, and the sampler that puts choice and light together.

use super::area::Emitter;
use super::{Beam, EnvironmentMap, Light, constant, point};
use crate::accel::{Endpoint, SurfacePoint};
use crate::math::rgb::luminance;
use crate::math::{Rgb, Vec3};
use crate::sampling::discrete::Discrete;
use crate::sampling::strategy::{LightChoice, Lights};
use crate::scene::{Geometry, Scene};
use std::cell::LazyCell;
use std::f64::consts::PI;
use std::sync::Arc;

/// Where light comes from.
#[derive(Clone, Copy, Debug)]
pub enum LightTarget {
    /// A point.
    Point(Endpoint),
    /// A direction, from outside the scene: the same as [`LightSample::wi`].
    Direction,
}

/// A sample of the light that arrives at a point, its visibility unchecked.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// The other end of the shadow ray.
    pub to: LightTarget,
    /// Unit vector to the light.
    pub wi: Vec3,
    /// Radiance towards the point, W m⁻² sr⁻¹; for `delta` lights irradiance at right angles to `wi`, W m⁻².
    pub emitted: Rgb,
    /// Density over solid angle, the choice of the light included, sr⁻¹; for `delta` lights the probability of the choice.
    pub pdf: f32,
    /// Whether no other technique can meet the light.
    pub delta: bool,
    /// Index into [`Scene::lights`] (environments: of the first).
    pub light: u32,
    /// Probability of the light.
    pub choice_pdf: f32,
}

/// One outcome of the choice.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    pub(super) light: u32,
    pub(super) radiance: Rgb,
    pub(super) kind: Kind,
}

#[derive(Clone, Debug)]
pub(super) enum Kind {
    Area(Emitter),
    /// All constant lights of the scene.
    Environment,
    EnvironmentMap(Arc<EnvironmentMap>),
    Point(Vec3),
    Spot(Vec3, Beam),
    /// Unit vector to the light.
    Directional(Vec3),
}

/// No entry.
const ABSENT: u32 = u32::MAX;

/// Draws points on the lights of one scene. Lights that no direction can meet (point, spot, directional) always take part,
/// the others unless [`Lights::None`].
#[derive(Clone, Debug)]
pub struct LightSampler {
    pub(super) entries: Vec<Entry>,
    pub(super) choice: Discrete,
    /// Whether all entries are parallelograms, sampled by area.
    pub(super) patches_alone: bool,
    /// Entry of each shape, or [`ABSENT`].
    pub(super) of_shape: Vec<u32>,
    /// Density of any direction to a constant environment; probability of the choice of an environment map.
    pub(super) environment_pdf: f32,
    environment_map: Option<Arc<EnvironmentMap>>,
    solid_angle: bool,
}

impl LightSampler {
    /// Tables for a scene. By power, the weights are luminances in W: area πAL, point 4πI, spot ΩI with Ω = the
    /// integral of its falloff, directional πR²E, constant and environment map 4π²R²L with L the mean radiance and R the radius
    /// of a sphere around the scene (all the flux that enters it). Lights that cannot emit are left out.
    pub fn new(scene: &Scene, lights: Lights, choice: LightChoice) -> Self {
        let mut entries = Vec::new();
        let mut weights = Vec::new();
        let mut of_shape = vec![ABSENT; scene.shapes.len()];
        let mut environment: Option<usize> = None;
        let radius = LazyCell::new(|| bounding_radius(scene));
        for (index, light) in (0u32..).zip(&scene.lights) {
            let surrounds = matches!(light, Light::Constant { .. } | Light::EnvironmentMap);
            let met = matches!(light, Light::Area { .. }) || surrounds;
            if met && lights == Lights::None || surrounds && environment.is_some() {
                continue;
            }
            let Some((radiance, kind, flux)) = shining(scene, light, || *radius) else { continue };
            let weight = match choice {
                LightChoice::Uniform => f64::from(u8::from(radiance.max_element() > 0.0)),
                LightChoice::Power => flux * f64::from(luminance(radiance)),
            };
            if !(weight > 0.0 && weight.is_finite()) {
                continue;
            }
            if surrounds {
                environment = Some(entries.len());
            }
            if let Light::Area { shape, .. } = *light {
                of_shape[shape as usize] = entries.len() as u32;
            }
            entries.push(Entry { light: index, radiance, kind });
            weights.push(weight);
        }
        let choice = Discrete::new(&weights);
        let environment_map = environment.and_then(|e| match &entries[e].kind {
            Kind::EnvironmentMap(map) => Some(Arc::clone(map)),
            _ => None,
        });
        let density = if environment_map.is_some() { 1.0 } else { constant::pdf() };
        let environment_pdf = environment.map_or(0.0, |e| density * choice.pmf(e));
        let solid_angle = lights == Lights::SolidAngle;
        let is_patch = |e: &Entry| matches!(e.kind, Kind::Area(Emitter::Parallelogram(_)));
        let patches_alone = !solid_angle && entries.iter().all(is_patch);
        Self { entries, choice, patches_alone, of_shape, environment_pdf, environment_map, solid_angle }
    }

    /// A sample of the light that arrives at `p`. Words 0, 1 place it on the light, 2 picks the light, 3 a part of it.
    /// `None` where there is no light, or the drawn one shows `p` its back.
    #[inline(always)]
    pub fn sample(&self, scene: &Scene, p: Vec3, words: [u32; 4]) -> Option<LightSample> {
        if self.choice.is_empty() {
            return None;
        }
        let index = self.choice.pick(words[2]);
        let Entry { light, radiance, ref kind } = self.entries[index];
        let choice_pdf = self.choice.pmf(index);
        let (to, wi, emitted, pdf, delta) = match kind {
            Kind::Area(emitter) => {
                let (at, wi, pdf) = emitter.sample(scene, p, words, self.solid_angle)?;
                (LightTarget::Point(at), wi, radiance, pdf.0, false)
            }
            Kind::Environment => (LightTarget::Direction, constant::sample(words), radiance, constant::pdf(), false),
            Kind::EnvironmentMap(map) => {
                let (wi, pdf) = map.sample(words);
                (LightTarget::Direction, wi, map.lookup(wi).0, pdf, false)
            }
            &Kind::Directional(wi) => (LightTarget::Direction, wi, radiance, 1.0, true),
            &Kind::Spot(position, beam) => {
                let (at, emitted) = point::sample(position, radiance, p)?;
                let wi = (at.p - p).try_normalize()?;
                let emitted = emitted * beam.falloff(-wi);
                (emitted != Rgb::ZERO).then_some((LightTarget::Point(at), wi, emitted, 1.0, true))?
            }
            &Kind::Point(position) => {
                let (at, emitted) = point::sample(position, radiance, p)?;
                (LightTarget::Point(at), (at.p - p).try_normalize()?, emitted, 1.0, true)
            }
        };
        let pdf = pdf * choice_pdf;
        (pdf > 0.0).then_some(LightSample { to, wi, emitted, pdf, delta, light, choice_pdf })
    }

    /// Density over solid angle, the choice included, with which [`Self::sample`] draws the unit direction `wi` from `p` to the
    /// point `hit` of `primitive` (as in [`crate::accel::Hit`]). 0 where it never does.
    #[inline(always)]
    pub fn pdf(&self, scene: &Scene, p: Vec3, wi: Vec3, hit: &SurfacePoint, primitive: u32) -> f32 {
        let index = self.of_shape[hit.shape as usize];
        if index == ABSENT {
            return 0.0;
        }
        let Kind::Area(emitter) = &self.entries[index as usize].kind else { return 0.0 };
        let pdf = emitter.pdf(scene, p, wi, hit, primitive, self.solid_angle);
        pdf.map_or(0.0, |d| d.0 * self.choice.pmf(index as usize))
    }

    /// Density over solid angle, the choice included, with which [`Self::sample`] draws `wi` for the environment.
    #[inline(always)]
    pub fn pdf_environment(&self, wi: Vec3) -> f32 {
        self.environment_map.as_ref().map_or(1.0, |map| map.lookup(wi).1) * self.environment_pdf
    }

    /// Radiance from outside the scene along `direction`, and [`Self::pdf_environment`] of it. `constant`: that of
    /// [`super::environment`].
    #[inline(always)]
    pub fn escape(&self, scene: &Scene, constant: Rgb, direction: Vec3) -> (Rgb, f32) {
        match &scene.environment_map {
            Some(map) => {
                let (radiance, density) = map.lookup(direction);
                (radiance, density * self.environment_pdf)
            }
            None => (constant, self.environment_pdf),
        }
    }

    /// Whether there is nothing to sample.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }
}

/// What a light emits, how it is sampled, and the flux of a unit of it. `None`: a shape without area.
fn shining(scene: &Scene, light: &Light, radius: impl Fn() -> f64) -> Option<(Rgb, Kind, f64)> {
    Some(match *light {
        Light::Area { shape, radiance } => {
            let (emitter, area) = Emitter::new(scene, &scene.shapes[shape as usize].geometry)?;
            (radiance, Kind::Area(emitter), PI * area)
        }
        Light::Point { position, intensity } => (intensity, Kind::Point(position), 4.0 * PI),
        Light::Spot { position, intensity, beam } => (intensity, Kind::Spot(position, beam), beam.solid_angle()),
        Light::Directional { direction, irradiance } => {
            (irradiance, Kind::Directional(-direction), PI * radius().powi(2))
        }
        Light::EnvironmentMap => {
            let map = scene.environment_map.as_ref()?;
            (map.mean(), Kind::EnvironmentMap(Arc::clone(map)), (2.0 * PI * radius()).powi(2))
        }
        Light::Constant { .. } => (constant::environment(scene), Kind::Environment, (2.0 * PI * radius()).powi(2)),
    })
}

/// Radius of the sphere around the box around all surfaces.
fn bounding_radius(scene: &Scene) -> f64 {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let mut add = |p: Vec3, extent: Vec3| {
        low = low.min(p - extent.abs());
        high = high.max(p + extent.abs());
    };
    for t in &scene.triangles {
        for v in t.vertices {
            add(scene.positions[v as usize], Vec3::ZERO);
        }
    }
    for shape in &scene.shapes {
        match shape.geometry {
            Geometry::Mesh { .. } | Geometry::Rectangle { .. } => {}
            Geometry::Sphere { center, radius, .. } => add(center, Vec3::splat(radius)),
            Geometry::Disk { center, u, v } => add(center, u.abs() + v.abs()),
            Geometry::Cylinder { p0, axis, radius, .. } => {
                add(p0, Vec3::splat(radius));
                add(p0 + axis, Vec3::splat(radius));
            }
        }
    }
    // Without surfaces any radius will do; nothing can be lit.
    if low.x <= high.x { f64::from(low.distance(high)) / 2.0 } else { 1.0 }
}
