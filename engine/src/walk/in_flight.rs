//! A wave under way between two submissions: how far it is, and what the next one begins with.

use super::stall::StallWatch;
use super::wave::{MediumCounts, Status};
use crate::gpu::shaders::constants::{
    FETCH_STAGES, FETCHES_EXTEND, FETCHES_MEDIUM, FETCHES_SHADE, FETCHES_SHADOW, STALLED_ARRIVAL, STALLED_EXTEND,
    STALLED_SCATTER, STALLED_SHADOW,
};
use crate::gpu::shaders::types::WalkKey;
use crate::gpu::{Timings, wide_counter};

/// Bytes of a word.
const WORD_BYTES: u64 = 4;

/// What a wave took.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Walked {
    /// Of its submissions.
    pub timings: Vec<Timings>,
    /// Rays followed to their closest hits.
    pub rays: u64,
    /// Places that something waited at, of all bounces.
    pub waited: u64,
    /// Submissions that ended with rays or places stopped by a quota, which then went on.
    pub stalls: u64,
    /// Submissions that ended with places left for later, since their work was used up.
    pub postponed: u64,
    /// Submissions.
    pub submissions: u64,
    /// Loop iterations that count as their work ([`WalkOptions::work`](super::WalkOptions::work)), rounded down ray by ray.
    pub work: u64,
    /// What happened in media.
    pub media: MediumCounts,
    /// What its stages have fetched, where they count it.
    pub fetches: Fetches,
}

/// Texels that the stages of a wave have fetched of records and of what they hand on, without those of the ray index: exact counts of what their specialized kernels
/// need, by [`Fetches::STAGES`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct Fetches {
    /// Texels.
    pub texels: [u64; FETCH_STAGES as usize],
    /// Bytes of them.
    pub bytes: [u64; FETCH_STAGES as usize],
}

impl Fetches {
    /// The stages: closest hits, the way through media, scattering, shadow rays.
    pub const STAGES: [&'static str; FETCH_STAGES as usize] = ["extend", "medium", "shade", "shadow"];

    pub(super) fn of(status: &Status) -> Self {
        let stages = [FETCHES_EXTEND, FETCHES_MEDIUM, FETCHES_SHADE, FETCHES_SHADOW];
        let count = |words: &[u32; 2 * FETCH_STAGES as usize], stage: u32| {
            let low = 2 * stage as usize;
            wide_counter([words[low], words[low + 1]])
        };
        Self {
            texels: stages.map(|stage| count(&status.fetched_texels, stage)),
            bytes: stages.map(|stage| WORD_BYTES * count(&status.fetched_words, stage)),
        }
    }

    /// What has come to it since `before`.
    pub fn since(self, before: Self) -> Self {
        let less = |after: [u64; FETCH_STAGES as usize], before: [u64; FETCH_STAGES as usize]| {
            std::array::from_fn(|stage| after[stage] - before[stage])
        };
        Self {
            texels: less(self.texels, before.texels),
            bytes: less(self.bytes, before.bytes),
        }
    }
}

impl std::ops::AddAssign for Fetches {
    fn add_assign(&mut self, more: Self) {
        for stage in 0..Self::STAGES.len() {
            self.texels[stage] += more.texels[stage];
            self.bytes[stage] += more.bytes[stage];
        }
    }
}

/// A wave of walks under way: what [`Walker::begin`](super::Walker::begin) makes and [`Walker::advance`](super::Walker::advance) takes on.
pub struct WaveInFlight {
    /// No other wave of any walker has it.
    pub(super) number: u64,
    pub(super) key: WalkKey,
    pub(super) status: Status,
    pub(super) next: Next,
    /// Walks that the next submission begins behind those that are alive, of a wave that is kept full.
    pub(super) begins: u32,
    /// Some rays of the stage that goes on were stopped by a quota, rather than left for later before they began.
    pub(super) resumes: bool,
    /// Places of the bounce at which an arrival stage was stopped by its quota.
    pub(super) stopped: u32,
    pub(super) watch: StallWatch,
    pub(super) walked: Walked,
}

/// What the next submission of a wave begins with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Next {
    /// Where walks start.
    Start,
    /// The next bounce.
    Bounce,
    /// Rays of a bounce that are not at their closest hits yet.
    Hits,
    /// The arrival stage, at the places that it has not looked at yet.
    Arrival,
    /// What the arrival stage lacks where it was stopped, from this part on.
    Stopped(u64),
    /// Scattering, at the places where it was not done yet.
    Scatter,
    /// Shadow rays that are not at their ends yet.
    Shadows,
    /// Nothing: all walks have ended.
    End,
}

impl Next {
    /// Whether the first bounce of a submission begins with its closest hits.
    pub fn has_hits(self) -> bool {
        !matches!(self, Self::Arrival | Self::Scatter)
    }

    /// Whether the arrival stage of the first bounce is still to be recorded.
    pub fn has_arrival(self) -> bool {
        self != Self::Scatter
    }
}

impl WaveInFlight {
    /// What it has taken so far.
    pub fn walked(&self) -> &Walked {
        &self.walked
    }

    /// The timings of the submissions since they were taken last.
    pub fn take_timings(&mut self) -> Vec<Timings> {
        std::mem::take(&mut self.walked.timings)
    }

    /// Whether all walks have ended and nothing waits.
    pub fn has_ended(&self) -> bool {
        self.next == Next::End
    }

    /// Whether it lies between two bounces, all of what came before being done.
    pub fn is_between_bounces(&self) -> bool {
        matches!(self.next, Next::Bounce | Next::End)
    }

    /// Walks that are alive.
    pub fn walks(&self) -> u32 {
        self.status.active_count
    }

    /// Of a wave that is kept full and has walks: the number that its owner has given the walk that began first of them, and before the last refill.
    pub fn oldest(&self) -> u32 {
        self.status.oldest
    }

    /// After a submission that began with `from`: what the next one begins with.
    pub(super) fn follow(&mut self, from: Next) -> Next {
        let status = &self.status;
        let (stops, postpones) = (status.unfinished > 0, status.unstarted > 0);
        match status.stalled {
            STALLED_EXTEND => {
                self.resumes = stops || (self.resumes && from == Next::Hits);
                Next::Hits
            }
            STALLED_SHADOW => {
                self.resumes = stops || (self.resumes && from == Next::Shadows);
                Next::Shadows
            }
            STALLED_ARRIVAL => {
                self.stopped += status.unfinished;
                if postpones { Next::Arrival } else { Next::Stopped(0) }
            }
            STALLED_SCATTER => Next::Scatter,
            // The arrival stage alone has been recorded.
            _ if self.stopped > 0 => Next::Stopped(0),
            _ if status.active_count > 0 => Next::Bounce,
            _ => Next::End,
        }
    }
}
