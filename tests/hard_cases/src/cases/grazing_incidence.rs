//! Surfaces seen almost edge-on.

use clerestory::Result;
use clerestory::scene::load;
use glam::DVec3;

use crate::lobes::{self, LOBES, TABLE_GAIN, TABLE_LOSS};
use crate::scenes::{SMALL, floor_in_furnace, orthographic};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "grazing-incidence",
    breaks: "Weights divide by a cosine near zero; half the reflected directions of a rough surface lie below it; Fresnel and masking terms cancel to 0/0.",
    expects: "At 0.1° above a floor, and in f64 down to a cosine of 10⁻⁶, all lobes are finite, gain at most 0.5 %, and the lossless ones lose at most 0.9 %.",
    picture: || {
        let mut scene = load("builtin:materials")?;
        if let Some(camera) = scene.cameras.first_mut() {
            let eye = camera.transform.translation;
            *camera = orthographic(DVec3::new(eye.x, 0.02, eye.z), DVec3::ZERO, DVec3::Y, 1.0);
        }
        Ok(scene)
    },
    techniques: Some(judge),
    lobes: Some(|lobe, judgement| {
        for roughness in [0.0, 0.0317, 0.3, 1.0] {
            let what = format!("{} of roughness {roughness}", lobe.name);
            for cosine in [0.02, 1e-3, 1e-6] {
                lobes::judge(
                    &what,
                    &(lobe.material)(roughness),
                    cosine,
                    (lobe.lossless)(roughness),
                    judgement,
                );
            }
        }
    }),
    ..HardCase::BASE
};

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let elevation = 0.1f64.to_radians();
    // Glass bounds a solid, which a floor does not.
    for lobe in LOBES.iter().filter(|lobe| lobe.name != "glass") {
        for roughness in [0.0, 0.0317, 1.0] {
            let scene = floor_in_furnace((lobe.material)(roughness), elevation, 0.01);
            let painted = easel.paint(&scene, SMALL, 64)?;
            let what = format!("{} of roughness {roughness}", lobe.name);
            judgement.mean_at_most(&what, &painted, 1.0 + TABLE_GAIN);
            if (lobe.lossless)(roughness) {
                judgement.mean(&what, &painted, [1.0; 3], TABLE_LOSS)?;
            }
        }
    }
    Ok(judgement)
}
