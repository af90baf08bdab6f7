//! Queries of the photon map where eye paths have arrived: a stage of the path tracer's bounces.

use super::map::PhotonMap;
use super::settings::PhotonSettings;
use crate::Result;
use crate::gpu::shaders::constants::{LOBE_DIFFUSE, LOBE_REFLECTION, PATH_SET_DEAD, PATH_SET_STATE_BITS};
use crate::gpu::shaders::sets::{PathBuffers, PhotonMapSet};
use crate::gpu::shaders::techniques::photon_mapping::photon_gather;
use crate::gpu::{Buffer, BufferDesc, BufferView, Category, ComputePipeline, Gpu, PipelineInfo, Recorder};
use crate::transport::path_tracer::ArrivalStage;
use crate::transport::path_tracer::stages::stage_barrier;
use crate::transport::{GpuScene, PathSet};

/// Exact counts of queries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct GatherCounts {
    /// Points at which the map was asked.
    pub queries: u64,
    /// Kernels that held them.
    pub photons: u64,
}

/// The kernels of queries.
pub(super) struct Gather {
    gpu: Gpu,
    spec: photon_gather::Spec,
    query: ComputePipeline<photon_gather::Kernel>,
    counters: Buffer,
    gather_states: u32,
    caustic_states: u32,
    bounces: [u32; 2],
}

/// Queries of one map, to be recorded with a wave.
pub(super) struct GatherStage<'a> {
    gather: &'a Gather,
    linear: ComputePipeline<photon_gather::Kernel>,
    scene: &'a GpuScene,
    map: &'a PhotonMap,
    /// Of stored fluxes, in W a photon.
    scale: f32,
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
        let spec = photon_gather::Spec {
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
            compact_quota: settings.query_quota,
            linear: false,
            ..Default::default()
        };
        let (gather_states, caustic_states) = gathering_states(settings, eye);
        let bytes = size_of::<Counters>() as u64;
        let counters = gpu.buffer(&BufferDesc::storage("gather counters", bytes, Category::Work))?;
        // Memory may hold what another buffer left.
        gpu.upload(&counters, 0, &[Counters::default()])?;
        Ok(Self {
            query: gpu.compute_pipeline(&spec)?,
            spec,
            counters,
            gather_states,
            caustic_states,
            bounces: [set.min_bounces(), set.max_bounces().unwrap_or(u32::MAX)],
            gpu: gpu.clone(),
        })
    }

    pub fn pipeline(&self) -> PipelineInfo {
        self.query.info()
    }

    /// Queries of a map whose photons' fluxes are to be multiplied by `scale`.
    pub fn stage<'a>(&'a self, scene: &'a GpuScene, map: &'a PhotonMap, scale: f64) -> Result<GatherStage<'a>> {
        let linear = photon_gather::Spec {
            linear: true,
            ..self.spec
        };
        Ok(GatherStage {
            gather: self,
            // Compiled by the driver only if it is dispatched.
            linear: self.gpu.compute_pipeline(&linear)?,
            scene,
            map,
            scale: scale as f32,
        })
    }

    /// Counts since they were read last.
    pub fn take_counts(&self) -> Result<GatherCounts> {
        let counters = self.gpu.read::<Counters>(self.counters.view(), 1)?[0];
        self.gpu.upload(&self.counters, 0, &[Counters::default()])?;
        Ok(GatherCounts {
            queries: u64::from(counters.queries),
            photons: u64::from(counters.photons[0]) | u64::from(counters.photons[1]) << 32,
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
            pass.dispatch_indirect(&self.gather.query, &[paths, &scene, &map], &self.push(0, 0), items)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    fn record_stopped(&self, recorder: &mut Recorder, paths: &PathBuffers<'_>, items: BufferView<'_>) -> Result<()> {
        let (scene, map) = (self.scene.scene_set(), self.set());
        recorder.pass("photon: gather all", |pass| {
            for first in (0..self.map.count).step_by(self.gather.spec.compact_quota as usize) {
                let last = first.saturating_add(self.gather.spec.compact_quota).min(self.map.count);
                pass.dispatch_indirect(&self.linear, &[paths, &scene, &map], &self.push(first, last), items)?;
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
