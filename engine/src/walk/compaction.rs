//! Compaction of queues by the flags that scattering leaves: walks that are alive, and places where something waits.

use super::arrival::Places;
use super::turnover::Turnover;
use super::wave::{Status, WaveBuffers, indirect, stage_barrier};
use crate::Result;
use crate::gpu::shaders::sets::WaveSet;
use crate::gpu::shaders::walk::{compact_count, compact_scan, compact_scatter};
use crate::gpu::{ComputePipeline, Gpu, Pass, PipelineInfo};

/// Its three stages.
pub(super) struct Compaction {
    count: ComputePipeline<compact_count::Kernel>,
    scan: ComputePipeline<compact_scan::Kernel>,
    scatter: ComputePipeline<compact_scatter::Kernel>,
}

impl Compaction {
    /// `refilled` where it notes the slots of walks that have ended, of a wave that is kept full.
    pub fn new(gpu: &Gpu, refilled: bool) -> Result<Self> {
        Ok(Self {
            count: gpu.compute_pipeline(&())?,
            scan: gpu.compute_pipeline(&())?,
            scatter: gpu.compute_pipeline(&compact_scatter::Spec { refilled })?,
        })
    }

    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        buffers: &WaveBuffers,
        wave: &WaveSet<'_>,
        places: Places<'_>,
    ) -> Result<()> {
        let scatter = indirect(buffers, std::mem::offset_of!(Status, scatter_groups));
        let turnover = compact_scatter::Set1 {
            // What is not kept full writes nothing there.
            walk_turnover: buffers.turnover().map_or(wave.walk_chunks, Turnover::slots),
        };
        pass.dispatch_indirect(&self.count, &[wave], &(), places.chunks)?;
        stage_barrier(pass);
        pass.dispatch(&self.scan, &[wave], &(), [1, 1, 1])?;
        stage_barrier(pass);
        pass.dispatch_indirect(&self.scatter, &[wave, &turnover], &(), scatter)?;
        stage_barrier(pass);
        Ok(())
    }

    /// Of as many places as fill `groups`, of what is no wave that is kept full.
    pub fn record_all(&self, pass: &mut Pass<'_>, wave: &WaveSet<'_>, groups: [u32; 3]) -> Result<()> {
        let turnover = compact_scatter::Set1 {
            walk_turnover: wave.walk_chunks,
        };
        pass.dispatch(&self.count, &[wave], &(), groups)?;
        stage_barrier(pass);
        pass.dispatch(&self.scan, &[wave], &(), [1, 1, 1])?;
        stage_barrier(pass);
        pass.dispatch(&self.scatter, &[wave, &turnover], &(), groups)
    }

    pub fn info(&self) -> [PipelineInfo; 3] {
        [self.count.info(), self.scan.info(), self.scatter.info()]
    }
}
