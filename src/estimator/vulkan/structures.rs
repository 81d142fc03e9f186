//! Acceleration structures of the driver: one over the triangles, one over the quadrics' boxes, and one over both.

use super::buffer::{Buffer, Use};
use super::commands::{Commands, Queries, all_before};
use super::device::Device;
use crate::error::Result;
use ash::{khr, vk};
use std::sync::Arc;

/// What is to be intersected: device buffers in the order of the scene.
pub(super) struct Geometry<'a> {
    /// Positions of vertices, three f32 each; their number.
    pub(super) positions: (&'a Buffer, u32),
    /// Three indices for each triangle; the number of triangles.
    pub(super) triangles: (&'a Buffer, u32),
    /// Lower and upper corner for each quadric; their number.
    pub(super) boxes: (&'a Buffer, u32),
}

/// One acceleration structure with its memory.
struct Structure {
    device: Arc<Device>,
    raw: vk::AccelerationStructureKHR,
    address: u64,
    // Dropped after the structure in it.
    _buffer: Buffer,
}

/// The scene as the driver traces it.
pub(super) struct Structures {
    _bottom: Vec<Structure>,
    top: Structure,
    _instances: Buffer,
}

impl Structures {
    /// Builds and compacts.
    pub(super) fn new(device: &Arc<Device>, commands: &mut Commands, geometry: &Geometry<'_>) -> Result<Self> {
        let (vertices, count) = geometry.positions;
        let address = |b: &Buffer| vk::DeviceOrHostAddressConstKHR { device_address: b.address };
        let mut bottom = Vec::new();
        if geometry.triangles.1 > 0 {
            let triangles = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
                .vertex_format(vk::Format::R32G32B32_SFLOAT)
                .vertex_data(address(vertices))
                .vertex_stride(12)
                .max_vertex(count.saturating_sub(1))
                .index_type(vk::IndexType::UINT32)
                .index_data(address(geometry.triangles.0));
            let data = vk::AccelerationStructureGeometryDataKHR { triangles };
            let structure = lower(device, commands, vk::GeometryTypeKHR::TRIANGLES, data, geometry.triangles.1)?;
            bottom.push((structure, 0));
        }
        if geometry.boxes.1 > 0 {
            let aabbs =
                vk::AccelerationStructureGeometryAabbsDataKHR::default().data(address(geometry.boxes.0)).stride(24);
            let data = vk::AccelerationStructureGeometryDataKHR { aabbs };
            let structure = lower(device, commands, vk::GeometryTypeKHR::AABBS, data, geometry.boxes.1)?;
            bottom.push((structure, 1));
        }
        let instances: Vec<_> = bottom.iter().map(|(s, group)| instance(s, *group)).collect();
        // SAFETY: the structure is plain C data without padding that matters.
        let bytes =
            unsafe { std::slice::from_raw_parts(instances.as_ptr().cast::<u8>(), size_of_val::<[_]>(&instances[..])) };
        let buffer = commands.upload(bytes)?;
        let data = vk::AccelerationStructureGeometryDataKHR {
            instances: vk::AccelerationStructureGeometryInstancesDataKHR::default().data(address(&buffer)),
        };
        let geometry = vk::AccelerationStructureGeometryKHR::default()
            .geometry_type(vk::GeometryTypeKHR::INSTANCES)
            .geometry(data);
        let kind = vk::AccelerationStructureTypeKHR::TOP_LEVEL;
        let flags = vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE;
        let top = build(device, commands, kind, flags, geometry, instances.len() as u32)?;
        Ok(Self { _bottom: bottom.into_iter().map(|(s, _)| s).collect(), top, _instances: buffer })
    }

    /// Device address of the structure over everything.
    pub(super) fn address(&self) -> u64 {
        self.top.address
    }
}

fn functions(device: &Device) -> &khr::acceleration_structure::Device {
    device.acceleration.as_ref().expect("the traversal was checked to be available")
}

/// One instance without transformation, whose hits go to the hit group `group`.
fn instance(structure: &Structure, group: u32) -> vk::AccelerationStructureInstanceKHR {
    let mut matrix = [0.0; 12];
    (matrix[0], matrix[5], matrix[10]) = (1.0, 1.0, 1.0);
    let flags = vk::GeometryInstanceFlagsKHR::TRIANGLE_FACING_CULL_DISABLE.as_raw() as u8;
    vk::AccelerationStructureInstanceKHR {
        transform: vk::TransformMatrixKHR { matrix },
        instance_custom_index_and_mask: vk::Packed24_8::new(0, 0xFF),
        instance_shader_binding_table_record_offset_and_flags: vk::Packed24_8::new(group, flags),
        acceleration_structure_reference: vk::AccelerationStructureReferenceKHR { device_handle: structure.address },
    }
}

/// A structure over primitives, compacted.
fn lower(
    device: &Arc<Device>,
    commands: &mut Commands,
    kind: vk::GeometryTypeKHR,
    data: vk::AccelerationStructureGeometryDataKHR<'_>,
    count: u32,
) -> Result<Structure> {
    // Not opaque: triangles that a ray starts or ends on are sorted out one by one, none of them twice.
    let geometry = vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(kind)
        .geometry(data)
        .flags(vk::GeometryFlagsKHR::NO_DUPLICATE_ANY_HIT_INVOCATION);
    let level = vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL;
    let flags = vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE
        | vk::BuildAccelerationStructureFlagsKHR::ALLOW_COMPACTION;
    let large = build(device, commands, level, flags, geometry, count)?;
    let query = vk::QueryType::ACCELERATION_STRUCTURE_COMPACTED_SIZE_KHR;
    let size = Queries::new(device, query, 1)?;
    let f = functions(device);
    // SAFETY: both structures and the pool live until what uses them is waited for.
    unsafe {
        commands.once(|raw, c| {
            raw.cmd_reset_query_pool(c, size.raw, 0, 1);
            all_before(raw, c);
            f.cmd_write_acceleration_structures_properties(c, &[large.raw], query, size.raw, 0);
        })?;
        let [size] = size.results()?;
        let small = Structure::new(device, level, size)?;
        let copy = vk::CopyAccelerationStructureInfoKHR::default()
            .src(large.raw)
            .dst(small.raw)
            .mode(vk::CopyAccelerationStructureModeKHR::COMPACT);
        commands.once(|raw, c| {
            all_before(raw, c);
            f.cmd_copy_acceleration_structure(c, &copy);
            all_before(raw, c);
        })?;
        Ok(small)
    }
}

fn build(
    device: &Arc<Device>,
    commands: &mut Commands,
    kind: vk::AccelerationStructureTypeKHR,
    flags: vk::BuildAccelerationStructureFlagsKHR,
    geometry: vk::AccelerationStructureGeometryKHR<'_>,
    count: u32,
) -> Result<Structure> {
    let geometries = [geometry];
    let mut info = vk::AccelerationStructureBuildGeometryInfoKHR::default()
        .ty(kind)
        .flags(flags)
        .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
        .geometries(&geometries);
    let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
    let f = functions(device);
    // SAFETY: all buffers that the geometry names, and the scratch memory, live until the build is waited for.
    unsafe {
        let on_device = vk::AccelerationStructureBuildTypeKHR::DEVICE;
        f.get_acceleration_structure_build_sizes(on_device, &info, &[count], &mut sizes);
        let structure = Structure::new(device, kind, sizes.acceleration_structure_size)?;
        let alignment = device.shader_groups.scratch_alignment.max(1);
        let scratch = Buffer::new(device, sizes.build_scratch_size + alignment, Use::Device)?;
        info.dst_acceleration_structure = structure.raw;
        info.scratch_data = vk::DeviceOrHostAddressKHR { device_address: scratch.address.next_multiple_of(alignment) };
        let range = [vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(count)];
        commands.once(|raw, c| {
            all_before(raw, c);
            f.cmd_build_acceleration_structures(c, &[info], &[&range]);
            all_before(raw, c);
        })?;
        Ok(structure)
    }
}

impl Structure {
    fn new(device: &Arc<Device>, kind: vk::AccelerationStructureTypeKHR, size: u64) -> Result<Self> {
        // Offsets of structures in buffers must be multiples of 256: at 0 they are.
        let buffer = Buffer::new(device, size, Use::Device)?;
        let info = vk::AccelerationStructureCreateInfoKHR::default().buffer(buffer.raw).size(size).ty(kind);
        let f = functions(device);
        // SAFETY: the buffer is large enough and kept beside the structure.
        unsafe {
            let raw = f.create_acceleration_structure(&info, None).map_err(|e| device.failed(e))?;
            let address = vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(raw);
            let address = f.get_acceleration_structure_device_address(&address);
            Ok(Self { device: Arc::clone(device), raw, address, _buffer: buffer })
        }
    }
}

impl Drop for Structure {
    fn drop(&mut self) {
        // SAFETY: nothing that traces it is under way; the buffer goes after it.
        unsafe { functions(&self.device).destroy_acceleration_structure(self.raw, None) };
    }
}
