//! Where photons land by their random numbers: a table that was drawn beforehand, as the source's photons read it, beside hashes and Sobol' points.
//!
//! Oracle: inside a diffuse sphere around its light every meeting is uniform over the sphere, whatever came before, so that counts of independent
//! photons in equal cells are multinomial.

use std::f64::consts::TAU;

use clerestory::Result;
use clerestory::transport::random::{Sampler, SamplerKind, sample_2d};
use clerestory::transport::random_table::RandomTable;
use clerestory::transport::warp::{orthonormal_basis, square_to_cosine_hemisphere, square_to_sphere};
use glam::{DVec2, DVec3};

use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Study, rows, z_most};
use crate::experiments::measures::Context;
use crate::random::Random;

/// Meetings of a photon with the sphere, each by a pair of numbers.
const MEETINGS: u32 = 3;
/// Cells in height and about the axis, which is none of the coordinates'.
const CELLS: [usize; 2] = [8, 16];
const AXIS: DVec3 = DVec3::new(0.48, -0.6, 0.64);
/// Photons of a run.
const PHOTONS: [u32; 4] = [1 << 10, 1 << 12, 1 << 14, 1 << 16];
/// Runs with numbers of their own.
const RUNS: u32 = 64;
/// Pairs of the short table.
const SHORT: u32 = 1 << 12;
/// About nine standard errors of all runs.
const ALIKE: Bound = Bound::Between(0.85, 1.15);

const TABLE: &str = "table for all photons";
const SHORT_TABLE: &str = "table of 4,096 pairs";
const HASHES: &str = "hashes";
const SOBOL: &str = "Sobol' points";
const SOURCES: [&str; 4] = [TABLE, SHORT_TABLE, HASHES, SOBOL];

/// The pair of a photon for a meeting.
type Numbers = Box<dyn Fn(u32, u32) -> DVec2>;

fn numbers(source: &str, photons: u32, seed: u32) -> Result<Numbers> {
    let kind = match source {
        HASHES => SamplerKind::Pcg,
        SOBOL => SamplerKind::Sobol,
        _ => {
            let pairs = if source == SHORT_TABLE {
                SHORT
            } else {
                photons * MEETINGS
            };
            let mut random = Random::new(seed);
            let table = RandomTable::new((0..pairs).map(|_| [random.word(), random.word()]).collect())?;
            return Ok(Box::new(move |photon, meeting| {
                table.sample_2d(photon, MEETINGS, meeting)
            }));
        }
    };
    Ok(Box::new(move |sample_index, dimension| {
        let mut sampler = Sampler {
            pixel: 0,
            sample_index,
            dimension,
            seed,
        };
        sample_2d(&mut sampler, kind)
    }))
}

rows! {
    /// A source of numbers, photons, and a meeting.
    struct Row = "Counts of photons in 128 cells of a sphere" by [source, photons, meeting] {
        source: String = "numbers",
        photons: u64 = "photons",
        meeting: u64 = "meeting",
        square: f64 = "mean square error over that of independent photons",
        error: f64 = "its standard error",
        repeated: f64 = "times that each photon comes back",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "a table for all photons and hashes err as independent numbers do: mean square error over theirs",
        ALIKE,
        |row: &Row| row.measured(1.0),
    )
    .among(|row| row.source == TABLE || row.source == HASHES),
    Criterion::each(
        "Sobol' points err less at the first meeting: mean square error over that of independent numbers",
        Bound::AtMost(0.5),
        |row: &Row| row.measured(1.0),
    )
    .among(|row| row.source == SOBOL && row.meeting == 1),
    Criterion::each(
        "Sobol' points err nowhere more: mean square error over that of independent numbers",
        Bound::AtMost(1.15),
        |row: &Row| row.measured(1.0),
    )
    .among(|row| row.source == SOBOL && row.meeting > 1),
    Criterion::each(
        "a short table errs by as much more as photons come back: mean square error over that of independent numbers, by the times",
        ALIKE,
        |row: &Row| row.measured(row.repeated),
    )
    .among(|row| row.source == SHORT_TABLE),
];

impl Row {
    /// The ratio over `times`, within what chance exceeds once in a hundred runs of all rows.
    fn measured(&self, times: f64) -> Measured {
        let count = SOURCES.len() * PHOTONS.len() * MEETINGS as usize;
        Measured::within(self.square / times, z_most(count) * self.error / times)
    }
}

/// The cell of a place on the sphere.
fn cell(place: DVec3) -> usize {
    let (x, y) = orthonormal_basis(AXIS);
    let height = (0.5 * (place.dot(AXIS) + 1.0) * CELLS[0] as f64) as usize;
    let turn = place.dot(y).atan2(place.dot(x)).rem_euclid(TAU) / TAU;
    height.min(CELLS[0] - 1) * CELLS[1] + ((turn * CELLS[1] as f64) as usize).min(CELLS[1] - 1)
}

/// Counts in cells at each meeting.
fn counts(numbers: &dyn Fn(u32, u32) -> DVec2, photons: u32) -> Vec<Vec<u32>> {
    let mut counts = vec![vec![0; CELLS[0] * CELLS[1]]; MEETINGS as usize];
    for photon in 0..photons {
        let mut place = square_to_sphere(numbers(photon, 0));
        counts[0][cell(place)] += 1;
        for (meeting, counts) in (1..MEETINGS).zip(&mut counts[1..]) {
            let local = square_to_cosine_hemisphere(numbers(photon, meeting));
            let (x, y) = orthonormal_basis(-place);
            let direction = local.x * x + local.y * y - local.z * place;
            place = (place + 2.0 * local.z * direction).normalize();
            counts[cell(place)] += 1;
        }
    }
    counts
}

/// All meetings of so many photons.
fn of(source: &str, photons: u32, runs: u32) -> Result<Vec<Row>> {
    let cells = CELLS[0] * CELLS[1];
    let expected = f64::from(photons) / cells as f64;
    let mut squares = [0.0; MEETINGS as usize];
    for run in 0..runs {
        for (square, counts) in squares
            .iter_mut()
            .zip(counts(&*numbers(source, photons, run)?, photons))
        {
            let off = |count: &u32| (f64::from(*count) - expected).powi(2) / expected;
            *square += counts.iter().map(off).sum::<f64>();
        }
    }
    let degrees = f64::from(runs) * (cells - 1) as f64;
    let repeated = if source == SHORT_TABLE {
        f64::from(photons.max(SHORT) / SHORT)
    } else {
        1.0
    };
    let rows = squares.iter().zip(1..).map(|(square, meeting)| Row {
        source: source.into(),
        photons: photons.into(),
        meeting,
        square: square / degrees,
        error: repeated * (2.0 / degrees).sqrt(),
        repeated,
    });
    Ok(rows.collect())
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let (photons, runs) = (context.first(&PHOTONS, 1), context.pick(RUNS, 2));
        let name = |source: &&str| (*source).to_owned();
        context.each(&SOURCES, name, |source| {
            let rows: Result<Vec<Vec<Row>>> = photons.iter().map(|photons| of(source, *photons, runs)).collect();
            Ok(rows?.concat())
        })
    }

    fn findings(&self) -> Findings {
        let short = |row: &&Row| row.source == SHORT_TABLE && row.photons == 1 << 16 && row.meeting == 1;
        Findings::of(self, CRITERIA)
            .headline(
                "mean square error of 65,536 photons by a table of 4,096 pairs over that of independent numbers",
                self.iter().find(short).map(|row| row.square.into()),
            )
            .note(
                "Independent photons have the mean square of a multinomial distribution; its χ² over all runs gives the standard error. Tables are \
                 filled anew for each run with hashes of another kind in place of true random numbers; they take 24 bytes a photon.",
            )
    }
}
