//! Kernels: pipelines made from SPIR-V and specialization constants.

use super::buffer::{Buffer, Use};
use super::commands::{Commands, all_before};
use super::device::Device;
use crate::error::Result;
use ash::vk;
use std::sync::Arc;

/// A compute or ray-tracing pipeline. What it works on comes by addresses in its push constants.
pub struct Kernel {
    device: Arc<Device>,
    layout: vk::PipelineLayout,
    pipeline: vk::Pipeline,
    stages: vk::ShaderStageFlags,
    /// Of ray-tracing pipelines.
    table: Option<BindingTable>,
}

/// Where the stages of a ray-tracing pipeline find one another.
struct BindingTable {
    _buffer: Buffer,
    ray_generation: vk::StridedDeviceAddressRegionKHR,
    miss: vk::StridedDeviceAddressRegionKHR,
    hit: vk::StridedDeviceAddressRegionKHR,
}

/// SPIR-V of the stages of a ray-tracing pipeline, each with entry point `main`.
pub(super) struct RayStages<'a> {
    pub(super) generation: &'a [u8],
    pub(super) miss: &'a [u8],
    pub(super) any_hit: &'a [u8],
    pub(super) closest_hit: &'a [u8],
    pub(super) quadric_hit: &'a [u8],
    pub(super) intersection: &'a [u8],
}

/// Specialization constants as Vulkan wants them.
struct Constants {
    entries: Vec<vk::SpecializationMapEntry>,
    data: Vec<u8>,
}

impl Constants {
    fn new(constants: &[(u32, u32)]) -> Self {
        let entry = |(i, (id, _)): (usize, &(u32, u32))| vk::SpecializationMapEntry {
            constant_id: *id,
            offset: 4 * i as u32,
            size: 4,
        };
        Self {
            entries: constants.iter().enumerate().map(entry).collect(),
            data: constants.iter().flat_map(|(_, value)| value.to_ne_bytes()).collect(),
        }
    }

    fn info(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default().map_entries(&self.entries).data(&self.data)
    }
}

/// A shader module that goes when the pipeline is made.
struct Module<'a> {
    device: &'a Device,
    raw: vk::ShaderModule,
}

impl<'a> Module<'a> {
    /// # Safety
    /// As for [`Kernel::new`].
    unsafe fn new(device: &'a Device, code: &[u8]) -> Result<Self> {
        let code: Vec<u32> = code.chunks(4).map(|w| u32::from_le_bytes(w.try_into().expect("words"))).collect();
        let info = vk::ShaderModuleCreateInfo::default().code(&code);
        // SAFETY: the caller's promise.
        let raw = unsafe { device.raw.create_shader_module(&info, None) }.map_err(|e| device.failed(e))?;
        Ok(Self { device, raw })
    }

    fn stage<'b>(
        &self,
        stage: vk::ShaderStageFlags,
        constants: &'b vk::SpecializationInfo<'b>,
    ) -> vk::PipelineShaderStageCreateInfo<'b> {
        let info = vk::PipelineShaderStageCreateInfo::default().stage(stage).module(self.raw).name(c"main");
        info.specialization_info(constants)
    }
}

impl Drop for Module<'_> {
    fn drop(&mut self) {
        // SAFETY: no pipeline is being made from it.
        unsafe { self.device.raw.destroy_shader_module(self.raw, None) };
    }
}

impl Kernel {
    /// A compute pipeline from SPIR-V with entry point `main`; `constants` are (id, value) of its specialization constants,
    /// `push` the bytes of its push constants.
    ///
    /// # Errors
    /// What the driver reports.
    ///
    /// # Panics
    /// Where `code` is not a whole number of words.
    ///
    /// # Safety
    /// `code` must be valid, for a device with the features that [`Device::open`] asks for.
    pub unsafe fn new(device: &Arc<Device>, code: &[u8], constants: &[(u32, u32)], push: u32) -> Result<Self> {
        let mut kernel = Self::without_pipeline(device, vk::ShaderStageFlags::COMPUTE, push)?;
        // SAFETY: the caller's promise.
        let module = unsafe { Module::new(device, code) }?;
        let constants = Constants::new(constants);
        let constants = constants.info();
        let stage = module.stage(vk::ShaderStageFlags::COMPUTE, &constants);
        let info = vk::ComputePipelineCreateInfo::default().layout(kernel.layout).stage(stage);
        // SAFETY: what the structures point to lives through the call.
        let made = unsafe { device.raw.create_compute_pipelines(device.cache.raw, &[info], None) };
        kernel.pipeline = made.map_err(|(_, e)| device.failed(e))?[0];
        Ok(kernel)
    }

    /// A ray-tracing pipeline: hit group 0 for triangles, 1 for what has an intersection shader. `commands` fill its table.
    ///
    /// # Safety
    /// As for [`Self::new`].
    pub(super) unsafe fn rays(
        device: &Arc<Device>,
        commands: &mut Commands,
        code: &RayStages<'_>,
        constants: &[(u32, u32)],
        push: u32,
    ) -> Result<Self> {
        use vk::ShaderStageFlags as Stage;
        let all = Stage::RAYGEN_KHR | Stage::MISS_KHR | Stage::ANY_HIT_KHR | Stage::CLOSEST_HIT_KHR;
        let mut kernel = Self::without_pipeline(device, all | Stage::INTERSECTION_KHR, push)?;
        // SAFETY: the caller's promise.
        let module = |code| unsafe { Module::new(device, code) };
        let parts = [
            (Stage::RAYGEN_KHR, module(code.generation)?),
            (Stage::MISS_KHR, module(code.miss)?),
            (Stage::ANY_HIT_KHR, module(code.any_hit)?),
            (Stage::CLOSEST_HIT_KHR, module(code.closest_hit)?),
            (Stage::CLOSEST_HIT_KHR, module(code.quadric_hit)?),
            (Stage::INTERSECTION_KHR, module(code.intersection)?),
        ];
        let constants = Constants::new(constants);
        let constants = constants.info();
        let stages = parts.each_ref().map(|(stage, module)| module.stage(*stage, &constants));
        let unused = vk::SHADER_UNUSED_KHR;
        let group = |kind, general, any, closest, intersection| {
            vk::RayTracingShaderGroupCreateInfoKHR::default()
                .ty(kind)
                .general_shader(general)
                .any_hit_shader(any)
                .closest_hit_shader(closest)
                .intersection_shader(intersection)
        };
        let groups = [
            group(vk::RayTracingShaderGroupTypeKHR::GENERAL, 0, unused, unused, unused),
            group(vk::RayTracingShaderGroupTypeKHR::GENERAL, 1, unused, unused, unused),
            group(vk::RayTracingShaderGroupTypeKHR::TRIANGLES_HIT_GROUP, unused, 2, 3, unused),
            group(vk::RayTracingShaderGroupTypeKHR::PROCEDURAL_HIT_GROUP, unused, unused, 4, 5),
        ];
        let info = vk::RayTracingPipelineCreateInfoKHR::default()
            .layout(kernel.layout)
            .stages(&stages)
            .groups(&groups)
            .max_pipeline_ray_recursion_depth(1);
        let f = device.pipelines.as_ref().expect("the traversal was checked to be available");
        let size = device.shader_groups.handle;
        // SAFETY: what the structures point to lives through the calls.
        let handles = unsafe {
            let made =
                f.create_ray_tracing_pipelines(vk::DeferredOperationKHR::null(), device.cache.raw, &[info], None);
            kernel.pipeline = made.map_err(|(_, e)| device.failed(e))?[0];
            f.get_ray_tracing_shader_group_handles(kernel.pipeline, 0, 4, 4 * size as usize)
        };
        kernel.table = Some(BindingTable::new(device, commands, &handles.map_err(|e| device.failed(e))?)?);
        Ok(kernel)
    }

    fn without_pipeline(device: &Arc<Device>, stages: vk::ShaderStageFlags, push: u32) -> Result<Self> {
        let range = [vk::PushConstantRange { stage_flags: stages, offset: 0, size: push }];
        let layout = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&range);
        // SAFETY: a plain creation call.
        let layout = unsafe { device.raw.create_pipeline_layout(&layout, None) }.map_err(|e| device.failed(e))?;
        Ok(Self { device: Arc::clone(device), layout, pipeline: vk::Pipeline::null(), stages, table: None })
    }

    /// Records a dispatch with push constants: of exactly `invocations` rays, or in groups of 64 of at least as many invocations.
    pub(super) fn dispatch(&self, commands: vk::CommandBuffer, push: &[u8], invocations: u32) {
        let raw = &self.device.raw;
        let point = match self.table {
            None => vk::PipelineBindPoint::COMPUTE,
            Some(_) => vk::PipelineBindPoint::RAY_TRACING_KHR,
        };
        // SAFETY: the caller records into a buffer of the same device and keeps alive what `push` names.
        unsafe {
            raw.cmd_bind_pipeline(commands, point, self.pipeline);
            raw.cmd_push_constants(commands, self.layout, self.stages, 0, push);
            match (&self.table, &self.device.pipelines) {
                (Some(t), Some(f)) => {
                    let callable = vk::StridedDeviceAddressRegionKHR::default();
                    f.cmd_trace_rays(commands, &t.ray_generation, &t.miss, &t.hit, &callable, invocations, 1, 1);
                }
                _ => raw.cmd_dispatch(commands, invocations.div_ceil(64), 1, 1),
            }
        }
    }
}

impl BindingTable {
    /// From the handles of ray generation, miss and two hit groups.
    fn new(device: &Arc<Device>, commands: &mut Commands, handles: &[u8]) -> Result<Self> {
        let groups = &device.shader_groups;
        let stride = groups.handle.next_multiple_of(groups.alignment);
        let region = (2 * stride).next_multiple_of(groups.base_alignment);
        // The buffer's own address may be off by less than the alignment.
        let buffer = Buffer::new(device, 3 * region + groups.base_alignment, Use::Device)?;
        let start = buffer.address.next_multiple_of(groups.base_alignment) - buffer.address;
        let mut bytes = vec![0; (start + 3 * region) as usize];
        let size = groups.handle as usize;
        for (i, handle) in handles.chunks_exact(size).enumerate() {
            let at = start + [0, region, 2 * region, 2 * region + stride][i];
            bytes[at as usize..][..size].copy_from_slice(handle);
        }
        commands.write(&buffer, &bytes)?;
        let part = |at: u64, entries: u64| vk::StridedDeviceAddressRegionKHR {
            device_address: buffer.address + start + at,
            stride,
            size: entries * stride,
        };
        Ok(Self { ray_generation: part(0, 1), miss: part(region, 1), hit: part(2 * region, 2), _buffer: buffer })
    }
}

impl Drop for Kernel {
    fn drop(&mut self) {
        // SAFETY: whoever submits dispatches waits for them before dropping the kernel.
        unsafe {
            self.device.raw.destroy_pipeline(self.pipeline, None);
            self.device.raw.destroy_pipeline_layout(self.layout, None);
        }
    }
}

/// Words that a test kernel reads per invocation.
pub const TEST_INPUTS: usize = 28;

/// Runs an entry of shaders/test/ once per [`TEST_INPUTS`] words of `inputs`; `outputs` words each come back.
/// `tables` becomes a buffer of its own, in which every word pair at an index in `addresses` is replaced by the address of the
/// buffer made of the given words.
///
/// # Errors
/// What the driver reports.
///
/// # Safety
/// As for [`Kernel::new`]; `code` must read and write no more than this.
#[doc(hidden)]
pub unsafe fn run_test(
    device: &Arc<Device>,
    code: &[u8],
    constants: &[(u32, u32)],
    inputs: &[u32],
    outputs: usize,
    tables: &[u32],
    addresses: &[(usize, &[u32])],
) -> Result<Vec<u32>> {
    let count = (inputs.len() / TEST_INPUTS) as u32;
    // SAFETY: the caller's promise.
    let kernel = unsafe { Kernel::new(device, code, constants, 32) }?;
    let mut commands = Commands::new(device)?;
    let mut tables = tables.to_vec();
    let mut kept = Vec::new();
    for (at, words) in addresses {
        let buffer = commands.upload(bytemuck::cast_slice(words))?;
        tables[*at] = buffer.address as u32;
        tables[at + 1] = (buffer.address >> 32) as u32;
        kept.push(buffer);
    }
    let tables = commands.upload(bytemuck::cast_slice(&tables))?;
    let inputs = commands.upload(bytemuck::cast_slice(inputs))?;
    let size = u64::from(count) * 4 * outputs as u64;
    let results = Buffer::new(device, size, Use::Device)?;
    let push = [inputs.address, results.address, count.into(), tables.address];
    commands.once(|raw, c| {
        all_before(raw, c);
        kernel.dispatch(c, bytemuck::cast_slice(&push), count);
        all_before(raw, c);
    })?;
    commands.read(&results, count as usize * outputs)
}
