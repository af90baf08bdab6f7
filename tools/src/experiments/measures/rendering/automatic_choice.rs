//! Automatic choice: is the error of the picture the one that was asked for, and is the technique the one that wins?
//!
//! Oracle: a reference with many independent samples, whose own variance is subtracted. Where the path tracer cannot find all paths, it is photon
//! mapping's, of a seed of its own and many more passes.

use std::time::{Duration, Instant};

use clerestory::plan::{Goal, plan};
use clerestory::render::{RenderOptions, Rendered, Renderer};
use clerestory::{Error, Result, scene};

use crate::experiments::measures::Context;
use crate::experiments::measures::context::short_name;
use crate::experiments::table::Table;
use crate::experiments::unbiased;
use crate::experiments::watch::Watch;

/// Scenes with an error (root of the relative MSE) or a time (seconds) to keep. None of them had a part in the making of the planner.
const PAIRS: [(&str, Asked); 12] = [
    ("builtin:box-room", Asked::Error(0.1)),
    ("builtin:box-room", Asked::Seconds(4.0)),
    ("builtin:divider-room", Asked::Error(0.15)),
    ("builtin:ring", Asked::Error(0.2)),
    ("builtin:ring?roughness=0.2", Asked::Seconds(3.0)),
    ("builtin:sphere-flake", Asked::Error(0.05)),
    ("builtin:box-city", Asked::Error(0.05)),
    ("builtin:cornell-box?sphere=gold", Asked::Error(0.05)),
    ("builtin:cornell-box?sphere=glass", Asked::Error(0.3)),
    ("builtin:smoke", Asked::Error(0.1)),
    ("builtin:fog-box?source=point", Asked::Error(0.1)),
    ("builtin:cloud", Asked::Error(0.1)),
];
/// A scene, what is asked for, and the technique that is expected to win.
struct Contest {
    address: &'static str,
    path_set: &'static str,
    side: u32,
    error: f64,
    winner: &'static str,
    rival: &'static str,
    reference: (&'static str, u32),
}

/// Photon mapping is expected to win where light that no eye path can meet, or that few meet, is thrown by glass or metal: of points, of spots and of
/// small lamps. The ring and direct light at a hundredth or two were expected to be won by photons and by the preview; direct light at a tenth, for which
/// a sample per pixel is enough or shadow maps are too coarse, by the path tracer.
const CONTESTS: [Contest; 10] = [
    Contest::of_all_light(
        "builtin:cornell-box?sphere=glass&boxes=none&source=point",
        0.1,
        BY_PHOTONS,
    ),
    Contest::of_all_light(
        "builtin:cornell-box?sphere=glass&boxes=none&source=spot",
        0.1,
        BY_PHOTONS,
    ),
    Contest::of_all_light(
        "builtin:cornell-box?sphere=gold&boxes=none&source=point",
        0.1,
        BY_PHOTONS,
    ),
    Contest::of_all_light("builtin:cornell-box?sphere=glass&boxes=none&lamp=0.05", 0.1, BY_PATHS),
    Contest::of_all_light("builtin:ring", 0.2, BY_PHOTONS),
    Contest::of_direct_light("builtin:cornell-box?source=point", 512, 0.015, ["preview", "path"]),
    Contest::of_direct_light("builtin:box-room?source=point", 512, 0.02, ["preview", "path"]),
    Contest::of_all_light("builtin:cornell-box?sphere=glass&boxes=none&lamp=0.1", 0.1, BY_PATHS),
    Contest::of_direct_light("builtin:cornell-box?source=point", 256, 0.1, ["path", "preview"]),
    Contest::of_direct_light("builtin:cathedral?source=point", 256, 0.1, ["path", "preview"]),
];
/// References: the technique and its samples per pixel. Photon mapping's is for caustics that the path tracer cannot find.
const BY_PHOTONS: (&str, u32) = ("photon", 1024);
const BY_PATHS: (&str, u32) = ("path", 24_576);

impl Contest {
    /// Which photon mapping is expected to win, beside the path tracer.
    const fn of_all_light(address: &'static str, error: f64, reference: (&'static str, u32)) -> Self {
        Self {
            address,
            path_set: "all",
            side: 48,
            error,
            winner: "photon",
            rival: "path",
            reference,
        }
    }

    /// Against a reference of more samples where the picture is smaller.
    const fn of_direct_light(address: &'static str, side: u32, error: f64, [winner, rival]: [&'static str; 2]) -> Self {
        Self {
            address,
            path_set: "direct",
            side,
            error,
            winner,
            rival,
            reference: ("path", 131_072 / side),
        }
    }
}

/// Within this factor an error or a time counts as kept.
const FACTOR: f64 = 1.5;
/// Far from the seeds of pilots and pictures.
const REFERENCE_SEED: u32 = 77_777;

/// What is asked of the planner.
#[derive(Clone, Copy)]
enum Asked {
    Error(f64),
    Seconds(f64),
}

/// `None` when it was stopped.
fn render(renderer: &Renderer, options: &RenderOptions, watch: &dyn Watch) -> Result<Option<Rendered>> {
    let mut rendering = renderer.start(options)?;
    while let Some(progress) = rendering.step()? {
        watch.step(progress);
        if watch.stopped() {
            return Ok(None);
        }
    }
    rendering.finish().map(Some)
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    Ok(vec![contests(context)?, goals(context)?])
}

/// Which technique is chosen, and how far the other one comes in the same time.
fn contests(context: &Context<'_>) -> Result<Table> {
    let contests = if context.smoke { &CONTESTS[..1] } else { &CONTESTS[..] };
    let (gpu, watch) = ((context.gpu)()?, context.watch);
    let mut table = Table::new(
        "Techniques",
        &[
            "scene",
            "light paths",
            "asked: error",
            "expected",
            "chosen",
            "samples a pixel",
            "predicted bias",
            "predicted noise",
            "predicted error",
            "error",
            "predicted seconds",
            "seconds",
            "pilots: seconds",
            "other: error in as many seconds",
            "other: why not",
            "wins",
        ],
    );
    let (mut as_expected, mut winning, mut reached, mut done) = (0_u64, 0_u64, 0_u64, 0_usize);
    for contest in contests {
        watch.begin(contest.address, done, contests.len());
        let renderer = Renderer::new(&gpu, &scene::load(contest.address)?)?;
        let (reference, spp) = contest.reference;
        let (side, spp) = if context.smoke { (8, 16) } else { (contest.side, spp) };
        let base = RenderOptions {
            size: [side; 2],
            settings: serde_json::json!({ "path_set": contest.path_set }).into(),
            ..RenderOptions::default()
        };
        let of_reference = RenderOptions {
            technique: Some(reference.into()),
            spp,
            seed: REFERENCE_SEED,
            settings: serde_json::json!({ "path_set": contest.path_set, "sampler": "pcg" }).into(),
            ..base.clone()
        };
        let Some(reference) = render(&renderer, &of_reference, watch)? else {
            break;
        };
        let goal = Goal {
            error: Some(contest.error),
            time: None,
        };
        let plan = plan(&renderer, &base, goal, &mut || !watch.stopped())?;
        let choice = plan.choice();
        let Some(rendered) = render(&renderer, &plan.options(&base), watch)? else {
            break;
        };
        let seconds = rendered.report.render_seconds;
        let error_of = |rendered: &Rendered| -> Result<f64> {
            let error = unbiased::measure(&rendered.picture, &reference.picture)?;
            Ok(error.relative_mse.max(0.0).sqrt())
        };
        let error = error_of(&rendered)?;
        let other_id = if choice.technique == contest.rival {
            contest.winner
        } else {
            contest.rival
        };
        let other = plan.candidates.iter().find(|candidate| candidate.technique == other_id);
        let other_options = RenderOptions {
            technique: Some(other_id.into()),
            settings: other.map_or_else(|| base.settings.clone(), |other| other.settings.clone().into()),
            spp: u32::MAX,
            time_budget: Some(Duration::from_secs_f64(seconds)),
            ..base.clone()
        };
        // Its kernels are compiled, as those of the chosen one are, unless the scene is none for it.
        let other_error = match render(&renderer, &other_options, watch) {
            Ok(Some(rendered)) => Some(error_of(&rendered)?),
            Ok(None) => break,
            Err(Error::Unsupported { .. } | Error::Setting { .. }) => None,
            Err(error) => return Err(error),
        };
        let why = match other {
            Some(other) if !other.reason.is_empty() => other.reason.clone(),
            Some(other) => format!("{:.2} s predicted", other.seconds),
            None => "is none of the techniques".into(),
        };
        done += 1;
        let wins = other_error.is_none_or(|other| error < other);
        as_expected += u64::from(choice.technique == contest.winner);
        winning += u64::from(wins);
        reached += u64::from(error <= FACTOR * contest.error);
        let or_dash = |value: Option<f64>| value.map_or_else(|| "-".into(), Into::into);
        table.row([
            short_name(contest.address).into(),
            contest.path_set.into(),
            contest.error.into(),
            contest.winner.into(),
            choice.technique.into(),
            u64::from(choice.spp).into(),
            or_dash(choice.bias),
            choice.noise.into(),
            choice.error.into(),
            error.into(),
            choice.seconds.into(),
            seconds.into(),
            plan.pilot_seconds.into(),
            or_dash(other_error),
            why.into(),
            if wins { "yes" } else { "no" }.into(),
        ]);
    }
    table.note(format!(
        "Of {done} chosen techniques, {as_expected} are the expected ones, {winning} have the smaller error, and {reached} reach the error that was asked for \
         within a factor of {FACTOR}. Errors that differ by a few per cent are of one picture each and decide nothing. Pictures are square, of 48 pixels a side for all light, of 256 where 0.1 is asked of \
         direct light, and of 512 where less. Errors: root of the relative MSE against a reference of a seed of its own, whose variance is subtracted: \
         24,576, 512 and 256 samples a pixel of the path tracer, 1024 passes of photon mapping where the path tracer cannot find caustics. Seconds are those of the picture, without the pilots; the other technique gets as many."
    ));
    Ok(table)
}

/// Whether errors and times are kept.
fn goals(context: &Context<'_>) -> Result<Table> {
    let (side, reference_spp, pairs) = if context.smoke {
        (8, 512, &PAIRS[..1])
    } else {
        (64, 1024, &PAIRS[..])
    };
    let (gpu, watch) = ((context.gpu)()?, context.watch);
    let mut table = Table::new(
        "Asked, predicted and reached",
        &[
            "scene",
            "asked: error",
            "predicted error",
            "error",
            "error / asked or predicted",
            "asked: seconds",
            "predicted seconds",
            "seconds",
            "pilots: seconds",
            "settings",
            "samples a pixel",
        ],
    );
    let (mut kept, mut done) = (0_u64, 0_usize);
    for &(address, asked) in pairs {
        watch.begin(address, done, pairs.len());
        let renderer = Renderer::new(&gpu, &scene::load(address)?)?;
        let base = RenderOptions {
            technique: Some("path".into()),
            size: [side; 2],
            ..RenderOptions::default()
        };
        let of_reference = RenderOptions {
            spp: reference_spp,
            seed: REFERENCE_SEED,
            settings: serde_json::json!({ "sampler": "pcg" }).into(),
            ..base.clone()
        };
        let Some(reference) = render(&renderer, &of_reference, watch)? else {
            break;
        };
        let goal = match asked {
            Asked::Error(error) => Goal {
                error: Some(error),
                time: None,
            },
            Asked::Seconds(seconds) => Goal {
                error: None,
                time: Some(Duration::from_secs_f64(seconds)),
            },
        };
        let start = Instant::now();
        let plan = plan(&renderer, &base, goal, &mut || !watch.stopped())?;
        let Some(rendered) = render(&renderer, &plan.options(&base), watch)? else {
            break;
        };
        let seconds = start.elapsed().as_secs_f64();
        let error = unbiased::measure(&rendered.picture, &reference.picture)?
            .relative_mse
            .max(0.0)
            .sqrt();
        let choice = plan.choice();
        let wanted = goal.error.unwrap_or(choice.error);
        let ratio = error / wanted;
        let in_time = goal.time.is_none_or(|time| seconds <= FACTOR * time.as_secs_f64());
        done += 1;
        kept += u64::from((1.0 / FACTOR..=FACTOR).contains(&ratio) && in_time);
        let or_dash = |value: Option<f64>| value.map_or_else(|| "-".into(), Into::into);
        table.row([
            short_name(address).into(),
            or_dash(goal.error),
            choice.error.into(),
            error.into(),
            ratio.into(),
            or_dash(goal.time.map(|time| time.as_secs_f64())),
            (choice.seconds + plan.pilot_seconds).into(),
            seconds.into(),
            plan.pilot_seconds.into(),
            choice.variant.into(),
            u64::from(choice.spp).into(),
        ]);
    }
    table.note(format!(
        "{kept} of {done} within a factor of {FACTOR} of the asked error, or of the predicted one in the asked time. Errors: root of the relative \
         MSE, {side} × {side} pixels, against {reference_spp} independent samples a pixel whose variance is subtracted."
    ));
    Ok(table)
}
