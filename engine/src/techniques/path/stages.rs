//! Stages that waves of all kinds share, whatever is done where their rays arrive: the rays' closest hits, and the compaction of queues.

use super::pipelines::TracePipelines;
use super::wave::{Status, WaveBuffers};
use crate::gpu::shaders::constants::NO_MEDIUM;
use crate::gpu::shaders::sets::{PathBuffers, PathMedia};
use crate::gpu::shaders::transport::{
    path_compact_count, path_compact_scan, path_compact_scatter, path_extend_alpha, path_extend_media,
    path_extend_media_alpha,
};
use crate::gpu::{Access, BufferView, ComputePipeline, Gpu, Pass, PipelineInfo};
use crate::transport::GpuScene;
use crate::{Error, Result};

/// What the random numbers of a wave's paths are keyed by: pixels and samples; or, of photons, the pass and the photons in it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WaveKey {
    pub first_pixel: u32,
    pub first_sample: u32,
    pub sample_count: u32,
    pub seed: u32,
}

/// Loop iterations that a ray may take in all before a tracer gives up, since no index of 2²⁸ triangles has as many: submissions in a row
/// that end without finishing a bounce advance every stopped ray by a whole quota each.
const RAY_ITERATIONS_MAX: u64 = 1 << 31;

/// Counts what rays have taken since a bounce was finished last.
pub(crate) struct StallWatch {
    quota: u64,
    iterations: u64,
}

impl StallWatch {
    pub fn new(quota: u32) -> Self {
        Self {
            quota: u64::from(quota),
            iterations: 0,
        }
    }

    /// After each submission: whether it went on with stopped rays and finished no bounce.
    ///
    /// # Errors
    /// [`Error::Overflow`] should the index have rays that never end.
    pub fn submitted(&mut self, stands: bool) -> Result<()> {
        self.iterations = if stands { self.iterations + self.quota } else { 0 };
        if self.iterations <= RAY_ITERATIONS_MAX {
            return Ok(());
        }
        Err(Error::Overflow {
            kernel: "path_extend".into(),
            what: "iterations of a ray".into(),
            needed: self.iterations,
            capacity: RAY_ITERATIONS_MAX,
            instead: "rebuild the index".into(),
        })
    }
}

/// Indirect arguments at an offset of the status.
pub(crate) fn indirect(buffers: &WaveBuffers, offset: usize) -> BufferView<'_> {
    buffers.status.slice(offset as u64, size_of::<[u32; 3]>() as u64)
}

/// What every stage leaves behind is for the next one to read, write or take its arguments from.
pub(crate) fn stage_barrier(pass: &mut Pass<'_>) {
    pass.memory_barrier(
        Access::COMPUTE | Access::INDIRECT_READ,
        Access::COMPUTE | Access::INDIRECT_READ,
    );
}

impl TracePipelines {
    /// The closest hits of a wave's rays.
    pub fn record_extend(
        &self,
        pass: &mut Pass<'_>,
        scene: &GpuScene,
        paths: &PathBuffers<'_>,
        path_media: &PathMedia<'_>,
        key: WaveKey,
        items: BufferView<'_>,
    ) -> Result<()> {
        let WaveKey {
            first_pixel,
            first_sample,
            sample_count,
            seed,
        } = key;
        let (index, scene_set) = (scene.index_set(), scene.scene_set());
        let surrounding = scene.surrounding().unwrap_or(NO_MEDIUM);
        match self {
            Self::Opaque { extend, .. } => {
                pass.dispatch_indirect(extend, &[paths, &index], &(), items)?;
            }
            Self::Alpha { extend, .. } => {
                let push = path_extend_alpha::Push {
                    first_pixel,
                    first_sample,
                    sample_count,
                    seed,
                };
                pass.dispatch_indirect(extend, &[paths, &index, &scene_set], &push, items)?;
            }
            Self::Media { extend, .. } => {
                let push = path_extend_media::Push {
                    first_pixel,
                    first_sample,
                    sample_count,
                    seed,
                    surrounding,
                };
                pass.dispatch_indirect(extend, &[paths, &index, path_media], &push, items)?;
            }
            Self::MediaAlpha { extend, .. } => {
                let push = path_extend_media_alpha::Push {
                    first_pixel,
                    first_sample,
                    sample_count,
                    seed,
                    surrounding,
                };
                pass.dispatch_indirect(extend, &[paths, &index, &scene_set, path_media], &push, items)?;
            }
        }
        stage_barrier(pass);
        Ok(())
    }
}

/// Compaction of queues by the flags that shading leaves (`path_shade`, `photon_scatter`): paths that are alive, and what waits by place:
/// shadow rays, or deposits.
pub(crate) struct Compaction {
    count: ComputePipeline<path_compact_count::Kernel>,
    scan: ComputePipeline<path_compact_scan::Kernel>,
    scatter: ComputePipeline<path_compact_scatter::Kernel>,
}

impl Compaction {
    pub fn new(gpu: &Gpu) -> Result<Self> {
        Ok(Self {
            count: gpu.compute_pipeline(&())?,
            scan: gpu.compute_pipeline(&())?,
            scatter: gpu.compute_pipeline(&())?,
        })
    }

    pub fn record(&self, pass: &mut Pass<'_>, buffers: &WaveBuffers, paths: &PathBuffers<'_>) -> Result<()> {
        let chunks = indirect(buffers, std::mem::offset_of!(Status, chunk_groups));
        let scatter = indirect(buffers, std::mem::offset_of!(Status, scatter_groups));
        pass.dispatch_indirect(&self.count, &[paths], &(), chunks)?;
        stage_barrier(pass);
        pass.dispatch(&self.scan, &[paths], &(), [1, 1, 1])?;
        stage_barrier(pass);
        pass.dispatch_indirect(&self.scatter, &[paths], &(), scatter)?;
        stage_barrier(pass);
        Ok(())
    }

    pub fn info(&self) -> [PipelineInfo; 3] {
        [self.count.info(), self.scan.info(), self.scatter.info()]
    }
}
