//! Builds what is above the small subtrees of a tree anew, from the root down by the binned surface area heuristic.
//!
//! Source: mini trees and their pruning, P. Ganestam, R. Barringer, M. Doggett, T. Akenine-Möller, "Bonsai: Rapid Bounding Volume Hierarchy
//! Generation using Mini Trees", JCGT 4(3), 2015; binning by I. Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", IEEE
//! RT 2007. There, mini trees larger than a share of their mean area are replaced by their subtrees; a few huge primitives raise that
//! mean as far as they like, so here those of the largest nodes are, a share of their number ([`OPENED`]).
//!
//! Guarantee: the same tree whatever the number of threads; the depth bound holds. The cost may rise.

use super::{Aabb, BoxTree, Child, EMPTY_NODE, PairNode, half_area};
use crate::accel::bvh2::build::{Bin, EMPTY_BIN};
use glam::Vec3;
use rayon::prelude::*;

/// Share of the inner nodes, largest first, that never remain: what is above mini trees has them all. Less where many are equally large.
const OPENED: f64 = 0.1875;

/// Least number of them: what small trees gain takes less than a millisecond.
const LEAST_OPENED: usize = 1024;

/// Most inner nodes on a way through a mini tree, which leaves the depth bound to what is above.
const MAX_HEIGHT: u32 = 8;

/// Bins an axis.
const BINS: usize = 16;

/// Ranges above this are built in parallel.
const PARALLEL_RANGE: usize = 2048;

/// Mini trees that a binning task takes.
const BINNING_CHUNK: usize = 8192;

/// A subtree that remains.
#[derive(Debug, Clone, Copy)]
struct MiniTree {
    bounds: Aabb,
    child: Child,
    count: u32,
}

impl MiniTree {
    /// Twice the box centre.
    fn centre(&self) -> Vec3 {
        self.bounds.lower + self.bounds.upper
    }
}

/// Builds what is above mini trees of at most `most` primitives anew. Nodes come in depth-first order, those of the result in none; each leaf
/// holds one primitive; the tree is at most `max_depth` inner nodes deep, which ⌈log₂ n⌉ must be too.
pub(super) fn rebuild(mut tree: BoxTree, most: u32, max_depth: u32) -> BoxTree {
    let (mut mini_trees, opened, tallest) = cut(&tree, most, max_depth);
    if mini_trees.len() < 2 {
        return tree;
    }
    let mut above = vec![EMPTY_NODE; opened.len()];
    (_, tree.root) = build(&mut mini_trees, &mut above, &opened, max_depth - tallest);
    // As many nodes are built as were opened, and take their places.
    for (place, pair) in opened.iter().zip(above) {
        tree.nodes[*place as usize] = pair;
    }
    tree
}

/// The mini trees, the nodes above them in depth-first order, and the height of the tallest.
fn cut(tree: &BoxTree, most: u32, max_depth: u32) -> (Vec<MiniTree>, Vec<u32>, u32) {
    let nodes = tree.nodes.len();
    let (mut counts, mut heights) = (vec![0u32; nodes], vec![0u32; nodes]);
    let mut areas = vec![f32::INFINITY; nodes];
    for (i, pair) in tree.nodes.iter().enumerate().rev() {
        let (mut count, mut height) = (0, 0);
        for (bounds, child) in pair.bounds.iter().zip(pair.children) {
            match child {
                Child::Leaf { count: one, .. } => count += one,
                Child::Inner(below) => {
                    let below = below as usize;
                    count += counts[below];
                    height = height.max(heights[below]);
                    areas[below] = half_area(bounds);
                }
            }
        }
        (counts[i], heights[i]) = (count, height + 1);
    }
    let largest = LEAST_OPENED.max((OPENED * nodes as f64) as usize);
    let limit = if largest < nodes {
        let mut sorted = areas.clone();
        *sorted.select_nth_unstable_by(largest, |a, b| b.total_cmp(a)).1
    } else {
        f32::NEG_INFINITY
    };
    let levels = tree.order.len().next_power_of_two().trailing_zeros();
    let tallest_allowed = MAX_HEIGHT.min(max_depth.saturating_sub(levels));
    let mut mini_trees = Vec::new();
    let mut opened = Vec::new();
    let mut tallest = 0;
    let mut pending = vec![(tree.root, tree.bounds)];
    while let Some((child, bounds)) = pending.pop() {
        let (count, height) = match child {
            Child::Leaf { count, .. } => (count, 0),
            Child::Inner(node) => {
                let (count, height) = (counts[node as usize], heights[node as usize]);
                if count > most || height > tallest_allowed || areas[node as usize] > limit {
                    let pair = &tree.nodes[node as usize];
                    opened.push(node);
                    for side in [1, 0] {
                        pending.push((pair.children[side], pair.bounds[side]));
                    }
                    continue;
                }
                (count, height)
            }
        };
        tallest = tallest.max(height);
        mini_trees.push(MiniTree { bounds, child, count });
    }
    (mini_trees, opened, tallest)
}

/// Builds over mini trees; nodes go to `above`, and refer to each other by the `places` that they will have.
fn build(mini_trees: &mut [MiniTree], above: &mut [PairNode], places: &[u32], levels_left: u32) -> (Aabb, Child) {
    if let [one] = mini_trees {
        return (one.bounds, one.child);
    }
    let is_large = mini_trees.len() > PARALLEL_RANGE;
    let middle = split(mini_trees, levels_left);
    let (left, right) = mini_trees.split_at_mut(middle);
    let (node, below) = above.split_at_mut(1);
    let (left_above, right_above) = below.split_at_mut(middle - 1);
    let (left_places, right_places) = places[1..].split_at(middle - 1);
    let mut build_left = || build(left, left_above, left_places, levels_left - 1);
    let mut build_right = || build(right, right_above, right_places, levels_left - 1);
    let (left, right) = if is_large {
        rayon::join(build_left, build_right)
    } else {
        (build_left(), build_right())
    };
    node[0] = PairNode {
        bounds: [left.0, right.0],
        children: [left.1, right.1],
    };
    (left.0.union(right.0), Child::Inner(places[0]))
}

type Bins = [[Bin; BINS]; 3];

/// Cost of one side of a border; infinite for the empty bin, which no split may have there.
fn side_cost(bin: &Bin) -> f32 {
    match bin.count {
        0 => f32::INFINITY,
        count => half_area(&bin.bounds) * count as f32,
    }
}

/// Maps centres to bins: `min((c − lower) · scale, bins − 1)` an axis.
#[derive(Debug, Clone, Copy)]
struct Binning {
    lower: Vec3,
    scale: Vec3,
}

impl Binning {
    fn bins_of(&self, mini_tree: &MiniTree) -> [usize; 3] {
        let bin = ((mini_tree.centre() - self.lower) * self.scale).min(Vec3::splat((BINS - 1) as f32));
        bin.to_array().map(|b| b as usize)
    }

    fn fill(&self, mini_trees: &[MiniTree]) -> Bins {
        let mut bins = [[EMPTY_BIN; BINS]; 3];
        for mini_tree in mini_trees {
            let single = Bin {
                bounds: mini_tree.bounds,
                count: mini_tree.count,
            };
            for (bins, bin) in bins.iter_mut().zip(self.bins_of(mini_tree)) {
                bins[bin] = bins[bin].union(single);
            }
        }
        bins
    }
}

/// Reorders two or more mini trees and says where the right half begins: at least one on each side.
fn split(mini_trees: &mut [MiniTree], levels_left: u32) -> usize {
    let centres = |chunk: &[MiniTree]| chunk.iter().fold(Aabb::EMPTY, |b, m| b.with_point(m.centre()));
    let is_large = mini_trees.len() > BINNING_CHUNK;
    let bounds = if is_large {
        let chunks = mini_trees.par_chunks(BINNING_CHUNK).map(centres);
        chunks.reduce(|| Aabb::EMPTY, Aabb::union)
    } else {
        centres(mini_trees)
    };
    let extent = bounds.upper - bounds.lower;
    // One level goes to this node; the halves need ⌈log₂⌉ levels each, at worst as many as the whole less one.
    if mini_trees.len().next_power_of_two().trailing_zeros() < levels_left {
        // A reciprocal that overflows would bin by NaN; such an axis is not split.
        let scale = extent.to_array().map(|e| BINS as f32 / e);
        let binning = Binning {
            lower: bounds.lower,
            scale: Vec3::from_array(scale.map(|scale| if scale.is_finite() { scale } else { 0.0 })),
        };
        let bins = if is_large {
            let chunks: Vec<Bins> = mini_trees
                .par_chunks(BINNING_CHUNK)
                .map(|chunk| binning.fill(chunk))
                .collect();
            chunks.into_iter().fold([[EMPTY_BIN; BINS]; 3], |all, part| {
                std::array::from_fn(|axis| std::array::from_fn(|i| all[axis][i].union(part[axis][i])))
            })
        } else {
            binning.fill(mini_trees)
        };
        if let Some((axis, last_left)) = best_border(&bins) {
            let mut end = 0;
            for i in 0..mini_trees.len() {
                if binning.bins_of(&mini_trees[i])[axis] <= last_left {
                    mini_trees.swap(i, end);
                    end += 1;
                }
            }
            return end;
        }
    }
    let axis = extent.max_position();
    let middle = mini_trees.len() / 2;
    mini_trees.select_nth_unstable_by(middle, |a, b| a.centre()[axis].total_cmp(&b.centre()[axis]));
    middle
}

/// The axis and the last bin on the left of the cheapest border, by `Σ count · half area`; none when all centres share their bins.
fn best_border(bins: &Bins) -> Option<(usize, usize)> {
    let mut best = (f32::INFINITY, None);
    for (axis, bins) in bins.iter().enumerate() {
        let mut right_costs = [0.0; BINS];
        let mut right = EMPTY_BIN;
        for i in (1..BINS).rev() {
            right = right.union(bins[i]);
            right_costs[i] = side_cost(&right);
        }
        let mut left = EMPTY_BIN;
        for (i, bin) in bins[..BINS - 1].iter().enumerate() {
            left = left.union(*bin);
            let cost = side_cost(&left) + right_costs[i + 1];
            if cost < best.0 {
                best = (cost, Some((axis, i)));
            }
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::super::tests::{boxes_of, linear_tree, optimisation, with_wall};
    use super::super::treelets::restructure;
    use super::*;
    use crate::accel::bvh2::MAX_DEPTH;
    use crate::accel::test_support::Random;

    #[test]
    fn mini_trees_are_small_and_hold_everything() {
        let mut random = Random(73);
        for boxes in [boxes_of(&mut random, 3000, 0.05), with_wall(&mut random, 2000)] {
            let (given, _) = restructure(&linear_tree(&boxes, MAX_DEPTH), &boxes, &optimisation(1, 0, 0));
            for most in [1, 2, 16, 256] {
                let (mini_trees, opened, tallest) = cut(&given, most, MAX_DEPTH);
                assert_eq!(mini_trees.len(), opened.len() + 1);
                assert!(opened.is_sorted() && opened.len() >= (OPENED * given.nodes.len() as f64) as usize);
                assert_eq!(mini_trees.iter().map(|m| m.count).sum::<u32>() as usize, boxes.len());
                assert!(mini_trees.iter().all(|m| m.count <= most) && tallest <= MAX_HEIGHT);
                assert_eq!(most == 1, mini_trees.len() == boxes.len());
            }
        }
    }

    #[test]
    fn a_border_is_the_cheapest_of_all() {
        let mut random = Random(74);
        for _ in 0..20 {
            let bins: Bins = std::array::from_fn(|_| {
                std::array::from_fn(|_| match random.below(3) {
                    0 => EMPTY_BIN,
                    count => Bin {
                        bounds: boxes_of(&mut random, 1, 0.5)[0],
                        count: count as u32,
                    },
                })
            });
            let cost = |(axis, last): (usize, usize)| {
                let side = |bins: &[Bin]| side_cost(&bins.iter().fold(EMPTY_BIN, |all, bin| all.union(*bin)));
                side(&bins[axis][..=last]) + side(&bins[axis][last + 1..])
            };
            let all = (0..3).flat_map(|axis| (0..BINS - 1).map(move |last| (axis, last)));
            let least = all.map(cost).fold(f32::INFINITY, f32::min);
            assert_eq!(best_border(&bins).map(cost), Some(least));
        }
        assert_eq!(best_border(&[[EMPTY_BIN; BINS]; 3]), None);
    }
}
