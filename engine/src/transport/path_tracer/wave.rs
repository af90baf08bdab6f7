//! Waves: which pixels and samples are under way together, and their working memory.
//!
//! The split into waves never reaches the picture: each path depends on (seed, pixel, sample) alone, and samples are added to their pixel
//! in order.

use super::settings::SLOTS_MAX;
use crate::Result;
use crate::film::GpuFilm;
use crate::gpu::shaders::constants::{COMPACT_CHUNK, PATH_GROUP};
use crate::gpu::shaders::sets::PathBuffers;
use crate::gpu::shaders::transport::path_camera;
use crate::gpu::shaders::types::{Hit, PathAov, PathState, Ray, ShadowRay};
use crate::gpu::{Buffer, BufferDesc, Category, Gpu};

/// Samples of a pixel in one wave: the resolve stage loops over them, and software drivers silently end a kernel's loops after 65,535
/// iterations in all.
const SAMPLES_A_WAVE: u32 = 1024;

/// One wave: consecutive pixels of a band × consecutive samples.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wave {
    pub band: usize,
    pub first_pixel: u32,
    pub pixels: u32,
    pub first_sample: u32,
    pub samples: u32,
}

/// Where the next wave begins.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cursor {
    pub band: usize,
    pub pixel_in_band: u32,
    pub sample: u32,
    pub done: u64,
}

/// The head of the working memory: indirect arguments and counters.
pub(super) type Status = path_camera::PathStatusBlock;

/// Working memory of a wave.
pub(super) struct WaveBuffers {
    pub status: Buffer,
    pub queues: [Buffer; 2],
    pub rays: Buffer,
    pub states: Buffer,
    pub hits: Buffer,
    pub shadow: Buffer,
    pub flags: Buffer,
    pub resume: Buffer,
    pub chunks: Buffer,
    pub aovs: Buffer,
    pub readback: Buffer,
}

impl Cursor {
    /// The next wave of at most `slots` paths towards `samples` samples a pixel, and where the one after it begins.
    pub fn next_wave(&self, film: &GpuFilm, slots: u32, samples: u32) -> Option<(Wave, Self)> {
        let mut c = *self;
        if c.sample >= samples {
            return None;
        }
        let bands = film.bands();
        let band = &bands[c.band];
        let pixels = (band.pixels() - c.pixel_in_band).min(slots);
        // Several samples of a pixel share a wave only where all of the picture fits.
        let whole = bands.len() == 1 && pixels == band.pixels();
        let wave_samples = if whole {
            (slots / pixels).clamp(1, SAMPLES_A_WAVE).min(samples - c.sample)
        } else {
            1
        };
        let wave = Wave {
            band: c.band,
            first_pixel: band.first_pixel() + c.pixel_in_band,
            pixels,
            first_sample: c.sample,
            samples: wave_samples,
        };
        c.pixel_in_band += pixels;
        if c.pixel_in_band == band.pixels() {
            c.pixel_in_band = 0;
            c.band += 1;
        }
        if c.band == bands.len() {
            c.band = 0;
            c.sample += wave_samples;
        }
        c.done += u64::from(pixels) * u64::from(wave_samples);
        Some((wave, c))
    }
}

/// Slots that one dispatch reaches and whose largest buffer can be bound, in whole workgroups.
pub(super) fn slots_of_device(gpu: &Gpu) -> u32 {
    let slot_bytes = size_of::<PathState>().max(size_of::<ShadowRay>()) as u64;
    let by_range = gpu.caps().max_storage_buffer_range / slot_bytes;
    let by_groups = u64::from(gpu.caps().max_workgroups) * u64::from(PATH_GROUP);
    let slots = by_range.min(by_groups).min(u64::from(SLOTS_MAX)) as u32;
    slots - slots % PATH_GROUP
}

/// Indirect arguments of stages with one invocation a place, and a chunk, of a queue.
pub(super) fn group_counts(places: u32) -> [[u32; 3]; 2] {
    [places, places.div_ceil(COMPACT_CHUNK)].map(|count| [count.div_ceil(PATH_GROUP), 1, 1])
}

impl WaveBuffers {
    pub fn new(gpu: &Gpu, slots: u32, aovs: bool) -> Result<Self> {
        let work = |name: &str, bytes: usize, count: u32| {
            gpu.buffer(&BufferDesc::storage(
                name,
                bytes as u64 * u64::from(count),
                Category::Work,
            ))
        };
        let word = size_of::<u32>();
        let chunks = slots.div_ceil(COMPACT_CHUNK);
        Ok(Self {
            status: work("path status", size_of::<Status>(), 1)?,
            queues: [work("path queue a", word, slots)?, work("path queue b", word, slots)?],
            rays: work("path rays", size_of::<Ray>(), slots)?,
            states: work("path states", size_of::<PathState>(), slots)?,
            hits: work("path hits", size_of::<Hit>(), slots)?,
            shadow: work("path shadow rays", size_of::<ShadowRay>(), slots)?,
            flags: work("path flags", word, slots)?,
            // One word for the extend and one for the shadow stage.
            resume: work("path resume", 2 * word, slots)?,
            // Of each chunk the paths that are alive and the shadow rays.
            chunks: work("path chunks", 2 * word, chunks)?,
            aovs: work("path aovs", size_of::<PathAov>(), if aovs { slots } else { 0 })?,
            readback: gpu.buffer(&BufferDesc::readback(
                "path status readback",
                size_of::<Status>() as u64,
            ))?,
        })
    }

    /// Set 0 with the queues in the roles of a bounce of this parity.
    pub fn set(&self, parity: usize) -> PathBuffers<'_> {
        PathBuffers {
            status: self.status.view(),
            path_queue_in: self.queues[parity].view(),
            path_queue_out: self.queues[1 - parity].view(),
            path_rays: self.rays.view(),
            path_states: self.states.view(),
            path_hits: self.hits.view(),
            path_shadow_rays: self.shadow.view(),
            path_flags: self.flags.view(),
            path_resume: self.resume.view(),
            path_chunks: self.chunks.view(),
            path_aovs: self.aovs.view(),
        }
    }
}
