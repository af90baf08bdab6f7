//! What drivers do in silence. These tests record it, so that the day it changes is noticed.

use clerestory::gpu::SOFTWARE_LOOP_CAP;
use clerestory_tests::driver::loop_iterations;
use clerestory_tests::with_gpu;

#[test]
fn loops_end_at_the_cap_on_lavapipe_and_nowhere_else() {
    with_gpu(|gpu| {
        const ASKED: u32 = 70_000;
        let ran = loop_iterations(gpu, ASKED, 0);
        let nested = loop_iterations(gpu, 1000, 100);
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
            loop_iterations(gpu, quota, 0).iter().all(|n| *n == quota),
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
