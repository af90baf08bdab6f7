//! A device that a host application made, and the features that it must have enabled.

use std::ffi::CStr;

use ash::{khr, vk};

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
    /// What the host enabled; what the engine needs is [`EnabledFeatures::REQUIRED`]. A host that creates its device with
    /// [`EnabledFeatures::to_vulkan`] cannot get the two apart, one that fills the Vulkan structs itself has
    /// [`EnabledFeatures::from_vulkan`].
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

/// The extensions of [`OptionalFeatures::ray_query`].
pub const RAY_QUERY_EXTENSIONS: [&CStr; 3] = [
    khr::acceleration_structure::NAME,
    khr::deferred_host_operations::NAME,
    khr::ray_query::NAME,
];

/// Features that the engine can do without, by their Vulkan names; one that a host did not enable counts as absent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct OptionalFeatures {
    /// `robustBufferAccess`.
    pub robust_buffer_access: bool,
    /// `geometryShader`.
    pub geometry_shader: bool,
    /// `shaderClipDistance`.
    pub shader_clip_distance: bool,
    /// `VkPhysicalDeviceVulkan11Features::multiview`.
    pub multiview: bool,
    /// `VK_EXT_shader_viewport_index_layer` with `shaderOutputLayer` and `shaderOutputViewportIndex`.
    pub shader_viewport_index_layer: bool,
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
    /// The [`RAY_QUERY_EXTENSIONS`] with `rayQuery`, `accelerationStructure` and `bufferDeviceAddress`.
    pub ray_query: bool,
    /// `runtimeDescriptorArray` and `shaderSampledImageArrayNonUniformIndexing`.
    pub descriptor_indexing: bool,
    /// `VkPhysicalDeviceVulkan13Features::computeFullSubgroups`.
    pub compute_full_subgroups: bool,
}

impl OptionalFeatures {
    /// Nothing enabled.
    pub const NONE: Self = Self {
        robust_buffer_access: false,
        geometry_shader: false,
        shader_clip_distance: false,
        multiview: false,
        shader_viewport_index_layer: false,
        pipeline_statistics_query: false,
        shader_int64: false,
        shader_float64: false,
        fragment_stores_and_atomics: false,
        vertex_pipeline_stores_and_atomics: false,
        shader_buffer_int64_atomics: false,
        ray_query: false,
        descriptor_indexing: false,
        compute_full_subgroups: false,
    };

    /// What is in both.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            robust_buffer_access: self.robust_buffer_access && other.robust_buffer_access,
            geometry_shader: self.geometry_shader && other.geometry_shader,
            shader_clip_distance: self.shader_clip_distance && other.shader_clip_distance,
            multiview: self.multiview && other.multiview,
            shader_viewport_index_layer: self.shader_viewport_index_layer && other.shader_viewport_index_layer,
            pipeline_statistics_query: self.pipeline_statistics_query && other.pipeline_statistics_query,
            shader_int64: self.shader_int64 && other.shader_int64,
            shader_float64: self.shader_float64 && other.shader_float64,
            fragment_stores_and_atomics: self.fragment_stores_and_atomics && other.fragment_stores_and_atomics,
            vertex_pipeline_stores_and_atomics: self.vertex_pipeline_stores_and_atomics
                && other.vertex_pipeline_stores_and_atomics,
            shader_buffer_int64_atomics: self.shader_buffer_int64_atomics && other.shader_buffer_int64_atomics,
            ray_query: self.ray_query && other.ray_query,
            descriptor_indexing: self.descriptor_indexing && other.descriptor_indexing,
            compute_full_subgroups: self.compute_full_subgroups && other.compute_full_subgroups,
        }
    }
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

    /// Takes away what is not enabled.
    pub(super) fn restrict(&self, caps: &mut Caps) {
        let optional = &self.optional;
        caps.robust_buffer_access &= optional.robust_buffer_access;
        caps.geometry_shader &= optional.geometry_shader;
        if !optional.shader_clip_distance {
            caps.max_clip_distances = 0;
        }
        if !optional.multiview {
            caps.max_views = 0;
        }
        caps.vertex_layer &= optional.shader_viewport_index_layer;
        caps.pipeline_statistics &= optional.pipeline_statistics_query;
        caps.int64 &= optional.shader_int64;
        caps.float64 &= optional.shader_float64;
        caps.fragment_stores &= optional.fragment_stores_and_atomics;
        caps.vertex_stores &= optional.vertex_pipeline_stores_and_atomics;
        caps.int64_atomics &= optional.shader_buffer_int64_atomics;
        caps.ray_query &= optional.ray_query;
        if !caps.ray_query {
            (caps.max_structure_boxes, caps.structure_scratch_alignment) = (0, 1);
        }
        caps.descriptor_indexing &= optional.descriptor_indexing;
        caps.full_subgroups &= optional.compute_full_subgroups;
    }

    /// The Vulkan structs that switch these features on, for a host that creates a device. `ray_query` and
    /// `shader_viewport_index_layer` are of extensions, which have to be asked for beside them.
    pub fn to_vulkan(&self) -> DeviceFeatures {
        let optional = &self.optional;
        DeviceFeatures {
            vulkan10: vk::PhysicalDeviceFeatures::default()
                .robust_buffer_access(optional.robust_buffer_access)
                .geometry_shader(optional.geometry_shader)
                .shader_clip_distance(optional.shader_clip_distance)
                .pipeline_statistics_query(optional.pipeline_statistics_query)
                .shader_int64(optional.shader_int64)
                .shader_float64(optional.shader_float64)
                .fragment_stores_and_atomics(optional.fragment_stores_and_atomics)
                .vertex_pipeline_stores_and_atomics(optional.vertex_pipeline_stores_and_atomics),
            vulkan11: vk::PhysicalDeviceVulkan11Features::default().multiview(optional.multiview),
            vulkan12: vk::PhysicalDeviceVulkan12Features::default()
                .buffer_device_address(optional.ray_query)
                .shader_output_layer(optional.shader_viewport_index_layer)
                .shader_output_viewport_index(optional.shader_viewport_index_layer)
                .timeline_semaphore(self.timeline_semaphore)
                .scalar_block_layout(self.scalar_block_layout)
                .host_query_reset(self.host_query_reset)
                .shader_buffer_int64_atomics(optional.shader_buffer_int64_atomics)
                .runtime_descriptor_array(optional.descriptor_indexing)
                .shader_sampled_image_array_non_uniform_indexing(optional.descriptor_indexing),
            vulkan13: vk::PhysicalDeviceVulkan13Features::default()
                .synchronization2(self.synchronization2)
                .dynamic_rendering(self.dynamic_rendering)
                .compute_full_subgroups(optional.compute_full_subgroups),
            acceleration_structure: vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default()
                .acceleration_structure(optional.ray_query),
            ray_query: vk::PhysicalDeviceRayQueryFeaturesKHR::default().ray_query(optional.ray_query),
        }
    }

    /// What the Vulkan structs switch on (or offer): the inverse of [`EnabledFeatures::to_vulkan`], for a host that filled them itself.
    /// `shader_viewport_index_layer` is an extension alone and counts as off.
    pub fn from_vulkan(features: &DeviceFeatures) -> Self {
        let DeviceFeatures {
            vulkan10,
            vulkan11,
            vulkan12,
            vulkan13,
            acceleration_structure,
            ray_query,
        } = features;
        let on = |flag: vk::Bool32| flag != vk::FALSE;
        Self {
            synchronization2: on(vulkan13.synchronization2),
            dynamic_rendering: on(vulkan13.dynamic_rendering),
            timeline_semaphore: on(vulkan12.timeline_semaphore),
            scalar_block_layout: on(vulkan12.scalar_block_layout),
            host_query_reset: on(vulkan12.host_query_reset),
            optional: OptionalFeatures {
                robust_buffer_access: on(vulkan10.robust_buffer_access),
                geometry_shader: on(vulkan10.geometry_shader),
                shader_clip_distance: on(vulkan10.shader_clip_distance),
                multiview: on(vulkan11.multiview),
                shader_viewport_index_layer: false,
                pipeline_statistics_query: on(vulkan10.pipeline_statistics_query),
                shader_int64: on(vulkan10.shader_int64),
                shader_float64: on(vulkan10.shader_float64),
                fragment_stores_and_atomics: on(vulkan10.fragment_stores_and_atomics),
                vertex_pipeline_stores_and_atomics: on(vulkan10.vertex_pipeline_stores_and_atomics),
                shader_buffer_int64_atomics: on(vulkan12.shader_buffer_int64_atomics),
                ray_query: on(ray_query.ray_query)
                    && on(acceleration_structure.acceleration_structure)
                    && on(vulkan12.buffer_device_address),
                descriptor_indexing: on(vulkan12.runtime_descriptor_array)
                    && on(vulkan12.shader_sampled_image_array_non_uniform_indexing),
                compute_full_subgroups: on(vulkan13.compute_full_subgroups),
            },
        }
    }

    /// The names of the required features that are off: empty when a `Gpu` can be made.
    pub fn missing(&self) -> Vec<&'static str> {
        let required = [
            (self.synchronization2, "synchronization2"),
            (self.dynamic_rendering, "dynamicRendering"),
            (self.timeline_semaphore, "timelineSemaphore"),
            (self.scalar_block_layout, "scalarBlockLayout"),
            (self.host_query_reset, "hostQueryReset"),
        ];
        required.iter().filter(|(on, _)| !on).map(|(_, name)| *name).collect()
    }

    /// Fails with the names of all required features that are off.
    pub(super) fn check(&self, device: &str, instead: &str) -> Result<()> {
        let missing = self.missing();
        if missing.is_empty() {
            return Ok(());
        }
        Err(Error::MissingFeature {
            feature: missing.join(", "),
            needed_by: "the engine".into(),
            device: device.into(),
            instead: instead.into(),
        })
    }
}

/// The Vulkan structs that hold the features which the engine knows.
#[derive(Debug, Clone, Copy, Default)]
pub struct DeviceFeatures {
    /// Features of Vulkan 1.0.
    pub vulkan10: vk::PhysicalDeviceFeatures,
    /// Features of Vulkan 1.1.
    pub vulkan11: vk::PhysicalDeviceVulkan11Features<'static>,
    /// Features of Vulkan 1.2.
    pub vulkan12: vk::PhysicalDeviceVulkan12Features<'static>,
    /// Features of Vulkan 1.3.
    pub vulkan13: vk::PhysicalDeviceVulkan13Features<'static>,
    /// Features of `VK_KHR_acceleration_structure`.
    pub acceleration_structure: vk::PhysicalDeviceAccelerationStructureFeaturesKHR<'static>,
    /// Features of `VK_KHR_ray_query`.
    pub ray_query: vk::PhysicalDeviceRayQueryFeaturesKHR<'static>,
}

impl DeviceFeatures {
    /// Hangs the structs into a device's creation. The host may set more of their members before.
    pub fn chain<'a>(&'a mut self, info: vk::DeviceCreateInfo<'a>) -> vk::DeviceCreateInfo<'a> {
        let info = info
            .enabled_features(&self.vulkan10)
            .push_next(&mut self.vulkan11)
            .push_next(&mut self.vulkan12)
            .push_next(&mut self.vulkan13);
        // Devices without an extension do not know its struct.
        let structures = self.acceleration_structure.acceleration_structure != vk::FALSE;
        let queries = self.ray_query.ray_query != vk::FALSE;
        let info = if structures {
            info.push_next(&mut self.acceleration_structure)
        } else {
            info
        };
        if queries {
            info.push_next(&mut self.ray_query)
        } else {
            info
        }
    }

    /// What a physical device of this instance offers.
    pub(super) fn offered(instance: &ash::Instance, device: vk::PhysicalDevice) -> Self {
        let mut offered = Self::default();
        let mut features = vk::PhysicalDeviceFeatures2::default()
            .push_next(&mut offered.vulkan11)
            .push_next(&mut offered.vulkan12)
            .push_next(&mut offered.vulkan13);
        if has_ray_query_extensions(instance, device) {
            features = features
                .push_next(&mut offered.acceleration_structure)
                .push_next(&mut offered.ray_query);
        }
        // SAFETY: the device belongs to the instance; the chain lives on this stack.
        unsafe { instance.get_physical_device_features2(device, &mut features) };
        offered.vulkan10 = features.features;
        // The chain ends here: these structs outlive each other's addresses.
        offered.vulkan11.p_next = std::ptr::null_mut();
        offered.vulkan12.p_next = std::ptr::null_mut();
        offered.vulkan13.p_next = std::ptr::null_mut();
        offered.acceleration_structure.p_next = std::ptr::null_mut();
        offered.ray_query.p_next = std::ptr::null_mut();
        offered
    }
}

/// Whether a physical device of the instance has all of [`RAY_QUERY_EXTENSIONS`].
fn has_ray_query_extensions(instance: &ash::Instance, device: vk::PhysicalDevice) -> bool {
    // SAFETY: the device belongs to the instance.
    let extensions = unsafe { instance.enumerate_device_extension_properties(device) }.unwrap_or_default();
    let has = |name: &CStr| extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
    RAY_QUERY_EXTENSIONS.into_iter().all(has)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn features_travel_to_vulkan_and_back() {
        let bit = |set: bool| EnabledFeatures {
            optional: OptionalFeatures {
                shader_int64: set,
                ray_query: set,
                descriptor_indexing: set,
                compute_full_subgroups: set,
                ..OptionalFeatures::NONE
            },
            ..EnabledFeatures::REQUIRED
        };
        for features in [
            EnabledFeatures::NONE,
            EnabledFeatures::REQUIRED,
            bit(true),
            EnabledFeatures {
                host_query_reset: false,
                ..bit(false)
            },
        ] {
            assert_eq!(EnabledFeatures::from_vulkan(&features.to_vulkan()), features);
        }
        assert!(EnabledFeatures::REQUIRED.missing().is_empty());
        assert_eq!(EnabledFeatures::NONE.missing().len(), 5);
    }
}
