//! Deferred frames of many lights against the path tracer, against themselves without tiles, and by exact counts.

mod bounces;
mod discs;
mod history;
mod kept;
mod metropolis;
mod reflective;
mod reservoirs;
mod scales;
mod tiles;
mod truths;

use std::collections::BTreeSet;

use super::*;
use clerestory::Error;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{AlphaMode, Camera, Environment};
use clerestory::techniques::instant_radiosity::many_light::{
    Gathering, ManyLight, ManyLightSettings, Placement, Visibility,
};
use clerestory_hard_cases::scenes::orthographic;
use clerestory_tests::child::{hash_in_child, print_hash};
use clerestory_tests::render::{camera_down, floor};
use glam::DVec3;

const UP_TO_ONCE: &str = "bounces=0..1,lobes=diffuse+glossy";
const INDIRECT: &str = "bounces=2,lobes=diffuse+glossy";
const ALL: &str = "bounces=0..2,lobes=diffuse+glossy";
/// Set in the processes that only print their picture's hash.
const CHILD: &str = "CLERESTORY_TEST_PRINT_HASH";
const CHILD_TEST: &str = "many_light::prints_its_hash_when_asked";

/// Independent samples of few lights, with all that biases off.
fn exact() -> ManyLightSettings {
    ManyLightSettings {
        lights: 64,
        filter: false,
        bound: Bound::None,
        sampler: SamplerKind::Pcg,
        seed: 5,
        ..ManyLightSettings::default()
    }
}

fn of(set: &str, settings: ManyLightSettings) -> ManyLightSettings {
    ManyLightSettings {
        path_set: set.parse().expect("path set"),
        ..settings
    }
}

/// Lights and tiles that leave a rest when they are shared out.
fn of_odd_sizes(visibility: Visibility, settings: ManyLightSettings) -> ManyLightSettings {
    ManyLightSettings {
        visibility,
        map_side: 16,
        map_points: 256,
        interleave: 3,
        lights: 50,
        ..settings
    }
}

fn frames(gpu: &Gpu, scene: &Scene, size: [u32; 2], settings: &ManyLightSettings) -> ManyLight {
    match ManyLight::new(gpu, upload(gpu, scene), &scene.cameras[0], size, settings.clone()) {
        Ok(frames) => frames,
        Err(error) => panic!("{}: {error}", scene.name),
    }
}

/// Radiance after so many frames.
fn picture(gpu: &Gpu, scene: &Scene, size: [u32; 2], settings: &ManyLightSettings, count: u32) -> Vec<f32> {
    let [radiance, _] = advance(&mut frames(gpu, scene, size, settings), count);
    radiance
}

fn bits(radiance: &[f32]) -> Vec<u32> {
    radiance.iter().map(|value| value.to_bits()).collect()
}

fn rmse(a: &[f32], b: &[f32]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2));
    (squares.sum::<f64>() / a.len() as f64).sqrt()
}

/// A floor, a ceiling 2 m above it, and between them a slab that hides one from the other; seen from just under the ceiling, so that no virtual light is close to
/// what is seen.
fn hall() -> Scene {
    let mut scene = Scene {
        name: "hall".into(),
        ..Scene::default()
    };
    let ground = scene.add_material(Material::lambert("ground", Vec3::new(0.7, 0.5, 0.3)));
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
    let blue = scene.add_material(Material::lambert("blue", Vec3::new(0.2, 0.4, 0.8)));
    scene.place(floor("floor", ground, 3.0, 0.0));
    scene.place(floor("ceiling", white, 3.0, 2.0));
    let (lower, upper) = (Vec3::new(-0.4, 0.9, -0.4), Vec3::new(0.3, 1.0, 0.4));
    scene.place(cuboid("slab", blue, lower, upper));
    scene
        .cameras
        .push(orthographic(DVec3::Y * 1.9, DVec3::ZERO, -DVec3::Z, 1.0));
    add_point(&mut scene, Vec3::new(0.5, 1.7, 0.2), Vec3::splat(20.0));
    scene
}

/// The same with rough metal, a coat, a lamp and a sky.
fn furnished() -> Scene {
    let mut scene = hall();
    scene.name = "furnished".into();
    scene.materials[0] = Material {
        specular: 1.0,
        roughness: 0.5,
        ..scene.materials[0].clone()
    };
    scene.materials[2] = Material {
        metallic: 1.0,
        roughness: 0.6,
        ..scene.materials[2].clone()
    };
    let lamp = scene.add_material(Material {
        emission: Vec3::new(20.0, 15.0, 10.0),
        ..Material::lambert("lamp", Vec3::ZERO)
    });
    let lower = Vec3::new(-0.9, 1.5, -0.9);
    scene.place(cuboid("lamp", lamp, lower, lower + Vec3::splat(0.2)));
    scene.environment = Some(Environment::uniform(Vec3::new(0.2, 0.3, 0.5)));
    scene
}

#[test]
fn frames_with_rays_are_the_path_tracers() {
    with_gpu(|gpu| {
        for (scene, lights) in [(hall(), 64), (furnished(), 128)] {
            let reference = render(gpu, &scene, SIZE, 2048, &paths(ALL));
            let settings = ManyLightSettings { lights, ..exact() };
            let mut renderer = frames(gpu, &scene, SIZE, &settings);
            let found = passes_of(&mut renderer, SIZE, 1, 64);
            found.expect_same_as(&scene.name, &reference, 0.0);
            let counts = renderer.counts();
            assert_eq!((counts.frames, counts.walks.emitted), (64, u64::from(64 * lights)));
            // Some walks leave by the sides of the hall.
            assert!(
                counts.walks.escaped > 0 && counts.lights < counts.walks.emitted,
                "{counts:?}"
            );
            // Each pixel has had its part of the lights: about a sixteenth.
            let share = counts.connections as f64 / (counts.lights * 144) as f64;
            assert!((share * 16.0 - 1.0).abs() < 0.05, "{share}");
            assert!(counts.visibility_tests < counts.connections);
        }
    });
}

#[test]
fn direct_light_is_the_path_tracers() {
    with_gpu(|gpu| {
        for scene in [hall(), furnished()] {
            let reference = render(gpu, &scene, SIZE, 2048, &paths(UP_TO_ONCE));
            let mut renderer = frames(gpu, &scene, SIZE, &of(UP_TO_ONCE, exact()));
            let found = passes_of(&mut renderer, SIZE, 1, 64);
            found.expect_same_as(&scene.name, &reference, 0.0);
            assert_eq!(renderer.counts().walks.emitted, 0);
        }
    });
}

/// Seen in perspective through a lens, with the sky in view and rough metal from close by: what is seen depends on the direction.
#[test]
fn direct_light_is_the_path_tracers_through_any_camera() {
    with_gpu(|gpu| {
        let mut scene = furnished();
        let (eye, target) = (DVec3::new(1.3, 1.3, 1.1), DVec3::new(-0.2, 1.0, 0.0));
        scene.cameras[0] = Camera {
            lens_radius: 0.02,
            focus_distance: 1.5,
            ..Camera::look_at("close", eye, target, DVec3::Y, 1.0)
        };
        let reference = render(gpu, &scene, SIZE, 4096, &paths(UP_TO_ONCE));
        let mut renderer = frames(gpu, &scene, SIZE, &of(UP_TO_ONCE, exact()));
        let found = passes_of(&mut renderer, SIZE, 1, 128);
        found.expect_same_as("a close view", &reference, 0.0);
    });
}

#[test]
fn frames_do_not_depend_on_how_work_is_shared_out() {
    with_gpu(|gpu| {
        let scene = hall();
        for visibility in [Visibility::Rays, Visibility::Maps, Visibility::Imperfect] {
            let base = of_odd_sizes(visibility, exact());
            let all = |settings: &ManyLightSettings| {
                let mut renderer = frames(gpu, &scene, [13, 7], settings);
                let radiance = bits(&advance(&mut renderer, 2)[0]);
                let mut counts = renderer.counts();
                counts.passes = 0;
                (radiance, counts)
            };
            let whole = all(&base);
            assert_eq!(whole.1.maps > 0, visibility != Visibility::Rays);
            let splats = if visibility == Visibility::Imperfect { 256 } else { 0 };
            assert_eq!(whole.1.splats, splats * whole.1.maps);
            let parted = ManyLightSettings {
                lights_at_once: 3,
                maps_at_once: 7,
                submission_work: 1,
                ..base.clone()
            };
            assert!(all(&parted) == whole, "{visibility:?}");
            // Begun anew, and with another seed.
            let mut renderer = frames(gpu, &scene, [13, 7], &base);
            renderer.step(2).expect("a step");
            renderer.set_camera(&scene.cameras[0]).expect("a camera");
            assert!(bits(&advance(&mut renderer, 2)[0]) == whole.0, "{visibility:?}");
            renderer.restart(6).expect("another seed");
            assert!(bits(&advance(&mut renderer, 2)[0]) != whole.0, "{visibility:?}");
            renderer.restart(base.seed).expect("the first seed");
            assert!(bits(&advance(&mut renderer, 2)[0]) == whole.0, "{visibility:?}");
        }
    });
}

#[test]
fn what_is_not_needed_is_not_recorded() {
    with_gpu(|gpu| {
        let scene = hall();
        let once = |settings: &ManyLightSettings| {
            let mut renderer = frames(gpu, &scene, [16, 8], settings);
            advance(&mut renderer, 1);
            let has = |name: &str| {
                renderer
                    .pipelines()
                    .iter()
                    .any(|pipeline| pipeline.shader.contains(name))
            };
            let kernels = ["deferred_direct", "deferred_gather", "photon_emit", "surface_octant"].map(has);
            let counts = renderer.counts();
            (counts.passes, counts.maps, kernels, renderer.bytes())
        };
        // Surfaces, split, direct light, gather, merge, film.
        let (passes, maps, kernels, bytes) = once(&exact());
        assert_eq!((passes, maps), (6, 0));
        assert_eq!(kernels, [true, true, true, false]);
        let none = ManyLightSettings {
            visibility: Visibility::None,
            ..exact()
        };
        let (passes, maps, kernels, bytes_of_none) = once(&none);
        assert_eq!((passes, maps, bytes_of_none), (6, 0, bytes));
        assert_eq!(kernels, [true, true, true, false]);
        // Two more for each light with a map.
        let by_maps = ManyLightSettings {
            visibility: Visibility::Maps,
            map_side: 8,
            ..exact()
        };
        let (passes, maps, kernels, bytes_of_maps) = once(&by_maps);
        assert!(maps > 32 && maps <= 64, "{maps}");
        assert_eq!(passes, 6 + 2 * maps);
        assert_eq!(kernels, [true, true, true, true]);
        assert!(bytes_of_maps > bytes);
        // Points, places of the lights, splats and fill, for however many lights; nothing is rasterized for them.
        let imperfect = ManyLightSettings {
            visibility: Visibility::Imperfect,
            map_points: 64,
            ..by_maps.clone()
        };
        let (passes, maps, kernels, bytes_of_imperfect) = once(&imperfect);
        assert!(maps > 32 && maps <= 64, "{maps}");
        assert_eq!((passes, kernels), (6 + 4, [true, true, true, false]));
        // 64 maps of 8² texels with two coarser levels, 64 · 16 points of 16 + 12 bytes, 64 places.
        assert_eq!(bytes_of_imperfect - bytes, 4 * 64 * (64 + 16 + 4) + 28 * 1024 + 16 * 64);
        // Positions and normals of 16 · 8 pixels, and colours of 16 tiles with 64 places each; without a filter the least that a buffer has.
        let filtered = ManyLightSettings {
            filter: true,
            ..exact()
        };
        let (passes, _, _, bytes_of_filter) = once(&filtered);
        assert_eq!((passes, bytes_of_filter - bytes), (6, 24 * 128 + 12 * 16 * 64 - 16));
        // A picture without tiles has nothing to average.
        let one_tile = ManyLightSettings {
            interleave: 1,
            ..filtered
        };
        assert!(once(&one_tile).3 < bytes);
        // Surfaces, direct light, film.
        let (passes, _, kernels, _) = once(&of(UP_TO_ONCE, by_maps.clone()));
        assert_eq!((passes, kernels), (3, [true, false, false, false]));
        // Without direct light.
        let (passes, _, kernels, _) = once(&of(INDIRECT, exact()));
        assert_eq!((passes, kernels), (5, [false, true, true, false]));
        // Nothing that is seen emits: a black picture, and the film.
        let (passes, _, kernels, bytes) = once(&of("emitted", exact()));
        assert_eq!((passes, kernels, bytes), (2, [false; 4], 0));
    });
}

/// Where all surfaces scatter by Lambert's law kernels of virtual lights have no branch for anything else at either end, of `vpl` and of frames alike; a surface of another kind brings its own.
#[test]
fn lambert_ends_cost_no_branch() {
    const OTHERS: [&str; 5] = [
        "has_specular_layer",
        "has_metal",
        "has_transmission",
        "has_shading_normals",
        "has_normal_maps",
    ];
    with_gpu(|gpu| {
        // The same in all kernels.
        let branches = |ground: Material| {
            let mut scene = hall();
            scene.materials[0] = ground;
            let of_vpl = renderer(gpu, &scene, [4; 2], &settings()).pipelines();
            let of_frames = frames(gpu, &scene, [4; 2], &exact()).pipelines();
            let found = [
                (&of_vpl, "/vpl_append.comp"),
                (&of_vpl, "/vpl_gather.comp"),
                (&of_frames, "/vpl_append.comp"),
                (&of_frames, "/deferred_gather.comp"),
            ]
            .map(|(pipelines, kernel)| {
                let pipeline = pipelines.iter().find(|pipeline| pipeline.shader.ends_with(kernel));
                let constants = &pipeline.expect(kernel).specialization;
                OTHERS.map(|name| {
                    let constant = constants.iter().find(|(other, _)| *other == name);
                    constant.expect(name).1 != 0
                })
            });
            assert!(found.iter().all(|others| *others == found[0]), "{found:?}");
            found[0]
        };
        let matte = Material::lambert("ground", Vec3::splat(0.5));
        assert_eq!(branches(matte.clone()), [false; 5]);
        let coated = Material {
            specular: 1.0,
            roughness: 0.5,
            ..matte
        };
        assert_eq!(branches(coated), [true, false, false, false, false]);
        let metal = Material {
            roughness: 0.6,
            ..Material::mirror("ground", Vec3::splat(0.5))
        };
        assert_eq!(branches(metal), [false, true, false, false, false]);
        assert!(branches(Material::glass("ground", 1.5))[2]);
    });
}

#[test]
fn scenes_without_lights_are_black_and_walks_that_leave_do_no_harm() {
    with_gpu(|gpu| {
        let mut open = Scene {
            name: "floor".into(),
            ..Scene::default()
        };
        let matte = open.add_material(Material::lambert("matte", Vec3::splat(0.5)));
        open.place(floor("floor", matte, 1.0, 0.0));
        open.cameras.push(camera_down(0.8, 5.0));
        for size in [[13, 7], [1, 1], [3, 40]] {
            let mut dark = frames(gpu, &open, size, &exact());
            assert!(!dark.has_virtual_lights());
            assert!(advance(&mut dark, 2)[0].iter().all(|value| *value == 0.0));
            assert_eq!(dark.counts().walks.emitted, 0);
        }
        // A floor alone lights nothing that is seen of it; its own light is there.
        let mut lit = open.clone();
        add_point(&mut lit, Vec3::Y, Vec3::ONE);
        let mut once = frames(gpu, &lit, [13, 7], &of(INDIRECT, exact()));
        assert!(advance(&mut once, 2)[0].iter().all(|value| *value == 0.0));
        assert!(once.counts().lights > 0);
        // All walks leave.
        let mut away = open;
        away.add_light(
            "spot",
            LightKind::Spot {
                position: Vec3::Y,
                direction: Vec3::Y,
                intensity: Vec3::ONE,
                inner: 0.1,
                outer: 0.2,
            },
        );
        for (set, visibility) in [(ALL, Visibility::Rays), (INDIRECT, Visibility::Maps)] {
            let settings = ManyLightSettings { visibility, ..exact() };
            let mut away = frames(gpu, &away, [13, 7], &of(set, settings));
            assert!(advance(&mut away, 2)[0].iter().all(|value| *value == 0.0));
            let counts = away.counts();
            assert_eq!((counts.lights, counts.walks.escaped, counts.connections), (0, 128, 0));
            // Surfaces, direct light, film; where nothing else is shown a black picture, and the film.
            assert_eq!(counts.passes, if set == ALL { 2 * 3 } else { 2 * 2 });
        }
    });
}

/// The same lights, seen through everything, by imperfect maps, by coarse exact ones, by finer ones, and by rays.
#[test]
fn errors_of_visibility_fall_from_none_over_maps_to_rays() {
    with_gpu(|gpu| {
        let scene = hall();
        let mut tests = BTreeSet::new();
        let mut by = |visibility, map_side| {
            let settings = ManyLightSettings {
                lights: 48,
                interleave: 1,
                visibility,
                map_side,
                map_points: if map_side == 16 { 256 } else { 4096 },
                ..exact()
            };
            let mut renderer = frames(gpu, &scene, [24; 2], &of(INDIRECT, settings));
            let [radiance, _] = advance(&mut renderer, 2);
            let counts = renderer.counts();
            tests.insert((counts.lights, counts.connections, counts.visibility_tests));
            radiance
        };
        let rays = by(Visibility::Rays, 8);
        let error = |radiance: Vec<f32>| rmse(&radiance, &rays) / mean(&rays, 0);
        let none = by(Visibility::None, 8);
        // What is hidden is missing from no picture.
        assert!(none.iter().zip(&rays).all(|(none, rays)| none >= rays));
        let [none, coarse, fine] = [none, by(Visibility::Maps, 16), by(Visibility::Maps, 128)].map(error);
        let [few, many] = [16, 128].map(|side| error(by(Visibility::Imperfect, side)));
        println!("none {none:.4}, exact maps of 16 {coarse:.4}, of 128 {fine:.4}, imperfect {few:.4}, {many:.4}");
        assert!(
            none > 2.0 * coarse && coarse > 2.0 * fine && fine > 0.0,
            "{none} {coarse} {fine}"
        );
        assert!(
            none > 1.5 * few && few > 1.2 * many && many > fine,
            "{none} {few} {many} {fine}"
        );
        assert_eq!(tests.len(), 1, "whatever tells, the same pairs ask: {tests:?}");
    });
}

#[test]
fn what_frames_cannot_model_is_refused_by_name() {
    with_gpu(|gpu| {
        let mut unlit = hall();
        unlit.materials[0].unlit = true;
        let mut blended = hall();
        blended.materials[0].alpha_mode = AlphaMode::Blend;
        blended.materials[0].base_color.w = 0.5;
        for (scene, word) in [
            (builtin("builtin:fog-box"), "media"),
            (unlit, "unlit"),
            (blended, "alpha"),
        ] {
            let options = RenderOptions {
                technique: Some("many-light".into()),
                size: SIZE,
                spp: 1,
                ..RenderOptions::default()
            };
            let rendered = Renderer::new(gpu, &scene).and_then(|renderer| renderer.render(&options));
            let Err(error) = rendered else {
                panic!("{} was rendered", scene.name);
            };
            assert!(
                matches!(&error, Error::Unsupported { technique, .. } if technique == "many-light"),
                "{error}"
            );
            assert!(error.to_string().contains(word), "{error}");
            let made = ManyLight::new(gpu, upload(gpu, &scene), &scene.cameras[0], SIZE, exact());
            assert!(
                made.is_err_and(|error| error.to_string().contains(word)),
                "{}",
                scene.name
            );
        }
        let scene = upload(gpu, &hall());
        let camera = &hall().cameras[0];
        for (settings, word) in [
            (of("all", exact()), "path_set"),
            (ManyLightSettings { lights: 0, ..exact() }, "lights"),
            (
                ManyLightSettings {
                    lights: 10_000_000,
                    ..exact()
                },
                "lights",
            ),
            (
                ManyLightSettings {
                    interleave: 17,
                    ..exact()
                },
                "interleave",
            ),
            (ManyLightSettings { map_side: 4, ..exact() }, "map_side"),
            (
                ManyLightSettings {
                    map_points: 63,
                    ..exact()
                },
                "map_points",
            ),
            (ManyLightSettings { map_fill: 7, ..exact() }, "map_fill"),
        ] {
            let error = ManyLight::new(gpu, scene.clone(), camera, SIZE, settings).err();
            let text = error.map(|error| error.to_string()).unwrap_or_default();
            assert!(text.contains(word), "{word}: {text}");
        }
        assert!(ManyLight::new(gpu, scene, camera, [0, 4], exact()).is_err());
    });
}

#[test]
fn threads_and_widths_of_the_driver_never_show() {
    let hash = |variables: &[(&str, &str)]| hash_in_child(CHILD_TEST, CHILD, variables);
    let truth = hash(&[("LP_NUM_THREADS", "2")]);
    for variables in [
        [("LP_NUM_THREADS", "1"), ("LP_NATIVE_VECTOR_WIDTH", "128")],
        [("LP_NUM_THREADS", "2"), ("LP_NATIVE_VECTOR_WIDTH", "512")],
    ] {
        assert_eq!(hash(&variables), truth, "{variables:?}");
    }
}

#[test]
fn prints_its_hash_when_asked() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    with_gpu(|gpu| {
        let mut all = Vec::new();
        for visibility in [Visibility::Rays, Visibility::Maps, Visibility::Imperfect] {
            let settings = ManyLightSettings {
                visibility,
                map_side: 16,
                map_points: 256,
                lights: 50,
                filter: true,
                sampler: SamplerKind::Sobol,
                ..exact()
            };
            all.extend(bits(&picture(gpu, &hall(), [13, 7], &settings, 1)));
        }
        let settings = ManyLightSettings {
            placement: Placement::Rsm,
            rsm_side: 16,
            ..exact()
        };
        all.extend(bits(&picture(gpu, &furnished(), [13, 7], &settings, 1)));
        let settings = ManyLightSettings {
            gathering: Gathering::Reservoirs,
            candidates: 5,
            ..exact()
        };
        all.extend(bits(&picture(gpu, &furnished(), [13, 7], &settings, 1)));
        for placement in [Placement::Metropolis, Placement::Incremental] {
            let settings = ManyLightSettings { placement, ..exact() };
            all.extend(bits(&picture(gpu, &hall(), [13, 7], &settings, 1)));
        }
        let settings = ManyLightSettings {
            placement: Placement::Rsm,
            gathering: Gathering::Disc,
            rsm_side: 16,
            disc_samples: 50,
            ..exact()
        };
        all.extend(bits(&picture(gpu, &hall(), [13, 7], &settings, 1)));
        let settings = of("bounces=0..4,lobes=diffuse+glossy", exact());
        all.extend(bits(&picture(gpu, &furnished(), [13, 7], &settings, 2)));
        all.extend(history::bits_of_frames(gpu));
        print_hash(all);
    });
}
