//! Choices that use up a part of a random number and give back the rest as a random number: points that are evenly spread over the unit
//! square are so within each alternative, too.
//!
//! Source: Shirley, Wang and Zimmerman (1996), the choice among lights by one number. Twin of `transport/choice.glsl`.

use crate::gpu::shaders::constants;

/// The largest number below one in single precision.
pub const BELOW_ONE: f64 = constants::BELOW_ONE as f64;

/// True with probability `p`, by `u` in [0, 1), which is evenly spread again afterwards.
///
/// Of the 24 bits of the device's numbers an alternative of probability q leaves 24 + log₂ q.
pub fn choose_first(u: &mut f64, p: f64) -> bool {
    let first = *u < p;
    *u = if first { *u / p } else { (*u - p) / (1.0 - p) }.min(BELOW_ONE);
    first
}

#[cfg(test)]
mod tests {
    use super::super::testing::{chi_square_test, random3};
    use super::*;

    /// Chi-square of 20,000 choices over both alternatives and 16 cells of what is left; false alarm 1e-5.
    #[test]
    fn what_is_left_is_even_in_each_alternative() {
        let n = 20_000;
        for p in [0.0, 0.01, 0.3, 0.875, 1.0] {
            let mut observed = vec![0.0; 32];
            for i in 0..n {
                let mut u = random3(i, 1).x;
                let first = choose_first(&mut u, p);
                assert!((0.0..1.0).contains(&u));
                observed[usize::from(first) * 16 + (u * 16.0) as usize] += 1.0;
            }
            let expected: Vec<f64> = (0..32)
                .map(|cell| if cell < 16 { 1.0 - p } else { p } * f64::from(n) / 16.0)
                .collect();
            assert!(chi_square_test(&observed, &expected) > 1e-5, "{p}");
        }
    }

    #[test]
    fn the_edges_stay_below_one() {
        for p in [0.0, f64::MIN_POSITIVE, 0.5, 1.0 - f64::EPSILON, 1.0] {
            for start in [0.0, 0.5, BELOW_ONE] {
                let mut u = start;
                let first = choose_first(&mut u, p);
                assert_eq!(first, start < p);
                assert!((0.0..1.0).contains(&u), "{p} {start}: {u}");
            }
        }
    }
}
