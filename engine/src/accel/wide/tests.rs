use super::grid::GridAxis;
use super::slots::assign;
use super::traverse::{wide_grid, wide_in_order};
use super::*;
use crate::accel::box_test::{BOX_SLACK, BoxTest};
use crate::accel::bvh2::Bvh2Settings;
use crate::accel::bvh2::tests::{grid, hard_rays, hard_scenes, same_bits, soup};
use crate::accel::test_support::{Random, U, brute_force, with_threads};
use crate::accel::{FINISHED, NO_HIT};
use crate::gpu::shaders::constants;

fn build(triangles: &[[Vec3; 3]]) -> WideBvh {
    WideBvh::build(triangles, &WideSettings::default()).expect("valid input")
}

/// The same of a tree by the binned heuristic.
fn of_binned(triangles: &[[Vec3; 3]]) -> WideBvh {
    let settings = Bvh2Settings {
        leaf_size: LEAF_SIZE,
        ..Bvh2Settings::default()
    };
    let binary = Bvh2::build(triangles, &settings).expect("valid input");
    WideBvh::collapse(&binary, &WideSettings::default()).expect("valid tree")
}

fn usable(triangles: &[[Vec3; 3]], bvh: &WideBvh) -> Vec<bool> {
    let mut usable = vec![false; triangles.len()];
    for triangle in bvh.triangles() {
        let before = std::mem::replace(&mut usable[triangle.index as usize], true);
        assert!(!before, "triangle {} is in two places", triangle.index);
    }
    usable
}

#[test]
fn traversal_equals_trying_all_triangles_bit_for_bit() {
    let mut random = Random(21);
    for (name, triangles) in hard_scenes() {
        for bvh in [build(&triangles), of_binned(&triangles)] {
            let usable = usable(&triangles, &bvh);
            let mut hits = 0;
            for ray in hard_rays(&mut random, &triangles, 1000) {
                let expected = brute_force(&triangles, |i| usable[i], &ray);
                let hit = bvh.closest_hit(&ray);
                assert!(same_bits(&hit, &expected), "{name}: {ray:?}\n{hit:?}\n{expected:?}");
                assert_eq!(bvh.any_hit(&ray), expected.is_hit(), "{name}: {ray:?}");
                hits += u32::from(expected.is_hit());
            }
            assert!(hits > 40 || triangles.is_empty(), "{name}: {hits} hits");
        }
    }
}

/// Boxes of all leaves and, by their nodes, of all that is below, beside the slot that holds them.
fn held(bvh: &WideBvh) -> Vec<(usize, usize, Aabb)> {
    let nodes = bvh.nodes();
    let mut own = vec![Aabb::EMPTY; nodes.len()];
    let mut all = Vec::new();
    // Children come behind their parents.
    for (index, node) in nodes.iter().enumerate().rev() {
        for slot in 0..SLOTS {
            let (first, count) = node.leaf(slot);
            let corners = bvh.triangles()[first as usize..][..count as usize]
                .iter()
                .flat_map(|t| t.corners);
            let mut bounds = corners.fold(Aabb::EMPTY, Aabb::with_point);
            if let Some(child) = node.child(slot) {
                bounds = own[child as usize];
            } else if count == 0 {
                continue;
            }
            own[index] = own[index].union(bounds);
            all.push((index, slot, bounds));
        }
    }
    all
}

#[test]
fn trees_are_well_formed() {
    for (name, triangles) in hard_scenes() {
        for bvh in [build(&triangles), of_binned(&triangles)] {
            let statistics = bvh.statistics();
            let used = usable(&triangles, &bvh).iter().filter(|used| **used).count() as u64;
            assert_eq!(statistics.triangles, used, "{name}");
            let excluded = statistics.excluded_range + statistics.excluded_degenerate;
            assert_eq!(used + excluded, triangles.len() as u64, "{name}");
            let nodes = bvh.nodes();
            let (mut next, mut reached, mut deepest) = (0, 1, 0);
            let mut depths = vec![1; nodes.len()];
            for (index, node) in nodes.iter().enumerate() {
                deepest = deepest.max(depths[index]);
                for slot in 0..SLOTS {
                    let (first, count) = node.leaf(slot);
                    if let Some(child) = node.child(slot) {
                        assert_eq!(count, 0, "{name}: slot {slot} of node {index} holds both");
                        assert!(child as usize > index, "{name}");
                        let parent = nodes[child as usize].parent;
                        assert_eq!((parent >> 3, parent & 7), (index as u32, slot as u32), "{name}");
                        depths[child as usize] = depths[index] + 1;
                        reached += 1;
                    } else if count > 0 {
                        assert!(first + count <= statistics.triangles as u32, "{name}");
                        next += count;
                    }
                }
            }
            assert_eq!((reached, u64::from(next)), (nodes.len(), used), "{name}");
            assert_eq!(statistics.max_depth, deepest, "{name}");
            assert!(deepest <= MAX_DEPTH, "{name}");
            assert_eq!(statistics.bytes, 16 * bvh.texels().len() as u64, "{name}");
            let leaves = (0..nodes.len() * SLOTS)
                .filter(|i| nodes[i / SLOTS].leaf(i % SLOTS).1 > 0)
                .count();
            assert_eq!(
                (statistics.nodes, statistics.leaves),
                (nodes.len() as u64, leaves as u64),
                "{name}"
            );
            assert!(used < 2 || statistics.sah_cost > 1.0, "{name}");
        }
    }
}

#[test]
fn decoded_boxes_contain_what_they_are_made_of() {
    let mut random = Random(22);
    let mut scenes = hard_scenes();
    // Numbers near zero beside large ones, and numbers too small to be normal.
    let tiny = |random: &mut Random| [0; 3].map(|_| random.vector() * 1e-38 * 10f32.powi(-(random.below(8) as i32)));
    let mut uneven: Vec<_> = (0..300).map(|_| tiny(&mut random)).collect();
    uneven.extend(soup(&mut random, 300, 0.5, 1e9, Vec3::ZERO));
    scenes.push(("uneven", uneven));
    scenes.push(("denormal", (0..300).map(|_| tiny(&mut random)).collect()));
    for (name, triangles) in scenes {
        let bvh = build(&triangles);
        for (node, slot, bounds) in held(&bvh) {
            let [lower, upper] = bvh.nodes()[node].bounds(slot);
            let contains = lower.cmple(bounds.lower.as_dvec3()).all() && upper.cmpge(bounds.upper.as_dvec3()).all();
            assert!(
                contains,
                "{name}: node {node}, slot {slot}: {bounds:?} in {lower} to {upper}"
            );
            // By a step at each side at most, which the difference of so unlike numbers may be rounded to.
            let step = DVec3::from_array([0, 1, 2].map(|axis| f64::from(bvh.nodes()[node].step(axis))));
            assert!(
                (bounds.lower.as_dvec3() - lower).cmple(step).all(),
                "{name}: {bounds:?} in {lower}"
            );
            assert!(
                (upper - bounds.upper.as_dvec3()).cmple(step).all(),
                "{name}: {bounds:?} in {upper}"
            );
        }
    }
}

#[test]
fn grids_are_as_fine_as_they_can_be() {
    let mut random = Random(23);
    for i in 0..20_000 {
        let scale = 10f32.powi(random.below(18) as i32 - 9);
        let (a, b) = (
            random.signed() * scale,
            random.signed() * if i % 2 == 0 { scale } else { 1e9 },
        );
        let (lower, upper) = (a.min(b), a.max(b));
        let axis = GridAxis::over(lower, upper);
        let step = 2f64.powi(i32::from(axis.exponent) - 127);
        let corner = f64::from(axis.corner);
        // The difference of so unlike numbers may be rounded to a step.
        assert!(
            corner <= f64::from(lower) && f64::from(lower) - corner <= step,
            "{lower} {upper}"
        );
        assert_eq!((corner / step).fract(), 0.0, "{lower} {upper}");
        let [first, last] = axis.planes(lower, upper);
        assert_eq!(first, 0);
        // Half the step would not do.
        let needed = |step: f64| (f64::from(upper) / step).ceil() - (f64::from(lower) / step).floor();
        assert_eq!(f64::from(last), needed(step));
        assert!(needed(0.5 * step) > 255.0 || lower == upper, "{lower} {upper}");
    }
    let flat = GridAxis::over(1e9, 1e9);
    assert_eq!((flat.corner, flat.planes(1e9, 1e9)), (1e9, [0, 0]));
}

#[test]
fn spans_of_decoded_boxes_keep_their_stated_error() {
    let mut random = Random(24);
    let mut worst = 0.0f64;
    for (_, triangles) in hard_scenes().into_iter().filter(|(_, triangles)| triangles.len() > 2) {
        let bvh = build(&triangles);
        let bounds = bvh.bounds();
        for ray in hard_rays(&mut random, &triangles, 400)
            .iter()
            .filter(|ray| ray.is_traceable())
        {
            let boxes = BoxTest::new(&bounds, ray);
            let origin = Vec3::from(ray.origin).as_dvec3();
            let node = &bvh.nodes()[random.below(bvh.nodes().len())];
            let grid = wide_grid(&boxes, node);
            let reach = (bounds.lower.as_dvec3() - origin)
                .abs()
                .max((bounds.upper.as_dvec3() - origin).abs())
                .max_element();
            for axis in 0..3 {
                // Components that are clamped have another inverse, whose difference the slack covers.
                let direction = f64::from(ray.direction[axis]);
                if direction.abs() < 1e-15 * f64::from(Vec3::from(ray.direction).abs().max_element()) {
                    continue;
                }
                for plane in [0, 1, random.below(256), 254, 255].map(|plane| plane as u8) {
                    let exact = f64::from(node.corner[axis]) + f64::from(plane) * f64::from(node.step(axis));
                    let exact = (exact - origin[axis]) / direction;
                    let slack = f64::from(BOX_SLACK) * reach / direction.abs();
                    for (found, side) in [(grid.near[axis], -1.0), (grid.far[axis], 1.0)] {
                        let found = f32::from(plane) * grid.scale[axis] + found;
                        let error = (f64::from(found) - (exact + side * slack)).abs() * direction.abs() / (U * reach);
                        worst = worst.max(error);
                    }
                }
            }
        }
    }
    // Divisions of this machine err by half a unit; the bound allows for five.
    assert!(worst > 2.0 && worst < 12.0, "{worst}");
}

#[test]
fn places_in_the_order_are_slots_seen_from_the_octant() {
    for octant in 0..8 {
        for slots in 0..256 {
            let order = wide_in_order(slots, octant);
            assert_eq!(order.count_ones(), slots.count_ones());
            assert_eq!(wide_in_order(order, octant), slots);
        }
        assert_eq!(
            wide_in_order(1 << octant, octant),
            1,
            "the slot of the octant comes first"
        );
    }
    // Children that lie in the eight octants go to the slots of theirs, and rays meet them from front to back.
    let corner = |slot: usize| Vec3::new((slot & 1) as f32, (slot >> 1 & 1) as f32, (slot >> 2) as f32);
    let order = [5, 2, 7, 0, 3, 6, 1, 4];
    let children = order.map(|slot| {
        let lower = corner(slot);
        (
            Aabb {
                lower,
                upper: lower + 0.9,
            },
            slot % 2 == 0,
        )
    });
    assert_eq!(assign(Vec3::ONE, &children).map(usize::from), order);
}

/// The least cost of a binary subtree in so many slots, by trying every way.
fn least_cost(binary: &Bvh2, word: u32, bounds: &Aabb, slots: usize, costs: &(f64, f64)) -> f64 {
    use crate::accel::bvh2::{COUNT_BITS, COUNT_MASK};
    let (root, triangle) = *costs;
    let area = bounds.half_area() / root;
    let count = word & COUNT_MASK;
    if count > 0 {
        return area * f64::from(count) * triangle;
    }
    let node = &binary.nodes()[(word >> COUNT_BITS) as usize];
    let in_two = |slots: usize| {
        let ways = (1..slots).map(|left| {
            least_cost(binary, node.children[0], &node.bounds[0], left.min(7), costs)
                + least_cost(binary, node.children[1], &node.bounds[1], (slots - left).min(7), costs)
        });
        ways.fold(f64::INFINITY, f64::min)
    };
    let mut pending = vec![word];
    let mut below = 0;
    while let Some(next) = pending.pop() {
        match next & COUNT_MASK {
            0 => pending.extend(binary.nodes()[(next >> COUNT_BITS) as usize].children),
            count => below += count,
        }
    }
    let leaf = if below <= LEAF_SIZE {
        area * f64::from(below) * triangle
    } else {
        f64::INFINITY
    };
    let whole = (area + in_two(SLOTS)).min(leaf);
    if slots == 1 { whole } else { whole.min(in_two(slots)) }
}

#[test]
fn no_other_collapse_costs_less() {
    let mut random = Random(25);
    for (count, triangle_cost) in [(2, 0.4), (5, 0.4), (9, 0.1), (11, 2.0), (12, 0.4)] {
        let triangles = soup(&mut random, count, 0.4, 1.0, Vec3::ZERO);
        let settings = Bvh2Settings {
            leaf_size: 1,
            ..Bvh2Settings::default()
        };
        let binary = Bvh2::build(&triangles, &settings).expect("valid input");
        let [a, b] = binary.nodes()[0].bounds;
        let bounds = a.union(b);
        let root = bounds.half_area();
        let costs = (root, f64::from(triangle_cost));
        let node = &binary.nodes()[0];
        let ways = (1..SLOTS).map(|left| {
            least_cost(&binary, node.children[0], &node.bounds[0], left, &costs)
                + least_cost(&binary, node.children[1], &node.bounds[1], SLOTS - left, &costs)
        });
        let least = 1.0 + ways.fold(f64::INFINITY, f64::min);
        let tree = super::collapse::Collapse::of(binary.nodes(), triangle_cost, SLOTS);
        let found = f64::from(tree.root_cost()) / root;
        assert!((found - least).abs() < 1e-5 * least, "{count}: {found} {least}");
        // What was written costs that, too.
        let settings = WideSettings {
            triangle_cost,
            ..WideSettings::default()
        };
        let wide = WideBvh::collapse(&binary, &settings).expect("valid tree");
        let mut cost = 1.0;
        for (node, slot, bounds) in held(&wide) {
            let count = wide.nodes()[node].leaf(slot).1;
            let tests = if count > 0 { f64::from(count) * costs.1 } else { 1.0 };
            cost += tests * bounds.half_area() / root;
        }
        assert!((cost - least).abs() < 1e-5 * least, "{count}: {cost} {least}");
    }
}

#[test]
fn stopped_traversals_go_on_without_loss_or_repetition() {
    let mut random = Random(26);
    let (mut stops, mut quota) = (0, 0);
    for (name, triangles) in hard_scenes() {
        let bvh = build(&triangles);
        for ray in hard_rays(&mut random, &triangles, 200) {
            for start in [WideTraversal::closest(&ray), WideTraversal::any(&ray)] {
                let mut whole = start;
                let mut counters = TraversalCounters::default();
                whole.run(&bvh, &ray, u64::MAX, &mut |_, _| true, &mut counters);
                let mut parts = start;
                let mut parts_counters = TraversalCounters::default();
                // The least that gets on: a node beyond the way back.
                quota = u64::from(bvh.statistics().max_depth) + 1;
                let mut runs = 0;
                while parts.resume != FINISHED {
                    parts.run(&bvh, &ray, quota, &mut |_, _| true, &mut parts_counters);
                    runs += 1;
                    assert!(runs < 10_000, "{name}: no progress");
                }
                assert!(same_bits(&whole.hit, &parts.hit), "{name}: {ray:?}");
                // Fewer when the hit so far culls a sibling that the stack would have kept.
                assert!(parts_counters.triangles <= counters.triangles, "{name}: {ray:?}");
                stops += runs - 1;
            }
        }
    }
    assert!(stops > 1000, "{stops} stops, the last quota {quota}");
}

#[test]
fn filter_decides_which_candidates_count() {
    let mut random = Random(27);
    let triangles = soup(&mut random, 400, 0.4, 1.0, Vec3::ZERO);
    let bvh = build(&triangles);
    for ray in hard_rays(&mut random, &triangles, 1000) {
        let expected = brute_force(&triangles, |i| i % 3 == 0, &ray);
        let mut third = |triangle: u32, _: [f32; 2]| triangle.is_multiple_of(3);
        let hit = bvh.closest_hit_filtered(&ray, &mut third, &mut TraversalCounters::default());
        assert!(same_bits(&hit, &expected));
        let met = bvh.any_hit_filtered(&ray, &mut third, &mut TraversalCounters::default());
        assert_eq!(met, expected.is_hit());
    }
}

#[test]
fn bytes_do_not_depend_on_the_number_of_threads() {
    let triangles = soup(&mut Random(28), 30_000, 0.02, 1.0, Vec3::ZERO);
    let built = |threads| with_threads(threads, || build(&triangles));
    let one = built(1);
    assert!(one.texels() == built(3).texels());
    assert!(one.statistics().bytes < 65 * 30_000, "{} bytes", one.statistics().bytes);
}

#[test]
fn a_million_equal_triangles_are_one_flat_tree() {
    let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let bvh = build(&vec![triangle; 1_000_000]);
    let statistics = bvh.statistics();
    assert!(statistics.max_depth <= 20, "{statistics:?}");
    let r = Ray::new(Vec3::new(0.25, 0.25, 1.0), -Vec3::Z);
    let mut counters = TraversalCounters::default();
    let mut traversal = WideTraversal::closest(&r);
    while traversal.resume != FINISHED {
        traversal.run(&bvh, &r, 30_000, &mut |_, _| true, &mut counters);
    }
    assert_eq!((traversal.hit.triangle, counters.triangles), (0, 1_000_000));
    assert!(
        !bvh.closest_hit(&Ray::new(Vec3::new(0.75, 0.75, 1.0), -Vec3::Z))
            .is_hit()
    );
}

/// A chain of the binary tree: each next triangle many times as far and as large, so that every split cuts off one.
fn chain() -> Vec<[Vec3; 3]> {
    let at = |i: i32| 4f32.powi(i - 15) * Vec3::new(1.0, 0.01, 0.02);
    (0..30)
        .map(|i| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|v| at(i) + v * 4f32.powi(i - 15) * 0.1))
        .collect()
}

#[test]
fn ways_of_chains_are_shorter_than_in_the_binary_tree() {
    let triangles = chain();
    let binary = Bvh2::build(
        &triangles,
        &Bvh2Settings {
            leaf_size: 1,
            ..Bvh2Settings::default()
        },
    )
    .expect("valid");
    let bvh = build(&triangles);
    assert!(binary.statistics().max_depth > 12, "{:?}", binary.statistics());
    assert!(
        bvh.statistics().max_depth < binary.statistics().max_depth / 2,
        "{:?}",
        bvh.statistics()
    );
    let mut random = Random(29);
    for ray in hard_rays(&mut random, &triangles, 500) {
        assert!(same_bits(
            &bvh.closest_hit(&ray),
            &brute_force(&triangles, |_| true, &ray)
        ));
    }
}

#[test]
fn nothing_and_one_triangle_are_trees_too() {
    let none = build(&[]);
    assert_eq!(
        (none.nodes().len(), none.triangles().len(), none.nodes()[0].slots),
        (1, 0, 0)
    );
    assert!(!none.closest_hit(&Ray::new(Vec3::ONE, -Vec3::ONE)).is_hit());
    let one = build(&[[Vec3::ZERO, Vec3::X, Vec3::Y]]);
    assert_eq!(
        (
            one.triangles().len(),
            (one.nodes()[0].slots & constants::WIDE_TRIANGLE_MASK).count_ones()
        ),
        (1, 1)
    );
    assert_eq!(
        one.closest_hit(&Ray::new(Vec3::new(0.25, 0.25, 1.0), -Vec3::Z))
            .triangle,
        0
    );
    assert!(one.triangles().iter().all(|t| t.index != NO_HIT));
}

#[test]
fn invalid_rays_and_settings_are_refused() {
    let triangles = grid(4);
    let bvh = build(&triangles);
    let good = Ray::new(Vec3::new(1.3, 1.4, 5.0), -Vec3::Z);
    assert!(bvh.any_hit(&good));
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
        for i in 0..3 {
            let (mut origin, mut direction) = (good, good);
            origin.origin[i] = bad;
            direction.direction[i] = bad;
            assert!(!bvh.any_hit(&origin) && !bvh.any_hit(&direction));
        }
    }
    for (t_min, t_max) in [(f32::NAN, 10.0), (0.0, f32::NAN), (6.0, 5.0)] {
        assert!(!bvh.any_hit(&Ray { t_min, t_max, ..good }));
    }
    for (leaf_size, triangle_cost) in [(0, 0.4), (LEAF_SIZE + 1, 0.4), (LEAF_SIZE, -1.0), (LEAF_SIZE, f32::NAN)] {
        let mut settings = WideSettings {
            triangle_cost,
            ..WideSettings::default()
        };
        settings.binary.leaf_size = leaf_size;
        assert!(WideBvh::build(&triangles, &settings).is_err());
    }
    // Heaps of leaves that a slot cannot hold.
    let heap = vec![triangles[0]; 40];
    let large = Bvh2::build(
        &heap,
        &Bvh2Settings {
            leaf_size: 8,
            ..Bvh2Settings::default()
        },
    )
    .expect("valid");
    assert!(WideBvh::collapse(&large, &WideSettings::default()).is_err());
}

#[test]
fn refitted_trees_have_the_hits_of_all_triangles() {
    let mut random = Random(30);
    for (name, mut triangles) in hard_scenes() {
        let trees = [build(&triangles), of_binned(&triangles)];
        for tree in &trees {
            let same = refit(tree, &triangles).expect("unmoved");
            assert!(same.texels() == tree.texels(), "{name}");
            assert_eq!(same.statistics(), tree.statistics(), "{name}");
        }
        // Some go far, a plane's triangles and points among them.
        let largest = triangles
            .iter()
            .flatten()
            .filter(|v| v.is_finite())
            .fold(1e-3f32, |largest, v| largest.max(v.abs().max_element().min(1e8)));
        for (i, triangle) in triangles.iter_mut().enumerate() {
            let shift = largest * random.vector() * if i % 50 == 0 { 2.0 } else { 0.02 };
            triangle.iter_mut().for_each(|v| *v += shift);
            if i % 40 == 1 {
                triangle[1] = triangle[2];
            }
        }
        for tree in &trees {
            let usable = usable(&triangles, tree);
            let Ok(moved) = refit(tree, &triangles) else {
                assert!(
                    triangles.iter().flatten().any(|v| v.abs().max_element() > 1e9),
                    "{name}"
                );
                continue;
            };
            assert_eq!(moved.statistics().max_depth, tree.statistics().max_depth, "{name}");
            let meets = |i: usize| usable[i] && crate::accel::input::can_be_met(&triangles[i]);
            let mut hits = 0;
            for ray in hard_rays(&mut random, &triangles, 600) {
                let expected = brute_force(&triangles, meets, &ray);
                let hit = moved.closest_hit(&ray);
                assert!(same_bits(&hit, &expected), "{name}: {ray:?}\n{hit:?}\n{expected:?}");
                assert_eq!(moved.any_hit(&ray), expected.is_hit(), "{name}: {ray:?}");
                hits += u32::from(expected.is_hit());
            }
            assert!(hits > 20 || triangles.len() < 3, "{name}: {hits} hits");
        }
    }
    let triangles = grid(6);
    let tree = build(&triangles);
    assert!(refit(&tree, &triangles[1..]).is_err());
    let mut far = triangles;
    far[3][1].y = f32::INFINITY;
    assert!(refit(&tree, &far).is_err());
}
