//! Five terms of a glossy gather beside all of them: what is lost, and what scaling gives back.
//!
//! Oracle: all terms of 64² texels a face with normals.

use clerestory::Result;
use clerestory::maps::gather::lit_room::{LitRoom, relative_errors};
use clerestory::maps::gather::{Gather, GatherSettings, SolidAngleForm, Terms, gathered};

use glam::DVec3;

use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Study, rows};
use crate::experiments::measures::Context;

const POINTS: u32 = 400;
const EXPONENTS: [f32; 3] = [5.0, 10.0, 50.0];

rows! {
    /// A gather.
    struct Row = "Errors of glossy light in the middle of the room" by [exponent, side, terms] {
        exponent: f64 = "exponent",
        side: u64 = "texels along a face's side",
        terms: String = "terms",
        rms: f64 = "RMS (%)",
        published_rms: Option<f64> = "published RMS (%)",
        bias: f64 = "bias (%)",
        of_all: f64 = "light over that of all terms (%)",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const SCALED: &str = "five, scaled";
const PRINTED: &str = "five, as printed";
const ALL: &str = "all";

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "five scaled terms keep the energy: bias (%)",
        Bound::Between(-10.0, 10.0),
        |row: &Row| row.bias.into(),
    )
    .among(|row| row.terms == SCALED && row.exponent == 10.0 && row.side == 4),
    Criterion::each(
        "RMS errors of all terms are the published ones: relative difference (%)",
        Bound::AtMost(20.0),
        |row: &Row| {
            row.published_rms
                .map_or(f64::NAN, |published| 100.0 * (row.rms - published).abs() / published)
                .into()
        },
    )
    .among(|row| row.terms == ALL && row.published_rms.is_some()),
    Criterion::each(
        "as printed, energy is lost: light over that of all terms (%)",
        Bound::AtMost(80.0),
        |row: &Row| row.of_all.into(),
    )
    .among(|row| row.terms == PRINTED && row.exponent == 10.0 && row.side == 4),
];

/// RMS that was published of all terms and of five, by exponent and texels.
fn published(exponent: f32, side: u32, terms: Terms) -> Option<f64> {
    let [all, five] = match (exponent, side) {
        (10.0, 4) => [11.5, 27.8],
        (10.0, 8) => [4.8, 58.8],
        (50.0, 4) => [77.4, 77.7],
        (50.0, 8) => [17.2, 21.5],
        _ => return None,
    };
    match terms {
        Terms::All => Some(all),
        Terms::Five => Some(five),
        Terms::FiveUnscaled => None,
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let room = LitRoom::PUBLISHED;
        let mut points = LitRoom::points(LitRoom::PLACES[0], context.pick(POINTS, 20));
        for point in &mut points {
            // Lobes in all directions, at the map's own place.
            point.position = DVec3::ZERO;
        }
        let finest = context.pick(64, 16);
        let of_oracle = GatherSettings {
            form: SolidAngleForm::DiscWithNormals,
            ..GatherSettings::default()
        };
        let fine = room.lights(finest, of_oracle.form)?;
        let mut cases = Vec::new();
        for exponent in EXPONENTS {
            cases.extend([2, 4, 8].map(|side| (exponent, side)));
        }
        let cases = context.pick(cases, vec![(10.0, 4)]);
        let name = |(exponent, side): &(f32, u32)| format!("exponent {exponent}, {side}² texels");
        context.each(&cases, name, |(exponent, side)| {
            let values = |gather: &Gather| -> Result<Vec<f64>> {
                Ok(gathered(&gpu, gather, &points)?
                    .into_iter()
                    .map(|value| value.x)
                    .collect())
            };
            let exact = values(&Gather::new(&gpu, &fine, &of_oracle, *exponent)?)?;
            let lights = room.printed_lights(*side, SolidAngleForm::Disc)?;
            let mut rows = Vec::new();
            let mut whole = 0.0;
            for (terms, name) in [(Terms::All, ALL), (Terms::Five, SCALED), (Terms::FiveUnscaled, PRINTED)] {
                let settings = GatherSettings {
                    terms,
                    ..GatherSettings::default()
                };
                let found = values(&Gather::new(&gpu, &lights, &settings, *exponent)?)?;
                let sum: f64 = found.iter().sum();
                if terms == Terms::All {
                    whole = sum;
                }
                let [rms, bias] = relative_errors(&found, &exact);
                rows.push(Row {
                    exponent: f64::from(*exponent),
                    side: u64::from(*side),
                    terms: name.into(),
                    rms,
                    published_rms: published(*exponent, *side, terms),
                    bias,
                    of_all: 100.0 * sum / whole,
                });
            }
            Ok(rows)
        })
    }

    fn findings(&self) -> Findings {
        let five = self
            .iter()
            .find(|row| row.terms == SCALED && row.exponent == 10.0 && row.side == 4);
        Findings::of(self, CRITERIA)
            .headline("bias of five scaled terms, exponent 10, 4² texels a face (%)", five.map(|row| Measured::exact(row.bias)))
            .note(
                "Lobes are normalised and about directions all over the sphere, at the map's place; lights are as printed. The five terms are those of the greatest reflectivity times solid \
                 angle; scaled ones are divided by their sum, which is 1 for all. Which five were taken for the published figures is not said.",
            )
    }
}
