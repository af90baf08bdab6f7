//! Waves: which pixels and samples are under way together, and their working memory.
//!
//! The split into waves never reaches the picture: each path depends on (seed, pixel, sample) alone, and samples are added to their pixel
//! in order.

use super::settings::SLOTS_MAX;
use crate::film::GpuFilm;
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::{COMPACT_CHUNK, PATH_GROUP};
use crate::gpu::shaders::sets::{PathBuffers, PathMedia};
use crate::gpu::shaders::transport::{path_camera, path_medium};
use crate::gpu::shaders::types::{
    FilmAov, FilmPixel, GatheredLight, Hit, MediumEvent, MediumState, PathAov, PathState, ShadowRay, ShadowStart,
    ShadowState,
};
use crate::gpu::{Buffer, BufferDesc, Category, DeviceKind, Gpu, TexelView};
use crate::{Error, Result};

/// Samples of a pixel in one wave: the resolve stage loops over them, which must stay below
/// [`SOFTWARE_LOOP_CAP`](crate::gpu::SOFTWARE_LOOP_CAP).
const SAMPLES_PER_WAVE: u32 = 1024;
/// Samples of a pixel that are best under way together, in neighbouring lanes.
const SAMPLES_TOGETHER: u32 = 8;
/// Slots below which a lack of memory is an error.
const SLOTS_MIN: u32 = 1 << 14;
/// Bytes of a texel of four words.
const TEXEL_BYTES: u64 = 16;

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
    /// Samples of each pixel in the waves of this pass over the picture.
    pub samples: u32,
    pub done: u64,
}

/// The head of the working memory: indirect arguments and counters.
pub(crate) type Status = path_camera::PathStatusBlock;

/// Counts of what happened in media.
pub(super) type MediumCounters = path_medium::PathMediumCounters;

/// Working memory for participating media.
pub(crate) struct MediaBuffers {
    states: Buffer,
    events: Buffer,
    shadow_starts: Buffer,
    airlight_rays: Buffer,
    shadow_states: Buffer,
    pub counters: Buffer,
    pub readback: Buffer,
}

/// Which buffers a wave needs beside those of all scenes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WaveNeeds {
    pub lights: bool,
    pub media: bool,
    /// Equi-angular samples.
    pub airlight: bool,
}

/// Working memory of a wave.
pub(crate) struct WaveBuffers {
    pub status: Buffer,
    pub queues: [TexelView; 2],
    pub states: [TexelView; 2],
    pub gathered: Buffer,
    pub hits: TexelView,
    pub shadow_rays: TexelView,
    pub shadow_queue: TexelView,
    pub flags: TexelView,
    pub resume: Buffer,
    pub chunks: Buffer,
    pub aovs: Buffer,
    pub readback: Buffer,
    pub media: Option<MediaBuffers>,
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
        if c.band == 0 && c.pixel_in_band == 0 {
            // As many as fit with the whole picture, else as many as there are already, so that a picture is complete early.
            let whole = if bands.len() == 1 { slots / band.pixels() } else { 0 };
            c.samples = whole
                .max(c.sample.clamp(1, SAMPLES_TOGETHER))
                .min(SAMPLES_PER_WAVE)
                .min(samples - c.sample);
        }
        let pixels = (band.pixels() - c.pixel_in_band).min(slots / c.samples);
        let wave = Wave {
            band: c.band,
            first_pixel: band.first_pixel() + c.pixel_in_band,
            pixels,
            first_sample: c.sample,
            samples: c.samples,
        };
        c.pixel_in_band += pixels;
        if c.pixel_in_band == band.pixels() {
            c.pixel_in_band = 0;
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

/// Slots where nothing else is asked for: enough for a dispatch to be worth its overhead, few enough for the caches of a processor.
pub(crate) fn default_slots(gpu: &Gpu) -> u32 {
    match gpu.caps().kind {
        DeviceKind::Cpu => 1 << 18,
        _ => 1 << 20,
    }
}

/// Slots that one dispatch reaches and whose largest buffer can be bound, in whole workgroups.
pub(crate) fn slots_of_device(gpu: &Gpu) -> u32 {
    let slot_bytes = size_of::<PathState>().max(size_of::<ShadowRay>()) as u64;
    let by_range = gpu.caps().max_storage_buffer_range / slot_bytes;
    let by_texels = gpu.caps().max_texel_buffer_elements * TEXEL_BYTES / slot_bytes;
    let by_groups = u64::from(gpu.caps().max_workgroups) * u64::from(PATH_GROUP);
    let slots = by_range.min(by_texels).min(by_groups).min(u64::from(SLOTS_MAX)) as u32;
    slots - slots % PATH_GROUP
}

/// Slots that waves of a picture can fill, in whole workgroups.
pub(super) fn slots_of_picture([width, height]: [u32; 2]) -> u32 {
    let paths = u64::from(width) * u64::from(height) * u64::from(SAMPLES_PER_WAVE);
    paths.next_multiple_of(u64::from(PATH_GROUP)).min(u64::from(SLOTS_MAX)) as u32
}

/// Indirect arguments of stages with one invocation a place, and a chunk, of a queue.
pub(crate) fn group_counts(places: u32) -> [[u32; 3]; 2] {
    [places, places.div_ceil(COMPACT_CHUNK)].map(|count| [count.div_ceil(PATH_GROUP), 1, 1])
}

impl WaveBuffers {
    /// For as many slots, up to `slots`, as there is memory for beside what reading the film takes; a wave's size never changes the
    /// picture.
    pub fn within_memory(gpu: &Gpu, mut slots: u32, needs: WaveNeeds, film: &GpuFilm) -> Result<(Self, u32)> {
        let band = film.bands().iter().map(|band| u64::from(band.pixels())).max();
        let pixel_bytes = size_of::<FilmPixel>().max(size_of::<FilmAov>()) as u64;
        let reading = BufferDesc::readback("film readback", band.unwrap_or(0) * pixel_bytes);
        loop {
            let made = Self::new(gpu, slots, needs, film.has_aovs());
            match made.and_then(|buffers| gpu.buffer(&reading).map(|_| buffers)) {
                Err(Error::OutOfMemory { .. }) if slots > SLOTS_MIN => slots = (slots / 2).next_multiple_of(PATH_GROUP),
                made => return made.map(|buffers| (buffers, slots)),
            }
        }
    }

    pub fn new(gpu: &Gpu, slots: u32, needs: WaveNeeds, aovs: bool) -> Result<Self> {
        let work = |name: &str, bytes: usize, count: u32| {
            gpu.buffer(&BufferDesc::storage(
                name,
                bytes as u64 * u64::from(count),
                Category::Work,
            ))
        };
        let words =
            |name: &str, count| gpu.storage_texels(name, Category::Work, vk::Format::R32_UINT, u64::from(count));
        let quarters = |name: &str, bytes: usize, count: u32| {
            let texels = (bytes as u64 * u64::from(count)).div_ceil(TEXEL_BYTES);
            gpu.storage_texels(name, Category::Work, vk::Format::R32G32B32A32_UINT, texels)
        };
        let states = |name: &str| quarters(name, size_of::<PathState>(), slots);
        let lit_slots = if needs.lights { slots } else { 0 };
        let chunks = slots.div_ceil(COMPACT_CHUNK);
        Ok(Self {
            status: work("path status", size_of::<Status>(), 1)?,
            queues: [words("path queue a", slots)?, words("path queue b", slots)?],
            states: [states("path states a")?, states("path states b")?],
            gathered: work("path gathered", size_of::<GatheredLight>(), slots)?,
            hits: quarters("path hits", size_of::<Hit>(), slots)?,
            shadow_rays: quarters("path shadow rays", size_of::<ShadowRay>(), lit_slots)?,
            shadow_queue: words("path shadow queue", lit_slots)?,
            flags: quarters("path flags", size_of::<u32>(), slots)?,
            resume: work("path resume", size_of::<u32>(), slots)?,
            // Of each chunk the paths that are alive and those with shadow rays.
            chunks: work("path chunks", 2 * size_of::<u32>(), chunks)?,
            aovs: work("path aovs", size_of::<PathAov>(), if aovs { slots } else { 0 })?,
            readback: gpu.buffer(&BufferDesc::readback(
                "path status readback",
                size_of::<Status>() as u64,
            ))?,
            media: needs.media.then(|| MediaBuffers::new(gpu, slots, needs)).transpose()?,
        })
    }

    /// Set 4. Without media nothing is read or written through it, and some other buffer stands there.
    pub fn media_set(&self) -> PathMedia<'_> {
        let Some(media) = &self.media else {
            let none = self.chunks.view();
            return PathMedia {
                path_medium_states: none,
                path_medium_events: none,
                path_shadow_starts: none,
                path_airlight_rays: none,
                path_shadow_states: none,
                medium_counters: none,
            };
        };
        PathMedia {
            path_medium_states: media.states.view(),
            path_medium_events: media.events.view(),
            path_shadow_starts: media.shadow_starts.view(),
            path_airlight_rays: media.airlight_rays.view(),
            path_shadow_states: media.shadow_states.view(),
            medium_counters: media.counters.view(),
        }
    }

    /// Set 0 with the queues in the roles of a bounce of this parity.
    pub fn set(&self, parity: usize) -> PathBuffers<'_> {
        PathBuffers {
            status: self.status.view(),
            path_queue_in: &self.queues[parity],
            path_queue_out: self.queues[1 - parity].buffer().view(),
            path_states_in: &self.states[parity],
            path_states_out: self.states[1 - parity].buffer().view(),
            path_gathered: self.gathered.view(),
            path_hits_in: &self.hits,
            path_hits_out: self.hits.buffer().view(),
            path_shadow_rays_in: &self.shadow_rays,
            path_shadow_rays_out: self.shadow_rays.buffer().view(),
            path_shadow_queue_in: &self.shadow_queue,
            path_shadow_queue_out: self.shadow_queue.buffer().view(),
            path_flags_in: &self.flags,
            path_flags_out: self.flags.buffer().view(),
            path_resume: self.resume.view(),
            path_chunks: self.chunks.view(),
            path_aovs: self.aovs.view(),
        }
    }
}

impl MediaBuffers {
    fn new(gpu: &Gpu, slots: u32, needs: WaveNeeds) -> Result<Self> {
        let work = |name: &str, bytes: usize, count: u32| {
            let bytes = bytes as u64 * u64::from(count);
            gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work))
        };
        let lit_slots = if needs.lights { slots } else { 0 };
        let airlight_slots = if needs.airlight { slots } else { 0 };
        Ok(Self {
            states: work("path medium states", size_of::<MediumState>(), slots)?,
            events: work("path medium events", size_of::<MediumEvent>(), slots)?,
            shadow_starts: work("path shadow starts", size_of::<ShadowStart>(), lit_slots)?,
            airlight_rays: work("path airlight rays", size_of::<ShadowRay>(), airlight_slots)?,
            shadow_states: work("path shadow states", size_of::<ShadowState>(), lit_slots)?,
            counters: work("path medium counters", size_of::<MediumCounters>(), 1)?,
            readback: gpu.buffer(&BufferDesc::readback(
                "path medium counters readback",
                size_of::<MediumCounters>() as u64,
            ))?,
        })
    }
}
