//! A room as games have them: crates, balls and a pillar under several lamps, and one body that reflects all of it.

use glam::{DAffine3, DVec3, Vec2, Vec3};

use super::Entry;
use super::parameters::{Parameter, Values};
use super::shapes::{MeshBuilder, REST, cuboid_faces, geodesic_sphere, textured_quad};
use super::surfaces::{glossy, plastic};
use super::textures::{checker, plain};
use crate::Result;
use crate::scene::{Camera, Filter, LightKind, Material, Mesh, Scene};

pub const GAME_ROOM: Entry = Entry {
    name: "game-room",
    summary: "A tiled room with crates, balls and a pillar under three lamps, and one body that reflects them.",
    parameters: &[
        Parameter::choice(
            "object",
            "sphere",
            &["sphere", "box", "none"],
            "the body that reflects, the scene's last object",
        ),
        Parameter::choice(
            "surface",
            "mirror",
            &["mirror", "gold", "plastic"],
            "what that body is made of",
        ),
        Parameter::real("roughness", "0", 0.0, 1.0, "perceptual roughness of that body"),
        Parameter::choice(
            "source",
            "point",
            &["point", "area"],
            "points, or panels below the ceiling",
        ),
        Parameter::color(
            "light",
            "7",
            0.0,
            1e6,
            "intensity of each lamp, of a panel along its normal, W/sr",
        ),
    ],
    build,
};

/// Half of the room's sides, and its height, m.
const HALF: Vec2 = Vec2::new(4.0, 3.0);
const HEIGHT: f32 = 3.0;
/// Tiles across the floor's longer side.
const TILES: u32 = 8;
/// Lower and upper corners of crates, the second one on the first.
const CRATES: [[[f32; 3]; 2]; 4] = [
    [[-2.8, REST, -2.4], [-1.8, 1.0, -1.4]],
    [[-2.6, 1.0 + REST, -2.2], [-1.9, 1.7, -1.5]],
    [[1.7, REST, -2.6], [2.7, 0.9, -1.7]],
    [[1.9, REST, 0.9], [2.7, 0.6, 1.7]],
];
const PILLAR: [[f32; 3]; 2] = [[-1.3, REST, 0.3], [-0.9, HEIGHT - REST, 0.7]];
/// Middles and radii of balls: a matte one and a glossy one.
const BALLS: [([f32; 3], f64); 2] = [([1.3, 0.36, -0.6], 0.35), ([-0.5, 0.26, 1.6], 0.25)];
/// 20 · 12² triangles.
const BALL_FREQUENCY: u32 = 12;
/// Lamps' places and tints.
const LAMPS: [([f32; 3], [f32; 3]); 3] = [
    ([-2.4, 2.6, -0.9], [1.0, 0.85, 0.7]),
    ([2.3, 2.6, -1.2], [0.8, 0.9, 1.0]),
    ([0.8, 2.6, 1.9], [1.0, 1.0, 1.0]),
];
/// Height and half a side of panels in place of points, m.
const PANEL_HEIGHT: f32 = 2.95;
const PANEL_HALF: f32 = 0.2;
/// Middle of the body that reflects, the radius of the sphere, and half a side of the box.
const OBJECT: DVec3 = DVec3::new(0.4, 0.7, 0.2);
const RADIUS: f64 = 0.5;
const HALF_BOX: f32 = 0.4;
/// 20 · 24² triangles.
const OBJECT_FREQUENCY: u32 = 24;

fn build(values: &Values) -> Result<Scene> {
    let mut scene = Scene::default();
    place_walls(&mut scene);
    let wood = scene.add_material(Material::lambert("wood", Vec3::new(0.5, 0.33, 0.17)));
    let stone = scene.add_material(Material::lambert("stone", Vec3::new(0.45, 0.45, 0.5)));
    let mut crates = MeshBuilder::new("crates", wood);
    for [low, high] in CRATES {
        crates.cuboid(low.into(), high.into());
    }
    scene.place(crates.build());
    let [low, high] = PILLAR;
    scene.place(
        MeshBuilder::new("pillar", stone)
            .cuboid(low.into(), high.into())
            .build(),
    );
    let red = scene.add_material(Material::lambert("red", Vec3::new(0.65, 0.1, 0.08)));
    let blue = scene.add_material(plastic("blue", Vec3::new(0.08, 0.15, 0.6), 0.4));
    for (material, (middle, radius)) in [red, blue].into_iter().zip(BALLS) {
        let ball = geodesic_sphere("ball", material, radius, BALL_FREQUENCY, true);
        let placed = |p: Vec3| p + Vec3::from_array(middle);
        scene.place(MeshBuilder::new("ball", material).append(&ball, placed).build());
    }
    place_lamps(&mut scene, values.color("light")?, values.word("source")? == "area");
    let roughness = values.real("roughness")? as f32;
    let surface = glossy(values.word("surface")?, Vec3::new(0.6, 0.6, 0.55), roughness);
    let object = values.word("object")?;
    if object != "none" {
        let surface = scene.add_material(surface);
        place_object(&mut scene, object_mesh(object, surface));
    }
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(3.3, 1.7, 2.6),
        DVec3::new(-0.2, 0.7, -0.4),
        DVec3::Y,
        60f32.to_radians(),
    ));
    scene.defaults.aspect = Some(4.0 / 3.0);
    Ok(scene)
}

fn place_walls(scene: &mut Scene) {
    let image = scene.add_image(checker(
        "tiles",
        256,
        TILES,
        [Vec3::splat(0.65), Vec3::new(0.2, 0.22, 0.25)],
    ));
    let mut tiles = Material::lambert("tiles", Vec3::ONE);
    tiles.base_color_texture = Some(plain(image, Filter::Nearest));
    let tiles = scene.add_material(tiles);
    let plaster = scene.add_material(Material::lambert("plaster", Vec3::new(0.7, 0.66, 0.6)));
    let (low, high) = (Vec3::new(-HALF.x, 0.0, -HALF.y), Vec3::new(HALF.x, HEIGHT, HALF.y));
    let [left, right, floor, ceiling, front, back] = cuboid_faces(low, high);
    let mut walls = MeshBuilder::new("walls", plaster);
    for [a, b, c, d] in [left, right, ceiling, front, back] {
        walls.quad([a, d, c, b]);
    }
    scene.place(walls.build());
    let [a, b, c, d] = floor;
    // Square tiles: texture coordinates go along z first.
    let repeat = Vec2::new(HALF.y / HALF.x, 1.0);
    scene.place(textured_quad("floor", tiles, [a, d, c, b], repeat));
}

fn place_lamps(scene: &mut Scene, light: Vec3, are_panels: bool) {
    for (i, (place, tint)) in LAMPS.into_iter().enumerate() {
        let (position, intensity) = (Vec3::from_array(place), light * Vec3::from_array(tint));
        if !are_panels {
            scene.add_light(format!("lamp {i}"), LightKind::Point { position, intensity });
            continue;
        }
        let mut material = Material::lambert("lamp", Vec3::ZERO);
        // A Lambert emitter's intensity along its normal is radiance × area.
        material.emission = intensity / (4.0 * PANEL_HALF * PANEL_HALF);
        material.double_sided = false;
        let material = scene.add_material(material);
        let middle = position.with_y(PANEL_HEIGHT);
        let corner = |x: f32, z: f32| middle + PANEL_HALF * Vec3::new(x, 0.0, z);
        let corners = [
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ];
        scene.place(MeshBuilder::new("lamp", material).quad(corners).build());
    }
}

/// The body about the origin.
fn object_mesh(object: &str, material: u32) -> Mesh {
    if object == "box" {
        let half = Vec3::splat(HALF_BOX);
        MeshBuilder::new("object", material).cuboid(-half, half).build()
    } else {
        geodesic_sphere("object", material, RADIUS, OBJECT_FREQUENCY, true)
    }
}

/// Places the body by its instance's transform, so that a host can move it about its middle.
fn place_object(scene: &mut Scene, mesh: Mesh) {
    scene.place(mesh);
    if let Some(instance) = scene.instances.last_mut() {
        instance.transform = DAffine3::from_translation(OBJECT);
    }
}

#[cfg(test)]
mod tests {
    use super::super::generate;
    use super::super::shapes::tests::{open_edges, volume};
    use super::*;

    #[test]
    fn the_room_is_closed_and_what_stands_in_it_touches_nothing() {
        let scene = generate("builtin:game-room").expect("scene");
        let mut shell = MeshBuilder::new("", 0);
        for mesh in scene
            .meshes
            .iter()
            .filter(|mesh| ["walls", "floor"].contains(&&*mesh.name))
        {
            shell.append(mesh, |p| p);
        }
        let shell = shell.build();
        assert_eq!((open_edges(&shell), volume(&shell)), (0, -144.0));
        for mesh in scene
            .meshes
            .iter()
            .filter(|mesh| !["walls", "floor"].contains(&&*mesh.name))
        {
            assert!(open_edges(mesh) == 0 && volume(mesh) > 0.0, "{}", mesh.name);
        }
        // Boxes about all that stands, the object at its place.
        let boxes: Vec<(String, [Vec3; 2])> = scene
            .instances
            .iter()
            .filter(|instance| !["walls", "floor", "crates"].contains(&&*instance.name))
            .map(|instance| {
                let mesh = &scene.meshes[instance.mesh as usize];
                let places = mesh.positions.iter();
                let places = places.map(|p| instance.transform.transform_point3(p.as_dvec3()).as_vec3());
                let none = [Vec3::INFINITY, Vec3::NEG_INFINITY];
                let around = places.fold(none, |[low, high], p| [low.min(p), high.max(p)]);
                (instance.name.clone(), around)
            })
            .chain(CRATES.map(|corners| ("crate".to_owned(), corners.map(Vec3::from_array))))
            .collect();
        for (i, (name, [low, high])) in boxes.iter().enumerate() {
            assert!(
                low.min_element() > -4.0 && low.y > 0.0 && high.y < HEIGHT,
                "{name}: {low} {high}"
            );
            assert!(
                high.x < HALF.x && high.z < HALF.y && low.z > -HALF.y,
                "{name}: {low} {high}"
            );
            for (other, [other_low, other_high]) in &boxes[i + 1..] {
                let apart = low.cmpgt(*other_high).any() || other_low.cmpgt(*high).any();
                assert!(apart, "{name} and {other}");
            }
        }
    }

    #[test]
    fn the_object_is_last_and_about_its_middle() {
        for (object, half) in [("sphere", RADIUS as f32), ("box", HALF_BOX)] {
            let scene = generate(&format!("builtin:game-room?object={object}&roughness=0.3")).expect("scene");
            let instance = scene.instances.last().expect("object");
            let mesh = &scene.meshes[instance.mesh as usize];
            assert_eq!((instance.transform.translation, &*mesh.name), (OBJECT, "object"));
            let most = mesh.positions.iter().fold(Vec3::ZERO, |most, p| most.max(p.abs()));
            assert!((most - half).abs().max_element() < 0.01, "{object}: {most}");
            assert_eq!(
                scene.materials[mesh.material.expect("material") as usize].roughness,
                0.3
            );
        }
        let none = generate("builtin:game-room?object=none").expect("scene");
        assert!(none.meshes.iter().all(|mesh| mesh.name != "object"));
    }

    #[test]
    fn panels_have_the_intensity_of_points() {
        let points = generate("builtin:game-room?light=2").expect("scene");
        let panels = generate("builtin:game-room?light=2&source=area").expect("scene");
        assert_eq!((points.lights.len(), panels.lights.len()), (LAMPS.len(), 0));
        let lamps: Vec<&Mesh> = panels.meshes.iter().filter(|mesh| mesh.name == "lamp").collect();
        assert_eq!(lamps.len(), LAMPS.len());
        for (lamp, light) in lamps.into_iter().zip(&points.lights) {
            let LightKind::Point { intensity, .. } = light.kind else {
                panic!("a point")
            };
            let radiance = panels.materials[lamp.material.expect("material") as usize].emission;
            let of_panel = radiance * super::super::shapes::area(lamp) as f32;
            assert!(
                (of_panel - intensity).abs().max_element() < 1e-5,
                "{of_panel} {intensity}"
            );
            let [a, b, c] = lamp.triangles[0].map(|i| lamp.positions[i as usize]);
            assert!((b - a).cross(c - a).y < 0.0, "it shines down");
        }
    }
}
