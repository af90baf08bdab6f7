//! Do two Monte Carlo pictures have the same expectation? A z-test for every value, corrected for their number.
//!
//! The test is the one of Mitsuba 3's render tests (Subr and Arvo, *Statistical Hypothesis Testing for Assessing Monte Carlo Estimators*, 2007, is
//! the idea's source in graphics): significance level 0.01 for the whole picture, Šidák, *Rectangular Confidence Regions for the Means of Multivariate
//! Normal Distributions*, 1967, for the correction. A picture passes when at least 99.75 % of its values are accepted ([`ACCEPTED_FRACTION`]).
//! Guarantees: deterministic; values that are not finite are counted as rejected.

use super::metrics::Sum;
use crate::catalogue::{Role, Row, sources};
use crate::{Error, Result};

/// The share of accepted values with which a picture passes, as in Mitsuba 3's render tests: it leaves room for the few pixels whose rare bright
/// samples make means of few passes visibly not normal.
pub const ACCEPTED_FRACTION: f64 = 0.9975;

/// The family-wise significance level of Mitsuba 3's render tests.
pub const SIGNIFICANCE: f64 = 0.01;

/// Floor of the standard deviation of a difference, relative to the larger mean.
///
/// A pixel that sees a lamp or a mirror image of one has no noise, and two renderers still differ there by f32 rounding of some dozen
/// operations on radiance and pixel weights; without a floor any such difference would be infinitely significant. 2⁻¹⁷ (7.6e-6) is
/// 128 half-ulps of f32, and lies far below the noise of any pixel that has noise.
pub const RELATIVE_DEVIATION_FLOOR: f64 = 1.0 / 131_072.0;

/// What a z-test found.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct ZTest {
    /// Significance level of the whole family of values.
    pub alpha: f64,
    /// Number of values tested, n.
    pub tests: u64,
    /// Šidák's threshold for the p-value of one: 1 − (1 − α)^(1/n).
    pub threshold: f64,
    /// Values whose two-sided p-value reaches the threshold.
    pub accepted: u64,
    /// accepted / tests.
    pub accepted_fraction: f64,
    /// Index of the value with the largest |z| (the first not finite one, when there is one).
    pub worst: u64,
    /// Its z; NaN when it is not finite.
    pub worst_z: f64,
    /// Its two-sided p-value; 0 when it is not finite.
    pub worst_p: f64,
    /// Values that were not finite in any input.
    pub non_finite: u64,
    /// z of the sum of all differences, Σ(a − b) / √Σ(var a + var b): finds a common bias far below each value's own noise. Exact for
    /// values that are independent of each other; between the channels of one pixel they are not, so read it with a margin of √3.
    pub bias_z: f64,
    /// Its two-sided p-value.
    pub bias_p: f64,
}

impl ZTest {
    /// Whether at least [`ACCEPTED_FRACTION`] of the values were accepted.
    pub fn passes(&self) -> bool {
        self.accepted_fraction >= ACCEPTED_FRACTION
    }
}

impl std::fmt::Display for ZTest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{}: {:.4} % of {} values accepted (α = {}, p ≥ {:.3e}); worst z = {:.2} at value {}; bias z = {:.2} (p = {:.3}); {} not finite",
            if self.passes() { "same expectation" } else { "different" },
            self.accepted_fraction * 100.0,
            self.tests,
            self.alpha,
            self.threshold,
            self.worst_z,
            self.worst,
            self.bias_z,
            self.bias_p,
            self.non_finite
        )
    }
}

/// Tests value by value whether two means estimate the same expectation: z = (a − b) / √(var a + var b), where the variances are those *of the
/// means* and the root is at least [`RELATIVE_DEVIATION_FLOOR`] · max(|a|, |b|).
///
/// The values may be a picture's channels or its luminances. Their z are taken as standard normal, which needs means of many samples; a
/// variance that is itself estimated from N passes makes z follow Student's t with N − 1 degrees of freedom. At a threshold of 10⁻⁷ its tails hold 2.7
/// times as much as the normal's for N = 200, 6 times for 100, 14 times for 64, 85 times for 32: take 100 passes or more, or the variance
/// over samples. Šidák's correction is exact for independent values and errs to the safe side (fewer false alarms) for the correlated
/// channels of one pixel.
///
/// # Errors
/// [`Error::Picture`] when the slices differ in length or are empty, or `alpha` is not between 0 and 1.
pub fn z_test(
    a_mean: &[f32],
    a_var_of_mean: &[f32],
    b_mean: &[f32],
    b_var_of_mean: &[f32],
    alpha: f64,
) -> Result<ZTest> {
    let count = a_mean.len();
    let lengths = [a_var_of_mean.len(), b_mean.len(), b_var_of_mean.len()];
    if count == 0 || lengths != [count; 3] || !(alpha > 0.0 && alpha < 1.0) {
        return Err(Error::Picture {
            path: "z-test".into(),
            cause: format!(
                "needs four equally long inputs (they have {count} and {lengths:?} values) and 0 < α < 1 (it is {alpha})"
            ),
        });
    }
    let threshold = sidak_threshold(alpha, count);
    let (mut accepted, mut non_finite) = (0u64, 0u64);
    let mut worst = (0usize, 0.0f64);
    let (mut difference_sum, mut variance_sum) = (Sum::default(), Sum::default());
    for i in 0..count {
        let [a, a_var, b, b_var] = [a_mean[i], a_var_of_mean[i], b_mean[i], b_var_of_mean[i]].map(f64::from);
        if ![a, a_var, b, b_var].iter().all(|v| v.is_finite()) {
            if non_finite == 0 {
                worst = (i, f64::NAN);
            }
            non_finite += 1;
            continue;
        }
        let floor = RELATIVE_DEVIATION_FLOOR * a.abs().max(b.abs());
        let variance = (a_var.max(0.0) + b_var.max(0.0)).max(floor * floor);
        let difference = a - b;
        let z = if difference == 0.0 {
            0.0
        } else {
            difference / variance.sqrt()
        };
        if z.abs() > worst.1.abs() {
            worst = (i, z);
        }
        accepted += u64::from(two_sided_p(z) >= threshold);
        difference_sum.add(difference);
        variance_sum.add(variance);
    }
    let total = difference_sum.value();
    let bias_z = if total == 0.0 {
        0.0
    } else {
        total / variance_sum.value().sqrt()
    };
    Ok(ZTest {
        alpha,
        tests: count as u64,
        threshold,
        accepted,
        accepted_fraction: accepted as f64 / count as f64,
        worst: worst.0 as u64,
        worst_z: worst.1,
        worst_p: if worst.1.is_nan() { 0.0 } else { two_sided_p(worst.1) },
        non_finite,
        bias_z,
        bias_p: two_sided_p(bias_z),
    })
}

/// Two-sided p-value of a standard normal z: P(|Z| ≥ |z|) = erfc(|z| / √2).
pub fn two_sided_p(z: f64) -> f64 {
    libm::erfc(z.abs() * std::f64::consts::FRAC_1_SQRT_2)
}

/// 1 − (1 − α)^(1/n), without cancellation for large n.
pub fn sidak_threshold(alpha: f64, tests: usize) -> f64 {
    -((-alpha).ln_1p() / tests as f64).exp_m1()
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-ZTEST",
    name: "agreement of two pictures by z-test with Šidák's correction",
    role: Role::Service,
    limits: "Assumes normally distributed means, which fireflies prevent.",
    sources: &[sources::SUBR_ARVO_2007.whole(), sources::SIDAK_1967.whole()],
    tests: &[
        "engine/src/film/z_test.rs::false_alarms_come_at_the_stated_rate",
        "engine/src/film/z_test.rs::a_bias_of_one_per_cent_is_found",
    ],
    experiment: "clerestory agreement",
    api: &["clerestory::film::ZTest"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;

    /// Standard normal numbers by Box and Muller from a PCG-hashed counter.
    fn normal(counter: &mut u32) -> f64 {
        let mut uniform = || {
            *counter = counter.wrapping_add(1);
            let state = counter.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
            (f64::from((word >> 22) ^ word) + 0.5) / 4_294_967_296.0
        };
        (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()
    }

    #[test]
    fn p_values_are_those_of_the_tables() {
        // Abramowitz and Stegun, table 26.1 and 26.2 (10 and 5 digits).
        for (z, p) in [
            (0.0, 1.0),
            (1.0, 0.317_310_507_863),
            (1.959_963_984_540, 0.05),
            (5.0, 5.733_031_4e-7),
        ] {
            assert!((two_sided_p(z) / p - 1.0).abs() < 1e-8, "{z}");
            assert_eq!(two_sided_p(z), two_sided_p(-z));
        }
        assert!((sidak_threshold(0.01, 1) - 0.01).abs() < 1e-16);
        assert!((sidak_threshold(0.05, 2) - 0.025_320_565_519_103_6).abs() < 1e-15);
        // For many tests the threshold is −ln(1 − α)/n up to a relative 1/n.
        assert!((sidak_threshold(0.01, 1 << 30) * f64::from(1 << 30) / 0.010_050_335_853_501_4 - 1.0).abs() < 1e-8);
    }

    #[test]
    fn false_alarms_come_at_the_stated_rate() -> Result<()> {
        const PICTURES: u32 = 2000;
        const VALUES: usize = 100;
        let mut counter = 12_345;
        let mut alarms = 0;
        let (a_var, b_var) = (vec![0.04f32; VALUES], vec![0.09f32; VALUES]);
        for _ in 0..PICTURES {
            let mut draw = |deviation: f64| -> Vec<f32> {
                (0..VALUES)
                    .map(|_| (1.0 + deviation * normal(&mut counter)) as f32)
                    .collect()
            };
            let (a, b) = (draw(0.2), draw(0.3));
            alarms += u32::from(z_test(&a, &a_var, &b, &b_var, SIGNIFICANCE)?.accepted < VALUES as u64);
        }
        // Binomial(2000, 0.01): mean 20, P(outside 6 … 38) < 4e-4.
        assert!((6..=38).contains(&alarms), "{alarms} alarms in {PICTURES}");
        Ok(())
    }

    #[test]
    fn a_bias_of_one_per_cent_is_found() -> Result<()> {
        const VALUES: usize = 10_000;
        let mut counter = 99;
        let mut picture = |mean: f64, deviation: f64| -> Vec<f32> {
            (0..VALUES)
                .map(|_| (mean + deviation * normal(&mut counter)) as f32)
                .collect()
        };
        let var = |deviation: f32| vec![deviation * deviation; VALUES];
        // Noise 0.1 % in each mean: the expected z is 0.01/0.00141 = 7.07, the threshold at n = 10⁴ about 4.9; 98 % are to be rejected.
        let sharp = z_test(
            &picture(1.01, 0.001),
            &var(0.001),
            &picture(1.0, 0.001),
            &var(0.001),
            SIGNIFICANCE,
        )?;
        assert!(!sharp.passes() && sharp.accepted_fraction < 0.05, "{sharp}");
        // Noise 5 %: no single value tells (expected z 0.14), the sum over all does (expected z 14).
        let noisy = z_test(
            &picture(1.01, 0.05),
            &var(0.05),
            &picture(1.0, 0.05),
            &var(0.05),
            SIGNIFICANCE,
        )?;
        assert!(noisy.passes() && noisy.bias_z > 8.0 && noisy.bias_p < 1e-10, "{noisy}");
        // Without a bias both stay quiet; |z| > 5 has a probability of 6e-7.
        let fair = z_test(
            &picture(1.0, 0.05),
            &var(0.05),
            &picture(1.0, 0.05),
            &var(0.05),
            SIGNIFICANCE,
        )?;
        assert!(fair.passes() && fair.bias_z.abs() < 5.0, "{fair}");
        Ok(())
    }

    #[test]
    fn rounding_is_not_evidence_and_a_nan_is_never_accepted() -> Result<()> {
        let zero = [0.0f32; 3];
        let rounded = z_test(
            &[1.0, 5.0, 0.0],
            &zero,
            &[1.0 + f32::EPSILON, 5.0, 0.0],
            &zero,
            SIGNIFICANCE,
        )?;
        assert_eq!(rounded.accepted, 3);
        let planted = z_test(&[1.0, 5.0, 0.0], &zero, &[1.0, 5.01, 1e-20], &zero, SIGNIFICANCE)?;
        assert_eq!((planted.accepted, planted.worst), (1, 2));
        let nan = z_test(&[1.0, f32::NAN, 9.0], &zero, &[1.0, 1.0, 1.0], &zero, SIGNIFICANCE)?;
        assert_eq!((nan.accepted, nan.non_finite, nan.worst, nan.worst_p), (1, 1, 1, 0.0));
        assert!(z_test(&[], &[], &[], &[], 0.01).is_err() && z_test(&zero, &zero, &zero, &zero[..2], 0.01).is_err());
        assert!(z_test(&zero, &zero, &zero, &zero, 1.0).is_err());
        Ok(())
    }
}
