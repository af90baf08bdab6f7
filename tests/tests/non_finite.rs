//! Samples that are no finite numbers: the film counts them by kind and keeps them out of its sums.

use clerestory::film::{GpuFilm, NonFiniteSamples};
use clerestory::gpu::ash::vk;
use clerestory::gpu::shaders::sets::PathBuffers;
use clerestory::gpu::shaders::transport::path_resolve;
use clerestory::gpu::shaders::types::GatheredLight;
use clerestory::gpu::{Access, Category};
use clerestory_tests::with_gpu;

#[test]
fn they_are_counted_by_kind_and_left_out() {
    with_gpu(|gpu| {
        const SAMPLES: u32 = 4;
        let film = GpuFilm::new(gpu, [2, 1], false).unwrap();
        let (nan, inf) = (f32::NAN, f32::INFINITY);
        let radiance = [
            // Of the first pixel one sample is sound, of the second three.
            [1.0, 2.0, 3.0],
            [nan, 1.0, 1.0],
            [1.0, -inf, 1.0],
            [1.0, inf, nan],
            [1.0, 1.0, 1.0],
            [3.0, 3.0, 3.0],
            [inf, 0.0, 0.0],
            [2.0, 2.0, 2.0],
        ];
        let samples = radiance.map(|radiance| GatheredLight { radiance, interior: 0 });
        let gathered = gpu.buffer_with("gathered", Category::Work, &samples).unwrap();
        // What the kernel does not use is not bound.
        let texels = gpu
            .storage_texels("none", Category::Work, vk::Format::R32_UINT, 1)
            .unwrap();
        let paths = PathBuffers {
            status: gathered.view(),
            path_queue_in: &texels,
            path_queue_out: gathered.view(),
            path_states_in: &texels,
            path_states_out: gathered.view(),
            path_gathered: gathered.view(),
            path_hits_in: &texels,
            path_hits_out: gathered.view(),
            path_shadow_rays_in: &texels,
            path_shadow_rays_out: gathered.view(),
            path_shadow_queue_in: &texels,
            path_shadow_queue_out: gathered.view(),
            path_flags_in: &texels,
            path_flags_out: gathered.view(),
            path_resume: gathered.view(),
            path_chunks: gathered.view(),
            path_aovs: gathered.view(),
        };
        let spec = path_resolve::Spec { write_aovs: false };
        let kernel = gpu.compute_pipeline::<path_resolve::Kernel>(&spec).unwrap();
        let push = path_resolve::Push {
            first_film_pixel: 0,
            pixel_count: 2,
            sample_count: SAMPLES,
        };
        let mut recorder = gpu.recorder("resolve").unwrap();
        recorder
            .pass("resolve", |pass| {
                pass.dispatch(&kernel, &[&paths, &film.bands()[0].set()], &push, [1, 1, 1])?;
                pass.memory_barrier(Access::COMPUTE, Access::TRANSFER_READ);
                Ok(())
            })
            .unwrap();
        recorder.submit().unwrap().wait().unwrap();
        let (picture, left_out) = film.picture().unwrap();
        assert_eq!(left_out, NonFiniteSamples { nan: 2, infinite: 2 });
        let values = |name: &str| picture.layer(name).unwrap().values();
        assert_eq!(values("samples"), [1.0, 3.0]);
        assert_eq!(values("radiance"), [1.0, 2.0, 3.0, 2.0, 2.0, 2.0]);
    });
}
