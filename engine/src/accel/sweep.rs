//! Trees by full sweeps, one builder for each measure of a visit: volumes for queries by points, surface areas for rays. Yardsticks of quality,
//! built at leisure.
//!
//! Sources: the voxel volume heuristic for bounding volume hierarchies of photon maps, B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis,
//! Trinity College Dublin, 2011, §6.1.1: a point query visits the nodes that contain it, so a node's share is that of its volume; for
//! rays, D. MacDonald and K. Booth, "Heuristics for Ray Tracing Using Space Subdivision", The Visual Computer 6, 1990. Primitives are sorted
//! by their centres on each axis, and every border is tried.
//!
//! Guarantee: deterministic; at most [`MAX_SWEEP_DEPTH`] inner nodes deep; where no border is better than another, as with equal centres or
//! boxes without volume, the median is taken.

use crate::accel::Aabb;
use crate::accel::box_tree::{BoxTree, Child, EMPTY_NODE, PairNode};
use crate::accel::morton::doubled_centre;
use crate::catalogue::{Role, Row, sources};

/// Most inner nodes on a way from the root.
pub const MAX_SWEEP_DEPTH: u32 = 64;

struct Sweep<'a> {
    boxes: &'a [Aabb],
    leaf_size: usize,
    /// What a node's probability of a visit goes by.
    measure: fn(&Aabb) -> f64,
    nodes: Vec<PairNode>,
}

/// The tree of the voxel volume heuristic, for queries by points: over boxes, with leaves of at most `leaf_size` primitives unless the depth,
/// [`MAX_SWEEP_DEPTH`], ends first.
pub fn volume_sweep_tree(boxes: &[Aabb], leaf_size: u32) -> BoxTree {
    sweep_tree(boxes, leaf_size, Aabb::volume)
}

/// The same by the surface area heuristic, for rays.
pub fn area_sweep_tree(boxes: &[Aabb], leaf_size: u32) -> BoxTree {
    sweep_tree(boxes, leaf_size, Aabb::half_area)
}

fn sweep_tree(boxes: &[Aabb], leaf_size: u32, measure: fn(&Aabb) -> f64) -> BoxTree {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut sweep = Sweep {
        boxes,
        leaf_size: leaf_size.max(1) as usize,
        measure,
        nodes: Vec::new(),
    };
    let (bounds, root) = sweep.build(&mut order, 0, MAX_SWEEP_DEPTH);
    BoxTree {
        order,
        nodes: sweep.nodes,
        bounds,
        root,
    }
}

impl Sweep<'_> {
    fn build(&mut self, order: &mut [u32], first: u32, levels_left: u32) -> (Aabb, Child) {
        let count = order.len();
        if count <= self.leaf_size || levels_left == 0 {
            let leaf = Child::Leaf {
                first,
                count: count as u32,
            };
            return (self.bounds(order), leaf);
        }
        let middle = self.split(order);
        let node = self.nodes.len();
        self.nodes.push(EMPTY_NODE);
        let (left, right) = order.split_at_mut(middle);
        let left = self.build(left, first, levels_left - 1);
        let right = self.build(right, first + middle as u32, levels_left - 1);
        self.nodes[node].bounds = [left.0, right.0];
        self.nodes[node].children = [left.1, right.1];
        (left.0.union(right.0), Child::Inner(node as u32))
    }

    fn bounds(&self, order: &[u32]) -> Aabb {
        order.iter().fold(Aabb::EMPTY, |b, i| b.union(self.boxes[*i as usize]))
    }

    /// Orders the primitives along the best axis and says where the right half begins. Node visits cost nothing here, as in the source, so
    /// a split never costs more than a leaf, and the leaf size alone ends the tree.
    fn split(&self, order: &mut [u32]) -> usize {
        let count = order.len();
        let mut best = (f64::INFINITY, 0, count / 2);
        let mut right_costs = vec![0.0; count];
        for axis in 0..3 {
            self.sort(order, axis);
            let mut bounds = Aabb::EMPTY;
            for i in (1..count).rev() {
                bounds = bounds.union(self.boxes[order[i] as usize]);
                right_costs[i] = (self.measure)(&bounds) * (count - i) as f64;
            }
            bounds = Aabb::EMPTY;
            let centre = |i: usize| doubled_centre(&self.boxes[order[i] as usize])[axis];
            if centre(0) == centre(count - 1) {
                continue;
            }
            for i in 1..count {
                bounds = bounds.union(self.boxes[order[i - 1] as usize]);
                let cost = (self.measure)(&bounds) * i as f64 + right_costs[i];
                // Nearest to the median among equals: boxes without volume all cost nothing.
                let nearer = i.abs_diff(count / 2) < best.2.abs_diff(count / 2);
                if cost < best.0 || (cost == best.0 && nearer) {
                    best = (cost, axis, i);
                }
            }
        }
        self.sort(order, best.1);
        best.2
    }

    fn sort(&self, order: &mut [u32], axis: usize) {
        let centre = |i: u32| doubled_centre(&self.boxes[i as usize])[axis];
        order.sort_unstable_by(|a, b| centre(*a).total_cmp(&centre(*b)).then(a.cmp(b)));
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-MAP-3",
    name: "tree by the voxel volume heuristic",
    role: Role::Yardstick,
    limits: "Built by full sweeps: too slow for a map that is rebuilt for each pass.",
    sources: &[sources::FABIANOWSKI_2011.at("§6.1.1")],
    tests: &[
        "engine/src/accel/photon_map/tests.rs::every_split_of_a_sweep_has_the_least_cost_by_its_own_measure",
        "engine/src/accel/photon_map/tests.rs::sweeps_are_valid_and_beat_the_linear_tree",
    ],
    api: &["clerestory::accel::yardstick::volume_sweep_tree"],
    ..Row::of(file!())
}];
