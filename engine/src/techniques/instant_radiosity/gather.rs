//! Virtual lights at work: where eye paths have arrived, all of them, with a shadow ray each. A stage of the path tracer's bounces.
//!
//! Places × lights are never stored: an invocation takes the lights of its place one after the other, as many a dispatch as the loops of the device allow, and
//! goes on in the next one. So memory is that of the places, whatever the number of lights.
//!
//! Shadow rays are traced here, and in `deferred_gather` of `many-light`, by the traversal that the ray kernels of [`walk`](crate::walk) include, but not in their queues, which
//! have a ray a place: with no more than eight bytes a pair, those of 192² pixels and 512 lights would take 151 MB, more than a buffer of the least devices, and a wave of all places for
//! each light would write and read as many rays. Each place keeps a cursor instead (`GatherState`: its next light, and where that light's ray has stopped): a ray stops at a
//! quota, a dispatch takes a bounded number of lights, and sweeps over the places that are left go on until none is, so that all loops stay below what software drivers run
//! ([`SOFTWARE_LOOP_CAP`]).

use super::medium_gather::{MediumGather, Over};
use super::settings::{Selection, VirtualLightSettings};
use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::interface::BindingSet;
use crate::gpu::shaders::constants::{
    INSTANCE_SEARCH_STEPS, LIGHT_CUT_MAX, LIGHT_TREE_DEPTH_MAX, LOBE_DIFFUSE, LOBE_REFLECTION, PATH_SET_DEAD,
    PATH_SET_STATE_BITS, POTENTIAL_BINS,
};
use crate::gpu::shaders::sets::{VirtualLightSet, WaveSet};
use crate::gpu::shaders::techniques::instant_radiosity::vpl_gather;
use crate::gpu::shaders::types::GatherState;
use crate::gpu::{
    Access, Buffer, BufferDesc, Category, ComputePipeline, DeviceKind, Gpu, Pass, PipelineInfo, Recorder,
    SOFTWARE_LOOP_CAP, TexelView, wide_counter,
};
use crate::transport::edge_bound::EdgeBound;
use crate::transport::{GpuScene, PathSet, surface_spec};
use crate::walk::{
    ArrivalStage, ConnectionPace, Places, RAY_QUOTA, SOFTWARE_CONNECTIONS, StoppedPlaces, WalkKey, stage_barrier,
};
use crate::{Error, Result};

/// Lights that a place takes in one dispatch: enough to be worth looking the surface up again.
const LIGHTS_A_DISPATCH: u32 = 64;
/// Loop iterations below which a ray is stopped too often: fewer lights share a dispatch then.
const QUOTA_WANTED: u32 = 256;
/// Searches for an instance of a connection, beside those of its ray: three surfaces are looked up.
const SEARCHES: u32 = 3 * INSTANCE_SEARCH_STEPS;
/// Loop iterations that finding the potential of all lights takes at most, in the dispatch that a place begins in.
const POTENTIAL_ITERATIONS: u32 = 1 << 15;
/// Connections of a submission of techniques without a pace, on devices that a driver watches.
const DEVICE_CONNECTIONS: u32 = 1 << 22;

/// Connections that a submission may make on a device.
pub(super) fn connections_at_once(gpu: &Gpu) -> u32 {
    match gpu.caps().kind {
        DeviceKind::Cpu => SOFTWARE_CONNECTIONS,
        _ => DEVICE_CONNECTIONS,
    }
}

/// Sweeps over the places that have stopped beyond those which the lights take, for each light: rays longer than that never end.
pub(super) const SWEEPS_A_LIGHT: u64 = 4096;

/// Exact counts of connections.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct VirtualLightCounts {
    /// Points that gathered.
    pub gathers: u64,
    /// Pairs of a point and a virtual light.
    pub connections: u64,
    /// Those whose shadow ray was traced: the others bring nothing, whatever stands between, or too little.
    pub shadow_rays: u64,
    /// Nodes of the tree of virtual lights that points have looked at, where lights are chosen by cuts.
    pub nodes: u64,
}

/// The kernel of connections, and what places keep between its dispatches.
pub(super) struct Gather {
    kernel: GatherKernel,
    states: Buffer,
    counters: Buffer,
    counters_readback: Buffer,
    /// States of eye paths whose rough surfaces gather, a bit each.
    path_states: u32,
    bounces: [u32; 2],
    edge_bound: EdgeBound,
    selected: Selected,
    pace: ConnectionPace,
}

/// By whether the scene has media.
enum GatherKernel {
    Surfaces(ComputePipeline<vpl_gather::Kernel>),
    Media(MediumGather),
}

/// Which lights places take.
struct Selected {
    selection: Selection,
    /// Share of the potential.
    share: f32,
    rescales: bool,
    cut_size: u32,
    candidates: u32,
    /// Word behind the states of all places.
    first: u32,
    /// Lights that the potential can be found of.
    most: u32,
}

/// Connections to the virtual lights of a pass, to be recorded with a wave.
pub(super) struct GatherStage<'a> {
    pub gather: &'a Gather,
    pub scene: &'a GpuScene,
    pub lights: &'a TexelView,
    /// The tree over them, where they are chosen by cuts.
    pub tree: Option<&'a TexelView>,
    pub count: u32,
    /// One over the walks of the pass.
    pub scale: f32,
    /// [`PathTracer::departures`](crate::techniques::PathTracer::departures).
    pub departures: Buffer,
    /// Of the random numbers that alpha is drawn by, of the pass: another one for each.
    pub seed: u32,
}

type Counters = vpl_gather::VirtualLightCounters;

impl Gather {
    /// What a place keeps between dispatches, in a scene with or without media.
    pub fn state_bytes(settings: &VirtualLightSettings, has_media: bool) -> u64 {
        const SELECTED_BYTES: u64 = 2 * size_of::<f32>() as u64;
        if has_media {
            return MediumGather::STATE_BYTES;
        }
        let selected = settings.selection == Selection::Potential;
        size_of::<GatherState>() as u64 + if selected { SELECTED_BYTES } else { 0 }
    }

    /// For eye paths of the set `eye`; `states` has [`state_bytes`](Self::state_bytes) for each that may be under way. In scenes with media `settings` take all lights.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: &VirtualLightSettings,
        eye: &PathSet,
        edge_bound: EdgeBound,
        states: Buffer,
    ) -> Result<Self> {
        let has_media = scene.profile().media.any();
        let (kernel, lights_at_once) = if has_media {
            let (kernel, lights_at_once) = MediumGather::new(gpu, scene, settings, eye, edge_bound)?;
            (GatherKernel::Media(kernel), lights_at_once)
        } else {
            let (kernel, lights_at_once) = on_surfaces(gpu, scene, settings, eye, edge_bound)?;
            (GatherKernel::Surfaces(kernel), lights_at_once)
        };
        let bytes = size_of::<Counters>() as u64;
        let places = states.bytes() / Self::state_bytes(settings, has_media);
        let selected = Selected {
            selection: settings.selection,
            share: settings.potential_share,
            rescales: settings.rescales,
            cut_size: settings.cut_size,
            candidates: settings.candidates,
            first: (places * size_of::<GatherState>() as u64 / size_of::<f32>() as u64) as u32,
            most: POTENTIAL_ITERATIONS / (1 + searches(scene)),
        };
        Ok(Self {
            kernel,
            states,
            counters: gpu.buffer(&BufferDesc::storage("virtual light counters", bytes, Category::Work))?,
            counters_readback: gpu.buffer(&BufferDesc::readback("virtual light counters", bytes))?,
            path_states: gathering_states(eye),
            bounces: [settings.least_bounces, settings.most().unwrap_or(u32::MAX)],
            edge_bound,
            selected,
            pace: ConnectionPace::new(gpu.caps().kind, lights_at_once, scene.profile().media.heterogeneous),
        })
    }

    pub fn pipeline(&self) -> PipelineInfo {
        match &self.kernel {
            GatherKernel::Surfaces(pipeline) => pipeline.info(),
            GatherKernel::Media(kernel) => kernel.pipeline(),
        }
    }

    /// Counts of the last wave.
    pub fn counts(&self) -> Result<VirtualLightCounts> {
        let counters = self.read()?;
        Ok(VirtualLightCounts {
            gathers: u64::from(counters.gathers),
            connections: wide_counter(counters.connections),
            shadow_rays: wide_counter(counters.shadow_rays),
            nodes: wide_counter(counters.nodes),
        })
    }

    /// Whether places can take their part of so many lights.
    ///
    /// # Errors
    /// [`Error::Overflow`] for more lights than the loops of a dispatch may find the potential of.
    pub fn check(&self, lights: u32) -> Result<()> {
        let selected = &self.selected;
        if selected.selection == Selection::Potential && lights > selected.most {
            return Err(Error::Overflow {
                kernel: "vpl_gather".into(),
                what: "virtual lights whose potential is found".into(),
                needed: lights.into(),
                capacity: selected.most.into(),
                instead: "follow fewer walks per pass: setting `walks`; or choose lights by cuts: setting `selection`"
                    .into(),
            });
        }
        Ok(())
    }

    /// A submission in which the stage may have been recorded took so long.
    pub fn submitted(&mut self, seconds: f64) {
        self.pace.submitted(seconds);
    }

    fn read(&self) -> Result<Counters> {
        Ok(self.counters_readback.read::<Counters>(0, 1)?[0])
    }
}

/// The kernel for a scene without media, and how many lights a place takes in a dispatch.
fn on_surfaces(
    gpu: &Gpu,
    scene: &GpuScene,
    settings: &VirtualLightSettings,
    eye: &PathSet,
    edge_bound: EdgeBound,
) -> Result<(ComputePipeline<vpl_gather::Kernel>, u32)> {
    let profile = scene.profile();
    let (once, each) = match settings.selection {
        Selection::All => (0, 0),
        Selection::Potential => (POTENTIAL_ITERATIONS + 2 * POTENTIAL_BINS, 0),
        Selection::Cuts => {
            let each = 1 + LIGHT_TREE_DEPTH_MAX + searches(scene);
            let once = (LIGHT_CUT_MAX + LIGHT_TREE_DEPTH_MAX) * (LIGHT_CUT_MAX + 1);
            (once, settings.candidates * each)
        }
    };
    let (lights_at_once, index_quota) = lights_beside(gpu, scene, settings.lights_at_once, [once, each])?;
    let traversal = scene.index_traversal();
    let spec = surface_spec!(vpl_gather, scene, {
        has_multiple_scattering: scene.bsdf_features().multiple_scattering,
        separable_masking: false,
        has_alpha: profile.has_alpha(),
        has_path_automaton: eye.has_automaton(),
        edge_bound: edge_bound.kind(),
        counts_bounces: settings.least_bounces > 2 || settings.most().is_some(),
        selection: settings.selection as u32,
        lights_at_once,
        index_quota,
        index_kind: traversal.kind(),
        ..Default::default()
    });
    Ok((traversal.pipeline(gpu, &spec)?, lights_at_once))
}

/// Loop iterations of a connection beside those of its ray.
fn searches(scene: &GpuScene) -> u32 {
    if scene.profile().keeps_instances { SEARCHES } else { 0 }
}

/// Lights that a place takes in a dispatch, and loop iterations after which a shadow ray goes on in the next: together they stay below what software drivers run.
pub(super) fn lights_at_once(gpu: &Gpu, scene: &GpuScene, wanted: u32) -> Result<(u32, u32)> {
    lights_beside(gpu, scene, wanted, [0, 0])
}

/// As [`lights_at_once`], beside so many iterations in all and for each light.
pub(super) fn lights_beside(gpu: &Gpu, scene: &GpuScene, wanted: u32, [once, more]: [u32; 2]) -> Result<(u32, u32)> {
    let filters = scene.profile().has_alpha();
    let mut lights = if wanted == 0 {
        LIGHTS_A_DISPATCH
    } else {
        wanted.min(LIGHTS_A_DISPATCH)
    };
    loop {
        // The loop over lights itself, and what a connection takes beside its ray.
        let beside = 1 + searches(scene) + more;
        let each = (SOFTWARE_LOOP_CAP.saturating_sub(once) / lights).saturating_sub(beside);
        let lanes = if filters { gpu.caps().subgroup_size.max(1) } else { 1 };
        let quota = RAY_QUOTA.min(each / lanes);
        match scene.index_traversal().quota_within(gpu.caps(), quota, each, filters) {
            Ok(quota) if quota >= QUOTA_WANTED || lights == 1 => return Ok((lights, quota)),
            Err(error) if lights == 1 => return Err(error),
            _ => lights /= 2,
        }
    }
}

/// The states of eye paths whose rough surfaces virtual lights light: those that may be scattered diffusely once more.
fn gathering_states(eye: &PathSet) -> u32 {
    const DIFFUSE: u32 = (LOBE_DIFFUSE & LOBE_REFLECTION).trailing_zeros();
    let successors = eye.successors();
    let scatters = |word: &u32| word >> (PATH_SET_STATE_BITS * DIFFUSE) & PATH_SET_DEAD != PATH_SET_DEAD;
    (0..successors.len()).fold(0, |states, state| {
        states | u32::from(scatters(&successors[state])) << state
    })
}

impl GatherStage<'_> {
    fn push(&self) -> vpl_gather::Push {
        let [lower, upper] = self.scene.bounds().map(|corner| corner.to_array());
        vpl_gather::Push {
            scene_lower: lower,
            states: self.gather.path_states,
            scene_upper: upper,
            least_bounces: self.gather.bounces[0],
            most_bounces: self.gather.bounces[1],
            lights: self.count,
            scale: self.scale,
            edge_bound: self.gather.edge_bound.value(),
            seed: self.seed,
            first_place: 0,
            goes_on: 0,
            geometry_most: self.gather.edge_bound.geometry_most(),
            share: self.gather.selected.share,
            rescales: self.gather.selected.rescales.into(),
            cut_size: self.gather.selected.cut_size,
            candidates: self.gather.selected.candidates,
            first_selected: self.gather.selected.first,
        }
    }

    /// The kernel over some places, whose walks' random numbers are keyed so.
    fn dispatch(&self, pass: &mut Pass<'_>, wave: &WaveSet<'_>, key: WalkKey, over: Over<'_>) -> Result<()> {
        let mut push = self.push();
        let pipeline = match &self.gather.kernel {
            GatherKernel::Surfaces(pipeline) => pipeline,
            GatherKernel::Media(kernel) => return kernel.record(pass, self, wave, (push, key), over),
        };
        let (index, scene, own) = (self.scene.index_set(), self.scene.scene_set(), self.set());
        let sets: [&dyn BindingSet<'_>; 4] = [wave, &index, &scene, &own];
        match over {
            Over::All(places) => pass.dispatch_indirect(pipeline, &sets, &push, places),
            Over::Stopped { first, count } => {
                (push.first_place, push.goes_on) = (first, 1);
                pass.dispatch(pipeline, &sets, &push, [pipeline.groups_for(count), 1, 1])
            }
        }
    }

    pub(super) fn set(&self) -> VirtualLightSet<'_> {
        VirtualLightSet {
            virtual_light_texels: self.lights,
            virtual_light_states: self.gather.states.view(),
            gather_counters: self.gather.counters.view(),
            light_departures: self.departures.view(),
            light_node_texels: self.tree.unwrap_or(self.lights),
            selected_lights: self.gather.states.view(),
        }
    }
}

impl ArrivalStage for GatherStage<'_> {
    fn record(&self, recorder: &mut Recorder, wave: &WaveSet<'_>, places: Places<'_>) -> Result<()> {
        recorder.pass("vpl: gather", |pass| {
            self.dispatch(pass, wave, places.key, Over::All(places.items))?;
            stage_barrier(pass);
            Ok(())
        })
    }

    fn reset(&self, pass: &mut Pass<'_>) -> Result<()> {
        pass.update(self.gather.counters.view(), &[Counters::default()])
    }

    fn read_back(&self, pass: &mut Pass<'_>) -> Result<()> {
        pass.copy(self.gather.counters.view(), self.gather.counters_readback.view())
    }

    /// Sweep after sweep over the places, until none has lights left; after each the device's count of these is read. Parts count places of all sweeps.
    fn record_stopped(
        &self,
        recorder: &mut Recorder,
        wave: &WaveSet<'_>,
        stopped: StoppedPlaces,
        part: u64,
    ) -> Result<Option<u64>> {
        let gather = self.gather;
        let all = stopped.places.max(1);
        let (sweep, first) = (part / u64::from(all), (part % u64::from(all)) as u32);
        if first == 0 && sweep > 0 {
            if gather.read()?.remaining == 0 {
                return Ok(None);
            }
            let most = u64::from(self.count) * SWEEPS_A_LIGHT;
            if sweep > most {
                return Err(Error::Overflow {
                    kernel: "vpl_gather".into(),
                    what: "sweeps over the virtual lights".into(),
                    needed: sweep,
                    capacity: most,
                    instead: "choose another ray index".into(),
                });
            }
        }
        let places = gather.pace.places().min(all - first);
        gather.pace.record(places);
        recorder.pass("vpl: gather on", |pass| {
            if first == 0 {
                let offset = std::mem::offset_of!(Counters, remaining) as u64;
                pass.fill(gather.counters.slice(offset, size_of::<u32>() as u64), 0)?;
                pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
            }
            let over = Over::Stopped { first, count: places };
            self.dispatch(pass, wave, stopped.key, over)?;
            if first + places == all {
                pass.memory_barrier(Access::COMPUTE, Access::TRANSFER_READ);
                self.read_back(pass)?;
            }
            stage_barrier(pass);
            Ok(())
        })?;
        Ok(Some(part + u64::from(places)))
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "BG-8",
        name: "gathering from virtual lights under a bound, min(G, b) or max(d², B) (MET-V2)",
        role: Role::PartOf("SVO-G0"),
        limits: "A bound alone leaves out light near edges and corners, each its own part: of a sphere of radius R, max(d², B) leaves out B/(8R²).",
        sources: &[
            sources::KELLER_1997.whole(),
            sources::KOLLIG_KELLER_2006.whole(),
            sources::ENGELHARDT_2013.at("§4.5, §10.1 and §11.1"),
        ],
        shaders: &[
            "shaders/techniques/instant_radiosity/vpl_gather.comp",
            "shaders/techniques/instant_radiosity/connection.glsl",
            "shaders/transport/edge_bound.glsl",
        ],
        bias: Some(Bias::Biased("what a bound leaves out, unless it is compensated")),
        tests: &[
            "engine/src/transport/edge_bound.rs::bounds_hold_and_shares_make_them",
            "engine/src/transport/edge_bound.rs::points_at_one_place_have_a_share_that_is_a_number",
            "tests/tests/twins/edges.rs::edges_agree_with_their_twins",
            "tests/tests/twins/edges.rs::in_a_sphere_every_virtual_light_brings_the_same",
            "tests/tests/twins/edges.rs::distances_that_are_bounded_lose_what_the_sphere_says",
            "tests/tests/twins/edges.rs::squares_have_their_form_factors",
            "tests/tests/instant_radiosity/bounds.rs::bounds_leave_out_what_they_should",
            "tests/tests/instant_radiosity/scattering.rs::ink_agrees_with_the_path_tracer",
            "tests/tests/instant_radiosity/edge_cases.rs::pictures_do_not_depend_on_how_lights_are_shared_out",
        ],
        api: &["clerestory::transport::edge_bound"],
        settings: &["bound", "bound_value"],
        ..Row::of(file!())
    },
    Row {
        id: "BG-9",
        name: "compensation of bounds by eye paths that go on, until their weight is zero",
        role: Role::PartOf("SVO-G0"),
        limits: "Each step gathers from all virtual lights again, so that small bounds on G cost as much as path tracing with a gather a vertex.",
        sources: &[
            sources::KOLLIG_KELLER_2006.whole(),
            sources::ENGELHARDT_2013.at("§4.5.1"),
        ],
        shaders: &[
            "shaders/techniques/path/path_shade.comp",
            "shaders/techniques/instant_radiosity/vpl_gather.comp",
        ],
        bias: Some(Bias::Unbiased),
        tests: &[
            "tests/tests/twins/edges.rs::what_a_bound_leaves_of_a_wall_is_the_published_table",
            "tests/tests/instant_radiosity/bounds.rs::steps_of_compensation_leave_a_geometric_series",
            "tests/tests/instant_radiosity/bounds.rs::loose_bounds_compensate_nothing_and_tight_ones_trace_paths",
            "tests/tests/instant_radiosity/agreement.rs::compensated_bounds_agree_with_the_path_tracer",
            "tests/tests/instant_radiosity/agreement.rs::compensated_distances_agree_with_the_path_tracer_in_a_room",
            "tests/tests/instant_radiosity/agreement.rs::compensated_distances_agree_with_the_path_tracer_in_a_sphere",
        ],
        settings: &["compensation", "compensation_steps"],
        ..Row::of(file!())
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rough_vertices_gather_where_a_path_may_be_scattered_once_more() {
        let states = |text: &str| {
            let set: PathSet = text.parse().unwrap();
            // The first state is that of the eye; by how many others gather.
            let states = gathering_states(&set);
            (states & 1, states.count_ones())
        };
        // Direct light alone: the first rough vertex gathers, no other does.
        assert_eq!(states("L[DG]?S*E"), (1, 1));
        // Every vertex, as the last one before a mirror, the next, and all after it.
        assert_eq!(states("!L.*S[DG]S*E"), (1, 3));
        assert_eq!(states("L[DG]{0,3}S*E"), (1, 3));
        // In media the first vertex, and the next behind one in a medium and a mirror.
        assert_eq!(states("L[DG]?S*E|LS*([DGV]S+)*VS*E"), (1, 2));
    }
}
