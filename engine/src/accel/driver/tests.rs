//! The boxes of the driver's index against what the triangle test reports, in f64.

use super::*;
use crate::accel::test_support::{Random, U, awkward};
use crate::accel::{Ray, triangle};

/// Triangles about a place, of sizes from that of the whole down to a thousandth of it.
fn soup(random: &mut Random, centre: Vec3, size: f32) -> Vec<[Vec3; 3]> {
    (0..60)
        .map(|i| {
            let corner = centre + size * random.vector();
            let edge = size * [1.0, 0.1, 1e-3][i % 3];
            [corner, corner + edge * random.vector(), corner + edge * random.vector()]
        })
        .collect()
}

#[test]
fn boxes_hold_what_the_triangle_test_reports_of_rays_within_reach() {
    let mut random = Random(7);
    let (mut met, mut beyond) = (0, 0);
    for (centre, size) in [
        (Vec3::ZERO, 1.0),
        (Vec3::ZERO, 1e-4),
        (Vec3::ZERO, 1e5),
        (Vec3::new(3e4, -1e5, 777.0), 100.0),
    ] {
        let triangles = soup(&mut random, centre, size);
        let bounds = triangles.iter().map(bounds_of).fold(Aabb::EMPTY, Aabb::union);
        let frame = Frame::around(&bounds);
        let far = |random: &mut Random| {
            let origin = centre + random.choose(&[3.0, 12.0, 200.0]) * size * random.direction();
            Ray::new(origin, random.choose(&triangles)[0] - origin)
        };
        let mut rays: Vec<Ray> = (0..600).map(|_| far(&mut random)).collect();
        rays.extend(awkward::rays(&mut random, 600, |random| random.choose(&triangles)));
        for ray in rays.iter().filter(|ray| ray.is_traceable()) {
            let (origin, direction) = (Vec3::from(ray.origin), Vec3::from(ray.direction));
            let reach = (bounds.lower - origin)
                .abs()
                .max((bounds.upper - origin).abs())
                .max_element();
            if reach > frame.reach {
                beyond += 1;
                continue;
            }
            let shear = triangle::ray_shear(origin, direction);
            for triangle in &triangles {
                let Some(hit) = triangle::intersect_triangle(&shear, triangle, ray.t_min, ray.t_max) else {
                    continue;
                };
                met += 1;
                // As kernels hand it to the driver.
                let place = (origin - frame.origin).as_dvec3() + f64::from(hit.t) * direction.as_dvec3();
                let [lower, upper] = frame
                    .grown(&bounds_of(triangle))
                    .map(|corner| Vec3::from(corner).as_dvec3());
                let inside = (place - lower).min(upper - place).min_element();
                let left = 8.0 * U * f64::from(reach);
                assert!(
                    inside >= left,
                    "{ray:?}: {inside} m inside the box of {triangle:?}, {left} are the driver's"
                );
            }
        }
    }
    assert!(met > 3000 && beyond > 300, "{met} hits, {beyond} rays from beyond");
}

#[test]
fn boxes_are_rounded_outwards_and_those_of_nothing_have_a_frame() {
    for x in [0.1, -0.1, 1.0 + 1e-9, 1.0 - 1e-9, 3e-39, -3e-39, 0.0] {
        let below = rounded_down(x);
        assert!(f64::from(below) <= x && f64::from(below.next_up()) > x, "{x}: {below}");
    }
    let frame = Frame::around(&Aabb::EMPTY);
    assert_eq!((frame.origin, frame.reach), (Vec3::ZERO, 0.0));
}
