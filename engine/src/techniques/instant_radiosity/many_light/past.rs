//! What a frame's indirect light is blended with: that of the frame before, pixel by pixel.
//!
//! Source: C. Sun, "Many-Light Real-Time Global Illumination using Sparse Voxel Octree", Master's thesis, WPI, 2015, §2.2.4; what it computes is in
//! [`history`](super::history). Two buffers take turns, so that each frame reads what the one before has left while it writes what it leaves itself; they change places when a frame has
//! ended, so that one that is given up leaves no trace.

use std::ops::Range;

use super::kernels::Seen;
use super::settings::ManyLightSettings;
use crate::Result;
use crate::gpu::shaders::techniques::instant_radiosity::deferred_history;
use crate::gpu::shaders::types::{HistoryPixel, SeenFrom};
use crate::gpu::{Buffer, BufferDesc, Category, ComputePipeline, Gpu, Pass, PipelineInfo};
use crate::techniques::Part;
use crate::transport::GpuScene;

/// What a pixel of a window takes, as so many steps of a ray through an index.
const WINDOW_WORK: u64 = 8;

/// The frame before, and what blends with it.
pub(super) struct Past {
    pipeline: ComputePipeline<deferred_history::Kernel>,
    /// Indirect light of the frame under way, by pixel.
    light: Buffer,
    /// What frames have left, by turns.
    left: [Buffer; 2],
    /// The one of these that the frame before has left.
    last: usize,
    /// From where that was seen; `None` where there is none.
    before: Option<SeenFrom>,
    most: f32,
    weights: [f32; 3],
    bound: f32,
    plane_max: f32,
    normal_min: f32,
    extent: f32,
    interleave: u32,
    adds: bool,
    size: [u32; 2],
    /// Pixels of a submission.
    pub pixels: u32,
}

impl Past {
    /// Where settings ask for one; of pictures of `size` pixels that have other light beside it, or not.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: &ManyLightSettings,
        size: [u32; 2],
        adds: bool,
    ) -> Result<Option<Self>> {
        if !settings.has_history() {
            return Ok(None);
        }
        let [lower, upper] = scene.bounds();
        let extent = (upper - lower).length();
        let pixels = size[0] * size[1];
        let buffer = |name, bytes: usize| {
            let bytes = bytes as u64 * u64::from(pixels);
            gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work))
        };
        let left = || buffer("history of pixels", size_of::<HistoryPixel>());
        // As wide as the kernel's, of this frame and of the one before.
        let window = u64::from((settings.interleave / 2).max(1) * 2 + 1).pow(2);
        let parts = Part::count(gpu, 2 * WINDOW_WORK * window * u64::from(pixels));
        Ok(Some(Self {
            pipeline: gpu.compute_pipeline(&Default::default())?,
            light: buffer("indirect light", size_of::<[f32; 3]>())?,
            left: [left()?, left()?],
            last: 0,
            before: None,
            most: settings.history,
            weights: [
                settings.history_position,
                settings.history_normal,
                settings.history_light,
            ],
            bound: settings.history_bound,
            plane_max: settings.filter_plane * extent,
            normal_min: settings.filter_normal,
            // Nothing changes its place in a scene of one point.
            extent: if extent > 0.0 { extent } else { 1.0 },
            interleave: settings.interleave,
            adds,
            size,
            pixels: pixels.div_ceil(parts).max(1),
        }))
    }

    /// Where the light of the frame under way goes.
    pub fn light(&self) -> &Buffer {
        &self.light
    }

    pub fn info(&self) -> PipelineInfo {
        self.pipeline.info()
    }

    pub fn bytes(&self) -> u64 {
        [&self.light, &self.left[0], &self.left[1]]
            .map(Buffer::bytes)
            .iter()
            .sum()
    }

    /// Blends the light of these pixels into the picture. `colors` are those of the split picture.
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        seen: &Seen,
        from: SeenFrom,
        colors: &Buffer,
        pixels: Range<u32>,
        radiance: &Buffer,
    ) -> Result<()> {
        let groups = self.pipeline.groups_over(pixels.len() as u32);
        let push = deferred_history::Push {
            before: self.before.unwrap_or(from),
            has_before: self.before.is_some().into(),
            weights: self.weights,
            most: self.most,
            bound: self.bound,
            plane_max: self.plane_max,
            normal_min: self.normal_min,
            extent: self.extent,
            interleave: self.interleave,
            adds: self.adds.into(),
            first_pixel: pixels.start,
            end_pixel: pixels.end,
        };
        let set = deferred_history::Set0 {
            seen_positions: seen.positions()?,
            seen_normals: seen.normals()?,
            seen_objects: seen.objects()?,
            split_colors: colors.view(),
            light_now: self.light.view(),
            pixels_before: self.left[self.last].view(),
            pixels_now: self.left[1 - self.last].view(),
            radiance: radiance.view(),
        };
        pass.dispatch(&self.pipeline, &[&set], &push, groups)
    }

    /// A frame that was seen from there has ended, and is the one before.
    pub fn keep(&mut self, from: SeenFrom) {
        self.last = 1 - self.last;
        self.before = Some(from);
    }

    /// Forgets all frames.
    pub fn forget(&mut self) {
        self.before = None;
    }

    /// By pixel, the share of the last frame's light that was that of the frame before; 0 where nothing is seen, none without a frame. Waits for the device.
    pub fn confidence(&self, gpu: &Gpu) -> Result<Vec<f32>> {
        if self.before.is_none() {
            return Ok(Vec::new());
        }
        let pixels = (self.size[0] * self.size[1]) as usize;
        let left: Vec<HistoryPixel> = gpu.read(self.left[self.last].view(), pixels)?;
        Ok(left.iter().map(|pixel| pixel.confidence.max(0.0)).collect())
    }
}
