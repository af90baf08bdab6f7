//! What an automatic choice says: prediction, candidates, and what came of it beside the prediction.

use clerestory::film::Picture;
use clerestory::film::metrics::RELATIVE_MSE_OFFSET;
use clerestory::plan::{Candidate, Plan, relative_mse_by_variance};
use clerestory::render::{FrameReport, RenderOptions, Rendered};

use super::files::ErrorAgainst;
use super::summary;
use crate::failure::Outcome;
use crate::output::{self, Table};

/// The plan and what came of it.
#[derive(serde::Serialize)]
pub struct ChoiceReport<'a> {
    /// What was asked for, looked at and predicted.
    #[serde(flatten)]
    plan: &'a Plan,
    /// Seconds of pilots and picture together.
    seconds: f64,
    /// Root of the relative MSE by noise alone that the picture's own spread stands for. Stratified samples have less, those that share a map of photons
    /// more; a bias does not show in it.
    noise_by_variance: f64,
    /// Root of the relative MSE against the reference, when there is one.
    error_against_reference: Option<f64>,
}

impl<'a> ChoiceReport<'a> {
    /// What came of a plan.
    pub fn new(plan: &'a Plan, rendered: &Rendered, error: Option<&ErrorAgainst>) -> Outcome<Self> {
        Ok(Self {
            plan,
            seconds: plan.pilot_seconds + rendered.report.render_seconds,
            noise_by_variance: relative_mse_by_variance(&rendered.picture, RELATIVE_MSE_OFFSET)?.sqrt(),
            error_against_reference: error.map(|error| error.metrics.relative_mse.sqrt()),
        })
    }

    /// One line, with what the picture says of its error where there is no reference.
    pub fn text(&self, report: &FrameReport, picture: &Picture) -> String {
        let choice = self.plan.choice();
        let error = match self.error_against_reference {
            Some(error) => format!("{error:.4} against the reference"),
            None => summary::error(None, report, picture),
        };
        format!(
            "predicted: error {:.4}{}, {:.2} s; outcome: error {error}, {:.2} s, of which pilots {:.2} s ({:.0} %)",
            choice.error,
            interval(choice),
            choice.seconds + self.plan.pilot_seconds,
            self.seconds,
            self.plan.pilot_seconds,
            100.0 * self.plan.pilot_seconds / self.seconds
        )
    }
}

/// What the error lies between, in brackets.
fn interval(choice: &Candidate) -> String {
    choice.error_interval.map_or_else(String::new, |[low, high]| {
        format!(" ({low:.4} to {high:.4} in 9 of 10 cases)")
    })
}

/// Says what is going to be rendered, and returns its options.
pub fn announce(plan: &Plan, options: &RenderOptions, explain: bool) -> Outcome<RenderOptions> {
    if explain {
        output::explain(&candidates(plan));
    }
    if !plan.shortfall.is_empty() {
        output::warn(&plan.shortfall);
    }
    let choice = plan.choice();
    let parts = match choice.bias {
        Some(bias) if bias > 0.0 => format!(" (bias {bias:.4}, noise {:.4})", choice.noise),
        _ => String::new(),
    };
    output::note(&format!(
        "chosen: {}, {}, {} samples per pixel; predicted: error {:.4}{}{parts}, {:.2} s after {:.2} s of pilots ({:.0} % of the time)",
        choice.technique,
        choice.variant,
        choice.spp,
        choice.error,
        interval(choice),
        choice.seconds,
        plan.pilot_seconds,
        100.0 * plan.pilot_share
    ));
    if !choice.judged_by.is_empty() {
        output::note(&format!("bias judged by {}", choice.judged_by));
    }
    Ok(plan.options(options))
}

fn candidates(plan: &Plan) -> String {
    let heads = [
        "technique",
        "settings",
        "pilots",
        "pilot noise",
        "slope",
        "s per sample",
        "samples",
        "bias",
        "at most",
        "noise",
        "error",
        "seconds",
        "verdict",
    ];
    let mut table = Table::new(&heads, &[1, 12]);
    for (index, candidate) in plan.candidates.iter().enumerate() {
        let tried = candidate.pilot_spp > 0;
        let cell = |text: String| if tried { text } else { "-".into() };
        let share = |value: Option<f64>| match value {
            Some(value) if tried => format!("{value:.4}"),
            _ => "-".into(),
        };
        let verdict = match &candidate.reason {
            _ if index == plan.chosen => "chosen",
            reason if !reason.is_empty() => reason,
            _ if plan.goal.error.is_some() => "takes longer",
            _ => "errs more",
        };
        let verdict = if candidate.judged_by.is_empty() {
            verdict.to_owned()
        } else {
            format!("{verdict}; bias judged by {}", candidate.judged_by)
        };
        table.row([
            candidate.technique.to_owned(),
            candidate.variant.to_owned(),
            cell(match candidate.last_pilot_spp {
                0 => candidate.pilot_spp.to_string(),
                last => format!("{} + {last}", candidate.pilot_spp),
            }),
            cell(format!("{:.4}", candidate.pilot_noise)),
            cell(format!("{:.2}", -candidate.slope / 2.0)),
            cell(format!("{:.4}", candidate.seconds_a_sample)),
            cell(candidate.spp.to_string()),
            share(candidate.bias),
            share(candidate.bias_at_most),
            cell(format!("{:.4}", candidate.noise)),
            cell(format!("{:.4}", candidate.error)),
            cell(format!("{:.2}", candidate.seconds)),
            verdict,
        ]);
    }
    let share = format!(
        "pilots: {:.2} s, {:.0} % of all that is predicted; above 5 s those after the first rounds are kept to {:.0} %\n",
        plan.pilot_seconds,
        100.0 * plan.pilot_share,
        100.0 * plan.pilot_share_limit
    );
    table.text() + &share
}
