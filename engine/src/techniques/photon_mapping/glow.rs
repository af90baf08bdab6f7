//! Photons of media that emit: the stage of a tracer that puts them in the place of a share of those that have left lights. Only scenes with such media have it.

use super::tracer::PhotonPlan;
use crate::gpu::shaders::constants::{NO_MEDIUM, OUTSIDE};
use crate::gpu::shaders::sets::WaveSet;
use crate::gpu::shaders::techniques::photon_mapping::photon_glow;
use crate::gpu::shaders::types::GlowBody;
use crate::gpu::{Buffer, Category, ComputePipeline, Gpu, Pass, PipelineInfo};
use crate::transport::GpuScene;
use crate::walk::{WalkKey, stage_barrier};
use crate::{Error, Result};

/// Triangles of the bodies that are asked for every photon whether they are around it, at most.
const TRIANGLES_MAX: usize = 8192;
/// Of the photons where lights send some, too, the share that media send at least, and at most: what is sent says little of what is seen.
const SHARES: [f64; 2] = [0.25, 0.75];

/// The stage, with what it reads.
pub(super) struct GlowStage {
    kernel: ComputePipeline<photon_glow::Kernel>,
    sources: Buffer,
    bodies: Buffer,
    corners: Buffer,
    counts: [u32; 2],
    share: f64,
}

impl GlowStage {
    /// `None` where no medium emits.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] for bodies of too many triangles, [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, scene: &GpuScene, plan: &PhotonPlan) -> Result<Option<Self>> {
        let Some(glow) = scene.glow() else { return Ok(None) };
        if glow.triangles() > TRIANGLES_MAX {
            return Err(Error::LimitExceeded {
                name: "triangles of bodies around media that emit".into(),
                value: glow.triangles() as u64,
                limit_name: "TRIANGLES_MAX",
                limit: TRIANGLES_MAX as u64,
            });
        }
        let media = &scene.profile().media;
        let by_power = glow.power / (glow.power + scene.light_power());
        let share = match scene.light_power() > 0.0 {
            true => by_power.clamp(SHARES[0], SHARES[1]),
            false => 1.0,
        };
        let spec = photon_glow::Spec {
            has_grids: media.heterogeneous,
            sampler_kind: plan.sampler as u32,
            has_differentials: plan.follows_footprints,
            ..Default::default()
        };
        // Something is bound where there is no body.
        let no_body = [GlowBody::default()];
        let (bodies, corners) = match glow.bodies.is_empty() {
            true => (&no_body[..], &[0.0; 9][..]),
            false => (&glow.bodies[..], &glow.corners[..]),
        };
        Ok(Some(Self {
            kernel: gpu.compute_pipeline(&spec)?,
            sources: gpu.buffer_with("photon glow sources", Category::Light, &glow.sources)?,
            bodies: gpu.buffer_with("photon glow bodies", Category::Light, bodies)?,
            corners: gpu.buffer_with("photon glow corners", Category::Light, corners)?,
            counts: [glow.sources.len(), glow.bodies.len()].map(|count| count as u32),
            share,
        }))
    }

    pub fn pipeline(&self) -> PipelineInfo {
        self.kernel.info()
    }

    /// Of photons that media send.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// Puts the photons of media that emit in their slots, which carry `placeless2` (`PhotonPlan::carries_light_distance`).
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        wave: &WaveSet<'_>,
        scene: &GpuScene,
        differentials: &Buffer,
        key: WalkKey,
        placeless2: f32,
    ) -> Result<()> {
        let [sources, bodies] = self.counts;
        let push = photon_glow::Push {
            key,
            share: self.share as f32,
            sources,
            bodies,
            surrounding: scene.surrounding().unwrap_or(NO_MEDIUM),
            outside: OUTSIDE,
            placeless2,
        };
        let set = photon_glow::Set1 {
            glow_sources: self.sources.view(),
            glow_bodies: self.bodies.view(),
            glow_corners: self.corners.view(),
            glow_differentials: differentials.view(),
        };
        let groups = [self.kernel.groups_for(key.indices), 1, 1];
        pass.dispatch(&self.kernel, &[wave, &set, &scene.media_set()], &push, groups)?;
        stage_barrier(pass);
        Ok(())
    }
}
