//! Queries of the photon map where eye paths have arrived: a stage of the path tracer's bounces.

use super::map::PhotonMap;
use super::settings::{MapQuery, PhotonSettings};
use crate::accel::trace::wide_counter;
use crate::gpu::shaders::constants::{LOBE_DIFFUSE, LOBE_REFLECTION, PATH_SET_DEAD, PATH_SET_STATE_BITS};
use crate::gpu::shaders::sets::{PathBuffers, PhotonMapSet};
use crate::gpu::shaders::techniques::photon_mapping::{photon_gather, photon_gather_packet};
use crate::gpu::{Buffer, BufferDesc, BufferView, Category, ComputePipeline, Gpu, PipelineInfo, Recorder};
use crate::transport::path_tracer::ArrivalStage;
use crate::transport::path_tracer::stages::stage_barrier;
use crate::transport::{GpuScene, PathSet};
use crate::{Error, Result};

/// Nodes and records of each of the rounds in which neighbours are found, and of the sum: six of them stay below the software driver's cap.
const NEAREST_QUOTA: u32 = 10_000;

/// Exact counts of queries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct GatherCounts {
    /// Points at which the map was asked.
    pub queries: u64,
    /// Kernels that held them.
    pub photons: u64,
}

/// Each point by itself, or those of a subgroup together.
enum Query {
    Single(ComputePipeline<photon_gather::Kernel>),
    Packet(ComputePipeline<photon_gather_packet::Kernel>),
}

/// What is done where a quota has stopped a query.
enum Linear {
    /// All records are gone through. The driver compiles it only if it is dispatched.
    Records(ComputePipeline<photon_gather::Kernel>),
    /// Refused: a pass through all records cannot find neighbours.
    Refuse,
}

/// The kernels of queries.
pub(super) struct Gather {
    gpu: Gpu,
    query: Query,
    linear: Linear,
    /// Records of a dispatch that goes through all of them.
    quota: u32,
    counters: Buffer,
    gather_states: u32,
    caustic_states: u32,
    bounces: [u32; 2],
}

/// Queries of one map, to be recorded with a wave.
pub(super) struct GatherStage<'a> {
    gather: &'a Gather,
    scene: &'a GpuScene,
    map: &'a PhotonMap,
    /// Of stored fluxes, in W a photon.
    scale: f32,
    neighbors: u32,
    radius: f32,
}

type Counters = photon_gather::GatherCounters;

impl Gather {
    /// For eye paths of the set `eye`.
    pub fn new(gpu: &Gpu, scene: &GpuScene, settings: &PhotonSettings, eye: &PathSet) -> Result<Self> {
        let (profile, bsdf) = (scene.profile(), scene.bsdf_features());
        let set = &settings.path_set;
        // Photons have been scattered once before they land, and at the point that gathers them.
        let least = if settings.direct_photons { 1 } else { 2 };
        let counts_bounces = set.min_bounces() > least || set.max_bounces().is_some();
        // Both entry points have the same constants.
        macro_rules! spec {
            ($shader:ident, $linear:expr) => {
                $shader::Spec {
                    has_metal: bsdf.metal,
                    has_conductor: bsdf.conductor,
                    has_specular_layer: bsdf.specular_layer,
                    has_transmission: bsdf.transmission,
                    has_multiple_scattering: false,
                    separable_masking: false,
                    has_textures: profile.has_textures,
                    has_shading_normals: profile.has_shading_normals,
                    has_normal_maps: profile.has_normal_maps,
                    has_vertex_colors: profile.has_vertex_colors,
                    has_absorption: profile.has_absorption,
                    has_unlit: profile.has_unlit,
                    has_path_automaton: eye.has_automaton(),
                    tells_caustics: settings.final_gather,
                    profile: settings.profile as u32,
                    counts_bounces,
                    compact_quota: if settings.neighbors > 0 {
                        NEAREST_QUOTA
                    } else {
                        settings.query_quota
                    },
                    nearest: settings.neighbors > 0,
                    linear: $linear,
                    ..Default::default()
                }
            };
        }
        let query = match settings.query {
            MapQuery::Packet if gpu.caps().subgroup.vote => {
                Query::Packet(gpu.compute_pipeline(&spec!(photon_gather_packet, false))?)
            }
            MapQuery::Packet => {
                return Err(Error::MissingFeature {
                    feature: "VK_SUBGROUP_FEATURE_VOTE_BIT".into(),
                    needed_by: "photon_gather_packet".into(),
                    device: gpu.caps().device.clone(),
                    instead: "ask the map point by point: \"query\": \"single\"".into(),
                });
            }
            MapQuery::Single => Query::Single(gpu.compute_pipeline(&spec!(photon_gather, false))?),
        };
        let linear = if settings.neighbors > 0 {
            Linear::Refuse
        } else {
            Linear::Records(gpu.compute_pipeline(&spec!(photon_gather, true))?)
        };
        let (gather_states, caustic_states) = gathering_states(settings, eye);
        let bytes = size_of::<Counters>() as u64;
        let counters = gpu.buffer(&BufferDesc::storage("gather counters", bytes, Category::Work))?;
        // Memory may hold what another buffer left.
        gpu.upload(&counters, 0, &[Counters::default()])?;
        Ok(Self {
            query,
            linear,
            quota: settings.query_quota,
            counters,
            gather_states,
            caustic_states,
            bounces: [set.min_bounces(), set.max_bounces().unwrap_or(u32::MAX)],
            gpu: gpu.clone(),
        })
    }

    pub fn pipeline(&self) -> PipelineInfo {
        match &self.query {
            Query::Single(kernel) => kernel.info(),
            Query::Packet(kernel) => kernel.info(),
        }
    }

    /// Queries of a map whose photons' fluxes are to be multiplied by `scale`, for `neighbors` within `radius` where these are asked for.
    pub fn stage<'a>(
        &'a self,
        scene: &'a GpuScene,
        map: &'a PhotonMap,
        scale: f64,
        (neighbors, radius): (u32, f64),
    ) -> GatherStage<'a> {
        GatherStage {
            gather: self,
            scene,
            map,
            scale: scale as f32,
            neighbors,
            radius: radius as f32,
        }
    }

    /// Counts since they were read last.
    pub fn take_counts(&self) -> Result<GatherCounts> {
        let counters = self.gpu.read::<Counters>(self.counters.view(), 1)?[0];
        self.gpu.upload(&self.counters, 0, &[Counters::default()])?;
        Ok(GatherCounts {
            queries: u64::from(counters.queries),
            photons: wide_counter(counters.photons),
        })
    }
}

impl GatherStage<'_> {
    fn push(&self, first: u32, last: u32) -> photon_gather::Push {
        let [lower, upper] = self.scene.bounds();
        photon_gather::Push {
            scene_lower: lower.to_array(),
            gather_states: self.gather.gather_states,
            scene_upper: upper.to_array(),
            caustic_states: self.gather.caustic_states,
            root: self.map.root,
            least_bounces: self.gather.bounces[0],
            most_bounces: self.gather.bounces[1],
            scale: self.scale,
            first,
            last,
            neighbors: self.neighbors,
            radius: self.radius,
        }
    }

    fn set(&self) -> PhotonMapSet<'_> {
        PhotonMapSet {
            photon_pairs: &self.map.pairs,
            photon_map_records: &self.map.records,
            gather_counters: self.gather.counters.view(),
        }
    }
}

impl ArrivalStage for GatherStage<'_> {
    fn record(&self, recorder: &mut Recorder, paths: &PathBuffers<'_>, items: BufferView<'_>) -> Result<()> {
        let (scene, map) = (self.scene.scene_set(), self.set());
        recorder.pass("photon: gather", |pass| {
            match &self.gather.query {
                Query::Single(kernel) => {
                    pass.dispatch_indirect(kernel, &[paths, &scene, &map], &self.push(0, 0), items)?;
                }
                Query::Packet(kernel) => {
                    pass.dispatch_indirect(kernel, &[paths, &scene, &map], &bytemuck::cast(self.push(0, 0)), items)?;
                }
            }
            stage_barrier(pass);
            Ok(())
        })
    }

    fn record_stopped(&self, recorder: &mut Recorder, paths: &PathBuffers<'_>, items: BufferView<'_>) -> Result<()> {
        let Linear::Records(linear) = &self.gather.linear else {
            return Err(Error::Overflow {
                kernel: "photon_gather".into(),
                what: "steps of a query for neighbours".into(),
                needed: u64::from(NEAREST_QUOTA) + 1,
                capacity: u64::from(NEAREST_QUOTA),
                instead: "look for neighbours within a smaller radius, or trace fewer photons a pass".into(),
            });
        };
        let (scene, map) = (self.scene.scene_set(), self.set());
        recorder.pass("photon: gather all", |pass| {
            for first in (0..self.map.count).step_by(self.gather.quota as usize) {
                let last = first.saturating_add(self.gather.quota).min(self.map.count);
                pass.dispatch_indirect(linear, &[paths, &scene, &map], &self.push(first, last), items)?;
                stage_barrier(pass);
            }
            Ok(())
        })
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
