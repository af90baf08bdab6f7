//! The linear hierarchy as a ray index: over triangles, in the node layout that the path tracer traverses.

use super::radix::{LeafRule, SortedCodes, hierarchy};
use super::tree::{BoxTree, Child};
use crate::Result;
use crate::accel::bvh2::build::{assemble, check_count, check_range, leaf_word, usable};
use crate::accel::bvh2::{Aabb, Bvh2, Bvh2Node, COUNT_BITS, MAX_DEPTH, MAX_LEAF_SIZE};
use crate::accel::morton::{MORTON_30_AXIS_BITS, MORTON_63_AXIS_BITS};
use crate::accel::optimise::{MAX_TREELET, Restructuring, restructure};
use bytemuck::Zeroable;
use glam::Vec3;

/// Whether to spend time on the tree after it stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BuildQuality {
    /// The tree that the codes spell.
    Fast,
    /// Restructured by treelets: see [`optimise`](crate::accel::optimise).
    #[default]
    High,
}

/// Settings of the build.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LbvhSettings {
    /// Bits of a Morton code: 30 or 63. Default 30.
    pub code_bits: u32,
    /// Most triangles in a leaf, 1..=8. Default 4.
    pub leaf_size: u32,
    /// Default high.
    pub quality: BuildQuality,
    /// Leaves of a treelet, 3..=16; high quality only. Default 9.
    pub treelet: u32,
    /// Passes of restructuring, 0..=16; high quality only. Default 3.
    pub rounds: u32,
}

impl Default for LbvhSettings {
    fn default() -> Self {
        Self {
            code_bits: 3 * MORTON_30_AXIS_BITS,
            leaf_size: 4,
            quality: BuildQuality::High,
            treelet: 9,
            rounds: 3,
        }
    }
}

impl LbvhSettings {
    /// Bits an axis.
    pub(crate) fn axis_bits(&self) -> u32 {
        self.code_bits / 3
    }

    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for what is out of range.
    pub(crate) fn check(&self) -> Result<()> {
        if ![MORTON_30_AXIS_BITS, MORTON_63_AXIS_BITS].contains(&self.axis_bits()) || !self.code_bits.is_multiple_of(3)
        {
            return Err(crate::Error::setting(
                "lbvh.code_bits",
                self.code_bits,
                "is neither 30 nor 63",
            ));
        }
        check_range("lbvh.leaf_size", self.leaf_size, 1, MAX_LEAF_SIZE)?;
        check_range("lbvh.treelet", self.treelet, 3, MAX_TREELET as u32)?;
        check_range("lbvh.rounds", self.rounds, 0, 16)
    }
}

/// The tree over boxes with at least two of them, as [`build`] makes it for triangles; boxes without negative zeros.
pub fn hierarchy_of(boxes: &[Aabb], settings: &LbvhSettings) -> BoxTree {
    let sorted = SortedCodes::of_boxes(boxes, settings.axis_bits());
    let rule = LeafRule::Area(settings.leaf_size);
    if settings.quality == BuildQuality::Fast {
        return hierarchy(boxes, &sorted, rule, MAX_DEPTH);
    }
    let tree = hierarchy(boxes, &sorted, LeafRule::Area(1), MAX_DEPTH);
    let restructuring = Restructuring {
        treelet: settings.treelet as usize,
        rounds: settings.rounds,
        leaves: rule,
        max_depth: MAX_DEPTH,
    };
    restructure(&tree, boxes, &restructuring)
}

/// Builds over `triangles`; hits name triangles by their place in it. Deterministic whatever the number of threads. The result reports
/// itself as `lbvh`.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) for settings out of range, [`Error::LimitExceeded`](crate::Error::LimitExceeded) for more than
/// [`MAX_TRIANGLES`](crate::accel::bvh2::MAX_TRIANGLES).
pub fn build(triangles: &[[Vec3; 3]], settings: &LbvhSettings) -> Result<Bvh2> {
    settings.check()?;
    check_count(triangles.len())?;
    let (references, statistics) = usable(triangles);
    // Adding zero makes both zeros one, whose order devices need not keep.
    let boxes: Vec<Aabb> = references
        .iter()
        .map(|r| Aabb {
            lower: r.bounds.lower + Vec3::ZERO,
            upper: r.bounds.upper + Vec3::ZERO,
        })
        .collect();
    let (order, nodes) = if boxes.len() < 2 {
        ((0..boxes.len() as u32).collect(), Vec::new())
    } else {
        let tree = hierarchy_of(&boxes, settings);
        let nodes = nodes_of(&tree);
        (tree.order, nodes)
    };
    let indices: Vec<u32> = order.iter().map(|place| references[*place as usize].index).collect();
    let positions = indices.iter().map(|index| triangles[*index as usize]).collect();
    Ok(assemble("lbvh", nodes, positions, indices, statistics))
}

/// The nodes in the kernels' layout, at the places they have; the root is the first.
pub(crate) fn nodes_of(tree: &BoxTree) -> Vec<Bvh2Node> {
    let word = |child| match child {
        Child::Leaf { first, count } => leaf_word(first, count),
        Child::Inner(node) => node << COUNT_BITS,
    };
    let mut nodes: Vec<Bvh2Node> = tree
        .nodes
        .iter()
        .map(|pair| Bvh2Node {
            bounds: pair.bounds,
            children: pair.children.map(word),
            ..Bvh2Node::zeroed()
        })
        .collect();
    for (i, pair) in tree.nodes.iter().enumerate() {
        for (side, child) in pair.children.into_iter().enumerate() {
            if let Child::Inner(child) = child {
                nodes[child as usize].parent = (i as u32) << 1 | side as u32;
            }
        }
    }
    nodes
}
