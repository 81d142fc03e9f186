//! Light samples for a packet of points at once.

use super::area::{Emitter, Patch};
use super::choice::{Entry, Kind};
use super::{LightSample, LightSampler, LightTarget};
use crate::accel::EndpointLanes;
use crate::math::density::{Area, Discrete as Pmf};
use crate::math::lanes::{bits, lane_of, set_bits};
use crate::math::{LANES, Vec3Lanes};
use crate::sampling::rng::unit_f32;
use crate::scene::Scene;

/// Light samples of a packet: see [`LightSample`].
#[derive(Clone, Copy, Debug)]
pub struct LightSamples {
    /// Bit i: lane i holds a sample.
    pub lanes: u32,
    /// Those of them that have no end point.
    pub directions: u32,
    /// Those of them that no other technique can meet.
    pub delta: [bool; LANES],
    /// Points on the lights: the other ends of the shadow rays.
    pub to: EndpointLanes,
    /// Unit vectors to them.
    pub wi: Vec3Lanes,
    /// See [`LightSample::emitted`].
    pub emitted: Vec3Lanes,
    /// See [`LightSample::pdf`].
    pub pdf: [f32; LANES],
    /// See [`LightSample::light`].
    pub light: [u32; LANES],
}

impl LightSamples {
    /// No samples.
    pub const NONE: Self = {
        let zero = Vec3Lanes::ZERO;
        Self {
            lanes: 0,
            directions: 0,
            delta: [false; LANES],
            to: EndpointLanes::ZERO,
            wi: zero,
            emitted: zero,
            pdf: [0.0; LANES],
            light: [0; LANES],
        }
    };

    #[inline(always)]
    fn set(&mut self, lane: usize, sample: &LightSample) {
        self.lanes |= 1 << lane;
        match sample.to {
            LightTarget::Direction => self.directions |= 1 << lane,
            LightTarget::Point(at) => self.to.set(lane, at),
        }
        self.delta[lane] = sample.delta;
        self.wi.set(lane, sample.wi);
        self.emitted.set(lane, sample.emitted);
        self.pdf[lane] = sample.pdf;
        self.light[lane] = sample.light;
    }
}

/// The parallelograms that the points of a packet look at.
struct Patches {
    corner: Vec3Lanes,
    u: Vec3Lanes,
    v: Vec3Lanes,
    ng: Vec3Lanes,
    density: [f32; LANES],
    start: [u32; LANES],
}

impl Patches {
    const ZERO: Self = {
        let zero = Vec3Lanes::ZERO;
        Self { corner: zero, u: zero, v: zero, ng: zero, density: [0.0; LANES], start: [0; LANES] }
    };

    #[inline(always)]
    fn splat(patch: &Patch) -> Self {
        Self {
            corner: Vec3Lanes::splat(patch.corner),
            u: Vec3Lanes::splat(patch.u),
            v: Vec3Lanes::splat(patch.v),
            ng: Vec3Lanes::splat(patch.ng),
            density: [patch.density.0; LANES],
            start: [patch.start; LANES],
        }
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, patch: &Patch) {
        self.corner.set(lane, patch.corner);
        self.u.set(lane, patch.u);
        self.v.set(lane, patch.v);
        self.ng.set(lane, patch.ng);
        self.density[lane] = patch.density.0;
        self.start[lane] = patch.start;
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> Patch {
        Patch {
            corner: self.corner.get(lane),
            u: self.u.get(lane),
            v: self.v.get(lane),
            ng: self.ng.get(lane),
            density: Area(self.density[lane]),
            start: self.start[lane],
        }
    }
}

impl LightSampler {
    /// [`Self::sample`] for the points whose bit is set in `live`, with the same bits, into empty `samples`; `[word][lane]`.
    #[inline(always)]
    pub fn sample_lanes(
        &self,
        scene: &Scene,
        p: &Vec3Lanes,
        words: &[[u32; LANES]; 4],
        live: u32,
        samples: &mut LightSamples,
    ) {
        if self.entries.is_empty() {
            return;
        }
        if self.patches_alone {
            return self.sample_patches(p, words, live, samples);
        }
        for lane in set_bits(live) {
            if let Some(sample) = self.sample(scene, p.get(lane), lane_of(words, lane)) {
                samples.set(lane, &sample);
            }
        }
    }

    /// All lights are parallelograms sampled by area: what differs is looked up first, then all lanes run the same code.
    #[inline(always)]
    fn sample_patches(&self, p: &Vec3Lanes, words: &[[u32; LANES]; 4], live: u32, samples: &mut LightSamples) {
        let mut patches = Patches::ZERO;
        let mut choice_pdf = [1.0; LANES];
        if let [Entry { light, radiance, kind: Kind::Area(Emitter::Parallelogram(e)) }] = &self.entries[..] {
            // No choice: the same for all lanes.
            patches = Patches::splat(&e.patch);
            samples.emitted = Vec3Lanes::splat(*radiance);
            samples.light = [*light; LANES];
        } else {
            for lane in set_bits(live) {
                let index = self.choice.pick(words[2][lane]);
                let Entry { light, radiance, kind } = &self.entries[index];
                if let Kind::Area(Emitter::Parallelogram(e)) = kind {
                    patches.set(lane, &e.patch);
                }
                choice_pdf[lane] = self.choice.pmf(index);
                samples.emitted.set(lane, *radiance);
                samples.light[lane] = *light;
            }
        }
        let mut hidden = [0; LANES];
        for lane in 0..LANES {
            let u = [unit_f32(words[0][lane]), unit_f32(words[1][lane])];
            let (at, wi, density) = patches.get(lane).sample(p.get(lane), u);
            samples.to.set(lane, at);
            samples.wi.set(lane, wi);
            samples.pdf[lane] = (density * Pmf(choice_pdf[lane])).0;
            hidden[lane] = u32::from(samples.pdf[lane] == 0.0);
        }
        samples.lanes = live & !bits(&hidden);
    }
}
