//! Tiles that share out the lights, and the filter that averages what these bring.

use super::*;

/// A floor with a step of 1 m, under a ceiling that a spot light shines on; seen from above, so that the step's sides are not.
fn terrace() -> Scene {
    let mut scene = Scene {
        name: "terrace".into(),
        ..Scene::default()
    };
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
    scene.place(floor("floor", white, 3.0, 0.0));
    scene.place(floor("ceiling", white, 3.0, 2.2));
    scene.place(cuboid(
        "step",
        white,
        Vec3::new(-0.4, 0.0, -0.4),
        Vec3::new(0.4, 1.0, 0.4),
    ));
    scene
        .cameras
        .push(orthographic(DVec3::Y * 2.1, DVec3::ZERO, -DVec3::Z, 1.0));
    scene.add_light(
        "spot",
        LightKind::Spot {
            position: Vec3::Y * 1.9,
            direction: Vec3::Y,
            intensity: Vec3::splat(5.0),
            inner: 0.3,
            outer: 0.5,
        },
    );
    scene
}

/// In a sphere every virtual light brings the same to every point, so that pictures tell its power and nothing else.
fn sphere_of_point() -> Scene {
    let mut scene = builtin("builtin:sphere-light?rho=0.5&frequency=12");
    scene.lights.clear();
    add_point(&mut scene, Vec3::ZERO, Vec3::ONE);
    scene
}

#[test]
fn twice_the_lights_are_as_bright() {
    with_gpu(|gpu| {
        let scene = sphere_of_point();
        let brightness = |lights| {
            let settings = of(INDIRECT, ManyLightSettings { lights, ..exact() });
            mean(&picture(gpu, &scene, SIZE, &settings, 8), 1)
        };
        // ρ² Φ/(4π² R²).
        let expected = 0.25 / (4.0 * PI * PI);
        // 250 and 500 are no multiples of the 16 parts.
        let found = [250, 500, 512, 1024].map(brightness);
        println!("{found:?}, expected {expected}");
        for found in found {
            // Facets are nearer to the middle than the sphere is.
            assert!((found / expected - 1.0).abs() < 0.03, "{found} instead of {expected}");
        }
        for pair in found.windows(2) {
            assert!((pair[1] / pair[0] - 1.0).abs() < 0.005, "{pair:?}");
        }
    });
}

#[test]
fn parts_of_the_lights_bring_as_much_as_all() {
    with_gpu(|gpu| {
        let scene = sphere_of_point();
        let brightness = |lights, interleave| {
            let settings = ManyLightSettings {
                lights,
                interleave,
                ..exact()
            };
            mean(&picture(gpu, &scene, SIZE, &of(INDIRECT, settings), 16), 1)
        };
        let all = brightness(37, 1);
        // Parts of two or three lights, of one, and fewer lights than parts.
        for (lights, interleave) in [(37, 4), (37, 5), (5, 4)] {
            let found = brightness(lights, interleave);
            assert!(
                (found / all - 1.0).abs() < 0.02,
                "{lights} {interleave}: {found} instead of {all}"
            );
        }
    });
}

#[test]
fn tiles_that_have_all_lights_give_the_same_bits() {
    with_gpu(|gpu| {
        let scene = hall();
        for size in [[13, 7], [1, 1], [9, 33]] {
            let with = |interleave| {
                let settings = ManyLightSettings {
                    lights: 20,
                    interleave,
                    whole_sets: true,
                    ..exact()
                };
                bits(&picture(gpu, &scene, size, &settings, 2))
            };
            let whole = with(1);
            for interleave in [2, 3, 4, 16] {
                assert!(with(interleave) == whole, "{size:?} {interleave}");
            }
        }
        // Not so where each has its part.
        let parted = |interleave| picture(gpu, &scene, [13, 7], &ManyLightSettings { interleave, ..exact() }, 1);
        assert_ne!(bits(&parted(1)), bits(&parted(4)));
    });
}

#[test]
fn filters_average_what_lies_in_one_plane_alone() {
    with_gpu(|gpu| {
        let scene = terrace();
        let with = |filter, filter_plane, filter_normal| {
            let settings = ManyLightSettings {
                lights: 32,
                filter,
                filter_plane,
                filter_normal,
                whole_sets: true,
                ..exact()
            };
            picture(gpu, &scene, [24; 2], &of(INDIRECT, settings), 1)
        };
        let (raw, filtered) = (with(false, 0.01, 0.9), with(true, 0.01, 0.9));
        // The step is so much nearer to the ceiling that what is seen of it is brighter than all of the floor.
        let most = raw.iter().copied().fold(0.0, f32::max);
        let is_step = |value: f32| value > 0.5 * most;
        let range = |step: bool| {
            let values = raw.iter().copied().filter(|value| is_step(*value) == step);
            values.fold([f32::INFINITY, 0.0], |[low, high], value| {
                [low.min(value), high.max(value)]
            })
        };
        let (ground, step) = (range(false), range(true));
        assert!(step[0] > 1.5 * ground[1], "{ground:?} {step:?}");
        let mixes = |radiance: &[f32]| {
            let pairs = raw.iter().zip(radiance);
            let strange = pairs.filter(|(raw, value)| {
                let [low, high] = if is_step(**raw) { step } else { ground };
                **value < low * 0.999_999 || **value > high * 1.000_001
            });
            strange.count()
        };
        assert_eq!(mixes(&filtered), 0);
        assert_ne!(bits(&filtered), bits(&raw));
        // Where all planes count as one, the step and the floor are mixed, and where no normal is like another, nothing is.
        assert!(mixes(&with(true, 1.0, 0.9)) > 20);
        assert_eq!(bits(&with(true, 1.0, 1.0)), bits(&raw));
    });
}

/// Virtual lights at one place so high above a floor that each brings the same to all of it, to the bit: squares of distances across are lost in that of the height.
fn far_light() -> Scene {
    const HEIGHT: f32 = 65_536.0;
    let mut scene = Scene {
        name: "far light".into(),
        ..Scene::default()
    };
    let white = scene.add_material(Material::lambert("white", Vec3::new(0.8, 0.7, 0.3)));
    scene.place(floor("floor", white, 2.0, 0.0));
    scene.place(floor("ceiling", white, 1.0, HEIGHT));
    scene.cameras.push(camera_down(1.0, 10.0));
    scene.add_light(
        "spot",
        LightKind::Spot {
            position: Vec3::Y * (HEIGHT - 1.0),
            direction: Vec3::Y,
            intensity: Vec3::splat(1e12),
            inner: 0.009,
            outer: 0.01,
        },
    );
    scene
}

#[test]
fn filters_leave_constants_as_they_are_to_the_bit() {
    with_gpu(|gpu| {
        let scene = far_light();
        let with = |filter, whole_sets| {
            let settings = ManyLightSettings {
                lights: 20,
                visibility: Visibility::None,
                filter,
                whole_sets,
                ..exact()
            };
            bits(&picture(gpu, &scene, [13, 7], &of(INDIRECT, settings), 1))
        };
        let raw = with(false, true);
        assert!(raw.iter().all(|word| *word != 0));
        assert!(raw.chunks(3).all(|pixel| *pixel == raw[..3]), "not constant: {raw:x?}");
        assert_eq!(with(true, true), raw);
        // What is no constant it averages there.
        assert_ne!(with(true, false), with(false, false));
    });
}

/// The floor of [`terrace`] alone, its halves of two materials.
fn halves(materials: [Material; 2]) -> Scene {
    let mut scene = terrace();
    scene.name = "halves".into();
    scene.instances.pop();
    scene.instances.remove(0);
    for (material, x) in materials.into_iter().zip([-3.0, 0.0]) {
        let material = scene.add_material(material);
        let lower = Vec3::new(x, -1.0, -3.0);
        scene.place(cuboid("half", material, lower, lower + Vec3::new(3.0, 1.0, 6.0)));
    }
    scene
}

#[test]
fn filters_divide_by_all_that_a_surface_scatters() {
    const SIDE: usize = 24;
    with_gpu(|gpu| {
        // Mean of each half with a filter over that without.
        let ratios = |scene: &Scene| {
            let means = [true, false].map(|filter| {
                let settings = ManyLightSettings {
                    lights: 32,
                    filter,
                    filter_normal: 0.9,
                    whole_sets: true,
                    ..exact()
                };
                let radiance = picture(gpu, scene, [SIDE as u32; 2], &of(INDIRECT, settings), 1);
                [0, SIDE / 2].map(|first| -> f32 {
                    let columns = (0..SIDE).flat_map(|y| (first..first + SIDE / 2).map(move |x| 3 * (SIDE * y + x)));
                    columns.map(|i| radiance[i]).sum()
                })
            });
            println!("{means:?}");
            [0, 1].map(|half| (means[0][half], means[0][half] / means[1][half]))
        };
        let coated = |albedo| Material {
            specular: 1.0,
            roughness: 1.0,
            ..Material::lambert("coated", Vec3::splat(albedo))
        };
        for (_, ratio) in ratios(&halves([0.8, 0.003].map(coated))) {
            assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
        }
        let metal = |roughness| Material {
            metallic: 1.0,
            roughness,
            ..Material::lambert("metal", Vec3::new(0.9, 0.6, 0.2))
        };
        let [(_, rough), (mirror, _)] = ratios(&halves([0.6, 0.0].map(metal)));
        assert!((rough - 1.0).abs() < 0.1 && mirror == 0.0, "{rough} {mirror}");
    });
}

#[test]
fn filtered_tiles_are_nearly_what_all_lights_bring() {
    with_gpu(|gpu| {
        let mut scene = terrace();
        // The floor and the ceiling alone.
        scene.instances.pop();
        let with = |interleave, filter| {
            let settings = ManyLightSettings {
                lights: 512,
                interleave,
                filter,
                ..exact()
            };
            picture(gpu, &scene, [32; 2], &of(INDIRECT, settings), 1)
        };
        let (all, parted, filtered) = (with(1, false), with(4, false), with(4, true));
        let inside = |radiance: &[f32]| -> Vec<f32> {
            let rows = (4..28).flat_map(|y| (4..28).map(move |x| 3 * (32 * y + x)));
            rows.map(|i| radiance[i]).collect()
        };
        let (all, parted, filtered) = (inside(&all), inside(&parted), inside(&filtered));
        let level = f64::from(all.iter().sum::<f32>()) / all.len() as f64;
        let (before, after) = (rmse(&parted, &all) / level, rmse(&filtered, &all) / level);
        println!("{before:.4} without, {after:.4} with a filter");
        assert!(after < 0.01 && after < 0.3 * before, "{before} {after}");
    });
}
