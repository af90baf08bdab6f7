//! The device: what all floors above share of it.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use ash::vk::Handle;
use ash::{ext, khr, vk};

use super::caps::Caps;
use super::fault;
use super::instance::{Instance, ValidationLog, ValidationMessage};
use super::marker::InFlight;
use super::memory::{AllocationInfo, Memory, MemoryReport};
use super::options::Validation;
use super::pipeline::{KeptPipelines, PipelineTable};
use super::pipeline_cache::PipelineCache;
use super::resources::FrameResources;
use crate::{Error, Result};

/// A Vulkan device with one queue. Cloning shares it.
#[derive(Clone)]
pub struct Gpu {
    pub(super) inner: Arc<Inner>,
    pub(super) kept: Arc<KeptPipelines>,
}

impl std::fmt::Debug for Gpu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Gpu")
            .field("device", &self.inner.caps.device)
            .finish_non_exhaustive()
    }
}

/// What all handles share. Fields drop after [`Inner::drop`] has destroyed what hangs on the device.
pub(super) struct Inner {
    pub device: ash::Device,
    pub physical_device: vk::PhysicalDevice,
    pub queue: Mutex<Queue>,
    pub queue_family: u32,
    pub caps: Caps,
    pub memory: Memory,
    pub debug: Option<ext::debug_utils::Device>,
    /// Where ray queries are enabled.
    pub structures: Option<khr::acceleration_structure::Device>,
    pub timeline: vk::Semaphore,
    pub recycled: Mutex<Vec<FrameResources>>,
    pub pipelines: Mutex<PipelineTable>,
    pub pipeline_cache: PipelineCache,
    pub crash_markers: bool,
    pub validation: Validation,
    pub in_flight: Mutex<InFlight>,
    /// The device can present to windows.
    pub presents: bool,
    /// The last pass that a lost device reached.
    pub lost: OnceLock<String>,
    pub next_id: AtomicU64,
    /// Given back when the device is gone.
    pub _fault: Option<fault::Claim>,
    /// The device is destroyed with the last handle.
    pub owned: bool,
    /// Dropped last.
    pub instance: Instance,
}

/// The queue and the last value that its timeline semaphore will reach.
pub(super) struct Queue {
    pub raw: vk::Queue,
    pub last_value: u64,
}

impl Gpu {
    /// What the device can do.
    pub fn caps(&self) -> &Caps {
        &self.inner.caps
    }

    /// Device memory in use.
    pub fn memory_report(&self) -> MemoryReport {
        self.inner.memory.report()
    }

    /// Every live allocation, by name.
    pub fn allocations(&self) -> Vec<AllocationInfo> {
        self.inner.memory.allocations()
    }

    /// Takes the messages that the validation layers have left so far.
    pub fn take_validation_messages(&self) -> Vec<ValidationMessage> {
        self.validation_log().take()
    }

    /// The messages of the validation layers, to be read when the device has gone, too: that is when leaks are reported.
    pub fn validation_log(&self) -> ValidationLog {
        ValidationLog(Arc::clone(&self.inner.instance.messages))
    }

    /// The queue, locked against the engine's own submissions for as long as the guard lives.
    pub fn lock_queue(&self) -> QueueGuard<'_> {
        QueueGuard(self.inner.lock_queue())
    }

    /// The Vulkan device, for a host's own calls.
    pub fn raw_device(&self) -> &ash::Device {
        &self.inner.device
    }

    /// The queue family that the engine's queue belongs to.
    pub fn queue_family(&self) -> u32 {
        self.inner.queue_family
    }

    /// Writes the pipeline cache to disk; also done when the last handle goes.
    pub fn save_pipeline_cache(&self) {
        self.inner.pipeline_cache.save(&self.inner.device);
    }
}

/// Exclusive use of the queue.
pub struct QueueGuard<'a>(MutexGuard<'a, Queue>);

impl QueueGuard<'_> {
    /// The queue.
    pub fn raw(&self) -> vk::Queue {
        self.0.raw
    }
}

impl Inner {
    /// Names an object for debuggers and validation messages.
    pub fn name<H: Handle>(&self, handle: H, name: &str) {
        let Some(debug) = &self.debug else { return };
        let Ok(name) = std::ffi::CString::new(name) else { return };
        let info = vk::DebugUtilsObjectNameInfoEXT::default()
            .object_handle(handle)
            .object_name(&name);
        // SAFETY: the handle is alive; a failure to name it is of no consequence.
        let _ = unsafe { debug.set_debug_utils_object_name(&info) };
    }

    pub fn next_id(&self) -> u64 {
        self.next_id.fetch_add(1, Ordering::Relaxed)
    }

    pub fn lock_queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The error for a result code of `call`; a lost device stays lost.
    pub fn error(&self, call: &'static str, result: vk::Result) -> Error {
        match result {
            vk::Result::ERROR_DEVICE_LOST => Error::DeviceLost {
                last_pass: self.lost.get_or_init(|| self.in_flight().last_pass()).clone(),
            },
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => out_of_memory("device", call),
            vk::Result::ERROR_OUT_OF_HOST_MEMORY => out_of_memory("host", call),
            result => Error::Vulkan { call, result },
        }
    }

    /// As [`Inner::error`] for the creation of something with a name and a size.
    pub fn creation_error(&self, call: &'static str, result: vk::Result, name: &str, bytes: u64) -> Error {
        match self.error(call, result) {
            Error::OutOfMemory { memory, .. } => Error::OutOfMemory {
                memory,
                name: name.into(),
                bytes,
                cause: format!("{call}: {result}"),
            },
            other => other,
        }
    }

    /// Frame resources that wait to be used again.
    pub fn recycled(&self) -> MutexGuard<'_, Vec<FrameResources>> {
        self.recycled.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn in_flight(&self) -> MutexGuard<'_, InFlight> {
        self.in_flight.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until the queue has nothing left to do, or answers that it never will.
    pub fn wait_for_queue(&self) {
        let queue = self.lock_queue();
        // SAFETY: the queue is locked. An error means a lost device, for which there is nothing to wait.
        let _ = unsafe { self.device.queue_wait_idle(queue.raw) };
    }

    /// Fails once the device has been lost.
    pub fn check_alive(&self) -> Result<()> {
        match self.lost.get() {
            None => Ok(()),
            Some(last_pass) => Err(Error::DeviceLost {
                last_pass: last_pass.clone(),
            }),
        }
    }
}

fn out_of_memory(memory: &'static str, call: &'static str) -> Error {
    Error::OutOfMemory {
        memory,
        name: call.into(),
        bytes: 0,
        cause: "the driver has none left".into(),
    }
}

impl Drop for Inner {
    fn drop(&mut self) {
        self.pipeline_cache.save(&self.device);
        // SAFETY: every handle holds an `Arc` of `self`, so nothing else uses the device any more; submissions wait before they drop.
        unsafe {
            if self.owned {
                // A lost device answers with an error, and then there is nothing to wait for.
                let _ = self.device.device_wait_idle();
            }
            for resources in self
                .recycled
                .get_mut()
                .unwrap_or_else(PoisonError::into_inner)
                .drain(..)
            {
                resources.destroy(&self.device);
            }
            self.pipeline_cache.destroy(&self.device);
            self.device.destroy_semaphore(self.timeline, None);
            self.memory.shut_down();
            if self.owned {
                self.device.destroy_device(None);
            }
        }
    }
}
