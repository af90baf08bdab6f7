//! Media records, densities and their majorants, as scene/media.glsl reads them.

use glam::{DMat3, DVec3, Vec3};

use crate::Result;
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::{PHASE_HENYEY_GREENSTEIN, PHASE_ISOTROPIC, PHASE_RAYLEIGH, PHASE_SCHLICK};
use crate::gpu::shaders::sets::MediaSet;
use crate::gpu::shaders::types::SceneMedium;
use crate::gpu::{Category, Gpu, TexelView};
use crate::scene::{MajorantGrid, Medium, Phase, Scene, mean_density};

/// Blocks along the longest side of a grid, about, and the least number of cells along a side of one.
const BLOCKS_PER_SIDE: u32 = 32;
const BLOCK_MIN: u32 = 4;
/// Tentative collisions on the way through a grid that emits, at least.
const EMISSION_DEPTH: f64 = 4.0;

/// The media of a scene in device memory.
#[derive(Debug)]
pub(super) struct GpuMedia {
    records: TexelView,
    densities: TexelView,
    majorants: TexelView,
    /// The medium outside all bodies.
    pub(super) surrounding: Option<u32>,
    /// Of media that scatter, at their densest: of the least and of the densest of them, 1/m.
    pub(super) extinctions: Option<[f64; 2]>,
}

impl GpuMedia {
    pub(super) fn new(gpu: &Gpu, scene: &Scene) -> Result<Self> {
        let (mut densities, mut majorants) = (Vec::new(), Vec::new());
        let media = scene.media.iter();
        let records: Vec<_> = media
            .map(|medium| record(medium, &mut densities, &mut majorants))
            .collect();
        let texels =
            |name: &str, values: &[f32]| gpu.texels_with(name, Category::Material, vk::Format::R32_SFLOAT, values);
        let format = vk::Format::R32G32B32A32_UINT;
        let bytes: &[u8] = bytemuck::cast_slice(&records);
        let greatest = |medium: &Medium| {
            let density = medium.density.as_ref().map_or(1.0, |grid| grid.max());
            f64::from(medium.sigma_t().max_element()) * f64::from(density)
        };
        let scattering = scene.media.iter().filter(|medium| medium.sigma_s != Vec3::ZERO);
        let extinctions = scattering.map(greatest).filter(|extinction| *extinction > 0.0);
        Ok(Self {
            extinctions: extinctions.fold(None, |range, extinction| {
                let [least, most] = range.unwrap_or([extinction; 2]);
                Some([least.min(extinction), most.max(extinction)])
            }),
            records: gpu.texels_with("media", Category::Material, format, bytes)?,
            densities: texels("densities", &densities)?,
            majorants: texels("majorants", &majorants)?,
            surrounding: scene
                .surrounding
                .filter(|&index| !scene.media[index as usize].is_empty()),
        })
    }

    pub(super) fn set(&self) -> MediaSet<'_> {
        MediaSet {
            media_records: &self.records,
            media_densities: &self.densities,
            media_majorants: &self.majorants,
        }
    }
}

fn record(medium: &Medium, densities: &mut Vec<f32>, majorants: &mut Vec<f32>) -> SceneMedium {
    let (phase, phase_parameter) = match medium.phase {
        Phase::Isotropic => (PHASE_ISOTROPIC, 0.0),
        Phase::HenyeyGreenstein { g } => (PHASE_HENYEY_GREENSTEIN, g),
        Phase::Schlick { k } => (PHASE_SCHLICK, k),
        Phase::Rayleigh => (PHASE_RAYLEIGH, 0.0),
    };
    let mut record = SceneMedium {
        sigma_s: medium.sigma_s.to_array(),
        phase,
        sigma_t: medium.sigma_t().to_array(),
        phase_parameter,
        emission: medium.emission.to_array(),
        majorant: medium.sigma_t().max_element(),
        ..SceneMedium::default()
    };
    let Some(grid) = medium.density.as_ref().filter(|_| !medium.is_empty()) else {
        return record;
    };
    let cells = DVec3::from_array(grid.size.map(f64::from));
    let to_cube = grid.to_world.inverse();
    let rows = DMat3::from_diagonal(cells) * to_cube.matrix3;
    let row = |i| rows.row(i).as_vec3().to_array();
    let block = (grid.size.into_iter().max().unwrap_or(1) / BLOCKS_PER_SIDE).max(BLOCK_MIN);
    let bounds = MajorantGrid::new(grid, block);
    if medium.emission != Vec3::ZERO {
        let diagonal = grid.to_world.transform_vector3(DVec3::ONE).length();
        let least = EMISSION_DEPTH / (diagonal * f64::from(grid.max()));
        record.majorant = record.majorant.max(least as f32);
    }
    record.row_x = row(0);
    record.row_y = row(1);
    record.row_z = row(2);
    record.offset = (cells * to_cube.translation).as_vec3().to_array();
    record.has_grid = 1;
    record.first_density = densities.len() as u32;
    record.first_majorant = majorants.len() as u32;
    record.block = block as f32;
    record.cells = grid.size;
    record.blocks = bounds.size;
    record.density_max = grid.max();
    record.tightness = tightness(&grid.values, &bounds.maxima);
    densities.extend_from_slice(&grid.values);
    majorants.extend_from_slice(&bounds.maxima);
    record
}

/// How well bounds follow what they bound: the mean of `values` over that of `maxima`; 0 where all are.
fn tightness(values: &[f32], maxima: &[f32]) -> f32 {
    match mean_density(maxima) {
        bound if bound > 0.0 => (mean_density(values) / bound).min(1.0) as f32,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_as_tight_as_their_means_say() {
        assert_eq!(tightness(&[2.0; 4], &[2.0]), 1.0);
        assert_eq!(tightness(&[0.0, 1.0, 0.0, 3.0], &[1.0, 3.0]), 0.5);
        assert_eq!(tightness(&[0.0; 4], &[0.0]), 0.0);
        // Blocks that are cut short may count for more than their cells.
        assert_eq!(tightness(&[1.0, 1.0, 0.0], &[1.0, 0.0]), 1.0);
    }
}
