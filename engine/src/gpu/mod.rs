//! Floor 1: a thin layer over Vulkan, with everything that a kernel needs and nothing that decides for it.
//!
//! A [`Gpu`] is a device with one queue. Work is recorded by hand into a [`Recorder`], pass by pass, with explicit barriers, and submitted
//! on a timeline, or into a host's command buffer, which the host submits ([`Recorder::borrow`]). All handles are cheap to clone and keep what they need alive; what the device still uses is kept by its [`Submission`].
//!
//! `unsafe` lives in this folder and at the FFI edge only.
#![expect(unsafe_code, reason = "Vulkan is called here")]

mod barrier;
mod bind;
mod borrow;
mod buffer;
mod caps;
mod copy;
mod create;
mod device;
pub mod fault;
#[cfg(feature = "hot-reload")]
mod glsl;
mod graphics;
mod host;
#[cfg(feature = "hot-reload")]
mod hot_reload;
mod image;
mod image_part;
mod instance;
pub mod interface;
mod layout;
mod marker;
mod memory;
mod options;
#[cfg(any(feature = "wgsl", feature = "hot-reload"))]
mod own_kernel;
mod pace;
mod pipeline;
mod pipeline_cache;
mod recorded;
pub(crate) mod recorder;
#[cfg(feature = "hot-reload")]
#[path = "../../build/reflect.rs"]
mod reflect;
mod rendering;
mod resources;
// A method of one kernel has a kernel of its name.
#[allow(clippy::module_inception)]
pub mod shaders;
mod submission;
mod surface;
mod texels;
mod timing;
mod tracker;
mod transfer;
mod wide_counter;

pub use ash;
pub use barrier::{
    Access, BufferBarrier, ImageBarrier, compute_to_indirect, compute_to_transfer, rw_compute_to_compute,
    transfer_to_compute,
};
pub use borrow::{BorrowDesc, BorrowedRecorder, HostBuffer};
pub use buffer::{Buffer, BufferDesc, BufferView, Residency};
pub use caps::{Caps, DescriptorLimits, DeviceKind, SOFTWARE_LOOP_CAP, SubgroupOperations};
pub use device::{Gpu, QueueGuard};
pub use graphics::{Cull, DepthBias, GeometryStage, GraphicsDesc, GraphicsPipeline, NoGeometry};
pub use host::{DeviceFeatures, EnabledFeatures, HostDevice, OptionalFeatures};
#[cfg(feature = "hot-reload")]
pub use hot_reload::HotReload;
pub use image::{Image, ImageDesc, Sampler, SamplerDesc};
pub use image_part::ImagePart;
pub use instance::{DeviceSummary, VALIDATION_LAYER, ValidationLog, ValidationMessage};
pub use layout::ExceededLimit;
pub use memory::{AllocationInfo, Category, MemoryReport};
pub use options::{DeviceSelection, GpuOptions, Lesser, Validation};
#[cfg(any(feature = "wgsl", feature = "hot-reload"))]
pub use own_kernel::{OwnBinding, OwnKernel, OwnResource};
pub(crate) use pace::Pace;
pub use pipeline::{ComputePipeline, PipelineInfo};
pub use recorded::Recorded;
pub use recorder::{Pass, Recorder};
pub use rendering::{Area, ClearColor, ColorTarget, DepthTarget, Render, Targets};
pub use submission::Submission;
pub use surface::{Presented, Surface};
pub use texels::TexelView;
pub use timing::{Drawn, PassTiming, Timings};
pub use wide_counter::wide_counter;
