//! Automatic choice: which technique, with which settings and how many samples, meets an asked error or time.
//!
//! Nothing is known beforehand: each candidate renders small pilot pictures of the view at hand, twice with independent seeds. Their
//! difference gives its error ([`relative_mse_of_pair`]), their time its cost, and two or more numbers of samples the slope of its
//! error ([`ErrorModel`]). A technique that cannot model the scene, that the device cannot run, or whose pictures hold other light paths
//! than those asked for is never chosen, and [`Plan::candidates`] says why.
//!
//! Predictions are estimates: a pilot does not see what is rarer than its samples (a caustic of one path in a million), and times are
//! those of a machine that does nothing else.

mod model;
mod noise;

use std::time::{Duration, Instant};

use serde_json::Value;

pub use model::{CostModel, ErrorModel};
pub use noise::{relative_mse_by_variance, relative_mse_of_pair};

use crate::film::metrics::RELATIVE_MSE_OFFSET;
use crate::render::{RenderOptions, Renderer, Rendering};
use crate::techniques::{self, Bias, TechniqueInfo};
use crate::transport::PathSet;
use crate::{Error, Result};

/// Most pixels of a pilot picture.
const PILOT_PIXELS: f64 = 16_384.0;
/// Shortest side of a pilot picture, pixels, where the picture itself has as many.
const PILOT_SIDE: u32 = 8;
/// Samples a pixel of the pilots, one round after the other.
const ROUNDS: [u32; 4] = [4, 16, 64, 256];
/// Share of the predicted time that pilots may take.
const PILOT_SHARE: f64 = 0.15;
/// A candidate whose predicted cost is beyond this many times the best one's gets no further round.
const HOPELESS: f64 = 2.0;
/// Distance of the pilots' seeds from the picture's and from each other.
const SEED_STEP: u32 = 0x9E37_79B9;

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Goal {
    /// Root of the relative MSE to reach (0.02 is 2 %), with the metric's usual offset.
    pub error: Option<f64>,
    /// Wall-clock time to keep, the pilots' included.
    pub time: Option<Duration>,
}

/// What became of a technique with its settings.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Candidate {
    /// Technique id.
    pub technique: &'static str,
    /// What distinguishes its settings.
    pub variant: &'static str,
    /// Settings as JSON.
    pub settings: Value,
    /// Why it was not tried, or not to the end; empty for those that were.
    pub reason: String,
    /// Samples a pixel of its last pilots, 0 without.
    pub pilot_spp: u32,
    /// Root of the relative MSE of those.
    pub pilot_error: f64,
    /// The error falls as samples^(−slope/2).
    pub slope: f64,
    /// Predicted seconds for each sample a pixel of the whole picture.
    pub seconds_a_sample: f64,
    /// Samples a pixel that it would take.
    pub spp: u32,
    /// Predicted root of the relative MSE.
    pub error: f64,
    /// Predicted seconds of rendering, without the pilots.
    pub seconds: f64,
}

/// The choice, its prediction, and all that was looked at.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Plan {
    /// What was asked for.
    pub goal: Goal,
    /// Index of the chosen one.
    pub chosen: usize,
    /// Everything that could have been chosen, and why it could not.
    pub candidates: Vec<Candidate>,
    /// Seconds that the pilots took, with the compilation of their kernels.
    pub pilot_seconds: f64,
    /// Why the goal cannot be met; empty when it can.
    pub shortfall: String,
}

impl Plan {
    /// The chosen technique.
    pub fn choice(&self) -> &Candidate {
        &self.candidates[self.chosen]
    }

    /// The options of the picture itself: technique, settings and samples as chosen, and the time that is left.
    pub fn options(&self, base: &RenderOptions) -> RenderOptions {
        let choice = self.choice();
        let left = |time: Duration| time.saturating_sub(Duration::from_secs_f64(self.pilot_seconds));
        RenderOptions {
            technique: Some(choice.technique.into()),
            settings: choice.settings.clone(),
            spp: choice.spp,
            time_budget: self.goal.time.map(left).or(base.time_budget),
            ..base.clone()
        }
    }
}

/// A candidate with its pilots.
struct Trial {
    pilots: [Rendering; 2],
    error: ErrorModel,
    cost: CostModel,
    spp: u32,
    /// Seconds of its last round.
    round_seconds: f64,
}

/// Renders pilots and chooses. `options` is the picture as asked for: view, size, seed, and what of technique and settings is not free;
/// its samples are not looked at. `proceed` is called between pieces of work; when it says no, pilots end and the choice is made
/// among what is known.
///
/// # Errors
/// [`Error::Setting`] for a goal that is none; [`Error::Unsupported`] when no technique can render the scene as asked, with every
/// reason; otherwise as [`Renderer::start`] and [`Rendering::step`].
pub fn plan(
    renderer: &Renderer,
    options: &RenderOptions,
    goal: Goal,
    proceed: &mut dyn FnMut() -> bool,
) -> Result<Plan> {
    let start = Instant::now();
    check(goal)?;
    let wanted = wanted_path_set(&options.settings)?;
    let mut candidates = candidates(options)?;
    let mut trials: Vec<Option<Trial>> = Vec::new();
    let pixels = f64::from(options.size[0]) * f64::from(options.size[1]);
    for candidate in &mut candidates {
        let late = goal
            .time
            .is_some_and(|time| start.elapsed().as_secs_f64() > PILOT_SHARE * time.as_secs_f64());
        let tried = trials.iter().any(Option::is_some);
        let trial = if tried && (late || !proceed()) {
            candidate.reason = "there was no time to try it".into();
            None
        } else {
            Trial::start(renderer, options, candidate, wanted, pixels)?
        };
        trials.push(trial);
    }
    if trials.iter().all(Option::is_none) {
        let reason = |candidate: &Candidate| format!("{}: {}", candidate.technique, candidate.reason);
        return Err(Error::Unsupported {
            technique: "automatic choice".into(),
            reasons: candidates.iter().map(reason).collect(),
        });
    }
    rounds(&mut trials, goal, pixels, start, proceed)?;
    let pilot_seconds = start.elapsed().as_secs_f64();
    for (candidate, trial) in candidates.iter_mut().zip(&trials) {
        if let Some(trial) = trial {
            trial.predict(candidate, goal, pilot_seconds);
        }
    }
    let score = |index: &usize| score(&candidates[*index], goal);
    let tried = (0..candidates.len()).filter(|index| trials[*index].is_some());
    let chosen = tried.min_by(|a, b| score(a).total_cmp(&score(b))).unwrap_or(0);
    let shortfall = shortfall(&candidates[chosen], goal, pilot_seconds);
    Ok(Plan {
        goal,
        chosen,
        candidates,
        pilot_seconds,
        shortfall,
    })
}

fn check(goal: Goal) -> Result<()> {
    if let Some(error) = goal.error
        && !(error.is_finite() && error > 0.0)
    {
        return Err(Error::setting("error", error, "is not above 0"));
    }
    if goal.error.is_none() && goal.time.is_none() {
        return Err(Error::setting("goal", "none", "asks for neither an error nor a time"));
    }
    Ok(())
}

/// The light paths that the settings ask for; all of them where they are silent.
fn wanted_path_set(settings: &Value) -> Result<PathSet> {
    match settings.get("path_set").and_then(Value::as_str) {
        Some(text) => text.parse(),
        None => Ok(PathSet::ALL),
    }
}

/// Every technique with each of its variants. What the options fix is fixed; variants that it makes equal are listed once.
fn candidates(options: &RenderOptions) -> Result<Vec<Candidate>> {
    let infos = match &options.technique {
        Some(id) => vec![techniques::by_id(id)?],
        None => techniques::all().iter().collect(),
    };
    let mut found: Vec<Candidate> = Vec::new();
    for info in infos {
        for variant in info.variants {
            let mut settings = (variant.settings)();
            merge(&mut settings, &options.settings, info);
            if found
                .iter()
                .any(|other| other.technique == info.id && other.settings == settings)
            {
                continue;
            }
            found.push(Candidate {
                technique: info.id,
                variant: variant.name,
                settings,
                reason: String::new(),
                pilot_spp: 0,
                pilot_error: 0.0,
                slope: 0.0,
                seconds_a_sample: 0.0,
                spp: 0,
                error: 0.0,
                seconds: 0.0,
            });
        }
    }
    Ok(found)
}

/// Puts what is fixed over a variant's settings; keys that the technique does not have are none of its business.
fn merge(settings: &mut Value, fixed: &Value, info: &TechniqueInfo) {
    let known = (info.default_settings)();
    if let (Some(settings), Some(fixed)) = (settings.as_object_mut(), fixed.as_object()) {
        for (key, value) in fixed.iter().filter(|(key, _)| known.get(key).is_some()) {
            settings.insert(key.clone(), value.clone());
        }
    }
}

/// The pilots' size: as the picture's, with fewer pixels.
fn pilot_size([width, height]: [u32; 2]) -> [u32; 2] {
    let scale = (PILOT_PIXELS / (f64::from(width) * f64::from(height))).sqrt().min(1.0);
    [width, height].map(|side| ((f64::from(side) * scale) as u32).max(PILOT_SIDE.min(side)))
}

impl Trial {
    /// Begins pilots, and compiles their kernels with a first sample; `None`, with the reason, for what cannot be chosen.
    fn start(
        renderer: &Renderer,
        options: &RenderOptions,
        candidate: &mut Candidate,
        wanted: PathSet,
        pixels: f64,
    ) -> Result<Option<Self>> {
        let info = techniques::by_id(candidate.technique)?;
        if info.bias != Bias::Unbiased {
            candidate.reason = "it is biased, which pilots cannot see".into();
            return Ok(None);
        }
        let size = pilot_size(options.size);
        let begin = |seed_steps: u32| {
            renderer.start(&RenderOptions {
                technique: Some(candidate.technique.into()),
                settings: candidate.settings.clone(),
                size,
                spp: 1,
                seed: options.seed.wrapping_add(seed_steps.wrapping_mul(SEED_STEP)),
                aovs: false,
                time_budget: None,
                camera: options.camera.clone(),
            })
        };
        let mut first = match begin(1) {
            Ok(first) => first,
            Err(error @ (Error::Unsupported { .. } | Error::MissingFeature { .. })) => {
                candidate.reason = error.to_string();
                return Ok(None);
            }
            Err(error) => return Err(error),
        };
        if first.path_set() != wanted {
            candidate.reason = format!("its pictures hold the light paths {:?}", first.path_set().to_string());
            return Ok(None);
        }
        run(&mut first)?;
        // The second one finds its kernels compiled, as the picture itself will.
        let from = Instant::now();
        let mut second = begin(2)?;
        run(&mut second)?;
        let start = from.elapsed().as_secs_f64();
        let mut trial = Self {
            pilots: [first, second],
            error: ErrorModel::default(),
            cost: CostModel { start, sample: 0.0 },
            spp: 1,
            round_seconds: 0.0,
        };
        trial.round(ROUNDS[0], pixels)?;
        Ok(Some(trial))
    }

    /// Refines both pilots to `spp` samples a pixel; `pixels` are those of the picture itself.
    fn round(&mut self, spp: u32, pixels: f64) -> Result<()> {
        let from = Instant::now();
        for pilot in &mut self.pilots {
            pilot.set_spp(spp);
            run(pilot)?;
        }
        self.round_seconds = from.elapsed().as_secs_f64();
        let [width, height] = self.pilots[0].size();
        let samples = f64::from(width) * f64::from(height) * f64::from(spp - self.spp) * 2.0;
        self.cost.sample = self.round_seconds / samples * pixels;
        let [a, b] = &mut self.pilots;
        let error = relative_mse_of_pair(&a.picture()?, &b.picture()?, RELATIVE_MSE_OFFSET)?;
        self.error.add(spp, error);
        self.spp = spp;
        Ok(())
    }

    /// Samples a pixel for the goal, when the pilots have taken `spent` seconds.
    fn samples(&self, goal: Goal, spent: f64) -> u32 {
        let for_error = goal.error.map(|error| self.error.samples(error * error));
        let left = |time: Duration| self.cost.samples(time.as_secs_f64() - spent).max(1);
        match (for_error, goal.time.map(left)) {
            (Some(by_error), Some(by_time)) => by_error.min(by_time),
            (by_error, by_time) => by_error.or(by_time).unwrap_or(1),
        }
    }

    fn predict(&self, candidate: &mut Candidate, goal: Goal, spent: f64) {
        candidate.pilot_spp = self.spp;
        candidate.pilot_error = self.error.relative_mse(f64::from(self.spp)).sqrt();
        candidate.slope = self.error.slope();
        candidate.seconds_a_sample = self.cost.sample;
        candidate.spp = self.samples(goal, spent);
        candidate.error = self.error.relative_mse(f64::from(candidate.spp)).sqrt();
        candidate.seconds = self.cost.seconds(f64::from(candidate.spp));
    }
}

/// Works until all samples that were asked for are there.
fn run(rendering: &mut Rendering) -> Result<()> {
    while rendering.step()?.is_some() {}
    Ok(())
}

/// Further rounds for what can still be chosen, as long as they cost little beside the picture itself.
fn rounds(
    trials: &mut [Option<Trial>],
    goal: Goal,
    pixels: f64,
    start: Instant,
    proceed: &mut dyn FnMut() -> bool,
) -> Result<()> {
    for (&last, &spp) in ROUNDS.iter().zip(&ROUNDS[1..]) {
        let spent = start.elapsed().as_secs_f64();
        let predicted = |trial: &Trial| trial.cost.seconds(f64::from(trial.samples(goal, spent)));
        // Under a time alone all take equally long, and the one with the smaller error is the better one.
        let cost = |trial: &Trial| match goal.error {
            Some(_) => predicted(trial),
            None => trial.error.relative_mse(f64::from(trial.samples(goal, spent))),
        };
        let best = trials.iter().flatten().map(&cost).fold(f64::INFINITY, f64::min);
        let picture = trials.iter().flatten().map(predicted).fold(f64::INFINITY, f64::min);
        let going_on: Vec<bool> = trials
            .iter()
            .map(|trial| {
                trial
                    .as_ref()
                    .is_some_and(|t| t.spp == last && cost(t) <= HOPELESS * best)
            })
            .collect();
        // A round has four times the samples of all before it.
        let next: f64 = trials
            .iter()
            .zip(&going_on)
            .filter_map(|(trial, on)| trial.as_ref().filter(|_| *on).map(|t| t.round_seconds * 4.0))
            .sum();
        if spent + next > PILOT_SHARE * (picture + spent) {
            return Ok(());
        }
        for (trial, on) in trials.iter_mut().zip(going_on) {
            if let Some(trial) = trial.as_mut().filter(|_| on) {
                if !proceed() {
                    return Ok(());
                }
                trial.round(spp, pixels)?;
            }
        }
    }
    Ok(())
}

/// Smaller is better: seconds where an error is to be reached, the error where only the time counts.
fn score(candidate: &Candidate, goal: Goal) -> f64 {
    let late = |time: Duration| candidate.seconds > time.as_secs_f64();
    match goal.error {
        // What misses the error because of the time is judged by how far.
        Some(wanted) if goal.time.is_some_and(late) || candidate.error > wanted * 1.001 => 1e12 * candidate.error,
        Some(_) => candidate.seconds,
        None => candidate.error,
    }
}

/// Why the choice does not meet the goal.
fn shortfall(choice: &Candidate, goal: Goal, pilot_seconds: f64) -> String {
    let all = choice.seconds + pilot_seconds;
    if let Some(time) = goal.time.map(|time| time.as_secs_f64())
        && all > time * 1.001
    {
        return format!("{time:.3} s are too short: one sample a pixel and the pilots take about {all:.3} s");
    }
    match (goal.error, goal.time) {
        (Some(error), Some(time)) if choice.error > error * 1.001 => format!(
            "an error of {error} takes longer than {:.3} s; {:.4} can be had in that time",
            time.as_secs_f64(),
            choice.error
        ),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goals_are_checked() {
        let goal = |error| Goal { error, time: None };
        assert!(check(goal(None)).is_err() && check(goal(Some(0.0))).is_err() && check(goal(Some(f64::NAN))).is_err());
        assert!(check(goal(Some(0.02))).is_ok());
    }

    #[test]
    fn fixed_settings_leave_fewer_candidates() {
        let free = candidates(&RenderOptions::default()).unwrap();
        assert!(free.len() > 1, "{free:?}");
        let options = RenderOptions {
            settings: serde_json::json!({ "sampler": "pcg", "path_set": "direct" }),
            ..RenderOptions::default()
        };
        let fixed = candidates(&options).unwrap();
        assert!(fixed.len() < free.len(), "{fixed:?}");
        for candidate in fixed {
            assert_eq!(candidate.settings["sampler"], "pcg");
            assert_eq!(candidate.settings["path_set"], "direct");
        }
        let unknown = RenderOptions {
            technique: Some("none".into()),
            ..RenderOptions::default()
        };
        assert!(candidates(&unknown).is_err());
    }

    #[test]
    fn pilots_keep_the_aspect_and_are_no_larger_than_the_picture() {
        assert_eq!(pilot_size([512, 512]), [128, 128]);
        assert_eq!(pilot_size([1280, 720]), [170, 96]);
        assert_eq!(pilot_size([40, 30]), [40, 30]);
        assert_eq!(pilot_size([65_535, 1]), [32_767, 1]);
    }

    #[test]
    fn what_cannot_be_had_is_said() {
        let mut choice = Candidate {
            technique: "path",
            variant: "default",
            settings: Value::Null,
            reason: String::new(),
            pilot_spp: 4,
            pilot_error: 0.5,
            slope: 1.0,
            seconds_a_sample: 0.1,
            spp: 10,
            error: 0.3,
            seconds: 1.0,
        };
        let goal = |error, seconds: Option<f64>| Goal {
            error,
            time: seconds.map(Duration::from_secs_f64),
        };
        assert!(shortfall(&choice, goal(Some(0.3), None), 0.5).is_empty());
        assert!(shortfall(&choice, goal(None, Some(1.5)), 0.5).is_empty());
        assert!(shortfall(&choice, goal(None, Some(1.2)), 0.5).contains("too short"));
        assert!(shortfall(&choice, goal(Some(0.1), Some(2.0)), 0.5).contains("0.3"));
        let goal = goal(Some(0.1), Some(2.0));
        let far = score(&choice, goal);
        choice.error = 0.09;
        assert!(score(&choice, goal) < far);
    }
}
