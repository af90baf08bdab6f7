//! Compute pipelines made from reflected shaders.

use std::collections::{BTreeMap, VecDeque};
use std::marker::PhantomData;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Instant;

use ash::vk;

use super::device::{Gpu, Inner};
use super::interface::{Capability, ComputeShader, LocalSize, ShaderInfo, SpecConstants};
use super::layout::{PipelineObjects, ShaderModule, specialization_data};
use crate::{Error, Result};

/// Live pipelines by shader and specialization, so that equal ones are made once. A shader is the place of its [`ShaderInfo`]: two crates may have
/// kernels of one name.
pub(super) type PipelineTable = BTreeMap<(usize, Vec<(u32, u32)>), Weak<PipelineInner>>;

/// Pipelines that are kept beyond their last user: several techniques' worth. The next picture of a scene with the same features takes them as they are.
const KEPT: usize = 128;

/// The pipelines asked for last, the latest at the back. They own the device, so that its handles keep them and not what the handles share.
#[derive(Default)]
pub(super) struct KeptPipelines(Mutex<VecDeque<Arc<PipelineInner>>>);

impl KeptPipelines {
    fn keep(&self, inner: &Arc<PipelineInner>) {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.retain(|other| !Arc::ptr_eq(other, inner));
        kept.push_back(Arc::clone(inner));
        let surplus = kept.len().saturating_sub(KEPT);
        let dropped: Vec<_> = kept.drain(..surplus).collect();
        drop(kept);
        drop(dropped);
    }

    fn clear(&self) {
        let all = std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner));
        drop(all);
    }
}

/// Workgroups along an axis that every device dispatches.
const ROW_GROUPS: u32 = 65_535;

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

impl PipelineInfo {
    /// Of a shader, and the values of its constants by number.
    pub(super) fn of(shader: &'static ShaderInfo, spec: &[(u32, u32)]) -> Self {
        let name = |id: u32| {
            let known = shader.spec_constants.iter().find(|constant| constant.id == id);
            known.map_or("", |constant| constant.name)
        };
        Self {
            shader: shader.name,
            specialization: spec.iter().map(|(id, bits)| (name(*id), *bits)).collect(),
        }
    }
}

pub(super) struct PipelineInner {
    pub objects: PipelineObjects,
    pub info: &'static ShaderInfo,
    pub local_size: [u32; 3],
    spec: Vec<(u32, u32)>,
}

impl Gpu {
    /// Makes the pipeline of a shader, or shares one that is alive with the same specialization. The last 128 stay alive for as long as any handle of
    /// the device, or until [`Gpu::release_pipelines`]: to compile one may take a driver longer than the picture that it is for.
    ///
    /// # Errors
    /// [`Error::MissingFeature`] when the workgroup is larger or the descriptors are more than the device allows, [`Error::Shader`] for a workgroup
    /// without invocations, [`Error::OutOfMemory`], [`Error::Vulkan`], [`Error::DeviceLost`].
    pub fn compute_pipeline<K: ComputeShader>(&self, spec: &K::Spec) -> Result<ComputePipeline<K>> {
        self.inner.check_alive()?;
        let inner = self.shared_pipeline(K::info(), spec.values())?;
        self.kept.keep(&inner);
        Ok(ComputePipeline {
            inner,
            shader: PhantomData,
        })
    }

    /// The pipeline of the module by ray queries that stands in for a kernel ([`ShaderInfo::ray_query`]): as [`Gpu::compute_pipeline`], to be dispatched as
    /// the kernel, with set 1 of that module.
    ///
    /// # Errors
    /// As [`Gpu::compute_pipeline`]; [`Error::MissingFeature`] on a device without [`Caps::ray_query`](super::Caps::ray_query), [`Error::Shader`] for a kernel
    /// that has no such module.
    pub fn ray_query_pipeline<K: ComputeShader>(&self, spec: &K::Spec) -> Result<ComputePipeline<K>> {
        self.inner.check_alive()?;
        let Some(info) = K::info().ray_query else {
            return Err(Error::Shader {
                name: K::info().name.into(),
                message: "has no module by ray queries".into(),
            });
        };
        let is_known = |(id, _): &(u32, u32)| info.spec_constants.iter().any(|constant| constant.id == *id);
        let values = spec.values().into_iter().filter(is_known).collect();
        let inner = self.shared_pipeline(info, values)?;
        self.kept.keep(&inner);
        Ok(ComputePipeline {
            inner,
            shader: PhantomData,
        })
    }

    fn shared_pipeline(&self, info: &'static ShaderInfo, values: Vec<(u32, u32)>) -> Result<Arc<PipelineInner>> {
        let key = (std::ptr::from_ref(info).addr(), values.clone());
        let mut table = self.inner.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(inner) = table.get(&key).and_then(Weak::upgrade) {
            return Ok(inner);
        }
        let inner = Arc::new(PipelineInner::compute(&self.inner, info, info.spirv, values)?);
        table.insert(key, Arc::downgrade(&inner));
        Ok(inner)
    }

    /// Destroys the compute pipelines that nothing uses any more.
    pub fn release_pipelines(&self) {
        self.kept.clear();
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

    /// Workgroups in rows that cover `count` invocations, for kernels that number theirs by `invocation_index`: as many a row as every device can.
    pub fn groups_over(&self, count: u32) -> [u32; 3] {
        let all = self.groups_for(count);
        let rows = all.div_ceil(ROW_GROUPS).max(1);
        [all.div_ceil(rows), rows, 1]
    }

    /// What it was made of.
    pub fn info(&self) -> PipelineInfo {
        PipelineInfo::of(self.inner.info, &self.inner.spec)
    }
}

/// Fails for a workgroup of more invocations than the device has, or of none.
pub(super) fn check_workgroup(gpu: &Inner, name: &str, local_size: [u32; 3]) -> Result<()> {
    if local_size.contains(&0) {
        return Err(Error::Shader {
            name: name.into(),
            message: format!("a workgroup of {local_size:?} has no invocations"),
        });
    }
    let lacks = |limit: &str, wanted: u32, instead: String| Error::MissingFeature {
        feature: format!("{limit} >= {wanted}"),
        needed_by: name.into(),
        device: gpu.caps.device.clone(),
        instead,
    };
    let most = gpu.caps.max_workgroup_invocations;
    let invocations = local_size.iter().fold(1u32, |all, side| all.saturating_mul(*side));
    if invocations > most {
        let instead = format!("choose a workgroup of at most {most}");
        return Err(lacks("maxComputeWorkGroupInvocations", invocations, instead));
    }
    for (axis, (size, most)) in local_size.iter().zip(gpu.caps.max_workgroup_size).enumerate() {
        if *size > most {
            let instead = format!("choose a workgroup of at most {most} there");
            return Err(lacks(&format!("maxComputeWorkGroupSize[{axis}]"), *size, instead));
        }
    }
    Ok(())
}

impl PipelineObjects {
    /// Makes the compute pipeline of a stage.
    ///
    /// # Safety
    /// The stage's module is alive, and the layout has what it uses.
    pub(super) unsafe fn make_compute(
        &mut self,
        gpu: &Inner,
        stage: vk::PipelineShaderStageCreateInfo<'_>,
        name: &str,
    ) -> Result<()> {
        let create = vk::ComputePipelineCreateInfo::default()
            .stage(stage)
            .layout(self.layout);
        let begun = Instant::now();
        // SAFETY: the caller's; the layout is alive.
        let made = unsafe {
            gpu.device
                .create_compute_pipelines(gpu.pipeline_cache.raw, &[create], None)
        };
        tracing::debug!(name, ms = 1e3 * begun.elapsed().as_secs_f64(), "compute pipeline");
        let made = made.map_err(|(_, result)| gpu.creation_error("vkCreateComputePipelines", result, name, 0))?;
        self.set_pipeline(made[0], name);
        Ok(())
    }
}

impl PipelineInner {
    /// The pipeline of a module with the interface `info`.
    fn compute(gpu: &Arc<Inner>, info: &'static ShaderInfo, spirv: &[u8], spec: Vec<(u32, u32)>) -> Result<Self> {
        gpu.check_alive()?;
        let local_size = info.local_size.map(|size| match size {
            LocalSize::Fixed(size) => size,
            LocalSize::Spec(wanted) => {
                let given = spec.iter().find(|(id, _)| *id == wanted).map(|(_, value)| *value);
                let own = || info.spec_constants.iter().find(|constant| constant.id == wanted);
                given.or_else(|| own().map(|constant| constant.default)).unwrap_or(1)
            }
        });
        check_workgroup(gpu, info.name, local_size)?;
        if info.capabilities.contains(&Capability::RayQuery) && !gpu.caps.ray_query {
            return Err(gpu.lacks_ray_queries(info.name));
        }
        let mut objects = PipelineObjects::new(gpu, &[info], 0)?;
        let module = ShaderModule::specialized(gpu, info.name, spirv, &spec)?;
        let (entries, data) = specialization_data(module.values(&spec));
        let specialization = vk::SpecializationInfo::default().map_entries(&entries).data(&data);
        // Widths that are not multiples of a subgroup cannot be asked for.
        let is_full =
            info.subgroups && gpu.caps.full_subgroups && local_size[0].is_multiple_of(gpu.caps.subgroup_size.max(1));
        let flags = if is_full {
            vk::PipelineShaderStageCreateFlags::REQUIRE_FULL_SUBGROUPS
        } else {
            vk::PipelineShaderStageCreateFlags::empty()
        };
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .flags(flags)
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module.raw)
            .name(c"main")
            .specialization_info(&specialization);
        // SAFETY: module and layout match, since both come from the same reflection.
        unsafe { objects.make_compute(gpu, stage, info.name) }?;
        Ok(Self {
            objects,
            info,
            local_size,
            spec,
        })
    }
}
