use super::radix_tree::{hierarchy, next_skipped};
use super::*;
use crate::accel::box_tree::{BoxTree, Child, TreeShape};
use crate::accel::bvh2::{Bvh2, Bvh2Settings, MAX_DEPTH};
use crate::accel::leaf_rule::half_area;
use crate::accel::test_support::{Random, with_threads};
use crate::accel::{Aabb, LeafRule, Ray, RayIndex};
use glam::Vec3;

/// Boxes around points, of random sizes up to `size`.
fn boxes_around(random: &mut Random, points: impl Iterator<Item = Vec3>, size: f32) -> Vec<Aabb> {
    points
        .map(|p| {
            let half = random.vector().abs() * size;
            Aabb {
                lower: p - half + Vec3::ZERO,
                upper: p + half + Vec3::ZERO,
            }
        })
        .collect()
}

/// Sets of boxes that break naive builders.
pub(crate) fn hard_boxes() -> Vec<(&'static str, Vec<Aabb>)> {
    let mut random = Random(41);
    let random = &mut random;
    let mut points = |n: usize, f: &mut dyn FnMut(&mut Random, usize) -> Vec3| -> Vec<Vec3> {
        (0..n).map(|i| f(random, i)).collect()
    };
    let cloud = points(3000, &mut |r, _| r.vector());
    let plane = points(1000, &mut |r, _| r.vector().with_y(0.5));
    let line = points(1000, &mut |r, _| Vec3::X * r.signed());
    let few = points(2000, &mut |r, _| (r.vector() * 2.0).floor());
    let outlier = points(1000, &mut |r, i| if i == 500 { Vec3::splat(1e6) } else { r.vector() });
    let spread = points(2000, &mut |r, i| r.vector() * 1.07f32.powi(i as i32 % 300));
    let ladder = points(900, &mut |_, i| Vec3::splat(0.5f32.powi(i as i32 % 30) + 1e-12));
    let far = points(1000, &mut |r, _| r.vector() + Vec3::new(1e5, -1e5, 1e5));
    let mut random = Random(42);
    let random = &mut random;
    let mut mixed = boxes_around(random, cloud.iter().copied(), 0.001);
    mixed.extend(boxes_around(random, cloud[..40].iter().copied(), 1.0));
    vec![
        ("none", Vec::new()),
        ("one", boxes_around(random, cloud[..1].iter().copied(), 0.1)),
        ("two", boxes_around(random, cloud[..2].iter().copied(), 0.1)),
        ("three", boxes_around(random, cloud[..3].iter().copied(), 0.1)),
        ("cloud", boxes_around(random, cloud.into_iter(), 0.05)),
        ("plane", boxes_around(random, plane.into_iter(), 0.0)),
        ("line", boxes_around(random, line.into_iter(), 0.0)),
        ("few places", boxes_around(random, few.into_iter(), 0.2)),
        ("outlier", boxes_around(random, outlier.into_iter(), 0.05)),
        ("spread", boxes_around(random, spread.into_iter(), 0.05)),
        ("ladder", boxes_around(random, ladder.into_iter(), 0.0)),
        ("far away", boxes_around(random, far.into_iter(), 0.05)),
        ("mixed sizes", mixed),
        ("identical", vec![Aabb::EMPTY.with_point(Vec3::ONE); 4097]),
    ]
}

const RULES: [LeafRule; 5] = [
    LeafRule::Size(1),
    LeafRule::Size(5),
    LeafRule::Area(1),
    LeafRule::Area(4),
    LeafRule::Area(8),
];

pub(crate) fn valid(name: &str, tree: &BoxTree, boxes: &[Aabb]) -> TreeShape {
    tree.shape(boxes).unwrap_or_else(|fault| panic!("{name}: {fault:?}"))
}

/// What the kernel does: every leaf climbs, in the order given; the first at a node ends there.
fn climbed(
    boxes: &[Aabb],
    sorted: &SortedCodes,
    leaf_size: u32,
    skipped: u32,
    leaves: &[usize],
) -> (Vec<[u32; 2]>, u32, usize) {
    let end = boxes.len() - 1;
    let mut waiting = vec![None; end];
    let mut words = vec![[0; 2]; end];
    let (mut height_of_all, mut root) = (0, 0);
    for &leaf in leaves {
        let (mut first, mut last) = (leaf, leaf);
        let mut bounds = boxes[sorted.order[leaf] as usize];
        let mut cost = half_area(&bounds);
        let mut height = 0;
        let mut word = (leaf as u32) << 4 | 1;
        loop {
            let is_left =
                first == 0 || (last != end && sorted.difference(last, skipped) < sorted.difference(first - 1, skipped));
            let (parent, side) = if is_left { (last, 0) } else { (first - 1, 1) };
            words[parent][side] = word;
            let mine = (if is_left { first } else { last }, bounds, cost, height);
            let Some((other, sibling, sibling_cost, sibling_height)) = waiting[parent].replace(mine) else {
                break;
            };
            (first, last) = if is_left { (first, other) } else { (other, last) };
            bounds = bounds.union(sibling);
            let count = (last - first + 1) as u32;
            let area = half_area(&bounds);
            let split_cost = area + (cost + sibling_cost);
            let is_root = count as usize == boxes.len();
            let is_leaf = LeafRule::Area(leaf_size).makes_leaf(count, area * count as f32, split_cost, is_root);
            height = if is_leaf { 0 } else { sibling_height.max(height) + 1 };
            cost = if is_leaf { area * count as f32 } else { split_cost };
            word = if is_leaf {
                (first as u32) << 4 | count
            } else {
                (parent as u32) << 4
            };
            if is_root {
                (height_of_all, root) = (height, parent);
                break;
            }
        }
    }
    (words, height_of_all, root)
}

#[test]
fn trees_are_valid_on_hard_boxes() {
    for (name, boxes) in hard_boxes() {
        for axis_bits in [10, 21] {
            let sorted = SortedCodes::of_boxes(&boxes, axis_bits);
            assert!(sorted.codes.is_sorted(), "{name}");
            for rule in RULES {
                let tree = hierarchy(&boxes, &sorted, rule, MAX_DEPTH);
                let shape = valid(name, &tree, &boxes);
                assert!(shape.max_depth <= MAX_DEPTH, "{name}: {shape:?}");
                let (LeafRule::Size(largest) | LeafRule::Area(largest)) = rule;
                assert!(shape.largest_leaf <= largest, "{name}: {shape:?}");
                assert_eq!(shape.nodes + 1, shape.leaves.max(1), "{name}");
                assert_eq!(tree.nodes.len(), shape.nodes as usize, "{name}");
            }
        }
    }
}

#[test]
fn the_order_of_climbing_never_shows() {
    let mut random = Random(43);
    for (name, boxes) in hard_boxes().into_iter().filter(|(_, boxes)| boxes.len() > 1) {
        let sorted = SortedCodes::of_boxes(&boxes, 10);
        let mut leaves: Vec<usize> = (0..boxes.len()).collect();
        for i in (1..leaves.len()).rev() {
            leaves.swap(i, random.below(i + 1));
        }
        let mut skipped = 0;
        let (mut words, mut height, mut root) = climbed(&boxes, &sorted, 4, skipped, &leaves);
        while height > MAX_DEPTH {
            skipped = next_skipped(skipped, height, MAX_DEPTH, sorted.bits);
            (words, height, root) = climbed(&boxes, &sorted, 4, skipped, &leaves);
        }
        let tree = hierarchy(&boxes, &sorted, LeafRule::Area(4), MAX_DEPTH);
        assert_eq!(valid(name, &tree, &boxes).max_depth, height, "{name}");
        // Both from their roots down: the same leaves on the same sides.
        let mut reached = vec![false; words.len()];
        let mut pairs = vec![(0u32, root)];
        while let Some((node, split)) = pairs.pop() {
            assert!(!std::mem::replace(&mut reached[split], true));
            for (side, word) in words[split].into_iter().enumerate() {
                match tree.nodes[node as usize].children[side] {
                    Child::Leaf { first, count } => assert_eq!(word, first << 4 | count, "{name}"),
                    Child::Inner(child) => {
                        assert_eq!(word & 15, 0, "{name}");
                        pairs.push((child, (word >> 4) as usize));
                    }
                }
            }
        }
    }
}

#[test]
fn restructured_trees_are_valid_and_cost_no_more() {
    for (name, boxes) in hard_boxes().into_iter().filter(|(_, boxes)| boxes.len() > 1) {
        let costs = [BuildQuality::Fast, BuildQuality::High].map(|quality| {
            let settings = LbvhSettings {
                quality,
                ..LbvhSettings::default()
            };
            let tree = hierarchy_of(&boxes, &settings);
            let shape = valid(name, &tree, &boxes);
            assert!(
                shape.max_depth <= MAX_DEPTH && shape.largest_leaf <= 4,
                "{name}: {shape:?}"
            );
            tree.area_cost()
        });
        // Decisions are taken in f32, each sum of n costs within n units of roundoff.
        let rounding = 1.0 + boxes.len() as f64 / 16_777_216.0;
        assert!(costs[1] <= costs[0] * rounding, "{name}: {costs:?}");
    }
}

#[test]
fn a_tree_of_a_million_identical_centres_is_shallow() {
    let boxes = vec![Aabb::EMPTY.with_point(Vec3::new(3.0, -2.0, 0.5)); 1_000_000];
    for axis_bits in [10, 21] {
        let sorted = SortedCodes::of_boxes(&boxes, axis_bits);
        let tree = hierarchy(&boxes, &sorted, LeafRule::Size(1), MAX_DEPTH);
        let shape = valid("identical", &tree, &boxes);
        assert_eq!(shape.leaves as usize, boxes.len());
        assert_eq!(shape.max_depth, boxes.len().next_power_of_two().ilog2());
    }
}

fn soup(random: &mut Random, count: usize, size: f32) -> Vec<[Vec3; 3]> {
    let triangle = |random: &mut Random| {
        let p = random.vector();
        [0; 3].map(|_| p + random.vector() * size)
    };
    (0..count).map(|_| triangle(random)).collect()
}

#[test]
fn hits_are_those_of_the_binned_tree() {
    let mut random = Random(44);
    let mut triangles = soup(&mut random, 3000, 0.1);
    for i in 0..30 {
        triangles[i * 7][i % 3].x = f32::NAN;
        triangles[i * 7 + 1][1] = triangles[i * 7 + 1][0];
        triangles[i * 7 + 2] = triangles[i * 7 + 3];
    }
    let rays: Vec<Ray> = (0..3000)
        .map(|_| Ray::new(random.vector() * 1.5, random.direction()))
        .collect();
    let binned = Bvh2::build(&triangles, &Bvh2Settings::default()).expect("valid");
    for quality in [BuildQuality::Fast, BuildQuality::High] {
        for (code_bits, leaf_size) in [(30, 4), (63, 1), (30, 8)] {
            let settings = LbvhSettings {
                code_bits,
                leaf_size,
                quality,
                ..LbvhSettings::default()
            };
            for count in [triangles.len(), 0, 1, 2, 3] {
                let few = &triangles[triangles.len() - count..];
                let other = build(few, &settings).expect("valid");
                assert_eq!(other.name(), "lbvh");
                let few_binned = Bvh2::build(few, &Bvh2Settings::default()).expect("valid");
                let reference = if count < triangles.len() { &few_binned } else { &binned };
                assert_eq!(other.statistics().triangles, reference.statistics().triangles);
                for ray in &rays {
                    let (a, b) = (other.closest_hit(ray), reference.closest_hit(ray));
                    assert_eq!(bytemuck::bytes_of(&a), bytemuck::bytes_of(&b));
                    assert_eq!(other.any_hit(ray), b.is_hit());
                }
            }
        }
    }
}

#[test]
fn refitted_trees_have_the_hits_of_new_ones() {
    let mut random = Random(46);
    let mut triangles = soup(&mut random, 1200, 0.1);
    triangles[5][2].y = f32::NAN;
    triangles[6][1] = triangles[6][0];
    let before = build(&triangles, &LbvhSettings::default()).expect("valid");
    let same = refit(&before, &triangles).expect("unmoved");
    assert!(same.texels() == before.texels());
    for triangle in &mut triangles {
        let shift = random.vector() * 0.05;
        triangle.iter_mut().for_each(|v| *v += shift);
    }
    triangles[9][1] = triangles[9][2];
    let moved = refit(&before, &triangles).expect("in range");
    let anew = build(&triangles, &LbvhSettings::default()).expect("valid");
    let mut hits = 0;
    for _ in 0..3000 {
        let ray = Ray::new(random.vector() * 1.5, random.direction());
        let (a, b) = (moved.closest_hit(&ray), anew.closest_hit(&ray));
        assert_eq!(bytemuck::bytes_of(&a), bytemuck::bytes_of(&b));
        hits += u32::from(a.is_hit());
    }
    assert!(hits > 300, "{hits}");
    assert!(refit(&before, &triangles[1..]).is_err());
    triangles[8][0].x = f32::INFINITY;
    assert!(refit(&before, &triangles).is_err());
    for count in [0, 1, 2] {
        let few = build(&triangles[..count], &LbvhSettings::default()).expect("valid");
        assert!(refit(&few, &triangles[..count]).expect("unmoved").texels() == few.texels());
    }
}

#[test]
fn bytes_do_not_depend_on_the_number_of_threads() {
    let triangles = soup(&mut Random(45), 20_000, 0.02);
    for quality in [BuildQuality::Fast, BuildQuality::High] {
        let settings = LbvhSettings {
            quality,
            ..LbvhSettings::default()
        };
        let built = |threads| with_threads(threads, || build(&triangles, &settings).expect("valid"));
        let one = built(1);
        for threads in [2, 5] {
            assert!(one.texels() == built(threads).texels(), "{threads} threads");
        }
    }
}

#[test]
fn settings_out_of_range_are_refused() {
    let good = LbvhSettings::default();
    for bad in [
        LbvhSettings { code_bits: 31, ..good },
        LbvhSettings { code_bits: 60, ..good },
        LbvhSettings { leaf_size: 9, ..good },
        LbvhSettings { leaf_size: 0, ..good },
        LbvhSettings { treelet: 2, ..good },
        LbvhSettings { treelet: 17, ..good },
        LbvhSettings { rounds: 17, ..good },
        LbvhSettings { mini_tree: 257, ..good },
        LbvhSettings {
            reinsertions: 17,
            ..good
        },
    ] {
        assert!(build(&[], &bad).is_err(), "{bad:?}");
    }
}
