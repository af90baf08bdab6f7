//! What any driver of the baseline must get right: the techniques on small scenes, judged without another driver.
//!
//! Two kinds of expectation need none: closed forms, and means that are written down here with their standard errors. `tools/test` runs this
//! file on the usual driver with all others, and alone on SwiftShader, whose compiler and limits are others altogether.
//!
//! Acceptance: each picture is rendered with several seeds, which makes its means over quarters independent values of one distribution; Student's
//! t of them, at a false-alarm rate of 10⁻⁶ a quarter and channel. Each test prints what it found, for `--nocapture`.

use clerestory::gpu::Gpu;
use clerestory::render::{RenderOptions, render};
use clerestory::scene::{self, Scene};
use clerestory_tests::statistics::expect_mean_of;
use clerestory_tests::{assert_no_messages, with_gpu};
use serde_json::{Value, json};

/// Pixels per side.
const SIDE: usize = 16;
/// Renderings of each picture.
const SEEDS: u32 = 12;
/// Values of a picture: four quarters of three channels.
const VALUES: usize = 12;

fn load(address: &str) -> Scene {
    scene::load(address).unwrap_or_else(|error| panic!("{address}: {error}"))
}

/// Means over the quarters of a picture: upper left, upper right, lower left, lower right, with red, green and blue each.
fn quarters(radiance: &[f32]) -> [f64; VALUES] {
    assert_eq!(radiance.len(), 3 * SIDE * SIDE);
    let mut sums = [0.0; VALUES];
    for (i, value) in radiance.iter().enumerate() {
        assert!(value.is_finite() && *value >= 0.0, "radiance {value}");
        let (pixel, channel) = (i / 3, i % 3);
        let quarter = usize::from(pixel % SIDE >= SIDE / 2) + 2 * usize::from(pixel / SIDE >= SIDE / 2);
        sums[3 * quarter + channel] += f64::from(*value);
    }
    sums.map(|sum| sum / (SIDE * SIDE / 4) as f64)
}

/// The quarters of a picture by one seed after the other.
fn pictures(
    gpu: &Gpu,
    scene: &Scene,
    technique: &str,
    settings: &Value,
    samples: u32,
    seeds: u32,
) -> Vec<[f64; VALUES]> {
    let picture = |seed| {
        let options = RenderOptions {
            technique: Some(technique.into()),
            size: [SIDE as u32; 2],
            spp: samples,
            seed,
            settings: settings.clone().into(),
            ..RenderOptions::default()
        };
        let rendered = render(gpu, scene, &options).unwrap_or_else(|error| panic!("{technique}: {error}"));
        assert_no_messages(gpu);
        assert_eq!(rendered.report.non_finite_samples.total(), 0);
        let radiance = rendered
            .picture
            .require("radiance")
            .unwrap_or_else(|error| panic!("{error}"));
        quarters(radiance.values())
    };
    (0..seeds).map(picture).collect()
}

/// Fails unless the quarters have these means, each with its standard error; a relative bias is allowed for.
fn expect(what: &str, pictures: &[[f64; VALUES]], expected: impl Fn(usize) -> (f64, f64), bias: f64) {
    for i in 0..VALUES {
        let values: Vec<f64> = pictures.iter().map(|quarters| quarters[i]).collect();
        let (mean, error) = expected(i);
        expect_mean_of(
            &format!("{what}, quarter {}, channel {}", i / 3, i % 3),
            &values,
            mean,
            error,
            bias * mean,
        );
    }
}

fn path(set: &str) -> Value {
    json!({ "path_set": set, "sampler": "pcg" })
}

/// Kernels of one radius, which do not shrink.
fn photons(set: &str, radius: f32) -> Value {
    json!({ "path_set": set, "sampler": "pcg", "photons": 1 << 13, "radius": radius, "reduction": 1.0 })
}

/// Sums of f32 with their rounding.
const ROUNDING: f64 = 1e-5;

#[test]
fn furnaces_are_uniform() {
    with_gpu(|gpu| {
        // E / (1 − ρ) in every direction.
        let scene = load("builtin:furnace-box?rho=0.5&emission=0.5");
        let found = pictures(gpu, &scene, "path", &path("all"), 8, SEEDS);
        expect("path", &found, |_| (1.0, 0.0), ROUNDING);
        // Kernels have no bias on a sphere; its facets of 0.1 have their middles 10⁻³ nearer to the centre, and creases as sharp.
        let scene = load("builtin:furnace-sphere?rho=0.5&emission=0.5&frequency=12");
        let found = pictures(gpu, &scene, "photon", &photons("all", 0.15), 2, SEEDS);
        expect("photon", &found, |_| (1.0, 0.0), 4e-3);
    });
}

#[test]
fn a_light_in_a_sphere_fills_it_evenly() {
    with_gpu(|gpu| {
        // Edges of the facets: distance and angle to the light vary by their squares.
        let facets = (1.11f64 / 48.0).powi(2);
        let scene = load("builtin:sphere-light?light=point&rho=0.5&frequency=24");
        let found = pictures(gpu, &scene, "path", &path("bounces=1.."), 8, SEEDS);
        expect("path", &found, |_| (1.0, 0.0), 2.0 * facets);
        let found = pictures(gpu, &scene, "photon", &photons("bounces=1..", 0.2), 2, SEEDS);
        expect("photon", &found, |_| (1.0, 0.0), 1e-3 + facets);
    });
}

/// A picture by fixed settings, with its means over quarters and their standard errors from some hundred seeds on lavapipe 22.3.6, those judged
/// among them. A technique's own bias is in them, so that they hold on every driver. `CLERESTORY_WRITE_MEANS=1024` makes the tests print them
/// from so many seeds, with `--nocapture`.
struct Known {
    technique: &'static str,
    address: &'static str,
    settings: Value,
    samples: u32,
    means: [f64; VALUES],
    errors: [f64; VALUES],
}

impl Known {
    fn check(&self) {
        with_gpu(|gpu| {
            let scene = load(self.address);
            if let Ok(seeds) = std::env::var("CLERESTORY_WRITE_MEANS") {
                let seeds = seeds.parse().unwrap_or_else(|error| panic!("{seeds}: {error}"));
                self.write_anew(&pictures(
                    gpu,
                    &scene,
                    self.technique,
                    &self.settings,
                    self.samples,
                    seeds,
                ));
                return;
            }
            let found = pictures(gpu, &scene, self.technique, &self.settings, self.samples, SEEDS);
            let what = format!("{} of {}", self.technique, self.address);
            expect(&what, &found, |i| (self.means[i], self.errors[i]), ROUNDING);
        });
    }

    fn write_anew(&self, pictures: &[[f64; VALUES]]) {
        let n = pictures.len() as f64;
        let mean = |i: usize| pictures.iter().map(|quarters| quarters[i]).sum::<f64>() / n;
        let error = |i: usize| {
            let squares = pictures.iter().map(|quarters| (quarters[i] - mean(i)).powi(2));
            (squares.sum::<f64>() / (n * (n - 1.0))).sqrt()
        };
        let list =
            |value: &dyn Fn(usize) -> f64| (0..VALUES).map(|i| format!("{:.3e}, ", value(i))).collect::<String>();
        let means: String = (0..VALUES).map(|i| format!("{:.6}, ", mean(i))).collect();
        println!(
            "{} of {}: means: [{means}], errors: [{}]",
            self.technique,
            self.address,
            list(&error)
        );
    }
}

#[test]
fn a_room_with_gold_by_the_path_tracer_has_its_means() {
    let known = Known {
        technique: "path",
        address: "builtin:cornell-box?sphere=gold",
        settings: path("bounces=1.."),
        samples: 8,
        means: [
            0.150393, 0.055238, 0.014779, 0.111139, 0.090400, 0.016122, 0.101900, 0.037429, 0.010468, 0.035198,
            0.036769, 0.004871,
        ],
        errors: [
            7.476e-4, 3.159e-4, 6.152e-5, 1.330e-3, 7.528e-4, 1.293e-4, 6.257e-4, 2.613e-4, 4.809e-5, 3.487e-4,
            2.517e-4, 3.296e-5,
        ],
    };
    known.check();
}

#[test]
fn a_room_with_a_caustic_by_photon_mapping_has_its_means() {
    let known = Known {
        technique: "photon",
        address: "builtin:cornell-box?sphere=glass",
        settings: photons("bounces=1..", 0.05),
        samples: 2,
        means: [
            0.141282, 0.053783, 0.014871, 0.091022, 0.081780, 0.015955, 0.091611, 0.035181, 0.010069, 0.053737,
            0.051799, 0.009733,
        ],
        errors: [
            1.318e-4, 7.027e-5, 2.084e-5, 3.888e-4, 2.746e-4, 9.046e-5, 1.289e-4, 7.539e-5, 2.279e-5, 3.906e-4,
            2.740e-4, 8.921e-5,
        ],
    };
    known.check();
}
