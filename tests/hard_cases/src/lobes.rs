//! The scattering functions in f64, by kind.

use clerestory::scene::{Material, metals};
use clerestory::transport::albedo::AlbedoTable;
use clerestory::transport::bsdf::{
    BSDF_IMPORTANCE, Bsdf, BsdfContext, BsdfFeatures, LOBE_ALL, LOBE_SPECULAR, bsdf_eval_pdf, bsdf_sample,
};
use clerestory::transport::random::{Sampler, SamplerKind, sample_1d, sample_2d};
use glam::{DVec3, Vec3};

use crate::Judgement;
use crate::judgement::Z_MAX;

/// A kind of scattering.
#[derive(Debug, Clone, Copy)]
pub struct Lobe {
    /// Its name.
    pub name: &'static str,
    /// A white material of a given perceptual roughness that has it.
    pub material: fn(f32) -> Material,
    /// Nothing is lost in it at the roughness `r`, so that a white one gives back all light.
    pub lossless: fn(f32) -> bool,
}

impl Lobe {
    /// What a white one of this roughness may lose; `None` for what is not lossless.
    pub fn loss(&self, roughness: f32) -> Option<f64> {
        (self.lossless)(roughness).then_some(TABLE_LOSS)
    }
}

/// Every kind of scattering.
pub const LOBES: &[Lobe] = &[
    Lobe {
        name: "lambert",
        material: |roughness| Material {
            roughness,
            ..Material::lambert("lambert", Vec3::ONE)
        },
        lossless: |_| true,
    },
    Lobe {
        name: "coated",
        material: |roughness| Material {
            metallic: 0.0,
            roughness,
            ..Material::default()
        },
        lossless: |_| true,
    },
    Lobe {
        name: "metal",
        material: |roughness| Material {
            roughness,
            ..Material::default()
        },
        lossless: |_| true,
    },
    Lobe {
        name: "gold",
        material: |roughness| Material {
            roughness,
            conductor: metals::by_name("gold"),
            ..Material::default()
        },
        lossless: |_| false,
    },
    Lobe {
        name: "thin wall",
        material: |roughness| Material {
            roughness,
            thickness: 0.0,
            ..Material::glass("thin wall", 1.5)
        },
        lossless: |roughness| roughness == 0.0,
    },
    Lobe {
        name: "glass",
        material: |roughness| Material {
            roughness,
            ..Material::glass("glass", 1.5)
        },
        lossless: |roughness| roughness == 0.0,
    },
];

/// Most that the albedo table's interpolation gains and loses, relative (transport/bsdf/tests.rs).
pub const TABLE_GAIN: f64 = 5e-3;
/// See [`TABLE_GAIN`].
pub const TABLE_LOSS: f64 = 9e-3;

/// Samples of a direction.
struct Sampled {
    /// Mean weight.
    mean: DVec3,
    /// Its standard error, as if samples were independent: Sobol' points err less, so this is to the safe side.
    deviation: f64,
    /// Samples that are not finite, negative or of a direction that is none.
    broken: usize,
    /// Samples whose density or value is not the one that is evaluated for their direction.
    unequal: usize,
}

fn sample(material: &Material, cosine: f64, features: BsdfFeatures) -> Sampled {
    const SAMPLES: u32 = 1 << 10;
    let context = BsdfContext {
        features,
        table: AlbedoTable::shared(),
    };
    let bsdf = Bsdf::from_material(material);
    // Of particles refraction conserves the flux.
    let bsdf = Bsdf {
        flags: bsdf.flags | BSDF_IMPORTANCE,
        ..bsdf
    };
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let wo = DVec3::new(sine * 0.8, sine * 0.6, cosine);
    let (mut sum, mut squares) = (DVec3::ZERO, 0.0);
    let (mut broken, mut unequal) = (0, 0);
    for sample_index in 0..SAMPLES {
        let mut sampler = Sampler {
            pixel: 5,
            sample_index,
            dimension: 0,
            seed: 11,
        };
        let pair = sample_2d(&mut sampler, SamplerKind::Sobol);
        let u = pair.extend(sample_1d(&mut sampler, SamplerKind::Sobol));
        let sample = bsdf_sample(&context, &bsdf, wo, u, LOBE_ALL);
        if sample.flags == 0 {
            continue;
        }
        let sound = sample.weight.is_finite()
            && sample.weight.min_element() >= 0.0
            && sample.pdf >= 0.0
            && sample.pdf.is_finite()
            && (sample.wi.length() - 1.0).abs() < 1e-9;
        broken += usize::from(!sound);
        sum += sample.weight;
        squares += sample.weight.length_squared() / 3.0;
        if sample.flags & LOBE_SPECULAR == 0 {
            let (value, pdf) = bsdf_eval_pdf(&context, &bsdf, wo, sample.wi, LOBE_ALL);
            let same = (pdf - sample.pdf).abs() <= 1e-9 * pdf
                && (value - sample.weight * sample.pdf).abs().max_element() <= 1e-9 * value.max_element();
            unequal += usize::from(!same);
        }
    }
    let n = f64::from(SAMPLES);
    let mean = sum / n;
    let variance = (squares / n - mean.length_squared() / 3.0).max(0.0);
    Sampled {
        mean,
        deviation: (variance / n).sqrt(),
        broken,
        unequal,
    }
}

/// What a white material loses at a cosine without compensation for scattering among microfacets.
pub fn single_scattering_loss(material: &Material, cosine: f64) -> f64 {
    let features = BsdfFeatures {
        multiple_scattering: false,
        ..BsdfFeatures::ALL
    };
    1.0 - sample(material, cosine, features).mean.min_element()
}

/// Judges a material seen at a cosine: all values finite and not negative, density and value of samples equal to those evaluated, at most
/// as much light as came; and where nothing should be lost, no less than the table's error, or than the given documented loss.
pub fn judge(what: &str, material: &Material, cosine: f64, loss: Option<f64>, judgement: &mut Judgement) {
    let sampled = sample(material, cosine, BsdfFeatures::ALL);
    let noise = Z_MAX * sampled.deviation;
    let what = format!("{what}, cos {cosine}");
    judgement.none(format!("{what}: samples not finite or negative"), sampled.broken);
    judgement.none(format!("{what}: samples whose density is another one"), sampled.unequal);
    let gain = sampled.mean.max_element() - 1.0;
    judgement.at_most(format!("{what}: gain"), gain, TABLE_GAIN + noise);
    if let Some(documented) = loss {
        let loss = 1.0 - sampled.mean.min_element();
        judgement.at_most_documented(format!("{what}: loss"), loss, TABLE_LOSS + noise, documented + noise);
    }
}
