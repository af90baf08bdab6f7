//! A room 10⁶ m from the origin.

use clerestory::Result;
use clerestory::scene::load;
use glam::{DAffine3, DVec3, Vec3};

use crate::rays::{RaySet, awkward_rays};
use crate::scenes::{SMALL, furnace, lattice, soup, transform};
use crate::{Easel, HardCase, Judgement};

/// Bias of a 2 m room 10⁶ m out: rays start up to 0.18 m off its walls.
const DOCUMENTED_BIAS: f64 = 0.02;
/// The same where photons start and land as far off walls, too.
const DOCUMENTED_BIAS_OF_MAPS: f64 = 0.04;
/// Samples of a pass, of techniques with a bias: four passes, whose noise is half of that of one, below what is documented.
const SAMPLES_PER_PASS: u32 = 16;

pub(super) const CASE: HardCase = HardCase {
    name: "far-from-origin",
    breaks: "Coordinates lose their digits: hits lie off their surface, offsets vanish in rounding, and rays leave closed rooms.",
    expects: "No leak at any distance; no error up to 10⁵ m. At 10⁶ m, where f32 coordinates are 1/16 m apart, a 2 m room errs by at most 2 %, and by \
              at most 4 % where pictures have a bias.",
    picture: || {
        let mut scene = load("builtin:cornell-box")?;
        transform(&mut scene, DAffine3::from_translation(DVec3::new(1e6, -1e6, 1e6)));
        Ok(scene)
    },
    documented: Some(
        "Geometry is stored in f32: 10⁶ m from the origin its coordinates are 1/16 m apart, and rays start that far off surfaces. \
         Move scene and camera so that what is seen lies within 10⁵ of its own sizes from the origin.",
    ),
    techniques: Some(judge),
    rays: Some(|| {
        let mut sets = Vec::new();
        for place in [Vec3::new(1e5, -1e5, 1e5), Vec3::splat(1e6)] {
            for (what, triangles) in [("soup", soup(3, 300, 0.2)), ("lattice", lattice())] {
                let triangles: Vec<_> = triangles.iter().map(|t| t.map(|v| v + place)).collect();
                sets.push(RaySet {
                    what: format!("{what} at {} m", place.z),
                    rays: awkward_rays(4, &triangles, 500),
                    triangles,
                });
            }
        }
        sets
    }),
    ..HardCase::BASE
};

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut easel = easel.calm();
    if easel.has_bias() {
        easel = easel.with("samples_per_pass", SAMPLES_PER_PASS);
    }
    let mut judgement = Judgement::default();
    for distance in [1e3, 1e5, 1e6] {
        let mut scene = furnace()?;
        let place = DVec3::new(distance, -distance, distance);
        transform(&mut scene, DAffine3::from_translation(place));
        let painted = easel.paint_in_passes(&scene, SMALL, 64)?;
        let what = format!("furnace at {distance:.0e} m");
        if distance < 1e6 {
            judgement.uniform(&what, &painted, [1.0; 3])?;
        } else {
            let documented = if easel.has_bias() {
                DOCUMENTED_BIAS_OF_MAPS
            } else {
                DOCUMENTED_BIAS
            };
            judgement.mean_documented(&what, &painted, [1.0; 3], [0.0, documented])?;
        }
    }
    Ok(judgement)
}
