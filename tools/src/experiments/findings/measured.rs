//! Measured numbers with the intervals that they lie in.

use clerestory::film::z_test::{sidak_threshold, two_sided_p};

use super::field::{any_number, any_numbers};

/// Share of runs in which chance alone exceeds [`z_most`].
const ALARMS: f64 = 0.01;
/// No p-value of f64 is left beyond it.
const Z_WITHOUT_CHANCE: f64 = 40.0;
/// Least probability with which an interval of order statistics holds the median.
const COVERAGE: f64 = 0.93;

/// A number and the interval that it lies in. An exact number is its own interval.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Measured {
    /// The number.
    #[serde(with = "any_number")]
    pub value: f64,
    /// The interval's lower end.
    #[serde(with = "any_number")]
    pub low: f64,
    /// The interval's upper end.
    #[serde(with = "any_number")]
    pub high: f64,
}

impl Measured {
    /// A number that is the same in every run.
    pub const fn exact(value: f64) -> Self {
        Self {
            value,
            low: value,
            high: value,
        }
    }

    /// A number that may be off by so much to either side.
    pub fn within(value: f64, margin: f64) -> Self {
        Self {
            value,
            low: value - margin,
            high: value + margin,
        }
    }

    /// Whether it is an exact number.
    pub fn is_exact(&self) -> bool {
        self.low == self.high
    }
}

impl From<f64> for Measured {
    fn from(value: f64) -> Self {
        Self::exact(value)
    }
}

impl From<u64> for Measured {
    fn from(count: u64) -> Self {
        Self::exact(count as f64)
    }
}

impl From<bool> for Measured {
    /// 1 for what is so.
    fn from(is_so: bool) -> Self {
        Self::exact(f64::from(u8::from(is_so)))
    }
}

impl From<&Repeats> for Measured {
    fn from(repeats: &Repeats) -> Self {
        repeats.measured()
    }
}

/// Values of one quantity, one for each turn, in the order of turns.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(transparent)]
pub struct Repeats(#[serde(with = "any_numbers")] pub Vec<f64>);

impl Repeats {
    /// The median, with the narrowest interval of order statistics that holds the quantity's median with a probability of 93 % at least, whatever
    /// the distribution of independent turns: the least and the greatest of 5 to 8 values, the second and the last but one of 9 or 10, and so on. Fewer than 5 values
    /// bound nothing, and one that is no number makes all of it none. Source: H. A. David and H. N. Nagaraja, *Order Statistics*, 3rd ed., 2003,
    /// §7.1.
    pub fn measured(&self) -> Measured {
        if self.0.iter().any(|value| value.is_nan()) {
            return Measured::exact(f64::NAN);
        }
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        let value = crate::timing::median(sorted.clone());
        match rank(sorted.len()) {
            Some(rank) => Measured {
                value,
                low: sorted[rank],
                high: sorted[sorted.len() - 1 - rank],
            },
            None => Measured {
                value,
                low: f64::NEG_INFINITY,
                high: f64::INFINITY,
            },
        }
    }

    /// Ratios turn by turn: what slows one turn slows both.
    #[must_use]
    pub fn over(&self, other: &Self) -> Self {
        Self(self.0.iter().zip(&other.0).map(|(a, b)| a / b).collect())
    }

    /// What these change in others' values turn by turn, in %; of times the other way round, it is the change of speed.
    #[must_use]
    pub fn change_from(&self, first: &Self) -> Self {
        self.0
            .iter()
            .zip(&first.0)
            .map(|(value, first)| change(*value, *first))
            .collect()
    }

    /// All values times a factor.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self(self.0.iter().map(|value| value * factor).collect())
    }

    /// Values of each part of a turn, from arrays of a turn.
    pub fn by_part<const N: usize>(turns: &[[f64; N]]) -> [Self; N] {
        std::array::from_fn(|part| turns.iter().map(|turn| turn[part]).collect())
    }
}

impl FromIterator<f64> for Repeats {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        Self(values.into_iter().collect())
    }
}

/// The geometric mean of ratios, in the interval of that of their ends; `None` of none.
pub fn geometric_mean(all: impl IntoIterator<Item = Measured>) -> Option<Measured> {
    let (mut sums, mut count) = ([0.0; 3], 0.0_f64);
    for Measured { value, low, high } in all {
        for (sum, ratio) in sums.iter_mut().zip([value, low, high]) {
            // An end without bound goes below zero.
            *sum += if ratio.is_nan() { ratio } else { ratio.max(0.0).ln() };
        }
        count += 1.0;
    }
    let [value, low, high] = sums.map(|sum| (sum / count).exp());
    (count > 0.0).then_some(Measured { value, low, high })
}

/// The largest |z| of so many standard normal numbers that chance exceeds once in a hundred runs. Source: Šidák, *Rectangular Confidence Regions for
/// the Means of Multivariate Normal Distributions*, 1967.
pub fn z_most(count: usize) -> f64 {
    let threshold = sidak_threshold(ALARMS, count.max(1));
    // The p-value falls with z: bisection, to the last bit.
    let (mut below, mut above) = (0.0, Z_WITHOUT_CHANCE);
    for _ in 0..f64::MANTISSA_DIGITS {
        let z = 0.5 * (below + above);
        if two_sided_p(z) > threshold {
            below = z;
        } else {
            above = z;
        }
    }
    above
}

/// What a value changes in another, in %.
pub fn change(value: f64, first: f64) -> f64 {
    100.0 * (value / first - 1.0)
}

/// The rank, from 0, of the order statistic that begins the interval; `None` where even the least and the greatest hold the median too seldom.
fn rank(count: usize) -> Option<usize> {
    // The median lies below the value of rank k with the probability that at most k of the values lie below the median.
    let mut term = 0.5f64.powi(i32::try_from(count).unwrap_or(i32::MAX));
    let mut below = 0.0;
    let mut found = None;
    for rank in 0..count.div_ceil(2) {
        below += term;
        if 1.0 - 2.0 * below < COVERAGE {
            break;
        }
        found = Some(rank);
        term *= (count - rank) as f64 / (rank + 1) as f64;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_hold_the_median_as_often_as_tables_say() {
        // David and Nagaraja's coverages: 5 values 93.75 %, 9 by the second 96.1 %, 11 by the third 93.5 %, 15 by the fourth 96.5 %.
        let begins = |count| rank(count).map(|rank| rank + 1);
        assert_eq!([0, 1, 4].map(begins), [None; 3]);
        assert_eq!([5, 8, 9, 10, 11, 15].map(begins), [1, 1, 2, 2, 3, 4].map(Some));
        let five = Repeats(vec![3.0, 1.0, 5.0, 2.0, 4.0]).measured();
        assert_eq!((five.value, five.low, five.high), (3.0, 1.0, 5.0));
        let few = Repeats(vec![1.0, 2.0]).measured();
        assert_eq!((few.value, few.low.is_finite()), (1.5, false));
    }

    #[test]
    fn one_turn_that_is_no_number_is_not_trimmed() {
        for place in 0..15 {
            let mut turns = vec![1.0; 15];
            turns[place] = if place % 2 == 0 { f64::NAN } else { -f64::NAN };
            let Measured { value, low, high } = Repeats(turns).measured();
            assert!(value.is_nan() && low.is_nan() && high.is_nan(), "{place}");
        }
    }

    #[test]
    fn ratios_are_of_the_same_turn() {
        let (a, b) = (Repeats(vec![2.0, 8.0]), Repeats(vec![1.0, 2.0]));
        assert_eq!(a.over(&b).0, [2.0, 4.0]);
        assert_eq!(a.change_from(&b).0, [100.0, 300.0]);
        assert_eq!(a.scaled(0.5).0, [1.0, 4.0]);
    }

    #[test]
    fn chance_exceeds_the_largest_of_more_numbers_later() {
        // Quantiles of the normal distribution: 2.576 at 1 % on both sides, 3.29 at 1 - 0.99^(1/10).
        assert!((z_most(1) - 2.5758).abs() < 1e-3, "{}", z_most(1));
        assert!((z_most(10) - 3.2892).abs() < 1e-3, "{}", z_most(10));
    }

    #[test]
    fn geometric_means_have_the_intervals_of_their_ends() {
        let of = |value, low, high| Measured { value, low, high };
        let mean = geometric_mean([of(1.0, 0.5, 2.0), of(4.0, 2.0, 8.0)]).unwrap();
        assert_eq!(
            [mean.value, mean.low, mean.high].map(|x| (1e9 * x).round()),
            [2e9, 1e9, 4e9]
        );
        assert_eq!(geometric_mean([]), None);
        let open = geometric_mean([of(1.0, f64::NEG_INFINITY, f64::INFINITY), of(4.0, 2.0, 8.0)]).unwrap();
        assert_eq!((open.low, open.high), (0.0, f64::INFINITY));
        assert!(geometric_mean([f64::NAN.into()]).unwrap().value.is_nan());
    }

    #[test]
    fn parts_of_turns_have_their_values_in_order() {
        let [a, b] = Repeats::by_part(&[[1.0, 2.0], [3.0, 4.0]]);
        assert_eq!((a.0, b.0), (vec![1.0, 3.0], vec![2.0, 4.0]));
        assert_eq!(change(90.0, 100.0).round(), -10.0);
    }

    #[test]
    fn exact_numbers_are_their_own_interval() {
        assert!(Measured::from(3u64).is_exact() && Measured::from(true).value == 1.0);
        assert!(!Measured::within(1.0, 0.1).is_exact());
    }
}
