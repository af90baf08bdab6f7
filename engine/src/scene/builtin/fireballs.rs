//! Bodies with balls of fire between them: light so near that what a glossy body shows of it depends on where it is seen.
//!
//! It stands in for the scenes of scanned models between fireballs of the literature on localised reflections; bodies and layout are our own.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use super::Entry;
use super::parameters::{Parameter, Values};
use super::shapes::{MeshBuilder, REST, cuboid_faces, geodesic_sphere};
use super::surfaces::glossy;
use crate::Result;
use crate::scene::{Camera, Material, Mesh, Scene};

pub const FIREBALLS: Entry = Entry {
    name: "fireballs",
    summary: "Glossy bodies in a closed room, lit by two glowing balls between them at half their height.",
    parameters: &[
        Parameter::choice("bodies", "3", &["1", "3"], "three in a row, or the middle one alone"),
        Parameter::choice(
            "shape",
            "creature",
            &["creature", "knot"],
            "a round body with a head, two ears and a tail, or a winding one",
        ),
        Parameter::choice(
            "surface",
            "gold",
            &["gold", "mirror", "plastic", "matte"],
            "what the bodies are made of",
        ),
        Parameter::real("roughness", "0.47", 0.0, 1.0, "perceptual roughness of the bodies"),
        Parameter::color("light", "60", 0.0, 1e6, "radiance of the balls, W·m⁻²·sr⁻¹"),
    ],
    build,
};

/// Lower and upper corner of the room, m.
const ROOM: [Vec3; 2] = [Vec3::new(-3.0, 0.0, -2.0), Vec3::new(3.0, 3.0, 3.6)];
/// Between bodies, and between a body and a ball, m.
const SPACING: f32 = 1.8;
/// Height of the balls' middles, and their radius, m.
const BALL_HEIGHT: f32 = 0.55;
const BALL_RADIUS: f64 = 0.14;
/// 20 · 4² triangles.
const BALL_FREQUENCY: u32 = 4;

/// Radius of a creature without what sticks out, m.
const RADIUS: f64 = 0.45;
/// 20 · 32² triangles.
const FREQUENCY: u32 = 32;
/// What sticks out of it: where to, how far in radii, and how narrow.
const BUMPS: [([f64; 3], f64, f64); 4] = [
    ([0.0, 0.45, 0.9], 0.35, 6.0),
    ([0.45, 1.0, 0.25], 0.75, 30.0),
    ([-0.45, 1.0, 0.25], 0.75, 30.0),
    ([0.0, -0.3, -1.0], 0.2, 12.0),
];

/// A knot's curve goes so often around its axis and around its ring; radius of the ring, how far from it the curve winds, and of the tube, m.
const KNOT: [f64; 2] = [2.0, 3.0];
const RING: f64 = 0.34;
const WINDING: f64 = 0.16;
const TUBE: f64 = 0.09;
/// Cells along and around the tube.
const CELLS: [u32; 2] = [384, 32];

fn build(values: &Values) -> Result<Scene> {
    let mut scene = Scene::default();
    place_room(&mut scene);
    let roughness = values.real("roughness")? as f32;
    let material = scene.add_material(match values.word("surface")? {
        "matte" => Material::lambert("matte", Vec3::splat(0.7)),
        word => glossy(word, Vec3::new(0.55, 0.5, 0.45), roughness),
    });
    let mut fire = Material::lambert("fire", Vec3::ZERO);
    fire.emission = values.color("light")?;
    fire.double_sided = false;
    let fire = scene.add_material(fire);
    let ball = geodesic_sphere("fireball", fire, BALL_RADIUS, BALL_FREQUENCY, true);
    for side in [-1.0, 1.0] {
        let middle = Vec3::new(0.5 * side * SPACING, BALL_HEIGHT, 0.0);
        scene.place(MeshBuilder::new("fireball", fire).append(&ball, |p| p + middle).build());
    }
    let body = match values.word("shape")? {
        "knot" => knot(material),
        _ => creature(material),
    };
    let lowest = body.positions.iter().fold(f32::INFINITY, |least, p| least.min(p.y));
    let columns: &[f32] = match values.word("bodies")? {
        "1" => &[0.0],
        _ => &[-1.0, 1.0, 0.0],
    };
    // The middle one is the last.
    for column in columns {
        let place = Vec3::new(column * SPACING, REST - lowest, 0.0);
        scene.place(MeshBuilder::new("body", material).append(&body, |p| p + place).build());
    }
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(0.0, 1.5, 3.4),
        DVec3::new(0.0, 0.6, 0.0),
        DVec3::Y,
        62f32.to_radians(),
    ));
    scene.defaults.aspect = Some(4.0 / 3.0);
    Ok(scene)
}

/// Walls, a green floor and a warm ceiling, which the ends of a body show where its middle shows fire.
fn place_room(scene: &mut Scene) {
    let plaster = scene.add_material(Material::lambert("plaster", Vec3::splat(0.6)));
    let green = scene.add_material(Material::lambert("floor", Vec3::new(0.25, 0.45, 0.25)));
    let warm = scene.add_material(Material::lambert("ceiling", Vec3::new(0.75, 0.6, 0.45)));
    let [low, high] = ROOM;
    let [left, right, floor, ceiling, front, back] = cuboid_faces(low, high);
    for (name, material, faces) in [
        ("walls", plaster, &[left, right, front, back][..]),
        ("floor", green, &[floor][..]),
        ("ceiling", warm, &[ceiling][..]),
    ] {
        let mut part = MeshBuilder::new(name, material);
        for [a, b, c, d] in faces {
            part.quad([*a, *d, *c, *b]);
        }
        scene.place(part.build());
    }
}

/// How far a creature's surface is from its middle in a direction, m.
fn reach(direction: DVec3) -> f64 {
    let bump = |(to, height, narrow): ([f64; 3], f64, f64)| {
        let cosine = direction.dot(DVec3::from_array(to).normalize());
        height * (narrow * (cosine - 1.0)).exp()
    };
    RADIUS * (1.0 + BUMPS.into_iter().map(bump).sum::<f64>())
}

/// A body that is seen as a whole from its middle, about the origin.
fn creature(material: u32) -> Mesh {
    let mut mesh = geodesic_sphere("body", material, 1.0, FREQUENCY, false);
    for position in &mut mesh.positions {
        let direction = position.as_dvec3().normalize();
        *position = (reach(direction) * direction).as_vec3();
    }
    let mut normals = vec![DVec3::ZERO; mesh.positions.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize].as_dvec3());
        // By twice the area.
        let normal = (b - a).cross(c - a);
        for i in triangle {
            normals[*i as usize] += normal;
        }
    }
    mesh.normals = normals.into_iter().map(|n| n.normalize_or_zero().as_vec3()).collect();
    mesh
}

/// A tube along a closed knot that stands upright, about the origin.
fn knot(material: u32) -> Mesh {
    let [turns, winds] = KNOT;
    let on_curve = |t: f64| {
        let (turn, wind) = (turns * t, winds * t);
        let out = RING + WINDING * wind.cos();
        DVec3::new(out * turn.cos(), out * turn.sin(), -WINDING * wind.sin())
    };
    // The normal of the ring's own surface, which turns evenly with the curve.
    let outward = |t: f64| {
        let (turn, wind) = (turns * t, winds * t);
        DVec3::new(wind.cos() * turn.cos(), wind.cos() * turn.sin(), -wind.sin())
    };
    let at = |t: f64, around: f64| {
        const STEP: f64 = 1e-4;
        let tangent = (on_curve(t + STEP) - on_curve(t - STEP)).normalize();
        let across = tangent.cross(outward(t)).normalize();
        let normal = around.cos() * across.cross(tangent) + around.sin() * across;
        (on_curve(t) + TUBE * normal, normal.normalize())
    };
    let mut mesh = Mesh {
        name: "body".into(),
        material: Some(material),
        ..Mesh::default()
    };
    let [along, around] = CELLS;
    let angle = |i: u32, of: u32| TAU * f64::from(i) / f64::from(of);
    for i in 0..along {
        for j in 0..around {
            let (place, normal) = at(angle(i, along), angle(j, around));
            mesh.positions.push(place.as_vec3());
            mesh.normals.push(normal.as_vec3());
        }
    }
    let index = |i: u32, j: u32| i % along * around + j % around;
    for i in 0..along {
        for j in 0..around {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            mesh.triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::super::generate;
    use super::super::shapes::tests::{open_edges, volume};
    use super::*;

    fn bounds(mesh: &Mesh) -> [Vec3; 2] {
        let none = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        let places = mesh.positions.iter();
        places.fold(none, |[low, high], p| [low.min(*p), high.max(*p)])
    }

    #[test]
    fn bodies_are_closed_face_outward_and_stand_on_the_floor() {
        for shape in ["creature", "knot"] {
            let scene = generate(&format!("builtin:fireballs?shape={shape}")).expect("scene");
            let bodies: Vec<&Mesh> = scene.meshes.iter().filter(|mesh| mesh.name == "body").collect();
            assert_eq!(bodies.len(), 3);
            for body in &bodies {
                assert!(
                    open_edges(body) == 0 && volume(body) > 0.01,
                    "{shape}: {}",
                    volume(body)
                );
                let [low, high] = bounds(body);
                assert!((low.y - REST).abs() < 1e-6 && high.y < 1.5, "{shape}: {low} {high}");
                for [a, b, c] in &body.triangles {
                    let [pa, pb, pc] = [a, b, c].map(|i| body.positions[*i as usize]);
                    let flat = (pb - pa).cross(pc - pa);
                    assert!(
                        flat.dot(body.normals[*a as usize]) > 0.0,
                        "{shape}: normals face outward"
                    );
                }
            }
            let middle = bounds(bodies[2]);
            assert!(middle[0].x < 0.0 && middle[1].x > 0.0, "the middle one is the last");
        }
    }

    #[test]
    fn balls_are_between_the_bodies_and_touch_none() {
        for shape in ["creature", "knot"] {
            let scene = generate(&format!("builtin:fireballs?shape={shape}&light=3")).expect("scene");
            let of = |name: &str| -> Vec<[Vec3; 2]> {
                let meshes = scene.meshes.iter().filter(|mesh| mesh.name == name);
                meshes.map(bounds).collect()
            };
            let (balls, bodies) = (of("fireball"), of("body"));
            assert_eq!(balls.len(), 2);
            for [low, high] in &balls {
                let apart = |body: &[Vec3; 2]| low.x > body[1].x || high.x < body[0].x;
                assert!(bodies.iter().all(apart), "{shape}: {low} {high}, {bodies:?}");
            }
            let fire = scene
                .materials
                .iter()
                .find(|material| material.name == "fire")
                .expect("fire");
            assert_eq!(fire.emission, Vec3::splat(3.0));
        }
    }

    #[test]
    fn the_room_is_closed() {
        let scene = generate("builtin:fireballs?bodies=1").expect("scene");
        let mut shell = MeshBuilder::new("", 0);
        let walls = ["walls", "floor", "ceiling"];
        for mesh in scene.meshes.iter().filter(|mesh| walls.contains(&&*mesh.name)) {
            shell.append(mesh, |p| p);
        }
        let shell = shell.build();
        assert_eq!(open_edges(&shell), 0);
        assert!((volume(&shell) + 6.0 * 3.0 * 5.6).abs() < 1e-5, "{}", volume(&shell));
        assert_eq!(scene.meshes.iter().filter(|mesh| mesh.name == "body").count(), 1);
    }
}
