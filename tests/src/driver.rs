//! What a driver does that no feature or limit of Vulkan tells, found out by asking it.

use clerestory::gpu::{BufferDesc, Category, Gpu};

use crate::shaders::loop_limit;

/// Iterations that each of 64 invocations counts when asked for `outer` × `inner`, or for `outer` in one loop when `inner` is 0.
pub fn loop_iterations(gpu: &Gpu, outer: u32, inner: u32) -> Vec<u32> {
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

/// Whether the driver ends long loops without a word, as llvmpipe does in some of its versions: one loop, or one within another, asked for more
/// than [`SOFTWARE_LOOP_CAP`](clerestory::gpu::SOFTWARE_LOOP_CAP) iterations.
pub fn caps_loops(gpu: &Gpu) -> bool {
    let ends_early = |outer, inner: u32| loop_iterations(gpu, outer, inner)[0] < outer * inner.max(1);
    ends_early(70_000, 0) || ends_early(1000, 100)
}
