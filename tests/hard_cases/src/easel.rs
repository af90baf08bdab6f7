//! A technique at work on small pictures.

use std::collections::BTreeMap;
use std::sync::Arc;

use clerestory::film::picture::{RADIANCE, SAMPLES, VARIANCE};
use clerestory::gpu::Gpu;
use clerestory::scene::Scene;
use clerestory::settings::Settings;
use clerestory::techniques::{Bias, Card, Technique, View};
use clerestory::transport::GpuScene;
use clerestory::{Error, Result};
use serde_json::Value;

use crate::scenes::SMALL;

/// Seed of all pictures.
const SEED: u32 = 7;
/// What the mean over a picture may be wrong by, relatively, where photons light it, times the square root of their number: five standard deviations of
/// 1 %, which 16,384 of them leave in closed rooms. All pixels share them, so that no variance of pixels tells of it.
const PHOTON_TOLERANCE: f64 = 6.4;
/// The same of techniques with a bias that have no photons.
pub(crate) const OTHER_TOLERANCE: f64 = 0.05;

/// Passes of a picture at most, where all pixels share the noise of one: enough for a variance of their means. Most of the noise is theirs, whatever the samples.
pub(crate) const PASSES: u32 = 12;
/// Samples that a pass may have.
const PASS_SAMPLES_MAX: u32 = 4096;

/// Size of pictures of media of such techniques.
const SIZE_OF_FEW_PIXELS: [u32; 2] = [8, 8];

/// Samples of a picture at most, of techniques with a bias whose every sample is a frame with lights of its own for all pixels: noise is far below their tolerance then.
const FRAMES_MAX: u32 = 96;
/// The same where a frame has hundreds of lights.
const FRAMES_OF_LIGHTS_MAX: u32 = 32;

/// What the mean over a picture may be wrong by where so many photons light it.
pub(crate) fn photon_tolerance(photons: f64) -> f64 {
    PHOTON_TOLERANCE / photons.sqrt()
}

/// A technique with settings on a device.
#[derive(Debug, Clone)]
pub struct Easel<'a> {
    /// The device.
    pub gpu: &'a Gpu,
    /// The technique.
    pub info: &'static Card,
    settings: serde_json::Map<String, Value>,
    seed: u32,
}

/// A finished picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Painted {
    /// RGB a pixel.
    pub radiance: Vec<f32>,
    /// Variance of the means.
    pub variance: Vec<f32>,
    /// Finite samples per pixel.
    pub samples: Vec<f32>,
    /// Samples left out.
    pub non_finite: u64,
    /// Samples per pixel that were asked for.
    pub spp: u32,
    /// Exact counts of work.
    pub counters: BTreeMap<&'static str, u64>,
    /// Relative error that the mean over the picture may have beside what its variance says; above 0 single pixels promise nothing.
    pub tolerance: f64,
    /// Means over the picture in each pass, where all pixels share the noise of one: single pixels promise nothing then, and their variance says nothing of the mean.
    /// Of a picture that was not [painted in passes](Easel::paint_in_passes) there are none, and nothing is allowed to its noise.
    pub passes: Option<Vec<[f64; 3]>>,
}

impl Painted {
    /// Bits of radiance and variance: equal for equal pictures only.
    pub fn bits(&self) -> Vec<u32> {
        let values = self.radiance.iter().chain(&self.variance);
        values.map(|v| v.to_bits()).collect()
    }

    /// Mean over the picture and the variance of that mean, per channel.
    pub fn mean(&self) -> [(f64, f64); 3] {
        let pixels = (self.radiance.len() / 3) as f64;
        let sum = |values: &[f32], c: usize| values.iter().skip(c).step_by(3).map(|v| f64::from(*v)).sum::<f64>();
        [0, 1, 2].map(|c| {
            (
                sum(&self.radiance, c) / pixels,
                sum(&self.variance, c) / (pixels * pixels),
            )
        })
    }
}

impl<'a> Easel<'a> {
    /// A technique with settings that differ from its defaults.
    pub fn new(gpu: &'a Gpu, info: &'static Card, settings: serde_json::Map<String, Value>) -> Self {
        Self {
            gpu,
            info,
            settings,
            seed: SEED,
        }
    }

    /// Whether the technique knows a setting.
    pub fn has(&self, setting: &str) -> bool {
        self.info.settings.has(setting)
    }

    /// The same with another setting, where the technique knows it.
    #[must_use]
    pub fn with(&self, setting: &str, value: impl Into<Value>) -> Self {
        let mut other = self.clone();
        if self.has(setting) {
            other.settings.insert(setting.into(), value.into());
        }
        other
    }

    /// A setting that differs from the technique's default, where it is a word.
    pub fn chosen_word(&self, setting: &str) -> Option<&str> {
        self.settings.get(setting).and_then(Value::as_str)
    }

    /// Size of pictures of media whose means alone are judged: of a few pixels where all share the noise of a pass, and each would ask all of its lights.
    ///
    /// # Errors
    /// Those of settings that cannot be read.
    pub fn size_in_media(&self) -> Result<[u32; 2]> {
        let shares_noise = self.pass_samples()?.is_some();
        Ok(if shares_noise { SIZE_OF_FEW_PIXELS } else { SMALL })
    }

    /// For scenes whose paths lose half of their light at each bounce: without the rare bright samples of early Russian roulette the
    /// means of few samples are near enough to normal for tests of single pixels.
    #[must_use]
    pub fn calm(&self) -> Self {
        self.with("roulette_start", 12)
    }

    /// The same with other random numbers.
    #[must_use]
    pub fn other_seed(&self) -> Self {
        Self {
            seed: self.seed + 92,
            ..self.clone()
        }
    }

    /// Samples of a pass, where the technique has no bias and all pixels share the noise of a pass: means over pictures are judged by those of their passes then.
    pub(crate) fn pass_samples(&self) -> Result<Option<u32>> {
        let law = (self.info.foresight.law)(&self.settings())?;
        Ok((law.shares_noise && !self.has_bias()).then_some(law.samples_a_pass))
    }

    /// As many of the samples as tell what is judged.
    fn enough(&self, spp: u32) -> Result<u32> {
        let law = (self.info.foresight.law)(&self.settings())?;
        let are_frames = law.shares_noise && self.has_bias() && !self.has("photons");
        Ok(match are_frames {
            true if self.has("lights") => spp.min(FRAMES_OF_LIGHTS_MAX),
            true => spp.min(FRAMES_MAX),
            false => spp,
        })
    }

    fn settings(&self) -> Settings {
        Value::Object(self.settings.clone()).into()
    }

    /// Checks and uploads a scene.
    ///
    /// # Errors
    /// As [`GpuScene::new`].
    pub fn upload(&self, scene: &Scene) -> Result<Arc<GpuScene>> {
        GpuScene::new(self.gpu, scene).map(Arc::new)
    }

    /// Prepares the technique for the scene's first camera.
    ///
    /// # Errors
    /// As [`Easel::upload`] and [`Card::prepare`].
    pub fn prepare(&self, scene: &Scene, size: [u32; 2]) -> Result<Box<dyn Technique>> {
        self.prepare_uploaded(self.upload(scene)?, scene, size)
    }

    /// As [`Easel::prepare`], with the scene on the device.
    ///
    /// # Errors
    /// As [`Card::prepare`].
    pub fn prepare_uploaded(
        &self,
        uploaded: Arc<GpuScene>,
        scene: &Scene,
        size: [u32; 2],
    ) -> Result<Box<dyn Technique>> {
        let view = View {
            camera: scene.require_camera(None)?,
            size,
            seed: self.seed,
            aovs: false,
        };
        self.info.prepare(self.gpu, uploaded, &view, &self.settings())
    }

    /// Renders a picture through the scene's first camera, whose values have no noise or are not judged. Where all pixels share the noise of a pass, it is one pass.
    ///
    /// # Errors
    /// As [`Easel::prepare`] and [`Technique::step`].
    pub fn paint(&self, scene: &Scene, size: [u32; 2], spp: u32) -> Result<Painted> {
        let shared = self
            .pass_samples()?
            .map(|_| self.with("samples_per_pass", spp.min(PASS_SAMPLES_MAX)));
        let easel = shared.as_ref().unwrap_or(self);
        let painted = finish(easel.prepare(scene, size)?.as_mut(), self.enough(spp)?)?;
        Ok(Painted {
            tolerance: self.tolerance(spp),
            passes: shared.is_some().then(Vec::new),
            ..painted
        })
    }

    /// As [`paint`](Self::paint), for pictures whose means are judged: in several passes, where all pixels share the noise of one.
    ///
    /// # Errors
    /// As [`paint`](Self::paint).
    pub fn paint_in_passes(&self, scene: &Scene, size: [u32; 2], spp: u32) -> Result<Painted> {
        self.finish(self.prepare(scene, size)?.as_mut(), spp)
    }

    /// Renders what was prepared to the end, or to that of its [`PASSES`] where pixels share the noise of each, and reads the picture.
    pub(crate) fn finish(&self, technique: &mut dyn Technique, spp: u32) -> Result<Painted> {
        let (tolerance, spp) = (self.tolerance(spp), self.enough(spp)?);
        let Some(each) = self.pass_samples()? else {
            let painted = finish(technique, spp)?;
            return Ok(Painted { tolerance, ..painted });
        };
        let most = spp.min(each.saturating_mul(PASSES));
        let mut passes = Vec::new();
        let (mut before, mut sums) = (0u32, [0.0; 3]);
        loop {
            let now = before.saturating_add(each).min(most);
            let painted = finish(technique, now)?;
            let sums_now = painted.mean().map(|(mean, _)| mean * f64::from(now));
            passes.push([0, 1, 2].map(|c| (sums_now[c] - sums[c]) / f64::from(now - before)));
            (before, sums) = (now, sums_now);
            if now == most {
                return Ok(Painted {
                    tolerance,
                    passes: Some(passes),
                    ..painted
                });
            }
        }
    }

    /// Whether pixels share the noise of a pass.
    pub fn shares_noise(&self) -> Result<bool> {
        shares_noise(self.info, &self.settings())
    }

    /// Whether its pictures have a bias.
    pub fn has_bias(&self) -> bool {
        !matches!(self.info.bias, Bias::Unbiased)
    }

    /// What means over its pictures of so many samples may be wrong by, relatively, beside what their variance says: [`Painted::tolerance`].
    pub fn tolerance(&self, spp: u32) -> f64 {
        let number = |name: &str| self.settings.get(name).and_then(Value::as_f64);
        if !self.has_bias() {
            return 0.0;
        }
        number("photons").map_or(OTHER_TOLERANCE, |photons| {
            let passes = (f64::from(spp) / number("samples_per_pass").unwrap_or(1.0)).ceil();
            photon_tolerance(photons * passes.max(1.0))
        })
    }
}

/// Renders to the end and reads the picture.
///
/// # Errors
/// As [`Technique::step`] and [`Technique::picture`].
pub fn finish(technique: &mut dyn Technique, spp: u32) -> Result<Painted> {
    while technique.step(spp)?.is_some_and(|step| step.done < step.wanted) {}
    let (picture, non_finite) = technique.picture()?;
    let layer = |name: &str| {
        let missing = || Error::Picture {
            path: "picture".into(),
            cause: format!("has no layer {name:?}"),
        };
        picture
            .layer(name)
            .map(|layer| layer.values().to_vec())
            .ok_or_else(missing)
    };
    Ok(Painted {
        radiance: layer(RADIANCE)?,
        variance: layer(VARIANCE)?,
        samples: layer(SAMPLES)?,
        non_finite: non_finite.total(),
        spp,
        counters: technique.counters(),
        tolerance: 0.0,
        passes: None,
    })
}

/// Whether all pixels share the noise of a pass of a technique's.
pub(crate) fn shares_noise(info: &Card, settings: &Settings) -> Result<bool> {
    Ok((info.foresight.law)(settings)?.shares_noise)
}
