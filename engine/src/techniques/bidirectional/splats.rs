//! What light subpaths show the camera: a shadow ray for each of their vertices, and sums of what they bring by pixel, in integers.

use super::kernels::{quota_of, work};
use super::settings::BidirectionalSettings;
use crate::gpu::shaders::constants::LIGHT_VERTEX_QUARTERS;
use crate::gpu::shaders::sets::BidirectionalSet;
use crate::gpu::shaders::techniques::bidirectional::{bdpt_add, bdpt_camera, bdpt_splat};
use crate::gpu::shaders::types::{LightSplat, SplatSum};
use crate::gpu::{Buffer, Caps, ComputePipeline, Gpu};
use crate::scene::camera_frame::CameraFrame;
use crate::transport::{GpuScene, surface_spec};
use crate::{Error, Result};

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

/// Kernels and memory of what the camera is shown.
pub(super) struct CameraSplats {
    pub pipeline: ComputePipeline<bdpt_camera::Kernel>,
    pub splat: ComputePipeline<bdpt_splat::Kernel>,
    pub add: ComputePipeline<bdpt_add::Kernel>,
    pub splats: Buffer,
    pub sums: Buffer,
    pub frame: CameraFrame,
    pub size: [u32; 2],
    bounces: [u32; 2],
}

impl CameraSplats {
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        frame: &CameraFrame,
        size: [u32; 2],
        settings: &BidirectionalSettings,
        capacity: u32,
    ) -> Result<Self> {
        let pixels = size[0] * size[1];
        Ok(Self {
            pipeline: camera_pipeline(gpu, scene, frame, settings)?,
            splat: gpu.compute_pipeline(&Default::default())?,
            add: gpu.compute_pipeline(&Default::default())?,
            splats: splats(gpu, capacity)?,
            sums: work(
                gpu,
                "splat sums",
                size_of::<SplatSum>(),
                pixels * settings.pass_of(pixels)[0],
            )?,
            frame: *frame,
            size,
            bounces: settings.bounces(),
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

    /// For the vertices from `first` up to `end`, or those of them that have stopped.
    pub fn push(
        &self,
        scene: &GpuScene,
        walks: ShownWalks,
        [first, end]: [u32; 2],
        goes_on: bool,
    ) -> bdpt_camera::Push {
        let (v, [lower, upper]) = (&self.frame, scene.bounds());
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
            first,
            end,
            goes_on: goes_on.into(),
        }
    }
}

/// The kernel that shows vertices to a camera.
pub(super) fn camera_pipeline(
    gpu: &Gpu,
    scene: &GpuScene,
    frame: &CameraFrame,
    settings: &BidirectionalSettings,
) -> Result<ComputePipeline<bdpt_camera::Kernel>> {
    let traversal = scene.index_traversal();
    let spec = surface_spec!(bdpt_camera, scene, {
        has_multiple_scattering: scene.bsdf_features().multiple_scattering,
        separable_masking: false,
        has_alpha: scene.profile().has_alpha(),
        has_lens: frame.lens_radius > 0.0 && !frame.orthographic,
        parallel_camera: frame.orthographic,
        strategy: settings.strategies.kind(),
        index_quota: quota_of(gpu, scene, settings, 1)?,
        index_kind: traversal.kind(),
        ..Default::default()
    });
    traversal.pipeline(gpu, &spec)
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
