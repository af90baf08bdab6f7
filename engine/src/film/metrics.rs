//! How wrong a picture is: error metrics over linear radiance, and FLIP over tone-mapped pictures.
//!
//! FLIP: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, *FLIP: A Difference Evaluator for Alternating Images*, HPG 2020, by
//! its authors' implementation (crate nv-flip). Relative MSE as in Rousselle, Knaus and Zwicker, *Adaptive Sampling and Reconstruction using Greedy
//! Error Minimization*, 2011, §5.
//! Guarantees: sums are compensated f64 sums in pixel order, so the same pictures give the same bits; pixels that are not finite in either
//! picture are left out, counted and reported.

use std::ops::RangeInclusive;

pub use super::z_test::{ZTest, z_test};

use super::picture::{Layer, Picture};
use super::tone::ToneMap;
use crate::catalogue::{Role, Row, sources};
use crate::{Error, Result};

/// ε of the relative MSE over the square of the reference's mean radiance: where the reference is a tenth of that mean, ε halves the relative error's square.
pub const RELATIVE_MSE_OFFSET: f64 = 0.01;

/// ε of the relative MSE against a reference of these values: `share` of the square of their mean magnitude. It depends on the reference alone, and
/// scales with it, so that a relative error is the same in every unit of radiance. Values that are not finite are left out. A black reference has 0.
///
/// The mean, not the median: that of a noisy picture has the same expectation as that of a converged one, however rarely light is met.
pub fn relative_mse_epsilon(reference: impl IntoIterator<Item = f32>, share: f64) -> f64 {
    let (mut sum, mut count) = (Sum::default(), 0_u64);
    for value in reference.into_iter().filter(|value| value.is_finite()) {
        sum.add(f64::from(value).abs());
        count += 1;
    }
    let mean = sum.value() / count.max(1) as f64;
    share * mean * mean
}

/// A term of the relative MSE: `square` over the square of the reference's `level` + ε. No error is none, even where there is nothing to relate it to.
pub fn relative_square(square: f64, level: f64, epsilon: f64) -> f64 {
    if square == 0.0 {
        0.0
    } else {
        square / (level * level + epsilon)
    }
}

/// The pixels per degree of visual angle that FLIP takes. Fewer than two, and its filters of edges and points have no weight that a float can hold;
/// a thousand is a screen of ours seen from ten metres. FLIP's time and memory grow with the filters' widths, at most 273 pixels here.
pub const PIXELS_PER_DEGREE: RangeInclusive<f32> = 2.0..=1000.0;

/// The most pixels that are compared: FLIP numbers its pictures' values by 32-bit integers.
const MOST_PIXELS: u64 = i32::MAX as u64 / 3;

/// The quantile of the absolute error that is reported.
pub const QUANTILE: f64 = 0.999;

/// What the metrics need to be told.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct CompareOptions {
    /// ε in (a − b)² / (b² + ε) over the square of the reference's mean radiance ([`relative_mse_epsilon`]); default [`RELATIVE_MSE_OFFSET`].
    pub relative_mse_offset: f64,
    /// Tone map applied to both pictures before FLIP, by the reference's brightness where the curve depends on one; default: exposure 0, clipped sRGB.
    pub tone: ToneMap,
    /// Pixels per degree of visual angle for FLIP, in [`PIXELS_PER_DEGREE`]: 2 to 1000. Default 67, the authors' choice: a screen 0.7 m and 3840
    /// pixels wide seen from 0.7 m.
    pub pixels_per_degree: f32,
}

impl Default for CompareOptions {
    fn default() -> Self {
        Self {
            relative_mse_offset: RELATIVE_MSE_OFFSET,
            tone: ToneMap::default(),
            pixels_per_degree: nv_flip::DEFAULT_PIXELS_PER_DEGREE,
        }
    }
}

/// All error metrics of a test picture a against a reference b. Means run over the values (pixels × channels) of the finite pixels.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub struct ErrorReport {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Mean squared error, mean of (a − b)².
    pub mse: f64,
    /// Root of the MSE.
    pub rmse: f64,
    /// Relative mean squared error, mean of (a − b)² / (b² + ε); against a black reference 0 where it is matched, else not finite.
    pub relative_mse: f64,
    /// ε of the relative MSE, in squared units of the reference's radiance.
    pub relative_mse_epsilon: f64,
    /// Mean signed error (bias), mean of a − b.
    pub bias: f64,
    /// Mean signed error over the reference's mean, Σ(a − b) / Σb; 0 for a black reference that is matched, else not finite.
    pub relative_bias: f64,
    /// The 99.9 % quantile of |a − b|: the value at rank ⌈0.999 n⌉ of n.
    pub quantile_999: f64,
    /// The largest |a − b|.
    pub max_error: f64,
    /// Mean FLIP error in [0, 1], over all pixels; those that are not finite in either picture are black in both.
    pub flip: f64,
    /// FLIP's pixels per degree of visual angle.
    pub pixels_per_degree: f32,
    /// Pixels of the test picture with a NaN or an infinity.
    pub non_finite_test: u64,
    /// Pixels of the reference with a NaN or an infinity.
    pub non_finite_reference: u64,
    /// Pixels that were compared.
    pub pixels: u64,
}

impl std::fmt::Display for ErrorReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            width, height, pixels, ..
        } = self;
        let offset = format!("relative MSE (ε = {:.3e})", self.relative_mse_epsilon);
        let flip = format!("FLIP ({:.2} pixels/degree)", self.pixels_per_degree);
        writeln!(f, "{:<28} {pixels} of {width} × {height}", "pixels compared")?;
        for (name, value) in [
            ("MSE", self.mse),
            ("RMSE", self.rmse),
            (offset.as_str(), self.relative_mse),
            ("bias (mean signed error)", self.bias),
            ("relative bias", self.relative_bias),
            ("99.9 % of errors below", self.quantile_999),
            ("largest error", self.max_error),
            (flip.as_str(), self.flip),
        ] {
            writeln!(f, "{name:<28} {value:.6e}")?;
        }
        write!(
            f,
            "{:<28} test {}, reference {}",
            "pixels not finite", self.non_finite_test, self.non_finite_reference
        )
    }
}

/// A compensated f64 sum (Neumaier 1974): its error does not grow with the count.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Sum {
    sum: f64,
    rest: f64,
}

impl Sum {
    /// Adds one summand.
    pub(crate) fn add(&mut self, value: f64) {
        let sum = self.sum + value;
        self.rest += if self.sum.abs() >= value.abs() {
            (self.sum - sum) + value
        } else {
            (value - sum) + self.sum
        };
        self.sum = sum;
    }

    /// The sum so far.
    pub(crate) fn value(self) -> f64 {
        self.sum + self.rest
    }
}

/// Rec. 709 luminance of linear RGB, weights of ITU-R BT.709-6 §3.
pub fn luminance(rgb: [f32; 3]) -> f64 {
    0.2126 * f64::from(rgb[0]) + 0.7152 * f64::from(rgb[1]) + 0.0722 * f64::from(rgb[2])
}

/// Compares the main layers of two pictures.
///
/// # Errors
/// [`Error::Picture`] when sizes or channel counts differ, a main layer is missing, there are more than 715 million pixels, or an option is out of
/// its range: the offset of the relative MSE is finite and above 0, pixels per degree are in [`PIXELS_PER_DEGREE`].
pub fn compare(test: &Picture, reference: &Picture, options: &CompareOptions) -> Result<ErrorReport> {
    let size = check(test, reference, options)?;
    compare_layers(test.main_layer()?, reference.main_layer()?, size, options)
}

/// The FLIP error of every pixel, in [0, 1], the top row first: for a false-colour picture. Pixels that are not finite in either picture are
/// black in both.
///
/// # Errors
/// As [`compare`].
pub fn flip_map(test: &Picture, reference: &Picture, options: &CompareOptions) -> Result<Vec<f32>> {
    let size = check(test, reference, options)?;
    Ok(flip_layers(test.main_layer()?, reference.main_layer()?, size, options))
}

/// The common size of two pictures that can be compared.
fn check(test: &Picture, reference: &Picture, options: &CompareOptions) -> Result<(u32, u32)> {
    let (size, expected) = ((test.width(), test.height()), (reference.width(), reference.height()));
    let wrong = |cause: String| {
        Err(Error::Picture {
            path: "comparison".into(),
            cause,
        })
    };
    if size != expected {
        return wrong(format!(
            "the test picture is {}×{}, the reference {}×{}",
            size.0, size.1, expected.0, expected.1
        ));
    }
    if u64::from(size.0) * u64::from(size.1) > MOST_PIXELS {
        return wrong(format!("{}×{} are more than {MOST_PIXELS} pixels", size.0, size.1));
    }
    let offset = options.relative_mse_offset;
    if !(offset > 0.0 && offset.is_finite()) {
        return wrong(format!(
            "the relative MSE's offset must be finite and above 0, and is {offset}"
        ));
    }
    if !PIXELS_PER_DEGREE.contains(&options.pixels_per_degree) {
        let (least, most) = (*PIXELS_PER_DEGREE.start(), *PIXELS_PER_DEGREE.end());
        let given = options.pixels_per_degree;
        return wrong(format!(
            "the pixels per degree must be in {least} to {most}, and are {given}"
        ));
    }
    Ok(size)
}

fn compare_layers(test: &Layer, reference: &Layer, size: (u32, u32), options: &CompareOptions) -> Result<ErrorReport> {
    let channels = test.channels();
    if channels != reference.channels() {
        return Err(Error::Picture {
            path: "comparison".into(),
            cause: format!(
                "the test layer has {channels} channels, the reference {}",
                reference.channels()
            ),
        });
    }
    let epsilon = relative_mse_epsilon(reference.values().iter().copied(), options.relative_mse_offset);
    let (mut squared, mut relative, mut signed, mut level) =
        (Sum::default(), Sum::default(), Sum::default(), Sum::default());
    let (mut non_finite_test, mut non_finite_reference) = (0, 0);
    let mut errors = Vec::with_capacity(test.values().len());
    let pairs = test
        .values()
        .chunks_exact(channels)
        .zip(reference.values().chunks_exact(channels));
    for (a, b) in pairs {
        let finite = [a, b].map(|pixel| pixel.iter().all(|v| v.is_finite()));
        non_finite_test += u64::from(!finite[0]);
        non_finite_reference += u64::from(!finite[1]);
        if finite != [true; 2] {
            continue;
        }
        for (a, b) in a.iter().zip(b) {
            let (a, b) = (f64::from(*a), f64::from(*b));
            let error = a - b;
            squared.add(error * error);
            relative.add(relative_square(error * error, b, epsilon));
            signed.add(error);
            level.add(b);
            errors.push(error.abs());
        }
    }
    errors.sort_by(f64::total_cmp);
    let count = errors.len();
    let mean = |sum: Sum| sum.value() / count.max(1) as f64;
    let rank = (QUANTILE * count as f64).ceil() as usize;
    let relative_bias = if signed.value() == 0.0 {
        0.0
    } else {
        signed.value() / level.value()
    };
    Ok(ErrorReport {
        width: size.0,
        height: size.1,
        mse: mean(squared),
        rmse: mean(squared).sqrt(),
        relative_mse: mean(relative),
        relative_mse_epsilon: epsilon,
        bias: mean(signed),
        relative_bias,
        quantile_999: errors.get(rank.saturating_sub(1)).copied().unwrap_or(0.0),
        max_error: errors.last().copied().unwrap_or(0.0),
        flip: mean_flip(test, reference, size, options),
        pixels_per_degree: options.pixels_per_degree,
        non_finite_test,
        non_finite_reference,
        pixels: (count / channels) as u64,
    })
}

fn flip_layers(test: &Layer, reference: &Layer, size: (u32, u32), options: &CompareOptions) -> Vec<f32> {
    let (mut a, mut b) = (Vec::new(), Vec::new());
    for (test, reference) in test.pixels().zip(reference.pixels()) {
        let finite = test.iter().chain(&reference).all(|v| v.is_finite());
        a.push(if finite { test } else { [0.0; 3] });
        b.push(if finite { reference } else { [0.0; 3] });
    }
    // Both by the reference's brightness, or a picture twice as bright would look the same.
    let shown = |pixels: &[[f32; 3]]| options.tone.display_beside(pixels, &b, size.0).concat();
    let (a, b) = (shown(&a), shown(&b));
    let picture = |bytes: &[u8]| nv_flip::FlipImageRgb8::with_data(size.0, size.1, bytes);
    nv_flip::flip(picture(&b), picture(&a), options.pixels_per_degree).to_vec()
}

fn mean_flip(test: &Layer, reference: &Layer, size: (u32, u32), options: &CompareOptions) -> f64 {
    let map = flip_layers(test, reference, size, options);
    let mut sum = Sum::default();
    for value in &map {
        sum.add(f64::from(*value));
    }
    sum.value() / map.len().max(1) as f64
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-ERROR",
    name: "error metrics: MSE, relative MSE, bias, quantile, FLIP",
    role: Role::Service,
    limits: "Pixels that are not finite in either picture are left out and counted; FLIP sees tone-mapped pictures.",
    sources: &[sources::ROUSSELLE_2011.whole(), sources::ANDERSSON_2020.whole()],
    tests: &[
        "engine/src/film/metrics.rs::formulas_give_what_hand_calculation_gives",
        "engine/src/film/metrics.rs::quantile_is_the_value_at_its_rank",
        "engine/src/film/metrics.rs::relative_errors_are_the_same_in_every_unit",
        "engine/src/film/metrics.rs::flip_sees_what_tone_mapping_shows",
        "engine/src/film/metrics.rs::pixels_per_degree_are_in_their_range_and_finite_there",
    ],
    api: &["clerestory::film::compare", "clerestory::film::ErrorReport"],
    settings: &["clerestory::film::CompareOptions", "clerestory compare a.exr b.exr"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(values: &[f32]) -> Result<Picture> {
        Picture::from_radiance((values.len() / 3) as u32, 1, values.to_vec())
    }

    #[test]
    fn formulas_give_what_hand_calculation_gives() -> Result<()> {
        let test = picture(&[1.0, 2.0, 3.0, 0.0, 0.0, 0.0])?;
        let reference = picture(&[1.0, 1.0, 1.0, 0.0, 0.0, 0.5])?;
        let report = compare(&test, &reference, &CompareOptions::default())?;
        // Errors 0, 1, 2, 0, 0, −½.
        assert_eq!(report.mse, 5.25 / 6.0);
        assert_eq!(report.rmse, (5.25f64 / 6.0).sqrt());
        // The reference's mean is 3.5 / 6.
        let epsilon = 0.01 * 12.25 / 36.0;
        assert!((report.relative_mse_epsilon / epsilon - 1.0).abs() < 1e-14);
        let relative = (1.0 / (1.0 + epsilon) + 4.0 / (1.0 + epsilon) + 0.25 / (0.25 + epsilon)) / 6.0;
        assert!((report.relative_mse - relative).abs() < 1e-14);
        assert_eq!(report.bias, 2.5 / 6.0);
        assert_eq!(report.relative_bias, 2.5 / 3.5);
        assert_eq!((report.quantile_999, report.max_error), (2.0, 2.0));
        assert_eq!(
            (report.pixels, report.non_finite_test, report.non_finite_reference),
            (2, 0, 0)
        );
        assert!(report.flip > 0.0 && report.flip <= 1.0);
        Ok(())
    }

    #[test]
    fn relative_errors_are_the_same_in_every_unit() -> Result<()> {
        let (test, reference) = ([1.0, 2.0, 3.0, 0.0, 0.1, 0.0], [1.0, 1.0, 1.0, 0.0, 0.0, 0.5]);
        let of = |unit: f32| {
            let [test, reference] = [test, reference].map(|values| picture(&values.map(|value: f32| value * unit)));
            compare(&test?, &reference?, &CompareOptions::default()).map(|report| report.relative_mse)
        };
        let one = of(1.0)?;
        for unit in [1e-12, 1e-3, 1e3, 1e12] {
            // Of the pictures in f32: 2⁻²⁴ a value.
            assert!((of(unit)? / one - 1.0).abs() < 1e-6, "{unit}");
        }
        // Black is related to nothing.
        let black = picture(&[0.0; 6])?;
        let against_black =
            |test: &Picture| compare(test, &black, &CompareOptions::default()).map(|report| report.relative_mse);
        assert_eq!(against_black(&black)?, 0.0);
        assert!(!against_black(&picture(&test)?)?.is_finite());
        Ok(())
    }

    #[test]
    fn equal_pictures_have_no_error() -> Result<()> {
        let a = picture(&[0.1, 0.2, 0.3, 9.0, 8.0, 7.0])?;
        let report = compare(&a, &a, &CompareOptions::default())?;
        assert_eq!(
            (
                report.mse,
                report.bias,
                report.relative_bias,
                report.flip,
                report.max_error
            ),
            (0.0, 0.0, 0.0, 0.0, 0.0)
        );
        Ok(())
    }

    #[test]
    fn pixels_that_are_not_finite_are_left_out_and_counted() -> Result<()> {
        let test = picture(&[f32::NAN, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0, f32::INFINITY, f32::NAN])?;
        let reference = picture(&[0.0, 0.0, 0.0, 1.0, 1.0, 1.0, f32::NAN, 0.0, 0.0])?;
        let report = compare(&test, &reference, &CompareOptions::default())?;
        assert_eq!(
            (report.pixels, report.non_finite_test, report.non_finite_reference),
            (1, 2, 1)
        );
        assert_eq!((report.mse, report.flip), (0.0, 0.0));
        assert!(report.to_string().contains("test 2, reference 1"));
        Ok(())
    }

    #[test]
    fn sizes_must_agree() -> Result<()> {
        let wide = Picture::from_radiance(2, 1, vec![0.0; 6])?;
        let tall = Picture::from_radiance(1, 2, vec![0.0; 6])?;
        assert!(matches!(
            compare(&wide, &tall, &CompareOptions::default()),
            Err(Error::Picture { .. })
        ));
        Ok(())
    }

    #[test]
    fn pixels_per_degree_are_in_their_range_and_finite_there() -> Result<()> {
        let values: Vec<f32> = (0..16 * 16 * 3).map(|i| (i % 7) as f32 / 7.0).collect();
        let test = Picture::from_radiance(16, 16, values)?;
        let reference = Picture::from_radiance(16, 16, vec![0.5; 16 * 16 * 3])?;
        let of = |pixels_per_degree, relative_mse_offset| {
            let options = CompareOptions {
                pixels_per_degree,
                relative_mse_offset,
                ..CompareOptions::default()
            };
            compare(&test, &reference, &options).map(|report| report.flip)
        };
        for pixels_per_degree in [*PIXELS_PER_DEGREE.start(), 67.0, *PIXELS_PER_DEGREE.end()] {
            let flip = of(pixels_per_degree, RELATIVE_MSE_OFFSET)?;
            assert!(flip > 0.0 && flip <= 1.0, "{pixels_per_degree}: {flip}");
        }
        // 1e-30 gave NaN, 1e9 did not end and 3e9 crashed.
        for refused in [1e-30, 0.0, -67.0, 1.9, 1000.5, 1e9, 3e9, f32::INFINITY, f32::NAN] {
            match of(refused, RELATIVE_MSE_OFFSET) {
                Err(Error::Picture { cause, .. }) => assert!(cause.contains("2 to 1000"), "{cause}"),
                other => panic!("{refused}: {other:?}"),
            }
        }
        for refused in [0.0, -1.0, f64::INFINITY, f64::NAN] {
            assert!(matches!(of(67.0, refused), Err(Error::Picture { .. })), "{refused}");
        }
        Ok(())
    }

    #[test]
    fn quantile_is_the_value_at_its_rank() -> Result<()> {
        let test: Vec<f32> = (0..3000u32).map(|i| (i * 7919 % 3000) as f32).collect();
        let report = compare(
            &picture(&test)?,
            &picture(&vec![0.0; 3000])?,
            &CompareOptions::default(),
        )?;
        // Errors 0 … 2999: rank ⌈2997⌉ holds 2996.
        assert_eq!((report.quantile_999, report.max_error), (2996.0, 2999.0));
        Ok(())
    }

    #[test]
    fn flip_sees_what_tone_mapping_shows() -> Result<()> {
        let grey = |v: f32| Picture::from_radiance(32, 32, vec![v; 32 * 32 * 3]);
        let report = |a, b| compare(&grey(a)?, &grey(b)?, &CompareOptions::default()).map(|r| r.flip);
        assert_eq!(report(2.0, 3.0)?, 0.0, "both clip to white");
        // Black against white is FLIP's largest error: the authors normalise it to 1 within their tables' rounding.
        assert!(report(0.0, 1.0)? > 0.95);
        assert!(report(0.5, 0.6)? < report(0.3, 0.6)?);
        Ok(())
    }

    #[test]
    fn the_sum_keeps_what_a_plain_sum_loses() {
        let mut sum = Sum::default();
        for value in [1.0, 1e100, 1.0, -1e100] {
            sum.add(value);
        }
        assert_eq!(sum.value(), 2.0);
    }
}
