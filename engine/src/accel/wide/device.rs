//! The wide hierarchy built by the device: the linear hierarchy there, then its collapse, each stage a pass of its own with its time.
//!
//! Bottom-up the least costs, which also count the wide nodes and the triangles below each binary node; then the nodes a level at a time, the root
//! first, each at the place that these counts give it. The stages are `shaders/accel/wide_{costs,level,collapse}.comp`.
//!
//! Guarantees: the same bytes as [`WideBvh::collapse`] of the same binary tree, on every device that keeps subnormal numbers, and on all where no box
//! has an area below the smallest normal one; no invocation ever waits for another.

use super::{WideBvh, WideNode, WideSettings, check_triangle_cost, first_triangle_texel, measure, texels_of};
use crate::accel::bvh2::Bvh2;
use crate::accel::input::{UsableTriangles, check_count, check_range};
use crate::accel::lbvh::{LbvhBuffers, LbvhBuilder, stages_of};
use crate::accel::stages::Stopwatch;
use crate::accel::{BuildStages, IndexStatistics, RayIndex};
use crate::gpu::ash::vk;
use crate::gpu::shaders::accel::{wide_collapse, wide_costs, wide_level};
use crate::gpu::shaders::constants;
use crate::gpu::shaders::types::{LbvhState, WideState, WideSubtree};
use crate::gpu::{
    Access, Buffer, BufferDesc, Category, ComputePipeline, DeviceKind, Gpu, Recorder, TexelView, Timings,
};
use crate::{Error, Result};
use bytemuck::Zeroable;
use glam::Vec3;

/// Builds wide hierarchies of one kind on one device.
#[derive(Debug)]
pub struct WideBuilder {
    gpu: Gpu,
    settings: WideSettings,
    binary: LbvhBuilder,
    costs: ComputePipeline<wide_costs::Kernel>,
    level: ComputePipeline<wide_level::Kernel>,
    collapse: ComputePipeline<wide_collapse::Kernel>,
}

/// Memory of a collapse, its result among it.
#[derive(Debug)]
pub struct WideBuffers {
    /// The finished index, as [`RayIndex::texels`] has it, with room behind it.
    pub texels: TexelView,
    subtrees: Buffer,
    arrival_counters: Buffer,
    state: Buffer,
    levels: Buffer,
    roots: Buffer,
    arguments: Buffer,
}

impl WideBuffers {
    /// Bytes of everything.
    pub fn bytes(&self) -> u64 {
        let buffers = [
            self.texels.buffer(),
            &self.subtrees,
            &self.arrival_counters,
            &self.state,
            &self.levels,
            &self.roots,
            &self.arguments,
        ];
        buffers.iter().map(|buffer| buffer.bytes()).sum()
    }
}

/// A finished build.
#[derive(Debug)]
pub struct WideBuild {
    /// The index, read back.
    pub index: WideBvh,
    /// Times of the passes, those of upload and reading back left out.
    pub timings: Timings,
}

/// A finished build that stays where it is.
#[derive(Debug)]
pub struct ResidentWide {
    /// What rays traverse, as [`RayIndex::texels`] has it, with room behind it.
    pub texels: TexelView,
    /// Size and quality; the bytes are those of the room.
    pub statistics: IndexStatistics,
    /// Times of the stages.
    pub stages: BuildStages,
    pub(super) levels: Buffer,
    /// Where each level ends among the nodes.
    pub(super) ends: Vec<u32>,
}

impl WideBuilder {
    /// Makes the pipelines. Of the settings of the binary tree those of quality are not used.
    ///
    /// # Errors
    /// [`Error::Setting`] for settings out of range, and as [`Gpu::compute_pipeline`].
    pub fn new(gpu: &Gpu, settings: &WideSettings) -> Result<Self> {
        check_range("wide.binary.leaf_size", settings.binary.leaf_size, 1, super::LEAF_SIZE)?;
        check_triangle_cost(settings)?;
        let is_llvmpipe = gpu.caps().kind == DeviceKind::Cpu && gpu.caps().driver.contains("llvmpipe");
        Ok(Self {
            gpu: gpu.clone(),
            settings: *settings,
            binary: LbvhBuilder::new(gpu, &settings.binary)?,
            costs: gpu.compute_pipeline(&wide_costs::Spec {
                // See shaders/accel/lbvh_fence.glsl.
                lbvh_fences: !is_llvmpipe,
            })?,
            level: gpu.compute_pipeline(&Default::default())?,
            collapse: gpu.compute_pipeline(&Default::default())?,
        })
    }

    /// What builds the binary tree.
    pub fn binary(&self) -> &LbvhBuilder {
        &self.binary
    }

    /// Memory for the collapse of a tree over `count` triangles, at least two.
    ///
    /// # Errors
    /// As [`LbvhBuilder::buffers`].
    pub fn buffers(&self, count: u32) -> Result<WideBuffers> {
        if count < 2 {
            return Err(Error::setting("wide.triangles", count, "is less than two"));
        }
        check_count(count as usize)?;
        // Of the binary tree, which has no fewer than the wide one.
        let nodes = u64::from(count - 1);
        let buffer = |name, bytes: u64| self.gpu.buffer(&BufferDesc::storage(name, bytes, Category::Index));
        let texels = texels_of(nodes as usize, count as usize) as u64;
        let format = vk::Format::R32G32B32A32_UINT;
        Ok(WideBuffers {
            texels: self.gpu.storage_texels("wide", Category::Index, format, texels)?,
            subtrees: buffer("wide subtrees", size_of::<WideSubtree>() as u64 * nodes)?,
            arrival_counters: buffer("wide arrival counters", 4 * nodes)?,
            state: buffer("wide state", size_of::<WideState>() as u64)?,
            levels: buffer("wide levels", 4 * nodes)?,
            roots: buffer("wide roots", 16 * nodes)?,
            arguments: buffer("wide arguments", 12)?,
        })
    }

    /// Records a build over the triangles of `binary`, as [`LbvhBuilder::record_traversable`] has them, and its collapse: the passes of the former, then
    /// `wide: costs` and `wide: nodes`. Earlier uses of the buffers by compute shaders and copies are waited for; triangles must have been made visible as there.
    /// It ends with a barrier: compute shaders and copies may read the texels after it, in the same submission.
    ///
    /// # Errors
    /// As [`LbvhBuilder::record_traversable`]; [`Error::LimitExceeded`] for buffers of fewer triangles.
    pub fn record(&self, recorder: &mut Recorder, binary: &LbvhBuffers, buffers: &WideBuffers) -> Result<()> {
        self.binary.record_traversable(recorder, binary)?;
        self.record_collapse(recorder, &binary.quarters, &binary.state, binary.count, buffers)
    }

    /// Records the collapse of a binary tree of at least two triangles, whose state says how many nodes it has.
    fn record_collapse(
        &self,
        recorder: &mut Recorder,
        binary: &TexelView,
        binary_state: &Buffer,
        count: u32,
        buffers: &WideBuffers,
    ) -> Result<()> {
        let nodes = u64::from(count - 1);
        if buffers.levels.bytes() < 4 * nodes {
            return Err(Error::LimitExceeded {
                name: "wide triangles".into(),
                value: count.into(),
                limit_name: "those of its buffers",
                limit: buffers.levels.bytes() / 4 + 1,
            });
        }
        recorder.pass("wide: costs", |pass| {
            // Copies, too, may read the texels of the last build.
            let before = Access::COMPUTE.union(Access::TRANSFER);
            pass.memory_barrier(before, Access::COMPUTE.union(Access::TRANSFER_WRITE));
            pass.fill(buffers.arrival_counters.view(), 0)?;
            let state = WideState {
                listed: 1,
                ..WideState::zeroed()
            };
            pass.update(buffers.state.view(), &[state])?;
            pass.update(buffers.levels.slice(0, 4), &[0u32])?;
            // The root: its children begin behind it, and its triangles with the first.
            pass.update(buffers.roots.slice(0, 16), &[[0u32, 1, 0, 0]])?;
            pass.memory_barrier(Access::COMPUTE.union(Access::TRANSFER_WRITE), Access::COMPUTE);
            let set = wide_costs::Set0 {
                wide_binary: binary,
                lbvh_state_block: binary_state.view(),
                wide_subtrees: buffers.subtrees.view(),
                wide_arrival_counters: buffers.arrival_counters.view(),
                wide_state_block: buffers.state.view(),
            };
            let push = wide_costs::Push {
                triangle_cost: self.settings.triangle_cost,
            };
            let groups = [self.costs.groups_for(2 * (count - 1)), 1, 1];
            pass.dispatch(&self.costs, &[&set], &push, groups)?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            Ok(())
        })?;
        recorder.pass("wide: nodes", |pass| {
            let level_set = wide_level::Set0 {
                wide_state_block: buffers.state.view(),
                wide_arguments: buffers.arguments.view(),
            };
            let set = wide_collapse::Set0 {
                wide_binary: binary,
                wide_subtrees: buffers.subtrees.view(),
                wide_state_block: buffers.state.view(),
                wide_levels: buffers.levels.view(),
                wide_roots: buffers.roots.view(),
                wide_texels: buffers.texels.buffer().view(),
            };
            let read = Access::COMPUTE.union(Access::INDIRECT_READ);
            for level in 0..constants::WIDE_LEVELS {
                pass.memory_barrier(read, Access::COMPUTE);
                pass.dispatch(&self.level, &[&level_set], &wide_level::Push { level }, [1, 1, 1])?;
                pass.memory_barrier(Access::COMPUTE, read);
                let push = wide_collapse::Push { level };
                pass.dispatch_indirect(&self.collapse, &[&set], &push, buffers.arguments.view())?;
            }
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE.union(Access::TRANSFER));
            Ok(())
        })
    }

    /// Builds over `triangles` and reads the index back; hits name triangles by their place in it. The host leaves out what rays cannot meet, and builds
    /// where that leaves fewer than two.
    ///
    /// # Errors
    /// As [`LbvhBuilder::build`].
    pub fn build(&self, triangles: &[[Vec3; 3]]) -> Result<WideBuild> {
        let built = self.binary.build(triangles)?;
        let Some(binary) = &built.buffers else {
            return Ok(WideBuild {
                index: WideBvh::collapse(&built.index, &self.settings)?,
                timings: built.timings,
            });
        };
        let buffers = self.buffers(binary.count)?;
        let mut timings = built.timings;
        let (state, passes) = self.run(&binary.quarters, &binary.state, binary.count, &buffers)?;
        timings.passes.extend(passes.passes);
        let index = self.read(&buffers, &state, built.index.statistics())?;
        Ok(WideBuild { index, timings })
    }

    /// As [`WideBuilder::build`], but leaves the index on the device and reads its nodes back only to measure them; `None` for fewer than two triangles that
    /// rays can meet.
    ///
    /// # Errors
    /// As [`WideBuilder::build`].
    pub fn build_resident(&self, triangles: &[[Vec3; 3]]) -> Result<Option<ResidentWide>> {
        check_count(triangles.len())?;
        let mut watch = Stopwatch::start();
        let usable = UsableTriangles::among(triangles);
        let corners = usable.map(|triangle, _| *triangle);
        if corners.len() < 2 {
            return Ok(None);
        }
        let on_host = watch.lap();
        let buffers = self.buffers(corners.len() as u32)?;
        let ran = self.binary.run(&corners, &usable.map(|_, index| index))?;
        let binary = ran.buffers;
        let mut timings = ran.timings;
        let (state, passes) = self.run(&binary.quarters, &binary.state, binary.count, &buffers)?;
        timings.passes.extend(passes.passes);
        let mut stages = stages_of(&timings);
        let nodes = state.nodes as usize;
        let texels: Vec<[u32; 4]> = self
            .gpu
            .read(buffers.texels.buffer().view(), first_triangle_texel(nodes))?;
        stages.transfer = (watch.lap() - stages.total()).max(0.0);
        stages.triangles += on_host;
        let ends = ends_of(&state);
        let mut statistics = IndexStatistics {
            max_depth: ends.len() as u32,
            bytes: buffers.texels.buffer().bytes(),
            ..usable.statistics
        };
        let of_nodes = WideBvh {
            texels,
            nodes,
            statistics,
            stages,
        };
        measure(of_nodes.nodes(), &of_nodes.bounds(), &mut statistics);
        stages.statistics += watch.lap();
        Ok(Some(ResidentWide {
            texels: buffers.texels,
            statistics,
            stages,
            levels: buffers.levels,
            ends,
        }))
    }

    /// Collapses a binary tree of the host's, and reads the index back. The host does it for trees of fewer than two triangles.
    ///
    /// # Errors
    /// As [`WideBvh::collapse`], [`WideBuilder::buffers`], and those of a submission.
    pub fn collapse(&self, binary: &Bvh2) -> Result<WideBuild> {
        super::collapse::check_leaves(binary)?;
        let statistics = binary.statistics();
        if statistics.triangles < 2 {
            return Ok(WideBuild {
                index: WideBvh::collapse(binary, &self.settings)?,
                timings: Timings::default(),
            });
        }
        let count = statistics.triangles as u32;
        let buffers = self.buffers(count)?;
        let format = vk::Format::R32G32B32A32_UINT;
        let quarters = self
            .gpu
            .texels_with("binary tree", Category::Index, format, binary.texels())?;
        let bytes = size_of::<LbvhState>() as u64;
        let binary_state = self
            .gpu
            .buffer(&BufferDesc::storage("binary state", bytes, Category::Index))?;
        let state = LbvhState {
            nodes: binary.nodes().len() as u32,
            ..LbvhState::default()
        };
        self.gpu.upload(&binary_state, 0, &[state])?;
        let (state, timings) = self.run(&quarters, &binary_state, count, &buffers)?;
        let index = self.read(&buffers, &state, statistics)?;
        Ok(WideBuild { index, timings })
    }

    /// Collapses, and waits.
    fn run(
        &self,
        binary: &TexelView,
        binary_state: &Buffer,
        count: u32,
        buffers: &WideBuffers,
    ) -> Result<(WideState, Timings)> {
        let mut recorder = self.gpu.recorder("wide")?;
        self.record_collapse(&mut recorder, binary, binary_state, count, buffers)?;
        let timings = recorder.submit()?.wait()?;
        let state = self.gpu.read::<WideState>(buffers.state.view(), 1)?;
        let state = state.first().copied().unwrap_or_else(WideState::zeroed);
        Ok((state, timings))
    }

    /// The finished index, of whose triangles the binary tree's statistics have the counts.
    fn read(&self, buffers: &WideBuffers, state: &WideState, binary: IndexStatistics) -> Result<WideBvh> {
        let nodes = state.nodes as usize;
        let texels = texels_of(nodes, binary.triangles as usize);
        let texels = self.gpu.read(buffers.texels.buffer().view(), texels)?;
        let statistics = IndexStatistics {
            max_depth: ends_of(state).len() as u32,
            ..binary.of_triangles()
        };
        let stages = BuildStages::default();
        Ok(WideBvh::of_texels(texels, nodes, statistics, stages))
    }
}

/// Where levels end, without those that have no node.
fn ends_of(state: &WideState) -> Vec<u32> {
    let mut ends = state.ends.to_vec();
    ends.dedup();
    ends
}

const _: () = assert!(size_of::<WideNode>() == 80 && size_of::<WideSubtree>() == 64);
