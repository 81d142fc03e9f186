//! The path tracer on the CPU.

use super::{Cell, Estimate, Estimator, MOST_PIXELS, Shape, dependence_of, estimate_by_batches, is_progressive};
use crate::accel::bvh::Bvh;
#[cfg(target_arch = "x86_64")]
use crate::accel::simd::Registers;
use crate::error::{Error, Result};
use crate::math::Rgb;
use crate::record::Dependence;
use crate::sampling::{Draw, Strategy};
use crate::scene::Scene;
use crate::scene::light::LightSampler;
use crate::transport::{NoSink, PathTracer, Sink, WAVE};
use std::ops::Range;
use std::sync::{Arc, OnceLock};
use std::time::Instant;

/// A scene with everything that all strategies share: checked, hashed, and for the CPU engine its BVH.
pub struct PreparedScene {
    /// The scene.
    pub scene: Scene,
    /// Hash of everything that determines samples.
    pub hash: String,
    /// Seconds that checks and hash took.
    pub setup_seconds: f64,
    /// Built when it is first asked for, and the seconds that it took: GPUs have their own.
    bvh: OnceLock<(Bvh, f64)>,
}

impl PreparedScene {
    /// Checks the scene.
    ///
    /// # Errors
    /// What [`Scene::validate`] finds, too many pixels, and what [`Bvh::new`] refuses.
    pub fn new(scene: Scene) -> Result<Self> {
        let start = Instant::now();
        scene.validate().map_err(|problems| Error::Usage(problems.join("; ")))?;
        let pixels = scene.film.crop_size.iter().map(|&n| u64::from(n)).product::<u64>();
        if pixels > MOST_PIXELS {
            return Err(Error::Usage(format!("a film of {pixels} pixels; at most {MOST_PIXELS} are allowed")));
        }
        Bvh::check(&scene)?;
        let hash = content_hash(&scene);
        Ok(Self { scene, hash, setup_seconds: start.elapsed().as_secs_f64(), bvh: OnceLock::new() })
    }

    /// The scene's BVH, built at the first call.
    pub fn bvh(&self) -> &Bvh {
        &self.timed_bvh().0
    }

    /// Seconds that building it took.
    pub fn bvh_seconds(&self) -> f64 {
        self.timed_bvh().1
    }

    fn timed_bvh(&self) -> &(Bvh, f64) {
        self.bvh.get_or_init(|| {
            let start = Instant::now();
            let bvh = Bvh::new(&self.scene).expect("the scene was checked");
            (bvh, start.elapsed().as_secs_f64())
        })
    }
}

/// Hash of arrays, shapes, materials, lights, camera, film and depth: not of where the scene was read from.
fn content_hash(scene: &Scene) -> String {
    let mut h = blake3::Hasher::new();
    h.update(bytemuck::cast_slice(&scene.positions));
    h.update(bytemuck::cast_slice(&scene.normals));
    for colors in [&scene.texels, &scene.attributes] {
        h.update(bytemuck::cast_slice(colors));
    }
    h.update(bytemuck::cast_slice(&scene.uvs));
    if let Some(map) = &scene.environment_map {
        h.update(format!("{:?} {}", map.frame(), map.width()).as_bytes());
        h.update(bytemuck::cast_slice(map.texels()));
    }
    for t in &scene.triangles {
        h.update(bytemuck::bytes_of(&t.vertices));
        h.update(&t.shape.to_le_bytes());
    }
    for s in &scene.shapes {
        h.update(format!("{:?} {:?} {} {} {:?}", s.geometry, s.axes, s.front, s.back, s.light).as_bytes());
    }
    let rest = (
        &scene.materials,
        &scene.transmittances,
        &scene.textures,
        &scene.lights,
        &scene.camera,
        &scene.film,
        &scene.depth,
    );
    h.update(format!("{rest:?}").as_bytes());
    h.finalize().to_hex()[..24].to_owned()
}

/// A strategy on a scene, on the CPU.
pub struct CpuEstimator {
    prepared: Arc<PreparedScene>,
    strategy: Strategy,
    lights: LightSampler,
    all_effects: bool,
}

impl CpuEstimator {
    /// An estimator of the scene's image by a strategy.
    pub fn new(prepared: Arc<PreparedScene>, strategy: Strategy) -> Self {
        let lights = LightSampler::new(&prepared.scene, strategy.lights, strategy.light_choice);
        // Now, not within the time of the first sample.
        prepared.bvh();
        Self { prepared, strategy, lights, all_effects: false }
    }

    /// Leaves out nothing, whatever the scene calls for: the same samples, more slowly.
    #[must_use]
    pub fn with_all_effects(mut self) -> Self {
        self.all_effects = true;
        self
    }

    fn tracer(&self) -> PathTracer<'_> {
        let tracer = PathTracer::new(&self.prepared.scene, self.prepared.bvh(), &self.lights, self.strategy);
        if self.all_effects { tracer.with_all_effects() } else { tracer }
    }

    /// One sample, told to a sink.
    pub fn sample_with(&self, draw: &Draw, sink: &mut dyn Sink) -> Rgb {
        self.tracer().sample(draw, sink)
    }
}

impl Estimator for CpuEstimator {
    fn shape(&self) -> Shape {
        let [width, height] = self.prepared.scene.film.crop_size;
        Shape { width: width as usize, height: height as usize, channels: 3 }
    }

    fn identity(&self) -> String {
        // Not the same seconds, though the same samples.
        let all = if self.all_effects { " · all effects" } else { "" };
        format!("cpu path tracer{all} · scene {} · {}", self.prepared.hash, self.strategy.identity())
    }

    fn dependence(&self) -> Dependence {
        dependence_of(self.strategy.sequence)
    }

    fn progressive(&self) -> bool {
        is_progressive(self.strategy.sequence)
    }

    fn abscissa(&self) -> &'static str {
        "spp"
    }

    fn setup_seconds(&self) -> f64 {
        self.prepared.setup_seconds + self.prepared.bvh_seconds()
    }

    fn estimate(&self, cell: &Cell, checkpoint: u64, previous: &mut Option<Estimate>) -> Result<Estimate> {
        let tracer = self.tracer();
        let draw = Draw { key: cell.key, pixel: 0, sample: 0, length: cell.length, sequence: self.strategy.sequence };
        #[cfg(target_arch = "x86_64")]
        if let Some(avx512) = crate::accel::simd::Avx512::detect() {
            return Ok(estimate_by_batches(self.shape(), checkpoint, previous, |pixels, samples, out| {
                // SAFETY: AVX-512 was detected.
                unsafe { batch_avx512(avx512, &tracer, &draw, pixels, samples, out) }
            }));
        }
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = crate::accel::simd::Avx2::detect() {
            return Ok(estimate_by_batches(self.shape(), checkpoint, previous, |pixels, samples, out| {
                // SAFETY: AVX2 was detected.
                unsafe { batch_avx2(avx2, &tracer, &draw, pixels, samples, out) }
            }));
        }
        Ok(estimate_by_batches(self.shape(), checkpoint, previous, |pixels, samples, out| {
            let mut radiance = [Rgb::ZERO; WAVE];
            tracer.portable_wave(&draw, pixels, samples, &mut NoSink, &mut radiance);
            put(&radiance, out);
        }))
    }
}

/// Fills samples of pixels: see [`crate::moments::BlockTree::extend`].
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn batch<V: Registers>(
    simd: V,
    tracer: &PathTracer<'_>,
    draw: &Draw,
    pixels: Range<u32>,
    samples: Range<u64>,
    out: &mut [f64],
) {
    let mut radiance = [Rgb::ZERO; WAVE];
    tracer.wave(simd, draw, pixels, samples, &mut NoSink, &mut radiance);
    put(&radiance, out);
}

fn put(radiance: &[Rgb], out: &mut [f64]) {
    for (out, c) in out.chunks_exact_mut(3).zip(radiance) {
        out.copy_from_slice(&[c.x.into(), c.y.into(), c.z.into()]);
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn batch_avx2(
    simd: crate::accel::simd::Avx2,
    tracer: &PathTracer<'_>,
    draw: &Draw,
    pixels: Range<u32>,
    samples: Range<u64>,
    out: &mut [f64],
) {
    batch(simd, tracer, draw, pixels, samples, out);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,avx512f,avx512vl,avx512bw,avx512dq")]
fn batch_avx512(
    simd: crate::accel::simd::Avx512,
    tracer: &PathTracer<'_>,
    draw: &Draw,
    pixels: Range<u32>,
    samples: Range<u64>,
    out: &mut [f64],
) {
    batch(simd, tracer, draw, pixels, samples, out);
}
