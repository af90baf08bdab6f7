//! Equi-angular samples of area lights, and of all lights in density grids.
//!
//! Values: single scattering by quadrature in f64, of a square lamp beside one ray through a box whose density is linear in the height, where
//! optical depths are closed forms; elsewhere pictures with and without those samples, whose expectations are the same.

use clerestory::scene::{AlphaMode, Environment};
use clerestory::transport::phase::phase_function;
use clerestory_tests::render::{builtin, independent, paths, tracer};
use clerestory_tests::with_gpu;

use super::*;

/// The box of the medium; the ray begins at the origin and leaves it along +x.
const LOW: Vec3 = Vec3::new(-0.5, -2.0, -2.0);
const HIGH: Vec3 = Vec3::new(6.0, 2.0, 2.0);
/// Half the side of the lamp, and the place of its middle in the plane z = 0.
const HALF: f64 = 0.15;
const LAMP: [f64; 2] = [2.5, 0.25];
/// Extinction of each band at density 1, m⁻¹, and what of it is scattering.
const SIGMA_T: [f64; 3] = [0.1, 0.3, 0.6];
const ALBEDO: f64 = 0.8;

/// Density at a height, where it is not 1 everywhere.
fn gradient(y: f64) -> f64 {
    1.0 + 0.4 * y
}

/// A square lamp of radiance 1 that shines down, or a point in its middle.
fn add_lamp(scene: &mut Scene, is_point: bool) {
    let [x, y] = LAMP;
    if is_point {
        let (position, intensity) = (Vec3::new(x as f32, y as f32, 0.0), Vec3::ONE);
        scene.add_light("point", LightKind::Point { position, intensity });
        return;
    }
    let mut lamp = Material::lambert("lamp", Vec3::ZERO);
    lamp.emission = Vec3::ONE;
    lamp.double_sided = false;
    let lamp = scene.add_material(lamp);
    let corner = |i: f64, k: f64| DVec3::new(x + HALF * i, y, HALF * k).as_vec3();
    scene.place(quad(
        "lamp",
        lamp,
        [
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ],
    ));
}

fn lamp_by_ray(in_grid: bool, is_point: bool, phase: Phase) -> Scene {
    let sigma_t = DVec3::from_array(SIGMA_T).as_vec3();
    let mut scene = Scene::default();
    let fog = Medium {
        name: "fog".into(),
        sigma_a: sigma_t * (1.0 - ALBEDO as f32),
        sigma_s: sigma_t * ALBEDO as f32,
        phase,
        density: in_grid.then(|| {
            layers(40, LOW, HIGH, |y| {
                gradient(f64::from(LOW.y) + y * f64::from(HIGH.y - LOW.y))
            })
        }),
        ..Medium::default()
    };
    add_box(&mut scene, fog, LOW, HIGH);
    add_lamp(&mut scene, is_point);
    scene.cameras.push(ray_camera(DVec3::ZERO, DVec3::X));
    scene
}

/// Simpson's rule with `n` intervals, an even number.
fn simpson(from: f64, to: f64, n: u32, f: impl Fn(f64) -> f64) -> f64 {
    let step = (to - from) / f64::from(n);
    let weight = |i: u32| match i {
        _ if i == 0 || i == n => 1.0,
        _ if i % 2 == 1 => 4.0,
        _ => 2.0,
    };
    (0..=n).map(|i| weight(i) * f(from + f64::from(i) * step)).sum::<f64>() * step / 3.0
}

/// Radiance that the ray of [`lamp_by_ray`] gets of light scattered once.
fn single_scattering(sigma_t: f64, in_grid: bool, is_point: bool, phase: Phase) -> f64 {
    let [x0, h] = LAMP;
    let density = |y: f64| if in_grid { gradient(y) } else { 1.0 };
    let of_point = |t: f64, place: DVec3| {
        let to = place - DVec3::X * t;
        let distance = to.length();
        let cosine = if is_point { 1.0 } else { h / distance };
        let depth = sigma_t * distance * 0.5 * (density(0.0) + density(h));
        phase_function(phase, DVec3::X, to / distance) * cosine / (distance * distance) * (-depth).exp()
    };
    let of_lamp = |t: f64| {
        if is_point {
            return of_point(t, DVec3::new(x0, h, 0.0));
        }
        simpson(-HALF, HALF, 24, |z| {
            simpson(-HALF, HALF, 24, |x| of_point(t, DVec3::new(x0 + x, h, z)))
        })
    };
    // Evenly over the angle at the lamp's middle.
    let angle = |t: f64| ((t - x0) / h).atan();
    simpson(angle(0.0), angle(f64::from(HIGH.x)), 600, |a| {
        let t = x0 + h * a.tan();
        let extinction = sigma_t * density(0.0);
        ALBEDO * extinction * (-extinction * t).exp() * of_lamp(t) * h / a.cos().powi(2)
    })
}

#[test]
fn single_scattering_beside_a_lamp_is_its_integral() {
    with_gpu(|gpu| {
        for (in_grid, is_point) in [(false, false), (true, false), (true, true)] {
            for phase in [
                Phase::Isotropic,
                Phase::HenyeyGreenstein { g: 0.7 },
                Phase::HenyeyGreenstein { g: -0.5 },
            ] {
                let scene = lamp_by_ray(in_grid, is_point, phase);
                let mut variances = Vec::new();
                for equiangular in [true, false] {
                    let settings = PathTracerSettings {
                        equiangular,
                        seed: seed_of(&scene) ^ u32::from(equiangular),
                        ..paths("bounces=1")
                    };
                    let picture = render(gpu, &scene, [16, 16], 64, &settings);
                    for (c, (mean, variance)) in picture.mean().into_iter().enumerate() {
                        let expected = single_scattering(SIGMA_T[c], in_grid, is_point, phase);
                        let what = format!(
                            "lamp, grid {in_grid}, point {is_point}, {phase:?}, band {c}, equi-angular {equiangular}"
                        );
                        report(&what, mean, variance, expected);
                        // f32, and the rays' distances from the axis of up to 10⁻⁶ m.
                        expect_mean(&what, mean, variance, expected, 2e-5 * expected);
                    }
                    variances.push(picture.mean()[0].1);
                }
                let ratio = variances[1] / variances[0];
                println!("variance without ÷ with equi-angular samples: {ratio:.1}");
                // Half of the flights collide, on average over the bands, and seldom near the lamp.
                assert!(ratio > 2.0, "grid {in_grid}, point {is_point}, {phase:?}: {ratio}");
            }
        }
    });
}

/// Expects equal pictures with and without equi-angular samples, and the former to have sent rays of their own.
fn expect_same_without(gpu: &Gpu, what: &str, scene: &Scene, samples: u32) {
    let settings = |seed, equiangular| PathTracerSettings {
        seed,
        equiangular,
        ..independent()
    };
    let [with, without] = [(1, true), (2, false)]
        .map(|(seed, equiangular)| render(gpu, scene, [12, 12], samples, &settings(seed, equiangular)));
    with.expect_same_as(what, &without.radiance, &without.variance);
    let rays = [&with, &without].map(|picture| picture.counters.shadow_rays);
    assert!(rays[0] > rays[1] + rays[1] / 50, "{what}: {rays:?}");
}

/// Fog of a colour in tinted glass, a lamp that is there in part, a box of other fog in the fog, a surface that shines from below.
fn crowded(in_grid: bool) -> Scene {
    let mut scene = Scene::default();
    let mut glass = Material::glass("glass", 1.2);
    glass.attenuation_color = Vec3::new(1.0, 0.6, 0.3);
    glass.attenuation_distance = 1.0;
    let glass = scene.add_material(glass);
    scene.place(cuboid("glass", glass, Vec3::splat(-2.0), Vec3::splat(2.0)));
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
    scene.place(clerestory_tests::render::floor("floor", white, 1.0, -1.5));
    let (low, high) = (Vec3::new(-0.9, -1.0, -0.9), Vec3::new(0.9, 1.2, 0.9));
    let fog = Medium {
        sigma_a: Vec3::new(0.05, 0.1, 0.2),
        sigma_s: Vec3::new(0.2, 0.4, 0.3),
        phase: Phase::HenyeyGreenstein { g: 0.6 },
        density: in_grid.then(|| layers(9, low, high, |y| if y < 0.3 { 0.0 } else { 2.0 * y })),
        ..Medium::default()
    };
    add_box(&mut scene, fog, low, high);
    let inner = medium(2.0, 0.9, Phase::Rayleigh);
    add_box(&mut scene, inner, Vec3::new(-0.5, -0.6, -0.5), Vec3::new(0.1, 0.0, 0.1));
    for (name, alpha, low, high) in [
        ("blended", 0.5, Vec3::new(-0.2, 0.5, -0.2), Vec3::new(0.1, 0.55, 0.1)),
        ("beyond", 1.0, Vec3::new(-0.4, 1.5, -0.4), Vec3::new(0.4, 1.6, 0.4)),
    ] {
        let mut lamp = Material::lambert(name, Vec3::ZERO);
        lamp.emission = Vec3::new(1.0, 2.0, 3.0);
        lamp.alpha_mode = AlphaMode::Blend;
        lamp.base_color.w = alpha;
        let lamp = scene.add_material(lamp);
        scene.place(cuboid(name, lamp, low, high));
    }
    let eye = DVec3::new(0.3, 0.2, 1.6);
    scene.cameras = vec![Camera::look_at("main", eye, DVec3::new(0.0, 0.1, 0.0), DVec3::Y, 1.0)];
    scene
}

#[test]
fn lamps_among_bodies_glass_and_alpha_keep_their_expectation() {
    with_gpu(|gpu| {
        for in_grid in [false, true] {
            expect_same_without(gpu, &format!("crowded, grid {in_grid}"), &crowded(in_grid), 256);
        }
    });
}

#[test]
fn ways_through_grids_of_loose_bounds_are_cut_without_a_trace() {
    with_gpu(|gpu| {
        // One cell as dense as makes the way ten times as deep as one segment may be.
        let (low, high) = (Vec3::splat(-1.0), Vec3::ONE);
        let mut fog = medium(0.3, 0.9, Phase::Isotropic);
        let density = |p: DVec3| if p.min_element() > 0.9 { 1600.0 } else { 1.0 };
        let grid = DensityGrid::from_fn([16; 3], |p| density(p) as f32);
        fog.density = Some(grid.in_box(low.as_dvec3(), high.as_dvec3()));
        let mut scene = Scene::default();
        add_box(&mut scene, fog, low, high);
        let mut lamp = Material::lambert("lamp", Vec3::ZERO);
        lamp.emission = Vec3::splat(5.0);
        let lamp = scene.add_material(lamp);
        scene.place(cuboid("lamp", lamp, Vec3::splat(-0.2), Vec3::splat(-0.1)));
        let eye = DVec3::new(0.0, 0.3, 4.0);
        scene.cameras = vec![Camera::look_at("main", eye, DVec3::ZERO, DVec3::Y, 0.5)];
        expect_same_without(gpu, "loose bounds", &scene, 512);
    });
}

#[test]
fn without_lights_that_have_a_place_nothing_of_it_exists() {
    with_gpu(|gpu| {
        let mut sky = builtin("builtin:cloud?size=16");
        sky.environment = Some(Environment::uniform(Vec3::ONE));
        let lit = lamp_by_ray(true, false, Phase::Isotropic);
        let dark = builtin("builtin:cornell-box");
        let wax = builtin("builtin:wax");
        for (scene, equiangular, expected) in [
            (&sky, true, 0),
            (&dark, true, 0),
            (&wax, true, 0),
            (&lit, false, 0),
            (&lit, true, 1),
        ] {
            let settings = PathTracerSettings {
                equiangular,
                ..independent()
            };
            let tracer = tracer(gpu, scene, [16, 16], &settings);
            let constants: Vec<u32> = tracer
                .pipelines()
                .iter()
                .flat_map(|pipeline| pipeline.specialization.clone())
                .filter_map(|(name, value)| (name == "has_airlight").then_some(value))
                .collect();
            let media = usize::from(!std::ptr::eq(scene, &dark));
            assert_eq!(constants, vec![expected; media], "{}", scene.name);
        }
        // Nor does the picture change by a bit.
        let bits = |equiangular| {
            let settings = PathTracerSettings {
                equiangular,
                ..PathTracerSettings::default()
            };
            render(gpu, &sky, [16, 16], 4, &settings).bits()
        };
        assert_eq!(bits(true), bits(false));
    });
}
