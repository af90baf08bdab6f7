//! Media that absorb all that collides in them.

use std::f64::consts::PI;

use clerestory::Result;
use clerestory::scene::{LightKind, Material, Phase, Scene};
use glam::Vec3;

use crate::scenes::{SMALL, camera_down, floor_from_above, medium};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "media-albedo-zero",
    breaks: "Roulette by the albedo divides by 0, the phase function is asked for a direction that nothing takes, and photons are stored where nothing is scattered.",
    expects: "A floor under a point light has its law times exp(−σ · way); fog beside the light that scatters nothing is exactly black.",
    picture: || Ok(lit(1.0, 0.5, 0.7, 1.0)),
    of_media: true,
    techniques: Some(judge),
    ..HardCase::BASE
};

/// Height of the light, m; its intensity is 1 W/sr.
const LIGHT: f32 = 1.0;
/// And of the camera, above it.
const CAMERA: f64 = 2.0;

/// A floor of a reflectance under a light in endless fog that absorbs, seen over `half` to each side.
fn lit(sigma: f32, reflectance: f32, g: f32, half: f32) -> Scene {
    let mut scene = floor_from_above(Material::lambert("floor", Vec3::splat(reflectance)));
    scene.media.push(medium(sigma, 0.0, Phase::HenyeyGreenstein { g }));
    scene.surrounding = Some(0);
    let (position, intensity) = (Vec3::Y * LIGHT, Vec3::ONE);
    scene.add_light("point", LightKind::Point { position, intensity });
    scene.cameras = vec![camera_down(half, CAMERA)];
    scene
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    for (sigma, g) in [(1e-3f32, 0.0f32), (0.5, 0.95), (3.0, -0.95)] {
        // So little of the floor that the law is that of the point below the light.
        let painted = easel.paint_in_passes(&lit(sigma, 0.5, g, 1e-3), SMALL, 64)?;
        let way = f64::from(LIGHT) + CAMERA;
        let expected = 0.5 / PI / f64::from(LIGHT).powi(2) * (-f64::from(sigma) * way).exp();
        judgement.mean(&format!("{sigma:e} per metre, g = {g}"), &painted, [expected; 3], 1e-4)?;
    }
    judgement.exactly(
        "black floor",
        &easel.paint(&lit(0.5, 0.0, 0.95, 1.0), SMALL, 16)?,
        [0.0; 3],
    );
    Ok(judgement)
}
