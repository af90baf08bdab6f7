//! Pilot pictures: two small ones of each candidate with independent seeds, refined round by round.

use std::time::{Duration, Instant};

use super::model::{CostModel, ErrorModel};
use super::noise::relative_mse_of_pair;
use super::{Candidate, Goal};
use crate::film::metrics::RELATIVE_MSE_OFFSET;
use crate::render::{RenderOptions, Renderer, Rendering};
use crate::techniques::{self, Bias};
use crate::transport::PathSet;
use crate::{Error, Result};

/// Most pixels of a pilot picture.
const PILOT_PIXELS: f64 = 16_384.0;
/// Shortest side of a pilot picture, pixels, where the picture itself has as many.
const PILOT_SIDE: u32 = 8;
/// Samples a pixel of the pilots, one round after the other.
const ROUNDS: [u32; 4] = [4, 16, 64, 256];
/// Share of the predicted time that pilots may take.
pub const PILOT_SHARE: f64 = 0.15;
/// Relative MSE of a black picture, which is all that pilots without light know.
const UNKNOWN_RELATIVE_MSE: f64 = 1.0;
/// Beyond the relative MSE of what has met light.
const UNLIT_COST: f64 = f64::MAX;
/// Seconds of rounds that pilots may take whatever the picture costs, where no time is to be kept.
const FREE_SECONDS: f64 = 2.0;
/// A candidate whose predicted cost is beyond this many times the best one's gets no further round.
const HOPELESS: f64 = 2.0;
/// Distance of the pilots' seeds from the picture's and from each other.
const SEED_STEP: u32 = 0x9E37_79B9;

/// A candidate with its pilots.
pub struct Trial {
    pilots: [Rendering; 2],
    error: ErrorModel,
    cost: CostModel,
    spp: u32,
    /// Seconds of its last round, and of all.
    round_seconds: f64,
    all_seconds: f64,
    /// Whether its pilots have met any light; without it nothing is known of the error.
    lit: bool,
}

/// The pilots' size: as the picture's, with fewer pixels.
fn pilot_size([width, height]: [u32; 2]) -> [u32; 2] {
    let scale = (PILOT_PIXELS / (f64::from(width) * f64::from(height))).sqrt().min(1.0);
    [width, height].map(|side| ((f64::from(side) * scale) as u32).max(PILOT_SIDE.min(side)))
}

impl Trial {
    /// Begins pilots, and compiles their kernels with a first sample; `None`, with the reason, for what cannot be chosen.
    pub fn start(
        renderer: &Renderer,
        options: &RenderOptions,
        candidate: &mut Candidate,
        wanted: PathSet,
        pixels: f64,
    ) -> Result<Option<Self>> {
        let info = techniques::by_id(candidate.technique)?;
        match info.bias {
            Bias::Unbiased => {}
            Bias::Consistent(cause) | Bias::Biased(cause) => {
                candidate.reason = format!("its pictures have a bias that pilots cannot see: {cause}");
                return Ok(None);
            }
        }
        let size = pilot_size(options.size);
        let begin = |seed_steps: u32| {
            renderer.start(&RenderOptions {
                technique: Some(candidate.technique.into()),
                settings: candidate.settings.clone().into(),
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
            all_seconds: 0.0,
            lit: false,
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
        self.all_seconds += self.round_seconds;
        let [width, height] = self.pilots[0].size();
        let samples = f64::from(width) * f64::from(height) * f64::from(spp - self.spp) * 2.0;
        self.cost.sample = self.round_seconds / samples * pixels;
        let [a, b] = &mut self.pilots;
        let pictures = [a.picture()?, b.picture()?];
        for picture in &pictures {
            self.lit |= picture.main_layer()?.values().iter().any(|value| *value != 0.0);
        }
        self.error.add(
            spp,
            relative_mse_of_pair(&pictures[0], &pictures[1], RELATIVE_MSE_OFFSET)?,
        );
        self.spp = spp;
        Ok(())
    }

    /// Samples a pixel for the goal, when the pilots have taken `spent` seconds.
    fn samples(&self, goal: Goal, spent: f64) -> u32 {
        let for_error = goal.error.map(|error| match self.lit {
            true => self.error.samples(error * error),
            // Nothing is known: as many as the longest pilots, at the least.
            false => ROUNDS[ROUNDS.len() - 1],
        });
        let left = |time: Duration| self.cost.samples(time.as_secs_f64() - spent).max(1);
        match (for_error, goal.time.map(left)) {
            (Some(by_error), Some(by_time)) => by_error.min(by_time),
            (by_error, by_time) => by_error.or(by_time).unwrap_or(1),
        }
    }

    /// Relative MSE expected of that many samples a pixel.
    fn relative_mse(&self, samples: u32) -> f64 {
        if self.lit {
            self.error.relative_mse(f64::from(samples))
        } else {
            UNKNOWN_RELATIVE_MSE
        }
    }

    /// Writes what the pilots have found to the candidate.
    pub fn predict(&self, candidate: &mut Candidate, goal: Goal, spent: f64) {
        candidate.pilot_spp = self.spp;
        candidate.pilot_error = self.relative_mse(self.spp).sqrt();
        candidate.slope = self.error.slope();
        candidate.seconds_a_sample = self.cost.sample;
        candidate.spp = self.samples(goal, spent);
        candidate.lit = self.lit;
        candidate.error = self.relative_mse(candidate.spp).sqrt();
        candidate.seconds = self.cost.seconds(f64::from(candidate.spp));
    }
}

/// Works until all samples that were asked for are there.
fn run(rendering: &mut Rendering) -> Result<()> {
    while rendering.step()?.is_some() {}
    Ok(())
}

/// Further rounds for what can still be chosen, as long as they cost little beside the picture itself.
pub fn rounds(
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
            // What has met no light is the last choice, but goes on as long as nothing else has.
            None if trial.lit => trial.relative_mse(trial.samples(goal, spent)),
            None => UNLIT_COST,
        };
        let best = trials.iter().flatten().map(&cost).fold(f64::INFINITY, f64::min);
        let picture = trials.iter().flatten().map(predicted).fold(f64::INFINITY, f64::min);
        let rounds: f64 = trials.iter().flatten().map(|trial| trial.all_seconds).sum();
        let share = PILOT_SHARE * (picture + spent);
        let allowed = match goal.time {
            Some(_) => share - spent,
            None => share.max(FREE_SECONDS) - rounds,
        };
        let blind = goal.time.is_none() && trials.iter().flatten().all(|trial| !trial.lit);
        // All that can still be chosen, or else the best alone.
        let affordable = [HOPELESS, 1.0].into_iter().find_map(|factor| {
            let on = |trial: &Option<Trial>| {
                trial
                    .as_ref()
                    .is_some_and(|t| t.spp == last && cost(t) <= factor * best)
            };
            let going_on: Vec<bool> = trials.iter().map(on).collect();
            // A round has four times the samples of all before it.
            let next: f64 = trials
                .iter()
                .filter(|t| on(t))
                .flatten()
                .map(|t| t.round_seconds * 4.0)
                .sum();
            (next <= allowed || blind).then_some(going_on)
        });
        let Some(going_on) = affordable else { return Ok(()) };
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pilots_keep_the_aspect_and_are_no_larger_than_the_picture() {
        assert_eq!(pilot_size([512, 512]), [128, 128]);
        assert_eq!(pilot_size([1280, 720]), [170, 96]);
        assert_eq!(pilot_size([40, 30]), [40, 30]);
        assert_eq!(pilot_size([65_535, 1]), [32_767, 1]);
    }
}
