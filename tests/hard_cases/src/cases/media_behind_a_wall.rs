//! A caustic in fog behind a wall that has no thickness.

use clerestory::Result;
use clerestory::scene::{Camera, LightKind, Material, Phase, Scene, load};
use glam::{DVec3, Vec3};

use crate::scenes::{SMALL, cuboid, medium, orthographic};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "media-behind-a-wall",
    breaks: "Light that glass gathers in fog in front of a thin wall is found by kernels of photons behind it, where the same fog is.",
    expects: "Fog inside a closed black box without thickness is exactly black, whatever shines on the box.",
    picture: || {
        let mut scene = caustic()?;
        scene.cameras = vec![orthographic(DVec3::new(-1.0, 0.5, 4.0), DVec3::X * -0.5, DVec3::Y, 1.5)];
        Ok(scene)
    },
    documented_bias: Some(
        "Kernels of photons in a medium reach through a thin wall into the same medium behind it: fog within a kernel's radius of a lit wall gets light of the other side. Kernels \
         shrink from pass to pass; choose a smaller radius, or fill what is inside with a medium of its own.",
    ),
    of_media: true,
    techniques: Some(judge),
    ..HardCase::BASE
};

/// Radius of the ball of glass, m, and where it stands: light from 2.4 m before its middle is gathered half a metre behind it, close to the wall at x = 0.
const BALL: f32 = 0.3;
const BALL_AT: Vec3 = Vec3::new(-0.6, 0.0, 0.0);
const LIGHT_AT: Vec3 = Vec3::new(-3.0, 0.0, 0.0);
/// Distance of the rays from the wall, m, and how far they spread.
const BESIDE: f64 = 0.02;
const HALF: f32 = 0.015;

/// Endless fog with a light, a ball of glass and a closed black box behind it.
fn caustic() -> Result<Scene> {
    let mut scene = load("builtin:white-furnace?frequency=8")?;
    scene.environment = None;
    scene.materials[0] = Material::glass("glass", 1.5);
    for position in &mut scene.meshes[0].positions {
        *position = *position * BALL + BALL_AT;
    }
    let black = scene.add_material(Material::lambert("black", Vec3::ZERO));
    let (low, high) = (Vec3::new(0.0, -1.0, -1.0), Vec3::new(2.0, 1.0, 1.0));
    scene.place(cuboid("box", black, low, high));
    scene.media.push(medium(0.5, 0.9, Phase::Isotropic));
    scene.surrounding = Some(0);
    let (position, intensity) = (LIGHT_AT, Vec3::splat(10.0));
    scene.add_light("point", LightKind::Point { position, intensity });
    scene.cameras = vec![along_the_wall(BESIDE)];
    Ok(scene)
}

/// Rays along the wall, from one end of the box to the other, at a distance inside of it.
fn along_the_wall(x: f64) -> Camera {
    let end = |y: f64| DVec3::new(x, y, 0.0);
    orthographic(end(-0.9), end(0.9), DVec3::X, HALF)
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let mut scene = caustic()?;
    let painted = easel.paint(&scene, SMALL, 16)?;
    judgement.exactly_unless_biased("inside of the box", &painted, [0.0; 3], [1.0, 0.0]);
    scene.cameras = vec![along_the_wall(-BESIDE)];
    let painted = easel.paint(&scene, SMALL, 16)?;
    judgement.sound("before the wall", &painted);
    let lit = painted.mean().iter().all(|(mean, _)| *mean > 0.0);
    judgement.holds("before the wall: fog is lit", lit);
    Ok(judgement)
}
