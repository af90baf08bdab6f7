//! Virtual lights from reflective shadow maps: their power to the count, pictures against the path tracer, and maps without light.

use super::*;
use clerestory::techniques::instant_radiosity::many_light::RsmSequence;
use glam::DAffine3;

/// Of a power of 20 W, in the middle of a closed box that reflects alike everywhere.
fn lit_box() -> Scene {
    let mut scene = builtin("builtin:furnace-box?rho=0.5&emission=0");
    add_point(&mut scene, Vec3::new(0.1, -0.2, 0.3), Vec3::splat(20.0));
    scene
}

fn rsm() -> ManyLightSettings {
    ManyLightSettings {
        placement: Placement::Rsm,
        rsm_side: 32,
        ..exact()
    }
}

fn luminance(power: Vec3) -> f64 {
    power.as_dvec3().dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// All of a light's power arrives, whatever the texels, and every virtual light has as much of it.
#[test]
fn each_light_reflects_as_much() {
    with_gpu(|gpu| {
        let scene = lit_box();
        for rsm_side in [8, 64] {
            let settings = ManyLightSettings {
                rsm_side,
                ..of(INDIRECT, rsm())
            };
            let mut renderer = frames(gpu, &scene, [4; 2], &settings);
            advance(&mut renderer, 1);
            let counts = renderer.counts();
            assert_eq!((counts.lights, counts.views, counts.walks.emitted), (64, 6, 0));
            let lights = renderer.lights().expect("lights");
            let total: f64 = lights.iter().map(|light| luminance(light.power)).sum();
            assert!((total / 20.0 - 1.0).abs() < 1e-5, "side {rsm_side}: {total} W");
            for light in &lights {
                assert!((64.0 * luminance(light.power) / total - 1.0).abs() < 1e-4, "{light:?}");
                let on_wall = light.position.abs().max_element();
                assert!((on_wall - 1.0).abs() < 1e-5 && light.bounce == 0, "{light:?}");
                assert!(light.normal.dot(light.position) < 0.0, "to the inside: {light:?}");
            }
        }
        // Twice as reflective is twice as bright: as many lights go there, and what a wall of another colour has follows its colour.
        let mut coloured = lit_box();
        coloured.materials[0] = Material::lambert("wall", Vec3::new(0.8, 0.4, 0.2));
        let settings = of(INDIRECT, rsm());
        let mut renderer = frames(gpu, &coloured, [4; 2], &settings);
        advance(&mut renderer, 1);
        let lights = renderer.lights().expect("lights");
        let sum = lights.iter().fold(Vec3::ZERO, |sum, light| sum + light.power);
        assert!(
            (sum / 20.0 - 1.0).abs().max_element() < 1e-5,
            "{sum}: power is what arrives"
        );
    });
}

/// A spot's power is that within its cone, parallel light's what the scene's outline catches.
#[test]
fn powers_of_spots_and_of_parallel_light_are_closed_forms() {
    with_gpu(|gpu| {
        let sum_of = |kind: LightKind, side| {
            let mut scene = builtin("builtin:furnace-box?rho=0.5&emission=0");
            scene.add_light("light", kind);
            let settings = ManyLightSettings {
                rsm_side: side,
                ..of(INDIRECT, rsm())
            };
            let mut renderer = frames(gpu, &scene, [4; 2], &settings);
            advance(&mut renderer, 1);
            let lights = renderer.lights().expect("lights");
            (
                lights.iter().map(|light| luminance(light.power)).sum::<f64>(),
                renderer.counts().views,
            )
        };
        let spot = |half_angle: f32| LightKind::Spot {
            position: Vec3::ZERO,
            direction: Vec3::new(0.36, 0.48, 0.8),
            intensity: Vec3::ONE,
            inner: half_angle - 0.001,
            outer: half_angle,
        };
        // 2π (1 − cos), of cones of 30°, 45° and, by faces of a cube, 60° and 80°; the falloff takes half a percent of the first.
        for (degrees, expected, views) in [(30.0f32, 0.8418, 1), (45.0, 1.8403, 1), (60.0, PI, 6), (80.0, 5.192, 6)] {
            let (sum, drawn) = sum_of(spot(degrees.to_radians()), 256);
            println!("{degrees}°: {sum} instead of {expected} by {drawn} views");
            assert!((sum / expected - 1.0).abs() < 0.01, "{degrees}: {sum}");
            assert!(drawn <= views && (drawn > 1) == (views > 1), "{drawn}");
        }
        // Along an axis a square of 2 m by 2 m.
        let (sum, views) = sum_of(
            LightKind::Directional {
                direction: Vec3::NEG_Y,
                irradiance: Vec3::splat(3.0),
            },
            256,
        );
        assert!((sum / 12.0 - 1.0).abs() < 0.01 && views == 1, "{sum}");
    });
}

#[test]
fn frames_of_reflective_maps_are_the_path_tracers() {
    with_gpu(|gpu| {
        let mut spot = hall();
        spot.lights.clear();
        spot.add_light(
            "spot",
            LightKind::Spot {
                position: Vec3::new(0.2, 0.4, 0.1),
                direction: Vec3::Y,
                intensity: Vec3::splat(5.0),
                inner: 0.4,
                outer: 0.7,
            },
        );
        for (scene, lights, count) in [(hall(), 64, 48), (spot, 64, 48), (furnished(), 128, 32)] {
            let reference = render(gpu, &scene, SIZE, 2048, &paths(ALL));
            let settings = ManyLightSettings {
                lights,
                rsm_side: 64,
                rsm_sequence: RsmSequence::Random,
                emitters: 4,
                ..rsm()
            };
            let mut renderer = frames(gpu, &scene, SIZE, &settings);
            let found = passes_of(&mut renderer, SIZE, 1, count);
            // What texels err is less than that.
            found.expect_same_as(&scene.name, &reference, 0.02);
            assert_eq!(renderer.counts().lights, u64::from(count * lights));
        }
    });
}

/// Sequences change the noise alone, and even ones make far less of it, in whole frames and in the part of the lights that a tile has. Of a centimetre of the
/// slab: all pixels of a frame share one shift, and where what is seen changes within a pixel that would hide what lights do.
#[test]
fn even_sequences_have_the_same_mean_and_less_noise() {
    with_gpu(|gpu| {
        let mut scene = hall();
        // A spot of the slab's top.
        scene.cameras = vec![orthographic(DVec3::Y * 1.9, DVec3::ZERO, -DVec3::Z, 0.005)];
        // Means, the deviation of frames' means, and that of pixels.
        let of_sequence = |interleave, size: [u32; 2], rsm_sequence| {
            let settings = ManyLightSettings {
                rsm_sequence,
                lights: 256,
                interleave,
                ..of(INDIRECT, rsm())
            };
            let count = 64;
            let passes = passes_of(&mut frames(gpu, &scene, size, &settings), size, 1, count);
            let (n, means) = (f64::from(count), &passes.means[0]);
            let average = means.iter().sum::<f64>() / n;
            let squares: f64 = means.iter().map(|mean| (mean - average).powi(2)).sum();
            let pixels = n * mean(&passes.variance, 0);
            [average, (squares / (n - 1.0)).sqrt(), pixels.sqrt()]
        };
        const SEQUENCES: [RsmSequence; 3] = [RsmSequence::Random, RsmSequence::Halton, RsmSequence::Hammersley];
        // All lights at all pixels, and a sixteenth of them, 16, by tiles.
        for (interleave, size, most) in [(1, [2, 2], [0.25, 0.25]), (4, [8, 8], [0.6, 0.6])] {
            let [random, even @ ..] = SEQUENCES.map(|sequence| of_sequence(interleave, size, sequence));
            println!("{interleave}: {random:?} {even:?}");
            for ([mean, frames, pixels], most) in even.into_iter().zip(most) {
                assert!((mean / random[0] - 1.0).abs() < 0.03, "{interleave}: {mean} {random:?}");
                assert!(pixels < most * random[2], "{interleave}: {pixels} {random:?}");
                assert!(interleave > 1 || frames < most * random[1], "{frames} {random:?}");
            }
        }
    });
}

#[test]
fn black_maps_give_no_lights() {
    with_gpu(|gpu| {
        let mut black = hall();
        for material in &mut black.materials {
            material.base_color = Vec3::ZERO.extend(1.0);
        }
        let mut away = hall();
        away.lights.clear();
        away.add_light(
            "spot",
            LightKind::Spot {
                position: Vec3::new(0.0, 2.5, 0.0),
                direction: Vec3::Y,
                intensity: Vec3::ONE,
                inner: 0.1,
                outer: 0.2,
            },
        );
        let mut dark = hall();
        dark.lights.clear();
        add_point(&mut dark, Vec3::Y, Vec3::ZERO);
        for (what, scene, views) in [("black", black, 6), ("away", away, 1), ("dark", dark, 0)] {
            for visibility in [Visibility::Rays, Visibility::Imperfect] {
                let settings = ManyLightSettings { visibility, ..rsm() };
                let mut renderer = frames(gpu, &scene, [13, 7], &of(INDIRECT, settings));
                assert!(advance(&mut renderer, 2)[0].iter().all(|value| *value == 0.0), "{what}");
                let counts = renderer.counts();
                assert_eq!((counts.lights, counts.connections, counts.maps), (0, 0, 0), "{what}");
                assert_eq!(counts.views, 2 * views, "{what}");
                assert!(renderer.lights().expect("lights").is_empty());
            }
        }
        let scene = upload(gpu, &hall());
        let odd = ManyLightSettings { rsm_side: 48, ..rsm() };
        let error = ManyLight::new(gpu, scene.clone(), &hall().cameras[0], SIZE, odd).err();
        assert!(error.is_some_and(|error| error.to_string().contains("rsm_side")));
    });
}

#[test]
fn reflective_maps_are_drawn_for_no_others_and_shared_out_alike() {
    with_gpu(|gpu| {
        let scene = hall();
        let once = |settings: &ManyLightSettings| {
            let mut renderer = frames(gpu, &scene, [13, 7], settings);
            let radiance = bits(&advance(&mut renderer, 2)[0]);
            let has = |name: &str| {
                renderer
                    .pipelines()
                    .iter()
                    .any(|pipeline| pipeline.shader.contains(name))
            };
            (radiance, ["rsm_", "photon_"].map(has), renderer.counts().passes)
        };
        let (whole, kernels, passes) = once(&rsm());
        assert_eq!(kernels, [true, false]);
        // Emitters; surfaces and flux of six views; sums, lights; surfaces, split, direct light, gather, merge, film.
        assert_eq!(passes, 2 * (1 + 2 * 6 + 2 + 6));
        assert_eq!(once(&exact()).1, [false, true]);
        let parted = ManyLightSettings {
            lights_at_once: 3,
            ..rsm()
        };
        assert!(once(&parted).0 == whole);
        assert!(once(&ManyLightSettings { seed: 6, ..rsm() }).0 != whole);
    });
}

/// A body that moves: it is drawn, lit, and hides where it is now, as if made there; where rays tell, once the index is refitted.
#[test]
fn moved_bodies_are_as_if_made_there() {
    with_gpu(|gpu| {
        let mut scene = lit_box();
        let matte = scene.add_material(Material::lambert("body", Vec3::new(0.2, 0.6, 0.8)));
        scene.place(cuboid("body", matte, Vec3::splat(-0.2), Vec3::splat(0.2)));
        scene.cameras = vec![orthographic(DVec3::Y * 0.9, DVec3::ZERO, -DVec3::Z, 0.9)];
        let body = scene.instances.len() - 1;
        let to = DAffine3::from_translation(DVec3::new(0.25, -0.5, 0.125));
        let mut moved = scene.clone();
        moved.instances[body].transform = to;
        for (visibility, traces) in [
            (Visibility::Maps, false),
            (Visibility::Imperfect, false),
            (Visibility::Rays, true),
        ] {
            let base = if traces { exact() } else { of(INDIRECT, rsm()) };
            let settings = ManyLightSettings {
                visibility,
                map_side: 16,
                map_points: 256,
                ..base
            };
            let on_device = upload(gpu, &scene);
            let made = ManyLight::new(gpu, on_device.clone(), &scene.cameras[0], SIZE, settings.clone());
            let mut renderer = made.expect("frames");
            let before = bits(&advance(&mut renderer, 1)[0]);
            on_device
                .move_object(gpu, &scene, body, to)
                .expect("a place in the box");
            if traces {
                on_device.refit_index(gpu).expect("a wide index");
            }
            renderer.restart(settings.seed).expect("the same seed");
            let found = bits(&advance(&mut renderer, 1)[0]);
            let truth = bits(&picture(gpu, &moved, SIZE, &settings, 1));
            assert!(found == truth && found != before, "{visibility:?}");
        }
    });
}
