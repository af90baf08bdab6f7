//! Probabilities of Student's t, and quantiles of the normal and of the Poisson distribution, as far as the z-test needs them.

use super::two_sided_p;

/// Two-sided p-value of Student's t, P(|T| ≥ |t|), or of a normal number without degrees of freedom. Source: Abramowitz and Stegun, *Handbook of
/// Mathematical Functions*, 26.7.1 and 26.5.27.
pub(super) fn student_p(t: f64, degrees: Option<f64>) -> f64 {
    match degrees {
        Some(degrees) => incomplete_beta(0.5 * degrees, 0.5, degrees / (degrees + t * t)),
        None => two_sided_p(t),
    }
}

/// The regularised incomplete beta function I_x(a, b), by the continued fraction of Abramowitz and Stegun, 26.5.8, as Lentz (1976) evaluates it.
fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return f64::from(u8::from(x >= 1.0));
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(b, a, 1.0 - x);
    }
    let front = libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b) + a * x.ln() + b * (-x).ln_1p();
    let safe = |value: f64| if value.abs() < 1e-300 { 1e-300 } else { value };
    let mut c = 1.0;
    let mut d = 1.0 / safe(1.0 - (a + b) * x / (a + 1.0));
    let mut fraction = d;
    for m in 1..1000_u32 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        let mut change = 1.0;
        for term in [even, odd] {
            d = 1.0 / safe(1.0 + term * d);
            c = safe(1.0 + term / c);
            change = c * d;
            fraction *= change;
        }
        if (change - 1.0).abs() < 1e-15 {
            break;
        }
    }
    front.exp() * fraction / a
}

/// |z| whose two-sided p-value this is.
pub(super) fn z_of(p: f64) -> f64 {
    // No p-value of f64 is left beyond it.
    let (mut near, mut far) = (0.0, 40.0);
    for _ in 0..60 {
        let middle = 0.5 * (near + far);
        if two_sided_p(middle) > p {
            near = middle;
        } else {
            far = middle;
        }
    }
    far
}

/// The least count that a Poisson number of that mean does not exceed with that probability.
pub(super) fn poisson_quantile(mean: f64, probability: f64) -> u64 {
    // Where the first term would vanish, the distribution is normal.
    if mean > 500.0 {
        return (mean + z_of(2.0 * (1.0 - probability)) * mean.sqrt()).ceil() as u64;
    }
    let mut term = (-mean).exp();
    let (mut sum, mut count) = (term, 0_u64);
    while sum < probability && term > 0.0 {
        count += 1;
        term *= mean / count as f64;
        sum += term;
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    // By sums of the probabilities exp(-m) m^k / k!.
    #[test]
    fn counts_have_the_quantiles_of_the_tables() {
        for (mean, probability, count) in [
            (0.0, 0.99, 0),
            (0.5, 0.99, 3),
            (2.0, 0.94, 4),
            (2.0, 0.95, 5),
            (10.0, 0.95, 15),
            (10.0, 0.999, 21),
        ] {
            assert_eq!(poisson_quantile(mean, probability), count, "{mean}, {probability}");
        }
        // The sum and the normal distribution meet where the one takes over from the other.
        let [below, above] = [499.9, 500.1].map(|mean| poisson_quantile(mean, 0.99));
        assert!(above.abs_diff(below) <= 3, "{below}, {above}");
    }
}
