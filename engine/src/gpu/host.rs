//! A device that a host application made, and the features that it must have enabled.

use ash::vk;

use super::caps::Caps;
use crate::{Error, Result};

/// A host's Vulkan objects, for [`Gpu::from_host`](super::Gpu::from_host). The host keeps ownership of all of them.
#[derive(Clone)]
pub struct HostDevice {
    /// The loader.
    pub entry: ash::Entry,
    /// The instance.
    pub instance: ash::Instance,
    /// The physical device.
    pub physical_device: vk::PhysicalDevice,
    /// The device.
    pub device: ash::Device,
    /// A queue with compute and transfer (graphics too, if raster passes are wanted).
    pub queue: vk::Queue,
    /// The queue's family.
    pub queue_family: u32,
    /// What the host enabled; what the engine needs is [`EnabledFeatures::REQUIRED`].
    pub enabled: EnabledFeatures,
    /// `VK_EXT_debug_utils` is enabled on the instance.
    pub debug_utils: bool,
}

/// Device features by their Vulkan names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EnabledFeatures {
    /// `VkPhysicalDeviceVulkan13Features::synchronization2`.
    pub synchronization2: bool,
    /// `VkPhysicalDeviceVulkan13Features::dynamicRendering`.
    pub dynamic_rendering: bool,
    /// `VkPhysicalDeviceVulkan12Features::timelineSemaphore`.
    pub timeline_semaphore: bool,
    /// `VkPhysicalDeviceVulkan12Features::scalarBlockLayout`.
    pub scalar_block_layout: bool,
    /// `VkPhysicalDeviceVulkan12Features::hostQueryReset`.
    pub host_query_reset: bool,
    /// What is used where it is enabled, and not missed otherwise.
    pub optional: OptionalFeatures,
}

/// Features that the engine can do without, by their Vulkan names; one that a host did not enable counts as absent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct OptionalFeatures {
    /// `robustBufferAccess`.
    pub robust_buffer_access: bool,
    /// `geometryShader`.
    pub geometry_shader: bool,
    /// `pipelineStatisticsQuery`.
    pub pipeline_statistics_query: bool,
    /// `shaderInt64`.
    pub shader_int64: bool,
    /// `shaderFloat64`.
    pub shader_float64: bool,
    /// `fragmentStoresAndAtomics`.
    pub fragment_stores_and_atomics: bool,
    /// `vertexPipelineStoresAndAtomics`.
    pub vertex_pipeline_stores_and_atomics: bool,
    /// `VkPhysicalDeviceVulkan12Features::shaderBufferInt64Atomics`.
    pub shader_buffer_int64_atomics: bool,
    /// `VK_KHR_ray_query` with its feature.
    pub ray_query: bool,
    /// `runtimeDescriptorArray` and `shaderSampledImageArrayNonUniformIndexing`.
    pub descriptor_indexing: bool,
}

impl OptionalFeatures {
    /// Nothing enabled.
    pub const NONE: Self = Self {
        robust_buffer_access: false,
        geometry_shader: false,
        pipeline_statistics_query: false,
        shader_int64: false,
        shader_float64: false,
        fragment_stores_and_atomics: false,
        vertex_pipeline_stores_and_atomics: false,
        shader_buffer_int64_atomics: false,
        ray_query: false,
        descriptor_indexing: false,
    };
}

impl EnabledFeatures {
    /// What every `Gpu` needs.
    pub const REQUIRED: Self = Self {
        synchronization2: true,
        dynamic_rendering: true,
        timeline_semaphore: true,
        scalar_block_layout: true,
        host_query_reset: true,
        optional: OptionalFeatures::NONE,
    };

    /// Nothing enabled.
    pub const NONE: Self = Self {
        synchronization2: false,
        dynamic_rendering: false,
        timeline_semaphore: false,
        scalar_block_layout: false,
        host_query_reset: false,
        optional: OptionalFeatures::NONE,
    };

    /// Takes away what the host did not enable.
    pub(super) fn restrict(&self, caps: &mut Caps) {
        let optional = &self.optional;
        caps.robust_buffer_access &= optional.robust_buffer_access;
        caps.geometry_shader &= optional.geometry_shader;
        caps.pipeline_statistics &= optional.pipeline_statistics_query;
        caps.int64 &= optional.shader_int64;
        caps.float64 &= optional.shader_float64;
        caps.fragment_stores &= optional.fragment_stores_and_atomics;
        caps.vertex_stores &= optional.vertex_pipeline_stores_and_atomics;
        caps.int64_atomics &= optional.shader_buffer_int64_atomics;
        caps.ray_query &= optional.ray_query;
        caps.descriptor_indexing &= optional.descriptor_indexing;
    }

    /// The required features that a physical device offers.
    pub(super) fn offered(instance: &ash::Instance, device: vk::PhysicalDevice) -> Self {
        let mut vulkan12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut vulkan13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut features = vk::PhysicalDeviceFeatures2::default()
            .push_next(&mut vulkan12)
            .push_next(&mut vulkan13);
        // SAFETY: the device belongs to the instance; the chain lives on this stack.
        unsafe { instance.get_physical_device_features2(device, &mut features) };
        Self {
            synchronization2: vulkan13.synchronization2 != 0,
            dynamic_rendering: vulkan13.dynamic_rendering != 0,
            timeline_semaphore: vulkan12.timeline_semaphore != 0,
            scalar_block_layout: vulkan12.scalar_block_layout != 0,
            host_query_reset: vulkan12.host_query_reset != 0,
            optional: OptionalFeatures::NONE,
        }
    }

    /// Fails with the first required feature that is off.
    pub(super) fn check(&self, device: &str, instead: &str) -> Result<()> {
        let required = [
            (self.synchronization2, "synchronization2"),
            (self.dynamic_rendering, "dynamicRendering"),
            (self.timeline_semaphore, "timelineSemaphore"),
            (self.scalar_block_layout, "scalarBlockLayout"),
            (self.host_query_reset, "hostQueryReset"),
        ];
        match required.iter().find(|(on, _)| !on) {
            None => Ok(()),
            Some((_, name)) => Err(Error::MissingFeature {
                feature: (*name).into(),
                needed_by: "the engine".into(),
                device: device.into(),
                instead: instead.into(),
            }),
        }
    }
}
