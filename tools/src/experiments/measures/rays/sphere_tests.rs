//! Ray against sphere: the engine's closest approach and hit, in f64 and with the kernels' operations in f32, beside the textbook's
//! quadratic equation.
//!
//! Oracle: the same ray in numbers of 106 bits, its direction's length included.

use clerestory::Result;

use super::sphere_forms::{ENGINES, Input, Kind, PAIRS, UNIT_F64, exact, input};
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Repeats, Study, curves, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds_once;
use crate::experiments::measures::errors::Errors;
use crate::random::Random;

/// Spheres by the distance of their centres and by that of the ray from these, in radii.
type Case = (&'static str, [f64; 2], [f64; 2]);

const CASES: [Case; 4] = [
    ("2 to 10 radii away", [2.0, 10.0], [0.0, 1.25]),
    ("2 to 10 radii away, nearly tangent", [2.0, 10.0], [0.9999, 1.0001]),
    ("10⁴ radii away", [1e4, 1.01e4], [0.0, 1.25]),
    ("10⁶ radii away", [1e6, 1.01e6], [0.0, 1.25]),
];
/// From here on spheres are at a distance, radii.
const FAR: f64 = 1e4;
/// What the closest distance may err by: three differences, a scalar product, three products and a root.
const ROUNDINGS: f64 = 8.0;

rows! {
    /// A form on spheres of a case.
    struct Row = "Ray against sphere" by [case, form] {
        case: String = "case",
        least: f64 = "least distance (radii)",
        form: String = "form",
        distance: f64 = "closest distance: worst error (radii)",
        distance_in_roundings: f64 = "closest distance: worst error (roundings)",
        entry_median: f64 = "entry: median error (radii)",
        entry_most: f64 = "entry: 99.9 % error (radii)",
        entry_worst: f64 = "entry: worst error (radii)",
        entry_over_textbook: Option<f64> = "entry: worst error over the textbook's",
        wrong: u64 = "wrong verdicts",
        wrong_beyond: u64 = "wrong verdicts beyond rounding",
        rays: u64 = "rays",
        time: Repeats = "a ray (ns)",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "the closest distance errs by a few roundings of the distance of the centre",
        Bound::AtMost(ROUNDINGS),
        |row: &Row| row.distance_in_roundings.into(),
    )
    .among(Row::is_the_engines)
    .because("three differences, a scalar product, three products and a root"),
    Criterion::each(
        "no verdict is wrong but where the ray passes within these roundings of the sphere",
        Bound::AtMost(0.0),
        |row: &Row| row.wrong_beyond.into(),
    )
    .among(Row::is_the_engines),
    Criterion::each(
        "at a distance the worst error is far below the textbook's: over it",
        Bound::AtMost(0.1),
        |row: &Row| row.entry_over_textbook.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.is_the_engines() && row.least >= FAR)
    .because("far is an order of magnitude"),
];

impl Row {
    fn is_the_engines(&self) -> bool {
        self.entry_over_textbook.is_some()
    }

    fn of((case, away, _): Case, kind: &Kind, inputs: &[Input], time: Vec<f64>) -> Self {
        let (mut distances, mut roundings, mut entries) = (Errors::default(), Errors::default(), Errors::default());
        let (mut wrong, mut wrong_beyond) = (0, 0);
        for input in inputs {
            // Forms in f64 need a direction of unit length in f64.
            let input = &Input {
                direction: if kind.unit == UNIT_F64 {
                    input.direction.normalize()
                } else {
                    input.direction
                },
                ..*input
            };
            let (expected, found) = (exact(input), (kind.compute)(input));
            let rounding = kind.unit * input.centre.distance(input.origin);
            distances.add((found.0 - expected.0) / input.radius);
            roundings.add((found.0 - expected.0) / rounding);
            match (expected.1, found.1) {
                (Some(expected), Some(found)) => entries.add((found - expected) / input.radius),
                (None, None) => {}
                _ => {
                    wrong += 1;
                    wrong_beyond += u64::from((expected.0 - input.radius).abs() > ROUNDINGS * rounding);
                }
            }
        }
        Self {
            case: case.into(),
            least: away[0],
            form: kind.name.into(),
            distance: distances.worst(),
            distance_in_roundings: roundings.worst(),
            entry_median: entries.quantile(0.5),
            entry_most: entries.quantile(0.999),
            entry_worst: entries.worst(),
            entry_over_textbook: None,
            wrong,
            wrong_beyond,
            rays: inputs.len() as u64,
            time: Repeats(time),
        }
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let count = context.pick(100_000, 500);
        let name = |(case, ..): &Case| (*case).to_owned();
        context.each(&CASES, name, |case| {
            let mut random = Random::new(1);
            let inputs: Vec<Input> = (0..count).map(|_| input(&mut random, case.1, case.2)).collect();
            let kinds: Vec<&Kind> = PAIRS.iter().flatten().collect();
            let times = context.in_turns(9, kinds.len(), |i| Ok(nanoseconds_once(&inputs, kinds[i].compute)))?;
            let of = |(kind, time): (&&Kind, Vec<f64>)| Row::of(*case, kind, &inputs, time);
            let mut rows: Vec<Row> = kinds.iter().zip(times).map(of).collect();
            for [engines, textbooks] in rows.as_chunks_mut::<2>().0 {
                engines.entry_over_textbook = Some(engines.entry_worst / textbooks.entry_worst);
            }
            Ok(rows)
        })
    }

    fn findings(&self) -> Findings {
        let far = self.iter().find(|row| row.form == ENGINES && row.least >= FAR);
        let at = |row: &Row| (row.least, row.entry_worst.into());
        let wide: Vec<Row> = self.iter().filter(|row| row.case != CASES[1].0).cloned().collect();
        Findings::of(self, CRITERIA)
            .headline(
                "the kernels' worst error of the entry, 10⁴ radii away (radii)",
                far.map(|row| row.entry_worst.into()),
            )
            .note(
                "Errors against the same ray in numbers of 106 bits. A wrong verdict is a hit where there is none, or none where there is one. A \
                 rounding is half a step of the form's numbers times the distance of the centre; up to 8 of them excuse a wrong verdict. Radii \
                 are 0.1 to 10 m. The engine's form takes the distance from what projection leaves over, the textbook's from a difference of \
                 squares. Kernels run the operations of the form in f32; times include the closest approach, on one thread of the processor.",
            )
            .curves(
                "error",
                "Entry of rays into spheres",
                Axes::rates("least distance of the centre (radii)", "worst error (radii)"),
                curves(&wide, |row| row.form.clone(), at),
            )
    }
}
