//! The progress of experiments: a bar on a terminal, lines about scenes in a pipe, and Ctrl-C that keeps what is there.

use std::cell::Cell;

use clerestory::render::Progress;
use clerestory_tools::experiments::watch::Watch;
use indicatif::ProgressBar;

use crate::failure::Outcome;
use crate::output;
use crate::stop::Stop;

/// Steps of the bar for each picture.
const STEPS: u64 = 1000;

/// The bar and the stop request.
pub struct Bar {
    bar: ProgressBar,
    stop: Stop,
    /// Pictures done before the one at hand.
    done: Cell<u64>,
}

impl Bar {
    /// Begins to listen for Ctrl-C and requests to end. The bar shows itself only where the error output is a terminal.
    pub fn start() -> Outcome<Self> {
        let bar = output::bar(0);
        let stop = Stop::listen(&bar, "stopping; what is finished is kept. Once more stops at once")?;
        Ok(Self {
            bar,
            stop,
            done: Cell::new(0),
        })
    }

    /// Takes the bar away.
    pub fn clear(&self) {
        self.bar.finish_and_clear();
        self.bar.reset();
    }
}

impl Watch for Bar {
    fn begin(&self, what: &str, done: usize, all: usize) {
        tracing::info!(done, all, "{}", output::one_line(what));
        self.bar.enable_steady_tick(output::TICK);
        self.done.set(done as u64);
        self.bar.set_length(all as u64 * STEPS);
        self.bar.set_position(done as u64 * STEPS);
        self.bar
            .set_message(format!("{done} of {all}; {}", output::one_line(what)));
    }

    fn step(&self, progress: Progress) {
        let within = (progress.fraction * STEPS as f64) as u64;
        self.bar.set_position(self.done.get() * STEPS + within);
    }

    fn note(&self, line: &str) {
        self.bar.suspend(|| output::note(line));
    }

    fn stopped(&self) -> bool {
        self.stop.requested()
    }
}
