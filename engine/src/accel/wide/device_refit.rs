//! Wide trees refitted by the device: corners first, then grids and boxes, a dispatch a level from the deepest up.
//!
//! Guarantees: the same bytes as [`refit`](super::refit()); no invocation waits for another.

use super::{ResidentWide, WideBvh, WideNode};
use crate::accel::lbvh::{check_moved, moved_corners};
use crate::accel::{BuildStages, IndexStatistics, RayIndex};
use crate::gpu::ash::vk;
use crate::gpu::shaders::accel::{wide_refit, wide_refit_triangles};
use crate::gpu::shaders::constants;
use crate::gpu::{Access, Buffer, BufferDesc, Category, ComputePipeline, Gpu, Recorder, TexelView, Timings};
use crate::{Error, Result};
use glam::Vec3;

/// Bytes of a node's box.
const BOX_BYTES: u64 = size_of::<[i32; 4]>() as u64 * constants::LBVH_BOX_QUARTERS as u64;

/// Refits wide trees on one device.
#[derive(Debug)]
pub struct WideRefitter {
    gpu: Gpu,
    triangles: ComputePipeline<wide_refit_triangles::Kernel>,
    boxes: ComputePipeline<wide_refit::Kernel>,
}

/// A wide tree on the device, and what refitting it takes.
#[derive(Debug)]
pub struct RefittableWide {
    /// What rays traverse, as [`RayIndex::texels`] has it.
    pub texels: TexelView,
    /// Corners of the triangles by their indices, three vectors each, metres, also of those that the tree has left out, which are not read. To be filled
    /// before a refit with numbers that are finite and within [`MAX_COORDINATE`](crate::accel::MAX_COORDINATE); triangles without an area have to be points.
    pub corners: Buffer,
    triangles: u32,
    levels: Buffer,
    /// Where each level ends among the nodes.
    ends: Vec<u32>,
    boxes: Buffer,
}

impl RefittableWide {
    /// Bytes of everything.
    pub fn bytes(&self) -> u64 {
        let texels = self.texels.buffer();
        [texels, &self.corners, &self.levels, &self.boxes]
            .iter()
            .map(|buffer| buffer.bytes())
            .sum()
    }
}

impl WideRefitter {
    /// Makes the pipelines.
    ///
    /// # Errors
    /// As [`Gpu::compute_pipeline`].
    pub fn new(gpu: &Gpu) -> Result<Self> {
        Ok(Self {
            gpu: gpu.clone(),
            triangles: gpu.compute_pipeline(&Default::default())?,
            boxes: gpu.compute_pipeline(&Default::default())?,
        })
    }

    /// Uploads a tree.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] for one that the device cannot bind, [`Error::OutOfMemory`].
    pub fn upload(&self, index: &WideBvh) -> Result<RefittableWide> {
        let format = vk::Format::R32G32B32A32_UINT;
        let count = index.texels().len() as u64;
        let texels = self.gpu.storage_texels("wide", Category::Index, format, count)?;
        self.gpu.upload(texels.buffer(), 0, index.texels())?;
        let (levels, ends) = levels_of(index.nodes());
        let desc = BufferDesc::storage("wide levels", 4 * levels.len() as u64, Category::Index);
        let buffer = self.gpu.buffer(&desc)?;
        self.gpu.upload(&buffer, 0, &levels)?;
        self.with(texels, buffer, ends, &index.statistics())
    }

    /// Of a tree that the device has built.
    ///
    /// # Errors
    /// As [`WideRefitter::upload`].
    pub fn resident(&self, index: &ResidentWide) -> Result<RefittableWide> {
        let (texels, levels) = (index.texels.clone(), index.levels.clone());
        self.with(texels, levels, index.ends.clone(), &index.statistics)
    }

    fn with(
        &self,
        texels: TexelView,
        levels: Buffer,
        ends: Vec<u32>,
        statistics: &IndexStatistics,
    ) -> Result<RefittableWide> {
        let nodes = ends.last().copied().unwrap_or_default();
        let all = statistics.triangles + statistics.excluded_range + statistics.excluded_degenerate;
        let buffer = |name, bytes: u64| {
            self.gpu
                .buffer(&BufferDesc::storage(name, bytes.max(4), Category::Index))
        };
        Ok(RefittableWide {
            texels,
            corners: buffer("wide corners", size_of::<[Vec3; 3]>() as u64 * all)?,
            triangles: statistics.triangles as u32,
            levels,
            ends,
            boxes: buffer("wide boxes", BOX_BYTES * u64::from(nodes))?,
        })
    }

    /// Records a refit to the triangles that are in [`RefittableWide::corners`], which must be visible to compute shaders: passes
    /// `wide: refit triangles` and `wide: refit boxes`. Earlier uses of the texels by compute shaders and copies are waited for. The tree stays what it was, so it is best where little has moved. It ends with a barrier: compute
    /// shaders and copies may read the texels after it.
    ///
    /// # Errors
    /// As [`Pass::dispatch`](crate::gpu::Pass::dispatch).
    pub fn record(&self, recorder: &mut Recorder, index: &RefittableWide) -> Result<()> {
        if index.triangles == 0 {
            return Ok(());
        }
        let words = index.texels.buffer().view();
        recorder.pass("wide: refit triangles", |pass| {
            // Copies, too, may read the texels of the last refit.
            pass.memory_barrier(Access::COMPUTE.union(Access::TRANSFER), Access::COMPUTE);
            let set = wide_refit_triangles::Set0 {
                wide_texels: words,
                wide_corners: index.corners.view(),
            };
            let count = index.triangles;
            let groups = [self.triangles.groups_for(count), 1, 1];
            pass.dispatch(&self.triangles, &[&set], &wide_refit_triangles::Push { count }, groups)?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            Ok(())
        })?;
        recorder.pass("wide: refit boxes", |pass| {
            let set = wide_refit::Set0 {
                wide_texels: words,
                wide_levels: index.levels.view(),
                wide_boxes: index.boxes.view(),
            };
            for (level, end) in index.ends.iter().enumerate().rev() {
                let begin = level.checked_sub(1).map_or(0, |above| index.ends[above]);
                let count = end - begin;
                let groups = [self.boxes.groups_for(count), 1, 1];
                pass.dispatch(&self.boxes, &[&set], &wide_refit::Push { begin, count }, groups)?;
                pass.memory_barrier(Access::COMPUTE, Access::COMPUTE.union(Access::TRANSFER));
            }
            Ok(())
        })
    }

    /// Refits a tree to moved triangles, all of those that `before`, the same tree on the host, was made of, and reads it back. Those that were left out
    /// stay so, and those that have lost their area shrink to points.
    ///
    /// # Errors
    /// [`Error::Setting`] for another number of triangles, for one that has moved out of range, or for another tree, and those of a submission.
    pub fn refit(
        &self,
        index: &RefittableWide,
        before: &WideBvh,
        triangles: &[[Vec3; 3]],
    ) -> Result<(WideBvh, Timings)> {
        let statistics = before.statistics();
        let nodes = index.ends.last().copied().unwrap_or_default();
        if (u64::from(nodes), u64::from(index.triangles)) != (statistics.nodes, statistics.triangles) {
            let cause = "are not those of the tree on the device";
            return Err(Error::setting("nodes and triangles", statistics.nodes, cause));
        }
        check_moved(&statistics, before.triangles(), triangles)?;
        let all: Vec<u32> = (0..triangles.len() as u32).collect();
        self.gpu.upload(&index.corners, 0, &moved_corners(&all, triangles))?;
        let mut recorder = self.gpu.recorder("wide refit")?;
        self.record(&mut recorder, index)?;
        let timings = recorder.submit()?.wait()?;
        let texels = self.gpu.read(index.texels.buffer().view(), before.texels().len())?;
        let counts = IndexStatistics {
            max_depth: statistics.max_depth,
            ..statistics.of_triangles()
        };
        let stages = BuildStages::default();
        Ok((WideBvh::of_texels(texels, nodes as usize, counts, stages), timings))
    }
}

/// Nodes by their levels, the root first, and where each level ends.
fn levels_of(nodes: &[WideNode]) -> (Vec<u32>, Vec<u32>) {
    let mut depths = vec![0usize; nodes.len()];
    let mut ends: Vec<u32> = Vec::new();
    // Parents come before their children.
    for (place, node) in nodes.iter().enumerate() {
        if place > 0 {
            depths[place] = depths[(node.parent >> constants::WIDE_SLOT_BITS) as usize] + 1;
        }
        if ends.len() <= depths[place] {
            ends.push(0);
        }
        ends[depths[place]] += 1;
    }
    let mut end = 0;
    let mut next: Vec<usize> = Vec::with_capacity(ends.len());
    for level in &mut ends {
        next.push(end as usize);
        end += *level;
        *level = end;
    }
    let mut levels = vec![0; nodes.len()];
    for (place, depth) in (0u32..).zip(depths) {
        levels[next[depth]] = place;
        next[depth] += 1;
    }
    (levels, ends)
}
