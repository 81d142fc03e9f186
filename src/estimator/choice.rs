//! Which device an estimator runs on: what is asked for, what is there, what is taken and why.

use super::Estimator;
use super::cpu::{CpuEstimator, PreparedScene};
#[cfg(feature = "vulkan")]
use super::vulkan::{Device, DeviceKind, DeviceScene, Tuning, VulkanEstimator, devices};
use crate::error::{Error, Result};
use crate::record::DeviceNote;
use crate::sampling::Strategy;
#[cfg(feature = "vulkan")]
use crate::scene::Effects;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

/// Which Vulkan device to take.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Which {
    /// The best that can render.
    First,
    /// The one at this place in the list of `rootn devices`.
    Index(usize),
    /// The first whose name contains this, upper and lower case being the same.
    Name(String),
}

/// A device as asked for: `auto`, `cpu`, `vulkan`, `vulkan:NAME` or `vulkan:INDEX`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "String", into = "String")]
#[schemars(with = "String")]
pub enum DeviceRequest {
    /// A GPU where there is one, else the CPU engine.
    #[default]
    Auto,
    /// The CPU engine.
    Cpu,
    /// A Vulkan device.
    Vulkan(Which),
}

impl FromStr for DeviceRequest {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text.split_once(':').map_or((text, None), |(kind, which)| (kind, Some(which))) {
            ("auto", None) => Ok(Self::Auto),
            ("cpu", None) => Ok(Self::Cpu),
            ("vulkan", None) => Ok(Self::Vulkan(Which::First)),
            ("vulkan", Some(which)) if !which.is_empty() => {
                Ok(Self::Vulkan(which.parse().map_or_else(|_| Which::Name(which.into()), Which::Index)))
            }
            _ => Err("expected auto, cpu, vulkan, vulkan:NAME or vulkan:INDEX (see `rootn devices`)".into()),
        }
    }
}

impl TryFrom<String> for DeviceRequest {
    type Error = String;

    fn try_from(text: String) -> std::result::Result<Self, String> {
        text.parse().map_err(|expected| format!("device `{text}`: {expected}"))
    }
}

impl From<DeviceRequest> for String {
    fn from(request: DeviceRequest) -> Self {
        request.to_string()
    }
}

impl fmt::Display for DeviceRequest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Cpu => f.write_str("cpu"),
            Self::Vulkan(Which::First) => f.write_str("vulkan"),
            Self::Vulkan(Which::Index(index)) => write!(f, "vulkan:{index}"),
            Self::Vulkan(Which::Name(name)) => write!(f, "vulkan:{name}"),
        }
    }
}

/// How rays find what they meet on a Vulkan device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Traversal {
    /// Whichever of the others is fastest on the scene; the next time it may be another.
    Auto,
    /// Our own trees, with the CPU engine's guarantees, on any device.
    #[default]
    Compute,
    /// The driver's ray queries (VK_KHR_ray_query).
    RayQuery,
    /// The driver's ray-tracing pipeline (VK_KHR_ray_tracing_pipeline).
    RayPipeline,
}

impl Traversal {
    /// The name in files and tables.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Compute => "compute",
            Self::RayQuery => "ray-query",
            Self::RayPipeline => "ray-pipeline",
        }
    }
}

/// A device that was taken.
#[derive(Clone)]
pub struct Chosen {
    /// Its name in tables and records.
    pub name: String,
    /// Why it was taken.
    pub reason: String,
    engine: Engine,
}

#[derive(Clone)]
enum Engine {
    Cpu,
    #[cfg(feature = "vulkan")]
    Vulkan(Arc<Device>),
}

impl Chosen {
    /// Whether it is the CPU engine.
    pub fn is_cpu(&self) -> bool {
        matches!(self.engine, Engine::Cpu)
    }

    fn cpu(reason: impl Into<String>) -> Self {
        Self { name: "cpu".into(), reason: reason.into(), engine: Engine::Cpu }
    }
}

impl DeviceRequest {
    /// Takes the device.
    ///
    /// # Errors
    /// [`Error::Unavailable`] where it was asked for by name or kind and cannot be had. `auto` always finds one.
    pub fn take(&self) -> Result<Chosen> {
        match self {
            Self::Cpu => Ok(Chosen::cpu("it was asked for")),
            Self::Auto => Ok(automatic()),
            Self::Vulkan(which) => vulkan(which, "it was asked for"),
        }
    }
}

#[cfg(feature = "vulkan")]
fn vulkan(which: &Which, reason: &str) -> Result<Chosen> {
    // The layer's messages end up on stderr; for tests of whole commands.
    let validate = std::env::var_os("ROOTN_VALIDATION").is_some();
    let device = Device::open(which, validate)?;
    Ok(Chosen { name: device.info().name.clone(), reason: reason.into(), engine: Engine::Vulkan(device) })
}

#[cfg(not(feature = "vulkan"))]
fn vulkan(_: &Which, _: &str) -> Result<Chosen> {
    Err(Error::unavailable("Vulkan", "this rootn was built without the feature `vulkan`"))
}

#[cfg(feature = "vulkan")]
fn automatic() -> Chosen {
    let list = match devices() {
        Ok(list) => list,
        Err(Error::Unavailable { what, reason }) => return Chosen::cpu(format!("{what} is unavailable: {reason}")),
        Err(e) => return Chosen::cpu(e.to_string()),
    };
    let Some(gpu) = list.iter().find(|d| d.kind != DeviceKind::Cpu && d.missing.is_empty()) else {
        return Chosen::cpu(match list.first() {
            None => "there is no Vulkan device".into(),
            Some(d) if d.kind == DeviceKind::Cpu => format!("the only Vulkan driver, {}, runs on the CPU, too", d.name),
            Some(d) => format!("{} lacks {}", d.name, d.missing.join(", ")),
        });
    };
    match vulkan(&Which::Index(gpu.index), "it is the best GPU of this machine") {
        Ok(chosen) => chosen,
        Err(e) => Chosen::cpu(e.to_string()),
    }
}

#[cfg(not(feature = "vulkan"))]
fn automatic() -> Chosen {
    Chosen::cpu("this rootn was built without the feature `vulkan`")
}

/// Devices as they were taken, each once.
#[derive(Default)]
pub struct Taken(Vec<(DeviceRequest, Chosen)>);

impl Taken {
    /// What [`DeviceRequest::take`] gives, the same for equal requests.
    ///
    /// # Errors
    /// Those of [`DeviceRequest::take`].
    pub fn take(&mut self, request: &DeviceRequest) -> Result<Chosen> {
        if let Some((_, chosen)) = self.0.iter().find(|(r, _)| r == request) {
            return Ok(chosen.clone());
        }
        let chosen = request.take()?;
        self.0.push((request.clone(), chosen.clone()));
        Ok(chosen)
    }

    /// All that were taken, for the record: each once, with the first reason.
    pub fn notes(&self) -> Vec<DeviceNote> {
        let mut notes: Vec<DeviceNote> = Vec::new();
        for (_, chosen) in &self.0 {
            if notes.iter().all(|n| n.name != chosen.name) {
                notes.push(DeviceNote { name: chosen.name.clone(), reason: chosen.reason.clone() });
            }
        }
        notes
    }
}

/// Path tracers of one scene on any devices: the scene goes to each device once.
pub struct PathTracers {
    prepared: Arc<PreparedScene>,
    all_effects: bool,
    #[cfg(feature = "vulkan")]
    uploaded: Vec<(Arc<Device>, Arc<DeviceScene>)>,
}

impl PathTracers {
    /// Of a prepared scene. `all_effects`: leave out nothing, whatever the scene calls for.
    pub fn new(prepared: Arc<PreparedScene>, all_effects: bool) -> Self {
        Self {
            prepared,
            all_effects,
            #[cfg(feature = "vulkan")]
            uploaded: Vec::new(),
        }
    }

    /// The path tracer with a strategy on a device, and what it runs on in words. The CPU has one traversal only.
    ///
    /// # Errors
    /// [`Error::Device`] where a device fails, [`Error::Unavailable`] where it lacks the traversal.
    pub fn estimator(
        &mut self,
        device: &Chosen,
        traversal: Traversal,
        strategy: Strategy,
    ) -> Result<(Box<dyn Estimator>, String)> {
        let all = if self.all_effects { " · all effects" } else { "" };
        match &device.engine {
            Engine::Cpu => {
                if !matches!(traversal, Traversal::Auto | Traversal::Compute) {
                    let what = format!("traversal {}", traversal.label());
                    return Err(Error::unavailable(what, "the CPU engine has only its own"));
                }
                let estimator = CpuEstimator::new(Arc::clone(&self.prepared), strategy);
                let estimator = if self.all_effects { estimator.with_all_effects() } else { estimator };
                Ok((Box::new(estimator), format!("{}{all}", device.name)))
            }
            #[cfg(feature = "vulkan")]
            Engine::Vulkan(opened) => {
                let scene = match self.uploaded.iter().find(|(d, _)| Arc::ptr_eq(d, opened)) {
                    Some((_, scene)) => Arc::clone(scene),
                    None => {
                        let scene = Arc::new(DeviceScene::new(opened, Arc::clone(&self.prepared))?);
                        self.uploaded.push((Arc::clone(opened), Arc::clone(&scene)));
                        scene
                    }
                };
                let also = if self.all_effects { Effects::EVERY } else { Effects::NONE };
                let tuning = Tuning { traversal, also, ..Tuning::default() };
                let estimator = VulkanEstimator::new(scene, strategy, tuning)?;
                let name = format!("{} · {}{all}", device.name, estimator.traversal().label());
                Ok((Box::new(estimator), name))
            }
        }
    }
}
