//! Floor 8: automatic choice. Which technique, with which settings and how many samples, meets an asked error or time.
//!
//! Nothing is known beforehand: each candidate renders small pilot pictures of the view at hand, twice with independent seeds, in rounds that have no
//! seed in common. Their difference gives its noise ([`relative_mse_of_pair`]), their time its cost, and two or more numbers of samples the slope of
//! its noise ([`ErrorModel`]). Rounds decide how far pilots go and what is chosen. The prediction is by a last pair of pilots of the chosen one, which
//! nothing was decided by: the lowest of several errors is lower than what comes, and so is one at which rounds end. A technique that cannot model the
//! scene, that the device cannot run, or whose pictures hold other light paths than those asked for is never chosen, and [`Plan::candidates`] says why.
//!
//! Bias is judged as well ([`Candidate::judged_by`] says by what). Both pilots of a technique against two of the reference, an unbiased technique, of
//! other seeds, give the square of its bias without the noise of either ([`relative_bias_of_pairs`]):
//!
//! - of a **biased** technique it stays as it is, and one that may exceed the error asked for is refused with that figure;
//! - of a **consistent** one it falls as a power of its samples, which two numbers of samples measure ([`BiasModel`]), or its card's
//!   [`Law`](crate::techniques::Law) says where they do not. Where the reference's noise hides it, or where the reference misses paths, the technique is
//!   judged by how far its own pictures still move ([`relative_drift_of_pairs`]), if its settings let them;
//! - an **unbiased** one may miss some paths of a scene, as its card's [`Foresight`](crate::techniques::Foresight) says: the path tracer never finds what lights
//!   without area give by way of mirrors and smooth glass. It is then held against a consistent technique as if biased, and where there is none,
//!   it comes last, and [`Candidate::misses`] and [`Plan::shortfall`] name the lights.
//!
//! The predicted error is √(bias² + noise²), with an interval for 9 of 10 pictures ([`Candidate::error_interval`]). Pilots take one first round of each
//! candidate with the compilation of its kernels, and then one second, or a quarter of all time where that is expected to be above five or nearly, by the
//! least that the picture may take for all that is known, and a last pair of at least a sixteenth of the picture's samples, up to 16; where that pair says
//! that the picture takes far longer, a longer one follows. First rounds of further settings of a technique are left out where they would exceed their
//! part of a quarter of all time, or of five seconds where that is more; those of
//! further techniques only where a time is to be kept. [`Plan::pilot_share`] says what share they took. What they find is the same in every run for as
//! many rounds; how many there are, and what is predicted to be faster, is the clock's.
//!
//! Adaptive samples are taken where the settings ask for them: pilots have them too, so that noise and cost are those of such pictures. Rounds with fewer samples
//! than the law of their error holds from ([`Law`](crate::techniques::Law)) tell it only where there are no others; the last pair has as many as that where rounds had,
//! unless the picture has fewer. Techniques without such a setting are refused by name then.
//!
//! Predictions are estimates: a pilot does not see what is rarer than its samples (a caustic of one path in a million), nor how a picture of more pixels
//! differs from a small one, and times are those of a machine that does nothing else. The interval does not know of these either.

mod bias;
mod candidates;
mod judgement;
mod model;
mod noise;
mod paths;
mod rounds;
mod tiles;
mod trial;
mod verdict;

use std::cell::{Cell, RefCell};
use std::time::{Duration, Instant};

use serde_json::Value;

pub use bias::{BiasEstimate, relative_bias_of_pairs, relative_drift_of_pairs};
pub use model::{BiasModel, CostModel, ErrorModel};
pub use noise::{relative_mse_by_variance, relative_mse_of_pair};

use crate::catalogue::{Role, Row};
use crate::render::{RenderOptions, Renderer};
use crate::techniques::{self, Bias, Card};
use crate::transport::PathSet;
use crate::{Error, Result};
use candidates::{candidates, lacks_adaptive, merged};
use judgement::reference_trial;
use rounds::{PILOT_SHARE, is_late, run_last_pair, run_rounds, seconds_of_rounds};
use trial::{Asked, Trial};
use verdict::{score, shortfall};

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Goal {
    /// Root of the relative MSE to reach (0.02 is 2 %), with the metric's usual offset: the same in every unit of radiance.
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
    /// Why it cannot be chosen, tried or not, or, where its bias exceeds the error asked for, comes behind all that reach it; empty for the others.
    pub reason: String,
    /// What of the light paths asked for it does not find, in words; empty where it finds all.
    pub misses: String,
    /// Samples per pixel of its last round of pilots, 0 without.
    pub pilot_spp: u32,
    /// Samples per pixel of the last pair of pilots, which says how large the error is and nothing was decided by; 0 without, where the prediction is by
    /// rounds and rather too low.
    pub last_pilot_spp: u32,
    /// Root of the relative MSE of those by noise alone.
    pub pilot_noise: f64,
    /// Whether its pilots have met any light. Without it `error` is that of a black picture: nothing is known.
    pub lit: bool,
    /// The noise falls as samples^(−slope/2).
    pub slope: f64,
    /// Predicted seconds for each sample per pixel of the whole picture.
    pub seconds_a_sample: f64,
    /// Samples per pixel that it would take.
    pub spp: u32,
    /// Predicted root of the relative MSE by noise alone.
    pub noise: f64,
    /// Predicted root of the relative squared bias; `None` where nothing is known of it.
    pub bias: Option<f64>,
    /// What that is at most by the noise of the pilots, but for one case in 40, if it falls by the law in `judged_by`. How well the law is known does not
    /// count: where kernels' edges err more than what they blur, it falls more slowly than the law of blur, which is taken where pilots show none.
    pub bias_at_most: Option<f64>,
    /// What the bias was found by, and the law by which it falls; empty for what has none.
    pub judged_by: String,
    /// Predicted root of the relative MSE: √(bias² + noise²).
    pub error: f64,
    /// What a picture's error lies between in 9 of 10 cases, by how well the pilots know noise, slope and bias and by the picture's own spread; `None`
    /// where nothing is known.
    pub error_interval: Option<[f64; 2]>,
    /// Predicted seconds of rendering, without the pilots.
    pub seconds: f64,
}

/// The reference: pilots of an unbiased technique that others were held against.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct Reference {
    /// Technique id.
    pub technique: &'static str,
    /// Samples per pixel.
    pub pilot_spp: u32,
    /// Root of the relative MSE of each by noise.
    pub pilot_noise: f64,
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
    /// What others were held against; `None` where there was nothing.
    pub reference: Option<Reference>,
    /// Seconds that the pilots took, with the compilation of their kernels.
    pub pilot_seconds: f64,
    /// Their share of the whole predicted time.
    pub pilot_share: f64,
    /// The share that pilots after the first round are kept to where a time is to be kept and where picture and pilots take more than five seconds.
    pub pilot_share_limit: f64,
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

/// Renders pilots and chooses among the engine's techniques. `options` is the picture as asked for: view, size, seed, and what of technique and
/// settings is not free; its samples are not looked at. `proceed` is called between pieces of work; when it says no, pilots end and the choice
/// is made among what is known. A scene whose first pilot has not ended half a second later, or in half of the time that the goal gives, is refused, and so is one
/// whose first round is that late after a no in the middle of it.
///
/// # Errors
/// [`Error::Setting`] for a goal that is none; [`Error::Unsupported`] when no technique can render the scene as asked, with every
/// reason, limits of the device and its memory included; otherwise as [`Renderer::start`] and [`Rendering::step`](crate::render::Rendering::step).
pub fn plan(
    renderer: &Renderer,
    options: &RenderOptions,
    goal: Goal,
    proceed: &mut dyn FnMut() -> bool,
) -> Result<Plan> {
    let cards: Vec<&Card> = match &options.technique {
        Some(id) => vec![techniques::by_id(id)?],
        None => techniques::all().iter().collect(),
    };
    plan_among(renderer, &cards, options, goal, proceed)
}

/// As [`plan`](fn@plan), among cards that may be the host's own, whatever technique the options name. The picture of one is begun with
/// [`Renderer::start_technique`] and [`Plan::options`].
///
/// # Errors
/// As [`plan`](fn@plan).
pub fn plan_among(
    renderer: &Renderer,
    cards: &[&Card],
    options: &RenderOptions,
    goal: Goal,
    proceed: &mut dyn FnMut() -> bool,
) -> Result<Plan> {
    let start = Instant::now();
    check(goal)?;
    let fixed = options.settings.to_json();
    let patience = trial::patience(proceed());
    let proceed: &mut dyn FnMut() -> bool = &mut || proceed();
    let asked = Asked {
        renderer,
        options,
        paths: wanted_path_set(&fixed)?,
        goal,
        proceed: RefCell::new(proceed),
        gave_up: Cell::new(false),
        patience,
    };
    let profile = renderer.gpu_scene().profile();
    let found = candidates(cards, &fixed, profile);
    let (cards, mut candidates): (Vec<&Card>, Vec<Candidate>) = found.into_iter().unzip();
    let mut trials: Vec<Option<Trial<'_>>> = Vec::new();
    for (index, (candidate, card)) in candidates.iter_mut().zip(&cards).enumerate() {
        let tried = trials.iter().any(Option::is_some);
        // Settings can be left out, techniques only where a time is to be kept.
        let can_wait = goal.time.is_some() || trials.iter().flatten().any(|trial| trial.card.id == card.id);
        let late = can_wait && is_late(&trials, goal, start.elapsed().as_secs_f64());
        let trial = if let Some(reason) = lacks_adaptive(card, &fixed) {
            candidate.reason = reason;
            None
        } else if asked.gave_up.get() || (tried && (late || !asked.proceeds())) {
            candidate.reason = "there was no time to try it".into();
            None
        } else {
            Trial::start(&asked, card, candidate, index)?
        };
        trials.push(trial);
    }
    if trials.iter().all(Option::is_none) {
        return Err(none_can(&candidates));
    }
    // What is biased is held against something.
    let is_unbiased = |trial: &Trial<'_>| trial.card.bias == Bias::Unbiased;
    if !trials.iter().flatten().any(is_unbiased) {
        for card in techniques::all().iter().filter(|card| card.bias == Bias::Unbiased) {
            let mut candidate = Candidate::of(card, "reference", merged(serde_json::json!({}), &fixed, card));
            if let Some(trial) = Trial::start_reference(&asked, card, &mut candidate, candidates.len())? {
                trials.push(Some(trial));
                break;
            }
        }
    }
    run_rounds(&mut trials, &asked, start, &mut || asked.proceeds())?;
    let chosen = loop {
        let chosen = best(&mut candidates, &trials, &asked, start)?;
        if asked.proceeds() {
            let rounds = seconds_of_rounds(&trials);
            if let Some(trial) = &mut trials[chosen] {
                run_last_pair(trial, &asked, start, rounds)?;
            }
        }
        // One whose last pair fails is out.
        if let Some(trial) = trials[chosen].as_ref().filter(|trial| trial.can_be_chosen()) {
            trial.predict(&mut candidates[chosen], &asked, start.elapsed().as_secs_f64());
            break chosen;
        }
    };
    let pilot_seconds = start.elapsed().as_secs_f64();
    let shortfall = shortfall(&candidates[chosen], goal, pilot_seconds);
    Ok(Plan {
        goal,
        chosen,
        reference: reference_trial(&trials).map(Trial::as_reference),
        pilot_seconds,
        pilot_share: pilot_seconds / (pilot_seconds + candidates[chosen].seconds),
        pilot_share_limit: PILOT_SHARE,
        shortfall,
        candidates,
    })
}

/// Writes what rounds have found to the candidates, and returns the best one that can be chosen.
fn best(
    candidates: &mut [Candidate],
    trials: &[Option<Trial<'_>>],
    asked: &Asked<'_>,
    start: Instant,
) -> Result<usize> {
    let spent = start.elapsed().as_secs_f64();
    // A reference that is not a candidate stands at the end, beyond all of them.
    for (candidate, trial) in candidates.iter_mut().zip(trials) {
        if let Some(trial) = trial {
            trial.predict(candidate, asked, spent);
        }
    }
    let score = |index: &usize| score(&candidates[*index], asked.goal);
    let able = |index: &usize| trials[*index].as_ref().is_some_and(Trial::can_be_chosen);
    let able = (0..candidates.len()).filter(able);
    able.min_by(|a, b| score(a).total_cmp(&score(b)))
        .ok_or_else(|| none_can(candidates))
}

fn none_can(candidates: &[Candidate]) -> Error {
    let reason = |candidate: &Candidate| format!("{}: {}", candidate.technique, candidate.reason);
    Error::Unsupported {
        technique: "automatic choice".into(),
        reasons: candidates.iter().map(reason).collect(),
    }
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

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-PLAN",
    name: "automatic choice of technique, settings and samples by pilot pictures",
    role: Role::Service,
    limits: "Pilots do not see what is rarer than their samples, nor does the interval printed with a prediction; below five seconds they may take \
             longer than the picture; times assume a machine that does nothing else.",
    tests: &[
        "engine/src/plan/noise.rs::pairs_know_their_error",
        "engine/src/plan/noise.rs::a_bright_square_does_not_hide_the_noise_of_dark_pixels",
        "engine/src/plan/noise.rs::bright_dots_are_related_to_their_own_radiance",
        "engine/src/plan/noise.rs::one_pixel_that_the_others_have_missed_is_not_all_of_the_error",
        "engine/src/plan/noise.rs::pairs_of_one_view_keep_the_ratio_of_their_errors",
        "engine/src/plan/model.rs::models_return_what_they_were_fitted_to",
        "engine/src/plan/model.rs::pairs_fit_the_time_that_they_take",
        "engine/src/plan/model.rs::slopes_are_believed_alike_to_either_side_of_the_law",
        "engine/src/plan/model.rs::the_last_pair_alone_says_how_large_the_error_is",
        "engine/src/plan/model.rs::neither_stopping_nor_choosing_makes_predictions_optimistic",
        "engine/src/plan/rounds.rs::the_last_pair_is_under_the_law_of_the_picture",
        "engine/src/plan/rounds.rs::pilots_keep_to_a_quarter_of_what_is_long",
        "engine/src/plan/model.rs::biases_fall_as_they_were_seen_to",
        "engine/src/plan/model.rs::pictures_that_cannot_move_show_no_bias",
        "engine/src/plan/bias.rs::known_biases_are_recovered",
        "engine/src/plan/bias.rs::noise_is_seldom_taken_for_bias",
        "engine/src/plan/bias.rs::drifts_are_told_from_noise_that_both_stages_share",
        "engine/src/techniques/path/unseen.rs::caustics_of_lights_without_area_are_said_to_be_missed",
        "engine/src/plan/verdict.rs::what_cannot_be_had_is_said",
        "tests/tests/paths/automatic_choice.rs::predictions_come_true",
        "tests/tests/paths/automatic_choice.rs::pictures_have_the_error_that_was_predicted",
        "tests/tests/paths/automatic_choice.rs::adaptive_pictures_have_the_error_asked_for",
        "tests/tests/paths/automatic_choice.rs::the_unit_of_radiance_changes_neither_choice_nor_error",
        "tests/tests/paths/automatic_choice.rs::what_cannot_be_chosen_says_why",
        "tests/tests/paths/automatic_choice.rs::what_cannot_be_made_is_no_end_of_the_choice",
        "tests/tests/paths/automatic_choice.rs::frames_too_large_for_the_device_are_no_candidates",
        "tests/tests/paths/automatic_choice.rs::estimates_in_media_are_candidates_where_they_can_be_made",
        "tests/tests/paths/automatic_choice.rs::a_bias_beyond_the_goal_is_refused_with_its_figure",
        "tests/tests/paths/automatic_choice.rs::the_path_tracer_does_not_win_by_what_it_misses",
    ],
    api: &["clerestory::plan::plan", "clerestory::plan::plan_among"],
    settings: &[
        "clerestory::plan::Goal",
        "clerestory render --error 0.02",
        "clerestory render --time 20s",
    ],
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
}
