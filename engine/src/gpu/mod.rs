//! Floor 1: a thin layer over Vulkan, with everything that a kernel needs and nothing that decides for it.
//!
//! A [`Gpu`] is a device with one queue. Work is recorded by hand into a [`Recorder`], pass by pass, with explicit barriers, and submitted
//! on a timeline, or into a host's command buffer, which the host submits ([`Recorder::borrow`]). All handles are cheap to clone and keep what they need alive; what the device still uses is kept by its [`Submission`].
//!
//! `unsafe` lives in this folder and at the FFI edge only.
//!
//! # What safe calls can do to memory
//!
//! Every public safe function here, with what keeps it from breaking the memory of its process or its device. What is checked is checked in release
//! builds, too, and before anything is recorded.
//!
//! | call | what could go wrong | what holds |
//! |---|---|---|
//! | [`Gpu::headless`], [`Gpu::for_window`], [`Gpu::list`], [`Gpu::surface`] | handles of windows that are gone | borrowed while they are used; a [`Surface`] keeps its window. `robustBufferAccess` is enabled on every device made here, whatever [`Lesser`] says |
//! | [`GpuOptions::fault`] | trampolines of one driver called with another's handles | one device at a time has a plan |
//! | [`GpuOptions::cache_folder`] | a pipeline cache that is damaged or of another device reaches the driver | length, version, device and hash are checked before. They do not find what somebody has forged: name a folder that only its user writes |
//! | [`Gpu::buffer`], [`Gpu::buffer_with`], [`Gpu::storage_texels`], [`Gpu::texels_with`] | sizes that wrap, uses and formats without their features | sizes are checked before they are rounded; uses are Vulkan 1.0's; formats have known texels and the device's word |
//! | [`Gpu::image`], [`Image::part`], [`Gpu::sampler`] | sizes, layers, formats, filters that the device lacks | asked of the device, or from a list |
//! | [`Gpu::texel_view_of`] | a view past its buffer's end, or of another device's | whole texels of the buffer; device, use, alignment and limits |
//! | [`Gpu::box_structure`] | boxes that drivers cannot build of, memory that goes while it is built | corners are finite and in order, counts within the limit; it waits for the build |
//! | [`Buffer::write`], [`Buffer::read`] | races with threads and with the device; a count beyond the buffer | the buffer's lock, which a submission takes, too; an error while a submission that uses it is not over; the range, before memory is taken |
//! | [`Gpu::upload`], [`Gpu::read`] | ranges past the end | the range; the staging memory is theirs alone |
//! | [`Gpu::compute_pipeline`], [`Gpu::ray_query_pipeline`], [`Gpu::graphics_pipeline`] | modules that are not valid or not as their interface says | shaders are types of `unsafe` traits ([`ComputeShader`](interface::ComputeShader) …), which the build implements from reflection; a pipeline is found by its interface's place, not its name; workgroups, descriptors, formats and states are checked |
//! | `OwnKernel::wgsl`, [`Pass`]`::dispatch_own` | any source | validated; every index is checked in the kernel; bindings, sizes, overlaps and push constants where it is dispatched |
//! | [`Pass::dispatch`], [`Pass::dispatch_indirect`], [`Render::draw`], [`Render::draw_indirect`] | foreign or missing resources, short push constants, too many workgroups | device, kind, use, range, alignment and limits of each binding; the size of push constants; counts from the host. Sets, push constants and specialization constants come by safe traits, and are checked for that |
//! | [`Pass::fill`], [`Pass::update`], [`Pass::copy`] and those with images | ranges past the end, parts over each other | ranges, whole words, overlap, device and use |
//! | [`Pass::barrier`], [`Pass::image_barrier`], [`Pass::memory_barrier`] | handles of another device, layouts that an image cannot be in | device and use; a refused one is left out, and the pass fails |
//! | [`Pass::render`] | targets that differ, are no targets, or are too many | size, area, layers, views, device and use; attachments are those that the pipeline was made for |
//! | [`Recorder::pass`], [`Recorder::submit`] | passes without an end after a panic | a recorder with one is not submitted; a rendering ends when its closure panics |
//! | [`BorrowedRecorder`] as `&mut` [`Recorder`] | another recorder in its place, whose `Recorded` keeps nothing of the host's command buffer | [`BorrowedRecorder::finish`] compares the command buffers |
//! | [`Submission`], [`Recorded`] | memory that goes while the device uses it | both keep all that was recorded; a submission waits when it is dropped. One that is leaked leaks what it keeps |
//! | [`Surface::present`] | an image that is kept beyond its swapchain | images keep their swapchain, and that its surface and window |
//! | `raw` of anything, [`Gpu::raw_device`], [`Gpu::lock_queue`] | nothing: what is done with handles is `unsafe` in `ash` | |
//!
//! `unsafe`, each with its conditions: [`Gpu::from_host`], [`Gpu::borrow_buffer`], [`Recorder::borrow`], [`Recorder::submit_with`],
//! [`Buffer::read_in_use`], the traits of shaders and [`GeometryStage`], and with the feature `hot-reload` `OwnKernel::glsl` and `HotReload::new`.
//!
//! [`Gpu`], [`Buffer`], [`Image`], [`TexelView`], [`Sampler`] and pipelines are shared between threads; what changes inside of them has its lock (the
//! queue, memory, the table of pipelines, recycled command buffers, mapped buffers). A [`Recorder`] is changed through `&mut` alone.
//!
//! What no check catches, and what it costs:
//! - *A missing barrier or a wrong layout* leaves what is read undefined (rubbish, or a device that hangs or is lost). Debug builds refuse missing
//!   barriers over buffers; layouts are the author's.
//! - *A kernel's own arrays*. Kernels stay inside of them for what their documentation allows; a host that dispatches one of [`shaders`] by itself,
//!   with other push constants, specialization constants or contents of buffers (an index that is no tree, say), may lead it out of them. In
//!   buffers and texel buffers `robustBufferAccess` keeps it anyway. On a host's device without that feature a range is at
//!   least as long as what a shader reaches there by no index; that indices stay in it [`Gpu::from_host`] makes the host promise.
//! - *The texel format* of an image is not compared with the type that a shader reads or writes it by: what is read is undefined then.
//! - *Counts of indirect dispatches and draws* are the device's to read: more than it can do may hang it.
//! - *What one graphics shader writes and the next one reads* is not compared: a pipeline of shaders that were not written for each other may read what
//!   is undefined, and so may a vertex shader that sets no size for points. That a geometry shader takes the pipeline's primitives is checked.
//! - *The driver's own faults.*
//!
//! The address sanitizer finds nothing in the tests `safe_calls` and `gpu_floor` on the software driver (Rust 1.97 nightly): `RUSTFLAGS=-Zsanitizer=address
//! ASAN_OPTIONS=detect_leaks=0:detect_odr_violation=0 cargo +nightly test --target x86_64-unknown-linux-gnu -p clerestory-tests --test safe_calls`. It sees
//! the host's side of such a driver, not the code that the driver compiles; the two options are for the driver's own leaks and for a C++ library of
//! the tests. Miri has not been run: it knows no calls to a driver, and of what needs no device nothing here is `unsafe`. CI needs neither.
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
mod specialize;
mod structure;
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
pub use host::{DeviceFeatures, EnabledFeatures, HostDevice, OptionalFeatures, RAY_QUERY_EXTENSIONS};
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
pub use structure::{AccelerationStructure, StructureBox};
pub use submission::Submission;
pub use surface::{Presented, Surface};
pub use texels::TexelView;
pub(crate) use timing::seconds_or_waited;
pub use timing::{Drawn, PassTiming, Timings};
pub use wide_counter::wide_counter;
