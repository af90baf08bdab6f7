//! Scenes with media: virtual lights at collisions, and eye paths that gather at theirs.

use super::*;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{DensityGrid, Environment, Medium, Phase};
use clerestory_tests::child::{hash_in_child, print_hash};
use clerestory_tests::fog::{add_boundary, fog, uneven_density};
use clerestory_tests::gpu;
use glam::DVec3;

/// Set in the processes that only print their picture's hash.
const CHILD: &str = "CLERESTORY_TEST_PRINT_HASH_OF_FOG";
const CHILD_TEST: &str = "media::prints_its_hash_when_asked";

/// The room, filled with it.
fn fog_room(phase: Phase) -> Scene {
    let mut scene = room();
    scene.name = format!("fog with {phase:?}");
    scene.media.push(fog(phase));
    scene.surrounding = Some(0);
    scene
}

/// The room, with a body of it behind an invisible boundary.
fn fog_body(phase: Phase) -> Scene {
    let mut scene = room();
    scene.name = format!("body of fog with {phase:?}");
    let boundary = add_boundary(&mut scene, phase);
    scene.place(cuboid(
        "fog",
        boundary,
        Vec3::new(-0.2, -0.8, -0.7),
        Vec3::new(0.6, 0.2, 0.3),
    ));
    scene
}

/// The body, with a density that changes across it, beside the same fog everywhere else if so wanted.
fn cloud(around: bool) -> Scene {
    let mut scene = fog_body(Phase::HenyeyGreenstein { g: 0.6 });
    scene.name = format!("cloud, in fog: {around}");
    scene.media[0].density = Some(uneven_density(DVec3::new(-0.2, -0.8, -0.7), DVec3::new(0.6, 0.2, 0.3)));
    if around {
        scene.media.push(fog(Phase::Isotropic));
        scene.surrounding = Some(1);
    }
    scene
}

/// The body with an absorbing thread in each column of its blocks, whose bounds are those of the threads: rays beside these take thousands of tentative collisions, of which none is one, and arrive.
fn threads() -> Scene {
    const CELLS: u32 = 8;
    const BLOCK: f64 = 4.0;
    let mut scene = fog_body(Phase::Isotropic);
    scene.name = "threads".into();
    scene.media[0].sigma_s = Vec3::splat(200.0);
    scene.media[0].sigma_a = Vec3::splat(7800.0);
    let in_thread = |p: f64| (p * f64::from(CELLS) % BLOCK - 1.5).abs() < 0.5;
    let density = |p: DVec3| f32::from(u8::from(in_thread(p.x) && in_thread(p.y)));
    let grid = DensityGrid::from_fn([CELLS; 3], density);
    scene.media[0].density = Some(grid.in_box(DVec3::new(-0.2, -0.8, -0.7), DVec3::new(0.6, 0.2, 0.3)));
    scene
}

fn several() -> VirtualLightSettings {
    VirtualLightSettings {
        samples_per_pass: 4,
        ..settings()
    }
}

/// Size of pictures that are compared: all pixels share the noise of a pass, whatever their number, and each asks all of its lights.
const FEW: [u32; 2] = [8; 2];
/// Passes, whose spread says how far their mean may be off.
const PASSES: u32 = 40;

fn few_pixels(gpu: &Gpu, scene: &Scene, settings: &VirtualLightSettings) -> Passes {
    passes_of_size(gpu, scene, FEW, settings, PASSES)
}

/// The path tracer's picture of the same light paths.
fn expected(gpu: &Gpu, scene: &Scene) -> Rendered {
    render(gpu, scene, FEW, 2048, &paths(PATHS))
}

/// Fails unless a scene has the path tracer's light, with the bound that is chosen by default.
fn expect_agreement(scene: &Scene) {
    with_gpu(|gpu| {
        let found = few_pixels(gpu, scene, &several());
        found.expect_same_as(&scene.name, &expected(gpu, scene), 0.0);
        assert!(found.counts.walks.events > 0, "{:?}", found.counts);
    });
}

#[test]
fn lights_at_collisions_agree_with_the_path_tracer() {
    expect_agreement(&fog_room(Phase::Isotropic));
}

#[test]
fn lights_at_forward_collisions_agree_with_the_path_tracer() {
    expect_agreement(&fog_room(Phase::HenyeyGreenstein { g: 0.6 }));
}

#[test]
fn lights_in_a_body_agree_with_the_path_tracer() {
    // By means: pixels that the body barely covers have few and bright samples, whose sums are not normal.
    with_gpu(|gpu| {
        let scene = fog_body(Phase::HenyeyGreenstein { g: 0.6 });
        let found = few_pixels(gpu, &scene, &several());
        found.expect_mean_as(&scene.name, &expected(gpu, &scene), 0.0);
        assert!(found.counts.walks.events > 0, "{:?}", found.counts);
    });
}

/// Delta tracking to collisions and ratio tracking between them.
#[test]
fn lights_in_grids_agree_with_the_path_tracer() {
    expect_agreement(&cloud(false));
}

#[test]
fn lights_in_grids_beside_a_homogeneous_medium_agree_with_the_path_tracer() {
    expect_agreement(&cloud(true));
}

/// Walks start in a medium that emits, where nothing else does.
#[test]
fn media_that_emit_send_walks() {
    with_gpu(|gpu| {
        let mut scene = fog_body(Phase::Isotropic);
        scene.name = "glowing body".into();
        scene.lights.clear();
        scene.media[0].emission = Vec3::new(3.0, 2.0, 1.0);
        let found = few_pixels(gpu, &scene, &several());
        found.expect_same_as(&scene.name, &expected(gpu, &scene), 0.0);
        assert!(found.counts.lights > 0, "{:?}", found.counts);
    });
}

/// Fails unless a bound about those that would be chosen is made up for.
fn expect_compensated(bound: Bound, bound_value: f32) {
    with_gpu(|gpu| {
        let scene = fog_room(Phase::Isotropic);
        let settings = VirtualLightSettings {
            bound,
            bound_value,
            ..several()
        };
        let found = few_pixels(gpu, &scene, &settings);
        found.expect_same_as(&format!("{bound:?} {bound_value}"), &expected(gpu, &scene), 0.0);
    });
}

#[test]
fn bounds_in_media_are_compensated() {
    expect_compensated(Bound::Geometry, 1.0);
}

#[test]
fn tight_bounds_in_media_are_compensated() {
    expect_compensated(Bound::Geometry, 0.1);
}

#[test]
fn distances_in_media_are_compensated() {
    expect_compensated(Bound::Distance, 1.0);
}

/// They leave nothing to compensate.
#[test]
fn loose_bounds_in_media_compensate_nothing() {
    const LOOSE: f32 = 1e30;
    with_gpu(|gpu| {
        let scene = fog_room(Phase::Isotropic);
        let of = |bound| {
            let settings = VirtualLightSettings {
                bound,
                bound_value: LOOSE,
                ..settings()
            };
            let mut renderer = renderer(gpu, &scene, SIZE, &settings);
            let [radiance, _] = advance(&mut renderer, 4);
            (radiance, renderer.counts().gather.gathers)
        };
        let ((unbounded, gathers), (loose, of_loose)) = (of(Bound::None), of(Bound::Geometry));
        // Each sample gathers once, where it collides or arrives.
        assert_eq!((gathers, of_loose), (u64::from(4 * SIDE * SIDE), gathers));
        let most = unbounded.iter().copied().fold(0.0, f32::max);
        for (found, expected) in loose.iter().zip(&unbounded) {
            let allowed = 1e-5 * (expected + most);
            assert!((found - expected).abs() <= allowed, "{found} {expected}");
        }
    });
}

/// A closed box of walls that emit and reflect half of what arrives, in fog that absorbs nothing: the same radiance everywhere.
#[test]
fn furnaces_with_fog_are_even() {
    with_gpu(|gpu| {
        let mut scene = builtin("builtin:furnace-box?rho=0.5&emission=1");
        scene.media.push(Medium {
            sigma_s: Vec3::splat(1.0),
            phase: Phase::HenyeyGreenstein { g: 0.6 },
            ..Medium::default()
        });
        scene.surrounding = Some(0);
        let found = few_pixels(gpu, &scene, &several());
        for means in &found.means {
            expect_mean_of("radiance", means, 2.0, 0.0, 0.0);
        }
    });
}

/// A glass ball in fog behind a boundary, lit by a lamp: no virtual light has what the glass sends into the fog.
fn glass_in_fog() -> Scene {
    builtin("builtin:fog-box?sphere=glass&sigma_s=3")
}

#[test]
fn light_off_mirrors_into_media_is_the_eye_paths() {
    with_gpu(|gpu| {
        let scene = glass_in_fog();
        few_pixels(gpu, &scene, &several()).expect_same_as("compensated", &expected(gpu, &scene), 0.0);
    });
}

#[test]
fn light_off_mirrors_into_media_is_the_eye_paths_without_a_bound() {
    with_gpu(|gpu| {
        let scene = glass_in_fog();
        let unbounded = VirtualLightSettings {
            walks: 32,
            bound: Bound::None,
            ..several()
        };
        // Single lights count without a bound, so that a few passes are not normal: means alone, with room for that.
        few_pixels(gpu, &scene, &unbounded).expect_same_as("unbounded", &expected(gpu, &scene), 0.05);
    });
}

#[test]
fn walks_through_media_are_counted() {
    with_gpu(|gpu| {
        let absorbing = Medium {
            sigma_s: Vec3::ZERO,
            sigma_a: Vec3::splat(0.5),
            ..Medium::default()
        };
        let mut dark = room();
        dark.media.push(absorbing);
        dark.surrounding = Some(0);
        for (scene, scatters) in [
            (fog_room(Phase::Isotropic), true),
            (fog_body(Phase::Rayleigh), true),
            (cloud(true), true),
            (dark, false),
        ] {
            let settings = VirtualLightSettings {
                walks: 1 << 10,
                ..settings()
            };
            let mut renderer = renderer(gpu, &scene, SIZE, &settings);
            let lights = renderer.lights(0).unwrap_or_else(|error| panic!("{error}"));
            let c = renderer.counts().walks;
            assert_eq!((c.emitted, c.escaped, c.absorbed), (1 << 10, 0, 1 << 10), "{c:?}");
            assert_eq!(c.events, c.collisions, "{c:?}");
            assert_eq!(renderer.counters()["walk_collisions"], c.collisions, "{c:?}");
            assert_eq!(lights.len() as u64, c.deposits + c.events, "{c:?}");
            assert_eq!(c.events > 50, scatters, "{}: {c:?}", scene.name);
            // Those at collisions have no normal, and lie within the room.
            let collisions = lights.iter().filter(|light| light.normal == Vec3::ZERO);
            assert_eq!(collisions.clone().count() as u64, c.events, "{}", scene.name);
            for light in collisions {
                assert!(
                    light.position.abs().max_element() < 1.0 && light.power.max_element() > 0.0,
                    "{light:?}"
                );
            }
            // Of 20 W, of which the first lights have what fog has left; flights chosen by other bands weigh up to a third more or less.
            let first: f32 = lights.iter().filter(|l| l.bounce == 0).map(|l| l.power.y).sum();
            assert!(first > 0.0 && first <= 20.0 * 1.05, "{first}");
        }
    });
}

fn bits(picture: &[Vec<f32>; 2]) -> Vec<u32> {
    picture.iter().flatten().map(|value| value.to_bits()).collect()
}

/// Fails unless pictures of a scene have the same bits and counts however lights and submissions are parted.
fn expect_same_however_it_is_shared_out(scene: &Scene) {
    with_gpu(|gpu| {
        let base = VirtualLightSettings {
            walks: 20,
            ..settings()
        };
        let of = |settings: &VirtualLightSettings| {
            let mut renderer = renderer(gpu, scene, [13, 7], settings);
            (bits(&advance(&mut renderer, 2)), renderer.counts())
        };
        let (whole, counts) = of(&base);
        assert!(counts.gather.shadow_rays > 0);
        for (lights_at_once, submission_work) in [(1, 0), (3, 0), (0, 1), (2, 64)] {
            let settings = VirtualLightSettings {
                lights_at_once,
                submission_work,
                ..base.clone()
            };
            let (parted, parted_counts) = of(&settings);
            let what = format!("{}: {lights_at_once} {submission_work}", scene.name);
            assert_eq!(parted, whole, "{what}");
            assert_eq!(parted_counts, counts, "{what}");
        }
    });
}

#[test]
fn pictures_of_media_do_not_depend_on_how_work_is_shared_out() {
    expect_same_however_it_is_shared_out(&fog_body(Phase::Isotropic));
}

#[test]
fn pictures_of_grids_do_not_depend_on_how_work_is_shared_out() {
    expect_same_however_it_is_shared_out(&cloud(true));
}

/// Walks that stop in most stretches: were there more in a dispatch than a software driver runs, it would leave out light.
#[test]
fn long_walks_through_grids_do_not_depend_on_how_many_share_a_dispatch() {
    with_gpu(|gpu| {
        let scene = threads();
        let of = |lights_at_once| {
            let settings = VirtualLightSettings {
                walks: 4,
                lights_at_once,
                ..settings()
            };
            let mut renderer = renderer(gpu, &scene, [9, 5], &settings);
            (bits(&advance(&mut renderer, 1)), renderer.counts())
        };
        let (one, counts) = of(1);
        assert!(counts.gather.shadow_rays > 0, "{counts:?}");
        let (sixteen, counts_of_sixteen) = of(16);
        assert_eq!(sixteen, one);
        assert_eq!(counts_of_sixteen, counts);
    });
}

#[test]
fn threads_of_the_driver_never_show_in_media() {
    let hash = |variables: &[(&str, &str)]| hash_in_child(CHILD_TEST, CHILD, variables);
    let truth = hash(&[("LP_NUM_THREADS", "1")]);
    assert_eq!(hash(&[("LP_NUM_THREADS", "2")]), truth);
}

#[test]
fn prints_its_hash_when_asked() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    let gpu = gpu();
    let mut renderer = renderer(&gpu, &cloud(true), SIZE, &settings());
    print_hash(bits(&advance(&mut renderer, 2)));
    clerestory_tests::assert_no_messages(&gpu);
}

#[test]
fn what_media_have_no_lights_for_is_refused_by_name() {
    with_gpu(|gpu| {
        let mut sky = fog_room(Phase::Isotropic);
        sky.environment = Some(Environment::uniform(Vec3::ONE));
        let mut glowing = fog_room(Phase::Isotropic);
        glowing.media[0].emission = Vec3::ONE;
        let start = |scene: &Scene, settings: serde_json::Value| {
            let options = RenderOptions {
                technique: Some("vpl".into()),
                settings: settings.into(),
                ..RenderOptions::default()
            };
            let renderer = Renderer::new(gpu, scene).expect("scene");
            renderer.start(&options).err().expect("a refusal")
        };
        for (scene, word) in [(sky, "light from infinity"), (glowing, "emits everywhere")] {
            let error = start(&scene, serde_json::json!({}));
            assert!(matches!(error, Error::Unsupported { .. }), "{error}");
            assert!(error.to_string().contains(word), "{error}");
        }
        let scene = fog_room(Phase::Isotropic);
        for (settings, word) in [
            (serde_json::json!({ "selection": "cuts" }), "selection: cuts"),
            (serde_json::json!({ "selection": "potential" }), "selection: potential"),
            (serde_json::json!({ "fractional": true }), "fractional: true"),
            (serde_json::json!({ "compensation_steps": 2 }), "compensation_steps: 2"),
        ] {
            let error = start(&scene, settings).to_string();
            assert!(error.contains(word) && error.contains("participating media"), "{error}");
        }
    });
}
