//! Walks through media whose collisions are records beside those of surfaces, as virtual lights are: what the owner of such records does in the place of the
//! tracer's own stages for media, which keep collisions apart.

use crate::Result;
use crate::gpu::{Pass, PipelineInfo};
use crate::transport::GpuScene;
use crate::walk::{Bounce, WalkKey};

/// What the stage is told beside the wave.
#[derive(Debug, Clone, Copy)]
pub(in crate::techniques) struct CollisionPass {
    pub key: WalkKey,
    /// Collisions are kept of walks that have been scattered at least so often before.
    pub first_deposit: u32,
    /// And at most.
    pub last_bounce: u32,
}

/// Of a wave.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::techniques) struct CollisionCounts {
    /// Walks that end in a medium or at its boundary: by roulette, after the last bounce, or without power.
    pub absorbed: u32,
    /// Collisions that were kept.
    pub kept: u32,
}

/// The stage between closest hits and scattering by surfaces: it writes `walk_medium_events` of all places, and handles walks that collide or pass a boundary. What it
/// keeps of a collision waits by place.
pub(in crate::techniques) trait CollisionStage: Send {
    fn pipeline(&self) -> PipelineInfo;

    /// Sets what it counts to zero, before a wave.
    ///
    /// # Errors
    /// Those of recording.
    fn reset(&self, pass: &mut Pass<'_>) -> Result<()>;

    /// Records it for a bounce, with its barrier.
    ///
    /// # Errors
    /// Those of recording.
    fn record(&self, pass: &mut Pass<'_>, bounce: &Bounce<'_>, scene: &GpuScene, told: CollisionPass) -> Result<()>;

    /// Copies what it counts to where the host reads it.
    ///
    /// # Errors
    /// Those of recording.
    fn read_back(&self, pass: &mut Pass<'_>) -> Result<()>;

    /// Of the last wave.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost).
    fn counts(&self) -> Result<CollisionCounts>;
}
