//! The equal-area octahedron map: the square layout of the octahedron map with the same solid angle everywhere.
//!
//! Source: P. Clarberg, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD", Journal of Graphics Tools 13(3), 2008, after the
//! concentric map of P. Shirley and K. Chiu, 1997. Its distance from the pole is √((x² + y²)/(1 + |z|)), which is √(1 − |z|) without
//! cancellation. Twin of `maps/equal_area.glsl`.

use super::octahedron::octahedron_signs;
use super::turn::{turn_vector, vector_turn};
use crate::catalogue::{Role, Row, sources};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Coordinates in \[-1, 1\]² of a unit direction: z ≥ 0 in the middle, −z at the four corners.
pub fn equal_area_encode(d: DVec3) -> DVec2 {
    let a = d.abs();
    let r = a.x.hypot(a.y) / (1.0 + a.z).sqrt();
    let quarters = 4.0 * vector_turn(a.truncate());
    let p = DVec2::new(r - r * quarters, r * quarters);
    let p = if d.z < 0.0 { 1.0 - DVec2::new(p.y, p.x) } else { p };
    p * octahedron_signs(DVec2::new(d.x, d.y))
}

/// The unit direction of coordinates in \[-1, 1\]².
pub fn equal_area_decode(uv: DVec2) -> DVec3 {
    let (a, h) = (uv.abs(), 1.0 - uv.x.abs() - uv.y.abs());
    let r = 1.0 - h.abs();
    let turn = if r > 0.0 { 0.125 * ((a.y - a.x) / r + 1.0) } else { 0.0 };
    let along = r * (2.0 - r * r).max(0.0).sqrt() * turn_vector(turn);
    let z = 1.0 - r * r;
    (along * octahedron_signs(uv)).extend(if h < 0.0 { -z } else { z })
}

/// Solid angle over area of \[-1, 1\]², sr: the same everywhere.
pub fn equal_area_density(_uv: DVec2) -> f64 {
    PI
}

/// Derivatives of the direction by the two coordinates.
pub(super) fn derivatives(uv: DVec2) -> [DVec3; 2] {
    let (a, h, s) = (uv.abs(), 1.0 - uv.x.abs() - uv.y.abs(), octahedron_signs(uv));
    let side = if h < 0.0 { -1.0 } else { 1.0 };
    // At the poles, where it has none, that of the octant's middle.
    let r = (1.0 - h.abs()).max(f64::EPSILON);
    let difference = a.y - a.x;
    let angle = 0.5 * FRAC_PI_2 * (difference / r + 1.0);
    let (sin, cos) = angle.sin_cos();
    let root = (2.0 - r * r).sqrt();
    let across_by_r = 2.0 * (1.0 - r * r) / root;
    [DVec2::X, DVec2::Y].map(|axis| {
        let towards = s.dot(axis);
        let by_r = side * towards;
        let by_angle = 0.5 * FRAC_PI_2 * (towards * (axis.y - axis.x) * r - difference * by_r) / (r * r);
        let across = across_by_r * by_r * DVec2::new(cos, sin) + r * root * by_angle * DVec2::new(-sin, cos);
        (across * s).extend(-2.0 * r * by_r * side)
    })
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "CL-EQUAL-AREA",
    name: "equal-area octahedron map",
    role: Role::Kernel,
    limits: "Not a projection: triangles cannot be drawn into it; shapes of texels are sheared off the axes.",
    sources: &[sources::CLARBERG_2008.whole()],
    shaders: &["shaders/maps/equal_area.glsl"],
    tests: &[
        "engine/src/maps/tests/density.rs::statistics_are_those_of_the_table",
        "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
        "engine/src/maps/tests/seams.rs::look_ups_are_continuous_over_seams",
        "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
    ],
    api: &[
        "clerestory::maps::equal_area::equal_area_encode",
        "clerestory::maps::equal_area::equal_area_decode",
        "clerestory::maps::Parametrization",
    ],
    settings: &["clerestory maps sky.hdr sky.exr --to equal-area"],
    ..Row::of(file!())
}];
