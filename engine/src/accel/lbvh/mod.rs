//! Linear bounding volume hierarchy: the tree that sorted Morton codes spell, built in linear time, over triangles or any other boxes.
//!
//! Sources: C. Lauterbach et al., "Fast BVH Construction on GPUs", Eurographics 2009, for the idea; [`radix_tree`] names that of the form
//! built here and on the device. Other forms, which photon maps use, are in [`photon_map`](super::photon_map).
//!
//! Guarantees: the same tree whatever the number of threads; every box the exact union of what it holds; any set of finite boxes gives a
//! tree, equal codes and equal boxes included.

mod codes;
mod device;
mod device_buffers;
pub mod radix_tree;
mod ray_index;
mod sort;

pub use codes::SortedCodes;
pub use device::{LbvhBuild, LbvhBuilder, ResidentLbvh};
pub use device_buffers::LbvhBuffers;
pub use ray_index::{BuildQuality, LbvhSettings, build, hierarchy_of, refit};

#[cfg(test)]
mod tests;

#[cfg(test)]
pub(crate) use tests::{hard_boxes, valid};
