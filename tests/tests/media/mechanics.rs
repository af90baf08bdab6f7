//! How media are carried: determinism, counters, passes, and what must stay finite.

use std::collections::BTreeMap;

use clerestory::scene::Environment;
use clerestory_tests::render::{builtin, finish, independent, tracer};
use clerestory_tests::with_gpu;

use super::*;

/// The Cornell box with a cloud of smoke, a box of fog and glass with a medium inside, in a thin surrounding medium, and a point light.
fn everything() -> Scene {
    let mut scene = builtin("builtin:cornell-box");
    scene.media.push(medium(0.2, 0.8, Phase::HenyeyGreenstein { g: 0.6 }));
    scene.surrounding = Some(0);
    let [low, high] = [Vec3::new(0.05, 0.2, 0.1), Vec3::new(0.27, 0.5, 0.4)];
    let smoke =
        DensityGrid::from_fn([12, 12, 12], |p| (3.0 * p.x * p.y) as f32).in_box(low.as_dvec3(), high.as_dvec3());
    let colored = Medium {
        sigma_a: Vec3::new(0.5, 1.0, 2.0),
        sigma_s: Vec3::new(12.0, 8.0, 4.0),
        emission: Vec3::new(1.0, 0.5, 0.0),
        density: Some(smoke),
        ..Medium::default()
    };
    add_box(&mut scene, colored, low, high);
    let [low, high] = [Vec3::new(0.3, 0.35, 0.1), Vec3::new(0.5, 0.5, 0.4)];
    add_box(&mut scene, medium(8.0, 0.9, Phase::Isotropic), low, high);
    scene.media.push(medium(20.0, 0.95, Phase::Rayleigh));
    let mut glass = Material::glass("glass", 1.4);
    glass.interior = Some(scene.media.len() as u32 - 1);
    let glass = scene.add_material(glass);
    // In the box of fog.
    let [low, high] = [Vec3::new(0.35, 0.4, 0.15), Vec3::new(0.45, 0.47, 0.3)];
    scene.place(cuboid("glass", glass, low, high));
    add_point(&mut scene, Vec3::new(0.29, 0.3, 0.2));
    scene
}

#[test]
fn how_the_work_is_cut_up_never_shows() {
    with_gpu(|gpu| {
        let scene = everything();
        let truth = render(gpu, &scene, [24, 16], 8, &PathTracerSettings::default());
        assert!(truth.mean()[0].0 > 0.0);
        println!("{:?}", truth.counters);
        for (paths_in_flight, ray_quota, submission_work, full_waves) in [
            (0, 32_768, 0, false),
            (64, 32_768, 0, true),
            (1000, 128, 0, true),
            (0, 32_768, 4096, true),
            (1000, 128, 4096, true),
            (1000, 128, 4096, false),
        ] {
            let what = format!("{paths_in_flight} {ray_quota} {submission_work} {full_waves}");
            let settings = PathTracerSettings {
                paths_in_flight,
                ray_quota,
                submission_work,
                full_waves,
                ..PathTracerSettings::default()
            };
            let picture = render(gpu, &scene, [24, 16], 8, &settings);
            assert_eq!(picture.bits(), truth.bits(), "{what}");
            assert_eq!(
                picture.counters.postponed > 0,
                submission_work > 0,
                "{what}: {:?}",
                picture.counters
            );
            let (mut a, mut b) = (picture.counters, truth.counters);
            for counters in [&mut a, &mut b] {
                (counters.waves, counters.stalls, counters.postponed) = (0, 0, 0);
                (counters.submissions, counters.work) = (0, 0);
            }
            assert_eq!(a, b, "{what}");
        }
    });
}

#[test]
fn parts_of_everything_sum_to_the_whole() {
    with_gpu(|gpu| {
        let scene = everything();
        let settings = |set: &str, seed| PathTracerSettings {
            seed,
            ..clerestory_tests::render::paths(set)
        };
        let all = render(gpu, &scene, [16, 16], 128, &settings("all", 1));
        let mut sum = vec![0.0f32; all.radiance.len()];
        let mut variance = sum.clone();
        for (i, set) in ["emitted", "bounces=1", "bounces=2", "bounces=3.."]
            .into_iter()
            .enumerate()
        {
            let part = render(gpu, &scene, [16, 16], 128, &settings(set, 2 + i as u32));
            for (s, p) in sum.iter_mut().zip(&part.radiance) {
                *s += p;
            }
            for (s, p) in variance.iter_mut().zip(&part.variance) {
                *s += p;
            }
        }
        all.expect_same_as("parts", &sum, &variance);
        let without = PathTracerSettings {
            equiangular: false,
            ..settings("all", 9)
        };
        let picture = render(gpu, &scene, [16, 16], 128, &without);
        picture.expect_same_as("without equi-angular samples", &all.radiance, &all.variance);
    });
}

#[test]
fn what_is_absent_costs_no_pass() {
    with_gpu(|gpu| {
        let passes = |scene: &Scene| {
            let mut tracer = tracer(gpu, scene, [16, 16], &independent());
            let mut names = BTreeMap::new();
            while let Some(step) = tracer.step(8).unwrap() {
                for pass in step.timings.iter().flat_map(|t| &t.passes) {
                    *names.entry(pass.name.to_string()).or_insert(0) += 1;
                }
            }
            (names, tracer.counters())
        };
        let (plain, counters) = passes(&builtin("builtin:cornell-box"));
        assert!(!plain.contains_key("path: medium"));
        assert_eq!((counters.medium_collisions, counters.density_lookups), (0, 0));
        let (media, counters) = passes(&everything());
        assert_eq!(media["path: medium"], media["path: extend"]);
        assert!(counters.medium_collisions > 0 && counters.null_collisions > 0);
        assert!(counters.density_lookups > counters.null_collisions);
    });
}

#[test]
fn extremes_stay_finite() {
    with_gpu(|gpu| {
        for sigma_t in [0.0, 1e-4, 1.0, 1e4] {
            for phase in [
                Phase::HenyeyGreenstein { g: 0.99 },
                Phase::HenyeyGreenstein { g: -0.99 },
            ] {
                for grid in [false, true] {
                    let mut fog = medium(sigma_t, 0.9, phase);
                    fog.sigma_a.y *= 100.0;
                    fog.sigma_s.z = 0.0;
                    let [low, high] = [Vec3::splat(-0.5), Vec3::splat(0.5)];
                    fog.density = grid.then(|| layers(9, low, high, |y| if y < 0.3 { 0.0 } else { y }));
                    let mut scene = Scene {
                        environment: Some(Environment::uniform(Vec3::ONE)),
                        ..Scene::default()
                    };
                    add_box(&mut scene, fog, low, high);
                    // A light inside, a lamp that touches the box, a mirror in it.
                    add_point(&mut scene, Vec3::ZERO);
                    let mut lamp = Material::lambert("lamp", Vec3::ZERO);
                    lamp.emission = Vec3::ONE;
                    let lamp = scene.add_material(lamp);
                    scene.place(cuboid(
                        "lamp",
                        lamp,
                        Vec3::new(-0.1, 0.5, -0.1),
                        Vec3::new(0.1, 0.6, 0.1),
                    ));
                    let mirror = scene.add_material(Material::mirror("mirror", Vec3::splat(0.9)));
                    scene.place(cuboid("mirror", mirror, Vec3::splat(0.1), Vec3::splat(0.3)));
                    for eye in [DVec3::new(0.0, 0.5, 3.0), DVec3::new(0.0, 0.2, 0.3)] {
                        scene.cameras = vec![Camera::look_at("main", eye, DVec3::new(0.0, 0.1, 0.0), DVec3::Y, 0.6)];
                        let mut tracer = tracer(gpu, &scene, [8, 8], &independent());
                        let picture = finish(&mut tracer, 8);
                        picture.expect_sound(&format!("σt {sigma_t}, {phase:?}, grid {grid}"), 8);
                    }
                }
            }
        }
    });
}
