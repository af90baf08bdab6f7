//! Rays that start on surfaces, edges and corners.

use clerestory::Result;
use clerestory::accel::Ray;
use clerestory::scene::Camera;
use glam::DVec3;

use crate::random::Random;
use crate::rays::RaySet;
use crate::scenes::{furnace, soup};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "rays-from-surfaces",
    breaks: "A camera in a wall, on an edge or in a corner starts its rays at distance zero of several triangles: hits behind the origin, divisions by zero, endless loops between walls.",
    expects: "Pictures from inside walls, edges and corners are finite, complete and no brighter than the room.",
    picture: || {
        let mut scene = clerestory::scene::load("builtin:cornell-box")?;
        scene.cameras[0] = Camera::look_at(
            "corner",
            DVec3::new(0.0, 0.0, 0.5592),
            DVec3::new(-0.2, 0.2, 0.2),
            DVec3::Y,
            1.2,
        );
        Ok(scene)
    },
    techniques: Some(judge),
    rays: Some(|| {
        let triangles = soup(10, 200, 0.5);
        let mut random = Random(11);
        let mut rays = Vec::new();
        for _ in 0..200 {
            let [a, b, c] = random.choose(&triangles);
            let other = random.choose(&triangles)[0];
            for from in [a, (a + b) * 0.5, (a + b + c) / 3.0] {
                rays.push(Ray::new(from, random.direction()));
                rays.push(Ray::new(from, other - from));
                rays.push(Ray::new(from, b - a));
            }
        }
        vec![RaySet {
            what: "starting on triangles".into(),
            triangles,
            rays,
        }]
    }),
    ..HardCase::BASE
};

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let scene = furnace()?;
    let mut technique = easel.prepare(&scene, [8, 8])?;
    let target = DVec3::new(0.1, 0.2, -0.3);
    let places = [
        ("corner", DVec3::ONE, target),
        ("wall", DVec3::X, target),
        ("edge", DVec3::new(1.0, 1.0, 0.2), target),
        ("outside", DVec3::splat(50.0), target),
        ("other corner", DVec3::NEG_ONE, target),
        // Along an axis, in the plane of two walls.
        ("along an edge", DVec3::ONE, DVec3::new(1.0, 1.0, -1.0)),
    ];
    for (what, eye, target) in places {
        technique.set_camera(&Camera::look_at(what, eye, target, DVec3::Y, 1.0))?;
        let painted = easel.finish(technique.as_mut(), 16)?;
        judgement.mean_at_most(what, &painted, 1.0);
    }
    Ok(judgement)
}
