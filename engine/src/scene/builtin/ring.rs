//! A specular metal ring on a diffuse floor: the cardioid-like caustic of reflection inside a band.
//!
//! Size and triangle count follow the "Ring" benchmark of the photon-mapping literature: 4 × 4 × 2 m, 138 triangles for a band of 64
//! segments in a box without a lid. With its volume photons the source lifts the ring, of 256 segments, into a medium, and has a spot of half angle 0.5 besides
//! (B. Fabianowski, "Interactive Manycore Photon Mapping", PhD thesis, Trinity College Dublin, 2011, Table 7.1); how high it hangs and where the spot is turned to are ours.

use glam::{DVec3, Vec3};

use super::Entry;
use super::media::{ABSORPTION, G, PHASE, SCATTERING, surround};
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
        Parameter::real(
            "lift",
            "0",
            0.0,
            2.0,
            "height of the ring's lower rim above the floor, m",
        ),
        Parameter::choice(
            "source",
            "point",
            &["point", "spot"],
            "a point light, or a spot in the same place that is turned to the middle of the ring",
        ),
        Parameter::color("intensity", "10", 0.0, 1e6, "intensity of the light, W/sr"),
        ABSORPTION,
        SCATTERING,
        PHASE,
        G,
    ],
    build,
};

/// Half angle of the spot, radians.
const SPOT: f32 = 0.5;

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
    let (height, lift) = (values.real("height")?, values.real("lift")?);
    let mut band = cylinder_wall(
        "ring",
        ring,
        values.real("radius")?,
        height,
        values.integer("segments")?,
        values.yes("smooth")?,
    );
    band.positions.iter_mut().for_each(|position| position.y += lift as f32);
    scene.place(band);
    let (position, intensity) = (Vec3::new(1.7, 1.0, 0.0), values.color("intensity")?);
    let middle = Vec3::Y * (lift + height / 2.0) as f32;
    let kind = if values.word("source")? == "spot" {
        LightKind::Spot {
            position,
            direction: (middle - position).normalize(),
            intensity,
            inner: SPOT,
            outer: SPOT,
        }
    } else {
        LightKind::Point { position, intensity }
    };
    scene.add_light("lamp", kind);
    surround(&mut scene, "fog", values)?;
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
    use super::*;

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
        // As the source's in a medium.
        assert_eq!(count("builtin:ring?segments=256&lift=0.3"), 522);
    }

    #[test]
    fn a_lifted_ring_hangs_in_fog_before_a_spot() {
        let scene = generate("builtin:ring?lift=0.3&source=spot&sigma_a=0.01&sigma_s=0.5,0.01,0.01").expect("scene");
        let ring = scene.meshes.iter().find(|mesh| mesh.name == "ring").expect("ring");
        let [low, high] = ring.bounds();
        assert!(
            (low.y - 0.3).abs() < 1e-6 && (high.y - 0.7).abs() < 1e-6,
            "{low} {high}"
        );
        let LightKind::Spot {
            position, direction, ..
        } = scene.lights[0].kind
        else {
            panic!("no spot");
        };
        // The middle of the ring lies on the axis.
        assert!((Vec3::Y * 0.5 - position).normalize().dot(direction) > 1.0 - 1e-6);
        let fog = &scene.media[0];
        assert_eq!(
            (fog.sigma_a, fog.sigma_s),
            (Vec3::splat(0.01), Vec3::new(0.5, 0.01, 0.01))
        );
        assert_eq!(
            (scene.surrounding, generate("builtin:ring").expect("scene").media.len()),
            (Some(0), 0)
        );
    }
}
