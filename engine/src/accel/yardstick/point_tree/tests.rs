//! Both kinds of trees against trying all points.

use super::super::left_balanced::LeftBalancedTree;
use super::super::voxel_volume::VoxelVolumeTree;
use super::*;
use crate::test_random::Random;

/// Points about four places, and one in eight anywhere.
pub fn clusters(seed: u64, count: usize) -> Vec<Vec3> {
    let mut random = Random(seed);
    let places: Vec<Vec3> = (0..4).map(|_| random.vector()).collect();
    let point = |i: usize| match i % 8 {
        0 => random.vector(),
        _ => random.choose(&places) + 0.05 * random.vector(),
    };
    (0..count).map(point).collect()
}

/// Points on a diagonal, each twice as far out as the one before.
pub fn octaves() -> Vec<Vec3> {
    (0..268).map(|i| Vec3::splat(2f64.powi(i - 140) as f32)).collect()
}

/// Sets of points that are hard for one reason or another.
fn hard_points() -> Vec<(&'static str, Vec<Vec3>)> {
    let mut random = Random(91);
    let cell = |i: u32| Vec3::new((i % 6) as f32, (i / 6 % 6) as f32, (i / 36) as f32);
    vec![
        ("none", Vec::new()),
        ("one", vec![Vec3::ONE]),
        ("two", vec![Vec3::ONE, Vec3::NEG_ONE]),
        ("all the same", vec![Vec3::new(0.5, -1.0, 2.0); 50]),
        // Many at equal distances, and in the planes of others.
        ("grid", (0..216).map(cell).collect()),
        ("twice the grid", (0..432).map(|i| cell(i % 216)).collect()),
        ("line", (0..100).map(|i| Vec3::X * i as f32).collect()),
        ("floor", (0..300).map(|_| random.vector().with_y(0.0)).collect()),
        ("zeros", (0..64).map(|_| random.vector().round() * -0.0).collect()),
        ("clusters", clusters(92, 300)),
        ("octaves", octaves()),
        (
            "far out",
            (0..200).map(|_| Vec3::splat(1e8) + 100.0 * random.vector()).collect(),
        ),
    ]
}

/// All points no farther than the radius: bits of the squared distance, and index; nearest first.
fn tried(points: &[Vec3], query: Vec3, radius: f32) -> Vec<(u32, u32)> {
    let squared = points.iter().map(|point| (point - query).length_squared());
    let mut found: Vec<(u32, u32)> = (0..)
        .zip(squared)
        .filter(|(_, squared)| *squared <= radius * radius)
        .map(|(i, squared)| (squared.to_bits(), i))
        .collect();
    found.sort_unstable();
    found
}

/// Somewhere among points: at one, in the plane of one, between two, and anywhere; with a radius.
fn query(random: &mut Random, points: &[Vec3]) -> (Vec3, f32) {
    let mut any = || {
        points
            .get(random.below(points.len().max(1)))
            .copied()
            .unwrap_or(Vec3::ZERO)
    };
    let (a, b) = (any(), any());
    let point = match random.below(5) {
        0 => a,
        1 => b.with_x(a.x),
        2 => 0.5 * (a + b),
        3 => a + random.vector().round(),
        _ => 3.0 * random.vector(),
    };
    let apart = (a - b).length();
    (
        point,
        random.choose(&[0.0, 0.1, 1.0, 2.0, apart, 0.25 * apart, f32::INFINITY]),
    )
}

fn pair(near: &Near) -> (u32, u32) {
    (near.squared.to_bits(), near.point)
}

fn check_gathers<T: PointTree>(name: &str, tree: &T, points: &[Vec3]) {
    let mut random = Random(93);
    for _ in 0..200 {
        let (point, radius) = query(&mut random, points);
        let mut counters = QueryCounters::default();
        let mut found = Vec::new();
        tree.within(point, radius, &mut counters, |near| {
            assert_eq!(tree.node(near.place).point, near.point, "{name}");
            found.push(pair(&near));
        });
        found.sort_unstable();
        assert_eq!(found, tried(points, point, radius), "{name}: {point} within {radius}");
        assert_eq!(
            counters.bytes,
            T::NODE_BYTES * counters.nodes + 4 * counters.pushes,
            "{name}"
        );
    }
}

#[test]
fn queries_within_a_radius_are_those_of_trying_all_points() {
    for (name, points) in hard_points() {
        check_gathers(name, &LeftBalancedTree::build(&points).expect("small"), &points);
        for reach in [0.0, 1.0] {
            check_gathers(name, &VoxelVolumeTree::build(&points, reach).expect("small"), &points);
        }
    }
}

fn check_nearest<T: PointTree>(name: &str, tree: &T, points: &[Vec3]) {
    let mut random = Random(94);
    for _ in 0..200 {
        let (point, radius) = query(&mut random, points);
        let most = random.choose(&[0, 1, 2, 7, 50, 1000]);
        let mut counters = QueryCounters::default();
        let found = tree.nearest(point, most, radius, &mut counters);
        let mut expected = tried(points, point, radius);
        expected.truncate(most);
        let pairs: Vec<(u32, u32)> = found.iter().map(pair).collect();
        assert_eq!(pairs, expected, "{name}: {most} about {point} within {radius}");
        assert!(
            found.iter().all(|near| tree.node(near.place).point == near.point),
            "{name}"
        );
        assert_eq!(
            counters.bytes,
            T::NODE_BYTES * counters.nodes + 8 * counters.pushes,
            "{name}"
        );
        let mut all = QueryCounters::default();
        tree.within(point, radius, &mut all, |_| {});
        assert!(
            counters.nodes <= all.nodes,
            "{name}: a search that shrinks visits no more"
        );
    }
}

#[test]
fn the_nearest_are_those_of_trying_all_points() {
    for (name, points) in hard_points() {
        check_nearest(name, &LeftBalancedTree::build(&points).expect("small"), &points);
        check_nearest(name, &VoxelVolumeTree::build(&points, 1.0).expect("small"), &points);
    }
    // The ten nearest of many need a small part of the tree.
    let points = clusters(95, 4000);
    let tree = LeftBalancedTree::build(&points).expect("small");
    let mut counters = QueryCounters::default();
    for point in &points[..100] {
        tree.nearest(*point, 10, f32::INFINITY, &mut counters);
    }
    assert!(counters.nodes < 100 * 4000 / 8, "{counters:?}");
}

/// Whether a query reaches a box, by the comparisons with planes that rounding leaves exact.
fn reaches(bounds: &Aabb, point: Vec3, radius: f32) -> bool {
    (0..3).all(|axis| {
        let apart = (bounds.lower[axis] - point[axis])
            .max(point[axis] - bounds.upper[axis])
            .max(0.0);
        apart * apart <= radius * radius
    })
}

fn check_visits<T: PointTree>(name: &str, tree: &T, points: &[Vec3]) {
    let everywhere = Aabb {
        lower: Vec3::NEG_INFINITY,
        upper: Vec3::INFINITY,
    };
    let boxes = boxes(tree, everywhere);
    assert_eq!(boxes.len() as u32, tree.count(), "{name}");
    let mut random = Random(96);
    for _ in 0..200 {
        let (point, radius) = query(&mut random, points);
        let mut counters = QueryCounters::default();
        tree.within(point, radius, &mut counters, |_| {});
        let reached = boxes.iter().filter(|(_, bounds)| reaches(bounds, point, radius));
        assert_eq!(
            counters.nodes,
            reached.count() as u64,
            "{name}: {point} within {radius}"
        );
    }
}

#[test]
fn queries_visit_the_nodes_whose_boxes_they_reach_and_no_others() {
    for (name, points) in hard_points() {
        check_visits(name, &LeftBalancedTree::build(&points).expect("small"), &points);
        check_visits(name, &VoxelVolumeTree::build(&points, 1.0).expect("small"), &points);
    }
}

fn check_expected<T: PointTree>(tree: &T, reach: f32) {
    const QUERIES: u32 = 4000;
    let bounds = tree.bounds();
    let mut random = Random(97);
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..QUERIES {
        let place = Vec3::new(random.unit(), random.unit(), random.unit());
        let point = bounds.lower - reach + place * (bounds.upper - bounds.lower + 2.0 * reach);
        let mut counters = QueryCounters::default();
        tree.within(point, reach, &mut counters, |_| {});
        let visits = counters.nodes as f64;
        sum += visits;
        squares += visits * visits;
    }
    let mean = sum / f64::from(QUERIES);
    let deviation = ((squares / f64::from(QUERIES) - mean * mean) / f64::from(QUERIES)).sqrt();
    let z = (mean - tree.expected_visits(reach)) / deviation;
    // Chance exceeds 4.5 in one of 147,000 such tests.
    assert!(z.abs() < 4.5, "{z}: {mean}");
}

#[test]
fn visits_are_as_many_as_grown_volumes_foretell() {
    let points = clusters(98, 500);
    for reach in [0.05, 0.4] {
        check_expected(&LeftBalancedTree::build(&points).expect("small"), reach);
        check_expected(&VoxelVolumeTree::build(&points, reach).expect("small"), reach);
    }
    let same = LeftBalancedTree::build(&[Vec3::ONE; 5]).expect("small");
    assert_eq!((same.expected_visits(0.0), same.expected_visits(0.5)), (5.0, 5.0));
}

#[test]
fn points_that_are_not_finite_are_in_no_answer() {
    let mut points = clusters(99, 60);
    points[3].x = f32::NAN;
    points[17].y = f32::INFINITY;
    points[40].z = f32::NEG_INFINITY;
    let balanced = LeftBalancedTree::build(&points).expect("small");
    let by_volume = VoxelVolumeTree::build(&points, 0.1).expect("small");
    assert_eq!((balanced.count(), by_volume.count()), (57, 57));
    let mut counters = QueryCounters::default();
    let mut all = tried(&points, Vec3::ZERO, 100.0);
    all.retain(|(_, i)| points[*i as usize].is_finite());
    assert_eq!(all.len(), 57);
    for found in [
        balanced.nearest(Vec3::ZERO, 100, 100.0, &mut counters),
        by_volume.nearest(Vec3::ZERO, 100, 100.0, &mut counters),
    ] {
        assert!(found.iter().map(pair).eq(all.iter().copied()));
    }
    // Nothing is near what is nowhere.
    let nowhere = balanced.nearest(Vec3::splat(f32::NAN), 5, f32::INFINITY, &mut counters);
    assert!(nowhere.is_empty());
}
