//! Times of functions.

use std::hint::black_box;
use std::time::Instant;

use crate::machine::median;

/// Repeats of which the median counts.
const REPEATS: usize = 9;
const SMOKE_REPEATS: usize = 3;

/// Nanoseconds of one call: the median over repeats of a run over all `inputs`, one thread, after a run that warms up.
pub fn nanoseconds<I, O>(smoke: bool, inputs: &[I], mut function: impl FnMut(&I) -> O) -> f64 {
    let mut run = || {
        let start = Instant::now();
        for input in inputs {
            black_box(function(black_box(input)));
        }
        start.elapsed().as_secs_f64() * 1e9 / inputs.len().max(1) as f64
    };
    run();
    let repeats = if smoke { SMOKE_REPEATS } else { REPEATS };
    median((0..repeats).map(|_| run()).collect())
}

/// Seconds of one call of something long, the median over repeats.
///
/// # Errors
/// The call's first.
pub fn seconds<E>(smoke: bool, mut function: impl FnMut() -> Result<(), E>) -> Result<f64, E> {
    let repeats = if smoke { SMOKE_REPEATS } else { REPEATS };
    let mut times = Vec::new();
    for _ in 0..repeats {
        let start = Instant::now();
        function()?;
        times.push(start.elapsed().as_secs_f64());
    }
    Ok(median(times))
}
