//! The kernel that shades a G-buffer, for cameras and for maps of directions.

use std::ops::Range;

use glam::Vec3;

use super::lights::PreviewLights;
use super::probe::{LightProbe, ProbeMap};
use crate::gpu::ash::vk;
use crate::gpu::interface::SampledView;
use crate::gpu::shaders::constants::PROBE_LEVELS_MAX;
use crate::gpu::shaders::techniques::preview::preview_shade as kernel;
use crate::gpu::shaders::types::PreviewFrame;
use crate::gpu::{
    Access, Buffer, BufferBarrier, BufferDesc, Category, ComputePipeline, Gpu, Pass, PipelineInfo, Sampler, SamplerDesc,
};
use crate::maps::cube::cube_axes;
use crate::maps::directional_map::DirectionalMap;
use crate::raster::{GBuffer, Output, ViewShadowMaps};
use crate::scene::camera_frame::CameraFrame;
use crate::transport::{GpuScene, surface_spec};
use crate::{Error, Result};

/// What of a G-buffer the kernel reads.
pub(in crate::techniques) const OUTPUTS: [Output; 2] = [Output::Triangle, Output::Weights];

/// Parts that one picture may be shaded in, each by a probe of its own.
pub const PARTS_MAX: usize = 64;

/// Which of the triangles that are seen are shaded by which probe.
#[derive(Debug, Clone)]
pub struct PreviewPart<'a> {
    /// Numbers of triangles, as in [`ObjectTriangles`](crate::raster::ObjectTriangles).
    pub triangles: Range<u32>,
    /// Pixels without surfaces are filled, too: with the scene's environment, or black.
    pub background: bool,
    /// Where light from all sides comes from; `None` for no such light.
    pub probe: Option<&'a LightProbe>,
}

/// From where a picture is seen.
pub(in crate::techniques) enum Eye<'a> {
    Camera(&'a CameraFrame),
    AllDirections(Vec3),
    /// A place, through a face of a cube about it.
    CubeFace(Vec3, u32),
}

/// Where radiance goes.
pub(in crate::techniques) struct Target<'a> {
    pub buffer: &'a Buffer,
    pub first: u32,
    pub stride: u32,
}

/// What is shaded, seen from where, to where.
pub(in crate::techniques) struct Seen<'a> {
    pub scene: &'a GpuScene,
    pub gbuffer: &'a GBuffer,
    pub lights: &'a PreviewLights,
    pub eye: Eye<'a>,
    pub target: Target<'a>,
}

/// The kernel, specialized to a scene and to how it is seen.
#[derive(Debug)]
pub(in crate::techniques) struct Shade {
    pipeline: ComputePipeline<kernel::Kernel>,
    /// What scene and shadow maps it was made for.
    spec: kernel::Spec,
    frames: Buffer,
    sampler: Sampler,
    /// Bound where a part has no probe, or the kernel knows of none.
    dark: DirectionalMap,
    /// Bound where there are no shadow maps.
    no_shadows: Buffer,
}

impl Shade {
    /// `probes` says which maps light surfaces, if any do.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        lights: &PreviewLights,
        all_directions: bool,
        probes: Option<ProbeMap>,
    ) -> Result<Self> {
        let dark = probes.unwrap_or_default().allocate(gpu, 2, 1)?;
        let spec = spec(scene, lights, &dark, all_directions, probes.is_some());
        let bytes = (PARTS_MAX * size_of::<PreviewFrame>()) as u64;
        Ok(Self {
            pipeline: gpu.compute_pipeline(&spec)?,
            spec,
            frames: gpu.buffer(&BufferDesc::storage("preview frames", bytes, Category::Work))?,
            sampler: gpu.sampler(&SamplerDesc {
                name: "preview texels",
                filter: vk::Filter::NEAREST,
                address: vk::SamplerAddressMode::CLAMP_TO_EDGE,
            })?,
            dark,
            no_shadows: gpu.buffer_with("no shadows", Category::Light, &[f32::INFINITY])?,
        })
    }

    /// The kernel with its specialization, and those of the map that stands for a probe.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = vec![self.pipeline.info()];
        all.extend(self.dark.pipelines());
        all
    }

    /// Records the shading of a G-buffer that was just drawn. Earlier uses of the target by compute shaders are waited for; afterwards it is
    /// visible to them.
    pub fn record(&self, pass: &mut Pass<'_>, seen: &Seen<'_>, parts: &[PreviewPart<'_>]) -> Result<()> {
        let [width, height] = seen.gbuffer.size();
        self.record_pixels(pass, seen, parts, 0..width * height)
    }

    /// As [`Shade::record`], of these pixels alone, row by row; those from 0 on come first.
    pub fn record_pixels(
        &self,
        pass: &mut Pass<'_>,
        seen: &Seen<'_>,
        parts: &[PreviewPart<'_>],
        pixels: Range<u32>,
    ) -> Result<()> {
        let Seen {
            scene,
            gbuffer,
            lights,
            target,
            ..
        } = seen;
        if parts.len() > PARTS_MAX {
            let cause = format!("are more than {PARTS_MAX}");
            return Err(Error::setting("parts", parts.len(), cause));
        }
        let is_known = |probe: &LightProbe| self.spec.has_probe && probe.map().map() == self.dark.map();
        if !parts.iter().filter_map(|part| part.probe).all(is_known) {
            return Err(Error::setting(
                "probe",
                "given",
                "is none that the preview was made for",
            ));
        }
        let found = spec(
            scene,
            lights,
            &self.dark,
            self.spec.sees_all_directions,
            self.spec.has_probe,
        );
        if found != self.spec {
            return Err(Error::setting(
                "scene or preview",
                "given",
                "has other features or other shadow maps than that which the kernel was made for",
            ));
        }
        let frames: Vec<_> = parts.iter().map(|part| frame(seen, part)).collect();
        let barrier = |buffer, from, to| BufferBarrier { buffer, from, to };
        pass.barrier(&[barrier(&self.frames, Access::COMPUTE_READ, Access::TRANSFER_WRITE)]);
        pass.update(self.frames.view(), &frames)?;
        pass.barrier(&[
            barrier(&self.frames, Access::TRANSFER_WRITE, Access::COMPUTE_READ),
            barrier(target.buffer, Access::COMPUTE, Access::COMPUTE),
        ]);
        // Further pixels find the pictures so.
        if pixels.start == 0 {
            gbuffer.barrier_to(pass, Access::COMPUTE_READ, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
        }
        let (Some(triangles), Some(weights)) = (gbuffer.image(Output::Triangle), gbuffer.image(Output::Weights)) else {
            return Ok(());
        };
        let view = |image| SampledView {
            image,
            sampler: &self.sampler,
        };
        let mut shadows = crate::gpu::shaders::sets::OmniShadowSet {
            shadow_distances: self.no_shadows.view(),
        };
        if let Some(maps) = lights.shadows() {
            shadows = maps.set();
        }
        for (frame, part) in (0..).zip(parts) {
            let set = kernel::Set0 {
                seen_triangles: view(triangles),
                seen_weights: view(weights),
                frames: self.frames.view(),
                lights: lights.records().view(),
                radiance: target.buffer.view(),
                sun_views: lights.sun_views().unwrap_or(&self.no_shadows).view(),
                view_distances: lights.suns().map_or(self.no_shadows.view(), ViewShadowMaps::distances),
            };
            let map = part.probe.map_or(&self.dark, LightProbe::filtered);
            let groups = self.pipeline.groups_over(pixels.len() as u32);
            let push = kernel::Push {
                frame,
                first_pixel: pixels.start,
            };
            let sets: [&dyn crate::gpu::interface::BindingSet<'_>; 4] =
                [&set, &map.set(), &scene.scene_set(), &shadows];
            pass.dispatch(&self.pipeline, &sets, &push, groups)?;
            pass.barrier(&[barrier(target.buffer, Access::COMPUTE, Access::COMPUTE)]);
        }
        Ok(())
    }
}

/// What the kernel is specialized to.
fn spec(
    scene: &GpuScene,
    lights: &PreviewLights,
    dark: &DirectionalMap,
    all_directions: bool,
    has_probe: bool,
) -> kernel::Spec {
    let (profile, bsdf) = (scene.profile(), scene.bsdf_features());
    let shadows = lights.shadows();
    let constants = dark.constants();
    surface_spec!(kernel, scene, {
        has_multiple_scattering: bsdf.multiple_scattering,
        separable_masking: false,
        has_environment: profile.has_environment(),
        has_area_lights: scene.has_area_lights(),
        has_punctual_lights: true,
        sees_all_directions: all_directions,
        has_probe,
        has_shadows: shadows.is_some(),
        has_sun_shadows: lights.suns().is_some(),
        shadow_kind: shadows.map_or(0, |maps| maps.desc().layout.kind()),
        shadow_width: lights.width() as i32,
        directional_kind: constants.kind,
        directional_border: constants.border,
        ..Default::default()
    })
}

/// What a part is shaded by.
pub(super) fn frame(seen: &Seen<'_>, part: &PreviewPart<'_>) -> PreviewFrame {
    let Seen {
        scene,
        gbuffer,
        lights,
        eye,
        target,
    } = seen;
    let [lower, upper] = scene.bounds().map(|corner| corner.to_array());
    let mut alphas = [0.0; PROBE_LEVELS_MAX as usize];
    let known = part.probe.map_or(&[][..], LightProbe::alphas);
    alphas[..known.len()].copy_from_slice(known);
    let scaled = |axis: [f32; 3], by: f32| (Vec3::from_array(axis) * by).to_array();
    let mut frame = PreviewFrame {
        width: gbuffer.size()[0],
        height: gbuffer.size()[1],
        light_count: lights.count(),
        lower,
        upper,
        first_triangle: part.triangles.start,
        end_triangle: part.triangles.end,
        first_pixel: target.first,
        stride: target.stride,
        has_background: part.background.into(),
        shadow_side: lights.side() as i32,
        probe_levels: known.len() as u32,
        probe_alphas: alphas,
        ..PreviewFrame::default()
    };
    match eye {
        Eye::Camera(camera) => {
            frame.origin = camera.origin;
            frame.right = scaled(camera.right, camera.half_width);
            frame.down = scaled(camera.up, -camera.half_height);
            frame.forward = camera.middle().to_array();
            frame.is_parallel = camera.orthographic.into();
        }
        Eye::AllDirections(origin) => frame.origin = origin.to_array(),
        Eye::CubeFace(origin, face) => {
            frame.origin = origin.to_array();
            [frame.right, frame.down, frame.forward] = cube_axes(*face).map(|axis| axis.as_vec3().to_array());
        }
    }
    frame
}
