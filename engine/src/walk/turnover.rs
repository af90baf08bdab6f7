//! Waves that stay full: the slots of walks that have ended take new ones, so that a wave has no tail of small dispatches. GLSL: `walk/turnover.glsl`.
//!
//! Whole waves end before the next begins: their bounces are as many as their longest walk has, most of them with few walks left. A wave that is kept full
//! (regeneration after Novák, Havran and Dachsbacher, "Path Regeneration for Interactive Path Tracing", Eurographics 2010, short papers) takes new walks at the
//! beginning of each submission: its owner begins it by [`Walker::begin_full`](super::Walker::begin_full) and asks for walks by
//! [`Walker::refill`](super::Walker::refill). New walks go behind those that are alive, so that the queue is in the order in which walks began, and into free slots
//! in ascending order, so that neighbours in the queue are near each other in memory.
//!
//! A walk that has ended keeps its slot until the next turnover, whose lists say which slots are free and which walks the owner takes leave of.

use super::compaction::Compaction;
use super::wave::{Status, stage_barrier};
use crate::Result;
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::{COMPACT_CHUNK, SLOT_FREE, WALK_GROUP};
use crate::gpu::shaders::sets::WaveSet;
use crate::gpu::{Access, Buffer, BufferDesc, BufferView, Category, Gpu, Pass, PipelineInfo, TexelView};

/// What is known of each slot, and the lists that are made of it.
pub struct Turnover {
    gpu: Gpu,
    compaction: Compaction,
    status: Buffer,
    /// By slot `SLOT_*`, four in a texel.
    slots: TexelView,
    free: TexelView,
    ended: TexelView,
    chunks: Buffer,
    count: u32,
}

impl Turnover {
    /// Of a wave of so many slots, a multiple of the size of a workgroup.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory), [`Error::LimitExceeded`](crate::Error::LimitExceeded).
    pub fn new(gpu: &Gpu, slots: u32) -> Result<Self> {
        let buffer = |name, bytes: u64| gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work));
        let texels = |name, format, count: u32| gpu.storage_texels(name, Category::Work, format, count.into());
        let words = vk::Format::R32_UINT;
        Ok(Self {
            gpu: gpu.clone(),
            compaction: Compaction::new(gpu, false)?,
            status: buffer("turnover status", size_of::<Status>() as u64)?,
            slots: texels("turnover slots", vk::Format::R32G32B32A32_UINT, slots.div_ceil(4))?,
            free: texels("turnover free", words, slots)?,
            ended: texels("turnover ended", words, slots)?,
            chunks: buffer("turnover chunks", u64::from(slots.div_ceil(COMPACT_CHUNK)) * 8)?,
            count: slots,
        })
    }

    /// By slot `SLOT_*`: kernels that begin walks write `SLOT_TAKEN` to it, those that take leave of ended ones `SLOT_FREE`.
    pub fn slots(&self) -> BufferView<'_> {
        self.slots.buffer().view()
    }

    /// The free slots, as [`Turnover::record`] has listed them.
    pub fn free(&self) -> BufferView<'_> {
        self.free.buffer().view()
    }

    /// One invocation for each walk that has ended: indirect arguments of a dispatch over their list.
    pub fn ended_groups(&self) -> BufferView<'_> {
        let offset = std::mem::offset_of!(Status, waiting_groups) as u64;
        self.status.slice(offset, size_of::<[u32; 3]>() as u64)
    }

    /// A wave's set with the lists in place of the wave's own: `walk_waiting_queue_in` has the slots of the walks that have ended, `status.waiting_count` how many they are,
    /// and `walk_flags_out` is [`Turnover::slots`].
    pub(super) fn set<'a>(&'a self, wave: WaveSet<'a>) -> WaveSet<'a> {
        WaveSet {
            status: self.status.view(),
            walk_queue_out: self.free.buffer().view(),
            walk_waiting_queue_in: &self.ended,
            walk_waiting_queue_out: self.ended.buffer().view(),
            walk_flags_in: &self.slots,
            walk_flags_out: self.slots.buffer().view(),
            walk_chunks: self.chunks.view(),
            ..wave
        }
    }

    /// Makes all slots free.
    pub(super) fn free_all(&self) -> Result<()> {
        self.gpu
            .upload(self.slots.buffer(), 0, &vec![SLOT_FREE; self.count as usize])
    }

    /// Records the lists of the slots that are free and of those whose walks have ended, both ascending, by `set` of [`WaveBuffers::turnover_set`](super::WaveBuffers::turnover_set).
    /// Leaves [`stage_barrier`] behind.
    ///
    /// # Errors
    /// Those of recording.
    pub fn record(&self, pass: &mut Pass<'_>, set: &WaveSet<'_>) -> Result<()> {
        let status = Status {
            active_count: self.count,
            // The scan sets how many groups there are.
            waiting_groups: [0, 1, 1],
            ..Status::default()
        };
        pass.update(self.status.view(), &[status])?;
        pass.memory_barrier(
            Access::TRANSFER_WRITE | Access::COMPUTE,
            Access::COMPUTE | Access::INDIRECT_READ,
        );
        let groups = self.count.div_ceil(COMPACT_CHUNK).div_ceil(WALK_GROUP);
        self.compaction.record_all(pass, set, [groups, 1, 1])?;
        stage_barrier(pass);
        Ok(())
    }

    /// Its kernel beside those of the compaction of the wave's queues.
    pub(super) fn pipeline(&self) -> PipelineInfo {
        let [_, _, scatter] = self.compaction.info();
        scatter
    }
}
