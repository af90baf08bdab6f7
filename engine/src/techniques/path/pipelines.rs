//! The path tracer's own kernels, specialized to what a scene needs.

use super::directions::DirectionsStage;
use super::settings::PathTracerSettings;
use super::shared_light::SharedLight;
use crate::Result;
use crate::gpu::shaders::techniques::path::{path_camera, path_medium, path_refill, path_resolve, path_shade};
use crate::gpu::{ComputePipeline, Gpu, PipelineInfo};
use crate::scene::Camera;
use crate::scene::camera_frame::CameraFrame;
use crate::transport::{GpuScene, surface_spec};

/// One kernel a stage of its own.
pub(super) struct Pipelines {
    pub camera: CameraStage,
    /// Only where there are media.
    pub medium: Option<ComputePipeline<path_medium::Kernel>>,
    pub shade: ComputePipeline<path_shade::Kernel>,
    pub resolve: ComputePipeline<path_resolve::Kernel>,
}

/// The first stage: of whole waves, of waves that are kept full, or of pictures in all directions. It alone depends on the camera.
pub(super) enum CameraStage {
    Whole(ComputePipeline<path_camera::Kernel>),
    Refilled(ComputePipeline<path_refill::Kernel>),
    Directions(DirectionsStage),
}

impl CameraStage {
    pub fn new(
        gpu: &Gpu,
        settings: &PathTracerSettings,
        has_media: bool,
        frame: &CameraFrame,
        camera: &Camera,
    ) -> Result<Self> {
        let has_lens = camera.lens_radius > 0.0 && !frame.orthographic;
        if settings.keeps_waves_full() {
            let refill = gpu.compute_pipeline(&path_refill::Spec {
                sampler_kind: settings.sampler as u32,
                has_lens,
                orthographic: frame.orthographic,
                write_aovs: settings.aovs,
                has_media,
            });
            return Ok(Self::Refilled(refill?));
        }
        let whole = gpu.compute_pipeline(&path_camera::Spec {
            sampler_kind: settings.sampler as u32,
            has_lens,
            orthographic: frame.orthographic,
            write_aovs: settings.aovs,
            numbered: settings.numbers_samples(),
        });
        Ok(Self::Whole(whole?))
    }

    pub fn info(&self) -> PipelineInfo {
        match self {
            Self::Whole(camera) => camera.info(),
            Self::Refilled(camera) => camera.info(),
            Self::Directions(stage) => stage.pipeline().info(),
        }
    }
}

impl Pipelines {
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: &PathTracerSettings,
        has_light_tree: bool,
        shared_light: SharedLight,
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
            numbered: settings.numbers_samples(),
            has_alpha: profile.has_alpha(),
            has_media: profile.media.any(),
            has_light_tree,
            has_path_automaton: settings.path_set.has_automaton(),
            has_lobe_labels: overlapping && settings.path_set.tells_reflections_apart(),
            count_fetches: settings.count_fetches,
            edge_bound: shared_light.edge_bound.kind(),
            sharing_photons: shared_light.photons,
            shares_planes: shared_light.plane_share.is_some(),
        });
        let medium = path_medium::Spec {
            // What surfaces scatter by is not compiled into this stage.
            has_textures: shade.has_textures,
            has_vertex_colors: shade.has_vertex_colors,
            has_shading_normals: false,
            has_normal_maps: false,
            has_absorption: shade.has_absorption,
            has_unlit: shade.has_unlit,
            has_instances: shade.has_instances,
            has_environment: shade.has_environment,
            has_area_lights: shade.has_area_lights,
            has_punctual_lights: shade.has_punctual_lights,
            has_alpha: shade.has_alpha,
            has_light_tree,
            sampler_kind: shade.sampler_kind,
            has_path_automaton: shade.has_path_automaton,
            numbered: shade.numbered,
            sharing_photons: shade.sharing_photons,
            shares_planes: shade.shares_planes,
            has_grids: profile.media.heterogeneous,
            has_homogeneous: profile.media.homogeneous,
            has_airlight: settings.equiangular && scene.airlight_helps(),
            count_fetches: settings.count_fetches,
            edge_bound: shade.edge_bound,
            ..Default::default()
        };
        let medium = shade.has_media.then(|| gpu.compute_pipeline(&medium)).transpose()?;
        Ok(Self {
            camera: CameraStage::new(gpu, settings, profile.media.any(), frame, camera)?,
            medium,
            shade: gpu.compute_pipeline(&shade)?,
            resolve: gpu.compute_pipeline(&path_resolve::Spec {
                write_aovs: settings.aovs,
            })?,
        })
    }
}
