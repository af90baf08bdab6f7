//! Pearson's chi-square statistic of counts, for statistical tests. Its distribution: E. B. Wilson and M. M. Hilferty, "The Distribution of
//! Chi-Square", Proceedings of the National Academy of Sciences 17, 1931.
//!
//! The integration tests and the measures include this file as a module of theirs.

/// Cells that expect fewer counts are pooled, as the distribution of few counts is not chi-square's.
const LEAST_EXPECTED: f64 = 5.0;

/// The statistic of counts against expected ones, with its degrees of freedom; infinite for a count where nothing is expected. `None` for
/// fewer than two cells that expect five counts.
pub fn chi_square(observed: &[f64], expected: &[f64]) -> Option<(f64, usize)> {
    assert_eq!(observed.len(), expected.len());
    let (mut statistic, mut cells) = (0.0, 0);
    let (mut pool_observed, mut pool_expected) = (0.0, 0.0);
    for (&o, &e) in observed.iter().zip(expected) {
        if e <= 0.0 && o > 0.0 {
            return Some((f64::INFINITY, 1));
        }
        if e < LEAST_EXPECTED {
            pool_observed += o;
            pool_expected += e;
        } else {
            statistic += (o - e) * (o - e) / e;
            cells += 1;
        }
    }
    if pool_expected >= LEAST_EXPECTED {
        statistic += (pool_observed - pool_expected).powi(2) / pool_expected;
        cells += 1;
    }
    (cells >= 2).then(|| (statistic, cells - 1))
}

/// How many standard deviations a chi-square statistic lies above its mean, by the normal approximation of its cube root.
pub fn chi_square_z(statistic: f64, degrees: usize) -> f64 {
    let k = degrees as f64;
    let step = 2.0 / (9.0 * k);
    ((statistic / k).cbrt() - (1.0 - step)) / step.sqrt()
}
