//! GPU time and counters of passes.
//!
//! Drivers end a submission that takes too long (seconds) and lose the device with it. Whoever submits work of unknown size should begin
//! with little, and size each submission by the [`Timings`] of the last: [`Timings::seconds`] says how long it took, and
//! [`Timings::longest`] which pass to make smaller. Where a device has no timestamps ([`Timings::untimed`]), the host's clock around
//! [`Submission::wait`](super::Submission::wait) is an upper bound.

/// One pass of a submission.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct PassTiming {
    /// The pass's name.
    pub name: String,
    /// GPU time between the timestamps before and after it; `None` without timestamp support.
    pub nanoseconds: Option<u64>,
    /// Barrier commands recorded in it, exact.
    pub barriers: u32,
    /// Compute shader invocations, when pipeline statistics were asked for.
    pub invocations: Option<u64>,
    /// What was drawn, when pipeline statistics were asked for on a queue that draws.
    pub drawn: Option<Drawn>,
}

/// Counts of draws, by the device's pipeline statistics: what they count of what a device leaves out or does twice is its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct Drawn {
    /// Vertex shader invocations.
    pub vertices: u64,
    /// Primitives that reached clipping: as draws or geometry shaders emit them.
    pub primitives: u64,
    /// Fragment shader invocations. Some drivers count whole blocks of pixels, others only the fragments that pass an early depth test.
    pub fragments: u64,
}

/// All passes of a submission, in recording order.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct Timings {
    /// The passes.
    pub passes: Vec<PassTiming>,
    /// Why the passes have no times; `None` when they have.
    pub untimed: Option<&'static str>,
}

/// Those that have none count as 0.
fn seconds<'a>(passes: impl IntoIterator<Item = &'a PassTiming>) -> f64 {
    let timed = passes.into_iter().filter_map(|pass| pass.nanoseconds);
    timed.map(|ns| ns as f64 * 1e-9).sum()
}

impl Timings {
    /// GPU seconds of all passes together.
    pub fn seconds(&self) -> f64 {
        seconds(&self.passes)
    }

    /// GPU seconds of the passes with this name; 0 without times.
    pub fn seconds_of(&self, name: &str) -> f64 {
        seconds(self.passes.iter().filter(|pass| pass.name == name))
    }

    /// Number of passes with this name.
    pub fn count(&self, name: &str) -> usize {
        self.passes.iter().filter(|pass| pass.name == name).count()
    }

    /// The pass that took longest, the first of equal ones; `None` without times.
    pub fn longest(&self) -> Option<&PassTiming> {
        let timed = self.passes.iter().rev().filter(|pass| pass.nanoseconds.is_some());
        timed.max_by_key(|pass| pass.nanoseconds)
    }
}

/// Seconds that submissions took, which the host has waited for together: GPU time, or, where one of them has none, what the host has waited for all of them,
/// an upper bound.
pub(crate) fn seconds_or_waited<'a>(submissions: impl IntoIterator<Item = &'a Timings>, waited: f64) -> f64 {
    let times = submissions.into_iter();
    let seconds = times.map(|timings| timings.untimed.is_none().then(|| timings.seconds()));
    seconds.sum::<Option<f64>>().unwrap_or(waited)
}

/// Ticks from one timestamp to a later one, of which only the low `valid_bits` count: the counter may have wrapped once in between. An end
/// that lies just before the beginning, as a device with several clocks may report it, counts as no time.
pub(super) fn elapsed(begin: u64, end: u64, valid_bits: u32) -> u64 {
    let mask = 1u64.checked_shl(valid_bits).map_or(u64::MAX, |beyond| beyond - 1);
    let ticks = end.wrapping_sub(begin) & mask;
    if ticks > mask / 2 { 0 } else { ticks }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn timestamps_wrap_at_their_valid_bits() {
        assert_eq!(elapsed(5, 12, 64), 7);
        assert_eq!(elapsed(u64::MAX - 1, 3, 64), 5);
        assert_eq!(elapsed(0xF_FFFF_FFFE, 3, 36), 5);
        // Bits beyond the valid ones are undefined.
        assert_eq!(elapsed(0xAB_0000_0000_0010, 0xCD_0000_0000_0018, 36), 8);
        assert_eq!(elapsed(12, 5, 64), 0);
        assert_eq!(elapsed(12, 5, 36), 0);
        assert_eq!(elapsed(7, 9, 0), 0);
    }

    #[test]
    fn the_longest_pass_is_found() {
        let pass = |name: &str, nanoseconds| PassTiming {
            name: name.into(),
            nanoseconds,
            barriers: 0,
            invocations: None,
            drawn: None,
        };
        let passes = vec![
            pass("a", Some(3)),
            pass("b", Some(9)),
            pass("c", None),
            pass("d", Some(9)),
        ];
        let timings = Timings { passes, untimed: None };
        assert_eq!(timings.longest().map(|pass| pass.name.as_str()), Some("b"));
        assert_eq!(Timings::default().longest(), None);
    }

    #[test]
    fn what_the_host_waited_counts_once() {
        let pass = PassTiming {
            name: "a".into(),
            nanoseconds: Some(500_000_000),
            barriers: 0,
            invocations: None,
            drawn: None,
        };
        let timed = Timings {
            passes: vec![pass],
            untimed: None,
        };
        let untimed = Timings {
            passes: Vec::new(),
            untimed: Some("no timestamps"),
        };
        assert_eq!(seconds_or_waited([&timed, &timed], 8.0), 1.0);
        assert_eq!(seconds_or_waited([&untimed, &untimed], 8.0), 8.0);
        assert_eq!(seconds_or_waited([&timed, &untimed, &timed], 8.0), 8.0);
        assert_eq!(seconds_or_waited(&[], 8.0), 0.0);
    }
}
