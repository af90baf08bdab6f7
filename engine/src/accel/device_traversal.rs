//! What kernels must know of a ray index beside its texels.

use crate::gpu::shaders::constants;
use crate::gpu::{Caps, DeviceKind};
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
}

impl DeviceTraversal {
    /// What kernels are specialized by.
    pub fn kind(self) -> u32 {
        match self {
            Self::Bvh2 => constants::INDEX_BVH2,
            Self::Kd { .. } => constants::INDEX_KD,
        }
    }

    /// Loop iterations of a subgroup by rays that each stop at `quota`, at most, where a loop over lanes that wait for each other may run as
    /// often as its lanes have in sum; binary hierarchies without a filter of candidates have one loop, which runs as often as its slowest lane.
    pub(crate) fn kd_iterations(longest_leaf: u32, quota: u32, lanes: u32) -> u64 {
        let round = constants::KD_ROUND_ITERATIONS + 2 * constants::KD_MAX_DEPTH + 1;
        (u64::from(quota) + u64::from(round) + u64::from(longest_leaf)) * u64::from(lanes)
    }

    /// The quota up to `quota` with which a subgroup's rays stay within `iterations`, for kd-trees on software devices; elsewhere `quota`.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] where a leaf alone is too long.
    pub(crate) fn quota_within(self, caps: &Caps, quota: u32, iterations: u32) -> Result<u32> {
        let Self::Kd { longest_leaf } = self else {
            return Ok(quota);
        };
        if caps.kind != DeviceKind::Cpu {
            return Ok(quota);
        }
        let lanes = caps.subgroup_size.max(1);
        let unstopped = Self::kd_iterations(longest_leaf, 0, lanes) / u64::from(lanes);
        let most = u64::from(iterations / lanes);
        if most <= unstopped {
            return Err(Error::LimitExceeded {
                name: "longest leaf of a kd-tree".into(),
                value: u64::from(longest_leaf),
                limit_name: "iterations of a software device's loops",
                limit: most.saturating_sub(unstopped - u64::from(longest_leaf)),
            });
        }
        Ok(quota.min((most - unstopped) as u32))
    }
}
