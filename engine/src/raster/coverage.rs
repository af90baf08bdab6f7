//! How many fragments triangles make at most, and draws that are parted by it, so that each is a bounded piece of work.
//!
//! The bound of a triangle in a view is the rectangle about its corners, cut by the picture; all of the picture where the triangle passes through the
//! plane that the view begins at. Deterministic. Twin of `raster/coverage.glsl`: [`fragments`].

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::surfaces::Surfaces;
use super::view::View;
use crate::Result;
use crate::gpu::shaders::constants::COVERAGE_BLOCK;
use crate::gpu::shaders::raster::coverage as kernel;
use crate::gpu::shaders::sets::RasterSet;
use crate::gpu::{BufferDesc, Category, ComputePipeline, DeviceKind, Gpu};

/// What a triangle takes beside its fragments, as so many of them: software devices draw some ten million triangles and three billion fragments a second.
const TRIANGLE_FRAGMENTS: f64 = 256.0;
/// Fragments of a draw, at most, where a block has no more: a tenth of a second on two cores.
const SOFTWARE_FRAGMENTS: f64 = 1.3e8;
/// On devices with a rasterizer, a tenth of a second of a slow one.
const DEVICE_FRAGMENTS: f64 = 1e9;

/// A part of a draw.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct DrawPart {
    /// Numbers of triangles.
    pub triangles: Range<u32>,
    /// The pictures are emptied before it.
    pub begins: bool,
    /// No other part follows.
    pub ends: bool,
}

impl DrawPart {
    /// All triangles at once.
    pub fn whole(surfaces: &Surfaces<'_>) -> Self {
        Self {
            triangles: 0..surfaces.triangles,
            begins: true,
            ends: true,
        }
    }
}

/// Bounds draws by the device.
#[derive(Debug)]
pub struct Coverage {
    gpu: Gpu,
    pipeline: ComputePipeline<kernel::Kernel>,
}

impl Coverage {
    /// Makes the kernel.
    ///
    /// # Errors
    /// As [`Gpu::compute_pipeline`].
    pub fn new(gpu: &Gpu) -> Result<Self> {
        Ok(Self {
            gpu: gpu.clone(),
            pipeline: gpu.compute_pipeline(&())?,
        })
    }

    /// Parts of a draw of all surfaces in `views` of a target of `size` pixels, in the order of the triangles: one or more. Waits for the device.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory), [`Error::DeviceLost`](crate::Error::DeviceLost).
    pub(crate) fn parts(&self, surfaces: &Surfaces<'_>, views: &[View], size: [u32; 2]) -> Result<Vec<DrawPart>> {
        self.parts_at(1.0, surfaces, views, size)
    }

    /// As [`Coverage::parts`], of fragments each of which software devices take as long over as over `cost` of a picture.
    pub(crate) fn parts_at(
        &self,
        cost: f64,
        surfaces: &Surfaces<'_>,
        views: &[View],
        size: [u32; 2],
    ) -> Result<Vec<DrawPart>> {
        let most = match self.gpu.caps().kind {
            DeviceKind::Cpu => SOFTWARE_FRAGMENTS / cost,
            _ => DEVICE_FRAGMENTS,
        };
        let [width, height] = size.map(f64::from);
        // Few triangles are one draw, wherever they are.
        let each = width * height * views.len() as f64 + TRIANGLE_FRAGMENTS;
        if each * f64::from(surfaces.triangles) <= most {
            return Ok(vec![DrawPart::whole(surfaces)]);
        }
        Ok(parts_of(&self.blocks(surfaces, views, size)?, surfaces.triangles, most))
    }

    /// Most fragments of each 64 triangles, one block behind the other, in all of `views` of a target of `size` pixels together. Waits for the device.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory), [`Error::DeviceLost`](crate::Error::DeviceLost).
    pub fn blocks(&self, surfaces: &Surfaces<'_>, views: &[View], size: [u32; 2]) -> Result<Vec<f32>> {
        let count = surfaces.triangles.div_ceil(COVERAGE_BLOCK) as usize;
        let records: Vec<_> = views.iter().map(|view| view.record).collect();
        let records = self.gpu.buffer_with("raster views", Category::Work, &records)?;
        let bytes = (count * size_of::<f32>()) as u64;
        let blocks = self
            .gpu
            .buffer(&BufferDesc::storage("coverage", bytes, Category::Work))?;
        let mut recorder = self.gpu.recorder("coverage")?;
        recorder.pass("raster: coverage", |pass| {
            let raster = RasterSet {
                raster_views: records.view(),
                // No object is asked for.
                raster_objects: surfaces.set.scene_triangles,
            };
            let own = kernel::Set1 { blocks: blocks.view() };
            let push = kernel::Push {
                size: size.map(|side| side as f32),
                triangles: surfaces.triangles,
                views: views.len() as u32,
            };
            let groups = self.pipeline.groups_over(surfaces.triangles);
            pass.dispatch(&self.pipeline, &[&raster, &own, &surfaces.set], &push, groups)
        })?;
        recorder.submit()?.wait()?;
        self.gpu.read(blocks.view(), count)
    }
}

/// Blocks of triangles, one behind the other, into parts that have no more than `most` fragments, or one block.
fn parts_of(blocks: &[f32], triangles: u32, most: f64) -> Vec<DrawPart> {
    let mut parts: Vec<DrawPart> = Vec::new();
    let mut fragments = f64::INFINITY;
    for (number, block) in (0u32..).zip(blocks) {
        let start = number * COVERAGE_BLOCK;
        let end = (start + COVERAGE_BLOCK).min(triangles);
        let of_block = f64::from(*block) + TRIANGLE_FRAGMENTS * f64::from(end - start);
        fragments += of_block;
        match parts.last_mut().filter(|_| fragments <= most) {
            Some(part) => part.triangles.end = end,
            None => {
                fragments = of_block;
                parts.push(DrawPart {
                    triangles: start..end,
                    begins: parts.is_empty(),
                    ends: false,
                });
            }
        }
    }
    match parts.last_mut() {
        Some(last) => last.ends = true,
        None => parts.push(DrawPart {
            triangles: 0..triangles,
            begins: true,
            ends: true,
        }),
    }
    parts
}

/// Most fragments of a triangle in a view of a target of `size` pixels; corners in metres.
pub fn fragments(view: &View, size: [u32; 2], corners: [DVec3; 3]) -> f64 {
    let size = DVec2::from(size.map(f64::from));
    let clip = corners.map(|corner| view.project(corner));
    let behind = clip.iter().filter(|[_, _, z, w]| z > w).count();
    let places = clip.map(|[x, y, _, w]| DVec2::new(x, y) / w);
    let lower = places[0].min(places[1]).min(places[2]);
    let upper = places[0].max(places[1]).max(places[2]);
    if behind > 0 {
        return if behind < 3 { size.element_product() } else { 0.0 };
    }
    if lower.max_element() > 1.0 || upper.min_element() < -1.0 {
        return 0.0;
    }
    let sides = 0.5 * (upper.min(DVec2::ONE) - lower.max(DVec2::NEG_ONE)) * size + 1.0;
    sides.min(size).element_product()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_hold_all_triangles_in_order_and_no_more_work_than_they_may() {
        let free = f64::from(COVERAGE_BLOCK) * TRIANGLE_FRAGMENTS;
        let blocks = [0.0, 10.0, 20.0, 1e9, 5.0, 5.0, 30.0];
        let triangles = 6 * COVERAGE_BLOCK + 1;
        let parts = parts_of(&blocks, triangles, 3.0 * free + 40.0);
        let ranges: Vec<_> = parts.iter().map(|part| part.triangles.clone()).collect();
        let block = |number: u32| number * COVERAGE_BLOCK;
        assert_eq!(
            ranges,
            [0..block(3), block(3)..block(4), block(4)..triangles],
            "a block with more than a part may have is one by itself"
        );
        let ends: Vec<_> = parts.iter().map(|part| (part.begins, part.ends)).collect();
        assert_eq!(ends, [(true, false), (false, false), (false, true)]);
        // Nothing to draw still empties the pictures.
        assert_eq!(parts_of(&[], 0, 1.0).len(), 1);
        assert!(parts_of(&[1.0], 3, 0.0)[0].ends);
    }
}
