//! Ways to add up many samples, their oracle, and samples to add up.

use clerestory::film::Accumulator;
use clerestory::film::accumulate::{TwoFloat, two_float_add};

use crate::experiments::measures::wide::Wide;
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

/// By numbers of 106 bits.
pub fn exact_sum(samples: &[f32]) -> Wide {
    samples
        .iter()
        .fold(Wide::ZERO, |sum, x| sum + Wide::from(f64::from(*x)))
}

/// By two passes in numbers of 106 bits.
pub fn exact_variance(samples: &[f32]) -> f64 {
    let n = Wide::from(samples.len() as f64);
    let mean = exact_sum(samples) / n;
    let squares = samples.iter().fold(Wide::ZERO, |sum, x| {
        let rest = Wide::from(f64::from(*x)) - mean;
        sum + rest * rest
    });
    (squares / (n - Wide::from(1.0))).round()
}

/// Samples without noise.
pub const EQUAL: &str = "equal, 0.1";
const UNIFORM: &str = "uniform";
const HEAVY: &str = "heavy tail";
const NARROW: &str = "mean 1000 times the deviation";
/// Samples whose noise is far larger than what any sum of them loses.
const CANCELLING: &str = "cancelling";
/// Kinds of samples.
pub const CASES: [&str; 5] = [EQUAL, UNIFORM, HEAVY, NARROW, CANCELLING];
/// Those whose noise is no measure of a sum's error: there is none, or it hides all errors.
pub const BY_ROUNDING: [&str; 2] = [EQUAL, CANCELLING];
/// Those whose variances are measured too: both uniform.
pub const OF_VARIANCE: [&str; 2] = [UNIFORM, NARROW];
/// Fourth moment over the squared variance of uniform numbers.
pub const KURTOSIS: f64 = 1.8;

/// Samples of a kind.
pub fn samples(case: &str, count: usize) -> Vec<f32> {
    let mut random = Random::new(8);
    let mut draw = |i: usize| match case {
        EQUAL => 0.1,
        UNIFORM => random.unit(),
        HEAVY => random.magnitude(1e-6, 1e6),
        NARROW => 1000.0 + random.range(-1.0, 1.0) * 3_f64.sqrt(),
        // Large ones that cancel, small ones that count.
        _ => [1e6, random.unit(), -1e6, random.unit()][i % 4],
    };
    (0..count).map(|i| draw(i) as f32).collect()
}

/// A way to add up, and the bytes that it keeps.
pub type Form = (&'static str, fn(&[f32]) -> f64, u64);

const fn bytes_of<T>() -> u64 {
    size_of::<T>() as u64
}

/// The engine's.
pub const PAIRS: &str = "pairs of f32 (engine)";
/// Ways to sums.
pub const SUMS: [Form; 4] = [
    ("f32", plain, bytes_of::<f32>()),
    ("f32, Kahan", kahan, bytes_of::<[f32; 2]>()),
    (PAIRS, pairs, bytes_of::<TwoFloat>()),
    ("f64", double, bytes_of::<f64>()),
];
/// Ways to variances, of a sum and a sum of squares.
pub const VARIANCES: [Form; 2] = [
    ("f32", plain_variance, bytes_of::<[f32; 2]>()),
    (PAIRS, pair_variance, bytes_of::<[TwoFloat; 2]>()),
];
