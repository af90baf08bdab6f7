//! The error of a picture without a reference: what two independent renderings of one view say of each other.
//!
//! Half the squared difference of two independent, equally distributed pixels is an unbiased estimate of their variance, whatever the
//! samples within each are like (stratified samples of one pixel are not independent, so their own spread says nothing). The relative
//! error also needs the true radiance, which each pair has from the other pairs of its view, since chance that makes a pixel's difference large
//! makes its own product small. Each pixel is drawn toward the mean around it by as much as noise outweighs what really differs there, which the two
//! halves of those pairs tell apart: what both see is there, however small and bright; what one sees is noise. A pixel that is darker in them than its
//! neighbours, but differs by more in the pair itself than in them, has light that they have missed: it is drawn toward the mean by that noise. The few
//! greatest terms count as the next one, unless the radiance of all pairs together bears them out: one pixel that the others know nothing of, such as the edge
//! of a small lamp, would else be all of the error.
//!
//! A lone pair has itself alone: the product of both pictures is unbiased for the square of the radiance, and where noise hides a pixel, that square is
//! taken from its neighbourhood, by the median of the means over nine blocks: what is bright in fewer than five of them, such as a lamp, does not hide
//! the relative noise of what is dark around it.
//!
//! Errors of a third per pixel are found to 10 % by four pairs on 96² pixels or more. On 32² pixels they are up to 15 % off, and by a lone pair up to
//! a third too low.

use super::tiles::Tiles;
use crate::film::metrics::{relative_mse_epsilon, relative_square};
use crate::film::picture::{Picture, VARIANCE};
use crate::{Error, Result};

/// Pixels to each side of the square whose mean a pixel of other pairs is drawn to.
const SHRINK_REACH: usize = 2;
/// Rank of the term that those above it count as, where nothing bears them out.
const BOUND_RANK: usize = 3;
/// Relative standard error of a pair's relative MSE by what the others do not know of the truth, for each unit of the relative MSE of their mean.
const UNKNOWN_TRUTH: f64 = 0.1;
/// Pixels to each side of a block of the widest neighbourhood, and from the middle of one to that of the next: nine lie in a square of 19 × 19 pixels.
const BLOCK_REACH: usize = 3;
const BLOCK_STEP: usize = 6;
/// Pixels to each side of the narrower neighbourhoods, the widest first; the last is the pixel alone.
const REACHES: [usize; 3] = [2, 1, 0];
/// Standard deviation, relative to the square of the radiance, at which a neighbourhood is believed half.
const TRUST: f64 = 0.05;

/// How the square of a pixel's true radiance is found.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Truth {
    /// Its neighbourhood counts where noise hides it: whatever is bright in one picture alone is rare light that pixels around may get, too.
    Neighbourhood,
    /// No less than the square of both pictures' mean: what is bright in one picture alone belongs to the pixel. So it is where light that
    /// is scattered diffusely comes from kernels, and only what the eye sees by way of mirrors is sampled. Neighbouring pixels share their noise.
    Pixel,
}

/// A relative MSE of pilots, and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NoiseEstimate {
    pub relative_mse: f64,
    /// Standard error.
    pub deviation: f64,
}

/// Two independent pictures of so many samples per pixel.
pub(super) type Pair<'a> = (u32, [&'a Picture; 2]);

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
    let found = noise_of_pairs(&[(1, [a, b])], offset, Truth::Neighbourhood)?;
    Ok(found.first().map_or(0.0, |found| found.relative_mse))
}

/// As [`relative_mse_of_pair`], of each of several pairs of one technique and view, each relative to the truth that the others show.
pub(super) fn noise_of_pairs(pairs: &[Pair<'_>], offset: f64, kind: Truth) -> Result<Vec<NoiseEstimate>> {
    let Some((_, [first, _])) = pairs.first() else {
        return Ok(Vec::new());
    };
    for (_, pair) in pairs {
        for picture in pair {
            same_size(first, picture)?;
        }
    }
    let (width, height) = (first.width() as usize, first.height() as usize);
    let pixels = width * height;
    let all = means_of_halves(pairs, pixels)?;
    let epsilon = relative_mse_epsilon(all.iter().flatten().flatten().map(|value| *value as f32), offset);
    // One truth for all, or one of the others for each.
    let shared = (kind == Truth::Pixel || pairs.len() == 1).then(|| levels_of_pair(&all, width, kind));
    let mean_of = |[a, b]: &[Vec<f64>; 2]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect() };
    let means: Vec<Vec<f64>> = all.iter().map(mean_of).collect();
    let estimate = |at: usize| -> Result<NoiseEstimate> {
        let (spp, pair) = pairs[at];
        if let Some(levels) = &shared {
            return noise_of_pair(pair, levels, None, epsilon, kind);
        }
        let others = [&pairs[..at], &pairs[at + 1..]].concat();
        let of_others: f64 = others.iter().map(|(spp, _)| f64::from(*spp)).sum();
        let (halves, own) = (
            means_of_halves(&others, pixels)?,
            means_of_halves(&pairs[at..=at], pixels)?,
        );
        let levels: Vec<_> = halves
            .iter()
            .zip(&own)
            .map(|(others, own)| shrunk(others, own, f64::from(spp) / of_others, width))
            .collect();
        let greater = |(levels, means): (&Vec<f64>, &Vec<f64>)| -> Vec<f64> {
            levels.iter().zip(means).map(|(level, mean)| level.max(*mean)).collect()
        };
        let borne_out: Vec<Vec<f64>> = levels.iter().zip(&means).map(greater).collect();
        let found = noise_of_pair(pair, &levels, Some(&borne_out), epsilon, kind)?;
        // Of the mean of both halves of the others, as independent samples have it.
        let noise_of_others = found.relative_mse * f64::from(spp) / (2.0 * of_others);
        let by_truth = UNKNOWN_TRUTH * noise_of_others * found.relative_mse;
        Ok(NoiseEstimate {
            deviation: found.deviation.hypot(by_truth),
            ..found
        })
    };
    (0..pairs.len()).map(estimate).collect()
}

/// Of each channel: the means of all first pictures and of all second ones.
fn means_of_halves(pairs: &[Pair<'_>], pixels: usize) -> Result<Vec<[Vec<f64>; 2]>> {
    (0..3).map(|channel| pooled(pairs, channel, pixels)).collect()
}

/// Of each channel: the true radiance of each pixel, as far as a pair knows it whose own noise is related to it.
fn levels_of_pair(halves: &[[Vec<f64>; 2]], width: usize, kind: Truth) -> Vec<Vec<f64>> {
    let of_channel = |[a, b]: &[Vec<f64>; 2]| {
        let mut truth = truth(a, b, width, TRUST);
        if kind == Truth::Pixel {
            for (truth, (a, b)) in truth.iter_mut().zip(a.iter().zip(b)) {
                *truth = truth.max(0.25 * (a + b) * (a + b));
            }
        }
        truth.into_iter().map(f64::sqrt).collect()
    };
    halves.iter().map(of_channel).collect()
}

/// The relative MSE of either picture of a pair, relative to the true radiance by channel and pixel. Pixels that are not finite are left out. The greatest
/// terms are bounded where other levels are given that they would have to be borne out by.
fn noise_of_pair(
    [a, b]: [&Picture; 2],
    levels: &[Vec<f64>],
    borne_out: Option<&[Vec<f64>]>,
    epsilon: f64,
    kind: Truth,
) -> Result<NoiseEstimate> {
    let (width, height) = (a.width() as usize, a.height() as usize);
    let (a, b) = (a.main_layer()?.values(), b.main_layer()?.values());
    let term = |pixel: usize, levels: &[Vec<f64>]| {
        levels.iter().enumerate().try_fold(0.0, |sum, (channel, levels)| {
            let (a, b) = finite(a[pixel * 3 + channel], b[pixel * 3 + channel])?;
            Some(sum + relative_square((a - b) * (a - b) / 2.0, levels[pixel], epsilon))
        })
    };
    let mut terms: Vec<(usize, f64)> = (0..width * height)
        .filter_map(|pixel| Some((pixel, term(pixel, levels)?)))
        .collect();
    if let Some(borne_out) = borne_out {
        let mut sorted: Vec<f64> = terms.iter().map(|(_, term)| *term).collect();
        sorted.sort_by(|a, b| b.total_cmp(a));
        let bound = sorted.get(BOUND_RANK - 1).copied().unwrap_or(f64::INFINITY);
        for (pixel, value) in terms.iter_mut().filter(|(_, term)| *term > bound) {
            *value = term(*pixel, borne_out).unwrap_or(0.0).max(bound);
        }
    }
    let mut tiles = Tiles::new(width, height);
    let mut squares = 0.0_f64;
    for (pixel, term) in &terms {
        squares += term * term;
        tiles.add(*pixel, term / 3.0);
    }
    let (relative_mse, by_tiles) = tiles.mean();
    Ok(NoiseEstimate {
        relative_mse,
        deviation: match kind {
            // Var x ≤ E x² for each pixel, whose channels count as one.
            Truth::Neighbourhood => squares.sqrt() / (3 * terms.len().max(1)) as f64,
            Truth::Pixel => by_tiles,
        },
    })
}

/// Both values of a pixel; a pixel without a finite sample says nothing.
fn finite(a: f32, b: f32) -> Option<(f64, f64)> {
    (a.is_finite() && b.is_finite()).then_some((a.into(), b.into()))
}

/// Means of all first pictures and of all second ones in a channel, by their samples; 0 where none is finite.
fn pooled(pairs: &[Pair<'_>], channel: usize, pixels: usize) -> Result<[Vec<f64>; 2]> {
    let mut sums = [vec![0.0; pixels], vec![0.0; pixels]];
    let mut weights = vec![0.0; pixels];
    for (spp, [a, b]) in pairs {
        let (a, b) = (a.main_layer()?.values(), b.main_layer()?.values());
        let spp = f64::from(*spp);
        for (pixel, weight) in weights.iter_mut().enumerate() {
            if let Some((a, b)) = finite(a[pixel * 3 + channel], b[pixel * 3 + channel]) {
                sums[0][pixel] += spp * a;
                sums[1][pixel] += spp * b;
                *weight += spp;
            }
        }
    }
    for sum in &mut sums {
        for (sum, weight) in sum.iter_mut().zip(&weights) {
            *sum = if *weight > 0.0 { *sum / weight } else { 0.0 };
        }
    }
    Ok(sums)
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

/// Of each pixel of a channel: the square of its true radiance, as far as two pictures know it. `trust` is the standard deviation, relative to the square
/// of the radiance, at which a neighbourhood is believed half.
pub(super) fn truth_of_pair(a: &Picture, b: &Picture, channel: usize, trust: f64) -> Result<Vec<f64>> {
    let pixels = a.width() as usize * a.height() as usize;
    let [first, second] = pooled(&[(1, [a, b])], channel, pixels)?;
    Ok(truth(&first, &second, a.width() as usize, trust))
}

/// Of each pixel of a channel: its true radiance by two halves of `others` that have no noise in common with the pair `own`, which has `share` of their
/// samples. The local linear estimate of least squared error (Lee 1980, "Digital image enhancement and noise filtering by use of local statistics"):
/// the covariance of both halves around the pixel is the variance of the truth, half their squared difference that of either half. Where the pair shows
/// more noise than they do, that counts, if it makes the pixel brighter: what is rare is seldom seen by them, and then dark.
fn shrunk([a, b]: &[Vec<f64>; 2], own: &[Vec<f64>; 2], share: f64, width: usize) -> Vec<f64> {
    let of_both = |of: fn(f64, f64) -> f64| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| of(*a, *b)).collect() };
    let near = |values: &[f64]| blurred(values, width, SHRINK_REACH);
    let (near_a, near_b) = (near(a), near(b));
    let (products, squares) = (near(&of_both(|a, b| a * b)), near(&of_both(|a, b| (a - b) * (a - b))));
    (0..a.len())
        .map(|i| {
            let (mean, around) = (0.5 * (a[i] + b[i]), 0.5 * (near_a[i] + near_b[i]));
            let truth = (products[i] - near_a[i] * near_b[i]).max(0.0);
            let drawn_by = |noise: f64| {
                let belief = if noise > 0.0 { truth / (truth + noise) } else { 1.0 };
                around + belief * (mean - around)
            };
            // Variances of the mean of both halves.
            let noise = 0.25 * squares[i];
            let difference = own[0][i] - own[1][i];
            let noise_of_own = 0.25 * share * difference * difference;
            drawn_by(noise).max(drawn_by(noise.max(noise_of_own)))
        })
        .collect()
}

/// As [`truth_of_pair`], of values.
fn truth(a: &[f64], b: &[f64], width: usize, trust: f64) -> Vec<f64> {
    let near = |reach: usize| -> Vec<f64> {
        let means = blurred(a, width, reach).into_iter().zip(blurred(b, width, reach));
        means.map(|(a, b)| (a * b).max(0.0)).collect()
    };
    let variances: Vec<f64> = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b) / 2.0).collect();
    let mut truth = medians(&near(BLOCK_REACH), width);
    for reach in REACHES {
        let (squares, variances) = (near(reach), blurred(&variances, width, reach));
        let count = (2 * reach + 1) as f64;
        for (truth, (square, variance)) in truth.iter_mut().zip(squares.iter().zip(&variances)) {
            // A narrower neighbourhood only where there is little noise: a large difference makes the product small, and the two
            // must not meet in one quotient.
            let (signal, noise) = (square * trust, variance / (count * count));
            let all = signal * signal + noise * noise;
            let trust = if all > 0.0 { signal * signal / all } else { 1.0 };
            *truth += trust * (square - *truth);
        }
    }
    truth
}

/// Of each pixel: the median over the blocks around it.
fn medians(means: &[f64], width: usize) -> Vec<f64> {
    let height = means.len() / width.max(1);
    let steps = |at: usize, count: usize| {
        let last = count.saturating_sub(1);
        [at.saturating_sub(BLOCK_STEP), at, (at + BLOCK_STEP).min(last)]
    };
    let median = |i: usize| {
        let (xs, ys) = (steps(i % width, width), steps(i / width, height));
        let mut blocks: [f64; 9] = std::array::from_fn(|k| means[ys[k / 3] * width + xs[k % 3]]);
        blocks.sort_by(f64::total_cmp);
        blocks[4]
    };
    (0..means.len()).map(median).collect()
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
        let of = |kind| noise_of_pairs(&[(1, [&a, &b])], 0.01, kind).unwrap()[0].relative_mse * 3.0 * 1024.0;
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

    /// A dark room of noisy pixels, with a bright square of a fifth of its side that has no noise.
    fn with_a_lamp(side: usize, samples: u32, random: &mut Random) -> Picture {
        let lamp = side / 3..side / 3 + side / 5;
        let values = (0..side * side * 3).map(|i| {
            let (x, y) = (i / 3 % side, i / 3 / side);
            if lamp.contains(&x) && lamp.contains(&y) {
                return 17.0;
            }
            // Means of samples that are uniform in 0 … 2, times a radiance that varies by three.
            let radiance = 0.1 + 0.2 * x as f32 / side as f32;
            let sum: f32 = (0..samples).map(|_| 2.0 * random.unit()).sum();
            radiance * sum / samples as f32
        });
        Picture::from_radiance(side as u32, side as u32, values.collect()).unwrap()
    }

    // The truth of dark pixels is their own, not the lamp's: with that of a mean over 17 × 17 pixels the root was found half as large at 16 × 16.
    #[test]
    fn a_bright_square_does_not_hide_the_noise_of_dark_pixels() {
        let mut random = Random(21);
        for (side, samples) in [(16, 2), (16, 16), (32, 4), (48, 2), (48, 16)] {
            let found: f64 = (0..8)
                .map(|_| {
                    let (a, b) = (
                        with_a_lamp(side, samples, &mut random),
                        with_a_lamp(side, samples, &mut random),
                    );
                    relative_mse_of_pair(&a, &b, 0.01).unwrap()
                })
                .sum();
            // A sample has a relative variance of a third.
            let lamp = side / 3..side / 3 + side / 5;
            let (mut mean, mut expected) = (0.0_f64, 0.0_f64);
            let pixels = (side * side) as f64;
            let is_lamp = |i: usize| lamp.contains(&(i % side)) && lamp.contains(&(i / side));
            let radiance = |i: usize| 0.1 + 0.2 * (i % side) as f64 / side as f64;
            for i in 0..side * side {
                let level = if is_lamp(i) { 17.0 } else { radiance(i) };
                mean += level / pixels;
            }
            for i in (0..side * side).filter(|i| !is_lamp(*i)) {
                let square = radiance(i) * radiance(i);
                expected += square / (square + 0.01 * mean * mean) / (3.0 * f64::from(samples)) / pixels;
            }
            // Pixels beside the square still lose: 9 % at most, of the smallest picture. The spread of eight pairs adds 2 %.
            let ratio = (found / 8.0 / expected).sqrt();
            assert!((0.85..1.15).contains(&ratio), "{side}, {samples}: {ratio}");
        }
    }

    /// Two pictures of each number of samples.
    fn pairs_of<'a>(pictures: &'a [[Picture; 2]], budgets: &[u32]) -> Vec<Pair<'a>> {
        let both = pictures.iter().zip(budgets);
        both.map(|([a, b], spp)| (*spp, [a, b])).collect()
    }

    /// A dark room of 64 × 64 pixels with bright dots of one pixel, one in 16, whose light is met by one sample in four.
    fn with_dots(samples: u32, random: &mut Random) -> Picture {
        let values = (0..64 * 64 * 3).map(|i| {
            let (x, y) = (i / 3 % 64, i / 3 / 64);
            let is_dot = x % 4 == 0 && y % 4 == 0;
            let mean = |random: &mut Random, of: fn(f32) -> f32| {
                (0..samples).map(|_| of(random.unit())).sum::<f32>() / samples as f32
            };
            if is_dot {
                2.0 * mean(random, |unit| if unit < 0.25 { 4.0 } else { 0.0 })
            } else {
                0.1 * mean(random, |unit| 2.0 * unit)
            }
        });
        Picture::from_radiance(64, 64, values.collect()).unwrap()
    }

    // The truth of dots that noise hides is theirs, not that of the dark around them.
    #[test]
    fn bright_dots_are_related_to_their_own_radiance() {
        let mut random = Random(29);
        let budgets = [4, 16, 64];
        let pictures = budgets.map(|samples| [(); 2].map(|()| with_dots(samples, &mut random)));
        let pairs = pairs_of(&pictures, &budgets);
        let found = noise_of_pairs(&pairs, 0.01, Truth::Neighbourhood).unwrap();
        let mean = (2.0 + 15.0 * 0.1) / 16.0;
        // Relative variances of a sample: 3 of a dot, a third elsewhere.
        let term = |radiance: f64, variance: f64| {
            let square = radiance * radiance;
            variance * square / (square + 0.01 * mean * mean)
        };
        let of_sample = (term(2.0, 3.0) + 15.0 * term(0.1, 1.0 / 3.0)) / 16.0;
        for (found, spp) in found.iter().zip(budgets) {
            let ratio = (found.relative_mse / of_sample * f64::from(spp)).sqrt();
            assert!((0.85..1.15).contains(&ratio), "{spp}: {ratio}");
        }
    }

    // A pixel that one picture of the last pair alone sees, 300 times as bright as all else: relative to what the others show there, its noise would be
    // two thousand times all other.
    #[test]
    fn one_pixel_that_the_others_have_missed_is_not_all_of_the_error() {
        let mut random = Random(31);
        let budgets = [4, 64];
        let pictures = budgets.map(|samples| {
            [0, 1].map(|which| {
                let values = (0..64 * 64 * 3).map(|i| {
                    let sum: f32 = (0..samples).map(|_| 2.0 * random.unit()).sum();
                    let is_met = i / 3 == 2000 && samples == 64 && which == 0;
                    sum / samples as f32 + if is_met { 300.0 } else { 0.0 }
                });
                Picture::from_radiance(64, 64, values.collect()).unwrap()
            })
        });
        let pairs = pairs_of(&pictures, &budgets);
        let found = noise_of_pairs(&pairs, 0.01, Truth::Neighbourhood).unwrap()[1].relative_mse;
        // A third of a sample's square, by 64; the dot is worth 8 at most of 4096.
        let (without, dot) = (1.0 / 3.0 / 64.0, 8.0 / 4096.0);
        assert!((0.9 * without..1.1 * without + dot).contains(&found), "{found}");
    }

    // One truth for all pairs: their errors stand to each other as their samples do, whatever is not known of the truth.
    #[test]
    fn pairs_of_one_view_keep_the_ratio_of_their_errors() {
        let mut random = Random(23);
        let pictures: Vec<[Picture; 2]> = [2, 8, 32]
            .iter()
            .map(|samples| [(); 2].map(|()| with_a_lamp(32, *samples, &mut random)))
            .collect();
        let pairs = pairs_of(&pictures, &[2, 8, 32]);
        let found = noise_of_pairs(&pairs, 0.01, Truth::Neighbourhood).unwrap();
        for pair in found.windows(2) {
            let ratio = pair[0].relative_mse / pair[1].relative_mse;
            let deviation = pair
                .iter()
                .map(|one| (one.deviation / one.relative_mse).powi(2))
                .sum::<f64>()
                .sqrt();
            // The standard error is an upper bound; four of it.
            assert!(
                (ratio / 4.0).ln().abs() < 4.0 * deviation && deviation < 0.15,
                "{found:?}"
            );
        }
    }
}
