//! The path tracer against pictures that are known in closed form.
//!
//! Acceptance: the mean over a picture by a z-test with a false-alarm rate of 10⁻⁶ a channel, from the picture's own variances; pixels by
//! the z-test of `film::z_test` (Šidák at 1 %; 99.75 % accepted where tails are heavy). Samples are independent (PCG), so z-scores are what they say.

use std::f64::consts::PI;
use std::path::Path;

use clerestory::scene::metals::artistic::artistic_index;
use clerestory::scene::sidecar::Sidecar;
use clerestory::scene::{
    Distribution, Environment, FresnelForm, Geometry, LightKind, Material, Mesh, Microfacets, Scene, metals,
};
use clerestory::techniques::PathTracerSettings;
use clerestory::transport::albedo::AlbedoTable;
use clerestory::transport::bsdf::{Bsdf, BsdfContext, BsdfFeatures, LOBE_ALL, bsdf_sample};
use clerestory::transport::fresnel::form::MetalFresnel;
use clerestory::transport::fresnel::fresnel_conductor;
use clerestory::transport::phong::phong_eval;
use clerestory::transport::warp::square_to_cosine_hemisphere;
use clerestory_hard_cases::scenes::orthographic;
use clerestory_tests::random::Random;
use clerestory_tests::render::{
    builtin, camera_down, cuboid, finish, floor, independent, paths, pixel_averages, point_triangle, render, tracer,
};
use clerestory_tests::statistics::expect_mean;
use clerestory_tests::with_gpu;
use glam::{DVec2, DVec3, Quat, Vec3};

const SMALL: [u32; 2] = [16, 16];

#[test]
fn closed_furnaces_have_the_radiance_of_the_geometric_series() {
    with_gpu(|gpu| {
        for (rho, emission) in [([0.2, 0.5, 0.8], [0.8, 0.5, 0.2]), ([0.0, 0.9, 0.95], [1.0, 0.5, 0.1])] {
            for name in ["furnace-box", "furnace-sphere"] {
                let mut scene = builtin(&format!("builtin:{name}"));
                scene.materials[0] = Material::lambert("furnace", Vec3::from(rho));
                scene.materials[0].emission = Vec3::from(emission);
                let picture = render(gpu, &scene, SMALL, 64, &independent());
                let expected = [0, 1, 2].map(|c| f64::from(emission[c]) / (1.0 - f64::from(rho[c])));
                picture.expect_uniform(name, expected, 0.0);
            }
        }
    });
}

#[test]
fn the_variance_layer_is_the_variance_of_the_means() {
    with_gpu(|gpu| {
        // Each pixel's (mean − truth)² ÷ variance has the expectation 1; over 1024 pixels of nearly normal means the mean of it has a
        // deviation of √(2/1024) = 0.044. Bounds at ±6 deviations: false alarms of 10⁻⁸. Paths end by their length, since the rare bright
        // samples of Russian roulette would make means of few samples not normal: Σ ρⁿE for n = 0 … 4.
        let scene = builtin("builtin:furnace-box?rho=0.5&emission=0.5");
        let settings = PathTracerSettings {
            roulette_start: 5,
            ..paths("bounces=0..4")
        };
        let picture = render(gpu, &scene, [32, 32], 256, &settings);
        let truth = 1.0 - 0.5f64.powi(5);
        let squares = picture.radiance.iter().zip(&picture.variance).step_by(3);
        let mean = squares
            .map(|(v, var)| (f64::from(*v) - truth).powi(2) / f64::from(*var))
            .sum::<f64>()
            / 1024.0;
        assert!((mean - 1.0).abs() < 6.0 * (2.0f64 / 1024.0).sqrt(), "{mean}");
    });
}

#[test]
fn sobol_draws_have_the_same_expectation_and_less_variance_between_seeds() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:furnace-box?rho=0.5&emission=0.5");
        let settings = PathTracerSettings::default();
        let picture = render(gpu, &scene, SMALL, 64, &settings);
        // The sample variance of stratified samples overstates the error, so this errs to the side of fewer alarms.
        picture.expect_uniform("sobol", [1.0; 3], 0.0);
        let error =
            |p: &clerestory_tests::render::Rendered| p.radiance.iter().map(|v| f64::from(v - 1.0).powi(2)).sum::<f64>();
        let pcg = render(gpu, &scene, SMALL, 64, &independent());
        assert!(error(&picture) < error(&pcg), "{} {}", error(&picture), error(&pcg));
    });
}

#[test]
fn a_light_in_a_lambert_sphere_fills_it_evenly() {
    with_gpu(|gpu| {
        // Facets: their distance from the centre and their angle to it vary by squares of the edge (1.1/48 m), as does the irradiance.
        let facets = (1.11f64 / 48.0).powi(2);
        for light in ["point", "area"] {
            let scene = builtin(&format!("builtin:sphere-light?light={light}&rho=0.5"));
            let picture = render(gpu, &scene, SMALL, 256, &paths("bounces=1.."));
            let mean = picture.mean();
            // Emission is left out by the path set; whoever looks at the light sees its reflection only, which is none.
            let seen = if light == "area" { covered(&scene) } else { 0.0 };
            for (c, (value, variance)) in mean.into_iter().enumerate() {
                let what = format!("{light}, channel {c}");
                expect_mean(&what, value, variance, 1.0 - seen, facets + 0.002 * seen);
            }
        }
    });
}

/// Share of the main camera's square picture that a sphere of radius 0.1 at the origin covers, by counting 512² rays.
fn covered(scene: &Scene) -> f64 {
    let transform = scene.cameras[0].transform;
    let clerestory::scene::Projection::Perspective { fov_y } = scene.cameras[0].projection else {
        panic!("a perspective camera");
    };
    let half = (0.5 * f64::from(fov_y)).tan();
    let n = 512;
    let plane = |i: i32| (2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0) * half;
    let hits = (0..n * n)
        .filter(|i| {
            let direction = transform
                .transform_vector3(DVec3::new(plane(i % n), plane(i / n), -1.0))
                .normalize();
            clerestory::accel::sphere::intersect_sphere(transform.translation, direction, DVec3::ZERO, 0.1)
                .is_some_and(|t| t[0] > 0.0)
        })
        .count();
    hits as f64 / f64::from(n * n)
}

#[test]
fn white_objects_vanish_in_a_white_furnace() {
    with_gpu(|gpu| {
        // Interpolation of the albedo table (transport/bsdf/tests.rs): relative 2·10⁻³. Delta lobes have no table.
        const TABLE: f64 = 2e-3;
        for (what, query, bias) in [
            ("rough metal", "metallic=1&roughness=0.6", TABLE),
            ("mirror", "metallic=1&roughness=0", 0.0),
            ("rough dielectric", "roughness=0.5", TABLE),
            ("polished dielectric", "roughness=0", TABLE),
            ("clear glass", "transmission=1&roughness=0&thickness=1", 0.0),
            ("thin wall", "transmission=1&roughness=0", 0.0),
        ] {
            let scene = builtin(&format!("builtin:white-furnace?frequency=8&{query}"));
            let picture = render(gpu, &scene, SMALL, 128, &independent());
            picture.expect_uniform(what, [1.0; 3], bias);
        }
    });
}

/// Throughput and its variance of a walk through a slab without sides by the f64 scattering function, seen straight on.
fn slab_walk(bsdf: &Bsdf, walks: u32) -> (f64, f64) {
    let context = BsdfContext {
        features: BsdfFeatures::ALL,
        table: AlbedoTable::shared(),
    };
    let mut random = Random(11);
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..walks {
        // Directions in the frame of the upper face; `above` and `below` are where the path leaves for good.
        let (mut direction, mut upper, mut throughput) = (DVec3::NEG_Z, true, 1.0);
        loop {
            let face = if upper { 1.0 } else { -1.0 };
            let flip = |w: DVec3| DVec3::new(w.x, w.y, w.z * face);
            let u = DVec3::new(random.unit().into(), random.unit().into(), random.unit().into());
            let sample = bsdf_sample(&context, bsdf, flip(-direction), u, LOBE_ALL);
            throughput *= sample.weight.x;
            direction = flip(sample.wi);
            if sample.flags == 0 || throughput < 1e-6 {
                throughput = 0.0;
                break;
            }
            let outside = sample.wi.z > 0.0;
            if outside {
                break;
            }
            upper = direction.z > 0.0;
        }
        sum += throughput;
        squares += throughput * throughput;
    }
    let n = f64::from(walks);
    (sum / n, (squares / n - (sum / n).powi(2)) / n)
}

#[test]
fn rough_glass_loses_what_the_f64_twin_says() {
    with_gpu(|gpu| {
        // The slab's sides are 400 thicknesses away: paths that reach them are too few to tell.
        let scene = builtin("builtin:slab?thickness=0.01&roughness=0.5");
        let picture = render(gpu, &scene, SMALL, 256, &independent());
        let (truth, variance) = slab_walk(&Bsdf::from_material(&scene.materials[0]), 200_000);
        assert!(truth < 1.0, "single scattering loses energy");
        for (c, (mean, own)) in picture.mean().into_iter().enumerate() {
            expect_mean(&format!("channel {c}"), mean, own + variance, truth, 1e-6);
        }
    });
}

/// A black-walled Lambert floor of reflectance 0.75, 0.5, 0.25 seen straight from above over 2 m × 2 m.
fn lambert_floor() -> Scene {
    let mut scene = Scene {
        name: "floor".into(),
        ..Scene::default()
    };
    let material = scene.add_material(Material::lambert("floor", FLOOR));
    scene.place(floor("floor", material, 4.0, 0.0));
    scene.cameras.push(camera_down(1.0, 10.0));
    scene
}

const FLOOR: Vec3 = Vec3::new(0.75, 0.5, 0.25);

/// Pixel values of [`lambert_floor`] whose irradiance at (x, z) is `irradiance`, averaged over each pixel by a 16 × 16 midpoint rule.
fn floor_picture(size: u32, irradiance: impl Fn(f64, f64) -> f64) -> Vec<f32> {
    let mut values = Vec::new();
    for mean in pixel_averages(size, 1.0, irradiance) {
        values.extend(FLOOR.to_array().map(|rho| (f64::from(rho) * mean / PI) as f32));
    }
    values
}

/// Irradiance of the floor at (x, z), W·m⁻².
type Irradiance<'a> = Box<dyn Fn(f64, f64) -> f64 + 'a>;

#[test]
fn point_spot_and_directional_lights_follow_their_laws() {
    with_gpu(|gpu| {
        let place = DVec3::new(0.4, 1.5, -0.3);
        let position = place.as_vec3();
        let axis = DVec3::new(-0.2, -1.0, 0.1).normalize();
        let (inner, outer) = (0.2f32, 0.6f32);
        let square = |x: f64, z: f64| {
            let to = place - DVec3::new(x, 0.0, z);
            let r = to.length();
            (to.y / r.powi(3), axis.dot(-to / r))
        };
        let falloff = |c: f64| {
            let (inner, outer) = (f64::from(inner).cos(), f64::from(outer).cos());
            ((c - outer) / (inner - outer)).clamp(0.0, 1.0).powi(2)
        };
        let intensity = Vec3::splat(3.0);
        let direction = axis.as_vec3();
        let lights: [(&str, LightKind, Irradiance<'_>); 3] = [
            (
                "point",
                LightKind::Point { position, intensity },
                Box::new(|x, z| 3.0 * square(x, z).0),
            ),
            (
                "spot",
                LightKind::Spot {
                    position,
                    direction,
                    intensity,
                    inner,
                    outer,
                },
                Box::new(|x, z| {
                    let (cos_over_square, c) = square(x, z);
                    3.0 * cos_over_square * falloff(c)
                }),
            ),
            (
                "directional",
                LightKind::Directional {
                    direction,
                    irradiance: intensity,
                },
                Box::new(|_, _| 3.0 * -axis.y),
            ),
        ];
        for (name, kind, irradiance) in lights {
            let mut scene = lambert_floor();
            scene.add_light(name, kind);
            let picture = render(gpu, &scene, SMALL, 256, &independent());
            picture.expect_values(name, &floor_picture(16, irradiance));
        }
    });
}

#[test]
fn lights_are_chosen_in_the_end_as_often_as_their_weights_say() {
    with_gpu(|gpu| {
        // Three point lights of very different power and a directional one: the sum of their laws.
        let mut scene = lambert_floor();
        let places = [
            (Vec3::new(0.4, 1.5, -0.3), 3.0f32),
            (Vec3::new(-0.8, 0.7, 0.9), 0.05),
            (Vec3::new(0.0, 5.0, 0.0), 40.0),
        ];
        for (position, strength) in places {
            scene.add_light(
                "point",
                LightKind::Point {
                    position,
                    intensity: Vec3::splat(strength),
                },
            );
        }
        scene.add_light(
            "sun",
            LightKind::Directional {
                direction: Vec3::NEG_Y,
                irradiance: Vec3::splat(0.5),
            },
        );
        let picture = render(gpu, &scene, SMALL, 1024, &independent());
        let irradiance = |x: f64, z: f64| {
            let of = |(position, strength): (Vec3, f32)| {
                let to = position.as_dvec3() - DVec3::new(x, 0.0, z);
                f64::from(strength) * to.y / to.length().powi(3)
            };
            places.into_iter().map(of).sum::<f64>() + 0.5
        };
        picture.expect_values("four lights", &floor_picture(16, irradiance));
    });
}

// The flux of a sun and a sky grows with the square of the scene's size, what they add to a picture does not.
#[test]
fn noise_of_a_lamp_under_a_sky_does_not_grow_with_the_scene() {
    with_gpu(|gpu| {
        let variance_with_triangle_at = |place: f32| {
            let mut scene = lambert_floor();
            scene.environment = Some(Environment::uniform(Vec3::splat(0.1)));
            scene.add_light(
                "sun",
                LightKind::Directional {
                    direction: Vec3::NEG_Y,
                    irradiance: Vec3::splat(0.1),
                },
            );
            scene.add_light(
                "lamp",
                LightKind::Point {
                    position: Vec3::Y,
                    intensity: Vec3::ONE,
                },
            );
            scene.place(Mesh {
                name: "far".into(),
                positions: [Vec3::ZERO, Vec3::X, Vec3::Z].map(|corner| corner + place).to_vec(),
                triangles: vec![[0, 1, 2]],
                material: Some(0),
                ..Mesh::default()
            });
            let picture = render(gpu, &scene, SMALL, 64, &independent());
            picture.variance.iter().map(|v| f64::from(*v)).sum::<f64>()
        };
        let (near, far) = (variance_with_triangle_at(20.0), variance_with_triangle_at(2000.0));
        assert!(
            (near..1.5 * near).contains(&far) || (far..1.5 * far).contains(&near),
            "{near} {far}"
        );
    });
}

#[test]
fn environments_light_a_plane_by_their_cosine_integral() {
    with_gpu(|gpu| {
        let mut scene = lambert_floor();
        scene.environment = Some(Environment::uniform(Vec3::splat(0.8)));
        let picture = render(gpu, &scene, SMALL, 256, &independent());
        picture.expect_values("constant", &floor_picture(16, |_, _| 0.8 * PI));

        // Radiance by height only: rows 1, 0, 3, 0.5, 7 … interpolated linearly between their middles.
        let rows = [1.0f32, 0.0, 3.0, 0.5, 7.0, 7.0, 7.0, 7.0];
        scene.environment = Some(Environment {
            name: "rows".into(),
            width: 4,
            height: 8,
            radiance: rows.iter().flat_map(|v| [Vec3::splat(*v); 4]).collect(),
            rotation: Quat::from_rotation_y(0.7),
            strength: 0.5,
        });
        let radiance = |theta: f64| {
            let p = (theta / PI * 8.0 - 0.5).clamp(0.0, 7.0);
            let i = (p as usize).min(6);
            let w = p - i as f64;
            0.5 * (f64::from(rows[i]) * (1.0 - w) + f64::from(rows[i + 1]) * w)
        };
        let n = 100_000;
        let irradiance: f64 = (0..n)
            .map(|i| {
                let theta = 0.5 * PI * (f64::from(i) + 0.5) / f64::from(n);
                radiance(theta) * theta.cos() * theta.sin() * PI * PI / f64::from(n)
            })
            .sum();
        let picture = render(gpu, &scene, SMALL, 256, &independent());
        picture.expect_values("rows", &floor_picture(16, |_, _| irradiance));

        // Light sampling that chooses the environment in a part of its choices alone.
        let (height, intensity) = (1.5f32, 3.0f32);
        scene.add_light(
            "point",
            LightKind::Point {
                position: height * Vec3::Y,
                intensity: Vec3::splat(intensity),
            },
        );
        let law = |x: f64, z: f64| {
            let height = f64::from(height);
            irradiance + f64::from(intensity) * height / (x * x + z * z + height * height).powf(1.5)
        };
        let picture = render(gpu, &scene, SMALL, 256, &independent());
        picture.expect_values("rows and a point", &floor_picture(16, law));

        // Of a small bright part of the sky, which scattered rays hardly meet, a point that shines on nothing seen takes choices.
        let mut radiance = vec![Vec3::splat(0.05); 32 * 16];
        radiance[4 * 32 + 9] = Vec3::splat(300.0);
        scene.environment = Some(Environment {
            name: "sun".into(),
            width: 32,
            height: 16,
            radiance,
            ..Environment::uniform(Vec3::ONE)
        });
        scene.lights[0].kind = LightKind::Point {
            position: -height * Vec3::Y,
            intensity: Vec3::splat(10.0 * intensity),
        };
        let both = render(gpu, &scene, SMALL, 256, &independent());
        scene.lights.clear();
        let other_seed = PathTracerSettings {
            seed: 71,
            ..independent()
        };
        let alone = render(gpu, &scene, SMALL, 256, &other_seed);
        both.expect_same_as("sun and a point below", &alone.radiance, &alone.variance);
    });
}

/// A slab of the given material between the camera and a lamp, or a lamp behind the camera; only one face of the lamp shines.
fn slab_before_lamp(material: Material, thickness: f32, behind_camera: bool) -> Scene {
    let mut scene = Scene {
        name: "slab".into(),
        ..Scene::default()
    };
    let glass = scene.add_material(material);
    if thickness > 0.0 {
        let mut slab = floor("slab", glass, 4.0, 0.0);
        let low = floor("slab", glass, 4.0, -thickness);
        slab.positions.extend(low.positions);
        slab.triangles.extend([[4, 6, 5], [4, 7, 6]]);
        for i in 0..4 {
            let j = (i + 1) % 4;
            slab.triangles.extend([[i, 4 + i, 4 + j], [i, 4 + j, j]]);
        }
        scene.place(slab);
    } else {
        scene.place(floor("pane", glass, 4.0, 0.0));
    }
    let mut lamp = Material::lambert("lamp", Vec3::ZERO);
    lamp.emission = Vec3::new(1.0, 2.0, 3.0);
    let lamp = scene.add_material(lamp);
    scene.place(floor("lamp", lamp, 40.0, if behind_camera { 20.0 } else { -20.0 }));
    scene.cameras.push(camera_down(1.0, 10.0));
    scene
}

#[test]
fn smooth_slabs_transmit_and_reflect_in_closed_form() {
    with_gpu(|gpu| {
        let thickness = 0.1f32;
        let colors = Vec3::new(1.0, 0.5, 0.1);
        let solid = Material {
            attenuation_color: colors,
            attenuation_distance: 0.2,
            ..Material::glass("slab", 1.5)
        };
        let r = 0.04f64;
        // Transmittance of one passage.
        let a = colors.to_array().map(|c| f64::from(c).powf(0.5));
        let lamp = [1.0, 2.0, 3.0];
        let through = [0, 1, 2].map(|c| lamp[c] * (1.0 - r).powi(2) * a[c] / (1.0 - (r * a[c]).powi(2)));
        let back = [0, 1, 2].map(|c| lamp[c] * (r + r * ((1.0 - r) * a[c]).powi(2) / (1.0 - (r * a[c]).powi(2))));
        // The clear channel's (1 − R)/(1 + R) and 2R/(1 + R).
        assert!((through[0] - (1.0 - r) / (1.0 + r)).abs() < 1e-12 && (back[0] - 2.0 * r / (1.0 + r)).abs() < 1e-12);
        let settings = independent();
        for (what, behind, expected) in [("transmittance", false, through), ("reflectance", true, back)] {
            let scene = slab_before_lamp(solid.clone(), thickness, behind);
            render(gpu, &scene, SMALL, 1024, &settings).expect_uniform(what, expected, 0.0);
        }
        // A thin wall has one interface: R and 1 − R. Its scene counts in an absorbing solid of no area, so kernels are shared.
        for (what, behind, share) in [("thin, through", false, 1.0 - r), ("thin, back", true, r)] {
            let wall = Material {
                thickness: 0.0,
                ..Material::glass("wall", 1.5)
            };
            let mut scene = slab_before_lamp(wall, 0.0, behind);
            point_triangle(&mut scene, solid.clone(), Vec3::ZERO);
            render(gpu, &scene, SMALL, 1024, &settings).expect_uniform(what, lamp.map(|l| l * share), 0.0);
        }
    });
}

/// A flat floor meets the light of a uniform sky once: its picture is the albedo, as quadrature of the published lobe has it.
#[test]
fn phong_floors_under_a_sky_have_their_albedo() {
    with_gpu(|gpu| {
        let (share, exponent) = (0.7f32, 3.0f32);
        for cosine in [1.0f64, 0.25] {
            let mut scene = lambert_floor();
            scene.materials[0] = Material::phong("floor", FLOOR, share, exponent);
            scene.environment = Some(Environment::uniform(Vec3::ONE));
            let sine = (1.0 - cosine * cosine).sqrt();
            let wo = DVec3::new(sine, 0.0, cosine);
            scene.cameras[0] = orthographic(10.0 * DVec3::new(sine, cosine, 0.0), DVec3::ZERO, DVec3::Z, 0.5);
            let (n, mut lobe) = (256u32, 0.0);
            for i in 0..n * n {
                let u = (DVec2::new(f64::from(i % n), f64::from(i / n)) + 0.5) / f64::from(n);
                let wi = square_to_cosine_hemisphere(u);
                lobe += phong_eval(DVec3::ONE, f64::from(exponent), wo, wi).x * PI / wi.z;
            }
            let lobe = lobe / f64::from(n * n);
            // All light from above; at a quarter of the cosine the floor's edge cuts off much of the lobe.
            assert!(
                if cosine == 1.0 {
                    (lobe - 1.0).abs() < 1e-3
                } else {
                    lobe < 0.8
                },
                "{lobe}"
            );
            let albedo = FLOOR
                .to_array()
                .map(|rho| f64::from(rho) * (f64::from(share) * lobe + 1.0 - f64::from(share)));
            let picture = render(gpu, &scene, SMALL, 512, &independent());
            picture.expect_uniform(&format!("cosine {cosine}"), albedo, 0.0);
        }
    });
}

/// A smooth metal floor under a uniform sky shows its Fresnel factor, in the form that the material names; a rough one of classical microfacets the albedo
/// that the f64 twin has.
#[test]
fn metal_floors_under_a_sky_reflect_by_the_form_they_name() {
    with_gpu(|gpu| {
        let copper = metals::by_name("copper").expect("metal");
        let cosine = 0.15f64;
        let sine = (1.0 - cosine * cosine).sqrt();
        let floor_of = |material: Material| {
            let mut scene = lambert_floor();
            scene.materials[0] = Material {
                conductor: Some(copper),
                ..material
            };
            scene.environment = Some(Environment::uniform(Vec3::ONE));
            scene.cameras[0] = orthographic(10.0 * DVec3::new(sine, cosine, 0.0), DVec3::ZERO, DVec3::Z, 0.2);
            scene
        };
        let mut shown: Vec<DVec3> = Vec::new();
        for fresnel in FresnelForm::ALL {
            let scene = floor_of(Material {
                fresnel,
                ..Material::mirror("floor", Vec3::ONE)
            });
            let expected = MetalFresnel::new(fresnel, copper.eta.as_dvec3(), copper.k.as_dvec3()).at(cosine);
            let picture = render(gpu, &scene, SMALL, 4, &independent());
            picture.expect_uniform(fresnel.name(), expected.to_array(), 1e-5);
            shown.push(expected);
        }
        // They can be told apart, but for the two that are matched at one place.
        let least = shown[1..4]
            .iter()
            .map(|f| (*f - shown[0]).abs().max_element())
            .fold(1.0, f64::min);
        assert!(least > 1e-4, "{shown:?}");
        for (distribution, geometry) in [
            (Distribution::Ggx, Geometry::Simplified),
            (Distribution::Beckmann, Geometry::CookTorrance),
            (Distribution::CosineLobe, Geometry::Simplified),
            (Distribution::Beckmann, Geometry::Smith),
        ] {
            let scene = floor_of(Material {
                roughness: 0.6,
                classic_microfacets: Some(Microfacets { distribution, geometry }),
                ..Material::mirror("floor", Vec3::ONE)
            });
            let b = Bsdf::from_material(&scene.materials[0]);
            let context = BsdfContext {
                features: BsdfFeatures::ALL,
                table: AlbedoTable::shared(),
            };
            let (n, mut albedo) = (512u32, DVec3::ZERO);
            for i in 0..n * n {
                let u = (DVec2::new(f64::from(i % n), f64::from(i / n)) + 0.5) / f64::from(n);
                let sample = bsdf_sample(&context, &b, DVec3::new(sine, 0.0, cosine), u.extend(0.5), LOBE_ALL);
                albedo += sample.weight / f64::from(n * n);
            }
            let picture = render(gpu, &scene, SMALL, 512, &independent());
            picture.expect_uniform(&format!("{distribution:?}, {geometry:?}"), albedo.to_array(), 1e-3);
        }
    });
}

/// A metal that a sidecar describes by a reflectance and an edge tint shows its reflectance to who looks straight down, aslant the exact factor of its n and k, and
/// gives the bits of the picture that these give.
#[test]
fn metals_by_two_colours_show_their_reflectance_and_are_exact() {
    with_gpu(|gpu| {
        let colors = [[0.95f32, 0.64, 0.54], [0.9, 0.4, 0.0]];
        let floor_of = |metal: &str, roughness: f32| {
            let mut scene = lambert_floor();
            scene.materials[0] = Material {
                roughness,
                ..Material::mirror("floor", Vec3::ONE)
            };
            scene.environment = Some(Environment::uniform(Vec3::ONE));
            let sidecar = Sidecar::parse(&format!("[metals]\nfloor = {metal}\n"), Path::new("floor.scene.toml"));
            sidecar.unwrap().apply(&mut scene).unwrap();
            scene
        };
        let seen_at = |mut scene: Scene, cosine: f64| {
            let sine = (1.0 - cosine * cosine).sqrt();
            scene.cameras[0] = orthographic(10.0 * DVec3::new(sine, cosine, 0.0), DVec3::ZERO, DVec3::Z, 0.2);
            render(gpu, &scene, SMALL, 4, &independent())
        };
        let by_colors = format!("{{ reflectance = {:?}, edge_tint = {:?} }}", colors[0], colors[1]);
        let [eta, k] = artistic_index(Vec3::from(colors[0]).as_dvec3(), Vec3::from(colors[1]).as_dvec3());
        let smooth = floor_of(&by_colors, 0.0);
        let down = seen_at(smooth.clone(), 1.0);
        for (shown, expected) in down.mean().into_iter().zip(colors[0]) {
            assert!((shown.0 - f64::from(expected)).abs() < 1e-6, "{} {expected}", shown.0);
        }
        let aslant = seen_at(smooth, 0.15);
        aslant.expect_uniform("aslant", fresnel_conductor(0.15, eta, k).to_array(), 1e-5);
        // TOML reads what Rust writes of an f32.
        let [eta, k] = [eta, k].map(|part| part.as_vec3().to_array());
        let by_index = format!("{{ eta = {eta:?}, k = {k:?} }}");
        let [rough, of_index] = [by_colors, by_index].map(|metal| seen_at(floor_of(&metal, 0.6), 0.5));
        assert_eq!(rough.bits(), of_index.bits());
    });
}

/// Two metals by tables, and one whose index is that of the first, side by side: each shows its own factor, and an exact metal between them what it shows without
/// tables in the scene.
#[test]
fn metals_by_tables_have_each_their_own() {
    with_gpu(|gpu| {
        let named = |name: &str| metals::by_name(name).expect("metal");
        let cosine = 0.4f64;
        let sine = (1.0 - cosine * cosine).sqrt();
        let shown = |fresnel: FresnelForm, seen: usize| {
            let mut scene = Scene::default();
            let kinds = [
                ("silver", fresnel),
                ("copper", FresnelForm::Exact),
                ("gold", fresnel),
                ("silver", fresnel),
            ];
            for (place, (name, fresnel)) in (0u8..).zip(kinds) {
                let material = scene.add_material(Material {
                    conductor: Some(named(name)),
                    fresnel,
                    ..Material::mirror(name, Vec3::ONE)
                });
                let mut plate = floor(name, material, 1.0, 0.0);
                for corner in &mut plate.positions {
                    corner.z += 2.0 * f32::from(place);
                }
                scene.place(plate);
            }
            scene.environment = Some(Environment::uniform(Vec3::ONE));
            let middle = DVec3::Z * (2.0 * seen as f64);
            let eye = middle + 10.0 * DVec3::new(sine, cosine, 0.0);
            scene.cameras.push(orthographic(eye, middle, DVec3::Z, 0.2));
            (kinds[seen], render(gpu, &scene, SMALL, 4, &independent()))
        };
        for seen in 0..4 {
            let ((name, fresnel), picture) = shown(FresnelForm::Table, seen);
            let ior = named(name);
            let factor = MetalFresnel::new(fresnel, ior.eta.as_dvec3(), ior.k.as_dvec3());
            picture.expect_uniform(name, factor.at(cosine).to_array(), 1e-5);
        }
        let [beside, alone] = [FresnelForm::Table, FresnelForm::Exact].map(|fresnel| shown(fresnel, 1).1);
        assert_eq!(beside.bits(), alone.bits());
    });
}

#[test]
fn path_sets_are_a_partition() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:cornell-box");
        let all = render(gpu, &scene, SMALL, 512, &paths("all"));
        let mut radiance = vec![0.0f32; all.radiance.len()];
        let mut variance = radiance.clone();
        for (i, part) in ["emitted", "direct", "bounces=2..3", "bounces=4.."]
            .into_iter()
            .enumerate()
        {
            let settings = PathTracerSettings {
                seed: 100 + i as u32,
                ..paths(part)
            };
            let picture = render(gpu, &scene, SMALL, 512, &settings);
            for (sum, value) in radiance
                .iter_mut()
                .zip(&picture.radiance)
                .chain(variance.iter_mut().zip(&picture.variance))
            {
                *sum += value;
            }
        }
        all.expect_same_as("sum of the parts", &radiance, &variance);

        // One bounce in a uniform environment: what the base and what the coat scatter.
        let scene = builtin("builtin:white-furnace?frequency=8&roughness=0.5");
        let whole = render(gpu, &scene, SMALL, 512, &paths("direct"));
        let parts = ["diffuse+reflection", "glossy+reflection"]
            .map(|lobes| render(gpu, &scene, SMALL, 512, &paths(&format!("direct,lobes={lobes}"))));
        let sum = |f: fn(&clerestory_tests::render::Rendered) -> &Vec<f32>| -> Vec<f32> {
            f(&parts[0]).iter().zip(f(&parts[1])).map(|(a, b)| a + b).collect()
        };
        assert!(parts.iter().all(|p| p.mean()[0].0 > 0.01), "both lobes are there");
        whole.expect_same_as("lobes", &sum(|p| &p.radiance), &sum(|p| &p.variance));
    });
}

#[test]
fn unlit_surfaces_show_their_colour_exactly() {
    with_gpu(|gpu| {
        let mut scene = lambert_floor();
        scene.materials[0].unlit = true;
        let picture = finish(&mut tracer(gpu, &scene, SMALL, &independent()), 16);
        picture.expect_sound("unlit", 16);
        for pixel in picture.radiance.chunks(3) {
            assert_eq!(pixel, FLOOR.to_array());
        }
        assert!(picture.variance.iter().all(|v| *v == 0.0));
    });
}

/// A floor and a point light inside an absorbing body that does not refract: exp(−σ (h + r)) of what they are in the clear, with r from
/// the light to the floor and h from there to the body's top, under the camera.
#[test]
fn light_inside_an_absorbing_body_is_absorbed_on_all_of_its_way() {
    with_gpu(|gpu| {
        let place = DVec3::new(0.3, 0.8, -0.2);
        let (sigma, top) = (0.9, 1.25);
        let mut scene = lambert_floor();
        let kind = LightKind::Point {
            position: place.as_vec3(),
            intensity: Vec3::splat(2.0),
        };
        scene.add_light("inside", kind);
        let body = Material {
            attenuation_color: Vec3::splat((-sigma as f32).exp()),
            attenuation_distance: 1.0,
            ..Material::glass("body", 1.0)
        };
        let body = scene.add_material(body);
        let corners = [Vec3::new(-6.0, -0.5, -6.0), Vec3::new(6.0, top as f32, 6.0)];
        scene.place(cuboid("body", body, corners[0], corners[1]));
        let irradiance = |x: f64, z: f64| {
            let to = place - DVec3::new(x, 0.0, z);
            let r = to.length();
            2.0 * to.y / r.powi(3) * (-sigma * (r + top)).exp()
        };
        let picture = render(gpu, &scene, SMALL, 512, &independent());
        picture.expect_values("inside", &floor_picture(16, irradiance));
    });
}

#[test]
fn meshes_without_a_material_have_the_default_one() {
    with_gpu(|gpu| {
        let mut explicit = lambert_floor();
        explicit.environment = Some(Environment::uniform(Vec3::ONE));
        explicit.materials[0] = Material::default();
        let mut none = explicit.clone();
        none.meshes[0].material = None;
        none.materials.clear();
        let settings = independent();
        assert_eq!(
            render(gpu, &none, SMALL, 16, &settings).bits(),
            render(gpu, &explicit, SMALL, 16, &settings).bits()
        );
    });
}
