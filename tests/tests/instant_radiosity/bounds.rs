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
        // Of the radiance of 1 an emission of 0.2 is no reflection.
        let emission = 0.2;
        let reflected = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64 - emission;
        // ((1 - κ) ρ)ⁿ⁺¹ after n steps, where κ is the share of every term that its bound leaves.
        for (share, all_left, allowed) in [
            (0.5, &[0.4, 0.16, 0.064, 0.0256, 0.0102][..], FACETS),
            // Roulette ends seven of ten paths behind the third step, and the light of the others is a quarter of all.
            (0.1, &[0.72, 0.518, 0.373, 0.269][..], 2.0 * FACETS),
        ] {
            let of = |compensation, compensation_steps| {
                let settings = VirtualLightSettings {
                    walks: 16,
                    samples_per_pass: 2,
                    bound: Bound::Geometry,
                    bound_value: 0.25 * share as f32,
                    compensation,
                    compensation_steps,
                    // Passes are independent of each other all the same.
                    sampler: SamplerKind::Sobol,
                    ..settings()
                };
                let found = passes_of_size(gpu, &scene, [8; 2], &settings, 16);
                found.means[0].clone()
            };
            let all = of(Compensation::Rays, 0);
            expect_mean_of(&format!("κ = {share}, all steps"), &all, 1.0, 0.0, FACETS);
            for (steps, left) in (0..).zip(all_left) {
                let values = match steps {
                    0 => of(Compensation::None, 0),
                    _ => of(Compensation::Rays, steps),
                };
                // Of the same walks, so that what is left of their noise is that of a ratio.
                let found = 1.0 - reflected(&values) / reflected(&all);
                println!("κ = {share}, {steps} steps: {found:.4} left, expected {left}");
                assert!(
                    (found - left).abs() < allowed.min(0.4 * left),
                    "κ = {share}, {steps} steps: {found} instead of {left}"
                );
            }
        }
    });
}

/// A bound that no edge meets compensates nothing, and one that leaves nothing of any is path tracing.
#[test]
fn loose_bounds_compensate_nothing_and_tight_ones_trace_paths() {
    const LOOSE: f32 = 1e30;
    const TIGHT: f32 = 1e-7;
    with_gpu(|gpu| {
        let scene = room();
        let of = |bound, bound_value, compensation, most_bounces| {
            let settings = VirtualLightSettings {
                bound,
                bound_value,
                compensation,
                most_bounces,
                ..settings()
            };
            let mut renderer = renderer(gpu, &scene, SIZE, &settings);
            let [radiance, _] = advance(&mut renderer, 4);
            (radiance, renderer.counts().gather.gathers)
        };
        let expect_alike = |what: &str, found: &[f32], expected: &[f32]| {
            let most = expected.iter().copied().fold(0.0, f32::max);
            for (found, expected) in found.iter().zip(expected) {
                let allowed = 1e-5 * (expected + most);
                assert!((found - expected).abs() <= allowed, "{what}: {found} {expected}");
            }
        };
        let (unbounded, gathers) = of(Bound::None, 0.0, Compensation::Rays, 0);
        let (loose, gathers_of_loose) = of(Bound::Geometry, LOOSE, Compensation::Rays, 0);
        expect_alike("loose", &loose, &unbounded);
        // Each sample where it first arrives, and nowhere else.
        assert_eq!((gathers, gathers_of_loose), (u64::from(4 * SIDE * SIDE), gathers));
        // Nothing of what virtual lights bring is left: direct light alone, and with the compensation everything.
        let (tight, _) = of(Bound::Geometry, TIGHT, Compensation::None, 0);
        let (direct, _) = of(Bound::Geometry, TIGHT, Compensation::None, 1);
        expect_alike("tight", &tight, &direct);
        let settings = VirtualLightSettings {
            walks: 1,
            // Of so many a pass's values are nearly normal, as the test of each pixel has it.
            samples_per_pass: 16,
            bound: Bound::Geometry,
            bound_value: TIGHT,
            ..settings()
        };
        let found = passes(gpu, &scene, &settings, 48);
        found.expect_same_as("tight, compensated", &traced(gpu, &scene, 2048), 0.0);
        assert!(found.counts.gather.gathers > 2 * u64::from(48 * 16 * SIDE * SIDE));
    });
}
