//! The photon map: a compact hierarchy over the kernels of a pass, and the records in the order of its leaves.
//!
//! Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §6.1.2, §6.1.3 and §6.2: a linear hierarchy by
//! merging, leaves as large as a share of the kernels about a point, sibling pairs of half the size. Built by the host here, or by the device
//! ([`device_map`](super::device_map)).
//!
//! Guarantees: a point's query visits every kernel that holds it; the same bytes on any number of threads, by host and device.

use super::device_map::DeviceMaps;
use super::kernel::{PhotonWords, kernel_area, kernel_extent, unpack_photon};
use super::settings::MapBuild;
use crate::accel::Aabb;
use crate::accel::lbvh::SortedCodes;
use crate::accel::morton::MORTON_30_AXIS_BITS;
use crate::accel::photon_map::compact_bvh::{CompactBvh, CompactPair};
use crate::accel::photon_map::complete_bvh::CompleteBvh;
use crate::accel::photon_map::leaf_threshold::{LEAF_SHARE, automatic_leaf_size};
use crate::accel::photon_map::merge::merged_hierarchy;
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::{COMPACT_NOTHING, LBVH_BOXES_PER_INVOCATION, LBVH_GROUP_SIZE, PHOTON_LEAF_END};
use crate::gpu::shaders::types::CompactRoot;
use crate::gpu::{Buffer, Category, Gpu, PipelineInfo, Submission, TexelView, Timings};
use crate::{Error, Result};
use rayon::prelude::*;
use std::f64::consts::PI;

/// By how much boxes are larger than kernels, so that no rounding of the kernels' f32 weights reaches beyond.
const BOX_SLACK: f64 = 1e-6;
/// The word of the first quarter with the mark of a leaf's end.
const END_WORD: usize = 3;

/// A map on the device.
#[derive(Debug)]
pub(super) struct PhotonMap {
    /// Where queries begin: a [`CompactRoot`].
    pub root: Buffer,
    pub pairs: TexelView,
    pub records: TexelView,
    pub count: u32,
}

/// What a map says of itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MapFigures {
    /// Greatest number of records in a leaf that the builder aimed at.
    pub leaf_size: u32,
    /// Sum of the kernels' areas over that of the scene: kernels about a point.
    pub cover: f64,
}

impl MapFigures {
    /// Of kernels with that sum of areas, in a scene of another, m².
    pub fn new(leaf_size: u32, kernels: f64, scene_area: f64) -> Self {
        let cover = if scene_area > 0.0 { kernels / scene_area } else { 0.0 };
        Self { leaf_size, cover }
    }
}

/// A map in the host's memory, as queries read it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct MapContents {
    /// Where queries begin: the box of all, and the reference of a pair or leaf.
    pub root: CompactRoot,
    /// Sibling pairs.
    pub pairs: Vec<CompactPair>,
    /// Records, leaf by leaf.
    pub records: Vec<PhotonWords>,
    /// Greatest number of records in a leaf that the builder aimed at.
    pub leaf_size: u32,
    /// Sum of the kernels' areas over that of the scene: kernels about a point.
    pub cover: f64,
}

impl MapContents {
    /// Builds it by the host over `records`, of a scene of that area, m².
    pub(super) fn build(records: &[PhotonWords], scene_area: f64) -> Result<Self> {
        let (boxes, areas): (Vec<Aabb>, Vec<f64>) = records.par_iter().map(box_and_area).unzip();
        let kernels = sum_in_order(&areas);
        let leaf_size = automatic_leaf_size([kernels], scene_area, LEAF_SHARE);
        let sorted = SortedCodes::of_boxes(&boxes, MORTON_30_AXIS_BITS);
        let complete = CompleteBvh::new(&merged_hierarchy(&boxes, &sorted, leaf_size, |_| {}))?;
        let compact = CompactBvh::encode(&complete).map_err(|fault| Error::Internal {
            what: "photon map".into(),
            fault: format!("is not tight: {fault:?}"),
        })?;
        let leaves = complete.order.par_iter().zip(&complete.ends);
        let ordered = leaves.map(|(index, ends)| {
            let mut record = records[*index as usize];
            record[0][END_WORD] |= if *ends { PHOTON_LEAF_END } else { 0 };
            record
        });
        let MapFigures { leaf_size, cover } = MapFigures::new(leaf_size, kernels, scene_area);
        Ok(Self {
            root: CompactRoot {
                lower: compact.root.bounds.lower.to_array(),
                reference: compact.root.reference.unwrap_or(COMPACT_NOTHING),
                upper: compact.root.bounds.upper.to_array(),
                padding: 0,
            },
            records: ordered.collect(),
            pairs: compact.pairs,
            leaf_size,
            cover,
        })
    }

    fn figures(&self) -> MapFigures {
        MapFigures {
            leaf_size: self.leaf_size,
            cover: self.cover,
        }
    }

    /// Copies it to the device.
    fn upload(&self, gpu: &Gpu) -> Result<PhotonMap> {
        let texels = |name, data: &[u8]| gpu.texels_with(name, Category::Work, vk::Format::R32G32B32A32_UINT, data);
        Ok(PhotonMap {
            root: gpu.buffer_with("photon map root", Category::Work, &[self.root])?,
            pairs: texels("photon map", bytemuck::cast_slice(&self.pairs))?,
            records: texels("photon map records", bytemuck::cast_slice(&self.records))?,
            count: self.records.len() as u32,
        })
    }
}

/// Builds maps by host or device.
pub(super) enum MapMaker {
    Host,
    Device {
        maps: Box<DeviceMaps>,
        /// More records than the device can, or memory has room for, go to the host.
        or_host: bool,
    },
}

/// A map, of which the device may still be building what it says of itself.
pub(super) enum Made {
    ByHost(PhotonMap, MapFigures),
    ByDevice(PhotonMap, Box<Submission>),
}

impl MapMaker {
    /// # Errors
    /// [`Error::MissingFeature`] for maps by a device without numbers of 64 bits, and as [`Gpu::compute_pipeline`].
    pub fn new(gpu: &Gpu, build: MapBuild) -> Result<Self> {
        let or_host = match build {
            MapBuild::Host => return Ok(Self::Host),
            MapBuild::Auto if !gpu.caps().float64 => return Ok(Self::Host),
            MapBuild::Auto => true,
            MapBuild::Device => false,
        };
        let maps = Box::new(DeviceMaps::new(gpu)?);
        Ok(Self::Device { maps, or_host })
    }

    /// A map of the first `count` of `records`, in a scene of that area, m². Photons stay on the device where it is the one that builds.
    pub fn make(&mut self, gpu: &Gpu, records: &TexelView, count: u32, scene_area: f64) -> Result<Made> {
        if let Some((map, submission)) = self.by_device(records, count, scene_area)? {
            return Ok(Made::ByDevice(map, Box::new(submission)));
        }
        let words: Vec<PhotonWords> = gpu.read(records.buffer().view(), count as usize)?;
        let built = MapContents::build(&words, scene_area)?;
        Ok(Made::ByHost(built.upload(gpu)?, built.figures()))
    }

    /// A map that the device builds; none where it is the host's to build.
    fn by_device(
        &mut self,
        records: &TexelView,
        count: u32,
        scene_area: f64,
    ) -> Result<Option<(PhotonMap, Submission)>> {
        match self {
            // Maps of nothing are the host's.
            Self::Device { maps, or_host } if count > 0 => match maps.build(records, count, scene_area) {
                Err(Error::LimitExceeded { .. } | Error::OutOfMemory { .. }) if *or_host => Ok(None),
                built => built.map(Some),
            },
            _ => Ok(None),
        }
    }

    /// What the last map by the device says of itself, once its submission was waited for.
    pub fn figures(&self, scene_area: f64) -> Result<Option<MapFigures>> {
        match self {
            Self::Host => Ok(None),
            Self::Device { maps, .. } => Ok(Some(maps.figures(scene_area)?)),
        }
    }

    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        match self {
            Self::Host => Vec::new(),
            Self::Device { maps, .. } => maps.pipelines(),
        }
    }

    /// As [`MapMaker::make`], and reads the map back.
    pub fn contents(&mut self, gpu: &Gpu, records: &TexelView, count: u32, scene_area: f64) -> Result<MapContents> {
        if let (Some((map, submission)), Self::Device { maps, .. }) =
            (self.by_device(records, count, scene_area)?, &*self)
        {
            submission.wait()?;
            return maps.contents(&map, scene_area);
        }
        let words: Vec<PhotonWords> = gpu.read(records.buffer().view(), count as usize)?;
        MapContents::build(&words, scene_area)
    }
}

/// Seconds of a build's passes; 0 where they have none.
pub(super) fn seconds_of(timings: &Timings) -> f64 {
    timings.passes.iter().filter_map(|pass| pass.nanoseconds).sum::<u64>() as f64 * 1e-9
}

/// Builds a map of `records` in a scene of that area, m², and reads it back: what tests and measures compare.
///
/// # Errors
/// [`Error::MissingFeature`] for [`MapBuild::Device`] on a device without `shaderFloat64`, [`Error::LimitExceeded`] for more records than
/// the device can hold, [`Error::OutOfMemory`], [`Error::DeviceLost`].
pub fn map_contents(gpu: &Gpu, records: &[PhotonWords], scene_area: f64, build: MapBuild) -> Result<MapContents> {
    let format = vk::Format::R32G32B32A32_UINT;
    let texels = gpu.texels_with("photon records", Category::Work, format, records)?;
    MapMaker::new(gpu, build)?.contents(gpu, &texels, records.len() as u32, scene_area)
}

/// The box of a record's kernel, and its area on the surface, m².
fn box_and_area(record: &PhotonWords) -> (Aabb, f64) {
    let photon = unpack_photon(record);
    let kernel = photon.kernel();
    let centre = photon.position.as_dvec3();
    // Skewed axes lose digits to their product, by which weights are divided.
    let skew = kernel.along.length() * kernel.across.length() / kernel_area(&kernel);
    let half = kernel_extent(&kernel) * (1.0 + BOX_SLACK * skew) + centre.abs() * f64::from(f32::EPSILON);
    let bounds = Aabb {
        lower: (centre - half).as_vec3(),
        upper: (centre + half).as_vec3(),
    };
    (bounds.without_negative_zero(), PI * kernel_area(&kernel))
}

/// The sum in the order of the device's: lanes of a workgroup take every 64th of its values, then its lanes are added up, and so are workgroups.
/// Twin of `photon_areas.glsl`.
fn sum_in_order(values: &[f64]) -> f64 {
    let lanes = LBVH_GROUP_SIZE as usize;
    let add = |sum: f64, value: &f64| sum + value;
    let of_lanes = |values: &[f64]| {
        let lane = |lane| values.iter().skip(lane).step_by(lanes).fold(0.0, add);
        (0..lanes).map(lane).fold(0.0, |sum, value| add(sum, &value))
    };
    let groups = values.chunks(lanes * LBVH_BOXES_PER_INVOCATION as usize);
    of_lanes(&groups.map(of_lanes).collect::<Vec<_>>())
}
