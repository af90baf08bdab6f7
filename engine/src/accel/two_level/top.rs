//! The tree above: a wide tree over the boxes of instances.
//!
//! Its binary tree is that of [`hierarchy_of`](crate::accel::lbvh::hierarchy_of), optimised, with one instance a leaf; a node takes the children of its largest children until it
//! has eight (I. Wald, C. Benthin, S. Boulos, "Getting Rid of Packets", IEEE RT 2008).

use crate::accel::Aabb;
use crate::accel::box_tree::{BoxTree, Child};
use crate::accel::lbvh::{LbvhSettings, hierarchy_of};
use crate::accel::wide::frame::set_boxes;
use crate::accel::wide::slots::assign;
use crate::accel::wide::{SLOTS, WideNode};
use crate::gpu::shaders::constants;
use bytemuck::Zeroable;
use glam::Vec3;

/// The tree over instances.
pub(super) struct Top {
    /// Inner nodes and, in the places of instances, nodes with nothing but their parents.
    pub nodes: Vec<WideNode>,
    /// The node that stands for each instance.
    pub places: Vec<u32>,
    /// Box of all; a point at the origin without instances.
    pub bounds: Aabb,
    /// Inner nodes on the longest way.
    pub depth: u32,
    /// Sum of the half areas of what slots hold, m².
    pub area: f64,
}

/// The most nodes over so many instances.
pub(super) fn capacity(instances: usize) -> usize {
    (2 * instances).max(1)
}

/// Builds over the instances' boxes. The same whatever the number of threads.
pub(super) fn build(boxes: &[Aabb], settings: &LbvhSettings) -> Top {
    let boxes: Vec<Aabb> = boxes.iter().map(|bounds| bounds.without_negative_zero()).collect();
    let mut top = Top {
        nodes: vec![WideNode::zeroed()],
        places: vec![0; boxes.len()],
        bounds: boxes.iter().copied().reduce(Aabb::union).unwrap_or(Aabb {
            lower: Vec3::ZERO,
            upper: Vec3::ZERO,
        }),
        depth: 1,
        area: 0.0,
    };
    match boxes.len() {
        0 => {}
        1 => {
            let bounds = top.bounds;
            top.fill(
                0,
                &bounds,
                &[Slot {
                    bounds,
                    child: Child::Leaf { first: 0, count: 1 },
                }],
                &[0],
            );
        }
        _ => {
            let settings = LbvhSettings {
                leaf_size: 1,
                ..*settings
            };
            top.collapse(&hierarchy_of(&boxes, &settings));
        }
    }
    top
}

#[derive(Clone, Copy)]
struct Slot {
    bounds: Aabb,
    child: Child,
}

impl Top {
    fn collapse(&mut self, tree: &BoxTree) {
        let mut pending = vec![(tree.root, tree.bounds, 0, 1)];
        while let Some((subtree, bounds, place, depth)) = pending.pop() {
            self.depth = self.depth.max(depth);
            let Child::Inner(node) = subtree else { continue };
            let slots = opened(tree, node);
            let below = self.fill(place, &bounds, &slots, &tree.order);
            pending.extend(
                below
                    .into_iter()
                    .rev()
                    .map(|(slot, place)| (slot.child, slot.bounds, place, depth + 1)),
            );
        }
    }

    /// Fills a node, and makes places for what its slots hold. Child nodes, with their places.
    fn fill(&mut self, place: usize, bounds: &Aabb, slots: &[Slot], order: &[u32]) -> Vec<(Slot, usize)> {
        let placed: Vec<_> = slots
            .iter()
            .map(|slot| (slot.bounds, matches!(slot.child, Child::Inner(_))))
            .collect();
        let assigned = assign(0.5 * bounds.lower + 0.5 * bounds.upper, &placed);
        let mut node = WideNode {
            children: self.nodes.len() as u32,
            ..self.nodes[place]
        };
        let boxes = slots
            .iter()
            .zip(assigned)
            .map(|(slot, at)| (usize::from(at), slot.bounds));
        set_boxes(&mut node, bounds, boxes);
        let (mut instances, mut below) = (0u8, Vec::new());
        for at in 0..SLOTS {
            let Some(slot) = (0..slots.len())
                .find(|i| usize::from(assigned[*i]) == at)
                .map(|i| slots[i])
            else {
                continue;
            };
            node.slots |= 1 << (constants::WIDE_INNER_SHIFT as usize + at);
            let child = self.nodes.len();
            match slot.child {
                Child::Inner(_) => below.push((slot, child)),
                Child::Leaf { first, .. } => {
                    instances |= 1 << at;
                    self.places[order[first as usize] as usize] = child as u32;
                }
            }
            self.area += slot.bounds.half_area();
            self.nodes.push(WideNode {
                parent: (place as u32) << constants::WIDE_SLOT_BITS | at as u32,
                ..WideNode::zeroed()
            });
        }
        node.exponents |= u32::from(instances) << constants::TWO_LEVEL_INSTANCE_SHIFT;
        self.nodes[place] = node;
        below
    }
}

/// What a node's slots hold, from left to right.
fn opened(tree: &BoxTree, node: u32) -> Vec<Slot> {
    let children = |node: u32| {
        let pair = &tree.nodes[node as usize];
        [0, 1].map(|side: usize| Slot {
            bounds: pair.bounds[side],
            child: pair.children[side],
        })
    };
    let mut slots = Vec::from(children(node));
    while slots.len() < SLOTS {
        let mut largest: Option<(f64, usize, u32)> = None;
        for (i, slot) in slots.iter().enumerate() {
            if let Child::Inner(inner) = slot.child {
                let area = slot.bounds.half_area();
                if largest.is_none_or(|(most, ..)| area > most) {
                    largest = Some((area, i, inner));
                }
            }
        }
        let Some((_, i, inner)) = largest else { break };
        slots.splice(i..=i, children(inner));
    }
    slots
}
