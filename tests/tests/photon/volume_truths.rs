//! Closed forms and exact solutions for photons in media, by every estimate: slabs, a point source in an endless medium, furnaces.
//!
//! Values for isotropic scattering are those of the path tracer's tests (`tests/tests/media`): integral equations of slabs and of point sources.

use super::volume::{direct, endless};
use super::*;
use clerestory::scene::{Camera, Medium, Phase, Projection};
use clerestory::techniques::photon_mapping::volume::VolumeEstimate;
use clerestory_tests::render::{builtin, cuboid, medium};
use clerestory_tests::statistics::expect_mean_of;
use clerestory_tests::with_gpu;
use glam::DVec3;

pub(super) const ESTIMATES: [VolumeEstimate; 5] = [
    VolumeEstimate::Ray,
    VolumeEstimate::March,
    VolumeEstimate::Beams,
    VolumeEstimate::Planes,
    VolumeEstimate::Unified,
];

/// Parallel rays from `eye` along `forward`, over a square of `half_height` to either side.
pub(super) fn parallel(eye: DVec3, forward: DVec3, half_height: f32) -> Camera {
    let mut camera = Camera::look_at("rays", eye, eye + forward, forward.any_orthonormal_vector(), 1.0);
    camera.projection = Projection::Orthographic { half_height };
    camera
}

pub(super) fn exactly(value: f64) -> Mean {
    Mean { value, variance: 0.0 }
}

/// A slab of optical depth 1 and albedo 0.9 under a beam of irradiance 1 from above. What leaves by its sides is below 10⁻³ where it is seen.
pub(super) fn slab() -> Scene {
    const HALF: f32 = 8.0;
    let mut scene = Scene {
        name: "slab".into(),
        ..Scene::default()
    };
    scene.media.push(medium(1.0, 0.9, Phase::Isotropic));
    let boundary = scene.add_material(Material {
        name: "boundary".into(),
        boundary: true,
        interior: Some(0),
        ..Material::default()
    });
    let (low, high) = (Vec3::new(-HALF, 0.0, -HALF), Vec3::new(HALF, 1.0, HALF));
    scene.place(cuboid("slab", boundary, low, high));
    let (direction, irradiance) = (Vec3::NEG_Y, Vec3::ONE);
    scene.add_light("beam", LightKind::Directional { direction, irradiance });
    scene
}

/// Its faces, where from and in which direction they are seen, and the radiance there.
pub(super) const SLAB_FACES: [(&str, DVec3, f64, f64); 2] =
    [("lit", DVec3::NEG_Y, 2.0, 0.066845), ("far", DVec3::Y, -1.0, 0.060563)];

#[test]
fn slabs_have_the_radiance_of_the_tables() {
    with_gpu(|gpu| {
        let mut scene = slab();
        for (face, forward, height, expected) in SLAB_FACES {
            scene.cameras = vec![parallel(DVec3::new(0.0, height, 0.0), forward, 2.0)];
            for volume in ESTIMATES {
                if volume == VolumeEstimate::Planes {
                    // The beam and the rays have one direction, along which planes that begin by it have no width.
                    continue;
                }
                // Light is even across the rays, along which disks and beams have no width. Balls have one, and lack events beyond the faces.
                let (volume_radius, bias) = match volume {
                    VolumeEstimate::March => (0.08, 2.5e-2),
                    _ => (0.4, 2e-3),
                };
                let settings = PhotonSettings {
                    volume,
                    volume_radius,
                    photons: 1 << 14,
                    ..settings("all")
                };
                let what = format!("{face} face, {volume:?}");
                means(gpu, &scene, &settings, 8).expect(&what, 0, 0, exactly(expected), bias);
            }
        }
    });
}

#[test]
fn rays_past_a_source_have_the_exact_multiple_scattering() {
    with_gpu(|gpu| {
        // Passes are many and small: Student's t of few has long tails, by which faults would pass.
        for (albedo, h, photons, expected) in [(0.5, 0.5, 1 << 10, 4.22674e-4), (0.9, 1.0, 1 << 9, 2.27478e-3)] {
            let mut scene = endless(medium(1.0, albedo, Phase::Isotropic));
            scene.cameras = vec![parallel(DVec3::new(-3.0, h, 0.0), DVec3::X, 1e-6)];
            for volume in ESTIMATES {
                if volume == VolumeEstimate::Planes {
                    // Without blur: `planes.rs`.
                    continue;
                }
                let settings = PhotonSettings {
                    volume,
                    volume_radius: 0.15,
                    photons,
                    ..settings("bounces=2..")
                };
                // Scattered light changes by the distance from the source, which blur evens out by its square.
                let what = format!("albedo {albedo}, {h} m away, {volume:?}");
                means(gpu, &scene, &settings, 16).expect(&what, 0, 0, exactly(expected), 2e-2);
            }
        }
    });
}

#[test]
fn collisions_about_a_source_are_those_of_the_exact_fluence() {
    with_gpu(|gpu| {
        for (albedo, r, collided) in [
            (0.2f32, 0.5f64, 3.25382e-2),
            (0.5, 1.0, 2.94202e-2),
            (0.9, 2.0, 3.44340e-2),
        ] {
            let scene = endless(medium(1.0, albedo, Phase::Isotropic));
            let mut mapper = mapper(gpu, &scene, &direct(1 << 11));
            // What collides in a shell scatters its albedo: 4π r² φ of it a metre, which is nearly straight over a tenth of the radius.
            let whole = 4.0 * PI * r * r * (collided + (-r).exp() / (4.0 * PI * r * r));
            let passes: Vec<f64> = (0..12)
                .map(|pass| {
                    let events = mapper.events(pass).unwrap_or_else(|error| panic!("{error}"));
                    let within = |distance: f64| (distance / r - 1.0).abs() < 0.1;
                    let events = events.iter().map(|e| e.event);
                    let in_shell = events.filter(|e| within(e.position.as_dvec3().length()));
                    in_shell.map(|e| f64::from(e.flux.x)).sum::<f64>() / (0.2 * r * f64::from(albedo))
                })
                .collect();
            expect_mean_of(
                &format!("albedo {albedo}, {r} m away"),
                &passes,
                whole,
                0.0,
                5e-3 * whole,
            );
        }
    });
}

#[test]
fn furnaces_stay_even_with_lossless_media_inside() {
    with_gpu(|gpu| {
        // Walls of a room of 2 m that emit 1 and reflect a half have radiance 2 with whatever is between them, if it loses nothing.
        let mut room = builtin("builtin:furnace-box?rho=0.5&emission=1");
        room.cameras = vec![parallel(DVec3::Z * 0.9, DVec3::NEG_Z, 0.5)];
        room.surrounding = Some(0);
        let forward = medium(1.0, 1.0, Phase::HenyeyGreenstein { g: 0.5 });
        let coloured = Medium {
            sigma_s: Vec3::new(0.4, 0.8, 1.6),
            ..Medium::default()
        };
        for (what, medium, estimates) in [
            ("forward", forward, &ESTIMATES[..]),
            ("coloured", coloured, &ESTIMATES[..1]),
        ] {
            room.media = vec![medium];
            for &volume in estimates {
                // No kernel of disks or beams reaches a wall but the one across the rays; balls do, at both ends.
                let bias = if volume == VolumeEstimate::March { 2e-2 } else { 4e-3 };
                let settings = PhotonSettings {
                    volume,
                    volume_radius: 0.1,
                    radius: 0.2,
                    photons: 1 << 9,
                    ..settings("all")
                };
                let found = means(gpu, &room, &settings, 12);
                for channel in 0..3 {
                    found.expect(&format!("{what}, {volume:?}"), 0, channel, exactly(2.0), bias);
                }
            }
        }
    });
}

#[test]
fn media_scatter_what_they_take_in_furnaces() {
    with_gpu(|gpu| {
        let mut room = builtin("builtin:furnace-box?rho=0.5&emission=1");
        // The far wall is 1.9 mean free paths away.
        room.cameras = vec![parallel(DVec3::Z * 0.9, DVec3::NEG_Z, 0.5)];
        room.surrounding = Some(0);
        room.media = vec![medium(1.0, 1.0, Phase::HenyeyGreenstein { g: 0.5 })];
        let passed = f64::exp(-1.9);
        for volume in [VolumeEstimate::Ray, VolumeEstimate::March, VolumeEstimate::Beams] {
            // As in the whole, of which each is a part: balls lack events behind walls.
            let bias = if volume == VolumeEstimate::March { 2.5e-2 } else { 5e-3 };
            for (set, expected, bias) in [
                ("L.*VE", 2.0 * (1.0 - passed), bias),
                ("LE|L.*[^V]E", 2.0 * passed, 1e-2),
            ] {
                let settings = PhotonSettings {
                    volume,
                    volume_radius: 0.1,
                    radius: 0.2,
                    photons: 1 << 9,
                    ..settings(set)
                };
                let found = means(gpu, &room, &settings, 12);
                for channel in 0..3 {
                    found.expect(&format!("{set}, {volume:?}"), 0, channel, exactly(expected), bias);
                }
            }
        }
    });
}
