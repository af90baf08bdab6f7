//! When a subtree of a bounding volume hierarchy becomes a leaf, in the arithmetic of the kernels.
//!
//! Source: the surface area heuristic, J. Goldsmith and J. Salmon, "Automatic Creation of Object Hierarchies for Ray Tracing", IEEE CG&A
//! 7(5), 1987.

use super::Aabb;
use glam::Vec3;

/// When a subtree becomes a leaf.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LeafRule {
    /// When it has at most so many primitives, the root too: for maps that are queried by points.
    Size(u32),
    /// When it has at most so many and a leaf is expected to cost a ray no more (surface area heuristic, unit costs, f32). The root stays
    /// an inner node, as traversals of rays want it.
    Area(u32),
}

impl LeafRule {
    /// Whether a subtree becomes a leaf.
    pub(crate) fn makes_leaf(self, count: u32, leaf_cost: f32, split_cost: f32, is_root: bool) -> bool {
        match self {
            Self::Size(largest) => count <= largest,
            Self::Area(largest) => !is_root && count <= largest && leaf_cost <= split_cost,
        }
    }
}

/// Half the surface area in f32, as kernels compute it.
pub(crate) fn half_area(bounds: &Aabb) -> f32 {
    let e: Vec3 = bounds.upper - bounds.lower;
    e.x * e.y + e.y * e.z + e.z * e.x
}
