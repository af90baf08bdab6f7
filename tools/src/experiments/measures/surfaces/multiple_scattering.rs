//! What rough metals lose when light that scatters among microfacets is left out, and what the compensation gives back.
//!
//! Oracle: a metal that reflects everything scatters exactly all light.

use clerestory::Result;
use clerestory::transport::bsdf::{BsdfFeatures, GltfFactors, LOBE_ALL, bsdf_eval, bsdf_gltf};
use glam::DVec3;

use super::energy::{BY_CHANCE, COSINES, ERRORS_OF_42, ROUGHNESSES, WHITE, albedo, context as bsdf, direction};
use crate::experiments::findings::{Bound, Criterion, Findings, Measured, Repeats, Study, largest, rows};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds_once;
use crate::random::Random;

const SINGLE: BsdfFeatures = BsdfFeatures {
    multiple_scattering: false,
    ..BsdfFeatures::ALL
};

const FORMS: [(&str, BsdfFeatures); 2] = [("single scattering", SINGLE), ("with compensation", BsdfFeatures::ALL)];

rows! {
    /// A metal of a roughness, seen at a cosine.
    struct Row = "Perfectly reflecting metal in a white furnace: albedo − 1" by [roughness, cosine] {
        roughness: f64 = "roughness",
        cosine: f64 = "cosine",
        single: f64 = "single scattering",
        compensated: f64 = "with compensation",
        error: f64 = "its standard error",
        given_back: Option<f64> = "share of the loss given back",
        samples: u64 = "samples",
    }
}

rows! {
    /// A form of the scattering function.
    struct Cost = "Cost of the compensation" by [form] {
        form: String = "form",
        time: Repeats = "an evaluation (ns)",
    }
}

/// What was found.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Found {
    albedos: Vec<Row>,
    costs: Vec<Cost>,
}

const CRITERIA: &[Criterion<Row>] = &[
    Criterion::each(
        "the albedo is 1 with the compensation: albedo − 1",
        Bound::Between(-0.01, 0.01),
        |row: &Row| Measured::within(row.compensated, ERRORS_OF_42 * row.error),
    )
    .because("half of what an eye sees, within 4.44 standard errors"),
    Criterion::each(
        "it is never above 1: albedo − 1 less 4.44 standard errors",
        Bound::AtMost(0.0),
        |row: &Row| (row.compensated - ERRORS_OF_42 * row.error).into(),
    )
    .because(BY_CHANCE),
];

impl Study for Found {
    fn measure(context: &Context<'_>) -> Result<Self> {
        let samples = context.pick(1 << 17, 256);
        let name = |roughness: &f64| format!("roughness {roughness}");
        let albedos = context.each(&ROUGHNESSES, name, |roughness| Ok(albedos(*roughness, samples)))?;
        Ok(Self {
            albedos,
            costs: costs(context)?,
        })
    }

    fn findings(&self) -> Findings {
        Findings::of(&self.albedos, CRITERIA)
            .headline(
                "the compensated albedo's greatest difference from 1",
                largest(&self.albedos, |_| true, |row| row.compensated.abs()),
            )
            .note("Sobol' samples. Above 0 by more than its standard error would be light out of nothing.")
            .and(Findings::of(&self.costs, &[]))
            .note("In f64 on one thread, the other lobes compiled in.")
    }
}

/// Albedos of a roughness at all cosines.
fn albedos(roughness: f64, samples: u32) -> Vec<Row> {
    let metal = bsdf_gltf(&GltfFactors {
        metallic: 1.0,
        roughness,
        ..WHITE
    });
    let of = |cosine| {
        let seen = |features| albedo(&bsdf(features), &metal, cosine, LOBE_ALL, samples);
        let (without, with) = (seen(SINGLE), seen(BsdfFeatures::ALL));
        let (single, compensated) = (without.value - 1.0, with.value - 1.0);
        Row {
            roughness,
            cosine,
            single,
            compensated,
            error: with.error,
            given_back: (single != 0.0).then(|| 1.0 - compensated / single),
            samples: samples.into(),
        }
    };
    COSINES.map(of).to_vec()
}

/// Times of both forms.
fn costs(context: &Context<'_>) -> Result<Vec<Cost>> {
    let evaluations = context.pick(20_000, 200);
    let metal = bsdf_gltf(&GltfFactors { metallic: 1.0, ..WHITE });
    let mut random = Random::new(5);
    let directions: Vec<[DVec3; 2]> = (0..evaluations)
        .map(|_| {
            let mut up = || direction(1.0 - random.unit(), 7.0 * random.unit());
            [up(), up()]
        })
        .collect();
    let times = context.in_turns(9, FORMS.len(), |i| {
        let scattering = bsdf(FORMS[i].1);
        Ok(nanoseconds_once(&directions, |[wo, wi]| {
            bsdf_eval(&scattering, &metal, *wo, *wi, LOBE_ALL)
        }))
    })?;
    let forms = FORMS.into_iter().zip(times);
    Ok(forms
        .map(|((form, _), time)| Cost {
            form: form.into(),
            time: Repeats(time),
        })
        .collect())
}
