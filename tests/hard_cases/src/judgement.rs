//! What was measured of a subject and how that compares with what is known.

use clerestory::film::z_test::{RELATIVE_DEVIATION_FLOOR, SIGNIFICANCE, Verdict, z_test};
use clerestory::{Error, Result};

use crate::Painted;

/// False-alarm rate of one statistical check.
pub const FALSE_ALARM: f64 = 1e-6;

/// |z| that a standard normal passes with probability [`FALSE_ALARM`].
pub(crate) const Z_MAX: f64 = 4.892;
/// The same for a sum over pixels whose three channels may be one and the same: √3 times as much.
const SUM_Z_MAX: f64 = 8.473;
/// |t| of so many degrees of freedom that lies as far out as [`Z_MAX`] of a standard normal variable (D. L. Wallace, "Bounds on normal approximations to Student's
/// and the chi-square distributions", 1959).
fn t_max(degrees: f64) -> f64 {
    let z = Z_MAX * (8.0 * degrees + 3.0) / (8.0 * degrees + 1.0);
    (degrees * (z * z / degrees).exp_m1()).sqrt()
}

/// The mean over the picture, and the most of its noise, a channel: by the variance of its pixels, or by Student's t where they share the noise of a pass.
fn mean_and_noise(painted: &Painted) -> [(f64, f64); 3] {
    let means = painted.mean();
    [0, 1, 2].map(|c| {
        let (mean, variance) = means[c];
        let passes = match &painted.passes {
            None => return (mean, Z_MAX * variance.sqrt()),
            Some(passes) if passes.len() < 2 => return (mean, 0.0),
            Some(passes) => passes,
        };
        let n = passes.len() as f64;
        let values = passes.iter().map(|pass| pass[c]);
        let centre = values.clone().sum::<f64>() / n;
        let squares = values.map(|value| (value - centre).powi(2)).sum::<f64>();
        (mean, t_max(n - 1.0) * (squares / (n * (n - 1.0))).sqrt())
    })
}

/// Share of a picture's values that its z-test may reject where heavy tails explain it: 1 − [`ACCEPTED_FRACTION`](clerestory::film::z_test::ACCEPTED_FRACTION).
const REJECTED_MAX: f64 = 1.0 - clerestory::film::z_test::ACCEPTED_FRACTION;

/// One measured value with its bounds.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Figure {
    /// What was measured.
    pub what: String,
    /// The value.
    pub measured: f64,
    /// Up to here the case passes.
    pub bound: f64,
    /// Up to here it degrades as documented.
    pub documented: f64,
    /// What every picture must be, whatever light it holds: whole, finite, the same each time; and refusals.
    pub of_soundness: bool,
}

impl Figure {
    fn excess(&self) -> f64 {
        if self.measured.is_nan() {
            f64::INFINITY
        } else if self.measured <= 0.0 {
            0.0
        } else {
            self.measured / self.bound
        }
    }

    /// Whether it is good enough to pass.
    pub fn passes(&self) -> bool {
        self.measured <= self.bound
    }

    /// The picture or scene that it is of: what was measured, without the last word of it.
    fn of(&self) -> &str {
        self.what.rsplit_once(": ").map_or(&self.what, |(of, _)| of)
    }

    /// Whether it is at least as good as documented.
    pub fn is_documented(&self) -> bool {
        self.measured <= self.documented.max(self.bound)
    }
}

impl std::fmt::Display for Figure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let bound = if self.passes() { self.bound } else { self.documented };
        if self.bound == 0.0 && self.measured == 0.0 {
            return write!(f, "{}: none", self.what);
        }
        write!(f, "{}: {} of {}", self.what, short(self.measured), short(bound))
    }
}

/// A number in few characters.
fn short(value: f64) -> String {
    let plain = value == 0.0 || (0.01..100_000.0).contains(&value.abs());
    if plain && value.fract() == 0.0 {
        format!("{value}")
    } else if plain {
        let text = format!("{value:.3}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{value:.1e}")
    }
}

/// All that was measured of a subject.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Judgement {
    figures: Vec<Figure>,
}

impl Judgement {
    /// What was measured.
    pub fn figures(&self) -> &[Figure] {
        &self.figures
    }

    /// The figure that is worst for its bound.
    pub fn worst(&self) -> Option<&Figure> {
        let rank = |figure: &Figure| (!figure.is_documented(), !figure.passes());
        self.figures.iter().reduce(|worst, figure| {
            let worse = (rank(figure), figure.excess()) >= (rank(worst), worst.excess());
            if worse { figure } else { worst }
        })
    }

    /// Whether another technique's values are wrong of every picture that these are wrong of.
    pub(crate) fn errs_where(&self, other: &Self) -> bool {
        let wrong = |figure: &&Figure| !figure.is_documented();
        (self.figures.iter().filter(wrong))
            .all(|figure| (other.figures.iter()).any(|same| same.of() == figure.of() && !same.passes()))
    }

    /// A value that has to stay at or below a bound.
    pub fn at_most(&mut self, what: impl Into<String>, measured: f64, bound: f64) {
        self.at_most_documented(what, measured, bound, bound);
    }

    /// A value that stays below `bound` where nothing is wrong, and below `documented` where the case degrades.
    pub fn at_most_documented(&mut self, what: impl Into<String>, measured: f64, bound: f64, documented: f64) {
        self.figures.push(Figure {
            what: what.into(),
            measured,
            bound,
            documented,
            of_soundness: false,
        });
    }

    /// Something of which there must be none in any picture, whatever light it holds.
    fn none_at_all(&mut self, what: impl Into<String>, count: usize) {
        self.none(what, count);
        if let Some(figure) = self.figures.last_mut() {
            figure.of_soundness = true;
        }
    }

    /// Whether nothing is wrong but values.
    pub fn has_sound_pictures(&self) -> bool {
        self.figures
            .iter()
            .all(|figure| figure.passes() || !figure.of_soundness)
    }

    /// Something of which there must be none.
    pub fn none(&mut self, what: impl Into<String>, count: usize) {
        self.at_most(what, count as f64, 0.0);
    }

    /// Something that must hold.
    pub fn holds(&mut self, what: impl Into<String>, holds: bool) {
        self.none(what, usize::from(!holds));
    }

    /// Every sample was finite and is there, and all radiance is finite and not negative.
    pub fn sound(&mut self, what: &str, painted: &Painted) {
        self.none_at_all(format!("{what}: no picture"), usize::from(painted.radiance.is_empty()));
        self.none_at_all(
            format!("{what}: samples that are not finite"),
            painted.non_finite as usize,
        );
        let missing = painted.samples.iter().filter(|n| **n != painted.spp as f32).count();
        self.none_at_all(format!("{what}: pixels that miss samples"), missing);
        let wrong = painted
            .radiance
            .iter()
            .filter(|v| !(v.is_finite() && **v >= 0.0))
            .count();
        self.none_at_all(format!("{what}: radiance negative or not finite"), wrong);
    }

    /// Every value is exactly this.
    pub fn exactly(&mut self, what: &str, painted: &Painted, expected: [f32; 3]) {
        self.sound(what, painted);
        let wrong = painted.radiance.chunks(3).filter(|pixel| *pixel != expected).count();
        self.none(format!("{what}: pixels that are not {expected:?}"), wrong);
    }

    /// Every value is exactly this, but for techniques with a bias, and those whose light comes by walks from the lights: these degrade as documented where up
    /// to these shares of the pixels are not.
    pub fn exactly_unless_biased(
        &mut self,
        what: &str,
        painted: &Painted,
        expected: [f32; 3],
        [biased, by_walks]: [f64; 2],
    ) {
        self.sound(what, painted);
        let wrong = painted.radiance.chunks(3).filter(|pixel| *pixel != expected).count();
        let share = match (painted.tolerance > 0.0, painted.passes.is_some()) {
            (true, _) => biased,
            (false, true) => by_walks,
            (false, false) => 0.0,
        };
        let documented = share * (painted.radiance.len() / 3) as f64;
        let what = format!("{what}: pixels that are not {expected:?}");
        self.at_most_documented(what, wrong as f64, 0.0, documented);
    }

    /// Every value is this up to the rounding of f32 kernels ([`RELATIVE_DEVIATION_FLOOR`]) times `factor`: for what has no noise.
    pub fn exactly_rounded(&mut self, what: &str, painted: &Painted, expected: [f64; 3], factor: f64) {
        self.sound(what, painted);
        let deviation = painted.radiance.iter().enumerate().map(|(i, v)| {
            let expected = expected[i % 3];
            ((f64::from(*v) - expected) / expected).abs()
        });
        let worst = deviation.fold(0.0, f64::max);
        self.at_most(
            format!("{what}: relative error"),
            worst,
            factor * RELATIVE_DEVIATION_FLOOR,
        );
    }

    /// The bits of two pictures are the same.
    pub fn same_bits(&mut self, what: &str, a: &Painted, b: &Painted) {
        let differ = a.bits().iter().zip(&b.bits()).filter(|(a, b)| a != b).count();
        self.none_at_all(format!("{what}: values that differ"), differ);
        self.none_at_all(
            format!("{what}: sizes differ"),
            usize::from(a.bits().len() != b.bits().len()),
        );
    }

    /// The mean over the picture is `expected`, by a z-test a channel, and so is every pixel, by that of `film::z_test`.
    ///
    /// # Errors
    /// That of the z-test, for a picture without values.
    pub fn uniform(&mut self, what: &str, painted: &Painted, expected: [f64; 3]) -> Result<()> {
        self.mean(what, painted, expected, 0.0)?;
        let values: Vec<f32> = (0..painted.radiance.len()).map(|i| expected[i % 3] as f32).collect();
        self.pixels(what, painted, &values)
    }

    /// The mean over the picture is `expected` but for a relative bias of at most `allowed`, which has to be justified where it is stated.
    ///
    /// # Errors
    /// [`Error::Picture`] for a picture without values.
    pub fn mean(&mut self, what: &str, painted: &Painted, expected: [f64; 3], allowed: f64) -> Result<()> {
        self.mean_documented(what, painted, expected, [allowed; 2])
    }

    /// As [`Judgement::mean`], with the bias up to which a case passes and the one up to which it degrades as documented.
    ///
    /// # Errors
    /// As [`Judgement::mean`].
    pub fn mean_documented(
        &mut self,
        what: &str,
        painted: &Painted,
        expected: [f64; 3],
        [bound, documented]: [f64; 2],
    ) -> Result<()> {
        self.sound(what, painted);
        if painted.radiance.is_empty() {
            return Err(Error::Picture {
                path: what.into(),
                cause: "has no values".into(),
            });
        }
        for (channel, (mean, noise)) in mean_and_noise(painted).into_iter().enumerate() {
            let expected = expected[channel];
            let scale = if expected == 0.0 { 1.0 } else { expected };
            // The noise that a right picture has at most, beside the bias that is allowed.
            let noise = noise / scale + RELATIVE_DEVIATION_FLOOR;
            let error = (mean - expected).abs() / scale;
            self.at_most_documented(
                format!("{what}: relative error of the mean"),
                error,
                bound + noise + painted.tolerance,
                documented + noise + painted.tolerance,
            );
        }
        Ok(())
    }

    /// The mean over the picture is at most `limit`, but for noise.
    pub fn mean_at_most(&mut self, what: &str, painted: &Painted, limit: f64) {
        self.sound(what, painted);
        let worst = mean_and_noise(painted).into_iter().map(|(mean, noise)| mean - noise);
        let limit = limit * (1.0 + painted.tolerance);
        self.at_most(format!("{what}: mean less its noise"), worst.fold(0.0, f64::max), limit);
    }

    /// Pixels have the expectations `expected`, as [`same_expectations`](Self::same_expectations) has it.
    ///
    /// # Errors
    /// That of the z-test, for pictures of different sizes.
    pub fn pixels(&mut self, what: &str, painted: &Painted, expected: &[f32]) -> Result<()> {
        let exact = Painted {
            radiance: expected.to_vec(),
            variance: vec![0.0; expected.len()],
            passes: None,
            ..painted.clone()
        };
        self.same_expectations(what, painted, &exact)
    }

    /// Pixels have the expectations of those of an independent picture; where the technique has a bias, or pixels share their noise, means over the picture have.
    ///
    /// # Errors
    /// That of the z-test, for pictures of different sizes.
    pub fn same_expectations(&mut self, what: &str, painted: &Painted, other: &Painted) -> Result<()> {
        self.sound(what, painted);
        if painted.tolerance > 0.0 || painted.passes.is_some() {
            for ((mean, noise), (expected, other_noise)) in
                mean_and_noise(painted).into_iter().zip(mean_and_noise(other))
            {
                let scale = if expected == 0.0 { 1.0 } else { expected };
                let noise = noise.hypot(other_noise) / scale + RELATIVE_DEVIATION_FLOOR;
                self.at_most(
                    format!("{what}: relative error of the mean"),
                    (mean - expected).abs() / scale,
                    noise + painted.tolerance,
                );
            }
            return Ok(());
        }
        let [a, b] = [painted, other];
        let test = z_test(&a.radiance, &a.variance, &b.radiance, &b.variance, SIGNIFICANCE)?;
        self.at_most(
            format!("{what}: share of values that the z-test rejects"),
            1.0 - test.accepted_fraction,
            REJECTED_MAX,
        );
        self.at_most(
            format!("{what}: pictures that the z-test finds different"),
            f64::from(u8::from(test.verdict == Verdict::Different)),
            0.0,
        );
        self.at_most(format!("{what}: z of all differences"), test.bias_z.abs(), SUM_Z_MAX);
        Ok(())
    }

    /// A call has to fail with an error that `fits`.
    pub fn refused<T>(&mut self, what: &str, result: Result<T>, fits: impl FnOnce(&Error) -> bool) {
        let fault = match result {
            Ok(_) => Some("accepted".to_owned()),
            Err(error) if !fits(&error) => Some(error.to_string()),
            Err(_) => None,
        };
        let found = fault.as_deref().unwrap_or("not refused as it has to be");
        self.none_at_all(format!("{what}: {found}"), usize::from(fault.is_some()));
    }
}
