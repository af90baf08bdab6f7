//! Photons through media are kept to the count, whatever is stored of them and whatever is asked for: what was emitted has escaped or was absorbed.

use super::volume::{coloured, lit_box, uneven};
use super::*;
use clerestory::scene::{Medium, Phase};
use clerestory::techniques::photon_mapping::volume::{VolumeEstimate, VolumeKernel};
use clerestory_tests::render::{builtin, medium};
use clerestory_tests::with_gpu;

/// Photons of a pass, and passes.
const PHOTONS: u32 = 1 << 9;
const PASSES: u32 = 2;

/// What a picture counts; fails unless every photon has gone somewhere.
fn counted(gpu: &Gpu, scene: &Scene, settings: PhotonSettings) -> MapperCounts {
    let settings = PhotonSettings {
        photons: PHOTONS,
        volume_radius: 0.1,
        ..settings
    };
    let mut mapper = mapper(gpu, scene, &settings);
    advance(&mut mapper, PASSES);
    let counts = mapper.counts();
    let c = counts.photons;
    let emitted = u64::from(PASSES * PHOTONS);
    assert_eq!(
        (c.emitted, c.escaped + c.absorbed),
        (emitted, emitted),
        "{}: {settings:?}: {c:?}",
        scene.name
    );
    counts
}

fn by(volume: VolumeEstimate) -> PhotonSettings {
    PhotonSettings {
        volume,
        ..settings("all")
    }
}

const EVERYWHERE: [VolumeEstimate; 3] = [VolumeEstimate::Ray, VolumeEstimate::March, VolumeEstimate::Unified];
const HOMOGENEOUS: [VolumeEstimate; 2] = [VolumeEstimate::Beams, VolumeEstimate::Planes];

#[test]
fn photons_are_kept_to_the_count_by_every_estimate() {
    with_gpu(|gpu| {
        let glass = builtin("builtin:fog-box?sphere=glass");
        let mut emits = lit_box(Medium {
            emission: Vec3::ONE,
            ..coloured()
        });
        emits.name = "lit box that emits".into();
        for volume in EVERYWHERE.into_iter().chain(HOMOGENEOUS) {
            for scene in [&glass, &emits] {
                let counts = counted(gpu, scene, by(volume));
                assert!(counts.photons.collisions > 100 && counts.events > 30, "{counts:?}");
            }
        }
        let grid = lit_box(uneven(medium(5.0, 0.9, Phase::HenyeyGreenstein { g: 0.7 })));
        for volume in EVERYWHERE {
            let counts = counted(gpu, &grid, by(volume));
            // Collisions alone are stored in grids, each once it scatters a photon that has been scattered before.
            assert!(
                counts.events > 0 && counts.events <= counts.photons.collisions,
                "{volume:?}: {counts:?}"
            );
        }
    });
}

#[test]
fn photons_are_kept_to_the_count_whatever_becomes_of_them() {
    with_gpu(|gpu| {
        let fog = |albedo: f32| lit_box(medium(3.0, albedo, Phase::Isotropic));
        for volume in [VolumeEstimate::Ray, VolumeEstimate::Beams, VolumeEstimate::Planes] {
            // Media that only absorb, through which photons come with less; and that absorb nothing.
            for albedo in [0.0, 1.0] {
                let counts = counted(gpu, &fog(albedo), by(volume));
                assert!(counts.photons.absorbed > 0, "{volume:?}, albedo {albedo}: {counts:?}");
            }
        }
        let usual = fog(0.8);
        for asked in [
            // Ended after the second collision, or once no light path that is asked for goes on.
            settings("bounces=0..2"),
            settings("LV[DV]E"),
            PhotonSettings {
                direct_photons: true,
                ..settings("all")
            },
            PhotonSettings {
                final_gather: true,
                ..settings("all")
            },
            PhotonSettings {
                volume_kernel: VolumeKernel::Footprint,
                shape: KernelShape::Principal,
                ..settings("all")
            },
            // In as many submissions as there can be.
            PhotonSettings {
                submission_work: 1,
                ..settings("all")
            },
        ] {
            counted(gpu, &usual, asked);
        }
    });
}
