//! The driver's compiled pipelines, kept on disk between runs.

use ash::vk;
use std::path::PathBuf;

/// Largest file that is read or written, bytes.
const LARGEST: usize = 256 << 20;

const CHECKSUM: usize = 32;

/// A pipeline cache and the file that it comes from.
pub(super) struct PipelineCache {
    pub(super) raw: vk::PipelineCache,
    file: Option<PathBuf>,
    /// Bytes that were read.
    read: usize,
}

impl PipelineCache {
    /// The cache for a device with these properties; an empty one where there is no file, or a damaged one.
    pub(super) fn open(
        device: &ash::Device,
        properties: &vk::PhysicalDeviceProperties,
    ) -> ash::prelude::VkResult<Self> {
        let uuid: String = properties.pipeline_cache_uuid.iter().map(|b| format!("{b:02x}")).collect();
        let name = format!("{:04x}-{:04x}-{uuid}.bin", properties.vendor_id, properties.device_id);
        let file = folder().map(|f| f.join(name));
        let small = |f: &&PathBuf| std::fs::metadata(f).is_ok_and(|m| m.len() <= LARGEST as u64);
        let read = |f: &PathBuf| std::fs::read(f).ok();
        let data = file.as_ref().filter(small).and_then(read).and_then(|b| sound(&b).map(<[u8]>::to_vec));
        let data = data.unwrap_or_default();
        let info = vk::PipelineCacheCreateInfo::default().initial_data(&data);
        // SAFETY: a plain creation call; the data carry our checksum, so they are what the driver gave us once, and it checks
        // by its own header whether they are still of use.
        let raw = unsafe { device.create_pipeline_cache(&info, None) }?;
        Ok(Self { raw, file, read: data.len() })
    }

    /// Writes the file if there is anything new. A cache that cannot be written is only lost time.
    pub(super) fn close(&self, device: &ash::Device) {
        // SAFETY: the cache belongs to the device.
        let data = unsafe { device.get_pipeline_cache_data(self.raw) }.unwrap_or_default();
        if let Some(file) = self.file.as_ref().filter(|_| data.len() != self.read && data.len() <= LARGEST) {
            let checksum = blake3::hash(&data);
            let _ = crate::record::write_quickly(file, &[checksum.as_bytes(), &data]);
        }
        // SAFETY: no pipeline is being made any more.
        unsafe { device.destroy_pipeline_cache(self.raw, None) };
    }
}

/// The data of a cache file whose checksum holds.
fn sound(bytes: &[u8]) -> Option<&[u8]> {
    let (checksum, data) = bytes.split_at_checked(CHECKSUM)?;
    (blake3::hash(data).as_bytes() == checksum).then_some(data)
}

/// Where caches belong on this system.
fn folder() -> Option<PathBuf> {
    let path = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let caches = if cfg!(windows) {
        path("LOCALAPPDATA")
    } else if cfg!(target_os = "macos") {
        path("HOME").map(|home| home.join("Library/Caches"))
    } else {
        path("XDG_CACHE_HOME").or_else(|| path("HOME").map(|home| home.join(".cache")))
    };
    caches.map(|c| c.join("rootn"))
}

#[cfg(test)]
mod tests {
    use super::sound;

    #[test]
    fn damaged_files_are_not_used() {
        let data = b"compiled".as_slice();
        let file = [blake3::hash(data).as_bytes(), data].concat();
        assert_eq!(sound(&file), Some(data));
        for (i, _) in file.iter().enumerate() {
            let mut damaged = file.clone();
            damaged[i] ^= 1;
            assert_eq!(sound(&damaged), None, "byte {i}");
            assert_eq!(sound(&file[..i]), None, "cut at {i}");
        }
    }
}
