//! Automatic choice: is the error of the picture the one that was asked for?
//!
//! Oracle: a reference with many independent samples, whose own variance is subtracted.

use std::time::{Duration, Instant};

use clerestory::plan::{Goal, plan};
use clerestory::render::{RenderOptions, Rendered, Renderer};
use clerestory::{Result, scene};

use crate::experiments::measures::Context;
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
            address.trim_start_matches("builtin:").into(),
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
    Ok(vec![table])
}
