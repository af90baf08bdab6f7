//! The eight octants of the octahedron map as views: its encoding is linear in each of them.
//!
//! Source: T. Engelhardt and C. Dachsbacher, "Octahedron Environment Maps", VMV 2008; T. Engelhardt, "Efficient From-Point Visibility
//! for Global Illumination in Virtual Scenes with Participating Media", PhD thesis, KIT, 2013, §7.1 and §7.2. There triangles are split by a geometry shader. Here, with the signs s of an octant in place of absolute
//! values, the map of a point p is a quotient of linear functions with the divisor W = s·p, the norm |x| + |y| + |z|: the rasterizer's own homogeneous
//! coordinate, so that one matrix an octant and three clip distances s·p ≥ 0, component by component, render the map exactly. The other ways
//! of [`OctantCut`](super::OctantCut) take the same views.

use glam::{DVec2, DVec3, Vec3};

use super::View;
use crate::Result;
use crate::catalogue::{Role, Row, sources};
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
            view.layout = Some(layout);
            Ok(view)
        };
        (0..OCTANTS).map(octant).collect()
    }

    /// The pixels of a picture of that size which the octant lies in, for a view that fills it.
    pub(super) fn octant_area(&self, size: [u32; 2]) -> Area {
        let signs = self.octant().as_dvec3();
        let corners = DVec3::AXES.map(|axis| {
            let [x, y, _, w] = self.project(self.origin().as_dvec3() + signs * axis);
            DVec2::new(x, y) / w
        });
        let pixels = DVec2::new(f64::from(size[0]), f64::from(size[1]));
        let low = corners.into_iter().fold(DVec2::ONE, DVec2::min);
        let high = corners.into_iter().fold(DVec2::NEG_ONE, DVec2::max);
        let low = ((0.5 + 0.5 * low) * pixels).floor().max(DVec2::ZERO).as_uvec2();
        let high = ((0.5 + 0.5 * high) * pixels).ceil().min(pixels).as_uvec2();
        Area {
            offset: low.to_array(),
            size: (high - low).to_array(),
        }
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "OEM-4g",
    name: "octahedron maps rendered live: linear octants with clip distances",
    role: Role::PartOf("CL-LIVE-MAP"),
    limits: "Exact, but every triangle is drawn once for each octant.",
    sources: &[sources::ENGELHARDT_DACHSBACHER_2008.at("octahedra drawn live; linear octants are the engine's own")],
    shaders: &["shaders/raster/surface_octant.vert"],
    needs: &["shaderClipDistance"],
    tests: &[
        "tests/tests/raster/directions.rs::octahedra_are_as_rays_see_them_and_have_no_holes",
        "tests/tests/raster/cuts.rs::exact_cuts_interpolate_what_rays_meet",
        "tests/tests/raster/cuts.rs::cuts_emit_what_their_twins_say",
        "tests/tests/raster/directions.rs::views_project_as_the_maps_encode",
        "engine/src/maps/tests/printed.rs::matrices_of_octants_are_the_map",
    ],
    api: &["clerestory::raster::OctantCut", "clerestory::raster::GBuffer"],
    settings: &["clerestory::raster::Layering", "clerestory::raster::GBufferDesc"],
    ..Row::of(file!())
}];
