//! Grids of densities and the look-up in them.
//!
//! The convention is that of textures and of Mitsuba's `gridvolume` with its filter `trilinear` and wrap mode `clamp`: cell (i, j, k) of a grid
//! of n cells per side has its value at ((i, j, k) + ½) / n of the unit cube. Mitsuba's grid goes on outside the cube with its outermost
//! values, but its media end there, as ours do.

use glam::{DAffine3, DVec3};

/// Densities at the centres of a grid's cells, interpolated linearly between them, constant from the outermost centres to the faces
/// of the grid, and zero outside it.
#[derive(Debug, Clone, PartialEq)]
pub struct DensityGrid {
    /// Cells along x, y and z; each at least 1.
    pub size: [u32; 3],
    /// Densities, finite and not negative, x fastest and z slowest.
    pub values: Vec<f32>,
    /// The unit cube, which the grid fills, to world space.
    pub to_world: DAffine3,
}

impl DensityGrid {
    /// A grid whose cells hold a function of their centres in the unit cube, placed at the unit cube.
    pub fn from_fn(size: [u32; 3], mut density: impl FnMut(DVec3) -> f32) -> Self {
        let n = size.map(f64::from);
        let mut values = Vec::with_capacity(size.iter().map(|&s| s as usize).product());
        for z in 0..size[2] {
            for y in 0..size[1] {
                for x in 0..size[0] {
                    values.push(density(DVec3::new(
                        (f64::from(x) + 0.5) / n[0],
                        (f64::from(y) + 0.5) / n[1],
                        (f64::from(z) + 0.5) / n[2],
                    )));
                }
            }
        }
        Self {
            size,
            values,
            to_world: DAffine3::IDENTITY,
        }
    }

    /// The same grid in the axis-parallel box between two corners, metres.
    pub fn in_box(mut self, low: DVec3, high: DVec3) -> Self {
        self.to_world = DAffine3::from_translation(low) * DAffine3::from_scale(high - low);
        self
    }

    /// Greatest density of a cell, and so of any point.
    pub fn max(&self) -> f32 {
        self.values.iter().copied().fold(0.0, f32::max)
    }

    /// Mean density of the cells; 0 of none.
    pub fn mean(&self) -> f64 {
        mean_density(&self.values)
    }

    /// Density at a point of world space.
    ///
    /// Inverts [`DensityGrid::to_world`] for each call; for many points, invert it once and use [`DensityGrid::density_in_cube`].
    pub fn density(&self, world: DVec3) -> f64 {
        self.density_in_cube(self.to_world.inverse().transform_point3(world))
    }

    /// Density at a point of the grid's unit cube, whose faces belong to it; zero outside.
    ///
    /// Source: trilinear interpolation as in Pharr, Jakob and Humphreys, "Physically Based Rendering", 3rd edition, 11.3.3.
    pub fn density_in_cube(&self, point: DVec3) -> f64 {
        // Also false for NaN.
        let inside = point.cmpge(DVec3::ZERO).all() && point.cmple(DVec3::ONE).all();
        if !inside {
            return 0.0;
        }
        let axis = |i: usize| {
            let last = f64::from(self.size[i]) - 1.0;
            let at = (point[i] * f64::from(self.size[i]) - 0.5).clamp(0.0, last);
            let below = at.floor();
            let above = (below + 1.0).min(last);
            (below as u32, above as u32, at - below)
        };
        let (x, y, z) = (axis(0), axis(1), axis(2));
        let mix = |a: f64, b: f64, t: f64| a * (1.0 - t) + b * t;
        let row = |j, k| mix(self.cell(x.0, j, k), self.cell(x.1, j, k), x.2);
        let plane = |k| mix(row(y.0, k), row(y.1, k), y.2);
        mix(plane(z.0), plane(z.1), z.2)
    }

    /// Density of a cell; zero for one that is not there.
    pub fn cell(&self, x: u32, y: u32, z: u32) -> f64 {
        let [nx, ny, _] = self.size.map(|s| s as usize);
        let index = (z as usize * ny + y as usize) * nx + x as usize;
        f64::from(self.values.get(index).copied().unwrap_or(0.0))
    }
}

/// Mean of densities; 0 of none.
pub(crate) fn mean_density(densities: &[f32]) -> f64 {
    densities.iter().map(|v| f64::from(*v)).sum::<f64>() / densities.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_met_at_cell_centres_and_held_to_the_faces() {
        let grid = DensityGrid::from_fn([4, 2, 3], |p| (p.x + 10.0 * p.y + 100.0 * p.z) as f32);
        for z in 0..3 {
            for y in 0..2 {
                for x in 0..4 {
                    let centre = DVec3::new(
                        (f64::from(x) + 0.5) / 4.0,
                        (f64::from(y) + 0.5) / 2.0,
                        (f64::from(z) + 0.5) / 3.0,
                    );
                    let (met, cell) = (grid.density_in_cube(centre), grid.cell(x, y, z));
                    // The place of the centre is rounded, and steps between cells are up to 33 high.
                    assert!((met - cell).abs() < 1e-13 * cell, "{met} {cell}");
                }
            }
        }
        assert_eq!(grid.density_in_cube(DVec3::ZERO), grid.cell(0, 0, 0));
        assert_eq!(grid.density_in_cube(DVec3::ONE), grid.cell(3, 1, 2));
        assert_eq!(grid.density_in_cube(DVec3::new(0.05, 0.2, 0.1)), grid.cell(0, 0, 0));
        let middle = (grid.cell(1, 0, 0) + grid.cell(2, 0, 0)) / 2.0;
        assert!((grid.density_in_cube(DVec3::new(0.5, 0.0, 0.0)) - middle).abs() < 1e-14);
        for outside in [-1e-12, 1.0 + 1e-12, f64::NAN, f64::INFINITY] {
            assert_eq!(grid.density_in_cube(DVec3::new(0.5, outside, 0.5)), 0.0);
        }
    }

    #[test]
    fn linear_functions_are_kept_between_the_outermost_centres() {
        let grid = DensityGrid::from_fn([8, 8, 8], |p| (1.0 + p.x + 2.0 * p.y + 3.0 * p.z) as f32);
        for i in 0..1000u32 {
            let unit = |d| f64::from(crate::scene::builtin::noise::unit(5, i, d));
            let p = DVec3::splat(0.0625) + 0.875 * DVec3::new(unit(0), unit(1), unit(2));
            let exact = 1.0 + p.x + 2.0 * p.y + 3.0 * p.z;
            // Cell values are multiples of 1/16: exact in f32.
            assert!((grid.density_in_cube(p) - exact).abs() < 1e-13);
        }
    }

    #[test]
    fn a_placed_grid_is_looked_up_in_world_space() {
        let grid = DensityGrid::from_fn([2, 1, 1], |p| if p.x < 0.5 { 1.0 } else { 3.0 })
            .in_box(DVec3::new(10.0, -1.0, 0.0), DVec3::new(14.0, 1.0, 5.0));
        assert_eq!(grid.density(DVec3::new(11.0, 0.0, 4.0)), 1.0);
        assert_eq!(grid.density(DVec3::new(12.0, 0.5, 1.0)), 2.0);
        assert_eq!(grid.density(DVec3::new(13.5, 0.0, 4.0)), 3.0);
        assert_eq!(grid.density(DVec3::new(9.9, 0.0, 4.0)), 0.0);
        assert_eq!(grid.max(), 3.0);
    }
}
