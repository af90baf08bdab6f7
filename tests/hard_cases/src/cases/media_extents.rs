//! Media as thin as 10⁻⁴ m⁻¹ over kilometres and as dense as 10⁴ m⁻¹ over a tenth of a millimetre.

use clerestory::Result;
use clerestory::scene::{Medium, Scene};
use glam::Vec3;

use crate::scenes::{SMALL, camera_down, floor_from_above, lamp};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "media-extents",
    breaks: "Free flights step by constants in metres, exp(−σ t) underflows, and the logarithm of 0 is infinite where nothing is left.",
    expects: "A floor of radiance 1 seen through t metres of an absorbing medium has exp(−σ t), for σ from 0 to 10⁴ m⁻¹ and t from 10⁻⁴ to 10⁴ m; through 10⁴ optical depths exactly 0.",
    picture: || Ok(scene(1.0, 0.7)),
    of_media: true,
    techniques: Some(judge),
    ..HardCase::BASE
};

/// A floor of radiance 1 under a medium that absorbs, seen from `height`.
fn scene(height: f64, sigma: f32) -> Scene {
    let mut scene = floor_from_above(lamp(Vec3::ONE));
    scene.media.push(Medium {
        name: "fog".into(),
        sigma_a: Vec3::splat(sigma),
        ..Medium::default()
    });
    scene.surrounding = Some(0);
    scene.cameras = vec![camera_down(1.0, height)];
    scene
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    for (height, sigma) in [(1e4, 1e-4f32), (1.0, 1.0), (1e-4, 1e4), (1e-4, 1e-4), (10.0, 0.3)] {
        let painted = easel.paint_in_passes(&scene(height, sigma), SMALL, 64)?;
        let expected = (-f64::from(sigma) * height).exp();
        judgement.mean(
            &format!("{sigma:e} per metre over {height:e} m"),
            &painted,
            [expected; 3],
            1e-4,
        )?;
    }
    judgement.exactly("no density", &easel.paint(&scene(1.0, 0.0), SMALL, 16)?, [1.0; 3]);
    judgement.exactly(
        "10⁴ optical depths",
        &easel.paint(&scene(1.0, 1e4), SMALL, 16)?,
        [0.0; 3],
    );
    Ok(judgement)
}
