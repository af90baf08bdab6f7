//! The linear hierarchy as a ray index: over triangles, in the node layout that the path tracer traverses.

use super::codes::{Codes, SortedCodes};
use super::radix_tree::{Splits, hierarchy};
use crate::Result;
use crate::accel::box_tree::{BoxTree, Child};
use crate::accel::bvh2::layout::{Layout, fill_triangles};
use crate::accel::bvh2::{Bvh2, Bvh2Node, Bvh2Triangle, COUNT_BITS, COUNT_MASK, MAX_DEPTH, MAX_LEAF_SIZE, leaf_word};
use crate::accel::input::{UsableTriangles, bounds_of, can_be_met, check_count, check_range};
use crate::accel::morton::{MORTON_30_AXIS_BITS, MORTON_63_AXIS_BITS};
use crate::accel::optimise::{MAX_TREELET, Optimisation, optimise};
use crate::accel::stages::Stopwatch;
use crate::accel::{Aabb, BuildStages, IndexStatistics, LeafRule, MAX_COORDINATE, RayIndex};
use bytemuck::Zeroable;
use glam::Vec3;
use rayon::prelude::*;

/// Most passes of an optimisation that settings may ask for.
const MAX_ROUNDS: u32 = 16;

/// Most triangles in a kept subtree that settings may ask for.
const MAX_MINI_TREE: u32 = 256;

/// Whether to spend time on the tree after it stands.
///
/// Measured (`clerestory report tree-quality`) on a city of boxes, a sphere flake, a hall of materials and a triangle soup of 36 to 300
/// thousand triangles: nodes and triangles that primary and diffuse rays visit, relative to the tree by the binned surface area heuristic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BuildQuality {
    /// The tree that the codes spell: 1.07 to 3.7 times the binned tree's steps, most where large triangles lie among small ones.
    Fast,
    /// Optimised (see [`optimise`](crate::accel::optimise)): 1.00 to 1.05 times the binned tree's steps with default settings, 0.84 to 0.99
    /// times with 3 reinsertions.
    #[default]
    High,
}

/// Settings of the build.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LbvhSettings {
    /// Bits of a Morton code: 30 or 63. Default 30.
    pub code_bits: u32,
    /// Most triangles in a leaf, 1..=8. Default 4.
    pub leaf_size: u32,
    /// Default high.
    pub quality: BuildQuality,
    /// Leaves of a treelet, 3..=16; high quality only. Default 5: what mini trees are made of, so that larger ones gain nothing more.
    pub treelet: u32,
    /// Passes of treelets, 0..=16; high quality only. Default 1.
    pub rounds: u32,
    /// Most triangles in a subtree that is kept when what is above is built anew, 0..=256, 0 to leave that out; high quality only. Default 32.
    /// Without it steps on the city are 2.1 times the binned tree's, and 1.4 times with treelets of 9 in 3 rounds.
    pub mini_tree: u32,
    /// Rounds of reinsertion, 0..=16; high quality only. Default 0: each takes longer than the rest of the build. Worth it where a tree is
    /// traced for minutes.
    pub reinsertions: u32,
}

impl Default for LbvhSettings {
    fn default() -> Self {
        Self {
            code_bits: 3 * MORTON_30_AXIS_BITS,
            leaf_size: 4,
            quality: BuildQuality::High,
            treelet: 5,
            rounds: 1,
            mini_tree: 32,
            reinsertions: 0,
        }
    }
}

impl LbvhSettings {
    /// Bits an axis.
    pub(crate) fn axis_bits(&self) -> u32 {
        self.code_bits / 3
    }

    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for what is out of range.
    pub(crate) fn check(&self) -> Result<()> {
        if ![MORTON_30_AXIS_BITS, MORTON_63_AXIS_BITS].contains(&self.axis_bits()) || !self.code_bits.is_multiple_of(3)
        {
            return Err(crate::Error::setting(
                "lbvh.code_bits",
                self.code_bits,
                "is neither 30 nor 63",
            ));
        }
        check_range("lbvh.leaf_size", self.leaf_size, 1, MAX_LEAF_SIZE)?;
        check_range("lbvh.treelet", self.treelet, 3, MAX_TREELET as u32)?;
        check_range("lbvh.rounds", self.rounds, 0, MAX_ROUNDS)?;
        check_range("lbvh.mini_tree", self.mini_tree, 0, MAX_MINI_TREE)?;
        check_range("lbvh.reinsertions", self.reinsertions, 0, MAX_ROUNDS)
    }
}

/// The tree over boxes with at least two of them, as [`build`] makes it for triangles; boxes without negative zeros.
pub fn hierarchy_of(boxes: &[Aabb], settings: &LbvhSettings) -> BoxTree {
    let sorted = SortedCodes::of_boxes(boxes, settings.axis_bits());
    let rule = LeafRule::Area(settings.leaf_size);
    if settings.quality == BuildQuality::Fast {
        return hierarchy(boxes, &sorted, rule, MAX_DEPTH);
    }
    let tree = hierarchy(boxes, &sorted, LeafRule::Area(1), MAX_DEPTH);
    optimised(&tree, boxes, settings)
}

fn optimised(tree: &BoxTree, boxes: &[Aabb], settings: &LbvhSettings) -> BoxTree {
    let optimisation = Optimisation {
        treelet: settings.treelet as usize,
        rounds: settings.rounds,
        mini_tree: settings.mini_tree,
        reinsertions: settings.reinsertions,
        leaves: LeafRule::Area(settings.leaf_size),
        max_depth: MAX_DEPTH,
    };
    optimise(tree, boxes, &optimisation)
}

/// Builds over `triangles`; hits name triangles by their place in it. Deterministic whatever the number of threads. The result reports
/// itself as `lbvh`.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) for settings out of range, [`Error::LimitExceeded`](crate::Error::LimitExceeded) for more than
/// [`MAX_TRIANGLES`](crate::accel::bvh2::MAX_TRIANGLES).
pub fn build(triangles: &[[Vec3; 3]], settings: &LbvhSettings) -> Result<Bvh2> {
    settings.check()?;
    check_count(triangles.len())?;
    let mut watch = Stopwatch::start();
    let mut stages = BuildStages::default();
    let usable = UsableTriangles::among(triangles);
    let boxes: Vec<Aabb> = usable.map(|triangle, _| bounds_of(triangle).without_negative_zero());
    stages.triangles = watch.lap();
    if boxes.len() < 2 {
        let layout = Layout::of(&[], boxes.len(), |place| usable.triangle(place as u32));
        return Ok(layout.finish("lbvh", usable.statistics, stages, watch));
    }
    let codes = Codes::of_boxes(&boxes, settings.axis_bits());
    stages.codes = watch.lap();
    let sorted = codes.sorted();
    stages.sort = watch.lap();
    let layout = match settings.quality {
        BuildQuality::Fast => {
            let splits = Splits::build(&boxes, &sorted, LeafRule::Area(settings.leaf_size), MAX_DEPTH);
            stages.hierarchy = watch.lap();
            let (nodes, depth) = splits
                .as_ref()
                .map_or((0, 0), |splits| (splits.nodes(), splits.depth()));
            let mut layout = Layout::new(nodes, boxes.len()).with_depth(depth);
            let (nodes, places) = layout.parts();
            rayon::join(
                || splits.iter().for_each(|splits| splits.emit_nodes(nodes)),
                || fill_triangles(places, |place| usable.triangle(sorted.order[place])),
            );
            layout
        }
        BuildQuality::High => {
            let tree = hierarchy(&boxes, &sorted, LeafRule::Area(1), MAX_DEPTH);
            stages.hierarchy = watch.lap();
            let tree = optimised(&tree, &boxes, settings);
            stages.optimise = watch.lap();
            Layout::of(&nodes_of(&tree), boxes.len(), |place| {
                usable.triangle(tree.order[place])
            })
        }
    };
    stages.layout = watch.lap();
    Ok(layout.finish("lbvh", usable.statistics, stages, watch))
}

/// Refits an index to its triangles where they are now: the tree stays what it was, boxes and corners are new. Triangles that were left
/// out stay so, and those that have lost their area shrink to points. Best where little has moved, since boxes grow where neighbours part.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) for another number of triangles, or for one that has moved out of range.
pub fn refit(index: &Bvh2, triangles: &[[Vec3; 3]]) -> Result<Bvh2> {
    let statistics = index.statistics();
    let count = statistics.triangles as usize;
    check_moved(&statistics, &index.triangles()[..count], triangles)?;
    let indices: Vec<u32> = index.triangles()[..count].iter().map(|t| t.index).collect();
    let positions = moved_corners(&indices, triangles);
    let mut nodes = if count < 2 { Vec::new() } else { index.nodes().to_vec() };
    let mut order = Vec::with_capacity(nodes.len());
    let mut pending: Vec<usize> = (0..nodes.len().min(1)).collect();
    while let Some(node) = pending.pop() {
        order.push(node);
        let inner = nodes[node].children.into_iter().filter(|word| word & COUNT_MASK == 0);
        pending.extend(inner.map(|word| (word >> COUNT_BITS) as usize));
    }
    for node in order.into_iter().rev() {
        nodes[node].triangles = 0;
        for side in 0..2 {
            let word = nodes[node].children[side];
            let place = (word >> COUNT_BITS) as usize;
            nodes[node].bounds[side] = match word & COUNT_MASK {
                0 => nodes[place].bounds[0].union(nodes[place].bounds[1]),
                count => {
                    let corners = positions[place..place + count as usize].iter().flatten();
                    corners.fold(Aabb::EMPTY, |bounds, corner| bounds.with_point(*corner + Vec3::ZERO))
                }
            };
        }
    }
    let excluded = statistics.of_triangles();
    let triangle = |place: usize| Bvh2Triangle::new(positions[place], indices[place]);
    let layout = Layout::of(&nodes, count, triangle).with_depth(statistics.max_depth);
    Ok(layout.finish(index.name(), excluded, BuildStages::default(), Stopwatch::start()))
}

/// Refuses triangles that an index cannot be refitted to, of whose own ones `usable` are those that rays could meet.
pub(in crate::accel) fn check_moved(
    statistics: &IndexStatistics,
    usable: &[Bvh2Triangle],
    triangles: &[[Vec3; 3]],
) -> Result<()> {
    let count = statistics.triangles + statistics.excluded_range + statistics.excluded_degenerate;
    if triangles.len() as u64 != count {
        let cause = format!("is not the {count} that the index was built of");
        return Err(crate::Error::setting("triangles", triangles.len(), cause));
    }
    let outside = |i: &u32| {
        triangles[*i as usize]
            .iter()
            .any(|v| !v.abs().cmple(Vec3::splat(MAX_COORDINATE)).all())
    };
    match usable.iter().map(|t| t.index).find(outside) {
        None => Ok(()),
        Some(i) => {
            let corners = format!("{:?}", triangles[i as usize]);
            Err(crate::Error::setting(
                format!("triangles[{i}]"),
                corners,
                "has moved out of range",
            ))
        }
    }
}

/// Corners of some triangles; those without an area become points, which no ray meets.
pub(in crate::accel) fn moved_corners(indices: &[u32], triangles: &[[Vec3; 3]]) -> Vec<[Vec3; 3]> {
    let corners = |i: &u32| {
        let triangle = triangles[*i as usize];
        if can_be_met(&triangle) {
            triangle
        } else {
            [triangle[0]; 3]
        }
    };
    indices.par_iter().map(corners).collect()
}

/// The nodes in the kernels' layout, at the places they have; the root is the first.
pub(crate) fn nodes_of(tree: &BoxTree) -> Vec<Bvh2Node> {
    let word = |child| match child {
        Child::Leaf { first, count } => leaf_word(first, count),
        Child::Inner(node) => node << COUNT_BITS,
    };
    let mut nodes: Vec<Bvh2Node> = tree
        .nodes
        .iter()
        .map(|pair| Bvh2Node {
            bounds: pair.bounds,
            children: pair.children.map(word),
            ..Bvh2Node::zeroed()
        })
        .collect();
    for (i, pair) in tree.nodes.iter().enumerate() {
        for (side, child) in pair.children.into_iter().enumerate() {
            if let Child::Inner(child) = child {
                nodes[child as usize].parent = (i as u32) << 1 | side as u32;
            }
        }
    }
    nodes
}
