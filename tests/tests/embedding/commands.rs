//! Recording into a host's command buffer, over its buffers: one submission with passes of the host's own in between.

use std::panic::{AssertUnwindSafe, catch_unwind};

use clerestory::accel::lbvh::{BuildQuality, LbvhBuilder, LbvhSettings, build};
use clerestory::accel::trace::{RayTracer, TraceSettings};
use clerestory::accel::{DeviceTraversal, Hit, Ray, RayIndex};
use clerestory::film::PixelFormat;
use clerestory::gpu::ash::{self, vk};
use clerestory::gpu::{
    Access, BorrowDesc, Buffer, BufferDesc, Category, EnabledFeatures, Gpu, HostBuffer, Recorder, rw_compute_to_compute,
};
use clerestory::kernels::{Count, KeyWidth, RadixSort, RadixSortOptions, SortBuffers};
use clerestory::raster::ShadowLayout;
use clerestory::scene::{LightKind, Scene, SceneProfile};
use clerestory::techniques::preview::{Preview, PreviewDesc, PreviewPart, PreviewShadows};
use clerestory::transport::GpuScene;
use clerestory::{Error, Result};
use clerestory_tests::random::Random;
use clerestory_tests::shaders::out_of_bounds;
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec3};

use crate::Host;

/// A host's buffer begins here in its Vulkan buffer.
const OFFSET: u64 = 512;

/// What a host has besides the engine: a command buffer, a fence, and buffers, by Vulkan alone.
struct Own<'a> {
    gpu: &'a Gpu,
    device: ash::Device,
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    buffers: Vec<(vk::Buffer, vk::DeviceMemory)>,
}

#[expect(unsafe_code, reason = "a host that speaks to Vulkan itself")]
impl<'a> Own<'a> {
    fn new(gpu: &'a Gpu) -> Self {
        let device = gpu.raw_device().clone();
        let pool = vk::CommandPoolCreateInfo::default()
            .queue_family_index(gpu.queue_family())
            .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
        // SAFETY: plain creation on a live device.
        unsafe {
            let pool = device.create_command_pool(&pool, None).unwrap();
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(pool)
                .command_buffer_count(1);
            Self {
                gpu,
                pool,
                commands: device.allocate_command_buffers(&info).unwrap()[0],
                fence: device.create_fence(&vk::FenceCreateInfo::default(), None).unwrap(),
                buffers: Vec::new(),
                device,
            }
        }
    }

    /// A Vulkan buffer of the host's, lent from [`OFFSET`] on.
    fn lend(&mut self, name: &str, bytes: u64, usage: vk::BufferUsageFlags) -> Buffer {
        let usage = usage | vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
        let info = vk::BufferCreateInfo::default().size(OFFSET + bytes).usage(usage);
        // SAFETY: plain creation; the buffer and its memory are destroyed in `drop`, when nothing uses them.
        unsafe {
            let raw = self.device.create_buffer(&info, None).unwrap();
            let wanted = self.device.get_buffer_memory_requirements(raw);
            let info = vk::MemoryAllocateInfo::default()
                .allocation_size(wanted.size)
                .memory_type_index(wanted.memory_type_bits.trailing_zeros());
            let memory = self.device.allocate_memory(&info, None).unwrap();
            self.device.bind_buffer_memory(raw, memory, 0).unwrap();
            self.buffers.push((raw, memory));
            let lent = HostBuffer {
                name,
                raw,
                offset: OFFSET,
                bytes,
                usage,
            };
            self.gpu.borrow_buffer(&lent).unwrap()
        }
    }

    fn begin(&self, flags: vk::CommandBufferUsageFlags) {
        let info = vk::CommandBufferBeginInfo::default().flags(flags);
        // SAFETY: the command buffer is idle.
        unsafe { self.device.begin_command_buffer(self.commands, &info) }.unwrap();
    }

    /// The engine's recorder on the host's command buffer.
    fn borrow(&self, timestamps: bool, opening_barrier: bool) -> Result<clerestory::gpu::BorrowedRecorder> {
        let desc = BorrowDesc {
            timestamps,
            opening_barrier,
            ..BorrowDesc::new("host's frame", self.commands)
        };
        // SAFETY: the command buffer is recorded here alone, and tests wait before they drop what was recorded.
        unsafe { Recorder::borrow(self.gpu, &desc) }
    }

    fn barrier(&self, from: vk::AccessFlags2, to: vk::AccessFlags2) {
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        let stage = if to == vk::AccessFlags2::HOST_READ {
            vk::PipelineStageFlags2::HOST
        } else {
            all
        };
        let barrier = [vk::MemoryBarrier2::default()
            .src_stage_mask(all)
            .src_access_mask(from)
            .dst_stage_mask(stage)
            .dst_access_mask(to)];
        let info = vk::DependencyInfo::default().memory_barriers(&barrier);
        // SAFETY: the command buffer is recording.
        unsafe { self.device.cmd_pipeline_barrier2(self.commands, &info) };
    }

    /// The host's own copy between the beginnings of two buffers.
    fn copy(&self, from: &Buffer, to: &Buffer, size: u64) {
        let region = [vk::BufferCopy {
            src_offset: from.raw_offset(),
            dst_offset: to.raw_offset(),
            size,
        }];
        // SAFETY: both hold so many bytes, and live until the fence was waited for.
        unsafe {
            self.device
                .cmd_copy_buffer(self.commands, from.raw(), to.raw(), &region)
        };
    }

    fn end(&self) {
        // SAFETY: the command buffer is recording.
        unsafe { self.device.end_command_buffer(self.commands) }.unwrap();
    }

    /// The one submission, and the wait for its fence.
    fn submit(&self) {
        let queue = self.gpu.lock_queue();
        let commands = [self.commands];
        let info = vk::SubmitInfo::default().command_buffers(&commands);
        // SAFETY: the queue is locked, and everything that the commands use is alive.
        unsafe {
            self.device.queue_submit(queue.raw(), &[info], self.fence).unwrap();
            self.device.wait_for_fences(&[self.fence], true, u64::MAX).unwrap();
            self.device.reset_fences(&[self.fence]).unwrap();
        }
    }
}

#[expect(unsafe_code, reason = "a host that speaks to Vulkan itself")]
impl Drop for Own<'_> {
    fn drop(&mut self) {
        // SAFETY: every submission was waited for.
        unsafe {
            self.device.destroy_fence(self.fence, None);
            self.device.destroy_command_pool(self.pool, None);
            for (buffer, memory) in self.buffers.drain(..) {
                self.device.destroy_buffer(buffer, None);
                self.device.free_memory(memory, None);
            }
        }
    }
}

/// Data on its way to the device, and a place for what comes back, mapped by the engine and copied by the host.
fn staged<T: bytemuck::Pod>(gpu: &Gpu, data: &[T]) -> Buffer {
    let buffer = gpu
        .buffer(&BufferDesc::upload("host's data", size_of_val(data) as u64))
        .unwrap();
    buffer.write(0, data).unwrap();
    buffer
}

fn room_for(gpu: &Gpu, bytes: u64) -> Buffer {
    gpu.buffer(&BufferDesc::readback("host's copy", bytes)).unwrap()
}

const STORAGE: vk::BufferUsageFlags = vk::BufferUsageFlags::STORAGE_BUFFER;
const TEXELS: vk::BufferUsageFlags =
    vk::BufferUsageFlags::from_raw(STORAGE.as_raw() | vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER.as_raw());
const SIZE: [u32; 2] = [24, 24];

/// The Cornell box with a lamp that casts shadows.
fn scene() -> Scene {
    let mut scene = clerestory::scene::load("builtin:cornell-box").unwrap();
    let [lower, upper] = SceneProfile::of(&scene)
        .bounds
        .unwrap()
        .map(|corner| DVec3::from_array(corner).as_vec3());
    let position = lower.midpoint(upper) + 0.3 * (upper - lower) * Vec3::Y;
    scene.add_light(
        "lamp",
        LightKind::Point {
            position,
            intensity: Vec3::splat(0.2 * (upper - lower).length_squared()),
        },
    );
    scene
}

fn preview(gpu: &Gpu, scene: &GpuScene) -> Preview {
    let desc = PreviewDesc {
        size: SIZE,
        samples: 1,
        lights: 1,
        shadows: Some(PreviewShadows {
            layout: ShadowLayout::Cube,
            side: 64,
            width: 1,
            suns: 0,
        }),
        probes: None,
    };
    Preview::new(gpu, scene, desc).unwrap()
}

/// Lights, picture and display of a preview, into whatever command buffer.
fn record_preview(recorder: &mut Recorder, preview: &mut Preview, scene: &Scene, on_device: &GpuScene, to: &Buffer) {
    let surfaces = on_device.surfaces();
    let lights: Vec<_> = scene.lights.iter().map(|light| light.kind).collect();
    let part = PreviewPart {
        triangles: 0..surfaces.triangles,
        background: true,
        probe: None,
    };
    preview.record_lights(recorder, &surfaces, &lights).unwrap();
    preview
        .record(recorder, on_device, &surfaces, &scene.cameras[0], &[part])
        .unwrap();
    preview.record_display(recorder, to, 0.0, PixelFormat::Rgba8).unwrap();
}

/// Sort, build, rays through what was built, and preview, between the host's copies in and out, in one submission.
fn a_frame_of_a_host(gpu: &Gpu, opening_barrier: bool) {
    let mut random = Random(2026);
    let keys: Vec<u32> = (0..5000).map(|_| random.word()).collect();
    let triangles: Vec<[Vec3; 3]> = (0..700)
        .map(|_| {
            let centre = 10.0 * random.vector();
            [0; 3].map(|_| centre + 0.5 * random.vector())
        })
        .collect();
    let rays: Vec<Ray> = (0..200)
        .map(|_| Ray::new(20.0 * random.vector(), random.vector()))
        .collect();
    let scene = scene();
    let settings = LbvhSettings {
        quality: BuildQuality::Fast,
        ..LbvhSettings::default()
    };
    let reference = build(&triangles, &settings).unwrap();
    let (count, key_count, ray_count) = (triangles.len() as u32, keys.len() as u32, rays.len() as u32);

    // Everything is asked for before.
    let on_device = GpuScene::new(gpu, &scene).unwrap();
    let mut own = Own::new(gpu);
    let sort = RadixSort::new(gpu, RadixSortOptions::new(KeyWidth::Bits32, false)).unwrap();
    let scratch = BufferDesc::storage("scratch", sort.scratch_bytes(key_count), Category::Work);
    let scratch = gpu.buffer(&scratch).unwrap();
    let key_bytes = size_of_val(&keys[..]) as u64;
    let format = vk::Format::R32G32B32A32_UINT;
    let sides = ["keys", "other keys"].map(|name| {
        let side = own.lend(name, key_bytes, TEXELS);
        gpu.texel_view_of(&side, format).unwrap()
    });
    let builder = LbvhBuilder::new(gpu, &settings).unwrap();
    let corners = own.lend("triangles", 36 * u64::from(count), STORAGE);
    let indices = own.lend("names", 4 * u64::from(count), STORAGE);
    let hierarchy = builder.buffers_over(count, &corners, &indices).unwrap();
    let lent_rays = own.lend("rays", 32 * u64::from(ray_count), STORAGE);
    let lent_hits = own.lend("hits", 16 * u64::from(ray_count), STORAGE);
    let trace = TraceSettings::ray_per_thread();
    let tracer = RayTracer::with_texels(gpu, hierarchy.quarters.clone(), DeviceTraversal::Bvh2, &trace).unwrap();
    let traced = tracer.buffers_over(ray_count, &lent_rays, &lent_hits).unwrap();
    let mut preview = preview(gpu, &on_device);
    let picture_bytes = 4 * u64::from(SIZE[0] * SIZE[1]);
    let picture = own.lend("picture", picture_bytes, STORAGE);
    let quarter_bytes = 16 * reference.texels().len() as u64;
    let names: Vec<u32> = (0..count).collect();
    let data = [
        (staged(gpu, &keys), sides[0].buffer().clone()),
        (staged(gpu, bytemuck::cast_slice::<_, f32>(&triangles)), corners),
        (staged(gpu, &names), indices),
        (staged(gpu, &rays), lent_rays),
    ];
    let side = sort.result_side(key_count);
    let copies = [
        (sides[side].buffer().clone(), room_for(gpu, key_bytes), key_bytes),
        (
            hierarchy.quarters.buffer().clone(),
            room_for(gpu, quarter_bytes),
            quarter_bytes,
        ),
        (
            lent_hits,
            room_for(gpu, 16 * u64::from(ray_count)),
            16 * u64::from(ray_count),
        ),
        (picture.clone(), room_for(gpu, picture_bytes), picture_bytes),
    ];

    own.begin(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
    for (from, to) in &data {
        own.copy(from, to, to.bytes());
    }
    let (written, used) = (
        vk::AccessFlags2::MEMORY_WRITE,
        vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE,
    );
    if !opening_barrier {
        own.barrier(written, used);
    }
    let mut recorder = own.borrow(true, opening_barrier).unwrap();
    recorder
        .pass("sort", |pass| {
            let buffers = SortBuffers {
                keys: [&sides[0], &sides[1]],
                values: None,
            };
            sort.record(pass, &buffers, Count::Host(key_count), &scratch)
        })
        .unwrap();
    builder.record_traversable(&mut recorder, &hierarchy).unwrap();
    tracer.record(&mut recorder, &traced, 2).unwrap();
    record_preview(&mut recorder, &mut preview, &scene, &on_device, &picture);
    let recorded = recorder.finish().unwrap();
    own.barrier(written, used);
    for (from, to, bytes) in &copies {
        own.copy(from, to, *bytes);
    }
    own.barrier(written, vk::AccessFlags2::HOST_READ);
    own.end();
    assert!(recorded.timings().untimed.is_some(), "nothing has run yet");
    own.submit();
    let timings = recorded.timings();
    drop(recorded);

    for pass in [
        "sort",
        "lbvh: emit",
        "trace",
        "raster: surfaces",
        "preview: shade",
        "preview: display",
    ] {
        assert!(timings.count(pass) > 0, "{pass} of {timings:?}");
    }
    assert!(timings.untimed.is_none() && timings.seconds() > 0.0);
    let mut sorted = keys;
    sorted.sort_unstable();
    assert_eq!(copies[0].1.read::<u32>(0, sorted.len()).unwrap(), sorted);
    let quarters: Vec<[u32; 4]> = copies[1].1.read(0, reference.texels().len()).unwrap();
    assert!(quarters == reference.texels(), "the hierarchy is not the host's");
    assert_eq!(tracer.unfinished(&traced).unwrap(), 0);
    let hits: Vec<Hit> = copies[2].1.read(0, rays.len()).unwrap();
    let expected: Vec<Hit> = rays.iter().map(|ray| reference.closest_hit(ray)).collect();
    assert!(expected.iter().any(|hit| hit.t.is_finite()));
    assert_eq!(hits, expected);

    // The same frame in a recording of the engine's own.
    let mut again = self::preview(gpu, &on_device);
    let target = BufferDesc::storage("engine's picture", picture_bytes, Category::Film);
    let target = gpu.buffer(&target).unwrap();
    let mut recorder = gpu.recorder("engine's frame").unwrap();
    record_preview(&mut recorder, &mut again, &scene, &on_device, &target);
    recorder.submit().unwrap().wait().unwrap();
    let pixels = (SIZE[0] * SIZE[1]) as usize;
    let expected: Vec<u32> = gpu.read(target.view(), pixels).unwrap();
    let found: Vec<u32> = copies[3].1.read(0, pixels).unwrap();
    let colours: std::collections::BTreeSet<_> = found.iter().collect();
    assert!(colours.len() > 50, "{} colours", colours.len());
    assert!(found == expected, "the pictures differ");
    let radiance = |preview: &Preview| preview.picture().unwrap().main_layer().unwrap().values().to_vec();
    assert!(radiance(&preview) == radiance(&again));
}

#[test]
fn a_hosts_one_submission_on_the_engines_device() {
    with_gpu(|gpu| a_frame_of_a_host(gpu, true));
}

#[test]
fn a_hosts_one_submission_on_its_own_device() {
    let host = Host::new();
    let gpu = host.lend(EnabledFeatures::REQUIRED).unwrap();
    a_frame_of_a_host(&gpu, false);
    drop(gpu);
    host.work();
}

#[test]
fn a_recorder_in_the_place_of_the_lent_one_is_found() {
    with_gpu(|gpu| {
        let own = Own::new(gpu);
        let once = vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT;
        // What a frame method may do with the recorder that it is given.
        own.begin(once);
        let mut recorder = own.borrow(false, true).unwrap();
        let mut other = gpu.recorder("another").unwrap();
        std::mem::swap(&mut *recorder, &mut other);
        assert!(matches!(other.submit(), Err(Error::Setting { .. })), "the host submits");
        assert!(matches!(recorder.finish(), Err(Error::Setting { .. })));
        own.end();
        // Back again, nothing is wrong.
        own.begin(once);
        let mut recorder = own.borrow(false, true).unwrap();
        let mut other = gpu.recorder("another").unwrap();
        for _ in 0..2 {
            std::mem::swap(&mut *recorder, &mut other);
        }
        recorder.finish().unwrap();
        own.end();
        // A panic that ended a pass.
        own.begin(once);
        let mut recorder = own.borrow(false, true).unwrap();
        let panicked = catch_unwind(AssertUnwindSafe(|| {
            recorder.pass("panics", |_| -> Result<()> { panic!("a planned panic") })
        }));
        assert!(panicked.is_err());
        assert!(matches!(recorder.finish(), Err(Error::Setting { .. })));
        own.end();
    });
}

/// Adds a pass that writes a word.
fn write(recorder: &mut Recorder, gpu: &Gpu, words: &Buffer, index: u32, value: u32) -> Result<()> {
    let pipeline = gpu.compute_pipeline::<out_of_bounds::Kernel>(&())?;
    recorder.pass("write", |pass| {
        let set = out_of_bounds::Set0 { words: words.view() };
        pass.dispatch(&pipeline, &[&set], &out_of_bounds::Push { index, value }, [1, 1, 1])
    })
}

#[test]
fn a_command_buffer_without_timestamps_runs_as_often_as_it_is_submitted() {
    with_gpu(|gpu| {
        let mut own = Own::new(gpu);
        let words = own.lend("words", 64, STORAGE);
        let other = own.lend("copy", 64, STORAGE);
        own.begin(vk::CommandBufferUsageFlags::empty());
        let mut recorder = own.borrow(false, true).unwrap();
        write(&mut recorder, gpu, &words, 5, 77).unwrap();
        recorder
            .pass("copy", |pass| {
                pass.memory_barrier(Access::COMPUTE, Access::TRANSFER);
                pass.copy(words.view(), other.view())
            })
            .unwrap();
        let recorded = recorder.finish().unwrap();
        own.end();
        for _ in 0..2 {
            gpu.upload(&words, 0, &[1u32; 16]).unwrap();
            own.submit();
            let mut expected = [1; 16];
            expected[5] = 77;
            assert_eq!(gpu.read::<u32>(words.view(), 16).unwrap(), expected);
            assert_eq!(gpu.read::<u32>(other.view(), 16).unwrap(), expected);
        }
        let timings = recorded.timings();
        assert_eq!(timings.untimed, Some("no timestamps were asked for"));
        assert_eq!(timings.passes.len(), 2);
    });
}

#[test]
fn a_borrowed_recorder_checks_barriers_and_is_not_submitted() {
    with_gpu(|gpu| {
        let mut own = Own::new(gpu);
        let words = own.lend("words", 64, STORAGE);
        own.begin(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        let mut recorder = own.borrow(false, true).unwrap();
        write(&mut recorder, gpu, &words, 1, 1).unwrap();
        if cfg!(debug_assertions) {
            // Neither the engine's own uses nor the host's that it is told of miss a barrier.
            let missed = write(&mut recorder, gpu, &words, 1, 2);
            assert!(
                matches!(&missed, Err(Error::MissingBarrier { buffer, .. }) if buffer == "words"),
                "{missed:?}"
            );
            let missed = recorder.note_use("host's copy", &words, Access::TRANSFER_READ);
            assert!(
                matches!(&missed, Err(Error::MissingBarrier { pass, .. }) if pass == "host's copy"),
                "{missed:?}"
            );
        }
        recorder.note_barrier(Access::COMPUTE, Access::COMPUTE.union(Access::TRANSFER));
        recorder.note_use("host's copy", &words, Access::TRANSFER_READ).unwrap();
        recorder
            .pass("barrier", |pass| {
                pass.barrier(&[rw_compute_to_compute(&words)]);
                Ok(())
            })
            .unwrap();
        // Taken out of its place it is no recorder to submit either.
        let taken = std::mem::replace(&mut *recorder, gpu.recorder("another").unwrap());
        let refused = taken.submit();
        assert!(matches!(refused.err(), Some(Error::Setting { name, .. }) if name == "recorder"));
        // The command buffer has lost what it used, and goes with its pool.
        drop(recorder);
    });
}

#[test]
fn what_a_host_lent_is_checked() {
    with_gpu(|gpu| {
        let mut own = Own::new(gpu);
        let words = own.lend("words", 64, STORAGE);
        let raw = words.raw();
        assert_eq!((words.bytes(), words.raw_offset()), (64, OFFSET));
        assert!(
            matches!(words.write(0, &[1u32]), Err(Error::LimitExceeded { .. })),
            "it is not mapped"
        );
        let lent = |offset, bytes| HostBuffer {
            name: "odd",
            raw,
            offset,
            bytes,
            usage: STORAGE,
        };
        for (offset, bytes, wrong) in [(2, 16, "offset"), (0, 0, "bytes"), (0, 18, "bytes")] {
            #[expect(unsafe_code, reason = "a host that speaks to Vulkan itself")]
            // SAFETY: the handle is alive; parts that are refused are not used.
            let refused = unsafe { gpu.borrow_buffer(&lent(offset, bytes)) };
            assert!(
                matches!(&refused, Err(Error::Setting { name, .. }) if name == wrong),
                "{refused:?}"
            );
        }
        // Storage bindings want an alignment that this part does not have, fills and copies a use that it was not lent for.
        #[expect(unsafe_code, reason = "a host that speaks to Vulkan itself")]
        // SAFETY: the handle is alive, and holds these bytes.
        let part = unsafe { gpu.borrow_buffer(&lent(OFFSET + 4, 32)) }.unwrap();
        let mut recorder = gpu.recorder("refused").unwrap();
        let refused = recorder.pass("fill", |pass| pass.fill(part.view(), 0));
        assert!(
            matches!(&refused, Err(Error::Setting { value, .. }) if value == "odd"),
            "{refused:?}"
        );
        if gpu.caps().storage_buffer_alignment > 4 {
            let refused = write(&mut recorder, gpu, &part, 0, 0);
            assert!(
                matches!(&refused, Err(Error::LimitExceeded { limit_name, .. }) if *limit_name == "offset alignment"),
                "{refused:?}"
            );
        }
        let refused = gpu.texel_view_of(&words, vk::Format::R32_UINT);
        assert!(
            matches!(&refused, Err(Error::Setting { name, .. }) if name == "buffer"),
            "{refused:?}"
        );
        let texels = own.lend("texels", 64, TEXELS);
        let refused = gpu.texel_view_of(&texels, vk::Format::BC1_RGB_UNORM_BLOCK);
        assert!(
            matches!(&refused, Err(Error::Setting { name, .. }) if name == "format"),
            "{refused:?}"
        );
        let builder = LbvhBuilder::new(gpu, &LbvhSettings::default()).unwrap();
        let refused = builder.buffers_over(2, &words, &words);
        assert!(
            matches!(
                &refused,
                Err(Error::LimitExceeded {
                    value: 72,
                    limit: 64,
                    ..
                })
            ),
            "{refused:?}"
        );
        drop(recorder);
        drop((words, part, texels));
    });
}
