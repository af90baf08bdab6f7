//! What bounds leave out, and what steps of compensation bring back, where both are known: inside spheres, in which G is 1/(4R²) for every two points.

use super::*;

/// Facets of 20 · 12² whose edges are 0.1 long: terms differ by as much from those of the sphere.
const FACETS: f64 = 0.01;

fn sphere_of_point() -> Scene {
    let mut scene = builtin("builtin:sphere-light?rho=0.5&frequency=12");
    scene.lights.clear();
    add_point(&mut scene, Vec3::ZERO, Vec3::ONE);
    scene
}

/// The mean radiance of a picture whose walks are the same for the same seed.
fn brightness(gpu: &Gpu, scene: &Scene, settings: &VirtualLightSettings, samples: u32) -> f64 {
    mean(&advance(&mut renderer(gpu, scene, SIZE, settings), samples)[0], 0)
}

#[test]
fn bounds_leave_out_what_they_should() {
    with_gpu(|gpu| {
        let scene = sphere_of_point();
        let of = |bound, bound_value| {
            // Light that is reflected twice or more is that of virtual lights.
            let settings = VirtualLightSettings {
                walks: 256,
                bound,
                bound_value,
                compensation: Compensation::None,
                least_bounces: 2,
                ..settings()
            };
            brightness(gpu, &scene, &settings, 8)
        };
        let whole = of(Bound::None, 0.0);
        // ρ² + ρ³ + … of Φ/(4π² R²).
        let expected = 0.5 / (4.0 * PI * PI);
        assert!((whole / expected - 1.0).abs() < 0.06, "{whole} instead of {expected}");
        for (bound, value, lost) in [
            (Bound::Distance, 0.1, 0.0125),
            (Bound::Distance, 0.5, 0.0625),
            (Bound::Distance, 4.0, 0.5),
            (Bound::Geometry, 0.125, 0.5),
            (Bound::Geometry, 0.025, 0.9),
            (Bound::Geometry, 0.5, 0.0),
        ] {
            let found = 1.0 - of(bound, value) / whole;
            println!("{bound:?} {value}: {found:.5} lost, expected {lost}");
            // Of the same walks: what is left of noise is that of where they end, over some 4,000 lights.
            assert!(
                (found - lost).abs() < 0.004 + FACETS * lost,
                "{bound:?} {value}: {found} instead of {lost}"
            );
        }
    });
}

#[test]
fn steps_of_compensation_leave_a_geometric_series() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:furnace-sphere?rho=0.8&emission=0.2&frequency=12");
        let of = |compensation, compensation_steps| {
            let settings = VirtualLightSettings {
                walks: 64,
                bound: Bound::Geometry,
                // Half of every term.
                bound_value: 0.125,
                compensation,
                compensation_steps,
                // Passes are independent of each other all the same.
                sampler: SamplerKind::Sobol,
                ..settings()
            };
            let found = passes_of_size(gpu, &scene, [8; 2], &settings, 16);
            found.means[0].clone()
        };
        // Of the radiance of 1 an emission of 0.2 is no reflection.
        let emission = 0.2;
        let all = of(Compensation::Rays, 0);
        expect_mean_of("all steps", &all, 1.0, 0.0, FACETS);
        let reflected = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64 - emission;
        for (what, values, left) in [
            ("no compensation", of(Compensation::None, 0), 0.4),
            ("one step", of(Compensation::Rays, 1), 0.16),
            ("two steps", of(Compensation::Rays, 2), 0.064),
        ] {
            // Of the same walks, so that what is left of their noise is that of a ratio.
            let found = 1.0 - reflected(&values) / reflected(&all);
            println!("{what}: {found:.4} left, expected {left}");
            assert!((found - left).abs() < FACETS, "{what}: {found} instead of {left}");
        }
    });
}
