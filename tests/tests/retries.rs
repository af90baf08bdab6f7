//! A step or a picture that fails for another reason than a lost device can be asked for again, and nothing is lost, doubled or mixed.

use std::sync::Mutex;

use clerestory::Error;
use clerestory::film::picture::Picture;
use clerestory::gpu::ash::vk;
use clerestory::gpu::fault::{FaultCall, FaultPlan};
use clerestory::gpu::{GpuOptions, Validation};
use clerestory::techniques::PathTracerSettings;
use clerestory_tests::render::{builtin, tracer};
use clerestory_tests::{assert_no_messages, gpu, gpu_with};

/// The fault count is process-wide.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

const SIZE: [u32; 2] = [16, 16];
const SAMPLES: u32 = 4;

/// Every value of every layer.
fn bits(picture: &Picture) -> Vec<u32> {
    let layers = picture.layers().iter();
    layers
        .flat_map(|layer| layer.values().iter().map(|value| value.to_bits()))
        .collect()
}

#[test]
fn what_failed_is_done_again_without_a_trace() {
    let _guard = ONE_AT_A_TIME.lock().unwrap();
    let scene = builtin("builtin:cornell-box");
    // A wave for each sample.
    let settings = PathTracerSettings {
        paths_in_flight: 256,
        ..PathTracerSettings::default()
    };
    let mut undisturbed = tracer(&gpu(), &scene, SIZE, &settings);
    undisturbed.render(SAMPLES).unwrap();
    let (truth, _) = undisturbed.picture().unwrap();
    let mut failures = 0;
    for call in [
        FaultCall::WaitSemaphores,
        FaultCall::QueueSubmit,
        FaultCall::AllocateDescriptorSets,
    ] {
        for nth in 1..16 {
            let options = GpuOptions {
                fault: Some(FaultPlan {
                    call,
                    nth,
                    result: vk::Result::ERROR_OUT_OF_HOST_MEMORY,
                }),
                // GPU-assisted validation submits by another command than the one that fails here.
                validation: match clerestory_tests::validation() {
                    Validation::GpuAssisted => Validation::Core,
                    other => other,
                },
                cache_folder: None,
                ..GpuOptions::default()
            };
            let gpu = gpu_with(&options);
            let mut again = |error: Error| {
                assert!(matches!(error, Error::OutOfMemory { .. }), "{call:?} {nth}: {error}");
                failures += 1;
            };
            // A fault while the scene or the tracer is made is for their own tests.
            let Ok(uploaded) = clerestory::transport::GpuScene::new(&gpu, &scene) else {
                continue;
            };
            let camera = &scene.cameras[0];
            let Ok(mut tracer) =
                clerestory::techniques::PathTracer::new(&gpu, uploaded.into(), camera, SIZE, settings.clone())
            else {
                continue;
            };
            while let Some(error) = tracer.render(SAMPLES).err() {
                again(error);
            }
            let picture = loop {
                match tracer.picture() {
                    Ok((picture, _)) => break picture,
                    Err(error) => again(error),
                }
            };
            assert!(bits(&picture) == bits(&truth), "{call:?} {nth}: another picture");
            drop(tracer);
            assert_no_messages(&gpu);
        }
    }
    assert!(failures >= 12, "only {failures} faults met a step or a picture");
}
