//! Streams of elements cut into blocks, one per team: how the host plans and begins every reduce-then-scan kernel.
//!
//! The arithmetic of blocks is that of `shaders/kernels/stream.glsl`. Guarantees: every element is in exactly one block, no team's
//! block is longer than the quota that its form allows, and no more workgroups are dispatched than every device takes.

use super::form::Shape;
use crate::gpu::interface::{BindingSet, ComputeShader};
use crate::gpu::shaders::constants::{STREAM_COUNT_ON_DEVICE, STREAM_HEADER_WORDS};
use crate::gpu::shaders::kernels::stream_prepare;
use crate::gpu::shaders::types::StreamPlan;
use crate::gpu::{
    Access, Buffer, BufferBarrier, BufferView, ComputePipeline, Gpu, Pass, PipelineInfo, compute_to_indirect,
    rw_compute_to_compute,
};
use crate::{Error, Result};

/// The most elements that kernels can number. No device has as many: a binding's `maxStorageBufferRange` is less than 2³² bytes, so that a
/// stream of words has fewer than 2³⁰, and what is read by texels is bound by `maxTexelBufferElements` too.
pub(super) const MAX_COUNT: u32 = 1 << 31;

/// How many elements a kernel handles.
#[derive(Debug, Clone, Copy)]
pub enum Count<'a> {
    /// Known to the host.
    Host(u32),
    /// The first word of a buffer range, read when the kernel runs; dispatches are then indirect.
    Device {
        /// Where the word is; the range must be aligned as storage bindings are.
        view: BufferView<'a>,
        /// The most that there may be, for which the buffers have room. With more, the kernel handles none, and [`StreamStatus`] says how
        /// many there were.
        capacity: u32,
    },
}

impl Count<'_> {
    /// The most elements that there may be.
    pub fn capacity(&self) -> u32 {
        match self {
            Self::Host(count) => *count,
            Self::Device { capacity, .. } => *capacity,
        }
    }
}

/// What a kernel with [`Count::Device`] found, at the beginning of its scratch memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StreamStatus {
    /// Elements handled.
    pub count: u32,
    /// Elements asked for; more than handled when they were more than the capacity.
    pub wanted: u32,
}

impl StreamStatus {
    /// Reads the status, after the submission was waited for. Only kernels recorded with [`Count::Device`] write one.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn read(gpu: &Gpu, scratch: &Buffer) -> Result<Self> {
        let words: Vec<u32> = gpu.read(scratch.view(), 5)?;
        Ok(Self {
            count: words[3],
            wanted: words[4],
        })
    }

    /// Fails when there were more elements than the capacity.
    ///
    /// # Errors
    /// [`Error::Overflow`].
    pub fn check(&self, kernel: &str, capacity: u32) -> Result<()> {
        if self.wanted <= capacity {
            return Ok(());
        }
        Err(Error::Overflow {
            kernel: kernel.into(),
            what: "elements".into(),
            needed: self.wanted.into(),
            capacity: capacity.into(),
            instead: "record with that capacity".into(),
        })
    }
}
/// Twin of `stream_block`.
pub fn stream_block(count: u32, tile: u32, max_teams: u32) -> u32 {
    count.div_ceil(tile).div_ceil(max_teams).max(1) * tile
}

/// Twin of `stream_teams`.
pub fn stream_teams(count: u32, block: u32) -> u32 {
    count.div_ceil(block)
}

/// Twin of `stream_range`: the first element of a team's block and the one past its last.
pub fn stream_range(team: u32, count: u32, block: u32) -> [u32; 2] {
    let first = if team < stream_teams(count, block) {
        team * block
    } else {
        count
    };
    [first, first + block.min(count - first)]
}

/// Reads counts from buffers for kernels.
#[derive(Debug, Clone)]
pub(super) struct Prepare {
    pipeline: ComputePipeline<stream_prepare::Kernel>,
}

/// Arguments of indirect dispatches of an invocation per element, for as many elements as a buffer says.
#[derive(Debug)]
pub(crate) struct IndirectCount {
    prepare: Prepare,
}

impl IndirectCount {
    /// Of the buffer that the arguments are written to.
    pub const BYTES: u64 = STREAM_HEADER_WORDS as u64 * size_of::<u32>() as u64;

    pub fn new(gpu: &Gpu) -> Result<Self> {
        let prepare = Prepare::new(gpu)?;
        Ok(Self { prepare })
    }

    /// Writes three words of arguments for workgroups of `lanes`, at least one, and the number of elements behind them. Barriers as kernels
    /// have them.
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        count: BufferView<'_>,
        capacity: u32,
        lanes: u32,
        arguments: &Buffer,
    ) -> Result<()> {
        let shape = Shape {
            tile: lanes,
            quota: lanes,
            teams_per_group: 1,
            teams: 1,
        };
        let count = Count::Device { view: count, capacity };
        self.prepare.begin(pass, &shape, count, arguments)?;
        Ok(())
    }
}

/// A kernel's dispatches over one stream.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stream<'a> {
    pub plan: StreamPlan,
    pub scratch: &'a Buffer,
    /// Workgroups that cover the blocks, where the host knows.
    groups: Option<u32>,
}

impl Prepare {
    pub fn info(&self) -> PipelineInfo {
        self.pipeline.info()
    }

    pub fn new(gpu: &Gpu) -> Result<Self> {
        let pipeline = gpu.compute_pipeline(&())?;
        Ok(Self { pipeline })
    }

    /// Plans a kernel's dispatches, and records what they need. Leaves the scratch memory ready to be read and written.
    pub fn begin<'a>(
        &self,
        pass: &mut Pass<'_>,
        shape: &Shape,
        count: Count<'_>,
        scratch: &'a Buffer,
    ) -> Result<Stream<'a>> {
        let (capacity, tile) = (count.capacity(), shape.tile);
        let max_teams = shape.max_teams(capacity);
        let Count::Device { view, .. } = count else {
            let teams = stream_teams(capacity, stream_block(capacity, tile, max_teams));
            return Ok(Stream {
                plan: StreamPlan {
                    count: capacity,
                    tile,
                    max_teams,
                },
                scratch,
                // One at least: kernels write their results for no elements, too.
                groups: Some(teams.div_ceil(shape.teams_per_group).max(1)),
            });
        };
        let plan = StreamPlan {
            count: STREAM_COUNT_ON_DEVICE,
            tile,
            max_teams,
        };
        let set = stream_prepare::Set0 {
            stream_scratch: scratch.view(),
            stream_counts: view,
        };
        let push = stream_prepare::Push {
            plan,
            capacity,
            teams_per_group: shape.teams_per_group,
        };
        pass.dispatch(&self.pipeline, &[&set], &push, [1, 1, 1])?;
        pass.barrier(&[compute_to_indirect(scratch)]);
        Ok(Stream {
            plan,
            scratch,
            groups: None,
        })
    }
}

impl Stream<'_> {
    /// Dispatches one team per block.
    pub fn dispatch<K: ComputeShader>(
        &self,
        pass: &mut Pass<'_>,
        pipeline: &ComputePipeline<K>,
        set: &dyn BindingSet<'_>,
        push: &K::Push,
    ) -> Result<()> {
        match self.groups {
            Some(groups) => pass.dispatch(pipeline, &[set], push, [groups, 1, 1]),
            None => pass.dispatch_indirect(pipeline, &[set], push, self.scratch.view()),
        }
    }

    /// Waits until what earlier stages have written to the scratch memory can be read and written again, by dispatches and as their arguments,
    /// and until they have done with other buffers.
    pub fn between_stages(&self, pass: &mut Pass<'_>, others: &[&Buffer]) {
        let scratch = BufferBarrier {
            buffer: self.scratch,
            from: Access::COMPUTE | Access::INDIRECT_READ,
            to: Access::COMPUTE | Access::INDIRECT_READ,
        };
        let others = others.iter().map(|buffer| rw_compute_to_compute(buffer));
        let barriers: Vec<_> = std::iter::once(scratch).chain(others).collect();
        pass.barrier(&barriers);
    }
}

/// Fails when a range is too small for so many words.
pub(super) fn check_words(view: BufferView<'_>, words: u64) -> Result<()> {
    if view.bytes < 4 * words {
        return Err(Error::LimitExceeded {
            name: view.buffer.name().into(),
            value: 4 * words,
            limit_name: "size of the range",
            limit: view.bytes,
        });
    }
    Ok(())
}

/// Bytes of scratch memory with `words` words for the kernel itself.
pub(super) fn scratch_bytes(words: u64) -> u64 {
    4 * (u64::from(STREAM_HEADER_WORDS) + words)
}

/// Fails when a stream has more elements than kernels can number.
pub(super) fn check_count(kernel: &str, count: u32) -> Result<()> {
    if count > MAX_COUNT {
        return Err(Error::LimitExceeded {
            name: kernel.into(),
            value: count.into(),
            limit_name: "elements of a stream",
            limit: MAX_COUNT.into(),
        });
    }
    Ok(())
}

/// Fails when a buffer is too small for what a kernel keeps in it.
pub(super) fn check_size(buffer: &Buffer, bytes: u64) -> Result<()> {
    if buffer.bytes() < bytes {
        return Err(Error::LimitExceeded {
            name: buffer.name().into(),
            value: bytes,
            limit_name: "size",
            limit: buffer.bytes(),
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_element_is_in_one_block() {
        let shapes = [(1, 1), (1, 8), (4, 3), (64, 32), (2048, 1024)];
        let counts = [0, 1, 2, 63, 64, 65, 1000, 4096, 65_537, 1 << 20, MAX_COUNT];
        for (tile, max_teams) in shapes {
            for count in counts {
                let block = stream_block(count, tile, max_teams);
                let teams = stream_teams(count, block);
                assert!(teams <= max_teams && block.is_multiple_of(tile));
                let mut next = 0;
                for team in 0..teams + 2 {
                    let [first, last] = stream_range(team, count, block);
                    assert_eq!(first, next, "{tile} {max_teams} {count}");
                    assert!(team >= teams || last > first);
                    next = last;
                }
                assert_eq!(next, count);
            }
        }
    }
}
