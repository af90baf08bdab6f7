//! What other indexes are measured against: no picture and no other index rests on it.

pub mod left_balanced;
pub mod point_tree;
pub mod voxel_volume;
