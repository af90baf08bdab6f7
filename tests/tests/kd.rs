//! Kernels that traverse kd-trees, by every scheme and for both queries, against their Rust twin: hits to the bit, and the work exactly.
//!
//! Equality of bits is asked of software devices: Vulkan lets others divide with an error of 2.5 ULP, so there the hits are held to the
//! f64 test.

use clerestory::Error;
use clerestory::accel::bvh2::FINISHED;
use clerestory::accel::kd::{KdCaches, KdCounters, KdNode, KdSettings, KdTraversal, KdTree, MAX_BYTE_LEVELS, Scheme};
use clerestory::accel::trace::{Execution, PersistentThreads, Query, RayTracer, TraceSettings};
use clerestory::accel::{Hit, Ray, RayIndex};
use clerestory::gpu::{DeviceKind, Gpu};
use clerestory_hard_cases::misses;
use clerestory_tests::random::Random;
use clerestory_tests::with_gpu;
use glam::Vec3;

const PLAIN: Scheme = flags(false, 0);
const PUSH_DOWN: Scheme = flags(true, 0);
const SHORT: Scheme = flags(false, 4);
const BOTH: Scheme = flags(true, 4);

/// Stops none of the rays here.
const QUOTA: u32 = 3000;
/// Stops many.
const SMALL_QUOTA: u32 = 60;

const fn flags(push_down: bool, short_stack: u32) -> Scheme {
    Scheme::Flags { push_down, short_stack }
}

struct Case {
    what: String,
    triangles: Vec<[Vec3; 3]>,
    tree: KdTree,
    rays: Vec<Ray>,
}

impl Case {
    fn new(what: &str, triangles: Vec<[Vec3; 3]>, rays: Vec<Ray>, settings: &KdSettings) -> Self {
        Self {
            what: what.into(),
            tree: KdTree::build(&triangles, settings).unwrap(),
            triangles,
            rays,
        }
    }
}

fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray {
        origin: origin.into(),
        t_min: 0.0,
        direction: direction.into(),
        t_max: f32::INFINITY,
    }
}

/// A triangle across the x axis between each two of `levels` planes, every plane cutting off one: ways of as many inner nodes. Along the axis
/// rays meet triangles that are in their way, and, beside them, boxes alone.
fn chain(levels: u32) -> Case {
    let triangles: Vec<[Vec3; 3]> = (0..=levels)
        .map(|i| {
            let x = i as f32 + 0.5;
            [[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]].map(|[y, z]| Vec3::new(x, y, z))
        })
        .collect();
    let mut nodes = vec![KdNode::default(); 2];
    let mut node = 0;
    for level in 0..levels {
        let children = nodes.len() as u32;
        nodes[node] = KdNode::inner(0, level as f32 + 1.0, children);
        nodes.extend([KdNode::leaf(level, 1); 2]);
        node = children as usize + 1;
    }
    nodes[node] = KdNode::leaf(levels, 1);
    nodes[1] = KdNode::leaf(0, 0);
    let tree = KdTree::from_nodes(&triangles, nodes, (0..=levels).collect()).unwrap();
    assert_eq!(tree.statistics().max_depth, levels);
    let mut rays = Vec::new();
    for (start, direction) in [(-1.0, Vec3::X), (levels as f32 + 2.0, -Vec3::X)] {
        for side in [0.1, 2.5] {
            for t_min in [0.0, 3.0, levels as f32 - 2.0] {
                rays.push(Ray {
                    t_min,
                    ..ray(Vec3::new(start, side, side), direction)
                });
            }
        }
    }
    Case {
        what: format!("chain of {levels}"),
        triangles,
        tree,
        rays,
    }
}

fn soup() -> (Vec<[Vec3; 3]>, Vec<Ray>) {
    let mut random = Random(41);
    let triangles = (0..1500)
        .map(|_| {
            let centre = 10.0 * random.vector();
            [0; 3].map(|_| centre + 0.5 * random.vector())
        })
        .collect();
    let rays = (0..1200)
        .map(|i| {
            let mut r = ray(
                12.0 * random.vector(),
                random.direction() * random.choose(&[1.0, 1e-3, 1e4]),
            );
            if i % 3 == 0 {
                (r.t_min, r.t_max) = (random.range(0.0, 5.0), random.range(3.0, 20.0));
            }
            r
        })
        .collect();
    (triangles, rays)
}

fn cases() -> Vec<Case> {
    let default = KdSettings::default();
    let hard = clerestory_hard_cases::all();
    let sets = hard.iter().filter_map(|case| case.rays).flat_map(|rays| rays());
    let mut cases: Vec<Case> = sets
        .map(|set| Case::new(&set.what, set.triangles, set.rays, &default))
        .collect();
    let (triangles, rays) = soup();
    // Deep trees, since tests of triangles seem dear.
    let deep = KdSettings {
        intersection_cost: 1000.0,
        leaf_size: 1,
        ..default
    };
    cases.push(Case::new("soup, deep", triangles.clone(), rays.clone(), &deep));
    cases.push(Case::new("soup", triangles, rays.clone(), &default));
    cases.push(Case::new(
        "one leaf",
        vec![[Vec3::ZERO, Vec3::X, Vec3::Y]],
        rays[..40].to_vec(),
        &default,
    ));
    cases.push(Case::new("nothing", Vec::new(), rays[..40].to_vec(), &default));
    cases.extend([1, 31, 32].map(chain));
    cases
}

fn bits(hit: &Hit) -> [u32; 4] {
    let [u, v] = hit.barycentrics.map(f32::to_bits);
    [hit.t.to_bits(), u, v, hit.triangle]
}

/// Hits and work of the twin, and how often a ray was stopped.
fn twin(case: &Case, settings: &TraceSettings) -> (Vec<Hit>, KdCounters, u64) {
    let (mut counters, mut stops) = (KdCounters::default(), 0);
    let trace = |ray: &Ray| {
        let mut traversal = match settings.query {
            Query::Closest => KdTraversal::closest(settings.scheme, ray),
            Query::Any => KdTraversal::any(settings.scheme, ray),
        }
        .with_caches(settings.caches)
        .unwrap();
        let quota = u64::from(settings.ray_quota);
        loop {
            traversal.run(&case.tree, ray, quota, &mut |_, _| true, &mut counters);
            if traversal.resume == FINISHED {
                return traversal.hit;
            }
            stops += 1;
        }
    };
    let hits = case.rays.iter().map(trace).collect();
    (hits, counters, stops)
}

/// Traces all cases with the same settings, or with as much of their quota as fits a software device's loops: the wider its subgroups, the less. How often
/// rays were stopped by the quota that was asked for.
fn check(gpu: &Gpu, cases: &[Case], settings: &TraceSettings) -> u64 {
    let asked = settings;
    let exact = gpu.caps().kind == DeviceKind::Cpu;
    // Kept, so that all share a pipeline.
    let mut tracers = Vec::new();
    let mut stopped = 0;
    for case in cases {
        let settings = &asked.fitted(gpu.caps(), case.tree.device_traversal());
        let what = format!("{}, {settings:?}", case.what);
        let tracer = RayTracer::new(gpu, &case.tree, settings).unwrap();
        let traced = tracer.trace(&case.rays).unwrap();
        tracers.push(tracer);
        if settings.ray_quota == asked.ray_quota {
            stopped += traced.unfinished;
        }
        let (hits, work, stops) = twin(case, settings);
        for ((ray, found), expected) in case.rays.iter().zip(&traced.hits).zip(&hits) {
            if exact {
                assert_eq!(bits(found), bits(expected), "{what}: {ray:?}");
            } else if settings.query == Query::Closest || !found.is_hit() {
                assert!(!misses(&case.triangles, ray, found), "{what}: {ray:?}");
            }
        }
        if exact {
            assert_eq!(traced.kd_work, work, "{what}");
            assert_eq!(traced.unfinished, stops, "{what}");
        }
    }
    stopped
}

fn settings(scheme: Scheme, query: Query, ray_quota: u32) -> TraceSettings {
    TraceSettings {
        scheme,
        query,
        ray_quota,
        count: true,
        ..TraceSettings::ray_per_thread()
    }
}

#[test]
fn kernels_of_every_scheme_are_their_twins() {
    with_gpu(|gpu| {
        let cases = cases();
        for scheme in [Scheme::Stack, PLAIN, PUSH_DOWN, SHORT, BOTH] {
            for query in [Query::Closest, Query::Any] {
                assert_eq!(check(gpu, &cases, &settings(scheme, query, QUOTA)), 0);
            }
        }
    });
}

#[test]
fn rays_that_a_quota_stops_go_on_by_their_flags() {
    with_gpu(|gpu| {
        let cases = cases();
        for (scheme, query) in [
            (Scheme::Stack, Query::Closest),
            (PLAIN, Query::Any),
            (BOTH, Query::Closest),
        ] {
            let stopped = check(gpu, &cases, &settings(scheme, query, SMALL_QUOTA));
            assert!(stopped > 1000, "{scheme:?}: {stopped} stops");
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
        let with_queue = |query, ray_quota| TraceSettings {
            execution: Execution::Persistent(threads),
            ..settings(Scheme::Stack, query, ray_quota)
        };
        let tree = |rays: &[Ray]| Case::new("soup", triangles.clone(), rays.to_vec(), &KdSettings::default());
        let cases = [0, 1, 31, 32, 33, rays.len()].map(|count| tree(&rays[..count]));
        check(gpu, &cases, &with_queue(Query::Closest, 1000));
        assert!(check(gpu, &cases[5..], &with_queue(Query::Any, SMALL_QUOTA)) > 0);
    });
}

#[test]
fn caches_are_those_of_the_twin_and_change_no_hit() {
    with_gpu(|gpu| {
        let cases = cases();
        let threads = PersistentThreads {
            groups: 3,
            batch: 2 * gpu.caps().subgroup_size,
            fetches: 2,
            subgroups: 2,
        };
        let with = |caches, query, ray_quota| TraceSettings {
            execution: Execution::Persistent(threads),
            caches,
            ..settings(Scheme::Stack, query, ray_quota)
        };
        for caches in KdCaches::COMPARED {
            assert_eq!(check(gpu, &cases, &with(caches, Query::Closest, 1000)), 0, "{caches:?}");
        }
        let [.., bytes, postpone] = KdCaches::COMPARED;
        let few_levels = KdCaches {
            node_levels: 3,
            ..bytes
        };
        for caches in [few_levels, postpone] {
            assert!(
                check(gpu, &cases, &with(caches, Query::Any, SMALL_QUOTA)) > 1000,
                "{caches:?}"
            );
        }
    });
}

#[test]
fn votes_change_no_hit() {
    with_gpu(|gpu| {
        let exact = gpu.caps().kind == DeviceKind::Cpu;
        let cases = cases();
        let threads = PersistentThreads {
            groups: 3,
            batch: 2 * gpu.caps().subgroup_size,
            fetches: 2,
            subgroups: 2,
        };
        let [none, .., nodes_head, bytes, _] = KdCaches::COMPARED;
        let mut stopped = 0;
        for (caches, query, ray_quota) in [
            (none, Query::Closest, 1000),
            (nodes_head, Query::Any, SMALL_QUOTA),
            (bytes, Query::Closest, SMALL_QUOTA),
        ] {
            let settings = TraceSettings {
                execution: Execution::Persistent(threads),
                caches: KdCaches { vote: true, ..caches },
                ..settings(Scheme::Stack, query, ray_quota)
            };
            if !gpu.caps().subgroup.vote {
                let refused = RayTracer::new(gpu, &cases[0].tree, &settings);
                assert!(matches!(refused, Err(Error::MissingFeature { .. })), "{refused:?}");
                continue;
            }
            let mut tracers = Vec::new();
            for case in &cases {
                let settings = settings.fitted(gpu.caps(), case.tree.device_traversal());
                let tracer = RayTracer::new(gpu, &case.tree, &settings).unwrap();
                let traced = tracer.trace(&case.rays).unwrap();
                tracers.push(tracer);
                stopped += traced.unfinished;
                // Of a subgroup of one ray; its work is not that of the device's.
                let (hits, ..) = twin(case, &settings);
                for ((ray, found), expected) in case.rays.iter().zip(&traced.hits).zip(&hits) {
                    if exact {
                        assert_eq!(bits(found), bits(expected), "{}, {settings:?}: {ray:?}", case.what);
                    } else if query == Query::Closest || !found.is_hit() {
                        assert!(!misses(&case.triangles, ray, found), "{}: {ray:?}", case.what);
                    }
                }
            }
        }
        assert!(!gpu.caps().subgroup.vote || stopped > 1000, "{stopped} stops");
    });
}

#[test]
fn settings_that_could_lose_rays_are_refused_and_can_be_fitted() {
    with_gpu(|gpu| {
        let (triangles, rays) = soup();
        let case = Case::new("soup", triangles, rays, &KdSettings::default());
        let traversal = case.tree.device_traversal();
        for settings in [TraceSettings::ray_per_thread(), TraceSettings::persistent(gpu.caps())] {
            if gpu.caps().kind == DeviceKind::Cpu {
                let refused = RayTracer::new(gpu, &case.tree, &settings);
                assert!(matches!(refused, Err(Error::Setting { .. })), "{refused:?}");
            }
            let fitted = TraceSettings {
                count: true,
                ..settings.fitted(gpu.caps(), traversal)
            };
            check(gpu, std::slice::from_ref(&case), &fitted);
        }
        let persistent = TraceSettings::persistent(gpu.caps()).fitted(gpu.caps(), traversal);
        let [_, nodes, head, .., bytes, _] = KdCaches::COMPARED;
        for wrong in [
            TraceSettings {
                caches: head,
                ..settings(Scheme::Stack, Query::Closest, 100)
            },
            TraceSettings {
                caches: nodes,
                scheme: BOTH,
                ..persistent
            },
            TraceSettings {
                caches: KdCaches {
                    postpone: true,
                    ..KdCaches::SPECULATION
                },
                ..persistent
            },
            TraceSettings {
                caches: KdCaches {
                    node_levels: MAX_BYTE_LEVELS + 1,
                    ..bytes
                },
                ..persistent
            },
        ] {
            let refused = RayTracer::new(gpu, &case.tree, &wrong);
            assert!(matches!(refused, Err(Error::Setting { .. })), "{refused:?}");
        }
    });
}
