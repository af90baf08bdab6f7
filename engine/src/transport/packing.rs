//! Colours in a word; directions in a word are [`crate::maps::packed_direction`]'s.
//!
//! Source: the format `E5B9G9R9_UFLOAT_PACK32` of the Vulkan specification. Guarantees: bands are off by at most 2⁻⁹ of the largest one, down to
//! 2⁻²⁵ absolute and up to 65408. Packing is in f32 as on the device. Twin of `transport/packing.glsl`.

use crate::gpu::shaders::constants::{
    PACKING_FLOAT_BIAS, PACKING_FLOAT_MANTISSA_BITS, RGB9E5_BIAS, RGB9E5_MANTISSA_BITS, RGB9E5_MAX,
};
use glam::{DVec3, Vec3};

fn packing_power(exponent: i32) -> f32 {
    f32::from_bits(((exponent + PACKING_FLOAT_BIAS) << PACKING_FLOAT_MANTISSA_BITS) as u32)
}

/// A colour; bands are clamped to \[0, 65408\].
pub fn pack_rgb9e5(color: Vec3) -> u32 {
    let color = color.clamp(Vec3::ZERO, Vec3::splat(RGB9E5_MAX));
    let largest = color.max_element();
    let floor = (largest.to_bits() as i32 >> PACKING_FLOAT_MANTISSA_BITS) - PACKING_FLOAT_BIAS;
    let exponent = floor.max(-RGB9E5_BIAS - 1) + 1;
    let rounded = (largest * packing_power(RGB9E5_MANTISSA_BITS - exponent) + 0.5).floor() as i32;
    let exponent = exponent + (rounded >> RGB9E5_MANTISSA_BITS);
    let q = (color * packing_power(RGB9E5_MANTISSA_BITS - exponent) + 0.5).floor();
    q.x as u32 | (q.y as u32) << 9 | (q.z as u32) << 18 | ((exponent + RGB9E5_BIAS) as u32) << 27
}

/// The colour of a word.
pub fn unpack_rgb9e5(word: u32) -> DVec3 {
    let band = |shift: u32| f64::from((word >> shift) & 0x1FF);
    let power = packing_power((word >> 27) as i32 - RGB9E5_BIAS - RGB9E5_MANTISSA_BITS);
    DVec3::new(band(0), band(9), band(18)) * f64::from(power)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    #[test]
    fn colors_come_back_within_their_bounds() {
        let mut random = Random(9);
        let mut worst = 0.0f64;
        for _ in 0..100_000 {
            let size = random.magnitude(-16, 16);
            let color = size * Vec3::new(random.unit(), random.unit(), random.unit());
            let back = unpack_rgb9e5(pack_rgb9e5(color));
            let allowed = f64::from(color.max_element()) / 512.0;
            let error = (back - color.as_dvec3()).abs().max_element();
            assert!(error <= allowed.max(f64::from(2f32.powi(-25))), "{color} {back}");
            worst = worst.max(error / allowed.max(1e-30));
        }
        assert!(worst > 0.5);
        for exact in [0.0, 1.0, 0.5, 3.0, 511.0, RGB9E5_MAX] {
            let color = Vec3::new(exact, 0.0, exact);
            assert_eq!(unpack_rgb9e5(pack_rgb9e5(color)), color.as_dvec3());
        }
        assert_eq!(
            pack_rgb9e5(Vec3::new(-1.0, 1e9, 0.0)),
            pack_rgb9e5(Vec3::new(0.0, RGB9E5_MAX, 0.0))
        );
        // Rounding up to 512 moves to the next exponent.
        assert_eq!(unpack_rgb9e5(pack_rgb9e5(Vec3::splat(1023.75))), DVec3::splat(1024.0));
    }
}
