//! What photons and kernels come to: interactions, discarded and clamped kernels, contributions to a query, lengths of axes, and what the
//! dampening changes of it.
//!
//! Source of the comparison: "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, §5.2.2, Table 5.1 and Figure
//! 5.2. Its figures stand beside ours, which are exact counts of other scenes of the same size.

use clerestory::gpu::Gpu;
use clerestory::scene::Scene;
use clerestory::techniques::photon_mapping::PhotonSettings;
use clerestory::techniques::photon_mapping::kernel::{KernelSettings, PhotonRecord};
use clerestory::{Result, scene};
use glam::Vec3;

use super::cases::{CASES, Case, mapper, settings};
use crate::experiments::measures::Context;
use crate::experiments::table::{Cell, Table};
use crate::timing::median;

/// Pixels that ask the map.
const SIZE: [u32; 2] = [128, 96];
const SMOKE_SIZE: [u32; 2] = [16, 12];
/// Scenes of the smoke form.
const SMOKE_SCENES: [&str; 2] = ["Passage", "Ring"];

/// An empty closed room of 144 m² with a lamp, as large as the source's first scene.
const ROOM: &str = "builtin:box-room?contents=empty&mirror=no&source=point";
/// Reflectance of the room, photons, spread, and what an evaluation of the method by other means gives: kernels about a point and records.
const ROOMS: [(f32, u32, f32, f64, Option<u64>); 4] = [
    (0.5, 1 << 17, 20.0, 213.0, Some(98_083)),
    (0.7, 1 << 17, 20.0, 309.0, Some(155_262)),
    (0.8, 1 << 17, 20.0, 361.0, Some(188_249)),
    (0.75, 1 << 18, 28.0, 657.0, None),
];

/// Exponents of the dampening; the last is the source's.
const EXPONENTS: [f32; 3] = [1.0, 0.5, 0.25];

/// An axis counts as clamped that near to the greatest length: records are of f32.
const CLAMPED_FROM: f64 = 1.0 - 1e-5;

/// What one map comes to.
struct Statistics {
    emitted: u64,
    deposits: u64,
    stored: u64,
    discarded: f64,
    clamped: f64,
    contributions: f64,
    cover: f64,
    /// Of the longer axes A and the shorter ones B, m.
    axes: [Vec<f64>; 2],
}

impl Statistics {
    fn of(gpu: &Gpu, scene: &Scene, size: [u32; 2], settings: PhotonSettings) -> Result<Self> {
        let mut mapper = mapper(gpu, scene, size, settings)?;
        let kernel = mapper.kernel(0);
        while mapper.step(1)?.is_some() {}
        // What the first pass was made of, traced again.
        let counts = mapper.counts();
        let photons: Vec<PhotonRecord> = mapper.photons(0)?.iter().map(|photon| photon.record).collect();
        let share = |part: u64, whole: u64| 100.0 * part as f64 / whole.max(1) as f64;
        let clamped = photons.iter().filter(|photon| is_clamped(&kernel, photon)).count();
        let lengths = |axis: fn(&PhotonRecord) -> Vec3| photons.iter().map(|p| f64::from(axis(p).length())).collect();
        Ok(Self {
            emitted: counts.photons.emitted,
            deposits: counts.photons.deposits,
            stored: counts.records,
            discarded: share(counts.photons.without_kernel, counts.photons.deposits),
            clamped: share(clamped as u64, counts.records),
            contributions: counts.gather.photons as f64 / counts.gather.queries.max(1) as f64,
            cover: counts.cover,
            axes: [lengths(|p| p.along), lengths(|p| p.across)],
        })
    }
}

fn is_clamped(kernel: &KernelSettings, photon: &PhotonRecord) -> bool {
    let length = f64::from(photon.along.length().max(photon.across.length()));
    length >= kernel.length_max * kernel.unit_length * CLAMPED_FROM
}

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let gpu = (context.gpu)()?;
    let size = if context.smoke { SMOKE_SIZE } else { SIZE };
    let mut table = photons_table();
    let mut lengths = lengths_table();
    let cases: Vec<&Case> = CASES
        .iter()
        .filter(|case| !context.smoke || SMOKE_SCENES.contains(&case.published.name))
        .collect();
    for (done, case) in cases.iter().enumerate() {
        if context.watch.stopped() {
            break;
        }
        context.watch.begin(case.name(), done, cases.len());
        let statistics = Statistics::of(&gpu, &scene::load(case.scene)?, size, case.settings(context.smoke)?)?;
        table.row(photons_row(case, &statistics));
        for row in lengths_rows(case, &statistics) {
            lengths.row(row);
        }
    }
    if context.smoke {
        let fewer = "Smoke form: a 64th of the photons, with kernels of the same size, so that k is a 64th too.";
        table.note(fewer);
        lengths.note(fewer);
    }
    Ok(vec![
        table,
        lengths,
        rooms(context, &gpu, size)?,
        dampening(context, &gpu, size)?,
    ])
}

fn photons_table() -> Table {
    let mut table = Table::new(
        "Photons, their kernels and the contributions to a query",
        &[
            "scene",
            "counterpart",
            "photons",
            "interactions",
            "source: interactions",
            "discarded (%)",
            "source: discarded (%)",
            "spread",
            "clamped (%)",
            "source: clamped (%)",
            "k, contributions a query",
            "source: k",
            "source: k of nearest neighbours",
            "kernels about a point of the scene",
        ],
    );
    table.note(
        "Skewed kernels, uniform profile, dampening 1/4, unit and greatest axis 1 m, flatness 1/20; second and third hits are stored. k is \
         counted where the camera looks, and only on surfaces that face as the photon's does.",
    );
    table
}

fn photons_row(case: &Case, s: &Statistics) -> Vec<Cell> {
    let of = &case.published;
    vec![
        case.name().into(),
        of.name.into(),
        s.emitted.into(),
        s.deposits.into(),
        of.interactions.into(),
        s.discarded.into(),
        of.discarded.into(),
        f64::from(case.spread).into(),
        s.clamped.into(),
        of.clamped.into(),
        s.contributions.into(),
        of.contributions[0].into(),
        of.contributions[1].into(),
        s.cover.into(),
    ]
}

/// Bounds between the bins of lengths, m.
const BINS: [f64; 11] = [
    0.015_625, 0.0221, 0.031_25, 0.0442, 0.0625, 0.0884, 0.125, 0.177, 0.25, 0.354, 0.5,
];

fn lengths_table() -> Table {
    let mut heads = vec!["scene".to_owned(), "axis".to_owned(), "median (m)".to_owned()];
    heads.push(format!("below {} m (%)", BINS[0]));
    heads.extend(BINS[1..].iter().map(|bound| format!("… {bound} (%)")));
    heads.push("more (%)".to_owned());
    heads.push("distance of the distributions of A and B".to_owned());
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let mut table = Table::new("Lengths of the kernels' axes", &heads);
    table.note(
        "A is the longer axis. The distance is Kolmogorov's and Smirnov's: the largest difference between the shares of lengths below any \
         one; 0 were kernels round.",
    );
    table
}

fn lengths_rows(case: &Case, s: &Statistics) -> Vec<Vec<Cell>> {
    let distance = distribution_distance(&s.axes[0], &s.axes[1]);
    let of = |axis: &str, lengths: &[f64]| {
        let mut shares = [0_u64; BINS.len() + 1];
        for length in lengths {
            shares[BINS.partition_point(|bound| bound <= length)] += 1;
        }
        let mut row: Vec<Cell> = vec![case.name().into(), axis.into(), middle(lengths).into()];
        row.extend(shares.map(|count| (100.0 * count as f64 / lengths.len().max(1) as f64).into()));
        row.push(distance.into());
        row
    };
    vec![of("A", &s.axes[0]), of("B", &s.axes[1])]
}

fn middle(lengths: &[f64]) -> f64 {
    if lengths.is_empty() {
        0.0
    } else {
        median(lengths.to_vec())
    }
}

/// The largest difference between two empirical distributions.
fn distribution_distance(a: &[f64], b: &[f64]) -> f64 {
    let sorted = |values: &[f64]| {
        let mut values = values.to_vec();
        values.sort_by(f64::total_cmp);
        values
    };
    let (a, b) = (sorted(a), sorted(b));
    let below = |values: &[f64], x: f64| values.partition_point(|v| *v <= x) as f64 / values.len().max(1) as f64;
    let all = a.iter().chain(&b);
    all.map(|x| (below(&a, *x) - below(&b, *x)).abs()).fold(0.0, f64::max)
}

/// The room with walls of that reflectance.
fn room(reflectance: f32) -> Result<Scene> {
    let mut scene = scene::load(ROOM)?;
    for material in &mut scene.materials {
        material.base_color = Vec3::splat(reflectance).extend(1.0);
    }
    Ok(scene)
}

fn rooms(context: &Context<'_>, gpu: &Gpu, size: [u32; 2]) -> Result<Table> {
    let mut table = Table::new(
        "An empty room of 144 m²: kernels about a point, beside an evaluation by other means",
        &[
            "reflectance",
            "photons",
            "spread",
            "kernels about a point",
            "expected",
            "records",
            "records expected",
            "discarded (%)",
            "clamped (%)",
            "k, contributions a query",
        ],
    );
    for (reflectance, photons, spread, expected, records) in ROOMS {
        let settings = settings(photons, spread, context.smoke)?;
        let s = Statistics::of(gpu, &room(reflectance)?, size, settings)?;
        table.row([
            f64::from(reflectance).into(),
            s.emitted.into(),
            f64::from(spread).into(),
            s.cover.into(),
            expected.into(),
            s.stored.into(),
            records.into(),
            s.discarded.into(),
            s.clamped.into(),
            s.contributions.into(),
        ]);
    }
    table.note("Expected are 0.12 to 0.14 % discarded and less than 0.01 % clamped. The sum of the kernels' areas over the room's is that of kernels about a point.");
    Ok(table)
}

fn dampening(context: &Context<'_>, gpu: &Gpu, size: [u32; 2]) -> Result<Table> {
    let mut table = Table::new(
        "What the dampening changes",
        &[
            "scene",
            "exponent",
            "kernels about a point",
            "k, contributions a query",
            "discarded (%)",
            "clamped (%)",
            "median of A (m)",
            "median of B (m)",
        ],
    );
    let room = room(0.7)?;
    let ring = scene::load("builtin:ring")?;
    let passage = scene::load("builtin:passage")?;
    for (name, scene, spread) in [
        ("empty room", &room, 20.0),
        ("passage", &passage, 15.0),
        ("ring", &ring, 10.0),
    ] {
        for dampening in EXPONENTS {
            let settings = PhotonSettings {
                dampening,
                ..settings(1 << 17, spread, context.smoke)?
            };
            let s = Statistics::of(gpu, scene, size, settings)?;
            table.row([
                name.into(),
                f64::from(dampening).into(),
                s.cover.into(),
                s.contributions.into(),
                s.discarded.into(),
                s.clamped.into(),
                middle(&s.axes[0]).into(),
                middle(&s.axes[1]).into(),
            ]);
        }
    }
    table.note(
        "Exponent 1 leaves footprints as they are, up to 1 m. Discarded photons are lost with their flux; all fluxes of a pass are about \
         equal, so that this is the energy that is lost.",
    );
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distributions_that_do_not_meet_have_distance_one() {
        assert_eq!(distribution_distance(&[1.0, 2.0], &[3.0, 4.0]), 1.0);
        assert_eq!(distribution_distance(&[1.0, 2.0], &[1.0, 2.0]), 0.0);
        assert_eq!(distribution_distance(&[1.0, 3.0], &[2.0, 3.0]), 0.5);
    }
}
