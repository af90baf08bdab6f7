//! New boxes for a tree whose triangles have moved: its shape stays.

use crate::accel::Aabb;
use crate::accel::bvh2::Bvh2Triangle;
use crate::accel::wide::grid::GridAxis;
use crate::accel::wide::{SLOTS, WideNode};
use glam::Vec3;

/// Decoded boxes again, from the triangles up, of nodes whose first has the number `first_node`, over triangles whose first is at the place `first_triangle`.
/// Children come behind their parents. Returns the box of all; empty without triangles.
pub(super) fn refit(nodes: &mut [WideNode], first_node: u32, triangles: &[Bvh2Triangle], first_triangle: u32) -> Aabb {
    let mut own = vec![Aabb::EMPTY; nodes.len()];
    for index in (0..nodes.len()).rev() {
        let node = &mut nodes[index];
        let mut slots = [Aabb::EMPTY; SLOTS];
        for (slot, bounds) in slots.iter_mut().enumerate() {
            if let Some(child) = node.child(slot) {
                *bounds = own[(child - first_node) as usize];
            } else {
                let (first, count) = node.leaf(slot);
                let held = (first - first_triangle) as usize;
                let corners = triangles[held..held + count as usize].iter().flat_map(|t| t.corners);
                *bounds = corners.fold(Aabb::EMPTY, |bounds, corner| bounds.with_point(corner + Vec3::ZERO));
            }
            own[index] = own[index].union(*bounds);
        }
        let held = |bounds: &Aabb| bounds.lower.x <= bounds.upper.x;
        if !held(&own[index]) {
            continue;
        }
        let grid = [0, 1, 2].map(|axis: usize| GridAxis::over(own[index].lower[axis], own[index].upper[axis]));
        node.corner = Vec3::from_array(grid.map(|axis| axis.corner));
        let above = node.exponents.to_le_bytes()[3];
        node.exponents = u32::from_le_bytes([grid[0].exponent, grid[1].exponent, grid[2].exponent, above]);
        for (slot, bounds) in slots.iter().enumerate().filter(|(_, bounds)| held(bounds)) {
            for (axis, grid) in grid.iter().enumerate() {
                let [lower, upper] = grid.planes(bounds.lower[axis], bounds.upper[axis]);
                node.planes[axis][0][slot] = lower;
                node.planes[axis][1][slot] = upper;
            }
        }
    }
    own.first().copied().unwrap_or(Aabb::EMPTY)
}
