//! The random stream of measurements, the same on every machine: PCG hashes of a counter (`clerestory::transport::random`).

use clerestory::transport::random::{pcg3d, unit_float};
use clerestory::transport::warp::square_to_sphere;
use glam::{DVec2, DVec3, UVec3};

/// A stream of random numbers.
pub struct Random {
    seed: u32,
    drawn: u64,
}

impl Random {
    /// The stream of that seed.
    pub fn new(seed: u32) -> Self {
        Self { seed, drawn: 0 }
    }

    /// 32 random bits.
    pub fn word(&mut self) -> u32 {
        let hash = pcg3d(UVec3::new(self.drawn as u32, (self.drawn >> 32) as u32, self.seed));
        self.drawn += 1;
        hash.x
    }

    /// Uniform in [0, 1), a multiple of 2⁻²⁴.
    pub fn unit(&mut self) -> f64 {
        unit_float(self.word())
    }

    /// Uniform in [low, high).
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Between `low` and `high`, which are positive, each magnitude as likely as any other.
    pub fn magnitude(&mut self, low: f64, high: f64) -> f64 {
        self.range(low.ln(), high.ln()).exp()
    }

    /// Uniform in [-1, 1)³.
    pub fn vector(&mut self) -> DVec3 {
        DVec3::new(self.range(-1.0, 1.0), self.range(-1.0, 1.0), self.range(-1.0, 1.0))
    }

    /// A uniform direction.
    pub fn direction(&mut self) -> DVec3 {
        square_to_sphere(DVec2::new(self.unit(), self.unit()))
    }
}
