//! How much estimates of direct light spread when lights are chosen by power.
//!
//! Oracle: the second moment of an estimate that chooses lamp i with the probability p is ∑ f²/p over the lamps, f being the irradiance by each; no
//! sample is drawn.

use clerestory::Result;
use clerestory::transport::distribution::{build_distribution, distribution_probability};
use glam::{DVec2, DVec3};

use crate::experiments::findings::{Bound, Criterion, Findings, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::random::Random;

/// Lamps, and the decades over which their powers spread.
const CASES: [(usize, f64); 9] = [
    (4, 0.0),
    (4, 2.0),
    (4, 4.0),
    (64, 0.0),
    (64, 2.0),
    (64, 4.0),
    (1024, 0.0),
    (1024, 2.0),
    (1024, 4.0),
];
/// Side of the floor and height of the lamps over it, m.
const SIDE: f64 = 20.0;
const HEIGHT: f64 = 3.0;

rows! {
    /// Lamps over a floor.
    struct Row = "Spread of one-sample estimates of direct light" by [lamps, decades] {
        lamps: u64 = "lamps",
        decades: f64 = "decades of their powers",
        even: f64 = "standard deviation over the mean, even choice",
        power: f64 = "standard deviation over the mean, by power",
        ratio: f64 = "by power over even",
        lost: u64 = "lamps without a chance",
        strongest: f64 = "share of light that the strongest lamp of a point gives",
    }
}

/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "estimates spread no more than by an even choice: ratio",
        Bound::AtMost(1.0),
        |row: &Row| row.ratio.into(),
    ),
    Criterion::each("no lamp is without a chance: lamps", Bound::AtMost(0.0), |row: &Row| {
        row.lost.into()
    })
    .in_every_form(),
];

/// Lamps with their powers, and points of the floor that they light.
struct Room {
    lamps: Vec<(DVec3, f64)>,
    points: Vec<DVec3>,
}

impl Room {
    fn new(lamps: usize, decades: f64, points: usize) -> Self {
        let mut random = Random::new(31);
        let mut place = |height: f64| {
            let at = SIDE * DVec2::new(random.unit(), random.unit());
            (at.extend(height), 10f64.powf(-decades * random.unit()))
        };
        Self {
            lamps: (0..lamps).map(|_| place(HEIGHT)).collect(),
            points: (0..points).map(|_| place(0.0).0).collect(),
        }
    }

    /// Irradiance of a point by each lamp, up to a factor.
    fn irradiance(&self, point: DVec3) -> Vec<f64> {
        let by = |(lamp, power): &(DVec3, f64)| {
            let to = *lamp - point;
            power * to.z / to.length().powi(3)
        };
        self.lamps.iter().map(by).collect()
    }

    /// Standard deviation of an estimate over its mean, by the probabilities of lamps: the root of the mean square over the points.
    fn spread(&self, probabilities: &[f64]) -> f64 {
        let squares = self.points.iter().map(|point| {
            let each = self.irradiance(*point);
            let mean: f64 = each.iter().sum();
            let second: f64 = each.iter().zip(probabilities).map(|(f, p)| f * f / p).sum();
            second / (mean * mean) - 1.0
        });
        (squares.sum::<f64>() / self.points.len() as f64).sqrt()
    }

    /// The share of the lamp that gives most, mean over the points.
    fn strongest(&self) -> f64 {
        let shares = self.points.iter().map(|point| {
            let each = self.irradiance(*point);
            each.iter().copied().fold(0.0, f64::max) / each.iter().sum::<f64>()
        });
        shares.sum::<f64>() / self.points.len() as f64
    }
}

/// Probabilities of entries of these weights, by the table that scenes have.
fn probabilities(weights: &[f64]) -> Result<Vec<f64>> {
    let table = build_distribution("lamps", weights)?;
    Ok((0..weights.len())
        .map(|entry| distribution_probability(&table, 0, entry))
        .collect())
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let points = context.pick(2000, 20);
        let name = |(lamps, decades): &(usize, f64)| format!("{lamps} lamps, {decades} decades");
        context.each(context.first(&CASES, 3), name, |(lamps, decades)| {
            let room = Room::new(*lamps, *decades, points);
            let powers: Vec<f64> = room.lamps.iter().map(|(_, power)| *power).collect();
            let [by_power, by_number] = [probabilities(&powers)?, probabilities(&vec![1.0; *lamps])?];
            let [power, even] = [room.spread(&by_power), room.spread(&by_number)];
            Ok(vec![Row {
                lamps: *lamps as u64,
                decades: *decades,
                even,
                power,
                ratio: power / even,
                lost: by_power.iter().filter(|p| **p <= 0.0).count() as u64,
                strongest: room.strongest(),
            }])
        })
    }

    fn findings(&self) -> Findings {
        let unequal = self.iter().filter(|row| row.decades > 0.0);
        Findings::of(self, CRITERIA)
            .headline(
                "spread of estimates by power over that by an even choice, lamps of unequal power, geometric mean",
                geometric_mean(unequal.map(|row| row.ratio.into())),
            )
            .note(format!(
                "Lamps lie {HEIGHT} m over a floor of {SIDE} m × {SIDE} m, which nothing shadows; powers are as likely at each magnitude. A choice by what \
                 each lamp gives to the point would have no spread at all: what is left by power is what the choice does not know of places."
            ))
    }
}
