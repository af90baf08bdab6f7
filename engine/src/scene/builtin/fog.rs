//! Thin fog: the Cornell box filled with it, and a point light in an endless one.
//!
//! The second is the airlight problem, whose single scattering has a closed form (Sun, Ramamoorthi, Narasimhan and Nayar, "A Practical
//! Analytic Single Scattering Model for Real Time Rendering", SIGGRAPH 2005), and whose fluence is that of a point source in an infinite
//! medium (Grosjean 1956).

use glam::{DVec3, Vec3};

use super::Entry;
use super::cornell;
use super::media::{G, PHASE, add_boundary, add_medium, coefficient, medium};
use super::parameters::{Parameter, Values};
use super::shapes::MeshBuilder;
use crate::Result;
use crate::scene::{Camera, LightKind, Material, Scene};

pub const FOG_BOX: Entry = Entry {
    name: "fog-box",
    summary: "The Cornell box in thin fog.",
    parameters: &[
        coefficient("sigma_a", "0.1", "absorption coefficient, 1/m"),
        coefficient("sigma_s", "1.5", "scattering coefficient, 1/m"),
        PHASE,
        G,
        Parameter::choice(
            "fill",
            "box",
            &["box", "everywhere"],
            "fog in a box just around the walls, or in all of space",
        ),
        cornell::LIGHT_RADIANCE,
        cornell::SOURCE,
        cornell::LAMP,
        cornell::BOXES,
        cornell::SPHERE,
    ],
    build: fog_box,
};

pub const POINT_IN_FOG: Entry = Entry {
    name: "point-in-fog",
    summary: "A point light in endless fog in front of a wall: airlight.",
    parameters: &[
        coefficient("sigma_a", "0.02", "absorption coefficient, 1/m"),
        coefficient("sigma_s", "0.08", "scattering coefficient, 1/m"),
        PHASE,
        G,
        Parameter::color("light", "100", 0.0, 1e9, "intensity of the light, W/sr"),
        Parameter::real("distance", "10", 0.01, 1e4, "from the camera to the light, m"),
        Parameter::choice(
            "wall",
            "black",
            &["black", "white", "none"],
            "what stands as far behind the light as the light stands from the camera",
        ),
    ],
    build: point_in_fog,
};

fn fog_box(values: &Values) -> Result<Scene> {
    let mut scene = cornell::build(values)?;
    let fog = add_medium(&mut scene, medium("fog", values)?);
    if values.word("fill")? == "everywhere" {
        scene.surrounding = Some(fog);
    } else {
        // Around the walls and not inside them, so that everything in the box lies in the fog.
        let boundary = add_boundary(&mut scene, fog);
        let (low, high) = (Vec3::splat(-0.02), Vec3::splat(0.58));
        scene.place(MeshBuilder::new("fog", boundary).cuboid(low, high).build());
    }
    Ok(scene)
}

fn point_in_fog(values: &Values) -> Result<Scene> {
    let mut scene = Scene::default();
    let fog = add_medium(&mut scene, medium("fog", values)?);
    scene.surrounding = Some(fog);
    scene.add_light(
        "light",
        LightKind::Point {
            position: Vec3::ZERO,
            intensity: values.color("light")?,
        },
    );
    let distance = values.real("distance")?;
    let wall = values.word("wall")?;
    if wall != "none" {
        let reflectance = if wall == "white" { 0.8 } else { 0.0 };
        let material = scene.add_material(Material::lambert("wall", Vec3::splat(reflectance)));
        let reach = 20.0 * distance as f32;
        let at = |x: f32, y: f32| Vec3::new(x * reach, y * reach, -distance as f32);
        let corners = [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)];
        scene.place(MeshBuilder::new("wall", material).quad(corners).build());
    }
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::Z * distance,
        DVec3::ZERO,
        DVec3::Y,
        60f32.to_radians(),
    ));
    scene.defaults.aspect = Some(1.0);
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::super::generate;
    use crate::scene::SceneProfile;

    #[test]
    fn fog_is_in_a_box_or_everywhere() {
        let of = |address: &str| SceneProfile::of(&generate(&format!("builtin:{address}")).expect("scene"));
        let boxed = of("fog-box?sphere=glass");
        assert!(boxed.media.boundaries && !boxed.media.surrounding && boxed.transmission.solid);
        let filled = of("fog-box?fill=everywhere");
        assert!(filled.media.surrounding && !filled.media.boundaries);
        assert_eq!((of("fog-box").triangles, filled.triangles), (38 + 12, 38));
        assert_eq!(of("point-in-fog?wall=none").triangles, 0);
    }
}
