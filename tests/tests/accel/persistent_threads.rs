//! Both models of execution, a thread per ray and persistent threads on a queue, against the Rust twin of the traversal: every hit, all
//! counters, no ray lost and none traced twice. And what becomes of a queue without a quota on a driver that silently ends loops.
//!
//! Equality of bits with the twin is asked of software devices: Vulkan lets others divide with an error of 2.5 ULP, so there the hits are
//! held to the f64 test.

use clerestory::Error;
use clerestory::accel::RayIndex;
use clerestory::accel::bvh2::{Bvh2, Bvh2Settings, Traversal};
use clerestory::accel::trace::{Execution, PersistentThreads, RayTracer, TraceSettings, Traced};
use clerestory::accel::{FINISHED, Hit, Ray, TraversalCounters, lbvh};
use clerestory::gpu::ash::vk;
use clerestory::gpu::shaders::accel::trace_queue;
use clerestory::gpu::shaders::sets::IndexSet;
use clerestory::gpu::{Category, DeviceKind, Gpu, SOFTWARE_LOOP_CAP};
use clerestory_hard_cases::{hit_bits, misses};
use clerestory_tests::driver::caps_loops;
use clerestory_tests::random::Random;
use clerestory_tests::with_gpu;
use glam::Vec3;

fn soup(count: u32, random: &mut Random) -> Vec<[Vec3; 3]> {
    let mut triangle = || {
        let centre = 10.0 * random.vector();
        [0; 3].map(|_| centre + 0.5 * random.vector())
    };
    (0..count).map(|_| triangle()).collect()
}

fn rays(count: u32, random: &mut Random) -> Vec<Ray> {
    let mut ray = || Ray::new(12.0 * random.vector(), random.direction());
    (0..count).map(|_| ray()).collect()
}

/// Hits and work of the twin, and how often a ray was stopped.
fn twin(bvh: &Bvh2, rays: &[Ray], quota: u32) -> (Vec<Hit>, TraversalCounters, u64) {
    let (mut counters, mut stops) = (TraversalCounters::default(), 0);
    let trace = |ray: &Ray| {
        let mut traversal = Traversal::closest(ray);
        loop {
            traversal.run(bvh, ray, u64::from(quota), &mut |_, _| true, &mut counters);
            if traversal.resume == FINISHED {
                return traversal.hit;
            }
            stops += 1;
        }
    };
    let hits = rays.iter().map(trace).collect();
    (hits, counters, stops)
}

fn check(gpu: &Gpu, what: &str, triangles: &[[Vec3; 3]], bvh: &Bvh2, rays: &[Ray], settings: &TraceSettings) -> Traced {
    let traced = RayTracer::new(gpu, bvh, settings).unwrap().trace(rays).unwrap();
    assert_eq!(traced.hits.len(), rays.len(), "{what}");
    if gpu.caps().kind == DeviceKind::Cpu {
        let (hits, work, stops) = twin(bvh, rays, settings.ray_quota);
        for (i, (found, expected)) in traced.hits.iter().zip(&hits).enumerate() {
            assert_eq!(hit_bits(found), hit_bits(expected), "{what}: ray {i}");
        }
        assert_eq!((traced.work, traced.unfinished), (work, stops), "{what}");
    } else {
        for (ray, hit) in rays.iter().zip(&traced.hits) {
            assert!(!misses(triangles, ray, hit), "{what}: {ray:?}");
        }
    }
    traced
}

#[test]
fn both_models_trace_every_ray_once_and_find_what_the_twin_finds() {
    with_gpu(|gpu| {
        let mut random = Random(3);
        let triangles = soup(2000, &mut random);
        let all = rays(2500, &mut random);
        let bvh = Bvh2::build(&triangles, &Bvh2Settings::default()).unwrap();
        let lbvh = lbvh::build(&triangles, &lbvh::LbvhSettings::default()).unwrap();
        for count in [0, 1, 31, 32, 33, all.len()] {
            let rays = &all[..count];
            // A small quota stops many rays.
            for ray_quota in [512, 40] {
                let ray_per_thread = TraceSettings {
                    ray_quota,
                    count: true,
                    ..TraceSettings::ray_per_thread()
                };
                let what = format!("{count} rays, quota {ray_quota}");
                let one = check(gpu, &what, &triangles, &bvh, rays, &ray_per_thread);
                assert_eq!((one.batches, one.fetched_rays), (0, 0));
                if ray_quota == 40 && count == all.len() {
                    assert!(one.unfinished > 0 && one.rounds > 1, "{what}: the quota stops nothing");
                }
                for (groups, batch, fetches) in [(4, 8, 32), (3, 20, 5), (1, 64, 1)] {
                    let threads = PersistentThreads {
                        groups,
                        batch,
                        fetches,
                        subgroups: 1,
                    };
                    let settings = TraceSettings {
                        execution: Execution::Persistent(threads),
                        ..ray_per_thread
                    };
                    let what = format!("{what}, {threads:?}");
                    let queue = check(gpu, &what, &triangles, &bvh, rays, &settings);
                    let batches = count.div_ceil(batch as usize) as u32;
                    assert_eq!(queue.rounds, one.rounds, "{what}");
                    assert_eq!(queue.batches, u64::from(queue.rounds * batches), "{what}");
                    assert_eq!(queue.fetched_rays, u64::from(queue.rounds) * count as u64, "{what}");
                    assert_eq!(
                        queue.dispatches,
                        queue.rounds * batches.div_ceil(groups * fetches),
                        "{what}"
                    );
                    for (a, b) in queue.hits.iter().zip(&one.hits) {
                        assert_eq!(hit_bits(a), hit_bits(b), "{what}: the models differ");
                    }
                }
            }
        }
        let settings = TraceSettings {
            count: true,
            ..TraceSettings::persistent(gpu.caps())
        };
        let untuned = check(gpu, "linear hierarchy", &triangles, &lbvh, &all, &settings);
        let mut tracer = RayTracer::new(gpu, &lbvh, &settings).unwrap();
        let groups = tracer.tune(&all[..500]).unwrap();
        assert!(groups.is_some_and(u32::is_power_of_two), "{groups:?}");
        let tuned = tracer.trace(&all).unwrap();
        assert_eq!((&tuned.hits, tuned.work), (&untuned.hits, untuned.work));
    });
}

/// The kernel alone, in one dispatch of one workgroup that is to empty the queue, without any quota: rays that are not done at the end.
fn left_by_an_unbounded_queue(gpu: &Gpu, bvh: &Bvh2, rays: &[Ray]) -> usize {
    let spec = trace_queue::Spec {
        local_size_x: gpu.caps().subgroup_size,
        trace_fetches: 0,
        trace_batch: gpu.caps().subgroup_size,
        index_quota: u32::MAX,
        index_count: false,
        ..Default::default()
    };
    let pipeline = gpu.compute_pipeline::<trace_queue::Kernel>(&spec).unwrap();
    let quarters = gpu
        .texels_with("index", Category::Index, vk::Format::R32G32B32A32_UINT, bvh.texels())
        .unwrap();
    let ray_buffer = gpu.buffer_with("rays", Category::Work, rays).unwrap();
    let zeroed = |name, words: usize| gpu.buffer_with(name, Category::Work, &vec![0u32; words]).unwrap();
    let (hits, resume) = (zeroed("hits", 4 * rays.len()), zeroed("resume", rays.len()));
    let (status, queue) = (zeroed("status", 4), zeroed("queue", 3));
    let mut recorder = gpu.recorder("unbounded").unwrap();
    recorder
        .pass("unbounded", |pass| {
            let set = trace_queue::Set0 {
                trace_rays: ray_buffer.view(),
                trace_hits: hits.view(),
                trace_resume: resume.view(),
                trace_status: status.view(),
                trace_queue: queue.view(),
            };
            let index = IndexSet {
                index_texels: &quarters,
            };
            let push = trace_queue::Push {
                first_ray: 0,
                ray_count: rays.len() as u32,
            };
            pass.dispatch(&pipeline, &[&set, &index], &push, [1, 1, 1])
        })
        .unwrap();
    recorder.submit().unwrap().wait().unwrap();
    let resume = gpu.read::<u32>(resume.view(), rays.len()).unwrap();
    resume.iter().filter(|word| **word != FINISHED).count()
}

#[test]
fn a_queue_without_a_quota_loses_rays_where_loops_are_capped_and_one_with_a_quota_none() {
    with_gpu(|gpu| {
        let mut random = Random(4);
        let triangles = soup(2000, &mut random);
        let rays = rays(60_000, &mut random);
        let bvh = Bvh2::build(&triangles, &Bvh2Settings::default()).unwrap();
        let lanes = u64::from(gpu.caps().subgroup_size);
        let (_, work, _) = twin(&bvh, &rays, u32::MAX);
        // Lanes run together, so a subgroup runs at least its share of the iterations.
        assert!(
            work.iterations / lanes > u64::from(SOFTWARE_LOOP_CAP),
            "too little work to reach the cap: {work:?}"
        );
        let lost = left_by_an_unbounded_queue(gpu, &bvh, &rays);
        let driver = &gpu.caps().driver;
        println!("{driver}: {lost} of {} rays lost without a quota", rays.len());
        // The engine's quotas assume of every software device what this asks of the one at hand.
        assert_eq!(lost > 0, caps_loops(gpu), "{driver}: {lost} rays lost");
        let one_group = PersistentThreads {
            groups: 1,
            ..PersistentThreads::on(gpu.caps())
        };
        let settings = TraceSettings {
            execution: Execution::Persistent(one_group),
            count: true,
            ..TraceSettings::persistent(gpu.caps())
        };
        let traced = check(gpu, "with a quota", &triangles, &bvh, &rays, &settings);
        assert_eq!(traced.fetched_rays, rays.len() as u64 * u64::from(traced.rounds));
    });
}

#[test]
fn a_queue_of_many_rays_traces_each_once() {
    with_gpu(|gpu| {
        let mut random = Random(5);
        let triangles = soup(300, &mut random);
        let rays = rays(262_144, &mut random);
        let bvh = Bvh2::build(&triangles, &Bvh2Settings::default()).unwrap();
        let settings = TraceSettings {
            count: true,
            ..TraceSettings::persistent(gpu.caps())
        };
        // Every ray has its hit, and no more were fetched than there are: none was fetched twice.
        let traced = check(gpu, "262,144 rays", &triangles, &bvh, &rays, &settings);
        assert_eq!(traced.fetched_rays, rays.len() as u64 * u64::from(traced.rounds));
    });
}

#[test]
fn settings_that_could_lose_rays_are_refused() {
    with_gpu(|gpu| {
        let bvh = Bvh2::build(&[[Vec3::ZERO, Vec3::X, Vec3::Y]], &Bvh2Settings::default()).unwrap();
        let good = TraceSettings::persistent(gpu.caps());
        let threads = PersistentThreads::on(gpu.caps());
        let with = |threads| TraceSettings {
            execution: Execution::Persistent(threads),
            ..good
        };
        let mut wrong = vec![
            with(PersistentThreads { groups: 0, ..threads }),
            with(PersistentThreads { batch: 0, ..threads }),
            with(PersistentThreads { fetches: 0, ..threads }),
            TraceSettings { ray_quota: 32, ..good },
        ];
        if gpu.caps().kind == DeviceKind::Cpu {
            wrong.push(with(PersistentThreads {
                fetches: 100,
                ..threads
            }));
            wrong.push(TraceSettings {
                ray_quota: SOFTWARE_LOOP_CAP,
                ..TraceSettings::ray_per_thread()
            });
        }
        for settings in wrong {
            let refused = RayTracer::new(gpu, &bvh, &settings);
            assert!(
                matches!(refused, Err(Error::Setting { .. })),
                "{settings:?}: {refused:?}"
            );
        }
        assert!(RayTracer::new(gpu, &bvh, &good).is_ok());
    });
}
