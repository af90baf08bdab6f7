//! Mirrors that show what is near: in one plane, beside a wall, and under an open sky.

use clerestory::Result;
use clerestory::scene::{Camera, Environment, Material, Scene, load};
use glam::{DAffine3, DVec3, Vec3};

use crate::scenes::{SMALL, cuboid, floor, lamp, orthographic, quad, transform};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "mirrors",
    breaks: "A map that is looked up in the reflected ray's own direction shows the same all over a plane mirror; beside a wall a search begins where the map sees next to nothing of it, and under an open sky distances are infinite.",
    expects: "A plane mirror that parallel rays meet shows each part of the wall before it where it is: the mean of both parts by their shares. A mirror a thousandth of a room from its wall, from 10⁻⁴ m to 10⁵ m, and one under an open sky have radiance 1 where all around them has it.",
    picture: || load("builtin:cornell-box?sphere=mirror"),
    techniques: Some(judge),
    ..HardCase::BASE
};

/// Half of what an orthographic camera sees of the plane mirror across.
const HALF: f32 = 0.5;
/// Where the wall's parts meet: a quarter of the picture is beyond it, at an edge of pixels.
const PARTED: f32 = 0.25;
/// Radiance of the wall's parts, of the part beyond last: as far apart as shows in means, and near enough that half a texel of a map does not.
const RADIANCE: [f32; 2] = [1.0, 1.5];

/// A white mirror on the floor, seen at 45°, before a wall of two parts that shine.
fn before_a_wall(radiance: [f32; 2], top: f32) -> Scene {
    let mut scene = Scene {
        name: "mirror before a wall".into(),
        ..Scene::default()
    };
    let mirror = scene.add_material(Material::mirror("mirror", Vec3::ONE));
    scene.place(floor("mirror", mirror, 1.0, 0.0));
    for (radiance, from, to) in [(radiance[0], -4.0, PARTED), (radiance[1], PARTED, 4.0)] {
        let material = scene.add_material(lamp(Vec3::splat(radiance)));
        let at = |y: f32, z: f32| Vec3::new(-2.0, y, z);
        scene.place(quad(
            "wall",
            material,
            [at(-1.0, from), at(top, from), at(top, to), at(-1.0, to)],
        ));
    }
    let eye = DVec3::new(10.0, 10.0, 0.0);
    scene.cameras.push(orthographic(eye, DVec3::ZERO, DVec3::Z, HALF));
    scene
}

/// A white mirror box beside a wall of a room that shines.
fn beside_a_wall(scale: f64) -> Result<Scene> {
    let mut scene = load("builtin:furnace-box?rho=0&emission=1")?;
    let mirror = scene.add_material(Material::mirror("mirror", Vec3::ONE));
    scene.place(cuboid(
        "mirror",
        mirror,
        Vec3::new(-0.3, -0.2, -0.998),
        Vec3::new(0.2, 0.3, -0.5),
    ));
    let (eye, middle) = (DVec3::new(0.7, 0.6, 0.8), DVec3::new(-0.05, 0.05, -0.75));
    scene.cameras = vec![Camera::look_at("main", eye, middle, DVec3::Y, 0.6)];
    transform(&mut scene, DAffine3::from_scale(DVec3::splat(scale)));
    Ok(scene)
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let painted = easel.paint_in_passes(&before_a_wall(RADIANCE, 5.0), SMALL, 16)?;
    let beyond = f64::from(0.5 * (HALF - PARTED) / HALF);
    let mean = (1.0 - beyond) * f64::from(RADIANCE[0]) + beyond * f64::from(RADIANCE[1]);
    judgement.mean("plane mirror before a wall", &painted, [mean; 3], 0.0)?;
    for scale in [1e-4, 1.0, 1e5] {
        let painted = easel.paint_in_passes(&beside_a_wall(scale)?, SMALL, 16)?;
        let what = format!("mirror beside a wall of {scale} m");
        judgement.mean(&what, &painted, [1.0; 3], 0.0)?;
    }
    // The wall is lower than what the mirror shows.
    let mut open = before_a_wall([1.0; 2], 1.75);
    open.environment = Some(Environment::uniform(Vec3::ONE));
    let painted = easel.paint_in_passes(&open, SMALL, 16)?;
    judgement.mean("mirror under the sky", &painted, [1.0; 3], 0.0)?;
    Ok(judgement)
}
