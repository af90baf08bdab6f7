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

use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds;
use crate::experiments::table::Table;
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

const PHASES: [Phase; 3] = [
    Phase {
        name: "Henyey–Greenstein",
        parameters: PARAMETERS,
        density: henyey_greenstein,
        sample: henyey_greenstein_sample,
        mean_cosine: |g| g,
        cumulative: |c, g| {
            if g == 0.0 {
                return 0.5 * (1.0 + c);
            }
            let root = ((1.0 - g) * (1.0 - g) + 2.0 * g * (1.0 - c)).sqrt();
            (1.0 - g * g) / (2.0 * g) * (1.0 / root - 1.0 / (1.0 + g))
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

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let samples: u64 = if context.smoke { 4096 } else { 1 << 20 };
    let mut table = Table::new(
        "Phase functions",
        &[
            "function",
            "parameter",
            "integral − 1",
            "mean cosine: error of the closed form",
            "cosine of samples: error of the mean",
            "inversion: worst error of the probability",
            "χ² of samples, 64 cells (σ)",
            "ns an evaluation",
            "ns a sample",
        ],
    );
    for phase in &PHASES {
        for &parameter in phase.parameters {
            let density = |c| (phase.density)(c, parameter);
            let mean = over_sphere(|c| c * density(c));
            let sample = |u| (phase.sample)(parameter, u);
            let (mut cosines, mut worst) = (0.0, 0.0_f64);
            for i in 0..samples {
                let u = (i as f64 + 0.5) / samples as f64;
                let c = sample(u);
                cosines += c;
                let p = (phase.cumulative)(c, parameter);
                worst = worst.max((p - u).abs().min((1.0 - p - u).abs()));
            }
            let mut random = Random::new(table.rows.len() as u32);
            let mut counts = [0.0; CELLS];
            let inputs: Vec<f64> = (0..samples).map(|_| random.unit()).collect();
            for u in &inputs {
                let cell = ((phase.cumulative)(sample(*u), parameter) * CELLS as f64) as usize;
                counts[cell.min(CELLS - 1)] += 1.0;
            }
            let chi_square = chi_square(&counts, &[samples as f64 / CELLS as f64; CELLS]);
            let timed = &inputs[..inputs.len().min(1 << 16)];
            table.row([
                phase.name.into(),
                parameter.into(),
                (over_sphere(density) - 1.0).into(),
                ((phase.mean_cosine)(parameter) - mean).into(),
                (cosines / samples as f64 - mean).into(),
                worst.into(),
                chi_square
                    .map_or(f64::NAN, |(statistic, degrees)| chi_square_z(statistic, degrees))
                    .into(),
                nanoseconds(context.smoke, timed, |u| density(2.0 * u - 1.0)).into(),
                nanoseconds(context.smoke, timed, |u| sample(*u)).into(),
            ]);
        }
    }
    table.note(format!(
        "Integrals and means by graded quadrature ({PANELS} panels of five points towards each pole). Samples: {samples} stratified ones for the \
         mean and the inversion, as many independent ones for χ², whose deviation is standard normal when they follow their density. Rayleigh's \
         function has no parameter."
    ));
    Ok(vec![table])
}
