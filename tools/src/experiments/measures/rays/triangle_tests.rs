//! Ray against triangle: the watertight test of the kernels, Möller–Trumbore's and Wald's, in f32, and the first two as oracles in f64.
//!
//! Oracle of all of them: Möller–Trumbore's in numbers of 106 bits.

use clerestory::Result;
use clerestory::accel::Ray;
use clerestory::accel::yardstick::WaldTriangle;

use super::triangle_forms::{
    CASES, Case, FORMS, Form, Input, KERNELS, Seam, WALD, exact_in_plane, is_inside_of_outer_edges, rays,
};
use crate::experiments::findings::{Bound, Criterion, Findings, Repeats, Study, rows, total};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds_once;
use crate::experiments::measures::errors::{Errors, greatest};
use crate::experiments::measures::kd::hit_errors::Sheared;

/// The unit of relative errors, half a step of f32.
const UNIT: f64 = 1.0 / 16_777_216.0;

rows! {
    /// A form of the test on a case.
    struct Row = "Ray against triangle" by [case, form] {
        case: String = "case",
        form: String = "form",
        t_median: f64 = "t: median relative error (2⁻²⁴)",
        t_most: f64 = "t: 99.9 % (2⁻²⁴)",
        t_worst: f64 = "t: worst (2⁻²⁴)",
        t_of_bound: f64 = "t: greatest share of its bound",
        weights_most: f64 = "weights: 99.9 % error",
        weights_worst: f64 = "weights: worst error",
        missed: u64 = "missed hits",
        false_hits: u64 = "false hits",
        rays: u64 = "rays",
        lost: u64 = "lost between two triangles",
        seams: u64 = "rays at common edges",
        lost_past: u64 = "lost past outer edges",
        outer: u64 = "rays at common and outer edges",
        time: Repeats = "a test (ns)",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each("no ray is lost between neighbours", Bound::AtMost(0.0), |row: &Row| {
        row.lost.into()
    })
    .among(Row::is_the_kernels)
    .in_every_form(),
    Criterion::each(
        "the ray's parameter errs by no more than its bound",
        Bound::AtMost(1.0),
        |row: &Row| row.t_of_bound.into(),
    )
    .among(Row::is_the_kernels)
    .because(
        "18 roundings of the reach and 16 of its slopes: what `clerestory::accel::triangle` and its derivation at `BOX_SLACK` state for every ray",
    )
    .in_every_form(),
];

impl Row {
    fn is_the_kernels(&self) -> bool {
        self.form == KERNELS
    }

    fn of(case: &Case, (form, test): (&str, Form), inputs: &[Input], seams: &[Seam], time: Vec<f64>) -> Self {
        let (mut parameters, mut weights, mut shares) = (Errors::default(), Errors::default(), Errors::default());
        let (mut missed, mut false_hits) = (0, 0);
        for input in inputs {
            let (in_plane, found) = (exact_in_plane(input), test(input));
            if let (Some((expected, _)), Some(found)) = (in_plane, found) {
                shares.add((found.t - expected.t) / Sheared::new(&input.0, &input.1).plane().1);
            }
            match (in_plane.filter(|(_, inside)| *inside), found) {
                (Some((expected, _)), Some(found)) => {
                    parameters.add((found.t / expected.t - 1.0) / UNIT);
                    weights.add(greatest([found.u - expected.u, found.v - expected.v].map(f64::abs)));
                }
                (Some(_), None) => missed += 1,
                (None, Some(_)) => false_hits += 1,
                (None, None) => {}
            }
        }
        let (inside, outer): (Vec<&Seam>, Vec<&Seam>) = seams.iter().partition(|seam| is_inside_of_outer_edges(seam));
        let is_lost = |(ray, pair): &Seam| pair.iter().all(|vertices| test(&(*ray, *vertices)).is_none());
        let lost = |seams: &[&Seam]| seams.iter().filter(|seam| is_lost(seam)).count() as u64;
        Self {
            case: case.name.into(),
            form: form.into(),
            t_median: parameters.quantile(0.5),
            t_most: parameters.quantile(0.999),
            t_worst: parameters.worst(),
            t_of_bound: shares.worst(),
            weights_most: weights.quantile(0.999),
            weights_worst: weights.worst(),
            missed,
            false_hits,
            rays: inputs.len() as u64,
            lost: lost(&inside),
            seams: inside.len() as u64,
            lost_past: lost(&outer),
            outer: outer.len() as u64,
            time: Repeats(time),
        }
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let count = context.pick(100_000, 500);
        context.each(
            &CASES,
            |case| case.name.to_owned(),
            |case| {
                let (inputs, seams) = rays(case, count);
                let ready = |(ray, vertices): &Input| Some((*ray, WaldTriangle::new(vertices)?));
                let ready: Vec<(Ray, WaldTriangle)> = inputs.iter().filter_map(ready).collect();
                let times = context.in_turns(9, FORMS.len(), |i| {
                    Ok(match FORMS[i] {
                        (WALD, _) => nanoseconds_once(&ready, |(ray, triangle)| triangle.intersect(ray)),
                        (_, test) => nanoseconds_once(&inputs, test),
                    })
                })?;
                let forms = FORMS.into_iter().zip(times);
                Ok(forms
                    .map(|(form, time)| Row::of(case, form, &inputs, &seams, time))
                    .collect())
            },
        )
    }

    fn findings(&self) -> Findings {
        Findings::of(self, CRITERIA)
            .headline(
                "rays that the kernels' test loses between neighbours",
                total(self, Row::is_the_kernels, |row| row.lost),
            )
            .note(
                "Errors against Möller–Trumbore's test in numbers of 106 bits, on the same f32 input. Rays are aimed at and around each \
                 triangle; rays at common edges at pairs with one triangle on each side, as the ray sees them, of which the exact test meets \
                 one or both: lost are those that meet neither. Rays that pass an outer edge too, within what the kernels' test rounds at \
                 most, may be lost past it; they are counted by themselves. The bound of t is the watertight test's, for hits of every form: \
                 18uM/|d| + 16uM·s with u = 2⁻²⁴, M the largest coordinate distance of a vertex from the ray's origin, |d| the direction's \
                 largest component and s the sizes of both slopes of the plane. The watertight test counts a zero as inside for both triangles of an edge: what it adds by that shows as false \
                 hits. Tests on one thread, the ray's shear computed anew for each, which kernels compute once a ray; Wald's test is timed on \
                 triangles that were made ready, of which it reads 36 bytes and an axis, and it ends at the plane unless that lies in the \
                 ray's range.",
            )
    }
}
