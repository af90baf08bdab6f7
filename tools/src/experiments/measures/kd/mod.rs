//! kd-trees: probabilities of their nodes, what the heuristics and the traversals cost rays, and where they beat bounding volumes.

pub mod flights;
pub mod kd_caches;
pub mod kd_heuristics;
pub mod kd_or_bvh;
pub mod kd_probability;
pub mod kd_traversal;
