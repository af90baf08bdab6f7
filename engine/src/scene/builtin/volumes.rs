//! Media whose density comes from a grid: a plume of smoke in a corner, and a cloud over the plain.

use glam::{DVec3, Vec3};

use super::Entry;
use super::media::{G, PHASE, add_boundary, add_medium, coefficient, phase};
use super::parameters::{Parameter, Values};
use super::shapes::MeshBuilder;
use super::textures::sky;
use crate::Result;
use crate::scene::medium::generate::Generator;
use crate::scene::{Camera, Environment, LightKind, Material, Medium, Scene};

const ALBEDO: &str = "share of the extinction that is scattering";
const SEED: Parameter = Parameter::integer("seed", "1", 0, 1_000_000, "which of the shapes");

pub const SMOKE: Entry = Entry {
    name: "smoke",
    summary: "A plume of smoke rises before two walls, lit by a panel and a uniform environment; it can glow.",
    parameters: &[
        coefficient("sigma_t", "12", "extinction coefficient at density 1, 1/m"),
        Parameter::color("albedo", "0.9,0.88,0.85", 0.0, 1.0, ALBEDO),
        Parameter::color(
            "emission",
            "0",
            0.0,
            1e6,
            "emitted radiance per metre at density 1, W·m⁻³·sr⁻¹",
        ),
        PHASE,
        G,
        Parameter::integer("size", "64", 8, 512, "cells of the grid along each side"),
        SEED,
        Parameter::color("light", "20", 0.0, 1e6, "radiance of the panel, W·m⁻²·sr⁻¹"),
        Parameter::real(
            "environment",
            "0.2",
            0.0,
            1e6,
            "radiance of the environment, W·m⁻²·sr⁻¹",
        ),
    ],
    build: smoke,
};

pub const CLOUD: Entry = Entry {
    name: "cloud",
    summary: "A bright cloud of 300 m over a plain under sun and sky.",
    parameters: &[
        // More, through its 640 m, no path would come to the end of in time.
        Parameter::color("sigma_t", "0.1", 0.0, 1e4, "extinction coefficient at density 1, 1/m"),
        Parameter::color("albedo", "1", 0.0, 1.0, ALBEDO),
        PHASE,
        Parameter::real(
            "g",
            "0.8",
            -0.999,
            0.999,
            "mean cosine of hg, eccentricity of schlick; forward is positive",
        ),
        Parameter::integer("size", "64", 8, 512, "cells of the grid along each side"),
        SEED,
        Parameter::real("sky", "1", 0.0, 1000.0, "strength of the sky with its sun disc"),
        Parameter::real("sun", "3", 0.0, 1000.0, "irradiance of an extra directional sun, W/m²"),
    ],
    build: cloud,
};

/// Places a generated grid in a box with an invisible boundary.
fn place_volume(
    scene: &mut Scene,
    name: &str,
    generator: Generator,
    values: &Values,
    [low, high]: [Vec3; 2],
) -> Result<()> {
    let (sigma_t, albedo) = (values.color("sigma_t")?, values.color("albedo")?);
    let grid = generator.grid([values.integer("size")?; 3], values.integer("seed")?);
    let medium = Medium {
        name: name.into(),
        sigma_a: sigma_t * (Vec3::ONE - albedo),
        sigma_s: sigma_t * albedo,
        phase: phase(values)?,
        density: Some(grid.in_box(low.as_dvec3(), high.as_dvec3())),
        ..Medium::default()
    };
    let medium = add_medium(scene, medium);
    let boundary = add_boundary(scene, medium);
    scene.place(MeshBuilder::new(name, boundary).cuboid(low, high).build());
    Ok(())
}

fn smoke(values: &Values) -> Result<Scene> {
    let mut scene = Scene::default();
    let floor = scene.add_material(Material::lambert("floor", Vec3::new(0.4, 0.35, 0.3)));
    let wall = scene.add_material(Material::lambert("wall", Vec3::new(0.25, 0.35, 0.5)));
    let ground = [(-3.0, 3.0), (3.0, 3.0), (3.0, -1.5), (-3.0, -1.5)].map(|(x, z)| Vec3::new(x, 0.0, z));
    scene.place(MeshBuilder::new("floor", floor).quad(ground).build());
    let back = [(-3.0, 0.0), (3.0, 0.0), (3.0, 4.0), (-3.0, 4.0)].map(|(x, y)| Vec3::new(x, y, -1.5));
    scene.place(MeshBuilder::new("wall", wall).quad(back).build());
    let mut lamp = Material::lambert("light", Vec3::ZERO);
    lamp.emission = values.color("light")?;
    lamp.double_sided = false;
    let lamp = scene.add_material(lamp);
    // Above to the right, shining down.
    let panel = [(1.2, -0.4), (2.0, -0.4), (2.0, 0.4), (1.2, 0.4)].map(|(x, z)| Vec3::new(x, 3.2, z));
    scene.place(MeshBuilder::new("light", lamp).quad(panel).build());
    let bounds = [Vec3::new(-1.0, 0.01, -1.0), Vec3::new(1.0, 2.51, 1.0)];
    place_volume(&mut scene, "smoke", Generator::Smoke, values, bounds)?;
    scene.media[0].emission = values.color("emission")?;
    scene.environment = Some(Environment::uniform(Vec3::splat(values.real("environment")? as f32)));
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(0.6, 1.5, 5.2),
        DVec3::new(0.0, 1.25, 0.0),
        DVec3::Y,
        36f32.to_radians(),
    ));
    scene.cameras.push(Camera::look_at(
        "inside",
        DVec3::new(0.3, 1.2, 0.5),
        DVec3::new(-0.2, 1.6, -0.5),
        DVec3::Y,
        60f32.to_radians(),
    ));
    scene.defaults.aspect = Some(1.0);
    Ok(scene)
}

fn cloud(values: &Values) -> Result<Scene> {
    let mut scene = Scene::default();
    let plain = scene.add_material(Material::lambert("plain", Vec3::new(0.12, 0.18, 0.07)));
    let reach = 3000.0;
    let ground =
        [(-reach, reach), (reach, reach), (reach, -reach), (-reach, -reach)].map(|(x, z)| Vec3::new(x, 0.0, z));
    scene.place(MeshBuilder::new("plain", plain).quad(ground).build());
    let bounds = [Vec3::new(-200.0, 150.0, -200.0), Vec3::new(200.0, 450.0, 200.0)];
    place_volume(&mut scene, "cloud", Generator::Cloud, values, bounds)?;
    let sun = Vec3::new(0.7, 0.6, 0.35).normalize();
    scene.environment = Some(sky(sun, values.real("sky")? as f32));
    let irradiance = values.real("sun")? as f32;
    if irradiance > 0.0 {
        scene.add_light(
            "sun",
            LightKind::Directional {
                direction: -sun,
                irradiance: Vec3::splat(irradiance),
            },
        );
    }
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(0.0, 40.0, 620.0),
        DVec3::new(0.0, 270.0, 0.0),
        DVec3::Y,
        40f32.to_radians(),
    ));
    scene.defaults.aspect = Some(4.0 / 3.0);
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::super::generate;
    use crate::scene::SceneProfile;

    #[test]
    fn grids_fill_their_boundaries() {
        for (address, mesh) in [("builtin:smoke?size=8", "smoke"), ("builtin:cloud?size=8", "cloud")] {
            let scene = generate(address).expect("scene");
            let media = SceneProfile::of(&scene).media;
            assert!(media.heterogeneous && media.boundaries && media.count == 1);
            let grid = scene.media[0].density.as_ref().expect("grid");
            assert_eq!(grid.size, [8; 3]);
            let mesh = scene.meshes.iter().find(|m| m.name == mesh).expect("boundary");
            let inverse = grid.to_world.inverse();
            for p in &mesh.positions {
                let corner = inverse.transform_point3(p.as_dvec3());
                // Corners of the unit cube, up to the rounding of one multiplication and addition in f64.
                assert!((corner - corner.round()).abs().max_element() < 1e-14, "{corner}");
            }
        }
    }
}
