//! Bounds of a density grid over blocks of cells, for free-flight sampling with a local majorant.
//!
//! Source: Yue, Iwasaki, Chen, Dobashi and Nishita, "Unbiased, adaptive stochastic sampling for rendering inhomogeneous participating media"
//! (SIGGRAPH Asia 2010), with uniform blocks; Novák, Georgiev, Hanika and Jarosz, "Monte Carlo methods for volumetric light transport
//! simulation" (2018), 4.2.
//! Guarantees: bounds hold for interpolated densities up to half a cell outside a block, so that a walk that is off by less stays
//! unbiased. Interpolation in floating point may pass them by the rounding of its three mixes.

use glam::DVec3;

use super::DensityGrid;

/// Least and greatest density over blocks of cells. Block (i, j, k) covers the cells from `block`·(i, j, k) to below `block`·(i + 1, j + 1,
/// k + 1), that is the points p of the unit cube with ⌊p · `cells` / `block`⌋ = (i, j, k); the last ones along an axis may be cut short.
#[derive(Debug, Clone, PartialEq)]
pub struct MajorantGrid {
    /// Cells of the density grid along x, y and z.
    pub cells: [u32; 3],
    /// Cells along a block's side.
    pub block: u32,
    /// Blocks along x, y and z: `cells` / `block`, rounded up.
    pub size: [u32; 3],
    /// Least density in each block, x fastest and z slowest.
    pub minima: Vec<f32>,
    /// Greatest density in each block, in the same order.
    pub maxima: Vec<f32>,
}

impl MajorantGrid {
    /// Bounds of a grid over blocks of `block` cells per side (at least 1). Looks at each value once per axis.
    pub fn new(grid: &DensityGrid, block: u32) -> Self {
        let block = block.max(1);
        let (mut minima, mut maxima) = (grid.values.clone(), grid.values.clone());
        let mut stride = 1;
        for length in grid.size.map(|s| s as usize) {
            minima = fold_axis(&minima, length, stride, block, f32::min);
            maxima = fold_axis(&maxima, length, stride, block, f32::max);
            stride *= length.div_ceil(block as usize);
        }
        Self {
            cells: grid.size,
            block,
            size: grid.size.map(|s| s.div_ceil(block)),
            minima,
            maxima,
        }
    }

    /// Index of the block of a point in the unit cube, clamped to the outermost ones.
    pub fn block_of(&self, point: DVec3) -> usize {
        let axis = |i: usize| {
            let at = point[i] * f64::from(self.cells[i]) / f64::from(self.block);
            (at.max(0.0) as usize).min(self.size[i] as usize - 1)
        };
        (axis(2) * self.size[1] as usize + axis(1)) * self.size[0] as usize + axis(0)
    }
}

/// Folds one axis of an array into blocks; each takes in the cell before and the cell after it, which interpolation reaches.
fn fold_axis(values: &[f32], length: usize, stride: usize, block: u32, pick: fn(f32, f32) -> f32) -> Vec<f32> {
    let block = block as usize;
    let blocks = length.div_ceil(block);
    let mut folded = Vec::with_capacity(values.len() / length.max(1) * blocks);
    for slice in values.chunks_exact(length * stride) {
        for b in 0..blocks {
            let cells = (b * block).saturating_sub(1)..((b + 1) * block + 1).min(length);
            let first = cells.start;
            for lane in 0..stride {
                let start = slice[first * stride + lane];
                folded.push(
                    cells
                        .clone()
                        .fold(start, |found, cell| pick(found, slice[cell * stride + lane])),
                );
            }
        }
    }
    folded
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::builtin::noise::unit;

    fn rough_grid(size: [u32; 3]) -> DensityGrid {
        let mut item = 0;
        DensityGrid::from_fn(size, |_| {
            item += 1;
            unit(11, item, 0).powi(4) * 100.0
        })
    }

    #[test]
    fn random_points_never_leave_the_bounds() {
        for (size, block) in [
            ([13, 7, 22], 4),
            ([8, 8, 8], 8),
            ([5, 1, 3], 2),
            ([1, 1, 1], 16),
            ([6, 9, 4], 1),
        ] {
            let grid = rough_grid(size);
            let bounds = MajorantGrid::new(&grid, block);
            let blocks: usize = bounds.size.iter().map(|&s| s as usize).product();
            assert_eq!((bounds.minima.len(), bounds.maxima.len()), (blocks, blocks));
            for i in 0..20_000u32 {
                let point = DVec3::new(
                    f64::from(unit(1, i, 0)),
                    f64::from(unit(1, i, 1)),
                    f64::from(unit(1, i, 2)),
                );
                // Up to half a cell away, as a walk in f32 may be (all but the last bit, which would reach one cell farther).
                let off = |d| f64::from(unit(2, i, d) - 0.5) * 0.999_999;
                let shift = DVec3::new(off(0), off(1), off(2)) / DVec3::from_array(size.map(f64::from));
                let density = grid.density_in_cube((point + shift).clamp(DVec3::ZERO, DVec3::ONE));
                let block = bounds.block_of(point);
                let (low, high) = (f64::from(bounds.minima[block]), f64::from(bounds.maxima[block]));
                // Three mixes, each of two products and a sum.
                let rounding = 9.0 * f64::EPSILON * high;
                assert!(
                    low - rounding <= density && density <= high + rounding,
                    "{low} {density} {high}"
                );
            }
        }
    }

    #[test]
    fn bounds_are_no_wider_than_the_cells_that_interpolation_reaches() {
        let grid = rough_grid([13, 7, 22]);
        let bounds = MajorantGrid::new(&grid, 4);
        assert_eq!(bounds.size, [4, 2, 6]);
        for (index, (&low, &high)) in bounds.minima.iter().zip(&bounds.maxima).enumerate() {
            let at = [index % 4, index / 4 % 2, index / 8];
            let reach = |axis: usize| {
                let first = (at[axis] as u32 * 4).saturating_sub(1);
                first..(at[axis] as u32 * 4 + 5).min(grid.size[axis])
            };
            let (mut least, mut greatest) = (f64::INFINITY, 0.0f64);
            for z in reach(2) {
                for y in reach(1) {
                    for x in reach(0) {
                        least = least.min(grid.cell(x, y, z));
                        greatest = greatest.max(grid.cell(x, y, z));
                    }
                }
            }
            assert_eq!((f64::from(low), f64::from(high)), (least, greatest));
        }
    }
}
