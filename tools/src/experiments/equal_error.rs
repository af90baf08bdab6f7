//! Time to equal error: what a given error costs, read off a measured curve.
//!
//! Between measured budgets the curve is a straight line in logarithms, which is exact for power laws; nothing is read off beyond them.

/// A cost at some error.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cost {
    /// Between two budgets, or at one.
    Measured(f64),
    /// The least budget has reached it already, or this one with an error that is lost in noise: the cost is at most this.
    AtMost(f64),
    /// The greatest budget has not reached it: the cost is above this.
    Above(f64),
}

impl std::fmt::Display for Cost {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Measured(cost) => write!(f, "{cost:.3}"),
            Self::AtMost(cost) => write!(f, "≤ {cost:.3}"),
            Self::Above(cost) => write!(f, "> {cost:.3}"),
        }
    }
}

impl Cost {
    /// The number, bound or not.
    pub fn number(self) -> f64 {
        match self {
            Self::Measured(cost) | Self::AtMost(cost) | Self::Above(cost) => cost,
        }
    }

    /// The number, when it is more than a bound.
    pub fn measured(self) -> Option<f64> {
        match self {
            Self::Measured(cost) => Some(cost),
            _ => None,
        }
    }
}

/// The least error that every curve reaches: each curve is (cost, error) by rising budget. `None` without curves or errors above 0.
pub fn common_error<'a>(curves: impl IntoIterator<Item = &'a [(f64, f64)]>) -> Option<f64> {
    let mut common: Option<f64> = None;
    for curve in curves {
        let errors = curve.iter().map(|(_, error)| *error);
        let least = errors.filter(|error| *error > 0.0).reduce(f64::min)?;
        common = Some(common.map_or(least, |common| common.max(least)));
    }
    common
}

/// A cost with the budgets that it was read off between; of a bound, twice the one that it is the cost of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// What was read off.
    pub cost: Cost,
    between: [usize; 2],
}

impl Reading {
    /// The budgets that it was read off between, by index; of a bound twice the same.
    pub fn budgets(&self) -> [usize; 2] {
        self.between
    }

    /// What the error costs on a curve of the same budgets from fewer repeats, by the straight line through the same two of them: how the cost
    /// changes with the curve, for which that line goes on beyond both. Not a number where one of their errors has no logarithm.
    pub fn on(&self, curve: &[(f64, f64)], error: f64) -> f64 {
        let [(c0, e0), (c1, e1)] = self.between.map(|budget| curve[budget]);
        if self.between[0] == self.between[1] {
            return c0;
        }
        if e0 > 0.0 && e1 > 0.0 {
            between((c0, e0), (c1, e1), error)
        } else {
            f64::NAN
        }
    }
}

/// Where the straight line in logarithms has that error.
fn between((c0, e0): (f64, f64), (c1, e1): (f64, f64), error: f64) -> f64 {
    c0 * (c1 / c0).powf((error / e0).ln() / (e1 / e0).ln())
}

/// What `error` costs on a curve of (cost, error) by rising budget: where it is first reached. `None` for a curve without points, and where
/// work of this kind is none, as rays are to a technique that draws.
pub fn read(curve: &[(f64, f64)], error: f64) -> Option<Reading> {
    if curve.iter().any(|(cost, _)| *cost <= 0.0) {
        return None;
    }
    let bound = |cost: Cost, budget: usize| {
        Some(Reading {
            cost,
            between: [budget; 2],
        })
    };
    let first = curve.first()?;
    if first.1 == error {
        return Some(Reading {
            cost: Cost::Measured(first.0),
            between: [0, 1.min(curve.len() - 1)],
        });
    }
    if first.1 < error {
        return bound(Cost::AtMost(first.0), 0);
    }
    for (index, pair) in curve.windows(2).enumerate() {
        if pair[1].1 <= error {
            // An error that is lost in the reference's noise has no logarithm: how early the curve crossed is not known.
            if pair[1].1 <= 0.0 {
                return bound(Cost::AtMost(pair[1].0), index + 1);
            }
            return Some(Reading {
                cost: Cost::Measured(between(pair[0], pair[1], error)),
                between: [index, index + 1],
            });
        }
    }
    bound(Cost::Above(curve.last()?.0), curve.len() - 1)
}

/// The cost alone of [`read`].
pub fn cost_of(curve: &[(f64, f64)], error: f64) -> Option<Cost> {
    read(curve, error).map(|reading| reading.cost)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_laws_are_read_off_exactly() {
        let curve: Vec<(f64, f64)> = [1.0, 4.0, 16.0].map(|n: f64| (0.1 * n, n.powf(-0.5))).to_vec();
        for n in [1.0, 2.0, 5.0, 15.9, 16.0f64] {
            let cost = cost_of(&curve, n.powf(-0.5)).and_then(Cost::measured).unwrap();
            assert!((cost / (0.1 * n) - 1.0).abs() < 1e-12, "{n}: {cost}");
        }
        assert_eq!(cost_of(&curve, 2.0), Some(Cost::AtMost(0.1)));
        assert_eq!(cost_of(&curve, 0.1), Some(Cost::Above(1.6)));
        assert_eq!(cost_of(&[], 0.1), None);
        assert_eq!(cost_of(&[(0.0, 0.2), (0.0, 0.05)], 0.1), None);
    }

    #[test]
    fn an_error_lost_in_noise_bounds_the_cost_only() {
        for lost in [0.0, -0.01] {
            let curve = [(1.0, 0.5), (4.0, lost), (16.0, 0.1)];
            assert_eq!(cost_of(&curve, 0.2), Some(Cost::AtMost(4.0)));
            assert_eq!(cost_of(&curve, 0.5), Some(Cost::Measured(1.0)));
        }
    }

    #[test]
    fn the_common_error_is_one_that_all_reach() {
        let (a, b) = ([(1.0, 0.5), (4.0, 0.2)], [(1.0, 0.4), (4.0, 0.1)]);
        let common = common_error([&a[..], &b[..]]).unwrap();
        assert_eq!(common, 0.2);
        assert_eq!(cost_of(&a, common), Some(Cost::Measured(4.0)));
        assert!(
            cost_of(&b, common)
                .unwrap()
                .measured()
                .is_some_and(|cost| cost > 1.0 && cost < 4.0)
        );
        assert_eq!(common_error([]), None);
    }

    #[test]
    fn a_reading_follows_the_curve_beyond_its_budgets() {
        let curve = |scale: f64| [1.0, 4.0, 16.0].map(|n: f64| (n, scale * n.powf(-0.5)));
        // The last budget has the error that is asked for; with errors of 1.1 times it costs 1.21 times as much.
        let last = read(&curve(1.0), 0.25).unwrap();
        assert_eq!(last.cost, Cost::Measured(16.0));
        assert!((last.on(&curve(1.1), 0.25) / (1.21 * 16.0) - 1.0).abs() < 1e-12);
        assert!((last.on(&curve(0.9), 0.25) / (0.81 * 16.0) - 1.0).abs() < 1e-12);
        let bound = read(&curve(1.0), 0.1).unwrap();
        assert_eq!((bound.cost, bound.on(&curve(1.1), 0.1)), (Cost::Above(16.0), 16.0));
        let mut lost = curve(1.0);
        lost[2].1 = f64::NAN;
        assert!(last.on(&lost, 0.25).is_nan());
    }
}
