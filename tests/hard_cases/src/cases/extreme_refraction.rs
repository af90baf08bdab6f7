//! Indices of refraction 1, 100 and ∞, and bodies as black as ink.

use clerestory::Result;
use clerestory::scene::{Material, load};
use glam::Vec3;

use crate::lobes::{self, TABLE_GAIN};
use crate::scenes::{SMALL, white_furnace};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "extreme-refraction",
    breaks: "At index 1 the half vector of refraction is undefined, at 100 the critical angle is 0.6°, and the logarithm of a black attenuation colour is −∞.",
    expects: "Finite, and no brighter than the furnace around it; glass of index 1 and roughness 0 is not there at all.",
    picture: || {
        let mut scene = load("builtin:cornell-box?sphere=glass")?;
        for material in scene
            .materials
            .iter_mut()
            .filter(|material| material.transmission > 0.0)
        {
            material.ior = 100.0;
        }
        Ok(scene)
    },
    techniques: Some(judge),
    lobes: Some(|lobe, judgement| {
        let white = (lobe.material)(0.3);
        for ior in [0.0, 1.0, 1.0 + 1e-6, 100.0] {
            let material = Material { ior, ..white.clone() };
            let what = format!("{} of index {ior}", lobe.name);
            for cosine in [1.0, 0.3, -0.3]
                .into_iter()
                .filter(|cosine| *cosine > 0.0 || lobe.name == "glass")
            {
                lobes::judge(&what, &material, cosine, None, judgement);
            }
        }
    }),
    ..HardCase::BASE
};

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let glass = |name: &str, ior: f32, roughness: f32| Material {
        roughness,
        ..Material::glass(name, ior)
    };
    let infinite = Material {
        metallic: 0.0,
        ior: 0.0,
        roughness: 0.3,
        ..Material::default()
    };
    let ink = Material {
        attenuation_color: Vec3::new(0.0, 1e-30, 1.0),
        attenuation_distance: 1e-6,
        ..Material::glass("ink", 1.5)
    };
    for (what, material) in [
        ("infinite index", infinite),
        ("rough, index 1", glass("air", 1.0, 0.3)),
        ("rough, index 100", glass("dense", 100.0, 0.1)),
        ("ink", ink),
    ] {
        let painted = easel.calm().paint_in_passes(&white_furnace(material)?, SMALL, 64)?;
        judgement.mean_at_most(what, &painted, 1.0 + TABLE_GAIN);
    }
    let painted = easel.paint(&white_furnace(glass("air", 1.0, 0.0))?, SMALL, 16)?;
    judgement.exactly_rounded("smooth, index 1", &painted, [1.0; 3], 1.0);
    Ok(judgement)
}
