//! Guesses of secants and of brackets, step by step: along a ray that one plane answers, along one in surroundings that narrow to a neck, and along one in a
//! corner; and of all rays of a sphere in the corner, how many are off for good.
//!
//! Oracle: the exact distance. Source of the two pictures that this follows: L. Szirmay-Kalos et al., "Approximate Ray-Tracing on the GPU with
//! Distance Impostors", CGF 24(3), 2005.

use clerestory::Result;
use clerestory::maps::impostor::room::ShinySphere;
use clerestory::maps::impostor::{ImpostorRay, ImpostorScene, ImpostorSettings, SearchMethod, impostor_search};
use glam::DVec3;

use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Study, curves, rows};
use crate::experiments::measures::Context;

const STEPS: u32 = 10;
/// Pixels along a side of the view whose rays are counted, and of the one that the ray in the corner is of.
const SIDE: u32 = 220;
const COARSE: u32 = 24;
/// An error by which a guess is off, half widths of the room.
const OFF: f64 = 0.1;

rows! {
    /// A guess.
    struct Row = "Guesses" by [ray, method, step] {
        ray: String = "ray",
        method: String = "method",
        step: u64 = "steps",
        distance: f64 = "guess",
        exact: f64 = "exact",
        error: f64 = "error of the guess",
    }
}
rows! {
    /// A method over all rays of a sphere.
    struct Share = "Rays of a sphere in a corner after ten steps" by [method] {
        method: String = "method",
        off: f64 = "rays that are off by 0.1 or more (%)",
        published: Option<f64> = "published share (%)",
        worst: f64 = "largest error",
    }
}
/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    guesses: Vec<Row>,
    shares: Vec<Share>,
}

const WALL: &str = "one wall";
const NECK: &str = "neck";
const CORNER: &str = "corner";
/// Share of rays for which the secant from x was published never to arrive, %.
const PUBLISHED: f64 = 15.0;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "one plane is met after a step: error",
        Bound::AtMost(1e-9),
        |row: &Row| row.error.into(),
    )
    .among(|row| row.ray == WALL && row.step >= 1)
    .in_every_form(),
    Criterion::each(
        "brackets come near where surroundings narrow to a neck: error",
        Bound::AtMost(1e-2),
        |row: &Row| row.error.into(),
    )
    .among(|row| {
        row.ray == NECK && row.step == u64::from(STEPS) && row.method == SearchMethod::FalsePosition.to_string()
    })
    .in_every_form(),
];

const OF_SHARES: &[Criterion<Share>] = &[
    Criterion::each(
        "in a corner the secant from x goes back to its start and stays there for as many rays as published: share (%)",
        Bound::Between(0.8 * PUBLISHED, 1.2 * PUBLISHED),
        |row: &Share| row.off.into(),
    )
    .among(|row| row.method == SearchMethod::SecantFromPoint.to_string())
    .because("15 %, within a fifth")
    .in_every_form(),
    Criterion::each(
        "brackets arrive for all: the largest error of false position",
        Bound::AtMost(OFF),
        |row: &Share| row.worst.into(),
    )
    .among(|row| row.method == SearchMethod::FalsePosition.to_string())
    .because("a tenth of the room's half width")
    .in_every_form(),
];

const METHODS: [SearchMethod; 4] = [
    SearchMethod::SecantFromPoint,
    SearchMethod::SecantFromGuess,
    SearchMethod::FalsePosition,
    SearchMethod::Mixed,
];

/// Guesses of all methods along a ray.
fn guesses<F: Fn(u32, DVec3) -> f64>(name: &str, scene: &ImpostorScene<F>, ray: &ImpostorRay, exact: f64) -> Vec<Row> {
    let mut rows = Vec::new();
    for method in METHODS {
        for steps in 0..=STEPS {
            let hit = impostor_search(scene, ray, &ImpostorSettings::of(method, steps));
            rows.push(Row {
                ray: name.into(),
                method: method.to_string(),
                step: steps.into(),
                distance: hit.distance,
                exact,
                error: (hit.distance - exact).abs(),
            });
        }
    }
    rows
}

/// Of all rays of a sphere.
fn share(method: SearchMethod, rays: &[ImpostorRay], off: impl Fn(&ImpostorRay, SearchMethod) -> f64) -> Share {
    let errors: Vec<f64> = rays.iter().map(|ray| off(ray, method)).collect();
    let count = errors.iter().filter(|error| **error >= OFF).count();
    Share {
        method: method.to_string(),
        off: 100.0 * count as f64 / errors.len().max(1) as f64,
        published: (method == SearchMethod::SecantFromPoint).then_some(PUBLISHED),
        worst: errors.into_iter().fold(0.0, f64::max),
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let wall = ImpostorScene {
            distance: |_: u32, v: DVec3| 1.0 / v.x.max(1e-6),
            layers: 1,
            extent: [1.0, 20.0],
        };
        let ray = ImpostorRay {
            origin: DVec3::new(0.3, 0.2, 0.1),
            direction: DVec3::new(0.8, 0.0, 0.6),
        };
        let mut guessed = guesses(WALL, &wall, &ray, 0.7 / 0.8);
        // A long room, whose ratio rises late and steeply along the ray.
        let neck = ImpostorScene {
            distance: |_: u32, v: DVec3| 1.0 + 4.0 * v.x.max(0.0).powi(12),
            layers: 1,
            extent: [1.0, 5.0],
        };
        let ray = ImpostorRay {
            origin: DVec3::new(-0.6, -0.4, 0.0),
            direction: DVec3::new(0.9, 0.435_889_894_354_067_4, 0.0),
        };
        let ratio = |d: f64| {
            let l = ray.origin + d * ray.direction;
            l.length() / (neck.distance)(0, l.normalize())
        };
        let (mut low, mut high) = (0.0, 8.0);
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if ratio(middle) < 1.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        guessed.extend(guesses(NECK, &neck, &ray, 0.5 * (low + high)));
        let sphere = ShinySphere::C;
        let corner = ImpostorScene {
            distance: |_: u32, v: DVec3| 1.0 / v.abs().max_element(),
            layers: 1,
            extent: [1.0, 3f64.sqrt()],
        };
        let off = |ray: &ImpostorRay, method: SearchMethod| {
            let hit = impostor_search(&corner, ray, &ImpostorSettings::of(method, STEPS));
            (hit.distance - sphere.room.hit(ray.origin, ray.direction)).abs()
        };
        // The ray for which the secant from x is farthest off.
        let of_secant = |ray: &ImpostorRay| off(ray, SearchMethod::SecantFromPoint);
        let coarse = sphere.rays(COARSE, None);
        if let Some(ray) = coarse.iter().max_by(|a, b| of_secant(a).total_cmp(&of_secant(b))) {
            let exact = sphere.room.hit(ray.origin, ray.direction);
            guessed.extend(guesses(CORNER, &corner, ray, exact));
        }
        let rays = sphere.rays(context.pick(SIDE, COARSE), None);
        Ok(Self {
            guesses: guessed,
            shares: METHODS.map(|method| share(method, &rays, off)).into(),
        })
    }

    fn findings(&self) -> Findings {
        let secant = SearchMethod::SecantFromPoint.to_string();
        let stays = self.shares.iter().find(|row| row.method == secant);
        let drawn: Vec<Row> = self.guesses.iter().filter(|row| row.ray == CORNER).cloned().collect();
        Findings::of(&self.guesses, CRITERIA)
            .headline(
                "rays in a corner for which the secant from x never arrives (%)",
                stays.map(|row| row.off.into()),
            )
            .note(
                "A guess of no steps is the one from the point at infinity. Lengths are in half widths of the room. The ray in the corner is the one for which the secant \
                 from x is farthest off: its step leads behind the point where it began, at which it is held, and from there both guesses are the same.",
            )
            .and(Findings::of(&self.shares, OF_SHARES))
            .note("Of the sphere C, whose view has 220² pixels.")
            .curves(
                "corner",
                "Errors of guesses along a ray in a corner",
                Axes::rates("steps and one", "error of the guess"),
                curves(
                    &drawn,
                    |row| row.method.clone(),
                    |row| (row.step as f64 + 1.0, row.error.max(1e-9).into()),
                ),
            )
    }
}
