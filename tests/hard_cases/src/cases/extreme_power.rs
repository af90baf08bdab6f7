//! Lights of 10⁻¹² W and of 10¹² W.

use clerestory::Result;
use clerestory::scene::{Scene, load};
use glam::Vec3;

use crate::scenes::{SMALL, furnace};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "extreme-power",
    breaks: "Squares of radiance overflow or vanish in f32, thresholds for what is dark cut paths off, and fixed-point sums clip.",
    expects: "Radiance is proportional to power: times 2⁴⁰ and 2⁻⁴⁰ (10^±12) a Cornell box has the same bits but for the exponent, and a furnace of 10¹² has 10¹².",
    picture: || {
        let mut scene = load("builtin:cornell-box")?;
        scale_lights(&mut scene, 1e12);
        Ok(scene)
    },
    techniques: Some(judge),
    ..HardCase::BASE
};

fn scale_lights(scene: &mut Scene, factor: f32) {
    scene
        .materials
        .iter_mut()
        .for_each(|material| material.emission *= factor);
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let truth = easel.paint(&load("builtin:cornell-box")?, SMALL, 16)?;
    for exponent in [-40, 40] {
        let factor = 2f32.powi(exponent);
        let mut scene = load("builtin:cornell-box")?;
        scale_lights(&mut scene, factor);
        let mut painted = easel.paint(&scene, SMALL, 16)?;
        let what = format!("Cornell box times 2^{exponent}");
        judgement.sound(&what, &painted);
        painted.radiance.iter_mut().for_each(|v| *v /= factor);
        painted.variance.iter_mut().for_each(|v| *v = *v / factor / factor);
        judgement.same_bits(&what, &painted, &truth);
    }
    for factor in [1e-12f32, 1e12] {
        let mut scene = furnace()?;
        scene.materials[0].emission = Vec3::splat(0.5 * factor);
        let painted = easel.calm().paint_in_passes(&scene, SMALL, 64)?;
        judgement.uniform(&format!("furnace times {factor:e}"), &painted, [f64::from(factor); 3])?;
    }
    Ok(judgement)
}
