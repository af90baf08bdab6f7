//! Do two Monte Carlo pictures have the same expectation? A z-test for every value, corrected for their number.
//!
//! The test is the one of Mitsuba 3's render tests (Subr and Arvo, *Statistical Hypothesis Testing for Assessing Monte Carlo Estimators*, 2007, is
//! the idea's source in graphics): significance level 0.01 for the whole picture, Šidák, *Rectangular Confidence Regions for the Means of Multivariate
//! Normal Distributions*, 1967, for the correction.
//!
//! Variances are estimated, of samples that may be skewed, so that z has heavier tails than a normal number. How heavy they are shows in the many
//! values that differ by little: the mean of z², none of them above 9. Student's t with the degrees of freedom that this mean fits says how many
//! values chance rejects then, and how far the worst one lies. Hence three verdicts ([`Verdict`]): pictures agree where nothing is rejected and the mean of z² is
//! that of normal numbers; they differ where more is rejected than such tails explain; between the two the test names the heavy tails and decides
//! nothing.
//!
//! False alarms, as the tests simulate them for 768 values of 64 samples: of 100 pairs that are right, with normal samples, about five are undecided by
//! either reason and less than one differs; with skewed samples against an exact picture most can be undecided, and less than one differs, as long as
//! each pixel has met its rarest light some twenty times. More values reach farther into tails than their bulk tells: of 100 pairs of 12,288 values of
//! 64 samples some fifteen are undecided where samples are normal, and two to four differ where half of them are black; with 256 samples up to one does.
//! Guarantees: deterministic; pictures with values that are not finite differ.

mod distributions;

use self::distributions::{poisson_quantile, student_p, z_of};
use super::metrics::Sum;
use crate::catalogue::{Role, Row, sources};
use crate::{Error, Result};

/// The share of accepted values that a picture whose tails are heavy needs to pass a test, as in Mitsuba 3's render tests.
pub const ACCEPTED_FRACTION: f64 = 0.9975;

/// The family-wise significance level of Mitsuba 3's render tests.
pub const SIGNIFICANCE: f64 = 0.01;

/// Floor of the standard deviation of a difference, relative to the larger mean.
///
/// A pixel that sees a lamp or a mirror image of one has no noise, and two renderers still differ there by f32 rounding of some dozen
/// operations on radiance and pixel weights; without a floor any such difference would be infinitely significant. 2⁻¹⁷ (7.6e-6) is
/// 128 half-ulps of f32, and lies far below the noise of any pixel that has noise.
pub const RELATIVE_DEVIATION_FLOOR: f64 = 1.0 / 131_072.0;

/// Largest |z| that counts in full in the mean that tails are told by: wrong values beyond it, if few, do not make tails look heavier.
const BULK_Z: f64 = 3.0;
/// Mean of min(z², 9) of standard normal numbers and its standard deviation, by quadrature.
const BULK_MEAN: f64 = 0.995_007;
const BULK_DEVIATION: f64 = 1.378_931;
/// Values of a pixel that may be one and the same.
const CHANNELS: f64 = 3.0;
/// z that normal numbers exceed once in a hundred cases, and the standard errors that the mean may be larger than found.
const ONE_IN_A_HUNDRED: f64 = 2.326;
const MARGIN: f64 = 2.0;
/// Fewest degrees of freedom that tails are believed to have: what differs as much in its bulk has no tails, but differences.
const DEGREES_MIN: f64 = 3.0;
/// From here on Student's t counts as normal.
const DEGREES_MAX: f64 = 1e4;
/// Intervals of a quadrature by Simpson's rule, an even number.
const INTERVALS: usize = 60;

/// What a z-test says of two pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// They agree: no value is rejected, and z² has the mean of normal numbers, but for what happens once in a hundred pictures.
    Same,
    /// Undecided: values are rejected or z² is too large, and the tails that its bulk shows explain it. The variances are under-estimated, as those of rare
    /// bright samples are, or many values differ by less than their noise.
    HeavyTails,
    /// They differ: by more than such tails explain, once in a hundred pictures.
    Different,
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Same => "same expectation",
            Self::HeavyTails => "undecided, heavy tails",
            Self::Different => "different",
        })
    }
}

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
    /// Mean of z² over the values that have noise: 1 for normal ones, more with heavy tails; `None` without noise.
    pub mean_squared_z: Option<f64>,
    /// The same with no z² above 9, 0.995 for normal values: what tails are told by.
    pub bulk_squared_z: Option<f64>,
    /// Degrees of freedom of the heaviest tails, by Student's t, that this is likely to come of; `None` for normal ones.
    pub degrees: Option<f64>,
    /// Pixels that may be rejected with such tails, but for one picture in a hundred. Values count as pixels of three, and as many pixels are allowed as
    /// values that are independent: up to three times what chance rejects, for tails that are heavier far out than their bulk says.
    pub rejected_most: u64,
    /// The verdict on the values.
    pub verdict: Verdict,
    /// z of the sum of all differences, Σ(a − b) / √Σ(var a + var b): finds a common bias far below each value's own noise. Exact for
    /// values that are independent of each other; between the channels of one pixel they are not, so read it with a margin of √3.
    pub bias_z: f64,
    /// Its two-sided p-value.
    pub bias_p: f64,
}

impl ZTest {
    /// Whether nothing speaks for a difference: the verdict is that they agree, or it is open and at least [`ACCEPTED_FRACTION`] of the values were
    /// accepted.
    pub fn passes(&self) -> bool {
        match self.verdict {
            Verdict::Same => true,
            Verdict::HeavyTails => self.accepted_fraction >= ACCEPTED_FRACTION,
            Verdict::Different => false,
        }
    }
}

impl std::fmt::Display for ZTest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{}: {:.4} % of {} values accepted (α = {}, p ≥ {:.3e}); mean z² = {:.3}; worst z = {:.2} at value {}; bias z = {:.2} (p = {:.3}); \
             {} not finite",
            self.verdict,
            self.accepted_fraction * 100.0,
            self.tests,
            self.alpha,
            self.threshold,
            self.mean_squared_z.unwrap_or(0.0),
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
/// The values may be a picture's channels or its luminances. Their z are rejected as if standard normal, which needs means of many samples; a
/// variance that is itself estimated from N passes makes z follow Student's t with N − 1 degrees of freedom. At a threshold of 10⁻⁷ its tails hold 2.7
/// times as much as the normal's for N = 200, 6 times for 100, 14 times for 64, 85 times for 32: take 100 passes or more, or the variance
/// over samples, or more pictures are undecided. Šidák's correction is exact for independent values and errs to the safe side (fewer false alarms) for the
/// correlated channels of one pixel. The sum of all differences has no part in the verdict: read `bias_z` beside it.
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
    let mut noisy = Vec::with_capacity(count);
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
        if a_var + b_var > floor * floor {
            noisy.push(z);
        }
        difference_sum.add(difference);
        variance_sum.add(variance);
    }
    let tails = Tails::of(&noisy);
    let expected = student_p(z_of(threshold), tails.degrees) * count as f64;
    let rejected_most = poisson_quantile(expected, 1.0 - alpha);
    let rejected = count as u64 - accepted;
    let farthest = noisy.iter().fold(0.0, |far: f64, z| far.max(z.abs()));
    let beyond = student_p(farthest, tails.degrees) < threshold;
    let pixels_rejected = (rejected as f64 / CHANNELS).ceil() as u64;
    let verdict = if non_finite > 0 || tails.is_too_large || beyond || pixels_rejected > rejected_most {
        Verdict::Different
    } else if rejected > 0 || tails.is_heavy {
        Verdict::HeavyTails
    } else {
        Verdict::Same
    };
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
        mean_squared_z: tails.mean,
        bulk_squared_z: tails.bulk,
        degrees: tails.degrees,
        rejected_most,
        verdict,
        bias_z,
        bias_p: two_sided_p(bias_z),
    })
}

/// Two-sided p-value of a standard normal z: P(|Z| ≥ |z|) = erfc(|z| / √2).
pub fn two_sided_p(z: f64) -> f64 {
    libm::erfc(z.abs() * std::f64::consts::FRAC_1_SQRT_2)
}

/// What the values that have noise say of their tails.
struct Tails {
    /// Mean of z², and with none above 9.
    mean: Option<f64>,
    bulk: Option<f64>,
    /// Degrees of freedom that the bulk fits with its margin; `None` for normal ones.
    degrees: Option<f64>,
    /// Whether the bulk is larger than that of normal values, and larger than that of any tails that are believed; each by chance once in a hundred.
    is_heavy: bool,
    is_too_large: bool,
}

impl Tails {
    fn of(noisy: &[f64]) -> Self {
        if noisy.is_empty() {
            return Self {
                mean: None,
                bulk: None,
                degrees: None,
                is_heavy: false,
                is_too_large: false,
            };
        }
        let count = noisy.len() as f64;
        let bulk = noisy.iter().map(|z| (z * z).min(BULK_Z * BULK_Z)).sum::<f64>() / count;
        let error = BULK_DEVIATION / (count / CHANNELS).sqrt();
        Self {
            mean: Some(noisy.iter().map(|z| z * z).sum::<f64>() / count),
            bulk: Some(bulk),
            degrees: degrees_of_bulk(bulk + MARGIN * error),
            is_heavy: bulk > BULK_MEAN + ONE_IN_A_HUNDRED * error,
            is_too_large: bulk > bulk_of_degrees(DEGREES_MIN) + ONE_IN_A_HUNDRED * error,
        }
    }
}

/// Mean of min(T², 9) of Student's t: ∫ 2 z P(|T| > z) dz from 0 to 3, by Simpson's rule.
fn bulk_of_degrees(degrees: f64) -> f64 {
    let step = BULK_Z / INTERVALS as f64;
    let value = |i: usize| {
        let z = i as f64 * step;
        let weight = match i {
            0 | INTERVALS => 1.0,
            odd if odd % 2 == 1 => 4.0,
            _ => 2.0,
        };
        weight * 2.0 * z * student_p(z, Some(degrees))
    };
    (0..=INTERVALS).map(value).sum::<f64>() * step / 3.0
}

/// The degrees of freedom whose mean of min(T², 9) this is, [`DEGREES_MIN`] at the least; `None` where normal numbers have as much.
fn degrees_of_bulk(bulk: f64) -> Option<f64> {
    if bulk <= bulk_of_degrees(DEGREES_MAX) {
        return None;
    }
    // By bisection of the inverse, in which the mean is nearly linear.
    let (mut light, mut heavy) = (1.0 / DEGREES_MAX, 1.0 / DEGREES_MIN);
    for _ in 0..30 {
        let middle = 0.5 * (light + heavy);
        if bulk_of_degrees(1.0 / middle) < bulk {
            light = middle;
        } else {
            heavy = middle;
        }
    }
    Some(1.0 / heavy)
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
    limits: "Does not decide where fireflies make tails heavy, and says so; a bias below the noise of single values shows in the sum alone.",
    sources: &[sources::SUBR_ARVO_2007.whole(), sources::SIDAK_1967.whole()],
    tests: &[
        "engine/src/film/z_test.rs::false_alarms_come_at_the_stated_rate",
        "engine/src/film/z_test.rs::students_t_is_that_of_the_tables",
        "engine/src/film/z_test/distributions.rs::counts_have_the_quantiles_of_the_tables",
        "engine/src/film/z_test.rs::estimated_variances_keep_the_rate_of_false_alarms",
        "engine/src/film/z_test.rs::ten_wrong_pixels_among_4096_differ",
        "engine/src/film/z_test.rs::heavy_tails_are_named_and_no_agreement",
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
    fn students_t_is_that_of_the_tables() {
        // Abramowitz and Stegun, table 26.10: percentage points, and the Cauchy distribution at 1 degree.
        for (degrees, t, p) in [
            (1.0, 1.0, 0.5),
            (3.0, 3.182, 0.05),
            (10.0, 3.169, 0.01),
            (30.0, 3.646, 0.001),
            (120.0, 1.980, 0.05),
        ] {
            assert!((student_p(t, Some(degrees)) / p - 1.0).abs() < 2e-3, "{degrees}");
            assert_eq!(student_p(t, Some(degrees)), student_p(-t, Some(degrees)));
        }
        assert_eq!(student_p(0.0, Some(5.0)), 1.0);
        assert!((student_p(4.0, Some(1e7)) / two_sided_p(4.0) - 1.0).abs() < 1e-4);
        // Normal numbers, and the way back.
        assert!((bulk_of_degrees(1e9) - BULK_MEAN).abs() < 1e-5);
        for degrees in [3.5, 8.0, 60.0] {
            let found = degrees_of_bulk(bulk_of_degrees(degrees)).unwrap_or(f64::INFINITY);
            assert!((found / degrees - 1.0).abs() < 1e-4, "{degrees}: {found}");
        }
        assert_eq!((degrees_of_bulk(0.9), degrees_of_bulk(9.0)), (None, Some(DEGREES_MIN)));
        // e^(−m) (1 + m) = 0.99 at m = 0.1486.
        assert_eq!([0.01, 0.14, 0.15].map(|mean| poisson_quantile(mean, 0.99)), [0, 1, 2]);
        assert!((two_sided_p(z_of(1e-7)) / 1e-7 - 1.0).abs() < 1e-9);
    }

    /// Means of so many samples and the variances of these means, as a film estimates them.
    fn estimated(values: usize, samples: u32, mut sample: impl FnMut() -> f64) -> [Vec<f32>; 2] {
        let count = f64::from(samples);
        let (means, variances) = (0..values)
            .map(|_| {
                let (mut sum, mut squares) = (0.0, 0.0);
                for _ in 0..samples {
                    let value = sample();
                    sum += value;
                    squares += value * value;
                }
                let mean = sum / count;
                (mean as f32, ((squares / count - mean * mean) / (count - 1.0)) as f32)
            })
            .unzip();
        [means, variances]
    }

    #[test]
    fn estimated_variances_keep_the_rate_of_false_alarms() -> Result<()> {
        const PICTURES: usize = 40;
        const VALUES: usize = 768;
        const SAMPLES: u32 = 64;
        let zero = [0.0f32; VALUES];
        let mut counter = 4_321;
        // Normal samples; those of a lamp half in shadow, which are uniform or 0; exponential ones.
        for (kind, same_least) in [(0, 33), (1, 20), (2, 0)] {
            let mut found = [0; 3];
            for _ in 0..PICTURES {
                let [mean, variance] = estimated(VALUES, SAMPLES, || {
                    let first = normal(&mut counter);
                    match kind {
                        0 => 1.0 + 0.5 * first,
                        // The share below z is uniform.
                        1 => {
                            let uniform = 1.0 - 0.5 * two_sided_p(first.abs());
                            if first > 0.0 { 8.0 * (uniform - 0.5) } else { 0.0 }
                        }
                        // The sum of two squares.
                        _ => 0.5 * (first * first + normal(&mut counter).powi(2)),
                    }
                });
                let test = z_test(&mean, &variance, &[1.0; VALUES], &zero, SIGNIFICANCE)?;
                found[test.verdict as usize] += 1;
            }
            let [same, _, different] = found;
            // Stated: one in a hundred. Binomial(40, 0.01): more than 3 in 6 of 10,000 cases.
            assert!(different <= 3, "{kind}: {found:?}");
            assert!(same >= same_least, "{kind}: {found:?}");
        }
        Ok(())
    }

    #[test]
    fn ten_wrong_pixels_among_4096_differ() -> Result<()> {
        const VALUES: usize = 3 * 4096;
        let mut counter = 777;
        let variance = vec![0.01f32; VALUES];
        let mut picture = || -> Vec<f32> { (0..VALUES).map(|_| (1.0 + 0.1 * normal(&mut counter)) as f32).collect() };
        let mut found = [0; 3];
        for _ in 0..10 {
            let test = z_test(&picture(), &variance, &picture(), &variance, SIGNIFICANCE)?;
            found[test.verdict as usize] += 1;
        }
        // Binomial(10, 0.02) exceeds 2 in one of a thousand cases.
        assert!(
            found[Verdict::Same as usize] >= 8 && found[Verdict::Different as usize] == 0,
            "{found:?}"
        );
        let (mut a, b) = (picture(), picture());
        // Each some seven standard deviations of the difference above the rest, in all channels; all but 0.244 % of the values are accepted.
        for pixel in 0..10 {
            for value in &mut a[1200 * pixel..1200 * pixel + 3] {
                *value = 1.0 + 7.0 * 0.02_f32.sqrt();
            }
        }
        let test = z_test(&a, &variance, &b, &variance, SIGNIFICANCE)?;
        assert!(test.accepted_fraction >= ACCEPTED_FRACTION, "{test}");
        assert!(test.verdict == Verdict::Different && !test.passes(), "{test}");
        Ok(())
    }

    #[test]
    fn heavy_tails_are_named_and_no_agreement() -> Result<()> {
        const VALUES: usize = 3 * 1024;
        let mut counter = 31;
        let (one, zero) = (vec![1.0f32; VALUES], vec![0.0f32; VALUES]);
        // Student's t with 8 degrees of freedom: a mean z² of 4/3.
        for _ in 0..10 {
            let z: Vec<f32> = (0..VALUES)
                .map(|_| {
                    let squares: f64 = (0..8).map(|_| normal(&mut counter).powi(2)).sum();
                    (normal(&mut counter) / (squares / 8.0).sqrt()) as f32
                })
                .collect();
            let test = z_test(&z, &one, &zero, &zero, SIGNIFICANCE)?;
            assert_eq!(test.verdict, Verdict::HeavyTails, "{test}");
            assert!(test.degrees.is_some_and(|degrees| degrees < 10.0), "{test:?}");
            let text = test.to_string();
            assert!(
                text.starts_with("undecided, heavy tails") && text.contains("mean z² = 1."),
                "{text}"
            );
        }
        // Many differences of one and a half standard deviations are no tails; and what is not finite is no agreement.
        let shifted: Vec<f32> = (0..VALUES).map(|_| (normal(&mut counter) + 1.5) as f32).collect();
        assert_eq!(
            z_test(&shifted, &one, &zero, &zero, SIGNIFICANCE)?.verdict,
            Verdict::Different
        );
        let mut broken = zero.clone();
        broken[7] = f32::NAN;
        assert_eq!(
            z_test(&broken, &one, &zero, &zero, SIGNIFICANCE)?.verdict,
            Verdict::Different
        );
        // One pixel at z = 5.2, as three rejected values: neither agreement nor difference.
        let mut three: Vec<f32> = (0..VALUES).map(|_| normal(&mut counter) as f32).collect();
        three[300..303].fill(-5.2);
        let test = z_test(&three, &one, &zero, &zero, SIGNIFICANCE)?;
        assert!(
            test.verdict != Verdict::Same && test.passes() == (test.verdict == Verdict::HeavyTails),
            "{test}"
        );
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
