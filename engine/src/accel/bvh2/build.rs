//! Construction of the binary hierarchy by binned SAH.
//!
//! Determinism: every task works on a slice of triangle references and a slice of node slots that its parent cut out, bounds are merged
//! by minimum and maximum and bins by integer counts, so nothing depends on which thread does what; nodes get their final places in one
//! depth-first pass. Depth: a range of n references is halved at the median as soon as ⌈log₂ n⌉ inner nodes are all that the depth bound
//! leaves below it.

use super::layout::Layout;
use super::{Bvh2, Bvh2Node, Bvh2Triangle, COUNT_BITS, MAX_DEPTH, MAX_LEAF_SIZE, leaf_word};
use crate::Result;
use crate::accel::input::{UsableTriangles, bounds_of, check_count, check_range};
use crate::accel::stages::Stopwatch;
use crate::accel::{Aabb, BuildStages};
use bytemuck::Zeroable;
use glam::Vec3;
use rayon::prelude::*;

/// Ranges above this are binned, and their halves built, in parallel.
const PARALLEL_RANGE: usize = 4096;

/// References a binning task takes; fixed, so that the merge order is too.
const BINNING_CHUNK: usize = 8192;

/// Bins the largest setting asks for.
const MAX_BINS: usize = 64;

/// Settings of the build.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Bvh2Settings {
    /// Most triangles in a leaf, 1..=8. Default 4.
    pub leaf_size: u32,
    /// Bins an axis, 2..=64. Default 16.
    pub bins: u32,
}

impl Default for Bvh2Settings {
    fn default() -> Self {
        Self { leaf_size: 4, bins: 16 }
    }
}

/// A triangle on its way into the tree.
#[derive(Debug, Clone, Copy)]
struct Reference {
    bounds: Aabb,
    index: u32,
}

impl Reference {
    /// Twice the box centre: halving would only cost a rounding.
    fn centroid(&self) -> Vec3 {
        self.bounds.lower + self.bounds.upper
    }
}

#[derive(Debug, Clone, Copy)]
enum Child {
    Leaf { first: u32, count: u32 },
    Inner { slot: u32 },
}

#[derive(Debug, Clone, Copy)]
struct Slot {
    bounds: [Aabb; 2],
    children: [Child; 2],
}

const EMPTY_SLOT: Slot = Slot {
    bounds: [Aabb::EMPTY; 2],
    children: [Child::Leaf { first: 0, count: 0 }; 2],
};

/// A range of references with the places it was given in both arrays.
struct Range<'a> {
    references: &'a mut [Reference],
    first: u32,
    slots: &'a mut [Slot],
    first_slot: u32,
    levels_left: u32,
}

pub(super) fn build(triangles: &[[Vec3; 3]], settings: &Bvh2Settings) -> Result<Bvh2> {
    check_range("bvh2.leaf_size", settings.leaf_size, 1, MAX_LEAF_SIZE)?;
    check_range("bvh2.bins", settings.bins, 2, MAX_BINS as u32)?;
    check_count(triangles.len())?;
    let mut watch = Stopwatch::start();
    let usable = UsableTriangles::among(triangles);
    let mut references = usable.map(|triangle, index| Reference {
        bounds: bounds_of(triangle),
        index,
    });
    let mut stages = BuildStages {
        triangles: watch.lap(),
        ..BuildStages::default()
    };
    let slots = if references.len() >= 2 {
        let mut slots = vec![EMPTY_SLOT; references.len() - 1];
        build_range(
            Range {
                references: &mut references,
                first: 0,
                slots: &mut slots,
                first_slot: 0,
                levels_left: MAX_DEPTH,
            },
            settings,
        );
        slots
    } else {
        Vec::new()
    };
    stages.hierarchy = watch.lap();
    let triangle = |place: usize| {
        let index = references[place].index;
        Bvh2Triangle::new(triangles[index as usize], index)
    };
    let layout = Layout::of(&flatten(&slots), references.len(), triangle);
    stages.layout = watch.lap();
    Ok(layout.finish("bvh2", usable.statistics, stages, watch))
}

fn ceil_log2(n: usize) -> u32 {
    n.next_power_of_two().trailing_zeros()
}

/// Splits a range of two or more references into the node at its first slot.
fn build_range(range: Range<'_>, settings: &Bvh2Settings) {
    let Range {
        references,
        first,
        slots,
        first_slot,
        levels_left,
    } = range;
    let middle = split(references, levels_left, settings);
    let Some((node, rest)) = slots.split_first_mut() else {
        return;
    };
    let (left_references, right_references) = references.split_at_mut(middle);
    let (left_slots, right_slots) = rest.split_at_mut(middle - 1);
    let left = Range {
        references: left_references,
        first,
        slots: left_slots,
        first_slot: first_slot + 1,
        levels_left: levels_left - 1,
    };
    let right = Range {
        references: right_references,
        first: first + middle as u32,
        slots: right_slots,
        first_slot: first_slot + middle as u32,
        levels_left: levels_left - 1,
    };
    let parallel = left.references.len() + right.references.len() > PARALLEL_RANGE;
    let (left, right) = if parallel {
        rayon::join(|| build_child(left, settings), || build_child(right, settings))
    } else {
        (build_child(left, settings), build_child(right, settings))
    };
    *node = Slot {
        bounds: [left.0, right.0],
        children: [left.1, right.1],
    };
}

fn build_child(range: Range<'_>, settings: &Bvh2Settings) -> (Aabb, Child) {
    let count = range.references.len();
    let bounds = range.references.iter().fold(Aabb::EMPTY, |b, r| b.union(r.bounds));
    if count == 1 || (count <= settings.leaf_size as usize && !worth_splitting(range.references, &bounds, settings)) {
        let leaf = Child::Leaf {
            first: range.first,
            count: count as u32,
        };
        return (bounds, leaf);
    }
    let slot = range.first_slot;
    build_range(range, settings);
    (bounds, Child::Inner { slot })
}

/// Whether a node over these pays for itself: one visit and one triangle test cost the same.
fn worth_splitting(references: &[Reference], bounds: &Aabb, settings: &Bvh2Settings) -> bool {
    best_split(references, settings)
        .is_some_and(|split| split.cost < (references.len() - 1) as f64 * bounds.half_area())
}

/// Reorders the references and says where the right half begins: at least one on each side.
fn split(references: &mut [Reference], levels_left: u32, settings: &Bvh2Settings) -> usize {
    // One level goes to this node; the halves need ⌈log₂⌉ levels each, at worst as many as the whole less one.
    if ceil_log2(references.len()) < levels_left
        && let Some(best) = best_split(references, settings)
    {
        return partition(references, |r| best.bin(r) <= best.last_left);
    }
    let centroids = centroid_bounds(references);
    let extent = centroids.upper - centroids.lower;
    let axis = extent.max_position();
    let middle = references.len() / 2;
    references.select_nth_unstable_by(middle, |a, b| {
        a.centroid()[axis]
            .total_cmp(&b.centroid()[axis])
            .then(a.index.cmp(&b.index))
    });
    middle
}

/// Moves what is left to the front; the order within each side depends on the input alone.
fn partition(references: &mut [Reference], left: impl Fn(&Reference) -> bool) -> usize {
    let mut end = 0;
    for i in 0..references.len() {
        if left(&references[i]) {
            references.swap(i, end);
            end += 1;
        }
    }
    end
}

fn centroid_bounds(references: &[Reference]) -> Aabb {
    let chunk = |chunk: &[Reference]| chunk.iter().fold(Aabb::EMPTY, |b, r| b.with_point(r.centroid()));
    if references.len() > BINNING_CHUNK {
        references
            .par_chunks(BINNING_CHUNK)
            .map(chunk)
            .reduce(|| Aabb::EMPTY, Aabb::union)
    } else {
        chunk(references)
    }
}

/// What of a split's candidates falls between two of their borders.
#[derive(Debug, Clone, Copy)]
pub(in crate::accel) struct Bin {
    pub(in crate::accel) bounds: Aabb,
    pub(in crate::accel) count: u32,
}

pub(in crate::accel) const EMPTY_BIN: Bin = Bin {
    bounds: Aabb::EMPTY,
    count: 0,
};

impl Bin {
    pub(in crate::accel) fn union(self, other: Self) -> Self {
        Self {
            bounds: self.bounds.union(other.bounds),
            count: self.count + other.count,
        }
    }

    fn cost(&self) -> f64 {
        f64::from(self.count) * self.bounds.half_area()
    }
}

/// Maps centroids to bins: `min((c − lower) · scale, bins − 1)` an axis.
#[derive(Debug, Clone, Copy)]
struct Binning {
    lower: Vec3,
    scale: Vec3,
    last: Vec3,
}

impl Binning {
    fn bins_of(&self, reference: &Reference) -> [usize; 3] {
        let bin = ((reference.centroid() - self.lower) * self.scale).min(self.last);
        bin.to_array().map(|b| b as usize)
    }
}

#[derive(Debug, Clone, Copy)]
struct Split {
    binning: Binning,
    axis: usize,
    last_left: usize,
    cost: f64,
}

impl Split {
    fn bin(&self, reference: &Reference) -> usize {
        self.binning.bins_of(reference)[self.axis]
    }
}

/// The bins of the three axes, one axis after the other.
fn fill_bins(references: &[Reference], binning: &Binning, count: usize) -> Vec<Bin> {
    let mut bins = vec![EMPTY_BIN; 3 * count];
    for reference in references {
        let single = Bin {
            bounds: reference.bounds,
            count: 1,
        };
        for (axis, bin) in binning.bins_of(reference).into_iter().enumerate() {
            let bin = &mut bins[axis * count + bin];
            *bin = bin.union(single);
        }
    }
    bins
}

/// The cheapest of all bin borders, by `Σ count · half area`; none when all centroids coincide (to within what binning can tell apart).
fn best_split(references: &[Reference], settings: &Bvh2Settings) -> Option<Split> {
    let count = settings.bins as usize;
    let centroids = centroid_bounds(references);
    let extent = centroids.upper - centroids.lower;
    // A reciprocal that overflows would bin by NaN; such an axis is not split.
    let scale = Vec3::from_array(extent.to_array().map(|e| {
        let scale = count as f32 / e;
        if scale.is_finite() { scale } else { 0.0 }
    }));
    let binning = Binning {
        lower: centroids.lower,
        scale,
        last: Vec3::splat((count - 1) as f32),
    };
    let bins = if references.len() > BINNING_CHUNK {
        let chunks: Vec<Vec<Bin>> = references
            .par_chunks(BINNING_CHUNK)
            .map(|chunk| fill_bins(chunk, &binning, count))
            .collect();
        chunks.into_iter().fold(vec![EMPTY_BIN; 3 * count], |all, part| {
            all.iter().zip(part).map(|(a, p)| a.union(p)).collect()
        })
    } else {
        fill_bins(references, &binning, count)
    };
    let mut best: Option<Split> = None;
    for (axis, bins) in bins.chunks(count).enumerate() {
        let mut right_costs = [0.0; MAX_BINS];
        let mut right = EMPTY_BIN;
        for i in (1..count).rev() {
            right = right.union(bins[i]);
            right_costs[i] = right.cost();
        }
        let mut left = EMPTY_BIN;
        for (i, bin) in bins.iter().enumerate().take(count - 1) {
            left = left.union(*bin);
            if left.count == 0 || left.count as usize == references.len() {
                continue;
            }
            let cost = left.cost() + right_costs[i + 1];
            if best.is_none_or(|b| cost < b.cost) {
                best = Some(Split {
                    binning,
                    axis,
                    last_left: i,
                    cost,
                });
            }
        }
    }
    best
}

/// Nodes in depth-first order, left child first, with parent links.
fn flatten(slots: &[Slot]) -> Vec<Bvh2Node> {
    let mut nodes: Vec<Bvh2Node> = Vec::new();
    let mut pending = if slots.is_empty() {
        Vec::new()
    } else {
        vec![(0u32, 0u32)]
    };
    while let Some((slot, parent)) = pending.pop() {
        let index = nodes.len() as u32;
        if index > 0 {
            nodes[(parent >> 1) as usize].children[(parent & 1) as usize] = index << COUNT_BITS;
        }
        let slot = &slots[slot as usize];
        nodes.push(Bvh2Node {
            bounds: slot.bounds,
            parent,
            ..Bvh2Node::zeroed()
        });
        for side in [1, 0] {
            match slot.children[side] {
                Child::Leaf { first, count } => nodes[index as usize].children[side] = leaf_word(first, count),
                Child::Inner { slot } => pending.push((slot, index << 1 | side as u32)),
            }
        }
    }
    nodes
}
