//! Deterministic pseudo-random values from integers, for generated scenes and procedural images.
//!
//! The mixer is PCG's output permutation as a hash (Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020).
//! Integers in, the same bits out on every machine; no state.

/// Hashes one word.
pub fn hash(value: u32) -> u32 {
    let state = value.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// Hashes three words: a seed, an item and a dimension.
pub fn hash3(seed: u32, item: u32, dimension: u32) -> u32 {
    hash(hash(hash(seed).wrapping_add(item)).wrapping_add(dimension))
}

/// A value in [0, 1) with 24 random bits.
pub fn unit(seed: u32, item: u32, dimension: u32) -> f32 {
    (hash3(seed, item, dimension) >> 8) as f32 / (1u32 << 24) as f32
}

/// Value noise in [0, 1) over a lattice that repeats every `period` cells, smooth to the first derivative.
pub fn value_noise(seed: u32, x: f32, y: f32, period: u32) -> f32 {
    let period = period.max(1);
    let lattice = |cx: i64, cy: i64| {
        let wrap = |c: i64| c.rem_euclid(i64::from(period)) as u32;
        unit(seed, wrap(cx), wrap(cy))
    };
    let (fx, fy) = (x.floor(), y.floor());
    let smooth = |t: f32| t * t * (3.0 - 2.0 * t);
    let (tx, ty) = (smooth(x - fx), smooth(y - fy));
    let (cx, cy) = (fx as i64, fy as i64);
    let row = |dy: i64| lattice(cx, cy + dy) * (1.0 - tx) + lattice(cx + 1, cy + dy) * tx;
    row(0) * (1.0 - ty) + row(1) * ty
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_the_published_permutation() {
        // 64-bit-free recomputation of the same permutation, step by step, for the word 1.
        let state: u32 = 747_796_405u32.wrapping_add(2_891_336_453);
        let shift = (state >> 28) + 4;
        let word = ((state >> shift) ^ state).wrapping_mul(277_803_737);
        assert_eq!(hash(1), (word >> 22) ^ word);
        assert_ne!(hash3(0, 1, 2), hash3(0, 2, 1));
    }

    #[test]
    fn unit_values_are_uniform() {
        // Chi-square over 64 bins and 65,536 fixed draws: 63 degrees of freedom, critical value 111.9 at 1e-4.
        let mut bins = [0u32; 64];
        for item in 0..65_536 {
            let value = unit(7, item, 3);
            assert!((0.0..1.0).contains(&value));
            bins[(value * 64.0) as usize] += 1;
        }
        let chi: f64 = bins.iter().map(|&b| (f64::from(b) - 1024.0).powi(2) / 1024.0).sum();
        assert!(chi < 111.9, "{chi}");
    }

    #[test]
    fn value_noise_repeats_with_its_period() {
        for i in 0..100 {
            let (x, y) = (i as f32 * 0.125, i as f32 * 0.25);
            assert_eq!(value_noise(1, x, y, 8), value_noise(1, x + 8.0, y + 8.0, 8));
        }
    }
}
