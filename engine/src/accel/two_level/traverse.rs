//! Twin of the kernels' traversal of two levels: same order, same f32 operations, and, without a filter of candidates, the same counters. With one the
//! kernels count a round and a search among instances more for each candidate that they ask about.
//!
//! Nodes are visited as in a wide tree ([`wide::traverse`](crate::accel::wide::traverse)), whose order goes on through instances: one stands in the place of a child
//! node, and when its turn comes the ray is taken to the space of its mesh, by the octant that it has there. What is left of the tree above waits on
//! the same stack until nothing is left of the mesh's. [`transform`](super::transform) shows that no hit is culled.
//!
//! A node that a ray stops in front of is named by its number among the nodes of all instances: those of the tree above, then each instance's own copy
//! of its mesh's. The way back goes from the tree above through the instance into the mesh.

use super::transform::{InstanceTransform, MIN_INSTANCE_COMPONENT, instance_rows};
use super::{InstanceNode, InstanceRecord, TwoLevelBvh};
use crate::accel::box_test::{BOX_SLACK, BoxTest};
use crate::accel::bvh2::Step;
use crate::accel::triangle::{RayShear, intersect_triangle, ray_shear};
use crate::accel::wide::traverse::{wide_grid, wide_in_order, wide_span};
use crate::accel::wide::{MAX_DEPTH, SLOTS, WideNode};
use crate::accel::{CandidateFilter, FINISHED, Hit, Ray, TraversalCounters};
use crate::gpu::shaders::constants;
use glam::Vec3;

/// A ray made ready for the boxes of an instance's mesh. `reach` is the largest component distance from its origin to a corner of the index's box.
/// Twin of the kernels' function of this name.
pub fn instance_box_test(transform: &InstanceTransform, ray: &Ray, reach: f32) -> BoxTest {
    let origin = instance_rows(&transform.inverse, Vec3::from(ray.origin) - transform.translation);
    let direction = instance_rows(&transform.inverse, Vec3::from(ray.direction));
    let least = direction.abs().max_element() * MIN_INSTANCE_COMPONENT;
    let inverse = Vec3::from_array(direction.to_array().map(|d| {
        let size = if d.abs() > least { d.abs() } else { least };
        (if d < 0.0 { -1.0 } else { 1.0 }) / size
    }));
    let sums = Vec3::from_array(transform.inverse.map(|row| {
        let row = row.abs();
        row.x + row.y + row.z
    }));
    BoxTest {
        origin,
        inverse,
        slack: (BOX_SLACK * reach * sums + transform.slack) * inverse.abs(),
    }
}

/// A traversal between two runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoLevelTraversal {
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
    /// Slots that hold child nodes or instances.
    held: u32,
    /// Slots that hold instances.
    instances: u32,
}

/// The space that a ray is in.
#[derive(Clone, Copy)]
struct Space {
    boxes: BoxTest,
    octant: u32,
}

impl Space {
    fn new(boxes: BoxTest) -> Self {
        Self {
            boxes,
            octant: (0..3).fold(0, |octant, axis| octant | u32::from(boxes.inverse[axis] < 0.0) << axis),
        }
    }
}

/// An instance that a ray is in.
#[derive(Clone, Copy)]
struct Inside {
    instance: usize,
    root: u32,
    /// Groups on the stack that are of the tree above.
    floor: usize,
}

impl TwoLevelTraversal {
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
    /// It stops in front of nodes only, so a node, its triangles and a round may come on top of the quota. The walk back takes an iteration a level, and
    /// a round where it goes into an instance: a quota of twice [`MAX_DEPTH`] and three rounds of `WIDE_ROUND_ITERATIONS`, which is the least that kernels
    /// are given, makes progress.
    pub fn run(
        &mut self,
        bvh: &TwoLevelBvh,
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
        bvh: &TwoLevelBvh,
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
        let bounds = bvh.bounds();
        let origin = Vec3::from(ray.origin);
        let reach = (bounds.lower - origin)
            .abs()
            .max((bounds.upper - origin).abs())
            .max_element();
        let world = Space::new(BoxTest::new(&bounds, ray));
        let shear = ray_shear(origin, Vec3::from(ray.direction));
        let nodes = bvh.nodes();
        let mut way = way_to(bvh, self.resume);
        let mut stack: Vec<Group> = Vec::with_capacity(2 * MAX_DEPTH as usize);
        let mut group = Group::default();
        let mut space = world;
        let mut inside: Option<Inside> = None;
        let mut next = 0;
        let mut iterations = 0;
        while next != FINISHED && iterations < quota {
            let (mut leaving, mut entering) = (false, false);
            let (node, leaves) = loop {
                iterations += 1;
                counters.nodes += 1;
                watch(Step::Node);
                let node = &nodes[next as usize];
                let (mut order, mut leaves) = self.boxes_met(node, &space, ray.t_min);
                if let Some(slot) = way.pop() {
                    let place = slot ^ space.octant;
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
                        held: node.inner(),
                        instances: instances_of(node),
                    };
                } else if group.order == 0 {
                    leaving = inside.is_some_and(|inside| inside.floor == stack.len());
                    if let Some(top) = stack.pop() {
                        group = top;
                    }
                }
                next = FINISHED;
                if group.order != 0 {
                    let octant = if leaving { world.octant } else { space.octant };
                    let slot = group.order.trailing_zeros() ^ octant;
                    next = group.children + (group.held & ((1 << slot) - 1)).count_ones();
                    entering = group.instances >> slot & 1 != 0;
                    group.order &= group.order - 1;
                }
                if leaves != 0 || leaving || entering || next == FINISHED || iterations >= quota {
                    break (node, leaves);
                }
            };
            let tested = counters.triangles;
            let within = inside.map(|inside| inside.instance);
            if self.test_triangles(bvh, (node, leaves), within, &shear, ray.t_min, filter, counters) {
                next = FINISHED;
                entering = false;
            }
            let tested = counters.triangles - tested;
            (0..tested).for_each(|_| watch(Step::Triangle));
            iterations += tested + u64::from(constants::WIDE_ROUND_ITERATIONS);
            if leaving {
                space = world;
                inside = None;
            }
            if entering {
                let node: InstanceNode = bytemuck::cast(nodes[next as usize]);
                let instance = node.instance as usize;
                space = Space::new(instance_box_test(&bvh.transforms[instance], ray, reach));
                if group.order != 0 {
                    stack.push(group);
                }
                group = Group::default();
                next = node.root;
                inside = Some(Inside {
                    instance,
                    root: node.root,
                    floor: stack.len(),
                });
            }
        }
        counters.iterations += iterations;
        self.resume = match inside {
            Some(inside) if next != FINISHED => bvh.records()[inside.instance].first_node + (next - inside.root),
            _ => next,
        };
    }

    /// Places in the ray's order of the child nodes and instances that it meets, and slots of the leaves.
    fn boxes_met(&self, node: &WideNode, space: &Space, t_min: f32) -> (u32, u32) {
        let grid = wide_grid(&space.boxes, node);
        let met = (0..SLOTS).fold(0u32, |met, slot| {
            let (near, far) = wide_span(&grid, node, space.octant, slot);
            met | u32::from(near.max(t_min) <= far.min(self.hit.t)) << slot
        });
        let leaves = (0..SLOTS).fold(0, |leaves, slot| leaves | u32::from(node.leaf(slot).1 > 0) << slot);
        (wide_in_order(met & node.inner(), space.octant), met & leaves)
    }

    /// Tests the images of the triangles of a node's slots; true when that answers the query.
    #[expect(
        clippy::too_many_arguments,
        reason = "what a node's triangles are tested with is all of the ray's state"
    )]
    fn test_triangles(
        &mut self,
        bvh: &TwoLevelBvh,
        (node, leaves): (&WideNode, u32),
        instance: Option<usize>,
        shear: &RayShear,
        t_min: f32,
        filter: CandidateFilter<'_>,
        counters: &mut TraversalCounters,
    ) -> bool {
        let Some(instance) = instance else {
            return false;
        };
        let (transform, first_index) = (&bvh.transforms[instance], bvh.records()[instance].first);
        for slot in (0..SLOTS).filter(|slot| leaves >> slot & 1 != 0) {
            let (first, count) = node.leaf(slot);
            for tested in &bvh.triangles()[first as usize..][..count as usize] {
                counters.triangles += 1;
                let image = transform.triangle(tested.corners);
                let Some(candidate) = intersect_triangle(shear, &image, t_min, self.hit.t) else {
                    continue;
                };
                let (triangle, barycentrics) = (first_index + tested.index, [candidate.u, candidate.v]);
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

/// Slots that hold instances.
fn instances_of(node: &WideNode) -> u32 {
    node.exponents >> constants::TWO_LEVEL_INSTANCE_SHIFT
}

/// The slots on the way from the root to a node, the root's last.
fn way_to(bvh: &TwoLevelBvh, resume: u32) -> Vec<u32> {
    let mut way = Vec::new();
    let nodes = bvh.nodes();
    let mut climb = |mut node: u32, root: u32| {
        while node != root {
            let parent = nodes[node as usize].parent;
            way.push(parent & constants::WIDE_SLOT_MASK);
            node = parent >> constants::WIDE_SLOT_BITS;
        }
    };
    let records: &[InstanceRecord] = bvh.records();
    let mut node = resume;
    if resume >= bvh.header().top {
        let record = &records[records.partition_point(|record| record.first_node <= resume) - 1];
        let inner: InstanceNode = bytemuck::cast(nodes[record.place as usize]);
        climb(inner.root + (resume - record.first_node), inner.root);
        node = record.place;
    }
    climb(node, 0);
    way
}
