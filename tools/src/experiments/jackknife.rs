//! The delete-one jackknife over independent repeats: intervals of whatever is computed from them. Source: Efron and Stein, *The Jackknife Estimate of
//! Variance*, 1981.
//!
//! Whatever the numbers of one repeat have in common (a seed, whose samples recur in larger budgets and in other variants) is left out together.
//! Guarantees: deterministic; what has no number without one of the repeats, or has a single one, lies in an interval without ends.

use super::findings::Measured;

/// Student's t with 1, 2, … 30 degrees of freedom: within ± these it lies with probability 95 % (Abramowitz and Stegun, *Handbook of
/// Mathematical Functions*, table 26.10).
const STUDENT_95: [f64; 30] = [
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228, 2.201, 2.179, 2.160, 2.145, 2.131, 2.120,
    2.110, 2.101, 2.093, 2.086, 2.080, 2.074, 2.069, 2.064, 2.060, 2.056, 2.052, 2.048, 2.045, 2.042,
];

/// How many standard errors from so many repeats a number may lie off by chance; beyond the table its last entry, which is a little wide.
fn student(repeats: usize) -> f64 {
    STUDENT_95[repeats.saturating_sub(2).min(STUDENT_95.len() - 1)]
}

/// The mean of all values but one.
pub fn mean_without(values: &[f64], left_out: Option<usize>) -> f64 {
    let kept = values
        .iter()
        .enumerate()
        .filter(|(repeat, _)| Some(*repeat) != left_out);
    let (sum, count) = kept.fold((0.0, 0), |(sum, count), (_, value)| (sum + value, count + 1));
    sum / f64::from(count.max(1))
}

/// The standard error of a number by what it is without each of the repeats; `None` for fewer than two, or where one of these is not finite.
pub fn standard_error(without: &[f64]) -> Option<f64> {
    let (n, mean) = (without.len() as f64, mean_without(without, None));
    let squares: f64 = without.iter().map(|value| (value - mean).powi(2)).sum();
    let error = ((n - 1.0) / n * squares).sqrt();
    (without.len() >= 2 && error.is_finite()).then_some(error)
}

/// How far a number from so many repeats may lie off with probability 95 %; without end where its standard error is not known.
pub fn margin(standard_error: Option<f64>, repeats: usize) -> f64 {
    standard_error.map_or(f64::INFINITY, |error| error * student(repeats))
}

/// What `of` gives of all repeats, `None` being left out, in the interval by what it gives without each. `shared` is the standard error of
/// what all repeats have in common, such as a reference.
pub fn measured(repeats: usize, shared: f64, of: impl Fn(Option<usize>) -> f64) -> Measured {
    let without: Vec<f64> = (0..repeats).map(|repeat| of(Some(repeat))).collect();
    let error = standard_error(&without).map(|error| error.hypot(shared));
    Measured::within(of(None), margin(error, repeats))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_a_mean_is_what_textbooks_say() {
        // Deviation √(5/3) of four values, over √4.
        let values = [1.0, 2.0, 3.0, 4.0];
        let mean = measured(4, 0.0, |left_out| mean_without(&values, left_out));
        let margin = 3.182 * (5.0f64 / 3.0).sqrt() / 2.0;
        assert!((mean.value - 2.5).abs() < 1e-15 && (mean.high - 2.5 - margin).abs() < 1e-12);
        assert!((mean.low + mean.high - 5.0).abs() < 1e-12);
        let shared = measured(4, 2.0, |left_out| mean_without(&values, left_out));
        assert!((shared.high - 2.5 - 3.182 * (5.0f64 / 12.0 + 4.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn few_repeats_say_little_and_one_says_nothing() {
        let of = |values: &'static [f64]| measured(values.len(), 0.0, move |r| mean_without(values, r));
        // Two values that differ by 0.2 have a standard error of 0.1.
        let two = of(&[0.9, 1.1]);
        assert!((two.high - 1.0 - 1.2706).abs() < 1e-12, "{two:?}");
        assert_eq!(of(&[1.0]).high, f64::INFINITY);
        assert_eq!(
            measured(5, 0.0, |left_out| left_out.map_or(1.0, |_| f64::NAN)).low,
            f64::NEG_INFINITY
        );
        assert!(measured(5, 0.0, |_| f64::NAN).value.is_nan());
    }

    #[test]
    fn quantiles_of_student_hold_95_percent() {
        // With t = √ν tan θ the density is proportional to cos^(ν − 1) θ. Integrals by the midpoint rule, which errs far below 1e-6 here; the
        // table's rounding of 0.0005 moves the share by at most twice that times the density there, which is below 0.07.
        let integral = |power: i32, end: f64| {
            let steps = 10_000;
            let width = end / f64::from(steps);
            let heights = (0..steps).map(|step| (width * (f64::from(step) + 0.5)).cos().powi(power));
            heights.sum::<f64>() * width
        };
        for (index, quantile) in STUDENT_95.iter().enumerate() {
            let power = i32::try_from(index).unwrap();
            let end = (quantile / f64::from(power + 1).sqrt()).atan();
            let share = integral(power, end) / integral(power, std::f64::consts::FRAC_PI_2);
            assert!((share - 0.95).abs() < 2.0 * 0.0005 * 0.07, "{}: {share}", power + 1);
        }
        assert_eq!((student(2), student(31), student(99)), (12.706, 2.042, 2.042));
    }
}
