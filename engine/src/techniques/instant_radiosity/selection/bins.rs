//! Bins of a histogram of potential contributions, which tells the device which lights carry a share of the sum: what the lights of each bin carry is exact, so
//! that those from a bin on carry a share that is known, a little more than was asked for. Twin of `techniques/instant_radiosity/potential_bins.glsl`.

use crate::gpu::shaders::constants::{POTENTIAL_BIN_SHIFT, POTENTIAL_BINS, POTENTIAL_FIRST_BIN};

/// The bin of a potential's luminance, W·m⁻²·sr⁻¹: a quarter of an octave wide from 2⁻⁴⁰ to 2²⁴, with all that is less in the first and all beyond in the last.
pub fn potential_bin(key: f32) -> u32 {
    let bits = key.to_bits() >> POTENTIAL_BIN_SHIFT;
    bits.clamp(POTENTIAL_FIRST_BIN, POTENTIAL_FIRST_BIN + POTENTIAL_BINS - 1) - POTENTIAL_FIRST_BIN
}

/// The least potential of a bin; zero of the first.
pub fn potential_bin_least(bin: u32) -> f32 {
    if bin == 0 {
        0.0
    } else {
        f32::from_bits((bin + POTENTIAL_FIRST_BIN) << POTENTIAL_BIN_SHIFT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_are_quarters_of_octaves() {
        assert_eq!([0.0, 1e-30, 2f32.powi(-41)].map(potential_bin), [0; 3]);
        assert_eq!([2f32.powi(24), 1e30, f32::INFINITY].map(potential_bin), [255; 3]);
        for bin in 1..POTENTIAL_BINS {
            let least = potential_bin_least(bin);
            assert_eq!(potential_bin(least), bin);
            assert_eq!(potential_bin(least.next_down()), bin - 1);
            let wide = potential_bin_least(bin) / potential_bin_least(bin - 1);
            assert!(bin == 1 || (wide > 1.1 && wide <= 1.25), "{wide}");
        }
        assert_eq!((potential_bin_least(0), potential_bin_least(4)), (0.0, 2f32.powi(-39)));
    }
}
