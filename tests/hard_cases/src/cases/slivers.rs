//! Triangles a million times as long as wide.

use clerestory::Result;
use clerestory::scene::{Material, Mesh, Scene};
use glam::Vec3;

use crate::rays::{RaySet, awkward_rays};
use crate::scenes::{SMALL, floor_from_above, furnace, lamp, soup};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "slivers",
    breaks: "Normals and weights of hits divide by almost nothing; rays slip through between slivers, or meet them where they are not.",
    expects: "A floor of slivers 10⁻⁶ m wide hides what is below it without a hole, and a furnace with a fan of slivers across it keeps its radiance.",
    picture: || Ok(comb(lamp(Vec3::new(1.0, 0.5, 0.2)), 1e-3)),
    techniques: Some(judge),
    rays: Some(|| {
        let triangles: Vec<_> = (soup(5, 400, 0.5).into_iter())
            .map(|[a, b, c]| [a, b, a + (b - a) * 0.37 + (c - a) * 1e-6])
            .collect();
        vec![RaySet {
            what: "slivers".into(),
            rays: awkward_rays(6, &triangles, 800),
            triangles,
        }]
    }),
    ..HardCase::BASE
};

/// A floor whose middle is a strip of slivers that begin `width` apart, above a red light that must not be seen.
fn comb(material: Material, width: f32) -> Scene {
    const TEETH: u32 = 64;
    let mut scene = floor_from_above(material);
    let mut positions = vec![Vec3::new(-4.0, 0.0, 4.0), Vec3::new(-4.0, 0.0, -4.0)];
    let mut triangles = Vec::new();
    // From a wide first quadrilateral over slivers to a wide last one, with shared vertices: no T-junctions.
    for i in 0..=TEETH {
        let x = (i as f32 - TEETH as f32 / 2.0) * width;
        positions.extend([Vec3::new(x, 0.0, 4.0), Vec3::new(x, 0.0, -4.0)]);
    }
    positions.extend([Vec3::new(4.0, 0.0, 4.0), Vec3::new(4.0, 0.0, -4.0)]);
    for i in 0..positions.len() as u32 / 2 - 1 {
        let [a, b, c, d] = [2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1];
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    scene.meshes[0] = Mesh {
        positions,
        triangles,
        ..scene.meshes[0].clone()
    };
    let red = scene.add_material(lamp(Vec3::new(100.0, 0.0, 0.0)));
    scene.place(crate::scenes::floor("below", red, 40.0, -1.0));
    scene
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let mut scene = comb(lamp(Vec3::ONE), 1e-6);
    // The picture is no wider than the slivers are long: a pixel sees some of them in each of its samples.
    for half_height in [1.0, 3e-5] {
        scene.cameras = vec![crate::scenes::camera_down(half_height, 10.0)];
        let painted = easel.paint(&scene, SMALL, 64)?;
        judgement.exactly(&format!("slivers within {half_height} m"), &painted, [1.0; 3]);
    }
    let mut room = furnace()?;
    room.place(Mesh {
        name: "fan".into(),
        positions: (0..=32)
            .map(|i| Vec3::new(0.9, -0.9 + i as f32 * 1e-6, 0.9))
            .chain([Vec3::splat(-0.9)])
            .collect(),
        triangles: (0..32).map(|i| [i, i + 1, 33]).collect(),
        material: Some(0),
        ..Mesh::default()
    });
    let painted = easel.calm().paint_in_passes(&room, SMALL, 64)?;
    judgement.uniform("furnace with slivers", &painted, [1.0; 3])?;
    Ok(judgement)
}
