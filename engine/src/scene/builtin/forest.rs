//! A clearing: many small leaves over hilly ground, under the sky.
//!
//! Stands in for the forest model of the ray-tracing literature of about 2010 (174,117 triangles), whose file cannot be had by package: as
//! many triangles, most of them small and far from the axes, but a layout of our own. Around it there may be as many more trees as instances of a
//! few meshes: 10,000 of them are 500 million triangles.

use glam::{DAffine3, DQuat, DVec3, Quat, Vec3};

use super::Entry;
use super::noise::{unit, value_noise};
use super::parameters::{Parameter, Values};
use super::shapes::{MeshBuilder, geodesic_sphere, lathe, point_lamp, sheet};
use super::textures::sky;
use crate::Result;
use crate::scene::{Camera, Instance, Material, Mesh, Scene};

pub const FOREST: Entry = Entry {
    name: "forest",
    summary: "A clearing among trees with leaves, stones and toadstools: about 174 thousand triangles with its default trees.",
    parameters: &[
        Parameter::integer("trees", "44", 1, 2000, "trees"),
        Parameter::integer(
            "instances",
            "0",
            0,
            40_000,
            "trees around these, of 50,432 triangles each, as instances of a few",
        ),
        Parameter::integer("seed", "1", 0, u32::MAX, "seed of the plants"),
        Parameter::choice("source", "sky", &["sky", "point"], "the sky, or a lamp in the clearing"),
        Parameter::color("light", "40", 0.0, 1e6, "intensity of the lamp, W/sr"),
    ],
    build,
};

/// Half the side of the ground, m, and its cells.
const HALF: f32 = 12.0;
const CELLS: u32 = 96;
const BRANCHES: u32 = 14;
const LEAVES: u32 = 1500;
/// Radius of the clearing, m.
const CLEARING: f32 = 3.5;
/// Kinds of trees that are instances, and leaves of each.
const KINDS: u32 = 4;
const KIND_LEAVES: u32 = 25_000;
/// Ground of each of them, m², and how much lower it is than that of the clearing, m.
const TREE_GROUND: f32 = 6.0;
const LOWER: f32 = 0.4;

/// Height of the ground, m.
fn ground(seed: u32, x: f32, z: f32) -> f32 {
    let at = |scale: f32| value_noise(seed, (x + HALF) / scale, (z + HALF) / scale, 64);
    1.6 * at(6.0) + 0.4 * at(1.5)
}

fn build(values: &Values) -> Result<Scene> {
    let seed = values.integer("seed")?;
    let mut scene = Scene::default();
    let soil = scene.add_material(Material::lambert("soil", Vec3::new(0.25, 0.22, 0.1)));
    let bark = scene.add_material(Material::lambert("bark", Vec3::new(0.22, 0.15, 0.1)));
    let leaf = scene.add_material(Material::lambert("leaves", Vec3::new(0.15, 0.4, 0.08)));
    let stone = scene.add_material(Material::lambert("stones", Vec3::splat(0.4)));
    let cap = scene.add_material(Material::lambert("toadstools", Vec3::new(0.65, 0.1, 0.06)));
    let hills = sheet("ground", soil, CELLS, CELLS, |u, v| {
        let (x, z) = ((2.0 * u - 1.0) * HALF, (1.0 - 2.0 * v) * HALF);
        Vec3::new(x, ground(seed, x, z), z)
    });
    scene.place(hills);
    let mut trunks = MeshBuilder::new("trunks", bark);
    let mut leaves = MeshBuilder::new("leaves", leaf);
    let parts = TreeParts::new(bark);
    for tree in 0..values.integer("trees")? {
        let random = |dimension| unit(seed, tree, dimension);
        let angle = std::f32::consts::TAU * random(0);
        let distance = CLEARING + (HALF - CLEARING - 1.0) * random(1).sqrt();
        let (x, z) = (distance * angle.cos(), distance * angle.sin());
        let foot = Vec3::new(x, ground(seed, x, z) - 0.2, z);
        let height = 4.0 + 4.0 * random(2);
        let width = 0.12 + 0.1 * random(3);
        parts.trunk(&mut trunks, seed, tree, foot, [width, height]);
        crown(&mut leaves, seed, tree, LEAVES, foot, height);
    }
    scene.place(trunks.build());
    scene.place(leaves.build());
    let boulder = geodesic_sphere("", stone, 1.0, 4, false);
    let mut stones = MeshBuilder::new("stones", stone);
    let toadstool = lathe(
        "",
        cap,
        &[(0.0, 0.0), (0.2, 0.0), (0.15, 0.6), (0.6, 0.55), (0.5, 0.8), (0.0, 1.0)],
        16,
    );
    let mut toadstools = MeshBuilder::new("toadstools", cap);
    for i in 0..20 {
        let random = |dimension| unit(seed ^ 0x77, i, dimension);
        let (x, z) = (2.0 * CLEARING * (random(0) - 0.5), 2.0 * CLEARING * (random(1) - 0.5));
        let foot = Vec3::new(x, ground(seed, x, z), z);
        let size = 0.1 + 0.25 * random(2);
        stones.append(&boulder, |p| foot + p * Vec3::new(1.0, 0.6, 0.8) * size);
        let beside = foot + Vec3::new(0.5, 0.0, 0.2);
        let beside = Vec3::new(beside.x, ground(seed, beside.x, beside.z), beside.z);
        toadstools.append(&toadstool, |p| beside + p * size);
    }
    scene.place(stones.build());
    scene.place(toadstools.build());
    plant(
        &mut scene,
        seed,
        values.integer("instances")?,
        &parts,
        [soil, bark, leaf],
    );
    if values.word("source")? == "sky" {
        scene.environment = Some(sky(Vec3::new(0.4, 0.7, 0.3).normalize(), 1.0));
    } else {
        let position = Vec3::new(0.0, ground(seed, 0.0, 0.0) + 2.0, 0.0);
        point_lamp(&mut scene, position, values.color("light")?);
    }
    let eye = |x: f64, z: f64, above: f64| DVec3::new(x, f64::from(ground(seed, x as f32, z as f32)) + above, z);
    scene.cameras.push(Camera::look_at(
        "main",
        eye(3.0, 3.2, 1.3),
        eye(-2.0, -2.5, 1.8),
        DVec3::Y,
        65f32.to_radians(),
    ));
    scene.cameras.push(Camera::look_at(
        "end",
        eye(-3.0, 2.0, 2.2),
        eye(3.0, -3.0, 1.2),
        DVec3::Y,
        65f32.to_radians(),
    ));
    scene.defaults.aspect = Some(4.0 / 3.0);
    Ok(scene)
}

/// What trunks are made of.
struct TreeParts {
    stem: Mesh,
    twig: Mesh,
}

impl TreeParts {
    fn new(bark: u32) -> Self {
        Self {
            stem: lathe(
                "",
                bark,
                &[(0.0, 0.0), (1.0, 0.0), (0.7, 0.1), (0.6, 0.4), (0.45, 0.75), (0.0, 1.0)],
                12,
            ),
            twig: lathe("", bark, &[(0.0, 0.0), (1.0, 0.0), (0.6, 0.6), (0.0, 1.0)], 6),
        }
    }

    /// A stem of so much width and height, with its branches.
    fn trunk(&self, trunks: &mut MeshBuilder, seed: u32, tree: u32, foot: Vec3, [width, height]: [f32; 2]) {
        trunks.append(&self.stem, |p| foot + p * Vec3::new(width, height, width));
        for branch in 0..BRANCHES {
            let random = |dimension| unit(seed ^ 0x5bd1, tree * BRANCHES + branch, dimension);
            let at = foot + Vec3::Y * (height * (0.35 + 0.6 * random(0)));
            let turn = Quat::from_rotation_y(std::f32::consts::TAU * random(1))
                * Quat::from_rotation_z(-0.9 - 0.4 * random(2));
            let long = 0.25 * height * (0.6 + 0.4 * random(3));
            trunks.append(&self.twig, |p| at + turn * (p * Vec3::new(0.04, long, 0.04)));
        }
    }
}

/// Two triangles per leaf, in a crown of about the tree's upper half.
fn crown(leaves: &mut MeshBuilder, seed: u32, tree: u32, count: u32, foot: Vec3, height: f32) {
    let crown = foot + Vec3::Y * (0.72 * height);
    for i in 0..count {
        let random = |dimension| unit(seed ^ 0x91e1, tree * count + i, dimension);
        let [u, v, w] = [0, 1, 2].map(|d| 2.0 * random(d) - 1.0);
        let direction = Vec3::new(u, v, w).normalize_or(Vec3::Y);
        let middle = crown + direction * random(3).cbrt() * Vec3::new(0.28, 0.36, 0.28) * height;
        let turn = Quat::from_rotation_y(6.3 * random(4)) * Quat::from_rotation_x(6.3 * random(5));
        let size = 0.05 + 0.05 * random(6);
        let corner = |x: f32, z: f32| middle + turn * (Vec3::new(x, 0.3 * x.abs(), z) * size);
        leaves.quad([corner(0.0, -1.0), corner(0.5, 0.0), corner(0.0, 1.0), corner(-0.5, 0.0)]);
    }
}

/// So many trees around the clearing, with the ground that they stand on: instances of a trunk and a crown of few kinds, turned, and of several sizes.
fn plant(scene: &mut Scene, seed: u32, count: u32, parts: &TreeParts, [soil, bark, leaf]: [u32; 3]) {
    if count == 0 {
        return;
    }
    let seed = seed ^ 0x7ee5;
    // A ring as large as they need.
    let reach = (HALF * HALF + count as f32 * TREE_GROUND / std::f32::consts::PI).sqrt();
    let land = |x: f32, z: f32| ground(seed, x, z) - LOWER;
    let side = reach + HALF;
    scene.place(sheet("land", soil, CELLS, CELLS, |u, v| {
        let (x, z) = ((2.0 * u - 1.0) * side, (1.0 - 2.0 * v) * side);
        Vec3::new(x, land(x, z), z)
    }));
    let kinds: Vec<[u32; 2]> = (0..KINDS.min(count))
        .map(|kind| {
            let height = 5.0 + kind as f32;
            let mut trunk = MeshBuilder::new("trunk", bark);
            let mut leaves = MeshBuilder::new("crown", leaf);
            parts.trunk(&mut trunk, seed, kind, Vec3::ZERO, [0.03 * height, height]);
            crown(&mut leaves, seed, kind, KIND_LEAVES, Vec3::ZERO, height);
            [trunk.build(), leaves.build()].map(|mesh| scene.add_mesh(mesh))
        })
        .collect();
    for tree in 0..count {
        let random = |dimension| unit(seed, tree, dimension);
        let angle = std::f32::consts::TAU * random(0);
        let share = random(1);
        let distance = (HALF * HALF + share * (reach * reach - HALF * HALF)).sqrt();
        let (x, z) = (distance * angle.cos(), distance * angle.sin());
        // The ground's cells are large: roots reach below them.
        let foot = Vec3::new(x, land(x, z) - 0.5, z);
        let transform = DAffine3::from_scale_rotation_translation(
            DVec3::splat(f64::from(0.8 + 0.5 * random(2))),
            DQuat::from_rotation_y(std::f64::consts::TAU * f64::from(random(3))),
            foot.as_dvec3(),
        );
        for mesh in kinds[(tree % KINDS.min(count)) as usize] {
            scene.instances.push(Instance {
                mesh,
                transform,
                name: "tree".into(),
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::generate;
    use crate::scene::SceneProfile;

    #[test]
    fn trees_around_the_clearing_are_instances_of_few_meshes() {
        let profile = |instances: u32| {
            SceneProfile::of(&generate(&format!("builtin:forest?instances={instances}")).expect("a scene"))
        };
        let [none, few, many] = [0, 8, 10_000].map(profile);
        assert_eq!(none.instances + 1 + 2 * 8, few.instances);
        assert_eq!(few.unique_triangles, many.unique_triangles);
        let of_trees = |profile: &SceneProfile| profile.triangles - none.triangles - 2 * 96 * 96;
        assert_eq!(of_trees(&few) % 8, 0);
        assert_eq!(of_trees(&many), 10_000 * of_trees(&few) / 8);
        assert_eq!(of_trees(&few) / 8, TREE_TRIANGLES);
        assert!(many.triangles > 500_000_000);
    }

    #[test]
    fn bounds_are_those_of_all_vertices() {
        let scene = generate("builtin:forest?trees=2&instances=30").expect("a scene");
        let vertices = scene.instances.iter().flat_map(|instance| {
            let positions = scene.meshes[instance.mesh as usize].positions.iter();
            positions.map(|p| instance.transform.transform_point3(p.as_dvec3()))
        });
        let (low, high) = vertices.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
        assert_eq!(SceneProfile::of(&scene).bounds, Some([low.to_array(), high.to_array()]));
    }

    /// As the parameter's meaning says.
    const TREE_TRIANGLES: u64 = 50_432;
}
