//! How far pilots go: further rounds of what can still be chosen, as long as they cost little beside the picture itself.

use std::time::Instant;

use super::Goal;
use super::judgement::{judgements, reference_trial};
use super::trial::{Asked, ROUNDS, Trial};
use crate::Result;
use crate::techniques::Bias;

/// Share of the predicted time that pilots may take.
pub const PILOT_SHARE: f64 = 0.15;
/// Beyond the relative MSE of what has met light.
const UNLIT_COST: f64 = f64::MAX;
/// Beyond every other cost: of what cannot be chosen.
const IMPOSSIBLE_COST: f64 = f64::INFINITY;
/// Seconds of rounds that pilots may take whatever the picture costs, where no time is to be kept.
const FREE_SECONDS: f64 = 2.0;
/// A candidate whose predicted cost is beyond this many times the best one's gets no further round.
const HOPELESS: f64 = 2.0;

/// Further rounds for what can still be chosen, and for what that is held against, as long as they cost little beside the picture itself. Every trial is
/// judged in the end.
pub fn run_rounds(
    trials: &mut [Option<Trial<'_>>],
    asked: &Asked<'_>,
    start: Instant,
    proceed: &mut dyn FnMut() -> bool,
) -> Result<()> {
    let goal = asked.goal;
    for (&last, &spp) in ROUNDS.iter().zip(&ROUNDS[1..]) {
        update_judgements(trials, goal)?;
        let spent = start.elapsed().as_secs_f64();
        let predicted = |trial: &Trial<'_>| trial.cost.seconds(f64::from(trial.samples(goal, spent)));
        // Under a time alone all take equally long, and the one with the smaller error is the better one.
        let cost = |trial: &Trial<'_>| match goal.error {
            _ if !trial.is_possible(goal) => IMPOSSIBLE_COST,
            Some(_) => predicted(trial),
            // What has met no light is the last choice, but goes on as long as nothing else has.
            None if trial.lit => trial.relative_mse(trial.samples(goal, spent)),
            None => UNLIT_COST,
        };
        let able = || trials.iter().flatten().filter(|trial| trial.can_be_chosen());
        let best = able().map(&cost).fold(f64::INFINITY, f64::min);
        let picture = able().map(predicted).fold(f64::INFINITY, f64::min);
        let rounds: f64 = trials.iter().flatten().map(|trial| trial.all_seconds).sum();
        let share = PILOT_SHARE * (picture + spent);
        let allowed = match goal.time {
            Some(_) => share - spent,
            None => share.max(FREE_SECONDS) - rounds,
        };
        let blind = goal.time.is_none() && trials.iter().flatten().all(|trial| !trial.lit);
        // All that can still be chosen, or else the best alone; and what they are held against.
        let affordable = [HOPELESS, 1.0].into_iter().find_map(|factor| {
            let mut on: Vec<bool> = trials
                .iter()
                .map(|trial| {
                    trial
                        .as_ref()
                        .is_some_and(|t| t.spp == last && t.failure.is_empty() && cost(t) <= factor * best)
                })
                .collect();
            let judged = trials
                .iter()
                .zip(&on)
                .any(|(trial, on)| *on && trial.as_ref().is_some_and(|t| t.card.bias != Bias::Unbiased));
            let reference = reference_trial(trials);
            for (trial, on) in trials.iter().zip(&mut on) {
                if let (Some(trial), Some(reference)) = (trial, reference)
                    && std::ptr::eq(trial, reference)
                {
                    *on |= judged && trial.spp == last && trial.failure.is_empty() && trial.misses.is_empty();
                }
            }
            // A round has four times the samples of all before it.
            let next: f64 = trials
                .iter()
                .zip(&on)
                .filter(|(_, on)| **on)
                .filter_map(|(trial, _)| trial.as_ref())
                .map(|t| t.round_seconds * 4.0)
                .sum();
            (next <= allowed || blind).then_some(on)
        });
        let Some(going_on) = affordable else { return Ok(()) };
        for (trial, on) in trials.iter_mut().zip(going_on) {
            if let Some(trial) = trial.as_mut().filter(|_| on) {
                if !proceed() {
                    return update_judgements(trials, goal);
                }
                trial.go_on(spp, asked.pixels())?;
            }
        }
    }
    update_judgements(trials, goal)
}

fn update_judgements(trials: &mut [Option<Trial<'_>>], goal: Goal) -> Result<()> {
    let judgements = judgements(trials, goal.error)?;
    for (trial, judgement) in trials.iter_mut().zip(judgements) {
        if let Some(trial) = trial {
            trial.error.set_unseen(judgement.unseen);
            trial.judgement = judgement;
        }
    }
    Ok(())
}
