//! A scene without anything in it.

use clerestory::Result;
use clerestory::scene::{Environment, Scene};
use glam::Vec3;

use crate::rays::{RaySet, awkward_rays};
use crate::scenes::{SMALL, camera_down};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "empty-scene",
    breaks: "Buffers of zero bytes cannot be made, an index without triangles has no root, and the box around nothing is inside out.",
    expects: "Exactly black, or exactly the environment.",
    picture: || Ok(empty(Some(Environment::uniform(RADIANCE)))),
    techniques: Some(judge),
    rays: Some(|| {
        vec![RaySet {
            what: "no triangles".into(),
            triangles: Vec::new(),
            rays: awkward_rays(13, &[], 50),
        }]
    }),
    ..HardCase::BASE
};

const RADIANCE: Vec3 = Vec3::new(0.25, 0.5, 4.0);

fn empty(environment: Option<Environment>) -> Scene {
    Scene {
        name: "empty".into(),
        environment,
        cameras: vec![camera_down(1.0, 10.0)],
        ..Scene::default()
    }
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    judgement.exactly("nothing", &easel.paint(&empty(None), SMALL, 4)?, [0.0; 3]);
    let sky = empty(Some(Environment::uniform(RADIANCE)));
    judgement.exactly("environment", &easel.paint(&sky, SMALL, 4)?, RADIANCE.to_array());
    Ok(judgement)
}
