//! Statistics for the tests of samplers.

use super::random::pcg4d;
use crate::test_chi_square::{chi_square, chi_square_z};
use glam::{DVec3, UVec4};
use std::f64::consts::TAU;

/// Independent numbers in [0, 1)³ with 32 bits each, counted by `i`.
pub fn random3(i: u32, seed: u32) -> DVec3 {
    let v = pcg4d(UVec4::new(i, seed, 0x7e57, 0));
    v.truncate().as_dvec3() / (f64::from(u32::MAX) + 1.0)
}

/// Upper tail probability of a chi-square statistic, by the Wilson–Hilferty normal approximation.
pub fn chi_square_p(statistic: f64, degrees: usize) -> f64 {
    0.5 * libm::erfc(chi_square_z(statistic, degrees) * std::f64::consts::FRAC_1_SQRT_2)
}

/// p-value of counts against expected counts, as [`chi_square`] compares them; 1 for too few to compare.
pub fn chi_square_test(observed: &[f64], expected: &[f64]) -> f64 {
    chi_square(observed, expected).map_or(1.0, |(statistic, degrees)| chi_square_p(statistic, degrees))
}

/// Cells of the sphere for [`sphere_test`]: even in z and azimuth.
const SPHERE_CELLS: [usize; 2] = [24, 24];

/// p-value of directions drawn by `sample` (`None`: no direction, counted as missing) against `pdf`, which may integrate to less
/// than one. Cells are integrated by an 8 × 8 midpoint rule each, refined where the density is `peaked`.
pub fn sphere_test(
    draws: u32,
    seed: u32,
    refinement: u32,
    sample: impl Fn(DVec3) -> Option<DVec3>,
    pdf: impl Fn(DVec3) -> f64,
) -> f64 {
    let [rows, columns] = SPHERE_CELLS;
    let mut observed = vec![0.0; rows * columns + 1];
    for i in 0..draws {
        let cell = sample(random3(i, seed)).map_or(rows * columns, |w| {
            let row = (((w.z + 1.0) * 0.5 * rows as f64) as usize).min(rows - 1);
            let azimuth = w.y.atan2(w.x).rem_euclid(TAU) / TAU;
            row * columns + ((azimuth * columns as f64) as usize).min(columns - 1)
        });
        observed[cell] += 1.0;
    }
    let mut expected: Vec<f64> = (0..rows * columns)
        .map(|cell| {
            let (row, column) = (cell / columns, cell % columns);
            let mut sum = 0.0;
            for a in 0..refinement {
                // The angle, not z, is stepped evenly: densities are smooth in it near the poles.
                let theta = |r: usize| (1.0 - 2.0 * r as f64 / rows as f64).acos();
                let (t0, t1) = (theta(row), theta(row + 1));
                let t = t0 + (t1 - t0) * (f64::from(a) + 0.5) / f64::from(refinement);
                for b in 0..refinement {
                    let phi = TAU * (column as f64 + (f64::from(b) + 0.5) / f64::from(refinement)) / columns as f64;
                    let w = DVec3::new(t.sin() * phi.cos(), t.sin() * phi.sin(), -t.cos());
                    sum += pdf(w) * t.sin() * (t0 - t1).abs();
                }
            }
            sum * TAU / columns as f64 / f64::from(refinement * refinement) * f64::from(draws)
        })
        .collect();
    let missing = f64::from(draws) - expected.iter().sum::<f64>();
    // Quadrature leaves a rest of about 1e-4 where nothing is missing.
    expected.push(if missing > 1e-3 * f64::from(draws) || observed[rows * columns] > 0.0 {
        missing.max(0.0)
    } else {
        0.0
    });
    chi_square_test(&observed, &expected)
}
