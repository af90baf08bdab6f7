//! Small pictures for measures.

use clerestory::Result;
use clerestory::film::png::Rgb8;
use clerestory::film::z_test::{ZTest, z_test};
use clerestory::film::{Picture, picture};
use clerestory::render::{FrameReport, RenderOptions, Renderer};
use clerestory::srgb::srgb_byte;
use clerestory::techniques::Technique;
use serde_json::json;

/// The picture of a technique at work, once it has so many samples per pixel.
///
/// # Errors
/// Those of rendering.
pub fn finished(technique: &mut impl Technique, samples: u32) -> Result<Picture> {
    while technique.step(samples)?.is_some() {}
    Ok(technique.picture()?.0)
}

/// The mean of all pixels and channels; 0 of none.
///
/// # Errors
/// [`clerestory::Error::Picture`] without a colour layer.
pub fn mean(picture: &Picture) -> Result<f64> {
    Ok(mean_of(picture.main_layer()?.values()))
}

/// The mean of values; 0 of none.
pub fn mean_of(values: &[f32]) -> f64 {
    values.iter().map(|value| f64::from(*value)).sum::<f64>() / values.len().max(1) as f64
}

/// The mean of pictures of one size, value by value; empty of none.
pub fn mean_picture<'a>(pictures: impl IntoIterator<Item = &'a [f32]>) -> Vec<f32> {
    let (mut sums, mut count) = (Vec::new(), 0.0_f64);
    for picture in pictures {
        sums.resize(picture.len(), 0.0_f64);
        for (sum, value) in sums.iter_mut().zip(picture) {
            *sum += f64::from(*value);
        }
        count += 1.0;
    }
    sums.into_iter().map(|sum| (sum / count) as f32).collect()
}

/// A small picture: a color for each pixel, row by row.
pub type Panel = Vec<[u8; 3]>;

/// Light, RGB a pixel, up to what is white.
pub fn light_panel(radiance: &[f32], white: f64) -> Panel {
    let color = |pixel: &[f32; 3]| pixel.map(|value| srgb_byte(f64::from(value) / white));
    radiance.as_chunks::<3>().0.iter().map(color).collect()
}

/// Panels of one size in rows, black where a row has fewer than another, with so many pixels along a side for each of theirs.
pub fn tiled([width, height]: [u32; 2], enlarged: u32, rows: &[Vec<Panel>]) -> Rgb8 {
    let across = rows.iter().map(Vec::len).max().unwrap_or(0);
    let [width_shown, height_shown] = [width * enlarged, height * enlarged];
    let mut bytes = Vec::new();
    for row in rows {
        for y in 0..height_shown {
            for place in 0..across {
                for x in 0..width_shown {
                    let pixel = (y / enlarged * width + x / enlarged) as usize;
                    bytes.extend(row.get(place).map_or([0; 3], |panel| panel[pixel]));
                }
            }
        }
    }
    Rgb8 {
        width: width_shown * across as u32,
        height: height_shown * rows.len() as u32,
        bytes,
    }
}

/// A picture with the variance of its means.
pub struct Image {
    /// RGB a pixel.
    pub radiance: Vec<f32>,
    /// Variance of each mean.
    pub variance: Vec<f32>,
    /// How it came about.
    pub report: FrameReport,
}

/// The false-alarm rate of z-tests over a picture.
const SIGNIFICANCE: f64 = clerestory::film::z_test::SIGNIFICANCE;

impl Image {
    /// Renders with independent samples, so that z-scores are standard normal, after a sample that compiles the kernels.
    ///
    /// # Errors
    /// Those of rendering.
    pub fn render(renderer: &Renderer, size: u32, spp: u32, seed: u32, paths: &str) -> Result<Self> {
        let options = |spp| RenderOptions {
            technique: Some("path".into()),
            size: [size; 2],
            spp,
            seed,
            settings: json!({"sampler": "pcg", "path_set": paths}).into(),
            ..RenderOptions::default()
        };
        renderer.render(&options(1))?;
        let rendered = renderer.render(&options(spp))?;
        Self::of(&rendered.picture, rendered.report)
    }

    fn of(picture: &Picture, report: FrameReport) -> Result<Self> {
        let values = |name| Ok(picture.require(name)?.values().to_vec());
        Ok(Self {
            radiance: values(picture::RADIANCE)?,
            variance: values(picture::VARIANCE)?,
            report,
        })
    }

    /// Mean over all pixels and its standard deviation, of one channel.
    pub fn mean(&self, channel: usize) -> (f64, f64) {
        let of = |values: &[f32]| {
            values
                .iter()
                .skip(channel)
                .step_by(3)
                .map(|v| f64::from(*v))
                .sum::<f64>()
        };
        let pixels = (self.radiance.len() / 3).max(1) as f64;
        (of(&self.radiance) / pixels, of(&self.variance).sqrt() / pixels)
    }

    /// Samples of all pixels together.
    pub fn samples(&self) -> u64 {
        self.report.size.map(u64::from).iter().product::<u64>() * u64::from(self.report.spp)
    }

    /// GPU time of a sample, ns.
    pub fn nanoseconds_per_sample(&self) -> f64 {
        self.report.gpu_seconds * 1e9 / self.samples() as f64
    }

    /// This picture plus another one.
    pub fn add(&mut self, other: &Self) {
        let pairs = |a: &mut [f32], b: &[f32]| a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        pairs(&mut self.radiance, &other.radiance);
        pairs(&mut self.variance, &other.variance);
    }

    /// The z-test of this picture against another.
    ///
    /// # Errors
    /// [`clerestory::Error::Picture`] when the sizes differ.
    pub fn z_test(&self, other: &Self) -> Result<ZTest> {
        z_test(
            &self.radiance,
            &self.variance,
            &other.radiance,
            &other.variance,
            SIGNIFICANCE,
        )
    }

    /// An exact count of the report.
    pub fn count(&self, name: &str) -> u64 {
        self.report.counters.get(name).copied().unwrap_or(0)
    }
}

/// A deviation in units of its standard deviation; 0 where both are 0 up to the rounding of f32.
pub fn z_score(difference: f64, deviation: f64, scale: f64) -> f64 {
    let rounding = clerestory::film::z_test::RELATIVE_DEVIATION_FLOOR * scale.abs();
    difference / deviation.max(rounding).max(f64::MIN_POSITIVE)
}
