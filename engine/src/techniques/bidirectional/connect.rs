//! Eye subpaths joined to light subpaths: a stage between arrival and shading. Memory is that of the places, whatever the number of vertices.

use super::eye::EyeMemory;
use super::kernels::{Counters, check_sweeps, media_set_of, quota_of, stretches_of};
use super::settings::BidirectionalSettings;
use crate::Result;
use crate::gpu::interface::BindingSet;
use crate::gpu::shaders::constants::NO_MEDIUM;
use crate::gpu::shaders::sets::{BidirectionalMediaSet, BidirectionalSet, WaveSet};
use crate::gpu::shaders::techniques::bidirectional::{bdpt_connect, bdpt_medium_connect};
use crate::gpu::{Access, BufferView, ComputePipeline, Gpu, Pass, PipelineInfo, Recorder, TexelView};
use crate::transport::{GpuScene, surface_spec};
use crate::walk::{ArrivalStage, ConnectionPace, Places, StoppedPlaces, WalkKey, stage_barrier};

/// The kernel of connections.
pub(super) struct Connect {
    kernel: ConnectKernel,
    connections: u32,
    bounces: [u32; 2],
    pace: ConnectionPace,
}

enum ConnectKernel {
    Surfaces(ComputePipeline<bdpt_connect::Kernel>),
    /// In scenes with media.
    Media(ComputePipeline<bdpt_medium_connect::Kernel>),
}

/// The places of a dispatch.
enum Over<'a> {
    /// All of the queue, by indirect arguments.
    All(BufferView<'a>),
    /// So many from that one on, which have stopped.
    Stopped { first: u32, count: u32 },
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
        let media = scene.profile().media;
        let (kernel, rays) = if media.any() {
            ConnectKernel::in_media(gpu, scene, is_parallel, settings)?
        } else {
            let kernel = ConnectKernel::on_surfaces(gpu, scene, is_parallel, settings)?;
            (kernel, settings.connections)
        };
        Ok(Self {
            kernel,
            connections: settings.connections,
            bounces: settings.bounces(),
            pace: ConnectionPace::new(gpu.caps().kind, rays, media.heterogeneous),
        })
    }

    pub fn pipeline(&self) -> PipelineInfo {
        match &self.kernel {
            ConnectKernel::Surfaces(kernel) => kernel.info(),
            ConnectKernel::Media(kernel) => kernel.info(),
        }
    }

    /// A submission in which the stage may have been recorded took so long.
    pub fn submitted(&mut self, seconds: f64) {
        self.pace.submitted(seconds);
    }
}

impl ConnectKernel {
    fn on_surfaces(gpu: &Gpu, scene: &GpuScene, is_parallel: bool, settings: &BidirectionalSettings) -> Result<Self> {
        let traversal = scene.index_traversal();
        let spec = surface_spec!(bdpt_connect, scene, {
            has_multiple_scattering: scene.bsdf_features().multiple_scattering,
            separable_masking: false,
            has_alpha: scene.profile().has_alpha(),
            has_media: false,
            has_path_automaton: settings.has_states(),
            sampler_kind: settings.sampler as u32,
            parallel_camera: is_parallel,
            strategy: settings.strategies.kind(),
            connections: settings.connections,
            index_quota: quota_of(gpu, scene, settings, settings.connections)?,
            index_kind: traversal.kind(),
            ..Default::default()
        });
        traversal.pipeline(gpu, &spec).map(Self::Surfaces)
    }

    /// With the stretches of shadow rays that a place takes in a dispatch.
    fn in_media(
        gpu: &Gpu,
        scene: &GpuScene,
        is_parallel: bool,
        settings: &BidirectionalSettings,
    ) -> Result<(Self, u32)> {
        let (traversal, media) = (scene.index_traversal(), scene.profile().media);
        let (stretches, index_quota) = stretches_of(gpu, scene, settings, true)?;
        let spec = surface_spec!(bdpt_medium_connect, scene, {
            has_multiple_scattering: scene.bsdf_features().multiple_scattering,
            separable_masking: false,
            has_alpha: scene.profile().has_alpha(),
            has_media: true,
            has_grids: media.heterogeneous,
            has_homogeneous: media.homogeneous,
            has_path_automaton: settings.has_states(),
            sampler_kind: settings.sampler as u32,
            parallel_camera: is_parallel,
            strategy: settings.strategies.kind(),
            connections: settings.connections,
            stretches,
            index_quota,
            index_kind: traversal.kind(),
            ..Default::default()
        });
        Ok((Self::Media(traversal.pipeline(gpu, &spec)?), stretches))
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
            ..memory.set_with(self.vertices)
        }
    }

    fn dispatch(&self, pass: &mut Pass<'_>, wave: &WaveSet<'_>, over: Over<'_>) -> Result<()> {
        let (index, scene, own) = (self.scene.index_set(), self.scene.scene_set(), self.set());
        let mut push = self.push();
        if let Over::Stopped { first, .. } = over {
            (push.first_place, push.goes_on) = (first, 1);
        }
        match &self.connect.kernel {
            ConnectKernel::Surfaces(kernel) => {
                let sets: [&dyn BindingSet<'_>; 4] = [wave, &index, &scene, &own];
                match over {
                    Over::All(places) => pass.dispatch_indirect(kernel, &sets, &push, places),
                    Over::Stopped { count, .. } => {
                        pass.dispatch(kernel, &sets, &push, [kernel.groups_for(count), 1, 1])
                    }
                }
            }
            ConnectKernel::Media(kernel) => {
                let media = BidirectionalMediaSet {
                    medium_connection_states: self.memory.states.view(),
                    ..media_set_of(self.scene, &self.memory.weights)
                };
                let sets: [&dyn BindingSet<'_>; 5] = [wave, &index, &scene, &own, &media];
                let push = self.push_in_media(push);
                match over {
                    Over::All(places) => pass.dispatch_indirect(kernel, &sets, &push, places),
                    Over::Stopped { count, .. } => {
                        pass.dispatch(kernel, &sets, &push, [kernel.groups_for(count), 1, 1])
                    }
                }
            }
        }
    }

    /// The same for scenes with media.
    fn push_in_media(&self, told: bdpt_connect::Push) -> bdpt_medium_connect::Push {
        bdpt_medium_connect::Push {
            scene_lower: told.scene_lower,
            least_bounces: told.least_bounces,
            scene_upper: told.scene_upper,
            most_bounces: told.most_bounces,
            key: told.key,
            camera_forward: told.camera_forward,
            camera_measure: told.camera_measure,
            vertices: told.vertices,
            scale: told.scale,
            first_place: told.first_place,
            goes_on: told.goes_on,
            surrounding: self.scene.surrounding().unwrap_or(NO_MEDIUM),
        }
    }
}

impl ArrivalStage for ConnectStage<'_> {
    fn record(&self, recorder: &mut Recorder, wave: &WaveSet<'_>, places: Places<'_>) -> Result<()> {
        recorder.pass("bidirectional: connect", |pass| {
            self.dispatch(pass, wave, Over::All(places.items))?;
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

    /// Sweep after sweep over the places, until none has connections left; after each the device's count of these is read. Parts count places of all sweeps. The first sweep, in which most
    /// places go on, tells how many a driver that watches has time for.
    fn record_stopped(
        &self,
        recorder: &mut Recorder,
        wave: &WaveSet<'_>,
        stopped: StoppedPlaces,
        part: u64,
    ) -> Result<Option<u64>> {
        let (connect, counts) = (self.connect, &self.memory.counts);
        let all = stopped.places.max(1);
        let (sweep, first) = (part / u64::from(all), (part % u64::from(all)) as u32);
        if first == 0 && sweep > 0 {
            if counts.read()?.remaining == 0 {
                return Ok(None);
            }
            check_sweeps("bdpt_connect", sweep)?;
        }
        let count = connect.pace.places().min(all - first);
        if sweep == 0 {
            connect.pace.record(count);
        }
        recorder.pass("bidirectional: connect on", |pass| {
            if first == 0 {
                let offset = std::mem::offset_of!(Counters, remaining) as u64;
                pass.fill(counts.device.slice(offset, size_of::<u32>() as u64), 0)?;
                pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
            }
            self.dispatch(pass, wave, Over::Stopped { first, count })?;
            if first + count == all {
                pass.memory_barrier(Access::COMPUTE, Access::TRANSFER_READ);
                self.read_back(pass)?;
            }
            stage_barrier(pass);
            Ok(())
        })?;
        Ok(Some(part + u64::from(count)))
    }
}
