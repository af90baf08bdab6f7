//! Lights that places choose: by cuts through a tree of them, and by their potential.

use super::*;
use clerestory::gpu::shaders::constants::LIGHT_NODE_LEAF;
use clerestory::gpu::shaders::types::SceneLightNode;
use clerestory::gpu::{GpuOptions, Lesser};
use clerestory::techniques::instant_radiosity::Selection;
use clerestory::techniques::instant_radiosity::selection::{LitPoint, SurfaceLight, potential_contribution};
use clerestory::transport::edge_bound::EdgeBound;
use clerestory::transport::light_tree::light_node_union;
use clerestory_hard_cases::scenes::orthographic;
use clerestory_tests::child::{hash_in_child, print_hash};
use clerestory_tests::render::floor;
use clerestory_tests::{assert_no_messages, gpu, gpu_with};
use glam::DVec3;

/// Set in the processes that only print their picture's hash.
const CHILD: &str = "CLERESTORY_TEST_PRINT_HASH";
const CHILD_TEST: &str = "selection::prints_its_hash_when_asked";

fn cuts(cut_size: u32) -> VirtualLightSettings {
    VirtualLightSettings {
        selection: Selection::Cuts,
        cut_size,
        ..settings()
    }
}

fn by_potential(potential_share: f32) -> VirtualLightSettings {
    VirtualLightSettings {
        selection: Selection::Potential,
        potential_share,
        // Nothing but the gather's own light may differ.
        compensation: Compensation::None,
        ..settings()
    }
}

fn picture(gpu: &Gpu, scene: &Scene, settings: &VirtualLightSettings, samples: u32) -> (Vec<f32>, PassCounts) {
    let mut renderer = renderer(gpu, scene, SIZE, settings);
    let [radiance, _] = advance(&mut renderer, samples);
    (radiance, renderer.counts())
}

fn bits(radiance: &[f32]) -> Vec<u32> {
    radiance.iter().map(|value| value.to_bits()).collect()
}

/// A lamp in a room with a block: passes have the same lights whether all are taken or some, so that differences of their means have the mean zero; by Student's t
/// over the passes, and against the path tracer besides.
#[test]
fn cuts_agree_with_all_lights() {
    with_gpu(|gpu| {
        let scene = room();
        let reference = traced(gpu, &scene, 2048);
        let with = |cut_size| VirtualLightSettings {
            walks: 32,
            samples_per_pass: 4,
            ..cuts(cut_size)
        };
        let all = VirtualLightSettings {
            selection: Selection::All,
            ..with(1)
        };
        let all = passes(gpu, &scene, &all, 64);
        for cut_size in [1, 6] {
            let some = passes(gpu, &scene, &with(cut_size), 64);
            some.expect_same_as(&format!("cuts of {cut_size}"), &reference, 0.0);
            for channel in 0..3 {
                let differences = some.means[channel].iter().zip(&all.means[channel]).map(|(a, b)| a - b);
                let differences: Vec<f64> = differences.collect();
                expect_mean_of(&format!("cuts of {cut_size} less all"), &differences, 0.0, 0.0, 0.0);
                assert!(differences.iter().any(|difference| *difference != 0.0));
            }
            assert_eq!(some.counts.lights, all.counts.lights);
            assert!(some.counts.gather.connections <= u64::from(cut_size) * some.counts.gather.gathers);
            assert_eq!(all.counts.gather.nodes, 0);
        }
    });
}

/// Of several candidates one is kept: differences to all lights have the mean zero still, and those of pixels are smaller.
#[test]
fn candidates_have_the_same_mean_and_less_noise() {
    with_gpu(|gpu| {
        let scene = room();
        let with = |candidates| VirtualLightSettings {
            walks: 32,
            samples_per_pass: 4,
            candidates,
            ..cuts(3)
        };
        let all = VirtualLightSettings {
            selection: Selection::All,
            ..with(1)
        };
        let all = passes(gpu, &scene, &all, 32);
        let of = |candidates: u32| {
            let some = passes(gpu, &scene, &with(candidates), 32);
            for channel in 0..3 {
                let differences = some.means[channel].iter().zip(&all.means[channel]).map(|(a, b)| a - b);
                let differences: Vec<f64> = differences.collect();
                expect_mean_of(
                    &format!("{candidates} candidates less all"),
                    &differences,
                    0.0,
                    0.0,
                    0.0,
                );
            }
            let squares = some
                .radiance
                .iter()
                .zip(&all.radiance)
                .map(|(a, b)| f64::from(a - b).powi(2));
            (squares.sum::<f64>(), some.counts.gather)
        };
        let ((one, counts), (six, more_counts)) = (of(1), of(6));
        println!("squares {one} and {six}");
        assert!(six < 0.8 * one, "{six} {one}");
        // As many gathers, six times the connections, and no more shadow rays than nodes.
        assert_eq!(more_counts.gathers, counts.gathers);
        assert_eq!(more_counts.connections, 6 * counts.connections);
        assert!(more_counts.shadow_rays > counts.shadow_rays && more_counts.shadow_rays <= counts.connections);
    });
}

/// A cut of more nodes than there are lights has each light once, with certainty: the sum of all in another order.
#[test]
fn cuts_of_all_lights_are_all_lights() {
    with_gpu(|gpu| {
        let scene = room();
        let all = VirtualLightSettings {
            selection: Selection::All,
            ..cuts(64)
        };
        let ((by_cuts, counts), (whole, all_counts)) =
            (picture(gpu, &scene, &cuts(64), 2), picture(gpu, &scene, &all, 2));
        assert!(counts.lights < 2 * 64 && counts.lights > 16, "{}", counts.lights);
        assert_eq!(counts.gather.connections, all_counts.gather.connections);
        assert_eq!(counts.gather.shadow_rays, all_counts.gather.shadow_rays);
        for (a, b) in by_cuts.iter().zip(&whole) {
            assert!((a - b).abs() <= 1e-4 * b, "{a} instead of {b}");
        }
        // Of one light, without compensation by eye paths, to the bit: the tree is its root.
        let single = |selection| {
            let settings = VirtualLightSettings {
                walks: 1,
                most_bounces: 2,
                selection,
                ..cuts(4)
            };
            picture(gpu, &scene, &settings, 2)
        };
        let ((by_cuts, counts), (whole, _)) = (single(Selection::Cuts), single(Selection::All));
        assert_eq!(
            (counts.lights, counts.gather.nodes / counts.gather.gathers > 0),
            (2, true)
        );
        assert_eq!(bits(&by_cuts), bits(&whole));
    });
}

#[test]
fn cuts_do_not_depend_on_how_work_is_shared_out() {
    with_gpu(|gpu| {
        let scene = room();
        for base in [cuts(12), by_potential(0.7)] {
            let base = VirtualLightSettings {
                walks: 40,
                candidates: 2,
                ..base
            };
            let (whole, counts) = picture(gpu, &scene, &base, 3);
            for (lights_at_once, submission_work) in [(1, 0), (5, 0), (0, 1)] {
                let settings = VirtualLightSettings {
                    lights_at_once,
                    submission_work,
                    ..base.clone()
                };
                let (parted, parted_counts) = picture(gpu, &scene, &settings, 3);
                let what = format!("{:?} {lights_at_once} {submission_work}", base.selection);
                assert_eq!(bits(&parted), bits(&whole), "{what}");
                assert_eq!(parted_counts.gather.shadow_rays, counts.gather.shadow_rays, "{what}");
                assert_eq!(parted_counts.gather.connections, counts.gather.connections, "{what}");
            }
            let again = VirtualLightSettings { seed: 12, ..base };
            assert_ne!(bits(&picture(gpu, &scene, &again, 3).0), bits(&whole));
        }
    });
}

#[test]
fn threads_and_vector_widths_never_show() {
    let hash = |variables: &[(&str, &str)]| hash_in_child(CHILD_TEST, CHILD, variables);
    let truth = hash(&[("LP_NUM_THREADS", "1")]);
    for variables in [
        &[("LP_NUM_THREADS", "2")][..],
        &[("LP_NATIVE_VECTOR_WIDTH", "128")],
        &[("LP_NATIVE_VECTOR_WIDTH", "512")],
    ] {
        assert_eq!(hash(variables), truth, "{variables:?}");
    }
}

#[test]
fn prints_its_hash_when_asked() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    let gpu = gpu();
    let all_lights = VirtualLightSettings {
        selection: Selection::All,
        ..cuts(8)
    };
    let mut all = Vec::new();
    for settings in [cuts(8), by_potential(0.7), all_lights] {
        let settings = VirtualLightSettings { walks: 64, ..settings };
        let (radiance, counts) = picture(&gpu, &room(), &settings, 2);
        let counted = [counts.gather.nodes, counts.gather.shadow_rays];
        let halves = counted.iter().flat_map(|count| [*count as u32, (*count >> 32) as u32]);
        all.extend(bits(&radiance).into_iter().chain(halves));
    }
    print_hash(all);
    clerestory_tests::assert_no_messages(&gpu);
}

/// Leaves are the lights, as they were left, in an order in which neighbours lie near each other; every other node is around its children, as its twin has it.
#[test]
fn trees_hold_every_light_once_and_nodes_what_is_below() {
    with_gpu(|gpu| {
        for walks in [1, 3, 200] {
            let settings = VirtualLightSettings { walks, ..cuts(4) };
            let mut renderer = renderer(gpu, &room(), SIZE, &settings);
            let lights = renderer.lights(5).expect("lights");
            let nodes = renderer.light_tree(5).expect("tree");
            let n = lights.len();
            let first = n.next_power_of_two() - 1;
            assert_eq!(nodes.len(), first + n);
            let number = |leaf: &SceneLightNode| (leaf.child & !LIGHT_NODE_LEAF) as usize;
            let mut found: Vec<usize> = nodes[first..].iter().map(number).collect();
            let way = |order: &[usize]| -> f32 {
                let pairs = order
                    .windows(2)
                    .map(|pair| lights[pair[0]].position.distance(lights[pair[1]].position));
                pairs.sum()
            };
            // A curve's neighbours are near: far less way than from light to light as walks left them.
            assert!(n < 50 || way(&found) < 0.4 * way(&(0..n).collect::<Vec<_>>()), "{n}");
            found.sort_unstable();
            assert_eq!(found, (0..n).collect::<Vec<_>>());
            // The room's surfaces scatter by Lambert's law.
            for leaf in &nodes[first..] {
                let light = &lights[number(leaf)];
                assert_eq!(
                    (leaf.center, leaf.axis),
                    (light.position.to_array(), light.normal.to_array())
                );
                assert_eq!(
                    (leaf.half_extent, leaf.cos_spread, leaf.cos_reach),
                    ([0.0; 3], 1.0, 0.0)
                );
                assert!(leaf.child & LIGHT_NODE_LEAF != 0 && leaf.strength > 0.0);
            }
            for (i, node) in nodes[..first].iter().enumerate() {
                let child = 2 * i + 1;
                let Some(left) = nodes.get(child) else {
                    continue;
                };
                // Levels end early: nodes behind their end are not written.
                let level = (i + 1).ilog2();
                let of_level = n.div_ceil(1 << (n.next_power_of_two().ilog2() - level));
                if i + 1 - (1 << level) >= of_level {
                    continue;
                }
                assert_eq!(node.child as usize, child);
                let around = match node.share {
                    0.0 => light_node_union(left, &nodes[child + 1]),
                    share => {
                        assert_eq!(share, 1.0);
                        *left
                    }
                };
                let near =
                    |a: f32, b: f32| assert!((a - b).abs() <= 1e-3 * b.abs().max(1.0), "{i}: {node:?} {around:?}");
                near(node.strength, around.strength);
                near(node.radius, around.radius);
                // Where one cone just holds the other, rounding may make theirs wider, never less.
                assert!(node.cos_spread <= around.cos_spread + 1e-3, "{i}: {node:?} {around:?}");
                for axis in 0..3 {
                    near(node.center[axis], around.center[axis]);
                    near(node.half_extent[axis], around.half_extent[axis]);
                }
            }
            let all: f64 = nodes[first..].iter().map(|leaf| f64::from(leaf.strength)).sum();
            assert!((f64::from(nodes[0].strength) / all - 1.0).abs() < 1e-4);
        }
    });
}

/// Rays of a place are those of its cut whatever the number of lights, and nodes grow with the depth of the tree alone.
#[test]
fn work_of_cuts_hardly_grows_with_the_lights() {
    with_gpu(|gpu| {
        let scene = room();
        let of = |walks| {
            let settings = VirtualLightSettings { walks, ..cuts(8) };
            let (_, counts) = picture(gpu, &scene, &settings, 1);
            let each = |count: u64| count as f64 / counts.gather.gathers as f64;
            (
                counts.lights,
                each(counts.gather.connections),
                each(counts.gather.nodes),
            )
        };
        let ((few, few_rays, few_nodes), (many, many_rays, many_nodes)) = (of(32), of(4096));
        assert!(many > 100 * few, "{few} {many}");
        assert_eq!((few_rays, many_rays), (8.0, 8.0));
        // Two nodes a level for each of eight choices, and seven levels more.
        let levels = (many as f64).log2().ceil() - (few as f64).log2().ceil();
        assert!(
            many_nodes > few_nodes && many_nodes <= few_nodes + 16.0 * levels + 16.0,
            "{few_nodes} {many_nodes}"
        );
        assert!(many_nodes < 0.05 * many as f64, "{many_nodes} of {many}");
    });
}

/// In an empty box nothing is hidden: what the lights taken bring stands for all, to rounding; all of the potential is all lights, to the bit.
#[test]
fn a_share_of_the_potential_is_exact_where_nothing_is_hidden() {
    with_gpu(|gpu| {
        let mut scene = builtin("builtin:furnace-box?rho=0.5&emission=0");
        add_point(&mut scene, Vec3::new(0.3, -0.2, 0.1), Vec3::ONE);
        let base = VirtualLightSettings {
            walks: 60,
            ..by_potential(1.0)
        };
        let all = VirtualLightSettings {
            selection: Selection::All,
            ..base.clone()
        };
        let ((whole, all_counts), (same, same_counts)) =
            (picture(gpu, &scene, &all, 2), picture(gpu, &scene, &base, 2));
        assert_eq!(bits(&same), bits(&whole));
        assert_eq!(same_counts, all_counts);
        for share in [0.9, 0.5] {
            let of = |rescales| {
                let settings = VirtualLightSettings {
                    potential_share: share,
                    rescales,
                    ..base.clone()
                };
                picture(gpu, &scene, &settings, 2)
            };
            let ((rescaled, counts), (plain, _)) = (of(true), of(false));
            assert_ne!(bits(&plain), bits(&rescaled));
            for ((rescaled, plain), whole) in rescaled.iter().zip(&plain).zip(&whole) {
                assert!(
                    (rescaled - whole).abs() <= 1e-4 * whole,
                    "{rescaled} instead of {whole}"
                );
                assert!(*plain <= whole * 1.0001);
            }
            let rays = counts.gather.shadow_rays as f64 / all_counts.gather.shadow_rays as f64;
            assert!(rays > 0.1 && rays < f64::from(share), "{share}: {rays}");
        }
    });
}

/// A single light between a floor and a ceiling, and a spot of the floor so small that all of the picture is one place: what the device finds is what the host does.
#[test]
fn potentials_are_their_twins() {
    with_gpu(|gpu| {
        let (ground, above) = (Vec3::new(0.7, 0.5, 0.3), Vec3::new(0.9, 0.6, 0.4));
        let mut scene = Scene {
            name: "gap".into(),
            ..Scene::default()
        };
        for (name, reflectance, height) in [("floor", ground, 0.0), ("ceiling", above, 2.0)] {
            let matte = scene.add_material(Material::lambert(name, reflectance));
            scene.place(floor(name, matte, 3.0, height));
        }
        let eye = DVec3::Y;
        scene.cameras.push(orthographic(eye, DVec3::ZERO, -DVec3::Z, 1e-6));
        add_point(&mut scene, Vec3::Y * 0.25, Vec3::new(3.0, 2.0, 1.0));
        let point = LitPoint {
            position: DVec3::ZERO,
            normal: DVec3::Y,
            reflectance: ground.as_dvec3(),
        };
        for (kind, value, bound) in [
            (Bound::None, 0.0, EdgeBound::Unbounded),
            (Bound::Geometry, 0.1, EdgeBound::Geometry(0.1)),
            (Bound::Distance, 6.0, EdgeBound::Distance(6.0)),
        ] {
            let settings = VirtualLightSettings {
                walks: 1,
                bound: kind,
                bound_value: value,
                least_bounces: 2,
                most_bounces: 2,
                ..by_potential(1.0)
            };
            let mut renderer = renderer(gpu, &scene, [1, 1], &settings);
            let (mut lit, mut bounded) = (0, 0);
            for seed in 0..48 {
                renderer.restart(seed).expect("a seed");
                let [found, _] = advance(&mut renderer, 1);
                let lights = renderer.lights(0).expect("lights");
                let sum = |bound| -> DVec3 {
                    let of_light = lights.iter().map(|light| {
                        let reflectance = if light.position.y > 1.0 { above } else { ground };
                        let light = SurfaceLight {
                            position: light.position.into(),
                            normal: light.normal.into(),
                            power: (light.power * reflectance).into(),
                            bounce: light.bounce,
                        };
                        potential_contribution(&light, &point, bound)
                    });
                    of_light.sum()
                };
                let expected = sum(bound);
                for (value, expected) in found.iter().zip(expected.to_array()) {
                    let error = (f64::from(*value) - expected).abs();
                    assert!(
                        error <= 1e-5 * expected,
                        "{kind:?}, seed {seed}: {value} instead of {expected}"
                    );
                }
                lit += u32::from(expected != DVec3::ZERO);
                bounded += u32::from(expected != sum(EdgeBound::Unbounded));
            }
            println!("{kind:?}: {lit} of 48 lit, {bounded} bounded");
            assert!(
                lit > 10 && (bounded > 3) == (kind != Bound::None),
                "{kind:?}: {lit} {bounded}"
            );
        }
    });
}

/// Weak lights are many: a share of the potential takes fewer rays, and less so the smaller it is, with small errors where rescaled and large ones where not.
#[test]
fn a_share_of_the_potential_saves_rays_for_little_error() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:unit-box");
        let of = |settings: &VirtualLightSettings| {
            let settings = VirtualLightSettings {
                walks: 32,
                bound: Bound::Distance,
                bound_value: 0.01,
                ..settings.clone()
            };
            picture(gpu, &scene, &settings, 2)
        };
        let all = VirtualLightSettings {
            selection: Selection::All,
            ..by_potential(1.0)
        };
        // What virtual lights bring alone: no direct light.
        let only = |settings: VirtualLightSettings| VirtualLightSettings {
            least_bounces: 2,
            ..settings
        };
        let (whole, all_counts) = of(&only(all));
        let mut before = (0.0, 1.0);
        for share in [0.9, 0.8] {
            let (found, counts) = of(&only(by_potential(share)));
            let (plain, _) = of(&only(VirtualLightSettings {
                rescales: false,
                ..by_potential(share)
            }));
            let error = |picture: &[f32]| {
                let each = picture.iter().zip(&whole).filter(|(_, whole)| **whole > 0.0);
                each.clone().map(|(a, b)| f64::from((a / b - 1.0).abs())).sum::<f64>() / each.count() as f64
            };
            let rays = counts.gather.shadow_rays as f64 / all_counts.gather.shadow_rays as f64;
            let (error, plain) = (error(&found), error(&plain));
            println!("{share}: rays {rays}, error {error}, without rescaling {plain}");
            assert!(error > before.0 && rays < before.1, "{share}: {error} {rays}");
            assert!(error < 0.5 * plain, "{share}: {error} {plain}");
            before = (error, rays);
        }
        assert!(before.0 < 0.06 && before.1 < 0.7, "{before:?}");
    });
}

#[test]
fn selections_out_of_range_are_refused_by_name() {
    with_gpu(|gpu| {
        let refused = |settings: VirtualLightSettings| {
            let scene = room();
            let made = VirtualLights::new(gpu, upload(gpu, &scene), &scene.cameras[0], SIZE, settings);
            made.err().map(|error| error.to_string()).unwrap_or_default()
        };
        assert!(refused(cuts(0)).contains("cut_size"));
        assert!(refused(cuts(65)).contains("cut_size"));
        assert!(refused(by_potential(1.5)).contains("potential_share"));
        assert!(refused(by_potential(f32::NAN)).contains("potential_share"));
        // More lights than loops may find the potential of.
        let many = VirtualLightSettings {
            walks: 1 << 15,
            ..by_potential(0.9)
        };
        let mut renderer = renderer(gpu, &room(), [2, 2], &many);
        let error = loop {
            match renderer.step(1) {
                Ok(Some(_)) => {}
                Ok(None) => panic!("must be refused"),
                Err(error) => break error,
            }
        };
        assert!(
            matches!(error, Error::Overflow { .. }) && error.to_string().contains("walks"),
            "{error}"
        );
    });
}

/// A tree whose nodes do not fit in a storage buffer is refused with its size.
#[test]
fn trees_beyond_a_buffer_are_refused_with_their_size() {
    // Of walks whose lights fit, and whose tree, of up to three nodes a light, does not.
    const RANGE: u64 = 1 << 20;
    let gpu = gpu_with(&GpuOptions {
        lesser: Lesser {
            max_storage_buffer_range: Some(RANGE),
            ..Lesser::default()
        },
        ..GpuOptions::default()
    });
    let many = VirtualLightSettings {
        walks: 10_000,
        most_bounces: 2,
        ..cuts(4)
    };
    let mut renderer = renderer(&gpu, &room(), [1, 1], &many);
    let (text, kernel, needed, capacity) = overflow_of(&mut renderer);
    assert_eq!((kernel.as_str(), capacity), ("cut_level", RANGE / 64));
    assert!(needed > capacity && text.contains("walks"), "{text}");
    assert_no_messages(&gpu);
}
