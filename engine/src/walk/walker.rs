//! Follows a wave of walks to their ends, submission by submission, each a bounded piece of work.
//!
//! What bounds a submission: a place of the wave takes its quota at most, bounces are as few as the walks are many, and [`WalkOptions::work`] of long rays, walks
//! through grids and queries of maps; once that is used up, no further place is begun. Its stage stalls, whatever is recorded behind it leaves at once, and the
//! next submission goes on with the places that are not done. Every place does the same work in whichever submission, so that none of it shows.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use super::arrival::{Places, StoppedPlaces};
use super::compaction::Compaction;
use super::in_flight::{Fetches, Next, Walked, WaveInFlight};
use super::stages::{Refill, WalkStages};
use super::stall::StallWatch;
use super::trace::{RAY_QUOTA, TracePipelines, ray_quota};
use super::turnover::Turnover;
use super::wave::{Status, WaveBuffers, group_counts, indirect};
use crate::Result;
use crate::gpu::shaders::constants::{GOES_ON_FURTHER, GOES_ON_NOT, GOES_ON_RAYS, STALLED_NOT, WORK_UNIT};
use crate::gpu::shaders::sets::WaveSet;
use crate::gpu::shaders::types::WalkKey;
use crate::gpu::{Access, DeviceKind, Gpu, Pace, PipelineInfo, Recorder, wide_counter};
use crate::transport::GpuScene;

/// Work of a submission where nothing else is asked for, in loop iterations that count: some tenths of a second on two cores, and less on others.
const SOFTWARE_WORK: u64 = 1 << 24;
const DEVICE_WORK: u64 = 1 << 30;
/// Most units of work of a submission: what the places under way take besides must not pass the least of an `i32`.
const WORK_UNITS_MAX: u64 = 1 << 30;
/// Rays of the bounces of a submission on software devices, about, unless one bounce has more.
const SOFTWARE_RAYS: u32 = 1 << 19;

/// Bounces of a submission that has begun walks in a wave that is kept full: more would leave slots empty for long.
const REFILLED_BOUNCES: u32 = 2;
/// Bounces that a wave that is kept full counts before its first: an even number, so that queues have the roles of a first bounce, and more than one, so that slots are
/// read from the queue.
const REFILLED_ROUNDS: u32 = 2;

/// The number of a walker's wave before the first one.
const NO_WAVE: u64 = 0;
/// Numbers of waves, for a walker to know its own.
static NEXT_WAVE: AtomicU64 = AtomicU64::new(NO_WAVE + 1);

/// How a walker goes about it. None of it changes what walks compute.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WalkOptions {
    /// What its passes are called before the colon.
    pub name: &'static str,
    /// Walks have shadow rays, so that the kernel for them is made; they wait by place ([`WaveNeeds::waiting`](super::WaveNeeds::waiting)).
    pub shadows: bool,
    /// Loop iterations after which a ray goes on in a later dispatch; see [`ray_quota`].
    pub ray_quota: u32,
    /// Bounces recorded into one command buffer, at most: about as many as most walks have. Devices that a driver watches get as many as take a fraction of a
    /// second, by what the last submission took, software devices about 2¹⁹ rays, but one at least, of all walks: fewer slots make it shorter.
    pub bounces: usize,
    /// Work, in loop iterations, after which a submission begins no further place: those of long rays, four times those of walks through grids of densities, and twice
    /// those of queries of maps. The places under way end as their quotas say. 0 chooses by the kind of device.
    pub work: u64,
    /// Counts what the stages that trace rays fetch beside the index ([`Walked::fetches`]), by other kernels.
    pub count_fetches: bool,
}

impl Default for WalkOptions {
    fn default() -> Self {
        Self {
            name: "walk",
            shadows: true,
            ray_quota: RAY_QUOTA,
            bounces: 12,
            work: 0,
            count_fetches: false,
        }
    }
}

/// One bounce of a wave.
pub struct Bounce<'a> {
    /// Set 0, with the queues in their roles of this bounce.
    pub wave: WaveSet<'a>,
    /// Arguments of its dispatches.
    pub places: Places<'a>,
    walker: &'a Walker,
    key: WalkKey,
}

/// Follows waves of walks through a scene.
pub struct Walker {
    gpu: Gpu,
    scene: Arc<GpuScene>,
    options: WalkOptions,
    /// Of a submission, at most.
    bounces: u32,
    /// Loop iterations of a ray in one dispatch.
    quota: u32,
    /// Units of work of a submission.
    work_units: u32,
    trace: TracePipelines,
    /// The same for rays that a quota stopped; made when the first one is.
    resume: Option<TracePipelines>,
    compaction: Compaction,
    buffers: WaveBuffers,
    pace: Pace,
    /// The number of the wave that was begun last, whose walks are in the buffers.
    wave: u64,
}

impl Bounce<'_> {
    /// Records the shadow rays that wait: adds what they carry to what their walks have gathered, wherever nothing stands in between.
    ///
    /// # Errors
    /// Those of recording.
    pub fn record_shadow(&self, recorder: &mut Recorder) -> Result<()> {
        self.record_shadow_by(recorder, &self.walker.trace, false)
    }

    fn record_shadow_by(&self, recorder: &mut Recorder, trace: &TracePipelines, goes_on: bool) -> Result<()> {
        let (walker, rays) = (self.walker, self.places.waiting);
        recorder.pass(&walker.pass("shadow"), |pass| {
            trace.record_shadow(pass, &walker.scene, &self.wave, self.key, rays, goes_on)
        })
    }
}

impl Walker {
    /// A walker with its kernels; the first wave compiles them.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for memory that was made without something that the scene or the options need
    /// ([`WaveNeeds`](super::WaveNeeds)), [`Error::MissingFeature`](crate::Error::MissingFeature) for a device with too few descriptors,
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory), and as [`ray_quota`].
    pub fn new(gpu: &Gpu, scene: Arc<GpuScene>, buffers: WaveBuffers, options: WalkOptions) -> Result<Self> {
        buffers.needs().check(scene.profile().media.any(), options.shadows)?;
        let quota = ray_quota(gpu, &scene, options.ray_quota)?;
        let bounces = u32::try_from(options.bounces).unwrap_or(u32::MAX).max(1);
        let work = match (options.work, gpu.caps().kind) {
            (0, DeviceKind::Cpu) => SOFTWARE_WORK,
            (0, _) => DEVICE_WORK,
            (wanted, _) => wanted,
        };
        Ok(Self {
            trace: TracePipelines::new(gpu, &scene, &buffers, quota, &options, false)?,
            resume: None,
            compaction: Compaction::new(gpu, buffers.turnover().is_some())?,
            pace: Pace::new(gpu.caps().kind, bounces),
            gpu: gpu.clone(),
            scene,
            options,
            bounces,
            quota,
            work_units: (work / u64::from(WORK_UNIT)).clamp(1, WORK_UNITS_MAX) as u32,
            buffers,
            wave: NO_WAVE,
        })
    }

    /// Its working memory.
    pub fn buffers(&self) -> &WaveBuffers {
        &self.buffers
    }

    /// The kernels that trace rays, with their specialization.
    pub fn trace_pipelines(&self) -> Vec<PipelineInfo> {
        self.trace.info()
    }

    /// The kernels of the compaction.
    pub fn compaction_pipelines(&self) -> Vec<PipelineInfo> {
        let turnover = self.buffers.turnover().map(Turnover::pipeline);
        self.compaction.info().into_iter().chain(turnover).collect()
    }

    /// Follows `walks` walks, at most as many as there are slots, until all have ended and nothing waits, however many submissions that takes.
    ///
    /// # Errors
    /// As [`Walker::begin`] and [`Walker::advance`].
    pub fn run(&mut self, key: WalkKey, walks: u32, stages: &mut dyn WalkStages) -> Result<Walked> {
        let mut wave = self.begin(key, walks)?;
        while !wave.has_ended() {
            self.advance(&mut wave, stages)?;
        }
        Ok(wave.walked)
    }

    /// A wave of `walks` walks, at most as many as there are slots, before its first submission. A walker has the memory of one: what was under way is given up.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for more walks than slots.
    pub fn begin(&mut self, key: WalkKey, walks: u32) -> Result<WaveInFlight> {
        if walks > self.buffers.slots() {
            let cause = format!("is more than the wave's {} slots", self.buffers.slots());
            return Err(crate::Error::setting("walks", walks, cause));
        }
        let status = Status {
            active_count: walks,
            ..Status::default()
        };
        Ok(self.begin_with(key, status, Next::Start))
    }

    /// A wave that is kept full, without walks yet: [`Walker::refill`] gives it some. Of `key` the seed alone counts. What was under way is given up.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for memory without a [`Turnover`] and numbers, [`Error::DeviceLost`](crate::Error::DeviceLost),
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn begin_full(&mut self, key: WalkKey) -> Result<WaveInFlight> {
        let Some(turnover) = self.buffers.turnover().filter(|_| self.buffers.is_numbered()) else {
            let cause = "needs memory for a wave that is kept full: a turnover, and numbers of its walks";
            return Err(crate::Error::setting("wave", "full", cause));
        };
        turnover.free_all()?;
        let status = Status {
            rounds: REFILLED_ROUNDS,
            ..Status::default()
        };
        Ok(self.begin_with(key, status, Next::End))
    }

    fn begin_with(&mut self, key: WalkKey, status: Status, next: Next) -> WaveInFlight {
        self.pace.begin();
        self.wave = NEXT_WAVE.fetch_add(1, Ordering::Relaxed);
        WaveInFlight {
            number: self.wave,
            key,
            status,
            next,
            begins: 0,
            resumes: false,
            stopped: 0,
            watch: StallWatch::new(self.quota),
            walked: Walked::default(),
        }
    }

    /// Lets the next submission of a wave that is kept full begin so many walks more. A submission that fails has lost them, and the wave with them.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for more walks than slots are free, within a bounce ([`WaveInFlight::is_between_bounces`]), and for memory that no
    /// wave can be kept full in.
    pub fn refill(&self, wave: &mut WaveInFlight, walks: u32) -> Result<()> {
        let free = self.buffers.slots() - wave.status.active_count;
        let refuse = |cause: String| Err(crate::Error::setting("walks", walks, cause));
        if self.buffers.turnover().is_none() {
            return refuse("needs a wave that was begun by begin_full".into());
        }
        if !wave.is_between_bounces() {
            return refuse("may be asked for between two bounces alone".into());
        }
        if walks > free {
            return refuse(format!("is more than the {free} free slots"));
        }
        if walks > 0 {
            wave.begins += walks;
            wave.status.active_count += walks;
            wave.next = Next::Bounce;
        }
        Ok(())
    }

    /// One submission towards the end of a wave, the last one that was begun: a bounded piece of work, whatever the scene. The stages are those of the whole wave.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for a wave of another walker, or one that was given up; [`Error::DeviceLost`](crate::Error::DeviceLost),
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory), [`Error::Overflow`](crate::Error::Overflow) should the index have rays that never end, and those of the
    /// stages. What failed for another reason than a lost device can be begun again.
    pub fn advance(&mut self, wave: &mut WaveInFlight, stages: &mut dyn WalkStages) -> Result<()> {
        if wave.number != self.wave {
            let cause = "is not the one that this walker has begun last; begin it again";
            return Err(crate::Error::setting("wave", wave.number, cause));
        }
        let from = wave.next;
        wave.next = match from {
            Next::End => return Ok(()),
            Next::Stopped(part) => match self.submit_stopped(wave, stages, part)? {
                Some(part) => Next::Stopped(part),
                None => {
                    wave.stopped = 0;
                    Next::Scatter
                }
            },
            _ => {
                let rounds = wave.status.rounds;
                self.submit(wave, stages)?;
                wave.begins = 0;
                let (stops, postpones) = (wave.status.unfinished > 0, wave.status.unstarted > 0);
                wave.walked.stalls += u64::from(stops);
                wave.walked.postponed += u64::from(postpones);
                // A submission that leaves places for later says nothing of how long rays are.
                if !postpones {
                    let goes_on = matches!(from, Next::Hits | Next::Shadows);
                    wave.watch.submitted(goes_on && stops && wave.status.rounds == rounds)?;
                }
                wave.follow(from)
            }
        };
        wave.walked.submissions += 1;
        Ok(())
    }

    /// The name of a pass of its own.
    fn pass(&self, what: &str) -> String {
        format!("{}: {what}", self.options.name)
    }

    fn bounce(&self, key: WalkKey, parity: usize) -> Bounce<'_> {
        let arguments = |offset| indirect(&self.buffers, offset);
        Bounce {
            wave: self.buffers.set(parity),
            places: Places {
                items: arguments(std::mem::offset_of!(Status, item_groups)),
                chunks: arguments(std::mem::offset_of!(Status, chunk_groups)),
                waiting: arguments(std::mem::offset_of!(Status, waiting_groups)),
                key,
            },
            walker: self,
            key,
        }
    }

    /// Submits a part of what an arrival stage lacks at the places that it has stopped at; the part to go on with.
    fn submit_stopped(&self, wave: &mut WaveInFlight, stages: &dyn WalkStages, part: u64) -> Result<Option<u64>> {
        let Some(arrival) = stages.arrival() else {
            return Ok(None);
        };
        let set = self.buffers.set(wave.status.rounds as usize % 2);
        let stopped = StoppedPlaces {
            places: wave.status.active_count,
            stopped: wave.stopped,
            key: wave.key,
        };
        if part == 0 {
            arrival.prepare_stopped()?;
        }
        let mut recorder = self.gpu.recorder(&format!("{} arrivals", self.options.name))?;
        let next = arrival.record_stopped(&mut recorder, &set, stopped, part)?;
        wave.walked.timings.push(recorder.submit()?.wait()?);
        Ok(next)
    }

    /// Submits some bounces of a wave, the first ones with its start, and reads how far they came.
    fn submit(&mut self, wave: &mut WaveInFlight, stages: &mut dyn WalkStages) -> Result<()> {
        let resumes = wave.resumes && matches!(wave.next, Next::Hits | Next::Shadows);
        if resumes && self.resume.is_none() {
            self.resume = Some(TracePipelines::new(
                &self.gpu,
                &self.scene,
                &self.buffers,
                self.quota,
                &self.options,
                true,
            )?);
        }
        let trace = self.resume.as_ref().filter(|_| resumes).unwrap_or(&self.trace);
        let mut recorder = self.gpu.recorder(&format!("{} wave", self.options.name))?;
        stages.record_before(&mut recorder, &self.buffers)?;
        self.record_begin(&mut recorder, wave, stages)?;
        self.record_bounces(&mut recorder, wave, trace, stages)?;
        self.record_read_back(&mut recorder, stages)?;
        let clock = Instant::now();
        let submission = recorder.submit()?;
        stages.submitted();
        let timings = submission.wait()?;
        let seconds = timings
            .untimed
            .map_or(timings.seconds(), |_| clock.elapsed().as_secs_f64());
        let rays_before = wide_counter(wave.status.rays);
        wave.status = self.buffers.readback.read::<Status>(0, 1)?[0];
        let walked = &mut wave.walked;
        walked.timings.push(timings);
        walked.rays = wide_counter(wave.status.rays);
        walked.waited = wide_counter(wave.status.waited);
        walked.fetches = Fetches::of(&wave.status);
        let units = i64::from(self.work_units) - i64::from(wave.status.work_left);
        walked.work += units.unsigned_abs() * u64::from(WORK_UNIT);
        if let Some(media) = &self.buffers.media {
            walked.media = media.counts()?;
        }
        self.pace.submitted(seconds, walked.rays - rays_before);
        Ok(())
    }

    /// Records the status that a submission begins with, and where walks start.
    fn record_begin(&self, recorder: &mut Recorder, wave: &WaveInFlight, stages: &dyn WalkStages) -> Result<()> {
        let (starts, is_first) = (wave.next == Next::Start, wave.walked.submissions == 0);
        let mut status = wave.status;
        // A stalled round leaves no groups to dispatch.
        let groups = group_counts(status.active_count);
        (status.item_groups, status.chunk_groups, status.scatter_groups) = (groups[0], groups[1], groups[1]);
        status.waiting_groups = group_counts(status.waiting_count)[0];
        (status.stalled, status.unfinished, status.unstarted) = (STALLED_NOT, 0, 0);
        status.work_left = self.work_units as i32;
        recorder.pass(&self.pass("begin"), |pass| {
            pass.update(self.buffers.status.view(), &[status])?;
            if is_first {
                if let Some(media) = &self.buffers.media {
                    media.reset(pass)?;
                }
                stages.reset(pass)?;
                stages.arrival().map_or(Ok(()), |arrival| arrival.reset(pass))?;
            }
            pass.memory_barrier(
                Access::TRANSFER_WRITE | Access::COMPUTE,
                Access::COMPUTE | Access::INDIRECT_READ,
            );
            Ok(())
        })?;
        if starts {
            // Its output is the input of the first bounce, whose parity is 0.
            stages.record_start(recorder, &self.buffers.set(1))?;
        }
        if wave.begins > 0 {
            let refill = Refill {
                place: wave.status.active_count - wave.begins,
                count: wave.begins,
                round: wave.status.rounds,
            };
            let set = self.buffers.set(1 - wave.status.rounds as usize % 2);
            stages.record_refill(recorder, &self.buffers, &set, refill)?;
        }
        Ok(())
    }

    /// Records the bounces of a submission, the first one from where the last submission left it.
    fn record_bounces(
        &self,
        recorder: &mut Recorder,
        wave: &WaveInFlight,
        trace: &TracePipelines,
        stages: &dyn WalkStages,
    ) -> Result<()> {
        let WaveInFlight { next: from, key, .. } = *wave;
        let rounds = wave.status.rounds;
        if from == Next::Shadows {
            let bounce = self.bounce(key, rounds as usize % 2);
            bounce.record_shadow_by(recorder, trace, true)?;
        }
        // Places at which the arrival stage was stopped come before scattering.
        let arrival_alone = from == Next::Arrival && wave.stopped > 0;
        let bounces = if arrival_alone {
            1
        } else {
            let bounces = self.bounces_of(wave.status.active_count);
            if wave.begins > 0 {
                bounces.min(REFILLED_BOUNCES)
            } else {
                bounces
            }
        };
        for index in 0..bounces {
            let bounce = self.bounce(key, (rounds + index) as usize % 2);
            let first = if index == 0 { from } else { Next::Bounce };
            let (arrival, goes_on) = (stages.arrival(), first == Next::Hits);
            let finds_hits = arrival.is_some_and(|stage| stage.finds_hits());
            let fused = arrival.filter(|_| finds_hits && first.has_hits() && !goes_on);
            if let Some(fused) = fused {
                fused.record_with_hits(recorder, &bounce.wave, bounce.places)?;
            } else {
                if first.has_hits() {
                    let (trace, state) = match (goes_on, finds_hits) {
                        (false, _) => (&self.trace, GOES_ON_NOT),
                        (true, false) => (trace, GOES_ON_RAYS),
                        (true, true) => (trace, GOES_ON_FURTHER),
                    };
                    self.record_hits(recorder, &bounce, trace, state)?;
                }
                if let Some(arrival) = arrival.filter(|_| first.has_arrival()) {
                    arrival.record(recorder, &bounce.wave, bounce.places)?;
                }
            }
            if !arrival_alone {
                stages.record_scatter(recorder, &bounce)?;
                recorder.pass(&self.pass("compact"), |pass| {
                    self.compaction.record(pass, &self.buffers, &bounce.wave, bounce.places)
                })?;
                stages.record_waiting(recorder, &bounce)?;
            }
        }
        Ok(())
    }

    /// Records the copies that the host reads after a submission.
    fn record_read_back(&self, recorder: &mut Recorder, stages: &dyn WalkStages) -> Result<()> {
        recorder.pass(&self.pass("read status"), |pass| {
            pass.memory_barrier(Access::COMPUTE, Access::TRANSFER_READ);
            pass.copy(
                self.buffers.status.slice(0, size_of::<Status>() as u64),
                self.buffers.readback.view(),
            )?;
            if let Some(media) = &self.buffers.media {
                pass.copy(media.counters.view(), media.readback.view())?;
            }
            stages.arrival().map_or(Ok(()), |arrival| arrival.read_back(pass))?;
            stages.read_back(pass)
        })
    }

    /// Bounces of a submission that begins with so many walks.
    fn bounces_of(&self, walks: u32) -> u32 {
        let unwatched = (SOFTWARE_RAYS / walks.max(1)).clamp(1, self.bounces);
        self.pace.units(walks, unwatched)
    }

    /// The closest hits of a bounce; `goes_on` is one of the kernel's `GOES_ON_*`.
    fn record_hits(
        &self,
        recorder: &mut Recorder,
        bounce: &Bounce<'_>,
        trace: &TracePipelines,
        goes_on: u32,
    ) -> Result<()> {
        recorder.pass(&self.pass("extend"), |pass| {
            let items = bounce.places.items;
            trace.record_extend(pass, &self.scene, &bounce.wave, bounce.key, items, goes_on)
        })
    }
}
