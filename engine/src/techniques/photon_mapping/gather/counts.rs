//! Exact counts of the queries of photon maps.

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
    /// Queries of rays after the first one of a path, which may be one that has only crossed a boundary.
    pub later_queries: u64,
    /// Nodes of the map that were fetched, two at a time, once for all rays of a subgroup that go through it together.
    pub nodes: u64,
    /// Records, likewise.
    pub records: u64,
    /// Pairs of nodes, and records, that each ray has gone through.
    pub tests: u64,
}

impl std::ops::AddAssign for RayFetches {
    fn add_assign(&mut self, other: Self) {
        self.later_queries += other.later_queries;
        self.nodes += other.nodes;
        self.records += other.records;
        self.tests += other.tests;
    }
}
