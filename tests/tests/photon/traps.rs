//! What makes pictures of photon maps plausible and wrong: light through thin walls, around corners and from behind, black glass, blunt caustics,
//! and wrong colours.

use super::*;
use clerestory::scene::Projection;
use clerestory_hard_cases::scenes::orthographic;
use clerestory_tests::render::{builtin, cuboid};
use clerestory_tests::with_gpu;
use glam::DVec3;

/// Adds the inside of a box without the face across x at `open`.
fn add_room(scene: &mut Scene, material: u32, low: Vec3, high: Vec3) {
    let mut mesh = cuboid("room", material, low, high);
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    scene.place(mesh);
}

/// A lit room and a dark one, parted by one sheet across x = 0 alone.
fn rooms() -> Scene {
    let mut scene = Scene {
        name: "rooms".into(),
        ..Scene::default()
    };
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
    add_room(&mut scene, white, Vec3::NEG_ONE, Vec3::ONE);
    let mut wall = upright("wall", white, 0.0, 1.0);
    wall.positions.iter_mut().for_each(|p| p.y = 2.0 * p.y - 1.0);
    scene.place(wall);
    add_point(&mut scene, Vec3::new(0.4, 0.1, 0.2), Vec3::splat(10.0));
    scene
}

fn expect_black(what: &str, picture: &[f32]) {
    assert!(picture.iter().all(|v| *v == 0.0), "{what}: {:?}", sums(picture)[0]);
}

#[test]
fn thin_walls_let_no_photon_through() {
    with_gpu(|gpu| {
        let radius = 0.3;
        for (shape, direct_photons) in [
            (KernelShape::Fixed, false),
            (KernelShape::Fixed, true),
            (KernelShape::Skewed, true),
        ] {
            let settings = PhotonSettings {
                shape,
                direct_photons,
                ..fixed("all", radius)
            };
            let mut scene = rooms();
            scene.cameras = vec![orthographic(DVec3::X * -0.5, DVec3::ZERO, DVec3::Y, 1.0)];
            for pass in 0..2 {
                let landed = mapper(gpu, &scene, &settings).photons(pass);
                let dark = landed.unwrap_or_else(|error| panic!("{error}"));
                let dark: Vec<_> = dark.iter().filter(|p| p.record.position.x < 0.0).collect();
                assert!(dark.is_empty(), "photons in the dark: {dark:?}");
            }
            // The sheet from the dark side, its rims too; then from the lit side.
            scene.cameras = vec![orthographic(DVec3::X * -0.5, DVec3::ZERO, DVec3::Y, 1.0)];
            expect_black("the wall", &photons(gpu, &scene, &settings, 2));
            scene.cameras = vec![orthographic(DVec3::X * 0.3, DVec3::ZERO, DVec3::Y, 1.0)];
            assert!(
                sums(&photons(gpu, &scene, &settings, 2))[0]
                    .iter()
                    .all(|sum| *sum > 1.0)
            );
            // The dark room's floor, ceiling and walls, off the sheet by more than a kernel.
            // A skewed ellipse reaches beyond its axes where these are nearly parallel.
            let off = f64::from(radius) * if shape == KernelShape::Skewed { 2f64.sqrt() } else { 1.0 };
            for (what, eye, target, up) in [
                ("floor", DVec3::new(-0.5 - 0.5 * off, 0.0, 0.0), DVec3::NEG_Y, DVec3::X),
                ("side", DVec3::new(-0.5 - 0.5 * off, 0.0, 0.0), DVec3::Z, DVec3::Y),
            ] {
                scene.cameras = vec![orthographic(eye, eye + target, up, (0.5 - 0.5 * off) as f32)];
                expect_black(what, &photons(gpu, &scene, &settings, 2));
            }
        }
    });
}

#[test]
fn kernels_reach_under_walls_as_far_as_they_are_wide() {
    with_gpu(|gpu| {
        // The known defect of kernels without visibility: photons of the lit floor count on the dark one, in its plane, up to the kernel's radius.
        // What comes through is less than half of what the lit side has at the wall, and shrinks with the kernel.
        let leak = |radius: f32| {
            let mut scene = rooms();
            let eye = DVec3::new(-0.2, 0.0, 0.0);
            scene.cameras = vec![orthographic(eye, eye - DVec3::Y, DVec3::X, 0.2)];
            let dark = sums(&photons(gpu, &scene, &fixed("indirect", radius), 8))[0][0];
            let eye = DVec3::new(0.2, 0.0, 0.0);
            scene.cameras = vec![orthographic(eye, eye - DVec3::Y, DVec3::X, 0.2)];
            dark / sums(&photons(gpu, &scene, &fixed("indirect", radius), 8))[0][0]
        };
        let (wide, narrow) = (leak(0.2), leak(0.1));
        println!("leaks: {wide}, {narrow}");
        // Of a band of 0.4 m with even light beside it: h · 8/(15 π), by the integral of the kernel beyond a chord.
        let share = |radius: f64| radius * 8.0 / (15.0 * PI) / 0.4;
        assert!(wide > 0.0 && wide < 2.0 * share(0.2), "{wide}");
        assert!(narrow > 0.0 && narrow < 2.0 * share(0.1), "{narrow}");
    });
}

#[test]
fn photons_around_a_corner_do_not_count() {
    with_gpu(|gpu| {
        // The upper face of a block right at its edge, lit from the side alone.
        let mut scene = Scene {
            name: "block".into(),
            ..Scene::default()
        };
        let white = scene.add_material(Material::lambert("white", Vec3::splat(0.8)));
        scene.place(cuboid("block", white, Vec3::NEG_ONE, Vec3::new(0.0, 0.0, 1.0)));
        scene.add_light(
            "sun",
            LightKind::Directional {
                direction: Vec3::NEG_X,
                irradiance: Vec3::ONE,
            },
        );
        let down =
            |x: f64, half: f32| orthographic(DVec3::new(x, 1.0, 0.0), DVec3::new(x, 0.0, 0.0), DVec3::NEG_Z, half);
        let settings = PhotonSettings {
            direct_photons: true,
            ..fixed("all", 0.2)
        };
        scene.cameras = vec![down(-0.2, 0.2)];
        expect_black("the upper face", &photons(gpu, &scene, &settings, 2));
        scene.cameras = vec![orthographic(
            DVec3::new(1.0, -0.5, 0.0),
            DVec3::new(0.0, -0.5, 0.0),
            DVec3::Y,
            0.2,
        )];
        means(gpu, &scene, &settings, 16).expect_uniform("the lit face", 0.8 / PI, 1e-6);
    });
}

#[test]
fn glass_is_not_black() {
    with_gpu(|gpu| {
        // A sphere of glass in a room with a point light: all that is seen through it, and its caustic, is the map's or the eye's by turns.
        let scene = builtin("builtin:cornell-box?sphere=glass&boxes=none");
        let mut scene = scene;
        let glass = scene.meshes.iter().position(|mesh| mesh.name.contains("sphere"));
        let sphere = glass.map(|i| &scene.meshes[i]).unwrap_or_else(|| panic!("no sphere"));
        let middle = sphere.positions.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / sphere.positions.len() as f64;
        // Straight at the sphere, within its outline.
        scene.cameras = vec![orthographic(middle - DVec3::Z * 0.16, middle, DVec3::Y, 0.05)];
        let settings = PhotonSettings {
            photons: 1 << 14,
            ..fixed("all", 0.01)
        };
        // Kernels of 1 cm blur the walls' light behind glass, which bends by less than 100 E a square metre.
        let bias = 1e-4 / 12.0 * 100.0;
        expect_agreement(gpu, &scene, &settings, [16, 512], [bias; 3]);
    });
}

#[test]
fn the_ring_has_its_cusp_where_geometry_puts_it() {
    with_gpu(|gpu| {
        let mut scene = builtin("builtin:ring?segments=256");
        // Seen in plan, a mirror of radius R reflects light from a distance s off its far side to R s / (2 s − R): the cusp of its caustic.
        let (radius, light) = (0.8, 1.7);
        let distance = light + radius;
        let cusp = radius * distance / (2.0 * distance - radius) - radius;
        let half = 0.25;
        let eye = DVec3::new(cusp, 1.0, 0.0);
        scene.cameras = vec![orthographic(eye, eye - DVec3::Y, DVec3::NEG_Z, half as f32)];
        let settings = PhotonSettings {
            photons: 1 << 16,
            ..fixed("bounces=2..2", 0.015)
        };
        let picture = photons(gpu, &scene, &settings, 6);
        let pixel = 2.0 * half / f64::from(SIDE);
        let at = |x: usize, y: usize| f64::from(picture[3 * (y * SIDE as usize + x)]);
        let centre = |i: usize| (i as f64 + 0.5) * pixel - half;
        // The brightest pixel lies beside the axis, at the cusp or just behind it, where both branches are within a kernel of each other.
        let brightest = (0..picture.len() / 3)
            .max_by(|a, b| picture[3 * a].total_cmp(&picture[3 * b]))
            .unwrap_or(0);
        let (x, y) = (brightest % SIDE as usize, brightest / SIDE as usize);
        println!(
            "cusp at x = {cusp:.3}; brightest {:.3} from it along x, {:.3} across",
            centre(x),
            centre(y)
        );
        assert!(centre(x).abs() < 2.0 * pixel && centre(y).abs() < 1.5 * pixel);
        // Inside of the branches it is brighter than outside; both sides of the axis are alike.
        let mean = |xs: std::ops::Range<usize>, ys: std::ops::Range<usize>| {
            let n = (xs.len() * ys.len()) as f64;
            ys.map(|y| xs.clone().map(|x| at(x, y)).sum::<f64>()).sum::<f64>() / n
        };
        let (upper, lower) = (mean(0..16, 0..8), mean(0..16, 8..16));
        println!(
            "halves {upper:.4}, {lower:.4}; left {:.4}, right {:.4}",
            mean(0..6, 6..10),
            mean(10..16, 6..10)
        );
        assert!((upper / lower - 1.0).abs() < 0.1, "{upper} {lower}");
        assert!(at(x, y) > 3.0 * mean(0..16, 0..16), "no peak");
    });
}

#[test]
fn colours_bleed_through_the_passage_as_they_should() {
    with_gpu(|gpu| {
        let mut scene = builtin("builtin:passage?width=0.5&length=0.1");
        if let Projection::Perspective { fov_y } = &mut scene.cameras[0].projection {
            *fov_y *= 0.8;
        }
        let settings = PhotonSettings {
            photons: 1 << 14,
            ..fixed("bounces=2..4", 0.03)
        };
        // Kernels of 3 cm lose up to 4/(15 π) of their width at each of the room's edges, at most ten metres of them in view of a square metre.
        let edges = 0.03 * 8.0 / (15.0 * PI) * 10.0;
        let found = means(gpu, &scene, &settings, 16);
        let reference = traced(gpu, &scene, "bounces=2..4", 1024);
        found.expect_same_as("passage", &reference, [edges; 3]);
        let [red, green, _] = found.parts[0];
        let [(r, _), (g, _), _] = reference.mean();
        println!(
            "red over green: {:.3}, of the path tracer {:.3}",
            red.value / green.value,
            r / g
        );
        assert!(red.value / green.value > 1.2 && (red.value / green.value * g / r - 1.0).abs() < 0.05);
    });
}
