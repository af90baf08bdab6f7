//! Progressive photon mapping at one point of a floor under a point light, where irradiance has a closed form: bias and variance after so many
//! passes are those that the kernels' radii foretell, and the radii make both fall at the theory's rates.
//!
//! With the reduction α, the square of the bias falls as passes^(2(α − 1)) and the variance as passes^(−α), so that at α = 2/3 the root of
//! their sum has slope −⅓. Source: C. Knaus and M. Zwicker, "Progressive Photon Mapping: A Probabilistic Approach", ACM TOG 30(3), 2011, §4
//! and §5.

use super::*;
use clerestory_tests::statistics::{FALSE_ALARM, chi_square_p};
use clerestory_tests::with_gpu;

/// Half the side of what is seen, m: a point next to the kernels.
const VIEW: f32 = 1e-4;
/// Radius of the first kernel under a light at 1 m, where irradiance curves enough for a bias above the noise.
const RADIUS: f32 = 0.6;
const POWER: f32 = 64.0;
const PHOTONS: u32 = 1 << 13;
const SEEDS: u32 = 16;
/// After which the picture is read.
const PASSES: [u32; 3] = [1, 4, 16];
const REDUCTION: f32 = 2.0 / 3.0;

/// A kernel's expected radiance under the light, and the variance of it with [`PHOTONS`] photons.
fn moments(albedo: f64, radius: f64) -> [f64; 2] {
    const STEPS: u32 = 4096;
    let (mut mean, mut square) = (0.0, 0.0);
    for step in 0..STEPS {
        // Midpoints of rings.
        let distance = radius * (f64::from(step) + 0.5) / f64::from(STEPS);
        let ring = 2.0 * PI * distance * radius / f64::from(STEPS);
        let kernel = 2.0 / (PI * radius * radius) * (1.0 - (distance / radius).powi(2));
        let landing = (1.0 + distance * distance).powf(-1.5) / (4.0 * PI);
        let radiance = albedo / PI * f64::from(POWER) * kernel;
        mean += radiance * landing * ring;
        square += radiance * radiance * landing * ring;
    }
    [mean, (square - mean * mean) / f64::from(PHOTONS)]
}

/// Expectation and variance of the mean of passes with kernels of these radii.
fn progressive(albedo: f64, radii: &[f64]) -> [f64; 2] {
    let n = radii.len() as f64;
    let sums = radii.iter().map(|radius| moments(albedo, *radius));
    let [mean, variance] = sums.fold([0.0; 2], |sum, [m, v]| [sum[0] + m, sum[1] + v]);
    [mean / n, variance / (n * n)]
}

#[test]
fn bias_and_variance_fall_as_radii_foretell() {
    with_gpu(|gpu| {
        let albedo = 0.5;
        let mut scene = Scene {
            name: "under a light".into(),
            ..Scene::default()
        };
        let material = scene.add_material(Material::lambert("floor", Vec3::splat(albedo as f32)));
        scene.place(floor("floor", material, 2.0, 0.0));
        scene.cameras.push(camera_down(VIEW, 5.0));
        add_point(&mut scene, Vec3::Y, Vec3::splat(POWER));
        let settings = PhotonSettings {
            direct_photons: true,
            photons: PHOTONS,
            reduction: REDUCTION,
            ..fixed("bounces=1..1", RADIUS)
        };
        let mut mapper = mapper(gpu, &scene, &settings);
        let radius = |pass| {
            let kernel = mapper.kernel(pass);
            kernel.length_max * kernel.unit_length
        };
        let radii: Vec<f64> = (0..PASSES[PASSES.len() - 1]).map(radius).collect();
        let last = radii.len();
        let mut seen = PASSES.map(|_| Vec::new());
        let mut scatter = 0.0;
        for seed in 0..SEEDS {
            mapper.restart(seed).unwrap_or_else(|error| panic!("{error}"));
            let mut before = 0.0;
            for (pass, radius) in radii.iter().enumerate() {
                // All pixels see the same point, by the same photons.
                let mean = f64::from(advance(&mut mapper, pass as u32 + 1)[0]);
                let sum = mean * (pass + 1) as f64;
                let [expected, variance] = moments(albedo, *radius);
                scatter += (sum - before - expected).powi(2) / variance;
                before = sum;
                if let Some(at) = PASSES.iter().position(|passes| *passes as usize == pass + 1) {
                    seen[at].push(mean);
                }
            }
        }
        let exact = albedo / PI * f64::from(POWER) / (4.0 * PI);
        for (passes, seen) in PASSES.into_iter().zip(&seen) {
            let [expected, variance] = progressive(albedo, &radii[..passes as usize]);
            let n = seen.len() as f64;
            let mean = seen.iter().sum::<f64>() / n;
            println!(
                "{passes} passes: bias {:.4} (foretold {:.4} ± {:.4})",
                mean / exact - 1.0,
                expected / exact - 1.0,
                (variance / n).sqrt() / exact,
            );
            expect_mean(&format!("{passes} passes"), mean, variance / n, expected, 0.0);
        }
        // Passes are independent of each other, so that what holds for the variance of each holds for that of their mean.
        let degrees = SEEDS as usize * last;
        println!("variance of passes: {:.4} of that foretold", scatter / degrees as f64);
        let accepted = |scatter: f64| {
            let p = chi_square_p(scatter, degrees);
            p > FALSE_ALARM && p < 1.0 - FALSE_ALARM
        };
        assert!(accepted(scatter), "variance of passes");
        // Kernels that do not shrink would fail both.
        let [_, first] = moments(albedo, radii[0]);
        let unshrunk: f64 = radii.iter().map(|radius| first / moments(albedo, *radius)[1]).sum();
        assert!(!accepted(scatter * unshrunk / last as f64));
        // The bias is far above the noise of all seeds at first, or its test would have no teeth.
        let [blurred, variance] = progressive(albedo, &radii[..1]);
        assert!(exact - blurred > 10.0 * (variance / f64::from(SEEDS)).sqrt());
    });
}

#[test]
fn radii_fall_at_the_rate_of_the_theory() {
    with_gpu(|gpu| {
        let mut scene = Scene::default();
        let material = scene.add_material(Material::lambert("floor", Vec3::ONE));
        scene.place(floor("floor", material, 2.0, 0.0));
        scene.cameras.push(camera_down(VIEW, 5.0));
        add_point(&mut scene, Vec3::Y, Vec3::ONE);
        for reduction in [0.5, 2.0 / 3.0, 0.8] {
            let settings = PhotonSettings {
                reduction: reduction as f32,
                ..fixed("bounces=1..", RADIUS)
            };
            let mapper = mapper(gpu, &scene, &settings);
            let rates = |passes: u32| {
                let n = f64::from(passes);
                let squares = (0..passes).map(|pass| mapper.kernel(pass)).map(|kernel| {
                    let radius = kernel.length_max * kernel.unit_length;
                    radius * radius
                });
                // Bias goes with the square of the radius, variance with its inverse.
                let (bias, variance) = squares.fold((0.0, 0.0), |sum, square| (sum.0 + square, sum.1 + 1.0 / square));
                [bias / n, variance / (n * n)]
            };
            let (few, many) = (rates(1 << 10), rates(1 << 14));
            for (what, index, slope) in [("bias", 0, reduction - 1.0), ("variance", 1, -reduction)] {
                let found = (many[index] / few[index]).log2() / 4.0;
                // What remains of the first passes falls faster than all of it.
                assert!(
                    (found - slope).abs() < 0.01,
                    "{what}: slope {found:.4}, theory {slope:.4}"
                );
            }
        }
    });
}
