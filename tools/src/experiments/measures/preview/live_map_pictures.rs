//! Pictures of the raster preview with live maps: how near they come to light that surfaces throw at each other, and what a frame of them costs.
//!
//! Sources: those of [`clerestory::techniques::preview`]. Oracle: the path tracer on the same light paths.

use clerestory::film::{CompareOptions, Picture, compare};
use clerestory::gpu::Gpu;
use clerestory::{Result, scene};
use glam::Vec3;

use super::previewed::{MAP, Quality, Subject};
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::greatest;
use crate::experiments::reference::short_name;
use crate::timing::Spread;

/// Scenes that a point light alone lights.
const SCENES: [&str; 5] = [
    "builtin:cornell-box?source=point",
    "builtin:box-room?source=point",
    "builtin:atrium?source=point",
    "builtin:cathedral?source=point",
    "builtin:conference?source=point",
];
/// Previews, and samples per pixel of the references.
const FULL: (Quality, u32) = ((128, 2048, 4), 1024);
const SMOKE: (Quality, u32) = ((16, 256, 1), 16);
/// Light scattered twice at most.
const TWICE: &str = "bounces=0..2";
const TURNS: usize = 5;
const ALONE: &str = "lights alone";
const WITH: &str = "with a live map";

rows! {
    /// A picture, with a live map at a place or without one.
    struct Row = "Pictures by place of the live map" by [scene, place] {
        scene: String = "scene",
        place: String = "place (shares of width and depth)",
        time: Repeats = "GPU time (ms)",
        mse_twice: f64 = "relative MSE, light scattered twice at most",
        bias_twice: f64 = "relative bias, light scattered twice at most",
        mse: f64 = "relative MSE, all light",
        bias: f64 = "relative bias, all light",
    }
}

rows! {
    /// Pictures of a scene with live maps or without: medians of the places, least … greatest.
    struct Way = "Light between surfaces, by a live map" by [scene, way] {
        scene: String = "scene",
        way: String = "way",
        time: Measured = "GPU time (ms)",
        mse_twice: Measured = "relative MSE, light scattered twice at most",
        bias_twice: Measured = "relative bias, light scattered twice at most",
        mse: Measured = "relative MSE, all light",
        bias: Measured = "relative bias, all light",
        off: Measured = "size of the relative bias, all light",
    }
}

rows! {
    /// Live maps of a scene beside lights alone.
    struct Gain = "Live maps over lights alone, against all light" by [scene] {
        scene: String = "scene",
        off: f64 = "size of the bias at the median place over that by lights alone",
        worst: f64 = "size of the bias at the worst place over that by lights alone",
        places: u64 = "places",
        nearer: u64 = "places with a mean that is nearer",
        less: u64 = "places with less relative MSE",
    }
}

/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Gain>] = &[
    Criterion::each(
        "a live map brings the mean nearer to that of all light: size of the bias over that by lights alone",
        Bound::AtMost(1.0),
        |row: &Gain| row.off.into(),
    )
    .because("at the median of nine places, of which some lie inside bodies"),
    Criterion::each(
        "at no place does it take the mean farther off: size of the bias at the worst place over that by lights alone",
        Bound::AtMost(1.0),
        |row: &Gain| row.worst.into(),
    )
    .because("a place inside a body sees nothing and changes nothing"),
    Criterion::each(
        "a live map brings pixels nearer: share of places with less relative MSE",
        Bound::AtLeast(0.5),
        |row: &Gain| (row.less as f64 / row.places as f64).into(),
    )
    .because("as at the median place"),
];

impl Row {
    fn is_alone(&self) -> bool {
        self.place == ALONE
    }
}

/// The median of values, least … greatest.
fn spread(rows: &[&Row], of: impl Fn(&Row) -> f64) -> Measured {
    let Spread {
        median,
        least,
        greatest,
    } = Spread::of(rows.iter().map(|row| of(row)).collect());
    Measured {
        value: median,
        low: least,
        high: greatest,
    }
}

/// Pictures of each scene without a live map and with one.
fn by_way(rows: &[Row]) -> Vec<[Vec<&Row>; 2]> {
    let scenes = rows.chunk_by(|a, b| a.scene == b.scene);
    scenes
        .map(|rows| {
            let (alone, with) = rows.iter().partition(|row| row.is_alone());
            [alone, with]
        })
        .collect()
}

fn way((rows, name): (&Vec<&Row>, &str)) -> Way {
    Way {
        scene: rows.first().map(|row| row.scene.clone()).unwrap_or_default(),
        way: name.into(),
        time: spread(rows, |row| row.time.measured().value),
        mse_twice: spread(rows, |row| row.mse_twice),
        bias_twice: spread(rows, |row| row.bias_twice),
        mse: spread(rows, |row| row.mse),
        bias: spread(rows, |row| row.bias),
        off: spread(rows, |row| row.bias.abs()),
    }
}

fn gain([alone, with]: &[Vec<&Row>; 2]) -> Option<Gain> {
    let alone = alone.first()?;
    let count = |is_better: &dyn Fn(&Row) -> bool| with.iter().filter(|row| is_better(row)).count() as u64;
    Some(Gain {
        scene: alone.scene.clone(),
        off: spread(with, |row| row.bias.abs()).value / alone.bias.abs(),
        worst: greatest(with.iter().map(|row| row.bias.abs())) / alone.bias.abs(),
        places: with.len() as u64,
        nearer: count(&|row| row.bias.abs() < alone.bias.abs()),
        less: count(&|row| row.mse < alone.mse),
    })
}

/// Pictures of a scene: by lights alone, and with a live map at each of the places, in turns.
fn pictures(context: &Context<'_>, gpu: &Gpu, address: &str) -> Result<Vec<Row>> {
    let (quality, spp) = context.pick(FULL, SMOKE);
    let subject = Subject::new(gpu, &scene::load(address)?)?;
    let references = [TWICE, "all"].map(|paths| subject.traced((quality.0, spp), paths));
    let [twice, all] = references;
    let (twice, all) = (twice?, all?);
    let mut previews = [subject.previewed(quality, false)?, subject.previewed(quality, true)?];
    let mut places = vec![(ALONE.to_owned(), Vec3::ZERO)];
    places.extend(subject.places());
    let preview_of = |place: usize| usize::from(place > 0);
    let turns = context.in_turns(TURNS, places.len(), |place| {
        previews[preview_of(place)].frame(places[place].1)
    })?;
    let mut rows = Vec::new();
    for (at, ((name, place), turns)) in places.iter().zip(turns).enumerate() {
        let preview = &mut previews[preview_of(at)];
        preview.frame(*place)?;
        let picture = preview.picture()?;
        let errors = |reference: &Picture| compare(&picture, reference, &CompareOptions::default());
        let (twice, all) = (errors(&twice)?, errors(&all)?);
        rows.push(Row {
            scene: short_name(address).to_owned(),
            place: name.clone(),
            time: Repeats(turns).scaled(1e3),
            mse_twice: twice.relative_mse,
            bias_twice: twice.relative_bias,
            mse: all.relative_mse,
            bias: all.relative_bias,
        });
    }
    Ok(rows)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        context.each(
            context.first(&SCENES, 1),
            |address| short_name(address).to_owned(),
            |address| pictures(context, &gpu, address),
        )
    }

    fn findings(&self) -> Findings {
        let scenes = by_way(self);
        let gains: Vec<Gain> = scenes.iter().filter_map(gain).collect();
        let both = scenes.iter().flat_map(|ways| ways.iter().zip([ALONE, WITH]));
        let ways: Vec<Way> = both.map(way).collect();
        let ((size, shadows, samples), spp) = FULL;
        Findings::of(&gains, CRITERIA)
            .headline(
                "size of the bias with a live map over that by lights alone (geometric mean over scenes)",
                geometric_mean(gains.iter().map(|gain| gain.off.into())),
            )
            .bars(
                "bias",
                "Size of the relative bias against all light",
                &ways,
                |row| [row.scene.clone(), row.way.clone()],
                |row| row.off,
            )
            .and(Findings::of(&ways, &[]))
            .note(format!(
                "Medians of the places, least … greatest. A live map of {0}², of light scattered once, lights all surfaces; nothing stands in its way, \
                 and it comes from infinity. It is drawn at nine places at half the height of the box around the scene, at a quarter, a half and three \
                 quarters of its other sides; those inside bodies see nothing. {size}² pixels against path-traced ones of {spp} samples per pixel; \
                 shadow maps of {shadows}², and {samples}² samples per pixel.",
                MAP.side
            ))
            .and(Findings::of(self, &[]).long())
    }
}
