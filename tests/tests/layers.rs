//! The nets themselves: what each validation mode and the recorder's own book must catch, shown by planted errors.

use clerestory::Error;
use clerestory::gpu::ash::vk;
use clerestory::gpu::shaders::accel::trace_rays;
use clerestory::gpu::shaders::sets::IndexSet;
use clerestory::gpu::{Access, BufferDesc, Category, Gpu, GpuOptions, TexelView, Validation, ValidationMessage};
use clerestory_tests::shaders::out_of_bounds;
use clerestory_tests::{assert_no_messages, gpu_with};

fn validated(validation: Validation) -> Gpu {
    gpu_with(&GpuOptions {
        validation,
        ..GpuOptions::default()
    })
}

/// Takes the messages; at least one must hold these words in its id or text.
fn assert_message(gpu: &Gpu, words: &str) {
    let messages = gpu.take_validation_messages();
    let said = |message: &ValidationMessage| message.id.contains(words) || message.text.contains(words);
    assert!(messages.iter().any(said), "no {words:?} among {messages:#?}");
}

/// Writes one word of a buffer of 16 words.
fn write_word(gpu: &Gpu, index: u32) {
    let pipeline = gpu.compute_pipeline::<out_of_bounds::Kernel>(&()).unwrap();
    let words = gpu.buffer_with("sixteen words", Category::Work, &[7u32; 16]).unwrap();
    let mut recorder = gpu.recorder("write").unwrap();
    recorder
        .pass("write one word", |pass| {
            let set = out_of_bounds::Set0 { words: words.view() };
            let push = out_of_bounds::Push { index, value: 1 };
            pass.dispatch(&pipeline, &[&set], &push, [1, 1, 1])
        })
        .unwrap();
    recorder.submit().unwrap().wait().unwrap();
    let read: Vec<u32> = gpu.read(words.view(), 16).unwrap();
    for (at, word) in read.into_iter().enumerate() {
        assert_eq!(word, if at as u32 == index { 1 } else { 7 }, "word {at}");
    }
}

#[test]
fn gpu_assisted_validation_catches_a_write_out_of_bounds() {
    let gpu = validated(Validation::GpuAssisted);
    write_word(&gpu, 15);
    assert_no_messages(&gpu);
    // Robust buffer access drops the write, so only the layer can tell.
    write_word(&gpu, 16);
    assert_message(&gpu, "Descriptor size is 64 and highest byte accessed was 67");
}

#[test]
fn core_validation_catches_a_faulty_call() {
    let gpu = validated(Validation::Core);
    let info = vk::BufferCreateInfo::default();
    // A buffer of no bytes and no usage is against the specification; the driver makes one all the same.
    #[expect(unsafe_code, reason = "the planted error")]
    // SAFETY: the software driver and the layers take the faulty call without harm.
    unsafe {
        if let Ok(raw) = gpu.raw_device().create_buffer(&info, None) {
            gpu.raw_device().destroy_buffer(raw, None);
        }
    }
    assert_message(&gpu, "VUID-VkBufferCreateInfo-size");
}

/// Copies `a` to `b` and `b` to `a` by raw commands, which the recorder's own book does not see.
fn copy_there_and_back(gpu: &Gpu, barrier: bool) {
    let buffer = |name| gpu.buffer(&BufferDesc::storage(name, 256, Category::Work)).unwrap();
    let (a, b) = (buffer("a"), buffer("b"));
    let mut recorder = gpu.recorder("copies").unwrap();
    recorder
        .pass("there and back", |pass| {
            let region = [vk::BufferCopy::default().size(256)];
            let device = gpu.raw_device();
            #[expect(unsafe_code, reason = "raw commands")]
            // SAFETY: the buffers outlive the wait below.
            unsafe {
                device.cmd_copy_buffer(pass.raw(), a.raw(), b.raw(), &region);
            }
            if barrier {
                pass.memory_barrier(Access::TRANSFER, Access::TRANSFER);
            }
            #[expect(unsafe_code, reason = "raw commands")]
            // SAFETY: as above.
            unsafe {
                device.cmd_copy_buffer(pass.raw(), b.raw(), a.raw(), &region);
            }
            Ok(())
        })
        .unwrap();
    recorder.submit().unwrap().wait().unwrap();
}

#[test]
fn synchronization_validation_catches_a_missing_barrier_between_copies() {
    let gpu = validated(Validation::Core);
    copy_there_and_back(&gpu, true);
    assert_no_messages(&gpu);
    copy_there_and_back(&gpu, false);
    assert_message(&gpu, "SYNC-HAZARD-READ-AFTER-WRITE");
}

#[test]
#[cfg(debug_assertions)]
fn the_recorder_catches_a_missing_barrier_between_dispatches() {
    let gpu = validated(Validation::Off);
    let pipeline = gpu.compute_pipeline::<out_of_bounds::Kernel>(&()).unwrap();
    let words = gpu.buffer(&BufferDesc::storage("words", 64, Category::Work)).unwrap();
    let set = out_of_bounds::Set0 { words: words.view() };
    let push = out_of_bounds::Push { index: 0, value: 1 };
    let mut recorder = gpu.recorder("dispatches").unwrap();
    let result = recorder.pass("twice", |pass| {
        pass.dispatch(&pipeline, &[&set], &push, [1, 1, 1])?;
        pass.dispatch(&pipeline, &[&set], &push, [1, 1, 1])
    });
    assert!(matches!(result, Err(Error::MissingBarrier { .. })), "{result:?}");
}

/// The second copy reads and writes the buffer that the first has read.
#[test]
#[cfg(debug_assertions)]
fn the_recorder_remembers_earlier_reads_when_a_command_reads_and_writes() {
    let gpu = validated(Validation::Off);
    let buffer = |name| gpu.buffer(&BufferDesc::storage(name, 64, Category::Work)).unwrap();
    let (words, other) = (buffer("words"), buffer("other"));
    let record = |barrier: bool| {
        let mut recorder = gpu.recorder("copies")?;
        recorder.pass("read, then move", |pass| {
            pass.copy(words.slice(32, 32), other.view())?;
            if barrier {
                pass.memory_barrier(Access::TRANSFER, Access::TRANSFER);
            }
            pass.copy(words.slice(0, 32), words.slice(32, 32))
        })
    };
    record(true).unwrap();
    let result = record(false);
    assert!(matches!(result, Err(Error::MissingBarrier { .. })), "{result:?}");
}

#[test]
#[cfg(debug_assertions)]
fn the_recorder_catches_a_dispatch_that_reads_by_texels_what_it_writes() {
    let gpu = validated(Validation::Core);
    let pipeline = gpu.compute_pipeline::<trace_rays::Kernel>(&Default::default()).unwrap();
    let texels = |name| {
        gpu.storage_texels(name, Category::Work, vk::Format::R32G32B32A32_UINT, 64)
            .unwrap()
    };
    let (one, other) = (texels("one"), texels("other"));
    let buffer = |name| gpu.buffer(&BufferDesc::storage(name, 1024, Category::Work)).unwrap();
    let (rays, resume, status) = (buffer("rays"), buffer("resume"), buffer("status"));
    let record = |hits: &TexelView| {
        let set = trace_rays::Set0 {
            trace_rays: rays.view(),
            trace_hits: hits.buffer().view(),
            trace_resume: resume.view(),
            trace_status: status.view(),
        };
        let bvh = IndexSet { index_texels: &one };
        let mut recorder = gpu.recorder("texels")?;
        // No group runs: it is about the bindings.
        recorder.pass("trace", |pass| {
            pass.dispatch(&pipeline, &[&set, &bvh], &Default::default(), [0, 1, 1])
        })
    };
    record(&other).unwrap();
    match record(&one) {
        Err(Error::Shader { name, message }) => {
            assert_eq!(name, "accel/trace_rays.comp");
            assert!(
                message.contains("index_texels") && message.contains("hits"),
                "{message}"
            );
        }
        other => panic!("expected a refused dispatch, got {other:?}"),
    }
    assert_no_messages(&gpu);
}
