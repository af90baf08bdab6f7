//! Eye paths that go on in media and share what they find there with collisions and ways of photons: together they have the path tracer's light, the same bits however it is done.

use super::queues::FORMS;
use super::volume::{behind_a_pane, box_by_a_lamp, coloured, endless, lit_box, uneven};
use super::*;
use clerestory::Error;
use clerestory::scene::{Environment, Medium, Phase};
use clerestory::techniques::photon_mapping::MapBuild;
use clerestory::techniques::photon_mapping::volume::VolumeEstimate;
use clerestory_tests::render::medium;
use clerestory_tests::with_gpu;

const PASSES: u32 = 24;

/// So few photons under such narrow kernels that both have about half of the light.
fn sharing(set: &str) -> PhotonSettings {
    PhotonSettings {
        volume: VolumeEstimate::Unified,
        volume_paths: true,
        volume_radius: 0.015,
        radius: 0.1,
        photons: 1 << 11,
        ..settings(set)
    }
}

#[test]
fn photons_and_eye_paths_share_all_light() {
    with_gpu(|gpu| {
        // Of a point outside the box, scattered there and on the floor; in a grid, where there are no beams.
        for scene in [
            lit_box(coloured()),
            lit_box(uneven(medium(4.0, 0.8, Phase::HenyeyGreenstein { g: 0.5 }))),
        ] {
            // As of beams in one box (`volume.rs`).
            let counts = expect_agreement(gpu, &scene, &sharing("bounces=2..4"), [PASSES, 1024], [1.5e-2; 3]);
            assert!(counts.beams.photons > 300);
        }
    });
}

#[test]
fn lamps_that_eye_paths_meet_are_shared() {
    with_gpu(|gpu| {
        // A pane scatters first what no eye path may have.
        let fog = medium(2.0, 0.8, Phase::Isotropic);
        for (scene, set) in [
            (box_by_a_lamp(fog.clone()), "bounces=2..3"),
            (box_by_a_lamp(fog.clone()), "LV[DV]*E"),
            (behind_a_pane(fog), "L.*V.*E"),
        ] {
            let settings = PhotonSettings {
                radius: 0.05,
                ..sharing(set)
            };
            // As of expressions (`volume.rs`).
            expect_agreement(gpu, &scene, &settings, [PASSES, 2048], [2.5e-2; 3]);
        }
    });
}

#[test]
fn light_without_a_place_is_shared() {
    with_gpu(|gpu| {
        let mut sky = lit_box(medium(2.0, 0.8, Phase::Isotropic));
        sky.name = "sky".into();
        sky.lights.clear();
        sky.environment = Some(Environment::uniform(Vec3::new(0.5, 1.0, 2.0)));
        let mut glow = lit_box(Medium {
            emission: Vec3::new(2.0, 1.0, 0.5),
            ..medium(2.0, 0.8, Phase::Isotropic)
        });
        glow.name = "glow".into();
        // What is scattered once, too, which eye paths have alone.
        for scene in [sky, glow] {
            expect_agreement(gpu, &scene, &sharing("bounces=1..3"), [PASSES, 1024], [1.5e-2; 3]);
        }
    });
}

#[test]
fn direct_light_from_the_map_is_not_shared() {
    with_gpu(|gpu| {
        let scene = lit_box(medium(3.0, 0.8, Phase::Isotropic));
        let settings = PhotonSettings {
            direct_photons: true,
            ..sharing("bounces=1..3")
        };
        expect_agreement(gpu, &scene, &settings, [PASSES, 1024], [1.5e-2; 3]);
    });
}

/// Fails unless pictures by these settings have the same bits in each run, in parts, from a map by the host and from a queue, and others without eye paths that go on.
pub(super) fn expect_same_bits_however_it_is_done(gpu: &Gpu, scene: &Scene, settings: PhotonSettings) {
    let usual = PhotonSettings {
        photons: 1 << 10,
        reduction: 2.0 / 3.0,
        ..settings
    };
    let made = |settings: &PhotonSettings| bits(&photons(gpu, scene, settings, 3));
    let truth = made(&usual);
    assert_eq!(made(&usual), truth, "two runs");
    let in_parts = PhotonSettings {
        submission_work: 1 << 12,
        ..usual.clone()
    };
    assert_eq!(made(&in_parts), truth, "in short submissions");
    let by_host = PhotonSettings {
        map_build: MapBuild::Host,
        ..usual.clone()
    };
    assert_eq!(made(&by_host), truth, "a map by the host");
    let (queue, query) = FORMS[1];
    let queued = PhotonSettings {
        queue,
        query,
        ..usual.clone()
    };
    assert_eq!(made(&queued), truth, "from a queue");
    let alone = PhotonSettings {
        volume_paths: false,
        ..usual
    };
    assert_ne!(made(&alone), truth, "without eye paths");
}

#[test]
fn shares_have_the_same_bits_however_it_is_done() {
    with_gpu(|gpu| expect_same_bits_however_it_is_done(gpu, &lit_box(uneven(coloured())), sharing("all")));
}

#[test]
fn eye_paths_go_on_beside_collisions_and_ways_alone() {
    with_gpu(|gpu| {
        let scene = endless(medium(1.0, 0.5, Phase::Isotropic));
        let uploaded = upload(gpu, &scene);
        let beside_disks = PhotonSettings {
            volume: VolumeEstimate::Ray,
            ..sharing("all")
        };
        let gathered = PhotonSettings {
            final_gather: true,
            ..sharing("all")
        };
        for settings in [beside_disks, gathered] {
            match PhotonMapper::new(gpu, uploaded.clone(), &scene.cameras[0], SIZE, settings) {
                Err(Error::Setting { name, .. }) => assert_eq!(name, "volume_paths"),
                Err(other) => panic!("{other}"),
                Ok(_) => panic!("accepted"),
            }
        }
    });
}
