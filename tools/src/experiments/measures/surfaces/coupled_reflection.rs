//! Matte and specular reflection coupled through the layer's albedo, beside two ways to add them up that are in use.
//!
//! Oracle: a white base under a layer that absorbs nothing scatters exactly all light, and every reflection is reciprocal.

use std::f64::consts::FRAC_1_PI;

use clerestory::Result;
use clerestory::transport::bsdf::{
    Bsdf, BsdfFeatures, LOBE_ALL, LOBE_GLOSSY, LOBE_REFLECTION, bsdf_eval, bsdf_gltf, bsdf_sample,
};
use clerestory::transport::fresnel::fresnel_dielectric;
use clerestory::transport::warp::square_to_cosine_hemisphere;
use glam::DVec3;

use super::energy::{COSINES, Mean, ROUGHNESSES, WHITE, albedo, context as bsdf, direction, mean, numbers};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds;
use crate::experiments::table::Table;
use crate::random::Random;

#[derive(Clone, Copy, PartialEq)]
enum Form {
    Coupled,
    /// Base and layer added, nothing taken from the base.
    Sum,
    /// The base scaled by what Fresnel's factor at the half vector leaves over.
    FresnelMix,
}

const FORMS: [(&str, Form); 3] = [
    ("coupled (engine)", Form::Coupled),
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

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let samples = if context.smoke { 256 } else { 1 << 15 };
    let pairs = if context.smoke { 200 } else { 50_000 };
    let mut table = Table::new(
        "White base under a clear layer of index 1.5, in a white furnace",
        &[
            "roughness",
            "form",
            "least albedo",
            "at cosine",
            "greatest albedo",
            "its standard error",
            "at cosine",
            "reciprocity: worst relative difference",
            "ns an evaluation",
            "ns a sample",
        ],
    );
    for roughness in ROUGHNESSES {
        let surface = bsdf_gltf(&clerestory::transport::bsdf::GltfFactors { roughness, ..WHITE });
        let mut random = Random::new(4);
        let directions: Vec<[DVec3; 2]> = (0..pairs)
            .map(|_| {
                let mut up = || direction(1.0 - random.unit(), 7.0 * random.unit());
                [up(), up()]
            })
            .collect();
        for (name, form) in FORMS {
            let albedos = COSINES.map(|cosine| (white_albedo(form, &surface, cosine, samples), cosine));
            let extreme = |better: fn(f64, f64) -> bool| {
                albedos[1..]
                    .iter()
                    .fold(albedos[0], |a, b| if better(b.0.value, a.0.value) { *b } else { a })
            };
            let (least, greatest) = (extreme(|a, b| a < b), extreme(|a, b| a > b));
            let reciprocity = directions.iter().fold(0.0_f64, |worst, [a, b]| {
                let (there, back) = (value(form, &surface, *a, *b), value(form, &surface, *b, *a));
                worst.max((there - back).abs() / there.abs().max(back.abs()).max(f64::MIN_POSITIVE))
            });
            let evaluation = nanoseconds(context.smoke, &directions, |[a, b]| value(form, &surface, *a, *b));
            let scattering = bsdf(BsdfFeatures::ALL);
            let uniforms: Vec<DVec3> = (0..1024).map(numbers).collect();
            // All forms would be sampled by the engine's strategy.
            let sample = nanoseconds(context.smoke, &uniforms, |u| {
                bsdf_sample(&scattering, &surface, direction(0.6, 0.0), *u, LOBE_ALL).weight
            });
            table.row([
                roughness.into(),
                name.into(),
                least.0.value.into(),
                least.1.into(),
                greatest.0.value.into(),
                greatest.0.error.into(),
                greatest.1.into(),
                reciprocity.into(),
                evaluation.into(),
                sample.into(),
            ]);
        }
    }
    table.note(format!(
        "Exact: albedo 1 at every angle, no difference when the directions change places. Albedos over cosines {COSINES:?} by {samples} Sobol' \
         samples each. More than 1 beyond its standard error is light out of nothing. Evaluations in f64 on one thread; the forms that are no part of the engine \
         evaluate its layer and add their base."
    ));
    Ok(vec![table])
}
