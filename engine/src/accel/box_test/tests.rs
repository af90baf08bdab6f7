//! Slabs at every face, edge and corner of boxes, against f64.

use super::*;
use crate::accel::test_support::{Random, U};

/// A cube, boxes without extent along one, two and three axes, one of odd numbers, one away from the origin.
fn boxes() -> [Aabb; 6] {
    let of = |lower, upper| Aabb { lower, upper };
    [
        of(Vec3::ZERO, Vec3::ONE),
        of(Vec3::new(0.0, 0.0, 0.5), Vec3::new(1.0, 1.0, 0.5)),
        of(Vec3::new(0.25, 0.0, 0.5), Vec3::new(0.25, 1.0, 0.5)),
        of(Vec3::splat(0.75), Vec3::splat(0.75)),
        of(Vec3::new(0.1, -0.3, 1.1), Vec3::new(0.7, 0.9, 1.3)),
        of(Vec3::new(100.3, -50.1, 7.7), Vec3::new(101.0, -49.3, 8.6)),
    ]
}

/// The 6 faces, 12 edges and 8 corners of a box: a point of each, and on each axis whether it is at the lower plane, between, or at the upper.
fn places(bounds: &Aabb) -> Vec<(Vec3, [usize; 3])> {
    let steps = (0..27).filter(|i| *i != 13).map(|i| [i % 3, i / 3 % 3, i / 9]);
    let at = |axis: usize, step: usize| {
        let (lower, upper) = (bounds.lower[axis], bounds.upper[axis]);
        [lower, 0.5 * (lower + upper), upper][step]
    };
    steps
        .map(|steps| (Vec3::from_array([0, 1, 2].map(|axis| at(axis, steps[axis]))), steps))
        .collect()
}

/// The test of a ray for a box alone, and the box's span behind the ray's begin.
fn span(bounds: &Aabb, origin: Vec3, direction: Vec3) -> (BoxTest, [f32; 2]) {
    let test = BoxTest::new(bounds, &Ray::new(origin, direction));
    let (enter, leave) = test.span(bounds.lower, bounds.upper);
    (test, [enter.max(0.0), leave])
}

fn met([enter, leave]: [f32; 2]) -> bool {
    enter <= leave
}

/// By how much more than nothing, as a share of the reach, planes are met too early or too late at most: the slack, and what a difference, a
/// reciprocal, a product and the slack itself are rounded by.
const MOST: f64 = BOX_SLACK as f64 + 8.0 * U;

/// Largest component distance from a point to a corner of a box.
fn reach(bounds: &Aabb, origin: Vec3) -> f64 {
    let away = |corner: Vec3| (corner.as_dvec3() - origin.as_dvec3()).abs().max_element();
    away(bounds.lower).max(away(bounds.upper))
}

#[test]
fn rays_along_axes_meet_boxes_at_every_face_edge_and_corner_and_not_beside_them() {
    let mut beside = 0;
    for bounds in boxes() {
        let places = places(&bounds);
        assert_eq!(places.len(), 26);
        for (place, steps) in places {
            for axis in 0..3 {
                for (sign, zero) in [(1.0, 0.0), (1.0, -0.0), (-1.0, 0.0), (-1.0, -0.0)] {
                    let mut direction = Vec3::splat(zero);
                    direction[axis] = sign;
                    let (near, far) = match sign > 0.0 {
                        true => (bounds.lower[axis], bounds.upper[axis]),
                        false => (bounds.upper[axis], bounds.lower[axis]),
                    };
                    let mut origin = place;
                    origin[axis] = near - 2.0 * sign;
                    let (_, found) = span(&bounds, origin, direction);
                    assert!(met(found), "{bounds:?} {origin} {direction}");
                    let grown = MOST * reach(&bounds, origin);
                    for (found, plane, sign_of_slack) in [(found[0], near, -1.0), (found[1], far, 1.0)] {
                        let exact = (f64::from(plane) - f64::from(origin[axis])) * f64::from(sign);
                        let by = sign_of_slack * (f64::from(found) - exact);
                        assert!((0.0..=grown).contains(&by), "{bounds:?} {origin} {direction}: {by}");
                    }
                    for other in across(axis) {
                        let outward = match steps[other] {
                            0 => -1.0,
                            2 => 1.0,
                            _ => continue,
                        };
                        // Boxes are met this far beside them, and no further.
                        let mut origin = origin;
                        origin[other] += outward * 2.0 * grown as f32;
                        assert!(
                            !met(span(&bounds, origin, direction).1),
                            "{bounds:?} {origin} {direction}"
                        );
                        beside += 1;
                    }
                }
            }
        }
    }
    // On each of two axes across, 18 of 26 places lie at a plane.
    assert_eq!(beside, boxes().len() * 3 * 4 * 2 * 18);
}

fn across(axis: usize) -> [usize; 2] {
    [(axis + 1) % 3, (axis + 2) % 3]
}

/// Entry and exit of a ray in f64, from its begin on; the entry is greater where the box is missed.
fn span_f64(bounds: &Aabb, origin: Vec3, direction: Vec3) -> [f64; 2] {
    let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
    let (a, b) = ((bounds.lower.as_dvec3() - o) / d, (bounds.upper.as_dvec3() - o) / d);
    [a.min(b).max_element().max(0.0), a.max(b).min_element()]
}

#[test]
fn spans_of_rays_at_faces_edges_and_corners_are_those_of_f64() {
    let mut random = Random(54);
    let (mut hits, mut misses) = (0, 0);
    for bounds in boxes() {
        for (place, _) in places(&bounds) {
            for i in 0..200 {
                // No component so small that f64 could not tell.
                let away = Vec3::from_array([(); 3].map(|()| random.choose(&[1.0, -1.0]) * random.range(0.05, 1.0)));
                let beside = match i % 2 {
                    0 => Vec3::ZERO,
                    _ => random.vector() * random.magnitude(-24, -4),
                };
                let origin = place + beside - 3.0 * away;
                let ((test, found), [enter, leave]) = (span(&bounds, origin, away), span_f64(&bounds, origin, away));
                let what = format!("{bounds:?} {origin} {away}: {found:?}, {enter} to {leave}");
                // Of the axis along which planes err most.
                let grown = MOST * reach(&bounds, origin) * f64::from(test.inverse.abs().max_element());
                if enter <= leave {
                    hits += 1;
                    assert!(met(found), "{what}");
                    let early = enter - f64::from(found[0]);
                    let late = f64::from(found[1]) - leave;
                    assert!(
                        (0.0..=grown).contains(&early) && (0.0..=grown).contains(&late),
                        "{what}"
                    );
                } else if enter - leave > 2.0 * grown {
                    misses += 1;
                    assert!(!met(found), "{what}");
                }
            }
        }
    }
    assert!(hits > 3000 && misses > 3000, "{hits} hits, {misses} misses");
}

#[test]
fn boxes_are_met_up_to_their_slack_and_no_further() {
    let mut random = Random(17);
    let root = Aabb {
        lower: Vec3::splat(-4.0),
        upper: Vec3::splat(4.0),
    };
    let (mut met, mut missed) = (0, 0);
    for flat in [1.0, 0.0] {
        let upper = Vec3::new(0.5, 0.75, 0.625 * flat);
        // Faces, edges, corners and the middle.
        for place in (0..27u16).map(|i| upper * Vec3::from_array([i % 3, i / 3 % 3, i / 9].map(|i| f32::from(i) - 1.0)))
        {
            for i in 0..200 {
                let beside = if i % 2 == 0 { 0.0 } else { random.magnitude(-20, 0) };
                let target = place + random.vector() * beside;
                let mut direction = random.direction();
                if i % 5 == 0 {
                    direction[random.below(3)] = 0.0;
                }
                let ray = Ray::new(target - 3.0 * direction, direction);
                let test = BoxTest::new(&root, &ray);
                let (enter, leave) = test.span(-upper, upper);
                // The same planes in f64, and how far apart the ends are at most by which boxes are grown.
                let (o, inverse) = (test.origin.as_dvec3(), test.inverse.as_dvec3());
                let (a, b) = ((-upper.as_dvec3() - o) * inverse, (upper.as_dvec3() - o) * inverse);
                let gap = a.min(b).max_element() - a.max(b).min_element();
                if gap <= 0.0 {
                    met += 1;
                    assert!(enter <= leave, "{upper} {ray:?}");
                } else if gap > 4.0 * f64::from(test.slack.max_element()) {
                    missed += 1;
                    assert!(enter > leave, "{upper} {ray:?}");
                }
            }
        }
    }
    assert!(met > 2000 && missed > 500, "{met} met, {missed} missed");
}
