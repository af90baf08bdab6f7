//! What safe functions of floor 1 refuse, in release builds too, so that no safe call breaks memory: sizes that wrap, parts that are not there,
//! what belongs to another device or was made for another use, memory that the device is using, and modules and bytes that nobody vouches for.
#![expect(unsafe_code, reason = "an event that the host sets, and shaders of the test's own")]

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::LazyLock;

use clerestory::Error;
use clerestory::gpu::ash::vk;
use clerestory::gpu::interface::{ComputeShader, PushConstants, SampledView, ShaderInfo};
use clerestory::gpu::shaders::film::display;
use clerestory::gpu::shaders::kernels::histogram;
use clerestory::gpu::{
    Access, Buffer, BufferDesc, BufferView, Category, ColorTarget, Gpu, GpuOptions, GraphicsDesc, Image, ImageBarrier,
    ImageDesc, Lesser, OptionalFeatures, Pass, Render, Residency, Sampler, SamplerDesc, Targets, rw_compute_to_compute,
};
use clerestory_tests::shaders::{cube_probe, layer_geom, out_of_bounds, quad_frag, quad_vert, value_frag, value_vert};
use clerestory_tests::{gpu, gpu_with, with_gpu};

fn storage(gpu: &Gpu, name: &str, bytes: u64) -> Buffer {
    gpu.buffer(&BufferDesc::storage(name, bytes, Category::Work)).unwrap()
}

fn image_desc(usage: vk::ImageUsageFlags) -> ImageDesc<'static> {
    ImageDesc {
        name: "picture",
        size: [16, 16],
        layers: 1,
        mips: 1,
        format: vk::Format::R8G8B8A8_UNORM,
        usage,
        category: Category::Film,
    }
}

fn image(gpu: &Gpu, usage: vk::ImageUsageFlags) -> Image {
    gpu.image(&image_desc(usage)).unwrap()
}

/// What is looked up in an image as if it were a cube.
fn probed<'a>(image: &'a Image, sampler: &'a Sampler, seen: &'a Buffer) -> cube_probe::Set0<'a> {
    cube_probe::Set0 {
        cube: SampledView { image, sampler },
        seen: seen.view(),
    }
}

fn to_layout(image: &Image, new_layout: vk::ImageLayout) -> ImageBarrier<'_> {
    ImageBarrier {
        image,
        from: Access::NONE,
        to: Access::COMPUTE_READ | Access::TRANSFER_WRITE,
        old_layout: vk::ImageLayout::UNDEFINED,
        new_layout,
    }
}

/// Renders into a whole image, and clears nothing.
fn render_into<'a>(
    pass: &mut Pass<'a>,
    image: &Image,
    record: impl FnOnce(&mut Render<'_, 'a>) -> clerestory::Result<()>,
) -> clerestory::Result<()> {
    let colors = [Some(ColorTarget { image, clear: None })];
    let targets = Targets {
        colors: &colors,
        ..Targets::default()
    };
    pass.render(&targets, record)
}

/// Each must be refused by a setting whose cause holds the words.
fn refused(gpu: &Gpu, words: &str, what: &str, record: impl FnOnce(&mut Pass<'_>) -> clerestory::Result<()>) {
    let mut recorder = gpu.recorder("refused").unwrap();
    match recorder.pass(what, record) {
        Err(Error::Setting { cause, .. }) => assert!(cause.contains(words), "{what}: {cause}"),
        other => panic!("{what}: {other:?}"),
    }
}

#[test]
fn sizes_do_not_wrap() {
    with_gpu(|gpu| {
        for bytes in [u64::MAX, u64::MAX - 1, u64::MAX - 3] {
            for desc in [
                BufferDesc::storage("huge", bytes, Category::Work),
                BufferDesc::uniform("huge", bytes, Category::Work),
                BufferDesc::upload("huge", bytes),
                BufferDesc::readback("huge", bytes),
            ] {
                let made = gpu.buffer(&desc);
                assert!(matches!(&made, Err(Error::LimitExceeded { .. })), "{bytes}: {made:?}");
            }
        }
    });
}

#[test]
fn reads_are_bounded_before_memory_is_taken_for_them() {
    with_gpu(|gpu| {
        let mapped = gpu.buffer(&BufferDesc::readback("mapped", 64)).unwrap();
        for count in [usize::MAX, usize::MAX / 8, 1 << 40, 9] {
            let read = mapped.read::<u64>(0, count);
            assert!(matches!(&read, Err(Error::LimitExceeded { .. })), "{count}: {read:?}");
        }
        let read = mapped.read::<u64>(u64::MAX, 1);
        assert!(matches!(&read, Err(Error::LimitExceeded { .. })), "{read:?}");
        // A view is a claim; the buffer's size is a fact.
        let words = storage(gpu, "words", 64);
        let claimed = BufferView {
            bytes: u64::MAX,
            ..words.view()
        };
        for count in [usize::MAX / 4, 1 << 40, 17] {
            let read = gpu.read::<u32>(claimed, count);
            assert!(matches!(&read, Err(Error::LimitExceeded { .. })), "{count}: {read:?}");
        }
    });
}

#[test]
fn uses_and_formats_that_no_device_here_has_are_refused() {
    with_gpu(|gpu| {
        for usage in [
            vk::BufferUsageFlags::empty(),
            vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS,
            vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS,
        ] {
            let made = gpu.buffer(&BufferDesc {
                usage,
                ..BufferDesc::storage("odd", 64, Category::Work)
            });
            assert!(
                matches!(&made, Err(Error::Setting { name, .. }) if name == "usage"),
                "{made:?}"
            );
        }
        for usage in [vk::ImageUsageFlags::empty(), vk::ImageUsageFlags::TRANSIENT_ATTACHMENT] {
            let made = gpu.image(&image_desc(usage));
            assert!(
                matches!(&made, Err(Error::Setting { name, .. }) if name == "usage"),
                "{made:?}"
            );
        }
        for format in [
            vk::Format::UNDEFINED,
            vk::Format::D24_UNORM_S8_UINT,
            vk::Format::BC1_RGB_UNORM_BLOCK,
            vk::Format::from_raw(-7),
        ] {
            let desc = image_desc(vk::ImageUsageFlags::SAMPLED);
            let made = gpu.image(&ImageDesc { format, ..desc });
            assert!(
                matches!(&made, Err(Error::Setting { name, .. }) if name == "format"),
                "{made:?}"
            );
            let texels = gpu.texels_with("texels", Category::Work, format, &[0u32; 4]);
            assert!(
                matches!(&texels, Err(Error::Setting { name, .. }) if name == "format"),
                "{texels:?}"
            );
        }
        let desc = SamplerDesc {
            name: "odd",
            filter: vk::Filter::NEAREST,
            address: vk::SamplerAddressMode::CLAMP_TO_EDGE,
        };
        for (odd, setting) in [
            (
                SamplerDesc {
                    filter: vk::Filter::from_raw(77),
                    ..desc
                },
                "filter",
            ),
            (
                SamplerDesc {
                    address: vk::SamplerAddressMode::MIRROR_CLAMP_TO_EDGE,
                    ..desc
                },
                "address",
            ),
        ] {
            let made = gpu.sampler(&odd);
            assert!(
                matches!(&made, Err(Error::Setting { name, .. }) if name == setting),
                "{made:?}"
            );
        }
        type Desc = GraphicsDesc<'static, quad_vert::Shader, quad_frag::Shader>;
        let colors = &[vk::Format::R8G8B8A8_UNORM];
        let odd = [
            Desc {
                colors,
                topology: vk::PrimitiveTopology::PATCH_LIST,
                ..Desc::default()
            },
            Desc {
                colors,
                depth_compare: vk::CompareOp::from_raw(99),
                ..Desc::default()
            },
        ];
        for desc in odd {
            let made = gpu.graphics_pipeline(&desc);
            assert!(matches!(&made, Err(Error::Setting { .. })), "{made:?}");
        }
        let made = gpu.graphics_pipeline(&Desc {
            colors: &[vk::Format::D32_SFLOAT],
            ..Desc::default()
        });
        assert!(matches!(&made, Err(Error::MissingFeature { .. })), "{made:?}");
    });
}

#[test]
fn what_belongs_to_another_device_is_refused() {
    with_gpu(|gpu| {
        let other = clerestory_tests::gpu();
        let words = "another device";
        let (ours, theirs) = (storage(gpu, "ours", 64), storage(&other, "theirs", 64));
        let pipeline = gpu.compute_pipeline::<out_of_bounds::Kernel>(&()).unwrap();
        let their_pipeline = other.compute_pipeline::<out_of_bounds::Kernel>(&()).unwrap();
        let push = out_of_bounds::Push { index: 0, value: 1 };
        refused(gpu, words, "fill", |pass| pass.fill(theirs.view(), 0));
        refused(gpu, words, "update", |pass| pass.update(theirs.view(), &[1u32]));
        refused(gpu, words, "copy from", |pass| pass.copy(theirs.view(), ours.view()));
        refused(gpu, words, "copy to", |pass| pass.copy(ours.view(), theirs.view()));
        refused(gpu, words, "barrier", |pass| {
            pass.barrier(&[rw_compute_to_compute(&theirs)]);
            Ok(())
        });
        refused(gpu, words, "buffer", |pass| {
            let set = out_of_bounds::Set0 { words: theirs.view() };
            pass.dispatch(&pipeline, &[&set], &push, [1, 1, 1])
        });
        let set = out_of_bounds::Set0 { words: ours.view() };
        refused(gpu, words, "pipeline", |pass| {
            pass.dispatch(&their_pipeline, &[&set], &push, [1, 1, 1])
        });
        refused(gpu, words, "arguments", |pass| {
            pass.dispatch_indirect(&pipeline, &[&set], &push, theirs.view())
        });
        let usage = vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::TRANSFER_DST;
        let picture = image(&other, usage | vk::ImageUsageFlags::COLOR_ATTACHMENT);
        let rows = storage(gpu, "rows", 16 * 16 * 4);
        refused(gpu, words, "image to buffer", |pass| {
            pass.copy_image_to_buffer(&picture, rows.view())
        });
        refused(gpu, words, "buffer to image", |pass| {
            pass.copy_buffer_to_image(rows.view(), &picture)
        });
        refused(gpu, words, "image barrier", |pass| {
            pass.image_barrier(&[to_layout(&picture, vk::ImageLayout::TRANSFER_DST_OPTIMAL)]);
            Ok(())
        });
        refused(gpu, words, "target", |pass| render_into(pass, &picture, |_| Ok(())));
        let texels = other
            .storage_texels("texels", Category::Work, vk::Format::R32_UINT, 4)
            .unwrap();
        let view = gpu.texel_view_of(texels.buffer(), vk::Format::R32_UINT);
        assert!(matches!(&view, Err(Error::Setting { .. })), "{view:?}");
        for result in [
            gpu.upload(&theirs, 0, &[1u32]),
            gpu.read::<u32>(theirs.view(), 1).map(drop),
        ] {
            assert!(matches!(&result, Err(Error::Setting { .. })), "{result:?}");
        }
        // A refused barrier is no part of the next pass.
        let mut recorder = gpu.recorder("goes on").unwrap();
        let refused = recorder.pass("barrier", |pass| {
            pass.barrier(&[rw_compute_to_compute(&theirs)]);
            Ok(())
        });
        assert!(refused.is_err());
        recorder.pass("fill", |pass| pass.fill(ours.view(), 7)).unwrap();
        recorder.submit().unwrap().wait().unwrap();
        assert_eq!(gpu.read::<u32>(ours.view(), 2).unwrap(), [7, 7]);
    });
}

#[test]
fn images_are_used_as_they_were_made_to_be() {
    with_gpu(|gpu| {
        let words = "for which it was not made";
        let rows = storage(gpu, "rows", 16 * 16 * 4);
        let (drawn, copied) = (
            image(gpu, vk::ImageUsageFlags::COLOR_ATTACHMENT),
            image(gpu, vk::ImageUsageFlags::TRANSFER_DST),
        );
        refused(gpu, words, "image to buffer", |pass| {
            pass.copy_image_to_buffer(&drawn, rows.view())
        });
        refused(gpu, words, "buffer to image", |pass| {
            pass.copy_buffer_to_image(rows.view(), &drawn)
        });
        refused(gpu, words, "target", |pass| render_into(pass, &copied, |_| Ok(())));
        refused(gpu, words, "layout", |pass| {
            pass.image_barrier(&[to_layout(&copied, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)]);
            Ok(())
        });
        for layout in [
            vk::ImageLayout::UNDEFINED,
            vk::ImageLayout::PRESENT_SRC_KHR,
            vk::ImageLayout::from_raw(12_345),
        ] {
            refused(gpu, "cannot be in layout", "layout", |pass| {
                pass.image_barrier(&[to_layout(&drawn, layout)]);
                Ok(())
            });
        }
        // Its view is null: it was made for copies alone.
        let sampler = gpu
            .sampler(&SamplerDesc {
                name: "nearest",
                filter: vk::Filter::NEAREST,
                address: vk::SamplerAddressMode::CLAMP_TO_EDGE,
            })
            .unwrap();
        let probe = gpu.compute_pipeline::<cube_probe::Kernel>(&()).unwrap();
        // A plane has no five other faces.
        let plane = image(gpu, vk::ImageUsageFlags::SAMPLED);
        let mut recorder = gpu.recorder("plane").unwrap();
        let looked_up = recorder.pass("a plane as a cube", |pass| {
            let set = probed(&plane, &sampler, &rows);
            pass.dispatch(&probe, &[&set], &(), [1, 1, 1])
        });
        assert!(matches!(&looked_up, Err(Error::Shader { .. })), "{looked_up:?}");
        drop(recorder);
        refused(gpu, words, "sampled", |pass| {
            let set = probed(&copied, &sampler, &rows);
            pass.dispatch(&probe, &[&set], &(), [1, 1, 1])
        });
    });
}

#[test]
fn parts_that_lie_over_each_other_or_hold_no_whole_words_are_refused() {
    with_gpu(|gpu| {
        let words = storage(gpu, "words", 64);
        refused(gpu, "lies over it", "forwards", |pass| {
            pass.copy(words.slice(0, 32), words.slice(16, 48))
        });
        refused(gpu, "lies over it", "backwards", |pass| {
            pass.copy(words.slice(16, 32), words.slice(0, 64))
        });
        let mut recorder = gpu.recorder("parts").unwrap();
        recorder
            .pass("copy beside", |pass| {
                pass.copy(words.slice(0, 32), words.slice(32, 32))?;
                pass.memory_barrier(Access::TRANSFER, Access::TRANSFER | Access::COMPUTE);
                let filled = pass.fill(words.slice(0, 6), 1);
                assert!(matches!(&filled, Err(Error::LimitExceeded { .. })), "{filled:?}");
                let pipeline = gpu.compute_pipeline::<out_of_bounds::Kernel>(&())?;
                let set = out_of_bounds::Set0 {
                    words: words.slice(0, 0),
                };
                let bound = pass.dispatch(&pipeline, &[&set], &Default::default(), [1, 1, 1]);
                assert!(matches!(&bound, Err(Error::Shader { .. })), "{bound:?}");
                Ok(())
            })
            .unwrap();
        recorder.submit().unwrap().wait().unwrap();
    });
}

#[test]
fn the_host_has_mapped_memory_alone_or_not_at_all() {
    with_gpu(|gpu| {
        let device = gpu.raw_device();
        // SAFETY: plain creation; destroyed below.
        let event = unsafe { device.create_event(&vk::EventCreateInfo::default(), None) }.unwrap();
        let work = storage(gpu, "work", 64);
        let upload = gpu.buffer(&BufferDesc::upload("upload", 64)).unwrap();
        let seen = gpu.buffer(&BufferDesc::readback("seen", 64)).unwrap();
        upload.write(0, &[5u32; 16]).unwrap();
        seen.write(0, &[0u32; 16]).unwrap();
        let mut recorder = gpu.recorder("held").unwrap();
        recorder
            .pass("held", |pass| {
                let (host, all) = (vk::PipelineStageFlags::HOST, vk::PipelineStageFlags::ALL_COMMANDS);
                // SAFETY: the event outlives the submission.
                unsafe { device.cmd_wait_events(pass.raw(), &[event], host, all, &[], &[], &[]) };
                pass.copy(upload.view(), work.view())?;
                pass.memory_barrier(Access::TRANSFER, Access::TRANSFER);
                pass.copy(work.view(), seen.view())
            })
            .unwrap();
        // Recorded is not submitted: the host still has both.
        upload.write(0, &[6u32; 16]).unwrap();
        let submission = recorder.submit().unwrap();
        for result in [
            upload.write(0, &[7u32; 16]),
            upload.read::<u32>(0, 16).map(drop),
            seen.write(0, &[7u32; 16]),
            seen.read::<u32>(0, 16).map(drop),
        ] {
            match result {
                Err(Error::Setting { cause, .. }) => assert!(cause.contains("in use"), "{cause}"),
                other => panic!("the device has it: {other:?}"),
            }
        }
        // SAFETY: the event is alive; setting it lets the device go on.
        unsafe { device.set_event(event) }.unwrap();
        submission.wait().unwrap();
        // SAFETY: the submission is over, and with it the last use.
        unsafe { device.destroy_event(event, None) };
        assert_eq!(seen.read::<u32>(0, 16).unwrap(), [6; 16]);
        upload.write(0, &[7u32; 16]).unwrap();
    });
}

#[test]
fn threads_write_mapped_memory_one_after_the_other() {
    with_gpu(|gpu| {
        const WORDS: usize = 1 << 16;
        let shared = gpu.buffer(&BufferDesc::upload("shared", 4 * WORDS as u64)).unwrap();
        shared.write(0, &[0u32; WORDS]).unwrap();
        std::thread::scope(|scope| {
            for thread in 1..=4u32 {
                let shared = &shared;
                scope.spawn(move || {
                    for turn in 0..50 {
                        shared.write(0, &vec![1000 * thread + turn; WORDS]).unwrap();
                    }
                });
            }
            for _ in 0..50 {
                let words = shared.read::<u32>(0, WORDS).unwrap();
                assert!(words.iter().all(|word| *word == words[0]), "halves of two writes");
            }
        });
    });
}

/// Push constants that are whatever bytes they are told to be.
struct Bytes(Vec<u8>);

impl PushConstants for Bytes {
    fn bytes(&self) -> &[u8] {
        &self.0
    }
}

/// The word writer with push constants of any size.
enum Pushed {}

// SAFETY: the module is that of the information, which the build made; push constants of another size are what the test is about.
unsafe impl ComputeShader for Pushed {
    type Push = Bytes;
    type Spec = ();

    fn info() -> &'static ShaderInfo {
        &out_of_bounds::INFO
    }
}

/// The word writer under the name of a kernel of the engine's.
enum Namesake {}

static NAMESAKE: LazyLock<ShaderInfo> = LazyLock::new(|| ShaderInfo {
    name: "film/display.comp",
    ..out_of_bounds::INFO
});

// SAFETY: but for the name, which says nothing of the module, all is the word writer's.
unsafe impl ComputeShader for Namesake {
    type Push = out_of_bounds::Push;
    type Spec = ();

    fn info() -> &'static ShaderInfo {
        &NAMESAKE
    }
}

#[test]
fn push_constants_have_the_size_of_their_block() {
    with_gpu(|gpu| {
        let words = storage(gpu, "words", 64);
        let pipeline = gpu.compute_pipeline::<Pushed>(&()).unwrap();
        let set = out_of_bounds::Set0 { words: words.view() };
        let mut recorder = gpu.recorder("push").unwrap();
        recorder
            .pass("push", |pass| {
                for size in [0, 4, 7, 12, 4096] {
                    let pushed = pass.dispatch(&pipeline, &[&set], &Bytes(vec![0; size]), [1, 1, 1]);
                    assert!(matches!(&pushed, Err(Error::Shader { .. })), "{size}: {pushed:?}");
                }
                let word = [3u32, 9].map(u32::to_ne_bytes).concat();
                pass.dispatch(&pipeline, &[&set], &Bytes(word), [1, 1, 1])
            })
            .unwrap();
        recorder.submit().unwrap().wait().unwrap();
        assert_eq!(gpu.read::<u32>(words.view(), 4).unwrap()[3], 9);
    });
}

#[test]
fn a_kernel_is_not_taken_for_another_of_its_name() {
    with_gpu(|gpu| {
        let engines = gpu.compute_pipeline::<display::Kernel>(&()).unwrap();
        let pipeline = gpu.compute_pipeline::<Namesake>(&()).unwrap();
        assert_eq!(engines.info().shader, pipeline.info().shader);
        let words = storage(gpu, "words", 64);
        let mut recorder = gpu.recorder("namesake").unwrap();
        recorder
            .pass("write", |pass| {
                let set = out_of_bounds::Set0 { words: words.view() };
                let push = out_of_bounds::Push { index: 2, value: 8 };
                pass.dispatch(&pipeline, &[&set], &push, [1, 1, 1])
            })
            .unwrap();
        recorder.submit().unwrap().wait().unwrap();
        assert_eq!(gpu.read::<u32>(words.view(), 4).unwrap()[2], 8);
    });
}

#[test]
fn workgroups_without_invocations_or_too_wide_are_refused() {
    with_gpu(|gpu| {
        let of = |local_size_x| {
            let spec = histogram::Spec {
                local_size_x,
                ..histogram::Spec::default()
            };
            gpu.compute_pipeline::<histogram::Kernel>(&spec).map(drop)
        };
        assert!(matches!(of(0), Err(Error::Shader { .. })));
        assert!(matches!(of(u32::MAX), Err(Error::MissingFeature { .. })));
        of(8).unwrap();
    });
}

#[test]
fn what_a_panic_left_in_the_middle_of_a_pass_is_not_submitted() {
    with_gpu(|gpu| {
        let words = storage(gpu, "words", 64);
        let mut recorder = gpu.recorder("panics").unwrap();
        recorder.count_invocations();
        let panicked = catch_unwind(AssertUnwindSafe(|| {
            recorder.pass("panics", |_| -> clerestory::Result<()> { panic!("a planned panic") })
        }));
        assert!(panicked.is_err());
        let next = recorder.pass("next", |pass| pass.fill(words.view(), 1));
        assert!(matches!(&next, Err(Error::Setting { .. })), "{next:?}");
        assert!(matches!(recorder.submit(), Err(Error::Setting { .. })));
    });
}

#[test]
fn a_rendering_whose_closure_panics_ends() {
    with_gpu(|gpu| {
        let picture = image(gpu, vk::ImageUsageFlags::COLOR_ATTACHMENT);
        let words = storage(gpu, "words", 64);
        let mut recorder = gpu.recorder("panics").unwrap();
        recorder
            .pass("caught inside", |pass| {
                pass.image_barrier(&[ImageBarrier {
                    to: Access::COLOR_WRITE,
                    ..to_layout(&picture, vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
                }]);
                let panicked = catch_unwind(AssertUnwindSafe(|| {
                    render_into(pass, &picture, |_| panic!("a planned panic"))
                }));
                assert!(panicked.is_err());
                // Not allowed inside of a rendering.
                pass.fill(words.view(), 7)
            })
            .unwrap();
        recorder.submit().unwrap().wait().unwrap();
        assert_eq!(gpu.read::<u32>(words.view(), 16).unwrap(), [7; 16]);
    });
}

#[test]
fn geometry_shaders_get_the_primitives_that_they_take() {
    type Desc = GraphicsDesc<'static, value_vert::Shader, value_frag::Shader, layer_geom::Shader>;
    with_gpu(|gpu| {
        let of = |topology| {
            gpu.graphics_pipeline(&Desc {
                colors: &[vk::Format::R32_UINT],
                topology,
                ..Desc::default()
            })
        };
        for topology in [
            vk::PrimitiveTopology::POINT_LIST,
            vk::PrimitiveTopology::LINE_LIST,
            vk::PrimitiveTopology::LINE_STRIP,
        ] {
            let made = of(topology);
            let refused = matches!(&made, Err(Error::Setting { cause, .. }) if cause.contains("layer.geom"));
            assert!(refused, "{topology:?}: {made:?}");
        }
        of(vk::PrimitiveTopology::TRIANGLE_STRIP).unwrap();
    });
}

#[test]
fn no_option_takes_away_what_keeps_kernels_in_their_buffers() {
    let offered = gpu().caps().robust_buffer_access;
    let least = gpu_with(&GpuOptions {
        lesser: Lesser {
            features: Some(OptionalFeatures::NONE),
            ..Lesser::default()
        },
        ..GpuOptions::default()
    });
    assert!(!least.caps().int64);
    assert_eq!(least.caps().robust_buffer_access, offered);
}

#[test]
fn memory_of_the_device_is_not_the_hosts_even_where_it_could_be() {
    with_gpu(|gpu| {
        for (residency, reached) in [
            (Residency::Device, false),
            (Residency::Upload, true),
            (Residency::Readback, true),
        ] {
            let desc = BufferDesc::storage("words", 64, Category::Work);
            let buffer = gpu.buffer(&BufferDesc { residency, ..desc }).unwrap();
            assert_eq!(buffer.write(0, &[1u32]).is_ok(), reached, "{residency:?}");
            assert_eq!(buffer.read::<u32>(0, 1).is_ok(), reached, "{residency:?}");
        }
    });
}
