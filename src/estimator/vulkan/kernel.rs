//! Kernels: pipelines made from SPIR-V and specialization constants.

use super::buffer::{Buffer, Use};
use super::commands::{Commands, all_before};
use super::device::Device;
use crate::error::Result;
use ash::vk;
use std::sync::Arc;

/// A compute pipeline. What it works on comes by addresses in its push constants.
pub struct Kernel {
    device: Arc<Device>,
    layout: vk::PipelineLayout,
    pipeline: vk::Pipeline,
}

impl Kernel {
    /// From SPIR-V with entry point `main`; `constants` are (id, value) of its specialization constants, `push` the bytes of its
    /// push constants.
    ///
    /// # Errors
    /// What the driver reports.
    ///
    /// # Panics
    /// Where `code` is not a whole number of words.
    pub fn new(device: &Arc<Device>, code: &[u8], constants: &[(u32, u32)], push: u32) -> Result<Self> {
        let code: Vec<u32> = code.chunks(4).map(|w| u32::from_le_bytes(w.try_into().expect("words"))).collect();
        let entries: Vec<_> = constants
            .iter()
            .enumerate()
            .map(|(i, (id, _))| vk::SpecializationMapEntry { constant_id: *id, offset: 4 * i as u32, size: 4 })
            .collect();
        let data: Vec<u8> = constants.iter().flat_map(|(_, value)| value.to_ne_bytes()).collect();
        let specialization = vk::SpecializationInfo::default().map_entries(&entries).data(&data);
        let range =
            [vk::PushConstantRange { stage_flags: vk::ShaderStageFlags::COMPUTE, offset: 0, size: push }];
        let failed = |e| device.failed(e);
        let raw = &device.raw;
        // SAFETY: plain creation calls on a live device; what the structures point to lives through them. The code is made by
        // our build, for the features that the device was opened with.
        unsafe {
            let layout = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&range);
            let layout = raw.create_pipeline_layout(&layout, None).map_err(failed)?;
            let mut kernel = Self { device: Arc::clone(device), layout, pipeline: vk::Pipeline::null() };
            let module = vk::ShaderModuleCreateInfo::default().code(&code);
            let module = raw.create_shader_module(&module, None).map_err(failed)?;
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module)
                .name(c"main")
                .specialization_info(&specialization);
            let info = vk::ComputePipelineCreateInfo::default().layout(layout).stage(stage);
            let made = raw.create_compute_pipelines(device.cache.raw, &[info], None);
            raw.destroy_shader_module(module, None);
            kernel.pipeline = made.map_err(|(_, e)| device.failed(e))?[0];
            Ok(kernel)
        }
    }

    /// Records a dispatch of at least `invocations` invocations, in groups of 64, with push constants.
    pub(super) fn dispatch(&self, commands: vk::CommandBuffer, push: &[u8], invocations: u32) {
        let raw = &self.device.raw;
        // SAFETY: the caller records into a buffer of the same device and keeps alive what `push` names.
        unsafe {
            raw.cmd_bind_pipeline(commands, vk::PipelineBindPoint::COMPUTE, self.pipeline);
            raw.cmd_push_constants(commands, self.layout, vk::ShaderStageFlags::COMPUTE, 0, push);
            raw.cmd_dispatch(commands, invocations.div_ceil(64), 1, 1);
        }
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
pub const TEST_INPUTS: usize = 24;

/// Runs an entry of shaders/test/ once per [`TEST_INPUTS`] words of `inputs`; `outputs` words each come back.
/// `tables` becomes a buffer of its own, in which every word pair at an index in `addresses` is replaced by the address of the
/// buffer made of the given words.
///
/// # Errors
/// What the driver reports.
pub fn run_test(
    device: &Arc<Device>,
    code: &[u8],
    constants: &[(u32, u32)],
    inputs: &[u32],
    outputs: usize,
    tables: &[u32],
    addresses: &[(usize, &[u32])],
) -> Result<Vec<u32>> {
    let count = (inputs.len() / TEST_INPUTS) as u32;
    let kernel = Kernel::new(device, code, constants, 32)?;
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
    let mut words = Vec::with_capacity(size as usize / 4);
    commands.read(&results, size, |_, bytes| words.extend_from_slice(bytemuck::cast_slice(bytes)))?;
    Ok(words)
}
