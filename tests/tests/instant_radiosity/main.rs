//! Virtual point lights against closed forms, exact counts, and the path tracer on equal path sets.
//!
//! All pixels and eye paths of a pass have the same virtual lights, so the film's variance says nothing of their means. Passes are independent of each other
//! (PCG): the picture is read after each, variances are those of the passes' values, and means over the picture are tested by Student's t over the passes.
//! Pixels are tested one by one besides, by the z-test with Šidák's correction, of which correlation between pixels makes false alarms rarer, not more frequent.

mod agreement;
mod bounds;
mod edge_cases;
mod many_light;
mod media;
mod scattering;
mod selection;
mod walks;

use std::f64::consts::PI;

use clerestory::Error;
use clerestory::film::z_test::{SIGNIFICANCE, z_test};
use clerestory::gpu::Gpu;
use clerestory::scene::{LightKind, Material, Scene};
use clerestory::techniques::Technique;
use clerestory::techniques::instant_radiosity::{Bound, Compensation, PassCounts, VirtualLightSettings, VirtualLights};
use clerestory::transport::random::SamplerKind;
use clerestory_tests::render::{Rendered, add_lit_body, advance, builtin, cuboid, mean, paths, render, upload};
use clerestory_tests::statistics::expect_mean_of;
use clerestory_tests::with_gpu;
use glam::Vec3;

/// Pixels per side.
const SIDE: u32 = 12;
const SIZE: [u32; 2] = [SIDE; 2];
const PATHS: &str = "!L.*S[DG]S*E";

/// Independent samples, few walks.
fn settings() -> VirtualLightSettings {
    VirtualLightSettings {
        walks: 8,
        sampler: SamplerKind::Pcg,
        seed: 11,
        ..VirtualLightSettings::default()
    }
}

fn renderer(gpu: &Gpu, scene: &Scene, size: [u32; 2], settings: &VirtualLightSettings) -> VirtualLights {
    match VirtualLights::new(gpu, upload(gpu, scene), &scene.cameras[0], size, settings.clone()) {
        Ok(renderer) => renderer,
        Err(error) => panic!("{}: {error}", scene.name),
    }
}

/// A picture, the variance of its values by the passes', and the mean over it in each pass, by channel.
struct Passes {
    radiance: Vec<f32>,
    variance: Vec<f32>,
    means: [Vec<f64>; 3],
    counts: PassCounts,
}

fn passes(gpu: &Gpu, scene: &Scene, settings: &VirtualLightSettings, count: u32) -> Passes {
    passes_of_size(gpu, scene, SIZE, settings, count)
}

fn passes_of_size(gpu: &Gpu, scene: &Scene, size: [u32; 2], settings: &VirtualLightSettings, count: u32) -> Passes {
    let mut renderer = renderer(gpu, scene, size, settings);
    let found = passes_of(&mut renderer, size, settings.samples_per_pass, count);
    Passes {
        counts: renderer.counts(),
        ..found
    }
}

/// Of passes that have `each` samples of every pixel.
fn passes_of(renderer: &mut impl Technique, size: [u32; 2], each: u32, count: u32) -> Passes {
    let n = f64::from(count);
    let values = 3 * (size[0] * size[1]) as usize;
    let (mut before, mut squares) = (vec![0.0; values], vec![0.0; values]);
    let mut means = [const { Vec::new() }; 3];
    for pass in 1..=count {
        let [now, _] = advance(renderer, pass * each);
        let mut of_pass = vec![0.0f32; values];
        for i in 0..values {
            let sum = f64::from(now[i]) * f64::from(pass);
            let value = sum - before[i];
            before[i] = sum;
            squares[i] += value * value;
            of_pass[i] = value as f32;
        }
        for (channel, means) in means.iter_mut().enumerate() {
            means.push(mean(&of_pass, channel));
        }
    }
    let variance = |(sum, squares): (&f64, &f64)| ((squares - sum * sum / n) / (n * (n - 1.0))).max(0.0) as f32;
    Passes {
        radiance: before.iter().map(|sum| (sum / n) as f32).collect(),
        variance: before.iter().zip(&squares).map(variance).collect(),
        means,
        counts: PassCounts::default(),
    }
}

impl Passes {
    /// Fails unless it agrees with a picture of the path tracer: pixel by pixel, and in its mean up to a relative bias.
    fn expect_same_as(&self, what: &str, reference: &Rendered, bias: f64) {
        let test = z_test(
            &self.radiance,
            &self.variance,
            &reference.radiance,
            &reference.variance,
            SIGNIFICANCE,
        );
        let test = test.unwrap_or_else(|error| panic!("{what}: {error}"));
        assert!(bias > 0.0 || test.passes(), "{what}: {test}");
        self.expect_mean_as(what, reference, bias);
    }

    /// Fails unless it agrees with such a picture in its mean.
    fn expect_mean_as(&self, what: &str, reference: &Rendered, bias: f64) {
        for (channel, (expected, variance)) in reference.mean().into_iter().enumerate() {
            let what = format!("{what}, channel {channel}");
            expect_mean_of(&what, &self.means[channel], expected, variance.sqrt(), bias * expected);
        }
    }
}

/// The overflow that a renderer ends with: what it says, the kernel, and the records that are needed and those that there is room for.
fn overflow_of(renderer: &mut VirtualLights) -> (String, String, u64, u64) {
    let error = loop {
        match renderer.step(1) {
            Ok(Some(_)) => {}
            Ok(None) => panic!("must be refused"),
            Err(error) => break error,
        }
    };
    let text = error.to_string();
    match error {
        Error::Overflow {
            kernel,
            needed,
            capacity,
            ..
        } => (text, kernel, needed, capacity),
        _ => panic!("{text}"),
    }
}

/// The path tracer's picture of the same light paths.
fn traced(gpu: &Gpu, scene: &Scene, samples: u32) -> Rendered {
    traced_set(gpu, scene, samples, PATHS)
}

/// That of others.
fn traced_set(gpu: &Gpu, scene: &Scene, samples: u32, set: &str) -> Rendered {
    render(gpu, scene, SIZE, samples, &paths(set))
}

/// Adds a point light of a power in W.
fn add_point(scene: &mut Scene, position: Vec3, power: Vec3) {
    let intensity = power * (0.25 / PI) as f32;
    scene.add_light("point", LightKind::Point { position, intensity });
}

/// A closed box of 2 m whose walls reflect coloured light, with a block in a corner and a point light.
fn room() -> Scene {
    let mut scene = builtin("builtin:furnace-box?rho=0.5&emission=0");
    scene.name = "room".into();
    scene.materials[0] = Material::lambert("wall", Vec3::new(0.7, 0.5, 0.3));
    let block = scene.add_material(Material::lambert("block", Vec3::new(0.2, 0.6, 0.8)));
    scene.place(cuboid(
        "block",
        block,
        Vec3::new(-1.0, -1.0, -1.0),
        Vec3::new(-0.3, -0.2, -0.4),
    ));
    add_point(&mut scene, Vec3::new(0.3, 0.4, -0.1), Vec3::splat(20.0));
    scene
}
