//! Photons from the lights through the scene, in waves like those of paths, to the records that a map is made of, or to whatever else their deposits are
//! made into ([`Append`]).
//!
//! Sources: H. W. Jensen, "Realistic Image Synthesis Using Photon Mapping", 2001, chapter 5; B. Fabianowski, "Interactive Manycore Photon Mapping", PhD
//! thesis, Trinity College Dublin, 2011, §3.4.1 and §5.1. Stages: `photon_emit`, a walker's closest hits, `photon_scatter`, its compaction,
//! `photon_append` or another kernel in its place.
//!
//! Guarantees: records depend on (seed, pass, number of photons) alone, and their order on the slots of a wave besides, never on the number of threads; photons that were
//! emitted have escaped or were absorbed, to the count; records that do not fit are never lost silently, since the pass is traced again
//! with room for them; a submission is a bounded piece of work.

mod append;
mod plan;
mod stages;

pub(in crate::techniques) use append::Append;
pub(super) use append::PhotonAppend;
pub use plan::PhotonCounts;
pub(in crate::techniques) use plan::{PhotonPlan, Stored};

use std::sync::Arc;

use self::stages::PhotonStages;
use super::collisions::CollisionStage;
use super::glow::GlowStage;
use super::kernel::KernelSettings;
use super::path_classes::PathClasses;
use super::volume::footprint::EventKernelSettings;
use super::volume::ways::BeamLength;
use super::volume::{VolumeEstimate, VolumeOptions, VolumeTrace};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::WALK_GROUP;
use crate::gpu::shaders::sets::PhotonWave;
use crate::gpu::shaders::techniques::photon_mapping::{photon_emit, photon_scatter};
use crate::gpu::shaders::types::Differentials;
use crate::gpu::{Buffer, BufferDesc, Category, ComputePipeline, Gpu, PipelineInfo, TexelView, Timings};
use crate::transport::photon_share::placeless_distance2;
use crate::transport::{GpuScene, emission_spec, surface_spec};
use crate::walk::{
    WalkKey, WalkOptions, Walked, Walker, WaveBuffers, WaveInFlight, WaveNeeds, default_slots, slots_of_device,
};
use crate::{Error, Result};

/// Bounces recorded into one command buffer, at most.
const BOUNCES_PER_SUBMISSION: usize = 8;
/// Records that there is room for at first, a photon.
const RECORDS_PER_PHOTON: u64 = 4;
/// Tells the photons' random numbers from those of eye paths.
const PHOTON_SEED: u32 = 0x7068_6f74;

/// Photons of one pass.
#[derive(Default)]
pub(in crate::techniques) struct Traced {
    /// Records in [`PhotonTracer::records`].
    pub records: u32,
    /// Those in [`PhotonTracer::events`].
    pub events: u32,
    pub counts: PhotonCounts,
    pub timings: Vec<Timings>,
}

/// Photons of a pass under way.
pub(in crate::techniques) struct Tracing {
    pass: u32,
    /// None for deposits that have none.
    kernel: Option<KernelSettings>,
    /// Kernels of events in media, if there are some.
    event_kernel: Option<EventKernelSettings>,
    /// [`VolumePass::path_share`](super::volume::VolumePass::path_share).
    path_share: f64,
    /// [`VolumePass::plane_share`](super::volume::VolumePass::plane_share).
    plane_share: f64,
    /// First photon of the wave under way, or of the next one.
    first_photon: u32,
    wave: Option<(WalkKey, WaveInFlight)>,
    traced: Traced,
}

impl Tracing {
    /// The timings of the submissions since they were taken last.
    pub fn take_timings(&mut self) -> Vec<Timings> {
        std::mem::take(&mut self.traced.timings)
    }

    /// With kernels so made for events in media, at most that share of a mean free path wide.
    pub fn with_event_kernel(self, kernel: EventKernelSettings, path_share: f64) -> Self {
        Self {
            event_kernel: Some(kernel),
            path_share,
            ..self
        }
    }

    /// With planes of that share of ways.
    pub fn with_plane_share(self, plane_share: f64) -> Self {
        Self { plane_share, ..self }
    }

    /// What has been traced.
    pub fn into_traced(self) -> Traced {
        self.traced
    }
}

/// Traces photons of a scene.
pub(in crate::techniques) struct PhotonTracer {
    gpu: Gpu,
    plan: PhotonPlan,
    walker: Walker,
    kit: Kit,
}

/// All of it but its walker.
struct Kit {
    scene: Arc<GpuScene>,
    stored: Stored,
    /// Of a pass.
    photons: u32,
    /// [`PhotonPlan::carries_light_distance`].
    carries_light_distance: bool,
    append: Box<dyn Append>,
    emit: ComputePipeline<photon_emit::Kernel>,
    scatter: ComputePipeline<photon_scatter::Kernel>,
    differentials: Buffer,
    counters: Buffer,
    counters_readback: Buffer,
    records: TexelView,
    capacity: u32,
    /// [`GpuScene::emission_choice`].
    emission: Option<TexelView>,
    /// Only where media emit.
    glow: Option<GlowStage>,
    /// Only in scenes with media, unless `append` has a stage for collisions.
    volume: Option<VolumeTrace>,
    /// Of expressions: successors of classes, and those by scattering in media.
    classes: Option<(Buffer, [u32; 2])>,
}

impl PhotonTracer {
    pub fn new(gpu: &Gpu, scene: Arc<GpuScene>, plan: PhotonPlan, append: Box<dyn Append>) -> Result<Self> {
        Self::in_media(gpu, scene, plan, append, None, (VolumeEstimate::Ray, BeamLength::Long))
    }

    /// As [`PhotonTracer::new`], of photons that are told apart by their class, where there are some, and of which media keep what an estimate sees, with beams of a length.
    pub(super) fn in_media(
        gpu: &Gpu,
        scene: Arc<GpuScene>,
        plan: PhotonPlan,
        append: Box<dyn Append>,
        classes: Option<&PathClasses>,
        (estimate, beams): (VolumeEstimate, BeamLength),
    ) -> Result<Self> {
        let media = VolumeOptions {
            has_classes: classes.is_some(),
            estimate,
            beams,
        };
        let (profile, bsdf) = (scene.profile(), scene.bsdf_features());
        let has_differentials = plan.follows_footprints;
        let emit = emission_spec!(photon_emit, scene, {
            sampler_kind: plan.sampler as u32,
            has_differentials,
            even_survival: plan.even_survival,
            ..Default::default()
        });
        let scatter = surface_spec!(photon_scatter, scene, {
            has_multiple_scattering: bsdf.multiple_scattering,
            separable_masking: false,
            has_alpha: profile.has_alpha(),
            sampler_kind: plan.sampler as u32,
            has_differentials,
            tells_caustics: plan.tells_caustics,
            stores_lights: plan.stores_lights,
            only_rough: plan.only_rough,
            carries_light_distance: plan.carries_light_distance,
            even_survival: plan.even_survival,
            has_media: profile.media.any(),
            has_classes: classes.is_some(),
            ..Default::default()
        });
        let wanted = plan.photons.next_multiple_of(WALK_GROUP);
        let slots = wanted.min(default_slots(gpu)).min(slots_of_device(gpu));
        let needs = WaveNeeds {
            waiting: true,
            media: profile.media.any(),
            airlight: false,
        };
        let options = WalkOptions {
            name: "photon",
            shadows: false,
            bounces: BOUNCES_PER_SUBMISSION,
            work: plan.submission_work,
            ..WalkOptions::default()
        };
        let differentials = if has_differentials { slots } else { 1 };
        let work = |name, bytes: usize| gpu.buffer(&BufferDesc::storage(name, bytes as u64, Category::Work));
        let quarters = append.quarters();
        let capacity = if plan.stores_lights || scene.has_diffuse_base() {
            (u64::from(plan.photons) * RECORDS_PER_PHOTON).min(records_of_device(gpu, quarters)) as u32
        } else {
            // None is deposited, but there is no buffer of nothing.
            1
        };
        let buffers = WaveBuffers::new(gpu, slots, needs)?;
        let volume = || VolumeTrace::new(gpu, &scene, &plan, media, slots);
        let has_volume = profile.media.any() && append.collisions().is_none();
        let volume = has_volume.then(volume).transpose()?;
        Ok(Self {
            walker: Walker::new(gpu, Arc::clone(&scene), buffers, options)?,
            kit: Kit {
                emit: gpu.compute_pipeline(&emit)?,
                scatter: gpu.compute_pipeline(&scatter)?,
                differentials: work(
                    "photon differentials",
                    size_of::<Differentials>() * differentials as usize,
                )?,
                counters: work("photon counters", size_of::<Counters>())?,
                counters_readback: gpu
                    .buffer(&BufferDesc::readback("photon counters", size_of::<Counters>() as u64))?,
                records: record_texels(gpu, capacity, quarters)?,
                capacity,
                emission: scene.emission_choice(gpu)?,
                glow: GlowStage::new(gpu, &scene, &plan)?,
                volume,
                classes: match classes {
                    Some(classes) => {
                        let words = gpu.buffer_with("photon classes", Category::Work, &classes.next)?;
                        Some((words, classes.next_in_media()))
                    }
                    None => None,
                },
                scene,
                stored: plan.stored,
                photons: plan.photons,
                carries_light_distance: plan.carries_light_distance,
                append,
            },
            gpu: gpu.clone(),
            plan,
        })
    }

    /// Forgets what it has learnt of earlier passes, but for the memory that they have needed.
    pub fn restart(&mut self) {
        if let Some(volume) = &mut self.kit.volume {
            volume.restart();
        }
    }

    /// Goes on with another seed.
    pub fn set_seed(&mut self, seed: u32) {
        self.plan.seed = seed;
    }

    /// The records of the last pass, in the order of waves, in each of bounces and photons.
    pub fn records(&self) -> &TexelView {
        &self.kit.records
    }

    /// The events in media of the last pass, in the same order; none in scenes without media.
    pub fn events(&self) -> Option<&TexelView> {
        self.kit.volume.as_ref().map(VolumeTrace::events)
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let kit = &self.kit;
        let mut all = vec![kit.emit.info(), kit.scatter.info()];
        all.extend(kit.glow.iter().map(GlowStage::pipeline));
        match &kit.volume {
            Some(volume) => all.extend(volume.pipelines()),
            None => all.push(kit.append.pipeline()),
        }
        all.extend(kit.append.collisions().map(CollisionStage::pipeline));
        all.extend(self.walker.trace_pipelines());
        all.extend(self.walker.compaction_pipelines());
        all
    }

    /// Traces the photons of a pass with kernels so made, if their deposits have some.
    pub fn trace(&mut self, pass: u32, kernel: Option<&KernelSettings>) -> Result<Traced> {
        let tracing = self.begin(pass, kernel);
        self.finish(tracing)
    }

    /// Traces the photons that are left of a pass.
    pub fn finish(&mut self, mut tracing: Tracing) -> Result<Traced> {
        while !self.advance(&mut tracing)? {}
        Ok(tracing.traced)
    }

    /// The photons of a pass before their first submission. A tracer has the memory of one pass: what was under way is given up.
    pub fn begin(&self, pass: u32, kernel: Option<&KernelSettings>) -> Tracing {
        Tracing {
            pass,
            kernel: kernel.copied(),
            event_kernel: None,
            path_share: 0.0,
            plane_share: 1.0,
            first_photon: 0,
            wave: None,
            traced: Traced::default(),
        }
    }

    /// One submission, a bounded piece of work; whether it was the last one of the pass.
    pub fn advance(&mut self, tracing: &mut Tracing) -> Result<bool> {
        if tracing.wave.is_none() {
            let photons = self
                .walker
                .buffers()
                .slots()
                .min(self.plan.photons - tracing.first_photon);
            let key = WalkKey {
                first_sequence: tracing.pass,
                first_index: tracing.first_photon,
                indices: photons,
                seed: self.plan.seed ^ PHOTON_SEED,
            };
            tracing.wave = Some((key, self.walker.begin(key, photons)?));
        }
        let Some((key, wave)) = &mut tracing.wave else {
            return Ok(true);
        };
        let mut stages = PhotonStages {
            kit: &self.kit,
            key: *key,
            first: tracing.traced.records,
            first_event: tracing.traced.events,
            kernel: tracing.kernel.as_ref(),
            event_kernel: tracing.event_kernel.as_ref(),
            path_share: tracing.path_share,
            plane_share: tracing.plane_share,
        };
        self.walker.advance(wave, &mut stages)?;
        tracing.traced.timings.append(&mut wave.take_timings());
        if wave.has_ended() {
            let photons = key.indices;
            let walked = wave.walked().clone();
            tracing.wave = None;
            return self.end_wave(tracing, photons, &walked);
        }
        Ok(false)
    }

    /// Counts a wave; whether it was the last one of the pass. Should its records not fit, the pass begins anew with room for them.
    fn end_wave(&mut self, tracing: &mut Tracing, photons: u32, walked: &Walked) -> Result<bool> {
        let counters = self.kit.counters_readback.read::<Counters>(0, 1)?[0];
        let traced = &mut tracing.traced;
        let volume = self.kit.volume.as_ref().map(VolumeTrace::counts).transpose()?;
        let [absorbed, events] = volume.unwrap_or_default();
        let collisions = self.kit.append.collisions().map(CollisionStage::counts).transpose()?;
        let collisions = collisions.unwrap_or_default();
        // What waits are the deposits with a kernel, and in scenes with media what comes from these besides.
        let records = match volume {
            Some(_) => counters.deposits - counters.without_kernel,
            None => u32::try_from(walked.waited).unwrap_or(u32::MAX),
        };
        traced.records = traced.records.saturating_add(records);
        traced.events = traced.events.saturating_add(events);
        traced.counts.events += u64::from(events) + u64::from(collisions.kept);
        traced.counts.collisions += walked.media.collisions;
        traced.counts.rays += walked.rays;
        traced.counts.escaped += u64::from(counters.escaped);
        traced.counts.absorbed += u64::from(counters.absorbed) + u64::from(absorbed) + u64::from(collisions.absorbed);
        traced.counts.deposits += u64::from(counters.deposits);
        traced.counts.without_kernel += u64::from(counters.without_kernel);
        tracing.first_photon += photons;
        if tracing.first_photon < self.plan.photons {
            return Ok(false);
        }
        traced.counts.emitted = u64::from(self.plan.photons);
        let events_fit = self
            .kit
            .volume
            .as_ref()
            .is_none_or(|volume| traced.events <= volume.capacity());
        if traced.records <= self.kit.capacity && events_fit {
            return Ok(true);
        }
        if let Some(volume) = self.kit.volume.as_mut().filter(|_| !events_fit) {
            volume.grow(&self.gpu, traced.events)?;
        }
        let quarters = self.kit.append.quarters();
        let (needed, most) = (u64::from(traced.records), records_of_device(&self.gpu, quarters));
        if needed > most {
            return Err(Error::Overflow {
                kernel: self.kit.append.name().into(),
                what: records_within_limit(&self.gpu, self.kit.append.records()),
                needed,
                capacity: most,
                instead: self.kit.append.fewer().into(),
            });
        }
        if traced.records > self.kit.capacity {
            let capacity = (needed + needed / 4).min(most) as u32;
            self.kit.records = record_texels(&self.gpu, capacity, quarters)?;
            self.kit.capacity = capacity;
        }
        let timings = std::mem::take(&mut traced.timings);
        *traced = Traced {
            timings,
            ..Traced::default()
        };
        tracing.first_photon = 0;
        Ok(false)
    }
}

impl Kit {
    /// What photons of light without a place carry, m²; 0 where none tell their light.
    fn placeless2(&self) -> f32 {
        let [lower, upper] = self.scene.bounds().map(|corner| corner.as_dvec3());
        if self.carries_light_distance {
            placeless_distance2(lower, upper) as f32
        } else {
            0.0
        }
    }

    fn wave_set(&self) -> PhotonWave<'_> {
        PhotonWave {
            photon_counters: self.counters.view(),
            photon_differentials: self.differentials.view(),
            photon_records: self.records.buffer().view(),
            photon_class_successors: self.classes.as_ref().map_or(&self.counters, |(words, _)| words).view(),
        }
    }
}

type Counters = photon_scatter::PhotonCounters;

/// What fluxes are multiplied by before they are stored: over the power of lights and of media that emit, so that a record's is about this. Records hold up to 65408,
/// with full precision down to 2⁻¹⁶; choices that share less than by power are within a factor of thirty.
const STORED_FLUX: f64 = 256.0;

/// See [`STORED_FLUX`].
pub(super) fn flux_scale(scene: &GpuScene) -> f64 {
    let power = scene.light_power() + scene.glow().map_or(0.0, |glow| glow.power);
    if power > 0.0 { STORED_FLUX / power } else { 1.0 }
}

/// Records of so many quarters that a buffer of the device can hold: 2²² of two where one has 128 MiB.
pub(super) fn records_of_device(gpu: &Gpu, of_record: u32) -> u64 {
    let caps = gpu.caps();
    let quarters = caps.max_texel_buffer_elements.min(caps.max_storage_buffer_range / 16);
    (quarters / u64::from(of_record)).min(u64::from(u32::MAX / 2))
}

/// What errors call records that are more than those: with the limit of the device's.
pub(super) fn records_within_limit(gpu: &Gpu, records: &str) -> String {
    let caps = gpu.caps();
    let by_texels = caps.max_texel_buffer_elements < caps.max_storage_buffer_range / 16;
    let limit = if by_texels {
        "maxTexelBufferElements"
    } else {
        "maxStorageBufferRange"
    };
    format!("{records} within {limit}")
}

fn record_texels(gpu: &Gpu, records: u32, of_record: u32) -> Result<TexelView> {
    let texels = u64::from(records) * u64::from(of_record);
    gpu.storage_texels("photon records", Category::Work, vk::Format::R32G32B32A32_UINT, texels)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "PM-PH-1",
        name: "photon tracing from every kind of light",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Unlit surfaces send no photons; of media that emit those without end must have a grid, and their bodies no more than 8,192 triangles.",
        sources: &[
            sources::JENSEN_2001.whole(),
            sources::FABIANOWSKI_2011.at("§3.4.1 and §5.2.3"),
            sources::VAN_OOSTEROM_STRACKEE_1983.whole(),
        ],
        shaders: &[
            "shaders/transport/emission.glsl",
            "shaders/transport/glow.glsl",
            "shaders/techniques/photon_mapping/photon_emit.comp",
            "shaders/techniques/photon_mapping/photon_glow.comp",
            "shaders/techniques/photon_mapping/photon_scatter.comp",
            "shaders/techniques/photon_mapping/photon_append.comp",
        ],
        tests: &[
            "tests/tests/photon/flux.rs::closed_rooms_keep_every_photon_and_lose_flux_by_reflection_alone",
            "tests/tests/photon/flux.rs::photons_that_leave_are_counted",
            "tests/tests/photon/flux.rs::spots_send_photons_into_their_cone_alone",
            "tests/tests/photon/flux.rs::photons_end_where_no_picture_asks_for_more",
            "tests/tests/photon/lights.rs::points_spots_and_suns_shine_as_they_should",
            "tests/tests/photon/lights.rs::lamps_and_skies_shine_as_they_should",
            "tests/tests/photon/materials.rs::walls_of_all_kinds_light_the_floor",
            "tests/tests/photon/materials.rs::walls_of_which_normals_fan_out_light_the_floor",
            "tests/tests/photon/materials.rs::lights_inside_a_body_that_absorbs_shine_through_it",
            "engine/src/transport/gpu_scene/bodies.rs::lights_know_which_body_is_around_them",
            "engine/src/transport/gpu_scene/glow.rs::tries_find_places_as_often_as_they_should",
            "tests/tests/photon/glow.rs::furnaces_stay_even_with_media_as_warm_as_their_walls",
            "tests/tests/photon/glow.rs::media_that_emit_agree_with_the_path_tracer",
            "tests/tests/photon/glow.rs::photons_of_media_carry_what_these_emit",
        ],
        settings: &["photons"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-PH-2",
        name: "random numbers of photons: Owen-scrambled Sobol' points, or independent",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Sobol' points are even in pairs of dimensions, so their gain fades with the bounces; the source's table of random numbers is a yardstick beside them.",
        sources: &[sources::OWEN_1995.whole(), sources::FABIANOWSKI_2011.at("§3.3.3")],
        shaders: &["shaders/transport/random.glsl"],
        tests: &[
            "tests/tests/photon/determinism.rs::runs_are_equal_and_seeds_are_not",
            "tests/tests/photon/sphere.rs::reflections_in_a_sphere_are_those_of_the_closed_form",
            "tests/tests/photon/sphere.rs::furnaces_are_uniform",
        ],
        settings: &["sampler"],
        ..Row::of(file!())
    },
];
