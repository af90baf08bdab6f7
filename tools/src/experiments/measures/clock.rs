//! Times of functions.

use std::hint::black_box;

use crate::timing::timed;

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
