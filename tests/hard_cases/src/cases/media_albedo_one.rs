//! Media that scatter and absorb nothing.

use clerestory::Result;
use clerestory::scene::{Environment, Material, Medium, Phase, Scene, load};
use glam::Vec3;

use crate::scenes::SMALL;
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "media-albedo-one",
    breaks: "Paths in a dense medium that absorbs nothing scatter ten thousand times; roulette by throughput never ends them, and a cut at a depth loses light.",
    expects: "A ball of it in a uniform environment of radiance 1 has radiance 1 at any optical thickness: it cannot be seen.",
    picture: || {
        ball(4.0, Phase::Isotropic).map(|mut scene| {
            scene.environment = Some(Environment {
                name: "sky and ground".into(),
                width: 1,
                height: 2,
                radiance: vec![Vec3::new(0.5, 0.7, 1.0), Vec3::splat(0.1)],
                ..Environment::uniform(Vec3::ONE)
            });
            scene
        })
    },
    documented_bias: Some(
        "Photons of the map lack beyond the boundary of a medium: what a ray sees within a kernel's radius of it, a quarter of a mean free path, is too dark where it is not met \
         head-on. Kernels shrink from pass to pass; choose a smaller radius.",
    ),
    of_media: true,
    techniques: Some(judge),
    ..HardCase::BASE
};

/// What techniques with kernels may lose at the boundary of a medium of any density, relatively.
pub(super) const AT_BOUNDARIES: f64 = 0.08;

/// A ball of radius 1 of a medium that scatters, in a uniform environment.
pub(super) fn ball(sigma: f32, phase: Phase) -> Result<Scene> {
    let mut scene = load("builtin:white-furnace?frequency=4")?;
    scene.media.push(Medium {
        name: "milk".into(),
        sigma_s: Vec3::splat(sigma),
        phase,
        ..Medium::default()
    });
    scene.materials[0] = Material {
        interior: Some(0),
        boundary: true,
        ..Material::default()
    };
    Ok(scene)
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    for sigma in [1e-4, 1.0, 30.0] {
        let painted = easel.paint_in_passes(&ball(sigma, Phase::Isotropic)?, easel.size_in_media()?, 64)?;
        let documented = if easel.has_bias() { AT_BOUNDARIES } else { 0.0 };
        judgement.mean_documented(
            &format!("optical radius {sigma:e}"),
            &painted,
            [1.0; 3],
            [0.0, documented],
        )?;
    }
    // So dense that few paths come back before roulette ends them; those that do carry much: the mean is not near to normal.
    judgement.sound(
        "optical radius 1e4",
        &easel.paint(&ball(1e4, Phase::Isotropic)?, SMALL, 16)?,
    );
    Ok(judgement)
}
