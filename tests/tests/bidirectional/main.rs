//! Bidirectional path tracing against the path tracer on equal path sets, each of its strategies alone, and equal bits however the work is done.
//!
//! Passes are independent of each other (PCG). The samples of one share thousands of light vertices, of which each draws its own: what the film's variance lacks by that is far below it, so that pixels are
//! tested one by one by the z-test with Šidák's correction, of which correlation between pixels makes false alarms rarer, not more frequent. Pixels of a pass share its light
//! subpaths, too: means over the picture are tested by Student's t over blocks of passes.

mod agreement;
mod edge_cases;
mod media;
mod path_sets;
mod ray_bundles;
mod strategies;

use clerestory::film::z_test::{SIGNIFICANCE, z_test};
use clerestory::gpu::Gpu;
use clerestory::scene::{LightKind, Material, Scene};
use clerestory::techniques::bidirectional::{BidirectionalPaths, BidirectionalSettings, Strategies};
use clerestory::transport::random::SamplerKind;
use clerestory_tests::render::{Rendered, add_lit_body, advance, builtin, cuboid, lamp, mean, paths, render, upload};
use clerestory_tests::statistics::expect_mean_of;
use clerestory_tests::with_gpu;
use glam::{DAffine3, DVec3, Vec3};

/// Pixels per side.
const SIDE: u32 = 12;
const SIZE: [u32; 2] = [SIDE; 2];
/// Blocks of passes.
const BLOCKS: u32 = 8;

/// Independent samples, some light subpaths a pixel.
fn settings() -> BidirectionalSettings {
    BidirectionalSettings {
        light_paths: 256,
        samples_at_once: 16,
        sampler: SamplerKind::Pcg,
        seed: 11,
        ..BidirectionalSettings::default()
    }
}

fn renderer(gpu: &Gpu, scene: &Scene, size: [u32; 2], settings: &BidirectionalSettings) -> BidirectionalPaths {
    match BidirectionalPaths::new(gpu, upload(gpu, scene), &scene.cameras[0], size, settings.clone()) {
        Ok(renderer) => renderer,
        Err(error) => panic!("{}: {error}", scene.name),
    }
}

/// A picture, the variance of its values, and the mean over it in each block of passes, by channel.
struct Passes {
    radiance: Vec<f32>,
    variance: Vec<f32>,
    means: [Vec<f64>; 3],
}

/// A picture of that many samples, a multiple of the blocks.
fn passes(gpu: &Gpu, scene: &Scene, settings: &BidirectionalSettings, samples: u32) -> Passes {
    let mut renderer = renderer(gpu, scene, SIZE, settings);
    let each = samples / BLOCKS;
    let mut before = [0.0; 3];
    let mut means = [const { Vec::new() }; 3];
    let mut last = [const { Vec::new() }; 2];
    for block in 1..=BLOCKS {
        last = advance(&mut renderer, block * each);
        for (channel, means) in means.iter_mut().enumerate() {
            let sum = mean(&last[0], channel) * f64::from(block);
            means.push(sum - before[channel]);
            before[channel] = sum;
        }
    }
    let [radiance, variance] = last;
    Passes {
        radiance,
        variance,
        means,
    }
}

impl Passes {
    /// Fails unless it agrees with a picture of the path tracer: pixel by pixel, and in its mean.
    fn expect_same_as(&self, what: &str, reference: &Rendered) {
        let test = z_test(
            &self.radiance,
            &self.variance,
            &reference.radiance,
            &reference.variance,
            SIGNIFICANCE,
        );
        let test = test.unwrap_or_else(|error| panic!("{what}: {error}"));
        println!("{what}: {test}");
        self.expect_mean_as(what, reference);
        assert!(test.passes(), "{what}: {test}");
    }

    /// Fails unless it agrees with such a picture in its mean: where rare samples are bright, so that sums of few are not normal.
    fn expect_mean_as(&self, what: &str, reference: &Rendered) {
        for (channel, (expected, variance)) in reference.mean().into_iter().enumerate() {
            let what = format!("{what}, channel {channel}");
            expect_mean_of(&what, &self.means[channel], expected, variance.sqrt(), 0.0);
        }
    }
}

/// The path tracer's picture of the same light paths.
fn traced(gpu: &Gpu, scene: &Scene, set: &str, samples: u32) -> Rendered {
    render(gpu, scene, SIZE, samples, &paths(set))
}

/// Adds a point light of an intensity in W/sr.
fn add_point(scene: &mut Scene, position: Vec3, intensity: f32) {
    let intensity = Vec3::splat(intensity);
    scene.add_light("point", LightKind::Point { position, intensity });
}

/// A closed box of 2 m whose walls reflect coloured light, with a block in a corner, without a light.
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
    scene
}

/// Places the Cornell box's sphere of a kind into a room, of a radius of 0.25 m.
fn add_sphere(scene: &mut Scene, kind: &str, centre: DVec3) {
    const RADIUS: f64 = 0.08;
    let from = builtin(&format!("builtin:cornell-box?sphere={kind}"));
    let mut mesh = from.meshes.last().expect("sphere").clone();
    let material = from.materials[mesh.material.expect("material") as usize].clone();
    assert!(!mesh.normals.is_empty(), "{kind}: a sphere of interpolated normals");
    let middle = mesh.positions.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / mesh.positions.len() as f64;
    let scale = DAffine3::from_scale(DVec3::splat(0.25 / RADIUS));
    let transform = DAffine3::from_translation(centre) * scale * DAffine3::from_translation(-middle);
    for position in &mut mesh.positions {
        *position = transform.transform_point3(position.as_dvec3()).as_vec3();
    }
    mesh.material = Some(scene.add_material(material));
    scene.place(mesh);
}

/// Hangs a lamp into a room, a box of 0.8 m by 0.1 m by 0.8 m.
fn add_lamp(scene: &mut Scene, radiance: f32) {
    let lamp = scene.add_material(lamp(Vec3::splat(radiance)));
    scene.place(cuboid(
        "lamp",
        lamp,
        Vec3::new(-0.4, 0.2, -0.4),
        Vec3::new(0.4, 0.3, 0.4),
    ));
}
