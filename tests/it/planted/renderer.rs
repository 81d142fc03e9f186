//! A small path tracer as a user of the library would write it, one path at a time, with a switch for every bug.

use rootn::accel::bvh::Bvh;
use rootn::accel::{Intersect, Ray, leave, segment};
use rootn::estimator::cpu::PreparedScene;
use rootn::estimator::{Cell, Estimate, Estimator, Shape, estimate_by_samples};
use rootn::math::{Frame, Rgb, Vec3};
use rootn::record::Dependence;
use rootn::sampling::dimension::{Decision, group};
use rootn::sampling::rng::unit_f32;
use rootn::sampling::strategy::{Directions, Heuristic, LightChoice, Lights};
use rootn::sampling::{Draw, Sequence};
use rootn::scene::Scene;
use rootn::scene::light::{LightSampler, LightTarget, emitted};
use rootn::scene::material::Scattered;
use std::sync::Arc;

/// What is wrong with a renderer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Bug {
    /// Nothing.
    None,
    /// Light samples without the cosine at the surface.
    MissingCosine,
    /// The density of light samples is taken for 2 % more than it is.
    PdfOff,
    /// Samples above 10 are cut.
    Clamp,
    /// Light samples at a grazing lamp give 0/0, which counts as black.
    NanDropped,
    /// The same, but handed on.
    Nan,
    /// Paths that roulette spares are not made up for the others.
    Roulette,
    /// Light samples are weighted by the power heuristic, directions by the balance heuristic.
    MisWeights,
    /// Lights are picked by power, weighted as if picked evenly.
    LightProbability,
}

/// Path tracing with directions by the BSDF and light sampling.
pub(crate) struct Renderer {
    prepared: Arc<PreparedScene>,
    lights: LightSampler,
    number_of_lights: f32,
    bug: Bug,
}

impl Renderer {
    pub(crate) fn new(prepared: &Arc<PreparedScene>, bug: Bug) -> Self {
        let scene = &prepared.scene;
        let lights = LightSampler::new(scene, Lights::Area, LightChoice::Power);
        prepared.bvh();
        Self { prepared: Arc::clone(prepared), lights, number_of_lights: scene.lights.len() as f32, bug }
    }

    fn scene(&self) -> &Scene {
        &self.prepared.scene
    }

    fn camera_ray(&self, draw: &Draw) -> Ray {
        let (film, camera) = (&self.scene().film, &self.scene().camera);
        let [width, _] = film.crop_size;
        let words = draw.words(group(0, Decision::Direction));
        let offset = film.filter.sample([unit_f32(words[0]), unit_f32(words[1])]);
        let x = (draw.pixel % width) as f32 + 0.5 + offset.x;
        let y = (draw.pixel / width) as f32 + 0.5 + offset.y;
        let direction =
            camera.corner + camera.across * (x / film.size[0] as f32) + camera.down * (y / film.size[1] as f32);
        Ray::new(camera.origin, direction, f32::INFINITY)
    }

    fn sample(&self, draw: &Draw) -> Rgb {
        let (scene, bvh): (&Scene, &Bvh) = (self.scene(), self.prepared.bvh());
        let (mut ray, mut beta, mut radiance) = (self.camera_ray(draw), Rgb::ONE, Rgb::ZERO);
        let mut last: Option<(f32, Vec3)> = None;
        for depth in 1..=scene.depth.max.unwrap_or(u32::MAX) {
            let Some(hit) = bvh.closest(&ray) else { break };
            let (at, wo) = (scene.surface_point(&ray, &hit), -ray.direction.normalize());
            let light = emitted(scene, &at, wo);
            if light != Rgb::ZERO {
                let weight = last.map_or(1.0, |(pdf, from)| {
                    let pdf_light = self.lights.pdf(scene, from, -wo, &at, hit.primitive);
                    let heuristic = if self.bug == Bug::MisWeights { Heuristic::Balance } else { Heuristic::Power };
                    heuristic.weight(pdf, pdf_light)
                });
                radiance += beta * light * weight;
            }
            let shape = &scene.shapes[at.shape as usize];
            let side = at.ns.dot(wo);
            if depth == scene.depth.max.unwrap_or(u32::MAX) || side == 0.0 {
                break;
            }
            let material = scene.materials[if side > 0.0 { shape.front } else { shape.back } as usize];
            let Some(material) = material.plain() else { break };
            let frame = Frame::new(at.ns * 1f32.copysign(side));
            let wo = frame.to_local(wo);
            // Light sampling.
            let words = draw.words(group(depth, Decision::Light));
            if let Some(light) = self.lights.sample(scene, at.p, words) {
                let wi = frame.to_local(light.wi);
                let evaluated = material.eval(&[], Directions::Bsdf, wo, wi);
                let mut f = evaluated.value;
                if self.bug == Bug::MissingCosine && f != Rgb::ZERO {
                    f /= wi.z;
                }
                let pdf = match self.bug {
                    Bug::PdfOff => 1.02 * light.pdf,
                    Bug::LightProbability => light.pdf / light.choice_pdf / self.number_of_lights,
                    _ => light.pdf,
                };
                let shadow = match light.to {
                    LightTarget::Point(to) => segment(&at, to),
                    LightTarget::Direction => leave(&at, light.wi),
                };
                if f != Rgb::ZERO && !bvh.occluded(&shadow) {
                    let weight = Heuristic::Power.weight(light.pdf, evaluated.pdf);
                    let found = beta * f * light.emitted * (weight / pdf);
                    radiance += match self.bug {
                        // As where a cosine is cut to 0 and a weight divides by it.
                        Bug::Nan if words[0] < u32::MAX / 50 => Rgb::NAN,
                        Bug::NanDropped if words[0] < u32::MAX / 50 => Rgb::ZERO,
                        _ => found,
                    };
                }
            }
            // The next direction.
            let words = draw.words(group(depth, Decision::Direction));
            let Some(Scattered { wi, pdf, value, .. }) = material.sample(&[], Directions::Bsdf, wo, words) else {
                break;
            };
            beta *= value / pdf;
            let direction = frame.to_world(wi);
            ray = leave(&at, direction);
            last = Some((pdf, at.p));
            if depth >= scene.depth.roulette {
                let survival = beta.max_element().min(0.95);
                if unit_f32(words[3]) >= survival {
                    break;
                }
                if self.bug != Bug::Roulette {
                    beta /= survival;
                }
            }
            if beta == Rgb::ZERO {
                break;
            }
        }
        if self.bug == Bug::Clamp { radiance.min(Rgb::splat(10.0)) } else { radiance }
    }
}

impl Estimator for Renderer {
    fn shape(&self) -> Shape {
        let [width, height] = self.scene().film.crop_size;
        Shape { width: width as usize, height: height as usize, channels: 3 }
    }

    fn identity(&self) -> String {
        format!("renderer with {:?} on {}", self.bug, self.prepared.hash)
    }

    fn dependence(&self) -> Dependence {
        Dependence::Independent
    }

    fn estimate(&self, cell: &Cell, n: u64, previous: &mut Option<Estimate>) -> rootn::Result<Estimate> {
        Ok(estimate_by_samples(self.shape(), Sequence::Independent, cell, n, previous, |draw, out| {
            let value = self.sample(draw);
            out.copy_from_slice(&[value.x, value.y, value.z].map(f64::from));
        }))
    }
}
