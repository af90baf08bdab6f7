//! What lights of the unit box might bring to the points of a picture: how many of them carry how much, and what each might bring to one point.
//!
//! Source of what this follows: the chapter on virtual light sources of a doctoral thesis on metals and reflections on graphics hardware, figures 6.4 to 6.8, and figures that were
//! computed elsewhere for the same box.

use clerestory::Result;
use clerestory::techniques::instant_radiosity::selection::{
    LitPoint, SurfaceLight, Survival, lights_for_share, order_by_potential, potential_contribution,
};
use clerestory::transport::edge_bound::EdgeBound;
use clerestory::transport::environment::luminance;
use glam::DVec3;

use super::unit_box::UnitBox;
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Measured, curves, rows};

/// The published bound of distances is a tenth of the box.
const BOUND: EdgeBound = EdgeBound::Distance(0.01);
/// What the curve of shares is drawn of, %.
const CURVE: [f64; 8] = [50.0, 60.0, 70.0, 80.0, 90.0, 95.0, 99.0, 100.0];

rows! {
    /// Lights of walks.
    struct Share = "Shares of the potential" by [walks, seed] {
        walks: u64 = "walks",
        seed: u64 = "seed",
        lights: u64 = "lights",
        facing: f64 = "pairs that face each other (%)",
        ninety: f64 = "lights for 90 % of the potential (%)",
        eighty: f64 = "lights for 80 % (%)",
        half: f64 = "potential of the strongest half (%)",
    }
}
rows! {
    /// Lights, by share.
    struct Curve = "Cumulative potential" by [walks, share] {
        walks: u64 = "walks",
        share: f64 = "share of the potential (%)",
        lights: f64 = "lights that carry it (%)",
    }
}
rows! {
    /// A light of one point.
    struct Rank = "Potential of one point's lights by rank" by [walks, rank] {
        walks: u64 = "walks",
        rank: u64 = "rank",
        potential: f64 = "potential over that of the strongest",
    }
}

fn mean_of(rows: &[&Share], of: fn(&Share) -> f64) -> Option<Measured> {
    (!rows.is_empty()).then(|| Measured::exact(rows.iter().map(|row| of(row)).sum::<f64>() / rows.len() as f64))
}

const OF_SHARES: &[Criterion<Share>] = &[
    Criterion::all(
        "90 % of the potential in 45 to 49 % of the lights: mean (%)",
        Bound::Between(45.0, 49.0),
        |rows| mean_of(rows, |row| row.ninety),
    ),
    Criterion::all("80 % in 33 to 37 %: mean (%)", Bound::Between(33.0, 37.0), |rows| {
        mean_of(rows, |row| row.eighty)
    }),
    Criterion::all(
        "the strongest half carries about 90 %: mean (%)",
        Bound::Between(88.0, 93.0),
        |rows| mean_of(rows, |row| row.half),
    ),
];

/// A picture's points and lights.
pub struct Pixels {
    pub unit_box: UnitBox,
    pub points: Vec<LitPoint>,
    pub lights: Vec<SurfaceLight>,
}

impl Pixels {
    /// Those of a picture of some pixels across and down, and the lights of so many walks.
    ///
    /// # Errors
    /// Those of the scene.
    pub fn of(size: [u32; 2], walks: u32, seed: u32) -> Result<Self> {
        let unit_box = UnitBox::load()?;
        Ok(Self {
            points: unit_box.points(size)?,
            lights: unit_box.lights(walks, seed, Survival::Roulette),
            unit_box,
        })
    }

    /// What each light might bring to a point, and its luminance.
    pub fn potentials(&self, point: &LitPoint, potentials: &mut Vec<DVec3>, keys: &mut Vec<f64>) {
        potentials.clear();
        potentials.extend(
            self.lights
                .iter()
                .map(|light| potential_contribution(light, point, BOUND)),
        );
        keys.clear();
        keys.extend(potentials.iter().map(|potential| luminance(*potential)));
    }

    /// What each light might bring to the point in the middle of the picture, the strongest first, of those that might bring something.
    pub fn ranks(&self, walks: u32, size: [u32; 2]) -> Vec<Rank> {
        let (mut potentials, mut keys) = (Vec::new(), Vec::new());
        let middle = (size[1] / 2 * size[0] + size[0] / 2) as usize;
        self.potentials(&self.points[middle], &mut potentials, &mut keys);
        let ordered = order_by_potential(&keys);
        let ordered: Vec<f64> = ordered.iter().map(|light| keys[*light as usize]).collect();
        let strongest = ordered.first().copied().unwrap_or(f64::NAN);
        let bring = (1..).zip(ordered).filter(|(_, key)| *key > 0.0);
        let rank = |(rank, key): (u64, f64)| Rank {
            walks: walks.into(),
            rank,
            potential: key / strongest,
        };
        bring.map(rank).collect()
    }

    /// Shares of lights over all points, and their curve.
    pub fn shares(&self, walks: u32, seed: u32) -> (Share, Vec<Curve>) {
        let (mut potentials, mut keys) = (Vec::new(), Vec::new());
        let (mut facing, mut half, mut carried) = (0.0, 0.0, [0.0; CURVE.len()]);
        let n = self.lights.len() as f64;
        for point in &self.points {
            self.potentials(point, &mut potentials, &mut keys);
            facing += keys.iter().filter(|key| **key > 0.0).count() as f64 / n;
            let order = order_by_potential(&keys);
            let strongest: f64 = order[..order.len() / 2].iter().map(|light| keys[*light as usize]).sum();
            half += strongest / keys.iter().sum::<f64>();
            for (sum, share) in carried.iter_mut().zip(CURVE) {
                *sum += lights_for_share(&order, &keys, share / 100.0) as f64 / n;
            }
        }
        let percent = |sum: f64| 100.0 * sum / self.points.len() as f64;
        let of = |share: f64| {
            let place = CURVE.iter().position(|other| *other == share);
            place.map_or(f64::NAN, |place| percent(carried[place]))
        };
        let share = Share {
            walks: walks.into(),
            seed: seed.into(),
            lights: self.lights.len() as u64,
            facing: percent(facing),
            ninety: of(90.0),
            eighty: of(80.0),
            half: percent(half),
        };
        let point = |(share, sum): (f64, f64)| Curve {
            walks: walks.into(),
            share,
            lights: percent(sum),
        };
        (share, CURVE.into_iter().zip(carried).map(point).collect())
    }
}

/// What a page says of shares.
pub fn of_shares(shares: &[Share], curve: &[Curve]) -> Findings {
    Findings::of(shares, OF_SHARES).curves(
        "potential",
        "Cumulative potential of a point's lights, the strongest first",
        Axes::even("lights (%)", "share of the potential (%)", 100.0, (10, 10.0)),
        curves(
            curve,
            |row| format!("{} walks", row.walks),
            |row| (row.lights, row.share.into()),
        ),
    )
}

/// What a page says of ranks.
pub fn of_ranks(ranks: &[Rank]) -> Findings {
    Findings::of(ranks, &[]).long().curves(
        "ranks",
        "Potential of one point's lights by rank",
        Axes::rates("rank", "potential over that of the strongest"),
        curves(
            ranks,
            |row| format!("{} walks", row.walks),
            |row| (row.rank as f64, row.potential.into()),
        ),
    )
}
