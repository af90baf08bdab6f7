use super::*;
use crate::accel::box_tree::TreeShape;
use crate::accel::bvh2::MAX_DEPTH;
use crate::accel::lbvh::SortedCodes;
use crate::accel::lbvh::hard_boxes;
use crate::accel::lbvh::radix_tree::hierarchy;
use crate::accel::test_support::{Random, with_threads};
use glam::Vec3;

const RULE: LeafRule = LeafRule::Area(4);

/// Steps by themselves and all together: rounds of treelets, mini trees, reinsertions.
const STEPS: [(u32, u32, u32); 6] = [(0, 0, 0), (2, 0, 0), (0, 16, 0), (0, 0, 2), (1, 32, 0), (1, 4, 2)];

pub(super) fn optimisation(rounds: u32, mini_tree: u32, reinsertions: u32) -> Optimisation {
    Optimisation {
        treelet: 7,
        rounds,
        mini_tree,
        reinsertions,
        leaves: RULE,
        max_depth: MAX_DEPTH,
    }
}

pub(super) fn linear_tree(boxes: &[Aabb], max_depth: u32) -> BoxTree {
    hierarchy(boxes, &SortedCodes::of_boxes(boxes, 10), LeafRule::Area(1), max_depth)
}

pub(super) fn boxes_of(random: &mut Random, count: usize, size: f32) -> Vec<Aabb> {
    let around = |random: &mut Random| {
        let (centre, half) = (random.vector(), random.vector().abs() * size);
        Aabb {
            lower: centre - half,
            upper: centre + half,
        }
    };
    (0..count).map(|_| around(random)).collect()
}

/// Small boxes, and long ones across all of them.
pub(super) fn with_wall(random: &mut Random, count: usize) -> Vec<Aabb> {
    let mut boxes = boxes_of(random, count, 0.01);
    for i in 0..count / 50 {
        boxes[50 * i].lower.x = -1.0;
        boxes[50 * i].upper.x = 1.0;
    }
    boxes
}

fn leafed(tree: &BoxTree, rule: LeafRule) -> BoxTree {
    with_leaves(tree, &choose(tree, rule))
}

fn valid(name: &str, tree: &BoxTree, boxes: &[Aabb]) -> TreeShape {
    tree.shape(boxes).unwrap_or_else(|fault| panic!("{name}: {fault:?}"))
}

#[test]
fn every_step_gives_valid_trees_that_cost_no_more() {
    let mut cases = hard_boxes();
    let huge = boxes_of(&mut Random(75), 500, 0.1).into_iter().map(|b| Aabb {
        lower: b.lower * 1e9,
        upper: b.upper * 1e9,
    });
    cases.push(("huge", huge.collect()));
    cases.push(("wall", with_wall(&mut Random(76), 1000)));
    for (name, boxes) in cases.into_iter().filter(|(_, boxes)| boxes.len() > 1) {
        let given = linear_tree(&boxes, MAX_DEPTH);
        let before = leafed(&given, RULE).area_cost();
        // Decisions are taken in f32, each sum of n costs within n units of roundoff.
        let rounding = 1.0 + boxes.len() as f64 / 16_777_216.0;
        for (rounds, mini_tree, reinsertions) in STEPS {
            let name = format!("{name} {rounds} {mini_tree} {reinsertions}");
            let tree = optimise(&given, &boxes, &optimisation(rounds, mini_tree, reinsertions));
            let shape = valid(&name, &tree, &boxes);
            assert!(
                shape.max_depth <= MAX_DEPTH && shape.largest_leaf <= 4,
                "{name}: {shape:?}"
            );
            assert_eq!(shape.nodes as usize, tree.nodes.len(), "{name}");
            let after = tree.area_cost();
            assert!(after <= before * rounding, "{name}: {before} {after}");
        }
    }
}

#[test]
fn the_depth_bound_holds_where_it_is_tight() {
    let mut random = Random(77);
    for boxes in [
        boxes_of(&mut random, 1000, 0.2),
        with_wall(&mut random, 1000),
        vec![Aabb::EMPTY.with_point(Vec3::ONE); 1000],
    ] {
        for max_depth in [10, 11, 14] {
            let given = linear_tree(&boxes, max_depth);
            for (rounds, mini_tree, reinsertions) in STEPS {
                let settings = Optimisation {
                    max_depth,
                    ..optimisation(rounds, mini_tree, reinsertions)
                };
                let shape = valid("depth", &optimise(&given, &boxes, &settings), &boxes);
                assert!(shape.max_depth <= max_depth, "{settings:?}: {shape:?}");
            }
        }
    }
}

#[test]
fn trees_do_not_depend_on_the_number_of_threads() {
    let boxes = with_wall(&mut Random(78), 6000);
    let given = linear_tree(&boxes, MAX_DEPTH);
    for (rounds, mini_tree, reinsertions) in STEPS {
        let optimised = |threads| {
            with_threads(threads, || {
                optimise(&given, &boxes, &optimisation(rounds, mini_tree, reinsertions))
            })
        };
        let one = optimised(1);
        for threads in [2, 4] {
            assert!(one == optimised(threads), "{rounds} {mini_tree} {reinsertions}");
        }
    }
}

/// Unit cubes that begin at these places of a line.
fn cubes(places: &[f32]) -> Vec<Aabb> {
    let cube = |x: &f32| Aabb {
        lower: Vec3::X * *x,
        upper: Vec3::X * *x + Vec3::ONE,
    };
    places.iter().map(cube).collect()
}

/// A tree of four leaves by the pairs below its root.
fn paired(boxes: &[Aabb], pairs: [[u32; 2]; 2]) -> BoxTree {
    let of = |i: u32| boxes[i as usize];
    let both = pairs.map(|[a, b]| of(a).union(of(b)));
    let leaf = |first| Child::Leaf { first, count: 1 };
    let lower = pairs.map(|pair| PairNode {
        bounds: pair.map(of),
        children: pair.map(leaf),
    });
    let root = PairNode {
        bounds: both,
        children: [Child::Inner(1), Child::Inner(2)],
    };
    BoxTree {
        order: (0..4).collect(),
        nodes: vec![root, lower[0], lower[1]],
        bounds: both[0].union(both[1]),
        root: Child::Inner(0),
    }
}

#[test]
fn two_clusters_that_are_paired_crosswise_come_apart() {
    // Cubes 0 and 2 stand together, and so do 1 and 3, ten apart.
    let boxes = cubes(&[0.0, 10.0, 1.0, 11.0]);
    let given = paired(&boxes, [[0, 1], [2, 3]]);
    let sides = |tree: &BoxTree| {
        let Child::Inner(root) = tree.root else {
            panic!("the root is a leaf");
        };
        let mut sides = tree.nodes[root as usize].bounds.map(|b| (b.lower.x, b.upper.x));
        sides.sort_by(|a, b| a.0.total_cmp(&b.0));
        sides
    };
    assert_eq!(sides(&given), [(0.0, 11.0), (1.0, 12.0)]);
    // Half areas: 25 of the root, 5 of each pair, or 23 before, 3 of each cube.
    let costs = |pair: f64| (2.0 * pair + 12.0) / 25.0 + 1.0;
    let rule = LeafRule::Area(1);
    assert_eq!(leafed(&given, rule).area_cost(), costs(23.0));
    for (rounds, mini_tree, reinsertions) in [(1, 0, 0), (0, 1, 0), (0, 0, 2)] {
        let settings = Optimisation {
            leaves: rule,
            ..optimisation(rounds, mini_tree, reinsertions)
        };
        let tree = optimise(&given, &boxes, &settings);
        valid("clusters", &tree, &boxes);
        assert_eq!(sides(&tree), [(0.0, 2.0), (10.0, 12.0)], "{settings:?}");
        assert_eq!(tree.area_cost(), costs(5.0), "{settings:?}");
    }
}

#[test]
fn trees_of_fewer_than_three_stay_as_they_are() {
    for boxes in [cubes(&[0.0]), cubes(&[0.0, 5.0])] {
        let given = linear_tree(&boxes, MAX_DEPTH);
        for (rounds, mini_tree, reinsertions) in STEPS {
            let tree = optimise(&given, &boxes, &optimisation(rounds, mini_tree, reinsertions));
            assert_eq!(tree, given);
        }
    }
}

#[test]
fn the_expected_cost_is_that_of_the_tree_with_its_leaves() {
    let mut random = Random(79);
    let boxes = boxes_of(&mut random, 700, 0.3);
    let given = linear_tree(&boxes, MAX_DEPTH);
    for rule in [LeafRule::Area(1), LeafRule::Area(4), LeafRule::Area(8)] {
        let tree = leafed(&given, rule);
        let direct = hierarchy(&boxes, &SortedCodes::of_boxes(&boxes, 10), rule, MAX_DEPTH);
        assert_eq!(valid("leaves", &tree, &boxes), valid("leaves", &direct, &boxes));
        let expected = f64::from(choose(&given, rule).cost) / tree.bounds.half_area();
        // A sum of 699 inner costs and 700 leaves' in f32.
        let rounding = 1400.0 / 16_777_216.0;
        for cost in [tree.area_cost(), direct.area_cost()] {
            assert!((expected - cost).abs() < rounding * cost, "{expected} {cost}");
        }
    }
}
