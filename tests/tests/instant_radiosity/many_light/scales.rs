//! The unit of length, and places far from the origin, of all that virtual lights are placed, seen and gathered by: nothing of it is an absolute length.

use super::kept::kept;
use super::*;
use clerestory::scene::Projection;
use clerestory::techniques::instant_radiosity::Selection;
use clerestory_hard_cases::scenes::transform;
use glam::DAffine3;

/// Pixels across and down.
const SMALL: [u32; 2] = [16; 2];
/// Samples of a picture.
const SAMPLES: u32 = 2;
/// Where it is put far from the origin, m: coordinates are 1/128 m apart there.
const FAR: DVec3 = DVec3::new(1e5, -1e5, 1e5);
/// What all corners and the lamp are multiples of, m, so that they are where they were.
const GRID: f32 = 1.0 / 64.0;
/// What lengths are multiplied by.
const SCALES: [f32; 2] = [1.0 / 1024.0, 1024.0];
/// Cuts draw other lights in other units: their means alone are the same, up to the noise of a small picture.
const NOISE_OF_CUTS: f64 = 2e-3;
/// What is met on surfaces is off by up to 4 mm there, and rays begin up to 2 cm off them.
const FAR_BIAS: f64 = 0.02;

/// The hall at another place, with all lengths multiplied, and powers by the square, so that its radiance stays.
fn hall_at(scale: f32, by: DVec3) -> Scene {
    let on_grid = |place: Vec3| (place / GRID).round() * GRID;
    let mut scene = hall();
    scene.name = format!("hall times {scale} at {by}");
    for place in scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.positions) {
        *place = on_grid(*place);
    }
    let placed = DAffine3::from_translation(by) * DAffine3::from_scale(DVec3::splat(scale.into()));
    transform(&mut scene, placed);
    for camera in &mut scene.cameras {
        if let Projection::Orthographic { half_height } = &mut camera.projection {
            *half_height *= scale;
        }
    }
    for light in &mut scene.lights {
        if let LightKind::Point { position, intensity } = &mut light.kind {
            *position = placed.transform_point3(on_grid(*position).as_dvec3()).as_vec3();
            *intensity *= scale * scale;
        }
    }
    scene
}

/// `picture` renders the hall, with lengths so multiplied. In other units of a power of two it has the same bits, or a mean within `noise`; far from the origin nearly the same mean.
fn expect_no_lengths(what: &str, noise: f64, picture: impl Fn(&Scene, f32) -> Vec<f32>) {
    let truth = picture(&hall_at(1.0, DVec3::ZERO), 1.0);
    let whole = mean(&truth, 1);
    assert!(whole > 0.0, "{what}: black");
    for scale in SCALES {
        let found = picture(&hall_at(scale, DVec3::ZERO), scale);
        let differ = bits(&found).iter().zip(bits(&truth)).filter(|(a, b)| **a != *b).count();
        let off = mean(&found, 1) / whole - 1.0;
        println!("{what} times {scale}: {differ} differ, the mean is off by {off:.1e}");
        let is_same = if noise > 0.0 { off.abs() < noise } else { differ == 0 };
        assert!(
            is_same,
            "{what} times {scale}: {differ} differ, the mean is off by {off:.1e}"
        );
    }
    let off = mean(&picture(&hall_at(1.0, FAR), 1.0), 1) / whole - 1.0;
    println!("{what}: off by {off:.1e} far from the origin");
    assert!(off.abs() < FAR_BIAS, "{what}: {off}");
}

#[test]
fn frames_know_no_lengths() {
    let small_maps = ManyLightSettings {
        map_side: 16,
        map_points: 256,
        ..exact()
    };
    let rsm = ManyLightSettings {
        placement: Placement::Rsm,
        rsm_side: 16,
        ..exact()
    };
    let variants = [
        (
            "tiles, a filter and a bound",
            ManyLightSettings {
                lights: 256,
                filter: true,
                bound: Bound::Geometry,
                bound_value: 1.0,
                ..exact()
            },
        ),
        (
            "a bound of the distance",
            ManyLightSettings {
                lights: 256,
                bound: Bound::Distance,
                bound_value: 0.5,
                ..exact()
            },
        ),
        (
            "exact maps",
            ManyLightSettings {
                visibility: Visibility::Maps,
                ..small_maps.clone()
            },
        ),
        (
            "imperfect maps",
            ManyLightSettings {
                visibility: Visibility::Imperfect,
                ..small_maps
            },
        ),
        ("reflective maps", rsm.clone()),
        (
            "discs",
            ManyLightSettings {
                gathering: Gathering::Disc,
                disc_samples: 64,
                // As wide as that of the slab's sides beside the floor.
                disc_radius: 1.5,
                ..rsm
            },
        ),
        // Of all lights, so that a choice that rounding changes changes no mean.
        (
            "reservoirs",
            ManyLightSettings {
                gathering: Gathering::Reservoirs,
                candidates: 64,
                ..exact()
            },
        ),
        (
            "chains",
            ManyLightSettings {
                placement: Placement::Metropolis,
                pool: 2048,
                mutations: 16,
                power_pixels: 2048,
                interleave: 1,
                ..exact()
            },
        ),
        ("kept lights", kept()),
        (
            "a history",
            ManyLightSettings {
                lights: 256,
                history: 0.9,
                ..exact()
            },
        ),
    ];
    with_gpu(|gpu| {
        for (what, settings) in &variants {
            expect_no_lengths(what, 0.0, |scene, scale| {
                let settings = ManyLightSettings {
                    bound_value: scaled(settings.bound, settings.bound_value, scale),
                    ..of(INDIRECT, settings.clone())
                };
                picture(gpu, scene, SMALL, &settings, SAMPLES)
            });
        }
    });
}

#[test]
fn virtual_lights_know_no_lengths() {
    let base = VirtualLightSettings {
        walks: 64,
        // Light of virtual lights alone.
        least_bounces: 2,
        ..settings()
    };
    let variants = [
        (
            "all, with a bound of the distance",
            VirtualLightSettings {
                bound: Bound::Distance,
                bound_value: 0.5,
                ..base.clone()
            },
        ),
        (
            "all, with a bound of the geometry term",
            VirtualLightSettings {
                bound: Bound::Geometry,
                bound_value: 1.0,
                fractional: true,
                ..base.clone()
            },
        ),
        (
            "cuts",
            VirtualLightSettings {
                selection: Selection::Cuts,
                cut_size: 64,
                candidates: 2,
                compensation: Compensation::None,
                ..base.clone()
            },
        ),
        (
            "the potential",
            VirtualLightSettings {
                selection: Selection::Potential,
                compensation: Compensation::None,
                ..base
            },
        ),
    ];
    with_gpu(|gpu| {
        for (what, settings) in &variants {
            let is_by_cuts = settings.selection == Selection::Cuts;
            let noise = if is_by_cuts { NOISE_OF_CUTS } else { 0.0 };
            expect_no_lengths(what, noise, |scene, scale| {
                let settings = VirtualLightSettings {
                    bound_value: scaled(settings.bound, settings.bound_value, scale),
                    ..settings.clone()
                };
                let [radiance, _] = advance(&mut renderer(gpu, scene, SMALL, &settings), SAMPLES);
                radiance
            });
        }
    });
}

/// A bound in other units: 1/m² of the geometry term, m² of the squared distance.
fn scaled(bound: Bound, value: f32, scale: f32) -> f32 {
    match bound {
        Bound::None => value,
        Bound::Geometry => value / (scale * scale),
        Bound::Distance => value * scale * scale,
    }
}
