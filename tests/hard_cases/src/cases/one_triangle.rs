//! A scene of one triangle.

use clerestory::Result;
use clerestory::scene::{Mesh, Scene};
use glam::Vec3;

use crate::rays::{RaySet, awkward_rays};
use crate::scenes::{SMALL, camera_down, lamp};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "one-triangle",
    breaks: "A tree of one leaf has no inner node to start from, and the box of an axis-parallel triangle has no volume.",
    expects: "The triangle shines where it is, with its share of the picture (⅛), and exactly nothing beside it.",
    picture: || Ok(scene()),
    techniques: Some(judge),
    rays: Some(|| {
        let triangles = vec![[Vec3::ZERO, Vec3::X, Vec3::Y]];
        vec![RaySet {
            what: "one".into(),
            rays: awkward_rays(14, &triangles, 500),
            triangles,
        }]
    }),
    ..HardCase::BASE
};

/// A shining triangle of half a square metre in a picture of four.
fn scene() -> Scene {
    let mut scene = Scene {
        name: "one triangle".into(),
        ..Scene::default()
    };
    let material = scene.add_material(lamp(Vec3::new(1.0, 2.0, 3.0)));
    scene.place(Mesh {
        name: "triangle".into(),
        positions: vec![Vec3::ZERO, Vec3::NEG_Z, Vec3::X],
        triangles: vec![[0, 2, 1]],
        material: Some(material),
        ..Mesh::default()
    });
    scene.cameras.push(camera_down(1.0, 10.0));
    scene
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let painted = easel.paint_in_passes(&scene(), SMALL, 64)?;
    judgement.mean("share of the picture", &painted, [0.125, 0.25, 0.375], 0.0)?;
    // A 16 × 16 picture of [−1, 1]²: the triangle lies in the upper right quarter, below its diagonal.
    let outside = |i: usize| i % 16 < 8 || i / 16 >= 8;
    let pixels = painted.radiance.chunks(3).enumerate();
    let lit = pixels.filter(|(i, pixel)| outside(*i) && **pixel != [0.0; 3]).count();
    judgement.none("lit pixels beside it", lit);
    Ok(judgement)
}
