//! A technique on trial: two small pilot pictures with independent seeds, refined round by round.
//!
//! Seeds and rounds decide what they find, to the bit; what a sample costs, the clock.

use std::time::{Duration, Instant};

use super::judgement::Judgement;
use super::model::{CostModel, ErrorModel};
use super::noise::{Truth, noise_of_pair};
use super::paths::same_picture;
use super::{Candidate, Goal, Reference};
use crate::film::Picture;
use crate::film::metrics::RELATIVE_MSE_OFFSET;
use crate::render::{RenderOptions, Renderer, Rendering};
use crate::settings::Settings;
use crate::techniques::{Bias, Card, Law};
use crate::transport::PathSet;
use crate::{Error, Result};

/// Most pixels of a pilot picture.
const PILOT_PIXELS: f64 = 16_384.0;
/// Shortest side of a pilot picture, pixels, where the picture itself has as many.
const PILOT_SIDE: u32 = 8;
/// Samples per pixel of the pilots, one round after the other.
pub const ROUNDS: [u32; 4] = [4, 16, 64, 256];
/// Relative MSE of a black picture, which is all that pilots without light know.
const UNKNOWN_RELATIVE_MSE: f64 = 1.0;
/// Sides of a pilot over those of the smaller one that tells what does not depend on pixels.
const SMALL: u32 = 4;
/// Distance of the pilots' seeds from the picture's and from each other.
const SEED_STEP: u32 = 0x9E37_79B9;

/// The two pilots' pictures after a round.
pub struct Stage {
    pub spp: u32,
    pub pictures: [Picture; 2],
}

/// A technique with its pilots.
pub struct Trial<'a> {
    pub card: &'a Card,
    /// What of the wanted paths it does not find, in words; empty where it finds all.
    pub misses: String,
    /// After each round.
    pub stages: Vec<Stage>,
    pub spp: u32,
    /// Whether its pilots have met any light; without it nothing is known of the error.
    pub lit: bool,
    /// How its error falls by theory.
    pub law: Law,
    pub judgement: Judgement,
    /// Whether it can be chosen, and is not there for others to be held against alone.
    pub is_candidate: bool,
    /// Why its pilots could not go on; empty while they can.
    pub failure: String,
    pilots: [Rendering; 2],
    pub error: ErrorModel,
    pub cost: CostModel,
    /// Share of a pilot sample's time that does not depend on the number of pixels.
    fixed: f64,
    /// Seconds of its last round, and of all.
    pub round_seconds: f64,
    pub all_seconds: f64,
}

/// What all trials have in common.
pub struct Asked<'a> {
    pub renderer: &'a Renderer,
    pub options: &'a RenderOptions,
    pub paths: PathSet,
    pub goal: Goal,
}

impl Asked<'_> {
    /// Pixels of the picture itself.
    pub fn pixels(&self) -> f64 {
        f64::from(self.options.size[0]) * f64::from(self.options.size[1])
    }
}

/// The pilots' size: as the picture's, with fewer pixels.
fn pilot_size([width, height]: [u32; 2]) -> [u32; 2] {
    let scale = (PILOT_PIXELS / (f64::from(width) * f64::from(height))).sqrt().min(1.0);
    [width, height].map(|side| ((f64::from(side) * scale) as u32).max(PILOT_SIDE.min(side)))
}

impl<'a> Trial<'a> {
    /// Begins pilots, and compiles their kernels with a first sample; `None`, with the reason, for what cannot be chosen. `index` keeps the
    /// seeds of biased techniques apart from those that they are held against.
    pub fn start(asked: &Asked<'_>, card: &'a Card, candidate: &mut Candidate, index: usize) -> Result<Option<Self>> {
        match Self::begin(asked, card, candidate, index) {
            Ok(trial) => Ok(trial),
            Err(error) => {
                candidate.reason = reason_of(error)?;
                Ok(None)
            }
        }
    }

    /// Of an unbiased technique that is not a candidate, for others to be held against.
    pub fn start_reference(asked: &Asked<'_>, card: &'a Card, candidate: &mut Candidate) -> Result<Option<Self>> {
        let trial = Self::start(asked, card, candidate, 0)?;
        Ok(trial.map(|trial| Self {
            is_candidate: false,
            ..trial
        }))
    }

    fn begin(asked: &Asked<'_>, card: &'a Card, candidate: &mut Candidate, index: usize) -> Result<Option<Self>> {
        let Asked { renderer, options, .. } = *asked;
        let (caps, profile) = (renderer.gpu().caps(), renderer.gpu_scene().profile());
        let settings: Settings = candidate.settings.clone().into();
        // What can be told before anything is made: kernels, maps of lights and filtered environments may take long.
        let admitted = card.admit(caps, profile, &settings)?;
        let mut has_paths = |paths: &PathSet| {
            let same = same_picture(profile, paths, &asked.paths);
            if !same {
                candidate.reason = format!("its pictures hold the light paths {:?}", paths.to_string());
            }
            same
        };
        if !has_paths(&card.path_set_with(&settings)) {
            return Ok(None);
        }
        (card.foresight.fits)(caps, options.size)?;
        let law = (card.foresight.law)(&admitted)?;
        let misses = (card.foresight.misses)(profile, renderer.lights(), &asked.paths)?;
        let size = pilot_size(options.size);
        let first_seed = match card.bias {
            Bias::Unbiased => 1,
            Bias::Consistent(_) | Bias::Biased(_) => 2 * index as u32 + 3,
        };
        let begin = |seed_steps: u32, size: [u32; 2]| {
            let pilot = RenderOptions {
                technique: Some(card.id.into()),
                settings: settings.clone(),
                size,
                spp: 1,
                seed: options.seed.wrapping_add(seed_steps.wrapping_mul(SEED_STEP)),
                aovs: false,
                time_budget: None,
                camera: options.camera.clone(),
            };
            renderer.start_technique(card, &pilot)
        };
        let mut first = begin(first_seed, size)?;
        if !has_paths(&first.path_set()) {
            return Ok(None);
        }
        run(&mut first)?;
        // The second one finds its kernels compiled, as the picture itself will.
        let from = Instant::now();
        let mut second = begin(first_seed + 1, size)?;
        run(&mut second)?;
        let start = from.elapsed().as_secs_f64();
        let small = size.map(|side| (side / SMALL).max(1));
        let alike = card.bias == Bias::Unbiased || size == options.size;
        let small_seconds = if alike {
            None
        } else {
            Some(round_of_another_size(begin(first_seed, small)?)?)
        };
        let mut trial = Self {
            card,
            misses: misses.unwrap_or_default(),
            stages: Vec::new(),
            spp: 1,
            lit: false,
            judgement: Judgement::default(),
            is_candidate: true,
            failure: String::new(),
            pilots: [first, second],
            error: ErrorModel::falling(law.slope),
            law,
            cost: CostModel { start, sample: 0.0 },
            fixed: 0.0,
            round_seconds: 0.0,
            all_seconds: 0.0,
        };
        // How far a picture moves as it goes on shows from the first sample.
        if matches!(card.bias, Bias::Consistent(_)) {
            let pictures = trial.pictures()?;
            trial.stages.push(Stage { spp: 1, pictures });
        }
        trial.round(ROUNDS[0], asked.pixels())?;
        if let Some(small_seconds) = small_seconds {
            let area = |[width, height]: [u32; 2]| f64::from(width) * f64::from(height);
            trial.fixed = fixed_share([area(small), small_seconds], [area(size), trial.round_seconds / 2.0]);
            trial.cost.sample = trial.seconds_a_sample(ROUNDS[0] - 1, asked.pixels());
        }
        Ok(Some(trial))
    }

    /// Refines both pilots to `spp` samples per pixel; what keeps them from it is [`failure`](Self::failure) from then on. `pixels` are those of the picture itself.
    pub fn go_on(&mut self, spp: u32, pixels: f64) -> Result<()> {
        if let Err(error) = self.round(spp, pixels) {
            self.failure = reason_of(error)?;
        }
        Ok(())
    }

    /// A round of both pilots to `spp` samples per pixel; `pixels` are those of the picture itself.
    fn round(&mut self, spp: u32, pixels: f64) -> Result<()> {
        let from = Instant::now();
        for pilot in &mut self.pilots {
            pilot.set_spp(spp);
            run(pilot)?;
        }
        self.round_seconds = from.elapsed().as_secs_f64();
        self.all_seconds += self.round_seconds;
        self.cost.sample = self.seconds_a_sample(spp - self.spp, pixels);
        let pictures = self.pictures()?;
        for picture in &pictures {
            self.lit |= picture.main_layer()?.values().iter().any(|value| *value != 0.0);
        }
        let truth = if self.law.shares_noise {
            Truth::Pixel
        } else {
            Truth::Neighbourhood
        };
        self.error.add(
            spp,
            noise_of_pair(&pictures[0], &pictures[1], RELATIVE_MSE_OFFSET, truth)?,
        );
        self.stages.push(Stage { spp, pictures });
        self.spp = spp;
        Ok(())
    }

    fn pictures(&mut self) -> Result<[Picture; 2]> {
        let [a, b] = &mut self.pilots;
        Ok([a.picture()?, b.picture()?])
    }

    /// Seconds for each sample per pixel of a picture of so many pixels, by a round of so many samples.
    fn seconds_a_sample(&self, samples: u32, pixels: f64) -> f64 {
        let [width, height] = self.pilots[0].size();
        let larger = pixels / (f64::from(width) * f64::from(height));
        self.round_seconds / f64::from(2 * samples.max(1)) * (self.fixed + (1.0 - self.fixed) * larger)
    }

    /// Samples per pixel for the goal, when the pilots have taken `spent` seconds.
    pub fn samples(&self, goal: Goal, spent: f64) -> u32 {
        let for_error = goal.error.map(|error| match self.lit {
            // What cannot reach it is shown with as many as noise alone would take.
            true => self.reach(error).unwrap_or_else(|| self.error.samples(error * error)),
            // Nothing is known: as many as the longest pilots, at the least.
            false => ROUNDS[ROUNDS.len() - 1],
        });
        let left = |time: Duration| self.cost.samples(time.as_secs_f64() - spent).max(1);
        match (for_error, goal.time.map(left)) {
            (Some(by_error), Some(by_time)) => by_error.min(by_time),
            (by_error, by_time) => by_error.or(by_time).unwrap_or(1),
        }
    }

    /// Samples per pixel for an error, noise and bias together.
    fn reach(&self, error: f64) -> Option<u32> {
        self.judgement.bias?.samples(&self.error, error * error)
    }

    /// Relative MSE of its last pilots by noise alone.
    pub fn noise(&self) -> f64 {
        self.error.relative_mse(f64::from(self.spp))
    }

    /// Relative MSE expected of that many samples per pixel, by noise alone.
    pub fn relative_mse(&self, samples: u32) -> f64 {
        if self.lit {
            self.error.relative_mse(f64::from(samples))
        } else {
            UNKNOWN_RELATIVE_MSE
        }
    }

    /// Whether it is a candidate whose pilots did not fail.
    pub fn can_be_chosen(&self) -> bool {
        self.is_candidate && self.failure.is_empty()
    }

    /// Whether it can still be chosen, for all that is known of its bias.
    pub fn is_possible(&self, goal: Goal) -> bool {
        let reaches = || goal.error.is_none_or(|error| self.reach(error).is_some());
        self.can_be_chosen() && (self.judgement.may_be_seen || !self.lit || self.judgement.bias.is_some() && reaches())
    }

    /// Writes what the pilots have found to the candidate.
    pub fn predict(&self, candidate: &mut Candidate, goal: Goal, spent: f64) {
        candidate.pilot_spp = self.spp;
        candidate.pilot_noise = self.relative_mse(self.spp).sqrt();
        candidate.slope = self.error.slope();
        candidate.seconds_a_sample = self.cost.sample;
        candidate.spp = self.samples(goal, spent);
        candidate.lit = self.lit;
        candidate.misses.clone_from(&self.misses);
        let noise = self.relative_mse(candidate.spp);
        candidate.noise = noise.sqrt();
        candidate.judged_by.clone_from(&self.judgement.by);
        let samples = f64::from(candidate.spp);
        let bias = self.judgement.bias;
        candidate.bias = bias.map(|bias| bias.square(samples).sqrt());
        candidate.bias_at_most = bias.map(|bias| bias.upper(samples).sqrt());
        candidate.error = (noise + bias.map_or(0.0, |bias| bias.square(samples))).sqrt();
        candidate.seconds = self.cost.seconds(samples);
        if self.lit {
            let reaches = goal.error.is_none_or(|error| self.reach(error).is_some());
            candidate.reason = self.judgement.refusal(goal.error, reaches).unwrap_or_default();
        }
        if !self.failure.is_empty() {
            candidate.reason.clone_from(&self.failure);
        }
    }

    /// What others are held against: technique, samples per pixel, noise.
    pub fn as_reference(&self) -> Reference {
        Reference {
            technique: self.card.id,
            pilot_spp: self.spp,
            pilot_noise: self.noise().sqrt(),
        }
    }
}

/// Why a technique cannot be chosen, of an error that is its own; whatever else goes wrong ends the choice.
fn reason_of(error: Error) -> Result<String> {
    match error {
        Error::Unsupported { .. }
        | Error::MissingFeature { .. }
        | Error::LimitExceeded { .. }
        | Error::OutOfMemory { .. }
        | Error::Overflow { .. } => Ok(error.to_string()),
        other => Err(other),
    }
}

/// Share of a sample's time that does not depend on the pixels, by pairs of pixels and seconds of a small and a larger picture.
fn fixed_share([small, small_seconds]: [f64; 2], [large, seconds]: [f64; 2]) -> f64 {
    if large <= small || seconds <= 0.0 {
        return 0.0;
    }
    let each = ((seconds - small_seconds) / (large - small)).max(0.0);
    (1.0 - each * large / seconds).clamp(0.0, 1.0)
}

/// Seconds of the first round of a pilot of another size.
fn round_of_another_size(mut pilot: Rendering) -> Result<f64> {
    run(&mut pilot)?;
    let from = Instant::now();
    pilot.set_spp(ROUNDS[0]);
    run(&mut pilot)?;
    Ok(from.elapsed().as_secs_f64())
}

/// Works until all samples that were asked for are there.
fn run(rendering: &mut Rendering) -> Result<()> {
    while rendering.step()?.is_some() {}
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
