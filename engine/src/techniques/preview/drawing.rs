//! What draws a picture of a scene: a G-buffer, lights, and the kernel that shades what is seen.

use std::ops::Range;

use super::card::{NO_CLASSIC, NO_MEDIA, NO_PHONG};
use super::lights::{LightRoom, PreviewLights, PreviewShadows};
use super::probe::ProbeMap;
use super::shade::{Eye, OUTPUTS, PreviewPart, Seen, Shade, Target};
use crate::gpu::{Area, Gpu, PipelineInfo, Recorder};
use crate::raster::{DrawPart, GBuffer, GBufferDesc, Layering, Surfaces, View};
use crate::scene::camera_frame::CameraFrame;
use crate::transport::GpuScene;
use crate::{Error, Result};

/// Lights at most: their records go into the command buffer.
const LIGHTS_MAX: u32 = 1024;

#[derive(Debug)]
pub(super) struct Drawing {
    pub gbuffer: GBuffer,
    pub lights: PreviewLights,
    shade: Shade,
}

impl Drawing {
    /// For pictures of `size` pixels.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        size: [u32; 2],
        lights: LightRoom,
        shadows: Option<PreviewShadows>,
        probes: Option<ProbeMap>,
    ) -> Result<Self> {
        if lights.all > LIGHTS_MAX {
            let cause = format!("are more than {LIGHTS_MAX}");
            return Err(Error::setting("lights", lights.all, cause));
        }
        if scene.profile().media.any() {
            return Err(Error::Unsupported {
                technique: "preview".into(),
                reasons: vec![NO_MEDIA.into()],
            });
        }
        if probes.is_some() && scene.profile().has_phong {
            return Err(Error::Unsupported {
                technique: "preview".into(),
                reasons: vec![NO_PHONG.into()],
            });
        }
        if probes.is_some() && scene.profile().has_classic_microfacets {
            return Err(Error::Unsupported {
                technique: "preview".into(),
                reasons: vec![NO_CLASSIC.into()],
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
            shade: Shade::new(gpu, scene, &lights, false, probes)?,
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
        let [width, height] = self.size();
        self.record_surfaces(recorder, surfaces, frame, &DrawPart::whole(surfaces))?;
        self.record_shading(recorder, scene, frame, target, (parts, 0..width * height))
    }

    /// What is seen through a frame.
    pub fn view(&self, surfaces: &Surfaces<'_>, frame: &CameraFrame) -> Result<View> {
        View::of_frame(frame, surfaces, Area::whole(self.size()))
    }

    /// The first of the two passes, of a part of the triangles.
    pub fn record_surfaces(
        &self,
        recorder: &mut Recorder,
        surfaces: &Surfaces<'_>,
        frame: &CameraFrame,
        part: &DrawPart,
    ) -> Result<()> {
        let view = self.view(surfaces, frame)?;
        self.gbuffer.record_part(recorder, surfaces, &[view], part)
    }

    /// The second one, of these pixels.
    pub fn record_shading(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        frame: &CameraFrame,
        target: Target<'_>,
        (parts, pixels): (&[PreviewPart<'_>], Range<u32>),
    ) -> Result<()> {
        recorder.pass("preview: shade", |pass| {
            let seen = Seen {
                scene,
                gbuffer: &self.gbuffer,
                lights: &self.lights,
                eye: Eye::Camera(frame),
                target,
            };
            self.shade.record_pixels(pass, &seen, parts, pixels)
        })
    }

    /// What draws surfaces and shadow maps, and shades.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = self.gbuffer.pipelines();
        all.extend(self.lights.pipelines());
        all.extend(self.shade.pipelines());
        all
    }

    /// Bytes of its pictures and of the shadow maps.
    pub fn bytes(&self) -> u64 {
        self.gbuffer.bytes() + self.lights.bytes()
    }
}
