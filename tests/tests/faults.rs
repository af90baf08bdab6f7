//! Device loss and exhausted memory, by a dispatch table that fails on purpose: each must be an error with its cause, leave nothing behind
//! and never crash, whatever is dropped in whatever order afterwards.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use clerestory::Error;
use clerestory::gpu::ash::vk;
use clerestory::gpu::fault::{FaultCall, FaultPlan};
use clerestory::gpu::{Access, BufferDesc, Category, Gpu, GpuOptions, ImageDesc, Submission, Validation};
use clerestory_tests::shaders::{layout_probe, out_of_bounds};
use clerestory_tests::{assert_no_messages, gpu_with};

/// The fault count is process-wide.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

fn faulty(call: FaultCall, nth: u32, result: vk::Result) -> (MutexGuard<'static, ()>, Gpu) {
    let guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    (guard, gpu_with(&planned(FaultPlan { call, nth, result })))
}

fn planned(plan: FaultPlan) -> GpuOptions {
    GpuOptions {
        fault: Some(plan),
        // GPU-assisted validation submits by another command than the one that fails here.
        validation: match clerestory_tests::validation() {
            Validation::GpuAssisted => Validation::Core,
            other => other,
        },
        cache_folder: None,
        ..GpuOptions::default()
    }
}

/// Submits two passes that fill a buffer.
fn submit_fills(gpu: &Gpu, names: [&str; 2]) -> clerestory::Result<Submission> {
    let buffer = gpu.buffer(&BufferDesc::storage("filled", 1024, Category::Work))?;
    let mut recorder = gpu.recorder("fills")?;
    recorder.pass(names[0], |pass| pass.fill(buffer.slice(0, 512), 1))?;
    recorder.pass(names[1], |pass| {
        pass.memory_barrier(Access::TRANSFER, Access::TRANSFER);
        pass.fill(buffer.slice(512, 512), 2)
    })?;
    recorder.submit()
}

fn last_pass<T>(result: clerestory::Result<T>) -> String {
    match result {
        Err(Error::DeviceLost { last_pass }) => last_pass,
        Err(other) => panic!("expected a lost device, got {other}"),
        Ok(_) => panic!("expected a lost device, got success"),
    }
}

/// Every call on a lost device fails at once and with the same words.
fn assert_lost(gpu: &Gpu, pass: &str) {
    let desc = BufferDesc::storage("after", 64, Category::Work);
    assert_eq!(last_pass(gpu.buffer(&desc)), pass);
    assert_eq!(last_pass(gpu.recorder("after")), pass);
    assert_eq!(last_pass(gpu.compute_pipeline::<out_of_bounds::Kernel>(&())), pass);
    assert_eq!(last_pass(gpu.buffer_with("after", Category::Work, &[1u32])), pass);
}

#[test]
fn device_lost_at_submission_names_the_last_pass_that_began() {
    let (_guard, gpu) = faulty(FaultCall::QueueSubmit, 3, vk::Result::ERROR_DEVICE_LOST);
    submit_fills(&gpu, ["a1", "a2"]).unwrap().wait().unwrap();
    let second = submit_fills(&gpu, ["b1", "b2"]).unwrap();
    while !second.is_done().unwrap() {
        std::thread::sleep(Duration::from_millis(1));
    }
    assert_eq!(last_pass(submit_fills(&gpu, ["c1", "c2"])), "b2");
    assert_eq!(last_pass(second.wait()), "b2");
    assert_lost(&gpu, "b2");
    assert_no_messages(&gpu);
}

#[test]
fn device_lost_at_the_first_submission_says_so() {
    let (_guard, gpu) = faulty(FaultCall::QueueSubmit, 1, vk::Result::ERROR_DEVICE_LOST);
    assert_eq!(last_pass(submit_fills(&gpu, ["a1", "a2"])), "before the first pass");
    assert_lost(&gpu, "before the first pass");
}

#[test]
fn device_lost_after_finished_work_names_its_last_pass() {
    let (_guard, gpu) = faulty(FaultCall::QueueSubmit, 2, vk::Result::ERROR_DEVICE_LOST);
    submit_fills(&gpu, ["a1", "a2"]).unwrap().wait().unwrap();
    assert_eq!(last_pass(submit_fills(&gpu, ["b1", "b2"])), "a2");
}

#[test]
fn device_lost_while_waiting_names_the_last_pass_that_began() {
    let (_guard, gpu) = faulty(FaultCall::WaitSemaphores, 2, vk::Result::ERROR_DEVICE_LOST);
    let submission = submit_fills(&gpu, ["a1", "a2"]).unwrap();
    // The first wait sees to it that the work is done, the second is told that the device is lost.
    let watched = submit_fills(&gpu, ["b1", "b2"]).unwrap();
    watched.wait().unwrap();
    let (error, left) = submission.wait_for(Duration::from_secs(60)).unwrap_err();
    assert!(left.is_none(), "a lost device gives nothing to wait for");
    assert_eq!(last_pass::<()>(Err(error)), "a2");
    assert_lost(&gpu, "a2");
    assert_no_messages(&gpu);
}

#[test]
fn a_lost_device_can_be_dropped_in_any_order() {
    for order in 0..3 {
        let (_guard, gpu) = faulty(FaultCall::WaitSemaphores, 1, vk::Result::ERROR_DEVICE_LOST);
        let buffer = gpu.buffer(&BufferDesc::storage("kept", 4096, Category::Work)).unwrap();
        let pipeline = gpu.compute_pipeline::<out_of_bounds::Kernel>(&()).unwrap();
        let recorder = gpu.recorder("given up").unwrap();
        let submission = submit_fills(&gpu, ["a1", "a2"]).unwrap();
        assert!(submission.is_done().is_err());
        let log = gpu.validation_log();
        match order {
            0 => drop((gpu, buffer, pipeline, recorder, submission)),
            1 => drop((submission, recorder, pipeline, buffer, gpu)),
            _ => drop((recorder, gpu, submission, buffer, pipeline)),
        }
        let messages = log.take();
        assert!(messages.is_empty(), "{messages:#?}");
    }
}

/// `make` must fail with out-of-memory that names `name`, leave nothing behind, and work the second time.
fn out_of_memory<T>(
    call: FaultCall,
    result: vk::Result,
    (memory, name): (&str, &str),
    make: impl Fn(&Gpu) -> clerestory::Result<T>,
) {
    let (_guard, gpu) = faulty(call, 1, result);
    let before = gpu.memory_report();
    match make(&gpu) {
        Err(error @ Error::OutOfMemory { .. }) => {
            let text = error.to_string();
            let Error::OutOfMemory {
                memory: which,
                name: what,
                cause,
                ..
            } = error
            else {
                return;
            };
            assert_eq!((which, what.as_str()), (memory, name), "{text}");
            assert!(!cause.is_empty() && text.contains(&cause), "{text}");
        }
        Err(other) => panic!("expected out of memory, got {other}"),
        Ok(_) => panic!("expected out of memory, got success"),
    }
    assert_eq!(gpu.memory_report(), before, "the failed call left memory behind");
    make(&gpu).unwrap_or_else(|error| panic!("the call must work once there is memory again: {error}"));
    assert_eq!(gpu.memory_report(), before);
    let log = gpu.validation_log();
    drop(gpu);
    let messages = log.take();
    assert!(messages.is_empty(), "{messages:#?}");
}

#[test]
fn out_of_memory_is_an_error_with_its_cause() {
    let device = vk::Result::ERROR_OUT_OF_DEVICE_MEMORY;
    let host = vk::Result::ERROR_OUT_OF_HOST_MEMORY;
    let buffer = |gpu: &Gpu| gpu.buffer(&BufferDesc::storage("big buffer", 1 << 16, Category::Work));
    let image = |gpu: &Gpu| {
        gpu.image(&ImageDesc {
            name: "big image",
            size: [64, 64],
            layers: 1,
            mips: 1,
            format: vk::Format::R8G8B8A8_UNORM,
            usage: vk::ImageUsageFlags::STORAGE,
            category: Category::Film,
        })
    };
    out_of_memory(FaultCall::AllocateMemory, device, ("device", "big buffer"), buffer);
    out_of_memory(FaultCall::AllocateMemory, device, ("device", "big image"), image);
    out_of_memory(FaultCall::CreateBuffer, device, ("device", "big buffer"), buffer);
    out_of_memory(FaultCall::CreateBuffer, host, ("host", "big buffer"), buffer);
    out_of_memory(FaultCall::CreateImage, device, ("device", "big image"), image);
    out_of_memory(
        FaultCall::CreateComputePipelines,
        device,
        ("device", "out_of_bounds.comp"),
        |gpu| gpu.compute_pipeline::<out_of_bounds::Kernel>(&()),
    );
    out_of_memory(
        FaultCall::CreateCommandPool,
        host,
        ("host", "vkCreateCommandPool"),
        |gpu| gpu.recorder("first").map(drop),
    );
}

#[test]
fn pipelines_stay_until_they_are_released() {
    let (_guard, gpu) = faulty(
        FaultCall::CreateComputePipelines,
        2,
        vk::Result::ERROR_OUT_OF_HOST_MEMORY,
    );
    let make = || gpu.compute_pipeline::<out_of_bounds::Kernel>(&()).map(drop);
    // The second call of the driver fails: what is asked for again is not made again.
    make().unwrap();
    make().unwrap();
    gpu.release_pipelines();
    assert!(matches!(make(), Err(Error::OutOfMemory { .. })));
    make().unwrap();
    let log = gpu.validation_log();
    drop(gpu);
    let messages = log.take();
    assert!(messages.is_empty(), "{messages:#?}");
}

#[test]
fn exhausted_descriptors_fail_the_pass_and_not_the_program() {
    let (_guard, gpu) = faulty(
        FaultCall::AllocateDescriptorSets,
        1,
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
    );
    let pipeline = gpu
        .compute_pipeline::<layout_probe::Kernel>(&Default::default())
        .unwrap();
    let buffer = |name| gpu.buffer(&BufferDesc::storage(name, 4096, Category::Work)).unwrap();
    let (output, input) = (buffer("output"), buffer("input"));
    let set = layout_probe::Set0 {
        probe_output: output.view(),
        probe_input: input.view(),
    };
    let run = || {
        let mut recorder = gpu.recorder("probe")?;
        recorder.pass("probe", |pass| {
            pass.dispatch(&pipeline, &[&set], &Default::default(), [1, 1, 1])
        })?;
        recorder.submit()?.wait()
    };
    assert!(matches!(run(), Err(Error::OutOfMemory { .. })));
    run().unwrap();
    assert_no_messages(&gpu);
}

#[test]
#[expect(
    unsafe_code,
    reason = "an event that the host sets, to hold the device inside a pass"
)]
fn the_marker_of_a_pass_is_written_when_all_before_has_ended_and_none_after() {
    let (_guard, gpu) = faulty(FaultCall::WaitSemaphores, 1, vk::Result::ERROR_DEVICE_LOST);
    let device = gpu.raw_device();
    // SAFETY: plain creation; destroyed below.
    let event = unsafe { device.create_event(&vk::EventCreateInfo::default(), None) }.unwrap();
    let work = gpu
        .buffer(&BufferDesc::storage("work", 16 << 20, Category::Work))
        .unwrap();
    let seen = gpu.buffer(&BufferDesc::readback("seen", 16)).unwrap();
    seen.write(0, &[0u32; 4]).unwrap();
    let mut recorder = gpu.recorder("held").unwrap();
    recorder.pass("before", |pass| pass.fill(work.view(), 1)).unwrap();
    recorder
        .pass("held", |pass| {
            pass.fill(seen.view(), 7)?;
            pass.memory_barrier(Access::TRANSFER_WRITE, Access::HOST_READ);
            let (host, all) = (vk::PipelineStageFlags::HOST, vk::PipelineStageFlags::ALL_COMMANDS);
            // SAFETY: the event outlives the submission.
            unsafe { device.cmd_wait_events(pass.raw(), &[event], host, all, &[], &[], &[]) };
            Ok(())
        })
        .unwrap();
    recorder
        .pass("after", |pass| {
            pass.memory_barrier(Access::TRANSFER, Access::TRANSFER);
            pass.fill(work.view(), 2)
        })
        .unwrap();
    let submission = recorder.submit().unwrap();
    let start = std::time::Instant::now();
    // SAFETY: the device writes the words once, and what a read in the middle of that gives is not used.
    while unsafe { seen.read_in_use::<u32>(0, 1) }.unwrap() != [7] {
        assert!(
            start.elapsed() < Duration::from_secs(60),
            "the device does not reach the pass"
        );
        std::thread::sleep(Duration::from_millis(1));
    }
    // Some time for a marker that does not wait for the pass before it.
    std::thread::sleep(Duration::from_millis(20));
    let lost = last_pass(submission.is_done());
    // SAFETY: the event is alive; setting it lets the device go on.
    unsafe { device.set_event(event) }.unwrap();
    assert_eq!(lost, "held");
    drop(submission);
    // SAFETY: the submission is gone, and with it the last use.
    unsafe { device.destroy_event(event, None) };
    assert_no_messages(&gpu);
}

#[test]
fn a_second_device_with_a_plan_is_refused_while_the_first_lives() {
    let (_guard, first) = faulty(FaultCall::QueueSubmit, 100, vk::Result::ERROR_DEVICE_LOST);
    let options = planned(FaultPlan {
        call: FaultCall::QueueSubmit,
        nth: 1,
        result: vk::Result::ERROR_DEVICE_LOST,
    });
    match Gpu::headless(&options) {
        Err(Error::Setting { name, .. }) => assert_eq!(name, "fault"),
        Err(other) => panic!("expected a refused plan, got {other}"),
        Ok(_) => panic!("the first device's calls would go to the second's driver"),
    }
    // The first works on by its own plan, and makes room when it goes.
    submit_fills(&first, ["a1", "a2"]).unwrap().wait().unwrap();
    drop(first);
    let second = gpu_with(&options);
    assert_eq!(last_pass(submit_fills(&second, ["b1", "b2"])), "before the first pass");
}
