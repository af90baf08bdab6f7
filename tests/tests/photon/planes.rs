//! Photon planes: closed forms, the path tracer on the light paths that they alone carry, and what they share with beams and with eye paths that go on.

use super::shared_paths::expect_same_bits_however_it_is_done;
use super::volume::{airlight, behind_a_pane, box_by_a_lamp, coloured, endless, lit_box, single};
use super::volume_truths::{exactly, parallel};
use super::*;
use clerestory::scene::{AlphaMode, Environment, Medium, Phase};
use clerestory::techniques::photon_mapping::volume::VolumeEstimate;
use clerestory_tests::render::{builtin, cuboid, medium};
use clerestory_tests::with_gpu;
use glam::{DVec3, Vec4};

/// Light that is scattered in a medium twice at last, with no surface in between: that of planes alone.
const OF_PLANES: &str = "L.*VVE";

fn planes(set: &str, photons: u32) -> PhotonSettings {
    PhotonSettings {
        volume: VolumeEstimate::Planes,
        // All ways have planes; of beams there is none in the light of planes.
        volume_radius: 0.3,
        photons,
        ..settings(set)
    }
}

fn forward() -> Medium {
    medium(2.0, 0.8, Phase::HenyeyGreenstein { g: 0.5 })
}

#[test]
fn planes_have_the_exact_multiple_scattering() {
    with_gpu(|gpu| {
        // As by kernels (`volume_truths.rs`), without what those blur.
        for (albedo, h, expected) in [(0.5, 0.5, 4.22674e-4), (0.9, 1.0, 2.27478e-3)] {
            let mut scene = endless(medium(1.0, albedo, Phase::Isotropic));
            scene.cameras = vec![parallel(DVec3::new(-3.0, h, 0.0), DVec3::X, 1e-6)];
            let found = means(gpu, &scene, &planes("bounces=2..", 1 << 11), 32);
            found.expect(&format!("albedo {albedo}, {h} m away"), 0, 0, exactly(expected), 0.0);
            assert!(found.counts.beams.photons > 1000);
        }
    });
}

#[test]
fn planes_agree_with_the_path_tracer_without_blur() {
    with_gpu(|gpu| {
        // The sphere stands between many of the places of two flights.
        for scene in [lit_box(coloured()), builtin("builtin:fog-box?sphere=glass&sigma_s=3")] {
            expect_agreement(gpu, &scene, &planes(OF_PLANES, 1 << 10), [32, 512], [0.0; 3]);
        }
        // A share of all ways that the radius of beams says; and rays along flights that pass a sheet with holes.
        let mut sheet = lit_box(coloured());
        let holes = sheet.add_material(Material {
            base_color: Vec4::new(0.5, 0.5, 0.5, 0.5),
            alpha_mode: AlphaMode::Blend,
            ..Material::lambert("holes", Vec3::ZERO)
        });
        sheet.place(cuboid(
            "sheet",
            holes,
            Vec3::new(-0.2, -0.3, -0.3),
            Vec3::new(-0.19, 0.3, 0.3),
        ));
        let shared = PhotonSettings {
            volume_radius: 0.0,
            ..planes(OF_PLANES, 1 << 10)
        };
        expect_agreement(gpu, &sheet, &shared, [32, 512], [0.0; 3]);
    });
}

#[test]
fn planes_and_beams_have_every_path_once() {
    with_gpu(|gpu| {
        // Two boxes of the same medium: flights from one into the other are those of beams.
        let mut scene = lit_box(forward());
        let boundary = scene.meshes[1].material;
        let (low, high) = (Vec3::new(0.55, -0.5, -0.5), Vec3::new(0.8, 0.2, 0.5));
        scene.place(cuboid("second box", boundary.unwrap_or(0), low, high));
        scene.cameras = vec![camera_down(0.85, 5.0)];
        for set in ["bounces=2..4", OF_PLANES] {
            let reference = traced(gpu, &scene, set, 1024);
            for volume in [VolumeEstimate::Beams, VolumeEstimate::Planes] {
                let settings = PhotonSettings {
                    volume,
                    volume_radius: 0.02,
                    radius: 0.1,
                    ..planes(set, 1 << 12)
                };
                let found = means(gpu, &scene, &settings, 16);
                // As of beams in one box (`volume.rs`).
                found.expect_same_as(&format!("{volume:?}, {set}"), &reference, [1.5e-2; 3]);
                assert!(found.counts.beams.photons > 1000);
            }
        }
    });
}

#[test]
fn single_scattering_is_that_of_beams() {
    with_gpu(|gpu| {
        let scene = airlight(0.5, 2.0, 1.0);
        let [beams, planes] = [VolumeEstimate::Beams, VolumeEstimate::Planes].map(|volume| {
            let settings = PhotonSettings {
                photons: 1 << 12,
                ..single(volume, 0.05)
            };
            photons(gpu, &scene, &settings, 2)
        });
        assert!(beams[0] > 0.0);
        assert_eq!(bits(&planes), bits(&beams));
    });
}

#[test]
fn lengths_times_eight_give_a_sixty_fourth_by_planes() {
    with_gpu(|gpu| {
        let of = |lengths: f32| {
            let settings = PhotonSettings {
                path_set: OF_PLANES.parse().unwrap_or_else(|error| panic!("{error}")),
                photons: 1 << 12,
                ..single(VolumeEstimate::Planes, 0.25 * lengths)
            };
            photons(gpu, &airlight(0.5, 2.0, lengths), &settings, 2)
        };
        let (truth, scaled) = (of(1.0), of(8.0));
        assert!(truth[0] > 1e-4, "{}", truth[0]);
        let back: Vec<f32> = scaled.iter().map(|value| value * 64.0).collect();
        assert_eq!(bits(&back), bits(&truth));
    });
}

#[test]
fn planes_that_a_quota_stops_go_through_all_records() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:fog-box?sphere=glass&sigma_s=3");
        // Of all light, so that what is seen on surfaces waits for rays along flights.
        let of = |query_quota, submission_work| {
            let settings = PhotonSettings {
                query_quota,
                submission_work,
                ..planes("all", 1 << 9)
            };
            let mut mapper = mapper(gpu, &scene, &settings);
            let picture = advance(&mut mapper, 2);
            (picture, mapper.counts().beams, mapper.eye_counters().stalls)
        };
        let (whole, counts, stalls) = of(32_768, 0);
        assert!(stalls == 0 && counts.photons > 1000);
        assert!(counts.rays > 100 && counts.rays <= counts.queries, "{counts:?}");
        // What is left for later, rays along flights among it, never shows.
        assert_eq!(bits(&of(32_768, 1).0), bits(&whole));
        let (stopped, stopped_counts, stalls) = of(64, 0);
        assert!(stalls > 0);
        assert_eq!(stopped_counts, counts);
        // The same planes are chosen; sums of all of them in another order.
        for (i, (a, b)) in whole.iter().zip(&stopped).enumerate() {
            assert!((a - b).abs() <= 1e-5 * a, "{i}: {b}, not {a}");
        }
    });
}

/// Flights in a body end where it does, at most, so that few boxes hold a ray however thin the medium is.
#[test]
fn planes_of_thin_bodies_are_no_larger_than_these() {
    with_gpu(|gpu| {
        let thin = Medium {
            // A band that scatters nothing, and would come very far.
            sigma_s: Vec3::new(0.08, 0.08, 0.0),
            sigma_a: Vec3::new(0.0, 0.0, 1e-4),
            ..Medium::default()
        };
        let of = |medium: Medium| {
            let settings = planes(OF_PLANES, 1 << 12);
            let mut mapper = mapper(gpu, &lit_box(medium), &settings);
            advance(&mut mapper, 2);
            assert_eq!(mapper.eye_counters().stalls, 0);
            mapper.counts().beams
        };
        assert!(of(thin).photons > 100);
    });
}

#[test]
fn what_is_chosen_alone_has_planes() {
    with_gpu(|gpu| {
        let names = |scene: &Scene, volume| -> Vec<&str> {
            let settings = PhotonSettings {
                volume,
                ..settings("all")
            };
            let mapper = mapper(gpu, scene, &settings);
            mapper.pipelines().iter().map(|pipeline| pipeline.shader).collect()
        };
        let has = |names: &[&str]| names.iter().any(|name| name.contains("photon_plane_rays"));
        let fog = lit_box(forward());
        assert!(has(&names(&fog, VolumeEstimate::Planes)));
        assert!(!has(&names(&fog, VolumeEstimate::Beams)));
        assert!(!has(&names(&builtin("builtin:cornell-box"), VolumeEstimate::Planes)));
    });
}

/// Mean squared errors of means over 1 and over 16 of so many passes of a rendering, beyond those of the truth itself.
fn errors_of_passes(gpu: &Gpu, scene: &Scene, settings: &PhotonSettings, passes: u32, truth: &Rendered) -> [f64; 2] {
    const GROUP: usize = 16;
    let mut mapper = mapper(gpu, scene, settings);
    let mut before = vec![0.0; truth.radiance.len()];
    let passes: Vec<Vec<f64>> = (1..=passes)
        .map(|pass| {
            let so_far = advance(&mut mapper, pass).into_iter();
            let so_far: Vec<f64> = so_far.map(|value| f64::from(value) * f64::from(pass)).collect();
            let own = so_far.iter().zip(&before).map(|(now, before)| now - before).collect();
            before = so_far;
            own
        })
        .collect();
    let own_error: f64 = truth.variance.iter().map(|variance| f64::from(*variance)).sum();
    [1, GROUP].map(|group| {
        let groups = passes.chunks_exact(group);
        let count = groups.len() as f64;
        let squared = groups.map(|passes| {
            let mean = |i: usize| passes.iter().map(|pass| pass[i]).sum::<f64>() / group as f64;
            let errors = (0..before.len()).map(|i| (mean(i) - f64::from(truth.radiance[i])).powi(2));
            errors.sum::<f64>() - own_error
        });
        squared.sum::<f64>() / count
    })
}

#[test]
fn errors_of_planes_fall_with_the_root_of_passes() {
    with_gpu(|gpu| {
        let scene = lit_box(medium(2.0, 0.8, Phase::Isotropic));
        let truth = traced(gpu, &scene, OF_PLANES, 2048);
        let slope = |volume, passes| {
            let settings = PhotonSettings {
                volume,
                ..planes(OF_PLANES, 1 << 10)
            };
            let [one, sixteen] = errors_of_passes(gpu, &scene, &settings, passes, &truth);
            let slope = 0.5 * (sixteen / one).ln() / 16f64.ln();
            println!("{volume:?}: MSE {one:.4e} of a pass, {sixteen:.4e} of sixteen, slope {slope:.4} of RMSE");
            slope
        };
        // Where nothing shrinks, blur stays.
        assert!((slope(VolumeEstimate::Planes, 96) + 0.5).abs() < 0.1);
        assert!(slope(VolumeEstimate::Beams, 48) > -0.4);
    });
}

/// With eye paths that go on, and so few photons under such narrow kernels that these have a good part of the light.
fn sharing(set: &str) -> PhotonSettings {
    PhotonSettings {
        volume_paths: true,
        volume_radius: 0.02,
        radius: 0.1,
        ..planes(set, 1 << 11)
    }
}

/// The box of a medium under a sky instead of its light.
fn under_a_sky(medium: Medium) -> Scene {
    let mut scene = lit_box(medium);
    scene.name = "sky".into();
    scene.lights.clear();
    scene.environment = Some(Environment::uniform(Vec3::new(0.5, 1.0, 2.0)));
    scene
}

/// Planes alone are up to a third too dark here. Of a point light the path tracer finds as few of the connections that count, and is no reference: lights are wide.
#[test]
fn eye_paths_have_what_planes_lack_of_narrow_phase_functions() {
    with_gpu(|gpu| {
        for g in [0.95, -0.95] {
            let narrow = || medium(2.0, 0.9, Phase::HenyeyGreenstein { g });
            for (scene, samples) in [(box_by_a_lamp(narrow()), 4096), (under_a_sky(narrow()), 512)] {
                let counts = expect_agreement(gpu, &scene, &sharing(OF_PLANES), [24, samples], [0.0; 3]);
                assert!(counts.beams.photons > 300);
            }
        }
    });
}

#[test]
fn eye_paths_share_the_light_of_planes_and_of_beams() {
    with_gpu(|gpu| {
        // A body within the body, and another one of the same medium beside it: ways between bodies are those of beams.
        let mut nested = lit_box(coloured());
        nested.name = "nested".into();
        nested.media.push(medium(6.0, 0.7, Phase::HenyeyGreenstein { g: -0.5 }));
        let inside = nested.add_material(Material {
            name: "inside".into(),
            boundary: true,
            interior: Some(1),
            ..Material::default()
        });
        nested.place(cuboid("inside", inside, Vec3::splat(-0.2), Vec3::splat(0.2)));
        let boundary = nested.meshes[1].material.unwrap_or(0);
        let (low, high) = (Vec3::new(0.55, -0.5, -0.5), Vec3::new(0.8, 0.2, 0.5));
        nested.place(cuboid("beside", boundary, low, high));
        nested.cameras = vec![camera_down(0.85, 5.0)];
        let alone = lit_box(medium(2.0, 0.8, Phase::Isotropic));
        for scene in [&alone, &nested] {
            // As of beams in one box (`volume.rs`).
            let counts = expect_agreement(gpu, scene, &sharing("bounces=2..4"), [24, 1024], [1.5e-2; 3]);
            assert!(counts.beams.photons > 300);
        }
        // Without what beams blur, and with planes of a share of ways.
        let of_a_share = PhotonSettings {
            volume_radius: 0.0,
            ..sharing(OF_PLANES)
        };
        expect_agreement(gpu, &alone, &of_a_share, [24, 1024], [0.0; 3]);
    });
}

fn fog() -> Medium {
    medium(2.0, 0.8, Phase::HenyeyGreenstein { g: 0.4 })
}

#[test]
fn light_without_a_place_is_shared_with_planes() {
    with_gpu(|gpu| {
        let glow = Medium {
            emission: Vec3::new(2.0, 1.0, 0.5),
            ..fog()
        };
        for scene in [under_a_sky(fog()), lit_box(glow)] {
            expect_agreement(gpu, &scene, &sharing(OF_PLANES), [24, 1024], [0.0; 3]);
        }
    });
}

/// Some of it no eye path may have.
#[test]
fn light_off_mirrors_is_shared_with_planes() {
    with_gpu(|gpu| {
        for scene in [behind_a_pane(fog()), builtin("builtin:fog-box?sphere=glass&sigma_s=3")] {
            expect_agreement(gpu, &scene, &sharing(OF_PLANES), [24, 1024], [0.0; 3]);
        }
    });
}

#[test]
fn direct_light_is_shared_with_planes() {
    with_gpu(|gpu| {
        expect_agreement(gpu, &lit_box(fog()), &sharing("LVVE"), [24, 1024], [0.0; 3]);
        let with_direct_light = PhotonSettings {
            direct_photons: true,
            ..sharing("bounces=1..3")
        };
        // As of beams in one box (`volume.rs`).
        expect_agreement(gpu, &lit_box(fog()), &with_direct_light, [24, 1024], [1.5e-2; 3]);
    });
}

/// A ray along the first flight of a plane lies in it, wherever the second one goes.
#[test]
fn eye_paths_have_parallel_light_along_parallel_rays() {
    with_gpu(|gpu| {
        let mut scene = lit_box(medium(2.0, 0.8, Phase::Isotropic));
        scene.lights.clear();
        let (direction, irradiance) = (Vec3::NEG_Y, Vec3::splat(3.0));
        scene.add_light("sun", LightKind::Directional { direction, irradiance });
        expect_agreement(gpu, &scene, &sharing("LVVE"), [24, 512], [0.0; 3]);
    });
}

#[test]
fn shares_of_planes_have_the_same_bits_however_it_is_done() {
    with_gpu(|gpu| expect_same_bits_however_it_is_done(gpu, &lit_box(coloured()), sharing("all")));
}
