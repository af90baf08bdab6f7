//! The film on the device: per pixel the sums of radiance, of its square and of the AOVs, which every technique adds to.
//!
//! Kernels bind it as set 3 (`shaders/film/film_bindings.glsl`) and add in pairs of floats (see [`accumulate`](super::accumulate)),
//! so sums stay exact for millions of samples. Pixels are split into bands, each with buffers of its own, so that no picture's size meets
//! `maxStorageBufferRange`. Deterministic as long as each pixel is added to by one invocation at a time, in order.

use std::sync::OnceLock;

use super::accumulate::TwoFloat;
use super::picture::{ALBEDO, DEPTH, NORMAL, NonFiniteSamples, Picture, RADIANCE, SAMPLES, VARIANCE};
use super::pixel_format::PixelFormat;
use crate::gpu::interface::ComputeShader;
use crate::gpu::shaders::constants::{AOV_ALBEDO, AOV_DEPTH, AOV_NORMAL};
use crate::gpu::shaders::film::{add_frame, display};
use crate::gpu::shaders::sets::FilmSet;
use crate::gpu::shaders::types::{FilmAov, FilmPixel};
use crate::gpu::{
    Access, Buffer, BufferBarrier, BufferDesc, Category, ComputePipeline, Gpu, PipelineInfo, Recorder, Timings,
    rw_compute_to_compute,
};
use crate::{Error, Result};

/// Pixels of one band.
const BAND_PIXELS: u32 = 1 << 20;

/// What one step of accumulation has done.
#[derive(Debug, Clone)]
pub struct Step {
    /// GPU times of its passes.
    pub timings: Vec<Timings>,
    /// Pixel samples finished so far, and wanted in all.
    pub done: u64,
    /// See `done`.
    pub wanted: u64,
}

/// Sums of samples on the device.
#[derive(Debug)]
pub struct GpuFilm {
    gpu: Gpu,
    size: [u32; 2],
    aovs: bool,
    bands: Vec<FilmBand>,
    /// Made when they are first needed.
    display: OnceLock<ComputePipeline<display::Kernel>>,
    add_frame: OnceLock<ComputePipeline<add_frame::Kernel>>,
}

/// Consecutive pixels, by rows from the top, that share buffers.
#[derive(Debug)]
pub struct FilmBand {
    first_pixel: u32,
    pixels: u32,
    sums: Buffer,
    aovs: Buffer,
}

impl GpuFilm {
    /// A cleared film of `size` pixels; `aovs` says whether it also keeps albedo, normal and depth.
    ///
    /// # Errors
    /// [`Error::Setting`] for a size without pixels or with 2³² or more, [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, size: [u32; 2], aovs: bool) -> Result<Self> {
        let pixels = match u32::try_from(u64::from(size[0]) * u64::from(size[1])) {
            Ok(pixels) if pixels > 0 => pixels,
            _ => {
                let value = format!("{}x{}", size[0], size[1]);
                return Err(Error::setting("size", value, "has no pixels, or 2^32 and more"));
            }
        };
        let bands = (0..pixels.div_ceil(BAND_PIXELS))
            .map(|band| {
                let first_pixel = band * BAND_PIXELS;
                FilmBand::new(gpu, first_pixel, (pixels - first_pixel).min(BAND_PIXELS), aovs)
            })
            .collect::<Result<_>>()?;
        let film = Self {
            gpu: gpu.clone(),
            size,
            aovs,
            bands,
            display: OnceLock::new(),
            add_frame: OnceLock::new(),
        };
        film.clear()?;
        Ok(film)
    }

    /// Pixels across and down.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Whether albedo, normal and depth are kept.
    pub fn has_aovs(&self) -> bool {
        self.aovs
    }

    /// The bands, in the order of their pixels.
    pub fn bands(&self) -> &[FilmBand] {
        &self.bands
    }

    /// Forgets all samples.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn clear(&self) -> Result<()> {
        let mut recorder = self.gpu.recorder("film")?;
        self.record_clear(&mut recorder)?;
        recorder.submit()?.wait()?;
        Ok(())
    }

    /// Records what forgets all samples: the pass `film: clear`. Earlier uses must have ended; what adds samples wants a barrier from
    /// [`Access::TRANSFER_WRITE`](crate::gpu::Access::TRANSFER_WRITE) after it.
    ///
    /// # Errors
    /// [`Error::MissingBarrier`] in debug builds.
    pub fn record_clear(&self, recorder: &mut Recorder) -> Result<()> {
        recorder.pass("film: clear", |pass| {
            for band in &self.bands {
                pass.fill(band.sums.view(), 0)?;
                if self.aovs {
                    pass.fill(band.aovs.view(), 0)?;
                }
            }
            Ok(())
        })
    }

    /// Reads the picture: layers `radiance`, `variance` (of the mean), `samples`, and the AOVs that were asked for; with the number of
    /// samples that were left out because they were not finite.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn picture(&self) -> Result<(Picture, NonFiniteSamples)> {
        let mut film = Vec::new();
        let mut aovs: Vec<FilmAov> = Vec::new();
        for band in &self.bands {
            film.extend(self.gpu.read::<FilmPixel>(band.sums.view(), band.pixels as usize)?);
            if self.aovs {
                aovs.extend(self.gpu.read::<FilmAov>(band.aovs.view(), band.pixels as usize)?);
            }
        }
        let mut picture = Picture::new(self.size[0], self.size[1])?;
        picture.add_layer(RADIANCE, 3, film.iter().flat_map(|pixel| statistics(pixel).0).collect())?;
        picture.add_layer(VARIANCE, 3, film.iter().flat_map(|pixel| statistics(pixel).1).collect())?;
        picture.add_layer(SAMPLES, 1, film.iter().map(|pixel| pixel.samples as f32).collect())?;
        if self.aovs {
            let mean = |aov: &FilmAov, i: u32| {
                let i = i as usize;
                let sum = TwoFloat {
                    hi: aov.sum[i].hi,
                    lo: aov.sum[i].lo,
                }
                .to_f64();
                (sum / f64::from(aov.hits.max(1))) as f32
            };
            let layer = |first: u32| {
                aovs.iter()
                    .flat_map(|a| [0, 1, 2].map(|i| mean(a, first + i)))
                    .collect::<Vec<_>>()
            };
            picture.add_layer(ALBEDO, 3, layer(AOV_ALBEDO))?;
            picture.add_layer(NORMAL, 3, layer(AOV_NORMAL))?;
            picture.add_layer(DEPTH, 1, aovs.iter().map(|a| mean(a, AOV_DEPTH)).collect())?;
        }
        let count = |kind: fn(&FilmPixel) -> u32| film.iter().map(|pixel| u64::from(kind(pixel))).sum();
        let left_out = NonFiniteSamples {
            nan: count(|pixel| pixel.nan_samples),
            infinite: count(|pixel| pixel.infinite_samples),
        };
        Ok((picture, left_out))
    }

    /// Records the addition of a picture: to each pixel one sample, `radiance` of which holds three f32 per pixel, rows from the top. What compute
    /// shaders have written there is waited for; afterwards they may write there again, and what was added is visible to them and to copies. Samples with NaNs or infinities are counted by kind and left out.
    ///
    /// # Errors
    /// [`Error::Setting`] when the buffer is too small; [`Error::MissingBarrier`] in debug builds.
    pub fn record_frame(&self, recorder: &mut Recorder, radiance: &Buffer) -> Result<()> {
        let bytes = size_of::<[f32; 3]>() as u64 * u64::from(self.size[0]) * u64::from(self.size[1]);
        if radiance.bytes() < bytes {
            let cause = format!("has {} bytes; the picture needs {bytes}", radiance.bytes());
            return Err(Error::setting("radiance", radiance.name(), cause));
        }
        let kernel = kept(&self.gpu, &self.add_frame)?;
        recorder.pass("film: add frame", |pass| {
            pass.barrier(&[BufferBarrier {
                buffer: radiance,
                from: Access::COMPUTE_WRITE,
                to: Access::COMPUTE_READ,
            }]);
            for band in &self.bands {
                let push = add_frame::Push {
                    first_pixel: band.first_pixel,
                    pixel_count: band.pixels,
                };
                let set = add_frame::Set0 {
                    radiance: radiance.view(),
                };
                pass.dispatch(
                    kernel,
                    &[&set, &band.set()],
                    &push,
                    [kernel.groups_for(band.pixels), 1, 1],
                )?;
            }
            pass.memory_barrier(
                Access::COMPUTE,
                Access::COMPUTE | Access::TRANSFER_WRITE | Access::TRANSFER_READ,
            );
            Ok(())
        })
    }

    /// The kernel that adds pictures, once one was added.
    pub fn pipelines(&self) -> Vec<PipelineInfo> {
        self.add_frame.get().map(ComputePipeline::info).into_iter().collect()
    }

    /// Writes what there is so far to a buffer of four bytes per pixel, rows from the top, on the device: exposed by `exposure` stops, clipped
    /// and sRGB-encoded.
    ///
    /// # Errors
    /// [`Error::Setting`] when the buffer is too small, [`Error::DeviceLost`].
    pub fn display(&self, target: &Buffer, exposure: f32, format: PixelFormat) -> Result<()> {
        let mut recorder = self.gpu.recorder("display")?;
        self.record_display(&mut recorder, target, exposure, format)?;
        recorder.submit()?.wait()?;
        Ok(())
    }

    /// Records what [`GpuFilm::display`] does: the pass `film: display`. The film must have been made visible to compute shaders, and earlier
    /// uses of the target must have ended; after it the target is visible to compute shaders.
    ///
    /// # Errors
    /// As [`GpuFilm::display`]; [`Error::MissingBarrier`] in debug builds.
    pub fn record_display(
        &self,
        recorder: &mut Recorder,
        target: &Buffer,
        exposure: f32,
        format: PixelFormat,
    ) -> Result<()> {
        let bytes = 4 * u64::from(self.size[0]) * u64::from(self.size[1]);
        if target.bytes() < bytes {
            let cause = format!("has {} bytes; the picture needs {bytes}", target.bytes());
            return Err(Error::setting("target", target.name(), cause));
        }
        let kernel = kept(&self.gpu, &self.display)?;
        recorder.pass("film: display", |pass| {
            for band in &self.bands {
                let push = display::Push {
                    first_pixel: band.first_pixel,
                    pixel_count: band.pixels,
                    scale: exposure.exp2(),
                    bgra: format.blue_first(),
                };
                let set = display::Set0 {
                    film_pixels: band.sums.view(),
                    display_pixels: target.view(),
                };
                pass.dispatch(kernel, &[&set], &push, [kernel.groups_for(band.pixels), 1, 1])?;
                pass.barrier(&[rw_compute_to_compute(target)]);
            }
            Ok(())
        })
    }
}

impl FilmBand {
    fn new(gpu: &Gpu, first_pixel: u32, pixels: u32, aovs: bool) -> Result<Self> {
        let buffer = |name: &str, bytes: u64| gpu.buffer(&BufferDesc::storage(name, bytes, Category::Film));
        let aov_bytes = if aovs {
            u64::from(pixels) * size_of::<FilmAov>() as u64
        } else {
            0
        };
        Ok(Self {
            first_pixel,
            pixels,
            sums: buffer("film", u64::from(pixels) * size_of::<FilmPixel>() as u64)?,
            aovs: buffer("film aovs", aov_bytes)?,
        })
    }

    /// The picture's pixel that is the band's first.
    pub fn first_pixel(&self) -> u32 {
        self.first_pixel
    }

    /// Number of pixels.
    pub fn pixels(&self) -> u32 {
        self.pixels
    }

    /// Set 3.
    pub fn set(&self) -> FilmSet<'_> {
        FilmSet {
            film_pixels: self.sums.view(),
            film_aovs: self.aovs.view(),
        }
    }
}

/// The kernel, made now if it was not before.
fn kept<'a, K: ComputeShader<Spec = ()>>(
    gpu: &Gpu,
    place: &'a OnceLock<ComputePipeline<K>>,
) -> Result<&'a ComputePipeline<K>> {
    if let Some(kernel) = place.get() {
        return Ok(kernel);
    }
    let made = gpu.compute_pipeline::<K>(&())?;
    Ok(place.get_or_init(|| made))
}

/// Mean and variance of the mean, per channel; zero for a pixel without samples.
fn statistics(pixel: &FilmPixel) -> ([f32; 3], [f32; 3]) {
    let n = f64::from(pixel.samples);
    let value = |pair: &crate::gpu::shaders::types::TwoFloat| {
        TwoFloat {
            hi: pair.hi,
            lo: pair.lo,
        }
        .to_f64()
    };
    let mean = |c: usize| if n > 0.0 { value(&pixel.sum[c]) / n } else { 0.0 };
    let variance = |c: usize| {
        if n > 1.0 {
            ((value(&pixel.square[c]) / n - mean(c) * mean(c)).max(0.0) / (n - 1.0)) as f32
        } else {
            0.0
        }
    };
    ([0, 1, 2].map(|c| mean(c) as f32), [0, 1, 2].map(variance))
}
