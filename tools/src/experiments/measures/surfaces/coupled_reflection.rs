//! Matte and specular reflection coupled through the layer's albedo, beside two ways to add them up that are in use.
//!
//! Oracle: a white base under a layer that absorbs nothing scatters exactly all light, and every reflection is reciprocal.

use std::f64::consts::FRAC_1_PI;

use clerestory::Result;
use clerestory::transport::bsdf::{
    Bsdf, BsdfFeatures, GltfFactors, LOBE_ALL, LOBE_GLOSSY, LOBE_REFLECTION, bsdf_eval, bsdf_gltf, bsdf_sample,
};
use clerestory::transport::fresnel::fresnel_dielectric;
use clerestory::transport::warp::square_to_cosine_hemisphere;
use glam::DVec3;

use super::energy::{
    BY_CHANCE, COSINES, ERRORS_OF_42, Mean, ROUGHNESSES, WHITE, albedo, context as bsdf, direction, mean, numbers,
};
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, largest, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds_once;
use crate::experiments::measures::errors::greatest;
use crate::random::Random;

#[derive(Clone, Copy, PartialEq)]
enum Form {
    Coupled,
    /// Base and layer added, nothing taken from the base.
    Sum,
    /// The base scaled by what Fresnel's factor at the half vector leaves over.
    FresnelMix,
}

const ENGINES: &str = "coupled (engine)";

const FORMS: [(&str, Form); 3] = [
    (ENGINES, Form::Coupled),
    ("Fresnel mix", Form::FresnelMix),
    ("plain sum", Form::Sum),
];

/// What the base of an uncoupled form scatters, as a factor of Lambert's 1/π.
fn base_factor(form: Form, surface: &Bsdf, wo: DVec3, wi: DVec3) -> f64 {
    match form {
        Form::FresnelMix => 1.0 - fresnel_dielectric((wo + wi).normalize().dot(wo), surface.eta),
        _ => 1.0,
    }
}

/// The scattering function without its cosine.
fn value(form: Form, surface: &Bsdf, wo: DVec3, wi: DVec3) -> f64 {
    let context = bsdf(BsdfFeatures::ALL);
    if form == Form::Coupled {
        return bsdf_eval(&context, surface, wo, wi, LOBE_ALL).x / wi.z;
    }
    let layer = bsdf_eval(&context, surface, wo, wi, LOBE_GLOSSY & LOBE_REFLECTION).x / wi.z;
    layer + FRAC_1_PI * base_factor(form, surface, wo, wi)
}

fn white_albedo(form: Form, surface: &Bsdf, cos_theta: f64, samples: u32) -> Mean {
    let context = bsdf(BsdfFeatures::ALL);
    if form == Form::Coupled {
        return albedo(&context, surface, cos_theta, LOBE_ALL, samples);
    }
    let layer = albedo(&context, surface, cos_theta, LOBE_GLOSSY & LOBE_REFLECTION, samples);
    let wo = direction(cos_theta, 0.0);
    let base = mean(samples, |u| {
        base_factor(form, surface, wo, square_to_cosine_hemisphere(u.truncate()))
    });
    Mean {
        value: layer.value + base.value,
        error: layer.error + base.error,
    }
}

rows! {
    /// A form on a surface of a roughness.
    struct Row = "White base under a clear layer of index 1.5, in a white furnace" by [form, roughness] {
        form: String = "form",
        roughness: f64 = "roughness",
        least: f64 = "least albedo",
        least_error: f64 = "standard error of the least albedo",
        least_at: f64 = "cosine of the least albedo",
        greatest: f64 = "greatest albedo",
        error: f64 = "standard error of the greatest albedo",
        surely: f64 = "greatest albedo less 4.44 standard errors of it",
        greatest_at: f64 = "cosine of the greatest albedo",
        samples: u64 = "samples of an albedo",
        reciprocity: f64 = "reciprocity: worst relative difference",
        pairs: u64 = "pairs of directions",
        evaluation: Repeats = "an evaluation (ns)",
        sample: Repeats = "a sample (ns)",
    }
}
/// What was found.
pub type Found = Vec<Row>;

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "the albedo is 1 at every angle: the greatest difference",
        Bound::AtMost(0.01),
        Row::difference,
    )
    .among(Row::is_the_engines)
    .because("half of what an eye sees, within 4.44 standard errors"),
    Criterion::each(
        "no light comes out of nothing: the greatest albedo less 4.44 standard errors",
        Bound::AtMost(1.0),
        |row: &Row| row.surely.into(),
    )
    .among(Row::is_the_engines)
    .because(BY_CHANCE),
    Criterion::each(
        "no difference when the directions change places",
        Bound::AtMost(1e-9),
        |row: &Row| row.reciprocity.into(),
    )
    .among(Row::is_the_engines)
    .because("roundings of f64, of 10⁻¹⁶, over the least cosines, of 10⁻⁷")
    .in_every_form(),
];

impl Row {
    fn is_the_engines(&self) -> bool {
        self.form == ENGINES
    }

    /// Of the albedo from 1, at the cosine where it is greatest, within its standard error.
    fn difference(&self) -> Measured {
        let below = Measured::within(1.0 - self.least, ERRORS_OF_42 * self.least_error);
        let above = Measured::within(self.greatest - 1.0, ERRORS_OF_42 * self.error);
        Measured {
            value: greatest([below.value, above.value]),
            low: greatest([below.low, above.low]),
            high: greatest([below.high, above.high]),
        }
    }

    /// All but times.
    fn of((name, form): (&str, Form), roughness: f64, surface: &Bsdf, directions: &[[DVec3; 2]], samples: u32) -> Self {
        let mut albedos = COSINES.map(|cosine| (white_albedo(form, surface, cosine, samples), cosine));
        let surely = albedos
            .iter()
            .map(|(albedo, _)| albedo.value - ERRORS_OF_42 * albedo.error);
        let surely = greatest(surely);
        albedos.sort_by(|a, b| a.0.value.total_cmp(&b.0.value));
        let [least, .., most] = albedos;
        let differences = directions.iter().map(|[a, b]| {
            let (there, back) = (value(form, surface, *a, *b), value(form, surface, *b, *a));
            (there - back).abs() / there.abs().max(back.abs()).max(f64::MIN_POSITIVE)
        });
        Self {
            form: name.into(),
            roughness,
            least: least.0.value,
            least_error: least.0.error,
            least_at: least.1,
            greatest: most.0.value,
            error: most.0.error,
            surely,
            greatest_at: most.1,
            samples: samples.into(),
            reciprocity: greatest(differences),
            pairs: directions.len() as u64,
            ..Self::default()
        }
    }
}

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let (samples, pairs): (u32, u32) = context.pick((1 << 15, 50_000), (256, 200));
        let scattering = bsdf(BsdfFeatures::ALL);
        let uniforms: Vec<DVec3> = (0..1024).map(numbers).collect();
        let name = |roughness: &f64| format!("roughness {roughness}");
        context.each(&ROUGHNESSES, name, |roughness| {
            let surface = bsdf_gltf(&GltfFactors {
                roughness: *roughness,
                ..WHITE
            });
            let mut random = Random::new(4);
            let directions: Vec<[DVec3; 2]> = (0..pairs)
                .map(|_| {
                    let mut up = || direction(1.0 - random.unit(), 7.0 * random.unit());
                    [up(), up()]
                })
                .collect();
            // All forms would be sampled by the engine's strategy, which is the last to take its turn.
            let mut times = context.in_turns(9, FORMS.len() + 1, |i| {
                Ok(match FORMS.get(i) {
                    Some((_, form)) => nanoseconds_once(&directions, |[a, b]| value(*form, &surface, *a, *b)),
                    None => nanoseconds_once(&uniforms, |u| {
                        bsdf_sample(&scattering, &surface, direction(0.6, 0.0), *u, LOBE_ALL).weight
                    }),
                })
            })?;
            let sample = Repeats(times.pop().unwrap_or_default());
            let forms = FORMS.into_iter().zip(times);
            Ok(forms
                .map(|(form, time)| Row {
                    evaluation: Repeats(time),
                    sample: sample.clone(),
                    ..Row::of(form, *roughness, &surface, &directions, samples)
                })
                .collect())
        })
    }

    fn findings(&self) -> Findings {
        Findings::of(self, CRITERIA)
            .headline(
                "the coupled albedo's greatest difference from 1",
                largest(self, Row::is_the_engines, |row| row.difference().value),
            )
            .note(format!(
                "Exact: albedo 1 at every angle, no difference when the directions change places. Albedos over cosines {COSINES:?} by Sobol' \
                 samples. More than 1 beyond its standard error is light out of nothing. Evaluations in f64 on one thread; the forms that are \
                 no part of the engine evaluate its layer and add their base, and all are sampled by its strategy."
            ))
    }
}
