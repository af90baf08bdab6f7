//! Where a ray that leaves a surface starts, so that it neither meets that surface again nor skips another one close by.
//!
//! Source: forward error analysis as in M. Pharr, W. Jakob, G. Humphreys, "Physically Based Rendering", 3rd ed., §3.9 ("Managing Rounding
//! Error"), with the error of the triangle test added. GLSL functions of the same names are in `accel/offset.glsl`.
//!
//! With u = 2⁻²⁴ and M the largest component distance from the point to a vertex of the scene (its *reach*): a hit that the triangle test
//! reports at t lies within 34uM, by component, of a point of the triangle (see [`BOX_SLACK`](super::box_test::BOX_SLACK)), hence within
//! 34uM‖n‖₁ of its plane. A ray that starts farther than that from the plane and does not approach it cannot report it. Offsets are
//! 128uM‖n‖₁ plus the rounding of the position; what is beyond 34uM pays for a direction that is parallel to the plane only up to rounding,
//! for an error of the normal up to 0.3 rad, for a fold of that size at the nearest edge, and for the rounding of the offset position.
//!
//! So: no self-intersection, with the triangle itself or with coplanar ones of any size; a surface farther away than twice the offset
//! distance is not skipped. Limits: within the offset distance of an edge at which surfaces fold more sharply towards the ray, the start can lie
//! behind the neighbour; a needle thinner than some 10⁻⁵ of its length has no dependable normal.

use crate::catalogue::{Role, Row, sources};
use crate::gpu::shaders::constants;
use glam::Vec3;

/// Offset from a plane as a share of the scene's reach, 2⁻¹⁷ = 128u.
pub const SURFACE_SLACK: f32 = constants::SURFACE_SLACK;

/// Bound of the rounding of a position and of its offset copy, relative to the coordinate: u each and one to spare.
pub const POSITION_ROUNDING: f32 = constants::POSITION_ROUNDING;

/// Bound of the rounding of an interpolated edge vector, relative to its terms (difference, product, sum: γ₃, doubled).
pub const EDGE_ROUNDING: f32 = constants::EDGE_ROUNDING;

/// A point on a triangle with the distance, by component, to keep from the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Position, metres.
    pub position: Vec3,
    /// Bound of its rounding error plus the slack of the triangle test, metres.
    pub error: Vec3,
}

/// Largest component distance from a point to a corner of the scene's box: the reach of rays that start there.
pub fn scene_reach(point: Vec3, lower: Vec3, upper: Vec3) -> f32 {
    (lower - point).abs().max((upper - point).abs()).max_element()
}

/// Position of a hit or of a light sample from its barycentrics (weights of vertices 1 and 2), on the triangle to within rounding however
/// far the ray came. `reach`: see [`scene_reach`].
pub fn surface_point(vertices: &[Vec3; 3], barycentrics: [f32; 2], reach: f32) -> SurfacePoint {
    let [v0, v1, v2] = *vertices;
    let along1 = (v1 - v0) * barycentrics[0];
    let along2 = (v2 - v0) * barycentrics[1];
    let position = v0 + (along1 + along2);
    SurfacePoint {
        position,
        error: POSITION_ROUNDING * position.abs()
            + EDGE_ROUNDING * (along1.abs() + along2.abs())
            + Vec3::splat(SURFACE_SLACK * reach),
    }
}

/// Start of a ray that leaves a surface point in `direction`: on the side of the surface to which the direction points (the normal's own
/// side when it is parallel). `geometric_normal`: unit length, either orientation.
pub fn offset_ray_origin(position: Vec3, error: Vec3, geometric_normal: Vec3, direction: Vec3) -> Vec3 {
    let distance = geometric_normal.abs().dot(error);
    let side = if geometric_normal.dot(direction) < 0.0 {
        -1.0
    } else {
        1.0
    };
    position + geometric_normal * (side * distance)
}

/// Shadow segment between a surface point and a point on a light's surface: start and direction for t in [0, 1].
///
/// Both ends are offset towards each other's side, so neither surface is met. A point light needs no offset: pass a zero normal.
pub fn shadow_segment(from: &SurfacePoint, from_normal: Vec3, to: &SurfacePoint, to_normal: Vec3) -> (Vec3, Vec3) {
    let direction = to.position - from.position;
    let start = offset_ray_origin(from.position, from.error, from_normal, direction);
    let end = offset_ray_origin(to.position, to.error, to_normal, -direction);
    (start, end - start)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-OFFSET",
    name: "ray origins off their surface by error bounds",
    role: Role::PartOf("BG-3"),
    limits: "Close to an edge that folds sharply towards the ray a start can lie behind the neighbour; needles thinner than 10⁻⁵ of their length have no dependable normal.",
    sources: &[sources::PHARR_2016.at("3.9")],
    shaders: &["shaders/accel/offset.glsl"],
    tests: &[
        "engine/src/accel/offset/tests.rs::position_lies_within_its_rounding_bound",
        "engine/src/accel/offset/tests.rs::leaving_rays_meet_neither_their_triangle_nor_coplanar_ones",
        "engine/src/accel/offset/tests.rs::shadow_segments_meet_neither_end_but_what_is_between",
        "tests/tests/twins/geometry.rs::surface_points_and_ray_starts_agree_with_their_twins",
        "tests/tests/paths/path_tracer.rs::a_light_in_a_lambert_sphere_fills_it_evenly",
    ],
    api: &["clerestory::accel::offset"],
    ..Row::of(file!())
}];

#[cfg(test)]
mod tests;
