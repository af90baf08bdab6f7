//! Makes leaves of the subtrees that are better off so.
//!
//! Source: the surface area heuristic with unit costs (J. Goldsmith and J. Salmon, "Automatic Creation of Object Hierarchies for Ray
//! Tracing", IEEE CG&A 7(5), 1987), from the leaves up: a subtree is a leaf where the rule says so, given the least cost of what is below.

use super::{BoxTree, Child, EMPTY_NODE, LeafRule, PairNode, half_area};

/// What becomes of every inner node.
pub(super) struct Leaves {
    /// Primitives below.
    counts: Vec<u32>,
    is_leaf: Vec<bool>,
    /// Expected node visits and primitive tests, times half the root's area, in f32. Trees over the same primitives compare by it.
    pub(super) cost: f32,
}

/// Chooses leaves in a tree each of whose leaves holds one primitive.
pub(super) fn choose(tree: &BoxTree, rule: LeafRule) -> Leaves {
    let order: Vec<u32> = tree.preorder().map(|(node, _)| node).collect();
    let nodes = tree.nodes.len();
    let (mut counts, mut is_leaf) = (vec![0; nodes], vec![false; nodes]);
    let mut costs = vec![0.0f32; nodes];
    for &node in order.iter().rev() {
        let pair = &tree.nodes[node as usize];
        let (mut count, mut cost) = (0, 0.0);
        for (bounds, child) in pair.bounds.iter().zip(pair.children) {
            let (child_count, child_cost) = match child {
                Child::Leaf { count, .. } => (count, half_area(bounds) * count as f32),
                Child::Inner(i) => (counts[i as usize], costs[i as usize]),
            };
            count += child_count;
            cost += child_cost;
        }
        let area = half_area(&pair.bounds[0].union(pair.bounds[1]));
        let (split_cost, leaf_cost) = (area + cost, area * count as f32);
        let leaf = rule.makes_leaf(count, leaf_cost, split_cost, count as usize == tree.order.len());
        let node = node as usize;
        (counts[node], is_leaf[node]) = (count, leaf);
        costs[node] = if leaf { leaf_cost } else { split_cost };
    }
    let cost = match tree.root {
        Child::Inner(root) => costs[root as usize],
        Child::Leaf { count, .. } => half_area(&tree.bounds) * count as f32,
    };
    Leaves { counts, is_leaf, cost }
}

/// The tree with the leaves that were chosen in it, nodes and primitives in depth-first order.
pub(super) fn with_leaves(tree: &BoxTree, leaves: &Leaves) -> BoxTree {
    let mut order = Vec::with_capacity(tree.order.len());
    let mut nodes: Vec<PairNode> = Vec::with_capacity(tree.nodes.len());
    let mut root = tree.root;
    let mut pending = vec![(tree.root, None)];
    let mut gathered = Vec::new();
    while let Some((child, parent)) = pending.pop() {
        let made = match child {
            Child::Inner(node) if !leaves.is_leaf[node as usize] => {
                let place = nodes.len() as u32;
                let pair = &tree.nodes[node as usize];
                nodes.push(PairNode {
                    bounds: pair.bounds,
                    ..EMPTY_NODE
                });
                for side in [1, 0] {
                    pending.push((pair.children[side], Some((place, side))));
                }
                Child::Inner(place)
            }
            child => {
                let first = order.len() as u32;
                let count = match child {
                    Child::Leaf { count, .. } => count,
                    Child::Inner(node) => leaves.counts[node as usize],
                };
                gathered.push(child);
                while let Some(child) = gathered.pop() {
                    match child {
                        Child::Leaf { first, count } => {
                            order.extend(&tree.order[first as usize..(first + count) as usize]);
                        }
                        Child::Inner(node) => gathered.extend(tree.nodes[node as usize].children.iter().rev()),
                    }
                }
                Child::Leaf { first, count }
            }
        };
        match parent {
            None => root = made,
            Some((place, side)) => {
                let (place, side): (u32, usize) = (place, side);
                nodes[place as usize].children[side] = made;
            }
        }
    }
    BoxTree {
        order,
        nodes,
        bounds: tree.bounds,
        root,
    }
}
