//! Trees of random lights, at random points.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec3, UVec4};

use super::*;
use crate::test_random::Random;
use crate::transport::lights::spot_falloff;
use crate::transport::random::pcg4d;
use crate::transport::testing::chi_square_test;

/// What a light is, for what it sends to a point.
#[derive(Clone, Copy)]
enum Kind {
    Panel,
    Point,
    Spot { inner: f64, outer: f64 },
}

struct Lamp {
    near: NearLight,
    kind: Kind,
}

impl Lamp {
    /// Light that it sends to a point, but for shadows: what a receiver's cosine and the square of the distance leave of its intensity.
    fn sent(&self, from: DVec3, normal: DVec3) -> f64 {
        let b = &self.near.bounds;
        let to = 0.5 * (b.lower + b.upper) - from;
        let w = to.normalize();
        let cos = -b.cone.axis.dot(w);
        let emitted = match self.kind {
            Kind::Panel => cos.max(0.0),
            Kind::Point => 1.0,
            Kind::Spot { inner, outer } => spot_falloff(cos, inner.cos(), outer.cos()),
        };
        let received = if normal == DVec3::ZERO {
            1.0
        } else {
            normal.dot(w).max(0.0)
        };
        b.strength * emitted * received / to.length_squared()
    }
}

fn lamps(random: &mut Random, count: u32) -> Vec<Lamp> {
    (0..count)
        .map(|light| {
            let place = 20.0 * random.vector().as_dvec3();
            let axis = random.direction().as_dvec3();
            let (kind, cone) = match random.below(3) {
                0 => (Kind::Panel, LightCone::of_front(axis)),
                1 => (Kind::Point, LightCone::ALL),
                _ => {
                    let inner = f64::from(random.range(0.0, 1.0));
                    let outer = inner + f64::from(random.range(1e-3, 0.5));
                    let (spread, reach) = (inner, outer - inner);
                    (Kind::Spot { inner, outer }, LightCone { axis, spread, reach })
                }
            };
            let bounds = LightBounds {
                lower: place,
                upper: place,
                cone,
                strength: random.magnitude(-10, 10).into(),
            };
            Lamp {
                near: NearLight { light, bounds },
                kind,
            }
        })
        .collect()
}

fn tree_of(lamps: &[Lamp], fixed: &[FixedLight]) -> LightTree {
    let near: Vec<NearLight> = lamps.iter().map(|lamp| lamp.near).collect();
    build_light_tree(&near, 3.0, fixed, lamps.len() + fixed.len())
}

/// Two distant lights behind `first`, and one that is never chosen.
fn distant(first: u32) -> [FixedLight; 3] {
    [0.5, 1.0, 0.0].map(|weight| FixedLight {
        light: first + u32::from(weight > 0.5) + 2 * u32::from(weight == 0.0),
        weight,
    })
}

fn receiver(random: &mut Random) -> (DVec3, DVec3) {
    let normal = if random.below(4) == 0 {
        DVec3::ZERO
    } else {
        random.direction().as_dvec3()
    };
    (25.0 * random.vector().as_dvec3(), normal)
}

#[test]
fn importance_bounds_cosines_and_none_is_lost() {
    let mut random = Random(71);
    let lamps = lamps(&mut random, 200);
    let tree = tree_of(&lamps, &[]);
    let strongest = lamps.iter().map(|lamp| lamp.near.bounds.strength).fold(0.0, f64::max);
    // Lights below each node.
    let below = |node: u32| {
        let (mut lights, mut open) = (Vec::new(), vec![node]);
        while let Some(node) = open.pop() {
            let child = tree.nodes[node as usize].child;
            if child & LIGHT_NODE_LEAF == 0 {
                open.extend([child, child + 1]);
            } else {
                lights.push((child & !LIGHT_NODE_LEAF) as usize);
            }
        }
        lights
    };
    let mut lit = 0;
    for _ in 0..200 {
        let (from, normal) = receiver(&mut random);
        for (i, node) in tree.nodes.iter().enumerate() {
            let importance = light_node_importance(node, from, normal);
            assert!(importance > 0.0 && importance.is_finite());
            // Were all lights as far as the distance that importance takes, none of them could send more.
            let to = DVec3::from_array(node.center.map(f64::from)) - from;
            let half = DVec3::from_array(node.half_extent.map(f64::from));
            let radius = f64::from(node.radius);
            let least = (to.abs() - half).max(DVec3::ZERO).length();
            let squared = (least * to.length().max(radius)).max(f64::from(LIGHT_NEAREST_SHARE) * radius * radius);
            let lights = below(i as u32);
            let sent: f64 = lights
                .iter()
                .map(|&light| {
                    let lamp = &lamps[light];
                    let place = 0.5 * (lamp.near.bounds.lower + lamp.near.bounds.upper);
                    lamp.sent(from, normal) / strongest * place.distance_squared(from)
                })
                .sum();
            lit += usize::from(sent > 0.0);
            // Where a spot's light fades faster than a cosine does, its cone still reaches as far; sines lose half of the digits.
            let slack = 1e-3 * f64::from(node.strength);
            assert!(
                importance * squared >= sent * (1.0 - 1e-6) - slack,
                "{i}: {} below {sent}",
                importance * squared
            );
            if lights.len() == 1 && sent > 0.0 {
                assert!(importance * squared > 1e-3 * sent, "{i}: {importance} for {sent}");
            }
        }
    }
    assert!(lit > 1000);
}

#[test]
fn probabilities_sum_to_one_and_are_those_of_descents() {
    let mut random = Random(72);
    for (count, far) in [(1, false), (2, false), (1, true), (17, true), (300, true), (300, false)] {
        let lamps = lamps(&mut random, count);
        let distant = distant(count);
        let fixed = if far { &distant[..] } else { &[] };
        let tree = tree_of(&lamps, fixed);
        for i in 0..100 {
            let (from, normal) = receiver(&mut random);
            let each = |light| light_tree_probability(&tree, light, from, normal);
            let total: f64 = (0..tree.trails.len() as u32).map(each).sum();
            assert!((total - 1.0).abs() < 1e-12, "{count}: {total}");
            assert!((0..count).all(|light| each(light) > 0.0));
            if far {
                let shares = [count, count + 1, count + 2].map(each);
                assert!(
                    (shares[0] - 0.5 / 4.5).abs() < 1e-6 && (shares[1] - 1.0 / 4.5).abs() < 1e-6,
                    "{shares:?}"
                );
                assert_eq!(shares[2], 0.0);
            }
            let mut word = random.word();
            let (light, probability) = light_tree_sample(&tree.nodes, from, normal, &mut word, i);
            assert_eq!(probability, each(light));
        }
    }
}

/// Chi-square of 100,000 words over all lights, and over 16 places in the share of the likeliest; false alarm 1e-5.
#[test]
fn lights_are_chosen_as_often_as_their_probability_says() {
    let mut random = Random(73);
    let lamps = lamps(&mut random, 100);
    let tree = tree_of(&lamps, &distant(100));
    let draws = 100_000;
    for seed in 0..4 {
        let (from, normal) = receiver(&mut random);
        let probabilities: Vec<f64> = (0..102)
            .map(|i| light_tree_probability(&tree, i, from, normal))
            .collect();
        let likeliest = (0..102).fold(0, |a, b| if probabilities[b] > probabilities[a] { b } else { a });
        let (mut observed, mut places, mut of_likeliest) = (vec![0.0; 102], vec![0.0; 16], 0.0);
        for i in 0..draws {
            let [mut word, fresh, ..] = pcg4d(UVec4::new(i, seed, 0x11, 0)).to_array();
            let (light, _) = light_tree_sample(&tree.nodes, from, normal, &mut word, fresh);
            observed[light as usize] += 1.0;
            if light as usize == likeliest {
                places[(word >> 28) as usize] += 1.0;
                of_likeliest += 1.0;
            }
        }
        let expected: Vec<f64> = probabilities.iter().map(|p| p * f64::from(draws)).collect();
        assert!(chi_square_test(&observed, &expected) > 1e-5);
        assert!(chi_square_test(&places, &[of_likeliest / 16.0; 16]) > 1e-5);
        let mut wrong = expected.clone();
        wrong.rotate_left(1);
        assert!(
            chi_square_test(&observed, &wrong) < 1e-5,
            "the test must be able to fail"
        );
    }
}

#[test]
fn cones_of_unions_hold_both() {
    let mut random = Random(74);
    for i in 0..2000 {
        let cone = |random: &mut Random| LightCone {
            axis: random.direction().as_dvec3().normalize(),
            spread: f64::from(random.choose(&[0.0f32, 1e-3, 0.5, 1.5, 3.0, std::f32::consts::PI])),
            reach: FRAC_PI_2 * f64::from(random.unit()),
        };
        let (a, mut b) = (cone(&mut random), cone(&mut random));
        match i % 4 {
            0 => b.axis = a.axis,
            1 => b.axis = -a.axis,
            2 => b.axis = (a.axis + 1e-5 * b.axis).normalize(),
            _ => {}
        }
        let both = cone_union(&a, &b);
        for c in [a, b] {
            assert!(both.reach >= c.reach);
            let needed = (both.axis.dot(c.axis).clamp(-1.0, 1.0).acos() + c.spread).min(PI);
            assert!(both.spread >= needed - 1e-6, "{a:?} {b:?}: {both:?}");
        }
        assert!((both.axis.length() - 1.0).abs() < 1e-6);
        assert!(
            both.spread <= 0.5 * (a.spread + b.spread + PI)
                || both.spread == PI
                || both.spread == a.spread.max(b.spread)
        );
    }
    // Along one direction, over a hemisphere, and everywhere.
    let of = |spread: f64, reach: f64| {
        cone_measure(&LightCone {
            axis: DVec3::Z,
            spread,
            reach,
        })
    };
    assert!((of(0.0, FRAC_PI_2) - PI).abs() < 1e-12);
    assert!((of(PI, FRAC_PI_2) - 4.0 * PI).abs() < 1e-12);
    assert!(of(0.0, 0.1) < of(0.0, 0.2) && of(0.0, 0.1) < of(0.1, 0.1));
}

#[test]
fn equal_lights_in_rows_and_in_one_place_make_shallow_trees() {
    for step in [0.0, 1.0] {
        let near: Vec<NearLight> = (0..5000u32)
            .map(|light| {
                let place = DVec3::X * step * f64::from(light);
                let bounds = LightBounds {
                    lower: place,
                    upper: place,
                    cone: LightCone::ALL,
                    strength: 1.0,
                };
                NearLight { light, bounds }
            })
            .collect();
        let tree = build_light_tree(&near, 1.0, &[], 5000);
        assert_eq!(tree, build_light_tree(&near, 1.0, &[], 5000));
        assert_eq!((tree.nodes.len(), tree.nodes[0].node_count), (9999, 9999));
        let deepest = tree.trails.iter().map(|trail| 32 - trail.leading_zeros()).max();
        assert!(deepest <= Some(20), "{deepest:?}");
    }
    // Places that grow by factors, each of which would be split off alone.
    let growing: Vec<NearLight> = (0..200u32)
        .map(|light| {
            let place = DVec3::X * 20f64.powi(light as i32 / 2 - 50);
            let bounds = LightBounds {
                lower: place,
                upper: place,
                cone: LightCone::ALL,
                strength: f64::from(light),
            };
            NearLight { light, bounds }
        })
        .collect();
    let tree = build_light_tree(&growing, 1.0, &[], 200);
    assert!(tree.trails.iter().all(|trail| *trail < 1 << DEPTH_MAX));
}
