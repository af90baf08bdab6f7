//! Albedos of the scattering function, for the measures of energy.

use clerestory::transport::albedo::AlbedoTable;
use clerestory::transport::bsdf::{Bsdf, BsdfContext, BsdfFeatures, GltfFactors, bsdf_sample};
use clerestory::transport::random::{Sampler, SamplerKind, sample_1d, sample_2d};
use glam::DVec3;

/// A white, opaque coated surface.
pub const WHITE: GltfFactors = GltfFactors {
    base_color: DVec3::ONE,
    metallic: 0.0,
    roughness: 0.5,
    transmission: 0.0,
    ior: 1.5,
    specular: 1.0,
    specular_color: DVec3::ONE,
    thickness: 0.0,
};

/// Cosines of the angles to look from, grazing ones included.
pub const COSINES: [f64; 7] = [1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 0.02];
/// Perceptual roughnesses.
pub const ROUGHNESSES: [f64; 6] = [0.1, 0.2, 0.4, 0.6, 0.8, 1.0];

/// The scattering function with the given features.
pub fn context(features: BsdfFeatures) -> BsdfContext<'static> {
    BsdfContext {
        features,
        table: AlbedoTable::shared(),
    }
}

/// The direction of a cosine and an azimuth.
pub fn direction(cos_theta: f64, phi: f64) -> DVec3 {
    let sine = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
    DVec3::new(sine * phi.cos(), sine * phi.sin(), cos_theta)
}

/// Sobol' numbers of one sample of the sequence of that seed.
pub fn numbers_of(seed: u32, sample_index: u32) -> DVec3 {
    let mut sampler = Sampler {
        pixel: 1,
        sample_index,
        dimension: 0,
        seed,
    };
    let pair = sample_2d(&mut sampler, SamplerKind::Sobol);
    pair.extend(sample_1d(&mut sampler, SamplerKind::Sobol))
}

/// Sobol' numbers of one sample.
pub fn numbers(sample_index: u32) -> DVec3 {
    numbers_of(1, sample_index)
}

/// Independent sequences of a mean; their spread gives its error.
const SEQUENCES: u32 = 16;

/// Standard errors of [`mean`]s that the greatest of 42 exceeds once in a hundred runs, by Student's t and Šidák.
pub const ERRORS_OF_42: f64 = 4.44;
/// Where a bound by them is from.
pub const BY_CHANCE: &str = "chance exceeds it once in a hundred runs of 42 albedos, by Student's t and Šidák";

/// A mean of samples and its standard error.
#[derive(Debug, Clone, Copy)]
pub struct Mean {
    /// The mean.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

/// Mean of a function of Sobol' numbers, over `samples` of them in all, at least one a sequence.
pub fn mean(samples: u32, function: impl Fn(DVec3) -> f64) -> Mean {
    let each = (samples / SEQUENCES).max(1);
    let means: Vec<f64> = (1..=SEQUENCES)
        .map(|seed| (0..each).map(|i| function(numbers_of(seed, i))).sum::<f64>() / f64::from(each))
        .collect();
    let count = f64::from(SEQUENCES);
    let value = means.iter().sum::<f64>() / count;
    let spread = means.iter().map(|m| (m - value) * (m - value)).sum::<f64>() / (count - 1.0);
    Mean {
        value,
        error: (spread / count).sqrt(),
    }
}

/// The share of light that a surface seen at a cosine scatters: mean weight of samples.
pub fn albedo(context: &BsdfContext<'_>, surface: &Bsdf, cos_theta: f64, mask: u32, samples: u32) -> Mean {
    let wo = direction(cos_theta, 0.0);
    mean(samples, |u| {
        let sample = bsdf_sample(context, surface, wo, u, mask);
        if sample.flags == 0 { 0.0 } else { sample.weight.x }
    })
}
