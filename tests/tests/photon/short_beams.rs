//! Beams that end by chance beside those that go on to the next surface: one expectation, and another variance.

use super::volume::{coloured, endless, lit_box, single};
use super::volume_truths::{SLAB_FACES, exactly, parallel, slab};
use super::*;
use clerestory::scene::Phase;
use clerestory::techniques::photon_mapping::volume::VolumeEstimate;
use clerestory::techniques::photon_mapping::volume::ways::BeamLength;
use clerestory_tests::render::medium;
use clerestory_tests::with_gpu;
use glam::DVec3;

#[test]
fn short_beams_have_the_radiance_of_a_slab() {
    with_gpu(|gpu| {
        let mut scene = slab();
        for (face, forward, height, expected) in SLAB_FACES {
            scene.cameras = vec![parallel(DVec3::new(0.0, height, 0.0), forward, 2.0)];
            for volume in [VolumeEstimate::Beams, VolumeEstimate::Unified] {
                let settings = PhotonSettings {
                    volume,
                    volume_beams: BeamLength::Short,
                    volume_radius: 0.4,
                    photons: 1 << 14,
                    ..settings("all")
                };
                // As of long ones (`volume_truths.rs`).
                let what = format!("{face} face, short, {volume:?}");
                means(gpu, &scene, &settings, 8).expect(&what, 0, 0, exactly(expected), 2e-3);
            }
        }
    });
}

/// Single scattering along the ray from x = −3 m on at a height above a light of 1 W, in an endless medium of extinction 1/m that scatters this share, by the rule of midpoints.
fn airlight_at(height: f64, albedo: f64) -> f64 {
    const STEPS: u32 = 40_000;
    let step = 40.0 / f64::from(STEPS);
    let at = |i: u32| {
        let t = (f64::from(i) + 0.5) * step;
        let d = (t - 3.0).hypot(height);
        (-t - d).exp() / (d * d)
    };
    let sum: f64 = (0..STEPS).map(at).sum();
    albedo * sum * step / (4.0 * PI).powi(2)
}

#[test]
fn short_and_long_beams_have_one_mean_and_another_variance() {
    with_gpu(|gpu| {
        // All beams come from the light, and go through two mean free paths or more.
        let (height, albedo) = (2.0, 0.9);
        let mut scene = endless(medium(1.0, albedo, Phase::Isotropic));
        scene.cameras = vec![parallel(DVec3::new(-3.0, height, 0.0), DVec3::X, 1e-6)];
        let exact = airlight_at(height, f64::from(albedo));
        let [long, short] = [BeamLength::Long, BeamLength::Short].map(|volume_beams| {
            let settings = PhotonSettings {
                volume_beams,
                photons: 1 << 13,
                ..single(VolumeEstimate::Beams, 0.15)
            };
            let found = means(gpu, &scene, &settings, 32);
            // Kernels of 0.15 m blur by their square.
            found.expect(&format!("{volume_beams:?}"), 0, 0, exactly(exact), 1e-2);
            (found.parts[0][0].variance, found.counts.beams.photons)
        });
        println!("variance {:.3e} of long beams, {:.3e} of short ones", long.0, short.0);
        // Squares are greater by the reciprocal of the transmittance, e² at least; meetings are fewer by that.
        assert!(short.0 > 2.0 * long.0, "{long:?} {short:?}");
        assert!(short.1 > 0 && short.1 < long.1 / 4, "{long:?} {short:?}");
    });
}

#[test]
fn short_beams_agree_with_the_path_tracer_in_every_band() {
    with_gpu(|gpu| {
        let scene = lit_box(coloured());
        let set = "bounces=2..4";
        let reference = traced(gpu, &scene, set, 1024);
        for volume in [VolumeEstimate::Beams, VolumeEstimate::Unified] {
            let settings = PhotonSettings {
                volume,
                volume_beams: BeamLength::Short,
                volume_radius: 0.02,
                radius: 0.1,
                photons: 1 << 13,
                ..settings(set)
            };
            // As of long ones (`volume.rs`).
            means(gpu, &scene, &settings, 16).expect_same_as(&format!("{volume:?}"), &reference, [1.5e-2; 3]);
        }
    });
}
