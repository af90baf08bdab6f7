//! Statistical acceptance with stated false-alarm rates. Seeds are fixed, so a test that passes on a driver goes on passing there.

use clerestory::film::z_test::two_sided_p;
use clerestory_hard_cases::chi_square::{chi_square, chi_square_z};

/// False-alarm rate of one statistical check, for a seed and driver that were never seen before.
pub const FALSE_ALARM: f64 = 1e-6;

/// Upper tail probability of a chi-square statistic, by the normal approximation of Wilson and Hilferty (1931).
pub fn chi_square_p(statistic: f64, degrees: usize) -> f64 {
    let z = chi_square_z(statistic, degrees);
    let tail = 0.5 * two_sided_p(z);
    if z > 0.0 { tail } else { 1.0 - tail }
}

/// p-value of counts against expected counts. Cells that expect fewer than five are pooled; a count where nothing is expected is an
/// error at once (p = 0). Panics on fewer than two cells.
pub fn chi_square_test(observed: &[f64], expected: &[f64]) -> f64 {
    match chi_square(observed, expected) {
        Some((statistic, degrees)) => chi_square_p(statistic, degrees),
        None => panic!("a chi-square test needs two cells that expect five counts"),
    }
}

/// Fails when counts do not follow their expectation at [`FALSE_ALARM`].
pub fn expect_counts(what: &str, observed: &[f64], expected: &[f64]) {
    let p = chi_square_test(observed, expected);
    assert!(p >= FALSE_ALARM, "{what}: chi-square p = {p:.3e}");
}

/// Fails when `mean` of a variance `variance` (of the mean) does not have the expectation `expected` at [`FALSE_ALARM`]; a difference of
/// at most `bias` is allowed for and has to be justified where it is stated.
pub fn expect_mean(what: &str, mean: f64, variance: f64, expected: f64, bias: f64) {
    let excess = ((mean - expected).abs() - bias).max(0.0);
    let p = if excess == 0.0 {
        1.0
    } else {
        two_sided_p(excess / variance.sqrt())
    };
    assert!(
        p >= FALSE_ALARM,
        "{what}: {mean} ± {:.3e}, expected {expected} (bias of at most {bias:.1e} allowed), p = {p:.3e}",
        variance.sqrt()
    );
}
