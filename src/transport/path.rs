//! Unidirectional path tracing over any strategy.
//!
//! Veach 1997, §9.3 and §10.2; depth counts edges (Mitsuba's convention: 1 = emission only). Point lights are reached by
//! light sampling alone, with weight 1; emission seen directly counts in full.

use super::sink::{Bounce, Contribution, Sink, Vertex, Via};
use crate::accel::bvh::Bvh;
use crate::accel::simd::Simd;
use crate::accel::{Endpoint, Hit, Ray, SurfacePoint, leave, segment};
use crate::math::{Frame, Rgb, Vec3};
use crate::sampling::Draw;
use crate::sampling::dimension::{Decision, group};
use crate::sampling::rng::unit_f32;
use crate::sampling::strategy::{Heuristic, Lights, NoRoulette, Roulette, Strategy, Technique};
use crate::scene::light::{LightPoint, LightSample, LightSampler, LightTarget, emitted, environment};
use crate::scene::{Material, Scene};

/// A strategy made ready for one scene.
pub struct PathTracer<'a> {
    scene: &'a Scene,
    bvh: &'a Bvh,
    lights: &'a LightSampler,
    strategy: Strategy,
    /// Longest path in edges.
    max_depth: u32,
    /// Depth from which roulette may end a path; `u32::MAX` = never.
    roulette_depth: u32,
    /// Radiance from outside the scene.
    environment: Rgb,
}

/// Largest probability of going on: even a white path must end some time.
const LARGEST_SURVIVAL: f32 = 0.95;

/// A vertex of the path, in its shading frame.
struct Shading<'a> {
    at: SurfacePoint,
    frame: Frame,
    /// Direction to where the path came from, local.
    wo: Vec3,
    material: &'a Material,
}

impl<'a> PathTracer<'a> {
    /// `lights` must be made for the scene and the strategy.
    pub fn new(scene: &'a Scene, bvh: &'a Bvh, lights: &'a LightSampler, strategy: Strategy) -> Self {
        let unbounded = scene.depth.max.unwrap_or(u32::MAX);
        Self {
            scene,
            bvh,
            lights,
            strategy,
            max_depth: match strategy.technique {
                Technique::Path => unbounded,
                Technique::Direct => unbounded.min(2),
            },
            roulette_depth: match strategy.roulette {
                None => scene.depth.roulette,
                Some(Roulette::Depth(n)) => n,
                Some(Roulette::Never(NoRoulette::None)) => u32::MAX,
            },
            environment: environment(scene),
        }
    }

    /// The ray through a film position drawn from the pixel filter.
    #[inline(always)]
    fn camera_ray(&self, draw: &Draw) -> Ray {
        let film = &self.scene.film;
        let camera = &self.scene.camera;
        let [width, _] = film.crop_size;
        let words = draw.words(group(0, Decision::Direction));
        let offset = film.filter.sample([unit_f32(words[0]), unit_f32(words[1])]);
        let x = (film.crop_offset[0] + draw.pixel % width) as f32 + 0.5 + offset.x;
        let y = (film.crop_offset[1] + draw.pixel / width) as f32 + 0.5 + offset.y;
        let (s, t) = (x / film.size[0] as f32, y / film.size[1] as f32);
        let direction = camera.corner + camera.across * s + camera.down * t;
        Ray::new(camera.origin + direction * camera.near, direction, camera.far - camera.near)
    }

    /// One sample of the radiance that reaches a pixel.
    #[inline(always)]
    pub fn sample<V: Simd, S: Sink>(&self, simd: V, draw: &Draw, sink: &mut S) -> Rgb {
        let mut ray = self.camera_ray(draw);
        let mut total = Rgb::ZERO;
        let mut beta = Rgb::ONE;
        // Density and origin of the last drawn direction; none at the camera, where emission counts in full.
        let mut last: Option<(f32, Vec3)> = None;
        let mut depth = 1;
        loop {
            let Some(hit) = self.bvh.closest_with(simd, &ray) else {
                total += self.escape(depth, ray.direction, beta, last, sink);
                return total;
            };
            let at = self.bvh.surface_point(self.scene, &ray, &hit);
            let wo = -ray.direction.normalize();
            total += self.emission(depth, &at, &hit, wo, beta, last, sink);
            if depth >= self.max_depth {
                return total;
            }
            sink.vertex(&Vertex { depth, position: at.p, normal: at.ng, shape: at.shape, beta });
            let Some(shading) = self.shading(at, wo) else { return total };
            total += self.light(simd, depth, &shading, beta, draw, sink);
            let Some((direction, pdf)) = self.bounce(depth, &shading, &mut beta, draw, sink) else { return total };
            last = Some((pdf, shading.at.p));
            ray = leave(&shading.at, direction);
            depth += 1;
        }
    }

    /// The shading frame on the side of `wo`; `None` on black surfaces and at grazing incidence.
    #[inline(always)]
    fn shading(&self, at: SurfacePoint, wo: Vec3) -> Option<Shading<'a>> {
        let shape = &self.scene.shapes[at.shape as usize];
        let cos = at.ns.dot(wo);
        let (material, normal) = if cos > 0.0 { (shape.front, at.ns) } else { (shape.back, -at.ns) };
        let material = &self.scene.materials[material as usize];
        if *material == Material::Black || cos == 0.0 {
            return None;
        }
        let frame = Frame::new(normal);
        Some(Shading { at, frame, wo: frame.to_local(wo), material })
    }

    /// The weight of a light that was met by drawing a direction.
    #[inline(always)]
    fn weight_of_direction(&self, pdf_direction: f32, pdf_light: f32) -> f32 {
        match self.strategy.heuristic {
            Heuristic::None => f32::from(u8::from(pdf_light <= 0.0)),
            heuristic => heuristic.weight(pdf_direction, pdf_light),
        }
    }

    #[inline(always)]
    fn emission<S: Sink>(
        &self,
        depth: u32,
        at: &SurfacePoint,
        hit: &Hit,
        wo: Vec3,
        beta: Rgb,
        last: Option<(f32, Vec3)>,
        sink: &mut S,
    ) -> Rgb {
        let Some(light) = self.scene.shapes[at.shape as usize].light else { return Rgb::ZERO };
        let radiance = emitted(self.scene, at, wo);
        if radiance == Rgb::ZERO {
            return Rgb::ZERO;
        }
        let (pdf_direction, pdf_light, weight) = match last {
            None => (0.0, 0.0, 1.0),
            Some((pdf, _)) if self.strategy.lights == Lights::None => (pdf, 0.0, 1.0),
            Some((pdf, from)) => {
                let pdf_light = self.lights.pdf(self.scene, from, -wo, at, hit.primitive);
                (pdf, pdf_light, self.weight_of_direction(pdf, pdf_light))
            }
        };
        let value = beta * radiance * weight;
        sink.contribution(&Contribution {
            depth,
            via: Via::Emission,
            light: Some(light),
            pdf_direction,
            pdf_light,
            weight,
            value,
        });
        value
    }

    #[inline(always)]
    fn escape<S: Sink>(&self, depth: u32, direction: Vec3, beta: Rgb, last: Option<(f32, Vec3)>, sink: &mut S) -> Rgb {
        if self.environment == Rgb::ZERO {
            return Rgb::ZERO;
        }
        let (pdf_direction, pdf_light, weight) = match last {
            None => (0.0, 0.0, 1.0),
            Some((pdf, _)) => {
                let pdf_light = self.lights.pdf_environment(direction);
                (pdf, pdf_light, self.weight_of_direction(pdf, pdf_light))
            }
        };
        let value = beta * self.environment * weight;
        sink.contribution(&Contribution {
            depth,
            via: Via::Emission,
            light: None,
            pdf_direction,
            pdf_light,
            weight,
            value,
        });
        value
    }

    /// Next-event estimation: a point on a light, if nothing is in between.
    #[inline(always)]
    fn light<V: Simd, S: Sink>(
        &self,
        simd: V,
        depth: u32,
        shading: &Shading<'_>,
        beta: Rgb,
        draw: &Draw,
        sink: &mut S,
    ) -> Rgb {
        if self.lights.is_empty() {
            return Rgb::ZERO;
        }
        let words = draw.words(group(depth, Decision::Light));
        let Some(sample) = self.lights.sample(self.scene, shading.at.p, words) else { return Rgb::ZERO };
        let wi = shading.frame.to_local(sample.wi);
        let f = shading.material.eval(shading.wo, wi);
        if f == Rgb::ZERO || self.bvh.occluded_with(simd, &shadow_ray(&shading.at, &sample)) {
            return Rgb::ZERO;
        }
        let (pdf_direction, weight) = match self.strategy.heuristic {
            _ if sample.delta => (0.0, 1.0),
            Heuristic::None => (0.0, 1.0),
            heuristic => {
                let pdf = shading.material.pdf(self.strategy.directions, shading.wo, wi);
                (pdf, heuristic.weight(sample.pdf, pdf))
            }
        };
        let value = beta * f * sample.emitted * (weight / sample.pdf);
        sink.contribution(&Contribution {
            depth: depth + 1,
            via: Via::LightSampling,
            light: matches!(sample.to, LightTarget::Point(_)).then_some(sample.light),
            pdf_direction,
            pdf_light: sample.pdf,
            weight,
            value,
        });
        value
    }

    /// Draws the next direction and plays roulette; `None` ends the path.
    #[inline(always)]
    fn bounce<S: Sink>(
        &self,
        depth: u32,
        shading: &Shading<'_>,
        beta: &mut Rgb,
        draw: &Draw,
        sink: &mut S,
    ) -> Option<(Vec3, f32)> {
        let words = draw.words(group(depth, Decision::Direction));
        let (wi, pdf) = shading.material.sample(self.strategy.directions, shading.wo, words)?;
        *beta *= shading.material.eval(shading.wo, wi) / pdf;
        if *beta == Rgb::ZERO {
            return None;
        }
        let mut survival = 1.0;
        if depth >= self.roulette_depth {
            survival = beta.max_element().min(LARGEST_SURVIVAL);
            if unit_f32(words[3]) >= survival {
                return None;
            }
            *beta /= survival;
        }
        let direction = shading.frame.to_world(wi);
        sink.bounce(&Bounce { depth, direction, pdf, survival, beta: *beta });
        Some((direction, pdf))
    }
}

#[inline(always)]
fn shadow_ray(at: &SurfacePoint, sample: &LightSample) -> Ray {
    match sample.to {
        LightTarget::Direction => leave(at, sample.wi),
        LightTarget::Point(LightPoint { p, p_error, ng, triangle }) => segment(at, Endpoint { p, p_error, ng, triangle }),
    }
}
