//! The cube map: six faces in the order and with the axes of Vulkan's cube images, +x −x +y −y +z −z.
//!
//! Sources: N. Greene, "Environment Mapping and Other Applications of World Projections", IEEE CG&A 6(11), 1986; the Vulkan
//! specification, "Cube Map Face Selection". Of components of equal magnitude z counts before y before x. Twin of `maps/cube.glsl`.

use glam::{DVec2, DVec3};

use crate::catalogue::{Role, Row, sources};

/// Number of faces.
pub const CUBE_FACES: u32 = 6;

/// The axes of a face: what its two coordinates and its normal are in space.
pub fn cube_axes(face: u32) -> [DVec3; 3] {
    match face {
        0 => [-DVec3::Z, -DVec3::Y, DVec3::X],
        1 => [DVec3::Z, -DVec3::Y, -DVec3::X],
        2 => [DVec3::X, DVec3::Z, DVec3::Y],
        3 => [DVec3::X, -DVec3::Z, -DVec3::Y],
        4 => [DVec3::X, -DVec3::Y, DVec3::Z],
        _ => [-DVec3::X, -DVec3::Y, -DVec3::Z],
    }
}

/// Face and coordinates in \[-1, 1\]² of a direction of any length.
pub fn cube_encode(d: DVec3) -> (u32, DVec2) {
    let a = d.abs();
    let face = if a.z >= a.x && a.z >= a.y {
        4 + u32::from(d.z < 0.0)
    } else if a.y >= a.x {
        2 + u32::from(d.y < 0.0)
    } else {
        u32::from(d.x < 0.0)
    };
    let [s, t, normal] = cube_axes(face);
    (face, DVec2::new(d.dot(s), d.dot(t)) / d.dot(normal))
}

/// The unit direction.
pub fn cube_decode(face: u32, uv: DVec2) -> DVec3 {
    let [s, t, normal] = cube_axes(face);
    (uv.x * s + uv.y * t + normal).normalize()
}

/// Solid angle over area of the face, sr.
pub fn cube_density(uv: DVec2) -> f64 {
    (1.0 + uv.length_squared()).powf(-1.5)
}

/// Derivatives of the direction by the two coordinates.
pub(super) fn derivatives(face: u32, uv: DVec2) -> [DVec3; 2] {
    let [s, t, normal] = cube_axes(face);
    super::spherical::derivatives_of_projection(uv.x * s + uv.y * t + normal, [s, t])
}

/// Solid angle of a rectangle, exact.
pub(super) fn solid_angle(lower: DVec2, upper: DVec2) -> f64 {
    let corner = |u: f64, v: f64| (u * v).atan2((1.0 + u * u + v * v).sqrt());
    corner(upper.x, upper.y) - corner(lower.x, upper.y) - corner(upper.x, lower.y) + corner(lower.x, lower.y)
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[Row {
    id: "DP-3",
    name: "cube map",
    role: Role::Kernel,
    limits: "A texel in the corner of a face has about a fifth of the solid angle of one in its middle.",
    sources: &[sources::GREENE_1986.whole()],
    shaders: &["shaders/maps/cube.glsl"],
    tests: &[
        "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
        "engine/src/maps/tests/solid_angles.rs::texels_sum_to_the_sphere",
        "engine/src/maps/tests/density.rs::extremes_are_where_the_table_says",
        "engine/src/maps/tests/places.rs::the_poles_and_axes_are_where_they_belong",
        "engine/src/maps/tests/seams.rs::border_texels_touch_what_they_repeat",
        "tests/tests/twins/maps.rs::maps_agree_with_their_twins",
        "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
        "engine/src/maps/tests/density.rs::ratios_along_great_circles_are_those_of_the_figures",
        "tests/tests/maps/directional_maps.rs::look_ups_in_cubes_and_discs_are_their_twins",
    ],
    api: &[
        "clerestory::maps::cube::cube_encode",
        "clerestory::maps::cube::cube_decode",
        "clerestory::maps::Parametrization",
    ],
    settings: &["clerestory maps sky.hdr sky.exr --to cube"],
    ..Row::of(file!())
}];
