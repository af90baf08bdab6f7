//! What the indexes are measured against, and the oracles that tests hold them to. None of it is for rendering: no technique and no other part of
//! the engine uses it, and each item is slower, larger or less exact than what stands beside it in [`accel`](super), or is known to fail.
//!
//! | here | beside |
//! |---|---|
//! | [`ShiftedRestart`]: loses or repeats leaves; [`leaves_by_stack`]: all leaves of a ray | [`Scheme`](super::kd::Scheme) |
//! | [`WaldTriangle`]: not watertight | [`intersect_triangle`](super::triangle::intersect_triangle) |
//! | [`intersect_triangle_f64`], [`moller_trumbore`]: oracles in f64 | the same |
//! | [`split_list_hierarchy`], [`clustered_hierarchy`]: the same trees, built in other ways | [`merged_hierarchy`](super::photon_map::merge::merged_hierarchy) |
//! | [`volume_sweep_tree`]: how good such a tree can be for points | the same |
//! | [`area_sweep_tree`]: how good a tree can be for rays | [`Bvh2`](super::bvh2::Bvh2) |
//! | [`RayEngine`](ray_engine::RayEngine): rays without an index | the same |
//!
//! Trees over points stand beside the compact map's queries by points: [`left_balanced`] and [`voxel_volume`], with what they share in
//! [`point_tree`].
//!
//! Two more are methods of what photon mapping uses: queries by rays of [`CompactBvh`](super::photon_map::compact_bvh::CompactBvh), and all
//! queries of [`CompleteBvh`](super::photon_map::complete_bvh::CompleteBvh), of which compact pairs are made.

pub mod left_balanced;
pub mod point_tree;
pub mod ray_engine;
pub mod voxel_volume;

pub use super::kd::shifted_restart::{LeafSequence, ShiftedRestart, leaves_by_stack};
pub use super::photon_map::clustered::{ClusterCounts, clustered_hierarchy, sort_by_clusters};
pub use super::photon_map::split_lists::{SplitListCounts, split_list_hierarchy};
pub use super::sweep::{MAX_SWEEP_DEPTH, area_sweep_tree, volume_sweep_tree};
pub use super::triangle::oracles::{intersect_triangle_f64, moller_trumbore};
pub use super::triangle::wald::WaldTriangle;
