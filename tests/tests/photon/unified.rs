//! Collisions and ways of photons weighted together: the path tracer's light where each alone is good and where it is not, and errors near to those of the better one.

use super::volume::{airlight, coloured, lit_box, uneven};
use super::*;
use clerestory::scene::{Phase, Projection};
use clerestory::techniques::photon_mapping::volume::VolumeEstimate;
use clerestory_tests::render::{builtin, medium};
use clerestory_tests::with_gpu;

fn with(volume: VolumeEstimate, set: &str, photons: u32) -> PhotonSettings {
    PhotonSettings {
        volume,
        volume_radius: 0.02,
        radius: 0.1,
        photons,
        ..settings(set)
    }
}

#[test]
fn unified_estimates_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        // In a grid collisions alone; thin and dense.
        for scene in [
            lit_box(coloured()),
            lit_box(uneven(medium(4.0, 0.8, Phase::Isotropic))),
            lit_box(medium(0.3, 0.9, Phase::Isotropic)),
            lit_box(medium(12.0, 0.9, Phase::Isotropic)),
        ] {
            // As of beams in one box (`volume.rs`).
            let unified = with(VolumeEstimate::Unified, "bounces=2..4", 1 << 12);
            let counts = expect_agreement(gpu, &scene, &unified, [16, 1024], [1.5e-2; 3]);
            assert!(counts.beams.photons > 300);
        }
    });
}

/// Mean squared error of a picture of some passes, beyond that of the truth itself.
fn error(gpu: &Gpu, scene: &Scene, settings: &PhotonSettings, truth: &Rendered) -> f64 {
    const PASSES: u32 = 4;
    const SEEDS: u32 = 3;
    let own: f64 = truth.variance.iter().map(|variance| f64::from(*variance)).sum();
    let mut mapper = mapper(gpu, scene, settings);
    let squared = (0..SEEDS).map(|seed| {
        mapper.restart(seed).unwrap_or_else(|error| panic!("{error}"));
        let found = advance(&mut mapper, PASSES);
        let off = found.iter().zip(&truth.radiance);
        off.map(|(found, expected)| f64::from(found - expected).powi(2))
            .sum::<f64>()
            - own
    });
    squared.sum::<f64>() / f64::from(SEEDS)
}

#[test]
fn errors_are_near_to_those_of_the_better_estimate() {
    with_gpu(|gpu| {
        // Fog in which a mean free path is much longer, and much shorter, than what is seen of it.
        let mut thin = airlight(0.0, 0.1, 1.0);
        for camera in &mut thin.cameras {
            camera.projection = Projection::Orthographic { half_height: 0.5 };
        }
        for (scene, set) in [
            (thin, "bounces=2..3"),
            (lit_box(medium(25.0, 0.9, Phase::Isotropic)), "bounces=2..3"),
            (builtin("builtin:fog-box?boxes=none"), "L.*VE"),
        ] {
            let truth = traced(gpu, &scene, set, 2048);
            let [points, beams, unified, shared] = [
                (VolumeEstimate::Ray, false),
                (VolumeEstimate::Beams, false),
                (VolumeEstimate::Unified, false),
                (VolumeEstimate::Unified, true),
            ]
            .map(|(volume, volume_paths)| {
                let wide = PhotonSettings {
                    volume_radius: 0.05,
                    volume_paths,
                    ..with(volume, set, 1 << 12)
                };
                error(gpu, &scene, &wide, &truth)
            });
            println!(
                "{}: MSE {points:.3e} of collisions, {beams:.3e} of beams, {unified:.3e} of both, {shared:.3e} with eye paths",
                scene.name
            );
            assert!(unified.max(shared) <= 1.5 * points.min(beams), "{}", scene.name);
        }
    });
}
