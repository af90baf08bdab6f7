//! Sizes of errors.

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
