//! Equal bits however the work is done, scenes that have nothing, and what is refused.

use super::*;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::techniques::PathTracerSettings;
use clerestory::techniques::bidirectional::BidirectionalCounts;
use clerestory_tests::child::{hash_in_child, print_hash};
use clerestory_tests::gpu;
use clerestory_tests::render::{camera_down, floor};

/// Set in the processes that only print their picture's hash.
const CHILD: &str = "CLERESTORY_TEST_PRINT_BIDIRECTIONAL_HASH";
const CHILD_TEST: &str = "edge_cases::prints_its_hash_when_asked";

fn bits(picture: &[Vec<f32>; 2]) -> Vec<u32> {
    picture.iter().flatten().map(|value| value.to_bits()).collect()
}

fn lit_room() -> Scene {
    let mut scene = room();
    add_lamp(&mut scene, 3.0);
    scene
}

#[test]
fn passes_have_as_many_samples_as_there_are_sums_for() {
    with_gpu(|gpu| {
        let (scene, range) = (lit_room(), gpu.caps().max_storage_buffer_range);
        let settings = BidirectionalSettings {
            samples_at_once: 16,
            ..BidirectionalSettings::default()
        };
        // 24 bytes for each pixel and sample: four samples of every pixel, and half a sample.
        let side = |samples: f64| (range as f64 / 24.0 / samples).sqrt() as u32;
        if range > 1 << 30 {
            return;
        }
        let some = renderer(gpu, &scene, [side(4.5); 2], &settings);
        assert_eq!(some.settings().samples_at_once, 4);
        let none = BidirectionalPaths::new(gpu, upload(gpu, &scene), &scene.cameras[0], [side(0.5); 2], settings);
        let error = none.err().map(|error| error.to_string()).unwrap_or_default();
        assert!(error.contains("maxStorageBufferRange"), "{error}");
    });
}

#[test]
fn pictures_do_not_depend_on_how_the_work_is_cut_up() {
    with_gpu(|gpu| {
        let scene = lit_room();
        // Pixels that fill no workgroup.
        let base = BidirectionalSettings {
            light_paths: 300,
            samples_at_once: 4,
            connections: 3,
            ..settings()
        };
        let of = |settings: &BidirectionalSettings| {
            let mut renderer = renderer(gpu, &scene, [13, 7], settings);
            let picture = bits(&advance(&mut renderer, 6));
            (picture, renderer.counts())
        };
        let done = |c: &BidirectionalCounts| [c.light_vertices, c.vertices_in_view, c.connections, c.shadow_rays];
        let (whole, counts) = of(&base);
        assert!(done(&counts).iter().all(|count| *count > 300), "{counts:?}");
        assert_eq!((counts.stalls, counts.postponed), (0, 0));
        for (paths_in_flight, submission_work, ray_quota) in [(64, 0, 0), (0, 1, 0), (64, 64, 0), (0, 0, 3)] {
            let settings = BidirectionalSettings {
                paths_in_flight,
                submission_work,
                ray_quota,
                ..base.clone()
            };
            let what = format!("{paths_in_flight} {submission_work} {ray_quota}");
            let (parted, of_parted) = of(&settings);
            assert_eq!(parted, whole, "{what}");
            assert_eq!(done(&of_parted), done(&counts), "{what}");
            assert_eq!(paths_in_flight > 0, of_parted.waves > counts.waves, "{what}");
            assert_eq!(submission_work > 0, of_parted.postponed > 0, "{what}");
            assert_eq!(ray_quota > 0, of_parted.stalls > 0, "{what}");
        }
        let again = BidirectionalSettings {
            seed: 12,
            ..base.clone()
        };
        assert_ne!(of(&again).0, whole);
        // A camera set anew begins anew, and so does a seed.
        let mut renderer = renderer(gpu, &scene, [13, 7], &again);
        advance(&mut renderer, 1);
        renderer.set_camera(&scene.cameras[0]).expect("camera");
        renderer.restart(base.seed).expect("seed");
        // Within passes and over their ends.
        for samples in [1, 3, 5] {
            advance(&mut renderer, samples);
        }
        assert_eq!(bits(&advance(&mut renderer, 6)), whole);
    });
}

/// Walks that leave more vertices than there is room for at first are walked again.
#[test]
fn vertices_beyond_what_there_is_room_for_are_not_lost() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:furnace-box?rho=0.95");
        let settings = BidirectionalSettings {
            light_paths: 64,
            ..settings()
        };
        let mut renderer = renderer(gpu, &scene, SIZE, &settings);
        let first = bits(&advance(&mut renderer, 2));
        let counts = renderer.counts();
        // Room at first, a walk.
        assert!(counts.light_vertices > 6 * counts.light_paths, "{counts:?}");
        // The second time there is room from the start.
        renderer.restart(settings.seed).expect("seed");
        assert_eq!(bits(&advance(&mut renderer, 2)), first);
        let again = renderer.counts();
        assert_eq!(again.light_vertices, 2 * counts.light_vertices);
        assert!(
            again.light_rays - counts.light_rays < counts.light_rays,
            "{counts:?} {again:?}"
        );
    });
}

/// What the camera is shown is summed by whoever comes first.
#[test]
fn threads_of_the_driver_never_show() {
    let hash = |variables: &[(&str, &str)]| hash_in_child(CHILD_TEST, CHILD, variables);
    let truth = hash(&[("LP_NUM_THREADS", "1")]);
    for variables in [
        &[("LP_NUM_THREADS", "2")][..],
        &[("LP_NATIVE_VECTOR_WIDTH", "128")],
        &[("LP_NATIVE_VECTOR_WIDTH", "512")],
    ] {
        assert_eq!(hash(variables), truth, "{variables:?}");
    }
}

#[test]
fn prints_its_hash_when_asked() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    let gpu = gpu();
    let mut renderer = renderer(&gpu, &lit_room(), SIZE, &settings());
    print_hash(bits(&advance(&mut renderer, 4)));
    clerestory_tests::assert_no_messages(&gpu);
}

#[test]
fn scenes_without_lights_or_reflection_have_nothing_to_join() {
    with_gpu(|gpu| {
        let open = |reflectance: f32| {
            let mut scene = Scene {
                name: "floor".into(),
                ..Scene::default()
            };
            let matte = scene.add_material(Material::lambert("matte", Vec3::splat(reflectance)));
            scene.place(floor("floor", matte, 1.0, 0.0));
            scene.cameras.push(camera_down(0.8, 5.0));
            scene
        };
        let mut dark = renderer(gpu, &open(0.5), SIZE, &settings());
        assert!(!dark.has_light_paths());
        assert!(advance(&mut dark, 2)[0].iter().all(|value| *value == 0.0));
        // A black floor is lit, and shows nothing of it.
        let mut black = open(0.0);
        add_point(&mut black, Vec3::Y, 1.0);
        let mut black = renderer(gpu, &black, SIZE, &settings());
        assert!(advance(&mut black, 2)[0].iter().all(|value| *value == 0.0));
        let counts = black.counts();
        assert_eq!(
            (counts.light_paths, counts.light_vertices, counts.connections),
            (4096, 0, 0)
        );
        // Light that is not scattered has no need of light subpaths.
        let emitted = BidirectionalSettings {
            most_bounces: Some(0),
            ..settings()
        };
        let lit = builtin("builtin:cornell-box");
        let mut emitted = renderer(gpu, &lit, SIZE, &emitted);
        assert!(!emitted.has_light_paths());
        // It is what the path tracer's camera rays meet, to the bit.
        let path = PathTracerSettings {
            seed: settings().seed,
            ..paths("emitted")
        };
        let seen = render(gpu, &lit, SIZE, 3, &path);
        assert!(seen.mean()[0].0 > 0.0);
        assert_eq!(bits(&advance(&mut emitted, 3)), seen.bits());
    });
}

#[test]
fn what_cannot_be_modelled_is_refused_by_name() {
    with_gpu(|gpu| {
        let start = |scene: &Scene, settings: serde_json::Value| {
            let options = RenderOptions {
                technique: Some("bdpt".into()),
                settings: settings.into(),
                ..RenderOptions::default()
            };
            let renderer = Renderer::new(gpu, scene).expect("scene");
            renderer.start(&options).err().expect("a refusal")
        };
        for (settings, word) in [
            (serde_json::json!({ "connections": 0 }), "setting connections: 0"),
            (serde_json::json!({ "light_paths": 100_000 }), "setting light_paths"),
            (serde_json::json!({ "path_set": "LXE" }), "LXE"),
        ] {
            let error = start(&lit_room(), settings).to_string();
            assert!(error.contains(word), "{error}");
        }
    });
}
