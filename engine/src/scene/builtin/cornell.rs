//! The Cornell box with its measured geometry.
//!
//! Geometry, light and camera: Cornell University Program of Computer Graphics, "Cornell Box Data" (published 1998; the box of
//! Goral, Torrance, Greenberg and Battaile, SIGGRAPH 1984, and its later measured version). Millimetres become metres. The measured
//! reflectance and emission spectra are represented by the linear RGB triples in common use for this scene.
//! The ceiling is cut out around the light, which the published data puts into the ceiling's plane, so that no two surfaces coincide.

use glam::{DVec3, Vec3};

use super::Entry;
use super::parameters::{Parameter, Values};
use super::shapes::{MeshBuilder, geodesic_sphere};
use crate::Result;
use crate::scene::{Camera, LightKind, Material, Scene, metals};

pub(super) const LIGHT_RADIANCE: Parameter = Parameter::color(
    "light",
    "17,12,4",
    0.0,
    1e6,
    "radiance of the ceiling light, W·m⁻²·sr⁻¹",
);
pub(super) const SOURCE: Parameter = Parameter::choice(
    "source",
    "area",
    &["area", "point", "spot"],
    "the ceiling light as measured, or a point or downward spot light of the same intensity straight down",
);
pub(super) const LAMP: Parameter = Parameter::real(
    "lamp",
    "1",
    0.01,
    1.0,
    "sides of the ceiling light, as a share of the measured ones; it keeps its power",
);
pub(super) const BOXES: Parameter = Parameter::choice(
    "boxes",
    "both",
    &["both", "short", "tall", "none"],
    "which blocks stand in the box",
);
pub(super) const SPHERE: Parameter = Parameter::choice(
    "sphere",
    "none",
    &["none", "glass", "mirror", "gold", "phong", "diffuse"],
    "a sphere of radius 0.08 m above the place of the short block",
);

const FRONT: Parameter = Parameter::choice(
    "front",
    "open",
    &["open", "glass"],
    "nothing before the box, or all of it full of glass, whose front is its only interface",
);

pub const CORNELL_BOX: Entry = Entry {
    name: "cornell-box",
    summary: "The measured Cornell box: two blocks in a box with one red and one green wall, lit from the ceiling.",
    parameters: &[LIGHT_RADIANCE, SOURCE, LAMP, BOXES, SPHERE, FRONT],
    build: build_with_front,
};

const MILLIMETRE: f32 = 1e-3;
/// Linear RGB reflectances in common use for the measured spectra.
const WHITE: Vec3 = Vec3::new(0.725, 0.71, 0.68);
const RED: Vec3 = Vec3::new(0.63, 0.065, 0.05);
const GREEN: Vec3 = Vec3::new(0.14, 0.45, 0.091);
/// The light's own reflectance as published.
const LIGHT_REFLECTANCE: f32 = 0.78;

const FLOOR: [[f32; 3]; 4] = [
    [552.8, 0.0, 0.0],
    [0.0, 0.0, 0.0],
    [0.0, 0.0, 559.2],
    [549.6, 0.0, 559.2],
];
const LIGHT: [[f32; 3]; 4] = [
    [343.0, 548.8, 227.0],
    [343.0, 548.8, 332.0],
    [213.0, 548.8, 332.0],
    [213.0, 548.8, 227.0],
];
const CEILING: [[f32; 3]; 4] = [
    [556.0, 548.8, 0.0],
    [556.0, 548.8, 559.2],
    [0.0, 548.8, 559.2],
    [0.0, 548.8, 0.0],
];
const BACK_WALL: [[f32; 3]; 4] = [
    [549.6, 0.0, 559.2],
    [0.0, 0.0, 559.2],
    [0.0, 548.8, 559.2],
    [556.0, 548.8, 559.2],
];
const GREEN_WALL: [[f32; 3]; 4] = [
    [0.0, 0.0, 559.2],
    [0.0, 0.0, 0.0],
    [0.0, 548.8, 0.0],
    [0.0, 548.8, 559.2],
];
const RED_WALL: [[f32; 3]; 4] = [
    [552.8, 0.0, 0.0],
    [549.6, 0.0, 559.2],
    [556.0, 548.8, 559.2],
    [556.0, 548.8, 0.0],
];
/// The top of the short block, and of the tall one; each stands on the floor below it.
const SHORT_BLOCK: [[f32; 3]; 4] = [
    [130.0, 165.0, 65.0],
    [82.0, 165.0, 225.0],
    [240.0, 165.0, 272.0],
    [290.0, 165.0, 114.0],
];
const TALL_BLOCK: [[f32; 3]; 4] = [
    [423.0, 330.0, 247.0],
    [265.0, 330.0, 296.0],
    [314.0, 330.0, 456.0],
    [472.0, 330.0, 406.0],
];
/// Published camera: position, focal length and film size in millimetres; it looks along +Z.
const EYE: [f64; 3] = [278.0, 273.0, -800.0];
const FOCAL_LENGTH: f64 = 35.0;
const FILM_SIZE: f64 = 25.0;

const SPHERE_RADIUS: f64 = 0.08;
/// Above the middle of the short block, a finger's breadth clear of its top.
const SPHERE_CENTRE: Vec3 = Vec3::new(0.1855, 0.255, 0.169);
/// 20 · 24² = 11,520 triangles.
const SPHERE_FREQUENCY: u32 = 24;

fn metres(corners: [[f32; 3]; 4]) -> [Vec3; 4] {
    corners.map(|c| Vec3::from_array(c) * MILLIMETRE)
}

fn build_with_front(values: &Values) -> Result<Scene> {
    let mut scene = build(values)?;
    if values.word("front")? == "glass" {
        let glass = scene.add_material(Material::glass("glass", 1.5));
        // Towards the eye: what is behind it is within the glass.
        let [right, left, ..] = metres(FLOOR);
        let [above_right, .., above_left] = metres(CEILING);
        scene.place(
            MeshBuilder::new("front", glass)
                .quad([left, above_left, above_right, right])
                .build(),
        );
    }
    Ok(scene)
}

/// The box of [`CORNELL_BOX`]'s parameters but what is before it.
pub(super) fn build(values: &Values) -> Result<Scene> {
    let mut scene = Scene::default();
    let white = scene.add_material(Material::lambert("white", WHITE));
    let red = scene.add_material(Material::lambert("red", RED));
    let green = scene.add_material(Material::lambert("green", GREEN));
    let measured = metres(LIGHT);
    let middle = (measured[0] + measured[2]) / 2.0;
    let lamp = values.real("lamp")? as f32;
    let light = measured.map(|corner| {
        if lamp == 1.0 {
            corner
        } else {
            middle + (corner - middle) * lamp
        }
    });
    let mut shell = MeshBuilder::new("white walls", white);
    shell.quad(metres(FLOOR)).quad(metres(BACK_WALL));
    let ceiling = metres(CEILING);
    let radiance = values.color("light")? / (lamp * lamp);
    let area = (light[1] - light[0]).cross(light[3] - light[0]).length();
    let area_light = values.word("source")? == "area";
    if area_light {
        for i in 0..4 {
            let next = (i + 1) % 4;
            shell.quad([ceiling[i], ceiling[next], light[next], light[i]]);
        }
    } else {
        shell.quad(ceiling);
    }
    scene.place(shell.build());
    scene.place(MeshBuilder::new("red wall", red).quad(metres(RED_WALL)).build());
    scene.place(MeshBuilder::new("green wall", green).quad(metres(GREEN_WALL)).build());
    if area_light {
        let mut material = Material::lambert("light", Vec3::splat(LIGHT_REFLECTANCE));
        material.emission = radiance;
        material.double_sided = false;
        let material = scene.add_material(material);
        scene.place(MeshBuilder::new("light", material).quad(light).build());
    } else {
        // Just below the ceiling; a Lambert emitter's intensity along its normal is radiance × area.
        let position = middle - Vec3::Y * 1e-2;
        let intensity = radiance * area;
        let kind = if values.word("source")? == "point" {
            LightKind::Point { position, intensity }
        } else {
            LightKind::Spot {
                position,
                direction: Vec3::NEG_Y,
                intensity,
                inner: 30f32.to_radians(),
                outer: 60f32.to_radians(),
            }
        };
        scene.add_light("light", kind);
    }
    let boxes = values.word("boxes")?;
    for (name, top) in [("short", SHORT_BLOCK), ("tall", TALL_BLOCK)] {
        if boxes == "both" || boxes == name {
            let top = metres(top);
            let mut block = MeshBuilder::new(&format!("{name} block"), white);
            block.quad(top);
            for i in 0..4 {
                let (a, b) = (top[i], top[(i + 1) % 4]);
                block.quad([a, a.with_y(0.0), b.with_y(0.0), b]);
            }
            scene.place(block.build());
        }
    }
    let sphere = match values.word("sphere")? {
        "glass" => Some(Material::glass("glass", 1.5)),
        "mirror" => Some(Material::mirror("mirror", Vec3::ONE)),
        "gold" => Some(Material {
            conductor: metals::by_name("gold"),
            roughness: 0.2,
            ..Material::mirror("gold", Vec3::ONE)
        }),
        "phong" => Some(Material::phong("phong", Vec3::splat(0.8), 0.5, 50.0)),
        "diffuse" => Some(Material::lambert("diffuse", Vec3::splat(0.5))),
        _ => None,
    };
    if let Some(material) = sphere {
        let material = scene.add_material(material);
        let ball = geodesic_sphere("sphere", material, SPHERE_RADIUS, SPHERE_FREQUENCY, true);
        scene.place(
            MeshBuilder::new("sphere", material)
                .append(&ball, |p| p + SPHERE_CENTRE)
                .build(),
        );
    }
    let eye = DVec3::from_array(EYE) * f64::from(MILLIMETRE);
    let fov = 2.0 * (FILM_SIZE / (2.0 * FOCAL_LENGTH)).atan();
    scene
        .cameras
        .push(Camera::look_at("main", eye, eye + DVec3::Z, DVec3::Y, fov as f32));
    scene.cameras.push(Camera::look_at(
        "inside",
        DVec3::new(0.5, 0.5, 0.05),
        DVec3::new(0.2, 0.15, 0.4),
        DVec3::Y,
        60f32.to_radians(),
    ));
    scene.defaults.aspect = Some(1.0);
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::super::generate;
    use super::super::shapes::{area, tests::open_edges};
    use super::*;

    fn mesh_area(scene: &Scene, name: &str) -> f64 {
        area(scene.meshes.iter().find(|m| m.name == name).expect("mesh"))
    }

    #[test]
    fn the_areas_are_those_of_the_published_data() {
        let scene = generate("builtin:cornell-box").expect("scene");
        // f32 corners of about 0.5 m are off by 3e-8 m; areas of lengths below 0.6 m by less than 1e-7 m².
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-7, "{a} {b}");
        near(mesh_area(&scene, "light"), 0.130 * 0.105);
        near(mesh_area(&scene, "green wall"), 0.5588 * 0.5592 * (548.8 / 558.8));
        let floor = (0.5528 + 0.5496) / 2.0 * 0.5592;
        let ceiling = 0.556 * 0.5592 - 0.130 * 0.105;
        let back = (0.5496 + 0.556) / 2.0 * 0.5488;
        near(mesh_area(&scene, "white walls"), floor + ceiling + back);
        assert_eq!(
            scene.meshes.iter().map(|m| m.triangles.len()).sum::<usize>(),
            12 + 2 + 2 + 2 + 20
        );
    }

    #[test]
    fn a_small_lamp_has_the_power_of_the_measured_one() {
        let power = |address: &str| {
            let scene = generate(address).expect("scene");
            let light = scene.materials.iter().find(|m| m.name == "light").expect("light");
            f64::from(light.emission.x) * mesh_area(&scene, "light")
        };
        // Corners of about 0.5 m are off by 3e-8 m, 5e-6 of the small lamp's shorter side.
        let ratio = power("builtin:cornell-box?lamp=0.05") / power("builtin:cornell-box");
        assert!((ratio - 1.0).abs() < 5e-5, "{ratio}");
    }

    #[test]
    fn shell_is_open_at_the_front_only() {
        let scene = generate("builtin:cornell-box?boxes=none").expect("scene");
        let mut all = MeshBuilder::new("", 0);
        for mesh in &scene.meshes {
            all.append(mesh, |p| p);
        }
        // The four edges of the missing front wall; everything else meets its neighbour with consistent winding.
        assert_eq!(open_edges(&all.build()), 4);
    }

    #[test]
    fn a_front_of_glass_is_one_more_quad_towards_the_eye() {
        let scene = generate("builtin:cornell-box?front=glass").expect("scene");
        let open = generate("builtin:cornell-box").expect("scene");
        assert_eq!(scene.meshes.len(), open.meshes.len() + 1);
        let front = scene.meshes.iter().find(|mesh| mesh.name == "front").expect("front");
        assert_eq!(front.triangles.len(), 2);
        for triangle in &front.triangles {
            let [a, b, c] = triangle.map(|i| front.positions[i as usize]);
            assert!((b - a).cross(c - a).z < 0.0 && [a, b, c].iter().all(|corner| corner.z == 0.0));
        }
    }

    #[test]
    fn blocks_are_open_at_the_floor_only_and_face_outward() {
        let scene = generate("builtin:cornell-box").expect("scene");
        for (name, height) in [("short block", 0.165), ("tall block", 0.33)] {
            let mesh = scene.meshes.iter().find(|m| m.name == name).expect("block");
            assert_eq!(open_edges(mesh), 4);
            let top = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
            let normal = (top[1] - top[0]).cross(top[2] - top[0]);
            assert!(normal.y > 0.0 && (top[0].y - height).abs() < 1e-6);
        }
    }

    #[test]
    fn the_light_shines_down_and_the_camera_sees_red_on_the_left() {
        let scene = generate("builtin:cornell-box?light=1,2,3").expect("scene");
        let light = scene.meshes.iter().find(|m| m.name == "light").expect("light");
        let [a, b, c] = light.triangles[0].map(|i| light.positions[i as usize]);
        assert!((b - a).cross(c - a).y < 0.0);
        let material = &scene.materials[light.material.expect("material") as usize];
        assert_eq!(material.emission, Vec3::new(1.0, 2.0, 3.0));
        let view = scene.cameras[0].transform.inverse();
        assert!(view.transform_point3(DVec3::new(0.55, 0.3, 0.3)).x < 0.0);
        assert!(view.transform_point3(DVec3::new(0.28, 0.3, 0.3)).z < 0.0);
    }

    #[test]
    fn every_choice_builds() {
        for source in ["area", "point", "spot"] {
            for sphere in ["none", "glass", "mirror", "gold", "phong", "diffuse"] {
                generate(&format!(
                    "builtin:cornell-box?source={source}&sphere={sphere}&boxes=tall"
                ))
                .expect("scene");
            }
        }
    }
}
