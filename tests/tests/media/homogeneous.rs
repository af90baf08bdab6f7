//! Point sources in an endless homogeneous medium.
//!
//! Values: exact solutions of the transport equation for isotropic scattering (discrete root and continuum; Case and Zweifel 1967), and the
//! airlight integral, all by quadrature in f64 to the digits given.

use clerestory_tests::render::{Rendered, independent, paths};
use clerestory_tests::with_gpu;

use super::*;

/// One ray along +x from the origin through an endless medium with a point source of 1 W.
fn airlight(sigma_t: f32, albedo: f32, phase: Phase, light: Vec3, eye: DVec3) -> Scene {
    let mut scene = Scene::default();
    scene.media.push(medium(sigma_t, albedo, phase));
    scene.surrounding = Some(0);
    scene.cameras.push(ray_camera(eye, DVec3::X));
    add_point(&mut scene, light);
    scene
}

fn picture(gpu: &Gpu, scene: &Scene, set: &str, samples: u32, equiangular: bool) -> Rendered {
    let settings = PathTracerSettings {
        equiangular,
        seed: seed_of(scene) ^ (samples + u32::from(equiangular)),
        ..paths(set)
    };
    render(gpu, scene, [16, 16], samples, &settings)
}

/// The airlight integral of a source of 1 W at (x₀, h), by Simpson's rule over the angle at the light.
fn airlight_integral(sigma_t: f64, sigma_s: f64, x0: f64, h: f64, phase: impl Fn(f64) -> f64) -> f64 {
    let (first, last) = ((-x0 / h).atan(), 0.5 * PI);
    let n = 20_000;
    let f = |angle: f64| {
        let t = x0 + h * angle.tan();
        // The cosine between the light's way to the ray and the way back to the eye.
        let cosine = -angle.sin();
        (-sigma_t * (t + h / angle.cos())).exp() * phase(cosine)
    };
    let step = (last - first) / f64::from(n);
    let sum: f64 = (0..=n)
        .map(|i| {
            let weight = if i == 0 || i == n {
                1.0
            } else if i % 2 == 1 {
                4.0
            } else {
                2.0
            };
            weight * f(first + f64::from(i) * step)
        })
        .sum();
    sigma_s / (4.0 * PI * h) * sum * step / 3.0
}

#[test]
fn single_scattering_is_the_airlight_integral() {
    with_gpu(|gpu| {
        for (sigma_t, sigma_s, h, x0, expected) in [
            (1.0, 1.0, 1.0, 0.0, 1.22412e-3),
            (0.5, 0.4, 1.0, 3.0, 7.98031e-4),
            (0.1, 0.1, 0.5, 5.0, 2.07136e-3),
        ] {
            let quadrature = airlight_integral(sigma_t, sigma_s, x0, h, |_| 0.25 / PI);
            // The values are given to six digits.
            assert!((quadrature / expected - 1.0).abs() < 5e-6, "{quadrature} {expected}");
            let light = Vec3::new(x0 as f32, h as f32, 0.0);
            let scene = airlight(
                sigma_t as f32,
                (sigma_s / sigma_t) as f32,
                Phase::Isotropic,
                light,
                DVec3::ZERO,
            );
            let mut errors = Vec::new();
            for equiangular in [true, false] {
                let p = picture(gpu, &scene, "direct", 64, equiangular);
                let what = format!("airlight, σt {sigma_t}, σs {sigma_s}, h {h}, x0 {x0}, equi-angular {equiangular}");
                // 1e-5: f32, and the rays' distances from the axis of up to 1e-6 m.
                expect_value(&what, &p, quadrature, 1e-5);
                errors.push(p.mean()[0].1);
            }
            println!(
                "variance without ÷ with equi-angular samples: {:.1}",
                errors[1] / errors[0]
            );
            assert!(errors[0] < errors[1], "equi-angular samples are there to reduce noise");
        }
    });
}

#[test]
fn single_scattering_follows_the_phase_function() {
    with_gpu(|gpu| {
        use clerestory::transport::phase::phase_function;
        for phase in [
            Phase::HenyeyGreenstein { g: 0.7 },
            Phase::HenyeyGreenstein { g: -0.5 },
            Phase::Schlick { k: 0.5 },
            Phase::Rayleigh,
        ] {
            let scene = airlight(0.5, 0.8, phase, Vec3::new(3.0, 1.0, 0.0), DVec3::ZERO);
            let expected = airlight_integral(0.5, 0.4, 3.0, 1.0, |c| {
                phase_function(phase, DVec3::X, DVec3::new(c, (1.0 - c * c).max(0.0).sqrt(), 0.0))
            });
            for equiangular in [true, false] {
                let p = picture(gpu, &scene, "direct", 64, equiangular);
                expect_value(
                    &format!("airlight, {phase:?}, equi-angular {equiangular}"),
                    &p,
                    expected,
                    1e-5,
                );
            }
        }
    });
}

#[test]
fn rays_past_a_source_have_the_exact_multiple_scattering() {
    with_gpu(|gpu| {
        for (albedo, h, single, multiple) in [
            (0.5, 0.5, 4.91608e-4, 4.22674e-4),
            (0.5, 2.0, 2.79866e-5, 6.87907e-5),
            (0.9, 0.25, 2.34991e-3, 4.33577e-3),
            (0.9, 1.0, 2.68371e-4, 2.27478e-3),
        ] {
            let scene = airlight(1.0, albedo, Phase::Isotropic, Vec3::ZERO, DVec3::new(-3.0, h, 0.0));
            let p = picture(gpu, &scene, "direct", 64, true);
            expect_value(&format!("single scattering, c {albedo}, h {h}"), &p, single, 1e-5);
            let p = picture(gpu, &scene, "bounces=2..", 256, true);
            expect_value(&format!("multiple scattering, c {albedo}, h {h}"), &p, multiple, 1e-5);
        }
    });
}

#[test]
fn fluence_about_a_source_is_the_exact_one() {
    with_gpu(|gpu| {
        for (albedo, r, expected) in [
            (0.2, 0.5, 3.25382e-2),
            (0.5, 1.0, 2.94202e-2),
            (0.9, 1.0, 1.14009e-1),
            (0.9, 2.0, 3.44340e-2),
        ] {
            let scene = airlight(1.0, albedo, Phase::Isotropic, Vec3::ZERO, DVec3::ZERO);
            let (sum, variance) = over_sphere(gpu, &scene, DVec3::new(0.0, 0.0, r), 16, &independent(), |_| 1.0);
            let what = format!("collided fluence, c {albedo}, r {r}");
            report(&what, sum, variance, expected);
            // See `over_sphere`; radiance about the source goes with the inverse of the angle to it.
            expect_mean(&what, sum, variance, expected, 2e-3 * expected);
        }
    });
}

#[test]
fn orders_of_scattering_sum_to_the_whole() {
    with_gpu(|gpu| {
        let scene = airlight(
            1.0,
            0.9,
            Phase::HenyeyGreenstein { g: 0.4 },
            Vec3::ZERO,
            DVec3::new(-3.0, 1.0, 0.0),
        );
        let all = picture(gpu, &scene, "all", 256, true).mean()[0];
        let parts = ["bounces=1", "bounces=2", "bounces=3", "bounces=4.."]
            .map(|set| picture(gpu, &scene, set, 256, true).mean()[0]);
        let sum = parts.iter().fold((0.0, all.1), |s, p| (s.0 + p.0, s.1 + p.1));
        report("orders 1, 2, 3, 4 and more", sum.0, sum.1, all.0);
        expect_mean("sum of orders", sum.0, sum.1, all.0, 0.0);
        assert!(parts.iter().all(|p| p.0 > 0.0));
        // Without scattering in volumes nothing is left here.
        let none = picture(gpu, &scene, "lobes=diffuse+glossy+specular", 16, true);
        assert_eq!(none.mean()[0].0, 0.0);
        let volume = picture(gpu, &scene, "lobes=volume", 256, true).mean()[0];
        expect_mean("volume alone", volume.0, volume.1 + all.1, all.0, 0.0);
    });
}
