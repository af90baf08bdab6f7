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

    /// Light of a map's lights, seen from a place: that of the point, or that of the map.
    fn gather(&self, lights: &GatherLights, place: DVec3, exponent: f64) -> f64 {
        let term = |light: &GatherLight| {
            let v = light.position - place;
            let direction = v.normalize();
            let cosine = -light.normal.dot(direction);
            let angle = gather_solid_angle(lights.form(), light.area, v.length_squared(), cosine);
            self.reflectivity(direction, exponent) * angle * light.radiance.x
        };
        lights.lights().iter().map(term).sum()
    }
}

/// All published figures again; a few of them in a smoke run.
pub fn measure(context: &Context<'_>, room: &LitRoom) -> Result<Vec<Row>> {
    let (count, side) = context.pick((POINTS, DIRECTIONS), (20, 24));
    let (map, size) = (Parametrization::Cube, UVec2::splat(side));
    let directions: Vec<(DVec3, f64)> = map
        .texels(size)
        .filter_map(|texel| Some((map.texel_direction(size, texel)?, map.texel_solid_angle(size, texel))))
        .collect();
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
        let seen: Vec<Seen> = LitRoom::points(*place, count)
            .into_iter()
            .map(|point| Seen {
                point,
                to_eye: (EYE - point.position).normalize(),
            })
            .filter(|seen| seen.point.axis.dot(seen.to_eye) > 0.0)
            .collect();
        let exact: Vec<f64> = seen
            .iter()
            .map(|seen| {
                let x = seen.point.position;
                let of = |(direction, solid_angle): &(DVec3, f64)| {
                    let part = seen.reflectivity(*direction, *exponent);
                    if part > 0.0 {
                        part * solid_angle * room.radiance(x + BoxRoom::EMPTY.hit(x, *direction) * *direction)
                    } else {
                        0.0
                    }
                };
                directions.iter().map(of).sum::<f64>()
            })
            .collect();
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
