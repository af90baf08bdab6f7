//! A tree whose nodes hold their whole boxes, for queries by points and by rays: the baseline that compact nodes are measured against.
//!
//! Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §3.2.2 and §6.2.4: nodes of 32 bytes for point
//! queries, sibling pairs of 56 bytes for rays.
//!
//! Guarantee: twins of the kernels' traversals with exact counters of what these read; every leaf whose box holds a point in its interior, or
//! that a ray meets before its end, is visited, once. Rays meet boxes by the rule of all indexes ([`BoxTest`]), so that nothing is culled that
//! the triangle test reports.

use crate::accel::box_test::BoxTest;
use crate::accel::box_tree::{BoxTree, Child};
use crate::accel::{Aabb, Ray};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;
use crate::{Error, Result};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Bits of a reference that hold an index.
pub const INDEX_BITS: u32 = constants::COMPACT_INDEX_BITS;

/// The bit of a reference that says that it names the first record of a leaf, not a pair.
pub const LEAF_BIT: u32 = 1 << INDEX_BITS;

/// Most entries of a traversal's stack: deeper trees are refused.
pub const STACK_SIZE: usize = constants::COMPACT_STACK_SIZE as usize;

/// Bytes of a complete node.
pub const COMPLETE_NODE_BYTES: u64 = size_of::<CompleteNode>() as u64;

/// Bytes of a stack entry of a point query: a node's index.
pub const POINT_STACK_ENTRY_BYTES: u64 = 4;

/// Bytes of a stack entry of a ray query: reference and entry distance.
pub const RAY_STACK_ENTRY_BYTES: u64 = 8;

/// A node as a point query reads it (32 bytes).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CompleteNode {
    /// Lower corner.
    pub lower: Vec3,
    /// First record of a leaf with [`LEAF_BIT`], or index of a pair of nodes.
    pub reference: u32,
    /// Upper corner.
    pub upper: Vec3,
    /// Fills the size.
    pub padding: u32,
}

/// Two siblings as a ray query reads them (56 bytes).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RayPair {
    /// Boxes of the left and the right child.
    pub bounds: [Aabb; 2],
    /// Their references, as in [`CompleteNode`].
    pub references: [u32; 2],
}

/// Where queries begin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RootDescriptor {
    /// Box of everything.
    pub bounds: Aabb,
    /// Reference of the root, which may be a leaf; `None` when there is nothing at all.
    pub reference: Option<u32>,
}

/// Exact work of queries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct QueryCounters {
    /// Nodes fetched, two per pair.
    pub nodes: u64,
    /// Leaves visited.
    pub leaves: u64,
    /// Stack entries written.
    pub pushes: u64,
    /// Bytes of the nodes fetched and the stack entries written.
    pub bytes: u64,
}

/// Pairs of siblings in depth-first order, with their boxes; the other layouts are made of it.
#[derive(Debug, Clone, PartialEq)]
pub struct CompleteBvh {
    /// Where queries begin.
    pub root: RootDescriptor,
    /// Sibling pairs, for ray queries.
    pub pairs: Vec<RayPair>,
    /// The same nodes for point queries, two per pair.
    pub nodes: Vec<CompleteNode>,
    /// Primitive of each record.
    pub order: Vec<u32>,
    /// Whether a record ends its leaf.
    pub ends: Vec<bool>,
}

impl CompleteBvh {
    /// Lays a tree out.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`] past 2²⁸ primitives or for a tree deeper than a traversal's stack.
    pub fn new(tree: &BoxTree) -> Result<Self> {
        let limit = |what: &str, value: u64, limit_name, limit: u64| {
            let error = || Error::LimitExceeded {
                name: what.into(),
                value,
                limit_name,
                limit,
            };
            if value > limit { Err(error()) } else { Ok(()) }
        };
        limit(
            "records of a complete tree",
            tree.order.len() as u64,
            "INDEX_BITS",
            1 << INDEX_BITS,
        )?;
        let mut places = vec![0; tree.nodes.len()];
        let mut depth = 0;
        for (place, (node, level)) in tree.preorder().enumerate() {
            places[node as usize] = place as u32;
            depth = depth.max(level);
        }
        limit(
            "levels of a complete tree",
            u64::from(depth),
            "STACK_SIZE",
            STACK_SIZE as u64 - 1,
        )?;
        let mut ends = vec![false; tree.order.len()];
        let mut reference = |child| match child {
            Child::Inner(node) => places[node as usize],
            Child::Leaf { first, count } => {
                ends[(first + count - 1) as usize] = true;
                first | LEAF_BIT
            }
        };
        let nodes = tree.preorder().map(|(node, _)| &tree.nodes[node as usize]);
        let pairs: Vec<RayPair> = nodes
            .map(|node| RayPair {
                bounds: node.bounds.map(Aabb::without_negative_zero),
                references: node.children.map(&mut reference),
            })
            .collect();
        let root = RootDescriptor {
            bounds: tree.bounds.without_negative_zero(),
            reference: (!tree.order.is_empty()).then(|| reference(tree.root)),
        };
        let node = |bounds: Aabb, reference| CompleteNode {
            lower: bounds.lower,
            reference,
            upper: bounds.upper,
            padding: 0,
        };
        let of_pair = |pair: &RayPair| [0, 1].map(|i| node(pair.bounds[i], pair.references[i]));
        Ok(Self {
            root,
            nodes: pairs.iter().flat_map(of_pair).collect(),
            pairs,
            order: tree.order.clone(),
            ends,
        })
    }

    /// Visits the leaves whose boxes hold a point in their interior: a stack of nodes, each fetched and tested when it is taken.
    pub fn point_query(&self, point: Vec3, counters: &mut QueryCounters, mut visit: impl FnMut(u32)) {
        let mut next = self.root.reference.filter(|_| holds_inside(&self.root.bounds, point));
        let mut stack = [0; STACK_SIZE];
        let mut top = 0;
        while let Some(reference) = next {
            if reference & LEAF_BIT != 0 {
                counters.leaves += 1;
                visit(reference ^ LEAF_BIT);
            } else {
                for node in [2 * reference, 2 * reference + 1] {
                    stack[top] = node;
                    top += 1;
                }
                counters.pushes += 2;
                counters.bytes += 2 * POINT_STACK_ENTRY_BYTES;
            }
            next = None;
            while next.is_none() && top > 0 {
                top -= 1;
                let node = &self.nodes[stack[top] as usize];
                counters.nodes += 1;
                counters.bytes += COMPLETE_NODE_BYTES;
                let bounds = Aabb {
                    lower: node.lower,
                    upper: node.upper,
                };
                next = holds_inside(&bounds, point).then_some(node.reference);
            }
        }
    }

    /// Visits the leaves that a ray meets, nearer child first; `visit` gets a leaf's first record and may draw the ray's end nearer.
    /// Stack entries are of 8 bytes.
    pub fn ray_query(&self, ray: &Ray, counters: &mut QueryCounters, mut visit: impl FnMut(u32, &mut f32)) {
        let Some(root) = self.root.reference.filter(|_| ray.is_traceable()) else {
            return;
        };
        let boxes = BoxTest::new(&self.root.bounds, ray);
        let mut t_max = ray.t_max;
        let span = span_within(&boxes, &self.root.bounds, [ray.t_min, t_max]);
        let mut stack = [(0, 0.0); STACK_SIZE];
        let mut top = 0;
        let mut next = met(span).then_some(root);
        while let Some(reference) = next {
            next = None;
            if reference & LEAF_BIT != 0 {
                counters.leaves += 1;
                visit(reference ^ LEAF_BIT, &mut t_max);
            } else {
                let pair = &self.pairs[reference as usize];
                counters.nodes += 2;
                counters.bytes += size_of::<RayPair>() as u64;
                let spans = pair.bounds.map(|b| span_within(&boxes, &b, [ray.t_min, t_max]));
                let near = usize::from(spans[1][0] < spans[0][0]);
                for side in [1 - near, near] {
                    if met(spans[side])
                        && let Some(other) = next.replace(pair.references[side])
                    {
                        stack[top] = (other, spans[1 - side][0]);
                        top += 1;
                        counters.pushes += 1;
                        counters.bytes += RAY_STACK_ENTRY_BYTES;
                    }
                }
            }
            while next.is_none() && top > 0 {
                top -= 1;
                let (reference, entry) = stack[top];
                next = met([entry, t_max]).then_some(reference);
            }
        }
    }
}

/// Whether a point lies in the interior of a box; on its faces kernels vanish.
pub fn holds_inside(bounds: &Aabb, point: Vec3) -> bool {
    bounds.lower.cmplt(point).all() && point.cmplt(bounds.upper).all()
}

/// Beyond every plane of trees within [`MAX_COORDINATE`](crate::accel::MAX_COORDINATE); products with the largest reciprocal of a direction stay
/// finite.
pub(super) const NO_PLANE: f32 = constants::COMPACT_NO_PLANE;

/// The part of a span in which a ray is within a box; its entry is greater than its exit where there is none.
pub(super) fn span_within(boxes: &BoxTest, bounds: &Aabb, [enter, leave]: [f32; 2]) -> [f32; 2] {
    let (near, far) = boxes.span(bounds.lower, bounds.upper);
    [near.max(enter), far.min(leave)]
}

/// Whether a span is one.
pub(super) fn met([enter, leave]: [f32; 2]) -> bool {
    enter <= leave
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "PM-X-3",
        name: "traffic model: every access served by itself, as exact counts of bytes",
        role: Role::Yardstick,
        limits: "Counts bytes as if there were no cache, and says nothing of time.",
        sources: &[sources::FABIANOWSKI_2011.at("§4.3.3")],
        tests: &[
            "engine/src/accel/photon_map/compact_bvh/tests.rs::points_visit_the_same_leaves_in_the_same_order",
            "engine/src/accel/photon_map/compact_bvh/tests.rs::rays_visit_the_same_leaves_in_the_same_order",
            "engine/src/accel/kd/tests.rs::bytes_are_eight_for_each_node_and_entry_that_memory_serves",
        ],
        api: &[
            "clerestory::accel::photon_map::complete_bvh::QueryCounters",
            "clerestory::accel::kd::KdCounters",
        ],
        ..Row::of(file!())
    },
    Row {
        id: "PM-MAP-7",
        name: "complete nodes and sibling pairs",
        role: Role::Yardstick,
        limits: "Twice the bytes of compact pairs, for which it is the baseline.",
        sources: &[sources::FABIANOWSKI_2011.at("§6.2.4")],
        tests: &[
            "engine/src/accel/photon_map/compact_bvh/tests.rs::pairs_are_recovered_to_the_bit_from_half_the_bytes",
        ],
        api: &["clerestory::accel::photon_map::complete_bvh::CompleteBvh"],
        ..Row::of(file!())
    },
    Row {
        id: "PM-I-5",
        name: "points in boxes",
        role: Role::PartOf("PM-MAP-7"),
        limits: "A point on the border of a box may count as outside.",
        sources: &[sources::FABIANOWSKI_2011.at("§3.2.4.2")],
        tests: &["engine/src/accel/photon_map/compact_bvh/tests.rs::points_visit_the_same_leaves_in_the_same_order"],
        api: &["clerestory::accel::photon_map::complete_bvh::holds_inside"],
        ..Row::of(file!())
    },
];
