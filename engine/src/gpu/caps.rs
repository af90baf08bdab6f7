//! What a device can do, as typed values.

use ash::vk;

use super::host::{DeviceFeatures, EnabledFeatures};
use super::options::Lesser;
use crate::{Error, Result};

/// Iterations of all loops of an invocation together after which software drivers end loops silently; the test that ends a loop counts
/// too.
pub const SOFTWARE_LOOP_CAP: u32 = 65_535;

/// Capabilities and limits of a device, as far as techniques and kernels ask.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Caps {
    /// Device name.
    pub device: String,
    /// Driver name and version.
    pub driver: String,
    /// Vulkan version as `major.minor.patch`.
    pub api: String,
    /// What kind of device it is.
    pub kind: DeviceKind,
    /// Lanes of a subgroup.
    pub subgroup_size: u32,
    /// `minSubgroupSize`: the fewest lanes that the device makes subgroups of; 0 where it does not say.
    pub min_subgroup_size: u32,
    /// Subgroup operations usable in compute shaders.
    pub subgroup: SubgroupOperations,
    /// `computeFullSubgroups` is enabled (of devices in a list: offered): compute shaders with subgroup operations run in subgroups without
    /// inactive lanes.
    pub full_subgroups: bool,
    /// `geometryShader`.
    pub geometry_shader: bool,
    /// `maxClipDistances`; 0 without `shaderClipDistance`.
    pub max_clip_distances: u32,
    /// `maxMultiviewViewCount`; 0 without `multiview`.
    pub max_views: u32,
    /// Vertex shaders may write `gl_Layer`: `VK_EXT_shader_viewport_index_layer` is enabled (of devices in a list: offered).
    pub vertex_layer: bool,
    /// `maxColorAttachments`.
    pub max_color_attachments: u32,
    /// `subPixelPrecisionBits`: the places of vertices are rounded to so many binary digits of a pixel.
    pub sub_pixel_bits: u32,
    /// `shaderInt64`.
    pub int64: bool,
    /// `shaderFloat64`.
    pub float64: bool,
    /// `shaderBufferInt64Atomics`.
    pub int64_atomics: bool,
    /// `robustBufferAccess`, enabled on every device that has it.
    pub robust_buffer_access: bool,
    /// `pipelineStatisticsQuery`.
    pub pipeline_statistics: bool,
    /// `fragmentStoresAndAtomics`.
    pub fragment_stores: bool,
    /// `vertexPipelineStoresAndAtomics`.
    pub vertex_stores: bool,
    /// The queue takes draws as well as dispatches.
    pub graphics: bool,
    /// `VK_KHR_ray_query` is enabled (of devices in a list: offered), with `VK_KHR_acceleration_structure` and the addresses of buffers, which it needs.
    pub ray_query: bool,
    /// `maxPrimitiveCount`, the boxes of an acceleration structure; 0 without `ray_query`.
    pub max_structure_boxes: u64,
    /// `minAccelerationStructureScratchOffsetAlignment`, bytes; 1 without `ray_query`.
    pub structure_scratch_alignment: u64,
    /// `runtimeDescriptorArray` and `shaderSampledImageArrayNonUniformIndexing` are enabled (of devices in a list: offered).
    pub descriptor_indexing: bool,
    /// Nanoseconds a timestamp tick; 0 when the queue has no timestamps.
    pub timestamp_period: f32,
    /// Bits of a timestamp that count, `timestampValidBits` of the queue's family; times beyond them wrap. 0 for no timestamps.
    pub timestamp_valid_bits: u32,
    /// How many descriptors a pipeline may have.
    pub descriptors: DescriptorLimits,
    /// `maxStorageBufferRange`, bytes.
    pub max_storage_buffer_range: u64,
    /// `maxTexelBufferElements`, but no more than kernels can number: they index texels by `int`.
    pub max_texel_buffer_elements: u64,
    /// `minTexelBufferOffsetAlignment`, bytes.
    pub texel_buffer_alignment: u64,
    /// `minStorageBufferOffsetAlignment`, bytes.
    pub storage_buffer_alignment: u64,
    /// `maxUniformBufferRange`, bytes.
    pub max_uniform_buffer_range: u64,
    /// `minUniformBufferOffsetAlignment`, bytes.
    pub uniform_buffer_alignment: u64,
    /// `maxMemoryAllocationSize`, bytes.
    pub max_allocation_size: u64,
    /// Size of the largest device-local heap, bytes.
    pub device_heap: u64,
    /// `maxComputeSharedMemorySize`, bytes.
    pub max_shared_memory: u32,
    /// `maxComputeWorkGroupSize`.
    pub max_workgroup_size: [u32; 3],
    /// `maxComputeWorkGroupInvocations`.
    pub max_workgroup_invocations: u32,
    /// `maxComputeWorkGroupCount`, along each axis.
    pub max_workgroups: [u32; 3],
    /// `maxPushConstantsSize`, bytes.
    pub max_push_constants: u32,
    /// Vendor id, device id and pipeline cache UUID: the key of the pipeline cache.
    #[serde(skip)]
    pub cache_key: String,
}

/// Kinds of devices; as text in lower case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum DeviceKind {
    /// A software driver.
    Cpu,
    /// A GPU that shares the host's memory.
    Integrated,
    /// A GPU with memory of its own.
    Discrete,
    /// A GPU of a virtual machine.
    Virtual,
    /// Any other.
    Other,
}

impl DeviceKind {
    pub(super) fn of(kind: vk::PhysicalDeviceType) -> Self {
        match kind {
            vk::PhysicalDeviceType::CPU => Self::Cpu,
            vk::PhysicalDeviceType::INTEGRATED_GPU => Self::Integrated,
            vk::PhysicalDeviceType::DISCRETE_GPU => Self::Discrete,
            vk::PhysicalDeviceType::VIRTUAL_GPU => Self::Virtual,
            _ => Self::Other,
        }
    }
}

impl std::fmt::Display for DeviceKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Cpu => "cpu",
            Self::Integrated => "integrated",
            Self::Discrete => "discrete",
            Self::Virtual => "virtual",
            Self::Other => "other",
        })
    }
}

/// Subgroup operation classes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct SubgroupOperations {
    /// `subgroupElect` and the like.
    pub basic: bool,
    /// Any, all, equal.
    pub vote: bool,
    /// Reductions and scans.
    pub arithmetic: bool,
    /// Ballot and its bit counts.
    pub ballot: bool,
    /// Shuffle and shuffle xor.
    pub shuffle: bool,
}

/// Limits on the descriptors of a pipeline: of each stage, and of its whole layout. Texel buffers count as sampled images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct DescriptorLimits {
    /// `maxBoundDescriptorSets`.
    pub bound_sets: u32,
    /// `maxPerStageDescriptorStorageBuffers`.
    pub per_stage_storage_buffers: u32,
    /// `maxPerStageDescriptorUniformBuffers`.
    pub per_stage_uniform_buffers: u32,
    /// `maxPerStageDescriptorStorageImages`.
    pub per_stage_storage_images: u32,
    /// `maxPerStageDescriptorSampledImages`.
    pub per_stage_sampled_images: u32,
    /// `maxPerStageDescriptorSamplers`.
    pub per_stage_samplers: u32,
    /// `maxPerStageResources`: all of the above, and colour attachments.
    pub per_stage_resources: u32,
    /// `maxDescriptorSetStorageBuffers`.
    pub per_pipeline_storage_buffers: u32,
    /// `maxDescriptorSetUniformBuffers`.
    pub per_pipeline_uniform_buffers: u32,
    /// `maxDescriptorSetStorageImages`.
    pub per_pipeline_storage_images: u32,
    /// `maxDescriptorSetSampledImages`.
    pub per_pipeline_sampled_images: u32,
    /// `maxDescriptorSetSamplers`.
    pub per_pipeline_samplers: u32,
}

impl DescriptorLimits {
    fn of(limits: &vk::PhysicalDeviceLimits) -> Self {
        Self {
            bound_sets: limits.max_bound_descriptor_sets,
            per_stage_storage_buffers: limits.max_per_stage_descriptor_storage_buffers,
            per_stage_uniform_buffers: limits.max_per_stage_descriptor_uniform_buffers,
            per_stage_storage_images: limits.max_per_stage_descriptor_storage_images,
            per_stage_sampled_images: limits.max_per_stage_descriptor_sampled_images,
            per_stage_samplers: limits.max_per_stage_descriptor_samplers,
            per_stage_resources: limits.max_per_stage_resources,
            per_pipeline_storage_buffers: limits.max_descriptor_set_storage_buffers,
            per_pipeline_uniform_buffers: limits.max_descriptor_set_uniform_buffers,
            per_pipeline_storage_images: limits.max_descriptor_set_storage_images,
            per_pipeline_sampled_images: limits.max_descriptor_set_sampled_images,
            per_pipeline_samplers: limits.max_descriptor_set_samplers,
        }
    }
}

/// The texels that `texelFetch` can reach, whose index is a GLSL `int`.
fn indexable_texels(offered: u32) -> u64 {
    u64::from(offered.min(i32::MAX as u32))
}

impl Caps {
    /// Fails for more bytes than a storage buffer may have.
    pub(crate) fn check_storage(&self, name: &'static str, bytes: u64) -> Result<()> {
        let limit = self.max_storage_buffer_range;
        if bytes <= limit {
            return Ok(());
        }
        Err(Error::LimitExceeded {
            name: name.into(),
            value: bytes,
            limit_name: "maxStorageBufferRange",
            limit,
        })
    }

    /// Fails for more texels than a texel buffer may have, whatever their size.
    pub(crate) fn check_texels(&self, name: &str, texels: u64) -> Result<()> {
        let limit = self.max_texel_buffer_elements;
        if texels <= limit {
            return Ok(());
        }
        Err(Error::LimitExceeded {
            name: name.into(),
            value: texels,
            limit_name: "maxTexelBufferElements",
            limit,
        })
    }

    /// Lowers what was read to what a test pretends.
    pub(super) fn pretend(&mut self, lesser: &Lesser) {
        if let Some(descriptors) = lesser.descriptors {
            self.descriptors = descriptors;
        }
        if let Some(bytes) = lesser.heap_bytes {
            self.device_heap = self.device_heap.min(bytes);
        }
        if let Some(bytes) = lesser.max_storage_buffer_range {
            self.max_storage_buffer_range = self.max_storage_buffer_range.min(bytes);
        }
        if let Some(texels) = lesser.max_texel_buffer_elements {
            self.max_texel_buffer_elements = self.max_texel_buffer_elements.min(texels);
        }
        if let Some(groups) = lesser.max_workgroups {
            self.max_workgroups = [0, 1, 2].map(|axis| self.max_workgroups[axis].min(groups[axis]));
        }
        if let Some(bits) = lesser.timestamp_valid_bits {
            self.timestamp_valid_bits = self.timestamp_valid_bits.min(bits);
            if bits == 0 {
                self.timestamp_period = 0.0;
            }
        }
    }

    /// Reads the capabilities of a physical device.
    pub(super) fn read(instance: &super::instance::Instance, device: vk::PhysicalDevice, queue_family: u32) -> Self {
        let summary = instance.summary(0, device);
        let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
        let mut sizes = vk::PhysicalDeviceSubgroupSizeControlProperties::default();
        let mut maintenance = vk::PhysicalDeviceMaintenance3Properties::default();
        let mut multiview = vk::PhysicalDeviceMultiviewProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default()
            .push_next(&mut multiview)
            .push_next(&mut subgroup)
            .push_next(&mut sizes)
            .push_next(&mut maintenance);
        let offered = DeviceFeatures::offered(&instance.raw, device);
        let DeviceFeatures {
            vulkan10: features,
            vulkan11,
            vulkan12,
            vulkan13,
            ..
        } = &offered;
        let ray_query = EnabledFeatures::from_vulkan(&offered).optional.ray_query;
        let mut structures = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
        if ray_query {
            properties = properties.push_next(&mut structures);
        }
        // SAFETY: the physical device belongs to the instance, and the chained structs live on this stack.
        let (memory, families, extensions) = unsafe {
            instance.raw.get_physical_device_properties2(device, &mut properties);
            (
                instance.raw.get_physical_device_memory_properties(device),
                instance.raw.get_physical_device_queue_family_properties(device),
                instance
                    .raw
                    .enumerate_device_extension_properties(device)
                    .unwrap_or_default(),
            )
        };
        let properties = properties.properties;
        let limits = properties.limits;
        let operations = if subgroup.supported_stages.contains(vk::ShaderStageFlags::COMPUTE) {
            subgroup.supported_operations
        } else {
            vk::SubgroupFeatureFlags::empty()
        };
        let timestamp_valid_bits = families
            .get(queue_family as usize)
            .map_or(0, |family| family.timestamp_valid_bits);
        let heaps = &memory.memory_heaps[..memory.memory_heap_count as usize];
        let uuid: String = properties
            .pipeline_cache_uuid
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        let has_extension = |name| extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
        Self {
            device: summary.name,
            driver: summary.driver,
            api: summary.api,
            kind: summary.kind,
            subgroup_size: subgroup.subgroup_size,
            min_subgroup_size: sizes.min_subgroup_size,
            subgroup: SubgroupOperations {
                basic: operations.contains(vk::SubgroupFeatureFlags::BASIC),
                vote: operations.contains(vk::SubgroupFeatureFlags::VOTE),
                arithmetic: operations.contains(vk::SubgroupFeatureFlags::ARITHMETIC),
                ballot: operations.contains(vk::SubgroupFeatureFlags::BALLOT),
                shuffle: operations.contains(vk::SubgroupFeatureFlags::SHUFFLE),
            },
            full_subgroups: vulkan13.compute_full_subgroups != 0,
            geometry_shader: features.geometry_shader != 0,
            max_clip_distances: if features.shader_clip_distance != 0 {
                limits.max_clip_distances
            } else {
                0
            },
            max_views: if vulkan11.multiview != 0 {
                multiview.max_multiview_view_count
            } else {
                0
            },
            vertex_layer: vulkan12.shader_output_layer != 0
                && vulkan12.shader_output_viewport_index != 0
                && has_extension(ash::ext::shader_viewport_index_layer::NAME),
            max_color_attachments: limits.max_color_attachments,
            sub_pixel_bits: limits.sub_pixel_precision_bits,
            int64: features.shader_int64 != 0,
            float64: features.shader_float64 != 0,
            int64_atomics: vulkan12.shader_buffer_int64_atomics != 0,
            robust_buffer_access: features.robust_buffer_access != 0,
            pipeline_statistics: features.pipeline_statistics_query != 0,
            fragment_stores: features.fragment_stores_and_atomics != 0,
            vertex_stores: features.vertex_pipeline_stores_and_atomics != 0,
            graphics: families
                .get(queue_family as usize)
                .is_some_and(|family| family.queue_flags.contains(vk::QueueFlags::GRAPHICS)),
            ray_query,
            max_structure_boxes: structures.max_primitive_count,
            structure_scratch_alignment: u64::from(structures.min_acceleration_structure_scratch_offset_alignment)
                .max(1),
            descriptor_indexing: vulkan12.runtime_descriptor_array != 0
                && vulkan12.shader_sampled_image_array_non_uniform_indexing != 0,
            timestamp_period: if timestamp_valid_bits > 0 {
                limits.timestamp_period
            } else {
                0.0
            },
            timestamp_valid_bits,
            descriptors: DescriptorLimits::of(&limits),
            max_storage_buffer_range: u64::from(limits.max_storage_buffer_range),
            max_texel_buffer_elements: indexable_texels(limits.max_texel_buffer_elements),
            texel_buffer_alignment: limits.min_texel_buffer_offset_alignment,
            storage_buffer_alignment: limits.min_storage_buffer_offset_alignment,
            max_uniform_buffer_range: u64::from(limits.max_uniform_buffer_range),
            uniform_buffer_alignment: limits.min_uniform_buffer_offset_alignment,
            max_allocation_size: maintenance.max_memory_allocation_size,
            device_heap: heaps
                .iter()
                .filter(|heap| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))
                .map(|heap| heap.size)
                .max()
                .unwrap_or(0),
            max_shared_memory: limits.max_compute_shared_memory_size,
            max_workgroup_size: limits.max_compute_work_group_size,
            max_workgroup_invocations: limits.max_compute_work_group_invocations,
            max_workgroups: limits.max_compute_work_group_count,
            max_push_constants: limits.max_push_constants_size,
            cache_key: format!(
                "{:04x}-{:04x}-{:08x}-{uuid}",
                properties.vendor_id, properties.device_id, properties.driver_version
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_are_no_more_than_an_int_can_number() {
        assert_eq!(indexable_texels(65_536), 65_536);
        assert_eq!(indexable_texels(i32::MAX as u32), 0x7FFF_FFFF);
        assert_eq!(indexable_texels(u32::MAX), 0x7FFF_FFFF);
    }

    #[test]
    fn kinds_are_written_and_serialized_in_the_same_words() {
        let kinds = [
            vk::PhysicalDeviceType::CPU,
            vk::PhysicalDeviceType::INTEGRATED_GPU,
            vk::PhysicalDeviceType::DISCRETE_GPU,
            vk::PhysicalDeviceType::VIRTUAL_GPU,
            vk::PhysicalDeviceType::OTHER,
        ];
        let words = ["cpu", "integrated", "discrete", "virtual", "other"];
        for (kind, word) in kinds.map(DeviceKind::of).into_iter().zip(words) {
            assert_eq!(kind.to_string(), word);
            assert_eq!(serde_json::json!(kind), word);
        }
    }
}
