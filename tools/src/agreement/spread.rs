//! Error of one picture from the spread of several independent ones.
//!
//! Pictures of one estimator with seeds of their own have one expectation, so the sample variance of a value between them is an unbiased estimate
//! of its mean squared error, whatever the sampler does within a picture; no converged picture is subtracted. Weighted by
//! 1 / (reference² + ε), the same for all estimators, its mean is their relative MSE (as [`film::metrics`] has it).
//! The standard error is the jackknife's over whole pictures (Efron and Stein, *The Jackknife Estimate of Variance*, Annals of Statistics 9,
//! 1981), so pixels may depend on each other; with few pictures it is rather too large. Guarantees: deterministic, sums of f64 in the order of the pictures.
//!
//! [`film::metrics`]: clerestory::film::metrics

use clerestory::film::metrics::{RELATIVE_MSE_OFFSET, relative_mse_epsilon, relative_square};

/// The relative MSE of one picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spread {
    pub(crate) relative_mse: f64,
    pub(crate) standard_error: f64,
}

/// Fewest pictures that have a standard error.
pub(crate) const PICTURES_MIN: usize = 3;

/// Measures pictures of one size; `None` for fewer than [`PICTURES_MIN`], for none of any size and for pictures of another size than the
/// reference's.
pub(crate) fn measure(pictures: &[Vec<f32>], reference: &[f32]) -> Option<Spread> {
    if pictures.len() < PICTURES_MIN || reference.is_empty() || pictures.iter().any(|one| one.len() != reference.len())
    {
        return None;
    }
    let count = pictures.len() as f64;
    let epsilon = relative_mse_epsilon(reference.iter().copied(), RELATIVE_MSE_OFFSET);
    // Σ weight · (picture − mean)², one for each picture.
    let mut deviations = vec![0.0; pictures.len()];
    for (i, reference) in reference.iter().enumerate() {
        let values = || pictures.iter().map(|one| f64::from(one[i]));
        let mean = values().sum::<f64>() / count;
        for (sum, value) in deviations.iter_mut().zip(values()) {
            *sum += relative_square((value - mean).powi(2), f64::from(*reference), epsilon);
        }
    }
    deviations.iter_mut().for_each(|sum| *sum /= reference.len() as f64);
    let total: f64 = deviations.iter().sum();
    // Without picture k the sum of squares about the new mean is smaller by n / (n − 1) of that picture's share.
    let without = |share: &f64| (total - count / (count - 1.0) * share) / (count - 2.0);
    let left_out: Vec<f64> = deviations.iter().map(without).collect();
    let middle = left_out.iter().sum::<f64>() / count;
    let squares: f64 = left_out.iter().map(|one| (one - middle).powi(2)).sum();
    Some(Spread {
        relative_mse: total / (count - 1.0),
        standard_error: ((count - 1.0) / count * squares).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use clerestory_hard_cases::random::Random;

    use super::*;

    #[test]
    fn formulas_give_what_hand_calculation_gives() {
        // Variances 1 and 0 over references 1 and 0.
        let pictures = [vec![1.0, 5.0], vec![2.0, 5.0], vec![3.0, 5.0]];
        let spread = measure(&pictures, &[1.0, 0.0]).unwrap();
        // The reference's mean is ½.
        assert!((spread.relative_mse - 0.5 / 1.0025).abs() < 1e-14, "{spread:?}");
        // Left out in turn: variances ½, 2, ½, their mean 1: (2/3) · 1.5 = 1.
        assert!((spread.standard_error - 0.5 / 1.0025).abs() < 1e-14, "{spread:?}");
        assert_eq!(measure(&pictures[..2], &[1.0, 0.0]), None);
        assert_eq!(measure(&pictures, &[1.0]), None);
        assert_eq!(measure(&[vec![], vec![], vec![]], &[]), None);
    }

    #[test]
    fn the_mean_of_many_estimates_is_the_error_and_their_spread_the_standard_error() {
        // Four pictures of 32 values, uniform in [b − ½, b + ½]: variance 1/12. 2000 estimates.
        const ESTIMATES: usize = 2000;
        let mut random = Random(7);
        let reference: Vec<f32> = (0..32u8).map(|i| 1.0 + f32::from(i) / 32.0).collect();
        let mean = reference.iter().map(|b| f64::from(*b)).sum::<f64>() / 32.0;
        let weights = reference
            .iter()
            .map(|b| 1.0 / (f64::from(*b).powi(2) + RELATIVE_MSE_OFFSET * mean * mean));
        let expected = weights.sum::<f64>() / 32.0 / 12.0;
        let estimates: Vec<Spread> = (0..ESTIMATES)
            .map(|_| {
                let mut picture = || reference.iter().map(|b| b + random.unit() - 0.5).collect();
                let pictures: Vec<Vec<f32>> = (0..4).map(|_| picture()).collect();
                measure(&pictures, &reference).unwrap()
            })
            .collect();
        let mean = estimates.iter().map(|one| one.relative_mse).sum::<f64>() / ESTIMATES as f64;
        let squares: f64 = estimates.iter().map(|one| (one.relative_mse - mean).powi(2)).sum();
        let variance = squares / (ESTIMATES as f64 - 1.0);
        // False alarm below 1e-6: five deviations of the mean.
        let z = (mean - expected) / (variance / ESTIMATES as f64).sqrt();
        assert!(z.abs() < 5.0, "{mean} for {expected}, z {z}");
        // By Hoeffding's decomposition a sample variance of n values of variance σ² and fourth moment 1.8 σ⁴ (uniform) has the variance
        // 0.8 σ⁴/n + 2 σ⁴/(n (n − 1)), and the jackknife's expects 0.8 σ⁴/n + 4 σ⁴/(n (n − 2)): 21/11 times as much for n = 4. Both
        // sides are known within about 4 % from 2000 estimates (√(2/2000) and a relative deviation of 1 over √2000); five of that.
        let claimed = estimates.iter().map(|one| one.standard_error.powi(2)).sum::<f64>() / ESTIMATES as f64;
        let ratio = claimed / variance / (21.0 / 11.0);
        assert!((ratio - 1.0).abs() < 0.2, "{claimed} for {variance}");
    }

    #[test]
    fn correlated_samples_within_a_picture_do_not_matter() {
        // All values of a picture move together: its error is the variance of that motion, and no more is known than from one value.
        let mut random = Random(3);
        let pictures: Vec<Vec<f32>> = (0..400).map(|_| vec![1.0 + random.unit(); 50]).collect();
        let spread = measure(&pictures, &[1.0; 50]).unwrap();
        // The variance of uniform numbers from 400 of them: relative deviation √(0.8 / 400) = 4.5 %; five of them.
        assert!(
            (spread.relative_mse * 12.0 * 1.01 - 1.0).abs() < 5.0 * 0.045,
            "{spread:?}"
        );
        // Its own relative deviation is about half that of a mean of 400 fourth powers, 2.6 %.
        let relative = spread.standard_error / spread.relative_mse;
        assert!((relative / 0.045 - 1.0).abs() < 5.0 * 0.026, "{spread:?}");
    }
}
