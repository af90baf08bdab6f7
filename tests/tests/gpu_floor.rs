//! Floor 1: generated interfaces, barriers, timing, memory, life times.

use clerestory::Error;
use clerestory::gpu::{
    Access, BufferBarrier, BufferDesc, Caps, Category, DeviceSelection, Gpu, GpuOptions, Lesser, OptionalFeatures,
    rw_compute_to_compute, transfer_to_compute,
};
use clerestory_tests::shaders::types::{ProbeInner, ProbeRecord};
use clerestory_tests::shaders::{layout_probe, out_of_bounds, uniform_probe};
use clerestory_tests::{assert_no_messages, gpu_with, with_gpu};

/// Runs the probe over `count` records and returns the output block's header and its records.
fn probe(gpu: &Gpu, spec: &layout_probe::Spec, count: u32) -> (layout_probe::ProbeOutput, Vec<ProbeRecord>) {
    let pipeline = gpu.compute_pipeline::<layout_probe::Kernel>(spec).unwrap();
    let inputs: Vec<_> = (0..count)
        .map(|i| ProbeInner {
            direction: [i as f32, 2.0, 3.0],
            id: 100 + i,
        })
        .collect();
    let input = gpu.buffer_with("input", Category::Work, &inputs).unwrap();
    let header = size_of::<layout_probe::ProbeOutput>();
    let bytes = header + count as usize * size_of::<ProbeRecord>();
    let output = gpu
        .buffer(&BufferDesc::storage("output", bytes as u64, Category::Work))
        .unwrap();
    let push = layout_probe::Push {
        origin: [1.0, 2.0, 3.0],
        count,
        inner: ProbeInner {
            direction: [-1.0, -2.0, -3.0],
            id: 7,
        },
        transform: [[0.0; 3], [0.0; 3], [0.0; 3], [10.0, 20.0, 30.0]],
    };
    let mut recorder = gpu.recorder("probe").unwrap();
    recorder
        .pass("probe", |pass| {
            pass.fill(output.view(), 0xFFFF_FFFF)?;
            pass.barrier(&[transfer_to_compute(&output)]);
            let set = layout_probe::Set0 {
                probe_output: output.view(),
                probe_input: input.view(),
            };
            pass.dispatch(&pipeline, &[&set], &push, [pipeline.groups_for(count), 1, 1])
        })
        .unwrap();
    let timings = recorder.submit().unwrap().wait().unwrap();
    assert_eq!(timings.count("probe"), 1);
    let bytes: Vec<u8> = gpu.read(output.view(), bytes).unwrap();
    let records = bytes[header..]
        .chunks_exact(size_of::<ProbeRecord>())
        .map(bytemuck::pod_read_unaligned)
        .collect();
    (bytemuck::pod_read_unaligned(&bytes[..header]), records)
}

#[test]
fn generated_offsets_are_those_the_device_uses() {
    with_gpu(|gpu| {
        let spec = layout_probe::Spec {
            bias: 5,
            negate: true,
            scale: 0.5,
        };
        let (header, records) = probe(gpu, &spec, 13);
        assert_eq!(
            header,
            layout_probe::ProbeOutput {
                header: 13,
                echo: [11.0, 22.0, 33.0]
            }
        );
        assert_eq!(records.len(), 13);
        for (i, record) in records.iter().enumerate() {
            let expected = ProbeRecord {
                weight: -0.5 * (i as f32 + 5.0),
                inner: [
                    ProbeInner {
                        direction: [i as f32, 2.0, 3.0],
                        id: 100 + i as u32,
                    },
                    ProbeInner {
                        direction: [-1.0, -2.0, -3.0],
                        id: 7,
                    },
                ],
                uv: [-0.5, -1.0],
                basis: [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]],
                flags: [-1, -2, -3, i as i32],
                tail: 0xC1E2_E570 + i as u32,
            };
            assert_eq!(*record, expected);
        }
    });
}

#[test]
fn specialization_constants_default_to_the_shaders_own() {
    assert_eq!(
        layout_probe::Spec::default(),
        layout_probe::Spec {
            bias: 0,
            negate: false,
            scale: 1.0
        }
    );
    with_gpu(|gpu| {
        let (_, records) = probe(gpu, &layout_probe::Spec::default(), 2);
        assert_eq!((records[0].weight, records[1].weight), (0.0, 1.0));
    });
}

#[test]
#[cfg(debug_assertions)]
fn missing_barrier_is_an_error_that_names_both_passes() {
    with_gpu(|gpu| {
        let pipeline = gpu
            .compute_pipeline::<layout_probe::Kernel>(&Default::default())
            .unwrap();
        let buffer = |name| gpu.buffer(&BufferDesc::storage(name, 4096, Category::Work)).unwrap();
        let (output, input) = (buffer("output"), buffer("input"));
        let set = layout_probe::Set0 {
            probe_output: output.view(),
            probe_input: input.view(),
        };
        let push = layout_probe::Push::default();
        let run = |barrier: bool| {
            let mut recorder = gpu.recorder("hazard")?;
            recorder.pass("first", |pass| {
                pass.dispatch(&pipeline, &[&set], &push, [1, 1, 1])?;
                if barrier {
                    pass.barrier(&[rw_compute_to_compute(&output)]);
                }
                Ok(())
            })?;
            recorder.pass("second", |pass| pass.dispatch(&pipeline, &[&set], &push, [1, 1, 1]))?;
            recorder.submit()?.wait()
        };
        run(true).unwrap();
        match run(false) {
            Err(Error::MissingBarrier {
                pass,
                buffer,
                earlier,
                access,
            }) => {
                assert_eq!(
                    (pass.as_str(), buffer.as_str(), earlier.as_str(), access),
                    ("second", "output", "first", "writes")
                );
            }
            other => panic!("expected a missing barrier, got {other:?}"),
        }
    });
}

#[test]
#[cfg(debug_assertions)]
fn write_after_read_and_wrong_scope_are_hazards() {
    with_gpu(|gpu| {
        let buffer = |name| gpu.buffer(&BufferDesc::storage(name, 64, Category::Work)).unwrap();
        let (a, b) = (buffer("a"), buffer("b"));
        let mut recorder = gpu.recorder("hazards").unwrap();
        let error = recorder.pass("copy", |pass| {
            pass.copy(a.view(), b.view())?;
            pass.fill(a.view(), 1)
        });
        assert!(matches!(error, Err(Error::MissingBarrier { .. })), "{error:?}");
        let error = recorder.pass("indirect", |pass| {
            pass.memory_barrier(Access::TRANSFER_WRITE | Access::TRANSFER_READ, Access::COMPUTE);
            pass.copy(b.view(), a.view())
        });
        assert!(matches!(error, Err(Error::MissingBarrier { .. })), "{error:?}");
    });
}

#[test]
fn unknown_device_names_what_there_is() {
    let options = GpuOptions {
        device: DeviceSelection::Name("no such device".into()),
        ..GpuOptions::default()
    };
    match Gpu::headless(&options) {
        Err(Error::NoDevice { wanted, found }) => {
            assert!(wanted.contains("no such device"));
            assert!(!found.is_empty() && found != "none", "{found}");
        }
        other => panic!("expected NoDevice, got {other:?}"),
    }
}

/// A recorder with `count` dispatches of the word writer, each with a descriptor set of its own.
fn many_dispatches(gpu: &Gpu, count: u32) -> Vec<u32> {
    let pipeline = gpu.compute_pipeline::<out_of_bounds::Kernel>(&()).unwrap();
    let words = gpu
        .buffer_with("words", Category::Work, &vec![0u32; count as usize])
        .unwrap();
    let set = out_of_bounds::Set0 { words: words.view() };
    let mut recorder = gpu.recorder("many sets").unwrap();
    recorder
        .pass("write each", |pass| {
            for index in 0..count {
                let push = out_of_bounds::Push {
                    index,
                    value: index + 1,
                };
                pass.dispatch(&pipeline, &[&set], &push, [1, 1, 1])?;
                pass.barrier(&[rw_compute_to_compute(&words)]);
            }
            Ok(())
        })
        .unwrap();
    recorder.submit().unwrap().wait().unwrap();
    gpu.read(words.view(), count as usize).unwrap()
}

#[test]
fn descriptor_pools_grow_and_are_used_again() {
    with_gpu(|gpu| {
        for _ in 0..2 {
            let expected: Vec<u32> = (1..=700).collect();
            assert_eq!(many_dispatches(gpu, 700), expected);
        }
    });
}

#[test]
fn timestamps_and_statistics_are_plausible() {
    with_gpu(|gpu| {
        let words = gpu
            .buffer(&BufferDesc::storage("words", 64 << 20, Category::Work))
            .unwrap();
        let pipeline = gpu.compute_pipeline::<out_of_bounds::Kernel>(&()).unwrap();
        let set = out_of_bounds::Set0 { words: words.view() };
        let start = std::time::Instant::now();
        let mut recorder = gpu.recorder("timed").unwrap();
        recorder.count_invocations();
        recorder
            .pass("fill", |pass| {
                pass.fill(words.view(), 1)?;
                pass.barrier(&[transfer_to_compute(&words)]);
                Ok(())
            })
            .unwrap();
        let push = out_of_bounds::Push { index: 3, value: 9 };
        recorder
            .pass("dispatch", |pass| pass.dispatch(&pipeline, &[&set], &push, [5, 2, 1]))
            .unwrap();
        let timings = recorder.submit().unwrap().wait().unwrap();
        let wall = start.elapsed().as_secs_f64();
        if gpu.caps().timestamp_period > 0.0 {
            assert!(timings.passes[0].nanoseconds > Some(0), "{timings:?}");
            // The device's clock and the host's run at one rate to within a percent.
            assert!(timings.seconds() <= wall * 1.01, "{} > {wall}", timings.seconds());
        }
        if gpu.caps().pipeline_statistics {
            assert_eq!(timings.passes[0].invocations, Some(0));
            assert_eq!(timings.passes[1].invocations, Some(10));
        }
    });
}

#[test]
fn invocations_are_counted_from_where_it_was_asked_for() {
    with_gpu(|gpu| {
        if !gpu.caps().pipeline_statistics {
            return;
        }
        let words = gpu.buffer_with("words", Category::Work, &[0u32; 16]).unwrap();
        let pipeline = gpu.compute_pipeline::<out_of_bounds::Kernel>(&()).unwrap();
        let mut recorder = gpu.recorder("counted late").unwrap();
        for groups in 1..=4 {
            if groups == 3 {
                recorder.count_invocations();
            }
            let set = out_of_bounds::Set0 { words: words.view() };
            let push = out_of_bounds::Push { index: 3, value: 9 };
            recorder
                .pass("dispatch", |pass| {
                    pass.dispatch(&pipeline, &[&set], &push, [groups, 1, 1])?;
                    pass.barrier(&[rw_compute_to_compute(&words)]);
                    Ok(())
                })
                .unwrap();
            // To ask again changes nothing.
            if groups == 4 {
                recorder.count_invocations();
            }
        }
        let timings = recorder.submit().unwrap().wait().unwrap();
        let counts: Vec<_> = timings.passes.iter().map(|pass| pass.invocations).collect();
        assert_eq!(counts, [None, None, Some(3), Some(4)]);
    });
}

/// How many capabilities rest on optional features.
const OPTIONAL: usize = 11;

/// Those capabilities.
fn optional(caps: &Caps) -> [bool; OPTIONAL] {
    [
        caps.robust_buffer_access,
        caps.geometry_shader,
        caps.pipeline_statistics,
        caps.int64,
        caps.float64,
        caps.fragment_stores,
        caps.vertex_stores,
        caps.int64_atomics,
        caps.full_subgroups,
        caps.ray_query,
        caps.descriptor_indexing,
    ]
}

#[test]
fn the_capabilities_are_those_that_are_enabled() {
    let enabling = |features| {
        let gpu = gpu_with(&GpuOptions {
            lesser: Lesser {
                features,
                ..Lesser::default()
            },
            ..GpuOptions::default()
        });
        assert_no_messages(&gpu);
        gpu
    };
    // What keeps kernels in their buffers is not an option's to take away.
    let mut kept = [false; OPTIONAL];
    kept[0] = true;
    assert_eq!(optional(enabling(Some(OptionalFeatures::NONE)).caps()), kept);
    let gpu = enabling(None);
    let devices = Gpu::list().unwrap();
    let mut offered = devices.iter().map(|(_, offered)| offered);
    let offered = offered.find(|offered| offered.device == gpu.caps().device).unwrap();
    let [common @ .., descriptor_indexing] = optional(gpu.caps());
    assert_eq!(common, optional(offered)[..OPTIONAL - 1]);
    // Offered or not, nothing enables it.
    assert!(!descriptor_indexing);
}

#[test]
fn the_pipeline_cache_is_written_and_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let options = GpuOptions {
        cache_folder: Some(folder.path().to_owned()),
        ..GpuOptions::default()
    };
    let files = || -> Vec<std::path::PathBuf> {
        let mut list: Vec<_> = std::fs::read_dir(folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .collect();
        list.sort();
        list
    };
    let run = || {
        let gpu = gpu_with(&options);
        assert_eq!(many_dispatches(&gpu, 3), [1, 2, 3]);
        assert_no_messages(&gpu);
        drop(gpu);
        let files = files();
        assert_eq!(files.len(), 1, "{files:?}");
        let bytes = std::fs::read(&files[0]).unwrap();
        // The file's letters and version, and behind its other numbers the header that Vulkan prescribes: its size and version 1.
        assert_eq!(bytes[..12], *b"CLPIPELN\x01\0\0\0");
        assert_eq!(bytes[36..44], [32, 0, 0, 0, 1, 0, 0, 0]);
        assert!(bytes.len() >= 36 + 32 + 16);
        (files[0].clone(), bytes)
    };
    let (_, whole) = run();
    let (file, _) = run();
    // Data as the driver wrote it is not enough, nor is a file that has lost its end, or has changed.
    let mut changed = whole.clone();
    changed[40] ^= 1;
    for broken in [
        &b"not a pipeline cache"[..],
        &whole[36..whole.len() - 16],
        &whole[..whole.len() - 1],
        &changed,
    ] {
        std::fs::write(&file, broken).unwrap();
        let (again, _) = run();
        std::fs::rename(again, &file).unwrap();
    }
    // Two devices at a time, of which one goes first, leave one file for the next to read.
    let both = [gpu_with(&options), gpu_with(&options)];
    for gpu in &both {
        assert_eq!(many_dispatches(gpu, 3), [1, 2, 3]);
    }
    drop(both);
    run();
}

#[test]
fn live_allocations_are_listed_by_name() {
    with_gpu(|gpu| {
        let film = gpu
            .buffer(&BufferDesc::storage("radiance", 4096, Category::Film))
            .unwrap();
        let found = |gpu: &Gpu| {
            gpu.allocations()
                .iter()
                .any(|a| a.name == "radiance" && a.category == Category::Film && a.bytes >= 4096)
        };
        assert!(found(gpu));
        drop(film);
        assert!(!found(gpu));
    });
}

#[test]
fn submissions_may_be_empty_dropped_or_given_up() {
    with_gpu(|gpu| {
        let timings = gpu.recorder("empty").unwrap().submit().unwrap().wait().unwrap();
        assert!(timings.passes.is_empty());
        let before = gpu.memory_report();
        let words = gpu
            .buffer(&BufferDesc::storage("words", 1 << 20, Category::Work))
            .unwrap();
        // Dropping without waiting must keep the buffer until the device is done.
        let mut recorder = gpu.recorder("dropped").unwrap();
        recorder.pass("fill", |pass| pass.fill(words.view(), 1)).unwrap();
        let submission = recorder.submit().unwrap();
        drop(words);
        drop(submission);
        let words = gpu
            .buffer(&BufferDesc::storage("words", 1 << 20, Category::Work))
            .unwrap();
        let mut recorder = gpu.recorder("given up").unwrap();
        recorder.pass("fill", |pass| pass.fill(words.view(), 1)).unwrap();
        drop((recorder, words));
        assert_eq!(gpu.memory_report(), before);
    });
}

#[test]
fn waiting_with_a_limit_gives_the_submission_back() {
    with_gpu(|gpu| {
        let submission = long_work(gpu);
        // More than a gigabyte of writes cannot be over before the first question is asked.
        match submission.wait_for(std::time::Duration::ZERO) {
            Err((Error::TimedOut { what, .. }, Some(submission))) => {
                assert_eq!(what, "long");
                submission.wait().unwrap();
            }
            Err((error, _)) => panic!("{error}"),
            Ok(timings) => panic!("done at once: {timings:?}"),
        }
    });
}

#[test]
fn threads_share_a_device() {
    with_gpu(|gpu| {
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| assert_eq!(many_dispatches(gpu, 20), (1..=20).collect::<Vec<u32>>()));
            }
        });
    });
}

#[test]
fn uniform_buffers_want_barriers_of_their_own() {
    with_gpu(|gpu| {
        let pipeline = gpu.compute_pipeline::<uniform_probe::Kernel>(&()).unwrap();
        let words = gpu.buffer_with("words", Category::Work, &[1u32; 8]).unwrap();
        let addend = gpu.buffer(&BufferDesc::uniform("addend", 16, Category::Work)).unwrap();
        let run = |to| {
            let mut recorder = gpu.recorder("uniforms")?;
            recorder.pass("write", |pass| {
                pass.update(addend.view(), &[41u32])?;
                pass.barrier(&[BufferBarrier {
                    buffer: &addend,
                    from: Access::TRANSFER_WRITE,
                    to,
                }]);
                Ok(())
            })?;
            recorder.pass("add", |pass| {
                let set = uniform_probe::Set0 {
                    addend: addend.view(),
                    words: words.view(),
                };
                pass.dispatch(&pipeline, &[&set], &(), [1, 1, 1])
            })?;
            recorder.submit()?.wait()
        };
        // The union holds on every device: stages that it lacks are left out.
        run(Access::UNIFORM_READ).unwrap();
        assert_eq!(gpu.read::<u32>(words.view(), 8).unwrap(), [42; 8]);
        run(Access::COMPUTE_UNIFORM_READ).unwrap();
        assert_eq!(gpu.read::<u32>(words.view(), 8).unwrap(), [83; 8]);
        if cfg!(debug_assertions) {
            let result = run(Access::COMPUTE);
            assert!(
                matches!(&result, Err(Error::MissingBarrier { buffer, .. }) if buffer == "addend"),
                "{result:?}"
            );
        }
    });
}

/// Twenty fills of 64 MiB: more than a gigabyte of writes, which no device has done when the call returns.
fn long_work(gpu: &Gpu) -> clerestory::gpu::Submission {
    let words = gpu
        .buffer(&BufferDesc::storage("words", 64 << 20, Category::Work))
        .unwrap();
    let mut recorder = gpu.recorder("long").unwrap();
    recorder
        .pass("fill often", |pass| {
            for turn in 0..20 {
                pass.fill(words.view(), turn)?;
                pass.memory_barrier(Access::TRANSFER, Access::TRANSFER);
            }
            Ok(())
        })
        .unwrap();
    recorder.submit().unwrap()
}

#[test]
fn what_the_device_still_uses_outlives_its_owners() {
    // The submission dropped first, in the middle of the device's work, and its buffer with it.
    with_gpu(|gpu| {
        let before = gpu.memory_report();
        let submission = long_work(gpu);
        assert!(
            !submission.is_done().unwrap(),
            "the test wants work that is still running"
        );
        drop(submission);
        assert_eq!(gpu.memory_report(), before);
        // Its pools are used again.
        assert_eq!(many_dispatches(gpu, 3), [1, 2, 3]);
    });
    // The submission as the last owner of everything.
    let gpu = gpu_with(&GpuOptions::default());
    let log = gpu.validation_log();
    let submission = long_work(&gpu);
    drop(gpu);
    assert!(!submission.is_done().unwrap());
    drop(submission);
    let messages = log.take();
    assert!(messages.is_empty(), "{messages:#?}");
    // A thread that unwinds while its submission runs.
    with_gpu(|gpu| {
        let outcome = std::thread::scope(|scope| {
            let unwinding = scope.spawn(|| {
                let _running = long_work(gpu);
                std::panic::resume_unwind(Box::new("planted"));
            });
            unwinding.join()
        });
        assert!(outcome.is_err());
        assert_eq!(many_dispatches(gpu, 3), [1, 2, 3]);
    });
}
