//! Sibling pairs in half the bytes: of the twelve planes of two siblings six at most differ from their parent's, and only these are kept.
//!
//! Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §6.2. Boxes are tight, so each plane of the
//! parent is a plane of one child at least; the other child may have a plane of its own. A pair stores one plane for each of the parent's
//! six, and whose it is; the other child inherits. A point that a traversal has in the parent's box is thus tested against both children
//! by six comparisons, and a ray by what it carries of the parent's span.
//!
//! Guarantees: boxes are recovered to the bit; queries visit the leaves of [`CompleteBvh`] in the same order. Trees without tight boxes,
//! such as refitted ones before they are encoded anew, are refused.

use super::complete_bvh::{
    CompleteBvh, INDEX_BITS, LEAF_BIT, NO_PLANE, POINT_STACK_ENTRY_BYTES, QueryCounters, RayPair, RootDescriptor,
    STACK_SIZE, holds_inside, met, span_within,
};
use crate::accel::box_test::BoxTest;
use crate::accel::box_tree::TreeFault;
use crate::accel::{Aabb, Ray};
use crate::catalogue::{Role, Row, sources};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Bytes of a pair.
pub const COMPACT_PAIR_BYTES: u64 = size_of::<CompactPair>() as u64;

/// Bytes of a stack entry of a ray query: reference and span.
pub const COMPACT_RAY_STACK_ENTRY_BYTES: u64 = 12;

/// Where the mask of planes stands above index and leaf bit.
const MASK_SHIFT: u32 = INDEX_BITS + 1;

/// Two siblings (32 bytes). References hold an index of 28 bits, [`LEAF_BIT`], and above it a mask of the planes beside them, x in its highest
/// bit: 1 where the plane belongs to the left child.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct CompactPair {
    /// Lower planes, as bits of f32.
    pub lower: [u32; 3],
    /// Reference of the left child with the mask of the lower planes.
    pub left: u32,
    /// Upper planes.
    pub upper: [u32; 3],
    /// Reference of the right child with the mask of the upper planes.
    pub right: u32,
}

impl CompactPair {
    /// References of both children, without masks.
    pub fn references(&self) -> [u32; 2] {
        [self.left, self.right].map(|word| word & ((1 << MASK_SHIFT) - 1))
    }

    /// The six planes' owners: lower x, y, z, upper x, y, z from the highest bit; 1 for the left child.
    pub fn owners(&self) -> u32 {
        self.left >> MASK_SHIFT << 3 | self.right >> MASK_SHIFT
    }

    /// The stored planes: lower, upper.
    fn planes(&self) -> Aabb {
        Aabb {
            lower: Vec3::from_array(self.lower.map(f32::from_bits)),
            upper: Vec3::from_array(self.upper.map(f32::from_bits)),
        }
    }

    /// Boxes of both children, with the planes they inherit taken from `inherited`.
    pub fn children(&self, inherited: &Aabb) -> [Aabb; 2] {
        let (planes, owners) = (self.planes(), self.owners());
        [0, 1].map(|side| {
            let mut bounds = *inherited;
            for axis in 0..3 {
                let owned = |shift: usize| (owners >> shift & 1 == 1) == (side == 0);
                if owned(5 - axis) {
                    bounds.lower[axis] = planes.lower[axis];
                }
                if owned(2 - axis) {
                    bounds.upper[axis] = planes.upper[axis];
                }
            }
            bounds
        })
    }

    /// Which children a point in the parent's interior lies in: bit 0 left, bit 1 right.
    pub fn point_children(&self, point: Vec3) -> u32 {
        let planes = self.planes();
        let mut outside = 0;
        for axis in 0..3 {
            outside |= u32::from(planes.lower[axis] >= point[axis]) << (5 - axis);
            outside |= u32::from(planes.upper[axis] <= point[axis]) << (2 - axis);
        }
        let owners = self.owners();
        u32::from(owners & outside == 0) | u32::from(!owners & outside == 0) << 1
    }
}

/// A tree of compact pairs.
#[derive(Debug, Clone, PartialEq)]
pub struct CompactBvh {
    /// Where queries begin; its box must be tested first, since pairs inherit from it.
    pub root: RootDescriptor,
    /// Sibling pairs.
    pub pairs: Vec<CompactPair>,
}

impl CompactBvh {
    /// Encodes a complete tree.
    ///
    /// # Errors
    /// [`TreeFault::Plane`] for a pair whose boxes are not tight in their parent's.
    pub fn encode(complete: &CompleteBvh) -> Result<Self, TreeFault> {
        let mut pairs = vec![CompactPair::zeroed(); complete.pairs.len()];
        let mut pending = Vec::new();
        let descend = |reference: u32, bounds: Aabb, pending: &mut Vec<(u32, Aabb)>| {
            if reference & LEAF_BIT == 0 {
                pending.push((reference, bounds));
            }
        };
        if let Some(root) = complete.root.reference {
            descend(root, complete.root.bounds, &mut pending);
        }
        while let Some((place, bounds)) = pending.pop() {
            let pair = &complete.pairs[place as usize];
            pairs[place as usize] = encode_pair(pair, &bounds, place)?;
            for side in 0..2 {
                descend(pair.references[side], pair.bounds[side], &mut pending);
            }
        }
        Ok(Self {
            root: complete.root,
            pairs,
        })
    }

    /// The pairs with all their planes.
    pub fn decode(&self) -> Vec<RayPair> {
        let mut decoded = vec![RayPair::zeroed(); self.pairs.len()];
        let mut pending: Vec<(u32, Aabb)> = self.root.reference.map(|r| (r, self.root.bounds)).into_iter().collect();
        while let Some((reference, bounds)) = pending.pop() {
            if reference & LEAF_BIT != 0 {
                continue;
            }
            let pair = &self.pairs[reference as usize];
            let (references, children) = (pair.references(), pair.children(&bounds));
            decoded[reference as usize] = RayPair {
                bounds: children,
                references,
            };
            pending.extend(references.into_iter().zip(children));
        }
        decoded
    }

    /// Visits the leaves whose boxes hold a point in their interior; of two children it goes on with the right one and keeps the left.
    pub fn point_query(&self, point: Vec3, counters: &mut QueryCounters, mut visit: impl FnMut(u32)) {
        let mut next = self.root.reference.filter(|_| holds_inside(&self.root.bounds, point));
        let mut stack = [0; STACK_SIZE];
        let mut top = 0;
        while let Some(reference) = next {
            next = None;
            if reference & LEAF_BIT != 0 {
                counters.leaves += 1;
                visit(reference ^ LEAF_BIT);
            } else {
                let pair = &self.pairs[reference as usize];
                counters.nodes += 2;
                counters.bytes += COMPACT_PAIR_BYTES;
                let (inside, [left, right]) = (pair.point_children(point), pair.references());
                if inside == 3 {
                    stack[top] = left;
                    top += 1;
                    counters.pushes += 1;
                    counters.bytes += POINT_STACK_ENTRY_BYTES;
                }
                next = match inside {
                    0 => None,
                    1 => Some(left),
                    _ => Some(right),
                };
            }
            if next.is_none() && top > 0 {
                top -= 1;
                next = Some(stack[top]);
            }
        }
    }

    /// Visits the leaves that a ray meets, nearer child first; `visit` gets a leaf's first record and may draw the ray's end nearer. Spans
    /// are carried down and kept on the stack, since a pair does not have the planes it inherits.
    pub fn ray_query(&self, ray: &Ray, counters: &mut QueryCounters, mut visit: impl FnMut(u32, &mut f32)) {
        let Some(root) = self.root.reference.filter(|_| ray.is_traceable()) else {
            return;
        };
        let boxes = BoxTest::new(&self.root.bounds, ray);
        let mut t_max = ray.t_max;
        let span = span_within(&boxes, &self.root.bounds, [ray.t_min, t_max]);
        let mut next = met(span).then_some((root, span));
        let mut stack = [(0, [0.0; 2]); STACK_SIZE];
        let mut top = 0;
        let everywhere = Aabb {
            lower: Vec3::splat(-NO_PLANE),
            upper: Vec3::splat(NO_PLANE),
        };
        while let Some((reference, [enter, leave])) = next {
            next = None;
            if reference & LEAF_BIT != 0 {
                counters.leaves += 1;
                visit(reference ^ LEAF_BIT, &mut t_max);
            } else {
                let pair = &self.pairs[reference as usize];
                counters.nodes += 2;
                counters.bytes += COMPACT_PAIR_BYTES;
                let children = pair.children(&everywhere);
                let spans = children.map(|b| span_within(&boxes, &b, [enter, leave.min(t_max)]));
                let references = pair.references();
                let near = usize::from(spans[1][0] < spans[0][0]);
                for side in [1 - near, near] {
                    if met(spans[side])
                        && let Some(other) = next.replace((references[side], spans[side]))
                    {
                        stack[top] = other;
                        top += 1;
                        counters.pushes += 1;
                        counters.bytes += COMPACT_RAY_STACK_ENTRY_BYTES;
                    }
                }
            }
            while next.is_none() && top > 0 {
                top -= 1;
                let (reference, span) = stack[top];
                next = met([span[0], t_max]).then_some((reference, span));
            }
        }
    }
}

/// The planes that are not the parent's, or the parent's where both inherit it.
fn encode_pair(pair: &RayPair, parent: &Aabb, place: u32) -> Result<CompactPair, TreeFault> {
    let [left, right] = pair.bounds;
    let mut masks = [0; 2];
    let mut stored = [[0; 3]; 2];
    for axis in 0..3 {
        let planes = [
            [parent.lower, left.lower, right.lower].map(|v| v[axis].to_bits()),
            [parent.upper, left.upper, right.upper].map(|v| v[axis].to_bits()),
        ];
        for (end, [parent, left, right]) in planes.into_iter().enumerate() {
            if parent != left && parent != right {
                return Err(TreeFault::Plane {
                    node: place,
                    plane: (3 * end + axis) as u32,
                });
            }
            let is_left = parent == right;
            masks[end] |= u32::from(is_left) << (2 - axis);
            stored[end][axis] = if is_left { left } else { right };
        }
    }
    let [lower_mask, upper_mask] = masks.map(|mask| mask << MASK_SHIFT);
    Ok(CompactPair {
        lower: stored[0],
        left: pair.references[0] | lower_mask,
        upper: stored[1],
        right: pair.references[1] | upper_mask,
    })
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "PM-MAP-8",
        name: "compact sibling pairs",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Boxes must be tight: other trees, such as refitted ones, are refused until they are encoded again.",
        sources: &[sources::FABIANOWSKI_2011.at("§6.2.1")],
        shaders: &["shaders/accel/compact_bvh.glsl"],
        tests: &[
            "engine/src/accel/photon_map/compact_bvh/tests.rs::pairs_are_recovered_to_the_bit_from_half_the_bytes",
            "engine/src/accel/photon_map/compact_bvh/tests.rs::loose_boxes_are_refused",
        ],
        api: &["clerestory::accel::photon_map::compact_bvh::CompactBvh"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-MAP-9",
        name: "point queries on compact pairs",
        role: Role::PartOf("PM-SYS-1"),
        limits: "Visits the leaves whose boxes hold a point; what is in them is for the caller to test.",
        sources: &[sources::FABIANOWSKI_2011.at("§6.2.3")],
        shaders: &["shaders/accel/compact_bvh.glsl"],
        tests: &[
            "engine/src/accel/photon_map/compact_bvh/tests.rs::points_visit_the_same_leaves_in_the_same_order",
            "tests/tests/accel/lbvh.rs::compact_queries_are_the_twins",
        ],
        api: &["clerestory::accel::photon_map::compact_bvh::CompactBvh"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-MAP-10",
        name: "ray queries on compact pairs",
        role: Role::Yardstick,
        limits: "No picture takes it: their rays go through the ray indexes.",
        sources: &[sources::FABIANOWSKI_2011.at("§6.2.2")],
        shaders: &["shaders/accel/compact_bvh.glsl"],
        tests: &[
            "engine/src/accel/photon_map/compact_bvh/tests.rs::rays_visit_the_same_leaves_in_the_same_order",
            "tests/tests/accel/lbvh.rs::compact_queries_are_the_twins",
        ],
        api: &["clerestory::accel::photon_map::compact_bvh::CompactBvh"],
        ..Row::of(file!())
    },
];

#[cfg(test)]
mod tests;
