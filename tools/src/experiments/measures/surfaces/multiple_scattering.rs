//! What rough metals lose when light that scatters among microfacets is left out, and what the compensation gives back.
//!
//! Oracle: a metal that reflects everything scatters exactly all light.

use clerestory::Result;
use clerestory::transport::bsdf::{BsdfFeatures, GltfFactors, LOBE_ALL, bsdf_eval, bsdf_gltf};
use glam::DVec3;

use super::energy::{COSINES, ROUGHNESSES, WHITE, albedo, context as bsdf, direction};
use crate::experiments::measures::Context;
use crate::experiments::measures::clock::nanoseconds;
use crate::experiments::table::Table;
use crate::random::Random;

/// The measure.
pub fn measure(context: &Context<'_>) -> Result<Vec<Table>> {
    let samples = if context.smoke { 256 } else { 1 << 17 };
    let evaluations = if context.smoke { 200 } else { 20_000 };
    let mut table = Table::new(
        "Perfectly reflecting metal in a white furnace: albedo − 1",
        &[
            "roughness",
            "cosine",
            "single scattering",
            "with compensation",
            "its standard error",
            "share of the loss given back",
        ],
    );
    let mut speed = Table::new("Cost of the compensation", &["form", "ns an evaluation"]);
    let single = BsdfFeatures {
        multiple_scattering: false,
        ..BsdfFeatures::ALL
    };
    for roughness in ROUGHNESSES {
        let metal = bsdf_gltf(&GltfFactors {
            metallic: 1.0,
            roughness,
            ..WHITE
        });
        for cosine in COSINES {
            let seen = |features| albedo(&bsdf(features), &metal, cosine, LOBE_ALL, samples);
            let (single, compensated) = (seen(single), seen(BsdfFeatures::ALL));
            let (without, with) = (single.value - 1.0, compensated.value - 1.0);
            table.row([
                roughness.into(),
                cosine.into(),
                without.into(),
                with.into(),
                compensated.error.into(),
                (1.0 - with / without).into(),
            ]);
        }
    }
    table.note(format!(
        "{samples} Sobol' samples each. Above 0 by more than its standard error would be light out of nothing."
    ));
    let metal = bsdf_gltf(&GltfFactors { metallic: 1.0, ..WHITE });
    let mut random = Random::new(5);
    let directions: Vec<[DVec3; 2]> = (0..evaluations)
        .map(|_| {
            let mut up = || direction(1.0 - random.unit(), 7.0 * random.unit());
            [up(), up()]
        })
        .collect();
    for (name, features) in [("single scattering", single), ("with compensation", BsdfFeatures::ALL)] {
        let scattering = bsdf(features);
        let time = nanoseconds(context.smoke, &directions, |[wo, wi]| {
            bsdf_eval(&scattering, &metal, *wo, *wi, LOBE_ALL)
        });
        speed.row([name.into(), time.into()]);
    }
    speed.note("In f64 on one thread, the other lobes compiled in.");
    Ok(vec![table, speed])
}
