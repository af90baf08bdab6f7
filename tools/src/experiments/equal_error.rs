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

/// What `error` costs on a curve of (cost, error) by rising budget: where it is first reached. `None` for a curve without points, and where
/// work of this kind is none, as rays are to a technique that draws.
pub fn cost_of(curve: &[(f64, f64)], error: f64) -> Option<Cost> {
    if curve.iter().any(|(cost, _)| *cost <= 0.0) {
        return None;
    }
    let first = curve.first()?;
    if first.1 <= error {
        return Some(if first.1 == error {
            Cost::Measured(first.0)
        } else {
            Cost::AtMost(first.0)
        });
    }
    for pair in curve.windows(2) {
        let ((c0, e0), (c1, e1)) = (pair[0], pair[1]);
        if e1 <= error {
            // An error that is lost in the reference's noise has no logarithm: how early the curve crossed is not known.
            if e1 <= 0.0 {
                return Some(Cost::AtMost(c1));
            }
            let share = (error / e0).ln() / (e1 / e0).ln();
            return Some(Cost::Measured(c0 * (c1 / c0).powf(share)));
        }
    }
    curve.last().map(|(cost, _)| Cost::Above(*cost))
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
}
