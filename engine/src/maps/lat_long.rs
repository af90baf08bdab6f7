//! The latitude–longitude map: azimuth about z against polar angle.
//!
//! Source: J. Blinn and M. Newell, "Texture and Reflection in Computer Generated Images", CACM 19(10), 1976. The polar angle is an arc tangent of two
//! arguments, which keeps its precision at the poles; the periodic seam is in longitude. Twin of `maps/lat_long.glsl`.

use super::turn::{turn_vector, vector_turn};
use crate::catalogue::{Role, Row, sources};
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Coordinates in \[0, 1\]² of a direction of any length; the first is 0 at the poles.
pub fn lat_long_encode(d: DVec3) -> DVec2 {
    let turn = vector_turn(DVec2::new(d.x, d.y));
    let u = if turn < 0.0 { turn + 1.0 } else { turn };
    DVec2::new(u, 2.0 * vector_turn(DVec2::new(d.z, d.x.hypot(d.y))))
}

/// The unit direction.
pub fn lat_long_decode(uv: DVec2) -> DVec3 {
    let down = turn_vector(0.5 * uv.y);
    (turn_vector(uv.x) * down.y).extend(down.x)
}

/// Solid angle over the area of coordinates, sr.
pub fn lat_long_density(uv: DVec2) -> f64 {
    2.0 * PI * PI * (PI * uv.y).sin()
}

/// The mean density of the row of texels at a pole, where it falls to 0, of a map of so many rows, sr.
pub fn lat_long_pole_density(rows: f64) -> f64 {
    4.0 * PI * rows * (0.5 * PI / rows).sin().powi(2)
}

/// Derivatives of the direction by the two coordinates.
pub(super) fn derivatives(uv: DVec2) -> [DVec3; 2] {
    let (sin_phi, cos_phi) = (TAU * uv.x).sin_cos();
    let (sin, cos) = (PI * uv.y).sin_cos();
    [
        TAU * sin * DVec3::new(-sin_phi, cos_phi, 0.0),
        PI * DVec3::new(cos_phi * cos, sin_phi * cos, -sin),
    ]
}

/// Solid angle of a rectangle, exact: cos a − cos b as a product, which keeps its precision at the poles.
pub(super) fn solid_angle(lower: DVec2, upper: DVec2) -> f64 {
    let (middle, half) = (0.5 * PI * (lower.y + upper.y), 0.5 * PI * (upper.y - lower.y));
    TAU * (upper.x - lower.x) * 2.0 * middle.sin() * half.sin()
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "DP-1",
    name: "latitude–longitude map; environments take it with y up, as glTF",
    role: Role::Kernel,
    limits: "Texels crowd at the poles, where their width goes to zero.",
    sources: &[sources::BLINN_NEWELL_1976.whole()],
    shaders: &["shaders/maps/lat_long.glsl"],
    tests: &[
        "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
        "engine/src/maps/tests/solid_angles.rs::texels_sum_to_the_sphere",
        "engine/src/maps/tests/density.rs::extremes_are_where_the_table_says",
        "engine/src/maps/tests/solid_angles.rs::midpoint_sums_are_off_as_stated",
        "tests/tests/twins/maps.rs::maps_agree_with_their_twins",
        "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
        "engine/src/transport/environment.rs::directions_and_coordinates_agree",
        "engine/src/maps/tests/printed.rs::a_longitude_of_a_quotient_folds_half_turns",
        "engine/src/maps/tests/density.rs::ratios_along_great_circles_are_those_of_the_figures",
    ],
    api: &[
        "clerestory::maps::lat_long::lat_long_encode",
        "clerestory::maps::lat_long::lat_long_decode",
        "clerestory::maps::Parametrization",
    ],
    settings: &["clerestory maps sky.hdr sky.exr --to lat-long"],
    ..Row::of(file!())
}];
