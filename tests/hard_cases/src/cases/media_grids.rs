//! Grids of densities with one dense cell among empty ones, of a single cell, and from a tenth of a millimetre to ten kilometres.

use clerestory::Result;
use clerestory::scene::{DensityGrid, Environment, Material, Medium, Scene};
use glam::{DVec3, Vec3};

use super::media_albedo_one::AT_BOUNDARIES;
use crate::scenes::{SMALL, camera_down, cuboid, floor_from_above, lamp, orthographic};
use crate::{Easel, HardCase, Judgement};

pub(super) const CASE: HardCase = HardCase {
    name: "media-grids",
    breaks: "Marching leaps over a dense layer between empty ones; a walk by one majorant for the whole grid never ends in what is nearly empty; steps along a way of kilometres round to nothing.",
    expects: "A floor of radiance 1 seen down a column of cells has exp(−h · mean density · σ), however the density is spread over the cells and whatever their size, and a grid that only scatters cannot be seen in a uniform environment.",
    picture: || {
        let mut densities = layer(9);
        (densities[30], densities[50]) = (16.0, 4.0);
        let mut scene = column(&densities, 1.0, 0.0, 0.5);
        scene.media[0].sigma_a = Vec3::new(0.3, 0.6, 0.9);
        scene.environment = Some(Environment::uniform(Vec3::ONE));
        scene.cameras = vec![orthographic(DVec3::new(2.0, 1.1, 3.0), DVec3::Y * 0.4, DVec3::Y, 1.3)];
        Ok(scene)
    },
    documented_bias: Some(
        "Photons of the map lack beyond the boundary of a medium: what a ray sees within a kernel's radius of it is too dark where it is not met head-on. Kernels shrink from pass to pass; choose a smaller radius. \
         By default they are a quarter of the free path where a grid is densest, so narrow about a thin and dense layer that pictures of few photons have little but noise there: the layer in the furnace has a `volume_radius` of 2 mm and four passes.",
    ),
    of_media: true,
    techniques: Some(judge),
    ..HardCase::BASE
};

/// Cells of the columns.
const CELLS: usize = 64;
/// Density of the thin one among dense cells, and of the dense one among thin cells.
const FAINT: f32 = 1e-4;

/// Radius of kernels about photons in the layer, m: two fifths of a free path there, so that a thousand collisions and more are seen.
const RADIUS: f64 = 2e-3;
const PASSES: u32 = 4;
const SAMPLES: u32 = 64;

/// All density in one cell: its mean is 1.
fn layer(at: usize) -> Vec<f32> {
    let mut values = vec![0.0; CELLS];
    values[at] = CELLS as f32;
    values
}

/// A grid of one column of cells between floor and camera, in a box as high as it is wide, above a floor of radiance 1 (`glow`) or a black one.
fn column(densities: &[f32], height: f32, sigma_a: f32, glow: f32) -> Scene {
    let mut scene = floor_from_above(lamp(Vec3::splat(glow)));
    let size = [1, densities.len() as u32, 1];
    let corner = DVec3::new(f64::from(height), f64::from(height), f64::from(height));
    let (low, high) = (DVec3::new(-corner.x, 0.0, -corner.z), corner);
    scene.media.push(Medium {
        name: "column".into(),
        sigma_a: Vec3::splat(sigma_a),
        density: Some(
            DensityGrid {
                values: densities.to_vec(),
                ..DensityGrid::from_fn(size, |_| 0.0)
            }
            .in_box(low, high),
        ),
        ..Medium::default()
    });
    let boundary = scene.add_material(Material {
        interior: Some(0),
        boundary: true,
        ..Material::default()
    });
    // Floor and boundary stay apart: faces in one plane have no order.
    scene.place(cuboid("boundary", boundary, low.as_vec3(), high.as_vec3()));
    for position in &mut scene.meshes[0].positions {
        *position = Vec3::new(position.x * height, -0.1 * height, position.z * height);
    }
    scene.cameras = vec![camera_down(0.5 * height, 2.0 * f64::from(height))];
    scene
}

fn judge(easel: &Easel<'_>) -> Result<Judgement> {
    let mut judgement = Judgement::default();
    let mut seen = |what: &str, densities: &[f32], height: f32, depth: f64| {
        let mean = densities.iter().map(|d| f64::from(*d)).sum::<f64>() / densities.len() as f64;
        let sigma = depth / (mean * f64::from(height));
        let painted = easel.paint_in_passes(&column(densities, height, sigma as f32, 1.0), SMALL, 64)?;
        judgement.mean(what, &painted, [(-depth).exp(); 3], 0.0)
    };
    seen("one cell", &[1.0], 1.0, 1.0)?;
    for (height, word) in [(1e-4, "1e-4 m"), (1.0, "1 m"), (1e4, "1e4 m")] {
        seen(&format!("a dense cell in a column of {word}"), &layer(9), height, 1.0)?;
    }
    seen("a dense cell at the end", &layer(CELLS - 1), 1.0, 0.5)?;
    let mut faint = vec![FAINT; CELLS];
    faint[30] = 1.0 / FAINT;
    seen("densities of 1 to 10⁸", &faint, 1.0, 1.0)?;
    let empty = easel.paint(&column(&[0.0; CELLS], 1.0, 1e4, 1.0), SMALL, 16)?;
    judgement.exactly("cells without density", &empty, [1.0; 3]);

    let mut furnace = column(&layer(20), 1.0, 0.0, 1.0);
    furnace.media[0].sigma_s = Vec3::splat(3.0);
    furnace.environment = Some(Environment::uniform(Vec3::ONE));
    // As large as the boundary, so that half of the light comes to the layer, of which most is seen.
    for position in &mut furnace.meshes[0].positions {
        (position.x, position.z) = (position.x.clamp(-1.0, 1.0), position.z.clamp(-1.0, 1.0));
    }
    furnace.cameras = vec![camera_down(0.8, 2.0)];
    let of_photons = easel
        .with("volume_radius", RADIUS)
        .with("samples_per_pass", SAMPLES / PASSES);
    let easel = if easel.has("volume_radius") { &of_photons } else { easel };
    let painted = easel.paint_in_passes(&furnace, easel.size_in_media()?, SAMPLES)?;
    let documented = if easel.has_bias() { AT_BOUNDARIES } else { 0.0 };
    judgement.mean_documented("a scattering layer in a furnace", &painted, [1.0; 3], [0.0, documented])?;
    Ok(judgement)
}
