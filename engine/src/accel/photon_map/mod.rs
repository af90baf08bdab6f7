//! Trees over the kernels of photon maps, for queries by points: builders that are compared for them, and the layouts that queries read.
//! None is a [`RayIndex`](super::RayIndex), though both layouts answer rays too.
//!
//! Builders, all over the same sorted codes ([`SortedCodes`](super::lbvh::SortedCodes)) but the last: [`split_lists`], [`merge`],
//! [`clustered`], and [`vvh`], which is the yardstick of their quality; [`leaf_threshold`] says how large leaves should be. Layouts:
//! [`complete_bvh`] and, of half its size, [`compact_bvh`]. [`device`] builds the latter's form of the tree by merging on the device.
//!
//! Guarantees: the same tree on any machine; split lists, merging and clusters make the same tree; both layouts visit the same leaves.

pub mod clustered;
pub mod compact_bvh;
pub mod complete_bvh;
pub mod device;
pub mod leaf_threshold;
pub mod merge;
pub mod split_lists;
pub mod vvh;

#[cfg(test)]
mod tests;
