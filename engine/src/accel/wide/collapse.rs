//! A binary tree made wide: which of its nodes become nodes of eight slots and which become leaves, by least cost.
//!
//! Source: Ylitie, Karras and Laine, HPG 2017, §3.1. Cost: half the areas of nodes, and those of leaves times their triangles times the cost of a
//! test, in the f32 of the kernels. `costs[n][i]` is the least cost of a subtree as at most i + 1 slots of the node above; bottom-up first, then the
//! choices that lead to the least cost are found again from the root on.
//!
//! Guarantee: nodes, triangles and bytes follow from the binary tree alone. Twin of the kernels `wide_costs` and `wide_collapse`.

use super::frame::set_boxes;
use super::slots::{Placed, assign};
use super::{LEAF_SIZE, SLOTS, WideBvh, WideNode};
use crate::accel::bvh2::{Bvh2, Bvh2Node, Bvh2Triangle, COUNT_BITS, COUNT_MASK};
use crate::accel::leaf_rule::half_area;
use crate::accel::stages::Stopwatch;
use crate::accel::{Aabb, NO_HIT, RayIndex};
use crate::gpu::shaders::constants;
use crate::{Error, Result};
use bytemuck::Zeroable;

/// Costs of a subtree by the number of slots that it may take, from one on.
type Costs = [f32; SLOTS - 1];

/// A child of a binary node: its word and its box.
#[derive(Debug, Clone, Copy)]
struct Subtree {
    word: u32,
    bounds: Aabb,
}

impl Subtree {
    /// The inner node, unless it is a leaf.
    fn node(&self) -> Option<usize> {
        (self.word & COUNT_MASK == 0).then_some((self.word >> COUNT_BITS) as usize)
    }
}

fn children(node: &Bvh2Node) -> [Subtree; 2] {
    [0, 1].map(|side: usize| Subtree {
        word: node.children[side],
        bounds: node.bounds[side].without_negative_zero(),
    })
}

/// The box of a binary node.
fn bounds_of(node: &Bvh2Node) -> Aabb {
    let [a, b] = node.bounds.map(Aabb::without_negative_zero);
    a.union(b)
}

/// The binary tree with the costs of its subtrees.
pub(super) struct Collapse<'a> {
    nodes: &'a [Bvh2Node],
    /// Triangles below each node, exact up to one above [`LEAF_SIZE`].
    counts: Vec<u32>,
    costs: Vec<Costs>,
    triangle_cost: f32,
    /// Slots of a node, at most [`SLOTS`].
    width: usize,
}

impl<'a> Collapse<'a> {
    /// Of a tree of two triangles or more.
    pub(super) fn of(nodes: &'a [Bvh2Node], triangle_cost: f32, width: usize) -> Self {
        let mut collapse = Self {
            nodes,
            counts: vec![0; nodes.len()],
            costs: vec![[0.0; SLOTS - 1]; nodes.len()],
            triangle_cost,
            width,
        };
        for index in parents_first(nodes).into_iter().rev() {
            let node = &nodes[index];
            let both = children(node);
            let count = both.iter().map(|child| collapse.count(child)).sum::<u32>();
            let costs = both.map(|child| collapse.costs_of(&child));
            let area = half_area(&bounds_of(node));
            let own = &mut collapse.costs[index];
            own[0] = (area + distribute(&costs, width).0).min(leaf_cost(area, count, triangle_cost));
            for slots in 2..width {
                own[slots - 1] = own[slots - 2].min(distribute(&costs, slots).0);
            }
            collapse.counts[index] = count.min(LEAF_SIZE + 1);
        }
        collapse
    }

    fn count(&self, subtree: &Subtree) -> u32 {
        match subtree.node() {
            Some(node) => self.counts[node],
            None => subtree.word & COUNT_MASK,
        }
    }

    fn costs_of(&self, subtree: &Subtree) -> Costs {
        match subtree.node() {
            Some(node) => self.costs[node],
            None => [leaf_cost(half_area(&subtree.bounds), self.count(subtree), self.triangle_cost); SLOTS - 1],
        }
    }

    /// Least cost of the whole tree under a root that is a node.
    #[cfg(test)]
    pub(super) fn root_cost(&self) -> f32 {
        let costs = children(&self.nodes[0]).map(|child| self.costs_of(&child));
        half_area(&bounds_of(&self.nodes[0])) + distribute(&costs, self.width).0
    }

    /// What the slots of a node hold, as they come from left to right.
    fn slots_of(&self, node: usize, found: &mut Vec<Subtree>) {
        found.clear();
        self.split(node, self.width, found);
    }

    /// A node's children in so many slots.
    fn split(&self, node: usize, slots: usize, found: &mut Vec<Subtree>) {
        let both = children(&self.nodes[node]);
        let left = distribute(&both.map(|child| self.costs_of(&child)), slots).1;
        self.place(&both[0], left, found);
        self.place(&both[1], slots - left, found);
    }

    /// A subtree in at most so many slots.
    fn place(&self, subtree: &Subtree, slots: usize, found: &mut Vec<Subtree>) {
        let Some(node) = subtree.node() else {
            found.push(*subtree);
            return;
        };
        // As few as cost as little.
        let costs = &self.costs[node];
        let fewest = (1..=slots).find(|n| costs[n - 1] <= costs[slots - 1]).unwrap_or(slots);
        match fewest {
            1 => found.push(*subtree),
            slots => self.split(node, slots, found),
        }
    }

    /// Whether a subtree in one slot is a leaf.
    fn is_leaf(&self, subtree: &Subtree) -> bool {
        let Some(node) = subtree.node() else {
            return true;
        };
        let area = half_area(&subtree.bounds);
        leaf_cost(area, self.counts[node], self.triangle_cost) <= self.costs[node][0]
    }

    /// Words of the leaves below a subtree, from left to right.
    fn leaves(&self, subtree: &Subtree, mut visit: impl FnMut(u32)) {
        let mut pending = vec![*subtree];
        while let Some(next) = pending.pop() {
            match next.node() {
                Some(node) => pending.extend(children(&self.nodes[node]).into_iter().rev()),
                None => visit(next.word),
            }
        }
    }
}

/// Nodes of a tree, parents before their children.
fn parents_first(nodes: &[Bvh2Node]) -> Vec<usize> {
    let mut order = Vec::with_capacity(nodes.len());
    let mut pending = vec![0];
    while let Some(node) = pending.pop() {
        order.push(node);
        pending.extend(children(&nodes[node]).iter().filter_map(Subtree::node));
    }
    order
}

/// Cost of a leaf; none of too many triangles.
fn leaf_cost(area: f32, count: u32, triangle_cost: f32) -> f32 {
    if count <= LEAF_SIZE {
        area * count as f32 * triangle_cost
    } else {
        f32::INFINITY
    }
}

/// Least cost of two subtrees in so many slots, two or more, and how many of these are for the first.
fn distribute(costs: &[Costs; 2], slots: usize) -> (f32, usize) {
    let cost = |left: usize| costs[0][left - 1] + costs[1][slots - left - 1];
    let mut best = (cost(1), 1);
    for left in 2..slots {
        if cost(left) < best.0 {
            best = (cost(left), left);
        }
    }
    best
}

/// A slot before it is written.
struct Slot {
    bounds: Aabb,
    /// Of a child node; where it is a leaf, its triangles.
    node: Option<usize>,
    triangles: [u32; LEAF_SIZE as usize],
    count: usize,
}

/// The wide tree as it is written.
struct Writer<'a> {
    binary: &'a [Bvh2Triangle],
    nodes: Vec<WideNode>,
    triangles: Vec<Bvh2Triangle>,
}

impl Writer<'_> {
    /// Fills a node, and makes room for its children, whose binary nodes and places it returns in the order of slots.
    fn fill(&mut self, place: usize, bounds: &Aabb, slots: &[Slot]) -> Vec<(usize, usize)> {
        let placed: Vec<Placed> = slots.iter().map(|slot| (slot.bounds, slot.node.is_some())).collect();
        let assigned = assign(0.5 * bounds.lower + 0.5 * bounds.upper, &placed);
        let boxes = slots
            .iter()
            .zip(assigned)
            .map(|(slot, at)| (usize::from(at), slot.bounds));
        let mut node = WideNode {
            children: self.nodes.len() as u32,
            triangles: self.triangles.len() as u32,
            ..self.nodes[place]
        };
        set_boxes(&mut node, bounds, boxes);
        let mut below = Vec::new();
        for at in 0..SLOTS {
            let Some(slot) = (0..slots.len())
                .find(|i| usize::from(assigned[*i]) == at)
                .map(|i| &slots[i])
            else {
                continue;
            };
            if let Some(child) = slot.node {
                node.slots |= 1 << (constants::WIDE_INNER_SHIFT as usize + at);
                below.push((child, self.nodes.len()));
                self.nodes.push(WideNode {
                    parent: (place as u32) << constants::WIDE_SLOT_BITS | at as u32,
                    ..WideNode::zeroed()
                });
            } else {
                node.slots |= ((1 << slot.count) - 1) << (LEAF_SIZE as usize * at);
                let own = &slot.triangles[..slot.count];
                self.triangles.extend(own.iter().map(|i| self.binary[*i as usize]));
            }
        }
        self.nodes[place] = node;
        below
    }
}

/// Refuses a tree whose leaves are larger than slots.
pub(super) fn check_leaves(binary: &Bvh2) -> Result<()> {
    let words = binary.nodes().iter().flat_map(|node| node.children);
    match words.map(|word| word & COUNT_MASK).max() {
        Some(size) if size > LEAF_SIZE => {
            let cause = format!("is above {LEAF_SIZE}, the most of a wide tree");
            Err(Error::setting("leaf size", size, cause))
        }
        _ => Ok(()),
    }
}

/// The tree of nodes that have `width` slots at most.
pub(super) fn collapse(binary: &Bvh2, triangle_cost: f32, width: usize) -> Result<WideBvh> {
    check_leaves(binary)?;
    let mut watch = Stopwatch::start();
    let mut statistics = binary.statistics();
    let mut stages = binary.stages();
    let mut writer = Writer {
        binary: binary.triangles(),
        nodes: vec![WideNode::zeroed()],
        triangles: Vec::with_capacity(binary.triangles().len()),
    };
    let [a, b] = binary.nodes()[0].bounds.map(Aabb::without_negative_zero);
    let mut bounds = a.union(b);
    if statistics.triangles >= 2 {
        let tree = Collapse::of(binary.nodes(), triangle_cost, width);
        statistics.max_depth = write(&tree, &mut writer);
    } else {
        // The binary tree has a sentinel beside one triangle or none.
        let met: Vec<u32> = (0u32..)
            .zip(binary.triangles())
            .filter(|(_, t)| t.index != NO_HIT)
            .map(|(i, _)| i)
            .collect();
        bounds = met.first().map_or(b, |_| a);
        let slots: Vec<Slot> = met
            .iter()
            .map(|i| Slot {
                bounds,
                node: None,
                triangles: [*i; LEAF_SIZE as usize],
                count: 1,
            })
            .collect();
        writer.fill(0, &bounds, &slots);
        statistics.max_depth = 1;
    }
    stages.layout += watch.lap();
    let Writer { nodes, triangles, .. } = writer;
    Ok(WideBvh::assembled(&nodes, &triangles, &bounds, statistics, stages))
}

/// Nodes depth first, children of one node side by side. The depth.
fn write(tree: &Collapse<'_>, writer: &mut Writer<'_>) -> u32 {
    let mut deepest = 0;
    let mut pending = vec![(0, 0, 1)];
    let mut found = Vec::with_capacity(SLOTS);
    while let Some((node, place, depth)) = pending.pop() {
        deepest = deepest.max(depth);
        tree.slots_of(node, &mut found);
        let slots: Vec<Slot> = found.iter().map(|subtree| slot_of(tree, subtree)).collect();
        let below = writer.fill(place, &bounds_of(&tree.nodes[node]), &slots);
        pending.extend(below.into_iter().rev().map(|(node, place)| (node, place, depth + 1)));
    }
    deepest
}

fn slot_of(tree: &Collapse<'_>, subtree: &Subtree) -> Slot {
    let mut slot = Slot {
        bounds: subtree.bounds,
        node: None,
        triangles: [0; LEAF_SIZE as usize],
        count: 0,
    };
    if !tree.is_leaf(subtree) {
        slot.node = subtree.node();
        return slot;
    }
    tree.leaves(subtree, |word| {
        let first = word >> COUNT_BITS;
        for triangle in first..first + (word & COUNT_MASK) {
            slot.triangles[slot.count] = triangle;
            slot.count += 1;
        }
    });
    slot
}
