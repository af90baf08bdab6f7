//! Free flight and transmittance: what does marching err, what does tracking cost?
//!
//! Oracle: the closed form of each profile's optical depth.

use std::cell::Cell;
use std::f64::consts::TAU;

use clerestory::Result;
use clerestory::transport::free_flight::{
    adaptively_marched_free_flight, marched_free_flight, marched_transmittance, ratio_tracked_transmittance,
    tracked_free_flight,
};
use clerestory::transport::medium::{sample_free_flight, transmittance};
use glam::DVec3;

use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds;
use crate::experiments::table::Table;
use crate::random::Random;

/// Flights and estimates end here, m.
const T_MAX: f64 = 1.0;
/// Look-ups that a marched ray makes.
const STEPS: [u32; 3] = [8, 64, 512];
/// Steps of adaptive marching in local mean free paths.
const SHARES: [f64; 2] = [0.5, 0.05];
/// The longest of them, m.
const LONGEST: f64 = 0.125;
/// Majorants as multiples of the greatest extinction.
const LOOSENESS: [f64; 2] = [1.0, 8.0];

/// Extinction along a ray.
struct Profile {
    name: &'static str,
    /// m⁻¹.
    extinction: fn(f64) -> f64,
    /// Its integral from 0.
    depth: fn(f64) -> f64,
    /// Its greatest value.
    greatest: f64,
}

const EVEN: f64 = 4.0;
const RISING: f64 = 8.0;
const WAVES: f64 = 4.0;
/// Waves in a metre.
const FREQUENCY: f64 = 5.3;
/// A layer begins each time after this way, m; the first one after half of it.
const LAYER_EVERY: f64 = 0.23;
const LAYER_WIDTH: f64 = 0.005;
const LAYER: f64 = 200.0;

const PROFILES: [Profile; 4] = [
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

/// The extinction along a ray.
type Extinction<'a> = dyn Fn(f64) -> f64 + 'a;
/// Draws from [0, 1).
type Draw<'a> = dyn FnMut() -> f64 + 'a;

/// A way to estimate the transmittance.
struct Estimate<'a> {
    name: String,
    majorant: Option<f64>,
    run: &'a dyn Fn(&Extinction<'_>, &mut Draw<'_>) -> f64,
}

fn transmittances(context: &Context<'_>, samples: u32) -> Table {
    let mut table = Table::new(
        "Transmittance over a metre",
        &[
            "profile",
            "method",
            "mean / exact − 1",
            "its standard error",
            "relative deviation of one",
            "look-ups",
            "ns",
        ],
    );
    for profile in &PROFILES {
        let exact = (-(profile.depth)(T_MAX)).exp();
        let mut row = |estimate: &Estimate<'_>| {
            let looked_up = Cell::new(0_u64);
            let extinction = |t: f64| {
                looked_up.set(looked_up.get() + 1);
                (profile.extinction)(t)
            };
            let mut random = Random::new(1);
            let mut draw = || random.unit();
            // What draws nothing is the same each time.
            let count = if estimate.majorant.is_some() { samples } else { 1 };
            let (mut mean, mut squares) = (0.0, 0.0);
            for i in 1..=count {
                let value = (estimate.run)(&extinction, &mut draw) / exact - 1.0;
                let difference = value - mean;
                mean += difference / f64::from(i);
                squares += difference * (value - mean);
            }
            let deviation = (squares / f64::from(count.max(2) - 1)).sqrt();
            let look_ups = looked_up.get() as f64 / f64::from(count);
            let plain = |t: f64| (profile.extinction)(t);
            let time = nanoseconds(context.smoke, &[(); 256], |()| (estimate.run)(&plain, &mut draw));
            table.row([
                profile.name.into(),
                estimate.name.as_str().into(),
                mean.into(),
                (deviation / f64::from(count).sqrt()).into(),
                deviation.into(),
                look_ups.into(),
                time.into(),
            ]);
        };
        if profile.name == PROFILES[0].name {
            row(&Estimate {
                name: "analytic".into(),
                majorant: None,
                run: &|_, _| transmittance(DVec3::splat(EVEN), T_MAX).x,
            });
        }
        for steps in STEPS {
            for (place, word) in [(1.0, "ends"), (0.5, "middles")] {
                row(&Estimate {
                    name: format!("marched, {steps} steps, {word}"),
                    majorant: None,
                    run: &|extinction, _| marched_transmittance(extinction, T_MAX, steps, place),
                });
            }
        }
        for looseness in LOOSENESS {
            let majorant = looseness * profile.greatest;
            row(&Estimate {
                name: format!("ratio tracking, majorant × {looseness}"),
                majorant: Some(majorant),
                run: &|extinction, draw| ratio_tracked_transmittance(extinction, majorant, T_MAX, draw),
            });
        }
    }
    table.note(format!(
        "Means of {samples} estimates; a marched one draws nothing and is made once. Its error is all bias; that of tracking is noise, \
         which falls with the root of the number of estimates."
    ));
    table
}

/// Greatest distance between the distribution of what `flight` gives and the profile's; a flight without collision ends at [`T_MAX`].
fn distance_of_distributions(profile: &Profile, samples: u32, mut flight: impl FnMut() -> Option<f64>) -> f64 {
    let mut ends: Vec<f64> = (0..samples).filter_map(|_| flight()).collect();
    ends.sort_by(f64::total_cmp);
    let n = f64::from(samples);
    let cumulative = |t: f64| 1.0 - (-(profile.depth)(t)).exp();
    let at = |(i, t): (usize, &f64)| {
        let f = cumulative(*t);
        ((i + 1) as f64 / n - f).abs().max((f - i as f64 / n).abs())
    };
    let inside = ends.iter().enumerate().map(at).fold(0.0, f64::max);
    inside.max((ends.len() as f64 / n - cumulative(T_MAX)).abs())
}

type Flight<'a> = (
    String,
    &'a dyn Fn(&dyn Fn(f64) -> f64, &mut dyn FnMut() -> f64) -> Option<f64>,
);

fn flights(context: &Context<'_>, samples: u32) -> Table {
    let mut table = Table::new(
        "Free flight",
        &[
            "profile",
            "method",
            "greatest error of the probability",
            "of chance, 1 in 100",
            "look-ups",
            "ns",
        ],
    );
    // Kolmogorov's limit: √n times the distance exceeds this once in a hundred.
    let by_chance = 1.628 / f64::from(samples).sqrt();
    for profile in &PROFILES {
        let mut row = |(name, fly): Flight<'_>| {
            let looked_up = Cell::new(0_u64);
            let extinction = |t: f64| {
                looked_up.set(looked_up.get() + 1);
                (profile.extinction)(t)
            };
            let mut random = Random::new(2);
            let mut draw = || random.unit();
            let distance = distance_of_distributions(profile, samples, || fly(&extinction, &mut draw));
            let look_ups = looked_up.get() as f64 / f64::from(samples);
            let plain = |t: f64| (profile.extinction)(t);
            let time = nanoseconds(context.smoke, &[(); 256], |()| fly(&plain, &mut draw));
            table.row([
                profile.name.into(),
                name.into(),
                distance.into(),
                by_chance.into(),
                look_ups.into(),
                time.into(),
            ]);
        };
        if profile.name == PROFILES[0].name {
            row(("analytic".into(), &|_, draw| {
                let sigma = DVec3::splat(EVEN);
                let flight = sample_free_flight(sigma, sigma, DVec3::splat(1.0 / 3.0), T_MAX, [draw(), draw()]);
                flight.collides.then_some(flight.t)
            }));
        }
        for steps in STEPS {
            row((format!("marched, steps of 1/{steps} m"), &|extinction, draw| {
                marched_free_flight(extinction, T_MAX, T_MAX / f64::from(steps), draw)
            }));
        }
        for share in SHARES {
            row((
                format!("marched, steps of {share} mean free paths"),
                &|extinction, draw| adaptively_marched_free_flight(extinction, T_MAX, share, LONGEST, draw),
            ));
        }
        for looseness in LOOSENESS {
            let majorant = looseness * profile.greatest;
            row((
                format!("delta tracking, majorant × {looseness}"),
                &|extinction, draw| tracked_free_flight(extinction, majorant, T_MAX, draw),
            ));
        }
    }
    table.note(format!(
        "The greatest distance between the distribution of {samples} flights and the exact one (Kolmogorov and Smirnov), flights without a \
         collision included. Without bias one in a hundred exceeds the column beside it."
    ));
    table
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let samples = if context.smoke { 2000 } else { 1_000_000 };
    Ok(vec![transmittances(context, samples), flights(context, samples)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_are_the_integrals_of_their_extinction() {
        /// Steps of the midpoint rule; a jump of the extinction costs at most its height times a step.
        const STEPS: u32 = 100_000;
        for profile in &PROFILES {
            for t in [0.0, 0.1, 0.117, 0.2, 0.346, 0.7, T_MAX] {
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
