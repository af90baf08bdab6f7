//! A step is a bounded piece of work, whatever the scene: a host looks at its time and at stop requests between two of them. Work is counted, never timed.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use clerestory::gpu::{BufferDesc, Category, DeviceKind, Gpu, PipelineInfo, Recorder};
use clerestory::plan::{self, Goal};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{Camera, Environment, LightKind, Material, Scene, SceneProfile};
use clerestory::settings::Settings;
use clerestory::techniques::photon_mapping::{MapQueue, PhotonMapper, PhotonSettings};
use clerestory::techniques::preview::{PreviewMethod, PreviewSettings};
use clerestory::techniques::{
    self, Accumulated, Frame, FrameMethod, FrameTarget, Part, PathTracerSettings, Technique, View,
};
use clerestory::transport::PathSet;
use clerestory::{Error, Result};
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
            // Photons, and the device's build of their map.
            assert!(most <= 2, "{most} submissions in a step");
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
                // Photons, and the device's build of their map; others have one.
                assert!(count <= 2, "{}: {count} submissions in a step", card.id);
                (steps, submissions) = (steps + 1, submissions + count);
            }
            println!("{}: {submissions} submissions in {steps} steps", card.id);
            assert!(submissions > 0, "{}", card.id);
        }
    });
}

/// What a frame method of a host was asked for: a part of what frames share, or of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Asked {
    Begin(Part),
    Frame(u32, Part),
}

/// A frame method that writes nothing: functions say in how many parts what frames share falls, and hear what was asked for.
struct Hollow<C, H> {
    begin_parts: C,
    /// Of a frame.
    parts: u32,
    hear: H,
}

impl<C, H> FrameMethod for Hollow<C, H>
where
    C: FnMut() -> Option<u32> + Send,
    H: FnMut(Asked) -> Result<()> + Send,
{
    fn begin_parts(&mut self, _: &Gpu) -> Result<Option<u32>> {
        Ok((self.begin_parts)())
    }

    fn begin(&mut self, recorder: &mut Recorder) -> Result<()> {
        self.begin_part(recorder, Part::WHOLE)
    }

    fn begin_part(&mut self, _: &mut Recorder, part: Part) -> Result<()> {
        (self.hear)(Asked::Begin(part))
    }

    fn parts(&mut self, _: &Gpu, _: &Camera, _: [u32; 2]) -> Result<u32> {
        Ok(self.parts)
    }

    fn record(&mut self, _: &mut Recorder, frame: &Frame<'_>, _: &FrameTarget<'_>) -> Result<()> {
        (self.hear)(Asked::Frame(frame.number, frame.part))
    }

    fn path_set(&self) -> PathSet {
        PathSet::EMITTED
    }

    fn pipelines(&self) -> Vec<PipelineInfo> {
        Vec::new()
    }
}

#[test]
fn parts_of_frames_are_asked_for_in_order_each_in_a_submission_of_its_own() {
    with_gpu(|gpu| {
        let scene = equal_triangles(2);
        let view = View {
            camera: &scene.cameras[0],
            size: [4, 4],
            seed: 1,
            aovs: false,
        };
        for parts in [[1, 1], [1, 3], [3, 1], [2, 4]] {
            let all = |of| (0..of).map(move |number| Part { number, of });
            let frame = |number| all(parts[1]).map(move |part| Asked::Frame(number, part));
            let begin = || all(parts[0]).map(Asked::Begin);
            let expected: Vec<_> = begin().chain(frame(0)).chain(frame(1)).collect();
            for fails_at in std::iter::once(None).chain(expected.iter().copied().map(Some)) {
                let asked = Arc::new(Mutex::new(Vec::new()));
                let (heard, mut fails_next) = (Arc::clone(&asked), fails_at);
                let method = Hollow {
                    begin_parts: move || Some(parts[0]),
                    parts: parts[1],
                    hear: move |asked: Asked| -> Result<()> {
                        // Once.
                        if fails_next == Some(asked) {
                            fails_next = None;
                            return Err(Error::setting("part", "asked for", "fails once"));
                        }
                        heard.lock().unwrap().push(asked);
                        Ok(())
                    },
                };
                let mut technique = Accumulated::new(gpu, &view, method).unwrap();
                let (mut submissions, mut failures) = (0, 0);
                loop {
                    match technique.step(2) {
                        Ok(Some(step)) => submissions += step.timings.len(),
                        Ok(None) => break,
                        Err(_) => failures += 1,
                    }
                }
                assert_eq!(failures, fails_at.iter().count(), "{parts:?}");
                let mut found = std::mem::take(&mut *asked.lock().unwrap());
                // Of a submission that failed, what came before is asked for again.
                found.dedup();
                assert_eq!(found, expected, "{parts:?}, fails at {fails_at:?}");
                let begun = if parts[0] > 1 { parts[0] } else { 0 };
                // Those before one that fails are not told of.
                let all_told = fails_at.is_some() || submissions as u32 >= begun + parts[1];
                assert!(all_told, "{parts:?}: {submissions}");
                // Another camera begins anew in the middle of a frame.
                technique.set_camera(view.camera).unwrap();
                technique.step(1).unwrap();
                technique.set_camera(view.camera).unwrap();
                asked.lock().unwrap().clear();
                while technique.step(1).unwrap().is_some() {}
                let expected: Vec<_> = begin().chain(frame(0)).collect();
                assert_eq!(*asked.lock().unwrap(), expected, "{parts:?}");
            }
        }
    });
}

/// How often a method is asked until it knows its parts, and how many they are.
fn counted_parts(gpu: &Gpu, method: &mut impl FrameMethod) -> (u32, u32) {
    let mut asked = (1..).map(|times| (times, method.begin_parts(gpu).unwrap()));
    asked.find_map(|(times, of)| Some((times, of?))).unwrap()
}

#[test]
fn steps_end_between_two_counts_of_parts() {
    with_gpu(|gpu| {
        let scene = equal_triangles(2);
        let view = View {
            camera: &scene.cameras[0],
            size: [4, 4],
            seed: 1,
            aovs: false,
        };
        let (counted, drawn) = (Arc::new(AtomicU32::new(0)), Arc::new(AtomicU32::new(0)));
        let (counts, draws) = (Arc::clone(&counted), Arc::clone(&drawn));
        let method = Hollow {
            // Takes longer than a step has, and knows at the third time.
            begin_parts: move || {
                std::thread::sleep(Duration::from_millis(300));
                let counted = counts.fetch_add(1, Ordering::Relaxed) + 1;
                (counted == 3).then_some(2)
            },
            parts: 1,
            hear: move |asked: Asked| -> Result<()> {
                if let Asked::Begin(_) = asked {
                    draws.fetch_add(1, Ordering::Relaxed);
                }
                Ok(())
            },
        };
        let mut technique = Accumulated::new(gpu, &view, method).unwrap();
        let now = || [&counted, &drawn].map(|count| count.load(Ordering::Relaxed));
        // The third count is the last, and a part is drawn behind it.
        for expected in [[1, 0], [2, 0], [3, 1]] {
            assert!(technique.step(1).unwrap().is_some());
            assert_eq!(now(), expected);
        }
        while technique.step(1).unwrap().is_some() {}
        assert_eq!(now(), [3, 2]);
    });
}

#[test]
fn shadow_maps_are_measured_one_at_a_time() {
    with_gpu(|gpu| {
        let mut scene = equal_triangles(6000);
        for x in [0.3, 0.5, 0.7] {
            let position = Vec3::new(x, 0.5, 1.5);
            scene.add_light(
                "lamp",
                LightKind::Point {
                    position,
                    intensity: Vec3::ONE,
                },
            );
        }
        let settings = PreviewSettings {
            shadow_side: 256,
            ..PreviewSettings::default()
        };
        let on_device = upload(gpu, &scene);
        let mut preview = PreviewMethod::new(gpu, Arc::clone(&on_device), [16, 16], settings).unwrap();
        let (asked, parts) = counted_parts(gpu, &mut preview);
        assert!(asked == 3 && parts >= 6, "{asked}, {parts}");
        assert_eq!(counted_parts(gpu, &mut preview), (1, parts), "known by now");
        // Maps are of places: one that has moved is measured again, and the others with it.
        let moved = LightKind::Point {
            position: Vec3::new(0.5, 0.6, 1.5),
            intensity: Vec3::ONE,
        };
        on_device.move_light(gpu, 1, &moved).unwrap();
        assert_eq!(counted_parts(gpu, &mut preview).0, 3);
    });
}

/// A frame by `method`, recorded as a whole and part by part: the same bits, and how many parts there are.
fn frame_parts(gpu: &Gpu, scene: &Scene, size: [u32; 2], mut method: impl FrameMethod, least: [u32; 2]) {
    let camera = &scene.cameras[0];
    let radiance = gpu
        .buffer(&BufferDesc::storage("frame", FrameTarget::bytes(size), Category::Film))
        .unwrap();
    let target = FrameTarget {
        radiance: &radiance,
        size,
    };
    let mut of = |begin: u32, frames: u32| {
        gpu.upload(&radiance, 0, &vec![[f32::NAN; 3]; (size[0] * size[1]) as usize])
            .unwrap();
        for number in 0..begin {
            let mut recorder = gpu.recorder("begin").unwrap();
            match begin {
                1 => method.begin(&mut recorder),
                of => method.begin_part(&mut recorder, Part { number, of }),
            }
            .unwrap();
            recorder.submit().unwrap().wait().unwrap();
        }
        for number in 0..frames {
            let mut recorder = gpu.recorder("frame").unwrap();
            let part = Part { number, of: frames };
            let frame = Frame {
                camera,
                seed: 3,
                number: 5,
                part,
            };
            method.record(&mut recorder, &frame, &target).unwrap();
            recorder.submit().unwrap().wait().unwrap();
        }
        let parts = [
            counted_parts(gpu, &mut method).1,
            method.parts(gpu, camera, size).unwrap(),
        ];
        let values = gpu.read::<u32>(radiance.view(), 3 * (size[0] * size[1]) as usize);
        (values.unwrap(), parts)
    };
    let (whole, parts) = of(1, 1);
    assert!(parts[0] >= least[0] && parts[1] >= least[1], "{parts:?}");
    let (parted, _) = of(parts[0], parts[1]);
    assert!(whole == parted, "{parts:?} parts show");
    assert!(whole.iter().any(|bits| f32::from_bits(*bits) > 0.0), "nothing is seen");
}

#[test]
fn draws_of_triangles_that_cover_all_are_parted_and_the_same() {
    with_gpu(|gpu| {
        let mut scene = equal_triangles(6000);
        let size = [320, 320];
        let (position, intensity) = (Vec3::new(0.5, 0.5, 1.5), Vec3::ONE);
        scene.add_light("lamp", LightKind::Point { position, intensity });
        let settings = PreviewSettings {
            shadow_side: 256,
            ..PreviewSettings::default()
        };
        let preview = PreviewMethod::new(gpu, upload(gpu, &scene), size, settings).unwrap();
        frame_parts(gpu, &scene, size, preview, [3, 4]);
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
        // A stop request, and a time that is over.
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
        let scene = equal_triangles(4_000);
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
            assert_eq!(many.stalls > 0, quota < 4_000);
        }
    });
}
