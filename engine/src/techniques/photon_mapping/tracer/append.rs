//! What the deposits of photons are made into: records of a photon map, or whatever a tracer is given a kernel for.

use crate::Result;
use crate::gpu::shaders::constants::PHOTON_QUARTERS;
use crate::gpu::shaders::sets::PhotonWave;
use crate::gpu::shaders::techniques::photon_mapping::photon_append;
use crate::gpu::{ComputePipeline, Gpu, Pass, PipelineInfo};
use crate::techniques::photon_mapping::collisions::CollisionStage;
use crate::transport::GpuScene;
use crate::walk::Bounce;

/// What a bounce's deposits are made into.
pub(in crate::techniques) trait Append: Send {
    /// Of a record, in texels of four words.
    fn quarters(&self) -> u32;

    /// Of its kernel, in errors.
    fn name(&self) -> &'static str;

    /// What its records are, in errors.
    fn records(&self) -> &'static str;

    /// What to do where there are more of them than the device can hold, in errors.
    fn fewer(&self) -> &'static str;

    fn pipeline(&self) -> PipelineInfo;

    /// What walks do on their ways through media where their collisions become records as well; none where the tracer's own stages do it.
    fn collisions(&self) -> Option<&dyn CollisionStage> {
        None
    }

    /// Records what makes those that wait into records behind `first` and the wave's earlier ones, as far as there is room for `capacity`.
    ///
    /// # Errors
    /// Those of recording.
    fn append(
        &self,
        pass: &mut Pass<'_>,
        bounce: &Bounce<'_>,
        scene: &GpuScene,
        photons: &PhotonWave<'_>,
        first: u32,
        capacity: u32,
    ) -> Result<()>;
}

/// Deposits become records of a photon map.
pub(in crate::techniques::photon_mapping) struct PhotonAppend(ComputePipeline<photon_append::Kernel>);

impl PhotonAppend {
    pub fn new(gpu: &Gpu) -> Result<Self> {
        Ok(Self(gpu.compute_pipeline(&())?))
    }
}

impl Append for PhotonAppend {
    fn quarters(&self) -> u32 {
        PHOTON_QUARTERS
    }

    fn name(&self) -> &'static str {
        "photon_append"
    }

    fn records(&self) -> &'static str {
        "photon records"
    }

    fn fewer(&self) -> &'static str {
        "trace fewer photons per pass: setting `photons`"
    }

    fn pipeline(&self) -> PipelineInfo {
        self.0.info()
    }

    fn append(
        &self,
        pass: &mut Pass<'_>,
        bounce: &Bounce<'_>,
        _: &GpuScene,
        photons: &PhotonWave<'_>,
        first: u32,
        capacity: u32,
    ) -> Result<()> {
        let push = photon_append::Push { first, capacity };
        pass.dispatch_indirect(&self.0, &[&bounce.wave, photons], &push, bounce.places.waiting)
    }
}
