//! The hierarchy by lists of splits, level by level from the root: the baseline of the other forms.
//!
//! Source: C. Lauterbach et al., "Fast BVH Construction on GPUs", Eurographics 2009. Neighbours whose codes differ first in bit m are split
//! at every level below, which makes chains of nodes with one child; left children are found by their first place, right ones by their
//! last, and boxes need a pass of their own.
//!
//! Guarantee: the same tree as [`merged_hierarchy`](super::merge::merged_hierarchy), and how many nodes stood before chains were taken out.

use crate::accel::Aabb;
use crate::accel::box_tree::{BoxTree, Child, EMPTY_NODE};
use crate::accel::lbvh::SortedCodes;
use crate::catalogue::{Role, Row, sources};

/// A node of one level: a range of places.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Range {
    first: u32,
    last: u32,
    /// Left and right child in the level below, the same for a node of one child.
    children: [u32; 2],
}

/// What the lists held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct SplitListCounts {
    /// Entries of the list of splits.
    pub splits: u64,
    /// Nodes of all levels, those of one child included.
    pub nodes: u64,
}

/// The hierarchy over boxes, of which `sorted` has the codes, with leaves of at most `leaf_size` but for runs of equal codes.
pub fn split_list_hierarchy(boxes: &[Aabb], sorted: &SortedCodes, leaf_size: u32) -> (BoxTree, SplitListCounts) {
    let mut counts = SplitListCounts::default();
    let count = sorted.order.len();
    if count == 0 {
        return (BoxTree::single_leaf(Vec::new(), Aabb::EMPTY), counts);
    }
    let splits = splits_by_level(sorted);
    let mut levels: Vec<Vec<Range>> = vec![ranges(&[], count)];
    for splits in &splits {
        counts.splits += splits.len() as u64;
        levels.push(ranges(splits, count));
    }
    counts.nodes = levels.iter().map(|level| level.len() as u64).sum();
    for level in 1..levels.len() {
        let (above, below) = levels.split_at_mut(level);
        link(&mut above[level - 1], &below[0]);
    }
    (collapse(boxes, sorted, &levels, leaf_size), counts)
}

/// Places behind which each level from the second on is cut.
fn splits_by_level(sorted: &SortedCodes) -> Vec<Vec<u32>> {
    let mut levels = vec![Vec::new(); sorted.bits as usize];
    for (place, pair) in sorted
        .codes
        .windows(2)
        .enumerate()
        .filter(|(_, pair)| pair[0] != pair[1])
    {
        let level = sorted.bits - 1 - (pair[0] ^ pair[1]).ilog2();
        for below in &mut levels[level as usize..] {
            below.push(place as u32);
        }
    }
    levels
}

fn ranges(splits: &[u32], count: usize) -> Vec<Range> {
    let mut first = 0;
    let ends = splits.iter().copied().chain([count as u32 - 1]);
    ends.map(|last| {
        let range = Range {
            first,
            last,
            children: [0; 2],
        };
        first = last + 1;
        range
    })
    .collect()
}

/// Left children begin where their parents do, right ones end there; ranges of a level lie in the order of both.
fn link(parents: &mut [Range], children: &[Range]) {
    for parent in parents {
        parent.children = [
            children.partition_point(|child| child.first < parent.first) as u32,
            children.partition_point(|child| child.last < parent.last) as u32,
        ];
    }
}

/// Takes out nodes of one child and those inside leaves, from the lowest level up, with the boxes.
fn collapse(boxes: &[Aabb], sorted: &SortedCodes, levels: &[Vec<Range>], leaf_size: u32) -> BoxTree {
    let mut nodes = Vec::new();
    let mut below: Vec<(Aabb, Child)> = Vec::new();
    for level in levels.iter().rev() {
        let mut these = Vec::with_capacity(level.len());
        for range in level {
            let count = range.last - range.first + 1;
            if below.is_empty() {
                let members = &sorted.order[range.first as usize..=range.last as usize];
                let bounds = members.iter().fold(Aabb::EMPTY, |b, i| b.union(boxes[*i as usize]));
                let first = range.first;
                these.push((bounds, Child::Leaf { first, count }));
                continue;
            }
            let [left, right] = range.children.map(|child| below[child as usize]);
            if range.children[0] == range.children[1] {
                these.push(left);
                continue;
            }
            let bounds = left.0.union(right.0);
            if count <= leaf_size {
                let first = range.first;
                these.push((bounds, Child::Leaf { first, count }));
                continue;
            }
            let mut node = EMPTY_NODE;
            node.bounds = [left.0, right.0];
            node.children = [left.1, right.1];
            these.push((bounds, Child::Inner(nodes.len() as u32)));
            nodes.push(node);
        }
        below = these;
    }
    let (bounds, root) = below[0];
    BoxTree {
        order: sorted.order.clone(),
        nodes,
        bounds,
        root,
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-MAP-4",
    name: "linear hierarchy by split lists",
    role: Role::Yardstick,
    limits: "Makes chains of nodes with one child, which are taken out later; boxes need a pass of their own.",
    sources: &[sources::LAUTERBACH_2009.whole()],
    tests: &["engine/src/accel/photon_map/tests.rs::merging_split_lists_and_clusters_make_the_tree_of_the_definition"],
    api: &["clerestory::accel::yardstick::split_list_hierarchy"],
    ..Row::of(file!())
}];
