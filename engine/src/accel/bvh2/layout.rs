//! The binary hierarchy as kernels read it, filled by whoever built it, and measured.
//!
//! Guarantee: everything is filled and summed in parts that depend on the tree alone, so bytes and statistics are the same whatever the
//! number of threads.

use super::{Bvh2, Bvh2Node, Bvh2Triangle, COUNT_BITS, NODE_QUARTERS, TRIANGLE_QUARTERS, leaf_word};
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

/// Bits of a child word that hold the number of triangles.
const COUNT_MASK: u32 = (1 << COUNT_BITS) - 1;

/// Nodes, the root first with its parent word 0, and triangles in leaf order; zero at first.
pub(in crate::accel) struct Layout {
    quarters: Vec<[u32; 4]>,
    nodes: usize,
}

impl Layout {
    /// Room for so many of each, at least one node.
    pub(in crate::accel) fn new(nodes: usize, triangles: usize) -> Self {
        Self {
            quarters: vec![[0; 4]; NODE_QUARTERS * nodes + TRIANGLE_QUARTERS * triangles],
            nodes,
        }
    }

    /// What a device has filled.
    pub(in crate::accel) fn filled(quarters: Vec<[u32; 4]>, nodes: usize) -> Self {
        Self { quarters, nodes }
    }

    /// Finished nodes over `count` triangles. Fewer than two have no node; one is made.
    pub(in crate::accel) fn of(
        nodes: &[Bvh2Node],
        count: usize,
        triangle: impl Fn(usize) -> Bvh2Triangle + Sync,
    ) -> Self {
        if nodes.is_empty() {
            let triangle = (count > 0).then(|| triangle(0));
            return Self::without_split(triangle);
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

    /// One node over at most one triangle.
    fn without_split(triangle: Option<Bvh2Triangle>) -> Self {
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
        let (nodes, _) = self.parts();
        nodes[0].triangles = triangles;
        measure(nodes, &mut statistics);
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

/// What a part of the tree adds to the statistics.
#[derive(Debug, Clone, Copy, Default)]
struct Measure {
    cost: f64,
    leaves: u64,
    max_depth: u32,
}

impl Measure {
    /// Adds a node that is `depth` deep, and gives those of its children that are nodes.
    fn add(&mut self, node: &Bvh2Node, depth: u32, triangles: u32) -> impl Iterator<Item = u32> + use<> {
        self.max_depth = self.max_depth.max(depth);
        for (bounds, word) in node.bounds.iter().zip(node.children) {
            let count = word & COUNT_MASK;
            self.cost += bounds.half_area() * f64::from(count.max(1));
            self.leaves += u64::from(count > 0 && word >> COUNT_BITS < triangles);
        }
        let inner = node.children.into_iter().filter(|word| word & COUNT_MASK == 0);
        inner.map(|word| word >> COUNT_BITS)
    }

    /// Adds a subtree.
    fn add_below(mut self, nodes: &[Bvh2Node], root: (u32, u32), triangles: u32) -> Self {
        let mut pending = vec![root];
        while let Some((node, depth)) = pending.pop() {
            let children = self.add(&nodes[node as usize], depth, triangles);
            pending.extend(children.map(|child| (child, depth + 1)));
        }
        self
    }

    fn with(self, other: Self) -> Self {
        Self {
            cost: self.cost + other.cost,
            leaves: self.leaves + other.leaves,
            max_depth: self.max_depth.max(other.max_depth),
        }
    }
}

/// Counts nodes, leaves, depth and the SAH cost: the top of the tree, then each subtree below it.
fn measure(nodes: &[Bvh2Node], statistics: &mut IndexStatistics) {
    let triangles = statistics.triangles as u32;
    let mut top = Measure::default();
    let mut subtrees = vec![(0, 1)];
    while !subtrees.is_empty() && subtrees.len() < MEASURED_SUBTREES {
        let level = std::mem::take(&mut subtrees);
        for (node, depth) in level {
            let children = top.add(&nodes[node as usize], depth, triangles);
            subtrees.extend(children.map(|child| (child, depth + 1)));
        }
    }
    let below: Vec<Measure> = subtrees
        .par_iter()
        .map(|subtree| Measure::default().add_below(nodes, *subtree, triangles))
        .collect();
    let all = below.into_iter().fold(top, Measure::with);
    let root = nodes[0].bounds[0].union(nodes[0].bounds[1]).half_area();
    statistics.nodes = nodes.len() as u64;
    statistics.leaves = all.leaves;
    statistics.max_depth = all.max_depth;
    statistics.sah_cost = if root > 0.0 { (root + all.cost) / root } else { 0.0 };
}
