//! Curves of four metals at three wavelengths by the exact factor, the rescaled curve and the compensated one, with their errors; and where the exact factor
//! of metals lies farthest below the rescaled curve.
//!
//! Oracles: the exact factor in f64, and the places that were published.

use clerestory::scene::{FresnelForm, metals};

use super::published_metals::PUBLISHED;
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Measured, curves, rows};
use crate::experiments::measures::Context;
use crate::metal_forms::{STEPS, Way, cosines};

/// Metals whose curves are drawn, at these wavelengths in nanometres.
const METALS: [&str; 4] = ["silver", "copper", "gold", "aluminium"];
const WAVELENGTHS: [f64; 3] = [700.0, 550.0, 435.0];
/// Those of them, and of all others, that are called noble.
const NOBLE: [&str; 3] = ["silver", "copper", "gold"];
const WAYS: [Way; 4] = [
    Way::Form(FresnelForm::Exact),
    Way::Form(FresnelForm::Rescaled),
    Way::PrintedRule,
    Way::Form(FresnelForm::Compensated),
];
/// Steps of the curves that are drawn.
const CURVE_STEPS: u32 = 80;
/// Cosines at which aluminium and transition metals lie lowest, as they were published: 0.10 to 0.145, with half of their last digits; so for noble metals
/// 0.16 to 0.34.
const PLACES: [f64; 2] = [0.095, 0.1455];
const NOBLE_PLACES: [f64; 2] = [0.155, 0.345];
/// A difference from here on is below zero, and not a rounding of two equal numbers.
const ROUNDING: f64 = 1e-9;
/// Relative errors below this (%) are left out of logarithmic plots.
const LEAST_ERROR: f64 = 1e-4;

rows! {
    /// A form of a metal at a wavelength and a cosine.
    struct Point = "Curves of four metals at three wavelengths" by [metal, wavelength, form, cosine] {
        metal: String = "metal",
        wavelength: f64 = "wavelength (nm)",
        form: String = "form",
        cosine: f64 = "cosine of incidence",
        value: Option<f64> = "reflectance",
        error: Option<f64> = "relative error (%)",
    }
}
rows! {
    /// A metal at a wavelength.
    struct Lobe = "The exact factor less the rescaled curve" by [metal, wavelength] {
        metal: String = "metal",
        wavelength: f64 = "wavelength (nm)",
        lobes: u64 = "lobes below zero",
        least: f64 = "least difference",
        place: f64 = "cosine of the least difference",
        most: f64 = "greatest difference",
    }
}
rows! {
    /// A metal at a wavelength and a cosine.
    struct Gap = "The rescaled curve less the exact factor" by [metal, wavelength, cosine] {
        metal: String = "metal",
        wavelength: f64 = "wavelength (nm)",
        cosine: f64 = "cosine of incidence",
        value: f64 = "difference",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct MetalCurves {
    points: Vec<Point>,
    lobes: Vec<Lobe>,
    gaps: Vec<Gap>,
}

const OF_LOBES: &[Criterion<Lobe>] = &[
    Criterion::each(
        "the exact factor less the rescaled curve has one lobe below zero: how many",
        Bound::Between(1.0, 1.0),
        |row: &Lobe| row.lobes.into(),
    ),
    Criterion::each(
        "aluminium and transition metals lie farthest below the rescaled curve at a cosine of 0.10 to 0.145",
        Bound::Between(PLACES[0], PLACES[1]),
        |row: &Lobe| row.place.into(),
    )
    .among(|row| !row.is_noble())
    .because("published to a hundredth and to a thousandth, with half of these digits"),
    Criterion::all(
        "noble metals lie farthest below it elsewhere at several wavelengths: at how many of nine",
        Bound::AtLeast(2.0),
        |rows: &[&Lobe]| {
            (!rows.is_empty()).then(|| (rows.iter().filter(|row| row.is_elsewhere()).count() as f64).into())
        },
    )
    .among(Lobe::is_noble),
    Criterion::each(
        "where noble metals lie farthest below it elsewhere, it is at a cosine of 0.16 to 0.34",
        Bound::Between(NOBLE_PLACES[0], NOBLE_PLACES[1]),
        |row: &Lobe| row.place.into(),
    )
    .among(|row| row.is_noble() && row.is_elsewhere())
    .because("published to a hundredth, with half of it"),
];

impl Lobe {
    fn is_noble(&self) -> bool {
        NOBLE.contains(&self.metal.as_str())
    }

    fn is_elsewhere(&self) -> bool {
        !(PLACES[0]..=PLACES[1]).contains(&self.place)
    }
}

/// n and k of a metal.
fn index(metal: &str, wavelength: f64) -> Option<[f64; 2]> {
    metals::spectrum(metal).map(|spectrum| spectrum.at(wavelength))
}

fn points(metal: &str, wavelength: f64) -> Vec<Point> {
    let Some([n, k]) = index(metal, wavelength) else {
        return Vec::new();
    };
    let exact = Way::Form(FresnelForm::Exact).curve(n, k);
    let finite = |x: f64| x.is_finite().then_some(x);
    let of = |way: Way| {
        let curve = way.curve(n, k);
        let at = |cosine| Point {
            metal: metal.into(),
            wavelength,
            form: way.name().into(),
            cosine,
            value: finite(curve(cosine)),
            error: finite(100.0 * (curve(cosine) / exact(cosine) - 1.0).abs()),
        };
        cosines(CURVE_STEPS).map(at).collect::<Vec<_>>()
    };
    WAYS.map(of).concat()
}

/// The exact factor less the rescaled curve, by the cosine.
fn difference(n: f64, k: f64) -> impl Fn(f64) -> f64 {
    let [exact, rescaled] = [FresnelForm::Exact, FresnelForm::Rescaled].map(|form| Way::Form(form).curve(n, k));
    move |c| exact(c) - rescaled(c)
}

fn lobe(metal: &str, wavelength: f64, steps: u32) -> Option<Lobe> {
    let [n, k] = index(metal, wavelength)?;
    let difference = difference(n, k);
    let mut found = Lobe {
        metal: metal.into(),
        wavelength,
        ..Lobe::default()
    };
    let mut was_below = false;
    for cosine in cosines(steps) {
        let value = difference(cosine);
        let is_below = value < -ROUNDING;
        found.lobes += u64::from(is_below && !was_below);
        was_below = is_below;
        if value < found.least {
            (found.least, found.place) = (value, cosine);
        }
        found.most = found.most.max(value);
    }
    Some(found)
}

fn gaps(metal: &str, wavelength: f64) -> Vec<Gap> {
    let Some([n, k]) = index(metal, wavelength) else {
        return Vec::new();
    };
    let difference = difference(n, k);
    let at = |cosine| Gap {
        metal: metal.into(),
        wavelength,
        cosine,
        value: -difference(cosine),
    };
    cosines(CURVE_STEPS).map(at).collect()
}

impl MetalCurves {
    /// All of it; a smoke run looks at fewer cosines for the least difference.
    pub fn measure(context: &Context<'_>) -> Self {
        let steps = context.pick(STEPS, 2000);
        let drawn = METALS
            .iter()
            .flat_map(|metal| WAVELENGTHS.map(|wavelength| (*metal, wavelength)));
        let of_all = PUBLISHED.iter().map(|one| (one.metal, one.wavelength));
        Self {
            points: drawn
                .flat_map(|(metal, wavelength)| points(metal, wavelength))
                .collect(),
            lobes: of_all
                .clone()
                .filter_map(|(metal, wavelength)| lobe(metal, wavelength, steps))
                .collect(),
            gaps: of_all.flat_map(|(metal, wavelength)| gaps(metal, wavelength)).collect(),
        }
    }

    /// What a page says of it.
    pub fn findings(&self) -> Findings {
        let most = self
            .gaps
            .iter()
            .fold(f64::MIN_POSITIVE, |most, gap| most.max(gap.value));
        let mut findings = Findings::of(&self.lobes, OF_LOBES)
            .note(
                "Over 20,001 even cosines. A doctoral thesis on metals and reflections on graphics hardware has the least difference at a cosine near 0.1 to 0.15 for all metals; of the noble ones gold and copper at 435 nm \
                 have it there.",
            )
            .and(Findings::of(&self.gaps, &[]).long())
            .curves(
                "rescaled-less-exact",
                "By how much the rescaled curve lies above the exact factor, of all metals",
                Axes::even("cosine of incidence", "difference", 1.05 * most, (10, 0.1)),
                curves(
                    &self.gaps,
                    |gap| format!("{}, {} nm", gap.metal, gap.wavelength),
                    |gap| (gap.cosine, gap.value.into()),
                ),
            )
            .and(Findings::of(&self.points, &[]).long());
        let name = |point: &Point| format!("{}, {} nm", point.form, point.wavelength);
        for metal in METALS {
            let of_metal = || self.points.iter().filter(move |point| point.metal == metal).cloned();
            let printed = Way::PrintedRule.name();
            let drawn: Vec<Point> = of_metal().filter(|point| point.form != printed).collect();
            let wrong: Vec<Point> = of_metal()
                .filter(|point| point.error.is_some_and(|error| error > LEAST_ERROR))
                .collect();
            let number = |value: Option<f64>| Measured::from(value.unwrap_or(f64::NAN));
            findings = findings
                .curves(
                    &format!("{metal}-reflectances"),
                    &format!("Reflectance of {metal} at three wavelengths"),
                    Axes::even("cosine of incidence", "reflectance", 1.0, (10, 0.1)),
                    curves(&drawn, name, |point| (point.cosine, number(point.value))),
                )
                .curves(
                    &format!("{metal}-errors"),
                    &format!("Relative errors for {metal} at three wavelengths"),
                    Axes::rates("cosine of incidence", "relative error (%)"),
                    curves(&wrong, name, |point| (point.cosine, number(point.error))),
                );
        }
        findings
    }
}
