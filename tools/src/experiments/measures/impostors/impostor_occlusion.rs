//! Searches where something stands before what rays meet: which rays each finds that another one misses, and the guesses along one of them.
//!
//! Oracle: exact rays in rooms with a box and with a pillar. Only rays count whose hit the map's place sees: the others no search of one layer finds.

use clerestory::Result;
use clerestory::maps::impostor::room::ShinySphere;
use clerestory::maps::impostor::{ImpostorRay, ImpostorSettings, SearchMethod};

use super::exact_room::{errors, found, mean};
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Study, curves, rows};
use crate::experiments::measures::Context;

/// Pixels along a side of a view of the sphere.
const SIDE: u32 = 220;
const STEPS: u32 = 10;
/// An error with which a ray is found, °.
const GOOD: f64 = 1.0;
const METHODS: [SearchMethod; 4] = [
    SearchMethod::SecantFromGuess,
    SearchMethod::FalsePosition,
    SearchMethod::Mixed,
    SearchMethod::Hybrid,
];

rows! {
    /// A search.
    struct Row = "Rays whose hit the map's place sees, after ten steps" by [sphere, method] {
        sphere: String = "sphere",
        method: String = "search",
        rays: u64 = "rays",
        good: f64 = "found, below 1° (%)",
        mean: f64 = "mean error (°)",
        largest: f64 = "largest (°)",
        ahead: u64 = "found, and missed by false position",
        behind: u64 = "missed, and found by false position",
    }
}

rows! {
    /// A guess.
    struct Guess = "Guesses along a ray to the edge of the box, which false position finds and mixed misses" by [method, step] {
        method: String = "search",
        step: u64 = "steps",
        distance: f64 = "guess",
        exact: f64 = "exact",
        error: f64 = "error (°)",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    rays: Vec<Row>,
    guesses: Vec<Guess>,
}

const OF_RAYS: &[Criterion<Row>] = &[
    Criterion::each(
        "false position finds more edges of the box than mixed does: rays that mixed misses over those that it alone finds",
        Bound::AtLeast(1.0),
        |row: &Row| (row.behind as f64 / row.ahead.max(1) as f64).into(),
    )
    .among(|row| row.sphere == ShinySphere::BOX.name && row.method == SearchMethod::Mixed.to_string()),
    Criterion::each(
        "secants keep outliers beside the box, the largest (°)",
        Bound::AtLeast(30.0),
        |row: &Row| row.largest.into(),
    )
    .among(|row| row.sphere == ShinySphere::BOX.name && row.method == SearchMethod::SecantFromGuess.to_string())
    .because("up to 119° were published"),
    Criterion::each(
        "false position does not: mean error (°)",
        Bound::AtMost(0.0504),
        |row: &Row| row.mean.into(),
    )
    .among(|row| row.sphere == ShinySphere::BOX.name && row.method == SearchMethod::FalsePosition.to_string())
    .because("0.042° was published, and a fifth"),
    Criterion::each(
        "where the sphere is hidden, brackets from its own points fail: mean error of false position (°)",
        Bound::AtLeast(50.0),
        |row: &Row| row.mean.into(),
    )
    .among(|row| row.sphere == ShinySphere::P2.name && row.method == SearchMethod::FalsePosition.to_string())
    .because("70° was published"),
    Criterion::each(
        "and the hybrid does not: mean error (°)",
        Bound::AtMost(2.52),
        |row: &Row| row.mean.into(),
    )
    .among(|row| row.sphere == ShinySphere::P2.name && row.method == SearchMethod::Hybrid.to_string())
    .because("2.1° was published, and a fifth"),
];
const OF_GUESSES: &[Criterion<Guess>] = &[
    Criterion::each(
        "the ray to the edge: error of false position after ten steps (°)",
        Bound::AtMost(GOOD),
        |row: &Guess| row.error.into(),
    )
    .among(|row| row.step == u64::from(STEPS) && row.method == SearchMethod::FalsePosition.to_string()),
    Criterion::each(
        "the ray to the edge: error of mixed after ten steps (°)",
        Bound::AtLeast(GOOD),
        |row: &Guess| row.error.into(),
    )
    .among(|row| row.step == u64::from(STEPS) && row.method == SearchMethod::Mixed.to_string()),
];

/// Rows of a sphere, and of its seen rays one that false position finds and mixed misses by most.
fn of_sphere(sphere: &ShinySphere, side: u32) -> (Vec<Row>, Option<ImpostorRay>) {
    let all = sphere.rays(side, None);
    let rays: Vec<ImpostorRay> = all.into_iter().filter(|ray| sphere.room.sees_hit(ray)).collect();
    let off = METHODS.map(|method| errors(sphere, &rays, &ImpostorSettings::of(method, STEPS)));
    let [_, bracket, mixed, _] = &off;
    let count = |of: &[f64], other: &[f64]| {
        let pairs = of.iter().zip(other);
        pairs.filter(|(of, other)| **of < GOOD && **other >= GOOD).count() as u64
    };
    let row = |(method, errors): (SearchMethod, &Vec<f64>)| Row {
        sphere: sphere.name.into(),
        method: method.to_string(),
        rays: rays.len() as u64,
        good: 100.0 * errors.iter().filter(|error| **error < GOOD).count() as f64 / rays.len().max(1) as f64,
        mean: mean(errors),
        largest: errors.iter().copied().fold(0.0, f64::max),
        ahead: count(errors, bracket),
        behind: count(bracket, errors),
    };
    let rows = METHODS.into_iter().zip(&off).map(row).collect();
    let missed = (0..rays.len()).filter(|i| bracket[*i] < GOOD && mixed[*i] >= GOOD);
    let worst = missed.max_by(|a, b| mixed[*a].total_cmp(&mixed[*b]));
    (rows, worst.map(|i| rays[i]))
}

fn guesses(sphere: &ShinySphere, ray: &ImpostorRay) -> Vec<Guess> {
    let exact = sphere.room.hit(ray.origin, ray.direction);
    let guess = |(method, steps): (SearchMethod, u32)| {
        let hit = found(sphere.room, ray, &ImpostorSettings::of(method, steps));
        Guess {
            method: method.to_string(),
            step: steps.into(),
            distance: hit.distance,
            exact,
            error: sphere.room.error(ray, hit.direction),
        }
    };
    let each = METHODS
        .into_iter()
        .flat_map(|method| (0..=STEPS).map(move |steps| (method, steps)));
    each.map(guess).collect()
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let side = context.pick(SIDE, 48);
        let spheres = [ShinySphere::BOX, ShinySphere::P1, ShinySphere::P2];
        let mut to_edge = Vec::new();
        let rays = context.each(
            &spheres,
            |sphere| sphere.name.into(),
            |sphere| {
                let (rows, ray) = of_sphere(sphere, side);
                if let Some(ray) = ray.filter(|_| sphere.name == ShinySphere::BOX.name) {
                    to_edge = guesses(sphere, &ray);
                }
                Ok(rows)
            },
        )?;
        Ok(Self { rays, guesses: to_edge })
    }

    fn findings(&self) -> Findings {
        let is_mixed =
            |row: &&Row| row.sphere == ShinySphere::BOX.name && row.method == SearchMethod::Mixed.to_string();
        let mixed = self.rays.iter().find(is_mixed);
        Findings::of(&self.rays, OF_RAYS)
            .headline(
                "rays beside the box that false position finds and mixed misses",
                mixed.map(|row| row.behind.into()),
            )
            .note("The box stands on the floor; the pillar reaches from floor to ceiling, beside the sphere P1 and before P2. Views have 220² pixels.")
            .and(Findings::of(&self.guesses, OF_GUESSES).note("Lengths are in half widths of the room; of the rays in question the one for which mixed is off by most."))
            .curves(
                "guesses",
                "Errors of guesses along the ray to the edge of the box",
                Axes::rates("steps and one", "error (°)"),
                curves(
                    &self.guesses,
                    |row| row.method.clone(),
                    |row| (row.step as f64 + 1.0, row.error.max(1e-6).into()),
                ),
            )
    }
}
