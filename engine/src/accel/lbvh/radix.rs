//! The hierarchy of sorted Morton codes: at each node the codes split where their highest differing bit changes.
//!
//! Source: C. Apetrei, "Fast and Simple Agglomerative LBVH Construction", EG UK CGVC 2014: a node is named by the last place of its left
//! child, and of the two places at its ends a range joins the one whose codes differ in the lower bit. Equal codes are told apart by their
//! places, as in T. Karras, "Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees", HPG 2012. Here the same tree is
//! made from the root down, so that threads need no atomic operations; the kernels climb from the leaves, and tests hold both together.
//!
//! Guarantee: twin of the kernels `lbvh_hierarchy` and `lbvh_emit` to the bit; the same tree whatever the number of threads; depth as
//! asked for, see [`hierarchy`].

use super::tree::{BoxTree, Child, EMPTY_NODE, PairNode};
use crate::accel::bvh2::Aabb;
use crate::accel::morton::{MORTON_30_AXIS_BITS, MortonGrid, doubled_centre};
use glam::Vec3;
use rayon::prelude::*;

/// Ranges above this are built in parallel.
const PARALLEL_RANGE: usize = 4096;

/// Primitives in the order of their codes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SortedCodes {
    /// Codes, ascending.
    pub codes: Vec<u64>,
    /// Primitive of each code; of equal codes in ascending order.
    pub order: Vec<u32>,
    /// Bits of a code.
    pub bits: u32,
}

impl SortedCodes {
    /// Codes of the boxes' centres in a grid over the exact bounds of these, sorted; ties by index.
    pub fn of_boxes(boxes: &[Aabb], axis_bits: u32) -> Self {
        let centres = boxes
            .par_iter()
            .map(|b| Aabb::EMPTY.with_point(doubled_centre(b)))
            .reduce(|| Aabb::EMPTY, Aabb::union);
        let grid = MortonGrid::new(&centres, axis_bits);
        let code = |b: &Aabb| grid.code(doubled_centre(b));
        let bits = 3 * axis_bits;
        if axis_bits == MORTON_30_AXIS_BITS {
            let pack = |(i, b): (usize, &Aabb)| code(b) << 32 | i as u64;
            let mut pairs: Vec<u64> = boxes.par_iter().enumerate().map(pack).collect();
            pairs.par_sort_unstable();
            return Self {
                codes: pairs.par_iter().map(|p| p >> 32).collect(),
                order: pairs.par_iter().map(|p| *p as u32).collect(),
                bits,
            };
        }
        let pack = |(i, b): (usize, &Aabb)| (code(b), i as u32);
        let mut pairs: Vec<(u64, u32)> = boxes.par_iter().enumerate().map(pack).collect();
        pairs.par_sort_unstable();
        Self {
            codes: pairs.par_iter().map(|p| p.0).collect(),
            order: pairs.par_iter().map(|p| p.1).collect(),
            bits,
        }
    }

    /// How the codes at a place and the next differ when their lowest `skipped` bits do not count: larger where a higher bit differs.
    #[cfg(test)]
    pub(crate) fn difference(&self, place: usize, skipped: u32) -> (u64, u32) {
        let codes = (self.codes[place] ^ self.codes[place + 1]) >> skipped;
        (codes, (place ^ (place + 1)) as u32)
    }

    /// The last place of the left child of a range, both ends included, of at least two.
    fn split(&self, first: usize, last: usize, skipped: u32) -> usize {
        let differing = (self.codes[first] ^ self.codes[last]) >> skipped;
        if differing == 0 {
            let bit = (first ^ last).ilog2();
            return (last >> bit << bit) - 1;
        }
        let bit = differing.ilog2() + skipped;
        first + self.codes[first..=last].partition_point(|code| code >> bit & 1 == 0) - 1
    }
}

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

/// A finished subtree.
#[derive(Debug, Clone, Copy)]
struct Built {
    bounds: Aabb,
    child: Child,
    cost: f32,
    height: u32,
}

/// What all ranges share.
struct Builder<'a> {
    sorted: &'a SortedCodes,
    boxes: &'a [Aabb],
    rule: LeafRule,
    skipped: u32,
}

/// The hierarchy over boxes, of which `sorted` has the codes, at most `max_depth` inner nodes deep.
///
/// Where it would be deeper, the lowest bits of the codes are left out of account, as many as it takes, and the places in the order
/// decide below that; without any bits it is ⌈log₂ n⌉ deep, which `max_depth` must allow. Nodes are in the order of their splits but for
/// the root, which is the first.
pub fn hierarchy(boxes: &[Aabb], sorted: &SortedCodes, rule: LeafRule, max_depth: u32) -> BoxTree {
    let count = sorted.order.len();
    if count == 0 {
        return BoxTree::single_leaf(Vec::new(), Aabb::EMPTY);
    }
    let mut skipped = 0;
    loop {
        let mut slots = vec![EMPTY_NODE; count - 1];
        let mut kept = vec![true; count - 1];
        let builder = Builder {
            sorted,
            boxes,
            rule,
            skipped,
        };
        let root = builder.range(0, count - 1, &mut slots, &mut kept);
        if root.height <= max_depth || skipped >= sorted.bits {
            return compact(sorted.order.clone(), &slots, &kept, root);
        }
        skipped = next_skipped(skipped, root.height, max_depth, sorted.bits);
    }
}

/// Bits to leave out after a tree that was too deep: each takes a level at most.
pub(crate) fn next_skipped(skipped: u32, height: u32, max_depth: u32, bits: u32) -> u32 {
    (skipped + height - max_depth).min(bits)
}

impl Builder<'_> {
    fn range(&self, first: usize, last: usize, slots: &mut [PairNode], kept: &mut [bool]) -> Built {
        if first == last {
            let bounds = self.boxes[self.sorted.order[first] as usize];
            return Built {
                bounds,
                child: Child::Leaf {
                    first: first as u32,
                    count: 1,
                },
                cost: half_area(&bounds),
                height: 0,
            };
        }
        let split = self.sorted.split(first, last, self.skipped);
        let (left_slots, rest) = slots.split_at_mut(split - first);
        let (left_kept, kept_rest) = kept.split_at_mut(split - first);
        let (slot, right_slots) = rest.split_at_mut(1);
        let right_kept = &mut kept_rest[1..];
        let mut left = || self.range(first, split, left_slots, left_kept);
        let mut right = || self.range(split + 1, last, right_slots, right_kept);
        let (left, right) = if last - first > PARALLEL_RANGE {
            rayon::join(left, right)
        } else {
            (left(), right())
        };
        slot[0] = PairNode {
            bounds: [left.bounds, right.bounds],
            children: [left.child, right.child],
        };
        let bounds = left.bounds.union(right.bounds);
        let count = (last - first + 1) as u32;
        let area = half_area(&bounds);
        let split_cost = area + (left.cost + right.cost);
        let leaf_cost = area * count as f32;
        let is_root = count as usize == self.sorted.order.len();
        if self.rule.makes_leaf(count, leaf_cost, split_cost, is_root) {
            kept.fill(false);
            return Built {
                bounds,
                child: Child::Leaf {
                    first: first as u32,
                    count,
                },
                cost: leaf_cost,
                height: 0,
            };
        }
        Built {
            bounds,
            child: Child::Inner(split as u32),
            cost: split_cost,
            height: left.height.max(right.height) + 1,
        }
    }
}

/// Leaves out the nodes inside of leaves.
fn compact(order: Vec<u32>, slots: &[PairNode], kept: &[bool], root: Built) -> BoxTree {
    let Child::Inner(root_slot) = root.child else {
        return BoxTree::single_leaf(order, root.bounds);
    };
    let mut places = Vec::with_capacity(slots.len());
    let mut before = 0;
    for (slot, kept) in kept.iter().enumerate() {
        let is_root = slot == root_slot as usize;
        places.push(if is_root {
            0
        } else {
            before + u32::from(slot < root_slot as usize)
        });
        before += u32::from(*kept);
    }
    let mut nodes = vec![EMPTY_NODE; before as usize];
    for (slot, pair) in slots.iter().enumerate().filter(|(slot, _)| kept[*slot]) {
        let moved = |child| match child {
            Child::Inner(slot) => Child::Inner(places[slot as usize]),
            leaf => leaf,
        };
        nodes[places[slot] as usize] = PairNode {
            bounds: pair.bounds,
            children: pair.children.map(moved),
        };
    }
    BoxTree {
        order,
        nodes,
        bounds: root.bounds,
        root: Child::Inner(0),
    }
}
