//! A specular metal ring on a diffuse floor: the cardioid-like caustic of reflection inside a band.
//!
//! Size and triangle count follow the "Ring" benchmark of the photon-mapping literature: 4 × 4 × 2 m, 138 triangles for a band of 64
//! segments in a box without a lid.

use glam::{DVec3, Vec3};

use super::Entry;
use super::parameters::{Parameter, Values};
use super::shapes::{MeshBuilder, cuboid_faces, cylinder_wall};
use crate::Result;
use crate::scene::{Camera, LightKind, Material, Scene, metals};

pub const RING: Entry = Entry {
    name: "ring",
    summary: "A specular metal ring on a diffuse floor, lit by a point light: a cardioid caustic.",
    parameters: &[
        Parameter::integer("segments", "64", 3, 65536, "facets of the ring"),
        Parameter::choice(
            "smooth",
            "yes",
            &["yes", "no"],
            "interpolated shading normals along the ring",
        ),
        Parameter::choice(
            "metal",
            "mirror",
            &["mirror", "gold", "silver", "copper", "aluminium"],
            "the ring's reflectance: all light, or a measured metal",
        ),
        Parameter::real("roughness", "0", 0.0, 1.0, "perceptual roughness of the ring"),
        Parameter::real("radius", "0.8", 0.1, 1.8, "radius of the ring, m"),
        Parameter::real("height", "0.4", 0.01, 1.9, "height of the ring, m"),
        Parameter::color("intensity", "10", 0.0, 1e6, "intensity of the light, W/sr"),
    ],
    build,
};

fn build(values: &Values) -> Result<Scene> {
    let mut scene = Scene::default();
    let floor = scene.add_material(Material::lambert("floor", Vec3::splat(0.7)));
    let metal = values.word("metal")?;
    let ring = scene.add_material(Material {
        roughness: values.real("roughness")? as f32,
        conductor: metals::by_name(metal),
        ..Material::mirror(metal, Vec3::ONE)
    });
    let mut walls = MeshBuilder::new("floor and walls", floor);
    let faces = cuboid_faces(Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 2.0, 2.0));
    const TOP: usize = 3;
    for (i, [a, b, c, d]) in faces.into_iter().enumerate() {
        if i != TOP {
            walls.quad([a, d, c, b]);
        }
    }
    scene.place(walls.build());
    scene.place(cylinder_wall(
        "ring",
        ring,
        values.real("radius")?,
        values.real("height")?,
        values.integer("segments")?,
        values.yes("smooth")?,
    ));
    scene.add_light(
        "lamp",
        LightKind::Point {
            position: Vec3::new(1.7, 1.0, 0.0),
            intensity: values.color("intensity")?,
        },
    );
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(0.0, 1.9, 1.9),
        DVec3::new(0.0, 0.0, 0.1),
        DVec3::Y,
        50f32.to_radians(),
    ));
    scene.cameras.push(Camera::look_at(
        "top",
        DVec3::new(0.0, 1.95, 0.0),
        DVec3::ZERO,
        DVec3::NEG_Z,
        60f32.to_radians(),
    ));
    scene.defaults.aspect = Some(4.0 / 3.0);
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::super::generate;

    #[test]
    fn the_default_has_138_triangles() {
        let count = |address: &str| -> usize {
            generate(address)
                .expect("scene")
                .meshes
                .iter()
                .map(|m| m.triangles.len())
                .sum()
        };
        assert_eq!(count("builtin:ring"), 138);
        assert_eq!(count("builtin:ring?segments=100&metal=gold&smooth=no"), 210);
    }
}
