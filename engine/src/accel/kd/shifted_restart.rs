//! Traversal without a stack that restarts at the root behind the leaf it has left: three forms, each of which fails.
//!
//! Source: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §3.2.4.4 and §4.2.1, on T. Foley, J. Sugerman,
//! "KD-Tree Acceleration Structures for a GPU Raytracer", Graphics Hardware 2005. Planes are met where their distance says, as there, without the
//! slack of the other traversals; rays' hits play no part. Kept for comparison: where a ray goes on is not told by a distance alone, since
//! several leaves may begin at one.

use super::KdTree;
use super::tree::KdKind;
use crate::accel::Ray;
use crate::accel::box_test::BoxTest;
use crate::catalogue::{Role, Row, sources};

/// What a restart takes for its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ShiftedRestart {
    /// From the end of the last leaf on, ends included: that leaf is met again in the point where it ends, and for ever.
    Closed,
    /// The same without the ends: leaves without volume have empty intervals and are never met.
    Open,
    /// Ends included, from this far behind the end of the last leaf: leaves that are thinner are skipped, and where it is lost in
    /// rounding there is no end.
    ClosedBehind(f32),
}

/// The leaves of a ray.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LeafSequence {
    /// Their nodes, in order.
    pub leaves: Vec<u32>,
    /// Whether there was no end of them.
    pub endless: bool,
}

/// A ray and its interval in the tree's box, which may be empty.
fn begin(tree: &KdTree, ray: &Ray) -> (BoxTest, [f32; 2]) {
    let mut boxes = BoxTest::new(&tree.bounds, ray);
    boxes.slack = glam::Vec3::ZERO;
    let (enter, leave) = boxes.span(tree.bounds.lower, tree.bounds.upper);
    (boxes, [enter.max(ray.t_min), leave.min(ray.t_max)])
}

/// The children of a node as a ray comes to them, and the distance of their plane.
fn ordered(boxes: &BoxTest, axis: usize, plane: f32, children: u32) -> ([u32; 2], f32) {
    let near = u32::from(boxes.inverse[axis] < 0.0);
    let distance = (plane - boxes.origin[axis]) * boxes.inverse[axis];
    ([children + near, children + 1 - near], distance)
}

impl ShiftedRestart {
    /// The leaves that are met, at most `most`.
    pub fn leaves(self, tree: &KdTree, ray: &Ray, most: usize) -> LeafSequence {
        let mut sequence = LeafSequence::default();
        let (boxes, [mut enter, leave]) = begin(tree, ray);
        while enter <= leave {
            if sequence.leaves.len() == most {
                sequence.endless = true;
                break;
            }
            let (mut node, mut from, mut to) = (0, enter, leave);
            while let KdKind::Inner { axis, plane, children } = tree.nodes[node as usize].kind() {
                let ([near, far], distance) = ordered(&boxes, axis, plane, children);
                let (far_only, near_only) = match self {
                    Self::Open => (distance <= from, distance >= to),
                    Self::Closed | Self::ClosedBehind(_) => (distance < from, distance > to),
                };
                node = if far_only { far } else { near };
                if !far_only && !near_only {
                    to = distance;
                }
                from = from.min(to);
            }
            sequence.leaves.push(node);
            if to >= leave {
                break;
            }
            enter = match self {
                Self::ClosedBehind(step) => to + step,
                Self::Closed | Self::Open => to,
            };
        }
        sequence
    }
}

/// All leaves that a ray meets, ends included, in its order: those that the forms above should find.
pub fn leaves_by_stack(tree: &KdTree, ray: &Ray) -> LeafSequence {
    let mut sequence = LeafSequence::default();
    let (boxes, span) = begin(tree, ray);
    let mut pending = vec![(0, span)];
    while let Some((mut node, [from, mut to])) = pending.pop() {
        if from > to {
            continue;
        }
        while let KdKind::Inner { axis, plane, children } = tree.nodes[node as usize].kind() {
            let ([near, far], distance) = ordered(&boxes, axis, plane, children);
            if distance < from {
                node = far;
                continue;
            }
            node = near;
            if distance <= to {
                pending.push((far, [distance, to]));
                to = distance;
            }
        }
        sequence.leaves.push(node);
    }
    sequence
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-TR-2",
    name: "restart behind a leaf in three forms, each shown to fail",
    role: Role::Yardstick,
    limits: "Loses or repeats leaves that begin at one distance: kept to show that it fails.",
    sources: &[sources::FOLEY_SUGERMAN_2005.whole()],
    tests: &[
        "engine/src/accel/kd/shifted_restart_tests.rs::restarts_behind_a_leaf_fail_in_all_three_forms_and_flags_do_not",
    ],
    api: &["clerestory::accel::yardstick::ShiftedRestart"],
    ..Row::of(file!())
}];
