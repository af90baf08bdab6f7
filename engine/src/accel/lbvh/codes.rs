//! Morton codes of boxes in order, and where neighbours among them part.
//!
//! Equal codes are told apart by their places, as in T. Karras, "Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d
//! Trees", HPG 2012.
//!
//! Guarantee: twin of the kernels `lbvh_grid` and `lbvh_codes` to the bit, and of `lbvh_level`; the same whatever the number of threads.

use super::sort::sort_by_key;
use crate::accel::Aabb;
use crate::accel::morton::{MORTON_30_AXIS_BITS, MortonGrid, doubled_centre};
use rayon::prelude::*;

/// Level of a place whose code differs from the next in the lowest bit; where the codes are equal, places decide at the levels below.
const CODE_LEVEL: u8 = 32;

/// Primitives in the order of their codes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SortedCodes {
    /// Codes, ascending.
    pub codes: Vec<u64>,
    /// Primitive of each code; of equal codes in ascending order.
    pub order: Vec<u32>,
    /// Bits of a code.
    pub bits: u32,
}

impl SortedCodes {
    /// Codes of the boxes' centres in a grid over the exact bounds of these, sorted; ties by index.
    pub fn of_boxes(boxes: &[Aabb], axis_bits: u32) -> Self {
        Codes::of_boxes(boxes, axis_bits).sorted()
    }

    /// How the codes at a place and the next differ when their lowest `skipped` bits do not count: larger where a higher bit differs.
    #[cfg(test)]
    pub(crate) fn difference(&self, place: usize, skipped: u32) -> (u64, u32) {
        let codes = (self.codes[place] ^ self.codes[place + 1]) >> skipped;
        (codes, (place ^ (place + 1)) as u32)
    }

    /// How far up the codes at a place and the next differ when their lowest `skipped` bits do not count.
    pub(super) fn level(&self, place: usize, skipped: u32) -> u8 {
        match (self.codes[place] ^ self.codes[place + 1]) >> skipped {
            0 => (place ^ (place + 1)).ilog2() as u8,
            differing => CODE_LEVEL + differing.ilog2() as u8,
        }
    }

    /// The last place of the left child of a range, both ends included, of at least two.
    pub(super) fn split(&self, first: usize, last: usize, skipped: u32) -> usize {
        let differing = (self.codes[first] ^ self.codes[last]) >> skipped;
        if differing == 0 {
            let bit = (first ^ last).ilog2();
            return (last >> bit << bit) - 1;
        }
        let bit = differing.ilog2() + skipped;
        first + self.codes[first..=last].partition_point(|code| code >> bit & 1 == 0) - 1
    }
}

/// Codes in the order of what they are of.
pub(super) enum Codes {
    /// Of 30 bits, in the high words; the low ones are indices.
    Short(Vec<u64>),
    /// Longer ones, with indices.
    Long(Vec<(u64, u32)>, u32),
}

impl Codes {
    pub(super) fn of_boxes(boxes: &[Aabb], axis_bits: u32) -> Self {
        let centres = boxes
            .par_iter()
            .fold(|| Aabb::EMPTY, |bounds, b| bounds.with_point(doubled_centre(b)))
            .reduce(|| Aabb::EMPTY, Aabb::union);
        let grid = MortonGrid::new(&centres, axis_bits);
        let code = |b: &Aabb| grid.code(doubled_centre(b));
        let boxes = boxes.par_iter().enumerate();
        if axis_bits == MORTON_30_AXIS_BITS {
            Self::Short(boxes.map(|(i, b)| code(b) << 32 | i as u64).collect())
        } else {
            Self::Long(boxes.map(|(i, b)| (code(b), i as u32)).collect(), 3 * axis_bits)
        }
    }

    pub(super) fn sorted(self) -> SortedCodes {
        let (codes, order, bits) = match self {
            Self::Short(mut pairs) => {
                let bits = 3 * MORTON_30_AXIS_BITS;
                sort_by_key(&mut pairs, bits, |pair| pair >> 32);
                let (codes, order) = pairs.par_iter().map(|pair| (pair >> 32, *pair as u32)).unzip();
                (codes, order, bits)
            }
            Self::Long(mut pairs, bits) => {
                sort_by_key(&mut pairs, bits, |pair| pair.0);
                let (codes, order) = pairs.into_par_iter().unzip();
                (codes, order, bits)
            }
        };
        SortedCodes { codes, order, bits }
    }
}
