//! The transfer function of sRGB and its inverse (IEC 61966-2-1, with its rounded constants), and bytes.
//!
//! Guarantee: every byte comes back from [`linear_from_srgb`] by [`srgb_byte`]. Twin of `srgb.glsl`.

/// Linear value in [0, 1] to sRGB value in [0, 1].
pub fn srgb_from_linear(linear: f64) -> f64 {
    if linear <= LINEAR_END {
        SLOPE * linear
    } else {
        (1.0 + OFFSET) * linear.powf(1.0 / EXPONENT) - OFFSET
    }
}

/// sRGB value in [0, 1] to linear value in [0, 1].
pub fn linear_from_srgb(srgb: f64) -> f64 {
    if srgb <= ENCODED_END {
        srgb / SLOPE
    } else {
        ((srgb + OFFSET) / (1.0 + OFFSET)).powf(EXPONENT)
    }
}

/// Rounds a value in [0, 1] to the nearest of 0…255 (halves up).
pub fn quantize(value: f64) -> u8 {
    (value * 255.0 + 0.5).floor().clamp(0.0, 255.0) as u8
}

/// The byte that is nearest to the encoded value; what lies outside [0, 1] is clipped.
pub fn srgb_byte(linear: f64) -> u8 {
    quantize(srgb_from_linear(linear.clamp(0.0, 1.0)))
}

const SLOPE: f64 = 12.92;
const OFFSET: f64 = 0.055;
const EXPONENT: f64 = 2.4;
const LINEAR_END: f64 = 0.003_130_8;
const ENCODED_END: f64 = 0.040_45;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::shaders::constants;

    #[test]
    fn encoding_and_its_inverse_agree_at_every_code() {
        for code in 0..=255u8 {
            assert_eq!(srgb_byte(linear_from_srgb(f64::from(code) / 255.0)), code);
        }
        // Middle grey of the standard: 18 % reflectance is code 118 (0.4613…).
        assert_eq!([0.18, -1.0, 9.0].map(srgb_byte), [118, 0, 255]);
    }

    #[test]
    fn the_two_branches_meet_within_the_standards_rounding() {
        let (below, above) = (srgb_from_linear(LINEAR_END), srgb_from_linear(LINEAR_END.next_up()));
        assert!((below - above).abs() < 1e-7);
        let (below, above) = (linear_from_srgb(ENCODED_END), linear_from_srgb(ENCODED_END.next_up()));
        assert!((below - above).abs() < 1e-7);
        assert_eq!((linear_from_srgb(0.0), linear_from_srgb(1.0)), (0.0, 1.0));
        // 188/255 encodes 0.5029.
        assert!((linear_from_srgb(188.0 / 255.0) - 0.502_886).abs() < 1e-6);
    }

    #[test]
    fn quantize_rounds_to_nearest() {
        assert_eq!((quantize(0.5 / 255.0 - 1e-9), quantize(0.5 / 255.0 + 1e-9)), (0, 1));
        assert_eq!((quantize(0.0), quantize(1.0)), (0, 255));
    }

    #[test]
    fn the_shaders_constants_are_the_rounded_ones() {
        let exact = [SLOPE, OFFSET, EXPONENT, LINEAR_END, ENCODED_END].map(|v| v as f32);
        let shaders = [
            constants::SRGB_SLOPE,
            constants::SRGB_OFFSET,
            constants::SRGB_EXPONENT,
            constants::SRGB_LINEAR_END,
            constants::SRGB_ENCODED_END,
        ];
        assert_eq!(exact, shaders);
    }
}
