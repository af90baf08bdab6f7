//! Free flight and transmittance: what does marching err, what does tracking cost?
//!
//! Oracle: the closed form of each profile's optical depth.

use std::cell::Cell;

use clerestory::Result;

use super::methods::{DELTA, LOOSENESS, Method, PLACES, RATIO, STEPS, T_MAX, estimates, flights, marched};
use super::profiles::{PROFILES, Profile};
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Repeats, Study, curves, rows, z_most};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds_once;
use crate::experiments::measures::errors::greatest;
use crate::random::Random;

const TURNS: usize = 9;
/// Runs of a turn.
const RUNS: usize = 256;
/// Kolmogorov's limit: √n times the distance exceeds this once in a hundred.
const BY_CHANCE: f64 = 1.628;
/// Errors of sums in f64.
const ROUNDING: f64 = 1e-12;

const THIN: &str = "thin layers";
const WAVES: &str = "waves";

rows! {
    /// A method on a profile.
    struct Transmittance = "Transmittance over a metre" by [profile, method] {
        profile: String = "profile",
        method: String = "method",
        error: f64 = "mean / exact − 1",
        standard_error: f64 = "its standard error",
        deviation: f64 = "relative deviation of one",
        estimates: u64 = "estimates",
        look_ups: f64 = "look-ups",
        time: Repeats = "an estimate (ns)",
    }
}

rows! {
    /// Marching through a profile.
    struct Fall = "Fall of the error of marched transmittances" by [profile, place] {
        profile: String = "profile",
        place: String = "looks at",
        exponent: Option<f64> = "exponent of the steps",
    }
}

rows! {
    /// A method on a profile.
    struct Flight = "Free flight" by [profile, method] {
        profile: String = "profile",
        method: String = "method",
        distance: f64 = "greatest error of the probability",
        flights: u64 = "flights",
        look_ups: f64 = "look-ups",
        time: Repeats = "a flight (ns)",
    }
    beside "chance exceeds it once in a hundred" = |row| (BY_CHANCE / (row.flights as f64).sqrt()).into();
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    transmittances: Vec<Transmittance>,
    falls: Vec<Fall>,
    flights: Vec<Flight>,
}

const OF_TRANSMITTANCES: &[Criterion<Transmittance>] = &[Criterion::each(
    "tracked transmittances have no bias: |z| over what chance exceeds once in a hundred runs",
    Bound::AtMost(1.0),
    |row: &Transmittance| {
        let z = (row.error / row.standard_error).abs();
        (z / z_most(PROFILES.len() * LOOSENESS.len())).into()
    },
)
.among(|row| row.method.starts_with(RATIO))
.because("by Šidák for all profiles and majorants")];

const OF_FALLS: &[Criterion<Fall>] = &[
    Criterion::each(
        "the error of marching falls with the step in smooth profiles: exponent",
        Bound::AtMost(-0.9),
        |row: &Fall| row.exponent.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.exponent.is_some() && row.profile != THIN)
    .because("the first order or a higher one; a tenth is for what higher orders change")
    .in_every_form(),
    Criterion::each(
        "the error of marching falls with the step in thin layers: exponent",
        Bound::AtMost(-0.5),
        |row: &Fall| row.exponent.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.exponent.is_some() && row.profile == THIN)
    .because("edges that fall anywhere within steps: the first order, and half an order for how they fall in the fewer steps and in the more")
    .in_every_form(),
];

const OF_FLIGHTS: &[Criterion<Flight>] = &[Criterion::each(
    "tracked flights are distributed as they must be: √n times the greatest error",
    Bound::AtMost(1.92),
    |row: &Flight| (row.distance * (row.flights as f64).sqrt()).into(),
)
.among(|row| row.method.starts_with(DELTA))
.because("the largest of eight is beyond that once in a hundred runs, by Kolmogorov's distribution")];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        // A seed for each, or their noise would be one and the same.
        let mut seeds = 1..;
        let mut seed = || seeds.next().unwrap_or_default();
        let name = |profile: &Profile| profile.name.to_owned();
        let transmittances = context.each(&PROFILES, name, |profile| {
            let methods = estimates(profile);
            let times = times(context, profile, &methods)?;
            let rows = methods.iter().zip(times).map(|(method, time)| Transmittance {
                time,
                ..transmittance_of(context, profile, method, seed())
            });
            Ok(rows.collect())
        })?;
        let flights = context.each(&PROFILES, name, |profile| {
            let methods = flights(profile);
            let times = times(context, profile, &methods)?;
            let rows = methods.iter().zip(times).map(|(method, time)| Flight {
                time,
                ..flight_of(context, profile, method, seed())
            });
            Ok(rows.collect())
        })?;
        Ok(Self {
            falls: falls(&transmittances),
            transmittances,
            flights,
        })
    }

    fn findings(&self) -> Findings {
        let tracked = |row: &&Flight| row.profile == WAVES && row.method.starts_with(DELTA);
        let marched = |row: &&Transmittance| row.method.starts_with("marched") && row.error.abs() > ROUNDING;
        let marched: Vec<Transmittance> = self.transmittances.iter().filter(marched).cloned().collect();
        let name = |row: &Transmittance| {
            let place = row.method.rsplit(", ").next().unwrap_or_default();
            format!("{}, {place}", row.profile)
        };
        Findings::of(&self.transmittances, OF_TRANSMITTANCES)
            .note(
                "A marched estimate draws nothing and is made once: its error is all bias. That of tracking is noise, which falls with the root of \
                 the number of estimates.",
            )
            .curves(
                "marching",
                "Transmittance by ray marching",
                Axes::rates("steps", "relative error"),
                curves(&marched, name, |row| (row.look_ups, row.error.abs().into())),
            )
            .and(Findings::of(&self.falls, OF_FALLS))
            .note(format!(
                "By {} and {} steps. There is no exponent where both are exact up to the rounding of f64.",
                STEPS[STEPS.len() - 2],
                STEPS[STEPS.len() - 1]
            ))
            .and(Findings::of(&self.flights, OF_FLIGHTS))
            .headline(
                "look-ups of a tracked flight through waves",
                self.flights.iter().find(tracked).map(|row| row.look_ups.into()),
            )
            .note(
                "The greatest distance between the distribution of flights and the exact one (Kolmogorov and Smirnov), flights without a collision \
                 included.",
            )
    }
}

/// Times of all methods.
fn times<R>(context: &Context<'_>, profile: &Profile, methods: &[Method<R>]) -> Result<Vec<Repeats>> {
    let mut random = Random::new(0);
    let mut draw = || random.unit();
    let times = context.in_turns(TURNS, methods.len(), |i| {
        Ok(nanoseconds_once(&[(); RUNS], |()| {
            (methods[i].run)(&profile.extinction, &mut draw)
        }))
    })?;
    Ok(times.into_iter().map(Repeats).collect())
}

/// So many values of a method, and how often one looks up the extinction.
fn values<R>(profile: &Profile, method: &Method<R>, count: u32, seed: u32) -> (Vec<R>, f64) {
    let looked_up = Cell::new(0_u64);
    let extinction = |t: f64| {
        looked_up.set(looked_up.get() + 1);
        (profile.extinction)(t)
    };
    let mut random = Random::new(seed);
    let mut draw = || random.unit();
    let values = (0..count).map(|_| (method.run)(&extinction, &mut draw)).collect();
    (values, looked_up.get() as f64 / f64::from(count))
}

fn transmittance_of(context: &Context<'_>, profile: &Profile, method: &Method<f64>, seed: u32) -> Transmittance {
    // What draws nothing is the same each time.
    let draws = method.name.starts_with(RATIO);
    let count = if draws { samples(context) } else { 1 };
    let exact = (-(profile.depth)(T_MAX)).exp();
    let (values, look_ups) = values(profile, method, count, seed);
    let n = f64::from(count);
    let mean = values.iter().map(|value| value / exact - 1.0).sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value / exact - 1.0 - mean).powi(2)).sum();
    let deviation = (squares / (n - 1.0).max(1.0)).sqrt();
    Transmittance {
        profile: profile.name.into(),
        method: method.name.clone(),
        error: mean,
        standard_error: deviation / n.sqrt(),
        deviation,
        estimates: count.into(),
        look_ups,
        time: Repeats::default(),
    }
}

/// Exponents of marched errors by the finest steps; not a number where an error is none.
fn falls(all: &[Transmittance]) -> Vec<Fall> {
    let profiles = PROFILES.iter().filter(|profile| profile.name != PROFILES[0].name);
    let of = |profile: &Profile, place: &str| {
        let error = |steps: u32| {
            let method = marched(steps, place);
            let row = all
                .iter()
                .find(|row| row.profile == profile.name && row.method == method);
            row.map_or(f64::NAN, |row| row.error.abs())
        };
        let [.., few, many] = STEPS;
        let fall = (error(many) / error(few)).ln() / f64::from(many / few).ln();
        let is_exact = [few, many].iter().all(|steps| error(*steps) <= ROUNDING);
        Fall {
            profile: profile.name.into(),
            place: place.into(),
            exponent: (!is_exact).then_some(fall),
        }
    };
    profiles
        .flat_map(|profile| PLACES.map(|(_, place)| of(profile, place)))
        .collect()
}

/// How the greatest distance between the distribution of flights and the profile's comes out; a flight without collision ends at [`T_MAX`].
fn flight_of(context: &Context<'_>, profile: &Profile, method: &Method<Option<f64>>, seed: u32) -> Flight {
    let (values, look_ups) = values(profile, method, samples(context), seed);
    let n = values.len() as f64;
    let mut ends: Vec<f64> = values.iter().copied().flatten().collect();
    ends.sort_by(f64::total_cmp);
    let cumulative = |t: f64| 1.0 - (-(profile.depth)(t)).exp();
    let inside = ends.iter().enumerate().flat_map(|(i, t)| {
        let f = cumulative(*t);
        [(i + 1) as f64 / n - f, f - i as f64 / n]
    });
    let past = (ends.len() as f64 / n - cumulative(T_MAX)).abs();
    Flight {
        profile: profile.name.into(),
        method: method.name.clone(),
        distance: greatest(inside.chain([past])),
        flights: values.len() as u64,
        look_ups,
        time: Repeats::default(),
    }
}

/// Estimates or flights of a method that draws.
fn samples(context: &Context<'_>) -> u32 {
    context.pick(1_000_000, 2000)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of the rising profile, marched by the finest steps at the ends.
    fn exponent(few: f64, many: f64) -> Option<f64> {
        let [.., first, last] = STEPS;
        let (_, place) = PLACES[0];
        let row = |steps, error| Transmittance {
            profile: PROFILES[1].name.into(),
            method: marched(steps, place),
            error,
            ..Transmittance::default()
        };
        let falls = falls(&[row(first, few), row(last, many)]);
        falls[0].exponent
    }

    #[test]
    fn only_what_is_exact_has_no_exponent() {
        assert!((exponent(8e-3, 1e-3).unwrap() + 1.0).abs() < 1e-12);
        assert_eq!(exponent(1e-16, 0.0), None);
        for [few, many] in [[f64::NAN, 1e-3], [8e-3, f64::NAN], [0.0, f64::NAN]] {
            assert!(exponent(few, many).unwrap().is_nan(), "{few} {many}");
        }
    }
}
