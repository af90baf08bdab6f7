//! What measures of photons' frames share: the way of a moving light, times of passes, and rates.

use clerestory::gpu::PassTiming;
use glam::Vec3;

/// The light's way in a frame: 3 cm an axis, away from ceilings, as the source's.
pub const STEP: Vec3 = Vec3::new(0.03, -0.03, 0.03);
/// How passes of photons are called.
pub const PHOTON_PASSES: &str = "photon: ";

/// GPU milliseconds of a pass; 0 without timestamps.
pub fn milliseconds(pass: &PassTiming) -> f64 {
    pass.nanoseconds.unwrap_or(0) as f64 * 1e-6
}

/// Thousands a second; 0 without timestamps.
pub fn rate(count: f64, milliseconds: f64) -> f64 {
    if milliseconds > 0.0 { count / milliseconds } else { 0.0 }
}
