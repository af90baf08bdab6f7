//! Errors against a reference that is noisy itself, without that noise.
//!
//! For a picture a and a reference b of the same expectation, drawn independently, E(a − b)² = var a + var b: subtracting an unbiased
//! estimate of var b (the reference's variance layer) leaves an unbiased estimate of the picture's own MSE, so that errors fall as
//! samples^(−½) however many there are. A single estimate may come out below 0 where it is far below the reference's noise.
//! For the relative MSE the same weights 1 / (b² + ε) are applied to both terms, with the ε of [`clerestory::film::metrics`].
//! What stays is the same for all pictures against one reference: its realised squared error is not its variance. By the central limit
//! theorem its values are nearly normal, so that (b − E b)² has the variance 2 (var b)²; channels of a pixel count as fully correlated, which
//! bounds the standard error of the mean from above.
//! Guarantees: deterministic; pixels that are not finite in the picture, the reference or its variance are left out and counted. Without its worst
//! pixels a picture looks better than it is: every sweep is judged by that count first ([`super::sweep_criteria`]).

use clerestory::film::Picture;
use clerestory::film::metrics::{RELATIVE_MSE_OFFSET, relative_mse_epsilon, relative_square};
use clerestory::film::picture::VARIANCE;
use clerestory::{Error, Result};

/// Errors without the reference's noise, and that noise.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct UnbiasedError {
    /// Mean over the values of (a − b)² − var b.
    pub mse: f64,
    /// Mean of ((a − b)² − var b) / (b² + ε).
    pub relative_mse: f64,
    /// Mean of var b.
    pub reference_mse: f64,
    /// Mean of var b / (b² + ε).
    pub reference_relative_mse: f64,
    /// Standard error of `mse` by the reference's noise alone.
    pub reference_error: f64,
    /// Standard error of `relative_mse` by the reference's noise alone.
    pub reference_relative_error: f64,
    /// Pixels left out since picture, reference or variance is not finite there.
    pub skipped: u64,
}

/// The least relative MSE that has a logarithm.
const LEAST_RELATIVE_MSE: f64 = 1e-12;

/// The root of a relative MSE, and of 10⁻¹² where a single estimate comes out below that.
pub fn relative_rmse(found: &UnbiasedError) -> f64 {
    found.relative_mse.max(LEAST_RELATIVE_MSE).sqrt()
}

/// Neumaier's compensated sum is the engine's own; pictures here are small enough for pairwise halves, which err by log₂ n roundings.
fn sum(values: &[f64]) -> f64 {
    const LEAF: usize = 64;
    if values.len() <= LEAF {
        return values.iter().sum();
    }
    let (a, b) = values.split_at(values.len() / 2);
    sum(a) + sum(b)
}

/// Measures a picture against a reference with a variance layer.
///
/// # Errors
/// [`Error::Picture`] when sizes differ or the reference has no variance layer.
pub fn measure(test: &Picture, reference: &Picture) -> Result<UnbiasedError> {
    let (a, b, variance) = (
        test.main_layer()?,
        reference.main_layer()?,
        reference.require(VARIANCE)?,
    );
    if a.values().len() != b.values().len() || b.values().len() != variance.values().len() {
        return Err(Error::Picture {
            path: "comparison".into(),
            cause: "picture, reference and its variance have different sizes".into(),
        });
    }
    let mut terms: [Vec<f64>; 4] = Default::default();
    let mut pixel_squares: [Vec<f64>; 2] = Default::default();
    let mut skipped = 0;
    let epsilon = relative_mse_epsilon(b.values().iter().copied(), RELATIVE_MSE_OFFSET);
    for ((a, b), variance) in a.pixels().zip(b.pixels()).zip(variance.pixels()) {
        if a.iter().chain(&b).chain(&variance).any(|value| !value.is_finite()) {
            skipped += 1;
            continue;
        }
        let mut of_pixel = [0.0; 2];
        for channel in 0..3 {
            let [a, b, variance] = [a, b, variance].map(|pixel| f64::from(pixel[channel]));
            let error = (a - b) * (a - b);
            let of = [
                error - variance,
                relative_square(error - variance, b, epsilon),
                variance,
                relative_square(variance, b, epsilon),
            ];
            for (terms, term) in terms.iter_mut().zip(of) {
                terms.push(term);
            }
            of_pixel[0] += variance;
            of_pixel[1] += of[3];
        }
        for (squares, variance) in pixel_squares.iter_mut().zip(of_pixel) {
            squares.push(2.0 * variance * variance);
        }
    }
    let count = terms[0].len().max(1) as f64;
    let [mse, relative_mse, reference_mse, reference_relative_mse] = terms.map(|terms| sum(&terms) / count);
    let [reference_error, reference_relative_error] = pixel_squares.map(|squares| sum(&squares).sqrt() / count);
    Ok(UnbiasedError {
        mse,
        relative_mse,
        reference_mse,
        reference_relative_mse,
        reference_error,
        reference_relative_error,
        skipped,
    })
}

/// Standard error of a reference's mean by its variance layer, over that mean; 0 of a black one. Pixels are independent; channels of a pixel count as
/// fully correlated, which bounds it from above.
///
/// # Errors
/// [`Error::Picture`] when the reference has no variance layer.
pub fn error_of_mean(reference: &Picture) -> Result<f64> {
    let (b, variance) = (reference.main_layer()?, reference.require(VARIANCE)?);
    let finite = b.pixels().zip(variance.pixels()).filter(|(b, variance)| {
        let mut values = b.iter().chain(variance);
        values.all(|value| value.is_finite())
    });
    let (levels, squares): (Vec<f64>, Vec<f64>) = finite
        .map(|(b, variance)| {
            let level: f64 = b.iter().map(|value| f64::from(*value)).sum();
            let deviation: f64 = variance.iter().map(|value| f64::from(*value).max(0.0).sqrt()).sum();
            (level, deviation * deviation)
        })
        .unzip();
    let level = sum(&levels);
    Ok(if level == 0.0 {
        0.0
    } else {
        sum(&squares).sqrt() / level.abs()
    })
}

#[cfg(test)]
mod tests {
    use clerestory_hard_cases::random::Random;

    use super::*;

    #[test]
    fn formulas_give_what_hand_calculation_gives() {
        let test = Picture::from_radiance(2, 1, vec![1.0, 2.0, 3.0, 0.0, f32::NAN, 0.0]).unwrap();
        let mut reference = Picture::from_radiance(2, 1, vec![1.0, 1.0, 1.0, 0.0, 0.0, 0.0]).unwrap();
        assert!(measure(&test, &reference).is_err(), "without variance");
        reference
            .add_layer(VARIANCE, 3, vec![0.25, 0.25, 0.5, 9.0, 9.0, 9.0])
            .unwrap();
        let error = measure(&test, &reference).unwrap();
        // Errors² 0, 1, 4; the second pixel is not finite.
        assert_eq!(error.mse, (5.0 - 1.0) / 3.0);
        assert_eq!(error.reference_mse, 1.0 / 3.0);
        // The reference's mean is ½, that of all of its finite pixels.
        assert!((error.relative_mse - 4.0 / 1.0025 / 3.0).abs() < 1e-14);
        assert!((error.reference_relative_mse - 1.0 / 1.0025 / 3.0).abs() < 1e-14);
        let by_reference = 2.0f64.sqrt() / 3.0;
        assert!((error.reference_error - by_reference).abs() < 1e-15);
        assert!((error.reference_relative_error - by_reference / 1.0025).abs() < 1e-14);
        assert_eq!(error.skipped, 1);
    }

    #[test]
    fn the_error_of_a_mean_is_that_of_a_sum_of_pixels() {
        let mut reference = Picture::from_radiance(2, 1, vec![1.0, 1.0, 1.0, 3.0, 3.0, 3.0]).unwrap();
        assert!(error_of_mean(&reference).is_err(), "without variance");
        let variance = vec![0.25, 0.25, 0.25, 1.0, 1.0, 1.0];
        reference.add_layer(VARIANCE, 3, variance).unwrap();
        // Sums of pixels 3 ± 1.5 and 9 ± 3.
        assert!((error_of_mean(&reference).unwrap() - 11.25f64.sqrt() / 12.0).abs() < 1e-15);
        let mut black = Picture::from_radiance(1, 1, vec![0.0; 3]).unwrap();
        black.add_layer(VARIANCE, 3, vec![0.0; 3]).unwrap();
        assert_eq!(error_of_mean(&black).unwrap(), 0.0);
    }

    #[test]
    fn pixels_without_a_finite_variance_are_left_out_and_counted() {
        let test = Picture::from_radiance(3, 1, vec![2.0; 9]).unwrap();
        for wrong in [f32::NAN, f32::INFINITY] {
            let mut reference = Picture::from_radiance(3, 1, vec![1.0; 9]).unwrap();
            let variance = vec![0.5, 0.5, 0.5, 0.5, wrong, 0.5, 0.25, 0.25, 0.25];
            reference.add_layer(VARIANCE, 3, variance).unwrap();
            let error = measure(&test, &reference).unwrap();
            assert_eq!((error.mse, error.reference_mse, error.skipped), (0.625, 0.375, 1));
        }
    }

    #[test]
    fn the_noise_of_the_reference_leaves_the_mean() {
        // Uniform noise of variance 1/12 in the picture and 1/48 in the reference, 30,000 values. (a − b)² has a deviation of
        // about 0.11, its mean 6.4e-4: five of them is chance below 1e-6.
        let mut random = Random(1);
        let mut noise = |scale: f32| {
            (0..30_000)
                .map(|_| 5.0 + scale * (random.unit() - 0.5))
                .collect::<Vec<f32>>()
        };
        let test = Picture::from_radiance(100, 100, noise(1.0)).unwrap();
        let mut reference = Picture::from_radiance(100, 100, noise(0.5)).unwrap();
        reference.add_layer(VARIANCE, 3, vec![1.0 / 48.0; 30_000]).unwrap();
        let error = measure(&test, &reference).unwrap();
        assert!((error.mse - 1.0 / 12.0).abs() < 5.0 * 6.4e-4, "{error:?}");
        assert!(error.mse + error.reference_mse > 1.0 / 12.0 + 1.0 / 96.0);
    }
}
