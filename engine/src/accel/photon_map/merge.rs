//! The hierarchy by merging from the bottom up: boxes, sizes and links in one ascent, without nodes of one child.
//!
//! Source: the improved construction of linear hierarchies for photon maps in B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity
//! College Dublin, 2011, §6.1.2. Neighbours whose codes differ are a merge point at the level of their highest differing bit; points of
//! one level merge disjoint ranges, so a level is one parallel step, and all state lives at the two ends of a range.
//!
//! Guarantee: the tree that splits every range at its highest differing bit and stops at the leaf size. Equal codes are never split: a
//! run of them is a leaf, whatever the leaf size.

use crate::accel::Aabb;
use crate::accel::box_tree::{BoxTree, Child, EMPTY_NODE, PairNode};
use crate::accel::lbvh::SortedCodes;
use crate::catalogue::{Role, Row, sources};

/// Two neighbours whose codes differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MergePoint {
    /// Highest differing bit, counted from the most significant.
    pub level: u32,
    /// Place of the first of both.
    pub place: u32,
}

/// All merge points by level, those of a level by place.
pub fn merge_points(sorted: &SortedCodes) -> Vec<MergePoint> {
    let differing = sorted
        .codes
        .windows(2)
        .enumerate()
        .filter(|(_, pair)| pair[0] != pair[1]);
    let mut points: Vec<MergePoint> = differing
        .map(|(place, pair)| MergePoint {
            level: sorted.bits - 1 - (pair[0] ^ pair[1]).ilog2(),
            place: place as u32,
        })
        .collect();
    points.sort_by_key(|point| point.level);
    points
}

/// State of the ascent, by place: what is said of a range stands at its first place, its size at both ends.
struct Ascent {
    sizes: Vec<u32>,
    /// Node of the range + 1, or 0 while it fits a leaf.
    links: Vec<u32>,
    bounds: Vec<Aabb>,
}

impl Ascent {
    /// Runs of equal codes become ranges.
    fn begin(boxes: &[Aabb], sorted: &SortedCodes) -> Self {
        let count = sorted.codes.len();
        let mut ascent = Self {
            sizes: vec![1; count],
            links: vec![0; count],
            bounds: sorted.order.iter().map(|i| boxes[*i as usize]).collect(),
        };
        let mut first = 0;
        for run in sorted.codes.chunk_by(|a, b| a == b) {
            let last = first + run.len() - 1;
            for i in first + 1..=last {
                ascent.bounds[first] = ascent.bounds[first].union(ascent.bounds[i]);
            }
            ascent.sizes[first] = run.len() as u32;
            ascent.sizes[last] = run.len() as u32;
            first = last + 1;
        }
        ascent
    }

    /// What a range is seen from above.
    fn child(&self, first: usize) -> Child {
        match self.links[first] {
            0 => Child::Leaf {
                first: first as u32,
                count: self.sizes[first],
            },
            link => Child::Inner(link - 1),
        }
    }

    /// Merges both ranges at a point; the node of the point is written when the range no longer fits a leaf.
    fn merge(&mut self, point: MergePoint, slot: usize, leaf_size: u32, nodes: &mut [PairNode]) {
        let middle = point.place as usize;
        let first = middle + 1 - self.sizes[middle] as usize;
        let last = middle + self.sizes[middle + 1] as usize;
        let size = (last - first + 1) as u32;
        if size > leaf_size {
            nodes[slot] = PairNode {
                bounds: [self.bounds[first], self.bounds[middle + 1]],
                children: [self.child(first), self.child(middle + 1)],
            };
            self.links[first] = slot as u32 + 1;
        }
        self.bounds[first] = self.bounds[first].union(self.bounds[middle + 1]);
        self.sizes[first] = size;
        self.sizes[last] = size;
    }
}

/// The hierarchy over boxes, of which `sorted` has the codes. A node stands where its merge point does, so the places of points inside of
/// leaves stay empty. `observe` sees the sizes before the first level and after each that has points.
pub fn merged_hierarchy(
    boxes: &[Aabb],
    sorted: &SortedCodes,
    leaf_size: u32,
    mut observe: impl FnMut(&[u32]),
) -> BoxTree {
    if sorted.order.is_empty() {
        return BoxTree::single_leaf(Vec::new(), Aabb::EMPTY);
    }
    let points = merge_points(sorted);
    let mut nodes = vec![EMPTY_NODE; points.len()];
    let mut ascent = Ascent::begin(boxes, sorted);
    observe(&ascent.sizes);
    let mut end = points.len();
    for level in points.chunk_by(|a, b| a.level == b.level).rev() {
        let begin = end - level.len();
        for (i, point) in level.iter().enumerate() {
            ascent.merge(*point, begin + i, leaf_size, &mut nodes);
        }
        end = begin;
        observe(&ascent.sizes);
    }
    BoxTree {
        order: sorted.order.clone(),
        nodes,
        bounds: ascent.bounds[0],
        root: ascent.child(0),
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-MAP-5",
    name: "linear hierarchy by merging",
    role: Role::PartOf("PM-SYS-1"),
    limits: "A run of equal codes is one leaf, whatever the leaf size; quality is that of splits in the middle.",
    sources: &[sources::FABIANOWSKI_2011.at("§6.1.2")],
    tests: &[
        "engine/src/accel/photon_map/tests.rs::the_worked_example_of_the_merge_comes_out_step_by_step",
        "engine/src/accel/photon_map/tests.rs::merging_split_lists_and_clusters_make_the_tree_of_the_definition",
    ],
    api: &["clerestory::accel::photon_map::merge::merged_hierarchy"],
    ..Row::of(file!())
}];
