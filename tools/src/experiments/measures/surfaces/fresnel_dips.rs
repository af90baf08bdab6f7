//! Where the exact factor of a metal has its least reflectance, up to which extinction it falls with the cosine of incidence, and what angles small
//! cosines are.
//!
//! Oracle: values that were computed elsewhere for the same indices.

use clerestory::scene::FresnelForm;

use crate::experiments::findings::{Axes, Bound, Criterion, Findings, curves, rows};
use crate::experiments::measures::Context;
use crate::metal_forms::{Way, cosines};

/// The index whose curves are drawn for more and more extinction.
const INDEX: f64 = 1.5;
/// For extinctions from 0 on: reflectance at normal incidence, the least one, and the cosine of the least.
#[expect(clippy::approx_constant, reason = "a published reflectance that looks like ln 2")]
const DIPS: [[f64; 3]; 11] = [
    [0.0400, 0.0400, 1.0],
    [0.1724, 0.1724, 1.0],
    [0.4146, 0.4146, 1.0],
    [0.6066, 0.5971, 0.469],
    [0.7303, 0.6931, 0.294],
    [0.8080, 0.7502, 0.220],
    [0.8580, 0.7884, 0.177],
    [0.8914, 0.8160, 0.149],
    [0.9146, 0.8370, 0.129],
    [0.9312, 0.8535, 0.114],
    [0.9435, 0.8669, 0.102],
];
/// The least whole extinction at which a curve of this index dips.
const FIRST_DIP: f64 = 3.0;
/// Indices, and the greatest extinction up to which reflectance falls with the cosine.
const LIMITS: [[f64; 2]; 19] = [
    [0.05, 1.79],
    [0.1, 1.84],
    [0.2, 1.93],
    [0.4, 2.08],
    [0.6, 2.19],
    [0.8, 2.27],
    [1.0, 2.32],
    [1.2, 2.36],
    [1.5, 2.37],
    [1.8, 2.34],
    [2.0, 2.30],
    [2.2, 2.24],
    [2.4, 2.15],
    [2.6, 2.05],
    [2.8, 1.91],
    [3.0, 1.74],
    [3.2, 1.52],
    [3.4, 1.23],
    [3.6, 0.79],
];
/// The last of the even indices between these, in tenths.
const LAST_TENTH: u32 = 37;
/// Indices between which the boundary meets no extinction at all.
const CLOSING: [f64; 2] = [3.0, 4.0];
/// Cosines with the angle to a tenth of a degree, and to a whole one as it was printed.
const ANGLES: [[f64; 3]; 7] = [
    [0.0, 90.0, 90.0],
    [0.05, 87.1, 87.0],
    [0.1, 84.3, 84.0],
    [0.15, 81.4, 81.0],
    [0.2, 78.5, 78.0],
    [0.25, 75.5, 75.0],
    [0.3, 72.5, 73.0],
];

/// Even steps of the cosine among which the least reflectance is looked for.
const DIP_STEPS: u32 = 10_000;
/// Even steps of the cosine over which a curve is to fall.
const FALL_STEPS: u32 = 2000;
/// Steps of extinction, from above, before the search between two of them.
const EXTINCTION_STEP: f64 = 0.1;
const EXTINCTION_STEPS: u32 = 40;
/// Halvings of an interval: below a ten-thousandth of a step is left.
const HALVINGS: u32 = 14;
/// Steps of the curves that are drawn.
const CURVE_STEPS: u32 = 40;

rows! {
    /// An extinction.
    struct Dip = "Least reflectance at n = 1.5" by [k] {
        k: f64 = "k",
        normal: f64 = "reflectance at normal incidence",
        published_normal: f64 = "published: at normal incidence",
        least: f64 = "least reflectance",
        published_least: f64 = "published: least reflectance",
        place: f64 = "cosine of the least",
        published_place: f64 = "published: cosine of the least",
    }
}
rows! {
    /// An extinction at a cosine.
    struct Factor = "Exact factor at n = 1.5" by [k, cosine] {
        k: f64 = "k",
        cosine: f64 = "cosine of incidence",
        value: f64 = "reflectance",
    }
}
rows! {
    /// An index.
    struct Limit = "Greatest extinction whose factor falls with the cosine all the way" by [n] {
        n: f64 = "n",
        most: f64 = "greatest k",
        published: Option<f64> = "published: greatest k",
    }
}
rows! {
    /// A cosine.
    struct Angle = "Angles of small cosines" by [cosine] {
        cosine: f64 = "cosine of incidence",
        angle: f64 = "angle of incidence (°)",
        tenths: f64 = "published to a tenth (°)",
        whole: f64 = "printed to a whole degree (°)",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Dips {
    dips: Vec<Dip>,
    factors: Vec<Factor>,
    limits: Vec<Limit>,
    angles: Vec<Angle>,
}

const OF_DIPS: &[Criterion<Dip>] = &[
    Criterion::each(
        "reflectance at normal incidence at n = 1.5 is the published one: their difference",
        Bound::AtMost(5e-5),
        |row: &Dip| (row.normal - row.published_normal).abs().into(),
    )
    .because("it is printed to four digits")
    .in_every_form(),
    Criterion::each(
        "the least reflectance at n = 1.5 is the published one: their difference",
        Bound::AtMost(5e-5),
        |row: &Dip| (row.least - row.published_least).abs().into(),
    )
    .because("it is printed to four digits")
    .in_every_form(),
    Criterion::each(
        "the least reflectance at n = 1.5 is at the published cosine: their difference",
        Bound::AtMost(5e-4),
        |row: &Dip| (row.place - row.published_place).abs().into(),
    )
    .because("it is printed to three digits")
    .in_every_form(),
    Criterion::each(
        "curves at n = 1.5 dip where k is 3 or more, and nowhere else: 1 where it is so",
        Bound::AtLeast(1.0),
        |row: &Dip| ((row.least < row.normal) == (row.k >= FIRST_DIP)).into(),
    )
    .in_every_form(),
];
const OF_LIMITS: &[Criterion<Limit>] = &[
    Criterion::each(
        "factors fall with the cosine up to the published extinction: their difference",
        Bound::AtMost(0.02),
        |row: &Limit| (row.most - row.published.unwrap_or(f64::NAN)).abs().into(),
    )
    .among(|row| row.published.is_some())
    .because("it is printed to a hundredth, and was found on a grid"),
    Criterion::each(
        "the boundary meets k = 0 at n = 2 + √3: distance from there",
        Bound::AtMost(0.02),
        |row: &Limit| (row.n - 2.0 - 3.0_f64.sqrt()).abs().into(),
    )
    .among(|row| row.most == 0.0)
    .because("Brewster's angle comes with its least reflectance to normal incidence there"),
];
const OF_ANGLES: &[Criterion<Angle>] = &[
    Criterion::each(
        "angles are the published ones: difference to the tenth (°)",
        Bound::AtMost(0.05),
        |row: &Angle| (row.angle - row.tenths).abs().into(),
    )
    .because("half of the last printed digit")
    .in_every_form(),
    Criterion::each(
        "angles are the printed ones: difference to the whole degree (°)",
        Bound::AtMost(0.5),
        |row: &Angle| (row.angle - row.whole).abs().into(),
    )
    .because("half of the last printed digit"),
];

/// The exact factor by the cosine of incidence.
fn exact(n: f64, k: f64) -> Box<dyn Fn(f64) -> f64> {
    Way::Form(FresnelForm::Exact).curve(n, k)
}

fn dip((k, [published_normal, published_least, published_place]): (f64, [f64; 3])) -> Dip {
    let factor = exact(INDEX, k);
    let mut at = cosines(DIP_STEPS).map(|c| (c, factor(c)));
    let first = at.next().unwrap_or((0.0, f64::INFINITY));
    let (place, least) = at.fold(first, |least, at| if at.1 < least.1 { at } else { least });
    Dip {
        k,
        normal: factor(1.0),
        published_normal,
        least,
        published_least,
        place,
        published_place,
    }
}

/// Whether reflectance falls with the cosine all the way, of so many steps.
fn falls(n: f64, k: f64, steps: u32) -> bool {
    let factor = exact(n, k);
    let mut before = factor(0.0);
    (1..=steps).all(|i| {
        let now = factor(f64::from(i) / f64::from(steps));
        let is_lower = now <= before;
        before = now;
        is_lower
    })
}

/// The last number of an interval for which something is so, where it is so at the first and no longer at the last.
fn last([mut low, mut high]: [f64; 2], is_so: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if is_so(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// The greatest extinction up to which reflectance falls with the cosine. It is looked for from above, since indices below 1 reflect all light in front of a
/// critical angle where there is next to no extinction.
fn greatest_extinction(n: f64, steps: u32) -> f64 {
    let mut even = (0..EXTINCTION_STEPS).rev().map(|i| EXTINCTION_STEP * f64::from(i));
    let first = even.find(|&k| falls(n, k, steps));
    first.map_or(0.0, |k| last([k, k + EXTINCTION_STEP], |k| falls(n, k, steps)))
}

fn limits(steps: u32, last_tenth: u32) -> Vec<Limit> {
    let mut indices: Vec<(f64, Option<f64>)> = LIMITS.iter().map(|[n, most]| (*n, Some(*most))).collect();
    for n in (1..=last_tenth).map(|tenths| f64::from(tenths) / 10.0) {
        if LIMITS.iter().all(|[published, _]| *published != n) {
            indices.push((n, None));
        }
    }
    indices.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut rows: Vec<Limit> = indices
        .into_iter()
        .map(|(n, published)| Limit {
            n,
            most: greatest_extinction(n, steps),
            published,
        })
        .collect();
    rows.push(Limit {
        n: last(CLOSING, |n| falls(n, 0.0, steps)),
        most: 0.0,
        published: None,
    });
    rows
}

impl Dips {
    /// All of it; a smoke run has a coarser boundary at the published indices alone.
    pub fn measure(context: &Context<'_>) -> Self {
        let (steps, last_tenth) = context.pick((FALL_STEPS, LAST_TENTH), (FALL_STEPS / 4, 0));
        let mut factors = Vec::new();
        for k in (0u32..).zip(DIPS).map(|(k, _)| f64::from(k)) {
            let factor = exact(INDEX, k);
            for cosine in cosines(CURVE_STEPS) {
                factors.push(Factor {
                    k,
                    cosine,
                    value: factor(cosine),
                });
            }
        }
        let angle = |[cosine, tenths, whole]: [f64; 3]| Angle {
            cosine,
            angle: cosine.acos().to_degrees(),
            tenths,
            whole,
        };
        Self {
            dips: (0u32..).map(f64::from).zip(DIPS).map(dip).collect(),
            factors,
            limits: limits(steps, last_tenth),
            angles: ANGLES.map(angle).into(),
        }
    }

    /// What a page says of it.
    pub fn findings(&self) -> Findings {
        let found = self.limits.iter().map(|row| ("found", row.n, row.most));
        let published = self.limits.iter();
        let published = published.filter_map(|row| Some(("published", row.n, row.published?)));
        let boundary: Vec<(&str, f64, f64)> = found.chain(published).collect();
        Findings::of(&self.dips, OF_DIPS)
            .note("Over 10,001 even cosines.")
            .and(Findings::of(&self.factors, &[]).long())
            .curves(
                "extinction",
                "Exact factor at n = 1.5 for more and more extinction",
                Axes::even("cosine of incidence", "reflectance", 1.0, (10, 0.1)),
                curves(
                    &self.factors,
                    |row| format!("k = {}", row.k),
                    |row| (row.cosine, row.value.into()),
                ),
            )
            .and(Findings::of(&self.limits, OF_LIMITS).note(
                "Over 2,001 even cosines. A doctoral thesis on metals and reflections on graphics hardware says about 2 at n = 1.5. The last row is where the boundary meets k = 0.",
            ))
            .curves(
                "boundary",
                "Below the curve reflectance falls with the cosine all the way",
                Axes::even("n", "greatest k", 2.5, (4, 1.0)),
                curves(&boundary, |row| row.0.into(), |row| (row.1, row.2.into())),
            )
            .and(Findings::of(&self.angles, OF_ANGLES).note(
                "Printed is 75° for a cosine of 0.25, which is 75.52°: the one whole degree that is not the nearest.",
            ))
    }
}
