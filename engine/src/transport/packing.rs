//! Directions and colours in a word.
//!
//! Sources: octahedral map of Meyer et al., "On Floating-Point Normal Vectors" (2010), as surveyed by Cigolle et al. (JCGT 3(2), 2014);
//! colours in the format `E5B9G9R9_UFLOAT_PACK32` of the Vulkan specification. Guarantees: directions are off by at most 5.2·10⁻⁴ (13
//! bits), 1.3·10⁻⁴ (15 bits) or 6.5·10⁻⁵ (16 bits) radians, those along axes by nothing; bands by 2⁻⁹ of the largest one, down to 2⁻²⁵ absolute and up to
//! 65408. Packing is in f32 as on the device. Twin of `transport/packing.glsl`.

use crate::gpu::shaders::constants::{
    PACKING_FLOAT_BIAS, PACKING_FLOAT_MANTISSA_BITS, RGB9E5_BIAS, RGB9E5_MANTISSA_BITS, RGB9E5_MAX,
};
use glam::{DVec2, DVec3, Vec2, Vec3};

/// A unit vector with so many `bits` (15 or 16) for each of the two coordinates, the first ones lowest.
pub fn pack_octahedral(n: Vec3, bits: u32) -> u32 {
    let p = n.truncate() / (n.x.abs() + n.y.abs() + n.z.abs());
    let sign = |x: f32| if x < 0.0 { -1.0 } else { 1.0 };
    let p = if n.z < 0.0 {
        Vec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
    } else {
        p
    };
    let steps = ((1u32 << (bits - 1)) - 1) as f32;
    let q = (p * steps + 0.5).floor() + steps;
    q.x as u32 | (q.y as u32) << bits
}

/// The unit vector of a word.
pub fn unpack_octahedral(word: u32, bits: u32) -> DVec3 {
    let steps = f64::from((1u32 << (bits - 1)) - 1);
    let mask = (1u32 << bits) - 1;
    let p = DVec2::new(f64::from(word & mask), f64::from((word >> bits) & mask)) / steps - 1.0;
    let sign = |x: f64| if x < 0.0 { -1.0 } else { 1.0 };
    let z = 1.0 - p.x.abs() - p.y.abs();
    let fold = (-z).max(0.0);
    DVec3::new(p.x - sign(p.x) * fold, p.y - sign(p.y) * fold, z).normalize()
}

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
    fn directions_come_back_within_their_bounds() {
        for (bits, bound) in [(13u32, 5.2e-4), (15, 1.3e-4), (16, 6.5e-5)] {
            let mut worst = 0.0f64;
            let mut random = Random(u64::from(bits));
            for i in 0..100_000 {
                let mut n = random.direction();
                // Near the middles of the faces, where the map stretches most.
                if i % 2 == 0 {
                    let side = Vec3::new(n.x.signum(), n.y.signum(), n.z.signum());
                    n = (side + 0.01 * random.vector()).normalize();
                }
                let back = unpack_octahedral(pack_octahedral(n, bits), bits);
                worst = worst.max((back - n.as_dvec3()).length());
            }
            println!("{bits} bits: {worst:.3e}");
            // A bound that is far from met would be as wrong as one that is exceeded.
            assert!(worst < bound && worst > 0.8 * bound, "{bits}: {worst}");
            for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                for n in [axis, -axis] {
                    assert_eq!(unpack_octahedral(pack_octahedral(n, bits), bits), n.as_dvec3());
                }
            }
        }
    }

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
