//! Conversions between maps: what they keep, how wrong they are, and which way up files are.

use super::super::resample::{Reconstruction, ResampleSettings, resample, resample_watched};
use super::super::*;
use super::directions;
use crate::test_random::Random;
use glam::{DMat3, Vec3};

fn size(map: Parametrization, rows: u32) -> UVec2 {
    UVec2::new(rows * map.aspect(), rows)
}

/// Random texels over three decades.
fn noise(map: Parametrization, rows: u32) -> MapImage {
    let size = size(map, rows);
    let mut random = Random(3);
    let count = size.element_product() * map.layers();
    let texels = (0..count).map(|_| Vec3::new(random.unit(), random.unit().powi(2), 1e3f32.powf(random.unit())));
    MapImage::new(map, size, texels.collect()).unwrap()
}

fn relative(after: DVec3, before: DVec3) -> f64 {
    ((after - before) / before).abs().max_element()
}

#[test]
fn constant_radiance_stays_constant_in_every_map() {
    let value = Vec3::new(0.1, 2.0, 3e4);
    for from in Parametrization::ALL {
        if from == Parametrization::Nusselt {
            continue;
        }
        let source = MapImage::from_fn(from, size(from, 6), |_| value.as_dvec3()).unwrap();
        for to in Parametrization::ALL {
            for reconstruction in [Reconstruction::Box, Reconstruction::Bilinear] {
                let settings = ResampleSettings {
                    samples: 3,
                    reconstruction,
                };
                let turn = from.world_axes() * to.world_axes().transpose();
                let image = resample(&source, to, size(to, 8), turn, &settings).unwrap();
                for texel in to.texels(size(to, 8)) {
                    let held = image.at(texel);
                    if to.texel_solid_angle(size(to, 8), texel) == 0.0 {
                        assert_eq!(held, Vec3::ZERO, "{from} to {to}, {texel:?}");
                    } else {
                        // One rounding to f32, after sums of f64.
                        let off = ((held - value) / value).abs().max_element();
                        assert!(off <= f32::EPSILON, "{from} to {to}, {texel:?}: {held}");
                    }
                }
            }
        }
    }
}

/// Halving a map onto itself is the mean of its children by solid angle: rectangles lie edge to edge, and what is left is that of their
/// weights, the density at the middle in place of the exact integral.
#[test]
fn halves_of_a_map_are_means_of_its_texels() {
    for map in [
        Parametrization::LatLong,
        Parametrization::Cube,
        Parametrization::OctahedronQuadratic,
        Parametrization::OctahedronRectangular,
        Parametrization::EqualArea,
    ] {
        let (fine, coarse) = (noise(map, 32), size(map, 16));
        let image = resample(&fine, map, coarse, DMat3::IDENTITY, &ResampleSettings::default()).unwrap();
        for texel in map.texels(coarse) {
            let taps = map.children(fine.size(), texel);
            let mean: DVec3 = taps.iter().map(|tap| tap.weight * fine.at(tap.texel).as_dvec3()).sum();
            let off = relative(image.at(texel).as_dvec3(), mean);
            assert!(off < 2e-3, "{map} {texel:?}: {off}");
        }
        assert!(relative(image.integral(), fine.integral()) < 1e-4, "{map}");
    }
}

/// The integral over the sphere against that of the source: noise of texels, the hardest there is, and no smoother light.
#[test]
fn conversions_keep_the_integral() {
    let maps = [
        Parametrization::LatLong,
        Parametrization::Cube,
        Parametrization::DualParaboloid,
        Parametrization::OctahedronQuadratic,
        Parametrization::OctahedronRectangular,
        Parametrization::EqualArea,
    ];
    for from in maps {
        let source = noise(from, 24);
        for to in maps.into_iter().filter(|to| *to != from) {
            let turn = from.world_axes() * to.world_axes().transpose();
            let off = |samples: u32| {
                let settings = ResampleSettings {
                    samples,
                    ..ResampleSettings::default()
                };
                let image = resample(&source, to, size(to, 20), turn, &settings).unwrap();
                relative(image.integral(), source.integral())
            };
            // A texel is off by up to 2.5/s of its range and N texels are off independently: 2.5/(s √N) of the values' deviation, which is up
            // to 1.8 of the mean here; the least map has 1152 texels. Three times that for six channels of thirty pairs.
            let bound = |samples: f64| 3.0 * 2.5 * 1.8 / (samples * 1152f64.sqrt());
            assert!(
                off(4) < bound(4.0) && off(16) < bound(16.0),
                "{from} to {to}: {} {}",
                off(4),
                off(16)
            );
        }
    }
}

/// What the world's light is does not change on the way through any map and back.
#[test]
fn smooth_light_comes_back() {
    let light = |d: DVec3| DVec3::new(1.0 + d.x, 1.0 + d.y * d.y, 1.0 + 0.5 * d.x * d.z);
    let from = Parametrization::LatLong;
    let to_world = from.world_axes().transpose();
    let source = MapImage::from_fn(from, UVec2::new(128, 64), |texel| {
        light(to_world * from.texel_direction(UVec2::new(128, 64), texel).unwrap())
    })
    .unwrap();
    let settings = ResampleSettings {
        reconstruction: Reconstruction::Bilinear,
        ..ResampleSettings::default()
    };
    for through in Parametrization::ALL {
        if through == Parametrization::Nusselt {
            continue;
        }
        let there = from.world_axes() * through.world_axes().transpose();
        let held = resample(&source, through, size(through, 64), there, &settings).unwrap();
        // Texels of at most 0.15 rad (c = ½) under a slope of at most 1.4; over a fold, where maps have kinks, a quarter of that. The sphere
        // map's rim is one direction, about which texels are ever longer: 0.3 rad where it is looked up last.
        let (bound, mean_bound) = if through == Parametrization::Sphere {
            (0.3, 0.05)
        } else {
            (0.25 * 0.15 * 1.4, 0.02)
        };
        for d in directions(5, 300) {
            let place = through.world_axes() * d;
            if through == Parametrization::Sphere && place.z < -0.9 {
                continue;
            }
            let found = held.look_up(place).unwrap();
            assert!((found - light(d)).abs().max_element() < bound, "{through} {d}: {found}");
        }
        let back = resample(&held, from, source.size(), there.transpose(), &settings).unwrap();
        let mean_error: f64 = from
            .texels(source.size())
            .map(|texel| {
                let off = (back.at(texel) - source.at(texel)).as_dvec3().length_squared();
                from.texel_solid_angle(source.size(), texel) * off
            })
            .sum();
        let mean_error = (mean_error / (4.0 * PI)).sqrt();
        assert!(mean_error < mean_bound, "{through}: {mean_error}");
    }
}

/// A conversion that is watched is the same to the bit, tells of its progress row by row, and stops when it is told to.
#[test]
fn conversions_can_be_watched_and_stopped() {
    let source = noise(Parametrization::LatLong, 12);
    let (to, size) = (Parametrization::Cube, UVec2::splat(8));
    let settings = ResampleSettings::default();
    let mut told = Vec::new();
    let watched = resample_watched(&source, to, size, DMat3::IDENTITY, &settings, &mut |share| {
        told.push(share);
        true
    });
    let plain = resample(&source, to, size, DMat3::IDENTITY, &settings).unwrap();
    assert!(watched.unwrap() == Some(plain));
    assert!(told.len() == 49 && told[0] == 0.0 && told[48] == 1.0 && told.is_sorted());
    let mut rows = 0;
    let stopped = resample_watched(&source, to, size, DMat3::IDENTITY, &settings, &mut |_| {
        rows += 1;
        rows < 5
    });
    assert!(stopped.unwrap().is_none() && rows == 5);
}

#[test]
fn axes_of_files_are_those_of_the_world() {
    for map in Parametrization::ALL {
        let axes = map.world_axes();
        assert!((axes * axes.transpose() - DMat3::IDENTITY).abs_diff_eq(DMat3::ZERO, 0.0));
        let mirrored = map == Parametrization::LatLong;
        assert_eq!(axes.determinant(), if mirrored { -1.0 } else { 1.0 }, "{map}");
        let pole = if map == Parametrization::Cube {
            DVec3::Y
        } else {
            DVec3::Z
        };
        assert_eq!(axes * DVec3::Y, pole, "{map}");
    }
    // Up is the middle of an octahedron, +x the middle of its right edge; of the cube the third face.
    let octahedron = Parametrization::OctahedronQuadratic;
    let at = |map: Parametrization, d: DVec3| map.encode(map.world_axes() * d).unwrap();
    assert_eq!(at(octahedron, DVec3::Y).uv, DVec2::splat(0.5));
    assert_eq!(at(octahedron, DVec3::X).uv, DVec2::new(1.0, 0.5));
    assert_eq!(at(octahedron, -DVec3::Z).uv, DVec2::new(0.5, 1.0));
    assert_eq!(at(Parametrization::Cube, DVec3::Y).layer, 2);
}

#[test]
fn strips_hold_layers_and_borders_or_are_refused() {
    for map in Parametrization::ALL {
        let image = noise(map, 8);
        let borders: &[u32] = if map.is_disc() { &[0] } else { &[0, 1, 3] };
        for border in borders {
            let (extent, texels) = image.to_strip(*border).unwrap();
            assert_eq!(
                extent,
                UVec2::new((8 * map.aspect() + 2 * border) * map.layers(), 8 + 2 * border)
            );
            assert_eq!(
                MapImage::from_strip(map, extent, *border, &texels).unwrap(),
                image,
                "{map}"
            );
        }
        assert!(image.to_strip(9).is_err(), "{map}");
        assert_eq!(image.to_strip(1).is_err(), map.is_disc(), "{map}");
    }
    let texels = [Vec3::ONE; 12];
    for (map, extent, border) in [
        (Parametrization::Cube, UVec2::new(12, 1), 0),
        (Parametrization::Cube, UVec2::new(4, 3), 0),
        (Parametrization::OctahedronQuadratic, UVec2::new(4, 3), 0),
        (Parametrization::LatLong, UVec2::new(4, 3), 2),
        (Parametrization::LatLong, UVec2::new(4, 4), 0),
        (Parametrization::LatLong, UVec2::new(4, 3), u32::MAX),
    ] {
        assert!(
            MapImage::from_strip(map, extent, border, &texels).is_err(),
            "{map} {extent}"
        );
    }
    let none = resample(
        &noise(Parametrization::Cube, 2),
        Parametrization::Cube,
        UVec2::ZERO,
        DMat3::IDENTITY,
        &ResampleSettings::default(),
    );
    assert!(none.is_err());
}
