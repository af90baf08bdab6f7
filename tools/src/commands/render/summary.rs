//! What `render` says at the end by default: about ten lines that matter. The frame report has all the rest.

use clerestory::film::Picture;
use clerestory::film::metrics::RELATIVE_MSE_OFFSET;
use clerestory::plan::{Goal, relative_mse_by_variance};
use clerestory::render::FrameReport;
use clerestory::techniques::{self, Bias};

use super::files::{Document, ErrorAgainst};
use crate::frame_report;
use crate::output::{self, Stream};

/// Why the picture was made by its technique.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Why {
    /// The command line names it.
    Asked,
    /// The scene names it.
    Scene,
    /// Nothing names one.
    Default,
    /// It was chosen for an error or a time.
    Chosen(Goal),
}

impl Why {
    fn text(self) -> String {
        match self {
            Self::Asked => "as asked for".into(),
            Self::Scene => "as the scene asks for".into(),
            Self::Default => "the default".into(),
            Self::Chosen(goal) => {
                let error = goal.error.map(|error| format!("an error of {error}"));
                let time = goal.time.map(|time| format!("{} s", time.as_secs_f64()));
                let goals: Vec<String> = error.into_iter().chain(time).collect();
                format!("chosen for {}", goals.join(" and "))
            }
        }
    }
}

/// Counters whose rates are shown, with their units.
const RATES: [(&str, &str); 4] = [
    ("frames", "frames"),
    ("paths", "paths"),
    ("rays", "rays"),
    ("photons_emitted", "photons"),
];

/// The lines; `files` are the names of what was written.
pub fn text(document: &Document<'_>, picture: &Picture, files: &str, why: Why) -> String {
    let report = document.report;
    let [width, height] = report.size;
    let mut text = String::new();
    let mut line = |name: &str, value: &str| {
        if !value.is_empty() {
            text += &format!("{name:<9}  {value}\n");
        }
    };
    line("picture", &output::one_line(files));
    line(
        "scene",
        &output::one_line(&format!(
            "{}, camera {}, {width} × {height} pixels",
            report.scene, report.camera
        )),
    );
    line("technique", &technique(report, why));
    line(
        "device",
        &output::one_line(&format!("{}, driver {}", report.device, report.driver)),
    );
    line("seconds", &seconds(report));
    line("samples", &samples(report));
    line("rates", &rates(report));
    line(
        "memory",
        &format!("{} on the device", output::bytes(report.memory.total())),
    );
    line("error", &error(document.error.as_ref(), report, picture));
    line("notes", &notes(report));
    line("more", "--stats table, or the JSON file");
    text
}

fn technique(report: &FrameReport, why: Why) -> String {
    let bias = techniques::by_id(&report.technique).map_or(String::new(), |card| format!("; {}", card.bias));
    let paths = if report.path_set == "all" {
        String::new()
    } else {
        format!("; light paths: {}", report.path_set)
    };
    output::one_line(&format!("{}, {}{bias}{paths}", report.technique, why.text()))
}

fn seconds(report: &FrameReport) -> String {
    format!(
        "{:.2} rendering, {:.2} of them after the first step, which compiles kernels, and {:.2} on the GPU; {:.2} upload and index",
        report.render_seconds, report.steady_seconds, report.gpu_seconds, report.upload_seconds
    )
}

fn samples(report: &FrameReport) -> String {
    let samples = match report.samples {
        [least, most] if least == most => most.to_string(),
        [least, most] => format!("{least} to {most}"),
    };
    let wanted = if report.samples == [report.spp; 2] {
        String::new()
    } else {
        format!(" of {}", report.spp)
    };
    format!("{samples}{wanted} per pixel, seed {}", report.seed)
}

fn rates(report: &FrameReport) -> String {
    let pixels = report.size.map(f64::from).iter().product::<f64>();
    let of_samples = ["paths", "samples"]
        .iter()
        .find_map(|name| frame_report::rate(report, name));
    let per_pixel = of_samples.map(|rate| format!("{}samples per pixel per second", output::metric(rate / pixels)));
    let others = RATES.iter().filter_map(|(name, unit)| {
        let rate = frame_report::rate(report, name)?;
        Some(format!("{}{unit}/s", output::metric(rate)))
    });
    let all: Vec<String> = per_pixel.into_iter().chain(others).collect();
    // A picture that took one step has no other rates.
    let with = if report.steady_rates.is_empty() && !all.is_empty() {
        ", with compilation"
    } else {
        ""
    };
    all.join(", ") + with
}

/// The picture's error, or what the picture itself says of it.
pub fn error(measured: Option<&ErrorAgainst>, report: &FrameReport, picture: &Picture) -> String {
    if let Some(error) = measured {
        let metrics = &error.metrics;
        let text = format!(
            "{:.4} (root of the relative MSE), relative bias {:+.4}, FLIP {:.4}, against {}",
            metrics.relative_mse.sqrt(),
            metrics.relative_bias,
            metrics.flip,
            error.reference.display()
        );
        return output::one_line(&text);
    }
    let unknown = "unknown (give --reference PICTURE)";
    // Bias does not show in a picture by itself, nor the spread of a single sample.
    let unbiased = techniques::by_id(&report.technique).is_ok_and(|card| card.bias == Bias::Unbiased);
    let noise = relative_mse_by_variance(picture, RELATIVE_MSE_OFFSET)
        .ok()
        .filter(|noise| noise.is_finite() && unbiased && report.samples[0] > 1);
    match noise {
        Some(noise) => format!(
            "{unknown}; noise at most about {:.4}, by the spread of the samples",
            noise.sqrt()
        ),
        None => unknown.into(),
    }
}

fn notes(report: &FrameReport) -> String {
    let mut notes = Vec::new();
    let bad = report.non_finite_samples;
    if bad.total() > 0 {
        let text = format!(
            "{} samples were NaN and {} infinite; they are left out",
            bad.nan, bad.infinite
        );
        notes.push(output::red(&text, Stream::Output));
    }
    let left_out = report.index.statistics.excluded_range + report.index.statistics.excluded_degenerate;
    if left_out > 0 {
        notes.push(format!("{left_out} triangles left out: out of range or without area"));
    }
    notes.extend(
        report
            .index
            .kept
            .map(|kept| format!("index {}", frame_report::kept(kept))),
    );
    notes.extend(
        report
            .index
            .host_because
            .map(|cause| output::one_line(&format!("index built on the host: {cause}"))),
    );
    let instead = report.index.instead_because;
    notes.extend(instead.map(|cause| output::one_line(&format!("another index than asked for: {cause}"))));
    match report.notes.len() {
        0 => {}
        1 => notes.push("1 thing of the scene could not be carried over".into()),
        count => notes.push(format!("{count} things of the scene could not be carried over")),
    }
    notes.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn reasons_name_what_was_asked_for() {
        let chosen = |error, milliseconds: Option<u64>| {
            let time = milliseconds.map(Duration::from_millis);
            Why::Chosen(Goal { error, time }).text()
        };
        assert_eq!(chosen(Some(0.02), None), "chosen for an error of 0.02");
        assert_eq!(chosen(None, Some(500)), "chosen for 0.5 s");
        assert_eq!(chosen(Some(0.1), Some(20_000)), "chosen for an error of 0.1 and 20 s");
        assert_eq!(Why::Default.text(), "the default");
    }
}
