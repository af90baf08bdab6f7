//! Slabs under a beam: reflectance, transmittance and radiance along the normal.
//!
//! Values for isotropic scattering: integral equation of the slab (Chandrasekhar, "Radiative Transfer", 1960; van de Hulst, "Multiple Light
//! Scattering", 1980); for Henyey and Greenstein's function van de Hulst's, to four digits, besides walks in f64 here.

use clerestory::transport::phase::{henyey_greenstein_sample, phase_direction};
use clerestory_tests::random::Random;
use clerestory_tests::render::independent;
use clerestory_tests::with_gpu;

use super::*;

/// Half the side of slabs of thickness 1 and more: what leaves through their sides is below all noise.
const HALF: f32 = 40.0;

/// A slab between y = 0 and y = `thickness` under a beam of irradiance 1 from above.
fn slab(thickness: f32, medium: Medium) -> Scene {
    let mut scene = Scene::default();
    add_box(
        &mut scene,
        medium,
        Vec3::new(-HALF, 0.0, -HALF) * thickness.max(1e-3),
        Vec3::new(HALF, 1.0, HALF) * thickness.max(1e-3),
    );
    let irradiance = Vec3::ONE;
    let direction = Vec3::NEG_Y;
    scene.add_light("beam", LightKind::Directional { direction, irradiance });
    scene
}

/// Radiance along the normal from above and from below.
fn along_normal(gpu: &Gpu, scene: &Scene, samples: u32, settings: &PathTracerSettings, top: f64) -> [Rendered; 2] {
    [DVec3::NEG_Y, DVec3::Y].map(|forward| {
        let mut scene = scene.clone();
        let height = if forward.y < 0.0 { 2.0 * top } else { -top };
        scene.cameras = vec![ray_camera(
            DVec3::new(0.21, height, 0.13) * DVec3::new(top, 1.0, top),
            forward,
        )];
        let settings = PathTracerSettings {
            seed: seed_of(&scene),
            ..settings.clone()
        };
        render(gpu, &scene, [16, 16], samples, &settings)
    })
}

#[test]
fn radiance_along_the_normal_is_that_of_the_tables() {
    with_gpu(|gpu| {
        for (thickness, albedo, lit, far) in [
            (0.5, 0.5, 0.016108, 0.015553),
            (1.0, 1.0, 0.085749, 0.078473),
            (2.0, 0.9, 0.100411, 0.072819),
            (4.0, 0.9, 0.119525, 0.043815),
        ] {
            let scene = slab(thickness, medium(1.0, albedo, Phase::Isotropic));
            let pictures = along_normal(gpu, &scene, 256, &independent(), thickness.into());
            for (picture, (face, expected)) in pictures.iter().zip([("lit", lit), ("far", far)]) {
                // The tables' digits.
                expect_value(
                    &format!("slab T {thickness}, c {albedo}, {face} face"),
                    picture,
                    expected,
                    1e-5,
                );
            }
        }
    });
}

#[test]
fn bands_of_a_chromatic_medium_are_those_of_grey_ones() {
    with_gpu(|gpu| {
        let sigma_t = Vec3::new(0.5, 1.0, 2.0);
        let chromatic = Medium {
            sigma_a: 0.1 * sigma_t,
            sigma_s: 0.9 * sigma_t,
            ..Medium::default()
        };
        let [lit, far] = along_normal(gpu, &slab(1.0, chromatic.clone()), 512, &independent(), 1.0);
        let ones = layers(8, Vec3::new(-HALF, 0.0, -HALF), Vec3::new(HALF, 1.0, HALF), |_| 1.0);
        let grid = Medium {
            density: Some(ones),
            ..chromatic
        };
        let [grid_lit, _] = along_normal(gpu, &slab(1.0, grid), 512, &independent(), 1.0);
        let tables = [[0.037487, 0.066845, 0.100411], [0.036410, 0.060563, 0.072819]];
        for (what, picture, table) in [
            ("lit", lit, tables[0]),
            ("far", far, tables[1]),
            ("grid, lit", grid_lit, tables[0]),
        ] {
            for (c, (mean, variance)) in picture.mean().into_iter().enumerate() {
                let what = format!("chromatic slab, {what}, band {c}");
                report(&what, mean, variance, table[c]);
                expect_mean(&what, mean, variance, table[c], 1e-5);
            }
        }
    });
}

#[test]
fn dense_media_reflect_as_half_spaces() {
    with_gpu(|gpu| {
        // c H(1)² / (8π), with extinctions up to 10⁴ over a metre.
        for (sigma_t, albedo, expected) in [(1e4, 0.9, 0.122572), (1e4, 0.5, 0.031148), (1e3, 0.95, 0.163083)] {
            let scene = slab(1.0, medium(sigma_t, albedo, Phase::Isotropic));
            let [lit, far] = along_normal(gpu, &scene, 256, &independent(), 1.0);
            expect_value(&format!("half space, σt {sigma_t}, c {albedo}"), &lit, expected, 1e-5);
            assert_eq!(far.mean()[0].0, 0.0);
        }
    });
}

/// Diffuse reflectance and diffuse transmittance by walks in f64, with their variances.
fn walks(thickness: f64, albedo: f64, g: f64, count: u32) -> [(f64, f64); 2] {
    let mut random = Random(17);
    let mut unit = || f64::from(random.unit());
    let (mut sums, mut squares) = ([0.0; 2], [0.0; 2]);
    for _ in 0..count {
        let (mut y, mut w, mut weight, mut order) = (thickness, DVec3::NEG_Y, 1.0, 0);
        loop {
            y += w.y * -(1.0 - unit()).ln();
            if y < 0.0 || y > thickness {
                let side = usize::from(y < 0.0);
                if order > 0 {
                    sums[side] += weight;
                    squares[side] += weight * weight;
                }
                break;
            }
            order += 1;
            weight *= albedo;
            w = phase_direction(w, henyey_greenstein_sample(g, unit()), unit()).normalize();
        }
    }
    let n = f64::from(count);
    [0, 1].map(|side| {
        let mean = sums[side] / n;
        (mean, (squares[side] / n - mean * mean) / n)
    })
}

#[test]
fn reflectance_and_transmittance_are_those_of_the_tables() {
    with_gpu(|gpu| {
        for (thickness, albedo, g, reflected, transmitted, digits) in [
            (2.0, 0.9, 0.0, 0.36165, 0.22117, 1e-5),
            (2.0, 0.9, 0.75, 0.09739, 0.66096 - (-2.0f64).exp(), 1e-5),
            (2.0, 1.0, -0.5, 0.6207, 0.3793 - (-2.0f64).exp(), 2e-4),
            (4.0, 1.0, 0.9, 0.1223, 0.8778 - (-4.0f64).exp(), 2e-4),
        ] {
            let phase = if g == 0.0 {
                Phase::Isotropic
            } else {
                Phase::HenyeyGreenstein { g: g as f32 }
            };
            let scene = slab(thickness as f32, medium(1.0, albedo, phase));
            let own = walks(thickness, f64::from(albedo), g, 200_000);
            for (side, expected) in [reflected, transmitted].into_iter().enumerate() {
                let what = format!("slab T {thickness}, c {albedo}, g {g}, {}", ["R", "Td"][side]);
                let (height, down) = if side == 0 {
                    (1.01 * thickness, -1.0)
                } else {
                    (-0.01 * thickness, 1.0)
                };
                // Radiance that comes down to (up to) the faces from inside, by the cosine.
                let weight = |w: DVec3| (down * w.y).max(0.0);
                let (sum, variance) =
                    over_sphere(gpu, &scene, DVec3::new(0.21, height, 0.13), 16, &independent(), weight);
                report(&what, sum, variance, expected);
                report(&format!("{what}, walks in f64"), own[side].0, own[side].1, expected);
                // See `over_sphere`: weights of cosines to the fourth power.
                expect_mean(&what, sum, variance, expected, 2e-3 * expected + digits);
                expect_mean(&what, own[side].0, own[side].1, expected, digits);
            }
        }
    });
}
