//! The boxes of a wide node on the grid that is the finest around them all; twin of the kernels' `wide_set_boxes`.

use super::WideNode;
use super::grid::GridAxis;
use crate::accel::Aabb;
use glam::Vec3;

/// Sets the grid of a node that is bounded by `bounds`, and on it the boxes of some of its slots. No coordinate is a negative zero, whose bits a
/// corner would keep.
pub(in crate::accel) fn set_boxes(node: &mut WideNode, bounds: &Aabb, boxes: impl IntoIterator<Item = (usize, Aabb)>) {
    let grid = [0, 1, 2].map(|axis: usize| GridAxis::over(bounds.lower[axis], bounds.upper[axis]));
    node.corner = Vec3::from_array(grid.map(|axis| axis.corner));
    node.exponents = u32::from_le_bytes([grid[0].exponent, grid[1].exponent, grid[2].exponent, 0]);
    for (slot, bounds) in boxes {
        for (axis, grid) in grid.iter().enumerate() {
            let [lower, upper] = grid.planes(bounds.lower[axis], bounds.upper[axis]);
            node.planes[axis][0][slot] = lower;
            node.planes[axis][1][slot] = upper;
        }
    }
}
