//! The loop that follows a wave of walks to their ends, in as many submissions as it takes.

use std::sync::Arc;
use std::time::Instant;

use super::arrival::{ArrivalStage, Places, StoppedPlaces};
use super::compaction::Compaction;
use super::stall::StallWatch;
use super::trace::{RAY_QUOTA, TracePipelines, ray_quota};
use super::wave::{MediumCounts, Status, WaveBuffers, group_counts, indirect};
use crate::Result;
use crate::gpu::shaders::constants::{STALLED_ARRIVAL, STALLED_EXTEND, STALLED_NOT, STALLED_SHADOW};
use crate::gpu::shaders::sets::WaveSet;
use crate::gpu::shaders::types::WalkKey;
use crate::gpu::{Access, Gpu, Pace, Pass, PipelineInfo, Recorder, Timings, wide_counter};
use crate::transport::GpuScene;

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
    /// second, by what the last submission took, but one at least, of all walks: fewer slots make it shorter.
    pub bounces: usize,
}

impl Default for WalkOptions {
    fn default() -> Self {
        Self {
            name: "walk",
            shadows: true,
            ray_quota: RAY_QUOTA,
            bounces: 12,
        }
    }
}

/// What the owner of walks does with them, stage by stage. Kernels hand on shadow rays and walks by `walk/hand_on.glsl`, which does what scenes with media
/// take besides. The walker records the closest hits before [`record_scatter`](WalkStages::record_scatter)
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

/// One bounce of a wave.
pub struct Bounce<'a> {
    /// Set 0, with the queues in their roles of this bounce.
    pub wave: WaveSet<'a>,
    /// Arguments of its dispatches.
    pub places: Places<'a>,
    walker: &'a Walker,
    key: WalkKey,
}

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
    /// What happened in media.
    pub media: MediumCounts,
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
    trace: TracePipelines,
    /// The same for rays that a quota stopped; made when the first one is.
    resume: Option<TracePipelines>,
    compaction: Compaction,
    buffers: WaveBuffers,
    pace: Pace,
}

impl Bounce<'_> {
    /// Records the shadow rays that wait: adds what they carry to what their walks have gathered, wherever nothing stands in between.
    ///
    /// # Errors
    /// Those of recording.
    pub fn record_shadow(&self, recorder: &mut Recorder) -> Result<()> {
        self.record_shadow_by(recorder, &self.walker.trace)
    }

    fn record_shadow_by(&self, recorder: &mut Recorder, trace: &TracePipelines) -> Result<()> {
        let (walker, rays) = (self.walker, self.places.waiting);
        recorder.pass(&walker.pass("shadow"), |pass| {
            trace.record_shadow(pass, &walker.scene, &self.wave, self.key, rays)
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
        Ok(Self {
            trace: TracePipelines::new(gpu, &scene, quota, options.shadows, false)?,
            resume: None,
            compaction: Compaction::new(gpu)?,
            pace: Pace::new(gpu.caps().kind, bounces),
            gpu: gpu.clone(),
            scene,
            options,
            bounces,
            quota,
            buffers,
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
        self.compaction.info().into()
    }

    /// Follows `walks` walks, at most as many as there are slots, until all have ended and nothing waits.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for more walks than slots, [`Error::DeviceLost`](crate::Error::DeviceLost),
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory), [`Error::Overflow`](crate::Error::Overflow) should the index have rays that never end,
    /// and those of the stages. What failed for another reason than a lost device can be run again.
    pub fn run(&mut self, key: WalkKey, walks: u32, stages: &mut dyn WalkStages) -> Result<Walked> {
        if walks > self.buffers.slots() {
            let cause = format!("is more than the wave's {} slots", self.buffers.slots());
            return Err(crate::Error::setting("walks", walks, cause));
        }
        let mut status = Status {
            active_count: walks,
            ..Status::default()
        };
        let mut walked = Walked::default();
        let mut watch = StallWatch::new(self.quota);
        let mut begins = true;
        self.pace.begin();
        while begins || status.active_count > 0 || status.stalled != STALLED_NOT {
            let (rounds, stalled) = (status.rounds, status.stalled != STALLED_NOT);
            walked.stalls += u64::from(stalled);
            if let Some(arrival) = stages.arrival().filter(|_| status.stalled == STALLED_ARRIVAL) {
                self.submit_stopped(&status, arrival, &mut walked.timings)?;
            }
            walked.timings.push(self.submit(key, &mut status, begins, stages)?);
            begins = false;
            watch.submitted(stalled && status.stalled != STALLED_NOT && status.rounds == rounds)?;
        }
        walked.rays = wide_counter(status.rays);
        walked.waited = wide_counter(status.waited);
        if let Some(media) = &self.buffers.media {
            walked.media = media.counts()?;
        }
        Ok(walked)
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
            },
            walker: self,
            key,
        }
    }

    /// Submits what an arrival stage lacks at the places that it has stopped at.
    fn submit_stopped(&self, status: &Status, arrival: &dyn ArrivalStage, timings: &mut Vec<Timings>) -> Result<()> {
        let wave = self.buffers.set(status.rounds as usize % 2);
        let stopped = StoppedPlaces {
            places: status.active_count,
            stopped: status.unfinished,
        };
        arrival.prepare_stopped()?;
        let mut part = Some(0);
        while let Some(first) = part {
            let mut recorder = self.gpu.recorder(&format!("{} arrivals", self.options.name))?;
            part = arrival.record_stopped(&mut recorder, &wave, stopped, first)?;
            timings.push(recorder.submit()?.wait()?);
        }
        Ok(())
    }

    /// Submits some bounces of a wave, the first ones with its start, and reads how far they came.
    fn submit(
        &mut self,
        key: WalkKey,
        status: &mut Status,
        begins: bool,
        stages: &mut dyn WalkStages,
    ) -> Result<Timings> {
        let stalled = status.stalled;
        let rays_stalled = stalled == STALLED_EXTEND || stalled == STALLED_SHADOW;
        if rays_stalled && self.resume.is_none() {
            let shadows = self.options.shadows;
            self.resume = Some(TracePipelines::new(&self.gpu, &self.scene, self.quota, shadows, true)?);
        }
        let resume = self.resume.as_ref().filter(|_| rays_stalled);
        let mut recorder = self.gpu.recorder(&format!("{} wave", self.options.name))?;
        stages.record_before(&mut recorder, &self.buffers)?;
        // A stalled round leaves no groups to dispatch.
        let groups = group_counts(status.active_count);
        (status.item_groups, status.chunk_groups, status.scatter_groups) = (groups[0], groups[1], groups[1]);
        status.waiting_groups = group_counts(status.waiting_count)[0];
        (status.stalled, status.unfinished) = (STALLED_NOT, 0);
        recorder.pass(&self.pass("begin"), |pass| {
            pass.update(self.buffers.status.view(), &[*status])?;
            if begins {
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
        if begins {
            // Its output is the input of the first bounce, whose parity is 0.
            stages.record_start(&mut recorder, &self.buffers.set(1))?;
        }
        if let Some(resume) = resume.filter(|_| stalled == STALLED_SHADOW) {
            let bounce = self.bounce(key, status.rounds as usize % 2);
            bounce.record_shadow_by(&mut recorder, resume)?;
        }
        for index in 0..self.pace.units(status.active_count, self.bounces) as usize {
            let bounce = self.bounce(key, (status.rounds as usize + index) % 2);
            let resumed = resume.filter(|_| stalled == STALLED_EXTEND && index == 0);
            // An arrival stage that was stopped has gone on already.
            if stalled != STALLED_ARRIVAL || index > 0 {
                self.record_arrival(&mut recorder, &bounce, resumed.unwrap_or(&self.trace), stages)?;
            }
            stages.record_scatter(&mut recorder, &bounce)?;
            recorder.pass(&self.pass("compact"), |pass| {
                self.compaction.record(pass, &self.buffers, &bounce.wave, bounce.places)
            })?;
            stages.record_waiting(&mut recorder, &bounce)?;
        }
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
        })?;
        let clock = Instant::now();
        let submission = recorder.submit()?;
        stages.submitted();
        let timings = submission.wait()?;
        let seconds = timings
            .untimed
            .map_or(timings.seconds(), |_| clock.elapsed().as_secs_f64());
        let rays_before = wide_counter(status.rays);
        *status = self.buffers.readback.read::<Status>(0, 1)?[0];
        self.pace.submitted(seconds, wide_counter(status.rays) - rays_before);
        Ok(timings)
    }

    /// The closest hits of a bounce, and what is gathered there.
    fn record_arrival(
        &self,
        recorder: &mut Recorder,
        bounce: &Bounce<'_>,
        trace: &TracePipelines,
        stages: &dyn WalkStages,
    ) -> Result<()> {
        recorder.pass(&self.pass("extend"), |pass| {
            trace.record_extend(pass, &self.scene, &bounce.wave, bounce.key, bounce.places.items)
        })?;
        match stages.arrival() {
            Some(arrival) => arrival.record(recorder, &bounce.wave, bounce.places),
            None => Ok(()),
        }
    }
}
