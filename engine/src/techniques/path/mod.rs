//! The reference path tracer: unidirectional, with next-event estimation and multiple importance sampling, in wavefront stages.
//!
//! Sources: BG-2 and BG-3; Kajiya, "The Rendering Equation" (SIGGRAPH 1986); Veach, "Robust Monte Carlo Methods for Light Transport
//! Simulation" (1997), chapters 9 and 10; wavefront form after Laine, Karras and Aila, "Megakernels Considered Harmful" (HPG 2013).
//!
//! Participating media (BG-4, PM-F-3), only where a scene has some: analytic free flight in homogeneous media, delta and ratio tracking through
//! density grids, one walk for all bands; the shaders `techniques/path/path_medium.comp` and `transport/media_tracking.glsl` name the sources. Bodies
//! may lie in bodies as long as their surfaces neither cross nor coincide; the camera may be in any of them, where its position counts for
//! the whole lens and for all of an orthographic picture. Nothing from infinity is seen through an endless medium that extinguishes it.
//!
//! Unbiased: paths end only by Russian roulette or by the [`PathSet`](crate::transport::PathSet). Deterministic: a pixel's sum depends on (seed, pixel, sample
//! numbers) only, never on wave size, queue order or threads. Nothing is lost silently: rays that an iteration quota stops go on in a
//! later dispatch, and samples that are not finite are counted and left out.

mod adaptive;
pub(super) mod card;
mod directions;
mod full;
mod in_order;
mod kept;
mod pipelines;
mod record;
mod refill;
mod settings;
mod shared_light;
pub(super) mod unseen;
mod wave;

use std::sync::Arc;

use self::adaptive::AdaptiveSamples;
pub(super) use self::card::CARD;
use self::kept::{KeptBySlot, KeptNeeds};
use self::pipelines::{CameraStage, Pipelines};
use self::record::{EyeStages, ResolveTarget, UnderWay, record_resolve};
use self::refill::{FullWave, ResultMemory, slot_numbers};
pub use self::settings::{Adaptive, LightTreeUse, PathTracerSettings};
use self::shared_light::SharedLight;
pub(crate) use self::shared_light::{PhotonRadii, SharingPhotons};
pub(crate) use self::wave::SAMPLES_PER_WAVE;
use self::wave::{Cursor, Wave, slots_of_picture};
use crate::catalogue::{Bias, Role, Row, sources};
use crate::film::picture::{NonFiniteSamples, Picture};
use crate::film::{GpuFilm, PixelFormat, Step};
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::WALK_GROUP;
use crate::gpu::shaders::types::{FilmAov, FilmPixel};
use crate::gpu::{Buffer, BufferDesc, Category, ComputePipeline, Gpu, PipelineInfo, TexelView, Timings};
use crate::scene::Camera;
use crate::scene::camera_frame::CameraFrame;
use crate::settings::TypedSettings;
use crate::transport::GpuScene;
use crate::transport::edge_bound::EdgeBound;
use crate::walk::{
    ArrivalStage, Fetches, Turnover, WalkOptions, Walked, Walker, WaveBuffers, WaveInFlight, WaveNeeds, default_slots,
    slots_of_device,
};
use crate::{Error, Result};
use glam::DVec3;

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
    /// Submissions that ended with paths left for later, since their work was used up. Where there are some, their number and those of stalls, of submissions
    /// and of their work may differ from run to run.
    pub postponed: u64,
    /// Submissions of waves.
    pub submissions: u64,
    /// Loop iterations of long rays and of walks through density grids, and steps of queries of maps: what bounds a submission.
    pub work: u64,
    /// What stages have fetched, where that is counted ([`PathTracerSettings::count_fetches`]).
    pub fetches: Fetches,
}

impl PathCounters {
    /// Counts what a wave has taken between two submissions.
    fn count(&mut self, before: &Walked, after: &Walked) {
        let since = |count: fn(&Walked) -> u64| count(after) - count(before);
        self.extend_rays += since(|w| w.rays);
        // A place's two rays wait as one.
        self.shadow_rays += since(|w| w.waited + w.media.second_rays);
        self.stalls += since(|w| w.stalls);
        self.postponed += since(|w| w.postponed);
        self.submissions += since(|w| w.submissions);
        self.work += since(|w| w.work);
        self.medium_collisions += since(|w| w.media.collisions);
        self.null_collisions += since(|w| w.media.null_collisions);
        self.density_lookups += since(|w| w.media.density_lookups);
        self.fetches += after.fetches.since(before.fetches);
    }
}

/// Slots where nothing else is asked for: a wave that is kept full has a whole wave's over this, since it has no bounces of few paths.
const WAVES_PER_FULL_WAVE: u32 = 2;

/// A progressive rendering of one view.
pub struct PathTracer {
    gpu: Gpu,
    scene: Arc<GpuScene>,
    settings: PathTracerSettings,
    shared_light: SharedLight,
    frame: CameraFrame,
    /// Where the camera is, for the medium around it.
    eye: DVec3,
    pipelines: Pipelines,
    walker: Walker,
    kept: KeptBySlot,
    /// By which lights are chosen, where there are more than a few.
    light_tree: Option<TexelView>,
    film: GpuFilm,
    /// Where pixels get differing numbers of samples.
    adaptive: Option<AdaptiveSamples>,
    /// The last whole wave, until it has reached the film.
    pending: Option<Wave>,
    /// The wave under way.
    in_flight: Option<InFlight>,
    /// In place of whole waves: one that is kept full.
    full: Option<FullWave>,
    cursor: Cursor,
    counters: PathCounters,
}

/// A wave under way.
struct InFlight {
    wave: Wave,
    /// Where the one after it begins.
    next: Cursor,
    walks: WaveInFlight,
}

impl PathTracer {
    /// Prepares a rendering of `size` pixels.
    ///
    /// # Errors
    /// [`Error::Setting`] for a setting or size out of range, [`Error::OutOfMemory`], [`Error::MissingFeature`].
    pub fn new(
        gpu: &Gpu,
        scene: Arc<GpuScene>,
        camera: &Camera,
        size: [u32; 2],
        settings: PathTracerSettings,
    ) -> Result<Self> {
        Self::beyond(gpu, scene, camera, size, settings, EdgeBound::Unbounded, 0)
    }

    /// As [`PathTracer::new`], for pictures in which an [`ArrivalStage`] brings the light of edges between two scatterings that are no mirrors', up to a bound: paths
    /// have what it leaves out, and with [`EdgeBound::Unbounded`] all that their path set has. The stage has `stage_bytes` of memory by place
    /// ([`PathTracer::stage_memory`]), for as many places as there is memory for both.
    pub(crate) fn beyond(
        gpu: &Gpu,
        scene: Arc<GpuScene>,
        camera: &Camera,
        size: [u32; 2],
        settings: PathTracerSettings,
        edge_bound: EdgeBound,
        stage_bytes: u64,
    ) -> Result<Self> {
        let shared_light = SharedLight {
            edge_bound,
            ..SharedLight::default()
        };
        Self::beside(gpu, scene, camera, size, settings, shared_light, stage_bytes)
    }

    /// As [`PathTracer::new`], for pictures in which these photons of a pass share what paths scatter behind their first scattering in a medium
    /// ([`photon_share`](crate::transport::photon_share)), but its direct light: paths have what these leave; of none all that their path set has. Waves are whole, and an
    /// [`ArrivalStage`] has `stage_bytes` of memory by place as with [`PathTracer::beyond`].
    pub(crate) fn beside_photons(
        gpu: &Gpu,
        scene: Arc<GpuScene>,
        camera: &Camera,
        size: [u32; 2],
        settings: PathTracerSettings,
        sharing: SharingPhotons,
        stage_bytes: u64,
    ) -> Result<Self> {
        let SharingPhotons { photons, have_planes } = sharing;
        debug_assert!(
            photons == 0 || !settings.keeps_waves_full(),
            "paths of whole waves begin together"
        );
        let shared_light = SharedLight {
            photons,
            plane_share: (photons > 0 && have_planes).then_some(1.0),
            ..SharedLight::default()
        };
        Self::beside(gpu, scene, camera, size, settings, shared_light, stage_bytes)
    }

    fn beside(
        gpu: &Gpu,
        scene: Arc<GpuScene>,
        camera: &Camera,
        size: [u32; 2],
        settings: PathTracerSettings,
        shared_light: SharedLight,
        stage_bytes: u64,
    ) -> Result<Self> {
        settings.check()?;
        let film = GpuFilm::new(gpu, size, settings.aovs)?;
        let full_wave = settings.keeps_waves_full();
        let slots = match settings.paths_in_flight {
            0 if full_wave => default_slots(gpu) / WAVES_PER_FULL_WAVE,
            0 => default_slots(gpu),
            wanted => wanted.next_multiple_of(WALK_GROUP),
        };
        let slots = slots.min(slots_of_device(gpu)).min(slots_of_picture(size));
        let frame = CameraFrame::new(camera, size)?;
        let light_tree = if settings.light_tree.is_for(scene.near_light_count()) {
            match scene.light_tree(gpu) {
                // Power chooses among more lights than the tree has room for.
                Err(Error::LimitExceeded { .. }) if settings.light_tree == LightTreeUse::Auto => None,
                tree => tree?,
            }
        } else {
            None
        };
        let pipelines = Pipelines::new(
            gpu,
            &scene,
            &settings,
            light_tree.is_some(),
            shared_light,
            &frame,
            camera,
        )?;
        let has_media = scene.profile().media.any();
        let needs = WaveNeeds {
            waiting: scene.has_lights(),
            media: has_media,
            airlight: settings.equiangular && scene.airlight_helps(),
        };
        // Beside what reading the film takes.
        let band = film.bands().iter().map(|band| u64::from(band.pixels())).max();
        let pixel_bytes = size_of::<FilmPixel>().max(size_of::<FilmAov>()) as u64;
        let reading = BufferDesc::readback("film readback", band.unwrap_or(0) * pixel_bytes);
        let adaptive = settings.adaptive != Adaptive::Off;
        let more = |slots| {
            let has_departures = matches!(shared_light.edge_bound, EdgeBound::Geometry(_));
            let has = KeptNeeds {
                aovs: film.has_aovs(),
                receivers: light_tree.is_some(),
                departures: has_departures,
                even_distances: shared_light.photons > 0,
                flights: shared_light.plane_share.is_some(),
                stage_bytes,
            };
            let kept = KeptBySlot::new(gpu, slots, has)?;
            let adaptive_numbers = || {
                let format = vk::Format::R32G32_UINT;
                gpu.storage_texels("path numbers", Category::Work, format, slots.into())
            };
            let adaptive = adaptive.then(adaptive_numbers).transpose()?;
            let full = || -> Result<_> {
                let results = ResultMemory::new(gpu, slots, film.has_aovs())?;
                Ok((Turnover::new(gpu, slots)?, slot_numbers(gpu, slots)?, results))
            };
            let full = full_wave.then(full).transpose()?;
            gpu.buffer(&reading).map(|_| (kept, adaptive, full))
        };
        let (mut buffers, (kept, numbers, full)) = WaveBuffers::within_memory(gpu, slots, needs, more)?;
        let adaptive = match numbers {
            Some(numbers) => {
                buffers.number_by(numbers.clone());
                Some(AdaptiveSamples::new(gpu, &settings, &film, numbers)?)
            }
            None => None,
        };
        let full = match full {
            Some((turnover, numbers, results)) => {
                buffers.number_by(numbers.clone());
                buffers.refill_by(turnover);
                Some(FullWave::new(gpu, numbers, results, settings.aovs)?)
            }
            None => None,
        };
        let options = WalkOptions {
            name: "path",
            shadows: needs.waiting,
            ray_quota: settings.ray_quota,
            work: settings.submission_work,
            count_fetches: settings.count_fetches,
            ..WalkOptions::default()
        };
        let walker = Walker::new(gpu, Arc::clone(&scene), buffers, options)?;
        Ok(Self {
            gpu: gpu.clone(),
            scene,
            settings,
            shared_light,
            frame,
            eye: camera.transform.translation,
            pipelines,
            walker,
            kept,
            light_tree,
            film,
            adaptive,
            pending: None,
            in_flight: None,
            full,
            cursor: Cursor::default(),
            counters: PathCounters::default(),
        })
    }

    /// Forgets everything gathered so far and looks through another camera.
    ///
    /// # Errors
    /// [`Error::Setting`] for a camera that cannot be used, [`Error::DeviceLost`].
    pub fn set_camera(&mut self, camera: &Camera) -> Result<()> {
        let frame = CameraFrame::new(camera, self.film.size())?;
        let has_media = self.scene.profile().media.any();
        let pipeline = CameraStage::new(&self.gpu, &self.settings, has_media, &frame, camera)?;
        // First what can fail: views must not mix.
        self.film.clear()?;
        self.pipelines.camera = pipeline;
        self.frame = frame;
        self.eye = camera.transform.translation;
        self.begin_anew()
    }

    /// Forgets everything gathered so far and goes on with another seed: an independent picture of the same view, with the kernels there are.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn restart(&mut self, seed: u32) -> Result<()> {
        self.film.clear()?;
        self.settings.seed = seed;
        self.begin_anew()
    }

    /// Forgets which samples are there, the film being clear, and sees where lights have moved to.
    fn begin_anew(&mut self) -> Result<()> {
        (self.pending, self.in_flight) = (None, None);
        self.cursor = Cursor::default();
        if let Some(full) = &mut self.full {
            full.clear();
        }
        if let Some(adaptive) = &mut self.adaptive {
            adaptive.restart(&self.film);
        }
        if self.light_tree.is_some() {
            self.light_tree = self.scene.light_tree(&self.gpu)?;
        }
        Ok(())
    }

    /// Makes one submission towards `samples` samples per pixel, a bounded piece of work whatever the scene; `None` when all samples are there. Paths that take
    /// more than one go on with the next step where they were, and samples count once all before them have ended. The first submission also compiles the kernels.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`], [`Error::Overflow`] should the index have rays that never end.
    pub fn step(&mut self, samples: u32) -> Result<Option<Step>> {
        self.step_with(samples, None)
    }

    /// As [`PathTracer::step`], with a stage of a technique's own in each bounce.
    pub(crate) fn step_with(&mut self, samples: u32, arrival: Option<&dyn ArrivalStage>) -> Result<Option<Step>> {
        if self.full.is_some() {
            return self.step_full(samples, arrival);
        }
        // A wave under way goes on, whatever is asked for meanwhile; one that fails is rendered again by the next step.
        let mut in_flight = match self.in_flight.take() {
            Some(in_flight) => in_flight,
            None => {
                let Some((wave, next)) = self.next_wave(samples)? else {
                    return Ok(None);
                };
                let walks = self.walker.begin(wave.key(self.settings.seed), wave.paths())?;
                InFlight { wave, next, walks }
            }
        };
        let timings = self.advance(&mut in_flight, arrival)?;
        if in_flight.walks.has_ended() {
            self.cursor = in_flight.next;
            self.pending = Some(in_flight.wave);
        } else {
            self.in_flight = Some(in_flight);
        }
        Ok(Some(self.step_so_far(timings, samples)))
    }

    /// The next wave towards `samples` samples per pixel, and where the one after it begins.
    fn next_wave(&mut self, samples: u32) -> Result<Option<(Wave, Cursor)>> {
        let slots = self.slots();
        let Some(adaptive) = &self.adaptive else {
            return Ok(self.cursor.next_wave(&self.film, slots, samples));
        };
        let next = adaptive.next_wave(&self.cursor, &self.film, slots);
        if next.is_some() {
            return Ok(next);
        }
        // A round follows from what the film has of those before.
        self.flush()?;
        let Some(adaptive) = &mut self.adaptive else {
            return Ok(None);
        };
        if !adaptive.begin_round(&self.film, slots, samples)? {
            return Ok(None);
        }
        (self.cursor.band, self.cursor.in_band) = (0, 0);
        Ok(adaptive.next_wave(&self.cursor, &self.film, slots))
    }

    /// Where waves are whole and passes have `each` samples per pixel, whatever the target of each call: which one is under way towards `samples`, and with how many
    /// samples it ends, or this call with it; `None` when all are there.
    pub(crate) fn pass_towards(&self, samples: u32, each: u32) -> Option<[u32; 2]> {
        let done = self.samples_done();
        let pass = done / each;
        (done < samples).then(|| [pass, (pass + 1).saturating_mul(each).min(samples)])
    }

    /// Whether such a pass has ended since every pixel had received `before` samples.
    pub(crate) fn has_ended_pass(&self, before: u32, each: u32) -> bool {
        self.samples_done().is_multiple_of(each) && self.samples_done() > before
    }

    /// What is there towards `samples` samples per pixel, after submissions that took `timings`.
    pub(crate) fn step_so_far(&self, timings: Vec<Timings>, samples: u32) -> Step {
        let [width, height] = self.film.size();
        let wanted = u64::from(samples) * u64::from(width) * u64::from(height);
        let done = self.full.as_ref().map_or(self.cursor.done, |full| full.samples.ended());
        Step {
            timings,
            done: done.min(wanted),
            wanted,
        }
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
        self.walker.buffers().slots()
    }

    /// By slot the cosine under which a path left where it was scattered last, where edges are bounded by their geometry term; elsewhere some other buffer.
    pub(crate) fn departures(&self) -> Buffer {
        self.kept.departures().clone()
    }

    /// Radii within which photons are seen that share light with the paths, and which share of their ways has planes, if any has: for waves that have not begun.
    pub(crate) fn see_photons(&mut self, radii: PhotonRadii, plane_share: f64) {
        let light = &mut self.shared_light;
        light.radii = radii;
        light.plane_share = light.plane_share.map(|_| plane_share as f32);
    }

    /// What an arrival stage keeps by place, of as many bytes as were asked for.
    pub(crate) fn stage_memory(&self) -> Buffer {
        self.kept.stage().clone()
    }

    /// Whether a wave is under way between two steps, where waves are whole.
    pub(crate) fn is_within_wave(&self) -> bool {
        debug_assert!(self.full.is_none(), "a wave that is kept full is always under way");
        self.in_flight.is_some()
    }

    /// Samples that every pixel has received, where all get as many and waves are whole: of waves that are kept full the cursor tells what has begun.
    pub(crate) fn samples_done(&self) -> u32 {
        debug_assert!(self.full.is_none(), "samples that have begun are not those received");
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
        let (p, trace) = (&self.pipelines, self.walker.trace_pipelines());
        let mut all = vec![p.camera.info()];
        all.extend(trace);
        all.push(p.shade.info());
        all.extend(self.walker.compaction_pipelines());
        all.push(p.resolve.info());
        all.extend(p.medium.as_ref().map(ComputePipeline::info));
        all.extend(self.adaptive.iter().flat_map(AdaptiveSamples::pipelines));
        all.extend(self.full.iter().map(|full| full.refill.pipeline()));
        all
    }

    /// Reads the picture: layers `radiance`, `variance` (of the mean), `samples`, and the AOVs that were asked for; with the number of
    /// samples that were left out because they were not finite.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn picture(&mut self) -> Result<(Picture, NonFiniteSamples)> {
        self.flush()?;
        self.film.picture()
    }

    /// Writes what there is so far to a buffer of four bytes per pixel, rows from the top, on the device: exposed by `exposure` stops, clipped
    /// and sRGB-encoded.
    ///
    /// # Errors
    /// [`Error::Setting`] when the buffer is too small, [`Error::DeviceLost`].
    pub fn display(&mut self, target: &Buffer, exposure: f32, format: PixelFormat) -> Result<()> {
        self.flush()?;
        self.film.display(target, exposure, format)
    }

    /// One submission of a wave.
    fn advance(&mut self, in_flight: &mut InFlight, arrival: Option<&dyn ArrivalStage>) -> Result<Vec<Timings>> {
        let InFlight { wave, walks, .. } = in_flight;
        let mut stages = EyeStages {
            scene: &self.scene,
            settings: &self.settings,
            frame: &self.frame,
            eye: self.eye,
            pipelines: &self.pipelines,
            film: &self.film,
            adaptive: self.adaptive.as_ref(),
            kept: &self.kept,
            light_tree: self.light_tree.as_ref(),
            shared_light: self.shared_light,
            arrival,
            under_way: UnderWay::Whole {
                wave: *wave,
                pending: &mut self.pending,
            },
        };
        let before = walks.walked().clone();
        self.walker.advance(walks, &mut stages)?;
        self.counters.count(&before, walks.walked());
        if walks.has_ended() {
            self.counters.paths += u64::from(wave.paths());
            self.counters.waves += 1;
        }
        Ok(walks.take_timings())
    }

    /// Adds to the film what has ended.
    fn flush(&mut self) -> Result<()> {
        self.flush_full()?;
        let Some(wave) = &self.pending else { return Ok(()) };
        let mut recorder = self.gpu.recorder("path film")?;
        let buffers = self.walker.buffers();
        let target = ResolveTarget {
            film: &self.film,
            adaptive: self.adaptive.as_ref(),
        };
        record_resolve(&mut recorder, &self.pipelines, target, buffers, &self.kept, wave)?;
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
        limits: "Paths begin only at the eye: caustics of small lights are noise, and those of points are not found.",
        sources: &[
            sources::KAJIYA_1986.whole(),
            sources::VEACH_1997.at("chapters 9 and 10"),
        ],
        shaders: &["shaders/techniques/path/path_shade.comp"],
        bias: Some(Bias::Unbiased),
        tests: &[
            "engine/src/transport/lights.rs::heuristics_sum_to_one",
            "tests/tests/paths/path_tracer.rs::lights_are_chosen_in_the_end_as_often_as_their_weights_say",
            "tests/tests/paths/path_tracer.rs::closed_furnaces_have_the_radiance_of_the_geometric_series",
            "tests/tests/paths/path_tracer.rs::the_variance_layer_is_the_variance_of_the_means",
            "tests/tests/paths/path_tracer.rs::sobol_draws_have_the_same_expectation_and_less_variance_between_seeds",
        ],
        settings: &["roulette_start", "roulette_cap"],
        ..Row::of(file!())
    },
    Row {
        id: "MET-E7",
        name: "rays through an index in compute kernels (MET-P2) as the reference of reflections: direct light, and direct light in a mirror, `LE|L.E|L.SE`",
        role: Role::PartOf("BG-3"),
        limits: "Noise, where lights have an extent.",
        sources: &[sources::KAJIYA_1986.whole(), sources::SZIRMAY_KALOS_2005.whole()],
        shaders: &["shaders/techniques/path/path_shade.comp"],
        bias: Some(Bias::Unbiased),
        tests: &[
            "tests/tests/impostor_pictures/reflections.rs::mirrors_in_a_diffuse_room_show_what_the_path_tracer_shows",
            "tests/tests/preview/planar.rs::a_planar_mirror_is_the_path_tracers",
        ],
        settings: &["path_set"],
        ..Row::of(file!())
    },
    Row {
        id: "CL-ALPHA",
        name: "alpha: masks, and blending by chance",
        role: Role::PartOf("BG-3"),
        limits: "Blending by chance costs noise.",
        sources: &[sources::ENDERTON_2010.whole()],
        shaders: &["shaders/walk/extend.comp", "shaders/walk/shadow.comp"],
        bias: Some(Bias::Unbiased),
        tests: &[
            "tests/tests/paths/alpha.rs::masks_are_all_or_nothing",
            "tests/tests/paths/alpha.rs::blended_walls_thin_out_the_light_behind_them",
            "tests/tests/paths/alpha.rs::blended_surfaces_scatter_in_proportion_to_alpha",
            "tests/tests/paths/alpha.rs::textures_and_vertex_colours_carry_alpha",
        ],
        ..Row::of(file!())
    },
    Row {
        id: "CL-ABSORPTION",
        name: "absorption inside solids",
        role: Role::PartOf("BG-3"),
        limits: "Solids of one absorption whose surfaces neither cross nor coincide.",
        sources: &[sources::KHRONOS_MATERIALS_VOLUME.at("law of Beer and Lambert")],
        shaders: &["shaders/techniques/path/path_shade.comp"],
        tests: &["tests/tests/paths/path_tracer.rs::light_inside_an_absorbing_body_is_absorbed_on_all_of_its_way"],
        ..Row::of(file!())
    },
];
