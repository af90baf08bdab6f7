//! Working memory of a wave: queues, and what stages hand to each other. GLSL: `walk/wave.glsl`, which says how it is laid out.

use super::turnover::Turnover;
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::{COMPACT_CHUNK, WAITING_QUARTERS, WALK_GROUP};
use crate::gpu::shaders::sets::WaveSet;
use crate::gpu::shaders::types::{
    GatheredLight, Hit, MediumEvent, MediumState, ShadowRay, ShadowStart, ShadowState, WalkState,
};
use crate::gpu::shaders::walk::{compact_scan, shadow};
use crate::gpu::{Access, Buffer, BufferDesc, BufferView, Category, DeviceKind, Gpu, Pass, TexelView, wide_counter};
use crate::{Error, Result};

/// Most walks in flight.
pub const SLOTS_MAX: u32 = 1 << 22;
/// Slots below which a lack of memory is an error.
const SLOTS_MIN: u32 = 1 << 14;
/// Bytes of a texel of four words.
const TEXEL_BYTES: u64 = 16;
/// Bytes of what waits at a place.
const WAITING_BYTES: usize = WAITING_QUARTERS as usize * TEXEL_BYTES as usize;

/// The head of the working memory: indirect arguments and counters.
pub(super) type Status = compact_scan::WaveStatusBlock;

type MediumCounters = shadow::WalkMediumCounters;

/// Which memory a wave needs beside that of all. [`Walker::new`](super::Walker::new) refuses what a scene or its own options need more of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WaveNeeds {
    /// Something may wait by place: shadow rays, or whatever is kept of a place.
    pub waiting: bool,
    /// Walks go through participating media: [`MediaUse::any`](crate::scene::MediaUse::any) of the scene, whatever the owner of the walks makes of
    /// them.
    pub media: bool,
    /// In media, a place may have a second shadow ray, to light scattered on the way there; one that waits, like all.
    pub airlight: bool,
}

impl WaveNeeds {
    /// Refuses memory that lacks what walks in a scene with media, or with shadow rays, read and write.
    pub(super) fn check(self, has_media: bool, has_shadows: bool) -> Result<()> {
        let refuse = |name, cause: &str| Err(Error::setting(name, false, cause));
        if has_media && !self.media {
            return refuse("media", "is not enough: the scene has participating media");
        }
        if has_shadows && !self.waiting {
            return refuse(
                "waiting",
                "is not enough: the walks have shadow rays, which wait by place",
            );
        }
        if self.airlight && !(self.waiting && self.media) {
            return refuse("waiting", "or `media` is not enough for `airlight`");
        }
        Ok(())
    }
}

/// Exact counts of what happened in media.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MediumCounts {
    /// Collisions that scattered or absorbed.
    pub collisions: u64,
    /// Tentative collisions of free flights through density grids that were none.
    pub null_collisions: u64,
    /// Densities looked up in grids, by free flights and by shadow rays.
    pub density_lookups: u64,
    /// Shadow rays of places that had one already.
    pub second_rays: u64,
}

/// Working memory of a wave.
pub struct WaveBuffers {
    pub(super) status: Buffer,
    queues: [TexelView; 2],
    states: [TexelView; 2],
    gathered: Buffer,
    hits: TexelView,
    waiting: TexelView,
    waiting_queue: TexelView,
    flags: TexelView,
    resume: Buffer,
    chunks: Buffer,
    pub(super) readback: Buffer,
    pub(super) media: Option<MediaBuffers>,
    /// Of walks that have some.
    numbers: Option<TexelView>,
    /// Of a wave that is kept full.
    turnover: Option<Turnover>,
    needs: WaveNeeds,
    slots: u32,
}

/// Working memory for participating media.
pub(super) struct MediaBuffers {
    states: Buffer,
    events: Buffer,
    shadow_starts: Buffer,
    airlight_rays: Buffer,
    shadow_states: Buffer,
    pub counters: Buffer,
    pub readback: Buffer,
}

/// Slots where nothing else is asked for: enough for a dispatch to be worth its overhead, few enough for the caches of a processor.
pub fn default_slots(gpu: &Gpu) -> u32 {
    match gpu.caps().kind {
        DeviceKind::Cpu => 1 << 18,
        _ => 1 << 20,
    }
}

/// Slots that one dispatch reaches and whose largest buffer can be bound, in whole workgroups.
pub fn slots_of_device(gpu: &Gpu) -> u32 {
    let slot_bytes = size_of::<WalkState>().max(WAITING_BYTES) as u64;
    let by_range = gpu.caps().max_storage_buffer_range / slot_bytes;
    let by_texels = gpu.caps().max_texel_buffer_elements * TEXEL_BYTES / slot_bytes;
    let by_groups = u64::from(gpu.caps().max_workgroups[0]) * u64::from(WALK_GROUP);
    let slots = by_range.min(by_texels).min(by_groups).min(u64::from(SLOTS_MAX)) as u32;
    slots - slots % WALK_GROUP
}

/// Indirect arguments of stages with one invocation per place, and a chunk, of a queue.
pub(super) fn group_counts(places: u32) -> [[u32; 3]; 2] {
    [places, places.div_ceil(COMPACT_CHUNK)].map(|count| [count.div_ceil(WALK_GROUP), 1, 1])
}

/// Indirect arguments at an offset of the status.
pub(super) fn indirect(buffers: &WaveBuffers, offset: usize) -> BufferView<'_> {
    buffers.status.slice(offset as u64, size_of::<[u32; 3]>() as u64)
}

/// A barrier after which the next stage may read, write, or take as its arguments, what any stage before has left.
pub fn stage_barrier(pass: &mut Pass<'_>) {
    pass.memory_barrier(
        Access::COMPUTE | Access::INDIRECT_READ,
        Access::COMPUTE | Access::INDIRECT_READ,
    );
}

impl WaveBuffers {
    /// For as many slots, up to `slots`, as there is memory for, beside what `more` makes for so many; a wave's size never changes what its walks
    /// compute.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] where not even 16384 slots fit, [`Error::LimitExceeded`], and those of `more`.
    pub fn within_memory<T>(
        gpu: &Gpu,
        mut slots: u32,
        needs: WaveNeeds,
        more: impl Fn(u32) -> Result<T>,
    ) -> Result<(Self, T)> {
        loop {
            let made = Self::new(gpu, slots, needs);
            match made.and_then(|buffers| Ok((buffers, more(slots)?))) {
                Err(Error::OutOfMemory { .. }) if slots > SLOTS_MIN => slots = (slots / 2).next_multiple_of(WALK_GROUP),
                made => return made,
            }
        }
    }

    /// For so many slots.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], [`Error::LimitExceeded`] for more than [`slots_of_device`].
    pub fn new(gpu: &Gpu, slots: u32, needs: WaveNeeds) -> Result<Self> {
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
        let states = |name: &str| quarters(name, size_of::<WalkState>(), slots);
        let waiting_slots = if needs.waiting { slots } else { 0 };
        let chunks = slots.div_ceil(COMPACT_CHUNK);
        Ok(Self {
            status: work("wave status", size_of::<Status>(), 1)?,
            queues: [words("wave queue a", slots)?, words("wave queue b", slots)?],
            states: [states("wave states a")?, states("wave states b")?],
            gathered: work("wave gathered", size_of::<GatheredLight>(), slots)?,
            hits: quarters("wave hits", size_of::<Hit>(), slots)?,
            waiting: quarters("wave waiting", WAITING_BYTES, waiting_slots)?,
            waiting_queue: words("wave waiting queue", waiting_slots)?,
            flags: quarters("wave flags", size_of::<u32>(), slots)?,
            resume: work("wave resume", size_of::<u32>(), slots)?,
            // Of each chunk the walks that are alive and the places where something waits.
            chunks: work("wave chunks", 2 * size_of::<u32>(), chunks)?,
            readback: gpu.buffer(&BufferDesc::readback(
                "wave status readback",
                size_of::<Status>() as u64,
            ))?,
            media: needs.media.then(|| MediaBuffers::new(gpu, slots, needs)).transpose()?,
            numbers: None,
            turnover: None,
            needs,
            slots,
        })
    }

    /// Walks that fit.
    pub fn slots(&self) -> u32 {
        self.slots
    }

    /// What it has memory for.
    pub fn needs(&self) -> WaveNeeds {
        self.needs
    }

    /// Gives walks numbers of their own in place of those of a [`WalkKey`](super::WalkKey): by slot the sequence and the place in it that its random numbers are
    /// keyed by, two words (`R32G32_UINT`), which the owner writes before anything is drawn. Sequences may then have differing numbers of walks. To be called before
    /// a walker is made of the memory.
    pub fn number_by(&mut self, numbers: TexelView) {
        self.numbers = Some(numbers);
    }

    /// Lets the wave be kept full. Its walks have numbers of their own ([`number_by`](WaveBuffers::number_by)) of four words (`R32G32B32A32_UINT`), the third of them the bounces
    /// of the wave that were finished when the walk began, the fourth one the owner's. To be called before a walker is made of the memory.
    pub fn refill_by(&mut self, turnover: Turnover) {
        self.turnover = Some(turnover);
    }

    /// What is known of the slots of a wave that is kept full.
    pub fn turnover(&self) -> Option<&Turnover> {
        self.turnover.as_ref()
    }

    /// Set 0 for a [`Turnover`] and for kernels over its lists; that of the wave without one.
    pub fn turnover_set(&self) -> WaveSet<'_> {
        let wave = self.set(0);
        match &self.turnover {
            Some(turnover) => turnover.set(wave),
            None => wave,
        }
    }

    /// Whether walks have numbers of their own.
    pub fn is_numbered(&self) -> bool {
        self.numbers.is_some()
    }

    /// What walks have gathered: a [`GatheredLight`] a slot.
    pub fn gathered(&self) -> BufferView<'_> {
        self.gathered.view()
    }

    /// Set 0 with the queues in the roles of a bounce of this parity. Without media nothing is read or written through the bindings for them, and some
    /// other buffer stands there; without numbers it is the queue that is read.
    pub fn set(&self, parity: usize) -> WaveSet<'_> {
        let none = self.chunks.view();
        let media = |of: fn(&MediaBuffers) -> &Buffer| self.media.as_ref().map_or(none, |media| of(media).view());
        WaveSet {
            status: self.status.view(),
            walk_queue_in: &self.queues[parity],
            walk_queue_out: self.queues[1 - parity].buffer().view(),
            walk_states_in: &self.states[parity],
            walk_states_out: self.states[1 - parity].buffer().view(),
            walk_gathered: self.gathered.view(),
            walk_hits_in: &self.hits,
            walk_hits_out: self.hits.buffer().view(),
            walk_waiting_in: &self.waiting,
            walk_waiting_out: self.waiting.buffer().view(),
            walk_waiting_queue_in: &self.waiting_queue,
            walk_waiting_queue_out: self.waiting_queue.buffer().view(),
            walk_flags_in: &self.flags,
            walk_flags_out: self.flags.buffer().view(),
            walk_resume: self.resume.view(),
            walk_chunks: self.chunks.view(),
            walk_medium_states: media(|m| &m.states),
            walk_medium_events: media(|m| &m.events),
            walk_shadow_starts: media(|m| &m.shadow_starts),
            walk_airlight_rays: media(|m| &m.airlight_rays),
            walk_shadow_states: media(|m| &m.shadow_states),
            medium_counters: media(|m| &m.counters),
            walk_numbers_in: self.numbers.as_ref().unwrap_or(&self.queues[parity]),
        }
    }
}

impl MediaBuffers {
    fn new(gpu: &Gpu, slots: u32, needs: WaveNeeds) -> Result<Self> {
        let work = |name: &str, bytes: usize, count: u32| {
            let bytes = bytes as u64 * u64::from(count);
            gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work))
        };
        let waiting_slots = if needs.waiting { slots } else { 0 };
        let airlight_slots = if needs.airlight { slots } else { 0 };
        Ok(Self {
            states: work("wave medium states", size_of::<MediumState>(), slots)?,
            events: work("wave medium events", size_of::<MediumEvent>(), slots)?,
            shadow_starts: work("wave shadow starts", size_of::<ShadowStart>(), waiting_slots)?,
            airlight_rays: work("wave airlight rays", size_of::<ShadowRay>(), airlight_slots)?,
            shadow_states: work("wave shadow states", size_of::<ShadowState>(), waiting_slots)?,
            counters: work("wave medium counters", size_of::<MediumCounters>(), 1)?,
            readback: gpu.buffer(&BufferDesc::readback(
                "wave medium counters readback",
                size_of::<MediumCounters>() as u64,
            ))?,
        })
    }

    /// Sets the counters to zero.
    pub fn reset(&self, pass: &mut Pass<'_>) -> Result<()> {
        pass.update(self.counters.view(), &[MediumCounters::default()])
    }

    /// The counters as they were copied last.
    pub fn counts(&self) -> Result<MediumCounts> {
        let counters = self.readback.read::<MediumCounters>(0, 1)?[0];
        Ok(MediumCounts {
            collisions: wide_counter(counters.collisions),
            null_collisions: wide_counter(counters.null_collisions),
            density_lookups: wide_counter(counters.density_lookups),
            second_rays: wide_counter(counters.second_rays),
        })
    }
}
