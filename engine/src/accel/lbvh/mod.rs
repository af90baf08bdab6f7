//! Linear bounding volume hierarchy: the tree that sorted Morton codes spell, built in linear time, over triangles and over the kernels
//! of photon maps alike.
//!
//! Sources: C. Lauterbach et al., "Fast BVH Construction on GPUs", Eurographics 2009, for the idea; each module names the form it builds.
//! [`radix_tree`] is the form that renderers use, here and on the device; the others are what it is compared with, and what photon maps use.
//!
//! Guarantees: the same tree whatever the number of threads; every box the exact union of what it holds; any set of finite boxes gives a
//! tree, equal codes and equal boxes included.

pub mod clustered;
mod device;
mod device_buffers;
pub mod leaf_threshold;
pub mod merge;
pub mod radix_tree;
mod ray_index;
mod sort;
pub mod split_lists;

pub use device::{LbvhBuild, LbvhBuilder, ResidentLbvh};
pub use device_buffers::LbvhBuffers;
pub use ray_index::{BuildQuality, LbvhSettings, build, hierarchy_of, refit};

#[cfg(test)]
mod builders_tests;
#[cfg(test)]
mod tests;

#[cfg(test)]
pub(crate) use tests::hard_boxes;
