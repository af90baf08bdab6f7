//! The unit of length: nothing in photon mapping is an absolute length.

use super::*;
use clerestory_tests::render::builtin;
use clerestory_tests::with_gpu;
use glam::{DAffine3, DVec3};

/// A Cornell box with glass, all lengths and the light's power scaled.
fn scaled(by: f64) -> Scene {
    let mut scene = builtin("builtin:cornell-box?sphere=glass&source=point");
    scene.name = format!("Cornell box times {by:e}");
    clerestory_hard_cases::scenes::transform(&mut scene, DAffine3::from_scale(DVec3::splat(by)));
    for light in &mut scene.lights {
        if let LightKind::Point { position, intensity } = &mut light.kind {
            *position *= by as f32;
            *intensity *= (by * by) as f32;
        }
    }
    scene
}

fn shapes() -> [PhotonSettings; 2] {
    [KernelShape::Fixed, KernelShape::Principal].map(|shape| PhotonSettings {
        shape,
        photons: 1 << 12,
        reduction: 2.0 / 3.0,
        ..settings("all")
    })
}

#[test]
fn powers_of_two_never_show() {
    with_gpu(|gpu| {
        for settings in shapes() {
            let truth = photons(gpu, &scaled(1.0), &settings, 3);
            assert!(sums(&truth)[0][0] > 1.0);
            for exponent in [-10, 10] {
                let scene = scaled(2f64.powi(exponent));
                let found = photons(gpu, &scene, &settings, 3);
                let differ = bits(&found).iter().zip(bits(&truth)).filter(|(a, b)| *a != b).count();
                assert_eq!(differ, 0, "{:?}, {}", settings.shape, scene.name);
            }
        }
    });
}

#[test]
fn powers_of_ten_show_by_rounding_alone() {
    with_gpu(|gpu| {
        for settings in shapes() {
            let truth = photons(gpu, &scaled(1.0), &settings, 3);
            for by in [1e-3, 1e3] {
                let found = photons(gpu, &scaled(by), &settings, 3);
                let (whole, other) = (sums(&truth)[0], sums(&found)[0]);
                let (mut square, mut power) = (0.0, 0.0);
                for (a, b) in truth.iter().zip(&found) {
                    square += f64::from(a - b).powi(2);
                    power += f64::from(*a).powi(2);
                }
                let error = (square / power).sqrt();
                println!(
                    "{:?} times {by}: root mean square {error:.1e}, means {whole:?}, {other:?}",
                    settings.shape
                );
                assert!(error < 1e-4, "{:?} times {by}: {error}", settings.shape);
                for c in 0..3 {
                    assert!(
                        (other[c] / whole[c] - 1.0).abs() < 1e-4,
                        "{:?} times {by}",
                        settings.shape
                    );
                }
            }
        }
    });
}
