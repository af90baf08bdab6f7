//! Who watches an experiment run, and may stop it.

use clerestory::Result;
use clerestory::render::{Progress, RenderOptions, Rendered, Renderer};

/// Sees an experiment's progress and decides whether it goes on.
pub trait Watch {
    /// A part begins (most often a picture): what it is, and how many of all parts were done before.
    fn begin(&self, what: &str, done: usize, all: usize);
    /// A step of the part at hand is done.
    fn step(&self, progress: Progress);
    /// Something that a reader of the error output should know.
    fn note(&self, line: &str);
    /// Whether to stop.
    fn stopped(&self) -> bool;
}

/// Watches nothing and never stops.
#[derive(Debug, Clone, Copy, Default)]
pub struct Unwatched;

impl Watch for Unwatched {
    fn begin(&self, _what: &str, _done: usize, _all: usize) {}

    fn step(&self, _progress: Progress) {}

    fn note(&self, _line: &str) {}

    fn stopped(&self) -> bool {
        false
    }
}

/// A picture; `None` when it was stopped.
///
/// # Errors
/// Those of techniques.
pub fn render(renderer: &Renderer, options: &RenderOptions, watch: &dyn Watch) -> Result<Option<Rendered>> {
    let mut rendering = renderer.start(options)?;
    while let Some(progress) = rendering.step()? {
        watch.step(progress);
        if watch.stopped() {
            return Ok(None);
        }
    }
    rendering.finish().map(Some)
}
