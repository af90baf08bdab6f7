//! Floor 1: generated interfaces, barriers, timing, memory, limits.

use clerestory::Error;
use clerestory::gpu::shaders::tests::layout_probe;
use clerestory::gpu::shaders::types::{ProbeInner, ProbeRecord};
use clerestory::gpu::{
    Access, BufferDesc, Category, DeviceSelection, Gpu, GpuOptions, rw_compute_to_compute,
    transfer_to_compute,
};
use clerestory_tests::{gpu_with, with_gpu};

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
