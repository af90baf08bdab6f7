//! Glossy light by the lobe of the published figures: the cosine of the normal with the half vector to an eye, to the power of the exponent, of what is above the horizon; without a norm,
//! and without the cosine of what arrives.
//!
//! What was published does not say where the eye is. It is taken to be that of the published rays to mirror spheres, and points are those that face it. In f64, with lights and solid angles as
//! printed. Oracle: sums over directions of what is seen in them from the points.

use clerestory::Result;
use clerestory::maps::Parametrization;
use clerestory::maps::gather::lit_room::{LitRoom, relative_errors};
use clerestory::maps::gather::{GatherLight, GatherLights, GatherPoint, SolidAngleForm, gather_solid_angle};
use clerestory::maps::impostor::room::{BoxRoom, ShinySphere};
use glam::{DVec3, UVec2};

use super::gather_glossy::CLASSICAL_SIDE;
use crate::experiments::findings::{Bound, Criterion, rows};
use crate::experiments::measures::Context;

const POINTS: u32 = 400;
/// Directions along the sides of the faces of a cube that the oracle sums over.
const DIRECTIONS: u32 = 96;
/// The same of a smoke run.
const SMOKE: (u32, u32) = (20, 24);
const SIDES: [u32; 3] = [4, 8, 16];
const EYE: DVec3 = ShinySphere::B.camera;

rows! {
    /// A gather.
    struct Row = "Errors of glossy light by the published lobe" by [place, exponent, way] {
        place: String = "sphere at",
        exponent: f64 = "exponent",
        way: String = "lights",
        rms: f64 = "RMS (%)",
        published: f64 = "published RMS (%)",
        bias: f64 = "bias (%)",
    }
}

rows! {
    /// A gather of few of its terms.
    struct Few = "Errors of glossy light by the published lobe, five terms" by [place, exponent, side, terms] {
        place: String = "sphere at",
        exponent: f64 = "exponent",
        side: u64 = "texels along a face's side",
        terms: String = "five terms",
        rms: f64 = "RMS (%)",
        published_rms: Option<f64> = "published RMS (%)",
        bias: f64 = "bias (%)",
        published_bias: Option<f64> = "published bias (%)",
    }
}

/// RMS of the map and of texels, by the exponent.
type Figures = [(f64, [f64; 4]); 3];
/// Place, exponent and published figures.
type Case = (DVec3, f64, [f64; 4]);

/// RMS as published in %, by the exponent: of the map at its place, and of 4², 8² and 16² texels a face.
const PUBLISHED: [(DVec3, Figures); 2] = [
    (
        DVec3::ZERO,
        [
            (5.0, [12.9, 8.5, 4.3, 3.6]),
            (10.0, [15.5, 11.9, 4.7, 4.4]),
            (50.0, [36.3, 76.5, 17.4, 6.0]),
        ],
    ),
    (
        DVec3::new(0.5, -0.3, 0.3),
        [
            (5.0, [66.8, 33.7, 20.2, 14.7]),
            (10.0, [82.6, 48.2, 26.9, 17.6]),
            (50.0, [186.0, 162.0, 91.9, 37.2]),
        ],
    ),
];
/// The greatest exponent whose lobe is wide beside the texels of the coarsest map.
const WIDE: f64 = 10.0;
/// Terms that are taken, those of the greatest reflectivity times solid angle.
const FEW: usize = 5;
/// What tables call them: as they are, and scaled to the sum of all weights.
const AS_THEY_ARE: &str = "as they are";
const SCALED: &str = "scaled";
/// Exponents of these gathers, and their texels along a face's side.
const FEW_EXPONENTS: [f64; 2] = [10.0, 50.0];
const FEW_SIDES: [u32; 2] = [4, 8];

/// Biases in % of five of 4² texels a face, exponent 10, as published for the two places: as they are, and scaled.
const PUBLISHED_BIASES: [[f64; 2]; 2] = [[-37.0, 6.2], [-36.0, 5.8]];
/// RMS in % of five scaled terms in the middle of the room as published, by the exponent, of 4² and 8² texels a face.
const PUBLISHED_FEW: [[f64; 2]; 2] = [[27.8, 58.8], [77.7, 21.5]];

/// Relative difference to what was published, in %.
fn missed(row: &Row) -> f64 {
    100.0 * (row.rms - row.published).abs() / row.published
}

pub const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "by the published lobe RMS errors are the published ones, exponents 5 and 10: relative difference (%)",
        Bound::AtMost(20.0),
        |row: &Row| missed(row).into(),
    )
    .among(|row| row.exponent <= WIDE),
    Criterion::each(
        "by the published lobe RMS errors are the published ones, exponent 50: relative difference (%)",
        Bound::AtMost(20.0),
        |row: &Row| missed(row).into(),
    )
    .among(|row| row.exponent > WIDE),
];

/// Relative difference to what was published of five terms, in %.
fn missed_by_few(row: &Few) -> f64 {
    let published = row.published_rms.unwrap_or(f64::NAN);
    100.0 * (row.rms - published).abs() / published
}

/// Points by which published and found biases may differ.
const POINTS_OFF: f64 = 6.0;

/// Criteria of few terms.
pub const OF_FEW: &[Criterion<Few>] = &[
    Criterion::each(
        "by the published lobe five terms have the published biases: difference (%)",
        Bound::AtMost(POINTS_OFF),
        |row: &Few| {
            let off = row.published_bias.map_or(f64::NAN, |published| row.bias - published);
            off.abs().into()
        },
    )
    .among(|row| row.published_bias.is_some()),
    Criterion::each(
        "by the published lobe five scaled terms of 4² texels keep the energy, exponent 10: bias (%)",
        Bound::Between(-10.0, 10.0),
        |row: &Few| row.bias.into(),
    )
    .among(|row| row.terms == SCALED && row.side == 4 && row.exponent <= WIDE),
    Criterion::each(
        "by the published lobe five terms have the published RMS errors, exponent 10: relative difference (%)",
        Bound::AtMost(20.0),
        |row: &Few| missed_by_few(row).into(),
    )
    .among(|row| row.published_rms.is_some() && row.exponent <= WIDE),
    Criterion::each(
        "by the published lobe five terms have the published RMS errors, exponent 50: relative difference (%)",
        Bound::AtMost(20.0),
        |row: &Few| missed_by_few(row).into(),
    )
    .among(|row| row.published_rms.is_some() && row.exponent > WIDE),
];

/// A point of a sphere and the unit direction to the eye.
struct Seen {
    point: GatherPoint,
    to_eye: DVec3,
}

impl Seen {
    /// What the point reflects to the eye of light from a unit direction.
    fn reflectivity(&self, direction: DVec3, exponent: f64) -> f64 {
        let normal = self.point.axis;
        if normal.dot(direction) <= 0.0 {
            return 0.0;
        }
        let half = (direction + self.to_eye).normalize_or_zero();
        normal.dot(half).max(0.0).powf(exponent)
    }

    /// Weights of a map's lights, reflectivity times solid angle, and their radiances, seen from a place: that of the point, or that of the map.
    fn terms(&self, lights: &GatherLights, place: DVec3, exponent: f64) -> Vec<(f64, f64)> {
        let term = |light: &GatherLight| {
            let v = light.position - place;
            let direction = v.normalize();
            let cosine = -light.normal.dot(direction);
            let angle = gather_solid_angle(lights.form(), light.area, v.length_squared(), cosine);
            (self.reflectivity(direction, exponent) * angle, light.radiance.x)
        };
        lights.lights().iter().map(term).collect()
    }

    /// Light of all of them.
    fn gather(&self, lights: &GatherLights, place: DVec3, exponent: f64) -> f64 {
        light_of(&self.terms(lights, place, exponent))
    }

    /// Light of those of the greatest weights, seen from the point: as they are, and scaled to the sum of all weights.
    fn gather_few(&self, lights: &GatherLights, exponent: f64) -> [f64; 2] {
        let weight_of = |terms: &[(f64, f64)]| terms.iter().map(|(weight, _)| weight).sum::<f64>();
        let mut terms = self.terms(lights, self.point.position, exponent);
        let all = weight_of(&terms);
        terms.sort_by(|a, b| b.0.total_cmp(&a.0));
        terms.truncate(FEW);
        let (light, few) = (light_of(&terms), weight_of(&terms));
        [light, if few > 0.0 { light * all / few } else { 0.0 }]
    }
}

/// What terms bring together.
fn light_of(terms: &[(f64, f64)]) -> f64 {
    terms.iter().map(|(weight, radiance)| weight * radiance).sum()
}

/// Points of a sphere at a place that face the eye.
fn facing(place: DVec3, count: u32) -> Vec<Seen> {
    LitRoom::points(place, count)
        .into_iter()
        .map(|point| Seen {
            point,
            to_eye: (EYE - point.position).normalize(),
        })
        .filter(|seen| seen.point.axis.dot(seen.to_eye) > 0.0)
        .collect()
}

/// Directions that the oracle sums over, with their solid angles.
fn directions(side: u32) -> Vec<(DVec3, f64)> {
    let (map, size) = (Parametrization::Cube, UVec2::splat(side));
    map.texels(size)
        .filter_map(|texel| Some((map.texel_direction(size, texel)?, map.texel_solid_angle(size, texel))))
        .collect()
}

/// What is seen from points in all of them.
fn exact(room: &LitRoom, seen: &[Seen], directions: &[(DVec3, f64)], exponent: f64) -> Vec<f64> {
    let of_point = |seen: &Seen| {
        let x = seen.point.position;
        let of = |(direction, solid_angle): &(DVec3, f64)| {
            let part = seen.reflectivity(*direction, exponent);
            if part > 0.0 {
                part * solid_angle * room.radiance(x + BoxRoom::EMPTY.hit(x, *direction) * *direction)
            } else {
                0.0
            }
        };
        directions.iter().map(of).sum::<f64>()
    };
    seen.iter().map(of_point).collect()
}

/// All published figures again; a few of them in a smoke run.
pub fn measure(context: &Context<'_>, room: &LitRoom) -> Result<Vec<Row>> {
    let (count, side) = context.pick((POINTS, DIRECTIONS), SMOKE);
    let directions = directions(side);
    let sides = context.first(&SIDES, 1);
    let printed = |side: u32| room.printed_lights(side, SolidAngleForm::Disc);
    let still = printed(CLASSICAL_SIDE)?;
    let lights: Vec<GatherLights> = sides.iter().map(|side| printed(*side)).collect::<Result<_>>()?;
    let cases: Vec<Case> = PUBLISHED
        .into_iter()
        .flat_map(|(place, figures)| figures.map(|(exponent, figures)| (place, exponent, figures)))
        .collect();
    let name = |(place, exponent, _): &Case| format!("{place}, published lobe, exponent {exponent}");
    context.each(context.first(&cases, 1), name, |(place, exponent, figures)| {
        let seen = facing(*place, count);
        let exact = exact(room, &seen, &directions, *exponent);
        let row = |way: String, found: Vec<f64>, published: f64| {
            let [rms, bias] = relative_errors(&found, &exact);
            Row {
                place: place.to_string(),
                exponent: *exponent,
                way,
                rms,
                published,
                bias,
            }
        };
        let classical = seen.iter().map(|seen| seen.gather(&still, DVec3::ZERO, *exponent));
        let mut rows = vec![row("all, at the map's place".into(), classical.collect(), figures[0])];
        for ((side, lights), published) in sides.iter().zip(&lights).zip(&figures[1..]) {
            let found = seen
                .iter()
                .map(|seen| seen.gather(lights, seen.point.position, *exponent));
            rows.push(row(format!("{side}² texels a face"), found.collect(), *published));
        }
        Ok(rows)
    })
}

/// Five terms of 4² and 8² texels a face at both places; a few of them in a smoke run.
///
/// # Errors
/// None but of the lights.
pub fn measure_few(context: &Context<'_>, room: &LitRoom) -> Result<Vec<Few>> {
    let (count, side) = context.pick((POINTS, DIRECTIONS), SMOKE);
    let directions = directions(side);
    let cases: Vec<(usize, usize)> = (0..PUBLISHED.len())
        .flat_map(|place| (0..FEW_EXPONENTS.len()).map(move |exponent| (place, exponent)))
        .collect();
    let lights: Vec<GatherLights> = FEW_SIDES
        .iter()
        .map(|side| room.printed_lights(*side, SolidAngleForm::Disc))
        .collect::<Result<_>>()?;
    let name = |(place, exponent): &(usize, usize)| {
        let (place, exponent) = (PUBLISHED[*place].0, FEW_EXPONENTS[*exponent]);
        format!("{place}, five terms of the published lobe, exponent {exponent}")
    };
    context.each(context.first(&cases, 1), name, |case| {
        let (place, exponent) = (PUBLISHED[case.0].0, FEW_EXPONENTS[case.1]);
        let seen = facing(place, count);
        let exact = exact(room, &seen, &directions, exponent);
        let mut rows = Vec::new();
        for (i, (side, lights)) in FEW_SIDES.into_iter().zip(&lights).enumerate() {
            let found: Vec<[f64; 2]> = seen.iter().map(|seen| seen.gather_few(lights, exponent)).collect();
            for (way, terms) in [AS_THEY_ARE, SCALED].into_iter().enumerate() {
                let light: Vec<f64> = found.iter().map(|of_point| of_point[way]).collect();
                let [rms, bias] = relative_errors(&light, &exact);
                let has_bias = side == FEW_SIDES[0] && exponent <= WIDE;
                let has_rms = place == DVec3::ZERO && terms == SCALED;
                rows.push(Few {
                    place: place.to_string(),
                    exponent,
                    side: side.into(),
                    terms: terms.into(),
                    rms,
                    published_rms: has_rms.then(|| PUBLISHED_FEW[case.1][i]),
                    bias,
                    published_bias: has_bias.then(|| PUBLISHED_BIASES[case.0][way]),
                });
            }
        }
        Ok(rows)
    })
}
