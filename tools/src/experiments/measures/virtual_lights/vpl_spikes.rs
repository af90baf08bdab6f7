//! Spikes of virtual lights in corners, and what a least distance takes of them and of all light.
//!
//! Oracle: the same lights, seen by the same rays, without a bound. Source of what this follows: the chapter on virtual light sources of a doctoral thesis on metals and reflections on graphics
//! hardware, §6.2 and figure 6.3, and figures that were computed elsewhere for the same box.

use clerestory::Result;
use clerestory::film::png::Rgb8;
use clerestory::srgb::srgb_byte;
use clerestory::techniques::instant_radiosity::selection::{LitPoint, SurfaceLight, Survival, potential_contribution};
use clerestory::transport::edge_bound::EdgeBound;
use clerestory::transport::environment::luminance;
use glam::DVec3;

use super::unit_box::UnitBox;
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Study, rows};
use crate::experiments::measures::Context;

/// Pixels across and down; the same of a smoke run.
const SIZE: [[u32; 2]; 2] = [[96, 60], [24, 15]];
/// Walks of a picture.
const WALKS: u32 = 20;
const SEEDS: [u32; 3] = [0, 1, 2];
/// Least distances in a box of 1 m, of figure 6.3; 0 for none.
const DISTANCES: [f64; 4] = [NONE, TWENTIETH, TENTH, FIFTH];
const NONE: f64 = 0.0;
const TWENTIETH: f64 = 0.05;
const TENTH: f64 = 0.1;
const FIFTH: f64 = 0.2;
/// What was computed elsewhere with three other seeds: the greatest pixel over the 99th percentile, and the light lost, %.
const ELSEWHERE: [(f64, [&str; 2]); 4] = [
    (NONE, ["6.8 to 35.0", "0"]),
    (TWENTIETH, ["2.4 to 3.0", "0.25 to 1.9"]),
    (TENTH, ["1.12 to 1.75", "0.7 to 3.0"]),
    (FIFTH, ["1.03", "2.2 to 5.4"]),
];
/// The pictures, side by side, and how many pixels show one.
const SHOWN: &str = "vpl-spikes.png";
const ENLARGED: u32 = 3;

rows! {
    /// A least distance with the lights of a seed.
    struct Row = "Spikes by the least distance" by [distance, seed] {
        distance: f64 = "least distance (m)",
        seed: u64 = "seed",
        lights: u64 = "lights",
        spike: f64 = "greatest pixel over the 99th percentile",
        lost: f64 = "light lost (%)",
    }
    beside "computed elsewhere: greatest pixel over the 99th percentile" = |row| row.elsewhere()[0].into();
    beside "computed elsewhere: light lost (%)" = |row| row.elsewhere()[1].into();
}

/// What was found.
pub type Found = Vec<Row>;

impl Row {
    fn elsewhere(&self) -> [&'static str; 2] {
        let known = ELSEWHERE.iter().find(|(distance, _)| *distance == self.distance);
        known.map_or(["none"; 2], |(_, found)| *found)
    }
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "without a bound spikes stand out: greatest pixel over the 99th percentile",
        Bound::AtLeast(5.0),
        |row: &Row| row.spike.into(),
    )
    .among(|row| row.distance == NONE),
    Criterion::each(
        "a tenth of the box removes them: greatest pixel over the 99th percentile",
        Bound::AtMost(2.0),
        |row: &Row| row.spike.into(),
    )
    .among(|row| row.distance == TENTH),
    Criterion::each(
        "a twentieth of the box leaves 2.4 to 3: greatest pixel over the 99th percentile",
        Bound::Between(2.4, 3.0),
        |row: &Row| row.spike.into(),
    )
    .among(|row| row.distance == TWENTIETH)
    .because("the three seeds of the figures computed elsewhere"),
    Criterion::each(
        "a fifth of the box leaves 1.03: greatest pixel over the 99th percentile",
        Bound::AtMost(1.1),
        |row: &Row| row.spike.into(),
    )
    .among(|row| row.distance == FIFTH)
    .because("to a tenth"),
    Criterion::each(
        "a twentieth of the box loses 0.25 to 1.9 % of the light",
        Bound::Between(0.25, 1.9),
        |row: &Row| row.lost.into(),
    )
    .among(|row| row.distance == TWENTIETH),
    Criterion::each(
        "a tenth of the box loses 0.7 to 3 % of the light",
        Bound::Between(0.7, 3.0),
        |row: &Row| row.lost.into(),
    )
    .among(|row| row.distance == TENTH),
    Criterion::each(
        "a fifth of the box loses 2.2 to 5.4 % of the light",
        Bound::Between(2.2, 5.4),
        |row: &Row| row.lost.into(),
    )
    .among(|row| row.distance == FIFTH),
];

/// The bound that a least distance is.
fn bound_of(distance: f64) -> EdgeBound {
    if distance > NONE {
        EdgeBound::Distance(distance * distance)
    } else {
        EdgeBound::Unbounded
    }
}

/// Luminance of each point by the lights that it sees, with each of the least distances.
fn pictures(unit_box: &UnitBox, points: &[LitPoint], lights: &[SurfaceLight]) -> [Vec<f64>; DISTANCES.len()] {
    let mut all = DISTANCES.map(|_| Vec::with_capacity(points.len()));
    for point in points {
        let brings = |light: &SurfaceLight| potential_contribution(light, point, EdgeBound::Unbounded) != DVec3::ZERO;
        let seen: Vec<&SurfaceLight> = lights
            .iter()
            .filter(|light| brings(light) && unit_box.sees(point, light))
            .collect();
        for (values, distance) in all.iter_mut().zip(DISTANCES) {
            let brought = seen
                .iter()
                .map(|light| luminance(potential_contribution(light, point, bound_of(distance))));
            values.push(brought.sum::<f64>());
        }
    }
    all
}

/// The greatest value, and that which a hundredth of all are above.
fn brightest(values: &[f64]) -> [f64; 2] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = |place: usize| sorted.get(place).copied().unwrap_or(f64::NAN);
    [at(sorted.len().saturating_sub(1)), at(sorted.len() * 99 / 100)]
}

/// Pictures side by side and enlarged, all of one exposure: what is as bright as the brightest hundredth without a bound is white.
fn side_by_side([width, height]: [u32; 2], pictures: &[Vec<f64>]) -> Rgb8 {
    let white = pictures.first().map_or(1.0, |values| brightest(values)[1]);
    let mut shown = Rgb8 {
        width: width * ENLARGED * pictures.len() as u32,
        height: height * ENLARGED,
        bytes: Vec::new(),
    };
    for y in 0..shown.height {
        for values in pictures {
            for x in 0..width * ENLARGED {
                let pixel = (y / ENLARGED * width + x / ENLARGED) as usize;
                shown.bytes.extend([srgb_byte(values[pixel] / white); 3]);
            }
        }
    }
    shown
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let size = context.pick(SIZE[0], SIZE[1]);
        let unit_box = UnitBox::load()?;
        let points = unit_box.points(size)?;
        context.each(
            context.first(&SEEDS, 2),
            |seed| format!("seed {seed}"),
            |seed| {
                let lights = unit_box.lights(WALKS, *seed, Survival::Roulette);
                let pictures = pictures(&unit_box, &points, &lights);
                if *seed == SEEDS[0] {
                    context.picture(SHOWN, &side_by_side(size, &pictures));
                }
                let whole: f64 = pictures[0].iter().sum();
                let rows = DISTANCES.iter().zip(&pictures).map(|(distance, values)| {
                    let [greatest, percentile] = brightest(values);
                    Row {
                        distance: *distance,
                        seed: (*seed).into(),
                        lights: lights.len() as u64,
                        spike: greatest / percentile,
                        lost: 100.0 * (1.0 - values.iter().sum::<f64>() / whole),
                    }
                });
                Ok(rows.collect())
            },
        )
    }

    fn findings(&self) -> Findings {
        let bounded = self.iter().filter(|row| row.distance == TENTH).map(|row| row.spike);
        let worst = bounded.reduce(f64::max).map(Measured::exact);
        let found = Findings::of(self, CRITERIA)
            .headline(
                "greatest pixel over the 99th percentile with a tenth of the box as the least distance, the worst of three seeds",
                worst,
            )
            .note(format!(
                "The unit box with {WALKS} walks from its lamp, whose own points are lights as in the source, {} × {} pixels, all surfaces by Lambert's law. The same lights and rays with each least distance, whose square \
                 bounds that in the denominator; what was computed elsewhere has other seeds.",
                SIZE[0][0], SIZE[0][1]
            ));
        if self.is_empty() {
            return found;
        }
        found.picture(
            SHOWN,
            "The same lights without a bound, and with least distances of a twentieth, a tenth and a fifth of the box: spikes beside walls vanish, and corners become darker.",
        )
    }
}
