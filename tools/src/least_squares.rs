//! Least squares without negative coefficients, for measured times as sums over counts of work.
//!
//! Source of the problem: C. Lawson and R. Hanson, "Solving Least Squares Problems", 1974, chapter 23. Solved by trying all sets of coefficients that
//! are not zero, which for a handful finds the least error for certain.

use nalgebra::{DMatrix, DVector};

/// Relative to the largest, singular values that count as zero.
const RANK_TOLERANCE: f64 = 1e-10;

/// A fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit<const N: usize> {
    /// None below zero.
    pub coefficients: [f64; N],
    /// Root of the mean square of the relative errors.
    pub relative_error: f64,
}

/// Coefficients with which the counts of each row add up to its value, which is above zero; relative errors count. No rows give zeros. Deterministic.
pub fn non_negative<const N: usize>(rows: &[([f64; N], f64)]) -> Fit<N> {
    let mut best = Fit {
        coefficients: [0.0; N],
        relative_error: 1.0,
    };
    for chosen in 1_usize..1 << N {
        let columns: Vec<usize> = (0..N).filter(|i| chosen >> i & 1 == 1).collect();
        let matrix = DMatrix::from_fn(rows.len(), columns.len(), |row, column| {
            rows[row].0[columns[column]] / rows[row].1
        });
        let ones = DVector::from_element(rows.len(), 1.0);
        if rows.is_empty() {
            continue;
        }
        let decomposed = matrix.clone().svd(true, true);
        let least = RANK_TOLERANCE * decomposed.singular_values.max();
        let Ok(solution) = decomposed.solve(&ones, least) else {
            continue;
        };
        if !solution.iter().all(|coefficient| *coefficient >= 0.0) {
            continue;
        }
        let relative_error = ((matrix * &solution - &ones).norm_squared() / rows.len() as f64).sqrt();
        if relative_error < best.relative_error {
            let mut coefficients = [0.0; N];
            for (column, coefficient) in columns.iter().zip(solution.iter()) {
                coefficients[*column] = *coefficient;
            }
            best = Fit {
                coefficients,
                relative_error,
            };
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a fixed stream with these coefficients.
    fn rows(coefficients: [f64; 4]) -> Vec<([f64; 4], f64)> {
        let mut state = 1_u64;
        let mut count = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            0.1 + (state >> 40) as f64 / f64::from(1 << 24)
        };
        let row = |_| {
            let counts = [0; 4].map(|_| count());
            (counts, counts.iter().zip(coefficients).map(|(a, b)| a * b).sum())
        };
        (0..20).map(row).collect()
    }

    #[test]
    fn exact_coefficients_are_found_and_none_is_below_zero() {
        let expected = [5.0, 1.0, 0.0, 2.0];
        let found = non_negative(&rows(expected));
        // The rows' singular values span less than three powers of ten; f64 leaves more than ten digits.
        let near = |(a, b): (&f64, f64)| (a - b).abs() < 1e-9;
        assert!(found.coefficients.iter().zip(expected).all(near), "{found:?}");
        assert!(found.relative_error < 1e-9);
        let found = non_negative(&rows([5.0, 1.0, -0.3, 2.0]));
        assert!(found.coefficients.iter().all(|coefficient| *coefficient >= 0.0));
        assert!(found.relative_error > 1e-3 && found.relative_error < 0.5);
        assert_eq!(non_negative::<2>(&[]).coefficients, [0.0; 2]);
    }
}
