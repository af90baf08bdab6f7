//! Queries of the photon map where eye paths have arrived: a stage of the path tracer's bounces.

mod counts;
mod linear;
mod stage;

pub use counts::{GatherCounts, RayFetches};

use std::sync::OnceLock;

use self::stage::GatherStage;
use super::map::PhotonMap;
use super::path_classes::{ASKING_STATES, PathClasses};
use super::queue::{AskSpec, Queue, QueueMemory};
use super::settings::{MapQuery, PhotonSettings};
use super::volume::{Beam, BeamAsk, BeamStage, EventMap};
use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::shaders::constants::{
    LOBE_DIFFUSE, LOBE_GLOSSY, LOBE_REFLECTION, LOBE_SPECULAR, NEAREST_BINS, NEAREST_HALVINGS, NEAREST_ROUNDS,
    PATH_SET_DEAD, PATH_SET_LOBE_COUNT, PATH_SET_STATE_BITS, QUEUE_SLOTS,
};
use crate::gpu::shaders::techniques::photon_mapping::{photon_gather, photon_gather_packet};
use crate::gpu::{Buffer, BufferDesc, Category, ComputePipeline, Gpu, PipelineInfo, SOFTWARE_LOOP_CAP, wide_counter};
use crate::techniques::path::PhotonRadii;
use crate::transport::{GpuScene, PathSet, surface_spec};
use crate::{Error, Result};

/// Nodes and records of each of the rounds in which neighbours are found, and of the sum. With the loops over rounds and bins, which are
/// emptied and summed up, they stay below what software drivers run.
const NEAREST_QUOTA: u32 = (SOFTWARE_LOOP_CAP - NEAREST_SEARCHES * (1 + 2 * NEAREST_BINS)) / (NEAREST_SEARCHES + 1);
/// Searches for the last neighbour, at most.
const NEAREST_SEARCHES: u32 = NEAREST_ROUNDS + NEAREST_HALVINGS;

/// Each point by itself, or those of a subgroup together.
enum Query {
    /// No surface may be diffuse: no point asks, and there is no map that could be asked.
    None,
    Single(ComputePipeline<photon_gather::Kernel>),
    Packet(ComputePipeline<photon_gather_packet::Kernel>),
}

/// What is done where a quota has stopped a query.
enum Linear {
    /// All records are gone through, by a kernel that is made when it is first needed.
    Records(
        Box<photon_gather::Spec>,
        OnceLock<ComputePipeline<photon_gather::Kernel>>,
    ),
    /// Refused: a pass through all records cannot find neighbours. Where no point asks, none is stopped.
    Refuse,
}

/// The kernels of queries.
pub(super) struct Gather {
    gpu: Gpu,
    queue: Queue,
    query: Query,
    linear: Linear,
    /// Records of a dispatch that goes through all of them.
    quota: u32,
    /// Of a wave, and where the host reads them.
    counters: Buffer,
    counters_readback: Buffer,
    gather_states: u32,
    caustic_states: u32,
    bounces: [u32; 2],
    /// [`PathClasses::asks`].
    classes: [u32; ASKING_STATES],
    /// Only in scenes with media.
    beam: Option<Beam>,
}

/// A map of media, as its queries need it.
pub(super) struct EventsAsked<'a> {
    pub map: &'a EventMap,
    /// Of their kernels.
    pub radii: PhotonRadii,
    /// Share of ways that have planes.
    pub plane_share: f64,
}

type Counters = photon_gather::GatherCounters;

impl Gather {
    /// Bytes that it keeps of an eye path.
    pub fn slot_bytes(scene: &GpuScene) -> u64 {
        if scene.profile().media.any() {
            Beam::slot_bytes(scene)
        } else {
            0
        }
    }

    /// For eye paths of the set `eye`, up to `slots` at once, which ask for photons of some classes where the path set is an expression; `kept` has
    /// [`slot_bytes`](Self::slot_bytes) for each.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: &PhotonSettings,
        eye: &PathSet,
        classes: Option<&PathClasses>,
        (slots, kept): (u32, Buffer),
    ) -> Result<Self> {
        let (min_bounces, max_bounces) = settings.counted_bounces(classes);
        // Photons have been scattered once before they land, and at the point that gathers them.
        let least = if settings.direct_photons { 1 } else { 2 };
        let ask = AskSpec {
            has_path_automaton: eye.has_automaton(),
            counts_bounces: min_bounces > least || max_bounces.is_some(),
            of_rays: false,
        };
        let queues = QueueMemory::new(gpu, settings.queue, slots)?;
        // Places themselves are no queue.
        let asks = scene.has_diffuse_base();
        let queue = Queue::new(gpu, scene, if asks { &queues } else { &QueueMemory::Slots }, ask)?;
        let nearest = settings.neighbors > 0;
        let has_media = scene.profile().media.any();
        // Both entry points have the same constants.
        macro_rules! spec {
            ($shader:ident, $queue:expr, $linear:expr) => {
                surface_spec!($shader, scene, {
                    has_multiple_scattering: false,
                    separable_masking: false,
                    has_path_automaton: ask.has_path_automaton,
                    tells_caustics: settings.final_gather,
                    profile: settings.profile as u32,
                    counts_bounces: ask.counts_bounces,
                    compact_quota: if nearest { settings.query_quota.min(NEAREST_QUOTA) } else { settings.query_quota },
                    nearest,
                    linear: $linear,
                    queue: $queue,
                    has_media,
                    has_classes: classes.is_some(),
                    ..Default::default()
                })
            };
        }
        let query = match settings.query {
            MapQuery::Packet if !gpu.caps().subgroup.vote => {
                return Err(Error::MissingFeature {
                    feature: "VK_SUBGROUP_FEATURE_VOTE_BIT".into(),
                    needed_by: "photon_gather_packet".into(),
                    device: gpu.caps().device.clone(),
                    instead: "ask the map point by point: \"query\": \"single\"".into(),
                });
            }
            _ if !asks => Query::None,
            MapQuery::Packet => {
                Query::Packet(gpu.compute_pipeline(&spec!(photon_gather_packet, queue.kind(), false))?)
            }
            MapQuery::Single => Query::Single(gpu.compute_pipeline(&spec!(photon_gather, queue.kind(), false))?),
        };
        let linear = if nearest || !asks {
            Linear::Refuse
        } else {
            Linear::Records(Box::new(spec!(photon_gather, QUEUE_SLOTS, true)), OnceLock::new())
        };
        // Eye paths that go on in a medium ask no more.
        let floor = match settings.volume_paths && has_media {
            true => states_before_rough(eye),
            false => u32::MAX,
        };
        let (gather_states, caustic_states) = match classes {
            Some(classes) => (classes.asking()[0], 0),
            None => gathering_states(settings, eye),
        };
        let gather_states = gather_states & floor;
        let asking = BeamAsk {
            eye,
            classes,
            surface_states: gather_states,
            counts_bounces: ask.counts_bounces,
            floor,
        };
        let beam = has_media
            .then(|| Beam::new(gpu, scene, settings, asking, &queues, (slots, kept)))
            .transpose()?;
        let bytes = size_of::<Counters>() as u64;
        let counters = gpu.buffer(&BufferDesc::storage("gather counters", bytes, Category::Work))?;
        let counters_readback = gpu.buffer(&BufferDesc::readback("gather counters", bytes))?;
        Ok(Self {
            queue,
            query,
            linear,
            quota: settings.query_quota,
            counters,
            counters_readback,
            gather_states,
            caustic_states,
            bounces: [min_bounces, max_bounces.unwrap_or(u32::MAX)],
            classes: classes.map_or([0; ASKING_STATES], |classes| classes.asks),
            beam,
            gpu: gpu.clone(),
        })
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.queue.pipelines();
        match &self.query {
            Query::None => {}
            Query::Single(kernel) => all.push(kernel.info()),
            Query::Packet(kernel) => all.push(kernel.info()),
        }
        all.extend(self.beam.iter().flat_map(Beam::pipelines));
        all
    }

    /// Queries of a map of surfaces, if there is one, whose photons' fluxes are to be multiplied by `scale`, for `neighbors` within `radius` where these are asked for; in scenes with media also
    /// of the map of events there.
    pub fn stage<'a>(
        &'a self,
        scene: &'a GpuScene,
        map: Option<&'a PhotonMap>,
        events: Option<EventsAsked<'a>>,
        scale: f64,
        (neighbors, radius): (u32, f64),
    ) -> GatherStage<'a> {
        let beam = self.beam.as_ref().zip(events).map(|(beam, events)| BeamStage {
            beam,
            map: events.map,
            scale: scale as f32,
            radii: events.radii,
            plane_share: events.plane_share as f32,
        });
        GatherStage {
            beam,
            gather: self,
            scene,
            map,
            scale: scale as f32,
            neighbors,
            radius: radius as f32,
        }
    }

    /// Counts of the last wave.
    pub fn counts(&self) -> Result<GatherCounts> {
        let counters = self.counters_readback.read::<Counters>(0, 1)?[0];
        Ok(GatherCounts {
            queries: u64::from(counters.queries),
            photons: wide_counter(counters.photons),
            rays: 0,
        })
    }

    /// The same of the volume map.
    pub fn volume_counts(&self) -> Result<GatherCounts> {
        self.beam.as_ref().map_or(Ok(GatherCounts::default()), Beam::counts)
    }

    /// What its queries took, where that is counted.
    pub fn volume_fetches(&self) -> Result<RayFetches> {
        self.beam.as_ref().map_or(Ok(RayFetches::default()), Beam::fetches)
    }
}

/// The states of eye paths whose diffuse surfaces ask the map, and those that ask it for caustics alone, a bit each.
///
/// A path whose next diffuse scattering leads to direct light at most asks at that surface for all the rest. With a final gather the first
/// diffuse surface asks for caustics and lets the path go on; which states are the first ones is told by what a path may do after it.
fn gathering_states(settings: &PhotonSettings, eye: &PathSet) -> (u32, u32) {
    const DIFFUSE: u32 = (LOBE_DIFFUSE & LOBE_REFLECTION).trailing_zeros();
    let successors = eye.successors();
    let after = |state: u32| match successors.get(state as usize) {
        Some(word) => word >> (PATH_SET_STATE_BITS * DIFFUSE) & PATH_SET_DEAD,
        None => PATH_SET_DEAD,
    };
    let (mut gathering, mut caustic) = (0, 0);
    for state in 0..successors.len() as u32 {
        let asks = if settings.direct_photons {
            // The set has no diffuse scattering: all of its paths ask.
            true
        } else {
            after(state) != PATH_SET_DEAD
        };
        gathering |= u32::from(asks) << state;
        let goes_on = after(after(state)) != PATH_SET_DEAD;
        caustic |= u32::from(settings.final_gather && asks && goes_on) << state;
    }
    (gathering, caustic)
}

/// The states of eye paths that specular and glossy scattering alone leads to, a bit each.
fn states_before_rough(eye: &PathSet) -> u32 {
    let successors = eye.successors();
    let mut reached = 1u32;
    loop {
        let before = reached;
        let reached_before = successors
            .iter()
            .enumerate()
            .filter(|(state, _)| before >> state & 1 != 0);
        for (_, word) in reached_before {
            for symbol in 0..PATH_SET_LOBE_COUNT {
                let after = word >> (PATH_SET_STATE_BITS * symbol) & PATH_SET_DEAD;
                if 1 << symbol & (LOBE_SPECULAR | LOBE_GLOSSY) != 0 && after != PATH_SET_DEAD {
                    reached |= 1 << after;
                }
            }
        }
        if reached == before {
            return reached;
        }
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "BG-5",
        name: "photon map as first published, seen directly or behind a final gather",
        role: Role::PartOf("PM-SYS-1"),
        limits: "A map seen directly is blurred, and lacks half of its light at edges and three quarters in corners of right angles, as far as kernels reach; behind a final gather, of one ray per eye path, a part of that is missing everywhere, and pictures take hundreds of paths to be smooth.",
        sources: &[
            sources::JENSEN_1996.whole(),
            sources::JENSEN_2001.whole(),
            sources::ENGELHARDT_2013.at("4.4"),
        ],
        shaders: &["shaders/techniques/photon_mapping/photon_gather.comp"],
        bias: Some(Bias::Consistent(
            "kernels blur what they gather, and lose light at edges, until they have shrunk",
        )),
        tests: &[
            "tests/tests/photon/furnace.rs::maps_are_dark_at_edges_by_what_kernels_lose_and_a_gather_evens_it_out",
            "tests/tests/photon/flux.rs::what_surfaces_absorb_is_what_lights_send",
            "tests/tests/photon/settings.rs::direct_photons_and_final_gather_have_the_same_light",
        ],
        settings: &["final_gather", "direct_photons", "photons", "radius"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-DE-1",
        name: "density estimation with kernels of one radius",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Blurs by its radius, and loses light at edges and on curved surfaces.",
        sources: &[sources::JENSEN_2001.whole(), sources::FABIANOWSKI_2011.at("§3.4.2")],
        bias: Some(Bias::Biased(
            "blur and light lost at edges, as far as the radius; only passes with ever smaller ones take it away",
        )),
        shaders: &["shaders/techniques/photon_mapping/photon_gather.comp"],
        tests: &[
            "engine/src/techniques/photon_mapping/kernel/tests.rs::equal_disks_are_the_estimator_of_fixed_bandwidth",
            "tests/tests/photon/sphere.rs::all_reflections_sum_up_for_every_kernel",
            "tests/tests/photon/materials.rs::floors_of_all_kinds_gather",
            "tests/tests/photon/traps.rs::thin_walls_let_no_photon_through",
            "tests/tests/photon/traps.rs::colours_bleed_through_the_passage_as_they_should",
        ],
        settings: &["radius", "reduction", "shape"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-DE-3",
        name: "nearest neighbours: one kernel about each point, up to its k-th photon",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Wrong where light changes within the width of the nearest photons, as at edges and contacts; fewer neighbours than asked for where photons lie too densely for a query's steps.",
        sources: &[sources::JENSEN_2001.at("§7"), sources::FABIANOWSKI_2011.at("§3.4.2.1")],
        bias: Some(Bias::Biased(
            "blur as far as the last neighbour; only more photons or passes with fewer neighbours take it away",
        )),
        shaders: &["shaders/techniques/photon_mapping/photon_gather.comp"],
        tests: &[
            "tests/tests/photon/settings.rs::nearest_neighbours_agree_with_the_path_tracer",
            "tests/tests/photon/neighbours.rs::neighbours_are_those_of_brute_force",
            "tests/tests/photon/neighbours.rs::fewer_neighbours_than_asked_for_have_the_kernel_that_was_searched",
        ],
        settings: &["neighbors", "radius"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-DE-4",
        name: "variable kernels: a bandwidth of each photon's own",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Blurs and loses light at edges as far as each footprint reaches.",
        sources: &[sources::FABIANOWSKI_2011.at("§3.4.2.3")],
        bias: Some(Bias::Biased(
            "blur and light lost at edges, as far as footprints; only more photons or passes with ever smaller ones take it away",
        )),
        shaders: &["shaders/techniques/photon_mapping/photon_gather.comp"],
        tests: &[
            "engine/src/techniques/photon_mapping/kernel/tests.rs::equal_disks_are_the_estimator_of_fixed_bandwidth",
            "engine/src/techniques/photon_mapping/kernel/tests.rs::even_light_is_estimated_without_bias",
            "tests/tests/photon/settings.rs::every_shape_agrees_with_the_path_tracer",
        ],
        settings: &["shape", "spread"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-ST-1",
        name: "stages of eye paths through media: rays, their ways through media, density estimation along rays and on surfaces, shadow rays, each a kernel over jobs of a wave; and the first three in one kernel (the engine's own)",
        role: Role::PartOf("PM-SYS-1"),
        limits: "The fused form has the rays, their ways through media and the density estimation along them, in scenes with media, without queues, packets or a kd-tree; collisions of paths, surfaces and shadow rays stay stages of their own, whose push constants it has no room for beside its own, and what a quota stops is left to the stages.",
        sources: &[sources::FABIANOWSKI_2011.at("§7.4")],
        shaders: &[
            "shaders/walk/extend.comp",
            "shaders/techniques/path/path_medium.comp",
            "shaders/techniques/path/path_shade.comp",
            "shaders/walk/shadow.comp",
            "shaders/techniques/photon_mapping/photon_beam.comp",
            "shaders/techniques/photon_mapping/photon_beam_fused.comp",
            "shaders/techniques/photon_mapping/photon_gather.comp",
        ],
        tests: &[
            "tests/tests/photon/volume_queues.rs::queues_and_packets_of_rays_are_made_for_media_alone",
            "tests/tests/photon/volume_queues.rs::queues_and_packets_are_the_same_in_parts",
            "tests/tests/photon/volume_stages.rs::fused_stages_make_the_same_picture_in_fewer_passes",
            "tests/tests/photon/volume_stages.rs::fused_stages_send_rays_towards_planes",
            "tests/tests/photon/volume_stages.rs::fused_stages_go_through_grids",
            "tests/tests/photon/volume_stages.rs::queries_that_a_quota_stops_in_a_fused_kernel_are_the_stages",
            "tests/tests/photon/volume_stages.rs::walks_that_a_quota_stops_in_a_fused_kernel_are_the_stages",
            "tests/tests/photon/volume_stages.rs::fused_stages_are_the_same_in_parts",
            "tests/tests/photon/volume_stages.rs::rays_that_a_quota_stops_in_a_fused_kernel_are_the_stages",
            "tests/tests/photon/volume_stages.rs::fused_stages_are_refused_beside_queues_packets_and_kd_trees",
        ],
        settings: &["stages", "queue", "query"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-ST-5",
        name: "queries of the photon maps, one per thread",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Neighbouring threads walk different parts of the tree.",
        sources: &[sources::FABIANOWSKI_2011.at("§7.4.2")],
        shaders: &[
            "shaders/techniques/photon_mapping/photon_gather.comp",
            "shaders/techniques/photon_mapping/photon_beam.comp",
        ],
        tests: &[
            "tests/tests/photon/determinism.rs::queries_that_a_quota_stops_go_through_all_records",
            "tests/tests/photon/flux.rs::the_picture_has_the_flux_of_the_map",
            "tests/tests/photon/settings.rs::direct_photons_and_final_gather_have_the_same_light",
            "tests/tests/photon/determinism.rs::threads_never_show",
            "tests/tests/photon/volume_queues.rs::every_queue_and_packets_give_the_same_picture_through_media",
        ],
        settings: &["query"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-ST-6",
        name: "queries of the photon maps, a subgroup's together",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Off by default, since on the software driver it saves up to 16 % of the time of points' queries in closed rooms and costs up to 26 % elsewhere; needs subgroup votes; visits what any point or ray of the subgroup asks for, and so meets the quota sooner, which with `neighbors` is an error.",
        sources: &[sources::FABIANOWSKI_2011.at("§7.4.2")],
        shaders: &[
            "shaders/techniques/photon_mapping/photon_gather_packet.comp",
            "shaders/techniques/photon_mapping/photon_beam_packet.comp",
        ],
        tests: &[
            "tests/tests/photon/settings.rs::points_that_ask_together_see_the_same",
            "tests/tests/photon/volume_queues.rs::every_queue_and_packets_give_the_same_picture_through_media",
            "tests/tests/photon/volume_queues.rs::queues_and_packets_take_rays_that_all_meet_the_same_thousand_kernels",
            "tests/tests/photon/volume_queues.rs::queues_and_packets_take_rays_that_a_quota_stops",
        ],
        settings: &["query"],
        ..Row::of(file!())
    },
];
