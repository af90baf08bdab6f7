//! Phase functions with mean cosines near ±1.

use clerestory::Result;
use clerestory::scene::Phase;

use super::media_albedo_one::ball;
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "media-narrow-phase",
    breaks: "(1 + g² − 2g cos θ)^(3/2) cancels to 0 in f32 where g nears ±1: directions are NaN or longer than 1.",
    expects: "A ball that only scatters, with |g| = 0.99 and optical radius 10, cannot be seen in a uniform environment of radiance 1.",
    picture: || ball(10.0, Phase::HenyeyGreenstein { g: 0.99 }),
    documented_bias: Some(
        "Photons of the map lack beyond the boundary of a medium: what a ray sees within a kernel's radius of it, a quarter of a mean free path, is too dark where it is not met \
         head-on. Kernels shrink from pass to pass; choose a smaller radius. Beams and planes have most of their light by the few photons that fly nearly along a ray: pictures of \
         few passes are too dark; take more of them, or let eye paths share the light of planes (setting `volume_paths`).",
    ),
    documented_walks: Some(
        "Most of the light comes by the few virtual lights whose walks came nearly along the way to the place they light: pictures of few passes are too dark; take more of them.",
    ),
    of_media: true,
    techniques: Some(judge),
    ..HardCase::BASE
};

/// What pictures of few passes may lack where few of the connections have nearly all light.
const LACKING: f64 = 0.4;

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    for g in [0.99, -0.99] {
        for (what, phase) in [
            ("Henyey–Greenstein", Phase::HenyeyGreenstein { g }),
            ("Schlick", Phase::Schlick { k: g }),
        ] {
            let painted = easel.paint_in_passes(&ball(10.0, phase)?, easel.size_in_media()?, 32)?;
            let documented = if easel.has_bias() || easel.shares_noise()? {
                LACKING
            } else {
                0.0
            };
            judgement.mean_documented(&format!("{what} {g}"), &painted, [1.0; 3], [0.0, documented])?;
        }
    }
    Ok(judgement)
}
