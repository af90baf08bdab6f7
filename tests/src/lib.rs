//! Helpers shared by the integration tests.
//!
//! Tests never skip for want of a device: without one they fail. Which validation layers run is decided by `CLERESTORY_VALIDATION`.

#[path = "../../engine/src/test_random.rs"]
pub mod random;
pub mod render;
pub mod shaders;
pub mod statistics;
pub mod twin;

use clerestory::gpu::{Gpu, GpuOptions};

/// A headless device for a test; the test fails when there is none.
pub fn gpu() -> Gpu {
    gpu_with(&GpuOptions::default())
}

/// As [`gpu`], with options.
pub fn gpu_with(options: &GpuOptions) -> Gpu {
    match Gpu::headless(options) {
        Ok(gpu) => gpu,
        Err(error) => panic!("the tests need a Vulkan device: {error}"),
    }
}

/// Runs `test` on a device and fails it on any validation message, those about what is left when the device goes included.
pub fn with_gpu(test: impl FnOnce(&Gpu)) {
    let gpu = gpu();
    let log = gpu.validation_log();
    test(&gpu);
    drop(gpu);
    let messages = log.take();
    assert!(messages.is_empty(), "validation messages: {messages:#?}");
}

/// Fails when the validation layers have said anything.
pub fn assert_no_messages(gpu: &Gpu) {
    let messages = gpu.take_validation_messages();
    assert!(messages.is_empty(), "validation messages: {messages:#?}");
}
