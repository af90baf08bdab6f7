//! How wide kernels in media are: what a pilot chooses, each medium's own, and those by neighbours.

use super::volume::{AIRLIGHT, airlight, all_events, endless, lit_box, single, uneven};
use super::*;
use clerestory::Error;
use clerestory::accel::sphere::closest_approach;
use clerestory::scene::{Phase, Projection};
use clerestory::techniques::photon_mapping::kernel::kernel_profile;
use clerestory::techniques::photon_mapping::volume::event::PhotonEvent;
use clerestory::techniques::photon_mapping::volume::{VolumeEstimate, VolumeKernel};
use clerestory::transport::phase::phase_function;
use clerestory_hard_cases::scenes::orthographic;
use clerestory_tests::render::{builtin, cuboid, medium};
use clerestory_tests::with_gpu;
use glam::{DAffine3, DVec3};

const ESTIMATES: [VolumeEstimate; 5] = [
    VolumeEstimate::Ray,
    VolumeEstimate::March,
    VolumeEstimate::Beams,
    VolumeEstimate::Planes,
    VolumeEstimate::Unified,
];

fn automatic(volume: VolumeEstimate, photons: u32) -> PhotonSettings {
    PhotonSettings {
        volume,
        photons,
        ..settings("all")
    }
}

/// Kernels that a way through media meets in the first pass.
fn met(gpu: &Gpu, scene: &Scene, settings: &PhotonSettings) -> f64 {
    let mut mapper = mapper(gpu, scene, settings);
    advance(&mut mapper, 1);
    let beams = mapper.counts().beams;
    beams.photons as f64 / beams.queries as f64
}

#[test]
fn rays_meet_some_tens_of_kernels() {
    with_gpu(|gpu| {
        for volume in ESTIMATES {
            // A fiftieth of the walls' diagonal, or a quarter of the free path, has rays meet thousands of them.
            let scene = builtin("builtin:point-in-fog");
            let found = met(gpu, &scene, &automatic(volume, 1 << 14));
            println!("{volume:?}: {found:.1} kernels a ray");
            assert!((32.0..128.0).contains(&found), "{volume:?}: {found}");
        }
        // In a grid about the light, and where more photons are asked for than the pilot has.
        let mut scene = lit_box(uneven(medium(2.0, 0.9, Phase::Isotropic)));
        scene.lights.clear();
        add_point(&mut scene, Vec3::new(0.1, 0.05, 0.0), Vec3::ONE);
        let found = met(gpu, &scene, &automatic(VolumeEstimate::Ray, 1 << 16));
        println!("grid: {found:.1} kernels a ray");
        assert!((32.0..128.0).contains(&found), "grid: {found}");
    });
}

#[test]
fn radii_are_the_same_for_every_seed_and_grow_beyond_no_bound() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:point-in-fog");
        let of = |seed, photons| {
            let settings = PhotonSettings {
                seed,
                ..automatic(VolumeEstimate::Ray, photons)
            };
            mapper(gpu, &scene, &settings).event_radius(0)
        };
        let radius = of(1, 1 << 12);
        assert_eq!(radius, of(2, 1 << 12));
        // Few photons leave a quarter of a free path, 10 m.
        assert!((of(1, 1) - 2.5).abs() < 1e-6 && radius < 2.5);
        // Another beginning is that of another mapper.
        let settings = automatic(VolumeEstimate::Ray, 1 << 12);
        let mut moved = mapper(gpu, &scene, &settings);
        let mut camera = scene.cameras[0].clone();
        camera.transform.translation *= 0.1;
        moved.set_camera(&camera).unwrap_or_else(|error| panic!("{error}"));
        let mut near = scene.clone();
        near.cameras[0] = camera;
        let fresh = mapper(gpu, &near, &settings).event_radius(0);
        assert_eq!(moved.event_radius(0), fresh);
        assert_ne!(fresh, radius);
    });
}

/// A scene with its media, lights and camera, all lengths multiplied.
fn scaled(scene: &Scene, by: f64) -> Scene {
    let mut scene = scene.clone();
    clerestory_hard_cases::scenes::transform(&mut scene, DAffine3::from_scale(DVec3::splat(by)));
    for camera in &mut scene.cameras {
        if let Projection::Orthographic { half_height } = &mut camera.projection {
            *half_height *= by as f32;
        }
    }
    for light in &mut scene.lights {
        if let LightKind::Point { position, intensity } = &mut light.kind {
            *position *= by as f32;
            *intensity *= (by * by) as f32;
        }
    }
    for medium in &mut scene.media {
        medium.sigma_s /= by as f32;
        medium.sigma_a /= by as f32;
        if let Some(grid) = &mut medium.density {
            grid.to_world = DAffine3::from_scale(DVec3::splat(by)) * grid.to_world;
        }
    }
    scene
}

#[test]
fn radii_scale_with_the_scene() {
    with_gpu(|gpu| {
        let grid = lit_box(uneven(medium(6.0, 0.9, Phase::Isotropic)));
        // Without a surface there is no length but that of the free path.
        let open = builtin("builtin:point-in-fog?wall=none");
        for (scene, volume, kernel) in [
            (&grid, VolumeEstimate::Ray, VolumeKernel::Fixed),
            (&open, VolumeEstimate::Ray, VolumeKernel::Fixed),
            (&open, VolumeEstimate::Beams, VolumeKernel::Fixed),
            (&open, VolumeEstimate::Unified, VolumeKernel::Fixed),
            (&open, VolumeEstimate::March, VolumeKernel::Footprint),
            (&open, VolumeEstimate::Ray, VolumeKernel::Neighbor),
        ] {
            let settings = PhotonSettings {
                volume_kernel: kernel,
                ..automatic(volume, 1 << 12)
            };
            expect_same_at_every_scale(gpu, scene, &settings);
        }
    });
}

/// Of planes, with a radius that scales: all ways have planes. These have rims without a kernel's slope, which a ray meets or misses by rounding: with so few there is next to none.
#[test]
fn planes_scale_with_the_scene() {
    with_gpu(|gpu| {
        let settings = PhotonSettings {
            volume_radius: 1.0,
            ..automatic(VolumeEstimate::Planes, 1 << 8)
        };
        expect_same_at_every_scale(gpu, &builtin("builtin:point-in-fog?wall=none"), &settings);
    });
}

/// Fails unless lengths of a thousandth and a thousandfold, with a radius of the settings' own, change kernels, means and pixels by rounding alone.
fn expect_same_at_every_scale(gpu: &Gpu, scene: &Scene, settings: &PhotonSettings) {
    let of = |by: f64| {
        let settings = PhotonSettings {
            volume_radius: settings.volume_radius * by as f32,
            ..settings.clone()
        };
        let mut mapper = mapper(gpu, &scaled(scene, by), &settings);
        (mapper.event_radius(0) / by, advance(&mut mapper, 1))
    };
    let (radius, truth) = of(1.0);
    let whole = sums(&truth)[0];
    assert!(whole.iter().all(|sum| *sum > 0.0), "{whole:?}");
    for by in [1e-3, 1e3] {
        let (found_radius, found) = of(by);
        let sum = sums(&found)[0];
        let (mut square, mut power) = (0.0, 0.0);
        for (a, b) in truth.iter().zip(&found) {
            square += f64::from(a - b).powi(2);
            power += f64::from(*a).powi(2);
        }
        let error = (square / power).sqrt();
        let what = format!(
            "{}, {:?}, {:?}, times {by}",
            scene.name, settings.volume, settings.volume_kernel
        );
        println!("{what}: {found_radius}, {radius}; root mean square {error:.1e}, {sum:?}, {whole:?}");
        assert!(
            (found_radius / radius - 1.0).abs() < 1e-4,
            "{what}: {found_radius} {radius}"
        );
        assert!(error < 1e-4, "{what}: {error}");
        for c in 0..3 {
            assert!((sum[c] / whole[c] - 1.0).abs() < 1e-4, "{what}: {sum:?} {whole:?}");
        }
    }
}

/// Fog with a light in front of a closed black box without thickness, and fog within it: both are bodies with nothing in between. Rays go along the lit wall, just inside of the box.
fn behind_a_wall(inside: u32) -> Scene {
    const THIN: f32 = 1e-3;
    let mut scene = Scene {
        name: format!("medium {inside} behind a wall"),
        ..Scene::default()
    };
    let black = scene.add_material(Material::lambert("black", Vec3::ZERO));
    scene.place(cuboid(
        "box",
        black,
        Vec3::new(0.0, -1.0, -1.0),
        Vec3::new(2.0, 1.0, 1.0),
    ));
    scene.media = vec![medium(2.0, 0.9, Phase::Isotropic); 2];
    let corners = [
        (0, Vec3::new(-1.0, -1.5, -1.5), Vec3::new(-THIN, 1.5, 1.5)),
        (
            inside,
            Vec3::new(THIN, THIN - 1.0, THIN - 1.0),
            Vec3::new(2.0 - THIN, 1.0 - THIN, 1.0 - THIN),
        ),
    ];
    for (interior, lower, upper) in corners {
        let boundary = scene.add_material(Material {
            name: format!("boundary about {interior}"),
            boundary: true,
            interior: Some(interior),
            ..Material::default()
        });
        scene.place(cuboid("fog", boundary, lower, upper));
    }
    let end = |y: f64| DVec3::new(5e-3, y, 0.0);
    scene.cameras = vec![orthographic(end(-0.9), end(0.9), DVec3::X, 3e-3)];
    add_point(&mut scene, Vec3::new(-0.3, 0.0, 0.0), Vec3::splat(20.0));
    scene
}

#[test]
fn kernels_stay_in_their_medium() {
    with_gpu(|gpu| {
        for volume in ESTIMATES {
            let seen = |inside: u32| {
                let settings = PhotonSettings {
                    volume_radius: 0.1,
                    direct_photons: true,
                    ..automatic(volume, 1 << 12)
                };
                photons(gpu, &behind_a_wall(inside), &settings, 1)
            };
            // In a medium of its own no kernel reaches through the wall; in the same one they do, which is the bias that is stated.
            let lit = |picture: &[f32]| picture.iter().filter(|value| **value != 0.0).count();
            assert_eq!(lit(&seen(1)), 0, "{volume:?}");
            assert!(lit(&seen(0)) > 0, "{volume:?}: nothing would reach through");
        }
    });
}

#[test]
fn dense_bodies_elsewhere_leave_kernels_as_they_are() {
    with_gpu(|gpu| {
        let fog = lit_box(medium(2.0, 0.8, Phase::Isotropic));
        let mut both = fog.clone();
        both.media.push(medium(1e3, 0.8, Phase::Isotropic));
        let boundary = both.add_material(Material {
            name: "boundary of what is dense".into(),
            boundary: true,
            interior: Some(1),
            ..Material::default()
        });
        // On the floor below the light, away from what is seen.
        let (low, high) = (Vec3::new(0.8, -0.55, 0.2), Vec3::new(1.2, -0.3, 0.6));
        both.place(cuboid("dense", boundary, low, high));
        let radii = |scene: &Scene, medium: u32| -> Vec<f32> {
            let settings = PhotonSettings {
                photons: 512,
                ..automatic(VolumeEstimate::Ray, 512)
            };
            let (events, _) = all_events(gpu, scene, &settings, 0);
            let of_medium = events.iter().filter(|e| e.event.medium == medium);
            of_medium.map(|e| e.event.radius).collect()
        };
        let (alone, beside, dense) = (radii(&fog, 0), radii(&both, 0), radii(&both, 1));
        assert!(!alone.is_empty() && !beside.is_empty() && !dense.is_empty());
        assert!(
            alone.iter().chain(&beside).all(|radius| *radius == alone[0]),
            "{} {}",
            alone[0],
            beside[0]
        );
        // A quarter of a free path there.
        assert!(
            dense.iter().all(|radius| (radius / 0.25e-3 - 1.0).abs() < 1e-4),
            "{}",
            dense[0]
        );
    });
}

#[test]
fn beams_have_no_kernels_of_their_own() {
    with_gpu(|gpu| {
        for volume_kernel in [VolumeKernel::Footprint, VolumeKernel::Neighbor] {
            let settings = PhotonSettings {
                volume_kernel,
                ..automatic(VolumeEstimate::Beams, 1)
            };
            let scene = lit_box(medium(1.0, 0.5, Phase::Isotropic));
            match PhotonMapper::new(gpu, upload(gpu, &scene), &scene.cameras[0], SIZE, settings) {
                Err(Error::Setting { name, .. }) => assert_eq!(name, "volume_kernel"),
                Err(other) => panic!("{other}"),
                Ok(_) => panic!("{volume_kernel:?} was accepted"),
            }
        }
    });
}

#[test]
fn kernels_by_neighbours_hold_so_many() {
    with_gpu(|gpu| {
        let scene = endless(medium(1.0, 0.5, Phase::Isotropic));
        let settings = PhotonSettings {
            volume_kernel: VolumeKernel::Neighbor,
            volume_radius: 1e3,
            direct_photons: true,
            reduction: 2.0 / 3.0,
            ..automatic(VolumeEstimate::Ray, 1 << 10)
        };
        let (events, _) = all_events(gpu, &scene, &settings, 0);
        assert!(settings.volume_neighbors == 85 && events.len() > 1500);
        for neighbors in [85, 117, 1] {
            let settings = PhotonSettings {
                volume_neighbors: neighbors,
                ..settings.clone()
            };
            let (events, _) = all_events(gpu, &scene, &settings, 0);
            for event in events.iter().step_by(31).map(|e| e.event) {
                let others = events
                    .iter()
                    .filter(|other| other.event.position.distance(event.position) < event.radius);
                // Itself, and all before the last one, which lies on the rim.
                let inside = others.count();
                assert!(inside.abs_diff(neighbors as usize) <= 1, "{neighbors}: {inside}");
            }
        }
        // A later pass has other photons and narrower kernels.
        let (later, _) = all_events(gpu, &scene, &settings, 9);
        let mean = |events: &[clerestory::techniques::photon_mapping::MappedEvent]| {
            events.iter().map(|e| f64::from(e.event.radius).ln()).sum::<f64>() / events.len() as f64
        };
        let kept: f64 = (1..=9)
            .map(|i| (f64::from(i) + 2.0 / 3.0) / (f64::from(i) + 1.0))
            .product();
        let ratio = (mean(&later) - mean(&events)).exp();
        assert!((ratio / kept.sqrt() - 1.0).abs() < 0.05, "{ratio} {}", kept.sqrt());
    });
}

/// What the ray of [`airlight`] sees of collisions by phase functions of these eccentricities, and what a device sees.
fn seen_and_found(gpu: &Gpu, scene: &Scene, settings: &PhotonSettings, ks: [f32; 2]) -> ([f64; 2], f64) {
    let (events, _) = all_events(gpu, scene, settings, 0);
    // Coefficients of 0.1 and 0.05, a wall 4 m away.
    let of_event = |e: PhotonEvent, k: f32| {
        let near = closest_approach(DVec3::ZERO, DVec3::Z, e.position.as_dvec3());
        let h = f64::from(e.radius);
        let direction = e.direction.as_dvec3().normalize();
        let phase = phase_function(Phase::Schlick { k }, direction, DVec3::NEG_Z);
        let weight = kernel_profile(KernelProfile::Epanechnikov, near.distance_squared / (h * h)) / (h * h);
        if near.t > 0.0 && near.t < 4.0 {
            weight * (-0.15 * near.t).exp() * phase * f64::from(e.flux.x)
        } else {
            0.0
        }
    };
    let seen: [f64; 2] = ks.map(|k| events.iter().map(|e| of_event(e.event, k)).sum());
    (seen, sums(&photons(gpu, scene, settings, 1))[0][0] / pixels(0))
}

#[test]
fn rays_see_the_kernels_that_events_have() {
    with_gpu(|gpu| {
        for volume_kernel in [VolumeKernel::Fixed, VolumeKernel::Footprint, VolumeKernel::Neighbor] {
            let settings = PhotonSettings {
                volume_kernel,
                photons: 1 << 11,
                ..single(VolumeEstimate::Ray, 0.6)
            };
            let ([seen, _], found) = seen_and_found(gpu, &airlight(0.5, 2.0, 1.0), &settings, [0.5; 2]);
            println!("{volume_kernel:?}: {found:.6}, by its events {seen:.6}");
            assert!(
                seen > 5e-3 && (found / seen - 1.0).abs() < 1e-4,
                "{volume_kernel:?}: {found} {seen}"
            );
        }
    });
}

#[test]
fn no_phase_function_is_mirrored() {
    with_gpu(|gpu| {
        for (k, z, _) in AIRLIGHT {
            let scene = airlight(k, z, 1.0);
            let ([seen, mirrored], found) = seen_and_found(gpu, &scene, &single(VolumeEstimate::Ray, 0.6), [k, -k]);
            println!(
                "{}: {found:.6}, by its events {seen:.6}, mirrored {mirrored:.6}",
                scene.name
            );
            assert!((found / seen - 1.0).abs() < 1e-4, "{}: {found} {seen}", scene.name);
            // Of the same collisions, so that their noise is in both.
            assert!(
                k == 0.0 || (mirrored / seen - 1.0).abs() > 0.05,
                "{}: {mirrored} {seen}",
                scene.name
            );
        }
    });
}

#[test]
fn the_pilot_leaves_the_airlight_as_it_is() {
    with_gpu(|gpu| {
        let scene = airlight(0.0, 2.0, 1.0);
        let settings = PhotonSettings {
            direct_photons: true,
            photons: 1 << 15,
            ..settings("bounces=1..1")
        };
        let expected = Mean {
            value: 0.0108397,
            variance: 0.0,
        };
        means(gpu, &scene, &settings, 8).expect("airlight", 0, 0, expected, 1e-2);
    });
}
