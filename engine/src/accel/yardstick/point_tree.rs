//! Binary trees whose every node holds a point and cuts space by the plane through it, as photon maps were at first, and their queries: all points
//! within a radius, and the nearest ones.
//!
//! Sources: H. W. Jensen, "Realistic Image Synthesis Using Photon Mapping", 2001, chapter 6: the nearer child first, the other one where its plane is
//! no farther than the search reaches, which shrinks once enough points are found; I. Wald, J. Günther and P. Slusallek, "Balancing Considered
//! Harmful: Faster Photon Mapping using the Voxel Volume Heuristic", Eurographics 2004, for how probable a visit is.
//!
//! Guarantee: answers are those of trying all points by the same arithmetic, to the bit and with ties. Rounding keeps order, so the squared
//! distance to a point beyond a plane is, as it is computed, no less than that to the plane.

use std::collections::BinaryHeap;

use crate::accel::Aabb;
use crate::accel::photon_map::complete_bvh::QueryCounters;
use crate::{Error, Result};
use glam::Vec3;

/// Most points of a tree.
pub const MAX_POINTS: usize = 1 << (u32::BITS - INDEX_SHIFT);

/// Most nodes on a way from the root.
pub const MAX_LEVELS: usize = 96;

/// Bytes of a stack entry of a query within a radius: a node's place.
pub const GATHER_ENTRY_BYTES: u64 = 4;

/// Bytes of a stack entry of a search for the nearest: place, and squared distance to the plane.
pub const NEAREST_ENTRY_BYTES: u64 = 8;

/// Bits of a node's word below the index of its point: the axis, and above it a flag.
const INDEX_SHIFT: u32 = 3;
const AXIS_MASK: u32 = 3;
const FLAG: u32 = 4;

/// A node as queries read it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointNode {
    /// Its point.
    pub position: Vec3,
    /// Index of the point among those that the tree was built over.
    pub point: u32,
    /// The axis that its plane is across.
    pub axis: usize,
    /// Places of the children below and above the plane.
    pub children: [Option<u32>; 2],
}

/// A point that a query meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Near {
    /// Index of the point among those that the tree was built over.
    pub point: u32,
    /// Place of its node, for records that lie in the order of nodes.
    pub place: u32,
    /// Squared distance, m².
    pub squared: f32,
}

/// A tree over points; the root's place is 0.
pub trait PointTree {
    /// Bytes of a node.
    const NODE_BYTES: u64;

    /// Nodes, one for each point.
    fn count(&self) -> u32;

    /// The node at a place below [`PointTree::count`].
    fn node(&self, place: u32) -> PointNode;

    /// Box of all points.
    fn bounds(&self) -> Aabb {
        (0..self.count()).fold(Aabb::EMPTY, |bounds, place| {
            bounds.with_point(self.node(place).position)
        })
    }

    /// Visits every point no farther than `radius` ≥ 0, metres, once.
    fn within(&self, point: Vec3, radius: f32, counters: &mut QueryCounters, mut visit: impl FnMut(Near)) {
        let reach = radius * radius;
        search(self, point, reach, GATHER_ENTRY_BYTES, counters, |near| {
            visit(near);
            reach
        });
    }

    /// The `most` nearest of the points no farther than `radius` ≥ 0, metres, nearest first; of equally near ones those of least index.
    fn nearest(&self, point: Vec3, most: usize, radius: f32, counters: &mut QueryCounters) -> Vec<Near> {
        let whole = radius * radius;
        // Bits of numbers from +0 on have their order.
        let mut kept: BinaryHeap<(u32, u32, u32)> = BinaryHeap::new();
        if most > 0 {
            search(self, point, whole, NEAREST_ENTRY_BYTES, counters, |near| {
                kept.push((near.squared.to_bits(), near.point, near.place));
                if kept.len() > most {
                    kept.pop();
                }
                match kept.peek() {
                    Some((farthest, ..)) if kept.len() == most => f32::from_bits(*farthest),
                    _ => whole,
                }
            });
        }
        let sorted = kept.into_sorted_vec().into_iter();
        sorted
            .map(|(squared, point, place)| Near {
                point,
                place,
                squared: f32::from_bits(squared),
            })
            .collect()
    }

    /// Nodes that a query within `reach` visits in the mean, for points spread evenly over the box of all points grown by `reach` to every
    /// side: the sum of the nodes' probabilities by the voxel volume heuristic, which for such points are exact.
    fn expected_visits(&self, reach: f32) -> f64 {
        let bounds = self.bounds();
        let whole = grown_volume(&bounds, reach);
        if whole <= 0.0 {
            return f64::from(self.count());
        }
        let boxes = boxes(self, bounds).into_iter();
        boxes.map(|(_, bounds)| grown_volume(&bounds, reach)).sum::<f64>() / whole
    }
}

/// Visits points while they and the planes before them are no farther than the reach, which `meet` gives anew for each point.
fn search<T: PointTree + ?Sized>(
    tree: &T,
    point: Vec3,
    mut reach: f32,
    entry_bytes: u64,
    counters: &mut QueryCounters,
    mut meet: impl FnMut(Near) -> f32,
) {
    let mut stack = [(0, 0.0); MAX_LEVELS];
    let mut top = 0;
    let mut next = (tree.count() > 0).then_some(0);
    while let Some(place) = next {
        let node = tree.node(place);
        counters.nodes += 1;
        counters.bytes += T::NODE_BYTES;
        let squared = (node.position - point).length_squared();
        if squared <= reach {
            let point = node.point;
            reach = meet(Near { point, place, squared });
        }
        let beyond = point[node.axis] - node.position[node.axis];
        let near = usize::from(beyond >= 0.0);
        let apart = beyond * beyond;
        if let Some(far) = node.children[1 - near]
            && apart <= reach
        {
            stack[top] = (far, apart);
            top += 1;
            counters.pushes += 1;
            counters.bytes += entry_bytes;
        }
        next = node.children[near];
        while next.is_none() && top > 0 {
            top -= 1;
            let (far, apart) = stack[top];
            next = (apart <= reach).then_some(far);
        }
    }
}

/// Every node with its part of `bounds`, parents before children.
pub(super) fn boxes<T: PointTree + ?Sized>(tree: &T, bounds: Aabb) -> Vec<(u32, Aabb)> {
    let mut all = Vec::with_capacity(tree.count() as usize);
    let mut pending = Vec::new();
    if tree.count() > 0 {
        pending.push((0, bounds));
    }
    while let Some((place, bounds)) = pending.pop() {
        all.push((place, bounds));
        let node = tree.node(place);
        let [below, above] = cut(&bounds, node.axis, node.position[node.axis]);
        pending.extend(node.children[0].map(|child| (child, below)));
        pending.extend(node.children[1].map(|child| (child, above)));
    }
    all
}

/// The parts of a box below and above a plane.
pub(super) fn cut(bounds: &Aabb, axis: usize, plane: f32) -> [Aabb; 2] {
    let (mut below, mut above) = (*bounds, *bounds);
    below.upper[axis] = plane;
    above.lower[axis] = plane;
    [below, above]
}

/// The volume of a box whose sides are moved outwards by `reach`, m³.
pub(super) fn grown_volume(bounds: &Aabb, reach: f32) -> f64 {
    let extent = bounds.upper.as_dvec3() - bounds.lower.as_dvec3() + 2.0 * f64::from(reach);
    extent.x * extent.y * extent.z
}

/// The axis of a box's largest extent, the first of equal ones.
pub(super) fn widest_axis(bounds: &Aabb) -> usize {
    let extent = bounds.upper - bounds.lower;
    if extent.x >= extent.y && extent.x >= extent.z {
        0
    } else if extent.y >= extent.z {
        1
    } else {
        2
    }
}

/// Indices of the points that are finite; the others are nowhere near anything.
///
/// # Errors
/// [`Error::LimitExceeded`] past [`MAX_POINTS`].
pub(super) fn finite_points(points: &[Vec3]) -> Result<Vec<u32>> {
    if points.len() > MAX_POINTS {
        return Err(Error::LimitExceeded {
            name: "points of a kd-tree".into(),
            value: points.len() as u64,
            limit_name: "MAX_POINTS",
            limit: MAX_POINTS as u64,
        });
    }
    let all = 0..points.len() as u32;
    Ok(all.filter(|i| points[*i as usize].is_finite()).collect())
}

/// Points by their place on an axis, those of equal places by index.
pub(super) fn order_on(axis: usize, points: &[Vec3]) -> impl Fn(&u32, &u32) -> std::cmp::Ordering {
    move |a, b| {
        let on_axis = |i: &u32| points[*i as usize][axis];
        on_axis(a).total_cmp(&on_axis(b)).then(a.cmp(b))
    }
}

/// A node's word.
pub(super) fn word(point: u32, flag: bool, axis: usize) -> u32 {
    (point << INDEX_SHIFT) | (u32::from(flag) * FLAG) | axis as u32
}

/// What a node's word holds: point, flag, axis.
pub(super) fn of_word(word: u32) -> (u32, bool, usize) {
    (word >> INDEX_SHIFT, word & FLAG != 0, (word & AXIS_MASK) as usize)
}

#[cfg(test)]
pub(super) mod tests;
