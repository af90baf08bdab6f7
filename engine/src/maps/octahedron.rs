//! Octahedron maps: the sphere projected from its centre onto an octahedron, unfolded to a square or to a rectangle.
//!
//! Sources: E. Praun and H. Hoppe, "Spherical Parametrization and Remeshing", SIGGRAPH 2003; T. Engelhardt and C. Dachsbacher,
//! "Octahedron Environment Maps", VMV 2008; T. Engelhardt, PhD thesis, KIT, 2013, chapter 7, of which these forms differ: the sign of
//! zero is +1 (with 0, directions −z and +z meet in the middle), the second hemisphere of the rectangle is mirrored (without, neither its
//! seam nor its wrap is continuous), and z is the fold axis throughout. A projective map of an octant that keeps the symmetry of its axes
//! is (x, y)/(|x| + |y| + c|z|): `c` = 1 is the projection onto the octahedron itself, the others are those onto steeper or flatter ones.
//! Twin of `maps/octahedron.glsl`.

use super::spherical::{Polygon, derivatives_of_projection};
use crate::catalogue::{Role, Row, sources};
use glam::{DMat4, DVec2, DVec3, DVec4};

/// ±1 by sign; +1 for both zeros.
pub fn octahedron_signs(v: DVec2) -> DVec2 {
    let sign = |x: f64| if x < 0.0 { -1.0 } else { 1.0 };
    DVec2::new(sign(v.x), sign(v.y))
}

/// Coordinates in \[-1, 1\]² of a direction of any length in the square layout: z ≥ 0 in the middle, −z at the four corners.
pub fn octahedron_encode(d: DVec3) -> DVec2 {
    octahedron_perspective_encode(d, 1.0)
}

/// The unit direction of coordinates in \[-1, 1\]².
pub fn octahedron_decode(uv: DVec2) -> DVec3 {
    octahedron_perspective_decode(uv, 1.0)
}

/// Solid angle over area of \[-1, 1\]², sr: 1/‖p‖³ with p on the octahedron, which is continuous.
pub fn octahedron_density(uv: DVec2) -> f64 {
    octahedron_perspective_density(uv, 1.0)
}

/// As [`octahedron_encode`], projected onto the octahedron with |x| + |y| + c|z| = 1.
pub fn octahedron_perspective_encode(d: DVec3, c: f64) -> DVec2 {
    let p = DVec2::new(d.x, d.y) / (d.x.abs() + d.y.abs() + c * d.z.abs());
    if d.z < 0.0 {
        (1.0 - DVec2::new(p.y, p.x).abs()) * octahedron_signs(p)
    } else {
        p
    }
}

/// As [`octahedron_decode`] for [`octahedron_perspective_encode`].
pub fn octahedron_perspective_decode(uv: DVec2, c: f64) -> DVec3 {
    on_octahedron(uv, c).normalize()
}

/// As [`octahedron_density`] for [`octahedron_perspective_encode`].
pub fn octahedron_perspective_density(uv: DVec2, c: f64) -> f64 {
    1.0 / (c * on_octahedron(uv, c).length().powi(3))
}

/// The point of the octahedron |x| + |y| + c|z| = 1.
fn on_octahedron(uv: DVec2, c: f64) -> DVec3 {
    let h = 1.0 - uv.x.abs() - uv.y.abs();
    (uv - octahedron_signs(uv) * (-h).max(0.0)).extend(h / c)
}

/// Coordinates in \[-2, 2\] × \[-1, 1\] of a direction of any length in the layout of two squares, z ≥ 0 in the left one.
pub fn octahedron_rectangular_encode(d: DVec3) -> DVec2 {
    let p = DVec2::new(d.x, d.y) / (d.x.abs() + d.y.abs() + d.z.abs());
    let (along, across) = (p.x - p.y, p.x + p.y);
    DVec2::new(if d.z < 0.0 { 1.0 - along } else { along - 1.0 }, across)
}

/// The unit direction of coordinates in \[-2, 2\] × \[-1, 1\].
pub fn octahedron_rectangular_decode(uv: DVec2) -> DVec3 {
    on_rectangle(uv).normalize()
}

/// Solid angle over area of \[-2, 2\] × \[-1, 1\], sr.
pub fn octahedron_rectangular_density(uv: DVec2) -> f64 {
    0.5 / on_rectangle(uv).length().powi(3)
}

fn on_rectangle(uv: DVec2) -> DVec3 {
    let along = if uv.x < 0.0 { uv.x + 1.0 } else { 1.0 - uv.x };
    let (x, y) = (0.5 * (along + uv.y), 0.5 * (uv.y - along));
    let h = 1.0 - x.abs() - y.abs();
    DVec3::new(x, y, if uv.x < 0.0 { h } else { -h })
}

/// One of the two layouts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OctahedronLayout {
    /// A square, by [`octahedron_encode`].
    Quadratic,
    /// Two squares side by side, by [`octahedron_rectangular_encode`].
    Rectangular,
}

/// The map of one octant as a matrix over (x, y, z, 1): homogeneous coordinates (X, Y, Z, W) whose quotient is the map in \[-1, 1\]² (the
/// rectangle's first coordinate halved), for points whose signs are `signs` (±1 each). W is the L1 norm there, continuous over octants and
/// linear along rays; Z/W is 0 at W = `near` and 1 at W = `far`.
pub fn octant_matrix(layout: OctahedronLayout, signs: DVec3, near: f64, far: f64) -> DMat4 {
    let w = signs.extend(0.0);
    let (x, y) = match layout {
        OctahedronLayout::Quadratic if signs.z > 0.0 => (DVec4::X, DVec4::Y),
        OctahedronLayout::Quadratic => (DVec4::X - signs.x * DVec4::Z, DVec4::Y - signs.y * DVec4::Z),
        OctahedronLayout::Rectangular => (0.5 * signs.z * (DVec4::X - DVec4::Y - w), DVec4::X + DVec4::Y),
    };
    let depth = (far * w - far * near * DVec4::W) / (far - near);
    DMat4::from_cols(x, y, depth, w).transpose()
}

/// How the coordinates of the square layout move when the direction does, by the map of the direction's own octant: it has no seams.
/// `d` of any length and its derivatives by something; c = 1.
pub fn octahedron_derivatives(d: DVec3, by: [DVec3; 2]) -> [DVec2; 2] {
    let s = octahedron_signs(DVec2::new(d.x, d.y)).extend(if d.z < 0.0 { -1.0 } else { 1.0 });
    let w = d.dot(s);
    let fold = if d.z < 0.0 { s.truncate() } else { DVec2::ZERO };
    let uv = (d.truncate() - fold * d.z) / w;
    by.map(|v| (v.truncate() - fold * v.z - uv * v.dot(s)) / w)
}

/// The same for the rectangular layout.
pub fn octahedron_rectangular_derivatives(d: DVec3, by: [DVec3; 2]) -> [DVec2; 2] {
    let side = if d.z < 0.0 { -1.0 } else { 1.0 };
    let s = octahedron_signs(DVec2::new(d.x, d.y)).extend(side);
    let w = d.dot(s);
    let p = d.truncate() / w;
    by.map(|v| {
        let q = (v.truncate() - p * v.dot(s)) / w;
        DVec2::new(side * (q.x - q.y), q.x + q.y)
    })
}

/// Derivatives of the direction by the coordinates of the square layout.
pub(super) fn derivatives(uv: DVec2, c: f64) -> [DVec3; 2] {
    let s = octahedron_signs(uv);
    let lower = uv.x.abs() + uv.y.abs() > 1.0;
    // Within an octant the point is linear in the coordinates.
    let by = if lower {
        [
            DVec3::new(0.0, -s.x * s.y, -s.x / c),
            DVec3::new(-s.x * s.y, 0.0, -s.y / c),
        ]
    } else {
        [DVec3::new(1.0, 0.0, -s.x / c), DVec3::new(0.0, 1.0, -s.y / c)]
    };
    derivatives_of_projection(on_octahedron(uv, c), by)
}

/// Derivatives of the direction by the coordinates of the rectangular layout.
pub(super) fn rectangular_derivatives(uv: DVec2) -> [DVec3; 2] {
    let p = on_rectangle(uv);
    let (s, side) = (octahedron_signs(p.truncate()), if uv.x < 0.0 { 1.0 } else { -1.0 });
    let by = [DVec2::new(0.5 * side, -0.5 * side), DVec2::splat(0.5)];
    derivatives_of_projection(p, by.map(|v| v.extend(-side * s.dot(v))))
}

/// Solid angle of a rectangle of the square layout, exact: its parts in each octant, divided by the folds, are spherical polygons.
pub(super) fn solid_angle(lower: DVec2, upper: DVec2, c: f64) -> f64 {
    let lift = |p: DVec2| p.extend((1.0 - p.x - p.y) / c);
    let diagonal = DVec2::ONE;
    let mut sum = 0.0;
    for sign in [DVec2::ONE, DVec2::new(-1.0, 1.0), DVec2::NEG_ONE, DVec2::new(1.0, -1.0)] {
        let (a, b) = (lower * sign, upper * sign);
        let (low, high) = (a.min(b).max(DVec2::ZERO), a.max(b));
        if high.cmple(low).any() {
            continue;
        }
        let part = Polygon::rectangle(low, high);
        sum += part.clipped(-diagonal, -1.0).solid_angle(lift);
        sum += part
            .clipped(diagonal, 1.0)
            .solid_angle(|p| lift(DVec2::new(1.0 - p.y, 1.0 - p.x)));
    }
    sum
}

/// Solid angle of a rectangle of the rectangular layout, exact.
pub(super) fn rectangular_solid_angle(lower: DVec2, upper: DVec2) -> f64 {
    let mut sum = 0.0;
    for (from, to) in [(lower.x, upper.x.min(0.0)), (lower.x.max(0.0), upper.x)] {
        if to <= from {
            continue;
        }
        let part = Polygon::rectangle(DVec2::new(from, lower.y), DVec2::new(to, upper.y));
        // The middle of each square is a pole, from which its diagonals go to the axes x and y.
        let middle = if from < 0.0 { -1.0 } else { 1.0 };
        for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            let (first, second) = (s * DVec2::ONE, t * DVec2::new(-1.0, 1.0));
            let cut = part.clipped(first, first.x * middle).clipped(second, second.x * middle);
            sum += cut.solid_angle(|p| {
                let along = p.x - middle;
                let (x, y) = (0.5 * (along + p.y), 0.5 * (p.y - along));
                DVec3::new(x, y, 1.0 - x.abs() - y.abs())
            });
        }
    }
    sum
}

/// Rows of the catalogue.
pub(crate) const ROWS: &[Row] = &[
    Row {
        id: "OEM-1",
        name: "octahedron map, square layout",
        role: Role::Kernel,
        limits: "A texel at an axis has about a fifth of the solid angle of one in the middle of an octant.",
        sources: &[
            sources::PRAUN_HOPPE_2003.whole(),
            sources::ENGELHARDT_DACHSBACHER_2008.whole(),
        ],
        shaders: &["shaders/maps/octahedron.glsl"],
        tests: &[
            "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
            "engine/src/maps/tests/solid_angles.rs::texels_sum_to_the_sphere",
            "engine/src/maps/tests/density.rs::extremes_are_where_the_table_says",
            "engine/src/maps/tests/printed.rs::a_sign_of_zero_that_is_zero_folds_the_map_onto_itself",
            "engine/src/maps/tests/printed.rs::matrices_of_octants_are_the_map",
            "engine/src/maps/tests/seams.rs::border_texels_touch_what_they_repeat",
            "engine/src/maps/tests/seams.rs::look_ups_are_continuous_over_seams",
            "engine/src/maps/tests/levels.rs::the_mirrored_direction_repairs_the_lower_seams",
            "engine/src/maps/tests/irradiance.rs::constant_radiance_gives_pi_for_every_normal",
            "tests/tests/twins/maps.rs::maps_agree_with_their_twins",
            "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
            "engine/src/maps/tests/density.rs::ratios_along_great_circles_are_those_of_the_figures",
            "tests/tests/maps/directional_maps.rs::shadows_by_octahedron_and_cube_are_as_good",
        ],
        api: &[
            "clerestory::maps::octahedron::octahedron_encode",
            "clerestory::maps::octahedron::octahedron_decode",
            "clerestory::maps::Parametrization",
        ],
        settings: &["clerestory maps sky.hdr sky.exr --to octahedron"],
        ..Row::of(file!())
    },
    Row {
        id: "OEM-2",
        name: "octahedron map, rectangular layout",
        role: Role::Kernel,
        limits: "A texel at an axis has about a fifth of the solid angle of one in the middle of an octant.",
        sources: &[sources::ENGELHARDT_DACHSBACHER_2008.whole()],
        shaders: &["shaders/maps/octahedron.glsl"],
        tests: &[
            "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
            "engine/src/maps/tests/solid_angles.rs::texels_sum_to_the_sphere",
            "engine/src/maps/tests/density.rs::extremes_are_where_the_table_says",
            "engine/src/maps/tests/printed.rs::a_second_half_that_is_not_mirrored_tears_the_rectangle",
            "engine/src/maps/tests/seams.rs::border_texels_touch_what_they_repeat",
            "engine/src/maps/tests/levels.rs::the_octants_own_map_has_no_seams",
            "tests/tests/twins/maps.rs::maps_agree_with_their_twins",
            "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
            "tests/tests/maps/directional_maps.rs::shadows_by_octahedron_and_cube_are_as_good",
        ],
        api: &[
            "clerestory::maps::octahedron::octahedron_rectangular_encode",
            "clerestory::maps::octahedron::octahedron_rectangular_decode",
            "clerestory::maps::Parametrization",
        ],
        settings: &["clerestory maps sky.hdr sky.exr --to octahedron-rectangular"],
        ..Row::of(file!())
    },
    Row {
        id: "OEM-3",
        name: "octahedron maps by other central projections",
        role: Role::Kernel,
        limits: "Moves texels between axes and middles of octants; none of these projections has the same solid angle everywhere.",
        sources: &[sources::ENGELHARDT_2013.at("7.1.2")],
        shaders: &["shaders/maps/octahedron.glsl"],
        tests: &[
            "engine/src/maps/tests/places.rs::directions_come_back_from_their_places",
            "engine/src/maps/tests/solid_angles.rs::texels_sum_to_the_sphere",
            "engine/src/maps/tests/density.rs::extremes_are_where_the_table_says",
            "engine/src/maps/tests/density.rs::the_perspective_family_is_best_at_one",
            "tests/tests/twins/maps.rs::maps_agree_with_their_twins",
            "tests/tests/twins/maps.rs::directions_come_back_in_single_precision",
        ],
        api: &[
            "clerestory::maps::octahedron::octahedron_perspective_encode",
            "clerestory::maps::octahedron::octahedron_perspective_decode",
            "clerestory::maps::Parametrization",
        ],
        settings: &["clerestory maps sky.hdr sky.exr --to octahedron-c=2"],
        ..Row::of(file!())
    },
];
