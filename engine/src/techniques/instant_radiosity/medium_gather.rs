//! Gathering from virtual lights in scenes with media: the kernel that stands in for that of surfaces alone (`gather.rs`), whose places may be collisions.

use super::gather::{GatherStage, lights_beside};
use super::settings::VirtualLightSettings;
use crate::Result;
use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::interface::BindingSet;
use crate::gpu::shaders::constants::{CONNECTION_GRID_QUOTA, GRID_WALK_QUOTA, INSTANCE_SEARCH_STEPS, NO_MEDIUM};
use crate::gpu::shaders::sets::WaveSet;
use crate::gpu::shaders::techniques::instant_radiosity::{vpl_gather, vpl_medium_gather};
use crate::gpu::shaders::types::MediumGatherState;
use crate::gpu::{BufferView, ComputePipeline, DeviceKind, Gpu, Pass, PipelineInfo, SOFTWARE_LOOP_CAP};
use crate::techniques::PathTracerSettings;
use crate::transport::edge_bound::EdgeBound;
use crate::transport::{GpuScene, PathSet, surface_spec};
use crate::walk::{WalkKey, grid_walk_iterations};

/// Both kernels count alike.
const _: () =
    assert!(size_of::<vpl_gather::VirtualLightCounters>() == size_of::<vpl_medium_gather::VirtualLightCounters>());

/// The kernel.
pub(super) struct MediumGather {
    pipeline: ComputePipeline<vpl_medium_gather::Kernel>,
}

/// Lanes of the widest software devices.
const LANES_MAX: u32 = 16;
/// A connection has room beside the walk of its place.
const _: () = assert!(
    grid_walk_iterations(LANES_MAX, GRID_WALK_QUOTA) + 2 * grid_walk_iterations(LANES_MAX, CONNECTION_GRID_QUOTA)
        < SOFTWARE_LOOP_CAP
);

/// The places of a dispatch.
pub(super) enum Over<'a> {
    /// All of the queue, by indirect arguments.
    All(BufferView<'a>),
    /// So many from that one on, which have stopped.
    Stopped { first: u32, count: u32 },
}

impl MediumGather {
    /// What a place keeps between dispatches.
    pub const STATE_BYTES: u64 = size_of::<MediumGatherState>() as u64;

    /// For eye paths of the set `eye`; with the stretches of shadow rays that a place takes in a dispatch.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: &VirtualLightSettings,
        eye: &PathSet,
        edge_bound: EdgeBound,
    ) -> Result<(Self, u32)> {
        let profile = scene.profile();
        // A boundary is looked up besides.
        let search = if profile.keeps_instances {
            INSTANCE_SEARCH_STEPS
        } else {
            0
        };
        let lanes = match gpu.caps().kind {
            DeviceKind::Cpu => gpu.caps().subgroup_size.max(1),
            _ => 1,
        };
        // The walk of the eye path's ray, and one of each shadow ray's stretches.
        let [of_place, of_light] = if profile.media.heterogeneous {
            [GRID_WALK_QUOTA, CONNECTION_GRID_QUOTA].map(|quota| grid_walk_iterations(lanes, quota))
        } else {
            [0, 0]
        };
        let beside = [of_place, search + of_light];
        let (lights_at_once, index_quota) = lights_beside(gpu, scene, settings.lights_at_once, beside)?;
        let traversal = scene.index_traversal();
        let spec = surface_spec!(vpl_medium_gather, scene, {
            has_multiple_scattering: scene.bsdf_features().multiple_scattering,
            separable_masking: false,
            has_alpha: profile.has_alpha(),
            has_media: true,
            has_grids: profile.media.heterogeneous,
            has_homogeneous: profile.media.homogeneous,
            // As those of the eye paths, whose ways through grids end where such samples do.
            has_airlight: PathTracerSettings::default().equiangular && scene.airlight_helps(),
            has_path_automaton: eye.has_automaton(),
            sampler_kind: settings.sampler as u32,
            edge_bound: edge_bound.kind(),
            counts_bounces: settings.least_bounces > 2 || settings.most().is_some(),
            lights_at_once,
            index_quota,
            index_kind: traversal.kind(),
            ..Default::default()
        });
        let pipeline = traversal.pipeline(gpu, &spec)?;
        Ok((Self { pipeline }, lights_at_once))
    }

    pub fn pipeline(&self) -> PipelineInfo {
        self.pipeline.info()
    }

    /// Records it, with what surfaces' kernel would be told, for walks whose random numbers are keyed so.
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        stage: &GatherStage<'_>,
        wave: &WaveSet<'_>,
        (told, key): (vpl_gather::Push, WalkKey),
        over: Over<'_>,
    ) -> Result<()> {
        let mut push = vpl_medium_gather::Push {
            scene_lower: told.scene_lower,
            states: told.states,
            scene_upper: told.scene_upper,
            least_bounces: told.least_bounces,
            key,
            most_bounces: told.most_bounces,
            lights: told.lights,
            scale: told.scale,
            edge_bound: told.edge_bound,
            seed: told.seed,
            first_place: 0,
            goes_on: 0,
            surrounding: stage.scene.surrounding().unwrap_or(NO_MEDIUM),
        };
        let (index, of_scene) = (stage.scene.index_set(), stage.scene.scene_set());
        let (surfaces, media) = (stage.set(), stage.scene.media_set());
        let own = vpl_medium_gather::Set3 {
            virtual_light_texels: surfaces.virtual_light_texels,
            medium_gather_states: surfaces.virtual_light_states,
            gather_counters: surfaces.gather_counters,
            light_departures: surfaces.light_departures,
            media_records: media.media_records,
            media_densities: media.media_densities,
            media_majorants: media.media_majorants,
        };
        let sets: [&dyn BindingSet<'_>; 4] = [wave, &index, &of_scene, &own];
        match over {
            Over::All(places) => pass.dispatch_indirect(&self.pipeline, &sets, &push, places),
            Over::Stopped { first, count } => {
                (push.first_place, push.goes_on) = (first, 1);
                let groups = [self.pipeline.groups_for(count), 1, 1];
                pass.dispatch(&self.pipeline, &sets, &push, groups)
            }
        }
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-VPL-MEDIA",
    name: "virtual lights in media: collisions of walks, with the phase function as their lobe, that light surfaces and collisions of eye paths through what media let through",
    role: Role::PartOf("SVO-G0"),
    limits: "Light from infinity in an endless medium is refused, as are endless media that emit everywhere, cuts, shares of the potential, fractional walks and steps of compensation; light that a mirror sends into a medium is found by eye paths alone; without a bound the variance of lights near a collision has no bound either.",
    sources: &[sources::KELLER_1997.whole(), sources::KOLLIG_KELLER_2006.whole()],
    shaders: &[
        "shaders/techniques/instant_radiosity/vpl_medium.comp",
        "shaders/techniques/instant_radiosity/vpl_medium_append.comp",
        "shaders/techniques/instant_radiosity/vpl_medium_gather.comp",
        "shaders/techniques/instant_radiosity/medium_connection.glsl",
        "shaders/techniques/instant_radiosity/collision_light.glsl",
        "shaders/techniques/path/path_medium.comp",
        "shaders/transport/media_tracking.glsl",
        "shaders/walk/flight.glsl",
        "shaders/walk/medium_ray.glsl",
    ],
    bias: Some(Bias::Unbiased),
    tests: &[
        "tests/tests/instant_radiosity/media.rs::lights_at_collisions_agree_with_the_path_tracer",
        "tests/tests/instant_radiosity/media.rs::lights_at_forward_collisions_agree_with_the_path_tracer",
        "tests/tests/instant_radiosity/media.rs::lights_in_a_body_agree_with_the_path_tracer",
        "tests/tests/instant_radiosity/media.rs::lights_in_grids_agree_with_the_path_tracer",
        "tests/tests/instant_radiosity/media.rs::lights_in_grids_beside_a_homogeneous_medium_agree_with_the_path_tracer",
        "tests/tests/instant_radiosity/media.rs::media_that_emit_send_walks",
        "tests/tests/instant_radiosity/media.rs::bounds_in_media_are_compensated",
        "tests/tests/instant_radiosity/media.rs::tight_bounds_in_media_are_compensated",
        "tests/tests/instant_radiosity/media.rs::distances_in_media_are_compensated",
        "tests/tests/instant_radiosity/media.rs::loose_bounds_in_media_compensate_nothing",
        "tests/tests/instant_radiosity/media.rs::furnaces_with_fog_are_even",
        "tests/tests/instant_radiosity/media.rs::light_off_mirrors_into_media_is_the_eye_paths",
        "tests/tests/instant_radiosity/media.rs::light_off_mirrors_into_media_is_the_eye_paths_without_a_bound",
        "tests/tests/instant_radiosity/media.rs::walks_through_media_are_counted",
        "tests/tests/instant_radiosity/media.rs::pictures_of_media_do_not_depend_on_how_work_is_shared_out",
        "tests/tests/instant_radiosity/media.rs::pictures_of_grids_do_not_depend_on_how_work_is_shared_out",
        "tests/tests/instant_radiosity/media.rs::long_walks_through_grids_do_not_depend_on_how_many_share_a_dispatch",
        "tests/tests/instant_radiosity/media.rs::threads_of_the_driver_never_show_in_media",
        "tests/tests/instant_radiosity/media.rs::what_media_have_no_lights_for_is_refused_by_name",
        "engine/src/techniques/instant_radiosity/settings.rs::eye_paths_in_media_also_have_what_mirrors_send_there",
    ],
    settings: &["walks", "bound", "compensation"],
    ..Row::of(file!())
}];
