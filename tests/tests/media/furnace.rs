//! Media that lose nothing, in a uniform environment: radiance is that of the environment, whatever they scatter by.

use clerestory::scene::Environment;
use clerestory_tests::render::independent;
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
fn lossless_bodies_of_glass_vanish() {
    with_gpu(|gpu| {
        for (what, roughness, bias) in [("clear", 0.0, 0.0), ("rough", 0.5, 2e-2)] {
            let mut scene = furnace(EYE, medium(1.0, 1.0, Phase::HenyeyGreenstein { g: 0.5 }));
            let mut glass = Material::glass("glass", 1.3);
            glass.roughness = roughness;
            glass.interior = Some(0);
            scene.materials[0] = glass;
            let picture = render(gpu, &scene, [16, 16], 128, &independent());
            // Rough dielectrics lose what masking takes of the single scattering among microfacets; clear ones nothing.
            let [(mean, variance), ..] = picture.mean();
            report(what, mean, variance, 1.0);
            if bias == 0.0 {
                picture.expect_uniform(what, [1.0; 3], MEAN_ONLY);
            } else {
                assert!(mean < 1.0 + 5.0 * variance.sqrt() && mean > 0.8, "{mean}");
            }
        }
    });
}
