//! Virtual lights of scenes with media: walks through these, whose collisions are virtual lights as well as their deposits on surfaces, in one order.

use crate::Result;
use crate::gpu::shaders::constants::{NO_MEDIUM, VIRTUAL_LIGHT_QUARTERS};
use crate::gpu::shaders::sets::PhotonWave;
use crate::gpu::shaders::techniques::instant_radiosity::{vpl_medium, vpl_medium_append};
use crate::gpu::{Buffer, BufferDesc, Category, ComputePipeline, Gpu, Pass, PipelineInfo};
use crate::techniques::photon_mapping::{Append, CollisionCounts, CollisionPass, CollisionStage};
use crate::transport::random::SamplerKind;
use crate::transport::{GpuScene, surface_spec};
use crate::walk::{Bounce, stage_barrier};

type Counters = vpl_medium::CollisionCounters;

/// The kernels, for a scene with media: of walks on their ways through these, and of records.
pub(super) struct MediumLights {
    medium: ComputePipeline<vpl_medium::Kernel>,
    append: ComputePipeline<vpl_medium_append::Kernel>,
    counters: Buffer,
    counters_readback: Buffer,
    fewer: &'static str,
}

impl MediumLights {
    /// `fewer` is what to do where there are more virtual lights than the device can hold.
    pub fn new(gpu: &Gpu, scene: &GpuScene, sampler: SamplerKind, fewer: &'static str) -> Result<Self> {
        let profile = scene.profile();
        let medium = vpl_medium::Spec {
            has_absorption: profile.has_absorption,
            has_instances: profile.keeps_instances,
            has_grids: profile.media.heterogeneous,
            has_homogeneous: profile.media.homogeneous,
            sampler_kind: sampler as u32,
            ..Default::default()
        };
        let append = surface_spec!(vpl_medium_append, scene, { has_multiple_scattering: false, ..Default::default() });
        let bytes = size_of::<Counters>() as u64;
        Ok(Self {
            medium: gpu.compute_pipeline(&medium)?,
            append: gpu.compute_pipeline(&append)?,
            counters: gpu.buffer(&BufferDesc::storage("collision counters", bytes, Category::Work))?,
            counters_readback: gpu.buffer(&BufferDesc::readback("collision counters", bytes))?,
            fewer,
        })
    }
}

impl Append for MediumLights {
    fn quarters(&self) -> u32 {
        VIRTUAL_LIGHT_QUARTERS
    }

    fn name(&self) -> &'static str {
        "vpl_medium_append"
    }

    fn records(&self) -> &'static str {
        "virtual lights"
    }

    fn fewer(&self) -> &'static str {
        self.fewer
    }

    fn pipeline(&self) -> PipelineInfo {
        self.append.info()
    }

    fn collisions(&self) -> Option<&dyn CollisionStage> {
        Some(self)
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
        let push = vpl_medium_append::Push {
            scene_lower: lower,
            first,
            scene_upper: upper,
            capacity,
        };
        let set = scene.scene_set();
        pass.dispatch_indirect(
            &self.append,
            &[&bounce.wave, &set, photons],
            &push,
            bounce.places.waiting,
        )
    }
}

impl CollisionStage for MediumLights {
    fn pipeline(&self) -> PipelineInfo {
        self.medium.info()
    }

    fn reset(&self, pass: &mut Pass<'_>) -> Result<()> {
        pass.fill(self.counters.view(), 0)
    }

    fn record(&self, pass: &mut Pass<'_>, bounce: &Bounce<'_>, scene: &GpuScene, told: CollisionPass) -> Result<()> {
        let push = vpl_medium::Push {
            key: told.key,
            surrounding: scene.surrounding().unwrap_or(NO_MEDIUM),
            last_bounce: told.last_bounce,
            first_deposit: told.first_deposit,
        };
        let own = vpl_medium::Set1 {
            collision_counters: self.counters.view(),
        };
        let (of_scene, media) = (scene.scene_set(), scene.media_set());
        pass.dispatch_indirect(
            &self.medium,
            &[&bounce.wave, &own, &of_scene, &media],
            &push,
            bounce.places.items,
        )?;
        stage_barrier(pass);
        Ok(())
    }

    fn read_back(&self, pass: &mut Pass<'_>) -> Result<()> {
        pass.copy(self.counters.view(), self.counters_readback.view())
    }

    fn counts(&self) -> Result<CollisionCounts> {
        let counters = self.counters_readback.read::<Counters>(0, 1)?[0];
        Ok(CollisionCounts {
            absorbed: counters.absorbed,
            kept: counters.kept,
        })
    }
}
