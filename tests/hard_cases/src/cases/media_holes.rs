//! Media with holes, and with something in a hole.

use clerestory::Result;
use clerestory::scene::{Environment, Material, Medium, Phase, Scene};
use glam::{DVec3, Vec3};

use crate::scenes::{SMALL, camera_down, cuboid, floor_from_above, lamp, medium, orthographic};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "media-holes",
    breaks: "A path that enters a body of nothing inside a medium forgets the medium that it comes back to; kernels of photons reach into the hole and over it.",
    expects: "A floor of radiance 1 seen through media one in the other has exp(−Σ σ h) of the parts that the ray is in, and a medium that only scatters cannot be seen in a uniform environment whatever holes it has.",
    picture: || {
        let mut scene = nested(&[
            medium(3.0, 0.5, Phase::Isotropic),
            Medium::default(),
            medium(20.0, 0.9, Phase::Isotropic),
        ]);
        scene.environment = Some(Environment::uniform(Vec3::new(0.3, 0.5, 0.8)));
        scene.cameras = vec![orthographic(DVec3::new(2.0, 1.6, 2.5), DVec3::Y * 0.6, DVec3::Y, 1.0)];
        Ok(scene)
    },
    documented_bias: Some(
        "Photons of the map lack beyond the boundary of a medium and of its holes: what a ray sees within a kernel's radius of it, a quarter of a mean free path, is too dark where it \
         is not met head-on. Kernels shrink from pass to pass; choose a smaller radius.",
    ),
    of_media: true,
    techniques: Some(judge),
    ..HardCase::BASE
};

/// What techniques with kernels may lack: a third of the shell about the hole is within a kernel's radius of its sides, and all of the island.
const AT_HOLES: f64 = 0.2;
/// Heights of boxes that lie one in the other about the same middle, m.
const HEIGHTS: [f32; 3] = [1.0, 0.5, 0.1];

/// A floor of radiance 1 under boxes of these media, one in the other.
fn nested(media: &[Medium]) -> Scene {
    let mut scene = floor_from_above(lamp(Vec3::ONE));
    for (index, (medium, height)) in media.iter().zip(HEIGHTS).enumerate() {
        scene.media.push(medium.clone());
        let boundary = scene.add_material(Material {
            name: format!("boundary {index}"),
            boundary: true,
            interior: Some(index as u32),
            ..Material::default()
        });
        let (middle, half) = (Vec3::Y * 0.6, Vec3::splat(0.5 * height));
        scene.place(cuboid("box", boundary, middle - half, middle + half));
    }
    // Within the least of them.
    scene.cameras = vec![camera_down(0.04, 2.0)];
    scene
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let absorbs = |sigma: f32| medium(sigma, 0.0, Phase::Isotropic);
    for (what, sigmas) in [
        ("a hole", &[2.0, 0.0][..]),
        ("an island in a hole", &[2.0, 0.0, 5.0][..]),
        ("a dense body in a thin one", &[0.1, 8.0][..]),
        ("nothing around a body", &[0.0, 1.0][..]),
    ] {
        let media: Vec<Medium> = sigmas.iter().map(|sigma| absorbs(*sigma)).collect();
        let painted = easel.paint_in_passes(&nested(&media), SMALL, 64)?;
        // Of each box what is not that of the next one.
        let inner = |i: usize| if i + 1 < sigmas.len() { HEIGHTS[i + 1] } else { 0.0 };
        let depth = sigmas
            .iter()
            .enumerate()
            .map(|(i, sigma)| f64::from(sigma * (HEIGHTS[i] - inner(i))));
        judgement.mean(what, &painted, [(-depth.sum::<f64>()).exp(); 3], 1e-4)?;
    }
    let scatters = medium(3.0, 1.0, Phase::Isotropic);
    let mut furnace = nested(&[scatters.clone(), Medium::default(), scatters]);
    furnace.environment = Some(Environment::uniform(Vec3::ONE));
    furnace.cameras = vec![camera_down(0.4, 2.0)];
    let painted = easel.paint_in_passes(&furnace, easel.size_in_media()?, 64)?;
    let documented = if easel.has_bias() { AT_HOLES } else { 0.0 };
    judgement.mean_documented("scatters in a furnace", &painted, [1.0; 3], [0.0, documented])?;
    Ok(judgement)
}
