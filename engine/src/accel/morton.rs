//! Morton codes: places along a curve through space that keeps near things near, of 30 or 63 bits.
//!
//! Source: G. Morton, "A computer oriented geodetic data base", IBM, 1966; as sort keys of a hierarchy, C. Lauterbach et al., "Fast BVH
//! Construction on GPUs", Eurographics 2009. A code holds a cell of a grid over the exact bounds of what is coded, its most significant
//! bit from z, then y, then x, then the next of z.
//!
//! Guarantee: twin of `accel/morton.glsl` to the bit on every device. The grid's scale is an integer quotient, since devices may divide
//! with an error; all else is a subtraction, a product and a comparison, which they round correctly.

use super::Aabb;
use crate::gpu::shaders::constants;
use glam::Vec3;

/// Bits an axis of the short code.
pub const MORTON_30_AXIS_BITS: u32 = constants::MORTON_30_AXIS_BITS;

/// Bits an axis of the long code.
pub const MORTON_63_AXIS_BITS: u32 = constants::MORTON_63_AXIS_BITS;

/// Least biased exponent of an extent that is divided into cells (2⁻⁹⁰ m); what is thinner lies in one cell.
const MIN_EXTENT_EXPONENT: u32 = constants::MORTON_MIN_EXTENT_EXPONENT;

/// Bits of a float's fraction.
const FRACTION_BITS: u32 = 23;

/// Bias of a float's exponent.
const EXPONENT_BIAS: u32 = 127;

/// Twice the centre of a box: halving would only cost a rounding.
pub fn doubled_centre(bounds: &Aabb) -> Vec3 {
    bounds.lower + bounds.upper
}

/// 2ᵏ / `extent`, truncated to 24 bits; 0 where the extent is under 2⁻⁹⁰, not finite, or 2³² and more.
pub fn cells_per_length(extent: f32, axis_bits: u32) -> f32 {
    let bits = extent.to_bits();
    let exponent = bits >> FRACTION_BITS;
    if !(MIN_EXTENT_EXPONENT..EXPONENT_BIAS + 32).contains(&exponent) {
        return 0.0;
    }
    let hidden = 1u32 << FRACTION_BITS;
    let divisor = u64::from(bits & (hidden - 1) | hidden);
    // Of a power of two the quotient is 2²⁴, which is a fraction of 0 one exponent up.
    let quotient = ((1u64 << (2 * FRACTION_BITS + 1)) / divisor) as u32;
    let carry = quotient >> (FRACTION_BITS + 1);
    let scale_exponent = axis_bits + 2 * EXPONENT_BIAS - 1 + carry - exponent;
    f32::from_bits(scale_exponent << FRACTION_BITS | (quotient >> carry) & (hidden - 1))
}

/// A grid of 2ᵏ cells per axis over a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MortonGrid {
    lower: Vec3,
    scale: Vec3,
    axis_bits: u32,
}

impl MortonGrid {
    /// The grid over `bounds`, which must hold every point that is asked for; the bounds of no point at all give a grid of one cell.
    pub fn new(bounds: &Aabb, axis_bits: u32) -> Self {
        let extent = bounds.upper - bounds.lower;
        Self {
            lower: bounds.lower,
            scale: Vec3::from_array(extent.to_array().map(|e| cells_per_length(e, axis_bits))),
            axis_bits,
        }
    }

    /// The cell of a point; a coordinate that is NaN lies in the last.
    pub fn cell(&self, point: Vec3) -> [u32; 3] {
        let last = (1u32 << self.axis_bits) - 1;
        let place = (point - self.lower) * self.scale;
        place.to_array().map(|x| if x < last as f32 { x as u32 } else { last })
    }

    /// The code of a point: 3k bits.
    pub fn code(&self, point: Vec3) -> u64 {
        let cell = self.cell(point);
        if self.axis_bits == MORTON_30_AXIS_BITS {
            u64::from(morton_30(cell))
        } else {
            morton_63(cell)
        }
    }
}

/// Interleaves three numbers of 10 bits, z first.
pub fn morton_30(cell: [u32; 3]) -> u32 {
    spread_10(cell[2]) << 2 | spread_10(cell[1]) << 1 | spread_10(cell[0])
}

/// Interleaves three numbers of 21 bits, z first.
pub fn morton_63(cell: [u32; 3]) -> u64 {
    // Eleven bits make 33, so the low word is made of ten each, and the next is put between.
    let low = morton_30(cell.map(|c| c & 0x3FF));
    let high = cell.map(|c| c >> 10);
    let middle = morton_30(high.map(|c| c & 0x3FF));
    let top = high[2] >> 10 << 2 | high[1] >> 10 << 1 | high[0] >> 10;
    u64::from(top) << 60 | u64::from(middle) << 30 | u64::from(low)
}

/// Puts two zeros before each of ten bits.
fn spread_10(x: u32) -> u32 {
    let x = (x | x << 16) & 0x0300_00FF;
    let x = (x | x << 8) & 0x0300_F00F;
    let x = (x | x << 4) & 0x030C_30C3;
    (x | x << 2) & 0x0924_9249
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_random::Random;

    fn interleaved(cell: [u32; 3], axis_bits: u32) -> u64 {
        let bit = |i: u32, axis: usize| u64::from(cell[axis] >> i & 1) << (3 * i + axis as u32);
        (0..axis_bits)
            .flat_map(|i| (0..3).map(move |axis| (i, axis)))
            .fold(0, |code, (i, axis)| code | bit(i, axis))
    }

    #[test]
    fn codes_interleave_bits_with_z_first() {
        let mut random = Random(31);
        for _ in 0..10_000 {
            let cell = [0; 3].map(|_: u32| random.word() >> 11);
            assert_eq!(morton_63(cell), interleaved(cell, 21), "{cell:?}");
            let cell = cell.map(|c| c >> 11);
            assert_eq!(u64::from(morton_30(cell)), interleaved(cell, 10), "{cell:?}");
        }
        assert_eq!(morton_30([0, 0, 512]), 1 << 29);
        assert_eq!(morton_63([0x1F_FFFF; 3]), (1 << 63) - 1);
    }

    #[test]
    fn scales_are_the_exact_quotient_cut_to_24_bits() {
        let mut random = Random(32);
        for i in 0..20_000 {
            let extent = if i % 4 == 0 {
                2f32.powi(i % 90 - 60)
            } else {
                random.magnitude(-80, 31)
            };
            for axis_bits in [10, 21] {
                let scale = f64::from(cells_per_length(extent, axis_bits));
                let exact = f64::from(1u32 << axis_bits) / f64::from(extent);
                // Truncation to 24 bits: less than one unit of 2⁻²³ below, and never above.
                assert!(scale <= exact && scale > exact * (1.0 - 2f64.powi(-23)), "{extent:e}");
            }
        }
        for none in [
            0.0,
            -0.0,
            1e-40,
            2f32.powi(-91),
            -1.0,
            f32::NAN,
            f32::INFINITY,
            2f32.powi(32),
        ] {
            assert_eq!(cells_per_length(none, 10), 0.0, "{none}");
        }
    }

    #[test]
    fn cells_fill_the_grid_and_keep_order() {
        let bounds = Aabb {
            lower: Vec3::new(-3.0, 1e5, 0.25),
            upper: Vec3::new(7.0, 1e5 + 1.0, 0.25),
        };
        for axis_bits in [10, 21] {
            let last = (1 << axis_bits) - 1;
            let grid = MortonGrid::new(&bounds, axis_bits);
            assert_eq!(grid.cell(bounds.lower), [0; 3]);
            assert_eq!(grid.cell(bounds.upper), [last, last, 0]);
            assert_eq!(grid.cell(Vec3::NAN), [last; 3]);
            let mut random = Random(33);
            let mut places: Vec<f32> = (0..1000).map(|_| random.range(-3.0, 7.0)).collect();
            places.sort_by(f32::total_cmp);
            let cells: Vec<u32> = places.iter().map(|x| grid.cell(bounds.lower.with_x(*x))[0]).collect();
            assert!(cells.is_sorted());
        }
        assert_eq!(MortonGrid::new(&Aabb::EMPTY, 10).cell(Vec3::ONE), [1023; 3]);
    }
}
