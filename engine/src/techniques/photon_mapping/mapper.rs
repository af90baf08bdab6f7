//! A progressive rendering by photon mapping: pass after pass, photons, a map of them, and eye paths that ask it.
//!
//! Sources: H. W. Jensen, "Realistic Image Synthesis Using Photon Mapping", 2001; T. Hachisuka and H. W. Jensen, "Stochastic Progressive Photon
//! Mapping", ACM TOG 28(5), 2009; C. Knaus and M. Zwicker, "Progressive Photon Mapping: A Probabilistic Approach", ACM TOG 30(3), 2011, whose
//! passes are independent of each other and need nothing kept of a pixel but its mean; B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis,
//! Trinity College Dublin, 2011, §6.3.
//!
//! Light paths are parted without overlap: what the eye sees through specular and glossy scattering alone, and the light that arrives
//! directly where it first sees a diffuse surface or a medium scatters it, are the path tracer's; everything else that arrives there is the maps', one of
//! surfaces and one of media, each only where the scene may have something of it. Where eye paths go on in media ([`PhotonSettings::volume_paths`]) they share what they find there with the map of media
//! ([`photon_share`](crate::transport::photon_share)): all light that is seen first by a scattering in a medium, but that which a mirror scatters first, as caustics. Glossy lobes are never estimated from the map. Three kinds of light are the eye paths' alone, so that what they give beyond the first diffuse reflection
//! is missing (unless eye paths go on in a medium): unlit surfaces, emitters behind others with alpha in the same place, and slivers that light sampling leaves out. A photon
//! that starts inside a solid knows it from where it first meets the inside of one.
//!
//! Guarantees: deterministic in (seed, pass, photon) and (seed, pixel, sample), on any number of threads; scaling a scene, with lengths among
//! the settings, scales the picture.

use std::sync::Arc;
use std::time::Instant;

use super::card::refusals;
use super::gather::{EventsAsked, Gather, GatherCounts, RayFetches};
use super::kernel::{KernelSettings, PhotonRecord, PhotonWords, photon_history, unpack_photon};
use super::map::{Made, MapContents, MapFigures, MapMaker, PhotonMap, seconds_of};
use super::pilot;
use super::settings::{MapBuild, MediaLengths, PhotonSettings};
use super::tracer::{PhotonAppend, PhotonCounts, PhotonTracer, Tracing, flux_scale};
use super::volume::event::{PhotonEvent, unpack_event};
use super::volume::footprint::EventKernelSettings;
use super::volume::{EventMap, EventMaps, paths_in_flight};
use crate::film::picture::{NonFiniteSamples, Picture};
use crate::film::{PixelFormat, Step};
use crate::gpu::{Buffer, Gpu, PipelineInfo};
use crate::scene::{Camera, SceneProfile};
use crate::settings::TypedSettings;
use crate::techniques::path::{PathCounters, PhotonRadii, SharingPhotons};
use crate::techniques::{PathTracer, PathTracerSettings};
use crate::transport::GpuScene;
use crate::walk::ArrivalStage;
use crate::{Error, Result};

/// Whether photons have somewhere to start.
pub(super) fn sends_photons(scene: &GpuScene) -> bool {
    scene.has_lights() || scene.glow().is_some()
}

/// Maps of a pass.
struct PassMaps {
    /// Only where surfaces may be diffuse.
    surfaces: Option<PhotonMap>,
    /// Only in scenes with media.
    events: Option<EventMap>,
}

/// Exact counts, and what the host's share took.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct MapperCounts {
    /// Maps made; 0 where the picture has nothing of one.
    pub passes: u64,
    /// Photons of all passes.
    pub photons: PhotonCounts,
    /// Records of all maps.
    pub records: u64,
    /// Kernels about a point of the scene's surfaces, on average, in the last map.
    pub cover: f64,
    /// Records that leaves of the last map were to hold at most.
    pub leaf_size: u32,
    /// Events of all maps of media.
    pub events: u64,
    /// Queries.
    pub gather: GatherCounts,
    /// Ways through media that asked the maps of these, and the kernels that they met.
    pub beams: GatherCounts,
    /// What these took of the maps, where that is counted.
    pub ray_fetches: RayFetches,
    /// Seconds of wall clock that photons were traced for.
    pub trace_seconds: f64,
    /// Seconds that maps were built for: by the host those of wall clock, with copies; by the device those of wall clock until a build was
    /// submitted, and of its passes.
    pub map_seconds: f64,
}

impl MapperCounts {
    /// The last map.
    fn note(&mut self, map: MapFigures) {
        (self.cover, self.leaf_size) = (map.cover, map.leaf_size);
    }
}

/// A photon where it landed, as the map of a pass has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MappedPhoton {
    /// Its record, with its flux in W.
    pub record: PhotonRecord,
    /// How often it had been scattered, at most [`PHOTON_BOUNCE_MAX`](crate::gpu::shaders::constants::PHOTON_BOUNCE_MAX); where the path set is an expression, the class
    /// of its history.
    pub bounce: u32,
    /// Whether it had been scattered diffusely; told by the final gather alone.
    pub diffused: bool,
}

/// A collision of a photon with a medium, as the map of a pass has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MappedEvent {
    /// Its record, with the flux that is scattered in W.
    pub event: PhotonEvent,
}

/// A progressive rendering of one view by photon mapping.
pub struct PhotonMapper {
    gpu: Gpu,
    scene: Arc<GpuScene>,
    settings: PhotonSettings,
    size: [u32; 2],
    /// Of the automatic radius of kernels in media.
    event_share: f64,
    eye: PathTracer,
    /// None where the picture has nothing of a map.
    photons: Option<Photons>,
    counts: MapperCounts,
}

struct Photons {
    tracer: PhotonTracer,
    gather: Gather,
    /// Only where surfaces may be diffuse.
    maker: Option<MapMaker>,
    /// Only in scenes with media.
    event_maps: Option<EventMaps>,
    /// The photons of the pass under way, until all of them have landed.
    tracing: Option<Tracing>,
    /// Of the pass under way.
    maps: Option<PassMaps>,
}

impl PhotonMapper {
    /// Prepares a rendering of `size` pixels.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for a setting or size out of range, [`Error::Unsupported`](crate::Error::Unsupported) for a scene whose endless medium emits everywhere, or has light from infinity, and for a path set
    /// that is neither a range of bounces nor an expression, [`Error::MissingFeature`](crate::Error::MissingFeature) for packets of queries on
    /// a device without votes, [`Error::LimitExceeded`](crate::Error::LimitExceeded) for media that emit among bodies of more than 8,192 triangles,
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn new(
        gpu: &Gpu,
        scene: Arc<GpuScene>,
        camera: &Camera,
        size: [u32; 2],
        settings: PhotonSettings,
    ) -> Result<Self> {
        let event_share = pilot::event_share(gpu, &scene, (camera, size), &settings)?;
        Self::with_event_share(gpu, scene, (camera, size), settings, event_share)
    }

    /// As [`PhotonMapper::new`], with a share of the automatic radius of kernels in media.
    pub(super) fn with_event_share(
        gpu: &Gpu,
        scene: Arc<GpuScene>,
        (camera, size): (&Camera, [u32; 2]),
        settings: PhotonSettings,
        event_share: f64,
    ) -> Result<Self> {
        settings.check()?;
        let reasons = refusals(scene.profile());
        if !reasons.is_empty() {
            return Err(Error::Unsupported {
                technique: "photon".into(),
                reasons,
            });
        }
        let has_media = scene.profile().media.any();
        if has_media && settings.volume.needs_homogeneous_media() && scene.profile().media.heterogeneous {
            let cause = "need homogeneous media, but the scene has some with a density grid; take \"ray\", \"unified\" or \"march\"";
            return Err(Error::setting("volume", settings.volume.word(), cause));
        }
        let has_surface_map = scene.has_diffuse_base();
        let has_map = settings.needs_photons() && sends_photons(&scene) && (has_surface_map || has_media);
        // Whether eye paths go on in media, for a share of the photons' light.
        let shares = settings.volume_paths && has_media && has_map;
        let (classes, eye_paths) = (settings.classes(shares)?, settings.eye_paths(has_media, shares)?);
        let eye_settings = PathTracerSettings {
            path_set: eye_paths,
            sampler: settings.sampler,
            seed: settings.seed,
            aovs: settings.aovs,
            submission_work: settings.submission_work,
            // What arrives is gathered and counted wave by wave, for each pass of photons.
            full_waves: false,
            paths_in_flight: paths_in_flight(gpu, &scene),
            ..PathTracerSettings::default()
        };
        let tracer = has_map.then(|| {
            let append = Box::new(PhotonAppend::new(gpu)?);
            let (plan, stored) = (settings.plan(has_media), (settings.volume, settings.volume_beams));
            PhotonTracer::in_media(gpu, Arc::clone(&scene), plan, append, classes.as_ref(), stored)
        });
        let tracer = tracer.transpose()?;
        // Takes as much memory as is left, if it must, with what gathering keeps.
        let kept = if has_map { Gather::slot_bytes(&scene) } else { 0 };
        let beside = SharingPhotons {
            photons: if shares { settings.photons } else { 0 },
            have_planes: settings.volume.stores_planes(),
        };
        let eye = PathTracer::beside_photons(gpu, Arc::clone(&scene), camera, size, eye_settings, beside, kept)?;
        let memory = (eye.slots(), eye.stage_memory());
        let photons = match tracer {
            Some(tracer) => Some(Photons {
                tracer,
                gather: Gather::new(gpu, &scene, &settings, &eye_paths, classes.as_ref(), memory)?,
                maker: has_surface_map
                    .then(|| MapMaker::new(gpu, settings.map_build))
                    .transpose()?,
                event_maps: has_media.then(|| EventMaps::new(gpu, &settings)).transpose()?,
                tracing: None,
                maps: None,
            }),
            None => None,
        };
        Ok(Self {
            gpu: gpu.clone(),
            eye,
            scene,
            settings,
            size,
            event_share,
            photons,
            counts: MapperCounts::default(),
        })
    }

    /// The settings.
    pub fn settings(&self) -> &PhotonSettings {
        &self.settings
    }

    /// Exact counts since it was made.
    pub fn counts(&self) -> MapperCounts {
        self.counts
    }

    /// Whether there are photons, and a map of them, on surfaces or in media.
    pub fn has_map(&self) -> bool {
        self.photons.is_some()
    }

    /// Whether there is one of photons on surfaces: some surface may be diffuse.
    pub fn has_surface_map(&self) -> bool {
        self.photons.as_ref().is_some_and(|photons| photons.maker.is_some())
    }

    /// What the scene needs.
    pub fn profile(&self) -> &SceneProfile {
        self.scene.profile()
    }

    /// Counts of the eye paths.
    pub fn eye_counters(&self) -> PathCounters {
        self.eye.counters()
    }

    /// The kernels with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.eye.pipelines();
        if let Some(photons) = &self.photons {
            all.extend(photons.tracer.pipelines());
            all.extend(photons.maker.iter().flat_map(MapMaker::pipelines));
            all.extend(photons.event_maps.iter().flat_map(EventMaps::pipelines));
            all.extend(photons.gather.pipelines());
        }
        all
    }

    /// Looks through another camera and begins anew.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for a camera that cannot be used, [`Error::DeviceLost`](crate::Error::DeviceLost).
    pub fn set_camera(&mut self, camera: &Camera) -> Result<()> {
        self.eye.set_camera(camera)?;
        self.event_share = pilot::event_share(&self.gpu, &self.scene, (camera, self.size), &self.settings)?;
        self.begin();
        Ok(())
    }

    /// Forgets everything gathered so far and begins anew with this seed, with the kernels there are: for an independent picture of the same
    /// view, or one of another time, after a light has [moved](GpuScene::move_light). The automatic radius of kernels in media stays.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost), [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn restart(&mut self, seed: u32) -> Result<()> {
        self.restart_with(seed, self.event_share)
    }

    /// The same with a share of the automatic radius of kernels in media.
    pub(super) fn restart_with(&mut self, seed: u32, event_share: f64) -> Result<()> {
        self.eye.restart(seed)?;
        self.settings.seed = seed;
        self.event_share = event_share;
        if let Some(photons) = &mut self.photons {
            photons.tracer.set_seed(seed);
        }
        self.begin();
        Ok(())
    }

    /// Before the first pass.
    fn begin(&mut self) {
        if let Some(photons) = &mut self.photons {
            (photons.tracing, photons.maps) = (None, None);
            photons.tracer.restart();
        }
    }

    /// Does a bounded piece of work towards `samples` samples per pixel, whatever the scene: a submission of a pass's photons, the last one with the map that is
    /// made of them, or a submission of eye paths; `None` when all samples are there.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost), [`Error::OutOfMemory`](crate::Error::OutOfMemory),
    /// [`Error::Overflow`](crate::Error::Overflow) for more photon records than the device can hold, for neighbours among too many photons,
    /// and should the index have rays that never end.
    pub fn step(&mut self, samples: u32) -> Result<Option<Step>> {
        let (done, each) = (self.eye.samples_done(), self.settings.samples_per_pass);
        let Some([pass, end]) = self.eye.pass_towards(samples, each) else {
            return Ok(None);
        };
        let mut timings = Vec::new();
        let (kernel, watts, event_kernel) = (self.kernel(pass), self.watts(), self.event_kernel(pass));
        let (path_share, shrunk) = (self.event_path_share(pass), self.settings.event_shrinkage(pass));
        let (radii, plane_share) = (self.event_radii(pass), self.plane_share());
        if let Some(photons) = &mut self.photons
            && photons.maps.is_none()
        {
            let clock = Instant::now();
            let begun = photons.tracing.take();
            let begin = || {
                photons
                    .tracer
                    .begin(pass, Some(&kernel))
                    .with_event_kernel(event_kernel, path_share)
                    .with_plane_share(plane_share)
            };
            let mut tracing = begun.unwrap_or_else(begin);
            let all = photons.tracer.advance(&mut tracing)?;
            timings.append(&mut tracing.take_timings());
            self.counts.trace_seconds += clock.elapsed().as_secs_f64();
            if !all {
                photons.tracing = Some(tracing);
                return Ok(Some(self.eye.step_so_far(timings, samples)));
            }
            let traced = tracing.into_traced();
            let area = self.scene.surface_area();
            let mut seconds = 0.0;
            let mut maps = PassMaps {
                surfaces: None,
                events: None,
            };
            if let Some(maker) = &mut photons.maker {
                let clock = Instant::now();
                let made = maker.make(&self.gpu, photons.tracer.records(), traced.records, area)?;
                seconds += clock.elapsed().as_secs_f64();
                let (map, figures) = match made {
                    Made::ByHost(map, figures) => (map, Some(figures)),
                    Made::ByDevice(map, building) => {
                        let built = building.wait()?;
                        seconds += seconds_of(&built);
                        timings.push(built);
                        (map, maker.figures(area)?)
                    }
                };
                figures.into_iter().for_each(|figures| self.counts.note(figures));
                maps.surfaces = Some(map);
            }
            if let (Some(maker), Some(events)) = (&mut photons.event_maps, photons.tracer.events()) {
                let clock = Instant::now();
                let (map, building) = maker.make(events, traced.events, &event_kernel, radii.beams, shrunk)?;
                seconds += clock.elapsed().as_secs_f64();
                if let Some(building) = building {
                    let built = building.wait()?;
                    seconds += seconds_of(&built);
                    timings.push(built);
                }
                maps.events = Some(map);
            }
            photons.maps = Some(maps);
            self.counts.map_seconds += seconds;
            self.counts.passes += 1;
            self.counts.photons += traced.counts;
            self.counts.records += u64::from(traced.records);
            self.counts.events += u64::from(traced.events);
            return Ok(Some(self.eye.step_so_far(timings, samples)));
        }
        let stage = match &self.photons {
            Some(Photons {
                gather,
                maps: Some(maps),
                ..
            }) => {
                let nearest = (self.settings.neighbors_in(pass), kernel.length_max * kernel.unit_length);
                Some(gather.stage(
                    &self.scene,
                    maps.surfaces.as_ref(),
                    maps.events.as_ref().map(|map| EventsAsked {
                        map,
                        radii,
                        plane_share,
                    }),
                    watts,
                    nearest,
                ))
            }
            _ => None,
        };
        let arrival = stage.as_ref().map(|stage| stage as &dyn ArrivalStage);
        self.eye.see_photons(radii, plane_share);
        let step = self.eye.step_with(end, arrival)?;
        if let Some(photons) = &mut self.photons {
            // They are those of a whole wave.
            if step.is_some() && !self.eye.is_within_wave() {
                self.counts.gather += photons.gather.counts()?;
                self.counts.beams += photons.gather.volume_counts()?;
                self.counts.ray_fetches += photons.gather.volume_fetches()?;
            }
        }
        let Some(mut step) = step else {
            return Ok(None);
        };
        if self.eye.has_ended_pass(done, each)
            && let Some(photons) = &mut self.photons
        {
            photons.maps = None;
        }
        timings.append(&mut step.timings);
        Ok(Some(self.eye.step_so_far(timings, samples)))
    }

    /// Traces the photons of a pass, and returns them in the order of waves, in each of bounces and photons. The picture is not touched, and counts go on; photons of
    /// a step that are under way begin anew.
    ///
    /// # Errors
    /// As [`PhotonMapper::step`].
    pub fn photons(&mut self, pass: u32) -> Result<Vec<MappedPhoton>> {
        let kernel = self.kernel(pass);
        let scale = self.watts();
        let Some(photons) = &mut self.photons else {
            return Ok(Vec::new());
        };
        photons.tracing = None;
        let traced = photons.tracer.trace(pass, Some(&kernel))?;
        self.counts.photons += traced.counts;
        let records = photons.tracer.records().buffer().view();
        let records: Vec<PhotonWords> = self.gpu.read(records, traced.records as usize)?;
        let mapped = records.iter().map(|words| {
            let (bounce, diffused) = photon_history(words);
            let mut record = unpack_photon(words);
            record.flux *= scale as f32;
            MappedPhoton {
                record,
                bounce,
                diffused,
            }
        });
        Ok(mapped.collect())
    }

    /// Traces the photons of a pass, and returns their collisions with media that are stored, in the order of waves, in each of bounces and photons. The picture is
    /// not touched, and counts go on. With [`VolumeEstimate::Beams`](super::volume::VolumeEstimate::Beams) and
    /// [`VolumeEstimate::Planes`](super::volume::VolumeEstimate::Planes) there are none, with [`VolumeEstimate::Unified`](super::volume::VolumeEstimate::Unified) they are not told from ways.
    ///
    /// # Errors
    /// As [`PhotonMapper::step`].
    pub fn events(&mut self, pass: u32) -> Result<Vec<MappedEvent>> {
        let (kernel, scale, event_kernel) = (self.kernel(pass), self.watts(), self.event_kernel(pass));
        let (path_share, shrunk) = (self.event_path_share(pass), self.settings.event_shrinkage(pass));
        let Some(photons) = &mut self.photons else {
            return Ok(Vec::new());
        };
        photons.tracing = None;
        let tracing = photons
            .tracer
            .begin(pass, Some(&kernel))
            .with_event_kernel(event_kernel, path_share);
        let traced = photons.tracer.finish(tracing)?;
        self.counts.photons += traced.counts;
        let events = photons.tracer.events().filter(|_| !self.settings.stores_ways());
        let Some((maps, events)) = photons.event_maps.as_ref().zip(events) else {
            return Ok(Vec::new());
        };
        let words = maps.read(events, traced.events, &event_kernel, shrunk)?;
        let mapped = words.iter().map(|words| {
            let mut event = unpack_event(words);
            event.flux *= scale as f32;
            MappedEvent { event }
        });
        Ok(mapped.collect())
    }

    /// Traces the photons of a pass and reads their map back as `build` makes it, which is the same whoever does. The picture is not touched,
    /// and counts go on; `None` where there are no photons, or no surface may be diffuse.
    ///
    /// # Errors
    /// As [`PhotonMapper::step`] and [`map_contents`](super::map_contents).
    pub fn map(&mut self, pass: u32, build: MapBuild) -> Result<Option<MapContents>> {
        let kernel = self.kernel(pass);
        let Some(photons) = self.photons.as_mut().filter(|photons| photons.maker.is_some()) else {
            return Ok(None);
        };
        photons.tracing = None;
        let traced = photons.tracer.trace(pass, Some(&kernel))?;
        self.counts.photons += traced.counts;
        let (records, area) = (photons.tracer.records(), self.scene.surface_area());
        let mut maker = MapMaker::new(&self.gpu, build)?;
        maker.contents(&self.gpu, records, traced.records, area).map(Some)
    }

    /// How the kernels of a pass are made.
    pub fn kernel(&self, pass: u32) -> KernelSettings {
        self.settings.kernel(pass, self.diagonal(), self.scene.surface_area())
    }

    /// Radius of the kernels of events in media, m, in a pass; the greatest where media differ, or where they follow footprints or neighbours. Of collisions, where these stand beside beams.
    pub fn event_radius(&self, pass: u32) -> f64 {
        self.settings.event_radius(pass, &self.media_lengths())
    }

    /// Radius of the kernels of photon beams, m, in a pass; that of collisions where there are no beams.
    pub fn beam_radius(&self, pass: u32) -> f64 {
        self.event_radii(pass).beams
    }

    fn event_radii(&self, pass: u32) -> PhotonRadii {
        self.settings.event_radii(pass, &self.media_lengths())
    }

    /// How the kernels of events in media are made in a pass.
    pub fn event_kernel(&self, pass: u32) -> EventKernelSettings {
        self.settings.event_kernel(pass, &self.media_lengths())
    }

    fn event_path_share(&self, pass: u32) -> f64 {
        self.settings.event_path_share(pass, &self.media_lengths())
    }

    /// Share of ways that have planes, where these are stored: that of the automatic radius which beams have, so that rays meet as many planes; all where the radius is given.
    fn plane_share(&self) -> f64 {
        if self.settings.radius_is_automatic() {
            self.event_share
        } else {
            1.0
        }
    }

    fn media_lengths(&self) -> MediaLengths {
        MediaLengths {
            diagonal: self.diagonal(),
            extinctions: self.scene.extinctions(),
            share: self.event_share,
        }
    }

    /// Of the scene's box, m.
    fn diagonal(&self) -> f64 {
        let [lower, upper] = self.scene.bounds();
        f64::from((upper - lower).length())
    }

    /// What stored fluxes are multiplied by, W.
    fn watts(&self) -> f64 {
        1.0 / (flux_scale(&self.scene) * f64::from(self.settings.photons))
    }

    /// The picture so far, as [`PathTracer::picture`] has it.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost), [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn picture(&mut self) -> Result<(Picture, NonFiniteSamples)> {
        self.eye.picture()
    }

    /// As [`PathTracer::display`].
    ///
    /// # Errors
    /// As there.
    pub fn display(&mut self, target: &Buffer, exposure: f32, format: PixelFormat) -> Result<()> {
        self.eye.display(target, exposure, format)
    }
}
