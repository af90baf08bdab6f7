//! What each form of a metal's Fresnel factor costs on the device, beside by how much it is off.
//!
//! Oracle of errors: the exact factor in f64, of the table times the geometric term that it holds. Times are of chains of evaluations, each at a cosine
//! that follows from the result before, so that none can be left out or begun before the last has ended.

use clerestory::Result;
use clerestory::scene::{FresnelForm, metals};
use clerestory::transport::fresnel::curve::{CurveForm, FresnelCurve};
use clerestory::transport::fresnel::fresnel_conductor;
use clerestory::transport::fresnel::table::{fresnel_table, fresnel_table_lookup, simplified_geometry};
use glam::DVec3;

use super::fresnel_forms::device_name;
use super::published_metals::PUBLISHED;
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Measured, Repeats, Study, curves, rows};
use crate::experiments::measures::Context;
use crate::metal_forms::{FormError, Way};

/// Evaluations of an invocation.
const CHAIN: u32 = 64;
const TURNS: usize = 9;
/// Binary logarithm of one over the least cosine at which the table's error is taken: where it ends.
const TABLE_DEPTH: f64 = 10.0;
/// The table's greatest relative error by its documentation, %.
const TABLE_ERROR: f64 = 0.06;

rows! {
    /// A form.
    struct Row = "Cost of an evaluation of three bands" by [form] {
        form: String = "form",
        time: Repeats = "time on the device (ns)",
        share: Repeats = "time over the exact factor's (%)",
        published: Option<f64> = "published: time over the exact factor's (%)",
        error: Option<f64> = "greatest error for the tabulated metals (%)",
        over_faster: Option<Measured> = "time over that of the next faster one in the published order",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "the exact factor is the slowest of the four: time over its (%)",
        Bound::AtMost(100.0),
        |row: &Row| (&row.share).into(),
    )
    .among(|row| row.published.is_some_and(|published| published < 100.0)),
    Criterion::each(
        "the published order: time over that of the next faster one",
        Bound::AtLeast(1.0),
        |row: &Row| row.over_faster.unwrap_or(Measured::exact(f64::NAN)),
    )
    .among(|row| row.over_faster.is_some()),
    Criterion::each(
        "the table interpolates within what its documentation says: greatest error (%)",
        Bound::AtMost(TABLE_ERROR),
        |row: &Row| row.error.unwrap_or(f64::NAN).into(),
    )
    .among(|row| row.form == device_name(CurveForm::Table))
    .because("256 nodes, even in the cosine's logarithm"),
];

/// Times that were published, % of the exact factor's, slower ones last.
const PUBLISHED_TIMES: [(CurveForm, f64); 4] = [
    (CurveForm::Schlick, 28.0),
    (CurveForm::Rescaled, 33.0),
    (CurveForm::Compensated, 54.0),
    (CurveForm::Exact, 100.0),
];

/// What the form is called where errors are known.
const fn way(form: CurveForm) -> Option<Way> {
    Some(Way::Form(match form {
        CurveForm::Nothing | CurveForm::Table => return None,
        CurveForm::Exact => FresnelForm::Exact,
        CurveForm::Schlick => FresnelForm::Schlick,
        CurveForm::Rescaled | CurveForm::RescaledF0 => FresnelForm::Rescaled,
        CurveForm::Compensated | CurveForm::CompensatedF0 => FresnelForm::Compensated,
        CurveForm::Tinted => FresnelForm::Hoffman,
        CurveForm::Simplified | CurveForm::Artistic => FresnelForm::Simplified,
    }))
}

/// The greatest relative error of the table of a metal, down to the cosine where it ends.
fn table_error(n: f64, k: f64, steps: u32) -> f64 {
    let product = |c: f64| fresnel_conductor(c, DVec3::splat(n), DVec3::splat(k)) * simplified_geometry(c);
    let table = fresnel_table(|c| fresnel_conductor(c, DVec3::splat(n), DVec3::splat(k)));
    let cosines = (0..=steps).map(|i| (-TABLE_DEPTH * f64::from(i) / f64::from(steps)).exp2());
    let errors = cosines.map(|c| (fresnel_table_lookup(&table, c).x / product(c).x - 1.0).abs());
    errors.fold(0.0, f64::max)
}

/// The greatest error for all metals, %.
fn error(form: CurveForm, steps: u32) -> Option<f64> {
    let way = way(form);
    if way.is_none() && form != CurveForm::Table {
        return None;
    }
    let of = |metal: &str, wavelength| {
        let [n, k] = metals::spectrum(metal).map_or([1.0, 0.0], |spectrum| spectrum.at(wavelength));
        100.0 * way.map_or_else(|| table_error(n, k, steps), |way| FormError::of(way, n, k, steps).worst)
    };
    Some(PUBLISHED.iter().map(|p| of(p.metal, p.wavelength)).fold(0.0, f64::max))
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let gpu = (context.gpu)()?;
        let (count, steps) = context.pick((1 << 18, 2000), (1 << 10, 100));
        let Some(gold) = metals::by_name("gold") else {
            return Ok(Vec::new());
        };
        let forms = CurveForm::ALL;
        let kernels: Vec<FresnelCurve> = forms
            .iter()
            .map(|form| FresnelCurve::new(&gpu, *form, &gold, CHAIN))
            .collect::<Result<_>>()?;
        let evaluations = f64::from(count) * f64::from(CHAIN);
        let times = context.in_turns(TURNS, forms.len(), |i| {
            let (_, seconds) = kernels[i].run(&gpu, count)?;
            Ok(1e9 * seconds / evaluations)
        })?;
        let times: Vec<Repeats> = times.into_iter().map(Repeats).collect();
        let of = |form: CurveForm| forms.iter().position(|other| *other == form).map(|i| &times[i]);
        let exact = of(CurveForm::Exact).cloned().unwrap_or_default();
        let rows = forms.iter().zip(&times).map(|(form, time)| {
            let place = PUBLISHED_TIMES.iter().position(|(other, _)| other == form);
            let faster = place
                .and_then(|place| place.checked_sub(1))
                .and_then(|place| of(PUBLISHED_TIMES[place].0));
            Row {
                form: device_name(*form),
                time: time.clone(),
                share: time.over(&exact).scaled(100.0),
                published: place.map(|place| PUBLISHED_TIMES[place].1),
                error: error(*form, steps),
                over_faster: faster.map(|faster| (&time.over(faster)).into()),
            }
        });
        Ok(rows.collect())
    }

    fn findings(&self) -> Findings {
        let exact = self.iter().find(|row| row.form == device_name(CurveForm::Exact));
        let drawn: Vec<Row> = (self.iter())
            .filter(|row| row.error.is_some_and(|error| error > 0.0))
            .cloned()
            .collect();
        let at = |row: &Row| (row.share.measured().value, row.error.unwrap_or(f64::NAN).into());
        Findings::of(self, CRITERIA)
            .headline(
                "the exact factor of three bands (ns)",
                exact.map(|row| (&row.time).into()),
            )
            .note(
                "Chains of 64 evaluations of gold, for each of 2¹⁸ invocations; `nothing` is what a chain costs without a form, and part of each time. The four with \
                 published times compute all from n and k, as published; forms with -f0 and `tinted` take what the host prepares. `artistic` makes n and k of a \
                 reflectance and an edge tint each time, and then is `simplified`, whose error it has. `table` is a look-up of the exact factor times the simplified \
                 geometric term, which the other forms leave out; its error is that of its interpolation, down to a cosine of 2⁻¹⁰, where it ends.",
            )
            .curves(
                "error-and-cost",
                "Error and cost of the forms",
                Axes::rates("time over the exact factor's (%)", "greatest error (%)"),
                curves(&drawn, |row| row.form.clone(), at),
            )
    }
}
