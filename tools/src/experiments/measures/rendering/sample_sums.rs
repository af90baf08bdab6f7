//! Sums of many samples: pairs of f32 as the film keeps them, beside plain, compensated and double-precision sums.
//!
//! Oracle: the same samples added in numbers of 106 bits.

use clerestory::Result;

use super::sums::{
    BY_ROUNDING, CASES, EQUAL, Form, KURTOSIS, OF_VARIANCE, PAIRS, SUMS, VARIANCES, exact_sum, exact_variance, samples,
};
use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, largest, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds_once;
use crate::experiments::measures::wide::Wide;

rows! {
    /// A form on samples.
    struct Sum = "Sums" by [samples, count, form] {
        samples: String = "samples",
        count: u64 = "count",
        form: String = "sum",
        error: f64 = "relative error",
        of_noise: Option<f64> = "error over the samples' noise",
        bytes: u64 = "bytes",
        time: Repeats = "an addition (ns)",
    }
}

rows! {
    /// A form on samples.
    struct Variance = "Variances of samples" by [samples, count, form] {
        samples: String = "samples",
        count: u64 = "count",
        form: String = "sums",
        error: f64 = "relative error",
        of_noise: f64 = "error over the samples' noise",
        bytes: u64 = "bytes",
        time: Repeats = "a sample (ns)",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    sums: Vec<Sum>,
    variances: Vec<Variance>,
}

/// Errors over the noise that are far below it.
const FAR_BELOW: Bound = Bound::AtMost(0.01);
const HUNDREDTH: &str = "far is a hundredth";
/// Relative error of a number that is rounded to f32, at most.
const ROUNDING: f64 = 0.5 * f32::EPSILON as f64;

const OF_SUMS: &[Criterion<Sum>] = &[
    Criterion::each(
        "the error of a sum is far below the noise of the samples: over it",
        FAR_BELOW,
        |row: &Sum| row.of_noise.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.is_the_engines() && !row.is_by_rounding())
    .because(HUNDREDTH)
    .in_every_form(),
    Criterion::each(
        "the error of a sum of equal or of cancelling samples is no larger than rounding the sum to f32 makes: over it",
        Bound::AtMost(1.0),
        |row: &Sum| (row.error.abs() / ROUNDING).into(),
    )
    .among(|row| row.is_the_engines() && row.is_by_rounding())
    .because("equal samples have no noise, and that of cancelling ones hides what any sum loses")
    .in_every_form(),
    Criterion::each("a sum has few bytes", Bound::AtMost(8.0), |row: &Sum| row.bytes.into())
        .among(Sum::is_the_engines)
        .because("as many as f64")
        .in_every_form(),
];

const OF_VARIANCES: &[Criterion<Variance>] = &[Criterion::each(
    "the error of a variance is far below the noise of the samples: over it",
    FAR_BELOW,
    |row: &Variance| row.of_noise.into(),
)
.among(|row| row.form == PAIRS)
.because(HUNDREDTH)];

impl Sum {
    fn is_the_engines(&self) -> bool {
        self.form == PAIRS
    }

    fn is_by_rounding(&self) -> bool {
        BY_ROUNDING.contains(&self.samples.as_str())
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let counts = context.pick(&[1 << 20, 10_000_000][..], &[1000]);
        let cases: Vec<(&str, usize)> = CASES
            .iter()
            .flat_map(|case| counts.iter().map(|count| (*case, *count)))
            .collect();
        let name = |(case, count): &(&str, usize)| format!("{case}, {count}");
        let mut variances = Vec::new();
        let sums = context.each(&cases, name, |(case, count)| {
            let samples = samples(case, *count);
            let variance = exact_variance(&samples);
            if OF_VARIANCE.contains(case) {
                variances.extend(variances_of(context, case, &samples, variance)?);
            }
            sums_of(context, case, &samples, variance)
        })?;
        Ok(Self { sums, variances })
    }

    fn findings(&self) -> Findings {
        Findings::of(&self.sums, OF_SUMS)
            .headline(
                "the worst relative error of a sum in pairs of f32",
                largest(&self.sums, Sum::is_the_engines, |row| row.error.abs()),
            )
            .note(
                "Against sums of 106 bits; the noise is the standard deviation of the sum of so many samples, where they differ. One thread of \
                 the processor, one sum after the other. Bytes: one sum's.",
            )
            .and(Findings::of(&self.variances, OF_VARIANCES))
            .note(
                "From the sum and the sum of squares, finished in f64; against two passes in 106 bits. The noise is that of the variance of so \
                 many uniform numbers.",
            )
    }
}

/// Times of forms, ns per sample.
fn times(context: &Context<'_>, forms: &[Form], samples: &[f32]) -> Result<Vec<Repeats>> {
    let times = context.in_turns(9, forms.len(), |i| {
        let all = nanoseconds_once(&[samples], |samples| (forms[i].1)(samples));
        Ok(all / samples.len() as f64)
    })?;
    Ok(times.into_iter().map(Repeats).collect())
}

fn sums_of(context: &Context<'_>, case: &str, samples: &[f32], variance: f64) -> Result<Vec<Sum>> {
    let exact = exact_sum(samples);
    let noise = (variance * samples.len() as f64).sqrt();
    let times = times(context, &SUMS, samples)?;
    let of = |((form, function, bytes), time): (Form, Repeats)| {
        let error = Wide::from(function(samples)) - exact;
        Sum {
            samples: case.into(),
            count: samples.len() as u64,
            form: form.into(),
            error: (error / exact).round(),
            of_noise: (case != EQUAL).then(|| error.round().abs() / noise),
            bytes,
            time,
        }
    };
    Ok(SUMS.into_iter().zip(times).map(of).collect())
}

fn variances_of(context: &Context<'_>, case: &str, samples: &[f32], exact: f64) -> Result<Vec<Variance>> {
    let noise = ((KURTOSIS - 1.0) / samples.len() as f64).sqrt();
    let times = times(context, &VARIANCES, samples)?;
    let of = |((form, function, bytes), time): (Form, Repeats)| {
        let error = function(samples) / exact - 1.0;
        Variance {
            samples: case.into(),
            count: samples.len() as u64,
            form: form.into(),
            error,
            of_noise: error.abs() / noise,
            bytes,
            time,
        }
    };
    Ok(VARIANCES.into_iter().zip(times).map(of).collect())
}
