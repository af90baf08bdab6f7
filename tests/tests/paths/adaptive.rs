//! Adaptive samples of the path tracer: where they go, that they bias nothing, and that nothing shows of how the work is cut up.
//!
//! Acceptance of means: z-tests with a false-alarm rate of 10⁻⁶ a channel, by the spread of independent pictures. That samples which steer their own weight fail such a
//! test is shown beside the code (`techniques/path/adaptive/shares.rs`).

use clerestory::gpu::interface::BindingSet;
use clerestory::gpu::shaders::sets::PathShareSet;
use clerestory::gpu::shaders::techniques::path::path_numbers;
use clerestory::gpu::shaders::types::PathShare;
use clerestory::gpu::{Access, BufferDesc, Category, Gpu};
use clerestory::scene::Scene;
use clerestory::techniques::PathTracerSettings;
use clerestory::techniques::path::Adaptive;
use clerestory_tests::render::{Rendered, builtin, finish, independent, render, tracer};
use clerestory_tests::statistics::expect_mean;
use clerestory_tests::with_gpu;

const SIZE: [u32; 2] = [24, 16];

fn adaptive() -> PathTracerSettings {
    PathTracerSettings {
        adaptive: Adaptive::Relative,
        ..PathTracerSettings::default()
    }
}

fn picture(gpu: &Gpu, scene: &Scene, samples: u32, settings: &PathTracerSettings) -> Rendered {
    finish(&mut tracer(gpu, scene, SIZE, settings), samples)
}

fn total(picture: &Rendered) -> f64 {
    picture.samples.iter().map(|count| f64::from(*count)).sum()
}

const PIXELS: f64 = 24.0 * 16.0;

#[test]
fn pictures_without_a_pilot_are_those_without_adaptivity() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:cornell-box");
        let settings = PathTracerSettings {
            aovs: true,
            ..PathTracerSettings::default()
        };
        let with = PathTracerSettings {
            aovs: true,
            ..adaptive()
        };
        let even = render(gpu, &scene, SIZE, 7, &settings);
        let few = picture(gpu, &scene, 7, &with);
        assert_eq!(few.bits(), even.bits());
        // Nor does a picture without it have anything of it.
        let plain = tracer(gpu, &scene, SIZE, &settings);
        let names: Vec<_> = plain
            .pipelines()
            .iter()
            .map(|kernel| kernel.shader.to_string())
            .collect();
        assert!(
            !names
                .iter()
                .any(|name| name.contains("numbers") || name.contains("shares")),
            "{names:?}"
        );
    });
}

#[test]
fn how_the_work_is_cut_up_never_shows() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:cornell-box");
        let truth = picture(gpu, &scene, 32, &adaptive());
        assert_eq!(picture(gpu, &scene, 32, &adaptive()).bits(), truth.bits(), "two runs");
        // Pixels that lie in several waves, and waves of a part of a pixel's samples.
        for paths_in_flight in [64, 1000] {
            let settings = PathTracerSettings {
                paths_in_flight,
                ..adaptive()
            };
            let split = picture(gpu, &scene, 32, &settings);
            assert_eq!(split.bits(), truth.bits(), "{paths_in_flight} paths in flight");
            assert_eq!(split.samples, truth.samples, "{paths_in_flight} paths in flight");
            assert_eq!(split.counters.extend_rays, truth.counters.extend_rays);
        }
        // Looked at after every submission.
        let settings = PathTracerSettings {
            paths_in_flight: 1000,
            ..adaptive()
        };
        let mut steps = tracer(gpu, &scene, SIZE, &settings);
        while let Some(step) = steps.step(32).unwrap() {
            let (picture, _) = steps.picture().unwrap();
            let samples: f32 = picture.layer("samples").unwrap().values().iter().sum();
            assert_eq!(f64::from(samples), step.done as f64, "whatever is there is on the film");
        }
        assert_eq!(finish(&mut steps, 32).bits(), truth.bits(), "in steps");
        steps.set_camera(&scene.cameras[0]).unwrap();
        assert_eq!(finish(&mut steps, 32).bits(), truth.bits(), "after set_camera");
        steps.restart(0).unwrap();
        assert_eq!(finish(&mut steps, 32).bits(), truth.bits(), "after restart");
    });
}

#[test]
fn samples_go_where_the_noise_is_and_spend_the_budget() {
    with_gpu(|gpu| {
        // Glass on the floor: a caustic, and walls of little noise.
        let scene = builtin("builtin:cornell-box?sphere=glass&boxes=none");
        let noise = render(gpu, &scene, SIZE, 1024, &independent());
        for (kind, samples) in [(Adaptive::Relative, 64), (Adaptive::Absolute, 61)] {
            let settings = PathTracerSettings {
                adaptive: kind,
                ..independent()
            };
            let picture = picture(gpu, &scene, samples, &settings);
            assert_eq!(total(&picture), PIXELS * f64::from(samples), "{kind:?}");
            assert!(
                picture.samples.iter().all(|count| *count >= (samples / 4) as f32),
                "{kind:?}"
            );
            // Standard errors as the method sees them, by many samples.
            let mean = noise.radiance.iter().map(|value| f64::from(*value)).sum::<f64>() / (3.0 * PIXELS);
            let deviation = |pixel: usize| {
                let variance = |c: usize| {
                    let (value, variance) = (noise.radiance[3 * pixel + c], noise.variance[3 * pixel + c]);
                    match kind {
                        Adaptive::Absolute => f64::from(variance),
                        _ => f64::from(variance) / (f64::from(value).powi(2) + 0.01 * mean * mean),
                    }
                };
                (0..3).map(variance).sum::<f64>().sqrt()
            };
            let mut pixels: Vec<usize> = (0..PIXELS as usize).collect();
            pixels.sort_by(|a, b| deviation(*a).total_cmp(&deviation(*b)));
            let part = |pixels: &[usize]| {
                pixels
                    .iter()
                    .map(|pixel| f64::from(picture.samples[*pixel]))
                    .sum::<f64>()
            };
            let (quiet, loud) = pixels.split_at(pixels.len() / 2);
            let [quiet, loud] = [part(quiet), part(loud)];
            assert!(loud > 1.3 * quiet, "{kind:?}: {loud} {quiet}");
        }
    });
}

#[test]
fn more_samples_asked_for_later_keep_those_that_are_there() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:cornell-box");
        let mut tracer = tracer(gpu, &scene, SIZE, &adaptive());
        let mut before = vec![0.0; PIXELS as usize];
        for samples in [1, 12, 13, 40, 40, 20] {
            let picture = finish(&mut tracer, samples);
            assert!(
                picture.samples.iter().zip(&before).all(|(now, before)| now >= before),
                "{samples}"
            );
            assert_eq!(
                total(&picture),
                PIXELS * f64::from(samples.max((total_of(&before) / PIXELS) as u32))
            );
            before = picture.samples;
        }
    });
}

fn total_of(samples: &[f32]) -> f64 {
    samples.iter().map(|count| f64::from(*count)).sum()
}

#[test]
fn pictures_of_one_pixel_and_without_noise_are_even() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:furnace-box?rho=0.5&emission=0.5");
        // One pixel has no others, and more samples than fit a wave; of two in a column each has the other.
        for (size, samples) in [([1, 1], 9000), ([1, 2], 64)] {
            let picture = finish(&mut tracer(gpu, &scene, size, &adaptive()), samples);
            assert_eq!(total(&picture), f64::from(size[0] * size[1] * samples));
        }
        let emitted = PathTracerSettings {
            path_set: "emitted".parse().unwrap(),
            ..adaptive()
        };
        render(gpu, &scene, SIZE, 20, &emitted);
    });
}

#[test]
fn slots_get_the_samples_of_their_places() {
    with_gpu(|gpu| {
        // Pixels with none, one and many, in a wave that begins and ends within a pixel.
        let counts: Vec<u32> = (0..300_u32)
            .map(|pixel| [0, 3, 1, 0, 70, 2][pixel as usize % 6])
            .collect();
        let (band_pixel, first_place, slot_count) = (1 << 20, 40, 3000);
        let mut shares = Vec::new();
        let mut expected = Vec::new();
        let mut place = 0;
        for (pixel, count) in (0..).zip(&counts) {
            shares.push(PathShare {
                first_place: place,
                first_sample: 7 * pixel,
            });
            expected.extend((0..*count).map(|sample| [band_pixel + pixel, 7 * pixel + sample]));
            place += count;
        }
        shares.push(PathShare {
            first_place: place,
            first_sample: 0,
        });
        let shares = gpu.buffer_with("shares", Category::Work, &shares).unwrap();
        let numbers = gpu
            .buffer(&BufferDesc::storage("numbers", 8 * 3000, Category::Work))
            .unwrap();
        let kernel = gpu.compute_pipeline::<path_numbers::Kernel>(&()).unwrap();
        let push = path_numbers::Push {
            band_pixel,
            first_pixel: 0,
            pixel_count: 300,
            first_place,
            slot_count,
        };
        let mut recorder = gpu.recorder("numbers").unwrap();
        recorder
            .pass("numbers", |pass| {
                let sets: [&dyn BindingSet<'_>; 2] = [
                    &path_numbers::Set0 {
                        path_numbers: numbers.view(),
                    },
                    &PathShareSet {
                        path_shares: shares.view(),
                    },
                ];
                pass.dispatch(&kernel, &sets, &push, [kernel.groups_for(slot_count), 1, 1])?;
                pass.memory_barrier(Access::COMPUTE, Access::TRANSFER_READ);
                Ok(())
            })
            .unwrap();
        recorder.submit().unwrap().wait().unwrap();
        let found = gpu.read::<[u32; 2]>(numbers.view(), slot_count as usize).unwrap();
        assert_eq!(found, expected[first_place as usize..][..slot_count as usize]);
    });
}

/// Of each channel: the mean over the picture and its variance, of `pictures` pictures with seeds of their own.
fn mean_of_pictures(gpu: &Gpu, scene: &Scene, samples: u32, pictures: u32) -> [(f64, f64); 3] {
    let settings = PathTracerSettings {
        adaptive: Adaptive::Relative,
        ..independent()
    };
    let mut tracer = tracer(gpu, scene, SIZE, &settings);
    let mut means = Vec::new();
    for seed in 0..pictures {
        tracer.restart(1000 + seed).unwrap();
        means.push(finish(&mut tracer, samples).mean().map(|(mean, _)| mean));
    }
    [0, 1, 2].map(|c| {
        let n = f64::from(pictures);
        let mean = means.iter().map(|of| of[c]).sum::<f64>() / n;
        let squares = means.iter().map(|of| (of[c] - mean).powi(2)).sum::<f64>();
        (mean, squares / (n - 1.0) / n)
    })
}

#[test]
fn adaptive_pictures_are_unbiased() {
    with_gpu(|gpu| {
        // Light that few paths meet, against many samples of all pixels alike.
        let glass = builtin("builtin:cornell-box?sphere=glass&boxes=none");
        let even = render(gpu, &glass, SIZE, 4096, &independent()).mean();
        let found = mean_of_pictures(gpu, &glass, 16, 96);
        for c in 0..3 {
            let ((expected, of_expected), (mean, variance)) = (even[c], found[c]);
            expect_mean(
                &format!("glass, channel {c}"),
                mean,
                variance + of_expected,
                expected,
                0.0,
            );
        }
        // The geometric series of a furnace.
        let furnace = builtin("builtin:furnace-box?rho=0.5&emission=0.5");
        for (c, (mean, variance)) in mean_of_pictures(gpu, &furnace, 12, 48).into_iter().enumerate() {
            expect_mean(&format!("furnace, channel {c}"), mean, variance, 1.0, 1e-6);
        }
    });
}
