//! Time to equal error: both renderers with their samplers take turns at pictures of a scene, and each picture counts by its seconds and its error.
//!
//! Speed and error come from the same pictures. The relative MSE is that of [`spread`](super::spread): the variance between independent pictures,
//! over the same weights for all, so no reference's noise is in it; that the renderers agree in expectation is for the z-test to show.
//! A Monte Carlo picture of n samples takes time in proportion to n and has an error in proportion to 1/n, so a contender with s seconds
//! and error m a picture reaches an error e in s · m / e seconds. The one assumption is MSE ∝ 1/n between the timed picture and e: it
//! is exact for independent samples and holds near the timed picture for stratified ones, whose error may fall faster: then it is in this
//! engine's favour where Mitsuba's timed picture has the larger error (fewer samples than assumed would do), and in Mitsuba's where it has
//! the smaller one. To use it least, e is the error of this engine's best picture, and all contenders take the same number of samples.
//! The standard error of a ratio has two parts of each side, in quadrature: the relative MSE's, and the seconds' by their spread between rounds.
//! Guarantees: pictures and errors depend on the options and the drivers alone; times are medians over all pictures.

use std::path::Path;
use std::sync::Arc;

use clerestory::gpu::Gpu;
use clerestory::scene::Camera;
use clerestory::techniques::{PathTracer, PathTracerSettings};
use clerestory::transport::GpuScene;
use clerestory::transport::random::SamplerKind;
use clerestory::{Error, Result};

use super::peer::{Integrator, Peer, Request, Variant};
use super::spread;
use super::{AgreementOptions, Fault};
use crate::experiments::watch::Watch;
use crate::timing::{median, timed};

/// This engine's name as a contender.
const OURS: &str = "clerestory";
/// Standard error of a median over that of a mean, of many values that are normal: √(π/2).
const MEDIAN_OVER_MEAN: f64 = 1.253_314_137_315_5;

/// A renderer with a sampler, and what its pictures take.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Contender {
    /// `clerestory`, or Mitsuba's variant with, in media, its integrator.
    pub renderer: String,
    /// Its sampler as it calls it.
    pub sampler: String,
    /// Independent pictures that were timed.
    pub pictures: usize,
    /// Seconds of wall clock a picture, median.
    pub seconds: f64,
    /// Its standard error, by the spread of the rounds' medians, or of the pictures where there is one round; `None` in reports of earlier
    /// versions.
    #[serde(default)]
    pub seconds_error: Option<f64>,
    /// Processor seconds of all threads per picture, median of the rounds; `None` where the system does not say.
    pub cpu_seconds: Option<f64>,
    /// Camera paths per second of wall clock.
    pub paths_per_second: f64,
    /// Relative MSE of one picture.
    pub relative_mse: f64,
    /// Its standard error.
    pub relative_mse_error: f64,
}

impl Contender {
    /// Renderer and sampler.
    pub fn name(&self) -> String {
        format!("{}, {}", self.renderer, self.sampler)
    }

    /// Seconds until the error is `error`.
    pub fn seconds_to(&self, error: f64) -> f64 {
        self.seconds * self.relative_mse / error
    }

    /// Processor seconds until the error is `error`.
    pub fn cpu_seconds_to(&self, error: f64) -> Option<f64> {
        self.cpu_seconds.map(|seconds| seconds * self.relative_mse / error)
    }

    /// Whether it is this engine.
    pub(super) fn is_ours(&self) -> bool {
        self.renderer == OURS
    }

    /// Mitsuba's variant, without its integrator.
    pub(super) fn variant(&self) -> &str {
        self.renderer
            .split_once(' ')
            .map_or(&*self.renderer, |(variant, _)| variant)
    }

    /// Integrator, where there is a choice, and sampler.
    pub(super) fn way(&self) -> String {
        let integrator = self.renderer.split_once(' ').map(|(_, integrator)| integrator);
        integrator.map_or(self.sampler.clone(), |integrator| {
            format!("{integrator} {}", self.sampler)
        })
    }

    /// Relative standard error of the seconds to an error, by that of the relative MSE and, where it is known, that of the seconds.
    pub(super) fn uncertainty(&self) -> f64 {
        let seconds_error = self.seconds_error.unwrap_or(0.0);
        (self.relative_mse_error / self.relative_mse).hypot(seconds_error / self.seconds)
    }
}

/// The time of two contenders to one error.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct EqualError {
    /// Index of ours.
    pub ours: usize,
    /// Index of theirs.
    pub theirs: usize,
    /// The relative MSE to reach: that of our best contender's timed picture.
    pub error: f64,
    /// Our seconds to it.
    pub our_seconds: f64,
    /// Their seconds to it.
    pub their_seconds: f64,
    /// Their seconds over ours: above 1 this engine is faster.
    pub ratio: f64,
    /// Standard error of the ratio, by those of the relative MSEs and of the seconds.
    pub ratio_error: f64,
    /// Their processor seconds over ours.
    pub cpu_ratio: Option<f64>,
}

/// Who reaches the error first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lead {
    /// This engine.
    Faster,
    /// Mitsuba.
    Slower,
    /// The ratio is 1 within [`EqualError::STANDARD_ERRORS`].
    Undecided,
}

impl EqualError {
    /// Standard errors of the ratio that a lead must exceed.
    pub const STANDARD_ERRORS: f64 = 2.0;

    /// Who is first. By the ratio's logarithm, so that neither side is the favoured one.
    pub fn lead(&self) -> Lead {
        let (lead, margin) = (self.ratio.ln(), Self::STANDARD_ERRORS * self.ratio_error / self.ratio);
        if lead > margin {
            Lead::Faster
        } else if -lead > margin {
            Lead::Slower
        } else {
            Lead::Undecided
        }
    }
}

/// All contenders on one scene.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Race {
    /// Ours first.
    pub contenders: Vec<Contender>,
    /// Our best against Mitsuba's best variant and sampler.
    pub against_best: EqualError,
    /// Our best against the best sampler of Mitsuba's scalar variant.
    pub against_scalar: EqualError,
    /// Who was left out for pictures with values that are not finite, in words.
    #[serde(default)]
    pub left_out: Vec<String>,
}

impl Race {
    /// Compares; `None` without ours, without Mitsuba's scalar variant, and where a contender's pictures have no noise or took no time, so
    /// that there is no error to reach.
    pub(super) fn new(contenders: Vec<Contender>) -> Option<Self> {
        let is_sound = |one: &Contender| one.seconds > 0.0 && one.relative_mse > 0.0 && one.relative_mse.is_finite();
        if !contenders.iter().all(is_sound) {
            return None;
        }
        // Least seconds to any error.
        let best = |wanted: &dyn Fn(&Contender) -> bool| {
            let cost = |i: &usize| contenders[*i].seconds_to(1.0);
            let all = (0..contenders.len()).filter(|i| wanted(&contenders[*i]));
            all.min_by(|a, b| cost(a).total_cmp(&cost(b)))
        };
        let ours = best(&Contender::is_ours)?;
        let against = |theirs: usize| {
            let (a, b) = (&contenders[ours], &contenders[theirs]);
            let error = a.relative_mse;
            let (our_seconds, their_seconds) = (a.seconds_to(error), b.seconds_to(error));
            let ratio = their_seconds / our_seconds;
            EqualError {
                ours,
                theirs,
                error,
                our_seconds,
                their_seconds,
                ratio,
                ratio_error: ratio * a.uncertainty().hypot(b.uncertainty()),
                cpu_ratio: (b.cpu_seconds_to(error).zip(a.cpu_seconds_to(error)))
                    .filter(|(_, ours)| *ours > 0.0)
                    .map(|(theirs, ours)| theirs / ours),
            }
        };
        let against_best = against(best(&|one| !one.is_ours())?);
        let against_scalar = against(best(&|one| one.variant() == Variant::Scalar.name())?);
        Some(Self {
            contenders,
            against_best,
            against_scalar,
            left_out: Vec::new(),
        })
    }

    /// Whether Mitsuba's LLVM variant took part.
    pub fn has_llvm(&self) -> bool {
        self.contenders.iter().any(|one| one.variant() == Variant::Llvm.name())
    }

    /// Mitsuba's best in words, which say where its LLVM variant was not measured.
    pub fn their_best(&self) -> String {
        let name = self.pair(&self.against_best)[1].name();
        if self.has_llvm() {
            return name;
        }
        format!("{name} (LLVM variant not measured)")
    }

    /// Relative MSE of our best contender over the least of Mitsuba's, and its standard error: at equal samples, whatever they cost.
    pub fn error_at_equal_samples(&self) -> [f64; 2] {
        let ours = &self.contenders[self.against_best.ours];
        let theirs = self.contenders.iter().filter(|one| !one.is_ours());
        let least = theirs.min_by(|a, b| a.relative_mse.total_cmp(&b.relative_mse));
        let theirs = least.unwrap_or(&self.contenders[self.against_best.theirs]);
        let ratio = ours.relative_mse / theirs.relative_mse;
        let part = |one: &Contender| one.relative_mse_error / one.relative_mse;
        [ratio, ratio * part(ours).hypot(part(theirs))]
    }

    /// The two of a comparison, ours first.
    pub fn pair(&self, of: &EqualError) -> [&Contender; 2] {
        [&self.contenders[of.ours], &self.contenders[of.theirs]]
    }
}

/// What the turns of one contender gave.
#[derive(Default)]
struct Turns {
    /// Of each turn's pictures.
    seconds: Vec<Vec<f64>>,
    cpu_seconds: Vec<f64>,
    pictures: Vec<Vec<f32>>,
}

/// Standard error of the median of all turns' seconds. Pictures of one turn share its disturbances, so turns count, where there are several.
fn seconds_error(turns: &[Vec<f64>]) -> f64 {
    let values = match turns {
        [one] => one.clone(),
        several => several.iter().cloned().map(median).collect(),
    };
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    MEDIAN_OVER_MEAN * (squares / (count - 1.0) / count).sqrt()
}

impl Turns {
    fn contender(self, renderer: &str, sampler: &str, paths: f64, reference: &[f32]) -> Option<Contender> {
        let spread = spread::measure(&self.pictures, reference)?;
        let seconds_error = seconds_error(&self.seconds);
        let seconds = median(self.seconds.concat());
        Some(Contender {
            renderer: renderer.into(),
            sampler: sampler.into(),
            pictures: self.pictures.len(),
            seconds,
            seconds_error: Some(seconds_error),
            cpu_seconds: Some(median(self.cpu_seconds)).filter(|seconds| seconds.is_finite()),
            paths_per_second: paths / seconds,
            relative_mse: spread.relative_mse,
            relative_mse_error: spread.standard_error,
        })
    }

    /// One more turn of this engine. A picture counts from clearing the film until its values are in the host's memory.
    fn ours(&mut self, tracer: &mut PathTracer, first_seed: u32, options: &AgreementOptions) -> Result<()> {
        let processor = cpu_seconds();
        let mut seconds = Vec::new();
        for index in 0..options.timing_pictures {
            let (picture, time) = timed(|| {
                tracer.restart(first_seed.wrapping_add(index))?;
                tracer.render(options.timing_samples)?;
                tracer.picture()
            });
            seconds.push(time);
            self.pictures.push(picture?.0.main_layer()?.values().to_vec());
        }
        self.seconds.push(seconds);
        let spent = processor.zip(cpu_seconds()).map(|(before, after)| after - before);
        self.cpu_seconds
            .extend(spent.map(|spent| spent / f64::from(options.timing_pictures)));
        Ok(())
    }
}

/// What is raced on.
pub(super) struct RaceSetup<'a> {
    pub(super) gpu: &'a Gpu,
    pub(super) scene: Arc<GpuScene>,
    pub(super) camera: &'a Camera,
    /// With whom, and how, in Mitsuba.
    pub(super) contenders: &'static [(Integrator, &'static str)],
    pub(super) peer: &'a Peer<'a>,
    /// The scene as exported.
    pub(super) exported: &'a Path,
    /// Whether Mitsuba's LLVM variant runs here.
    pub(super) has_llvm: bool,
    /// The converged picture that weighs the errors.
    pub(super) reference: &'a [f32],
}

/// Lets all contenders render in turns.
pub(super) fn run(setup: &RaceSetup<'_>, options: &AgreementOptions, watch: &dyn Watch) -> Result<Option<Race>, Fault> {
    let go_on = || if watch.stopped() { Err(Fault::Stopped) } else { Ok(()) };
    let size = [options.size; 2];
    let samplers = [(SamplerKind::Sobol, "sobol"), (SamplerKind::Pcg, "pcg")];
    let mut ours = Vec::new();
    for (sampler, name) in samplers {
        let settings = PathTracerSettings {
            sampler,
            ..super::settings(options)
        };
        let mut tracer = PathTracer::new(setup.gpu, setup.scene.clone(), setup.camera, size, settings)?;
        // The first picture compiles the kernels, as LLVM's does.
        tracer.render(options.timing_samples)?;
        tracer.picture()?;
        ours.push((name, tracer, Turns::default()));
    }
    let variants: &[Variant] = if setup.has_llvm {
        &[Variant::Scalar, Variant::Llvm]
    } else {
        &[Variant::Scalar]
    };
    let mut theirs = Vec::new();
    for variant in variants {
        for (integrator, sampler) in setup.contenders {
            theirs.push((*variant, *integrator, *sampler, Turns::default()));
        }
    }
    let mut left_out = Vec::new();
    for round in 0..options.timing_rounds {
        // Past the converged pictures' seeds; one more a turn for the picture that compiles.
        let first_seed = (options.seed)
            .wrapping_add(options.passes + 1)
            .wrapping_add(round * (options.timing_pictures + 1));
        for (_, tracer, turns) in &mut ours {
            go_on()?;
            turns.ours(tracer, first_seed, options)?;
        }
        let mut still_in = Vec::new();
        for (variant, integrator, sampler, mut turns) in theirs {
            go_on()?;
            let request = Request {
                scene: setup.exported,
                name: "timed",
                variant,
                sampler,
                integrator,
                passes: options.timing_pictures,
                samples: options.timing_samples,
                seed: first_seed,
                each: true,
            };
            match setup.peer.render(&request, watch) {
                Ok(timed) => {
                    turns.seconds.push(timed.seconds_each);
                    turns.cpu_seconds.push(timed.cpu_seconds_each);
                    turns.pictures.extend(timed.pictures);
                    still_in.push((variant, integrator, sampler, turns));
                }
                // There is no error to reach for a picture with holes.
                Err(Fault::NotFinite(cause)) => left_out.push(cause),
                Err(other) => return Err(other),
            }
        }
        theirs = still_in;
    }
    let paths = f64::from(options.size).powi(2) * f64::from(options.timing_samples);
    let ours = ours
        .into_iter()
        .map(|(sampler, _, turns)| turns.contender(OURS, sampler, paths, setup.reference));
    let theirs = theirs.into_iter().map(|(variant, integrator, sampler, turns)| {
        let renderer = match integrator {
            Integrator::Path => variant.name().to_owned(),
            _ => format!("{} {}", variant.name(), integrator.name()),
        };
        turns.contender(&renderer, sampler, paths, setup.reference)
    });
    let contenders: Option<Vec<_>> = ours.chain(theirs).collect();
    let contenders = contenders.ok_or_else(|| Error::Picture {
        path: setup.exported.display().to_string(),
        cause: "the timed pictures have different sizes".into(),
    })?;
    let race = Race::new(contenders);
    Ok(race.map(|race| Race { left_out, ..race }))
}

/// Processor seconds of this process so far, all threads; `None` where the system does not say.
fn cpu_seconds() -> Option<f64> {
    /// Clock ticks per second that Linux reports to programs.
    const TICKS: f64 = 100.0;
    /// User and system time, counted behind the program's name.
    const FIELDS: std::ops::RangeInclusive<usize> = 11..=12;
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks: Option<Vec<f64>> = fields.get(FIELDS)?.iter().map(|field| field.parse().ok()).collect();
    Some(ticks?.iter().sum::<f64>() / TICKS)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A contender that nobody has run.
    pub(in super::super) fn made_up(renderer: &str, sampler: &str, seconds: f64, relative_mse: f64) -> Contender {
        Contender {
            renderer: renderer.into(),
            sampler: sampler.into(),
            pictures: 6,
            seconds,
            seconds_error: Some(0.04 * seconds),
            cpu_seconds: Some(2.0 * seconds),
            paths_per_second: 1e6 / seconds,
            relative_mse,
            relative_mse_error: 0.03 * relative_mse,
        }
    }

    /// Ours needs 2 · 0.5, Mitsuba's best 0.5 · 1 and its scalar variant 2 · 1.5.
    pub(in super::super) fn made_up_race() -> Vec<Contender> {
        vec![
            made_up("clerestory", "sobol", 2.0, 0.5),
            made_up("clerestory", "pcg", 1.9, 1.0),
            made_up("scalar_rgb", "independent", 2.0, 1.5),
            made_up("scalar_rgb", "multijitter", 4.0, 1.0),
            made_up("llvm_ad_rgb", "independent", 0.5, 1.0),
            made_up("llvm_ad_rgb", "multijitter", 0.7, 0.8),
        ]
    }

    #[test]
    fn the_best_of_both_sides_are_compared_at_our_error() {
        let race = Race::new(made_up_race()).unwrap();
        let best = race.against_best;
        assert_eq!((best.ours, best.theirs, race.against_scalar.theirs), (0, 4, 2));
        assert_eq!((best.error, best.our_seconds, best.their_seconds), (0.5, 2.0, 1.0));
        assert_eq!((best.ratio, best.cpu_ratio), (0.5, Some(0.5)));
        // 3 % of the errors and 4 % of the seconds are 5 % on either side.
        assert!((best.ratio_error - 0.5 * 0.05 * 2.0f64.sqrt()).abs() < 1e-15);
        assert_eq!(race.against_scalar.ratio, 3.0);
        assert_eq!(race.pair(&best)[1].sampler, "independent");
        // Beside the least error, which is another contender's, with 3 % on either side.
        let [samples, error] = race.error_at_equal_samples();
        assert_eq!(samples, 0.5 / 0.8);
        assert!((error - samples * 0.03 * 2.0f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn without_noise_or_without_one_side_there_is_no_comparison() {
        let all = made_up_race();
        assert_eq!(Race::new(all[..2].to_vec()), None);
        assert_eq!(Race::new(all[2..].to_vec()), None);
        let without_llvm = Race::new(all[..4].to_vec()).unwrap();
        assert_eq!(without_llvm.against_best, without_llvm.against_scalar);
        assert!(!without_llvm.has_llvm() && without_llvm.their_best().contains("not measured"));
        let mut silent = all;
        silent[3].relative_mse = 0.0;
        assert_eq!(Race::new(silent), None);
    }

    #[test]
    fn a_lead_within_two_standard_errors_is_undecided_either_way() {
        let lead = |ratio: f64, relative_error: f64| {
            let best = Race::new(made_up_race()).unwrap().against_best;
            let ratio_error = relative_error * ratio;
            EqualError {
                ratio,
                ratio_error,
                ..best
            }
            .lead()
        };
        // ln 1.25 = 0.223.
        assert_eq!(lead(1.25, 0.11), Lead::Faster);
        assert_eq!(lead(1.25, 0.12), Lead::Undecided);
        assert_eq!(lead(0.8, 0.11), Lead::Slower);
        assert_eq!(lead(0.8, 0.12), Lead::Undecided);
        assert_eq!(lead(1.25, f64::NAN), Lead::Undecided);
    }

    #[test]
    fn the_spread_of_seconds_is_that_between_turns() {
        // Medians 1, 2, 3: deviation 1; the spread within a turn does not matter.
        let turns = [vec![0.0, 2.0], vec![2.0, 2.0], vec![3.0]];
        let expected = (std::f64::consts::FRAC_PI_2 / 3.0).sqrt();
        assert!((seconds_error(&turns) - expected).abs() < 1e-13);
        assert!((seconds_error(&[vec![1.0, 3.0, 2.0]]) - expected).abs() < 1e-13);
    }

    #[test]
    fn turns_become_a_contender_by_medians_and_spread() {
        let turns = |pictures| Turns {
            seconds: vec![vec![3.0, 1.0, 2.0]],
            cpu_seconds: vec![],
            pictures,
        };
        let pictures = vec![vec![1.0], vec![2.0], vec![3.0]];
        let one = turns(pictures).contender("r", "s", 10.0, &[3.0]).unwrap();
        assert_eq!((one.seconds, one.cpu_seconds, one.paths_per_second), (2.0, None, 5.0));
        assert!((one.relative_mse - 1.0 / 9.09).abs() < 1e-15);
        assert_eq!(one.pictures, 3);
        assert_eq!(turns(vec![vec![1.0]; 2]).contender("r", "s", 10.0, &[3.0]), None);
    }
}
