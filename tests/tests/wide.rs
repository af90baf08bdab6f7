//! Kernels that traverse wide hierarchies, for both queries, against their Rust twin: hits to the bit, and the work exactly; and against the
//! binary hierarchy.
//!
//! Equality of bits with the twin is asked of software devices: Vulkan lets others divide with an error of 2.5 ULP, so there the hits are held to the
//! f64 test.

use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::trace::{Execution, PersistentThreads, Query, RayTracer, TraceSettings};
use clerestory::accel::wide::{WideBvh, WideSettings, WideTraversal};
use clerestory::accel::{FINISHED, Hit, Ray, RayIndex, TraversalCounters};
use clerestory::gpu::{DeviceKind, Gpu};
use clerestory::scene::{Instance, Scene};
use clerestory_hard_cases::{hit_bits, misses, soup_with_rays};
use clerestory_tests::random::Random;
use clerestory_tests::render::builtin;
use clerestory_tests::with_gpu;
use glam::Vec3;

/// Stops none of the rays here.
const QUOTA: u32 = 3000;
/// Stops many.
const SMALL_QUOTA: u32 = 40;

struct Case {
    what: String,
    triangles: Vec<[Vec3; 3]>,
    bvh: WideBvh,
    rays: Vec<Ray>,
}

impl Case {
    fn new(what: &str, triangles: Vec<[Vec3; 3]>, rays: Vec<Ray>) -> Self {
        Self {
            what: what.into(),
            bvh: WideBvh::build(&triangles, &WideSettings::default()).unwrap(),
            triangles,
            rays,
        }
    }
}

fn soup() -> (Vec<[Vec3; 3]>, Vec<Ray>) {
    soup_with_rays(51, 3000, 2048)
}

fn cases() -> Vec<Case> {
    let hard = clerestory_hard_cases::all();
    let sets = hard.iter().filter_map(|case| case.rays).flat_map(|rays| rays());
    let mut cases: Vec<Case> = sets.map(|set| Case::new(&set.what, set.triangles, set.rays)).collect();
    let (triangles, rays) = soup();
    let few = rays[..40].to_vec();
    cases.push(Case::new(
        "one triangle",
        vec![[Vec3::ZERO, Vec3::X, Vec3::Y]],
        few.clone(),
    ));
    cases.push(Case::new("nothing", Vec::new(), few));
    cases.push(Case::new("soup", triangles, rays));
    cases
}

/// Hits and work of the twin, and how often a ray was stopped.
fn twin(case: &Case, settings: &TraceSettings) -> (Vec<Hit>, TraversalCounters, u64) {
    let (mut counters, mut stops) = (TraversalCounters::default(), 0);
    let trace = |ray: &Ray| {
        let mut traversal = match settings.query {
            Query::Closest => WideTraversal::closest(ray),
            Query::Any => WideTraversal::any(ray),
        };
        let quota = u64::from(settings.ray_quota);
        loop {
            traversal.run(&case.bvh, ray, quota, &mut |_, _| true, &mut counters);
            if traversal.resume == FINISHED {
                return traversal.hit;
            }
            stops += 1;
        }
    };
    let hits = case.rays.iter().map(trace).collect();
    (hits, counters, stops)
}

/// Traces all cases with the same settings. How often rays were stopped.
fn check(gpu: &Gpu, cases: &[Case], asked: &TraceSettings) -> u64 {
    let exact = gpu.caps().kind == DeviceKind::Cpu;
    // Kept, so that all share a pipeline.
    let mut tracers = Vec::new();
    let mut stopped = 0;
    for case in cases {
        let settings = &asked.fitted(gpu.caps(), case.bvh.device_traversal());
        let what = format!("{}, {settings:?}", case.what);
        let tracer = RayTracer::new(gpu, &case.bvh, settings).unwrap();
        let traced = tracer.trace(&case.rays).unwrap();
        tracers.push(tracer);
        stopped += traced.unfinished;
        let (hits, work, stops) = twin(case, settings);
        for ((ray, found), expected) in case.rays.iter().zip(&traced.hits).zip(&hits) {
            if exact {
                assert_eq!(hit_bits(found), hit_bits(expected), "{what}: {ray:?}");
            } else if settings.query == Query::Closest || !found.is_hit() {
                assert!(!misses(&case.triangles, ray, found), "{what}: {ray:?}");
            }
        }
        if exact {
            assert_eq!(traced.work, work, "{what}");
            assert_eq!(traced.unfinished, stops, "{what}");
        }
    }
    stopped
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
        check(gpu, &[Case::new("soup", triangles, rays)], &asked);
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

fn triangles_of(scene: &Scene) -> Vec<[Vec3; 3]> {
    let of_instance = |instance: &Instance| {
        let mesh = &scene.meshes[instance.mesh as usize];
        let place = |i: u32| {
            instance
                .transform
                .transform_point3(mesh.positions[i as usize].as_dvec3())
                .as_vec3()
        };
        mesh.triangles.iter().map(|t| t.map(place)).collect::<Vec<_>>()
    };
    scene.instances.iter().flat_map(of_instance).collect()
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

#[test]
fn kernels_give_a_million_rays_the_hits_of_the_binary_tree() {
    with_gpu(|gpu| {
        let mut random = Random(52);
        let mut tracers = Vec::new();
        for (address, count) in [
            ("builtin:conference", 350_000),
            ("builtin:box-city?n=2000", 350_000),
            ("builtin:sphere-flake?depth=2&frequency=4", 300_000),
        ] {
            let scene = builtin(address);
            let triangles = triangles_of(&scene);
            let eye = scene.cameras[0].transform.translation.as_vec3();
            let rays = rays_among(&triangles, eye, count, &mut random);
            let binary = Bvh2::build(&triangles, &Bvh2Settings::default()).unwrap();
            let wide = WideBvh::build(&triangles, &WideSettings::default()).unwrap();
            let indexes: [&dyn RayIndex; 2] = [&binary, &wide];
            let [expected, found] = indexes.map(|index| {
                let asked = settings(Query::Closest, 8000).fitted(gpu.caps(), index.device_traversal());
                let tracer = RayTracer::new(gpu, index, &asked).unwrap();
                let hits = tracer.trace(&rays).unwrap().hits;
                tracers.push(tracer);
                hits
            });
            let met = expected.iter().filter(|hit| hit.is_hit()).count();
            assert!(met > count / 4, "{address}: {met} hits");
            for ((ray, expected), found) in rays.iter().zip(&expected).zip(&found) {
                assert_eq!(hit_bits(expected), hit_bits(found), "{address}: {ray:?}");
            }
        }
    });
}
