//! What the owner of walks records, stage by stage.

use super::arrival::ArrivalStage;
use super::walker::Bounce;
use super::wave::WaveBuffers;
use crate::Result;
use crate::gpu::shaders::sets::WaveSet;
use crate::gpu::{Pass, Recorder};

/// What the owner of walks does with them, stage by stage. Kernels hand on shadow rays and walks by `walk/hand_on.glsl`, which does what scenes with media
/// take besides. The [`Walker`](super::Walker) records the closest hits before [`record_scatter`](WalkStages::record_scatter)
/// and the compaction of the queues behind it; every method leaves [`stage_barrier`](super::stage_barrier) behind what it records.
pub trait WalkStages {
    /// Records what goes first in a submission, whatever its wave is.
    ///
    /// # Errors
    /// Those of recording.
    fn record_before(&mut self, _recorder: &mut Recorder, _buffers: &WaveBuffers) -> Result<()> {
        Ok(())
    }

    /// A submission that began so is the device's now, whatever becomes of the wait for it.
    fn submitted(&mut self) {}

    /// Sets what the owner counts to zero, in the first pass of a wave.
    ///
    /// # Errors
    /// Those of recording.
    fn reset(&self, _pass: &mut Pass<'_>) -> Result<()> {
        Ok(())
    }

    /// Records where walks start: `walk_states_out` and `walk_gathered` of each slot.
    ///
    /// # Errors
    /// Those of recording.
    fn record_start(&self, recorder: &mut Recorder, wave: &WaveSet<'_>) -> Result<()>;

    /// Records where the walks start that a wave that is kept full takes in: `walk_states_out`, `walk_gathered`, their numbers and, in scenes with media,
    /// `walk_medium_states` of slots that are free by the wave's [`Turnover`](super::Turnover), these slots to `walk_queue_out`, and that they are taken.
    ///
    /// # Errors
    /// Those of recording.
    fn record_refill(
        &self,
        _recorder: &mut Recorder,
        _buffers: &WaveBuffers,
        _wave: &WaveSet<'_>,
        _refill: Refill,
    ) -> Result<()> {
        Ok(())
    }

    /// What is gathered between arrival and scattering.
    fn arrival(&self) -> Option<&dyn ArrivalStage> {
        None
    }

    /// Records what happens where rays have arrived: by place `walk_flags_out`, and `walk_states_out` of walks that go on.
    ///
    /// # Errors
    /// Those of recording.
    fn record_scatter(&self, recorder: &mut Recorder, bounce: &Bounce<'_>) -> Result<()>;

    /// Records what is done with what waits, by the queue of its places; [`Bounce::record_shadow`] for shadow rays.
    ///
    /// # Errors
    /// Those of recording.
    fn record_waiting(&self, _recorder: &mut Recorder, _bounce: &Bounce<'_>) -> Result<()> {
        Ok(())
    }

    /// Copies what the owner counts to where the host reads it, at the end of a submission.
    ///
    /// # Errors
    /// Those of recording.
    fn read_back(&self, _pass: &mut Pass<'_>) -> Result<()> {
        Ok(())
    }
}

/// Walks that a wave that is kept full takes in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refill {
    /// The first of their places in the queue, behind those of walks that are alive.
    pub place: u32,
    /// How many they are.
    pub count: u32,
    /// The third word of their numbers: the bounces that the wave has finished.
    pub round: u32,
}
