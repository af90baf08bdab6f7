//! A courtyard with two storeys of arcades.
//!
//! It stands in for the atrium of the ray-tracing literature of about 2010 (66,454 triangles), whose file cannot be had by package: as many
//! triangles, columns, arches and walls along the axes, but a layout of our own.

use std::f32::consts::PI;
use std::f64::consts::TAU;

use glam::{DVec3, Vec3};

use super::Entry;
use super::halls::{column, put};
use super::media::{ABSORPTION, G, PHASE, SCATTERING, add_boundary, add_medium, medium};
use super::parameters::{Parameter, Values};
use super::shapes::{MeshBuilder, arch, lathe, point_lamp, sheet};
use super::textures::sky;
use crate::Result;
use crate::scene::{Camera, DensityGrid, Material, Scene};

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
            "where the air is a medium: up to the ceiling of the lower gallery, or in all of space, through which no sky shines",
        ),
        Parameter::choice(
            "density",
            "even",
            &["even", "waves"],
            "of the medium: even, or a grid of waves with a mean of 1",
        ),
    ],
    build,
};

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

fn build(values: &Values) -> Result<Scene> {
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
        for fill in ["storey", "everywhere"] {
            let scene = of(&format!("atrium?source=point&sigma_s=0.1&fill={fill}&density=waves"));
            let grid = scene.media[0].density.as_ref().expect("grid");
            // Sums over whole waves, of values in f32.
            assert!((grid.mean() - 1.0).abs() < 1e-7 && grid.max() > 1.5, "{}", grid.mean());
        }
    }
}
