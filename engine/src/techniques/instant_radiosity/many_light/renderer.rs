//! A rendering of one view by frames of many lights.

use std::sync::Arc;

use glam::Vec3;

use super::card::refusals;
use super::discs::Discs;
use super::frame::Frame;
use super::kept::KeptLights;
use super::kernels::{Direct, Seen, Split};
use super::maps::Maps;
use super::metropolis::Metropolis;
use super::past::Past;
use super::records::LightRecord;
use super::reflective::Reflective;
use super::reservoirs::Reservoirs;
use super::settings::{Gathering, ManyLightSettings, Placement};
use crate::film::picture::{NonFiniteSamples, Picture};
use crate::film::{GpuFilm, PixelFormat, Step};
use crate::gpu::{Buffer, BufferDesc, Category, Gpu, PipelineInfo, TexelView};
use crate::raster::DrawPart;
use crate::scene::camera_frame::CameraFrame;
use crate::scene::{Camera, SceneProfile};
use crate::settings::TypedSettings;
use crate::techniques::FrameTarget;
use crate::techniques::foresight::frame_fits;
use crate::techniques::instant_radiosity::VirtualLight;
use crate::techniques::instant_radiosity::append::LightAppend;
use crate::techniques::photon_mapping::{PhotonCounts, PhotonPlan, PhotonTracer};
use crate::transport::{GpuScene, PathSet};
use crate::{Error, Result};

/// Exact counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct ManyLightCounts {
    /// Frames, each a sample of every pixel.
    pub frames: u64,
    /// Walks from the lights.
    pub walks: PhotonCounts,
    /// Views of lights that were drawn, of reflective shadow maps.
    pub views: u64,
    /// Virtual lights of all frames, with those of kept ones that have no light.
    pub lights: u64,
    /// Kept ones that were placed anew, the first ones among them.
    pub renewed: u64,
    /// Rays that told whether a lamp that has moved still sees a kept light.
    pub sight_rays: u64,
    /// Rays of chains that have chosen lights, and of what has measured their power.
    pub chain_rays: u64,
    /// Pairs of a pixel and a virtual light.
    pub connections: u64,
    /// Pairs whose visibility was asked for: the others bring nothing, whatever stands between.
    pub visibility_tests: u64,
    /// Shadow maps that were drawn.
    pub maps: u64,
    /// Points that were splatted into imperfect ones.
    pub splats: u64,
    /// Passes that were recorded, without those of walks.
    pub passes: u64,
}

/// A rendering of one view by frames of many lights.
///
/// It goes on by [`step`](Self::step), each of which waits for the device: the count of virtual lights is read back between walks and gather. So it is no
/// [`FrameMethod`](crate::techniques::FrameMethod), and cannot be recorded into a command buffer of a host.
pub struct ManyLight {
    pub(super) gpu: Gpu,
    pub(super) scene: Arc<GpuScene>,
    pub(super) settings: ManyLightSettings,
    pub(super) camera: Camera,
    pub(super) film: GpuFilm,
    pub(super) radiance: Buffer,
    /// None where nothing of surfaces is shown.
    pub(super) seen: Option<Seen>,
    /// Parts that what the camera sees is drawn in, once they are known.
    pub(super) parts: Option<Vec<DrawPart>>,
    pub(super) direct: Option<Direct>,
    pub(super) indirect: Option<Indirect>,
    /// In place of virtual lights.
    pub(super) discs: Option<Discs>,
    pub(super) frame: Option<Frame>,
    /// Frames on the film.
    pub(super) done: u32,
    /// Frames before them whose light lasts, so that no two have the same virtual lights.
    pub(super) before: u32,
    /// Virtual lights that a frame has placed last.
    pub(super) placed: u32,
    /// Views of lights that a frame has drawn last.
    pub(super) viewed: u32,
    pub(super) counts: ManyLightCounts,
}

/// Where virtual lights come from.
pub(super) enum LightSource {
    Walks(Box<PhotonTracer>),
    Reflective(Box<Reflective>),
    Kept(Box<KeptLights>),
    Metropolis(Box<Metropolis>),
}

impl LightSource {
    /// Their records.
    pub fn records(&self) -> &TexelView {
        match self {
            Self::Walks(tracer) => tracer.records(),
            Self::Reflective(reflective) => reflective.records(),
            Self::Kept(kept) => kept.records(),
            Self::Metropolis(chains) => chains.records(),
        }
    }

    /// What walks from the lights, if something does.
    pub fn tracer(&mut self) -> Option<&mut PhotonTracer> {
        match self {
            Self::Walks(tracer) => Some(tracer),
            Self::Metropolis(chains) => Some(&mut chains.tracer),
            Self::Reflective(_) | Self::Kept(_) => None,
        }
    }

    fn set_seed(&mut self, seed: u32) {
        match self {
            Self::Walks(tracer) => tracer.set_seed(seed),
            Self::Reflective(reflective) => reflective.set_seed(seed),
            Self::Kept(kept) => kept.set_seed(seed),
            Self::Metropolis(chains) => chains.set_seed(seed),
        }
    }

    fn pipelines(&self) -> Vec<PipelineInfo> {
        match self {
            Self::Walks(tracer) => tracer.pipelines(),
            Self::Reflective(reflective) => reflective.pipelines(),
            Self::Kept(kept) => kept.pipelines(),
            Self::Metropolis(chains) => chains.pipelines(),
        }
    }

    /// Beside the records.
    fn bytes(&self) -> u64 {
        match self {
            Self::Walks(_) => 0,
            Self::Reflective(reflective) => reflective.bytes(),
            Self::Kept(kept) => kept.bytes(),
            Self::Metropolis(chains) => chains.bytes(),
        }
    }
}

/// Light of virtual lights.
pub(super) struct Indirect {
    pub(super) source: LightSource,
    pub(super) gatherer: Gatherer,
    pub(super) maps: Option<Maps>,
    /// The frame before, where light is blended with it.
    pub(super) past: Option<Past>,
}

/// How pixels take their light.
pub(super) enum Gatherer {
    Split(Box<Split>),
    Reservoirs(Box<Reservoirs>),
}

impl ManyLight {
    /// Prepares a rendering of `size` pixels.
    ///
    /// # Errors
    /// [`Error::Setting`] for a setting, camera or size out of range, [`Error::Unsupported`] for a scene that it cannot model, or whose virtual lights cannot be
    /// kept where that is asked for, with every reason,
    /// [`Error::LimitExceeded`] for a picture or shadow maps larger than a buffer of the device or a ray index whose leaves are too long for a software device,
    /// [`Error::MissingFeature`] for shadow maps where the device has no clip distances, [`Error::OutOfMemory`].
    pub fn new(
        gpu: &Gpu,
        scene: Arc<GpuScene>,
        camera: &Camera,
        size: [u32; 2],
        settings: ManyLightSettings,
    ) -> Result<Self> {
        settings.check()?;
        let reasons = refusals(scene.profile());
        if !reasons.is_empty() {
            return Err(Error::Unsupported {
                technique: "many-light".into(),
                reasons,
            });
        }
        let film = GpuFilm::new(gpu, size, false)?;
        CameraFrame::new(camera, size)?;
        frame_fits(gpu.caps(), size)?;
        let profile = scene.profile();
        let emits = profile.has_environment() || scene.has_area_lights();
        let shows_direct = (settings.shows(0) && emits) || (settings.shows(1) && scene.has_lights());
        let shows_indirect = settings.shows_virtual_lights() && scene.has_lights();
        let surfaces = scene.surfaces();
        let pixels = size[0] * size[1];
        let direct = shows_direct.then(|| Direct::new(gpu, &scene, &settings, pixels));
        let has_discs = settings.has_discs();
        let indirect =
            (shows_indirect && !has_discs).then(|| Indirect::new(gpu, &scene, &settings, size, shows_direct));
        let discs = (shows_indirect && has_discs).then(|| Discs::new(gpu, &scene, &settings, pixels));
        let (direct, indirect, discs) = (direct.transpose()?, indirect.transpose()?, discs.transpose()?);
        let has_neighbours = indirect.is_some() && settings.has_neighbours();
        let has_history = indirect.as_ref().is_some_and(|indirect| indirect.past.is_some());
        let is_seen = shows_direct || shows_indirect;
        let seen = is_seen.then(|| Seen::new(gpu, &surfaces, size, has_neighbours, has_history));
        let seen = seen.transpose()?;
        let bytes = FrameTarget::bytes(size);
        Ok(Self {
            gpu: gpu.clone(),
            seen,
            parts: None,
            direct,
            indirect,
            discs,
            settings,
            camera: camera.clone(),
            film,
            radiance: gpu.buffer(&BufferDesc::storage("frame", bytes, Category::Film))?,
            frame: None,
            done: 0,
            before: 0,
            placed: 0,
            viewed: 0,
            counts: ManyLightCounts::default(),
            scene,
        })
    }

    /// The settings.
    pub fn settings(&self) -> &ManyLightSettings {
        &self.settings
    }

    /// The light paths of the picture.
    pub fn path_set(&self) -> PathSet {
        self.settings.path_set
    }

    /// Exact counts since it was made.
    pub fn counts(&self) -> ManyLightCounts {
        self.counts
    }

    /// What the scene needs.
    pub fn profile(&self) -> &SceneProfile {
        self.scene.profile()
    }

    /// Whether there are virtual lights.
    pub fn has_virtual_lights(&self) -> bool {
        self.indirect.is_some()
    }

    /// Whether each kept light has a shadow map of its own that stays from frame to frame.
    pub fn keeps_maps(&self) -> bool {
        let maps = self.indirect.as_ref().and_then(|indirect| indirect.maps.as_ref());
        let keeps = self.settings.placement == Placement::Incremental;
        keeps && maps.is_some_and(|maps| maps.at_once() >= self.settings.lights)
    }

    /// Whether pixels keep one of them each.
    pub fn has_reservoirs(&self) -> bool {
        self.indirect
            .as_ref()
            .is_some_and(|indirect| indirect.reservoirs().is_some())
    }

    /// Whether pixels gather from reflective shadow maps instead.
    pub fn has_discs(&self) -> bool {
        self.discs.is_some()
    }

    /// Whether there is light without them.
    pub fn has_direct_light(&self) -> bool {
        self.direct.is_some()
    }

    /// Bytes of what lies between passes: G-buffer, split picture or reservoirs, shadow maps, views of lights, and what frames leave for the next ones; not the records of virtual lights, 64 bytes each.
    pub fn bytes(&self) -> u64 {
        let seen = self.seen.as_ref().map_or(0, |seen| seen.gbuffer.bytes());
        let gathered = self.indirect.as_ref().map_or(0, |indirect| match &indirect.gatherer {
            Gatherer::Split(split) => split.bytes(),
            Gatherer::Reservoirs(reservoirs) => reservoirs.bytes(),
        });
        let maps = self.indirect.as_ref().and_then(|indirect| indirect.maps.as_ref());
        let source = self.indirect.as_ref().map_or(0, |indirect| indirect.source.bytes());
        let source = source + self.discs.as_ref().map_or(0, |discs| discs.reflective.bytes());
        let past = self.past().map_or(0, Past::bytes);
        seen + gathered + source + maps.map_or(0, Maps::bytes) + past
    }

    /// The virtual lights that a frame has placed last, those of all together that have power; none before the first ones.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn lights(&self) -> Result<Vec<VirtualLight>> {
        let Some(indirect) = &self.indirect else {
            return Ok(Vec::new());
        };
        let records = LightRecord::read(&self.gpu, indirect.source.records(), self.placed)?;
        Ok(records
            .iter()
            .map(|record| record.light(self.settings.lights))
            .filter(|light| light.power != Vec3::ZERO)
            .collect())
    }

    /// By pixel, the share of the last frame's indirect light that was that of the frame before, of [`ManyLightSettings::history`] at most; 0 where nothing is seen, or nothing was
    /// before. None where no history is kept, or no frame with virtual lights has ended since it began.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn confidence(&self) -> Result<Vec<f32>> {
        self.past().map_or(Ok(Vec::new()), |past| past.confidence(&self.gpu))
    }

    /// The kernels with their specialization.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = Vec::new();
        all.extend(self.seen.iter().flat_map(|seen| seen.gbuffer.pipelines()));
        all.extend(self.direct.iter().map(Direct::info));
        if let Some(indirect) = &self.indirect {
            all.extend(indirect.source.pipelines());
            match &indirect.gatherer {
                Gatherer::Split(split) => all.extend(split.pipelines()),
                Gatherer::Reservoirs(reservoirs) => all.extend(reservoirs.pipelines()),
            }
            all.extend(indirect.maps.iter().flat_map(Maps::pipelines));
            all.extend(indirect.past.iter().map(Past::info));
        }
        all.extend(self.discs.iter().flat_map(Discs::pipelines));
        all.extend(self.film.pipelines());
        all
    }

    /// Looks through another camera, or the same, and begins anew, also where a light has [moved](GpuScene::move_light). Virtual lights that are kept stay
    /// ([`Placement::Incremental`]), and their shadow maps: where an object has moved, [`restart`](Self::restart) instead. So does the light of the last frame
    /// ([`ManyLightSettings::history`]), also where an object has moved, of whose points it is looked up where they are now.
    ///
    /// # Errors
    /// [`Error::Setting`] for a camera that cannot be used, [`Error::DeviceLost`].
    pub fn set_camera(&mut self, camera: &Camera) -> Result<()> {
        CameraFrame::new(camera, self.film.size())?;
        self.film.clear()?;
        if self.camera != *camera {
            self.camera = camera.clone();
            self.parts = None;
        }
        if self.past().is_some() {
            self.before = self.number();
        }
        (self.done, self.frame) = (0, None);
        Ok(())
    }

    /// Forgets everything gathered so far, kept virtual lights and the last frame's light too, and begins anew with this seed, with the kernels there are.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn restart(&mut self, seed: u32) -> Result<()> {
        self.film.clear()?;
        self.settings.seed = seed;
        if let Some(direct) = &mut self.direct {
            direct.set_seed(seed);
        }
        if let Some(indirect) = &mut self.indirect {
            indirect.source.set_seed(seed);
            if let Gatherer::Reservoirs(reservoirs) = &mut indirect.gatherer {
                reservoirs.set_seed(seed);
            }
            indirect.past.iter_mut().for_each(Past::forget);
        }
        if let Some(discs) = &mut self.discs {
            discs.set_seed(seed);
        }
        (self.done, self.before, self.frame) = (0, 0, None);
        Ok(())
    }

    /// Does a bounded piece of work towards `samples` samples of each pixel, whatever the scene; `None` when all samples are there.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`], [`Error::Overflow`] for more virtual lights than the device can hold, and should the index have rays
    /// that never end. The frame under way is then begun anew.
    pub fn step(&mut self, samples: u32) -> Result<Option<Step>> {
        if self.done >= samples {
            return Ok(None);
        }
        let mut frame = match self.frame.take() {
            Some(frame) => frame,
            None => self.begin_frame()?,
        };
        let timings = self.advance(&mut frame)?;
        if frame.has_ended() {
            self.done += 1;
            self.counts.frames += 1;
        } else {
            self.frame = Some(frame);
        }
        let pixels = self.pixels();
        Ok(Some(Step {
            timings,
            done: u64::from(pixels) * u64::from(self.done),
            wanted: u64::from(pixels) * u64::from(samples),
        }))
    }

    /// The picture so far.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn picture(&mut self) -> Result<(Picture, NonFiniteSamples)> {
        self.film.picture()
    }

    /// Writes the picture so far to a buffer of four bytes per pixel: `exposure` in stops, clipped, sRGB-encoded.
    ///
    /// # Errors
    /// [`Error::Setting`] when the buffer is too small, [`Error::DeviceLost`].
    pub fn display(&mut self, target: &Buffer, exposure: f32, format: PixelFormat) -> Result<()> {
        self.film.display(target, exposure, format)
    }

    /// Of the next frame, by which its virtual lights are chosen.
    pub(super) fn number(&self) -> u32 {
        self.before.wrapping_add(self.done)
    }

    /// The frame before, where light is blended with it.
    pub(super) fn past(&self) -> Option<&Past> {
        self.indirect.as_ref().and_then(|indirect| indirect.past.as_ref())
    }

    /// Of the picture.
    pub(super) fn pixels(&self) -> u32 {
        self.film.size().iter().product()
    }
}

impl Indirect {
    /// The split picture, where lights are shared out among tiles.
    pub(super) fn split(&self) -> Option<&Split> {
        match &self.gatherer {
            Gatherer::Split(split) => Some(split),
            Gatherer::Reservoirs(_) => None,
        }
    }

    pub(super) fn reservoirs(&self) -> Option<&Reservoirs> {
        match &self.gatherer {
            Gatherer::Reservoirs(reservoirs) => Some(reservoirs),
            Gatherer::Split(_) => None,
        }
    }

    fn new(gpu: &Gpu, scene: &Arc<GpuScene>, settings: &ManyLightSettings, size: [u32; 2], adds: bool) -> Result<Self> {
        let plan = PhotonPlan {
            photons: match settings.placement {
                Placement::Metropolis => settings.pool,
                _ => settings.lights,
            },
            sampler: settings.sampler,
            seed: settings.seed,
            submission_work: settings.submission_work,
            follows_footprints: false,
            tells_caustics: false,
            even_survival: false,
            stores_lights: true,
            only_rough: settings.has_further_bounces(),
            carries_light_distance: false,
            stored: settings.stored(),
        };
        let fewer = match settings.placement {
            Placement::Metropolis => "follow fewer walks per frame: setting `pool`",
            _ => "follow fewer walks per frame: setting `lights`",
        };
        let tracer = || {
            PhotonTracer::new(
                gpu,
                Arc::clone(scene),
                plan,
                Box::new(LightAppend::new(gpu, scene, fewer)?),
            )
        };
        let source = match settings.placement {
            Placement::Walks => LightSource::Walks(Box::new(tracer()?)),
            Placement::Metropolis => {
                LightSource::Metropolis(Box::new(Metropolis::new(gpu, scene, settings, tracer()?)?))
            }
            Placement::Rsm => LightSource::Reflective(Box::new(Reflective::new(gpu, scene, settings)?)),
            Placement::Incremental => LightSource::Kept(Box::new(KeptLights::new(gpu, scene, settings)?)),
        };
        let maps = Maps::new(gpu, &scene.surfaces(), settings)?;
        let past = Past::new(gpu, scene, settings, size, adds)?;
        // With a frame before it is that which adds.
        let adds = adds && past.is_none();
        let gatherer = match settings.gathering {
            Gathering::Reservoirs => {
                let pixels = size[0] * size[1];
                Gatherer::Reservoirs(Box::new(Reservoirs::new(gpu, scene, settings, pixels)?))
            }
            Gathering::Lights | Gathering::Disc | Gathering::DiscSquared => {
                let split = Split::new(gpu, scene, settings, size, adds, maps.is_some())?;
                Gatherer::Split(Box::new(split))
            }
        };
        Ok(Self {
            source,
            gatherer,
            maps,
            past,
        })
    }
}
