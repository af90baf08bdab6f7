//! A vaulted church.
//!
//! It stands in for the cathedral of the ray-tracing literature of about 2010 (80,131 triangles), whose file cannot be had by package: as
//! many triangles, columns, arches, vaults and walls along the axes, but a layout of our own.

use glam::{DVec3, Vec3};

use super::Entry;
use super::halls::{column, put};
use super::media::{ABSORPTION, G, PHASE, SCATTERING, surround};
use super::parameters::{Parameter, Values};
use super::shapes::{MeshBuilder, arch, point_lamp, sheet};
use crate::Result;
use crate::scene::{Camera, Material, Mesh, Scene};

pub const CATHEDRAL: Entry = Entry {
    name: "cathedral",
    summary: "A closed church with a nave, aisles, clustered columns and ribbed vaults: about 80 thousand triangles.",
    parameters: &[
        Parameter::choice(
            "source",
            "area",
            &["area", "point"],
            "windows that emit light, or a lamp in the nave",
        ),
        Parameter::color(
            "light",
            "8",
            0.0,
            1e6,
            "radiance of the windows, or a hundredth of the lamp's intensity",
        ),
        ABSORPTION,
        SCATTERING,
        PHASE,
        G,
    ],
    build,
};

/// A groined vault over a rectangle: two barrels that cut each other, `rise` high at its middle.
fn vault(material: u32, width: f32, depth: f32, rise: f32, cells: u32) -> Mesh {
    sheet("", material, cells, cells, |u, v| {
        let (x, z) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        // The higher of both barrels, seen from below.
        let bow = |t: f32| (1.0 - t * t).max(0.0).sqrt();
        Vec3::new(x * width / 2.0, rise * bow(x).max(bow(z)), z * depth / 2.0)
    })
}

fn build(values: &Values) -> Result<Scene> {
    /// Bays of the nave, metres a bay, half width of the nave, of nave and aisles, heights of the columns in the nave and of aisle walls.
    const BAYS: u32 = 8;
    const BAY: f32 = 5.0;
    const NAVE: f32 = 4.5;
    const AISLES: f32 = 9.0;
    const SPRING: f32 = 11.0;
    const AISLE: f32 = 5.5;
    let length = BAYS as f32 * BAY;
    let crown = SPRING + 5.5;
    let mut scene = Scene::default();
    let stone = scene.add_material(Material::lambert("stone", Vec3::new(0.6, 0.58, 0.52)));
    let rib = scene.add_material(Material::lambert("ribs", Vec3::new(0.5, 0.46, 0.4)));
    let slab = scene.add_material(Material::lambert("slabs", Vec3::new(0.35, 0.33, 0.3)));
    let wood = scene.add_material(Material::lambert("wood", Vec3::new(0.3, 0.18, 0.1)));
    let glass = {
        let mut material = Material::lambert("windows", Vec3::ZERO);
        if values.word("source")? == "area" {
            material.emission = values.color("light")?;
        }
        material.double_sided = false;
        scene.add_material(material)
    };
    let mut shell = MeshBuilder::new("shell", stone);
    shell.room(Vec3::new(-AISLES, 0.0, 0.0), Vec3::new(AISLES, crown + 0.6, length));
    scene.place(shell.build());
    let mut floor = MeshBuilder::new("floor", slab);
    let flags = sheet("", slab, 18, 40, |u, v| {
        Vec3::new((2.0 * u - 1.0) * AISLES, 0.01, (1.0 - v) * length)
    });
    floor.append(&flags, |p| p);
    scene.place(floor.build());
    let pillar = column("", stone, 0.55, f64::from(SPRING), 36);
    let shaft = column("", stone, 0.16, f64::from(SPRING), 14);
    let mut columns = MeshBuilder::new("columns", stone);
    let mut ribs = MeshBuilder::new("ribs", rib);
    let mut vaults = MeshBuilder::new("vaults", stone);
    let mut windows = MeshBuilder::new("windows", glass);
    let mut frames = MeshBuilder::new("frames", rib);
    // Over the nave a barrel of full width; over the aisles smaller ones.
    let nave_vault = vault(stone, 2.0 * NAVE, BAY, crown - SPRING, 36);
    let aisle_vault = vault(stone, AISLES - NAVE, BAY, 2.2, 24);
    let across = arch(
        "",
        rib,
        [f64::from(NAVE) - 0.25, f64::from(NAVE)],
        0.4,
        f64::from((crown - SPRING) / NAVE),
        36,
    );
    let along = arch(
        "",
        rib,
        [f64::from(BAY) / 2.0 - 0.5, f64::from(BAY) / 2.0 - 0.2],
        0.5,
        1.25,
        28,
    );
    let frame = arch("", rib, [0.75, 0.95], 0.3, 1.8, 20);
    for bay in 0..BAYS {
        let from = bay as f32 * BAY;
        let middle = from + BAY / 2.0;
        put(&mut vaults, &nave_vault, 0, Vec3::new(0.0, SPRING, middle));
        for side in [-1.0f32, 1.0] {
            put(
                &mut vaults,
                &aisle_vault,
                0,
                Vec3::new(side * (NAVE + AISLES) / 2.0, AISLE, middle),
            );
            put(&mut ribs, &along, 1, Vec3::new(side * NAVE, AISLE, middle));
            // A wall above the arches up to the vault, and its window.
            let wall = [
                Vec3::new(side * NAVE - 0.2, AISLE + 3.0, from),
                Vec3::new(side * NAVE + 0.2, SPRING, from + BAY),
            ];
            frames.cuboid(wall[0], wall[1]);
            for (x, sill, inward) in [
                (side * (AISLES - 0.02), 1.6, -side),
                (side * (NAVE - 0.22), AISLE + 3.3, -side),
            ] {
                let height = 2.0;
                let mut pane = [
                    Vec3::new(x, sill, middle - 0.75),
                    Vec3::new(x, sill, middle + 0.75),
                    Vec3::new(x, sill + height, middle + 0.75),
                    Vec3::new(x, sill + height, middle - 0.75),
                ];
                if inward > 0.0 {
                    pane.reverse();
                }
                windows.quad(pane);
                if sill < 2.0 {
                    put(&mut frames, &frame, 1, Vec3::new(x, sill + height, middle));
                }
            }
        }
        if bay == 0 {
            continue;
        }
        put(&mut ribs, &across, 0, Vec3::new(0.0, SPRING, from));
        for side in [-1.0f32, 1.0] {
            let foot = Vec3::new(side * NAVE, 0.0, from);
            put(&mut columns, &pillar, 0, foot);
            for (dx, dz) in [(0.5, 0.5), (0.5, -0.5), (-0.5, 0.5), (-0.5, -0.5)] {
                put(&mut columns, &shaft, 0, foot + Vec3::new(dx, 0.0, dz));
            }
        }
    }
    scene.place(columns.build());
    scene.place(ribs.build());
    scene.place(vaults.build());
    scene.place(windows.build());
    scene.place(frames.build());
    let mut pews = MeshBuilder::new("pews", wood);
    for row in 0..24 {
        let z = 6.0 + row as f32 * 1.1;
        for side in [-1.0f32, 1.0] {
            let [a, b] = [side * 0.8, side * 3.6];
            let (low, high) = (a.min(b), a.max(b));
            pews.cuboid(Vec3::new(low, 0.42, z), Vec3::new(high, 0.46, z + 0.4));
            pews.cuboid(Vec3::new(low, 0.46, z + 0.36), Vec3::new(high, 0.95, z + 0.4));
            for x in [low, (low + high) / 2.0, high - 0.06] {
                pews.cuboid(Vec3::new(x, 0.02, z), Vec3::new(x + 0.06, 0.42, z + 0.36));
            }
        }
    }
    scene.place(pews.build());
    // The altar: steps, a table and candlesticks.
    let mut altar = MeshBuilder::new("altar", stone);
    for step in 0..4 {
        let inset = step as f32 * 0.4;
        let top = 0.18 * (step + 1) as f32;
        altar.cuboid(
            Vec3::new(-3.6 + inset, top - 0.17, 0.3),
            Vec3::new(3.6 - inset, top, 4.4 - inset),
        );
    }
    altar.cuboid(Vec3::new(-1.2, 0.74, 1.2), Vec3::new(1.2, 1.7, 2.0));
    let candlestick = column("", stone, 0.06, 0.7, 24);
    for i in 0..6 {
        put(&mut altar, &candlestick, 0, Vec3::new(-1.0 + 0.4 * i as f32, 1.71, 1.6));
    }
    scene.place(altar.build());
    if values.word("source")? == "point" {
        point_lamp(
            &mut scene,
            Vec3::new(0.0, 7.0, length / 2.0),
            values.color("light")? * 100.0,
        );
    }
    surround(&mut scene, "haze", values)?;
    let end = f64::from(length);
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(0.6, 1.9, end - 2.0),
        DVec3::new(-0.5, 5.0, end / 2.0),
        DVec3::Y,
        65f32.to_radians(),
    ));
    scene.cameras.push(Camera::look_at(
        "end",
        DVec3::new(-6.5, 2.4, 8.0),
        DVec3::new(2.0, 5.0, end * 0.7),
        DVec3::Y,
        65f32.to_radians(),
    ));
    scene.defaults.aspect = Some(4.0 / 3.0);
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::super::generate;
    use crate::scene::SceneProfile;

    #[test]
    fn haze_is_all_around() {
        let haze = generate("builtin:cathedral?sigma_a=0.05&sigma_s=0.15&phase=schlick&g=0.5").expect("scene");
        let media = SceneProfile::of(&haze).media;
        assert!(media.surrounding && media.phases.schlick && media.absorbs);
    }
}
