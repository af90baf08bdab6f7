//! The progress of a rendering: a bar on a terminal, silence in a pipe, and Ctrl-C that keeps what is there.

use clerestory::plan::{self, Goal, Plan};
use clerestory::render::{Progress, RenderOptions, Rendered, Renderer};
use indicatif::ProgressBar;

use crate::failure::Outcome;
use crate::output;
use crate::stop::Stop;

/// Steps of the bar.
const LENGTH: u64 = 1000;
/// A rendering that shows a bar and can be stopped.
pub struct Interruptible {
    bar: ProgressBar,
    stop: Stop,
}

impl Interruptible {
    /// Begins to listen for Ctrl-C and requests to end. The bar shows itself only where the error output is a terminal.
    pub fn start() -> Outcome<Self> {
        let bar = output::bar(LENGTH);
        let stop = Stop::listen(
            &bar,
            "stopping after this step; once more stops at once and writes nothing",
        )?;
        Ok(Self { bar, stop })
    }

    /// Renders pilots and chooses. A stop request ends the pilots half a second later at most, and the picture after its first step.
    pub fn plan(&self, renderer: &Renderer, options: &RenderOptions, goal: Goal) -> Outcome<Plan> {
        self.bar.set_message("pilot pictures…");
        self.bar.enable_steady_tick(output::TICK);
        Ok(plan::plan(renderer, options, goal, &mut || !self.stop.requested())?)
    }

    /// Renders until done, out of time or told to stop; says whether it was told. The first step is always done.
    pub fn render(&self, renderer: &Renderer, options: &RenderOptions) -> Outcome<(Rendered, bool)> {
        let result = self.steps(renderer, options);
        self.bar.finish_and_clear();
        result
    }

    fn steps(&self, renderer: &Renderer, options: &RenderOptions) -> Outcome<(Rendered, bool)> {
        tracing::info!("rendering; the first step compiles the kernels");
        self.bar.set_message("compiling kernels…");
        self.bar.enable_steady_tick(output::TICK);
        let mut rendering = renderer.start(options)?;
        let mut first = None;
        while let Some(progress) = rendering.step()? {
            let first = *first.get_or_insert(progress);
            self.bar.set_position((progress.fraction * LENGTH as f64) as u64);
            self.bar.set_message(message(first, progress));
            if self.stop.requested() {
                break;
            }
        }
        let rendered = rendering.finish()?;
        // A request that came when all samples were there has stopped nothing.
        let interrupted = self.stop.requested() && rendered.report.stopped_early;
        Ok((rendered, interrupted))
    }
}

/// Rays per second and time left, both without the first step, which compiles the kernels.
fn message(first: Progress, now: Progress) -> String {
    let seconds = now.seconds - first.seconds;
    let done = now.fraction - first.fraction;
    if seconds <= 0.0 || done <= 0.0 {
        return String::new();
    }
    let rate = now.rays.saturating_sub(first.rays) as f64 / seconds;
    let left = (1.0 - now.fraction) * seconds / done;
    format!("{}rays/s, {} left", output::metric(rate), time(left))
}

/// Seconds as `8 s`, `3:05` or `2:03:05`.
fn time(seconds: f64) -> String {
    let whole = seconds.ceil() as u64;
    match (whole / 3600, whole / 60 % 60, whole % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m}:{s:02}"),
        (h, m, s) => format!("{h}:{m:02}:{s:02}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_left_round_up_and_drop_leading_units() {
        let shown = [0.2, 59.1, 185.0, 7385.0].map(time);
        assert_eq!(shown, ["1 s", "1:00", "3:05", "2:03:05"]);
    }

    #[test]
    fn rates_leave_compilation_out() {
        let at = |fraction, seconds, rays| {
            let mut progress = Progress::default();
            (progress.fraction, progress.seconds, progress.rays) = (fraction, seconds, rays);
            progress
        };
        assert_eq!(message(at(0.1, 20.0, 1000), at(0.1, 20.0, 1000)), "");
        assert_eq!(
            message(at(0.1, 20.0, 1000), at(0.55, 21.0, 3_001_000)),
            "3.00 Mrays/s, 1 s left"
        );
    }
}
