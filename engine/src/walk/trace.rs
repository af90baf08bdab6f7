//! The stages that trace a wave's rays: closest hits, and shadow rays, with what a scene needs of alpha and media.
//!
//! One kernel a stage, specialized to the scene: what it lacks is not compiled in, and the bindings of what it lacks hold other buffers.

use super::walker::WalkOptions;
use super::wave::{WaveBuffers, stage_barrier};
use crate::Result;
use crate::gpu::shaders::constants::{GOES_ON_NOT, GOES_ON_RAYS, NO_MEDIUM, WORK_UNIT};
use crate::gpu::shaders::sets::WaveSet;
use crate::gpu::shaders::types::WalkKey;
use crate::gpu::shaders::walk::{extend, shadow};
use crate::gpu::{BufferView, ComputePipeline, DeviceKind, Gpu, Pass, PipelineInfo};
use crate::transport::{GpuScene, ray_iterations};

/// Loop iterations after which a ray goes on in a later dispatch, where nothing else is asked for: at most half of what a software driver runs.
pub const RAY_QUOTA: u32 = 32_768;

/// Iterations after which a ray among surfaces with alpha goes on in a later dispatch, at most: a software driver's subgroup of 16 then
/// stays below [`SOFTWARE_LOOP_CAP`](crate::gpu::SOFTWARE_LOOP_CAP), even if its lanes take turns.
const ALPHA_QUOTA_MAX: u32 = 2048;

/// The same where shadow rays pass boundaries of media, up to eight in a dispatch, and with alpha besides, up to two.
const MEDIA_QUOTA_MAX: u32 = 2048;
const MEDIA_ALPHA_QUOTA_MAX: u32 = 512;

/// Loop iterations after which a ray in a scene goes on in a later dispatch: as many as were asked for, or as its stages can have.
///
/// # Errors
/// [`Error::LimitExceeded`](crate::Error::LimitExceeded) where a leaf of the scene's index alone takes a software driver too many.
pub fn ray_quota(gpu: &Gpu, scene: &GpuScene, wanted: u32) -> Result<u32> {
    let filters = scene.profile().has_alpha();
    let most = match (filters, scene.profile().media.any()) {
        (false, false) => u32::MAX,
        (true, false) => ALPHA_QUOTA_MAX,
        (false, true) => MEDIA_QUOTA_MAX,
        (true, true) => MEDIA_ALPHA_QUOTA_MAX,
    };
    let iterations = ray_iterations(scene.profile());
    scene
        .index_traversal()
        .quota_within(gpu.caps(), wanted.min(most), iterations, filters)
}

/// The kernels of both stages.
pub(super) struct TracePipelines {
    extend: ComputePipeline<extend::Kernel>,
    /// None where no walk has shadow rays.
    shadow: Option<ComputePipeline<shadow::Kernel>>,
}

impl TracePipelines {
    /// For rays that begin, or for those that a quota stopped.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        buffers: &WaveBuffers,
        index_quota: u32,
        options: &WalkOptions,
        resumes: bool,
    ) -> Result<Self> {
        let (shadows, count_fetches) = (options.shadows, options.count_fetches);
        let numbered = buffers.is_numbered();
        let work_least = work_least(gpu.caps().kind);
        let (profile, traversal) = (scene.profile(), scene.index_traversal());
        let index_kind = traversal.kind();
        let (has_alpha, has_media) = (profile.has_alpha(), profile.media.any());
        // Attributes are read for alpha alone.
        let has_textures = has_alpha && profile.has_textures;
        let has_vertex_colors = has_alpha && profile.has_vertex_colors;
        let extend = extend::Spec {
            has_alpha,
            has_media,
            has_textures,
            has_vertex_colors,
            has_instances: has_alpha && profile.keeps_instances,
            index_quota,
            index_kind,
            resumes,
            work_least,
            numbered,
            count_fetches,
            ..Default::default()
        };
        let shadow = shadow::Spec {
            has_alpha,
            has_media,
            has_textures,
            has_vertex_colors,
            // Boundaries of media are looked up, too.
            has_instances: (has_alpha || has_media) && profile.keeps_instances,
            has_absorption: has_media && profile.has_absorption,
            has_grids: profile.media.heterogeneous,
            has_homogeneous: profile.media.homogeneous,
            index_quota,
            index_kind,
            resumes,
            work_least,
            numbered,
            count_fetches,
            ..Default::default()
        };
        Ok(Self {
            extend: traversal.pipeline(gpu, &extend)?,
            shadow: shadows.then(|| traversal.pipeline(gpu, &shadow)).transpose()?,
        })
    }

    pub fn info(&self) -> Vec<PipelineInfo> {
        let shadow = self.shadow.as_ref().map(ComputePipeline::info);
        std::iter::once(self.extend.info()).chain(shadow).collect()
    }

    /// The closest hits of a wave's rays; `goes_on` is one of the kernel's `GOES_ON_*`.
    pub fn record_extend(
        &self,
        pass: &mut Pass<'_>,
        scene: &GpuScene,
        wave: &WaveSet<'_>,
        key: WalkKey,
        items: BufferView<'_>,
        goes_on: u32,
    ) -> Result<()> {
        let (index, set) = (scene.index_set(), scene.scene_set());
        pass.dispatch_indirect(&self.extend, &[wave, &index, &set], &push(scene, key, goes_on), items)?;
        stage_barrier(pass);
        Ok(())
    }

    /// The shadow rays of a wave.
    pub fn record_shadow(
        &self,
        pass: &mut Pass<'_>,
        scene: &GpuScene,
        wave: &WaveSet<'_>,
        key: WalkKey,
        rays: BufferView<'_>,
        goes_on: bool,
    ) -> Result<()> {
        if let Some(shadow) = &self.shadow {
            let (index, set, media) = (scene.index_set(), scene.scene_set(), scene.media_set());
            let goes_on = if goes_on { GOES_ON_RAYS } else { GOES_ON_NOT };
            let push = bytemuck::cast(push(scene, key, goes_on));
            pass.dispatch_indirect(shadow, &[wave, &index, &set, &media], &push, rays)?;
            stage_barrier(pass);
        }
        Ok(())
    }
}

/// Loop iterations that a quota lets a walk through a grid take, in a subgroup whose lanes take turns at worst in the loop over blocks, where each unit of the quota is one. The loop around it, over
/// tentative collisions, is the same for all lanes. The pass that ends a loop counts too.
pub(crate) const fn grid_walk_iterations(lanes: u32, quota: u32) -> u32 {
    (lanes + 1) * (quota + 1)
}

/// Loop iterations of a ray from which on they count as work of a submission: atomics are cheap beside them on software devices, where rays are slow.
pub(crate) fn work_least(kind: DeviceKind) -> u32 {
    match kind {
        DeviceKind::Cpu => WORK_UNIT,
        _ => 16 * WORK_UNIT,
    }
}

/// What both stages are told.
fn push(scene: &GpuScene, key: WalkKey, goes_on: u32) -> extend::Push {
    extend::Push {
        key,
        surrounding: scene.surrounding().unwrap_or(NO_MEDIUM),
        goes_on,
    }
}
