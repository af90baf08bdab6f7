//! Watching experiments: a bar on a terminal, lines about scenes in a pipe, and Ctrl-C that keeps what is there.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clerestory::render::Progress;
use clerestory_tools::experiments::render_sweep::Watch;
use indicatif::{ProgressBar, ProgressStyle};

use crate::failure::{Code, Failure, Outcome};
use crate::output;

/// Steps of the bar for each picture.
const STEPS: u64 = 1000;

/// The bar and the wish to stop.
pub struct Bar {
    bar: ProgressBar,
    stop: Arc<AtomicBool>,
    /// Pictures done before the one at hand.
    done: Cell<u64>,
}

impl Bar {
    /// Begins to listen for Ctrl-C and requests to end. The bar shows itself only where the error output is a terminal.
    pub fn start() -> Outcome<Self> {
        let bar = ProgressBar::new(0);
        if let Ok(style) = ProgressStyle::with_template("{spinner} {wide_bar} {percent:>3} %  {msg}") {
            bar.set_style(style);
        }
        let stop = Arc::new(AtomicBool::new(false));
        let (wish, shown) = (Arc::clone(&stop), bar.clone());
        ctrlc::set_handler(move || {
            if wish.swap(true, Ordering::SeqCst) {
                std::process::exit(Code::Interrupted as i32);
            }
            let line = "stopping; finished pictures are kept. Once more stops at once";
            shown.suspend(|| output::note(line));
        })
        .map_err(|cause| Failure {
            code: Code::Run,
            message: format!("cannot listen for Ctrl-C: {cause}"),
            hint: None,
        })?;
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
        self.bar.enable_steady_tick(Duration::from_millis(120));
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
        self.stop.load(Ordering::SeqCst)
    }
}
