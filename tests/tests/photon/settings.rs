//! Settings: what each changes, that parts of the light sum up, and what is refused.

use super::*;
use clerestory::Error;
use clerestory::film::picture::RADIANCE;
use clerestory_tests::render::builtin;
use clerestory_tests::with_gpu;

/// A closed box of 2 m whose walls reflect coloured light, with a point light.
pub fn room() -> Scene {
    let mut scene = builtin("builtin:furnace-box?rho=0.5&emission=0");
    scene.name = "room".into();
    scene.materials[0] = Material::lambert("wall", Vec3::new(0.6, 0.5, 0.4));
    add_point(&mut scene, Vec3::new(0.2, 0.4, -0.1), Vec3::splat(20.0));
    // A wall, away from its edges.
    scene.cameras = vec![clerestory_hard_cases::scenes::orthographic(
        glam::DVec3::new(0.0, 0.0, 0.9),
        glam::DVec3::NEG_Z,
        glam::DVec3::Y,
        0.6,
    )];
    scene
}

/// What is left of a wall's light, off its edges by more than a kernel: h²/12 ∇²E of kernels of up to 0.2 m, where indirect light bends by less
/// than E a square metre.
const BIAS: f64 = 4e-3;
/// What neighbours add: distances are told apart by 10⁻⁴ of their squares, and those that are looked for in vain within the radius, none here.
const NEAREST_BIAS: f64 = 4e-3;

#[test]
fn every_shape_agrees_with_the_path_tracer() {
    with_gpu(|gpu| {
        let scene = room();
        let set = "bounces=2..3";
        let reference = traced(gpu, &scene, set, 512);
        for (shape, widen_flat) in [
            (KernelShape::Fixed, true),
            (KernelShape::Isotropic, true),
            (KernelShape::Principal, true),
            (KernelShape::Skewed, true),
            (KernelShape::Skewed, false),
        ] {
            let settings = PhotonSettings {
                shape,
                widen_flat,
                radius: 0.2,
                ..settings(set)
            };
            let found = means(gpu, &scene, &settings, 16);
            let photons = found.counts.photons;
            // Photons without a kernel are light that is lost.
            let lost = photons.without_kernel as f64 / photons.deposits as f64;
            println!("{shape:?}: {lost:.4} without a kernel");
            assert!(if widen_flat {
                lost == 0.0
            } else {
                lost > 0.0 && lost < 0.01
            });
            found.expect_same_as(&format!("{shape:?}"), &reference, [BIAS + lost; 3]);
        }
    });
}

#[test]
fn nearest_neighbours_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        let scene = room();
        let set = "bounces=2..3";
        let reference = traced(gpu, &scene, set, 512);
        // The last of k neighbours only says how wide the kernel is: even, it holds k - 1 of k of its light without bias where the light is
        // even. Others are as wide, and hold the same light.
        let neighbors = 64;
        for profile in [KernelProfile::Uniform, KernelProfile::Epanechnikov] {
            let settings = PhotonSettings {
                neighbors,
                profile,
                ..settings(set)
            };
            let found = means(gpu, &scene, &settings, 16);
            let asked = found.counts.gather;
            let each = asked.photons as f64 / asked.queries as f64;
            println!("{profile:?}: {each:.1} photons per query");
            assert!(each > 0.9 * f64::from(neighbors) && each < 1.1 * f64::from(neighbors));
            found.expect_same_as(&format!("nearest, {profile:?}"), &reference, [BIAS + NEAREST_BIAS; 3]);
        }
    });
}

#[test]
fn neighbours_are_found_wherever_they_are_looked_for() {
    with_gpu(|gpu| {
        let scene = room();
        let wide = PhotonSettings {
            neighbors: 1000,
            photons: 1 << 16,
            ..settings("bounces=2..3")
        };
        let kernel = mapper(gpu, &scene, &wide).kernel(0);
        let reach = kernel.length_max * kernel.unit_length;
        // Where photons lie densely the larger reach has more of them than a query has steps for, so that it looks nearer by.
        let [near, far] = [0.5f64.sqrt() * reach, reach].map(|radius| PhotonSettings {
            neighbors: 500,
            radius: radius as f32,
            ..wide.clone()
        });
        let pictures = [near, far].map(|settings| photons(gpu, &scene, &settings, 1));
        let seen = pictures[0].iter().filter(|value| **value > 0.0).count();
        assert!(seen > pictures[0].len() / 2);
        // A kernel's squared radius is known to 10⁻⁴.
        for (i, (near, far)) in pictures[0].iter().zip(&pictures[1]).enumerate() {
            assert!((near - far).abs() <= 2e-4 * near, "{i}: {far}, not {near}");
        }
    });
}

#[test]
fn points_that_ask_together_see_the_same() {
    with_gpu(|gpu| {
        let scene = room();
        let uploaded = upload(gpu, &scene);
        for neighbors in [0, 20] {
            let pictures = [MapQuery::Single, MapQuery::Packet].map(|query| {
                let settings = PhotonSettings {
                    query,
                    neighbors,
                    shape: KernelShape::Principal,
                    photons: 1 << 11,
                    ..settings("indirect")
                };
                let mut mapper = PhotonMapper::new(gpu, uploaded.clone(), &scene.cameras[0], SIZE, settings).unwrap();
                while mapper.step(2).unwrap().is_some() {}
                let (picture, _) = mapper.picture().unwrap();
                let radiance = picture.layer(RADIANCE).unwrap().values().to_vec();
                (radiance, mapper.counts().gather)
            });
            assert!(pictures[0].0.iter().any(|value| *value > 0.0));
            assert!(pictures[0] == pictures[1], "neighbors {neighbors}");
        }
    });
}

#[test]
fn direct_photons_and_final_gather_have_the_same_light() {
    with_gpu(|gpu| {
        let scene = room();
        let base = fixed("bounces=1..3", 0.1);
        for (direct_photons, final_gather) in [(true, false), (false, true), (false, false)] {
            let settings = PhotonSettings {
                direct_photons,
                final_gather,
                ..base.clone()
            };
            // Direct light bends more: 6 E a square metre at 1 m.
            let bias = BIAS + if direct_photons { 0.01 / 12.0 * 6.0 } else { 0.0 };
            expect_agreement(gpu, &scene, &settings, [16, 512], [bias; 3]);
        }
    });
}

#[test]
fn caustics_are_seen_directly_by_a_final_gather() {
    with_gpu(|gpu| {
        let mut scene = floor_and_wall(
            "mirror beside a floor",
            Material::lambert("floor", Vec3::splat(0.5)),
            Material::mirror("mirror", Vec3::splat(0.9)),
        );
        let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.7)));
        scene.place(upright("other wall", grey, 1.2, 1.5));
        let lamp = scene.add_material(Material {
            double_sided: false,
            ..clerestory_tests::render::lamp(Vec3::splat(8.0))
        });
        scene.place(ceiling("lamp", lamp, Vec3::new(0.3, 1.6, 0.1), 0.5, true));
        let settings = PhotonSettings {
            final_gather: true,
            photons: 1 << 14,
            ..fixed("indirect", 0.03)
        };
        expect_agreement(gpu, &scene, &settings, [16, 512], [BIAS; 3]);
    });
}

#[test]
fn parts_of_the_light_sum_to_the_whole() {
    with_gpu(|gpu| {
        let mut scene = room();
        scene.materials[0].emission = Vec3::new(0.1, 0.2, 0.3);
        let part = |set: &str| photons(gpu, &scene, &fixed(set, 0.1), 4);
        let whole = part("all");
        let parts = ["emitted", "direct", "indirect"].map(part);
        assert!(parts.iter().all(|part| sums(part)[0].iter().all(|sum| *sum > 0.1)));
        for (i, value) in whole.iter().enumerate() {
            // The same random numbers: equal up to rounding, of four samples per pixel each.
            let sum: f32 = parts.iter().map(|part| part[i]).sum();
            assert!((sum - value).abs() <= 1e-5 * value, "{i}: {sum}, not {value}");
        }
    });
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    with_gpu(|gpu| {
        let scene = room();
        let uploaded = upload(gpu, &scene);
        let refuse = |settings: PhotonSettings| match PhotonMapper::new(
            gpu,
            uploaded.clone(),
            &scene.cameras[0],
            SIZE,
            settings.clone(),
        ) {
            Ok(_) => panic!("accepted: {settings:?}"),
            Err(error) => error,
        };
        let fine = || settings("all");
        let cases: [(&str, PhotonSettings); 18] = [
            ("neighbors", PhotonSettings { neighbors: 1, ..fine() }),
            (
                "neighbors",
                PhotonSettings {
                    neighbors: 1001,
                    ..fine()
                },
            ),
            ("photons", PhotonSettings { photons: 0, ..fine() }),
            (
                "photons",
                PhotonSettings {
                    photons: (1 << 24) + 1,
                    ..fine()
                },
            ),
            (
                "samples_per_pass",
                PhotonSettings {
                    samples_per_pass: 0,
                    ..fine()
                },
            ),
            (
                "samples_per_pass",
                PhotonSettings {
                    samples_per_pass: 4097,
                    ..fine()
                },
            ),
            ("radius", PhotonSettings { radius: -1.0, ..fine() }),
            (
                "radius",
                PhotonSettings {
                    radius: f32::NAN,
                    ..fine()
                },
            ),
            (
                "unit_length",
                PhotonSettings {
                    unit_length: f32::INFINITY,
                    ..fine()
                },
            ),
            ("spread", PhotonSettings { spread: 0.0, ..fine() }),
            (
                "dampening",
                PhotonSettings {
                    dampening: 0.0,
                    ..fine()
                },
            ),
            (
                "dampening",
                PhotonSettings {
                    dampening: 1.5,
                    ..fine()
                },
            ),
            (
                "flatness",
                PhotonSettings {
                    flatness: 1.0,
                    ..fine()
                },
            ),
            (
                "reduction",
                PhotonSettings {
                    reduction: 0.0,
                    ..fine()
                },
            ),
            (
                "reduction",
                PhotonSettings {
                    reduction: f32::NAN,
                    ..fine()
                },
            ),
            (
                "query_quota",
                PhotonSettings {
                    query_quota: 0,
                    ..fine()
                },
            ),
            ("path_set", settings("bounces=0..64")),
            (
                "final_gather",
                PhotonSettings {
                    final_gather: true,
                    direct_photons: true,
                    ..fine()
                },
            ),
        ];
        for (wanted, settings) in cases {
            match refuse(settings) {
                Error::Setting { name, .. } => assert_eq!(name, wanted),
                other => panic!("{wanted}: {other}"),
            }
        }
        // A long range of bounces beside an expression, and an expression behind a final gather.
        let gathered = PhotonSettings {
            final_gather: true,
            ..settings("LS+DE")
        };
        for (settings, words) in [
            (settings("bounces=0..50,L[^S]*E"), "counts more bounces"),
            (gathered, "final gather"),
        ] {
            let set = settings.path_set;
            let error = refuse(settings);
            assert!(matches!(&error, Error::Unsupported { .. }), "{set}: {error}");
            let text = error.to_string();
            assert!(
                text.contains("range of bounces") && text.contains(words),
                "{set}: {text}"
            );
        }
    });
}
