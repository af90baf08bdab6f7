//! The path tracer's settings and their ranges.

use std::ops::RangeInclusive;

use crate::transport::path_set::PathSet;
use crate::transport::random::SamplerKind;
use crate::{Error, Result};

/// Bounds of the roulette's settings, so that every path ends.
const ROULETTE_CAP_MAX: f32 = 0.999;
const ROULETTE_START_MAX: u32 = 4096;
/// A traversal makes progress only with a quota above twice the depth of the deepest tree, and must stay below
/// [`SOFTWARE_LOOP_CAP`](crate::gpu::SOFTWARE_LOOP_CAP).
const RAY_QUOTAS: RangeInclusive<u32> = 128..=60_000;
/// Most paths in flight.
pub(super) const SLOTS_MAX: u32 = 1 << 22;

/// Settings of the path tracer.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PathTracerSettings {
    /// Which light paths the picture contains.
    pub path_set: PathSet,
    /// Random numbers: Owen-scrambled Sobol' or PCG.
    pub sampler: SamplerKind,
    /// Seed of the random numbers; the view's, where settings come as text.
    #[serde(skip)]
    pub seed: u32,
    /// First bounce at which Russian roulette may end a path, at most 4096.
    pub roulette_start: u32,
    /// Largest probability to survive a round of roulette, in (0, 0.999]: with 1, paths in lossless scenes would never end.
    #[serde(serialize_with = "crate::settings::serialize_f32")]
    pub roulette_cap: f32,
    /// Compensation of rough metals for scattering among microfacets; off for comparison with single-scattering renderers.
    pub multiple_scattering: bool,
    /// Uncorrelated instead of height-correlated Smith masking, for the same comparison.
    pub separable_masking: bool,
    /// Samples light of points and spots in homogeneous media also equi-angularly. Changes the noise only.
    pub equiangular: bool,
    /// Paths in flight; 0 chooses by the kind of device. Never changes the picture.
    pub paths_in_flight: u32,
    /// Loop iterations after which a ray goes on in a later dispatch. Never changes the picture.
    pub ray_quota: u32,
    /// Also gathers albedo, normal and depth of what is seen first; the view's, where settings come as text.
    #[serde(skip)]
    pub aovs: bool,
}

impl Default for PathTracerSettings {
    fn default() -> Self {
        Self {
            path_set: PathSet::ALL,
            sampler: SamplerKind::Sobol,
            seed: 0,
            roulette_start: 4,
            roulette_cap: 0.95,
            multiple_scattering: true,
            separable_masking: false,
            equiangular: true,
            paths_in_flight: 0,
            ray_quota: 32_768,
            aovs: false,
        }
    }
}

impl PathTracerSettings {
    /// Refuses what is out of range.
    pub(super) fn check(&self) -> Result<()> {
        // Paths in scenes that lose nothing end by roulette alone.
        if !(self.roulette_cap > 0.0 && self.roulette_cap <= ROULETTE_CAP_MAX) {
            let cause = format!("is not in (0, {ROULETTE_CAP_MAX}]");
            return Err(Error::setting("roulette_cap", self.roulette_cap, cause));
        }
        if self.roulette_start > ROULETTE_START_MAX {
            let cause = format!("is more than {ROULETTE_START_MAX}");
            return Err(Error::setting("roulette_start", self.roulette_start, cause));
        }
        if !RAY_QUOTAS.contains(&self.ray_quota) {
            let cause = format!("is not in {RAY_QUOTAS:?}");
            return Err(Error::setting("ray_quota", self.ray_quota, cause));
        }
        if self.paths_in_flight > SLOTS_MAX {
            let cause = format!("is more than {SLOTS_MAX}");
            return Err(Error::setting("paths_in_flight", self.paths_in_flight, cause));
        }
        Ok(())
    }
}
