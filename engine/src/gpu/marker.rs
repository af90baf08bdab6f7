//! Crash markers: one word per pass, written as the pass begins, that the host can read after the device is lost.

use std::collections::BTreeMap;

use super::buffer::Buffer;
use super::recorder::MAX_PASSES;

/// The value that says "this pass has begun".
pub(super) const BEGUN: u32 = 0x0C1E_4E57;

/// The submissions that the device may still be working on, and how far it is known to have come.
#[derive(Debug, Default)]
pub(super) struct InFlight {
    /// By timeline value.
    submissions: BTreeMap<u64, (Buffer, Vec<String>)>,
    last_finished: Option<String>,
}

impl InFlight {
    /// Notes a submission before the queue gets it.
    pub fn begin(&mut self, value: u64, markers: Buffer, passes: Vec<String>) {
        self.submissions.insert(value, (markers, passes));
    }

    /// Forgets a submission that the queue refused or has finished.
    pub fn end(&mut self, value: u64, finished: bool) {
        if let Some((_, passes)) = self.submissions.remove(&value)
            && finished
            && let Some(last) = passes.last()
        {
            self.last_finished = Some(last.clone());
        }
    }

    /// The name of the last pass that began, of all submissions.
    pub fn last_pass(&self) -> String {
        let begun = |(markers, passes): &(Buffer, Vec<String>)| {
            let words = markers.words_now(MAX_PASSES)?;
            let last = words.iter().take(passes.len()).rposition(|word| *word == BEGUN)?;
            passes.get(last).cloned()
        };
        let in_flight = self.submissions.values().rev().find_map(begun);
        in_flight
            .or_else(|| self.last_finished.clone())
            .unwrap_or_else(|| "before the first pass".into())
    }
}
