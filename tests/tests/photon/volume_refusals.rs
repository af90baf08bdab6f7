//! What photons cannot bring through media, and settings that cannot be, are refused by name.

use super::volume::{endless, lit_box, uneven};
use super::*;
use clerestory::Error;
use clerestory::scene::{Environment, Medium, Phase};
use clerestory::techniques::photon_mapping::volume::{VolumeEstimate, VolumeKernel};
use clerestory_tests::render::{builtin, cuboid, medium};
use clerestory_tests::with_gpu;

const ESTIMATES: [VolumeEstimate; 5] = [
    VolumeEstimate::Ray,
    VolumeEstimate::March,
    VolumeEstimate::Beams,
    VolumeEstimate::Planes,
    VolumeEstimate::Unified,
];

fn refusal(gpu: &Gpu, scene: &Scene, settings: PhotonSettings) -> Error {
    let shown = format!("{}: {settings:?} was accepted", scene.name);
    match PhotonMapper::new(gpu, upload(gpu, scene), &scene.cameras[0], SIZE, settings) {
        Ok(_) => panic!("{shown}"),
        Err(error) => error,
    }
}

#[test]
fn settings_of_media_out_of_range_are_refused_by_name() {
    with_gpu(|gpu| {
        let fine = || settings("all");
        let mut cases = Vec::new();
        for volume_spread in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let settings = PhotonSettings {
                volume_spread,
                ..fine()
            };
            cases.push(("volume_spread", settings));
        }
        for volume_dampening in [-0.1, f32::NAN, f32::INFINITY] {
            let settings = PhotonSettings {
                volume_dampening,
                ..fine()
            };
            cases.push(("volume_dampening", settings));
        }
        for volume_radius in [-0.1, f32::NAN, f32::INFINITY] {
            let settings = PhotonSettings {
                volume_radius,
                ..fine()
            };
            cases.push(("volume_radius", settings));
        }
        for volume_neighbors in [0, 1001] {
            let settings = PhotonSettings {
                volume_neighbors,
                ..fine()
            };
            cases.push(("volume_neighbors", settings));
        }
        // Whether there are media, and whether kernels are made of it.
        for scene in [
            lit_box(medium(1.0, 0.5, Phase::Isotropic)),
            builtin("builtin:cornell-box"),
        ] {
            for volume_kernel in [VolumeKernel::Fixed, VolumeKernel::Footprint, VolumeKernel::Neighbor] {
                for (wanted, settings) in &cases {
                    let settings = PhotonSettings {
                        volume_kernel,
                        ..settings.clone()
                    };
                    match refusal(gpu, &scene, settings) {
                        Error::Setting { name, .. } => assert_eq!(name, *wanted),
                        other => panic!("{wanted}: {other}"),
                    }
                }
            }
        }
    });
}

#[test]
fn endless_media_with_light_that_no_photon_brings_are_refused_by_every_estimate() {
    with_gpu(|gpu| {
        let fog = || endless(medium(1.0, 0.5, Phase::Isotropic));
        let mut glowing = fog();
        glowing.media[0].emission = Vec3::ONE;
        let mut sky = fog();
        sky.environment = Some(Environment::uniform(Vec3::ONE));
        let mut sun = fog();
        let (direction, irradiance) = (Vec3::NEG_Y, Vec3::ONE);
        sun.add_light("sun", LightKind::Directional { direction, irradiance });
        for (scene, words) in [
            (&glowing, "endless participating medium that emits everywhere"),
            (&sky, "endless participating media and light from infinity"),
            (&sun, "endless participating media and light from infinity"),
        ] {
            for volume in ESTIMATES {
                let settings = PhotonSettings {
                    volume,
                    ..settings("all")
                };
                match refusal(gpu, scene, settings) {
                    Error::Unsupported { technique, reasons } => {
                        assert_eq!((technique.as_str(), reasons.len()), ("photon", 1), "{reasons:?}");
                        assert!(reasons[0].contains(words), "{volume:?}: {reasons:?}");
                    }
                    other => panic!("{volume:?}: {other}"),
                }
            }
        }
        // What both say of one scene.
        glowing.environment = sky.environment;
        match refusal(gpu, &glowing, settings("all")) {
            Error::Unsupported { reasons, .. } => assert_eq!(reasons.len(), 2, "{reasons:?}"),
            other => panic!("{other}"),
        }
        // Light of the same kinds is welcome where the medium has an end.
        let mut bounded = lit_box(Medium {
            emission: Vec3::ONE,
            ..medium(1.0, 0.5, Phase::Isotropic)
        });
        bounded.lights.extend(sun.lights);
        bounded.environment = Some(Environment::uniform(Vec3::ONE));
        let settings = PhotonSettings {
            photons: 1 << 6,
            ..settings("all")
        };
        let uploaded = upload(gpu, &bounded);
        assert!(PhotonMapper::new(gpu, uploaded, &bounded.cameras[0], SIZE, settings).is_ok());
    });
}

#[test]
fn ways_and_planes_in_a_grid_are_refused_by_the_name_of_their_setting() {
    with_gpu(|gpu| {
        let grid = lit_box(uneven(medium(1.0, 0.5, Phase::Isotropic)));
        for volume in ESTIMATES {
            let settings = PhotonSettings {
                volume,
                volume_radius: 0.1,
                ..settings("all")
            };
            let word = match volume {
                VolumeEstimate::Beams => "beams",
                VolumeEstimate::Planes => "planes",
                _ => {
                    let uploaded = upload(gpu, &grid);
                    let made = PhotonMapper::new(gpu, uploaded, &grid.cameras[0], SIZE, settings);
                    assert!(made.is_ok(), "{volume:?}");
                    continue;
                }
            };
            match refusal(gpu, &grid, settings) {
                Error::Setting { name, value, cause } => {
                    assert_eq!((name.as_str(), value.as_str()), ("volume", word));
                    assert!(cause.contains("unified"), "{cause}");
                }
                other => panic!("{volume:?}: {other}"),
            }
        }
    });
}

#[test]
fn bodies_of_too_many_triangles_around_media_that_emit_are_refused_by_their_limit() {
    with_gpu(|gpu| {
        let mut scene = lit_box(Medium {
            emission: Vec3::ONE,
            ..medium(1.0, 0.5, Phase::Isotropic)
        });
        let boundary = scene.meshes[1].material.unwrap_or(0);
        // Boxes of twelve triangles beside each other: 8,196 with that which is there.
        for i in 0..682u32 {
            let place = Vec3::new((i % 9) as f32, (i / 9 % 9) as f32, (i / 81) as f32);
            let low = Vec3::splat(1.0) + place * 0.1;
            scene.place(cuboid("more", boundary, low, low + 0.05));
        }
        match refusal(gpu, &scene, settings("all")) {
            Error::LimitExceeded { name, value, limit, .. } => {
                assert!(name.contains("media that emit"), "{name}");
                assert_eq!((value, limit), (8196, 8192));
            }
            other => panic!("{other}"),
        }
    });
}
