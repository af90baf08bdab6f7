//! The first sixteen dimensions of Sobol's sequence, as eight pairs. Twin of `transport/sobol.glsl`, bit for bit.
//!
//! Primitive polynomials and first direction numbers of Joe and Kuo, "Constructing Sobol Sequences with Better Two-Dimensional Projections"
//! (SIAM J. Sci. Comput. 30, 2008), as far as the first 2¹⁶ points need them.

pub use crate::gpu::shaders::constants::{SOBOL_INDEX_BITS, SOBOL_PAIRS};

/// A primitive polynomial, its inner coefficients as bits, and the first direction numbers: as many as its degree.
struct Dimension(u32, &'static [u32]);

/// Of all dimensions but the first one, which is the reversed index.
const DIMENSIONS: [Dimension; 15] = [
    Dimension(0, &[1]),
    Dimension(1, &[1, 3]),
    Dimension(1, &[1, 3, 1]),
    Dimension(2, &[1, 1, 1]),
    Dimension(1, &[1, 1, 3, 3]),
    Dimension(4, &[1, 3, 5, 13]),
    Dimension(2, &[1, 1, 5, 5, 17]),
    Dimension(4, &[1, 1, 5, 5, 5]),
    Dimension(7, &[1, 1, 7, 11, 19]),
    Dimension(11, &[1, 1, 5, 1, 1]),
    Dimension(13, &[1, 1, 1, 3, 11]),
    Dimension(14, &[1, 3, 5, 5, 31]),
    Dimension(1, &[1, 3, 3, 9, 7, 49]),
    Dimension(13, &[1, 1, 1, 15, 21, 21]),
    Dimension(16, &[1, 3, 1, 13, 27, 49]),
];

/// Direction numbers of a dimension, counted from 0: what each bit of an index adds to the fraction.
pub fn sobol_directions(dimension: usize) -> [u32; SOBOL_INDEX_BITS as usize] {
    let mut v = std::array::from_fn(|k| 1 << (31 - k));
    let Some(Dimension(inner, first)) = dimension.checked_sub(1).and_then(|at| DIMENSIONS.get(at)) else {
        return v;
    };
    let degree = first.len();
    for k in 0..v.len() {
        v[k] = match first.get(k) {
            Some(number) => number << (31 - k),
            None => (1..degree)
                .filter(|i| inner >> (degree - 1 - i) & 1 == 1)
                .fold(v[k - degree] ^ (v[k - degree] >> degree), |sum, i| sum ^ v[k - i]),
        };
    }
    v
}

/// Both coordinates, as fixed-point fractions, of a point in a pair of dimensions below [`SOBOL_PAIRS`]; of the index its lower
/// [`SOBOL_INDEX_BITS`] bits.
pub fn sobol_pair(index: u32, pair: u32) -> [u32; 2] {
    [0, 1].map(|second| {
        let directions = sobol_directions((2 * pair + second) as usize);
        let ones = directions.iter().enumerate().filter(|(bit, _)| index >> bit & 1 == 1);
        ones.fold(0, |sum, (_, direction)| sum ^ direction)
    })
}
