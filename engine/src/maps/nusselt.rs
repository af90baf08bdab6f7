//! Nusselt's map: the hemisphere about z, dropped on its base, so that equal areas have equal projected solid angles.
//!
//! Source: W. Nusselt, "Graphische Bestimmung des Winkelverhältnisses bei der Wärmestrahlung", Zeitschrift des VDI 72, 1928. Solid angles
//! are without bound at the horizon. Twin of `maps/nusselt.glsl`.

use super::disc;
use crate::catalogue::{Role, Row, sources};
use glam::{DVec2, DVec3};

/// Coordinates on the unit disc of a unit direction with z ≥ 0.
pub fn nusselt_encode(d: DVec3) -> DVec2 {
    DVec2::new(d.x, d.y)
}

/// The unit direction; outside the disc it lies on the horizon.
pub fn nusselt_decode(uv: DVec2) -> DVec3 {
    let squared = uv.length_squared();
    uv.extend((1.0 - squared).max(0.0).sqrt()) / squared.max(1.0).sqrt()
}

/// Solid angle over area of the disc, sr: 1/z.
pub fn nusselt_density(uv: DVec2) -> f64 {
    1.0 / (1.0 - uv.length_squared()).max(0.0).sqrt()
}

/// Derivatives of the direction by the two coordinates.
pub(super) fn derivatives(uv: DVec2) -> [DVec3; 2] {
    let z = (1.0 - uv.length_squared()).max(0.0).sqrt();
    [DVec2::X, DVec2::Y].map(|axis| axis.extend(-uv.dot(axis) / z))
}

/// Solid angle of the part of a rectangle within the disc, exact.
pub(super) fn solid_angle(lower: DVec2, upper: DVec2) -> f64 {
    disc::integrate(disc::over_cosine, lower, upper)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "DP-5",
    name: "Nusselt's map of the hemisphere",
    role: Role::Kernel,
    limits: "Half of the sphere only; solid angles of texels grow without bound towards the horizon.",
    sources: &[sources::NUSSELT_1928.whole()],
    shaders: &["shaders/maps/nusselt.glsl"],
    tests: &[
        "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
        "engine/src/maps/tests/solid_angles.rs::texels_sum_to_the_sphere",
        "engine/src/maps/tests/density.rs::extremes_are_where_the_table_says",
        "engine/src/maps/tests/solid_angles.rs::rectangles_have_the_integral_of_the_density",
        "tests/tests/twins/maps.rs::maps_agree_with_their_twins",
        "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
        "tests/tests/maps/directional_maps.rs::look_ups_in_cubes_and_discs_are_their_twins",
    ],
    api: &[
        "clerestory::maps::nusselt::nusselt_encode",
        "clerestory::maps::nusselt::nusselt_decode",
        "clerestory::maps::Parametrization",
    ],
    settings: &["clerestory maps sky.hdr sky.exr --to nusselt"],
    ..Row::of(file!())
}];
