//! Helpers shared by the integration tests.
//!
//! Tests never skip for want of a device: without one they fail. Which validation layers run is decided by the environment variable
//! `CLERESTORY_VALIDATION` (`off`, `core`, `gpu`). Unlike for programs, unset means `core` here, so that a bare `cargo test` checks every
//! call; an unknown value fails the tests.

pub mod child;
pub mod driver;
pub mod fog;
pub mod render;
pub mod shaders;
pub mod statistics;
pub mod traced;
pub mod twin;

pub use clerestory_hard_cases::random;

use clerestory::gpu::{Gpu, GpuOptions, Validation};

/// The validation layers of the tests, `core` unless the environment says otherwise; panics on an unknown value.
pub fn validation() -> Validation {
    if std::env::var_os("CLERESTORY_VALIDATION").is_none() {
        return Validation::Core;
    }
    match Validation::Environment.resolve() {
        Ok(validation) => validation,
        Err(error) => panic!("{error}"),
    }
}

/// A headless device for a test; the test fails when there is none.
pub fn gpu() -> Gpu {
    gpu_with(&GpuOptions::default())
}

/// As [`gpu`], with options; where they leave validation to the environment, it is that of [`validation`].
pub fn gpu_with(options: &GpuOptions) -> Gpu {
    let mut options = options.clone();
    if options.validation == Validation::Environment {
        options.validation = validation();
    }
    match Gpu::headless(&options) {
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
