//! Media that absorb and emit: exact along each ray.

use clerestory::scene::Environment;
use clerestory_tests::render::{builtin, independent};
use clerestory_tests::with_gpu;

use super::*;

/// Relative error of closed forms in f32: exponentials of arguments up to 8, and distances of some rounding units.
const EXACT: f64 = 1e-5;

pub(super) fn expect_exact(what: &str, picture: &Rendered, expected: [f64; 3]) {
    expect_within(what, picture, expected, EXACT);
}

fn expect_within(what: &str, picture: &Rendered, expected: [f64; 3], error: f64) {
    for (i, v) in picture.radiance.iter().enumerate() {
        let e = expected[i % 3];
        assert!((f64::from(*v) - e).abs() <= error * e, "{what}: {v}, expected {e}");
    }
    println!("{what}: {:?}, expected {expected:?}", &picture.radiance[..3]);
}

pub(super) fn absorber(sigma: [f32; 3]) -> Medium {
    Medium {
        sigma_a: Vec3::from(sigma),
        ..Medium::default()
    }
}

/// A uniform environment of radiance 1 and a ray along −y.
fn bright(eye: DVec3) -> Scene {
    let mut scene = Scene {
        environment: Some(Environment::uniform(Vec3::ONE)),
        ..Scene::default()
    };
    scene.cameras.push(ray_camera(eye, DVec3::NEG_Y));
    scene
}

#[test]
fn beers_law_is_exact() {
    with_gpu(|gpu| {
        let sigma = [0.0f32, 0.7, 2.5];
        let beer = |d: f64| sigma.map(|s| (-f64::from(s) * d).exp());
        let (low, high) = (Vec3::new(-1.0, -1.5, -1.0), Vec3::new(1.0, 1.5, 1.0));
        // Off the diagonals of the faces.
        let eye = DVec3::new(0.21, 5.0, 0.13);
        let mut outside = bright(eye);
        add_box(&mut outside, absorber(sigma), low, high);
        expect_exact(
            "through a box",
            &render(gpu, &outside, [4, 4], 4, &independent()),
            beer(3.0),
        );
        let mut inside = outside.clone();
        inside.cameras[0] = ray_camera(DVec3::new(0.21, 0.5, 0.13), DVec3::NEG_Y);
        expect_exact(
            "from inside",
            &render(gpu, &inside, [4, 4], 4, &independent()),
            beer(2.0),
        );
        // A box in the box, of twice the extinction, seen from outside and from inside both.
        let mut nested = outside.clone();
        add_box(
            &mut nested,
            absorber(sigma.map(|s| 2.0 * s)),
            Vec3::splat(-0.5),
            Vec3::splat(0.5),
        );
        expect_exact(
            "box in box",
            &render(gpu, &nested, [4, 4], 4, &independent()),
            beer(4.0),
        );
        nested.cameras[0] = ray_camera(DVec3::new(0.21, 0.25, 0.13), DVec3::NEG_Y);
        expect_exact(
            "from inside both",
            &render(gpu, &nested, [4, 4], 4, &independent()),
            beer(2.5),
        );
        // Two hundred boxes one behind the other.
        let mut many = bright(DVec3::new(0.21, 500.0, 0.13));
        for i in 0..200u8 {
            let y = 2.0 * f32::from(i);
            add_box(
                &mut many,
                absorber(sigma.map(|s| 0.005 * s)),
                Vec3::new(-1.0, y, -1.0),
                Vec3::new(1.0, y + 1.0, 1.0),
            );
        }
        // Four hundred distances of up to 500 m are each wrong by about two rounding units (6·10⁻⁵ m), times 0.0125 m⁻¹ at most, which
        // add up as a random walk (three deviations); two hundred exponentials are wrong by a rounding unit each.
        let picture = render(gpu, &many, [4, 4], 4, &independent());
        let error = 3.0 * 20.0 * 6e-5 * 0.0125 + 200.0 * 6e-8;
        expect_within("two hundred boxes", &picture, beer(1.0), error);
        // Inside of glass that does not refract.
        let mut glass = bright(eye);
        glass.media.push(absorber(sigma));
        let mut material = Material::glass("glass", 1.0);
        material.interior = Some(0);
        let material = glass.add_material(material);
        glass.place(cuboid("glass", material, low, high));
        expect_exact("in glass", &render(gpu, &glass, [4, 4], 4, &independent()), beer(3.0));
    });
}

#[test]
fn shadow_rays_are_attenuated_exactly() {
    with_gpu(|gpu| {
        // A lamp's light falls on a white floor through boxes: a directional one straight down, a point from 4 m.
        let sigma = [0.1f32, 0.7, 1.5];
        for (what, kind, irradiance) in [
            (
                "directional",
                LightKind::Directional {
                    direction: Vec3::NEG_Y,
                    irradiance: Vec3::splat(PI as f32),
                },
                1.0,
            ),
            (
                "point",
                LightKind::Point {
                    position: Vec3::new(0.21, 4.0, 0.13),
                    intensity: Vec3::splat(16.0 * PI as f32),
                },
                1.0,
            ),
        ] {
            let mut scene = Scene::default();
            let white = scene.add_material(Material::lambert("white", Vec3::ONE));
            scene.place(clerestory_tests::render::floor("floor", white, 5.0, 0.0));
            scene.add_light("lamp", kind);
            // Below the boxes, beside them the sight is clear.
            scene
                .cameras
                .push(ray_camera(DVec3::new(0.21, 0.4, 0.13), DVec3::NEG_Y));
            for i in 0..10u8 {
                let y = 0.5 + 0.3 * f32::from(i);
                let (low, high) = (Vec3::new(-1.0, y, -1.0), Vec3::new(1.0, y + 0.1, 1.0));
                add_box(&mut scene, absorber(sigma), low, high);
            }
            let picture = render(gpu, &scene, [4, 4], 4, &independent());
            expect_exact(what, &picture, sigma.map(|s| irradiance * (-f64::from(s)).exp()));
            // Rays that a small quota stops go on without loss.
            let stopped = PathTracerSettings {
                ray_quota: 128,
                ..independent()
            };
            assert_eq!(render(gpu, &scene, [4, 4], 4, &stopped).bits(), picture.bits());
            assert!(picture.counters.stalls > 0, "more boundaries than one dispatch passes");
        }
    });
}

#[test]
fn light_close_to_a_surface_is_attenuated_exactly() {
    with_gpu(|gpu| {
        // So dense a medium that the offset of rays' origins, 3·10⁻⁵ m here, is a good part of a free path.
        let (sigma, height, eye) = (1e4f32, 5e-4f32, 2e-4);
        let mut scene = Scene::default();
        scene.media.push(absorber([sigma, 0.5 * sigma, 0.0]));
        scene.surrounding = Some(0);
        let white = scene.add_material(Material::lambert("white", Vec3::ONE));
        scene.place(clerestory_tests::render::floor("floor", white, 2.0, 0.0));
        scene.add_light(
            "lamp",
            LightKind::Point {
                position: Vec3::new(0.21, height, 0.13),
                intensity: Vec3::splat(PI as f32 * height * height),
            },
        );
        scene
            .cameras
            .push(ray_camera(DVec3::new(0.21, eye, 0.13), DVec3::NEG_Y));
        let depth = f64::from(sigma) * (f64::from(height) + eye);
        let expected = [(-depth).exp(), (-0.5 * depth).exp(), 1.0];
        // Rays of the camera are up to 2·10⁻⁶ m apart, seen from the lamp up to 4·10⁻³: cosines and distances are wrong by the square of
        // that; heights of 10⁻⁴ m by a rounding unit of 0.2 m at worst, 10⁻⁸ m times 10⁴ m⁻¹.
        let picture = render(gpu, &scene, [4, 4], 4, &independent());
        expect_within("close to a surface", &picture, expected, 2e-4);
    });
}

/// A body of glass that absorbs, by the attenuation of its material or by a medium inside, around a box of fog, a lamp and a white surface.
fn tinted_glass(by_medium: bool, lamp_has_area: bool) -> Scene {
    let sigma = Vec3::new(0.0, 0.6, 1.5);
    let mut glass = Material::glass("glass", 1.2);
    let mut scene = Scene::default();
    if by_medium {
        scene.media.push(absorber(sigma.to_array()));
        glass.interior = Some(0);
    } else {
        glass.attenuation_color = (-sigma).map(f32::exp);
        glass.attenuation_distance = 1.0;
    }
    let glass = scene.add_material(glass);
    scene.place(cuboid("glass", glass, Vec3::splat(-2.0), Vec3::splat(2.0)));
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
    scene.place(clerestory_tests::render::floor("floor", white, 1.0, -1.5));
    let (low, high) = (Vec3::new(-0.8, -1.0, -0.8), Vec3::new(0.8, 0.5, 0.8));
    add_box(&mut scene, medium(0.8, 0.9, Phase::Isotropic), low, high);
    if lamp_has_area {
        let mut lamp = Material::lambert("lamp", Vec3::ZERO);
        lamp.emission = Vec3::ONE;
        let lamp = scene.add_material(lamp);
        let (low, high) = (Vec3::new(-0.4, 1.2, -0.4), Vec3::new(0.4, 1.4, 0.4));
        scene.place(cuboid("lamp", lamp, low, high));
    } else {
        add_point(&mut scene, Vec3::new(0.2, 1.2, 0.1));
    }
    let eye = DVec3::new(0.3, 0.2, 1.6);
    scene.cameras = vec![Camera::look_at("main", eye, DVec3::new(0.0, -0.7, 0.0), DVec3::Y, 1.0)];
    scene
}

#[test]
fn absorbing_solids_are_bodies_of_absorbing_media() {
    with_gpu(|gpu| {
        for lamp_has_area in [false, true] {
            let settings = |seed, equiangular| PathTracerSettings {
                seed,
                equiangular,
                ..independent()
            };
            let truth = render(
                gpu,
                &tinted_glass(true, lamp_has_area),
                [12, 12],
                128,
                &settings(1, true),
            );
            let scene = tinted_glass(false, lamp_has_area);
            for equiangular in [true, false] {
                let picture = render(gpu, &scene, [12, 12], 128, &settings(2, equiangular));
                let what = format!("tinted glass, area lamp {lamp_has_area}, equi-angular {equiangular}");
                picture.expect_same_as(&what, &truth.radiance, &truth.variance);
            }
        }
    });
}

#[test]
fn emission_is_integrated_exactly() {
    with_gpu(|gpu| {
        let mut scene = bright(DVec3::new(0.21, 5.0, 0.13));
        scene.environment = None;
        let sigma = [0.0f32, 0.5, 4.0];
        let glow = Medium {
            emission: Vec3::new(0.3, 0.5, 2.0),
            ..absorber(sigma)
        };
        add_box(&mut scene, glow, Vec3::splat(-1.0), Vec3::ONE);
        let expected = [0.6, 1.0 - (-1.0f64).exp(), 0.5 * (1.0 - (-8.0f64).exp())];
        expect_exact("glowing box", &render(gpu, &scene, [4, 4], 4, &independent()), expected);
        // The same from a grid, collected at tentative collisions.
        let ones = layers(4, Vec3::splat(-1.0), Vec3::ONE, |_| 1.0);
        scene.media[0].density = Some(ones);
        let picture = render(gpu, &scene, [16, 16], 256, &independent());
        picture.expect_uniform("glowing grid", expected, MEAN_ONLY);
        // And of one that neither absorbs nor scatters.
        scene.media[0].sigma_a = Vec3::ZERO;
        let picture = render(gpu, &scene, [16, 16], 256, &independent());
        picture.expect_uniform("glowing grid without extinction", [0.6, 1.0, 4.0], MEAN_ONLY);
    });
}

#[test]
fn a_medium_that_does_nothing_changes_no_expectation() {
    with_gpu(|gpu| {
        let plain = builtin("builtin:cornell-box");
        let mut boxed = plain.clone();
        add_box(&mut boxed, Medium::default(), Vec3::splat(-0.2), Vec3::splat(0.3));
        let truth = render(gpu, &plain, [16, 16], 64, &independent());
        let other = PathTracerSettings {
            seed: 8,
            ..independent()
        };
        let picture = render(gpu, &boxed, [16, 16], 64, &other);
        picture.expect_same_as("cornell box", &truth.radiance, &truth.variance);
    });
}

#[test]
fn alpha_and_media_act_together() {
    with_gpu(|gpu| {
        // A black surface that is half there, inside an absorbing box: seen against the sky, and in the way of the sun.
        let sigma = [0.0f32, 0.7, 1.5];
        let mut scene = bright(DVec3::new(0.21, 5.0, 0.13));
        let mut half = Material::lambert("half", Vec3::ZERO);
        half.alpha_mode = clerestory::scene::AlphaMode::Blend;
        half.base_color.w = 0.5;
        let half = scene.add_material(half);
        scene.place(clerestory_tests::render::floor("half", half, 0.5, 0.2));
        add_box(&mut scene, absorber(sigma), Vec3::splat(-1.0), Vec3::ONE);
        let expected = sigma.map(|s| 0.5 * (-2.0 * f64::from(s)).exp());
        let picture = render(gpu, &scene, [16, 16], 256, &independent());
        picture.expect_uniform("sky through alpha", expected, MEAN_ONLY);
        scene.environment = None;
        let (direction, irradiance) = (Vec3::NEG_Y, Vec3::splat(PI as f32));
        scene.add_light("sun", LightKind::Directional { direction, irradiance });
        let white = scene.add_material(Material::lambert("white", Vec3::ONE));
        scene.place(clerestory_tests::render::floor("floor", white, 3.0, -1.5));
        scene.cameras[0] = ray_camera(DVec3::new(0.21, -1.2, 0.13), DVec3::NEG_Y);
        let picture = render(gpu, &scene, [16, 16], 256, &independent());
        picture.expect_uniform("sun through alpha", expected, MEAN_ONLY);
    });
}
