//! The eight octants of the octahedron map as views: its encoding is linear in each of them.
//!
//! Source: T. Engelhardt and C. Dachsbacher, "Octahedron Environment Maps", VMV 2008; T. Engelhardt, "Efficient Visibility for Realistic
//! Rendering", 2013, §7.1 and §7.2. There triangles are split by a geometry shader. Here, with the signs s of an octant in place of absolute
//! values, the map of a point p is a quotient of linear functions with the divisor W = s·p, the norm |x| + |y| + |z|: the rasterizer's own homogeneous
//! coordinate, so that one matrix an octant and three clip distances s·p ≥ 0, component by component, render the map exactly.

use glam::{DVec3, Vec3};

use super::View;
use crate::Result;
use crate::gpu::Area;
use crate::maps::octahedron::{OctahedronLayout, octant_matrix};

/// Octants of an octahedron: [`View::of_octants`] has one view for each.
pub const OCTANTS: u32 = 8;

impl View {
    /// What is seen from a point in all directions, as an octahedron map that fills the area: one view for each octant, for
    /// [`Layering::Octants`](super::Layering).
    ///
    /// # Errors
    /// [`Error::Setting`](crate::Error::Setting) for a place or near plane that is not finite.
    pub fn of_octants(origin: Vec3, layout: OctahedronLayout, near: f32, area: Area) -> Result<Vec<Self>> {
        let octant = |number: u32| {
            let sign = |bit: u32| if number >> bit & 1 == 0 { 1.0 } else { -1.0 };
            let signs = DVec3::new(sign(0), sign(1), sign(2));
            // Of any depths: views have their own.
            let matrix = octant_matrix(layout, signs, 1.0, 2.0);
            let rows = [0, 1, 3].map(|row| matrix.row(row).truncate());
            let mut view = Self::central(origin, rows, near, area)?;
            view.record.signs = signs.as_vec3().to_array();
            Ok(view)
        };
        (0..OCTANTS).map(octant).collect()
    }
}
