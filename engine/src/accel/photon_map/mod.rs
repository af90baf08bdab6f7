//! Trees over the kernels of photon maps, for queries by points: their builder, and the layouts that queries read.
//! None is a [`RayIndex`](super::RayIndex), though both layouts answer rays too.
//!
//! [`merge`] builds over sorted codes ([`SortedCodes`](super::lbvh::SortedCodes)); [`leaf_threshold`] says how large leaves should be. Layouts:
//! [`complete_bvh`] and, of half its size, [`compact_bvh`]. [`device`] builds the latter's form of the tree by merging on the device. Other
//! builders, by which merging is measured, are in [`yardstick`](super::yardstick).
//!
//! Guarantees: the same tree on any machine; split lists and clusters make the tree that merging makes; both layouts visit the same leaves.

pub(crate) mod clustered;
pub mod compact_bvh;
pub mod complete_bvh;
pub mod device;
pub mod leaf_threshold;
pub mod merge;
pub(crate) mod split_lists;

#[cfg(test)]
mod tests;
