//! The engine inside a host application: lent devices, a host's command buffers and buffers, several devices at once, several threads,
//! techniques and kernels of the host's own.

mod commands;
mod own_kernels;
mod technique;
mod walk;

use std::ffi::{CStr, c_void};
use std::sync::Mutex;

use clerestory::Error;
use clerestory::gpu::ash::{self, vk};
use clerestory::gpu::{
    Access, BufferDesc, Category, DeviceSelection, EnabledFeatures, Gpu, GpuOptions, HostDevice, OptionalFeatures,
    VALIDATION_LAYER,
};
use clerestory::render::{RenderOptions, Renderer};
use clerestory_tests::shaders::{out_of_bounds, uniform_probe};
use clerestory_tests::{assert_no_messages, gpu, gpu_with, with_gpu};

/// A host's own Vulkan objects, destroyed by the host.
struct Host {
    entry: ash::Entry,
    instance: ash::Instance,
    physical_device: vk::PhysicalDevice,
    device: ash::Device,
    queue: vk::Queue,
    messenger: vk::DebugUtilsMessengerEXT,
    /// What the validation layer has said, and a box so that its address stays.
    messages: Box<Mutex<Vec<String>>>,
}

#[expect(unsafe_code, reason = "a callback from Vulkan")]
unsafe extern "system" fn on_message(
    _: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid data, and `user` is the list in `Host::messages`.
    let (data, messages) = unsafe { (&*data, &*user.cast::<Mutex<Vec<String>>>()) };
    // SAFETY: the text is NUL-terminated.
    let text = unsafe { CStr::from_ptr(data.p_message) };
    // Older layers warn of outputs that are discarded; the engine's own log leaves that out, too.
    let discarded = "of type `VK_FORMAT_UNDEFINED` does not match fragment shader output type";
    if text.to_string_lossy().contains(discarded) {
        return vk::FALSE;
    }
    messages.lock().unwrap().push(text.to_string_lossy().into_owned());
    vk::FALSE
}

#[expect(unsafe_code, reason = "a host that speaks to Vulkan itself")]
impl Host {
    fn new() -> Self {
        // SAFETY: every pointer lives until its call returns.
        unsafe {
            let entry = ash::Entry::load().unwrap();
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            // The layer is always on: it is the witness that nothing of the host's is misused or destroyed.
            let layers = [VALIDATION_LAYER.as_ptr()];
            let extensions = [ash::ext::debug_utils::NAME, ash::ext::validation_features::NAME].map(CStr::as_ptr);
            let checks = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
            let mut checks = vk::ValidationFeaturesEXT::default().enabled_validation_features(&checks);
            let info = vk::InstanceCreateInfo::default()
                .push_next(&mut checks)
                .application_info(&application)
                .enabled_layer_names(&layers)
                .enabled_extension_names(&extensions);
            let instance = entry.create_instance(&info, None).unwrap();
            let messages = Box::<Mutex<Vec<String>>>::default();
            let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
                .message_severity(
                    vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
                )
                .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
                .pfn_user_callback(Some(on_message))
                .user_data(std::ptr::from_ref(&*messages).cast_mut().cast());
            let messenger = ash::ext::debug_utils::Instance::new(&entry, &instance)
                .create_debug_utils_messenger(&info, None)
                .unwrap();
            let physical_device = instance.enumerate_physical_devices().unwrap()[0];
            let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
            let mut features = EnabledFeatures::REQUIRED.to_vulkan();
            let info = features.chain(vk::DeviceCreateInfo::default().queue_create_infos(&queues));
            let device = instance.create_device(physical_device, &info, None).unwrap();
            let queue = device.get_device_queue(0, 0);
            Self {
                entry,
                instance,
                physical_device,
                device,
                queue,
                messenger,
                messages,
            }
        }
    }

    fn lend(&self, enabled: EnabledFeatures) -> clerestory::Result<Gpu> {
        let lent = HostDevice {
            entry: self.entry.clone(),
            instance: self.instance.clone(),
            physical_device: self.physical_device,
            device: self.device.clone(),
            queue: self.queue,
            queue_family: 0,
            enabled,
            debug_utils: true,
        };
        // SAFETY: the handles belong together and outlive the `Gpu`.
        unsafe { Gpu::from_host(lent, &GpuOptions::default()) }
    }

    /// The host's own work: an empty submission with a fence.
    fn work(&self) {
        // SAFETY: nobody else uses the queue now.
        unsafe {
            let fence = self.device.create_fence(&vk::FenceCreateInfo::default(), None).unwrap();
            self.device
                .queue_submit(self.queue, &[vk::SubmitInfo::default()], fence)
                .unwrap();
            self.device.wait_for_fences(&[fence], true, u64::MAX).unwrap();
            self.device.destroy_fence(fence, None);
        }
    }
}

#[expect(unsafe_code, reason = "a host that speaks to Vulkan itself")]
impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: the engine is gone and the queue idle.
        unsafe {
            // The layer lists here what the engine left behind.
            self.device.destroy_device(None);
            ash::ext::debug_utils::Instance::new(&self.entry, &self.instance)
                .destroy_debug_utils_messenger(self.messenger, None);
            self.instance.destroy_instance(None);
        }
        if !std::thread::panicking() {
            let messages = self.messages.lock().unwrap();
            assert!(messages.is_empty(), "{messages:#?}");
        }
    }
}

/// Has the device write `value` into a word and reads it back.
fn round_trip(gpu: &Gpu, value: u32) {
    let pipeline = gpu.compute_pipeline::<out_of_bounds::Kernel>(&()).unwrap();
    let words = gpu.buffer_with("words", Category::Work, &[0u32; 8]).unwrap();
    let mut recorder = gpu.recorder("round trip").unwrap();
    recorder.count_invocations();
    recorder
        .pass("write", |pass| {
            let set = out_of_bounds::Set0 { words: words.view() };
            pass.dispatch(&pipeline, &[&set], &out_of_bounds::Push { index: 5, value }, [1, 1, 1])
        })
        .unwrap();
    recorder.submit().unwrap().wait().unwrap();
    let expected = [0, 0, 0, 0, 0, value, 0, 0];
    assert_eq!(gpu.read::<u32>(words.view(), 8).unwrap(), expected);
}

#[test]
fn a_lent_device_works_and_stays_the_hosts() {
    let host = Host::new();
    for round in 0..2 {
        let gpu = host.lend(EnabledFeatures::REQUIRED).unwrap();
        host.work();
        round_trip(&gpu, 40 + round);
        {
            let queue = gpu.lock_queue();
            assert_eq!(queue.raw(), host.queue);
            host.work();
        }
        round_trip(&gpu, 50 + round);
        drop(gpu);
        host.work();
    }
}

/// A small path-traced picture, with `between` called after every step.
fn path_traced(gpu: &Gpu, between: impl Fn()) -> Vec<f32> {
    let scene = clerestory::scene::load("builtin:cornell-box").unwrap();
    let options = RenderOptions {
        size: [32, 32],
        spp: 4,
        settings: serde_json::json!({"paths_in_flight": 1024}).into(),
        ..RenderOptions::default()
    };
    let mut rendering = Renderer::new(gpu, &scene).unwrap().start(&options).unwrap();
    while rendering.step().unwrap().is_some() {
        between();
    }
    rendering
        .picture()
        .unwrap()
        .layer("radiance")
        .unwrap()
        .values()
        .to_vec()
}

#[test]
fn a_picture_on_a_lent_device_beside_the_hosts_work_is_the_same_to_the_bit() {
    let host = Host::new();
    let gpu = host.lend(EnabledFeatures::REQUIRED).unwrap();
    let name = gpu.caps().device.clone();
    let steps = std::cell::Cell::new(0);
    let lent = path_traced(&gpu, || {
        let _queue = gpu.lock_queue();
        host.work();
        steps.set(steps.get() + 1);
    });
    drop(gpu);
    host.work();
    // With 1024 paths in flight every wave is one sample of all pixels, and takes one step or more.
    assert!(steps.get() >= 4, "{}", steps.get());
    let own = gpu_with(&GpuOptions {
        device: DeviceSelection::Name(name),
        ..GpuOptions::default()
    });
    assert!(lent.iter().any(|value| *value > 0.0));
    assert!(lent == path_traced(&own, || {}), "the pictures differ");
    assert_no_messages(&own);
}

#[test]
fn without_robust_access_a_range_holds_what_its_block_has() {
    let host = Host::new();
    let gpu = host.lend(EnabledFeatures::REQUIRED).unwrap();
    assert!(!gpu.caps().robust_buffer_access);
    let pipeline = gpu.compute_pipeline::<uniform_probe::Kernel>(&()).unwrap();
    let addend = gpu.buffer(&BufferDesc::uniform("addend", 16, Category::Work)).unwrap();
    let words = gpu.buffer(&BufferDesc::storage("words", 32, Category::Work)).unwrap();
    let mut recorder = gpu.recorder("ranges").unwrap();
    recorder
        .pass("ranges", |pass| {
            pass.fill(addend.view(), 3)?;
            pass.fill(words.view(), 4)?;
            pass.memory_barrier(Access::TRANSFER, Access::COMPUTE | Access::COMPUTE_UNIFORM_READ);
            let mut add = |bytes| {
                let set = uniform_probe::Set0 {
                    addend: addend.slice(0, bytes),
                    words: words.view(),
                };
                pass.dispatch(&pipeline, &[&set], &(), [1, 1, 1])
            };
            let short = add(2);
            assert!(
                matches!(&short, Err(Error::LimitExceeded { value: 4, limit: 2, .. })),
                "{short:?}"
            );
            add(16)
        })
        .unwrap();
    recorder.submit().unwrap().wait().unwrap();
    assert_eq!(gpu.read::<u32>(words.view(), 8).unwrap(), [7; 8]);
}

#[test]
fn what_a_host_did_not_enable_counts_as_absent() {
    let host = Host::new();
    let gpu = host.lend(EnabledFeatures::REQUIRED).unwrap();
    let caps = gpu.caps();
    assert!(!caps.pipeline_statistics && !caps.geometry_shader && !caps.int64 && !caps.float64);
    assert!(!caps.robust_buffer_access && !caps.int64_atomics && !caps.fragment_stores && !caps.ray_query);
    drop(gpu);
    let enabled = EnabledFeatures {
        optional: OptionalFeatures {
            geometry_shader: true,
            ..OptionalFeatures::NONE
        },
        ..EnabledFeatures::REQUIRED
    };
    // No geometry shader is used, so that the claim does no harm.
    let offered = gpu_offers_geometry();
    assert_eq!(host.lend(enabled).unwrap().caps().geometry_shader, offered);
}

fn gpu_offers_geometry() -> bool {
    gpu().caps().geometry_shader
}

#[test]
fn a_missing_feature_is_named() {
    let host = Host::new();
    let required = EnabledFeatures::REQUIRED;
    let cases = [
        (
            "synchronization2",
            EnabledFeatures {
                synchronization2: false,
                ..required
            },
        ),
        (
            "dynamicRendering",
            EnabledFeatures {
                dynamic_rendering: false,
                ..required
            },
        ),
        (
            "timelineSemaphore",
            EnabledFeatures {
                timeline_semaphore: false,
                ..required
            },
        ),
        (
            "scalarBlockLayout",
            EnabledFeatures {
                scalar_block_layout: false,
                ..required
            },
        ),
        (
            "hostQueryReset",
            EnabledFeatures {
                host_query_reset: false,
                ..required
            },
        ),
    ];
    for (name, enabled) in cases {
        match host.lend(enabled) {
            Err(Error::MissingFeature { feature, instead, .. }) => {
                assert_eq!(feature, name);
                assert!(instead.contains("creating the device"), "{instead}");
            }
            other => panic!("expected {name} to be missed, got {other:?}"),
        }
    }
    match host.lend(EnabledFeatures::NONE) {
        Err(Error::MissingFeature { feature, .. }) => assert_eq!(
            feature,
            "synchronization2, dynamicRendering, timelineSemaphore, scalarBlockLayout, hostQueryReset"
        ),
        other => panic!("expected all features to be missed, got {other:?}"),
    }
    // A refusal leaves the device usable, too.
    host.work();
}

#[test]
fn two_devices_live_side_by_side() {
    let (first, second) = (gpu(), gpu());
    let a = first.buffer_with("a", Category::Work, &[1u32; 4]).unwrap();
    round_trip(&second, 7);
    let b = second.buffer(&BufferDesc::storage("b", 16, Category::Work)).unwrap();
    assert_no_messages(&first);
    drop((first.clone(), b));
    round_trip(&first, 8);
    drop(second);
    assert_eq!(first.read::<u32>(a.view(), 4).unwrap(), [1; 4]);
    assert_no_messages(&first);
}

#[test]
fn threads_make_devices_of_their_own() {
    std::thread::scope(|scope| {
        for value in 1..4 {
            scope.spawn(move || with_gpu(|gpu| round_trip(gpu, value)));
        }
    });
}
