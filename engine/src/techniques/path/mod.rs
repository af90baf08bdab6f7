//! The reference path tracer: unidirectional, with next-event estimation and multiple importance sampling, in wavefront stages.
//!
//! Sources: BG-2 and BG-3; Kajiya, "The Rendering Equation" (SIGGRAPH 1986); Veach, "Robust Monte Carlo Methods for Light Transport
//! Simulation" (1997), chapters 9 and 10; wavefront form after Laine, Karras and Aila, "Megakernels Considered Harmful" (HPG 2013).
//!
//! Participating media (BG-4, PM-F-3), only where a scene has some: analytic free flight in homogeneous media, delta and ratio tracking through
//! density grids, one walk for all bands; the shaders `transport/path_medium.comp` and `transport/media_tracking.glsl` name the sources. Bodies
//! may lie in bodies as long as their surfaces neither cross nor coincide; the camera may be in any of them, where its position counts for
//! the whole lens and for all of an orthographic picture. Nothing from infinity is seen through an endless medium that extinguishes it.
//!
//! Unbiased: paths end by Russian roulette or by the [`PathSet`](crate::transport::PathSet) alone. Deterministic: a pixel's sum depends on (seed, pixel, sample
//! numbers) only, never on wave size, queue order or threads. Nothing is lost in silence: rays that an iteration quota stops go on in a
//! later dispatch, and samples that are not finite are counted and left out.

pub(super) mod card;
pub(crate) mod pipelines;
mod record;
mod settings;
pub(crate) mod stages;
pub(crate) mod wave;

use std::sync::Arc;
use std::time::Instant;

use self::pipelines::{Pipelines, TracePipelines, camera_pipeline, ray_quota};
pub use self::settings::PathTracerSettings;
use self::stages::StallWatch;
use self::wave::{
    Cursor, MediumCounters, Status, Wave, WaveBuffers, WaveNeeds, default_slots, group_counts, slots_of_device,
    slots_of_picture,
};
use crate::Result;
use crate::accel::trace::wide_counter;
use crate::card::{Bias, Role, Row, sources};
use crate::film::picture::{NonFiniteSamples, Picture};
use crate::film::{GpuFilm, PixelFormat, Step};
use crate::gpu::shaders::constants::{PATH_GROUP, STALLED_ARRIVAL, STALLED_EXTEND, STALLED_NOT, STALLED_SHADOW};
use crate::gpu::shaders::sets::PathBuffers;
use crate::gpu::{Access, Buffer, BufferView, DeviceKind, Gpu, PipelineInfo, Recorder, Timings};
use crate::scene::Camera;
use crate::scene::camera_frame::CameraFrame;
use crate::settings::TypedSettings;
use crate::transport::GpuScene;
use glam::DVec3;

/// Bounces recorded into one command buffer, at most; a wave that needs more is submitted again.
const BOUNCES_PER_SUBMISSION: usize = 12;
/// Device time that a submission may take where a driver watches: they end what runs for some seconds.
const SUBMISSION_SECONDS: f64 = 0.25;

/// Exact counts of what the device did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct PathCounters {
    /// Paths begun.
    pub paths: u64,
    /// Closest-hit rays.
    pub extend_rays: u64,
    /// Shadow rays.
    pub shadow_rays: u64,
    /// Waves rendered.
    pub waves: u64,
    /// Collisions with media that scattered or absorbed.
    pub medium_collisions: u64,
    /// Tentative collisions of free flights through density grids that were none.
    pub null_collisions: u64,
    /// Densities looked up in grids, by free flights and by shadow rays.
    pub density_lookups: u64,
    /// Submissions that ended with rays stopped by the quota, which then went on.
    pub stalls: u64,
}

/// What a technique gathers where the rays of a bounce have arrived, before the surfaces there are shaded.
pub(crate) trait ArrivalStage {
    /// Records it for all places of the queue. Places that its quota stops stall the wave with `STALLED_ARRIVAL`.
    fn record(&self, recorder: &mut Recorder, paths: &PathBuffers<'_>, places: Places<'_>) -> Result<()>;

    /// Records what the places that it has stopped at still lack, from a part on, as much of it as a watchdog has time for; the part to go
    /// on with, in a submission of its own.
    fn record_stopped(
        &self,
        recorder: &mut Recorder,
        paths: &PathBuffers<'_>,
        stopped: StoppedPlaces,
        part: u64,
    ) -> Result<Option<u64>>;
}

/// The places of a wave's queue: indirect arguments of dispatches over them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Places<'a> {
    /// One invocation a place.
    pub items: BufferView<'a>,
    /// One invocation for each [`COMPACT_CHUNK`](crate::gpu::shaders::constants::COMPACT_CHUNK) places.
    pub chunks: BufferView<'a>,
}

/// How many places an arrival stage has stopped at.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StoppedPlaces {
    /// Of so many places in the queue.
    pub places: u32,
    pub stopped: u32,
}

/// A progressive rendering of one view.
pub struct PathTracer {
    gpu: Gpu,
    scene: Arc<GpuScene>,
    settings: PathTracerSettings,
    frame: CameraFrame,
    /// Where the camera is, for the medium around it.
    eye: DVec3,
    pipelines: Pipelines,
    buffers: WaveBuffers,
    film: GpuFilm,
    slots: u32,
    /// Device time of a path's bounce in the last submission.
    seconds_a_ray: Option<f64>,
    /// Device time of submissions whose rays are not counted yet.
    uncounted_seconds: f64,
    pending: Option<Wave>,
    cursor: Cursor,
    counters: PathCounters,
}

impl PathTracer {
    /// Prepares a rendering of `size` pixels.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for a setting or size out of range, [`Error::OutOfMemory`](crate::Error::OutOfMemory), [`Error::MissingFeature`](crate::Error::MissingFeature).
    pub fn new(
        gpu: &Gpu,
        scene: Arc<GpuScene>,
        camera: &Camera,
        size: [u32; 2],
        settings: PathTracerSettings,
    ) -> Result<Self> {
        settings.check()?;
        let film = GpuFilm::new(gpu, size, settings.aovs)?;
        let slots = match settings.paths_in_flight {
            0 => default_slots(gpu),
            wanted => wanted.next_multiple_of(PATH_GROUP),
        };
        let slots = slots.min(slots_of_device(gpu)).min(slots_of_picture(size));
        let frame = CameraFrame::new(camera, size)?;
        let pipelines = Pipelines::new(gpu, &scene, &settings, &frame, camera)?;
        let needs = WaveNeeds {
            lights: scene.has_lights(),
            media: scene.profile().media.any(),
            airlight: settings.equiangular && scene.has_punctual_lights(),
        };
        let (buffers, slots) = WaveBuffers::within_memory(gpu, slots, needs, &film)?;
        Ok(Self {
            gpu: gpu.clone(),
            scene,
            settings,
            frame,
            eye: camera.transform.translation,
            pipelines,
            buffers,
            film,
            slots,
            seconds_a_ray: None,
            uncounted_seconds: 0.0,
            pending: None,
            cursor: Cursor::default(),
            counters: PathCounters::default(),
        })
    }

    /// Forgets everything gathered so far and looks through another camera.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for a camera that cannot be used, [`Error::DeviceLost`](crate::Error::DeviceLost).
    pub fn set_camera(&mut self, camera: &Camera) -> Result<()> {
        let frame = CameraFrame::new(camera, self.film.size())?;
        let pipeline = camera_pipeline(&self.gpu, &self.settings, &frame, camera)?;
        // First what can fail: views must not mix.
        self.film.clear()?;
        self.pipelines.camera = pipeline;
        self.frame = frame;
        self.eye = camera.transform.translation;
        self.pending = None;
        self.cursor = Cursor::default();
        Ok(())
    }

    /// Forgets everything gathered so far and goes on with another seed: an independent picture of the same view, with the kernels there are.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost), [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn restart(&mut self, seed: u32) -> Result<()> {
        self.film.clear()?;
        self.settings.seed = seed;
        self.pending = None;
        self.cursor = Cursor::default();
        Ok(())
    }

    /// Renders one more wave towards `samples` samples a pixel; `None` when all are there. The first wave also compiles the kernels.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost), [`Error::OutOfMemory`](crate::Error::OutOfMemory), [`Error::Overflow`](crate::Error::Overflow) should the index have rays that never end.
    pub fn step(&mut self, samples: u32) -> Result<Option<Step>> {
        self.step_with(samples, None)
    }

    /// As [`PathTracer::step`], with a stage of a technique's own in each bounce.
    pub(crate) fn step_with(&mut self, samples: u32, arrival: Option<&dyn ArrivalStage>) -> Result<Option<Step>> {
        let [width, height] = self.film.size();
        let wanted = u64::from(samples) * u64::from(width) * u64::from(height);
        let Some((wave, next)) = self.cursor.next_wave(&self.film, self.slots, samples) else {
            return Ok(None);
        };
        // A wave that fails is rendered again by the next step.
        let timings = self.run(&wave, arrival)?;
        self.cursor = next;
        Ok(Some(Step {
            timings,
            done: self.cursor.done.min(wanted),
            wanted,
        }))
    }

    /// Renders until every pixel has `samples` samples.
    ///
    /// # Errors
    /// As [`PathTracer::step`].
    pub fn render(&mut self, samples: u32) -> Result<()> {
        while self.step(samples)?.is_some() {}
        Ok(())
    }

    /// Exact counts since the tracer was made.
    pub fn counters(&self) -> PathCounters {
        self.counters
    }

    /// Paths under way together, at most.
    pub(crate) fn slots(&self) -> u32 {
        self.slots
    }

    /// Samples that every pixel has got.
    pub(crate) fn samples_done(&self) -> u32 {
        self.cursor.sample
    }

    /// The settings.
    pub fn settings(&self) -> &PathTracerSettings {
        &self.settings
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.film.size()
    }

    /// The kernels with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        self.pipelines.info()
    }

    /// Reads the picture: layers `radiance`, `variance` (of the mean), `samples`, and the AOVs that were asked for; with the number of
    /// samples that were left out because they were not finite.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost), [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn picture(&mut self) -> Result<(Picture, NonFiniteSamples)> {
        self.flush()?;
        self.film.picture()
    }

    /// Writes what there is so far to a buffer of four bytes a pixel, rows from the top, on the device: exposed by `exposure` stops, clipped
    /// and sRGB-encoded.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) when the buffer is too small, [`Error::DeviceLost`](crate::Error::DeviceLost).
    pub fn display(&mut self, target: &Buffer, exposure: f32, format: PixelFormat) -> Result<()> {
        self.flush()?;
        self.film.display(target, exposure, format)
    }

    /// Renders a wave, in as many submissions as it takes.
    fn run(&mut self, wave: &Wave, arrival: Option<&dyn ArrivalStage>) -> Result<Vec<Timings>> {
        let paths = wave.pixels * wave.samples;
        let mut status = Status {
            active_count: paths,
            ..Status::default()
        };
        let mut timings = vec![self.submit_bounces(wave, &mut status, true, arrival)?];
        let mut watch = StallWatch::new(ray_quota(&self.gpu, &self.scene, &self.settings)?);
        while status.active_count > 0 || status.stalled != STALLED_NOT {
            let (rounds, stalled) = (status.rounds, status.stalled != STALLED_NOT);
            self.counters.stalls += u64::from(stalled);
            if let Some(arrival) = arrival.filter(|_| status.stalled == STALLED_ARRIVAL) {
                self.submit_stopped(&status, arrival, &mut timings)?;
            }
            timings.push(self.submit_bounces(wave, &mut status, false, arrival)?);
            let stands = stalled && status.stalled != STALLED_NOT && status.rounds == rounds;
            watch.submitted(stands)?;
        }
        self.counters.paths += u64::from(paths);
        self.counters.extend_rays += wide_counter(status.extend_rays);
        self.counters.shadow_rays += wide_counter(status.shadow_rays);
        if let Some(media) = &self.buffers.media {
            let counts = media.readback.read::<MediumCounters>(0, 1)?[0];
            self.counters.medium_collisions += wide_counter(counts.collisions);
            self.counters.null_collisions += wide_counter(counts.null_collisions);
            self.counters.density_lookups += wide_counter(counts.density_lookups);
            // A place's two rays are counted as one before.
            self.counters.shadow_rays += wide_counter(counts.second_rays);
        }
        self.counters.waves += 1;
        self.pending = Some(*wave);
        Ok(timings)
    }

    /// Submits what an arrival stage lacks at the places that it has stopped at.
    fn submit_stopped(&self, status: &Status, arrival: &dyn ArrivalStage, timings: &mut Vec<Timings>) -> Result<()> {
        let paths = self.buffers.set(status.rounds as usize % 2);
        let stopped = StoppedPlaces {
            places: status.active_count,
            stopped: status.unfinished,
        };
        let mut part = Some(0);
        while let Some(first) = part {
            let mut recorder = self.gpu.recorder("path arrivals")?;
            part = arrival.record_stopped(&mut recorder, &paths, stopped, first)?;
            timings.push(recorder.submit()?.wait()?);
        }
        Ok(())
    }

    /// Submits some bounces of a wave, the first ones with its camera rays and the last wave's way to the film, and reads how far they came.
    fn submit_bounces(
        &mut self,
        wave: &Wave,
        status: &mut Status,
        first: bool,
        arrival: Option<&dyn ArrivalStage>,
    ) -> Result<Timings> {
        let stalled = status.stalled;
        let rays_stalled = stalled == STALLED_EXTEND || stalled == STALLED_SHADOW;
        if first {
            self.uncounted_seconds = 0.0;
        }
        if rays_stalled && self.pipelines.resume.is_none() {
            self.pipelines.resume = Some(TracePipelines::new(&self.gpu, &self.scene, &self.settings, true)?);
        }
        let resume = self.pipelines.resume.as_ref().filter(|_| rays_stalled);
        let mut recorder = self.gpu.recorder("path wave")?;
        if let Some(pending) = &self.pending {
            self.record_resolve(&mut recorder, pending)?;
        }
        // A stalled round leaves no groups to dispatch.
        let groups = group_counts(status.active_count);
        (status.item_groups, status.chunk_groups, status.scatter_groups) = (groups[0], groups[1], groups[1]);
        status.shadow_groups = group_counts(status.shadow_count)[0];
        (status.stalled, status.unfinished) = (STALLED_NOT, 0);
        recorder.pass("path: begin", |pass| {
            pass.update(self.buffers.status.view(), &[*status])?;
            if let Some(media) = self.buffers.media.as_ref().filter(|_| first) {
                pass.update(media.counters.view(), &[MediumCounters::default()])?;
            }
            pass.memory_barrier(
                Access::TRANSFER_WRITE | Access::COMPUTE,
                Access::COMPUTE | Access::INDIRECT_READ,
            );
            Ok(())
        })?;
        if first {
            self.record_camera(&mut recorder, wave)?;
        }
        if let Some(resume) = resume.filter(|_| stalled == STALLED_SHADOW) {
            self.record_shadow(&mut recorder, wave, status.rounds as usize % 2, resume)?;
        }
        for bounce in 0..self.bounces_for(status.active_count) {
            let resumed = resume.filter(|_| stalled == STALLED_EXTEND && bounce == 0);
            let trace = resumed.unwrap_or(&self.pipelines.trace);
            let parity = (status.rounds as usize + bounce) % 2;
            if stalled == STALLED_ARRIVAL && bounce == 0 {
                // The stage has gone on already.
                self.record_arrivals(&mut recorder, wave, parity, None)?;
            } else {
                self.record_bounce(&mut recorder, wave, parity, trace, arrival)?;
            }
        }
        recorder.pass("path: read status", |pass| {
            pass.memory_barrier(Access::COMPUTE, Access::TRANSFER_READ);
            pass.copy(
                self.buffers.status.slice(0, size_of::<Status>() as u64),
                self.buffers.readback.view(),
            )?;
            match &self.buffers.media {
                Some(media) => pass.copy(media.counters.view(), media.readback.view()),
                None => Ok(()),
            }
        })?;
        let clock = Instant::now();
        let submission = recorder.submit()?;
        // Once submitted, the last wave reaches the film, whatever becomes of the wait.
        self.pending = None;
        let timings = submission.wait()?;
        let seconds = timings
            .untimed
            .map_or(timings.seconds(), |_| clock.elapsed().as_secs_f64());
        let rays_before = wide_counter(status.extend_rays);
        *status = self.buffers.readback.read::<Status>(0, 1)?[0];
        let rays = wide_counter(status.extend_rays) - rays_before;
        // A stalled submission counts its rays when they have gone on to their end.
        self.uncounted_seconds += seconds;
        if rays > 0 {
            self.seconds_a_ray = Some(std::mem::take(&mut self.uncounted_seconds) / rays as f64);
        }
        Ok(timings)
    }

    /// Bounces of the next submission: as many as a watchdog has time for if no path ends, by the pace of the last one.
    fn bounces_for(&self, paths: u32) -> usize {
        // Software drivers end nothing, and there the passes are the same on every run.
        if self.gpu.caps().kind == DeviceKind::Cpu {
            return BOUNCES_PER_SUBMISSION;
        }
        let Some(seconds_a_ray) = self.seconds_a_ray else {
            return 1;
        };
        let bounces = SUBMISSION_SECONDS / (seconds_a_ray * f64::from(paths.max(1)));
        (bounces as usize).clamp(1, BOUNCES_PER_SUBMISSION)
    }

    /// Adds the last wave to the film.
    fn flush(&mut self) -> Result<()> {
        let Some(wave) = &self.pending else { return Ok(()) };
        let mut recorder = self.gpu.recorder("path film")?;
        self.record_resolve(&mut recorder, wave)?;
        let submission = recorder.submit()?;
        self.pending = None;
        submission.wait()?;
        Ok(())
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "MET-B8",
        name: "path estimation: light sampling, BRDF sampling, Russian roulette",
        role: Role::PartOf("BG-3"),
        limits: "Paths begin at the eye alone: caustics of small lights are noise, and those of points are not found.",
        sources: &[
            sources::KAJIYA_1986.whole(),
            sources::VEACH_1997.at("chapters 9 and 10"),
        ],
        shaders: &["shaders/transport/path_shade.comp"],
        bias: Some(Bias::Unbiased),
        tests: &[
            "engine/src/transport/lights.rs::heuristics_sum_to_one",
            "tests/tests/path_tracer.rs::lights_are_chosen_in_the_end_as_often_as_their_weights_say",
            "tests/tests/path_tracer.rs::closed_furnaces_have_the_radiance_of_the_geometric_series",
            "tests/tests/path_tracer.rs::the_variance_layer_is_the_variance_of_the_means",
            "tests/tests/path_tracer.rs::sobol_draws_have_the_same_expectation_and_less_variance_between_seeds",
        ],
        experiment: "clerestory report roulette",
        ..Row::of(file!())
    },
    Row {
        id: "CL-ALPHA",
        name: "alpha: masks, and blending by chance",
        role: Role::PartOf("BG-3"),
        limits: "Blending by chance costs noise.",
        sources: &[sources::ENDERTON_2010.whole()],
        shaders: &[
            "shaders/transport/path_extend_alpha.comp",
            "shaders/transport/path_shadow_alpha.comp",
        ],
        bias: Some(Bias::Unbiased),
        tests: &[
            "tests/tests/alpha.rs::masks_are_all_or_nothing",
            "tests/tests/alpha.rs::blended_walls_thin_out_the_light_behind_them",
            "tests/tests/alpha.rs::blended_surfaces_scatter_in_proportion_to_alpha",
            "tests/tests/alpha.rs::textures_and_vertex_colours_carry_alpha",
        ],
        experiment: "clerestory report alpha",
        ..Row::of(file!())
    },
    Row {
        id: "CL-ABSORPTION",
        name: "absorption inside of solids",
        role: Role::PartOf("BG-3"),
        limits: "Solids of one absorption whose surfaces neither cross nor coincide.",
        sources: &[sources::KHRONOS_MATERIALS_VOLUME.at("law of Beer and Lambert")],
        shaders: &["shaders/transport/path_shade.comp"],
        tests: &["tests/tests/path_tracer.rs::light_inside_an_absorbing_body_is_absorbed_on_all_of_its_way"],
        experiment: "clerestory report absorption",
        ..Row::of(file!())
    },
];
