//! The compact hierarchy built by the device, over boxes that are there: codes, sort, boxes of blocks of places, ranges split from the root down,
//! ranks and sibling pairs.
//!
//! Sources: the tree is that of [`merge`](super::merge), the pairs are those of [`compact_bvh`](super::compact_bvh); codes as in T. Karras,
//! "Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees", HPG 2012, and C. Lauterbach et al., "Fast BVH Construction
//! on GPUs", Eurographics 2009, whose way from the root down a level at a time is the one taken here: a node is a range, a dispatch splits
//! all of a level, and only ranges that do not fit a leaf are listed. Boxes of ranges come from those of blocks of four places, of blocks
//! of blocks, and so on. The stages are `shaders/accel/map_*.comp`.
//!
//! Guarantees: the same bytes as [`CompactBvh::encode`](super::compact_bvh::CompactBvh::encode) of
//! [`CompleteBvh`](super::complete_bvh::CompleteBvh) of [`merged_hierarchy`](super::merge::merged_hierarchy), on every device and in whatever order
//! invocations run; none waits for another, none has more than some hundred iterations.

use super::complete_bvh::INDEX_BITS;
use crate::accel::morton::MORTON_30_AXIS_BITS;
use crate::catalogue::{Role, Row, sources};
use crate::gpu::ash::vk;
use crate::gpu::interface::ShaderInfo;
use crate::gpu::shaders::accel::{lbvh_codes, lbvh_grid, map_begin, map_blocks, map_pairs, map_split};
use crate::gpu::shaders::constants::{LBVH_BOX_QUARTERS, MAP_BLOCK, MAP_GROUP_SIZE, MAP_LEVELS};
use crate::gpu::shaders::types::{CompactRoot, LbvhState, MapTreeLevel, MapTreeState};
use crate::gpu::{
    Access, Buffer, BufferDesc, BufferView, Category, ComputePipeline, Gpu, Pass, PipelineInfo, Recorder, TexelView,
};
use crate::kernels::{Count, KeyWidth, RadixSort, RadixSortOptions, Scan, ScanBuffers, ScanOptions, SortBuffers};
use crate::{Error, Result};

/// Quarters of a pair.
const PAIR_QUARTERS: u64 = 2;

/// Builds compact hierarchies on one device.
#[derive(Debug)]
pub struct MapBuilder {
    gpu: Gpu,
    sort: RadixSort,
    grid: ComputePipeline<lbvh_grid::Kernel>,
    codes: ComputePipeline<lbvh_codes::Kernel>,
    /// Of places, and of blocks.
    blocks: [ComputePipeline<map_blocks::Kernel>; 2],
    begin: ComputePipeline<map_begin::Kernel>,
    split: ComputePipeline<map_split::Kernel>,
    ranks: Scan,
    pairs: ComputePipeline<map_pairs::Kernel>,
}

/// Memory of builds of up to a number of boxes. What later stages only read they read by texels, which software drivers fetch for all lanes at
/// once.
#[derive(Debug)]
pub struct MapBuffers {
    capacity: u32,
    /// The boxes: two quarters each, the words of the lower corner and of the upper one as the ordered integers of `shaders/accel/lbvh.glsl`,
    /// and two that are unused.
    pub boxes: TexelView,
    /// Bounds of the boxes' doubled centres, and the grid over them.
    pub bounds: Buffer,
    /// Numbers of nodes by level, and the leaf size: [`MapTreeState`].
    pub state: Buffer,
    /// Where queries begin: a [`CompactRoot`].
    pub root: Buffer,
    /// Sibling pairs; those beyond [`MapTreeState::nodes`] are undefined.
    pub pairs: TexelView,
    /// Words that are 1 for places at which a node is split: a leaf ends there, and at the last place.
    pub retained: TexelView,
    keys: [TexelView; 2],
    order: [TexelView; 2],
    sort_scratch: Buffer,
    blocks: TexelView,
    nodes: Buffer,
    ranks: TexelView,
    scan_scratch: Buffer,
}

impl MapBuffers {
    /// Boxes that there is room for.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Bytes of everything.
    pub fn bytes(&self) -> u64 {
        let texels = [&self.boxes, &self.pairs, &self.retained, &self.blocks, &self.ranks];
        let texels = texels.into_iter().chain(&self.keys).chain(&self.order);
        let buffers = [
            &self.bounds,
            &self.state,
            &self.root,
            &self.sort_scratch,
            &self.nodes,
            &self.scan_scratch,
        ];
        texels.map(|t| t.buffer().bytes()).sum::<u64>() + buffers.iter().map(|b| b.bytes()).sum::<u64>()
    }
}

impl MapBuilder {
    /// The kernels that are its own; it has those of [`RadixSort::KERNELS`] and [`Scan::KERNELS`] besides.
    pub const KERNELS: [&'static ShaderInfo; 6] = [
        &lbvh_grid::INFO,
        &lbvh_codes::INFO,
        &map_blocks::INFO,
        &map_begin::INFO,
        &map_split::INFO,
        &map_pairs::INFO,
    ];

    /// Makes the pipelines.
    ///
    /// # Errors
    /// As [`Gpu::compute_pipeline`].
    pub fn new(gpu: &Gpu) -> Result<Self> {
        let lbvh_axis_bits = MORTON_30_AXIS_BITS;
        let mut options = RadixSortOptions::new(KeyWidth::Bits32, true);
        options.bits = 0..3 * MORTON_30_AXIS_BITS;
        let blocks = |map_places| {
            gpu.compute_pipeline(&map_blocks::Spec {
                map_places,
                ..Default::default()
            })
        };
        Ok(Self {
            sort: RadixSort::new(gpu, options)?,
            grid: gpu.compute_pipeline(&lbvh_grid::Spec { lbvh_axis_bits })?,
            codes: gpu.compute_pipeline(&lbvh_codes::Spec { lbvh_axis_bits })?,
            blocks: [blocks(true)?, blocks(false)?],
            begin: gpu.compute_pipeline(&Default::default())?,
            split: gpu.compute_pipeline(&Default::default())?,
            ranks: Scan::new(gpu, ScanOptions::default())?,
            pairs: gpu.compute_pipeline(&Default::default())?,
            gpu: gpu.clone(),
        })
    }

    /// The kernels with their specialization, those of the sort and of the scan among them.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let [places, blocks] = &self.blocks;
        let mut all = vec![self.grid.info(), self.codes.info()];
        all.extend(self.sort.pipelines());
        all.extend([places.info(), blocks.info(), self.begin.info(), self.split.info()]);
        all.extend(self.ranks.pipelines());
        all.push(self.pairs.info());
        all
    }

    /// The most boxes that the device can build over, memory allowing.
    pub fn max_boxes(&self) -> u32 {
        let caps = self.gpu.caps();
        let dispatched = u64::from(caps.max_workgroups[0]) * u64::from(MAP_GROUP_SIZE);
        // Boxes of places and blocks are the most texels: two per box, and a third of it besides.
        let texels = caps.max_texel_buffer_elements.min(caps.max_storage_buffer_range / 16);
        let indexed = 1 << INDEX_BITS;
        let most = dispatched.min((texels / 3).saturating_sub(16)).min(indexed);
        (most as u32).min(self.sort.max_keys())
    }

    /// Memory for up to `capacity` boxes, at least one.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] for more than [`MapBuilder::max_boxes`], [`Error::OutOfMemory`].
    pub fn buffers(&self, capacity: u32) -> Result<MapBuffers> {
        self.check(capacity, self.max_boxes())?;
        let gpu = &self.gpu;
        let n = u64::from(capacity.max(1));
        let buffer = |name, bytes: u64| gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work));
        let words = |name, texels| gpu.storage_texels(name, Category::Work, vk::Format::R32_UINT, texels);
        let quarters = |name, texels| gpu.storage_texels(name, Category::Work, vk::Format::R32G32B32A32_UINT, texels);
        let box_quarters = u64::from(LBVH_BOX_QUARTERS);
        Ok(MapBuffers {
            capacity,
            boxes: quarters("map boxes", box_quarters * n)?,
            bounds: buffer("map bounds", size_of::<LbvhState>() as u64)?,
            state: buffer("map state", size_of::<MapTreeState>() as u64)?,
            root: buffer("map root", size_of::<CompactRoot>() as u64)?,
            pairs: quarters("map pairs", PAIR_QUARTERS * n)?,
            retained: words("map splits", n)?,
            keys: [
                self.sort.keys("map codes", capacity)?,
                self.sort.keys("map sorted codes", capacity)?,
            ],
            order: [
                self.sort.values("map order", capacity)?,
                self.sort.values("map sorted order", capacity)?,
            ],
            sort_scratch: buffer("map sort", self.sort.scratch_bytes(capacity))?,
            blocks: quarters("map blocks", box_quarters * blocks_of(capacity))?,
            nodes: buffer("map nodes", 16 * n)?,
            ranks: words("map ranks", n)?,
            scan_scratch: buffer("map scan", self.ranks.scratch_bytes(capacity))?,
        })
    }

    /// Which box is at each place, once a build of `count` boxes has run: a word each.
    pub fn order<'a>(&self, buffers: &'a MapBuffers, count: u32) -> &'a TexelView {
        &buffers.order[self.sort.result_side(count)]
    }

    fn check(&self, count: u32, limit: u32) -> Result<()> {
        if count > limit {
            return Err(Error::LimitExceeded {
                name: "boxes of a hierarchy by the device".into(),
                value: count.into(),
                limit_name: "MapBuilder::max_boxes",
                limit: limit.into(),
            });
        }
        Ok(())
    }

    /// Records what comes before the boxes are written, with their bounds in [`MapBuffers::bounds`] by atomic operations: least and greatest
    /// bounds, no nodes, and a leaf size of 1 at least, which another kernel may write over. Ends with a barrier for compute shaders.
    ///
    /// # Errors
    /// As [`Pass::update`].
    pub fn record_begin(&self, pass: &mut Pass<'_>, buffers: &MapBuffers, leaf_size: u32) -> Result<()> {
        let bounds = LbvhState {
            centres_lower: [i32::MAX; 3],
            centres_upper: [i32::MIN; 3],
            ..LbvhState::default()
        };
        let groups = [0, 1, 1];
        let level = MapTreeLevel {
            groups,
            count: 0,
            begin: 0,
        };
        let state = MapTreeState {
            levels: [level; MAP_LEVELS as usize + 1],
            node_groups: groups,
            nodes: 0,
            leaf_size: leaf_size.max(1),
        };
        pass.memory_barrier(Access::COMPUTE | Access::INDIRECT_READ, Access::TRANSFER_WRITE);
        pass.update(buffers.bounds.view(), &[bounds])?;
        pass.update(buffers.state.view(), &[state])?;
        pass.fill(buffers.retained.buffer().view(), 0)?;
        pass.memory_barrier(Access::TRANSFER_WRITE, Access::COMPUTE | Access::INDIRECT_READ);
        Ok(())
    }

    /// Records the build over the first `count` boxes, at least one. Boxes, their bounds and the leaf size must have been written after
    /// [`MapBuilder::record_begin`] and be visible to compute shaders.
    ///
    /// Passes: `map: codes`, `map: sort`, `map: blocks`, `map: split`, `map: ranks`, `map: pairs`. It ends with a barrier: compute shaders and
    /// copies may read root, pairs, splits and order after it.
    ///
    /// # Errors
    /// [`Error::Setting`] for no boxes, [`Error::LimitExceeded`] for more than the capacity, and as [`Pass::dispatch`].
    pub fn record(&self, recorder: &mut Recorder, buffers: &MapBuffers, count: u32) -> Result<()> {
        if count == 0 {
            return Err(Error::setting("map.boxes", count, "are none"));
        }
        self.check(count, buffers.capacity)?;
        self.record_order(recorder, buffers, count)?;
        let all = self.record_blocks(recorder, buffers, count)?;
        self.record_nodes(recorder, buffers, count, all)?;
        recorder.pass("map: ranks", |pass| {
            let words = ScanBuffers {
                input: buffers.retained.buffer().view(),
                heads: None,
                output: buffers.ranks.buffer().view(),
            };
            self.ranks
                .record(pass, &words, Count::Host(count), &buffers.scan_scratch)?;
            stage_barrier(pass);
            Ok(())
        })?;
        recorder.pass("map: pairs", |pass| {
            let set = map_pairs::Set0 {
                map_codes: &buffers.keys[self.sort.result_side(count)],
                map_blocks: &buffers.blocks,
                map_ranks: &buffers.ranks,
                map_state_block: buffers.state.view(),
                map_nodes: buffers.nodes.view(),
                map_pairs: buffers.pairs.buffer().view(),
            };
            let groups = arguments(&buffers.state, std::mem::offset_of!(MapTreeState, node_groups));
            pass.dispatch_indirect(&self.pairs, &[&set], &map_pairs::Push { count }, groups)?;
            pass.memory_barrier(
                Access::COMPUTE | Access::INDIRECT_READ,
                Access::COMPUTE | Access::TRANSFER_READ,
            );
            Ok(())
        })
    }

    /// Codes of the boxes, and both in their order.
    fn record_order(&self, recorder: &mut Recorder, buffers: &MapBuffers, count: u32) -> Result<()> {
        recorder.pass("map: codes", |pass| {
            let set = lbvh_grid::Set0 {
                lbvh_state_block: buffers.bounds.view(),
            };
            pass.dispatch(&self.grid, &[&set], &(), [1, 1, 1])?;
            stage_barrier(pass);
            let set = lbvh_codes::Set0 {
                lbvh_boxes: &buffers.boxes,
                lbvh_state_block: buffers.bounds.view(),
                lbvh_codes: buffers.keys[0].buffer().view(),
                lbvh_order: buffers.order[0].buffer().view(),
            };
            let groups = [self.codes.groups_for(count), 1, 1];
            pass.dispatch(&self.codes, &[&set], &lbvh_codes::Push { count }, groups)?;
            stage_barrier(pass);
            Ok(())
        })?;
        recorder.pass("map: sort", |pass| {
            let sides = SortBuffers {
                keys: [&buffers.keys[0], &buffers.keys[1]],
                values: Some([&buffers.order[0], &buffers.order[1]]),
            };
            self.sort
                .record(pass, &sides, Count::Host(count), &buffers.sort_scratch)?;
            stage_barrier(pass);
            Ok(())
        })
    }

    /// Boxes of blocks; returns the block of all.
    fn record_blocks(&self, recorder: &mut Recorder, buffers: &MapBuffers, count: u32) -> Result<u32> {
        let side = self.sort.result_side(count);
        let (mut level, mut from, mut first) = (count, 0, true);
        recorder.pass("map: blocks", |pass| {
            while first || level > 1 {
                let blocks = level.div_ceil(MAP_BLOCK);
                let set = map_blocks::Set0 {
                    map_boxes: &buffers.boxes,
                    map_order: &buffers.order[side],
                    map_blocks: buffers.blocks.buffer().view(),
                };
                let push = map_blocks::Push {
                    count: level,
                    from,
                    to: from + level,
                };
                let kernel = &self.blocks[usize::from(!first)];
                pass.dispatch(kernel, &[&set], &push, [kernel.groups_for(blocks), 1, 1])?;
                stage_barrier(pass);
                (level, from, first) = (blocks, from + level, false);
            }
            Ok(())
        })?;
        Ok(from)
    }

    /// The inner nodes with their splits.
    fn record_nodes(&self, recorder: &mut Recorder, buffers: &MapBuffers, count: u32, all: u32) -> Result<()> {
        let codes = &buffers.keys[self.sort.result_side(count)];
        recorder.pass("map: split", |pass| {
            let set = map_begin::Set0 {
                map_codes: codes,
                map_blocks: &buffers.blocks,
                map_state_block: buffers.state.view(),
                map_nodes: buffers.nodes.view(),
                map_root: buffers.root.view(),
            };
            pass.dispatch(&self.begin, &[&set], &map_begin::Push { count, all }, [1, 1, 1])?;
            stage_barrier(pass);
            let set = map_split::Set0 {
                map_codes: codes,
                map_state_block: buffers.state.view(),
                map_nodes: buffers.nodes.view(),
                map_retained: buffers.retained.buffer().view(),
            };
            for level in 0..MAP_LEVELS {
                let place = level as usize * size_of::<MapTreeLevel>() + std::mem::offset_of!(MapTreeLevel, groups);
                let groups = arguments(&buffers.state, std::mem::offset_of!(MapTreeState, levels) + place);
                pass.dispatch_indirect(&self.split, &[&set], &map_split::Push { level }, groups)?;
                stage_barrier(pass);
            }
            Ok(())
        })
    }
}

fn stage_barrier(pass: &mut Pass<'_>) {
    pass.memory_barrier(
        Access::COMPUTE | Access::INDIRECT_READ,
        Access::COMPUTE | Access::INDIRECT_READ,
    );
}

fn arguments(buffer: &Buffer, offset: usize) -> BufferView<'_> {
    buffer.slice(offset as u64, 12)
}

/// Boxes of so many places and of all blocks above them.
fn blocks_of(places: u32) -> u64 {
    let (mut level, mut all) = (u64::from(places), u64::from(places));
    while level > 1 {
        level = level.div_ceil(MAP_BLOCK.into());
        all += level;
    }
    // One place is a block by itself.
    all.max(2)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-DEVICE-MAP",
    name: "compact hierarchies of photon maps built by the device, from the root down a level at a time",
    role: Role::PartOf("PM-SYS-1"),
    limits: "Needs `shaderFloat64` for the boxes of kernels, else the host builds; as many boxes as texel buffers and workgroups allow.",
    sources: &[
        sources::LAUTERBACH_2009.whole(),
        sources::FABIANOWSKI_2011.at("§6.1.2 and §6.2"),
    ],
    shaders: &[
        "shaders/accel/map_begin.comp",
        "shaders/accel/map_blocks.comp",
        "shaders/accel/map_pairs.comp",
        "shaders/accel/map_split.comp",
    ],
    tests: &[
        "tests/tests/photon/maps.rs::device_maps_of_hard_records_are_the_twins",
        "tests/tests/photon/maps.rs::queries_of_device_maps_meet_every_kernel",
        "tests/tests/photon/maps.rs::device_maps_of_scenes_are_the_twins_and_pictures_are_equal",
        "tests/tests/photon/maps.rs::devices_without_numbers_of_64_bits_leave_maps_to_the_host",
    ],
    api: &["clerestory::accel::photon_map::device::MapBuilder"],
    settings: &["map_build"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_room_for_every_block() {
        assert_eq!([0, 1, 2, 4, 5, 16, 17].map(blocks_of), [2, 2, 3, 5, 8, 21, 25]);
        // What `max_boxes` counts on: less than three quarters of texels per box, beside the least.
        for places in [1, 5, 100, 1 << 20, (1 << 20) + 1] {
            assert!(2 * blocks_of(places) <= 3 * (u64::from(places) + 16), "{places}");
        }
    }
}
