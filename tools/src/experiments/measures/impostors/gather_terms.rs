//! Five terms of a glossy gather beside all of them, and beside the map at its place: what is lost, what scaling gives back, and the time of each.
//!
//! Oracle: sums over directions of what is seen in them from the points.

use clerestory::Result;
use clerestory::film::png::Rgb8;
use clerestory::gpu::Gpu;
use clerestory::maps::Parametrization;
use clerestory::maps::gather::lit_room::{LitRoom, relative_errors};
use clerestory::maps::gather::{Gather, GatherLights, GatherPoint, GatherSettings, SolidAngleForm, Terms};
use clerestory::maps::impostor::layouts::{ImpostorLayout, ImpostorLayouts};
use clerestory::maps::impostor::room::BoxRoom;
use clerestory::maps::impostor::{ImpostorImage, ImpostorRay, ImpostorSettings, SearchMethod};
use glam::{DVec3, UVec2};

use super::gather_glossy::{CLASSICAL_SIDE, FROM, TILE, at_the_maps_place};
use super::lit_spheres::{Lit, seen_in_lobes, sheet_of};
use super::published_lobe;
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, rows};
use crate::experiments::measures::Context;

const POINTS: u32 = 400;
/// Points of a sphere that are timed, and the exponent.
const TIMED_POINTS: u32 = 1 << 17;
const TIMED_EXPONENT: f32 = 10.0;
const TURNS: usize = 7;
const EXPONENTS: [f32; 3] = [5.0, 10.0, 50.0];
const PICTURE: &str = "terms.png";
/// Gathers that the picture shows: texels along a face's side, and terms.
const SHOWN: [(u32, Terms); 3] = [(4, Terms::Five), (4, Terms::All), (8, Terms::All)];
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
rows! {
    /// A gather, or a look-up.
    struct Time = "Time of glossy light by its terms" by [side, terms] {
        side: u64 = "texels along a face's side",
        terms: String = "terms",
        point: Repeats = "time of a point (ns)",
        over_all: Option<Repeats> = "time over that of all terms",
        over_finer: Option<Repeats> = "time over that of all terms of twice as many along a side",
    }
    beside "source: frames/s" = |row| published(row).into();
}
/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    errors: Vec<Row>,
    published: Vec<published_lobe::Row>,
    #[serde(default)]
    few: Vec<published_lobe::Few>,
    times: Vec<Time>,
}

const SCALED: &str = "five, scaled";
const PRINTED: &str = "five, as printed";
const ALL: &str = "all";
const CLASSICAL: &str = "all, at the map's place";
const LOOK_UP: &str = "one look-up of a convolved map";

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

const OF_TIMES: &[Criterion<Time>] = &[
    Criterion::each(
        "five of 4² texels cost no more than all of them: time over theirs",
        Bound::AtMost(1.0),
        |row: &Time| of(row.over_all.as_ref()),
    )
    .among(|row| row.terms == SCALED && row.side == 4),
    Criterion::each(
        "five of 4² texels cost less than all of 8²: time over theirs",
        Bound::AtMost(1.0),
        |row: &Time| of(row.over_finer.as_ref()),
    )
    .among(|row| row.terms == SCALED && row.side == 4),
    Criterion::each(
        "all of 4² texels cost less than all of 8²: time over theirs",
        Bound::AtMost(1.0),
        |row: &Time| of(row.over_finer.as_ref()),
    )
    .among(|row| row.terms == ALL && row.side == 4),
];

/// A ratio of times that a row has.
fn of(ratio: Option<&Repeats>) -> Measured {
    ratio.map_or(Measured::exact(f64::NAN), Repeats::measured)
}

/// Frames per second of one skull in the source, in its text; its caption has 90 for five terms.
fn published(row: &Time) -> Option<f64> {
    match (row.terms.as_str(), row.side) {
        (LOOK_UP, _) => Some(340.0),
        (SCALED, 4) => Some(264.0),
        (ALL, 4) => Some(22.0),
        (ALL, 8) => Some(6.0),
        _ => None,
    }
}

/// Glossy light of points on the device by terms of an exponent.
fn gathered(
    gpu: &Gpu,
    lights: &GatherLights,
    (terms, exponent): (Terms, f32),
    points: &[GatherPoint],
) -> Result<Vec<f64>> {
    let settings = GatherSettings {
        terms,
        ..GatherSettings::default()
    };
    let found = Gather::new(gpu, lights, &settings, exponent)?.gather(points)?;
    Ok(found.into_iter().map(|value| value.x).collect())
}

/// Glossy spheres at places: the oracle, the map at its place, five of 4² texels a face, all of them, and all of 8².
fn picture(
    gpu: &Gpu,
    room: &LitRoom,
    places: &[DVec3],
    (still, lights): (&GatherLights, &[(u32, GatherLights)]),
    (side, directions): (u32, u32),
) -> Result<Rgb8> {
    let exponent = TIMED_EXPONENT;
    let views: Vec<_> = places.iter().map(|place| seen_in_lobes(*place, FROM, side)).collect();
    let mut ways: Vec<Lit<'_>> = vec![
        Box::new(move |points: &[GatherPoint]| Ok(room.glossy(points, f64::from(exponent), directions))),
        Box::new(move |points: &[GatherPoint]| {
            gathered(gpu, still, (Terms::All, exponent), &at_the_maps_place(points))
        }),
    ];
    for (shown, terms) in SHOWN {
        let Some((_, lights)) = lights.iter().find(|(side, _)| *side == shown) else {
            continue;
        };
        ways.push(Box::new(move |points: &[GatherPoint]| {
            gathered(gpu, lights, (terms, exponent), points)
        }));
    }
    sheet_of(&views, &ways, side)
}

/// Times of gathers near the patch by lights of some texels a side, and of a look-up in their place.
fn times(context: &Context<'_>, gpu: &Gpu, lights: &[(u32, GatherLights)]) -> Result<Vec<Time>> {
    let points = LitRoom::points(PLACES[1], context.pick(TIMED_POINTS, 64));
    let (map, size) = (Parametrization::Cube, UVec2::splat(CLASSICAL_SIDE));
    let (radiance, _) = LitRoom::PUBLISHED.maps(map, CLASSICAL_SIDE)?;
    let image = ImpostorImage::from_fn(map, size, 1, false, |d| BoxRoom::EMPTY.surfaces(d))?;
    let layouts = ImpostorLayouts::new(gpu, &radiance, &image)?;
    let look_up = layouts.look_up(&ImpostorSettings::of(SearchMethod::Classical, 0), ImpostorLayout::Split)?;
    let rays: Vec<ImpostorRay> = points
        .iter()
        .map(|point| ImpostorRay {
            origin: point.position,
            direction: point.axis,
        })
        .collect();
    let mut gathers = Vec::new();
    for (side, lights) in lights {
        for (terms, name) in [(Terms::All, ALL), (Terms::Five, SCALED)] {
            let settings = GatherSettings {
                terms,
                ..GatherSettings::default()
            };
            gathers.push((*side, name, Gather::new(gpu, lights, &settings, TIMED_EXPONENT)?));
        }
    }
    let times = context.in_turns(TURNS, 1 + gathers.len(), |i| {
        let seconds = match i.checked_sub(1).map(|i| &gathers[i]) {
            Some((.., gather)) => gather.gather_timed(&points)?.1,
            None => look_up.look_up_timed(&rays)?.1,
        };
        Ok(1e9 * seconds / points.len().max(1) as f64)
    })?;
    let mut times = times.into_iter().map(Repeats);
    let mut rows: Vec<Time> = times
        .next()
        .map(|point| Time {
            side: CLASSICAL_SIDE.into(),
            terms: LOOK_UP.into(),
            point,
            ..Time::default()
        })
        .into_iter()
        .collect();
    let timed: Vec<(u32, &str, Repeats)> = gathers
        .iter()
        .zip(times)
        .map(|((side, name, _), time)| (*side, *name, time))
        .collect();
    for (side, name, time) in &timed {
        let over = |of_side: u32| {
            let all = timed.iter().find(|(side, name, _)| *side == of_side && *name == ALL)?;
            Some(time.over(&all.2))
        };
        rows.push(Time {
            side: u64::from(*side),
            terms: (*name).into(),
            point: time.clone(),
            over_all: over(*side),
            over_finer: over(2 * side),
        });
    }
    Ok(rows)
}

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
        let places = context.first(&PLACES, 1);
        let shown = picture(&gpu, &room, places, (&still, &lights), context.pick(TILE, (6, 8)))?;
        context.picture(PICTURE, &shown);
        let name = |(place, exponent): &(DVec3, f32)| format!("{place}, exponent {exponent}");
        let errors = context.each(&cases, name, |(place, exponent)| {
            let points = LitRoom::points(*place, count);
            let exact = room.glossy(&points, f64::from(*exponent), directions);
            let values = |lights: &GatherLights, terms: Terms, points: &[GatherPoint]| {
                gathered(&gpu, lights, (terms, *exponent), points)
            };
            let classical = values(&still, Terms::All, &at_the_maps_place(&points))?;
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
        })?;
        Ok(Self {
            errors,
            published: published_lobe::measure(context, &room)?,
            few: published_lobe::measure_few(context, &room)?,
            times: times(context, &gpu, &lights)?,
        })
    }

    fn findings(&self) -> Findings {
        let five = self.errors.iter().find(|row| {
            row.place == PLACES[0].to_string() && row.terms == SCALED && row.exponent == 10.0 && row.side == 4
        });
        let findings = Findings::of(&self.errors, CRITERIA)
            .headline(
                "bias of five scaled terms in the middle of the room, exponent 10, 4² texels a face (%)",
                five.map(|row| Measured::exact(row.bias)),
            )
            .note(
                "Points lie on spheres of radius 0.15, whose normals are the lobes' axes; lobes are normalised, and lights are as printed. The five terms are those of the greatest \
                 reflectivity times solid angle; scaled ones are divided by their sum. What was published is of another lobe, and stands in tables of its own.",
            );
        let findings = if self.few.is_empty() {
            findings
        } else {
            findings.picture(
                PICTURE,
                "Glossy spheres of exponent 10 in the middle and near the patch; from the left sums over directions, the map at its place, five of 4² texels a face, all of them, and all of 8²",
            )
        };
        findings
            .and(Findings::of(&self.published, published_lobe::CRITERIA))
            .note(
                "The published lobe is the cosine of the normal with the half vector to an eye, to the power of the exponent, without a norm. Nothing says where that eye is: it is put at (−0.8, 0.1, −0.7), that of \
                 the published rays to mirror spheres, and points are those that face it. Figures of exponents 5 and 10 are met \
                 from there within about a tenth; those of exponent 50 rest on few points, and differ by up to a third.",
            )
            .and(Findings::of(&self.few, published_lobe::OF_FEW))
            .note(
                "Five terms by the same lobe are those of the greatest reflectivity times solid angle, as they are, and scaled to the sum of all weights. Biases were published for 4² texels and exponent 10, \
                 RMS errors of scaled terms for the middle of the room.",
            )
            .and(Findings::of(&self.times, OF_TIMES))
            .note(
                "2¹⁷ points of the sphere near the patch, exponent 10, reflectivities at the lights' middles; time of the device, of kernels that an untimed turn has compiled. Five terms are found by evaluating all, so \
                 that they cost what all do and their order on top; the source says neither how it finds its five nor why its text has 264 frames a second and its caption 90. A look-up is that of the nearest texel \
                 of a map that is convolved before. The source's frames are those of one skull, 700² pixels on a GPU of 2004.",
            )
    }
}
