use super::*;
use crate::accel::bvh2::{Bvh2, Bvh2Settings};
use crate::accel::test_support::Random;
use crate::accel::triangle::{intersect_triangle, ray_shear};
use crate::accel::{Ray, RayIndex};

fn normal(t: &[Vec3; 3]) -> Vec3 {
    (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero()
}

fn weights(random: &mut Random) -> [f32; 2] {
    let (a, b) = (0.5 + 0.5 * random.signed(), 0.5 + 0.5 * random.signed());
    // Corners and edges are as likely as the inside.
    let [a, b] = match random.below(6) {
        0 => [0.0, 0.0],
        1 => [a, 0.0],
        2 => [a, 1.0 - a],
        _ => [a, b],
    };
    if a + b > 1.0 { [1.0 - a, 1.0 - b] } else { [a, b] }
}

fn meets(triangle: &[Vec3; 3], r: &Ray) -> bool {
    let shear = ray_shear(r.origin.into(), r.direction.into());
    intersect_triangle(&shear, triangle, r.t_min, r.t_max).is_some()
}

fn reach(point: Vec3, vertices: &[Vec3]) -> f32 {
    let (lower, upper) = vertices
        .iter()
        .fold((vertices[0], vertices[0]), |(l, u), v| (l.min(*v), u.max(*v)));
    scene_reach(point, lower, upper)
}

/// A triangle of moderate aspect, 10⁻⁴ to 10⁵ m in size, up to a thousand times its size (10⁵ m at most) from the origin.
fn random_triangle(random: &mut Random) -> ([Vec3; 3], f32) {
    loop {
        let size = random.magnitude(-13, 16);
        let away = (size * random.magnitude(-3, 10)).min(1e5);
        let centre = random.vector() * away;
        let t = [0; 3].map(|_| centre + random.vector() * size);
        let area = (t[1] - t[0]).as_dvec3().cross((t[2] - t[0]).as_dvec3()).length();
        if area > 0.05 * f64::from(size) * f64::from(size) {
            return (t, size);
        }
    }
}

/// Any direction on the normal's side; grazing to within rounding half of the time.
fn leaving(random: &mut Random, n: Vec3) -> Vec3 {
    let v = random.vector();
    let tangent = (v - n * v.dot(n)).normalize_or_zero();
    let lift = if random.below(2) == 0 {
        0.0
    } else {
        random.magnitude(-20, 1)
    };
    tangent + n * lift
}

#[test]
fn position_lies_within_its_rounding_bound() {
    let mut random = Random(21);
    for _ in 0..50_000 {
        let (t, _) = random_triangle(&mut random);
        let [u, v] = weights(&mut random);
        let point = surface_point(&t, [u, v], 0.0);
        let [a, b, c] = t.map(|v| v.as_dvec3());
        let exact = a + (b - a) * f64::from(u) + (c - a) * f64::from(v);
        let error = (point.position.as_dvec3() - exact).abs();
        assert!(error.cmple(point.error.as_dvec3()).all(), "{t:?} {u} {v}");
    }
}

#[test]
fn leaving_rays_meet_neither_their_triangle_nor_coplanar_ones() {
    let mut random = Random(22);
    for _ in 0..50_000 {
        let (t, _) = random_triangle(&mut random);
        let [u, v] = weights(&mut random);
        let n = normal(&t) * if random.below(2) == 0 { 1.0 } else { -1.0 };
        let point = surface_point(&t, [u, v], reach(surface_point(&t, [u, v], 0.0).position, &t));
        let w = leaving(&mut random, n);
        let start = offset_ray_origin(point.position, point.error, n, w);
        let side = if n.dot(w) < 0.0 { -n } else { n };
        assert!((start - point.position).dot(side) >= 0.0);
        assert!(!meets(&t, &Ray::new(start, w)), "{t:?} {u} {v} {w}");
    }
    // A small triangle beside a coplanar one ten thousand times its size.
    for _ in 0..20_000 {
        let (big, _) = random_triangle(&mut random);
        let small = [
            big[0],
            big[0] + (big[1] - big[0]) * 1e-4,
            big[0] - (big[2] - big[0]) * 1e-4,
        ];
        let n = normal(&big);
        let bary = weights(&mut random);
        let all = [big, small].concat();
        let point = surface_point(&small, bary, reach(surface_point(&small, bary, 0.0).position, &all));
        let w = leaving(&mut random, n);
        let start = offset_ray_origin(point.position, point.error, n, w);
        assert!(!meets(&big, &Ray::new(start, w)), "{big:?} {bary:?} {w}");
    }
}

#[test]
fn walls_beyond_twice_the_offset_are_not_skipped() {
    let mut random = Random(23);
    for _ in 0..50_000 {
        let (t, size) = random_triangle(&mut random);
        let n = normal(&t);
        let bary = weights(&mut random);
        let reach = reach(t[0], &t).max(reach(t[1], &t)) * 4.0;
        let point = surface_point(&t, bary, reach);
        let distance = n.abs().dot(point.error);
        let gap = 2.0 * distance + 4.0 * f32::EPSILON * t[0].abs().max_element() + size * f32::EPSILON;
        // The wall is larger than the triangle, so that slanted rays stay over it.
        let middle = (t[0] + t[1] + t[2]) / 3.0 + n * gap;
        let wall = t.map(|v| middle + (v + n * gap - middle) * 3.0);
        let v = random.vector();
        let w = n + (v - n * v.dot(n)) * 0.9;
        let start = offset_ray_origin(point.position, point.error, n, w);
        assert!(meets(&wall, &Ray::new(start, w)), "{t:?} {bary:?} {w} gap {gap}");
    }
}

#[test]
fn shadow_segments_meet_neither_end_but_what_is_between() {
    let mut random = Random(24);
    for _ in 0..50_000 {
        let (a, size) = random_triangle(&mut random);
        let n = normal(&a);
        let shift = n * size * random.magnitude(-6, 6) + random.vector() * size;
        let b = a.map(|v| v + shift + random.vector() * size * 0.1);
        let all = [a, b].concat();
        let (bary_a, bary_b) = (weights(&mut random), weights(&mut random));
        let point = |t: &[Vec3; 3], bary| surface_point(t, bary, reach(surface_point(t, bary, 0.0).position, &all));
        let (from, to) = (point(&a, bary_a), point(&b, bary_b));
        let separation = (to.position - from.position).length();
        if separation < 100.0 * (from.error + to.error).max_element() {
            continue;
        }
        let (start, direction) = shadow_segment(&from, n, &to, normal(&b));
        let segment = Ray {
            t_max: 1.0,
            ..Ray::new(start, direction)
        };
        assert!(
            !meets(&a, &segment) && !meets(&b, &segment),
            "{a:?} {b:?} {bary_a:?} {bary_b:?}"
        );
        let middle = start + direction * 0.5;
        let (x, y) = direction.normalize().any_orthonormal_pair();
        let blocker = [x * 2.0, y * 2.0 - x, -y * 2.0 - x].map(|v| middle + v * separation);
        assert!(meets(&blocker, &segment));
    }
}

#[test]
fn chords_of_a_convex_tessellation_are_free() {
    let mut random = Random(25);
    for (radius, centre) in [
        (1.0, Vec3::ZERO),
        (1e-4, Vec3::ZERO),
        (1e5, Vec3::ZERO),
        (10.0, Vec3::splat(1e3)),
    ] {
        let (stacks, slices) = (16usize, 32usize);
        let at = |i: usize, j: usize| {
            let theta = std::f32::consts::PI * (i as f32 + 2.0) / (stacks as f32 + 4.0);
            let phi = std::f32::consts::TAU * (j % slices) as f32 / slices as f32;
            centre + radius * Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
        };
        let mut triangles = Vec::new();
        for (i, j) in (0..stacks * slices).map(|k| (k / slices, k % slices)) {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        let bvh = Bvh2::build(&triangles, &Bvh2Settings::default()).expect("valid");
        let vertices = triangles.concat();
        let (lower, upper) = vertices
            .iter()
            .fold((vertices[0], vertices[0]), |(l, u), v| (l.min(*v), u.max(*v)));
        for _ in 0..20_000 {
            let mut end = || {
                let t = &triangles[random.below(triangles.len())];
                let bary = weights(&mut random);
                let position = surface_point(t, bary, 0.0).position;
                (surface_point(t, bary, scene_reach(position, lower, upper)), normal(t))
            };
            let ((from, from_normal), (to, to_normal)) = (end(), end());
            if (to.position - from.position).length() < 0.3 * radius {
                continue;
            }
            let (start, direction) = shadow_segment(&from, from_normal, &to, to_normal);
            let segment = Ray {
                t_max: 1.0,
                ..Ray::new(start, direction)
            };
            assert!(!bvh.any_hit(&segment), "radius {radius} at {centre}: {segment:?}");
        }
    }
}
