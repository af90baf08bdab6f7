//! Scenes with media: collisions are vertices of both subpaths.

use super::*;
use clerestory::Error;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{Camera, Environment, Medium, Phase};
use clerestory::techniques::bidirectional::BidirectionalCounts;
use clerestory::techniques::photon_mapping::{PhotonMapper, PhotonSettings};
use clerestory_tests::child::{hash_in_child, print_hash};
use clerestory_tests::fog::{add_boundary, fog, uneven_density};
use clerestory_tests::gpu;
use clerestory_tests::render::{camera_aslant, floor};

/// Set in the processes that only print their picture's hash.
const CHILD: &str = "CLERESTORY_TEST_PRINT_BIDIRECTIONAL_HASH_OF_FOG";
const CHILD_TEST: &str = "media::prints_its_hash_when_asked";
const SAMPLES: u32 = 128;
const REFERENCE: u32 = 1024;
const FORWARD: Phase = Phase::HenyeyGreenstein { g: 0.6 };

/// The room with a lamp, filled with it.
pub(super) fn fog_room(phase: Phase) -> Scene {
    let mut scene = room();
    add_lamp(&mut scene, 3.0);
    scene.name = format!("fog with {phase:?}");
    scene.media.push(fog(phase));
    scene.surrounding = Some(0);
    scene
}

/// The room with a lamp and a point light, and a body of a denser medium behind an invisible boundary.
fn fog_body(phase: Phase) -> Scene {
    let mut scene = room();
    add_lamp(&mut scene, 3.0);
    add_point(&mut scene, Vec3::new(0.6, 0.6, 0.5), 0.5);
    scene.name = format!("body of fog with {phase:?}");
    let boundary = add_boundary(&mut scene, phase);
    scene.place(cuboid(
        "fog",
        boundary,
        Vec3::new(-0.2, -0.8, -0.7),
        Vec3::new(0.6, 0.1, 0.3),
    ));
    scene
}

/// Two bodies of fog, of which one is lit by a lamp and the other one is seen: a black plate hides the lamp from that one, but not the bodies from each other. No two collisions that light comes by
/// to the camera after two scatterings are near each other.
fn two_bodies() -> Scene {
    let mut scene = Scene {
        name: "two bodies".into(),
        ..Scene::default()
    };
    let boundary = add_boundary(&mut scene, Phase::Isotropic);
    scene.place(cuboid(
        "lit",
        boundary,
        Vec3::new(-0.9, -0.3, -0.3),
        Vec3::new(-0.3, 0.3, 0.3),
    ));
    scene.place(cuboid(
        "seen",
        boundary,
        Vec3::new(0.3, -0.3, -0.3),
        Vec3::new(0.9, 0.3, 0.3),
    ));
    let black = scene.add_material(Material::lambert("black", Vec3::ZERO));
    scene.place(cuboid(
        "plate",
        black,
        Vec3::new(-0.02, -0.05, -1.0),
        Vec3::new(0.02, 2.0, 1.0),
    ));
    let shining = scene.add_material(lamp(Vec3::splat(3.0)));
    scene.place(cuboid(
        "lamp",
        shining,
        Vec3::new(-0.8, 0.9, -0.2),
        Vec3::new(-0.4, 1.0, 0.2),
    ));
    let (eye, target) = (DVec3::new(0.6, 0.0, 2.5), DVec3::new(0.6, 0.0, 0.0));
    scene.cameras.push(Camera::look_at("main", eye, target, DVec3::Y, 0.2));
    scene
}

/// The body, with a density that changes across it, beside fog everywhere else if so wanted.
pub(super) fn cloud(around: bool) -> Scene {
    let mut scene = fog_body(FORWARD);
    scene.name = format!("cloud, in fog: {around}");
    scene.media[0].density = Some(uneven_density(DVec3::new(-0.2, -0.8, -0.7), DVec3::new(0.6, 0.1, 0.3)));
    if around {
        scene.media.push(fog(Phase::Isotropic));
        scene.surrounding = Some(1);
    }
    scene
}

/// All but lamps that the camera sees itself, whose outlines are rare and bright in pixels that they barely touch.
fn expect_agreement(gpu: &Gpu, scene: &Scene, samples: u32, reference: u32) {
    let settings = BidirectionalSettings {
        least_bounces: 1,
        ..settings()
    };
    let found = passes(gpu, scene, &settings, samples);
    found.expect_same_as(&scene.name, &traced(gpu, scene, "bounces=1..", reference));
}

fn bits(picture: &[Vec<f32>; 2]) -> Vec<u32> {
    picture.iter().flatten().map(|value| value.to_bits()).collect()
}

/// Coloured, isotropic and forward: in all of space, and behind a boundary that the camera is outside of.
#[test]
fn fog_agrees_with_the_path_tracer() {
    with_gpu(|gpu| {
        for scene in [fog_room(Phase::Isotropic), fog_room(FORWARD)] {
            expect_agreement(gpu, &scene, SAMPLES, REFERENCE);
        }
        let mut boxed = builtin("builtin:fog-box?boxes=none&sigma_s=4&lamp=1");
        boxed.name = "box of fog".into();
        expect_agreement(gpu, &boxed, SAMPLES, REFERENCE);
    });
}

/// Delta tracking to collisions and ratio tracking between them, alone and beside a homogeneous medium.
#[test]
fn grids_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        for around in [false, true] {
            expect_agreement(gpu, &cloud(around), SAMPLES, REFERENCE);
        }
    });
}

/// A body of fog in fog, whose boundary paths pass straight, beside a glass ball filled with a coloured medium.
#[test]
fn bodies_in_fog_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        let mut scene = fog_body(FORWARD);
        scene.name = "bodies in fog".into();
        add_sphere(&mut scene, "glass", DVec3::new(-0.6, -0.2, 0.4));
        let filling = scene.media.len() as u32;
        scene.media.push(Medium {
            sigma_s: Vec3::new(1.0, 0.5, 0.2),
            sigma_a: Vec3::new(0.1, 0.3, 0.6),
            ..Medium::default()
        });
        let glass = scene.materials.last_mut().expect("glass");
        assert!(glass.transmission > 0.0 && glass.thickness > 0.0, "{glass:?}");
        glass.interior = Some(filling);
        scene.media.push(fog(Phase::Isotropic));
        scene.surrounding = Some(filling + 1);
        // Caustics of a point are found by light subpaths alone.
        scene.lights.clear();
        expect_agreement(gpu, &scene, SAMPLES, 4 * REFERENCE);
    });
}

/// Rays of the camera begin in the body, and so do those that light subpaths are shown by.
#[test]
fn cameras_in_bodies_of_fog_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        let mut scene = fog_body(FORWARD);
        scene.name = "inside a body".into();
        let (eye, target) = (DVec3::new(0.5, -0.1, 0.2), DVec3::new(-0.6, -0.6, -0.6));
        scene.cameras = vec![Camera::look_at("inside", eye, target, DVec3::Y, 0.9)];
        let own = BidirectionalSettings {
            // Much of what is seen near the camera is shown by these.
            light_paths: 2048,
            least_bounces: 1,
            ..settings()
        };
        let reference = traced(gpu, &scene, "bounces=1..", REFERENCE);
        passes(gpu, &scene, &own, SAMPLES).expect_same_as(&scene.name, &reference);
    });
}

/// The first collision of light from infinity has a density per area across its beam; a lens sees the body out of focus.
#[test]
fn lenses_and_parallel_light_meet_bodies_of_fog() {
    with_gpu(|gpu| {
        let mut scene = Scene {
            name: "sunlit body".into(),
            ..Scene::default()
        };
        let matte = scene.add_material(Material::lambert("matte", Vec3::new(0.8, 0.7, 0.6)));
        scene.place(floor("floor", matte, 1.0, 0.0));
        let boundary = add_boundary(&mut scene, FORWARD);
        scene.place(cuboid(
            "fog",
            boundary,
            Vec3::new(-0.4, 0.1, -0.4),
            Vec3::new(0.4, 0.7, 0.4),
        ));
        scene.add_light(
            "sun",
            LightKind::Directional {
                direction: Vec3::new(0.3, -1.0, -0.2).normalize(),
                irradiance: Vec3::new(2.0, 1.5, 1.0),
            },
        );
        scene.cameras.push(Camera {
            lens_radius: 0.1,
            focus_distance: 2.0,
            ..camera_aslant()
        });
        expect_agreement(gpu, &scene, SAMPLES, REFERENCE);
    });
}

/// Eye paths alone find what a medium emits; what is emitted and scattered counts once.
#[test]
fn media_that_emit_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        let mut scene = fog_body(Phase::Isotropic);
        scene.name = "glowing body".into();
        scene.media[0].emission = Vec3::new(3.0, 2.0, 1.0);
        expect_agreement(gpu, &scene, 2 * SAMPLES, REFERENCE);
        let mut grid = cloud(false);
        grid.name = "glowing cloud".into();
        grid.media[0].emission = Vec3::new(1.0, 2.0, 3.0);
        expect_agreement(gpu, &grid, 2 * SAMPLES, REFERENCE);
    });
}

/// A closed box of walls that emit and reflect half of what arrives, in fog that absorbs nothing: the same radiance everywhere.
#[test]
fn furnaces_with_fog_are_even() {
    with_gpu(|gpu| {
        let mut scene = builtin("builtin:furnace-box?rho=0.5&emission=1");
        scene.media.push(Medium {
            sigma_s: Vec3::splat(1.0),
            phase: FORWARD,
            ..Medium::default()
        });
        scene.surrounding = Some(0);
        for means in passes(gpu, &scene, &settings(), SAMPLES).means {
            expect_mean_of("radiance", &means, 2.0, 0.0, 0.0);
        }
    });
}

/// Light that is scattered once, by fog or a wall, found by each way that can: by lamps that are met, by samples of the lamp, and by light subpaths that the camera sees.
#[test]
fn each_way_to_make_a_path_in_fog_finds_the_same_light() {
    with_gpu(|gpu| {
        // No collision is near the lamp or the camera, where a way alone has no bound.
        let mut scene = fog_body(FORWARD);
        scene.lights.clear();
        let reference = traced(gpu, &scene, "bounces=1", 8 * REFERENCE);
        for (strategies, samples) in [
            (Strategies::Emission, 16 * SAMPLES),
            (Strategies::LightSamples, 16 * SAMPLES),
            (Strategies::Splats, 2 * SAMPLES),
        ] {
            let alone = BidirectionalSettings {
                strategies,
                light_paths: 1024,
                least_bounces: 1,
                most_bounces: Some(1),
                ..settings()
            };
            let what = format!("{strategies:?}");
            passes(gpu, &scene, &alone, samples).expect_mean_as(&what, &reference);
        }
    });
}

/// By an eye path of one collision and a light subpath of another, which make all of these paths.
#[test]
fn joined_collisions_find_all_that_is_scattered_twice() {
    with_gpu(|gpu| {
        let scene = two_bodies();
        let reference = traced(gpu, &scene, "bounces=2", 16 * REFERENCE);
        assert!(reference.mean().iter().all(|(mean, _)| *mean > 0.0));
        let alone = BidirectionalSettings {
            strategies: Strategies::Connections,
            light_paths: 1024,
            least_bounces: 2,
            most_bounces: Some(2),
            ..settings()
        };
        passes(gpu, &scene, &alone, 16 * SAMPLES).expect_mean_as(&scene.name, &reference);
    });
}

/// The caustic that a glass ball throws into fog of a lamp that eye paths hardly ever meet: what photons bring there, blurred over their kernels, is what light subpaths bring.
#[test]
fn caustics_of_a_tiny_lamp_in_fog_are_those_of_photons() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:fog-box?sphere=glass&boxes=none&lamp=0.1");
        let set = "LS+VE".parse().expect("path set");
        let own = BidirectionalSettings {
            path_set: set,
            light_paths: 1024,
            ..settings()
        };
        let found = passes(gpu, &scene, &own, 512);
        let photons = PhotonSettings {
            path_set: set,
            photons: 1 << 15,
            seed: 5,
            ..PhotonSettings::default()
        };
        let mut mapper = match PhotonMapper::new(gpu, upload(gpu, &scene), &scene.cameras[0], SIZE, photons) {
            Ok(mapper) => mapper,
            Err(error) => panic!("{error}"),
        };
        let [mapped, _] = advance(&mut mapper, 64);
        for channel in 0..3 {
            let expected = mean(&mapped, channel);
            assert!(expected > 0.0);
            let means = &found.means[channel];
            let own = means.iter().sum::<f64>() / means.len() as f64;
            println!("channel {channel}: {own} by both ends, {expected} by photons");
            assert!((own / expected - 1.0).abs() < 0.1, "{own} instead of {expected}");
        }
    });
}

#[test]
fn pictures_of_media_do_not_depend_on_how_the_work_is_cut_up() {
    with_gpu(|gpu| {
        for (scene, set, parts) in [
            (fog_body(Phase::Isotropic), "all", [(64, 0, 0), (0, 1, 0)]),
            // By states.
            (cloud(true), "LVE|LDVE|LVDE", [(64, 64, 0), (0, 0, 3)]),
        ] {
            // Pixels that fill no workgroup.
            let base = BidirectionalSettings {
                path_set: set.parse().expect("path set"),
                light_paths: 128,
                samples_at_once: 4,
                connections: 3,
                ..settings()
            };
            let of = |settings: &BidirectionalSettings| {
                let mut renderer = renderer(gpu, &scene, [13, 7], settings);
                (bits(&advance(&mut renderer, 5)), renderer.counts())
            };
            let done = |c: &BidirectionalCounts| {
                [
                    c.light_vertices,
                    c.vertices_in_view,
                    c.connections,
                    c.shadow_rays,
                    c.collisions,
                ]
            };
            let (whole, counts) = of(&base);
            assert!(done(&counts).iter().all(|count| *count > 100), "{counts:?}");
            for (paths_in_flight, submission_work, ray_quota) in parts {
                let settings = BidirectionalSettings {
                    paths_in_flight,
                    submission_work,
                    ray_quota,
                    ..base.clone()
                };
                let what = format!("{}, {set}: {paths_in_flight} {submission_work} {ray_quota}", scene.name);
                let (parted, of_parted) = of(&settings);
                assert_eq!(parted, whole, "{what}");
                assert_eq!(done(&of_parted), done(&counts), "{what}");
            }
        }
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
    print_hash(bits(&advance(&mut renderer, 4)));
    clerestory_tests::assert_no_messages(&gpu);
}

/// No kernel, no binding's bytes and no bit of a picture, also where a medium is described that nothing holds.
#[test]
fn scenes_without_media_have_nothing_of_them() {
    with_gpu(|gpu| {
        let mut scene = room();
        add_lamp(&mut scene, 3.0);
        let of = |scene: &Scene| {
            let mut renderer = renderer(gpu, scene, SIZE, &settings());
            let picture = bits(&advance(&mut renderer, 4));
            let pipelines: Vec<_> = renderer.pipelines().iter().map(|info| info.shader).collect();
            (picture, renderer.counts(), pipelines)
        };
        let plain = of(&scene);
        scene.media.push(fog(Phase::Isotropic));
        assert_eq!(of(&scene), plain);
        let (_, counts, pipelines) = plain;
        assert_eq!(counts.collisions, 0);
        assert!(
            pipelines.iter().all(|shader| !shader.contains("medium")),
            "{pipelines:?}"
        );
        let in_fog = renderer(gpu, &fog_room(Phase::Isotropic), SIZE, &settings());
        let of_media = |shader: &&str| shader.contains("medium");
        let shaders: Vec<_> = in_fog.pipelines().iter().map(|info| info.shader).collect();
        // Walks, eye paths, what joins them, and what the camera is shown.
        assert_eq!(shaders.iter().copied().filter(of_media).count(), 4, "{shaders:?}");
    });
}

#[test]
fn what_media_have_no_light_subpaths_for_is_refused_by_name() {
    with_gpu(|gpu| {
        let mut sky = fog_room(Phase::Isotropic);
        sky.environment = Some(Environment::uniform(Vec3::ONE));
        let mut sun = fog_room(Phase::Isotropic);
        sun.add_light(
            "sun",
            LightKind::Directional {
                direction: -Vec3::Y,
                irradiance: Vec3::ONE,
            },
        );
        for scene in [sky, sun] {
            let options = RenderOptions {
                technique: Some("bdpt".into()),
                ..RenderOptions::default()
            };
            let renderer = Renderer::new(gpu, &scene).expect("scene");
            let error = renderer.start(&options).err().expect("a refusal");
            assert!(matches!(error, Error::Unsupported { .. }), "{error}");
            assert!(error.to_string().contains("light from infinity"), "{error}");
        }
    });
}
