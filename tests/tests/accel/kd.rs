//! Kernels that traverse kd-trees, by every scheme and for both queries, against their Rust twin: hits to the bit, and the work exactly.

use clerestory::Error;
use clerestory::accel::kd::{KdCaches, KdNode, KdSettings, KdTree, MAX_BYTE_LEVELS, Scheme};
use clerestory::accel::trace::{Execution, PersistentThreads, Query, RayTracer, TraceSettings};
use clerestory::accel::{Ray, RayIndex};
use clerestory::gpu::ash::vk;
use clerestory::gpu::shaders::constants::{KD_HEAP_LEVELS, KD_LEAF, KD_STACK_CACHE_BYTES, KD_STACK_CACHE_NONE};
use clerestory::gpu::{Category, DeviceKind, Gpu};
use clerestory_hard_cases::soup_with_rays;
use clerestory_tests::shaders::kd_cache_probe;
use clerestory_tests::shaders::sets::IndexSet;
use clerestory_tests::traced::{Case, check, check_hits};
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

fn case(what: &str, triangles: Vec<[Vec3; 3]>, rays: Vec<Ray>, settings: &KdSettings) -> Case<KdTree> {
    Case {
        what: what.into(),
        index: KdTree::build(&triangles, settings).unwrap(),
        triangles,
        rays,
    }
}

/// A triangle across the x axis between each two of `levels` planes, every plane cutting off one: ways of as many inner nodes. Along the axis
/// rays meet triangles that are in their way, and, beside them, boxes alone.
fn chain(levels: u32) -> Case<KdTree> {
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
                    ..Ray::new(Vec3::new(start, side, side), direction)
                });
            }
        }
    }
    Case {
        what: format!("chain of {levels}"),
        triangles,
        index: tree,
        rays,
    }
}

fn soup() -> (Vec<[Vec3; 3]>, Vec<Ray>) {
    soup_with_rays(41, 1500, 1200)
}

fn cases() -> Vec<Case<KdTree>> {
    let default = KdSettings::default();
    let hard = clerestory_hard_cases::all();
    let sets = hard.iter().filter_map(|case| case.rays).flat_map(|rays| rays());
    let mut cases: Vec<Case<KdTree>> = sets
        .map(|set| case(&set.what, set.triangles, set.rays, &default))
        .collect();
    let (triangles, rays) = soup();
    // Deep trees, since tests of triangles seem dear.
    let deep = KdSettings {
        intersection_cost: 1000.0,
        leaf_size: 1,
        ..default
    };
    cases.push(case("soup, deep", triangles.clone(), rays.clone(), &deep));
    cases.push(case("soup", triangles, rays.clone(), &default));
    cases.push(case(
        "one leaf",
        vec![[Vec3::ZERO, Vec3::X, Vec3::Y]],
        rays[..40].to_vec(),
        &default,
    ));
    cases.push(case("nothing", Vec::new(), rays[..40].to_vec(), &default));
    cases.extend([1, 31, 32].map(chain));
    cases
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
        let tree = |rays: &[Ray]| case("soup", triangles.clone(), rays.to_vec(), &KdSettings::default());
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

/// The nodes of a tree as a workgroup reads them that adds `mark` to those in its shared memory, and the boxes that it holds.
fn cached(gpu: &Gpu, tree: &KdTree, levels: u32, with_boxes: bool, mark: u32) -> (Vec<KdNode>, Vec<[Vec3; 2]>) {
    let spec = kd_cache_probe::Spec {
        cache_probe_mark: mark,
        kd_cache_levels: levels,
        kd_stack_cache: if with_boxes {
            KD_STACK_CACHE_BYTES
        } else {
            KD_STACK_CACHE_NONE
        },
        ..Default::default()
    };
    let pipeline = gpu.compute_pipeline::<kd_cache_probe::Kernel>(&spec).unwrap();
    let format = vk::Format::R32G32B32A32_UINT;
    let texels = gpu.texels_with("tree", Category::Index, format, tree.texels()).unwrap();
    let count = tree.nodes().len();
    let boxes_held = if with_boxes { count.min(1 << levels) } else { 0 };
    let zeroed = |name, words: usize| gpu.buffer_with(name, Category::Work, &vec![0u32; words]).unwrap();
    let (nodes, boxes) = (zeroed("nodes", 2 * count), zeroed("boxes", 6 * boxes_held.max(1)));
    let mut recorder = gpu.recorder("caches").unwrap();
    recorder
        .pass("caches", |pass| {
            let set = kd_cache_probe::Set0 {
                cache_probe_nodes: nodes.view(),
                cache_probe_boxes: boxes.view(),
            };
            let index = IndexSet { index_texels: &texels };
            let push = kd_cache_probe::Push { count: count as u32 };
            pass.dispatch(&pipeline, &[&set, &index], &push, [1, 1, 1])
        })
        .unwrap();
    recorder.submit().unwrap().wait().unwrap();
    let mut held = gpu.read::<[Vec3; 2]>(boxes.view(), boxes_held.max(1)).unwrap();
    held.truncate(boxes_held);
    (gpu.read::<KdNode>(nodes.view(), count).unwrap(), held)
}

/// The boxes of the nodes at a tree's top by their places; `None` for holes.
fn boxes_of_top(tree: &KdTree, places: usize) -> Vec<Option<[Vec3; 2]>> {
    let mut boxes = vec![None; places];
    let bounds = tree.bounds();
    let mut pending = vec![(0, [bounds.lower, bounds.upper])];
    while let Some((place, bounds)) = pending.pop() {
        if place >= places {
            continue;
        }
        boxes[place] = Some(bounds);
        let node = tree.nodes()[place];
        let (axis, children) = (node.word & KD_LEAF, (node.word >> 2) as usize);
        if axis != KD_LEAF {
            let (mut below, mut above) = (bounds, bounds);
            below[1][axis as usize] = f32::from_bits(node.value);
            above[0][axis as usize] = f32::from_bits(node.value);
            pending.extend([(children, below), (children + 1, above)]);
        }
    }
    boxes
}

#[test]
fn caches_hold_the_top_of_the_tree_and_are_what_is_read() {
    const MARK: u32 = 0x0010_0100;
    with_gpu(|gpu| {
        let cases: Vec<Case<KdTree>> = cases()
            .into_iter()
            .filter(|case| case.what.starts_with("soup") || case.what.starts_with("chain") || case.what == "one leaf")
            .collect();
        assert!(cases.iter().any(|case| case.index.nodes().len() > 2 << KD_HEAP_LEVELS));
        let with_boxes = [1, 3, MAX_BYTE_LEVELS].map(|levels| (levels, true));
        let without = [1, 3, MAX_BYTE_LEVELS, KD_HEAP_LEVELS].map(|levels| (levels, false));
        for (levels, boxes_too) in with_boxes.into_iter().chain(without) {
            for case in &cases {
                let what = format!("{}, {levels} levels, boxes: {boxes_too}", case.what);
                let (nodes, boxes) = cached(gpu, &case.index, levels, boxes_too, MARK);
                for (place, (found, node)) in nodes.iter().zip(case.index.nodes()).enumerate() {
                    let mark = if place < 1 << levels { MARK } else { 0 };
                    let expected = [node.value, node.word].map(|word| word.wrapping_add(mark));
                    assert_eq!([found.value, found.word], expected, "{what}: node {place}");
                }
                let expected = boxes_of_top(&case.index, boxes.len());
                for (place, (found, expected)) in boxes.iter().zip(&expected).enumerate() {
                    assert!(
                        expected.is_none_or(|expected| expected == *found),
                        "{what}: box {place}"
                    );
                }
            }
        }
    });
}

#[test]
fn rays_that_hold_a_leaf_go_on_while_others_of_their_subgroup_have_none() {
    with_gpu(|gpu| {
        if !gpu.caps().subgroup.vote {
            return;
        }
        const LEVELS: u32 = 32;
        let case = chain(LEVELS);
        // Along the axis the first leaf lies behind one plane, and against it behind all of them.
        let short = Ray::new(Vec3::new(-1.0, 0.1, 0.1), Vec3::X);
        let long = Ray::new(Vec3::new(LEVELS as f32 + 2.0, 0.1, 0.1), -Vec3::X);
        let lanes = gpu.caps().subgroup_size;
        let settings = TraceSettings {
            execution: Execution::Persistent(PersistentThreads {
                groups: 1,
                batch: lanes,
                fetches: 1,
                subgroups: 1,
            }),
            caches: KdCaches::SPECULATION,
            ..settings(Scheme::Stack, Query::Closest, 1000)
        };
        let tracer = RayTracer::new(gpu, &case.index, &settings).unwrap();
        // Rays that go against the axis, of a subgroup's.
        for longs in [0, 1, lanes] {
            let rays: Vec<Ray> = (0..lanes).map(|lane| if lane < longs { long } else { short }).collect();
            let traced = tracer.trace(&rays).unwrap();
            for (ray, hit) in rays.iter().zip(&traced.hits) {
                let expected = if *ray == long { LEVELS } else { 0 };
                assert_eq!(hit.triangle, expected, "{longs} of {lanes}: {ray:?}");
            }
            if gpu.caps().kind == DeviceKind::Cpu {
                // A short ray that has to wait goes on behind its leaf, through one more node, to the next leaf, which its hit then spares it.
                let (longs, lanes) = (u64::from(longs), u64::from(lanes));
                let of_short = if longs > 0 { 2 } else { 1 };
                let work = &traced.kd_work;
                assert_eq!(
                    work.nodes,
                    u64::from(LEVELS) * longs + of_short * (lanes - longs),
                    "{longs} of {lanes}"
                );
                assert_eq!((work.leaves, work.triangles), (lanes, lanes), "{longs} of {lanes}");
            }
        }
    });
}

#[test]
fn votes_change_no_hit() {
    with_gpu(|gpu| {
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
                let refused = RayTracer::new(gpu, &cases[0].index, &settings);
                assert!(matches!(refused, Err(Error::MissingFeature { .. })), "{refused:?}");
                continue;
            }
            let mut tracers = Vec::new();
            for case in &cases {
                let settings = settings.fitted(gpu.caps(), case.index.device_traversal());
                let tracer = RayTracer::new(gpu, &case.index, &settings).unwrap();
                let traced = tracer.trace(&case.rays).unwrap();
                tracers.push(tracer);
                stopped += traced.unfinished;
                // Of a subgroup of one ray; its work is not that of the device's.
                check_hits(gpu, case, &settings, &traced.hits);
            }
        }
        assert!(!gpu.caps().subgroup.vote || stopped > 1000, "{stopped} stops");
    });
}

#[test]
fn settings_that_could_lose_rays_are_refused_and_can_be_fitted() {
    with_gpu(|gpu| {
        let (triangles, rays) = soup();
        let case = case("soup", triangles, rays, &KdSettings::default());
        let traversal = case.index.device_traversal();
        for settings in [TraceSettings::ray_per_thread(), TraceSettings::persistent(gpu.caps())] {
            if gpu.caps().kind == DeviceKind::Cpu {
                let refused = RayTracer::new(gpu, &case.index, &settings);
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
            let refused = RayTracer::new(gpu, &case.index, &wrong);
            assert!(matches!(refused, Err(Error::Setting { .. })), "{refused:?}");
        }
    });
}
