//! A host application that has a Vulkan device of its own and lends it to the engine.
//!
//! `embed_host_device [FILE] [--size WxH] [--spp N]`
//!
//! The host makes instance, device and queue with the features that the engine asks for and lends them. While the engine path-traces a
//! picture the host goes on submitting work of its own to the same queue; it copies the result by its own commands, and uses its device
//! after the engine has gone.

use std::path::Path;
use std::process::ExitCode;

use clerestory::film::PixelFormat;
use clerestory::gpu::ash::{self, vk};
use clerestory::gpu::{BufferDesc, Category, EnabledFeatures, Gpu, GpuOptions, HostDevice};
use clerestory::render::{RenderOptions, Renderer};
use clerestory::{Error, Result, scene};
use clerestory_samples::arguments::Arguments;

fn main() -> ExitCode {
    clerestory_samples::run_with("embed_host_device", &["--size", "--spp"], sample)
}

fn failed(call: &'static str) -> impl Fn(vk::Result) -> Error {
    move |result| Error::Vulkan { call, result }
}

fn sample(path: &Path, arguments: &Arguments) -> Result<()> {
    let options = RenderOptions {
        size: arguments.size("--size")?.unwrap_or([200, 200]),
        spp: arguments.value("--spp")?.unwrap_or(32),
        ..RenderOptions::default()
    };
    let host = Host::new()?;
    let pixels = host.render(&options)?;
    // The engine and everything made from it are gone; the host's device works on.
    host.submit(vk::CommandBuffer::null())?;
    clerestory_samples::save_png(path, options.size, &pixels)
}

/// What a host application has.
struct Host {
    entry: ash::Entry,
    instance: ash::Instance,
    physical_device: vk::PhysicalDevice,
    device: ash::Device,
    queue: vk::Queue,
    queue_family: u32,
}

#[expect(unsafe_code, reason = "a host that speaks to Vulkan itself")]
impl Host {
    /// A device with exactly the features of [`EnabledFeatures::REQUIRED`].
    fn new() -> Result<Self> {
        // SAFETY: every pointer lives until its call returns, and every handle comes from the line before.
        unsafe {
            let entry = ash::Entry::load().map_err(|error| Error::NoVulkan(error.to_string()))?;
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            let info = vk::InstanceCreateInfo::default().application_info(&application);
            let instance = entry.create_instance(&info, None).map_err(failed("vkCreateInstance"))?;
            let none = || Error::NoDevice {
                wanted: "a device with a compute queue".into(),
                found: "none".into(),
            };
            let physical_device = instance
                .enumerate_physical_devices()
                .map_err(failed("vkEnumeratePhysicalDevices"))?
                .into_iter()
                .next()
                .ok_or_else(none)?;
            let queue_family = instance
                .get_physical_device_queue_family_properties(physical_device)
                .iter()
                .position(|family| family.queue_flags.contains(vk::QueueFlags::COMPUTE))
                .ok_or_else(none)? as u32;
            let queues = [vk::DeviceQueueCreateInfo::default()
                .queue_family_index(queue_family)
                .queue_priorities(&[1.0])];
            let mut features = EnabledFeatures::REQUIRED.to_vulkan();
            let info = features.chain(vk::DeviceCreateInfo::default().queue_create_infos(&queues));
            let device = instance
                .create_device(physical_device, &info, None)
                .map_err(failed("vkCreateDevice"))?;
            let queue = device.get_device_queue(queue_family, 0);
            Ok(Self {
                entry,
                instance,
                physical_device,
                device,
                queue,
                queue_family,
            })
        }
    }

    /// Lends the device, has the engine render beside the host's own work, and copies the result by the host's own commands.
    fn render(&self, options: &RenderOptions) -> Result<Vec<u8>> {
        let lent = HostDevice {
            entry: self.entry.clone(),
            instance: self.instance.clone(),
            physical_device: self.physical_device,
            device: self.device.clone(),
            queue: self.queue,
            queue_family: self.queue_family,
            enabled: EnabledFeatures::REQUIRED,
            debug_utils: false,
        };
        // SAFETY: the handles belong together and outlive the `Gpu`; the features are those of `new`.
        let gpu = unsafe { Gpu::from_host(lent, &GpuOptions::default()) }?;
        let [width, height] = options.size;
        let bytes = 4 * width as usize * height as usize;
        let rendered = gpu.buffer(&BufferDesc::storage("displayed picture", bytes as u64, Category::Film))?;
        let scene = scene::load("builtin:cornell-box")?;
        let mut rendering = Renderer::new(&gpu, &scene)?.start(options)?;
        while rendering.step()?.is_some() {
            // The queue is the engine's too: the lock keeps the two from submitting at once.
            let _guard = gpu.lock_queue();
            self.submit(vk::CommandBuffer::null())?;
        }
        rendering.display(&rendered, scene.defaults.exposure, PixelFormat::Rgba8)?;
        let readback = gpu.buffer(&BufferDesc::readback("the host's copy", bytes as u64))?;

        let pool = vk::CommandPoolCreateInfo::default().queue_family_index(self.queue_family);
        // SAFETY: the engine has waited for its own work, so the buffers are idle until the host's submission, which is waited for below.
        unsafe {
            let pool = self
                .device
                .create_command_pool(&pool, None)
                .map_err(failed("vkCreateCommandPool"))?;
            let recorded = self.record_copy(pool, rendered.raw(), readback.raw(), bytes as u64);
            let guard = gpu.lock_queue();
            let result = recorded.and_then(|commands| self.submit(commands));
            drop(guard);
            self.device.destroy_command_pool(pool, None);
            result?;
        }
        readback.read(0, bytes)
    }

    fn record_copy(
        &self,
        pool: vk::CommandPool,
        from: vk::Buffer,
        to: vk::Buffer,
        size: u64,
    ) -> Result<vk::CommandBuffer> {
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(pool)
            .command_buffer_count(1);
        let visible = |source, source_access, target, target_access| {
            [vk::MemoryBarrier2::default()
                .src_stage_mask(source)
                .src_access_mask(source_access)
                .dst_stage_mask(target)
                .dst_access_mask(target_access)]
        };
        let (copy, write) = (vk::PipelineStageFlags2::COPY, vk::AccessFlags2::TRANSFER_WRITE);
        let before = visible(
            vk::PipelineStageFlags2::ALL_COMMANDS,
            vk::AccessFlags2::MEMORY_WRITE,
            copy,
            vk::AccessFlags2::TRANSFER_READ,
        );
        let after = visible(copy, write, vk::PipelineStageFlags2::HOST, vk::AccessFlags2::HOST_READ);
        // SAFETY: both buffers hold `size` bytes and live until the host has waited.
        unsafe {
            let commands = self
                .device
                .allocate_command_buffers(&info)
                .map_err(failed("vkAllocateCommandBuffers"))?[0];
            let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
            self.device
                .begin_command_buffer(commands, &begin)
                .map_err(failed("vkBeginCommandBuffer"))?;
            self.device
                .cmd_pipeline_barrier2(commands, &vk::DependencyInfo::default().memory_barriers(&before));
            self.device
                .cmd_copy_buffer(commands, from, to, &[vk::BufferCopy::default().size(size)]);
            self.device
                .cmd_pipeline_barrier2(commands, &vk::DependencyInfo::default().memory_barriers(&after));
            self.device
                .end_command_buffer(commands)
                .map_err(failed("vkEndCommandBuffer"))?;
            Ok(commands)
        }
    }

    /// Submits commands (none when null) on the host's queue and waits for it.
    fn submit(&self, commands: vk::CommandBuffer) -> Result<()> {
        let commands: Vec<_> = [commands]
            .into_iter()
            .filter(|raw| *raw != vk::CommandBuffer::null())
            .collect();
        let info = vk::SubmitInfo::default().command_buffers(&commands);
        // SAFETY: the queue is not used by anyone else at this time.
        unsafe {
            self.device
                .queue_submit(self.queue, &[info], vk::Fence::null())
                .map_err(failed("vkQueueSubmit"))?;
            self.device
                .queue_wait_idle(self.queue)
                .map_err(failed("vkQueueWaitIdle"))
        }
    }
}

#[expect(unsafe_code, reason = "a host that speaks to Vulkan itself")]
impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: the engine is gone and the queue idle.
        unsafe {
            self.device.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}
