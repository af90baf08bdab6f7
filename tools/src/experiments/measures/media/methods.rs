//! Ways to estimate the transmittance of a profile, and to fly through it.

use clerestory::transport::free_flight::{
    adaptively_marched_free_flight, marched_free_flight, marched_transmittance, ratio_tracked_transmittance,
    tracked_free_flight,
};
use clerestory::transport::medium::{sample_free_flight, transmittance};
use glam::DVec3;

use super::profiles::{EVEN, PROFILES, Profile};

/// Flights and estimates end here, m.
pub const T_MAX: f64 = 1.0;
/// Look-ups that a marched ray makes.
pub const STEPS: [u32; 3] = [8, 64, 512];
/// Where in a step it looks, and how that is called.
pub const PLACES: [(f64, &str); 2] = [(1.0, "ends"), (0.5, "middles")];
/// Steps of adaptive marching in local mean free paths.
const SHARES: [f64; 2] = [0.5, 0.05];
/// The longest of them, m.
const LONGEST: f64 = 0.125;
/// Majorants as multiples of the greatest extinction.
pub const LOOSENESS: [f64; 2] = [1.0, 8.0];

/// Of the transmittance, without bias.
pub const RATIO: &str = "ratio tracking";
/// Of flights, without bias.
pub const DELTA: &str = "delta tracking";

/// The extinction along a ray.
pub type Extinction<'a> = dyn Fn(f64) -> f64 + 'a;
/// Draws from [0, 1).
pub type Draw<'a> = dyn FnMut() -> f64 + 'a;

/// Estimates or flies once.
type Run<R> = dyn Fn(&Extinction<'_>, &mut Draw<'_>) -> R;

/// A way to estimate the transmittance, or to fly.
pub struct Method<R> {
    /// What it is called.
    pub name: String,
    /// Gives one.
    pub run: Box<Run<R>>,
}

fn method<R>(name: impl Into<String>, run: impl Fn(&Extinction<'_>, &mut Draw<'_>) -> R + 'static) -> Method<R> {
    Method {
        name: name.into(),
        run: Box::new(run),
    }
}

/// How a marched estimate is called.
pub fn marched(steps: u32, place: &str) -> String {
    format!("marched, {steps} steps, {place}")
}

/// Ways to estimate the transmittance.
pub fn estimates(profile: &Profile) -> Vec<Method<f64>> {
    let mut all = Vec::new();
    if profile.name == PROFILES[0].name {
        all.push(method("analytic", |_, _| transmittance(DVec3::splat(EVEN), T_MAX).x));
    }
    for steps in STEPS {
        for (place, word) in PLACES {
            let name = marched(steps, word);
            all.push(method(name, move |extinction, _| {
                marched_transmittance(extinction, T_MAX, steps, place)
            }));
        }
    }
    for looseness in LOOSENESS {
        let majorant = looseness * profile.greatest;
        let name = format!("{RATIO}, majorant × {looseness}");
        all.push(method(name, move |extinction, draw| {
            ratio_tracked_transmittance(extinction, majorant, T_MAX, draw)
        }));
    }
    all
}

/// Ways to fly; a flight without collision gives none.
pub fn flights(profile: &Profile) -> Vec<Method<Option<f64>>> {
    let mut all = Vec::new();
    if profile.name == PROFILES[0].name {
        all.push(method("analytic", |_, draw| {
            let sigma = DVec3::splat(EVEN);
            let flight = sample_free_flight(sigma, sigma, DVec3::splat(1.0 / 3.0), T_MAX, [draw(), draw()]);
            flight.collides.then_some(flight.t)
        }));
    }
    for steps in STEPS {
        let name = format!("marched, steps of 1/{steps} m");
        all.push(method(name, move |extinction, draw| {
            marched_free_flight(extinction, T_MAX, T_MAX / f64::from(steps), draw)
        }));
    }
    for share in SHARES {
        let name = format!("marched, steps of {share} mean free paths");
        all.push(method(name, move |extinction, draw| {
            adaptively_marched_free_flight(extinction, T_MAX, share, LONGEST, draw)
        }));
    }
    for looseness in LOOSENESS {
        let majorant = looseness * profile.greatest;
        let name = format!("{DELTA}, majorant × {looseness}");
        all.push(method(name, move |extinction, draw| {
            tracked_free_flight(extinction, majorant, T_MAX, draw)
        }));
    }
    all
}
