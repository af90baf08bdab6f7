//! A step is a bounded piece of work, whatever the scene: a host looks at its time and at wishes to stop between two of them. Work is counted, never timed.

use std::time::Duration;

use clerestory::gpu::{DeviceKind, Gpu};
use clerestory::plan::{self, Goal};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{Camera, Environment, Material, Scene, SceneProfile};
use clerestory::settings::Settings;
use clerestory::techniques::photon_mapping::{MapQueue, PhotonMapper, PhotonSettings};
use clerestory::techniques::{self, PathTracerSettings, View};
use clerestory_hard_cases::scenes::{equal_triangles, place_sparse_grid};
use clerestory_tests::render::{builtin, cuboid, independent, tracer, upload};
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec3};

/// Loop iterations that count of a place in one dispatch, at most: those of a walk through a grid, 2048 that count fourfold, and of eight searches for the next
/// surface, 2048 each.
const PLACE_WORK: u64 = 4 * 2048 + 8 * 2048;

/// A grid of which next to nothing is dense, above a floor and under a uniform sky. A path's way through one of density 10⁶ takes a million tentative collisions.
fn sparse_grid(density: f32) -> Scene {
    let mut scene = Scene {
        name: "sparse grid".into(),
        environment: Some(Environment::uniform(Vec3::ONE)),
        ..Scene::default()
    };
    place_sparse_grid(&mut scene, density);
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
    scene.place(cuboid(
        "floor",
        white,
        Vec3::new(-1.0, -0.2, -1.0),
        Vec3::new(2.0, -0.1, 2.0),
    ));
    let (eye, target) = (DVec3::new(0.5, 0.6, 2.5), DVec3::splat(0.45));
    scene.cameras.push(Camera::look_at("main", eye, target, DVec3::Y, 0.6));
    scene
}

/// Places that may be under way together when the work of a submission is used up: a workgroup of 64 for each processor, or all.
fn under_way(gpu: &Gpu, paths: u64) -> u64 {
    let processors = std::thread::available_parallelism().map_or(1, usize::from) as u64;
    match gpu.caps().kind {
        DeviceKind::Cpu => paths.min(64 * processors),
        _ => paths,
    }
}

#[test]
fn a_step_through_a_sparse_grid_is_one_submission_of_bounded_work() {
    with_gpu(|gpu| {
        // Two places' work: all but a few paths of the first bounce end in dense cells.
        const WORK: u64 = 1 << 14;
        let settings = PathTracerSettings {
            submission_work: WORK,
            ..independent()
        };
        let size = [64, 64];
        let mut tracer = tracer(gpu, &sparse_grid(1e6), size, &settings);
        // A ray that counts may have less than a unit of it rounded down, and only adds what it counts once it has ended.
        let bound = WORK + under_way(gpu, 64 * 64) * PLACE_WORK;
        let mut worked = 0;
        for step in 0..24 {
            let before = tracer.counters();
            let done = tracer
                .step(1)
                .unwrap()
                .expect("a million collisions take more than some steps");
            let after = tracer.counters();
            let work = after.work - before.work;
            assert_eq!((after.submissions - before.submissions, done.timings.len()), (1, 1));
            assert!(work <= bound, "step {step}: {work} of at most {bound}");
            assert_eq!((done.done, after.waves), (0, 0), "step {step}");
            worked += work;
            // What is there can be looked at in between.
            if step == 12 {
                let (picture, _) = tracer.picture().unwrap();
                assert!(picture.require("samples").unwrap().values().iter().all(|n| *n == 0.0));
            }
        }
        let counters = tracer.counters();
        println!("{counters:?}");
        // Submissions were parted, and each of them did something.
        assert!(counters.postponed > 12 && worked > 12 * WORK, "{counters:?}");
        assert!(counters.density_lookups > 0);
    });
}

#[test]
fn waves_that_stop_in_media_have_the_same_picture() {
    with_gpu(|gpu| {
        let scene = sparse_grid(500.0);
        let of = |submission_work| {
            let settings = PathTracerSettings {
                submission_work,
                ..independent()
            };
            let mut path = tracer(gpu, &scene, [12, 12], &settings);
            while path.step(2).unwrap().is_some() {}
            let (picture, _) = path.picture().unwrap();
            let layer = |name| picture.require(name).unwrap().values().to_vec();
            (
                [layer("radiance"), layer("variance"), layer("samples")],
                path.counters(),
            )
        };
        let ((whole, one), (parted, many)) = (of(0), of(1 << 14));
        println!("{one:?} {many:?}");
        assert!(whole == parted, "stops show");
        assert!(many.postponed > 0 && many.submissions > one.submissions, "{many:?}");
        assert_eq!(
            (one.extend_rays, one.shadow_rays, one.density_lookups),
            (many.extend_rays, many.shadow_rays, many.density_lookups)
        );
    });
}

#[test]
fn photon_maps_in_parts_have_the_same_picture() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:cornell-box?sphere=glass");
        let of = |submission_work, queue| {
            let settings = PhotonSettings {
                photons: 4096,
                // Every query meets many photons.
                radius: 0.2,
                queue,
                submission_work,
                seed: 3,
                ..PhotonSettings::default()
            };
            let camera = &scene.cameras[0];
            let mut mapper = PhotonMapper::new(gpu, upload(gpu, &scene), camera, [16, 16], settings).unwrap();
            let (mut steps, mut most) = (0, 0);
            while let Some(step) = mapper.step(2).unwrap() {
                (steps, most) = (steps + 1, most.max(step.timings.len()));
            }
            // Photons, the device's build of their map, eye paths.
            assert!(most <= 3, "{most} submissions in a step");
            let (picture, _) = mapper.picture().unwrap();
            let radiance = picture.require("radiance").unwrap().values().to_vec();
            let bits: Vec<u32> = radiance.iter().map(|value| value.to_bits()).collect();
            (bits, steps, mapper.counts(), mapper.eye_counters())
        };
        let whole = of(0, MapQueue::Slots);
        for queue in [MapQueue::Slots, MapQueue::Compacted, MapQueue::Blocks] {
            let parted = of(64, queue);
            assert!(whole.0 == parted.0, "{queue:?}: stops show");
            assert_eq!(whole.2.gather, parted.2.gather, "{queue:?}: queries");
            assert_eq!(whole.2.photons, parted.2.photons, "{queue:?}: photons");
            assert!(
                parted.3.postponed > 0 && parted.1 > whole.1,
                "{queue:?}: {:?}",
                parted.3
            );
        }
    });
}

#[test]
fn a_step_of_every_technique_is_a_few_submissions() {
    with_gpu(|gpu| {
        // Light that is reflected for long, and a sky over surfaces alone for the technique that knows nothing else.
        let scenes = [builtin("builtin:furnace-box?rho=0.9&emission=0.1"), equal_triangles(2)];
        for card in techniques::all() {
            let scene = scenes
                .iter()
                .find(|scene| (card.refusals)(&SceneProfile::of(scene)).is_empty())
                .unwrap();
            let view = View {
                camera: &scene.cameras[0],
                size: [16, 16],
                seed: 1,
                aovs: false,
            };
            let mut technique = card
                .prepare(gpu, upload(gpu, scene), &view, &Settings::default())
                .unwrap();
            let (mut steps, mut submissions) = (0, 0);
            while let Some(step) = technique.step(2).unwrap() {
                let count = step.timings.len();
                // Photons, the device's build of their map, eye paths; others have one.
                assert!(count <= 3, "{}: {count} submissions in a step", card.id);
                (steps, submissions) = (steps + 1, submissions + count);
            }
            println!("{}: {submissions} submissions in {steps} steps", card.id);
            assert!(submissions > 0, "{}", card.id);
        }
    });
}

#[test]
fn budgets_end_renderings_that_would_not() {
    with_gpu(|gpu| {
        let renderer = Renderer::new(gpu, &sparse_grid(1e6)).unwrap();
        let options = RenderOptions {
            size: [64, 64],
            spp: 4,
            time_budget: Some(Duration::from_millis(1)),
            ..RenderOptions::default()
        };
        let mut rendering = renderer.start(&options).unwrap();
        let mut last = 0.0;
        while let Some(progress) = rendering.step().unwrap() {
            assert!(progress.seconds >= last, "progress goes on");
            last = progress.seconds;
        }
        let rendered = rendering.finish().unwrap();
        // No path has ended: every pixel is there, without a sample.
        assert!(rendered.report.stopped_early);
        assert_eq!(rendered.report.samples, [0, 0]);
        let radiance = rendered.picture.require("radiance").unwrap();
        assert!(radiance.values().iter().all(|value| *value == 0.0));
    });
}

#[test]
fn automatic_choices_end_where_first_pilots_do_not() {
    with_gpu(|gpu| {
        let renderer = Renderer::new(gpu, &sparse_grid(1e6)).unwrap();
        let options = RenderOptions {
            size: [64, 64],
            ..RenderOptions::default()
        };
        let [error, time] = [(Some(0.1), None), (None, Some(Duration::from_millis(1)))];
        // A wish to stop, and a time that is over.
        for ((error, time), goes_on) in [(error, false), (time, true)] {
            let refused = plan::plan(&renderer, &options, Goal { error, time }, &mut || goes_on);
            let message = refused.map(|plan| plan.chosen).unwrap_err().to_string();
            assert!(
                message.contains("first pilot") && message.contains("time budget"),
                "{message}"
            );
        }
    });
}

#[test]
fn rays_through_equal_triangles_are_parted_and_none_is_lost() {
    with_gpu(|gpu| {
        let scene = equal_triangles(10_000);
        let of = |submission_work, ray_quota| {
            let settings = PathTracerSettings {
                submission_work,
                ray_quota,
                ..independent()
            };
            let mut path = tracer(gpu, &scene, [8, 8], &settings);
            while let Some(step) = path.step(1).unwrap() {
                assert_eq!(step.timings.len(), 1);
            }
            let (picture, _) = path.picture().unwrap();
            (picture.require("radiance").unwrap().values().to_vec(), path.counters())
        };
        let (whole, one) = of(0, 32_768);
        println!("{one:?}");
        assert_eq!((one.stalls, one.postponed), (0, 0));
        // Rays that wait for work, those that a quota stops, and both.
        for (work, quota) in [(1 << 14, 32_768), (0, 1024), (1 << 14, 1024)] {
            let (parted, many) = of(work, quota);
            println!("{many:?}");
            assert!(whole == parted, "work {work}, quota {quota}");
            assert_eq!((many.extend_rays, many.shadow_rays), (one.extend_rays, one.shadow_rays));
            assert_eq!(many.postponed > 0, work > 0);
            assert_eq!(many.stalls > 0, quota < 10_000);
        }
    });
}
