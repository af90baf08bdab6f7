//! Photons of each kind of light: direct and indirect light of a floor beside a wall against the path tracer's.
//!
//! Each kind shines in one band, so that bands are kinds and one rendering tests the choice among lights too.

use super::*;
use clerestory::scene::{Environment, Image, Texture};
use clerestory_tests::with_gpu;
use glam::{Quat, Vec2};

/// Fixed kernels of a radius h blur irradiance E by h²/12 ∇²E, which under a light at 1 m is at most 6 E: 0.05 % for 3 cm. Twice that.
const BIAS: f64 = 1e-3;
const RADIUS: f32 = 0.03;

const PASSES: u32 = 16;
const SAMPLES: u32 = 384;

fn expect_light(gpu: &Gpu, scene: &Scene) {
    // All light of the floor from the map, then what comes by the wall alone.
    let direct = PhotonSettings {
        direct_photons: true,
        photons: 1 << 14,
        ..fixed("bounces=1..", RADIUS)
    };
    expect_agreement(gpu, scene, &direct, [PASSES, SAMPLES], [BIAS; 3]);
    let indirect = PhotonSettings {
        direct_photons: false,
        path_set: PathSet::INDIRECT,
        ..direct
    };
    expect_agreement(gpu, scene, &indirect, [PASSES, SAMPLES], [BIAS; 3]);
}

fn grey() -> Scene {
    let lambert = |name: &str, rho: f32| Material::lambert(name, Vec3::splat(rho));
    floor_and_wall("lights", lambert("floor", 0.5), lambert("wall", 0.9))
}

#[test]
fn points_spots_and_suns_shine_as_they_should() {
    with_gpu(|gpu| {
        let mut scene = grey();
        scene.name = "point, spot, directional".into();
        scene.add_light(
            "point",
            LightKind::Point {
                position: Vec3::new(0.2, 1.0, -0.1),
                intensity: Vec3::X,
            },
        );
        scene.add_light(
            "spot",
            LightKind::Spot {
                position: Vec3::new(0.5, 1.5, 0.3),
                direction: Vec3::new(-0.5, -1.0, -0.2).normalize(),
                intensity: Vec3::Y * 4.0,
                inner: 0.3,
                outer: 0.8,
            },
        );
        scene.add_light(
            "sun",
            LightKind::Directional {
                direction: Vec3::new(-0.6, -1.0, 0.3).normalize(),
                irradiance: Vec3::Z * 2.0,
            },
        );
        expect_light(gpu, &scene);
    });
}

#[test]
fn lamps_and_skies_shine_as_they_should() {
    with_gpu(|gpu| {
        let mut scene = grey();
        scene.name = "one-sided, two-sided, environment".into();
        // A one-sided lamp that faces down, one that faces up and must not light the floor, and a two-sided one whose texture has a dark half.
        let one_sided = scene.add_material(Material {
            emission: Vec3::X * 10.0,
            double_sided: false,
            ..Material::lambert("one-sided", Vec3::ZERO)
        });
        scene.place(ceiling("down", one_sided, Vec3::new(0.3, 1.5, 0.5), 0.2, true));
        scene.place(ceiling("up", one_sided, Vec3::new(-1.2, 1.4, -0.6), 0.2, false));
        let image = scene.add_image(Image {
            name: "halves".into(),
            width: 2,
            height: 1,
            texels: vec![[255; 4], [30, 30, 30, 255]],
        });
        let two_sided = scene.add_material(Material {
            emission: Vec3::Y * 10.0,
            emission_texture: Some(Texture {
                image,
                uv_set: 0,
                wrap: Default::default(),
                filter: Default::default(),
                transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            }),
            ..Material::lambert("two-sided", Vec3::ZERO)
        });
        let mut lamp = ceiling("two-sided", two_sided, Vec3::new(-0.2, 1.3, -0.4), 0.25, false);
        lamp.uv0 = vec![Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::new(1.0, 0.0), Vec2::ZERO];
        scene.place(lamp);
        // Four by two texels, brightest a little off the zenith.
        let value = |i: usize| [0.8, 2.0, 0.3, 1.0, 0.5, 0.1, 0.9, 0.4][i];
        scene.environment = Some(Environment {
            name: "sky".into(),
            width: 4,
            height: 2,
            radiance: (0..8).map(|i| Vec3::Z * value(i)).collect(),
            rotation: Quat::from_rotation_x(0.4) * Quat::from_rotation_y(1.0),
            strength: 1.5,
        });
        // The camera is far above the lamps: they are black from there but for what the two-sided one emits.
        expect_light(gpu, &scene);
    });
}
