//! Deferred frames against closed forms: direct light, the light of one virtual light, how errors fall with their number, and what the filter takes of their noise.

use super::*;
use clerestory_tests::render::pixel_averages;

const FLOOR: Vec3 = Vec3::new(0.7, 0.5, 0.3);
/// Of the light above the floor, m.
const HEIGHT: f64 = 0.8;

/// A floor, of which 2 m are seen from above.
fn floor_alone() -> Scene {
    let mut scene = Scene::default();
    let ground = scene.add_material(Material::lambert("ground", FLOOR));
    scene.place(floor("floor", ground, 2.0, 0.0));
    scene.cameras.push(camera_down(1.0, 10.0));
    scene
}

/// Relative error of a picture of the floor under that irradiance, the greatest of all values.
fn worst(radiance: &[f32], irradiance: impl Fn(f64, f64) -> f64) -> f64 {
    let expected = pixel_averages(SIDE, 1.0, irradiance);
    let mut worst = 0.0f64;
    for (pixel, expected) in radiance.chunks_exact(3).zip(expected) {
        for (value, rho) in pixel.iter().zip(FLOOR.to_array()) {
            worst = worst.max((f64::from(*value) / (f64::from(rho) * expected / PI) - 1.0).abs());
        }
    }
    worst
}

#[test]
fn points_light_a_plane_as_their_law_says() {
    with_gpu(|gpu| {
        let mut scene = floor_alone();
        // Of an intensity of 1.
        add_point(&mut scene, Vec3::Y * HEIGHT as f32, Vec3::splat(4.0 * PI as f32));
        // Places in a pixel are all that differs from frame to frame.
        let settings = ManyLightSettings {
            sampler: SamplerKind::Sobol,
            ..of(UP_TO_ONCE, exact())
        };
        let found = picture(gpu, &scene, SIZE, &settings, 1024);
        let error = worst(&found, |x, z| HEIGHT / (HEIGHT * HEIGHT + x * x + z * z).powf(1.5));
        println!("{error}");
        assert!(error < 1e-4, "{error}");
    });
}

/// A spot with a narrow cone leaves its virtual lights at nearly one place of the ceiling, which faces the floor.
#[test]
fn a_virtual_light_lights_a_plane_as_its_law_says() {
    with_gpu(|gpu| {
        let mut scene = floor_alone();
        let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
        scene.place(floor("ceiling", white, 1.0, HEIGHT as f32));
        let camera = orthographic(DVec3::Y * (HEIGHT - 1e-3), DVec3::ZERO, -DVec3::Z, 1.0);
        scene.cameras = vec![camera];
        scene.add_light(
            "spot",
            LightKind::Spot {
                position: Vec3::Y * 0.1,
                direction: Vec3::Y,
                intensity: Vec3::splat(1e4),
                inner: 0.009,
                outer: 0.01,
            },
        );
        let settings = ManyLightSettings {
            lights: 16,
            interleave: 1,
            sampler: SamplerKind::Sobol,
            ..of(INDIRECT, exact())
        };
        let mut renderer = frames(gpu, &scene, SIZE, &settings);
        let (mut found, mut power) = (Vec::new(), 0.0);
        for frame in 1..=512 {
            [found, _] = advance(&mut renderer, frame);
            for light in renderer.lights().expect("lights") {
                assert!((light.position - Vec3::Y * HEIGHT as f32).length() < 0.01, "{light:?}");
                power += f64::from(light.power.x) / 512.0;
            }
        }
        // What a Lambertian patch of the power 1 brings, all of which arrives somewhere on the endless plane.
        let per_power = |r2: f64| HEIGHT * HEIGHT / (PI * (HEIGHT * HEIGHT + r2).powi(2));
        assert!((per_power(0.0) * HEIGHT * HEIGHT - std::f64::consts::FRAC_1_PI).abs() < 1e-12);
        let error = worst(&found, |x, z| 0.8 * power * per_power(x * x + z * z));
        println!("{error}");
        assert!(error < 1e-3, "{error}");
    });
}

#[test]
fn errors_fall_with_the_root_of_the_lights() {
    with_gpu(|gpu| {
        let mut scene = hall();
        // So small a part that light hardly changes over it: pixels of a frame share their place in them, which no number of lights makes up for.
        scene.cameras[0] = orthographic(DVec3::Y * 1.9, DVec3::ZERO, -DVec3::Z, 0.05);
        let reference = render(gpu, &scene, SIZE, 16_384, &paths(INDIRECT));
        let error = |lights| {
            let settings = ManyLightSettings {
                lights,
                interleave: 1,
                ..of(INDIRECT, exact())
            };
            let mut renderer = frames(gpu, &scene, SIZE, &settings);
            let squares = (0..8).map(|seed| {
                renderer.restart(seed).expect("a seed");
                rmse(&advance(&mut renderer, 1)[0], &reference.radiance).powi(2)
            });
            (squares.sum::<f64>() / 8.0).sqrt()
        };
        let errors = [64, 256, 1024, 4096].map(error);
        let slope = (errors[3] / errors[0]).log2() / 6.0;
        println!("{errors:?}, slope {slope}");
        assert!((-0.6..=-0.4).contains(&slope), "{errors:?}");
        assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "{errors:?}");
    });
}

/// A closed box whose walls emit lights a body at its middle from all sides alike: its sides scatter what a wall emits, times their reflectance.
#[test]
fn walls_that_emit_bring_their_own_radiosity() {
    with_gpu(|gpu| {
        let mut scene = builtin("builtin:furnace-box?rho=0&emission=1");
        let reflectance = Vec3::new(0.9, 0.6, 0.3);
        let matte = scene.add_material(Material::lambert("body", reflectance));
        let (lower, upper) = (Vec3::splat(-0.25), Vec3::splat(0.25));
        scene.place(cuboid("body", matte, lower, upper));
        scene.cameras = vec![orthographic(DVec3::Y * 0.9, DVec3::ZERO, -DVec3::Z, 0.2)];
        let settings = ManyLightSettings {
            emitters: 64,
            sampler: SamplerKind::Sobol,
            ..of("bounces=1,lobes=diffuse+glossy", exact())
        };
        let found = picture(gpu, &scene, SIZE, &settings, 128);
        for (channel, rho) in reflectance.to_array().into_iter().enumerate() {
            let ratio = mean(&found, channel) / f64::from(rho);
            assert!((ratio - 1.0).abs() < 0.01, "{channel}: {ratio}");
        }
    });
}

/// Of sixteen independent parts of the lights, one each at the pixels of a window on a flat surface, the mean has a sixteenth of the variance.
#[test]
fn filters_leave_a_sixteenth_of_the_noise() {
    with_gpu(|gpu| {
        let scene = hall();
        let side = 24;
        let variance = |filter| {
            let settings = ManyLightSettings {
                lights: 64,
                filter,
                ..of(INDIRECT, exact())
            };
            let mut renderer = frames(gpu, &scene, [side; 2], &settings);
            let (count, mut sums, mut squares) = (64, vec![0.0; 32], vec![0.0; 32]);
            for seed in 0..count {
                renderer.restart(seed).expect("a seed");
                let [radiance, _] = advance(&mut renderer, 1);
                // Two rows of the floor, whose windows end before the slab and the picture do.
                for (place, (sum, square)) in sums.iter_mut().zip(&mut squares).enumerate() {
                    let pixel = (3 + place / 16) * side as usize + 4 + place % 16;
                    let value = f64::from(radiance[3 * pixel]);
                    (*sum, *square) = (*sum + value, *square + value * value);
                }
            }
            let n = f64::from(count);
            let of_pixel = |(sum, square): (&f64, &f64)| (square - sum * sum / n) / (n - 1.0);
            sums.iter().zip(&squares).map(of_pixel).sum::<f64>() / 32.0
        };
        let ratio = variance(true) / variance(false);
        println!("1/{}", 1.0 / ratio);
        assert!((1.0 / 24.0..=1.0 / 10.0).contains(&ratio), "{ratio}");
    });
}
