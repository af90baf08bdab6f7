//! Automatic choice among photons' estimates in media: is it the one that errs least in equal time?
//!
//! Oracle: a reference by the path tracer, whose own variance is subtracted.

use std::time::{Duration, Instant};

use clerestory::gpu::Gpu;
use clerestory::plan::{Goal, plan};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::{Result, scene};
use serde_json::json;

use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::reference::{SEED, short_name};
use crate::experiments::sweep::SPP_MAX;
use crate::experiments::unbiased;
use crate::experiments::watch::render;

/// Thin and dense fog, a caustic in fog, and a grid, in which there is nothing to choose.
const SCENES: [&str; 4] = [
    "builtin:fog-box?boxes=none&sigma_a=0.05&sigma_s=0.5",
    "builtin:fog-box?boxes=none&sigma_a=1&sigma_s=20",
    "builtin:fog-box?sphere=glass&boxes=none",
    "builtin:smoke",
];
/// Light that was scattered twice or more, the last time in a medium.
const PATHS: &str = "L.+VE";
/// Pixels a side, and samples a pixel of references.
const FULL: (u32, u32) = (32, 32768);
const SMOKE: (u32, u32) = (8, 64);
/// Photons of a pass.
const PHOTONS: u32 = 1 << 14;
const SMOKE_PHOTONS: u32 = 1 << 10;
/// Root of the relative MSE that is asked for: so little that a picture takes long, and pilots of all estimates are worth their time.
const ERROR: f64 = 0.01;
/// Seconds that pilots may take.
const PILOT_SECONDS: f64 = 15.0;
/// Estimates of a smoke run.
const SMOKE_ESTIMATES: usize = 2;
/// Seconds of each picture that is held against the reference, and samples of one in a smoke run, which has no time.
const SECONDS: f64 = 1.5;
const SMOKE_SPP: u32 = 2;
/// Pictures by each estimate.
const TURNS: usize = 9;
/// Within this factor of the least error a choice counts as the best.
const FACTOR: f64 = 1.5;

rows! {
    /// An estimate on a scene.
    struct Row = "Estimates in equal time" by [scene, estimate] {
        scene: String = "scene",
        estimate: String = "estimate",
        is_chosen: bool = "chosen",
        predicted: Option<f64> = "predicted seconds to the error asked for",
        error: Repeats = "relative RMSE",
        reason: String = "why it cannot be chosen",
    }
}
rows! {
    /// A choice.
    struct Choice = "The choice beside the best" by [scene] {
        scene: String = "scene",
        chosen: String = "chosen",
        best: String = "least error",
        over: Repeats = "relative RMSE of the chosen over the least",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    rows: Vec<Row>,
}

const CRITERIA: &[Criterion<Choice>] = &[Criterion::each(
    "the chosen estimate errs at most 1.5 times as much as the best: ratio",
    Bound::AtMost(FACTOR),
    |row: &Choice| (&row.over).into(),
)
.because("the factor within which the planner's own predictions count as kept")];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let name = |address: &&str| short_name(address).to_owned();
        let scenes = context.first(&SCENES, 1);
        let rows = context.each_kept(&gpu, scenes, name, |address| rows_of(context, &gpu, address))?;
        Ok(Self { rows })
    }

    fn findings(&self) -> Findings {
        let choices = choices(&self.rows);
        Findings::of(&choices, CRITERIA)
            .headline(
                "relative RMSE of the chosen estimate over the least, geometric mean",
                geometric_mean(choices.iter().map(|row| row.over.measured())),
            )
            .and(Findings::of(&self.rows, &[]))
            .note(format!(
                "{0} × {0} pixels, passes of {PHOTONS} photons; a choice for a relative RMSE of {ERROR}, which takes so long that pilots of all estimates are worth their time, of which they get {PILOT_SECONDS} s. {TURNS} pictures of {SECONDS} s by \
                 each estimate in turns, beside a reference by the path tracer of {1} samples a pixel, whose variance is subtracted.",
                FULL.0, FULL.1,
            ))
    }
}

/// Of each scene the choice beside what errs least.
fn choices(rows: &[Row]) -> Vec<Choice> {
    let of_scene = |rows: &[Row]| {
        let error = |row: &&Row| row.error.measured().value;
        let best = rows.iter().min_by(|a, b| error(a).total_cmp(&error(b)))?;
        let chosen = rows.iter().find(|row| row.is_chosen)?;
        Some(Choice {
            scene: best.scene.clone(),
            chosen: chosen.estimate.clone(),
            best: best.estimate.clone(),
            over: chosen.error.over(&best.error),
        })
    };
    rows.chunk_by(|a, b| a.scene == b.scene).filter_map(of_scene).collect()
}

/// The choice on a scene, and pictures by all that could be chosen.
fn rows_of(context: &Context<'_>, gpu: &Gpu, address: &str) -> Result<Vec<Row>> {
    let (side, spp) = context.pick(FULL, SMOKE);
    let renderer = Renderer::new(gpu, &scene::load(address)?)?;
    let base = RenderOptions {
        size: [side; 2],
        ..RenderOptions::default()
    };
    let of_reference = RenderOptions {
        technique: Some("path".into()),
        spp,
        seed: SEED,
        settings: json!({ "path_set": PATHS, "sampler": "pcg" }).into(),
        ..base.clone()
    };
    let Some(reference) = render(&renderer, &of_reference, context.watch)? else {
        return Ok(Vec::new());
    };
    let photons = context.pick(PHOTONS, SMOKE_PHOTONS);
    let asked = RenderOptions {
        technique: Some("photon".into()),
        settings: json!({ "path_set": PATHS, "photons": photons }).into(),
        ..base.clone()
    };
    let goal = Goal {
        error: Some(ERROR),
        time: None,
    };
    let begun = Instant::now();
    // A smoke run tries the first alone.
    let plan = plan(&renderer, &asked, goal, &mut || {
        !context.smoke && !context.watch.stopped() && begun.elapsed().as_secs_f64() < PILOT_SECONDS
    })?;
    let estimates = context.pick(plan.candidates.len(), SMOKE_ESTIMATES.min(plan.candidates.len()));
    let mut seed = 0;
    let turns = context.in_turns(TURNS, estimates, |i| {
        seed += 1;
        let candidate = &plan.candidates[i];
        let options = RenderOptions {
            technique: Some(candidate.technique.into()),
            settings: candidate.settings.clone().into(),
            seed,
            spp: context.pick(SPP_MAX, SMOKE_SPP),
            time_budget: context.pick(Some(Duration::from_secs_f64(SECONDS)), None),
            ..base.clone()
        };
        let Some(rendered) = render(&renderer, &options, context.watch)? else {
            return Ok(f64::NAN);
        };
        let found = unbiased::measure(&rendered.picture, &reference.picture)?;
        Ok(unbiased::relative_rmse(&found))
    })?;
    let of_candidates = plan.candidates.iter().zip(turns).enumerate();
    let row = |(i, (candidate, errors)): (usize, (&clerestory::plan::Candidate, Vec<f64>))| Row {
        scene: short_name(address).into(),
        estimate: candidate.variant.into(),
        is_chosen: i == plan.chosen,
        predicted: Some(candidate.seconds).filter(|seconds| seconds.is_finite()),
        error: Repeats(errors),
        reason: candidate.reason.clone(),
    };
    Ok(of_candidates.map(row).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_choice_is_held_against_the_least_error() {
        let row = |scene: &str, estimate: &str, is_chosen: bool, error: f64| Row {
            scene: scene.into(),
            estimate: estimate.into(),
            is_chosen,
            error: Repeats(vec![error; 5]),
            ..Row::default()
        };
        let rows = [
            row("thin", "defaults", false, 0.4),
            row("thin", "photon beams", true, 0.1),
            row("dense", "defaults", false, 0.1),
            row("dense", "photon beams", true, 0.25),
        ];
        let choices = choices(&rows);
        let found: Vec<(&str, f64)> = choices
            .iter()
            .map(|row| (row.best.as_str(), row.over.measured().value))
            .collect();
        assert_eq!(found, [("photon beams", 1.0), ("defaults", 2.5)]);
        assert!(super::choices(&rows[2..3]).is_empty());
    }
}
