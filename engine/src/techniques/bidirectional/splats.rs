//! What light subpaths show the camera: a shadow ray for each of their vertices, and sums of what they bring by pixel, in integers.

use super::kernels::{Viewpoint, media_set_of, quota_of, stretches_of, work};
use super::settings::BidirectionalSettings;
use crate::Result;
use crate::gpu::shaders::constants::{
    BOUNCES_MOST_SHIFT, BOUNCES_UNBOUNDED, LIGHT_VERTEX_QUARTERS, NO_MEDIUM, SPLATS_GO_ON,
};
use crate::gpu::shaders::sets::{BidirectionalMediaSet, BidirectionalSet};
use crate::gpu::shaders::techniques::bidirectional::{bdpt_add, bdpt_camera, bdpt_medium_camera, bdpt_splat};
use crate::gpu::shaders::types::{LightSplat, MediumRay, SplatSum};
use crate::gpu::{Buffer, Caps, ComputePipeline, Gpu, Pass, PipelineInfo};
use crate::transport::{GpuScene, surface_spec};

/// Sums are the same bits for up to as many splats.
const SPLATS_MAX: u64 = 1 << 22;

/// Whose vertices are shown.
#[derive(Debug, Clone, Copy)]
pub(super) struct ShownWalks {
    pub pass: u32,
    /// Walks of a group.
    pub group: u32,
    pub seed: u32,
}

/// The kernel that shows vertices to a camera.
pub(super) enum SightKernel {
    Surfaces(ComputePipeline<bdpt_camera::Kernel>),
    /// In scenes with media.
    Media(ComputePipeline<bdpt_medium_camera::Kernel>),
}

/// Kernels and memory of what the camera is shown.
pub(super) struct CameraSplats {
    pub sight: SightKernel,
    pub splat: ComputePipeline<bdpt_splat::Kernel>,
    pub add: ComputePipeline<bdpt_add::Kernel>,
    pub splats: Buffer,
    pub sums: Buffer,
    pub view: Viewpoint,
    pub size: [u32; 2],
    /// Of its ray that a vertex takes in a dispatch; 1 in scenes without media.
    pub stretches: u32,
    bounces: [u32; 2],
    /// Of the vertices of a dispatch, in scenes with media.
    rays: Option<Buffer>,
}

/// Vertices that are shown together.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shown {
    pub first: u32,
    pub end: u32,
    /// Those of them that have stopped.
    pub goes_on: bool,
}

impl CameraSplats {
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        view: &Viewpoint,
        size: [u32; 2],
        settings: &BidirectionalSettings,
        (capacity, at_once): (u32, u32),
    ) -> Result<Self> {
        let pixels = size[0] * size[1];
        let rays = || work(gpu, "splat rays", size_of::<MediumRay>(), at_once);
        let rays = scene.profile().media.any().then(rays);
        let (sight, stretches) = SightKernel::new(gpu, scene, view, settings)?;
        Ok(Self {
            sight,
            splat: gpu.compute_pipeline(&Default::default())?,
            add: gpu.compute_pipeline(&Default::default())?,
            splats: splats(gpu, capacity)?,
            sums: work(
                gpu,
                "splat sums",
                size_of::<SplatSum>(),
                pixels * settings.pass_of(pixels)[0],
            )?,
            view: *view,
            size,
            stretches,
            bounces: settings.bounces(),
            rays: rays.transpose()?,
        })
    }

    /// The set of its kernels, with what light subpaths have of it.
    pub fn set<'a>(&'a self, of_walks: BidirectionalSet<'a>) -> BidirectionalSet<'a> {
        BidirectionalSet {
            light_splats: self.splats.view(),
            splat_sums: self.sums.view(),
            ..of_walks
        }
    }

    /// Records what some vertices show the camera.
    ///
    /// # Errors
    /// Those of recording.
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        scene: &GpuScene,
        set: &BidirectionalSet<'_>,
        walks: ShownWalks,
        shown: Shown,
    ) -> Result<()> {
        let (index, of_scene) = (scene.index_set(), scene.scene_set());
        let (push, vertices) = (self.push(scene, walks, shown), shown.end - shown.first);
        match &self.sight {
            SightKernel::Surfaces(kernel) => {
                let groups = [kernel.groups_for(vertices), 1, 1];
                pass.dispatch(kernel, &[&index, &of_scene, set], &push, groups)
            }
            SightKernel::Media(kernel) => {
                let rays = self.rays.as_ref().unwrap_or(&self.splats);
                let media = BidirectionalMediaSet {
                    medium_splat_rays: rays.view(),
                    ..media_set_of(scene, &self.sums)
                };
                let push = self.push_in_media(scene, push);
                let groups = [kernel.groups_for(vertices), 1, 1];
                pass.dispatch(kernel, &[&index, &of_scene, set, &media], &push, groups)
            }
        }
    }

    /// The same for scenes with media.
    fn push_in_media(&self, scene: &GpuScene, told: bdpt_camera::Push) -> bdpt_medium_camera::Push {
        let most = match self.bounces[1] {
            u32::MAX => BOUNCES_UNBOUNDED,
            most => most,
        };
        bdpt_medium_camera::Push {
            origin: told.origin,
            half_width: told.half_width,
            right: told.right,
            half_height: told.half_height,
            up: told.up,
            lens_radius: told.lens_radius,
            forward: told.forward,
            focus_distance: told.focus_distance,
            width: told.width,
            height: told.height,
            scene_lower: told.scene_lower,
            bounces: self.bounces[0] | most << BOUNCES_MOST_SHIFT,
            scene_upper: told.scene_upper,
            interior: self.view.interior,
            pass: told.pass,
            walks: told.walks,
            seed: told.seed,
            first: told.first | if told.goes_on != 0 { SPLATS_GO_ON } else { 0 },
            end: told.end,
            surrounding: scene.surrounding().unwrap_or(NO_MEDIUM),
        }
    }

    fn push(&self, scene: &GpuScene, walks: ShownWalks, shown: Shown) -> bdpt_camera::Push {
        let (v, [lower, upper]) = (&self.view.frame, scene.bounds());
        bdpt_camera::Push {
            origin: v.origin,
            half_width: v.half_width,
            right: v.right,
            half_height: v.half_height,
            up: v.up,
            lens_radius: v.lens_radius,
            forward: v.forward,
            focus_distance: v.focus_distance,
            width: self.size[0],
            height: self.size[1],
            scene_lower: lower.to_array(),
            least_bounces: self.bounces[0],
            scene_upper: upper.to_array(),
            most_bounces: self.bounces[1],
            pass: walks.pass,
            walks: walks.group,
            seed: walks.seed,
            first: shown.first,
            end: shown.end,
            goes_on: shown.goes_on.into(),
        }
    }
}

impl SightKernel {
    /// With the stretches of its ray that a vertex takes in a dispatch.
    ///
    /// # Errors
    /// As [`quota_of`], and those of pipelines.
    pub fn new(gpu: &Gpu, scene: &GpuScene, view: &Viewpoint, settings: &BidirectionalSettings) -> Result<(Self, u32)> {
        let (traversal, frame) = (scene.index_traversal(), &view.frame);
        let has_lens = frame.lens_radius > 0.0 && !frame.orthographic;
        let media = scene.profile().media;
        if media.any() {
            let (stretches, index_quota) = stretches_of(gpu, scene, settings, false)?;
            let spec = surface_spec!(bdpt_medium_camera, scene, {
                has_multiple_scattering: scene.bsdf_features().multiple_scattering,
                separable_masking: false,
                has_alpha: scene.profile().has_alpha(),
                has_media: true,
                has_grids: media.heterogeneous,
                has_homogeneous: media.homogeneous,
                has_path_automaton: settings.has_states(),
                has_lens,
                parallel_camera: frame.orthographic,
                strategy: settings.strategies.kind(),
                stretches,
                index_quota,
                index_kind: traversal.kind(),
                ..Default::default()
            });
            return Ok((Self::Media(traversal.pipeline(gpu, &spec)?), stretches));
        }
        let spec = surface_spec!(bdpt_camera, scene, {
            has_multiple_scattering: scene.bsdf_features().multiple_scattering,
            separable_masking: false,
            has_alpha: scene.profile().has_alpha(),
            has_media: false,
            has_path_automaton: settings.has_states(),
            has_lens,
            parallel_camera: frame.orthographic,
            strategy: settings.strategies.kind(),
            index_quota: quota_of(gpu, scene, settings, 1)?,
            index_kind: traversal.kind(),
            ..Default::default()
        });
        Ok((Self::Surfaces(traversal.pipeline(gpu, &spec)?), 1))
    }

    pub fn pipeline(&self) -> PipelineInfo {
        match self {
            Self::Surfaces(kernel) => kernel.info(),
            Self::Media(kernel) => kernel.info(),
        }
    }
}

/// Room for what so many vertices show.
pub(super) fn splats(gpu: &Gpu, vertices: u32) -> Result<Buffer> {
    work(gpu, "light splats", size_of::<LightSplat>(), vertices)
}

/// Vertices that a buffer of the device can hold, and sums can add.
pub(super) fn vertices_within(caps: &Caps) -> u64 {
    let quarter = size_of::<[u32; 4]>() as u64;
    let quarters = caps
        .max_texel_buffer_elements
        .min(caps.max_storage_buffer_range / quarter);
    (quarters / u64::from(LIGHT_VERTEX_QUARTERS)).min(SPLATS_MAX)
}

/// Sums of every pixel that a buffer of the device holds.
///
/// # Errors
/// [`Error::LimitExceeded`] where it holds less than one.
pub(super) fn sums_within(caps: &Caps, [width, height]: [u32; 2]) -> Result<u32> {
    let bytes = u64::from(width) * u64::from(height) * size_of::<SplatSum>() as u64;
    caps.check_storage("sums of light subpaths by pixel", bytes)?;
    let most = caps.max_storage_buffer_range / bytes.max(1);
    Ok(most.min(u32::MAX.into()) as u32)
}
