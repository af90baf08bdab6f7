//! Queues of queries: whichever places their invocations are for, each place's sum is the same bits, and so are the counts.

use super::settings::room;
use super::*;
use clerestory::gpu::{GpuOptions, Lesser, OptionalFeatures};
use clerestory::techniques::photon_mapping::{GatherCounts, MapQueue};
use clerestory_tests::child::{hash_in_child, print_hash};
use clerestory_tests::render::{builtin, point_triangle};
use clerestory_tests::{gpu, gpu_with, with_gpu};

/// Set in the processes that only print their pictures' hash.
const CHILD: &str = "CLERESTORY_TEST_PRINT_QUEUE_HASH";
const CHILD_TEST: &str = "queues::prints_its_hash_when_asked";

/// Queues and queries, the plainest first.
pub(super) const FORMS: [(MapQueue, MapQuery); 6] = [
    (MapQueue::Slots, MapQuery::Single),
    (MapQueue::Compacted, MapQuery::Single),
    (MapQueue::Blocks, MapQuery::Single),
    (MapQueue::Slots, MapQuery::Packet),
    (MapQueue::Compacted, MapQuery::Packet),
    (MapQueue::Blocks, MapQuery::Packet),
];

/// What one form makes of a scene.
#[derive(Debug, Clone, PartialEq)]
struct Made {
    bits: Vec<u32>,
    gather: GatherCounts,
    stalls: u64,
}

/// Samples per pixel of a pass, so that a wave has as many places as two workgroups of the queue in blocks walk.
const SAMPLES: u32 = 16;

/// By one pass.
fn made(gpu: &Gpu, scene: &Scene, settings: &PhotonSettings, form: (MapQueue, MapQuery)) -> Made {
    made_by(gpu, scene, settings, form, 1)
}

fn made_by(
    gpu: &Gpu,
    scene: &Scene,
    settings: &PhotonSettings,
    (queue, query): (MapQueue, MapQuery),
    passes: u32,
) -> Made {
    let settings = PhotonSettings {
        queue,
        query,
        samples_per_pass: SAMPLES,
        ..settings.clone()
    };
    let mut mapper = mapper(gpu, scene, &settings);
    Made {
        bits: bits(&advance(&mut mapper, passes * SAMPLES)),
        gather: mapper.counts().gather,
        stalls: mapper.eye_counters().stalls,
    }
}

/// Fails unless all forms make the same of a scene.
fn expect_alike(gpu: &Gpu, scene: &Scene, settings: &PhotonSettings) -> Made {
    let first = made(gpu, scene, settings, FORMS[0]);
    for form in &FORMS[1..] {
        let other = made(gpu, scene, settings, *form);
        assert!(first.bits == other.bits, "{}: {form:?}: another picture", scene.name);
        assert_eq!(first.gather, other.gather, "{}: {form:?}", scene.name);
    }
    first
}

/// Kernels that differ, in a closed room.
fn queued() -> PhotonSettings {
    PhotonSettings {
        shape: KernelShape::Principal,
        photons: 1 << 11,
        ..settings("all")
    }
}

/// All light from the map, for what [`seen_little`] has of it.
fn direct() -> PhotonSettings {
    PhotonSettings {
        direct_photons: true,
        photons: 1 << 14,
        ..fixed("all", 0.3)
    }
}

/// Mirrors under the open sky, with a tile between them: few places ask, and not all of a subgroup.
fn seen_little() -> Scene {
    let mirror = |name| Material::mirror(name, Vec3::splat(0.9));
    let mut scene = floor_and_wall("seen little", mirror("floor"), mirror("wall"));
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.7)));
    scene.place(ceiling("tile", grey, Vec3::new(0.35, 0.2, -0.15), 0.17, false));
    add_point(&mut scene, Vec3::new(0.3, 1.5, 0.2), Vec3::splat(20.0));
    scene
}

/// Paths that could ask at each of their places.
const PLACES: u64 = SAMPLES as u64 * (SIDE * SIDE) as u64;

#[test]
fn every_queue_gives_the_same_picture() {
    with_gpu(|gpu| {
        let whole = expect_alike(gpu, &room(), &queued());
        assert_eq!(whole.gather.queries, PLACES, "every camera ray asks, and none after it");
        assert!(whole.gather.photons > PLACES && whole.stalls == 0);
        let little = expect_alike(gpu, &seen_little(), &direct());
        assert!(
            little.gather.queries > 0 && little.gather.queries < PLACES / 4,
            "{little:?}"
        );
        assert!(little.gather.photons > 0);
        // Behind glass and after it, by a path set that counts bounces; and by nearest neighbours.
        let glass = builtin("builtin:cornell-box?sphere=glass&source=point");
        let settings = PhotonSettings {
            path_set: "bounces=2..4".parse().unwrap(),
            ..queued()
        };
        expect_alike(gpu, &glass, &settings);
        let settings = PhotonSettings {
            neighbors: 20,
            ..direct()
        };
        expect_alike(gpu, &seen_little(), &settings);
        expect_alike(gpu, &builtin("builtin:ring"), &queued());
    });
}

// Behind the end of a list that is not full are places of the pass before. One that asks in this pass, too, would be asked for twice by one subgroup if
// the list had grown shorter by a place or two: seldom, so passes are many.
#[test]
fn nothing_is_asked_behind_the_end_of_a_queue() {
    const PASSES: u32 = 33;
    with_gpu(|gpu| {
        let settings = PhotonSettings {
            photons: 1 << 6,
            ..direct()
        };
        let by = |form| made_by(gpu, &seen_little(), &settings, form, PASSES);
        let slots = by(FORMS[0]);
        assert!(slots.gather.queries > 0 && slots.gather.queries < u64::from(PASSES) * PLACES);
        for form in &FORMS[1..3] {
            assert!(by(*form) == slots, "{form:?}");
        }
    });
}

#[test]
fn queues_take_queries_that_a_quota_stops() {
    with_gpu(|gpu| {
        let with = |settings: &PhotonSettings, query_quota| PhotonSettings {
            query_quota,
            ..settings.clone()
        };
        for (scene, settings) in [(room(), queued()), (seen_little(), direct())] {
            let scene = &scene;
            // All of those that are in the map stop at once, alone or together: the same sums. With few photons, a dispatch each.
            let few = PhotonSettings {
                photons: settings.photons / 16,
                ..settings.clone()
            };
            let whole = made(gpu, scene, &few, FORMS[0]);
            let all = expect_alike(gpu, scene, &with(&few, 1));
            assert!(all.stalls > 0 && all.gather == whole.gather, "{all:?}");
            let whole = made(gpu, scene, &settings, FORMS[0]);
            // Some stop: the same ones by themselves; together, those of subgroups, whose members are the queue's choice.
            let settings = with(&settings, 64);
            let singles = FORMS[..3].iter().map(|form| made(gpu, scene, &settings, *form));
            let singles: Vec<Made> = singles.collect();
            assert!(
                singles[0].stalls > 0 && singles[0].gather == whole.gather,
                "{}",
                scene.name
            );
            assert!(singles.iter().all(|single| *single == singles[0]), "{}", scene.name);
            for form in &FORMS[3..] {
                let packet = made(gpu, scene, &settings, *form);
                assert_eq!(packet.gather, singles[0].gather, "{form:?}");
                // Sums of up to a few thousand kernels in another order.
                for (a, b) in singles[0].bits.iter().zip(&packet.bits) {
                    let (a, b) = (f32::from_bits(*a), f32::from_bits(*b));
                    assert!((a - b).abs() <= 1e-5 * a, "{form:?}: {b}, not {a}");
                }
                assert!(packet == made(gpu, scene, &settings, *form), "{form:?}: two runs");
            }
        }
    });
}

/// A device without any of them: what is in blocks is told by shared memory alone.
#[test]
fn blocks_need_no_subgroup_operations() {
    let plain = gpu_with(&GpuOptions {
        lesser: Lesser {
            features: Some(OptionalFeatures::NONE),
            ..Lesser::default()
        },
        ..GpuOptions::default()
    });
    assert!(!plain.caps().full_subgroups);
    let of = |queue| made(&plain, &seen_little(), &direct(), (queue, MapQuery::Single));
    let slots = of(MapQueue::Slots);
    assert!(slots.gather.queries > 0);
    assert!(slots == of(MapQueue::Blocks));
    clerestory_tests::assert_no_messages(&plain);
}

#[test]
fn queues_may_stay_empty() {
    with_gpu(|gpu| {
        // Photons that land nowhere.
        let mut mirrors = seen_little();
        mirrors.name = "mirrors".into();
        mirrors.meshes.pop();
        mirrors.instances.pop();
        // Without a material that may be diffuse there would be no map.
        point_triangle(&mut mirrors, Material::lambert("grey", Vec3::splat(0.7)), Vec3::ZERO);
        // A map that nobody looks at.
        let mut away = seen_little();
        away.name = "looking away".into();
        away.cameras = vec![clerestory_hard_cases::scenes::orthographic(
            glam::DVec3::new(0.0, 4.0, 0.0),
            glam::DVec3::new(0.0, 8.0, 0.0),
            glam::DVec3::Z,
            0.8,
        )];
        for scene in [mirrors, away] {
            let made = expect_alike(gpu, &scene, &direct());
            assert_eq!(made.gather, GatherCounts::default());
            assert!(made.bits.iter().all(|bits| *bits == 0), "{}", scene.name);
        }
    });
}

#[test]
fn queues_take_places_that_all_lie_in_the_same_thousand_kernels() {
    with_gpu(|gpu| {
        let scene = room();
        // Kernels as large as the room.
        let settings = PhotonSettings {
            photons: 1 << 13,
            ..fixed("all", 6.0)
        };
        let made = expect_alike(gpu, &scene, &settings);
        assert_eq!(made.gather.queries, PLACES);
        let each = made.gather.photons / made.gather.queries;
        println!("{each} kernels about each point");
        assert!(each >= 1000 && made.gather.photons == each * PLACES);
        assert!(made.bits.iter().all(|bits| f32::from_bits(*bits) > 0.0));
    });
}

#[test]
fn queues_never_show_on_any_number_of_threads() {
    let hash = |threads| hash_in_child(CHILD_TEST, CHILD, &[("LP_NUM_THREADS", threads)]);
    let truth = hash("1");
    assert_eq!(hash("2"), truth, "two threads");
}

#[test]
fn prints_its_hash_when_asked() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    let gpu = gpu();
    let stopping = PhotonSettings {
        query_quota: 64,
        ..direct()
    };
    // Slots are no queue: nothing of theirs comes in the order of threads.
    let queues = FORMS.iter().filter(|(queue, _)| *queue != MapQueue::Slots);
    print_hash(queues.flat_map(|form| {
        let mut words = made(&gpu, &seen_little(), &direct(), *form).bits;
        words.extend(made(&gpu, &seen_little(), &stopping, *form).bits);
        words
    }));
    clerestory_tests::assert_no_messages(&gpu);
}
