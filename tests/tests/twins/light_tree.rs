//! The tree of lights: importances, shares, choices by one word and their probabilities by the way to a light.

use clerestory::gpu::shaders::constants::{LIGHT_NODE_LEAF, LIGHT_TRAIL_NONE, POTENTIAL_BINS};
use clerestory::gpu::shaders::types::SceneLightNode;
use clerestory::techniques::instant_radiosity::selection::{potential_bin, potential_bin_least};
use clerestory::transport::light_tree::{
    CUT_MAX, CutReceiver, FixedLight, LightBounds, LightCone, LightTree, NearLight, build_light_tree, cone_union,
    light_node_importance, light_node_share, light_node_union, light_tree_probability, light_tree_sample,
    perfect_light_tree,
};
use clerestory::transport::random::unit_float;
use clerestory_tests::random::Random;
use clerestory_tests::twin::{U, compare, trigonometric_error};
use clerestory_tests::{twin_kernel, with_gpu};

use crate::tables::{halves, word};
use crate::{cases, join, ulps, v3};

twin_kernel!(twin_light_tree);

/// Lights with a place, and distant ones.
const NEAR: u32 = 60;
const DISTANT: u32 = 2;

/// Panels and bare lamps: what they send changes without a step, so that rounding of f32 makes small differences only.
fn tree() -> LightTree {
    let mut random = Random(81);
    let near: Vec<NearLight> = (0..NEAR)
        .map(|light| {
            let lower = 5.0 * random.vector().as_dvec3();
            let panel = light % 3 > 0;
            let bounds = LightBounds {
                lower,
                upper: lower
                    + if panel {
                        random.vector().abs().as_dvec3()
                    } else {
                        Default::default()
                    },
                cone: if panel {
                    LightCone::of_front(random.direction().as_dvec3().normalize())
                } else {
                    LightCone::ALL
                },
                strength: random.magnitude(-4, 4).into(),
            };
            NearLight { light, bounds }
        })
        .collect();
    let distant: Vec<FixedLight> = (0..DISTANT)
        .map(|i| FixedLight {
            light: NEAR + i,
            weight: f64::from(i),
        })
        .collect();
    build_light_tree(&near, 3.0, &distant, (NEAR + DISTANT) as usize)
}

/// As the kernel reads it.
fn floats(tree: &LightTree) -> Vec<f32> {
    let words: &[u32] = bytemuck::cast_slice(&tree.nodes);
    let mut floats: Vec<f32> = words.iter().map(|word| f32::from_bits(*word)).collect();
    for (node, floats) in tree.nodes.iter().zip(floats.chunks_mut(16)) {
        let is_leaf = node.child & LIGHT_NODE_LEAF != 0;
        floats[14] = if is_leaf {
            -1.0 - (node.child & !LIGHT_NODE_LEAF) as f32
        } else {
            node.child as f32
        };
        floats[15] = node.node_count as f32;
    }
    let trails = tree.trails.iter();
    floats.extend(trails.map(|trail| {
        if *trail == LIGHT_TRAIL_NONE {
            -1.0
        } else {
            *trail as f32
        }
    }));
    floats
}

#[test]
fn choices_by_a_tree_agree_with_their_twins() {
    with_gpu(|gpu| {
        let tree = tree();
        let table = cases(18, |r| {
            let normal = if r.below(4) == 0 {
                [0.0; 3]
            } else {
                r.direction().to_array()
            };
            let [a, b] = [halves(r.word()), halves(r.word())];
            let light = f32::from_bits(r.below((NEAR + DISTANT) as usize) as u32);
            let node = f32::from_bits(r.below(tree.nodes.len()) as u32);
            join(&[&(8.0 * r.vector()).to_array(), &normal, &a, &b, &[light, node]])
        });
        let results = twin_light_tree(gpu, 0, &table, &floats(&tree));
        let of = |x: &[f64]| {
            let bits = |i: usize| (x[i] as f32).to_bits();
            (v3(x, 0), v3(x, 3), bits(10), tree.nodes[bits(11) as usize])
        };
        // A share is rounded to a step, on either side where it is half way between two.
        compare("light tree", &table, &results, ulps(64.0, 16.0, 2.0 * U), 0..6, |x| {
            let (from, normal, light, node) = of(x);
            let share = if node.child & LIGHT_NODE_LEAF != 0 {
                0.0
            } else {
                let [first, second] = [0, 1].map(|i| &tree.nodes[(node.child + i) as usize]);
                light_node_share(first, second, node.share.into(), from, normal)
            };
            vec![
                light_node_importance(&node, from, normal),
                share,
                light_tree_probability(&tree, light, from, normal),
            ]
        });
        let mut others = 0;
        for (case, result) in table.iter().zip(&results) {
            let x = case.0.map(f64::from);
            let (from, normal, ..) = of(&x);
            let mut place = word(&x, 6);
            let (light, probability) = light_tree_sample(&tree.nodes, from, normal, &mut place, word(&x, 8));
            // By the way there as by the way down.
            let [down, again] = [result.0[4], result.0[5]].map(f64::from);
            assert!((down - again).abs() <= 16.0 * U * down, "{down} {again}");
            if result.bits(3) != light {
                // A word at a rim of a share may fall to its other side.
                others += 1;
                continue;
            }
            // What rounding does to a share of so many words it does to a place in it, at each of a few levels.
            let allowed = 256.0 * U / probability;
            let difference = (f64::from(result.0[6]) - unit_float(place)).abs();
            assert!(difference <= allowed, "{difference} of {allowed}");
        }
        // The rims of 62 shares, each as wide as rounding makes it, hold far fewer than a hundredth of all words.
        assert!(others <= table.len() / 100, "{others}");
    });
}

/// Lights of Lambert's law in a row, in the order in which they lie.
fn perfect_tree() -> LightTree {
    let mut random = Random(82);
    let leaf = |number: u32| SceneLightNode {
        center: (4.0 * random.vector() + glam::Vec3::X * number as f32).to_array(),
        strength: random.magnitude(-4, 4),
        axis: random.direction().to_array(),
        cos_spread: 1.0,
        child: LIGHT_NODE_LEAF | number,
        ..SceneLightNode::default()
    };
    let leaves: Vec<SceneLightNode> = (0..CUT_LIGHTS).map(leaf).collect();
    let mut nodes = perfect_light_tree(&leaves);
    nodes[0].node_count = nodes.len() as u32;
    let trails = vec![0; leaves.len()];
    LightTree { nodes, trails }
}

/// No power of two, so that levels end with nodes of one child.
const CUT_LIGHTS: u32 = 77;

#[test]
fn unions_agree_with_their_twins() {
    with_gpu(|gpu| {
        let tree = perfect_tree();
        // Arc cosines of the software driver are off by some of its units.
        let absolute = 4.0 * trigonometric_error(gpu);
        let table = cases(83, |r| {
            let mut cone = || {
                let axis = r.direction();
                [axis.x, axis.y, axis.z, r.range(0.0, 3.0), r.range(0.0, 1.5)]
            };
            let (a, b) = (cone(), cone());
            let key = r.magnitude(-50, 30);
            let [bin, first, second] = [POTENTIAL_BINS as usize, tree.nodes.len(), tree.nodes.len()]
                .map(|n| f32::from_bits(r.below(n) as u32));
            join(&[&a, &b, &[key, bin, first, second]])
        });
        let results = twin_light_tree(gpu, 1, &table, &floats(&tree));
        for (case, result) in table.iter().zip(&results) {
            let x = case.0.map(f64::from);
            let cone = |i: usize| LightCone {
                axis: v3(&x, i).normalize(),
                spread: x[i + 3],
                reach: x[i + 4],
            };
            let both = cone_union(&cone(0), &cone(5));
            let close = |a: f64, b: f64, bound: f64| assert!((a - b).abs() <= bound, "{a} {b}: {:?}", &case.0[..14]);
            // Where axes are almost opposite, the axis between them is any.
            let angle = cone(0).axis.angle_between(cone(5).axis);
            if angle < 3.0 && both.spread < 3.1 {
                assert!(
                    result.vector(0).distance(both.axis) < 64.0 * absolute,
                    "{:?} {both:?}",
                    result.vector(0)
                );
                close(result.0[3].into(), both.spread, absolute);
            }
            close(result.0[4].into(), both.reach, 0.0);
            let bits = |i: usize| case.0[i].to_bits();
            assert_eq!(result.bits(5), potential_bin(case.0[10]));
            assert_eq!(result.0[6], potential_bin_least(bits(11)));
            let [a, b] = [12, 13].map(|i| &tree.nodes[bits(i) as usize]);
            let around = light_node_union(a, b);
            for axis in 0..3 {
                close(result.0[7 + axis].into(), around.center[axis].into(), 1e-5);
                close(result.0[10 + axis].into(), around.half_extent[axis].into(), 1e-5);
            }
            close(
                result.0[13].into(),
                around.strength.into(),
                4.0 * U * f64::from(around.strength),
            );
            close(result.0[14].into(), around.radius.into(), 1e-4);
            // Wide cones may become all directions by rounding.
            if around.cos_spread > -0.9 {
                close(result.0[15].into(), around.cos_spread.into(), 128.0 * absolute);
            }
        }
    });
}

#[test]
fn cuts_agree_with_their_twins() {
    with_gpu(|gpu| {
        let tree = perfect_tree();
        let table = cases(84, |r| {
            let normal = if r.below(4) == 0 {
                [0.0; 3]
            } else {
                r.direction().to_array()
            };
            let from = (60.0 * r.vector()).to_array();
            let [a, b] = [halves(r.word()), halves(r.word())];
            let size = f32::from_bits(1 + r.below(CUT_MAX as usize) as u32);
            let place = f32::from_bits(r.below(64) as u32);
            let most = r.choose(&[f32::MAX, 1.0, 1e-3]);
            join(&[&from, &normal, &a, &b, &[size, place, most]])
        });
        let results = twin_light_tree(gpu, 2, &table, &floats(&tree));
        let mut others = 0;
        for (case, result) in table.iter().zip(&results) {
            let x = case.0.map(f64::from);
            let receiver = CutReceiver {
                nodes: &tree.nodes,
                from: v3(&x, 0),
                normal: v3(&x, 3),
                geometry_most: x[12],
            };
            let size = case.0[10].to_bits();
            let cut = receiver.light_cut(size);
            assert_eq!((result.bits(0), cut.len()), (size, size as usize));
            let place = result.bits(1) as usize;
            assert_eq!(place, case.0[11].to_bits() as usize % cut.len());
            let (light, probability) = receiver.light_cut_sample(cut[place], word(&x, 6), word(&x, 8));
            // Rounding splits another node, or a word at a rim of a share falls to its other side.
            if result.bits(5) != cut.iter().sum::<u32>() || result.bits(3) != light {
                others += 1;
                continue;
            }
            assert_eq!(result.bits(2), cut[place]);
            let found = f64::from(result.0[4]);
            assert!(
                (found - probability).abs() <= 1e-3 * probability,
                "{found} {probability}"
            );
        }
        assert!(others <= table.len() / 50, "{others} of {}", table.len());
    });
}
