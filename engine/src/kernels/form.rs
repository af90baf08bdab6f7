//! What a team of a kernel is, and how many elements of a stream it takes: workgroups or single invocations, tuned to the kind of device.
//!
//! Guarantees: no team's block is longer than the loops over it may be on any device, and no more workgroups are dispatched than every
//! device takes.

use crate::gpu::shaders::constants::SCAN_ITEMS;
use crate::gpu::{Caps, ComputePipeline, DeviceKind, PipelineInfo, SOFTWARE_LOOP_CAP};
use crate::{Error, Result};

/// Iterations that the loop over a block takes at most, on any device: half of what software drivers allow, as the tests that end loops and
/// the loops beside it count too. A power of two, as tiles are.
pub(super) const BLOCK_ITERATIONS: u32 = SOFTWARE_LOOP_CAP.div_ceil(2);

/// Loops of a scan that take each element: one combines a lane's items, one writes them.
const SCAN_LOOPS: u32 = 2;

/// Tiles of a block whose team is a workgroup, at most. A lane takes about 20 iterations per tile: [`SCAN_LOOPS`] times the items, and the
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

/// Elements that blocks of single invocations are a multiple of, so that short streams do not go to a team per element; on software
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

/// The smallest subgroups that devices of larger ones may form; those of smaller ones form no smaller ones than they say.
pub(super) const LEAST_SUBGROUP: u32 = 8;

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
    /// Workgroups of full subgroups with subgroup operations (ballot and shuffle), of any subgroup size from 4 to 128.
    Subgroup,
}

impl Form {
    /// Resolves [`Form::Auto`].
    ///
    /// # Errors
    /// [`Error::MissingFeature`] when subgroup operations are asked for that the device lacks, or that lack shared memory, or whose subgroups
    /// may have inactive lanes or be smaller than kernels have room for.
    pub fn on(self, caps: &Caps, kernel: &str) -> Result<Self> {
        let able = caps.subgroup.basic
            && caps.subgroup.ballot
            && caps.subgroup.shuffle
            && caps.full_subgroups
            && (4..=128).contains(&caps.subgroup_size)
            && caps.min_subgroup_size >= caps.subgroup_size.min(LEAST_SUBGROUP)
            && caps.max_shared_memory >= SUBGROUP_SHARED_MEMORY;
        match self {
            Self::Auto if able && caps.kind != DeviceKind::Cpu => Ok(Self::Subgroup),
            Self::Auto if caps.kind != DeviceKind::Cpu => Ok(Self::Shared),
            Self::Auto | Self::Serial => Ok(Self::Serial),
            Self::Shared => Ok(Self::Shared),
            Self::Subgroup if able => Ok(Self::Subgroup),
            Self::Subgroup => Err(Error::MissingFeature {
                feature: format!(
                    "full subgroups (computeFullSubgroups) of 4 to 128 lanes and at least {LEAST_SUBGROUP} where they have as many, \
                     with ballot and shuffle in compute shaders, and {SUBGROUP_SHARED_MEMORY} bytes of shared memory"
                ),
                needed_by: kernel.into(),
                device: caps.device.clone(),
                instead: "choose Form::Shared or Form::Serial".into(),
            }),
        }
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
            let lanes = workgroup_lanes(caps);
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

    /// Teams that are workgroups in any case, of kernels without barriers in their loops, with so many loop iterations per element.
    pub fn workgroups(caps: &Caps, iterations: u32) -> Self {
        let lanes = if caps.kind == DeviceKind::Cpu {
            SOFTWARE_WORKGROUP_LANES
        } else {
            workgroup_lanes(caps)
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

/// Invocations of a workgroup that shares memory: a power of two, so that subgroups fill it.
fn workgroup_lanes(caps: &Caps) -> u32 {
    1 << caps.max_workgroup_invocations.clamp(1, WORKGROUP_LANES).ilog2()
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

impl<P, S> Variant<P, S> {
    pub fn info(&self) -> PipelineInfo {
        match self {
            Self::Plain(kernel) => kernel.info(),
            Self::Subgroup(kernel) => kernel.info(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::stream_block;

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
