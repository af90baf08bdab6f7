//! GPU time and counters of passes.

/// One pass of a submission.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct PassTiming {
    /// The pass's name.
    pub name: String,
    /// GPU time between the timestamps before and after it; `None` without timestamp support.
    pub nanoseconds: Option<u64>,
    /// Compute shader invocations, when pipeline statistics were asked for.
    pub invocations: Option<u64>,
}

/// All passes of a submission, in recording order.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub struct Timings {
    /// The passes.
    pub passes: Vec<PassTiming>,
}

impl Timings {
    /// GPU seconds of all passes together.
    pub fn seconds(&self) -> f64 {
        self.passes
            .iter()
            .filter_map(|pass| pass.nanoseconds)
            .map(|ns| ns as f64 * 1e-9)
            .sum()
    }

    /// Number of passes with this name.
    pub fn count(&self, name: &str) -> usize {
        self.passes.iter().filter(|pass| pass.name == name).count()
    }
}
