//! Photons in media beside Mitsuba's volumetric path tracers: time to equal error where a small lamp throws a caustic into fog, in turns.
//!
//! Mitsuba runs in a process of its own through `tools/mitsuba/reference.py`, with the Python that has it; where there is none, a table says so. Our errors are about a reference by
//! bidirectional paths, whose variance is subtracted, so that photons' bias counts; Mitsuba's are those of the spread between its pictures, which have none. Its time to our error takes the error to fall with
//! one over time, as that of independent samples does. Scenes have no interpolated normals, so that both renderers hold the same.

use std::f32::consts::PI;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use clerestory::film::{Picture, picture};
use clerestory::gpu::Gpu;
use clerestory::input::read_file;
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::{Camera, Scene};
use clerestory::{Error, Result, atomic, scene};
use glam::DVec3;
use serde_json::json;

use crate::agreement::{python_of_environment, spread};
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::mean_with_error;
use crate::experiments::measures::pictures::{mean, mean_of};
use crate::experiments::reference::{SEED, short_name};
use crate::experiments::sweep::SPP_MAX;
use crate::experiments::unbiased;
use crate::experiments::watch::render;
use crate::mitsuba;
use crate::python;
use crate::timing::{median, timed};

/// What a sphere of glass throws into the fog below it, and a mirrored one into the fog above it, with the place that is looked at, m, for the sphere itself not to be seen.
const SCENES: [(&str, DVec3); 2] = [
    (
        "builtin:fog-box?sphere=glass&boxes=none&lamp=0.1",
        DVec3::new(0.16, 0.08, 0.13),
    ),
    (
        "builtin:fog-box?sphere=mirror&boxes=none&lamp=0.1",
        DVec3::new(0.2, 0.43, 0.2),
    ),
];
/// Where it is seen from, m, and in what field of view.
const EYE: DVec3 = DVec3::new(0.278, 0.273, -0.8);
const FIELD_OF_VIEW: f32 = 10.0 * PI / 180.0;
/// Pixels a side, and samples a pixel of references.
const FULL: (u32, u32) = (32, 8192);
const SMOKE: (u32, u32) = (8, 64);
/// Seconds of a picture of ours, and samples a pixel of one in a smoke run, which has no time.
const SECONDS: f64 = 3.0;
const SMOKE_SPP: u32 = 2;
/// Our estimates in media.
const OURS: [(&str, &str); 2] = [("beam estimate", "ray"), ("photon beams", "beams")];
/// Mitsuba's integrators.
const THEIRS: [&str; 2] = ["volpath", "volpathmis"];
/// Samples a pixel of a picture of Mitsuba's.
const SAMPLES: u32 = 1024;
/// Each contender's turns, and Mitsuba's pictures in each.
const TURNS: usize = 5;
const PICTURES: u32 = 2;
const SCRIPT: &str = "reference.py";
const SCRIPT_TEXT: &str = include_str!("../../../../mitsuba/reference.py");
const NEEDED: &str = "Mitsuba 3; see tools/mitsuba/README.md";
/// Bytes of a turn's pictures at most.
const FILE_MAX: u64 = 1 << 28;
/// Standard errors to each side of an interval.
const MARGIN: f64 = 2.0;
/// Means may differ by that much, relatively.
const ALLOWED: f64 = 0.01;

rows! {
    /// An estimate of ours and an integrator of Mitsuba's on a scene.
    struct Row = "Time to equal error beside Mitsuba" by [scene, estimate, integrator] {
        scene: String = "scene",
        estimate: String = "our estimate",
        integrator: String = "Mitsuba's integrator",
        version: String = "version",
        ours: Repeats = "our picture (s)",
        theirs: Repeats = "Mitsuba's picture (s)",
        our_error: Measured = "our relative MSE",
        their_error: Measured = "Mitsuba's relative MSE",
        over: Measured = "Mitsuba's time to equal error over ours",
    }
}
rows! {
    /// A scene by the best of both.
    struct Best = "The best of ours beside Mitsuba's best" by [scene] {
        scene: String = "scene",
        estimate: String = "our estimate",
        integrator: String = "Mitsuba's integrator",
        over: Measured = "Mitsuba's time to equal error over ours",
    }
}
rows! {
    /// The mean of a contender's pictures.
    struct Mean = "Means, over those of bidirectional paths" by [scene, contender] {
        scene: String = "scene",
        contender: String = "contender",
        is_ours: bool = "ours",
        mean: Measured = "mean over that of the reference",
    }
}
rows! {
    /// A scene that Mitsuba did not render.
    struct LeftOut = "Left out" by [scene, integrator] {
        scene: String = "scene",
        integrator: String = "Mitsuba's integrator",
        cause: String = "cause",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    rows: Vec<Row>,
    means: Vec<Mean>,
    left_out: Vec<LeftOut>,
}

const OF_BEST: &[Criterion<Best>] = &[Criterion::each(
    "photons reach an error in a tenth of the time of Mitsuba's best: its time over ours",
    Bound::AtLeast(10.0),
    |row: &Best| row.over,
)
.needs("Mitsuba")];
const OF_MEANS: &[Criterion<Mean>] = &[Criterion::each(
    "means of photons are those of bidirectional paths within 1 %: ratio",
    Bound::Between(1.0 - ALLOWED, 1.0 + ALLOWED),
    |row: &Mean| row.mean,
)
.among(|row| row.is_ours)];

/// What Mitsuba's script writes, as far as it is needed here.
#[derive(serde::Deserialize)]
struct Answer {
    renderer: String,
    variant: String,
    seconds_each: Vec<f64>,
}

/// A picture of a turn.
struct Shot {
    seconds: f64,
    mean: f64,
    /// About the reference, of ours alone.
    relative_mse: f64,
    /// Of Mitsuba's alone.
    radiance: Vec<f32>,
}

/// A contender's pictures.
#[derive(Clone)]
struct Contender {
    seconds: Repeats,
    /// With its standard error.
    relative_mse: [f64; 2],
    /// With its standard error.
    mean: [f64; 2],
}

impl Contender {
    /// `None` without pictures, or with too few of Mitsuba's.
    fn of(turns: &[Vec<Shot>], reference: &[f32], reference_error: f64) -> Option<Self> {
        let of_turn = |turn: &Vec<Shot>| median(turn.iter().map(|shot| shot.seconds).collect());
        let seconds: Repeats = turns.iter().filter(|turn| !turn.is_empty()).map(of_turn).collect();
        let shots: Vec<&Shot> = turns.iter().flatten().collect();
        let first = shots.first()?;
        let relative_mse = if first.radiance.is_empty() {
            let errors: Vec<f64> = shots.iter().map(|shot| shot.relative_mse).collect();
            let [error, deviation] = mean_with_error(&errors);
            [error, deviation.hypot(reference_error)]
        } else {
            let pictures: Vec<Vec<f32>> = shots.iter().map(|shot| shot.radiance.clone()).collect();
            let found = spread::measure(&pictures, reference)?;
            [found.relative_mse, found.standard_error]
        };
        let means: Vec<f64> = shots.iter().map(|shot| shot.mean).collect();
        Some(Self {
            seconds,
            relative_mse,
            mean: mean_with_error(&means),
        })
    }

    fn error(&self) -> Measured {
        Measured::within(self.relative_mse[0], MARGIN * self.relative_mse[1])
    }

    /// Relative standard errors of the error and of the seconds, together.
    fn uncertainty(&self) -> f64 {
        let [seconds, deviation] = mean_with_error(&self.seconds.0);
        (self.relative_mse[1] / self.relative_mse[0]).hypot(deviation / seconds)
    }

    /// Seconds of a picture of independent samples that has the error of another one, over the seconds of that one.
    fn time_over(&self, ours: &Self) -> Measured {
        let [own, other] = [self, ours].map(|one| median(one.seconds.0.clone()));
        // An error that the reference's noise brings below 0 has no ratio.
        let ratio = match self.relative_mse[0] / ours.relative_mse[0] {
            errors if errors > 0.0 => own * errors / other,
            _ => f64::NAN,
        };
        Measured::within(ratio, MARGIN * ratio * self.uncertainty().hypot(ours.uncertainty()))
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let python = python_of_environment();
        atomic::write(&context.file(SCRIPT)?, SCRIPT_TEXT.as_bytes())?;
        let mut found = Self::default();
        let name = |(address, _): &(&str, DVec3)| short_name(address).to_owned();
        let rows = context.each(context.first(&SCENES, 1), name, |&(address, target)| {
            let mut of_scene = of_scene(context, &gpu, &python, (address, target))?;
            found.means.append(&mut of_scene.means);
            found.left_out.append(&mut of_scene.left_out);
            Ok(of_scene.rows)
        })?;
        found.rows = rows;
        Ok(found)
    }

    fn findings(&self) -> Findings {
        let best = best(&self.rows);
        Findings::of(&best, OF_BEST)
            .headline(
                "Mitsuba's time to equal error over ours, by the best of both, geometric mean",
                geometric_mean(best.iter().map(|row| row.over)),
            )
            .and(Findings::of(&self.rows, &[]))
            .note(format!(
                "{0} × {0} pixels of what lies beside the sphere; {TURNS} turns, of a picture of {SECONDS} s by photons with default settings, with the preparation of the technique, and of {PICTURES} pictures of {SAMPLES} independent samples \
                 a pixel by Mitsuba, without it. Ours are held against {1} samples a pixel of bidirectional paths; what Mitsuba's error would be after our time is that of one over time.",
                FULL.0, FULL.1,
            ))
            .and(Findings::of(&self.means, OF_MEANS))
            .and(Findings::of(&self.left_out, &[]))
    }
}

/// Of each scene the estimate of ours that leaves Mitsuba's best farthest behind.
fn best(rows: &[Row]) -> Vec<Best> {
    let by_over = |a: &&Row, b: &&Row| a.over.value.total_cmp(&b.over.value);
    let of_scene = |rows: &[Row]| {
        let least = rows
            .chunk_by(|a, b| a.estimate == b.estimate)
            .filter_map(|rows| rows.iter().min_by(by_over));
        let best = least.max_by(by_over)?;
        Some(Best {
            scene: best.scene.clone(),
            estimate: best.estimate.clone(),
            integrator: best.integrator.clone(),
            over: best.over,
        })
    };
    rows.chunk_by(|a, b| a.scene == b.scene).filter_map(of_scene).collect()
}

/// A scene without interpolated normals, which renderers treat each in its own way, with a camera that sees no sphere: what mirrors alone bring to a point and from it to the
/// eye is in no picture, since no strategy of the reference joins it.
fn flat(address: &str, target: DVec3) -> Result<Scene> {
    let mut scene = scene::load(address)?;
    scene.cameras = vec![Camera::look_at(
        "beside the sphere",
        EYE,
        target,
        DVec3::Y,
        FIELD_OF_VIEW,
    )];
    for mesh in &mut scene.meshes {
        mesh.normals.clear();
        mesh.tangents.clear();
    }
    Ok(scene)
}

/// All contenders in turns, and what Mitsuba is missing for. A smoke run has ours alone.
fn of_scene(context: &Context<'_>, gpu: &Gpu, python: &Path, (address, target): (&str, DVec3)) -> Result<Found> {
    let scene = flat(address, target)?;
    let name = short_name(address);
    let (side, spp) = context.pick(FULL, SMOKE);
    let folder = context.folder.join(name.replace(['?', '=', '&', '.'], "-"));
    let exported = mitsuba::export(&scene, "", [side; 2], &folder);
    let renderer = Renderer::new(gpu, &scene)?;
    let of_reference = RenderOptions {
        technique: Some("bdpt".into()),
        size: [side; 2],
        spp,
        seed: SEED,
        settings: json!({ "sampler": "pcg", "samples_at_once": 1 }).into(),
        ..RenderOptions::default()
    };
    let Some(rendered) = render(&renderer, &of_reference, context.watch)? else {
        return Ok(Found::default());
    };
    let reference = rendered.picture;
    let (expected, expected_error) = (mean(&reference)?, unbiased::error_of_mean(&reference)?);
    let mut causes: [Option<String>; THEIRS.len()] = Default::default();
    let mut versions: [String; THEIRS.len()] = Default::default();
    let mut reference_error = 0.0_f64;
    let mut seed = 0;
    let contenders = OURS.len() + context.pick(THEIRS.len(), 0);
    let turns = context.in_turns(TURNS, contenders, |i| {
        seed += PICTURES + 1;
        if context.watch.stopped() {
            return Ok(Vec::new());
        }
        let Some(peer) = i.checked_sub(OURS.len()) else {
            let shot = our_shot(context, &renderer, &reference, OURS[i].1, seed)?;
            let found = shot.map(|(shot, by_reference)| {
                reference_error = reference_error.max(by_reference);
                shot
            });
            return Ok(Vec::from_iter(found));
        };
        if causes[peer].is_some() {
            return Ok(Vec::new());
        }
        let answer = match &exported {
            Ok(exported) => their_turn(context, python, (THEIRS[peer], &exported.scene), &folder, seed),
            Err(cause) => Err(Error::setting("scene", address, cause.to_string())),
        };
        Ok(match answer {
            Ok((turn, version)) => {
                versions[peer] = version;
                turn
            }
            Err(cause) => {
                causes[peer] = Some(cause.to_string());
                Vec::new()
            }
        })
    })?;
    let radiance = reference.require(picture::RADIANCE)?.values();
    let all: Vec<Option<Contender>> = turns
        .iter()
        .map(|turns| Contender::of(turns, radiance, reference_error))
        .collect();
    let mut found = Found::default();
    let called = OURS.iter().map(|(estimate, _)| *estimate).chain(THEIRS);
    for (i, (contender, called)) in all.iter().zip(called).enumerate() {
        let Some(contender) = contender else {
            continue;
        };
        let [of_all, error] = contender.mean;
        let ratio = of_all / expected;
        found.means.push(Mean {
            scene: name.into(),
            contender: called.into(),
            is_ours: i < OURS.len(),
            mean: Measured::within(ratio, MARGIN * ratio * (error / of_all).hypot(expected_error)),
        });
    }
    for (ours, (estimate, _)) in all.iter().zip(OURS) {
        for (peer, integrator) in THEIRS.into_iter().enumerate() {
            let theirs = all.get(OURS.len() + peer).and_then(Option::as_ref);
            if let (Some(ours), Some(theirs)) = (ours, theirs) {
                found.rows.push(Row {
                    scene: name.into(),
                    estimate: estimate.into(),
                    integrator: integrator.into(),
                    version: versions[peer].clone(),
                    ours: ours.seconds.clone(),
                    theirs: theirs.seconds.clone(),
                    our_error: ours.error(),
                    their_error: theirs.error(),
                    over: theirs.time_over(ours),
                });
            }
        }
    }
    for (integrator, cause) in THEIRS.into_iter().zip(causes) {
        let cause = if context.smoke {
            Some("smoke runs have ours alone".into())
        } else {
            cause
        };
        found.left_out.extend(cause.map(|cause| LeftOut {
            scene: name.into(),
            integrator: integrator.into(),
            cause,
        }));
    }
    Ok(found)
}

/// A picture of ours, and the standard error that the reference's noise gives its relative MSE; `None` when it was stopped.
fn our_shot(
    context: &Context<'_>,
    renderer: &Renderer,
    reference: &Picture,
    volume: &str,
    seed: u32,
) -> Result<Option<(Shot, f64)>> {
    let side = context.pick(FULL, SMOKE).0;
    let options = RenderOptions {
        technique: Some("photon".into()),
        size: [side; 2],
        seed,
        spp: context.pick(SPP_MAX, SMOKE_SPP),
        time_budget: context.pick(Some(Duration::from_secs_f64(SECONDS)), None),
        settings: json!({ "volume": volume }).into(),
        ..RenderOptions::default()
    };
    let (rendered, seconds) = timed(|| render(renderer, &options, context.watch));
    let Some(rendered) = rendered? else {
        return Ok(None);
    };
    let error = unbiased::measure(&rendered.picture, reference)?;
    let shot = Shot {
        seconds,
        mean: mean(&rendered.picture)?,
        relative_mse: error.relative_mse,
        radiance: Vec::new(),
    };
    Ok(Some((shot, error.reference_relative_error)))
}

/// A turn of an integrator of Mitsuba's, and its version.
fn their_turn(
    context: &Context<'_>,
    python: &Path,
    (integrator, scene): (&str, &Path),
    folder: &Path,
    seed: u32,
) -> Result<(Vec<Shot>, String)> {
    let prefix = folder.join("mitsuba");
    let mut command = Command::new(python);
    command
        .arg(context.folder.join(SCRIPT))
        .args([scene.as_os_str(), prefix.as_os_str()])
        .args(["--integrator", integrator, "--sampler", "independent", "--each"])
        .args(["--spp", &SAMPLES.to_string()])
        .args(["--passes", &PICTURES.to_string()])
        .args(["--seed", &seed.to_string()]);
    if python::run(python, &mut command, NEEDED, context.watch)?.is_none() {
        return Ok((Vec::new(), String::new()));
    }
    let bytes = read_file(&prefix.with_extension("json"), FILE_MAX)?;
    let answer: Answer = serde_json::from_slice(&bytes)
        .map_err(|cause| Error::setting("mitsuba", String::from_utf8_lossy(&bytes), cause.to_string()))?;
    let bytes = read_file(&prefix.with_extension("f32"), FILE_MAX)?;
    let values: Vec<f32> = bytes
        .as_chunks::<4>()
        .0
        .iter()
        .map(|word| f32::from_le_bytes(*word))
        .collect();
    let pixels = 3 * (FULL.0 * FULL.0) as usize;
    let shots = values.chunks_exact(pixels).zip(answer.seconds_each);
    let shots = shots.map(|(radiance, seconds)| Shot {
        seconds,
        mean: mean_of(radiance),
        relative_mse: f64::NAN,
        radiance: radiance.to_vec(),
    });
    Ok((shots.collect(), format!("{}, {}", answer.renderer, answer.variant)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(estimate: &str, integrator: &str, over: f64) -> Row {
        Row {
            scene: "fog".into(),
            estimate: estimate.into(),
            integrator: integrator.into(),
            over: Measured::exact(over),
            ..Row::default()
        }
    }

    #[test]
    fn the_best_of_ours_is_held_against_mitsubas_best() {
        let rows = [
            row("a", "volpath", 40.0),
            row("a", "volpathmis", 5.0),
            row("b", "volpath", 12.0),
            row("b", "volpathmis", 15.0),
        ];
        let best = best(&rows);
        assert_eq!(best.len(), 1);
        assert_eq!(
            (
                best[0].estimate.as_str(),
                best[0].integrator.as_str(),
                best[0].over.value
            ),
            ("b", "volpath", 12.0)
        );
        assert!(super::best(&[]).is_empty());
    }

    #[test]
    fn times_to_equal_error_are_those_of_independent_samples() {
        let contender = |seconds: f64, error: f64| Contender {
            seconds: Repeats(vec![seconds; 5]),
            relative_mse: [error, 0.1 * error],
            mean: [1.0, 0.0],
        };
        // A quarter of the time for sixteen times the error.
        let over = contender(0.5, 0.16).time_over(&contender(2.0, 0.01));
        assert!((over.value - 4.0).abs() < 1e-12, "{over:?}");
        assert!(
            (over.high - over.value - 4.0 * MARGIN * 0.02_f64.sqrt()).abs() < 1e-12,
            "{over:?}"
        );
        assert!(contender(0.5, 0.16).time_over(&contender(2.0, -1e-6)).value.is_nan());
    }
}
