//! Rearranges the treelets of a tree, from the leaves up: each node takes the largest nodes below it as leaves of a treelet and keeps the
//! better of the old and the new arrangement of these.
//!
//! Source: T. Karras and T. Aila, "Fast Parallel Construction of High-Quality Bounding Volume Hierarchies", HPG 2013; the leaves of a treelet
//! merged greedily, nearest pair first, by L. Domingues and H. Pedrini, "Bounding Volume Hierarchy Optimization through Agglomerative
//! Treelet Restructuring", HPG 2015.
//!
//! Guarantee: the expected cost never rises; the depth bound holds; the same tree whatever the number of threads, since a treelet depends
//! on the subtrees below it alone.

use super::{Aabb, BoxTree, Child, Optimisation, PairNode, half_area};
use rayon::prelude::*;

/// Subtrees of more inner nodes than this are worked on in parallel.
const PARALLEL_NODES: usize = 2048;

/// Most leaves of a treelet that settings may ask for.
pub const MAX_TREELET: usize = 16;

/// A place of the order, or an inner node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Link {
    Primitive(u32),
    Inner(u32),
}

/// A subtree's summary.
#[derive(Debug, Clone, Copy)]
struct Summary {
    bounds: Aabb,
    area: f32,
    cost: f32,
    height: u32,
    count: u32,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    children: [Link; 2],
    summary: Summary,
}

struct Restructure<'a> {
    settings: &'a Optimisation,
    /// Boxes in the tree's order.
    boxes: &'a [Aabb],
    total: u32,
}

/// Restructures a tree, each of whose leaves holds one primitive, and so do those of the result. Nodes come in depth-first order. With it
/// the expected cost of the tree that was given, times half the root's area.
pub(super) fn restructure(tree: &BoxTree, boxes: &[Aabb], settings: &Optimisation) -> (BoxTree, f32) {
    let Child::Inner(root) = tree.root else {
        return (tree.clone(), half_area(&tree.bounds));
    };
    let ordered: Vec<Aabb> = tree.order.iter().map(|i| boxes[*i as usize]).collect();
    let work = Restructure {
        settings,
        boxes: &ordered,
        total: tree.order.len() as u32,
    };
    let link = |child| match child {
        Child::Leaf { first, .. } => Link::Primitive(first),
        Child::Inner(node) => Link::Inner(node),
    };
    let unread = work.primitive(0);
    let mut nodes = depth_first(tree.nodes.len(), root, |node| Node {
        children: tree.nodes[node as usize].children.map(link),
        summary: unread,
    });
    for i in (0..nodes.len()).rev() {
        let children = nodes[i].children.map(|c| work.summary(c, &nodes, 0));
        nodes[i].summary = work.merged(children);
    }
    let given_cost = nodes[0].summary.cost;
    for _ in 0..settings.rounds {
        work.subtree(&mut nodes, 0, 1);
        nodes = depth_first(nodes.len(), 0, |node| nodes[node as usize]);
    }
    (work.finish(tree, &nodes), given_cost)
}

/// At most `count` nodes in depth-first order, left child first: a subtree is then a slice.
fn depth_first(count: usize, root: u32, read: impl Fn(u32) -> Node) -> Vec<Node> {
    let mut ordered: Vec<Node> = Vec::with_capacity(count);
    let mut pending = vec![(root, None)];
    while let Some((node, parent)) = pending.pop() {
        let place = ordered.len() as u32;
        if let Some((parent, side)) = parent {
            let parent: &mut Node = &mut ordered[parent as usize];
            let side: usize = side;
            parent.children[side] = Link::Inner(place);
        }
        let node = read(node);
        ordered.push(node);
        for side in [1, 0] {
            if let Link::Inner(child) = node.children[side] {
                pending.push((child, Some((place, side))));
            }
        }
    }
    ordered
}

impl Restructure<'_> {
    fn primitive(&self, place: u32) -> Summary {
        let bounds = self.boxes[place as usize];
        let area = half_area(&bounds);
        Summary {
            bounds,
            area,
            cost: area,
            height: 0,
            count: 1,
        }
    }

    /// Of a child in a slice of nodes that begins at `base`.
    fn summary(&self, link: Link, nodes: &[Node], base: u32) -> Summary {
        match link {
            Link::Primitive(place) => self.primitive(place),
            Link::Inner(node) => nodes[(node - base) as usize].summary,
        }
    }

    fn merged(&self, [a, b]: [Summary; 2]) -> Summary {
        let bounds = a.bounds.union(b.bounds);
        let area = half_area(&bounds);
        let count = a.count + b.count;
        let split_cost = area + (a.cost + b.cost);
        let leaf_cost = area * count as f32;
        let is_leaf = self
            .settings
            .leaves
            .makes_leaf(count, leaf_cost, split_cost, count == self.total);
        Summary {
            bounds,
            area,
            cost: if is_leaf { leaf_cost } else { split_cost },
            height: a.height.max(b.height) + 1,
            count,
        }
    }

    /// Works on the subtree that is all of `nodes`, the first of them its root, whose index is `base` and whose depth is `depth`.
    fn subtree(&self, nodes: &mut [Node], base: u32, depth: u32) {
        let Some((root, below)) = nodes.split_first_mut() else {
            return;
        };
        let left_count = match root.children {
            [Link::Inner(_), Link::Inner(right)] => (right - base - 1) as usize,
            [Link::Inner(_), _] => below.len(),
            _ => 0,
        };
        let (left_base, right_base) = (base + 1, base + 1 + left_count as u32);
        let (left, right) = below.split_at_mut(left_count);
        if left.len() + right.len() > PARALLEL_NODES {
            rayon::join(
                || self.subtree(left, left_base, depth + 1),
                || self.subtree(right, right_base, depth + 1),
            );
        } else {
            self.subtree(left, left_base, depth + 1);
            self.subtree(right, right_base, depth + 1);
        }
        let children = nodes[0].children.map(|c| self.summary(c, nodes, base));
        nodes[0].summary = self.merged(children);
        self.treelet(nodes, base, self.settings.max_depth + 1 - depth);
    }

    /// Rearranges the treelet below the first node, if that lowers the cost and keeps the height.
    fn treelet(&self, nodes: &mut [Node], base: u32, max_height: u32) {
        let mut inner = [0u32; MAX_TREELET];
        let mut links = [Link::Primitive(0); MAX_TREELET];
        let mut leaves = [nodes[0].summary; MAX_TREELET];
        (links[0], links[1]) = (nodes[0].children[0], nodes[0].children[1]);
        let mut count = 2;
        leaves[0] = self.summary(links[0], nodes, base);
        leaves[1] = self.summary(links[1], nodes, base);
        while count < self.settings.treelet {
            // The largest that can be opened; of equal ones the first.
            let mut largest: Option<(usize, u32)> = None;
            for (i, link) in links[..count].iter().enumerate() {
                if let Link::Inner(node) = *link
                    && largest.is_none_or(|(l, _)| leaves[i].area > leaves[l].area)
                {
                    largest = Some((i, node));
                }
            }
            let Some((opened, node)) = largest else {
                break;
            };
            let children = nodes[(node - base) as usize].children;
            inner[count - 1] = node;
            links[opened] = children[0];
            links[count] = children[1];
            leaves[opened] = self.summary(children[0], nodes, base);
            leaves[count] = self.summary(children[1], nodes, base);
            count += 1;
        }
        if count < 3 {
            return;
        }
        let mut merged = [nodes[0]; MAX_TREELET];
        self.agglomerate(&mut links, &mut leaves, count, &inner, &mut merged);
        let new = leaves[0];
        if new.cost < nodes[0].summary.cost && new.height <= max_height {
            for slot in 1..count - 1 {
                nodes[(inner[slot] - base) as usize] = merged[slot];
            }
            nodes[0] = merged[0];
        }
    }

    /// Merges the nearest pair until one is left, which then stands first. The k-th merge from the end takes the k-th inner node.
    fn agglomerate(
        &self,
        links: &mut [Link; MAX_TREELET],
        leaves: &mut [Summary; MAX_TREELET],
        mut count: usize,
        inner: &[u32; MAX_TREELET],
        merged: &mut [Node; MAX_TREELET],
    ) {
        let distance = |a: &Summary, b: &Summary| half_area(&a.bounds.union(b.bounds));
        let mut distances = [[f32::INFINITY; MAX_TREELET]; MAX_TREELET];
        for i in 1..count {
            for j in 0..i {
                distances[i][j] = distance(&leaves[i], &leaves[j]);
            }
        }
        while count > 1 {
            let (mut a, mut b) = (0, 1);
            for (i, row) in distances[..count].iter().enumerate() {
                for (j, d) in row[..i].iter().enumerate() {
                    if *d < distances[b][a] {
                        (a, b) = (j, i);
                    }
                }
            }
            let slot = count - 2;
            merged[slot] = Node {
                children: [links[a], links[b]],
                summary: self.merged([leaves[a], leaves[b]]),
            };
            // The pair's node takes the place of its first, and the last moves to that of its second.
            count -= 1;
            (links[b], leaves[b]) = (links[count], leaves[count]);
            links[a] = Link::Inner(inner[slot]);
            leaves[a] = merged[slot].summary;
            for i in 0..count {
                for changed in [a, b] {
                    if i != changed && changed < count {
                        distances[i.max(changed)][i.min(changed)] = distance(&leaves[i], &leaves[changed]);
                    }
                }
            }
        }
    }

    /// The tree as others read it.
    fn finish(&self, tree: &BoxTree, nodes: &[Node]) -> BoxTree {
        let child = |link| match link {
            Link::Primitive(first) => Child::Leaf { first, count: 1 },
            Link::Inner(node) => Child::Inner(node),
        };
        let pair = |node: &Node| PairNode {
            bounds: node.children.map(|link| match link {
                Link::Primitive(place) => self.boxes[place as usize],
                Link::Inner(node) => nodes[node as usize].summary.bounds,
            }),
            children: node.children.map(child),
        };
        BoxTree {
            order: tree.order.clone(),
            nodes: nodes.par_iter().map(pair).collect(),
            bounds: tree.bounds,
            root: Child::Inner(0),
        }
    }
}
