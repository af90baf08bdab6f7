//! What virtual lights send on and surfaces take of it, where that is not Lambert's law: leaning normals, panes that are there in part, ink, and every kind of light.

use super::*;
use clerestory::scene::{AlphaMode, Environment, Filter, Image, Mesh, Texture, Wrap};
use clerestory_tests::render::{camera_aslant, camera_down, floor};
use glam::{DVec3, Vec2};

/// An orthographic camera.
fn orthographic(eye: DVec3, target: DVec3, up: DVec3, half_height: f32) -> clerestory::scene::Camera {
    clerestory_hard_cases::scenes::orthographic(eye, target, up, half_height)
}

/// A texture that is the same everywhere but for its columns.
fn columns(scene: &mut Scene, name: &str, texels: [[u8; 4]; 2]) -> Texture {
    let image = scene.add_image(Image {
        name: name.into(),
        width: 2,
        height: 1,
        texels: texels.to_vec(),
    });
    Texture {
        image,
        uv_set: 0,
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Nearest,
        transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    }
}

fn named(name: &str) -> Scene {
    Scene {
        name: name.into(),
        ..Scene::default()
    }
}

/// Under an orthographic camera all ways to first surfaces are equal, and of one walk a pass has one light: the pane is there for half of the passes and places all the same.
#[test]
fn alpha_is_drawn_anew_for_every_place_and_pass() {
    with_gpu(|gpu| {
        let mut scene = builtin("builtin:furnace-box?rho=0.5&emission=0");
        scene.name = "pane".into();
        add_point(&mut scene, Vec3::new(0.2, 0.6, 0.1), Vec3::splat(20.0));
        let pane = scene.add_material(Material {
            base_color: Vec3::splat(0.5).extend(0.5),
            alpha_mode: AlphaMode::Blend,
            ..Material::lambert("pane", Vec3::ONE)
        });
        // One triangle across the whole room: all ways through it ask for the same candidate.
        scene.place(Mesh {
            name: "pane".into(),
            positions: vec![
                Vec3::new(-1.0, 0.0, 1.0),
                Vec3::new(3.0, 0.0, 1.0),
                Vec3::new(-1.0, 0.0, -3.0),
            ],
            triangles: vec![[0, 1, 2]],
            material: Some(pane),
            ..Mesh::default()
        });
        scene.cameras = vec![orthographic(DVec3::Y * -0.2, DVec3::NEG_Y, DVec3::NEG_Z, 0.5)];
        let settings = VirtualLightSettings {
            walks: 1,
            samples_per_pass: 4,
            bound: Bound::None,
            most_bounces: 2,
            ..settings()
        };
        let reference = traced_set(gpu, &scene, 1024, "bounces=0..2");
        passes(gpu, &scene, &settings, 128).expect_same_as("a pane", &reference, 0.0);
    });
}

/// A floor whose normals lean by 45° to +x, by a normal map or at its vertices.
fn leaning_floor(scene: &mut Scene, mapped: bool) {
    // (√½, 0, √½) in the tangents' frame.
    let lean = [218, 128, 218, 255];
    let normal_texture = mapped.then(|| columns(scene, "lean", [lean; 2]));
    let material = scene.add_material(Material {
        normal_texture,
        ..Material::lambert("floor", Vec3::splat(0.8))
    });
    let mut mesh = floor("floor", material, 0.6, 0.0);
    if mapped {
        mesh.uv0 = mesh.positions.iter().map(|p| Vec2::new(p.x, p.z)).collect();
        mesh.tangents = vec![Vec3::X.extend(1.0); mesh.positions.len()];
    } else {
        mesh.normals = vec![Vec3::new(1.0, 1.0, 0.0).normalize(); mesh.positions.len()];
    }
    scene.place(mesh);
}

fn add_spot(scene: &mut Scene, position: Vec3, direction: Vec3) {
    let intensity = Vec3::new(9.0, 6.0, 3.0);
    scene.add_light(
        "spot",
        LightKind::Spot {
            position,
            direction,
            intensity,
            inner: 0.2,
            outer: 0.2,
        },
    );
}

fn add_wall(scene: &mut Scene, lower: Vec3, upper: Vec3) {
    let material = scene.add_material(Material::lambert("wall", Vec3::new(0.5, 0.7, 0.9)));
    scene.place(cuboid("wall", material, lower, upper));
}

/// Of light that is scattered exactly so often.
fn exactly(bounces: u32) -> VirtualLightSettings {
    VirtualLightSettings {
        samples_per_pass: 4,
        bound: Bound::None,
        least_bounces: bounces,
        most_bounces: bounces,
        ..settings()
    }
}

/// The eye bends the normal towards itself where it would see it from behind; so does a virtual light for whom it lights: all of what this wall has of the floor.
#[test]
fn leaning_normals_send_light_to_whoever_sees_them_from_behind() {
    with_gpu(|gpu| {
        let mut scene = named("wall behind a mapped floor");
        leaning_floor(&mut scene, true);
        add_wall(&mut scene, Vec3::new(-1.1, 0.0, -1.0), Vec3::new(-1.0, 0.5, 1.0));
        add_spot(&mut scene, Vec3::Y * 2.0, Vec3::NEG_Y);
        scene.cameras.push(orthographic(
            DVec3::new(1.5, 0.25, 0.0),
            DVec3::new(-1.0, 0.25, 0.0),
            DVec3::Y,
            0.2,
        ));
        let reference = traced_set(gpu, &scene, 8192, "bounces=2..2");
        passes(gpu, &scene, &exactly(2), 32).expect_same_as(&scene.name, &reference, 0.0);
    });
}

/// Walks scatter power, eye paths radiance: where neither bends the normal, by the ratio of cosines the same. And nothing comes to the floor from below it, on
/// whose side its normals are.
#[test]
fn walks_go_on_over_leaning_normals_as_eye_paths_do() {
    with_gpu(|gpu| {
        let wall = |name: &str, heights: [f32; 2]| {
            let mut scene = named(name);
            leaning_floor(&mut scene, false);
            add_wall(
                &mut scene,
                Vec3::new(0.8, heights[0], -0.6),
                Vec3::new(0.9, heights[1], 0.6),
            );
            scene.cameras.push(camera_down(0.5, 3.0));
            scene
        };
        let mut before = wall("wall before a leaning floor", [0.0, 1.2]);
        add_spot(&mut before, Vec3::Y * 2.0, Vec3::NEG_Y);
        let reference = traced_set(gpu, &before, 8192, "bounces=3..3");
        passes(gpu, &before, &exactly(3), 64).expect_same_as(&before.name, &reference, 0.0);
        let mut below = wall("wall below a leaning floor", [-1.0, -0.1]);
        add_spot(&mut below, Vec3::new(-0.5, -0.5, 0.0), Vec3::X);
        let mut below = renderer(gpu, &below, SIZE, &exactly(2));
        assert!(advance(&mut below, 8)[0].iter().all(|value| *value == 0.0));
        assert!(below.counts().lights > 0);
    });
}

/// Through a rough solid that absorbs most of what goes far in it, which fills the picture.
#[test]
fn ink_agrees_with_the_path_tracer() {
    with_gpu(|gpu| {
        let mut scene = builtin("builtin:furnace-box?rho=0.5&emission=0");
        scene.name = "ink".into();
        add_point(&mut scene, Vec3::new(0.3, 0.8, 0.8), Vec3::splat(20.0));
        let ink = scene.add_material(Material {
            transmission: 1.0,
            thickness: 1.0,
            specular: 1.0,
            roughness: 0.5,
            attenuation_color: Vec3::new(0.2, 0.5, 0.8),
            attenuation_distance: 0.4,
            ..Material::lambert("ink", Vec3::splat(0.9))
        });
        scene.place(cuboid("ink", ink, Vec3::splat(-0.7), Vec3::new(0.7, 0.5, 0.1)));
        let settings = VirtualLightSettings {
            samples_per_pass: 4,
            ..settings()
        };
        passes(gpu, &scene, &settings, 48).expect_same_as(&scene.name, &traced(gpu, &scene, 2048), 0.0);
    });
}

/// Sun and sky over a court with a coated floor that is textured; rooms of other tests have points, lamps and spots.
#[test]
fn sun_and_sky_agree_with_the_path_tracer() {
    with_gpu(|gpu| {
        let court = |name: &str| {
            let mut scene = named(name);
            let base_color_texture = Some(columns(
                &mut scene,
                "stripes",
                [[230, 120, 60, 255], [40, 90, 200, 255]],
            ));
            let coated = scene.add_material(Material {
                base_color_texture,
                specular: 1.0,
                roughness: 0.4,
                ..Material::lambert("coated", Vec3::ONE)
            });
            let mut mesh = floor("floor", coated, 1.0, 0.0);
            mesh.uv0 = mesh.positions.iter().map(|p| Vec2::new(p.x, p.z)).collect();
            scene.place(mesh);
            add_wall(&mut scene, Vec3::new(-1.1, 0.0, -1.0), Vec3::new(-1.0, 0.8, 1.0));
            add_wall(&mut scene, Vec3::new(-1.0, 0.0, -1.1), Vec3::new(1.0, 0.8, -1.0));
            scene
        };
        let mut sun = court("sun");
        sun.add_light(
            "sun",
            LightKind::Directional {
                direction: Vec3::new(-0.5, -1.0, -0.3).normalize(),
                irradiance: Vec3::new(3.0, 2.5, 2.0),
            },
        );
        sun.cameras.push(camera_down(1.0, 3.0));
        let mut sky = court("sky");
        sky.environment = Some(Environment::uniform(Vec3::new(0.5, 0.8, 1.2)));
        sky.cameras.push(camera_aslant());
        let settings = VirtualLightSettings {
            walks: 16,
            samples_per_pass: 4,
            ..settings()
        };
        for scene in [sun, sky] {
            let reference = traced(gpu, &scene, 2048);
            passes(gpu, &scene, &settings, 64).expect_same_as(&scene.name, &reference, 0.0);
        }
    });
}
