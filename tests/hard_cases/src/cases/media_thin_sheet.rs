//! A sheet of a medium, a millimetre thick and a free path deep.

use clerestory::Result;
use clerestory::scene::{Environment, Material, Phase, Scene};
use glam::{DVec3, Vec3};

use super::media_albedo_one::AT_BOUNDARIES;
use crate::scenes::{SMALL, camera_down, cuboid, floor_from_above, lamp, medium, orthographic};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "media-thin-sheet",
    breaks: "Rays that are moved off a surface by a fixed distance jump over the sheet; kernels of photons are wider than it.",
    expects: "A floor of radiance 1 seen through a sheet of 10⁻³ m that absorbs has exp(−σ h / cos θ), and a sheet that only scatters cannot be seen in a uniform environment of radiance 1.",
    picture: || {
        let mut scene = sheet(lamp(Vec3::new(0.9, 0.6, 0.3)), 0.5);
        scene.environment = Some(Environment::uniform(Vec3::new(0.2, 0.4, 0.8)));
        scene.cameras = vec![orthographic(DVec3::new(3.0, 1.0, 2.0), DVec3::ZERO, DVec3::Y, 3.0)];
        Ok(scene)
    },
    documented_bias: Some(
        "Photons of the map lack beyond both faces of a sheet, as far as kernels reach: what it scatters more than once is too dark. Kernels shrink from pass to pass; choose a \
         smaller radius.",
    ),
    of_media: true,
    techniques: Some(judge),
    ..HardCase::BASE
};

/// Thickness, m, and extinction, 1/m.
const THICKNESS: f32 = 1e-3;
const SIGMA: f32 = 1e3;
/// Distances of about a metre are rounded to a part in ten million: a few ten-thousandths of the sheet.
const ROUNDED: f64 = 5e-4;

/// A floor of a material, and above it the sheet with an albedo.
fn sheet(under: Material, albedo: f32) -> Scene {
    let mut scene = floor_from_above(under);
    for position in &mut scene.meshes[0].positions {
        position.y = -0.1;
    }
    scene.media.push(medium(SIGMA, albedo, Phase::Isotropic));
    let boundary = scene.add_material(Material {
        name: "boundary".into(),
        boundary: true,
        interior: Some(0),
        ..Material::default()
    });
    let (low, high) = (Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, THICKNESS, 2.0));
    scene.place(cuboid("sheet", boundary, low, high));
    scene.cameras = vec![camera_down(0.5, 1.0)];
    scene
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let depth = f64::from(SIGMA) * f64::from(THICKNESS);
    let mut absorbs = sheet(lamp(Vec3::ONE), 0.0);
    let painted = easel.paint_in_passes(&absorbs, SMALL, 64)?;
    judgement.mean("absorbs, from above", &painted, [(-depth).exp(); 3], ROUNDED)?;
    absorbs.cameras = vec![orthographic(DVec3::new(0.7, 0.7, 0.0), DVec3::ZERO, DVec3::Z, 0.3)];
    let painted = easel.paint_in_passes(&absorbs, SMALL, 64)?;
    let aslant = (-depth * std::f64::consts::SQRT_2).exp();
    judgement.mean("absorbs, aslant", &painted, [aslant; 3], ROUNDED)?;

    let mut furnace = sheet(lamp(Vec3::ONE), 1.0);
    furnace.environment = Some(Environment::uniform(Vec3::ONE));
    let painted = easel.paint_in_passes(&furnace, SMALL, 64)?;
    let documented = if easel.has_bias() { AT_BOUNDARIES } else { 0.0 };
    judgement.mean_documented("scatters in a furnace", &painted, [1.0; 3], [0.0, documented])?;
    Ok(judgement)
}
