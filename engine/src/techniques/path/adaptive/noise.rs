//! How noisy pixels are, by the pilot samples of others: what their further samples are shared out by.
//!
//! A pixel's samples must not steer their own weight: the mean and the spread of skewed samples are correlated, so that a mean of pilot and further samples whose
//! numbers follow from the pilot's own spread is too dark. Pixels are two classes, as the fields of a chessboard; the noise of a pixel is found from pixels of
//! the other class around it alone, and so is the level that noise is relative to. Given the samples of the other class, the numbers of samples of
//! a class are constants: every pixel's mean is unbiased, pilot included.

use rayon::prelude::*;

use super::super::settings::Adaptive;
use crate::Result;
use crate::film::Picture;
use crate::film::metrics::{RELATIVE_MSE_OFFSET, relative_mse_epsilon, relative_square};
use crate::film::picture::{SAMPLES, VARIANCE};

/// Pixels to either side whose noise is averaged, at first and where that is the noise of a few: a lone bright sample says little of what further ones will do.
const REACHES: [i64; 3] = [2, 4, 8];
/// Pixels that must have a part in an average, (Σv)² ∕ Σv², unless the neighbourhood is the widest: the standard error of the noise is then below a fifth.
const PIXELS_MIN: f64 = 8.0;

/// The class of a pixel: the colour of its field on a chessboard.
pub(super) fn class_of(pixel: usize, width: usize) -> usize {
    (pixel % width + pixel / width) % 2
}

/// Of each pixel: the variance of one sample of its own, summed over the channels, each relative to the square of its mean and of its class's mean, or absolute; 0 for
/// those of fewer than two samples.
///
/// # Errors
/// [`Error::Picture`](crate::Error::Picture) for a picture that is no film's.
pub(super) fn variances(picture: &Picture, kind: Adaptive) -> Result<Vec<f64>> {
    let (radiance, of_means) = (picture.main_layer()?.values(), picture.require(VARIANCE)?.values());
    let (samples, width) = (picture.require(SAMPLES)?.values(), picture.width() as usize);
    let epsilons = [0, 1].map(|class| {
        let of_class = radiance.chunks_exact(3).enumerate();
        let of_class = of_class.filter(|(pixel, _)| class_of(*pixel, width) == class);
        let values = of_class.flat_map(|(_, rgb)| rgb.iter().copied());
        relative_mse_epsilon(values, RELATIVE_MSE_OFFSET)
    });
    let variance = |pixel: usize| -> f64 {
        let of_channel = |channel: usize| {
            let value = |values: &[f32]| f64::from(values[3 * pixel + channel]);
            let variance = value(of_means) * f64::from(samples[pixel]);
            match kind {
                Adaptive::Absolute => variance,
                _ => relative_square(variance, value(radiance), epsilons[class_of(pixel, width)]),
            }
        };
        let sum: f64 = (0..3).map(of_channel).sum();
        if sum.is_finite() { sum } else { 0.0 }
    };
    Ok((0..samples.len()).map(variance).collect())
}

/// Of each pixel: the standard deviation of a sample by the variances of pixels of the other class around it; 0 where there are none. Deterministic,
/// whatever the number of threads.
pub(super) fn noise_of_neighbours(variances: &[f64], width: usize) -> Vec<f32> {
    let height = variances.len() / width.max(1);
    let of_pixel = |pixel: usize| {
        let (x, y) = ((pixel % width) as i64, (pixel / width) as i64);
        let mut variance = 0.0;
        for reach in REACHES {
            let (mut count, mut sum, mut squares) = (0_u32, 0.0, 0.0);
            for row in (y - reach).max(0)..=(y + reach).min(height as i64 - 1) {
                // The other class: every other pixel of the row.
                let first = x - reach + (reach + row - y + 1).rem_euclid(2);
                for column in (first..=x + reach).step_by(2) {
                    if (0..width as i64).contains(&column) {
                        let value = variances[row as usize * width + column as usize];
                        (count, sum, squares) = (count + 1, sum + value, squares + value * value);
                    }
                }
            }
            variance = sum / f64::from(count.max(1));
            if sum * sum >= PIXELS_MIN * squares && count > 0 {
                break;
            }
        }
        variance.sqrt() as f32
    };
    (0..variances.len()).into_par_iter().map(of_pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    #[test]
    fn the_noise_of_a_pixel_is_that_of_the_other_class() {
        let (width, height) = (23, 19);
        let mut random = Random(3);
        let mut variances: Vec<f64> = (0..width * height).map(|_| f64::from(random.unit())).collect();
        for class in [0, 1] {
            let before = noise_of_neighbours(&variances, width);
            for (pixel, variance) in variances.iter_mut().enumerate() {
                if class_of(pixel, width) == class {
                    *variance = f64::from(random.unit()) * 1e3;
                }
            }
            let after = noise_of_neighbours(&variances, width);
            for pixel in 0..width * height {
                let same = before[pixel].to_bits() == after[pixel].to_bits();
                assert_eq!(same, class_of(pixel, width) == class, "{pixel}");
            }
        }
    }

    #[test]
    fn neighbourhoods_are_as_wide_as_few_pixels_have_the_noise() {
        let (width, height) = (41, 41);
        let at = |x: usize, y: usize| y * width + x;
        // Even noise: that of the nearest twelve.
        let even = noise_of_neighbours(&vec![4.0; width * height], width);
        assert!(even.iter().all(|noise| *noise == 2.0));
        // A lone bright sample is spread over the widest neighbourhood, of 144 of the other class.
        let mut lone = vec![0.0; width * height];
        lone[at(20, 20)] = 144.0;
        let lone = noise_of_neighbours(&lone, width);
        assert_eq!(lone[at(20, 21)], 1.0);
        assert_eq!((lone[at(21, 21)], lone[at(20, 29)]), (0.0, 0.0));
        // An edge between quiet and noise is met at the pixel.
        let half: Vec<f64> = (0..width * height)
            .map(|i| if i % width < 20 { 0.0 } else { 1.0 })
            .collect();
        let half = noise_of_neighbours(&half, width);
        assert_eq!((half[at(10, 20)], half[at(25, 20)]), (0.0, 1.0));
        assert_eq!(noise_of_neighbours(&[9.0], 1), [0.0]);
        assert_eq!(noise_of_neighbours(&[9.0, 4.0], 1), [2.0, 3.0]);
    }
}
