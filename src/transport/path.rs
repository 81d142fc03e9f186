//! Unidirectional path tracing over any strategy.
//!
//! Veach 1997, §9.3 and §10.2; depth counts edges (Mitsuba's convention: 1 = emission only). Point, spot and directional lights are
//! reached by light sampling alone, with weight 1; emission seen directly counts in full.

use super::shading::shade;
use super::sink::{AnySink, Bounce, Contribution, Sink, Vertex, Via};
use super::wave::{Paths, Vertices, Wave};
use crate::accel::bvh::Bvh;
use crate::accel::simd::{Portable, Registers};
use crate::accel::{Rays, SurfacePoint, leave, segment};
use crate::math::lanes::{bits, lane_of, set_bits};
use crate::math::{Frame, LANES, Rgb, Vec3, Vec3Lanes};
use crate::sampling::Draw;
use crate::sampling::dimension::{Decision, group};
use crate::sampling::rng::unit_f32;
use crate::sampling::strategy::{Heuristic, Lights, NoRoulette, Roulette, Strategy, Technique};
use crate::scene::light::{LightSampler, LightSamples, emitted, environment};
use crate::scene::material::Evaluated;
use crate::scene::{Bsdf, Effects, Material, Projection, Scene};
use std::ops::Range;

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
    /// Radiance from outside the scene, if it is constant.
    environment: Rgb,
    /// Whether all materials are known to be diffuse or black.
    diffuse: bool,
    /// The BSDFs of materials that are known to be the same everywhere.
    plain: Vec<Option<Bsdf>>,
}

/// Largest probability of going on: even a white path must end some time. Each bounce that it limits divides the weight by it,
/// so in closed surroundings of albedo ρ the variance is finite only for ρ² < this: 0.95, as in other renderers, is too small.
const LARGEST_SURVIVAL: f32 = 0.999;

/// Longest path in edges, and the depth from which roulette may end a path; `u32::MAX` = never.
pub fn depths(scene: &Scene, strategy: &Strategy) -> (u32, u32) {
    let unbounded = scene.depth.max.unwrap_or(u32::MAX);
    let max = match strategy.technique {
        Technique::Path => unbounded,
        Technique::Direct => unbounded.min(2),
    };
    let roulette = match strategy.roulette {
        None => scene.depth.roulette,
        Some(Roulette::Depth(n)) => n,
        Some(Roulette::Never(NoRoulette::None)) => u32::MAX,
    };
    (max, roulette)
}

impl<'a> PathTracer<'a> {
    /// `lights` must be made for the scene and the strategy.
    pub fn new(scene: &'a Scene, bvh: &'a Bvh, lights: &'a LightSampler, strategy: Strategy) -> Self {
        let (max_depth, roulette_depth) = depths(scene, &strategy);
        let diffuse = Effects::of_materials(scene).are_diffuse();
        let plain = scene.materials.iter().map(Material::plain).collect();
        Self {
            scene,
            bvh,
            lights,
            strategy,
            max_depth,
            roulette_depth,
            environment: environment(scene),
            diffuse,
            plain,
        }
    }

    /// Leaves nothing out: every material may be of any kind and vary over the surface. The samples are the same.
    #[must_use]
    pub fn with_all_effects(mut self) -> Self {
        self.diffuse = false;
        self.plain.fill(None);
        self
    }

    /// One sample of the radiance that reaches a pixel.
    pub fn sample(&self, draw: &Draw, sink: &mut dyn Sink) -> Rgb {
        let mut radiance = [Rgb::ZERO];
        self.portable_wave(draw, draw.pixel..draw.pixel + 1, draw.sample..draw.sample + 1, sink, &mut radiance);
        radiance[0]
    }

    /// [`Self::wave`] for any processor and sink.
    #[inline(never)]
    pub fn portable_wave(
        &self,
        draw: &Draw,
        pixels: Range<u32>,
        samples: Range<u64>,
        sink: &mut dyn Sink,
        radiance: &mut [Rgb],
    ) {
        self.wave(Portable, draw, pixels, samples, &mut AnySink(sink), radiance);
    }

    /// Samples of the radiance that reaches pixels, whatever `draw.pixel` and `draw.sample` are; pixel by pixel, at most
    /// [`super::WAVE`] in all. They advance together, edge by edge, but no sample depends on the others.
    ///
    /// # Panics
    /// Where there are more, and where `radiance` is shorter.
    #[inline(always)]
    pub fn wave<V: Registers, S: Sink>(
        &self,
        simd: V,
        draw: &Draw,
        pixels: Range<u32>,
        samples: Range<u64>,
        sink: &mut S,
        radiance: &mut [Rgb],
    ) {
        if self.max_depth == 0 {
            radiance.fill(Rgb::ZERO);
            return;
        }
        match self.diffuse {
            true => self.trace::<V, S, true>(simd, draw, Wave::new(pixels, samples), sink, radiance),
            false => self.trace::<V, S, false>(simd, draw, Wave::new(pixels, samples), sink, radiance),
        }
    }

    #[inline(always)]
    fn trace<V: Registers, S: Sink, const DIFFUSE: bool>(
        &self,
        simd: V,
        draw: &Draw,
        mut wave: Wave,
        sink: &mut S,
        radiance: &mut [Rgb],
    ) {
        for paths in wave.packets() {
            self.start(draw, paths);
        }
        let mut depth = 1;
        while !wave.is_empty() {
            for paths in wave.packets() {
                self.advance::<V, S, DIFFUSE>(simd, depth, draw, paths, sink);
            }
            wave.retire(radiance);
            depth += 1;
        }
    }

    /// Camera rays.
    #[inline(always)]
    fn start(&self, draw: &Draw, paths: &mut Paths) {
        let words = draw.words_lanes(&paths.pixel, &paths.sample, group(0, Decision::Direction));
        let camera = &self.scene.camera;
        let lens = match camera.projection {
            Projection::ThinLens { .. } => draw.words_lanes(&paths.pixel, &paths.sample, group(0, Decision::Lens)),
            _ => [[0; LANES]; 4],
        };
        let square = |words: &[[u32; LANES]; 4], lane: usize| [unit_f32(words[0][lane]), unit_f32(words[1][lane])];
        for lane in 0..LANES {
            let film = self.scene.film.sample(paths.pixel[lane], square(&words, lane));
            let ray = camera.ray(film, square(&lens, lane));
            paths.ray.set(lane, ray);
            paths.wo.set(lane, -ray.direction.normalize());
            paths.beta.set(lane, Rgb::ONE);
        }
    }

    /// The next edge of a packet: what it meets, the light that is scattered there, and where it goes on.
    #[inline(always)]
    fn advance<V: Registers, S: Sink, const DIFFUSE: bool>(
        &self,
        simd: V,
        depth: u32,
        draw: &Draw,
        paths: &mut Paths,
        sink: &mut S,
    ) {
        let mut vertices = Vertices::<DIFFUSE>::NONE;
        self.meet(simd, depth, draw, paths, &mut vertices, sink);
        if paths.live == 0 {
            return;
        }
        self.light(simd, depth, &vertices, paths, draw, sink);
        self.bounce(depth, &vertices, paths, draw, sink);
    }

    /// Traces the rays and adds the emission that they meet. Paths end that escape, reach the last depth or a black side.
    #[inline(always)]
    fn meet<V: Registers, S: Sink, const DIFFUSE: bool>(
        &self,
        simd: V,
        depth: u32,
        draw: &Draw,
        paths: &mut Paths,
        vertices: &mut Vertices<DIFFUSE>,
        sink: &mut S,
    ) {
        let hits = self.bvh.closest_lanes(simd, &paths.ray, paths.live);
        // Density and origin of the last drawn direction; none where emission counts in full.
        let last =
            |paths: &Paths, lane: usize| (paths.delta >> lane & 1 == 0).then(|| (paths.pdf[lane], paths.p.get(lane)));
        for lane in set_bits(paths.live & !hits.lanes()) {
            let (direction, beta) = (paths.ray.direction.get(lane), paths.beta.get(lane));
            paths.add(lane, self.escape(depth, direction, beta, last(paths, lane), sink));
        }
        paths.live &= hits.lanes();
        let at = &mut vertices.at;
        self.bvh.surface_points(simd, self.scene, &paths.ray, &hits, paths.live, at);
        for lane in set_bits(paths.live & at.lights) {
            let (wo, beta) = (paths.wo.get(lane), paths.beta.get(lane));
            paths.add(lane, self.emission(depth, &at.get(lane), wo, beta, last(paths, lane), sink));
        }
        if depth >= self.max_depth {
            paths.live = 0;
        }
        if paths.live == 0 {
            return;
        }
        let (mut material, mut grazing) = ([0; LANES], [0; LANES]);
        for lane in 0..LANES {
            let ns = at.ns.get(lane);
            let cos = ns.dot(paths.wo.get(lane));
            vertices.normal.set(lane, ns * 1f32.copysign(cos));
            material[lane] = if cos > 0.0 { at.front[lane] } else { at.back[lane] };
            grazing[lane] = u32::from(cos == 0.0);
        }
        for lane in set_bits(paths.live) {
            let (position, normal) = (at.end.p.get(lane), at.end.ng.get(lane));
            sink.vertex(&Vertex { depth, position, normal, shape: at.shape[lane], beta: paths.beta.get(lane) });
            let normal = vertices.normal.get(lane);
            let (bsdf, frame, bent) = match (self.plain[material[lane] as usize], hits.get(lane)) {
                (None, Some(hit)) => {
                    let draw = Draw { pixel: paths.pixel[lane], sample: paths.sample[lane], ..*draw };
                    let words = draw.words(group(depth, Decision::Layer));
                    shade(self.scene, material[lane], (&hit, &at.get(lane)), [normal, paths.wo.get(lane)], words)
                }
                (plain, _) => (plain.unwrap_or(Bsdf::Black), Frame::new(normal), None),
            };
            match bsdf {
                Bsdf::Black => paths.end(lane),
                Bsdf::Diffuse { reflectance } if DIFFUSE => vertices.reflectance.set(lane, reflectance),
                _ => (vertices.bsdf[lane], vertices.frame[lane], vertices.bent[lane]) = (bsdf, frame, bent),
            }
        }
        paths.live &= !bits(&grazing);
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
        let pdf_light = match last {
            Some((_, from)) if self.strategy.lights != Lights::None => {
                self.lights.pdf(self.scene, from, -wo, at, at.triangle)
            }
            _ => 0.0,
        };
        self.met(depth, Some(light), beta * radiance, last.map(|l| l.0), pdf_light, sink)
    }

    #[inline(always)]
    fn escape<S: Sink>(&self, depth: u32, direction: Vec3, beta: Rgb, last: Option<(f32, Vec3)>, sink: &mut S) -> Rgb {
        let (radiance, pdf_light) = self.lights.escape(self.scene, self.environment, direction);
        if radiance == Rgb::ZERO {
            return Rgb::ZERO;
        }
        let pdf_light = last.map_or(0.0, |_| pdf_light);
        self.met(depth, None, beta * radiance, last.map(|l| l.0), pdf_light, sink)
    }

    /// Light that the path ran into by a direction of density `pdf_direction` (`None`: from the camera, where it counts in full).
    #[inline(always)]
    fn met<S: Sink>(
        &self,
        depth: u32,
        light: Option<u32>,
        carried: Rgb,
        pdf_direction: Option<f32>,
        pdf_light: f32,
        sink: &mut S,
    ) -> Rgb {
        let weight = pdf_direction.map_or(1.0, |pdf| self.weight_of_direction(pdf, pdf_light));
        let (pdf_direction, value) = (pdf_direction.unwrap_or(0.0), carried * weight);
        sink.contribution(&Contribution { depth, via: Via::Emission, light, pdf_direction, pdf_light, weight, value });
        value
    }

    /// Next-event estimation: a point on a light, if nothing is in between.
    #[inline(always)]
    fn light<V: Registers, S: Sink, const DIFFUSE: bool>(
        &self,
        simd: V,
        depth: u32,
        vertices: &Vertices<DIFFUSE>,
        paths: &mut Paths,
        draw: &Draw,
        sink: &mut S,
    ) {
        if self.lights.is_empty() {
            return;
        }
        let words = draw.words_lanes(&paths.pixel, &paths.sample, group(depth, Decision::Light));
        let mut light = LightSamples::NONE;
        self.lights.sample_lanes(self.scene, &vertices.at.end.p, &words, paths.live, &mut light);
        let (mut scattered, mut pdf_direction) = (Vec3Lanes::ZERO, [0.0; LANES]);
        let (mut shadow, mut dark) = (Rays::ZERO, [0; LANES]);
        let (tables, directions) = (&self.scene.transmittances, self.strategy.directions);
        for lane in 0..LANES {
            let Evaluated { value: f, pdf } =
                vertices.eval(lane, tables, directions, paths.wo.get(lane), light.wi.get(lane));
            dark[lane] = u32::from(f == Rgb::ZERO);
            scattered.set(lane, f);
            let only_light = light.delta[lane] || self.strategy.heuristic == Heuristic::None;
            pdf_direction[lane] = if only_light { 0.0 } else { pdf };
        }
        for lane in 0..LANES {
            shadow.set(lane, segment(vertices.at.end.get(lane), light.to.get(lane)));
        }
        for lane in set_bits(light.directions) {
            shadow.set(lane, leave(vertices.at.end.get(lane), light.wi.get(lane)));
        }
        let lit = light.lanes & !bits(&dark);
        let lit = lit & !self.bvh.occluded_lanes(simd, &shadow, lit);
        let weight = self.strategy.heuristic.weights(&light.pdf, &pdf_direction);
        let mut value = Vec3Lanes::ZERO;
        for lane in 0..LANES {
            let scale = weight[lane] / light.pdf[lane];
            let all = paths.beta.get(lane) * scattered.get(lane) * light.emitted.get(lane) * scale;
            value.set(lane, if lit >> lane & 1 == 1 { all } else { Rgb::ZERO });
            paths.add(lane, value.get(lane));
        }
        for lane in set_bits(lit) {
            sink.contribution(&Contribution {
                depth: depth + 1,
                via: Via::LightSampling,
                light: (light.directions >> lane & 1 == 0 || light.delta[lane]).then_some(light.light[lane]),
                pdf_direction: pdf_direction[lane],
                pdf_light: light.pdf[lane],
                weight: weight[lane],
                value: value.get(lane),
            });
        }
    }

    /// Draws the next directions and plays roulette.
    #[inline(always)]
    fn bounce<S: Sink, const DIFFUSE: bool>(
        &self,
        depth: u32,
        vertices: &Vertices<DIFFUSE>,
        paths: &mut Paths,
        draw: &Draw,
        sink: &mut S,
    ) {
        let words = draw.words_lanes(&paths.pixel, &paths.sample, group(depth, Decision::Direction));
        let (mut wi, mut pdf) = (Vec3Lanes::ZERO, [0.0; LANES]);
        let (mut value, mut delta) = (Vec3Lanes::ZERO, [0; LANES]);
        let (tables, directions) = (&self.scene.transmittances, self.strategy.directions);
        for lane in 0..LANES {
            let sample = vertices.sample(lane, tables, directions, paths.wo.get(lane), lane_of(&words, lane));
            wi.set(lane, sample.map_or(Vec3::Z, |s| s.wi));
            pdf[lane] = sample.map_or(0.0, |s| s.pdf);
            value.set(lane, sample.map_or(Rgb::ZERO, |s| s.value));
            if !DIFFUSE && let Some(s) = sample {
                delta[lane] = u32::from(s.delta);
                paths.eta2[lane] *= s.eta * s.eta;
            }
        }
        let mut absorbed = [0; LANES];
        for lane in 0..LANES {
            let beta = paths.beta.get(lane) * (value.get(lane) / pdf[lane]);
            absorbed[lane] = u32::from((pdf[lane] == 0.0) | (beta == Rgb::ZERO));
            paths.beta.set(lane, beta);
            paths.wo.set(lane, -vertices.to_world(lane, wi.get(lane)));
        }
        paths.pdf = pdf;
        paths.delta = bits(&delta);
        paths.p = vertices.at.end.p;
        for lane in 0..LANES {
            let direction = -paths.wo.get(lane);
            paths.ray.set(lane, leave(vertices.at.end.get(lane), direction));
        }
        paths.live &= !bits(&absorbed);
        let mut survival = [1.0; LANES];
        if depth >= self.roulette_depth {
            for lane in 0..LANES {
                let beta = paths.beta.get(lane);
                // Radiance is smaller where light is slower, but carries no less.
                let eta2 = if DIFFUSE { 1.0 } else { paths.eta2[lane] };
                survival[lane] = (beta.max_element() * eta2).min(LARGEST_SURVIVAL);
                absorbed[lane] = u32::from(unit_f32(words[3][lane]) >= survival[lane]);
                paths.beta.set(lane, beta / survival[lane]);
            }
            paths.live &= !bits(&absorbed);
        }
        for lane in set_bits(paths.live) {
            sink.bounce(&Bounce {
                depth,
                direction: paths.ray.direction.get(lane),
                pdf: paths.pdf[lane],
                survival: survival[lane],
                beta: paths.beta.get(lane),
            });
        }
    }
}
