//! Rays of eye paths along photons' second flights, which tell whether the planes that they meet are seen: a part of the stage between arrival and scattering, where the map has planes.

use crate::gpu::interface::BindingSet;
use crate::gpu::shaders::constants::{NO_MEDIUM, PLANE_RAY_ENDED, WORK_UNIT};
use crate::gpu::shaders::sets::WaveSet;
use crate::gpu::shaders::techniques::photon_mapping::photon_plane_rays;
use crate::gpu::shaders::types::PlaneRay;
use crate::gpu::{
    Access, Buffer, BufferDesc, BufferView, Category, ComputePipeline, Gpu, Pass, PipelineInfo, wide_counter,
};
use crate::transport::GpuScene;
use crate::walk::{Places, RAY_QUOTA, StoppedPlaces, WalkKey, ray_quota, stage_barrier};
use crate::{Error, Result};

/// Sweeps over rays that were stopped before they count as endless.
pub(in crate::techniques::photon_mapping) const SWEEPS_MAX: u64 = 1 << 16;

type Counters = photon_plane_rays::PlaneRayCounters;

/// Where [`Counters::remaining`](Counters) is.
const REMAINING: u64 = std::mem::offset_of!(Counters, remaining) as u64;

/// The kernel, with the rays of a wave.
pub(in crate::techniques::photon_mapping) struct PlaneRays {
    kernel: ComputePipeline<photon_plane_rays::Kernel>,
    rays: Buffer,
    counters: Buffer,
    counters_readback: Buffer,
}

impl PlaneRays {
    /// For up to `slots` eye paths at once.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], and as [`ray_quota`].
    pub fn new(gpu: &Gpu, scene: &GpuScene, slots: u32) -> Result<Self> {
        let (profile, traversal) = (scene.profile(), scene.index_traversal());
        let has_alpha = profile.has_alpha();
        let spec = photon_plane_rays::Spec {
            has_alpha,
            has_media: true,
            has_textures: has_alpha && profile.has_textures,
            has_vertex_colors: has_alpha && profile.has_vertex_colors,
            has_instances: has_alpha && profile.keeps_instances,
            index_quota: ray_quota(gpu, scene, RAY_QUOTA)?,
            index_kind: traversal.kind(),
            resumes: true,
            work_least: WORK_UNIT,
            ..Default::default()
        };
        let work = |name: &str, bytes: u64| gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work));
        let bytes = size_of::<Counters>() as u64;
        Ok(Self {
            kernel: traversal.pipeline(gpu, &spec)?,
            rays: work("plane rays", size_of::<PlaneRay>() as u64 * u64::from(slots))?,
            counters: work("plane ray counters", bytes)?,
            counters_readback: gpu.buffer(&BufferDesc::readback("plane ray counters", bytes))?,
        })
    }

    pub fn pipeline(&self) -> PipelineInfo {
        self.kernel.info()
    }

    /// The rays, by place.
    pub fn rays(&self) -> BufferView<'_> {
        self.rays.view()
    }

    /// Before a wave: no ray is under way.
    pub fn reset(&self, pass: &mut Pass<'_>) -> Result<()> {
        pass.fill(self.rays.view(), PLANE_RAY_ENDED)?;
        pass.fill(self.counters.view(), 0)
    }

    /// Records the rays of all places that have one.
    pub fn record(&self, pass: &mut Pass<'_>, scene: &GpuScene, wave: &WaveSet<'_>, places: Places<'_>) -> Result<()> {
        let (index, of_scene, own) = (scene.index_set(), scene.scene_set(), self.set());
        let sets: [&dyn BindingSet<'_>; 4] = [wave, &index, &of_scene, &own];
        pass.dispatch_indirect(&self.kernel, &sets, &push(scene, places.key, false), places.items)?;
        stage_barrier(pass);
        Ok(())
    }

    /// Rays of the last wave.
    pub fn count(&self) -> Result<u64> {
        Ok(wide_counter(self.counters_readback.read::<Counters>(0, 1)?[0].rays))
    }

    pub fn read_back(&self, pass: &mut Pass<'_>) -> Result<()> {
        pass.copy(self.counters.view(), self.counters_readback.view())
    }

    /// Whether the sweep before has left rays that are not at their ends.
    pub fn remain(&self) -> Result<bool> {
        Ok(self.counters_readback.read::<Counters>(0, 1)?[0].remaining > 0)
    }

    /// Records a sweep over the rays of places whose queries went through all records.
    ///
    /// # Errors
    /// [`Error::Overflow`] for rays that never end, and those of recording.
    pub fn record_sweep(
        &self,
        pass: &mut Pass<'_>,
        scene: &GpuScene,
        wave: &WaveSet<'_>,
        stopped: StoppedPlaces,
        sweep: u64,
    ) -> Result<()> {
        if sweep > SWEEPS_MAX {
            return Err(Error::Overflow {
                kernel: "photon_plane_rays".into(),
                what: "sweeps over rays that were stopped".into(),
                needed: sweep,
                capacity: SWEEPS_MAX,
                instead: "choose another ray index".into(),
            });
        }
        // The rays before have counted themselves.
        pass.memory_barrier(Access::COMPUTE, Access::TRANSFER_WRITE);
        pass.fill(self.counters.slice(REMAINING, size_of::<u32>() as u64), 0)?;
        pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
        let (index, of_scene, own) = (scene.index_set(), scene.scene_set(), self.set());
        let sets: [&dyn BindingSet<'_>; 4] = [wave, &index, &of_scene, &own];
        let groups = [self.kernel.groups_for(stopped.places), 1, 1];
        pass.dispatch(&self.kernel, &sets, &push(scene, stopped.key, true), groups)?;
        pass.memory_barrier(Access::COMPUTE, Access::TRANSFER_READ);
        pass.copy(self.counters.view(), self.counters_readback.view())?;
        stage_barrier(pass);
        Ok(())
    }

    fn set(&self) -> photon_plane_rays::Set3<'_> {
        photon_plane_rays::Set3 {
            photon_plane_rays: self.rays.view(),
            plane_ray_counters: self.counters.view(),
        }
    }
}

fn push(scene: &GpuScene, key: WalkKey, sweeps: bool) -> photon_plane_rays::Push {
    photon_plane_rays::Push {
        key,
        surrounding: scene.surrounding().unwrap_or(NO_MEDIUM),
        goes_on: sweeps.into(),
    }
}
