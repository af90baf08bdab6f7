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

    /// The error that a share of all does not exceed; 0 without any.
    pub fn quantile(&mut self, share: f64) -> f64 {
        self.sizes.sort_by(f64::total_cmp);
        let last = self.sizes.len().saturating_sub(1);
        let at = (share * last as f64).ceil() as usize;
        self.sizes.get(at.min(last)).copied().unwrap_or(0.0)
    }

    /// The largest; 0 without any.
    pub fn worst(&mut self) -> f64 {
        self.quantile(1.0)
    }

    /// Their mean; 0 without any.
    pub fn mean(&self) -> f64 {
        self.sizes.iter().sum::<f64>() / self.sizes.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_of_sizes_and_not_a_number_is_the_worst() {
        let mut errors = Errors::default();
        assert_eq!(errors.worst(), 0.0);
        (0..=100).rev().for_each(|i| errors.add(-f64::from(i)));
        assert_eq!(
            (errors.quantile(0.5), errors.worst(), errors.mean()),
            (50.0, 100.0, 50.0)
        );
        errors.add(f64::NAN);
        assert_eq!(errors.worst(), f64::INFINITY);
    }
}
