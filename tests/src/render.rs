//! Small pictures by the path tracer, and what tests ask of them.

use std::sync::Arc;

use clerestory::film::z_test::{RELATIVE_DEVIATION_FLOOR, SIGNIFICANCE, z_test};
use clerestory::gpu::Gpu;
use clerestory::scene::{Camera, LightKind, Material, Scene};
use clerestory::techniques::path::PathCounters;
use clerestory::techniques::{PathTracer, PathTracerSettings, Technique};
use clerestory::transport::random::SamplerKind;
use clerestory::transport::{GpuScene, PathSet};
pub use clerestory_hard_cases::scenes::{
    camera_down, cuboid, floor, floor_from_above, lamp, medium, point_triangle, quad,
};

use glam::{DVec3, Vec3};

use crate::statistics::expect_mean;

/// Looks down from the side at what stands within half a metre about the origin.
pub fn camera_aslant() -> Camera {
    Camera::look_at(
        "main",
        DVec3::new(0.6, 1.6, 2.2),
        DVec3::new(0.0, 0.1, 0.0),
        DVec3::Y,
        0.7,
    )
}

/// Places a rough body into a room that absorbs what goes through it, colour by colour, and a matte plate and a point light into the body.
pub fn add_lit_body(scene: &mut Scene, intensity: f32) {
    let tinted = scene.add_material(Material {
        roughness: 0.9,
        attenuation_color: Vec3::new(0.2, 0.5, 0.8),
        attenuation_distance: 0.3,
        ..Material::glass("tinted", 1.5)
    });
    let matte = scene.add_material(Material::lambert("matte", Vec3::splat(0.8)));
    let corner = Vec3::new(-0.2, -0.9, -0.85);
    scene.place(cuboid("body", tinted, corner, corner + Vec3::new(0.9, 1.0, 0.9)));
    let plate = corner + Vec3::new(0.2, 0.3, 0.2);
    scene.place(cuboid("plate", matte, plate, plate + Vec3::new(0.5, 0.1, 0.5)));
    let position = corner + Vec3::new(0.4, 0.75, 0.5);
    let intensity = Vec3::splat(intensity);
    scene.add_light("inside", LightKind::Point { position, intensity });
}

/// A finished picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Rendered {
    /// RGB a pixel.
    pub radiance: Vec<f32>,
    /// Variance of the means.
    pub variance: Vec<f32>,
    /// Finite samples per pixel.
    pub samples: Vec<f32>,
    /// Samples left out.
    pub non_finite: u64,
    /// What the device did.
    pub counters: PathCounters,
}

impl Rendered {
    /// Bits of radiance and variance: equal for equal pictures only.
    pub fn bits(&self) -> Vec<u32> {
        self.radiance
            .iter()
            .chain(&self.variance)
            .map(|v| v.to_bits())
            .collect()
    }

    /// 64-bit FNV-1a of [`Rendered::bits`].
    pub fn hash(&self) -> u64 {
        crate::child::hash_of(self.bits())
    }

    /// Mean over the picture and the variance of that mean, per channel.
    pub fn mean(&self) -> [(f64, f64); 3] {
        let pixels = (self.radiance.len() / 3) as f64;
        let sum = |values: &[f32], c: usize| values.iter().skip(c).step_by(3).map(|v| f64::from(*v)).sum::<f64>();
        [0, 1, 2].map(|c| {
            (
                sum(&self.radiance, c) / pixels,
                sum(&self.variance, c) / (pixels * pixels),
            )
        })
    }

    /// Fails unless every sample was finite and each pixel has `samples` of them.
    pub fn expect_sound(&self, what: &str, samples: u32) {
        assert_eq!(self.non_finite, 0, "{what}: samples that are not finite");
        assert!(
            self.samples.iter().all(|n| *n == samples as f32),
            "{what}: samples are missing"
        );
        assert!(
            self.radiance.iter().all(|v| v.is_finite() && *v >= 0.0),
            "{what}: radiance"
        );
    }

    /// Fails unless the mean over the picture is `expected` and every pixel agrees with it, by z-tests; a relative difference of up to
    /// `bias` is allowed for, besides that of f32 rounding.
    ///
    /// The mean's test has the rate of false alarms [`crate::statistics::FALSE_ALARM`] a channel, the pixels' one is
    /// [`z_test`] at its [`SIGNIFICANCE`]; it is left out where a bias is allowed.
    pub fn expect_uniform(&self, what: &str, expected: [f64; 3], bias: f64) {
        for (c, (mean, variance)) in self.mean().into_iter().enumerate() {
            let allowed = (bias + RELATIVE_DEVIATION_FLOOR) * expected[c];
            expect_mean(&format!("{what}, channel {c}"), mean, variance, expected[c], allowed);
        }
        if bias == 0.0 {
            let values: Vec<f32> = (0..self.radiance.len()).map(|i| expected[i % 3] as f32).collect();
            self.expect_values(what, &values);
        }
    }

    /// Fails unless pixels have the expectations `expected`, by [`z_test`] and its test of the sum of all differences.
    pub fn expect_values(&self, what: &str, expected: &[f32]) {
        self.expect_same_as(what, expected, &vec![0.0; expected.len()]);
    }

    /// Fails unless pixels have the same expectations as means `other` of the given variance.
    pub fn expect_same_as(&self, what: &str, other: &[f32], other_variance: &[f32]) {
        match z_test(&self.radiance, &self.variance, other, other_variance, SIGNIFICANCE) {
            // The sum's z counts the three channels of a pixel as independent; they may be one and the same: √3 · 4.89.
            Ok(test) => assert!(test.passes() && test.bias_z.abs() < 8.5, "{what}: {test}"),
            Err(error) => panic!("{what}: {error}"),
        }
    }
}

/// A generated scene; the test fails when the address is wrong.
pub fn builtin(address: &str) -> Scene {
    match clerestory::scene::load(address) {
        Ok(scene) => scene,
        Err(error) => panic!("{address}: {error}"),
    }
}

/// Settings of statistical tests: independent samples, so that z-scores are standard normal.
pub fn independent() -> PathTracerSettings {
    PathTracerSettings {
        sampler: SamplerKind::Pcg,
        seed: 7,
        ..PathTracerSettings::default()
    }
}

/// [`independent`] over a part of the paths.
pub fn paths(set: &str) -> PathTracerSettings {
    PathTracerSettings {
        path_set: set.parse::<PathSet>().unwrap_or_else(|error| panic!("{error}")),
        ..independent()
    }
}

/// Uploads a scene; the test fails when it is refused.
pub fn upload(gpu: &Gpu, scene: &Scene) -> Arc<GpuScene> {
    match GpuScene::new(gpu, scene) {
        Ok(scene) => Arc::new(scene),
        Err(error) => panic!("{error}"),
    }
}

/// Makes a tracer of the scene's first camera.
pub fn tracer(gpu: &Gpu, scene: &Scene, size: [u32; 2], settings: &PathTracerSettings) -> PathTracer {
    tracer_of(gpu, &upload(gpu, scene), &scene.cameras[0], size, settings)
}

/// As [`tracer`], of a scene that other pictures share.
pub fn tracer_of(
    gpu: &Gpu,
    scene: &Arc<GpuScene>,
    camera: &Camera,
    size: [u32; 2],
    settings: &PathTracerSettings,
) -> PathTracer {
    match PathTracer::new(gpu, scene.clone(), camera, size, settings.clone()) {
        Ok(tracer) => tracer,
        Err(error) => panic!("{error}"),
    }
}

/// Renders to the end and reads the picture.
pub fn finish(tracer: &mut PathTracer, samples: u32) -> Rendered {
    let picture = tracer.render(samples).and_then(|()| tracer.picture());
    let (picture, non_finite) = picture.unwrap_or_else(|error| panic!("{error}"));
    let layer = |name: &str| {
        picture
            .layer(name)
            .map_or_else(Vec::new, |layer| layer.values().to_vec())
    };
    Rendered {
        radiance: layer("radiance"),
        variance: layer("variance"),
        samples: layer("samples"),
        non_finite: non_finite.total(),
        counters: tracer.counters(),
    }
}

/// Renders and checks that all samples are there and finite.
pub fn render(gpu: &Gpu, scene: &Scene, size: [u32; 2], samples: u32, settings: &PathTracerSettings) -> Rendered {
    let picture = finish(&mut tracer(gpu, scene, size, settings), samples);
    picture.expect_sound(&scene.name, samples);
    picture
}

/// Goes on to that many samples per pixel, all of them finite and there, and reads radiance and variance.
pub fn advance(technique: &mut impl Technique, samples: u32) -> [Vec<f32>; 2] {
    while technique
        .step(samples)
        .unwrap_or_else(|error| panic!("{error}"))
        .is_some()
    {}
    let (picture, non_finite) = technique.picture().unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(non_finite.total(), 0, "samples that are not finite");
    let layer = |name: &str| {
        picture
            .layer(name)
            .map_or_else(Vec::new, |layer| layer.values().to_vec())
    };
    let radiance = layer("radiance");
    assert!(
        !radiance.is_empty() && radiance.iter().all(|v| v.is_finite() && *v >= 0.0),
        "radiance"
    );
    assert!(
        layer("samples").iter().all(|n| *n == samples as f32),
        "samples are missing"
    );
    [radiance, layer("variance")]
}

/// Mean of a channel over a picture.
pub fn mean(radiance: &[f32], channel: usize) -> f64 {
    let values = radiance.iter().skip(channel).step_by(3);
    values.map(|value| f64::from(*value)).sum::<f64>() / (radiance.len() / 3) as f64
}

/// As [`scenes::pixel_averages`](clerestory_hard_cases::scenes::pixel_averages), with 16 × 16 points per pixel.
pub fn pixel_averages(size: u32, half: f64, function: impl Fn(f64, f64) -> f64) -> Vec<f64> {
    clerestory_hard_cases::scenes::pixel_averages(size, half, 16, function)
}
