//! Crash markers: one word a pass, written as the pass begins, that the host can read after the device is lost.

use super::buffer::Buffer;
use super::recorder::MAX_PASSES;

/// The value that says "this pass has begun".
pub(super) const BEGUN: u32 = 0x0C1E_4E57;

/// The name of the last pass whose marker was written.
pub(super) fn last_pass(markers: &Buffer, passes: &[String]) -> String {
    let words: Vec<u32> = markers.read(0, MAX_PASSES).unwrap_or_default();
    let last = words.iter().take(passes.len()).rposition(|word| *word == BEGUN);
    last.map_or_else(|| "before the first pass".into(), |index| passes[index].clone())
}
