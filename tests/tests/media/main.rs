//! Participating media in the path tracer against what is known of them in closed form, from exact solutions of the transport equation, and
//! from walks in f64.
//!
//! Acceptance: means by a z-test with a false-alarm rate of 10⁻⁶ a channel, pixels by `film::z_test`; samples are independent (PCG). Where a
//! difference is allowed besides, its reason stands with it. Each test prints what it found, for `--nocapture`.

mod absorption;
mod area_lights;
mod boundaries;
mod furnace;
mod heterogeneous;
mod homogeneous;
mod mechanics;
mod slab;

use std::f64::consts::PI;

use clerestory::gpu::Gpu;
use clerestory::scene::{Camera, DensityGrid, LightKind, Material, Medium, Phase, Projection, Scene};
use clerestory::techniques::PathTracerSettings;
use clerestory_tests::render::{Rendered, cuboid, medium, quad, render};
use clerestory_tests::statistics::expect_mean;
use glam::{DVec3, Vec3};

/// A relative difference far below all noise, with which `expect_uniform` looks at the mean over the picture alone: single pixels of few
/// samples are not normal where rare samples count much, as at the ends of long walks.
const MEAN_ONLY: f64 = 1e-6;

/// Adds a box of a medium behind an invisible boundary.
fn add_box(scene: &mut Scene, medium: Medium, low: Vec3, high: Vec3) {
    scene.media.push(medium);
    let material = scene.add_material(Material {
        name: "boundary".into(),
        boundary: true,
        interior: Some(scene.media.len() as u32 - 1),
        ..Material::default()
    });
    scene.place(cuboid("box", material, low, high));
}

/// A grid of a function of the height in the unit cube, in the box between two corners.
fn layers(cells: u32, low: Vec3, high: Vec3, density: impl Fn(f64) -> f64) -> DensityGrid {
    DensityGrid::from_fn([3, cells, 2], |p| density(p.y) as f32).in_box(low.as_dvec3(), high.as_dvec3())
}

/// A seed of its own for each scene, so that no two results share their random numbers: 32-bit FNV-1a of what the scene holds.
fn seed_of(scene: &Scene) -> u32 {
    let media: Vec<_> = scene
        .media
        .iter()
        .map(|m| (m.sigma_a, m.sigma_s, m.phase, m.density.is_some()))
        .collect();
    let text = format!(
        "{media:?} {:?} {:?}",
        scene.lights,
        scene.cameras.first().map(|c| c.transform)
    );
    text.bytes().fold(0x811c_9dc5, |hash, byte| {
        (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193)
    })
}

/// A camera of parallel rays from `eye` along `forward`, so close together that they are one ray.
fn ray_camera(eye: DVec3, forward: DVec3) -> Camera {
    let mut camera = Camera::look_at("ray", eye, eye + forward, forward.any_orthonormal_vector(), 1.0);
    camera.projection = Projection::Orthographic { half_height: 1e-6 };
    camera
}

/// A point light of a power of 1 W.
fn add_point(scene: &mut Scene, position: Vec3) {
    let intensity = Vec3::splat((0.25 / PI) as f32);
    scene.add_light("point", LightKind::Point { position, intensity });
}

/// Prints and tests the mean of a picture's first channel; `bias` is relative.
fn expect_value(what: &str, picture: &Rendered, expected: f64, bias: f64) {
    let (mean, variance) = picture.mean()[0];
    report(what, mean, variance, expected);
    expect_mean(what, mean, variance, expected, bias * expected);
}

fn report(what: &str, mean: f64, variance: f64, expected: f64) {
    let z = (mean - expected) / variance.sqrt();
    println!(
        "{what}: {mean:.6} ± {:.1e}, expected {expected:.6}, z = {z:.2}",
        variance.sqrt()
    );
}

/// Integral over all directions of radiance × weight at a point, by pictures of the six faces of a cube, with its variance.
///
/// Weights are those of pixels' centres: their bend within a pixel, the square of 1/16 over 12, is what a result may be wrong by.
fn over_sphere(
    gpu: &Gpu,
    scene: &Scene,
    eye: DVec3,
    samples: u32,
    settings: &PathTracerSettings,
    weight: impl Fn(DVec3) -> f64,
) -> (f64, f64) {
    const SIZE: u32 = 32;
    let (mut sum, mut variance) = (0.0, 0.0);
    for (face, forward) in [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z]
        .into_iter()
        .enumerate()
    {
        let up = forward.any_orthonormal_vector();
        let right = forward.cross(up);
        let centre = |i: u32| 2.0 * (f64::from(i) + 0.5) / f64::from(SIZE) - 1.0;
        let weights: Vec<f64> = (0..SIZE * SIZE)
            .map(|pixel| {
                let way = forward + centre(pixel % SIZE) * right - centre(pixel / SIZE) * up;
                let squared = way.length_squared();
                weight(way / squared.sqrt()) * 4.0 / f64::from(SIZE * SIZE) / (squared * squared.sqrt())
            })
            .collect();
        if weights.iter().all(|w| *w == 0.0) {
            continue;
        }
        let mut scene = scene.clone();
        scene.cameras = vec![Camera::look_at("face", eye, eye + forward, up, 0.5 * PI as f32)];
        let settings = PathTracerSettings {
            seed: seed_of(&scene).wrapping_add(face as u32),
            ..settings.clone()
        };
        let picture = render(gpu, &scene, [SIZE; 2], samples, &settings);
        for (pixel, w) in weights.iter().enumerate() {
            sum += w * f64::from(picture.radiance[3 * pixel]);
            variance += w * w * f64::from(picture.variance[3 * pixel]);
        }
    }
    (sum, variance)
}
