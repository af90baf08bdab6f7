//! Sizes, shares of work, scenes that have nothing, and what is refused.

use super::*;
use clerestory::gpu::{GpuOptions, Lesser};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::Environment;
use clerestory_tests::render::{camera_down, floor};
use clerestory_tests::{assert_no_messages, gpu_with};

fn bits(picture: &[Vec<f32>; 2]) -> Vec<u32> {
    picture.iter().flatten().map(|value| value.to_bits()).collect()
}

#[test]
fn pictures_do_not_depend_on_how_lights_are_shared_out() {
    with_gpu(|gpu| {
        let scene = room();
        // More lights than one dispatch takes, and pixels that fill no workgroup.
        let base = VirtualLightSettings {
            walks: 40,
            ..settings()
        };
        let of = |settings: &VirtualLightSettings| {
            let mut renderer = renderer(gpu, &scene, [13, 7], settings);
            (bits(&advance(&mut renderer, 3)), renderer.counts())
        };
        let (whole, counts) = of(&base);
        assert!(counts.lights / counts.passes > 40);
        for (lights_at_once, submission_work) in [(1, 0), (3, 0), (0, 1), (2, 64)] {
            let settings = VirtualLightSettings {
                lights_at_once,
                submission_work,
                ..base.clone()
            };
            let (parted, parted_counts) = of(&settings);
            assert_eq!(parted, whole, "{lights_at_once} {submission_work}");
            assert_eq!(parted_counts, counts, "{lights_at_once} {submission_work}");
        }
        let (again, _) = of(&VirtualLightSettings {
            seed: 12,
            ..base.clone()
        });
        assert_ne!(again, whole);
    });
}

/// Pictures of the same walks and eye paths: what is scattered twice at most, and what is scattered more often.
#[test]
fn parts_of_the_light_sum_to_the_whole() {
    with_gpu(|gpu| {
        let scene = room();
        let of = |least_bounces, most_bounces| {
            let settings = VirtualLightSettings {
                bound: Bound::None,
                least_bounces,
                most_bounces,
                ..settings()
            };
            let [radiance, _] = advance(&mut renderer(gpu, &scene, SIZE, &settings), 4);
            radiance
        };
        let (whole, few, many, direct) = (of(0, 0), of(0, 2), of(3, 0), of(0, 1));
        for ((whole, few), many) in whole.iter().zip(&few).zip(&many) {
            // Three sums of some hundred lights in f32.
            assert!(
                (few + many - whole).abs() <= 1e-4 * whole,
                "{few} + {many} instead of {whole}"
            );
        }
        let [whole, few, direct] = [&whole, &few, &direct].map(|radiance| mean(radiance, 0));
        assert!(
            direct > 0.0 && few > 1.1 * direct && whole > 1.1 * few,
            "{direct} {few} {whole}"
        );
    });
}

/// A range of bounces beside a compensated bound: eye paths go on for virtual lights though their own light is too short for the range, and gather only where a
/// connection is not too long for it.
#[test]
fn parts_of_the_light_are_whole_with_a_compensated_bound() {
    with_gpu(|gpu| {
        let scene = room();
        for (least_bounces, most_bounces, set) in [(3, 0, "bounces=3.."), (0, 3, "bounces=0..3")] {
            let settings = VirtualLightSettings {
                samples_per_pass: 4,
                bound: Bound::Geometry,
                bound_value: 0.3,
                least_bounces,
                most_bounces,
                ..settings()
            };
            let found = passes(gpu, &scene, &settings, 32);
            found.expect_same_as(set, &traced_set(gpu, &scene, 1024, set), 0.0);
        }
        // Of two bounces the first surface has those of virtual lights, and no later one.
        let settings = VirtualLightSettings {
            most_bounces: 2,
            ..settings()
        };
        let mut renderer = renderer(gpu, &scene, SIZE, &settings);
        advance(&mut renderer, 2);
        assert_eq!(renderer.counts().gather.gathers, u64::from(2 * SIDE * SIDE));
    });
}

/// Where memory lacks, fewer paths are under way at once, so that there is room for what their places keep of the lights.
#[test]
fn waves_shrink_until_gathering_fits_beside_them() {
    // Of the 5 MiB that the places of a whole wave keep.
    const LACKING: u64 = 1 << 20;
    let of = |heap_bytes| {
        let lesser = Lesser {
            heap_bytes,
            ..Lesser::default()
        };
        let gpu = gpu_with(&GpuOptions {
            lesser,
            ..GpuOptions::default()
        });
        let mut renderer = renderer(&gpu, &room(), [16; 2], &settings());
        let used = gpu.memory_report().total();
        let picture = bits(&advance(&mut renderer, 2));
        assert_no_messages(&gpu);
        (used, picture)
    };
    let (whole, picture) = of(None);
    let (used, of_fewer) = of(Some(whole - LACKING));
    assert_eq!(of_fewer, picture);
    assert!(used < whole / 4 * 3, "{used} of {whole}");
}

#[test]
fn scenes_without_lights_or_reflection_have_no_virtual_light() {
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
        // No light at all.
        let mut dark = renderer(gpu, &open(0.5), SIZE, &settings());
        assert!(!dark.has_lights());
        assert!(advance(&mut dark, 2)[0].iter().all(|value| *value == 0.0));
        assert_eq!(dark.counts(), PassCounts::default());
        // A light whose walks all leave: its direct light is there.
        let mut away = open(0.5);
        let (position, direction) = (Vec3::Y, Vec3::Y);
        let intensity = Vec3::ONE;
        away.add_light(
            "spot",
            LightKind::Spot {
                position,
                direction,
                intensity,
                inner: 0.1,
                outer: 0.2,
            },
        );
        let mut away = renderer(gpu, &away, SIZE, &settings());
        advance(&mut away, 2);
        let counts = away.counts();
        assert_eq!((counts.passes, counts.lights, counts.gather.gathers), (2, 0, 0));
        assert_eq!(counts.walks.escaped, 16);
        // A black floor is lit and shows nothing of it.
        let mut black = open(0.0);
        add_point(&mut black, Vec3::Y, Vec3::ONE);
        let mut black = renderer(gpu, &black, SIZE, &settings());
        assert!(advance(&mut black, 2)[0].iter().all(|value| *value == 0.0));
        assert_eq!(black.counts().lights, 0);
        // Light that is reflected once has no need of them.
        let once = VirtualLightSettings {
            most_bounces: 1,
            ..settings()
        };
        let mut direct = renderer(gpu, &room(), SIZE, &once);
        assert!(!direct.has_lights());
        advance(&mut direct, 1);
        assert_eq!(direct.counts().passes, 0);
    });
}

/// Virtual lights that are at the point itself, or nearly so, bring numbers or nothing: a floor that is lit by walks which end within its least fraction of a pixel.
#[test]
fn points_that_coincide_bring_no_infinities() {
    with_gpu(|gpu| {
        let mut scene = Scene {
            name: "crease".into(),
            ..Scene::default()
        };
        let matte = scene.add_material(Material::lambert("matte", Vec3::splat(0.9)));
        scene.place(cuboid("crease", matte, Vec3::splat(-1e-4), Vec3::new(1e-4, 0.0, 1e-4)));
        scene.place(cuboid("step", matte, Vec3::new(0.0, 0.0, -1e-4), Vec3::splat(1e-4)));
        scene.cameras.push(camera_down(1e-4, 1.0));
        add_point(&mut scene, Vec3::new(-2e-4, 2e-4, 0.0), Vec3::splat(1e-8));
        for bound in [Bound::None, Bound::Geometry, Bound::Distance] {
            // Without direct light, of which there is some in any case.
            let settings = VirtualLightSettings {
                walks: 256,
                bound,
                least_bounces: 2,
                ..settings()
            };
            let mut renderer = renderer(gpu, &scene, SIZE, &settings);
            // `advance` refuses samples and pixels that are not finite.
            let [radiance, _] = advance(&mut renderer, 2);
            assert!(radiance.iter().any(|value| *value > 0.0), "{bound:?}");
            assert!(renderer.counts().gather.shadow_rays > 0, "{bound:?}");
        }
    });
}

/// As many walks as settings take may leave more virtual lights than a buffer holds; here fewer do, and a smaller one.
#[test]
fn lights_beyond_a_buffer_are_refused_with_their_number() {
    const RANGE: u64 = 1 << 20;
    /// Of a record.
    const BYTES: u64 = 64;
    const WALKS: u32 = 20_000;
    let gpu = gpu_with(&GpuOptions {
        lesser: Lesser {
            max_storage_buffer_range: Some(RANGE),
            ..Lesser::default()
        },
        ..GpuOptions::default()
    });
    let many = VirtualLightSettings {
        walks: WALKS,
        most_bounces: 2,
        ..settings()
    };
    let mut renderer = renderer(&gpu, &room(), [1, 1], &many);
    let (text, kernel, needed, capacity) = overflow_of(&mut renderer);
    assert_eq!((kernel.as_str(), capacity), ("vpl_append", RANGE / BYTES));
    // One of each walk, in a closed room.
    assert_eq!(needed, u64::from(WALKS), "{text}");
    assert!(text.contains("setting `walks`"), "{text}");
    assert_no_messages(&gpu);
}

#[test]
fn what_cannot_be_modelled_is_refused_by_name() {
    with_gpu(|gpu| {
        let mut unlit = room();
        unlit.materials[0].unlit = true;
        let mut sky = builtin("builtin:fog-box?fill=everywhere");
        sky.environment = Some(Environment::uniform(Vec3::ONE));
        for (scene, word) in [(sky, "media"), (unlit, "unlit")] {
            let options = RenderOptions {
                technique: Some("vpl".into()),
                ..RenderOptions::default()
            };
            let renderer = Renderer::new(gpu, &scene).expect("scene");
            let error = renderer.start(&options).err().expect("a refusal");
            assert!(matches!(error, Error::Unsupported { .. }), "{error}");
            assert!(error.to_string().contains(word), "{error}");
        }
        let renderer = Renderer::new(gpu, &room()).expect("scene");
        for (settings, word) in [
            (serde_json::json!({ "walks": 0 }), "setting walks: 0"),
            (
                serde_json::json!({ "walks": 10_000_000 }),
                "setting walks: 10000000 is out of range; it may be 1 … 1048576",
            ),
            (serde_json::json!({ "bound": "sphere" }), "bound"),
            (serde_json::json!({ "bound_value": -1.0 }), "setting bound_value"),
            (serde_json::json!({ "path_set": "all" }), "no others"),
        ] {
            let options = RenderOptions {
                technique: Some("vpl".into()),
                settings: settings.into(),
                ..RenderOptions::default()
            };
            let error = renderer.start(&options).err().expect("a refusal").to_string();
            assert!(error.contains(word), "{error}");
        }
    });
}
