//! A room whose lamp stands behind a shade: all of its light is scattered in the shade before it comes out, and at the ceiling before it comes down.

use glam::{DVec3, Vec3};

use super::Entry;
use super::parameters::{Parameter, Values};
use super::shapes::MeshBuilder;
use crate::Result;
use crate::scene::{Camera, LightKind, Material, Scene};

pub const SHADED_LAMP: Entry = Entry {
    name: "shaded-lamp",
    summary: "A room lit by a lamp that shines down into a bowl, which is open to the ceiling alone.",
    parameters: &[
        Parameter::real("opening", "0.3", 0.05, 0.8, "side of the bowl, m"),
        Parameter::choice(
            "source",
            "area",
            &["area", "point"],
            "a panel half as wide as the bowl, or a point above its bottom",
        ),
        Parameter::color(
            "light",
            "40",
            0.0,
            1e6,
            "power of the panel over π, or intensity of the point, W/sr",
        ),
    ],
    build,
};

/// Half of the room's sides, and its height, m.
const HALF: f32 = 2.0;
const HEIGHT: f32 = 2.5;
/// The bowl's bottom, its depth, and where the panel hangs in it, in sides of the bowl.
const BOTTOM: f32 = 1.5;
const DEPTH: f32 = 1.0;
const LAMP: f32 = 0.6;
/// A point is lower, so that it shows the ceiling nothing but what the bowl's rim leaves.
const POINT: f32 = 0.1;
/// Side of the panel over that of the bowl.
const PANEL: f32 = 0.5;

fn build(values: &Values) -> Result<Scene> {
    let side = values.real("opening")? as f32;
    let light = values.color("light")?;
    let mut scene = Scene::default();
    let plaster = scene.add_material(Material::lambert("plaster", Vec3::new(0.75, 0.72, 0.68)));
    let wood = scene.add_material(Material::lambert("wood", Vec3::new(0.45, 0.3, 0.18)));
    let enamel = scene.add_material(Material::lambert("enamel", Vec3::splat(0.85)));
    scene.place(
        MeshBuilder::new("room", plaster)
            .room(Vec3::new(-HALF, 0.0, -HALF), Vec3::new(HALF, HEIGHT, HALF))
            .build(),
    );
    scene.place(
        MeshBuilder::new("table", wood)
            .cuboid(Vec3::new(-1.4, 0.005, -1.4), Vec3::new(-0.4, 0.7, -0.6))
            .build(),
    );
    let corner = |x: f32, y: f32, z: f32| Vec3::new(0.5 * x * side, BOTTOM + y * side, 0.5 * z * side);
    let ring = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let mut bowl = MeshBuilder::new("bowl", enamel);
    bowl.quad(ring.map(|(x, z)| corner(x, 0.0, z)));
    for (i, (x, z)) in ring.into_iter().enumerate() {
        let (next_x, next_z) = ring[(i + 1) % ring.len()];
        bowl.quad([
            corner(x, 0.0, z),
            corner(x, DEPTH, z),
            corner(next_x, DEPTH, next_z),
            corner(next_x, 0.0, next_z),
        ]);
    }
    scene.place(bowl.build());
    if values.word("source")? == "area" {
        let mut panel = Material::lambert("lamp", Vec3::ZERO);
        panel.emission = light / (PANEL * side).powi(2);
        panel.double_sided = false;
        let panel = scene.add_material(panel);
        // Its front is below.
        scene.place(
            MeshBuilder::new("lamp", panel)
                .quad(ring.map(|(x, z)| corner(PANEL * x, LAMP, PANEL * z)))
                .build(),
        );
    } else {
        scene.add_light(
            "lamp",
            LightKind::Point {
                position: corner(0.0, POINT, 0.0),
                intensity: light,
            },
        );
    }
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(1.7, 1.2, 1.8),
        DVec3::new(-0.6, 0.8, -0.6),
        DVec3::Y,
        65f32.to_radians(),
    ));
    scene.defaults.aspect = Some(1.0);
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::super::generate;

    #[test]
    fn the_panel_shines_into_the_bowl_and_has_the_same_power_whatever_its_size() {
        for side in ["0.1", "0.5"] {
            let scene = generate(&format!("builtin:shaded-lamp?opening={side}")).unwrap();
            let lamp = scene.meshes.iter().find(|mesh| mesh.name == "lamp").expect("lamp");
            let [a, b, c] = lamp.triangles[0].map(|i| lamp.positions[i as usize]);
            let normal = (b - a).cross(c - a);
            assert!(normal.y < 0.0 && normal.x == 0.0, "{normal}");
            let emission = scene.materials[lamp.material.expect("material") as usize].emission;
            let area = f64::from(normal.length());
            assert!((f64::from(emission.x) * area - 40.0).abs() < 1e-3, "{area}");
            // Above the bottom, below the rim.
            let bowl = scene.meshes.iter().find(|mesh| mesh.name == "bowl").expect("bowl");
            let heights = || bowl.positions.iter().map(|p| p.y);
            let (least, greatest) = (heights().fold(9.0, f32::min), heights().fold(0.0, f32::max));
            assert!(least < a.y && a.y < greatest);
        }
        let point = generate("builtin:shaded-lamp?source=point").unwrap();
        assert_eq!(point.lights.len(), 1);
    }
}
