//! What grids leave of light along eye rays, by walks and by tables: against the integral of the density, ray by ray.
//!
//! A floor that a light beneath a grid lights is seen through the grid and beside it, by the same photons and rays: the ratio of both pictures is what each ray has left of light.

use super::volume::{coloured, lit_box, uneven};
use super::*;
use clerestory::gpu::shaders::constants::WAY_PLACES;
use clerestory::gpu::{GpuOptions, Lesser};
use clerestory::scene::{Environment, Medium};
use clerestory::techniques::photon_mapping::volume::transmittance::VolumeTransmittance;
use clerestory_hard_cases::scenes::{
    DensityProfile, PROFILE_FACES, PROFILE_SIGMA, density_profiles, floor_under, profile_grid,
};
use clerestory_tests::render::cuboid;
use clerestory_tests::statistics::expect_mean_of;
use clerestory_tests::{assert_no_messages, gpu_with, with_gpu};
use glam::DVec3;

/// Rays of a pixel.
const RAYS: u32 = 64;

/// What pixels have left of light, on average of their rays, by band.
fn left_by(gpu: &Gpu, profile: &DensityProfile, volume_transmittance: VolumeTransmittance) -> [Vec<f64>; 3] {
    let settings = PhotonSettings {
        photons: 1 << 10,
        radius: 0.4,
        volume_radius: 0.1,
        samples_per_pass: RAYS,
        direct_photons: true,
        volume_transmittance,
        ..settings("bounces=1..1")
    };
    let [through, beside] = [0.0, 100.0].map(|aside| photons(gpu, &floor_under(profile, aside), &settings, RAYS));
    std::array::from_fn(|band| {
        let pixels = through.chunks(3).zip(beside.chunks(3));
        pixels
            .map(|(through, beside)| f64::from(through[band]) / f64::from(beside[band]))
            .collect()
    })
}

fn mean_of(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn walks_have_the_exact_transmittance_and_vary_less_than_delta_tracking() {
    with_gpu(|gpu| {
        for profile in density_profiles() {
            let name = profile.name;
            let all = left_by(gpu, &profile, VolumeTransmittance::Walk);
            for (left, sigma) in all.iter().zip(PROFILE_SIGMA) {
                // Lines between centres, with what lies beyond the outermost ones, have the mean of the cells.
                let exact = (-f64::from(sigma) * profile_grid(&profile, 0.0).mean()).exp();
                let what = format!("{name}, {sigma}/m");
                expect_mean_of(&what, left, exact, 0.0, 1e-5 * exact);
                let mean = mean_of(left);
                let of_pixels = left.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (left.len() - 1) as f64;
                // Delta tracking lets a ray's light pass, or nothing of it.
                let (variance, delta) = (of_pixels * f64::from(RAYS), exact * (1.0 - exact));
                println!("{what}: variance over that of delta tracking {:.3}", variance / delta);
                assert!(variance < 0.9 * delta, "{what}: {variance}, by delta tracking {delta}");
            }
        }
    });
}

#[test]
fn tables_err_by_what_lies_between_their_places() {
    with_gpu(|gpu| {
        let [low, high] = PROFILE_FACES;
        for (profile, bias) in density_profiles().into_iter().zip([1e-4, 5e-3, f64::INFINITY]) {
            let name = profile.name;
            let density = profile_grid(&profile, 0.0);
            let spacing = (high - low) / f64::from(WAY_PLACES);
            let places = (0..WAY_PLACES).map(|i| high - (f64::from(i) + 0.5) * spacing);
            let depth: f64 = places.map(|y| density.density(DVec3::Y * y) * spacing).sum();
            let all = left_by(gpu, &profile, VolumeTransmittance::Table);
            for (left, sigma) in all.iter().zip(PROFILE_SIGMA) {
                let sigma = f64::from(sigma);
                let (mean, what) = (mean_of(left), format!("{name}, {sigma}/m"));
                let exact = (-sigma * density.mean()).exp();
                println!(
                    "{what}: {mean:.6}, exact {exact:.6}, error {:.2} %",
                    (mean / exact - 1.0) * 100.0
                );
                // Each ray has the same, which is that of the middles: sums of 64 numbers, and an exponential.
                let expected = (-sigma * depth).exp();
                for value in left {
                    assert!((value / expected - 1.0).abs() < 1e-4, "{what}: {value}, not {expected}");
                }
                assert!((mean / exact - 1.0).abs() < bias, "{what}: {mean} {exact}");
            }
            if bias.is_infinite() {
                // Of the layer half of the depth is missing.
                assert!((depth / density.mean() - 0.5).abs() < 1e-3, "{depth}");
            }
        }
    });
}

/// All that a grid scatters, seen by tables.
fn tabulated(set: &str, photons: u32) -> PhotonSettings {
    PhotonSettings {
        volume_radius: 0.02,
        radius: 0.1,
        photons,
        volume_transmittance: VolumeTransmittance::Table,
        ..settings(set)
    }
}

#[test]
fn tables_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        // As walks do: what the table errs by is far less where density changes within a sixth of the way.
        let scene = lit_box(uneven(coloured()));
        expect_agreement(gpu, &scene, &tabulated("bounces=2..4", 1 << 14), [16, 1024], [2e-2; 3]);
    });
}

#[test]
fn tables_are_kept_for_queries_that_a_quota_stops() {
    with_gpu(|gpu| {
        let scene = lit_box(uneven(coloured()));
        let of = |query_quota| {
            let settings = PhotonSettings {
                query_quota,
                volume_radius: 0.05,
                ..tabulated("all", 1 << 11)
            };
            let mut mapper = mapper(gpu, &scene, &settings);
            let picture = advance(&mut mapper, 1);
            (picture, mapper.counts().beams, mapper.eye_counters().stalls)
        };
        let (whole, beams, stalls) = of(32_768);
        assert_eq!(stalls, 0);
        // Fewer steps than a ray takes here.
        let (stopped, stopped_beams, stalls) = of(24);
        assert!(stalls > 0 && beams.queries > 0);
        assert_eq!(stopped_beams, beams);
        // Sums of some hundred kernels in another order.
        for (i, (a, b)) in whole.iter().zip(&stopped).enumerate() {
            assert!((a - b).abs() <= 1e-5 * a, "{i}: {b}, not {a}");
        }
    });
}

/// Rays that scatter nowhere and meet no surface: none asks, none looks up a table, and the sky has what the grid leaves of it.
#[test]
fn the_sky_behind_a_grid_needs_no_table() {
    with_gpu(|gpu| {
        let even = DensityProfile {
            name: "even",
            values: vec![1.0],
        };
        let mut scene = Scene {
            name: "sky behind a grid".into(),
            environment: Some(Environment::uniform(Vec3::ONE)),
            ..Scene::default()
        };
        scene.media.push(Medium {
            sigma_a: Vec3::from_array(PROFILE_SIGMA),
            density: Some(profile_grid(&even, 0.0)),
            ..Medium::default()
        });
        let boundary = scene.add_material(Material {
            name: "boundary".into(),
            boundary: true,
            interior: Some(0),
            ..Material::default()
        });
        let [low, high] = PROFILE_FACES.map(|face| face as f32);
        scene.place(cuboid(
            "grid",
            boundary,
            Vec3::new(-1.0, low, -1.0),
            Vec3::new(1.0, high, 1.0),
        ));
        scene.cameras.push(camera_down(0.3, 5.0));
        let settings = PhotonSettings {
            samples_per_pass: RAYS,
            ..tabulated("all", 1 << 10)
        };
        let mut mapper = mapper(gpu, &scene, &settings);
        let radiance = advance(&mut mapper, RAYS);
        for (band, sigma) in PROFILE_SIGMA.into_iter().enumerate() {
            let pixels: Vec<f64> = radiance.chunks(3).map(|pixel| f64::from(pixel[band])).collect();
            let exact = (-f64::from(sigma) * (PROFILE_FACES[1] - PROFILE_FACES[0])).exp();
            // Rays to the corners are 2 % longer.
            expect_mean_of(&format!("{sigma}/m"), &pixels, exact, 0.0, 0.02 * exact);
        }
        // Those of the eye path's own walk.
        let look_ups = mapper.eye_counters().density_lookups as f64 / f64::from(SIDE * SIDE * RAYS);
        assert!(look_ups > 0.0 && look_ups < f64::from(WAY_PLACES) / 4.0, "{look_ups}");
    });
}

/// Where memory lacks, fewer eye paths are under way at once, so that there is room for what is kept of their ways through a grid.
#[test]
fn waves_shrink_until_ways_through_grids_fit_beside_them() {
    // Of the 74 MiB that the ways of a whole wave take, and what half a wave spares of them at least.
    const LACKING: u64 = 1 << 25;
    let of = |heap_bytes| {
        let lesser = Lesser {
            heap_bytes,
            ..Lesser::default()
        };
        let gpu = gpu_with(&GpuOptions {
            lesser,
            ..GpuOptions::default()
        });
        let mut mapper = mapper(&gpu, &lit_box(uneven(coloured())), &tabulated("all", 1 << 10));
        let used = gpu.memory_report().total();
        let picture = bits(&advance(&mut mapper, 2));
        assert_no_messages(&gpu);
        (used, picture)
    };
    let (whole, picture) = of(None);
    let (used, of_fewer) = of(Some(whole - LACKING));
    assert_eq!(of_fewer, picture);
    assert!(used + LACKING < whole, "{used} of {whole}");
}

#[test]
fn homogeneous_media_have_the_same_bits_by_either() {
    with_gpu(|gpu| {
        let of = |scene: &Scene, volume_transmittance| {
            let settings = PhotonSettings {
                volume_transmittance,
                ..tabulated("all", 1 << 10)
            };
            bits(&photons(gpu, scene, &settings, 1))
        };
        for (scene, alike) in [(lit_box(coloured()), true), (lit_box(uneven(coloured())), false)] {
            let both = [VolumeTransmittance::Walk, VolumeTransmittance::Table].map(|by| of(&scene, by));
            assert_eq!(both[0] == both[1], alike, "{}", scene.name);
        }
    });
}
