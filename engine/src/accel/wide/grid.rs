//! The grid of a wide node: the step along an axis, and the planes of boxes on it.
//!
//! The corner and all planes are multiples of the step, a power of two, so that everything here is exact in f64: corner and step are chosen so that
//! 255 steps reach from the greatest multiple below the node to the least above it. Where the node has an extent, its coordinates are less than
//! 2³⁵ such steps, and where it has none, all planes are one of two multiples. The corner has no more bits than the coordinate that it lies below:
//! one of less than 2²⁴ steps is a whole number of them, and one beyond is a multiple of the step already.

/// Least exponent of a step: steps times reciprocal directions, which are at least 2⁻²⁸, times 2⁻¹⁶ are normal numbers of f32.
const LEAST_EXPONENT: i32 = -80;

/// Exponent bias of f32.
const BIAS: i32 = 127;

/// Largest plane.
const LAST_PLANE: f64 = 255.0;

/// An axis of a node's grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GridAxis {
    /// Corner, metres.
    pub corner: f32,
    /// Biased exponent of the step.
    pub exponent: u8,
    first: f64,
    step: f64,
}

impl GridAxis {
    /// The finest grid from `lower` to `upper`.
    pub fn over(lower: f32, upper: f32) -> Self {
        let extent = f64::from(upper) - f64::from(lower);
        // The exponent of a number of f64, rounded down: a step of twice as much may be needed.
        let least = |x: f64| (x.to_bits() >> 52 & 0x7FF) as i32 - 1023;
        let mut exponent = least(extent / LAST_PLANE).max(LEAST_EXPONENT);
        loop {
            let step = 2f64.powi(exponent);
            let first = (f64::from(lower) / step).floor();
            if (f64::from(upper) / step).ceil() - first <= LAST_PLANE {
                return Self {
                    corner: (first * step) as f32,
                    exponent: (exponent + BIAS) as u8,
                    first,
                    step,
                };
            }
            exponent += 1;
        }
    }

    /// Lower and upper plane around a part of it.
    pub fn planes(&self, lower: f32, upper: f32) -> [u8; 2] {
        let lower = (f64::from(lower) / self.step).floor() - self.first;
        let upper = (f64::from(upper) / self.step).ceil() - self.first;
        [lower as u8, upper as u8]
    }
}
