//! Kernels of a host's own, compiled from source text while the program runs.
//!
//! WGSL comes in through naga (feature `wgsl`, on by default): parsed, validated, translated to SPIR-V 1.3 and reflected. GLSL comes in
//! through shaderc, in this process with the feature `shaderc` or by its program `glslc` with `hot-reload`. Either way a kernel's bindings
//! are known by the names that the source gives them, and what a dispatch is given is checked against them before anything is recorded.
//!
//! ```no_run
//! # #[cfg(feature = "wgsl")]
//! # fn main() -> clerestory::Result<()> {
//! use clerestory::gpu::{Category, Gpu, GpuOptions, OwnKernel};
//!
//! let gpu = Gpu::headless(&GpuOptions::default())?;
//! let kernel = OwnKernel::wgsl(&gpu, "twice", "
//!     @group(0) @binding(0) var<storage, read_write> numbers: array<u32>;
//!     @compute @workgroup_size(64)
//!     fn main(@builtin(global_invocation_id) id: vec3u) { numbers[id.x] *= 2; }
//! ")?;
//! let numbers = gpu.buffer_with("numbers", Category::Work, &[1u32, 2, 3])?;
//! let mut recorder = gpu.recorder("own")?;
//! recorder.pass("twice", |pass| pass.dispatch_own(&kernel, &[("numbers", numbers.view().into())], &[], kernel.groups_for([3, 1, 1])))?;
//! recorder.submit()?.wait()?;
//! assert_eq!(gpu.read::<u32>(numbers.view(), 3)?, [2, 4, 6]);
//! # Ok(())
//! # }
//! # #[cfg(not(feature = "wgsl"))]
//! # fn main() {}
//! ```
//!
//! What holds of WGSL: an index beyond an array, a buffer's end included, reads zero and writes nothing, and division by zero is defined, so
//! no source breaks memory of others. What does not: loops have no bound that helps. A loop without an end hangs a device, or loses it where
//! the system has a watchdog, and the software driver silently ends loops after 65,535 iterations. GLSL has what the device's robust
//! buffer access gives it, and nothing keeps it inside its own arrays: to make a kernel of it is `unsafe`. Bindings are storage and uniform buffers, in GLSL texel buffers, too; images and samplers are refused.

#[cfg(feature = "hot-reload")]
mod glsl;
#[cfg(feature = "wgsl")]
mod wgsl;

use std::collections::BTreeSet;
use std::ffi::CString;
use std::sync::Arc;

use ash::vk;

use super::barrier::Access;
use super::bind::Slot;
use super::buffer::BufferView;
use super::device::{Gpu, Inner};
use super::interface::{BindingKind, BoundResource};
use super::layout::{LayoutDesc, PipelineObjects, ShaderModule};
use super::pipeline::check_workgroup;
use super::recorder::Pass;
use super::texels::TexelView;
use crate::{Error, Result};

/// Numbers of bindings in a set, as WebGPU has it by default: drivers keep a table up to the greatest number there is.
const BINDINGS_MAX: u32 = 1000;

/// A compute kernel made from source text. Cloning shares it.
#[derive(Clone)]
pub struct OwnKernel {
    inner: Arc<OwnKernelInner>,
}

impl std::fmt::Debug for OwnKernel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OwnKernel")
            .field("name", &self.inner.name)
            .field("bindings", &self.inner.module.bindings)
            .finish_non_exhaustive()
    }
}

struct OwnKernelInner {
    name: String,
    module: Module,
    objects: PipelineObjects,
}

/// A module with its interface.
struct Module {
    spirv: Vec<u8>,
    entry: String,
    bindings: Vec<OwnBinding>,
    push_bytes: u32,
    local_size: [u32; 3],
    /// Of a workgroup.
    shared_bytes: u64,
}

/// A binding of an [`OwnKernel`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OwnBinding {
    /// As the source names it; in GLSL the instance's name, or the block's in snake case.
    pub name: String,
    /// Descriptor set, in WGSL the group.
    pub set: u32,
    /// Number in the set.
    pub binding: u32,
    /// A storage, uniform or texel buffer.
    pub kind: BindingKind,
    /// Declared to be read.
    pub reads: bool,
    /// Declared to be written.
    pub writes: bool,
    /// Bytes that it must hold at least; of an array without a size those of one element.
    pub least_bytes: u64,
    /// The kernel makes use of it. One that is not used is checked and not bound.
    pub used: bool,
}

/// What a binding of an [`OwnKernel`] is given.
#[derive(Debug, Clone, Copy)]
pub enum OwnResource<'a> {
    /// A storage or uniform buffer.
    Buffer(BufferView<'a>),
    /// The same, where the kernel must not write: a binding that is declared to be written is an error.
    ReadOnly(BufferView<'a>),
    /// A buffer by its texels.
    Texels(&'a TexelView),
}

impl<'a> From<BufferView<'a>> for OwnResource<'a> {
    fn from(view: BufferView<'a>) -> Self {
        Self::Buffer(view)
    }
}

impl<'a> From<&'a TexelView> for OwnResource<'a> {
    fn from(view: &'a TexelView) -> Self {
        Self::Texels(view)
    }
}

impl<'a> OwnResource<'a> {
    fn view(&self) -> BufferView<'a> {
        match self {
            Self::Buffer(view) | Self::ReadOnly(view) => *view,
            Self::Texels(texels) => texels.buffer().view(),
        }
    }

    fn bound(&self) -> BoundResource<'a> {
        match self {
            Self::Buffer(view) | Self::ReadOnly(view) => BoundResource::Buffer(*view),
            Self::Texels(texels) => BoundResource::Texels(texels),
        }
    }
}

impl OwnBinding {
    fn what(&self) -> &'static str {
        match (self.kind, self.writes) {
            (BindingKind::UniformBuffer, _) => "a uniform buffer",
            (BindingKind::TexelBuffer, _) => "a texel buffer",
            (_, true) => "a storage buffer that the kernel writes",
            _ => "a storage buffer that the kernel reads",
        }
    }

    /// The use that barriers are checked for.
    fn access(&self) -> Access {
        if self.kind == BindingKind::UniformBuffer {
            return Access::COMPUTE_UNIFORM_READ;
        }
        let read = if self.reads { Access::COMPUTE_READ } else { Access::NONE };
        let write = if self.writes {
            Access::COMPUTE_WRITE
        } else {
            Access::NONE
        };
        read | write
    }
}

impl OwnKernel {
    /// A kernel from WGSL with one compute entry point of any name. `var<immediate>` are push constants; overrides have the values that the
    /// source gives them. Storage of 64-bit numbers and subgroup operations are there where the device has them.
    ///
    /// # Errors
    /// [`Error::KernelSource`] for a mistake, with its place; [`Error::Binding`] for a binding of a kind that is not taken, or in a set that the device
    /// does not bind, or with a number from 1000 on;
    /// [`Error::MissingFeature`] for what the device lacks; [`Error::OutOfMemory`].
    #[cfg(feature = "wgsl")]
    pub fn wgsl(gpu: &Gpu, name: &str, source: &str) -> Result<Self> {
        Self::new(gpu, name, wgsl::translate(name, source, gpu.caps())?)
    }

    /// A kernel from GLSL, a compute shader without includes, with the flags of the engine's own.
    ///
    /// # Errors
    /// As [`OwnKernel::wgsl`]; [`Error::Io`] without the feature `shaderc` where there is no program `glslc`.
    ///
    /// # Safety
    /// Whatever the kernel is given, it stays inside its own arrays (those of an invocation and of a workgroup), and where the device has no
    /// [`Caps::robust_buffer_access`](super::Caps) inside its buffers: unlike WGSL's, its indices are not checked.
    #[cfg(feature = "hot-reload")]
    pub unsafe fn glsl(gpu: &Gpu, name: &str, source: &str) -> Result<Self> {
        Self::new(gpu, name, glsl::translate(name, source)?)
    }

    fn new(gpu: &Gpu, name: &str, module: Module) -> Result<Self> {
        let inner = &gpu.inner;
        inner.check_alive()?;
        check_limits(inner, name, &module)?;
        let used = module.bindings.iter().filter(|binding| binding.used);
        let mut objects = PipelineObjects::of(
            inner,
            &LayoutDesc {
                names: vec![name],
                stages: vk::ShaderStageFlags::COMPUTE,
                bindings: used.map(|b| ((b.set, b.binding), b.kind)).collect(),
                push_bytes: module.push_bytes,
                attachments: 0,
            },
        )?;
        // Constants of the source have the values that it gives them.
        let shader = ShaderModule::specialized(inner, name, &module.spirv, &[])?;
        let entry = CString::new(module.entry.as_str()).map_err(|_| Error::KernelSource {
            kernel: name.into(),
            line: 0,
            column: 0,
            message: "the entry point's name holds a NUL".into(),
        })?;
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(shader.raw)
            .name(&entry);
        // SAFETY: the module is alive, and the layout has the bindings that it uses.
        unsafe { objects.make_compute(inner, stage, name) }?;
        Ok(Self {
            inner: Arc::new(OwnKernelInner {
                name: name.into(),
                module,
                objects,
            }),
        })
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.inner.name
    }

    /// What its source declares, by set and number.
    pub fn bindings(&self) -> &[OwnBinding] {
        &self.inner.module.bindings
    }

    /// Bytes of its push constants.
    pub fn push_bytes(&self) -> u32 {
        self.inner.module.push_bytes
    }

    /// Invocations of a workgroup.
    pub fn workgroup_size(&self) -> [u32; 3] {
        self.inner.module.local_size
    }

    /// Workgroups that cover so many invocations along each axis.
    pub fn groups_for(&self, invocations: [u32; 3]) -> [u32; 3] {
        let size = self.workgroup_size();
        [0, 1, 2].map(|axis| invocations[axis].div_ceil(size[axis]))
    }

    fn error(&self, binding: &str, cause: String) -> Error {
        Error::Binding {
            kernel: self.inner.name.clone(),
            binding: binding.into(),
            cause,
        }
    }

    /// Fails for what is missing, unknown, given twice, of another kind, too small, out of place, or in the way of another; else the
    /// resources in the order of the bindings.
    fn check<'a>(&self, gpu: &Inner, given: &[(&str, OwnResource<'a>)], push: &[u8]) -> Result<Vec<OwnResource<'a>>> {
        let bindings = self.bindings();
        let mut seen = BTreeSet::new();
        for (name, _) in given {
            if !bindings.iter().any(|binding| binding.name == *name) {
                let known: Vec<_> = bindings.iter().map(|binding| binding.name.as_str()).collect();
                let cause = format!("is not declared; the source has {}", known.join(", "));
                return Err(self.error(name, cause));
            }
            if !seen.insert(*name) {
                return Err(self.error(name, "is given twice".into()));
            }
        }
        if push.len() as u64 != u64::from(self.push_bytes()) {
            let cause = format!("are {} bytes, and {} were given", self.push_bytes(), push.len());
            return Err(self.error("push constants", cause));
        }
        let mut resources: Vec<OwnResource<'a>> = Vec::with_capacity(bindings.len());
        for binding in bindings {
            let found = given.iter().find(|(name, _)| *name == binding.name);
            let Some((_, resource)) = found else {
                return Err(self.error(&binding.name, format!("is {}, and was not given", binding.what())));
            };
            self.check_one(gpu, binding, resource)?;
            resources.push(*resource);
        }
        for (i, one) in bindings.iter().enumerate().filter(|(_, binding)| binding.writes) {
            let other = (0..bindings.len()).find(|j| *j != i && overlap(&resources[i].view(), &resources[*j].view()));
            if let Some(other) = other {
                let cause = format!("is written, and lies over what was given as {}", bindings[other].name);
                return Err(self.error(&one.name, cause));
            }
        }
        Ok(resources)
    }

    fn check_one(&self, gpu: &Inner, binding: &OwnBinding, resource: &OwnResource<'_>) -> Result<()> {
        let refuse = |cause: String| Err(self.error(&binding.name, cause));
        let wants_texels = binding.kind == BindingKind::TexelBuffer;
        match resource {
            OwnResource::Texels(_) if !wants_texels => {
                return refuse(format!("is {}, and was given texels", binding.what()));
            }
            OwnResource::Buffer(_) | OwnResource::ReadOnly(_) if wants_texels => {
                return refuse(format!("is {}, and was given a buffer", binding.what()));
            }
            OwnResource::ReadOnly(_) if binding.writes => {
                return refuse(format!("is {}, and was given to be read only", binding.what()));
            }
            _ => {}
        }
        let view = resource.view();
        if view.bytes < binding.least_bytes {
            return refuse(format!(
                "takes at least {} bytes, and was given {} of {:?}",
                binding.least_bytes,
                view.bytes,
                view.buffer.name()
            ));
        }
        let (usage, alignment) = match binding.kind {
            // The view was checked when it was made.
            BindingKind::TexelBuffer => return Ok(()),
            BindingKind::UniformBuffer => (vk::BufferUsageFlags::UNIFORM_BUFFER, gpu.caps.uniform_buffer_alignment),
            _ => (vk::BufferUsageFlags::STORAGE_BUFFER, gpu.caps.storage_buffer_alignment),
        };
        let placed = view.check(alignment).and_then(|()| view.check_usage(usage));
        let limit = gpu.caps.max_uniform_buffer_range;
        match placed {
            Err(error) => refuse(format!("cannot be bound: {error}")),
            Ok(()) if binding.kind == BindingKind::UniformBuffer && view.bytes > limit => refuse(format!(
                "was given {} bytes, more than maxUniformBufferRange = {limit}",
                view.bytes
            )),
            Ok(()) => Ok(()),
        }
    }
}

/// Both lie in one Vulkan buffer and share bytes.
fn overlap(a: &BufferView<'_>, b: &BufferView<'_>) -> bool {
    let ends_before = |a: &BufferView<'_>, b: &BufferView<'_>| a.raw_offset() + a.bytes <= b.raw_offset();
    a.buffer.raw() == b.buffer.raw() && !ends_before(a, b) && !ends_before(b, a)
}

fn check_limits(gpu: &Inner, name: &str, module: &Module) -> Result<()> {
    check_workgroup(gpu, name, module.local_size)?;
    let sets = gpu.caps.descriptors.bound_sets;
    for binding in &module.bindings {
        let refuse = |cause: String| {
            Err(Error::Binding {
                kernel: name.into(),
                binding: binding.name.clone(),
                cause,
            })
        };
        if binding.set >= sets {
            let cause = format!(
                "is in descriptor set {}; the device binds {sets}, from 0 on",
                binding.set
            );
            return refuse(cause);
        }
        if binding.binding >= BINDINGS_MAX {
            let cause = format!(
                "has number {}, and the last one is {}",
                binding.binding,
                BINDINGS_MAX - 1
            );
            return refuse(cause);
        }
    }
    let most = gpu.caps.max_shared_memory;
    if module.shared_bytes > u64::from(most) {
        return Err(Error::MissingFeature {
            feature: format!("maxComputeSharedMemorySize >= {}", module.shared_bytes),
            needed_by: name.into(),
            device: gpu.caps.device.clone(),
            instead: format!("use at most {most} bytes of workgroup variables"),
        });
    }
    Ok(())
}

impl Pass<'_> {
    /// Dispatches workgroups of a host's own kernel, with what it is given by the names of its bindings, and its push constants as bytes.
    /// State bound before is lost. Barriers are the author's, as of any dispatch; debug builds check them by what the source declares.
    ///
    /// # Errors
    /// [`Error::Binding`] for what does not fit, [`Error::LimitExceeded`] past `maxComputeWorkGroupCount`, both before anything is recorded;
    /// [`Error::Setting`] for what belongs to another device; [`Error::MissingBarrier`] in debug builds.
    pub fn dispatch_own(
        &mut self,
        kernel: &OwnKernel,
        given: &[(&str, OwnResource<'_>)],
        push: &[u8],
        groups: [u32; 3],
    ) -> Result<()> {
        self.check_groups(&kernel.inner.name, groups)?;
        let gpu = Arc::clone(&self.recorder.gpu.inner);
        self.recorder
            .check_device(kernel.inner.objects.gpu(), "kernel", &kernel.inner.name)?;
        let resources = kernel.check(&gpu, given, push)?;
        self.recorder.next_command();
        self.recorder.keep(&kernel.inner);
        let objects = &kernel.inner.objects;
        let mut sets = Vec::new();
        for (set, layout) in (0u32..).zip(&objects.sets) {
            let in_set = |(binding, _): &(&OwnBinding, &OwnResource<'_>)| binding.used && binding.set == set;
            let mut members = kernel.bindings().iter().zip(&resources).filter(in_set).peekable();
            if members.peek().is_none() {
                continue;
            }
            let raw = self.recorder.resources().descriptor_set(&gpu, *layout)?;
            for (binding, resource) in members {
                let slot = Slot {
                    shader: &kernel.inner.name,
                    name: &binding.name,
                    binding: binding.binding,
                    kind: binding.kind,
                    view: None,
                    // Checked on every device.
                    fixed_bytes: 0,
                    access: binding.access(),
                };
                self.write_descriptor(raw, &slot, resource.bound())?;
            }
            sets.push((set, raw));
        }
        let point = vk::PipelineBindPoint::COMPUTE;
        let [x, y, z] = groups;
        // SAFETY: pipeline, layout and sets are alive and come from one reflection; the push constants and counts were checked.
        unsafe {
            gpu.device.cmd_bind_pipeline(self.command_buffer, point, objects.raw);
            for (set, raw) in sets {
                gpu.device
                    .cmd_bind_descriptor_sets(self.command_buffer, point, objects.layout, set, &[raw], &[]);
            }
            if !push.is_empty() {
                let stages = vk::ShaderStageFlags::COMPUTE;
                gpu.device
                    .cmd_push_constants(self.command_buffer, objects.layout, stages, 0, push);
            }
            gpu.device.cmd_dispatch(self.command_buffer, x, y, z);
        }
        Ok(())
    }
}
