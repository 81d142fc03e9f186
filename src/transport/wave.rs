//! Paths side by side: samples of a pixel, or of several, that advance together, in packets of lanes. What lanes without a live
//! path hold is computed along and never kept.

use crate::accel::{Rays, SurfaceLanes};
use crate::math::lanes::set_bits;
use crate::math::{Frame, LANES, Rgb, Vec3, Vec3Lanes};
use crate::moments::BATCH;
use crate::sampling::strategy::Directions;
use crate::scene::Bsdf;
use crate::scene::material::{Bent, Evaluated, Scattered, Transmittance};
use std::ops::Range;

/// All lanes.
const ALL: u32 = (1 << LANES) - 1;

/// Most samples of a wave.
pub const WAVE: usize = BATCH as usize;

/// Paths between two vertices.
#[derive(Clone, Copy)]
pub(super) struct Paths {
    /// Bit i: lane i holds a path that goes on.
    pub(super) live: u32,
    /// Which pixel and sample a lane traces.
    pub(super) pixel: [u32; LANES],
    pub(super) sample: [u64; LANES],
    /// Where its radiance is put in the end.
    slot: [u32; LANES],
    pub(super) ray: Rays,
    /// Unit vector against the ray.
    pub(super) wo: Vec3Lanes,
    /// Throughput.
    pub(super) beta: Vec3Lanes,
    /// Radiance so far.
    pub(super) radiance: Vec3Lanes,
    /// Where the ray's direction was drawn, and its density, sr⁻¹. Not for camera rays.
    pub(super) p: Vec3Lanes,
    pub(super) pdf: [f32; LANES],
    /// Bit i: no other technique draws the direction of lane i, from the camera or of a delta lobe.
    pub(super) delta: u32,
    /// Squared index of refraction where the path is, over that at the camera.
    pub(super) eta2: [f32; LANES],
}

impl Paths {
    const NONE: Self = Self {
        live: 0,
        pixel: [0; LANES],
        sample: [0; LANES],
        slot: [0; LANES],
        ray: Rays::ZERO,
        wo: Vec3Lanes::ZERO,
        beta: Vec3Lanes::ZERO,
        radiance: Vec3Lanes::ZERO,
        p: Vec3Lanes::ZERO,
        pdf: [0.0; LANES],
        delta: ALL,
        eta2: [1.0; LANES],
    };

    #[inline(always)]
    pub(super) fn is_live(&self, lane: usize) -> bool {
        self.live >> lane & 1 == 1
    }

    /// The path goes no further.
    #[inline(always)]
    pub(super) fn end(&mut self, lane: usize) {
        self.live &= !(1 << lane);
    }

    #[inline(always)]
    pub(super) fn add(&mut self, lane: usize, value: Rgb) {
        self.radiance.set(lane, self.radiance.get(lane) + value);
    }
}

/// All paths of a wave, the live ones in front.
pub(super) struct Wave {
    packets: Vec<Paths>,
    /// Lanes in use.
    len: usize,
}

impl Wave {
    /// Puts the samples of each pixel in turn into the lanes.
    #[inline(always)]
    pub(super) fn new(pixels: Range<u32>, samples: Range<u64>) -> Self {
        let len = pixels.len() * (samples.end - samples.start) as usize;
        assert!(len <= WAVE, "{len} samples in a wave");
        let mut packets = vec![Paths::NONE; len.div_ceil(LANES)];
        let mut i = 0;
        for pixel in pixels {
            for sample in samples.clone() {
                let (paths, lane) = (&mut packets[i / LANES], i % LANES);
                paths.live |= 1 << lane;
                paths.pixel[lane] = pixel;
                paths.sample[lane] = sample;
                paths.slot[lane] = i as u32;
                i += 1;
            }
        }
        // Spare lanes repeat the last identity: seeds that a packet shares stay shared.
        while i % LANES != 0 {
            let (paths, lane) = (&mut packets[i / LANES], i % LANES);
            (paths.pixel[lane], paths.sample[lane]) = (paths.pixel[lane - 1], paths.sample[lane - 1]);
            i += 1;
        }
        Self { packets, len }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len == 0
    }

    #[inline(always)]
    pub(super) fn packets(&mut self) -> &mut [Paths] {
        &mut self.packets[..self.len.div_ceil(LANES)]
    }

    /// Hands out the radiance of ended paths and fills their lanes from the back.
    pub(super) fn retire(&mut self, radiance: &mut [Rgb]) {
        for packet in 0..self.len.div_ceil(LANES) {
            for lane in set_bits(!self.packets[packet].live & ALL) {
                let hole = packet * LANES + lane;
                self.drop_ended(hole, radiance);
                if hole >= self.len {
                    return;
                }
                self.hand_out(hole, radiance);
                self.len -= 1;
                self.move_lane(self.len, hole);
            }
        }
    }

    /// Ended paths at the back, as far as `first`, leave no hole.
    fn drop_ended(&mut self, first: usize, radiance: &mut [Rgb]) {
        while self.len > first && !self.packets[(self.len - 1) / LANES].is_live((self.len - 1) % LANES) {
            self.len -= 1;
            self.hand_out(self.len, radiance);
        }
    }

    fn hand_out(&self, i: usize, radiance: &mut [Rgb]) {
        let paths = &self.packets[i / LANES];
        radiance[paths.slot[i % LANES] as usize] = paths.radiance.get(i % LANES);
    }

    /// Puts the live path `from` where an ended one was.
    fn move_lane(&mut self, from: usize, to: usize) {
        let (f, other, t, lane) = (from / LANES, from % LANES, to / LANES, to % LANES);
        let p = &mut self.packets;
        p[t].pixel[lane] = p[f].pixel[other];
        p[t].sample[lane] = p[f].sample[other];
        p[t].slot[lane] = p[f].slot[other];
        p[t].pdf[lane] = p[f].pdf[other];
        p[t].eta2[lane] = p[f].eta2[other];
        p[t].delta = p[t].delta & !(1 << lane) | (p[f].delta >> other & 1) << lane;
        let Paths { ray, wo, beta, radiance, p: origin, .. } = &p[f];
        let (ray, wo, beta) = (ray.get(other), wo.get(other), beta.get(other));
        let (radiance, origin) = (radiance.get(other), origin.get(other));
        p[t].ray.set(lane, ray);
        p[t].wo.set(lane, wo);
        p[t].beta.set(lane, beta);
        p[t].radiance.set(lane, radiance);
        p[t].p.set(lane, origin);
        p[t].live |= 1 << lane;
        p[f].end(other);
    }
}

/// The surfaces that the paths of a packet have reached. `DIFFUSE`: all materials of the scene are diffuse or black, and no
/// branch on the kind keeps loops over lanes from becoming vector code.
pub(super) struct Vertices<const DIFFUSE: bool> {
    pub(super) at: SurfaceLanes,
    /// Shading normals on the side that the path came from.
    pub(super) normal: Vec3Lanes,
    /// Where all is diffuse; zero in lanes without a surface.
    pub(super) reflectance: Vec3Lanes,
    /// Where not; black in lanes without a surface. In the frames, z is the shading normal, bent by a relief.
    pub(super) bsdf: [Bsdf; LANES],
    pub(super) frame: [Frame; LANES],
    pub(super) bent: [Option<Bent>; LANES],
}

impl<const DIFFUSE: bool> Vertices<DIFFUSE> {
    pub(super) const NONE: Self = Self {
        at: SurfaceLanes::NONE,
        normal: Vec3Lanes::ZERO,
        reflectance: Vec3Lanes::ZERO,
        bsdf: [Bsdf::Black; LANES],
        frame: [Frame { s: Vec3::X, t: Vec3::Y, n: Vec3::Z }; LANES],
        bent: [None; LANES],
    };

    /// The local frame of a lane.
    #[inline(always)]
    fn frame(&self, lane: usize) -> Frame {
        match DIFFUSE {
            true => Frame::new(self.normal.get(lane)),
            false => self.frame[lane],
        }
    }

    /// [`Bsdf::eval`] of a lane for world-space directions.
    #[inline(always)]
    pub(super) fn eval(
        &self,
        lane: usize,
        tables: &[Transmittance],
        directions: Directions,
        wo: Vec3,
        wi: Vec3,
    ) -> Evaluated {
        match DIFFUSE {
            true => {
                let frame = self.frame(lane);
                let bsdf = Bsdf::Diffuse { reflectance: self.reflectance.get(lane) };
                bsdf.eval(tables, directions, frame.to_local(wo), frame.to_local(wi))
            }
            false => eval(&self.bsdf[lane], (&self.frame[lane], self.bent[lane]), tables, directions, wo, wi),
        }
    }

    /// [`Bsdf::sample`] of a lane for a world-space direction; the drawn one is local, see [`Self::to_world`].
    #[inline(always)]
    pub(super) fn sample(
        &self,
        lane: usize,
        tables: &[Transmittance],
        directions: Directions,
        wo: Vec3,
        words: [u32; 4],
    ) -> Option<Scattered> {
        match DIFFUSE {
            true => {
                let bsdf = Bsdf::Diffuse { reflectance: self.reflectance.get(lane) };
                bsdf.sample(tables, directions, self.frame(lane).to_local(wo), words)
            }
            false => sample(&self.bsdf[lane], (&self.frame[lane], self.bent[lane]), tables, directions, wo, words),
        }
    }

    #[inline(always)]
    pub(super) fn to_world(&self, lane: usize, local: Vec3) -> Vec3 {
        self.frame(lane).to_world(local)
    }
}

/// Once, not in every loop over lanes: it is long, and nothing in it becomes vector code.
#[inline(never)]
fn eval(
    bsdf: &Bsdf,
    (frame, bent): (&Frame, Option<Bent>),
    tables: &[Transmittance],
    directions: Directions,
    wo: Vec3,
    wi: Vec3,
) -> Evaluated {
    let local = frame.to_local(wi);
    let evaluated = bsdf.eval(tables, directions, frame.to_local(wo), local);
    match bent.map(|b| b.factor(wi, local.z)) {
        None => evaluated,
        Some(0.0) => Evaluated { value: Rgb::ZERO, pdf: 0.0 },
        Some(factor) => Evaluated { value: evaluated.value * factor, ..evaluated },
    }
}

#[inline(never)]
fn sample(
    bsdf: &Bsdf,
    (frame, bent): (&Frame, Option<Bent>),
    tables: &[Transmittance],
    directions: Directions,
    wo: Vec3,
    words: [u32; 4],
) -> Option<Scattered> {
    let sample = bsdf.sample(tables, directions, frame.to_local(wo), words)?;
    let Some(bent) = bent else { return Some(sample) };
    let factor = bent.factor(frame.to_world(sample.wi), sample.wi.z);
    (factor > 0.0).then_some(Scattered { value: sample.value * factor, ..sample })
}
