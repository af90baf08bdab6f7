//! Photons through media: the stages of a tracer that scenes with media have besides.
//!
//! Stages: `photon_medium` before photons are scattered by surfaces, and in the place of what appends a surface's deposits `photon_volume_flags`, prefix sums and
//! `photon_volume_append`.

use super::VolumeEstimate;
use super::event::{EventWords, MEDIUM_WORD};
use super::footprint::EventKernelSettings;
use super::plane::WideWords;
use super::ways::BeamLength;
use crate::gpu::ash::vk;
use crate::gpu::interface::BindingSet;
use crate::gpu::shaders::constants::{EVENT_MEDIUM_MASK, NO_MEDIUM};
use crate::gpu::shaders::sets::{PhotonVolumeSet, PhotonWave};
use crate::gpu::shaders::techniques::photon_mapping::{photon_medium, photon_volume_append, photon_volume_flags};
use crate::gpu::shaders::types;
use crate::gpu::{Access, Buffer, BufferDesc, Category, ComputePipeline, Gpu, Pass, PipelineInfo, TexelView};
use crate::kernels::{Count, Scan, ScanBuffers, ScanOptions};
use crate::techniques::photon_mapping::PhotonPlan;
use crate::techniques::photon_mapping::tracer::{records_of_device, records_within_limit};
use crate::transport::GpuScene;
use crate::walk::{Bounce, WalkKey, stage_barrier};
use crate::{Error, Result};

/// Events that there is room for at first, a photon.
const EVENTS_PER_PHOTON: u64 = 4;
/// Pieces that a way is stored in, at most: long ones have wide boxes. Fewer where a device cannot hold as many.
const WAY_PIECES: u32 = 32;

const _: () = assert!(MEDIUM_WORD < 4 && size_of::<EventWords>() <= 32 && size_of::<WideWords>() <= 48);

/// What the stages are told beside the wave.
#[derive(Debug, Clone, Copy)]
pub(in crate::techniques::photon_mapping) struct VolumePass {
    pub key: WalkKey,
    pub first_deposit: u32,
    pub last_bounce: u32,
    /// Of fluxes as they are stored.
    pub flux_scale: f32,
    /// About how long pieces of ways are, m.
    pub piece: f32,
    /// Successors of classes by scattering in media, where photons have some.
    pub classes: [u32; 2],
    pub kernel: Option<EventKernelSettings>,
    /// Radius of kernels over the mean free path of their medium where it is densest, at most; 0 for any.
    pub path_share: f32,
    /// Share of ways that have planes.
    pub plane_share: f32,
    /// No two places of a body are farther apart, m.
    pub body_reach: f32,
}

/// What photons in media are specialized to.
#[derive(Debug, Clone, Copy)]
pub(in crate::techniques::photon_mapping) struct VolumeOptions {
    /// The path set is an expression.
    pub has_classes: bool,
    /// What is stored.
    pub estimate: VolumeEstimate,
    /// Of ways.
    pub beams: BeamLength,
}

/// Where records of a wave begin, and how many there is room for.
#[derive(Debug, Clone, Copy)]
pub(in crate::techniques::photon_mapping) struct Room {
    pub first: u32,
    pub capacity: u32,
}

type Counters = photon_medium::PhotonMediumCounters;

/// The stages, with their memory.
pub(in crate::techniques::photon_mapping) struct VolumeTrace {
    medium: ComputePipeline<photon_medium::Kernel>,
    flags: ComputePipeline<photon_volume_flags::Kernel>,
    append: ComputePipeline<photon_volume_append::Kernel>,
    scan: Scan,
    counters: Buffer,
    counters_readback: Buffer,
    queue: Buffer,
    waiting: Buffer,
    flag_words: Buffer,
    ranks: Buffer,
    scratch: Buffer,
    /// Only where ways are stored: flags and ranks of deposits on surfaces, and the ways by place.
    ways: Option<[Buffer; 3]>,
    /// Only where other records are stored beside ways: those that wait, by place.
    beside: Option<Buffer>,
    /// Of a record.
    quarters: u32,
    events: TexelView,
    capacity: u32,
    pieces_most: u32,
    /// Ways are stored, and there are media that they are stored in.
    has_pieces: bool,
    slots: u32,
}

impl VolumeTrace {
    /// For waves of up to `slots` photons.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], [`Error::LimitExceeded`] for media of numbers that records cannot hold.
    pub fn new(gpu: &Gpu, scene: &GpuScene, plan: &PhotonPlan, options: VolumeOptions, slots: u32) -> Result<Self> {
        let estimate = options.estimate;
        let (stores_ways, stores_planes) = (estimate.stores_ways(), estimate.stores_planes());
        let stores_points = estimate.stores_points();
        let quarters = estimate.quarters();
        let profile = scene.profile();
        let media = profile.media.count as u64;
        if media > u64::from(EVENT_MEDIUM_MASK) {
            return Err(Error::LimitExceeded {
                name: "media".into(),
                value: media,
                limit_name: "EVENT_MEDIUM_MASK",
                limit: EVENT_MEDIUM_MASK.into(),
            });
        }
        let medium = photon_medium::Spec {
            has_absorption: profile.has_absorption,
            has_instances: profile.keeps_instances,
            has_grids: profile.media.heterogeneous,
            has_homogeneous: profile.media.homogeneous,
            sampler_kind: plan.sampler as u32,
            has_differentials: plan.follows_footprints,
            has_classes: options.has_classes,
            carries_light_distance: plan.carries_light_distance,
            short_ways: options.beams == BeamLength::Short,
            stores_ways,
            stores_planes,
            stores_points,
            ..Default::default()
        };
        let work = |name: &str, bytes: u64| gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work));
        let words = |name: &str| work(name, u64::from(slots) * size_of::<u32>() as u64);
        let scan = Scan::new(gpu, ScanOptions::default())?;
        let bytes = size_of::<Counters>() as u64;
        let capacity = (u64::from(plan.photons) * EVENTS_PER_PHOTON).min(records_of_device(gpu, quarters)) as u32;
        Ok(Self {
            medium: gpu.compute_pipeline(&medium)?,
            flags: gpu.compute_pipeline(&photon_volume_flags::Spec {
                stores_ways,
                stores_planes,
                stores_points,
            })?,
            append: gpu.compute_pipeline(&photon_volume_append::Spec {
                stores_ways,
                stores_planes,
                stores_points,
            })?,
            beside: estimate
                .stores_beside()
                .then(|| work("photons beside ways", u64::from(slots) * size_of::<WideWords>() as u64))
                .transpose()?,
            ways: if stores_ways {
                let bytes = u64::from(slots) * size_of::<types::PhotonWay>() as u64;
                Some([
                    words("photon landed flags")?,
                    words("photon landed ranks")?,
                    work("photon ways", bytes)?,
                ])
            } else {
                None
            },
            counters: work("photon medium counters", bytes)?,
            counters_readback: gpu.buffer(&BufferDesc::readback("photon medium counters", bytes))?,
            queue: work(
                "photon volume queue",
                size_of::<photon_volume_flags::PhotonVolumeQueue>() as u64,
            )?,
            waiting: work("photon volume waiting", size_of::<u32>() as u64)?,
            flag_words: words("photon volume flags")?,
            ranks: words("photon volume ranks")?,
            scratch: work("photon volume scan", scan.scratch_bytes(slots))?,
            events: event_texels(gpu, capacity, quarters)?,
            quarters,
            capacity,
            pieces_most: WAY_PIECES,
            has_pieces: stores_ways && profile.media.homogeneous,
            slots,
            scan,
        })
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        vec![self.medium.info(), self.flags.info(), self.append.info()]
    }

    /// The events of the last pass, in the order of waves, in each of bounces and photons.
    pub fn events(&self) -> &TexelView {
        &self.events
    }

    fn set<'a>(&'a self, differentials: &'a Buffer) -> PhotonVolumeSet<'a> {
        let of_ways = |index: usize| self.ways.as_ref().map_or(&self.counters, |ways| &ways[index]).view();
        PhotonVolumeSet {
            photon_medium_counters: self.counters.view(),
            photon_volume_queue: self.queue.view(),
            photon_volume_waiting: self.waiting.view(),
            photon_volume_flags: self.flag_words.view(),
            photon_volume_ranks: self.ranks.view(),
            photon_volume_records: self.events.buffer().view(),
            photon_medium_differentials: differentials.view(),
            photon_landed_flags: of_ways(0),
            photon_landed_ranks: of_ways(1),
            photon_ways: of_ways(2),
            photon_beside: self.beside.as_ref().unwrap_or(&self.counters).view(),
        }
    }

    /// Before a wave.
    pub fn reset(&self, pass: &mut Pass<'_>) -> Result<()> {
        pass.fill(self.counters.view(), 0)?;
        pass.fill(self.queue.view(), 0)
    }

    /// What becomes of photons on their ways through media.
    pub fn record_medium(
        &self,
        pass: &mut Pass<'_>,
        bounce: &Bounce<'_>,
        scene: &GpuScene,
        differentials: &Buffer,
        told: VolumePass,
    ) -> Result<()> {
        let kernel = told
            .kernel
            .map_or_else(Default::default, |kernel| types::EventKernelSettings {
                spread: kernel.spread as f32,
                dampening: kernel.dampening as f32,
                unit_length: kernel.unit_length as f32,
                length_min: kernel.length_min as f32,
                length_max: kernel.length_max as f32,
            });
        let push = photon_medium::Push {
            key: told.key,
            surrounding: scene.surrounding().unwrap_or(NO_MEDIUM),
            last_bounce: told.last_bounce,
            first_deposit: told.first_deposit,
            flux_scale: told.flux_scale,
            piece: told.piece,
            pieces_most: self.pieces_most,
            classes: told.classes,
            plane_share: told.plane_share,
            body_reach: told.body_reach,
            path_share: told.path_share,
            kernel,
        };
        let (set, of_scene, media) = (self.set(differentials), scene.scene_set(), scene.media_set());
        let sets: [&dyn BindingSet<'_>; 4] = [&bounce.wave, &set, &of_scene, &media];
        pass.dispatch_indirect(&self.medium, &sets, &push, bounce.places.items)?;
        stage_barrier(pass);
        Ok(())
    }

    /// The deposits that wait go behind the earlier ones of their kinds.
    pub fn record_append(
        &self,
        pass: &mut Pass<'_>,
        bounce: &Bounce<'_>,
        differentials: &Buffer,
        photons: &PhotonWave<'_>,
        [surfaces, events]: [Room; 2],
    ) -> Result<()> {
        // Should nothing wait, what the bounce before has left must not be taken for this one's.
        pass.memory_barrier(Access::COMPUTE | Access::INDIRECT_READ, Access::TRANSFER_WRITE);
        pass.update(self.waiting.view(), &[0u32])?;
        pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE | Access::INDIRECT_READ);
        let (set, wave) = (self.set(differentials), &bounce.wave);
        pass.dispatch_indirect(&self.flags, &[wave, &set], &(), bounce.places.waiting)?;
        stage_barrier(pass);
        let words = ScanBuffers {
            input: self.flag_words.view(),
            heads: None,
            output: self.ranks.view(),
        };
        let count = Count::Device {
            view: self.waiting.view(),
            capacity: self.slots,
        };
        self.scan.record(pass, &words, count, &self.scratch)?;
        stage_barrier(pass);
        if let Some([flags, ranks, _]) = &self.ways {
            let words = ScanBuffers {
                input: flags.view(),
                heads: None,
                output: ranks.view(),
            };
            self.scan.record(pass, &words, count, &self.scratch)?;
            stage_barrier(pass);
        }
        let push = photon_volume_append::Push {
            first: surfaces.first,
            capacity: surfaces.capacity,
            first_event: events.first,
            event_capacity: events.capacity,
        };
        pass.dispatch_indirect(&self.append, &[wave, &set, photons], &push, bounce.places.waiting)?;
        stage_barrier(pass);
        Ok(())
    }

    pub fn read_back(&self, pass: &mut Pass<'_>) -> Result<()> {
        pass.copy(self.counters.view(), self.counters_readback.view())
    }

    /// Of the last wave: photons that collisions have ended, and collisions that were stored.
    pub fn counts(&self) -> Result<[u32; 2]> {
        let counters = self.counters_readback.read::<Counters>(0, 1)?[0];
        Ok([counters.absorbed, counters.events])
    }

    /// Events that there is room for.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Ways have all their pieces again, whatever there has been room for: another beginning is that of another mapper.
    pub fn restart(&mut self) {
        self.pieces_most = WAY_PIECES;
    }

    /// Makes room for so many events, or for half the pieces of each way where the device cannot hold as many.
    ///
    /// # Errors
    /// [`Error::Overflow`] for more collisions or whole ways than the device can hold, [`Error::OutOfMemory`].
    pub fn grow(&mut self, gpu: &Gpu, needed: u32) -> Result<()> {
        let most = records_of_device(gpu, self.quarters);
        let mut needed = needed;
        if u64::from(needed) > most && self.has_pieces && self.pieces_most > 1 {
            self.pieces_most /= 2;
            needed = most as u32;
        }
        if u64::from(needed) > most {
            return Err(Error::Overflow {
                kernel: "photon_volume_append".into(),
                what: records_within_limit(gpu, "photon events"),
                needed: needed.into(),
                capacity: most,
                instead: "trace fewer photons per pass: setting `photons`".into(),
            });
        }
        let capacity = (u64::from(needed) + u64::from(needed / 4)).min(most) as u32;
        self.events = event_texels(gpu, capacity, self.quarters)?;
        self.capacity = capacity;
        Ok(())
    }
}

fn event_texels(gpu: &Gpu, events: u32, of_record: u32) -> Result<TexelView> {
    let texels = u64::from(events) * u64::from(of_record);
    gpu.storage_texels("photon events", Category::Work, vk::Format::R32G32B32A32_UINT, texels)
}
