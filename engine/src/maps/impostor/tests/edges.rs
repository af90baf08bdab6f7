//! Rays and maps at their edges: points at the map's place, zero vectors, silhouettes, later roots, the sky, and bad numbers.

use glam::{DVec3, UVec2};

use super::super::{ImpostorSurface, MAX_STEPS, impostor_plane, impostor_plane_ratio};
use super::*;

const CUBE: Parametrization = Parametrization::Cube;

fn searching() -> impl Iterator<Item = SearchMethod> {
    SearchMethod::ALL
        .into_iter()
        .filter(|method| *method != SearchMethod::Classical)
}

fn settings(method: SearchMethod) -> ImpostorSettings {
    ImpostorSettings::of(method, if method == SearchMethod::March { 32 } else { 4 })
}

fn ray(origin: [f64; 3], direction: [f64; 3]) -> ImpostorRay {
    ImpostorRay {
        origin: origin.into(),
        direction: DVec3::from(direction).normalize_or_zero(),
    }
}

#[test]
fn a_ray_from_the_maps_place_looks_straight_ahead() {
    let scene = exact(BoxRoom::BOX, 1);
    for method in searching() {
        for direction in [[1.0, 0.3, -0.2], [0.0, -0.5, 1.0], [0.0, 0.0, -1.0]] {
            let ray = ray([0.0; 3], direction);
            let hit = impostor_search(&scene, &ray, &settings(method));
            let distance = (scene.distance)(0, ray.direction);
            let error = hit.direction.angle_between(ray.direction);
            // A march ends within its last interval.
            assert!(
                (hit.distance - distance).abs() < 1e-4 && error < 1e-7,
                "{method}: {hit:?}, {distance}"
            );
        }
    }
}

/// A ray through the map's place itself, where no direction is.
#[test]
fn a_ray_through_the_maps_place_goes_on() {
    let scene = exact(BoxRoom::EMPTY, 1);
    for method in searching() {
        let through = ray([-0.5, 0.0, 0.0], [1.0, 0.0, 0.0]);
        let hit = impostor_search(&scene, &through, &settings(method));
        assert!(
            hit.direction.is_finite() && hit.residual.is_finite(),
            "{method}: {hit:?}"
        );
        // The secant from x does not come back from where there is no direction.
        let is_there = (hit.distance - 1.5).abs() < 1e-3;
        assert!(is_there || method == SearchMethod::SecantFromPoint, "{method}: {hit:?}");
    }
}

/// Two objects at different places show the same: the ray's own direction.
#[test]
fn the_classical_look_up_is_the_same_everywhere() {
    let scene = exact(BoxRoom::PILLAR, 1);
    for direction in [[1.0, 0.3, -0.2], [0.0, 0.0, -1.0]] {
        let [here, there] = [[0.0; 3], [-0.6, 0.3, 0.5]]
            .map(|origin| impostor_search(&scene, &ray(origin, direction), &settings(SearchMethod::Classical)));
        assert_eq!(here, there);
        assert_eq!(here.direction, ray([0.0; 3], direction).direction);
    }
}

#[test]
fn zero_vectors_and_numbers_that_are_none_find_nothing() {
    let scene = exact(BoxRoom::EMPTY, 1);
    for method in SearchMethod::ALL {
        for bad in [
            ray([0.2, 0.0, 0.0], [0.0; 3]),
            ray([f64::NAN, 0.0, 0.0], [1.0, 0.0, 0.0]),
            ray([f64::INFINITY, 0.0, 0.0], [1.0, 0.0, 0.0]),
            ray([1e200, 0.0, 0.0], [1.0, 0.0, 0.0]),
            ray([0.0, -2e16, 0.0], [1.0, 0.0, 0.0]),
            ImpostorRay {
                origin: DVec3::ZERO,
                direction: DVec3::NAN,
            },
            ImpostorRay {
                origin: DVec3::ZERO,
                direction: 2.0 * DVec3::X,
            },
        ] {
            let hit = impostor_search(&scene, &bad, &settings(method));
            assert_eq!(
                (hit.direction, hit.distance, hit.residual),
                (DVec3::ZERO, 0.0, 1.0),
                "{method}"
            );
        }
    }
}

/// Of rays that end in what the map's place does not see, the residual warns; of those that end where it sees, it does not.
#[test]
fn silhouettes_show_in_the_residual() {
    let sphere = ShinySphere::P1;
    let scene = exact(sphere.room, 1);
    let settings = ImpostorSettings::of(SearchMethod::Hybrid, 48);
    let (mut warned, mut stuck, mut alarms, mut right) = (0, 0, 0, 0);
    for ray in sphere.rays(SIDE, None) {
        let hit = impostor_search(&scene, &ray, &settings);
        let is_warned = hit.residual > 0.05;
        if sphere.room.error(&ray, hit.direction) > 5.0 {
            stuck += 1;
            warned += u32::from(is_warned);
        } else if sphere.room.sees_hit(&ray) {
            right += 1;
            alarms += u32::from(is_warned);
        }
    }
    println!("{warned} of {stuck} that are wrong are told, {alarms} of {right} that are right");
    assert!(stuck > 1000 && f64::from(warned) > 0.6 * f64::from(stuck));
    assert!(right > 4000 && f64::from(alarms) < 0.01 * f64::from(right));
}

/// A thin plate before a wall: what is met first is the plate, and false position steps over it.
#[test]
fn a_march_finds_the_first_hit_where_brackets_find_a_later_one() {
    let plate = BoxRoom {
        obstacle: Some([DVec3::new(0.4, -0.3, -0.3), DVec3::new(0.42, 0.3, 0.3)]),
    };
    let scene = exact(plate, 1);
    let ray = ray([0.2, 0.0, 0.0], [1.0, 1.2, 0.0]);
    let (first, later) = (0.2 / ray.direction.x, 0.8 / ray.direction.x);
    assert!((plate.hit(ray.origin, ray.direction) - first).abs() < 1e-12);
    let march = impostor_search(&scene, &ray, &settings(SearchMethod::March));
    assert!(
        (march.distance - first).abs() < 1e-3 && march.residual < 0.01,
        "{march:?}"
    );
    for method in [SearchMethod::FalsePosition, SearchMethod::Hybrid] {
        let hit = impostor_search(&scene, &ray, &ImpostorSettings::of(method, 16));
        assert!(
            (hit.distance - later).abs() < 1e-6 && hit.residual < 1e-6,
            "{method}: {hit:?}"
        );
    }
}

/// Every texel of the nearest or the farthest, and rays as far as there are, in f32 as the device has them.
#[test]
fn all_numbers_stay_finite() {
    let least = ImpostorImage::LEAST;
    for nearest in [least, 1.0, 0.9 * ImpostorImage::NOTHING] {
        let distances: Vec<f32> = (0..24)
            .map(|i| if i % 2 == 0 { nearest } else { 2.0 * nearest })
            .collect();
        let image = ImpostorImage::new(CUBE, UVec2::splat(2), 1, distances, None).expect("an impostor");
        for method in SearchMethod::ALL {
            for origin in [[9e15, -9e15, 0.0], [1e-30, 0.0, 0.0], [0.3, 0.2, -0.1]] {
                let hit = image.search(&ray(origin, [-0.6, 0.64, 0.48]), &settings(method));
                let numbers = [hit.distance, hit.residual, hit.direction.length()];
                let is_finite = numbers.map(|x| x as f32).iter().all(|x| x.is_finite());
                assert!(is_finite, "{method}, {nearest:e}, {origin:?}: {hit:?}");
            }
        }
    }
}

/// Between the centres of coarse texels the walls are nearer than at any of them: by their planes, a march would begin behind them.
#[test]
fn a_march_begins_in_front_of_coarse_texels() {
    for side in [2, 4] {
        let image = ImpostorImage::from_fn(CUBE, UVec2::splat(side), 1, true, |d| BoxRoom::EMPTY.surfaces(d));
        let image = image.expect("an impostor");
        assert!(0.95 * image.extent()[0] > 1.0, "{:?}", image.extent());
        for origin in [[0.0; 3], [0.1, 0.0, 0.0]] {
            let hit = image.search(&ray(origin, [1.0, 0.0, 0.0]), &settings(SearchMethod::March));
            let exact = 1.0 - origin[0];
            assert!(
                (hit.distance - exact).abs() < 1e-3 && hit.residual < 1e-3,
                "{side}: {hit:?}"
            );
        }
    }
}

/// A floor under an empty sky.
fn floor(direction: DVec3) -> Vec<ImpostorSurface> {
    let below = (direction.y < -1e-3).then(|| ImpostorSurface {
        distance: -1.0 / direction.y,
        normal: DVec3::Y,
    });
    below.into_iter().collect()
}

#[test]
fn the_sky_is_seen_in_the_rays_own_direction() {
    for layers in [1, 2] {
        let under_sky = ImpostorImage::from_fn(CUBE, UVec2::splat(64), layers, true, floor).expect("an impostor");
        let empty = ImpostorImage::from_fn(CUBE, UVec2::splat(4), layers, false, |_| Vec::new()).expect("an impostor");
        assert_eq!(empty.extent(), [ImpostorImage::NOTHING, 0.0]);
        assert!(
            under_sky
                .distances()
                .iter()
                .chain(empty.distances())
                .all(|distance| distance.is_finite())
        );
        for method in searching() {
            for (image, direction) in [
                (&under_sky, [0.3, 0.8, 0.1]),
                (&under_sky, [1.0, 0.2, 0.0]),
                (&empty, [0.3, -0.8, 0.1]),
            ] {
                let ray = ray([0.3, -0.2, 0.5], direction);
                let hit = image.search(&ray, &settings(method));
                assert!(
                    hit.direction.is_finite() && hit.residual.is_finite(),
                    "{method}: {hit:?}"
                );
                // The secant from x comes back from the sky to where it began.
                if method == SearchMethod::SecantFromPoint {
                    continue;
                }
                assert_eq!(hit.direction, ray.direction, "{method}: {hit:?}");
                assert_eq!(
                    (hit.distance, hit.residual),
                    (ImpostorImage::NOTHING.into(), 0.0),
                    "{method}"
                );
            }
            let down = ray([0.3, -0.2, 0.5], [0.2, -1.0, -0.1]);
            let hit = under_sky.search(
                &down,
                &ImpostorSettings {
                    steps: 24,
                    ..settings(method)
                },
            );
            let exact = 0.8 / -down.direction.y;
            let is_rough = method == SearchMethod::Perpendicular;
            let slack = if is_rough { 0.3 } else { 2e-3 };
            assert!((hit.distance - exact).abs() < slack, "{method}: {hit:?} {exact}");
        }
    }
}

/// A look-up has the distance of one texel, never of some: without normals that very number.
#[test]
fn distances_are_never_averaged() {
    let distances: Vec<f32> = (0..6 * 8 * 8).map(|i| if i % 3 == 0 { 1.0 } else { 100.0 }).collect();
    let image = ImpostorImage::new(CUBE, UVec2::splat(8), 1, distances, None).expect("an impostor");
    let mut seen = [0; 2];
    for i in 0..500 {
        let t = f64::from(i) * 0.37;
        let distance = image.distance(0, DVec3::new(t.sin(), (1.3 * t).cos(), (2.1 * t).sin()));
        assert!(distance == 1.0 || distance == 100.0, "{distance}");
        seen[usize::from(distance > 1.0)] += 1;
    }
    assert!(seen.iter().all(|count| *count > 100), "{seen:?}");
}

#[test]
fn planes_hold_over_a_texel_and_no_farther() {
    // A wall at x = 2, whose distance is exact in every direction of its texels.
    let wall = |d: DVec3| {
        let distance = 2.0 / d.x.abs().max(1e-9);
        vec![ImpostorSurface {
            distance: distance.min(1e3),
            normal: DVec3::X,
        }]
    };
    let image = ImpostorImage::from_fn(CUBE, UVec2::splat(16), 1, true, wall).expect("an impostor");
    for direction in [[1.0, 0.03, 0.2], [1.0, -0.9, 0.4], [-1.0, 0.5, 0.77]] {
        let d = DVec3::from(direction).normalize();
        let off = image.distance(0, d) * d.x.abs() - 2.0;
        assert!(off.abs() < 1e-4, "{off}");
    }
    let distance = |n: [f64; 3], l: [f64; 3]| {
        let plane = impostor_plane(1.0, n.into(), DVec3::X);
        1.0 / impostor_plane_ratio(plane, l.into(), 1.0)
    };
    // In directions along the plane, and of one that is seen from aside at the texel's centre.
    assert_eq!(distance([1.0, 0.0, 0.0], [1e-6, 1.0, 0.0]), 2.0);
    assert_eq!(distance([1e-6, 1.0, 0.0], [0.0, 1.0, 0.0]), 0.5);
    // Where there is no plane that way, or none at all.
    assert_eq!(distance([1.0, 0.0, 0.0], [-0.1, 1.0, 0.0]), 1.0);
    assert_eq!(distance([0.0, 1.0, 0.0], [0.6, 0.8, 0.0]), 1.0);
    // A normal's length and side are nothing to it.
    for by in [-3.0, 0.5] {
        let (long, unit) = ([0.8 * by, 0.6 * by, 0.0], [0.8, 0.6, 0.0]);
        let off = distance(long, [0.8, 0.6, 0.0]) - distance(unit, [0.8, 0.6, 0.0]);
        assert!(off.abs() < 1e-15, "{off}");
    }
}

/// What a device has in f32 is what the host has: by planes and by distances alone, where there is a surface and where there is none.
#[test]
fn texels_on_the_device_are_those_of_the_host() {
    let size = UVec2::splat(16);
    let plates = |d: DVec3| {
        let below = ImpostorSurface {
            distance: 3.0 / d.y.abs().max(1e-9),
            normal: DVec3::Y,
        };
        if d.y > 0.3 { Vec::new() } else { vec![below] }
    };
    let image = ImpostorImage::from_fn(CUBE, size, 2, true, plates).expect("an impostor");
    let (inverses, planes) = (image.inverses(), image.planes().expect("normals"));
    assert_eq!((inverses.len(), planes.len()), (2 * 6 * 16 * 16, 2 * 6 * 16 * 16));
    let mut nothing = 0;
    for (i, texel) in CUBE.texels(size).enumerate() {
        let centre = CUBE.texel_direction(size, texel).expect("a direction");
        // Beside the centre, within the texel.
        let l = 2.0 * (centre + DVec3::new(0.01, -0.005, 0.007));
        for layer in [0, 1] {
            let at = i + layer as usize * 6 * 16 * 16;
            let plane = glam::Vec4::from_array(planes[at]).as_dvec4();
            assert_eq!(plane.w as f32, inverses[at]);
            let is_nothing = image.distances()[at] >= ImpostorImage::NOTHING;
            nothing += u32::from(is_nothing);
            if is_nothing {
                let none = crate::gpu::shaders::constants::IMPOSTOR_NOTHING_INVERSE;
                assert_eq!(planes[at], [0.0, 0.0, 0.0, none]);
                assert!((f64::from(none) * f64::from(ImpostorImage::NOTHING) - 1.0).abs() < 1e-7);
                continue;
            }
            let expected = l.length() / image.distance(layer, l);
            let found = impostor_plane_ratio(plane, l, l.length());
            assert!(
                (found - expected).abs() < 1e-5 * expected,
                "{texel:?}: {found} {expected}"
            );
        }
    }
    assert!((6 * 16 * 16..2 * 6 * 16 * 16).contains(&nothing), "{nothing}");
    let bare = ImpostorImage::from_fn(CUBE, size, 1, false, plates).expect("an impostor");
    assert!(bare.planes().is_none() && bare.inverses() == inverses[..6 * 16 * 16]);
}

/// Errors name what is wrong.
#[test]
fn bad_maps_and_settings_are_refused_by_name() {
    let size = UVec2::splat(2);
    let good = vec![1.0f32; 24];
    let texel = |i: usize, value: f32| {
        let mut distances = good.clone();
        distances[i] = value;
        distances
    };
    let refused = |map, size, layers, distances: Vec<f32>, normals: Option<&[DVec3]>, words: &str| {
        let error = ImpostorImage::new(map, size, layers, distances, normals).expect_err(words);
        assert!(error.to_string().contains(words), "{error}");
    };
    refused(Parametrization::Sphere, size, 1, vec![1.0; 4], None, "no impostors");
    refused(CUBE, UVec2::new(2, 3), 1, vec![1.0; 36], None, "not square");
    refused(CUBE, UVec2::ZERO, 1, Vec::new(), None, "no texels");
    refused(CUBE, size, 0, Vec::new(), None, "impostor layers");
    refused(CUBE, size, 9, vec![1.0; 9 * 24], None, "impostor layers");
    refused(CUBE, size, 1, vec![1.0; 23], None, "impostor distances");
    refused(CUBE, size, 1, good.clone(), Some(&[DVec3::X; 23]), "impostor normals");
    for value in [0.0, -1.0, 1e-17, f32::NAN, f32::INFINITY] {
        refused(CUBE, size, 1, texel(5, value), None, "distance of texel 5");
    }
    let falling = texel(3, 2.0).into_iter().chain(good.clone()).collect();
    refused(CUBE, size, 2, falling, None, "texel 27");
    let mut normals = [DVec3::X; 24];
    normals[7] = DVec3::ZERO;
    refused(CUBE, size, 1, good.clone(), Some(&normals), "normal of texel 7");

    let wrong = |settings: ImpostorSettings, layers: u32, words: &str| {
        let error = settings.check(layers).expect_err(words);
        assert!(error.to_string().contains(words), "{error}");
    };
    let default = ImpostorSettings::default();
    assert!(default.check(8).is_ok());
    wrong(
        ImpostorSettings {
            steps: MAX_STEPS + 1,
            ..default
        },
        1,
        "impostor steps",
    );
    wrong(ImpostorSettings::of(SearchMethod::March, 0), 1, "impostor steps");
    wrong(
        ImpostorSettings {
            bisections: 25,
            ..default
        },
        1,
        "impostor bisections",
    );
    for tolerance in [0.0, 1.0, -0.1, f32::NAN] {
        wrong(ImpostorSettings { tolerance, ..default }, 1, "impostor tolerance");
    }
    let longest = ImpostorSettings {
        bisections: 24,
        ..ImpostorSettings::of(SearchMethod::March, MAX_STEPS)
    };
    assert!(longest.check(1).is_ok());
    wrong(longest, 8, "turns of its loops");
}
