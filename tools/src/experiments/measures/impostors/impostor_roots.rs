//! Guesses of secants and of brackets, step by step: along a ray that one plane answers, on a curve on which the secant's steps grow, and along a
//! ray in a corner.
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
/// What was found.
pub type Found = Vec<Row>;

const WALL: &str = "one wall";
const DENT: &str = "hard curve";
const CORNER: &str = "corner";

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "one plane is met after a step: error",
        Bound::AtMost(1e-9),
        |row: &Row| row.error.into(),
    )
    .among(|row| row.ray == WALL && row.step >= 1)
    .in_every_form(),
    Criterion::each(
        "brackets come near on a hard curve: error",
        Bound::AtMost(1e-2),
        |row: &Row| row.error.into(),
    )
    .among(|row| {
        row.ray == DENT && row.step == u64::from(STEPS) && row.method == SearchMethod::FalsePosition.to_string()
    })
    .in_every_form(),
    Criterion::each(
        "the secant from x does not, in a corner: error",
        Bound::AtLeast(0.1),
        |row: &Row| row.error.into(),
    )
    .among(|row| {
        row.ray == CORNER && row.step == u64::from(STEPS) && row.method == SearchMethod::SecantFromPoint.to_string()
    })
    .because("a tenth of the room's half width")
    .in_every_form(),
    Criterion::each("brackets do: error", Bound::AtMost(1e-2), |row: &Row| row.error.into())
        .among(|row| {
            row.ray == CORNER && row.step == u64::from(STEPS) && row.method == SearchMethod::FalsePosition.to_string()
        })
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

/// The ray of a view for which the secant from x is farthest off.
fn worst_ray(sphere: &ShinySphere, of: impl Fn(&ImpostorRay) -> f64) -> Option<ImpostorRay> {
    let rays = sphere.rays(24, None);
    rays.into_iter().max_by(|a, b| of(a).total_cmp(&of(b)))
}

impl Study for Found {
    fn measure(_: &Context<'_>) -> Result<Self> {
        let wall = ImpostorScene {
            distance: |_: u32, v: DVec3| 1.0 / v.x.max(1e-6),
            layers: 1,
            extent: [1.0, 20.0],
        };
        let ray = ImpostorRay {
            origin: DVec3::new(0.3, 0.2, 0.1),
            direction: DVec3::new(0.8, 0.0, 0.6),
        };
        let mut rows = guesses(WALL, &wall, &ray, 0.7 / 0.8);
        // Surroundings whose ratio rises late and steeply along the ray: a long room that narrows to a neck.
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
        rows.extend(guesses(DENT, &neck, &ray, 0.5 * (low + high)));
        let sphere = ShinySphere::C;
        let corner = ImpostorScene {
            distance: |_: u32, v: DVec3| 1.0 / v.abs().max_element(),
            layers: 1,
            extent: [1.0, 3f64.sqrt()],
        };
        let off = |ray: &ImpostorRay| {
            let hit = impostor_search(
                &corner,
                ray,
                &ImpostorSettings::of(SearchMethod::SecantFromPoint, STEPS),
            );
            (hit.distance - sphere.room.hit(ray.origin, ray.direction)).abs()
        };
        if let Some(ray) = worst_ray(&sphere, off) {
            rows.extend(guesses(
                CORNER,
                &corner,
                &ray,
                sphere.room.hit(ray.origin, ray.direction),
            ));
        }
        Ok(rows)
    }

    fn findings(&self) -> Findings {
        let last = |ray: &str, method: SearchMethod| {
            let of = |row: &&Row| row.ray == ray && row.method == method.to_string() && row.step == u64::from(STEPS);
            self.iter().find(of).map(|row| row.error.into())
        };
        let drawn: Vec<Row> = self.iter().filter(|row| row.ray == CORNER).cloned().collect();
        Findings::of(self, CRITERIA)
            .headline(
                "error of the secant from x after ten steps, in a corner",
                last(CORNER, SearchMethod::SecantFromPoint),
            )
            .note("A guess of no steps is the one from the point at infinity. Lengths are in half widths of the room.")
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
