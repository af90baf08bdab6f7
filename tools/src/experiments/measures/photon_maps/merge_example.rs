//! The worked example of building a linear hierarchy by merging: every array after every level beside the values computed by hand.
//!
//! Source of the method: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §6.1.2. Oracle: the example
//! carried out by hand; for more codes, the tree by lists of splits, which is built from the root.

use clerestory::accel::Aabb;
use clerestory::accel::box_tree::{BoxTree, Child};
use clerestory::accel::lbvh::SortedCodes;
use clerestory::accel::photon_map::merge::{merge_points, merged_hierarchy};
use clerestory::accel::photon_map::split_lists::split_list_hierarchy;
use clerestory::{Error, Result};
use glam::Vec3;

use crate::experiments::measures::Context;
use crate::experiments::table::Table;
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

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let sorted = SortedCodes {
        codes: CODES.to_vec(),
        order: (0..CODES.len() as u32).collect(),
        bits: BITS,
    };
    let mut example = Table::new(
        "The worked example: seven codes of four bits, leaf size 1",
        &["array", "found", "by hand", "equal"],
    );
    let mut row = |array: String, found: String, by_hand: String| {
        let equal = if found == by_hand { "yes" } else { "no" };
        example.row([array.into(), found.into(), by_hand.into(), equal.into()]);
    };
    let mut points: Vec<(u32, u32)> = merge_points(&sorted).iter().map(|p| (p.level, p.place)).collect();
    // Levels are merged from the last to the first, the points of each by place.
    points.sort_by_key(|(level, place)| (std::cmp::Reverse(*level), *place));
    row(
        "merge points (level, place)".into(),
        format!("{points:?}"),
        format!("{POINTS:?}"),
    );
    let boxes = points_along_a_line(CODES.len());
    let mut steps = Vec::new();
    let tree = merged_hierarchy(&boxes, &sorted, 1, |sizes| steps.push(sizes.to_vec()));
    for (i, sizes) in steps.iter().enumerate() {
        let name = match i {
            0 => "sizes before the first level".to_owned(),
            i => format!("sizes after {i} of 4 levels"),
        };
        let by_hand = SIZES.get(i).map_or_else(String::new, |sizes| format!("{sizes:?}"));
        row(name, format!("{sizes:?}"), by_hand);
    }
    row("tree".into(), words(&tree, tree.root), TREE.into());
    let shape = tree
        .shape(&boxes)
        .map_err(|fault| Error::setting("tree", "worked example", format!("is not valid: {fault:?}")))?;
    row(
        "leaves, inner nodes".into(),
        format!("{}, {}", shape.leaves, shape.nodes),
        "6, 5".into(),
    );
    example.note(
        "The hand-made example merges the two points of level 1 one after the other; here a level is one step, and its sizes are those after both.",
    );
    let mut random_codes = Table::new(
        "Random codes: merging beside lists of splits",
        &["codes", "bits", "leaf size", "sets", "sets with another tree"],
    );
    let sets = if context.smoke { 10 } else { 1000 };
    let mut random = Random::new(25);
    for (count, bits, leaf_size) in [(7, 4, 1), (100, 6, 1), (100, 30, 5), (1000, 12, 8)] {
        let boxes = points_along_a_line(count);
        let mut different = 0_u64;
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
        random_codes.row([
            (count as u64).into(),
            u64::from(bits).into(),
            u64::from(leaf_size).into(),
            (sets as u64).into(),
            different.into(),
        ]);
    }
    Ok(vec![example, random_codes])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::table::Cell;
    use crate::experiments::watch::Unwatched;

    #[test]
    fn every_array_of_the_worked_example_is_as_by_hand() {
        let context = Context {
            smoke: true,
            scenes: &[],
            gpu: &|| Err(Error::setting("device", "none", "is not to be opened")),
            folder: std::path::Path::new(""),
            watch: &Unwatched,
        };
        let tables = measure(&context).unwrap();
        assert_eq!(tables[0].rows.len(), 8);
        for row in &tables[0].rows {
            assert_eq!(row[3], Cell::from("yes"), "{row:?}");
        }
        for row in &tables[1].rows {
            assert_eq!(row[4], Cell::from(0_u64), "{row:?}");
        }
    }
}
