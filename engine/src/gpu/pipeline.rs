//! Compute pipelines made from reflected shaders.

use std::collections::BTreeMap;
use std::marker::PhantomData;
use std::sync::{Arc, PoisonError, Weak};

use ash::vk;

use super::device::{Gpu, Inner};
use super::interface::{BindingKind, ComputeShader, LocalSize, ShaderInfo, SpecConstants};
use crate::{Error, Result};

/// Live pipelines by shader and specialization, so that equal ones are made once.
pub(super) type PipelineTable = BTreeMap<(&'static str, Vec<(u32, u32)>), Weak<PipelineInner>>;

/// A compute pipeline of the shader `K`. Cloning shares it.
pub struct ComputePipeline<K> {
    pub(super) inner: Arc<PipelineInner>,
    shader: PhantomData<fn() -> K>,
}

impl<K> Clone for ComputePipeline<K> {
    fn clone(&self) -> Self {
        Self {
            inner: Arc::clone(&self.inner),
            shader: PhantomData,
        }
    }
}

impl<K> std::fmt::Debug for ComputePipeline<K> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("ComputePipeline")
            .field(&self.inner.info.name)
            .field(&self.inner.spec)
            .finish()
    }
}

/// What a pipeline was made of, for reports.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct PipelineInfo {
    /// Path below `shaders/`.
    pub shader: &'static str,
    /// Specialization constants by name, values as bits.
    pub specialization: Vec<(&'static str, u32)>,
}

pub(super) struct PipelineInner {
    gpu: Arc<Inner>,
    pub raw: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    pub set_layouts: Vec<vk::DescriptorSetLayout>,
    pub info: &'static ShaderInfo,
    pub local_size: [u32; 3],
    spec: Vec<(u32, u32)>,
}

impl Gpu {
    /// Makes the pipeline of a shader, or shares one that is alive with the same specialization.
    ///
    /// # Errors
    /// [`Error::MissingFeature`] when the workgroup is larger than the device allows, [`Error::OutOfMemory`], [`Error::Vulkan`].
    pub fn compute_pipeline<K: ComputeShader>(&self, spec: &K::Spec) -> Result<ComputePipeline<K>> {
        let (info, values) = (K::info(), spec.values());
        let key = (info.name, values.clone());
        let mut table = self.inner.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(inner) = table.get(&key).and_then(Weak::upgrade) {
            return Ok(ComputePipeline {
                inner,
                shader: PhantomData,
            });
        }
        let inner = Arc::new(PipelineInner::compute(&self.inner, info, info.spirv, values)?);
        table.insert(key, Arc::downgrade(&inner));
        Ok(ComputePipeline {
            inner,
            shader: PhantomData,
        })
    }
}

#[cfg(feature = "hot-reload")]
impl<K: ComputeShader> ComputePipeline<K> {
    /// The pipeline of another module with the interface of `K`.
    pub(super) fn from_spirv(gpu: &Gpu, spirv: &[u8], spec: &K::Spec) -> Result<Self> {
        let inner = PipelineInner::compute(&gpu.inner, K::info(), spirv, spec.values())?;
        Ok(Self {
            inner: Arc::new(inner),
            shader: PhantomData,
        })
    }
}

impl<K> ComputePipeline<K> {
    /// Invocations of a workgroup along x.
    pub fn group_size(&self) -> u32 {
        self.inner.local_size[0]
    }

    /// Workgroups along x that cover `count` invocations.
    pub fn groups_for(&self, count: u32) -> u32 {
        count.div_ceil(self.inner.local_size[0])
    }

    /// What it was made of.
    pub fn info(&self) -> PipelineInfo {
        let info = self.inner.info;
        let name = |id: u32| {
            info.spec_constants
                .iter()
                .find(|constant| constant.id == id)
                .map_or("", |constant| constant.name)
        };
        PipelineInfo {
            shader: info.name,
            specialization: self.inner.spec.iter().map(|(id, bits)| (name(*id), *bits)).collect(),
        }
    }
}

impl PipelineInner {
    /// The pipeline of a module with the interface `info`.
    fn compute(gpu: &Arc<Inner>, info: &'static ShaderInfo, spirv: &[u8], spec: Vec<(u32, u32)>) -> Result<Self> {
        gpu.check_alive()?;
        let local_size = info.local_size.map(|size| match size {
            LocalSize::Fixed(size) => size,
            LocalSize::Spec(wanted) => spec.iter().find(|(id, _)| *id == wanted).map_or(1, |(_, value)| *value),
        });
        let invocations = local_size.iter().product::<u32>();
        if invocations > gpu.caps.max_workgroup_invocations {
            return Err(Error::MissingFeature {
                feature: format!("maxComputeWorkGroupInvocations >= {invocations}"),
                needed_by: info.name.into(),
                device: gpu.caps.device.clone(),
                instead: format!("choose a workgroup of at most {}", gpu.caps.max_workgroup_invocations),
            });
        }
        let (set_layouts, layout) = layouts(gpu, &[info], vk::ShaderStageFlags::COMPUTE)?;
        let mut inner = Self {
            gpu: Arc::clone(gpu),
            raw: vk::Pipeline::null(),
            layout,
            set_layouts,
            info,
            local_size,
            spec,
        };
        let module = shader_module(gpu, info, spirv)?;
        let (entries, data) = specialization_data(&inner.spec);
        let specialization = vk::SpecializationInfo::default().map_entries(&entries).data(&data);
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"main")
            .specialization_info(&specialization);
        let create = vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout);
        // SAFETY: module and layout are alive and match, since both come from the same reflection.
        let made = unsafe {
            gpu.device
                .create_compute_pipelines(gpu.pipeline_cache.raw, &[create], None)
        };
        // SAFETY: a module may go once its pipelines are made.
        unsafe { gpu.device.destroy_shader_module(module, None) };
        inner.raw =
            made.map_err(|(_, result)| gpu.creation_error("vkCreateComputePipelines", result, info.name, 0))?[0];
        gpu.name(inner.raw, info.name);
        gpu.name(inner.layout, info.name);
        Ok(inner)
    }
}

impl Drop for PipelineInner {
    fn drop(&mut self) {
        // SAFETY: the last owner is gone, and submissions own what they use.
        unsafe {
            self.gpu.device.destroy_pipeline(self.raw, None);
            self.gpu.device.destroy_pipeline_layout(self.layout, None);
            for layout in &self.set_layouts {
                self.gpu.device.destroy_descriptor_set_layout(*layout, None);
            }
        }
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

/// The shader module of a reflected shader.
pub(super) fn shader_module(gpu: &Inner, info: &ShaderInfo, spirv: &[u8]) -> Result<vk::ShaderModule> {
    let words = ash::util::read_spv(&mut std::io::Cursor::new(spirv)).map_err(|error| Error::Shader {
        name: info.name.into(),
        message: error.to_string(),
    })?;
    let create = vk::ShaderModuleCreateInfo::default().code(&words);
    // SAFETY: the words are a module that was validated when it was built.
    let module = unsafe { gpu.device.create_shader_module(&create, None) }
        .map_err(|result| gpu.error("vkCreateShaderModule", result))?;
    gpu.name(module, info.name);
    Ok(module)
}

/// Descriptor set layouts (with empty ones in gaps) and the pipeline layout of the shaders of one pipeline.
pub(super) fn layouts(
    gpu: &Inner,
    shaders: &[&'static ShaderInfo],
    stages: vk::ShaderStageFlags,
) -> Result<(Vec<vk::DescriptorSetLayout>, vk::PipelineLayout)> {
    let mut bindings: BTreeMap<(u32, u32), BindingKind> = BTreeMap::new();
    for binding in shaders.iter().flat_map(|shader| shader.bindings) {
        bindings.insert((binding.set, binding.binding), binding.kind);
    }
    let sets = bindings.keys().map(|(set, _)| set + 1).max().unwrap_or(0);
    let mut set_layouts = Vec::new();
    let destroy = |set_layouts: &[vk::DescriptorSetLayout]| {
        for layout in set_layouts {
            // SAFETY: nothing uses the layout yet.
            unsafe { gpu.device.destroy_descriptor_set_layout(*layout, None) };
        }
    };
    for set in 0..sets {
        let list: Vec<_> = bindings
            .iter()
            .filter(|((s, _), _)| *s == set)
            .map(|((_, binding), kind)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(*binding)
                    .descriptor_type(descriptor_type(*kind))
                    .descriptor_count(1)
                    .stage_flags(stages)
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&list);
        // SAFETY: plain creation.
        match unsafe { gpu.device.create_descriptor_set_layout(&info, None) } {
            Ok(layout) => {
                gpu.name(layout, &format!("{} set {set}", shaders[0].name));
                set_layouts.push(layout);
            }
            Err(result) => {
                destroy(&set_layouts);
                return Err(gpu.error("vkCreateDescriptorSetLayout", result));
            }
        }
    }
    let push_bytes = shaders
        .iter()
        .map(|shader| shader.push_constant_bytes)
        .max()
        .unwrap_or(0);
    let ranges = [vk::PushConstantRange::default().stage_flags(stages).size(push_bytes)];
    let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts);
    if push_bytes > 0 {
        info = info.push_constant_ranges(&ranges);
    }
    // SAFETY: plain creation from live layouts.
    match unsafe { gpu.device.create_pipeline_layout(&info, None) } {
        Ok(layout) => Ok((set_layouts, layout)),
        Err(result) => {
            destroy(&set_layouts);
            Err(gpu.error("vkCreatePipelineLayout", result))
        }
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
    }
}
