//! Models of error and cost over samples a pixel, fitted to pilot renderings.

/// Slopes that an error of sampling can have: independent samples −1, stratified ones of smooth pixels steeper.
const SLOPES: std::ops::RangeInclusive<f64> = 1.0..=1.5;
/// How much of a measured slope beyond that of independent samples is believed of samples not yet taken: stratification gains less and
/// less as what is left in a pixel is rough.
const BELIEF: f64 = 0.5;

/// What a number may exceed a whole one by and still count as that.
const HAIR: f64 = 1e-6;

/// Relative MSE over samples a pixel.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ErrorModel {
    /// Samples a pixel and relative MSE, with rising samples.
    points: Vec<(f64, f64)>,
}

impl ErrorModel {
    /// Adds a measurement with more samples than those before.
    pub fn add(&mut self, samples: u32, relative_mse: f64) {
        self.points.push((f64::from(samples), relative_mse));
    }

    /// The error falls as samples^(−slope).
    pub fn slope(&self) -> f64 {
        let [.., (n0, e0), (n1, e1)] = self.points[..] else {
            return *SLOPES.start();
        };
        let measured = if e0 > 0.0 && e1 > 0.0 {
            (e0 / e1).ln() / (n1 / n0).ln()
        } else {
            *SLOPES.start()
        };
        let measured = measured.clamp(*SLOPES.start(), *SLOPES.end());
        SLOPES.start() + BELIEF * (measured - SLOPES.start())
    }

    /// Relative MSE expected of `samples` samples a pixel: between measurements by the power law through both, beyond the last by the
    /// slope; 0 without a measurement.
    pub fn relative_mse(&self, samples: f64) -> f64 {
        for pair in self.points.windows(2) {
            let [(n0, e0), (n1, e1)] = [pair[0], pair[1]];
            if samples < n1 && e0 > 0.0 && e1 > 0.0 {
                return e0 * (e1 / e0).powf((samples / n0).ln() / (n1 / n0).ln());
            }
        }
        let Some((n, e)) = self.points.last() else { return 0.0 };
        e * (samples / n).powf(-self.slope())
    }

    /// Least number of samples a pixel for that relative MSE, at least 1 and at most `u32::MAX`.
    pub fn samples(&self, relative_mse: f64) -> u32 {
        let Some((n, e)) = self.points.last() else { return 1 };
        if *e <= 0.0 {
            return 1;
        }
        // Between measurements: where the power law through two of them meets it.
        for pair in self.points.windows(2) {
            let [(n0, e0), (n1, e1)] = [pair[0], pair[1]];
            if relative_mse >= e1 && e0 > e1 && e1 > 0.0 {
                let samples = n0 * (n1 / n0).powf((e0 / relative_mse).ln() / (e0 / e1).ln());
                return (samples - HAIR).ceil().max(1.0) as u32;
            }
        }
        let samples = n * (e / relative_mse.max(f64::MIN_POSITIVE)).powf(1.0 / self.slope());
        (samples - HAIR).ceil().clamp(1.0, f64::from(u32::MAX)) as u32
    }
}

/// Seconds over samples a pixel.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CostModel {
    /// Before and with the first sample.
    pub start: f64,
    /// For each sample a pixel.
    pub sample: f64,
}

impl CostModel {
    /// Seconds for `samples` samples a pixel.
    pub fn seconds(&self, samples: f64) -> f64 {
        self.start + self.sample * samples
    }

    /// Most samples a pixel in that time; 0 when not even one fits.
    pub fn samples(&self, seconds: f64) -> u32 {
        ((seconds - self.start) / self.sample.max(1e-12)).clamp(0.0, f64::from(u32::MAX)) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_return_what_they_were_fitted_to() {
        let mut error = ErrorModel::default();
        assert_eq!((error.samples(0.1), error.relative_mse(4.0)), (1, 0.0));
        error.add(4, 0.4);
        assert_eq!(error.samples(0.1), 16);
        error.add(16, 0.1);
        assert!((error.slope() - 1.0).abs() < 1e-12 && (error.relative_mse(64.0) - 0.025).abs() < 1e-12);
        // Steeper than independent samples: half of the surplus is believed, and no more than the steepest.
        error.add(64, 0.1 / 4_f64.powf(1.4));
        assert!((error.slope() - 1.2).abs() < 1e-12);
        // Between measurements the curve goes through both.
        let between = error.relative_mse(32.0);
        assert!(
            (between - 0.1 / 2_f64.powf(1.4)).abs() < 1e-9 && error.samples(between) == 32,
            "{between}"
        );
        assert_eq!(error.samples(0.1), 16);
        assert_eq!(error.samples(0.2), 8);
        error.add(256, 1e-9);
        assert!((error.slope() - 1.25).abs() < 1e-12);
        error.add(1024, 0.0);
        assert_eq!(error.samples(1e-3), 1);

        let cost = CostModel {
            start: 0.5,
            sample: 0.25,
        };
        assert_eq!((cost.seconds(4.0), cost.samples(1.6), cost.samples(0.1)), (1.5, 4, 0));
    }
}
