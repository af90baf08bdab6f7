//! Twin of the kernels' traversal of the wide hierarchy: same order, same f32 operations, and, without a filter of candidates, the same counters. With
//! one the kernels count a round more for each candidate that they ask about.
//!
//! A node's slots are visited in the order of slot ^ octant, where a bit of the ray's octant is set if the ray goes down along that axis: the order of
//! all nodes is thus fixed for a ray, and a place in it is named by a node. All triangles of a node that are in boxes which the ray meets are tested
//! before its children are visited. A traversal that its quota stops in front of a node goes on from there later: the walk from the
//! root to that node tests boxes again and leaves out what comes before the walk in the order, triangles included, which rebuilds the stack, less what
//! the hit so far has culled. Nothing is lost, and nothing is tested twice.
//!
//! # Why no hit is culled
//!
//! With the terms of [`BOX_SLACK`](crate::accel::box_test::BOX_SLACK), the triangle test reports t so that the ray there is within 34uM of the
//! triangle along each axis. A plane P = corner + q · step of a decoded box is exact, and not inside of the box that it bounds; the corner is within
//! 1.02M of the origin along each axis, and q · step within 2.04M, since a grid is at most 2/127 larger than its node. The ray parameter of
//! the plane, less or plus the slack, is (corner − origin) · inverse ∓ slack + q · (step · inverse), where step · inverse and the parts of q are exact
//! by powers of two. First order in u, times M/|d|:
//!
//! - difference 1.02u, its product 1.02u, subtracting the slack 1.02u;
//! - q's product 2.04u;
//! - the sum 1.02u;
//! - the reciprocal, which is common to both parts: 5u of the whole distance, 5.1u.
//!
//! Altogether under 12uM/|d|, with the triangle test's 34uM under 46uM of the 64uM by which boxes are grown. Where a node has less extent than 2⁻⁷³ m,
//! and the scene no more, the triangle test underflows before this bound fails.

use super::{MAX_DEPTH, SLOTS, WideBvh, WideNode};
use crate::accel::box_test::BoxTest;
use crate::accel::bvh2::Step;
use crate::accel::triangle::{RayShear, intersect_triangle, ray_shear};
use crate::accel::{CandidateFilter, FINISHED, Hit, Ray, TraversalCounters};
use crate::gpu::shaders::constants;
use glam::Vec3;

/// The grid of a node as a ray meets it.
#[derive(Debug, Clone, Copy)]
pub struct WideGrid {
    /// Ray parameters from a plane to the next.
    pub scale: Vec3,
    /// Parameter of the corner, less the slack.
    pub near: Vec3,
    /// The same plus the slack.
    pub far: Vec3,
}

/// The grid of a node for a ray.
pub fn wide_grid(boxes: &BoxTest, node: &WideNode) -> WideGrid {
    let at_corner = (node.corner - boxes.origin) * boxes.inverse;
    WideGrid {
        scale: Vec3::from_array([0, 1, 2].map(|axis| node.step(axis))) * boxes.inverse,
        near: at_corner - boxes.slack,
        far: at_corner + boxes.slack,
    }
}

/// Entry and exit distance of the decoded box of a slot; the entry is greater where the box is missed.
pub fn wide_span(grid: &WideGrid, node: &WideNode, octant: u32, slot: usize) -> (f32, f32) {
    let (mut near, mut far) = (Vec3::ZERO, Vec3::ZERO);
    for axis in 0..3 {
        let backwards = (octant >> axis & 1) as usize;
        let [first, second] = [backwards, 1 - backwards].map(|side| f32::from(node.planes[axis][side][slot]));
        near[axis] = first * grid.scale[axis] + grid.near[axis];
        far[axis] = second * grid.scale[axis] + grid.far[axis];
    }
    (near.max_element(), far.min_element())
}

/// Bits of slots as bits of places in a ray's order, place = slot ^ octant, and the other way round.
pub fn wide_in_order(slots: u32, octant: u32) -> u32 {
    (0..SLOTS as u32).fold(0, |order, slot| order | (slots >> slot & 1) << (slot ^ octant))
}

/// A traversal between two runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WideTraversal {
    /// Best hit so far.
    pub hit: Hit,
    /// The node to go on with, 0 at the start, or [`FINISHED`].
    pub resume: u32,
    any: bool,
}

/// Children of a node that are left.
#[derive(Debug, Clone, Copy, Default)]
struct Group {
    children: u32,
    /// Places in the ray's order.
    order: u32,
    /// Slots that hold child nodes.
    inner: u32,
}

impl WideTraversal {
    /// Starts a closest-hit query.
    pub fn closest(ray: &Ray) -> Self {
        Self {
            hit: Hit::none(ray.t_max),
            resume: 0,
            any: false,
        }
    }

    /// Starts an any-hit query: the first accepted candidate ends it.
    pub fn any(ray: &Ray) -> Self {
        Self {
            any: true,
            ..Self::closest(ray)
        }
    }

    /// Runs for about `quota` iterations, at least 1; [`Self::resume`] says whether it is done.
    ///
    /// It stops in front of nodes only, so a node, its triangles and a round may come on top of the quota. The walk back takes an iteration a level: a
    /// quota above [`MAX_DEPTH`] makes progress.
    pub fn run(
        &mut self,
        bvh: &WideBvh,
        ray: &Ray,
        quota: u64,
        filter: CandidateFilter<'_>,
        counters: &mut TraversalCounters,
    ) {
        self.run_watched(bvh, ray, quota, filter, counters, |_| {});
    }

    /// As [`Self::run`]; `watch` sees each node and each triangle, in order.
    pub fn run_watched(
        &mut self,
        bvh: &WideBvh,
        ray: &Ray,
        quota: u64,
        filter: CandidateFilter<'_>,
        counters: &mut TraversalCounters,
        mut watch: impl FnMut(Step),
    ) {
        if self.resume == FINISHED {
            return;
        }
        if !ray.is_traceable() {
            self.resume = FINISHED;
            return;
        }
        let boxes = BoxTest::new(&bvh.bounds(), ray);
        let octant = (0..3).fold(0, |octant, axis| octant | u32::from(boxes.inverse[axis] < 0.0) << axis);
        let shear = ray_shear(Vec3::from(ray.origin), Vec3::from(ray.direction));
        let nodes = bvh.nodes();
        let mut way = way_to(nodes, self.resume);
        let mut stack: Vec<Group> = Vec::with_capacity(MAX_DEPTH as usize);
        let mut group = Group::default();
        let mut next = 0;
        let mut iterations = 0;
        while next != FINISHED && iterations < quota {
            let node = loop {
                iterations += 1;
                counters.nodes += 1;
                watch(Step::Node);
                let node = &nodes[next as usize];
                let (mut order, mut leaves) = self.boxes_met(node, &boxes, octant, ray.t_min);
                if let Some(slot) = way.pop() {
                    let place = slot ^ octant;
                    order &= u32::MAX << place;
                    leaves = 0;
                    if order >> place & 1 == 0 {
                        way.clear();
                    }
                }
                if order != 0 {
                    if group.order != 0 {
                        stack.push(group);
                    }
                    group = Group {
                        children: node.children,
                        order,
                        inner: node.inner(),
                    };
                } else if group.order == 0
                    && let Some(top) = stack.pop()
                {
                    group = top;
                }
                next = FINISHED;
                if group.order != 0 {
                    let slot = group.order.trailing_zeros() ^ octant;
                    next = group.children + (group.inner & ((1 << slot) - 1)).count_ones();
                    group.order &= group.order - 1;
                }
                if leaves != 0 || next == FINISHED || iterations >= quota {
                    break (node, leaves);
                }
            };
            let tested = counters.triangles;
            if self.test_triangles(bvh, node, &shear, ray.t_min, filter, counters) {
                next = FINISHED;
            }
            let tested = counters.triangles - tested;
            (0..tested).for_each(|_| watch(Step::Triangle));
            iterations += tested + u64::from(constants::WIDE_ROUND_ITERATIONS);
        }
        counters.iterations += iterations;
        self.resume = next;
    }

    /// Places in the ray's order of the child nodes that it meets, and slots of the leaves.
    fn boxes_met(&self, node: &WideNode, boxes: &BoxTest, octant: u32, t_min: f32) -> (u32, u32) {
        let grid = wide_grid(boxes, node);
        let met = (0..SLOTS).fold(0u32, |met, slot| {
            let (near, far) = wide_span(&grid, node, octant, slot);
            met | u32::from(near.max(t_min) <= far.min(self.hit.t)) << slot
        });
        let leaves = (0..SLOTS).fold(0, |leaves, slot| leaves | u32::from(node.leaf(slot).1 > 0) << slot);
        (wide_in_order(met & node.inner(), octant), met & leaves)
    }

    /// Tests the triangles of a node's slots; true when that answers the query.
    fn test_triangles(
        &mut self,
        bvh: &WideBvh,
        (node, leaves): (&WideNode, u32),
        shear: &RayShear,
        t_min: f32,
        filter: CandidateFilter<'_>,
        counters: &mut TraversalCounters,
    ) -> bool {
        for slot in (0..SLOTS).filter(|slot| leaves >> slot & 1 != 0) {
            let (first, count) = node.leaf(slot);
            for tested in &bvh.triangles()[first as usize..][..count as usize] {
                counters.triangles += 1;
                let Some(candidate) = intersect_triangle(shear, &tested.corners, t_min, self.hit.t) else {
                    continue;
                };
                let (triangle, barycentrics) = (tested.index, [candidate.u, candidate.v]);
                let better = candidate.t < self.hit.t || triangle < self.hit.triangle;
                if better && filter(triangle, barycentrics) {
                    self.hit = Hit {
                        t: candidate.t,
                        barycentrics,
                        triangle,
                    };
                    if self.any {
                        return true;
                    }
                }
            }
        }
        false
    }
}

/// The slots on the way from the root to a node, the root's last.
fn way_to(nodes: &[WideNode], mut node: u32) -> Vec<u32> {
    let mut way = Vec::new();
    while node != 0 {
        let parent = nodes[node as usize].parent;
        way.push(parent & constants::WIDE_SLOT_MASK);
        node = parent >> constants::WIDE_SLOT_BITS;
    }
    way
}
