//! Searched reflections: what a body mirrors, found in the distances of the map that is drawn about it, so that it depends on where it is mirrored.
//!
//! Sources: L. Szirmay-Kalos, B. Aszódi, I. Lazányi, M. Premecz, "Approximate Ray-Tracing on the GPU with Distance Impostors", CGF 24(3) (Eurographics), 2005; the searches are those of
//! [`maps::impostor`](crate::maps::impostor), in the distances and normals that a [`LiveProbe`] was drawn with. The probe is looked up in the direction that was found, at the level of the surface's roughness.
//!
//! It is a pass of its own behind the preview's shading, of a module of its own: a preview without it has not a binding, a byte or a branch for it. The shading has added what the probe shows in the mirrored ray's own
//! direction; the pass adds what it shows in the other one, and takes that away. What a diffuse base throws back stays as it is. Sum and difference are rounded to f32: a pixel is off by up to a few 2⁻²⁴ of the greater of what the probe shows in both
//! directions, which where the ray's own shows a lamp 10⁴ times as bright as what was found is up to two parts in 10³ of that. What comes below 0 is 0.
//!
//! Bias: that of a distance impostor of one layer (what the probe's place does not see is not there, and searches end beside surfaces) in place of [`LiveProbe`]'s parallax; rough lobes are filtered as they are seen from the
//! probe's place. Where nothing is met nothing changes, and where the map is seen from its own place nothing but by rounding. Deterministic.

use std::ops::Range;

use glam::Vec3;

use super::live::LiveProbe;
use super::probe::ProbeMap;
use super::shade::{Eye, PreviewPart, Seen, Target, frame};
use super::{LightProbe, Preview};
use crate::gpu::ash::vk;
use crate::gpu::interface::{BindingSet, SampledView};
use crate::gpu::shaders::techniques::preview::preview_search as kernel;
use crate::gpu::shaders::types::PreviewFrame;
use crate::gpu::{
    Access, Buffer, BufferBarrier, BufferDesc, Category, ComputePipeline, Gpu, PipelineInfo, Recorder, Sampler,
    SamplerDesc, rw_compute_to_compute,
};
use crate::maps::impostor::ImpostorSettings;
use crate::raster::Output;
use crate::scene::Camera;
use crate::scene::camera_frame::CameraFrame;
use crate::transport::{GpuScene, surface_spec};
use crate::{Error, Result};

/// What searches for what bodies mirror, in previews of one scene.
#[derive(Debug)]
pub struct SearchedReflections {
    pipeline: ComputePipeline<kernel::Kernel>,
    /// What scene, probe and search it was made for.
    spec: kernel::Spec,
    search: ImpostorSettings,
    frames: Buffer,
    sampler: Sampler,
}

impl SearchedReflections {
    /// Makes the kernel for a scene, the maps of a probe, and a search.
    ///
    /// # Errors
    /// [`Error::Setting`] and [`Error::LimitExceeded`] as [`ImpostorSettings::check`]; [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, scene: &GpuScene, probe: &LightProbe, search: &ImpostorSettings) -> Result<Self> {
        search.check(1)?;
        let spec = spec(scene, probe, search);
        let bytes = size_of::<PreviewFrame>() as u64;
        Ok(Self {
            pipeline: gpu.compute_pipeline(&spec)?,
            spec,
            search: *search,
            frames: gpu.buffer(&BufferDesc::storage("searched frame", bytes, Category::Work))?,
            sampler: gpu.sampler(&SamplerDesc {
                name: "searched texels",
                filter: vk::Filter::NEAREST,
                address: vk::SamplerAddressMode::CLAMP_TO_EDGE,
            })?,
        })
    }

    /// The kernel with its specialization.
    pub fn pipeline(&self) -> PipelineInfo {
        self.pipeline.info()
    }

    /// Records one pass behind [`Preview::record`] of the same scene and camera, and behind [`LiveProbe::record`]: triangles of a part that this same probe has lit, by numbers as those of its
    /// [`PreviewPart`], mirror what a search in its distances finds; from others it would take away light that was never added. `place` is where the probe was drawn, metres.
    ///
    /// # Errors
    /// [`Error::Setting`] for a camera that cannot be used, a place that is not finite, a probe without distances ([`LiveProbe::with_distances`]), a preview without probes or with cubes ([`PreviewDesc::probes`](super::PreviewDesc::probes)), and a scene with other features than those that it was made for;
    /// [`Error::MissingBarrier`] in debug builds.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        preview: &Preview,
        camera: &Camera,
        triangles: Range<u32>,
        (live, place): (&LiveProbe, Vec3),
    ) -> Result<()> {
        if !place.is_finite() {
            return Err(Error::setting("place", place, "is not finite"));
        }
        if spec(scene, live.probe(), &self.search) != self.spec {
            let cause = "has other features than that which the search was made for";
            return Err(Error::setting("scene or probe", "given", cause));
        }
        let unlit = match preview.desc().probes {
            Some(ProbeMap::Octahedron) => None,
            Some(ProbeMap::Cube) => Some(
                "lights by cubes, and a search is for what an octahedron has shown; PreviewDesc::probes says which",
            ),
            None => Some(
                "lights nothing by probes, and a search is for what they have shown; PreviewDesc::probes is needed",
            ),
        };
        if let Some(cause) = unlit {
            return Err(Error::setting("preview", "given", cause));
        }
        let (seen_from, around) = (&preview.drawing.gbuffer, live.gbuffer());
        let image = |output| around.image(output);
        let (Some(distances), Some(normals)) = (image(Output::Distance), image(Output::Normals)) else {
            let cause = "has no distances; one that LiveProbe::with_distances makes has";
            return Err(Error::setting("probe", "given", cause));
        };
        let image = |output| seen_from.image(output);
        let (Some(triangles_seen), Some(weights)) = (image(Output::Triangle), image(Output::Weights)) else {
            return Ok(());
        };
        let size = seen_from.size();
        let camera = CameraFrame::new(camera, size)?;
        let seen = Seen {
            scene,
            gbuffer: seen_from,
            lights: preview.lights(),
            eye: Eye::Camera(&camera),
            target: Target {
                buffer: &preview.radiance,
                first: 0,
                stride: size[0],
            },
        };
        let part = PreviewPart {
            triangles,
            background: false,
            probe: Some(live.probe()),
        };
        let frame = frame(&seen, &part);
        let view = |image| SampledView {
            image,
            sampler: &self.sampler,
        };
        recorder.pass("preview: search", |pass| {
            let barrier = |from, to| BufferBarrier {
                buffer: &self.frames,
                from,
                to,
            };
            pass.barrier(&[barrier(Access::COMPUTE_READ, Access::TRANSFER_WRITE)]);
            pass.update(self.frames.view(), &[frame])?;
            pass.barrier(&[barrier(Access::TRANSFER_WRITE, Access::COMPUTE_READ)]);
            let set = kernel::Set0 {
                seen_triangles: view(triangles_seen),
                seen_weights: view(weights),
                frames: self.frames.view(),
                radiance: preview.radiance.view(),
                probe_distances: view(distances),
                probe_normals: view(normals),
            };
            let push = kernel::Push {
                place: place.to_array(),
                farthest: scene.surfaces().reach(place),
                tolerance: self.search.tolerance,
            };
            let sets: [&dyn BindingSet<'_>; 3] = [&set, &live.probe().filtered().set(), &scene.scene_set()];
            let groups = self.pipeline.groups_over(size[0] * size[1]);
            pass.dispatch(&self.pipeline, &sets, &push, groups)?;
            pass.barrier(&[rw_compute_to_compute(&preview.radiance)]);
            Ok(())
        })
    }
}

/// What the kernel is specialized to.
fn spec(scene: &GpuScene, probe: &LightProbe, search: &ImpostorSettings) -> kernel::Spec {
    let constants = probe.filtered().constants();
    surface_spec!(kernel, scene, {
        has_multiple_scattering: false,
        separable_masking: false,
        directional_kind: constants.kind,
        directional_border: constants.border,
        impostor_method: search.method.number(),
        impostor_steps: search.steps,
        impostor_bisections: search.bisections,
        impostor_layers: 1,
        ..Default::default()
    })
}
