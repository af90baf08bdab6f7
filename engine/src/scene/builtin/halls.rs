//! Halls: a courtyard with two storeys of arcades, and a vaulted church.
//!
//! They stand in for the architecture models of the ray-tracing literature of about 2010 (an atrium of 66,454 and a cathedral of 80,131
//! triangles), whose files cannot be had by package: as many triangles, columns, arches, vaults and walls along the axes, but a layout
//! of our own.

use std::f32::consts::PI;
use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use super::Entry;
use super::media::{ABSORPTION, G, PHASE, SCATTERING, add_boundary, add_medium, medium, surround};
use super::parameters::{Parameter, Values};
use super::shapes::{MeshBuilder, arch, lathe, point_lamp, sheet};
use super::textures::sky;
use crate::Result;
use crate::scene::{Camera, DensityGrid, Material, Mesh, Scene};

pub const ATRIUM: Entry = Entry {
    name: "atrium",
    summary: "A courtyard with two storeys of columns, arches, balustrades and curtains: about 66 thousand triangles.",
    parameters: &[
        Parameter::choice(
            "source",
            "sky",
            &["sky", "point"],
            "the open sky, or a lamp in the court",
        ),
        Parameter::color("light", "60", 0.0, 1e6, "intensity of the lamp, W/sr"),
        ABSORPTION,
        SCATTERING,
        PHASE,
        G,
        Parameter::choice(
            "fill",
            "storey",
            &["storey", "everywhere"],
            "where the air is a medium: up to the ceiling of the lower gallery, or in all of space",
        ),
        Parameter::choice(
            "density",
            "even",
            &["even", "waves"],
            "of the medium: even, or a grid of waves with a mean of 1",
        ),
    ],
    build: atrium,
};

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
    build: cathedral,
};

/// A column with base and capital, `height` tall with a shaft of `radius`.
fn column(name: &str, material: u32, radius: f64, height: f64, segments: u32) -> Mesh {
    let outline = [
        (0.0, 0.0),
        (1.5, 0.0),
        (1.5, 0.04),
        (1.25, 0.06),
        (1.3, 0.08),
        (1.0, 0.1),
        (1.02, 0.4),
        (0.9, 0.88),
        (1.15, 0.92),
        (1.4, 0.97),
        (1.4, 1.0),
        (0.0, 1.0),
    ];
    let scaled = outline.map(|(r, y)| (r * radius, y * height));
    lathe(name, material, &scaled, segments)
}

/// Adds a mesh turned by quarters about +Y, then moved.
fn put(to: &mut MeshBuilder, mesh: &Mesh, quarters: u32, offset: Vec3) {
    to.append(mesh, |p| {
        let turned = match quarters % 4 {
            0 => p,
            1 => Vec3::new(p.z, p.y, -p.x),
            2 => Vec3::new(-p.x, p.y, -p.z),
            _ => Vec3::new(-p.z, p.y, p.x),
        };
        turned + offset
    });
}

/// A density over the unit cube: whole waves along each axis, so that the mean of a grid's cells is 1.
fn waves(p: DVec3) -> f32 {
    const WAVES: DVec3 = DVec3::new(3.0, 1.0, 2.0);
    let phase = p * WAVES * TAU;
    (1.0 + phase.x.sin() * phase.y.cos() * phase.z.sin()) as f32
}

/// Fills the courtyard with the medium of the parameters, `top` high or in all of space; `outer` is the corner of its walls, above the floor's middle.
fn fill_courtyard(scene: &mut Scene, values: &Values, outer: Vec3, top: f32) -> Result<()> {
    const CELLS: [u32; 3] = [32, 16, 32];
    /// Around the walls and the floor and not inside them, m.
    const MARGIN: f32 = 0.5;
    let mut fog = medium("fog", values)?;
    if fog.is_empty() {
        return Ok(());
    }
    let everywhere = values.word("fill")? == "everywhere";
    let top = if everywhere { outer.y + MARGIN } else { top };
    let low = Vec3::new(-outer.x - MARGIN, -MARGIN, -outer.z - MARGIN);
    let high = Vec3::new(outer.x + MARGIN, top, outer.z + MARGIN);
    if values.word("density")? == "waves" {
        let grid = DensityGrid::from_fn(CELLS, waves);
        fog.density = Some(grid.in_box(low.as_dvec3(), high.as_dvec3()));
    }
    let fog = add_medium(scene, fog);
    if everywhere {
        scene.surrounding = Some(fog);
    } else {
        let boundary = add_boundary(scene, fog);
        scene.place(MeshBuilder::new("fog", boundary).cuboid(low, high).build());
    }
    Ok(())
}

fn atrium(values: &Values) -> Result<Scene> {
    /// Bays along x and along z, metres from one column to the next, height of a storey, width of the gallery behind the columns.
    const BAYS: [u32; 2] = [8, 4];
    const BAY: f32 = 3.0;
    const STOREY: f32 = 4.6;
    const GALLERY: f32 = 2.8;
    /// Of a medium in the lower storey, within the ceiling of its gallery.
    const TOP: f32 = STOREY - 0.1;
    const SHAFT: f64 = 0.22;
    /// Height of the columns; arches of half a bay stand on them.
    const COLUMN: f64 = 2.9;
    let half = Vec3::new(BAYS[0] as f32 * BAY / 2.0, 2.0 * STOREY, BAYS[1] as f32 * BAY / 2.0);
    let outer = half + Vec3::new(GALLERY, 0.8, GALLERY);
    let mut scene = Scene::default();
    let stone = scene.add_material(Material::lambert("stone", Vec3::new(0.62, 0.55, 0.45)));
    let plaster = scene.add_material(Material::lambert("plaster", Vec3::new(0.7, 0.62, 0.5)));
    let tile = scene.add_material(Material::lambert("tile", Vec3::new(0.4, 0.36, 0.33)));
    let reds = [
        scene.add_material(Material::lambert("red cloth", Vec3::new(0.6, 0.08, 0.06))),
        scene.add_material(Material::lambert("green cloth", Vec3::new(0.1, 0.4, 0.12))),
        scene.add_material(Material::lambert("blue cloth", Vec3::new(0.1, 0.15, 0.5))),
    ];
    let mut floor = MeshBuilder::new("floor", tile);
    let cells = [2 * BAYS[0] + 4, 2 * BAYS[1] + 4];
    let flags = sheet("", tile, cells[0], cells[1], |u, v| {
        Vec3::new((2.0 * u - 1.0) * outer.x, 0.0, (1.0 - 2.0 * v) * outer.z)
    });
    floor.append(&flags, |p| p);
    scene.place(floor.build());
    // The outer wall, and the ceilings of both galleries around the court.
    let mut walls = MeshBuilder::new("walls", plaster);
    let corner = |x: f32, y: f32, z: f32| Vec3::new(x * outer.x, y, z * outer.z);
    for [from, to] in [
        [(-1.0, -1.0), (1.0, -1.0)],
        [(1.0, -1.0), (1.0, 1.0)],
        [(1.0, 1.0), (-1.0, 1.0)],
        [(-1.0, 1.0), (-1.0, -1.0)],
    ] {
        let at = |(x, z): (f32, f32), y: f32| corner(x, y, z);
        walls.quad([at(from, 0.0), at(from, outer.y), at(to, outer.y), at(to, 0.0)]);
    }
    for storey in 1..=2 {
        let top = storey as f32 * STOREY;
        let slab = [top - 0.25, top];
        for (low, high) in [
            (
                Vec3::new(-outer.x, slab[0], -outer.z),
                Vec3::new(outer.x, slab[1], -half.z - 0.3),
            ),
            (
                Vec3::new(-outer.x, slab[0], half.z + 0.3),
                Vec3::new(outer.x, slab[1], outer.z),
            ),
            (
                Vec3::new(-outer.x, slab[0], -half.z - 0.3),
                Vec3::new(-half.x - 0.3, slab[1], half.z + 0.3),
            ),
            (
                Vec3::new(half.x + 0.3, slab[0], -half.z - 0.3),
                Vec3::new(outer.x, slab[1], half.z + 0.3),
            ),
        ] {
            walls.cuboid(low, high);
        }
    }
    scene.place(walls.build());
    // Sides: where bay 0 begins, the direction of the bays, how many, quarter turns of an arch.
    let sides = [
        (Vec3::new(-half.x, 0.0, -half.z), Vec3::X, BAYS[0], 0),
        (Vec3::new(half.x, 0.0, -half.z), Vec3::Z, BAYS[1], 1),
        (Vec3::new(half.x, 0.0, half.z), Vec3::NEG_X, BAYS[0], 2),
        (Vec3::new(-half.x, 0.0, half.z), Vec3::NEG_Z, BAYS[1], 3),
    ];
    let pillar = column("", stone, SHAFT, COLUMN, 20);
    let opening = f64::from(BAY) / 2.0 - 0.2;
    let bow = arch("", stone, [opening, opening + 0.2], 0.5, 1.0, 20);
    let baluster_outline = [
        (0.0, 0.0),
        (0.07, 0.0),
        (0.07, 0.06),
        (0.03, 0.12),
        (0.075, 0.35),
        (0.03, 0.62),
        (0.06, 0.7),
        (0.06, 0.76),
        (0.0, 0.76),
    ];
    let baluster = lathe("", stone, &baluster_outline, 10);
    let mut columns = MeshBuilder::new("columns", stone);
    let mut arches = MeshBuilder::new("arches", stone);
    let mut balustrades = MeshBuilder::new("balustrades", stone);
    let mut curtains = reds.map(|cloth| MeshBuilder::new("curtains", cloth));
    for (side, (begin, along, bays, turns)) in sides.into_iter().enumerate() {
        for storey in 0..2 {
            let level = Vec3::Y * (storey as f32 * STOREY);
            for bay in 0..bays {
                let foot = begin + along * (BAY * bay as f32) + level;
                put(&mut columns, &pillar, turns, foot);
                let middle = foot + along * (BAY / 2.0);
                put(&mut arches, &bow, turns, middle + Vec3::Y * COLUMN as f32);
                if storey == 0 {
                    continue;
                }
                for i in 0..9 {
                    let place = foot + along * (BAY * (i as f32 + 1.0) / 10.0);
                    put(&mut balustrades, &baluster, turns, place);
                }
                let rail = [foot + along * 0.3, foot + along * (BAY - 0.3)].map(|p| p + Vec3::Y * 0.76);
                let thick = (Vec3::ONE - along.abs() - Vec3::Y) * 0.09;
                balustrades.cuboid(
                    rail[0].min(rail[1]) - thick,
                    rail[0].max(rail[1]) + thick + Vec3::Y * 0.07,
                );
                if (bay + side as u32).is_multiple_of(2) {
                    let inward = Vec3::new(along.z, 0.0, -along.x) * -0.35;
                    let cloth = sheet("", 0, 24, 10, |u, v| {
                        let fold = 0.12 * (u * 7.0 * PI).sin() * (1.2 - v);
                        foot + along * (0.5 + (BAY - 1.0) * u) + inward * (1.0 + fold) + Vec3::Y * (3.2 * v - 2.2)
                    });
                    curtains[(bay as usize + side) / 2 % 3].append(&cloth, |p| p);
                }
            }
        }
    }
    scene.place(columns.build());
    scene.place(arches.build());
    scene.place(balustrades.build());
    for mut cloth in curtains {
        scene.place(cloth.build());
    }
    if values.word("source")? == "sky" {
        scene.environment = Some(sky(Vec3::new(0.3, 0.85, 0.25).normalize(), 1.0));
    } else {
        point_lamp(&mut scene, Vec3::new(0.0, 4.0, 0.0), values.color("light")?);
    }
    fill_courtyard(&mut scene, values, outer, TOP)?;
    let far = f64::from(half.x) - 0.8;
    scene.cameras.push(Camera::look_at(
        "main",
        DVec3::new(-far, 1.8, 0.6),
        DVec3::new(4.0, 3.6, -1.0),
        DVec3::Y,
        65f32.to_radians(),
    ));
    scene.cameras.push(Camera::look_at(
        "end",
        DVec3::new(far - 4.0, 6.4, -1.5),
        DVec3::new(-6.0, 3.0, 1.5),
        DVec3::Y,
        65f32.to_radians(),
    ));
    scene.defaults.aspect = Some(16.0 / 9.0);
    Ok(scene)
}

/// A groined vault over a rectangle: two barrels that cut each other, `rise` high at its middle.
fn vault(material: u32, width: f32, depth: f32, rise: f32, cells: u32) -> Mesh {
    sheet("", material, cells, cells, |u, v| {
        let (x, z) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        // The higher of both barrels, seen from below.
        let bow = |t: f32| (1.0 - t * t).max(0.0).sqrt();
        Vec3::new(x * width / 2.0, rise * bow(x).max(bow(z)), z * depth / 2.0)
    })
}

fn cathedral(values: &Values) -> Result<Scene> {
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
    fn media_fill_a_storey_or_everything_and_have_their_mean_density() {
        let of = |address: &str| generate(&format!("builtin:{address}")).expect("scene");
        let profile = |address: &str| SceneProfile::of(&of(address));
        let partly = profile("atrium?source=point&sigma_s=0.1");
        assert!(partly.media.boundaries && !partly.media.surrounding && partly.media.homogeneous);
        assert_eq!(partly.triangles, profile("atrium").triangles + 12);
        assert!(!profile("atrium?fill=everywhere").media.any());
        let filled = profile("atrium?source=point&sigma_s=0.1&fill=everywhere");
        assert!(filled.media.surrounding && !filled.media.boundaries);
        let haze = profile("cathedral?sigma_a=0.05&sigma_s=0.15&phase=schlick&g=0.5");
        assert!(haze.media.surrounding && haze.media.phases.schlick && haze.media.absorbs);
        for fill in ["storey", "everywhere"] {
            let scene = of(&format!("atrium?source=point&sigma_s=0.1&fill={fill}&density=waves"));
            let grid = scene.media[0].density.as_ref().expect("grid");
            // Sums over whole waves, of values in f32.
            assert!((grid.mean() - 1.0).abs() < 1e-7 && grid.max() > 1.5, "{}", grid.mean());
        }
    }
}
