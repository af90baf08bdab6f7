use super::oracles::{intersect_triangle_f64, moller_trumbore};
use super::*;
use crate::accel::Ray;
use crate::accel::test_support::{Random, Sheared, U};

fn test(ray: &Ray, triangle: &[Vec3; 3]) -> Option<TriangleHit> {
    let shear = ray_shear(ray.origin.into(), ray.direction.into());
    intersect_triangle(&shear, triangle, ray.t_min, ray.t_max)
}

/// Well-shaped, needle-like, large and tiny triangles, some far from the origin, with a ray near each.
fn random_case(random: &mut Random) -> (Ray, [Vec3; 3]) {
    let scale = random.magnitude(-13, 17);
    let centre = match random.below(3) {
        0 => Vec3::ZERO,
        1 => random.vector() * scale * 100.0,
        _ => random.vector() * scale,
    };
    let mut triangle = [0; 3].map(|_| centre + random.vector() * scale);
    match random.below(4) {
        0 => {
            let along = 0.5 + 0.5 * random.signed();
            let width = scale * random.magnitude(-20, -2);
            triangle[2] = triangle[0] + (triangle[1] - triangle[0]) * along + random.vector() * width;
        }
        1 => triangle[2] = triangle[0] + (triangle[1] - triangle[0]) * random.magnitude(-10, -1),
        _ => {}
    }
    let (a, b) = (0.5 + 0.5 * random.signed(), 0.5 + 0.5 * random.signed());
    let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
    let target = triangle[0] + (triangle[1] - triangle[0]) * a + (triangle[2] - triangle[0]) * b;
    let origin = centre + random.vector() * scale * 3.0;
    let mut direction = target - origin;
    if random.below(3) == 0 {
        direction[random.below(3)] = 0.0;
    }
    if random.below(3) > 0 {
        direction = direction.normalize_or_zero();
    }
    (Ray::new(origin, direction), triangle)
}

#[test]
fn difference_of_products_keeps_sign_and_relative_error() {
    let mut random = Random(1);
    for i in 0..200_000u64 {
        let (a, b) = (
            random.signed() * random.magnitude(-20, 20),
            random.signed() * random.magnitude(-20, 20),
        );
        let (c, d) = match i % 3 {
            0 => (random.signed(), random.signed()),
            // Nearly equal products: neighbours of the same factors.
            1 => (a * (1.0 + (random.below(5) as f32 - 2.0) * f32::EPSILON), b),
            _ => (b * 3.0, (a / 3.0).next_up()),
        };
        // Products of f32 are exact in f64 and their difference is rounded once.
        let exact = f64::from(a) * f64::from(b) - f64::from(c) * f64::from(d);
        let computed = difference_of_products(a, b, c, d);
        assert!(
            (f64::from(computed) - exact).abs() <= 2.0 * U * exact.abs(),
            "{a} {b} {c} {d}: {computed} {exact}"
        );
        assert_eq!(computed, -difference_of_products(c, d, a, b));
        assert_eq!(computed, difference_of_products(b, a, d, c));
    }
}

#[test]
fn hits_keep_their_stated_error_and_misses_are_right() {
    let mut random = Random(2);
    let mut hits = 0;
    for _ in 0..100_000 {
        let (ray, triangle) = random_case(&mut random);
        let sheared = Sheared::new(&ray, &triangle);
        let m = sheared.reach;
        let Some(hit) = test(&ray, &triangle) else {
            // Each sheared vertex moved by 10uM at most: a ray further inside cannot be missed, unless t is out of range.
            let t_slack = 18.0 * U * m / sheared.direction + 16.0 * U * m * sheared.plane().1;
            assert!(
                !(sheared.depth_inside() > 15.0 * U * m && sheared.plane().0 > t_slack),
                "{ray:?} {triangle:?}"
            );
            continue;
        };
        hits += 1;
        let (u, v) = (f64::from(hit.u), f64::from(hit.v));
        assert!(u >= 0.0 && v >= 0.0 && u + v <= 1.0 + 8.0 * U);
        let [a, b, c] = sheared.vertices;
        let point = a + (b - a) * u + (c - a) * v;
        // 16uM from the test; rounding u and v (determinant, reciprocal, product) adds 4u of edges no longer than 2M each.
        assert!(
            point.truncate().abs().max_element() <= 32.0 * U * m,
            "{ray:?} {triangle:?} {hit:?}"
        );
        assert!(
            (point.z - f64::from(hit.t)).abs() <= 34.0 * U * m / sheared.direction,
            "{ray:?} {triangle:?} {hit:?}"
        );
    }
    assert!(hits > 20_000, "{hits}");
}

#[test]
fn oracles_agree_with_each_other() {
    let mut random = Random(3);
    for _ in 0..50_000 {
        let (ray, triangle) = random_case(&mut random);
        let sheared = Sheared::new(&ray, &triangle);
        let (t, slope) = sheared.plane();
        let [a, b, c] = sheared.vertices.map(|v| v.truncate());
        // f64 roundings of the coordinates, 64 of them at most, grow as the triangle gets thinner.
        let condition = sheared.reach * sheared.reach / (b - a).perp_dot(c - a).abs();
        let length = 64.0 * f64::EPSILON * sheared.reach * (1.0 + condition);
        let bound = length * (slope + 1.0 / sheared.direction);
        match (
            intersect_triangle_f64(&ray, &triangle),
            moller_trumbore(&ray, &triangle),
        ) {
            (Some(a), Some(b)) => assert!((a.t - b.t).abs() <= bound, "{ray:?} {triangle:?} {a:?} {b:?}"),
            (None, None) => {}
            _ => assert!(
                sheared.depth_inside().abs() <= length || t.abs() <= bound,
                "{ray:?} {triangle:?}"
            ),
        }
    }
}

#[test]
fn degenerate_and_invalid_triangles_are_missed() {
    let r = Ray::new(Vec3::new(0.25, 0.25, 1.0), -Vec3::Z);
    let good = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let hit = test(&r, &good).map(|h| (h.t, h.u, h.v));
    assert_eq!(hit, Some((1.0, 0.25, 0.25)));
    let back = test(&Ray::new(Vec3::new(0.25, 0.25, -1.0), Vec3::Z), &good);
    assert_eq!(back.map(|h| (h.t, h.u, h.v)), Some((1.0, 0.25, 0.25)));

    let target = Vec3::new(0.25, 0.25, 0.0);
    assert_eq!(test(&r, &[target; 3]), None);
    assert_eq!(test(&r, &[Vec3::ZERO, Vec3::ZERO, target * 2.0]), None);
    // Edge-on.
    assert_eq!(
        test(&r, &[Vec3::ZERO, target * 2.0, target * 2.0 + Vec3::Z * 0.5]),
        None
    );
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for i in 0..9 {
            let mut triangle = good;
            triangle[i / 3][i % 3] = bad;
            assert_eq!(test(&r, &triangle), None, "{triangle:?}");
        }
    }
    for (t_min, t_max) in [(f32::NAN, 2.0), (0.0, f32::NAN), (1.5, 2.0), (0.0, 0.5)] {
        assert_eq!(test(&Ray { t_min, t_max, ..r }, &good), None);
    }
    assert!(
        test(
            &Ray {
                t_min: 1.0,
                t_max: 1.0,
                ..r
            },
            &good
        )
        .is_some()
    );
}

#[test]
fn edges_and_vertices_belong_to_both_sides() {
    let quad = [[Vec3::ZERO, Vec3::X, Vec3::ONE], [Vec3::ZERO, Vec3::ONE, Vec3::Y]].map(|t| t.map(|v| v.with_z(0.0)));
    let hits = |target: Vec3, direction: Vec3| {
        let r = Ray::new(target - direction, direction);
        quad.iter().filter(|t| test(&r, t).is_some()).count()
    };
    for x in [0.0, 0.125, 0.5, 1.0] {
        assert_eq!(hits(Vec3::new(x, x, 0.0), Vec3::Z), 2);
        assert_eq!(hits(Vec3::new(x, x, 0.0), -Vec3::Z), 2);
    }
    // Rounding of the direction's shear may move the ray off the diagonal, but not out of both triangles.
    for direction in [
        Vec3::new(0.3, -0.7, 0.9),
        Vec3::new(1.0, 1.0, 1e-3),
        Vec3::new(-5.0, 0.1, 0.2),
    ] {
        for x in [0.1, 0.125, 0.5, 0.77] {
            assert!(hits(Vec3::new(x, x, 0.0), direction) >= 1);
        }
    }
}

#[test]
fn a_needle_is_not_met_far_before_its_tip() {
    // Its long edges point at the ray; in plain f32 both edge values round to zero there.
    let tip = Vec3::new(100.0, 100.0, 0.0);
    let needle = [tip, Vec3::new(101.0, 101.0, 0.0), Vec3::new(101.0, 101.00001, 0.0)];
    assert_eq!(test(&Ray::new(Vec3::Z, -Vec3::Z), &needle), None);
}
