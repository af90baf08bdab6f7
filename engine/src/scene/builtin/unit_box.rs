//! The unit box in which selections of virtual lights were measured: two blocks in a closed grey cube with a square lamp in the ceiling.
//!
//! After the chapter on virtual light sources of a doctoral thesis on metals and reflections on graphics hardware (`MET-V1` … `MET-V8`), with
//! measures of the engine's own. The ceiling is cut out around the lamp, so that no two surfaces coincide.

use glam::{DVec3, Vec3};

use super::Entry;
use super::parameters::{Parameter, Values};
use super::shapes::{MeshBuilder, cuboid_faces};
use crate::Result;
use crate::scene::{Camera, Material, Scene};

pub const UNIT_BOX: Entry = Entry {
    name: "unit-box",
    summary: "Two blocks in a closed grey cube of 1 m with a square lamp in its ceiling, seen from inside.",
    parameters: &[
        Parameter::color("rho", "0.8", 0.0, 1.0, "reflectance of all surfaces"),
        Parameter::color("light", "10", 0.0, 1e6, "radiance of the lamp, W·m⁻²·sr⁻¹"),
        Parameter::choice(
            "boxes",
            "both",
            &["both", "none"],
            "whether the blocks stand in the box",
        ),
    ],
    build,
};

/// Corners of the blocks, m.
const BLOCKS: [[Vec3; 2]; 2] = [
    [Vec3::new(0.15, 0.0, 0.5), Vec3::new(0.45, 0.6, 0.8)],
    [Vec3::new(0.55, 0.0, 0.2), Vec3::new(0.85, 0.3, 0.5)],
];
/// The lamp's least and greatest coordinate along both sides, m.
const LAMP: [f32; 2] = [0.35, 0.65];
const EYE: DVec3 = DVec3::new(0.5, 0.55, 0.02);
/// Half of the picture's side at a distance of one.
const HALF_PICTURE: f32 = 0.9;

/// A square at the height of the ceiling that faces down.
fn facing_down([low, high]: [f32; 2]) -> [Vec3; 4] {
    [(low, low), (high, low), (high, high), (low, high)].map(|(x, z)| Vec3::new(x, 1.0, z))
}

fn build(values: &Values) -> Result<Scene> {
    let rho = values.color("rho")?;
    let mut scene = Scene::default();
    let grey = scene.add_material(Material::lambert("grey", rho));
    let mut lamp = Material::lambert("lamp", rho);
    lamp.emission = values.color("light")?;
    lamp.double_sided = false;
    let lamp = scene.add_material(lamp);
    let mut walls = MeshBuilder::new("walls", grey);
    let mut shell = MeshBuilder::new("shell", grey).room(Vec3::ZERO, Vec3::ONE).build();
    // Its ceiling has the lamp's hole instead.
    let height = |triangle: &[u32; 3]| {
        let heights = triangle.map(|i| shell.positions[i as usize].y);
        heights.into_iter().fold(f32::INFINITY, f32::min)
    };
    let kept: Vec<[u32; 3]> = shell.triangles.iter().copied().filter(|t| height(t) < 1.0).collect();
    shell.triangles = kept;
    walls.append(&shell, |p| p);
    let (outer, inner) = (facing_down([0.0, 1.0]), facing_down(LAMP));
    for i in 0..outer.len() {
        let next = (i + 1) % outer.len();
        walls.quad([outer[i], outer[next], inner[next], inner[i]]);
    }
    scene.place(walls.build());
    scene.place(MeshBuilder::new("lamp", lamp).quad(inner).build());
    if values.word("boxes")? == "both" {
        for [low, high] in BLOCKS {
            // A block stands on the floor, where it has no face.
            let mut block = MeshBuilder::new("block", grey);
            for face in cuboid_faces(low, high) {
                if face.iter().any(|corner| corner.y > low.y) {
                    block.quad(face);
                }
            }
            scene.place(block.build());
        }
    }
    scene.cameras.push(Camera::look_at(
        "main",
        EYE,
        EYE + DVec3::Z,
        DVec3::Y,
        2.0 * HALF_PICTURE.atan(),
    ));
    scene.defaults.aspect = Some(1.0);
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::super::generate;
    use super::super::shapes::area;
    use super::*;

    fn triangles(scene: &Scene, name: &str) -> Vec<[Vec3; 3]> {
        let of = scene.meshes.iter().filter(|mesh| mesh.name == name);
        of.flat_map(|mesh| mesh.triangles.iter().map(|t| t.map(|i| mesh.positions[i as usize])))
            .collect()
    }

    #[test]
    fn all_faces_look_into_the_box_and_have_its_area() {
        let scene = generate("builtin:unit-box").expect("scene");
        let sum = |name: &str| {
            let of = scene.meshes.iter().filter(|mesh| mesh.name == name);
            of.map(area).sum::<f64>()
        };
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} {b}");
        near(sum("lamp"), 0.09);
        near(sum("walls"), 6.0 - 0.09);
        near(sum("block"), 0.09 + 4.0 * 0.3 * 0.6 + 0.09 + 4.0 * 0.3 * 0.3);
        let middle = Vec3::new(0.5, 0.7, 0.5);
        for name in ["walls", "lamp"] {
            for [a, b, c] in triangles(&scene, name) {
                assert!((b - a).cross(c - a).dot(middle - a) > 0.0, "{name}: {a} {b} {c}");
            }
        }
        for [a, b, c] in triangles(&scene, "block") {
            // Away from the block's own middle.
            let block = if a.x < 0.5 { BLOCKS[0] } else { BLOCKS[1] };
            assert!((b - a).cross(c - a).dot(0.5 * (block[0] + block[1]) - a) < 0.0);
        }
    }
}
