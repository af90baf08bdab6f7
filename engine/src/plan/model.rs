//! Models of error, bias and cost over samples per pixel, fitted to pilot renderings.

use super::bias::BiasEstimate;
use crate::techniques::Law;

/// Slopes that an error of sampling can have: independent samples −1, stratified ones of smooth pixels steeper.
const SLOPES: std::ops::RangeInclusive<f64> = 1.0..=1.5;
/// How much of a measured slope beyond that of independent samples is believed of samples not yet taken: stratification gains less and
/// less as what is left in a pixel is rough.
const BELIEF: f64 = 0.5;

/// What a number may exceed a whole one by and still count as that.
const HAIR: f64 = 1e-6;

/// Relative MSE over samples per pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorModel {
    /// Least slope.
    least_slope: f64,
    /// Samples per pixel and relative MSE, with rising samples.
    points: Vec<(f64, f64)>,
    /// What the last measurement has not seen, for all that is known.
    unseen: f64,
}

/// Of independent samples.
impl Default for ErrorModel {
    fn default() -> Self {
        Self::falling(*SLOPES.start())
    }
}

impl ErrorModel {
    /// Of noise that falls as samples^(−`least_slope`) or faster: 1 for independent samples, less where kernels shrink.
    pub fn falling(least_slope: f64) -> Self {
        Self {
            least_slope: least_slope.clamp(0.0, *SLOPES.end()),
            points: Vec::new(),
            unseen: 0.0,
        }
    }

    /// Says that the last measurement has missed so much: light too rare to be met. It falls as noise of independent samples does.
    pub fn set_unseen(&mut self, relative_mse: f64) {
        self.unseen = relative_mse;
    }

    /// Adds a measurement with more samples than those before.
    pub fn add(&mut self, samples: u32, relative_mse: f64) {
        self.points.push((f64::from(samples), relative_mse));
    }

    /// The error falls as samples^(−slope).
    pub fn slope(&self) -> f64 {
        let least = self.least_slope;
        let [.., (n0, e0), (n1, e1)] = self.points[..] else {
            return least;
        };
        let measured = if e0 > 0.0 && e1 > 0.0 {
            (e0 / e1).ln() / (n1 / n0).ln()
        } else {
            *SLOPES.start()
        };
        let measured = measured.clamp(least, *SLOPES.end());
        let surplus = (measured - SLOPES.start()).max(0.0);
        measured - (1.0 - BELIEF) * surplus
    }

    /// Relative MSE expected of `samples` samples per pixel: between measurements by the power law through both, beyond the last by the
    /// slope; 0 without a measurement.
    pub fn relative_mse(&self, samples: f64) -> f64 {
        let last = self.points.last().map_or(0.0, |(n, _)| *n);
        self.seen(samples) + self.unseen * last / samples
    }

    fn seen(&self, samples: f64) -> f64 {
        for pair in self.points.windows(2) {
            let [(n0, e0), (n1, e1)] = [pair[0], pair[1]];
            if samples < n1 && e0 > 0.0 && e1 > 0.0 {
                return e0 * (e1 / e0).powf((samples / n0).ln() / (n1 / n0).ln());
            }
        }
        let Some((n, e)) = self.points.last() else { return 0.0 };
        e * (samples / n).powf(-self.slope())
    }

    /// Least number of samples per pixel for that relative MSE, at least 1 and at most `u32::MAX`.
    pub fn samples(&self, relative_mse: f64) -> u32 {
        if self.unseen > 0.0 {
            return least(|samples| self.relative_mse(samples) <= relative_mse).unwrap_or(u32::MAX);
        }
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

/// Exponents that a squared bias can be measured to fall with. That of a kernel's blur falls as its area squared, that of its edges as its radius: with
/// a reduction of 2/3 of photon mapping as passes^(−2/3) and passes^(−1/6).
const EXPONENTS: std::ops::RangeInclusive<f64> = 0.0..=2.0;
/// Least exponent by which where a picture is going can be told from how it moves.
const SETTLING_EXPONENT: f64 = 0.1;

/// Relative squared bias over samples per pixel: a power law through the last measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BiasModel {
    /// Passes of the last measurement.
    at: f64,
    /// Samples per pixel of a pass.
    samples_a_pass: f64,
    /// What it found, and what may be by its noise.
    square: f64,
    upper: f64,
    /// The squared bias falls as passes^(−exponent).
    exponent: f64,
    /// By the technique's law, since no two measurements show it.
    is_assumed: bool,
}

/// No bias.
impl Default for BiasModel {
    fn default() -> Self {
        Self::constant(BiasEstimate::default())
    }
}

/// Passes of so many samples per pixel. Pictures of less than a pass are as biased as that of one.
fn passes(samples: f64, samples_a_pass: f64) -> f64 {
    (samples / samples_a_pass).max(1.0)
}

impl BiasModel {
    /// A bias that stays.
    pub fn constant(found: BiasEstimate) -> Self {
        Self {
            at: 1.0,
            samples_a_pass: 1.0,
            square: found.square.max(0.0),
            upper: found.upper(),
            exponent: 0.0,
            is_assumed: false,
        }
    }

    /// A bias that falls, found at rising numbers of samples: as it did between the last two measurements that are told from noise, and
    /// by the technique's law where there are no two of different numbers of passes. `None` without a measurement.
    pub fn falling(law: &Law, found: &[(u32, BiasEstimate)]) -> Option<Self> {
        let (samples, last) = found.last()?;
        if law.bias_exponent <= 0.0 {
            return Some(Self::constant(*last));
        }
        let samples_a_pass = f64::from(law.samples_a_pass);
        let passes = |samples: u32| passes(samples.into(), samples_a_pass);
        let resolved: Vec<_> = found.iter().filter(|(_, found)| found.is_resolved()).collect();
        let measured = match resolved[..] {
            [.., (n0, b0), (n1, b1)] if passes(*n1) > passes(*n0) => {
                Some((b0.square / b1.square).ln() / (passes(*n1) / passes(*n0)).ln())
            }
            _ => None,
        };
        let exponent = measured.unwrap_or(law.bias_exponent);
        Some(Self {
            at: passes(*samples),
            samples_a_pass,
            exponent: exponent.clamp(*EXPONENTS.start(), *EXPONENTS.end()),
            is_assumed: measured.is_none(),
            ..Self::constant(*last)
        })
    }

    /// Where a picture is going, by how far its expectation has moved between successive numbers of samples: where the bias falls as
    /// passes^(−p/2) in each pixel, from n to Rn it moves by R^(p/2) − 1 times what is left. p is measured by two movements over the same R that
    /// are told from noise, and is the law's where there are none. `None` without a movement over more than a pass, where movements do not get smaller,
    /// and where the law has the bias stay: such pictures do not move, however large it is.
    pub fn settling(law: &Law, moved: &[(u32, u32, BiasEstimate)]) -> Option<Self> {
        let samples_a_pass = f64::from(law.samples_a_pass);
        let passes = |samples: u32| passes(samples.into(), samples_a_pass);
        let moved = moved.iter().map(|(from, to, by)| (passes(*from), passes(*to), by));
        let moved: Vec<_> = moved.filter(|(from, to, _)| to > from).collect();
        let (from, to, last) = *moved.last()?;
        let ratio = to / from;
        let measured = match moved[..] {
            [.., (n0, m0, b0), (n1, _, b1)]
                if b0.is_resolved() && b1.is_resolved() && (m0 / n0 - ratio).abs() < HAIR * ratio =>
            {
                Some((b0.square / b1.square).ln() / (n1 / n0).ln())
            }
            _ => None,
        };
        let exponent = measured.unwrap_or(law.bias_exponent);
        if exponent < SETTLING_EXPONENT || law.bias_exponent <= 0.0 {
            return None;
        }
        let exponent = exponent.min(*EXPONENTS.end());
        let left = (ratio.powf(exponent / 2.0) - 1.0).powi(-2);
        Some(Self {
            at: to,
            samples_a_pass,
            square: last.square.max(0.0) * left,
            upper: last.upper() * left,
            exponent,
            is_assumed: measured.is_none(),
        })
    }

    /// Whether the exponent is the technique's law's, not measured.
    pub fn is_assumed(&self) -> bool {
        self.is_assumed
    }

    /// Exponent of the squared bias: it falls as samples^(−exponent).
    pub fn exponent(&self) -> f64 {
        self.exponent
    }

    /// Relative squared bias expected of that many samples per pixel.
    pub fn square(&self, samples: f64) -> f64 {
        self.square * self.decay(samples)
    }

    /// What it is at most by the noise of what was measured, but for one case in 40, if the exponent is right: how well that is known does not count.
    pub fn upper(&self, samples: f64) -> f64 {
        self.upper * self.decay(samples)
    }

    fn decay(&self, samples: f64) -> f64 {
        if self.exponent == 0.0 {
            1.0
        } else {
            (passes(samples, self.samples_a_pass) / self.at).powf(-self.exponent)
        }
    }

    /// Least number of samples per pixel from which noise and bias together stay within a relative MSE, and the bias does so with what it may be
    /// by its noise; `None` where no number does.
    pub fn samples(&self, noise: &ErrorModel, relative_mse: f64) -> Option<u32> {
        if self.upper == 0.0 {
            return Some(noise.samples(relative_mse));
        }
        least(|samples| {
            noise.relative_mse(samples) + self.square(samples) <= relative_mse && self.upper(samples) <= relative_mse
        })
    }
}

/// The least number of samples from which on something holds; `None` where it never does.
fn least(holds: impl Fn(f64) -> bool) -> Option<u32> {
    if !holds(u32::MAX.into()) {
        return None;
    }
    let (mut short, mut enough) = (0, u32::MAX);
    while enough - short > 1 {
        let middle = short + (enough - short) / 2;
        if holds(middle.into()) {
            enough = middle;
        } else {
            short = middle;
        }
    }
    Some(enough)
}

/// Seconds over samples per pixel.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CostModel {
    /// Before and with the first sample.
    pub start: f64,
    /// For each sample per pixel.
    pub sample: f64,
}

impl CostModel {
    /// Seconds for `samples` samples per pixel.
    pub fn seconds(&self, samples: f64) -> f64 {
        self.start + self.sample * samples
    }

    /// Most samples per pixel in that time; 0 when not even one fits.
    pub fn samples(&self, seconds: f64) -> u32 {
        ((seconds - self.start) / self.sample.max(1e-12)).clamp(0.0, f64::from(u32::MAX)) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a kernel's blur, with a reduction of 2/3.
    const BLUR: Law = Law {
        slope: 2.0 / 3.0,
        bias_exponent: 2.0 / 3.0,
        samples_a_pass: 1,
        shares_noise: true,
    };

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

        let mut rare = ErrorModel::default();
        rare.add(4, 0.04);
        rare.set_unseen(0.36);
        assert!((rare.relative_mse(16.0) - 0.1).abs() < 1e-12 && rare.samples(0.1 * (1.0 + 1e-12)) == 16);

        let mut kernels = ErrorModel::falling(0.6);
        kernels.add(4, 0.4);
        kernels.add(16, 0.4 / 4_f64.powf(0.7));
        assert!((kernels.slope() - 0.7).abs() < 1e-12);
        kernels.add(64, 0.4);
        assert_eq!(kernels.slope(), 0.6);

        let cost = CostModel {
            start: 0.5,
            sample: 0.25,
        };
        assert_eq!((cost.seconds(4.0), cost.samples(1.6), cost.samples(0.1)), (1.5, 4, 0));
    }

    #[test]
    fn biases_fall_as_they_were_seen_to() {
        let found = |square: f64, deviation: f64| BiasEstimate {
            square,
            deviation,
            brighter: true,
        };
        let constant = BiasModel::constant(found(0.01, 0.001));
        assert_eq!((constant.square(1e6), constant.upper(1.0)), (0.01, 0.012));
        assert_eq!(BiasModel::constant(found(-0.01, 0.001)).square(4.0), 0.0);
        // A quarter at four times the samples.
        let falling = BiasModel::falling(&BLUR, &[(4, found(0.04, 0.001)), (16, found(0.01, 0.001))]).unwrap();
        assert!((falling.exponent() - 1.0).abs() < 1e-12 && (falling.square(64.0) - 0.0025).abs() < 1e-12);
        // What is not told from noise shows no law.
        let hidden = BiasModel::falling(&BLUR, &[(4, found(0.04, 0.001)), (16, found(0.01, 0.009))]).unwrap();
        assert_eq!((hidden.exponent(), hidden.is_assumed()), (BLUR.bias_exponent, true));
        assert!(!falling.is_assumed());
        assert!(BiasModel::falling(&BLUR, &[]).is_none());

        // A bias of 0.4 · samples^(−1/3) in every pixel.
        let bias = |samples: f64| 0.4 * samples.powf(-1.0 / 3.0);
        let moved = |from: u32| {
            let by = bias(from.into()) - bias(4.0 * f64::from(from));
            (from, 4 * from, found(by * by, 1e-9))
        };
        let settling = BiasModel::settling(&BLUR, &[moved(4), moved(16)]).unwrap();
        assert!((settling.exponent() - 2.0 / 3.0).abs() < 1e-6, "{settling:?}");
        assert!(
            (settling.square(64.0).sqrt() / bias(64.0) - 1.0).abs() < 1e-6,
            "{settling:?}"
        );
        assert!(
            (settling.square(4096.0).sqrt() / bias(4096.0) - 1.0).abs() < 1e-6,
            "{settling:?}"
        );
        // One movement alone is read by the law of blur, and one that does not get smaller not at all.
        let alone = BiasModel::settling(&BLUR, &[moved(16)]).unwrap();
        assert!((alone.square(64.0).sqrt() / bias(64.0) - 1.0).abs() < 1e-6, "{alone:?}");
        assert!(BiasModel::settling(&BLUR, &[(4, 16, found(0.01, 1e-9)), (16, 64, found(0.01, 1e-9))]).is_none());
        assert!(BiasModel::settling(&BLUR, &[]).is_none());
    }

    // A picture that does not move is near its limit only if kernels shrink meanwhile.
    #[test]
    fn pictures_that_cannot_move_show_no_bias() {
        let still = BiasEstimate {
            square: 0.0,
            deviation: 1e-9,
            brighter: true,
        };
        let moved = [(1, 4, still), (4, 16, still), (16, 64, still)];
        assert!(BiasModel::settling(&BLUR, &moved).is_some());
        let fixed = Law {
            bias_exponent: 0.0,
            ..BLUR
        };
        assert_eq!(BiasModel::settling(&fixed, &moved), None);
        let of_passes = |samples_a_pass| Law { samples_a_pass, ..BLUR };
        assert_eq!(BiasModel::settling(&of_passes(64), &moved), None);
        // From one pass to two the same movement says less than from one to four.
        let one = BiasModel::settling(&BLUR, &moved).unwrap();
        let two = BiasModel::settling(&of_passes(32), &moved).unwrap();
        assert!(two.upper(64.0) > 4.0 * one.upper(64.0), "{two:?}");
        // Held against others, a bias that stays is not taken to fall, nor one of a pass under way.
        let other = BiasEstimate { square: 0.01, ..still };
        let found = [(4, other), (16, other)];
        assert_eq!(BiasModel::falling(&fixed, &found).unwrap().square(1e6), 0.01);
        let under_way = BiasModel::falling(&of_passes(64), &found).unwrap();
        assert!(
            under_way.is_assumed() && under_way.square(64.0) == 0.01,
            "{under_way:?}"
        );
        assert!((under_way.square(512.0) - 0.0025).abs() < 1e-12, "{under_way:?}");
    }

    #[test]
    fn samples_serve_noise_and_bias_together() {
        let found = |square: f64, deviation: f64| BiasEstimate {
            square,
            deviation,
            brighter: true,
        };
        let mut noise = ErrorModel::default();
        noise.add(4, 0.04);
        assert_eq!(BiasModel::default().samples(&noise, 0.01), Some(noise.samples(0.01)));
        // 0.16 ∕ 32 + 0.005 = 0.01.
        let constant = BiasModel::constant(found(0.005, 0.0));
        assert_eq!(constant.samples(&noise, 0.01 * (1.0 + 1e-12)), Some(32));
        assert_eq!(constant.samples(&noise, 0.004), None);
        // Small as far as is known, but it may be larger.
        assert_eq!(BiasModel::constant(found(0.005, 0.003)).samples(&noise, 0.01), None);
        let falling = BiasModel::falling(&BLUR, &[(4, found(0.08, 0.0)), (16, found(0.02, 0.0))]).unwrap();
        assert_eq!(falling.samples(&noise, 0.048 * (1.0 + 1e-12)), Some(10));
    }
}
