//! Walks from the lights, and the virtual lights that they leave.

use super::*;
use clerestory::techniques::instant_radiosity::VirtualLight;
use clerestory_tests::render::{camera_down, floor};
use clerestory_tests::statistics::expect_mean;

fn lights(gpu: &Gpu, scene: &Scene, settings: &VirtualLightSettings, pass: u32) -> Vec<VirtualLight> {
    renderer(gpu, scene, SIZE, settings)
        .lights(pass)
        .unwrap_or_else(|error| panic!("{error}"))
}

/// The power that lights of a number of scatterings have in all, W, in one channel.
fn power(lights: &[VirtualLight], bounce: u32, channel: usize) -> f64 {
    let of = lights.iter().filter(|light| light.bounce == bounce);
    of.map(|light| f64::from(light.power[channel])).sum()
}

#[test]
fn power_falls_by_the_albedo_with_each_bounce() {
    with_gpu(|gpu| {
        for rho in [0.5f64, 0.8] {
            let mut scene = builtin(&format!("builtin:furnace-box?rho={rho}&emission=0"));
            add_point(&mut scene, Vec3::new(0.1, 0.3, -0.2), Vec3::splat(3.0));
            let walks = 1 << 14;
            let found = lights(gpu, &scene, &VirtualLightSettings { walks, ..settings() }, 0);
            for bounce in 0..8 {
                let survivors = rho.powi(bounce as i32);
                let expected = 3.0 * survivors;
                let variance = 9.0 * survivors * (1.0 - survivors) / f64::from(walks);
                // Sums of 16,384 powers in f32 that were added in f64: each is rounded.
                expect_mean(
                    "power",
                    power(&found, bounce, 1),
                    variance.max(1e-18),
                    expected,
                    2e-6 * expected,
                );
            }
            // 1 / (1 − ρ) lights of a walk, as a geometric distribution has it.
            let mean = found.len() as f64 / f64::from(walks);
            let (expected, variance) = (1.0 / (1.0 - rho), rho / (1.0 - rho).powi(2) / f64::from(walks));
            expect_mean("lights of a walk", mean, variance, expected, 1e-3 * expected);
            for light in &found {
                let inwards = light.position.as_dvec3().dot(light.normal.as_dvec3());
                assert!(
                    (light.position.abs().max_element() - 1.0).abs() < 1e-6 && inwards < 0.0,
                    "{light:?}"
                );
            }
        }
    });
}

/// Keller's walks: of N in a grey room N ρ^k are left after k scatterings, to the last one or so, and with the same mean as by roulette everywhere.
#[test]
fn fractional_walks_survive_by_number_and_bring_the_same_power() {
    with_gpu(|gpu| {
        let mut grey = builtin("builtin:furnace-box?rho=0.5&emission=0");
        add_point(&mut grey, Vec3::new(0.1, 0.3, -0.2), Vec3::splat(3.0));
        let walks = 1 << 12;
        let of = |scene: &Scene, fractional, pass| {
            let settings = VirtualLightSettings {
                walks,
                fractional,
                ..settings()
            };
            lights(gpu, scene, &settings, pass)
        };
        let found = of(&grey, true, 0);
        for bounce in 0..8 {
            let left = found.iter().filter(|light| light.bounce == bounce).count() as f64;
            let expected = f64::from(walks) * 0.5f64.powi(bounce as i32);
            assert!((left - expected).abs() <= 1.0, "{bounce}: {left} instead of {expected}");
        }
        // By roulette some twenty more or less would be left of the second.
        let second = of(&grey, false, 0).iter().filter(|light| light.bounce == 1).count();
        assert!(second.abs_diff(1 << 11) > 1, "{second}");
        // Of walks that survive by where they are: sums over bounces and channels, in passes of their own.
        let scene = room();
        let passes =
            |fractional| -> Vec<Vec<VirtualLight>> { (0..6).map(|pass| of(&scene, fractional, pass)).collect() };
        let (even, by_roulette) = (passes(true), passes(false));
        for bounce in 1..4 {
            for channel in 0..3 {
                let sums = |passes: &[Vec<VirtualLight>]| -> Vec<f64> {
                    passes.iter().map(|lights| power(lights, bounce, channel)).collect()
                };
                let (even, by_roulette) = (sums(&even), sums(&by_roulette));
                let n = by_roulette.len() as f64;
                let mean = by_roulette.iter().sum::<f64>() / n;
                let variance = by_roulette.iter().map(|sum| (sum - mean).powi(2)).sum::<f64>() / (n * (n - 1.0));
                let what = format!("bounce {bounce}, channel {channel}");
                expect_mean_of(&what, &even, mean, variance.sqrt(), 0.0);
            }
        }
    });
}

#[test]
fn lights_are_the_same_on_every_run_and_others_in_every_pass() {
    with_gpu(|gpu| {
        let scene = room();
        let settings = VirtualLightSettings {
            walks: 500,
            ..settings()
        };
        let first = lights(gpu, &scene, &settings, 0);
        assert!(first.len() > 500);
        assert_eq!(lights(gpu, &scene, &settings, 0), first);
        assert_ne!(lights(gpu, &scene, &settings, 1), first);
        assert_ne!(
            lights(
                gpu,
                &scene,
                &VirtualLightSettings {
                    seed: 12,
                    ..settings.clone()
                },
                0
            ),
            first
        );
        // Of most bounces those with fewer are the same.
        let short = VirtualLightSettings {
            most_bounces: 3,
            ..settings
        };
        let few = lights(gpu, &scene, &short, 0);
        let of_few: Vec<_> = first.iter().filter(|light| light.bounce < 2).copied().collect();
        assert_eq!(few, of_few);
    });
}

#[test]
fn every_kind_of_light_leaves_virtual_lights() {
    with_gpu(|gpu| {
        let open = || {
            let mut scene = Scene {
                name: "floor".into(),
                ..Scene::default()
            };
            let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
            scene.place(floor("floor", grey, 1.0, 0.0));
            scene.cameras.push(camera_down(0.8, 5.0));
            scene
        };
        let mut sun = open();
        let irradiance = Vec3::new(2.0, 1.0, 0.5);
        sun.add_light(
            "sun",
            LightKind::Directional {
                direction: Vec3::NEG_Y,
                irradiance,
            },
        );
        let mut sky = open();
        sky.environment = Some(clerestory::scene::Environment::uniform(Vec3::new(1.0, 2.0, 0.5)));
        let mut spot = open();
        let intensity = Vec3::new(1.0, 0.5, 2.0);
        let (position, direction) = (Vec3::new(0.1, 2.0, 0.0), Vec3::NEG_Y);
        spot.add_light(
            "spot",
            LightKind::Spot {
                position,
                direction,
                intensity,
                inner: 0.2,
                outer: 0.2,
            },
        );
        let lamp = builtin("builtin:furnace-box?rho=0.5&emission=0.25");
        // Of a cone of half an angle of 0.2; KHR_lights_punctual's least difference of cosines, 0.001, makes its rim soft by a square, of which a third counts.
        let cone = 2.0 * PI * (1.0 - f64::from(0.2f32.cos()) - 2.0 / 3.0 * 1e-3);
        for (scene, expected, bias) in [
            (sun, [2.0, 1.0, 0.5].map(|e| 4.0 * e), 0.0),
            // Both sides of the floor.
            (sky, [1.0, 2.0, 0.5].map(|l| 8.0 * PI * l), 0.0),
            // Differences of cosines in f32, of some 0.001.
            (spot, [1.0, 0.5, 2.0].map(|i| cone * i), 1e-3),
            // Six walls of 4 m².
            (lamp, [0.25; 3].map(|l| 24.0 * PI * l), 0.0),
        ] {
            let walks = 1 << 14;
            let found = lights(gpu, &scene, &VirtualLightSettings { walks, ..settings() }, 0);
            for (channel, expected) in expected.into_iter().enumerate() {
                let sum = power(&found, 0, channel);
                let of = |light: &VirtualLight| f64::from(light.power[channel]) * f64::from(walks);
                let squares: f64 = found
                    .iter()
                    .filter(|light| light.bounce == 0)
                    .map(|light| of(light).powi(2))
                    .sum();
                let n = f64::from(walks);
                let variance = ((squares / n - sum * sum) / n).max(0.0) + 1e-12 * expected * expected;
                let what = format!("{}, {} lights, channel {channel}", scene.name, scene.lights.len());
                println!("{what}: {sum} expected {expected}");
                expect_mean(&what, sum, variance, expected, (bias + 1e-5) * expected);
            }
        }
    });
}
