//! Phase functions with mean cosines near ±1.

use clerestory::Result;
use clerestory::scene::Phase;

use super::media_albedo_one::ball;
use crate::scenes::SMALL;
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "media-narrow-phase",
    breaks: "(1 + g² − 2g cos θ)^(3/2) cancels to 0 in f32 where g nears ±1: directions are NaN or longer than 1.",
    expects: "A ball that only scatters, with |g| = 0.99 and optical radius 10, cannot be seen in a uniform environment of radiance 1.",
    picture: || ball(10.0, Phase::HenyeyGreenstein { g: 0.99 }),
    techniques: Some(judge),
    ..HardCase::BASE
};

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    for g in [0.99, -0.99] {
        for (what, phase) in [
            ("Henyey–Greenstein", Phase::HenyeyGreenstein { g }),
            ("Schlick", Phase::Schlick { k: g }),
        ] {
            let painted = easel.paint_in_passes(&ball(10.0, phase)?, SMALL, 32)?;
            judgement.mean(&format!("{what} {g}"), &painted, [1.0; 3], 0.0)?;
        }
    }
    Ok(judgement)
}
