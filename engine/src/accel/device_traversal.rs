//! What kernels must know of a ray index beside its texels.

use crate::gpu::interface::ComputeShader;
use crate::gpu::shaders::constants;
use crate::gpu::{Caps, ComputePipeline, DeviceKind, Gpu};
use crate::{Error, Result};

/// How kernels traverse an index.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeviceTraversal {
    /// Binary hierarchies, whatever built them.
    Bvh2,
    /// kd-trees.
    Kd {
        /// Most triangles in a leaf, which rays are not stopped in.
        longest_leaf: u32,
    },
    /// Wide hierarchies.
    Wide,
    /// Wide hierarchies of meshes under one over instances.
    TwoLevel,
    /// The driver's acceleration structure, by ray queries.
    Driver,
}

/// What the rounds of a kd-tree's kernel hold beside a way down, a leaf, and a way to what is left.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct KdRounds {
    /// A leaf may wait for the next.
    pub waits: bool,
    /// Candidates are asked about before they count.
    pub filters: bool,
}

impl DeviceTraversal {
    /// What kernels are specialized by; those for the driver's structure are for nothing else.
    pub fn kind(self) -> u32 {
        match self {
            Self::Bvh2 => constants::INDEX_BVH2,
            Self::Kd { .. } => constants::INDEX_KD,
            Self::Wide => constants::INDEX_WIDE,
            Self::TwoLevel => constants::INDEX_TWO_LEVEL,
            Self::Driver => constants::INDEX_DRIVER,
        }
    }

    /// The pipeline of a kernel that traverses it, of the module for ray queries where it is the driver's.
    ///
    /// # Errors
    /// As [`Gpu::compute_pipeline`] and [`Gpu::ray_query_pipeline`].
    pub fn pipeline<K: ComputeShader>(self, gpu: &Gpu, spec: &K::Spec) -> Result<ComputePipeline<K>> {
        match self {
            Self::Driver => gpu.ray_query_pipeline(spec),
            _ => gpu.compute_pipeline(spec),
        }
    }

    /// The least quota with which a ray that was stopped gets further than where it was: the way back, in two levels with the rounds that go into an
    /// instance.
    pub(crate) fn least_quota(self) -> u32 {
        match self {
            Self::TwoLevel => 2 * constants::WIDE_MAX_DEPTH + 3 * constants::WIDE_ROUND_ITERATIONS,
            Self::Bvh2 | Self::Kd { .. } | Self::Wide | Self::Driver => constants::BVH2_MAX_DEPTH + 1,
        }
    }

    /// Loop iterations of a subgroup by rays that each stop at `quota`, at most, where a loop over lanes that wait for each other may run as
    /// often as its lanes have in sum; binary hierarchies without a filter of candidates have one loop, which runs as often as its slowest lane.
    pub(crate) fn kd_iterations(longest_leaf: u32, quota: u32, lanes: u32, rounds: KdRounds) -> u64 {
        let of_round = match rounds.waits {
            true => constants::KD_PAIR_ITERATIONS,
            false => constants::KD_ROUND_ITERATIONS,
        };
        let round = u64::from(of_round + 2 * constants::KD_MAX_DEPTH + 1);
        // One that begins below the quota, one where the flags read as the end, and one for a leaf that waits.
        let count = 2 + u64::from(rounds.waits);
        // A candidate ends the loop over its leaf: what is left of that is a round of its own.
        let triangle = 1 + u64::from(if rounds.filters { of_round } else { 0 });
        let leaves = count * if rounds.waits { 2 } else { 1 };
        // Where a ray stops it goes its way from the root once more, to say what is left.
        let way = u64::from(constants::KD_MAX_DEPTH + 1);
        (u64::from(quota) + count * round + way + leaves * triangle * u64::from(longest_leaf)) * u64::from(lanes)
    }

    /// The same in a wide hierarchy: a ray that is below its quota begins a round, with a node and its triangles.
    pub(crate) fn wide_iterations(quota: u32, lanes: u32, filters: bool) -> u64 {
        let round = constants::WIDE_ROUND_ITERATIONS;
        // A candidate ends the loop over a node's triangles: what is left of that is a round of its own.
        let triangle = 1 + if filters { round } else { 0 };
        let last_round = round + 1 + constants::WIDE_NODE_TRIANGLES * triangle;
        let way_back = constants::WIDE_MAX_DEPTH + 1;
        (u64::from(quota) + u64::from(last_round + way_back)) * u64::from(lanes)
    }

    /// The same in two levels: a candidate that is asked about may take a search among instances, too, and the way back begins with one.
    pub(crate) fn two_level_iterations(quota: u32, lanes: u32, filters: bool) -> u64 {
        let round = constants::WIDE_ROUND_ITERATIONS;
        let search = constants::INSTANCE_SEARCH_STEPS;
        let triangle = 1 + if filters { round + search } else { 0 };
        let last_round = round + 1 + constants::WIDE_NODE_TRIANGLES * triangle;
        let way_back = search + 2 * (constants::WIDE_MAX_DEPTH + 1);
        (u64::from(quota) + u64::from(last_round + way_back)) * u64::from(lanes)
    }

    /// The quota up to `quota` with which a subgroup's rays stay within `iterations`, for kd-trees, wide hierarchies and two levels on software devices; elsewhere `quota`.
    /// `filters` says whether kernels ask about candidates.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] where a leaf alone is too long.
    pub(crate) fn quota_within(self, caps: &Caps, quota: u32, iterations: u32, filters: bool) -> Result<u32> {
        let quota = match self {
            Self::TwoLevel => quota.max(self.least_quota()),
            _ => quota,
        };
        if caps.kind != DeviceKind::Cpu {
            return Ok(quota);
        }
        let lanes = caps.subgroup_size.max(1);
        let longest_leaf = match self {
            // One loop, with whatever filter; that of ray queries is the driver's own.
            Self::Bvh2 | Self::Driver => return Ok(quota),
            Self::Wide => {
                let unstopped = Self::wide_iterations(0, 1, filters);
                let least = unstopped + u64::from(constants::WIDE_MAX_DEPTH);
                return round_quota_within(quota, u64::from(iterations / lanes), unstopped, least);
            }
            Self::TwoLevel => {
                let unstopped = Self::two_level_iterations(0, 1, filters);
                let least = unstopped + u64::from(self.least_quota());
                return round_quota_within(quota, u64::from(iterations / lanes), unstopped, least);
            }
            Self::Kd { longest_leaf } => longest_leaf,
        };
        let rounds = KdRounds { waits: false, filters };
        let unstopped = |leaf| Self::kd_iterations(leaf, 0, 1, rounds);
        let most = u64::from(iterations / lanes);
        if most <= unstopped(longest_leaf) {
            let each = unstopped(1) - unstopped(0);
            return Err(Error::LimitExceeded {
                name: "longest leaf of a kd-tree".into(),
                value: u64::from(longest_leaf),
                limit_name: "iterations of a software device's loops",
                limit: most.saturating_sub(unstopped(0)) / each,
            });
        }
        Ok(quota.min((most - unstopped(longest_leaf)) as u32))
    }
}

/// The quota up to `quota` with which a ray in a wide hierarchy or in two levels stays within `most` iterations: `unstopped` are those beside the quota, and with
/// `least`, which the way back to a node takes, no less than that node is left.
fn round_quota_within(quota: u32, most: u64, unstopped: u64, least: u64) -> Result<u32> {
    if most <= least {
        return Err(Error::LimitExceeded {
            name: "round of rays in a wide hierarchy".into(),
            value: least + 1,
            limit_name: "iterations of a software device's loops",
            limit: most,
        });
    }
    Ok(quota.min((most - unstopped) as u32))
}
