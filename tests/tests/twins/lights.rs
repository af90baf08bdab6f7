//! Light without area, measures and weights of light sampling, phase functions.

use clerestory::gpu::shaders::constants::{PHASE_HENYEY_GREENSTEIN, PHASE_RAYLEIGH, PHASE_SCHLICK};
use clerestory::scene::Phase;
use clerestory::techniques::bidirectional::mis::{PartialWeights, mis_weight};
use clerestory::transport::lights::{
    area_to_solid_angle, balance_heuristic, power_heuristic, spot_falloff, triangle_point,
};
use clerestory::transport::phase::{
    henyey_greenstein, henyey_greenstein_sample, phase_direction, phase_function, phase_function_sample, schlick_phase,
    schlick_phase_sample,
};
use clerestory_tests::twin::{Tolerance, U, compare, trigonometric_error};
use clerestory_tests::with_gpu;

use crate::{cases, check, direction, join, list, shift, twin_math, ulps, unit, v2, v3};

#[test]
fn lights_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(6, |r| {
            let (inner, outer) = (r.range(0.5, 1.0), r.range(-1.0, 0.5));
            let mut all = vec![
                r.range(0.1, 9.0),
                r.range(1e-6, 1e6),
                r.choose(&[0.0, -1.0, 1e-9, 0.5, 1.0]),
                r.range(-1.0, 1.0),
                inner,
                outer,
            ];
            all.extend([r.choose(&[0.0, 1e-6, 1.0, 1e6]), r.choose(&[0.0, 1e-6, 1.0, 1e6])]);
            all.extend((0..9).map(|_| r.range(-10.0, 10.0)));
            all.extend([unit(r), unit(r)]);
            all
        });
        check(gpu, "lights", 4, &table, ulps(16.0, 4.0, 0.0), 19, |x| {
            list![
                [
                    area_to_solid_angle(x[0], x[1], x[2]),
                    spot_falloff(x[3], x[4], x[5]),
                    balance_heuristic(x[6], x[7]),
                    power_heuristic(x[6], x[7]),
                ],
                triangle_point(v3(x, 8), v3(x, 11), v3(x, 14), v2(x, 17)).to_array(),
            ]
        });
    });
}

#[test]
fn partial_weights_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(15, |r| {
            (0..8).map(|_| r.range(-20.0, 20.0).exp2()).collect::<Vec<f32>>()
        });
        check(gpu, "partial weights", 16, &table, ulps(8.0, 1.0, 0.0), 8, |x| {
            let w = PartialWeights {
                d_vcm: x[0],
                d_vc: x[1],
            };
            let pair = |w: PartialWeights| [w.d_vcm, w.d_vc];
            list![
                pair(w.mis_arrive(x[2], x[3])),
                pair(w.mis_scatter(x[4], x[5], x[6])),
                pair(w.mis_scatter_delta(x[4], x[7])),
                [w.mis_behind(x[6]), mis_weight(x[0], x[1])],
            ]
        });
    });
}

/// The phase function that the numbers of a case choose.
fn phase(x: &[f64]) -> Phase {
    let parameter = x[1] as f32;
    match (x[8] as f32).to_bits() {
        PHASE_HENYEY_GREENSTEIN => Phase::HenyeyGreenstein { g: parameter },
        PHASE_SCHLICK => Phase::Schlick { k: parameter },
        PHASE_RAYLEIGH => Phase::Rayleigh,
        _ => Phase::Isotropic,
    }
}

#[test]
fn phase_functions_agree_with_their_twins() {
    with_gpu(|gpu| {
        let trig = trigonometric_error(gpu);
        let table = cases(7, |r| {
            let head = [
                r.choose(&[-1.0, 1.0, 0.0, 0.999, 0.3]),
                r.choose(&[0.0, 0.5, -0.5, 0.99, -0.99, 0.05]),
                r.choose(&[0.0, 0.7, -0.99]),
                unit(r),
                unit(r),
            ];
            let kind = r.choose(&[0, 1, 2, 3].map(f32::from_bits));
            join(&[&head, &direction(r).to_array(), &[kind]])
        });
        let tolerance = Tolerance {
            input_size: 1.0,
            ..ulps(32.0, 4.0, trig + 4.0 * U)
        };
        check(gpu, "phase functions", 5, &table, tolerance, 8, |x| {
            list![
                [
                    henyey_greenstein(x[0], x[1]),
                    henyey_greenstein_sample(x[1], x[3]),
                    schlick_phase(x[0], x[2]),
                    schlick_phase_sample(x[2], x[3]),
                ],
                phase_direction(v3(x, 5), x[0], x[4]).to_array(),
                [phase_function_sample(phase(x), x[3])],
            ]
        });
    });
}

#[test]
fn phase_functions_near_their_peaks_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(8, |r| {
            let w = direction(r);
            // Some rounding units off the peak, up to some degrees.
            let off = r.choose(&[0.0, 1e-7, 1e-5, 1e-3, 0.1]);
            let side = r.choose(&[1.0, -1.0]);
            let wi = (side * (w + off * direction(r))).normalize();
            let parameter = r.choose(&[0.5, 0.99, 0.9999, 0.999_999, -0.99, -0.9999]);
            let kind = r.choose(&[0, 1, 2, 3].map(f32::from_bits));
            join(&[&[0.0, parameter, 0.0, 0.0, 0.0], &w.to_array(), &[kind], &wi.to_array()])
        });
        // Relative to the inputs as they are: sums and differences of directions near the peak are exact, their squares good to some units.
        let results: Vec<_> = twin_math(gpu, 5, &table, &[]).iter().map(|r| shift(r, 8)).collect();
        let what = "phase functions near their peaks";
        let worst = compare(what, &table, &results, ulps(32.0, 0.0, 0.0), 0..0, |x| {
            vec![phase_function(phase(x), v3(x, 5), v3(x, 9))]
        });
        println!("{what}: worst error {worst:.3} of what is allowed");
    });
}
