//! Seconds of functions by wall clock, and the statistics that stand for repeated runs.

use std::time::Instant;

/// What a function gives, and its seconds.
pub fn timed<T>(function: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let result = function();
    (result, start.elapsed().as_secs_f64())
}

/// Runs something that says its seconds so often, after once to warm up: what the last run gave, which is dropped outside the next
/// one's time, and the seconds of all but the first. Without repeats the first counts.
///
/// # Errors
/// The first of a run.
pub fn repeated<T, E>(repeats: usize, mut run: impl FnMut() -> Result<(T, f64), E>) -> Result<(T, Vec<f64>), E> {
    let (mut result, first) = run()?;
    let mut seconds = Vec::with_capacity(repeats.max(1));
    for _ in 0..repeats {
        let (next, time) = run()?;
        result = next;
        seconds.push(time);
    }
    if seconds.is_empty() {
        seconds.push(first);
    }
    Ok((result, seconds))
}

/// The middle value, or the mean of the two in the middle; not a number when there is none.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.as_slice() {
        [] => f64::NAN,
        all if all.len() % 2 == 1 => all[middle],
        all => 0.5 * (all[middle - 1] + all[middle]),
    }
}

/// Median and range of one quantity.
#[derive(Debug, Clone, Copy, serde::Serialize)]
pub struct Spread {
    /// The median.
    pub median: f64,
    /// The least.
    pub least: f64,
    /// The greatest.
    pub greatest: f64,
}

impl Spread {
    /// Of these values; not numbers when there is none.
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        Self {
            least: values.first().copied().unwrap_or(f64::NAN),
            greatest: values.last().copied().unwrap_or(f64::NAN),
            median: median(values),
        }
    }

    /// Half the range over the median.
    pub fn relative(&self) -> f64 {
        0.5 * (self.greatest - self.least) / self.median
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_run_that_warms_up_counts_only_without_repeats() {
        let runs = |repeats| {
            let mut run = 0..;
            repeated(repeats, || run.next().map(|i: u8| (i, f64::from(i))).ok_or(()))
        };
        assert_eq!(runs(0), Ok((0, vec![0.0])));
        assert_eq!(runs(3), Ok((3, vec![1.0, 2.0, 3.0])));
    }

    #[test]
    fn the_first_error_ends_repeated_runs() {
        let mut run = 0;
        let failed: Result<((), _), i32> = repeated(5, || {
            run += 1;
            if run == 3 { Err(run) } else { Ok(((), 0.0)) }
        });
        assert_eq!((failed, run), (Err(3), 3));
    }

    #[test]
    fn medians_are_middle_values_or_the_mean_of_two() {
        assert_eq!(median(vec![3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median(Vec::new()).is_nan());
    }

    #[test]
    fn spreads_go_from_the_least_over_the_median_to_the_greatest() {
        let of = |values: &[f64]| Spread::of(values.to_vec());
        let spread = of(&[4.0, 1.0, 2.0, 3.0]);
        assert_eq!((spread.least, spread.median, spread.greatest), (1.0, 2.5, 4.0));
        let one = of(&[5.0]);
        assert_eq!((one.least, one.greatest, one.relative()), (5.0, 5.0, 0.0));
    }
}
