//! Streams of elements cut into blocks, one a team: how the host plans and begins every reduce-then-scan kernel.
//!
//! The arithmetic of blocks is that of `shaders/include/kernels/stream.glsl`. Guarantees: every element is in exactly one block, no team's
//! block is longer than the quota that its form allows, and no more workgroups are dispatched than every device takes.

use crate::gpu::interface::{BindingSet, ComputeShader};
use crate::gpu::shaders::constants::{
    OPERATION_MAX, OPERATION_MIN, OPERATION_SUM, SCAN_ITEMS, STREAM_COUNT_ON_DEVICE, STREAM_HEADER_WORDS,
};
use crate::gpu::shaders::kernels::stream_prepare;
use crate::gpu::shaders::types::StreamPlan;
use crate::gpu::{
    Access, Buffer, BufferBarrier, BufferView, Caps, ComputePipeline, DeviceKind, Gpu, Pass, SOFTWARE_LOOP_CAP,
    compute_to_indirect, rw_compute_to_compute,
};
use crate::{Error, Result};

/// The most elements of a stream.
pub(super) const MAX_COUNT: u32 = 1 << 31;

/// Iterations that the loop over a block takes at most, on any device: half of what software drivers allow, as the tests that end loops and
/// the loops beside it count too. A power of two, as tiles are.
pub(super) const BLOCK_ITERATIONS: u32 = SOFTWARE_LOOP_CAP.div_ceil(2);

/// Loops of a scan that take each element: one combines a lane's items, one writes them.
const SCAN_LOOPS: u32 = 2;

/// Tiles of a block whose team is a workgroup, at most. A lane takes about 20 iterations a tile: [`SCAN_LOOPS`] times the items, and the
/// steps of the scan over the lanes.
const WORKGROUP_TILES: u32 = 1 << 11;

/// Invocations of a workgroup, where the device takes so many: more only lengthen the scan over them.
const WORKGROUP_LANES: u32 = 256;

/// Teams that are workgroups: enough to fill large devices, few enough that a workgroup scans what they found in a few steps.
pub(super) const WORKGROUP_TEAMS: u32 = 1024;

/// Invocations of a workgroup that share nothing, on devices with lanes of their own: the widest subgroup of common devices.
pub(super) const SERIAL_LANES: u32 = 64;

/// Teams that are invocations, on devices with lanes of their own: enough to fill them, few enough to be scanned by a workgroup.
pub(super) const SERIAL_TEAMS: u32 = 1 << 14;

/// Elements that blocks of single invocations are a multiple of, so that short streams do not go to a team an element; on software
/// devices, which have few threads, more.
pub(super) const SERIAL_TILE: u32 = 64;
const SERIAL_TILE_ON_SOFTWARE: u32 = 256;

/// Invocations of workgroups that share memory, on software devices.
const SOFTWARE_WORKGROUP_LANES: u32 = 64;

/// Elements that each lane takes of a tile in kernels whose lanes take turns.
const ITEMS_IN_TURN: u32 = 4;

/// Workgroups for each thread of a software driver, so that a thread that falls behind leaves one to others.
const GROUPS_PER_THREAD: u32 = 2;

/// Times as many workgroups where teams leave nothing to be scanned: shorter blocks end at about the same time.
const UNSCANNED_TEAMS: u32 = 4;

/// Threads that software drivers are thought to have at most.
const SOFTWARE_THREADS_MAX: u32 = 64;

/// Bytes of shared memory that the subgroup forms take at most: a row of counters for each subgroup of a scatter, the next place of each digit,
/// and a scan's words.
const SUBGROUP_SHARED_MEMORY: u32 = 20 << 10;

/// What a team of a kernel is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Form {
    /// The one that suits the device: serial on software drivers, else with subgroup operations where there are any.
    #[default]
    Auto,
    /// Single invocations that walk their blocks alone: no barriers, no subgroup operations.
    Serial,
    /// Workgroups with shared memory, and no subgroup operations.
    Shared,
    /// Workgroups with subgroup operations (ballot and shuffle), of any subgroup size from 4 to 128.
    Subgroup,
}

impl Form {
    /// Resolves [`Form::Auto`].
    ///
    /// # Errors
    /// [`Error::MissingFeature`] when subgroup operations are asked for that the device lacks, or that lack shared memory.
    pub fn on(self, caps: &Caps, kernel: &str) -> Result<Self> {
        let able = caps.subgroup.basic
            && caps.subgroup.ballot
            && caps.subgroup.shuffle
            && (4..=128).contains(&caps.subgroup_size)
            && caps.max_shared_memory >= SUBGROUP_SHARED_MEMORY;
        match self {
            Self::Auto if able && caps.kind != DeviceKind::Cpu => Ok(Self::Subgroup),
            Self::Auto if caps.kind != DeviceKind::Cpu => Ok(Self::Shared),
            Self::Auto | Self::Serial => Ok(Self::Serial),
            Self::Shared => Ok(Self::Shared),
            Self::Subgroup if able => Ok(Self::Subgroup),
            Self::Subgroup => Err(Error::MissingFeature {
                feature: format!(
                    "subgroup ballot and shuffle in compute shaders, of 4 to 128 lanes, and {SUBGROUP_SHARED_MEMORY} bytes of shared memory"
                ),
                needed_by: kernel.into(),
                device: caps.device.clone(),
                instead: "choose Form::Shared or Form::Serial".into(),
            }),
        }
    }
}

/// How many elements a kernel handles.
#[derive(Debug, Clone, Copy)]
pub enum Count<'a> {
    /// Known to the host.
    Host(u32),
    /// The first word of a buffer range, read when the kernel runs; dispatches are then indirect.
    Device {
        /// Where the word is; the range must be aligned as storage bindings are.
        view: BufferView<'a>,
        /// The most that there may be. With more, the kernel handles none, and [`StreamStatus`] says how many there were.
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

/// How a kernel cuts its stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Shape {
    /// Elements that blocks are a multiple of.
    pub tile: u32,
    /// Elements of a block at most; a multiple of `tile`.
    pub quota: u32,
    /// Teams of a workgroup.
    pub teams_per_group: u32,
    /// Teams at most, as long as the quota allows.
    pub teams: u32,
}

impl Shape {
    /// Teams for a number of elements.
    pub fn max_teams(&self, capacity: u32) -> u32 {
        let wanted = self.teams.min(capacity.div_ceil(self.tile));
        wanted.max(capacity.div_ceil(self.quota)).max(1)
    }
}

/// The teams of scans, reductions and what is built of them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Teams {
    pub form: Form,
    /// Invocations of a workgroup.
    pub lanes: u32,
    pub shape: Shape,
}

impl Teams {
    /// Teams of kernels whose lanes take some consecutive elements at once.
    pub fn new(caps: &Caps, form: Form, kernel: &str) -> Result<Self> {
        let form = form.on(caps, kernel)?;
        if form != Form::Serial {
            let lanes = caps.max_workgroup_invocations.min(WORKGROUP_LANES);
            let tile = lanes * SCAN_ITEMS;
            return Ok(Self {
                form,
                lanes,
                shape: Shape {
                    tile,
                    quota: tile * WORKGROUP_TILES,
                    teams_per_group: 1,
                    teams: WORKGROUP_TEAMS,
                },
            });
        }
        let (lanes, teams, tile) = if caps.kind == DeviceKind::Cpu {
            let lanes = caps.subgroup_size.max(1);
            (lanes, serial_groups() * lanes, SERIAL_TILE_ON_SOFTWARE)
        } else {
            (SERIAL_LANES, SERIAL_TEAMS, SERIAL_TILE)
        };
        Ok(Self {
            form,
            lanes,
            shape: Shape {
                tile,
                quota: BLOCK_ITERATIONS / SCAN_LOOPS,
                teams_per_group: lanes,
                teams,
            },
        })
    }

    /// Teams that are workgroups in any case, of kernels without barriers in their loops, with so many loop iterations an element.
    pub fn workgroups(caps: &Caps, iterations: u32) -> Self {
        let lanes = if caps.kind == DeviceKind::Cpu {
            SOFTWARE_WORKGROUP_LANES
        } else {
            caps.max_workgroup_invocations.min(WORKGROUP_LANES)
        };
        let tile = lanes * ITEMS_IN_TURN;
        Self {
            form: Form::Shared,
            lanes,
            shape: Shape {
                tile,
                quota: (lanes * BLOCK_ITERATIONS / iterations.max(1) / tile).max(1) * tile,
                teams_per_group: 1,
                teams: if caps.kind == DeviceKind::Cpu {
                    UNSCANNED_TEAMS * serial_groups()
                } else {
                    WORKGROUP_TEAMS
                },
            },
        }
    }

    pub fn serial(&self) -> bool {
        self.form == Form::Serial
    }
}

/// Workgroups that keep all threads of a software driver busy.
pub(super) fn serial_groups() -> u32 {
    GROUPS_PER_THREAD
        * std::thread::available_parallelism()
            .map_or(1, |n| n.get() as u32)
            .min(SOFTWARE_THREADS_MAX)
}

/// One kernel, without or with subgroup operations.
#[derive(Debug)]
pub(super) enum Variant<P, S> {
    Plain(ComputePipeline<P>),
    Subgroup(ComputePipeline<S>),
}

/// An operation of scans and reductions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Operation {
    /// The sum; of scans modulo 2³².
    #[default]
    Sum,
    /// The minimum of unsigned words.
    Min,
    /// The maximum of unsigned words.
    Max,
}

impl Operation {
    pub(super) fn code(self) -> u32 {
        match self {
            Self::Sum => OPERATION_SUM,
            Self::Min => OPERATION_MIN,
            Self::Max => OPERATION_MAX,
        }
    }

    /// What changes nothing. Twin of `scan_identity`.
    pub fn identity(self) -> u32 {
        if self == Self::Min { u32::MAX } else { 0 }
    }

    /// Twin of `scan_operation`.
    pub fn apply(self, a: u32, b: u32) -> u32 {
        match self {
            Self::Sum => a.wrapping_add(b),
            Self::Min => a.min(b),
            Self::Max => a.max(b),
        }
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

/// A kernel's dispatches over one stream.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stream<'a> {
    pub plan: StreamPlan,
    pub scratch: &'a Buffer,
    /// Workgroups that cover the blocks, where the host knows.
    groups: Option<u32>,
}

impl Prepare {
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
    /// Dispatches one team a block.
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

    #[test]
    fn blocks_keep_the_quota() {
        let shape = Shape {
            tile: 64,
            quota: 4096,
            teams_per_group: 8,
            teams: 32,
        };
        for capacity in [0, 1, 64, 2048, 131_072, 131_073, 1 << 30] {
            let block = stream_block(capacity, shape.tile, shape.max_teams(capacity));
            assert!(block <= shape.quota, "{capacity}: {block}");
        }
        assert_eq!(shape.max_teams(131_072), 32);
    }
}
