//! Takes subtrees out of a tree and puts them back where they cost least.
//!
//! Source: J. Bittner, M. Hapala, V. Havran, "Fast Insertion-Based Optimization of Bounding Volume Hierarchies", CGF 32(1), 2013 (the move);
//! D. Meister and J. Bittner, "Parallel Reinsertion for Bounding Volume Hierarchy Optimization", CGF 37(2), Eurographics 2018 (all nodes
//! search for their places in the tree as it stands, by branch and bound from their own place upwards; moves come after). There, moves that
//! touch the same nodes are locked out by atomics; here they are made one after the other, greatest gain first, each only where it still
//! gains in the tree that those before have left.
//!
//! Guarantee: the sum of areas never rises by more than rounding; the same tree whatever the number of threads; the depth bound holds.

use super::{Aabb, BoxTree, Child, EMPTY_NODE, half_area};
use rayon::prelude::*;

/// No node.
const NONE: u32 = u32::MAX;

/// Searches that a task takes at least.
const TASK: usize = 64;

/// An inner node, or a primitive: then the first child is [`NONE`] and the second its place in the order.
#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: Aabb,
    children: [u32; 2],
}

impl Node {
    fn is_leaf(&self) -> bool {
        self.children[0] == NONE
    }
}

/// Where a node would be better off.
#[derive(Debug, Clone, Copy)]
struct Move {
    gain: f32,
    node: u32,
    /// The node that becomes its sibling.
    beside: u32,
}

/// A tree that can be changed; the root is node 0.
struct Links {
    nodes: Vec<Node>,
    parents: Vec<u32>,
    /// Most inner nodes on a way down, the node itself among them.
    heights: Vec<u32>,
}

/// Moves the nodes of a tree, each of whose leaves holds one primitive, in so many rounds. The tree is at most `max_depth` inner nodes deep.
pub(super) fn reinsert(tree: &BoxTree, rounds: u32, max_depth: u32) -> BoxTree {
    let Child::Inner(_) = tree.root else {
        return tree.clone();
    };
    let mut links = Links::new(tree);
    for _ in 0..rounds {
        if links.round(max_depth) == 0 {
            break;
        }
    }
    links.finish(tree)
}

impl Links {
    /// Nodes in depth-first order.
    fn new(tree: &BoxTree) -> Self {
        let count = 2 * tree.nodes.len() + 1;
        let mut links = Self {
            nodes: Vec::with_capacity(count),
            parents: Vec::with_capacity(count),
            heights: vec![0; count],
        };
        let mut pending = vec![(tree.root, tree.bounds, NONE, 0)];
        while let Some((child, bounds, parent, side)) = pending.pop() {
            let place = links.nodes.len() as u32;
            if parent != NONE {
                let side: usize = side;
                links.nodes[parent as usize].children[side] = place;
            }
            links.parents.push(parent);
            let children = match child {
                Child::Leaf { first, .. } => [NONE, first],
                Child::Inner(node) => {
                    let pair = &tree.nodes[node as usize];
                    for side in [1, 0] {
                        pending.push((pair.children[side], pair.bounds[side], place, side));
                    }
                    [0; 2]
                }
            };
            links.nodes.push(Node { bounds, children });
        }
        for node in (0..links.nodes.len() as u32).rev() {
            if !links.nodes[node as usize].is_leaf() {
                links.update(node);
            }
        }
        links
    }

    /// Box and height of a node by its children; whether they have changed.
    fn update(&mut self, node: u32) -> bool {
        let [a, b] = self.nodes[node as usize].children.map(|child| child as usize);
        let bounds = self.nodes[a].bounds.union(self.nodes[b].bounds);
        let height = self.heights[a].max(self.heights[b]) + 1;
        let node = node as usize;
        let changed = bounds != self.nodes[node].bounds || height != self.heights[node];
        self.nodes[node].bounds = bounds;
        self.heights[node] = height;
        changed
    }

    fn area(&self, node: u32) -> f64 {
        self.nodes[node as usize].bounds.half_area()
    }

    fn sibling(&self, node: u32) -> u32 {
        let [a, b] = self.nodes[self.parents[node as usize] as usize].children;
        if a == node { b } else { a }
    }

    /// Whether a node can be taken out: neither the root nor a child of it.
    fn is_movable(&self, node: u32) -> bool {
        let parent = self.parents[node as usize];
        parent != NONE && self.parents[parent as usize] != NONE
    }

    /// The best place for a movable node, of equal ones the first that is found; none where it is best off already.
    ///
    /// What is gained beside a node y is the parent's area, plus what the ancestors up to the first in common with y lose, less what those of y
    /// above it gain, less the area of y's box and the node's together. The last is at least the node's own area, which bounds the search.
    fn search(&self, node: u32, pending: &mut Vec<(f32, u32)>) -> Option<Move> {
        let bounds = self.nodes[node as usize].bounds;
        let own_area = half_area(&bounds);
        let parent = self.parents[node as usize];
        let first_sibling = self.sibling(node);
        let mut best = Move {
            gain: 0.0,
            node,
            beside: NONE,
        };
        let mut gained = half_area(&self.nodes[parent as usize].bounds);
        let (mut pivot, mut sibling) = (parent, first_sibling);
        // The pivot's box without the node.
        let mut rest = self.nodes[sibling as usize].bounds;
        loop {
            pending.push((gained, sibling));
            while let Some((gained, other)) = pending.pop() {
                if gained - own_area <= best.gain {
                    continue;
                }
                let there = &self.nodes[other as usize];
                let gain = gained - half_area(&there.bounds.union(bounds));
                if gain > best.gain && other != first_sibling {
                    (best.gain, best.beside) = (gain, other);
                }
                let below = gain + half_area(&there.bounds);
                if !there.is_leaf() && below - own_area > best.gain {
                    pending.extend(there.children.map(|child| (below, child)));
                }
            }
            let is_root = self.parents[pivot as usize] == NONE;
            if pivot != parent {
                rest = rest.union(self.nodes[sibling as usize].bounds);
                let area = half_area(&self.nodes[pivot as usize].bounds);
                gained += area - half_area(&rest);
                // Beside an ancestor, whose box the two have together.
                if gained - area > best.gain && !is_root {
                    (best.gain, best.beside) = (gained - area, pivot);
                }
            }
            if is_root {
                break;
            }
            sibling = self.sibling(pivot);
            pivot = self.parents[pivot as usize];
        }
        (best.beside != NONE).then_some(best)
    }

    /// Updates a node and its ancestors as far as they change; the sum of the changes of area.
    fn refit(&mut self, mut node: u32) -> f64 {
        let mut change = 0.0;
        while node != NONE {
            let before = self.area(node);
            if !self.update(node) {
                break;
            }
            change += self.area(node) - before;
            node = self.parents[node as usize];
        }
        change
    }

    fn replace_child(&mut self, parent: u32, old: u32, new: u32) {
        let children = &mut self.nodes[parent as usize].children;
        let side = usize::from(children[1] == old);
        children[side] = new;
        self.parents[new as usize] = parent;
    }

    /// Makes a movable node the sibling of another, which is not the root and not below it. Its parent moves along. The change of the sum of
    /// areas.
    fn place(&mut self, node: u32, beside: u32) -> f64 {
        let parent = self.parents[node as usize];
        let above = self.parents[parent as usize];
        let sibling = self.sibling(node);
        let mut change = -self.area(parent);
        self.replace_child(above, parent, sibling);
        change += self.refit(above);
        let above = self.parents[beside as usize];
        self.replace_child(above, beside, parent);
        self.nodes[parent as usize].children = [beside, node];
        self.parents[beside as usize] = parent;
        self.update(parent);
        change + self.area(parent) + self.refit(above)
    }

    /// Makes a move if it still can be made and still gains.
    fn make(&mut self, found: Move, max_depth: u32) -> bool {
        let Move { node, beside, .. } = found;
        let parent = self.parents[node as usize];
        if !self.is_movable(node) || beside == parent || self.parents[beside as usize] == parent {
            return false;
        }
        // The new node stands where the other is, at this depth.
        let mut depth = 0;
        let mut ancestor = beside;
        while ancestor != NONE {
            if ancestor == node {
                return false;
            }
            depth += 1;
            ancestor = self.parents[ancestor as usize];
        }
        let height = self.heights[node as usize].max(self.heights[beside as usize]);
        if depth + height > max_depth {
            return false;
        }
        let sibling = self.sibling(node);
        if self.place(node, beside) < 0.0 {
            return true;
        }
        self.place(node, sibling);
        false
    }

    /// All nodes search, then move; how many have moved.
    fn round(&mut self, max_depth: u32) -> usize {
        let nodes = 0..self.nodes.len() as u32;
        let mut moves: Vec<Move> = nodes
            .into_par_iter()
            .with_min_len(TASK)
            .filter(|node| self.is_movable(*node))
            .map_init(Vec::new, |pending, node| self.search(node, pending))
            .flatten()
            .collect();
        moves.par_sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.node.cmp(&b.node)));
        moves.into_iter().filter(|found| self.make(*found, max_depth)).count()
    }

    fn finish(&self, tree: &BoxTree) -> BoxTree {
        let mut places = Vec::with_capacity(self.nodes.len());
        let mut count = 0;
        for node in &self.nodes {
            places.push(count);
            count += u32::from(!node.is_leaf());
        }
        let mut pairs = Vec::with_capacity(count as usize);
        for node in self.nodes.iter().filter(|node| !node.is_leaf()) {
            let mut pair = EMPTY_NODE;
            for (side, child) in node.children.into_iter().enumerate() {
                let below = &self.nodes[child as usize];
                pair.bounds[side] = below.bounds;
                pair.children[side] = if below.is_leaf() {
                    Child::Leaf {
                        first: below.children[1],
                        count: 1,
                    }
                } else {
                    Child::Inner(places[child as usize])
                };
            }
            pairs.push(pair);
        }
        BoxTree {
            order: tree.order.clone(),
            nodes: pairs,
            bounds: tree.bounds,
            root: Child::Inner(0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{boxes_of, linear_tree};
    use super::*;
    use crate::accel::bvh2::MAX_DEPTH;
    use crate::accel::test_support::Random;

    /// The change of the sum of areas when a node is moved, or none where that is not a move.
    fn change(tree: &BoxTree, node: u32, beside: u32) -> Option<f64> {
        let mut links = Links::new(tree);
        let mut ancestor = beside;
        while ancestor != NONE {
            if ancestor == node {
                return None;
            }
            ancestor = links.parents[ancestor as usize];
        }
        let parent = links.parents[node as usize];
        let is_move = beside != 0 && beside != parent && links.parents[beside as usize] != parent;
        is_move.then(|| links.place(node, beside))
    }

    #[test]
    fn searches_find_the_best_of_all_places() {
        let mut random = Random(71);
        let (mut searched, mut moved) = (0, 0);
        for count in [3, 4, 5, 9, 24] {
            for _ in 0..8 {
                let boxes = boxes_of(&mut random, count, 0.3);
                let tree = linear_tree(&boxes, MAX_DEPTH);
                let links = Links::new(&tree);
                let nodes = 0..links.nodes.len() as u32;
                // A gain sums areas of at most 48 nodes, each within 8 units of roundoff of the root's.
                let rounding = 48.0 * 8.0 * tree.bounds.half_area() / 16_777_216.0;
                for node in nodes.clone().filter(|node| links.is_movable(*node)) {
                    let least = nodes
                        .clone()
                        .filter_map(|beside| change(&tree, node, beside))
                        .fold(0.0, f64::min);
                    let found = links.search(node, &mut Vec::new());
                    let gain = found.map_or(0.0, |found| f64::from(found.gain));
                    assert!((gain + least).abs() <= rounding, "{count}: {gain} {least}");
                    if let Some(found) = found {
                        let made = change(&tree, node, found.beside).unwrap();
                        assert!((gain + made).abs() <= rounding, "{count}: {gain} {made}");
                        moved += 1;
                    }
                    searched += 1;
                }
            }
        }
        assert!(moved > 100 && searched > moved, "{moved} of {searched}");
    }

    #[test]
    fn moves_that_no_longer_gain_are_not_made() {
        let mut random = Random(72);
        let boxes = boxes_of(&mut random, 400, 0.3);
        let mut links = Links::new(&linear_tree(&boxes, MAX_DEPTH));
        let sum = |links: &Links| -> f64 {
            let inner = (0..links.nodes.len() as u32).filter(|node| !links.nodes[*node as usize].is_leaf());
            inner.map(|node| links.area(node)).sum()
        };
        let (mut made, mut refused) = (0, 0);
        let nodes = (0..links.nodes.len() as u32).filter(|node| links.is_movable(*node));
        let moves: Vec<Move> = nodes.filter_map(|node| links.search(node, &mut Vec::new())).collect();
        for found in moves {
            let before = sum(&links);
            let is_made = links.make(found, MAX_DEPTH);
            let after = sum(&links);
            // Sums of 399 areas in f64.
            let rounding = 1e-12 * before;
            assert!(after <= before + rounding && (is_made || (after - before).abs() <= rounding));
            made += u32::from(is_made);
            refused += u32::from(!is_made);
        }
        assert!(made > 20 && refused > 20, "{made} {refused}");
    }
}
