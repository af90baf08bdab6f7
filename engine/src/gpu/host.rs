//! A device that a host application made, and the features that it must have enabled.

use ash::vk;

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
}

impl EnabledFeatures {
    /// What every `Gpu` needs.
    pub const REQUIRED: Self = Self {
        synchronization2: true,
        dynamic_rendering: true,
        timeline_semaphore: true,
        scalar_block_layout: true,
        host_query_reset: true,
    };

    /// Nothing enabled.
    pub const NONE: Self = Self {
        synchronization2: false,
        dynamic_rendering: false,
        timeline_semaphore: false,
        scalar_block_layout: false,
        host_query_reset: false,
    };

    /// What a physical device offers.
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
