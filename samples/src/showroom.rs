//! A room to reflect: coloured walls, a chequered floor, columns, and a warm and a cool lamp.

use clerestory::scene::{Camera, Filter, Image, LightKind, Material, Mesh, Scene, Texture, Wrap};
use glam::{DVec3, Vec2, Vec3};

/// Half of the room's extent, and its height, metres.
const HALF: Vec3 = Vec3::new(4.0, 3.8, 4.0);

fn quad(name: &str, material: u32, [a, b, c, d]: [Vec3; 4], repeat: Vec2) -> Mesh {
    Mesh {
        name: name.into(),
        positions: vec![a, b, c, d],
        uv0: vec![Vec2::ZERO, Vec2::new(repeat.x, 0.0), repeat, Vec2::new(0.0, repeat.y)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: Some(material),
        ..Mesh::default()
    }
}

/// A prism of many sides about the vertical through `foot`.
fn column(material: u32, foot: Vec3, radius: f32, height: f32) -> Mesh {
    const SIDES: u32 = 48;
    let mut mesh = Mesh {
        name: "column".into(),
        material: Some(material),
        ..Mesh::default()
    };
    for i in 0..SIDES {
        let turn = std::f32::consts::TAU * i as f32 / SIDES as f32;
        let normal = Vec3::new(turn.sin(), 0.0, turn.cos());
        for y in [0.0, height] {
            mesh.positions.push(foot + radius * normal + y * Vec3::Y);
            mesh.normals.push(normal);
        }
        let [a, b] = [2 * i, 2 * ((i + 1) % SIDES)];
        mesh.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
    }
    mesh
}

/// A box without a lid below.
fn block(material: u32, low: Vec3, high: Vec3) -> Mesh {
    let corner = |i: u32| Vec3::select(glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0), high, low);
    let faces: [[u32; 4]; 5] = [[0, 4, 6, 2], [1, 3, 7, 5], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    Mesh {
        name: "block".into(),
        positions: (0..8).map(corner).collect(),
        triangles: faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        material: Some(material),
        ..Mesh::default()
    }
}

/// Two by two squares.
fn squares(scene: &mut Scene, name: &str, dark: [u8; 3], bright: [u8; 3]) -> Texture {
    let image = scene.add_image(Image {
        name: name.into(),
        width: 2,
        height: 2,
        texels: [dark, bright, bright, dark]
            .map(|[r, g, b]| [r, g, b, u8::MAX])
            .to_vec(),
    });
    Texture {
        image,
        uv_set: 0,
        wrap: [Wrap::Repeat; 2],
        filter: Filter::Nearest,
        transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
    }
}

/// The scene, with its camera and lamps.
pub fn showroom() -> Scene {
    let mut scene = Scene {
        name: "showroom".into(),
        source: "showroom".into(),
        ..Scene::default()
    };
    let paint = |scene: &mut Scene, name: &str, r: f32, g: f32, b: f32| {
        scene.add_material(Material::lambert(name, Vec3::new(r, g, b)))
    };
    let tiles = squares(&mut scene, "tiles", [58, 62, 70], [214, 208, 196]);
    let floor = scene.add_material(Material {
        base_color_texture: Some(tiles),
        roughness: 0.35,
        metallic: 0.0,
        ..Material::default()
    });
    let ceiling = paint(&mut scene, "ceiling", 0.82, 0.82, 0.8);
    let walls = [
        paint(&mut scene, "terracotta", 0.66, 0.24, 0.13),
        paint(&mut scene, "teal", 0.08, 0.38, 0.42),
        paint(&mut scene, "cream", 0.78, 0.72, 0.58),
        paint(&mut scene, "ochre", 0.72, 0.5, 0.14),
    ];
    let marble = scene.add_material(Material {
        roughness: 0.25,
        metallic: 0.0,
        base_color: Vec3::new(0.75, 0.74, 0.7).extend(1.0),
        ..Material::default()
    });
    let blue = paint(&mut scene, "blue", 0.1, 0.16, 0.5);
    let red = paint(&mut scene, "red", 0.6, 0.06, 0.08);
    let (x, y, z) = (HALF.x, HALF.y, HALF.z);
    let v = Vec3::new;
    let one = Vec2::ONE;
    scene.place(quad(
        "floor",
        floor,
        [v(-x, 0.0, z), v(x, 0.0, z), v(x, 0.0, -z), v(-x, 0.0, -z)],
        Vec2::splat(4.0),
    ));
    scene.place(quad(
        "ceiling",
        ceiling,
        [v(-x, y, -z), v(x, y, -z), v(x, y, z), v(-x, y, z)],
        one,
    ));
    for (i, material) in walls.into_iter().enumerate() {
        let corners = match i {
            0 => [v(-x, 0.0, z), v(-x, 0.0, -z), v(-x, y, -z), v(-x, y, z)],
            1 => [v(x, 0.0, -z), v(x, 0.0, z), v(x, y, z), v(x, y, -z)],
            2 => [v(-x, 0.0, -z), v(x, 0.0, -z), v(x, y, -z), v(-x, y, -z)],
            _ => [v(x, 0.0, z), v(-x, 0.0, z), v(-x, y, z), v(x, y, z)],
        };
        scene.place(quad("wall", material, corners, one));
    }
    for (side, depth) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
        let foot = v(2.7 * side, 0.0, 2.6 * depth);
        scene.place(column(marble, foot, 0.28, y));
        scene.place(block(marble, foot - v(0.4, 0.0, 0.4), foot + v(0.4, 0.22, 0.4)));
    }
    scene.place(block(blue, v(-0.5, 0.0, -3.4), v(0.6, 1.3, -2.7)));
    scene.place(block(red, v(1.1, 0.0, -3.2), v(1.8, 0.7, -2.5)));
    scene.place(block(red, v(-2.0, 0.0, 2.2), v(-1.2, 0.9, 3.0)));
    scene.add_light(
        "warm lamp",
        LightKind::Point {
            position: v(-1.7, 2.3, 1.2),
            intensity: v(11.0, 8.4, 5.6),
        },
    );
    scene.add_light(
        "cool lamp",
        LightKind::Point {
            position: v(1.9, 2.2, -1.2),
            intensity: v(3.6, 5.0, 7.6),
        },
    );
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(0.9, 1.8, 3.5),
        DVec3::new(-0.1, 1.45, -0.6),
        DVec3::Y,
        60f32.to_radians(),
    ));
    scene.defaults.aspect = Some(4.0 / 3.0);
    scene.defaults.exposure = -0.4;
    scene
}
