use super::tree::KdKind;
use super::*;
use crate::accel::FINISHED;
use crate::accel::box_test::BoxTest;
use crate::accel::bvh2::tests::{grid, hard_rays, hard_scenes, same_bits, soup};
use crate::accel::test_support::{Random, brute_force, with_threads};

const SCHEMES: [Scheme; 7] = [
    Scheme::Stack,
    flags(false, 0),
    flags(true, 0),
    flags(false, 1),
    flags(false, 4),
    flags(true, 1),
    flags(true, 4),
];

const fn flags(push_down: bool, short_stack: u32) -> Scheme {
    Scheme::Flags { push_down, short_stack }
}

fn build(triangles: &[[Vec3; 3]], settings: &KdSettings) -> KdTree {
    let tree = KdTree::build(triangles, settings).expect("valid input");
    tree.validate().expect("a valid tree");
    tree
}

fn settings_of_all_kinds() -> [KdSettings; 4] {
    let default = KdSettings::default();
    [
        default,
        KdSettings {
            heuristic: Heuristic::SurfaceArea,
            clip: false,
            ..default
        },
        KdSettings {
            heuristic: Heuristic::Regions,
            leaf_size: 1,
            ..default
        },
        // Deep trees.
        KdSettings {
            intersection_cost: 1000.0,
            leaf_size: 1,
            ..default
        },
    ]
}

/// The leaves of a ray in order, as the triangles tested.
fn tested(tree: &KdTree, scheme: Scheme, ray: &Ray) -> (Hit, KdCounters) {
    let mut counters = KdCounters::default();
    let hit = tree.closest_hit_by(scheme, ray, &mut |_, _| true, &mut counters);
    (hit, counters)
}

#[test]
fn every_scheme_returns_what_trying_all_triangles_returns() {
    let mut random = Random(61);
    for (name, triangles) in hard_scenes() {
        for settings in settings_of_all_kinds() {
            let tree = build(&triangles, &settings);
            let mut usable = vec![false; triangles.len()];
            tree.indices().iter().for_each(|i| usable[*i as usize] = true);
            for ray in hard_rays(&mut random, &triangles, 60) {
                let expected = brute_force(&triangles, |i| usable[i], &ray);
                let (_, with_stack) = tested(&tree, Scheme::Stack, &ray);
                for scheme in SCHEMES {
                    let (hit, counters) = tested(&tree, scheme, &ray);
                    assert!(
                        same_bits(&hit, &expected),
                        "{name} {scheme:?} {ray:?}: {hit:?} for {expected:?}"
                    );
                    assert_eq!(
                        (counters.leaves, counters.triangles),
                        (with_stack.leaves, with_stack.triangles),
                        "{name} {scheme:?}"
                    );
                    let any = tree.any_hit_by(scheme, &ray, &mut |_, _| true, &mut KdCounters::default());
                    assert_eq!(any.is_hit(), expected.is_hit(), "{name} {scheme:?}");
                }
            }
        }
    }
}

#[test]
fn traversals_that_a_quota_stops_go_on_where_they_were() {
    let mut random = Random(67);
    let triangles = soup(&mut random, 800, 0.1, 1.0, Vec3::ZERO);
    let (deep, chained) = (build(&triangles, &settings_of_all_kinds()[3]), chain(32));
    for (tree, triangles) in [(&deep, &triangles), (&chained.0, &chained.1)] {
        for ray in hard_rays(&mut random, triangles, 200) {
            let (expected, whole) = tested(tree, Scheme::Stack, &ray);
            for scheme in SCHEMES {
                for quota in [1, 40] {
                    let mut work = KdCounters::default();
                    let mut traversal = KdTraversal::closest(scheme, &ray);
                    while traversal.resume != FINISHED {
                        traversal.run(tree, &ray, quota, &mut |_, _| true, &mut work);
                    }
                    assert!(same_bits(&traversal.hit, &expected), "{scheme:?} {quota} {ray:?}");
                    assert_eq!((work.leaves, work.triangles), (whole.leaves, whole.triangles));
                    assert!(work.nodes >= whole.nodes);
                }
            }
        }
    }
}

#[test]
fn the_top_of_a_tree_is_a_heap() {
    let triangles = soup(&mut Random(68), 3000, 0.05, 1.0, Vec3::ZERO);
    let heap = 1 << MAX_CACHED_LEVELS;
    for tree in [build(&triangles, &KdSettings::default()), chain(32).0, chain(3).0] {
        let mut pending = vec![(0u32, 1u64, 1)];
        while let Some((node, name, depth)) = pending.pop() {
            assert_eq!(node < heap, depth <= MAX_CACHED_LEVELS, "{node} at level {depth}");
            assert!(node >= heap || u64::from(node) == name || name == 1);
            if let KdKind::Inner { children, .. } = tree.nodes()[node as usize].kind() {
                pending.extend([0, 1].map(|side| (children + side, 2 * name + u64::from(side), depth + 1)));
            }
        }
    }
}

#[test]
fn caches_change_where_work_is_done_and_no_hit() {
    let mut random = Random(69);
    let triangles = soup(&mut random, 2000, 0.05, 1.0, Vec3::ZERO);
    let (soup, chained) = (build(&triangles, &settings_of_all_kinds()[3]), chain(32));
    for (tree, triangles) in [(&soup, &triangles), (&chained.0, &chained.1)] {
        let rays = hard_rays(&mut random, triangles, 500);
        let [none, nodes, head, postpone, nodes_head, bytes, nodes_postpone] = KdCaches::COMPARED.map(|caches| {
            let mut work = KdCounters::default();
            for ray in &rays {
                let mut traversal = KdTraversal::closest(Scheme::Stack, ray)
                    .with_caches(caches)
                    .expect("caches");
                traversal.run(tree, ray, u64::MAX, &mut |_, _| true, &mut work);
                assert!(same_bits(&traversal.hit, &tree.closest_hit(ray)), "{caches:?} {ray:?}");
            }
            work
        });
        println!(
            "bytes: {:?}",
            [none, nodes, head, postpone, nodes_head, bytes, nodes_postpone].map(|w| w.bytes())
        );
        for same in [nodes, head, nodes_head, bytes] {
            assert_eq!(
                (same.nodes, same.leaves, same.triangles, same.pops + same.register_pops),
                (none.nodes, none.leaves, none.triangles, none.pops)
            );
        }
        assert!(none.cached_nodes == 0 && head.cached_nodes == 0 && nodes.cached_nodes > none.nodes / 3);
        assert!(nodes.cached_nodes == nodes_head.cached_nodes && bytes.cached_nodes < nodes.cached_nodes);
        assert_eq!((nodes.pushes, nodes.register_pushes), (none.pushes, 0));
        assert_eq!(head.register_pushes, none.pushes);
        assert!(head.pushes < none.pushes && bytes.pushes + bytes.register_pushes == none.pushes);
        // Rays whose hit lies in the first of two leaves go on to the second, which it then spares them.
        assert!(postpone.nodes > none.nodes && postpone.leaves > none.leaves);
        assert!(postpone.triangles >= none.triangles);
        assert_eq!(postpone.nodes, nodes_postpone.nodes);
        assert!(nodes_head.bytes() < nodes.bytes().min(head.bytes()) && nodes.bytes().max(head.bytes()) < none.bytes());
    }
}

#[test]
fn a_leaf_that_waits_lets_its_ray_go_on_to_the_next() {
    // Along the axis each leaf lies behind one plane more; against it the last leaf lies behind all of them, and the others beside the way.
    let (tree, _) = chain(32);
    let along = Ray::new(Vec3::new(-1.0, 0.1, 0.1), Vec3::X);
    let against = Ray::new(Vec3::new(34.0, 0.1, 0.1), -Vec3::X);
    let waits = KdCaches {
        postpone: true,
        ..KdCaches::default()
    };
    let visits = |ray: &Ray, caches, accepts: bool| {
        let mut work = KdCounters::default();
        let traversal = KdTraversal::closest(Scheme::Stack, ray).with_caches(caches);
        let mut traversal = traversal.expect("caches");
        traversal.run(&tree, ray, u64::MAX, &mut |_, _| accepts, &mut work);
        let nearest = if ray.direction[0] > 0.0 { 0 } else { 32 };
        assert_eq!(traversal.hit.is_hit(), accepts);
        assert!(!accepts || traversal.hit.triangle == nearest, "{ray:?}");
        (work.nodes, work.leaves, work.triangles)
    };
    for (ray, at_once, later) in [(along, (1, 1, 1), (2, 2, 1)), (against, (32, 1, 1), (32, 2, 1))] {
        assert_eq!(visits(&ray, KdCaches::default(), true), at_once);
        assert_eq!(visits(&ray, waits, true), later);
        // Without a hit all leaves are gone to, and the last, which is left alone, is tested as well.
        for caches in [KdCaches::default(), waits] {
            assert_eq!(visits(&ray, caches, false), (32, 33, 33));
        }
    }
}

#[test]
fn every_point_of_a_triangle_lies_in_a_leaf_that_holds_it() {
    let mut random = Random(62);
    for (name, triangles) in hard_scenes() {
        for settings in settings_of_all_kinds() {
            let tree = build(&triangles, &settings);
            for _ in 0..200.min(200 * tree.positions().len()) {
                let place = random.below(tree.positions().len());
                let [a, b, c] = tree.positions()[place].map(|v| v.as_dvec3());
                let (u, v) = (f64::from(random.unit()), f64::from(random.unit()));
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let point = a + (b - a) * u + (c - a) * v;
                // Rounding of the point, in f64.
                let slack = 1e-12 * (1.0 + a.abs().max(b.abs()).max(c.abs()).max_element());
                let mut pending = vec![0];
                let mut found = false;
                while let Some(node) = pending.pop() {
                    match tree.nodes()[node as usize].kind() {
                        KdKind::Inner { axis, plane, children } => {
                            let height = point[axis] - f64::from(plane);
                            if height <= slack {
                                pending.push(children);
                            }
                            if height >= -slack {
                                pending.push(children + 1);
                            }
                        }
                        KdKind::Leaf { first, count } => {
                            found |= tree.references()[first as usize..][..count as usize].contains(&(place as u32));
                        }
                    }
                }
                assert!(found, "{name}: triangle {place} at {point}");
            }
        }
    }
}

#[test]
fn bytes_do_not_depend_on_the_number_of_threads() {
    let triangles = soup(&mut Random(63), 6000, 0.05, 1.0, Vec3::ZERO);
    let build_with = |threads| {
        with_threads(threads, || build(&triangles, &KdSettings::default()))
            .texels()
            .to_vec()
    };
    let one = build_with(1);
    for threads in [2, 4] {
        assert!(build_with(threads) == one, "{threads} threads");
    }
}

#[test]
fn a_wall_ends_in_a_leaf_without_volume() {
    let mut triangles = grid(8);
    triangles.extend(soup(&mut Random(64), 200, 0.1, 1.0, Vec3::new(4.0, 4.0, 3.0)));
    let tree = build(&triangles, &KdSettings::default());
    let mut flat = 0;
    tree.walk(|_, kind, bounds, _| {
        if let KdKind::Leaf { count, .. } = kind {
            flat += u32::from(count > 0 && bounds.lower.z == bounds.upper.z);
        }
    });
    assert!(flat > 0);
}

#[test]
fn small_and_empty_scenes_have_trees() {
    let none = build(&[], &KdSettings::default());
    assert!(!none.closest_hit(&Ray::new(Vec3::ZERO, Vec3::X)).is_hit());
    assert_eq!(none.statistics().sah_cost, 0.0);
    let triangles = [[Vec3::ZERO, Vec3::X, Vec3::Y]];
    let one = build(&triangles, &KdSettings::default());
    let hit = one.closest_hit(&Ray::new(Vec3::new(0.2, 0.2, 1.0), -Vec3::Z));
    assert_eq!((hit.t, hit.triangle), (1.0, 0));
    assert_eq!((one.statistics().leaves, one.statistics().nodes), (1, 0));
}

/// Squares across the x axis, one between each two of `levels` planes: a chain, since every plane cuts off one square.
fn chain(levels: u32) -> (KdTree, Vec<[Vec3; 3]>) {
    let triangles: Vec<[Vec3; 3]> = (0..=levels)
        .map(|i| {
            let x = i as f32 + 0.5;
            [
                Vec3::new(x, -1.0, -1.0),
                Vec3::new(x, 3.0, -1.0),
                Vec3::new(x, -1.0, 3.0),
            ]
        })
        .collect();
    let leaf = |i: u32| build::Built::Leaf(vec![i]);
    let mut built = leaf(levels);
    for level in (0..levels).rev() {
        built = build::Built::Inner(0, level as f32 + 1.0, Box::new([leaf(level), built]));
    }
    let bounds = triangles.iter().flatten().fold(Aabb::EMPTY, |b, p| b.with_point(*p));
    let indices = (0..=levels).collect();
    let tree = KdTree::lay_out(&built, bounds, triangles.clone(), indices, IndexStatistics::default());
    (tree.expect("small"), triangles)
}

#[test]
fn ways_as_long_as_the_word_of_flags_are_gone_to_their_end() {
    for levels in [1, 2, 31, 32] {
        let (tree, _) = chain(levels);
        tree.validate().expect("valid");
        assert_eq!(tree.statistics().max_depth, levels);
        for direction in [Vec3::X, -Vec3::X] {
            let start = if direction.x > 0.0 { -1.0 } else { levels as f32 + 2.0 };
            let ray = Ray::new(Vec3::new(start, 0.1, 0.1), direction);
            for scheme in SCHEMES {
                let mut seen = Vec::new();
                let mut counters = KdCounters::default();
                // No candidate counts, so all leaves are gone to.
                let mut filter = |triangle: u32, _: [f32; 2]| {
                    seen.push(triangle);
                    false
                };
                assert!(!tree.closest_hit_by(scheme, &ray, &mut filter, &mut counters).is_hit());
                let mut expected: Vec<u32> = (0..=levels).collect();
                if direction.x < 0.0 {
                    expected.reverse();
                }
                assert_eq!(seen, expected, "{levels} {scheme:?}");
            }
        }
    }
    let (deeper, _) = chain(33);
    assert!(matches!(deeper.validate(), Err(KdFault::Depth { .. })));
}

#[test]
fn bytes_are_eight_for_each_node_and_entry_that_memory_serves() {
    // Per ray: inner nodes, entries of the stack, and bytes as the source prints them (its table 4.8 a, b and d).
    for (nodes, entries, bytes) in [
        (7.31, 2.01, 74.51),
        (29.81, 12.31, 336.95),
        (37.63, 14.46, 416.72),
        (37.43, 16.96, 435.06),
        (19.57, 6.69, 210.03),
    ] {
        let hundred = |per_ray: f64| (100.0 * per_ray).round() as u64;
        let work = KdCounters {
            nodes: hundred(nodes),
            pushes: hundred(entries) - 50,
            pops: 50,
            leaves: 1000,
            triangles: 1000,
            register_pushes: 1000,
            register_pops: 1000,
            ..KdCounters::default()
        };
        // Both numbers are rounded to hundredths.
        assert!((0.01 * work.bytes() as f64 - bytes).abs() <= 0.0801, "{work:?}");
    }
    // A way of 32 nodes that leaves a far child at each: 32 entries pushed and popped.
    let (tree, _) = chain(32);
    let ray = Ray::new(Vec3::new(34.0, 0.1, 0.1), -Vec3::X);
    let with = |node_levels, stack| KdCaches {
        node_levels,
        stack,
        ..KdCaches::default()
    };
    for (caches, words) in [
        (with(0, StackCache::None), 32 + 32 + 32),
        (with(3, StackCache::None), 29 + 32 + 32),
        // The last entry never comes to memory.
        (with(0, StackCache::Head), 32 + 31 + 31),
        (with(10, StackCache::Head), 22 + 31 + 31),
    ] {
        let mut work = KdCounters::default();
        let traversal = KdTraversal::closest(Scheme::Stack, &ray).with_caches(caches);
        traversal
            .expect("caches")
            .run(&tree, &ray, u64::MAX, &mut |_, _| false, &mut work);
        assert_eq!(work.bytes(), 8 * words, "{caches:?}");
    }
}

/// Where a ray enters and leaves a box by its planes, in f64 with the reciprocals of the traversal.
fn exact_span(boxes: &BoxTest, bounds: &Aabb) -> [f64; 2] {
    let mut span = [f64::NEG_INFINITY, f64::INFINITY];
    for axis in 0..3 {
        let at = |plane: f32| (f64::from(plane) - f64::from(boxes.origin[axis])) * f64::from(boxes.inverse[axis]);
        let (a, b) = (at(bounds.lower[axis]), at(bounds.upper[axis]));
        span = [span[0].max(a.min(b)), span[1].min(a.max(b))];
    }
    span
}

#[test]
fn leaves_come_in_the_order_of_the_ray() {
    let mut random = Random(75);
    let mut followed = 0;
    for (name, triangles) in hard_scenes() {
        for settings in settings_of_all_kinds() {
            let tree = build(&triangles, &settings);
            let mut bounds_of = vec![Aabb::EMPTY; tree.nodes().len()];
            tree.walk(|node, _, bounds, _| bounds_of[node as usize] = *bounds);
            for (i, ray) in hard_rays(&mut random, &triangles, 40).into_iter().enumerate() {
                let boxes = BoxTest::new(&tree.bounds(), &ray);
                let leaves = SCHEMES.map(|scheme| {
                    let mut leaves = Vec::new();
                    // Every second ray goes through everything.
                    let mut filter = |_: u32, _: [f32; 2]| i % 2 == 0;
                    let mut work = KdCounters::default();
                    let mut traversal = KdTraversal::closest(scheme, &ray);
                    traversal.run_watched(&tree, &ray, u64::MAX, &mut filter, &mut work, &mut |leaf| {
                        leaves.push(leaf)
                    });
                    leaves
                });
                for (scheme, other) in SCHEMES.iter().zip(&leaves) {
                    assert_eq!(other, &leaves[0], "{name} {scheme:?} {ray:?}");
                }
                // No leaf begins before one that came earlier has ended: a plane parts each two, and the near side comes first.
                let mut ended = f64::NEG_INFINITY;
                for leaf in &leaves[0] {
                    let [enter, leave] = exact_span(&boxes, &bounds_of[*leaf as usize]);
                    assert!(enter >= ended, "{name} {ray:?}: {enter} after {ended}");
                    ended = ended.max(leave);
                    followed += 1;
                }
            }
        }
    }
    assert!(followed > 5000, "{followed} leaves");
}

#[test]
fn work_is_in_the_order_of_the_schemes() {
    let triangles = soup(&mut Random(65), 4000, 0.05, 1.0, Vec3::ZERO);
    let tree = build(&triangles, &KdSettings::default());
    let mut random = Random(66);
    let mut nodes = [0; 7];
    for _ in 0..2000 {
        let ray = Ray::new(random.vector(), random.direction());
        for (i, scheme) in SCHEMES.into_iter().enumerate() {
            nodes[i] += tested(&tree, scheme, &ray).1.nodes;
        }
    }
    println!("{nodes:?}");
    let [stack, plain, push_down, _, short, _, both] = nodes;
    assert!(plain > push_down && push_down > short && short >= both && both >= stack);
}

#[test]
fn a_hit_ends_a_ray_without_a_restart_for_each_far_child_that_is_left() {
    let triangles = soup(&mut Random(76), 4000, 0.12, 1.0, Vec3::ZERO);
    let tree = build(&triangles, &KdSettings::default());
    for scheme in [flags(false, 0), flags(true, 0)] {
        let mut random = Random(77);
        let (mut restarts, mut needed, mut hits) = (0, 0, 0);
        for _ in 0..4000 {
            let (hit, work) = tested(&tree, scheme, &Ray::new(random.vector(), random.direction()));
            restarts += work.restarts;
            // The way to the first leaf is none.
            needed += work.leaves.saturating_sub(1);
            hits += u32::from(hit.is_hit());
        }
        println!("{scheme:?}: {restarts} restarts for {needed} leaves, {hits} hits");
        // Hits within the slack of their leaf's end still cost some.
        assert!(hits > 1000 && restarts >= needed && (restarts - needed) * 50 < restarts);
    }
}

#[test]
fn settings_out_of_range_are_refused() {
    let default = KdSettings::default();
    for wrong in [
        KdSettings {
            leaf_size: 0,
            ..default
        },
        KdSettings {
            max_depth: 33,
            ..default
        },
        KdSettings {
            traversal_cost: f64::NAN,
            ..default
        },
        KdSettings {
            empty_bonus: 1.5,
            ..default
        },
    ] {
        assert!(matches!(KdTree::build(&[], &wrong), Err(Error::Setting { .. })));
    }
}
