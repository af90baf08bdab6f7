//! A kd-tree over points by full sweeps of the voxel volume heuristic: for queries within a radius that is known when it is built.
//!
//! Sources: I. Wald, J. Günther and P. Slusallek, "Balancing Considered Harmful: Faster Photon Mapping using the Voxel Volume Heuristic", Eurographics
//! 2004; in the form of B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §3.4.3.1: a plane through
//! each point on each axis, whose point stays in the node; of these the one of least cost p(P) + p(L) n(L) + p(R) n(R), where p is the volume of a box
//! grown by the reach over that of the box of all points, grown as much. Lists that are sorted once are handed down, in O(n log n) where the
//! tree is balanced.
//!
//! Guarantees: the same tree on any machine; where no plane is better than another, as in boxes without volume, the one nearest to the median is
//! taken, and below [`MAX_SWEPT_LEVELS`] levels the median itself, so that queries need no more than [`MAX_LEVELS`](super::point_tree::MAX_LEVELS).

use super::point_tree::{PointNode, PointTree, cut, finite_points, grown_volume, of_word, order_on, widest_axis, word};
use crate::Result;
use crate::accel::Aabb;
use crate::catalogue::{Role, Row, sources};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Levels whose planes are chosen by the heuristic.
pub const MAX_SWEPT_LEVELS: u32 = 64;

/// A node (20 bytes); the child below its plane follows it.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VoxelVolumeNode {
    /// Its point.
    pub position: Vec3,
    /// The point's index, whether there is a child below, and in the lowest bits the axis.
    pub word: u32,
    /// Place of the child above, 0 for none.
    pub above: u32,
}

/// A kd-tree by the voxel volume heuristic.
#[derive(Debug, Clone, PartialEq)]
pub struct VoxelVolumeTree {
    /// Nodes in depth-first order.
    pub nodes: Vec<VoxelVolumeNode>,
}

impl VoxelVolumeTree {
    /// Over those of `points` that are finite, for queries that reach as far as `reach` ≥ 0, metres. Others are answered too, but the tree is not
    /// made for them.
    ///
    /// # Errors
    /// [`Error::LimitExceeded`](crate::Error::LimitExceeded) past [`MAX_POINTS`](super::point_tree::MAX_POINTS).
    pub fn build(points: &[Vec3], reach: f32) -> Result<Self> {
        let order = finite_points(points)?;
        let bounds = order
            .iter()
            .fold(Aabb::EMPTY, |bounds, i| bounds.with_point(points[*i as usize]));
        let mut sweep = Sweep {
            points,
            reach,
            nodes: Vec::with_capacity(order.len()),
            is_below: vec![false; points.len()],
            spare: Vec::with_capacity(order.len()),
        };
        let mut orders = [0, 1, 2].map(|axis| {
            let mut order = order.clone();
            order.sort_unstable_by(order_on(axis, points));
            order
        });
        let [x, y, z] = &mut orders;
        sweep.build([&mut x[..], &mut y[..], &mut z[..]], &bounds, 0);
        Ok(Self { nodes: sweep.nodes })
    }
}

struct Sweep<'a> {
    points: &'a [Vec3],
    reach: f32,
    nodes: Vec<VoxelVolumeNode>,
    /// Of the points of the node at hand, by index, whether they lie below its plane.
    is_below: Vec<bool>,
    /// Where a list is put in order.
    spare: Vec<u32>,
}

impl Sweep<'_> {
    /// The tree over the points of three lists, each sorted on its axis; the place of its root, unless there is no point.
    fn build(&mut self, mut orders: [&mut [u32]; 3], bounds: &Aabb, level: u32) -> Option<u32> {
        let count = orders[0].len();
        if count == 0 {
            return None;
        }
        let (axis, middle) = if level < MAX_SWEPT_LEVELS {
            self.split(&orders, bounds)
        } else {
            (widest_axis(bounds), count / 2)
        };
        let point = orders[axis][middle];
        let position = self.points[point as usize];
        let place = self.nodes.len();
        self.nodes.push(VoxelVolumeNode::zeroed());
        for (i, other) in orders[axis].iter().enumerate() {
            self.is_below[*other as usize] = i < middle;
        }
        for order in &mut orders {
            self.part(order, point);
        }
        let [x, y, z] = orders.map(|order| {
            let (below, above) = order.split_at_mut(middle);
            (below, &mut above[1..])
        });
        let [below, above] = cut(bounds, axis, position[axis]);
        let below = self.build([x.0, y.0, z.0], &below, level + 1);
        let above = self.build([x.1, y.1, z.1], &above, level + 1);
        self.nodes[place] = VoxelVolumeNode {
            position,
            word: word(point, below.is_some(), axis),
            above: above.unwrap_or(0),
        };
        Some(place as u32)
    }

    /// The axis and the place in its list of the plane of least cost. What all planes share, p(P) and the volume that p is a part of, chooses
    /// nothing.
    fn split(&self, orders: &[&mut [u32]; 3], bounds: &Aabb) -> (usize, usize) {
        let count = orders[0].len();
        let mut best = (f64::INFINITY, 0, count / 2);
        for (axis, order) in orders.iter().enumerate() {
            for (i, point) in order.iter().enumerate() {
                let sides = cut(bounds, axis, self.points[*point as usize][axis]);
                let [below, above] = sides.map(|side| grown_volume(&side, self.reach));
                let cost = below * i as f64 + above * (count - 1 - i) as f64;
                let nearer = i.abs_diff(count / 2) < best.2.abs_diff(count / 2);
                if cost < best.0 || (cost == best.0 && nearer) {
                    best = (cost, axis, i);
                }
            }
        }
        (best.1, best.2)
    }

    /// Brings a sorted list into the order below, `point`, above, each of them sorted.
    fn part(&mut self, order: &mut [u32], point: u32) {
        let is_below = |i: &&u32| self.is_below[**i as usize];
        self.spare.clear();
        self.spare.extend(order.iter().filter(is_below));
        self.spare.push(point);
        self.spare.extend(order.iter().filter(|i| !is_below(i) && **i != point));
        order.copy_from_slice(&self.spare);
    }
}

impl PointTree for VoxelVolumeTree {
    const NODE_BYTES: u64 = size_of::<VoxelVolumeNode>() as u64;

    fn count(&self) -> u32 {
        self.nodes.len() as u32
    }

    fn node(&self, place: u32) -> PointNode {
        let VoxelVolumeNode { position, word, above } = self.nodes[place as usize];
        let (point, has_below, axis) = of_word(word);
        PointNode {
            position,
            point,
            axis,
            children: [has_below.then_some(place + 1), (above > 0).then_some(above)],
        }
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-MAP-2",
    name: "kd-tree of photons by the voxel volume heuristic",
    role: Role::Yardstick,
    limits: "On the host alone, over points, and best for one reach: a query for kernels must reach as far as the widest of them.",
    sources: &[
        sources::WALD_GUENTHER_2004.whole(),
        sources::FABIANOWSKI_2011.at("§3.4.3.1"),
    ],
    tests: &[
        "engine/src/accel/yardstick/voxel_volume.rs::every_plane_has_the_least_cost_of_all",
        "engine/src/accel/yardstick/voxel_volume.rs::nodes_by_volume_are_visited_less_than_balanced_ones",
        "engine/src/accel/yardstick/voxel_volume.rs::ways_from_the_root_are_bounded",
        "engine/src/accel/yardstick/point_tree/tests.rs::queries_within_a_radius_are_those_of_trying_all_points",
        "engine/src/accel/yardstick/point_tree/tests.rs::the_nearest_are_those_of_trying_all_points",
        "engine/src/accel/yardstick/point_tree/tests.rs::queries_visit_the_nodes_whose_boxes_they_reach_and_no_others",
        "engine/src/accel/yardstick/point_tree/tests.rs::visits_are_as_many_as_grown_volumes_foretell",
        "tools/src/experiments/measures/photon_maps/point_maps.rs::every_point_lies_in_the_kernels_of_the_compact_map",
    ],
    api: &["clerestory::accel::yardstick::voxel_volume::VoxelVolumeTree"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::super::left_balanced::LeftBalancedTree;
    use super::super::point_tree::MAX_LEVELS;
    use super::super::point_tree::tests::{clusters, octaves};
    use super::*;

    /// Points below a place, that of the place among them.
    fn members(tree: &dyn Fn(u32) -> PointNode, place: Option<u32>) -> Vec<u32> {
        let Some(node) = place.map(tree) else {
            return Vec::new();
        };
        let children = node.children.map(|child| members(tree, child));
        children.into_iter().flatten().chain([node.point]).collect()
    }

    /// Probability of a visit by its definition: the box cut by all planes above it, grown, over the box of all points, grown.
    fn probability([lower, upper]: [Vec3; 2], whole: &Aabb, reach: f32) -> f64 {
        let side = |axis: usize, lower: Vec3, upper: Vec3| {
            f64::from(upper[axis]) + f64::from(reach) - (f64::from(lower[axis]) - f64::from(reach))
        };
        let ratio = |axis: usize| side(axis, lower, upper) / side(axis, whole.lower, whole.upper);
        ratio(0) * ratio(1) * ratio(2)
    }

    /// Checks a node and all below it, every candidate weighed by itself; counts nodes that another plane would have split at a lower cost.
    fn dearer(
        tree: &dyn Fn(u32) -> PointNode,
        (points, whole, reach): (&[Vec3], &Aabb, f32),
        place: u32,
        bounds: [Vec3; 2],
    ) -> usize {
        let node = tree(place);
        let all = members(tree, Some(place));
        let sides = |axis: usize, plane: f32| {
            let ([mut below, mut above], [lower, upper]) = ([bounds, bounds], bounds);
            assert!(lower[axis] <= plane && plane <= upper[axis]);
            below[1][axis] = plane;
            above[0][axis] = plane;
            [below, above]
        };
        let cost = |axis: usize, plane: f32, counts: [usize; 2]| {
            let [below, above] = sides(axis, plane).map(|side| probability(side, whole, reach));
            probability(bounds, whole, reach) + below * counts[0] as f64 + above * counts[1] as f64
        };
        let mut least = f64::INFINITY;
        for axis in [0, 1, 2] {
            let at = |point: &u32| points[*point as usize][axis];
            for point in &all {
                let plane = at(point);
                let before = |other: &&u32| (at(other), **other) < (plane, *point);
                let below = all.iter().filter(before).count();
                least = least.min(cost(axis, plane, [below, all.len() - 1 - below]));
            }
        }
        let counts = node.children.map(|child| members(tree, child).len());
        let taken = cost(node.axis, node.position[node.axis], counts);
        // Sums in another order.
        let mut dearer = usize::from(taken > least * (1.0 + 1e-12));
        let halves = sides(node.axis, node.position[node.axis]);
        for (child, bounds) in node.children.into_iter().zip(halves) {
            dearer += child.map_or(0, |child| self::dearer(tree, (points, whole, reach), child, bounds));
        }
        dearer
    }

    #[test]
    fn every_plane_has_the_least_cost_of_all() {
        for (seed, flat) in [(81, 1.0), (82, 0.0)] {
            let points: Vec<Vec3> = clusters(seed, 150)
                .iter()
                .map(|p| p * Vec3::new(1.0, flat, 1.0))
                .collect();
            for reach in [0.02, 0.3] {
                let tree = VoxelVolumeTree::build(&points, reach).expect("small");
                let whole = tree.bounds();
                let corners = [whole.lower, whole.upper];
                let given = (&points[..], &whole, reach);
                assert_eq!(dearer(&|place| tree.node(place), given, 0, corners), 0);
                let balanced = LeftBalancedTree::build(&points).expect("small");
                assert!(dearer(&|place| balanced.node(place), given, 0, corners) > 0);
            }
        }
        assert_eq!(VoxelVolumeTree::NODE_BYTES, 20);
    }

    #[test]
    fn nodes_by_volume_are_visited_less_than_balanced_ones() {
        for seed in 83..86 {
            let points = clusters(seed, 400);
            for reach in [0.02, 0.1] {
                let by_volume = VoxelVolumeTree::build(&points, reach).expect("small");
                let balanced = LeftBalancedTree::build(&points).expect("small");
                let ratio = by_volume.expected_visits(reach) / balanced.expected_visits(reach);
                // Such clusters have 0.57 to 0.70 by an evaluation elsewhere.
                assert!(ratio > 0.4 && ratio < 0.85, "{ratio}");
            }
        }
    }

    #[test]
    fn ways_from_the_root_are_bounded() {
        fn levels(tree: &VoxelVolumeTree, place: u32) -> usize {
            let children = tree.node(place).children.into_iter().flatten();
            1 + children.map(|child| levels(tree, child)).max().unwrap_or(0)
        }
        let points = octaves();
        let tree = VoxelVolumeTree::build(&points, 0.0).expect("small");
        // A few points are split off at each level, until medians are taken.
        let levels = levels(&tree, 0);
        assert!(levels > MAX_SWEPT_LEVELS as usize && levels <= MAX_LEVELS, "{levels}");
    }
}
