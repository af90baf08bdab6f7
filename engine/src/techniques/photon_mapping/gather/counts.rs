//! Exact counts of the queries of photon maps.

use crate::gpu::shaders::constants::BEAM_BOUNCES;

/// Exact counts of queries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct GatherCounts {
    /// Points at which the map was asked.
    pub queries: u64,
    /// Kernels that held them.
    pub photons: u64,
    /// Rays that told whether what was found is seen: of photon planes alone.
    pub rays: u64,
}

impl std::ops::AddAssign for GatherCounts {
    fn add_assign(&mut self, other: Self) {
        self.queries += other.queries;
        self.photons += other.photons;
        self.rays += other.rays;
    }
}

/// What rays through media took of the volume map, where that is counted ([`PhotonSettings::count_fetches`](crate::techniques::photon_mapping::PhotonSettings::count_fetches)): exact counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct RayFetches {
    /// Queries of the first ray of a path, of the second one, which may be one behind a boundary that the first has only crossed, and so on; the last number has all later ones, too.
    pub queries_by_bounce: [u64; BEAM_BOUNCES as usize],
    /// Nodes of the map that were fetched, two at a time, once for all rays of a subgroup that go through it together.
    pub nodes: u64,
    /// Records, likewise.
    pub records: u64,
    /// Pairs of nodes, and records, that each ray has gone through.
    pub tests: u64,
}

impl RayFetches {
    /// Queries of rays after the first one of a path.
    pub fn later_queries(&self) -> u64 {
        self.queries_by_bounce[1..].iter().sum()
    }
}

impl std::ops::AddAssign for RayFetches {
    fn add_assign(&mut self, other: Self) {
        for (sum, more) in self.queries_by_bounce.iter_mut().zip(other.queries_by_bounce) {
            *sum += more;
        }
        self.nodes += other.nodes;
        self.records += other.records;
        self.tests += other.tests;
    }
}
