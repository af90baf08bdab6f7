//! Photon maps: construction of their trees, leaf sizes, and queries of every layout, beside the figures of their source.
//!
//! [`photon_scenes`], [`photon_kernels`], [`point_maps`], [`ray_layouts`], [`leaf_frames`] and [`construction_stages`] make what is measured; the other modules are measures.

pub mod compact_map;
pub mod compact_rays;
pub mod construction_stages;
pub mod kd_maps;
pub mod leaf_frames;
pub mod leaf_sizes;
pub mod map_construction;
pub mod map_quality;
pub mod merge_example;
pub mod photon_kernels;
pub mod photon_scenes;
pub mod point_maps;
pub mod ray_layouts;
