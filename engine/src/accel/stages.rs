//! Where the time of a build goes.

use std::time::Instant;

/// Milliseconds of the stages that build a ray index; 0 for those that its kind does not have. On the host by wall clock, on the device
/// by its timestamps, but for `transfer`.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct BuildStages {
    /// Finding the triangles that rays can meet, and their boxes.
    pub triangles: f64,
    /// Copies to and from the device, and waiting for it.
    pub transfer: f64,
    /// Morton codes.
    pub codes: f64,
    /// Sorting these.
    pub sort: f64,
    /// The tree: its splits, boxes and leaves.
    pub hierarchy: f64,
    /// Optimising it, of high quality.
    pub optimise: f64,
    /// Nodes and triangles to where rays want them.
    pub layout: f64,
    /// Depth and surface area cost.
    pub statistics: f64,
}

impl BuildStages {
    /// All of them.
    pub fn total(&self) -> f64 {
        self.named().iter().map(|(_, ms)| ms).sum()
    }

    /// The sums of both.
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self {
            triangles: self.triangles + other.triangles,
            transfer: self.transfer + other.transfer,
            codes: self.codes + other.codes,
            sort: self.sort + other.sort,
            hierarchy: self.hierarchy + other.hierarchy,
            optimise: self.optimise + other.optimise,
            layout: self.layout + other.layout,
            statistics: self.statistics + other.statistics,
        }
    }

    /// Name and milliseconds of each, in order.
    pub fn named(&self) -> [(&'static str, f64); 8] {
        [
            ("triangles", self.triangles),
            ("transfer", self.transfer),
            ("codes", self.codes),
            ("sort", self.sort),
            ("hierarchy", self.hierarchy),
            ("optimise", self.optimise),
            ("layout", self.layout),
            ("statistics", self.statistics),
        ]
    }
}

/// Measures stages that follow each other.
pub(super) struct Stopwatch(Instant);

impl Stopwatch {
    pub(super) fn start() -> Self {
        Self(Instant::now())
    }

    /// Milliseconds since the start or the last lap.
    pub(super) fn lap(&mut self) -> f64 {
        let begin = std::mem::replace(&mut self.0, Instant::now());
        1e3 * (self.0 - begin).as_secs_f64()
    }
}
