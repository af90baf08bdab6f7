//! How errors of maps fall with their texels, and how many texels one map needs for another's error.

use crate::experiments::findings::{Measured, geometric_mean};
use crate::experiments::measures::errors::greatest;

/// By how much an error falls when texels double, as a power: from the last two points of a curve of texels and errors.
pub fn slope(curve: &[(f64, f64)]) -> f64 {
    match curve {
        [.., (a, before), (b, after)] => -(after / before).ln() / (b / a).ln(),
        _ => f64::NAN,
    }
}

/// Times as many texels as another map has at the end of its curve, for an error like its.
pub fn need(curve: &[(f64, f64)], other: &[(f64, f64)]) -> f64 {
    match (curve.last(), other.last()) {
        (Some((texels, error)), Some((of_other, error_of_other))) => {
            texels / of_other * (error / error_of_other).powf(1.0 / slope(other))
        }
        _ => f64::NAN,
    }
}

/// The geometric mean of needs, with the least and the greatest of them; not numbers of none.
pub fn spread(needs: &[f64]) -> Measured {
    Measured {
        value: geometric_mean(needs.iter().map(|need| (*need).into())).map_or(f64::NAN, |mean| mean.value),
        low: -greatest(needs.iter().map(|need| -need)),
        high: greatest(needs.iter().copied()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_hides_no_need() {
        let Measured { value, low, high } = spread(&[4.0, 1.0, 2.0]);
        assert!((value - 2.0).abs() < 1e-12 && (low, high) == (1.0, 4.0), "{value}");
        assert!(spread(&[]).value.is_nan());
    }

    #[test]
    fn needs_and_slopes_of_power_laws_are_exact() {
        let law = |scale: f64| -> Vec<(f64, f64)> {
            [256.0f64, 1024.0, 4096.0]
                .map(|texels| (texels, scale * texels.powf(-0.5)))
                .to_vec()
        };
        assert!((slope(&law(3.0)) - 0.5).abs() < 1e-12);
        // Twice the error at slope −½ is four times the texels.
        assert!((need(&law(2.0), &law(1.0)) - 4.0).abs() < 1e-12);
        assert!((need(&law(1.0), &law(1.0)) - 1.0).abs() < 1e-12);
    }
}
