//! Command buffers, submitted in order and waited for by a timeline semaphore.

use super::buffer::{Buffer, Use};
use super::device::Device;
use crate::error::Result;
use ash::vk;
use bytemuck::Pod;
use std::sync::Arc;

/// Bytes that move between host and device at a time.
const CHUNK: u64 = 64 << 20;

/// A stream of work on a device.
pub(super) struct Commands {
    device: Arc<Device>,
    pool: vk::CommandPool,
    semaphore: vk::Semaphore,
    /// The semaphore's value once everything submitted is done.
    submitted: u64,
}

impl Commands {
    pub(super) fn new(device: &Arc<Device>) -> Result<Self> {
        let pool = vk::CommandPoolCreateInfo::default()
            .queue_family_index(device.family)
            .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let semaphore = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: plain creation calls on a live device.
        unsafe {
            let pool = device.raw.create_command_pool(&pool, None).map_err(|e| device.failed(e))?;
            let semaphore = device.raw.create_semaphore(&semaphore, None).map_err(|e| {
                device.raw.destroy_command_pool(pool, None);
                device.failed(e)
            })?;
            Ok(Self { device: Arc::clone(device), pool, semaphore, submitted: 0 })
        }
    }

    /// A command buffer, to be recorded again and again; it lives as long as the stream.
    pub(super) fn buffer(&mut self) -> Result<vk::CommandBuffer> {
        let info = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
        // SAFETY: the pool belongs to the device.
        let buffers = unsafe { self.device.raw.allocate_command_buffers(&info) };
        Ok(buffers.map_err(|e| self.device.failed(e))?[0])
    }

    /// Records and submits; the value to [`Self::wait`] for. `buffer` must not be in use.
    pub(super) fn submit(
        &mut self,
        buffer: vk::CommandBuffer,
        record: impl FnOnce(&ash::Device, vk::CommandBuffer),
    ) -> Result<u64> {
        let raw = &self.device.raw;
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the buffer is of our pool and, as the caller says, not in use.
        unsafe {
            raw.begin_command_buffer(buffer, &begin).map_err(|e| self.device.failed(e))?;
            record(raw, buffer);
            raw.end_command_buffer(buffer).map_err(|e| self.device.failed(e))?;
        }
        self.device.submit(buffer, self.semaphore, self.submitted + 1)?;
        self.submitted += 1;
        Ok(self.submitted)
    }

    /// Waits until what [`Self::submit`] gave `value` for is done.
    pub(super) fn wait(&self, value: u64) -> Result<()> {
        let (semaphores, values) = ([self.semaphore], [value]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the semaphore is a timeline semaphore of the device.
        unsafe { self.device.raw.wait_semaphores(&info, u64::MAX) }.map_err(|e| self.device.failed(e))?;
        self.device.still_there()
    }

    /// Records, submits and waits.
    pub(super) fn once(&mut self, record: impl FnOnce(&ash::Device, vk::CommandBuffer)) -> Result<()> {
        let buffer = self.buffer()?;
        let done = self.submit(buffer, record).and_then(|value| self.wait(value));
        if done.is_ok() {
            // SAFETY: the buffer is of our pool and no longer in use.
            unsafe { self.device.raw.free_command_buffers(self.pool, &[buffer]) };
        }
        done
    }

    /// A device buffer with this content.
    pub(super) fn upload(&mut self, bytes: &[u8]) -> Result<Buffer> {
        let buffer = Buffer::new(&self.device, bytes.len() as u64, Use::Device)?;
        self.write(&buffer, bytes)?;
        Ok(buffer)
    }

    /// Replaces the first bytes of a device buffer.
    pub(super) fn write(&mut self, to: &Buffer, bytes: &[u8]) -> Result<()> {
        if bytes.is_empty() {
            return Ok(());
        }
        let mut staging = Buffer::new(&self.device, (bytes.len() as u64).min(CHUNK), Use::Upload)?;
        for (i, chunk) in bytes.chunks(CHUNK as usize).enumerate() {
            staging.bytes_mut()[..chunk.len()].copy_from_slice(chunk);
            let region = vk::BufferCopy { src_offset: 0, dst_offset: i as u64 * CHUNK, size: chunk.len() as u64 };
            self.copy(&staging, to, region)?;
        }
        Ok(())
    }

    /// The first `count` values of a device buffer.
    pub(super) fn read<T: Pod>(&mut self, from: &Buffer, count: usize) -> Result<Vec<T>> {
        let mut values = vec![T::zeroed(); count];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut values);
        let staging = Buffer::new(&self.device, (bytes.len() as u64).min(CHUNK), Use::Readback)?;
        for (i, chunk) in bytes.chunks_mut(CHUNK as usize).enumerate() {
            let region = vk::BufferCopy { src_offset: i as u64 * CHUNK, dst_offset: 0, size: chunk.len() as u64 };
            self.copy(from, &staging, region)?;
            chunk.copy_from_slice(&staging.bytes()[..chunk.len()]);
        }
        Ok(values)
    }

    fn copy(&mut self, from: &Buffer, to: &Buffer, region: vk::BufferCopy) -> Result<()> {
        self.once(|raw, commands| {
            all_before(raw, commands);
            // SAFETY: both buffers live until the copy is waited for, and hold the region.
            unsafe { raw.cmd_copy_buffer(commands, from.raw, to.raw, &[region]) };
            all_before(raw, commands);
        })
    }
}

impl Drop for Commands {
    fn drop(&mut self) {
        // A lost device has nothing under way.
        let _ = self.wait(self.submitted);
        // SAFETY: nothing that was submitted is under way.
        unsafe {
            self.device.raw.destroy_semaphore(self.semaphore, None);
            self.device.raw.destroy_command_pool(self.pool, None);
        }
    }
}

/// A query pool.
pub(super) struct Queries {
    device: Arc<Device>,
    pub(super) raw: vk::QueryPool,
}

impl Queries {
    pub(super) fn new(device: &Arc<Device>, kind: vk::QueryType, count: u32) -> Result<Self> {
        let info = vk::QueryPoolCreateInfo::default().query_type(kind).query_count(count);
        // SAFETY: a plain creation call.
        let raw = unsafe { device.raw.create_query_pool(&info, None) }.map_err(|e| device.failed(e))?;
        Ok(Self { device: Arc::clone(device), raw })
    }

    /// All results; what writes them must have been submitted.
    pub(super) fn results<const N: usize>(&self) -> Result<[u64; N]> {
        let mut results = [0; N];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: the pool belongs to the device.
        unsafe { self.device.raw.get_query_pool_results(self.raw, 0, &mut results, flags) }
            .map_err(|e| self.device.failed(e))?;
        Ok(results)
    }
}

impl Drop for Queries {
    fn drop(&mut self) {
        // SAFETY: whoever submits what writes them waits for it first.
        unsafe { self.device.raw.destroy_query_pool(self.raw, None) };
    }
}

/// Everything after this sees everything that was written before, on the device and by it for the host.
pub(super) fn all_before(raw: &ash::Device, commands: vk::CommandBuffer) {
    let barrier = vk::MemoryBarrier::default()
        .src_access_mask(vk::AccessFlags::MEMORY_WRITE)
        .dst_access_mask(vk::AccessFlags::MEMORY_READ | vk::AccessFlags::MEMORY_WRITE);
    let all = vk::PipelineStageFlags::ALL_COMMANDS;
    let to = all | vk::PipelineStageFlags::HOST;
    let none = vk::DependencyFlags::empty();
    // SAFETY: the buffer is being recorded.
    unsafe { raw.cmd_pipeline_barrier(commands, all, to, none, &[barrier], &[], &[]) };
}
