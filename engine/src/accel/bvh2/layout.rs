//! The binary hierarchy as kernels read it, filled by whoever built it, and measured.
//!
//! Guarantee: everything is filled and summed in parts that depend on the nodes alone, so bytes and statistics are the same whatever the
//! number of threads.

use super::{Bvh2, Bvh2Node, Bvh2Triangle, COUNT_BITS, COUNT_MASK, NODE_QUARTERS, TRIANGLE_QUARTERS, leaf_word};
use crate::accel::input::bounds_of;
use crate::accel::stages::Stopwatch;
use crate::accel::{Aabb, BuildStages, IndexStatistics, NO_HIT};
use bytemuck::Zeroable;
use glam::Vec3;
use rayon::prelude::*;

/// Nodes or triangles that a task fills.
const CHUNK: usize = 2048;

/// Subtrees that are measured on their own, at least, where there are as many.
const MEASURED_SUBTREES: usize = 64;

/// Nodes, the root first with its parent word 0, and triangles in leaf order; zero at first.
pub(in crate::accel) struct Layout {
    quarters: Vec<[u32; 4]>,
    nodes: usize,
    /// Most inner nodes on a way from the root, where the builder knows.
    depth: Option<u32>,
}

impl Layout {
    /// Room for so many of each, at least one node.
    pub(in crate::accel) fn new(nodes: usize, triangles: usize) -> Self {
        Self {
            quarters: vec![[0; 4]; NODE_QUARTERS * nodes + TRIANGLE_QUARTERS * triangles],
            nodes,
            depth: None,
        }
    }

    /// What a device has filled.
    pub(in crate::accel) fn filled(quarters: Vec<[u32; 4]>, nodes: usize) -> Self {
        Self {
            quarters,
            nodes,
            depth: None,
        }
    }

    /// Most inner nodes on a way from the root, which [`Layout::finish`] need not find out then.
    pub(in crate::accel) fn with_depth(self, depth: u32) -> Self {
        Self {
            depth: Some(depth),
            ..self
        }
    }

    /// Finished nodes over `count` triangles. Fewer than two have no node; one is made.
    pub(in crate::accel) fn of(
        nodes: &[Bvh2Node],
        count: usize,
        triangle: impl Fn(usize) -> Bvh2Triangle + Sync,
    ) -> Self {
        if nodes.is_empty() {
            let triangle = (count > 0).then(|| triangle(0));
            return Self::of_at_most_one(triangle);
        }
        let mut layout = Self::new(nodes.len(), count);
        let (to, triangles) = layout.parts();
        rayon::join(
            || {
                to.par_chunks_mut(CHUNK)
                    .zip(nodes.par_chunks(CHUNK))
                    .for_each(|(to, from)| to.copy_from_slice(from));
            },
            || fill_triangles(triangles, &triangle),
        );
        layout
    }

    /// The root over one triangle or none, which no builder makes a node for.
    fn of_at_most_one(triangle: Option<Bvh2Triangle>) -> Self {
        let bounds = triangle.map_or(Aabb::EMPTY.with_point(Vec3::ZERO), |t| bounds_of(&t.corners));
        // A point triangle, which no ray meets, keeps the buffers and the root's children from being empty.
        let sentinel = Bvh2Triangle::new([bounds.lower; 3], NO_HIT);
        let all: Vec<Bvh2Triangle> = triangle.into_iter().chain([sentinel]).collect();
        let mut layout = Self::new(1, all.len());
        let (nodes, triangles) = layout.parts();
        triangles.copy_from_slice(&all);
        nodes[0] = Bvh2Node {
            bounds: [bounds, Aabb::EMPTY.with_point(bounds.lower)],
            children: [leaf_word(0, 1), leaf_word(all.len() as u32 - 1, 1)],
            ..Bvh2Node::zeroed()
        };
        layout
    }

    /// Nodes and triangles.
    pub(in crate::accel) fn parts(&mut self) -> (&mut [Bvh2Node], &mut [Bvh2Triangle]) {
        let (nodes, triangles) = self.quarters.split_at_mut(NODE_QUARTERS * self.nodes);
        (bytemuck::cast_slice_mut(nodes), bytemuck::cast_slice_mut(triangles))
    }

    /// The index, measured. `statistics` has counted the triangles, and `watch` has begun the last stage.
    pub(in crate::accel) fn finish(
        mut self,
        name: &'static str,
        mut statistics: IndexStatistics,
        mut stages: BuildStages,
        mut watch: Stopwatch,
    ) -> Bvh2 {
        let triangles = (NODE_QUARTERS * self.nodes) as u32;
        let depth = self.depth;
        let (nodes, _) = self.parts();
        nodes[0].triangles = triangles;
        measure(nodes, &mut statistics);
        statistics.max_depth = depth.unwrap_or_else(|| depth_of(nodes));
        statistics.bytes = size_of_val(self.quarters.as_slice()) as u64;
        stages.statistics = watch.lap();
        Bvh2 {
            name,
            quarters: self.quarters,
            nodes: self.nodes,
            statistics,
            stages,
        }
    }
}

/// Fills triangles by their places.
pub(in crate::accel) fn fill_triangles(
    triangles: &mut [Bvh2Triangle],
    triangle: impl Fn(usize) -> Bvh2Triangle + Sync,
) {
    let chunks = triangles.par_chunks_mut(CHUNK).enumerate();
    chunks.for_each(|(i, chunk)| {
        for (j, to) in chunk.iter_mut().enumerate() {
            *to = triangle(i * CHUNK + j);
        }
    });
}

/// Counts nodes and leaves, and sums the SAH cost.
fn measure(nodes: &[Bvh2Node], statistics: &mut IndexStatistics) {
    let triangles = statistics.triangles as u32;
    let chunks: Vec<(f64, u64)> = nodes
        .par_chunks(CHUNK)
        .map(|chunk| {
            let children = chunk.iter().flat_map(|node| node.bounds.iter().zip(node.children));
            children.fold((0.0, 0), |(cost, leaves), (bounds, word)| {
                let count = word & COUNT_MASK;
                // The sentinel lies beyond the triangles.
                let is_leaf = count > 0 && word >> COUNT_BITS < triangles;
                (
                    cost + bounds.half_area() * f64::from(count.max(1)),
                    leaves + u64::from(is_leaf),
                )
            })
        })
        .collect();
    let root = nodes[0].bounds[0].union(nodes[0].bounds[1]).half_area();
    let below: f64 = chunks.iter().map(|(cost, _)| cost).sum();
    statistics.nodes = nodes.len() as u64;
    statistics.leaves = chunks.iter().map(|(_, leaves)| leaves).sum();
    statistics.sah_cost = if root > 0.0 { (root + below) / root } else { 0.0 };
}

/// Most inner nodes on a way from the root.
fn depth_of(nodes: &[Bvh2Node]) -> u32 {
    let children = |(node, depth): (u32, u32)| {
        let inner = nodes[node as usize]
            .children
            .into_iter()
            .filter(|word| word & COUNT_MASK == 0);
        inner.map(move |word| (word >> COUNT_BITS, depth + 1))
    };
    let mut level = vec![(0, 1)];
    let mut depth = 0;
    while !level.is_empty() && level.len() < MEASURED_SUBTREES {
        depth += 1;
        level = level.into_iter().flat_map(children).collect();
    }
    let below = level.into_par_iter().map(|subtree| {
        let mut deepest = 0;
        let mut pending = vec![subtree];
        while let Some(node) = pending.pop() {
            deepest = deepest.max(node.1);
            pending.extend(children(node));
        }
        deepest
    });
    below.max().unwrap_or(0).max(depth)
}
