//! How far pilots go: further rounds of what can still be chosen, as long as they cost little beside the picture itself, and a last pair of what is
//! chosen.
//!
//! Whoever goes on until an error comes out low, and takes the candidate with the lowest one, finds both too low. So rounds decide, and what is predicted is
//! by a pair that nothing was decided by.

use std::time::Instant;

use super::Goal;
use super::judgement::{judgements, reference_trial};
use super::trial::{Asked, LAST_PAIRS, ROUNDS, Trial};
use crate::Result;
use crate::techniques::Bias;

/// Share of all predicted time that pilots may take where that is longer than [`LONG`].
pub const PILOT_SHARE: f64 = 0.25;
/// Of what pilots may take, what is for rounds; the rest is the last pair's.
const ROUNDS_SHARE: f64 = 0.6;
/// Seconds from which on a picture with its pilots is long.
const LONG: f64 = 5.0;
/// Most samples per pixel of the last pair: with more, the error of the slope outweighs that of the pair, which would only take longer.
const LAST_PAIR: u32 = 4 * ROUNDS[ROUNDS.len() - 1];
/// Samples per pixel that the last pair has where the picture has so many times as many: both of it take an eighth of the picture's time.
const LEAST_LAST_PAIR: u32 = ROUNDS[1];
const PICTURE_OVER_PILOT: u32 = 16;
/// A longer last pair has at least so many times the samples of the one before.
const LONGER: u32 = 4;
/// Beyond the seconds and the squared error of what has met light; [`HOPELESS`] times as much is still a number.
const UNLIT_COST: f64 = f64::MAX / 4.0;
/// Beyond every other cost: of what cannot be chosen.
const IMPOSSIBLE_COST: f64 = f64::INFINITY;
/// Seconds that pilots may take after their beginning beside a picture that is not long, where no time is to be kept: with a short beginning they are
/// within their share of one that turns out to be long, too.
const FREE_SECONDS: f64 = 1.0;
/// Seconds that the beginning of pilots and the picture's own error of prediction are allowed for.
const ALLOWANCE: f64 = 1.0;
/// A candidate whose predicted cost is beyond this many times the best one's gets no further round.
const HOPELESS: f64 = 2.0;

/// Seconds that pilots may still take, of `part` of what they may take in all, beside a picture that takes `expected` seconds, and at least `least`:
/// `spent` seconds have gone by, and `rounds` of them were taken by rounds.
fn room(part: f64, goal: Goal, [least, expected]: [f64; 2], spent: f64, rounds: f64) -> f64 {
    match goal.time {
        Some(time) => part * PILOT_SHARE * time.as_secs_f64() - spent,
        // By the least that the picture may take; with one that makes five seconds of both, pilots are within their share, too.
        None if expected + FREE_SECONDS + ALLOWANCE > LONG => {
            part * (PILOT_SHARE / (1.0 - PILOT_SHARE) * least).max(PILOT_SHARE * LONG) - spent
        }
        None => part * FREE_SECONDS - rounds,
    }
}

/// Whether one more candidate, which takes about as long as each of those before, would take pilots beyond what rounds may take of the picture's time, or of
/// [`LONG`] where that is more; with a time to keep, whether they are beyond it.
pub fn is_late(trials: &[Option<Trial<'_>>], goal: Goal, spent: f64) -> bool {
    if let Some(time) = goal.time {
        return spent > ROUNDS_SHARE * PILOT_SHARE * time.as_secs_f64();
    }
    let least = |trial: &Trial<'_>| trial.picture_seconds(goal, spent)[0];
    let picture = trials.iter().flatten().map(least).fold(f64::INFINITY, f64::min);
    is_beyond(trials.iter().flatten().count(), picture, spent)
}

/// Whether one more candidate after so many is one too many beside a picture that takes at least so many seconds.
fn is_beyond(tried: usize, picture: f64, spent: f64) -> bool {
    let with_another = spent * (1.0 + 1.0 / tried as f64);
    with_another > ROUNDS_SHARE * PILOT_SHARE * (picture + spent).max(LONG)
}

/// Renders the last pair of the chosen one: as many samples as there is time for, and no more than the picture needs. Where it says that the picture takes
/// far longer than it seemed to, a longer one follows. None is rendered where pilots have met no light, or where the time to keep leaves no room.
pub fn run_last_pair(trial: &mut Trial<'_>, asked: &Asked<'_>, start: Instant, rounds: f64) -> Result<()> {
    let rounds_before = rounds - trial.all_seconds;
    for _ in 0..LAST_PAIRS {
        let spent = start.elapsed().as_secs_f64();
        let wanted = trial.samples(asked.goal, spent);
        let picture = trial.picture_seconds(asked.goal, spent);
        let room = room(1.0, asked.goal, picture, spent, rounds_before + trial.all_seconds);
        let fits = trial.pairs.samples(room).min(wanted).min(LAST_PAIR);
        let spp = match trial.last_spp() {
            0 => {
                let least = least_of_last_pair(trial.law.samples_least, trial.spp, wanted);
                if !trial.lit || asked.goal.time.is_some() && fits < least {
                    return Ok(());
                }
                fits.max(least)
            }
            before if fits >= LONGER * before && asked.proceeds() => fits,
            _ => return Ok(()),
        };
        if !trial.conclude(asked, spp)? || !trial.can_be_chosen() {
            return Ok(());
        }
    }
    Ok(())
}

/// Fewest samples per pixel of the last pair of a picture of `wanted`: as many as the error's law holds from, but no more than the picture has, nor than
/// those of the last round, after which there may be no time for more; as many as the first round had, and as the second one where that is little
/// beside the picture.
fn least_of_last_pair(samples_least: u32, last_round_spp: u32, wanted: u32) -> u32 {
    let least = samples_least.min(last_round_spp).min(wanted);
    let little = (wanted / PICTURE_OVER_PILOT).min(LEAST_LAST_PAIR);
    least.max(little).clamp(ROUNDS[0], LAST_PAIR)
}

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
        let predicted = |trial: &Trial<'_>| trial.picture_seconds(goal, spent)[1];
        // Under a time alone all take equally long, and the one with the smaller error is the better one.
        let cost = |trial: &Trial<'_>| match goal.error {
            _ if !trial.is_possible(goal) => IMPOSSIBLE_COST,
            // What has met no light is the last choice, but goes on as long as nothing else has.
            _ if !trial.lit => UNLIT_COST,
            Some(_) => predicted(trial),
            None => trial.squared_error(trial.samples(goal, spent)),
        };
        let able = || trials.iter().flatten().filter(|trial| trial.can_be_chosen());
        let best = able().map(&cost).fold(f64::INFINITY, f64::min);
        // Of what has met light, where anything has.
        let lit = able().any(|trial| trial.lit);
        let picture = able().filter(|trial| trial.lit == lit);
        let picture = picture.map(|trial| trial.picture_seconds(goal, spent));
        let picture = picture.fold([f64::INFINITY; 2], |[a, b], [least, expected]| {
            [a.min(least), b.min(expected)]
        });
        let rounds = seconds_of_rounds(trials);
        let allowed = room(ROUNDS_SHARE, goal, picture, spent, rounds);
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
            let next: f64 = trials
                .iter()
                .zip(&on)
                .filter(|(_, on)| **on)
                .filter_map(|(trial, _)| trial.as_ref())
                .map(|t| t.pairs.seconds(spp))
                .sum();
            (next <= allowed || blind).then_some(on)
        });
        let Some(going_on) = affordable else { return Ok(()) };
        for (trial, on) in trials.iter_mut().zip(going_on) {
            if let Some(trial) = trial.as_mut().filter(|_| on) {
                if !proceed() {
                    return update_judgements(trials, goal);
                }
                trial.go_on(asked, spp)?;
            }
        }
    }
    update_judgements(trials, goal)
}

/// Seconds that all rounds took.
pub fn seconds_of_rounds(trials: &[Option<Trial<'_>>]) -> f64 {
    trials.iter().flatten().map(|trial| trial.all_seconds).sum()
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

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    // Adaptive pictures of few samples have another pilot, or none: they say nothing of those of more.
    #[test]
    fn the_last_pair_is_under_the_law_of_the_picture() {
        let of = least_of_last_pair;
        assert_eq!([of(1, 4, 1), of(1, 256, 79)], [ROUNDS[0]; 2]);
        assert_eq!([of(1, 4, 160), of(1, 256, 1000)], [10, LEAST_LAST_PAIR]);
        assert_eq!(
            [of(16, 64, 1), of(16, 64, 10), of(16, 16, 16), of(16, 256, 1000)],
            [4, 10, 16, 16]
        );
        // Where rounds had no time for as many, the last pair has none, either, unless the picture takes far longer.
        assert_eq!([of(64, 4, 70), of(64, 4, 1000)], [ROUNDS[0], LEAST_LAST_PAIR]);
        assert_eq!(of(1 << 20, 1 << 20, 1 << 20), LAST_PAIR);
    }

    #[test]
    fn pilots_keep_to_a_quarter_of_what_is_long() {
        let free = Goal {
            error: Some(0.1),
            time: None,
        };
        // A picture of 30 s: ten of pilots make a quarter of all, six of them rounds.
        assert!((room(1.0, free, [30.0; 2], 0.0, 0.0) - 10.0).abs() < 1e-12);
        assert!((room(ROUNDS_SHARE, free, [30.0; 2], 4.0, 1.0) - 2.0).abs() < 1e-12);
        // Of what is not well known the least counts.
        assert!((room(1.0, free, [12.0, 40.0], 1.0, 0.5) - 3.0).abs() < 1e-12);
        // Maybe long: whatever else was spent counts, and with a picture that makes five seconds of both they are a quarter.
        for picture in [[3.1; 2], [0.5, 20.0]] {
            assert!((room(1.0, free, picture, 0.5, 0.1) - (1.25 - 0.5)).abs() < 1e-12);
        }
        // Short: seconds of rounds alone.
        assert!((room(1.0, free, [0.1; 2], 5.0, 0.5) - 0.5).abs() < 1e-12);
        let timed = Goal {
            error: None,
            time: Some(Duration::from_secs(8)),
        };
        assert!((room(1.0, timed, [6.0; 2], 0.5, 0.1) - 1.5).abs() < 1e-12);
        // Before any candidate has been tried nothing is late but a time.
        assert!(!is_late(&[], free, 100.0) && is_late(&[], timed, 2.0));
        // Rounds may take 0.75 s beside five seconds or less, and 3 s beside twenty.
        assert_eq!(
            [(1, 0.4), (3, 0.5), (3, 0.6)].map(|(n, spent)| is_beyond(n, 0.5, spent)),
            [true, false, true]
        );
        assert_eq!([1.4, 1.6].map(|spent| is_beyond(1, 20.0 - spent, spent)), [false, true]);
    }
}
