use super::*;
use crate::accel::test_support::{Random, Sheared, U, awkward, brute_force, with_threads};
use crate::accel::{FINISHED, NO_HIT, triangle};

fn build(triangles: &[[Vec3; 3]]) -> Bvh2 {
    Bvh2::build(triangles, &Bvh2Settings::default()).expect("valid input")
}

pub(in crate::accel) fn soup(random: &mut Random, count: usize, size: f32, scale: f32, centre: Vec3) -> Vec<[Vec3; 3]> {
    let triangle = |random: &mut Random| {
        let p = random.vector();
        [0; 3].map(|_| centre + (p + random.vector() * size) * scale)
    };
    (0..count).map(|_| triangle(random)).collect()
}

/// A grid of unit quads in the plane z = 0: coplanar, boxes without extent, shared edges.
pub(in crate::accel) fn grid(n: usize) -> Vec<[Vec3; 3]> {
    let point = |i: usize, j: usize| Vec3::new(i as f32, j as f32, 0.0);
    let cell = |i, j| {
        let corners = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
        [
            [corners[0], corners[1], corners[2]],
            [corners[0], corners[2], corners[3]],
        ]
    };
    (0..n * n).flat_map(|k| cell(k % n, k / n)).collect()
}

/// A tessellated sphere with shared vertices.
fn sphere(stacks: usize, slices: usize, radius: f32, centre: Vec3) -> Vec<[Vec3; 3]> {
    let point = |i: usize, j: usize| {
        let (theta, phi) = (
            std::f32::consts::PI * i as f32 / stacks as f32,
            std::f32::consts::TAU * (j % slices) as f32 / slices as f32,
        );
        // Poles exactly the same point for every slice.
        let sine = if i == 0 || i == stacks { 0.0 } else { theta.sin() };
        centre + radius * Vec3::new(sine * phi.cos(), theta.cos(), sine * phi.sin())
    };
    let mut triangles = Vec::new();
    for i in 0..stacks {
        for j in 0..slices {
            let [a, b, c, d] = [point(i, j), point(i, j + 1), point(i + 1, j + 1), point(i + 1, j)];
            if i > 0 {
                triangles.push([a, b, c]);
            }
            if i + 1 < stacks {
                triangles.push([a, c, d]);
            }
        }
    }
    triangles
}

pub(in crate::accel) fn hard_scenes() -> Vec<(&'static str, Vec<[Vec3; 3]>)> {
    let mut random = Random(7);
    let random = &mut random;
    let one = soup(random, 1, 0.5, 1.0, Vec3::ZERO);
    let mut invalid = soup(random, 200, 0.3, 1.0, Vec3::ZERO);
    for i in 0..60 {
        let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX][i % 4];
        invalid[i * 3][i % 3][(i / 3) % 3] = bad;
        let point = invalid[i * 3 + 1][0];
        invalid[i * 3 + 1][1] = point;
    }
    let slivers = soup(random, 400, 0.5, 1.0, Vec3::ZERO)
        .into_iter()
        .map(|[a, b, c]| [a, b, a + (b - a) * 0.37 + (c - a) * 1e-6])
        .collect();
    let mut duplicates: Vec<_> = one.iter().cycle().take(300).copied().collect();
    duplicates.extend(soup(random, 50, 0.5, 1.0, Vec3::ZERO));
    let spread = (0..1500)
        .map(|i| {
            let x = 1.07f32.powi(i % 300);
            let jitter = random.vector();
            [Vec3::ZERO, Vec3::X, Vec3::Y].map(|v| (v + jitter + Vec3::X) * x)
        })
        .collect();
    let mut mixed = soup(random, 200, 0.2, 1e-4, Vec3::ZERO);
    mixed.extend(soup(random, 200, 0.2, 1e5, Vec3::ZERO));
    vec![
        ("none", Vec::new()),
        ("two", soup(random, 2, 0.5, 1.0, Vec3::ZERO)),
        ("one", one),
        ("soup", soup(random, 1500, 0.15, 1.0, Vec3::ZERO)),
        ("tiny", soup(random, 500, 0.2, 1e-4, Vec3::ZERO)),
        ("large", soup(random, 500, 0.2, 1e5, Vec3::ZERO)),
        ("mixed scales", mixed),
        ("far away", soup(random, 500, 0.2, 1.0, Vec3::new(1e5, -1e5, 1e5))),
        ("grid", grid(16)),
        ("duplicates", duplicates),
        ("slivers", slivers),
        ("invalid", invalid),
        ("spread", spread),
        ("sphere", sphere(12, 24, 1.0, Vec3::ZERO)),
    ]
}

/// Rays of every awkward kind about a set of triangles.
pub(in crate::accel) fn hard_rays(random: &mut Random, triangles: &[[Vec3; 3]], count: usize) -> Vec<Ray> {
    let valid: Vec<_> = triangles
        .iter()
        .filter(|t| t.iter().all(|v| v.abs().max_element() < 1e9))
        .collect();
    let fallback = [Vec3::ZERO, Vec3::X, Vec3::Y];
    awkward::rays(random, count, |random| {
        if valid.is_empty() {
            fallback
        } else {
            *valid[random.below(valid.len())]
        }
    })
}

fn usable(triangles: &[[Vec3; 3]], bvh: &Bvh2) -> Vec<bool> {
    let mut usable = vec![false; triangles.len()];
    for i in bvh.triangles().iter().map(|t| t.index).filter(|i| *i != NO_HIT) {
        assert!(
            !std::mem::replace(&mut usable[i as usize], true),
            "triangle {i} is in two places"
        );
    }
    usable
}

pub(in crate::accel) fn same_bits(a: &Hit, b: &Hit) -> bool {
    bytemuck::bytes_of(a) == bytemuck::bytes_of(b)
}

#[test]
fn traversal_equals_trying_all_triangles_bit_for_bit() {
    let mut random = Random(11);
    for (name, triangles) in hard_scenes() {
        let bvh = build(&triangles);
        let usable = usable(&triangles, &bvh);
        let mut hits = 0;
        for ray in hard_rays(&mut random, &triangles, 1500) {
            let expected = brute_force(&triangles, |i| usable[i], &ray);
            let hit = bvh.closest_hit(&ray);
            assert!(same_bits(&hit, &expected), "{name}: {ray:?}\n{hit:?}\n{expected:?}");
            assert_eq!(bvh.any_hit(&ray), expected.is_hit(), "{name}: {ray:?}");
            hits += u32::from(expected.is_hit());
        }
        assert!(hits > 50 || triangles.is_empty(), "{name}: {hits} hits");
    }
}

#[test]
fn hits_agree_with_f64_up_to_their_stated_error() {
    let mut random = Random(12);
    for (name, triangles) in hard_scenes() {
        let bvh = build(&triangles);
        let usable = usable(&triangles, &bvh);
        for ray in hard_rays(&mut random, &triangles, 300) {
            if !ray.is_traceable() {
                continue;
            }
            let hit = bvh.closest_hit(&ray);
            let mut oracle: Option<(f64, usize)> = None;
            for (i, t) in triangles.iter().enumerate().filter(|(i, _)| usable[*i]) {
                if let Some(c) = triangle::oracles::intersect_triangle_f64(&ray, t)
                    && oracle.is_none_or(|(t, _)| c.t < t)
                {
                    oracle = Some((c.t, i));
                }
            }
            // Sheared vertices move by 10uM, weights add 6uM, t its own 18uM; a different plane distance follows through the slope.
            let bound = |s: &Sheared| 18.0 * U * s.reach / s.direction + 16.0 * 1.5 * U * s.reach * s.plane().1;
            if hit.is_hit() {
                let s = Sheared::new(&ray, &triangles[hit.triangle as usize]);
                let inside = s.depth_inside();
                let edge_on = !s.plane().1.is_finite();
                assert!(edge_on || inside >= -15.0 * U * s.reach, "{name}: {ray:?} {hit:?}");
                assert!(
                    edge_on || (s.plane().0 - f64::from(hit.t)).abs() <= bound(&s),
                    "{name}: {ray:?} {hit:?}"
                );
            }
            if let Some((t, i)) = oracle {
                let s = Sheared::new(&ray, &triangles[i]);
                let at_edge = s.depth_inside() <= 15.0 * U * s.reach;
                let at_end = t - bound(&s) <= f64::from(ray.t_min) || t + bound(&s) >= f64::from(ray.t_max);
                let found = hit.is_hit() && f64::from(hit.t) <= t + bound(&s);
                assert!(found || at_edge || at_end, "{name}: {ray:?} {hit:?} oracle {t} {i}");
            }
        }
    }
}

#[test]
fn no_ray_passes_between_the_triangles_of_a_sphere() {
    let mut random = Random(13);
    for (radius, centre) in [
        (1.0, Vec3::ZERO),
        (1e-4, Vec3::ZERO),
        (1e5, Vec3::ZERO),
        (1.0, Vec3::new(3e4, -1e5, 777.0)),
    ] {
        let triangles = sphere(24, 48, radius, centre);
        let bvh = build(&triangles);
        for i in 0..40_000 {
            let t = triangles[random.below(triangles.len())];
            let k = random.below(3);
            let s = 0.5 + 0.5 * random.signed();
            let target = if i % 2 == 0 {
                t[k]
            } else {
                t[k] + (t[(k + 1) % 3] - t[k]) * s
            };
            // Origins stay inside the tessellation.
            let origin = centre + random.vector() * radius * if i % 5 == 0 { 0.0 } else { 0.5 };
            let r = Ray::new(origin, target - origin);
            assert!(bvh.any_hit(&r), "radius {radius} at {centre}: {r:?}");
        }
    }
}

#[test]
fn tree_is_well_formed() {
    for (name, triangles) in hard_scenes() {
        for leaf_size in [1, 4, MAX_LEAF_SIZE] {
            let settings = Bvh2Settings {
                leaf_size,
                ..Bvh2Settings::default()
            };
            let bvh = Bvh2::build(&triangles, &settings).expect("valid settings");
            let statistics = bvh.statistics();
            assert!(statistics.max_depth <= MAX_DEPTH, "{name}");
            assert_eq!(
                statistics.triangles as usize,
                usable(&triangles, &bvh).iter().filter(|u| **u).count()
            );
            assert_eq!(
                statistics.triangles + statistics.excluded_range + statistics.excluded_degenerate,
                triangles.len() as u64
            );
            let mut next = 0;
            for (i, node) in bvh.nodes().iter().enumerate() {
                for side in 0..2 {
                    let (word, bounds) = (node.children[side], node.bounds[side]);
                    let (index, count) = ((word >> COUNT_BITS) as usize, word & ((1 << COUNT_BITS) - 1));
                    if count == 0 {
                        let child = bvh.nodes()[index];
                        assert_eq!(child.parent, (i as u32) << 1 | side as u32, "{name}");
                        assert_eq!(child.bounds[0].union(child.bounds[1]), bounds, "{name}");
                        continue;
                    }
                    next += count as usize;
                    assert!(count <= leaf_size);
                    let exact = bvh.triangles()[index..index + count as usize]
                        .iter()
                        .flat_map(|t| t.corners.iter())
                        .fold(Aabb::EMPTY, |b, v| b.with_point(*v));
                    assert_eq!(exact, bounds, "{name}");
                }
            }
            assert!(next == bvh.triangles().len() || triangles.is_empty(), "{name}");
        }
    }
    let invalid = hard_scenes()
        .into_iter()
        .find(|(name, _)| *name == "invalid")
        .map(|(_, t)| build(&t).statistics());
    let counts = invalid.map(|s| (s.triangles, s.excluded_range, s.excluded_degenerate));
    assert_eq!(counts, Some((80, 60, 60)));
}

#[test]
fn bytes_do_not_depend_on_the_number_of_threads() {
    let triangles = soup(&mut Random(14), 30_000, 0.02, 1.0, Vec3::ZERO);
    let built = |threads| with_threads(threads, || build(&triangles));
    let one = built(1);
    for threads in [2, 5] {
        assert!(one.texels() == built(threads).texels(), "{threads} threads");
    }
}

#[test]
fn stopped_traversals_go_on_without_loss_or_repetition() {
    let mut random = Random(15);
    for (name, triangles) in hard_scenes() {
        let bvh = build(&triangles);
        for ray in hard_rays(&mut random, &triangles, 200) {
            for start in [Traversal::closest(&ray), Traversal::any(&ray)] {
                let mut whole = start;
                let mut whole_counters = TraversalCounters::default();
                whole.run(&bvh, &ray, u64::MAX, &mut |_, _| true, &mut whole_counters);
                let mut parts = start;
                let mut parts_counters = TraversalCounters::default();
                let mut runs = 0;
                while parts.resume != FINISHED {
                    parts.run(
                        &bvh,
                        &ray,
                        u64::from(MAX_DEPTH + 1),
                        &mut |_, _| true,
                        &mut parts_counters,
                    );
                    runs += 1;
                    assert!(runs < 10_000, "{name}: no progress");
                }
                assert!(same_bits(&whole.hit, &parts.hit), "{name}: {ray:?}");
                // Fewer when the hit so far culls a sibling that the stack would have kept.
                assert!(parts_counters.triangles <= whole_counters.triangles, "{name}: {ray:?}");
            }
        }
    }
}

#[test]
fn filter_decides_which_candidates_count() {
    let mut random = Random(16);
    let triangles = soup(&mut random, 400, 0.4, 1.0, Vec3::ZERO);
    let bvh = build(&triangles);
    for ray in hard_rays(&mut random, &triangles, 1000) {
        let expected = brute_force(&triangles, |i| i % 3 == 0, &ray);
        let mut even = |triangle: u32, _: [f32; 2]| triangle.is_multiple_of(3);
        let hit = bvh.closest_hit_filtered(&ray, &mut even, &mut TraversalCounters::default());
        assert!(same_bits(&hit, &expected));
        assert_eq!(
            bvh.any_hit_filtered(&ray, &mut even, &mut TraversalCounters::default()),
            expected.is_hit()
        );
    }
}

#[test]
fn invalid_rays_and_settings_are_refused() {
    let triangles = grid(4);
    let bvh = build(&triangles);
    let good = Ray::new(Vec3::new(1.3, 1.4, 5.0), -Vec3::Z);
    assert!(bvh.any_hit(&good));
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
        for i in 0..3 {
            let mut r = good;
            r.origin[i] = bad;
            assert!(!bvh.any_hit(&r));
            r = good;
            r.direction[i] = bad;
            assert!(!bvh.any_hit(&r));
        }
    }
    for direction in [[0.0; 3], [-0.0; 3], [1e-20, 0.0, 0.0]] {
        assert!(!bvh.any_hit(&Ray { direction, ..good }));
    }
    for (t_min, t_max) in [(f32::NAN, 10.0), (0.0, f32::NAN), (6.0, 5.0)] {
        assert!(!bvh.any_hit(&Ray { t_min, t_max, ..good }));
    }
    for (leaf_size, bins) in [(0, 16), (9, 16), (4, 1), (4, 65)] {
        assert!(Bvh2::build(&triangles, &Bvh2Settings { leaf_size, bins }).is_err());
    }
}
