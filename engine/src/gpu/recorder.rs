//! Recording: labelled, timed passes and explicit barriers into one command buffer.

use std::any::Any;
use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;

use super::barrier::{Access, BufferBarrier, ImageBarrier};
use super::buffer::{Buffer, BufferDesc, BufferView, Residency};
use super::caps::DeviceKind;
use super::device::{Gpu, Inner};
use super::interface::{BindingSet, ComputeShader, PushConstants, ShaderInfo};
use super::marker::BEGUN;
use super::memory::Category;
use super::pipeline::ComputePipeline;
use super::recorded::Recorded;
use super::resources::FrameResources;
use super::submission::{self, Submission};
use super::tracker::Tracker;
use crate::catalogue::{Role, Row, sources};
use crate::{Error, Result};

/// Passes that one recorder can hold.
pub(super) const MAX_PASSES: usize = 1024;

/// Something that a command buffer uses, kept alive until the device is done.
pub(super) type Kept = BTreeMap<usize, Arc<dyn Any + Send + Sync>>;

/// One command buffer under construction: the engine's own, or a host's ([`Recorder::borrow`]).
///
/// How much work one submission may hold is up to its author: see [`Timings`](super::Timings).
///
/// It starts with a barrier over everything, so that a submission may rely on all earlier ones of the same queue. Between its own passes
/// every barrier is the author's; debug builds check that none is missing.
pub struct Recorder {
    pub(super) gpu: Gpu,
    pub(super) name: String,
    /// That of the resources, or a host's.
    pub(super) command_buffer: vk::CommandBuffer,
    pub(super) is_borrowed: bool,
    pub(super) recorded: Recorded,
    pub(super) markers: Option<Buffer>,
    pub(super) tracker: Option<Tracker>,
    /// Why a barrier of the pass was left out.
    pub(super) refused: Option<Error>,
    /// A pass is being recorded, or a panic ended it.
    pub(super) in_pass: bool,
}

/// One pass: what is recorded between two timestamps.
pub struct Pass<'a> {
    pub(super) recorder: &'a mut Recorder,
    pub(super) command_buffer: vk::CommandBuffer,
    pub(super) name: &'a str,
}

impl Gpu {
    /// Begins a command buffer.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn recorder(&self, name: &str) -> Result<Recorder> {
        self.inner.check_alive()?;
        let markers = if self.inner.crash_markers {
            Some(self.buffer(&BufferDesc {
                name: "crash markers",
                bytes: MAX_PASSES as u64 * 4,
                residency: Residency::Readback,
                category: Category::Staging,
                usage: vk::BufferUsageFlags::TRANSFER_DST,
            })?)
        } else {
            None
        };
        if let Some(markers) = &markers {
            markers.write(0, &[0u32; MAX_PASSES])?;
        }
        let recorded = Recorded::new(self, true)?;
        let recorder = Recorder {
            gpu: self.clone(),
            name: name.into(),
            command_buffer: recorded.resources.command_buffer,
            is_borrowed: false,
            recorded,
            markers,
            tracker: cfg!(debug_assertions).then(Tracker::default),
            refused: None,
            in_pass: false,
        };
        recorder.begin()?;
        Ok(recorder)
    }
}

impl Recorder {
    /// Counts the shader invocations and primitives of every pass from here on, where the device can.
    pub fn count_invocations(&mut self) {
        if self.gpu.caps().pipeline_statistics {
            let passes = self.recorded.passes.len();
            self.recorded.counted_from.get_or_insert(passes);
        }
    }

    /// Passes that can still be recorded.
    pub fn passes_left(&self) -> usize {
        MAX_PASSES - self.recorded.passes.len()
    }

    /// Records a pass: a debug label, a timestamp pair and a crash marker around what `record` does.
    ///
    /// # Errors
    /// Whatever `record` returns; [`Error::LimitExceeded`] past 1024 passes; [`Error::Setting`] for a barrier over what belongs to another device or
    /// for a layout that its image was not made for, and after a pass that a panic ended.
    pub fn pass<R>(&mut self, name: &str, record: impl FnOnce(&mut Pass<'_>) -> Result<R>) -> Result<R> {
        self.check_whole()?;
        let index = self.recorded.passes.len();
        if index == MAX_PASSES {
            return Err(Error::LimitExceeded {
                name: self.name.clone(),
                value: index as u64 + 1,
                limit_name: "passes of a recorder",
                limit: MAX_PASSES as u64,
            });
        }
        self.recorded.passes.push(name.into());
        self.recorded.barriers.push(0);
        let inner = Arc::clone(&self.gpu.inner);
        let command_buffer = self.command_buffer;
        let statistics = self.recorded.resources.statistics;
        let (device, counted) = (&inner.device, self.recorded.counted_from.is_some());
        // SAFETY: the command buffer is recording, and the indices lie inside the pools, which were reset.
        unsafe {
            if let Some(debug) = &inner.debug {
                let label = std::ffi::CString::new(name).unwrap_or_default();
                debug
                    .cmd_begin_debug_utils_label(command_buffer, &vk::DebugUtilsLabelEXT::default().label_name(&label));
            }
            if let Some(markers) = &self.markers {
                record_marker(device, command_buffer, markers, index);
            }
            self.write_timestamp(2 * index as u32);
            if counted {
                device.cmd_begin_query(command_buffer, statistics, index as u32, vk::QueryControlFlags::empty());
            }
        }
        self.in_pass = true;
        let result = record(&mut Pass {
            recorder: self,
            command_buffer,
            name,
        });
        self.in_pass = false;
        // SAFETY: as above.
        unsafe {
            if counted {
                device.cmd_end_query(command_buffer, statistics, index as u32);
            }
            self.write_timestamp(2 * index as u32 + 1);
            if let Some(debug) = &inner.debug {
                debug.cmd_end_debug_utils_label(command_buffer);
            }
        }
        let refused = self.refused.take();
        result.and_then(|value| refused.map_or(Ok(value), Err))
    }

    /// Fails after a pass that a panic ended: queries or a rendering that it began have no end.
    pub(super) fn check_whole(&self) -> Result<()> {
        if !self.in_pass {
            return Ok(());
        }
        let cause = "has a pass that a panic ended; record anew";
        Err(Error::setting("recorder", &self.name, cause))
    }

    /// Fails for what was made by another `Gpu`, whose handles mean nothing, or something else, to this one's device.
    pub(super) fn check_device(&self, of: &Arc<Inner>, kind: &str, name: &str) -> Result<()> {
        if Arc::ptr_eq(of, &self.gpu.inner) {
            return Ok(());
        }
        let cause = format!("belongs to another device than the recorder {:?}", self.name);
        Err(Error::setting(kind, name, cause))
    }

    /// Where the device has timestamps.
    ///
    /// Once a software driver has drawn, it keeps a timestamp for the draws to come, and would take it after dispatches that were recorded behind it.
    /// A barrier that nothing waits at makes it take the timestamp now; validation sees no dependency in it.
    ///
    /// # Safety
    /// The command buffer is recording, outside a rendering, and the index is one of the pool's, reset and not written yet.
    unsafe fn write_timestamp(&self, index: u32) {
        let command_buffer = self.command_buffer;
        let timestamps = self.recorded.resources.timestamps;
        if timestamps == vk::QueryPool::null() || !self.recorded.is_timed {
            return;
        }
        let device = &self.gpu.inner.device;
        let nothing = [vk::MemoryBarrier2::default()];
        // SAFETY: the caller's.
        unsafe {
            device.cmd_write_timestamp2(command_buffer, vk::PipelineStageFlags2::ALL_COMMANDS, timestamps, index);
            if self.gpu.caps().kind == DeviceKind::Cpu {
                device.cmd_pipeline_barrier2(command_buffer, &vk::DependencyInfo::default().memory_barriers(&nothing));
            }
        }
    }

    /// Ends the command buffer and hands it to the queue.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`]; [`Error::Setting`] for a host's command buffer, which the host submits.
    pub fn submit(self) -> Result<Submission> {
        // SAFETY: there are no semaphores.
        unsafe { self.submit_with(&[], &[]) }
    }

    /// As [`Recorder::submit`], waiting for and signalling binary semaphores (those of a swapchain).
    ///
    /// ```compile_fail,E0133
    /// # use clerestory::gpu::{Recorder, ash::vk};
    /// # fn host(recorder: Recorder, semaphore: vk::Semaphore) {
    /// let submission = recorder.submit_with(&[semaphore], &[]);
    /// # }
    /// ```
    ///
    /// # Errors
    /// As [`Recorder::submit`].
    ///
    /// # Safety
    /// The semaphores are binary ones of the recorder's device, and live until the submission is over. Those in `wait` are signalled, or will be by
    /// what was submitted before; nothing else waits for them. Those in `signal` are not signalled, and nothing else signals them meanwhile.
    pub unsafe fn submit_with(self, wait: &[vk::Semaphore], signal: &[vk::Semaphore]) -> Result<Submission> {
        let inner = Arc::clone(&self.gpu.inner);
        inner.check_alive()?;
        self.check_whole()?;
        if self.is_borrowed {
            return Err(Error::setting(
                "recorder",
                self.name,
                "records into a host's command buffer, which the host submits",
            ));
        }
        let command_buffer = self.command_buffer;
        let host = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        // SAFETY: the command buffer is recording.
        unsafe {
            inner
                .device
                .cmd_pipeline_barrier2(command_buffer, &vk::DependencyInfo::default().memory_barriers(&host));
            inner
                .device
                .end_command_buffer(command_buffer)
                .map_err(|r| inner.error("vkEndCommandBuffer", r))?;
        }
        let mut queue = inner.lock_queue();
        let value = queue.last_value + 1;
        if let Some(markers) = &self.markers {
            inner
                .in_flight()
                .begin(value, markers.clone(), self.recorded.passes.clone());
        }
        // From here on the device may use mapped memory, and the host waits until it is known whether it does.
        let mut mapped: Vec<_> = self.recorded.mapped.values().map(|buffer| buffer.lock()).collect();
        // SAFETY: everything that the command buffer uses is in `kept` until the timeline has reached `value`; the semaphores are the caller's.
        let submitted = unsafe { submission::submit(&inner, queue.raw, command_buffer, wait, signal, value) };
        if matches!(submitted, Ok(()) | Err(Error::DeviceLost { .. })) {
            mapped.iter_mut().for_each(|until| **until = value);
        }
        drop(mapped);
        if let Err(error) = submitted {
            drop(queue);
            inner.in_flight().end(value, false);
            // A device that was lost by this call may have begun with it, and still be stopping.
            inner.wait_for_queue();
            return Err(error);
        }
        queue.last_value = value;
        drop(queue);
        Ok(Submission {
            gpu: self.gpu,
            name: self.name,
            value,
            recorded: self.recorded,
            finished: false,
        })
    }

    fn begin(&self) -> Result<()> {
        let inner = &self.gpu.inner;
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the command buffer is fresh or reset.
        unsafe {
            inner
                .device
                .begin_command_buffer(self.command_buffer, &info)
                .map_err(|r| inner.error("vkBeginCommandBuffer", r))?;
            self.barrier_over_everything();
        }
        Ok(())
    }

    /// All commands before, of earlier submissions, too, then all that follow.
    ///
    /// # Safety
    /// The command buffer is recording, outside a rendering.
    pub(super) unsafe fn barrier_over_everything(&self) {
        let all = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)];
        let info = vk::DependencyInfo::default().memory_barriers(&all);
        // SAFETY: the caller's.
        unsafe { self.gpu.inner.device.cmd_pipeline_barrier2(self.command_buffer, &info) };
    }

    pub(super) fn resources(&mut self) -> &mut FrameResources {
        &mut self.recorded.resources
    }

    pub(super) fn keep<T: Any + Send + Sync>(&mut self, item: &Arc<T>) {
        let key = Arc::as_ptr(item).cast::<()>() as usize;
        self.recorded
            .kept
            .entry(key)
            .or_insert_with(|| Arc::clone(item) as Arc<dyn Any + Send + Sync>);
    }

    pub(super) fn touch(&mut self, pass: &str, buffer: &Buffer, access: Access) -> Result<()> {
        self.check_device(&buffer.inner.gpu, "buffer", buffer.name())?;
        self.keep(&buffer.inner);
        if buffer.inner.is_mapped() {
            let mapped = &mut self.recorded.mapped;
            mapped
                .entry(buffer.inner.id)
                .or_insert_with(|| Arc::clone(&buffer.inner));
        }
        self.tracker
            .as_mut()
            .map_or(Ok(()), |tracker| tracker.touch(pass, buffer, access))
    }

    pub(super) fn next_command(&mut self) {
        if let Some(tracker) = &mut self.tracker {
            tracker.next_command();
        }
    }
}

/// Writes the marker of a pass: once all before has ended, and before anything of the pass begins. So the last marker is the pass that the
/// device really was in. Written where the host can see it at once, since a lost device flushes nothing more.
///
/// # Safety
/// The command buffer must be recording outside rendering, and the buffer must live until it has been executed.
unsafe fn record_marker(device: &ash::Device, command_buffer: vk::CommandBuffer, markers: &Buffer, index: usize) {
    let (all, transfer) = (
        vk::PipelineStageFlags2::ALL_COMMANDS,
        vk::PipelineStageFlags2::ALL_TRANSFER,
    );
    let before = [vk::MemoryBarrier2::default()
        .src_stage_mask(all)
        .dst_stage_mask(transfer)];
    let after = [vk::MemoryBarrier2::default()
        .src_stage_mask(transfer)
        .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
        .dst_stage_mask(all | vk::PipelineStageFlags2::HOST)
        .dst_access_mask(vk::AccessFlags2::HOST_READ)];
    // SAFETY: see above; the index lies inside the buffer.
    unsafe {
        device.cmd_pipeline_barrier2(command_buffer, &vk::DependencyInfo::default().memory_barriers(&before));
        device.cmd_fill_buffer(command_buffer, markers.raw(), index as u64 * 4, 4, BEGUN);
        device.cmd_pipeline_barrier2(command_buffer, &vk::DependencyInfo::default().memory_barriers(&after));
    }
}

impl Pass<'_> {
    /// Dispatches workgroups of a kernel with its descriptor sets and push constants. State bound before is lost.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] past `maxComputeWorkGroupCount` and for a range that is not in its buffer, [`Error::Shader`] when the sets do not
    /// cover the shader's bindings, [`Error::Setting`] for what belongs to another device or was not made for the use,
    /// [`Error::MissingBarrier`] in debug builds.
    pub fn dispatch<K: ComputeShader>(
        &mut self,
        pipeline: &ComputePipeline<K>,
        sets: &[&dyn BindingSet<'_>],
        push: &K::Push,
        groups: [u32; 3],
    ) -> Result<()> {
        self.check_groups(pipeline.inner.info.name, groups)?;
        self.recorder.next_command();
        self.bind(pipeline, sets, push)?;
        let [x, y, z] = groups;
        // SAFETY: pipeline, sets and push constants are bound, and the count was checked.
        unsafe {
            self.recorder
                .gpu
                .inner
                .device
                .cmd_dispatch(self.command_buffer, x, y, z)
        };
        Ok(())
    }

    /// As [`Pass::dispatch`], with the workgroup counts (three words) read from a buffer.
    ///
    /// # Errors
    /// As [`Pass::dispatch`].
    pub fn dispatch_indirect<K: ComputeShader>(
        &mut self,
        pipeline: &ComputePipeline<K>,
        sets: &[&dyn BindingSet<'_>],
        push: &K::Push,
        arguments: BufferView<'_>,
    ) -> Result<()> {
        let words = BufferView { bytes: 12, ..arguments };
        words.check(4)?;
        words.check_usage(vk::BufferUsageFlags::INDIRECT_BUFFER)?;
        self.recorder.next_command();
        self.recorder
            .touch(self.name, arguments.buffer, Access::INDIRECT_READ)?;
        self.bind(pipeline, sets, push)?;
        // SAFETY: as in `dispatch`; the arguments are kept alive.
        unsafe {
            self.recorder.gpu.inner.device.cmd_dispatch_indirect(
                self.command_buffer,
                arguments.buffer.raw(),
                arguments.raw_offset(),
            );
        }
        Ok(())
    }

    /// Records buffer barriers: none where a buffer belongs to another device, which is an error of the pass.
    pub fn barrier(&mut self, barriers: &[BufferBarrier<'_>]) {
        let of_this = barriers.iter().try_for_each(|barrier| {
            let buffer = barrier.buffer;
            self.recorder.check_device(&buffer.inner.gpu, "buffer", buffer.name())
        });
        if let Err(error) = of_this {
            self.recorder.refused.get_or_insert(error);
            return;
        }
        let raw: Vec<_> = barriers
            .iter()
            .map(|barrier| {
                let (from, to) = self.usable(barrier.from, barrier.to);
                if let Some(tracker) = &mut self.recorder.tracker {
                    tracker.barrier(barrier.buffer, barrier.from, barrier.to);
                }
                vk::BufferMemoryBarrier2::default()
                    .buffer(barrier.buffer.raw())
                    .offset(barrier.buffer.raw_offset())
                    .size(barrier.buffer.bytes())
                    .src_stage_mask(from.stages())
                    .src_access_mask(from.writes().kinds())
                    .dst_stage_mask(to.stages())
                    .dst_access_mask(to.kinds())
                    .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            })
            .collect();
        for barrier in barriers {
            self.recorder.keep(&barrier.buffer.inner);
        }
        self.pipeline_barrier(&vk::DependencyInfo::default().buffer_memory_barriers(&raw));
    }

    /// Records one barrier over all memory: cheaper to write than a long list, and no slower on most devices.
    pub fn memory_barrier(&mut self, from: Access, to: Access) {
        if let Some(tracker) = &mut self.recorder.tracker {
            tracker.barrier_all(from, to);
        }
        let (from, to) = self.usable(from, to);
        let barrier = [vk::MemoryBarrier2::default()
            .src_stage_mask(from.stages())
            .src_access_mask(from.writes().kinds())
            .dst_stage_mask(to.stages())
            .dst_access_mask(to.kinds())];
        self.pipeline_barrier(&vk::DependencyInfo::default().memory_barriers(&barrier));
    }

    /// Records image barriers and layout transitions: none where an image belongs to another device or was not made for a layout, which is an
    /// error of the pass. That the layout before is the one that the image is in is the author's to know.
    pub fn image_barrier(&mut self, barriers: &[ImageBarrier<'_>]) {
        let sound = barriers.iter().try_for_each(|barrier| {
            let image = barrier.image;
            self.recorder.check_device(&image.inner.gpu, "image", image.name())?;
            if barrier.old_layout != vk::ImageLayout::UNDEFINED {
                image.check_layout(barrier.old_layout)?;
            }
            image.check_layout(barrier.new_layout)
        });
        if let Err(error) = sound {
            self.recorder.refused.get_or_insert(error);
            return;
        }
        let raw: Vec<_> = barriers
            .iter()
            .map(|barrier| {
                let (from, to) = self.usable(barrier.from, barrier.to);
                vk::ImageMemoryBarrier2::default()
                    .image(barrier.image.raw())
                    .subresource_range(barrier.image.inner.range)
                    .src_stage_mask(from.stages())
                    .src_access_mask(from.writes().kinds())
                    .dst_stage_mask(to.stages())
                    .dst_access_mask(to.kinds())
                    .old_layout(barrier.old_layout)
                    .new_layout(barrier.new_layout)
                    .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
                    .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            })
            .collect();
        for barrier in barriers {
            self.recorder.keep(&barrier.image.inner);
        }
        self.pipeline_barrier(&vk::DependencyInfo::default().image_memory_barriers(&raw));
    }

    /// The Vulkan command buffer, for commands that have no method here. What they touch is the caller's to keep alive and to
    /// synchronize.
    pub fn raw(&self) -> vk::CommandBuffer {
        self.command_buffer
    }

    /// Fails for more workgroups than the device dispatches.
    pub(super) fn check_groups(&self, shader: &str, groups: [u32; 3]) -> Result<()> {
        const NAMES: [&str; 3] = [
            "maxComputeWorkGroupCount[0]",
            "maxComputeWorkGroupCount[1]",
            "maxComputeWorkGroupCount[2]",
        ];
        let limits = self.recorder.gpu.caps().max_workgroups;
        match (0..3).find(|axis| groups[*axis] > limits[*axis]) {
            None => Ok(()),
            Some(axis) => Err(Error::LimitExceeded {
                name: shader.into(),
                value: u64::from(groups[axis]),
                limit_name: NAMES[axis],
                limit: u64::from(limits[axis]),
            }),
        }
    }

    /// The uses that the device has stages for.
    fn usable(&self, from: Access, to: Access) -> (Access, Access) {
        let caps = self.recorder.gpu.caps();
        (from.on(caps), to.on(caps))
    }

    fn pipeline_barrier(&mut self, info: &vk::DependencyInfo<'_>) {
        if let Some(count) = self.recorder.recorded.barriers.last_mut() {
            *count += 1;
        }
        // SAFETY: the command buffer is recording, outside rendering.
        unsafe {
            self.recorder
                .gpu
                .inner
                .device
                .cmd_pipeline_barrier2(self.command_buffer, info)
        };
    }

    fn bind<K: ComputeShader>(
        &mut self,
        pipeline: &ComputePipeline<K>,
        sets: &[&dyn BindingSet<'_>],
        push: &K::Push,
    ) -> Result<()> {
        let inner = Arc::clone(&self.recorder.gpu.inner);
        let info = pipeline.inner.info;
        self.recorder
            .check_device(pipeline.inner.objects.gpu(), "pipeline", info.name)?;
        let bytes = push.bytes();
        check_push(info, bytes)?;
        self.recorder.keep(&pipeline.inner);
        let point = vk::PipelineBindPoint::COMPUTE;
        // SAFETY: pipeline, layout and sets are alive and come from one reflection.
        unsafe {
            inner
                .device
                .cmd_bind_pipeline(self.command_buffer, point, pipeline.inner.objects.raw)
        };
        self.bind_sets(
            &[info],
            point,
            pipeline.inner.objects.layout,
            &pipeline.inner.objects.sets,
            sets,
        )?;
        if !bytes.is_empty() {
            let stages = vk::ShaderStageFlags::COMPUTE;
            // SAFETY: the bytes are as many as the block has, which was checked.
            unsafe {
                inner
                    .device
                    .cmd_push_constants(self.command_buffer, pipeline.inner.objects.layout, stages, 0, bytes)
            };
        }
        Ok(())
    }
}

/// Fails for push constants of another size than the shader's block.
pub(super) fn check_push(shader: &ShaderInfo, bytes: &[u8]) -> Result<()> {
    if bytes.len() == shader.push_constant_bytes as usize {
        return Ok(());
    }
    Err(Error::Shader {
        name: shader.name.into(),
        message: format!(
            "its push constants have {} bytes, and {} were given",
            shader.push_constant_bytes,
            bytes.len()
        ),
    })
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-BARRIERS",
    name: "hand-recorded passes whose missing barriers are errors",
    role: Role::Service,
    limits: "Debug builds only, and only what passes declare to read and write.",
    sources: &[sources::KHRONOS_VULKAN.at("chapter 7")],
    tests: &[
        "tests/tests/gpu_floor.rs::missing_barrier_is_an_error_that_names_both_passes",
        "tests/tests/gpu_floor.rs::write_after_read_and_wrong_scope_are_hazards",
        "tests/tests/layers.rs::the_recorder_catches_a_missing_barrier_between_dispatches",
    ],
    api: &["clerestory::gpu::Recorder", "clerestory::gpu::Pass"],
    settings: &["clerestory::gpu::GpuOptions"],
    ..Row::of(file!())
}];
