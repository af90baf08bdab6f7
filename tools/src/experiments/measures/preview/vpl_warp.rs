//! Points that are warped through pyramids of what texels reflect: how evenly they share it, and what that is worth for the light that they bring.
//!
//! Sources: P. Clarberg et al., SIGGRAPH 2005; C. Sun, Master's thesis, WPI, 2015, §4.8. Oracle: sums over all texels, in f64.

use clerestory::Result;
use clerestory::raster::reflective::{flux_levels, rsm_radical_inverse, rsm_warp, warp_through};
use glam::{DVec2, DVec3, UVec2};

use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Study, geometric_mean, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::pictures::{Panel, tiled};
use crate::random::Random;

/// Texels along a side of a map.
const SIDE: usize = 128;
/// Parts along a side whose shares are counted.
const PARTS: usize = 8;
/// Points of a frame.
const POINTS: [u32; 3] = [128, 512, 2048];
const FRAMES: usize = 256;
/// How high receivers are over the map, in widths of it.
const HEIGHT: f64 = 0.4;
/// Squares of a chequered texture along a side, and what its dark ones reflect of its bright ones.
const SQUARES: f64 = 12.0;
const DARK: f64 = 0.1;
/// Points of a picture, and pixels along a side of a panel.
const SHOWN_POINTS: u32 = 512;
const SHOWN_SIDE: u32 = 256;
const STEPS: &str = "steps.png";
const SPOTS: &str = "spots.png";
/// What four texels reflect: left and right above, left and right below.
const FOUR: [f64; 4] = [1.0, 3.0, 6.0, 2.0];
/// Grey of the brightest texel below points, and their color.
const BRIGHTEST: f64 = 160.0;
const POINT: [u8; 3] = [255, 160, 0];

/// How points are chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    /// Texels at random, all alike.
    Even,
    /// Independent points, warped.
    Random,
    /// Of bases 2 and 3, shifted, warped.
    Halton,
    /// Their number and base 2, shifted, warped.
    Hammersley,
}

impl Way {
    const ALL: [Self; 4] = [Self::Even, Self::Random, Self::Halton, Self::Hammersley];

    const fn name(self) -> &'static str {
        match self {
            Self::Even => "texels alike",
            Self::Random => "random, warped",
            Self::Halton => "Halton, warped",
            Self::Hammersley => "Hammersley, warped",
        }
    }
}

rows! {
    /// A way in a map.
    struct Row = "Points on maps of what texels reflect" by [map, way, points] {
        map: String = "map",
        way: String = "way",
        points: u64 = "points of a frame",
        shares: f64 = "RMS error of the shares of 64 parts, over that of independent points",
        light: f64 = "relative RMSE of the light at a receiver",
        bias: Measured = "relative error of its mean",
    }
}

rows! {
    /// What warping is worth in a map.
    struct Worth = "Worth of warping" by [map, points] {
        map: String = "map",
        points: u64 = "points of a frame",
        warped: f64 = "variance without warping over that of random points, warped",
        halton: f64 = "variance of random points over that of Halton's, both warped",
    }
}

/// What was found.
pub type Found = Vec<Row>;

const OF_ROWS: &[Criterion<Row>] = &[
    Criterion::each(
        "means are those of all texels",
        Bound::Between(-1e-3, 1e-3),
        |row: &Row| row.bias,
    )
    .because("of 256 frames of low-discrepancy points")
    .among(|row| row.way != Way::Even.name() && row.way != Way::Random.name()),
    Criterion::each(
        "shares of low-discrepancy points err half as much as independent ones at most",
        Bound::AtMost(0.5),
        |row: &Row| row.shares.into(),
    )
    .because("512 points on 64 parts")
    .among(|row| row.way != Way::Even.name() && row.way != Way::Random.name() && row.points >= 512),
];
const OF_WORTH: &[Criterion<Worth>] = &[
    Criterion::each(
        "warping halves the variance of textured spots at least",
        Bound::AtLeast(2.0),
        |row: &Worth| row.warped.into(),
    ),
    Criterion::each(
        "Halton points have half the variance of independent ones at most",
        Bound::AtLeast(2.0),
        |row: &Worth| row.halton.into(),
    )
    .among(|row| row.points >= 512),
];

/// A texel's middle in the unit square.
fn middle(texel: usize) -> DVec2 {
    (DVec2::new((texel % SIDE) as f64, (texel / SIDE) as f64) + 0.5) / SIDE as f64
}

/// What a spot of a half width about a place sends there.
fn spot(at: DVec2, place: DVec2, half_width: f64) -> f64 {
    let share = (1.0 - (at - place).length() / half_width).max(0.0);
    share * share
}

fn chequered(at: DVec2) -> f64 {
    let square = (SQUARES * at).floor();
    if (square.x + square.y) % 2.0 == 0.0 { 1.0 } else { DARK }
}

/// Maps by name.
fn maps() -> [(&'static str, Vec<f64>); 3] {
    let of = |flux: &dyn Fn(DVec2) -> f64| (0..SIDE * SIDE).map(|texel| flux(middle(texel))).collect();
    let two = |at: DVec2| spot(at, DVec2::new(0.3, 0.35), 0.2) + 3.0 * spot(at, DVec2::new(0.72, 0.6), 0.15);
    [
        (
            "one textured spot",
            of(&|at| spot(at, DVec2::splat(0.5), 0.45) * chequered(at)),
        ),
        ("two spots", of(&two)),
        ("two textured spots", of(&|at| two(at) * chequered(at))),
    ]
}

/// Light of a texel's power at a receiver over the middle of the map, that faces it.
fn brought(texel: usize) -> f64 {
    let way = (DVec2::splat(0.5) - middle(texel)).extend(HEIGHT);
    let cosine = way.normalize().dot(DVec3::Z);
    cosine * cosine / way.length_squared()
}

/// Error of the shares of parts and the light of a frame.
fn frame(way: Way, levels: &[Vec<f64>], shares: &[f64], count: u32, random: &mut Random) -> (f64, f64) {
    let map = &levels[0];
    let shift = DVec2::new(random.unit(), random.unit());
    let (mut found, mut light) = (vec![0.0; PARTS * PARTS], 0.0);
    for number in 0..count {
        let fresh = DVec2::new(random.unit(), random.unit());
        let point = match way {
            Way::Even | Way::Random => fresh,
            Way::Halton => DVec2::new(rsm_radical_inverse(number, 2), rsm_radical_inverse(number, 3)) + shift,
            Way::Hammersley => {
                let along = (f64::from(number) + 0.5) / f64::from(count);
                DVec2::new(along, rsm_radical_inverse(number, 2)) + shift
            }
        };
        let point = point.fract();
        let chosen = match way {
            Way::Even => {
                let [x, y] = (point * SIDE as f64).as_uvec2().to_array();
                let texel = y as usize * SIDE + x as usize;
                Some((texel, 1.0 / map.len() as f64))
            }
            _ => warp_through(levels, point),
        };
        let Some((texel, probability)) = chosen else {
            continue;
        };
        let weight = 1.0 / (f64::from(count) * probability);
        light += weight * map[texel] * brought(texel);
        found[part_of(texel)] += weight * map[texel];
    }
    let total: f64 = shares.iter().sum();
    let errors = found
        .iter()
        .zip(shares)
        .map(|(found, share)| ((found - share) / total).powi(2));
    (errors.sum::<f64>() / shares.len() as f64, light)
}

fn part_of(texel: usize) -> usize {
    let part = SIDE / PARTS;
    texel / SIDE / part * PARTS + texel % SIDE / part
}

fn of_map(name: &str, map: &[f64], points: &[u32], frames: usize) -> Vec<Row> {
    let levels = flux_levels(map, SIDE);
    let mut shares = vec![0.0; PARTS * PARTS];
    for (texel, flux) in map.iter().enumerate() {
        shares[part_of(texel)] += flux;
    }
    let total: f64 = map.iter().sum();
    let expected: f64 = map.iter().enumerate().map(|(texel, flux)| flux * brought(texel)).sum();
    let mut rows = Vec::new();
    for count in points {
        for way in Way::ALL {
            let mut random = Random::new(17);
            let of_frames: Vec<(f64, f64)> = (0..frames)
                .map(|_| frame(way, &levels, &shares, *count, &mut random))
                .collect();
            let n = frames as f64;
            let mean = |of: &dyn Fn(&(f64, f64)) -> f64| of_frames.iter().map(of).sum::<f64>() / n;
            // Of independent points that are as many as shares say, each share's variance is p (1 - p) / count.
            let chance = shares
                .iter()
                .map(|share| share / total * (1.0 - share / total))
                .sum::<f64>();
            let chance = chance / (f64::from(*count) * shares.len() as f64);
            let squared = mean(&|(_, light)| (light / expected - 1.0).powi(2));
            rows.push(Row {
                map: name.into(),
                way: way.name().into(),
                points: (*count).into(),
                shares: (mean(&|(errors, _)| *errors) / chance).sqrt(),
                light: squared.sqrt(),
                bias: Measured::within(mean(&|(_, light)| light / expected - 1.0), 2.0 * (squared / n).sqrt()),
            });
        }
    }
    rows
}

fn worth(rows: &[Row]) -> Vec<Worth> {
    let of_ways = rows.chunks_exact(Way::ALL.len());
    let worth = |of: &[Row]| {
        let variance = |way: Way| of.iter().find(|row| row.way == way.name()).map(|row| row.light.powi(2));
        let (even, random, halton) = (variance(Way::Even)?, variance(Way::Random)?, variance(Way::Halton)?);
        Some(Worth {
            map: of[0].map.clone(),
            points: of[0].points,
            warped: even / random,
            halton: random / halton,
        })
    };
    of_ways.filter_map(worth).collect()
}

/// Points of the unit square over what reflects there, the most of which is 1.
fn overlay(reflected: impl Fn(DVec2) -> f64, points: impl Iterator<Item = DVec2>) -> Panel {
    let side = f64::from(SHOWN_SIDE);
    let pixels = (0..SHOWN_SIDE * SHOWN_SIDE).map(|i| DVec2::from([i % SHOWN_SIDE, i / SHOWN_SIDE].map(f64::from)));
    let mut panel: Panel = pixels
        .map(|pixel| [(BRIGHTEST * reflected((pixel + 0.5) / side)) as u8; 3])
        .collect();
    for point in points {
        // Squares of two pixels, of which a point is the middle.
        let [x, y] = (point * side - 0.5)
            .clamp(DVec2::ZERO, DVec2::splat(side - 2.0))
            .as_uvec2()
            .to_array();
        for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            panel[((y + j) * SHOWN_SIDE + x + i) as usize] = POINT;
        }
    }
    panel
}

/// Independent points over four texels: as they are, behind the step along the vertical, and behind that along the horizontal.
fn steps_shown() -> Vec<Panel> {
    let mut random = Random::new(23);
    let points: Vec<[DVec2; 3]> = (0..SHOWN_POINTS)
        .map(|_| {
            let point = DVec2::new(random.unit(), random.unit());
            let (texel, place) = rsm_warp(FOUR, point);
            let warped = 0.5 * (texel.as_dvec2() + place);
            [point, DVec2::new(point.x, warped.y), warped]
        })
        .collect();
    let most = FOUR.into_iter().fold(0.0, f64::max);
    let reflected = |at: DVec2| {
        let [column, row] = (2.0 * at).as_uvec2().min(UVec2::ONE).to_array();
        FOUR[(2 * row + column) as usize] / most
    };
    [0, 1, 2]
        .map(|step| overlay(reflected, points.iter().map(|all| all[step])))
        .into()
}

/// Halton's points, warped, over a map.
fn spots_shown(map: &[f64]) -> Panel {
    let levels = flux_levels(map, SIDE);
    let points = (0..SHOWN_POINTS).filter_map(|number| {
        let point = DVec2::new(rsm_radical_inverse(number, 2), rsm_radical_inverse(number, 3));
        let (texel, _) = warp_through(&levels, point)?;
        Some(middle(texel))
    });
    let most = map.iter().copied().fold(0.0, f64::max);
    let reflected = |at: DVec2| {
        let [x, y] = (at * SIDE as f64).as_uvec2().to_array();
        map[(y as usize).min(SIDE - 1) * SIDE + (x as usize).min(SIDE - 1)] / most
    };
    overlay(reflected, points)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let (points, frames) = (context.first(&POINTS, 1), context.pick(FRAMES, 32));
        let maps = maps();
        context.picture(STEPS, &tiled([SHOWN_SIDE; 2], 1, &[steps_shown()]));
        let spots: Vec<Panel> = maps[1..].iter().map(|(_, map)| spots_shown(map)).collect();
        context.picture(SPOTS, &tiled([SHOWN_SIDE; 2], 1, &[spots]));
        context.each(
            context.first(&maps, 1),
            |(name, _)| (*name).to_owned(),
            |(name, map)| Ok(of_map(name, map, points, frames)),
        )
    }

    fn findings(&self) -> Findings {
        let worth = worth(self);
        let found = Findings::of(self, OF_ROWS)
            .headline(
                "variance of texels alike over that of warped points of Halton (geometric mean)",
                geometric_mean(worth.iter().map(|row| Measured::exact(row.warped * row.halton))),
            )
            .and(Findings::of(&worth, OF_WORTH))
            .note(format!(
                "Maps of {SIDE}² texels, by twins in f64. Shares are those of {PARTS}² parts in what all texels reflect. The receiver faces the middle of the map from {HEIGHT} of its width away. A \
                 frame has its own shift, or its own random points; {FRAMES} frames each."
            ));
        if self.is_empty() {
            return found;
        }
        found
            .picture(
                STEPS,
                "Independent points over four texels, brighter where these reflect more: as they are, behind the step along the vertical, and behind that along the horizontal.",
            )
            .picture(
                SPOTS,
                "512 virtual lights by Halton's points on the maps of two spots, plain and textured.",
            )
    }
}
