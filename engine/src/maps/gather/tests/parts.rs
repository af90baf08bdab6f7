//! Solid angles, cones, lights and refusals.

use std::f64::consts::TAU;

use glam::{UVec2, Vec3};

use super::super::{cone_reflectivity, gather_solid_angle};
use super::*;
use crate::maps::impostor::room::BoxRoom;
use crate::maps::impostor::{ImpostorImage, ImpostorSurface};
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
        // Where the quotient, or what it is multiplied with, leaves the numbers.
        assert!((at(1e-307) - TAU).abs() < 1e-12 && at(1e-320) == TAU);
        assert_eq!(gather_solid_angle(DiscWithNormals, area, 0.0, 0.0), 0.0);
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

/// One light a face of a cube, whose +z shows a surface at each direction's distance, and whose other faces show the sky.
fn face_lights(distance: impl Fn(DVec3) -> Option<f64>) -> GatherLights {
    let (map, size) = (Parametrization::Cube, UVec2::splat(8));
    let impostor = ImpostorImage::from_fn(map, size, 1, false, |d| {
        let is_seen = d.z > d.x.abs().max(d.y.abs());
        let surface = distance(d).filter(|_| is_seen).map(|distance| ImpostorSurface {
            distance,
            normal: DVec3::Z,
        });
        surface.into_iter().collect()
    });
    let radiance = MapImage::from_fn(map, size, |_| DVec3::ONE).expect("radiance");
    GatherLights::new(&radiance, &impostor.expect("impostor"), 1, Disc).expect("lights")
}

/// A light has the mean of all positions in its texel: on the plane that fills it, and between two that meet at a silhouette, by their solid angles.
#[test]
fn a_light_over_a_silhouette_lies_between() {
    let plane = face_lights(|d| Some(2.0 / d.z));
    assert!((plane.lights()[4].position - 2.0 * DVec3::Z).length() < 1e-6);
    let both = face_lights(|d| Some(if d.x > 0.0 { 1.0 } else { 3.0 } / d.z));
    let position = both.lights()[4].position;
    assert!((position.z - 2.0).abs() < 1e-6 && position.x < -0.1, "{position}");
}

/// What is near in a texel places its light, unless most of the texel is sky: then the light is as far as the sky.
#[test]
fn the_sky_is_far_and_does_not_draw_lights_away() {
    // Three quarters of the face.
    let lights = face_lights(|d| (d.x > 0.0 || d.y < 0.0).then_some(2.0));
    let nothing = f64::from(ImpostorImage::NOTHING);
    for (face, light) in lights.lights().iter().enumerate() {
        let is_near = face == 4;
        assert_eq!(light.position.length() < 2.0, is_near, "{face}: {light:?}");
        assert!(is_near || light.position.length() > 0.99 * nothing);
    }
    // The sky's light is that at the map's place, wherever the point is, and faces it.
    let [here, there] = [DVec3::ZERO, DVec3::new(3.0, -2.0, 1.0)].map(|position| {
        let axis = DVec3::NEG_Y;
        let point = GatherPoint { position, axis };
        lights.gather(&point, Lobe::Middles(1.0), Terms::All).x
    });
    assert!(here > 0.3 && there.is_finite() && there > 0.3, "{here} {there}");
}

#[test]
fn even_surroundings_stay_even() {
    for form in [Ratio, Disc, DiscWithNormals] {
        let lights = LitRoom::EVEN.lights(16, form).expect("lights");
        for exponent in [1.0, 5.0, 20.0, 64.0] {
            let table = Reflectivity::new(exponent).expect("table");
            for lobe in [Lobe::Middles(exponent), Lobe::Cones(&table)] {
                let point = GatherPoint {
                    position: DVec3::ZERO,
                    axis: DVec3::new(0.6, -0.48, 0.64),
                };
                let found = lights.gather(&point, lobe, Terms::All).x;
                println!(
                    "{form:?}, exponent {exponent}, {}: {found:.5}",
                    matches!(lobe, Lobe::Cones(_))
                );
                assert!((found - 1.0).abs() < 5e-3, "{form:?} {exponent}: {found}");
            }
        }
    }
}

/// Light of a lobe over all directions, by the table: 1, however small the lights are.
#[test]
fn narrow_lobes_keep_their_light_in_the_table() {
    for exponent in [1.0, 5.0, 10.0, 20.0, 64.0] {
        let table = Reflectivity::new(exponent).expect("table");
        for cone in [1.0, 0.998, 0.9, 0.0] {
            let count = 20_000;
            let at = |i: u32| table.at(cone, 2.0 * (f64::from(i) + 0.5) / f64::from(count) - 1.0);
            let sum = 2.0 * TAU * (0..count).map(at).sum::<f64>() / f64::from(count);
            println!("exponent {exponent}, cone {cone}: {sum:.5}");
            assert!((sum - 1.0).abs() < 1e-4, "{exponent} {cone}: {sum}");
        }
        // Between rows, of lights that are points.
        for angle in [0.9f64, 2.7, 11.5, 24.0, 60.0] {
            let axis = angle.to_radians().cos();
            let [peak, exact] = [1.0, axis].map(|axis| cone_reflectivity(exponent, 1.0, axis));
            let found = table.at(1.0, axis);
            assert!(
                (found - exact).abs() < 0.02 * peak,
                "{exponent} {angle}°: {found} {exact}"
            );
        }
    }
}

/// Away from the map's place, in surroundings of radiance 1: what was published of spheres of points, as mean, least and greatest.
#[test]
fn even_surroundings_err_as_published_elsewhere() {
    let of = |side: u32, form: SolidAngleForm, place: DVec3| {
        let lights = LitRoom::EVEN.printed_lights(side, form).expect("lights");
        let values: Vec<f64> = sphere(place)
            .iter()
            .map(|point| lights.irradiance(point).x / PI)
            .collect();
        let [least, most] = [
            values.iter().copied().fold(f64::INFINITY, f64::min),
            values.iter().copied().fold(0.0, f64::max),
        ];
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        println!("{form:?}, {side}² texels a face, {place}: {mean:.4}, {least:.4} to {most:.4}");
        [mean, least, most]
    };
    let near = |found: f64, published: f64, slack: f64| {
        assert!((found - published).abs() <= slack, "{found}, published {published}")
    };
    for (side, published) in [(2, [0.955, 1.045]), (4, [0.988, 1.007]), (8, [0.996, 1.011])] {
        let [_, least, most] = of(side, Disc, LitRoom::PLACES[0]);
        near(least, published[0], 2e-3);
        near(most, published[1], 2e-3);
    }
    let [mean, least, most] = of(4, Disc, LitRoom::PLACES[1]);
    near(mean, 1.048, 5e-3);
    near(least, 1.020, 5e-3);
    near(most, 1.084, 5e-3);
    // Without bound in the corner, and with the disc's: the greatest there depends on how near a normal comes to a light.
    let [mean, _, most] = of(4, Ratio, LitRoom::PLACES[3]);
    near(mean, 1.82, 0.1 * 1.82);
    near(most, 11.2, 0.1 * 11.2);
    let [mean, _, most] = of(4, Disc, LitRoom::PLACES[3]);
    near(mean, 1.00, 0.1);
    near(most, 1.73, 0.1 * 1.73);
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
            let found = lights.gather(&point, Lobe::Middles(10.0), Terms::All).x;
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
    // One light about the map's place.
    for map in [Parametrization::OctahedronQuadratic, Parametrization::EqualArea] {
        let (radiance, impostor) = LitRoom::EVEN.maps(map, 12).expect("maps");
        refused(&radiance, &impostor, 1, Disc, "is one light about the place");
        assert!(GatherLights::new(&radiance, &impostor, 2, Disc).is_ok(), "{map}");
    }
    for exponent in [0.0, 0.5, 65.0, f64::NAN] {
        assert!(Reflectivity::new(exponent).is_err(), "{exponent}");
    }
}
