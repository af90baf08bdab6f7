//! Waves: which pixels and samples are under way together.
//!
//! The split into waves never reaches the picture: each path depends on (seed, pixel, sample) alone, and samples are added to their pixel
//! in order.

use crate::film::GpuFilm;
use crate::gpu::shaders::constants::WALK_GROUP;
use crate::walk::{SLOTS_MAX, WalkKey};

/// Most samples of a pixel in one wave: the resolve stage loops over them, eight iterations each with all layers, which must stay below
/// [`SOFTWARE_LOOP_CAP`](crate::gpu::SOFTWARE_LOOP_CAP).
pub(crate) const SAMPLES_PER_WAVE: u32 = 4096;
/// Slots for each pixel of a picture, of which [`SAMPLES_PER_WAVE`] fill a wave where pixels are few.
const SLOTS_PER_PIXEL: u32 = 1024;
/// Samples of a pixel that are best under way together, in neighbouring lanes.
pub(super) const SAMPLES_TOGETHER: u32 = 8;

/// One wave: consecutive pixels of a band × consecutive samples, or consecutive places of a round of adaptive samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wave {
    pub band: usize,
    pub first_pixel: u32,
    pub pixels: u32,
    pub first_sample: u32,
    pub samples: u32,
    /// Of adaptive samples: its places in the round of the band, which pixels share.
    pub places: Option<Places>,
}

/// Consecutive places of a band's round.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Places {
    pub first: u32,
    pub count: u32,
}

/// Where the next wave begins.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cursor {
    pub band: usize,
    /// Pixels of the band that are done, or places of its round.
    pub in_band: u32,
    pub sample: u32,
    /// Samples of each pixel in the waves of this pass over the picture.
    pub samples: u32,
    pub done: u64,
}

impl Wave {
    /// Its paths.
    pub fn paths(&self) -> u32 {
        self.places.map_or(self.pixels * self.samples, |places| places.count)
    }

    /// What their random numbers are keyed by.
    pub fn key(&self, seed: u32) -> WalkKey {
        WalkKey {
            first_sequence: self.first_pixel,
            first_index: self.first_sample,
            indices: self.samples,
            seed,
        }
    }
}

impl Cursor {
    /// The next wave of at most `slots` paths towards `samples` samples per pixel, and where the one after it begins.
    pub fn next_wave(&self, film: &GpuFilm, slots: u32, samples: u32) -> Option<(Wave, Self)> {
        let mut c = *self;
        if c.sample >= samples {
            return None;
        }
        let bands = film.bands();
        let band = &bands[c.band];
        if c.band == 0 && c.in_band == 0 {
            // As many as fit with the whole picture, else as many as there are already, so that a picture is complete early.
            c.samples = samples_of_pass(film, slots, c.sample).min(samples - c.sample);
        }
        let pixels = (band.pixels() - c.in_band).min(slots / c.samples);
        let wave = Wave {
            band: c.band,
            first_pixel: band.first_pixel() + c.in_band,
            pixels,
            first_sample: c.sample,
            samples: c.samples,
            places: None,
        };
        c.in_band += pixels;
        if c.in_band == band.pixels() {
            c.in_band = 0;
            c.band += 1;
        }
        if c.band == bands.len() {
            c.band = 0;
            c.sample += c.samples;
        }
        c.done += u64::from(pixels) * u64::from(wave.samples);
        Some((wave, c))
    }
}

/// Samples of each pixel in a pass over the picture that is begun where pixels have `taken`.
pub(super) fn samples_of_pass(film: &GpuFilm, slots: u32, taken: u32) -> u32 {
    let whole = match film.bands() {
        [band] => slots / band.pixels(),
        _ => 0,
    };
    whole.max(taken.clamp(1, SAMPLES_TOGETHER)).min(SAMPLES_PER_WAVE)
}

/// Slots that waves of a picture can fill, in whole workgroups.
pub(super) fn slots_of_picture([width, height]: [u32; 2]) -> u32 {
    let paths = u64::from(width) * u64::from(height) * u64::from(SLOTS_PER_PIXEL);
    let paths = paths.max(SAMPLES_PER_WAVE.into());
    paths.next_multiple_of(u64::from(WALK_GROUP)).min(u64::from(SLOTS_MAX)) as u32
}
