//! The linear hierarchy built by the device: bounds, codes, sort, tree, ranks and layout, each a pass of its own with its time.
//!
//! Sources: see [`radix_tree`](super::radix_tree) for the tree, [`RadixSort`] for the sort. The stages are `shaders/accel/lbvh_*.comp`.
//!
//! Guarantees: the same bytes as [`build`](super::build) of quality [`Fast`](super::BuildQuality::Fast), on every device that keeps
//! subnormal numbers, and on all where no box has an area below the smallest normal one (boxes of 10⁻¹⁹ m); no invocation ever waits for
//! another.

use super::device_buffers::LbvhBuffers;
use super::radix_tree::next_skipped;
use super::ray_index::{LbvhSettings, check_moved, moved_corners};
use crate::accel::bvh2::layout::Layout;
use crate::accel::bvh2::{Bvh2, MAX_DEPTH, NODE_QUARTERS, TRIANGLE_QUARTERS};
use crate::accel::input::{UsableTriangles, check_count};
use crate::accel::morton::MORTON_30_AXIS_BITS;
use crate::accel::stages::Stopwatch;
use crate::accel::{BuildStages, IndexStatistics, RayIndex};
use crate::gpu::shaders::accel::{
    lbvh_boxes, lbvh_climb, lbvh_codes, lbvh_emit, lbvh_grid, lbvh_hierarchy, lbvh_refit, lbvh_refit_triangles,
    lbvh_retry,
};
use crate::gpu::shaders::constants::{LBVH_BOXES_PER_INVOCATION, LBVH_GROUP_SIZE};
use crate::gpu::shaders::types::LbvhState;
use crate::gpu::{Access, Buffer, ComputePipeline, DeviceKind, Gpu, Recorder, TexelView, Timings};
use crate::kernels::{Count, KeyWidth, RadixSort, RadixSortOptions, Scan, ScanBuffers, ScanOptions, SortBuffers};
use crate::{Error, Result};
use glam::Vec3;

/// Places that an invocation walks along. Long runs save atomic operations; devices of many lanes want many invocations.
const CPU_RUN: u32 = 128;
const GPU_RUN: u32 = 4;

/// A finished build.
#[derive(Debug)]
pub struct LbvhBuild {
    /// The index, read back.
    pub index: Bvh2,
    /// Times of the passes, those of upload and reading back left out.
    pub timings: Timings,
    /// Where it is on the device; `None` for fewer than two triangles, which are not worth a build there.
    pub buffers: Option<LbvhBuffers>,
}

/// Builds linear hierarchies of one kind on one device.
#[derive(Debug)]
pub struct LbvhBuilder {
    gpu: Gpu,
    settings: LbvhSettings,
    sort: RadixSort,
    boxes: ComputePipeline<lbvh_boxes::Kernel>,
    grid: ComputePipeline<lbvh_grid::Kernel>,
    codes: ComputePipeline<lbvh_codes::Kernel>,
    run: u32,
    hierarchy: ComputePipeline<lbvh_hierarchy::Kernel>,
    climb: ComputePipeline<lbvh_climb::Kernel>,
    retry: ComputePipeline<lbvh_retry::Kernel>,
    ranks: Scan,
    emit: ComputePipeline<lbvh_emit::Kernel>,
    refit_triangles: ComputePipeline<lbvh_refit_triangles::Kernel>,
    refit: ComputePipeline<lbvh_refit::Kernel>,
}

/// A finished build that stays where it is.
#[derive(Debug)]
pub struct ResidentLbvh {
    /// What rays traverse, as [`RayIndex::texels`](crate::accel::RayIndex::texels) has it, with room behind it.
    pub quarters: TexelView,
    /// Size and quality. The surface area cost is summed by the device in f32, which errs by three units of roundoff a level at
    /// most; the bytes are those of the room.
    pub statistics: IndexStatistics,
    /// Times of the stages.
    pub stages: BuildStages,
}

/// What a build leaves on the device.
pub(in crate::accel) struct Ran {
    pub(in crate::accel) buffers: LbvhBuffers,
    state: LbvhState,
    pub(in crate::accel) timings: Timings,
}

impl LbvhBuilder {
    /// Makes the pipelines. Of the settings those of quality are not used.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for settings out of range, and as [`Gpu::compute_pipeline`].
    pub fn new(gpu: &Gpu, settings: &LbvhSettings) -> Result<Self> {
        settings.check()?;
        let lbvh_axis_bits = settings.axis_bits();
        let key = if lbvh_axis_bits == MORTON_30_AXIS_BITS {
            KeyWidth::Bits32
        } else {
            KeyWidth::Bits64
        };
        let is_cpu = gpu.caps().kind == DeviceKind::Cpu;
        // See shaders/accel/lbvh_fence.glsl.
        let lbvh_fences = !(is_cpu && gpu.caps().driver.contains("llvmpipe"));
        let run = if is_cpu { CPU_RUN } else { GPU_RUN };
        let mut options = RadixSortOptions::new(key, true);
        options.bits = 0..settings.code_bits;
        Ok(Self {
            gpu: gpu.clone(),
            settings: *settings,
            sort: RadixSort::new(gpu, options)?,
            boxes: gpu.compute_pipeline(&Default::default())?,
            grid: gpu.compute_pipeline(&lbvh_grid::Spec { lbvh_axis_bits })?,
            codes: gpu.compute_pipeline(&lbvh_codes::Spec { lbvh_axis_bits })?,
            run,
            hierarchy: gpu.compute_pipeline(&lbvh_hierarchy::Spec {
                lbvh_code_words: key.words(),
                lbvh_run: run,
            })?,
            climb: gpu.compute_pipeline(&lbvh_climb::Spec { lbvh_fences })?,
            retry: gpu.compute_pipeline(&Default::default())?,
            ranks: Scan::new(gpu, ScanOptions::default())?,
            emit: gpu.compute_pipeline(&Default::default())?,
            refit_triangles: gpu.compute_pipeline(&Default::default())?,
            refit: gpu.compute_pipeline(&lbvh_refit::Spec { lbvh_fences })?,
        })
    }

    /// Memory for `count` triangles, at least two.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for fewer than two, [`Error::LimitExceeded`](crate::Error::LimitExceeded) for more than
    /// [`MAX_TRIANGLES`](crate::accel::bvh2::MAX_TRIANGLES), or where a buffer is larger than the device binds,
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn buffers(&self, count: u32) -> Result<LbvhBuffers> {
        if count < 2 {
            return Err(Error::setting("lbvh.triangles", count, "is less than two"));
        }
        check_count(count as usize)?;
        LbvhBuffers::new(&self.gpu, &self.sort, &self.ranks, self.run, count)
    }

    /// As [`LbvhBuilder::buffers`], over triangles of the caller's, such as a host's ([`Gpu::borrow_buffer`]): 36 bytes per triangle in
    /// `corners`, 4 in `indices`, storage buffers both.
    ///
    /// # Errors
    /// As [`LbvhBuilder::buffers`]; [`Error::LimitExceeded`](crate::Error::LimitExceeded) for one that is too small.
    pub fn buffers_over(&self, count: u32, corners: &Buffer, indices: &Buffer) -> Result<LbvhBuffers> {
        for (buffer, bytes) in [(corners, 36), (indices, 4)] {
            let wanted = bytes * u64::from(count);
            if buffer.bytes() < wanted {
                return Err(Error::LimitExceeded {
                    name: buffer.name().into(),
                    value: wanted,
                    limit_name: "size",
                    limit: buffer.bytes(),
                });
            }
        }
        let mut buffers = self.buffers(count)?;
        buffers.corners = corners.clone();
        buffers.indices = indices.clone();
        Ok(buffers)
    }

    /// Records a build of the triangles in `corners`, named by `indices`: both must be filled and visible to compute shaders. Other uses of
    /// these buffers by compute shaders may come before it without a barrier.
    ///
    /// Passes: `lbvh: boxes`, `lbvh: codes`, `lbvh: sort`, `lbvh: hierarchy`, `lbvh: climb`, `lbvh: ranks`, `lbvh: emit`. It ends with a
    /// barrier: compute shaders and copies may read `quarters` after it. The tree may be deeper than rays can go, which must then not
    /// traverse it: once it has run, [`LbvhBuilder::bits_to_skip`] says so, and [`LbvhBuilder::record_shallower`] makes it again.
    ///
    /// # Errors
    /// As [`Pass::dispatch`](crate::gpu::Pass::dispatch).
    pub fn record(&self, recorder: &mut Recorder, buffers: &LbvhBuffers) -> Result<()> {
        self.record_order(recorder, buffers)?;
        self.record_tree(recorder, buffers, 0)
    }

    /// As [`LbvhBuilder::record`], of which rays can traverse whatever tree comes out: where it is too deep, the device makes it again
    /// without the lowest [`LbvhBuilder::bits_too_many`] bits of the codes, and the host has nothing to ask. So a build and what traverses
    /// it go into one submission. [`LbvhBuilder::build`] takes away as few bits as suffice, so that its tree may be better then; where the
    /// first tree is not too deep, which is the common case, the trees are the same.
    ///
    /// Besides the passes of [`LbvhBuilder::record`], where there are bits too many: `lbvh: retry`, and another `lbvh: hierarchy` and
    /// `lbvh: climb`, of no workgroups unless the first tree is too deep.
    ///
    /// # Errors
    /// As [`LbvhBuilder::record`].
    pub fn record_traversable(&self, recorder: &mut Recorder, buffers: &LbvhBuffers) -> Result<()> {
        self.record_order(recorder, buffers)?;
        self.record_hierarchy(recorder, buffers, 0, None)?;
        let skipped = self.bits_too_many(buffers.count);
        if skipped > 0 {
            recorder.pass("lbvh: retry", |pass| {
                let [hierarchy_groups, climb_groups] = self.tree_groups(buffers.count);
                let push = lbvh_retry::Push {
                    hierarchy_groups,
                    climb_groups,
                    most_depth: MAX_DEPTH,
                };
                pass.memory_barrier(Access::INDIRECT_READ, Access::COMPUTE);
                let set = lbvh_retry::Set0 {
                    lbvh_state_block: buffers.state.view(),
                    lbvh_arguments: buffers.arguments.view(),
                };
                pass.dispatch(&self.retry, &[&set], &push, [1, 1, 1])?;
                pass.memory_barrier(Access::COMPUTE, Access::COMPUTE.union(Access::INDIRECT_READ));
                Ok(())
            })?;
            self.record_hierarchy(recorder, buffers, skipped, Some(&buffers.arguments))?;
        }
        self.record_layout(recorder, buffers)
    }

    /// The bits of a code that must be left out so that no tree of so many triangles is too deep for rays, whatever they are; 0 where none
    /// can be. A way has a node a bit, and below them ⌈log₂ n⌉ where codes are equal.
    pub fn bits_too_many(&self, count: u32) -> u32 {
        let equal_codes = count.max(1).next_power_of_two().ilog2();
        (self.settings.code_bits + equal_codes)
            .saturating_sub(MAX_DEPTH)
            .min(self.settings.code_bits)
    }

    /// Records the stages up to the sort.
    fn record_order(&self, recorder: &mut Recorder, buffers: &LbvhBuffers) -> Result<()> {
        let count = buffers.count;
        recorder.pass("lbvh: boxes", |pass| {
            let state = LbvhState {
                centres_lower: [i32::MAX; 3],
                centres_upper: [i32::MIN; 3],
                ..LbvhState::default()
            };
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE.union(Access::TRANSFER_WRITE));
            pass.update(buffers.state.view(), &[state])?;
            pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
            let set = lbvh_boxes::Set0 {
                lbvh_corners: buffers.corners.view(),
                lbvh_boxes: buffers.boxes.buffer().view(),
                lbvh_state_block: buffers.state.view(),
            };
            let groups = [count.div_ceil(LBVH_GROUP_SIZE * LBVH_BOXES_PER_INVOCATION), 1, 1];
            pass.dispatch(&self.boxes, &[&set], &lbvh_boxes::Push { count }, groups)?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            Ok(())
        })?;
        recorder.pass("lbvh: codes", |pass| {
            let set = lbvh_grid::Set0 {
                lbvh_state_block: buffers.state.view(),
            };
            pass.dispatch(&self.grid, &[&set], &(), [1, 1, 1])?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            let set = lbvh_codes::Set0 {
                lbvh_boxes: &buffers.boxes,
                lbvh_state_block: buffers.state.view(),
                lbvh_codes: buffers.keys[0].buffer().view(),
                lbvh_order: buffers.order[0].buffer().view(),
            };
            let groups = [self.codes.groups_for(count), 1, 1];
            pass.dispatch(&self.codes, &[&set], &lbvh_codes::Push { count }, groups)?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            Ok(())
        })?;
        recorder.pass("lbvh: sort", |pass| {
            let sides = SortBuffers {
                keys: [&buffers.keys[0], &buffers.keys[1]],
                values: Some([&buffers.order[0], &buffers.order[1]]),
            };
            self.sort
                .record(pass, &sides, Count::Host(count), &buffers.sort_scratch)?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE.union(Access::TRANSFER_WRITE));
            Ok(())
        })
    }

    /// After a build whose tree is too deep: records its stages behind the sort once more, from the codes that stand in `buffers`, without
    /// the lowest `skipped` bits of each. Passes `lbvh: hierarchy`, `lbvh: climb`, `lbvh: ranks` and `lbvh: emit`, with the barriers of
    /// [`LbvhBuilder::record`]; `corners` and `indices` must be those of the build.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for more bits than codes have, and as [`Pass::dispatch`](crate::gpu::Pass::dispatch).
    pub fn record_shallower(&self, recorder: &mut Recorder, buffers: &LbvhBuffers, skipped: u32) -> Result<()> {
        if skipped > self.settings.code_bits {
            let cause = format!("is more than the {} bits of a code", self.settings.code_bits);
            return Err(Error::setting("lbvh.skipped", skipped, cause));
        }
        self.record_tree(recorder, buffers, skipped)
    }

    /// Records the stages after the sort, without the lowest `skipped` bits of the codes.
    fn record_tree(&self, recorder: &mut Recorder, buffers: &LbvhBuffers, skipped: u32) -> Result<()> {
        self.record_hierarchy(recorder, buffers, skipped, None)?;
        self.record_layout(recorder, buffers)
    }

    /// Workgroups of `lbvh_hierarchy` and of `lbvh_climb`.
    fn tree_groups(&self, count: u32) -> [u32; 2] {
        let runs = count.div_ceil(self.run);
        [self.hierarchy.groups_for(runs), self.climb.groups_for(runs)]
    }

    /// Records the making of the tree; the workgroups of both passes come from `arguments` where there are any.
    fn record_hierarchy(
        &self,
        recorder: &mut Recorder,
        buffers: &LbvhBuffers,
        skipped: u32,
        arguments: Option<&Buffer>,
    ) -> Result<()> {
        let count = buffers.count;
        let side = self.sort.result_side(count);
        let runs = count.div_ceil(self.run);
        let [hierarchy_groups, climb_groups] = self.tree_groups(count);
        recorder.pass("lbvh: hierarchy", |pass| {
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE.union(Access::TRANSFER_WRITE));
            pass.fill(buffers.arrival_counters.view(), 0)?;
            let set = lbvh_hierarchy::Set0 {
                lbvh_nodes: buffers.nodes.buffer().view(),
                lbvh_summaries: buffers.summaries.view(),
                lbvh_retained: buffers.retained.buffer().view(),
                lbvh_state_block: buffers.state.view(),
                lbvh_pending: buffers.pending.view(),
                lbvh_boxes: &buffers.boxes,
                lbvh_codes: &buffers.keys[side],
                lbvh_order: &buffers.order[side],
            };
            let push = lbvh_hierarchy::Push {
                count,
                runs,
                skipped,
                leaf_size: self.settings.leaf_size,
            };
            match arguments {
                None => pass.dispatch(&self.hierarchy, &[&set], &push, [hierarchy_groups, 1, 1])?,
                Some(words) => pass.dispatch_indirect(&self.hierarchy, &[&set], &push, words.slice(0, 12))?,
            }
            pass.memory_barrier(Access::COMPUTE.union(Access::TRANSFER_WRITE), Access::COMPUTE);
            Ok(())
        })?;
        recorder.pass("lbvh: climb", |pass| {
            let set = lbvh_climb::Set0 {
                lbvh_nodes: buffers.nodes.buffer().view(),
                lbvh_summaries: buffers.summaries.view(),
                lbvh_retained: buffers.retained.buffer().view(),
                lbvh_state_block: buffers.state.view(),
                lbvh_pending: buffers.pending.view(),
                lbvh_arrival_counters: buffers.arrival_counters.view(),
            };
            let push = lbvh_climb::Push {
                count,
                runs,
                skipped,
                leaf_size: self.settings.leaf_size,
            };
            match arguments {
                None => pass.dispatch(&self.climb, &[&set], &push, [climb_groups, 1, 1])?,
                Some(words) => pass.dispatch_indirect(&self.climb, &[&set], &push, words.slice(12, 12))?,
            }
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            Ok(())
        })
    }

    /// Records the stages after the tree.
    fn record_layout(&self, recorder: &mut Recorder, buffers: &LbvhBuffers) -> Result<()> {
        let count = buffers.count;
        let side = self.sort.result_side(count);
        recorder.pass("lbvh: ranks", |pass| {
            let words = ScanBuffers {
                input: buffers.retained.buffer().view(),
                heads: None,
                output: buffers.ranks.buffer().view(),
            };
            self.ranks
                .record(pass, &words, Count::Host(count - 1), &buffers.scan_scratch)?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            Ok(())
        })?;
        recorder.pass("lbvh: emit", |pass| {
            let set = lbvh_emit::Set0 {
                lbvh_nodes: &buffers.nodes,
                lbvh_retained: &buffers.retained,
                lbvh_ranks: &buffers.ranks,
                lbvh_order: &buffers.order[side],
                lbvh_corners: buffers.corners.view(),
                lbvh_indices: buffers.indices.view(),
                lbvh_words: buffers.quarters.buffer().view(),
                lbvh_state_block: buffers.state.view(),
            };
            let groups = [self.emit.groups_for(count), 1, 1];
            pass.dispatch(&self.emit, &[&set], &lbvh_emit::Push { count }, groups)?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE.union(Access::TRANSFER));
            Ok(())
        })
    }

    /// Records a refit to the triangles that are now in `corners`, in the order of the build: passes `lbvh: refit triangles` and
    /// `lbvh: refit boxes`. The tree stays what it was, so it is best where little has moved.
    ///
    /// # Errors
    /// As [`Pass::dispatch`](crate::gpu::Pass::dispatch).
    pub fn record_refit(&self, recorder: &mut Recorder, buffers: &LbvhBuffers) -> Result<()> {
        let count = buffers.count;
        let order = &buffers.order[self.sort.result_side(count)];
        let words = buffers.quarters.buffer().view();
        recorder.pass("lbvh: refit triangles", |pass| {
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE.union(Access::TRANSFER_WRITE));
            pass.fill(buffers.arrival_counters.view(), 0)?;
            let set = lbvh_refit_triangles::Set0 {
                lbvh_order: order.buffer().view(),
                lbvh_corners: buffers.corners.view(),
                lbvh_words: words,
                lbvh_state_block: buffers.state.view(),
            };
            let groups = [self.refit_triangles.groups_for(count), 1, 1];
            pass.dispatch(
                &self.refit_triangles,
                &[&set],
                &lbvh_refit_triangles::Push { count },
                groups,
            )?;
            pass.memory_barrier(Access::COMPUTE.union(Access::TRANSFER_WRITE), Access::COMPUTE);
            Ok(())
        })?;
        recorder.pass("lbvh: refit boxes", |pass| {
            let set = lbvh_refit::Set0 {
                lbvh_words: words,
                lbvh_arrival_counters: buffers.arrival_counters.view(),
                lbvh_state_block: buffers.state.view(),
            };
            pass.dispatch(
                &self.refit,
                &[&set],
                &(),
                [self.refit.groups_for(2 * (count - 1)), 1, 1],
            )?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE.union(Access::TRANSFER));
            Ok(())
        })
    }

    /// After a build has run that left out the lowest `skipped` bits of the codes (0 for [`LbvhBuilder::record`]): `None` when rays can
    /// traverse its tree, which is at most [`MAX_DEPTH`] inner nodes deep then; otherwise how many bits [`LbvhBuilder::record_shallower`]
    /// must leave out. Each takes one level at most, so that a tree may have to be made more than twice; without any bits it is ⌈log₂ n⌉
    /// deep.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost), [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn bits_to_skip(&self, buffers: &LbvhBuffers, skipped: u32) -> Result<Option<u32>> {
        Ok(self.bits_for(self.state(buffers)?.height, skipped))
    }

    fn bits_for(&self, height: u32, skipped: u32) -> Option<u32> {
        let bits = self.settings.code_bits;
        (height > MAX_DEPTH && skipped < bits).then(|| next_skipped(skipped, height, MAX_DEPTH, bits))
    }

    fn state(&self, buffers: &LbvhBuffers) -> Result<LbvhState> {
        let state = self.gpu.read::<LbvhState>(buffers.state.view(), 1)?;
        Ok(state.first().copied().unwrap_or_default())
    }

    /// Builds over triangles that rays can meet, at least two; a tree that was too deep is made again with fewer bits, in passes of the
    /// same names.
    pub(in crate::accel) fn run(&self, corners: &[[Vec3; 3]], indices: &[u32]) -> Result<Ran> {
        let buffers = self.buffers(corners.len() as u32)?;
        self.gpu.upload(&buffers.corners, 0, corners)?;
        self.gpu.upload(&buffers.indices, 0, indices)?;
        let mut recorder = self.gpu.recorder("lbvh")?;
        self.record(&mut recorder, &buffers)?;
        let mut timings = recorder.submit()?.wait()?;
        let mut skipped = 0;
        let mut state = self.state(&buffers)?;
        while let Some(more) = self.bits_for(state.height, skipped) {
            skipped = more;
            let mut recorder = self.gpu.recorder("lbvh")?;
            self.record_tree(&mut recorder, &buffers, skipped)?;
            timings.passes.extend(recorder.submit()?.wait()?.passes);
            state = self.state(&buffers)?;
        }
        Ok(Ran {
            buffers,
            state,
            timings,
        })
    }

    /// Builds over `triangles` and reads the index back; hits name triangles by their place in it. The host leaves out what rays cannot
    /// meet. Also the passes' times; a tree that was too deep is made again with fewer bits, in passes of the same names.
    ///
    /// # Errors
    /// As [`build`](super::build), [`LbvhBuilder::buffers`], and those of a submission.
    pub fn build(&self, triangles: &[[Vec3; 3]]) -> Result<LbvhBuild> {
        check_count(triangles.len())?;
        let usable = UsableTriangles::among(triangles);
        let corners = usable.map(|triangle, _| *triangle);
        if corners.len() < 2 {
            let layout = Layout::of(&[], corners.len(), |place| usable.triangle(place as u32));
            return Ok(LbvhBuild {
                index: layout.finish("lbvh", usable.statistics, BuildStages::default(), Stopwatch::start()),
                timings: Timings::default(),
                buffers: None,
            });
        }
        let ran = self.run(&corners, &usable.map(|_, index| index))?;
        Ok(LbvhBuild {
            index: self.read(&ran.buffers, ran.state.nodes, usable.statistics)?,
            timings: ran.timings,
            buffers: Some(ran.buffers),
        })
    }

    /// As [`LbvhBuilder::build`], but leaves the index on the device and reads back no more than what it says of itself; `None` for fewer
    /// than two triangles that rays can meet.
    ///
    /// # Errors
    /// As [`LbvhBuilder::build`].
    pub fn build_resident(&self, triangles: &[[Vec3; 3]]) -> Result<Option<ResidentLbvh>> {
        check_count(triangles.len())?;
        let mut watch = Stopwatch::start();
        let usable = UsableTriangles::among(triangles);
        let corners = usable.map(|triangle, _| *triangle);
        if corners.len() < 2 {
            return Ok(None);
        }
        let on_host = watch.lap();
        let ran = self.run(&corners, &usable.map(|_, index| index))?;
        let mut stages = stages_of(&ran.timings);
        stages.transfer = (watch.lap() - stages.total()).max(0.0);
        stages.triangles += on_host;
        let LbvhState {
            nodes,
            height,
            cost,
            area,
            ..
        } = ran.state;
        let statistics = IndexStatistics {
            nodes: nodes.into(),
            leaves: u64::from(nodes) + 1,
            max_depth: height,
            sah_cost: if area > 0.0 {
                f64::from(cost) / f64::from(area)
            } else {
                0.0
            },
            bytes: ran.buffers.quarters.buffer().bytes(),
            ..usable.statistics
        };
        Ok(Some(ResidentLbvh {
            quarters: ran.buffers.quarters,
            statistics,
            stages,
        }))
    }

    /// Refits a build to moved triangles, all of those it was made of, and reads it back. Those that were left out stay so, and those that
    /// have lost their area shrink to points.
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for another number of triangles or for one that has moved out of range, and those of a
    /// submission.
    pub fn refit(&self, build: &LbvhBuild, triangles: &[[Vec3; 3]]) -> Result<(Bvh2, Timings)> {
        let Some(buffers) = &build.buffers else {
            return Ok((super::refit(&build.index, triangles)?, Timings::default()));
        };
        let before = build.index.statistics();
        check_moved(&before, build.index.triangles(), triangles)?;
        let mut indices: Vec<u32> = build.index.triangles().iter().map(|t| t.index).collect();
        indices.sort_unstable();
        let corners = moved_corners(&indices, triangles);
        self.gpu.upload(&buffers.corners, 0, &corners)?;
        let mut recorder = self.gpu.recorder("lbvh refit")?;
        self.record_refit(&mut recorder, buffers)?;
        let timings = recorder.submit()?.wait()?;
        let nodes = build.index.nodes().len() as u32;
        Ok((self.read(buffers, nodes, before.of_triangles())?, timings))
    }

    /// The finished index, of whose triangles `statistics` has the counts.
    fn read(&self, buffers: &LbvhBuffers, nodes: u32, statistics: IndexStatistics) -> Result<Bvh2> {
        let quarters = NODE_QUARTERS * nodes as usize + TRIANGLE_QUARTERS * buffers.count as usize;
        let quarters = self.gpu.read(buffers.quarters.buffer().view(), quarters)?;
        let layout = Layout::filled(quarters, nodes as usize);
        Ok(layout.finish("lbvh", statistics, BuildStages::default(), Stopwatch::start()))
    }
}

/// Milliseconds of the passes by stage.
pub(in crate::accel) fn stages_of(timings: &Timings) -> BuildStages {
    let mut stages = BuildStages::default();
    for pass in &timings.passes {
        let stage = match pass.name.as_str() {
            "lbvh: boxes" => &mut stages.triangles,
            "lbvh: codes" => &mut stages.codes,
            "lbvh: sort" => &mut stages.sort,
            "lbvh: hierarchy" | "lbvh: climb" => &mut stages.hierarchy,
            _ => &mut stages.layout,
        };
        *stage += 1e-6 * pass.nanoseconds.unwrap_or(0) as f64;
    }
    stages
}
