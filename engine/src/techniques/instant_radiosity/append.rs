//! Deposits of walks from the lights become virtual lights (`virtual_light.glsl`).

use crate::Result;
use crate::gpu::shaders::constants::VIRTUAL_LIGHT_QUARTERS;
use crate::gpu::shaders::sets::PhotonWave;
use crate::gpu::shaders::techniques::instant_radiosity::vpl_append;
use crate::gpu::{ComputePipeline, Gpu, Pass, PipelineInfo};
use crate::techniques::photon_mapping::Append;
use crate::transport::{GpuScene, surface_spec};
use crate::walk::Bounce;

/// The kernel, for a scene.
pub(super) struct LightAppend {
    pipeline: ComputePipeline<vpl_append::Kernel>,
    fewer: &'static str,
}

impl LightAppend {
    /// `fewer` is what to do where there are more virtual lights than the device can hold.
    pub fn new(gpu: &Gpu, scene: &GpuScene, fewer: &'static str) -> Result<Self> {
        let spec = surface_spec!(vpl_append, scene, { has_multiple_scattering: false, ..Default::default() });
        Ok(Self {
            pipeline: gpu.compute_pipeline(&spec)?,
            fewer,
        })
    }
}

impl Append for LightAppend {
    fn quarters(&self) -> u32 {
        VIRTUAL_LIGHT_QUARTERS
    }

    fn name(&self) -> &'static str {
        "vpl_append"
    }

    fn records(&self) -> &'static str {
        "virtual lights"
    }

    fn fewer(&self) -> &'static str {
        self.fewer
    }

    fn pipeline(&self) -> PipelineInfo {
        self.pipeline.info()
    }

    fn append(
        &self,
        pass: &mut Pass<'_>,
        bounce: &Bounce<'_>,
        scene: &GpuScene,
        photons: &PhotonWave<'_>,
        first: u32,
        capacity: u32,
    ) -> Result<()> {
        let [lower, upper] = scene.bounds().map(|corner| corner.to_array());
        let push = vpl_append::Push {
            scene_lower: lower,
            first,
            scene_upper: upper,
            capacity,
        };
        let set = scene.scene_set();
        pass.dispatch_indirect(
            &self.pipeline,
            &[&bounce.wave, &set, photons],
            &push,
            bounce.places.waiting,
        )
    }
}
