//! Twin of the kernels' traversal of the binary hierarchy: same order, same f32 operations, exact counters.
//!
//! One loop; an iteration visits one inner node or tests one triangle of a leaf. Children are visited near one first, by a distance that
//! does not depend on the hit so far: the order of all leaves is thus fixed for a ray, and a place in it is named by an inner node.
//! A traversal that its quota stops in front of an inner node goes on from there later: the walk from the root to that node pushes each
//! sibling that comes after the walk in the order, which rebuilds the stack, less what the hit so far has culled. Nothing is lost, and nothing
//! is tested twice.

use super::{Bvh2, Bvh2Triangle, COUNT_BITS, COUNT_MASK, MAX_DEPTH};
use crate::accel::box_test::BoxTest;
use crate::accel::triangle::{RayShear, intersect_triangle, ray_shear};
use crate::accel::{CandidateFilter, FINISHED, Hit, Ray, TraversalCounters};
use glam::Vec3;

/// A traversal between two runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Traversal {
    /// Best hit so far.
    pub hit: Hit,
    /// Word of the inner node to go on with, 0 at the start, or [`FINISHED`].
    pub resume: u32,
    any: bool,
}

/// What an iteration of a traversal does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// Tests the boxes of an inner node.
    Node,
    /// Tests a triangle.
    Triangle,
}

impl Traversal {
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
    /// It stops in front of inner nodes only, so the leaves that lie on top of the stack may come on top of the quota:
    /// (`MAX_DEPTH` + 1) × leaf size iterations at most. The walk back takes an iteration a level: a quota above `MAX_DEPTH` makes progress.
    pub fn run(
        &mut self,
        bvh: &Bvh2,
        ray: &Ray,
        quota: u64,
        filter: CandidateFilter<'_>,
        counters: &mut TraversalCounters,
    ) {
        self.run_watched(bvh, ray, quota, filter, counters, |_| {});
    }

    /// As [`Self::run`]; `watch` sees each iteration, in order.
    pub fn run_watched(
        &mut self,
        bvh: &Bvh2,
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
        let shear = ray_shear(Vec3::from(ray.origin), Vec3::from(ray.direction));
        let [a, b] = bvh.nodes()[0].bounds;
        let boxes = BoxTest::new(&a.union(b), ray);
        let (nodes, triangles) = (bvh.nodes(), bvh.triangles());
        let mut stack = [FINISHED; MAX_DEPTH as usize + 1];
        let mut top = 0;
        let (mut trail, mut replay) = trail_to(bvh, self.resume);
        let mut word = 0;
        let mut iterations = 0;
        while word != FINISHED && (iterations < quota || word & COUNT_MASK != 0) {
            iterations += 1;
            if word & COUNT_MASK == 0 {
                counters.nodes += 1;
                watch(Step::Node);
                let node = &nodes[(word >> COUNT_BITS) as usize];
                let [(near0, far0), (near1, far1)] = node.bounds.map(|b| boxes.span(b.lower, b.upper));
                let (enter0, enter1) = (near0.max(ray.t_min), near1.max(ray.t_min));
                let first = u32::from(enter1 < enter0);
                let hits = [enter0 <= far0.min(self.hit.t), enter1 <= far1.min(self.hit.t)];
                let on_trail = trail & 1;
                let passed = replay > 0 && on_trail != first;
                let visit_first = hits[first as usize] && !passed;
                let visit_second = hits[1 - first as usize];
                let next = if visit_first { first } else { 1 - first };
                replay = if replay > 0 && next == on_trail { replay - 1 } else { 0 };
                trail >>= 1;
                if visit_first && visit_second {
                    stack[top] = node.children[1 - first as usize];
                    top += 1;
                }
                if visit_first || visit_second {
                    word = node.children[next as usize];
                    continue;
                }
                replay = 0;
            } else {
                counters.triangles += 1;
                watch(Step::Triangle);
                let first = word >> COUNT_BITS;
                if self.test(&triangles[first as usize], &shear, ray.t_min, filter) && self.any {
                    word = FINISHED;
                    continue;
                }
                if word & COUNT_MASK > 1 {
                    word += COUNT_MASK;
                    continue;
                }
            }
            word = if top > 0 {
                top -= 1;
                stack[top]
            } else {
                FINISHED
            };
        }
        counters.iterations += iterations;
        self.resume = word;
    }

    /// Tests one triangle; true when it is the best hit now.
    fn test(&mut self, tested: &Bvh2Triangle, shear: &RayShear, t_min: f32, filter: CandidateFilter<'_>) -> bool {
        let Some(candidate) = intersect_triangle(shear, &tested.corners, t_min, self.hit.t) else {
            return false;
        };
        let triangle = tested.index;
        let barycentrics = [candidate.u, candidate.v];
        let better = candidate.t < self.hit.t || triangle < self.hit.triangle;
        if !better || !filter(triangle, barycentrics) {
            return false;
        }
        self.hit = Hit {
            t: candidate.t,
            barycentrics,
            triangle,
        };
        true
    }
}

/// The turns from the root to an inner node, the first in the lowest bit, and their number.
fn trail_to(bvh: &Bvh2, word: u32) -> (u32, u32) {
    let mut node = word >> COUNT_BITS;
    let (mut trail, mut length) = (0, 0);
    while node != 0 {
        let parent = bvh.nodes()[node as usize].parent;
        trail = trail << 1 | (parent & 1);
        length += 1;
        node = parent >> 1;
    }
    (trail, length)
}
