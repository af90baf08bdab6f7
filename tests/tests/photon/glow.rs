//! Photons of media that emit: their power, media as warm as the walls around them, and the path tracer on equal path sets.

use super::volume::{direct, lit_box, uneven};
use super::volume_truths::{exactly, parallel};
use super::*;
use clerestory::scene::{Medium, Phase};
use clerestory::techniques::photon_mapping::volume::VolumeEstimate;
use clerestory_tests::render::{builtin, cuboid, medium};
use clerestory_tests::statistics::expect_mean_of;
use clerestory_tests::with_gpu;
use glam::DVec3;

/// Puts a cube of half a side into a scene, behind an invisible boundary, with a medium inside.
fn fill(scene: &mut Scene, name: &str, centre: Vec3, half: f32, medium: Medium) {
    let interior = Some(scene.media.len() as u32);
    scene.media.push(medium);
    let boundary = scene.add_material(Material {
        name: format!("boundary of {name}"),
        boundary: true,
        interior,
        ..Material::default()
    });
    scene.place(cuboid(name, boundary, centre - half, centre + half));
}

/// A medium that emits and does nothing else.
fn glow(emission: Vec3) -> Medium {
    Medium {
        emission,
        ..medium(0.0, 0.0, Phase::Isotropic)
    }
}

#[test]
fn photons_of_media_carry_what_these_emit() {
    with_gpu(|gpu| {
        let emission = Vec3::new(1.0, 2.0, 3.0);
        let room = || builtin("builtin:furnace-box?rho=0.5&emission=0");
        let mut whole = room();
        fill(&mut whole, "glow", Vec3::ZERO, 0.5, glow(emission));
        // A cube of an eighth of it that holds nothing, and one beside it that does, too.
        let mut parts = whole.clone();
        fill(&mut parts, "hole", Vec3::new(0.1, 0.0, -0.2), 0.25, Medium::default());
        fill(&mut parts, "other", Vec3::new(0.7, -0.7, 0.7), 0.2, glow(emission));
        let mut grid = room();
        let uneven = uneven(glow(emission));
        let mean = uneven.density.as_ref().map_or(0.0, |grid| grid.mean());
        fill(&mut grid, "glow", Vec3::ZERO, 0.5, uneven);
        // The grid alone bounds it in a medium outside all bodies, of which the walls lie outside.
        let mut endless = grid.clone();
        endless.surrounding = Some(0);
        endless.instances.pop();
        for (what, scene, volume) in [
            ("whole", whole, 1.0),
            ("parts", parts, 1.0 - 0.125 + 0.064),
            ("grid", grid, mean),
            ("endless", endless, mean),
        ] {
            let settings = direct(1 << 13);
            let mut mapper = mapper(gpu, &scene, &settings);
            let passes: Vec<[f64; 3]> = (0..6)
                .map(|pass| {
                    let photons = mapper.photons(pass).unwrap_or_else(|error| panic!("{error}"));
                    let landed = photons.iter().filter(|photon| photon.bounce == 0);
                    landed.fold([0.0; 3], |sum, photon| {
                        std::array::from_fn(|band| sum[band] + f64::from(photon.record.flux[band]))
                    })
                })
                .collect();
            let c = mapper.counts().photons;
            assert_eq!((c.emitted, c.escaped + c.absorbed), (6 << 13, 6 << 13), "{what}: {c:?}");
            for band in 0..3 {
                let values: Vec<f64> = passes.iter().map(|sums| sums[band]).collect();
                let expected = 4.0 * PI * volume * f64::from(emission[band]);
                // All may have one flux, which records round to nine bits after dithering.
                expect_mean_of(&format!("{what}, band {band}"), &values, expected, 0.0, 1e-4 * expected);
            }
        }
    });
}

#[test]
fn furnaces_stay_even_with_media_as_warm_as_their_walls() {
    with_gpu(|gpu| {
        // Walls of a room of 2 m that emit 1 and reflect a half have radiance 2, and so has a medium that emits twice what it absorbs, whatever it scatters.
        let warm = |sigma_a: Vec3| Medium {
            sigma_a,
            sigma_s: Vec3::splat(0.7),
            emission: sigma_a * 2.0,
            ..Medium::default()
        };
        let even = warm(Vec3::splat(0.8));
        let coloured = warm(Vec3::new(0.4, 0.8, 1.6));
        let beside = [VolumeEstimate::Ray, VolumeEstimate::Beams];
        for (what, medium, estimates) in [
            ("even", even.clone(), &beside[..]),
            ("coloured", coloured, &beside[..1]),
            ("grid", uneven(even), &beside[..1]),
        ] {
            let mut room = builtin("builtin:furnace-box?rho=0.5&emission=1");
            fill(&mut room, "warm", Vec3::ZERO, 0.5, medium);
            room.cameras = vec![parallel(DVec3::Z * 0.9, DVec3::NEG_Z, 0.3)];
            for &volume in estimates {
                // Kernels that rays meet lie within the medium and the wall. Density changes over them in the grid.
                let bias = if what == "grid" { 8e-3 } else { 4e-3 };
                let settings = PhotonSettings {
                    volume,
                    volume_radius: 0.05,
                    radius: 0.2,
                    photons: 1 << 12,
                    ..settings("all")
                };
                let found = means(gpu, &room, &settings, 8);
                for channel in 0..3 {
                    found.expect(&format!("{what}, {volume:?}"), 0, channel, exactly(2.0), bias);
                }
            }
        }
    });
}

#[test]
fn media_that_emit_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        let glowing = Medium {
            emission: Vec3::new(3.0, 1.5, 0.5),
            ..medium(2.0, 0.8, Phase::HenyeyGreenstein { g: 0.5 })
        };
        // Without a light, and with another medium inside; and a grid beside a light.
        let mut nested = lit_box(glowing.clone());
        nested.lights.clear();
        let inner = medium(6.0, 0.9, Phase::Isotropic);
        fill(&mut nested, "inner", Vec3::new(0.1, 0.1, -0.1), 0.2, inner);
        let grid = lit_box(uneven(glowing));
        for scene in [nested, grid] {
            let settings = PhotonSettings {
                volume_radius: 0.02,
                radius: 0.1,
                photons: 1 << 13,
                ..settings("bounces=1..3")
            };
            // As without emission: events lack beyond the boundaries that rays cross, and density within a kernel is that of its middle.
            let counts = expect_agreement(gpu, &scene, &settings, [12, 1024], [2e-2; 3]);
            assert!(counts.beams.photons > 1000 && counts.gather.photons > 1000);
        }
    });
}
