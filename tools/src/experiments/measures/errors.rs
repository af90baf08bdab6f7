//! Sizes of errors, and shares with what chance makes of them.

use crate::experiments::findings::Measured;

/// Standard errors of an interval that holds 95 % of normal numbers.
pub const ERRORS: f64 = 1.96;

/// Error magnitudes, gathered one by one.
#[derive(Debug, Default)]
pub struct Errors {
    sizes: Vec<f64>,
}

impl Errors {
    /// Adds the size of an error; what is no number counts as infinite.
    pub fn add(&mut self, error: f64) {
        self.sizes
            .push(if error.is_nan() { f64::INFINITY } else { error.abs() });
    }

    /// The error that a share of all does not exceed; not a number without any.
    pub fn quantile(&mut self, share: f64) -> f64 {
        self.sizes.sort_by(f64::total_cmp);
        let last = self.sizes.len().saturating_sub(1);
        let at = (share * last as f64).ceil() as usize;
        self.sizes.get(at.min(last)).copied().unwrap_or(f64::NAN)
    }

    /// The largest; not a number without any.
    pub fn worst(&mut self) -> f64 {
        self.quantile(1.0)
    }

    /// Their mean; not a number without any.
    pub fn mean(&self) -> f64 {
        self.sizes.iter().sum::<f64>() / self.sizes.len() as f64
    }
}

/// The greatest of some values; not a number where one of them is none, and without any.
pub fn greatest(values: impl IntoIterator<Item = f64>) -> f64 {
    let greater = |a: f64, b: f64| if a.is_nan() || a > b { a } else { b };
    values.into_iter().reduce(greater).unwrap_or(f64::NAN)
}

/// The mean of independent numbers, and its standard error by their spread; the latter is not a number of a single one.
pub fn mean_with_error(values: &[f64]) -> [f64; 2] {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    [mean, (squares / (count * (count - 1.0))).sqrt()]
}

/// The logarithm of a share of so many independent draws, and its variance by chance. Half a draw more on either side leaves one without any that is
/// wrong a logarithm, and takes nearly all bias off the others'. Source: J. J. Gart and J. R. Zweifel, *On the Bias of Various Estimators of the
/// Logit and its Variance*, Biometrika 1967.
pub fn log_of_share(share: f64, draws: u64) -> [f64; 2] {
    let (count, draws) = (share * draws as f64 + 0.5, draws as f64 + 0.5);
    [(count / draws).ln(), 1.0 / count - 1.0 / draws]
}

/// The geometric mean of ratios of shares of equally many independent draws, in its interval of 95 % by chance; not a number of none.
pub fn mean_ratio_of_shares(pairs: impl IntoIterator<Item = ([f64; 2], u64)>) -> Measured {
    let (mut sum, mut variance, mut count) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (shares, draws) in pairs {
        let [[own, of_own], [other, of_other]] = shares.map(|share| log_of_share(share, draws));
        sum += own - other;
        variance += of_own + of_other;
        count += 1.0;
    }
    let (mean, margin) = (sum / count, ERRORS * variance.sqrt() / count);
    Measured {
        value: mean.exp(),
        low: (mean - margin).exp(),
        high: (mean + margin).exp(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_of_sizes_and_not_a_number_is_the_worst() {
        let mut errors = Errors::default();
        assert!([errors.worst(), errors.mean()].iter().all(|error| error.is_nan()));
        (0..=100).rev().for_each(|i| errors.add(-f64::from(i)));
        assert_eq!(
            (errors.quantile(0.5), errors.worst(), errors.mean()),
            (50.0, 100.0, 50.0)
        );
        errors.add(f64::NAN);
        assert_eq!(errors.worst(), f64::INFINITY);
    }

    #[test]
    fn ratios_of_shares_are_as_certain_as_their_counts() {
        // Counts of 100 each: √(1/100 + 1/100) is 14 %.
        let alike = mean_ratio_of_shares([([1e-3, 1e-3], 100_000)]);
        assert!((alike.value - 1.0).abs() < 1e-12);
        assert!(((alike.high / alike.low).ln() - 2.0 * 1.96 * 0.02f64.sqrt()).abs() < 0.01);
        // Four times the draws halve the interval, and so do four pairs.
        let width = |found: Measured| (found.high / found.low).ln();
        let draws = width(mean_ratio_of_shares([([1e-3, 1e-3], 400_000)]));
        let pairs = width(mean_ratio_of_shares([([1e-3, 1e-3], 100_000); 4]));
        assert!((draws - pairs).abs() < 0.01 && (2.0 * draws - width(alike)).abs() < 0.01);
        // Without any that is wrong, there is a wide interval.
        let none = mean_ratio_of_shares([([0.0, 0.0], 1000)]);
        assert!(none.value == 1.0 && none.high > 10.0, "{none:?}");
        assert!(mean_ratio_of_shares([([0.5, f64::NAN], 1000)]).value.is_nan());
        assert!(mean_ratio_of_shares([]).value.is_nan());
    }

    #[test]
    fn errors_of_means_are_those_of_their_spread() {
        let [mean, error] = mean_with_error(&[1.0, 2.0, 3.0, 4.0]);
        // Four numbers with the variance 5/3.
        assert!((mean - 2.5).abs() < 1e-12 && (error - (5.0f64 / 12.0).sqrt()).abs() < 1e-12);
        assert!(mean_with_error(&[1.0])[1].is_nan());
    }

    #[test]
    fn what_is_no_number_is_the_greatest() {
        assert_eq!(greatest([-2.0, -1.0, -3.0]), -1.0);
        for values in [
            &[][..],
            &[f64::NAN, 1.0],
            &[1.0, f64::NAN],
            &[1.0, f64::NAN, f64::INFINITY],
        ] {
            assert!(greatest(values.iter().copied()).is_nan(), "{values:?}");
        }
    }
}
