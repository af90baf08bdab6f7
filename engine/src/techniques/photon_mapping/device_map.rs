//! Photon maps built by the device from the records that it has traced, without the host seeing them.
//!
//! Stages: `photon_boxes` (boxes and areas of kernels), `photon_leaf_size`, those of
//! [`photon_map::device`](crate::accel::photon_map::device), `photon_leaves` (records in the order of leaves).
//!
//! Guarantees: the same bytes as the host's build, [`MapContents::build`], where the device rounds arithmetic of 64 bits correctly and
//! keeps subnormal numbers; memory is kept from map to map, and grows with the records.

use super::map::{MapContents, MapFigures, PhotonMap};
use crate::accel::photon_map::device::{MapBuffers, MapBuilder};
use crate::accel::photon_map::leaf_threshold::{LEAF_SHARE, LEAST_LEAF_SIZE};
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::{LBVH_BOXES_PER_INVOCATION, LBVH_GROUP_SIZE, PHOTON_QUARTERS};
use crate::gpu::shaders::techniques::photon_mapping::{photon_boxes, photon_leaf_size, photon_leaves};
use crate::gpu::shaders::types::{CompactRoot, MapTreeState};
use crate::gpu::{
    Access, Buffer, BufferDesc, Category, ComputePipeline, Gpu, PipelineInfo, Recorder, Submission, TexelView,
};
use crate::{Error, Result};

/// Builds photon maps on one device, one at a time.
#[derive(Debug)]
pub(super) struct DeviceMaps {
    gpu: Gpu,
    builder: MapBuilder,
    boxes: ComputePipeline<photon_boxes::Kernel>,
    leaf_size: ComputePipeline<photon_leaf_size::Kernel>,
    leaves: ComputePipeline<photon_leaves::Kernel>,
    memory: Option<Memory>,
}

/// Of maps of up to so many records.
#[derive(Debug)]
struct Memory {
    tree: MapBuffers,
    /// Sums of areas by workgroup.
    areas: Buffer,
    /// What a map says of itself, and where the host reads it.
    cover: Buffer,
    readback: Buffer,
    /// In the order of leaves.
    records: TexelView,
}

impl DeviceMaps {
    /// # Errors
    /// [`Error::MissingFeature`] without `shaderFloat64`, and as [`Gpu::compute_pipeline`].
    pub fn new(gpu: &Gpu) -> Result<Self> {
        if !gpu.caps().float64 {
            return Err(Error::MissingFeature {
                feature: "shaderFloat64".into(),
                needed_by: "photon_boxes".into(),
                device: gpu.caps().device.clone(),
                instead: "let the host build the map: \"map_build\": \"host\" or \"auto\"".into(),
            });
        }
        Ok(Self {
            builder: MapBuilder::new(gpu)?,
            boxes: gpu.compute_pipeline(&Default::default())?,
            leaf_size: gpu.compute_pipeline(&Default::default())?,
            leaves: gpu.compute_pipeline(&Default::default())?,
            memory: None,
            gpu: gpu.clone(),
        })
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let mut all = vec![self.boxes.info(), self.leaf_size.info()];
        all.extend(self.builder.pipelines());
        all.push(self.leaves.info());
        all
    }

    /// Submits the build of a map of the first `count` of `records`, at least one. What is submitted after it may read the map at once, which lasts
    /// until the next build.
    pub fn build(&mut self, records: &TexelView, count: u32, scene_area: f64) -> Result<(PhotonMap, Submission)> {
        self.make_room(count)?;
        let memory = self.memory()?;
        let mut recorder = self.gpu.recorder("photon map")?;
        self.record_boxes(&mut recorder, memory, records, count, scene_area)?;
        self.builder.record(&mut recorder, &memory.tree, count)?;
        recorder.pass("map: records", |pass| {
            let set = photon_leaves::Set0 {
                photon_records_in: records,
                map_order: self.builder.order(&memory.tree, count),
                map_retained: &memory.tree.retained,
                photon_map_records: memory.records.buffer().view(),
            };
            let groups = [self.leaves.groups_for(count), 1, 1];
            pass.dispatch(&self.leaves, &[&set], &photon_leaves::Push { count }, groups)?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE | Access::TRANSFER_READ);
            pass.copy(memory.cover.view(), memory.readback.view())?;
            Ok(())
        })?;
        let map = PhotonMap {
            root: memory.tree.root.clone(),
            pairs: memory.tree.pairs.clone(),
            records: memory.records.clone(),
            count,
        };
        Ok((map, recorder.submit()?))
    }

    /// Boxes, their bounds, and the leaf size.
    fn record_boxes(
        &self,
        recorder: &mut Recorder,
        memory: &Memory,
        records: &TexelView,
        count: u32,
        scene_area: f64,
    ) -> Result<()> {
        let words = |number: f64| bytemuck::cast::<f64, [u32; 2]>(number);
        recorder.pass("map: boxes", |pass| {
            self.builder.record_begin(pass, &memory.tree, LEAST_LEAF_SIZE)?;
            let groups = groups_of(count);
            let set = photon_boxes::Set0 {
                photon_records_in: records,
                lbvh_boxes: memory.tree.boxes.buffer().view(),
                lbvh_state_block: memory.tree.bounds.view(),
                photon_areas: memory.areas.view(),
            };
            pass.dispatch(&self.boxes, &[&set], &photon_boxes::Push { count }, [groups, 1, 1])?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            let set = photon_leaf_size::Set0 {
                photon_areas: memory.areas.view(),
                map_state_block: memory.tree.state.view(),
                photon_cover: memory.cover.view(),
            };
            let push = photon_leaf_size::Push {
                groups,
                scene_area: words(scene_area),
                share: words(LEAF_SHARE),
                least: LEAST_LEAF_SIZE,
            };
            pass.dispatch(&self.leaf_size, &[&set], &push, [1, 1, 1])?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            Ok(())
        })
    }

    /// Makes the memory anew where there is not enough. The map before is gone then.
    fn make_room(&mut self, count: u32) -> Result<()> {
        let enough = |memory: &Memory| memory.tree.capacity() >= count;
        if !self.memory.as_ref().is_some_and(enough) {
            self.memory = None;
            let most = self.builder.max_boxes().max(count);
            // More than are there now, so that the next pass has room as well.
            let roomy = count.saturating_add(count / 4).min(most);
            let made = match self.memory_of(roomy) {
                Err(Error::OutOfMemory { .. }) if roomy > count => self.memory_of(count),
                made => made,
            };
            self.memory = Some(made?);
        }
        Ok(())
    }

    fn memory(&self) -> Result<&Memory> {
        self.memory.as_ref().ok_or_else(|| Error::Internal {
            what: "photon map".into(),
            fault: "was never built by the device".into(),
        })
    }

    fn memory_of(&self, capacity: u32) -> Result<Memory> {
        let gpu = &self.gpu;
        let buffer = |name, bytes| gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work));
        let texels = u64::from(capacity) * u64::from(PHOTON_QUARTERS);
        let format = vk::Format::R32G32B32A32_UINT;
        // As buffers are rounded up.
        let cover_bytes = (size_of::<photon_leaf_size::PhotonCover>() as u64).max(16);
        Ok(Memory {
            tree: self.builder.buffers(capacity)?,
            areas: buffer("photon map areas", 8 * u64::from(groups_of(capacity)))?,
            cover: buffer("photon map cover", cover_bytes)?,
            readback: gpu.buffer(&BufferDesc::readback("photon map cover", cover_bytes))?,
            records: gpu.storage_texels("photon map records", Category::Work, format, texels)?,
        })
    }

    /// What the last map says of itself, once its submission was waited for.
    pub fn figures(&self, scene_area: f64) -> Result<MapFigures> {
        let read = self.memory()?.readback.read::<photon_leaf_size::PhotonCover>(0, 1)?;
        let photon_leaf_size::PhotonCover { area, leaf_size } = read[0];
        Ok(MapFigures::new(leaf_size, bytemuck::cast(area), scene_area))
    }

    /// Reads the last map, whose submission was waited for.
    pub fn contents(&self, map: &PhotonMap, scene_area: f64) -> Result<MapContents> {
        let state = self.gpu.read::<MapTreeState>(self.memory()?.tree.state.view(), 1)?;
        let nodes = state[0].nodes as usize;
        let MapFigures { leaf_size, cover } = self.figures(scene_area)?;
        Ok(MapContents {
            root: self.gpu.read::<CompactRoot>(map.root.view(), 1)?[0],
            pairs: self.gpu.read(map.pairs.buffer().view(), nodes)?,
            records: self.gpu.read(map.records.buffer().view(), map.count as usize)?,
            leaf_size,
            cover,
        })
    }
}

/// Workgroups that make the boxes of so many records.
fn groups_of(count: u32) -> u32 {
    count.div_ceil(LBVH_GROUP_SIZE * LBVH_BOXES_PER_INVOCATION)
}
