//! Recording into a host's command buffer, over a host's buffers.
//!
//! Whatever takes a [`Recorder`] or a [`Pass`](super::Pass) records into a command buffer of the host's, too: kernels, builds, raster passes
//! and frames. Nothing is begun, submitted or waited for; what the commands use is kept in a [`Recorded`] that the host drops when the
//! device is done. Memory is asked for before: every kernel says how much scratch it needs, and allocates none while it records.
//!
//! ```no_run
//! use clerestory::gpu::ash::vk;
//! use clerestory::gpu::{BorrowDesc, Gpu, Recorder};
//! use clerestory::kernels::{Count, RadixSort, SortBuffers};
//!
//! # fn host(gpu: &Gpu, commands: vk::CommandBuffer, sort: &RadixSort, sides: &SortBuffers<'_>, scratch: &clerestory::gpu::Buffer)
//! # -> clerestory::Result<()> {
//! // The host's own passes stand before; its buffer `commands` is recording.
//! // SAFETY: it is recorded by this thread alone, and `recorded` is kept until its fence has been waited for.
//! let mut recorder = unsafe { Recorder::borrow(gpu, &BorrowDesc::new("host's frame", commands))? };
//! recorder.pass("sort", |pass| sort.record(pass, sides, Count::Host(1000), scratch))?;
//! let recorded = recorder.finish()?;
//! // The host's own passes follow; it ends the command buffer, submits it, waits for its fence, and then:
//! println!("{:.3} ms", 1e3 * recorded.timings().seconds());
//! drop(recorded);
//! # Ok(())
//! # }
//! ```

use std::ops::{Deref, DerefMut};
use std::sync::{Arc, Mutex};

use ash::vk;

use super::barrier::Access;
use super::buffer::{Buffer, BufferInner, Memory};
use super::device::Gpu;
use super::recorded::Recorded;
use super::recorder::Recorder;
use super::tracker::Tracker;
use crate::{Error, Result};

/// How a host's command buffer is recorded into.
#[derive(Debug, Clone, Copy)]
pub struct BorrowDesc<'a> {
    /// Shown in errors.
    pub name: &'a str,
    /// The command buffer.
    pub command_buffer: vk::CommandBuffer,
    /// Passes write timestamps, for [`Recorded::timings`]. A command buffer with timestamps can be submitted once. Default false.
    pub timestamps: bool,
    /// Recording opens with a barrier from all commands before, those of earlier submissions to the queue included, to all that follow. A
    /// host that clears it orders the engine's first passes itself: after what its own commands wrote, and after the engine's own
    /// submissions (uploads, a scene's and a map's making). Default true.
    pub opening_barrier: bool,
}

impl<'a> BorrowDesc<'a> {
    /// With an opening barrier and no timestamps.
    pub fn new(name: &'a str, command_buffer: vk::CommandBuffer) -> Self {
        Self {
            name,
            command_buffer,
            timestamps: false,
            opening_barrier: true,
        }
    }
}

/// A recorder on a host's command buffer: a [`Recorder`] that is not submitted.
///
/// Dropped without [`BorrowedRecorder::finish`], as after an error, it leaves a command buffer that must be reset.
pub struct BorrowedRecorder {
    recorder: Recorder,
    /// The host's command buffer: what holds a `&mut Recorder` may put another recorder in this one's place.
    lent: vk::CommandBuffer,
}

impl Deref for BorrowedRecorder {
    type Target = Recorder;

    fn deref(&self) -> &Recorder {
        &self.recorder
    }
}

impl DerefMut for BorrowedRecorder {
    fn deref_mut(&mut self) -> &mut Recorder {
        &mut self.recorder
    }
}

impl BorrowedRecorder {
    /// Ends the borrowing; records nothing. Of what was recorded, the last barriers are those that each kernel and pass documents: mostly
    /// writes are visible to compute shaders, and the host writes the barrier to its own uses.
    ///
    /// # Errors
    /// [`Error::Setting`] when a pass has no end, since a panic ended it, or when what recorded has put another recorder in this one's place:
    /// the command buffer must not be executed then.
    pub fn finish(self) -> Result<Recorded> {
        let Self { recorder, lent } = self;
        recorder.check_whole()?;
        if !recorder.is_borrowed || recorder.command_buffer != lent {
            let cause = "is not the one that was lent: what was recorded is kept by another, and must not be executed";
            return Err(Error::setting("recorder", recorder.name, cause));
        }
        Ok(recorder.recorded)
    }
}

impl Recorder {
    /// Records into a host's command buffer, after what is there. Nothing is begun, submitted or waited for, and no memory is allocated but
    /// what descriptor sets take.
    ///
    /// State that is lost by it: bound pipelines, descriptor sets and push constants of compute and graphics, viewport and scissor. Labels
    /// of `VK_EXT_debug_utils`, events and queries are left as they are. In debug builds barriers are checked from here on, between the
    /// engine's own commands; of the host's [`Recorder::note_use`] and [`Recorder::note_barrier`] tell.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    ///
    /// # Safety
    /// - The command buffer is primary or secondary, of the device of `gpu` and of a pool of [`Gpu::queue_family`]; it is in the recording
    ///   state and outside a rendering, and stays so while the recorder is used. No other thread uses it or its pool in that time.
    /// - No query of pipeline statistics is active in it where [`Recorder::count_invocations`] is used.
    /// - It is executed by a queue of that family, in an order with the engine's own submissions that the host sees to: the engine's queue,
    ///   held by [`Gpu::lock_queue`], gives the order of submissions.
    /// - The [`Recorded`] lives until the device is done with it for the last time, and the host's own objects that were lent by
    ///   [`Gpu::borrow_buffer`] do, too. Without a `Recorded` (the recorder was dropped, or [`BorrowedRecorder::finish`] failed) it is not executed.
    /// - With timestamps or counts it is executed once at most.
    /// - What the engine's objects hold is not used by other work at the same time: recording a frame twice over one picture wants the
    ///   barriers that two passes in one command buffer want. While the device works on it, mapped buffers that it uses are neither written
    ///   nor read ([`Buffer::write`] and [`Buffer::read`] know of the engine's own submissions alone).
    pub unsafe fn borrow(gpu: &Gpu, desc: &BorrowDesc<'_>) -> Result<BorrowedRecorder> {
        gpu.inner.check_alive()?;
        let recorder = Self {
            gpu: gpu.clone(),
            name: desc.name.into(),
            command_buffer: desc.command_buffer,
            is_borrowed: true,
            recorded: Recorded::new(gpu, desc.timestamps)?,
            markers: None,
            tracker: cfg!(debug_assertions).then(Tracker::default),
            refused: None,
            in_pass: false,
        };
        if desc.opening_barrier {
            // SAFETY: the caller's command buffer is recording, outside a rendering.
            unsafe { recorder.barrier_over_everything() };
        }
        Ok(BorrowedRecorder {
            lent: recorder.command_buffer,
            recorder,
        })
    }

    /// Notes for the barrier checks of debug builds that commands which are not this recorder's use a buffer here: the host's, or those
    /// recorded by [`Pass::raw`](super::Pass::raw).
    ///
    /// # Errors
    /// [`Error::MissingBarrier`] in debug builds.
    pub fn note_use(&mut self, name: &str, buffer: &Buffer, access: Access) -> Result<()> {
        self.next_command();
        self.touch(name, buffer, access)
    }

    /// Notes for the barrier checks of debug builds that a barrier over all memory was recorded here, but not by this recorder.
    pub fn note_barrier(&mut self, from: Access, to: Access) {
        if let Some(tracker) = &mut self.tracker {
            tracker.barrier_all(from, to);
        }
    }
}

/// A buffer of a host's, or a part of one.
#[derive(Debug, Clone, Copy)]
pub struct HostBuffer<'a> {
    /// Shown in errors.
    pub name: &'a str,
    /// The buffer, bound to memory.
    pub raw: vk::Buffer,
    /// First byte, a multiple of 4, and of `minStorageBufferOffsetAlignment` where kernels read and write it (256 always is).
    pub offset: u64,
    /// Length in bytes, a multiple of 4.
    pub bytes: u64,
    /// What the host made it for; other uses are refused.
    pub usage: vk::BufferUsageFlags,
}

impl Gpu {
    /// A host's buffer, to be used wherever the engine takes one. It is not freed on drop, counts as no memory of the engine's, and is not
    /// mapped ([`Buffer::write`] and [`Buffer::read`] refuse). Uses that it was not made for are refused when they are recorded.
    ///
    /// The barrier checks of debug builds take two borrowings for two buffers, even of one range: borrow once, and clone.
    ///
    /// # Errors
    /// [`Error::Setting`] for a part that is empty or not of whole words; [`Error::LimitExceeded`] for a storage buffer past
    /// `maxStorageBufferRange`.
    ///
    /// # Safety
    /// - The handle is of the device of `gpu`, was made with `usage`, is bound to memory and holds `offset` + `bytes` bytes.
    /// - It lives as long as the last clone, and as every [`Submission`](super::Submission) and [`Recorded`] that uses it.
    /// - Its sharing mode is exclusive and it belongs to [`Gpu::queue_family`] when it is used, or it is shared with that family.
    pub unsafe fn borrow_buffer(&self, lent: &HostBuffer<'_>) -> Result<Buffer> {
        for (part, value) in [("offset", lent.offset), ("bytes", lent.bytes)] {
            if !value.is_multiple_of(4) || (part == "bytes" && value == 0) {
                let cause = format!("is not a {part} of whole words in buffer {:?}", lent.name);
                return Err(Error::setting(part, value, cause));
            }
        }
        let limit = self.caps().max_storage_buffer_range;
        if lent.usage.contains(vk::BufferUsageFlags::STORAGE_BUFFER) && lent.bytes > limit {
            return Err(Error::LimitExceeded {
                name: lent.name.into(),
                value: lent.bytes,
                limit_name: "maxStorageBufferRange",
                limit,
            });
        }
        Ok(Buffer {
            inner: Arc::new(BufferInner {
                gpu: Arc::clone(&self.inner),
                raw: lent.raw,
                base: lent.offset,
                id: self.inner.next_id(),
                name: lent.name.into(),
                bytes: lent.bytes,
                usage: lent.usage,
                memory: Memory::Host,
                in_use_until: Mutex::new(0),
            }),
        })
    }
}
