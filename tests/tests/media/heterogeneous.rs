//! Density grids against closed forms and against homogeneous media.

use clerestory::scene::Environment;
use clerestory_tests::render::{independent, paths};
use clerestory_tests::with_gpu;
use glam::DAffine3;

use super::*;

const LOW: Vec3 = Vec3::new(-1.0, -1.0, -1.0);
const HIGH: Vec3 = Vec3::new(1.0, 1.0, 1.0);

#[test]
fn gradients_attenuate_by_their_integral() {
    with_gpu(|gpu| {
        // Densities rise linearly from cell to cell; interpolation keeps their mean along the axis, however many cells a block of
        // majorants has. The eye's rays go by ratio tracking, and so do shadow rays.
        let thin = [0.25, 1.0, 2.0];
        // Which few rays pass is decided by roulette.
        let thick = [2.0, 2.5, 3.0];
        for (cells, sigma_a) in [(1u32, thin), (2, thin), (7, thin), (40, thin), (7, thick)] {
            let grid = layers(cells, LOW, HIGH, |y| 2.0 * y);
            let absorber = Medium {
                sigma_a: Vec3::from_array(sigma_a),
                density: Some(grid),
                ..Medium::default()
            };
            let expected = sigma_a.map(|s| (-2.0 * f64::from(s)).exp());
            let mut scene = Scene {
                environment: Some(Environment::uniform(Vec3::ONE)),
                ..Scene::default()
            };
            add_box(&mut scene, absorber.clone(), LOW, HIGH);
            scene
                .cameras
                .push(ray_camera(DVec3::new(0.21, 5.0, 0.13), DVec3::NEG_Y));
            let picture = render(gpu, &scene, [16, 16], 256, &independent());
            for (c, (mean, variance)) in picture.mean().into_iter().enumerate() {
                report(
                    &format!("gradient of {cells} cells, band {c}"),
                    mean,
                    variance,
                    expected[c],
                );
                expect_mean("gradient", mean, variance, expected[c], 1e-5 * expected[c]);
            }
            let mut lit = Scene::default();
            let white = lit.add_material(Material::lambert("white", Vec3::ONE));
            lit.place(clerestory_tests::render::floor("floor", white, 3.0, -1.5));
            add_box(&mut lit, absorber, LOW, HIGH);
            let (direction, irradiance) = (Vec3::NEG_Y, Vec3::splat(PI as f32));
            lit.add_light("sun", LightKind::Directional { direction, irradiance });
            lit.cameras.push(ray_camera(DVec3::new(0.21, -1.2, 0.13), DVec3::NEG_Y));
            let picture = render(gpu, &lit, [16, 16], 256, &independent());
            for (c, (mean, variance)) in picture.mean().into_iter().enumerate() {
                report(
                    &format!("shadow of {cells} cells, band {c}"),
                    mean,
                    variance,
                    expected[c],
                );
                expect_mean("shadow", mean, variance, expected[c], 1e-5 * expected[c]);
            }
        }
    });
}

#[test]
fn walks_longer_than_a_dispatch_go_on() {
    with_gpu(|gpu| {
        // The blue band makes six thousand tentative collisions of the way, three times as many as a dispatch has.
        let sigma = [0.1f32, 1.0, 3000.0];
        let medium = Medium {
            sigma_a: Vec3::from(sigma),
            density: Some(layers(20, LOW, HIGH, |_| 1.0)),
            ..Medium::default()
        };
        let expected = sigma.map(|s| (-2.0 * f64::from(s)).exp());
        let mut scene = Scene {
            environment: Some(Environment::uniform(Vec3::ONE)),
            ..Scene::default()
        };
        add_box(&mut scene, medium, LOW, HIGH);
        scene
            .cameras
            .push(ray_camera(DVec3::new(0.21, 5.0, 0.13), DVec3::NEG_Y));
        let seen = render(gpu, &scene, [8, 8], 8, &independent());
        scene.environment = None;
        let white = scene.add_material(Material::lambert("white", Vec3::ONE));
        scene.place(clerestory_tests::render::floor("floor", white, 3.0, -1.5));
        let (direction, irradiance) = (Vec3::NEG_Y, Vec3::splat(PI as f32));
        scene.add_light("sun", LightKind::Directional { direction, irradiance });
        scene.cameras[0] = ray_camera(DVec3::new(0.21, -1.2, 0.13), DVec3::NEG_Y);
        let lit = render(gpu, &scene, [8, 8], 8, &independent());
        for (what, picture) in [("seen", &seen), ("lit", &lit)] {
            for (c, (mean, variance)) in picture.mean().into_iter().enumerate().take(2) {
                report(&format!("long walks, {what}, band {c}"), mean, variance, expected[c]);
                // Six thousand products of f32.
                expect_mean(what, mean, variance, expected[c], 6000.0 * 6e-8 * expected[c]);
            }
            assert_eq!(picture.mean()[2].0, 0.0);
        }
        assert!(seen.counters.density_lookups > 64 * 8 * 5000 && lit.counters.stalls > 0);
    });
}

#[test]
fn walks_get_on_however_far_the_grid() {
    with_gpu(|gpu| {
        // Free paths of the majorant are 10⁻⁶ m, where distances of a kilometre are rounded to 6·10⁻⁵ m.
        let sigma = [0.0f32, 20.0, 1e6];
        let (low, high) = (Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 0.01, 1.0));
        let mut scene = Scene {
            environment: Some(Environment::uniform(Vec3::ONE)),
            ..Scene::default()
        };
        let absorber = Medium {
            sigma_a: Vec3::from(sigma),
            density: Some(layers(2, low, high, |_| 1.0)),
            ..Medium::default()
        };
        add_box(&mut scene, absorber, low, high);
        scene
            .cameras
            .push(ray_camera(DVec3::new(0.21, 1000.0, 0.13), DVec3::NEG_Y));
        let picture = render(gpu, &scene, [4, 4], 4, &independent());
        // Each place where a round begins, five in all, and both ends of the way are wrong by half a rounding unit; ten thousand products.
        let bias = 7.0 * 3e-5 * 20.0 + 1e4 * 6e-8;
        for (c, (mean, variance)) in picture.mean().into_iter().enumerate().take(2) {
            let expected = (-0.01 * f64::from(sigma[c])).exp();
            report(&format!("far grid, band {c}"), mean, variance, expected);
            expect_mean("far grid", mean, variance, expected, bias * expected);
        }
        assert_eq!(picture.mean()[2].0, 0.0);
        assert!(picture.counters.density_lookups > 16 * 4 * 9000);
    });
}

/// A box of a medium in the light of a point, a spot and the sky.
fn lit_box(medium: Medium) -> Scene {
    let mut scene = Scene {
        environment: Some(Environment::uniform(Vec3::splat(0.1))),
        ..Scene::default()
    };
    add_box(&mut scene, medium, LOW, HIGH);
    add_point(&mut scene, Vec3::new(0.2, 0.3, -0.1));
    scene.add_light(
        "spot",
        LightKind::Spot {
            position: Vec3::new(0.0, 3.0, 0.0),
            direction: Vec3::NEG_Y,
            intensity: Vec3::splat(0.5),
            inner: 0.1,
            outer: 0.3,
        },
    );
    let eye = DVec3::new(2.0, 2.5, 4.0);
    scene
        .cameras
        .push(Camera::look_at("main", eye, DVec3::ZERO, DVec3::Y, 0.5));
    scene
}

#[test]
fn constant_grids_are_homogeneous_media() {
    with_gpu(|gpu| {
        let plain = medium(1.5, 0.9, Phase::HenyeyGreenstein { g: 0.3 });
        let truth = render(gpu, &lit_box(plain.clone()), [16, 16], 256, &independent());
        for (what, values, turn, size) in [
            ("tight majorant", 1.0, 0.0, [5, 5, 5]),
            ("turned by 37°", 1.0, 37.0f64, [7, 3, 33]),
        ] {
            let mut grid = DensityGrid::from_fn(size, |_| values);
            // A turned grid has to reach beyond the box.
            let reach = if turn == 0.0 { 2.0 } else { 4.0 };
            grid.to_world = DAffine3::from_rotation_y(turn.to_radians())
                * DAffine3::from_scale(DVec3::splat(reach))
                * DAffine3::from_translation(DVec3::splat(-0.5));
            let scene = lit_box(Medium {
                density: Some(grid),
                ..plain.clone()
            });
            let picture = render(
                gpu,
                &scene,
                [16, 16],
                256,
                &PathTracerSettings {
                    seed: 8,
                    ..independent()
                },
            );
            picture.expect_same_as(what, &truth.radiance, &truth.variance);
            assert!(picture.counters.density_lookups > picture.counters.medium_collisions);
            assert_eq!(picture.counters.null_collisions, 0, "{what}");
        }
    });
}

#[test]
fn layered_slabs_depend_on_their_optical_depth_alone() {
    with_gpu(|gpu| {
        // σt(y) = 2 T y over a thickness of 1, T = 2 and c = 0.9: the radiance of the homogeneous slab.
        let (low, high) = (Vec3::new(-40.0, 0.0, -40.0), Vec3::new(40.0, 1.0, 40.0));
        let mut layered = medium(2.0, 0.9, Phase::Isotropic);
        layered.density = Some(layers(50, low, high, |y| 2.0 * y));
        let mut scene = Scene::default();
        add_box(&mut scene, layered, low, high);
        let (direction, irradiance) = (Vec3::NEG_Y, Vec3::ONE);
        scene.add_light("beam", LightKind::Directional { direction, irradiance });
        for (what, eye, forward, expected) in [
            ("lit", DVec3::new(0.21, 2.0, 0.13), DVec3::NEG_Y, 0.100411),
            ("far", DVec3::new(0.21, -1.0, 0.13), DVec3::Y, 0.072819),
        ] {
            scene.cameras = vec![ray_camera(eye, forward)];
            let picture = render(gpu, &scene, [16, 16], 256, &independent());
            // The tables' digits, and the grid's layers of 1/50: their steps at the faces, 1/100 of the density.
            expect_value(&format!("layered slab, {what} face"), &picture, expected, 1e-4);
        }
    });
}

#[test]
fn emptiness_and_loose_majorants_cost_noise_only() {
    with_gpu(|gpu| {
        // A single dense cell in a corner makes most tentative collisions null.
        let plain = medium(1.0, 0.8, Phase::Isotropic);
        let grid = |peak: f32| {
            DensityGrid::from_fn([16, 16, 16], move |p| {
                let corner = p.min_element() > 0.9;
                if corner {
                    peak
                } else if p.y < 0.5 {
                    0.0
                } else {
                    1.0
                }
            })
            .in_box(LOW.as_dvec3(), HIGH.as_dvec3())
        };
        let scene = |medium: Medium| lit_box(medium);
        let reference = scene(Medium {
            density: Some(grid(1.0)),
            ..plain.clone()
        });
        let truth = render(gpu, &reference, [16, 16], 256, &paths("bounces=0..3"));
        assert!(truth.counters.density_lookups > 0);
        // The same densities once more, cut into a grid of twice the cells along one axis: other blocks, same interpolation at its centres.
        let fine = DensityGrid::from_fn([16, 16, 16], |p| grid(1.0).density_in_cube(p) as f32)
            .in_box(LOW.as_dvec3(), HIGH.as_dvec3());
        let again = scene(Medium {
            density: Some(fine),
            ..plain
        });
        let settings = PathTracerSettings {
            seed: 9,
            ..paths("bounces=0..3")
        };
        let picture = render(gpu, &again, [16, 16], 256, &settings);
        picture.expect_same_as("the same grid", &truth.radiance, &truth.variance);
        let dense = scene(Medium {
            density: Some(grid(500.0)),
            ..medium(1.0, 0.8, Phase::Isotropic)
        });
        let picture = render(gpu, &dense, [16, 16], 16, &settings);
        assert!(picture.counters.null_collisions > 0);
    });
}
