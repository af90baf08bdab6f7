//! Resampled importance sampling: of candidates one is kept by what it would bring, and stands for them all.
//!
//! Source: J. Talbot, D. Cline and P. Egbert, "Importance Resampling for Global Illumination", EGSR 2005. Twin of
//! `techniques/instant_radiosity/resampling.glsl`.

/// Adds the weight of a candidate to the sum, and says whether it is kept in the place of those before, by a number `u` in [0, 1).
///
/// Of independent numbers each candidate is the one that is kept at last with the probability of its share of the sum. One of no weight never is.
pub fn resample(u: f64, weight: f64, sum: &mut f64) -> bool {
    *sum += weight;
    u * *sum < weight
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn candidates_are_kept_by_their_shares() {
        // Numbers in the middle of even parts stand for all.
        const PARTS: u32 = 24;
        let numbers = || (0..PARTS).map(|part| (f64::from(part) + 0.5) / f64::from(PARTS));
        let weights = [1.0, 0.0, 2.0, 3.0];
        let mut kept = [0u32; 4];
        for first in numbers() {
            for third in numbers() {
                for last in numbers() {
                    let (mut sum, mut is) = (0.0, usize::MAX);
                    for (number, (weight, u)) in weights.iter().zip([first, 0.0, third, last]).enumerate() {
                        if resample(u, *weight, &mut sum) {
                            is = number;
                        }
                    }
                    assert_eq!(sum, 6.0);
                    kept[is] += 1;
                }
            }
        }
        // Thirds and halves of the numbers are whole.
        assert_eq!(kept.map(|count| count * 6 / PARTS.pow(3)), [1, 0, 2, 3]);
        assert_eq!(kept.iter().sum::<u32>(), PARTS.pow(3));
    }
}
