//! Sums of many samples: pairs of f32 as the film keeps them, beside plain, compensated and double-precision sums.
//!
//! Oracle: the same samples added in numbers of 106 bits.

use clerestory::Result;
use clerestory::film::Accumulator;
use clerestory::film::accumulate::{TwoFloat, two_float_add};

use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds;
use crate::experiments::measures::wide::Wide;
use crate::experiments::table::Table;
use crate::random::Random;

fn plain(samples: &[f32]) -> f64 {
    samples.iter().fold(0.0_f32, |sum, x| sum + x).into()
}

/// W. Kahan, "Further Remarks on Reducing Truncation Errors", 1965.
fn kahan(samples: &[f32]) -> f64 {
    let (mut sum, mut lost) = (0.0_f32, 0.0_f32);
    for x in samples {
        let y = x - lost;
        let t = sum + y;
        lost = (t - sum) - y;
        sum = t;
    }
    sum.into()
}

fn pairs(samples: &[f32]) -> f64 {
    samples
        .iter()
        .fold(TwoFloat::ZERO, |sum, x| two_float_add(sum, *x))
        .to_f64()
}

fn double(samples: &[f32]) -> f64 {
    samples.iter().map(|x| f64::from(*x)).sum()
}

/// Variance of the samples from f32 sums of themselves and of their squares.
fn plain_variance(samples: &[f32]) -> f64 {
    let (mut sum, mut squares) = (0.0_f32, 0.0_f32);
    for x in samples {
        sum += x;
        squares += x * x;
    }
    let n = samples.len() as f64;
    (f64::from(squares) - f64::from(sum).powi(2) / n) / (n - 1.0)
}

fn pair_variance(samples: &[f32]) -> f64 {
    let mut sums = Accumulator::default();
    samples.iter().for_each(|x| sums.add(*x));
    sums.variance()
}

fn exact_sum(samples: &[f32]) -> Wide {
    samples
        .iter()
        .fold(Wide::ZERO, |sum, x| sum + Wide::from(f64::from(*x)))
}

fn exact_variance(samples: &[f32]) -> f64 {
    let n = Wide::from(samples.len() as f64);
    let mean = exact_sum(samples) / n;
    let squares = samples.iter().fold(Wide::ZERO, |sum, x| {
        let rest = Wide::from(f64::from(*x)) - mean;
        sum + rest * rest
    });
    (squares / (n - Wide::from(1.0))).round()
}

fn samples(case: &str, count: usize) -> Vec<f32> {
    let mut random = Random::new(8);
    let mut draw = |i: usize| match case {
        "equal, 0.1" => 0.1,
        "uniform" => random.unit(),
        "heavy tail" => random.magnitude(1e-6, 1e6),
        "mean 1000 times the deviation" => 1000.0 + random.range(-1.0, 1.0) * 3_f64.sqrt(),
        // Large ones that cancel, small ones that count.
        _ => [1e6, random.unit(), -1e6, random.unit()][i % 4],
    };
    (0..count).map(|i| draw(i) as f32).collect()
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let counts: &[usize] = if context.smoke { &[1000] } else { &[1 << 20, 10_000_000] };
    let mut sums = Table::new(
        "Sums",
        &["samples", "count", "sum", "relative error", "bytes", "ns an addition"],
    );
    let mut variances = Table::new(
        "Variances of samples",
        &["samples", "count", "sums", "relative error", "bytes", "ns a sample"],
    );
    type Function = fn(&[f32]) -> f64;
    let forms: [(&str, Function, u64); 4] = [
        ("f32", plain, 4),
        ("f32, Kahan", kahan, 8),
        ("pairs of f32 (engine)", pairs, 8),
        ("f64", double, 8),
    ];
    let variance_forms: [(&str, Function, u64); 2] =
        [("f32", plain_variance, 8), ("pairs of f32 (engine)", pair_variance, 16)];
    for case in [
        "equal, 0.1",
        "uniform",
        "heavy tail",
        "mean 1000 times the deviation",
        "cancelling",
    ] {
        for &count in counts {
            let samples = samples(case, count);
            let time = |function: Function| {
                nanoseconds(context.smoke, std::slice::from_ref(&samples), |all| function(all)) / count as f64
            };
            let exact = exact_sum(&samples);
            for (form, function, bytes) in forms {
                let error = (Wide::from(function(&samples)) - exact) / exact;
                sums.row([
                    case.into(),
                    (count as u64).into(),
                    form.into(),
                    error.round().into(),
                    bytes.into(),
                    time(function).into(),
                ]);
            }
            if case == "uniform" || case.starts_with("mean") {
                let exact = exact_variance(&samples);
                for (form, function, bytes) in variance_forms {
                    variances.row([
                        case.into(),
                        (count as u64).into(),
                        form.into(),
                        (function(&samples) / exact - 1.0).into(),
                        bytes.into(),
                        time(function).into(),
                    ]);
                }
            }
        }
    }
    sums.note("Against sums of 106 bits; one thread of the processor, one sum after the other. Bytes: one sum's.");
    variances.note("From the sum and the sum of squares, finished in f64; against two passes in 106 bits.");
    Ok(vec![sums, variances])
}
