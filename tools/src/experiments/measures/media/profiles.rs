//! Profiles of extinction along a ray, with the closed form of each one's optical depth.

use std::f64::consts::TAU;

/// Extinction along a ray.
pub struct Profile {
    /// What it is called.
    pub name: &'static str,
    /// At a distance, m⁻¹.
    pub extinction: fn(f64) -> f64,
    /// Its integral from 0.
    pub depth: fn(f64) -> f64,
    /// Its greatest value.
    pub greatest: f64,
}

/// Extinction of the even profile, m⁻¹.
pub const EVEN: f64 = 4.0;
const RISING: f64 = 8.0;
const WAVES: f64 = 4.0;
/// Waves in a metre.
const FREQUENCY: f64 = 5.3;
/// A layer begins each time after this way, m; the first one after half of it.
const LAYER_EVERY: f64 = 0.23;
const LAYER_WIDTH: f64 = 0.005;
const LAYER: f64 = 200.0;

/// All of them.
pub const PROFILES: [Profile; 4] = [
    Profile {
        name: "even",
        extinction: |_| EVEN,
        depth: |t| EVEN * t,
        greatest: EVEN,
    },
    Profile {
        name: "rising",
        extinction: |t| RISING * t,
        depth: |t| 0.5 * RISING * t * t,
        greatest: RISING,
    },
    Profile {
        name: "waves",
        extinction: |t| WAVES * (1.0 + (TAU * FREQUENCY * t).sin()),
        depth: |t| WAVES * (t + (1.0 - (TAU * FREQUENCY * t).cos()) / (TAU * FREQUENCY)),
        greatest: 2.0 * WAVES,
    },
    Profile {
        name: "thin layers",
        extinction: |t| if within_layer(t) < LAYER_WIDTH { LAYER } else { 0.0 },
        depth: |t| {
            let begun = from_first_layer(t).max(-1.0).floor() + 1.0;
            LAYER * (begun * LAYER_WIDTH - (LAYER_WIDTH - within_layer(t)).max(0.0))
        },
        greatest: LAYER,
    },
];

/// Ways of [`LAYER_EVERY`] since the first layer began.
fn from_first_layer(t: f64) -> f64 {
    (t - 0.5 * LAYER_EVERY) / LAYER_EVERY
}

/// Distance from the begin of the last layer begun; without end before the first one.
fn within_layer(t: f64) -> f64 {
    let from = from_first_layer(t);
    if from < 0.0 {
        return f64::INFINITY;
    }
    from.fract() * LAYER_EVERY
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_are_the_integrals_of_their_extinction() {
        /// Steps of the midpoint rule; a jump of the extinction costs at most its height times a step.
        const STEPS: u32 = 100_000;
        for profile in &PROFILES {
            for t in [0.0, 0.1, 0.117, 0.2, 0.346, 0.7, 1.0] {
                let step = t / f64::from(STEPS);
                let at = |i: u32| (profile.extinction)((f64::from(i) + 0.5) * step);
                let integral = (0..STEPS).map(at).sum::<f64>() * step;
                let exact = (profile.depth)(t);
                assert!(
                    (integral - exact).abs() < 1e-8 + 8.0 * step * profile.greatest,
                    "{}: {t}",
                    profile.name
                );
                assert!((0..STEPS).all(|i| at(i) <= profile.greatest));
            }
        }
    }
}
