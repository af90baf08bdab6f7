//! Materials that give nothing back, and materials that give all back.

use clerestory::Result;
use clerestory::scene::{Material, load};
use glam::{Vec3, Vec4};

use crate::lobes::{self, TABLE_LOSS};
use crate::scenes::{SMALL, floor_in_furnace};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "black-and-white",
    breaks: "Choosing among lobes of weight zero is 0/0; in a white room roulette by throughput never ends a path, and its kernel hangs.",
    expects: "Black is exactly 0, white in a white furnace is 1, and a closed room of albedo 1 with a light, whose radiance has no finite value, ends and gives finite values.",
    picture: || {
        let mut scene = load("builtin:cornell-box")?;
        for (i, material) in scene
            .materials
            .iter_mut()
            .enumerate()
            .filter(|(_, m)| m.emission == Vec3::ZERO)
        {
            material.base_color = if i % 2 == 0 { Vec4::ONE } else { Vec3::ZERO.extend(1.0) };
        }
        Ok(scene)
    },
    techniques: Some(judge),
    lobes: Some(|lobe, judgement| {
        for (what, color) in [("white", Vec3::ONE), ("black", Vec3::ZERO)] {
            let material = Material {
                base_color: color.extend(1.0),
                ..(lobe.material)(0.5)
            };
            let loss = if color == Vec3::ONE { lobe.loss(0.5) } else { None };
            lobes::judge(&format!("{what} {}", lobe.name), &material, 0.7, loss, judgement);
        }
    }),
    ..HardCase::BASE
};

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let quarter = std::f64::consts::FRAC_PI_4;
    let black = floor_in_furnace(Material::lambert("black", Vec3::ZERO), quarter, 1.0);
    judgement.exactly("black floor", &easel.paint(&black, SMALL, 16)?, [0.0; 3]);
    let metal = Material {
        base_color: Vec4::W,
        roughness: 0.5,
        specular_color: Vec3::ZERO,
        ..Material::default()
    };
    let painted = easel.paint_in_passes(&floor_in_furnace(metal, quarter, 1.0), SMALL, 16)?;
    judgement.mean_at_most("black metal", &painted, 1.0);
    for (what, material) in [
        ("white floor", Material::lambert("white", Vec3::ONE)),
        ("white metal", Material::default()),
    ] {
        let painted = easel.paint_in_passes(&floor_in_furnace(material, quarter, 1.0), SMALL, 64)?;
        judgement.mean(what, &painted, [1.0; 3], TABLE_LOSS)?;
    }
    let closed = load("builtin:furnace-box?rho=1&emission=0.01")?;
    judgement.sound("closed white room", &easel.paint(&closed, SMALL, 16)?);
    Ok(judgement)
}
