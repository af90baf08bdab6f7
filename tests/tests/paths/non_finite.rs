//! Samples that are not finite numbers: the film counts them by kind and keeps them out of its sums.

use clerestory::film::{GpuFilm, NonFiniteSamples};
use clerestory::gpu::ash::vk;
use clerestory::gpu::shaders::sets::{PathShareSet, PathSlotSet, WaveSet};
use clerestory::gpu::shaders::techniques::path::{path_resolve, path_resolve_shares};
use clerestory::gpu::shaders::types::{GatheredLight, PathShare};
use clerestory::gpu::{Access, Category, Pass};
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
        let none = gathered.view();
        let wave = WaveSet {
            status: none,
            walk_queue_in: &texels,
            walk_queue_out: none,
            walk_states_in: &texels,
            walk_states_out: none,
            walk_gathered: gathered.view(),
            walk_hits_in: &texels,
            walk_hits_out: none,
            walk_waiting_in: &texels,
            walk_waiting_out: none,
            walk_waiting_queue_in: &texels,
            walk_waiting_queue_out: none,
            walk_flags_in: &texels,
            walk_flags_out: none,
            walk_resume: none,
            walk_chunks: none,
            walk_medium_states: none,
            walk_medium_events: none,
            walk_shadow_starts: none,
            walk_airlight_rays: none,
            walk_shadow_states: none,
            medium_counters: none,
            walk_numbers_in: &texels,
        };
        let aovs = PathSlotSet {
            path_aovs: none,
            path_receivers: none,
            path_departures: none,
            path_even_distances: none,
            path_flights: none,
        };
        let spec = path_resolve::Spec { write_aovs: false };
        let kernel = gpu.compute_pipeline::<path_resolve::Kernel>(&spec).unwrap();
        let push = path_resolve::Push {
            first_film_pixel: 0,
            pixel_count: 2,
            sample_count: SAMPLES,
            first_sample: 0,
            slot_count: 2 * SAMPLES,
            first_slot: 0,
        };
        let groups = [1, 1, 1];
        let expect = |film: &GpuFilm, record: &dyn Fn(&mut Pass<'_>) -> clerestory::Result<()>| {
            let mut recorder = gpu.recorder("resolve").unwrap();
            recorder
                .pass("resolve", |pass| {
                    record(pass)?;
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
        };
        expect(&film, &|pass| {
            pass.dispatch(&kernel, &[&wave, &aovs, &film.bands()[0].set()], &push, groups)
        });

        // Adaptive samples: three of the first pixel, five of the second.
        let places = [0, 3, 8].map(|first_place| PathShare {
            first_place,
            first_sample: 0,
        });
        let buffer = gpu.buffer_with("shares", Category::Work, &places).unwrap();
        let shares = PathShareSet {
            path_shares: buffer.view(),
        };
        let spec = path_resolve_shares::Spec { write_aovs: false };
        let kernel = gpu.compute_pipeline::<path_resolve_shares::Kernel>(&spec).unwrap();
        let film = GpuFilm::new(gpu, [2, 1], false).unwrap();
        let push = path_resolve_shares::Push {
            first_pixel: 0,
            pixel_count: 2,
            first_place: 0,
            slot_count: 8,
        };
        expect(&film, &|pass| {
            pass.dispatch(&kernel, &[&wave, &aovs, &shares, &film.bands()[0].set()], &push, groups)
        });
        // Behind place 100 of a round, of which the wave has the last eight.
        let places = [100, 103, 108].map(|first_place| PathShare {
            first_place,
            first_sample: 0,
        });
        gpu.upload(&buffer, 0, &places).unwrap();
        let film = GpuFilm::new(gpu, [2, 1], false).unwrap();
        let push = path_resolve_shares::Push {
            first_place: 100,
            ..push
        };
        expect(&film, &|pass| {
            pass.dispatch(&kernel, &[&wave, &aovs, &shares, &film.bands()[0].set()], &push, groups)
        });
    });
}
