//! Glossy light of spheres at several places, and of a column between balls of fire, by the map at its place, and by localised gathers of more and more texels.
//!
//! Oracle: sums over directions of what is seen in them from the points. What was published as a reference, the finest gather, is one of those that are judged here.

use clerestory::Result;
use clerestory::film::png::Rgb8;
use clerestory::gpu::Gpu;
use clerestory::maps::gather::lit_room::{LitRoom, relative_errors};
use clerestory::maps::gather::{Gather, GatherLights, GatherPoint, GatherSettings, SolidAngleForm};
use glam::DVec3;

use super::gather_fireballs::{self, Part};
use super::lit_spheres::{Lit, seen_in_lobes, sheet_of};
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Study, curves, rows};
use crate::experiments::measures::Context;

const POINTS: u32 = 400;
/// The published exponent.
const EXPONENT: f32 = 5.0;
/// Directions along the sides of the faces of a cube that the oracle sums over.
const DIRECTIONS: u32 = 96;
const SIDES: [u32; 4] = [2, 4, 8, 16];
/// Texels along a face's side of the map at its place.
pub const CLASSICAL_SIDE: u32 = 32;
const PICTURE: &str = "glossy.png";
/// Of the picture: pixels along a side of a tile, and directions of its oracle along the sides of faces.
pub const TILE: (u32, u32) = (64, 48);
/// From where spheres are seen.
pub const FROM: DVec3 = DVec3::new(-0.6, 0.2, 1.0);

rows! {
    /// A gather at a place.
    struct Row = "Glossy light of a sphere, exponent 5" by [place, way] {
        place: String = "sphere at",
        way: String = "way",
        terms: u64 = "terms",
        rms: f64 = "RMS (%)",
        bias: f64 = "bias (%)",
        of_classical: f64 = "RMS over that of the map at its place",
        of_coarser: Option<f64> = "RMS over that of the next coarser gather",
    }
}
/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    spheres: Vec<Row>,
    column: Vec<Part>,
}

/// What tables call the map at its place.
pub const CLASSICAL: &str = "map at its place";

/// What tables call a gather.
pub fn way(side: u32) -> String {
    format!("{side}² texels a face")
}

fn is_middle(row: &Row) -> bool {
    row.place == DVec3::ZERO.to_string()
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "beside the middle four texels a side are ahead of the map at its place: RMS over its",
        Bound::AtMost(1.0),
        |row: &Row| row.of_classical.into(),
    )
    .among(|row| !is_middle(row) && row.way == way(4)),
    Criterion::each(
        "more texels with the surfaces' own angles are nearer: RMS of sixteen over that of eight",
        Bound::AtMost(1.0),
        |row: &Row| row.of_coarser.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.way == way(16)),
    Criterion::each(
        "in the middle the gather of sixteen is no worse than the map: RMS over its",
        Bound::AtMost(1.0),
        |row: &Row| row.of_classical.into(),
    )
    .among(|row| is_middle(row) && row.way == way(16)),
];

/// Points at the map's place, with their axes.
pub fn at_the_maps_place(points: &[GatherPoint]) -> Vec<GatherPoint> {
    let moved = |point: &GatherPoint| GatherPoint {
        position: DVec3::ZERO,
        ..*point
    };
    points.iter().map(moved).collect()
}

/// Glossy light of points on the device.
fn gathered(gpu: &Gpu, lights: &GatherLights, points: &[GatherPoint]) -> Result<Vec<f64>> {
    let found = Gather::new(gpu, lights, &GatherSettings::default(), EXPONENT)?.gather(points)?;
    Ok(found.into_iter().map(|value| value.x).collect())
}

/// Glossy spheres at places: the oracle, the map at its place, and gathers of more and more texels.
fn picture(
    gpu: &Gpu,
    room: &LitRoom,
    places: &[DVec3],
    (still, lights): (&GatherLights, &[(u32, GatherLights)]),
    (side, directions): (u32, u32),
) -> Result<Rgb8> {
    let views: Vec<_> = places.iter().map(|place| seen_in_lobes(*place, FROM, side)).collect();
    let mut ways: Vec<Lit<'_>> = vec![
        Box::new(move |points: &[GatherPoint]| Ok(room.glossy(points, f64::from(EXPONENT), directions))),
        Box::new(move |points: &[GatherPoint]| gathered(gpu, still, &at_the_maps_place(points))),
    ];
    for (_, lights) in lights {
        ways.push(Box::new(move |points: &[GatherPoint]| gathered(gpu, lights, points)));
    }
    sheet_of(&views, &ways, side)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let room = LitRoom::PUBLISHED;
        let (count, directions) = context.pick((POINTS, DIRECTIONS), (20, 16));
        let sides = context.first(&SIDES, 2);
        let lights: Vec<(u32, GatherLights)> = sides
            .iter()
            .map(|side| Ok((*side, room.lights(*side, SolidAngleForm::DiscWithNormals)?)))
            .collect::<Result<_>>()?;
        let still = room.lights(CLASSICAL_SIDE, SolidAngleForm::Disc)?;
        let places = context.first(&LitRoom::PLACES, 1);
        let shown = picture(&gpu, &room, places, (&still, &lights), context.pick(TILE, (6, 8)))?;
        context.picture(PICTURE, &shown);
        let spheres = context.each(places, DVec3::to_string, |place| {
            let points = LitRoom::points(*place, count);
            let exact = room.glossy(&points, f64::from(EXPONENT), directions);
            let errors = |lights: &GatherLights, points: &[GatherPoint]| -> Result<[f64; 2]> {
                Ok(relative_errors(&gathered(&gpu, lights, points)?, &exact))
            };
            let classical = errors(&still, &at_the_maps_place(&points))?;
            let row = |way: String, terms: u32, [rms, bias]: [f64; 2], coarser: Option<f64>| Row {
                place: place.to_string(),
                way,
                terms: terms.into(),
                rms,
                bias,
                of_classical: rms / classical[0],
                of_coarser: coarser.map(|coarser| rms / coarser),
            };
            let mut rows = vec![row(CLASSICAL.into(), 1, classical, None)];
            let mut coarser = None;
            for (side, lights) in &lights {
                let found = errors(lights, &points)?;
                rows.push(row(way(*side), 6 * side * side, found, coarser));
                coarser = Some(found[0]);
            }
            Ok(rows)
        })?;
        Ok(Self {
            spheres,
            column: gather_fireballs::parts(context, &gpu)?,
        })
    }

    fn findings(&self) -> Findings {
        let corner = LitRoom::PLACES[3].to_string();
        let finest = self
            .spheres
            .iter()
            .find(|row| row.place == corner && row.way == way(16));
        let drawn = self.spheres.iter().filter(|row| row.way != CLASSICAL);
        let drawn: Vec<Row> = drawn.cloned().collect();
        let findings = Findings::of(&self.spheres, CRITERIA)
            .headline(
                "in the corner, RMS of sixteen texels a side over that of the map at its place",
                finest.map(|row| row.of_classical.into()),
            )
            .note("Spheres of radius 0.15 in the room [−1, 1]³ with a bright patch on its floor; lobes about the points' own normals. The map at its place is taken by all its texels, without a look-up's filter.")
            .note("In the corner 4² texels a face are behind the map at its place, and 8² ahead of it: published of irradiance is that normals do not help so few texels there, which lose 42 % of the light since one sample of each is too coarse, and that 8² are the least with normals.")
            .curves(
                "errors",
                "Errors of glossy light by terms",
                Axes::rates("terms", "RMS (%)"),
                curves(&drawn, |row| row.place.clone(), |row| (row.terms as f64, row.rms.into())),
            );
        let findings = if self.spheres.is_empty() {
            findings
        } else {
            findings.picture(
                PICTURE,
                "Glossy spheres of exponent 5 in the middle, half-way to a wall, near the patch and in a corner; from the left sums over directions, the map at its place, and 2², 4², 8² and 16² texels a face with the surfaces' own angles",
            )
        };
        findings.and(gather_fireballs::findings(&self.column))
    }
}
