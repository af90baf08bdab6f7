//! Where the path tracer's time goes: by stage, by what a segment takes in each, and by what passes and the host add.
//!
//! Oracle: the exact counts of the frame report, and its GPU timestamps, whose sum is the picture's GPU time.

use clerestory::gpu::Gpu;
use clerestory::render::{FrameReport, RenderOptions, Renderer};
use clerestory::techniques::PathTracerSettings;
use clerestory::walk::Fetches;
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
/// Forms of waves: slots of paths that have ended take new samples, or wait for the longest path.
const WAVES: [(&str, bool); 2] = [("kept full", true), ("whole", false)];
/// Host time beside the device's that counts as little, and the share of slots that a bounce is to fill.
const MOST_HOST_SHARE: f64 = 1.1;
const LEAST_FILLED: f64 = 0.5;

rows! {
    /// A picture.
    struct Whole = "Pictures" by [scene, waves] {
        scene: String = "scene",
        waves: String = "waves",
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
    struct Stage = "Stages" by [scene, waves, stage] {
        scene: String = "scene",
        waves: String = "waves",
        stage: String = "stage",
        passes: u64 = "passes",
        per_segment: Repeats = "GPU time per segment (ns)",
        share: Repeats = "share of the GPU time (%)",
        per_pass: Repeats = "GPU time per pass (µs)",
    }
}

rows! {
    /// What a stage fetches.
    struct Load = "Loads" by [scene, stage] {
        scene: String = "scene",
        stage: String = "stage",
        fetches: f64 = "texels fetched per segment",
        bytes: f64 = "bytes fetched per segment",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    pictures: Vec<Whole>,
    stages: Vec<Stage>,
    loads: Vec<Load>,
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
    .among(|row| row.waves == WAVES[0].0)
    .because("what a pass takes by itself is paid for each bounce, however few paths are left"),
];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let (mut stages, mut loads) = (Vec::new(), Vec::new());
        let pictures = context.each(
            context.first(&SCENES, 2),
            |address| short_name(address).into(),
            |address| {
                let of_scene = of_scene(context, &gpu, address)?;
                stages.extend(of_scene.stages);
                loads.extend(of_scene.loads);
                Ok(of_scene.pictures)
            },
        )?;
        Ok(Self {
            pictures,
            stages,
            loads,
        })
    }

    fn findings(&self) -> Findings {
        let full = self.pictures.iter().filter(|row| row.waves == WAVES[0].0);
        Findings::of(&self.pictures, CRITERIA)
            .headline(
                "paths per second of GPU time in waves that are kept full, geometric mean of the scenes (M/s)",
                geometric_mean(full.map(|row| row.rate.measured())),
            )
            .note(
                "A segment is a closest-hit ray with all that follows from it: shading, the shadow ray, compaction. Slots are the paths that may be \
                 under way at once.",
            )
            .and(Findings::of(&self.stages, &[]))
            .and(Findings::of(&self.loads, &[]))
            .note(
                "Loads are exact counts of the texels of records, and of what stages hand on, that the specialized kernels need; nodes and triangles of the ray index, and what \
                 is stored or added to, are not among them.",
            )
            .note("Medians of pictures after one that compiles the kernels. GPU times are timestamps around each pass.")
    }
}

/// A scene's pictures, and their stages.
fn of_scene(context: &Context<'_>, gpu: &Gpu, address: &str) -> Result<Found> {
    let (full, smoke) = PICTURE;
    let (side, spp) = context.pick(full, smoke);
    let renderer = Renderer::new(gpu, &scene::load(address)?)?;
    let render = |settings: PathTracerSettings| {
        let options = RenderOptions {
            technique: Some("path".into()),
            size: [side; 2],
            spp,
            settings: settings.into(),
            ..RenderOptions::default()
        };
        Ok(renderer.render(&options)?.report)
    };
    let all = context.in_turns(TURNS, WAVES.len(), |form| {
        render(PathTracerSettings {
            full_waves: WAVES[form].1,
            ..PathTracerSettings::default()
        })
    })?;
    let scene = short_name(address);
    let mut found = Found::default();
    for ((waves, _), reports) in WAVES.iter().zip(&all) {
        let (whole, of_form) = of_reports(scene, waves, reports);
        found.pictures.push(whole);
        found.stages.extend(of_form);
    }
    let counted = render(PathTracerSettings {
        count_fetches: true,
        ..PathTracerSettings::default()
    })?;
    found.loads = loads_of(scene, &counted);
    Ok(found)
}

/// What the stages of a picture have fetched, those that have fetched something.
fn loads_of(scene: &str, report: &FrameReport) -> Vec<Load> {
    let count = |name: &str| report.counters.get(name).copied().unwrap_or(0) as f64;
    let segments = count("extend_rays");
    let load = |stage: &&str| Load {
        scene: scene.into(),
        stage: format!("path: {stage}"),
        fetches: count(&format!("{stage}_texels")) / segments,
        bytes: count(&format!("{stage}_bytes")) / segments,
    };
    let loads = Fetches::STAGES.iter().map(load);
    loads.filter(|load| load.fetches > 0.0).collect()
}

/// What reports of the same picture say.
fn of_reports(scene: &str, waves: &str, reports: &[FrameReport]) -> (Whole, Vec<Stage>) {
    let repeats = |value: &dyn Fn(&FrameReport) -> f64| reports.iter().map(value).collect::<Repeats>();
    // Counts are the same in each turn.
    let first = &reports[0];
    let count = |name: &str| first.counters.get(name).copied().unwrap_or(0) as f64;
    let segments = count("extend_rays");
    let bounces = passes(first, "path: extend");
    let per_pass = segments / bounces.max(1) as f64;
    let whole = Whole {
        scene: scene.into(),
        waves: waves.into(),
        rate: repeats(&|report| count("paths") / report.gpu_seconds / 1e6),
        wall: repeats(&|report| report.render_seconds / report.gpu_seconds),
        segments: segments / count("paths"),
        shadow_rays: count("shadow_rays") / segments,
        passes: first.passes.iter().map(|pass| pass.count).sum(),
        per_pass,
        filled: per_pass / count("slots"),
    };
    let stages = first.passes.iter().map(|pass| {
        let seconds = |report: &FrameReport| seconds(report, &pass.name);
        Stage {
            scene: scene.into(),
            waves: waves.into(),
            stage: pass.name.clone(),
            passes: pass.count,
            per_segment: repeats(&|report| 1e9 * seconds(report) / segments),
            share: repeats(&|report| 100.0 * seconds(report) / report.gpu_seconds),
            per_pass: repeats(&|report| 1e6 * seconds(report) / pass.count as f64),
        }
    });
    (whole, stages.collect())
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
