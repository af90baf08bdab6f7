//! What draws a picture of a scene: a G-buffer, lights, and the kernel that shades what is seen.

use super::lights::{PreviewLights, PreviewShadows};
use super::shade::{Eye, OUTPUTS, PreviewPart, Seen, Shade, Target};
use crate::gpu::{Area, Gpu, PipelineInfo, Recorder};
use crate::raster::{GBuffer, GBufferDesc, Layering, OmniShadowMaps, Surfaces, View};
use crate::scene::camera_frame::CameraFrame;
use crate::transport::GpuScene;
use crate::{Error, Result};

/// Lights at most: their records go into the command buffer.
pub(super) const LIGHTS_MAX: u32 = 1024;

#[derive(Debug)]
pub(super) struct Drawing {
    gbuffer: GBuffer,
    pub lights: PreviewLights,
    shade: Shade,
}

impl Drawing {
    /// For pictures of `size` pixels.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        size: [u32; 2],
        lights: u32,
        shadows: Option<PreviewShadows>,
        has_probes: bool,
    ) -> Result<Self> {
        if lights > LIGHTS_MAX {
            let cause = format!("are more than {LIGHTS_MAX}");
            return Err(Error::setting("lights", lights, cause));
        }
        if scene.profile().media.any() {
            return Err(Error::Unsupported {
                technique: "preview".into(),
                reasons: vec!["the scene has participating media, which a preview of surfaces does not show".into()],
            });
        }
        let surfaces = scene.surfaces();
        let gbuffer = GBuffer::new(
            gpu,
            &surfaces,
            &GBufferDesc {
                size,
                layering: Layering::One,
                outputs: &OUTPUTS,
            },
        )?;
        let lights = PreviewLights::new(gpu, &surfaces, lights, shadows)?;
        Ok(Self {
            gbuffer,
            shade: Shade::new(gpu, scene, &lights, false, has_probes)?,
            lights,
        })
    }

    pub fn size(&self) -> [u32; 2] {
        self.gbuffer.size()
    }

    /// Two passes: what is seen through a frame, and its shading part by part.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        surfaces: &Surfaces<'_>,
        frame: &CameraFrame,
        target: Target<'_>,
        parts: &[PreviewPart<'_>],
    ) -> Result<()> {
        let view = View::of_frame(frame, surfaces, Area::whole(self.size()))?;
        self.gbuffer.record(recorder, surfaces, &[view])?;
        recorder.pass("preview: shade", |pass| {
            let seen = Seen {
                scene,
                gbuffer: &self.gbuffer,
                lights: &self.lights,
                eye: Eye::Camera(frame),
                target,
            };
            self.shade.record(pass, &seen, parts)
        })
    }

    /// The shading kernel.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        vec![self.shade.info()]
    }

    /// Bytes of its pictures and of the shadow maps.
    pub fn bytes(&self) -> u64 {
        self.gbuffer.bytes() + self.lights.shadows().map_or(0, OmniShadowMaps::bytes)
    }
}
