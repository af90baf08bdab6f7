//! Glossy light of spheres at several places by the map at its place, and by localised gathers of more and more texels.
//!
//! Oracle: sums over directions of what is seen in them from the points. What was published as a reference, the finest gather, is one of those that are judged here.

use clerestory::Result;
use clerestory::maps::gather::lit_room::{LitRoom, relative_errors};
use clerestory::maps::gather::{Gather, GatherLights, GatherPoint, GatherSettings, SolidAngleForm};
use glam::DVec3;

use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Study, curves, rows};
use crate::experiments::measures::Context;

const POINTS: u32 = 400;
/// The published exponent.
const EXPONENT: f32 = 5.0;
/// Directions along the sides of the faces of a cube that the oracle sums over.
const DIRECTIONS: u32 = 96;
const SIDES: [u32; 4] = [2, 4, 8, 16];
/// Texels along a face's side of the map at its place.
const CLASSICAL_SIDE: u32 = 32;

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
pub type Found = Vec<Row>;

const CLASSICAL: &str = "map at its place";

fn way(side: u32) -> String {
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
        context.each(places, DVec3::to_string, |place| {
            let points = LitRoom::points(*place, count);
            let exact = room.glossy(&points, f64::from(EXPONENT), directions);
            let errors = |lights: &GatherLights, points: &[GatherPoint]| -> Result<[f64; 2]> {
                let found = Gather::new(&gpu, lights, &GatherSettings::default(), EXPONENT)?.gather(points)?;
                let found: Vec<f64> = found.into_iter().map(|value| value.x).collect();
                Ok(relative_errors(&found, &exact))
            };
            let at_the_maps_place: Vec<GatherPoint> = points
                .iter()
                .map(|point| GatherPoint {
                    position: DVec3::ZERO,
                    ..*point
                })
                .collect();
            let classical = errors(&still, &at_the_maps_place)?;
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
        })
    }

    fn findings(&self) -> Findings {
        let corner = LitRoom::PLACES[3].to_string();
        let finest = self.iter().find(|row| row.place == corner && row.way == way(16));
        let drawn: Vec<Row> = self.iter().filter(|row| row.way != CLASSICAL).cloned().collect();
        Findings::of(self, CRITERIA)
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
            )
    }
}
