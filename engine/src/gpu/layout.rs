//! Pipeline layouts made from reflected shaders, checked against the device's limits first, and specialization constants.
//!
//! Sets are declared once for several shaders, of which each uses a part: layouts hold what the pipeline's shaders use, so that they fit
//! devices whose limits the whole set would exceed.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;

use super::caps::{Caps, DescriptorLimits};
use super::device::Inner;
use super::interface::{BindingKind, LocalSize, ShaderInfo, Stage};
use super::specialize::specialize;
use crate::{Error, Result};

/// A pipeline layout with its descriptor set layouts, and the pipeline made with it. Destroyed together.
pub(super) struct PipelineObjects {
    gpu: Arc<Inner>,
    /// Null until the pipeline is made.
    pub raw: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    pub sets: Vec<vk::DescriptorSetLayout>,
}

impl PipelineObjects {
    /// The layouts (with empty sets in gaps) for the shaders of one pipeline, whose attachments count as resources of the fragment stage.
    pub fn new(gpu: &Arc<Inner>, shaders: &[&'static ShaderInfo], attachments: u32) -> Result<Self> {
        Self::of(gpu, &LayoutDesc::of(shaders, attachments))
    }

    /// The layouts (with empty sets in gaps).
    pub fn of(gpu: &Arc<Inner>, desc: &LayoutDesc<'_>) -> Result<Self> {
        let wanted = Wanted::by(desc);
        let exceeded = wanted.excess(&gpu.caps.descriptors, gpu.caps.max_push_constants).next();
        if let Some(ExceededLimit { name, wanted, offered }) = exceeded {
            return Err(Error::MissingFeature {
                feature: format!("{name} >= {wanted}"),
                needed_by: format!("the pipeline of {}", desc.names.join(" and ")),
                device: gpu.caps.device.clone(),
                instead: format!("it offers {offered}; choose another device"),
            });
        }
        let mut objects = Self {
            gpu: Arc::clone(gpu),
            raw: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            sets: Vec::new(),
        };
        objects.make(desc)?;
        Ok(objects)
    }

    fn make(&mut self, desc: &LayoutDesc<'_>) -> Result<()> {
        let LayoutDesc {
            names,
            stages,
            bindings,
            push_bytes,
            ..
        } = desc;
        let (gpu, name) = (&self.gpu, names.first().copied().unwrap_or_default());
        for set in 0..bindings.keys().map(|(set, _)| set.saturating_add(1)).max().unwrap_or(0) {
            let list: Vec<_> = bindings
                .range((set, 0)..=(set, u32::MAX))
                .map(|((_, binding), kind)| {
                    vk::DescriptorSetLayoutBinding::default()
                        .binding(*binding)
                        .descriptor_type(descriptor_type(*kind))
                        .descriptor_count(1)
                        .stage_flags(*stages)
                })
                .collect();
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&list);
            // SAFETY: plain creation.
            let layout = unsafe { gpu.device.create_descriptor_set_layout(&info, None) }
                .map_err(|result| gpu.error("vkCreateDescriptorSetLayout", result))?;
            gpu.name(layout, &format!("{name} set {set}"));
            self.sets.push(layout);
        }
        let ranges = [vk::PushConstantRange::default().stage_flags(*stages).size(*push_bytes)];
        let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&self.sets);
        if *push_bytes > 0 {
            info = info.push_constant_ranges(&ranges);
        }
        // SAFETY: plain creation from live layouts.
        self.layout = unsafe { gpu.device.create_pipeline_layout(&info, None) }
            .map_err(|result| gpu.error("vkCreatePipelineLayout", result))?;
        gpu.name(self.layout, name);
        Ok(())
    }

    /// The device that they are of.
    pub fn gpu(&self) -> &Arc<Inner> {
        &self.gpu
    }

    /// Takes the pipeline that was made with the layout.
    pub fn set_pipeline(&mut self, raw: vk::Pipeline, name: &str) {
        self.raw = raw;
        self.gpu.name(raw, name);
    }
}

impl Drop for PipelineObjects {
    fn drop(&mut self) {
        // SAFETY: the last owner is gone, and submissions own what they use; null handles are allowed.
        unsafe {
            self.gpu.device.destroy_pipeline(self.raw, None);
            self.gpu.device.destroy_pipeline_layout(self.layout, None);
            for layout in &self.sets {
                self.gpu.device.destroy_descriptor_set_layout(*layout, None);
            }
        }
    }
}

/// What a pipeline layout is made of.
pub(super) struct LayoutDesc<'a> {
    /// Of the shaders.
    pub names: Vec<&'a str>,
    pub stages: vk::ShaderStageFlags,
    /// By set and number.
    pub bindings: BTreeMap<(u32, u32), BindingKind>,
    pub push_bytes: u32,
    /// They count as resources of the fragment stage.
    pub attachments: u32,
}

impl<'a> LayoutDesc<'a> {
    /// For the shaders of one pipeline.
    fn of(shaders: &[&'a ShaderInfo], attachments: u32) -> Self {
        Self {
            names: shaders.iter().map(|shader| shader.name).collect(),
            stages: shaders.iter().fold(vk::ShaderStageFlags::empty(), |all, shader| {
                all | stage_flags(shader.stage)
            }),
            bindings: shaders
                .iter()
                .flat_map(|shader| shader.used_bindings())
                .map(|binding| ((binding.set, binding.binding), binding.kind))
                .collect(),
            push_bytes: shaders.iter().map(|s| s.push_constant_bytes).max().unwrap_or(0),
            attachments,
        }
    }
}

/// A limit of a device that a pipeline passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ExceededLimit {
    /// Its Vulkan name.
    pub name: &'static str,
    /// What the pipeline takes.
    pub wanted: u32,
    /// What the device has.
    pub offered: u32,
}

impl Caps {
    /// The limits that a pipeline of this shader alone would pass, by its interface: descriptors, push constants, and the size of a workgroup where
    /// the shader says it.
    pub fn exceeded_by(&self, shader: &ShaderInfo) -> Vec<ExceededLimit> {
        let sizes = shader.local_size.map(|size| match size {
            LocalSize::Fixed(size) => size,
            LocalSize::Spec(_) => 1,
        });
        let invocations = ExceededLimit {
            name: "maxComputeWorkGroupInvocations",
            wanted: sizes.iter().product(),
            offered: self.max_workgroup_invocations,
        };
        let exceeded = Wanted::by(&LayoutDesc::of(&[shader], 0)).excess(&self.descriptors, self.max_push_constants);
        let too_large = Some(invocations).filter(|limit| limit.wanted > limit.offered);
        exceeded.chain(too_large).collect()
    }
}

/// What the layout of one pipeline takes. Every binding is visible to all stages of the pipeline, so that one count holds for each stage
/// and for the whole.
#[derive(Debug, Default, PartialEq, Eq)]
struct Wanted {
    sets: u32,
    storage_buffers: u32,
    uniform_buffers: u32,
    storage_images: u32,
    /// Combined images and samplers, and texel buffers, which count as sampled images.
    sampled_images: u32,
    samplers: u32,
    resources: u32,
    push_bytes: u32,
}

impl Wanted {
    fn by(desc: &LayoutDesc<'_>) -> Self {
        let kinds = &desc.bindings;
        let count = |of: &[BindingKind]| kinds.values().filter(|kind| of.contains(kind)).count() as u32;
        Self {
            sets: kinds.keys().map(|(set, _)| set.saturating_add(1)).max().unwrap_or(0),
            storage_buffers: count(&[BindingKind::StorageBuffer]),
            uniform_buffers: count(&[BindingKind::UniformBuffer]),
            storage_images: count(&[BindingKind::StorageImage]),
            sampled_images: count(&[BindingKind::SampledImage, BindingKind::TexelBuffer]),
            samplers: count(&[BindingKind::SampledImage]),
            resources: kinds.len() as u32 + desc.attachments,
            push_bytes: desc.push_bytes,
        }
    }

    /// The limits that do not suffice.
    fn excess(
        &self,
        offered: &DescriptorLimits,
        max_push_constants: u32,
    ) -> impl Iterator<Item = ExceededLimit> + use<> {
        let stage = [
            ("maxBoundDescriptorSets", self.sets, offered.bound_sets),
            ("maxPushConstantsSize", self.push_bytes, max_push_constants),
            (
                "maxPerStageDescriptorStorageBuffers",
                self.storage_buffers,
                offered.per_stage_storage_buffers,
            ),
            (
                "maxPerStageDescriptorUniformBuffers",
                self.uniform_buffers,
                offered.per_stage_uniform_buffers,
            ),
            (
                "maxPerStageDescriptorStorageImages",
                self.storage_images,
                offered.per_stage_storage_images,
            ),
            (
                "maxPerStageDescriptorSampledImages",
                self.sampled_images,
                offered.per_stage_sampled_images,
            ),
            (
                "maxPerStageDescriptorSamplers",
                self.samplers,
                offered.per_stage_samplers,
            ),
            ("maxPerStageResources", self.resources, offered.per_stage_resources),
            (
                "maxDescriptorSetStorageBuffers",
                self.storage_buffers,
                offered.per_pipeline_storage_buffers,
            ),
            (
                "maxDescriptorSetUniformBuffers",
                self.uniform_buffers,
                offered.per_pipeline_uniform_buffers,
            ),
            (
                "maxDescriptorSetStorageImages",
                self.storage_images,
                offered.per_pipeline_storage_images,
            ),
            (
                "maxDescriptorSetSampledImages",
                self.sampled_images,
                offered.per_pipeline_sampled_images,
            ),
            ("maxDescriptorSetSamplers", self.samplers, offered.per_pipeline_samplers),
        ];
        let limits = stage
            .into_iter()
            .map(|(name, wanted, offered)| ExceededLimit { name, wanted, offered });
        limits.filter(|limit| limit.wanted > limit.offered)
    }
}

/// The Vulkan stage.
pub(super) fn stage_flags(stage: Stage) -> vk::ShaderStageFlags {
    match stage {
        Stage::Compute => vk::ShaderStageFlags::COMPUTE,
        Stage::Vertex => vk::ShaderStageFlags::VERTEX,
        Stage::Geometry => vk::ShaderStageFlags::GEOMETRY,
        Stage::Fragment => vk::ShaderStageFlags::FRAGMENT,
    }
}

/// The Vulkan type of a binding.
pub(super) fn descriptor_type(kind: BindingKind) -> vk::DescriptorType {
    match kind {
        BindingKind::StorageBuffer => vk::DescriptorType::STORAGE_BUFFER,
        BindingKind::UniformBuffer => vk::DescriptorType::UNIFORM_BUFFER,
        BindingKind::StorageImage => vk::DescriptorType::STORAGE_IMAGE,
        BindingKind::SampledImage => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
        BindingKind::TexelBuffer => vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
        BindingKind::AccelerationStructure => vk::DescriptorType::ACCELERATION_STRUCTURE_KHR,
    }
}

/// A shader module, which may go once its pipelines are made.
pub(super) struct ShaderModule<'a> {
    gpu: &'a Inner,
    pub raw: vk::ShaderModule,
    is_specialized: bool,
}

impl<'a> ShaderModule<'a> {
    /// With the values of its constants written in where that can be done: then [`values`](Self::values) leaves none for the driver.
    pub fn specialized(gpu: &'a Inner, name: &str, spirv: &[u8], values: &[(u32, u32)]) -> Result<Self> {
        let words = words_of(name, spirv)?;
        match specialize(name, &words, values) {
            Some(specialized) => Self::of_words(gpu, name, &specialized, true),
            None => Self::of_words(gpu, name, &words, false),
        }
    }

    fn of_words(gpu: &'a Inner, name: &str, words: &[u32], is_specialized: bool) -> Result<Self> {
        let create = vk::ShaderModuleCreateInfo::default().code(words);
        // SAFETY: the words are a valid module: the build's, as the unsafe traits of shaders promise, or what a compiler of source text made, as it is or without
        // what its constants exclude.
        let raw = unsafe { gpu.device.create_shader_module(&create, None) }
            .map_err(|result| gpu.error("vkCreateShaderModule", result))?;
        gpu.name(raw, name);
        Ok(Self {
            gpu,
            raw,
            is_specialized,
        })
    }

    /// Of these values of constants, those that pipelines have to be given.
    pub fn values<'v>(&self, values: &'v [(u32, u32)]) -> &'v [(u32, u32)] {
        if self.is_specialized { &[] } else { values }
    }
}

fn words_of(name: &str, spirv: &[u8]) -> Result<Vec<u32>> {
    ash::util::read_spv(&mut std::io::Cursor::new(spirv)).map_err(|error| Error::Shader {
        name: name.into(),
        message: error.to_string(),
    })
}

impl Drop for ShaderModule<'_> {
    fn drop(&mut self) {
        // SAFETY: its pipelines are made, or failed to be.
        unsafe { self.gpu.device.destroy_shader_module(self.raw, None) };
    }
}

/// Map entries and packed values of specialization constants.
pub(super) fn specialization_data(values: &[(u32, u32)]) -> (Vec<vk::SpecializationMapEntry>, Vec<u8>) {
    let entry = |(index, (id, _)): (u32, &(u32, u32))| {
        vk::SpecializationMapEntry::default()
            .constant_id(*id)
            .offset(index * 4)
            .size(4)
    };
    let entries = (0u32..).zip(values).map(entry).collect();
    let data = values.iter().flat_map(|(_, bits)| bits.to_ne_bytes()).collect();
    (entries, data)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::interface::BindingInfo;

    const fn binding(set: u32, binding: u32, kind: BindingKind) -> BindingInfo {
        BindingInfo {
            set,
            binding,
            name: "",
            kind,
            reads: true,
            writes: false,
            used: true,
            view: None,
            fixed_bytes: 0,
        }
    }

    const fn shader(bindings: &'static [BindingInfo], push_constant_bytes: u32) -> ShaderInfo {
        ShaderInfo {
            name: "test",
            stage: Stage::Vertex,
            spirv: &[],
            push_constant_bytes,
            fingerprint: 0,
            local_size: [LocalSize::Fixed(1); 3],
            subgroups: false,
            capabilities: &[],
            ray_query: None,
            bindings,
            spec_constants: &[],
        }
    }

    static FIRST: ShaderInfo = shader(
        &[
            binding(0, 0, BindingKind::StorageBuffer),
            binding(0, 1, BindingKind::UniformBuffer),
            binding(2, 0, BindingKind::TexelBuffer),
        ],
        12,
    );
    static SECOND: ShaderInfo = shader(
        &[
            binding(0, 0, BindingKind::StorageBuffer),
            binding(2, 3, BindingKind::SampledImage),
            binding(2, 4, BindingKind::StorageImage),
            BindingInfo {
                used: false,
                ..binding(5, 0, BindingKind::StorageBuffer)
            },
        ],
        0,
    );

    #[test]
    fn shared_bindings_count_once_unused_ones_not_and_texel_buffers_as_sampled_images() {
        let expected = Wanted {
            sets: 3,
            storage_buffers: 1,
            uniform_buffers: 1,
            storage_images: 1,
            sampled_images: 2,
            samplers: 1,
            resources: 5 + 2,
            push_bytes: 12,
        };
        assert_eq!(Wanted::by(&LayoutDesc::of(&[&FIRST, &SECOND], 2)), expected);
    }

    type Field = fn(&mut DescriptorLimits) -> &mut u32;

    #[test]
    fn each_limit_is_reached_and_passed() {
        let wanted = Wanted::by(&LayoutDesc::of(&[&FIRST, &SECOND], 2));
        let exact = DescriptorLimits {
            bound_sets: 3,
            per_stage_storage_buffers: 1,
            per_stage_uniform_buffers: 1,
            per_stage_storage_images: 1,
            per_stage_sampled_images: 2,
            per_stage_samplers: 1,
            per_stage_resources: 7,
            per_pipeline_storage_buffers: 1,
            per_pipeline_uniform_buffers: 1,
            per_pipeline_storage_images: 1,
            per_pipeline_sampled_images: 2,
            per_pipeline_samplers: 1,
        };
        assert_eq!(wanted.excess(&exact, 12).next(), None);
        let push = ExceededLimit {
            name: "maxPushConstantsSize",
            wanted: 12,
            offered: 11,
        };
        assert_eq!(wanted.excess(&exact, 11).next(), Some(push));
        let less: [(&str, Field); 12] = [
            ("maxBoundDescriptorSets", |l| &mut l.bound_sets),
            ("maxPerStageDescriptorStorageBuffers", |l| {
                &mut l.per_stage_storage_buffers
            }),
            ("maxPerStageDescriptorUniformBuffers", |l| {
                &mut l.per_stage_uniform_buffers
            }),
            ("maxPerStageDescriptorStorageImages", |l| {
                &mut l.per_stage_storage_images
            }),
            ("maxPerStageDescriptorSampledImages", |l| {
                &mut l.per_stage_sampled_images
            }),
            ("maxPerStageDescriptorSamplers", |l| &mut l.per_stage_samplers),
            ("maxPerStageResources", |l| &mut l.per_stage_resources),
            ("maxDescriptorSetStorageBuffers", |l| {
                &mut l.per_pipeline_storage_buffers
            }),
            ("maxDescriptorSetUniformBuffers", |l| {
                &mut l.per_pipeline_uniform_buffers
            }),
            ("maxDescriptorSetStorageImages", |l| &mut l.per_pipeline_storage_images),
            ("maxDescriptorSetSampledImages", |l| &mut l.per_pipeline_sampled_images),
            ("maxDescriptorSetSamplers", |l| &mut l.per_pipeline_samplers),
        ];
        for (name, limit) in less {
            let mut short = exact;
            *limit(&mut short) -= 1;
            let found: Vec<_> = wanted.excess(&short, 12).collect();
            assert_eq!(found.len(), 1, "{found:?}");
            assert_eq!((found[0].name, found[0].wanted), (name, found[0].offered + 1));
        }
    }
}
