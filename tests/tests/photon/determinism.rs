//! The same bits on every run and any number of threads, and however much had to be done twice.

use super::*;
use clerestory_tests::child::{hash_in_child, print_hash};
use clerestory_tests::render::builtin;
use clerestory_tests::{gpu, with_gpu};

/// Set in the processes that only print their picture's hash.
const CHILD: &str = "CLERESTORY_TEST_PRINT_PHOTON_HASH";
const CHILD_TEST: &str = "determinism::prints_its_hash_when_asked";

const PASSES: u32 = 3;

fn scene() -> Scene {
    builtin("builtin:cornell-box?sphere=glass&source=point")
}

fn principal() -> PhotonSettings {
    PhotonSettings {
        shape: KernelShape::Principal,
        photons: 1 << 12,
        ..settings("all")
    }
}

fn picture(gpu: &Gpu) -> Vec<f32> {
    photons(gpu, &scene(), &principal(), PASSES)
}

#[test]
fn runs_are_equal_and_seeds_are_not() {
    with_gpu(|gpu| {
        let truth = bits(&picture(gpu));
        assert_eq!(bits(&picture(gpu)), truth, "two runs");
        let mut steps = mapper(gpu, &scene(), &principal());
        for samples in 1..=PASSES {
            advance(&mut steps, samples);
        }
        assert_eq!(bits(&advance(&mut steps, PASSES)), truth, "in steps");
        steps.photons(1).unwrap_or_else(|error| panic!("{error}"));
        steps
            .set_camera(&scene().cameras[0])
            .unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(bits(&advance(&mut steps, PASSES)), truth, "after set_camera");
        let other = PhotonSettings {
            seed: 12,
            ..principal()
        };
        assert_ne!(bits(&photons(gpu, &scene(), &other, PASSES)), truth, "another seed");
    });
}

#[test]
fn threads_never_show() {
    let hash = |variables: &[(&str, &str)]| hash_in_child(CHILD_TEST, CHILD, variables);
    let truth = hash(&[("LP_NUM_THREADS", "1"), ("RAYON_NUM_THREADS", "1")]);
    assert_eq!(hash(&[("LP_NUM_THREADS", "2")]), truth, "two threads");
    assert_eq!(
        hash(&[("LP_NUM_THREADS", "0"), ("RAYON_NUM_THREADS", "5")]),
        truth,
        "no threads of the driver, five of the host"
    );
}

#[test]
fn prints_its_hash_when_asked() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    let gpu = gpu();
    print_hash(bits(&picture(&gpu)));
    clerestory_tests::assert_no_messages(&gpu);
}

#[test]
fn queries_that_a_quota_stops_go_through_all_records() {
    with_gpu(|gpu| {
        // With glass between: places stop at any bounce.
        let settings = |query_quota| PhotonSettings {
            query_quota,
            photons: 1 << 11,
            radius: 0.1,
            ..principal()
        };
        let of = |quota| {
            let mut mapper = mapper(gpu, &scene(), &settings(quota));
            let picture = advance(&mut mapper, 2);
            (picture, mapper.counts().gather, mapper.eye_counters().stalls)
        };
        let (whole, counts, stalls) = of(32_768);
        assert_eq!(stalls, 0);
        let (stopped, stopped_counts, stalls) = of(64);
        assert!(stalls > 0);
        assert_eq!(stopped_counts, counts, "queries, and kernels that held them");
        // Sums of up to a thousand kernels in another order.
        for (i, (a, b)) in whole.iter().zip(&stopped).enumerate() {
            assert!((a - b).abs() <= 1e-5 * a, "{i}: {b}, not {a}");
        }
        assert_eq!(bits(&of(64).0), bits(&stopped), "two runs");
    });
}

#[test]
fn room_for_records_grows() {
    with_gpu(|gpu| {
        // Each photon leaves nine and a half records more than its first, of which four have room at first.
        let mut scene = builtin("builtin:furnace-box?rho=0.95&emission=0");
        add_point(&mut scene, Vec3::new(0.2, 0.4, -0.1), Vec3::splat(20.0));
        let settings = PhotonSettings {
            photons: 1 << 10,
            ..fixed("all", 0.1)
        };
        let mut mapper = mapper(gpu, &scene, &settings);
        let first = advance(&mut mapper, 2);
        let counts = mapper.counts();
        assert!(counts.records > 2 * 4 * u64::from(settings.photons), "{counts:?}");
        assert_eq!(counts.photons.emitted, 2 * u64::from(settings.photons), "counted once");
        // With the room there from the start.
        mapper
            .set_camera(&scene.cameras[0])
            .unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(bits(&advance(&mut mapper, 2)), bits(&first));
    });
}
