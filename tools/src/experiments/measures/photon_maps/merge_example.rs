//! The worked example of building a linear hierarchy by merging: every array after every level beside the values computed by hand.
//!
//! Source of the method: B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §6.1.2. Oracle: the example
//! carried out by hand; for more codes, the tree by lists of splits, which is built from the root.

use clerestory::accel::Aabb;
use clerestory::accel::box_tree::{BoxTree, Child};
use clerestory::accel::lbvh::SortedCodes;
use clerestory::accel::photon_map::merge::{merge_points, merged_hierarchy};
use clerestory::accel::yardstick::split_list_hierarchy;
use clerestory::{Error, Result};
use glam::Vec3;

use crate::experiments::findings::{Bound, Criterion, Findings, Study, rows, total};
use crate::experiments::measures::Context;
use crate::random::Random;

const CODES: [u64; 7] = [0b0010, 0b0011, 0b0101, 0b0101, 0b0110, 0b1001, 0b1101];
const BITS: u32 = 4;
/// Level and place, lowest level of the tree first.
const POINTS: [(u32, u32); 5] = [(3, 0), (2, 3), (1, 1), (1, 5), (0, 4)];
/// Sizes before the first level and after each.
const SIZES: [[u32; 7]; 5] = [
    [1, 1, 2, 2, 1, 1, 1],
    [2, 2, 2, 2, 1, 1, 1],
    [2, 2, 3, 2, 3, 1, 1],
    [5, 2, 3, 2, 5, 2, 2],
    [7, 2, 3, 2, 5, 2, 7],
];
const TREE: &str = "{{{0-0 1-1} {2-3 4-4}} {5-5 6-6}}";

/// The tree in words: leaves as first and last place, inner nodes in braces.
fn words(tree: &BoxTree, child: Child) -> String {
    match child {
        Child::Leaf { first, count } => format!("{first}-{}", first + count - 1),
        Child::Inner(node) => {
            let [left, right] = tree.nodes[node as usize].children;
            format!("{{{} {}}}", words(tree, left), words(tree, right))
        }
    }
}

fn points_along_a_line(count: usize) -> Vec<Aabb> {
    (0..count)
        .map(|i| Aabb::EMPTY.with_point(Vec3::splat(i as f32)))
        .collect()
}

rows! {
    /// An array of the worked example.
    struct Array = "The worked example: seven codes of four bits, leaf size 1" by [array] {
        array: String = "array",
        found: String = "found",
        by_hand: String = "by hand",
        different: u64 = "differs (1) or not (0)",
    }
}

rows! {
    /// Trees over random codes.
    struct Trees = "Random codes: merging beside lists of splits" by [codes, bits] {
        codes: u64 = "codes",
        bits: u64 = "bits",
        leaf_size: u64 = "leaf size",
        sets: u64 = "sets",
        different: u64 = "sets with another tree",
    }
}

const OF_ARRAYS: &[Criterion<Array>] =
    &[
        Criterion::each("every array is as by hand", Bound::AtMost(0.0), |row: &Array| {
            row.different.into()
        })
        .in_every_form(),
    ];
const OF_TREES: &[Criterion<Trees>] = &[Criterion::each(
    "trees are those by lists of splits",
    Bound::AtMost(0.0),
    |row: &Trees| row.different.into(),
)
.in_every_form()];

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    arrays: Vec<Array>,
    trees: Vec<Trees>,
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        Ok(Self {
            arrays: arrays()?,
            trees: trees(context.pick(1000, 10)),
        })
    }

    fn findings(&self) -> Findings {
        Findings::of(&self.arrays, OF_ARRAYS)
            .note(
                "The hand-made example merges the two points of level 1 one after the other; here a level is one step, and its sizes are those after both.",
            )
            .and(Findings::of(&self.trees, OF_TREES))
            .headline("trees over random codes that differ from those by lists of splits", total(&self.trees, |_| true, |row| row.different))
    }
}

/// The arrays of the worked example.
fn arrays() -> Result<Vec<Array>> {
    let sorted = SortedCodes {
        codes: CODES.to_vec(),
        order: (0..CODES.len() as u32).collect(),
        bits: BITS,
    };
    let row = |array: String, found: String, by_hand: String| Array {
        different: u64::from(found != by_hand),
        array,
        found,
        by_hand,
    };
    let mut points: Vec<(u32, u32)> = merge_points(&sorted).iter().map(|p| (p.level, p.place)).collect();
    // Levels are merged from the last to the first, the points of each by place.
    points.sort_by_key(|(level, place)| (std::cmp::Reverse(*level), *place));
    let mut rows = vec![row(
        "merge points (level, place)".into(),
        format!("{points:?}"),
        format!("{POINTS:?}"),
    )];
    let boxes = points_along_a_line(CODES.len());
    let mut steps = Vec::new();
    let tree = merged_hierarchy(&boxes, &sorted, 1, |sizes| steps.push(sizes.to_vec()));
    for (i, sizes) in steps.iter().enumerate() {
        let name = match i {
            0 => "sizes before the first level".to_owned(),
            i => format!("sizes after {i} of 4 levels"),
        };
        let by_hand = SIZES.get(i).map_or_else(String::new, |sizes| format!("{sizes:?}"));
        rows.push(row(name, format!("{sizes:?}"), by_hand));
    }
    rows.push(row("tree".into(), words(&tree, tree.root), TREE.into()));
    let shape = tree
        .shape(&boxes)
        .map_err(|fault| Error::setting("tree", "worked example", format!("is not valid: {fault:?}")))?;
    rows.push(row(
        "leaves, inner nodes".into(),
        format!("{}, {}", shape.leaves, shape.nodes),
        "6, 5".into(),
    ));
    Ok(rows)
}

/// Trees over so many sets of random codes.
fn trees(sets: u64) -> Vec<Trees> {
    let mut random = Random::new(25);
    let mut of = |(count, bits, leaf_size): (usize, u32, u32)| {
        let boxes = points_along_a_line(count);
        let mut different = 0;
        for _ in 0..sets {
            let mut codes: Vec<u64> = (0..count)
                .map(|_| (random.unit() * f64::from(1_u32 << bits)) as u64)
                .collect();
            codes.sort_unstable();
            let sorted = SortedCodes {
                codes,
                order: (0..count as u32).collect(),
                bits,
            };
            let merged = merged_hierarchy(&boxes, &sorted, leaf_size, |_| {});
            let (lists, _) = split_list_hierarchy(&boxes, &sorted, leaf_size);
            different += u64::from(words(&merged, merged.root) != words(&lists, lists.root));
        }
        Trees {
            codes: count as u64,
            bits: bits.into(),
            leaf_size: leaf_size.into(),
            sets,
            different,
        }
    };
    [(7, 4, 1), (100, 6, 1), (100, 30, 5), (1000, 12, 8)]
        .map(&mut of)
        .to_vec()
}
