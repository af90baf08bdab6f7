//! A plane-parallel dielectric slab in a uniform environment: interface losses and Beer–Lambert attenuation in closed form.
//!
//! With radiance 1 around it, a ray at normal incidence sees R + T of the slab, with R and T the sums over internal reflections
//! (Born and Wolf, "Principles of Optics", §1.6, incoherent case); without attenuation that is 1.

use glam::{DVec3, Vec3};

use super::Entry;
use super::parameters::{Parameter, Values};
use super::shapes::MeshBuilder;
use crate::Result;
use crate::scene::{Camera, Environment, Material, Projection, Scene};

pub const SLAB: Entry = Entry {
    name: "slab",
    summary: "A plane-parallel glass slab in a uniform environment, seen straight on by an orthographic camera.",
    parameters: &[
        Parameter::real("thickness", "0.1", 0.001, 10.0, "thickness, m"),
        Parameter::real("size", "4", 0.1, 1000.0, "side length, m"),
        Parameter::real("ior", "1.5", 1.0, 4.0, "index of refraction"),
        Parameter::real("roughness", "0", 0.0, 1.0, "perceptual roughness of both faces"),
        Parameter::color(
            "attenuation_color",
            "1",
            0.0,
            1.0,
            "transmittance of attenuation_distance",
        ),
        Parameter::real(
            "attenuation_distance",
            "0.1",
            1e-4,
            1e4,
            "distance of that transmittance, m",
        ),
        Parameter::real("environment", "1", 0.0, 1e6, "radiance of the environment, W·m⁻²·sr⁻¹"),
        Parameter::real("tilt", "0", 0.0, 80.0, "angle of incidence of the main camera, degrees"),
    ],
    build,
};

fn build(values: &Values) -> Result<Scene> {
    let mut scene = Scene::default();
    let thickness = values.real("thickness")? as f32;
    let half = values.real("size")? as f32 / 2.0;
    let material = scene.add_material(Material {
        thickness,
        roughness: values.real("roughness")? as f32,
        attenuation_color: values.color("attenuation_color")?,
        attenuation_distance: values.real("attenuation_distance")? as f32,
        ..Material::glass("slab", values.real("ior")? as f32)
    });
    let corner = Vec3::new(half, half, thickness / 2.0);
    scene.place(MeshBuilder::new("slab", material).cuboid(-corner, corner).build());
    scene.environment = Some(Environment::uniform(Vec3::splat(values.real("environment")? as f32)));
    let tilt = values.real("tilt")?.to_radians();
    let distance = 2.0 * f64::from(half) + f64::from(thickness);
    let mut camera = Camera::look_at(
        "main",
        DVec3::new(tilt.sin(), 0.0, tilt.cos()) * distance,
        DVec3::ZERO,
        DVec3::Y,
        0.5,
    );
    camera.projection = Projection::Orthographic {
        half_height: half / 8.0,
    };
    scene.cameras.push(camera);
    scene.defaults.aspect = Some(1.0);
    Ok(scene)
}
