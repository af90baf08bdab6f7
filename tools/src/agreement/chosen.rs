//! The technique that the planner chooses for an error, beside Mitsuba's best in the time that it takes to the same error.
//!
//! The error asked for is that of this engine's best timed picture by the path tracer. A chosen technique may have a bias, so its error is not its
//! spread: it is held against Mitsuba's converged picture, whose own variance is subtracted. Mitsuba's seconds to that error are
//! those of [`Race`](super::Race). The planner's pilots are not part of the picture's seconds, and stand beside them.
//! Guarantees: the errors depend on choice and seeds alone; the choice is by the clock too.

use clerestory::film::Picture;
use clerestory::gpu::Gpu;
use clerestory::plan::{Goal, plan};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::scene::Scene;
use serde_json::json;

use super::race::Race;
use super::{AgreementOptions, Fault, ROULETTE_START};
use crate::experiments::unbiased;
use crate::experiments::watch::{Watch, render};
use crate::timing::median;

/// Pictures that are timed, after one that does not count.
const PICTURES: u32 = 3;
/// Between the seeds of the planner and those of the pictures.
const SEED_STEP: u32 = 1 << 16;

/// What was chosen, and what its pictures take.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Chosen {
    /// Technique id.
    pub technique: String,
    /// What distinguishes its settings; empty for the technique's own.
    pub variant: String,
    /// The root of the relative MSE that was asked for.
    pub asked: f64,
    /// Samples per pixel.
    pub samples: u32,
    /// Seconds of the pilots.
    pub pilot_seconds: f64,
    /// Seconds of a picture, median.
    pub seconds: f64,
    /// Relative MSE of a picture, mean.
    pub relative_mse: f64,
    /// Seconds to that error of Mitsuba's best over `seconds`.
    pub ratio: f64,
    /// Its standard error, by the spread of the pictures' errors, the converged picture's noise, and that of Mitsuba's errors and seconds.
    pub ratio_error: f64,
}

/// Plans a picture for the error of our best one, and renders a few; `None` where their error is lost in the noise of the converged picture.
pub(super) fn run(
    gpu: &Gpu,
    scene: &Scene,
    race: &Race,
    converged: &Picture,
    options: &AgreementOptions,
    watch: &dyn Watch,
) -> Result<Option<Chosen>, Fault> {
    let renderer = Renderer::new(gpu, scene)?;
    let asked = race.against_best.error.sqrt();
    let base = RenderOptions {
        size: [options.size; 2],
        seed: options.seed,
        settings: json!({
            "roulette_start": ROULETTE_START,
            "multiple_scattering": false,
            "separable_masking": true,
            "adaptive": options.adaptive,
        })
        .into(),
        ..RenderOptions::default()
    };
    let goal = Goal {
        error: Some(asked),
        time: None,
    };
    let plan = plan(&renderer, &base, goal, &mut || !watch.stopped())?;
    let picture = plan.options(&base);
    let (mut errors, mut seconds) = (Vec::new(), Vec::new());
    let mut noise = 0.0;
    for index in 0..=PICTURES {
        let options = RenderOptions {
            seed: base.seed.wrapping_add(SEED_STEP + index),
            ..picture.clone()
        };
        let Some(rendered) = render(&renderer, &options, watch)? else {
            return Err(Fault::Stopped);
        };
        // The first one compiles kernels.
        if index > 0 {
            let error = unbiased::measure(&rendered.picture, converged)?;
            noise = error.reference_relative_error;
            errors.push(error.relative_mse);
            seconds.push(rendered.report.render_seconds);
        }
    }
    let seconds = median(seconds);
    let choice = plan.choice();
    Ok(beside(race, &errors, noise, seconds).map(|beside| Chosen {
        technique: choice.technique.into(),
        variant: choice.variant.into(),
        asked,
        samples: picture.spp,
        pilot_seconds: plan.pilot_seconds,
        seconds,
        relative_mse: beside.relative_mse,
        ratio: beside.ratio,
        ratio_error: beside.ratio_error,
    }))
}

/// Errors of pictures beside Mitsuba.
#[derive(Debug, PartialEq)]
struct Beside {
    relative_mse: f64,
    ratio: f64,
    ratio_error: f64,
}

/// The mean of relative MSEs, of which `noise` is the standard error that all share, and Mitsuba's seconds to it over `seconds`; `None` where it is not
/// above 0.
fn beside(race: &Race, errors: &[f64], noise: f64, seconds: f64) -> Option<Beside> {
    let count = errors.len() as f64;
    let relative_mse = errors.iter().sum::<f64>() / count;
    if !(relative_mse.is_finite() && relative_mse > 0.0) {
        return None;
    }
    let squares: f64 = errors.iter().map(|error| (error - relative_mse).powi(2)).sum();
    let error = (squares / (count - 1.0) / count).sqrt().hypot(noise);
    let theirs = race.pair(&race.against_best)[1];
    let ratio = theirs.seconds_to(relative_mse) / seconds;
    Some(Beside {
        relative_mse,
        ratio,
        ratio_error: ratio * (error / relative_mse).hypot(theirs.uncertainty()),
    })
}

#[cfg(test)]
mod tests {
    use super::super::race::tests::made_up_race;
    use super::*;

    #[test]
    fn the_ratio_is_that_of_seconds_to_the_error_that_was_reached() {
        let race = Race::new(made_up_race()).unwrap();
        let theirs = race.pair(&race.against_best)[1];
        let (error, seconds) = (0.5 * theirs.relative_mse, 0.25 * theirs.seconds);
        // Half of the error takes Mitsuba two of its pictures, which are eight of ours.
        let found = beside(&race, &[0.9 * error, error, 1.1 * error], 0.0, seconds).unwrap();
        assert!((found.ratio / 8.0 - 1.0).abs() < 1e-12, "{found:?}");
        // Deviations of a tenth: 0.1 / √3 of the mean's, beside Mitsuba's own.
        let expected = (0.1 / 3.0f64.sqrt()).hypot(theirs.uncertainty());
        assert!(
            (found.ratio_error / found.ratio / expected - 1.0).abs() < 1e-9,
            "{found:?}"
        );
        let noisier = beside(&race, &[error; 3], 0.2 * error, seconds).unwrap();
        let expected = 0.2f64.hypot(theirs.uncertainty());
        assert!(
            (noisier.ratio_error / noisier.ratio / expected - 1.0).abs() < 1e-9,
            "{noisier:?}"
        );
        assert_eq!(beside(&race, &[-error, 0.5 * error, 0.0], 0.0, seconds), None);
    }
}
