//! Media that lose nothing, in a uniform environment: radiance is that of the environment, whatever they scatter by.

use clerestory::scene::Environment;
use clerestory::transport::albedo::AlbedoTable;
use clerestory::transport::bsdf::{Bsdf, BsdfContext, BsdfFeatures, LOBE_ALL, bsdf_sample};
use clerestory_tests::random::Random;
use clerestory_tests::render::{builtin, independent};
use clerestory_tests::with_gpu;

use super::*;

fn furnace(eye: DVec3, medium: Medium) -> Scene {
    let mut scene = Scene {
        environment: Some(Environment::uniform(Vec3::ONE)),
        ..Scene::default()
    };
    add_box(&mut scene, medium, Vec3::splat(-1.0), Vec3::ONE);
    scene
        .cameras
        .push(Camera::look_at("main", eye, DVec3::ZERO, DVec3::Y, 0.5));
    scene
}

const EYE: DVec3 = DVec3::new(2.0, 3.0, 4.0);

#[test]
fn lossless_media_vanish() {
    with_gpu(|gpu| {
        let colored = Medium {
            sigma_s: Vec3::new(0.3, 1.0, 3.0),
            ..Medium::default()
        };
        let rough = |p: DVec3| (4.0 * p.x * (0.5 + 0.5 * (9.0 * p.y).sin()) * p.z) as f32;
        let cloud = DensityGrid::from_fn([9, 17, 6], rough).in_box(DVec3::splat(-1.0), DVec3::ONE);
        for (what, medium, eye) in [
            ("isotropic", medium(1.5, 1.0, Phase::Isotropic), EYE),
            ("forward", medium(1.5, 1.0, Phase::HenyeyGreenstein { g: 0.8 }), EYE),
            ("backward", medium(1.0, 1.0, Phase::Schlick { k: -0.7 }), EYE),
            ("rayleigh, from inside", medium(1.0, 1.0, Phase::Rayleigh), EYE * 0.1),
            ("coloured", colored.clone(), EYE),
            (
                "very forward",
                medium(3.0, 1.0, Phase::HenyeyGreenstein { g: 0.99 }),
                EYE,
            ),
            (
                "coloured cloud",
                Medium {
                    density: Some(cloud.clone()),
                    ..colored.clone()
                },
                EYE,
            ),
            (
                "coloured cloud, from inside",
                Medium {
                    density: Some(cloud),
                    ..colored
                },
                EYE * 0.1,
            ),
        ] {
            let picture = render(gpu, &furnace(eye, medium), [16, 16], 128, &independent());
            let [(mean, variance), ..] = picture.mean();
            report(what, mean, variance, 1.0);
            picture.expect_uniform(what, [1.0; 3], MEAN_ONLY);
        }
    });
}

#[test]
fn lossless_bodies_of_clear_glass_vanish() {
    with_gpu(|gpu| {
        let mut scene = furnace(EYE, medium(1.0, 1.0, Phase::HenyeyGreenstein { g: 0.5 }));
        let mut glass = Material::glass("glass", 1.3);
        glass.interior = Some(0);
        scene.materials[0] = glass;
        let picture = render(gpu, &scene, [16, 16], 128, &independent());
        let [(mean, variance), ..] = picture.mean();
        report("clear glass", mean, variance, 1.0);
        picture.expect_uniform("clear glass", [1.0; 3], MEAN_ONLY);
    });
}

/// Throughput and its variance of walks in f64 through a slab without sides that scatters evenly inside, seen straight on.
fn slab_walks(bsdf: &Bsdf, depth: f64, walks: u32) -> (f64, f64) {
    let context = BsdfContext {
        features: BsdfFeatures::ALL,
        table: AlbedoTable::shared(),
    };
    let mut random = Random(11);
    let mut unit = || f64::from(random.unit());
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..walks {
        // Heights are optical depths above the lower face.
        let (mut direction, mut height, mut throughput) = (DVec3::NEG_Z, depth, 1.0);
        loop {
            let face = if height >= depth { 1.0 } else { -1.0 };
            let flip = |w: DVec3| DVec3::new(w.x, w.y, w.z * face);
            let sample = bsdf_sample(
                &context,
                bsdf,
                flip(-direction),
                DVec3::new(unit(), unit(), unit()),
                LOBE_ALL,
            );
            throughput *= sample.weight.x;
            direction = flip(sample.wi);
            if sample.flags == 0 {
                throughput = 0.0;
            }
            if sample.flags == 0 || sample.wi.z > 0.0 {
                break;
            }
            height = height.clamp(0.0, depth);
            loop {
                height -= direction.z * (1.0 - unit()).ln();
                if height >= depth || height <= 0.0 {
                    break;
                }
                let (z, azimuth) = (2.0 * unit() - 1.0, 2.0 * PI * unit());
                let r = (1.0 - z * z).sqrt();
                direction = DVec3::new(r * azimuth.cos(), r * azimuth.sin(), z);
            }
        }
        sum += throughput;
        squares += throughput * throughput;
    }
    let n = f64::from(walks);
    let mean = sum / n;
    (mean, (squares / n - mean * mean) / n)
}

#[test]
fn rough_glass_around_a_medium_loses_what_walks_in_f64_do() {
    with_gpu(|gpu| {
        // The slab's sides are 400 thicknesses away: paths that reach them are too few to tell.
        let mut scene = builtin("builtin:slab?thickness=0.01&roughness=0.5");
        scene.media.push(medium(200.0, 1.0, Phase::Isotropic));
        scene.materials[0].interior = Some(0);
        let picture = render(gpu, &scene, [16, 16], 256, &independent());
        let (truth, own) = slab_walks(&Bsdf::from_material(&scene.materials[0]), 2.0, 200_000);
        let [(mean, variance), ..] = picture.mean();
        report("rough glass", mean, variance + own, truth);
        expect_mean("rough glass", mean, variance + own, truth, 1e-6);
    });
}
