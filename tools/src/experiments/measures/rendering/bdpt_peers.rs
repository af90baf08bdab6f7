//! Bidirectional paths beside those of LuxCore: time to equal error on exported scenes of diffuse surfaces, in turns, and where our time goes.
//!
//! LuxCore runs in a process of its own through `tools/mitsuba/bidirectional.py`, with the Python that has it; where there is none, a table says so. Errors are those of the
//! spread between pictures, each about its own renderer's mean, so that what one renderer models otherwise counts for neither.

use std::path::Path;
use std::process::Command;

use clerestory::film::picture;
use clerestory::gpu::Gpu;
use clerestory::input::read_file;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::{Error, Result, atomic, scene};

use crate::agreement::{python_of_environment, spread};
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::reference::short_name;
use crate::mitsuba::{self, ExportOptions};
use crate::python;
use crate::timing::{median, timed};

const SCENES: [&str; 4] = [
    "builtin:shaded-lamp",
    "builtin:shaded-lamp?opening=0.15",
    "builtin:passage",
    "builtin:cornell-box",
];
const SIDE: u32 = 64;
const SMOKE_SIDE: u32 = 16;
const SAMPLES: u32 = 64;
const SMOKE_SAMPLES: u32 = 4;
/// Each renderer's turns, and its pictures in each.
const TURNS: usize = 5;
const PICTURES: u32 = 2;
const SCRIPTS: [(&str, &str); 2] = [
    ("photons.py", include_str!("../../../../mitsuba/photons.py")),
    (SCRIPT, include_str!("../../../../mitsuba/bidirectional.py")),
];
const SCRIPT: &str = "bidirectional.py";
const NEEDED: &str = "pyluxcore; see tools/mitsuba/README.md";
/// Bytes of a turn's pictures at most.
const FILE_MAX: u64 = 1 << 28;
/// Standard errors to each side of an interval.
const MARGIN: f64 = 2.0;

rows! {
    /// Both renderers on a scene.
    struct Row = "Time to equal error" by [scene] {
        scene: String = "scene",
        version: String = "version",
        ours: Repeats = "our picture (s)",
        theirs: Repeats = "LuxCore's picture (s)",
        our_error: Measured = "our relative MSE",
        their_error: Measured = "LuxCore's relative MSE",
        over: Measured = "LuxCore's time to equal error over ours",
        brightness: f64 = "LuxCore's mean over ours",
        of_paths: f64 = "LuxCore's path tracer's mean over ours",
    }
}
rows! {
    /// A pass of our pictures.
    struct Pass = "Where our time goes" by [scene, pass] {
        scene: String = "scene",
        pass: String = "pass",
        share: f64 = "share of the device's time (%)",
    }
}
rows! {
    /// A scene that LuxCore did not render.
    struct LeftOut = "Left out" by [scene] {
        scene: String = "scene",
        cause: String = "cause",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    rows: Vec<Row>,
    passes: Vec<Pass>,
    left_out: Vec<LeftOut>,
}

const CRITERIA: &[Criterion<Row>] = &[Criterion::each(
    "LuxCore's time to equal error is half of ours or more",
    Bound::AtLeast(0.5),
    |row: &Row| row.over,
)
.needs("LuxCore")];

/// What the script prints.
#[derive(serde::Deserialize)]
struct Answer {
    version: String,
    seconds: Vec<f64>,
}

/// Pictures of a turn, with the seconds of each.
type Turn = Vec<(Vec<f32>, f64)>;

/// One renderer's turns.
struct Contender {
    seconds: Repeats,
    error: Measured,
    /// Relative standard error of the time to an error.
    uncertainty: f64,
    mean: f64,
}

impl Contender {
    /// None where there are too few pictures.
    fn of(turns: Vec<Turn>) -> Option<Self> {
        let of_turn = |turn: &Turn| median(turn.iter().map(|(_, seconds)| *seconds).collect());
        let seconds: Repeats = turns.iter().filter(|turn| !turn.is_empty()).map(of_turn).collect();
        let pictures: Vec<Vec<f32>> = turns.into_iter().flatten().map(|(picture, _)| picture).collect();
        let count = pictures.len() as f32;
        let values = pictures.first()?.len();
        let mean: Vec<f32> = (0..values)
            .map(|i| pictures.iter().map(|one| one[i]).sum::<f32>() / count)
            .collect();
        let found = spread::measure(&pictures, &mean)?;
        let middle = median(seconds.0.clone());
        let deviation = seconds.0.iter().map(|s| (s / middle - 1.0).powi(2)).sum::<f64>();
        let of_seconds = (deviation / (seconds.0.len() as f64 - 1.0).max(1.0) / seconds.0.len() as f64).sqrt();
        Some(Self {
            mean: mean.iter().map(|value| f64::from(*value)).sum::<f64>() / values as f64,
            error: Measured::within(found.relative_mse, MARGIN * found.standard_error),
            uncertainty: (found.standard_error / found.relative_mse).hypot(of_seconds),
            seconds,
        })
    }

    /// Seconds to a relative MSE of 1, as that falls with one over time.
    fn cost(&self) -> f64 {
        median(self.seconds.0.clone()) * self.error.value
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let python = python_of_environment();
        for (name, text) in SCRIPTS {
            atomic::write(&context.file(name)?, text.as_bytes())?;
        }
        let (mut left_out, mut passes) = (Vec::new(), Vec::new());
        let name = |address: &&str| short_name(address).to_owned();
        let rows = context.each(context.first(&SCENES, 1), name, |address| {
            let (row, found) = of_scene(context, &gpu, &python, address)?;
            passes.extend(found);
            let alone = |cause| LeftOut {
                scene: short_name(address).into(),
                cause,
            };
            left_out.extend(row.as_ref().err().cloned().map(alone));
            Ok(Vec::from_iter(row.ok()))
        })?;
        Ok(Self { rows, passes, left_out })
    }

    fn findings(&self) -> Findings {
        Findings::of(&self.rows, CRITERIA)
            .headline(
                "LuxCore's time to equal error over ours, geometric mean",
                geometric_mean(self.rows.iter().map(|row| row.over)),
            )
            .note(format!(
                "{SIDE} × {SIDE} pixels, {SAMPLES} samples per pixel of both, independent samples, {TURNS} turns of {PICTURES} pictures; relative MSE by the spread between \
                 pictures, each about its own renderer's mean, since LuxCore's bidirectional engine is brighter than its own path tracer, whose mean stands beside. LuxCore's seconds have its \
                 preparation of a picture, ours those of a technique on a scene that is on the device.",
            ))
            .and(Findings::of(&self.passes, &[]))
            .and(Findings::of(&self.left_out, &[]))
    }
}

/// Both renderers in turns, or why there is one alone; and the shares of our passes. A smoke run has ours alone.
fn of_scene(
    context: &Context<'_>,
    gpu: &Gpu,
    python: &Path,
    address: &str,
) -> Result<(std::result::Result<Row, String>, Vec<Pass>)> {
    let scene = scene::load(address)?;
    let name = short_name(address);
    let side = context.pick(SIDE, SMOKE_SIDE);
    let folder = context.folder.join(name.replace(['?', '='], "-"));
    let options = ExportOptions { shading_normals: true };
    let exported = mitsuba::export_with(&scene, "", [side; 2], &folder, options);
    let renderer = Renderer::new(gpu, &scene)?;
    let mut passes = Vec::new();
    let mut cause = None;
    let mut version = String::new();
    let mut seed = 0;
    let contenders = context.pick(2, 1);
    let turns = context.in_turns(TURNS, contenders, |i| {
        seed += PICTURES + 1;
        if i == 0 {
            return our_turn(context, &renderer, seed, &mut passes);
        }
        if cause.is_some() || context.watch.stopped() {
            return Ok(Turn::new());
        }
        let answer = match &exported {
            Ok(exported) => their_turn(context, python, ("BIDIRCPU", &exported.scene), &folder, seed),
            Err(cause) => Err(Error::setting("scene", address, cause.to_string())),
        };
        Ok(match answer {
            Ok((turn, found)) => {
                version = found;
                turn
            }
            Err(found) => {
                cause = Some(found.to_string());
                Turn::new()
            }
        })
    })?;
    let all: f64 = passes.iter().map(|(_, ms)| ms).sum();
    let mut shares: Vec<Pass> = passes
        .into_iter()
        .map(|(pass, ms)| Pass {
            scene: name.into(),
            pass,
            share: 100.0 * ms / all,
        })
        .collect();
    shares.sort_by(|a, b| b.share.total_cmp(&a.share));
    let mut both = turns.into_iter().map(Contender::of);
    let (ours, theirs) = (both.next().flatten(), both.next().flatten());
    let row = match (ours, theirs, cause) {
        (Some(ours), Some(theirs), None) => {
            // What fails here costs a number, not the scene.
            let turn = exported.as_ref().ok().and_then(|exported| {
                let paths = ("PATHCPU", exported.scene.as_path());
                their_turn(context, python, paths, &folder, seed).ok()
            });
            let of_paths = turn.map_or(f64::NAN, |(turn, _)| {
                let values = || turn.iter().flat_map(|(picture, _)| picture);
                values().map(|value| f64::from(*value)).sum::<f64>() / values().count() as f64
            });
            let ratio = theirs.cost() / ours.cost();
            Ok(Row {
                scene: name.into(),
                version,
                over: Measured::within(ratio, MARGIN * ratio * ours.uncertainty.hypot(theirs.uncertainty)),
                brightness: theirs.mean / ours.mean,
                of_paths: of_paths / ours.mean,
                our_error: ours.error,
                their_error: theirs.error,
                ours: ours.seconds,
                theirs: theirs.seconds,
            })
        }
        (_, _, Some(cause)) => Err(cause),
        (_, _, None) if contenders == 1 => Err("smoke runs have ours alone".into()),
        _ => Err("it was stopped before there were pictures enough".into()),
    };
    Ok((row, shares))
}

/// A turn of ours. The passes are those of its last picture.
fn our_turn(context: &Context<'_>, renderer: &Renderer, seed: u32, passes: &mut Vec<(String, f64)>) -> Result<Turn> {
    let mut turn = Turn::new();
    for picture in 0..PICTURES {
        let options = RenderOptions {
            technique: Some("bdpt".into()),
            size: [context.pick(SIDE, SMOKE_SIDE); 2],
            spp: context.pick(SAMPLES, SMOKE_SAMPLES),
            seed: seed + picture,
            settings: serde_json::json!({ "sampler": "pcg" }).into(),
            ..RenderOptions::default()
        };
        let (rendered, seconds) = timed(|| renderer.render(&options));
        let rendered = rendered?;
        *passes = rendered
            .report
            .passes
            .iter()
            .filter_map(|pass| Some((pass.name.clone(), pass.gpu_ms?)))
            .collect();
        let radiance = rendered.picture.require(picture::RADIANCE)?.values().to_vec();
        turn.push((radiance, seconds));
    }
    Ok(turn)
}

/// A turn of LuxCore's, and its version.
fn their_turn(
    context: &Context<'_>,
    python: &Path,
    (engine, scene): (&str, &Path),
    folder: &Path,
    seed: u32,
) -> Result<(Turn, String)> {
    let side = context.pick(SIDE, SMOKE_SIDE);
    let file = folder.join("luxcore.f32");
    let mut command = Command::new(python);
    command
        .arg(context.folder.join(SCRIPT))
        .args([scene.as_os_str(), file.as_os_str()])
        .args(["--size", &side.to_string()])
        .args(["--samples", &context.pick(SAMPLES, SMOKE_SAMPLES).to_string()])
        .args(["--pictures", &PICTURES.to_string()])
        .args(["--engine", engine])
        // Seeds of engines are above 0.
        .args(["--seed", &(seed + 1).to_string()]);
    let Some(text) = python::run(python, &mut command, NEEDED, context.watch)? else {
        return Ok((Turn::new(), String::new()));
    };
    let answer: Answer =
        serde_json::from_str(&text).map_err(|cause| Error::setting("luxcore", text, cause.to_string()))?;
    let bytes = read_file(&file, FILE_MAX)?;
    let values: Vec<f32> = bytes
        .as_chunks::<4>()
        .0
        .iter()
        .map(|word| f32::from_le_bytes(*word))
        .collect();
    let pictures = values.chunks_exact(3 * (side * side) as usize).map(<[f32]>::to_vec);
    Ok((pictures.zip(answer.seconds).collect(), answer.version))
}
