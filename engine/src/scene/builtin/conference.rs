//! A conference room: large flat walls, and fine detail in small places.
//!
//! Stands in for the conference-room model of the ray-tracing literature (282,801 triangles), whose file cannot be had by package: as many
//! triangles, walls and furniture along the axes, most triangles in chairs, but a layout of our own.

use glam::{DVec3, Quat, Vec3};

use super::Entry;
use super::noise::unit;
use super::parameters::{Parameter, Values};
use super::shapes::{MeshBuilder, geodesic_sphere, lathe, rounded_box};
use crate::Result;
use crate::scene::{Camera, LightKind, Material, Mesh, Scene};

pub const CONFERENCE: Entry = Entry {
    name: "conference",
    summary: "A closed room with a long table, swivel chairs, shelves and blinds: about 283 thousand triangles.",
    parameters: &[
        Parameter::choice(
            "source",
            "area",
            &["area", "point"],
            "ceiling panels, or a lamp above the table",
        ),
        Parameter::color(
            "light",
            "8",
            0.0,
            1e6,
            "radiance of the panels, or a quarter of the lamp's intensity",
        ),
    ],
    build,
};

const SIZE: Vec3 = Vec3::new(12.0, 3.2, 8.0);
/// Half the table's length and width, and its height, m.
const TABLE: Vec3 = Vec3::new(3.6, 0.74, 0.9);

/// A swivel chair around the origin that looks along +Z: about 11 thousand triangles.
fn chair(cloth: u32, metal: u32) -> [Mesh; 2] {
    let mut soft = MeshBuilder::new("", cloth);
    let seat = rounded_box("", cloth, Vec3::new(0.24, 0.045, 0.24), 0.04, 18);
    soft.append(&seat, |p| p + Vec3::Y * 0.47);
    let back = rounded_box("", cloth, Vec3::new(0.22, 0.3, 0.04), 0.035, 18);
    soft.append(&back, |p| {
        // Bent to the sitter's shape.
        p + Vec3::new(0.0, 0.88, -0.25 + 0.6 * p.x * p.x - 0.08 * p.y)
    });
    let arm = rounded_box("", cloth, Vec3::new(0.03, 0.02, 0.13), 0.015, 5);
    for side in [-1.0, 1.0] {
        soft.append(&arm, |p| p + Vec3::new(0.27 * side, 0.68, 0.0));
    }
    let mut hard = MeshBuilder::new("", metal);
    let stand = lathe(
        "",
        metal,
        &[
            (0.0, 0.1),
            (0.05, 0.1),
            (0.05, 0.16),
            (0.025, 0.18),
            (0.025, 0.42),
            (0.0, 0.42),
        ],
        24,
    );
    hard.append(&stand, |p| p);
    for side in [-1.0f32, 1.0] {
        hard.cuboid(
            Vec3::new(0.27 * side - 0.012, 0.44, -0.02),
            Vec3::new(0.27 * side + 0.012, 0.66, 0.02),
        );
    }
    let wheel = geodesic_sphere("", metal, 0.03, 4, false);
    let leg = rounded_box("", metal, Vec3::new(0.02, 0.015, 0.14), 0.01, 4);
    for i in 0..5 {
        let turn = Quat::from_rotation_y(std::f32::consts::TAU * i as f32 / 5.0);
        hard.append(&leg, |p| turn * (p + Vec3::new(0.0, 0.09, 0.16)));
        hard.append(&wheel, |p| turn * (p + Vec3::new(0.0, 0.035, 0.29)));
    }
    [soft.build(), hard.build()]
}

fn build(values: &Values) -> Result<Scene> {
    let light = values.color("light")?;
    let shines = values.word("source")? == "area";
    let mut scene = Scene::default();
    let plaster = scene.add_material(Material::lambert("plaster", Vec3::splat(0.72)));
    let carpet = scene.add_material(Material::lambert("carpet", Vec3::new(0.25, 0.22, 0.2)));
    let wood = scene.add_material(Material::lambert("wood", Vec3::new(0.4, 0.24, 0.12)));
    let cloth = scene.add_material(Material::lambert("cloth", Vec3::new(0.45, 0.12, 0.1)));
    let metal = scene.add_material(Material::lambert("steel", Vec3::splat(0.35)));
    let paper = [
        scene.add_material(Material::lambert("blue books", Vec3::new(0.15, 0.2, 0.5))),
        scene.add_material(Material::lambert("red books", Vec3::new(0.5, 0.1, 0.1))),
    ];
    let panel = {
        let mut material = Material::lambert("panels", Vec3::splat(0.8));
        if shines {
            material.emission = light;
        }
        material.double_sided = false;
        scene.add_material(material)
    };
    scene.place(MeshBuilder::new("walls", plaster).room(Vec3::ZERO, SIZE).build());
    let rug = [Vec3::new(0.0, 0.002, 0.0), Vec3::new(SIZE.x, 0.01, SIZE.z)];
    scene.place(MeshBuilder::new("carpet", carpet).cuboid(rug[0], rug[1]).build());
    // The ceiling's grid, and panels in some of its cells.
    let mut grid = MeshBuilder::new("ceiling grid", metal);
    let mut panels = MeshBuilder::new("panels", panel);
    for i in 1..20 {
        let x = SIZE.x * i as f32 / 20.0;
        grid.cuboid(
            Vec3::new(x - 0.01, SIZE.y - 0.06, 0.01),
            Vec3::new(x + 0.01, SIZE.y - 0.02, SIZE.z - 0.01),
        );
    }
    for j in 1..14 {
        let z = SIZE.z * j as f32 / 14.0;
        grid.cuboid(
            Vec3::new(0.01, SIZE.y - 0.06, z - 0.01),
            Vec3::new(SIZE.x - 0.01, SIZE.y - 0.02, z + 0.01),
        );
    }
    for i in 0..4 {
        for j in 0..2 {
            let low = Vec3::new(1.81 + 2.4 * i as f32, SIZE.y - 0.03, 1.73 + 2.86 * j as f32);
            let high = low + Vec3::new(1.18, 0.0, 1.11);
            let at = |x: f32, z: f32| Vec3::new(x, low.y, z);
            panels.quad([
                at(low.x, low.z),
                at(high.x, low.z),
                at(high.x, high.z),
                at(low.x, high.z),
            ]);
        }
    }
    scene.place(grid.build());
    scene.place(panels.build());
    let middle = Vec3::new(SIZE.x / 2.0, 0.0, SIZE.z / 2.0);
    let mut table = MeshBuilder::new("table", wood);
    let top = rounded_box("", wood, Vec3::new(TABLE.x, 0.03, TABLE.z), 0.025, 24);
    table.append(&top, |p| middle + p + Vec3::Y * TABLE.y);
    for x in [-2.6f32, 0.0, 2.6] {
        table.cuboid(
            middle + Vec3::new(x - 0.1, 0.02, -0.5),
            middle + Vec3::new(x + 0.1, TABLE.y - 0.04, 0.5),
        );
    }
    scene.place(table.build());
    let parts = chair(cloth, metal);
    let mut chairs = [MeshBuilder::new("cushions", cloth), MeshBuilder::new("frames", metal)];
    for i in 0..22 {
        let random = |dimension| unit(3, i, dimension);
        // Nine to each side, two to each end.
        let (place, angle) = match i {
            0..18 => {
                let side = if i < 9 { 1.0f32 } else { -1.0 };
                let x = ((i % 9) as f32 - 4.0) * 0.78;
                (
                    Vec3::new(x, 0.02, side * (TABLE.z + 0.35)),
                    if side > 0.0 { std::f32::consts::PI } else { 0.0 },
                )
            }
            _ => {
                let side = if i % 2 == 0 { 1.0f32 } else { -1.0 };
                let z = if i < 20 { 0.45 } else { -0.45 };
                (
                    Vec3::new(side * (TABLE.x + 0.4), 0.02, z),
                    -side * std::f32::consts::FRAC_PI_2,
                )
            }
        };
        let turn = Quat::from_rotation_y(angle + 0.5 * (random(0) - 0.5));
        let away = turn * Vec3::new(0.0, 0.0, -0.25 * random(1));
        for (to, part) in chairs.iter_mut().zip(&parts) {
            to.append(part, |p| middle + place + away + turn * p);
        }
    }
    for mut part in chairs {
        scene.place(part.build());
    }
    // Blinds before the window wall, shelves with books at the other end, cups and folders on the table.
    let mut blinds = MeshBuilder::new("blinds", metal);
    for window in 0..4 {
        for slat in 0..60 {
            let low = Vec3::new(0.5 + 2.9 * window as f32, 0.9 + 0.035 * slat as f32, 0.05);
            let along = Vec3::new(2.4, 0.0, 0.0);
            let across = Vec3::new(0.0, 0.012, 0.025);
            blinds.quad([low, low + along, low + along + across, low + across]);
        }
    }
    scene.place(blinds.build());
    let mut shelves = MeshBuilder::new("shelves", wood);
    let mut books = paper.map(|paint| MeshBuilder::new("books", paint));
    for level in 0..7 {
        let y = 0.05 + 0.4 * level as f32;
        shelves.cuboid(
            Vec3::new(SIZE.x - 0.4, y - 0.02, 0.5),
            Vec3::new(SIZE.x - 0.02, y, SIZE.z - 0.5),
        );
        if level == 6 {
            continue;
        }
        let mut z = 0.55;
        let mut item = level * 1000;
        while z < SIZE.z - 0.62 {
            let random = |dimension| unit(9, item, dimension);
            let (thick, tall, deep) = (0.02 + 0.04 * random(0), 0.2 + 0.14 * random(1), 0.16 + 0.1 * random(2));
            let low = Vec3::new(SIZE.x - 0.05 - deep, y + 0.001, z);
            books[usize::from(random(3) < 0.4)].cuboid(low, low + Vec3::new(deep, tall, thick));
            z += thick + 0.003;
            item += 1;
        }
    }
    scene.place(shelves.build());
    for mut some in books {
        scene.place(some.build());
    }
    let cup = lathe(
        "",
        plaster,
        &[
            (0.0, 0.0),
            (0.03, 0.0),
            (0.04, 0.01),
            (0.042, 0.09),
            (0.038, 0.09),
            (0.036, 0.012),
            (0.0, 0.008),
        ],
        96,
    );
    let mut cups = MeshBuilder::new("cups", plaster);
    let mut folders = MeshBuilder::new("folders", paper[0]);
    for i in 0..18 {
        let side = if i < 9 { 1.0f32 } else { -1.0 };
        let place = middle + Vec3::new(((i % 9) as f32 - 4.0) * 0.78, TABLE.y + 0.031, side * 0.55);
        cups.append(&cup, |p| place + p + Vec3::new(0.22, 0.0, 0.0));
        folders.cuboid(place - Vec3::new(0.11, 0.0, 0.15), place + Vec3::new(0.11, 0.012, 0.15));
    }
    scene.place(cups.build());
    scene.place(folders.build());
    if !shines {
        let position = middle + Vec3::Y * 2.6;
        scene.add_light(
            "lamp",
            LightKind::Point {
                position,
                intensity: light * 4.0,
            },
        );
    }
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(0.8, 1.9, 6.9),
        DVec3::new(6.5, 0.8, 3.4),
        DVec3::Y,
        65f32.to_radians(),
    ));
    scene.cameras.push(Camera::look_at(
        "end",
        DVec3::new(10.6, 1.5, 6.6),
        DVec3::new(4.0, 0.9, 3.0),
        DVec3::Y,
        65f32.to_radians(),
    ));
    scene.defaults.aspect = Some(4.0 / 3.0);
    Ok(scene)
}
