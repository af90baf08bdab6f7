//! Virtual lights that chains choose: as bright as the path tracer's picture, each as bright as every other, and where they matter.

use super::*;

fn chains() -> ManyLightSettings {
    ManyLightSettings {
        placement: Placement::Metropolis,
        interleave: 1,
        pool: 2048,
        ..exact()
    }
}

/// The same bounded power of a pool, whoever carries it: with the power measured at all pixels alike, frames of one light and of many have the same mean luminance.
#[test]
fn chosen_lights_bring_all_that_the_pool_brings() {
    with_gpu(|gpu| {
        for scene in [hall(), furnished()] {
            let brightness = |lights: u32, frame: u32| {
                let settings = ManyLightSettings {
                    lights,
                    power_pixels: 4096,
                    bound: Bound::Geometry,
                    // Of the same lights for all.
                    bound_value: 1.0,
                    ..chains()
                };
                let mutations = settings.mutations;
                let mut renderer = frames(gpu, &scene, SIZE, &of(INDIRECT, settings));
                renderer.restart(frame).expect("a seed");
                let radiance = advance(&mut renderer, 1)[0].clone();
                let counts = renderer.counts();
                assert_eq!(counts.lights, u64::from(lights));
                // Seeds; steps of chains, of four tries and three references; the pixels that measure lights.
                let at_once = lights.min(64);
                let steps = u64::from(mutations * lights.div_ceil(at_once) * at_once);
                let rays = 16_384 + 7 * steps + u64::from(lights * 4096);
                assert_eq!(counts.chain_rays, rays);
                let luminance = [0.2126, 0.7152, 0.0722];
                (0..3)
                    .map(|channel| luminance[channel] * mean(&radiance, channel))
                    .sum::<f64>()
            };
            for frame in [1, 2] {
                let [one, some, many] = [1, 7, 80].map(|lights| brightness(lights, frame));
                println!("{}: {one}, {some}, {many}", scene.name);
                assert!(many > 0.0);
                for found in [one, some] {
                    assert!((found / many - 1.0).abs() < 0.01, "{}: {found} {many}", scene.name);
                }
            }
        }
    });
}

#[test]
fn chosen_lights_are_as_bright_as_the_path_tracers() {
    with_gpu(|gpu| {
        for scene in [hall(), furnished()] {
            let reference = render(gpu, &scene, SIZE, 2048, &paths(ALL));
            let mut renderer = frames(gpu, &scene, SIZE, &chains());
            let found = passes_of(&mut renderer, SIZE, 1, 48);
            found.expect_same_as(&scene.name, &reference, 0.02);
        }
    });
}

/// Two rooms, of which one has the lamp and the other the camera, with a gap between them: few walks leave a light that the camera's room sees.
fn two_rooms() -> Scene {
    let mut scene = builtin("builtin:furnace-box?rho=0.7&emission=0");
    scene.name = "two rooms".into();
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.7)));
    let (lower, upper) = (Vec3::new(-0.05, -1.0, -1.0), Vec3::new(0.05, 1.0, 0.8));
    scene.place(cuboid("wall", white, lower, upper));
    add_point(&mut scene, Vec3::new(0.6, 0.3, -0.5), Vec3::splat(20.0));
    scene.cameras = vec![orthographic(
        DVec3::new(-0.1, 0.0, -0.3),
        DVec3::new(-1.0, 0.0, -0.3),
        DVec3::Y,
        0.6,
    )];
    scene
}

#[test]
fn chains_halve_the_error_of_as_many_walks_behind_a_wall() {
    with_gpu(|gpu| {
        let scene = two_rooms();
        let reference = render(gpu, &scene, SIZE, 16_384, &paths(INDIRECT));
        let error = |placement| {
            let settings = of(
                INDIRECT,
                ManyLightSettings {
                    placement,
                    lights: 128,
                    ..chains()
                },
            );
            let mut renderer = frames(gpu, &scene, SIZE, &settings);
            let squares = (0..12).map(|seed| {
                renderer.restart(seed).expect("a seed");
                rmse(&advance(&mut renderer, 1)[0], &reference.radiance).powi(2)
            });
            (squares.sum::<f64>() / 12.0).sqrt()
        };
        let [walks, chosen] = [Placement::Walks, Placement::Metropolis].map(error);
        println!("walks {walks}, chains {chosen}");
        assert!(chosen < 0.5 * walks, "{chosen} {walks}");
    });
}

#[test]
fn chains_are_begun_anew_and_refuse_what_they_cannot_measure() {
    with_gpu(|gpu| {
        let scene = hall();
        let mut renderer = frames(gpu, &scene, [13, 7], &chains());
        let whole = bits(&advance(&mut renderer, 2)[0]);
        renderer.restart(99).expect("another seed");
        assert!(bits(&advance(&mut renderer, 2)[0]) != whole);
        renderer.restart(exact().seed).expect("the first seed");
        assert!(bits(&advance(&mut renderer, 2)[0]) == whole);
        // Pixels without tiles, with tiles and with reservoirs take the same lights.
        let reservoirs = ManyLightSettings {
            gathering: Gathering::Reservoirs,
            ..chains()
        };
        let tiles = ManyLightSettings {
            interleave: 3,
            ..chains()
        };
        for settings in [reservoirs, tiles] {
            let found = picture(gpu, &scene, [13, 7], &settings, 2);
            assert!(mean(&found, 1) > 0.0 && found.iter().all(|value| value.is_finite()));
        }
        let names: Vec<_> = frames(gpu, &scene, [13, 7], &exact()).pipelines();
        assert!(names.iter().all(|pipeline| !pipeline.shader.contains("metropolis")));
        let many = ManyLightSettings {
            lights: 4097,
            ..chains()
        };
        let error = ManyLight::new(gpu, upload(gpu, &scene), &scene.cameras[0], SIZE, many).err();
        let text = error.map(|error| error.to_string()).unwrap_or_default();
        assert!(text.contains("lights") && text.contains("metropolis"), "{text}");
        // What no light reaches is black.
        let mut dark = two_rooms();
        let (lower, upper) = (Vec3::new(-0.05, -1.0, -1.0), Vec3::new(0.05, 1.0, 1.0));
        let white = dark.materials.len() as u32 - 1;
        dark.place(cuboid("door", white, lower, upper));
        assert!(
            picture(gpu, &dark, [8, 8], &of(INDIRECT, chains()), 1)
                .iter()
                .all(|value| *value == 0.0)
        );
    });
}
