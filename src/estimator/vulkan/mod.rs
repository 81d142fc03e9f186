//! The path tracer on Vulkan devices.

mod buffer;
mod cache;
mod commands;
pub mod device;
pub mod kernel;
mod messages;
mod upload;
mod work;

pub use device::{Device, DeviceInfo, DeviceKind, devices};

use self::commands::Commands;
use self::upload::{SceneBuffers, Settings, TracerBuffers};
use self::work::{Accumulators, Engine};
use super::cpu::PreparedScene;
use super::{Cell, Estimate, Estimator, Shape, dependence_of, is_progressive};
use crate::accel::compact::CompactBvh;
use crate::error::Result;
use crate::moments::BlockTree;
use crate::record::Dependence;
use crate::sampling::Strategy;
use crate::scene::light::LightSampler;
use crate::scene::Effects;
use crate::transport::path::depths;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

static PATH: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/path.spv"));

/// A scene in the memory of a device.
pub struct DeviceScene {
    device: Arc<Device>,
    prepared: Arc<PreparedScene>,
    buffers: SceneBuffers,
    engine: Mutex<Engine>,
    /// Seconds that upload and building of acceleration structures took.
    setup_seconds: f64,
}

impl DeviceScene {
    /// Builds the device's acceleration structure and uploads everything that strategies share.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails or its memory does not suffice.
    pub fn new(device: &Arc<Device>, prepared: Arc<PreparedScene>) -> Result<Self> {
        let start = Instant::now();
        let bvh = CompactBvh::new(&prepared.scene)?;
        let mut commands = Commands::new(device)?;
        let buffers = SceneBuffers::new(&mut commands, &prepared.scene, &bvh)?;
        let engine = Mutex::new(Engine::new(device, commands)?);
        let setup_seconds = start.elapsed().as_secs_f64();
        Ok(Self { device: Arc::clone(device), prepared, buffers, engine, setup_seconds })
    }
}

/// How a [`VulkanEstimator`] works, apart from what it estimates.
#[derive(Clone, Copy, Debug)]
pub struct Tuning {
    /// Whether the kernel leaves out what the scene does not call for.
    pub specialised: bool,
    /// Invocations per dispatch; `None`: sized by time.
    pub dispatch: Option<u32>,
}

impl Default for Tuning {
    fn default() -> Self {
        Self { specialised: true, dispatch: None }
    }
}

/// A strategy on a scene, on a Vulkan device. Samples have the same identities as on the CPU, and up to rounding the same
/// values; blocks of 64 are summed in f32, blocks in f64.
pub struct VulkanEstimator {
    scene: Arc<DeviceScene>,
    strategy: Strategy,
    tracer: TracerBuffers,
    kernel: kernel::Kernel,
    tuning: Tuning,
    /// Seconds per invocation so far; 0 before the first dispatch.
    pace: Mutex<f64>,
    setup_seconds: f64,
}

impl VulkanEstimator {
    /// An estimator of the scene's image by a strategy.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn new(scene: Arc<DeviceScene>, strategy: Strategy, tuning: Tuning) -> Result<Self> {
        let start = Instant::now();
        let host = &scene.prepared.scene;
        let sampler = LightSampler::new(host, strategy.lights, strategy.light_choice);
        let lights = sampler.tables();
        let (effects, kinds) = match tuning.specialised {
            true => (Effects::of(host, !sampler.is_empty()), lights.kinds),
            false => (Effects::all(), u32::MAX),
        };
        let settings = Settings::new(&strategy, depths(host, &strategy), effects, kinds);
        let mut engine = scene.engine.lock().unwrap_or_else(PoisonError::into_inner);
        let tracer = TracerBuffers::new(engine.commands(), host, &scene.buffers, &lights, settings)?;
        drop(engine);
        let mut constants = vec![(10, scene.buffers.stack)];
        if tuning.specialised {
            constants.push((1, 1));
            constants.extend(settings.constants());
        }
        let kernel = kernel::Kernel::new(&scene.device, PATH, &constants, work::PUSH)?;
        let setup_seconds = scene.prepared.setup_seconds + scene.setup_seconds + start.elapsed().as_secs_f64();
        Ok(Self { scene, strategy, tracer, kernel, tuning, pace: Mutex::new(0.0), setup_seconds })
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
            "vulkan path tracer · {} · {} · compute · scene {} · {}",
            info.name,
            info.driver,
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
        let empty = BlockTree::new(3);
        let (tree, spent) = match previous {
            Some(Estimate { moments: Some(tree), seconds, .. }) => (&*tree, *seconds),
            _ => (&empty, 0.0),
        };
        let mut engine = self.scene.engine.lock().unwrap_or_else(PoisonError::into_inner);
        let mut pace = self.pace.lock().unwrap_or_else(PoisonError::into_inner);
        let job = Accumulators { pixels: self.shape().pixels() as u32, tree, to: checkpoint };
        let (tree, seconds) =
            engine.advance(&self.kernel, self.tracer.tracer.address, cell, &job, self.tuning.dispatch, &mut pace)?;
        Ok(Estimate {
            field: tree.fold_map(|m| m.mean),
            moments: Some(tree),
            abscissa: checkpoint,
            seconds: spent + seconds,
        })
    }
}
