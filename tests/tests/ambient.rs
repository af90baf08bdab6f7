//! The worked example of CONTRIBUTING.md: technique `ambient`, a frame method in about 150 lines, is right, and is all there is of it.

use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clerestory::Error;
use clerestory::film::PixelFormat;
use clerestory::film::z_test::{RELATIVE_DEVIATION_FLOOR, SIGNIFICANCE, z_test};
use clerestory::gpu::{BufferDesc, Category, DeviceKind, Gpu};
use clerestory::render::{RenderOptions, Rendered, Renderer};
use clerestory::scene::{Camera, Environment, Material, Scene};
use clerestory::settings::Settings;
use clerestory::techniques::ambient::Ambient;
use clerestory::techniques::preview::PreviewSettings;
use clerestory::techniques::{Frame, FrameMethod, FrameTarget, Part, View, by_id};
use clerestory::transport::GpuScene;
use clerestory_hard_cases::scenes::equal_triangles;
use clerestory_hard_cases::{Subject, subjects};
use clerestory_samples::progressive::Progressive;
use clerestory_tests::render::{builtin, camera_aslant, cuboid, floor, floor_from_above, pixel_averages};
use clerestory_tests::with_gpu;
use glam::Vec3;

const PATHS: &str = "LE|LDE";
const SIZE: [u32; 2] = [24, 24];

fn rendered(gpu: &Gpu, scene: &Scene, technique: &str, settings: serde_json::Value, spp: u32) -> Rendered {
    let options = RenderOptions {
        technique: Some(technique.into()),
        size: SIZE,
        spp,
        seed: 3,
        settings: settings.into(),
        ..RenderOptions::default()
    };
    let rendered = Renderer::new(gpu, scene).and_then(|renderer| renderer.render(&options));
    rendered.unwrap_or_else(|error| panic!("{technique}: {error}"))
}

fn values<'a>(rendered: &'a Rendered, layer: &str) -> &'a [f32] {
    rendered.picture.layer(layer).expect("layer").values()
}

/// A floor with blocks of several materials under a blue sky.
fn blocks() -> Scene {
    let mut scene = Scene::default();
    let matte = scene.add_material(Material::lambert("matte", Vec3::new(0.8, 0.5, 0.2)));
    let glossy = scene.add_material(Material {
        metallic: 0.0,
        roughness: 0.3,
        base_color: Vec3::new(0.2, 0.4, 0.7).extend(1.0),
        ..Material::default()
    });
    let half_metal = scene.add_material(Material {
        metallic: 0.5,
        roughness: 0.6,
        ..Material::default()
    });
    scene.place(floor("floor", matte, 1.0, 0.0));
    for (name, material, x) in [("glossy", glossy, -0.6), ("half metal", half_metal, 0.1)] {
        let lower = Vec3::new(x, 0.0, -0.3);
        scene.place(cuboid(name, material, lower, lower + Vec3::new(0.4, 0.5, 0.4)));
    }
    scene.environment = Some(Environment::uniform(Vec3::new(0.5, 0.75, 1.5)));
    scene.cameras.push(Camera {
        lens_radius: 0.02,
        focus_distance: 2.5,
        ..camera_aslant()
    });
    scene
}

#[test]
fn pictures_are_the_path_tracers() {
    with_gpu(|gpu| {
        let mut flat = blocks();
        flat.cameras[0].projection = clerestory::scene::Projection::Orthographic { half_height: 0.9 };
        for scene in [blocks(), flat] {
            let own = rendered(gpu, &scene, "ambient", serde_json::Value::Null, 256);
            let traced = rendered(
                gpu,
                &scene,
                "path",
                serde_json::json!({"path_set": PATHS, "sampler": "pcg"}),
                256,
            );
            assert_eq!(own.report.path_set, traced.report.path_set);
            assert_eq!(own.report.samples, [256; 2]);
            assert_eq!(own.report.non_finite_samples.total(), 0);
            let radiance = [&own, &traced].map(|rendered| values(rendered, "radiance"));
            let variance = [&own, &traced].map(|rendered| values(rendered, "variance"));
            let test = z_test(radiance[0], variance[0], radiance[1], variance[1], SIGNIFICANCE).expect("test");
            // As in `Rendered::expect_same_as`.
            assert!(test.passes() && test.bias_z.abs() < 8.5, "{test}");
        }
    });
}

/// Where nothing is in the way, every sample is albedo × radiance.
#[test]
fn furnaces_have_the_closed_form() {
    with_gpu(|gpu| {
        let albedo = Vec3::new(0.25, 0.5, 1.0);
        let mut scene = floor_from_above(Material::lambert("floor", albedo));
        scene.lights.clear();
        scene.environment = Some(Environment::uniform(Vec3::new(2.0, 1.0, 0.5)));
        let own = rendered(gpu, &scene, "ambient", serde_json::json!({"path_set": PATHS}), 4);
        for pixel in values(&own, "radiance").as_chunks::<3>().0 {
            for found in pixel {
                assert!(
                    (f64::from(*found) - 0.5).abs() < 0.5 * RELATIVE_DEVIATION_FLOOR,
                    "{pixel:?}"
                );
            }
        }
        // At the bottom of a shaft: the form factor of its square opening, in four parts that meet above the point.
        const HALF: f32 = 1.5;
        const HEIGHT: f32 = 6.0;
        let mut shaft = scene.clone();
        for (x, z) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
            let middle = (HALF + 0.1) * Vec3::new(x, 0.0, z);
            let half = Vec3::new(if x == 0.0 { 2.0 } else { 0.1 }, 0.0, if z == 0.0 { 2.0 } else { 0.1 });
            shaft.place(cuboid("wall", 0, middle - half, middle + half + HEIGHT * Vec3::Y));
        }
        let part = |a: f64, b: f64| {
            let half = |a: f64, b: f64| a / a.hypot(1.0) * (b / a.hypot(1.0)).atan();
            (half(a, b) + half(b, a)) / (2.0 * PI)
        };
        let (half, height) = (f64::from(HALF), f64::from(HEIGHT));
        let seen = |x: f64, z: f64| {
            let [left, right, near, far] = [half + x, half - x, half + z, half - z].map(|side| side / height);
            part(left, near) + part(left, far) + part(right, near) + part(right, far)
        };
        let averages = pixel_averages(SIZE[0], 1.0, seen);
        let expected = 0.5 * averages.iter().sum::<f64>() / averages.len() as f64;
        let own = rendered(gpu, &shaft, "ambient", serde_json::Value::Null, 64);
        let radiance = values(&own, "radiance");
        let mean = radiance.iter().map(|value| f64::from(*value)).sum::<f64>() / radiance.len() as f64;
        // 36,864 rays of which one in thirteen escapes: a standard deviation of 2 %, of which five.
        assert!((mean / expected - 1.0).abs() < 0.1, "{mean} instead of {expected}");
    });
}

#[test]
fn other_emitters_are_refused() {
    with_gpu(|gpu| {
        for (scene, word) in [
            (builtin("builtin:cornell-box"), "emitters besides the sky"),
            (builtin("builtin:box-city?n=2"), "not uniform"),
            (builtin("builtin:slab"), "let light through"),
        ] {
            let options = RenderOptions {
                technique: Some("ambient".into()),
                ..RenderOptions::default()
            };
            let renderer = Renderer::new(gpu, &scene).expect("scene");
            let error = renderer.start(&options).err().expect("a refusal");
            assert!(matches!(error, Error::Unsupported { .. }), "{error}");
            assert!(error.to_string().contains(word), "{error}");
        }
        let renderer = Renderer::new(gpu, &blocks()).expect("scene");
        let refused = |settings: Settings| {
            let options = RenderOptions {
                technique: Some("ambient".into()),
                settings,
                ..RenderOptions::default()
            };
            renderer.start(&options).err().expect("a refusal").to_string()
        };
        let error = refused(serde_json::json!({"path_set": "LDE"}).into());
        assert!(error.contains("no others"), "{error}");
        // It has no settings, and takes those of no other technique.
        let error = refused(serde_json::json!({"bogus": 1}).into());
        assert!(
            error.contains("setting bogus: 1") && error.contains("there is none"),
            "{error}"
        );
        let error = refused(Settings::of(PreviewSettings::default()));
        assert!(error.contains("are not the technique's"), "{error}");
    });
}

/// One picture per frame into a recorder of whoever calls, without the engine's film: the sample that the technique adds.
#[test]
fn frames_are_recorded_by_themselves() {
    with_gpu(|gpu| {
        let scene = blocks();
        let on_device = Arc::new(GpuScene::new(gpu, &scene).expect("scene"));
        let mut method = Ambient::new(gpu, on_device).expect("method");
        let falls_in = |method: &mut Ambient, size| method.parts(gpu, &scene.cameras[0], size).expect("parts");
        assert_eq!(falls_in(&mut method, SIZE), 1);
        let bytes = FrameTarget::bytes(SIZE);
        let buffer = gpu
            .buffer(&BufferDesc::storage("picture", bytes, Category::Film))
            .expect("buffer");
        let mut picture_of = |number: u32, parts: u32| {
            for part in (0..parts).map(|number| Part { number, of: parts }) {
                let mut recorder = gpu.recorder("host").expect("recorder");
                let frame = Frame {
                    camera: &scene.cameras[0],
                    seed: 3,
                    number,
                    part,
                };
                let target = FrameTarget {
                    radiance: &buffer,
                    size: SIZE,
                };
                method.begin(&mut recorder).expect("begin");
                method.record(&mut recorder, &frame, &target).expect("record");
                recorder
                    .submit()
                    .and_then(|submission| submission.wait())
                    .expect("device");
            }
            gpu.read::<f32>(buffer.view(), bytes as usize / 4).expect("pixels")
        };
        let mut picture = |number: u32| picture_of(number, 1);
        let first = picture(0);
        let own = rendered(gpu, &scene, "ambient", serde_json::Value::Null, 1);
        assert_eq!(values(&own, "radiance"), first);
        assert_ne!(picture(1), first);
        assert_eq!(picture(0), first);
        assert_ne!(picture(1), first);
        assert_eq!(picture_of(0, 7), first);
        // What would be written past its end is refused, whatever the numbers.
        for size in [[SIZE[0], SIZE[1] + 1], [1 << 16, 1 << 16], [u32::MAX, 2], [0, 7]] {
            let mut recorder = gpu.recorder("host").expect("recorder");
            let frame = Frame {
                camera: &scene.cameras[0],
                seed: 3,
                number: 0,
                part: Part::WHOLE,
            };
            let target = FrameTarget {
                radiance: &buffer,
                size,
            };
            let refused = method.record(&mut recorder, &frame, &target);
            assert!(matches!(refused, Err(Error::Setting { .. })), "{size:?}: {refused:?}");
        }
    });
}

/// Where rays may test many triangles, a frame falls into parts of bounded work, and a step ends within a frame.
#[test]
fn frames_of_rays_that_take_long_are_parted() {
    with_gpu(|gpu| {
        let scene = equal_triangles(4000);
        let size = [128, 128];
        let on_device = Arc::new(GpuScene::new(gpu, &scene).expect("scene"));
        let mut method = Ambient::new(gpu, Arc::clone(&on_device)).expect("method");
        let parts = method.parts(gpu, &scene.cameras[0], size).expect("parts");
        // Two rays of a pixel, and a step for each triangle, in parts of 2^26 steps or more on a faster device.
        let steps = 2 * 4000 * u64::from(size[0] * size[1]);
        assert!(
            gpu.caps().kind != DeviceKind::Cpu || u64::from(parts) >= steps >> 26,
            "{parts}"
        );
        let card = by_id("ambient").expect("technique");
        let view = View {
            camera: &scene.cameras[0],
            size,
            seed: 1,
            aovs: false,
        };
        let mut technique = card
            .prepare(gpu, on_device, &view, &Settings::default())
            .expect("technique");
        let mut submissions = 0;
        while let Some(step) = technique.step(1).expect("step") {
            submissions += step.timings.len();
        }
        assert_eq!(submissions, parts as usize);
    });
}

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// All files of code and settings below a folder, without what builds and programs leave behind; pages may tell of whatever there is.
fn texts(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder)
        .expect("folder")
        .map(|entry| entry.expect("entry"))
    {
        let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        if name.starts_with('.') || ["target", "out", "shared", "node_modules", "results"].contains(&name.as_str()) {
            continue;
        }
        if path.is_dir() {
            texts(&path, found);
        } else if path
            .extension()
            .is_some_and(|ending| ["rs", "toml", "glsl", "comp", "sh"].contains(&ending.to_string_lossy().as_ref()))
        {
            found.push(path);
        }
    }
}

/// Whether a text holds the technique's id or module: the word, in lower case, other than in the phrases of optics.
fn names_it(text: &str) -> bool {
    let words = text.split(|c: char| !(c.is_alphanumeric() || c == '_'));
    words.into_iter().any(|word| word == "ambient")
}

#[test]
fn adding_it_touched_its_folders_its_test_its_experiment_and_the_list() {
    const LIST: &str = "engine/src/techniques/mod.rs";
    let own = [
        "engine/src/techniques/ambient/",
        "shaders/techniques/ambient/",
        "tests/tests/ambient.rs",
        "tools/experiments/ambient.toml",
    ];
    let mut files = Vec::new();
    texts(&repository(), &mut files);
    assert!(files.len() > 500, "{}", files.len());
    let mut lines = 0;
    let mut found = [false; 4];
    for path in files {
        let name = path.strip_prefix(repository()).expect("below").display().to_string();
        let text = std::fs::read_to_string(&path).expect("text");
        if let Some(place) = own.iter().position(|place| name.starts_with(place)) {
            found[place] = true;
            // All of its code: Rust, GLSL and card.
            lines += if place < 2 { text.lines().count() } else { 0 };
        } else if name == LIST {
            let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
            let naming: Vec<&str> = code.filter(|line| names_it(line)).map(str::trim).collect();
            assert_eq!(naming, ["ambient,"]);
        } else {
            assert!(!names_it(&text), "{name} names it, too");
        }
    }
    assert_eq!(found, [true; 4], "{own:?}");
    // About 150.
    assert!(lines < 165, "{lines} lines");
    // And what comes of it: a row, hard cases, an experiment that sweeps, the page that explains it.
    let info = by_id("ambient").expect("technique");
    assert!(
        clerestory::catalogue::all()
            .iter()
            .any(|row| info.rows.concat().contains(row))
    );
    let is_it = |subject: &Subject| matches!(subject, Subject::Technique { info, .. } if info.id == "ambient");
    assert!(subjects().iter().any(is_it));
    let read = |name: &str| std::fs::read_to_string(repository().join(name)).expect("text");
    let experiment = read(own[3]);
    assert!(experiment.contains("[sweep]") && experiment.contains("technique = \"ambient\""));
    let page = read("CONTRIBUTING.md");
    for place in own {
        assert!(page.contains(place), "CONTRIBUTING.md does not name {place}");
    }
}

#[test]
fn the_viewer_goes_to_it_where_it_can_render_the_scene() {
    with_gpu(|gpu| {
        let shown = |scene: &Scene| {
            let renderer = Renderer::new(gpu, scene).expect("scene");
            let mut picture = Progressive::new(gpu, renderer, RenderOptions::default(), 0.0, PixelFormat::Rgba8);
            let mut ids = vec![picture.technique().to_owned()];
            loop {
                picture.next_technique();
                if ids[0] == picture.technique() {
                    return ids;
                }
                ids.push(picture.technique().to_owned());
            }
        };
        assert!(shown(&blocks()).contains(&"ambient".to_owned()));
        assert!(!shown(&builtin("builtin:cornell-box")).contains(&"ambient".to_owned()));
    });
}
