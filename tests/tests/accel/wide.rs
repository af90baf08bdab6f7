//! Kernels that traverse wide hierarchies, for both queries, against their Rust twin: hits to the bit, and the work exactly; and against the
//! binary hierarchy. What the device builds and refits, against the host.

use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::lbvh::{self, BuildQuality, LbvhSettings};
use clerestory::accel::trace::{Execution, PersistentThreads, Query, RayTracer, TraceSettings};
use clerestory::accel::wide::{LEAF_SIZE, WideBuilder, WideBvh, WideRefitter, WideSettings, refit};
use clerestory::accel::{Hit, Ray, RayIndex};
use clerestory::gpu::{Access, Buffer, BufferDesc, Category, DeviceKind};
use clerestory_hard_cases::{hit_bits, misses, soup_with_rays};
use clerestory_tests::random::Random;
use clerestory_tests::render::builtin;
use clerestory_tests::traced::{Case, check};
use clerestory_tests::with_gpu;
use glam::Vec3;

/// Stops none of the rays here.
const QUOTA: u32 = 3000;
/// Stops many.
const SMALL_QUOTA: u32 = 40;

fn case(what: &str, triangles: Vec<[Vec3; 3]>, rays: Vec<Ray>) -> Case<WideBvh> {
    Case {
        what: what.into(),
        index: WideBvh::build(&triangles, &WideSettings::default()).unwrap(),
        triangles,
        rays,
    }
}

fn soup() -> (Vec<[Vec3; 3]>, Vec<Ray>) {
    soup_with_rays(51, 3000, 2048)
}

fn cases() -> Vec<Case<WideBvh>> {
    let hard = clerestory_hard_cases::all();
    let sets = hard.iter().filter_map(|case| case.rays).flat_map(|rays| rays());
    let mut cases: Vec<_> = sets.map(|set| case(&set.what, set.triangles, set.rays)).collect();
    let (triangles, rays) = soup();
    let few = rays[..40].to_vec();
    cases.push(case("one triangle", vec![[Vec3::ZERO, Vec3::X, Vec3::Y]], few.clone()));
    cases.push(case("nothing", Vec::new(), few));
    cases.push(case("soup", triangles, rays));
    cases
}

fn settings(query: Query, ray_quota: u32) -> TraceSettings {
    TraceSettings {
        query,
        ray_quota,
        count: true,
        ..TraceSettings::ray_per_thread()
    }
}

#[test]
fn kernels_are_their_twins() {
    with_gpu(|gpu| {
        let cases = cases();
        for query in [Query::Closest, Query::Any] {
            assert_eq!(check(gpu, &cases, &settings(query, QUOTA)), 0);
        }
    });
}

#[test]
fn rays_that_a_quota_stops_go_on() {
    with_gpu(|gpu| {
        let cases = cases();
        for query in [Query::Closest, Query::Any] {
            let stopped = check(gpu, &cases, &settings(query, SMALL_QUOTA));
            assert!(stopped > 1000, "{query:?}: {stopped} stops");
        }
    });
}

#[test]
fn persistent_threads_trace_every_ray_once() {
    with_gpu(|gpu| {
        let (triangles, rays) = soup();
        let threads = PersistentThreads {
            groups: 3,
            batch: gpu.caps().subgroup_size,
            fetches: 3,
            subgroups: 1,
        };
        let asked = TraceSettings {
            execution: Execution::Persistent(threads),
            ..settings(Query::Closest, QUOTA)
        };
        check(gpu, &[case("soup", triangles, rays)], &asked);
    });
}

#[test]
fn quotas_that_could_lose_rays_are_refused() {
    with_gpu(|gpu| {
        let (triangles, _) = soup();
        let bvh = WideBvh::build(&triangles, &WideSettings::default()).unwrap();
        let asked = settings(Query::Closest, 60_000);
        let refused = RayTracer::new(gpu, &bvh, &asked).is_err();
        assert_eq!(refused, gpu.caps().kind == DeviceKind::Cpu);
        let fitted = asked.fitted(gpu.caps(), bvh.device_traversal());
        assert!(RayTracer::new(gpu, &bvh, &fitted).is_ok());
        assert!(!refused || fitted.ray_quota > 1000, "{fitted:?}");
    });
}

/// Rays of a scene: half from its camera's place to triangles, half from triangles in random directions.
fn rays_among(triangles: &[[Vec3; 3]], eye: Vec3, count: usize, random: &mut Random) -> Vec<Ray> {
    let mut ray = |i: usize| {
        let [a, b, c] = triangles[random.below(triangles.len())];
        let centre = (a + b + c) / 3.0;
        let (origin, direction) = match i % 2 {
            0 => (eye, centre - eye),
            _ => (centre, random.direction()),
        };
        Ray {
            origin: origin.into(),
            t_min: if i.is_multiple_of(2) { 0.0 } else { 1e-4 },
            direction: direction.into(),
            t_max: f32::INFINITY,
        }
    };
    (0..count).map(&mut ray).collect()
}

/// Traces so many rays of each of three scenes in both hierarchies, in parts.
fn check_against_the_binary_tree(counts: [usize; 3], part: usize) {
    with_gpu(|gpu| {
        let mut random = Random(52);
        let addresses = [
            "builtin:conference",
            "builtin:box-city?n=2000",
            "builtin:sphere-flake?depth=2&frequency=4",
        ];
        for (address, count) in addresses.into_iter().zip(counts) {
            let scene = builtin(address);
            let triangles = scene.triangles().map(|(triangle, _)| triangle).collect::<Vec<_>>();
            let eye = scene.cameras[0].transform.translation.as_vec3();
            let binary = Bvh2::build(&triangles, &Bvh2Settings::default()).unwrap();
            let wide = WideBvh::build(&triangles, &WideSettings::default()).unwrap();
            let indexes: [&dyn RayIndex; 2] = [&binary, &wide];
            let tracers = indexes.map(|index| {
                let asked = settings(Query::Closest, 8000).fitted(gpu.caps(), index.device_traversal());
                RayTracer::new(gpu, index, &asked).unwrap()
            });
            let (mut met, mut left) = (0, count);
            while left > 0 {
                let rays = rays_among(&triangles, eye, left.min(part), &mut random);
                let [expected, found] = [0, 1].map(|i| tracers[i].trace(&rays).unwrap().hits);
                met += expected.iter().filter(|hit| hit.is_hit()).count();
                for ((ray, expected), found) in rays.iter().zip(&expected).zip(&found) {
                    assert_eq!(hit_bits(expected), hit_bits(found), "{address}: {ray:?}");
                }
                left -= rays.len();
            }
            assert!(met > count / 4, "{address}: {met} hits");
        }
    });
}

#[test]
fn kernels_give_a_million_rays_the_hits_of_the_binary_tree() {
    check_against_the_binary_tree([350_000, 350_000, 300_000], 350_000);
}

#[test]
#[ignore = "ten million rays in both hierarchies take a minute"]
fn kernels_give_ten_million_rays_the_hits_of_the_binary_tree() {
    check_against_the_binary_tree([3_500_000, 3_500_000, 3_000_000], 500_000);
}

/// Settings of what the device builds, and the host likewise.
fn on_device(code_bits: u32, triangle_cost: f32) -> WideSettings {
    WideSettings {
        binary: LbvhSettings {
            code_bits,
            leaf_size: LEAF_SIZE,
            quality: BuildQuality::Fast,
            ..LbvhSettings::default()
        },
        triangle_cost,
    }
}

/// Triangles of the hard cases, and of soups with some that rays cannot meet.
fn sets_of_triangles() -> Vec<(String, Vec<[Vec3; 3]>)> {
    let mut random = Random(53);
    let mut sets: Vec<_> = cases().into_iter().map(|case| (case.what, case.triangles)).collect();
    for count in [2, 3, 4, 9, 64, 1000, 20_000] {
        let mut soup: Vec<[Vec3; 3]> = (0..count)
            .map(|_| {
                let centre = 10.0 * random.vector();
                [0; 3].map(|_| centre + 0.3 * random.vector())
            })
            .collect();
        if count > 100 {
            soup[7][1].z = f32::NAN;
            soup[8][1] = soup[8][0];
            soup[9].iter_mut().for_each(|v| v.x = -0.0);
            soup[11] = soup[10];
        }
        sets.push((format!("soup of {count}"), soup));
    }
    sets
}

fn assert_same(found: &WideBvh, expected: &WideBvh, what: &str) {
    let (nodes, others) = (found.nodes(), expected.nodes());
    assert_eq!(nodes.len(), others.len(), "{what}");
    for (place, (node, other)) in nodes.iter().zip(others).enumerate() {
        assert_eq!(node, other, "{what}: node {place}");
    }
    for (place, (texel, other)) in found.texels().iter().zip(expected.texels()).enumerate() {
        assert_eq!(texel, other, "{what}: texel {place}, of {} nodes", nodes.len());
    }
    assert_eq!(found.texels().len(), expected.texels().len(), "{what}");
    assert_eq!(found.statistics(), expected.statistics(), "{what}");
}

#[test]
fn device_builds_are_the_twins() {
    with_gpu(|gpu| {
        let sets = sets_of_triangles();
        for settings in [on_device(30, 0.4), on_device(63, 2.0)] {
            let builder = WideBuilder::new(gpu, &settings).unwrap();
            for (what, triangles) in &sets {
                let build = builder.build(triangles).unwrap();
                let host = WideBvh::build(triangles, &settings).unwrap();
                assert_same(&build.index, &host, what);
                let Some(resident) = builder.build_resident(triangles).unwrap() else {
                    assert!(host.statistics().triangles < 2, "{what}");
                    continue;
                };
                for stage in ["costs", "nodes"] {
                    assert_eq!(build.timings.count(&format!("wide: {stage}")), 1, "{what}: {stage}");
                }
                let texels = host.texels();
                let there: Vec<[u32; 4]> = gpu.read(resident.texels.buffer().view(), texels.len()).unwrap();
                assert!(there == texels, "{what}");
                let mut statistics = resident.statistics;
                assert!(statistics.bytes >= host.statistics().bytes, "{what}");
                statistics.bytes = host.statistics().bytes;
                assert_eq!(statistics, host.statistics(), "{what}");
            }
        }
    });
}

#[test]
fn host_trees_are_collapsed_by_the_device_as_by_the_host() {
    with_gpu(|gpu| {
        let settings = WideSettings::default();
        let builder = WideBuilder::new(gpu, &settings).unwrap();
        let binned = |leaf_size| Bvh2Settings {
            leaf_size,
            ..Bvh2Settings::default()
        };
        for (what, triangles) in &sets_of_triangles() {
            let trees = [
                lbvh::build(triangles, &settings.binary).unwrap(),
                Bvh2::build(triangles, &binned(1)).unwrap(),
            ];
            for tree in trees {
                let device = builder.collapse(&tree).unwrap();
                assert_same(&device.index, &WideBvh::collapse(&tree, &settings).unwrap(), what);
            }
        }
        let heap = vec![[Vec3::ZERO, Vec3::X, Vec3::Y]; 40];
        let large = Bvh2::build(&heap, &binned(8)).unwrap();
        assert!(builder.collapse(&large).is_err());
        assert!(builder.buffers(1).is_err());
    });
}

#[test]
fn a_build_and_rays_go_into_one_submission() {
    with_gpu(|gpu| {
        let (triangles, rays) = soup();
        let of_device = on_device(30, 0.4);
        let builder = WideBuilder::new(gpu, &of_device).unwrap();
        let count = triangles.len() as u32;
        let binary = builder.binary().buffers(count).unwrap();
        let buffers = builder.buffers(count).unwrap();
        let indices: Vec<u32> = (0..count).collect();
        gpu.upload(&binary.corners, 0, &triangles).unwrap();
        gpu.upload(&binary.indices, 0, &indices).unwrap();
        let host = WideBvh::build(&triangles, &of_device).unwrap();
        let asked = settings(Query::Closest, QUOTA).fitted(gpu.caps(), host.device_traversal());
        let tracer = RayTracer::with_texels(gpu, buffers.texels.clone(), host.device_traversal(), &asked).unwrap();
        let traced = tracer.buffers(rays.len() as u32).unwrap();
        gpu.upload(&traced.rays, 0, &rays).unwrap();
        let there = buffers.texels.buffer();
        let copied = BufferDesc::storage("copy", there.bytes(), Category::Index);
        let copied = gpu.buffer(&copied).unwrap();
        let mut recorder = gpu.recorder("wide").unwrap();
        // The second build begins where copies and rays may read what the first has left.
        for _ in 0..2 {
            builder.record(&mut recorder, &binary, &buffers).unwrap();
            let copy = recorder.pass("copy", |pass| {
                pass.memory_barrier(Access::TRANSFER, Access::TRANSFER);
                pass.copy(there.view(), copied.view())
            });
            copy.unwrap();
            tracer.record(&mut recorder, &traced, 1).unwrap();
        }
        recorder.submit().unwrap().wait().unwrap();
        assert_eq!(tracer.unfinished(&traced).unwrap(), 0);
        let hits: Vec<Hit> = gpu.read(traced.hits.view(), rays.len()).unwrap();
        assert!(hits.iter().any(Hit::is_hit));
        for (ray, hit) in rays.iter().zip(&hits) {
            assert!(!misses(&triangles, ray, hit), "{ray:?}");
        }
        for buffer in [there, &copied] {
            let texels: Vec<[u32; 4]> = gpu.read(buffer.view(), host.texels().len()).unwrap();
            assert!(texels == host.texels());
        }
        let few = builder.buffers(count - 1).unwrap();
        let mut recorder = gpu.recorder("wide").unwrap();
        assert!(builder.record(&mut recorder, &binary, &few).is_err());
    });
}

/// What is moved by up to a twentieth of its size, some of it to where it has no area.
fn moved(triangles: &[[Vec3; 3]], random: &mut Random) -> Vec<[Vec3; 3]> {
    let places = triangles.iter().flatten().filter(|v| v.abs().max_element() < 1e9);
    let size = places.fold(0.0f32, |size, v| size.max(v.abs().max_element()));
    let mut triangles = triangles.to_vec();
    for (i, triangle) in triangles.iter_mut().enumerate() {
        let shift = 0.05 * size * random.vector();
        triangle
            .iter_mut()
            .for_each(|v| *v = (*v + shift).clamp(Vec3::splat(-size), Vec3::splat(size)));
        if i % 30 == 4 {
            triangle[1] = triangle[0];
        }
    }
    triangles
}

#[test]
fn refits_follow_copies_in_one_submission() {
    with_gpu(|gpu| {
        let (triangles, _) = soup();
        let refitter = WideRefitter::new(gpu).unwrap();
        let before = WideBvh::build(&triangles, &WideSettings::default()).unwrap();
        let there = refitter.upload(&before).unwrap();
        let moved = moved(&triangles, &mut Random(55));
        let mut corners = moved.clone();
        for triangle in &mut corners {
            if triangle[0] == triangle[1] {
                *triangle = [triangle[0]; 3];
            }
        }
        gpu.upload(&there.corners, 0, &corners).unwrap();
        let texels = there.texels.buffer();
        let copied = BufferDesc::storage("copy", texels.bytes(), Category::Index);
        let copied = gpu.buffer(&copied).unwrap();
        let mut recorder = gpu.recorder("wide refit").unwrap();
        let copy = recorder.pass("copy", |pass| pass.copy(texels.view(), copied.view()));
        copy.unwrap();
        refitter.record(&mut recorder, &there).unwrap();
        recorder.submit().unwrap().wait().unwrap();
        let read = |buffer: &Buffer| -> Vec<[u32; 4]> { gpu.read(buffer.view(), before.texels().len()).unwrap() };
        assert!(read(&copied) == before.texels());
        assert!(read(texels) == refit(&before, &moved).unwrap().texels());
    });
}

#[test]
fn device_refits_are_the_twins() {
    with_gpu(|gpu| {
        let mut random = Random(54);
        let refitter = WideRefitter::new(gpu).unwrap();
        let builder = WideBuilder::new(gpu, &on_device(30, 0.4)).unwrap();
        for (what, triangles) in &sets_of_triangles() {
            let before = WideBvh::build(triangles, &WideSettings::default()).unwrap();
            let there = refitter.upload(&before).unwrap();
            assert!(there.bytes() >= before.statistics().bytes, "{what}");
            let (same, _) = refitter.refit(&there, &before, triangles).unwrap();
            assert_same(&same, &before, what);
            // Twice, since a refit begins from what the last one left.
            for _ in 0..2 {
                let triangles = moved(triangles, &mut random);
                let (device, _) = refitter.refit(&there, &before, &triangles).unwrap();
                assert_same(&device, &refit(&before, &triangles).unwrap(), what);
            }
            if let Some(resident) = builder.build_resident(triangles).unwrap() {
                let before = builder.build(triangles).unwrap().index;
                let there = refitter.resident(&resident).unwrap();
                let triangles = moved(triangles, &mut random);
                let (device, _) = refitter.refit(&there, &before, &triangles).unwrap();
                assert_same(&device, &refit(&before, &triangles).unwrap(), what);
            }
            if !triangles.is_empty() {
                assert!(refitter.refit(&there, &before, &triangles[1..]).is_err(), "{what}");
            }
        }
    });
}
