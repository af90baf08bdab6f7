//! Where the path tracer's time goes: by stage, by what a segment takes in each, and by what passes and the host add.
//!
//! Oracle: the exact counts of the frame report, and its GPU timestamps, whose sum is the picture's GPU time.

use clerestory::gpu::Gpu;
use clerestory::render::{FrameReport, RenderOptions, Renderer};
use clerestory::{Result, scene};

use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::reference::short_name;

/// Diffuse, many triangles under a sky, smooth normals, a ring of metal, and a medium.
const SCENES: [&str; 5] = [
    "builtin:cornell-box",
    "builtin:box-city",
    "builtin:sphere-flake",
    "builtin:ring?roughness=0.3",
    "builtin:fog-box",
];
const TURNS: usize = 5;
/// Side and samples per pixel, in full and of a smoke run.
const PICTURE: ((u32, u32), (u32, u32)) = ((192, 32), (8, 4));
/// Host time beside the device's that counts as little, and the share of slots that a bounce is to fill.
const MOST_HOST_SHARE: f64 = 1.1;
const LEAST_FILLED: f64 = 0.5;

rows! {
    /// A picture.
    struct Whole = "Pictures" by [scene] {
        scene: String = "scene",
        rate: Repeats = "paths per second of GPU time (M/s)",
        wall: Repeats = "wall time over GPU time",
        segments: f64 = "segments per path",
        shadow_rays: f64 = "shadow rays per segment",
        passes: u64 = "passes",
        per_pass: f64 = "segments per bounce",
        filled: f64 = "segments per bounce over the slots",
    }
}

rows! {
    /// A stage of a picture.
    struct Stage = "Stages" by [scene, stage] {
        scene: String = "scene",
        stage: String = "stage",
        passes: u64 = "passes",
        per_segment: Repeats = "GPU time per segment (ns)",
        share: Repeats = "share of the GPU time (%)",
        per_pass: Repeats = "GPU time per pass (µs)",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    pictures: Vec<Whole>,
    stages: Vec<Stage>,
}

const CRITERIA: &[Criterion<Whole>] = &[
    Criterion::each(
        "the host adds a tenth at most: wall time over GPU time",
        Bound::AtMost(MOST_HOST_SHARE),
        |row: &Whole| (&row.wall).into(),
    ),
    Criterion::each(
        "bounces are full: their segments over the slots",
        Bound::AtLeast(LEAST_FILLED),
        |row: &Whole| row.filled.into(),
    )
    .because("what a pass takes by itself is paid for each bounce, however few paths are left"),
];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let mut stages = Vec::new();
        let pictures = context.each(
            context.first(&SCENES, 2),
            |address| short_name(address).into(),
            |address| {
                let (whole, of_scene) = of_scene(context, &gpu, address)?;
                stages.extend(of_scene);
                Ok(vec![whole])
            },
        )?;
        Ok(Self { pictures, stages })
    }

    fn findings(&self) -> Findings {
        Findings::of(&self.pictures, CRITERIA)
            .headline(
                "paths per second of GPU time, geometric mean of the scenes (M/s)",
                geometric_mean(self.pictures.iter().map(|row| row.rate.measured())),
            )
            .note(
                "A segment is a closest-hit ray with all that follows from it: shading, the shadow ray, compaction. Slots are the paths that may be \
                 under way at once.",
            )
            .and(Findings::of(&self.stages, &[]))
            .note("Medians of pictures after one that compiles the kernels. GPU times are timestamps around each pass.")
    }
}

/// A scene's picture, and its stages.
fn of_scene(context: &Context<'_>, gpu: &Gpu, address: &str) -> Result<(Whole, Vec<Stage>)> {
    let (full, smoke) = PICTURE;
    let (side, spp) = context.pick(full, smoke);
    let renderer = Renderer::new(gpu, &scene::load(address)?)?;
    let options = RenderOptions {
        technique: Some("path".into()),
        size: [side; 2],
        spp,
        ..RenderOptions::default()
    };
    let reports = context.in_turns(TURNS, 1, |_| Ok(renderer.render(&options)?.report))?;
    let reports: Vec<FrameReport> = reports.into_iter().flatten().collect();
    let repeats = |value: &dyn Fn(&FrameReport) -> f64| reports.iter().map(value).collect::<Repeats>();
    // Counts are the same in each turn.
    let first = &reports[0];
    let count = |name: &str| first.counters.get(name).copied().unwrap_or(0) as f64;
    let segments = count("extend_rays");
    let bounces = passes(first, "path: extend");
    let per_pass = segments / bounces.max(1) as f64;
    let slots = segments_of_first_bounce(first);
    let whole = Whole {
        scene: short_name(address).into(),
        rate: repeats(&|report| count("paths") / report.gpu_seconds / 1e6),
        wall: repeats(&|report| report.render_seconds / report.gpu_seconds),
        segments: segments / count("paths"),
        shadow_rays: count("shadow_rays") / segments,
        passes: first.passes.iter().map(|pass| pass.count).sum(),
        per_pass,
        filled: per_pass / slots,
    };
    let stages = first.passes.iter().map(|pass| {
        let seconds = |report: &FrameReport| seconds(report, &pass.name);
        Stage {
            scene: short_name(address).into(),
            stage: pass.name.clone(),
            passes: pass.count,
            per_segment: repeats(&|report| 1e9 * seconds(report) / segments),
            share: repeats(&|report| 100.0 * seconds(report) / report.gpu_seconds),
            per_pass: repeats(&|report| 1e6 * seconds(report) / pass.count as f64),
        }
    });
    Ok((whole, stages.collect()))
}

/// How often a pass ran.
fn passes(report: &FrameReport, name: &str) -> u64 {
    let of_name = report.passes.iter().filter(|pass| pass.name == name);
    of_name.map(|pass| pass.count).sum()
}

/// GPU time of a pass; none without timestamps.
fn seconds(report: &FrameReport, name: &str) -> f64 {
    let of_name = report.passes.iter().filter(|pass| pass.name == name);
    of_name.map(|pass| pass.gpu_ms.unwrap_or(f64::NAN) / 1e3).sum()
}

/// Paths of a wave, each of which has a slot and begins with a segment.
fn segments_of_first_bounce(report: &FrameReport) -> f64 {
    let count = |name: &str| report.counters.get(name).copied().unwrap_or(0) as f64;
    count("paths") / count("waves").max(1.0)
}
