//! The photon map of its inventor: a kd-tree over points as a heap without holes, which needs no pointers.
//!
//! Source: H. W. Jensen, "Realistic Image Synthesis Using Photon Mapping", 2001, chapter 6. Each node takes the point that leaves a left-balanced tree
//! below it, on the axis on which its points reach widest; the children of the node at place i are at 2i + 1 and 2i + 2.
//!
//! Guarantees: the same tree on any machine; points that are not finite are in no answer.

use super::point_tree::{PointNode, PointTree, finite_points, of_word, order_on, widest_axis, word};
use crate::Result;
use crate::accel::Aabb;
use crate::catalogue::{Role, Row, sources};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// A node (16 bytes).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct LeftBalancedNode {
    /// Its point.
    pub position: Vec3,
    /// The point's index, and in the lowest bits the axis.
    pub word: u32,
}

/// A left-balanced kd-tree.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftBalancedTree {
    /// Nodes as a heap.
    pub nodes: Vec<LeftBalancedNode>,
}

impl LeftBalancedTree {
    /// Over those of `points` that are finite.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`](crate::Error::LimitExceeded) past [`MAX_POINTS`](super::point_tree::MAX_POINTS).
    pub fn build(points: &[Vec3]) -> Result<Self> {
        let mut order = finite_points(points)?;
        let mut nodes = vec![LeftBalancedNode::zeroed(); order.len()];
        balance(points, &mut order, 0, &mut nodes);
        Ok(Self { nodes })
    }
}

/// Writes the tree over the points that `order` names, with its root at `place`.
fn balance(points: &[Vec3], order: &mut [u32], place: usize, nodes: &mut [LeftBalancedNode]) {
    if order.is_empty() {
        return;
    }
    let bounds = order
        .iter()
        .fold(Aabb::EMPTY, |bounds, i| bounds.with_point(points[*i as usize]));
    let axis = widest_axis(&bounds);
    let middle = left_count(order.len());
    order.select_nth_unstable_by(middle, order_on(axis, points));
    let point = order[middle];
    nodes[place] = LeftBalancedNode {
        position: points[point as usize],
        word: word(point, false, axis),
    };
    let (below, above) = order.split_at_mut(middle);
    balance(points, below, 2 * place + 1, nodes);
    balance(points, &mut above[1..], 2 * place + 2, nodes);
}

/// Nodes below the left child of a heap of `count` ≥ 1 nodes.
fn left_count(count: usize) -> usize {
    // The last level may have as many nodes as there are above it and one, of which the left half comes first.
    let last_level = 1 << count.ilog2();
    let in_last_level = count + 1 - last_level;
    (last_level / 2 + in_last_level.min(last_level / 2)).saturating_sub(1)
}

impl PointTree for LeftBalancedTree {
    const NODE_BYTES: u64 = size_of::<LeftBalancedNode>() as u64;

    fn count(&self) -> u32 {
        self.nodes.len() as u32
    }

    fn node(&self, place: u32) -> PointNode {
        let LeftBalancedNode { position, word } = self.nodes[place as usize];
        let (point, _, axis) = of_word(word);
        let child = |place: u32| (place < self.count()).then_some(place);
        PointNode {
            position,
            point,
            axis,
            children: [child(2 * place + 1), child(2 * place + 2)],
        }
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-MAP-1",
    name: "left-balanced kd-tree of photons",
    role: Role::Yardstick,
    limits: "On the host alone, and over points: a query for kernels must reach as far as the widest of them.",
    sources: &[sources::JENSEN_2001.at("§6"), sources::FABIANOWSKI_2011.at("§3.4.3.1")],
    tests: &[
        "engine/src/accel/yardstick/left_balanced.rs::nodes_fill_a_heap_and_their_planes_part_the_points",
        "engine/src/accel/yardstick/point_tree/tests.rs::queries_within_a_radius_are_those_of_trying_all_points",
        "engine/src/accel/yardstick/point_tree/tests.rs::the_nearest_are_those_of_trying_all_points",
        "engine/src/accel/yardstick/point_tree/tests.rs::queries_visit_the_nodes_whose_boxes_they_reach_and_no_others",
        "engine/src/accel/yardstick/point_tree/tests.rs::points_that_are_not_finite_are_in_no_answer",
        "tools/src/experiments/measures/photon_maps/point_maps.rs::every_point_lies_in_the_kernels_of_the_compact_map",
    ],
    api: &[
        "clerestory::accel::yardstick::left_balanced::LeftBalancedTree",
        "clerestory::accel::yardstick::point_tree::PointTree",
    ],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    /// Points below a place.
    fn below(tree: &LeftBalancedTree, place: Option<u32>) -> Vec<PointNode> {
        let Some(node) = place.map(|place| tree.node(place)) else {
            return Vec::new();
        };
        let children = node.children.map(|child| below(tree, child));
        children.into_iter().flatten().chain([node]).collect()
    }

    #[test]
    fn nodes_fill_a_heap_and_their_planes_part_the_points() {
        let mut random = Random(71);
        for count in (0..70).chain([255, 256, 257, 1000]) {
            // Few places, so that many points lie in a plane.
            let points: Vec<Vec3> = (0..count).map(|_| (3.0 * random.vector()).round()).collect();
            let tree = LeftBalancedTree::build(&points).expect("small");
            assert_eq!(tree.nodes.len(), count);
            let mut seen: Vec<u32> = tree.nodes.iter().map(|node| of_word(node.word).0).collect();
            seen.sort_unstable();
            assert!(seen.into_iter().eq(0..count as u32));
            for place in 0..count as u32 {
                let node = tree.node(place);
                assert_eq!(node.position, points[node.point as usize]);
                let on_axis = |node: &PointNode, axis: usize| node.position[axis];
                let plane = on_axis(&node, node.axis);
                let [left, right] = node.children.map(|child| below(&tree, child));
                assert!(left.iter().all(|other| on_axis(other, node.axis) <= plane));
                assert!(right.iter().all(|other| on_axis(other, node.axis) >= plane));
                let all = [&left[..], &right[..], &[node]].concat();
                assert_eq!(left_count(all.len()), left.len(), "{count}, {place}");
                let extent = |axis: usize| {
                    let places = all.iter().map(|other| on_axis(other, axis));
                    places.clone().fold(f32::MIN, f32::max) - places.fold(f32::MAX, f32::min)
                };
                assert!((0..3).all(|axis| extent(axis) <= extent(node.axis)));
            }
        }
        assert_eq!(LeftBalancedTree::NODE_BYTES, 16);
    }
}
