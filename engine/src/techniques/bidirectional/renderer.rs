//! A progressive rendering by bidirectional path tracing: pass after pass, light subpaths of their own for each, and some eye paths a pixel, joined to them.
//!
//! Sources: E. Lafortune, Y. Willems, "Bi-directional Path Tracing", 1993; E. Veach, "Robust Monte Carlo Methods for Light Transport Simulation", PhD thesis, 1997, chapters 9
//! and 10; I. Georgiev, "Implementing Vertex Connection and Merging", 2012, for the partial weights; T. Davidovič, J. Křivánek, M. Hašan, P. Slusallek, "Progressive Light
//! Transport Simulation on the GPU", 2014, for the cache of light vertices: an eye vertex is joined to vertices drawn evenly from all that the light subpaths of the pass have left, with
//! their number as weight, which has the expectation of joining it to all vertices of one light subpath. E. Lafortune, Y. Willems, "Rendering Participating Media with Bidirectional Path
//! Tracing", 1996, for vertices at collisions with media, which are joined like those on surfaces, through what media let through.
//!
//! Guarantees: unbiased, since the weights of all ways to make a path sum to one, and each way that a scene leaves out has the weight zero in all others; deterministic in
//! (seed, pass, walk) and (seed, pixel, sample), on any number of threads, since what light subpaths show the camera is summed in integers. What light subpaths show the
//! camera is of other walks for each sample of a pixel; samples of a pass and pixels share the vertices that eye paths are joined to.

use std::sync::Arc;
use std::time::Instant;

use super::card::refusals;
use super::eye::{Cursor, EyeKernels, EyeMemory, EyeParts, EyeStages, EyeWave, record_resolve};
use super::kernels::Viewpoint;
use super::light_paths::LightPaths;
use super::settings::BidirectionalSettings;
use crate::film::picture::{NonFiniteSamples, Picture};
use crate::film::{GpuFilm, PixelFormat, Step};
use crate::gpu::{Buffer, Gpu, PipelineInfo, TexelView, Timings, seconds_or_waited, wide_counter};
use crate::scene::{Camera, SceneProfile};
use crate::settings::TypedSettings;
use crate::techniques::path::SAMPLES_PER_WAVE;
use crate::transport::{GpuScene, PathSet};
use crate::walk::{WalkOptions, Walked, Walker, WaveInFlight};
use crate::{Error, Result};

/// Exact counts since the rendering was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct BidirectionalCounts {
    /// Eye paths begun.
    pub paths: u64,
    /// Closest-hit rays of eye paths.
    pub extend_rays: u64,
    /// Shadow rays to lights, to light subpaths, and from these to the camera.
    pub shadow_rays: u64,
    /// Waves of eye paths.
    pub waves: u64,
    /// Light subpaths.
    pub light_paths: u64,
    /// Closest-hit rays of light subpaths.
    pub light_rays: u64,
    /// Vertices that they have left.
    pub light_vertices: u64,
    /// Those that lie in the picture, whether or not something stands between.
    pub vertices_in_view: u64,
    /// Pairs of an eye vertex and a light vertex.
    pub connections: u64,
    /// Collisions of eye paths and light subpaths with media.
    pub collisions: u64,
    /// Submissions that ended with rays stopped by the quota, which then went on.
    pub stalls: u64,
    /// Submissions that ended with paths left for later.
    pub postponed: u64,
}

/// A progressive rendering of one view by bidirectional path tracing.
pub struct BidirectionalPaths {
    gpu: Gpu,
    scene: Arc<GpuScene>,
    settings: BidirectionalSettings,
    path_set: PathSet,
    kernels: EyeKernels,
    memory: EyeMemory,
    walker: Walker,
    /// [`GpuScene::emission_choice`].
    emission: Option<TexelView>,
    /// None where no light subpath brings anything.
    lights: Option<LightPaths>,
    film: GpuFilm,
    /// Samples of a pass, or of a wave where there are no light subpaths.
    samples_per_pass: u32,
    cursor: Cursor,
    in_flight: Option<InFlight>,
    counts: BidirectionalCounts,
}

/// A wave of eye paths under way, and where the one after it begins.
struct InFlight {
    wave: EyeWave,
    next: Cursor,
    walks: WaveInFlight,
}

impl BidirectionalPaths {
    /// Prepares a rendering of `size` pixels.
    ///
    /// # Errors
    /// [`Error::Setting`] for a setting or size out of range, [`Error::Unsupported`] for light from infinity in endless media, [`Error::LimitExceeded`] for a ray
    /// index whose leaves are too long for a software device, [`Error::OutOfMemory`].
    pub fn new(
        gpu: &Gpu,
        scene: Arc<GpuScene>,
        camera: &Camera,
        size: [u32; 2],
        settings: BidirectionalSettings,
    ) -> Result<Self> {
        settings.check()?;
        let reasons = refusals(scene.profile());
        if !reasons.is_empty() {
            return Err(Error::Unsupported {
                technique: "bdpt".into(),
                reasons,
            });
        }
        let film = GpuFilm::new(gpu, size, settings.aovs)?;
        let settings = settings.resolved()?.within(gpu.caps(), size)?;
        let view = Viewpoint::new(&scene, camera, size)?;
        let has_light_paths = scene.has_lights() && scene.light_power() > 0.0 && settings.has_light_paths();
        let lights = has_light_paths.then(|| LightPaths::new(gpu, &scene, &view, size, &settings));
        let lights = lights.transpose()?;
        let connects = lights.is_some() && settings.joins();
        let pixels = size[0] * size[1];
        let samples_per_pass = match lights {
            Some(_) => settings.pass_of(pixels)[0],
            None => SAMPLES_PER_WAVE,
        };
        let kernels = EyeKernels::new(gpu, &scene, &view, &settings, connects)?;
        // Takes as much memory as is left, if it must.
        let (buffers, memory) = EyeMemory::within(gpu, &scene, pixels.saturating_mul(samples_per_pass), &settings)?;
        let options = WalkOptions {
            name: "bidirectional",
            shadows: scene.has_lights(),
            ray_quota: settings.quota(),
            work: settings.submission_work,
            ..WalkOptions::default()
        };
        Ok(Self {
            gpu: gpu.clone(),
            path_set: settings.path_set,
            walker: Walker::new(gpu, Arc::clone(&scene), buffers, options)?,
            emission: scene.emission_choice(gpu)?,
            scene,
            settings,
            kernels,
            memory,
            lights,
            film,
            samples_per_pass,
            cursor: Cursor::default(),
            in_flight: None,
            counts: BidirectionalCounts::default(),
        })
    }

    /// The settings.
    pub fn settings(&self) -> &BidirectionalSettings {
        &self.settings
    }

    /// The light paths of the picture.
    pub fn path_set(&self) -> PathSet {
        self.path_set
    }

    /// What the scene needs.
    pub fn profile(&self) -> &SceneProfile {
        self.scene.profile()
    }

    /// Whether there are light subpaths.
    pub fn has_light_paths(&self) -> bool {
        self.lights.is_some()
    }

    /// Whether light subpaths meet the camera.
    pub fn meets_the_camera(&self) -> bool {
        self.lights.as_ref().is_some_and(LightPaths::meet_the_camera)
    }

    /// Exact counts since it was made.
    pub fn counts(&self) -> BidirectionalCounts {
        let mut counts = self.counts;
        if let Some(lights) = &self.lights {
            let c = lights.counts();
            counts.light_paths = c.walks;
            counts.light_rays = c.rays;
            counts.light_vertices = c.vertices;
            counts.vertices_in_view = c.in_view;
            counts.shadow_rays += c.shadow_rays;
            counts.collisions += c.collisions;
            counts.stalls += c.stalls;
            counts.postponed += c.postponed;
        }
        counts
    }

    /// The kernels with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.kernels.pipelines();
        all.extend(self.walker.trace_pipelines());
        all.extend(self.walker.compaction_pipelines());
        all.extend(self.lights.iter().flat_map(LightPaths::pipelines));
        all
    }

    /// Looks through another camera and begins anew.
    ///
    /// # Errors
    /// [`Error::Setting`] for a camera that cannot be used, with which nothing changes; [`Error::DeviceLost`].
    pub fn set_camera(&mut self, camera: &Camera) -> Result<()> {
        let view = Viewpoint::new(&self.scene, camera, self.film.size())?;
        let connects = self.lights.is_some() && self.settings.joins();
        let kernels = EyeKernels::new(&self.gpu, &self.scene, &view, &self.settings, connects)?;
        self.film.clear()?;
        if let Some(lights) = &mut self.lights {
            lights.set_camera(&view, &self.settings)?;
        }
        self.kernels = kernels;
        self.begin();
        Ok(())
    }

    /// Forgets everything gathered so far and begins anew with this seed, with the kernels there are.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn restart(&mut self, seed: u32) -> Result<()> {
        self.film.clear()?;
        self.settings.seed = seed;
        if let Some(lights) = &mut self.lights {
            lights.set_seed(seed);
        }
        self.begin();
        Ok(())
    }

    /// Before the first pass.
    fn begin(&mut self) {
        (self.cursor, self.in_flight) = (Cursor::default(), None);
        if let Some(lights) = &mut self.lights {
            lights.begin();
        }
    }

    /// Does a bounded piece of work towards `samples` samples per pixel, whatever the scene: a submission or two of a pass's light subpaths, or of eye paths; `None`
    /// when all samples are there.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`], [`Error::Overflow`] for more vertices of light subpaths than the device can hold, and should the index have
    /// rays that never end.
    pub fn step(&mut self, samples: u32) -> Result<Option<Step>> {
        if self.cursor.sample >= samples && self.in_flight.is_none() {
            return Ok(None);
        }
        if let Some(lights) = &mut self.lights
            && !lights.are_ready()
        {
            let timings = lights.advance(self.cursor.sample / self.samples_per_pass)?;
            return Ok(Some(self.step_so_far(timings, samples)));
        }
        let timings = self.advance(samples)?;
        Ok(Some(self.step_so_far(timings, samples)))
    }

    fn step_so_far(&self, timings: Vec<Timings>, samples: u32) -> Step {
        let [width, height] = self.film.size();
        let wanted = u64::from(samples) * u64::from(width) * u64::from(height);
        Step {
            timings,
            done: self.cursor.done.min(wanted),
            wanted,
        }
    }

    /// One submission of eye paths, and another that brings a wave that has ended to the film.
    fn advance(&mut self, wanted: u32) -> Result<Vec<Timings>> {
        let mut in_flight = match self.in_flight.take() {
            Some(in_flight) => in_flight,
            None => {
                let slots = self.walker.buffers().slots();
                let (wave, next) = self.cursor.next_wave(&self.film, slots, self.samples_per_pass, wanted);
                let walks = self.walker.begin(wave.key(self.settings.seed), wave.paths())?;
                InFlight { wave, next, walks }
            }
        };
        let InFlight { wave, next, walks } = &mut in_flight;
        let parts = EyeParts {
            scene: &self.scene,
            settings: &self.settings,
            kernels: &self.kernels,
            memory: &self.memory,
            emission: self.emission.as_ref(),
            size: self.film.size(),
        };
        let mut stages = EyeStages::new(parts, self.lights.as_ref(), *wave);
        let before = walks.walked().clone();
        let clock = Instant::now();
        self.walker.advance(walks, &mut stages)?;
        let waited = clock.elapsed().as_secs_f64();
        self.counts.note(&before, walks.walked());
        let mut timings = walks.take_timings();
        self.kernels.submitted(seconds_or_waited(&timings, waited));
        if !walks.has_ended() {
            self.in_flight = Some(in_flight);
            return Ok(timings);
        }
        let (wave, next) = (*wave, *next);
        self.counts.paths += u64::from(wave.paths());
        self.counts.waves += 1;
        if self.lights.as_ref().is_some_and(|lights| lights.vertices().1 > 0) && self.settings.joins() {
            let counters = self.memory.counts.read()?;
            self.counts.connections += wide_counter(counters.connections);
            self.counts.shadow_rays += wide_counter(counters.shadow_rays);
        }
        let mut recorder = self.gpu.recorder("bidirectional film")?;
        let buffers = self.walker.buffers();
        let sample_in_pass = wave.first_sample % self.samples_per_pass;
        let lights = self.lights.as_ref().map(|lights| (lights, sample_in_pass));
        record_resolve(
            &mut recorder,
            &self.kernels,
            &self.memory,
            buffers,
            &self.film,
            lights,
            &wave,
        )?;
        let submission = recorder.submit()?;
        let ends_pass = next.sample > self.cursor.sample && next.sample.is_multiple_of(self.samples_per_pass);
        self.cursor = next;
        if let Some(lights) = &mut self.lights
            && ends_pass
        {
            lights.begin();
        }
        timings.push(submission.wait()?);
        Ok(timings)
    }

    /// The picture so far, as [`PathTracer::picture`](crate::techniques::PathTracer::picture) has it.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn picture(&mut self) -> Result<(Picture, NonFiniteSamples)> {
        self.film.picture()
    }

    /// As [`PathTracer::display`](crate::techniques::PathTracer::display).
    ///
    /// # Errors
    /// As there.
    pub fn display(&mut self, target: &Buffer, exposure: f32, format: PixelFormat) -> Result<()> {
        self.film.display(target, exposure, format)
    }
}

impl BidirectionalCounts {
    /// Counts what a wave of eye paths has taken between two submissions.
    fn note(&mut self, before: &Walked, after: &Walked) {
        self.extend_rays += after.rays - before.rays;
        self.shadow_rays += after.waited - before.waited;
        self.collisions += after.media.collisions - before.media.collisions;
        self.stalls += after.stalls - before.stalls;
        self.postponed += after.postponed - before.postponed;
    }
}
