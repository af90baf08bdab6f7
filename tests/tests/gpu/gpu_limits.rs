//! Floor 1 at its limits: what a device does not offer is an error that names it, and what lesser devices lack is done without.

use clerestory::Error;
use clerestory::gpu::ash::vk;
use clerestory::gpu::interface::{BindingInfo, BindingKind};
use clerestory::gpu::shaders::walk::compact_count;
use clerestory::gpu::{
    Access, BufferDesc, Category, DescriptorLimits, Gpu, GpuOptions, ImageDesc, Lesser, Pass, Timings,
};
use clerestory::render::{RenderOptions, render};
use clerestory::scene::SceneProfile;
use clerestory::techniques;
use clerestory_tests::shaders::{layout_probe, out_of_bounds, uniform_probe};
use clerestory_tests::{assert_no_messages, gpu_with, with_gpu};

/// A device that has these limits of descriptors.
fn gpu_of_limits(descriptors: DescriptorLimits) -> Gpu {
    gpu_with(&GpuOptions {
        lesser: Lesser {
            descriptors: Some(descriptors),
            ..Lesser::default()
        },
        ..GpuOptions::default()
    })
}

#[test]
fn limits_and_memory_are_reported() {
    with_gpu(|gpu| {
        let limit = gpu.caps().max_storage_buffer_range;
        let error = gpu
            .buffer(&BufferDesc::storage("huge", limit + 4, Category::Geometry))
            .unwrap_err();
        assert!(
            matches!(&error, Error::LimitExceeded { name, .. } if name == "huge"),
            "{error}"
        );
        let before = gpu.memory_report();
        let kept = gpu
            .buffer(&BufferDesc::storage("film", 1 << 20, Category::Film))
            .unwrap();
        let during = gpu.memory_report();
        assert!(during.of(Category::Film) >= before.of(Category::Film) + (1 << 20));
        assert_eq!(during.allocations, before.allocations + 1);
        drop(kept);
        assert_eq!(gpu.memory_report(), before);
        let data: Vec<u32> = (0..(6 << 20)).collect();
        let buffer = gpu.buffer_with("staged in chunks", Category::Work, &data).unwrap();
        assert_eq!(gpu.read::<u32>(buffer.view(), data.len()).unwrap(), data);
        let odd = gpu
            .buffer_with("odd size", Category::Work, &[1u8, 2, 3, 4, 5, 6, 7])
            .unwrap();
        assert_eq!(gpu.read::<u8>(odd.view(), 7).unwrap(), [1, 2, 3, 4, 5, 6, 7]);
    });
}

#[test]
fn too_many_passes_are_an_error() {
    with_gpu(|gpu| {
        let mut recorder = gpu.recorder("passes").unwrap();
        for index in 0..1024 {
            recorder.pass(&format!("pass {index}"), |_| Ok(())).unwrap();
        }
        let error = recorder.pass("one too many", |_| Ok(())).unwrap_err();
        assert!(matches!(error, Error::LimitExceeded { limit: 1024, .. }), "{error}");
        let timings = recorder.submit().unwrap().wait().unwrap();
        assert_eq!(timings.passes.len(), 1024);
    });
}

#[test]
fn parts_outside_of_a_buffer_are_refused() {
    with_gpu(|gpu| {
        let words = gpu.buffer(&BufferDesc::storage("words", 64, Category::Work)).unwrap();
        let pipeline = gpu.compute_pipeline::<out_of_bounds::Kernel>(&()).unwrap();
        let mut recorder = gpu.recorder("outside").unwrap();
        let mut refused = |what: &str, record: &dyn Fn(&mut Pass<'_>) -> clerestory::Result<()>| {
            let result = recorder.pass(what, |pass| record(pass));
            assert!(
                matches!(&result, Err(Error::LimitExceeded { name, .. }) if name == "words"),
                "{what}: {result:?}"
            );
        };
        refused("fill past the end", &|pass| pass.fill(words.slice(32, 64), 0));
        refused("fill at an odd place", &|pass| pass.fill(words.slice(2, 4), 0));
        refused("copy from far outside", &|pass| {
            pass.copy(words.slice(u64::MAX, 4), words.view())
        });
        refused("bind past the end", &|pass| {
            let set = out_of_bounds::Set0 {
                words: words.slice(0, 128),
            };
            pass.dispatch(&pipeline, &[&set], &Default::default(), [1, 1, 1])
        });
        let error = gpu.read::<u32>(words.view(), 17).unwrap_err();
        assert!(matches!(error, Error::LimitExceeded { .. }), "{error}");
        assert!(gpu.read::<u32>(words.view(), 0).unwrap().is_empty());
    });
}

#[test]
fn images_that_the_device_cannot_make_are_refused() {
    with_gpu(|gpu| {
        let image = |size: [u32; 2], format| {
            gpu.image(&ImageDesc {
                name: "picture",
                size,
                layers: 1,
                mips: 1,
                format,
                usage: vk::ImageUsageFlags::COLOR_ATTACHMENT,
                category: Category::Film,
            })
        };
        image([16, 16], vk::Format::R8G8B8A8_UNORM).unwrap();
        let error = image([1 << 20, 16], vk::Format::R8G8B8A8_UNORM).unwrap_err();
        assert!(matches!(error, Error::LimitExceeded { .. }), "{error}");
        let error = image([0, 16], vk::Format::R8G8B8A8_UNORM).unwrap_err();
        assert!(matches!(error, Error::LimitExceeded { .. }), "{error}");
        let error = image([16, 16], vk::Format::D32_SFLOAT).unwrap_err();
        assert!(matches!(error, Error::MissingFeature { .. }), "{error}");
    });
}

#[test]
fn a_pipeline_beyond_the_limits_names_limit_wanted_and_offered() {
    let descriptors = gpu_with(&GpuOptions::default()).caps().descriptors;
    // The kernel has two storage buffers in one set.
    let lesser = [
        (
            "maxPerStageDescriptorStorageBuffers >= 2",
            DescriptorLimits {
                per_stage_storage_buffers: 1,
                ..descriptors
            },
        ),
        (
            "maxDescriptorSetStorageBuffers >= 2",
            DescriptorLimits {
                per_pipeline_storage_buffers: 1,
                ..descriptors
            },
        ),
        (
            "maxPerStageResources >= 2",
            DescriptorLimits {
                per_stage_resources: 1,
                ..descriptors
            },
        ),
    ];
    for (wanted, limits) in lesser {
        let gpu = gpu_of_limits(limits);
        match gpu.compute_pipeline::<layout_probe::Kernel>(&Default::default()) {
            Err(Error::MissingFeature {
                feature,
                needed_by,
                instead,
                ..
            }) => {
                assert_eq!(feature, wanted);
                assert!(needed_by.contains("layout_probe.comp"), "{needed_by}");
                assert!(instead.contains("offers 1;"), "{instead}");
            }
            other => panic!("expected {wanted}, got {other:?}"),
        }
        // One storage buffer still fits.
        gpu.compute_pipeline::<out_of_bounds::Kernel>(&()).unwrap();
        assert_no_messages(&gpu);
    }
}

/// Three passes of different length.
fn timed(gpu: &Gpu) -> Timings {
    let words = gpu
        .buffer(&BufferDesc::storage("words", 16 << 20, Category::Work))
        .unwrap();
    let mut recorder = gpu.recorder("timed").unwrap();
    for (name, bytes) in [("short", 1 << 10), ("long", 16 << 20), ("short again", 1 << 10)] {
        recorder
            .pass(name, |pass| {
                pass.memory_barrier(Access::TRANSFER, Access::TRANSFER);
                pass.fill(words.slice(0, bytes), 1)
            })
            .unwrap();
    }
    recorder.submit().unwrap().wait().unwrap()
}

#[test]
fn devices_with_few_timestamp_bits_or_none_are_timed_as_far_as_they_can_be() {
    let with_bits = |bits| {
        let gpu = gpu_with(&GpuOptions {
            lesser: Lesser {
                timestamp_valid_bits: Some(bits),
                ..Lesser::default()
            },
            ..GpuOptions::default()
        });
        let timings = timed(&gpu);
        assert_no_messages(&gpu);
        (timings, gpu.caps().clone())
    };
    let (untimed, caps) = with_bits(0);
    assert_eq!((caps.timestamp_valid_bits, caps.timestamp_period), (0, 0.0));
    assert_eq!(untimed.passes.len(), 3);
    assert!(untimed.passes.iter().all(|pass| pass.nanoseconds.is_none()));
    assert_eq!(untimed.untimed, Some("the device's queue has no timestamps"));
    assert_eq!(untimed.longest(), None);
    let (timings, caps) = with_bits(36);
    if caps.timestamp_period > 0.0 {
        assert!(caps.timestamp_valid_bits <= 36);
        assert_eq!(timings.untimed, None);
        assert_eq!(timings.longest().unwrap().name, "long");
        // 36 bits of nanoseconds are over a minute.
        assert!(timings.seconds() < 60.0, "{timings:?}");
    }
}

#[test]
fn a_uniform_buffer_beyond_the_limit_is_refused() {
    with_gpu(|gpu| {
        let pipeline = gpu.compute_pipeline::<uniform_probe::Kernel>(&()).unwrap();
        let bytes = gpu.caps().max_uniform_buffer_range + 16;
        let addend = gpu
            .buffer(&BufferDesc::uniform("too much", bytes, Category::Work))
            .unwrap();
        let words = gpu.buffer(&BufferDesc::storage("words", 32, Category::Work)).unwrap();
        let mut recorder = gpu.recorder("too much").unwrap();
        let result = recorder.pass("add", |pass| {
            let set = uniform_probe::Set0 {
                addend: addend.view(),
                words: words.view(),
            };
            pass.dispatch(&pipeline, &[&set], &(), [1, 1, 1])
        });
        assert!(
            matches!(
                &result,
                Err(Error::LimitExceeded {
                    limit_name: "maxUniformBufferRange",
                    ..
                })
            ),
            "{result:?}"
        );
    });
}

#[test]
fn workgroups_are_limited_along_each_axis() {
    let limits = [9, 8, 7];
    let gpu = gpu_with(&GpuOptions {
        lesser: Lesser {
            max_workgroups: Some(limits),
            ..Lesser::default()
        },
        ..GpuOptions::default()
    });
    assert_eq!(gpu.caps().max_workgroups, limits);
    let words = gpu.buffer(&BufferDesc::storage("words", 64, Category::Work)).unwrap();
    let pipeline = gpu.compute_pipeline::<out_of_bounds::Kernel>(&()).unwrap();
    let mut recorder = gpu.recorder("groups").unwrap();
    recorder
        .pass("groups", |pass| {
            let mut dispatch = |groups| {
                pass.memory_barrier(Access::COMPUTE, Access::COMPUTE);
                let set = out_of_bounds::Set0 { words: words.view() };
                pass.dispatch(&pipeline, &[&set], &Default::default(), groups)
            };
            dispatch(limits)?;
            let names = [
                "maxComputeWorkGroupCount[0]",
                "maxComputeWorkGroupCount[1]",
                "maxComputeWorkGroupCount[2]",
            ];
            for (axis, name) in names.into_iter().enumerate() {
                let mut groups = [1; 3];
                groups[axis] = limits[axis] + 1;
                match dispatch(groups) {
                    Err(Error::LimitExceeded { limit_name, limit, .. }) => {
                        assert_eq!((limit_name, limit), (name, u64::from(limits[axis])));
                    }
                    other => panic!("{name}: {other:?}"),
                }
            }
            Ok(())
        })
        .unwrap();
    recorder.submit().unwrap().wait().unwrap();
    assert_no_messages(&gpu);
}

#[test]
fn the_path_tracer_says_what_a_device_of_the_least_limits_lacks() {
    let descriptors = DescriptorLimits {
        // What Vulkan promises on every device.
        per_stage_storage_buffers: 4,
        ..gpu_with(&GpuOptions::default()).caps().descriptors
    };
    let gpu = gpu_of_limits(descriptors);
    let scene = clerestory::scene::load("builtin:cornell-box").unwrap();
    let options = RenderOptions {
        size: [8, 8],
        spp: 1,
        ..RenderOptions::default()
    };
    match render(&gpu, &scene, &options) {
        Err(Error::MissingFeature { feature, needed_by, .. }) => {
            assert!(
                feature.starts_with("maxPerStageDescriptorStorageBuffers >= "),
                "{feature}"
            );
            assert!(needed_by.contains(".comp"), "{needed_by}");
        }
        Err(other) => panic!("expected a missing feature, got {other}"),
        Ok(_) => panic!("the path tracer has more than four storage buffers"),
    }
    assert_no_messages(&gpu);
    // The same is known beforehand, by the kernels' interfaces.
    let card = techniques::by_id("path").unwrap();
    let lacks = techniques::lacks(gpu.caps(), card);
    assert_eq!(lacks.len(), 1, "{lacks:?}");
    assert!(
        lacks[0].what.starts_with("maxPerStageDescriptorStorageBuffers >= "),
        "{lacks:?}"
    );
    assert_eq!(lacks[0].offered, Some(4));
    let names = &lacks[0].kernels;
    assert!(
        names.contains(&"techniques/path/path_shade.comp") && !names.contains(&"film/display.comp"),
        "{names:?}"
    );
}

#[test]
fn four_descriptor_sets_are_enough_for_every_technique() {
    let descriptors = DescriptorLimits {
        bound_sets: 4,
        ..gpu_with(&GpuOptions::default()).caps().descriptors
    };
    let gpu = gpu_of_limits(descriptors);
    // A scene for each of them, in the order of how much is in it.
    let addresses = [
        "builtin:cornell-box",
        "builtin:cornell-box?source=point",
        "builtin:triangle-soup?n=300",
    ];
    let scenes = addresses.map(|address| clerestory::scene::load(address).unwrap());
    for technique in techniques::all() {
        assert!(!technique.kernels.concat().is_empty(), "{}", technique.id);
        assert_eq!(techniques::lacks(gpu.caps(), technique), [], "{}", technique.id);
        let able = scenes
            .iter()
            .find(|scene| (technique.refusals)(&SceneProfile::of(scene)).is_empty());
        let scene = able.unwrap_or_else(|| panic!("`addresses` needs a scene that `{}` can render", technique.id));
        let options = RenderOptions {
            technique: Some(technique.id.into()),
            size: [8, 8],
            spp: 1,
            ..RenderOptions::default()
        };
        let rendered = render(&gpu, scene, &options).unwrap();
        // And nothing is made that was not asked about.
        let kernels = technique.kernels.concat();
        for pipeline in &rendered.report.pipelines {
            let known =
                kernels.iter().any(|kernel| kernel.name == pipeline.shader) || pipeline.shader.starts_with("film/");
            assert!(known, "{} makes {}", technique.id, pipeline.shader);
        }
    }
    // One less is found before anything is made.
    let fewer = DescriptorLimits {
        bound_sets: 3,
        ..descriptors
    };
    let gpu = gpu_of_limits(fewer);
    let lacks = techniques::lacks(gpu.caps(), techniques::by_id("path").unwrap());
    let what: Vec<_> = lacks.iter().map(|lack| lack.what.as_str()).collect();
    assert_eq!(what, ["maxBoundDescriptorSets >= 4"]);
    assert!(lacks[0].kernels.contains(&"walk/shadow.comp"), "{lacks:?}");
}

#[test]
fn a_pipeline_takes_of_the_limits_what_its_shader_uses() {
    let info = &compact_count::INFO;
    let count = |bindings: &mut dyn Iterator<Item = &BindingInfo>, kind| {
        bindings.filter(|binding| binding.kind == kind).count() as u32
    };
    let used = |kind| count(&mut info.used_bindings(), kind);
    let declared = |kind| count(&mut info.bindings.iter(), kind);
    let (storage, texels) = (BindingKind::StorageBuffer, BindingKind::TexelBuffer);
    assert!(used(storage) < declared(storage) && used(texels) < declared(texels));
    let with = |storage_buffers| {
        let descriptors = gpu_with(&GpuOptions::default()).caps().descriptors;
        gpu_of_limits(DescriptorLimits {
            per_stage_storage_buffers: storage_buffers,
            per_pipeline_storage_buffers: storage_buffers,
            per_stage_sampled_images: used(texels),
            per_stage_resources: used(storage) + used(texels),
            ..descriptors
        })
    };
    let gpu = with(used(storage));
    gpu.compute_pipeline::<compact_count::Kernel>(&Default::default())
        .unwrap();
    assert_no_messages(&gpu);
    let error = with(used(storage) - 1)
        .compute_pipeline::<compact_count::Kernel>(&Default::default())
        .unwrap_err();
    assert!(matches!(error, Error::MissingFeature { .. }), "{error}");
}

#[test]
fn more_than_the_heaps_hold_is_refused_with_its_cause() {
    const MIB: u64 = 1 << 20;
    let gpu = gpu_with(&GpuOptions {
        lesser: Lesser {
            heap_bytes: Some(16 * MIB),
            ..Lesser::default()
        },
        ..GpuOptions::default()
    });
    assert_eq!(gpu.caps().device_heap, 16 * MIB);
    let buffer = |name, mib| gpu.buffer(&BufferDesc::storage(name, mib * MIB, Category::Work));
    let first = buffer("first", 10).unwrap();
    let report = gpu.memory_report();
    match buffer("second", 10) {
        Err(Error::OutOfMemory { name, bytes, cause, .. }) => {
            assert_eq!((name.as_str(), bytes), ("second", 10 * MIB));
            assert!(cause.contains(&format!("of the {}", 16 * MIB)), "{cause}");
        }
        other => panic!("expected no memory, got {other:?}"),
    }
    // A refused allocation leaves nothing behind, and what is freed can be had again.
    assert_eq!(gpu.memory_report(), report);
    let rest = buffer("rest", 5).unwrap();
    drop(first);
    let second = buffer("second", 10).unwrap();
    // The host's side counts as well.
    let staging = gpu.buffer(&BufferDesc::readback("readback", 2 * MIB));
    assert!(matches!(staging, Err(Error::OutOfMemory { .. })), "{staging:?}");
    drop((rest, second));
    assert_no_messages(&gpu);
}
