//! The driver's acceleration structure as an index, where the device has ray queries: its hits against those of trying all triangles, to the bit; and
//! what a device without them says.
//!
//! Equality of bits with the host is asked of software devices: Vulkan lets others divide with an error of 2.5 ULP, so there the hits are held to the
//! f64 test.

use clerestory::Error;
use clerestory::accel::bvh2::{Bvh2, Bvh2Settings};
use clerestory::accel::driver::{DRIVER_REACH, DriverIndex};
use clerestory::accel::trace::{Query, RayTracer, TraceSettings};
use clerestory::accel::{Hit, IndexKind, Ray, RayIndex};
use clerestory::gpu::shaders::accel::{trace_queue, trace_rays};
use clerestory::gpu::{Category, DeviceKind, Gpu, GpuOptions, Lesser, OptionalFeatures};
use clerestory::transport::GpuScene;
use clerestory_hard_cases::{RaySet, hit_bits, misses, soup_with_rays};
use clerestory_tests::random::Random;
use clerestory_tests::render::builtin;
use clerestory_tests::{gpu_with, with_gpu};
use glam::Vec3;

/// Stops many of the rays that try all triangles.
const SMALL_QUOTA: u32 = 40;

/// Runs a test where the device has ray queries.
fn with_ray_queries(test: impl FnOnce(&Gpu)) {
    with_gpu(|gpu| {
        if gpu.caps().ray_query {
            test(gpu);
        } else {
            // Set where the device is known to have them, so that nothing is passed over.
            assert!(
                std::env::var_os("CLERESTORY_TEST_RAY_QUERIES").is_none(),
                "the device has no ray queries"
            );
            println!("not supported: VK_KHR_ray_query");
        }
    });
}

fn settings(query: Query, ray_quota: u32) -> TraceSettings {
    TraceSettings {
        query,
        ray_quota,
        count: true,
        ..TraceSettings::ray_per_thread()
    }
}

/// Sets of the hard cases, soups, and little or nothing to meet.
fn sets() -> Vec<RaySet> {
    let of = |what: &str, triangles, rays| RaySet {
        what: what.into(),
        triangles,
        rays,
    };
    let hard = clerestory_hard_cases::all();
    let mut sets: Vec<_> = hard
        .iter()
        .filter_map(|case| case.rays)
        .flat_map(|rays| rays())
        .collect();
    let (triangles, rays) = soup_with_rays(52, 3000, 2048);
    sets.push(of(
        "one triangle",
        vec![[Vec3::ZERO, Vec3::X, Vec3::Y]],
        rays[..40].to_vec(),
    ));
    sets.push(of("nothing", Vec::new(), rays[..40].to_vec()));
    let backwards = |ray: &Ray| Ray { t_min: -5.0, ..*ray };
    sets.push(of(
        "from behind",
        triangles.clone(),
        rays[..256].iter().map(backwards).collect(),
    ));
    sets.push(of("soup", triangles, rays));
    sets
}

/// Rays at a soup from beyond the reach of its boxes, and from just within.
fn far_rays() -> RaySet {
    let (triangles, _) = soup_with_rays(53, 600, 1);
    let mut random = Random(54);
    let rays = (0..512).map(|i| {
        let origin = 21.0 * DRIVER_REACH * [0.8, 1.2][i % 2] * random.direction();
        Ray::new(origin, random.choose(&triangles)[i % 3] - origin)
    });
    RaySet {
        what: "far away".into(),
        rays: rays.collect(),
        triangles,
    }
}

/// Traces a set, and compares what it meets with what the binary hierarchy's twin does, which is what trying all triangles does. How often rays were stopped.
fn check(gpu: &Gpu, set: &RaySet, settings: &TraceSettings, tracers: &mut Vec<RayTracer>) -> u64 {
    let what = format!("{}, {settings:?}", set.what);
    let twin = Bvh2::build(&set.triangles, &Bvh2Settings::default()).unwrap();
    let index = IndexKind::Driver.build_for(gpu, &set.triangles).unwrap();
    let (found, expected) = (index.report.statistics, twin.statistics());
    assert_eq!(index.report.kind, "driver");
    assert_eq!(found.triangles, expected.triangles, "{what}");
    assert_eq!(
        (found.excluded_degenerate, found.excluded_range),
        (expected.excluded_degenerate, expected.excluded_range),
        "{what}"
    );
    let tracer = RayTracer::on_device(gpu, &index, settings).unwrap();
    let traced = tracer.trace(&set.rays).unwrap();
    tracers.push(tracer);
    assert_eq!(traced.work.triangles, traced.work.iterations, "{what}");
    for (ray, found) in set.rays.iter().zip(&traced.hits) {
        let expected = twin.closest_hit(ray);
        if settings.query == Query::Any {
            assert_eq!(found.is_hit(), expected.is_hit(), "{what}: {ray:?}");
        } else if gpu.caps().kind == DeviceKind::Cpu {
            assert_eq!(hit_bits(found), hit_bits(&expected), "{what}: {ray:?}");
        } else {
            assert!(!misses(&set.triangles, ray, found), "{what}: {ray:?}");
        }
    }
    traced.unfinished
}

#[test]
fn hits_are_those_of_trying_all_triangles_to_the_bit() {
    with_ray_queries(|gpu| {
        let sets = sets();
        let mut kept = Vec::new();
        for query in [Query::Closest, Query::Any] {
            for set in &sets {
                check(gpu, set, &settings(query, 32_768), &mut kept);
            }
        }
    });
}

#[test]
fn rays_from_beyond_the_reach_stop_at_the_quota_and_go_on() {
    with_ray_queries(|gpu| {
        let set = far_rays();
        let mut kept = Vec::new();
        for query in [Query::Closest, Query::Any] {
            assert_eq!(check(gpu, &set, &settings(query, 32_768), &mut kept), 0);
            let stops = check(gpu, &set, &settings(query, SMALL_QUOTA), &mut kept);
            let rounds = set.triangles.len() as u64 / u64::from(SMALL_QUOTA);
            // Half of the rays, those from within the reach, never stop.
            assert!(stops > 0 && stops <= rounds * set.rays.len() as u64 / 2, "{stops}");
        }
    });
}

#[test]
fn few_triangles_are_tried_of_rays_within_reach() {
    with_ray_queries(|gpu| {
        let (triangles, rays) = soup_with_rays(55, 20_000, 1024);
        let index = IndexKind::Driver.build_for(gpu, &triangles).unwrap();
        let tracer = RayTracer::on_device(gpu, &index, &settings(Query::Closest, 32_768)).unwrap();
        let traced = tracer.trace(&rays).unwrap();
        assert!(traced.hits.iter().any(Hit::is_hit));
        let each = traced.work.triangles / rays.len() as u64;
        assert!(each < triangles.len() as u64 / 50, "{each} triangles a ray");
    });
}

#[test]
fn devices_without_ray_queries_refuse_it_by_name() {
    let gpu = gpu_with(&GpuOptions {
        lesser: Lesser {
            features: Some(OptionalFeatures::NONE),
            ..Lesser::default()
        },
        ..GpuOptions::default()
    });
    assert!(!IndexKind::Driver.is_offered_by(gpu.caps()) && IndexKind::default().is_offered_by(gpu.caps()));
    let triangles = [[Vec3::ZERO, Vec3::X, Vec3::Y]];
    let scene = builtin("builtin:cornell-box");
    let refusals = [
        DriverIndex::build(&gpu, &triangles).err(),
        GpuScene::with_index(&gpu, &scene, &IndexKind::Driver).err(),
        gpu.box_structure("boxes", Category::Index, &[[[0.0; 3], [1.0; 3]]])
            .err(),
        gpu.ray_query_pipeline::<trace_rays::Kernel>(&trace_rays::Spec::default())
            .err(),
    ];
    for refusal in refusals {
        assert!(
            matches!(&refusal, Some(Error::MissingFeature { feature, .. }) if feature.contains("VK_KHR_ray_query")),
            "{refusal:?}"
        );
    }
}

#[test]
fn what_it_cannot_do_is_refused() {
    with_ray_queries(|gpu| {
        let index = IndexKind::Driver
            .build_for(gpu, &[[Vec3::ZERO, Vec3::X, Vec3::Y]])
            .unwrap();
        let persistent = RayTracer::on_device(gpu, &index, &TraceSettings::persistent(gpu.caps()));
        assert!(matches!(persistent, Err(Error::Setting { .. })), "{persistent:?}");
        let texels = RayTracer::with_texels(
            gpu,
            index.texels.clone(),
            index.traversal,
            &TraceSettings::ray_per_thread(),
        );
        assert!(matches!(texels, Err(Error::Setting { .. })), "{texels:?}");
        let queue = gpu.ray_query_pipeline::<trace_queue::Kernel>(&trace_queue::Spec::default());
        assert!(matches!(queue, Err(Error::Shader { .. })), "{queue:?}");
        for wrong in [
            [[0.0, 0.0, 1.0], [1.0, 1.0, 0.0]],
            [[f32::NAN; 3], [1.0; 3]],
            [[0.0; 3], [f32::INFINITY; 3]],
        ] {
            let refused = gpu.box_structure("boxes", Category::Index, &[[[0.0; 3]; 2], wrong]);
            assert!(matches!(refused, Err(Error::Setting { .. })), "{refused:?}");
        }
    });
}
