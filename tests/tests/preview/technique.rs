//! The preview as a technique: its frames add up to the path tracer's picture of its light paths, but for what its bias names.

use clerestory::gpu::Category;
use clerestory::render::{RenderOptions, Rendered, Renderer};
use clerestory::scene::{Camera, Environment, LightKind, Material, Scene};
use clerestory::{Error, techniques};
use clerestory_hard_cases::scenes::{cuboid, floor};
use clerestory_tests::render::{builtin, camera_aslant};
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec3};
use serde_json::{Value, json};

const SIZE: [u32; 2] = [32, 32];

fn rendered(renderer: &Renderer, technique: &str, settings: Value, spp: u32) -> Rendered {
    let options = RenderOptions {
        technique: Some(technique.into()),
        size: SIZE,
        spp,
        settings: settings.into(),
        ..RenderOptions::default()
    };
    renderer
        .render(&options)
        .unwrap_or_else(|error| panic!("{technique}: {error}"))
}

fn radiance(rendered: &Rendered) -> &[f32] {
    rendered.picture.layer("radiance").unwrap().values()
}

/// A block on a floor before a distant wall, through a lens that is wide open.
fn block() -> Scene {
    let mut scene = Scene::default();
    let matte = scene.add_material(Material::lambert("matte", Vec3::new(0.7, 0.5, 0.3)));
    scene.place(floor("floor", matte, 3.0, 0.0));
    scene.place(cuboid(
        "block",
        matte,
        Vec3::new(-0.3, 0.0, -0.3),
        Vec3::new(0.2, 0.5, 0.1),
    ));
    scene.cameras.push(Camera {
        lens_radius: 0.1,
        focus_distance: 1.2,
        ..camera_aslant()
    });
    scene
}

/// Differences of pixels over the mean of all: the median, and the one below which 97 % lie.
fn off(found: &Rendered, expected: &Rendered) -> [f64; 2] {
    let pairs = radiance(found)
        .as_chunks::<3>()
        .0
        .iter()
        .zip(radiance(expected).as_chunks::<3>().0);
    let vector = |pixel: &[f32; 3]| Vec3::from_array(*pixel).as_dvec3();
    let mut off: Vec<f64> = pairs.map(|(a, b)| (vector(a) - vector(b)).length()).collect();
    off.sort_by(f64::total_cmp);
    let all = radiance(expected);
    let mean = all.iter().map(|value| f64::from(*value)).sum::<f64>() / all.len() as f64;
    [0.5, 0.97].map(|share| off[(share * off.len() as f64) as usize] / mean)
}

#[test]
fn pictures_come_to_be_the_path_tracers() {
    with_gpu(|gpu| {
        let mut lit = block();
        lit.add_light(
            "lamp",
            LightKind::Point {
                position: Vec3::new(-0.8, 1.2, 0.6),
                intensity: Vec3::new(3.0, 2.5, 2.0),
            },
        );
        lit.add_light(
            "sun",
            LightKind::Directional {
                direction: Vec3::new(-0.4, -1.0, -0.2).normalize(),
                irradiance: Vec3::new(1.0, 1.2, 1.5),
            },
        );
        let renderer = Renderer::new(gpu, &lit).unwrap();
        let paths = techniques::by_id("preview").unwrap().path_set.to_string();
        assert_eq!(paths, "bounces=0..1");
        let expected = rendered(&renderer, "path", json!({"path_set": paths}), 256);
        let found = rendered(&renderer, "preview", json!({"path_set": paths}), 64);
        assert_eq!(found.report.path_set, expected.report.path_set);
        assert_eq!(found.report.samples, [64; 2]);
        assert_eq!(found.report.counters["lights_drawn"], 2);
        assert_eq!(found.report.counters["frames"], 64);
        let [median, high] = off(&found, &expected);
        // Edges of shadows and of the block are out of focus in both.
        assert!(median < 0.02 && high < 0.15, "{median} {high}");
        // Without frames beside each other there are stairs, and no lens.
        let first = rendered(&renderer, "preview", Value::Null, 1);
        assert!(off(&first, &expected)[1] > 2.0 * high, "{:?}", off(&first, &expected));
        // The same bits again, however many frames a step takes.
        let mut again = renderer
            .start(&RenderOptions {
                technique: Some("preview".into()),
                size: SIZE,
                spp: 5,
                ..RenderOptions::default()
            })
            .unwrap();
        while again.step().unwrap().is_some() {}
        again.set_spp(64);
        while again.step().unwrap().is_some() {}
        assert_eq!(radiance(&again.finish().unwrap()), radiance(&found));
    });
}

/// A sky without occluders: the probe's light is all that there is, through a rotation that the device holds.
#[test]
fn the_environment_is_read_back_as_it_was() {
    with_gpu(|gpu| {
        let mut scene = Scene::default();
        let matte = scene.add_material(Material::lambert("matte", Vec3::splat(0.5)));
        scene.place(floor("floor", matte, 3.0, 0.0));
        scene.environment = Some(Environment {
            rotation: glam::Quat::from_rotation_y(0.7) * glam::Quat::from_rotation_x(0.4),
            strength: 0.5,
            width: 4,
            height: 2,
            radiance: (0..8).map(|i| Vec3::new(i as f32, 1.0, 8.0 - i as f32)).collect(),
            ..Environment::uniform(Vec3::ONE)
        });
        scene.cameras = block().cameras;
        scene.cameras[0].lens_radius = 0.0;
        let renderer = Renderer::new(gpu, &scene).unwrap();
        let read = renderer.gpu_scene().read_environment(gpu).unwrap().unwrap();
        let given = scene.environment.as_ref().unwrap();
        assert!(
            read.rotation.dot(given.rotation).abs() > 1.0 - 1e-6,
            "{:?}",
            read.rotation
        );
        assert!(read.radiance.iter().zip(&given.radiance).all(|(a, b)| *a == *b * 0.5));
        let expected = rendered(&renderer, "path", json!({"path_set": "bounces=0..1"}), 1024);
        let found = rendered(&renderer, "preview", Value::Null, 16);
        let [median, high] = off(&found, &expected);
        assert!(median < 0.03 && high < 0.1, "{median} {high}");
    });
}

#[test]
fn lights_that_move_and_other_cameras_begin_anew() {
    with_gpu(|gpu| {
        let at = |x: f32| LightKind::Point {
            position: Vec3::new(x, 1.2, 0.6),
            intensity: Vec3::ONE,
        };
        let mut scene = block();
        scene.add_light("lamp", at(-0.8));
        let mut moved = scene.clone();
        moved.lights[0].kind = at(0.9);
        moved.cameras[0] = Camera::look_at("other", DVec3::new(-0.6, 1.6, 2.2), DVec3::ZERO, DVec3::Y, 0.7);
        let renderer = Renderer::new(gpu, &scene).unwrap();
        let options = RenderOptions {
            technique: Some("preview".into()),
            size: SIZE,
            spp: 3,
            ..RenderOptions::default()
        };
        let mut rendering = renderer.start(&options).unwrap();
        while rendering.step().unwrap().is_some() {}
        renderer.gpu_scene().move_light(gpu, 0, &at(0.9)).unwrap();
        rendering.set_camera(&moved.cameras[0]).unwrap();
        while rendering.step().unwrap().is_some() {}
        let found = rendering.finish().unwrap();
        let made_there = rendered(&Renderer::new(gpu, &moved).unwrap(), "preview", Value::Null, 3);
        assert_eq!(radiance(&found), radiance(&made_there));
        assert_eq!(found.report.samples, [3; 2]);
    });
}

#[test]
fn scenes_whose_light_it_would_leave_out_are_refused() {
    with_gpu(|gpu| {
        for (address, word) in [
            ("builtin:cornell-box", "surfaces emit light"),
            ("builtin:slab", "transmit"),
            ("builtin:cornell-box?sphere=phong&source=point", "modified Phong"),
            ("builtin:point-in-fog", "media"),
        ] {
            let renderer = Renderer::new(gpu, &builtin(address)).unwrap();
            let options = RenderOptions {
                technique: Some("preview".into()),
                ..RenderOptions::default()
            };
            let error = renderer.start(&options).err().expect("a refusal");
            assert!(matches!(error, Error::Unsupported { .. }), "{error}");
            assert!(error.to_string().contains(word), "{error}");
        }
        let renderer = Renderer::new(gpu, &block()).unwrap();
        for (settings, word) in [
            (json!({"shadow_layout": "sphere"}), "sphere"),
            (json!({"shadows": 3}), "shadows"),
            (json!({"path_set": "all"}), "bounces=0..1"),
        ] {
            let options = RenderOptions {
                technique: Some("preview".into()),
                settings: settings.into(),
                ..RenderOptions::default()
            };
            let error = renderer.start(&options).err().expect("a refusal").to_string();
            assert!(error.contains(word), "{word}: {error}");
        }
    });
}

#[test]
fn each_light_has_a_shadow_map_of_its_kind() {
    with_gpu(|gpu| {
        let directional = LightKind::Directional {
            direction: Vec3::NEG_Y,
            irradiance: Vec3::splat(2.0),
        };
        let point = LightKind::Point {
            position: Vec3::new(-0.8, 1.2, 0.6),
            intensity: Vec3::ONE,
        };
        // Sides of maps tell how many there are.
        for (lights, [placed, suns]) in [
            (vec![directional], [0, 1]),
            (vec![point], [1, 0]),
            (vec![directional, point], [1, 1]),
            (vec![point, directional, point], [2, 1]),
        ] {
            let mut scene = block();
            for light in &lights {
                scene.add_light("light", *light);
            }
            let renderer = Renderer::new(gpu, &scene).unwrap();
            let started = |side: u32| {
                let options = RenderOptions {
                    technique: Some("preview".into()),
                    size: SIZE,
                    settings: json!({ "shadow_side": side }).into(),
                    ..RenderOptions::default()
                };
                let before = gpu.memory_report().of(Category::Light);
                let rendering = renderer.start(&options).unwrap();
                (gpu.memory_report().of(Category::Light) - before, rendering)
            };
            let (small, _) = started(256);
            let (large, _) = started(512);
            assert_eq!(
                large - small,
                (placed + suns) * 4 * (512 * 512 - 256 * 256),
                "{lights:?}"
            );
            let report = rendered(&renderer, "preview", Value::Null, 1).report;
            let is_drawn = report
                .pipelines
                .iter()
                .any(|p| p.shader == "raster/surface_octant.vert");
            assert_eq!(is_drawn, placed > 0, "{lights:?}");
            assert!(report.pipelines.iter().any(|p| p.shader == "raster/surface.frag"));
            for (what, maps) in [("points and spots", placed), ("directional lights", suns)] {
                let what = format!("shadow maps of {what}");
                let is_said = report.skipped.iter().any(|skipped| skipped.what == what);
                assert_eq!(is_said, maps == 0, "{lights:?}");
            }
        }
    });
}
