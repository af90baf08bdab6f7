//! Phase functions: are they densities, do they have their mean cosine, do samples follow them?
//!
//! Oracles: Gauss–Legendre quadrature graded towards both poles, and the closed form of each cumulative distribution.

use std::f64::consts::TAU;

use clerestory::Result;
use clerestory::transport::phase::{
    henyey_greenstein, henyey_greenstein_sample, rayleigh_phase, rayleigh_phase_sample, schlick_phase,
    schlick_phase_mean_cosine, schlick_phase_sample,
};
use clerestory_hard_cases::chi_square::{chi_square, chi_square_z};

use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, rows, z_most};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds_once;
use crate::experiments::measures::errors::{Errors, greatest};
use crate::random::Random;

/// Nodes and weights of the five-point rule on [-1, 1].
const GAUSS: [(f64, f64); 5] = [
    (0.0, 128.0 / 225.0),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    (0.906_179_845_938_664, 0.236_926_885_056_189_08),
];
const PANELS: u32 = 512;
/// e^−36 is below what f64 holds beside one.
const DEPTH: f64 = 36.0;
/// What the function is evaluated at in an integral.
const VALUES: f64 = 2.0 * PANELS as f64 * GAUSS.len() as f64;
const CELLS: usize = 64;
/// What functions with a parameter are measured at.
const PARAMETERS: &[f64] = &[-0.99, -0.5, 0.0, 0.01, 0.5, 0.9, 0.99, 0.999];

struct Phase {
    name: &'static str,
    /// A single one stands for a function that has none.
    parameters: &'static [f64],
    density: fn(f64, f64) -> f64,
    sample: fn(f64, f64) -> f64,
    mean_cosine: fn(f64) -> f64,
    /// Probability of a smaller cosine.
    cumulative: fn(f64, f64) -> f64,
}

const HENYEY_GREENSTEIN: &str = "Henyey–Greenstein";

const PHASES: [Phase; 3] = [
    Phase {
        name: HENYEY_GREENSTEIN,
        parameters: PARAMETERS,
        density: henyey_greenstein,
        sample: henyey_greenstein_sample,
        mean_cosine: |g| g,
        cumulative: |c, g| {
            // The closed form without its difference of two numbers that are alike for small g.
            let root = ((1.0 - g) * (1.0 - g) + 2.0 * g * (1.0 - c)).sqrt();
            (1.0 - g) * (1.0 + c) / (root * (1.0 + g + root))
        },
    },
    Phase {
        name: "Schlick",
        parameters: PARAMETERS,
        density: schlick_phase,
        sample: schlick_phase_sample,
        mean_cosine: schlick_phase_mean_cosine,
        cumulative: |c, k| (1.0 + c) * (1.0 - k) / (2.0 * (1.0 - k * c)),
    },
    Phase {
        name: "Rayleigh",
        parameters: &[0.0],
        density: |c, _| rayleigh_phase(c),
        sample: |_, u| rayleigh_phase_sample(u),
        mean_cosine: |_| 0.0,
        cumulative: |c, _| 0.125 * (4.0 + c * (3.0 + c * c)),
    },
];

/// 2π∫ f(c) dc over [-1, 1], with 1 ∓ c = e^−y towards the poles.
fn over_sphere(f: impl Fn(f64) -> f64) -> f64 {
    let width = DEPTH / f64::from(PANELS);
    let mut sum = 0.0;
    for panel in 0..PANELS {
        for (node, weight) in GAUSS {
            let x = (-(f64::from(panel) + 0.5 + 0.5 * node) * width).exp();
            sum += 0.5 * width * weight * x * (f(1.0 - x) + f(x - 1.0));
        }
    }
    TAU * sum
}

/// A function, its parameter, and the seed of its samples.
type Case = (&'static Phase, f64, u32);

fn cases() -> Vec<Case> {
    let of = |phase: &'static Phase| phase.parameters.iter().map(move |parameter| (phase, *parameter));
    let all = PHASES.iter().flat_map(of).zip(0..);
    all.map(|((phase, parameter), seed)| (phase, parameter, seed)).collect()
}

rows! {
    /// A phase function with its parameter.
    struct Row = "Phase functions" by [function, parameter] {
        function: String = "function",
        parameter: f64 = "parameter",
        integral: f64 = "integral − 1",
        mean_cosine: f64 = "mean cosine: error of the closed form",
        mean_of_samples: f64 = "cosine of samples: error of the mean",
        inversion: f64 = "inversion: worst error of the probability",
        chi_square: Option<f64> = "χ² of samples, 64 cells (σ)",
        samples: u64 = "samples",
        peak: f64 = "greatest density of the cosine",
        evaluation: Repeats = "an evaluation (ns)",
        sample: Repeats = "a sample (ns)",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "the integral is 1: its error in roundings",
        Bound::AtMost(2.0),
        |row: &Row| row.integral_in_roundings().into(),
    )
    .because("one for each value of the quadrature, which ends a step of f64 before the poles")
    .in_every_form(),
    Criterion::each(
        "samples invert the distribution: the worst error in roundings",
        Bound::AtMost(8.0),
        |row: &Row| row.inversion_in_roundings().into(),
    )
    .because("a few of the probability, and of the cosine where its density is greatest")
    .in_every_form(),
    Criterion::each(
        "χ² of the samples is within a few standard deviations: their number over what chance exceeds once in a hundred runs",
        Bound::AtMost(1.0),
        |row: &Row| (row.chi_square.map_or(f64::INFINITY, f64::abs) / z_most(cases().len())).into(),
    )
    .because("by Šidák for all functions and parameters"),
];

impl Row {
    /// The error of the integral over what f64 can tell: a step in a cosine changes a probability by up to the greatest density times as much.
    fn integral_in_roundings(&self) -> f64 {
        self.integral.abs() / (f64::EPSILON * (VALUES + self.peak))
    }

    /// The inversion's worst error over what f64 can tell.
    fn inversion_in_roundings(&self) -> f64 {
        self.inversion / (f64::EPSILON * (1.0 + self.peak))
    }

    /// All but times.
    fn of((phase, parameter, seed): Case, samples: u64) -> Self {
        let density = |c| (phase.density)(c, parameter);
        let sample = |u| (phase.sample)(parameter, u);
        let cumulative = |c| (phase.cumulative)(c, parameter);
        let mean = over_sphere(|c| c * density(c));
        let (mut cosines, mut inversion) = (0.0, Errors::default());
        for i in 0..samples {
            let u = (i as f64 + 0.5) / samples as f64;
            let c = sample(u);
            cosines += c;
            let p = cumulative(c);
            inversion.add((p - u).abs().min((1.0 - p - u).abs()));
        }
        let mut random = Random::new(seed);
        let mut counts = [0.0; CELLS];
        for _ in 0..samples {
            let cell = (cumulative(sample(random.unit())) * CELLS as f64) as usize;
            counts[cell.min(CELLS - 1)] += 1.0;
        }
        let chi_square = chi_square(&counts, &[samples as f64 / CELLS as f64; CELLS]);
        Self {
            function: phase.name.into(),
            parameter,
            integral: over_sphere(density) - 1.0,
            mean_cosine: (phase.mean_cosine)(parameter) - mean,
            mean_of_samples: cosines / samples as f64 - mean,
            inversion: inversion.worst(),
            chi_square: chi_square.map(|(statistic, degrees)| chi_square_z(statistic, degrees)),
            samples,
            // All are greatest at a pole.
            peak: TAU * greatest([1.0, -1.0].map(density)),
            ..Self::default()
        }
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let samples: u64 = context.pick(1 << 20, 4096);
        let cases = cases();
        let name = |(phase, parameter, _): &Case| format!("{} of {parameter}", phase.name);
        let mut rows = context.each(&cases, name, |case| Ok(vec![Row::of(*case, samples)]))?;
        let mut random = Random::new(0);
        let inputs: Vec<f64> = (0..samples.min(1 << 16)).map(|_| random.unit()).collect();
        let evaluations = context.in_turns(9, rows.len(), |i| {
            let (phase, parameter, _) = cases[i];
            Ok(nanoseconds_once(&inputs, |u| (phase.density)(2.0 * u - 1.0, parameter)))
        })?;
        let draws = context.in_turns(9, rows.len(), |i| {
            let (phase, parameter, _) = cases[i];
            Ok(nanoseconds_once(&inputs, |u| (phase.sample)(parameter, *u)))
        })?;
        for (row, (evaluation, draw)) in rows.iter_mut().zip(evaluations.into_iter().zip(draws)) {
            row.evaluation = Repeats(evaluation);
            row.sample = Repeats(draw);
        }
        Ok(rows)
    }

    fn findings(&self) -> Findings {
        let usual = self
            .iter()
            .find(|row| row.function == HENYEY_GREENSTEIN && row.parameter == 0.9);
        Findings::of(self, CRITERIA)
            .headline(
                "a sample of Henyey and Greenstein's function of 0.9 (ns)",
                usual.map(|row| (&row.sample).into()),
            )
            .note(format!(
                "Integrals and means by graded quadrature ({PANELS} panels of five points towards each pole). Samples: stratified ones for the \
                 mean and the inversion, as many independent ones for χ², whose deviation is standard normal when they follow their density. \
                 Rayleigh's function has no parameter."
            ))
    }
}
