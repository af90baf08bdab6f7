//! Eye subpaths joined to light subpaths: a stage between arrival and shading. Memory is that of the places, whatever the number of vertices.

use super::eye::EyeMemory;
use super::kernels::{Counters, check_sweeps, quota_of, rays_of_submission, set_of};
use super::settings::BidirectionalSettings;
use crate::Result;
use crate::gpu::interface::BindingSet;
use crate::gpu::shaders::constants::WALK_GROUP;
use crate::gpu::shaders::sets::{BidirectionalSet, WaveSet};
use crate::gpu::shaders::techniques::bidirectional::bdpt_connect;
use crate::gpu::{Access, ComputePipeline, Gpu, Pass, PipelineInfo, Recorder, TexelView};
use crate::transport::{GpuScene, surface_spec};
use crate::walk::{ArrivalStage, Places, StoppedPlaces, WalkKey, stage_barrier};

/// The kernel of connections.
pub(super) struct Connect {
    pipeline: ComputePipeline<bdpt_connect::Kernel>,
    connections: u32,
    bounces: [u32; 2],
    rays_at_once: u32,
}

/// Connections to the light subpaths of a pass, to be recorded with a wave of eye paths.
pub(super) struct ConnectStage<'a> {
    pub connect: &'a Connect,
    pub scene: &'a GpuScene,
    pub memory: &'a EyeMemory,
    pub vertices: &'a TexelView,
    pub count: u32,
    /// Light subpaths of the pass.
    pub walks: u32,
    pub key: WalkKey,
    pub camera_forward: [f32; 3],
    pub camera_measure: f32,
}

impl Connect {
    pub fn new(gpu: &Gpu, scene: &GpuScene, is_parallel: bool, settings: &BidirectionalSettings) -> Result<Self> {
        let traversal = scene.index_traversal();
        let spec = surface_spec!(bdpt_connect, scene, {
            has_multiple_scattering: scene.bsdf_features().multiple_scattering,
            separable_masking: false,
            has_alpha: scene.profile().has_alpha(),
            sampler_kind: settings.sampler as u32,
            parallel_camera: is_parallel,
            strategy: settings.strategies.kind(),
            connections: settings.connections,
            index_quota: quota_of(gpu, scene, settings, settings.connections)?,
            index_kind: traversal.kind(),
            ..Default::default()
        });
        Ok(Self {
            pipeline: traversal.pipeline(gpu, &spec)?,
            connections: settings.connections,
            bounces: settings.bounces(),
            rays_at_once: rays_of_submission(gpu),
        })
    }

    pub fn pipeline(&self) -> PipelineInfo {
        self.pipeline.info()
    }
}

impl ConnectStage<'_> {
    fn push(&self) -> bdpt_connect::Push {
        let [lower, upper] = self.scene.bounds().map(|corner| corner.to_array());
        bdpt_connect::Push {
            scene_lower: lower,
            least_bounces: self.connect.bounces[0],
            scene_upper: upper,
            most_bounces: self.connect.bounces[1],
            key: self.key,
            camera_forward: self.camera_forward,
            camera_measure: self.camera_measure,
            vertices: self.count,
            scale: self.count as f32 / (self.connect.connections as f32 * self.walks as f32),
            first_place: 0,
            goes_on: 0,
        }
    }

    fn set(&self) -> BidirectionalSet<'_> {
        let memory = self.memory;
        BidirectionalSet {
            subpath_weights: memory.weights.view(),
            connection_states: memory.states.view(),
            bdpt_counters: memory.counts.device.view(),
            ..set_of(self.vertices, &memory.weights)
        }
    }
}

impl ArrivalStage for ConnectStage<'_> {
    fn record(&self, recorder: &mut Recorder, wave: &WaveSet<'_>, places: Places<'_>) -> Result<()> {
        let (index, scene, own) = (self.scene.index_set(), self.scene.scene_set(), self.set());
        recorder.pass("bidirectional: connect", |pass| {
            let sets: [&dyn BindingSet<'_>; 4] = [wave, &index, &scene, &own];
            pass.dispatch_indirect(&self.connect.pipeline, &sets, &self.push(), places.items)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    fn reset(&self, pass: &mut Pass<'_>) -> Result<()> {
        pass.fill(self.memory.counts.device.view(), 0)
    }

    fn read_back(&self, pass: &mut Pass<'_>) -> Result<()> {
        let counts = &self.memory.counts;
        pass.copy(counts.device.view(), counts.readback.view())
    }

    /// Sweep after sweep over the places, until none has connections left; after each the device's count of these is read.
    fn record_stopped(
        &self,
        recorder: &mut Recorder,
        wave: &WaveSet<'_>,
        stopped: StoppedPlaces,
        part: u64,
    ) -> Result<Option<u64>> {
        let (connect, counts) = (self.connect, &self.memory.counts);
        let places = (connect.rays_at_once / connect.connections).next_multiple_of(WALK_GROUP);
        let ranges = u64::from(stopped.places.div_ceil(places)).max(1);
        let (sweep, range) = (part / ranges, part % ranges);
        if range == 0 && sweep > 0 {
            if counts.read()?.remaining == 0 {
                return Ok(None);
            }
            check_sweeps("bdpt_connect", sweep)?;
        }
        let (index, scene, own) = (self.scene.index_set(), self.scene.scene_set(), self.set());
        let push = bdpt_connect::Push {
            first_place: range as u32 * places,
            goes_on: 1,
            ..self.push()
        };
        recorder.pass("bidirectional: connect on", |pass| {
            if range == 0 {
                let offset = std::mem::offset_of!(Counters, remaining) as u64;
                pass.fill(counts.device.slice(offset, size_of::<u32>() as u64), 0)?;
                pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
            }
            let groups = [connect.pipeline.groups_for(places.min(stopped.places)), 1, 1];
            pass.dispatch(&connect.pipeline, &[wave, &index, &scene, &own], &push, groups)?;
            if range + 1 == ranges {
                pass.memory_barrier(Access::COMPUTE, Access::TRANSFER_READ);
                self.read_back(pass)?;
            }
            stage_barrier(pass);
            Ok(())
        })?;
        Ok(Some(part + 1))
    }
}
