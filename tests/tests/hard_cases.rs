//! Scenes and settings that break renderers: each gives a right picture, or an error that says what is wrong and where.

use clerestory::Error;
use clerestory::scene::{Camera, Environment, LightKind, Material, Mesh, Scene};
use clerestory::transport::{GpuScene, PathTracer, PathTracerSettings};
use clerestory_tests::render::{
    builtin, camera_down, finish, floor, independent, point_triangle, render, tracer, upload,
};
use clerestory_tests::with_gpu;
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};

const SMALL: [u32; 2] = [16, 16];

/// A closed furnace of radiance 1 everywhere.
fn furnace() -> Scene {
    builtin("builtin:furnace-box?rho=0.5&emission=0.5")
}

/// Settings for the furnace, whose paths carry 2⁻ⁿ after n bounces: without the rare bright samples of early Russian roulette the means of
/// 64 samples are near enough to normal for the test of single pixels.
fn calm() -> PathTracerSettings {
    PathTracerSettings {
        roulette_start: 12,
        ..independent()
    }
}

fn transform(scene: &mut Scene, by: DAffine3) {
    for instance in &mut scene.instances {
        instance.transform = by * instance.transform;
    }
    for camera in &mut scene.cameras {
        camera.transform.translation = by.transform_point3(camera.transform.translation);
    }
}

#[test]
fn closed_rooms_do_not_leak_at_any_scale_or_place() {
    with_gpu(|gpu| {
        for scale in [1e-4, 1.0, 1e5] {
            let mut scene = furnace();
            transform(&mut scene, DAffine3::from_scale(DVec3::splat(scale)));
            let picture = render(gpu, &scene, SMALL, 64, &calm());
            picture.expect_uniform(&format!("scale {scale}"), [1.0; 3], 0.0);
        }
        // Beyond 10⁵ m this degrades: 10⁶ m out coordinates are 1/16 m apart, and rays start up to 0.18 m off the walls of the 2 m room.
        for (distance, bias) in [(1e3, 0.0), (1e5, 0.0), (1e6, 0.02)] {
            let mut scene = furnace();
            transform(
                &mut scene,
                DAffine3::from_translation(DVec3::new(distance, -distance, distance)),
            );
            let picture = render(gpu, &scene, SMALL, 64, &calm());
            picture.expect_uniform(&format!("{distance} m from the origin"), [1.0; 3], bias);
        }
    });
}

#[test]
fn pictures_do_not_depend_on_the_unit_of_length() {
    with_gpu(|gpu| {
        let truth = render(gpu, &builtin("builtin:cornell-box"), SMALL, 256, &independent());
        for scale in [1e-4, 1e5] {
            let mut scene = builtin("builtin:cornell-box");
            transform(&mut scene, DAffine3::from_scale(DVec3::splat(scale)));
            let settings = PathTracerSettings {
                seed: 99,
                ..independent()
            };
            let picture = render(gpu, &scene, SMALL, 256, &settings);
            picture.expect_same_as(&format!("scale {scale}"), &truth.radiance, &truth.variance);
        }
    });
}

#[test]
fn degenerate_and_duplicate_triangles_change_nothing() {
    with_gpu(|gpu| {
        let mut scene = furnace();
        let material = Some(0);
        // Points, lines, repeated vertices, a sliver in the plane of a wall, and every wall a second time.
        scene.place(Mesh {
            name: "degenerate".into(),
            positions: vec![
                Vec3::ZERO,
                Vec3::X,
                Vec3::new(0.5, 0.0, 0.0),
                Vec3::new(1.0, 1e-7, 0.3),
                Vec3::new(1.0, 0.0, -0.3),
            ],
            triangles: vec![[0, 0, 0], [0, 1, 2], [1, 1, 0], [2, 2, 2], [1, 3, 4], [3, 1, 4]],
            material,
            ..Mesh::default()
        });
        let walls = scene.meshes[0].clone();
        scene.place(walls);
        let picture = render(gpu, &scene, SMALL, 64, &calm());
        picture.expect_uniform("degenerate", [1.0; 3], 0.0);
        let statistics = upload(gpu, &scene).index_statistics();
        assert!(statistics.excluded_degenerate >= 4, "{statistics:?}");
    });
}

#[test]
fn cameras_inside_walls_and_at_corners_see_something_finite() {
    with_gpu(|gpu| {
        let scene = furnace();
        let mut at = tracer(gpu, &scene, [8, 8], &independent());
        for eye in [
            DVec3::ONE,
            DVec3::new(1.0, 0.0, 0.0),
            DVec3::new(1.0, 1.0, 0.2),
            DVec3::splat(50.0),
            DVec3::new(-1.0, -1.0, -1.0),
        ] {
            let camera = Camera::look_at("hard", eye, DVec3::new(0.1, 0.2, -0.3), DVec3::Y, 1.0);
            at.set_camera(&camera).unwrap();
            finish(&mut at, 16).expect_sound(&format!("camera at {eye}"), 16);
        }
        // Along an axis, in the plane of two walls.
        let camera = Camera::look_at(
            "edge",
            DVec3::new(1.0, 1.0, 1.0),
            DVec3::new(1.0, 1.0, -1.0),
            DVec3::Y,
            1.0,
        );
        at.set_camera(&camera).unwrap();
        finish(&mut at, 16).expect_sound("along an edge", 16);
    });
}

#[test]
fn pictures_of_every_size_have_all_their_samples() {
    with_gpu(|gpu| {
        let scene = furnace();
        for size in [[1, 1], [17, 3], [1, 65], [63, 1], [7, 9]] {
            for paths_in_flight in [0, 1, 64, 100] {
                let settings = PathTracerSettings {
                    paths_in_flight,
                    ..independent()
                };
                let picture = render(gpu, &scene, size, 5, &settings);
                assert_eq!(picture.counters.paths, u64::from(size[0] * size[1] * 5), "{size:?}");
            }
        }
        let scene = upload(gpu, &scene);
        for size in [[0, 4], [4, 0], [70_000, 70_000]] {
            let made = PathTracer::new(gpu, scene.clone(), &furnace().cameras[0], size, independent());
            assert!(
                matches!(made, Err(Error::Setting { ref name, .. }) if name == "size"),
                "{size:?}"
            );
        }
    });
}

#[test]
fn a_million_samples_of_a_constant_do_not_stall() {
    with_gpu(|gpu| {
        const SAMPLES: u32 = 1_000_000;
        let mut scene = Scene::default();
        // Not a dyadic fraction, so that a plain f32 sum would drift; 10⁶ equal f32 additions of 0.7 end 4 % off.
        let value = 0.7f32;
        let material = scene.add_material(Material {
            unlit: true,
            ..Material::lambert("flat", Vec3::splat(value))
        });
        scene.place(floor("floor", material, 4.0, 0.0));
        scene.cameras.push(camera_down(1.0, 10.0));
        for size in [[1, 1], [2, 2]] {
            let picture = render(gpu, &scene, size, SAMPLES, &independent());
            assert!(
                picture.radiance.iter().all(|v| *v == value),
                "{size:?}: {:?}",
                &picture.radiance[..3]
            );
            assert!(
                picture.variance.iter().all(|v| *v <= 1e-12),
                "{:?}",
                &picture.variance[..3]
            );
        }
    });
}

#[test]
fn scenes_without_light_are_black_and_cost_no_shadow_rays() {
    with_gpu(|gpu| {
        let mut dark = furnace();
        dark.materials[0].emission = Vec3::ZERO;
        let mut empty = Scene {
            name: "empty".into(),
            ..Scene::default()
        };
        empty.cameras = dark.cameras.clone();
        let mut points = empty.clone();
        points.name = "points only".into();
        point_triangle(&mut points, Material::default(), Vec3::ONE);
        for scene in [&dark, &empty, &points] {
            let picture = render(gpu, scene, SMALL, 4, &independent());
            assert!(picture.radiance.iter().all(|v| *v == 0.0), "{}", scene.name);
            assert_eq!(picture.counters.shadow_rays, 0, "{}", scene.name);
        }
        // An empty scene still shows its environment.
        empty.environment = Some(Environment::uniform(Vec3::new(0.25, 0.5, 4.0)));
        let picture = render(gpu, &empty, SMALL, 4, &independent());
        assert!(picture.radiance.chunks(3).all(|p| p == [0.25, 0.5, 4.0]));
    });
}

/// A triangle of a material, with edges along two axes; near `place` only as far as f32 tells them apart.
fn emitting_triangle(scene: &mut Scene, material: &Material, place: Vec3, edge: f32) {
    let material = scene.add_material(material.clone());
    scene.place(Mesh {
        name: "emitter".into(),
        positions: vec![
            place,
            place + edge * Vec3::X + edge * Vec3::X,
            place + edge * Vec3::Z + edge * Vec3::Z,
        ],
        triangles: vec![[0, 1, 2]],
        material: Some(material),
        ..Mesh::default()
    });
}

#[test]
fn lights_without_power_or_area_are_no_lights() {
    with_gpu(|gpu| {
        let mut floor_only = Scene {
            name: "floor".into(),
            ..Scene::default()
        };
        let material = floor_only.add_material(Material::lambert("floor", Vec3::splat(0.5)));
        floor_only.place(floor("floor", material, 4.0, 0.0));
        floor_only.cameras.push(camera_down(1.0, 10.0));

        let mut no_power = floor_only.clone();
        let intensity = Vec3::ZERO;
        no_power.add_light(
            "off",
            LightKind::Point {
                position: Vec3::Y,
                intensity,
            },
        );
        no_power.add_light(
            "off",
            LightKind::Directional {
                direction: Vec3::NEG_Y,
                irradiance: intensity,
            },
        );

        let mut no_area = floor_only.clone();
        let mut emitter = Material::lambert("emitter", Vec3::ZERO);
        emitter.emission = Vec3::splat(1e6);
        point_triangle(&mut no_area, emitter.clone(), Vec3::Y);

        // Corners that f32 holds, but not the edges between them; and a size whose squares vanish.
        let mut no_place = floor_only.clone();
        emitting_triangle(&mut no_place, &emitter, Vec3::splat(-3e38), 3e38);
        let mut no_squares = floor_only.clone();
        emitting_triangle(&mut no_squares, &emitter, Vec3::Y, 1e-30);

        let mut on_the_light = floor_only.clone();
        on_the_light.add_light(
            "in the plane",
            LightKind::Point {
                position: Vec3::ZERO,
                intensity: Vec3::ONE,
            },
        );

        for (what, scene) in [
            ("no power", &no_power),
            ("no area", &no_area),
            ("no place", &no_place),
            ("no squares", &no_squares),
            ("light in the surface", &on_the_light),
        ] {
            let picture = render(gpu, scene, SMALL, 16, &independent());
            assert!(picture.radiance.iter().all(|v| *v == 0.0), "{what}");
        }
        // Both kinds beside a light that shines: only that one is seen, as if the others were not there.
        let mut lit = floor_only;
        lit.add_light(
            "sun",
            LightKind::Directional {
                direction: Vec3::NEG_Y,
                irradiance: Vec3::ONE,
            },
        );
        let alone = render(gpu, &lit, SMALL, 16, &independent());
        lit.add_light(
            "off",
            LightKind::Point {
                position: Vec3::Y,
                intensity,
            },
        );
        emitting_triangle(&mut lit, &emitter, Vec3::splat(-3e38), 3e38);
        point_triangle(&mut lit, emitter, Vec3::Y);
        let picture = render(gpu, &lit, SMALL, 16, &independent());
        assert!(picture.bits() == alone.bits() && alone.mean()[0].0 > 0.1);
    });
}

#[test]
fn extreme_materials_stay_finite() {
    with_gpu(|gpu| {
        let base = Material::default();
        for (what, material) in [
            (
                "grazing metal",
                Material {
                    metallic: 1.0,
                    roughness: 0.0317,
                    ..base.clone()
                },
            ),
            (
                "infinite index",
                Material {
                    metallic: 0.0,
                    ior: 0.0,
                    roughness: 0.3,
                    ..base.clone()
                },
            ),
            (
                "index one",
                Material {
                    roughness: 0.3,
                    ..Material::glass("air", 1.0)
                },
            ),
            (
                "index 100",
                Material {
                    roughness: 0.1,
                    ..Material::glass("dense", 100.0)
                },
            ),
            (
                "black",
                Material {
                    base_color: Vec4::new(0.0, 0.0, 0.0, 1.0),
                    ..base.clone()
                },
            ),
            (
                "opaque at once",
                Material {
                    attenuation_color: Vec3::new(0.0, 1e-30, 1.0),
                    attenuation_distance: 1e-6,
                    ..Material::glass("ink", 1.5)
                },
            ),
        ] {
            let mut scene = builtin("builtin:white-furnace?frequency=4&smooth=yes");
            scene.materials[0] = material;
            let picture = render(gpu, &scene, SMALL, 64, &calm());
            for (mean, variance) in picture.mean() {
                // The albedo table's interpolation may gain 5·10⁻³ (transport/bsdf/tests.rs).
                assert!(mean <= 1.005 + 4.9 * variance.sqrt(), "{what}: {mean}");
            }
        }
    });
}

/// A scene after one change, and the place that its refusal has to name.
type Fault = (&'static str, Box<dyn Fn(&mut Scene)>);

#[test]
fn attributes_that_are_not_numbers_are_refused_with_their_place() {
    with_gpu(|gpu| {
        let faults: Vec<Fault> = vec![
            ("meshes[0]", Box::new(|s| s.meshes[0].positions[1].y = f32::NAN)),
            ("meshes[0]", Box::new(|s| s.meshes[0].positions[2].x = f32::INFINITY)),
            (
                "meshes[0]",
                Box::new(|s| s.meshes[0].normals = vec![Vec3::NAN; s.meshes[0].positions.len()]),
            ),
            ("meshes[0]", Box::new(|s| s.meshes[0].normals = vec![Vec3::Y])),
            (
                "meshes[0]",
                Box::new(|s| s.meshes[0].uv0 = vec![Vec2::NAN; s.meshes[0].positions.len()]),
            ),
            (
                "meshes[0]",
                Box::new(|s| s.meshes[0].colors = vec![Vec4::NAN; s.meshes[0].positions.len()]),
            ),
            ("meshes[0]", Box::new(|s| s.meshes[0].triangles[0][1] = 1_000_000)),
            (
                "instances[0].transform",
                Box::new(|s| s.instances[0].transform.translation.z = f64::NAN),
            ),
            ("instances[0].mesh", Box::new(|s| s.instances[0].mesh = 9)),
            ("materials[0]", Box::new(|s| s.materials[0].emission.x = f32::NAN)),
            ("materials[0]", Box::new(|s| s.materials[0].roughness = f32::NAN)),
            ("materials[0]", Box::new(|s| s.materials[0].base_color.z = -1.0)),
            (
                "lights[0]",
                Box::new(|s| {
                    s.add_light(
                        "bad",
                        LightKind::Point {
                            position: Vec3::NAN,
                            intensity: Vec3::ONE,
                        },
                    )
                }),
            ),
            (
                "cameras[0]",
                Box::new(|s| s.cameras[0].transform.translation.x = f64::NAN),
            ),
            (
                "environment",
                Box::new(|s| s.environment = Some(Environment::uniform(Vec3::splat(f32::NAN)))),
            ),
        ];
        for (place, change) in faults {
            let mut scene = furnace();
            change(&mut scene);
            match GpuScene::new(gpu, &scene) {
                Err(Error::Scene { at, cause, .. }) => {
                    assert!(at.contains(place) && !cause.is_empty(), "{at}: {cause}")
                }
                other => panic!("{place}: {other:?}"),
            }
        }
    });
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    with_gpu(|gpu| {
        let scene = furnace();
        let uploaded = upload(gpu, &scene);
        let fine = PathTracerSettings::default;
        for (wanted, settings) in [
            (
                "roulette_cap",
                PathTracerSettings {
                    roulette_cap: 0.0,
                    ..fine()
                },
            ),
            (
                "roulette_cap",
                PathTracerSettings {
                    roulette_cap: f32::NAN,
                    ..fine()
                },
            ),
            (
                "roulette_cap",
                PathTracerSettings {
                    roulette_cap: 1.5,
                    ..fine()
                },
            ),
            ("ray_quota", PathTracerSettings { ray_quota: 0, ..fine() }),
            (
                "ray_quota",
                PathTracerSettings {
                    ray_quota: 65_536,
                    ..fine()
                },
            ),
            (
                "paths_in_flight",
                PathTracerSettings {
                    paths_in_flight: u32::MAX,
                    ..fine()
                },
            ),
        ] {
            match PathTracer::new(gpu, uploaded.clone(), &scene.cameras[0], SMALL, settings) {
                Err(Error::Setting { name, .. }) => assert_eq!(name, wanted),
                other => panic!("{wanted}: {}", other.is_ok()),
            }
        }
        let mut camera = scene.cameras[0].clone();
        camera.lens_radius = f32::NAN;
        assert!(PathTracer::new(gpu, uploaded, &camera, SMALL, fine()).is_err());
    });
}
