//! Kernels that traverse two levels, for both queries, against their Rust twin: hits to the bit, and the work exactly.
//!
//! Equality of bits is asked of software devices: Vulkan lets others divide with an error of 2.5 ULP, so there the hits are held to the f64 test.

use clerestory::accel::trace::{Query, RayTracer, TraceSettings};
use clerestory::accel::two_level::{MeshGeometry, Placement, TwoLevelBvh, TwoLevelTraversal};
use clerestory::accel::wide::WideSettings;
use clerestory::accel::{FINISHED, Hit, Ray, RayIndex, TraversalCounters};
use clerestory::gpu::{DeviceKind, Gpu};
use clerestory_hard_cases::{hit_bits, misses, soup_with_rays};
use clerestory_tests::random::Random;
use clerestory_tests::with_gpu;
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};

/// Stops none of the rays here.
const QUOTA: u32 = 3000;
/// Stops many.
const SMALL_QUOTA: u32 = 80;

type Triangles = Vec<[Vec3; 3]>;

struct Case {
    what: &'static str,
    bvh: TwoLevelBvh,
    images: Triangles,
    rays: Vec<Ray>,
}

fn turned(random: &mut Random, scale: DVec3) -> DAffine3 {
    let axis = random.direction().as_dvec3().normalize();
    let turn = DQuat::from_axis_angle(axis, 3.0 * f64::from(random.signed()));
    let translation = (12.0 * random.vector()).as_dvec3();
    DAffine3::from_mat3_translation(DMat3::from_quat(turn) * DMat3::from_diagonal(scale), translation)
}

impl Case {
    fn new(what: &'static str, meshes: &[Triangles], places: &[(u32, DAffine3)], rays: Vec<Ray>) -> Self {
        let geometry: Vec<MeshGeometry<'_>> = meshes
            .iter()
            .map(|triangles| MeshGeometry { triangles, names: None })
            .collect();
        let mut first = 0;
        let placements: Vec<Placement> = places
            .iter()
            .map(|(mesh, transform)| {
                let placement = Placement {
                    mesh: *mesh,
                    transform: *transform,
                    first,
                };
                first += meshes[*mesh as usize].len() as u32;
                placement
            })
            .collect();
        let bvh = TwoLevelBvh::build(&geometry, &placements, &WideSettings::default()).unwrap();
        let images = placements
            .iter()
            .zip(bvh.transforms())
            .flat_map(|(placement, transform)| {
                meshes[placement.mesh as usize]
                    .iter()
                    .map(|triangle| transform.triangle(*triangle))
            })
            .collect();
        Self {
            what,
            bvh,
            images,
            rays,
        }
    }
}

fn cases() -> Vec<Case> {
    let mut random = Random(61);
    let (large, rays) = soup_with_rays(62, 1500, 2048);
    let (small, _) = soup_with_rays(63, 40, 0);
    let scales = [DVec3::splat(0.3), DVec3::new(0.2, 0.5, 0.1), DVec3::new(-0.4, 0.4, 0.4)];
    let places: Vec<_> = (0..120)
        .map(|i| (u32::from(i % 4 > 0), turned(&mut random, scales[i % 3])))
        .collect();
    let mut overlapping = vec![(0, DAffine3::IDENTITY); 3];
    overlapping.push((1, DAffine3::IDENTITY));
    let meshes = [large, small];
    vec![
        Case::new("many", &meshes, &places, rays.clone()),
        Case::new("in one place", &meshes, &overlapping, rays[..256].to_vec()),
        Case::new(
            "one",
            &meshes,
            &[(0, turned(&mut random, DVec3::ONE))],
            rays[..512].to_vec(),
        ),
        Case::new("nothing", &[], &[], rays[..40].to_vec()),
    ]
}

/// Hits and work of the twin, and how often a ray was stopped.
fn twin(case: &Case, settings: &TraceSettings) -> (Vec<Hit>, TraversalCounters, u64) {
    let (mut counters, mut stops) = (TraversalCounters::default(), 0);
    let trace = |ray: &Ray| {
        let mut traversal = match settings.query {
            Query::Closest => TwoLevelTraversal::closest(ray),
            Query::Any => TwoLevelTraversal::any(ray),
        };
        loop {
            let quota = u64::from(settings.ray_quota);
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
fn check(gpu: &Gpu, cases: &[Case], query: Query, ray_quota: u32) -> u64 {
    let exact = gpu.caps().kind == DeviceKind::Cpu;
    let asked = TraceSettings {
        query,
        ray_quota,
        count: true,
        ..TraceSettings::ray_per_thread()
    };
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
            } else if query == Query::Closest || !found.is_hit() {
                assert!(!misses(&case.images, ray, found), "{what}: {ray:?}");
            }
        }
        if exact {
            assert_eq!(traced.work, work, "{what}");
            assert_eq!(traced.unfinished, stops, "{what}");
        }
    }
    stopped
}

#[test]
fn kernels_are_their_twins() {
    with_gpu(|gpu| {
        let cases = cases();
        for query in [Query::Closest, Query::Any] {
            assert_eq!(check(gpu, &cases, query, QUOTA), 0);
        }
    });
}

#[test]
fn rays_that_a_quota_stops_go_on() {
    with_gpu(|gpu| {
        let cases = cases();
        for query in [Query::Closest, Query::Any] {
            let stopped = check(gpu, &cases, query, SMALL_QUOTA);
            assert!(stopped > 500, "{query:?}: {stopped} stops");
        }
    });
}
