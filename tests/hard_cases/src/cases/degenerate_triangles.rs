//! Triangles without area, and walls that are there twice.

use clerestory::Result;
use clerestory::scene::{Mesh, Scene, load};
use glam::{DVec3, Vec3};

use crate::rays::{RaySet, awkward_rays};
use crate::scenes::{SMALL, furnace, lattice};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "degenerate-triangles",
    breaks: "Triangles that are points or lines have no normal and no area to divide by; of duplicates each claims the hit, and a doubled lamp shines twice.",
    expects: "Degenerate triangles are left out and counted; of duplicates the first is met: a furnace whose walls are there twice keeps radiance 1.",
    picture: || {
        let mut scene = load("builtin:cornell-box")?;
        let doubled = scene.instances.clone();
        scene.instances.extend(doubled);
        Ok(scene)
    },
    techniques: Some(judge),
    rays: Some(|| {
        let mut grid = lattice();
        grid.extend_from_within(..24);
        grid.extend([
            [Vec3::ZERO; 3],
            [Vec3::ZERO, Vec3::X, Vec3::X * 0.5],
            [Vec3::ZERO, Vec3::X, Vec3::new(0.5, 1e-7, 0.0)],
        ]);
        let stack = vec![grid[0]; 300];
        [("degenerate and duplicate", grid), ("stack of 300", stack)]
            .map(|(what, triangles)| RaySet {
                what: what.into(),
                rays: awkward_rays(8, &triangles, 500),
                triangles,
            })
            .into()
    }),
    ..HardCase::BASE
};

/// A furnace with points, lines, repeated vertices, a sliver in the plane of a wall, and every wall a second time.
fn scene() -> Result<Scene> {
    let mut scene = furnace()?;
    scene.place(Mesh {
        name: "degenerate".into(),
        positions: vec![
            Vec3::ZERO,
            Vec3::X,
            Vec3::new(0.5, 0.0, 0.0),
            Vec3::new(1.0, 1e-7, 0.3),
            Vec3::new(1.0, 0.0, -0.3),
        ],
        triangles: vec![[0, 0, 0], [0, 1, 2], [1, 1, 0], [2, 2, 2], [1, 3, 4], [3, 1, 4]],
        material: Some(0),
        ..Mesh::default()
    });
    let walls = scene.meshes[0].clone();
    scene.place(walls);
    Ok(scene)
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let scene = scene()?;
    let painted = easel.calm().paint_in_passes(&scene, SMALL, 64)?;
    judgement.uniform("furnace", &painted, [1.0; 3])?;
    let wanted = scene.meshes.iter().map(unmeetable).sum::<u64>();
    let left_out = easel.upload(&scene)?.index_statistics().excluded_degenerate;
    judgement.holds(
        format!("{left_out} instead of {wanted} triangles left out"),
        left_out == wanted,
    );
    Ok(judgement)
}

fn unmeetable(mesh: &Mesh) -> u64 {
    let flat = |triangle: &&[u32; 3]| {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize].as_dvec3());
        (b - a).cross(c - a) == DVec3::ZERO
    };
    mesh.triangles.iter().filter(flat).count() as u64
}
