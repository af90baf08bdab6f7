//! Each way to make a path, alone and in full, against the path tracer's picture of the paths that it can make.

use super::*;
use clerestory::scene::{Camera, Environment};
use clerestory_tests::render::{camera_aslant, floor};

/// Of light that is scattered exactly so often.
fn alone(strategies: Strategies, bounces: u32) -> BidirectionalSettings {
    BidirectionalSettings {
        strategies,
        // Some of which meet every pixel.
        light_paths: 1024,
        least_bounces: bounces,
        most_bounces: Some(bounces),
        ..settings()
    }
}

/// Between surfaces that scatter into all directions, of a lamp with an area: every way can make every path.
#[test]
fn each_way_to_make_a_path_finds_the_same_light() {
    with_gpu(|gpu| {
        // A sphere, where no two points of the shell are nearer than others to each other but by the cosines.
        let mut lit = builtin("builtin:sphere-light?rho=0.5&frequency=12&light=area&radius=0.4");
        lit.name = "lamp".into();
        // Coated, and rough.
        lit.materials[0].specular = 1.0;
        lit.materials[0].roughness = 0.6;
        // A block on a floor, under a sky that is brighter on one side.
        let mut sky = Scene {
            name: "sky".into(),
            ..Scene::default()
        };
        let matte = sky.add_material(Material::lambert("matte", Vec3::new(0.8, 0.7, 0.6)));
        sky.place(floor("floor", matte, 1.0, 0.0));
        sky.place(cuboid(
            "block",
            matte,
            Vec3::new(-0.3, 0.001, -0.3),
            Vec3::new(0.2, 0.4, 0.1),
        ));
        sky.cameras.push(camera_aslant());
        sky.environment = Some(Environment {
            width: 2,
            height: 1,
            radiance: vec![Vec3::ONE, Vec3::splat(0.2)],
            ..Environment::uniform(Vec3::ONE)
        });
        // What the block and the floor send each other is too little to be met by chance.
        for (scene, most) in [(lit, 2), (sky, 1)] {
            for bounces in 1..=most {
                let reference = traced(gpu, &scene, &format!("bounces={bounces}..{bounces}"), 4096);
                for strategies in [
                    Strategies::Emission,
                    Strategies::LightSamples,
                    Strategies::Connections,
                    Strategies::Splats,
                ] {
                    if bounces == 1 && strategies == Strategies::Connections {
                        // A joint has two scatterings.
                        continue;
                    }
                    // Lamps are met by chance.
                    let samples = if strategies == Strategies::Emission { 2048 } else { 256 };
                    let found = passes(gpu, &scene, &alone(strategies, bounces), samples);
                    let what = format!("{}, {strategies:?}, {bounces} bounces", scene.name);
                    found.expect_same_as(&what, &reference);
                }
            }
        }
    });
}

/// Pinholes see as in all other tests.
#[test]
fn light_subpaths_meet_cameras_of_all_kinds() {
    with_gpu(|gpu| {
        let mut scene = room();
        add_point(&mut scene, Vec3::new(0.3, 0.4, -0.1), 1.0);
        let (eye, target) = (DVec3::new(0.8, 0.7, 0.85), DVec3::new(-0.4, -0.4, -0.3));
        let mut lens = Camera::look_at("lens", eye, target, DVec3::Y, 0.9);
        lens.lens_radius = 0.08;
        lens.focus_distance = 0.7;
        let parallel = clerestory_hard_cases::scenes::orthographic(eye, target, DVec3::Y, 0.8);
        for camera in [lens, parallel] {
            scene.name = camera.name.clone();
            scene.cameras = vec![camera];
            for (strategies, set) in [(Strategies::Splats, "bounces=1..2"), (Strategies::Combined, "all")] {
                let all = BidirectionalSettings {
                    strategies,
                    light_paths: 1024,
                    ..settings()
                };
                let some = BidirectionalSettings {
                    least_bounces: 1,
                    most_bounces: Some(2),
                    ..all.clone()
                };
                let settings = if strategies == Strategies::Splats { some } else { all };
                let found = passes(gpu, &scene, &settings, 256);
                let what = format!("{}, {strategies:?}", scene.name);
                found.expect_same_as(&what, &traced(gpu, &scene, set, 4096));
            }
        }
    });
}
