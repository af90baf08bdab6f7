//! The device: choosing, creating or borrowing it, and what all floors above share of it.

use std::collections::BTreeMap;
use std::ffi::CStr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use ash::vk::Handle;
use ash::{ext, khr, vk};
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};

use super::caps::Caps;
use super::fault;
use super::host::{EnabledFeatures, HostDevice};
use super::instance::{DeviceSummary, Instance, ValidationLog, ValidationMessage, surface_extensions, vulkan};
use super::marker::InFlight;
use super::memory::{AllocationInfo, Memory, MemoryReport};
use super::options::{GpuOptions, Validation};
use super::pipeline::PipelineTable;
use super::pipeline_cache::PipelineCache;
use super::resources::FrameResources;
use crate::{Error, Result};

/// A Vulkan device with one queue. Cloning shares it.
#[derive(Clone)]
pub struct Gpu {
    pub(super) inner: Arc<Inner>,
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
    next_id: AtomicU64,
    owned: bool,
    /// Dropped last.
    pub instance: Instance,
}

/// The queue and the last value that its timeline semaphore will reach.
pub(super) struct Queue {
    pub raw: vk::Queue,
    pub last_value: u64,
}

impl Gpu {
    /// A device without a window system.
    ///
    /// # Errors
    /// [`Error::NoVulkan`] without a loader, [`Error::NoDevice`] when none matches, [`Error::MissingFeature`] when it lacks the baseline.
    pub fn headless(options: &GpuOptions) -> Result<Self> {
        let instance = Instance::new(options.validation, &[])?;
        Self::create(instance, options, None)
    }

    /// A device that can present to windows of the given display.
    ///
    /// # Errors
    /// As [`Gpu::headless`]; also when the device cannot present to `window`.
    pub fn for_window<W: HasDisplayHandle + HasWindowHandle>(options: &GpuOptions, window: &W) -> Result<Self> {
        let display = window.display_handle().map_err(no_window)?.as_raw();
        let handle = window.window_handle().map_err(no_window)?.as_raw();
        let instance = Instance::new(options.validation, &surface_extensions(display)?)?;
        // SAFETY: both handles are valid while `window` is borrowed; `ProbeSurface` destroys the surface.
        let surface = unsafe { ash_window::create_surface(&instance.entry, &instance.raw, display, handle, None) }
            .map_err(vulkan("vkCreateSurfaceKHR"))?;
        let loader = khr::surface::Instance::new(&instance.entry, &instance.raw);
        Self::create(instance, options, Some(ProbeSurface { loader, raw: surface }))
    }

    /// Wraps a host's device. Nothing of the host's is destroyed when the `Gpu` goes.
    ///
    /// # Safety
    /// The handles must be valid and belong together, must outlive the returned `Gpu` and everything made from it, the features in
    /// `host.enabled` must really be enabled, and the host must not use the queue while the engine submits: take
    /// [`Gpu::lock_queue`] around the host's own submissions.
    ///
    /// # Errors
    /// [`Error::MissingFeature`] naming the first required feature that the host did not enable.
    pub unsafe fn from_host(host: HostDevice, options: &GpuOptions) -> Result<Self> {
        let instance = Instance::from_host(host.entry, host.instance, host.debug_utils);
        let name = instance.summary(0, host.physical_device).name;
        host.enabled.check(&name, "enable it when creating the device")?;
        let mut caps = Caps::read(&instance, host.physical_device, host.queue_family);
        host.enabled.restrict(&mut caps);
        Self::finish(
            instance,
            host.device,
            host.physical_device,
            (host.queue, host.queue_family),
            caps,
            options,
            (false, false),
        )
    }

    /// The devices of this machine.
    ///
    /// # Errors
    /// [`Error::NoVulkan`] without a loader.
    pub fn list() -> Result<Vec<(DeviceSummary, Caps)>> {
        let instance = Instance::new(Validation::Off, &[])?;
        Ok(instance
            .devices()?
            .into_iter()
            .map(|(device, summary)| (summary, Caps::read(&instance, device, 0)))
            .collect())
    }

    fn create(instance: Instance, options: &GpuOptions, surface: Option<ProbeSurface>) -> Result<Self> {
        let devices = instance.devices()?;
        let rank = |summary: &DeviceSummary| match summary.kind {
            "discrete" => 0,
            "integrated" => 1,
            "virtual" => 2,
            "cpu" => 3,
            _ => 4,
        };
        let chosen = devices
            .iter()
            .filter(|(_, summary)| options.device.matches(summary))
            .min_by_key(|(_, s)| (rank(s), s.index));
        let Some((physical_device, summary)) = chosen.cloned() else {
            let found: Vec<_> = devices
                .iter()
                .map(|(_, s)| format!("{}: {}", s.index, s.name))
                .collect();
            return Err(Error::NoDevice {
                wanted: format!("{:?}", options.device),
                found: if found.is_empty() {
                    "none".into()
                } else {
                    found.join(", ")
                },
            });
        };
        EnabledFeatures::offered(&instance.raw, physical_device).check(&summary.name, "choose another device")?;
        // SAFETY: the physical device belongs to the instance.
        let families = unsafe {
            instance
                .raw
                .get_physical_device_queue_family_properties(physical_device)
        };
        let presents = |family: u32| {
            surface.as_ref().is_none_or(|ProbeSurface { loader, raw }| {
                // SAFETY: surface and physical device belong to the same instance.
                unsafe { loader.get_physical_device_surface_support(physical_device, family, *raw) }.unwrap_or(false)
            })
        };
        let wanted = vk::QueueFlags::COMPUTE | vk::QueueFlags::GRAPHICS;
        let usable = |flags: vk::QueueFlags| {
            (0..families.len() as u32).find(|f| families[*f as usize].queue_flags.contains(flags) && presents(*f))
        };
        let queue_family = usable(wanted)
            .or_else(|| usable(vk::QueueFlags::COMPUTE))
            .ok_or_else(|| Error::MissingFeature {
                feature: "a compute queue".into(),
                needed_by: if surface.is_some() {
                    "presenting to the window"
                } else {
                    "the engine"
                }
                .into(),
                device: summary.name.clone(),
                instead: "choose another device".into(),
            })?;
        let caps = Caps::read(&instance, physical_device, queue_family);
        let device = create_device(
            &instance,
            physical_device,
            queue_family,
            &caps,
            surface.is_some(),
            options,
        )?;
        let presents = surface.is_some();
        // It must go before the instance, which `finish` drops when it fails.
        drop(surface);
        // SAFETY: the family was created with one queue.
        let queue = unsafe { device.get_device_queue(queue_family, 0) };
        Self::finish(
            instance,
            device,
            physical_device,
            (queue, queue_family),
            caps,
            options,
            (true, presents),
        )
    }

    fn finish(
        instance: Instance,
        device: ash::Device,
        physical_device: vk::PhysicalDevice,
        (queue, queue_family): (vk::Queue, u32),
        caps: Caps,
        options: &GpuOptions,
        (owned, presents): (bool, bool),
    ) -> Result<Self> {
        let give_up = |error| {
            if owned {
                // SAFETY: nothing hangs on the device yet, or any more.
                unsafe { device.destroy_device(None) };
            }
            error
        };
        let memory = Memory::new(&instance.raw, &device, physical_device).map_err(give_up)?;
        let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE);
        let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
        // SAFETY: timelineSemaphore is enabled on every device that comes here.
        let timeline = unsafe { device.create_semaphore(&info, None) }.map_err(|result| {
            memory.shut_down();
            give_up(vulkan("vkCreateSemaphore")(result))
        })?;
        let debug = instance
            .debug_utils
            .then(|| ext::debug_utils::Device::new(&instance.raw, &device));
        let pipeline_cache = PipelineCache::open(&device, options.cache_folder.as_deref(), &caps.cache_key);
        let inner = Inner {
            device,
            physical_device,
            queue: Mutex::new(Queue {
                raw: queue,
                last_value: 0,
            }),
            queue_family,
            caps,
            memory,
            debug,
            timeline,
            recycled: Mutex::default(),
            pipelines: Mutex::new(BTreeMap::new()),
            pipeline_cache,
            crash_markers: options.crash_markers,
            validation: options.validation,
            in_flight: Mutex::default(),
            presents,
            lost: OnceLock::new(),
            next_id: AtomicU64::new(1),
            owned,
            instance,
        };
        inner.name(timeline, "timeline");
        Ok(Self { inner: Arc::new(inner) })
    }

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

/// A surface that is only asked whether a device can present to it.
struct ProbeSurface {
    loader: khr::surface::Instance,
    raw: vk::SurfaceKHR,
}

impl Drop for ProbeSurface {
    fn drop(&mut self) {
        // SAFETY: it was only used for queries, and is dropped before its instance.
        unsafe { self.loader.destroy_surface(self.raw, None) };
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

fn create_device(
    instance: &Instance,
    physical_device: vk::PhysicalDevice,
    queue_family: u32,
    caps: &Caps,
    present: bool,
    options: &GpuOptions,
) -> Result<ash::Device> {
    let priorities = [1.0];
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(queue_family)
        .queue_priorities(&priorities)];
    let features = vk::PhysicalDeviceFeatures::default()
        .robust_buffer_access(caps.robust_buffer_access)
        .geometry_shader(caps.geometry_shader)
        .pipeline_statistics_query(caps.pipeline_statistics)
        .shader_int64(caps.int64)
        .shader_float64(caps.float64)
        .fragment_stores_and_atomics(caps.fragment_stores)
        .vertex_pipeline_stores_and_atomics(caps.vertex_stores);
    let mut vulkan12 = vk::PhysicalDeviceVulkan12Features::default()
        .timeline_semaphore(true)
        .scalar_block_layout(true)
        .host_query_reset(true)
        .shader_buffer_int64_atomics(caps.int64_atomics)
        .buffer_device_address(options.validation == Validation::GpuAssisted);
    let mut vulkan13 = vk::PhysicalDeviceVulkan13Features::default()
        .synchronization2(true)
        .dynamic_rendering(true);
    let extensions: Vec<&CStr> = if present {
        vec![khr::swapchain::NAME]
    } else {
        Vec::new()
    };
    let extension_names: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extension_names)
        .enabled_features(&features)
        .push_next(&mut vulkan12)
        .push_next(&mut vulkan13);
    // SAFETY: every pointer in `info` outlives the call, and the features were checked to be offered.
    let device =
        unsafe { instance.raw.create_device(physical_device, &info, None) }.map_err(vulkan("vkCreateDevice"))?;
    Ok(match options.fault {
        None => device,
        Some(plan) => fault::wrap(&instance.raw, &device, plan),
    })
}

/// The error of a window without usable handles.
pub(super) fn no_window(error: raw_window_handle::HandleError) -> Error {
    Error::MissingFeature {
        feature: "a window handle".into(),
        needed_by: "presenting to a window".into(),
        device: "this window system".into(),
        instead: format!("render headless ({error})"),
    }
}
