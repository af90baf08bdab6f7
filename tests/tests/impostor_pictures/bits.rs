//! Bits of pictures over threads of the driver and lengths of its vectors.

use super::refractions::panes;
use super::*;
use clerestory_tests::child::{hash_in_child, print_hash};
use clerestory_tests::render::cuboid;

/// Set in the processes that only print their pictures' hash.
const CHILD: &str = "CLERESTORY_TEST_PRINT_IMPOSTOR_HASH";
const CHILD_TEST: &str = "bits::prints_its_hash_when_asked";
/// The same of maps by rays.
const CHILD_BY_RAYS: &str = "CLERESTORY_TEST_PRINT_HASH_OF_MAPS_BY_RAYS";
const CHILD_TEST_BY_RAYS: &str = "bits::prints_its_hash_of_maps_by_rays_when_asked";

/// On one thread of the driver and on two, and on vectors of 4, 8 and 16 lanes.
#[test]
fn bits_are_the_same_whoever_does_the_work() {
    let hash = |threads, width| {
        let variables = [("LP_NUM_THREADS", threads), ("LP_NATIVE_VECTOR_WIDTH", width)];
        hash_in_child(CHILD_TEST, CHILD, &variables)
    };
    let truth = hash("1", "256");
    assert_eq!(hash("2", "128"), truth);
    assert_eq!(hash("2", "512"), truth);
}

#[test]
fn prints_its_hash_when_asked() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    with_gpu(|gpu| {
        let mut scene = room_with(mirror(), B, 0.3, EYE, 1.5, 1.0);
        lamp(&mut scene, 1.0);
        let renderer = renderer(gpu, &scene);
        let mut words = Vec::new();
        for (technique, settings) in [
            ("impostor", json!({"side": 64})),
            ("localized-gather", json!({"side": 64, "lights": 16})),
        ] {
            let found = rendered(&renderer, technique, 16, 2, settings);
            words.extend(layer(&found, "radiance").iter().map(|value| value.to_bits()));
        }
        print_hash(words);
    });
}

/// Maps by rays: of three layers, for a pane that mirrors and refracts, and for a metal of few terms.
#[test]
fn bits_of_maps_by_rays_are_the_same_whoever_does_the_work() {
    let hash = |threads, width| {
        let variables = [("LP_NUM_THREADS", threads), ("LP_NATIVE_VECTOR_WIDTH", width)];
        hash_in_child(CHILD_TEST_BY_RAYS, CHILD_BY_RAYS, &variables)
    };
    assert_eq!(hash("2", "128"), hash("1", "256"));
}

#[test]
fn prints_its_hash_of_maps_by_rays_when_asked() {
    if std::env::var_os(CHILD_BY_RAYS).is_none() {
        return;
    }
    with_gpu(|gpu| {
        // A pillar behind the pane, and the wall behind that.
        let mut glass = panes(&[0.4]);
        let stone = glass.add_material(Material::lambert("stone", Vec3::splat(0.6)));
        let [low, high] = [Vec3::new(0.6, -0.5, -0.2), Vec3::new(0.8, 0.5, 0.2)];
        glass.place(cuboid("pillar", stone, low, high));
        let metal = Material {
            roughness: 0.5,
            ..mirror()
        };
        let mut metal = room_with(metal, B, 0.3, EYE, 1.5, 1.0);
        lamp(&mut metal, 1.0);
        let by_layers =
            json!({"capture": "rays", "side": 64, "layers": 3, "method": "march", "steps": 16, "refracts": true});
        let by_terms = json!({"capture": "rays", "side": 64, "lights": 8, "terms": "five"});
        let mut words = Vec::new();
        for (technique, scene, settings, counters) in [
            ("impostor", &glass, by_layers, ["reflections", "refractions"]),
            ("localized-gather", &metal, by_terms, ["gathers", "map_paths"]),
        ] {
            let found = rendered(&renderer(gpu, scene), technique, 16, 2, settings);
            for name in counters {
                assert!(found.report.counters[name] > 0, "{technique}: {name}");
            }
            words.extend(layer(&found, "radiance").iter().map(|value| value.to_bits()));
        }
        print_hash(words);
    });
}
