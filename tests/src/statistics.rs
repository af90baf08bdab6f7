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

/// The standard normal variable that lies as far out as Student's t of so many degrees of freedom (D. L. Wallace, "Bounds on normal
/// approximations to Student's and the chi-square distributions", 1959).
pub fn normal_of_t(t: f64, degrees: f64) -> f64 {
    (degrees * (t * t / degrees).ln_1p()).sqrt() * (8.0 * degrees + 1.0) / (8.0 * degrees + 3.0)
}

/// Fails when independent values of one distribution do not have the mean `expected`, itself known with the standard error `error`, at
/// [`FALSE_ALARM`]: by Student's t. A difference of at most `bias` is allowed for and has to be justified where it is stated.
pub fn expect_mean_of(what: &str, values: &[f64], expected: f64, error: f64, bias: f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n * (n - 1.0));
    let excess = ((mean - expected).abs() - bias).max(0.0);
    let t = excess / (variance + error * error).sqrt();
    println!(
        "{what}: {mean:.6} ± {:.1e}, expected {expected:.6} ± {error:.1e}, t = {t:.2}",
        variance.sqrt()
    );
    let p = if excess == 0.0 {
        1.0
    } else {
        two_sided_p(normal_of_t(t, n - 1.0))
    };
    assert!(
        p >= FALSE_ALARM,
        "{what}: {mean} ± {:.3e}, expected {expected} ± {error:.1e} (bias of at most {bias:.1e} allowed), p = {p:.3e}",
        variance.sqrt()
    );
}
