//! The light of a room on spheres that move through it: the map at its place beside localised gathers of few and of many texels, by the lights'
//! middles and by means over their cones.
//!
//! Oracle: Lambert's closed form for the room's walls.

use clerestory::Result;
use clerestory::film::png::Rgb8;
use clerestory::gpu::Gpu;
use clerestory::maps::Parametrization;
use clerestory::maps::gather::lit_room::{LitRoom, relative_errors};
use clerestory::maps::gather::{GatherLights, GatherPoint, GatherSettings, SolidAngleForm};
use clerestory::maps::irradiance::IrradianceSource;
use glam::DVec3;

use super::gather_table::irradiances;
use super::lit_spheres::{Lit, seen, sheet_of};
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Measured, Study, curves, rows};
use crate::experiments::measures::Context;

const POINTS: u32 = 400;
/// Steps from the middle to the wall.
const STEPS: u32 = 8;
/// How near the wall the sphere comes: it nearly touches it.
const LAST: f64 = 0.84;
/// Beyond it nothing is asked of ways beside the map at its place: the last place is a hundredth from the wall, a twelfth of a texel of 16².
const NEAR: f64 = 0.8;

/// Pixels along a side of a tile.
const TILE: u32 = 96;
const AT_THE_WALL: &str = "at-the-wall.png";
const ON_THE_WAY: &str = "on-the-way.png";
/// From where the sphere at the wall is seen: from the room, along the wall, and through it.
const VIEWS: [DVec3; 3] = [
    DVec3::new(-1.0, 0.3, 0.4),
    DVec3::new(0.1, 0.3, 1.0),
    DVec3::new(1.0, 0.3, 0.4),
];
/// Shares of the way that are shown, and texels along a face's side.
const SHOWN: [f64; 3] = [0.0, 0.5, 1.0];
const SIDES: [u32; 4] = [2, 4, 8, 16];

rows! {
    /// A way at a place.
    struct Row = "Irradiance of a sphere on its way to a wall" by [moved, way] {
        moved: f64 = "moved by (half widths)",
        way: String = "way",
        rms: f64 = "RMS (%)",
        bias: f64 = "bias (%)",
        of_classical: f64 = "RMS over that of the map at its place",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CLASSICAL: &str = "the map at its place";

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "away from the wall 2² texels are ahead of the map at its place: RMS over its",
        Bound::AtMost(1.0),
        |row: &Row| row.of_classical.into(),
    )
    .among(|row| row.moved < NEAR && row.way == way(2, SolidAngleForm::Disc, false)),
    Criterion::each(
        "away from the wall 16² texels with normals are far ahead: RMS over that of the map at its place",
        Bound::AtMost(0.25),
        |row: &Row| row.of_classical.into(),
    )
    .among(|row| row.moved < NEAR && row.way == way(16, SolidAngleForm::DiscWithNormals, true)),
    Criterion::all(
        "next to a wall means over cones are ahead of middles, 4² texels: RMS over theirs",
        Bound::AtMost(1.0),
        |rows: &[&Row]| {
            let at = |way: &str| rows.iter().rev().find(|row| row.way == way).map(|row| row.rms);
            let [cones, middles] = [true, false].map(|cones| at(&way(4, SolidAngleForm::Disc, cones)));
            Some(Measured::exact(cones? / middles?))
        },
    ),
];

fn way(side: u32, form: SolidAngleForm, cones: bool) -> String {
    let form = match form {
        SolidAngleForm::Ratio => "ratio",
        SolidAngleForm::Disc => "disc",
        SolidAngleForm::DiscWithNormals => "disc with normals",
    };
    format!(
        "{side}² texels, {form}, {}",
        if cones { "means over cones" } else { "middles" }
    )
}

/// The oracle.
fn exact(room: &LitRoom) -> Lit<'_> {
    Box::new(move |points: &[GatherPoint]| Ok(points.iter().map(|point| room.irradiance(point)).collect()))
}

/// A gather on the device.
fn gathered<'a>(gpu: &'a Gpu, lights: &'a GatherLights, cones: bool) -> Lit<'a> {
    let settings = GatherSettings {
        cones,
        ..GatherSettings::default()
    };
    Box::new(move |points: &[GatherPoint]| irradiances(gpu, lights, &settings, points))
}

/// The sphere next to the wall from all views: the oracle, and 4² texels by middles and by means over cones.
fn at_the_wall(gpu: &Gpu, room: &LitRoom, side: u32) -> Result<Rgb8> {
    let views = VIEWS.map(|from| seen(LAST * DVec3::X, from, side));
    let lights = room.lights(4, SolidAngleForm::Disc)?;
    let ways = [exact(room), gathered(gpu, &lights, false), gathered(gpu, &lights, true)];
    sheet_of(&views, &ways, side)
}

/// The sphere at places of its way, along the wall: the oracle, the map at its place, and gathers of more and more texels.
fn on_the_way(gpu: &Gpu, room: &LitRoom, source: &IrradianceSource, sides: &[u32], tile: u32) -> Result<Rgb8> {
    let views = SHOWN.map(|share| seen(share * LAST * DVec3::X, VIEWS[1], tile));
    let mut lights = Vec::new();
    for side in sides {
        lights.push(room.lights(*side, SolidAngleForm::DiscWithNormals)?);
    }
    let still = |point: &GatherPoint| source.irradiance(point.axis).unwrap_or_default().x;
    let at_its_place: Lit<'_> = Box::new(|points: &[GatherPoint]| Ok(points.iter().map(still).collect()));
    let mut ways = vec![exact(room), at_its_place];
    ways.extend(lights.iter().map(|lights| gathered(gpu, lights, true)));
    sheet_of(&views, &ways, tile)
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let room = LitRoom::PUBLISHED;
        let (count, steps) = context.pick((POINTS, STEPS), (20, 1));
        let (radiance, _) = room.maps(Parametrization::Cube, 64)?;
        let source = IrradianceSource::new(&radiance);
        let tile = context.pick(TILE, 6);
        context.picture(AT_THE_WALL, &at_the_wall(&gpu, &room, tile)?);
        let on_the_way = on_the_way(&gpu, &room, &source, context.first(&SIDES, 1), tile)?;
        context.picture(ON_THE_WAY, &on_the_way);
        let mut ways = Vec::new();
        for (side, form, cones) in [
            (2, SolidAngleForm::Disc, false),
            (2, SolidAngleForm::Disc, true),
            (4, SolidAngleForm::Disc, false),
            (4, SolidAngleForm::Disc, true),
            (16, SolidAngleForm::Disc, true),
            (16, SolidAngleForm::DiscWithNormals, true),
        ] {
            let settings = GatherSettings {
                cones,
                ..GatherSettings::default()
            };
            ways.push((way(side, form, cones), room.lights(side, form)?, settings));
        }
        let moves: Vec<f64> = (0..=steps).map(|i| LAST * f64::from(i) / f64::from(steps)).collect();
        context.each(
            &moves,
            |moved| format!("{moved:.2}"),
            |moved| {
                let points = LitRoom::points(*moved * DVec3::X, count);
                let exact: Vec<f64> = points.iter().map(|point| room.irradiance(point)).collect();
                let still: Vec<f64> = points
                    .iter()
                    .map(|point| source.irradiance(point.axis).unwrap_or_default().x)
                    .collect();
                let [classical, _] = relative_errors(&still, &exact);
                let row = |way: &str, found: &[f64]| {
                    let [rms, bias] = relative_errors(found, &exact);
                    Row {
                        moved: *moved,
                        way: way.into(),
                        rms,
                        bias,
                        of_classical: rms / classical,
                    }
                };
                let mut rows = vec![row(CLASSICAL, &still)];
                for (name, lights, settings) in &ways {
                    rows.push(row(name, &irradiances(&gpu, lights, settings, &points)?));
                }
                Ok(rows)
            },
        )
    }

    fn findings(&self) -> Findings {
        let far = way(16, SolidAngleForm::DiscWithNormals, true);
        let worst = self.iter().filter(|row| row.moved < NEAR && row.way == far);
        let findings = Findings::of(self, CRITERIA)
            .headline(
                "largest RMS of 16² texels with normals over that of the map at its place, away from the wall",
                worst.map(|row| row.of_classical).reduce(f64::max).map(Measured::exact),
            )
            .note(
                "A sphere of radius 0.15 goes from the middle of the room [−1, 1]³, where its map was made, along +x until it is a hundredth from the wall. That last \
                 place is left out of what is asked of 2² and of 16² texels: with a gap of a twelfth of a texel of 16² neither is ahead of the map at its place.",
            )
            .curves(
                "errors",
                "Errors of irradiance on the way to a wall",
                Axes::even("moved by (half widths)", "RMS (%)", 60.0, (4, 0.25)),
                curves(self, |row| row.way.clone(), |row| (row.moved, row.rms.into())),
            );
        if self.is_empty() {
            return findings;
        }
        findings
            .picture(
                AT_THE_WALL,
                "The sphere a hundredth from the wall, seen from the room, along the wall and through it; from the left the exact irradiance, and 4² texels a face by lights' middles and by means over their cones",
            )
            .picture(
                ON_THE_WAY,
                "The sphere in the middle, half-way and at the wall; from the left the exact irradiance, the map at its place, and 2², 4², 8² and 16² texels a face with normals, by means over cones",
            )
    }
}
