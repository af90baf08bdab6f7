//! `clerestory compare`: how wrong a picture is against a reference.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use clerestory::film::picture::{SAMPLES, VARIANCE};
use clerestory::film::z_test::SIGNIFICANCE;
use clerestory::film::{CompareOptions, ErrorReport, Picture, ToneMap, ZTest, compare, png, z_test};

use super::render::Tone;
use crate::failure::{Code, Failure, Outcome};
use crate::outputs::{Inputs, Outputs, Overwriting};
use crate::{output, pictures};

/// Compares a picture with a reference: all error metrics, and a difference picture
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  clerestory compare picture.exr reference.exr
  clerestory compare picture.exr reference.exr --diff difference.png
  clerestory compare a.exr b.exr --threshold rmse=1e-3,flip=0.05     exit code 4 if either is exceeded

Metrics are of linear radiance, FLIP of tone-mapped pictures. The relative MSE is the mean of (a - b)² / (b² + ε), where ε is a \
hundredth of the square of the reference's mean: the same in every unit of radiance. A metric that is not a number exceeds every threshold; so do pixels \
that are not finite, unless non_finite=COUNT allows them. Where both pictures have variance (render with --aov variance,samples) and \
more than one sample per pixel, a z-test says whether they agree, differ by more than noise, or cannot be told apart from heavy tails.")]
pub struct Arguments {
    /// The picture: EXR, Radiance HDR or PNG (taken as sRGB)
    picture: PathBuf,
    /// The reference, of the same size
    reference: PathBuf,
    /// Writes the signed difference as PNG: red too bright, blue too dark, white equal, magenta NaN
    #[arg(long, value_name = "FILE.png")]
    diff: Option<PathBuf>,
    /// Radiance difference shown as full colour; by default the 99.9 % quantile of the error
    #[arg(long, value_name = "RADIANCE", value_parser = positive, requires = "diff")]
    diff_scale: Option<f32>,
    /// Fails with exit code 4 when a metric (for biases its magnitude) is greater: mse, rmse, relative_mse, bias, relative_bias,
    /// quantile_999, max_error, flip, non_finite
    #[arg(long, value_name = "METRIC=LIMIT", value_delimiter = ',', value_parser = parse_threshold)]
    threshold: Vec<Threshold>,
    /// Exposure in stops, for FLIP
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
    exposure: f64,
    /// Tone curve, for FLIP
    #[arg(long, value_enum, default_value_t = Tone::Srgb)]
    tone: Tone,
    /// Prints JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    overwriting: Overwriting,
}

/// Reads a finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    let value = text.trim().parse::<f64>().ok().filter(|value| value.is_finite());
    value.ok_or_else(|| "write a finite number".into())
}

fn positive(text: &str) -> Result<f32, String> {
    let value = text.trim().parse::<f32>().ok();
    value
        .filter(|value| value.is_finite() && *value > 0.0)
        .ok_or_else(|| "write a number above 0".into())
}

/// A metric and the most that it may be.
#[derive(Debug, Clone)]
struct Threshold {
    metric: &'static str,
    limit: f64,
}

type Metric = (&'static str, fn(&ErrorReport) -> f64);

const METRICS: [Metric; 9] = [
    ("mse", |report| report.mse),
    ("rmse", |report| report.rmse),
    ("relative_mse", |report| report.relative_mse),
    ("bias", |report| report.bias.abs()),
    ("relative_bias", |report| report.relative_bias.abs()),
    ("quantile_999", |report| report.quantile_999),
    ("max_error", |report| report.max_error),
    ("flip", |report| report.flip),
    (NON_FINITE, |report| {
        (report.non_finite_test + report.non_finite_reference) as f64
    }),
];
const NON_FINITE: &str = "non_finite";

fn parse_threshold(text: &str) -> Result<Threshold, String> {
    let (name, limit) = text.split_once('=').ok_or("write METRIC=LIMIT, such as rmse=1e-3")?;
    let known: Vec<&str> = METRICS.iter().map(|(name, _)| *name).collect();
    let metric = known.iter().find(|metric| **metric == name.trim());
    let metric = metric.ok_or_else(|| format!("{name:?} is not a metric; there are: {}", known.join(", ")))?;
    let limit = finite(limit)?;
    if limit < 0.0 {
        return Err("a limit is at least 0".into());
    }
    Ok(Threshold { metric, limit })
}

/// A threshold that is passed.
#[derive(Debug, serde::Serialize)]
struct Exceeded {
    metric: &'static str,
    /// `None` when it is not a number.
    value: Option<f64>,
    limit: f64,
}

fn exceeded(report: &ErrorReport, thresholds: &[Threshold]) -> Vec<Exceeded> {
    let mut thresholds = thresholds.to_vec();
    if !thresholds.is_empty() && !thresholds.iter().any(|threshold| threshold.metric == NON_FINITE) {
        thresholds.push(Threshold {
            metric: NON_FINITE,
            limit: 0.0,
        });
    }
    let value = |name: &str| {
        METRICS
            .iter()
            .find(|(metric, _)| *metric == name)
            .map_or(f64::NAN, |(_, of)| of(report))
    };
    let beyond = |threshold: &Threshold| {
        let value = value(threshold.metric);
        // Nothing compared is nothing shown to agree.
        let within = value <= threshold.limit && report.pixels > 0;
        (!within).then_some(Exceeded {
            metric: threshold.metric,
            value: value.is_finite().then_some(value),
            limit: threshold.limit,
        })
    };
    thresholds.iter().filter_map(beyond).collect()
}

/// The z-test of two pictures that both know their variance.
fn noise_test(test: &Picture, reference: &Picture) -> Outcome<Option<ZTest>> {
    let sampled = |picture: &Picture| {
        let samples = picture.layer(SAMPLES);
        samples.is_none_or(|samples| samples.values().iter().all(|count| *count > 1.0))
    };
    let (Some(a), Some(b)) = (test.layer(VARIANCE), reference.layer(VARIANCE)) else {
        return Ok(None);
    };
    if !sampled(test) || !sampled(reference) {
        return Ok(None);
    }
    let (test, reference) = (test.main_layer()?, reference.main_layer()?);
    Ok(Some(z_test(
        test.values(),
        a.values(),
        reference.values(),
        b.values(),
        SIGNIFICANCE,
    )?))
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Outcome<ExitCode> {
    let diff = arguments
        .diff
        .as_deref()
        .map(|path| plan(arguments, path))
        .transpose()?;
    let (test, reference) = (
        pictures::read(&arguments.picture)?,
        pictures::read(&arguments.reference)?,
    );
    let size = |picture: &Picture| format!("{}×{}", picture.width(), picture.height());
    if size(&test) != size(&reference) {
        return Err(Failure::usage(format!(
            "{} has {} pixels, {} has {}: only pictures of one size can be compared",
            arguments.picture.display(),
            size(&test),
            arguments.reference.display(),
            size(&reference)
        )));
    }
    let options = CompareOptions {
        tone: ToneMap {
            exposure: arguments.exposure,
            curve: arguments.tone.into(),
        },
        ..CompareOptions::default()
    };
    let report = compare(&test, &reference, &options)?;
    let noise = noise_test(&test, &reference)?;
    let mut unwritten = Ok(());
    if let Some(plan) = &diff {
        let scale = arguments.diff_scale.unwrap_or_else(|| difference_scale(&report));
        let picture = png::difference(test.main_layer()?, reference.main_layer()?, test.width(), scale)?;
        let written = plan.write(&[png::to_bytes(&picture, "the difference")?], || None);
        output::note(&format!(
            "{}: full colour is a difference of {scale:.3e}",
            written.names()
        ));
        unwritten = written.check();
    }
    let exceeded = exceeded(&report, &arguments.threshold);
    if arguments.json {
        output::print_json(&serde_json::json!({
            "picture": arguments.picture,
            "reference": arguments.reference,
            "metrics": report,
            "z_test": noise,
            "exceeded": exceeded,
        }))?;
    } else {
        let noise = noise
            .map(|test| format!("{:<28} {test}\n", "z-test"))
            .unwrap_or_default();
        output::print(&format!("{report}\n{noise}"))?;
    }
    unwritten?;
    if exceeded.is_empty() {
        return Ok(ExitCode::SUCCESS);
    }
    let list: Vec<String> = exceeded
        .iter()
        .map(|e| {
            let value = e.value.map_or("not a number".into(), |value| format!("{value:.3e}"));
            format!("{} is {value}, above {:.3e}", e.metric, e.limit)
        })
        .collect();
    Err(Failure {
        code: Code::Differ,
        message: format!("the pictures differ: {}", list.join("; ")),
        hint: None,
    })
}

fn difference_scale(report: &ErrorReport) -> f32 {
    let scale = report.quantile_999 as f32;
    if scale.is_finite() && scale > 0.0 { scale } else { 1.0 }
}

/// The plan of the difference picture.
fn plan(arguments: &Arguments, path: &Path) -> Outcome<Outputs> {
    if pictures::extension(path) != "png" {
        return Err(Failure::usage(format!(
            "--diff {}: the difference is written as .png",
            path.display()
        )));
    }
    let inputs = Inputs::of([&arguments.picture, &arguments.reference]);
    Outputs::one(path, &inputs, arguments.overwriting.overwrite)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_are_read_or_refused_with_what_is_expected() {
        assert!(parse_threshold("rmse=1e-3").is_ok_and(|t| t.metric == "rmse" && t.limit == 1e-3));
        for (text, word) in [
            ("rmse", "METRIC=LIMIT"),
            ("ssim=1", "flip"),
            ("mse=x", "finite"),
            ("mse=-1", "at least 0"),
        ] {
            assert!(parse_threshold(text).is_err_and(|cause| cause.contains(word)), "{text}");
        }
    }

    #[test]
    fn what_is_not_a_number_is_beyond_every_threshold() -> Outcome {
        let limits = |text: &str| {
            vec![parse_threshold(text).map_err(Failure::usage)]
                .into_iter()
                .collect::<Outcome<Vec<_>>>()
        };
        let black = Picture::from_radiance(8, 8, vec![0.0; 192])?;
        let mut broken = black.clone();
        if let Some(layer) = broken.layer_mut("radiance") {
            layer.values_mut()[0] = f32::NAN;
        }
        let report = compare(&broken, &black, &CompareOptions::default())?;
        assert!(exceeded(&report, &[]).is_empty());
        assert_eq!(exceeded(&report, &limits("mse=1")?)[0].metric, NON_FINITE);
        assert!(exceeded(&report, &limits("non_finite=1")?).is_empty());
        let nothing = Picture::from_radiance(8, 8, vec![f32::NAN; 192])?;
        let report = compare(&nothing, &black, &CompareOptions::default())?;
        assert!(!exceeded(&report, &limits("non_finite=64")?).is_empty());
        Ok(())
    }
}
