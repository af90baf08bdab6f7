//! Scenes of 10⁻⁴ m and of 10⁵ m.

use clerestory::Result;
use clerestory::scene::load;
use glam::{DAffine3, DVec3};

use crate::rays::{RaySet, awkward_rays};
use crate::scenes::{SMALL, furnace, lattice, soup, transform};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "scales",
    breaks: "Constants in metres, such as an offset of 10⁻⁴ m or a least distance of hits: small scenes vanish, in large ones surfaces shade themselves.",
    expects: "The same picture at any unit of length: a closed furnace keeps radiance 1 from 10⁻⁴ m to 10⁵ m, and a Cornell box scaled by a power of two gives the same bits.",
    picture: || {
        let mut scene = load("builtin:cornell-box")?;
        transform(&mut scene, DAffine3::from_scale(DVec3::splat(1e-4)));
        Ok(scene)
    },
    techniques: Some(judge),
    rays: Some(|| {
        let mut sets = Vec::new();
        for scale in [1e-4f32, 1e5] {
            for (what, triangles) in [("soup", soup(1, 300, 0.2)), ("lattice", lattice())] {
                let triangles: Vec<_> = triangles.iter().map(|t| t.map(|v| v * scale)).collect();
                sets.push(RaySet {
                    what: format!("{what} of {scale} m"),
                    rays: awkward_rays(2, &triangles, 500),
                    triangles,
                });
            }
        }
        sets
    }),
    ..HardCase::BASE
};

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    for scale in [1e-4, 1.0, 1e5] {
        let mut scene = furnace()?;
        transform(&mut scene, DAffine3::from_scale(DVec3::splat(scale)));
        let painted = easel.calm().paint_in_passes(&scene, SMALL, 64)?;
        judgement.uniform(&format!("furnace of {scale} m"), &painted, [1.0; 3])?;
    }
    let truth = easel.paint(&load("builtin:cornell-box")?, SMALL, 256)?;
    for scale in [2f64.powi(-13), 2f64.powi(17)] {
        let mut scene = load("builtin:cornell-box")?;
        transform(&mut scene, DAffine3::from_scale(DVec3::splat(scale)));
        let painted = easel.paint(&scene, SMALL, 256)?;
        judgement.same_bits(&format!("Cornell box of {scale:.1e} of its size"), &painted, &truth);
    }
    let truth = easel.paint_in_passes(&load("builtin:cornell-box")?, SMALL, 256)?;
    for scale in [1e-4, 1e5] {
        let mut scene = load("builtin:cornell-box")?;
        transform(&mut scene, DAffine3::from_scale(DVec3::splat(scale)));
        let painted = easel.other_seed().paint_in_passes(&scene, SMALL, 256)?;
        let what = format!("Cornell box of {scale} of its size");
        judgement.same_expectations(&what, &painted, &truth)?;
    }
    Ok(judgement)
}
