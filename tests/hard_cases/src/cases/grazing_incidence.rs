//! Surfaces seen almost edge-on.

use clerestory::Result;
use clerestory::scene::load;
use glam::DVec3;

use crate::lobes::{self, LOBES, TABLE_GAIN};
use crate::scenes::{SMALL, floor_in_furnace, orthographic};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "grazing-incidence",
    breaks: "Weights divide by a cosine near zero; half the reflected directions of a rough surface lie below it; Fresnel and masking terms cancel to 0/0.",
    expects: "At 0.1° above a floor, and in f64 down to a cosine of 10⁻⁶, all lobes are finite, gain at most 0.5 %, and the lossless ones lose at most 0.9 %; narrow metal lobes no more than their single scattering loses.",
    picture: || {
        let mut scene = load("builtin:materials")?;
        if let Some(camera) = scene.cameras.first_mut() {
            let eye = camera.transform.translation;
            *camera = orthographic(DVec3::new(eye.x, 0.02, eye.z), DVec3::ZERO, DVec3::Y, 1.0);
        }
        Ok(scene)
    },
    documented: Some(
        "Rough metals are compensated for scattering among their microfacets by a table, which below 1° of elevation is too coarse for \
         the narrowest lobes: at perceptual roughness 0.03 they lose up to a tenth of their light there, as uncompensated ones do. Make what is \
         seen that edge-on a mirror (roughness 0) or rougher (0.1 and more).",
    ),
    techniques: Some(judge),
    lobes: Some(|lobe, judgement| {
        for roughness in ROUGHNESS {
            let what = format!("{} of roughness {roughness}", lobe.name);
            let material = (lobe.material)(roughness);
            for cosine in [0.02, 3e-3, 1e-3, 3e-4, 1e-6] {
                let loss = (lobe.loss(roughness)).map(|loss| loss + lobes::single_scattering_loss(&material, cosine));
                lobes::judge(&what, &material, cosine, loss, judgement);
            }
        }
    }),
    ..HardCase::BASE
};

/// Mirrors, the narrowest lobes that are none (α = 0.001), and wider ones.
const ROUGHNESS: [f32; 5] = [0.0, 0.0317, 0.1, 0.3, 1.0];

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let elevation = 0.1f64.to_radians();
    // Glass bounds a solid, which a floor does not.
    for lobe in LOBES.iter().filter(|lobe| lobe.name != "glass") {
        // The widest lobes are judged in f64 alone.
        for roughness in [0.0, 0.0317, 0.1] {
            let material = (lobe.material)(roughness);
            let single = lobes::single_scattering_loss(&material, elevation.sin());
            let painted = easel.paint_in_passes(&floor_in_furnace(material, elevation, 0.01), SMALL, 64)?;
            let what = format!("{} of roughness {roughness}", lobe.name);
            judgement.mean_at_most(&what, &painted, 1.0 + TABLE_GAIN);
            if let Some(loss) = lobe.loss(roughness) {
                judgement.mean_documented(&what, &painted, [1.0; 3], [loss, loss + single])?;
            }
        }
    }
    Ok(judgement)
}
