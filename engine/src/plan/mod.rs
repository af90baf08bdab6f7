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
mod pilot;

use std::time::{Duration, Instant};

use serde_json::Value;

pub use model::{CostModel, ErrorModel};
pub use noise::{relative_mse_by_variance, relative_mse_of_pair};

use crate::card::{Role, Row};
use crate::render::{RenderOptions, Renderer};
use crate::techniques::{self, Card};
use crate::transport::PathSet;
use crate::{Error, Result};
use pilot::{PILOT_SHARE, Trial, rounds};

/// Relative difference of two predictions that is none.
const TOLERANCE: f64 = 1e-3;
/// Score of a missed goal, beyond every number of seconds.
const MISSED: f64 = 1e12;

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
#[non_exhaustive]
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
    /// Whether its pilots have met any light. Without it `error` is that of a black picture: nothing is known.
    pub lit: bool,
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
#[non_exhaustive]
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
            settings: choice.settings.clone().into(),
            spp: choice.spp,
            time_budget: self.goal.time.map(left).or(base.time_budget),
            ..base.clone()
        }
    }
}

/// Renders pilots and chooses. `options` is the picture as asked for: view, size, seed, and what of technique and settings is not free;
/// its samples are not looked at. `proceed` is called between pieces of work; when it says no, pilots end and the choice is made
/// among what is known.
///
/// # Errors
/// [`Error::Setting`] for a goal that is none; [`Error::Unsupported`] when no technique can render the scene as asked, with every
/// reason; otherwise as [`Renderer::start`] and [`Rendering::step`](crate::render::Rendering::step).
pub fn plan(
    renderer: &Renderer,
    options: &RenderOptions,
    goal: Goal,
    proceed: &mut dyn FnMut() -> bool,
) -> Result<Plan> {
    let start = Instant::now();
    check(goal)?;
    let wanted = wanted_path_set(&options.settings.to_json())?;
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
    let fixed = options.settings.to_json();
    for info in infos {
        for variant in info.variants {
            let mut settings = (variant.settings)();
            merge(&mut settings, &fixed, info);
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
                lit: false,
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
fn merge(settings: &mut Value, fixed: &Value, info: &Card) {
    if let (Some(settings), Some(fixed)) = (settings.as_object_mut(), fixed.as_object()) {
        for (key, value) in fixed.iter().filter(|(key, _)| info.settings.has(key)) {
            settings.insert(key.clone(), value.clone());
        }
    }
}

/// Smaller is better: seconds where an error is to be reached, the error where only the time counts.
fn score(candidate: &Candidate, goal: Goal) -> f64 {
    let late = |time: Duration| candidate.seconds > time.as_secs_f64();
    match goal.error {
        _ if !candidate.lit => 2.0 * MISSED,
        // What misses the error because of the time is judged by how far.
        Some(wanted) if goal.time.is_some_and(late) || candidate.error > wanted * (1.0 + TOLERANCE) => {
            MISSED * candidate.error
        }
        Some(_) => candidate.seconds,
        None => candidate.error,
    }
}

/// Why the choice does not meet the goal.
fn shortfall(choice: &Candidate, goal: Goal, pilot_seconds: f64) -> String {
    if !choice.lit {
        return "no pilot has met any light: nothing is known of the error".into();
    }
    let all = choice.seconds + pilot_seconds;
    if let Some(time) = goal.time.map(|time| time.as_secs_f64())
        && all > time * (1.0 + TOLERANCE)
    {
        return format!("{time:.3} s are too short: one sample a pixel and the pilots take about {all:.3} s");
    }
    match (goal.error, goal.time) {
        (Some(error), Some(time)) if choice.error > error * (1.0 + TOLERANCE) => format!(
            "an error of {error} takes longer than {:.3} s; {:.4} can be had in that time",
            time.as_secs_f64(),
            choice.error
        ),
        _ => String::new(),
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-PLAN",
    name: "automatic choice of technique, settings and samples by pilot pictures",
    role: Role::Service,
    limits: "A pilot does not see what is rarer than its samples, and times are those of a machine that does nothing else.",
    tests: &[
        "engine/src/plan/noise.rs::pairs_know_their_error",
        "engine/src/plan/model.rs::models_return_what_they_were_fitted_to",
        "engine/src/plan/mod.rs::what_cannot_be_had_is_said",
        "tests/tests/automatic_choice.rs::predictions_come_true",
        "tests/tests/automatic_choice.rs::what_cannot_be_chosen_says_why",
    ],
    experiment: "clerestory report automatic-choice",
    ..Row::of(file!())
}];

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
            settings: serde_json::json!({ "sampler": "pcg", "path_set": "direct" }).into(),
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
    fn what_cannot_be_had_is_said() {
        let mut choice = Candidate {
            technique: "path",
            variant: "default",
            settings: Value::Null,
            reason: String::new(),
            pilot_spp: 4,
            pilot_error: 0.5,
            slope: 1.0,
            lit: true,
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
