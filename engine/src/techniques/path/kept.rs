//! What paths keep by slot beside their walks (`techniques/path/path_slots.glsl`).

use crate::Result;
use crate::gpu::shaders::sets::PathSlotSet;
use crate::gpu::shaders::types::{LightReceiver, PathAov, PathFlight};
use crate::gpu::{Buffer, BufferDesc, Category, Gpu};

/// Its memory; what no kernel reads or writes has none.
pub(super) struct KeptBySlot {
    aovs: Buffer,
    /// Where paths were scattered last, where the choice of lights depends on it.
    receivers: Option<Buffer>,
    /// Under which cosine they left there, where edges are bounded by their geometry term.
    departures: Option<Buffer>,
    /// By what they share light with photons, where they do.
    even_distances: Option<Buffer>,
    /// How they were scattered first and last, where photons have planes.
    flights: Option<Buffer>,
    /// What an arrival stage keeps by place.
    stage: Option<Buffer>,
}

/// What there is to keep.
#[derive(Clone, Copy)]
pub(super) struct KeptNeeds {
    pub aovs: bool,
    pub receivers: bool,
    pub departures: bool,
    pub even_distances: bool,
    pub flights: bool,
    /// Of an arrival stage, by place.
    pub stage_bytes: u64,
}

impl KeptBySlot {
    pub fn new(gpu: &Gpu, slots: u32, has: KeptNeeds) -> Result<Self> {
        let work = |name, bytes: usize, slots: u32| {
            let bytes = bytes as u64 * u64::from(slots);
            gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work))
        };
        let receivers = || work("path receivers", size_of::<LightReceiver>(), slots);
        let departures = || work("path departures", size_of::<f32>(), slots);
        let even_distances = || work("path even distances", size_of::<f32>(), slots);
        let flights = || work("path flights", size_of::<PathFlight>(), slots);
        let stage = || {
            let bytes = has.stage_bytes * u64::from(slots);
            gpu.buffer(&BufferDesc::storage("arrival stage", bytes, Category::Work))
        };
        Ok(Self {
            aovs: work("path aovs", size_of::<PathAov>(), if has.aovs { slots } else { 0 })?,
            receivers: has.receivers.then(receivers).transpose()?,
            departures: has.departures.then(departures).transpose()?,
            even_distances: has.even_distances.then(even_distances).transpose()?,
            flights: has.flights.then(flights).transpose()?,
            stage: (has.stage_bytes > 0).then(stage).transpose()?,
        })
    }

    /// Set 1. Another buffer stands in the place of what there is not.
    pub fn set(&self) -> PathSlotSet<'_> {
        PathSlotSet {
            path_aovs: self.aovs.view(),
            path_receivers: self.receivers.as_ref().unwrap_or(&self.aovs).view(),
            path_departures: self.departures().view(),
            path_even_distances: self.even_distances.as_ref().unwrap_or(&self.aovs).view(),
            path_flights: self.flights.as_ref().unwrap_or(&self.aovs).view(),
        }
    }

    /// What an arrival stage keeps, or some other buffer.
    pub fn stage(&self) -> &Buffer {
        self.stage.as_ref().unwrap_or(&self.aovs)
    }

    /// Cosines at departure, or some other buffer.
    pub fn departures(&self) -> &Buffer {
        self.departures.as_ref().unwrap_or(&self.aovs)
    }
}
