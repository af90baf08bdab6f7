//! Slabs at every face, edge and corner of boxes, against f64.

use super::*;
use crate::test_random::Random;

/// Unit roundoff of f32.
const U: f64 = 1.0 / 16_777_216.0;

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

fn span(bounds: &Aabb, origin: Vec3, direction: Vec3) -> [f32; 2] {
    let ray = SlabRay::new(origin, direction, 0.0, f32::INFINITY);
    ray.span(bounds, ray.ends())
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
                    let found = span(&bounds, origin, direction);
                    assert!(met(found), "{bounds:?} {origin} {direction}");
                    for (found, plane) in found.into_iter().zip([near, far]) {
                        // One difference, rounded.
                        let exact = (f64::from(plane) - f64::from(origin[axis])) * f64::from(sign);
                        assert!(
                            (f64::from(found) - exact).abs() <= U * exact,
                            "{bounds:?} {origin} {direction}"
                        );
                    }
                    for other in across(axis) {
                        let outside = match steps[other] {
                            0 => bounds.lower[other].next_down(),
                            2 => bounds.upper[other].next_up(),
                            _ => continue,
                        };
                        let mut origin = origin;
                        origin[other] = outside;
                        assert!(
                            !met(span(&bounds, origin, direction)),
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
                let (found, [enter, leave]) = (span(&bounds, origin, away), span_f64(&bounds, origin, away));
                let what = format!("{bounds:?} {origin} {away}: {found:?}, {enter} to {leave}");
                let slack = f64::from(SPAN_SLACK) * leave.abs();
                if enter <= leave {
                    hits += 1;
                    assert!(met(found), "{what}");
                    // A difference, a reciprocal and a product, each rounded.
                    for (found, exact) in found.into_iter().zip([enter, leave]) {
                        assert!((f64::from(found) - exact).abs() <= 4.0 * U * exact.abs(), "{what}");
                    }
                } else if enter - leave > 2.0 * slack {
                    misses += 1;
                    assert!(!met(found), "{what}");
                }
            }
        }
    }
    assert!(hits > 3000 && misses > 3000, "{hits} hits, {misses} misses");
}
