//! The on-disk pipeline cache, one file a device and driver version.

use std::path::{Path, PathBuf};

use ash::vk;

use crate::{Error, atomic};

/// A `VkPipelineCache` and where it is kept. A cache that cannot be read or written is not an error: pipelines are then compiled again.
pub(super) struct PipelineCache {
    pub raw: vk::PipelineCache,
    file: Option<PathBuf>,
}

impl PipelineCache {
    /// Opens the cache of the device with this key.
    pub fn open(device: &ash::Device, folder: Option<&Path>, key: &str) -> Self {
        let file = folder.map(|folder| folder.join(format!("pipelines-{key}.bin")));
        let data = file
            .as_ref()
            .and_then(|file| std::fs::read(file).ok())
            .unwrap_or_default();
        let create = |data: &[u8]| {
            let info = vk::PipelineCacheCreateInfo::default().initial_data(data);
            // SAFETY: the driver checks the header of the data against its own UUID and ignores what does not fit.
            unsafe { device.create_pipeline_cache(&info, None) }
        };
        let raw = create(&data)
            .or_else(|_| create(&[]))
            .unwrap_or(vk::PipelineCache::null());
        Self { raw, file }
    }

    /// Writes the cache under a temporary name and renames it, so that a reader never sees half a file.
    pub fn save(&self, device: &ash::Device) {
        let Some(file) = self.file.as_ref().filter(|_| self.raw != vk::PipelineCache::null()) else {
            return;
        };
        // SAFETY: the cache is alive.
        let Ok(data) = (unsafe { device.get_pipeline_cache_data(self.raw) }) else {
            return;
        };
        let made = file
            .parent()
            .map_or(Ok(()), std::fs::create_dir_all)
            .map_err(|error| Error::io(file, error));
        let written = made.and_then(|()| atomic::write_unlinked(file, &data));
        if let Err(error) = written {
            tracing::debug!("pipeline cache {error}");
        }
    }

    /// # Safety
    /// No pipeline may be under construction.
    pub unsafe fn destroy(&self, device: &ash::Device) {
        // SAFETY: see above; a null handle is allowed.
        unsafe { device.destroy_pipeline_cache(self.raw, None) };
    }
}
