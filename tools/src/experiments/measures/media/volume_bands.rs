//! Flights through coloured media: what do weights cost where the densest band draws the distance, and where a mixture of all bands does?
//!
//! Oracle: the closed forms of the transmittance and of the weights' second moments.

use clerestory::Result;
use clerestory::transport::densest_band::{densest_band, passed_second_moment};
use clerestory::transport::medium::{sample_free_flight, transmittance};
use glam::DVec3;

use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Study, curves, rows, z_most};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::mean_with_error;
use crate::random::Random;

/// Scattering and extinction coefficients, 1/m: those of the source's coloured scenes, and one whose bands differ more.
const MEDIA: [(&str, DVec3, DVec3); 3] = [
    (
        "ring, coloured",
        DVec3::new(0.5, 0.01, 0.01),
        DVec3::new(0.51, 0.02, 0.02),
    ),
    ("atrium, coloured", DVec3::splat(0.1), DVec3::new(0.15, 0.4, 0.4)),
    ("1 : 4 : 16", DVec3::new(0.9, 3.6, 14.4), DVec3::new(1.0, 4.0, 16.0)),
];
/// Distances in mean free paths of the densest band.
const DEPTHS: [f64; 4] = [1.0, 2.0, 4.0, 8.0];
const FLIGHTS: u32 = 1_000_000;
const SMOKE_FLIGHTS: u32 = 20_000;
/// Ways of drawing the distance.
const WAYS: [&str; 2] = [DENSEST, MIXTURE];
const DENSEST: &str = "by the densest band";
const MIXTURE: &str = "by a mixture of all bands";
const BANDS: f64 = 3.0;

rows! {
    /// A way of drawing the distance, of which the thinnest band's weights are looked at.
    struct Row = "Light of the thinnest band behind a medium" by [medium, way, depth] {
        medium: String = "medium",
        way: String = "distance drawn",
        depth: f64 = "depth of the densest band",
        transmitted: f64 = "transmitted",
        error: f64 = "mean / exact − 1",
        z: f64 = "its z",
        second_moment: f64 = "second moment of the weight",
        second_z: f64 = "z of the measured one",
        growth: f64 = "over that at half the depth",
        over_transmittance: f64 = "over the transmittance",
        greatest: f64 = "greatest weight",
    }
}

/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "transmitted light has no bias: |z| over what chance exceeds once in a hundred runs",
        Bound::AtMost(1.0),
        |row: &Row| (row.z.abs() / z_most(MEDIA.len() * DEPTHS.len() * WAYS.len())).into(),
    )
    .because("by Šidák for all rows"),
    Criterion::each(
        "second moments are those of the closed form: |z| over what chance exceeds once in a hundred runs",
        Bound::AtMost(1.0),
        |row: &Row| (row.second_z.abs() / z_most(MEDIA.len() * DEPTHS.len() * WAYS.len())).into(),
    )
    .because("by Šidák for all rows"),
    Criterion::each(
        "drawn by the densest band, the second moment of a band of less than half its extinction grows with the depth",
        Bound::AtLeast(1.0),
        |row: &Row| row.growth.into(),
    )
    .among(|row| row.way == DENSEST)
    .because("it is exp((σ_max − 2σ) t)")
    .in_every_form(),
    Criterion::each(
        "drawn by a mixture, the second moment is at most the number of bands times the transmittance",
        Bound::AtMost(BANDS),
        |row: &Row| row.over_transmittance.into(),
    )
    .among(|row| row.way == MIXTURE)
    .because("weights are at most the reciprocal of a band's probability")
    .in_every_form(),
];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        // A seed for each, or their noise would be one and the same.
        let mut seeds = 1..;
        let name = |(name, ..): &(&str, DVec3, DVec3)| (*name).to_owned();
        context.each(&MEDIA, name, |(medium, sigma_s, sigma_t)| {
            let cases = WAYS.iter().flat_map(|way| DEPTHS.map(|depth| (*way, depth)));
            let rows = cases.map(|(way, depth)| {
                let mut random = Random::new(seeds.next().unwrap_or_default());
                let count = context.pick(FLIGHTS, SMOKE_FLIGHTS);
                row(medium, (*sigma_s, *sigma_t), (way, depth), count, &mut || random.unit())
            });
            Ok(rows.collect())
        })
    }

    fn findings(&self) -> Findings {
        let name = |row: &Row| format!("{}, {}", row.medium, row.way);
        Findings::of(self, CRITERIA)
            .note(
                "Of flights that pass a medium, by the closed form where nothing else is said. The densest band's weights are exp((σ_max − σ) t): ever fewer flights pass, and carry ever more of the \
                 thinnest band's light.",
            )
            .curves(
                "second-moments",
                "Second moments of weights behind a medium",
                Axes::rates("depth of the densest band", "second moment over the transmittance"),
                curves(self, name, |row| (row.depth, row.over_transmittance.into())),
            )
    }
}

/// So many flights through a medium of these coefficients.
fn row(
    medium: &str,
    (sigma_s, sigma_t): (DVec3, DVec3),
    (way, depth): (&str, f64),
    count: u32,
    draw: &mut dyn FnMut() -> f64,
) -> Row {
    let bands = if way == DENSEST {
        densest_band(sigma_t)
    } else {
        DVec3::splat(1.0 / BANDS)
    };
    let t = depth / sigma_t.max_element();
    let thinnest = |values: DVec3| values.to_array()[sigma_t.min_position()];
    let weights: Vec<f64> = (0..count)
        .map(|_| {
            let flight = sample_free_flight(sigma_s, sigma_t, bands, t, [draw(), draw()]);
            if flight.collides { 0.0 } else { thinnest(flight.weight) }
        })
        .collect();
    let squares: Vec<f64> = weights.iter().map(|weight| weight * weight).collect();
    let [mean, error] = mean_with_error(&weights);
    let [second, second_error] = mean_with_error(&squares);
    let exact = thinnest(transmittance(sigma_t, t));
    let closed = |t: f64| thinnest(passed_second_moment(sigma_t, bands, t));
    Row {
        medium: medium.into(),
        way: way.into(),
        depth,
        transmitted: exact,
        error: mean / exact - 1.0,
        z: (mean - exact) / error,
        second_moment: closed(t),
        second_z: (second - closed(t)) / second_error,
        growth: closed(t) / closed(0.5 * t),
        over_transmittance: closed(t) / exact,
        greatest: weights.iter().copied().fold(0.0, f64::max),
    }
}
