//! Convergence slopes: the exponent p of error ∝ work^p, fitted on logarithms, with its standard error from independent repeats.
//!
//! The fit is ordinary least squares through (ln work, ln RMSE), where RMSE is the root of the mean of the repeats' MSEs: those are unbiased,
//! their logarithms and roots are not. The standard error is the jackknife over the repeats ([`super::jackknife`]), and what the reference's noise,
//! which all budgets share, changes in the fit.
//! Near the noise only fluctuations upwards have a logarithm, and a fit through those is too flat. A budget counts where its mean MSE is
//! above [`SIGNIFICANT`] standard errors of it: those of the repeats and of the reference's noise, which all repeats share. The budgets that
//! count are chosen once and serve every replicate of the jackknife.
//! Guarantees: deterministic; budgets that do not count are left out and counted. A replicate's mean MSE is at least the full mean less one
//! standard error, so that what counts has a logarithm in every replicate.

use super::jackknife::{self, mean_without};

/// How many standard errors above 0 a budget's mean MSE must lie.
pub const SIGNIFICANT: f64 = 3.0;

/// A fitted exponent.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Slope {
    /// The exponent: −½ for RMSE against independent samples.
    pub value: f64,
    /// Its standard error, by the repeats and by the reference's noise; `None` for fewer than two repeats.
    pub standard_error: Option<f64>,
    /// Budgets that were fitted.
    pub budgets: usize,
    /// Budgets left out since their error does not stand out from the noise.
    pub hidden: usize,
    /// Repeats of every budget: the standard error has one degree of freedom fewer.
    pub repeats: usize,
}

/// Ordinary least squares slope of y on x; `None` for fewer than two different x.
pub fn least_squares(points: &[(f64, f64)]) -> Option<f64> {
    let n = points.len() as f64;
    let mean_x = points.iter().map(|(x, _)| x).sum::<f64>() / n;
    let mean_y = points.iter().map(|(_, y)| y).sum::<f64>() / n;
    let xx: f64 = points.iter().map(|(x, _)| (x - mean_x).powi(2)).sum();
    let xy: f64 = points.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    (points.len() >= 2 && xx > 0.0).then(|| xy / xx)
}

/// The mean of repeats' MSEs and its standard error, of which the reference's noise has `reference_error`; that by a single repeat is not known and
/// counts as 0.
fn mean_and_error(mse: &[f64], reference_error: f64) -> (f64, f64) {
    let without: Vec<f64> = (0..mse.len()).map(|repeat| mean_without(mse, Some(repeat))).collect();
    let by_repeats = jackknife::standard_error(&without).unwrap_or(0.0);
    (mean_without(mse, None), by_repeats.hypot(reference_error))
}

/// Whether the mean of repeats' MSEs is above [`SIGNIFICANT`] standard errors of it, of which the reference's noise has `reference_error`.
pub fn stands_out(mse: &[f64], reference_error: f64) -> bool {
    let (mean, error) = mean_and_error(mse, reference_error);
    mean > 0.0 && mean > SIGNIFICANT * error
}

/// The most that an MSE may be: [`SIGNIFICANT`] standard errors above the mean of its repeats, where that is above 0, else above 0.
pub fn at_most(mse: &[f64], reference_error: f64) -> f64 {
    let (mean, error) = mean_and_error(mse, reference_error);
    mean.max(0.0) + SIGNIFICANT * error
}

/// A fitted exponent with those without each of the repeats.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Of all repeats.
    pub value: f64,
    /// Without each of them; what cannot be fitted is not a number.
    pub without: Vec<f64>,
    /// What one standard error of the reference's noise, which raises all budgets' MSEs together, changes in it.
    pub by_reference: f64,
    /// Budgets that were fitted.
    pub budgets: usize,
    /// Budgets left out since their error does not stand out from the noise.
    pub hidden: usize,
}

impl Fit {
    /// The exponent of RMSE against work. `work[i]` is that of budget i, `mse[i][r]` the unbiased MSE of its repeat r; every budget has the same
    /// repeats in the same order. `reference_error` is the standard error of any of them by the reference's noise. `None` when fewer than two budgets
    /// can be fitted.
    pub fn of(work: &[f64], mse: &[Vec<f64>], reference_error: f64) -> Option<Self> {
        let repeats = mse.iter().map(Vec::len).min().unwrap_or(0);
        let counting: Vec<(f64, &[f64])> = work
            .iter()
            .zip(mse)
            .map(|(work, mse)| (*work, &mse[..repeats]))
            .filter(|(work, mse)| *work > 0.0 && stands_out(mse, reference_error))
            .collect();
        let slope_without = |left_out: Option<usize>| {
            let point = |(work, mse): &(f64, &[f64])| (work.ln(), 0.5 * mean_without(mse, left_out).ln());
            least_squares(&counting.iter().map(point).collect::<Vec<_>>())
        };
        // The fit is linear in the logarithms: their derivatives with respect to what is added to all MSEs have the slope's.
        let derivative = |(work, mse): &(f64, &[f64])| (work.ln(), 0.5 / mean_without(mse, None));
        let derivatives: Vec<(f64, f64)> = counting.iter().map(derivative).collect();
        Some(Self {
            value: slope_without(None)?,
            by_reference: reference_error * least_squares(&derivatives)?,
            without: (0..repeats)
                .map(|repeat| slope_without(Some(repeat)).unwrap_or(f64::NAN))
                .collect(),
            budgets: counting.len(),
            hidden: work.len() - counting.len(),
        })
    }

    /// With its standard error.
    pub fn slope(&self) -> Slope {
        Slope {
            value: self.value,
            standard_error: jackknife::standard_error(&self.without).map(|error| error.hypot(self.by_reference)),
            budgets: self.budgets,
            hidden: self.hidden,
            repeats: self.without.len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use clerestory_hard_cases::random::Random;

    use super::*;

    fn fit(work: &[f64], mse: &[Vec<f64>], reference_error: f64) -> Option<Slope> {
        Fit::of(work, mse, reference_error).map(|fit| fit.slope())
    }

    const WORK: [f64; 5] = [4.0, 16.0, 64.0, 256.0, 1024.0];

    /// A standard normal number by Box and Muller, of uniform ones of 24 bits.
    fn normal(random: &mut Random) -> f64 {
        let (u, v) = (1.0 - f64::from(random.unit()), f64::from(random.unit()));
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    #[test]
    fn exact_power_laws_are_recovered() {
        for exponent in [-0.5, -0.75, -1.0] {
            let mse: Vec<Vec<f64>> = WORK.iter().map(|n| vec![3.0 * n.powf(2.0 * exponent); 4]).collect();
            let slope = fit(&WORK, &mse, 0.0).unwrap();
            assert!((slope.value - exponent).abs() < 1e-12, "{slope:?}");
            assert!(slope.standard_error.unwrap() < 1e-12);
            assert_eq!((slope.budgets, slope.hidden), (5, 0));
        }
    }

    #[test]
    fn the_standard_error_covers_the_truth_as_often_as_it_should() {
        // 400 experiments of 6 repeats with 10 % noise in every MSE. |z| ≤ 2.571 (Student's t, 5 degrees of freedom) covers 95 %; the count of misses
        // is binomial with mean 20 and deviation 4.4, and the jackknife of six is only nearly Student's. Beyond 20 ± 4.5 · 4.4 is chance below 1e-5.
        let mut random = Random(7);
        let mut misses = 0;
        for _ in 0..400 {
            let mse: Vec<Vec<f64>> = WORK
                .iter()
                .map(|n| (0..6).map(|_| (1.0 + 0.1 * normal(&mut random)) / n).collect())
                .collect();
            let slope = fit(&WORK, &mse, 0.0).unwrap();
            let z = (slope.value + 0.5) / slope.standard_error.unwrap();
            misses += u32::from(z.abs() > 2.571);
        }
        assert!((1..=40).contains(&misses), "{misses} of 400");
    }

    #[test]
    fn a_bias_flattens_the_slope_unless_it_is_subtracted() {
        let with_reference_noise = |kept: f64| {
            let mse: Vec<Vec<f64>> = WORK.iter().map(|n| vec![1.0 / n + kept * 1e-3; 2]).collect();
            fit(&WORK, &mse, 0.0).unwrap().value
        };
        assert!(with_reference_noise(1.0) > -0.47);
        assert!((with_reference_noise(0.0) + 0.5).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_fitted_is_said() {
        assert!(fit(&[4.0], &[vec![1.0]], 0.0).is_none());
        assert!(fit(&[4.0, 4.0], &[vec![1.0], vec![1.0]], 0.0).is_none());
        assert!(fit(&[], &[], 0.0).is_none());
        let one_repeat = fit(&[1.0, 4.0], &[vec![1.0], vec![0.25]], 0.0).unwrap();
        assert_eq!(one_repeat.standard_error, None);
        let hidden = fit(
            &[1.0, 4.0, 16.0],
            &[vec![1.0, 1.0], vec![0.25, 0.25], vec![-0.1, 0.05]],
            0.0,
        )
        .unwrap();
        assert_eq!((hidden.budgets, hidden.hidden), (2, 1));
    }

    #[test]
    fn every_replicate_fits_the_same_budgets() {
        // The last budget's mean is above 0, without its first repeat it is below.
        let mse = [vec![1.0; 4], vec![0.25; 4], vec![0.06, -0.01, -0.01, -0.01]];
        let slope = fit(&[1.0, 4.0, 16.0], &mse, 0.0).unwrap();
        assert_eq!((slope.budgets, slope.hidden, slope.repeats), (2, 1, 4));
        assert!((slope.value + 0.5).abs() < 1e-12 && slope.standard_error.unwrap() < 1e-12);
        // One that counts by little does so in every replicate.
        let mse = [vec![1.0; 3], vec![0.25; 3], vec![0.02, 0.07, 0.07]];
        let slope = fit(&[1.0, 4.0, 16.0], &mse, 0.0).unwrap();
        assert_eq!((slope.budgets, slope.hidden), (3, 0));
        assert!(slope.standard_error.unwrap().is_finite());
        // The reference's noise hides what its repeats agree on.
        assert_eq!(fit(&[1.0, 4.0, 16.0], &mse, 0.1).map(|slope| slope.hidden), None);
        assert_eq!(fit(&[1.0, 4.0, 16.0], &mse, 0.05).map(|slope| slope.hidden), Some(1));
    }

    #[test]
    fn the_noise_of_the_reference_is_part_of_the_standard_error() {
        // Slope ½ (ln b − ln a) / ln 4, of which an addition to both changes ½ (1 / b − 1 / a) / ln 4.
        let found = fit(&[1.0, 4.0], &[vec![1.0; 3], vec![0.25; 3]], 0.01).unwrap();
        let expected = 0.5 * (4.0 - 1.0) * 0.01 / 4.0f64.ln();
        assert!((found.standard_error.unwrap() - expected).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn what_is_lost_has_an_end_above() {
        // Two values that differ by 0.2 have a standard error of 0.1.
        assert!((at_most(&[0.0, 0.2], 0.0) - 0.4).abs() < 1e-12);
        assert!((at_most(&[-0.3, -0.1], 0.0) - 0.3).abs() < 1e-12);
        assert!((at_most(&[0.0, 0.0], 0.1) - 0.3).abs() < 1e-12);
    }

    #[test]
    fn slopes_do_not_flatten_near_the_noise_of_the_reference() {
        // The reference's noise, one number for all pictures of an experiment, has a deviation of 1/250: the budgets' MSEs are 62, 16, 4, 1 and
        // 1/4 of it. Each picture has 5 % of its own. The third budget, at 4 deviations, counts where the noise is above −1, which is 0.29 on
        // average: 0.5 · 0.29 / 4 in the logarithm, times its leverage of 1 / (2 ln 4), is 0.013. The deviation of one experiment's slope is below
        // 0.06, that of the mean of 1000 below 0.002: beyond 0.025 is chance below 1e-8.
        let (noise, mut state) = (1.0 / 250.0, Random(11));
        // Where the reference's noise is not known, the last budget counts in every other experiment, whenever the noise lifts it: those slopes are
        // flat by far more than the tolerance. Known, it takes a noise of 2.75 deviations: 3 in 1000, and 20 is chance below 1e-9.
        let mut sum = 0.0;
        let mut lifted = 0;
        let mut lifted_unknown = Vec::new();
        for _ in 0..1000 {
            let shared = noise * normal(&mut state);
            let mse: Vec<Vec<f64>> = WORK
                .iter()
                .map(|n| (0..4).map(|_| (1.0 + 0.05 * normal(&mut state)) / n + shared).collect())
                .collect();
            let (known, unknown) = (fit(&WORK, &mse, noise).unwrap(), fit(&WORK, &mse, 0.0).unwrap());
            sum += known.value;
            lifted += u32::from(known.hidden == 0);
            lifted_unknown.extend((unknown.hidden == 0).then_some(unknown.value));
        }
        let bias = sum / 1000.0 + 0.5;
        assert!(bias.abs() < 0.025, "{bias}");
        assert!(lifted < 20, "{lifted}");
        let flattened = lifted_unknown.iter().sum::<f64>() / lifted_unknown.len() as f64 + 0.5;
        assert!(
            lifted_unknown.len() > 500 && flattened > 0.05,
            "{} of 1000, {flattened}",
            lifted_unknown.len()
        );
    }
}
