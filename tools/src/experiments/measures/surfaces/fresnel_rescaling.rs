//! What the rescaled curve and its compensating term are made of: one minus Schlick's curve, scaled; its errors by index and extinction; the term
//! by its coefficient and exponent.
//!
//! Oracles: the exact factor in f64, closed forms, and values that were computed elsewhere.

use clerestory::scene::FresnelForm;
use clerestory::transport::fresnel::compensated::{Compensation, rule};

use crate::experiments::findings::{Axes, Bound, Criterion, Findings, curves, largest, rows};
use crate::experiments::measures::Context;
use crate::metal_forms::{FormError, STEPS, Way, cosines};

/// The metal whose curves are drawn.
const INDEX: f64 = 1.5;
const EXTINCTION: f64 = 5.0;
/// Steps of the curves that are drawn.
const CURVE_STEPS: u32 = 40;

/// Extinctions, and for each of some indices the published greatest relative error of the rescaled curve.
const EXTINCTIONS: [f64; 9] = [0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0];
const ERRORS: [(f64, [f64; 9]); 4] = [
    (1.1, [0.420, 0.275, 0.027, 0.091, 0.123, 0.129, 0.125, 0.109, 0.095]),
    (1.5, [0.255, 0.187, 0.048, 0.133, 0.167, 0.173, 0.168, 0.148, 0.128]),
    (2.0, [0.128, 0.088, 0.124, 0.191, 0.221, 0.226, 0.219, 0.194, 0.169]),
    (3.0, [0.249, 0.257, 0.286, 0.316, 0.330, 0.327, 0.316, 0.282, 0.247]),
];
/// The first and the last of the indices that are drawn, in tenths.
const TENTHS: [u32; 2] = [11, 30];

/// Coefficients and exponents of terms. Those of most metals are up to 4.6 and from 2 to 8.2.
const TERMS: [[f64; 2]; 5] = [[1.0, 2.0], [1.0, 4.0], [1.0, 8.0], [2.0, 4.0], [4.0, 8.0]];
/// Step of the difference that stands for a slope: what it leaves out is 10⁻¹⁰ times the third derivative.
const SLOPE_STEP: f64 = 1e-5;
/// Even steps of the cosine among which a term's greatest value is looked for.
const TERM_STEPS: u32 = 10_000;

rows! {
    /// A form at a cosine.
    struct Point = "Factors and one minus them at n = 1.5, k = 5" by [form, cosine] {
        form: String = "form",
        cosine: f64 = "cosine of incidence",
        value: f64 = "reflectance",
        gap: f64 = "difference to the exact factor",
        flipped: f64 = "one minus it",
        scale: Option<f64> = "one minus it over one minus Schlick's",
    }
}
rows! {
    /// A number that was published.
    struct Figure = "Published figures at n = 1.5, k = 5" by [quantity] {
        quantity: String = "quantity",
        found: f64 = "found",
        published: f64 = "published",
        allowed: f64 = "half of its last digit",
    }
}
rows! {
    /// An index and an extinction.
    struct Worst = "Greatest relative error of the rescaled curve" by [n, k] {
        n: f64 = "n",
        k: f64 = "k",
        worst: f64 = "greatest relative error",
    }
}
rows! {
    /// An index and an extinction whose error was published.
    struct Stated = "Greatest relative error of the rescaled curve beside the published one" by [n, k] {
        n: f64 = "n",
        k: f64 = "k",
        worst: f64 = "greatest relative error",
        published: f64 = "published: greatest relative error",
    }
}
rows! {
    /// A term.
    struct Term = "Compensating terms −a c (1 − c)^α" by [a, alpha] {
        a: f64 = "a",
        alpha: f64 = "α",
        slope: f64 = "slope at grazing incidence",
        most: f64 = "most that it takes off",
        place: f64 = "cosine of the most",
        closed: f64 = "1/(1 + α)",
    }
}
rows! {
    /// A term at a cosine.
    struct Taken = "What terms take off" by [a, alpha, cosine] {
        a: f64 = "a",
        alpha: f64 = "α",
        cosine: f64 = "cosine of incidence",
        value: f64 = "a c (1 − c)^α",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Rescaling {
    points: Vec<Point>,
    figures: Vec<Figure>,
    worst: Vec<Worst>,
    stated: Vec<Stated>,
    terms: Vec<Term>,
    taken: Vec<Taken>,
}

const OF_POINTS: &[Criterion<Point>] = &[
    Criterion::each(
        "the rescaled curve meets the exact factor at both ends: their difference",
        Bound::AtMost(1e-6),
        |row: &Point| row.gap.abs().into(),
    )
    .among(|row| row.is_rescaled() && [0.0, 1.0].contains(&row.cosine))
    .in_every_form(),
    Criterion::each(
        "one minus the rescaled curve is a fifth of one minus Schlick's: ratio off by",
        Bound::AtMost(1e-6),
        |row: &Point| (row.scale.unwrap_or(f64::NAN) - 0.2).abs().into(),
    )
    .among(|row| row.is_rescaled() && row.scale.is_some())
    .because("(n + 1)²/((n + 1)² + k²)")
    .in_every_form(),
];
const OF_FIGURES: &[Criterion<Figure>] = &[Criterion::each(
    "figures at n = 1.5, k = 5 are the published ones: difference over half of the last digit",
    Bound::AtMost(1.0),
    |row: &Figure| ((row.found - row.published).abs() / row.allowed).into(),
)];
const OF_WORST: &[Criterion<Worst>] = &[Criterion::all(
    "extinction adds nothing large: the greatest error of all indices with it over that without",
    Bound::AtMost(1.0),
    |rows: &[&Worst]| {
        let of = |with: bool| {
            let errors = rows.iter().filter(|row| (row.k > 0.0) == with).map(|row| row.worst);
            errors.reduce(f64::max)
        };
        Some((of(true)? / of(false)?).into())
    },
)
.because("no large increase was published")];
const OF_STATED: &[Criterion<Stated>] = &[Criterion::each(
    "errors by index and extinction are the published ones: their difference",
    Bound::AtMost(1e-3),
    |row: &Stated| (row.worst - row.published).abs().into(),
)
.because("they are printed to three digits")];
const OF_TERMS: &[Criterion<Term>] = &[
    Criterion::each(
        "a term falls by a at grazing incidence: difference of the slope over a",
        Bound::AtMost(1e-6),
        |row: &Term| (row.slope / row.a + 1.0).abs().into(),
    )
    .in_every_form(),
    Criterion::each(
        "a term takes most off where its derivative is zero: difference of the cosine",
        Bound::AtMost(1e-4),
        |row: &Term| (row.place - row.closed).abs().into(),
    )
    .because("a step of the search")
    .in_every_form(),
];

impl Point {
    fn is_rescaled(&self) -> bool {
        self.form == FresnelForm::Rescaled.name()
    }
}

fn points() -> Vec<Point> {
    let forms = [FresnelForm::Exact, FresnelForm::Schlick, FresnelForm::Rescaled];
    let [exact, schlick, rescaled] = forms.map(|form| Way::Form(form).curve(INDEX, EXTINCTION));
    let mut all = Vec::new();
    for (form, curve) in forms.into_iter().zip([&exact, &schlick, &rescaled]) {
        for cosine in cosines(CURVE_STEPS) {
            let (value, of_schlick) = (curve(cosine), 1.0 - schlick(cosine));
            all.push(Point {
                form: form.name().into(),
                cosine,
                value,
                gap: value - exact(cosine),
                flipped: 1.0 - value,
                scale: (of_schlick > 0.0).then_some((1.0 - value) / of_schlick),
            });
        }
    }
    all
}

fn figures(steps: u32) -> Vec<Figure> {
    let at_normal = |form| Way::Form(form).curve(INDEX, EXTINCTION)(1.0);
    let worst = |way| 100.0 * FormError::of(way, INDEX, EXTINCTION, steps).worst;
    let Compensation { a, alpha } = rule(INDEX, EXTINCTION);
    let (rescaled, printed) = (Way::Form(FresnelForm::Rescaled), Way::PrintedRule);
    [
        (
            "Schlick's curve at normal incidence",
            at_normal(FresnelForm::Schlick),
            0.04,
            5e-3,
        ),
        (
            "exact factor at normal incidence",
            at_normal(FresnelForm::Exact),
            0.808,
            5e-4,
        ),
        ("rescaled: greatest relative error (%)", worst(rescaled), 17.3, 0.05),
        ("coefficient by the printed rule", a, 2.196, 5e-4),
        ("exponent by the printed rule", alpha, 5.647, 5e-4),
        ("printed rule: greatest relative error (%)", worst(printed), 1.08, 5e-3),
    ]
    .map(|(quantity, found, published, allowed)| Figure {
        quantity: quantity.into(),
        found,
        published,
        allowed,
    })
    .into()
}

fn worst(n: f64, k: f64, steps: u32) -> Worst {
    let worst = FormError::of(Way::Form(FresnelForm::Rescaled), n, k, steps).worst;
    Worst { n, k, worst }
}

fn stated(steps: u32) -> Vec<Stated> {
    let of = move |(n, published): (f64, [f64; 9])| {
        EXTINCTIONS
            .into_iter()
            .zip(published)
            .map(move |(k, published)| Stated {
                n,
                k,
                worst: worst(n, k, steps).worst,
                published,
            })
    };
    ERRORS.into_iter().flat_map(of).collect()
}

fn term([a, alpha]: [f64; 2]) -> Term {
    let term = Compensation { a, alpha };
    let taken = cosines(TERM_STEPS).map(|c| (c, term.term(c)));
    let (place, most) = taken.fold((0.0, 0.0), |most, at| if at.1 > most.1 { at } else { most });
    // Of second order, since the term is 0 at grazing incidence.
    let slope = -(4.0 * term.term(SLOPE_STEP) - term.term(2.0 * SLOPE_STEP)) / (2.0 * SLOPE_STEP);
    Term {
        a,
        alpha,
        slope,
        most,
        place,
        closed: 1.0 / (1.0 + alpha),
    }
}

fn taken([a, alpha]: [f64; 2]) -> Vec<Taken> {
    let term = Compensation { a, alpha };
    cosines(CURVE_STEPS)
        .map(|cosine| Taken {
            a,
            alpha,
            cosine,
            value: term.term(cosine),
        })
        .collect()
}

impl Rescaling {
    /// All of it; a smoke run takes errors over fewer cosines, and of fewer indices.
    pub fn measure(context: &Context<'_>) -> Self {
        let steps = context.pick(STEPS, 500);
        let [first, last] = context.pick(TENTHS, [TENTHS[0]; 2]);
        let mut all = Vec::new();
        for k in std::iter::once(0.0).chain(EXTINCTIONS) {
            for tenths in first..=last {
                all.push(worst(f64::from(tenths) / 10.0, k, steps));
            }
        }
        Self {
            points: points(),
            figures: figures(steps),
            worst: all,
            stated: stated(steps),
            terms: TERMS.map(term).into(),
            taken: TERMS.into_iter().flat_map(taken).collect(),
        }
    }

    /// What a page says of it.
    pub fn findings(&self) -> Findings {
        let factors = self.points.iter().map(|row| (row.form.clone(), row.cosine, row.value));
        let flipped = self.points.iter();
        let flipped = flipped.map(|row| (format!("1 − {}", row.form), row.cosine, row.flipped));
        let both: Vec<(String, f64, f64)> = factors.chain(flipped).collect();
        let most = largest(&self.taken, |_| true, |row| row.value).map_or(1.0, |most| most.value);
        Findings::of(&self.figures, OF_FIGURES)
            .and(Findings::of(&self.points, OF_POINTS).long())
            .curves(
                "flipped",
                "Factors and one minus them at n = 1.5, k = 5",
                Axes::even("cosine of incidence", "reflectance", 1.0, (10, 0.1)),
                curves(&both, |row| row.0.clone(), |row| (row.1, row.2.into())),
            )
            .and(Findings::pivoted(&self.worst, "k", OF_WORST))
            .curves(
                "extinction-errors",
                "Errors of the rescaled curve by index and extinction",
                Axes::rates("n", "greatest relative error"),
                curves(&self.worst, |row| format!("k = {}", row.k), |row| (row.n, row.worst.into())),
            )
            .and(Findings::of(&self.stated, OF_STATED))
            .and(Findings::of(&self.terms, OF_TERMS).note(
                "Terms of one exponent have one shape. That of aluminium at 700 nm has the exponent 8.2, and takes most off at a cosine of 0.11; that of copper there 2.4 and 0.30.",
            ))
            .and(Findings::of(&self.taken, &[]).long())
            .curves(
                "terms",
                "What terms a c (1 − c)^α take off the rescaled curve",
                Axes::even("cosine of incidence", "taken off", 1.05 * most, (10, 0.1)),
                curves(
                    &self.taken,
                    |row| format!("a = {}, α = {}", row.a, row.alpha),
                    |row| (row.cosine, row.value.into()),
                ),
            )
    }
}
