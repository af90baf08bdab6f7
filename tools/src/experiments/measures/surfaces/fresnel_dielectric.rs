//! Schlick's curve beside Fresnel's equations without extinction, where it was made for: values and errors over the index of refraction.
//!
//! Oracles: the exact factor in f64, and values and errors that were computed elsewhere for the same indices.

use clerestory::Result;
use clerestory::scene::FresnelForm;
use clerestory::transport::fresnel::fresnel_conductor;
use glam::DVec3;

use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Study, curves, largest, rows};
use crate::experiments::measures::Context;
use crate::metal_forms::{FormError, STEPS, Way, cosines};

/// Cosines of incidence, and for each index the exact factor and Schlick's there.
const COSINES: [f64; 5] = [1.0, 0.5, 0.2, 0.1, 0.05];
const VALUES: [(f64, [f64; 5], [f64; 5]); 3] = [
    (
        1.1,
        [0.0023, 0.0131, 0.1523, 0.3843, 0.6183],
        [0.0023, 0.0334, 0.3292, 0.5914, 0.7743],
    ),
    (
        1.5,
        [0.0400, 0.0892, 0.3389, 0.5716, 0.7521],
        [0.0400, 0.0700, 0.3546, 0.6069, 0.7828],
    ),
    (
        3.0,
        [0.2500, 0.2718, 0.4019, 0.5680, 0.7291],
        [0.2500, 0.2734, 0.4958, 0.6929, 0.8303],
    ),
];
/// Index, greatest absolute error, greatest relative error.
const ERRORS: [(f64, f64, f64); 13] = [
    (1.1, 0.2105, 1.874),
    (1.2, 0.1130, 0.467),
    (1.3, 0.0683, 0.219),
    (1.4, 0.0461, 0.235),
    (1.5, 0.0357, 0.232),
    (1.6, 0.0319, 0.220),
    (1.8, 0.0345, 0.182),
    (2.0, 0.0444, 0.140),
    (2.2, 0.0582, 0.103),
    (2.4, 0.0740, 0.136),
    (2.6, 0.0909, 0.172),
    (2.8, 0.1080, 0.210),
    (3.0, 0.1250, 0.247),
];
/// Steps of the curves that are drawn.
const CURVE_STEPS: u32 = 40;

rows! {
    /// An index of refraction.
    struct Row = "Errors of Schlick's curve without extinction" by [n] {
        n: f64 = "n",
        absolute: f64 = "greatest absolute error",
        published_absolute: f64 = "published: greatest absolute error",
        relative: f64 = "greatest relative error",
        published_relative: f64 = "published: greatest relative error",
    }
}

rows! {
    /// A curve at a cosine.
    struct Point = "Reflectance of dielectrics" by [n, curve, cosine] {
        n: f64 = "n",
        curve: String = "curve",
        cosine: f64 = "cosine of incidence",
        value: f64 = "reflectance",
        published: Option<f64> = "published reflectance",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    errors: Vec<Row>,
    points: Vec<Point>,
}

const OF_ERRORS: &[Criterion<Row>] = &[
    Criterion::each(
        "published errors are reproduced: difference of the greatest absolute one",
        Bound::AtMost(1e-4),
        |row: &Row| (row.absolute - row.published_absolute).abs().into(),
    )
    .because("they are printed to four digits"),
    Criterion::each(
        "published errors are reproduced: difference of the greatest relative one",
        Bound::AtMost(1e-3),
        |row: &Row| (row.relative - row.published_relative).abs().into(),
    )
    .because("they are printed to three digits"),
    Criterion::each(
        "at n = 1.1 the curve is off by more than the factor itself: greatest relative error",
        Bound::AtLeast(1.0),
        |row: &Row| row.relative.into(),
    )
    .among(|row| row.n == 1.1),
];
const OF_POINTS: &[Criterion<Point>] = &[Criterion::each(
    "published values are reproduced: their difference",
    Bound::AtMost(5e-5),
    |point: &Point| (point.value - point.published.unwrap_or(f64::NAN)).abs().into(),
)
.among(|point| point.published.is_some())
.because("they are printed to four digits")
.in_every_form()];

const EXACT: &str = "exact";

fn points(n: f64, cosines: impl Iterator<Item = (f64, Option<[f64; 2]>)>) -> Vec<Point> {
    let schlick = Way::Form(FresnelForm::Schlick).curve(n, 0.0);
    let mut all = Vec::new();
    for (cosine, published) in cosines {
        let exact = fresnel_conductor(cosine, DVec3::splat(n), DVec3::ZERO).x;
        let values = [(EXACT, exact), (FresnelForm::Schlick.name(), schlick(cosine))];
        for (i, (curve, value)) in values.into_iter().enumerate() {
            all.push(Point {
                n,
                curve: curve.into(),
                cosine,
                value,
                published: published.map(|published| published[i]),
            });
        }
    }
    all
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let steps = context.pick(STEPS, 500);
        let errors = ERRORS.map(|(n, published_absolute, published_relative)| {
            let error = FormError::of(Way::Form(FresnelForm::Schlick), n, 0.0, steps);
            Row {
                n,
                absolute: error.absolute,
                published_absolute,
                relative: error.worst,
                published_relative,
            }
        });
        let of = |(n, exact, schlick): (f64, [f64; 5], [f64; 5])| {
            let even = cosines(CURVE_STEPS).map(|cosine| (cosine, None));
            let even = even.filter(|(cosine, _)| !COSINES.contains(cosine));
            let published = (0..COSINES.len()).map(|i| (COSINES[i], Some([exact[i], schlick[i]])));
            let mut all = points(n, published.chain(even));
            all.sort_by(|a, b| a.curve.cmp(&b.curve).then(a.cosine.total_cmp(&b.cosine)));
            all
        };
        Ok(Self {
            errors: errors.into(),
            points: VALUES.into_iter().flat_map(of).collect(),
        })
    }

    fn findings(&self) -> Findings {
        let name = |point: &Point| format!("{}, n = {}", point.curve, point.n);
        Findings::of(&self.errors, OF_ERRORS)
            .headline(
                "the greatest relative error at n = 1.5 (%)",
                largest(&self.errors, |row| row.n == 1.5, |row| 100.0 * row.relative),
            )
            .note("Over 20,001 even cosines, relative to the exact factor. Near n = 1 that is small, and the curve is not.")
            .and(Findings::of(&self.points, OF_POINTS).long())
            .curves(
                "reflectance",
                "Exact factor and Schlick's curve",
                Axes::even("cosine of incidence", "reflectance", 1.0, (10, 0.1)),
                curves(&self.points, name, |point| (point.cosine, point.value.into())),
            )
            .curves(
                "errors",
                "Errors of Schlick's curve",
                Axes::rates("n", "greatest relative error"),
                curves(&self.errors, |_| "Schlick".into(), |row| (row.n, row.relative.into())),
            )
    }
}
