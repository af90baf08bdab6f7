//! The bias of a technique without a noiseless reference, and how it falls with work.
//!
//! Two independent pictures a, b of a technique and two independent pictures p, q of a reference have E[(a − p)(b − q)] = (E a − E p)² in every
//! pixel: the noise of all four drops out, whatever it is like within a picture (photons that several pixels share included). The mean of both
//! ways to pair them is the same as the squared difference of the means less both variances. Between two pairs of other numbers of samples,
//! (a₄ − a₁)(b₄ − b₁) likewise gives the square of how far the expected picture moves.
//! The standard error is that of sums over square tiles. It counts the bias's own unevenness over the picture as noise, and so errs to the safe
//! side: bias² + 2 standard errors lies below the true one in at most 1 of 40 pictures, as long as tiles, 64 of them, are wider than what neighbouring
//! pixels share. Noise that more of the picture shares makes the standard error too small: photons' kernels that are seen wider than an eighth of
//! the picture, and frames that have one place within the pixel for all of them, whose edges err alike.

use super::noise::{epsilon_of_pair, same_size, truth_of_pair};
use super::tiles::Tiles;
use crate::Result;
use crate::film::picture::Picture;

/// Standard deviation, relative to the square of the radiance, at which a neighbourhood is believed half. It is smaller than for noise alone, since
/// what a pixel's own noise does to its weight would count as bias.
const TRUST: f64 = 0.005;
/// Standard errors that a bias may be larger than found.
const MARGIN: f64 = 2.0;

/// Mean squared bias relative to the radiance's square, and how well it is known.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct BiasEstimate {
    /// Mean of bias² ∕ (radiance² + ε) over pixels and channels. Unbiased, so that it may come out below 0.
    pub square: f64,
    /// Its standard error, by tiles: too small where tiles share their noise.
    pub deviation: f64,
    /// Whether most of it lies where the technique is the brighter one.
    pub brighter: bool,
}

impl BiasEstimate {
    /// Beyond this with a probability of at most 1 in 40.
    pub fn upper(&self) -> f64 {
        self.square.max(0.0) + MARGIN * self.deviation
    }

    /// Below this with a probability of at most 1 in 40.
    pub fn lower(&self) -> f64 {
        self.square - MARGIN * self.deviation
    }

    /// Whether it is told from noise, which it is by mistake with a probability of at most 1 in 40.
    pub fn is_resolved(&self) -> bool {
        self.lower() > 0.0
    }
}

/// Relative squared bias of the technique that has made `pair`, against that of `reference`; all four pictures independent of each other.
/// `offset` is that of [`relative_mse_of_pair`](super::relative_mse_of_pair), over the reference's mean.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) when sizes differ; [`Error::Picture`](crate::Error::Picture) without radiance.
pub fn relative_bias_of_pairs([a, b]: [&Picture; 2], reference: [&Picture; 2], offset: f64) -> Result<BiasEstimate> {
    let [p, q] = reference;
    let radiance = [a, b, p, q].map(|picture| picture.main_layer().map(|layer| layer.values()));
    let [va, vb, vp, vq] = radiance;
    let (va, vb, vp, vq) = (va?, vb?, vp?, vq?);
    let values = |i: usize| {
        let [a, b, p, q] = [va[i], vb[i], vp[i], vq[i]].map(f64::from);
        Values {
            product: 0.5 * ((a - p) * (b - q) + (a - q) * (b - p)),
            difference: 0.5 * (a + b - p - q),
            mean: 0.25 * (a + b + p + q),
        }
    };
    for picture in [b, p, q] {
        same_size(a, picture)?;
    }
    tiled(reference, offset, values)
}

/// Relative squared distance by which the expected picture moves between two pairs of pictures of other numbers of samples.
///
/// # Errors
/// As [`relative_bias_of_pairs`].
pub fn relative_drift_of_pairs(early: [&Picture; 2], late: [&Picture; 2], offset: f64) -> Result<BiasEstimate> {
    let ([a, b], [c, d]) = (early, late);
    for picture in [b, c, d] {
        same_size(a, picture)?;
    }
    let (va, vb) = (a.main_layer()?.values(), b.main_layer()?.values());
    let (vc, vd) = (c.main_layer()?.values(), d.main_layer()?.values());
    let values = |i: usize| {
        let [a, b, c, d] = [va[i], vb[i], vc[i], vd[i]].map(f64::from);
        Values {
            product: (c - a) * (d - b),
            difference: 0.5 * (c + d - a - b),
            mean: 0.5 * (c + d),
        }
    };
    tiled(late, offset, values)
}

/// Of a pixel and channel.
struct Values {
    /// Whose expectation is the squared bias.
    product: f64,
    /// Technique less reference, late less early.
    difference: f64,
    /// Of all pictures that show the truth. Its square is a lower bound of the weight's, so that a pixel that is bright in one picture
    /// alone weighs little.
    mean: f64,
}

/// Mean of the products over the squared radiance that the two pictures know, with its standard error by tiles.
fn tiled([p, q]: [&Picture; 2], offset: f64, values: impl Fn(usize) -> Values) -> Result<BiasEstimate> {
    let (width, height) = (p.width() as usize, p.height() as usize);
    let epsilon = epsilon_of_pair(p, q, offset)?;
    let mut tiles = Tiles::new(width, height);
    let mut differences = vec![0.0; tiles.count()];
    for channel in 0..3 {
        let truth = truth_of_pair(p, q, channel, TRUST)?;
        for (i, truth) in truth.iter().enumerate() {
            let values = values(i * 3 + channel);
            // Of black pictures nothing is known.
            let level = truth.max(values.mean * values.mean) + epsilon;
            let weight = if level > 0.0 { 1.0 / level } else { 0.0 };
            let value = values.product * weight;
            // A pixel without a finite sample says nothing.
            let (value, difference) = if value.is_finite() {
                (value, values.difference * weight.sqrt())
            } else {
                (0.0, 0.0)
            };
            tiles.add(i, value);
            differences[tiles.of(i)] += difference;
        }
    }
    let (square, deviation) = tiles.mean();
    let of_brighter = tiles
        .sums()
        .zip(&differences)
        .filter(|(_, difference)| **difference > 0.0);
    let brighter: f64 = of_brighter.map(|(sum, _)| sum).sum();
    Ok(BiasEstimate {
        square,
        deviation,
        brighter: brighter > tiles.sums().sum::<f64>() / 2.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    const SIDE: usize = 32;

    /// Nearly normal, variance 1: the sum of twelve uniform numbers.
    fn normal(random: &mut Random) -> f64 {
        (0..12).map(|_| f64::from(random.unit())).sum::<f64>() - 6.0
    }

    /// A picture whose left half is dim, too bright by `bias`, with noise of a relative deviation that squares of `shared`² pixels have in common.
    fn picture(bias: f64, deviation: f64, shared: usize, random: &mut Random) -> Picture {
        let number = SIDE.div_ceil(shared);
        let noise: Vec<f64> = (0..number * number).map(|_| normal(random)).collect();
        let values = (0..SIDE * SIDE * 3).map(|i| {
            let (x, y) = (i / 3 % SIDE, i / 3 / SIDE);
            let truth = if x < SIDE / 2 { 0.2 } else { 2.0 };
            (truth * (1.0 + bias + deviation * noise[y / shared * number + x / shared])) as f32
        });
        Picture::from_radiance(SIDE as u32, SIDE as u32, values.collect()).unwrap()
    }

    /// A technique's pair with `noise` in blocks of `shared`² pixels, against a reference whose noise is each pixel's own.
    fn estimate(bias: f64, noise: [f64; 2], shared: usize, random: &mut Random) -> BiasEstimate {
        let pair = [(); 2].map(|()| picture(bias, noise[0], shared, random));
        let reference = [(); 2].map(|()| picture(0.0, noise[1], 1, random));
        relative_bias_of_pairs([&pair[0], &pair[1]], [&reference[0], &reference[1]], 0.01).unwrap()
    }

    #[test]
    fn known_biases_are_recovered() {
        // 0.2² ∕ (0.2² + ε) and 2² ∕ (2² + ε) of the squared bias, each on half of the picture, whose mean is 1.1.
        let share = 0.5 * (0.04 / 0.0521 + 4.0 / 4.0121);
        let mut random = Random(11);
        // The weight of a pixel is known as badly as its radiance: with noise of 30 % of the reference, the square is found a third too small.
        for (bias, noise, shared, allowed) in [
            (0.03, [0.02, 0.05], 1, 0.1),
            (0.1, [0.1, 0.1], 4, 0.25),
            (-0.2, [0.05, 0.3], 2, 0.45),
        ] {
            let found = estimate(bias, noise, shared, &mut random);
            let expected = share * bias * bias;
            assert!(
                (found.square - expected).abs() < 4.0 * found.deviation + allowed * expected,
                "{bias}: {found:?} for {expected}"
            );
            assert!(
                found.is_resolved() && found.deviation < 0.5 * expected,
                "{bias}: {found:?} for {expected}"
            );
            assert_eq!(found.brighter, bias > 0.0);
        }
    }

    // With a normal mean of 64 tiles, 2 standard errors are passed by chance in 2.5 % of cases: of 200, 5 on average, more than 13 in 0.1 %.
    #[test]
    fn noise_is_seldom_taken_for_bias() {
        for (seed, shared) in [(5, 1), (6, 4)] {
            let mut random = Random(seed);
            let found: Vec<BiasEstimate> = (0..200)
                .map(|_| estimate(0.0, [0.2, 0.3], shared, &mut random))
                .collect();
            let alarms = found.iter().filter(|estimate| estimate.is_resolved()).count();
            assert!(alarms <= 13, "{shared}: {alarms} of 200");
            let mean = found.iter().map(|estimate| estimate.square).sum::<f64>() / 200.0;
            let deviation = found.iter().map(|estimate| estimate.deviation).sum::<f64>() / 200.0;
            // A pixel's weight knows its noise, which takes a fifth of a standard error away at most, with the truth itself as with this one.
            assert!(
                mean.abs() < (4.0 / 200_f64.sqrt() + 0.2) * deviation,
                "{shared}: {mean} ± {deviation}"
            );
        }
    }

    #[test]
    fn drifts_are_told_from_noise_that_both_stages_share() {
        let mut random = Random(3);
        let share = 0.5 * (0.04 / 0.0521 + 4.0 / 4.0121);
        let early = [(); 2].map(|()| picture(0.2, 0.1, 1, &mut random));
        let late = [(); 2].map(|()| picture(0.1, 0.05, 1, &mut random));
        let found = relative_drift_of_pairs([&early[0], &early[1]], [&late[0], &late[1]], 0.01).unwrap();
        // The late pictures are themselves 10 % too bright, and the relative error with them.
        let expected = share * 0.01 / 1.21;
        assert!(
            (found.square - expected).abs() < 4.0 * found.deviation + 0.1 * expected,
            "{found:?} for {expected}"
        );
        let small = Picture::from_radiance(2, 2, vec![0.0; 12]).unwrap();
        assert!(relative_drift_of_pairs([&small, &small], [&late[0], &late[1]], 0.01).is_err());
        let one = relative_drift_of_pairs([&small, &small], [&small, &small], 0.01).unwrap();
        assert!(one.deviation.is_infinite() && !one.is_resolved());
    }
}
