//! Pictures against the path tracer's.

use super::*;
use clerestory::scene::AlphaMode;
use clerestory::techniques::photon_mapping::{PhotonMapper, PhotonSettings};

const SAMPLES: u32 = 128;

/// All but lamps that the camera sees itself, whose outlines are rare and bright in pixels that they barely touch.
fn expect_agreement(gpu: &Gpu, scene: &Scene, samples: u32, reference: u32) {
    let settings = BidirectionalSettings {
        least_bounces: 1,
        ..settings()
    };
    let found = passes(gpu, scene, &settings, samples);
    found.expect_same_as(&scene.name, &traced(gpu, scene, "bounces=1..", reference));
}

/// Its radiance is one everywhere, by a geometric series of reflections, whichever way each of its paths is made.
#[test]
fn lights_in_a_lambert_sphere_fill_it_evenly() {
    with_gpu(|gpu| {
        // Facets: their distance from the centre and their angle to it vary by squares of the edge (1.1/48 m), as does the irradiance.
        let facets = (1.11f64 / 48.0).powi(2);
        // No camera ray meets the light.
        for light in ["point", "area&radius=0.3"] {
            let scene = builtin(&format!("builtin:sphere-light?rho=0.7&light={light}"));
            for means in passes(gpu, &scene, &settings(), SAMPLES).means {
                expect_mean_of(light, &means, 1.0, 0.0, facets);
            }
        }
    });
}

/// A lamp on the ceiling, and one that hangs in the room and shines on all sides.
#[test]
fn lamps_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        expect_agreement(gpu, &builtin("builtin:cornell-box"), SAMPLES, 2048);
        let mut hanging = room();
        hanging.name = "hanging lamp".into();
        add_lamp(&mut hanging, 3.0);
        expect_agreement(gpu, &hanging, SAMPLES, 2048);
    });
}

/// As they are by default, in which samples of a pixel are not independent, and with more connections: by means over pictures of other seeds.
#[test]
fn defaults_and_more_connections_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        let mut scene = room();
        add_lamp(&mut scene, 3.0);
        add_point(&mut scene, Vec3::new(0.3, 0.4, -0.1), 1.0);
        let reference = traced(gpu, &scene, "bounces=1..", 4096).mean();
        for connections in [1, 4] {
            let settings = BidirectionalSettings {
                least_bounces: 1,
                connections,
                ..BidirectionalSettings::default()
            };
            let mut renderer = renderer(gpu, &scene, SIZE, &settings);
            let pictures: Vec<Vec<f32>> = (1..=BLOCKS)
                .map(|seed| {
                    renderer.restart(seed).expect("seed");
                    let [radiance, _] = advance(&mut renderer, 16);
                    radiance
                })
                .collect();
            for (channel, (expected, variance)) in reference.into_iter().enumerate() {
                let means: Vec<f64> = pictures.iter().map(|picture| mean(picture, channel)).collect();
                let what = format!("{connections} connections, channel {channel}");
                expect_mean_of(&what, &means, expected, variance.sqrt(), 0.0);
            }
        }
    });
}

#[test]
fn lights_without_area_and_skies_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        let mut scene = room();
        scene.name = "point and spot".into();
        add_point(&mut scene, Vec3::new(0.3, 0.4, -0.1), 1.0);
        scene.add_light(
            "spot",
            LightKind::Spot {
                position: Vec3::new(-0.5, 0.9, 0.5),
                direction: Vec3::new(0.3, -1.0, -0.2).normalize(),
                intensity: Vec3::splat(2.0),
                inner: 0.3,
                outer: 0.7,
            },
        );
        expect_agreement(gpu, &scene, SAMPLES, 2048);
        let mut open = builtin("builtin:materials?slices=8");
        open.name = "sky and sun".into();
        let matte = open.add_material(Material::lambert("matte", Vec3::new(0.6, 0.5, 0.4)));
        open.meshes.iter_mut().for_each(|mesh| mesh.material = Some(matte));
        open.add_light(
            "sun",
            LightKind::Directional {
                direction: Vec3::new(0.4, -1.0, -0.3).normalize(),
                irradiance: Vec3::splat(1.0),
            },
        );
        open.cameras[0].lens_radius = 0.0;
        expect_agreement(gpu, &open, SAMPLES, 4096);
    });
}

/// Mirrors, glass and its caustic, a rough metal with interpolated normals, coats, and panes that are there in part or let light through.
#[test]
fn materials_of_all_kinds_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        let mut spheres = room();
        spheres.name = "spheres".into();
        add_lamp(&mut spheres, 3.0);
        for (kind, x) in [("mirror", -0.6), ("glass", 0.0), ("gold", 0.6)] {
            add_sphere(&mut spheres, kind, DVec3::new(x, -0.6, 0.3));
        }
        for material in spheres.materials.iter_mut().filter(|m| m.conductor.is_some()) {
            material.roughness = material.roughness.max(0.5);
        }
        expect_agreement(gpu, &spheres, SAMPLES, 4096);
        let mut panes = room();
        panes.name = "panes".into();
        add_lamp(&mut panes, 3.0);
        let coated = panes.add_material(Material {
            specular: 1.0,
            roughness: 0.5,
            ..Material::lambert("coated", Vec3::new(0.2, 0.3, 0.6))
        });
        let polished = panes.add_material(Material {
            specular: 1.0,
            roughness: 0.0,
            ..Material::lambert("polished", Vec3::new(0.6, 0.3, 0.2))
        });
        let blended = panes.add_material(Material {
            base_color: Vec3::new(0.8, 0.7, 0.2).extend(0.5),
            alpha_mode: AlphaMode::Blend,
            ..Material::lambert("blended", Vec3::ONE)
        });
        let frosted = panes.add_material(Material {
            transmission: 0.8,
            roughness: 0.6,
            specular: 1.0,
            ..Material::lambert("frosted", Vec3::splat(0.9))
        });
        let solid = panes.add_material(Material {
            transmission: 0.7,
            thickness: 0.1,
            roughness: 0.0,
            specular: 1.0,
            ..Material::lambert("solid", Vec3::new(0.9, 0.8, 0.9))
        });
        for (name, material, x) in [
            ("coated", coated, -0.9),
            ("polished", polished, -0.5),
            ("blended", blended, -0.1),
            ("frosted", frosted, 0.25),
            ("solid", solid, 0.6),
        ] {
            let lower = Vec3::new(x, -0.9, 0.2);
            panes.place(cuboid(name, material, lower, lower + Vec3::new(0.25, 1.2, 0.05)));
        }
        expect_agreement(gpu, &panes, SAMPLES, 4096);
    });
}

/// Light is absorbed on all ways through a body, also on the first one of a light that is inside.
#[test]
fn bodies_that_absorb_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        let mut scene = room();
        scene.name = "tinted body".into();
        add_lit_body(&mut scene, 2.0);
        // Light that goes through the rough surface beside the lamp is rare and bright.
        expect_agreement(gpu, &scene, 8 * SAMPLES, 16_384);
    });
}

/// A caustic of a point light, which no eye path finds: what photons bring there, blurred over their kernels, is what light subpaths bring.
#[test]
fn caustics_of_a_point_are_the_photon_maps() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:cornell-box?source=point&sphere=glass&boxes=none");
        let blind = traced(gpu, &scene, "bounces=1..", 1024).radiance;
        let own = passes(gpu, &scene, &settings(), 512).radiance;
        let photons = PhotonSettings {
            path_set: "bounces=1..".parse().expect("path set"),
            photons: 1 << 17,
            samples_per_pass: 32,
            seed: 5,
            ..PhotonSettings::default()
        };
        let mut mapper = match PhotonMapper::new(gpu, upload(gpu, &scene), &scene.cameras[0], SIZE, photons) {
            Ok(mapper) => mapper,
            Err(error) => panic!("{error}"),
        };
        let [mapped, _] = advance(&mut mapper, 128);
        // Where the map has far more than paths from the eye have.
        let sums = |values: &[f32]| -> f64 {
            let triples = mapped.iter().zip(&blind).zip(values);
            let caustic = triples.filter(|((map, blind), _)| **map > 1.5 * **blind);
            caustic.map(|(_, value)| f64::from(*value)).sum()
        };
        let [caustic, missed, found] = [sums(&mapped), sums(&blind), sums(&own)];
        println!("{caustic} by photons, {missed} by eye paths, {found} by both ends");
        assert!(caustic > 0.0 && missed < 0.6 * caustic, "{caustic} {missed}");
        assert!((found / caustic - 1.0).abs() < 0.1, "{found} instead of {caustic}");
    });
}
