//! Scenes whose radiance is known in closed form.
//!
//! * Closed furnaces: a closed body whose inside reflects ρ diffusely and emits E has the radiance E / (1 − ρ) everywhere.
//! * Sphere light: inside a unit sphere of Lambert reflectance ρ with a small light at its centre, every path length adds the same
//!   radiance everywhere, so that the sum is uniform; the light is scaled so that it is 1 (the scene of pbrt's analytic tests: Pharr,
//!   Jakob and Humphreys, "Physically Based Rendering", 4th edition, analytic_scenes test). The sphere is tessellated; its area is made
//!   exactly 4π, so that the mean irradiance is exact, and single facets differ from it by O(edge²).
//! * White furnace: a body that absorbs nothing in a uniform environment of radiance 1 cannot be seen.

use std::f64::consts::PI;

use glam::{DVec3, Vec3, Vec4};

use super::Entry;
use super::parameters::{Parameter, Values};
use super::shapes::{MeshBuilder, area, geodesic_sphere, inverted};
use crate::Result;
use crate::scene::{Camera, Environment, LightKind, Material, Mesh, Scene};

const RHO: Parameter = Parameter::color("rho", "0.5", 0.0, 1.0, "Lambert reflectance of the inside");

pub const FURNACE_BOX: Entry = Entry {
    name: "furnace-box",
    summary: "A closed 2 m cube that reflects rho and emits: radiance emission / (1 − rho) everywhere.",
    parameters: &[
        RHO,
        Parameter::color("emission", "0.5", 0.0, 1e6, "emitted radiance, W·m⁻²·sr⁻¹"),
    ],
    build: furnace_box,
};

pub const FURNACE_SPHERE: Entry = Entry {
    name: "furnace-sphere",
    summary: "A closed unit sphere that reflects rho and emits: radiance emission / (1 − rho) everywhere.",
    parameters: &[
        RHO,
        Parameter::color("emission", "0.5", 0.0, 1e6, "emitted radiance, W·m⁻²·sr⁻¹"),
        Parameter::integer(
            "frequency",
            "16",
            1,
            128,
            "cuts of each icosahedron edge: 20·frequency² triangles",
        ),
    ],
    build: furnace_sphere,
};

pub const SPHERE_LIGHT: Entry = Entry {
    name: "sphere-light",
    summary: "The inside of a unit Lambert sphere with a small light at its centre, scaled to radiance 1 everywhere.",
    parameters: &[
        Parameter::real("rho", "0.5", 0.01, 0.99, "Lambert reflectance of the shell"),
        Parameter::choice(
            "light",
            "point",
            &["point", "area"],
            "a point light, or a black sphere that emits",
        ),
        Parameter::real("radius", "0.1", 0.001, 0.5, "radius of the emitting sphere, m"),
        Parameter::integer(
            "frequency",
            "48",
            1,
            128,
            "cuts of each icosahedron edge: 20·frequency² triangles",
        ),
    ],
    build: sphere_light,
};

pub const WHITE_FURNACE: Entry = Entry {
    name: "white-furnace",
    summary: "A sphere in a uniform environment of radiance 1: with base colour 1 and nothing absorbed it vanishes.",
    parameters: &[
        Parameter::real("metallic", "0", 0.0, 1.0, "metalness"),
        Parameter::real("roughness", "0.5", 0.0, 1.0, "perceptual roughness"),
        Parameter::real("ior", "1.5", 1.0, 4.0, "index of refraction"),
        Parameter::real("specular", "1", 0.0, 1.0, "strength of the dielectric reflection"),
        Parameter::real("transmission", "0", 0.0, 1.0, "share of the base that transmits"),
        Parameter::real("thickness", "0", 0.0, 10.0, "above 0 a solid body, 0 a thin wall, m"),
        Parameter::color("base_color", "1", 0.0, 1.0, "base colour"),
        Parameter::real("environment", "1", 0.0, 1e6, "radiance of the environment, W·m⁻²·sr⁻¹"),
        Parameter::integer(
            "frequency",
            "32",
            1,
            128,
            "cuts of each icosahedron edge: 20·frequency² triangles",
        ),
        Parameter::choice(
            "smooth",
            "no",
            &["yes", "no"],
            "interpolated shading normals, which lose a little energy",
        ),
    ],
    build: white_furnace,
};

/// A camera well inside that sees no symmetric pattern.
fn inside_camera(scene: &mut Scene) {
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(0.11, -0.07, 0.42),
        DVec3::new(-0.3, 0.2, -1.0),
        DVec3::Y,
        70f32.to_radians(),
    ));
    scene.defaults.aspect = Some(1.0);
}

fn furnace_material(values: &Values) -> Result<Material> {
    let mut material = Material::lambert("furnace", values.color("rho")?);
    material.emission = values.color("emission")?;
    Ok(material)
}

fn furnace_box(values: &Values) -> Result<Scene> {
    let mut scene = Scene::default();
    let material = scene.add_material(furnace_material(values)?);
    scene.place(MeshBuilder::new("box", material).room(Vec3::NEG_ONE, Vec3::ONE).build());
    inside_camera(&mut scene);
    Ok(scene)
}

fn furnace_sphere(values: &Values) -> Result<Scene> {
    let mut scene = Scene::default();
    let material = scene.add_material(furnace_material(values)?);
    scene.place(inverted(geodesic_sphere(
        "sphere",
        material,
        1.0,
        values.integer("frequency")?,
        false,
    )));
    inside_camera(&mut scene);
    Ok(scene)
}

/// A sphere tessellation whose area is 4π·radius² but for f32 rounding.
fn equal_area_sphere(name: &str, material: u32, radius: f64, frequency: u32) -> Mesh {
    let unit = geodesic_sphere(name, material, 1.0, frequency, false);
    let scale = (4.0 * PI / area(&unit)).sqrt();
    geodesic_sphere(name, material, radius * scale, frequency, false)
}

fn sphere_light(values: &Values) -> Result<Scene> {
    let rho = values.real("rho")?;
    let mut scene = Scene::default();
    let shell = scene.add_material(Material::lambert("shell", Vec3::splat(rho as f32)));
    scene.place(inverted(equal_area_sphere(
        "shell",
        shell,
        1.0,
        values.integer("frequency")?,
    )));
    if values.word("light")? == "point" {
        // First bounce ρI/π, and Σ ρⁿ of it: 1 = ρI / (π(1 − ρ)).
        let intensity = PI * (1.0 - rho) / rho;
        scene.add_light(
            "centre",
            LightKind::Point {
                position: Vec3::ZERO,
                intensity: Vec3::splat(intensity as f32),
            },
        );
    } else {
        // The share of radius² of what leaves the shell meets the black light: 1 = ρ(r²·Lₑ + 1 − r²).
        let share = values.real("radius")?.powi(2);
        let radiance = (1.0 - rho * (1.0 - share)) / (rho * share);
        let mut material = Material::lambert("light", Vec3::ZERO);
        material.emission = Vec3::splat(radiance as f32);
        material.double_sided = false;
        let material = scene.add_material(material);
        scene.place(equal_area_sphere("light", material, values.real("radius")?, 16));
    }
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(0.1, 0.05, 0.7),
        DVec3::new(1.0, 0.3, 0.2),
        DVec3::Y,
        60f32.to_radians(),
    ));
    scene.defaults.aspect = Some(1.0);
    Ok(scene)
}

fn white_furnace(values: &Values) -> Result<Scene> {
    let mut scene = Scene::default();
    let material = scene.add_material(Material {
        name: "white".into(),
        base_color: Vec4::from((values.color("base_color")?, 1.0)),
        metallic: values.real("metallic")? as f32,
        roughness: values.real("roughness")? as f32,
        ior: values.real("ior")? as f32,
        specular: values.real("specular")? as f32,
        transmission: values.real("transmission")? as f32,
        thickness: values.real("thickness")? as f32,
        double_sided: true,
        ..Material::default()
    });
    scene.place(geodesic_sphere(
        "sphere",
        material,
        1.0,
        values.integer("frequency")?,
        values.yes("smooth")?,
    ));
    scene.environment = Some(Environment::uniform(Vec3::splat(values.real("environment")? as f32)));
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(0.0, 0.0, 4.0),
        DVec3::ZERO,
        DVec3::Y,
        36f32.to_radians(),
    ));
    scene.defaults.aspect = Some(1.0);
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::super::generate;
    use super::super::shapes::tests::{open_edges, volume};
    use super::*;

    #[test]
    fn furnaces_are_closed_and_face_inward() {
        for name in ["furnace-box", "furnace-sphere", "sphere-light"] {
            let scene = generate(&format!("builtin:{name}")).expect("scene");
            assert_eq!(open_edges(&scene.meshes[0]), 0, "{name}");
            assert!(volume(&scene.meshes[0]) < 0.0, "{name}");
        }
    }

    #[test]
    fn the_shell_of_the_sphere_light_has_the_area_of_the_sphere() {
        let scene = generate("builtin:sphere-light?frequency=20").expect("scene");
        // f32 vertices: relative 6e-8 each, and area errors average out below 1e-6.
        assert!((area(&scene.meshes[0]) / (4.0 * PI) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_lights_are_scaled_to_radiance_one() {
        let LightKind::Point { intensity, .. } = generate("builtin:sphere-light").expect("scene").lights[0].kind else {
            panic!("a point light");
        };
        // ρ = ½: the intensity is π.
        assert_eq!(intensity, Vec3::splat(std::f32::consts::PI));
        let scene = generate("builtin:sphere-light?light=area&radius=0.5&rho=0.25").expect("scene");
        // 1 = ¼·(¼·Lₑ + ¾) ⇒ Lₑ = 13.
        assert_eq!(scene.materials[1].emission, Vec3::splat(13.0));
    }
}
