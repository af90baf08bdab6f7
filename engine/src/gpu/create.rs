//! Making a device: choosing and creating one of this machine's, or borrowing a host's.

use std::collections::BTreeMap;
use std::ffi::CStr;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, OnceLock};

use ash::{ext, khr, vk};
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};

use super::caps::{Caps, DeviceKind};
use super::device::{Gpu, Inner, Queue};
use super::fault;
use super::host::{DeviceFeatures, EnabledFeatures, HostDevice, OptionalFeatures, RAY_QUERY_EXTENSIONS};
use super::instance::{DeviceSummary, Instance, surface_extensions, vulkan};
use super::memory::Memory;
use super::options::{GpuOptions, Validation};
use super::pipeline_cache::PipelineCache;
use crate::{Error, Result};

impl Gpu {
    /// A device without a window system.
    ///
    /// # Errors
    /// [`Error::NoVulkan`] without a loader, [`Error::NoDevice`] when none matches, [`Error::MissingFeature`] when it lacks the baseline,
    /// [`Error::Setting`] for an unknown value of `CLERESTORY_VALIDATION` where the options leave it to that.
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
    /// [`Gpu::lock_queue`] around the host's own submissions. Without `robustBufferAccess` nothing keeps kernels in their buffers: then whatever
    /// indices kernels find in what they are given lie in what they are given, and of scenes and pictures from elsewhere the host knows that.
    ///
    /// # Errors
    /// [`Error::MissingFeature`] naming the required features that the host did not enable; [`Error::Setting`] as [`Gpu::headless`].
    pub unsafe fn from_host(host: HostDevice, options: &GpuOptions) -> Result<Self> {
        let validation = options.validation.resolve()?;
        let instance = Instance::from_host(host.entry, host.instance, host.debug_utils, validation);
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
            (false, false, None),
        )
    }

    /// The devices of this machine, with what they offer; a `Gpu` made of one has the capabilities that it enables.
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
            DeviceKind::Discrete => 0,
            DeviceKind::Integrated => 1,
            DeviceKind::Virtual => 2,
            DeviceKind::Cpu => 3,
            DeviceKind::Other => 4,
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
        let mut enabled = EnabledFeatures::from_vulkan(&DeviceFeatures::offered(&instance.raw, physical_device));
        enabled.check(&summary.name, "choose another device")?;
        // Nothing uses it yet.
        enabled.optional.descriptor_indexing = false;
        if let Some(features) = options.lesser.features {
            // What keeps kernels in their buffers is not an option's to take away; every device has it.
            let robust_buffer_access = enabled.optional.robust_buffer_access;
            enabled.optional = enabled.optional.and(features);
            enabled.optional.robust_buffer_access = robust_buffer_access;
        }
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
        let mut caps = Caps::read(&instance, physical_device, queue_family);
        let wanted = options.lesser.features.unwrap_or(OptionalFeatures {
            shader_viewport_index_layer: true,
            ..OptionalFeatures::NONE
        });
        enabled.optional.shader_viewport_index_layer = caps.vertex_layer && wanted.shader_viewport_index_layer;
        enabled.restrict(&mut caps);
        let fault = options.fault.map(|_| fault::Claim::take()).transpose()?;
        let device = create_device(
            &instance,
            physical_device,
            queue_family,
            &enabled,
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
            (true, presents, fault),
        )
    }

    fn finish(
        instance: Instance,
        device: ash::Device,
        physical_device: vk::PhysicalDevice,
        (queue, queue_family): (vk::Queue, u32),
        mut caps: Caps,
        options: &GpuOptions,
        (owned, presents, fault): (bool, bool, Option<fault::Claim>),
    ) -> Result<Self> {
        caps.pretend(&options.lesser);
        let give_up = |error| {
            if owned {
                // SAFETY: nothing hangs on the device yet, or any more.
                unsafe { device.destroy_device(None) };
            }
            error
        };
        let heap_bytes = options.lesser.heap_bytes;
        let memory =
            Memory::new(&instance.raw, &device, physical_device, heap_bytes, caps.ray_query).map_err(give_up)?;
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
        let structures = caps
            .ray_query
            .then(|| khr::acceleration_structure::Device::new(&instance.raw, &device));
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
            structures,
            timeline,
            recycled: Mutex::default(),
            pipelines: Mutex::new(BTreeMap::new()),
            pipeline_cache,
            crash_markers: options.crash_markers,
            validation: instance.validation,
            in_flight: Mutex::default(),
            presents,
            lost: OnceLock::new(),
            next_id: AtomicU64::new(1),
            _fault: fault,
            owned,
            instance,
        };
        inner.name(timeline, "timeline");
        Ok(Self {
            inner: Arc::new(inner),
            kept: Arc::default(),
        })
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

fn create_device(
    instance: &Instance,
    physical_device: vk::PhysicalDevice,
    queue_family: u32,
    enabled: &EnabledFeatures,
    present: bool,
    options: &GpuOptions,
) -> Result<ash::Device> {
    let priorities = [1.0];
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(queue_family)
        .queue_priorities(&priorities)];
    let mut features = enabled.to_vulkan();
    if instance.validation == Validation::GpuAssisted {
        features.vulkan12.buffer_device_address = vk::TRUE;
    }
    let optional = &enabled.optional;
    let extensions: Vec<&CStr> = [
        (present, khr::swapchain::NAME),
        (
            optional.shader_viewport_index_layer,
            ext::shader_viewport_index_layer::NAME,
        ),
    ]
    .into_iter()
    .chain(RAY_QUERY_EXTENSIONS.map(|name| (optional.ray_query, name)))
    .filter_map(|(wanted, name)| wanted.then_some(name))
    .collect();
    let extension_names: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extension_names);
    let info = features.chain(info);
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
