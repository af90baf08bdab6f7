//! Deferred frames against closed forms: direct light, the light of one virtual light, how errors fall with their number, and what the filter takes of their noise.

use super::*;
use clerestory::raster::reflective::rsm_solid_angle;
use clerestory_tests::render::pixel_averages;
use glam::DVec2;

const FLOOR: Vec3 = Vec3::new(0.7, 0.5, 0.3);
/// Of the light above the floor, m.
const HEIGHT: f64 = 0.8;
/// Half of what is seen of the floor where all that arrives is summed, over the height of the light.
const WIDE: f64 = 10.0;

/// A floor, of which twice `half` are seen from above, m.
fn floor_alone(half: f32) -> Scene {
    let mut scene = Scene::default();
    let ground = scene.add_material(Material::lambert("ground", FLOOR));
    scene.place(floor("floor", ground, 2.0 * half, 0.0));
    scene.cameras.push(camera_down(half, 10.0));
    scene
}

/// The same with a spot whose narrow cone leaves its virtual lights at nearly one place of a ceiling, which faces the floor.
fn floor_and_ceiling(half: f32) -> Scene {
    let mut scene = floor_alone(half);
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
    scene.place(floor("ceiling", white, 1.0, HEIGHT as f32));
    let camera = orthographic(DVec3::Y * (HEIGHT - 1e-3), DVec3::ZERO, -DVec3::Z, half);
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
    scene
}

/// The power that arrives on what is seen of the floor, W, from its radiance in one channel.
fn power_that_arrives(radiance: &[f32], half: f64) -> f64 {
    let area = (2.0 * half).powi(2);
    mean(radiance, 0) * PI / f64::from(FLOOR.x) * area
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
        let mut scene = floor_alone(1.0);
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

#[test]
fn a_virtual_light_lights_a_plane_as_its_law_says() {
    with_gpu(|gpu| {
        let scene = floor_and_ceiling(1.0);
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
        // What a Lambertian patch of the power 1 brings.
        let per_power = |r2: f64| HEIGHT * HEIGHT / (PI * (HEIGHT * HEIGHT + r2).powi(2));
        assert!((per_power(0.0) * HEIGHT * HEIGHT - std::f64::consts::FRAC_1_PI).abs() < 1e-12);
        let error = worst(&found, |x, z| 0.8 * power * per_power(x * x + z * z));
        println!("{error}");
        assert!(error < 1e-3, "{error}");
    });
}

/// All that a light sends down arrives somewhere on the endless plane: 2πI of a point of the intensity I, and of a virtual light its power, 1 and not π.
#[test]
fn all_of_a_lights_power_arrives_on_the_plane() {
    const FRAMES: u32 = 256;
    with_gpu(|gpu| {
        let half = WIDE * HEIGHT;
        let settings = ManyLightSettings {
            sampler: SamplerKind::Sobol,
            ..exact()
        };
        let mut scene = floor_alone(half as f32);
        add_point(&mut scene, Vec3::Y * HEIGHT as f32, Vec3::splat(4.0 * PI as f32));
        let found = picture(gpu, &scene, SIZE, &of(UP_TO_ONCE, settings.clone()), FRAMES);
        // What the picture does not show is the rest of the half space.
        let beyond = 2.0 * PI - rsm_solid_angle(DVec2::splat(-WIDE), DVec2::splat(WIDE));
        let sum = power_that_arrives(&found, half) + beyond;
        println!("a point: {sum} W, of which {beyond} beyond the picture");
        assert!((sum / (2.0 * PI) - 1.0).abs() < 1e-3, "{sum}");

        let settings = ManyLightSettings {
            lights: 16,
            interleave: 1,
            ..settings
        };
        let mut renderer = frames(gpu, &floor_and_ceiling(half as f32), SIZE, &of(INDIRECT, settings));
        let (mut found, mut power) = (Vec::new(), 0.0);
        for frame in 1..=FRAMES {
            [found, _] = advance(&mut renderer, frame);
            let lights = renderer.lights().expect("lights");
            let sum: f64 = lights.iter().map(|light| f64::from(light.power.x)).sum();
            power += 0.8 * sum / f64::from(FRAMES);
        }
        // The share of a patch's power that comes to the square beneath it, in four quarters of which each has a corner there.
        let slope = WIDE / WIDE.hypot(1.0);
        let seen = 4.0 * (slope * slope.atan()) / PI;
        let sum = power_that_arrives(&found, half) / power + 1.0 - seen;
        println!("a virtual light: {sum} of its power, {} beyond the picture", 1.0 - seen);
        assert!((sum - 1.0).abs() < 2e-3, "{sum}");
    });
}

/// With the root of independent walks, and faster with those of Sobol' points.
#[test]
fn errors_fall_with_the_root_of_the_lights() {
    const SEEDS: u32 = 32;
    const LIGHTS: [u32; 5] = [64, 256, 1024, 4096, 16_384];
    with_gpu(|gpu| {
        let mut scene = hall();
        // So small a part that light hardly changes over it: pixels of a frame share their place in them, which no number of lights makes up for.
        scene.cameras[0] = orthographic(DVec3::Y * 1.9, DVec3::ZERO, -DVec3::Z, 2e-4);
        let reference = render(gpu, &scene, SIZE, 16_384, &paths(INDIRECT));
        let expected = mean(&reference.radiance, 0);
        // All pixels of a frame have the same lights: few are as good as many.
        let error = |lights, sampler| {
            let settings = ManyLightSettings {
                lights,
                interleave: 1,
                sampler,
                ..of(INDIRECT, exact())
            };
            let mut renderer = frames(gpu, &scene, [2; 2], &settings);
            let found = (0..SEEDS).map(|seed| {
                renderer.restart(seed).expect("a seed");
                mean(&advance(&mut renderer, 1)[0], 0) / expected
            });
            let found: Vec<f64> = found.collect();
            // About their own mean: the reference's error is larger than that of the most lights.
            let mean = found.iter().sum::<f64>() / f64::from(SEEDS);
            let squares = found.iter().map(|value| (value - mean).powi(2));
            let error = (squares.sum::<f64>() / f64::from(SEEDS - 1)).sqrt();
            assert!(
                (mean - 1.0).abs() < 4.0 * error / f64::from(SEEDS).sqrt() + 0.01,
                "{lights}: {mean}"
            );
            error
        };
        // The slope of the line through all of them in the logarithms, whose abscissas are two octaves apart.
        let steps = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|step| 2.0 * step);
        let squares: f64 = steps.iter().map(|step| step * step).sum();
        // A root mean square of n errors is off by 1/√(2n) of itself.
        let deviation = std::f64::consts::LOG2_E / (f64::from(2 * SEEDS) * squares).sqrt();
        let [independent, even] = [SamplerKind::Pcg, SamplerKind::Sobol].map(|sampler| {
            let errors = LIGHTS.map(|lights| error(lights, sampler));
            let products = steps.iter().zip(&errors).map(|(step, error)| step * error.log2());
            let slope = products.sum::<f64>() / squares;
            println!("{sampler:?}: {errors:?}, slope {slope} ± {deviation}");
            assert!(
                errors.windows(2).all(|pair| pair[1] < pair[0]),
                "{sampler:?}: {errors:?}"
            );
            (errors[LIGHTS.len() - 1], slope)
        });
        assert!((independent.1 + 0.5).abs() < 3.0 * deviation, "{independent:?}");
        assert!(even.1 < -0.5 && even.0 < independent.0, "{even:?} {independent:?}");
    });
}

/// A unit square that parallel light shines on from below its edge, and 1 m beneath it another one, of which all is seen; half-way between them a black square of half the side
/// if asked for, which hides none of that light.
fn squares(is_blocked: bool) -> Scene {
    let mut scene = Scene::default();
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
    scene.place(floor("sender", white, 0.5, 1.0));
    // Larger than what is seen of it, so that the picture ends before it does.
    scene.place(floor("receiver", white, 0.6, 0.0));
    if is_blocked {
        let black = scene.add_material(Material::lambert("black", Vec3::ZERO));
        scene.place(floor("blocker", black, 0.25, 0.5));
    }
    let camera = orthographic(DVec3::Y * 0.45, DVec3::ZERO, -DVec3::Z, 0.5);
    scene.cameras.push(camera);
    scene.add_light(
        "sun",
        LightKind::Directional {
            direction: Vec3::new(2.0, 1.0, 0.0).normalize(),
            irradiance: Vec3::splat(5f32.sqrt()),
        },
    );
    scene
}

/// The form factor of the two squares by the middles of so many parts along each side, with the blocker or without.
fn form_factor(is_blocked: bool) -> f64 {
    // Odd, so that no way between two middles meets the blocker's rim.
    const PARTS: u32 = 33;
    let middles: Vec<f64> = (0..PARTS)
        .map(|i| (f64::from(i) + 0.5) / f64::from(PARTS) - 0.5)
        .collect();
    let mut sum = 0.0;
    for (a, b) in middles.iter().flat_map(|a| middles.iter().map(move |b| (a, b))) {
        for (c, d) in middles.iter().flat_map(|c| middles.iter().map(move |d| (c, d))) {
            let is_hidden = is_blocked && ((a + c) / 2.0).abs() < 0.25 && ((b + d) / 2.0).abs() < 0.25;
            if !is_hidden {
                sum += ((a - c).powi(2) + (b - d).powi(2) + 1.0).powi(-2);
            }
        }
    }
    sum / (PI * f64::from(PARTS).powi(4))
}

/// By rays what arrives is the form factor of what is seen of the other square; maps hide as much of the same lights as rays do.
#[test]
fn squares_have_their_form_factors_behind_a_blocker() {
    with_gpu(|gpu| {
        let [open, blocked] = [false, true].map(form_factor);
        assert!((open / 0.199_825 - 1.0).abs() < 5e-4, "{open}");
        // What the sender reflects is 0.8 W, and what the receiver scatters of it 0.8/π to the eye.
        let factor = |is_blocked, visibility, lights, count| {
            let settings = ManyLightSettings {
                lights,
                visibility,
                interleave: 1,
                map_side: 64,
                sampler: SamplerKind::Sobol,
                ..of(INDIRECT, exact())
            };
            let found = picture(gpu, &squares(is_blocked), SIZE, &settings, count);
            mean(&found, 0) * PI / (0.8 * 0.8)
        };
        let [all, seen] = [false, true].map(|is_blocked| factor(is_blocked, Visibility::Rays, 512, 8));
        println!("{all} of {open}, {seen} of {blocked}");
        // Of 4,096 walks a fifth come to the sender.
        assert!((all / open - 1.0).abs() < 0.02, "{all} of {open}");
        // They do so in both scenes alike.
        let (found, expected) = (seen / all, blocked / open);
        assert!((found / expected - 1.0).abs() < 0.01, "{found} instead of {expected}");
        let [by_rays, by_maps] = [Visibility::Rays, Visibility::Maps].map(|how| factor(true, how, 64, 4));
        println!("the same lights, by rays {by_rays}, by maps {by_maps}");
        assert!((by_maps / by_rays - 1.0).abs() < 0.03, "{by_maps} instead of {by_rays}");
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
