//! What may be gathered where the rays of a bounce have arrived, before walks are scattered there.

use crate::Result;
use crate::gpu::shaders::sets::WaveSet;
use crate::gpu::shaders::types::WalkKey;
use crate::gpu::{BufferView, Pass, Recorder};

/// A stage between arrival and scattering, for instance one that asks a map of photons.
pub trait ArrivalStage {
    /// Records it for all places of the queue. Places that its quota stops stall the wave with `STALLED_ARRIVAL` and are counted in
    /// `status.unfinished`. A stage of long loops counts them by `count_work`, and leaves places for later by `leave_for_later` where `has_work_left` says no;
    /// it is then recorded again, and has to pass over what it has done, which it may say in `walk_resume`.
    ///
    /// # Errors
    /// Those of recording.
    fn record(&self, recorder: &mut Recorder, wave: &WaveSet<'_>, places: Places<'_>) -> Result<()>;

    /// Whether the stage finds the closest hits of a bounce's rays itself, by [`record_with_hits`](ArrivalStage::record_with_hits).
    fn finds_hits(&self) -> bool {
        false
    }

    /// Records, in place of the walker's closest-hit stage and of [`record`](ArrivalStage::record), one pass that does both; called once in a bounce, before any of its
    /// places has begun. Unfinished places stall the wave with `STALLED_EXTEND`; `walk_resume` then holds where the ray's search goes on, or a value from
    /// `PLACE_RAY_ENDED` on where the ray has ended and the rest has not. The bounce goes on by the walker's stage and `record`.
    ///
    /// # Errors
    /// Those of recording, and [`Error::Internal`](crate::Error::Internal) for a stage that finds none.
    fn record_with_hits(&self, _recorder: &mut Recorder, _wave: &WaveSet<'_>, _places: Places<'_>) -> Result<()> {
        Err(crate::Error::Internal {
            what: "arrival stage".into(),
            fault: "finds no hits".into(),
        })
    }

    /// Sets what the stage counts to zero, in the first pass of a wave.
    ///
    /// # Errors
    /// Those of recording.
    fn reset(&self, _pass: &mut Pass<'_>) -> Result<()> {
        Ok(())
    }

    /// Copies what the stage counts to where the host reads it, at the end of a submission.
    ///
    /// # Errors
    /// Those of recording.
    fn read_back(&self, _pass: &mut Pass<'_>) -> Result<()> {
        Ok(())
    }

    /// Makes what [`record_stopped`](ArrivalStage::record_stopped) takes, before anything of it is recorded.
    ///
    /// # Errors
    /// As [`Gpu::compute_pipeline`](crate::gpu::Gpu::compute_pipeline).
    fn prepare_stopped(&self) -> Result<()> {
        Ok(())
    }

    /// Records what the places that it has stopped at still lack, from a part on, as much of it as a watchdog has time for; the part to go
    /// on with, in a submission of its own.
    ///
    /// # Errors
    /// Those of recording, and [`Error::Overflow`](crate::Error::Overflow) where nothing can help such places.
    fn record_stopped(
        &self,
        recorder: &mut Recorder,
        wave: &WaveSet<'_>,
        stopped: StoppedPlaces,
        part: u64,
    ) -> Result<Option<u64>>;
}

/// The places of a wave's queue: indirect arguments of dispatches over them, and what their walks draw random numbers by.
#[derive(Debug, Clone, Copy)]
pub struct Places<'a> {
    /// One invocation per place.
    pub items: BufferView<'a>,
    /// One invocation for each [`COMPACT_CHUNK`](crate::gpu::shaders::constants::COMPACT_CHUNK) places.
    pub chunks: BufferView<'a>,
    /// One invocation per place where something waits, once the queues are compacted.
    pub waiting: BufferView<'a>,
    /// What the random numbers of the wave's walks are keyed by.
    pub key: WalkKey,
}

/// How many places an arrival stage has stopped at.
#[derive(Debug, Clone, Copy)]
pub struct StoppedPlaces {
    /// Of so many places in the queue.
    pub places: u32,
    /// Places with something left to do.
    pub stopped: u32,
    /// What the random numbers of the wave's walks are keyed by.
    pub key: WalkKey,
}
