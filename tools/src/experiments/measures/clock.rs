//! Times of functions.

use std::convert::Infallible;
use std::hint::black_box;

use crate::timing::{median, repeated, timed};

/// Repeats of which the median counts.
const REPEATS: usize = 9;
const SMOKE_REPEATS: usize = 3;

fn repeats(smoke: bool) -> usize {
    if smoke { SMOKE_REPEATS } else { REPEATS }
}

/// Nanoseconds of one call: the median over repeats of a run over all `inputs`, one thread, after a run that warms up.
pub fn nanoseconds<I, O>(smoke: bool, inputs: &[I], mut function: impl FnMut(&I) -> O) -> f64 {
    let Ok(((), times)) = repeated(repeats(smoke), || {
        Ok::<_, Infallible>(((), nanoseconds_once(inputs, &mut function)))
    });
    median(times)
}

/// Nanoseconds of one call, by one run over all `inputs` on one thread: for contenders that take turns ([`Context::in_turns`]).
///
/// [`Context::in_turns`]: super::Context::in_turns
pub fn nanoseconds_once<I, O>(inputs: &[I], mut function: impl FnMut(&I) -> O) -> f64 {
    let ((), seconds) = timed(|| {
        for input in inputs {
            black_box(function(black_box(input)));
        }
    });
    1e9 * seconds / inputs.len().max(1) as f64
}

/// Seconds of one call of something long, the median over repeats after one that warms up.
///
/// # Errors
/// The call's first.
pub fn seconds<E>(smoke: bool, mut function: impl FnMut() -> Result<(), E>) -> Result<f64, E> {
    let ((), seconds) = repeated(repeats(smoke), || {
        let (result, seconds) = timed(&mut function);
        result.map(|()| ((), seconds))
    })?;
    Ok(median(seconds))
}
