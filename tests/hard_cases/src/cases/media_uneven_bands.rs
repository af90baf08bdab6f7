//! Media whose bands come differently far: extinctions as 1 : 4 : 16.

use clerestory::Result;
use clerestory::scene::{Medium, Phase, Scene};
use glam::Vec3;

use super::media_albedo_one::{AT_BOUNDARIES, ball};
use crate::scenes::{SMALL, camera_down, floor_from_above, lamp};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "media-uneven-bands",
    breaks: "Distances drawn by the densest band give the thinnest one weights of exp((σ_max − σ) t), whose square has no bound.",
    expects: "A floor of radiance 1 seen through a metre of extinctions of 1, 4 and 16 times as much has exp(−σ) in each band, and a ball of such media that only scatters cannot be seen in a uniform environment of radiance 1.",
    picture: || uneven_ball(2.0),
    documented_bias: Some(
        "Photons of the map lack beyond the boundary of a medium: what a ray sees within a kernel's radius of it, a quarter of a mean free path, is too dark where it is not met \
         head-on. Kernels shrink from pass to pass; choose a smaller radius.",
    ),
    of_media: true,
    techniques: Some(judge),
    ..HardCase::BASE
};

/// Of the three bands.
const BANDS: Vec3 = Vec3::new(1.0, 4.0, 16.0);

/// A ball of radius 1 that scatters, of that extinction in its thinnest band.
fn uneven_ball(sigma: f32) -> Result<Scene> {
    let mut scene = ball(sigma, Phase::Isotropic)?;
    scene.media[0].sigma_s = BANDS * sigma;
    Ok(scene)
}

/// A floor of radiance 1 a metre away in a medium that absorbs.
fn floor_in_fog(sigma: f32) -> Scene {
    let mut scene = floor_from_above(lamp(Vec3::ONE));
    scene.media.push(Medium {
        name: "fog".into(),
        sigma_a: BANDS * sigma,
        ..Medium::default()
    });
    scene.surrounding = Some(0);
    scene.cameras = vec![camera_down(1.0, 1.0)];
    scene
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    for sigma in [1e-3f32, 0.1, 0.5] {
        let painted = easel.paint_in_passes(&floor_in_fog(sigma), SMALL, 64)?;
        let expected = (BANDS * -sigma).as_dvec3().to_array().map(f64::exp);
        judgement.mean(&format!("absorbs {sigma:e} per metre"), &painted, expected, 1e-4)?;
    }
    for sigma in [0.05, 0.5] {
        let painted = easel.paint_in_passes(&uneven_ball(sigma)?, easel.size_in_media()?, 64)?;
        let documented = if easel.has_bias() { AT_BOUNDARIES } else { 0.0 };
        judgement.mean_documented(
            &format!("scatters {sigma:e} per metre in a furnace"),
            &painted,
            [1.0; 3],
            [0.0, documented],
        )?;
    }
    Ok(judgement)
}
