//! Localised gathers on the device: their twins, and the published errors in a room whose irradiance is known exactly.

use std::f64::consts::PI;

use clerestory::gpu::Gpu;
use clerestory::maps::Parametrization;
use clerestory::maps::gather::lit_room::{LitRoom, relative_errors};
use clerestory::maps::gather::{
    Gather, GatherLights, GatherPoint, GatherSettings, Lobe, Reflectivity, SolidAngleForm, Terms,
};
use clerestory_tests::with_gpu;
use glam::DVec3;

fn run(
    gpu: &Gpu,
    lights: &GatherLights,
    settings: &GatherSettings,
    exponent: f32,
    points: &[GatherPoint],
) -> Vec<DVec3> {
    let gather = Gather::new(gpu, lights, settings, exponent).unwrap();
    let found = gather.gather(points).unwrap();
    assert_eq!(found, gather.gather(points).unwrap(), "the same bits again");
    found
}

#[test]
fn gathers_are_their_twins() {
    with_gpu(|gpu| {
        let mut points = LitRoom::points(LitRoom::PLACES[2], 60);
        // At the map's place, and close to a wall.
        for position in [DVec3::ZERO, DVec3::new(0.999, 0.2, 0.1)] {
            points.push(GatherPoint {
                position,
                axis: DVec3::new(0.6, -0.8, 0.0),
            });
        }
        let forms = [
            SolidAngleForm::Ratio,
            SolidAngleForm::Disc,
            SolidAngleForm::DiscWithNormals,
        ];
        let all = forms.map(|form| LitRoom::PUBLISHED.lights(8, form).unwrap());
        let cases = [
            (0, Terms::All, false, 1.0),
            (1, Terms::All, false, 1.0),
            (1, Terms::All, true, 5.0),
            (1, Terms::Five, false, 10.0),
            (2, Terms::All, true, 1.0),
            (2, Terms::FiveUnscaled, false, 10.0),
        ];
        for (form, terms, cones, exponent) in cases {
            let settings = GatherSettings { terms, cones };
            let found = run(gpu, &all[form], &settings, exponent, &points);
            let table = Reflectivity::new(f64::from(exponent)).unwrap();
            let lobe = if cones {
                Lobe::Cones(&table)
            } else {
                Lobe::Middles(f64::from(exponent))
            };
            let mut worst = 0.0f64;
            for (point, found) in points.iter().zip(&found) {
                let twin = all[form].gather(point, lobe, terms);
                worst = worst.max((*found - twin).abs().max_element() / (1e-3 + twin.max_element()));
            }
            println!("{:?}, {settings:?}, exponent {exponent}: {worst:.1e}", forms[form]);
            // Some hundred terms of ten operations, and a power; packed normals are off by 2·10⁻⁵.
            assert!(
                worst < 2e-4,
                "{:?}, {settings:?}, exponent {exponent}: {worst:e}",
                forms[form]
            );
        }
    });
}

#[test]
fn the_published_errors_hold_on_the_device() {
    with_gpu(|gpu| {
        let place = LitRoom::PLACES[1];
        let points = LitRoom::points(place, 400);
        let exact: Vec<f64> = points
            .iter()
            .map(|point| LitRoom::PUBLISHED.irradiance(point))
            .collect();
        let errors = |side: u32, form: SolidAngleForm| {
            let lights = LitRoom::PUBLISHED.printed_lights(side, form).unwrap();
            let found = run(gpu, &lights, &GatherSettings::default(), 1.0, &points);
            let found: Vec<f64> = found.iter().map(|value| PI * value.x).collect();
            relative_errors(&found, &exact)
        };
        for (side, form, published) in [
            (4, SolidAngleForm::Disc, [8.2, 5.0]),
            (16, SolidAngleForm::Disc, [16.3, 11.4]),
            (16, SolidAngleForm::DiscWithNormals, [0.6, -0.4]),
        ] {
            let [rms, bias] = errors(side, form);
            println!("{form:?}, {side}²: {rms:.3} %, {bias:+.3} %, published {published:?}");
            assert!(
                (rms - published[0]).abs() < 0.2 * published[0] && (bias - published[1]).abs() < 6.0,
                "{form:?}: {rms} {bias}"
            );
        }
    });
}

#[test]
fn what_a_setting_does_not_need_has_no_bytes_and_bad_ones_are_refused() {
    with_gpu(|gpu| {
        let lights = LitRoom::EVEN.lights(2, SolidAngleForm::Disc).unwrap();
        let settings = GatherSettings::default();
        let bytes = |cones: bool| {
            Gather::new(gpu, &lights, &GatherSettings { cones, ..settings }, 1.0)
                .unwrap()
                .bytes()
        };
        assert_eq!(bytes(false), [24 * 32, 0]);
        assert_eq!(bytes(true), [24 * 32, 64 * 64 * 4]);
        for exponent in [0.0, f32::NAN, 1e3] {
            let error = Gather::new(gpu, &lights, &settings, exponent).unwrap_err().to_string();
            assert!(error.contains("exponent of a gather"), "{error}");
        }
        let gather = Gather::new(gpu, &lights, &settings, 1.0).unwrap();
        assert!(gather.gather(&[]).unwrap().is_empty());
        for (position, axis, words) in [
            (DVec3::NAN, DVec3::X, "is not finite"),
            (1e200 * DVec3::X, DVec3::X, "is not finite"),
            (DVec3::ZERO, DVec3::ZERO, "no unit vector"),
            (DVec3::ZERO, DVec3::INFINITY, "no unit vector"),
            (DVec3::ZERO, 2.0 * DVec3::X, "no unit vector"),
        ] {
            let error = gather
                .gather(&[GatherPoint { position, axis }])
                .unwrap_err()
                .to_string();
            assert!(error.contains("point 0") && error.contains(words), "{error}");
        }
        let octahedron = Parametrization::OctahedronQuadratic;
        let (radiance, impostor) = LitRoom::EVEN.maps(octahedron, 32).unwrap();
        let lights = GatherLights::new(&radiance, &impostor, 16, SolidAngleForm::Disc).unwrap();
        let point = GatherPoint {
            position: DVec3::ZERO,
            axis: DVec3::Z,
        };
        let found = run(gpu, &lights, &settings, 1.0, &[point])[0];
        assert!((found.x - 1.0).abs() < 0.02, "{found}");
    });
}
