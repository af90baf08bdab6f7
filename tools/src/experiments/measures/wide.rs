//! Numbers of about 106 bits: pairs of f64, for oracles of functions that are themselves computed in f64.
//!
//! Sources: D. E. Knuth, "The Art of Computer Programming", vol. 2, 4.2.2 (exact sum); T. J. Dekker, Numerische Mathematik 18, 1971 (pairs);
//! products by fused multiply-add. Relative errors of a few 2⁻¹⁰⁴, as long as nothing overflows or underflows.

use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

use glam::DVec3;

/// The unevaluated sum of two f64.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wide {
    high: f64,
    low: f64,
}

/// a + b without loss.
fn sum(a: f64, b: f64) -> Wide {
    let high = a + b;
    let b_there = high - a;
    Wide {
        high,
        low: (a - (high - b_there)) + (b - b_there),
    }
}

impl Wide {
    /// Zero.
    pub const ZERO: Self = Self { high: 0.0, low: 0.0 };

    /// The nearest f64.
    pub fn round(self) -> f64 {
        self.high + self.low
    }

    /// Square root of what is not negative; 0 of what is.
    pub fn sqrt(self) -> Self {
        let root = self.high.max(0.0).sqrt();
        if root == 0.0 {
            return Self::ZERO;
        }
        // One step of Newton's method doubles the digits.
        let rest = self - Self::from(root) * Self::from(root);
        sum(root, rest.round() / (2.0 * root))
    }
}

impl From<f64> for Wide {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl Add for Wide {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (high, low) = (sum(self.high, other.high), sum(self.low, other.low));
        let once = sum(high.high, high.low + low.high);
        sum(once.high, once.low + low.low)
    }
}

impl Neg for Wide {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            high: -self.high,
            low: -self.low,
        }
    }
}

impl Sub for Wide {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Wide {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let high = self.high * other.high;
        let rest = self.high.mul_add(other.high, -high);
        sum(high, rest + (self.high * other.low + self.low * other.high))
    }
}

impl Div for Wide {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let first = self.high / other.high;
        let rest = self - other * Self::from(first);
        let second = rest.high / other.high;
        let rest = rest - other * Self::from(second);
        sum(first, second) + Self::from(rest.high / other.high)
    }
}

impl PartialOrd for Wide {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        (*self - *other).high.partial_cmp(&0.0)
    }
}

/// Three wide numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WideVec(pub [Wide; 3]);

impl WideVec {
    /// a − b, exact.
    pub fn between(a: DVec3, b: DVec3) -> Self {
        Self([0, 1, 2].map(|i| sum(a[i], -b[i])))
    }

    /// Scalar product.
    pub fn dot(self, other: Self) -> Wide {
        self.0[0] * other.0[0] + self.0[1] * other.0[1] + self.0[2] * other.0[2]
    }

    /// Vector product.
    pub fn cross(self, other: Self) -> Self {
        let minor = |i: usize, j: usize| self.0[i] * other.0[j] - self.0[j] * other.0[i];
        Self([minor(1, 2), minor(2, 0), minor(0, 1)])
    }
}

impl From<DVec3> for WideVec {
    fn from(v: DVec3) -> Self {
        Self(v.to_array().map(Wide::from))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_beyond_f64_are_kept() {
        let third = Wide::from(1.0) / Wide::from(3.0);
        let one = third + third + third;
        assert!((one - Wide::from(1.0)).round().abs() < 1e-31);
        let root = Wide::from(2.0).sqrt();
        assert!((root * root - Wide::from(2.0)).round().abs() < 1e-31);
        let tiny = Wide::from(1.0) + Wide::from(1e-25);
        assert!(tiny > Wide::from(1.0) && (tiny - Wide::from(1.0)).round() == 1e-25);
        let a = WideVec::from(DVec3::new(1.0, 2.0, 3.0));
        let b = WideVec::between(DVec3::new(1e8, 5.0, 7.0), DVec3::new(1e-8, 0.0, 0.0));
        assert!(a.cross(b).dot(a).round().abs() < 1e-20);
    }
}
