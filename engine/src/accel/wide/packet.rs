//! Twin of the kernels' traversal by packets: rays that go nearly the same way visit the nodes that any of them meets, in the order of the first ray.
//!
//! Source: J. Günther, S. Popov, H.-P. Seidel and P. Slusallek, "Realtime Ray Tracing on GPU with BVH-based Packet Traversal", IEEE RT 2007.
//!
//! A node and a triangle are fetched once for all. Hits are those of each ray alone, since a packet tests what each of its rays would test and more, and the
//! least candidate is the same; of a query for any hit it may be another one of the ray's hits.

use super::traverse::{wide_grid, wide_in_order, wide_span};
use super::{MAX_DEPTH, SLOTS, WideBvh, WideNode};
use crate::accel::box_test::BoxTest;
use crate::accel::triangle::{RayShear, intersect_triangle, ray_shear};
use crate::accel::{Hit, Ray, TraversalCounters};
use glam::Vec3;

/// A ray of a packet.
#[derive(Debug, Clone, Copy)]
struct Member<'a> {
    ray: &'a Ray,
    boxes: BoxTest,
    octant: u32,
    shear: RayShear,
    hit: Hit,
    /// Whether it still looks for something.
    waits: bool,
}

impl<'a> Member<'a> {
    fn new(bvh: &WideBvh, ray: &'a Ray) -> Self {
        let boxes = BoxTest::new(&bvh.bounds(), ray);
        Self {
            ray,
            boxes,
            octant: (0..3).fold(0, |octant, axis| octant | u32::from(boxes.inverse[axis] < 0.0) << axis),
            shear: ray_shear(Vec3::from(ray.origin), Vec3::from(ray.direction)),
            hit: Hit::none(ray.t_max),
            waits: ray.is_traceable(),
        }
    }

    /// Slots whose boxes it meets.
    fn meets(&self, node: &WideNode) -> u32 {
        let grid = wide_grid(&self.boxes, node);
        (0..SLOTS).fold(0, |met, slot| {
            let (near, far) = wide_span(&grid, node, self.octant, slot);
            met | u32::from(near.max(self.ray.t_min) <= far.min(self.hit.t)) << slot
        })
    }
}

/// What a ray of a packet has met, and whether it is done; where it is not, the quota has stopped the packet, and the ray has to be traced anew.
pub type PacketHit = (Hit, bool);

/// Traces rays as one packet, for `quota` iterations and a node's triangles at most; `any` for queries that the first hit ends. Of the counters, nodes and
/// triangles count once for the packet.
pub fn trace_packet(
    bvh: &WideBvh,
    rays: &[Ray],
    any: bool,
    quota: u64,
    counters: &mut TraversalCounters,
) -> Vec<PacketHit> {
    let mut members: Vec<Member<'_>> = rays.iter().map(|ray| Member::new(bvh, ray)).collect();
    let first = members.iter().find(|member| member.waits).map(|member| member.octant);
    let mut next = first.map(|_| 0u32);
    let octant = first.unwrap_or_default();
    // First child, places in the order that are left, and slots that hold children.
    let mut stack: Vec<(u32, u32, u32)> = Vec::with_capacity(MAX_DEPTH as usize);
    let mut group = (0, 0, 0);
    let mut iterations = 0;
    while let Some(place) = next.filter(|_| iterations < quota) {
        iterations += 1;
        counters.nodes += 1;
        let node = &bvh.nodes()[place as usize];
        let waiting = members.iter().filter(|member| member.waits);
        let met = waiting.fold(0, |met, member| met | member.meets(node));
        let order = wide_in_order(met & node.inner(), octant);
        if order != 0 {
            if group.1 != 0 {
                stack.push(group);
            }
            group = (node.children, order, node.inner());
        } else if group.1 == 0
            && let Some(top) = stack.pop()
        {
            group = top;
        }
        next = (group.1 != 0).then(|| {
            let slot = group.1.trailing_zeros() ^ octant;
            group.1 &= group.1 - 1;
            group.0 + (group.2 & ((1 << slot) - 1)).count_ones()
        });
        let mut tested = 0;
        for slot in (0..SLOTS).filter(|slot| met >> slot & 1 != 0) {
            let (first, count) = node.leaf(slot);
            for triangle in &bvh.triangles()[first as usize..][..count as usize] {
                tested += 1;
                for member in members.iter_mut().filter(|member| member.waits) {
                    let corners = &triangle.corners;
                    let Some(found) = intersect_triangle(&member.shear, corners, member.ray.t_min, member.hit.t) else {
                        continue;
                    };
                    if found.t < member.hit.t || triangle.index < member.hit.triangle {
                        member.hit = Hit {
                            t: found.t,
                            barycentrics: [found.u, found.v],
                            triangle: triangle.index,
                        };
                        member.waits = !any;
                    }
                }
            }
        }
        iterations += tested;
        counters.triangles += tested;
        if any && tested > 0 && !members.iter().any(|member| member.waits) {
            next = None;
        }
    }
    counters.iterations += iterations;
    members
        .iter()
        .map(|member| (member.hit, next.is_none() || !member.waits))
        .collect()
}
