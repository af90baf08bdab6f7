//! Rooms: a furnished box room with a mirror wall, two rooms joined by a narrow passage, and a checkered room with a divider.
//!
//! The first two have the size of the "Scene 6" (6 × 6 × 3 m, 804 triangles, one mirror wall) and "Passage" (2 × 1 × 1 m, a red room with
//! a white light and a white room) benchmarks of the photon-mapping literature; their layout is our own. The third stands in for the
//! checkered box room and divider room of the literature on approximate reflections.

use glam::{DVec3, Vec2, Vec3};

use super::Entry;
use super::media::{ABSORPTION, G, PHASE, SCATTERING, surround};
use super::parameters::{Parameter, Values};
use super::shapes::{MeshBuilder, cuboid_faces, lat_long_sphere, point_lamp, textured_quad};
use super::textures::{checker, plain};
use crate::Result;
use crate::scene::{Camera, Filter, Material, Scene, metals};

/// What a sphere may be made of.
const METALS: &[&str] = &["gold", "silver", "copper", "aluminium", "mirror", "none"];

pub const BOX_ROOM: Entry = Entry {
    name: "box-room",
    summary: "A furnished closed room of 6 × 3 × 6 m with one mirror wall: 804 triangles.",
    parameters: &[
        Parameter::choice(
            "contents",
            "furnished",
            &["furnished", "empty"],
            "table, boxes and a globe, or nothing",
        ),
        Parameter::choice("mirror", "yes", &["yes", "no"], "whether the wall at x = 0 is a mirror"),
        Parameter::choice(
            "source",
            "area",
            &["area", "point"],
            "a ceiling panel, or a point light at (3, 2.5, 3)",
        ),
        Parameter::color(
            "light",
            "12",
            0.0,
            1e6,
            "radiance of the panel, or intensity of the point light",
        ),
        Parameter::choice(
            "object",
            "none",
            METALS,
            "metal of a sphere of radius 0.4 m beside the furniture",
        ),
        Parameter::real(
            "place",
            "0",
            0.0,
            1.0,
            "share of the sphere's way from (3, 1.2, 4) into the corner at (0.7, 1.2, 5.3)",
        ),
    ],
    build: box_room,
};

pub const PASSAGE: Entry = Entry {
    name: "passage",
    summary: "Two closed rooms joined by a narrow passage: the light in the red one, the camera in the white one.",
    parameters: &[
        Parameter::real("width", "0.2", 0.01, 0.8, "width of the passage, m"),
        Parameter::real("length", "0.2", 0.01, 0.8, "length of the passage, m"),
        Parameter::color("light", "40", 0.0, 1e6, "radiance of the light panel, W·m⁻²·sr⁻¹"),
        ABSORPTION,
        SCATTERING,
        PHASE,
        G,
    ],
    build: passage,
};

pub const DIVIDER_ROOM: Entry = Entry {
    name: "divider-room",
    summary: "A checkered cubic room with a divider wall and a metal sphere: occlusion that reflections must see.",
    parameters: &[
        Parameter::choice("divider", "yes", &["yes", "no"], "whether the divider stands"),
        Parameter::choice("object", "gold", METALS, "metal of the sphere"),
        Parameter::real("roughness", "0", 0.0, 1.0, "perceptual roughness of the sphere"),
        Parameter::real(
            "place",
            "0",
            0.0,
            1.0,
            "share of the sphere's way from (0.3, -1, 0.9) before the divider to (1.3, -1, 0.3) beside its end",
        ),
        Parameter::choice(
            "source",
            "area",
            &["area", "point"],
            "a ceiling panel, or a point light at (0, 1.6, 0), above the divider",
        ),
        Parameter::color(
            "light",
            "10",
            0.0,
            1e6,
            "radiance of the panel, W·m⁻²·sr⁻¹, or intensity of the point light, W·sr⁻¹",
        ),
    ],
    build: divider_room,
};

/// A light panel that shines down.
fn panel(scene: &mut Scene, radiance: Vec3, middle: Vec3, half: Vec2) {
    let mut material = Material::lambert("light", Vec3::ZERO);
    material.emission = radiance;
    material.double_sided = false;
    let material = scene.add_material(material);
    let corner = |x: f32, z: f32| middle + Vec3::new(x * half.x, 0.0, z * half.y);
    scene.place(
        MeshBuilder::new("light", material)
            .quad([
                corner(-1.0, -1.0),
                corner(1.0, -1.0),
                corner(1.0, 1.0),
                corner(-1.0, 1.0),
            ])
            .build(),
    );
}

/// The sphere of the parameters `object` and `place`, somewhere on a way: metal of this perceptual roughness.
fn metal_sphere(
    scene: &mut Scene,
    values: &Values,
    [from, to]: [Vec3; 2],
    (radius, roughness): (f64, f32),
) -> Result<()> {
    let object = values.word("object")?;
    if object == "none" {
        return Ok(());
    }
    let metal = scene.add_material(Material {
        conductor: metals::by_name(object),
        roughness,
        ..Material::mirror(object, Vec3::ONE)
    });
    let middle = from + values.real("place")? as f32 * (to - from);
    let ball = lat_long_sphere("object", metal, radius, 96, 48);
    scene.place(MeshBuilder::new("object", metal).append(&ball, |p| p + middle).build());
    Ok(())
}

fn box_room(values: &Values) -> Result<Scene> {
    let size = Vec3::new(6.0, 3.0, 6.0);
    let mut scene = Scene::default();
    let white = scene.add_material(Material::lambert("plaster", Vec3::splat(0.7)));
    let wood = scene.add_material(Material::lambert("wood", Vec3::new(0.45, 0.28, 0.15)));
    let blue = scene.add_material(Material::lambert("blue", Vec3::new(0.15, 0.25, 0.6)));
    let mirror = scene.add_material(Material::mirror("mirror", Vec3::splat(0.9)));
    let [left, faces @ ..] = cuboid_faces(Vec3::ZERO, size);
    let mut walls = MeshBuilder::new("walls", white);
    for [a, b, c, d] in faces {
        walls.quad([a, d, c, b]);
    }
    scene.place(walls.build());
    let [a, b, c, d] = left;
    let material = if values.yes("mirror")? { mirror } else { white };
    scene.place(MeshBuilder::new("mirror wall", material).quad([a, d, c, b]).build());
    let light = values.color("light")?;
    if values.word("source")? == "area" {
        panel(&mut scene, light, Vec3::new(3.0, 2.98, 3.0), Vec2::splat(0.6));
    } else {
        point_lamp(&mut scene, Vec3::new(3.0, 2.5, 3.0), light);
    }
    if values.word("contents")? == "furnished" {
        // A finger's breadth above the floor, so that no two faces coincide.
        let rest = 0.005;
        let mut table = MeshBuilder::new("table", wood);
        table.cuboid(Vec3::new(2.2, 0.72, 2.0), Vec3::new(3.8, 0.76, 3.0));
        for (x, z) in [(2.25, 2.05), (3.67, 2.05), (2.25, 2.87), (3.67, 2.87)] {
            table.cuboid(Vec3::new(x, rest, z), Vec3::new(x + 0.08, 0.72 - rest, z + 0.08));
        }
        scene.place(table.build());
        let mut boxes = MeshBuilder::new("boxes", blue);
        boxes
            .cuboid(Vec3::new(0.8, rest, 0.6), Vec3::new(1.5, 1.2, 1.3))
            .cuboid(Vec3::new(4.6, rest, 0.5), Vec3::new(5.5, 2.0, 1.1))
            .cuboid(Vec3::new(4.8, rest, 4.0), Vec3::new(5.6, 0.5, 5.0))
            .cuboid(Vec3::new(1.0, rest, 3.8), Vec3::new(1.5, 0.5, 4.3));
        scene.place(boxes.build());
        let globe = lat_long_sphere("globe", white, 0.25, 31, 12);
        let mut placed = MeshBuilder::new("globe", white);
        placed.append(&globe, |p| p + Vec3::new(2.8, 1.02, 2.5));
        scene.place(placed.build());
    }
    let way = [Vec3::new(3.0, 1.2, 4.0), Vec3::new(0.7, 1.2, 5.3)];
    metal_sphere(&mut scene, values, way, (0.4, 0.0))?;
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(5.4, 1.7, 5.5),
        DVec3::new(1.5, 0.9, 1.5),
        DVec3::Y,
        60f32.to_radians(),
    ));
    scene.cameras.push(Camera::look_at(
        "corner",
        DVec3::new(0.5, 2.6, 0.5),
        DVec3::new(4.0, 0.5, 4.0),
        DVec3::Y,
        70f32.to_radians(),
    ));
    scene.defaults.aspect = Some(4.0 / 3.0);
    Ok(scene)
}

fn passage(values: &Values) -> Result<Scene> {
    let half_width = values.real("width")? as f32 / 2.0;
    let half_length = values.real("length")? as f32 / 2.0;
    let mut scene = Scene::default();
    let red = scene.add_material(Material::lambert("red", Vec3::new(0.7, 0.12, 0.1)));
    let white = scene.add_material(Material::lambert("white", Vec3::splat(0.75)));
    let (near, far) = (0.5 - half_width, 0.5 + half_width);
    // Both rooms are mirror images of each other around x = 1; `side` −1 is the red one.
    for (name, material, side) in [("red room", red, -1.0f32), ("white room", white, 1.0)] {
        let at = |x: f32, y: f32, z: f32| Vec3::new(1.0 + side * x, y, z);
        let door = half_length;
        let mut faces: Vec<Vec<Vec3>> = Vec::new();
        // Floor and ceiling share the door's corners with the passage: no T-junctions.
        let plan = [
            (1.0, 0.0),
            (1.0, 1.0),
            (door, 1.0),
            (door, far),
            (door, near),
            (door, 0.0),
        ];
        faces.push(plan.iter().map(|&(x, z)| at(x, 0.0, z)).collect());
        faces.push(plan.iter().rev().map(|&(x, z)| at(x, 1.0, z)).collect());
        let mut wall = |from: (f32, f32), to: (f32, f32)| {
            let ((x0, z0), (x1, z1)) = (from, to);
            faces.push(vec![at(x0, 0.0, z0), at(x1, 0.0, z1), at(x1, 1.0, z1), at(x0, 1.0, z0)]);
        };
        for i in 0..plan.len() {
            // The passage's mouth stays open.
            if plan[i] != (door, far) {
                wall(plan[(i + 1) % plan.len()], plan[i]);
            }
        }
        let mut room = MeshBuilder::new(name, material);
        for mut face in faces {
            if side > 0.0 {
                face.reverse();
            }
            room.fan(&face);
        }
        scene.place(room.build());
    }
    let (left, right) = (1.0 - half_length, 1.0 + half_length);
    let mut corridor = MeshBuilder::new("passage", white);
    let [_, _, floor, ceiling, front, back] = cuboid_faces(Vec3::new(left, 0.0, near), Vec3::new(right, 1.0, far));
    for [a, b, c, d] in [floor, ceiling, front, back] {
        corridor.quad([a, d, c, b]);
    }
    scene.place(corridor.build());
    panel(
        &mut scene,
        values.color("light")?,
        Vec3::new(0.35, 0.98, 0.5),
        Vec2::splat(0.1),
    );
    surround(&mut scene, "haze", values)?;
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(1.92, 0.6, 0.9),
        DVec3::new(1.1, 0.4, 0.4),
        DVec3::Y,
        70f32.to_radians(),
    ));
    scene.cameras.push(Camera::look_at(
        "red",
        DVec3::new(0.1, 0.6, 0.1),
        DVec3::new(0.9, 0.4, 0.6),
        DVec3::Y,
        70f32.to_radians(),
    ));
    scene.defaults.aspect = Some(1.0);
    Ok(scene)
}

fn divider_room(values: &Values) -> Result<Scene> {
    const SIDE: f32 = 4.0;
    let mut scene = Scene::default();
    let image = scene.add_image(checker(
        "checker",
        256,
        8,
        [Vec3::splat(0.7), Vec3::new(0.15, 0.2, 0.35)],
    ));
    let mut tiles = Material::lambert("tiles", Vec3::ONE);
    tiles.base_color_texture = Some(plain(image, Filter::Nearest));
    let tiles = scene.add_material(tiles);
    let wall = scene.add_material(Material::lambert("divider", Vec3::new(0.6, 0.25, 0.2)));
    let high = Vec3::splat(SIDE / 2.0);
    for (i, [a, b, c, d]) in cuboid_faces(-high, high).into_iter().enumerate() {
        scene.place(textured_quad(&format!("wall {i}"), tiles, [a, d, c, b], Vec2::ONE));
    }
    if values.yes("divider")? {
        let divider = MeshBuilder::new("divider", wall)
            .cuboid(Vec3::new(-1.99, -1.99, -0.05), Vec3::new(0.4, 0.6, 0.05))
            .build();
        scene.place(divider);
    }
    let way = [Vec3::new(0.3, -1.0, 0.9), Vec3::new(1.3, -1.0, 0.3)];
    metal_sphere(&mut scene, values, way, (0.6, values.real("roughness")? as f32))?;
    let light = values.color("light")?;
    if values.word("source")? == "area" {
        panel(&mut scene, light, Vec3::new(0.0, 1.98, -0.6), Vec2::new(0.7, 0.7));
    } else {
        point_lamp(&mut scene, Vec3::new(0.0, 1.6, 0.0), light);
    }
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(1.7, 0.5, 1.9),
        DVec3::new(0.0, -0.8, 0.3),
        DVec3::Y,
        65f32.to_radians(),
    ));
    scene.defaults.aspect = Some(1.0);
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::super::generate;
    use super::super::shapes::{
        area,
        tests::{open_edges, volume},
    };
    use super::*;
    use crate::scene::SceneProfile;

    #[test]
    fn the_furnished_box_room_has_804_triangles() {
        let count =
            |query: &str| SceneProfile::of(&generate(&format!("builtin:box-room?{query}")).expect("scene")).triangles;
        assert_eq!(count(""), 804);
        assert_eq!(count("contents=empty&source=point"), 12);
    }

    #[test]
    fn the_empty_box_room_is_a_closed_144_square_metre_box() {
        let scene = generate("builtin:box-room?contents=empty&source=point").expect("scene");
        let mut all = MeshBuilder::new("", 0);
        for mesh in &scene.meshes {
            all.append(mesh, |p| p);
        }
        let all = all.build();
        assert_eq!((area(&all), volume(&all), open_edges(&all)), (144.0, -108.0, 0));
    }

    #[test]
    fn haze_fills_both_rooms() {
        let media =
            |query: &str| SceneProfile::of(&generate(&format!("builtin:passage?{query}")).expect("scene")).media;
        assert!(media("sigma_s=0.5&g=0.6").surrounding && media("sigma_s=0.5&g=0.6").phases.henyey_greenstein);
        assert!(!media("g=0.6").any());
    }

    #[test]
    fn spheres_move_clear_of_walls_and_furniture() {
        // Rooms, their walls, and what stands below or beside the way.
        let v = DVec3::new;
        let rooms = [
            (
                "builtin:divider-room?source=point",
                [v(-2.0, -2.0, -2.0), v(2.0, 2.0, 2.0)],
                [v(-1.99, -1.99, -0.05), v(0.4, 0.6, 0.05)],
                [v(0.3, -1.0, 0.9), v(1.3, -1.0, 0.3)],
            ),
            (
                "builtin:box-room?source=point&mirror=no&object=mirror",
                [v(0.0, 0.0, 0.0), v(6.0, 3.0, 6.0)],
                [v(1.0, 0.0, 3.8), v(1.5, 0.5, 4.3)],
                [v(3.0, 1.2, 4.0), v(0.7, 1.2, 5.3)],
            ),
        ];
        for (room, walls, obstacle, [from, to]) in rooms {
            for place in [0.0, 0.25, 0.5, 0.75, 1.0] {
                let scene = generate(&format!("{room}&place={place}")).expect("scene");
                assert!(scene.lights.len() == 1 && !scene.meshes.iter().any(|mesh| mesh.name == "light"));
                let object = scene
                    .meshes
                    .iter()
                    .find(|mesh| mesh.name == "object")
                    .expect("a sphere");
                let [low, high] = object.bounds().map(|corner| corner.as_dvec3());
                let (middle, radius) = (low.midpoint(high), (high.y - low.y) / 2.0);
                // Corners are f32.
                assert!(
                    middle.distance(from.lerp(to, place)) < 1e-5,
                    "{room}, {place}: {middle}"
                );
                assert!(
                    low.cmpgt(walls[0]).all() && high.cmplt(walls[1]).all(),
                    "{room}, {place}"
                );
                let nearest = middle.clamp(obstacle[0], obstacle[1]);
                assert!(middle.distance(nearest) > radius, "{room}, {place}: {nearest}");
            }
        }
        let names = |address: &str| -> Vec<String> {
            let scene = generate(address).expect("scene");
            scene.meshes.into_iter().map(|mesh| mesh.name).collect()
        };
        assert!(!names("builtin:box-room").contains(&"object".to_owned()));
        assert!(names("builtin:divider-room").contains(&"light".to_owned()));
    }

    #[test]
    fn the_passage_is_one_closed_space() {
        for (width, length) in [(0.2, 0.2), (0.01, 0.8), (0.8, 0.01)] {
            let scene = generate(&format!("builtin:passage?width={width}&length={length}")).expect("scene");
            let mut all = MeshBuilder::new("", 0);
            for mesh in scene.meshes.iter().filter(|m| m.name != "light") {
                all.append(mesh, |p| p);
            }
            let all = all.build();
            assert_eq!(open_edges(&all), 0);
            // Two rooms of (1 − length/2) m² plan and the passage, seen from inside; f32 corners are good to 1e-7.
            let expected = 2.0 * (1.0 - length / 2.0) + width * length;
            assert!((volume(&all) + expected).abs() < 1e-6, "{} {expected}", volume(&all));
        }
    }
}
