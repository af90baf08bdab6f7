//! The photon map: a compact hierarchy over the kernels of a pass, and the records in the order of its leaves.
//!
//! Source: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §6.1.2, §6.1.3 and §6.2: a linear hierarchy by
//! merging, leaves as large as a share of the kernels about a point, sibling pairs of half the size. Built by the host.
//!
//! Guarantees: a point's query visits every kernel that holds it; the same bytes on any number of threads.

use super::kernel::{PhotonWords, kernel_area, kernel_extent, unpack_photon};
use crate::accel::Aabb;
use crate::accel::lbvh::SortedCodes;
use crate::accel::morton::MORTON_30_AXIS_BITS;
use crate::accel::photon_map::compact_bvh::CompactBvh;
use crate::accel::photon_map::complete_bvh::CompleteBvh;
use crate::accel::photon_map::leaf_threshold::{LEAF_SHARE, automatic_leaf_size};
use crate::accel::photon_map::merge::merged_hierarchy;
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::{COMPACT_NOTHING, PHOTON_LEAF_END};
use crate::gpu::shaders::types::CompactRoot;
use crate::gpu::{Category, Gpu, TexelView};
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
    pub root: CompactRoot,
    pub pairs: TexelView,
    pub records: TexelView,
    pub count: u32,
    /// Greatest number of records in a leaf that the builder aimed at.
    pub leaf_size: u32,
    /// Sum of the kernels' areas over that of the scene: kernels about a point.
    pub cover: f64,
}

impl PhotonMap {
    /// Builds it over `records`, of a scene of that area, m².
    pub fn build(gpu: &Gpu, records: &[PhotonWords], scene_area: f64) -> Result<Self> {
        let kernels: Vec<(Aabb, f64)> = records.par_iter().map(box_and_area).collect();
        let boxes: Vec<Aabb> = kernels.iter().map(|kernel| kernel.0).collect();
        let areas = || kernels.iter().map(|kernel| kernel.1);
        let leaf_size = automatic_leaf_size(areas(), scene_area, LEAF_SHARE);
        let sorted = SortedCodes::of_boxes(&boxes, MORTON_30_AXIS_BITS);
        let complete = CompleteBvh::new(&merged_hierarchy(&boxes, &sorted, leaf_size, |_| {}))?;
        let compact = CompactBvh::encode(&complete).map_err(|fault| Error::Internal {
            what: "photon map".into(),
            fault: format!("is not tight: {fault:?}"),
        })?;
        let leaves = complete.order.par_iter().zip(&complete.ends);
        let ordered: Vec<PhotonWords> = leaves
            .map(|(index, ends)| {
                let mut record = records[*index as usize];
                record[0][END_WORD] |= if *ends { PHOTON_LEAF_END } else { 0 };
                record
            })
            .collect();
        let root = compact.root;
        let texels = |name, data: &[u8]| gpu.texels_with(name, Category::Work, vk::Format::R32G32B32A32_UINT, data);
        Ok(Self {
            root: CompactRoot {
                lower: root.bounds.lower.to_array(),
                reference: root.reference.unwrap_or(COMPACT_NOTHING),
                upper: root.bounds.upper.to_array(),
                padding: 0,
            },
            pairs: texels("photon map", bytemuck::cast_slice(&compact.pairs))?,
            records: texels("photon map records", bytemuck::cast_slice(&ordered))?,
            count: records.len() as u32,
            leaf_size,
            cover: if scene_area > 0.0 {
                areas().sum::<f64>() / scene_area
            } else {
                0.0
            },
        })
    }
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
