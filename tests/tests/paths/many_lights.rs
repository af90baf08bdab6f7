//! Choice among many lights: pictures by the tree of lights have the expectations of those by power, with less noise; few lamps have no tree.

use std::sync::Arc;

use clerestory::gpu::{Category, Gpu};
use clerestory::scene::{DensityGrid, LightKind, Medium, Scene};
use clerestory::techniques::PathTracerSettings;
use clerestory::techniques::path::LightTreeUse;
use clerestory_tests::render::{Rendered, builtin, finish, independent, paths, render, tracer, tracer_of, upload};
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec3};

const SIZE: [u32; 2] = [16, 16];

fn by(light_tree: LightTreeUse, settings: PathTracerSettings) -> PathTracerSettings {
    PathTracerSettings { light_tree, ..settings }
}

/// The Cornell box with lights of all kinds, some of which shine away from what is seen or are behind walls.
fn mixed() -> Scene {
    let mut scene = builtin("builtin:cornell-box");
    for i in 0..24u8 {
        let f = f32::from(i);
        let position = Vec3::new(
            0.05 + 0.02 * f,
            0.1 + 0.015 * (f * 7.0 % 24.0),
            -0.1 - 0.018 * (f * 11.0 % 24.0),
        );
        let kind = if i % 2 == 0 {
            LightKind::Point {
                position,
                intensity: Vec3::splat(0.002 * (1.0 + f % 5.0)),
            }
        } else {
            LightKind::Spot {
                position,
                direction: Vec3::new(f % 3.0 - 1.0, f % 4.0 - 2.0, 0.5).normalize(),
                intensity: Vec3::splat(0.02),
                inner: 0.2,
                outer: 0.2 + 0.02 * f,
            }
        };
        scene.add_light("lamp", kind);
    }
    let direction = Vec3::new(0.1, -0.3, -1.0).normalize();
    let irradiance = Vec3::splat(0.1);
    scene.add_light("sun", LightKind::Directional { direction, irradiance });
    scene
}

/// Mean variance of a pixel.
fn variance(picture: &Rendered) -> f64 {
    picture.variance.iter().map(|v| f64::from(*v)).sum::<f64>() / picture.variance.len() as f64
}

fn same_by_both(gpu: &Gpu, scene: &Scene, samples: u32, settings: &PathTracerSettings) -> [Rendered; 2] {
    let tree = render(gpu, scene, SIZE, samples, &by(LightTreeUse::On, settings.clone()));
    let other_seed = PathTracerSettings {
        seed: 91,
        ..settings.clone()
    };
    let power = render(gpu, scene, SIZE, samples, &by(LightTreeUse::Off, other_seed));
    tree.expect_same_as(&scene.source, &power.radiance, &power.variance);
    [tree, power]
}

#[test]
fn pictures_by_the_tree_are_those_by_power() {
    with_gpu(|gpu| {
        same_by_both(gpu, &mixed(), 256, &independent());
        // Emission that scattered rays meet counts in proportion to what the tree would have chosen where they come from.
        same_by_both(gpu, &builtin("builtin:sphere-light"), 128, &independent());
        same_by_both(gpu, &builtin("builtin:materials"), 64, &independent());
        // So few that power finds each of them often enough in every pixel.
        let mut panels = builtin("builtin:lamp-hall?n=4");
        panels.environment = builtin("builtin:box-city").environment;
        same_by_both(gpu, &panels, 2048, &independent());
    });
}

#[test]
fn media_are_lit_as_by_power() {
    with_gpu(|gpu| {
        let even = mixed();
        let (lower, upper) = (DVec3::new(0.0, 0.0, -0.56), DVec3::new(0.56, 0.55, 0.0));
        let waves = DensityGrid::from_fn([8, 8, 8], |p| (0.6 + 0.5 * (9.0 * p.x + 5.0 * p.y).sin()) as f32);
        for (density, equiangular) in [(None, true), (None, false), (Some(waves.in_box(lower, upper)), true)] {
            let mut fog = even.clone();
            fog.media.push(Medium {
                sigma_s: Vec3::new(1.0, 0.8, 0.5),
                sigma_a: Vec3::splat(0.2),
                density,
                ..Medium::default()
            });
            fog.surrounding = Some(fog.media.len() as u32 - 1);
            let settings = PathTracerSettings {
                equiangular,
                ..paths("bounces=0..3")
            };
            same_by_both(gpu, &fog, 256, &settings);
        }
    });
}

#[test]
fn one_lamp_among_many_is_found() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:lamp-hall?n=400");
        let [tree, power] = [LightTreeUse::Auto, LightTreeUse::Off]
            .map(|choice| render(gpu, &scene, SIZE, 64, &by(choice, paths("direct"))));
        assert!(
            variance(&tree) < 0.1 * variance(&power),
            "{} of {}",
            variance(&tree),
            variance(&power)
        );
    });
}

#[test]
fn few_lamps_have_no_tree() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:lamp-hall?n=8");
        let uploaded = upload(gpu, &scene);
        assert_eq!(uploaded.near_light_count(), 16);
        let bytes = || [Category::Light, Category::Work].map(|category| gpu.memory_report().of(category));
        let mut of = Vec::new();
        for choice in [LightTreeUse::Auto, LightTreeUse::Off, LightTreeUse::On] {
            let before = bytes();
            let mut tracer = tracer_of(gpu, &uploaded, &scene.cameras[0], SIZE, &by(choice, independent()));
            let after = bytes();
            let specialized = tracer.pipelines().iter().any(|pipeline| {
                let mut constants = pipeline.specialization.iter();
                constants.any(|(name, bits)| *name == "has_light_tree" && *bits != 0)
            });
            let bits = finish(&mut tracer, 2).bits();
            of.push(([0, 1].map(|i| after[i] - before[i]), specialized, bits));
        }
        assert_eq!(of[0], of[1]);
        assert_eq!((of[0].0[0], of[0].1), (0, false));
        let (on, off) = (&of[2], &of[1]);
        assert!(on.0[0] > 0 && on.0[1] > off.0[1] && on.1 && on.2 != off.2);
        // More of them have one, and the same bits again.
        let many = builtin("builtin:lamp-hall?n=9");
        let pictures = [LightTreeUse::Auto, LightTreeUse::On, LightTreeUse::On]
            .map(|choice| finish(&mut tracer(gpu, &many, SIZE, &by(choice, independent())), 2).bits());
        assert!(pictures[0] == pictures[1] && pictures[1] == pictures[2]);
    });
}

#[test]
fn trees_follow_lights_that_move() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:lamp-hall?n=20&source=spot");
        let settings = by(LightTreeUse::Auto, independent());
        let moving = upload(gpu, &scene);
        let mut tracer = tracer_of(gpu, &moving, &scene.cameras[0], SIZE, &settings);
        let before = finish(&mut tracer, 2).bits();
        let mut after = scene.clone();
        for (i, light) in after.lights.iter_mut().enumerate() {
            if let LightKind::Spot {
                position, direction, ..
            } = &mut light.kind
            {
                *position += Vec3::new(0.3, -0.1, 0.2);
                *direction = Vec3::new(0.2, -1.0, 0.1).normalize();
            }
            moving.move_light(gpu, i, &light.kind).unwrap();
        }
        tracer.restart(settings.seed).unwrap();
        let moved = finish(&mut tracer, 2).bits();
        let made_so = Arc::clone(&upload(gpu, &after));
        let expected = finish(&mut tracer_of(gpu, &made_so, &after.cameras[0], SIZE, &settings), 2).bits();
        assert!(moved == expected, "not as if made so");
        assert!(moved != before, "nothing has moved");
    });
}
