//! Lights inside bodies and in the plane of walls.

use clerestory::Result;
use clerestory::scene::{LightKind, Material, Scene, load};
use glam::Vec3;

use crate::scenes::{SMALL, cuboid, floor, floor_from_above, lamp};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "light-inside-geometry",
    breaks: "Shadow rays that begin or end on a surface meet it by rounding or miss the wall around a light: light leaks out, and 1/r² at r = 0 is infinite.",
    expects: "A light in a closed box is not seen outside, exactly; a point light in the plane of a floor and a lamp in that plane give the floor beside them exactly nothing.",
    picture: || {
        load("builtin:cornell-box?sphere=diffuse&source=point").map(|mut scene| {
            // Into the tall block.
            for light in &mut scene.lights {
                if let LightKind::Point { position, .. } = &mut light.kind {
                    *position = Vec3::new(0.368, 0.2, 0.351);
                }
            }
            scene.environment = Some(clerestory::scene::Environment::uniform(Vec3::splat(0.2)));
            scene
        })
    },
    documented_bias: Some(
        "Kernels of photons reach in their plane as far as they are wide, under a wall that stands on it too: what lies within a kernel's \
         radius of a lit surface of the same plane gets a share of its light. Kernels shrink from pass to pass; choose a smaller radius, or \
         the final gather, which sees the map only from afar. Rasterized pictures are off by parts of a pixel at silhouettes, so that a \
         surface may be seen there where it lies inside of the box, and is lit.",
    ),
    documented_walks: Some(
        "Virtual lights within rounding of an edge, 10⁻⁷ of its coordinates, shine past the surface beside it: single pixels outside a closed body get \
         light of a lamp that stands 10⁻⁴ m from an edge, and a walk from a lamp in a floor's plane may end on the floor where the lamp is. Move such lamps \
         away from it by a thousandth of the body's size.",
    ),
    techniques: Some(judge),
    ..HardCase::BASE
};

fn grey_floor() -> Scene {
    floor_from_above(Material::lambert("floor", Vec3::splat(0.5)))
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let point = |position: Vec3| LightKind::Point {
        position,
        intensity: Vec3::splat(1e3),
    };
    let mut boxed = grey_floor();
    let wall = boxed.add_material(Material::lambert("wall", Vec3::splat(0.9)));
    // One face of the box is level with the floor's plane, so that a corner of it lies in the floor.
    boxed.place(cuboid(
        "box",
        wall,
        Vec3::new(-0.4, 0.0, -0.3),
        Vec3::new(0.3, 0.7, 0.5),
    ));
    boxed.add_light("inside", point(Vec3::new(0.1, 0.2, 0.1)));
    boxed.add_light(
        "in a corner",
        point(Vec3::new(-0.4, 0.7, -0.3) + Vec3::new(1.0, -1.0, 1.0) * 1e-4),
    );
    // Kernels of a fiftieth of the scene reach a fifth of a metre around the box; one walk in thousands ends within rounding of an edge.
    judgement.exactly_unless_biased(
        "light in a box",
        &easel.paint(&boxed, SMALL, 64)?,
        [0.0; 3],
        [0.5, 0.05],
    );

    let mut in_plane = grey_floor();
    in_plane.add_light("in the plane", point(Vec3::ZERO));
    judgement.exactly_unless_biased(
        "point light in the floor",
        &easel.paint(&in_plane, SMALL, 64)?,
        [0.0; 3],
        [0.0, 0.05],
    );

    let mut lamp_beside = grey_floor();
    let shine = lamp_beside.add_material(lamp(Vec3::splat(1e3)));
    let mut square = floor("lamp", shine, 0.5, 0.0);
    square.positions.iter_mut().for_each(|p| p.x += 2.0);
    lamp_beside.place(square);
    judgement.exactly(
        "lamp in the floor's plane",
        &easel.paint(&lamp_beside, SMALL, 64)?,
        [0.0; 3],
    );
    Ok(judgement)
}
