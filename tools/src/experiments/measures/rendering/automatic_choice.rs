//! Automatic choice of settings and samples: is the error of the picture the one that was asked for, and the time?
//!
//! Oracle: a reference with many independent samples, whose own variance is subtracted.

use std::time::{Duration, Instant};

use clerestory::gpu::Gpu;
use clerestory::plan::{Goal, plan};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::{Result, scene};
use serde_json::{Value, json};

use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::reference::short_name;
use crate::experiments::unbiased;
use crate::experiments::watch::render;

use super::technique_choice::{FACTOR, FIRST_SEED, REFERENCE_SEED};

/// Scenes with an error (root of the relative MSE) or a time (seconds) to keep; twenty have an error. None of them had a part in the making of the planner.
pub(super) const PAIRS: [(&str, Asked); 22] = [
    ("builtin:atrium", Asked::Error(0.1)),
    ("builtin:box-room?mirror=no", Asked::Error(0.1)),
    ("builtin:atrium", Asked::Seconds(4.0)),
    ("builtin:divider-room", Asked::Error(0.15)),
    ("builtin:divider-room?roughness=0.3", Asked::Error(0.1)),
    ("builtin:passage", Asked::Error(0.3)),
    ("builtin:ring", Asked::Error(0.2)),
    ("builtin:ring?roughness=0.2", Asked::Error(0.2)),
    ("builtin:ring?roughness=0.2", Asked::Seconds(3.0)),
    ("builtin:sphere-flake", Asked::Error(0.05)),
    ("builtin:box-city", Asked::Error(0.05)),
    ("builtin:cathedral", Asked::Error(0.1)),
    ("builtin:cornell-box?lamp=0.1", Asked::Error(0.1)),
    ("builtin:cornell-box?sphere=gold", Asked::Error(0.05)),
    ("builtin:cornell-box?sphere=glass", Asked::Error(0.3)),
    ("builtin:materials", Asked::Error(0.1)),
    ("builtin:forest", Asked::Error(0.1)),
    ("builtin:wax", Asked::Error(0.2)),
    ("builtin:medium-slab", Asked::Error(0.05)),
    ("builtin:smoke", Asked::Error(0.1)),
    ("builtin:fog-box?source=point", Asked::Error(0.3)),
    ("builtin:cloud", Asked::Error(0.3)),
];
/// Choices of each, with a seed and a picture of their own.
const CHOICES: u32 = 5;
/// Where the median of all errors over those asked for is to lie, and what at most one in ten is to exceed.
const MEDIAN: [f64; 2] = [0.95, 1.05];
const FAR: f64 = 1.2;
const FAR_SHARE: f64 = 0.1;
/// Share of pictures that the interval printed with a prediction is for.
const INTERVAL: f64 = 0.9;
/// Share of the time that pilots are to keep to above so many seconds.
const PILOT_SHARE: f64 = 0.25;
const LONG: f64 = 5.0;

/// Side, and the most samples per pixel of the reference, of scenes with goals, in full and of a smoke run.
const GOALS: ((u32, u32), (u32, u32)) = ((64, 16_384), (8, 512));
/// The reference has so many times the samples of the first choice's picture, up to those most samples. Its variance is subtracted: what its noise then
/// leaves in a squared error is to be below that share of it.
const REFERENCE_SAMPLES: u32 = 25;
const REFERENCE_SHARE: f64 = 0.1;
/// Goals of a smoke run, one of each kind.
pub(super) const SMOKE_PAIRS: [(&str, Asked); 2] = [
    ("builtin:box-room", Asked::Error(0.5)),
    ("builtin:box-room", Asked::Seconds(0.5)),
];

/// What is asked of the planner.
#[derive(Clone, Copy)]
pub(super) enum Asked {
    Error(f64),
    Seconds(f64),
}

rows! {
    /// A goal of the path tracer, chosen for several times.
    struct Aimed = "Asked, predicted and reached" by [scene, asked, time] {
        scene: String = "scene",
        asked: Option<f64> = "asked: error",
        time: Option<f64> = "asked: seconds",
        predicted: Repeats = "predicted error",
        error: Repeats = "error",
        ratio: Repeats = "error over the asked or predicted one",
        low: Repeats = "lower end of the printed interval over the error",
        high: Repeats = "upper end of the printed interval over the error",
        predicted_seconds: Repeats = "predicted seconds",
        seconds: Repeats = "seconds",
        pilots: Repeats = "pilots: share of the time",
        settings: String = "settings, of the last choice",
        samples: Repeats = "samples per pixel",
        reference: Repeats = "standard error by the reference's noise over the squared error",
    }
}

/// What was found.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    goals: Vec<Aimed>,
}

/// Of every goal.
pub(super) const OF_GOALS: &[Criterion<Aimed>] = &[
    Criterion::all(
        "errors are those asked for: the median of their ratios over all scenes and seeds",
        Bound::Between(MEDIAN[0], MEDIAN[1]),
        |rows: &[&Aimed]| (!rows.is_empty()).then(|| Repeats(ratios(rows)).measured()),
    )
    .among(|row| row.asked.is_some()),
    Criterion::all(
        "few errors are far above those asked for: share of scenes and seeds above 1.2 times",
        Bound::AtMost(FAR_SHARE),
        |rows: &[&Aimed]| share(&ratios(rows), |ratio| ratio > FAR).map(Measured::exact),
    )
    .among(|row| row.asked.is_some()),
    Criterion::all(
        "errors lie in the interval that is printed with the prediction: share of scenes and seeds",
        Bound::AtLeast(INTERVAL),
        |rows: &[&Aimed]| {
            let ends = |row: &&Aimed| {
                row.low
                    .0
                    .iter()
                    .copied()
                    .zip(row.high.0.iter().copied())
                    .collect::<Vec<_>>()
            };
            let all: Vec<(f64, f64)> = rows.iter().flat_map(ends).collect();
            let margin = 2.0 * (INTERVAL * (1.0 - INTERVAL) / all.len().max(1) as f64).sqrt();
            share(&all, |(low, high)| low <= 1.0 && high >= 1.0).map(|share| Measured::within(share, margin))
        },
    )
    .among(|row| row.low.0.iter().all(|end| end.is_finite()))
    .because(
        "what the interval says, with two standard errors of a share of so many; none is printed where light is missed",
    ),
    Criterion::each(
        "the reference's noise leaves less than a tenth in the squared error: its standard error over that",
        Bound::AtMost(REFERENCE_SHARE),
        |row: &Aimed| (&row.reference).into(),
    ),
    Criterion::each(
        "the error is the one asked for, or the predicted one: their ratio",
        Bound::Between(1.0 / FACTOR, FACTOR),
        |row: &Aimed| (&row.ratio).into(),
    ),
    Criterion::each(
        "pilots take at most a quarter of the time of each picture where it is above five seconds: the largest share",
        Bound::AtMost(PILOT_SHARE),
        |row: &Aimed| Measured::exact(shares_of_long(row).fold(0.0, f64::max)),
    )
    .among(|row| shares_of_long(row).next().is_some()),
];

/// Of a time to keep.
const OF_TIMES: &[Criterion<Aimed>] = &[Criterion::each(
    "no more time is taken than was asked for, less is no fault: seconds over those asked for",
    Bound::AtMost(FACTOR),
    |row: &Aimed| (&row.seconds.scaled(1.0 / row.time.unwrap_or(f64::INFINITY))).into(),
)
.among(|row| row.time.is_some())];

/// The pilots' shares of all time, pilots' and picture's, where that is long.
fn shares_of_long(row: &Aimed) -> impl Iterator<Item = f64> {
    let pictures = row.seconds.0.iter().zip(&row.pilots.0);
    pictures
        .filter(|(seconds, _)| **seconds > LONG)
        .map(|(_, share)| *share)
}

/// All errors over those asked for.
fn ratios(rows: &[&Aimed]) -> Vec<f64> {
    rows.iter().flat_map(|row| row.ratio.0.iter().copied()).collect()
}

/// The share of values that are so; `None` of none.
fn share<T: Copy>(values: &[T], is_so: fn(T) -> bool) -> Option<f64> {
    let count = values.iter().filter(|value| is_so(**value)).count();
    (!values.is_empty()).then(|| count as f64 / values.len() as f64)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let pairs: &[(&str, Asked)] = context.pick(&PAIRS, &SMOKE_PAIRS);
        Ok(Self {
            goals: context.each_kept(
                &gpu,
                pairs,
                |(address, _)| (*address).into(),
                |(address, asked)| goal(context, &gpu, address, *asked, json!({})),
            )?,
        })
    }

    fn findings(&self) -> Findings {
        found(&self.goals).judged(&self.goals, OF_TIMES)
    }
}

/// Goals with the verdicts on all of them.
pub(super) fn found(goals: &[Aimed]) -> Findings {
    let ratios = goals.iter().map(|row| row.ratio.measured());
    Findings::of(goals, OF_GOALS)
        .note(
            "Errors: root of the relative MSE against a reference of a seed of its own, whose variance is subtracted. Seconds are those of pilots \
             and picture.",
        )
        .note(format!(
            "Each goal is chosen for {CHOICES} times, with seeds of their own for pilots and picture."
        ))
        .headline("error over the asked or predicted one, geometric mean", geometric_mean(ratios))
}

/// Whether an error or a time is kept with the path tracer's settings at hand; nothing when it was stopped.
pub(super) fn goal(
    context: &Context<'_>,
    gpu: &Gpu,
    address: &str,
    asked: Asked,
    settings: Value,
) -> Result<Vec<Aimed>> {
    let watch = context.watch;
    let (full, smoke) = GOALS;
    let (side, most_reference_spp) = context.pick(full, smoke);
    let renderer = Renderer::new(gpu, &scene::load(address)?)?;
    let base = RenderOptions {
        technique: Some("path".into()),
        size: [side; 2],
        settings: settings.into(),
        ..RenderOptions::default()
    };
    let (error, seconds) = match asked {
        Asked::Error(error) => (Some(error), None),
        Asked::Seconds(seconds) => (None, Some(seconds)),
    };
    let goal = Goal {
        error,
        time: seconds.map(Duration::from_secs_f64),
    };
    // Kernels are compiled, as they are from the second picture of a user on.
    let first = plan(&renderer, &base, goal, &mut || !watch.stopped())?;
    if render(&renderer, &first.options(&base), watch)?.is_none() {
        return Ok(Vec::new());
    }
    let of_reference = RenderOptions {
        spp: first
            .choice()
            .spp
            .saturating_mul(REFERENCE_SAMPLES)
            .min(most_reference_spp),
        seed: REFERENCE_SEED,
        settings: json!({ "sampler": "pcg" }).into(),
        ..base.clone()
    };
    let Some(reference) = render(&renderer, &of_reference, watch)? else {
        return Ok(Vec::new());
    };
    let mut of_choices: Vec<[f64; 10]> = Vec::new();
    let mut variant = String::new();
    for choice in 1..=CHOICES {
        let base = RenderOptions {
            seed: FIRST_SEED + 100 * choice,
            ..base.clone()
        };
        let start = Instant::now();
        let plan = plan(&renderer, &base, goal, &mut || !watch.stopped())?;
        let planned = start.elapsed().as_secs_f64();
        let Some(rendered) = render(&renderer, &plan.options(&base), watch)? else {
            return Ok(Vec::new());
        };
        let chosen = plan.choice();
        let squared = unbiased::measure(&rendered.picture, &reference.picture)?;
        let found = squared.relative_mse.max(0.0).sqrt();
        // There is none where the path tracer misses light.
        let [low, high] = chosen.error_interval.unwrap_or([f64::INFINITY; 2]);
        let all = planned + rendered.report.render_seconds;
        of_choices.push([
            chosen.error,
            found,
            found / error.unwrap_or(chosen.error),
            low / found,
            high / found,
            chosen.seconds + plan.pilot_seconds,
            all,
            planned / all,
            f64::from(chosen.spp),
            squared.reference_relative_error / squared.relative_mse,
        ]);
        variant = chosen.variant.into();
    }
    let [
        predicted,
        error_found,
        ratio,
        low,
        high,
        predicted_seconds,
        all_seconds,
        pilots,
        samples,
        reference,
    ] = Repeats::by_part(&of_choices);
    Ok(vec![Aimed {
        scene: short_name(address).into(),
        asked: error,
        time: seconds,
        predicted,
        error: error_found,
        ratio,
        low,
        high,
        predicted_seconds,
        seconds: all_seconds,
        pilots,
        settings: variant,
        samples,
        reference,
    }])
}
