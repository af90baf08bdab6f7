//! Boundaries of media where other surfaces are.

use clerestory::scene::Environment;
use clerestory_tests::render::independent;
use clerestory_tests::with_gpu;

use super::absorption::{absorber, expect_exact};
use super::*;

#[test]
fn surfaces_in_the_plane_of_a_boundary_are_not_skipped() {
    with_gpu(|gpu| {
        // A room whose walls are the boundary of the fog in it, which is placed first; outside it is bright.
        let sigma = [0.0f32, 0.7, 2.5];
        let (low, high) = (Vec3::splat(-1.0), Vec3::ONE);
        let mut scene = Scene {
            environment: Some(Environment::uniform(Vec3::splat(100.0))),
            ..Scene::default()
        };
        add_box(&mut scene, absorber(sigma), low, high);
        let mut wall = Material::lambert("wall", Vec3::ZERO);
        wall.emission = Vec3::ONE;
        let wall = scene.add_material(wall);
        scene.place(cuboid("room", wall, low, high));
        for (axis, depth) in [
            (DVec3::NEG_Y, 1.5),
            (DVec3::Y, 0.5),
            (DVec3::X, 0.79),
            (DVec3::NEG_Z, 1.13),
        ] {
            scene.cameras = vec![ray_camera(DVec3::new(0.21, 0.5, 0.13), axis)];
            let expected = sigma.map(|s| (-f64::from(s) * depth).exp());
            let picture = render(gpu, &scene, [4, 4], 4, &independent());
            expect_exact(&format!("wall along {axis}"), &picture, expected);
        }
        // Nor do shadow rays pass the walls.
        scene.environment = None;
        scene.materials[wall as usize] = Material::lambert("wall", Vec3::splat(0.5));
        add_point(&mut scene, Vec3::new(2.0, 5.0, 1.0));
        scene.cameras = vec![ray_camera(DVec3::new(0.21, 0.5, 0.13), DVec3::NEG_Y)];
        let picture = render(gpu, &scene, [4, 4], 16, &independent());
        assert!(
            picture.radiance.iter().all(|v| *v == 0.0),
            "{:?}",
            &picture.radiance[..3]
        );
    });
}
