//! A mirror sphere that moves while its map stays where it was: errors of look-ups over the way, into the corner of an empty room and beside a box.
//!
//! Oracle: exact rays. Distances are exact, too: what is off is the search, and what the map's place does not see. Pictures of such a sphere stand beside.

use clerestory::Result;
use clerestory::maps::impostor::room::{BoxRoom, ShinySphere};
use clerestory::maps::impostor::{ImpostorSettings, SearchMethod};
use glam::DVec3;

use super::exact_room::{errors, mean};
use super::moving_pictures::{self, Frame};
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Measured, Study, curves, largest, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::errors::greatest;

/// Pixels along a side of a view of the sphere.
const SIDE: u32 = 220;
/// Even steps of the way from the map's place to the corner.
const STEPS: u32 = 10;
/// Stages of the pictures that were published: the map alone, one step, one step and further ones.
const STAGES: [(SearchMethod, u32); 6] = [
    (SearchMethod::Classical, 0),
    (SearchMethod::SecantFromGuess, 0),
    (SearchMethod::FalsePosition, 1),
    (SearchMethod::FalsePosition, 3),
    (SearchMethod::FalsePosition, 8),
    (SearchMethod::Hybrid, 3),
];

rows! {
    /// A look-up at a place of the way.
    struct Row = "Errors of look-ups while the sphere moves away from its map's place" by [room, share, way] {
        room: String = "room",
        share: f64 = "share of the way",
        distance: f64 = "mean distance from the map's place to where rays begin",
        way: String = "look-up",
        mean: f64 = "mean error (°)",
        published: Option<f64> = "published mean (°)",
        good: f64 = "rays below 1° (%)",
        largest: f64 = "largest (°)",
    }
}
/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    look_ups: Vec<Row>,
    pictures: Vec<Frame>,
}

const EMPTY: &str = "empty";
const BOX: &str = "with a box";

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "both ends are as published: difference over a fifth of it",
        Bound::AtMost(1.0),
        |row: &Row| {
            let published = row.published.unwrap_or(f64::NAN);
            ((row.mean - published).abs() / (0.2 * published)).into()
        },
    )
    .among(|row| row.published.is_some()),
    Criterion::each(
        "three steps keep up with the sphere all the way: mean error (°)",
        Bound::AtMost(1.0),
        |row: &Row| row.mean.into(),
    )
    .among(|row| row.room == EMPTY && row.way.ends_with("+3"))
    .in_every_form(),
    Criterion::each(
        "the map alone is off at the end of the way: mean error (°)",
        Bound::AtLeast(9.0),
        |row: &Row| row.mean.into(),
    )
    .among(|row| row.is_of_map_alone() && row.share == 1.0)
    .because("a sphere about the map's place is off by 9.75° already"),
    Criterion::all(
        "the map alone errs the more the farther from its place rays begin: largest mean error over that of the next place away",
        Bound::AtMost(1.0),
        worst_over_farther,
    )
    .among(Row::is_of_map_alone)
    .because("the sine of a ray's error is its line's distance from the map's place over that of its hit; the side that is seen passes the place on the way"),
    Criterion::each(
        "what the box hides stays smeared after eight steps: rays below 1° (%)",
        Bound::AtMost(99.0),
        |row: &Row| row.good.into(),
    )
    .among(|row| row.room == BOX && row.way == way(SearchMethod::FalsePosition, 8) && row.share == 1.0)
    .because("2 % of the rays of a slightly smaller sphere meet what the map's place does not see"),
];

impl Row {
    /// Whether nothing but the map is looked up, in the room whose surfaces its place sees.
    fn is_of_map_alone(&self) -> bool {
        self.room == EMPTY && self.way == way(SearchMethod::Classical, 0)
    }
}

/// The largest mean error over that of the place whose rays begin next farther away; `None` of fewer than two places.
fn worst_over_farther(rows: &[&Row]) -> Option<Measured> {
    let mut rows = rows.to_vec();
    rows.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    let ratios = rows.windows(2).map(|pair| pair[0].mean / pair[1].mean);
    (rows.len() > 1).then(|| greatest(ratios).into())
}

fn way(method: SearchMethod, steps: u32) -> String {
    format!("{method} +{steps}")
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let side = context.pick(SIDE, 16);
        let steps = context.pick(STEPS, 2);
        let places: Vec<(BoxRoom, u32)> = [BoxRoom::EMPTY, BoxRoom::BOX]
            .into_iter()
            .flat_map(|room| (0..=steps).map(move |i| (room, i)))
            .collect();
        let name = |(room, i): &(BoxRoom, u32)| format!("{}, place {i}", name_of(*room));
        let look_ups = context.each(&places, name, |(room, i)| {
            let share = f64::from(*i) / f64::from(steps);
            let sphere = ShinySphere {
                room: *room,
                centre: share * end_of(*room),
                ..ShinySphere::A
            };
            let rays = sphere.rays(side, None);
            let begins: Vec<f64> = rays.iter().map(|ray| ray.origin.length()).collect();
            let distance = mean(&begins);
            let row = |(method, steps): (SearchMethod, u32)| {
                let found = errors(&sphere, &rays, &ImpostorSettings::of(method, steps));
                let is_published = room.obstacle.is_none() && method == SearchMethod::Classical;
                let published = (share == 0.0).then_some(9.75).or((share == 1.0).then_some(30.88));
                Row {
                    room: name_of(*room).into(),
                    share,
                    distance,
                    way: way(method, steps),
                    mean: mean(&found),
                    published: published.filter(|_| is_published),
                    good: 100.0 * found.iter().filter(|error| **error < 1.0).count() as f64 / found.len().max(1) as f64,
                    largest: found.iter().copied().fold(0.0, f64::max),
                }
            };
            Ok(STAGES.map(row).into())
        })?;
        let gpu = (context.gpu)()?;
        Ok(Self {
            look_ups,
            pictures: moving_pictures::moving(context, &gpu)?,
        })
    }

    fn findings(&self) -> Findings {
        let rows = &self.look_ups;
        let of_room = |room: &str| -> Vec<Row> { rows.iter().filter(|row| row.room == room).cloned().collect() };
        let axes = Axes::rates("share of the way, and a tenth", "mean error (°)");
        let at = |row: &Row| (row.share + 0.1, row.mean.max(1e-5).into());
        let is_three = |row: &Row| row.room == EMPTY && row.way == way(SearchMethod::FalsePosition, 3);
        Findings::of(rows, CRITERIA)
            .headline(
                "the largest mean error of three steps over the way (°)",
                largest(rows, is_three, |row| row.mean),
            )
            .note(
                "A sphere of radius 0.3 moves from the middle of a room of half width 1, where its map is seen from, to (0.55, −0.6, 0.55), and beside a box to (0.5, −0.2, −0.35); it is seen from one place, and in the empty room the side that is seen is nearest to the map's place after a fifth of the way. Published are the ends of the way in the empty \
                 room, and pictures of each look-up.",
            )
            .curves("empty", "Errors in an empty room", axes, curves(&of_room(EMPTY), |row| row.way.clone(), at))
            .curves("box", "Errors in a room with a box", axes, curves(&of_room(BOX), |row| row.way.clone(), at))
            .and(moving_pictures::findings(&self.pictures))
    }
}

/// Where the sphere comes to: a corner, or a place beside the box.
const fn end_of(room: BoxRoom) -> DVec3 {
    if room.obstacle.is_some() {
        ShinySphere::BOX.centre
    } else {
        ShinySphere::C.centre
    }
}

fn name_of(room: BoxRoom) -> &'static str {
    if room.obstacle.is_some() { BOX } else { EMPTY }
}
