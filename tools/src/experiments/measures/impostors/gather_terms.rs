//! Five terms of a glossy gather beside all of them, and beside the map at its place: what is lost, and what scaling gives back.
//!
//! Oracle: sums over directions of what is seen in them from the points.

use clerestory::Result;
use clerestory::maps::gather::lit_room::{LitRoom, relative_errors};
use clerestory::maps::gather::{Gather, GatherLights, GatherPoint, GatherSettings, SolidAngleForm, Terms};
use glam::DVec3;

use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Study, rows};
use crate::experiments::measures::Context;

const POINTS: u32 = 400;
const EXPONENTS: [f32; 3] = [5.0, 10.0, 50.0];
/// The middle of the room, and near the patch.
const PLACES: [DVec3; 2] = [DVec3::ZERO, DVec3::new(0.5, -0.3, 0.3)];
/// Directions along the sides of the faces of a cube that the oracle sums over.
const DIRECTIONS: u32 = 96;

rows! {
    /// A gather.
    struct Row = "Errors of glossy light over a sphere of points" by [place, exponent, side, terms] {
        place: String = "sphere at",
        exponent: f64 = "exponent",
        side: u64 = "texels along a face's side",
        terms: String = "terms",
        rms: f64 = "RMS (%)",
        bias: f64 = "bias (%)",
        of_all: Option<f64> = "light over that of all terms (%)",
        of_classical: f64 = "RMS over that of the map at its place",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const SCALED: &str = "five, scaled";
const PRINTED: &str = "five, as printed";
const ALL: &str = "all";
const CLASSICAL: &str = "all, at the map's place";
/// Texels along a face's side of the map at its place.
const CLASSICAL_SIDE: u32 = 32;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "five scaled terms keep the energy: bias (%)",
        Bound::Between(-10.0, 10.0),
        |row: &Row| row.bias.into(),
    )
    .among(|row| row.terms == SCALED && row.exponent == 10.0 && row.side == 4),
    Criterion::each(
        "as printed, energy is lost: bias (%)",
        Bound::AtMost(-10.0),
        |row: &Row| row.bias.into(),
    )
    .among(|row| row.terms == PRINTED && row.exponent == 10.0 && row.side == 4)
    .because("more than scaled terms may be off"),
    Criterion::each(
        "8² texels are ahead of the map at its place, exponent 10: RMS over its",
        Bound::AtMost(1.0),
        |row: &Row| row.of_classical.into(),
    )
    .among(|row| row.terms == ALL && row.exponent == 10.0 && row.side == 8),
];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let room = LitRoom::PUBLISHED;
        let (count, directions) = context.pick((POINTS, DIRECTIONS), (20, 24));
        let all: Vec<(DVec3, f32)> = PLACES
            .into_iter()
            .flat_map(|place| EXPONENTS.map(|exponent| (place, exponent)))
            .collect();
        let cases = context.pick(all, vec![(PLACES[0], 10.0)]);
        let sides = context.pick(&[2, 4, 8][..], &[4, 8]);
        let lights = sides
            .iter()
            .map(|side| Ok((*side, room.printed_lights(*side, SolidAngleForm::Disc)?)));
        let lights: Vec<_> = lights.collect::<Result<_>>()?;
        let still = room.printed_lights(CLASSICAL_SIDE, SolidAngleForm::Disc)?;
        let name = |(place, exponent): &(DVec3, f32)| format!("{place}, exponent {exponent}");
        context.each(&cases, name, |(place, exponent)| {
            let points = LitRoom::points(*place, count);
            let exact = room.glossy(&points, f64::from(*exponent), directions);
            let values = |lights: &GatherLights, terms: Terms, points: &[GatherPoint]| -> Result<Vec<f64>> {
                let settings = GatherSettings {
                    terms,
                    ..GatherSettings::default()
                };
                let found = Gather::new(&gpu, lights, &settings, *exponent)?.gather(points)?;
                Ok(found.into_iter().map(|value| value.x).collect())
            };
            let at_the_maps_place = |point: &GatherPoint| GatherPoint {
                position: DVec3::ZERO,
                ..*point
            };
            let moved: Vec<GatherPoint> = points.iter().map(at_the_maps_place).collect();
            let classical = values(&still, Terms::All, &moved)?;
            let [rms_of_classical, _] = relative_errors(&classical, &exact);
            let row = |side: u32, terms: &str, found: &[f64], of_all: Option<f64>| {
                let [rms, bias] = relative_errors(found, &exact);
                Row {
                    place: place.to_string(),
                    exponent: f64::from(*exponent),
                    side: side.into(),
                    terms: terms.into(),
                    rms,
                    bias,
                    of_all,
                    of_classical: rms / rms_of_classical,
                }
            };
            let mut rows = vec![row(CLASSICAL_SIDE, CLASSICAL, &classical, None)];
            for (side, lights) in &lights {
                let all = values(lights, Terms::All, &points)?;
                let whole: f64 = all.iter().sum();
                rows.push(row(*side, ALL, &all, Some(100.0)));
                for (terms, name) in [(Terms::Five, SCALED), (Terms::FiveUnscaled, PRINTED)] {
                    let found = values(lights, terms, &points)?;
                    let part = found.iter().sum::<f64>() / whole;
                    rows.push(row(*side, name, &found, Some(100.0 * part)));
                }
            }
            Ok(rows)
        })
    }

    fn findings(&self) -> Findings {
        let five = self.iter().find(|row| {
            row.place == PLACES[0].to_string() && row.terms == SCALED && row.exponent == 10.0 && row.side == 4
        });
        Findings::of(self, CRITERIA)
            .headline(
                "bias of five scaled terms in the middle of the room, exponent 10, 4² texels a face (%)",
                five.map(|row| Measured::exact(row.bias)),
            )
            .note(
                "Points lie on spheres of radius 0.15, whose normals are the lobes' axes; lobes are normalised, and lights are as printed. The five terms are those of the greatest \
                 reflectivity times solid angle; scaled ones are divided by their sum. What was published is of another lobe, the cosine of the normal with the half vector to an \
                 eye to the power of the exponent, and does not say where that eye is: no published figure is judged here.",
            )
    }
}
