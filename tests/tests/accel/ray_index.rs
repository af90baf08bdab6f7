//! The trace kernels against their Rust twin, bit for bit, and both against f64.
//!
//! Equality of bits is asked of software devices: Vulkan lets others divide with an error of 2.5 ULP, so there the hits are held to the
//! f64 test alone.

use clerestory::accel::bvh2::{Bvh2, Bvh2Settings, Traversal};
use clerestory::accel::yardstick::ray_engine::RayEngine;
use clerestory::accel::{FINISHED, Hit, Ray, RayIndex, TraversalCounters};
use clerestory::gpu::shaders::accel::trace_rays;
use clerestory::gpu::shaders::sets::IndexSet;
use clerestory::gpu::{
    Category, DeviceKind, Gpu, compute_to_transfer, rw_compute_to_compute, transfer_to_compute, wide_counter,
};
use clerestory_hard_cases::{hit_bits, misses};
use clerestory_tests::random::Random;
use clerestory_tests::with_gpu;
use glam::Vec3;

/// What a kernel made of a buffer of rays.
struct Traced {
    hits: Vec<Hit>,
    counters: TraversalCounters,
    dispatches: u32,
}

/// Runs the kernel with a quota until every ray is finished.
fn trace(gpu: &Gpu, bvh: &Bvh2, rays: &[Ray], index_quota: u32, trace_any: bool) -> Traced {
    let spec = trace_rays::Spec {
        index_quota,
        index_count: true,
        trace_any,
        ..Default::default()
    };
    let pipeline = gpu.compute_pipeline::<trace_rays::Kernel>(&spec).unwrap();
    let format = clerestory::gpu::ash::vk::Format::R32G32B32A32_UINT;
    let quarters = gpu
        .texels_with(bvh.name(), Category::Index, format, bvh.texels())
        .unwrap();
    let index = IndexSet {
        index_texels: &quarters,
    };
    let ray_buffer = gpu.buffer_with("rays", Category::Work, rays).unwrap();
    let hits = gpu
        .buffer_with("hits", Category::Work, &vec![0u32; rays.len() * 4])
        .unwrap();
    let resume = gpu
        .buffer_with("resume", Category::Work, &vec![0u32; rays.len()])
        .unwrap();
    let status = gpu
        .buffer_with(
            "status",
            Category::Work,
            &[0u32; size_of::<trace_rays::TraceStatus>() / 4],
        )
        .unwrap();
    let set = trace_rays::Set0 {
        trace_rays: ray_buffer.view(),
        trace_hits: hits.view(),
        trace_resume: resume.view(),
        trace_status: status.view(),
    };
    let mut traced = Traced {
        hits: Vec::new(),
        counters: TraversalCounters::default(),
        dispatches: 0,
    };
    loop {
        let mut recorder = gpu.recorder("trace").unwrap();
        recorder
            .pass("trace", |pass| {
                pass.fill(status.view(), 0)?;
                pass.barrier(&[transfer_to_compute(&status)]);
                // Two dispatches, so that `first_ray` is used.
                let half = rays.len() as u32 / 2;
                for (first_ray, ray_count) in [(0, half), (half, rays.len() as u32 - half)] {
                    let push = trace_rays::Push { first_ray, ray_count };
                    pass.dispatch(
                        &pipeline,
                        &[&set, &index],
                        &push,
                        [pipeline.groups_for(ray_count), 1, 1],
                    )?;
                    pass.barrier(&[
                        rw_compute_to_compute(&hits),
                        rw_compute_to_compute(&resume),
                        rw_compute_to_compute(&status),
                    ]);
                }
                pass.barrier(&[compute_to_transfer(&status)]);
                Ok(())
            })
            .unwrap();
        recorder.submit().unwrap().wait().unwrap();
        let s = gpu.read::<trace_rays::TraceStatus>(status.view(), 1).unwrap()[0];
        traced.counters.nodes += wide_counter(s.node_visits);
        traced.counters.triangles += wide_counter(s.triangle_tests);
        traced.counters.iterations += wide_counter(s.iterations);
        traced.dispatches += 1;
        if s.unfinished == 0 {
            break;
        }
        assert!(traced.dispatches < 10_000, "rays never end");
    }
    traced.hits = gpu.read::<Hit>(hits.view(), rays.len()).unwrap();
    traced
}

/// The twin, with the same quota.
fn twin(bvh: &Bvh2, rays: &[Ray], quota: u32, any: bool) -> Traced {
    let mut traced = Traced {
        hits: Vec::new(),
        counters: TraversalCounters::default(),
        dispatches: 1,
    };
    for ray in rays {
        let mut traversal = if any {
            Traversal::any(ray)
        } else {
            Traversal::closest(ray)
        };
        let mut runs = 0;
        while traversal.resume != FINISHED {
            traversal.run(bvh, ray, u64::from(quota), &mut |_, _| true, &mut traced.counters);
            runs += 1;
        }
        traced.dispatches = traced.dispatches.max(runs);
        traced.hits.push(traversal.hit);
    }
    traced
}

fn check(gpu: &Gpu, what: &str, triangles: &[[Vec3; 3]], rays: &[Ray], quotas: &[u32]) {
    let exact = gpu.caps().kind == DeviceKind::Cpu;
    let bvh = Bvh2::build(triangles, &Bvh2Settings::default()).unwrap();
    let mut first: Option<Vec<[u32; 4]>> = None;
    for quota in quotas {
        let closest = trace(gpu, &bvh, rays, *quota, false);
        let any = trace(gpu, &bvh, rays, *quota, true);
        let same = first.get_or_insert_with(|| closest.hits.iter().map(hit_bits).collect());
        for (i, ray) in rays.iter().enumerate() {
            assert_eq!(
                hit_bits(&closest.hits[i]),
                same[i],
                "{what}: quota {quota} changes the hit of {ray:?}"
            );
            assert_eq!(any.hits[i].is_hit(), closest.hits[i].is_hit(), "{what}: {ray:?}");
            assert!(
                !misses(triangles, ray, &closest.hits[i]),
                "{what}: {ray:?} meets something nearer than {:?}",
                closest.hits[i]
            );
        }
        if exact {
            for (traced, any_hit) in [(&closest, false), (&any, true)] {
                let twin = twin(&bvh, rays, *quota, any_hit);
                for (i, ray) in rays.iter().enumerate() {
                    assert_eq!(
                        hit_bits(&traced.hits[i]),
                        hit_bits(&twin.hits[i]),
                        "{what}, quota {quota}, any {any_hit}: {ray:?}"
                    );
                }
                assert_eq!(traced.counters, twin.counters, "{what}, quota {quota}, any {any_hit}");
                assert_eq!(
                    traced.dispatches, twin.dispatches,
                    "{what}, quota {quota}, any {any_hit}"
                );
            }
        }
        if *quota < 50 && rays.len() > 1000 {
            assert!(closest.dispatches > 1, "{what}: the quota {quota} stops nothing");
        }
    }
}

#[test]
fn kernels_are_their_twins_on_soups() {
    with_gpu(|gpu| {
        let mut random = Random(1);
        let triangles: Vec<[Vec3; 3]> = (0..3000)
            .map(|_| {
                let centre = 10.0 * random.vector();
                [0; 3].map(|_| centre + 0.5 * random.vector())
            })
            .collect();
        let rays: Vec<Ray> = (0..2048)
            .map(|i| {
                let mut r = Ray::new(
                    12.0 * random.vector(),
                    random.direction() * random.choose(&[1.0, 1e-3, 1e4]),
                );
                if i % 3 == 0 {
                    (r.t_min, r.t_max) = (random.range(0.0, 5.0), random.range(3.0, 20.0));
                }
                r
            })
            .collect();
        check(gpu, "soup", &triangles, &rays, &[32_768, 40]);
    });
}

#[test]
fn kernels_are_their_twins_on_hard_cases() {
    with_gpu(|gpu| {
        for set in clerestory_hard_cases::all()
            .iter()
            .filter_map(|case| case.rays)
            .flat_map(|rays| rays())
        {
            // Of many rays some stop at a small quota.
            let quotas: &[u32] = if set.rays.len() > 1000 {
                &[32_768, 40]
            } else {
                &[32_768]
            };
            check(gpu, &set.what, &set.triangles, &set.rays, quotas);
        }
    });
}

/// A pass for each triangle, and the nearest kept: the hits of the host's twin to the bit, and the distances that an index finds.
#[test]
fn the_ray_engine_finds_what_indexes_find() {
    with_gpu(|gpu| {
        let mut random = Random(11);
        let mut point = |scale: f32| scale * (2.0 * Vec3::from_array([0; 3].map(|_: i32| random.unit())) - 1.0);
        // More than are submitted together.
        let triangles: Vec<[Vec3; 3]> = (0..300)
            .map(|_| {
                let middle = point(2.0);
                [0; 3].map(|_: i32| middle + point(0.8))
            })
            .collect();
        let mut rays: Vec<Ray> = (0..1000).map(|_| Ray::new(point(3.0), point(1.0))).collect();
        rays[7].t_max = 0.5;
        rays[8].direction = [0.0; 3];
        rays[9].origin[1] = f32::NAN;
        let engine = RayEngine::new(gpu).unwrap();
        let (found, timings) = engine.trace(&triangles, &rays).unwrap();
        assert_eq!(timings.len(), 2);
        let index = Bvh2::build(&triangles, &Bvh2Settings::default()).unwrap();
        let mut hits = 0;
        for (ray, found) in rays.iter().zip(&found) {
            let (twin, by_index) = (RayEngine::on_host(&triangles, ray), index.closest_hit(ray));
            assert_eq!(twin.is_hit(), by_index.is_hit());
            assert_eq!(twin.t.to_bits(), by_index.t.to_bits(), "{ray:?}");
            if gpu.caps().kind == DeviceKind::Cpu {
                assert_eq!(hit_bits(found), hit_bits(&twin), "{ray:?}");
            }
            hits += u32::from(twin.is_hit());
        }
        assert!((200..900).contains(&hits), "{hits}");
        let all_miss = engine.trace(&[], &rays).unwrap().0;
        assert!(all_miss.iter().all(|hit| !hit.is_hit()));
        assert!(engine.trace(&triangles, &[]).unwrap().0.is_empty());
    });
}
