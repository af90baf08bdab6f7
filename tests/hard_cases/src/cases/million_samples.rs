//! A million samples of one value.

use clerestory::Result;
use clerestory::scene::{Material, Scene};
use glam::Vec3;

use crate::scenes::floor_from_above;
use crate::{Easel, HardCase, Judgement};

/// Not a dyadic fraction, so that a plain f32 sum would drift: 10⁶ equal f32 additions of 0.7 end 4 % off.
const VALUE: f32 = 0.7;
/// As many as a pass can have, of techniques with passes.
const SAMPLES_PER_PASS: u32 = 4096;

pub(super) const CASE: HardCase = HardCase {
    name: "million-samples",
    breaks: "A sum in f32 stalls: beyond 2²⁴ times a sample its additions are rounded away, and the picture stops changing or drifts.",
    expects: "The mean of 10⁶ equal samples is that sample to the bit, and its variance 0.",
    picture: || Ok(scene()),
    techniques: Some(judge),
    ..HardCase::BASE
};

fn scene() -> Scene {
    floor_from_above(Material {
        unlit: true,
        ..Material::lambert("flat", Vec3::splat(VALUE))
    })
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    // Nothing is scattered: bounces beyond the first are not even recorded.
    let easel = easel
        .with("path_set", "bounces=0..1")
        .with("samples_per_pass", SAMPLES_PER_PASS);
    // Fewer where passes have few.
    let share = SAMPLES_PER_PASS / easel.pass_samples()?.unwrap_or(SAMPLES_PER_PASS);
    for (size, samples) in [([1, 1], 1_000_000), ([2, 2], 20_000)] {
        let painted = easel.paint(&scene(), size, samples / share)?;
        judgement.exactly(&format!("{size:?}"), &painted, [VALUE; 3]);
        let variance = painted.variance.iter().copied().fold(0.0, f32::max);
        judgement.at_most(format!("{size:?}: variance"), f64::from(variance), 1e-12);
    }
    Ok(judgement)
}
