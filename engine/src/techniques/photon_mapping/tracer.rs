//! Photons from the lights through the scene, in waves like those of paths, to the records that a map is made of.
//!
//! Sources: H. W. Jensen, "Realistic Image Synthesis Using Photon Mapping", 2001, chapter 5; "Interactive Manycore Photon Mapping", PhD
//! thesis, Trinity College Dublin, 2011, §3.4.1 and §5.1. Stages: `photon_emit`, the path tracer's `path_extend`, `photon_scatter`, the path
//! tracer's compaction, `photon_append`.
//!
//! Guarantees: records depend on (seed, pass, number of photons) alone, and their order on the slots of a wave besides, never on the number of threads; photons that were
//! emitted have escaped or were absorbed, to the count; records that do not fit are never lost in silence, since the pass is traced again
//! with room for them.

use std::sync::Arc;

use super::kernel::KernelSettings;
use super::settings::PhotonSettings;
use crate::accel::trace::wide_counter;
use crate::card::{Role, Row, sources};
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::{PATH_GROUP, PHOTON_QUARTERS, STALLED_NOT};
use crate::gpu::shaders::sets::PhotonWave;
use crate::gpu::shaders::techniques::photon_mapping::{photon_append, photon_emit, photon_scatter};
use crate::gpu::shaders::types::{self, Differentials};
use crate::gpu::{Access, Buffer, BufferDesc, Category, ComputePipeline, Gpu, PipelineInfo, Recorder};
use crate::gpu::{TexelView, Timings};
use crate::techniques::path::PathTracerSettings;
use crate::techniques::path::pipelines::{TracePipelines, ray_quota, surface_spec};
use crate::techniques::path::stages::{Compaction, StallWatch, WaveKey, indirect, stage_barrier};
use crate::techniques::path::wave::{Status, WaveBuffers, WaveNeeds, default_slots, group_counts, slots_of_device};
use crate::transport::GpuScene;
use crate::{Error, Result};

/// Bounces recorded into one command buffer.
const BOUNCES_PER_SUBMISSION: usize = 8;
/// Records that there is room for at first, a photon.
const RECORDS_PER_PHOTON: u64 = 4;
/// Tells the photons' random numbers from those of eye paths.
const PHOTON_SEED: u32 = 0x7068_6f74;
/// Scatterings that photons are followed through at most, so that none is followed for ever between lossless surfaces.
const BOUNCES_MAX: u32 = 4096;

/// Exact counts of a pass, or of several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct PhotonCounts {
    /// Photons emitted.
    pub emitted: u64,
    /// Photons that left the scene.
    pub escaped: u64,
    /// Photons that ended on a surface: by roulette, where nothing is scattered, or after the last bounce.
    pub absorbed: u64,
    /// Rays traced.
    pub rays: u64,
    /// Hits that were to be stored.
    pub deposits: u64,
    /// Those that were not, since their footprint is degenerate.
    pub without_kernel: u64,
}

impl std::ops::AddAssign for PhotonCounts {
    fn add_assign(&mut self, other: Self) {
        self.emitted += other.emitted;
        self.escaped += other.escaped;
        self.absorbed += other.absorbed;
        self.rays += other.rays;
        self.deposits += other.deposits;
        self.without_kernel += other.without_kernel;
    }
}

/// What is stored of photons: those scattered at least and at most so often before they land.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stored {
    pub first_bounce: u32,
    pub last_bounce: u32,
}

/// Photons of one pass.
pub(super) struct Traced {
    /// Records in [`PhotonTracer::records`].
    pub records: u32,
    pub counts: PhotonCounts,
    pub timings: Vec<Timings>,
}

/// Traces photons of a scene.
pub(super) struct PhotonTracer {
    gpu: Gpu,
    scene: Arc<GpuScene>,
    settings: PhotonSettings,
    stored: Stored,
    paths: PathTracerSettings,
    emit: ComputePipeline<photon_emit::Kernel>,
    trace: TracePipelines,
    resume: Option<TracePipelines>,
    scatter: ComputePipeline<photon_scatter::Kernel>,
    compaction: Compaction,
    append: ComputePipeline<photon_append::Kernel>,
    buffers: WaveBuffers,
    slots: u32,
    differentials: Buffer,
    counters: Buffer,
    counters_readback: Buffer,
    records: TexelView,
    capacity: u32,
}

impl PhotonTracer {
    pub fn new(gpu: &Gpu, scene: Arc<GpuScene>, settings: &PhotonSettings, stored: Stored) -> Result<Self> {
        let (profile, bsdf) = (scene.profile(), scene.bsdf_features());
        let paths = PathTracerSettings::default();
        let has_differentials = settings.follows_footprints();
        let emit = photon_emit::Spec {
            has_textures: profile.has_textures,
            has_vertex_colors: profile.has_vertex_colors,
            has_shading_normals: false,
            has_normal_maps: false,
            has_unlit: false,
            has_alpha: profile.has_alpha(),
            has_environment: profile.has_environment(),
            has_area_lights: scene.has_area_lights(),
            has_punctual_lights: scene.has_punctual_lights(),
            sampler_kind: settings.sampler as u32,
            has_differentials,
            ..Default::default()
        };
        let scatter = surface_spec!(photon_scatter, scene, {
            has_multiple_scattering: bsdf.multiple_scattering,
            separable_masking: false,
            has_alpha: profile.has_alpha(),
            sampler_kind: settings.sampler as u32,
            has_differentials,
            tells_caustics: settings.final_gather,
            ..Default::default()
        });
        let wanted = settings.photons.next_multiple_of(PATH_GROUP);
        let slots = wanted.min(default_slots(gpu)).min(slots_of_device(gpu));
        let needs = WaveNeeds {
            lights: true,
            media: false,
            airlight: false,
        };
        let differentials = if has_differentials { slots } else { 1 };
        let work = |name, bytes: usize| gpu.buffer(&BufferDesc::storage(name, bytes as u64, Category::Work));
        let capacity = (u64::from(settings.photons) * RECORDS_PER_PHOTON).min(records_of_device(gpu)) as u32;
        Ok(Self {
            emit: gpu.compute_pipeline(&emit)?,
            trace: TracePipelines::new(gpu, &scene, &paths, false)?,
            resume: None,
            scatter: gpu.compute_pipeline(&scatter)?,
            compaction: Compaction::new(gpu)?,
            append: gpu.compute_pipeline(&())?,
            buffers: WaveBuffers::new(gpu, slots, needs, false)?,
            slots,
            differentials: work(
                "photon differentials",
                size_of::<Differentials>() * differentials as usize,
            )?,
            counters: work("photon counters", size_of::<Counters>())?,
            counters_readback: gpu.buffer(&BufferDesc::readback("photon counters", size_of::<Counters>() as u64))?,
            records: record_texels(gpu, capacity)?,
            capacity,
            gpu: gpu.clone(),
            scene,
            settings: settings.clone(),
            stored,
            paths,
        })
    }

    /// Goes on with another seed.
    pub fn set_seed(&mut self, seed: u32) {
        self.settings.seed = seed;
    }

    /// The records of the last pass, in the order of waves, in each of bounces and photons.
    pub fn records(&self) -> &TexelView {
        &self.records
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = vec![self.emit.info(), self.scatter.info(), self.append.info()];
        all.push(self.trace.info()[0].clone());
        all.extend(self.compaction.info());
        all
    }

    /// Traces the photons of a pass with kernels so made.
    pub fn trace(&mut self, pass: u32, kernel: &KernelSettings) -> Result<Traced> {
        loop {
            let traced = self.trace_within(pass, kernel)?;
            if traced.records <= self.capacity {
                return Ok(traced);
            }
            let (needed, most) = (u64::from(traced.records), records_of_device(&self.gpu));
            if needed > most {
                return Err(Error::Overflow {
                    kernel: "photon_append".into(),
                    what: "photon records".into(),
                    needed,
                    capacity: most,
                    instead: "trace fewer photons a pass".into(),
                });
            }
            let capacity = (needed + needed / 4).min(most) as u32;
            self.records = record_texels(&self.gpu, capacity)?;
            self.capacity = capacity;
        }
    }

    /// The same; records that do not fit are counted only.
    fn trace_within(&mut self, pass: u32, kernel: &KernelSettings) -> Result<Traced> {
        let mut traced = Traced {
            records: 0,
            counts: PhotonCounts::default(),
            timings: Vec::new(),
        };
        let mut first_photon = 0;
        while first_photon < self.settings.photons {
            let photons = self.slots.min(self.settings.photons - first_photon);
            self.trace_wave(pass, first_photon, photons, kernel, &mut traced)?;
            first_photon += photons;
        }
        traced.counts.emitted = u64::from(self.settings.photons);
        Ok(traced)
    }

    fn trace_wave(
        &mut self,
        pass: u32,
        first_photon: u32,
        photons: u32,
        kernel: &KernelSettings,
        traced: &mut Traced,
    ) -> Result<()> {
        let key = WaveKey {
            first_pixel: pass,
            first_sample: first_photon,
            sample_count: photons,
            seed: self.settings.seed ^ PHOTON_SEED,
        };
        let mut status = Status {
            active_count: photons,
            ..Status::default()
        };
        let mut watch = StallWatch::new(ray_quota(&self.gpu, &self.scene, &self.paths)?);
        let mut begins = true;
        while status.active_count > 0 || status.stalled != STALLED_NOT {
            let before = status.rounds;
            let first = traced.records;
            traced
                .timings
                .push(self.submit(&key, &mut status, begins, first, kernel)?);
            begins = false;
            let stands = status.stalled != STALLED_NOT && status.rounds == before;
            watch.submitted(stands)?;
        }
        let counters = self.counters_readback.read::<Counters>(0, 1)?[0];
        // Those of the queue are the deposits with a kernel: one word holds a wave's.
        traced.records = traced.records.saturating_add(status.shadow_rays[0]);
        traced.counts.rays += wide_counter(status.extend_rays);
        traced.counts.escaped += u64::from(counters.escaped);
        traced.counts.absorbed += u64::from(counters.absorbed);
        traced.counts.deposits += u64::from(counters.deposits);
        traced.counts.without_kernel += u64::from(counters.without_kernel);
        Ok(())
    }

    /// Some bounces of a wave, the first ones with its emission; `first` is the record of its first deposit.
    fn submit(
        &mut self,
        key: &WaveKey,
        status: &mut Status,
        begins: bool,
        first: u32,
        kernel: &KernelSettings,
    ) -> Result<Timings> {
        let stalled = status.stalled != STALLED_NOT;
        if stalled && self.resume.is_none() {
            self.resume = Some(TracePipelines::new(&self.gpu, &self.scene, &self.paths, true)?);
        }
        let groups = group_counts(status.active_count);
        (status.item_groups, status.chunk_groups, status.scatter_groups) = (groups[0], groups[1], groups[1]);
        (status.shadow_groups, status.shadow_count) = ([0, 1, 1], 0);
        (status.stalled, status.unfinished) = (STALLED_NOT, 0);
        let mut recorder = self.gpu.recorder("photon wave")?;
        recorder.pass("photon: begin", |pass| {
            pass.update(self.buffers.status.view(), &[*status])?;
            if begins {
                pass.fill(self.counters.view(), 0)?;
            }
            pass.memory_barrier(
                Access::TRANSFER_WRITE | Access::COMPUTE,
                Access::COMPUTE | Access::INDIRECT_READ,
            );
            Ok(())
        })?;
        if begins {
            self.record_emit(&mut recorder, key)?;
        }
        for bounce in 0..BOUNCES_PER_SUBMISSION {
            let resumed = self.resume.as_ref().filter(|_| stalled && bounce == 0);
            let parity = (status.rounds as usize + bounce) % 2;
            self.record_bounce(
                &mut recorder,
                key,
                parity,
                resumed.unwrap_or(&self.trace),
                first,
                kernel,
            )?;
        }
        recorder.pass("photon: read status", |pass| {
            pass.memory_barrier(Access::COMPUTE, Access::TRANSFER_READ);
            pass.copy(
                self.buffers.status.slice(0, size_of::<Status>() as u64),
                self.buffers.readback.view(),
            )?;
            pass.copy(self.counters.view(), self.counters_readback.view())
        })?;
        let timings = recorder.submit()?.wait()?;
        *status = self.buffers.readback.read::<Status>(0, 1)?[0];
        Ok(timings)
    }

    fn wave_set(&self) -> PhotonWave<'_> {
        PhotonWave {
            photon_counters: self.counters.view(),
            photon_differentials: self.differentials.view(),
            // The memory of shadow rays, which photons have none of.
            photon_deposits_out: self.buffers.shadow_rays.buffer().view(),
            photon_deposits_in: &self.buffers.shadow_rays,
            photon_records: self.records.buffer().view(),
        }
    }

    fn record_emit(&self, recorder: &mut Recorder, key: &WaveKey) -> Result<()> {
        let [lower, upper] = self.scene.bounds();
        let push = photon_emit::Push {
            scene_lower: lower.to_array(),
            first_pixel: key.first_pixel,
            scene_upper: upper.to_array(),
            first_sample: key.first_sample,
            sample_count: key.sample_count,
            seed: key.seed,
            radius: 0.5 * (upper - lower).length(),
        };
        recorder.pass("photon: emit", |pass| {
            let groups = [self.emit.groups_for(key.sample_count), 1, 1];
            // Its output is the input of the first bounce, whose parity is 0.
            let paths = self.buffers.set(1);
            pass.dispatch(
                &self.emit,
                &[&paths, &self.scene.scene_set(), &self.wave_set()],
                &push,
                groups,
            )?;
            stage_barrier(pass);
            Ok(())
        })
    }

    fn record_bounce(
        &self,
        recorder: &mut Recorder,
        key: &WaveKey,
        parity: usize,
        trace: &TracePipelines,
        first: u32,
        kernel: &KernelSettings,
    ) -> Result<()> {
        let paths = self.buffers.set(parity);
        let items = indirect(&self.buffers, std::mem::offset_of!(Status, item_groups));
        let [lower, upper] = self.scene.bounds();
        recorder.pass("photon: extend", |pass| {
            trace.record_extend(pass, &self.scene, &paths, &self.buffers.media_set(), *key, items)
        })?;
        let push = photon_scatter::Push {
            scene_lower: lower.to_array(),
            first_pixel: key.first_pixel,
            scene_upper: upper.to_array(),
            first_sample: key.first_sample,
            sample_count: key.sample_count,
            seed: key.seed,
            first_deposit: self.stored.first_bounce,
            last_bounce: self.stored.last_bounce.min(BOUNCES_MAX),
            flux_scale: flux_scale(&self.scene) as f32,
            kernel: types::KernelSettings {
                shape: kernel.shape as u32,
                spread: kernel.spread as f32,
                exponent: kernel.exponent as f32,
                unit_length: kernel.unit_length as f32,
                length_min: kernel.length_min as f32,
                length_max: kernel.length_max as f32,
                flatness: kernel.flatness as f32,
                widens_flat: u32::from(kernel.widens_flat),
            },
        };
        let wave = self.wave_set();
        recorder.pass("photon: scatter", |pass| {
            pass.dispatch_indirect(&self.scatter, &[&paths, &self.scene.scene_set(), &wave], &push, items)?;
            stage_barrier(pass);
            Ok(())
        })?;
        recorder.pass("photon: compact", |pass| {
            self.compaction.record(pass, &self.buffers, &paths)
        })?;
        recorder.pass("photon: append", |pass| {
            let groups = indirect(&self.buffers, std::mem::offset_of!(Status, shadow_groups));
            let push = photon_append::Push {
                first,
                capacity: self.capacity,
            };
            pass.dispatch_indirect(&self.append, &[&paths, &wave], &push, groups)?;
            stage_barrier(pass);
            Ok(())
        })
    }
}

type Counters = photon_scatter::PhotonCounters;

/// What fluxes are multiplied by before they are stored: over the lights' power, so that a record's is about this. Records hold up to 65408,
/// with full precision down to 2⁻¹⁶; choices that share less than by power are within a factor of thirty.
const STORED_FLUX: f64 = 256.0;

/// See [`STORED_FLUX`].
pub(super) fn flux_scale(scene: &GpuScene) -> f64 {
    let power = scene.light_power();
    if power > 0.0 { STORED_FLUX / power } else { 1.0 }
}

/// Records that a buffer of the device can hold.
fn records_of_device(gpu: &Gpu) -> u64 {
    let caps = gpu.caps();
    let quarters = caps.max_texel_buffer_elements.min(caps.max_storage_buffer_range / 16);
    (quarters / u64::from(PHOTON_QUARTERS)).min(u64::from(u32::MAX / 2))
}

fn record_texels(gpu: &Gpu, records: u32) -> Result<TexelView> {
    let texels = u64::from(records) * u64::from(PHOTON_QUARTERS);
    gpu.storage_texels("photon records", Category::Work, vk::Format::R32G32B32A32_UINT, texels)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "PM-PH-1",
        name: "photon tracing on surfaces, from every kind of light",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Surfaces only; unlit surfaces send no photons.",
        sources: &[
            sources::JENSEN_2001.whole(),
            sources::FABIANOWSKI_2011.at("§3.4.1 and §5.2.3"),
        ],
        shaders: &[
            "shaders/techniques/photon_mapping/photon_emit.comp",
            "shaders/techniques/photon_mapping/photon_scatter.comp",
            "shaders/techniques/photon_mapping/photon_append.comp",
        ],
        tests: &[
            "tests/tests/photon/flux.rs::closed_rooms_keep_every_photon_and_lose_flux_by_reflection_alone",
            "tests/tests/photon/flux.rs::photons_that_leave_are_counted",
            "tests/tests/photon/lights.rs::points_spots_and_suns_shine_as_they_should",
            "tests/tests/photon/lights.rs::lamps_and_skies_shine_as_they_should",
            "tests/tests/photon/materials.rs::walls_of_all_kinds_light_the_floor",
            "tests/tests/photon/determinism.rs::runs_are_equal_and_seeds_are_not",
        ],
        experiment: "clerestory report photon-statistics photon-frame",
        ..Row::of(file!())
    },
    Row {
        id: "PM-PH-2",
        name: "random numbers of photons: Owen-scrambled Sobol' points, or independent",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Sobol' points are even in pairs of dimensions, so that their gain fades with the bounces.",
        sources: &[sources::OWEN_1995.whole(), sources::FABIANOWSKI_2011.at("§3.3.3")],
        shaders: &["shaders/transport/random.glsl"],
        tests: &[
            "tests/tests/photon/determinism.rs::runs_are_equal_and_seeds_are_not",
            "tests/tests/photon/sphere.rs::reflections_in_a_sphere_are_those_of_the_closed_form",
        ],
        experiment: "clerestory report photon-settings",
        ..Row::of(file!())
    },
];
