//! Pareto fronts: which of several (cost, error) points no other beats in both, and how what stands on one rises along it.

/// Whether each point is on the front: none has at most its cost and at most its error, and less of one of them. Points that are not finite
/// are on no front.
pub fn front(points: &[(f64, f64)]) -> Vec<bool> {
    let beats = |a: &(f64, f64), b: &(f64, f64)| a.0 <= b.0 && a.1 <= b.1 && (a.0 < b.0 || a.1 < b.1);
    let on_front = |point: &(f64, f64)| {
        point.0.is_finite() && point.1.is_finite() && !points.iter().any(|other| beats(other, point))
    };
    points.iter().map(on_front).collect()
}

/// Ranks from 0 on; equal values have the mean of theirs.
fn ranks(values: &[f64]) -> Vec<f64> {
    let of = |value: &f64| {
        let (below, equal) = values.iter().fold((0.0, 0.0), |(below, equal), other| {
            (
                below + f64::from(u8::from(other < value)),
                equal + f64::from(u8::from(other == value)),
            )
        });
        below + 0.5 * (equal - 1.0)
    };
    values.iter().map(of).collect()
}

/// The rank correlation of two quantities: 1 where one rises with the other, −1 where it falls, 0 where one of them does not change. Source: Spearman,
/// *The Proof and Measurement of Association between Two Things*, 1904.
pub fn rank_correlation(pairs: &[(f64, f64)]) -> f64 {
    let (a, b): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
    let (a, b) = (ranks(&a), ranks(&b));
    let middle = 0.5 * (pairs.len() as f64 - 1.0);
    let product = |a: &[f64], b: &[f64]| {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| (a - middle) * (b - middle)).sum::<f64>()
    };
    let scale = (product(&a, &a) * product(&b, &b)).sqrt();
    if scale > 0.0 { product(&a, &b) / scale } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_nothing_beats_is_on_the_front() {
        let points = [
            (1.0, 9.0),
            (2.0, 4.0),
            (3.0, 5.0),
            (4.0, 1.0),
            (4.0, 2.0),
            (f64::NAN, 0.0),
        ];
        assert_eq!(front(&points), [true, true, false, true, false, false]);
        assert_eq!(
            front(&[(1.0, 1.0), (1.0, 1.0)]),
            [true, true],
            "equals do not beat each other"
        );
        assert!(front(&[]).is_empty());
    }

    #[test]
    fn rank_correlations_are_those_of_textbooks() {
        assert_eq!(rank_correlation(&[(1.0, 10.0), (2.0, 20.0), (9.0, 21.0)]), 1.0);
        assert_eq!(rank_correlation(&[(1.0, 3.0), (2.0, 2.0), (3.0, 1.0)]), -1.0);
        // 1 − 6 Σ d² / (n (n² − 1)) of ranks that differ by 0, 1, 1, 0 and 0.
        let five = [(1.0, 1.0), (2.0, 3.0), (3.0, 2.0), (4.0, 4.0), (5.0, 5.0)];
        assert!((rank_correlation(&five) - 0.9).abs() < 1e-12);
        // Two equal values of three share a rank: √3 / 2.
        let tied = [(1.0, 1.0), (1.0, 2.0), (2.0, 3.0)];
        assert!((rank_correlation(&tied) - 0.75f64.sqrt()).abs() < 1e-12);
        assert_eq!(rank_correlation(&[(1.0, 1.0), (1.0, 2.0)]), 0.0);
        assert_eq!(rank_correlation(&[]), 0.0);
    }
}
