//! Convergence slopes: the exponent p of error ∝ work^p, fitted on logarithms, with its standard error from independent repeats.
//!
//! The fit is ordinary least squares through (ln work, ln RMSE), where RMSE is the root of the mean of the repeats' MSEs: those are unbiased,
//! their logarithms and roots are not. The standard error is the delete-one jackknife over the repeats (Efron and Stein, *The Jackknife Estimate of
//! Variance*, 1981): whatever the budgets of one repeat have in common (a seed, whose samples recur in its larger budgets) is left out
//! together.
//! Guarantees: deterministic; budgets whose mean MSE is not above 0 (the reference's noise hides them) are left out and counted.

/// A fitted exponent.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Slope {
    /// The exponent: −½ for RMSE against independent samples.
    pub value: f64,
    /// Its standard error; `None` for fewer than two repeats.
    pub standard_error: Option<f64>,
    /// Budgets that were fitted.
    pub budgets: usize,
    /// Budgets left out since no error was left to see.
    pub hidden: usize,
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

/// The exponent of RMSE against work. `work[i]` is that of budget i, `mse[i][r]` the unbiased MSE of its repeat r; every budget has the same
/// repeats in the same order. `None` when fewer than two budgets can be fitted.
pub fn fit(work: &[f64], mse: &[Vec<f64>]) -> Option<Slope> {
    let repeats = mse.iter().map(Vec::len).min().unwrap_or(0);
    let points = |left_out: Option<usize>| -> Vec<(f64, f64)> {
        let point = |(work, mse): (&f64, &Vec<f64>)| {
            let kept = mse[..repeats].iter().enumerate().filter(|(r, _)| Some(*r) != left_out);
            let (sum, count) = kept.fold((0.0, 0), |(sum, count), (_, mse)| (sum + mse, count + 1));
            let mean = sum / f64::from(count.max(1));
            (mean > 0.0 && *work > 0.0).then(|| (work.ln(), 0.5 * mean.ln()))
        };
        work.iter().zip(mse).filter_map(point).collect()
    };
    let all = points(None);
    let value = least_squares(&all)?;
    let without: Option<Vec<f64>> = (0..repeats).map(|r| least_squares(&points(Some(r)))).collect();
    let standard_error = without.filter(|slopes| slopes.len() >= 2).map(|slopes| {
        let n = slopes.len() as f64;
        let mean = slopes.iter().sum::<f64>() / n;
        ((n - 1.0) / n * slopes.iter().map(|slope| (slope - mean).powi(2)).sum::<f64>()).sqrt()
    });
    Some(Slope {
        value,
        standard_error,
        budgets: all.len(),
        hidden: work.len() - all.len(),
    })
}

#[cfg(test)]
mod tests {
    use clerestory_hard_cases::random::Random;

    use super::*;

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
            let slope = fit(&WORK, &mse).unwrap();
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
            let slope = fit(&WORK, &mse).unwrap();
            let z = (slope.value + 0.5) / slope.standard_error.unwrap();
            misses += u32::from(z.abs() > 2.571);
        }
        assert!((1..=40).contains(&misses), "{misses} of 400");
    }

    #[test]
    fn a_bias_flattens_the_slope_unless_it_is_subtracted() {
        let with_reference_noise = |kept: f64| {
            let mse: Vec<Vec<f64>> = WORK.iter().map(|n| vec![1.0 / n + kept * 1e-3; 2]).collect();
            fit(&WORK, &mse).unwrap().value
        };
        assert!(with_reference_noise(1.0) > -0.47);
        assert!((with_reference_noise(0.0) + 0.5).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_fitted_is_said() {
        assert!(fit(&[4.0], &[vec![1.0]]).is_none());
        assert!(fit(&[4.0, 4.0], &[vec![1.0], vec![1.0]]).is_none());
        assert!(fit(&[], &[]).is_none());
        let one_repeat = fit(&[1.0, 4.0], &[vec![1.0], vec![0.25]]).unwrap();
        assert_eq!(one_repeat.standard_error, None);
        let hidden = fit(&[1.0, 4.0, 16.0], &[vec![1.0, 1.0], vec![0.25, 0.25], vec![-0.1, 0.05]]).unwrap();
        assert_eq!((hidden.budgets, hidden.hidden), (2, 1));
    }
}
