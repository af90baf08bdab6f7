//! What paths keep by slot beside their walks (`techniques/path/path_slots.glsl`).

use crate::Result;
use crate::gpu::shaders::sets::PathSlotSet;
use crate::gpu::shaders::types::{LightReceiver, PathAov};
use crate::gpu::{Buffer, BufferDesc, Category, Gpu};

/// Its memory; what no kernel reads or writes has none.
pub(super) struct KeptBySlot {
    aovs: Buffer,
    /// Where paths were scattered last, where the choice of lights depends on it.
    receivers: Option<Buffer>,
}

impl KeptBySlot {
    pub fn new(gpu: &Gpu, slots: u32, has_aovs: bool, has_receivers: bool) -> Result<Self> {
        let work = |name, bytes: usize, slots: u32| {
            let bytes = bytes as u64 * u64::from(slots);
            gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work))
        };
        let receivers = || work("path receivers", size_of::<LightReceiver>(), slots);
        Ok(Self {
            aovs: work("path aovs", size_of::<PathAov>(), if has_aovs { slots } else { 0 })?,
            receivers: has_receivers.then(receivers).transpose()?,
        })
    }

    /// Set 1. Without receivers another buffer stands in their place.
    pub fn set(&self) -> PathSlotSet<'_> {
        PathSlotSet {
            path_aovs: self.aovs.view(),
            path_receivers: self.receivers.as_ref().unwrap_or(&self.aovs).view(),
        }
    }
}
