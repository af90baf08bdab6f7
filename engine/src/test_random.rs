//! Seeded random numbers for test data: SplitMix64 (Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
//!
//! The integration tests include this file as a module of theirs.

use glam::Vec3;

/// A stream of random numbers; its state is the seed.
pub struct Random(pub u64);

impl Random {
    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// 32 random bits.
    pub fn word(&mut self) -> u32 {
        (self.bits() >> 32) as u32
    }

    /// A number below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// Uniform in [0, 1), a multiple of 2⁻²⁴ as the samplers' numbers are.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / 16_777_216.0
    }

    /// Uniform in [low, high).
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// Uniform in [-1, 1)³.
    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }

    /// A uniform direction, of unit length to f32 rounding.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.vector();
            let squared = v.length_squared();
            if squared > 0.01 && squared < 1.0 {
                return v.normalize();
            }
        }
    }

    /// One of the values.
    pub fn choose<T: Copy>(&mut self, values: &[T]) -> T {
        values[self.below(values.len())]
    }

    /// Uniform in [-1, 1).
    pub fn signed(&mut self) -> f32 {
        self.range(-1.0, 1.0)
    }

    /// A power of two from 2^low to below 2^high, with a random factor in [1, 2).
    pub fn magnitude(&mut self, low: i32, high: i32) -> f32 {
        2f32.powi(low + self.below((high - low) as usize) as i32) * (1.5 + 0.5 * self.signed())
    }
}
