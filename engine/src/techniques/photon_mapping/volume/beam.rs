//! What eye paths see of a volume map along their ways through media: the first part of the stage between arrival and scattering, in scenes with media.
//!
//! Rays ask by themselves or a subgroup's together, at every place of a wave or from a queue of those that do (B. Fabianowski, "Interactive Manycore Photon
//! Mapping", PhD thesis, Trinity College Dublin, 2011, §7.4): each one's sum has the order of the map's leaves, and the same bits. So it has where one kernel finds a ray's hit, its way
//! and what is seen along it.

use std::sync::OnceLock;

use super::VolumeEstimate;
use super::map::EventMap;
use super::plane_rays::PlaneRays;
use super::transmittance::VolumeTransmittance;
use super::ways::BeamLength;
use crate::accel::DeviceTraversal;
use crate::gpu::interface::BindingSet;
use crate::gpu::shaders::constants::{
    LOBE_VOLUME, NO_MEDIUM, PATH_SET_DEAD, PATH_SET_STATE_BITS, QUEUE_SLOTS, WALK_GROUP, WAY_STEPS,
};
use crate::gpu::shaders::sets::{PhotonBeamSet, WaveSet};
use crate::gpu::shaders::techniques::photon_mapping::{
    photon_beam, photon_beam_fused, photon_beam_packet, photon_beam_ways,
};
use crate::gpu::shaders::types::{AskSettings, BeamWay};
use crate::gpu::{
    Buffer, BufferDesc, BufferView, Category, ComputePipeline, Gpu, Pass, PipelineInfo, Recorder, wide_counter,
};
use crate::techniques::path::PhotonRadii;
use crate::techniques::photon_mapping::gather::{GatherCounts, RayFetches};
use crate::techniques::photon_mapping::path_classes::{ASKING_STATES, PathClasses};
use crate::techniques::photon_mapping::queue::{AskSpec, Queue, QueueMemory};
use crate::techniques::photon_mapping::settings::{MapQuery, MapStages, PhotonSettings};
use crate::transport::{GpuScene, PathSet};
use crate::walk::{Places, RAY_QUOTA, WalkKey, default_slots, ray_quota, stage_barrier, work_least};
use crate::{Error, Result};

/// Nodes and events of a query, at most: beside a walk through a grid, its loops stay below [`SOFTWARE_LOOP_CAP`](crate::gpu::SOFTWARE_LOOP_CAP).
const BEAM_QUOTA: u32 = 32_768;
/// The same where the kernel has found the ray's hit before, whose lanes may take turns as those of walks do; the stages ask for the rest.
const FUSED_QUOTA: u32 = 12_288;
/// Bytes of a way, of how far a slot has asked, and of the steps of a walk through a grid, or of its table.
const WAY_BYTES: u64 = size_of::<BeamWay>() as u64;
const ASKED_BYTES: u64 = size_of::<f32>() as u64;
const STEPS_BYTES: u64 = WAY_STEPS as u64 * size_of::<[f32; 4]>() as u64;
/// Alignment of what is bound that every device takes.
const BINDING_BYTES: u64 = 256;
/// Waves are of whole workgroups.
const _: () = assert!(
    (WAY_BYTES * WALK_GROUP as u64).is_multiple_of(BINDING_BYTES)
        && (ASKED_BYTES * WALK_GROUP as u64).is_multiple_of(BINDING_BYTES)
);

type Counters = photon_beam::BeamCounters;

/// Each ray by itself, or those of a subgroup together.
enum Query {
    Single(ComputePipeline<photon_beam::Kernel>),
    Packet(ComputePipeline<photon_beam_packet::Kernel>),
}

/// The kernels, with what they keep of ways.
pub(in crate::techniques::photon_mapping) struct Beam {
    gpu: Gpu,
    query: Query,
    queue: Queue,
    /// Finds hits of rays, too, in place of the walker's stage.
    fused: Option<ComputePipeline<photon_beam_fused::Kernel>>,
    /// Finds the ways before the queue is filled; without one queries do.
    way_finder: Option<ComputePipeline<photon_beam_ways::Kernel>>,
    /// For places that a quota stopped: made when it is first needed.
    linear: (Box<photon_beam::Spec>, OnceLock<ComputePipeline<photon_beam::Kernel>>),
    kept: KeptWays,
    /// Only where the map has planes.
    planes: Option<PlaneRays>,
    counters: Buffer,
    counters_readback: Buffer,
    /// Of eye paths that ask at all, and that ask in media, a bit each.
    states: u32,
    volume_states: u32,
    bounces: [u32; 2],
    /// Of a pass.
    photons: u32,
    /// [`PathClasses::asks`].
    classes: [u32; ASKING_STATES],
}

/// What is kept of the ways of a wave, by place or slot, one behind the other.
struct KeptWays {
    memory: Buffer,
    slots: u64,
    has_grids: bool,
}

impl KeptWays {
    fn ways(&self) -> BufferView<'_> {
        self.memory.slice(0, WAY_BYTES * self.slots)
    }

    /// How far slots have asked; some other memory where there are no grids.
    fn asked(&self) -> BufferView<'_> {
        if !self.has_grids {
            return self.ways();
        }
        self.memory.slice(WAY_BYTES * self.slots, ASKED_BYTES * self.slots)
    }

    /// What is left of light along ways; some other memory where there are no grids.
    fn steps(&self) -> BufferView<'_> {
        if !self.has_grids {
            return self.ways();
        }
        let first = (WAY_BYTES + ASKED_BYTES) * self.slots;
        self.memory.slice(first, STEPS_BYTES * self.slots)
    }
}

/// Queries of one map, to be recorded with a wave.
pub(in crate::techniques::photon_mapping) struct BeamStage<'a> {
    pub beam: &'a Beam,
    pub map: &'a EventMap,
    /// Of stored fluxes, in W a photon.
    pub scale: f32,
    /// Of kernels.
    pub radii: PhotonRadii,
    /// Share of ways that have planes.
    pub plane_share: f32,
}

/// Which eye paths ask, and for what.
#[derive(Clone, Copy)]
pub(in crate::techniques::photon_mapping) struct BeamAsk<'a> {
    pub eye: &'a PathSet,
    /// Of an expression.
    pub classes: Option<&'a PathClasses>,
    /// Of paths that ask on surfaces, a bit each.
    pub surface_states: u32,
    /// The path set bounds the number of scatterings.
    pub counts_bounces: bool,
    /// States of eye paths from which on maps are asked at all, a bit each: others go on behind a scattering in a medium.
    pub floor: u32,
}

impl Beam {
    /// Bytes that are kept of the way of an eye path.
    pub fn slot_bytes(scene: &GpuScene) -> u64 {
        if scene.profile().media.heterogeneous {
            WAY_BYTES + ASKED_BYTES + STEPS_BYTES
        } else {
            WAY_BYTES
        }
    }

    /// For up to `slots` eye paths at once, whole workgroups of them, with [`slot_bytes`](Self::slot_bytes) of `memory` for each and a queue in the memory `queues`.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], [`Error::Setting`] for fused stages over a kd-tree, and as [`ray_quota`].
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: &PhotonSettings,
        asking: BeamAsk<'_>,
        queues: &QueueMemory,
        (slots, memory): (u32, Buffer),
    ) -> Result<Self> {
        let BeamAsk {
            eye,
            classes,
            surface_states,
            counts_bounces,
            floor,
        } = asking;
        let profile = scene.profile();
        let (min_bounces, max_bounces) = settings.counted_bounces(classes);
        let queue = AskSpec {
            has_path_automaton: eye.has_automaton(),
            counts_bounces,
            of_rays: true,
        };
        let queue = Queue::new(gpu, scene, queues, queue)?;
        let tabulates = settings.volume_transmittance == VolumeTransmittance::Table;
        let (fuses, traversal) = (settings.stages == MapStages::Fused, scene.index_traversal());
        if fuses && matches!(traversal, DeviceTraversal::Kd { .. }) {
            // A ray that it stops may go on at any number, and so at one that says how far a place is (PLACE_RAY_ENDED).
            let cause = "cannot go through a kd-tree: take another ray index, or \"stream\"";
            return Err(Error::setting("stages", "fused", cause));
        }
        // All entry points have the same constants.
        macro_rules! spec {
            ($shader:ident, $queue:expr, $linear:expr) => {
                $shader::Spec {
                    has_absorption: profile.has_absorption,
                    has_instances: profile.keeps_instances,
                    has_path_automaton: eye.has_automaton(),
                    has_grids: profile.media.heterogeneous,
                    has_homogeneous: profile.media.homogeneous,
                    sampler_kind: settings.sampler as u32,
                    profile: settings.profile as u32,
                    tabulates,
                    short_ways: settings.volume_beams == BeamLength::Short,
                    marches: settings.volume == VolumeEstimate::March,
                    beams: settings.volume.stores_ways(),
                    planes: settings.volume.stores_planes(),
                    points: settings.volume.stores_points(),
                    carries_light_distance: settings.volume_paths,
                    compact_quota: settings.query_quota.min(BEAM_QUOTA),
                    count_fetches: settings.count_fetches,
                    counts_bounces,
                    has_classes: classes.is_some(),
                    queue: $queue,
                    linear: $linear,
                    after_fused: fuses,
                    ..Default::default()
                }
            };
        }
        let has_alpha = profile.has_alpha();
        let fused = || {
            let spec = photon_beam_fused::Spec {
                has_alpha,
                // Attributes are read for alpha alone.
                has_textures: has_alpha && profile.has_textures,
                has_vertex_colors: has_alpha && profile.has_vertex_colors,
                index_quota: ray_quota(gpu, scene, RAY_QUOTA)?,
                index_kind: traversal.kind(),
                work_least: work_least(gpu.caps().kind),
                compact_quota: settings.query_quota.min(FUSED_QUOTA),
                ..spec!(photon_beam_fused, QUEUE_SLOTS, false)
            };
            traversal.pipeline::<photon_beam_fused::Kernel>(gpu, &spec)
        };
        let query = match settings.query {
            MapQuery::Single => Query::Single(gpu.compute_pipeline(&spec!(photon_beam, queue.kind(), false))?),
            MapQuery::Packet => Query::Packet(gpu.compute_pipeline(&spec!(photon_beam_packet, queue.kind(), false))?),
        };
        let way_finder = photon_beam_ways::Spec {
            has_absorption: profile.has_absorption,
            has_instances: profile.keeps_instances,
            has_path_automaton: eye.has_automaton(),
            has_grids: profile.media.heterogeneous,
            has_homogeneous: profile.media.homogeneous,
            sampler_kind: settings.sampler as u32,
            tabulates,
            has_classes: classes.is_some(),
            ..Default::default()
        };
        let bytes = size_of::<Counters>() as u64;
        let volume_states = match classes {
            Some(classes) => classes.asking()[1],
            None if settings.direct_photons => surface_states,
            None => states_that_go_on_by(eye, LOBE_VOLUME.trailing_zeros()) & floor,
        };
        Ok(Self {
            gpu: gpu.clone(),
            query,
            fused: fuses.then(fused).transpose()?,
            way_finder: queue
                .collects()
                .then(|| gpu.compute_pipeline::<photon_beam_ways::Kernel>(&way_finder))
                .transpose()?,
            queue,
            linear: (Box::new(spec!(photon_beam, QUEUE_SLOTS, true)), OnceLock::new()),
            kept: KeptWays {
                memory,
                slots: slots.into(),
                has_grids: profile.media.heterogeneous,
            },
            planes: settings
                .volume
                .stores_planes()
                .then(|| PlaneRays::new(gpu, scene, slots))
                .transpose()?,
            counters: gpu.buffer(&BufferDesc::storage("beam counters", bytes, Category::Work))?,
            counters_readback: gpu.buffer(&BufferDesc::readback("beam counters", bytes))?,
            states: surface_states | volume_states,
            volume_states,
            bounces: [min_bounces, max_bounces.unwrap_or(u32::MAX)],
            photons: settings.photons,
            classes: classes.map_or([0; ASKING_STATES], |classes| classes.asks),
        })
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all: Vec<PipelineInfo> = self.way_finder.iter().map(ComputePipeline::info).collect();
        all.extend(self.queue.pipelines());
        all.extend(self.fused.iter().map(ComputePipeline::info));
        all.push(match &self.query {
            Query::Single(kernel) => kernel.info(),
            Query::Packet(kernel) => kernel.info(),
        });
        all.extend(self.planes.iter().map(PlaneRays::pipeline));
        all
    }

    /// What is left of light from the surfaces that paths have met, by place.
    pub fn ways(&self) -> BufferView<'_> {
        self.kept.ways()
    }

    /// Counts of the last wave: ways that asked, events that they met, and rays towards planes.
    pub fn counts(&self) -> Result<GatherCounts> {
        let counters = self.counters_readback.read::<Counters>(0, 1)?[0];
        Ok(GatherCounts {
            queries: u64::from(counters.queries),
            photons: wide_counter(counters.events),
            rays: self.planes.as_ref().map_or(Ok(0), PlaneRays::count)?,
        })
    }

    /// What the queries of the last wave took, where that is counted.
    pub fn fetches(&self) -> Result<RayFetches> {
        let counters = self.counters_readback.read::<Counters>(0, 1)?[0];
        Ok(RayFetches {
            queries_by_bounce: counters.queries_by_bounce.map(u64::from),
            nodes: wide_counter(counters.nodes),
            records: wide_counter(counters.records),
            tests: wide_counter(counters.tests),
        })
    }
}

impl BeamStage<'_> {
    fn set(&self) -> PhotonBeamSet<'_> {
        let Beam {
            queue,
            counters,
            kept,
            planes,
            ..
        } = self.beam;
        let queue = queue.set(counters);
        PhotonBeamSet {
            event_pairs: &self.map.pairs,
            event_records: &self.map.events,
            photon_event_root: self.map.root.view(),
            beam_counters: counters.view(),
            photon_beam_ways: kept.ways(),
            photon_beam_asked: kept.asked(),
            photon_way_steps: kept.steps(),
            photon_plane_rays: planes.as_ref().map_or(counters.view(), PlaneRays::rays),
            gather_head: queue.gather_head,
            beam_places: queue.gather_places,
            beam_blocks: queue.gather_blocks,
        }
    }

    fn push(&self, scene: &GpuScene, key: WalkKey) -> photon_beam::Push {
        photon_beam::Push {
            key,
            surrounding: scene.surrounding().unwrap_or(NO_MEDIUM),
            states: self.beam.states,
            volume_states: self.beam.volume_states,
            least_bounces: self.beam.bounces[0],
            most_bounces: self.beam.bounces[1],
            scale: self.scale,
            beam_radius: self.radii.beams as f32,
            collision_radius: self.radii.collisions as f32,
            plane_weight: 1.0 / self.plane_share,
            photons: self.beam.photons as f32,
            classes: self.beam.classes,
            ..Default::default()
        }
    }

    pub fn reset(&self, pass: &mut Pass<'_>) -> Result<()> {
        self.beam.planes.as_ref().map_or(Ok(()), |planes| planes.reset(pass))?;
        pass.update(self.beam.counters.view(), &[Counters::default()])
    }

    pub fn read_back(&self, pass: &mut Pass<'_>) -> Result<()> {
        if let Some(planes) = &self.beam.planes {
            planes.read_back(pass)?;
        }
        pass.copy(self.beam.counters.view(), self.beam.counters_readback.view())
    }

    /// Records queries at all places that have none yet, behind what finds and collects those that ask.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        wave: &WaveSet<'_>,
        places: Places<'_>,
    ) -> Result<()> {
        let (set, of_scene, media) = (self.set(), scene.scene_set(), scene.media_set());
        let (sets, push): ([&dyn BindingSet<'_>; 4], _) =
            ([wave, &set, &of_scene, &media], self.push(scene, places.key));
        let mut groups = places.items;
        if let Some(way_finder) = &self.beam.way_finder {
            recorder.pass("photon: beam ways", |pass| {
                pass.dispatch_indirect(way_finder, &sets, &bytemuck::cast(push), places.items)?;
                stage_barrier(pass);
                Ok(())
            })?;
            let queue = &self.beam.queue;
            recorder.pass("photon: beam queue", |pass| {
                let collected = queue.set(&self.beam.counters);
                groups = queue.record(pass, scene, wave, places, AskSettings::default(), &collected)?;
                Ok(())
            })?;
        }
        recorder.pass("photon: beams", |pass| {
            match &self.beam.query {
                Query::Single(kernel) => pass.dispatch_indirect(kernel, &sets, &push, groups)?,
                Query::Packet(kernel) => pass.dispatch_indirect(kernel, &sets, &bytemuck::cast(push), groups)?,
            }
            stage_barrier(pass);
            Ok(())
        })
    }

    /// Whether one kernel finds the hits of rays and asks along them.
    pub fn finds_hits(&self) -> bool {
        self.beam.fused.is_some()
    }

    /// Records that kernel at all places.
    ///
    /// # Errors
    /// Those of recording, and [`Error::Internal`] where there is none.
    pub fn record_with_hits(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        wave: &WaveSet<'_>,
        places: Places<'_>,
    ) -> Result<()> {
        let fused = self.beam.fused.as_ref().ok_or_else(|| Error::Internal {
            what: "volume map".into(),
            fault: "has no kernel that finds hits".into(),
        })?;
        let (set, index, of_scene, media) = (self.set(), scene.index_set(), scene.scene_set(), scene.media_set());
        let sets: [&dyn BindingSet<'_>; 5] = [wave, &index, &of_scene, &media, &set];
        let push = self.push(scene, places.key);
        recorder.pass("photon: rays and beams", |pass| {
            pass.dispatch_indirect(fused, &sets, &bytemuck::cast(push), places.items)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    /// The rays that eye paths send along the flights of planes, behind queries.
    pub fn planes(&self) -> Option<&PlaneRays> {
        self.beam.planes.as_ref()
    }

    pub fn prepare_stopped(&self) -> Result<()> {
        let (spec, made) = &self.beam.linear;
        if made.get().is_none() {
            let linear = self.beam.gpu.compute_pipeline(spec.as_ref())?;
            made.get_or_init(|| linear);
        }
        Ok(())
    }

    /// Records the events `first` up to `last` at stopped places from `first_place` on.
    pub fn record_linear(
        &self,
        pass: &mut Pass<'_>,
        scene: &GpuScene,
        wave: &WaveSet<'_>,
        key: WalkKey,
        [first_place, places]: [u32; 2],
        [first, last]: [u32; 2],
    ) -> Result<()> {
        let linear = self.beam.linear.1.get().ok_or_else(|| Error::Internal {
            what: "volume map".into(),
            fault: "has stopped queries without the kernel for them".into(),
        })?;
        let push = photon_beam::Push {
            first_place,
            first,
            last,
            ..self.push(scene, key)
        };
        let (set, of_scene, media) = (self.set(), scene.scene_set(), scene.media_set());
        let groups = [linear.groups_for(places), 1, 1];
        pass.dispatch(linear, &[wave, &set, &of_scene, &media], &push, groups)?;
        stage_barrier(pass);
        Ok(())
    }
}

/// Eye paths under way at once, at most, so that one buffer has what rays through grids keep; 0 leaves their number as it is.
pub(in crate::techniques::photon_mapping) fn paths_in_flight(gpu: &Gpu, scene: &GpuScene) -> u32 {
    let most = gpu.caps().max_storage_buffer_range / Beam::slot_bytes(scene);
    if !scene.profile().media.heterogeneous || most >= u64::from(default_slots(gpu)) {
        return 0;
    }
    let most = most as u32;
    (most - most % WALK_GROUP).max(WALK_GROUP)
}

/// The states of eye paths that may go on by a lobe, a bit each.
fn states_that_go_on_by(eye: &PathSet, symbol: u32) -> u32 {
    let goes_on = |word: &u32| word >> (PATH_SET_STATE_BITS * symbol) & PATH_SET_DEAD != PATH_SET_DEAD;
    let states = eye.successors();
    (0..states.len()).fold(0, |bits, state| bits | u32::from(goes_on(&states[state])) << state)
}
