//! Pareto fronts: which of several (cost, error) points no other beats in both.

/// Whether each point is on the front: none has at most its cost and at most its error, and less of one of them. Points that are not finite
/// are on no front.
pub fn front(points: &[(f64, f64)]) -> Vec<bool> {
    let beats = |a: &(f64, f64), b: &(f64, f64)| a.0 <= b.0 && a.1 <= b.1 && (a.0 < b.0 || a.1 < b.1);
    let on_front = |point: &(f64, f64)| {
        point.0.is_finite() && point.1.is_finite() && !points.iter().any(|other| beats(other, point))
    };
    points.iter().map(on_front).collect()
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
}
