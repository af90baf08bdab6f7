//! The tree of lights: importances, shares, choices by one word and their probabilities by the way to a light.

use clerestory::gpu::shaders::constants::{LIGHT_NODE_LEAF, LIGHT_TRAIL_NONE};
use clerestory::transport::light_tree::{
    FixedLight, LightBounds, LightCone, LightTree, NearLight, build_light_tree, light_node_importance,
    light_node_share, light_tree_probability, light_tree_sample,
};
use clerestory::transport::random::unit_float;
use clerestory_tests::random::Random;
use clerestory_tests::twin::{U, compare};
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
