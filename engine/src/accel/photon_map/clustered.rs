//! The hierarchy by clusters: neighbours in the input that share the upper bits of their codes are sorted as one, and the tree is made
//! several levels per pass.
//!
//! Source: J. Pantaleoni and D. Luebke, "HLBVH: Hierarchical LBVH Construction for Real-Time Ray Tracing of Dynamic Geometry", HPG 2010.
//! What it saves depends on the input's coherence, which [`ClusterCounts`] shows.
//!
//! Guarantee: the order of [`SortedCodes::of_boxes`] and the tree of [`merged_hierarchy`](super::merge::merged_hierarchy).

use crate::accel::Aabb;
use crate::accel::box_tree::{BoxTree, Child, EMPTY_NODE};
use crate::accel::lbvh::SortedCodes;
use crate::catalogue::{Role, Row, sources};

/// How much was left to sort and to pass over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct ClusterCounts {
    /// Runs of the input that share their upper bits; so many keys the first sort takes.
    pub clusters: u64,
    /// Most members that the second sort takes at once.
    pub largest_bucket: u64,
    /// Passes that made the tree.
    pub passes: u32,
}

/// Sorts codes in two steps: runs of the input by their upper bits, then what shares these by the others.
pub fn sort_by_clusters(codes: &[u64], bits: u32, upper_bits: u32, counts: &mut ClusterCounts) -> SortedCodes {
    let shift = bits - upper_bits.min(bits);
    let upper = |code: u64| code >> shift;
    let mut clusters: Vec<(u64, std::ops::Range<usize>)> = Vec::new();
    let mut first = 0;
    for run in codes.chunk_by(|a, b| upper(*a) == upper(*b)) {
        clusters.push((upper(run[0]), first..first + run.len()));
        first += run.len();
    }
    counts.clusters = clusters.len() as u64;
    clusters.sort_by_key(|(code, _)| *code);
    let mut members: Vec<(u64, u32)> = clusters
        .into_iter()
        .flat_map(|(_, range)| range.map(|i| (codes[i], i as u32)))
        .collect();
    for bucket in members.chunk_by_mut(|a, b| upper(a.0) == upper(b.0)) {
        counts.largest_bucket = counts.largest_bucket.max(bucket.len() as u64);
        bucket.sort_by_key(|(code, _)| *code);
    }
    SortedCodes {
        codes: members.iter().map(|m| m.0).collect(),
        order: members.iter().map(|m| m.1).collect(),
        bits,
    }
}

/// A range whose codes agree in their first bits, and the node and side that wait for it.
#[derive(Debug, Clone, Copy)]
struct Pending {
    first: usize,
    last: usize,
    decided: u32,
    parent: Option<(u32, usize)>,
}

/// The hierarchy over boxes, of which `sorted` has the codes: each pass decides `levels` bits, at least one, of all ranges that
/// are left.
pub fn clustered_hierarchy(
    boxes: &[Aabb],
    sorted: &SortedCodes,
    leaf_size: u32,
    levels: u32,
    counts: &mut ClusterCounts,
) -> BoxTree {
    let count = sorted.order.len();
    let levels = levels.max(1);
    let mut tree = BoxTree::single_leaf(sorted.order.clone(), Aabb::EMPTY);
    let mut pending = vec![Pending {
        first: 0,
        last: count.saturating_sub(1),
        decided: 0,
        parent: None,
    }];
    if count == 0 {
        pending.clear();
    }
    while !pending.is_empty() {
        counts.passes += 1;
        let mut next = Vec::new();
        for range in &pending {
            let end = (range.decided + levels).min(sorted.bits);
            decide(sorted, leaf_size, *range, end, &mut tree, &mut next);
        }
        pending = next;
    }
    fill_bounds(boxes, &mut tree);
    tree
}

/// Splits a range by its bits up to `end`; what may go on comes into `next`.
fn decide(sorted: &SortedCodes, leaf_size: u32, range: Pending, end: u32, tree: &mut BoxTree, next: &mut Vec<Pending>) {
    let mut stack = vec![range];
    while let Some(mut range) = stack.pop() {
        let count = (range.last - range.first + 1) as u32;
        let splittable = count > leaf_size && sorted.codes[range.first] != sorted.codes[range.last];
        let bit = |decided: u32, place: usize| sorted.codes[place] >> (sorted.bits - 1 - decided) & 1;
        while splittable && range.decided < end && bit(range.decided, range.first) == bit(range.decided, range.last) {
            range.decided += 1;
        }
        if splittable && range.decided == end {
            next.push(range);
            continue;
        }
        let child = if splittable {
            let node = tree.nodes.len() as u32;
            tree.nodes.push(EMPTY_NODE);
            let members = &sorted.codes[range.first..=range.last];
            let below = members.partition_point(|code| code >> (sorted.bits - 1 - range.decided) & 1 == 0);
            let decided = range.decided + 1;
            let halves = [
                (range.first, range.first + below - 1),
                (range.first + below, range.last),
            ];
            for (side, (first, last)) in halves.into_iter().enumerate().rev() {
                stack.push(Pending {
                    first,
                    last,
                    decided,
                    parent: Some((node, side)),
                });
            }
            Child::Inner(node)
        } else {
            Child::Leaf {
                first: range.first as u32,
                count,
            }
        };
        match range.parent {
            Some((node, side)) => tree.nodes[node as usize].children[side] = child,
            None => tree.root = child,
        }
    }
}

/// Boxes from the leaves up.
fn fill_bounds(boxes: &[Aabb], tree: &mut BoxTree) {
    let order: Vec<u32> = tree.preorder().map(|(node, _)| node).collect();
    let leaf = |tree: &BoxTree, child| match child {
        Child::Leaf { first, count } => tree.order[first as usize..(first + count) as usize]
            .iter()
            .fold(Aabb::EMPTY, |b, i| b.union(boxes[*i as usize])),
        Child::Inner(node) => {
            let [a, b] = tree.nodes[node as usize].bounds;
            a.union(b)
        }
    };
    for node in order.into_iter().rev() {
        let children = tree.nodes[node as usize].children;
        tree.nodes[node as usize].bounds = children.map(|child| leaf(tree, child));
    }
    tree.bounds = leaf(tree, tree.root);
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-MAP-11",
    name: "linear hierarchy by clusters",
    role: Role::Yardstick,
    limits: "What it saves depends on how coherent the input is.",
    sources: &[sources::PANTALEONI_LUEBKE_2010.whole()],
    tests: &[
        "engine/src/accel/photon_map/tests.rs::sorting_by_clusters_is_the_stable_sort",
        "engine/src/accel/photon_map/tests.rs::merging_split_lists_and_clusters_make_the_tree_of_the_definition",
    ],
    api: &["clerestory::accel::yardstick::clustered_hierarchy"],
    ..Row::of(file!())
}];
