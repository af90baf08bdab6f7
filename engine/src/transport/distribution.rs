//! Choice among entries in proportion to their weights: cumulative tables in one and two dimensions.
//!
//! Method: inversion of the cumulative distribution by bisection, by random words of 32 bits, which become their places within the entry's
//! share, so that one point chooses an entry and a place in it (Shirley et al. 1996). Probabilities are multiples of 2⁻²⁴, the grid of the engine's random
//! numbers, shared out by largest remainder, and each positive weight has at least one: so f32 holds the table exactly, an entry's
//! probability is exactly the share of random numbers that choose it, and no entry with a positive weight is lost however small it
//! is. Guarantee: at most 24 steps. Twin of `transport/distribution.glsl`.

use crate::catalogue::{Bias, Role, Row, sources};
use crate::gpu::shaders::constants::{DISTRIBUTION_QUANTA, WORD_RANGE};
use crate::transport::choice::BELOW_ONE;
use crate::transport::random::unit_float;
use crate::{Error, Result};
use glam::UVec2;

/// Number of steps between 0 and 1.
const QUANTA: u64 = 1 << 24;
/// Most entries of a table: then what is shared out beyond one quantum each still resolves the weights to a part in a thousand.
pub const ENTRIES_MAX: usize = 1 << 22;

/// A cumulative table: `count + 1` values from 0 to 1.
///
/// `name` stands in errors. Weights must be finite and not negative; if all are zero the entries are equally likely.
pub fn build_distribution(name: &str, weights: &[f64]) -> Result<Vec<f32>> {
    if weights.is_empty() || weights.len() > ENTRIES_MAX {
        let cause = format!("is not in 1..={ENTRIES_MAX}");
        return Err(Error::setting(
            format!("{name}: entries to choose from"),
            weights.len(),
            cause,
        ));
    }
    if let Some((i, w)) = weights.iter().enumerate().find(|(_, w)| !(w.is_finite() && **w >= 0.0)) {
        let cause = "is not a weight: weights are finite and not negative";
        return Err(Error::setting(format!("{name}[{i}]"), w, cause));
    }
    let largest = weights.iter().copied().fold(0.0, f64::max);
    // Scaled by the largest, so that the sum of huge weights stays finite.
    let scaled = |w: f64| if largest > 0.0 { w / largest } else { 1.0 };
    let total: f64 = weights.iter().map(|&w| scaled(w)).sum();
    let positive = weights.iter().filter(|&&w| largest == 0.0 || w > 0.0).count() as u64;
    let shared = (QUANTA - positive) as f64;
    let mut left = QUANTA - positive;
    let mut remainders = Vec::with_capacity(weights.len());
    let mut quanta: Vec<u64> = weights
        .iter()
        .enumerate()
        .map(|(i, &w)| {
            if largest > 0.0 && w == 0.0 {
                return 0;
            }
            let share = shared * scaled(w) / total;
            let whole = (share.floor() as u64).min(left);
            left -= whole;
            remainders.push((share - share.floor(), i));
            whole + 1
        })
        .collect();
    remainders.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    // Rounding of the sum can leave more than one round of remainders.
    for &(_, i) in remainders.iter().cycle().take(left as usize) {
        quanta[i] += 1;
    }
    let mut sum = 0;
    #[expect(clippy::cast_precision_loss, reason = "24 bits are exact in f32")]
    Ok(std::iter::once(0.0)
        .chain(quanta.into_iter().map(|q| {
            sum += q;
            sum as f32 / QUANTA as f32
        }))
        .collect())
}

/// Tables of a grid of `size` cells given row by row: the rows' table, then one for each row.
pub fn build_distribution_2d(name: &str, size: UVec2, weights: &[f64]) -> Result<Vec<f32>> {
    let width = size.x.max(1) as usize;
    if weights.len() != size.x as usize * size.y as usize {
        let value = format!("{} weights", weights.len());
        return Err(Error::setting(name, value, format!("are not {} × {}", size.x, size.y)));
    }
    // One scale for all rows, so that their sums neither overflow nor lose their proportion.
    let largest = weights.iter().copied().fold(0.0, f64::max);
    let scale = if largest > 0.0 && largest.is_finite() {
        largest
    } else {
        1.0
    };
    let rows: Vec<f64> = weights
        .chunks(width)
        .map(|row| row.iter().map(|w| w / scale).sum())
        .collect();
    let mut values = build_distribution(name, &rows)?;
    for row in weights.chunks(width) {
        values.extend(build_distribution(name, row)?);
    }
    Ok(values)
}

/// Probability of an entry of the table that begins at `base`.
pub fn distribution_probability(cdf: &[f32], base: usize, entry: usize) -> f64 {
    f64::from(cdf[base + entry + 1]) - f64::from(cdf[base + entry])
}

/// The place of a word within the share of all words that begins at `first`, as a word again.
///
/// The bits that choosing took are made up for by those of `fresh`, another random word, so that the result has 24 good bits however
/// small the share. The device's rounding moves it by half of the last of them at most.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "parts of 32-bit words"
)]
pub fn rescaled_word(word: u32, first: f64, share: f64, fresh: u32) -> u32 {
    let quanta = f64::from(DISTRIBUTION_QUANTA);
    let rest = word.wrapping_sub(((first * quanta) as u32) << 8);
    let place = (f64::from(rest) + unit_float(fresh)) / (share * f64::from(WORD_RANGE));
    (((place.min(BELOW_ONE) * quanta) as u32) << 8) | (fresh & 255)
}

/// The entry that a word chooses, the last one whose cumulative probability is at most the word's upper 24 bits, and its probability.
///
/// The word becomes its place within that entry's share: [`rescaled_word`].
pub fn distribution_sample(cdf: &[f32], base: usize, count: usize, word: &mut u32, fresh: u32) -> (usize, f64) {
    let u = unit_float(*word);
    let (mut lower, mut upper) = (0, count);
    while upper - lower > 1 {
        let middle = usize::midpoint(lower, upper);
        if f64::from(cdf[base + middle]) <= u {
            lower = middle;
        } else {
            upper = middle;
        }
    }
    let probability = distribution_probability(cdf, base, lower);
    *word = rescaled_word(*word, f64::from(cdf[base + lower]), probability, fresh);
    (lower, probability)
}

/// Where the table of a row begins.
pub fn distribution_row_base(base: usize, size: UVec2, row: usize) -> usize {
    base + size.y as usize + 1 + row * (size.x as usize + 1)
}

/// Probability of a cell of a grid.
pub fn distribution_probability_2d(cdf: &[f32], base: usize, size: UVec2, cell: UVec2) -> f64 {
    let row = cell.y as usize;
    distribution_probability(cdf, base, row)
        * distribution_probability(cdf, distribution_row_base(base, size, row), cell.x as usize)
}

/// The cell that two words choose, which become the place within its share, and its probability.
pub fn distribution_sample_2d(
    cdf: &[f32],
    base: usize,
    size: UVec2,
    word: &mut [u32; 2],
    fresh: [u32; 2],
) -> (UVec2, f64) {
    let [x, y] = word;
    let (row, p_row) = distribution_sample(cdf, base, size.y as usize, y, fresh[1]);
    let row_base = distribution_row_base(base, size, row);
    let (column, p_column) = distribution_sample(cdf, row_base, size.x as usize, x, fresh[0]);
    #[expect(clippy::cast_possible_truncation, reason = "below the grid's size")]
    (UVec2::new(column as u32, row as u32), p_row * p_column)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-LIGHTS",
    name: "choice of lights by power, limited for distant ones",
    role: Role::PartOf("BG-3"),
    limits: "Blind to shadows and to where a light is from the point that it lights; distant lights keep half of the choices at most where there are others, so that what each light adds has at most twice the second moment that it has by power alone.",
    sources: &[sources::SHIRLEY_1996.at("inversion of the cumulative distribution")],
    shaders: &["shaders/transport/distribution.glsl", "shaders/transport/choice.glsl"],
    bias: Some(Bias::Unbiased),
    tests: &[
        "engine/src/transport/distribution.rs::probabilities_follow_weights_and_none_is_lost",
        "engine/src/transport/distribution.rs::cells_follow_their_probability",
        "engine/src/transport/distribution.rs::what_is_left_of_a_word_is_even_in_each_entry",
        "engine/src/transport/choice.rs::what_is_left_is_even_in_each_alternative",
        "tests/tests/paths/samplers.rs::lights_are_chosen_by_their_power",
        "tests/tests/paths/path_tracer.rs::closed_furnaces_have_the_radiance_of_the_geometric_series",
        "engine/src/transport/gpu_scene/lights.rs::no_light_loses_more_than_half_of_its_choices",
        "tests/tests/twins/tables.rs::distributions_agree_with_their_twins",
    ],
    api: &["clerestory::transport::distribution", "clerestory::transport::choice"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::super::random::pcg4d;
    use super::super::testing::{chi_square_test, random3};
    use super::*;
    use glam::UVec4;

    /// Independent words.
    fn words(i: u32, seed: u32) -> [u32; 4] {
        pcg4d(UVec4::new(i, seed, 0xd157, 0)).to_array()
    }

    #[test]
    fn probabilities_follow_weights_and_none_is_lost() {
        let weights: Vec<f64> = (0..1000).map(|i| f64::from(i % 7) * f64::from(i)).collect();
        let total: f64 = weights.iter().sum();
        let cdf = build_distribution("test", &weights).unwrap();
        assert_eq!((cdf[0], cdf[1000]), (0.0, 1.0));
        for (i, w) in weights.iter().enumerate() {
            let p = distribution_probability(&cdf, 0, i);
            assert_eq!(p == 0.0, *w == 0.0);
            // One quantum of rounding, and the least share of a thousand entries taken from all.
            assert!((p - w / total).abs() <= 2.0 / QUANTA as f64 + 1000.0 / QUANTA as f64 * w / total);
        }
        let tiny = build_distribution("tiny", &[1e300, 1e-300, 0.0, 1e300]).unwrap();
        assert_eq!(distribution_probability(&tiny, 0, 1), 1.0 / QUANTA as f64);
        assert_eq!(distribution_probability(&tiny, 0, 2), 0.0);
        for count in [1, 2, 3, 1000] {
            let even = build_distribution("dark", &vec![0.0; count]).unwrap();
            assert!((0..count).all(|i| (distribution_probability(&even, 0, i) * count as f64 - 1.0).abs() < 1e-4));
        }
    }

    #[test]
    fn every_random_number_chooses_by_the_table() {
        let cdf = build_distribution("test", &[0.0, 3.0, 0.0, 1.0, 0.0]).unwrap();
        for k in (0..QUANTA).step_by(4099).chain([QUANTA - 1]) {
            let u = k as f64 / QUANTA as f64;
            let mut word = (k as u32) << 8 | 255;
            let (i, p) = distribution_sample(&cdf, 0, 5, &mut word, 0);
            let place = (u - f64::from(cdf[i])) / p;
            assert!((unit_float(word) - place).abs() <= 1.0 / QUANTA as f64 / p, "{place}");
            assert!(f64::from(cdf[i]) <= u && u < f64::from(cdf[i + 1]));
            assert!(p > 0.0 && p == distribution_probability(&cdf, 0, i));
        }
    }

    /// Chi-square of 40,000 choices in a 13 × 9 grid; false alarm 1e-5.
    #[test]
    fn cells_follow_their_probability() {
        let size = UVec2::new(13, 9);
        let weights: Vec<f64> = (0..117)
            .map(|i| random3(i, 1).x * f64::from(u32::from(i % 5 != 0)))
            .collect();
        let cdf = build_distribution_2d("grid", size, &weights).unwrap();
        let n = 40_000;
        let mut observed = vec![0.0; 117];
        for i in 0..n {
            let [x, y, a, b] = words(i, 2);
            let (cell, p) = distribution_sample_2d(&cdf, 0, size, &mut [x, y], [a, b]);
            assert_eq!(p, distribution_probability_2d(&cdf, 0, size, cell));
            observed[(cell.y * size.x + cell.x) as usize] += 1.0;
        }
        let total: f64 = weights.iter().sum();
        let expected: Vec<f64> = weights.iter().map(|w| w / total * f64::from(n)).collect();
        assert!(chi_square_test(&observed, &expected) > 1e-5);
        let mut wrong = expected.clone();
        wrong.rotate_left(1);
        assert!(
            chi_square_test(&observed, &wrong) < 1e-5,
            "the test must be able to fail"
        );
    }

    /// Chi-square of 60,000 words over four entries and 16 cells of what is left; false alarm 1e-5. The least entry has four quanta: what is
    /// left there comes from the fresh word.
    #[test]
    fn what_is_left_of_a_word_is_even_in_each_entry() {
        let least = 4.0 / QUANTA as f64;
        let cdf = [0.0, 0.25, 0.3, 0.3 + least, 1.0].map(|c: f64| (c * QUANTA as f64).round() as f32 / QUANTA as f32);
        let n = 60_000;
        let mut observed = vec![0.0; 64];
        let mut small = vec![0.0; 16];
        for i in 0..n {
            let [mut word, fresh, inside, _] = words(i, 3);
            let (entry, _) = distribution_sample(&cdf, 0, 4, &mut word, fresh);
            observed[entry * 16 + (word >> 28) as usize] += 1.0;
            // Words of the least entry alone, and the third to sixth bit below its own ten.
            let mut word = ((f64::from(cdf[2]) * QUANTA as f64) as u32) * 256 + (inside >> 22);
            let (entry, p) = distribution_sample(&cdf, 0, 4, &mut word, fresh);
            assert_eq!((entry, p), (2, least));
            small[(word >> 16 & 15) as usize] += 1.0;
        }
        let expected: Vec<f64> = (0..64)
            .map(|cell| distribution_probability(&cdf, 0, cell / 16) * f64::from(n) / 16.0)
            .collect();
        assert!(chi_square_test(&observed, &expected) > 1e-5);
        assert!(chi_square_test(&small, &[f64::from(n) / 16.0; 16]) > 1e-5);
    }

    #[test]
    fn bad_weights_are_errors() {
        assert!(matches!(build_distribution("w", &[]), Err(Error::Setting { .. })));
        for bad in [f64::NAN, -1.0, f64::INFINITY] {
            let error = build_distribution("lights", &[1.0, bad]).unwrap_err().to_string();
            assert!(error.contains("lights[1]"), "{error}");
            assert!(build_distribution_2d("e", UVec2::new(2, 1), &[1.0, bad]).is_err());
        }
        assert!(build_distribution_2d("e", UVec2::new(2, 2), &[1.0]).is_err());
    }
}
