//! The path tracer on Vulkan devices.

mod buffer;
mod cache;
mod commands;
pub mod device;
pub mod kernel;
mod messages;
mod structures;
mod upload;
mod work;

pub use device::{Device, DeviceInfo, DeviceKind, devices};

use self::commands::Commands;
use self::kernel::{Kernel, RayStages};
use self::structures::{Geometry, Structures};
use self::upload::{EFFECTS, LIGHT_KINDS, STACK, SceneBuffers, Settings, TracerBuffers};
use self::work::{Accumulators, Engine, Pace};
use super::choice::Traversal;
use super::cpu::PreparedScene;
use super::{Cell, Estimate, Estimator, Shape, dependence_of, is_progressive};
use crate::accel::compact::CompactBvh;
use crate::error::{Error, Result};
use crate::moments::{BLOCK, BlockTree};
use crate::record::Dependence;
use crate::sampling::{Key, Strategy};
use crate::scene::Effects;
use crate::scene::light::LightSampler;
use crate::transport::path::depths;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// SPIR-V of the entry `$name` of shaders/.
macro_rules! spirv {
    ($name:literal) => {
        include_bytes!(concat!(env!("OUT_DIR"), "/", $name, ".spv"))
    };
}
use spirv;

/// A scene in the memory of a device.
pub struct DeviceScene {
    device: Arc<Device>,
    prepared: Arc<PreparedScene>,
    buffers: SceneBuffers,
    engine: Mutex<Engine>,
    /// The driver's acceleration structures, once they were asked for, and the seconds that they took.
    structures: Mutex<Option<(Arc<Structures>, f64)>>,
    /// What [`Traversal::Auto`] has found, once it was asked for.
    fastest: Mutex<Option<Traversal>>,
    /// Seconds that building of our trees and the upload took.
    setup_seconds: f64,
}

impl DeviceScene {
    /// Builds our trees and uploads everything that strategies share.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails or its memory does not suffice.
    pub fn new(device: &Arc<Device>, prepared: Arc<PreparedScene>) -> Result<Self> {
        let start = Instant::now();
        let bvh = CompactBvh::new(&prepared.scene)?;
        let mut commands = Commands::new(device)?;
        let buffers = SceneBuffers::new(&mut commands, &prepared.scene, &bvh)?;
        let engine = Mutex::new(Engine::new(device, commands)?);
        let setup_seconds = start.elapsed().as_secs_f64();
        Ok(Self {
            device: Arc::clone(device),
            prepared,
            buffers,
            engine,
            structures: Mutex::new(None),
            fastest: Mutex::new(None),
            setup_seconds,
        })
    }

    fn engine(&self) -> MutexGuard<'_, Engine> {
        self.engine.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The driver's acceleration structures, built at the first call, and the seconds that they took.
    fn structures(&self) -> Result<(Arc<Structures>, f64)> {
        let mut kept = self.structures.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(structures) = &*kept {
            return Ok(structures.clone());
        }
        let start = Instant::now();
        let scene = &self.prepared.scene;
        let mut engine = self.engine();
        let commands = engine.commands();
        let vertices: Vec<[u32; 3]> = scene.triangles.iter().map(|t| t.vertices).collect();
        let positions = commands.upload(bytemuck::cast_slice(&scene.positions))?;
        let triangles = commands.upload(bytemuck::cast_slice(&vertices))?;
        let boxes = commands.upload(bytemuck::cast_slice(&self.buffers.boxes))?;
        let geometry = Geometry {
            positions: (&positions, scene.positions.len() as u32),
            triangles: (&triangles, vertices.len() as u32),
            boxes: (&boxes, self.buffers.boxes.len() as u32),
        };
        let structures = Arc::new(Structures::new(&self.device, commands, &geometry)?);
        Ok(kept.insert((structures, start.elapsed().as_secs_f64())).clone())
    }
}

/// How a [`VulkanEstimator`] works, apart from what it estimates.
#[derive(Clone, Copy, Debug)]
pub struct Tuning {
    /// How rays find what they meet.
    pub traversal: Traversal,
    /// Effects that the kernel has although the scene does not call for them: what they cost. With [`Effects::EVERY`] it has all
    /// kinds of area lights, too.
    pub also: Effects,
    /// Invocations per dispatch; `None`: sized by time.
    pub dispatch: Option<u32>,
}

impl Default for Tuning {
    fn default() -> Self {
        Self { traversal: Traversal::Compute, also: Effects::NONE, dispatch: None }
    }
}

/// A strategy on a scene, on a Vulkan device. Samples have the same identities as on the CPU, and up to rounding the same
/// values; blocks of 64 are summed in f32, blocks in f64: within a block fourth powers of deviations beyond 1e9 leave the range.
pub struct VulkanEstimator {
    scene: Arc<DeviceScene>,
    strategy: Strategy,
    tracer: TracerBuffers,
    /// What the tracer traces, where the driver does it.
    _structures: Option<Arc<Structures>>,
    kernel: Kernel,
    tuning: Tuning,
    pace: Mutex<Pace>,
    setup_seconds: f64,
}

impl VulkanEstimator {
    /// An estimator of the scene's image by a strategy. With [`Traversal::Auto`] the first strategy tries all traversals that the
    /// device offers for a moment each; the fastest is taken for it and for all later ones on the scene.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails, [`Error::Unavailable`] where it lacks the traversal.
    pub fn new(scene: Arc<DeviceScene>, strategy: Strategy, tuning: Tuning) -> Result<Self> {
        if tuning.traversal != Traversal::Auto {
            return Self::with_traversal(scene, strategy, tuning);
        }
        let mut fastest = scene.fastest.lock().unwrap_or_else(PoisonError::into_inner);
        let traversal = match *fastest {
            Some(traversal) => traversal,
            None => *fastest.insert(Self::fastest(&scene, strategy, tuning)?),
        };
        drop(fastest);
        Self::with_traversal(scene, strategy, Tuning { traversal, ..tuning })
    }

    /// The fastest traversal. One that fails is none, as long as our own works.
    fn fastest(scene: &Arc<DeviceScene>, strategy: Strategy, tuning: Tuning) -> Result<Traversal> {
        let measure = |traversal| {
            let candidate = Self::with_traversal(Arc::clone(scene), strategy, Tuning { traversal, ..tuning })?;
            candidate.seconds_per_sample()
        };
        let mut best = (measure(Traversal::Compute)?, Traversal::Compute);
        for traversal in [Traversal::RayQuery, Traversal::RayPipeline] {
            if let Ok(seconds) = measure(traversal) {
                best = if seconds < best.0 { (seconds, traversal) } else { best };
            }
        }
        Ok(best.1)
    }

    fn with_traversal(scene: Arc<DeviceScene>, strategy: Strategy, tuning: Tuning) -> Result<Self> {
        let info = scene.device.info();
        let lacks = |extension: &str| {
            let what = format!("traversal {}", tuning.traversal.label());
            Error::unavailable(what, format!("{} has no {extension}", info.name))
        };
        match tuning.traversal {
            Traversal::RayQuery if !info.ray_query => return Err(lacks("VK_KHR_ray_query")),
            Traversal::RayPipeline if !info.ray_pipeline => return Err(lacks("VK_KHR_ray_tracing_pipeline")),
            _ => {}
        }
        let structures = (tuning.traversal != Traversal::Compute).then(|| scene.structures()).transpose()?;
        let (structures, building) = structures.unzip();
        let start = Instant::now();
        let host = &scene.prepared.scene;
        let sampler = LightSampler::new(host, strategy.lights, strategy.light_choice);
        let lights = sampler.tables();
        let settings = Settings::new(&strategy, depths(host, &strategy));
        let effects = Effects::of(host, !sampler.is_empty()).with(tuning.also);
        let kinds = if effects == Effects::EVERY { u32::MAX } else { lights.kinds };
        let mut constants = vec![(STACK, scene.buffers.stack), (EFFECTS, effects.bits()), (LIGHT_KINDS, kinds)];
        constants.extend(settings.constants());
        let short = Effects::SHORT.contains(effects);
        let mut engine = scene.engine();
        let top_level = structures.as_ref().map_or(0, |s| s.address());
        let tracer = TracerBuffers::new(engine.commands(), host, &scene.buffers, &lights, top_level)?;
        // SAFETY: our build made the code, and rays are only traced where the device was opened for them.
        let kernel = unsafe {
            let compute = |code| Kernel::new(&scene.device, code, &constants, work::PUSH);
            match tuning.traversal {
                Traversal::RayQuery if short => compute(spirv!("path_query"))?,
                Traversal::RayQuery => compute(spirv!("path_query_full"))?,
                Traversal::RayPipeline => {
                    let stages = RayStages {
                        generation: if short { spirv!("path_generation") } else { spirv!("path_generation_full") },
                        miss: spirv!("path_miss"),
                        any_hit: spirv!("path_any_hit"),
                        closest_hit: spirv!("path_closest_hit"),
                        quadric_hit: spirv!("path_quadric_hit"),
                        intersection: spirv!("path_intersection"),
                    };
                    Kernel::rays(&scene.device, engine.commands(), &stages, &constants, work::PUSH)?
                }
                Traversal::Auto | Traversal::Compute if short => compute(spirv!("path"))?,
                Traversal::Auto | Traversal::Compute => compute(spirv!("path_full"))?,
            }
        };
        drop(engine);
        let before = scene.prepared.setup_seconds + scene.setup_seconds + building.unwrap_or(0.0);
        let setup_seconds = before + start.elapsed().as_secs_f64();
        let pace = Mutex::new(Pace::default());
        Ok(Self { scene, strategy, tracer, _structures: structures, kernel, tuning, pace, setup_seconds })
    }

    /// How rays find what they meet: never [`Traversal::Auto`].
    pub fn traversal(&self) -> Traversal {
        self.tuning.traversal
    }

    /// How fast it is, from as many samples as take a few hundredths of a second.
    fn seconds_per_sample(&self) -> Result<f64> {
        let cell = Cell { key: Key([0, 0]), length: BLOCK };
        let seconds = |samples| self.estimate(&cell, samples, &mut None).map(|e| e.seconds);
        // Once for warming up.
        seconds(1)?;
        let mut samples = 1;
        loop {
            let seconds = seconds(samples)?;
            if seconds > 0.03 || samples >= BLOCK {
                return Ok(seconds / samples as f64);
            }
            samples *= 2;
        }
    }
}

impl Estimator for VulkanEstimator {
    fn shape(&self) -> Shape {
        let [width, height] = self.scene.prepared.scene.film.crop_size;
        Shape { width: width as usize, height: height as usize, channels: 3 }
    }

    fn identity(&self) -> String {
        let info = self.scene.device.info();
        format!(
            "vulkan path tracer{} · {} · {} · {} · scene {} · {}",
            if self.tuning.also == Effects::EVERY { " · all effects" } else { "" },
            info.name,
            info.driver,
            self.tuning.traversal.label(),
            self.scene.prepared.hash,
            self.strategy.identity()
        )
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
        self.setup_seconds
    }

    fn estimate(&self, cell: &Cell, checkpoint: u64, previous: &mut Option<Estimate>) -> Result<Estimate> {
        let start = Instant::now();
        let empty = BlockTree::new(3);
        let (tree, spent, passed) = match previous {
            Some(Estimate { moments: Some(tree), seconds, wall_seconds, .. }) => (&*tree, *seconds, *wall_seconds),
            _ => (&empty, 0.0, 0.0),
        };
        let mut engine = self.scene.engine();
        let mut pace = self.pace.lock().unwrap_or_else(PoisonError::into_inner);
        let job = Accumulators { pixels: self.shape().pixels() as u32, tree, to: checkpoint };
        let (tree, seconds) =
            engine.advance(&self.kernel, self.tracer.tracer.address, cell, &job, self.tuning.dispatch, &mut pace)?;
        Ok(Estimate {
            field: tree.fold_map(|m| m.mean),
            moments: Some(tree),
            abscissa: checkpoint,
            seconds: spent + seconds,
            wall_seconds: passed + start.elapsed().as_secs_f64(),
        })
    }
}
