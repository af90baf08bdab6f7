//! The sphere flake: each sphere carries nine of a third its size.
//!
//! After E. Haines, "A Proposal for Standard Graphics Environments", IEEE CG&A 7(11), 1987: six children around the equator of the
//! parent's axis and three above, each touching it and pointing away from it.

use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};

use super::Entry;
use super::parameters::{Parameter, Values};
use super::shapes::{MeshBuilder, geodesic_sphere};
use crate::scene::{Camera, Environment, Instance, LightKind, Material, Scene};
use crate::{Error, Result};

pub const SPHERE_FLAKE: Entry = Entry {
    name: "sphere-flake",
    summary: "A fractal of spheres on a floor: 9 children per sphere, up to a million triangles and more.",
    parameters: &[
        Parameter::integer(
            "depth",
            "3",
            0,
            5,
            "generations of children: 1, 10, 91, 820, 7381, 66430 spheres",
        ),
        Parameter::integer(
            "frequency",
            "4",
            1,
            32,
            "cuts of each icosahedron edge: 20·frequency² triangles per sphere",
        ),
        Parameter::choice("instanced", "no", &["yes", "no"], "spheres as instances of one mesh"),
        Parameter::choice(
            "surface",
            "plastic",
            &["plastic", "mirror", "diffuse", "glass"],
            "what the spheres are made of",
        ),
    ],
    build,
};

/// More triangles than this are refused.
const MAX_TRIANGLES: u64 = 4_000_000;
const CHILD_SCALE: f64 = 1.0 / 3.0;

/// Frames of the nine children on a unit parent: the child's +Y points away from the parent.
fn children() -> Vec<DAffine3> {
    let mut frames = Vec::with_capacity(9);
    for (count, elevation, turn) in [(6, 0.0, 0.0), (3, 60f64.to_radians(), 30f64.to_radians())] {
        for i in 0..count {
            let azimuth = std::f64::consts::TAU * f64::from(i) / f64::from(count) + turn;
            let out = DVec3::new(
                elevation.cos() * azimuth.cos(),
                elevation.sin(),
                elevation.cos() * azimuth.sin(),
            );
            let rotation = DMat3::from_quat(DQuat::from_rotation_arc(DVec3::Y, out));
            frames.push(DAffine3::from_mat3_translation(
                rotation * CHILD_SCALE,
                out * (1.0 + CHILD_SCALE),
            ));
        }
    }
    frames
}

fn build(values: &Values) -> Result<Scene> {
    let depth = values.integer("depth")?;
    let frequency = values.integer("frequency")?;
    let spheres = (9u64.pow(depth + 1) - 1) / 8;
    let triangles = spheres * 20 * u64::from(frequency).pow(2);
    if triangles > MAX_TRIANGLES {
        return Err(Error::scene(
            &values.address,
            "keys \"depth\" and \"frequency\"",
            format!("give {triangles} triangles; at most {MAX_TRIANGLES} are allowed"),
        ));
    }
    let mut scene = Scene::default();
    let floor = scene.add_material(Material::lambert("floor", Vec3::splat(0.5)));
    let surface = scene.add_material(match values.word("surface")? {
        "mirror" => Material::mirror("mirror", Vec3::new(0.95, 0.93, 0.88)),
        "glass" => Material::glass("glass", 1.5),
        "diffuse" => Material::lambert("diffuse", Vec3::new(0.7, 0.45, 0.2)),
        _ => Material {
            name: "plastic".into(),
            base_color: Vec3::new(0.7, 0.45, 0.2).extend(1.0),
            metallic: 0.0,
            roughness: 0.3,
            ..Material::default()
        },
    });
    let extent = 8.0;
    let ground = -2.0;
    scene.place(
        MeshBuilder::new("floor", floor)
            .quad([
                Vec3::new(-extent, ground, extent),
                Vec3::new(extent, ground, extent),
                Vec3::new(extent, ground, -extent),
                Vec3::new(-extent, ground, -extent),
            ])
            .build(),
    );
    let children = children();
    let mut frames = vec![DAffine3::IDENTITY];
    let mut parents = 0..1;
    for _ in 0..depth {
        for parent in parents.clone() {
            let frame = frames[parent];
            frames.extend(children.iter().map(|child| frame * *child));
        }
        parents = parents.end..frames.len();
    }
    let sphere = geodesic_sphere("sphere", surface, 1.0, frequency, true);
    if values.yes("instanced")? {
        let mesh = scene.add_mesh(sphere);
        scene.instances.extend(frames.into_iter().map(|transform| Instance {
            mesh,
            transform,
            name: "sphere".into(),
        }));
    } else {
        let mut flake = MeshBuilder::new("flake", surface);
        for frame in frames {
            let rotation = DMat3::from_cols(
                frame.matrix3.x_axis.normalize(),
                frame.matrix3.y_axis.normalize(),
                frame.matrix3.z_axis.normalize(),
            );
            let mut one = sphere.clone();
            for normal in &mut one.normals {
                *normal = (rotation * normal.as_dvec3()).as_vec3().normalize();
            }
            flake.append(&one, |p| frame.transform_point3(p.as_dvec3()).as_vec3());
        }
        scene.place(flake.build());
    }
    scene.environment = Some(Environment::uniform(Vec3::new(0.4, 0.5, 0.7)));
    scene.add_light(
        "sun",
        LightKind::Directional {
            direction: Vec3::new(-0.4, -0.8, -0.45).normalize(),
            irradiance: Vec3::new(3.0, 2.8, 2.4),
        },
    );
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(2.2, 2.0, 4.2),
        DVec3::new(0.0, 0.1, 0.0),
        DVec3::Y,
        45f32.to_radians(),
    ));
    scene.defaults.aspect = Some(1.0);
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::super::generate;
    use crate::scene::SceneProfile;

    #[test]
    fn instances_and_merged_meshes_place_the_same_triangles() {
        let profile = |address: &str| SceneProfile::of(&generate(address).expect("scene"));
        let merged = profile("builtin:sphere-flake?depth=2&frequency=2");
        let instanced = profile("builtin:sphere-flake?depth=2&frequency=2&instanced=yes");
        assert_eq!(merged.triangles, 91 * 80 + 2);
        assert_eq!(instanced.triangles, merged.triangles);
        assert_eq!((merged.instances, instanced.instances), (2, 92));
        let (a, b) = (merged.bounds.expect("bounds"), instanced.bounds.expect("bounds"));
        for i in 0..2 {
            for k in 0..3 {
                assert!((a[i][k] - b[i][k]).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn too_many_triangles_are_refused() {
        let error = generate("builtin:sphere-flake?depth=5&frequency=32").expect_err("too many");
        assert!(error.to_string().contains("4000000"), "{error}");
    }
}
