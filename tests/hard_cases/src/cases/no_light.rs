//! Scenes in which nothing shines.

use clerestory::Result;
use clerestory::scene::{Material, Scene, load};
use glam::Vec3;

use crate::scenes::{SMALL, furnace, point_triangle};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "no-light",
    breaks: "A light is drawn from an empty list; its table has no entry and its total power is zero.",
    expects: "Exactly black, without a shadow ray.",
    picture: || {
        let mut scene = load("builtin:cornell-box")?;
        scene
            .materials
            .iter_mut()
            .for_each(|material| material.emission = Vec3::ZERO);
        Ok(scene)
    },
    techniques: Some(judge),
    ..HardCase::BASE
};

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let mut dark = furnace()?;
    dark.materials[0].emission = Vec3::ZERO;
    let mut points = Scene {
        cameras: dark.cameras.clone(),
        ..Scene::default()
    };
    point_triangle(&mut points, Material::default(), Vec3::ONE);
    for (what, scene) in [("dark room", &dark), ("triangles without area", &points)] {
        let painted = easel.paint(scene, SMALL, 4)?;
        judgement.exactly(what, &painted, [0.0; 3]);
        let shadow_rays = painted.counters.get("shadow_rays").copied().unwrap_or(0);
        judgement.none(format!("{what}: shadow rays"), shadow_rays as usize);
    }
    Ok(judgement)
}
