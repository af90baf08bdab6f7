//! A room that is hard on many lights: a polished floor, a partition as thin as asked for, and a lamp in a corner.

use glam::{DVec3, Vec3};

use super::Entry;
use super::parameters::{Parameter, Values};
use super::shapes::MeshBuilder;
use crate::Result;
use crate::scene::{Camera, Material, Scene};

pub const CORNER_LAMP: Entry = Entry {
    name: "corner-lamp",
    summary: "A room with a polished floor and a thin partition, lit by a small lamp in a corner of its ceiling.",
    parameters: &[
        Parameter::real("roughness", "0.2", 0.0, 1.0, "perceptual roughness of the floor's coat"),
        Parameter::real("wall", "0.001", 1e-4, 0.5, "thickness of the partition, m"),
        Parameter::color("light", "400", 0.0, 1e6, "radiance of the lamp, W·m⁻²·sr⁻¹"),
    ],
    build,
};

/// Half of the room's sides, and its height, m.
const HALF: f32 = 1.5;
const HEIGHT: f32 = 2.5;
/// Side of the lamp, and how far it is from both walls and the ceiling, m.
const LAMP: f32 = 0.06;
const CLEARANCE: f32 = 0.03;
/// Height of the floor's boards, and the joints between them and the room, m.
const BOARDS: f32 = 0.01;
const JOINT: f32 = 0.002;
/// Height of the partition, m, which goes from the back wall up to this z. It ends in the floor and in the wall, so that light has no way below or behind it.
const PARTITION_HEIGHT: f32 = 1.9;
const PARTITION_END: f32 = 0.5;
const DEPTH: f32 = 0.005;

fn build(values: &Values) -> Result<Scene> {
    let mut scene = Scene::default();
    let plaster = scene.add_material(Material::lambert("plaster", Vec3::new(0.72, 0.7, 0.66)));
    let panel = scene.add_material(Material::lambert("panel", Vec3::new(0.6, 0.25, 0.15)));
    let boards = scene.add_material(Material {
        specular: 1.0,
        roughness: values.real("roughness")? as f32,
        ..Material::lambert("boards", Vec3::new(0.4, 0.28, 0.16))
    });
    let mut lamp = Material::lambert("lamp", Vec3::ZERO);
    lamp.emission = values.color("light")?;
    let lamp = scene.add_material(lamp);
    scene.place(
        MeshBuilder::new("room", plaster)
            .room(Vec3::new(-HALF, 0.0, -HALF), Vec3::new(HALF, HEIGHT, HALF))
            .build(),
    );
    let inner = HALF - JOINT;
    scene.place(
        MeshBuilder::new("floor", boards)
            .cuboid(Vec3::new(-inner, JOINT, -inner), Vec3::new(inner, BOARDS, inner))
            .build(),
    );
    let thickness = 0.5 * values.real("wall")? as f32;
    let lower = Vec3::new(-thickness, DEPTH, -HALF - DEPTH);
    scene.place(
        MeshBuilder::new("partition", panel)
            .cuboid(lower, Vec3::new(thickness, PARTITION_HEIGHT, PARTITION_END))
            .build(),
    );
    let upper = Vec3::new(HALF, HEIGHT, -HALF + 2.0 * CLEARANCE + LAMP) - Vec3::splat(CLEARANCE);
    scene.place(
        MeshBuilder::new("lamp", lamp)
            .cuboid(upper - Vec3::splat(LAMP), upper)
            .build(),
    );
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(-0.9, 1.5, 1.3),
        DVec3::new(0.2, 0.5, -0.8),
        DVec3::Y,
        70f32.to_radians(),
    ));
    scene.defaults.aspect = Some(1.0);
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::super::generate;

    #[test]
    fn the_lamp_is_in_the_corner_and_the_partition_as_thin_as_asked_for() {
        for (wall, roughness) in [(0.001, 0.05), (0.1, 0.5)] {
            let scene = generate(&format!("builtin:corner-lamp?wall={wall}&roughness={roughness}")).unwrap();
            let range = |name: &str, axis: usize| {
                let mesh = scene.meshes.iter().find(|mesh| mesh.name == name).expect(name);
                let places = mesh.positions.iter().map(|p| p[axis]);
                places.fold([9.0f32, -9.0], |[low, high], place| [low.min(place), high.max(place)])
            };
            let [low, high] = range("partition", 0);
            assert!((high - low - wall).abs() < 1e-6, "{low} {high}");
            for (axis, wall) in [(0, 1.5), (1, 2.5), (2, -1.5)] {
                let [low, high] = range("lamp", axis);
                let gap = (wall - low).abs().min((wall - high).abs());
                assert!((gap - 0.03).abs() < 1e-5, "{axis}: {gap}");
                assert!((high - low - 0.06).abs() < 1e-5);
            }
            assert!(scene.materials.iter().any(|material| material.roughness == roughness));
        }
    }
}
