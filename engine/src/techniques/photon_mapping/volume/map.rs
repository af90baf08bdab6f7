//! The volume map: a compact hierarchy over the kernels of a pass's events, and the events in the order of its leaves; built by device or host.
//!
//! Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §6.1.2, §6.2 and §7.4.2, whose leaves hold sixteen events instead of four.
//!
//! Guarantees: a ray's query visits every kernel that it pierces; the same bytes on any number of threads, by host and device.

use super::event::{EventWords, MEDIUM_WORD, event_box, set_event_radius, unpack_beam, unpack_event};
use super::footprint::EventKernelSettings;
use super::neighbor::neighbor_radii;
use super::plane::plane_corners;
use super::{VolumeEstimate, VolumeKernel};
use crate::accel::Aabb;
use crate::accel::lbvh::SortedCodes;
use crate::accel::morton::MORTON_30_AXIS_BITS;
use crate::accel::photon_map::compact_bvh::CompactBvh;
use crate::accel::photon_map::complete_bvh::CompleteBvh;
use crate::accel::photon_map::device::{MapBuffers, MapBuilder};
use crate::accel::photon_map::merge::merged_hierarchy;
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::{
    COMPACT_NOTHING, EVENT_LEAF_END, LBVH_BOXES_PER_INVOCATION, LBVH_GROUP_SIZE, POINT_RECORD,
};
use crate::gpu::shaders::techniques::photon_mapping::{photon_event_boxes, photon_event_leaves};
use crate::gpu::shaders::types::CompactRoot;
use crate::gpu::{Access, Buffer, Category, ComputePipeline, Gpu, PipelineInfo, Submission, TexelView};
use crate::techniques::photon_mapping::settings::{MapBuild, PhotonSettings};
use crate::{Error, Result};
use glam::Vec3;
use rayon::prelude::*;

/// Events of a leaf, at most, where their codes tell them apart. Of larger leaves rays test more kernels that they pass by.
const LEAF_SIZE: u32 = 4;

/// A map on the device.
#[derive(Debug)]
pub(in crate::techniques::photon_mapping) struct EventMap {
    /// Where queries begin: a [`CompactRoot`].
    pub root: Buffer,
    pub pairs: TexelView,
    pub events: TexelView,
    pub count: u32,
}

/// Builds maps.
pub(in crate::techniques::photon_mapping) struct EventMaps {
    gpu: Gpu,
    /// None for maps that the host builds.
    device: Option<DeviceEventMaps>,
    /// Of the device: more events than it can, or memory has room for, go to the host.
    or_host: bool,
    /// What records are.
    estimate: VolumeEstimate,
    /// Kernels are as wide as this neighbour is far, which the host finds.
    neighbors: Option<usize>,
}

struct DeviceEventMaps {
    builder: MapBuilder,
    boxes: ComputePipeline<photon_event_boxes::Kernel>,
    leaves: ComputePipeline<photon_event_leaves::Kernel>,
    memory: Option<(MapBuffers, TexelView)>,
    /// Of a record.
    quarters: u32,
}

impl EventMaps {
    /// # Errors
    /// As [`Gpu::compute_pipeline`].
    pub fn new(gpu: &Gpu, settings: &PhotonSettings) -> Result<Self> {
        let (build, estimate) = (settings.map_build, settings.volume);
        let (beams, planes, points) = (
            estimate.stores_ways(),
            estimate.stores_planes(),
            estimate.stores_points(),
        );
        let by_neighbors = settings.volume_kernel == VolumeKernel::Neighbor;
        let neighbors = by_neighbors.then_some(settings.volume_neighbors as usize);
        let device = match build {
            _ if by_neighbors => None,
            MapBuild::Host => None,
            MapBuild::Auto | MapBuild::Device => Some(DeviceEventMaps {
                builder: MapBuilder::new(gpu)?,
                boxes: gpu.compute_pipeline(&photon_event_boxes::Spec { beams, planes, points })?,
                leaves: gpu.compute_pipeline(&photon_event_leaves::Spec {
                    wide: estimate.stores_beside(),
                })?,
                memory: None,
                quarters: estimate.quarters(),
            }),
        };
        Ok(Self {
            gpu: gpu.clone(),
            device,
            or_host: build == MapBuild::Auto,
            estimate,
            neighbors,
        })
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        let Some(device) = &self.device else { return Vec::new() };
        let mut all = vec![device.boxes.info()];
        all.extend(device.builder.pipelines());
        all.push(device.leaves.info());
        all
    }

    /// A map of the first `count` of `events`, and the submission that builds it, if the device does. Kernels that the trace has not made are made so: those of
    /// beams, of a radius, m, and those by neighbours, of which the share `shrunk` is left.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] for more events than the device can build over where it is to, [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn make(
        &mut self,
        events: &TexelView,
        count: u32,
        kernel: &EventKernelSettings,
        beam_radius: f64,
        shrunk: f64,
    ) -> Result<(EventMap, Option<Submission>)> {
        let radius = beam_radius as f32;
        if let Some(device) = self.device.as_mut().filter(|_| count > 0) {
            match device.build(&self.gpu, events, count, radius) {
                Err(Error::LimitExceeded { .. } | Error::OutOfMemory { .. }) if self.or_host => {}
                built => return built.map(|(map, submission)| (map, Some(submission))),
            }
        }
        if self.estimate.stores_ways() {
            let quarters = count as usize * self.estimate.quarters() as usize;
            let words: Vec<[u32; 4]> = self.gpu.read(events.buffer().view(), quarters)?;
            return Ok((self.by_host(&words, radius)?, None));
        }
        let words = self.read(events, count, kernel, shrunk)?;
        Ok((self.by_host(words.as_flattened(), radius)?, None))
    }

    /// The first `count` of `events`, which are collisions, with their kernels.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], [`Error::DeviceLost`], [`Error::LimitExceeded`] for more events than neighbours can be found among.
    pub fn read(
        &self,
        events: &TexelView,
        count: u32,
        kernel: &EventKernelSettings,
        shrunk: f64,
    ) -> Result<Vec<EventWords>> {
        let mut words: Vec<EventWords> = self.gpu.read(events.buffer().view(), count as usize)?;
        if let Some(neighbors) = self.neighbors {
            let places: Vec<_> = words.iter().map(unpack_event).map(|e| (e.position, e.medium)).collect();
            let radii = neighbor_radii(&places, neighbors, (kernel.length_max / shrunk) as f32)?;
            for (words, radius) in words.iter_mut().zip(radii) {
                let shrunk = f64::from(radius) * shrunk;
                set_event_radius(words, shrunk.max(kernel.length_min) as f32);
            }
        }
        Ok(words)
    }

    fn by_host(&self, words: &[[u32; 4]], radius: f32) -> Result<EventMap> {
        let quarters = self.estimate.quarters() as usize;
        let records = words.par_chunks_exact(quarters);
        let estimate = self.estimate;
        let boxes: Vec<Aabb> = records.map(|record| box_of(estimate, record, radius)).collect();
        let sorted = SortedCodes::of_boxes(&boxes, MORTON_30_AXIS_BITS);
        let complete = CompleteBvh::new(&merged_hierarchy(&boxes, &sorted, LEAF_SIZE, |_| {}))?;
        let compact = CompactBvh::encode(&complete).map_err(|fault| Error::Internal {
            what: "volume map".into(),
            fault: format!("is not tight: {fault:?}"),
        })?;
        let leaves = complete.order.par_iter().zip(&complete.ends);
        let ordered: Vec<[u32; 4]> = leaves
            .flat_map_iter(|(index, ends)| {
                let first = *index as usize * quarters;
                let ends = if *ends { EVENT_LEAF_END } else { 0 };
                let record = words[first..first + quarters].iter().enumerate();
                record.map(move |(quarter, word)| {
                    let mut word = *word;
                    word[MEDIUM_WORD] |= if quarter == 0 { ends } else { 0 };
                    word
                })
            })
            .collect();
        let root = CompactRoot {
            lower: compact.root.bounds.lower.to_array(),
            reference: compact.root.reference.unwrap_or(COMPACT_NOTHING),
            upper: compact.root.bounds.upper.to_array(),
            padding: 0,
        };
        let texels = |name, data: &[u8]| {
            self.gpu
                .texels_with(name, Category::Work, vk::Format::R32G32B32A32_UINT, data)
        };
        Ok(EventMap {
            root: self.gpu.buffer_with("volume map root", Category::Work, &[root])?,
            pairs: texels("volume map", bytemuck::cast_slice(&compact.pairs))?,
            events: texels("volume map events", bytemuck::cast_slice(&ordered))?,
            count: boxes.len() as u32,
        })
    }
}

/// The box of a record; that of a beam has a radius.
fn box_of(estimate: VolumeEstimate, record: &[[u32; 4]], radius: f32) -> Aabb {
    let words: EventWords = [record[0], record[1]];
    let is_point = |quarter: &[u32; 4]| quarter[3] == POINT_RECORD;
    if !estimate.stores_ways() || estimate.stores_points() && record.get(2).is_some_and(is_point) {
        let event = unpack_event(&words);
        return event_box(event.position, event.position, event.radius);
    }
    let beam = unpack_beam(&words);
    let plane = record.get(2).filter(|_| estimate.stores_planes());
    let second = plane.map_or(Vec3::ZERO, |[x, y, z, _]| {
        Vec3::from_array([*x, *y, *z].map(f32::from_bits))
    });
    if second != Vec3::ZERO {
        let [low, high] = plane_corners(second, beam.start, beam.end);
        return event_box(low, high, 0.0);
    }
    event_box(beam.start, beam.end, radius)
}

impl DeviceEventMaps {
    /// Submits the build of a map of the first `count` of `events`, at least one. It lasts until the next build.
    fn build(&mut self, gpu: &Gpu, events: &TexelView, count: u32, radius: f32) -> Result<(EventMap, Submission)> {
        let enough = |memory: &(MapBuffers, TexelView)| memory.0.capacity() >= count;
        if !self.memory.as_ref().is_some_and(enough) {
            self.memory = None;
            let most = self.builder.max_boxes().max(count);
            // More than are there now, so that the next pass has room as well.
            let roomy = count.saturating_add(count / 4).min(most);
            let made = match self.memory_of(gpu, roomy) {
                Err(Error::OutOfMemory { .. }) if roomy > count => self.memory_of(gpu, count),
                made => made,
            };
            self.memory = Some(made?);
        }
        let Some((tree, ordered)) = &self.memory else {
            return Err(Error::Internal {
                what: "volume map".into(),
                fault: "has no memory".into(),
            });
        };
        let mut recorder = gpu.recorder("volume map")?;
        recorder.pass("volume map: boxes", |pass| {
            self.builder.record_begin(pass, tree, LEAF_SIZE)?;
            let set = photon_event_boxes::Set0 {
                event_records_in: events,
                lbvh_boxes: tree.boxes.buffer().view(),
                lbvh_state_block: tree.bounds.view(),
            };
            let groups = count.div_ceil(LBVH_GROUP_SIZE * LBVH_BOXES_PER_INVOCATION);
            let push = photon_event_boxes::Push { count, radius };
            pass.dispatch(&self.boxes, &[&set], &push, [groups, 1, 1])?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
            Ok(())
        })?;
        self.builder.record(&mut recorder, tree, count)?;
        recorder.pass("volume map: events", |pass| {
            let set = photon_event_leaves::Set0 {
                event_records_in: events,
                map_order: self.builder.order(tree, count),
                map_retained: &tree.retained,
                event_map_records: ordered.buffer().view(),
            };
            let groups = [self.leaves.groups_for(count), 1, 1];
            pass.dispatch(&self.leaves, &[&set], &photon_event_leaves::Push { count }, groups)?;
            pass.memory_barrier(Access::COMPUTE, Access::COMPUTE | Access::TRANSFER_READ);
            Ok(())
        })?;
        let map = EventMap {
            root: tree.root.clone(),
            pairs: tree.pairs.clone(),
            events: ordered.clone(),
            count,
        };
        Ok((map, recorder.submit()?))
    }

    fn memory_of(&self, gpu: &Gpu, capacity: u32) -> Result<(MapBuffers, TexelView)> {
        let texels = u64::from(capacity) * u64::from(self.quarters);
        let format = vk::Format::R32G32B32A32_UINT;
        Ok((
            self.builder.buffers(capacity)?,
            gpu.storage_texels("volume map events", Category::Work, format, texels)?,
        ))
    }
}
