//! A technique on trial: two small pilot pictures with independent seeds, and two others in each round.
//!
//! No round has a seed or a sample in common with another one: what was low by luck when a round was decided on is not part of what it finds.
//! Seeds and rounds decide what they find, to the bit; what a sample costs, the clock.

use std::cell::{Cell, RefCell};
use std::time::{Duration, Instant};

use super::judgement::Judgement;
use super::model::{CostModel, ErrorModel, PairCost};
use super::noise::{Pair, Truth, noise_of_pairs};
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
/// How long a pilot may take in any case, once its kernels are compiled, whoever waits.
const PATIENCE: Duration = Duration::from_millis(500);
/// The same of the pilots behind the first one, where the stop request was there before any of them: the least that a choice takes is then done.
const LEAST_PATIENCE: Duration = Duration::from_secs(10);
/// Seconds that a run for the cost of a sample alone may take at most, if its samples cost what those of the one before did.
const COST_SECONDS: f64 = 0.4;
/// Seconds of a round that everything goes through before it is held against others, and their share of a time to keep: how the error falls shows early.
const CHEAP_SECONDS: f64 = 0.25;
const CHEAP_SHARE: f64 = 0.01;
/// Sides of a pilot over those of the smaller one that tells what does not depend on pixels.
const SMALL: u32 = 4;
/// Distance of the pilots' seeds from the picture's and from each other.
const SEED_STEP: u32 = 0x9E37_79B9;
/// Last pairs at most, each longer than the one before, which then tells how fast the error falls.
pub const LAST_PAIRS: u32 = 3;
/// Pairs of seeds of a candidate: for first samples, rounds and last pairs.
const SEED_PAIRS: u32 = ROUNDS.len() as u32 + 1 + LAST_PAIRS;

/// The two pilots' pictures of a round.
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
    settings: Settings,
    size: [u32; 2],
    /// Which of all candidates, for seeds of its own.
    index: u32,
    /// The last pair, which nothing was decided by but whether to have a longer one.
    last: Option<Stage>,
    /// How many of them there were.
    last_pairs: u32,
    pub error: ErrorModel,
    pub cost: CostModel,
    /// Share of a pilot sample's time that does not depend on the number of pixels.
    fixed: f64,
    /// What its own pairs cost.
    pub pairs: PairCost,
    /// Seconds of a picture of the first round, without its first sample.
    first_round: f64,
    /// Seconds of all pairs, with their beginnings.
    pub all_seconds: f64,
}

/// What all trials have in common.
pub struct Asked<'a> {
    pub renderer: &'a Renderer,
    pub options: &'a RenderOptions,
    pub paths: PathSet,
    pub goal: Goal,
    /// Whether the host lets pilots go on; see [`Asked::proceeds`].
    pub proceed: RefCell<&'a mut dyn FnMut() -> bool>,
    /// Pilots that have to be did not end in time: others would not, either.
    pub gave_up: Cell<bool>,
    /// How long pilots behind the first one go on after a stop request; see [`patience`].
    pub patience: Duration,
}

/// How long pilots behind a technique's first one go on after a stop request, by whether the host lets them go on when they begin.
pub fn patience(proceeds: bool) -> Duration {
    if proceeds { PATIENCE } else { LEAST_PATIENCE }
}

impl Asked<'_> {
    /// Whether pilots go on.
    pub fn proceeds(&self) -> bool {
        let mut proceed = self.proceed.borrow_mut();
        (*proceed)()
    }

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
    /// Begins pilots, and compiles their kernels with a first sample; `None`, with the reason, for what cannot be chosen. `index` keeps seeds apart
    /// from those of other candidates.
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
    pub fn start_reference(
        asked: &Asked<'_>,
        card: &'a Card,
        candidate: &mut Candidate,
        index: usize,
    ) -> Result<Option<Self>> {
        let trial = Self::start(asked, card, candidate, index)?;
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
        let mut trial = Self {
            card,
            misses: misses.unwrap_or_default(),
            stages: Vec::new(),
            spp: 1,
            lit: false,
            judgement: Judgement::default(),
            is_candidate: true,
            failure: String::new(),
            settings,
            size,
            index: index as u32,
            last: None,
            last_pairs: 0,
            error: ErrorModel::falling(law.slope),
            law,
            cost: CostModel::default(),
            fixed: 0.0,
            pairs: PairCost::default(),
            first_round: 0.0,
            all_seconds: 0.0,
        };
        let gave_up = |which: &str| {
            asked.gave_up.set(true);
            let reason =
                format!("its {which} did not end in time; render with a technique and a time budget instead of a goal");
            Error::Unsupported {
                technique: card.id.into(),
                reasons: vec![reason],
            }
        };
        let mut first = trial
            .begin_pilot(asked, size, [0, 0])
            .map_err(|error| refusal_of(card, error))?;
        if !has_paths(&first.path_set()) {
            return Ok(None);
        }
        if !run_first(&mut first, asked)? {
            return Err(gave_up("first pilot picture"));
        }
        let not_first = "pilot pictures";
        // The second one finds its kernels compiled, as the picture itself will.
        let from = Instant::now();
        let mut second = trial.begin_pilot(asked, size, [0, 1])?;
        if !run(&mut second, asked)? {
            return Err(gave_up(not_first));
        }
        trial.cost.start = from.elapsed().as_secs_f64();
        trial.pairs.start = trial.cost.start;
        let small = size.map(|side| (side / SMALL).max(1));
        let alike = card.bias == Bias::Unbiased || size == options.size;
        let small_seconds = if alike {
            None
        } else {
            let pilot = trial.begin_pilot(asked, small, [0, 0])?;
            let seconds = round_of_another_size(pilot, asked)?;
            Some(seconds.ok_or_else(|| gave_up(not_first))?)
        };
        // How far a picture moves as it goes on shows from the first sample.
        if matches!(card.bias, Bias::Consistent(_)) {
            let pictures = [first.picture()?, second.picture()?];
            trial.stages.push(Stage { spp: 1, pictures });
        }
        drop((first, second));
        if !trial.round(asked, ROUNDS[0])? {
            return Err(gave_up(not_first));
        }
        let cheap = asked.goal.time.map_or(CHEAP_SECONDS, |time| {
            CHEAP_SECONDS.min(CHEAP_SHARE * time.as_secs_f64())
        });
        let further = ROUNDS[1..ROUNDS.len() - 1].iter();
        for spp in further {
            let goes_on = trial.pairs.seconds(*spp) <= cheap && asked.proceeds();
            if !goes_on || !trial.round(asked, *spp)? {
                break;
            }
        }
        if let Some(small_seconds) = small_seconds {
            let area = |[width, height]: [u32; 2]| f64::from(width) * f64::from(height);
            trial.fixed = fixed_share([area(small), small_seconds], [area(size), trial.first_round]);
            trial.cost.sample = trial.seconds_a_sample(asked.pixels());
        }
        Ok(Some(trial))
    }

    /// A pilot of one sample per pixel, with the seed of a pair's one or other picture.
    fn begin_pilot(&self, asked: &Asked<'_>, size: [u32; 2], [pair, which]: [u32; 2]) -> Result<Rendering> {
        // The picture itself has the seed at 0.
        let steps = 2 * (self.index * SEED_PAIRS + pair) + which + 1;
        let settings = (self.card.foresight.pilot)(&self.settings, asked.options.size, size)?;
        let pilot = RenderOptions {
            technique: Some(self.card.id.into()),
            settings,
            size,
            spp: 1,
            seed: asked.options.seed.wrapping_add(steps.wrapping_mul(SEED_STEP)),
            aovs: false,
            time_budget: None,
            camera: asked.options.camera.clone(),
        };
        asked.renderer.start_technique(self.card, &pilot)
    }

    /// Two pictures of `spp` samples per pixel with a pair's seeds; `None` where they are given up. What beyond their first samples they take tells what a
    /// sample costs.
    fn pair(&mut self, asked: &Asked<'_>, spp: u32, pair: u32) -> Result<Option<[Picture; 2]>> {
        let from = Instant::now();
        let mut seconds = 0.0;
        let mut picture = |which: u32| -> Result<Option<(Picture, Rendering)>> {
            let mut pilot = self.begin_pilot(asked, self.size, [pair, which])?;
            let begun = Instant::now();
            if !run(&mut pilot, asked)? {
                return Ok(None);
            }
            let first = begun.elapsed().as_secs_f64();
            pilot.set_spp(spp);
            if !run(&mut pilot, asked)? {
                return Ok(None);
            }
            seconds += begun.elapsed().as_secs_f64() - first;
            Ok(Some((pilot.picture()?, pilot)))
        };
        let Some((one, _)) = picture(0)? else {
            return Ok(None);
        };
        let Some((other, pilot)) = picture(1)? else {
            return Ok(None);
        };
        let pictures = [one, other];
        let knows_best = self.pairs.measure(spp, 2 * (spp - 1).max(1), seconds);
        if spp == ROUNDS[0] {
            self.first_round = 0.5 * seconds;
            self.measure_cost(asked, pilot)?;
        }
        self.all_seconds += from.elapsed().as_secs_f64();
        if knows_best {
            self.cost.sample = self.seconds_a_sample(asked.pixels());
        }
        Ok(Some(pictures))
    }

    /// Lets a pilot of the first round go on as far as [`COST_SECONDS`] do: few samples of few pixels take the time of passes, however few paths these have.
    fn measure_cost(&mut self, asked: &Asked<'_>, mut pilot: Rendering) -> Result<()> {
        for (spp, next) in ROUNDS.iter().zip(&ROUNDS[1..]) {
            let samples = next - spp;
            if self.pairs.sample * f64::from(samples) > COST_SECONDS {
                break;
            }
            pilot.set_spp(*next);
            let begun = Instant::now();
            if !run(&mut pilot, asked)? {
                break;
            }
            self.pairs.measure(*next, samples, begun.elapsed().as_secs_f64());
        }
        Ok(())
    }

    /// A further round of two pictures of `spp` samples per pixel; what keeps them from it is [`failure`](Self::failure) from then on. One that is given up changes
    /// nothing.
    pub fn go_on(&mut self, asked: &Asked<'_>, spp: u32) -> Result<()> {
        if let Err(error) = self.round(asked, spp) {
            self.failure = reason_of(error)?;
        }
        Ok(())
    }

    /// False where it is given up.
    fn round(&mut self, asked: &Asked<'_>, spp: u32) -> Result<bool> {
        let round = ROUNDS.iter().take_while(|samples| **samples < spp).count() as u32;
        let Some(pictures) = self.pair(asked, spp, 1 + round)? else {
            return Ok(false);
        };
        for picture in &pictures {
            self.lit |= picture.main_layer()?.values().iter().any(|value| *value != 0.0);
        }
        self.stages.push(Stage { spp, pictures });
        self.spp = spp;
        self.measure()?;
        Ok(true)
    }

    /// The last pair, of `spp` samples per pixel: from now on it alone says how large the error is. What keeps it from that is
    /// [`failure`](Self::failure); where it is given up, which is false, what was found before stands.
    pub fn conclude(&mut self, asked: &Asked<'_>, spp: u32) -> Result<bool> {
        let seeds = SEED_PAIRS - LAST_PAIRS + self.last_pairs;
        let concluded = self.pair(asked, spp, seeds).and_then(|pictures| {
            let Some(pictures) = pictures else {
                return Ok(false);
            };
            self.last_pairs += 1;
            let before = self.last.replace(Stage { spp, pictures });
            self.stages.extend(before);
            self.measure().map(|()| true)
        });
        concluded.or_else(|error| {
            self.failure = reason_of(error)?;
            Ok(true)
        })
    }

    /// Samples per pixel of the last pair; 0 without.
    pub fn last_spp(&self) -> u32 {
        self.last.as_ref().map_or(0, |last| last.spp)
    }

    /// The errors of all pairs, relative to what they show together.
    fn measure(&mut self) -> Result<()> {
        let last = self.last.as_ref();
        let kind = if self.law.shares_noise {
            Truth::Pixel
        } else {
            Truth::Neighbourhood
        };
        // First samples are there for the bias alone. What is known to fall otherwise tells the error only where nothing else does.
        let telling = |stage: &&Stage| stage.spp >= self.law.samples_least;
        let least = match self.stages.iter().chain(last).any(|stage| telling(&stage)) {
            true => self.law.samples_least.max(2),
            false => 2,
        };
        let stages = self.stages.iter().filter(|stage| stage.spp >= least);
        let stages: Vec<&Stage> = stages.chain(last).collect();
        let pairs: Vec<Pair<'_>> = stages
            .iter()
            .map(|stage| {
                let [a, b] = &stage.pictures;
                (stage.spp, [a, b])
            })
            .collect();
        let found = noise_of_pairs(&pairs, RELATIVE_MSE_OFFSET, kind)?;
        self.error.clear();
        for (index, (stage, found)) in stages.iter().zip(&found).enumerate() {
            if last.is_some() && index + 1 == stages.len() {
                self.error.conclude(stage.spp, found.relative_mse, found.deviation);
            } else {
                self.error.add(stage.spp, found.relative_mse, found.deviation);
            }
        }
        Ok(())
    }

    /// Seconds for each sample per pixel of a picture of so many pixels.
    fn seconds_a_sample(&self, pixels: f64) -> f64 {
        let larger = pixels / self.pixels();
        self.pairs.sample * (self.fixed + (1.0 - self.fixed) * larger)
    }

    /// Pixels of a pilot.
    fn pixels(&self) -> f64 {
        f64::from(self.size[0]) * f64::from(self.size[1])
    }

    /// Seconds that the picture for the goal takes at the least, in 19 of 20 cases, by how well its error is known, and those expected, when the pilots
    /// have taken `spent` seconds.
    pub fn picture_seconds(&self, goal: Goal, spent: f64) -> [f64; 2] {
        let samples = f64::from(self.samples(goal, spent));
        let slack = match goal.error {
            Some(_) if self.lit => self.error.factor_of_samples(samples),
            _ => 1.0,
        };
        [samples / slack, samples].map(|samples| self.cost.seconds(samples))
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

    /// Squared error, relative to the radiance's square, expected of that many samples per pixel: noise and bias together.
    pub fn squared_error(&self, samples: u32) -> f64 {
        let bias = self.judgement.bias.map_or(0.0, |bias| bias.square(samples.into()));
        self.relative_mse(samples) + bias
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
    pub fn predict(&self, candidate: &mut Candidate, asked: &Asked<'_>, spent: f64) {
        let (goal, asked_pixels) = (asked.goal, asked.pixels());
        candidate.pilot_spp = self.spp;
        candidate.last_pilot_spp = self.last_spp();
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
        candidate.error_interval = bias.filter(|_| self.lit).map(|bias| {
            let factor = self.error.factor(samples, asked_pixels / self.pixels());
            let least = (candidate.noise / factor).hypot(bias.lower(samples).sqrt());
            let most = (candidate.noise * factor).hypot(bias.upper(samples).sqrt());
            [least, most]
        });
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

/// A setting within its range that the technique cannot have in this scene is a reason against it; what is wrong in any scene was refused before.
fn refusal_of(card: &Card, error: Error) -> Error {
    if let Error::Setting { name, .. } = &error
        && card.settings.has(name)
    {
        return Error::Unsupported {
            technique: card.id.into(),
            reasons: vec![error.to_string()],
        };
    }
    error
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

/// Seconds of the first round of a pilot of another size; `None` where it is given up.
fn round_of_another_size(mut pilot: Rendering, asked: &Asked<'_>) -> Result<Option<f64>> {
    if !run(&mut pilot, asked)? {
        return Ok(None);
    }
    let from = Instant::now();
    pilot.set_spp(ROUNDS[0]);
    let ended = run(&mut pilot, asked)?;
    Ok(ended.then(|| from.elapsed().as_secs_f64()))
}

/// Works until all samples of a first pilot are there; false where they are not after half of the time there is, or soon after a stop request. Scenes that are so
/// hard have nothing to choose by.
fn run_first(pilot: &mut Rendering, asked: &Asked<'_>) -> Result<bool> {
    run_while(pilot, PATIENCE, |worked| {
        let late = asked.goal.time.is_some_and(|time| worked >= time / 2);
        !late && asked.proceeds()
    })
}

/// Works until all samples that were asked for are there; false where they are not soon after a stop request.
fn run(pilot: &mut Rendering, asked: &Asked<'_>) -> Result<bool> {
    run_while(pilot, asked.patience, |_| asked.proceeds())
}

/// Works until all samples are there; false where they are not when `goes_on`, which is asked once the patience is over, says no.
fn run_while(pilot: &mut Rendering, patience: Duration, goes_on: impl Fn(Duration) -> bool) -> Result<bool> {
    let mut begun = None;
    while let Some(progress) = pilot.step()? {
        // The first step compiles.
        let worked = begun.get_or_insert_with(Instant::now).elapsed();
        if worked >= patience && !goes_on(worked) {
            return Ok(progress.fraction >= 1.0);
        }
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pilots_have_more_time_where_the_least_is_asked_for_from_the_start() {
        assert_eq!([true, false].map(patience), [PATIENCE, LEAST_PATIENCE]);
        assert!(PATIENCE < LEAST_PATIENCE);
    }

    #[test]
    fn pilots_keep_the_aspect_and_are_no_larger_than_the_picture() {
        assert_eq!(pilot_size([512, 512]), [128, 128]);
        assert_eq!(pilot_size([1280, 720]), [170, 96]);
        assert_eq!(pilot_size([40, 30]), [40, 30]);
        assert_eq!(pilot_size([65_535, 1]), [32_767, 1]);
    }
}
