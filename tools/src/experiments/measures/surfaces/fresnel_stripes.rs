//! Stripes of metals' colours over the angle of incidence: the exact factor, the rescaled curve, and by how much they differ.
//!
//! Oracle: the exact factor in f64. Red, green and blue are the factor at 700, 550 and 435 nm.

use clerestory::Result;
use clerestory::scene::{FresnelForm, metals};
use clerestory::transport::fresnel::form::MetalFresnel;
use glam::DVec3;

use crate::experiments::findings::{Bound, Criterion, Findings, Study, largest, rows};
use crate::experiments::measures::Context;
use crate::metal_forms::sheet;

/// Wavelengths of red, green and blue, nm.
const WAVELENGTHS: [f64; 3] = [700.0, 550.0, 435.0];
const METALS: [&str; 4] = ["silver", "copper", "gold", "aluminium"];
/// Even steps of the cosine.
const STEPS: u32 = 20_000;
/// A relative error that is seen.
const SEEN: f64 = 0.1;
/// Pixels along a side of a square of stripes.
const SIDE: u32 = 160;
const PICTURE: &str = "stripes.png";

/// Where the rescaled curve of aluminium was found to be off by more than a tenth: band, least and greatest cosine; none in blue.
const PUBLISHED: [(&str, [f64; 2]); 2] = [("red", [0.032, 0.262]), ("green", [0.080, 0.182])];

rows! {
    /// A band of a metal's stripe.
    struct Row = "Where the rescaled curve is off by more than a tenth" by [metal, band] {
        metal: String = "metal",
        band: String = "band",
        width: f64 = "width of the stripe's part, in cosines",
        first: Option<f64> = "least cosine",
        last: Option<f64> = "greatest cosine",
        published_first: Option<f64> = "published: least cosine",
        published_last: Option<f64> = "published: greatest cosine",
        worst: f64 = "greatest relative error (%)",
        at: f64 = "at cosine",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "aluminium's stripes differ where they were found to: distance of the ends",
        Bound::AtMost(1e-3),
        |row: &Row| {
            let gap = |found: Option<f64>, published: Option<f64>| match (found, published) {
                (Some(found), Some(published)) => (found - published).abs(),
                _ => f64::INFINITY,
            };
            gap(row.first, row.published_first)
                .max(gap(row.last, row.published_last))
                .into()
        },
    )
    .among(|row| row.published_first.is_some())
    .because("ends are printed to three digits"),
    Criterion::each(
        "no other stripe differs by a tenth anywhere: width of its part",
        Bound::AtMost(0.0),
        |row: &Row| row.width.into(),
    )
    .among(|row| row.published_first.is_none()),
];

/// The exact and the rescaled factor of a metal at three wavelengths.
fn forms(metal: &str) -> Option<[MetalFresnel; 2]> {
    let spectrum = metals::spectrum(metal)?;
    let indices = WAVELENGTHS.map(|wavelength| spectrum.at(wavelength));
    let part = |quantity: usize| DVec3::from_array(indices.map(|index| index[quantity]));
    Some([FresnelForm::Exact, FresnelForm::Rescaled].map(|form| MetalFresnel::new(form, part(0), part(1))))
}

/// A square of three stripes over cosines from 0 at the left to 1: exact, rescaled, relative difference.
fn stripes([exact, rescaled]: &[MetalFresnel; 2], side: u32) -> Vec<DVec3> {
    let at = |i: u32| {
        let c = (f64::from(i % side) + 0.5) / f64::from(side);
        let [exact, rescaled] = [exact.at(c), rescaled.at(c)];
        match 3 * (i / side) / side {
            0 => exact,
            1 => rescaled,
            // White is an error of a fifth.
            _ => (rescaled - exact).abs() / exact * 5.0,
        }
    };
    (0..side * side).map(at).collect()
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let steps = context.pick(STEPS, 1000);
        let side = context.pick(SIDE, 12);
        let (mut rows, mut squares) = (Vec::new(), Vec::new());
        for metal in METALS {
            let Some(forms) = forms(metal) else { continue };
            let errors: Vec<(f64, DVec3)> = (0..=steps)
                .map(|i| {
                    let c = f64::from(i) / f64::from(steps);
                    let exact = forms[0].at(c);
                    (c, (forms[1].at(c) - exact).abs() / exact)
                })
                .collect();
            for (band, name) in ["red", "green", "blue"].into_iter().enumerate() {
                let off: Vec<f64> = errors
                    .iter()
                    .filter(|(_, error)| error[band] > SEEN)
                    .map(|(c, _)| *c)
                    .collect();
                let worst = errors.iter().fold((0.0, 0.0), |worst, (c, error)| {
                    if error[band] > worst.1 {
                        (*c, error[band])
                    } else {
                        worst
                    }
                });
                let published = PUBLISHED.iter().find(|(band, _)| metal == "aluminium" && *band == name);
                rows.push(Row {
                    metal: metal.into(),
                    band: name.into(),
                    width: off.len() as f64 / f64::from(steps),
                    first: off.first().copied(),
                    last: off.last().copied(),
                    published_first: published.map(|(_, ends)| ends[0]),
                    published_last: published.map(|(_, ends)| ends[1]),
                    worst: 100.0 * worst.1,
                    at: worst.0,
                });
            }
            squares.push(stripes(&forms, side));
        }
        context.picture(PICTURE, &sheet(&squares, side, METALS.len() as u32));
        Ok(rows)
    }

    fn findings(&self) -> Findings {
        let findings = Findings::of(self, CRITERIA)
            .headline(
                "the greatest relative error, aluminium in red (%)",
                largest(self, |row| row.metal == "aluminium", |row| row.worst),
            )
            .note("n and k by Johnson and Christy (1972) and Rakić (1995), over 20,001 even cosines.");
        if self.is_empty() {
            return findings;
        }
        findings.picture(
            PICTURE,
            "Silver, copper, gold and aluminium over the cosine of incidence from 0 (left) to 1: exact, rescaled, and five times the relative difference",
        )
    }
}
