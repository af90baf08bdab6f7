//! A sheet of a medium, a millimetre thick and a free path deep.

use clerestory::Result;
use clerestory::scene::{Environment, Material, Phase, Scene};
use glam::{DVec3, Vec3};

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
        "Kernels are a quarter of a mean free path wide by default: over a wide and dense sheet so few photons lie within one that a picture of few passes lacks what the sheet \
         scatters more than once. Set `volume_radius` to a length within which tens of photons lie; it may be longer than the sheet is thick, as that of 0.1 m which collisions and beams have here. Balls of a march have to be narrower than \
         the sheet, and hold next to no photon: `march` lacks that light. Planes have no kernels, but are spanned by flights of a millimetre, of which few rays meet one: they take sixteen times the samples here, and are \
         noisy still.",
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
/// Share of the light that a sheet of one mean free path has scattered more than once, rounded up, and half of it.
const SCATTERED_AGAIN: f64 = 0.4;
const HALF_OF_IT: f64 = 0.2;
/// Radius of kernels across rays that meet the sheet head-on, m.
const RADIUS: f64 = 0.1;
/// Half of what is seen of the sheet, and of the sheet, m.
const SEEN: f32 = 1.5;
const HALF: f32 = 2.0;
/// Samples, and those of planes.
const SAMPLES: u32 = 64;
const SAMPLES_OF_PLANES: u32 = 1024;

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
    let (low, high) = (Vec3::new(-HALF, 0.0, -HALF), Vec3::new(HALF, THICKNESS, HALF));
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
    // As large as the sheet, so that half of the light comes there, of which half is seen.
    for position in &mut furnace.meshes[0].positions {
        (position.x, position.z) = (position.x.clamp(-HALF, HALF), position.z.clamp(-HALF, HALF));
    }
    furnace.cameras = vec![camera_down(SEEN, 1.0)];
    let wide = easel.with("volume_radius", RADIUS);
    let (easel, samples, documented) = match easel.chosen_word("volume") {
        _ if !easel.has("volume_radius") => (easel, SAMPLES, 0.0),
        Some("march") => (easel, SAMPLES, SCATTERED_AGAIN),
        Some("planes") => (easel, SAMPLES_OF_PLANES, HALF_OF_IT),
        _ => (&wide, SAMPLES, 0.0),
    };
    let painted = easel.paint_in_passes(&furnace, easel.size_in_media()?, samples)?;
    judgement.mean_documented("scatters in a furnace", &painted, [1.0; 3], [0.0, documented])?;
    Ok(judgement)
}
