//! Automatic choice of a technique: is it the one that wins?
//!
//! Oracle: a reference with many independent samples, whose own variance is subtracted. Where the path tracer cannot find all paths, it is photon
//! mapping's, of a seed of its own, more passes and far smaller kernels: a picture by photon mapping must not share its bias with what it is held
//! against, or the other technique alone would bear it.

use std::time::Duration;

use clerestory::gpu::Gpu;
use clerestory::plan::{Goal, plan};
use clerestory::render::{RenderOptions, Rendered, Renderer};
use clerestory::{Error, Result, scene};

use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::reference::short_name;
use crate::experiments::unbiased;
use crate::experiments::watch::render;

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
const BY_PHOTONS: (&str, u32) = (PHOTON, 2048);
const BY_PATHS: (&str, u32) = ("path", 24_576);
const PHOTON: &str = "photon";
/// Radius of the first kernels of a reference by photons over the scene's diagonal: an eighth of the fiftieth that pictures have by default. In each pass
/// they have a 64th of the area, and kernels of more passes are smaller still.
const REFERENCE_RADIUS: f64 = 0.125 / 50.0;

impl Contest {
    /// Which photon mapping is expected to win, beside the path tracer.
    const fn of_all_light(address: &'static str, error: f64, reference: (&'static str, u32)) -> Self {
        Self {
            address,
            path_set: "all",
            side: 48,
            error,
            winner: PHOTON,
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
pub(super) const FACTOR: f64 = 1.5;
/// Far from the seeds of pilots and pictures.
pub(super) const REFERENCE_SEED: u32 = 77_777;
/// The seed of the first picture; each has one of its own.
pub(super) const FIRST_SEED: u32 = 5_000;
/// Pictures of each technique.
const PICTURES: usize = 5;
/// Contests of a smoke run.
const SMOKE_CONTESTS: [Contest; 1] = [Contest::of_direct_light(
    "builtin:cornell-box?source=point",
    8,
    0.3,
    ["preview", "path"],
)];

rows! {
    /// A contest between the chosen technique and another one.
    struct Contested = "Techniques" by [scene, light_paths, asked] {
        scene: String = "scene",
        light_paths: String = "light paths",
        asked: f64 = "asked: error",
        expected: String = "expected",
        chosen: String = "chosen",
        samples: u64 = "samples per pixel",
        bias: Option<f64> = "predicted bias",
        noise: f64 = "predicted noise",
        predicted: f64 = "predicted error",
        error: Repeats = "error",
        predicted_seconds: f64 = "predicted seconds",
        seconds: Repeats = "seconds",
        pilots: f64 = "pilots: seconds",
        other: Option<Repeats> = "other: error in as many seconds",
        other_seconds: Option<Repeats> = "other: seconds",
        why: String = "other: why not",
    }
}

/// What was found.
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    contests: Vec<Contested>,
}

const OF_CONTESTS: &[Criterion<Contested>] = &[
    Criterion::each(
        "the chosen technique has the smaller error: its error over the other's in as many seconds",
        Bound::AtMost(1.0),
        |row: &Contested| (&row.error.over(row.other.as_ref().unwrap_or(&row.error))).into(),
    )
    .among(|row| row.other.is_some()),
    Criterion::each(
        "the other technique has as many seconds: its seconds over the chosen one's",
        Bound::Between(0.75, 1.25),
        |row: &Contested| (&row.other_seconds.as_ref().unwrap_or(&row.seconds).over(&row.seconds)).into(),
    )
    .among(|row| row.other_seconds.is_some())
    .because("a quarter to either side: noise falls as the root of time, which is about an eighth of an error"),
    Criterion::each(
        "the winner is the one that was named beforehand",
        Bound::AtLeast(1.0),
        |row: &Contested| (row.chosen == row.expected).into(),
    ),
    Criterion::each(
        "the chosen technique reaches the error: its error over the one asked for",
        Bound::AtMost(FACTOR),
        |row: &Contested| (&row.error.scaled(1.0 / row.asked)).into(),
    ),
];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let contests: &[Contest] = context.pick(&CONTESTS, &SMOKE_CONTESTS);
        Ok(Self {
            contests: context.each_kept(
                &gpu,
                contests,
                |contest| contest.address.into(),
                |contest| Ok(contest.held(context, &gpu)?.into_iter().collect()),
            )?,
        })
    }

    fn findings(&self) -> Findings {
        let lead = |row: &Contested| Some(row.error.over(row.other.as_ref()?).measured());
        Findings::of(&self.contests, OF_CONTESTS)
            .note(
                "Errors: root of the relative MSE against a reference of a seed of its own, whose variance is subtracted. Seconds are those of the \
                 picture, without the pilots; the other technique gets as many, with settings that its pilots found best.",
            )
            .note(format!(
                "References by photon mapping have {} passes, with kernels of a 64th of the area that a picture's have in the same pass. What \
                 bias is left in them falls in that proportion where light varies smoothly; along the rim of a caustic, where blur is as wide as a \
                 kernel, a quarter of the picture's squared error at most is common to both, and less by the passes that the reference has more.",
                BY_PHOTONS.1
            ))
            .headline(
                "error of the chosen technique over the other's in as many seconds, geometric mean",
                geometric_mean(self.contests.iter().filter_map(lead)),
            )
    }
}

/// Root of the relative MSE, and seconds of the picture.
type ErrorAndSeconds = [f64; 2];

/// Pictures of some options, which take turns, against a reference; `None` when it was stopped.
fn pictures(
    context: &Context<'_>,
    renderer: &Renderer,
    contenders: &[RenderOptions],
    reference: &Rendered,
) -> Result<Option<Vec<Vec<ErrorAndSeconds>>>> {
    let mut seed = FIRST_SEED;
    let all = context.in_turns(PICTURES, contenders.len(), |i| {
        seed += 1;
        let options = RenderOptions {
            seed,
            ..contenders[i].clone()
        };
        let Some(rendered) = render(renderer, &options, context.watch)? else {
            return Ok(None);
        };
        let error = unbiased::measure(&rendered.picture, &reference.picture)?;
        let error = error.relative_mse.max(0.0).sqrt();
        Ok(Some([error, rendered.report.render_seconds]))
    })?;
    Ok(all.into_iter().map(|turns| turns.into_iter().collect()).collect())
}

impl Contest {
    /// Options of the reference.
    fn reference(&self, renderer: &Renderer, base: &RenderOptions) -> RenderOptions {
        let (technique, spp) = self.reference;
        let mut settings = serde_json::json!({ "path_set": self.path_set, "sampler": "pcg" });
        if technique == PHOTON {
            let [lower, upper] = renderer.gpu_scene().bounds();
            settings["radius"] = (REFERENCE_RADIUS * f64::from((upper - lower).length())).into();
        }
        RenderOptions {
            technique: Some(technique.into()),
            spp,
            seed: REFERENCE_SEED,
            settings: settings.into(),
            ..base.clone()
        }
    }

    /// Which technique is chosen, and how far the other one comes in the same time; `None` when it was stopped.
    fn held(&self, context: &Context<'_>, gpu: &Gpu) -> Result<Option<Contested>> {
        let watch = context.watch;
        let renderer = Renderer::new(gpu, &scene::load(self.address)?)?;
        let base = RenderOptions {
            size: [self.side; 2],
            settings: serde_json::json!({ "path_set": self.path_set }).into(),
            ..RenderOptions::default()
        };
        let Some(reference) = render(&renderer, &self.reference(&renderer, &base), watch)? else {
            return Ok(None);
        };
        let goal = Goal {
            error: Some(self.error),
            time: None,
        };
        let plan = plan(&renderer, &base, goal, &mut || !watch.stopped())?;
        let choice = plan.choice();
        let chosen = plan.options(&base);
        // The first one compiles the kernels; the second one's seconds are those that the other technique gets.
        if render(&renderer, &chosen, watch)?.is_none() {
            return Ok(None);
        }
        let Some(warm) = render(&renderer, &chosen, watch)? else {
            return Ok(None);
        };
        let other_id = if choice.technique == self.rival {
            self.winner
        } else {
            self.rival
        };
        let candidate = plan.candidates.iter().find(|candidate| candidate.technique == other_id);
        let other = RenderOptions {
            technique: Some(other_id.into()),
            settings: candidate.map_or_else(|| base.settings.clone(), |other| other.settings.clone().into()),
            spp: u32::MAX,
            time_budget: Some(Duration::from_secs_f64(warm.report.render_seconds)),
            ..base.clone()
        };
        let can_render = match render(&renderer, &other, watch) {
            Ok(Some(_)) => true,
            Ok(None) => return Ok(None),
            Err(Error::Unsupported { .. }) => false,
            Err(error) => return Err(error),
        };
        let contenders = if can_render { vec![chosen, other] } else { vec![chosen] };
        let Some(turns) = pictures(context, &renderer, &contenders, &reference)? else {
            return Ok(None);
        };
        let [error, seconds] = Repeats::by_part(&turns[0]);
        let (other, other_seconds) = match turns.get(1) {
            Some(turns) => {
                let [error, seconds] = Repeats::by_part(turns);
                (Some(error), Some(seconds))
            }
            None => (None, None),
        };
        let why = match candidate {
            Some(other) if !other.reason.is_empty() => other.reason.clone(),
            Some(other) => format!("{:.2} s predicted", other.seconds),
            None => "is not one of the techniques".into(),
        };
        Ok(Some(Contested {
            scene: short_name(self.address).into(),
            light_paths: self.path_set.into(),
            asked: self.error,
            expected: self.winner.into(),
            chosen: choice.technique.into(),
            samples: choice.spp.into(),
            bias: choice.bias,
            noise: choice.noise,
            predicted: choice.error,
            error,
            predicted_seconds: choice.seconds,
            seconds,
            pilots: plan.pilot_seconds,
            other,
            other_seconds,
            why,
        }))
    }
}
