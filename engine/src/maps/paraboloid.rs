//! The dual paraboloid map: two discs, front (z ≥ 0) and back.
//!
//! Source: W. Heidrich and H.-P. Seidel, "View-Independent Environment Maps", Graphics Hardware 1998. The paraboloid's reflections make
//! it the stereographic projection, which keeps angles. The back divides by 1 − z, as the front by 1 + z. Twin of `maps/paraboloid.glsl`.

use super::disc;
use crate::catalogue::{Role, Row, sources};
use glam::{DVec2, DVec3};

/// Layer, 1 for z < 0, and coordinates on the unit disc of a unit direction.
pub fn paraboloid_encode(d: DVec3) -> (u32, DVec2) {
    (u32::from(d.z < 0.0), DVec2::new(d.x, d.y) / (1.0 + d.z.abs()))
}

/// The unit direction; beyond the rim it goes on into the other half.
pub fn paraboloid_decode(layer: u32, uv: DVec2) -> DVec3 {
    let squared = uv.length_squared();
    let z = if layer == 0 { 1.0 - squared } else { squared - 1.0 };
    (2.0 * uv).extend(z) / (1.0 + squared)
}

/// Solid angle over area of the disc, sr.
pub fn paraboloid_density(uv: DVec2) -> f64 {
    let h = 1.0 + uv.length_squared();
    4.0 / (h * h)
}

/// Derivatives of the direction by the two coordinates.
pub(super) fn derivatives(layer: u32, uv: DVec2) -> [DVec3; 2] {
    let h = 1.0 + uv.length_squared();
    let d = paraboloid_decode(layer, uv);
    let side = if layer == 0 { -1.0 } else { 1.0 };
    [DVec2::X, DVec2::Y].map(|axis| {
        let along = 2.0 * uv.dot(axis);
        ((2.0 * axis).extend(side * along) - d * along) / h
    })
}

/// Solid angle of the part of a rectangle within the disc, exact.
pub(super) fn solid_angle(lower: DVec2, upper: DVec2) -> f64 {
    disc::integrate(disc::stereographic, lower, upper)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "DP-4",
    name: "dual paraboloid map",
    role: Role::Kernel,
    limits: "A texel at the rim of a disc has a quarter of the solid angle of one in its middle, and a fifth of the picture is unused.",
    sources: &[sources::HEIDRICH_SEIDEL_1998.whole()],
    shaders: &["shaders/maps/paraboloid.glsl"],
    tests: &[
        "tests/tests/raster/cuts.rs::paraboloids_come_nearer_with_smaller_pieces",
        "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
        "engine/src/maps/tests/solid_angles.rs::texels_sum_to_the_sphere",
        "engine/src/maps/tests/density.rs::extremes_are_where_the_table_says",
        "engine/src/maps/tests/solid_angles.rs::rectangles_have_the_integral_of_the_density",
        "tests/tests/twins/maps.rs::maps_agree_with_their_twins",
        "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
        "engine/src/maps/tests/density.rs::ratios_along_great_circles_are_those_of_the_figures",
        "tests/tests/maps/directional_maps.rs::look_ups_in_cubes_and_discs_are_their_twins",
    ],
    api: &[
        "clerestory::maps::paraboloid::paraboloid_encode",
        "clerestory::maps::paraboloid::paraboloid_decode",
        "clerestory::maps::Parametrization",
    ],
    settings: &["clerestory maps sky.hdr sky.exr --to paraboloid"],
    ..Row::of(file!())
}];
