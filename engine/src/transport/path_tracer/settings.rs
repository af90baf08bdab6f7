//! The path tracer's settings and their ranges.

use crate::transport::path_set::PathSet;
use crate::transport::random::SamplerKind;
use crate::{Error, Result};

/// Bounds of the roulette's settings, so that every path ends.
const ROULETTE_CAP_MAX: f32 = 0.999;
const ROULETTE_START_MAX: u32 = 4096;

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
    pub roulette_cap: f32,
    /// Compensation of rough metals for scattering among microfacets; off for comparison with single-scattering renderers.
    pub multiple_scattering: bool,
    /// Uncorrelated instead of height-correlated Smith masking, for the same comparison.
    pub separable_masking: bool,
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
            paths_in_flight: 0,
            ray_quota: 32_768,
            aovs: false,
        }
    }
}

impl PathTracerSettings {
    pub(super) fn check(&self) -> Result<()> {
        let fail = |name: &str, value: String, cause: &str| {
            Err(Error::Setting {
                name: name.into(),
                value,
                cause: cause.into(),
            })
        };
        // Paths in scenes that lose nothing end by roulette alone.
        if !(self.roulette_cap > 0.0 && self.roulette_cap <= ROULETTE_CAP_MAX) {
            return fail("roulette_cap", self.roulette_cap.to_string(), "is not in (0, 0.999]");
        }
        if self.roulette_start > ROULETTE_START_MAX {
            return fail("roulette_start", self.roulette_start.to_string(), "is more than 4096");
        }
        // A traversal makes progress only with a quota above twice the depth of the deepest tree.
        if self.ray_quota < 128 || self.ray_quota > 60_000 {
            return fail("ray_quota", self.ray_quota.to_string(), "is not in 128..=60000");
        }
        if self.paths_in_flight > 1 << 22 {
            return fail(
                "paths_in_flight",
                self.paths_in_flight.to_string(),
                "is more than 4194304",
            );
        }
        Ok(())
    }
}
