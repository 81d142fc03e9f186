//! Memory on a device.

use super::device::Device;
use crate::error::{Error, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use std::sync::Arc;

/// Where a buffer lives and what moves through it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Use {
    /// Fast memory of the device.
    Device,
    /// Written by the host, read by the device.
    Upload,
    /// Written by the device, read by the host.
    Readback,
}

/// A buffer that shaders reach by its address.
pub(super) struct Buffer {
    device: Arc<Device>,
    pub(super) raw: vk::Buffer,
    allocation: Option<Allocation>,
    /// Device address.
    pub(super) address: u64,
    /// Bytes.
    pub(super) size: u64,
}

impl Buffer {
    /// At least `size` bytes, of undefined content.
    pub(super) fn new(device: &Arc<Device>, size: u64, used: Use) -> Result<Self> {
        // Empty buffers do not exist; 16 keeps every element type aligned.
        let size = size.max(16).next_multiple_of(16);
        let mut usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        if device.acceleration.is_some() {
            usage |= vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR
                | vk::BufferUsageFlags::ACCELERATION_STRUCTURE_STORAGE_KHR;
        }
        if device.pipelines.is_some() {
            usage |= vk::BufferUsageFlags::SHADER_BINDING_TABLE_KHR;
        }
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        let location = match used {
            Use::Device => MemoryLocation::GpuOnly,
            Use::Upload => MemoryLocation::CpuToGpu,
            Use::Readback => MemoryLocation::GpuToCpu,
        };
        // SAFETY: plain creation calls on a live device; the memory is bound once, before any use.
        unsafe {
            let raw = device.raw.create_buffer(&info, None).map_err(|e| device.failed(e))?;
            let mut buffer = Self { device: Arc::clone(device), raw, allocation: None, address: 0, size };
            let mut requirements = device.raw.get_buffer_memory_requirements(raw);
            // What shaders are told of their references.
            requirements.alignment = requirements.alignment.max(16);
            let desc = AllocationCreateDesc {
                name: "buffer",
                requirements,
                location,
                linear: true,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            };
            let allocation = device.allocator().as_mut().expect("it lives as long as the device").allocate(&desc);
            let allocation = allocation.map_err(|e| Error::Device {
                device: device.info.name.clone(),
                message: format!("{size} bytes cannot be had: {e}; a smaller film or scene may fit"),
            })?;
            let bound = device.raw.bind_buffer_memory(raw, allocation.memory(), allocation.offset());
            buffer.allocation = Some(allocation);
            bound.map_err(|e| device.failed(e))?;
            buffer.address = device.raw.get_buffer_device_address(&vk::BufferDeviceAddressInfo::default().buffer(raw));
            Ok(buffer)
        }
    }

    /// What the host sees of it.
    ///
    /// # Panics
    /// For [`Use::Device`].
    pub(super) fn bytes(&self) -> &[u8] {
        let all = self.allocation.as_ref().and_then(Allocation::mapped_slice).expect("host-visible memory");
        &all[..self.size as usize]
    }

    /// The same, to be written.
    ///
    /// # Panics
    /// For [`Use::Device`].
    pub(super) fn bytes_mut(&mut self) -> &mut [u8] {
        let all = self.allocation.as_mut().and_then(Allocation::mapped_slice_mut).expect("host-visible memory");
        &mut all[..self.size as usize]
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: whoever submits work waits for it before dropping what it uses.
        unsafe { self.device.raw.destroy_buffer(self.raw, None) };
        if let (Some(allocation), Some(allocator)) = (self.allocation.take(), self.device.allocator().as_mut()) {
            // Fails only for memory of another allocator.
            let _ = allocator.free(allocation);
        }
    }
}
