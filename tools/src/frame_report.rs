//! The frame report as a table for people.

use std::fmt::Write as _;

use clerestory::accel::IndexKept;
use clerestory::render::FrameReport;

use crate::output::{self, Stream, Table};

/// The report as text of several small tables.
pub fn text(report: &FrameReport) -> String {
    let [width, height] = report.size;
    let samples = match report.samples {
        [least, most] if least == most => format!("{most} of {}", report.spp),
        [least, most] => format!("{least} to {most} of {}", report.spp),
    };
    let line = |text: String| output::one_line(&text) + "\n";
    let mut text = line(format!(
        "{}, camera {}, technique {}, light paths: {}",
        report.scene, report.camera, report.technique, report.path_set
    ));
    text += &line(format!(
        "{width} × {height} pixels, {samples} samples per pixel, seed {}",
        report.seed
    ));
    text += &line(format!("{}, driver {}", report.device, report.driver));
    for part in [
        times(report),
        passes(report),
        work(report),
        memory(report),
        rest(report),
    ] {
        text.push('\n');
        text += &part;
    }
    text
}

fn times(report: &FrameReport) -> String {
    let mut table = Table::new(&["time", "seconds"], &[]);
    for (name, seconds) in [
        ("scene: upload and index", report.upload_seconds),
        ("rendering, with compilation", report.render_seconds),
        ("after the first step (steady)", report.steady_seconds),
        ("on the GPU", report.gpu_seconds),
    ] {
        table.row([name.into(), format!("{seconds:.3}")]);
    }
    table.text()
}

/// Passes with the longest first.
fn passes(report: &FrameReport) -> String {
    let mut passes: Vec<_> = report.passes.iter().collect();
    passes.sort_by(|a, b| b.gpu_ms.unwrap_or(0.0).total_cmp(&a.gpu_ms.unwrap_or(0.0)));
    let all: f64 = passes.iter().filter_map(|pass| pass.gpu_ms).sum();
    let mut table = Table::new(&["pass", "GPU ms", "share", "runs"], &[]);
    for pass in passes {
        let (ms, share) = match pass.gpu_ms {
            Some(ms) => (
                format!("{ms:.2}"),
                format!("{:.1} %", 100.0 * ms / all.max(f64::MIN_POSITIVE)),
            ),
            None => ("not timed".into(), String::new()),
        };
        table.row([pass.name.clone(), ms, share, pass.count.to_string()]);
    }
    table.text()
}

fn work(report: &FrameReport) -> String {
    // A picture that took one step has no steady time.
    let steady = !report.steady_rates.is_empty();
    let head = if steady {
        "per steady second"
    } else {
        "per second, with compilation"
    };
    let mut table = Table::new(&["work", "count", head], &[]);
    for (name, count) in &report.counters {
        table.row([
            name.replace('_', " "),
            count.to_string(),
            rate(report, name).map_or_else(|| "-".into(), output::metric),
        ]);
    }
    table.text()
}

/// Work per second of steady time by a counter's name, or with compilation where a picture took one step.
pub fn rate(report: &FrameReport, name: &str) -> Option<f64> {
    if !report.steady_rates.is_empty() {
        return report.steady_rates.get(name).copied();
    }
    let rate = *report.counters.get(name)? as f64 / report.render_seconds;
    Some(rate).filter(|rate| *rate > 0.0 && rate.is_finite())
}

/// What became of an index that a folder keeps.
pub fn kept(kept: IndexKept) -> &'static str {
    match kept {
        IndexKept::Read => "read, not built: the folder had it",
        IndexKept::Written => "kept for the next time",
        IndexKept::NotWritten => "could not be kept",
    }
}

fn memory(report: &FrameReport) -> String {
    let mut table = Table::new(&["device memory", "size"], &[]);
    for (category, bytes) in &report.memory.bytes {
        table.row([format!("{category:?}").to_lowercase(), output::bytes(*bytes)]);
    }
    table.row([
        format!("total, {} allocations", report.memory.allocations),
        output::bytes(report.memory.total()),
    ]);
    table.text()
}

fn rest(report: &FrameReport) -> String {
    let index = &report.index.statistics;
    let mut text = format!(
        "index: {}, {} triangles, {} nodes, {} leaves, depth {}, SAH cost {:.1}, {}, built in {:.1} ms\n",
        report.index.kind,
        index.triangles,
        index.nodes,
        index.leaves,
        index.max_depth,
        index.sah_cost,
        output::bytes(index.bytes),
        report.index.build_ms
    );
    let stages = report.index.stages.named().into_iter().filter(|(_, ms)| *ms > 0.0);
    let stages: Vec<String> = stages.map(|(name, ms)| format!("{name} {ms:.1}")).collect();
    if !stages.is_empty() {
        let _ = writeln!(text, "       ms of it: {}", stages.join(", "));
    }
    if let Some(kept) = report.index.kept.map(kept) {
        let _ = writeln!(text, "       {kept}");
    }
    if let Some(cause) = report.index.host_because {
        let _ = writeln!(text, "       built on the host: {cause}");
    }
    if let Some(cause) = report.index.instead_because {
        let _ = writeln!(text, "       instead of the one asked for: {cause}");
    }
    let excluded = index.excluded_range + index.excluded_degenerate;
    if excluded > 0 {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "       {excluded} triangles left out: {} out of range, {} without area",
            index.excluded_range, index.excluded_degenerate
        );
    }
    if !report.skipped.is_empty() {
        let mut table = Table::new(&["left out", "because"], &[1]);
        for skipped in &report.skipped {
            table.row([skipped.what.to_owned(), skipped.why.to_owned()]);
        }
        text.push('\n');
        text += &table.text();
        text.push('\n');
    }
    let bad = format!(
        "samples that were not finite and are left out: {} NaN, {} infinite",
        report.non_finite_samples.nan, report.non_finite_samples.infinite
    );
    text += &if report.non_finite_samples.total() > 0 {
        output::red(&bad, Stream::Output)
    } else {
        bad
    };
    text.push('\n');
    text
}
