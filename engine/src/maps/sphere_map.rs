//! The sphere map: what a mirror ball shows a distant orthographic camera that looks along −z.
//!
//! Source: G. Miller and C. Hoffman, "Illumination and Reflection Maps", SIGGRAPH course notes, 1984. With the ball's normal n and the
//! view (0, 0, −1), ω = 2 n_z n − (0, 0, 1), so ω_z = 2n_z² − 1. It is Lambert's azimuthal map: every texel has the same solid angle and
//! only its shape degrades, without bound at the rim, which is (0, 0, −1) all round. Twin of `maps/sphere_map.glsl`.

use super::disc;
use crate::catalogue::{Role, Row, sources};
use glam::{DVec2, DVec3};

/// Coordinates on the unit disc of a unit direction; (1, 0) for (0, 0, −1).
pub fn sphere_map_encode(d: DVec3) -> DVec2 {
    let across = DVec2::new(d.x, d.y);
    if d.z >= 0.0 {
        return across / (2.0 * (1.0 + d.z)).sqrt();
    }
    // Behind, 1 + z = (x² + y²)/(1 − z), which does not cancel.
    let length = across.length();
    let along = if length > 0.0 { across / length } else { DVec2::X };
    along * (0.5 * (1.0 - d.z)).sqrt()
}

/// The unit direction; outside the disc as at its rim.
pub fn sphere_map_decode(uv: DVec2) -> DVec3 {
    let z = (1.0 - uv.length_squared()).max(0.0).sqrt();
    DVec3::new(2.0 * z * uv.x, 2.0 * z * uv.y, 2.0 * z * z - 1.0)
}

/// Solid angle over area of the disc, sr: the same everywhere.
pub fn sphere_map_density(_uv: DVec2) -> f64 {
    4.0
}

/// Derivatives of the direction by the two coordinates.
pub(super) fn derivatives(uv: DVec2) -> [DVec3; 2] {
    let z = (1.0 - uv.length_squared()).max(0.0).sqrt();
    let n = uv.extend(z);
    [DVec2::X, DVec2::Y].map(|axis| {
        let along = -uv.dot(axis) / z;
        2.0 * (along * n + z * axis.extend(along))
    })
}

/// Solid angle of the part of a rectangle within the disc, exact.
pub(super) fn solid_angle(lower: DVec2, upper: DVec2) -> f64 {
    sphere_map_density(lower) * disc::area(lower, upper)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "DP-2",
    name: "sphere map (mirror ball)",
    role: Role::Kernel,
    limits: "Texels degrade in shape without bound at the rim, which is a single direction all the way round.",
    sources: &[sources::MILLER_HOFFMAN_1984.whole()],
    shaders: &["shaders/maps/sphere_map.glsl"],
    tests: &[
        "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
        "engine/src/maps/tests/solid_angles.rs::texels_sum_to_the_sphere",
        "engine/src/maps/tests/density.rs::extremes_are_where_the_table_says",
        "engine/src/maps/tests/printed.rs::the_printed_sphere_map_is_that_of_the_negated_direction",
        "engine/src/maps/tests/density.rs::anisotropies_are_those_of_the_table",
        "tests/tests/twins/maps.rs::maps_agree_with_their_twins",
        "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
        "tests/tests/maps/directional_maps.rs::look_ups_in_cubes_and_discs_are_their_twins",
    ],
    api: &[
        "clerestory::maps::sphere_map::sphere_map_encode",
        "clerestory::maps::sphere_map::sphere_map_decode",
        "clerestory::maps::Parametrization",
    ],
    settings: &["clerestory maps sky.hdr sky.exr --to sphere"],
    ..Row::of(file!())
}];
