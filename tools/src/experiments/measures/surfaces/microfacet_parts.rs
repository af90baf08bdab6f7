//! Energy and reciprocity of white metals by each pairing of a distribution of microfacets with a geometric term.
//!
//! Oracles: no more light leaves a surface than comes in, and reflections are the same in both directions.

use clerestory::Result;
use clerestory::scene::{Distribution, Geometry, Microfacets};
use clerestory::transport::bsdf::{Bsdf, BsdfFeatures, GltfFactors, LOBE_ALL, bsdf_eval, bsdf_gltf};
use glam::DVec3;

use super::energy::{COSINES, ROUGHNESSES, WHITE, albedo, context as bsdf, direction};
use crate::experiments::findings::{Axes, Bound, Criterion, Findings, Repeats, Study, curves, largest, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds_once;
use crate::experiments::measures::errors::greatest;
use crate::random::Random;

/// Standard errors that the greatest of 378 albedos exceeds less than once in a hundred runs, by Student's t of 15 degrees and Šidák.
const ERRORS: f64 = 5.6;

const DISTRIBUTIONS: [(&str, Distribution); 3] = [
    ("ggx", Distribution::Ggx),
    ("beckmann", Distribution::Beckmann),
    ("cosine-lobe", Distribution::CosineLobe),
];
/// The term that is never above Cook and Torrance's.
const SIMPLIFIED: &str = "simplified";
const TERMS: [(&str, Geometry); 3] = [
    ("cook-torrance", Geometry::CookTorrance),
    (SIMPLIFIED, Geometry::Simplified),
    ("smith", Geometry::Smith),
];

rows! {
    /// A pairing at a roughness.
    struct Row = "White metals in a white furnace" by [distribution, term, roughness] {
        distribution: String = "distribution",
        term: String = "geometric term",
        roughness: f64 = "roughness",
        least: f64 = "least albedo",
        least_at: f64 = "cosine of the least albedo",
        greatest: f64 = "greatest albedo",
        surely: f64 = "greatest albedo less 5.6 standard errors of it",
        over_grooves: f64 = "greatest value over that with Cook and Torrance's term",
        reciprocity: f64 = "reciprocity: worst relative difference",
        samples: u64 = "samples of an albedo",
        evaluation: Repeats = "an evaluation (ns)",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "no light comes out of nothing: the greatest albedo less 5.6 standard errors",
        Bound::AtMost(1.0),
        |row: &Row| row.surely.into(),
    ),
    Criterion::each(
        "the simplified term gains nothing over Cook and Torrance's: the greatest ratio",
        Bound::AtMost(1.0 + 1e-9),
        |row: &Row| row.over_grooves.into(),
    )
    .among(|row| row.term == SIMPLIFIED)
    .because("(n·l)(n·v)/(l·h)² is at most (n·h)², and what is masked at most the greater cosine over the sum of both")
    .in_every_form(),
    Criterion::each(
        "no difference when the directions change places",
        Bound::AtMost(1e-9),
        |row: &Row| row.reciprocity.into(),
    )
    .because("roundings of f64, of 10⁻¹⁶, over the least cosines, of 10⁻⁷")
    .in_every_form(),
];

fn surface(roughness: f64, distribution: Distribution, geometry: Geometry) -> Bsdf {
    bsdf_gltf(&GltfFactors {
        roughness,
        metallic: 1.0,
        ..WHITE
    })
    .with_microfacets(Microfacets { distribution, geometry })
}

/// The scattering function without its cosine.
fn value(surface: &Bsdf, wo: DVec3, wi: DVec3) -> f64 {
    bsdf_eval(&bsdf(BsdfFeatures::ALL), surface, wo, wi, LOBE_ALL).x / wi.z
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let (samples, pairs): (u32, u32) = context.pick((1 << 15, 20_000), (256, 200));
        let scattering = bsdf(BsdfFeatures::ALL);
        let name = |roughness: &f64| format!("roughness {roughness}");
        context.each(&ROUGHNESSES, name, |roughness| {
            let mut random = Random::new(4);
            let directions: Vec<[DVec3; 2]> = (0..pairs)
                .map(|_| {
                    let mut up = || direction(1.0 - random.unit(), 7.0 * random.unit());
                    [up(), up()]
                })
                .collect();
            let pairings: Vec<_> = DISTRIBUTIONS.iter().flat_map(|d| TERMS.map(|t| (*d, t))).collect();
            let surfaces: Vec<Bsdf> = pairings
                .iter()
                .map(|((_, d), (_, t))| surface(*roughness, *d, *t))
                .collect();
            let times = context.in_turns(9, surfaces.len(), |i| {
                Ok(nanoseconds_once(&directions, |[a, b]| value(&surfaces[i], *a, *b)))
            })?;
            let rows = pairings
                .iter()
                .zip(&surfaces)
                .zip(times)
                .map(|((pairing, metal), time)| {
                    let ((distribution, kind), (term, _)) = *pairing;
                    let mut albedos =
                        COSINES.map(|cosine| (albedo(&scattering, metal, cosine, LOBE_ALL, samples), cosine));
                    let surely = greatest(albedos.iter().map(|(albedo, _)| albedo.value - ERRORS * albedo.error));
                    albedos.sort_by(|a, b| a.0.value.total_cmp(&b.0.value));
                    let [least, .., most] = albedos;
                    let grooves = surface(*roughness, kind, Geometry::CookTorrance);
                    let ratios = directions.iter().filter_map(|[a, b]| {
                        let of_grooves = value(&grooves, *a, *b);
                        (of_grooves > f64::MIN_POSITIVE).then(|| value(metal, *a, *b) / of_grooves)
                    });
                    let differences = directions.iter().map(|[a, b]| {
                        let (there, back) = (value(metal, *a, *b), value(metal, *b, *a));
                        (there - back).abs() / there.max(back).max(f64::MIN_POSITIVE)
                    });
                    Row {
                        distribution: distribution.into(),
                        term: term.into(),
                        roughness: *roughness,
                        least: least.0.value,
                        least_at: least.1,
                        greatest: most.0.value,
                        surely,
                        over_grooves: greatest(ratios),
                        reciprocity: greatest(differences),
                        samples: samples.into(),
                        evaluation: Repeats(time),
                    }
                });
            Ok(rows.collect())
        })
    }

    fn findings(&self) -> Findings {
        let at = |row: &Row| (row.roughness, row.least.into());
        Findings::of(self, CRITERIA)
            .headline(
                "the greatest albedo with the simplified term",
                largest(self, |row| row.term == SIMPLIFIED, |row| row.greatest),
            )
            .note(
                "Width α is the roughness squared: Beckmann's slope, and the lobe of exponent 2/α² − 2. Without compensation for multiple scattering, which \
                 these metals do not have. What is left out of 1 is lost, not scattered. Smith's term is the product of both directions' masking, as Mitsuba has it.",
            )
            .curves(
                "least-albedo",
                "Least albedo over the angle",
                Axes::even("roughness", "least albedo", 1.0, (5, 0.2)),
                curves(self, |row| format!("{}, {}", row.distribution, row.term), at),
            )
    }
}
