//! Vulkan devices: which there are, what they can do, and one opened for computing.

use super::cache::PipelineCache;
use super::messages::Messages;
use crate::error::{Error, Result};
use crate::estimator::choice::Which;
use ash::{khr, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use serde::{Deserialize, Serialize};
use std::ffi::CStr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Kinds of devices, the ones to prefer first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DeviceKind {
    /// A graphics card.
    Discrete,
    /// A graphics unit that shares memory with the CPU.
    Integrated,
    /// A part of a graphics card, given to a virtual machine.
    Virtual,
    /// Something else.
    Other,
    /// A driver that runs shaders on the CPU.
    Cpu,
}

impl DeviceKind {
    /// Name in tables.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Other => "other",
            Self::Cpu => "cpu",
        }
    }
}

/// What a device is and what it can do.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeviceInfo {
    /// Place in the list, best first: what `--device vulkan:INDEX` means.
    pub index: usize,
    /// The driver's name for it.
    pub name: String,
    /// Its kind.
    pub kind: DeviceKind,
    /// Driver and its version, as the driver says.
    pub driver: String,
    /// Vulkan version.
    pub api: String,
    /// Bytes of its largest device-local heap.
    pub memory: u64,
    /// Largest storage buffer that one binding can name, bytes.
    pub max_storage_buffer: u64,
    /// Largest single allocation, bytes.
    pub max_allocation: u64,
    /// Nanoseconds per tick of its timestamps; `None` where it has none.
    pub timestamp_period: Option<f32>,
    /// Valid bits of a timestamp.
    pub timestamp_bits: u32,
    /// f64 arithmetic in shaders.
    pub float64: bool,
    /// Ray queries in compute shaders (VK_KHR_ray_query).
    pub ray_query: bool,
    /// Ray-tracing pipelines (VK_KHR_ray_tracing_pipeline).
    pub ray_pipeline: bool,
    /// What is missing for rendering; empty where nothing is.
    pub missing: Vec<String>,
}

/// The instance, and the messages of its validation layers.
struct Instance {
    // Dropped last: the library must outlive all that it made.
    raw: ash::Instance,
    messages: Option<Messages>,
    entry: ash::Entry,
}

impl Instance {
    /// `validate` asks for the validation layer with synchronisation validation.
    fn new(validate: bool) -> Result<Self> {
        // SAFETY: loading the system's Vulkan loader runs its initialisers, which is what it is made for.
        let entry = unsafe { ash::Entry::load() }
            .map_err(|e| Error::unavailable("Vulkan", format!("its loader cannot be loaded: {e}")))?;
        let application = vk::ApplicationInfo::default().application_name(c"rootn").api_version(vk::API_VERSION_1_2);
        let mut info = vk::InstanceCreateInfo::default().application_info(&application);
        let layers = [c"VK_LAYER_KHRONOS_validation".as_ptr()];
        let extensions = [ash::ext::debug_utils::NAME.as_ptr(), vk::EXT_VALIDATION_FEATURES_NAME.as_ptr()];
        let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
        if validate {
            info = info.enabled_layer_names(&layers).enabled_extension_names(&extensions).push_next(&mut features);
        }
        // SAFETY: all that `info` points to lives until the call returns.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|e| match e {
            vk::Result::ERROR_LAYER_NOT_PRESENT => {
                Error::unavailable("the Vulkan validation layer", "VK_LAYER_KHRONOS_validation is not installed")
            }
            e => Error::unavailable("Vulkan", format!("no instance can be made: {e}")),
        })?;
        let mut instance = Self { raw, messages: None, entry };
        if validate {
            let messages = Messages::new(&instance.entry, &instance.raw);
            let failed = |e| Error::unavailable("Vulkan", format!("messages cannot be received: {e}"));
            instance.messages = Some(messages.map_err(failed)?);
        }
        Ok(instance)
    }

    /// All devices, best first.
    fn devices(&self) -> Result<Vec<(vk::PhysicalDevice, DeviceInfo)>> {
        // SAFETY: the instance is valid.
        let all = unsafe { self.raw.enumerate_physical_devices() }
            .map_err(|e| Error::unavailable("Vulkan", format!("its devices cannot be listed: {e}")))?;
        let mut devices: Vec<_> = all.into_iter().map(|d| (d, self.describe(d))).collect();
        devices.sort_by_key(|(_, info)| info.kind);
        devices.iter_mut().enumerate().for_each(|(i, (_, info))| info.index = i);
        Ok(devices)
    }

    fn describe(&self, device: vk::PhysicalDevice) -> DeviceInfo {
        // SAFETY: the device belongs to the instance, and the chained structures live through each call.
        unsafe {
            let (mut driver, mut controls) =
                (vk::PhysicalDeviceDriverProperties::default(), vk::PhysicalDeviceFloatControlsProperties::default());
            let mut maintenance = vk::PhysicalDeviceMaintenance3Properties::default();
            let mut properties = vk::PhysicalDeviceProperties2::default()
                .push_next(&mut driver)
                .push_next(&mut controls)
                .push_next(&mut maintenance);
            self.raw.get_physical_device_properties2(device, &mut properties);
            let properties = properties.properties;
            let mut twelve = vk::PhysicalDeviceVulkan12Features::default();
            let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut twelve);
            let recent = properties.api_version >= vk::API_VERSION_1_2;
            if recent {
                self.raw.get_physical_device_features2(device, &mut features);
            }
            let features = features.features;
            let families = self.raw.get_physical_device_queue_family_properties(device);
            let memory = self.raw.get_physical_device_memory_properties(device);
            let extensions = self.raw.enumerate_device_extension_properties(device).unwrap_or_default();
            let has = |name: &CStr| extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
            let traces = has(khr::acceleration_structure::NAME) && has(khr::deferred_host_operations::NAME);
            let bits = compute_family(&families).map_or(0, |f| families[f as usize].timestamp_valid_bits);
            let needed = [
                (recent, "Vulkan 1.2"),
                (features.shader_int64 == vk::TRUE, "64-bit integers (shaderInt64)"),
                (features.shader_float64 == vk::TRUE, "f64 arithmetic (shaderFloat64)"),
                (twelve.buffer_device_address == vk::TRUE, "buffer device addresses"),
                (twelve.timeline_semaphore == vk::TRUE, "timeline semaphores"),
                (twelve.scalar_block_layout == vk::TRUE, "scalar block layout"),
                (
                    controls.shader_signed_zero_inf_nan_preserve_float32 == vk::TRUE,
                    "IEEE infinities and NaN (shaderSignedZeroInfNanPreserveFloat32)",
                ),
                (
                    controls.shader_signed_zero_inf_nan_preserve_float64 == vk::TRUE,
                    "IEEE infinities and NaN in f64 (shaderSignedZeroInfNanPreserveFloat64)",
                ),
                (compute_family(&families).is_some(), "a queue for computing"),
                (bits > 0, "timestamps"),
            ];
            DeviceInfo {
                index: 0,
                name: text(properties.device_name_as_c_str()),
                kind: match properties.device_type {
                    vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
                    vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
                    vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
                    vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
                    _ => DeviceKind::Other,
                },
                driver: format!("{} {}", text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str())),
                api: version(properties.api_version),
                memory: memory
                    .memory_heaps_as_slice()
                    .iter()
                    .filter(|h| h.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
                    .map(|h| h.size)
                    .max()
                    .unwrap_or(0),
                max_storage_buffer: properties.limits.max_storage_buffer_range.into(),
                max_allocation: maintenance.max_memory_allocation_size,
                timestamp_period: (bits > 0).then_some(properties.limits.timestamp_period),
                timestamp_bits: bits,
                float64: features.shader_float64 == vk::TRUE,
                ray_query: traces && has(khr::ray_query::NAME),
                ray_pipeline: traces && has(khr::ray_tracing_pipeline::NAME),
                missing: needed.iter().filter(|(there, _)| !there).map(|(_, what)| (*what).to_owned()).collect(),
            }
        }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let Some(messages) = self.messages.take() {
            messages.take().iter().for_each(|m| eprintln!("rootn: validation: {m}"));
        }
        // SAFETY: everything made from the instance holds an `Arc` of its `Device` and is gone.
        unsafe { self.raw.destroy_instance(None) }
    }
}

/// A queue that computes, and if possible does not draw: on a desktop it is not held up by the screen.
fn compute_family(families: &[vk::QueueFamilyProperties]) -> Option<u32> {
    let computes = |f: &vk::QueueFamilyProperties| f.queue_flags.contains(vk::QueueFlags::COMPUTE);
    let alone = |f: &vk::QueueFamilyProperties| computes(f) && !f.queue_flags.contains(vk::QueueFlags::GRAPHICS);
    families.iter().position(alone).or_else(|| families.iter().position(computes)).map(|f| f as u32)
}

fn text(name: std::result::Result<&CStr, std::ffi::FromBytesUntilNulError>) -> String {
    name.map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
}

fn version(v: u32) -> String {
    format!("{}.{}.{}", vk::api_version_major(v), vk::api_version_minor(v), vk::api_version_patch(v))
}

/// All Vulkan devices of this machine, best first: discrete, integrated, …, drivers that compute on the CPU last.
///
/// # Errors
/// [`Error::Unavailable`] where there is no Vulkan loader.
pub fn devices() -> Result<Vec<DeviceInfo>> {
    Ok(Instance::new(false)?.devices()?.into_iter().map(|(_, info)| info).collect())
}

/// A device opened for computing: one queue, its memory, its pipeline cache.
pub struct Device {
    pub(super) raw: ash::Device,
    pub(super) info: DeviceInfo,
    pub(super) family: u32,
    pub(super) cache: PipelineCache,
    pub(super) acceleration: Option<khr::acceleration_structure::Device>,
    pub(super) pipelines: Option<khr::ray_tracing_pipeline::Device>,
    pub(super) shader_groups: ShaderGroups,
    queue: Mutex<vk::Queue>,
    allocator: Mutex<Option<Allocator>>,
    /// Submissions that still succeed, for tests of a lost device; `u64::MAX` = no end.
    until_lost: AtomicU64,
    instance: Instance,
}

/// Sizes that shader binding tables go by, bytes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ShaderGroups {
    pub(super) handle: u64,
    pub(super) alignment: u64,
    pub(super) base_alignment: u64,
    pub(super) scratch_alignment: u64,
}

impl Device {
    /// Opens a device. `validate` asks for the validation layer; its messages are kept for [`Self::messages`].
    ///
    /// # Errors
    /// [`Error::Unavailable`] where there is no Vulkan, no such device, or it lacks something.
    pub fn open(which: &Which, validate: bool) -> Result<Arc<Self>> {
        let instance = Instance::new(validate)?;
        let (physical, info) = choose(instance.devices()?, which)?;
        if let [first, rest @ ..] = &info.missing[..] {
            let more = rest.iter().map(|m| format!(", {m}")).collect::<String>();
            return Err(Error::unavailable(&*info.name, format!("it lacks {first}{more}")));
        }
        let failed = |e: vk::Result| Error::unavailable(&*info.name, format!("it cannot be opened: {e}"));
        // SAFETY: the device belongs to the instance; what the structures point to lives through the calls.
        unsafe {
            let families = instance.raw.get_physical_device_queue_family_properties(physical);
            let family = compute_family(&families).expect("it is among what is checked above");
            let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
            let core = vk::PhysicalDeviceFeatures::default().shader_int64(true).shader_float64(true);
            let mut twelve = vk::PhysicalDeviceVulkan12Features::default()
                .buffer_device_address(true)
                .timeline_semaphore(true)
                .scalar_block_layout(true);
            let mut extensions = Vec::new();
            let traces = info.ray_query || info.ray_pipeline;
            let mut structures =
                vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default().acceleration_structure(true);
            let mut query = vk::PhysicalDeviceRayQueryFeaturesKHR::default().ray_query(true);
            let mut pipeline = vk::PhysicalDeviceRayTracingPipelineFeaturesKHR::default().ray_tracing_pipeline(true);
            let mut create = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .enabled_features(&core)
                .push_next(&mut twelve);
            if traces {
                extensions.extend([khr::acceleration_structure::NAME, khr::deferred_host_operations::NAME]);
                create = create.push_next(&mut structures);
            }
            if info.ray_query {
                extensions.push(khr::ray_query::NAME);
                create = create.push_next(&mut query);
            }
            if info.ray_pipeline {
                extensions.push(khr::ray_tracing_pipeline::NAME);
                create = create.push_next(&mut pipeline);
            }
            let names: Vec<_> = extensions.iter().map(|n| n.as_ptr()).collect();
            let raw =
                instance.raw.create_device(physical, &create.enabled_extension_names(&names), None).map_err(failed)?;
            let cache = match PipelineCache::open(&raw, &instance.raw.get_physical_device_properties(physical)) {
                Ok(cache) => cache,
                Err(e) => {
                    raw.destroy_device(None);
                    return Err(failed(e));
                }
            };
            let allocator = Allocator::new(&AllocatorCreateDesc {
                instance: instance.raw.clone(),
                device: raw.clone(),
                physical_device: physical,
                debug_settings: gpu_allocator::AllocatorDebugSettings::default(),
                buffer_device_address: true,
                allocation_sizes: gpu_allocator::AllocationSizes::default(),
            });
            let allocator = match allocator {
                Ok(a) => a,
                Err(e) => {
                    cache.close(&raw);
                    raw.destroy_device(None);
                    return Err(Error::unavailable(&*info.name, format!("it cannot be opened: {e}")));
                }
            };
            Ok(Arc::new(Self {
                family,
                cache,
                acceleration: traces.then(|| khr::acceleration_structure::Device::new(&instance.raw, &raw)),
                pipelines: info.ray_pipeline.then(|| khr::ray_tracing_pipeline::Device::new(&instance.raw, &raw)),
                shader_groups: shader_groups(&instance.raw, physical),
                queue: Mutex::new(raw.get_device_queue(family, 0)),
                allocator: Mutex::new(Some(allocator)),
                until_lost: AtomicU64::new(u64::MAX),
                raw,
                info,
                instance,
            }))
        }
    }

    /// What it is.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// What the validation layer has said since the last call; empty without the layer.
    pub fn messages(&self) -> Vec<String> {
        self.instance.messages.as_ref().map(Messages::take).unwrap_or_default()
    }

    /// After the given number of submissions behaves as if the device were lost, the last ones under way: for tests of what is
    /// left then.
    pub fn lose_after(&self, submissions: u64) {
        self.until_lost.store(submissions, Ordering::SeqCst);
    }

    pub(super) fn allocator(&self) -> MutexGuard<'_, Option<Allocator>> {
        self.allocator.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn still_there(&self) -> Result<()> {
        match self.until_lost.load(Ordering::SeqCst) {
            0 => Err(self.failed(vk::Result::ERROR_DEVICE_LOST)),
            _ => Ok(()),
        }
    }

    /// Submits one command buffer that sets the timeline semaphore to `value` when it is done.
    pub(super) fn submit(&self, commands: vk::CommandBuffer, semaphore: vk::Semaphore, value: u64) -> Result<()> {
        self.still_there()?;
        let left = self.until_lost.load(Ordering::SeqCst);
        if left != u64::MAX {
            self.until_lost.store(left - 1, Ordering::SeqCst);
        }
        let (commands, semaphores, values) = ([commands], [semaphore], [value]);
        let mut timeline = vk::TimelineSemaphoreSubmitInfo::default().signal_semaphore_values(&values);
        let submit = vk::SubmitInfo::default()
            .command_buffers(&commands)
            .signal_semaphores(&semaphores)
            .push_next(&mut timeline);
        let queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: the queue is locked; command buffer and semaphore belong to the device and outlive the execution, which
        // their owner waits for.
        unsafe { self.raw.queue_submit(*queue, &[submit], vk::Fence::null()) }.map_err(|e| self.failed(e))
    }

    /// The error that a Vulkan result stands for.
    pub(super) fn failed(&self, result: vk::Result) -> Error {
        let message = match result {
            vk::Result::ERROR_DEVICE_LOST => "the device was lost (reset by its driver, or taken away)".into(),
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => {
                "out of device memory; a smaller film or scene, or fewer samples, fit".into()
            }
            vk::Result::ERROR_OUT_OF_HOST_MEMORY => "out of host memory".into(),
            other => format!("Vulkan error {other}"),
        };
        Error::Device { device: self.info.name.clone(), message }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: buffers, kernels and queues hold an `Arc` of the device, so all are gone. Waiting fails only on a lost
        // device, where nothing runs any more.
        unsafe {
            let _ = self.raw.device_wait_idle();
            *self.allocator() = None;
            self.cache.close(&self.raw);
            self.raw.destroy_device(None);
        }
    }
}

fn choose(devices: Vec<(vk::PhysicalDevice, DeviceInfo)>, which: &Which) -> Result<(vk::PhysicalDevice, DeviceInfo)> {
    let names = devices.iter().map(|(_, i)| format!("{} ({})", i.index, i.name)).collect::<Vec<_>>().join(", ");
    if devices.is_empty() {
        return Err(Error::unavailable("a Vulkan device", "no driver offers one"));
    }
    let named = |name: &str| {
        let name = name.to_lowercase();
        devices.iter().position(|(_, i)| i.name.to_lowercase().contains(&name))
    };
    let found = match which {
        Which::First => {
            let first = devices.iter().position(|(_, i)| i.missing.is_empty()).unwrap_or(0);
            Some(first)
        }
        Which::Index(index) if *index < devices.len() => Some(*index),
        // A number may also be a part of a name.
        Which::Index(index) => named(&index.to_string()),
        Which::Name(name) => named(name),
    };
    let asked = || match which {
        Which::First => "a Vulkan device".into(),
        Which::Index(i) => format!("Vulkan device {i}"),
        Which::Name(n) => format!("Vulkan device '{n}'"),
    };
    let Some(found) = found else { return Err(Error::unavailable(asked(), format!("there are only {names}"))) };
    Ok(devices.into_iter().nth(found).expect("an index into the list"))
}

/// SAFETY: `device` must belong to `instance`.
unsafe fn shader_groups(instance: &ash::Instance, device: vk::PhysicalDevice) -> ShaderGroups {
    let mut groups = vk::PhysicalDeviceRayTracingPipelinePropertiesKHR::default();
    let mut structures = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut groups).push_next(&mut structures);
    // SAFETY: the caller's promise; the chained structures live through the call.
    unsafe { instance.get_physical_device_properties2(device, &mut properties) };
    ShaderGroups {
        handle: groups.shader_group_handle_size.into(),
        alignment: groups.shader_group_handle_alignment.into(),
        base_alignment: groups.shader_group_base_alignment.into(),
        scratch_alignment: structures.min_acceleration_structure_scratch_offset_alignment.into(),
    }
}
