//! Glass inside glass.

use clerestory::Result;
use clerestory::scene::{Material, Scene, load};
use glam::{DVec3, Vec3};

use crate::scenes::{SMALL, camera_down, cuboid, floor, lamp};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "nested-dielectrics",
    breaks: "At the inner surface light passes from glass to glass, but the renderer takes its outside for air.",
    expects: "White glass in white glass vanishes in a white furnace. A slab inside a slab of equal index vanishes where its index is given relative to what is around it (1); given absolutely it reflects as in air, which costs 2R more: T = (1 − R)/(1 + 3R) instead of (1 − R)/(1 + R). Ink around a clear slab absorbs before it and behind it.",
    picture: || {
        let mut scene = load("builtin:cornell-box?sphere=glass&boxes=tall")?;
        let glass = scene.add_material(Material::glass("outer", 1.33));
        // Around the sphere of 0.08 m above the place of the short block.
        let sphere = scene.meshes.iter().find(|mesh| mesh.name.contains("sphere"));
        let centre = sphere.map_or(Vec3::new(0.18, 0.25, 0.17), |mesh| {
            let sum: Vec3 = mesh.positions.iter().sum();
            sum / mesh.positions.len() as f32
        });
        scene.place(cuboid("outer", glass, centre - 0.1, centre + 0.1));
        Ok(scene)
    },
    documented: Some(
        "A body that stands in another one refracts as against air. Give the inner material the ratio of both indices as its ior (at \
         least 1), or leave a gap of air between the bodies.",
    ),
    techniques: Some(judge),
    ..HardCase::BASE
};

/// A slab in a slab above a lamp, seen straight on.
fn slabs(inner_ior: f32) -> Scene {
    slab_in(Material::glass("outer", 1.5), inner_ior)
}

/// A slab of 0.2 m in the middle of one of 0.6 m of a material.
fn slab_in(outer: Material, inner_ior: f32) -> Scene {
    let mut scene = Scene {
        name: "slabs".into(),
        ..Scene::default()
    };
    let outer = scene.add_material(outer);
    let inner = scene.add_material(Material::glass("inner", inner_ior));
    let lamp = scene.add_material(lamp(Vec3::ONE));
    scene.place(cuboid(
        "outer",
        outer,
        Vec3::new(-4.0, -0.3, -4.0),
        Vec3::new(4.0, 0.3, 4.0),
    ));
    scene.place(cuboid(
        "inner",
        inner,
        Vec3::new(-3.0, -0.1, -3.0),
        Vec3::new(3.0, 0.1, 3.0),
    ));
    scene.place(floor("lamp", lamp, 40.0, -20.0));
    scene.cameras.push(camera_down(1.0, 10.0));
    scene
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let mut furnace = crate::scenes::white_furnace(Material::glass("outer", 1.5))?;
    // Flat: interpolated normals send some directions below the surface, where they are lost.
    furnace.meshes[0].normals.clear();
    let sphere = furnace.meshes[0].clone();
    let inner = furnace.add_material(Material::glass("inner", 1.8));
    let mesh = furnace.add_mesh(clerestory::scene::Mesh {
        material: Some(inner),
        ..sphere
    });
    furnace.instances.push(clerestory::scene::Instance {
        mesh,
        transform: glam::DAffine3::from_scale(DVec3::splat(0.6)),
        name: "inner".into(),
    });
    let painted = easel.paint_in_passes(&furnace, SMALL, 64)?;
    judgement.mean("sphere in a sphere", &painted, [1.0; 3], 1e-5)?;

    // R of one face in air; the outer slab alone has its multiple reflections summed.
    let r = 0.04;
    let (one, two) = ((1.0 - r) / (1.0 + r), (1.0 - r) / (1.0 + 3.0 * r));
    let painted = easel.paint_in_passes(&slabs(1.0), SMALL, 1024)?;
    judgement.uniform("inner slab of relative index 1", &painted, [one; 3])?;
    let painted = easel.paint_in_passes(&slabs(1.5), SMALL, 1024)?;
    judgement.mean_documented(
        "inner slab of absolute index 1.5",
        &painted,
        [one; 3],
        [0.0, 1.0 - two / one],
    )?;

    // 0.2 m of ink above the inner slab and 0.2 m below it, each of which halves the light.
    let ink = Material {
        attenuation_color: Vec3::splat(0.5),
        attenuation_distance: 0.2,
        ..Material::glass("outer", 1.0)
    };
    let painted = easel.paint_in_passes(&slab_in(ink, 1.0), SMALL, 64)?;
    judgement.mean("clear slab in ink", &painted, [0.25; 3], 0.0)?;
    Ok(judgement)
}
