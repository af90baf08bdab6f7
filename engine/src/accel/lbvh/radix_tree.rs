//! The hierarchy of sorted Morton codes: at each node the codes split where their highest differing bit changes.
//!
//! Source: C. Apetrei, "Fast and Simple Agglomerative LBVH Construction", EG UK CGVC 2014: a node is named by the last place of its left
//! child, and of the two places at its ends a range joins the one whose codes differ in the lower bit. Equal codes are told apart by their
//! places, as in T. Karras, "Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees", HPG 2012. Here the top of the
//! same tree is made from the root down, so that threads need no atomic operations, and what is below is merged in one run over the
//! places, on a stack; the kernels climb from the leaves, and tests hold both together.
//!
//! Guarantee: twin of the kernels `lbvh_hierarchy` and `lbvh_emit` to the bit; the same tree whatever the number of threads; depth as
//! asked for, see [`hierarchy`].

use super::sort::sort_by_key;
use crate::accel::Aabb;
use crate::accel::box_tree::{BoxTree, Child, EMPTY_NODE, PairNode};
use crate::accel::bvh2::{Bvh2Node, COUNT_BITS, leaf_word};
use crate::accel::morton::{MORTON_30_AXIS_BITS, MortonGrid, doubled_centre};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use rayon::prelude::*;

/// Ranges above this are built in parallel.
const PARALLEL_RANGE: usize = 4096;

/// Slots that a task numbers and moves.
const CHUNK: usize = 2048;

/// In a slot, marks a child that is a leaf.
const LEAF: u32 = 1 << 31;

/// Level of a place whose code differs from the next in the lowest bit; where the codes are equal, places decide at the levels below.
const CODE_LEVEL: u8 = 32;

/// Level beyond the ends, above all others.
const NO_LEVEL: u8 = u8::MAX;

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
        Codes::of_boxes(boxes, axis_bits).sorted()
    }

    /// How the codes at a place and the next differ when their lowest `skipped` bits do not count: larger where a higher bit differs.
    #[cfg(test)]
    pub(crate) fn difference(&self, place: usize, skipped: u32) -> (u64, u32) {
        let codes = (self.codes[place] ^ self.codes[place + 1]) >> skipped;
        (codes, (place ^ (place + 1)) as u32)
    }

    /// How far up the codes at a place and the next differ when their lowest `skipped` bits do not count.
    fn level(&self, place: usize, skipped: u32) -> u8 {
        match (self.codes[place] ^ self.codes[place + 1]) >> skipped {
            0 => (place ^ (place + 1)).ilog2() as u8,
            differing => CODE_LEVEL + differing.ilog2() as u8,
        }
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

/// Codes in the order of what they are of.
pub(super) enum Codes {
    /// Of 30 bits, in the high words; the low ones are indices.
    Short(Vec<u64>),
    /// Longer ones, with indices.
    Long(Vec<(u64, u32)>, u32),
}

impl Codes {
    pub(super) fn of_boxes(boxes: &[Aabb], axis_bits: u32) -> Self {
        let centres = boxes
            .par_iter()
            .fold(|| Aabb::EMPTY, |bounds, b| bounds.with_point(doubled_centre(b)))
            .reduce(|| Aabb::EMPTY, Aabb::union);
        let grid = MortonGrid::new(&centres, axis_bits);
        let code = |b: &Aabb| grid.code(doubled_centre(b));
        let boxes = boxes.par_iter().enumerate();
        if axis_bits == MORTON_30_AXIS_BITS {
            Self::Short(boxes.map(|(i, b)| code(b) << 32 | i as u64).collect())
        } else {
            Self::Long(boxes.map(|(i, b)| (code(b), i as u32)).collect(), 3 * axis_bits)
        }
    }

    pub(super) fn sorted(self) -> SortedCodes {
        let (codes, order, bits) = match self {
            Self::Short(mut pairs) => {
                let bits = 3 * MORTON_30_AXIS_BITS;
                sort_by_key(&mut pairs, bits, |pair| pair >> 32);
                let (codes, order) = pairs.par_iter().map(|pair| (pair >> 32, *pair as u32)).unzip();
                (codes, order, bits)
            }
            Self::Long(mut pairs, bits) => {
                sort_by_key(&mut pairs, bits, |pair| pair.0);
                let (codes, order) = pairs.into_par_iter().unzip();
                (codes, order, bits)
            }
        };
        SortedCodes { codes, order, bits }
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

/// The node between two neighbouring places: its slot is the first of both.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Slot {
    bounds: [Aabb; 2],
    /// Slots of inner nodes. Of leaves [`LEAF`] and the end that is not at this node: first place of the left, last of the right child.
    children: [u32; 2],
    /// Slot of the parent × 2 + which of its children this is.
    parent: u32,
}

/// Words of a slot.
const SLOT_WORDS: usize = size_of::<Slot>() / 4;

/// A finished subtree.
#[derive(Debug, Clone, Copy)]
struct Built {
    bounds: Aabb,
    first: u32,
    last: u32,
    /// Slot of its root; of a leaf [`LEAF`].
    slot: u32,
    cost: f32,
    height: u32,
}

impl Built {
    /// What the parent at `slot` says of it.
    fn word(&self, side: usize) -> u32 {
        match (self.slot, side) {
            (LEAF, 0) => LEAF | self.first,
            (LEAF, _) => LEAF | self.last,
            (slot, _) => slot,
        }
    }
}

fn leaf(place: u32, bounds: Aabb) -> Built {
    Built {
        bounds,
        first: place,
        last: place,
        slot: LEAF,
        cost: half_area(&bounds),
        height: 0,
    }
}

/// What all ranges share.
struct Builder<'a> {
    sorted: &'a SortedCodes,
    boxes: &'a [Aabb],
    /// Of each place and the next.
    levels: &'a [u8],
    rule: LeafRule,
    skipped: u32,
}

/// The hierarchy over boxes, of which `sorted` has the codes, at most `max_depth` inner nodes deep.
///
/// Where it would be deeper, the lowest bits of the codes are left out of account, as many as it takes, and the places in the order
/// decide below that; without any bits it is ⌈log₂ n⌉ deep, which `max_depth` must allow. Nodes are in the order of their splits but for
/// the root, which is the first. At most 2³¹ boxes.
pub fn hierarchy(boxes: &[Aabb], sorted: &SortedCodes, rule: LeafRule, max_depth: u32) -> BoxTree {
    match Splits::build(boxes, sorted, rule, max_depth) {
        Some(splits) => splits.tree(sorted.order.clone()),
        None => BoxTree::single_leaf(Vec::new(), Aabb::EMPTY),
    }
}

/// A hierarchy with its nodes where their splits are.
pub(super) struct Splits {
    /// Slots, by words.
    words: Vec<[u32; SLOT_WORDS]>,
    /// Of each slot 0 if it lies inside of a leaf, otherwise 1, and in the end 1 + where its node goes.
    targets: Vec<u32>,
    root: Built,
    /// Nodes outside of leaves, by chunks of slots.
    kept: Vec<usize>,
}

/// A range of slots that a task fills.
struct Slots<'a> {
    slots: &'a mut [Slot],
    targets: &'a mut [u32],
}

impl<'a> Slots<'a> {
    /// Those before a slot and those behind it.
    fn around(&mut self, slot: usize) -> [Slots<'_>; 2] {
        let (left, right) = self.slots.split_at_mut(slot);
        let (left_targets, right_targets) = self.targets.split_at_mut(slot);
        let before = Slots {
            slots: left,
            targets: left_targets,
        };
        let behind = Slots {
            slots: &mut right[1..],
            targets: &mut right_targets[1..],
        };
        [before, behind]
    }
}

impl Splits {
    /// As [`hierarchy`]; `None` for no boxes.
    pub(super) fn build(boxes: &[Aabb], sorted: &SortedCodes, rule: LeafRule, max_depth: u32) -> Option<Self> {
        let inner = sorted.order.len().checked_sub(1)?;
        let mut skipped = 0;
        loop {
            let mut words = vec![[0; SLOT_WORDS]; inner];
            let mut targets = vec![0; inner];
            let levels: Vec<u8> = (0..inner).into_par_iter().map(|i| sorted.level(i, skipped)).collect();
            let builder = Builder {
                sorted,
                boxes,
                levels: &levels,
                rule,
                skipped,
            };
            let mut slots = Slots {
                slots: bytemuck::cast_slice_mut(&mut words),
                targets: &mut targets,
            };
            let root = builder.range(0, inner, &mut slots);
            if root.height <= max_depth || skipped >= sorted.bits {
                let mut splits = Self {
                    words,
                    targets,
                    root,
                    kept: Vec::new(),
                };
                splits.number();
                return Some(splits);
            }
            skipped = next_skipped(skipped, root.height, max_depth, sorted.bits);
        }
    }

    fn slots(&self) -> &[Slot] {
        bytemuck::cast_slice(&self.words)
    }

    /// Nodes outside of leaves.
    pub(super) fn nodes(&self) -> usize {
        self.kept.iter().sum()
    }

    /// Most inner nodes on a way from the root.
    pub(super) fn depth(&self) -> u32 {
        self.root.height
    }

    /// Gives each node that stays its place: the root the first, the others by their slots.
    fn number(&mut self) {
        let staying = |targets: &[u32]| targets.iter().map(|target| *target as usize).sum();
        self.kept = self.targets.par_chunks(CHUNK).map(staying).collect();
        let before: Vec<usize> = self
            .kept
            .iter()
            .scan(0, |sum, kept| Some(std::mem::replace(sum, *sum + kept)))
            .collect();
        let root = self.root.slot as usize;
        let chunks = self.targets.par_chunks_mut(CHUNK).zip(before).enumerate();
        chunks.for_each(|(chunk, (targets, before))| {
            let stay = targets.iter_mut().enumerate().filter(|(_, target)| **target != 0);
            for (rank, (i, target)) in (before as u32..).zip(stay) {
                let at = chunk * CHUNK + i;
                // Of those before the root one place is the root's, of those behind it the root is counted.
                *target = if at == root { 1 } else { rank + 1 + u32::from(at < root) };
            }
        });
    }

    /// Makes a node of each slot that stays, and puts it where it goes.
    fn emit<T: Send>(&self, nodes: &mut [T], node: impl Fn(usize, &Slot) -> T + Sync) {
        let slots = self.slots();
        let root = self.root.slot as usize;
        let Some((first, mut rest)) = nodes.split_first_mut() else {
            return;
        };
        *first = node(root, &slots[root]);
        let mut targets = Vec::with_capacity(self.kept.len());
        for (chunk, kept) in self.kept.iter().enumerate() {
            let (own, after) = rest.split_at_mut(kept - usize::from(root / CHUNK == chunk));
            targets.push(own);
            rest = after;
        }
        let chunks = slots.par_chunks(CHUNK).zip(targets).enumerate();
        chunks.for_each(|(chunk, (slots, targets))| {
            let all = (chunk * CHUNK..).zip(slots);
            let kept = all.filter(|(at, _)| self.targets[*at] != 0 && *at != root);
            for (to, (at, slot)) in targets.iter_mut().zip(kept) {
                *to = node(at, slot);
            }
        });
    }

    /// A child of the node in a slot.
    fn child(&self, at: usize, side: usize, word: u32) -> Child {
        let (at, end) = (at as u32, word & !LEAF);
        match (word & LEAF, side) {
            (0, _) => Child::Inner(self.targets[word as usize] - 1),
            (_, 0) => Child::Leaf {
                first: end,
                count: at - end + 1,
            },
            _ => Child::Leaf {
                first: at + 1,
                count: end - at,
            },
        }
    }

    fn tree(&self, order: Vec<u32>) -> BoxTree {
        if self.root.slot == LEAF {
            return BoxTree::single_leaf(order, self.root.bounds);
        }
        let mut nodes = vec![EMPTY_NODE; self.nodes()];
        self.emit(&mut nodes, |at, slot| PairNode {
            bounds: slot.bounds,
            children: [0, 1].map(|side| self.child(at, side, slot.children[side])),
        });
        BoxTree {
            order,
            nodes,
            bounds: self.root.bounds,
            root: Child::Inner(0),
        }
    }

    /// The nodes in the layout of rays; the root must not be a leaf, and leaves must be small enough for their words.
    pub(super) fn emit_nodes(&self, nodes: &mut [Bvh2Node]) {
        let target = |slot: u32| self.targets[slot as usize] - 1;
        self.emit(nodes, |at, slot| Bvh2Node {
            bounds: slot.bounds,
            children: [0, 1].map(|side| match self.child(at, side, slot.children[side]) {
                Child::Leaf { first, count } => leaf_word(first, count),
                Child::Inner(node) => node << COUNT_BITS,
            }),
            parent: if at == self.root.slot as usize {
                0
            } else {
                target(slot.parent >> 1) << 1 | slot.parent & 1
            },
            triangles: 0,
        });
    }
}

/// Bits to leave out after a tree that was too deep: each takes a level at most.
pub(crate) fn next_skipped(skipped: u32, height: u32, max_depth: u32, bits: u32) -> u32 {
    (skipped + height - max_depth).min(bits)
}

impl Builder<'_> {
    /// Builds a range, both ends included; its slots begin with that of its first place.
    fn range(&self, first: usize, last: usize, slots: &mut Slots) -> Built {
        if last - first <= PARALLEL_RANGE {
            return self.run(first, last, slots);
        }
        let split = self.sorted.split(first, last, self.skipped);
        let [mut left_slots, mut right_slots] = slots.around(split - first);
        let left = || self.range(first, split, &mut left_slots);
        let right = || self.range(split + 1, last, &mut right_slots);
        let (left, right) = rayon::join(left, right);
        self.merge(&left, &right, first as u32, slots)
    }

    /// As [`Builder::range`] in one run over the places: whatever lies lower than the level after a place is merged there.
    fn run(&self, first: usize, last: usize, slots: &mut Slots) -> Built {
        // In a loop of its own, so that several boxes are on their way from memory at once.
        let bounds: Vec<Aabb> = self.sorted.order[first..=last]
            .iter()
            .map(|i| self.boxes[*i as usize])
            .collect();
        let leaf = |place: usize| leaf(place as u32, bounds[place - first]);
        let mut pending: Vec<Built> = Vec::with_capacity(usize::from(NO_LEVEL));
        let mut top = leaf(first);
        for place in first..=last {
            let level = if place == last { NO_LEVEL } else { self.levels[place] };
            while let Some(left) = pending.pop_if(|left| self.levels[left.last as usize] < level) {
                top = self.merge(&left, &top, first as u32, slots);
            }
            if place < last {
                pending.push(top);
                top = leaf(place + 1);
            }
        }
        top
    }

    /// Joins two neighbouring ranges; `slots` begin with that of place `origin`.
    fn merge(&self, left: &Built, right: &Built, origin: u32, to: &mut Slots) -> Built {
        let bounds = left.bounds.union(right.bounds);
        let count = right.last - left.first + 1;
        let area = half_area(&bounds);
        let split_cost = area + (left.cost + right.cost);
        let leaf_cost = area * count as f32;
        let is_root = count as usize == self.sorted.order.len();
        let (first, last) = (left.first, right.last);
        if self.rule.makes_leaf(count, leaf_cost, split_cost, is_root) {
            // What a leaf holds does not stay.
            if left.slot != LEAF || right.slot != LEAF {
                to.targets[(first - origin) as usize..(last - origin) as usize].fill(0);
            }
            return Built {
                bounds,
                first,
                last,
                slot: LEAF,
                cost: leaf_cost,
                height: 0,
            };
        }
        let slot = left.last;
        for (side, child) in [left, right].into_iter().enumerate().filter(|(_, c)| c.slot != LEAF) {
            to.slots[(child.slot - origin) as usize].parent = slot << 1 | side as u32;
        }
        to.targets[(slot - origin) as usize] = 1;
        to.slots[(slot - origin) as usize] = Slot {
            bounds: [left.bounds, right.bounds],
            children: [left.word(0), right.word(1)],
            parent: 0,
        };
        Built {
            bounds,
            first,
            last,
            slot,
            cost: split_cost,
            height: left.height.max(right.height) + 1,
        }
    }
}
