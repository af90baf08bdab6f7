//! Bidirectional paths beside those of LuxCore, and both they and virtual lights beside Mitsuba's path tracer: time to equal error on exported scenes of diffuse surfaces, in turns, and where
//! the time of our bidirectional paths goes.
//!
//! LuxCore and Mitsuba run in processes of their own through `tools/mitsuba/bidirectional.py` and `tools/mitsuba/reference.py`, with the Python that has them; where there is none, a table says so. Errors are
//! those of the spread between pictures, each about its own renderer's mean, so that what one renderer models otherwise counts for none of them. In scenes without mirrors virtual lights have all light paths.

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
use crate::experiments::measures::errors::mean_with_error;
use crate::experiments::measures::pictures::mean_of;
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
/// Techniques of ours, with the samples per pixel of a picture; the same of a smoke run. Virtual lights send a shadow ray to each light from each sample.
const OURS: [(&str, [u32; 2]); 2] = [("bdpt", [SAMPLES, SMOKE_SAMPLES]), ("vpl", [4, 1])];
/// Other renderers, by their places behind ours in a turn.
const THEIRS: [&str; 2] = ["LuxCore", "Mitsuba"];
const LUXCORE: usize = 0;
const MITSUBA: usize = 1;
/// Each renderer's turns, and its pictures in each.
const TURNS: usize = 5;
const PICTURES: u32 = 2;
const SCRIPTS: [(&str, &str); 3] = [
    ("photons.py", include_str!("../../../../mitsuba/photons.py")),
    (SCRIPT, include_str!("../../../../mitsuba/bidirectional.py")),
    (MITSUBA_SCRIPT, include_str!("../../../../mitsuba/reference.py")),
];
const SCRIPT: &str = "bidirectional.py";
const MITSUBA_SCRIPT: &str = "reference.py";
const NEEDED: &str = "pyluxcore; see tools/mitsuba/README.md";
const MITSUBA_NEEDED: &str = "Mitsuba 3; see tools/mitsuba/README.md";
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
    /// A technique of ours and Mitsuba's path tracer on a scene.
    struct Beside = "Beside Mitsuba's path tracer" by [scene, technique] {
        scene: String = "scene",
        technique: String = "our technique",
        version: String = "version",
        ours: Repeats = "our picture (s)",
        theirs: Repeats = "Mitsuba's picture (s)",
        our_error: Measured = "our relative MSE",
        their_error: Measured = "Mitsuba's relative MSE",
        over: Measured = "Mitsuba's time to equal error over ours",
        brightness: Measured = "our mean over Mitsuba's",
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
    /// A scene that another renderer did not render.
    struct LeftOut = "Left out" by [scene, renderer] {
        scene: String = "scene",
        renderer: String = "renderer",
        cause: String = "cause",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    rows: Vec<Row>,
    #[serde(default)]
    beside: Vec<Beside>,
    passes: Vec<Pass>,
    left_out: Vec<LeftOut>,
}

const OF_MITSUBA: &[Criterion<Beside>] = &[Criterion::each(
    "our mean is Mitsuba's within 0.5 %: ratio",
    Bound::Between(0.995, 1.005),
    |row: &Beside| row.brightness,
)
.needs("Mitsuba")];

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

/// What Mitsuba's script writes, as far as it is needed here.
#[derive(serde::Deserialize)]
struct MitsubaAnswer {
    renderer: String,
    variant: String,
    seconds_each: Vec<f64>,
}

/// Pictures of a turn, with the seconds of each.
type Turn = Vec<(Vec<f32>, f64)>;

/// One renderer's turns.
#[derive(Clone)]
struct Contender {
    seconds: Repeats,
    error: Measured,
    /// Relative standard error of the time to an error.
    uncertainty: f64,
    mean: f64,
    /// Standard error of the mean.
    mean_error: f64,
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
        let means: Vec<f64> = pictures.iter().map(|one| mean_of(one)).collect();
        let [of_all, mean_error] = mean_with_error(&means);
        let of_seconds = (deviation / (seconds.0.len() as f64 - 1.0).max(1.0) / seconds.0.len() as f64).sqrt();
        Some(Self {
            mean: of_all,
            mean_error,
            error: Measured::within(found.relative_mse, MARGIN * found.standard_error),
            uncertainty: (found.standard_error / found.relative_mse).hypot(of_seconds),
            seconds,
        })
    }

    /// Seconds to a relative MSE of 1, as that falls with one over time.
    fn cost(&self) -> f64 {
        median(self.seconds.0.clone()) * self.error.value
    }

    /// Another one's time to equal error over this one's.
    fn time_of(&self, other: &Self) -> Measured {
        let ratio = other.cost() / self.cost();
        Measured::within(ratio, MARGIN * ratio * self.uncertainty.hypot(other.uncertainty))
    }

    /// The mean over another one's.
    fn brightness_over(&self, other: &Self) -> Measured {
        let ratio = self.mean / other.mean;
        let error = (self.mean_error / self.mean).hypot(other.mean_error / other.mean);
        Measured::within(ratio, MARGIN * ratio * error)
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let python = python_of_environment();
        for (name, text) in SCRIPTS {
            atomic::write(&context.file(name)?, text.as_bytes())?;
        }
        let mut found = Self::default();
        let name = |address: &&str| short_name(address).to_owned();
        let rows = context.each(context.first(&SCENES, 1), name, |address| {
            let mut of_scene = of_scene(context, &gpu, &python, address)?;
            found.beside.append(&mut of_scene.beside);
            found.passes.append(&mut of_scene.passes);
            found.left_out.append(&mut of_scene.left_out);
            Ok(of_scene.rows)
        })?;
        found.rows = rows;
        Ok(found)
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
            .and(Findings::of(&self.beside, OF_MITSUBA).note(format!(
                "As above; {} samples per pixel of virtual lights, {SAMPLES} of Mitsuba's path tracer with independent samples. Its seconds have no preparation of a picture.",
                OURS[1].1[0]
            )))
            .and(Findings::of(&self.passes, &[]))
            .and(Findings::of(&self.left_out, &[]))
    }
}

/// All renderers in turns, what those that are missing are missing for, and the shares of the passes of our bidirectional paths. A smoke run has ours alone.
fn of_scene(context: &Context<'_>, gpu: &Gpu, python: &Path, address: &str) -> Result<Found> {
    let scene = scene::load(address)?;
    let name = short_name(address);
    let side = context.pick(SIDE, SMOKE_SIDE);
    let folder = context.folder.join(name.replace(['?', '='], "-"));
    let options = ExportOptions { shading_normals: true };
    let exported = mitsuba::export_with(&scene, "", [side; 2], &folder, options);
    let renderer = Renderer::new(gpu, &scene)?;
    let mut passes = Vec::new();
    let mut causes: [Option<String>; THEIRS.len()] = Default::default();
    let mut versions: [String; THEIRS.len()] = Default::default();
    let mut seed = 0;
    let contenders = OURS.len() + context.pick(THEIRS.len(), 0);
    let turns = context.in_turns(TURNS, contenders, |i| {
        seed += PICTURES + 1;
        let Some(peer) = i.checked_sub(OURS.len()) else {
            let (turn, of_turn) = our_turn(context, &renderer, OURS[i], seed)?;
            if i == 0 {
                passes = of_turn;
            }
            return Ok(turn);
        };
        if causes[peer].is_some() || context.watch.stopped() {
            return Ok(Turn::new());
        }
        let answer = match &exported {
            Ok(exported) if peer == LUXCORE => {
                their_turn(context, python, ("BIDIRCPU", &exported.scene), &folder, seed)
            }
            Ok(exported) => mitsuba_turn(context, python, &exported.scene, &folder, seed),
            Err(cause) => Err(Error::setting("scene", address, cause.to_string())),
        };
        Ok(match answer {
            Ok((turn, version)) => {
                versions[peer] = version;
                turn
            }
            Err(cause) => {
                causes[peer] = Some(cause.to_string());
                Turn::new()
            }
        })
    })?;
    let all: Vec<Option<Contender>> = turns.into_iter().map(Contender::of).collect();
    let contender = |i: usize| all.get(i).cloned().flatten();
    let [luxcore, mitsuba] = [LUXCORE, MITSUBA].map(|peer| match &causes[peer] {
        Some(cause) => Err(cause.clone()),
        None if context.smoke => Err("smoke runs have ours alone".into()),
        None => {
            contender(OURS.len() + peer).ok_or_else(|| String::from("it was stopped before there were pictures enough"))
        }
    });
    let mut found = Found::default();
    for (peer, missing) in [luxcore.as_ref().err(), mitsuba.as_ref().err()].into_iter().enumerate() {
        found.left_out.extend(missing.map(|cause| LeftOut {
            scene: name.into(),
            renderer: THEIRS[peer].into(),
            cause: cause.clone(),
        }));
    }
    if let (Some(ours), Ok(theirs)) = (contender(0), luxcore) {
        // What fails here costs a number, not the scene.
        let turn = exported.as_ref().ok().and_then(|exported| {
            let paths = ("PATHCPU", exported.scene.as_path());
            their_turn(context, python, paths, &folder, seed).ok()
        });
        let of_paths = turn.map_or(f64::NAN, |(turn, _)| {
            let means = turn.iter().map(|(picture, _)| mean_of(picture));
            means.sum::<f64>() / turn.len() as f64
        });
        found.rows.push(Row {
            scene: name.into(),
            version: versions[LUXCORE].clone(),
            over: ours.time_of(&theirs),
            brightness: theirs.mean / ours.mean,
            of_paths: of_paths / ours.mean,
            our_error: ours.error,
            their_error: theirs.error,
            ours: ours.seconds,
            theirs: theirs.seconds,
        });
    }
    if let Ok(theirs) = mitsuba {
        for (i, (technique, _)) in OURS.iter().enumerate() {
            found.beside.extend(contender(i).map(|ours| Beside {
                scene: name.into(),
                technique: (*technique).into(),
                version: versions[MITSUBA].clone(),
                over: ours.time_of(&theirs),
                brightness: ours.brightness_over(&theirs),
                our_error: ours.error,
                their_error: theirs.error,
                ours: ours.seconds,
                theirs: theirs.seconds.clone(),
            }));
        }
    }
    let all: f64 = passes.iter().map(|(_, ms)| ms).sum();
    found.passes = passes
        .into_iter()
        .map(|(pass, ms)| Pass {
            scene: name.into(),
            pass,
            share: 100.0 * ms / all,
        })
        .collect();
    found.passes.sort_by(|a, b| b.share.total_cmp(&a.share));
    Ok(found)
}

/// Milliseconds of a picture's passes, by name.
type PassTimes = Vec<(String, f64)>;

/// A turn of a technique of ours, and the passes of its last picture.
fn our_turn(
    context: &Context<'_>,
    renderer: &Renderer,
    (technique, samples): (&str, [u32; 2]),
    seed: u32,
) -> Result<(Turn, PassTimes)> {
    let (mut turn, mut passes) = (Turn::new(), PassTimes::new());
    for picture in 0..PICTURES {
        let options = RenderOptions {
            technique: Some(technique.into()),
            size: [context.pick(SIDE, SMOKE_SIDE); 2],
            spp: context.pick(samples[0], samples[1]),
            seed: seed + picture,
            settings: serde_json::json!({ "sampler": "pcg" }).into(),
            ..RenderOptions::default()
        };
        let (rendered, seconds) = timed(|| renderer.render(&options));
        let rendered = rendered?;
        passes = rendered
            .report
            .passes
            .iter()
            .filter_map(|pass| Some((pass.name.clone(), pass.gpu_ms?)))
            .collect();
        let radiance = rendered.picture.require(picture::RADIANCE)?.values().to_vec();
        turn.push((radiance, seconds));
    }
    Ok((turn, passes))
}

/// Pictures of so many pixels a side from a file of 32-bit floats.
fn pictures_of(file: &Path, side: u32) -> Result<Vec<Vec<f32>>> {
    let bytes = read_file(file, FILE_MAX)?;
    let values: Vec<f32> = bytes
        .as_chunks::<4>()
        .0
        .iter()
        .map(|word| f32::from_le_bytes(*word))
        .collect();
    let pictures = values.chunks_exact(3 * (side * side) as usize);
    Ok(pictures.map(<[f32]>::to_vec).collect())
}

/// A turn of Mitsuba's path tracer, and its version.
fn mitsuba_turn(
    context: &Context<'_>,
    python: &Path,
    scene: &Path,
    folder: &Path,
    seed: u32,
) -> Result<(Turn, String)> {
    let prefix = folder.join("mitsuba");
    let mut command = Command::new(python);
    command
        .arg(context.folder.join(MITSUBA_SCRIPT))
        .args([scene.as_os_str(), prefix.as_os_str()])
        .args(["--integrator", "path", "--sampler", "independent", "--each"])
        .args(["--spp", &context.pick(SAMPLES, SMOKE_SAMPLES).to_string()])
        .args(["--passes", &PICTURES.to_string()])
        .args(["--seed", &seed.to_string()]);
    if python::run(python, &mut command, MITSUBA_NEEDED, context.watch)?.is_none() {
        return Ok((Turn::new(), String::new()));
    }
    let bytes = read_file(&prefix.with_extension("json"), FILE_MAX)?;
    let answer: MitsubaAnswer = serde_json::from_slice(&bytes)
        .map_err(|cause| Error::setting("mitsuba", String::from_utf8_lossy(&bytes), cause.to_string()))?;
    let pictures = pictures_of(&prefix.with_extension("f32"), context.pick(SIDE, SMOKE_SIDE))?;
    let version = format!("{}, {}", answer.renderer, answer.variant);
    Ok((pictures.into_iter().zip(answer.seconds_each).collect(), version))
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
    let pictures = pictures_of(&file, side)?;
    Ok((pictures.into_iter().zip(answer.seconds).collect(), answer.version))
}
