//! The error of a picture without a reference: what two independent renderings of one view say of each other.
//!
//! Half the squared difference of two independent, equally distributed pixels is an unbiased estimate of their variance, whatever the
//! samples within each are like (stratified samples of one pixel are not independent, so their own spread says nothing). The relative
//! error also needs the true radiance, for which the product of the two stands: it is unbiased for its square. Where noise hides a
//! pixel, that square is taken from its neighbourhood.

use crate::film::metrics::{relative_mse_epsilon, relative_square};
use crate::film::picture::{Picture, VARIANCE};
use crate::{Error, Result};

/// Pixels to each side of the neighbourhoods, the widest first; the last is the pixel alone.
const REACHES: [usize; 3] = [8, 2, 0];
/// Standard deviation, relative to the square of the radiance, at which a neighbourhood is believed half.
const TRUST: f64 = 0.05;

/// How the square of a pixel's true radiance is found.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Truth {
    /// From its neighbourhood where noise hides it: whatever is bright in one picture alone is rare light that pixels around may get, too.
    Neighbourhood,
    /// No less than the square of both pictures' mean: what is bright in one picture alone belongs to the pixel. So it is where light that
    /// is scattered diffusely comes from kernels, and only what the eye sees by way of mirrors is sampled.
    Pixel,
}

/// ε of what is relative to two pictures of one view: `offset` of the square of their mean.
pub(super) fn epsilon_of_pair(a: &Picture, b: &Picture, offset: f64) -> Result<f64> {
    let values = a.main_layer()?.values().iter().chain(b.main_layer()?.values());
    Ok(relative_mse_epsilon(values.copied(), offset))
}

/// Relative mean squared error of either of two pictures: the mean of variance ∕ (radiance² + ε) over pixels and channels, as
/// [`ErrorReport::relative_mse`](crate::film::ErrorReport) against a perfect reference would give it. ε is `offset` of the square of the mean radiance.
///
/// # Errors
/// [`Error::Setting`] when the sizes differ; [`Error::Picture`] without radiance.
pub fn relative_mse_of_pair(a: &Picture, b: &Picture, offset: f64) -> Result<f64> {
    noise_of_pair(a, b, offset, Truth::Neighbourhood)
}

/// As [`relative_mse_of_pair`], relative to that truth.
pub(super) fn noise_of_pair(a: &Picture, b: &Picture, offset: f64, kind: Truth) -> Result<f64> {
    same_size(a, b)?;
    let epsilon = epsilon_of_pair(a, b, offset)?;
    let (mut sum, mut count) = (0.0, 0_usize);
    for channel in 0..3 {
        let (variances, mut truth) = channel_of_pair(a, b, channel, TRUST)?;
        if kind == Truth::Pixel {
            let values = a.main_layer()?.values().iter().zip(b.main_layer()?.values());
            for (truth, (a, b)) in truth.iter_mut().zip(values.skip(channel).step_by(3)) {
                let mean = (f64::from(*a) + f64::from(*b)) / 2.0;
                *truth = truth.max(mean * mean);
            }
        }
        let terms = variances.iter().zip(&truth);
        sum += terms.map(|(v, t)| relative_square(*v, t.sqrt(), epsilon)).sum::<f64>();
        count += variances.len();
    }
    Ok(sum / count.max(1) as f64)
}

/// Refuses two pictures that cannot be compared.
pub(super) fn same_size(a: &Picture, b: &Picture) -> Result<()> {
    let (width, height) = (a.width(), a.height());
    if (b.width(), b.height()) == (width, height) {
        return Ok(());
    }
    let size = format!("{width} × {height}");
    Err(Error::setting("pair of pictures", size, "have different sizes"))
}

/// Of each pixel of a channel: the variance of either picture, and the square of its true radiance, as far as the two know them. `trust` is the
/// standard deviation, relative to the square of the radiance, at which a neighbourhood is believed half.
pub(super) fn channel_of_pair(a: &Picture, b: &Picture, channel: usize, trust: f64) -> Result<(Vec<f64>, Vec<f64>)> {
    let (width, height) = (a.width() as usize, a.height() as usize);
    let (a, b) = (a.main_layer()?.values(), b.main_layer()?.values());
    let pair = |i: usize| {
        let (a, b) = (f64::from(a[i * 3 + channel]), f64::from(b[i * 3 + channel]));
        // A pixel without a finite sample says nothing.
        if a.is_finite() && b.is_finite() {
            (a, b)
        } else {
            (0.0, 0.0)
        }
    };
    let squares: Vec<f64> = (0..width * height).map(pair).map(|(a, b)| a * b).collect();
    let variances: Vec<f64> = (0..width * height)
        .map(pair)
        .map(|(a, b)| (a - b) * (a - b) / 2.0)
        .collect();
    let mut truth = vec![0.0; width * height];
    for reach in REACHES {
        let (near_squares, near_variances) = (blurred(&squares, width, reach), blurred(&variances, width, reach));
        let count = ((2 * reach + 1) * (2 * reach + 1)) as f64;
        for (truth, (square, variance)) in truth.iter_mut().zip(near_squares.iter().zip(&near_variances)) {
            // A narrower neighbourhood only where there is little noise: a large difference makes the product small, and the two
            // must not meet in one quotient.
            let (signal, noise) = (square.max(0.0) * trust, variance / count.sqrt());
            let all = signal * signal + noise * noise;
            let trust = if all > 0.0 && reach != REACHES[0] {
                signal * signal / all
            } else {
                1.0
            };
            *truth += trust * (square.max(0.0) - *truth);
        }
    }
    Ok((variances, truth))
}

/// Relative mean squared error that the `variance` layer of a picture stands for: what independent samples of that spread would have.
/// Samples that are stratified within a pixel have less. The offset is that of [`relative_mse_of_pair`].
///
/// # Errors
/// [`Error::Picture`] without radiance or variance.
pub fn relative_mse_by_variance(picture: &Picture, offset: f64) -> Result<f64> {
    let radiance = picture.main_layer()?.values();
    let variance = picture.require(VARIANCE)?.values();
    let epsilon = relative_mse_epsilon(radiance.iter().copied(), offset);
    let each = radiance.iter().zip(variance).map(|(radiance, variance)| {
        let (radiance, variance) = (f64::from(*radiance), f64::from(*variance));
        // The square of a noisy mean is too large by its variance.
        relative_square(variance, (radiance * radiance - variance).max(0.0).sqrt(), epsilon)
    });
    Ok(each.sum::<f64>() / radiance.len().max(1) as f64)
}

/// Means over the square neighbourhood of each pixel, as far as it lies in the picture.
fn blurred(values: &[f64], width: usize, reach: usize) -> Vec<f64> {
    let height = values.len() / width.max(1);
    let along = |count: usize, at: usize| at.saturating_sub(reach)..(at + reach + 1).min(count);
    let rows: Vec<f64> = (0..values.len())
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let range = along(width, x);
            let count = range.len() as f64;
            range.map(|x| values[y * width + x]).sum::<f64>() / count
        })
        .collect();
    (0..values.len())
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let range = along(height, y);
            let count = range.len() as f64;
            range.map(|y| rows[y * width + x]).sum::<f64>() / count
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    /// A picture of 64 × 64 pixels whose left half is dim, with noise of the given relative deviation.
    fn noisy(deviation: f64, random: &mut Random) -> Picture {
        let values = (0..64 * 64 * 3).map(|i| {
            let truth = if (i / 3) % 64 < 32 { 0.2 } else { 2.0 };
            // Sum of twelve uniform numbers: nearly normal, variance 1.
            let normal = (0..12).map(|_| f64::from(random.unit())).sum::<f64>() - 6.0;
            (truth * (1.0 + deviation * normal)) as f32
        });
        Picture::from_radiance(64, 64, values.collect()).unwrap()
    }

    #[test]
    fn a_lone_bright_pixel_is_rare_light_or_its_own() {
        let mut values = vec![0.5; 32 * 32 * 3];
        let b = Picture::from_radiance(32, 32, values.clone()).unwrap();
        values[3 * 500] = 400.0;
        let a = Picture::from_radiance(32, 32, values).unwrap();
        let of = |kind| noise_of_pair(&a, &b, 0.01, kind).unwrap() * 3.0 * 1024.0;
        // 400² ∕ 2 over some radiance near 0.5, or over 200². The mean is 0.56.
        assert!(of(Truth::Neighbourhood) > 1e4, "{}", of(Truth::Neighbourhood));
        assert!((of(Truth::Pixel) - 2.0).abs() < 0.02, "{}", of(Truth::Pixel));
    }

    #[test]
    fn pairs_know_their_error() {
        let mut random = Random(7);
        for deviation in [0.01, 0.1, 0.5, 1.0] {
            let (a, b) = (noisy(deviation, &mut random), noisy(deviation, &mut random));
            // The mean of both halves is 1.1.
            let share = |radiance: f64| radiance * radiance / (radiance * radiance + 0.0121);
            let expected = 0.5 * deviation * deviation * (share(0.2) + share(2.0));
            let found = relative_mse_of_pair(&a, &b, 0.01).unwrap();
            // Noise of the estimate: √(2 ∕ 12288) = 1.3 %; the trust in noisy pixels costs the rest.
            let allowed = if deviation > 0.3 { 0.25 } else { 0.08 };
            assert!(
                (found / expected - 1.0).abs() < allowed,
                "{deviation}: {found} for {expected}"
            );
        }
        // Of lamps a thousand times dimmer or brighter the same pictures have the same error.
        let (a, b) = (noisy(0.3, &mut random), noisy(0.3, &mut random));
        let of = |unit: f32| {
            let [a, b] = [&a, &b].map(|picture| {
                let values = picture.main_layer().unwrap().values().iter().map(|value| value * unit);
                Picture::from_radiance(64, 64, values.collect()).unwrap()
            });
            relative_mse_of_pair(&a, &b, 0.01).unwrap()
        };
        for unit in [1e-3, 1e3] {
            assert!((of(unit) / of(1.0) - 1.0).abs() < 1e-5, "{unit}");
        }
        let black = Picture::from_radiance(8, 8, vec![0.0; 192]).unwrap();
        assert_eq!(relative_mse_of_pair(&black, &black, 0.01).unwrap(), 0.0);
    }
}
