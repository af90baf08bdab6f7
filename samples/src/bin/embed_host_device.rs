//! A host application with a Vulkan device and a frame of its own: work of the engine goes into the host's command buffer.
//!
//! `embed_host_device [FILE] [--size WxH] [--samples N]`
//!
//! The host makes instance, device and queue with the features that the engine asks for, and buffers; it lends all of them. Into one
//! command buffer go its copies in, the engine's sort, the build of a hierarchy and a preview, and its copies out; it submits once and waits
//! for its own fence. The picture is a preview of the Cornell box over a strip of sorted greys. The device outlives the engine.

use std::path::Path;
use std::process::ExitCode;

use clerestory::accel::lbvh::{BuildQuality, LbvhBuilder, LbvhSettings};
use clerestory::film::PixelFormat;
use clerestory::gpu::ash::{self, vk};
use clerestory::gpu::{
    BorrowDesc, Buffer, BufferDesc, Category, EnabledFeatures, Gpu, GpuOptions, HostBuffer, HostDevice, Recorder,
};
use clerestory::kernels::{Count, KeyWidth, RadixSort, RadixSortOptions, SortBuffers};
use clerestory::raster::ShadowLayout;
use clerestory::scene::{LightKind, Scene};
use clerestory::techniques::preview::{Preview, PreviewDesc, PreviewPart, PreviewShadows};
use clerestory::transport::GpuScene;
use clerestory::{Error, Result, scene};
use clerestory_samples::arguments::Arguments;
use glam::{DVec3, Vec3};

/// Rows of the strip of sorted greys below the picture.
const STRIP: u32 = 8;
/// Triangles of the host's, which the hierarchy is built over.
const TRIANGLES: u32 = 4096;
/// Corners of one of them from its place, millimetres.
const SHAPE: [[u32; 3]; 3] = [[0, 0, 0], [90, 0, 20], [10, 80, 0]];

fn main() -> ExitCode {
    clerestory_samples::run_with("embed_host_device", &["--size", "--samples"], sample)
}

fn failed(call: &'static str) -> impl Fn(vk::Result) -> Error {
    move |result| Error::Vulkan { call, result }
}

fn sample(path: &Path, arguments: &Arguments) -> Result<()> {
    let size = arguments.size("--size")?.unwrap_or([200, 200]);
    let samples = arguments.value("--samples")?.unwrap_or(4);
    let host = Host::new()?;
    let pixels = host.frame(size, samples)?;
    // The engine and everything made from it are gone; the host's device works on.
    host.submit(vk::CommandBuffer::null())?;
    clerestory_samples::save_png(path, [size[0], size[1] + STRIP], &pixels)
}

/// The Cornell box with a lamp below its ceiling: a preview is lit by lamps, not by surfaces.
fn lit_box() -> Result<(Scene, Vec<LightKind>)> {
    let scene = scene::load("builtin:cornell-box")?;
    let bounds = scene::SceneProfile::of(&scene).bounds;
    let [lower, upper] = bounds
        .unwrap_or_default()
        .map(|corner| DVec3::from_array(corner).as_vec3());
    let size = upper - lower;
    let lamp = LightKind::Point {
        position: lower.midpoint(upper) + 0.35 * size * Vec3::Y,
        intensity: Vec3::splat(0.2 * size.length_squared()),
    };
    Ok((scene, vec![lamp]))
}

/// Numbers that look like chance.
fn numbers() -> impl Iterator<Item = u32> {
    (1u32..).map(|i| {
        let mixed = i.wrapping_mul(0x9E37_79B9);
        (mixed ^ mixed >> 15).wrapping_mul(0x85EB_CA6B) >> 8
    })
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
                wanted: "a device whose queue computes and draws".into(),
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
                .position(|family| {
                    family
                        .queue_flags
                        .contains(vk::QueueFlags::COMPUTE | vk::QueueFlags::GRAPHICS)
                })
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

    fn lend(&self) -> Result<Gpu> {
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
        unsafe { Gpu::from_host(lent, &GpuOptions::default()) }
    }

    /// One frame: everything that it needs is made, recorded in one command buffer, submitted once, and waited for.
    fn frame(&self, size: [u32; 2], samples: u32) -> Result<Vec<u8>> {
        let gpu = self.lend()?;
        let [width, height] = size;
        let (count, strip_bytes) = (width * STRIP, 4 * u64::from(width * STRIP));
        let shown_bytes = 4 * u64::from(width) * u64::from(height);

        // The host's buffers, dropped after what the engine makes of them.
        let mut own = HostBuffers::new(self, &gpu);
        let greys = own.make("greys", strip_bytes, vk::BufferUsageFlags::TRANSFER_SRC)?;
        let texels = vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER;
        let sides = [
            own.make("keys", strip_bytes, texels)?,
            own.make("other keys", strip_bytes, texels)?,
        ];
        let corners = own.make("corners", 36 * u64::from(TRIANGLES), vk::BufferUsageFlags::empty())?;
        let names = own.make("names", 4 * u64::from(TRIANGLES), vk::BufferUsageFlags::empty())?;
        let picture = own.make("picture", shown_bytes + strip_bytes, vk::BufferUsageFlags::empty())?;
        let root = own.make("root", 64, vk::BufferUsageFlags::empty())?;
        let grey = |word: u32| 0xFF00_0000 | ((word & 0xFF) * 0x01_0101);
        own.write(&greys, numbers().take(count as usize).map(grey))?;
        let places: Vec<u32> = numbers().take(3 * TRIANGLES as usize).collect();
        let triangle = |place: &[u32]| {
            (0..9)
                .map(|i| place[i % 3] % 1000 * 8 + SHAPE[i / 3][i % 3])
                .collect::<Vec<_>>()
        };
        let millimetres = places.chunks_exact(3).flat_map(triangle);
        own.write(&corners, millimetres.map(|length| (length as f32 * 1e-3).to_bits()))?;
        own.write(&names, 0..TRIANGLES)?;

        // What the engine needs beside them is asked for before.
        let sort = RadixSort::new(&gpu, RadixSortOptions::new(KeyWidth::Bits32, false))?;
        let format = vk::Format::R32G32B32A32_UINT;
        let keys = [
            gpu.texel_view_of(&sides[0], format)?,
            gpu.texel_view_of(&sides[1], format)?,
        ];
        let scratch = BufferDesc::storage("scratch", sort.scratch_bytes(count), Category::Work);
        let scratch = gpu.buffer(&scratch)?;
        let builder = LbvhBuilder::new(
            &gpu,
            &LbvhSettings {
                quality: BuildQuality::Fast,
                ..LbvhSettings::default()
            },
        )?;
        let hierarchy = builder.buffers_over(TRIANGLES, &corners, &names)?;
        let (scene, lights) = lit_box()?;
        let on_device = GpuScene::new(&gpu, &scene)?;
        let mut preview = Preview::new(
            &gpu,
            &on_device,
            PreviewDesc {
                size,
                samples,
                lights: lights.len() as u32,
                shadows: Some(PreviewShadows {
                    layout: ShadowLayout::Cube,
                    ..PreviewShadows::default()
                }),
                probes: None,
            },
        )?;

        let commands = own.commands()?;
        self.copy(commands, (&greys, 0), (&sides[0], 0), strip_bytes);
        // SAFETY: the command buffer is recorded here alone, and what was recorded is dropped after its fence.
        let mut recorder = unsafe {
            Recorder::borrow(
                &gpu,
                &BorrowDesc {
                    timestamps: true,
                    ..BorrowDesc::new("the host's frame", commands)
                },
            )
        }?;
        let buffers = SortBuffers {
            keys: [&keys[0], &keys[1]],
            values: None,
        };
        let side = recorder.pass("sort", |pass| sort.record(pass, &buffers, Count::Host(count), &scratch))?;
        builder.record_traversable(&mut recorder, &hierarchy)?;
        let surfaces = on_device.surfaces();
        let everything = PreviewPart {
            triangles: 0..surfaces.triangles,
            background: true,
            probe: None,
        };
        let camera = scene
            .cameras
            .first()
            .ok_or_else(|| Error::scene(&scene.source, "cameras", "are none"))?;
        preview.record_lights(&mut recorder, &surfaces, &lights)?;
        preview.record(&mut recorder, &on_device, &surfaces, camera, &[everything])?;
        preview.record_display(&mut recorder, &picture, scene.defaults.exposure, PixelFormat::Rgba8)?;
        let recorded = recorder.finish()?;
        self.barrier(
            commands,
            vk::AccessFlags2::TRANSFER_READ | vk::AccessFlags2::TRANSFER_WRITE,
        );
        self.copy(commands, (&sides[side], 0), (&picture, shown_bytes), strip_bytes);
        self.copy(commands, (hierarchy.quarters.buffer(), 0), (&root, 0), 64);
        self.barrier(commands, vk::AccessFlags2::HOST_READ);
        // SAFETY: the command buffer is recording.
        unsafe { self.device.end_command_buffer(commands) }.map_err(failed("vkEndCommandBuffer"))?;
        let guard = gpu.lock_queue();
        self.submit(commands)?;
        drop(guard);

        let timings = recorded.timings();
        for pass in &timings.passes {
            println!(
                "{:24} {:8.3} ms",
                pass.name,
                pass.nanoseconds.unwrap_or(0) as f64 * 1e-6
            );
        }
        let boxes: Vec<f32> = own.read(&root)?.into_iter().map(f32::from_bits).collect();
        println!(
            "the hierarchy's halves: {:?} to {:?}, {:?} to {:?}",
            &boxes[..3],
            &boxes[3..6],
            &boxes[6..9],
            &boxes[9..12]
        );
        let words = own.read(&picture)?;
        Ok(words.into_iter().flat_map(u32::to_le_bytes).collect())
    }

    /// A barrier of the host's own: everything before, then its copies or its reads.
    fn barrier(&self, commands: vk::CommandBuffer, to: vk::AccessFlags2) {
        let reads = to == vk::AccessFlags2::HOST_READ;
        let stage = if reads {
            vk::PipelineStageFlags2::HOST
        } else {
            vk::PipelineStageFlags2::ALL_TRANSFER
        };
        let barrier = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(stage)
            .dst_access_mask(to)];
        let info = vk::DependencyInfo::default().memory_barriers(&barrier);
        // SAFETY: the command buffer is recording.
        unsafe { self.device.cmd_pipeline_barrier2(commands, &info) };
    }

    /// A copy of the host's own.
    fn copy(&self, commands: vk::CommandBuffer, from: (&Buffer, u64), to: (&Buffer, u64), size: u64) {
        let region = [vk::BufferCopy {
            src_offset: from.1,
            dst_offset: to.1,
            size,
        }];
        // SAFETY: the command buffer is recording, and both buffers hold so much.
        unsafe { self.device.cmd_copy_buffer(commands, from.0.raw(), to.0.raw(), &region) };
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

/// Buffers of the host's in memory of the host's, mapped; and its command pool.
struct HostBuffers<'a> {
    host: &'a Host,
    gpu: &'a Gpu,
    pool: vk::CommandPool,
    made: Vec<(vk::Buffer, vk::DeviceMemory)>,
}

#[expect(unsafe_code, reason = "a host that speaks to Vulkan itself")]
impl<'a> HostBuffers<'a> {
    fn new(host: &'a Host, gpu: &'a Gpu) -> Self {
        Self {
            host,
            gpu,
            pool: vk::CommandPool::null(),
            made: Vec::new(),
        }
    }

    /// A storage buffer of the host's, lent to the engine.
    fn make(&mut self, name: &str, bytes: u64, usage: vk::BufferUsageFlags) -> Result<Buffer> {
        let usage = usage
            | vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        let info = vk::BufferCreateInfo::default().size(bytes).usage(usage);
        let Host {
            device,
            instance,
            physical_device,
            ..
        } = self.host;
        // SAFETY: every handle is alive; what is made is destroyed in `drop`.
        unsafe {
            let raw = device.create_buffer(&info, None).map_err(failed("vkCreateBuffer"))?;
            self.made.push((raw, vk::DeviceMemory::null()));
            let wanted = device.get_buffer_memory_requirements(raw);
            let memory = instance.get_physical_device_memory_properties(*physical_device);
            let mapped = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
            // Vulkan promises one for every buffer.
            let fits = |kind: &u32| {
                wanted.memory_type_bits >> kind & 1 == 1
                    && memory.memory_types[*kind as usize].property_flags.contains(mapped)
            };
            let kind = (0..memory.memory_type_count).find(fits).unwrap_or_default();
            let info = vk::MemoryAllocateInfo::default()
                .allocation_size(wanted.size)
                .memory_type_index(kind);
            let memory = device
                .allocate_memory(&info, None)
                .map_err(failed("vkAllocateMemory"))?;
            if let Some(last) = self.made.last_mut() {
                last.1 = memory;
            }
            device
                .bind_buffer_memory(raw, memory, 0)
                .map_err(failed("vkBindBufferMemory"))?;
            self.gpu.borrow_buffer(&HostBuffer {
                name,
                raw,
                offset: 0,
                bytes,
                usage,
            })
        }
    }

    fn mapped(&self, buffer: &Buffer, with: impl FnOnce(&mut [u32])) -> Result<()> {
        let found = self.made.iter().find(|(raw, _)| *raw == buffer.raw());
        let Some((_, memory)) = found else { return Ok(()) };
        // SAFETY: the memory holds the buffer, is mapped once at a time, and the device does not use it now.
        unsafe {
            let device = &self.host.device;
            let words = device
                .map_memory(*memory, 0, buffer.bytes(), vk::MemoryMapFlags::empty())
                .map_err(failed("vkMapMemory"))?;
            with(std::slice::from_raw_parts_mut(
                words.cast(),
                buffer.bytes() as usize / 4,
            ));
            device.unmap_memory(*memory);
        }
        Ok(())
    }

    fn write(&self, buffer: &Buffer, words: impl Iterator<Item = u32>) -> Result<()> {
        self.mapped(buffer, |room| {
            room.iter_mut().zip(words).for_each(|(to, word)| *to = word)
        })
    }

    fn read(&self, buffer: &Buffer) -> Result<Vec<u32>> {
        let mut read = Vec::new();
        self.mapped(buffer, |words| read = words.to_vec())?;
        Ok(read)
    }

    /// A command buffer that is recording.
    fn commands(&mut self) -> Result<vk::CommandBuffer> {
        let device = &self.host.device;
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(self.host.queue_family);
        // SAFETY: plain creation on a live device.
        unsafe {
            self.pool = device
                .create_command_pool(&info, None)
                .map_err(failed("vkCreateCommandPool"))?;
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(self.pool)
                .command_buffer_count(1);
            let commands = device
                .allocate_command_buffers(&info)
                .map_err(failed("vkAllocateCommandBuffers"))?[0];
            let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
            device
                .begin_command_buffer(commands, &begin)
                .map_err(failed("vkBeginCommandBuffer"))?;
            Ok(commands)
        }
    }
}

#[expect(unsafe_code, reason = "a host that speaks to Vulkan itself")]
impl Drop for HostBuffers<'_> {
    fn drop(&mut self) {
        let device = &self.host.device;
        // SAFETY: the submission was waited for; null handles are allowed.
        unsafe {
            device.destroy_command_pool(self.pool, None);
            for (buffer, memory) in &self.made {
                device.destroy_buffer(*buffer, None);
                device.free_memory(*memory, None);
            }
        }
    }
}
