//! Roughness 0, just enough not to be a mirror, and 1.

use clerestory::Result;
use clerestory::scene::load;

use crate::lobes::{self, LOBES, TABLE_GAIN};
use crate::scenes::{SMALL, white_furnace};
use crate::{Easel, HardCase, Judgement};

/// Perceptual roughness of mirrors, of the narrowest lobes that are not mirrors (α = 0.001), and of the widest.
const ROUGHNESS: [f32; 3] = [0.0, 0.0317, 1.0];

pub(super) const CASE: HardCase = HardCase {
    name: "extreme-roughness",
    breaks: "At roughness 0 the distribution of normals is 0/0, just above it f32 overflows, and at 1 single scattering loses half of the light.",
    expects: "Every lobe is finite and gives back at most what it got; white lambertian, coated and metal bodies, and clear glass, give back all of it within the albedo table's error (gain 0.5 %, loss 0.9 %).",
    picture: || load("builtin:materials"),
    techniques: Some(judge),
    lobes: Some(|lobe, judgement| {
        for roughness in ROUGHNESS {
            let what = format!("{} of roughness {roughness}", lobe.name);
            for cosine in [1.0, 0.5, 0.1] {
                lobes::judge(
                    &what,
                    &(lobe.material)(roughness),
                    cosine,
                    lobe.loss(roughness),
                    judgement,
                );
            }
        }
    }),
    ..HardCase::BASE
};

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    for lobe in LOBES {
        for roughness in ROUGHNESS {
            let mut scene = white_furnace((lobe.material)(roughness))?;
            // Flat: interpolated normals send some directions below the surface, where they are lost.
            scene.meshes[0].normals.clear();
            let painted = easel.calm().paint_in_passes(&scene, SMALL, 32)?;
            let what = format!("{} of roughness {roughness}", lobe.name);
            judgement.mean_at_most(&what, &painted, 1.0 + TABLE_GAIN);
            if let Some(loss) = lobe.loss(roughness) {
                judgement.mean(&what, &painted, [1.0; 3], loss)?;
            }
        }
    }
    Ok(judgement)
}
