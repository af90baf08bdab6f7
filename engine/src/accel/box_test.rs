//! The slab test of boxes: one rule for every index and for both layouts of photon maps, on the host and in kernels.
//!
//! Sources: T. Kay and J. Kajiya, "Ray Tracing Complex Scenes", SIGGRAPH 1986 (slabs); T. Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013 (that
//! rounding loses hits).
//!
//! Guarantee: what the triangle test reports is never culled: the reported distance lies in the span of each box that holds the triangle. Boxes are
//! grown for that by [`BOX_SLACK`], so that rays meet them a little beside their faces, too.

use super::{Aabb, Ray};
use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;
use glam::Vec3;

/// Share of the scene's size by which boxes are grown in the ray test, 2⁻¹⁸ = 64u with u = 2⁻²⁴.
///
/// Let M be the largest component distance from the ray's origin to a corner of the root box, and |d| the largest direction component.
/// Divisions err by 2.5 ULP at most (Vulkan), that is 5u; first order in u:
///
/// - sheared vertex: difference uM, shear factor and product 7uM, subtraction 2uM: 10uM;
/// - weights, relative error 2u each plus their use: the point q that they name is sheared to within 6uM of what exact weights give,
///   which is the origin: so q lies on the triangle, within 16uM of the ray along the two sheared axes;
/// - reported t: projection 7u, products and sum 3u, determinant 2u, division 6u: within 18uM/|d| of q's. The ray at t is thus within
///   18uM of q along the dominant axis and 34uM along the others;
/// - slab distances: difference u, reciprocal 5u, product u: 7uM; subtracting the slack: uM.
///
/// Altogether under 44uM: with slabs grown by 64uM the reported t lies between entry and exit of each box that holds the triangle. A
/// relative widening of the exit distance (T. Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013) would cover the last item only.
pub const BOX_SLACK: f32 = constants::BOX_SLACK;

/// Smallest direction component, relative to the largest, that the box test takes as it is; the slack covers the difference (2⁻⁶⁰).
pub const MIN_RELATIVE_COMPONENT: f32 = constants::MIN_RELATIVE_COMPONENT;

/// A ray made ready for boxes: origin, clamped reciprocal direction, and the slack by which boxes are grown.
#[derive(Debug, Clone, Copy)]
pub struct BoxTest {
    pub(in crate::accel) origin: Vec3,
    pub(in crate::accel) inverse: Vec3,
    pub(in crate::accel) slack: Vec3,
}

impl BoxTest {
    /// For boxes within `root`, and rays that are traceable ([`Ray::is_traceable`]).
    pub fn new(root: &Aabb, ray: &Ray) -> Self {
        let origin = Vec3::from(ray.origin);
        let direction = Vec3::from(ray.direction);
        let least = direction.abs().max_element() * MIN_RELATIVE_COMPONENT;
        let inverse = Vec3::from_array(ray.direction.map(|d| {
            let size = if d.abs() > least { d.abs() } else { least };
            (if d < 0.0 { -1.0 } else { 1.0 }) / size
        }));
        let reach = (root.lower - origin).abs().max((root.upper - origin).abs());
        Self {
            origin,
            inverse,
            slack: (BOX_SLACK * reach.max_element()) * inverse.abs(),
        }
    }

    /// Entry and exit distance of a box; the entry is greater where the box is missed.
    pub fn span(&self, lower: Vec3, upper: Vec3) -> (f32, f32) {
        let t0 = (lower - self.origin) * self.inverse;
        let t1 = (upper - self.origin) * self.inverse;
        let near = t0.min(t1) - self.slack;
        let far = t0.max(t1) + self.slack;
        (near.max_element(), far.min_element())
    }
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "PM-I-4",
    name: "slabs test of boxes",
    role: Role::PartOf("BG-14"),
    limits: "Tells that a box is hit, not what inside it is, and takes rays for hits that pass it by 2⁻¹⁸ of the scene's size as seen from their origin.",
    sources: &[sources::KAY_KAJIYA_1986.whole(), sources::IZE_2013.whole()],
    shaders: &["shaders/accel/box_test.glsl"],
    tests: &[
        "engine/src/accel/box_test/tests.rs::rays_along_axes_meet_boxes_at_every_face_edge_and_corner_and_not_beside_them",
        "engine/src/accel/box_test/tests.rs::spans_of_rays_at_faces_edges_and_corners_are_those_of_f64",
        "engine/src/accel/box_test/tests.rs::boxes_are_met_up_to_their_slack_and_no_further",
        "engine/src/accel/photon_map/compact_bvh/tests.rs::no_layout_culls_what_the_triangle_test_reports",
        "tests/tests/accel/lbvh.rs::compact_queries_are_the_twins",
    ],
    api: &["clerestory::accel::box_test::BoxTest"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests;
