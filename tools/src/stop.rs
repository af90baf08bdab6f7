//! Stopping a command: Ctrl-C or a request to end raises a flag that the command looks at between its steps; a second one ends the program at
//! once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::ProgressBar;

use crate::failure::{Code, Failure, Outcome};
use crate::output;

/// The stop request.
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Begins to listen; possible once in a run of the program. The first request is answered with `line`, beside the bar.
    pub fn listen(bar: &ProgressBar, line: &'static str) -> Outcome<Self> {
        let flag = Arc::new(AtomicBool::new(false));
        let (raised, bar) = (Arc::clone(&flag), bar.clone());
        ctrlc::set_handler(move || {
            if raised.swap(true, Ordering::SeqCst) {
                std::process::exit(Code::Interrupted as i32);
            }
            bar.suspend(|| output::note(line));
        })
        .map_err(|cause| Failure {
            code: Code::Run,
            message: format!("cannot listen for Ctrl-C: {cause}"),
            hint: None,
        })?;
        Ok(Self(flag))
    }

    /// Whether somebody has asked to stop.
    pub fn requested(&self) -> bool {
        self.0.load(Ordering::SeqCst)
    }
}
