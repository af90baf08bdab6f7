//! Scenes that keep their instances: pictures against those of flattened ones, instances that move, meshes that are refitted, and memory.

use std::sync::Arc;

use clerestory::accel::IndexKind;
use clerestory::accel::two_level::{INSTANCE_BYTES, TwoLevelWork};
use clerestory::gpu::Gpu;
use clerestory::render::{RenderOptions, Rendered as Report, Renderer, RendererDesc};
use clerestory::scene::{AlphaMode, Camera, Instance, Material, Mesh, Scene};
use clerestory::settings::Settings;
use clerestory::techniques::{self, PathTracer, PathTracerSettings, View};
use clerestory::transport::GpuScene;
use clerestory::{Error, Result};
use clerestory_tests::random::Random;
use clerestory_tests::render::{Rendered, builtin, finish, independent, tracer_of};
use clerestory_tests::with_gpu;
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec2, Vec3};

/// Iterations at which rays among prisms stop, the least that there is.
const SMALL_QUOTA: u32 = 128;

/// A leaning prism with coordinates of few bits, so that images under [`exact`] transforms have no rounding.
fn prism(material: u32) -> Mesh {
    let corner = |x: f32, y: f32, z: f32| Vec3::new(x, y, z) / 64.0;
    Mesh {
        positions: vec![
            corner(-9.0, 0.0, -7.0),
            corner(11.0, 0.0, -5.0),
            corner(0.0, 0.0, 9.0),
            corner(-3.0, 23.0, -6.0),
            corner(9.0, 19.0, 2.0),
            corner(1.0, 27.0, 6.0),
        ],
        uv0: (0..6)
            .map(|i| Vec2::new(0.3 * i as f32, 0.5 - 0.1 * i as f32))
            .collect(),
        triangles: vec![
            [0, 1, 2],
            [3, 5, 4],
            [0, 4, 1],
            [0, 3, 4],
            [1, 5, 2],
            [1, 4, 5],
            [2, 3, 0],
            [2, 5, 3],
        ],
        material: Some(material),
        ..Mesh::default()
    }
}

/// Turns by right angles, mirrors, and scales by powers of two, to a place in 64ths.
fn exact(i: i32) -> DAffine3 {
    let turn = match i % 4 {
        0 => DMat3::IDENTITY,
        1 => DMat3::from_cols(DVec3::Z, DVec3::Y, -DVec3::X),
        2 => DMat3::from_cols(DVec3::X, DVec3::Y, -DVec3::Z),
        _ => DMat3::from_cols(DVec3::Y, DVec3::X, DVec3::Z) * 0.5,
    };
    let translation = DVec3::new(
        f64::from(i % 5 - 2) * 26.0,
        f64::from(i % 3),
        f64::from(i / 5 - 2) * 22.0,
    ) / 64.0;
    DAffine3::from_mat3_translation(turn, translation)
}

fn camera() -> Camera {
    Camera::look_at("main", DVec3::new(0.6, 1.6, 2.2), DVec3::ZERO, DVec3::Y, 0.7)
}

/// Prisms on a floor below a lamp, and prisms that shine.
fn prisms() -> Scene {
    let mut scene = Scene {
        name: "prisms".into(),
        cameras: vec![camera()],
        ..Scene::default()
    };
    let stone = scene.add_material(Material::lambert("stone", Vec3::new(0.7, 0.5, 0.3)));
    let ground = scene.add_material(Material::lambert("floor", Vec3::splat(0.6)));
    let lamp = scene.add_material(Material {
        emission: Vec3::splat(4.0),
        ..Material::lambert("lamp", Vec3::ZERO)
    });
    let square = |material: u32, half: f32, height: f32| Mesh {
        positions: [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, z)| Vec3::new(half * x, height, half * z))
            .into(),
        triangles: vec![[0, 2, 1], [0, 3, 2]],
        material: Some(material),
        ..Mesh::default()
    };
    scene.place(square(ground, 2.0, -0.25));
    let stones = scene.add_mesh(prism(stone));
    let lamps = scene.add_mesh(prism(lamp));
    for i in 0..25 {
        scene.instances.push(Instance {
            mesh: if i % 7 == 3 { lamps } else { stones },
            transform: exact(i),
            name: String::new(),
        });
        if i == 12 {
            // Between the instances, and flattened.
            scene.place(square(lamp, 0.5, 2.0));
        }
    }
    scene
}

fn uploaded(gpu: &Gpu, scene: &Scene, index: &str) -> Arc<GpuScene> {
    Arc::new(GpuScene::with_index(gpu, scene, &index.parse().unwrap()).unwrap())
}

fn picture(gpu: &Gpu, scene: &Scene, on_device: &Arc<GpuScene>, settings: &PathTracerSettings, spp: u32) -> Rendered {
    finish(
        &mut tracer_of(gpu, on_device, &scene.cameras[0], [32, 24], settings),
        spp,
    )
}

#[test]
fn instances_without_rounding_have_the_pictures_of_flattened_ones() {
    with_gpu(|gpu| {
        let plain = prisms();
        let mut thin = prisms();
        for material in &mut thin.materials {
            material.base_color.w = 0.5;
            material.alpha_mode = AlphaMode::Blend;
        }
        for (what, scene) in [("plain", &plain), ("thin", &thin)] {
            let truth = picture(
                gpu,
                scene,
                &uploaded(gpu, scene, "bvh2"),
                &PathTracerSettings::default(),
                2,
            );
            assert!(truth.mean()[0].0 > 0.0, "{what}: dark");
            let kept = uploaded(gpu, scene, "two-level");
            assert!(kept.profile().keeps_instances && kept.bounds() == uploaded(gpu, scene, "bvh2").bounds());
            for ray_quota in [32_768, SMALL_QUOTA] {
                let settings = PathTracerSettings {
                    ray_quota,
                    ..PathTracerSettings::default()
                };
                let found = picture(gpu, scene, &kept, &settings, 2);
                assert!(found.bits() == truth.bits(), "{what}, quota {ray_quota}");
            }
        }
    });
}

/// The layer of a picture by a technique.
fn by_technique(gpu: &Gpu, scene: &Scene, technique: &str, index: &str) -> Result<Report> {
    let desc = RendererDesc {
        index: index.parse()?,
        ..RendererDesc::default()
    };
    Renderer::with(gpu, scene, &desc)?.render(&RenderOptions {
        technique: Some(technique.into()),
        size: [16, 12],
        spp: 2,
        ..RenderOptions::default()
    })
}

/// Techniques that draw triangle by triangle, and refuse scenes that keep their instances.
const DRAWN: [&str; 5] = ["preview", "many-light", "impostor", "localized-gather", "ray-bundles"];

#[test]
fn other_techniques_render_kept_instances_or_refuse_them() {
    with_gpu(|gpu| {
        let mut sky = prisms();
        for material in &mut sky.materials {
            material.emission = Vec3::ZERO;
        }
        sky.environment = builtin("builtin:white-furnace").environment;
        let values = |report: &Report| report.picture.layer("radiance").unwrap().values().to_vec();
        let lamps = prisms();
        let all = techniques::all().iter().map(|card| card.id);
        let kept = all.filter(|technique| !DRAWN.contains(technique));
        for (technique, scene) in kept.flat_map(|technique| [(technique, &lamps), (technique, &sky)]) {
            let [truth, found] = ["wide", "two-level"].map(|index| by_technique(gpu, scene, technique, index));
            match (truth, found) {
                (Ok(truth), Ok(found)) => {
                    assert_eq!(found.report.index.kind, "two-level");
                    assert!(values(&found).iter().any(|v| *v > 0.0), "{technique}: dark");
                    assert!(values(&found) == values(&truth), "{technique}");
                }
                // A device that cannot run it, or a scene that it cannot model.
                (Err(truth), Err(found)) => assert_eq!(truth.to_string(), found.to_string()),
                other => panic!("{technique}: {other:?}"),
            }
        }
        let mut lit = sky.clone();
        lit.environment = None;
        lit.add_light(
            "lamp",
            clerestory::scene::LightKind::Point {
                position: Vec3::new(0.0, 2.0, 0.5),
                intensity: Vec3::ONE,
            },
        );
        for technique in DRAWN {
            let refused = by_technique(gpu, &lit, technique, "two-level").unwrap_err();
            let Error::Unsupported { reasons, .. } = &refused else {
                panic!("{refused}");
            };
            assert!(
                reasons.iter().any(|why| why.contains("keeps its instances")),
                "{refused}"
            );
        }
    });
}

/// Smooth, textured instances in any position.
fn smooth() -> Scene {
    let mut scene = builtin("builtin:forest?trees=1&instances=0");
    let mut random = Random(64);
    scene.meshes.clear();
    scene.instances.clear();
    let glossy = scene.add_material(Material {
        roughness: 0.4,
        metallic: 0.5,
        ..Material::lambert("glossy", Vec3::new(0.8, 0.4, 0.2))
    });
    let mut ball = Mesh {
        material: Some(glossy),
        ..Mesh::default()
    };
    let (rings, slices) = (9u32, 14u32);
    for ring in 0..=rings {
        for slice in 0..slices {
            let theta = std::f32::consts::PI * ring as f32 / rings as f32;
            let phi = std::f32::consts::TAU * slice as f32 / slices as f32;
            let p = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            ball.positions.push(0.2 * p);
            ball.normals.push(p.normalize());
            ball.colors.push((0.5 + 0.5 * p).extend(1.0));
        }
    }
    for ring in 0..rings {
        for slice in 0..slices {
            let next = (slice + 1) % slices;
            let [a, b] = [slice, next].map(|s| ring * slices + s);
            ball.triangles.push([a, b, a + slices]);
            ball.triangles.push([b, b + slices, a + slices]);
        }
    }
    let mesh = scene.add_mesh(ball);
    for i in 0..30 {
        let scale = [DVec3::ONE, DVec3::new(-1.0, 1.5, 0.7)][i % 2];
        let axis = random.direction().as_dvec3().normalize();
        let turn = DQuat::from_axis_angle(axis, 3.0 * f64::from(random.signed()));
        scene.instances.push(Instance {
            mesh,
            transform: DAffine3::from_mat3_translation(
                DMat3::from_quat(turn) * DMat3::from_diagonal(scale),
                random.vector().as_dvec3(),
            ),
            name: String::new(),
        });
    }
    scene.cameras = vec![camera()];
    scene
}

#[test]
fn normals_and_colours_of_instances_are_those_of_flattened_ones() {
    with_gpu(|gpu| {
        let scene = smooth();
        let [flat, kept] = [("wide", 7), ("two-level", 8)].map(|(index, seed)| {
            let settings = PathTracerSettings { seed, ..independent() };
            picture(gpu, &scene, &uploaded(gpu, &scene, index), &settings, 256)
        });
        kept.expect_same_as("instances", &flat.radiance, &flat.variance);
    });
}

#[test]
fn moved_instances_and_refitted_meshes_are_as_if_made_so() {
    with_gpu(|gpu| {
        let mut scene = prisms();
        // Of any length.
        scene.meshes[1].normals = scene.meshes[1]
            .positions
            .iter()
            .map(|p| 7.0 * *p - Vec3::new(0.1, 0.9, 0.2))
            .collect();
        let scene = scene;
        let kept = uploaded(gpu, &scene, "two-level");
        let settings = PathTracerSettings::default();
        let built = TwoLevelWork {
            // What is flattened, and the stones.
            meshes: 2,
            refits: 0,
            tops: 1,
        };
        assert_eq!(kept.index_work(), Some(built));
        let before = picture(gpu, &scene, &kept, &settings, 2);
        let mut moved = scene.clone();
        // The first is the floor; two change places, one is mirrored.
        let moves = [
            (1, exact(1)),
            (2, exact(0)),
            (6, exact(5) * DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0))),
        ];
        for (object, transform) in moves {
            moved.instances[object].transform = transform;
        }
        kept.move_instances(gpu, &moves).unwrap();
        assert_eq!(kept.index_work(), Some(TwoLevelWork { tops: 2, ..built }));
        let found = picture(gpu, &scene, &kept, &settings, 2);
        let made_so = uploaded(gpu, &moved, "two-level");
        let truth = picture(gpu, &moved, &made_so, &settings, 2);
        assert!(found.bits() == truth.bits() && found.bits() != before.bits());
        assert_eq!(kept.index_statistics(), made_so.index_statistics());
        assert_eq!(kept.index_report().statistics, made_so.index_statistics());
        let mut shape = moved.meshes[1].clone();
        shape.positions[5] -= Vec3::new(2.0, 6.0, 1.0) / 64.0;
        shape.normals[4] *= Vec3::new(-1.0, 3.0, 2.0);
        moved.meshes[1] = shape.clone();
        kept.refit_mesh(gpu, &scene, 1, &shape).unwrap();
        let now = TwoLevelWork {
            refits: 1,
            tops: 3,
            ..built
        };
        assert_eq!(kept.index_work(), Some(now));
        let found = picture(gpu, &moved, &kept, &settings, 2);
        let truth = picture(gpu, &moved, &uploaded(gpu, &moved, "two-level"), &settings, 2);
        assert!(found.bits() == truth.bits());
        let far = DAffine3::from_translation(DVec3::X * 100.0);
        let mut no_normals = shape.clone();
        no_normals.normals[2].y = f32::NAN;
        for refused in [
            kept.move_instances(gpu, &[(0, DAffine3::IDENTITY)]),
            kept.move_instances(gpu, &[(4, exact(3))]),
            kept.move_instances(gpu, &[(1, far)]),
            kept.move_instances(gpu, &[(99, exact(3))]),
            kept.refit_mesh(gpu, &scene, 0, &scene.meshes[0]),
            kept.refit_mesh(gpu, &scene, 1, &scene.meshes[0]),
            kept.refit_mesh(gpu, &scene, 1, &no_normals),
            kept.move_object(gpu, &scene, 1, exact(3)),
            uploaded(gpu, &scene, "wide").move_instances(gpu, &moves),
        ] {
            assert!(matches!(refused, Err(Error::Setting { .. })), "{refused:?}");
        }
        assert_eq!(kept.index_work(), Some(now), "what is refused makes nothing");
    });
}

/// Flattened scenes: what is drawn follows at once, and rays once the index is refitted, with the bits of a scene that was made so.
#[test]
fn rays_follow_moved_objects_after_a_refit() {
    with_gpu(|gpu| {
        let scene = prisms();
        let mut moved = scene.clone();
        // Above all others, where nothing stands.
        let free = DAffine3::from_translation(DVec3::new(0.25, 0.375, 0.5));
        moved.instances[1].transform = free;
        let settings = PathTracerSettings::default();
        for index in ["wide", "wide-device"] {
            let on_device = uploaded(gpu, &scene, index);
            let before = picture(gpu, &scene, &on_device, &settings, 2);
            on_device.move_object(gpu, &scene, 1, free).unwrap();
            on_device.refit_index(gpu).unwrap();
            let found = picture(gpu, &scene, &on_device, &settings, 2);
            let truth = picture(gpu, &moved, &uploaded(gpu, &moved, index), &settings, 2);
            assert!(found.bits() == truth.bits() && found.bits() != before.bits(), "{index}");
            // Of a scene where nothing has moved since: the same tree.
            on_device.refit_index(gpu).unwrap();
            assert!(
                picture(gpu, &scene, &on_device, &settings, 2).bits() == truth.bits(),
                "{index}"
            );
        }
        for index in ["bvh2", "two-level"] {
            let refused = uploaded(gpu, &scene, index).refit_index(gpu);
            assert!(matches!(refused, Err(Error::Setting { .. })), "{index}: {refused:?}");
        }
        // Nothing to meet.
        let empty = Scene {
            instances: Vec::new(),
            meshes: Vec::new(),
            ..scene
        };
        uploaded(gpu, &empty, "wide").refit_index(gpu).unwrap();
    });
}

/// Walks from the lights follow what moves, as eye paths do.
#[test]
fn virtual_lights_and_light_subpaths_follow_moved_instances() {
    with_gpu(|gpu| {
        let scene = prisms();
        let mut moved = scene.clone();
        let moves = [
            (1, exact(1)),
            (2, exact(0)),
            (6, exact(5) * DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0))),
        ];
        for (object, transform) in moves {
            moved.instances[object].transform = transform;
        }
        let kept = uploaded(gpu, &scene, "two-level");
        let made_so = uploaded(gpu, &moved, "two-level");
        // A bound by the surfaces' area would depend on the order in which that is summed.
        let bounded = serde_json::json!({ "bound_value": 2.0 });
        for (technique, settings) in [
            ("vpl", Settings::from(bounded)),
            ("bdpt", Settings::default()),
            ("photon", Settings::default()),
        ] {
            let card = techniques::by_id(technique).unwrap();
            let bits = |on_device: &Arc<GpuScene>| {
                let view = View {
                    camera: &scene.cameras[0],
                    size: [16, 12],
                    seed: 3,
                    aovs: false,
                };
                let mut renderer = (card.create)(gpu, Arc::clone(on_device), &view, &settings).unwrap();
                while renderer.step(2).unwrap().is_some() {}
                let (picture, _) = renderer.picture().unwrap();
                let values = picture.layer("radiance").unwrap().values();
                values.iter().map(|v| v.to_bits()).collect::<Vec<_>>()
            };
            kept.move_instances(
                gpu,
                &moves.map(|(object, _)| (object, scene.instances[object].transform)),
            )
            .unwrap();
            let before = bits(&kept);
            kept.move_instances(gpu, &moves).unwrap();
            let found = bits(&kept);
            assert!(found == bits(&made_so), "{technique}");
            assert!(found != before, "{technique}");
        }
    });
}

/// Octahedra in a row along x, each turned about y.
fn octahedra(turns: [f64; 3]) -> Scene {
    let mut scene = Scene {
        name: "octahedra".into(),
        cameras: vec![camera()],
        ..Scene::default()
    };
    let stone = scene.add_material(Material::lambert("stone", Vec3::splat(0.5)));
    let mesh = scene.add_mesh(Mesh {
        positions: vec![Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z],
        triangles: [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2]]
            .into_iter()
            .flat_map(|[a, b, c]| [[a, b, c], [b, a, 5]])
            .collect(),
        material: Some(stone),
        ..Mesh::default()
    });
    for (i, turn) in (0..).zip(turns) {
        scene.instances.push(Instance {
            mesh,
            transform: DAffine3::from_rotation_translation(
                DQuat::from_rotation_y(turn.to_radians()),
                DVec3::X * 3.0 * f64::from(i),
            ),
            name: String::new(),
        });
    }
    scene
}

#[test]
fn moves_are_held_against_the_box_by_their_triangles() {
    with_gpu(|gpu| {
        let at = |scene: &Scene, object: usize, turn: f64, way: f64| {
            let turned = DAffine3::from_quat(DQuat::from_rotation_y(turn));
            let place = scene.instances[object].transform.translation + DVec3::X * way;
            (object, DAffine3::from_translation(place) * turned)
        };
        let scene = octahedra([0.0; 3]);
        let kept = uploaded(gpu, &scene, "two-level");
        assert_eq!(kept.bounds(), [Vec3::splat(-1.0), Vec3::new(7.0, 1.0, 1.0)]);
        // Its loose box is √2 as wide then.
        kept.move_instances(gpu, &[at(&scene, 2, std::f64::consts::FRAC_PI_4, 0.0)])
            .unwrap();
        let refused = kept.move_instances(gpu, &[at(&scene, 2, std::f64::consts::FRAC_PI_4, 0.3)]);
        assert!(
            refused
                .unwrap_err()
                .to_string()
                .starts_with("setting object: 2 would leave")
        );
        // A scene whose own boxes are as loose has no room besides.
        let turned = octahedra([45.0; 3]);
        let kept = uploaded(gpu, &turned, "two-level");
        let work = kept.index_work();
        assert!(kept.bounds()[1].x < 6.8);
        for (object, way) in [(2, 0.5), (0, -0.5)] {
            let refused = kept.move_instances(gpu, &[at(&turned, object, std::f64::consts::FRAC_PI_4, way)]);
            assert!(matches!(refused, Err(Error::Setting { .. })), "{object}");
        }
        let flat = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
        let refused = kept
            .move_instances(gpu, &[at(&turned, 0, std::f64::consts::FRAC_PI_4, 0.5), (1, flat)])
            .unwrap_err();
        assert!(refused.to_string().contains("instances[1].transform"), "{refused}");
        // Shapes likewise.
        let shape = |size: f32| {
            let mut mesh = turned.meshes[0].clone();
            mesh.positions.iter_mut().for_each(|p| *p *= size);
            mesh
        };
        let refused = kept.refit_mesh(gpu, &turned, 0, &shape(1.2)).unwrap_err();
        assert!(
            refused.to_string().starts_with("setting object: 0 would leave"),
            "{refused}"
        );
        let refused = kept.refit_mesh(gpu, &turned, 0, &shape(1e-20)).unwrap_err();
        assert!(refused.to_string().contains("instances[0].transform"), "{refused}");
        assert_eq!(kept.index_work(), work, "what is refused makes nothing");
        kept.refit_mesh(gpu, &turned, 0, &shape(0.999)).unwrap();
    });
}

/// Bytes that the tree over the ground may differ by.
const OTHER_TREE: u64 = 32_768;

/// Bytes of all live allocations.
fn bytes(gpu: &Gpu) -> u64 {
    gpu.memory_report().bytes.iter().map(|(_, bytes)| bytes).sum()
}

#[test]
fn memory_grows_with_meshes_and_little_with_instances() {
    with_gpu(|gpu| {
        let used = |instances: u32| {
            let scene = builtin(&format!("builtin:forest?trees=1&instances={instances}"));
            let before = bytes(gpu);
            let kept = uploaded(gpu, &scene, "two-level");
            let report = kept.index_report();
            assert_eq!(report.statistics.triangles, kept.profile().triangles);
            (
                bytes(gpu) - before,
                report.statistics.bytes,
                kept.index_work().unwrap().meshes,
            )
        };
        let [few, many] = [100, 1100].map(used);
        // What is flattened, four trunks and four crowns.
        assert_eq!((few.2, many.2), (9, 9));
        // The land is larger: as many triangles, in another tree.
        assert!(
            (many.1 - few.1).abs_diff(2000 * INSTANCE_BYTES) < OTHER_TREE,
            "{few:?} {many:?}"
        );
        // A record of 64 bytes each besides, and what allocations are rounded up by.
        assert!(
            many.0 - few.0 <= 2000 * (INSTANCE_BYTES + 64) + 2 * OTHER_TREE,
            "{few:?} {many:?}"
        );
        assert!(many.0 < 2 * few.0, "{few:?} {many:?}");
    });
}

#[test]
fn five_hundred_million_triangles_are_rendered_within_the_baseline() {
    const BUFFER: u64 = 128 << 20;
    with_gpu(|gpu| {
        let scene = builtin("builtin:forest?trees=4&instances=10000");
        let kept = Arc::new(GpuScene::new(gpu, &scene).unwrap());
        let report = kept.index_report();
        assert_eq!((report.kind, report.instead_because), ("two-level", None));
        assert!(kept.profile().triangles > 500_000_000);
        assert!(gpu.allocations().iter().all(|allocation| allocation.bytes <= BUFFER));
        let mut tracer =
            PathTracer::new(gpu, kept, &scene.cameras[0], [24, 16], PathTracerSettings::default()).unwrap();
        let picture = finish(&mut tracer, 1);
        picture.expect_sound("forest", 1);
        assert!(picture.mean()[1].0 > 0.0);
    });
}

#[test]
fn instances_are_kept_where_that_needs_much_less() {
    with_gpu(|gpu| {
        let kind = |address: &str| {
            let scene = builtin(address);
            let on_device = GpuScene::with_index(gpu, &scene, &IndexKind::default()).unwrap();
            let keeps = on_device.profile().keeps_instances;
            assert_eq!(on_device.index_work().is_some(), keeps);
            assert_eq!(on_device.surfaces().triangles == 0, keeps);
            (on_device.index_report().kind, keeps)
        };
        // Below 64 MiB; below eight times; above both.
        assert_eq!(kind("builtin:forest?trees=1&instances=8"), ("wide", false));
        assert_eq!(kind("builtin:forest?trees=60&instances=8"), ("wide", false));
        assert_eq!(kind("builtin:forest?trees=1&instances=60"), ("two-level", true));
        // Nothing to keep: the same tree as the wide one, below one instance.
        let scene = builtin("builtin:cornell-box");
        let alone = uploaded(gpu, &scene, "two-level");
        assert!(!alone.profile().keeps_instances && alone.index_report().kind == "two-level");
        assert_eq!(
            alone.surfaces().triangles,
            uploaded(gpu, &scene, "wide").surfaces().triangles
        );
    });
}
