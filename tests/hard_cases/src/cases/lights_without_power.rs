//! Lights of power zero and of area zero.

use clerestory::Result;
use clerestory::scene::{LightKind, Material, Mesh, Scene, load};
use glam::Vec3;

use crate::scenes::{SMALL, floor_from_above, lamp, point_triangle};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "lights-without-power",
    breaks: "A choice among lights by power divides by a sum of zero; a density of one over an area of zero is infinite.",
    expects: "They are not lights: exactly black alone, and beside a light that shines the picture is the same to the bit as without them.",
    picture: || {
        let mut scene = load("builtin:cornell-box")?;
        point_triangle(&mut scene, lamp(Vec3::splat(1e6)), Vec3::splat(0.25));
        Ok(scene)
    },
    documented_bias: Some(
        "A map of what a place sees is drawn from the middle of the scene's bounds, beyond a near plane that follows their extent, and a vertex that is as far away as \
         numbers go moves both: light by such a map differs, or is missing. Give the setting `place`, and leave such triangles out.",
    ),
    documented_walks: Some(
        "Light subpaths from the sky and from the sun begin on a disc about the scene's bounds, which a vertex as far away as numbers go widens: what they show the \
         camera has other weights, and the picture other noise. Leave such triangles out.",
    ),
    techniques: Some(judge),
    ..HardCase::BASE
};

/// A triangle of a material, with edges along two axes; near `place` only as far as f32 tells them apart.
fn emitting_triangle(scene: &mut Scene, material: &Material, place: Vec3, edge: f32) {
    let material = scene.add_material(material.clone());
    scene.place(Mesh {
        name: "emitter".into(),
        positions: vec![
            place,
            place + edge * Vec3::X + edge * Vec3::X,
            place + edge * Vec3::Z + edge * Vec3::Z,
        ],
        triangles: vec![[0, 1, 2]],
        material: Some(material),
        ..Mesh::default()
    });
}

/// What is added to a scene, with its name.
type Addition<'a> = (&'static str, &'a dyn Fn(&mut Scene));

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let floor_only = floor_from_above(Material::lambert("floor", Vec3::splat(0.5)));
    let emitter = Material {
        double_sided: true,
        ..lamp(Vec3::splat(1e6))
    };
    let off = LightKind::Point {
        position: Vec3::Y,
        intensity: Vec3::ZERO,
    };
    let dark: [Addition<'_>; 4] = [
        ("no power", &|scene| {
            scene.add_light("off", off);
            scene.add_light(
                "off",
                LightKind::Directional {
                    direction: Vec3::NEG_Y,
                    irradiance: Vec3::ZERO,
                },
            );
        }),
        ("no area", &|scene| point_triangle(scene, emitter.clone(), Vec3::Y)),
        // Corners that f32 holds, but not the edges between them.
        ("no place", &|scene| {
            emitting_triangle(scene, &emitter, Vec3::splat(-3e38), 3e38)
        }),
        // A size whose squares vanish.
        ("no squares", &|scene| {
            emitting_triangle(scene, &emitter, Vec3::Y, 1e-30)
        }),
    ];
    for (what, add) in dark {
        let mut scene = floor_only.clone();
        add(&mut scene);
        judgement.exactly(what, &easel.paint(&scene, SMALL, 16)?, [0.0; 3]);
    }
    // Beside a light that shines only that one is seen.
    let mut lit = floor_only;
    lit.add_light(
        "sun",
        LightKind::Directional {
            direction: Vec3::NEG_Y,
            irradiance: Vec3::ONE,
        },
    );
    let alone = easel.paint(&lit, SMALL, 16)?;
    judgement.holds("beside a light: black", alone.mean()[0].0 > 0.1);
    lit.add_light("off", off);
    emitting_triangle(&mut lit, &emitter, Vec3::splat(-3e38), 3e38);
    point_triangle(&mut lit, emitter, Vec3::Y);
    let painted = easel.paint(&lit, SMALL, 16)?;
    judgement.sound("beside a light", &painted);
    if easel.has("place") || easel.has("light_paths") {
        let differ = painted.bits().iter().zip(&alone.bits()).filter(|(a, b)| a != b).count();
        judgement.at_most_documented("beside a light: values that differ", differ as f64, 0.0, f64::INFINITY);
    } else {
        judgement.same_bits("beside a light", &painted, &alone);
    }
    Ok(judgement)
}
