//! Solid angles, cones, lights and refusals.

use std::f64::consts::TAU;

use glam::{UVec2, Vec3};

use super::super::{cone_reflectivity, gather_solid_angle};
use super::*;
use crate::maps::impostor::ImpostorImage;
use crate::maps::impostor::room::BoxRoom;
use crate::maps::{MapImage, Parametrization};
use SolidAngleForm::{Disc, DiscWithNormals, Ratio};

#[test]
fn solid_angles_are_bounded_and_right_far_away() {
    for solid_angle in [0.01f64, 0.3, 2.0] {
        let whole = TAU / (TAU - solid_angle);
        // A disc at a distance of 2.
        let area = 4.0 * (whole * whole - 1.0);
        let at = |squared: f64| gather_solid_angle(Disc, area, squared, 1.0);
        assert!((at(4.0) - solid_angle).abs() < 1e-12);
        assert!((at(1e-12) - TAU).abs() < 1e-4 && at(0.0) == TAU);
        let far = at(4e6) * 1e6 / (area / 4.0 * std::f64::consts::PI);
        assert!((far - 1.0).abs() < 1e-5, "{far}");
        // At half the cosine, the solid angle of half the area; from behind nothing.
        assert_eq!(
            gather_solid_angle(DiscWithNormals, area, 4.0, 0.5),
            gather_solid_angle(Disc, 0.5 * area, 4.0, 1.0)
        );
        assert_eq!(gather_solid_angle(DiscWithNormals, area, 4.0, -0.1), 0.0);
    }
    // The printed ratio has no bound.
    assert!(gather_solid_angle(Ratio, 1.0, 1e-6, 1.0) > 1e5);
}

#[test]
fn means_over_cones_are_the_published_ones() {
    let cases: [(f64, f64, f64); 8] = [
        (30.0, 75.0, 0.2628),
        (30.0, 90.0, 0.1076),
        (30.0, 105.0, 0.0213),
        (60.0, 0.0, 0.7500),
        (60.0, 60.0, 0.4196),
        (60.0, 90.0, 0.1956),
        (60.0, 120.0, 0.0446),
        (90.0, 50.0, 0.25 * (1.0 + 0.642_787_6)),
    ];
    let table = Reflectivity::new(1.0).expect("table");
    for (half, angle, published) in cases {
        let (cone, axis) = (half.to_radians().cos(), angle.to_radians().cos());
        let exact = std::f64::consts::PI * cone_reflectivity(1.0, cone, axis);
        assert!((exact - published).abs() < 2e-4, "{half}° {angle}°: {exact}");
        let looked_up = std::f64::consts::PI * table.at(cone, axis);
        assert!(
            (looked_up - exact).abs() < 1e-3,
            "{half}° {angle}°: {looked_up} {exact}"
        );
    }
    // Whole cones above the horizon have a closed form, and lobes are normalised.
    let whole = cone_reflectivity(1.0, 0.9, 0.7) * std::f64::consts::PI;
    assert!((whole - 0.7 * 0.95).abs() < 1e-5, "{whole}");
    for exponent in [1.0, 5.0, 10.0] {
        let hemisphere = TAU * cone_reflectivity(exponent, 0.0, 1.0);
        assert!((hemisphere - 1.0).abs() < 2e-3, "{exponent}: {hemisphere}");
    }
}

#[test]
fn lights_hold_the_sphere_and_its_light() {
    for (map, side) in [(Parametrization::Cube, 16), (Parametrization::OctahedronQuadratic, 20)] {
        let (radiance, impostor) = LitRoom::PUBLISHED.maps(map, 160).expect("maps");
        let lights = GatherLights::new(&radiance, &impostor, side, DiscWithNormals).expect("lights");
        let sum: f64 = lights.solid_angles().iter().sum();
        assert!((sum - 2.0 * TAU).abs() < 1e-10, "{map}: {sum}");
        let light: f64 = lights
            .lights()
            .iter()
            .zip(lights.solid_angles())
            .map(|(light, angle)| angle * light.radiance.x)
            .sum();
        assert!((light / radiance.integral().x - 1.0).abs() < 1e-6, "{map}: {light}");
        // Mean positions of a cube's texels lie on its walls; of an octahedron's, which reach over edges, within them.
        for light in lights.lights() {
            let height = light.position.abs().max_element();
            let is_on_wall = (height - 1.0).abs() < 1e-5;
            assert!(
                is_on_wall || map != Parametrization::Cube && height < 1.0,
                "{map}: {light:?}"
            );
            assert!((light.normal.length() - 1.0).abs() < 1e-12);
        }
    }
}

/// Positions are averaged, distances are not; where most is sky a light is as far as the sky.
#[test]
fn silhouettes_do_not_move_lights_and_the_sky_is_far() {
    let map = Parametrization::Cube;
    let size = UVec2::splat(8);
    // Three quarters of one face.
    let near_half = |d: DVec3| d.z > d.x.abs().max(d.y.abs()) && (d.x > 0.0 || d.y < 0.0);
    let impostor = ImpostorImage::from_fn(map, size, 1, false, |d| {
        let surface = near_half(d).then_some(super::super::super::impostor::ImpostorSurface {
            distance: 2.0,
            normal: DVec3::Z,
        });
        surface.into_iter().collect()
    });
    let impostor = impostor.expect("impostor");
    let radiance = MapImage::from_fn(map, size, |_| DVec3::ONE).expect("radiance");
    let lights = GatherLights::new(&radiance, &impostor, 1, Disc).expect("lights");
    let nothing = f64::from(ImpostorImage::NOTHING);
    for (face, light) in lights.lights().iter().enumerate() {
        let is_near = face == 4;
        assert_eq!(light.position.length() < 2.0, is_near, "{face}: {light:?}");
        assert!(is_near || light.position.length() > 0.99 * nothing);
    }
    // The sky's light is that at the map's place, wherever the point is, and faces it.
    let [here, there] = [DVec3::ZERO, DVec3::new(3.0, -2.0, 1.0)].map(|position| {
        lights
            .gather(
                &GatherPoint {
                    position,
                    axis: DVec3::NEG_Y,
                },
                1.0,
                Terms::All,
                None,
            )
            .x
    });
    assert!(here > 0.3 && there.is_finite() && there > 0.3, "{here} {there}");
}

#[test]
fn even_surroundings_stay_even() {
    for form in [Ratio, Disc, DiscWithNormals] {
        let lights = LitRoom::EVEN.lights(16, form).expect("lights");
        for exponent in [1.0, 5.0] {
            let table = Reflectivity::new(exponent).expect("table");
            for table in [None, Some(&table)] {
                let point = GatherPoint {
                    position: DVec3::ZERO,
                    axis: DVec3::new(0.6, -0.48, 0.64),
                };
                let found = lights.gather(&point, exponent, Terms::All, table);
                assert!((found.x - 1.0).abs() < 5e-3, "{form:?} {exponent}: {found}");
            }
        }
    }
}

/// At the map's place a gather is the sum over texels by their own solid angles.
#[test]
fn at_the_maps_place_it_is_the_convolved_map() {
    for form in [Ratio, Disc, DiscWithNormals] {
        let lights = LitRoom::PUBLISHED.lights(16, form).expect("lights");
        for axis in [DVec3::X, DVec3::new(0.36, -0.8, 0.48)] {
            let point = GatherPoint {
                position: DVec3::ZERO,
                axis,
            };
            let convolved: f64 = lights
                .lights()
                .iter()
                .zip(lights.solid_angles())
                .map(|(light, angle)| {
                    let cosine = axis.dot(light.position.normalize()).max(0.0);
                    11.0 / TAU * cosine.powi(10) * angle * light.radiance.x
                })
                .sum();
            let found = lights.gather(&point, 10.0, Terms::All, None).x;
            assert!((found / convolved - 1.0).abs() < 1e-9, "{form:?}: {found} {convolved}");
        }
    }
}

#[test]
fn bad_maps_and_settings_are_refused_by_name() {
    let (radiance, impostor) = LitRoom::EVEN.maps(Parametrization::Cube, 12).expect("maps");
    let refused = |radiance: &MapImage, impostor: &ImpostorImage, side: u32, form: SolidAngleForm, words: &str| {
        let error = GatherLights::new(radiance, impostor, side, form)
            .expect_err(words)
            .to_string();
        assert!(error.contains(words), "{error}");
    };
    for side in [0, 5, 65] {
        refused(&radiance, &impostor, side, Disc, "side of lights");
    }
    let other = MapImage::from_fn(Parametrization::Cube, UVec2::splat(6), |_| DVec3::ONE).expect("radiance");
    refused(&other, &impostor, 4, Disc, "radiance");
    let mut texels = radiance.texels().to_vec();
    for bad in [f32::NAN, -1.0, f32::INFINITY] {
        texels[9] = Vec3::new(0.0, bad, 0.0);
        let radiance = MapImage::new(Parametrization::Cube, UVec2::splat(12), texels.clone()).expect("radiance");
        refused(&radiance, &impostor, 4, Disc, "radiance of texel 9");
    }
    let of = |layers: u32, with_normals: bool| {
        ImpostorImage::from_fn(Parametrization::Cube, UVec2::splat(12), layers, with_normals, |d| {
            BoxRoom::EMPTY.surfaces(d)
        })
        .expect("impostor")
    };
    refused(&radiance, &of(2, true), 4, Disc, "impostor layers");
    refused(
        &radiance,
        &of(1, false),
        4,
        DiscWithNormals,
        "needs an impostor with normals",
    );
    let map = Parametrization::LatLong;
    let size = UVec2::new(8, 4);
    let wide = ImpostorImage::from_fn(map, size, 1, false, |d| BoxRoom::EMPTY.surfaces(d)).expect("impostor");
    let light = MapImage::from_fn(map, size, |_| DVec3::ONE).expect("radiance");
    refused(&light, &wide, 4, Disc, "no square layers");
    for exponent in [0.0, 0.5, 65.0, f64::NAN] {
        assert!(Reflectivity::new(exponent).is_err(), "{exponent}");
    }
}
