//! A complex index of refraction over wavelengths: from the tables, or from a user's text.

use super::observer;
use crate::scene::ConductorIor;
use glam::Vec3;

/// Most samples of a text.
const SAMPLES_MAX: usize = 65_536;
/// Wavelengths, in nanometres, that a text has to cover: beyond them eyes see next to nothing.
const COVERED: [f64; 2] = [400.0, 700.0];

/// Samples of a material's complex index of refraction, by increasing wavelength.
#[derive(Debug, Clone, PartialEq)]
pub struct IndexSpectrum {
    /// Wavelength in nanometres, n, k.
    samples: Vec<[f64; 3]>,
}

impl IndexSpectrum {
    pub(super) fn new(samples: Vec<[f64; 3]>) -> Self {
        Self { samples }
    }

    /// Reads lines of a wavelength in nanometres, n and k, apart by spaces, tabs, commas or semicolons; what follows a `#` is left out.
    ///
    /// # Errors
    /// With its line: a line that has not three numbers, wavelengths that do not rise, n below a millionth, k below 0, any of them above a million; fewer than two samples,
    /// more than 65,536, or samples that do not cover 400 to 700 nm.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        let mut samples: Vec<[f64; 3]> = Vec::new();
        for (line, text) in (1..).zip(text.lines()) {
            let text = text.split('#').next().unwrap_or_default();
            let apart = |c: char| c.is_whitespace() || matches!(c, ',' | ';');
            let words: Vec<&str> = text.split(apart).filter(|word| !word.is_empty()).take(4).collect();
            if words.is_empty() {
                continue;
            }
            let fault = |cause: &str| Err(format!("line {line}: {cause}"));
            let numbers: Option<Vec<f64>> = words.iter().map(|word| word.parse().ok()).collect();
            let Some([wavelength, n, k]) = numbers.and_then(|numbers| <[f64; 3]>::try_from(numbers).ok()) else {
                return fault("needs three numbers: a wavelength in nanometres, n and k");
            };
            let sound = |x: f64, least: f64| (least..=1e6).contains(&x);
            if !(sound(wavelength, 0.0) && sound(n, 1e-6) && sound(k, 0.0)) {
                return fault(
                    "n must be at least a millionth, k and the wavelength at least 0, all of them at most a million",
                );
            }
            if samples.last().is_some_and(|last| last[0] >= wavelength) {
                return fault("wavelengths must rise from line to line");
            }
            if samples.len() == SAMPLES_MAX {
                return fault("has more than 65536 samples");
            }
            samples.push([wavelength, n, k]);
        }
        let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
            return Err("has no samples".into());
        };
        if first[0] > COVERED[0] || last[0] < COVERED[1] {
            let hint = if last[0] < 100.0 {
                "; they look like micrometres"
            } else {
                ""
            };
            return Err(format!(
                "wavelengths from {} to {} nm do not cover 400 to 700 nm{hint}",
                first[0], last[0]
            ));
        }
        Ok(Self { samples })
    }

    /// The first and the last wavelength of the samples, in nanometres.
    pub fn range(&self) -> [f64; 2] {
        let ends = [self.samples.first(), self.samples.last()];
        ends.map(|sample| sample.map_or(0.0, |sample| sample[0]))
    }

    /// n and k at a wavelength in nanometres, by linear interpolation; outside of the samples those of the nearest one.
    pub fn at(&self, wavelength: f64) -> [f64; 2] {
        let above = self.samples.partition_point(|sample| sample[0] < wavelength);
        let (Some(low), Some(high)) = (
            self.samples.get(above.saturating_sub(1)),
            self.samples.get(above).or(self.samples.last()),
        ) else {
            return [1.0, 0.0];
        };
        let t = if high[0] > low[0] {
            ((wavelength - low[0]) / (high[0] - low[0])).clamp(0.0, 1.0)
        } else {
            0.0
        };
        [1, 2].map(|quantity| low[quantity] + t * (high[quantity] - low[quantity]))
    }

    /// The means of n and k over the red, green and blue channels' sensitivities, as for the engine's own metals. The sensitivities have negative
    /// parts, so that sharp spectra can give means that no material has, which are cut off at the ends of what a scene may hold
    /// ([`ConductorIor::is_in_range`]).
    pub fn channels(&self) -> ConductorIor {
        let mean = |quantity: usize| observer::project(|wavelength| self.at(wavelength)[quantity]).as_vec3();
        let [least, greatest] = ConductorIor::ETA.map(Vec3::splat);
        ConductorIor {
            eta: mean(0).clamp(least, greatest),
            k: mean(1).clamp(Vec3::ZERO, Vec3::splat(ConductorIor::K_MAX)),
        }
    }

    /// n and k at three single wavelengths in nanometres, in the place of red, green and blue.
    pub fn at_wavelengths(&self, wavelengths: [f64; 3]) -> ConductorIor {
        let indices = wavelengths.map(|wavelength| self.at(wavelength));
        let part = |quantity: usize| glam::DVec3::from_array(indices.map(|index| index[quantity])).as_vec3();
        ConductorIor {
            eta: part(0),
            k: part(1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_spectra_are_read_and_checked() {
        let read =
            IndexSpectrum::parse("# gold\n380 1.5 1.8\n500,0.9;1.9 # edge\n\n800\t0.2\t5.0\r\n").expect("spectrum");
        assert_eq!(read.at(440.0), [1.2, 1.85]);
        assert_eq!((read.at(100.0), read.at(900.0)), ([1.5, 1.8], [0.2, 5.0]));
        let constant = IndexSpectrum::parse("400 0.5 2\n700 0.5 2")
            .expect("spectrum")
            .channels();
        assert!((constant.eta - 0.5).abs().max_element() < 1e-6 && (constant.k - 2.0).abs().max_element() < 1e-6);
        assert_eq!(read.range(), [380.0, 800.0]);
        // A line where the sensitivity to red is most negative.
        let sharp = (380..=780).map(|w| {
            format!(
                "{w} {} {}\n",
                if w == 510 { 1e6 } else { 1e-6 },
                if w == 510 { 1e6 } else { 0.0 }
            )
        });
        let sharp = IndexSpectrum::parse(&sharp.collect::<String>())
            .expect("spectrum")
            .channels();
        assert!(
            sharp.is_in_range() && sharp.eta.x == ConductorIor::ETA[0] && sharp.k.x == 0.0,
            "{sharp:?}"
        );
        for (text, words) in [
            ("", "no samples"),
            ("# nothing", "no samples"),
            ("400 1\n", "line 1: needs three numbers"),
            ("400 1 2 3\n", "line 1: needs three numbers"),
            ("400 1 x\n", "line 1: needs three numbers"),
            ("400 1 2\n\n400 1 2\n", "line 3: wavelengths must rise"),
            ("400 1e-7 2\n", "line 1: n must be at least a millionth"),
            ("400 0 2\n", "line 1: n must be at least a millionth"),
            ("400 1 -2\n", "line 1: n must be at least a millionth"),
            ("400 nan 2\n", "line 1: n must be at least a millionth"),
            ("400 1 inf\n", "line 1: n must be at least a millionth"),
            ("450 1 2\n800 1 2\n", "do not cover"),
            ("0.38 1 2\n0.8 1 2\n", "micrometres"),
        ] {
            let message = IndexSpectrum::parse(text).expect_err(text);
            assert!(message.contains(words), "{text:?}: {message}");
        }
    }
}
