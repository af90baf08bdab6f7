//! Sums of samples that stay exact for millions of samples, in pairs of 32-bit floats.
//!
//! A plain f32 sum stalls once it is 2²⁴ times its next summand, and is wrong long before. Here each sum is the unevaluated pair
//! `hi + lo` of two f32 numbers, about 48 significant bits, updated by error-free transformations: `two_sum` (Knuth, *The Art of Computer
//! Programming* vol. 2, §4.2.2, theorem B), `quick_two_sum`, `split` and `two_product` (Dekker, *A floating-point technique for extending
//! the available precision*, 1971; the splitting is Veltkamp's). `shaders/film/two_float.glsl` holds the same functions under
//! the same names; the f32 operations are the same in the same order, so both sides give the same bits wherever the device keeps
//! subnormal numbers and does not contract (`precise` forbids it).
//!
//! Guarantees: deterministic for a fixed order of samples. One addition errs by at most 2⁻⁴⁶ of the operands' magnitudes, so n additions of
//! one sign err by at most n · 2⁻⁴⁶ relative: 1.5e-8 for 10⁶ samples, below half an f32 ulp.

use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;

/// The unevaluated sum `hi + lo`, with |lo| at most half an ulp of `hi`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct TwoFloat {
    /// The rounded value.
    pub hi: f32,
    /// What rounding left over.
    pub lo: f32,
}

impl TwoFloat {
    /// Zero.
    pub const ZERO: Self = Self { hi: 0.0, lo: 0.0 };

    /// The pair as one f64: exact when its bits span at most 53 places, else rounded to nearest.
    pub fn to_f64(self) -> f64 {
        f64::from(self.hi) + f64::from(self.lo)
    }
}

/// Veltkamp's constant 2¹² + 1 for a 24-bit significand.
const TWO_FLOAT_SPLITTER: f32 = constants::TWO_FLOAT_SPLITTER;

/// `a + b = hi + lo` exactly, whatever the magnitudes, unless the sum overflows (Knuth's six operations).
pub fn two_sum(a: f32, b: f32) -> TwoFloat {
    let sum = a + b;
    let b_virtual = sum - a;
    let a_virtual = sum - b_virtual;
    let b_error = b - b_virtual;
    let a_error = a - a_virtual;
    TwoFloat {
        hi: sum,
        lo: a_error + b_error,
    }
}

/// `a + b = hi + lo` exactly, for |a| ≥ |b| or a = 0 (Dekker's three operations).
pub fn quick_two_sum(a: f32, b: f32) -> TwoFloat {
    let sum = a + b;
    let b_virtual = sum - a;
    TwoFloat {
        hi: sum,
        lo: b - b_virtual,
    }
}

/// `a = hi + lo` exactly, each with at most 12 significant bits, for |a| < 2¹¹⁵ (Veltkamp).
pub fn split(a: f32) -> TwoFloat {
    let scaled = TWO_FLOAT_SPLITTER * a;
    let hi = scaled - (scaled - a);
    TwoFloat { hi, lo: a - hi }
}

/// `a · b = hi + lo` exactly, unless the product overflows or its error term is subnormal (Dekker).
///
/// It splits its factors instead of using a fused multiply-add, since GLSL's `fma` may round twice.
pub fn two_product(a: f32, b: f32) -> TwoFloat {
    let product = a * b;
    let (x, y) = (split(a), split(b));
    let rest = ((x.hi * y.hi - product) + x.hi * y.lo) + x.lo * y.hi;
    TwoFloat {
        hi: product,
        lo: rest + x.lo * y.lo,
    }
}

/// `a + b` with an error of at most 2⁻⁴⁶ (|a| + |b|).
pub fn two_float_add(a: TwoFloat, b: f32) -> TwoFloat {
    let sum = two_sum(a.hi, b);
    quick_two_sum(sum.hi, a.lo + sum.lo)
}

/// `a + b` with an error of at most 2⁻⁴⁴ (|a| + |b|).
pub fn two_float_add_two_float(a: TwoFloat, b: TwoFloat) -> TwoFloat {
    let sum = two_sum(a.hi, b.hi);
    quick_two_sum(sum.hi, (a.lo + b.lo) + sum.lo)
}

/// `a + x²`, the square taken exactly.
pub fn two_float_add_square(a: TwoFloat, x: f32) -> TwoFloat {
    two_float_add_two_float(a, two_product(x, x))
}

/// Count, sum and sum of squares of one channel of one pixel: its mean and the variance of that mean.
///
/// Variance comes from the two sums, finished in f64. Each sum carries 48 bits, so the cancellation in Σx² − (Σx)²/n costs a relative error of
/// about n · 2⁻⁴⁴ · mean²/variance at worst (√n in place of n when roundings behave randomly): with a mean a thousand times the standard
/// deviation, 10⁶ samples still give the variance to better than a per cent at worst and 10⁻⁴ typically, where an f32 sum of squares gives
/// noise. Sums were preferred to Welford's update because they need no division on the device, merge by addition and do not depend on a
/// running mean. Squares overflow for |x| > 1.8e19, which shows as an infinite variance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Accumulator {
    /// Number of samples.
    pub count: u64,
    /// Σx.
    pub sum: TwoFloat,
    /// Σx².
    pub sum_of_squares: TwoFloat,
}

impl Accumulator {
    /// Adds one sample.
    pub fn add(&mut self, x: f32) {
        self.count += 1;
        self.sum = two_float_add(self.sum, x);
        self.sum_of_squares = two_float_add_square(self.sum_of_squares, x);
    }

    /// Adds another accumulator's samples.
    pub fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.sum = two_float_add_two_float(self.sum, other.sum);
        self.sum_of_squares = two_float_add_two_float(self.sum_of_squares, other.sum_of_squares);
    }

    /// Σx / n; 0 without samples.
    pub fn mean(&self) -> f64 {
        if self.count == 0 {
            0.0
        } else {
            self.sum.to_f64() / self.count as f64
        }
    }

    /// Unbiased sample variance (Σx² − (Σx)²/n) / (n − 1), never negative; 0 with fewer than two samples.
    pub fn variance(&self) -> f64 {
        if self.count < 2 {
            return 0.0;
        }
        let (sum, n) = (self.sum.to_f64(), self.count as f64);
        let variance = (self.sum_of_squares.to_f64() - sum * sum / n) / (n - 1.0);
        // A plain comparison lets a NaN through, so that it is seen and counted.
        if variance < 0.0 { 0.0 } else { variance }
    }

    /// Variance of the mean, variance / n; an estimate that assumes independent samples (it is an upper estimate for stratified ones).
    pub fn variance_of_mean(&self) -> f64 {
        if self.count == 0 {
            0.0
        } else {
            self.variance() / self.count as f64
        }
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-SUM",
    name: "sums of samples in pairs of floats",
    role: Role::PartOf("BG-3"),
    limits: "About 48 bits: an addition errs by up to 2⁻⁴⁶ of its operands.",
    sources: &[sources::DEKKER_1971.whole(), sources::JOLDES_2017.whole()],
    shaders: &["shaders/film/two_float.glsl"],
    tests: &[
        "engine/src/film/accumulate.rs::a_million_equal_samples_do_not_stall",
        "engine/src/film/accumulate.rs::few_samples_have_their_unbiased_variance",
        "engine/src/film/accumulate.rs::alternating_magnitudes_agree_with_an_integer_sum",
        "tests/tests/twins/sums.rs::sums_in_pairs_are_equal_bit_for_bit",
    ],
    api: &["clerestory::film::Accumulator"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn two_sum_loses_nothing(a in -16_777_215i32..16_777_216, b in -16_777_215i32..16_777_216, shift in 0i32..60) {
            // Whole numbers below 2^84 are exact in f32 and in i128 alike, and so are their rounding errors.
            let (a, b) = (a as f32, b as f32 * (shift as f32).exp2());
            for (a, b) in [(a, b), (b, a)] {
                let pair = two_sum(a, b);
                prop_assert_eq!(a as i128 + b as i128, pair.hi as i128 + pair.lo as i128);
                prop_assert_eq!(pair.hi, a + b);
            }
        }

        #[test]
        fn two_product_loses_nothing(a in -1e9f32..1e9, b in -1e9f32..1e9) {
            let pair = two_product(a, b);
            // 24 + 24 bits fit the 53 of an f64; error terms of subnormal size need |ab| < 1e-30.
            prop_assume!(a == 0.0 || b == 0.0 || (a * b).abs() > 1e-30);
            prop_assert_eq!(f64::from(a) * f64::from(b), pair.to_f64());
        }

        #[test]
        fn split_halves_are_short_and_exact(a in -1e30f32..1e30) {
            let halves = split(a);
            prop_assert_eq!(halves.hi + halves.lo, a);
            prop_assert_eq!(halves.hi.to_bits() & 0xfff, 0);
        }
    }

    #[test]
    fn a_million_equal_samples_do_not_stall() {
        let (mut sum, mut plain) = (TwoFloat::ZERO, 0f32);
        for _ in 0..1_000_000 {
            sum = two_float_add(sum, 0.1);
            plain += 0.1;
        }
        let exact = f64::from(0.1f32) * 1e6;
        // n · 2⁻⁴⁶, the bound of the module's comment.
        assert!((sum.to_f64() - exact).abs() <= exact * 1e6 * 2f64.powi(-46), "{sum:?}");
        assert!(
            (f64::from(plain) - exact).abs() > 1e-4 * exact,
            "a plain sum should have failed"
        );
    }

    #[test]
    fn alternating_magnitudes_agree_with_an_integer_sum() {
        let mut sum = TwoFloat::ZERO;
        let (mut exact, mut magnitude) = (0i128, 0f64);
        for i in 0..1_000_000u32 {
            let x = match i % 4 {
                0 => 0.1f32,
                1 => 3.0e4,
                2 => 1.0e-3,
                _ => -2.9e4,
            };
            sum = two_float_add(sum, x);
            exact += (f64::from(x) * 2f64.powi(40)) as i128;
            magnitude += f64::from(x.abs());
        }
        let exact = exact as f64 * 2f64.powi(-40);
        assert!(
            (sum.to_f64() - exact).abs() <= magnitude * 1e6 * 2f64.powi(-46),
            "{sum:?} {exact}"
        );
        assert!(
            (sum.to_f64() - exact).abs() <= exact * f64::from(f32::EPSILON) / 2.0,
            "{sum:?} {exact}"
        );
    }

    #[test]
    fn few_samples_have_their_unbiased_variance() {
        let mut statistics = Accumulator::default();
        for (x, variance) in [(3.0, 0.0), (5.0, 2.0), (1.0, 4.0), (7.0, 20.0 / 3.0)] {
            statistics.add(x);
            assert!((statistics.variance() - variance).abs() < 1e-14, "{x}");
            assert!(
                (statistics.variance_of_mean() - variance / statistics.count as f64).abs() < 1e-14,
                "{x}"
            );
        }
    }

    #[test]
    fn variance_survives_a_large_mean() {
        let mut statistics = Accumulator::default();
        let (mut values, mut state) = (Vec::new(), 1u32);
        for _ in 0..100_000 {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            let x = 1000.0 + (state >> 8) as f32 / 16_777_216.0;
            values.push(f64::from(x));
            statistics.add(x);
        }
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        assert!((statistics.mean() - mean).abs() <= mean * n * 2f64.powi(-46));
        // n · 2⁻⁴⁴ · mean²/variance is the stated worst case.
        let bound = n * 2f64.powi(-44) * mean * mean / variance;
        assert!(bound < 0.1 && (statistics.variance() / variance - 1.0).abs() <= bound);
        // Roundings of random sign give √n in place of n; six standard deviations of that.
        assert!((statistics.variance() / variance - 1.0).abs() <= 6.0 * bound / n.sqrt());
    }

    #[test]
    fn merging_gives_the_same_statistics() {
        let (mut whole, mut left, mut right): (Accumulator, Accumulator, Accumulator) = Default::default();
        for i in 0..1000u32 {
            let x = ((i * 7919) % 1000) as f32 * 0.013;
            whole.add(x);
            (if i < 300 { &mut left } else { &mut right }).add(x);
        }
        left.merge(&right);
        assert_eq!(left.count, whole.count);
        assert!((left.mean() - whole.mean()).abs() <= whole.mean() * 1000.0 * 2f64.powi(-44));
        assert!((left.variance() - whole.variance()).abs() <= whole.variance() * 1e5 * 2f64.powi(-44));
    }

    #[test]
    fn a_nan_sample_is_not_hidden() {
        let mut statistics = Accumulator::default();
        statistics.add(1.0);
        statistics.add(f32::NAN);
        assert!(statistics.mean().is_nan() && statistics.variance().is_nan());
    }
}
