//! The hierarchy of sorted Morton codes: at each node the codes split where their highest differing bit changes.
//!
//! Source: C. Apetrei, "Fast and Simple Agglomerative LBVH Construction", EG UK CGVC 2014: a node is named by the last place of its left
//! child, and of the two places at its ends a range joins the one whose codes differ in the lower bit. Here the top of
//! the same tree is made from the root down, so that threads need no atomic operations, and what is below is merged in one run over the
//! places, on a stack; the kernels climb from the leaves, and tests hold both together.
//!
//! Guarantee: twin of the kernels `lbvh_hierarchy` and `lbvh_emit` to the bit; the same tree whatever the number of threads; depth as
//! asked for, see [`hierarchy`].

use super::codes::SortedCodes;
use crate::accel::box_tree::{BoxTree, Child, EMPTY_NODE, PairNode};
use crate::accel::bvh2::{Bvh2Node, COUNT_BITS, leaf_word};
use crate::accel::leaf_rule::half_area;
use crate::accel::{Aabb, LeafRule};
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

/// Ranges above this are built in parallel.
const PARALLEL_RANGE: usize = 4096;

/// Slots that a task numbers and moves.
const CHUNK: usize = 2048;

/// In a slot, marks a child that is a leaf.
const LEAF: u32 = 1 << 31;

/// Level beyond the ends, above all others.
const NO_LEVEL: u8 = u8::MAX;

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
    /// Of each slot 1 + the index of its node, 0 where it lies inside a leaf.
    node_numbers: Vec<u32>,
    root: Built,
    /// Nodes outside leaves, by chunks of slots.
    chunk_nodes: Vec<usize>,
}

/// A range of slots that a task fills.
struct Slots<'a> {
    slots: &'a mut [Slot],
    /// 1 for slots whose nodes stay, 0 for those inside leaves and those that are not filled yet.
    retained: &'a mut [u32],
}

impl<'a> Slots<'a> {
    /// Those before a slot and those behind it.
    fn around(&mut self, slot: usize) -> [Slots<'_>; 2] {
        let (left, right) = self.slots.split_at_mut(slot);
        let (left_retained, right_retained) = self.retained.split_at_mut(slot);
        let before = Slots {
            slots: left,
            retained: left_retained,
        };
        let behind = Slots {
            slots: &mut right[1..],
            retained: &mut right_retained[1..],
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
            let mut retained = vec![0; inner];
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
                retained: &mut retained,
            };
            let root = builder.range(0, inner, &mut slots);
            if root.height <= max_depth || skipped >= sorted.bits {
                return Some(Self::numbered(words, retained, root));
            }
            skipped = next_skipped(skipped, root.height, max_depth, sorted.bits);
        }
    }

    fn slots(&self) -> &[Slot] {
        bytemuck::cast_slice(&self.words)
    }

    /// Nodes outside leaves.
    pub(super) fn nodes(&self) -> usize {
        self.chunk_nodes.iter().sum()
    }

    /// Most inner nodes on a way from the root.
    pub(super) fn depth(&self) -> u32 {
        self.root.height
    }

    /// Numbers the nodes of retained slots: the root the first, the others by their slots.
    fn numbered(words: Vec<[u32; SLOT_WORDS]>, retained: Vec<u32>, root: Built) -> Self {
        let sum = |retained: &[u32]| retained.iter().map(|one| *one as usize).sum();
        let chunk_nodes: Vec<usize> = retained.par_chunks(CHUNK).map(sum).collect();
        let before: Vec<usize> = chunk_nodes
            .iter()
            .scan(0, |sum, nodes| Some(std::mem::replace(sum, *sum + nodes)))
            .collect();
        let root_slot = root.slot as usize;
        // In the same memory.
        let mut node_numbers = retained;
        let chunks = node_numbers.par_chunks_mut(CHUNK).zip(before).enumerate();
        chunks.for_each(|(chunk, (numbers, before))| {
            let retained = numbers.iter_mut().enumerate().filter(|(_, number)| **number != 0);
            for (rank, (i, number)) in (before as u32..).zip(retained) {
                let at = chunk * CHUNK + i;
                // Of those before the root the first number is the root's, of those behind it the root is counted.
                *number = if at == root_slot {
                    1
                } else {
                    rank + 1 + u32::from(at < root_slot)
                };
            }
        });
        Self {
            words,
            node_numbers,
            root,
            chunk_nodes,
        }
    }

    /// Makes a node of each retained slot, and puts it where its number says.
    fn emit<T: Send>(&self, nodes: &mut [T], node: impl Fn(usize, &Slot) -> T + Sync) {
        let slots = self.slots();
        let root = self.root.slot as usize;
        let Some((first, mut rest)) = nodes.split_first_mut() else {
            return;
        };
        *first = node(root, &slots[root]);
        let mut outputs = Vec::with_capacity(self.chunk_nodes.len());
        for (chunk, nodes) in self.chunk_nodes.iter().enumerate() {
            let (own, after) = rest.split_at_mut(nodes - usize::from(root / CHUNK == chunk));
            outputs.push(own);
            rest = after;
        }
        let chunks = slots.par_chunks(CHUNK).zip(outputs).enumerate();
        chunks.for_each(|(chunk, (slots, outputs))| {
            let all = (chunk * CHUNK..).zip(slots);
            let retained = all.filter(|(at, _)| self.node_numbers[*at] != 0 && *at != root);
            for (output, (at, slot)) in outputs.iter_mut().zip(retained) {
                *output = node(at, slot);
            }
        });
    }

    /// Index of the node of a retained slot.
    fn node_of(&self, slot: u32) -> u32 {
        self.node_numbers[slot as usize] - 1
    }

    /// A child of the node in a slot.
    fn child(&self, at: usize, side: usize, word: u32) -> Child {
        let (at, end) = (at as u32, word & !LEAF);
        match (word & LEAF, side) {
            (0, _) => Child::Inner(self.node_of(word)),
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
        self.emit(nodes, |at, slot| Bvh2Node {
            bounds: slot.bounds,
            children: [0, 1].map(|side| match self.child(at, side, slot.children[side]) {
                Child::Leaf { first, count } => leaf_word(first, count),
                Child::Inner(node) => node << COUNT_BITS,
            }),
            parent: if at == self.root.slot as usize {
                0
            } else {
                self.node_of(slot.parent >> 1) << 1 | slot.parent & 1
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
                to.retained[(first - origin) as usize..(last - origin) as usize].fill(0);
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
        to.retained[(slot - origin) as usize] = 1;
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
