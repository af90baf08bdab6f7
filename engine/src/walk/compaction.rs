//! Compaction of queues by the flags that scattering leaves: walks that are alive, and places where something waits.

use super::arrival::Places;
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
    pub fn new(gpu: &Gpu) -> Result<Self> {
        Ok(Self {
            count: gpu.compute_pipeline(&())?,
            scan: gpu.compute_pipeline(&())?,
            scatter: gpu.compute_pipeline(&())?,
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
        pass.dispatch_indirect(&self.count, &[wave], &(), places.chunks)?;
        stage_barrier(pass);
        pass.dispatch(&self.scan, &[wave], &(), [1, 1, 1])?;
        stage_barrier(pass);
        pass.dispatch_indirect(&self.scatter, &[wave], &(), scatter)?;
        stage_barrier(pass);
        Ok(())
    }

    pub fn info(&self) -> [PipelineInfo; 3] {
        [self.count.info(), self.scan.info(), self.scatter.info()]
    }
}
