//! Bidirectional paths beside those of LuxCore, and both they and virtual lights beside Mitsuba's path tracer: time to equal error on exported scenes of diffuse surfaces, in turns, and where
//! the time of our bidirectional paths goes.
//!
//! LuxCore and Mitsuba run in processes of their own through `tools/mitsuba/bidirectional.py` and `tools/mitsuba/reference.py`, with the Python that has them; where there is none, a table says so. Errors are
//! those of the spread between pictures, each about its own renderer's mean, so that what one renderer models otherwise counts for none of them. In scenes without mirrors virtual lights have all light paths.

use std::path::Path;
use std::process::Command;

use clerestory::gpu::Gpu;
use clerestory::input::read_file;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::{Error, Result, atomic, scene};

use super::peers::{Asked, Contender, FILE_MAX, LUXCORE_SCRIPTS, Turn, luxcore_turn, our_turn, pictures_of};
use crate::agreement::python_of_environment;
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::mean_of;
use crate::experiments::reference::short_name;
use crate::mitsuba::{self, ExportOptions};
use crate::python;

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
const MITSUBA_SCRIPTS: [(&str, &str); 1] = [(MITSUBA_SCRIPT, include_str!("../../../../mitsuba/reference.py"))];
const MITSUBA_SCRIPT: &str = "reference.py";
const MITSUBA_NEEDED: &str = "Mitsuba 3; see tools/mitsuba/README.md";

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

/// What Mitsuba's script writes, as far as it is needed here.
#[derive(serde::Deserialize)]
struct MitsubaAnswer {
    renderer: String,
    variant: String,
    seconds_each: Vec<f64>,
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let python = python_of_environment();
        for (name, text) in LUXCORE_SCRIPTS.into_iter().chain(MITSUBA_SCRIPTS) {
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
            let (technique, samples) = OURS[i];
            let options = RenderOptions {
                technique: Some(technique.into()),
                size: [side; 2],
                spp: context.pick(samples[0], samples[1]),
                seed,
                settings: serde_json::json!({ "sampler": "pcg" }).into(),
                ..RenderOptions::default()
            };
            let (turn, of_turn) = our_turn(&renderer, &options, PICTURES)?;
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
                luxcore_turn(context, &asked(context, python, "BIDIRCPU", &exported.scene), seed)
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
            let paths = asked(context, python, "PATHCPU", &exported.scene);
            luxcore_turn(context, &paths, seed).ok()
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

/// What LuxCore is asked for on a scene.
fn asked<'a>(context: &Context<'_>, python: &'a Path, engine: &'a str, scene: &'a Path) -> Asked<'a> {
    Asked {
        python,
        engine,
        scene,
        side: context.pick(SIDE, SMOKE_SIDE),
        samples: context.pick(SAMPLES, SMOKE_SAMPLES),
        pictures: PICTURES,
        further: &[],
    }
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
