//! kd-trees: probabilities of their nodes, what the heuristics and the traversals cost rays, whether all find the same hits, and where they
//! beat bounding volumes.

pub mod flights;
mod hit_errors;
pub mod kd_caches;
pub mod kd_heuristics;
pub mod kd_or_bvh;
pub mod kd_probability;
pub mod kd_rays;
pub mod kd_threads;
pub mod kd_traversal;
mod ray_kinds;
mod real_models;
