//! What drivers do in silence. These tests record it, so that the day it changes is noticed.

use clerestory::gpu::{BufferDesc, Category, Gpu, SOFTWARE_LOOP_CAP};
use clerestory_tests::shaders::loop_limit;
use clerestory_tests::with_gpu;

/// Iterations that each of 64 invocations counts when asked for `outer` × `inner`, or for `outer` in one loop when `inner` is 0.
fn counted(gpu: &Gpu, outer: u32, inner: u32) -> Vec<u32> {
    let pipeline = gpu.compute_pipeline::<loop_limit::Kernel>(&()).unwrap();
    let counts = gpu.buffer(&BufferDesc::storage("counts", 256, Category::Work)).unwrap();
    let mut recorder = gpu.recorder("loop limit").unwrap();
    let push = loop_limit::Push {
        iterations: outer,
        inner_iterations: inner,
        modulus: 1_000_003,
    };
    recorder
        .pass("loop limit", |pass| {
            let set = loop_limit::Set0 {
                loop_counts: counts.view(),
            };
            pass.dispatch(&pipeline, &[&set], &push, [1, 1, 1])
        })
        .unwrap();
    recorder.submit().unwrap().wait().unwrap();
    gpu.read(counts.view(), 64).unwrap()
}

#[test]
fn loops_end_at_the_cap_on_lavapipe_and_nowhere_else() {
    with_gpu(|gpu| {
        const ASKED: u32 = 70_000;
        let ran = counted(gpu, ASKED, 0);
        let nested = counted(gpu, 1000, 100);
        let driver = &gpu.caps().driver;
        println!(
            "{driver}: {} of {ASKED} iterations; {} of 1000 × 100",
            ran[0], nested[0]
        );
        assert!(
            ran.iter().all(|n| *n == ran[0]) && nested.iter().all(|n| *n == nested[0]),
            "invocations differ"
        );
        // The engine's kernels stay below this on every driver.
        let quota = clerestory::techniques::PathTracerSettings::default().ray_quota;
        assert!(
            counted(gpu, quota, 0).iter().all(|n| *n == quota),
            "{driver} ends loops below the engine's quota"
        );
        if driver.contains("llvmpipe") {
            assert!(
                nested[0] <= SOFTWARE_LOOP_CAP || nested[0] == 100_000,
                "{driver}: {}",
                nested[0]
            );
            assert!(
                ran[0] == SOFTWARE_LOOP_CAP || ran[0] == ASKED,
                "{driver} now runs {} iterations: see what the engine's quotas assume",
                ran[0]
            );
        } else {
            assert_eq!(
                ran[0], ASKED,
                "{driver} ends long loops early: add it here and look at the quotas"
            );
        }
    });
}
