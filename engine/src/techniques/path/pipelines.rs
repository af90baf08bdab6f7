//! The path tracer's kernels, specialized to what a scene needs.

use super::settings::PathTracerSettings;
use super::stages::Compaction;
use crate::Result;
use crate::gpu::SOFTWARE_LOOP_CAP;
use crate::gpu::shaders::constants::{SHADOW_SURFACES, SHADOW_SURFACES_ALPHA};
use crate::gpu::shaders::transport::{
    path_camera, path_extend, path_extend_alpha, path_extend_media, path_extend_media_alpha, path_medium, path_resolve,
    path_shade, path_shadow, path_shadow_alpha, path_shadow_media, path_shadow_media_alpha,
};
use crate::gpu::{ComputePipeline, Gpu, PipelineInfo};
use crate::scene::Camera;
use crate::scene::camera_frame::CameraFrame;
use crate::transport::GpuScene;

/// Iterations after which a ray among surfaces with alpha goes on in a later dispatch, at most: a software driver's subgroup of 16 then
/// stays below [`SOFTWARE_LOOP_CAP`](crate::gpu::SOFTWARE_LOOP_CAP), even if its lanes take turns.
const ALPHA_QUOTA_MAX: u32 = 2048;

/// The same where shadow rays pass boundaries of media, up to eight in a dispatch, and with alpha besides, up to two.
const MEDIA_QUOTA_MAX: u32 = 2048;
const MEDIA_ALPHA_QUOTA_MAX: u32 = 512;

/// Loop iterations after which a ray goes on in a later dispatch.
///
/// # Errors
/// As [`DeviceTraversal::quota_within`](crate::accel::DeviceTraversal).
pub(crate) fn ray_quota(gpu: &Gpu, scene: &GpuScene, settings: &PathTracerSettings) -> Result<u32> {
    // With media half of the iterations are for walks through grids.
    let (most, iterations) = match (scene.profile().has_alpha(), scene.profile().media.any()) {
        (false, false) => (u32::MAX, SOFTWARE_LOOP_CAP),
        (true, false) => (ALPHA_QUOTA_MAX, SOFTWARE_LOOP_CAP),
        (false, true) => (MEDIA_QUOTA_MAX, SOFTWARE_LOOP_CAP / 2 / SHADOW_SURFACES),
        (true, true) => (MEDIA_ALPHA_QUOTA_MAX, SOFTWARE_LOOP_CAP / 2 / SHADOW_SURFACES_ALPHA),
    };
    let quota = settings.ray_quota.min(most);
    let filters = scene.profile().has_alpha();
    scene
        .index_traversal()
        .quota_within(gpu.caps(), quota, iterations, filters)
}

/// Specialization of a kernel that knows surfaces (`transport/arrival.glsl`) to those of a scene, with further fields.
macro_rules! surface_spec {
    ($shader:ident, $scene:expr, { $($further:tt)* }) => {{
        let (profile, bsdf) = ($scene.profile(), $scene.bsdf_features());
        $shader::Spec {
            has_metal: bsdf.metal,
            has_conductor: bsdf.conductor,
            has_specular_layer: bsdf.specular_layer,
            has_transmission: bsdf.transmission,
            has_textures: profile.has_textures,
            has_shading_normals: profile.has_shading_normals,
            has_normal_maps: profile.has_normal_maps,
            has_vertex_colors: profile.has_vertex_colors,
            has_absorption: profile.has_absorption,
            has_unlit: profile.has_unlit,
            $($further)*
        }
    }};
}
pub(crate) use surface_spec;

/// One kernel a stage.
pub(super) struct Pipelines {
    pub camera: ComputePipeline<path_camera::Kernel>,
    pub trace: TracePipelines,
    /// The same for rays that a quota stopped; made when the first one is.
    pub resume: Option<TracePipelines>,
    /// Only where there are media.
    pub medium: Option<ComputePipeline<path_medium::Kernel>>,
    pub shade: ComputePipeline<path_shade::Kernel>,
    pub compaction: Compaction,
    pub resolve: ComputePipeline<path_resolve::Kernel>,
}

/// Ray kernels, with the alpha test only where a scene has alpha.
pub(crate) enum TracePipelines {
    Opaque {
        extend: ComputePipeline<path_extend::Kernel>,
        shadow: ComputePipeline<path_shadow::Kernel>,
    },
    Alpha {
        extend: ComputePipeline<path_extend_alpha::Kernel>,
        shadow: ComputePipeline<path_shadow_alpha::Kernel>,
    },
    Media {
        extend: ComputePipeline<path_extend_media::Kernel>,
        shadow: ComputePipeline<path_shadow_media::Kernel>,
    },
    MediaAlpha {
        extend: ComputePipeline<path_extend_media_alpha::Kernel>,
        shadow: ComputePipeline<path_shadow_media_alpha::Kernel>,
    },
}

/// The first stage; it alone depends on the camera.
pub(super) fn camera_pipeline(
    gpu: &Gpu,
    settings: &PathTracerSettings,
    frame: &CameraFrame,
    camera: &Camera,
) -> Result<ComputePipeline<path_camera::Kernel>> {
    gpu.compute_pipeline(&path_camera::Spec {
        sampler_kind: settings.sampler as u32,
        has_lens: camera.lens_radius > 0.0 && !frame.orthographic,
        orthographic: frame.orthographic,
        write_aovs: settings.aovs,
    })
}

impl Pipelines {
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: &PathTracerSettings,
        frame: &CameraFrame,
        camera: &Camera,
    ) -> Result<Self> {
        let (profile, bsdf) = (scene.profile(), scene.bsdf_features());
        let overlapping = bsdf.metal || bsdf.specular_layer;
        let shade = surface_spec!(path_shade, scene, {
            has_multiple_scattering: bsdf.multiple_scattering && settings.multiple_scattering,
            separable_masking: settings.separable_masking && (bsdf.metal || bsdf.specular_layer || bsdf.transmission),
            has_environment: profile.has_environment(),
            has_area_lights: scene.has_area_lights(),
            has_punctual_lights: scene.has_punctual_lights(),
            sampler_kind: settings.sampler as u32,
            write_aovs: settings.aovs,
            has_alpha: profile.has_alpha(),
            has_media: profile.media.any(),
            has_path_automaton: settings.path_set.has_automaton(),
            has_lobe_labels: overlapping && settings.path_set.tells_reflections_apart(),
        });
        let medium = path_medium::Spec {
            // What surfaces scatter by is not compiled into this stage.
            has_textures: shade.has_textures,
            has_vertex_colors: shade.has_vertex_colors,
            has_shading_normals: false,
            has_normal_maps: false,
            has_absorption: shade.has_absorption,
            has_unlit: shade.has_unlit,
            has_environment: shade.has_environment,
            has_area_lights: shade.has_area_lights,
            has_punctual_lights: shade.has_punctual_lights,
            has_alpha: shade.has_alpha,
            sampler_kind: shade.sampler_kind,
            has_path_automaton: shade.has_path_automaton,
            has_grids: profile.media.heterogeneous,
            has_homogeneous: profile.media.homogeneous,
            has_airlight: settings.equiangular
                && profile.media.homogeneous
                && profile.media.scatters
                && profile.lights.point + profile.lights.spot > 0
                && shade.has_punctual_lights,
            ..Default::default()
        };
        let medium = shade.has_media.then(|| gpu.compute_pipeline(&medium)).transpose()?;
        Ok(Self {
            camera: camera_pipeline(gpu, settings, frame, camera)?,
            trace: TracePipelines::new(gpu, scene, settings, false)?,
            resume: None,
            medium,
            shade: gpu.compute_pipeline(&shade)?,
            compaction: Compaction::new(gpu)?,
            resolve: gpu.compute_pipeline(&path_resolve::Spec {
                write_aovs: settings.aovs,
            })?,
        })
    }

    /// The kernels with their specialization.
    pub fn info(&self) -> Vec<PipelineInfo> {
        let p = self;
        let [extend, shadow] = p.trace.info();
        let mut all = vec![p.camera.info(), extend, shadow, p.shade.info()];
        all.extend(p.compaction.info());
        all.push(p.resolve.info());
        all.extend(p.medium.as_ref().map(ComputePipeline::info));
        all
    }
}

impl TracePipelines {
    pub fn new(gpu: &Gpu, scene: &GpuScene, settings: &PathTracerSettings, resumes: bool) -> Result<Self> {
        let profile = scene.profile();
        let index_quota = ray_quota(gpu, scene, settings)?;
        let index_kind = scene.index_traversal().kind();
        let (has_textures, has_vertex_colors) = (profile.has_textures, profile.has_vertex_colors);
        let (has_grids, has_homogeneous) = (profile.media.heterogeneous, profile.media.homogeneous);
        if profile.media.any() && !profile.has_alpha() {
            return Ok(Self::Media {
                extend: gpu.compute_pipeline(&path_extend_media::Spec {
                    index_quota,
                    index_kind,
                    resumes,
                    ..Default::default()
                })?,
                shadow: gpu.compute_pipeline(&path_shadow_media::Spec {
                    index_quota,
                    index_kind,
                    resumes,
                    has_absorption: profile.has_absorption,
                    has_grids,
                    has_homogeneous,
                    ..Default::default()
                })?,
            });
        }
        if profile.media.any() {
            return Ok(Self::MediaAlpha {
                extend: gpu.compute_pipeline(&path_extend_media_alpha::Spec {
                    has_textures,
                    has_vertex_colors,
                    index_quota,
                    index_kind,
                    resumes,
                    ..Default::default()
                })?,
                shadow: gpu.compute_pipeline(&path_shadow_media_alpha::Spec {
                    has_textures,
                    has_vertex_colors,
                    index_quota,
                    index_kind,
                    resumes,
                    has_absorption: profile.has_absorption,
                    has_grids,
                    has_homogeneous,
                    ..Default::default()
                })?,
            });
        }
        if !profile.has_alpha() {
            return Ok(Self::Opaque {
                extend: gpu.compute_pipeline(&path_extend::Spec {
                    index_quota,
                    index_kind,
                    resumes,
                    ..Default::default()
                })?,
                shadow: gpu.compute_pipeline(&path_shadow::Spec {
                    index_quota,
                    index_kind,
                    resumes,
                    ..Default::default()
                })?,
            });
        }
        let extend = path_extend_alpha::Spec {
            has_textures,
            has_vertex_colors,
            index_quota,
            index_kind,
            resumes,
            ..Default::default()
        };
        let shadow = path_shadow_alpha::Spec {
            has_textures,
            has_vertex_colors,
            index_quota,
            index_kind,
            resumes,
            ..Default::default()
        };
        Ok(Self::Alpha {
            extend: gpu.compute_pipeline(&extend)?,
            shadow: gpu.compute_pipeline(&shadow)?,
        })
    }

    pub fn info(&self) -> [PipelineInfo; 2] {
        match self {
            Self::Opaque { extend, shadow } => [extend.info(), shadow.info()],
            Self::Alpha { extend, shadow } => [extend.info(), shadow.info()],
            Self::Media { extend, shadow } => [extend.info(), shadow.info()],
            Self::MediaAlpha { extend, shadow } => [extend.info(), shadow.info()],
        }
    }
}
