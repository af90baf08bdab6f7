//! Forms that sources print and that must not be built, each with what goes wrong.

use super::super::lat_long::lat_long_encode;
use super::super::octahedron::*;
use super::super::sphere_map::*;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// The printed longitude, the arc tangent of y/x, is that of the opposite direction as well, and its latitude is not scaled to the map.
#[test]
fn a_longitude_of_a_quotient_folds_half_turns() {
    let printed = |d: DVec3| DVec2::new((d.y / d.x).atan(), d.z.acos());
    for d in super::directions(10, 500)
        .into_iter()
        .filter(|d| d.x != 0.0 && d.y != 0.0)
    {
        let behind = DVec3::new(-d.x, -d.y, d.z);
        assert_eq!(printed(d), printed(behind), "{d}");
        let [here, there] = [d, behind].map(lat_long_encode);
        assert!(((here.x - there.x).abs() - 0.5).abs() < 1e-14, "{d}: {here} {there}");
        assert!(
            (0.0..=1.0).contains(&here.y) && (printed(d).y - PI * here.y).abs() < 1e-7,
            "{d}"
        );
    }
    // The seam is in longitude: on both sides of the half plane y = 0, x > 0 the columns are the last and the first.
    let [above, below] = [1e-9, -1e-9].map(|y| lat_long_encode(DVec3::new(1.0, y, 0.2).normalize()));
    assert!(above.x < 1e-9 && below.x > 1.0 - 1e-9 && (above.y - below.y).abs() < 1e-15);
}

/// With sign(0) = 0 the direction −z lies in the middle, on +z, and the planes x = 0 and y = 0 of the lower half collapse.
#[test]
fn a_sign_of_zero_that_is_zero_folds_the_map_onto_itself() {
    let printed = |d: DVec3| {
        let sign = |x: f64| if x == 0.0 { 0.0 } else { x.signum() };
        let p = d.truncate() / d.abs().element_sum();
        if d.z < 0.0 {
            DVec2::new(sign(p.x) * (1.0 - p.y.abs()), sign(p.y) * (1.0 - p.x.abs()))
        } else {
            p
        }
    };
    assert_eq!(printed(DVec3::NEG_Z), printed(DVec3::Z));
    assert_eq!(octahedron_encode(DVec3::NEG_Z), DVec2::ONE);
    for x in [0.1, 0.5, 0.9] {
        let d = DVec3::new(x, 0.0, x - 1.0);
        assert!(octahedron_decode(printed(d)).dot(d.normalize()) < 0.999, "{d}");
        assert!(
            octahedron_decode(octahedron_encode(d)).distance(d.normalize()) < 1e-15,
            "{d}"
        );
    }
}

/// The lower branch as printed, σ(x)(1 − σ(y))y, is 0 wherever y > 0; as corrected it is the form without a branch.
#[test]
fn the_printed_lower_half_has_no_inverse() {
    for d in super::directions(7, 2000).into_iter().filter(|d| d.z < 0.0) {
        let p = d / d.abs().element_sum();
        let s = octahedron_signs(p.truncate());
        let printed = s.x * (1.0 - s.y) * p.y;
        assert!(p.y <= 0.0 || printed == 0.0);
        let branch_free = (d.truncate() + s * (-d.z).max(0.0)) / d.abs().element_sum();
        assert!((branch_free - octahedron_encode(d)).length() < 1e-15, "{d}");
    }
}

/// A central projection onto the octahedron is the planar map: the perspective family differs by its plane alone.
#[test]
fn the_planar_map_is_a_central_projection() {
    for d in super::directions(8, 1000) {
        assert_eq!(octahedron_perspective_encode(d, 1.0), octahedron_encode(d));
        for c in [0.5, 2.0] {
            let uv = octahedron_perspective_encode(d, c);
            let stretched = octahedron_encode(DVec3::new(d.x, d.y, c * d.z));
            assert!((uv - stretched).length() < 1e-15, "{d}");
        }
    }
}

/// The second half of the rectangle must be mirrored, or neither the middle nor the ends fit.
#[test]
fn a_second_half_that_is_not_mirrored_tears_the_rectangle() {
    let printed = |d: DVec3| {
        let p = d / d.abs().element_sum();
        let along = p.x - p.y;
        DVec2::new(if d.z < 0.0 { along + 1.0 } else { along - 1.0 }, p.x + p.y)
    };
    let mirrored = octahedron_rectangular_encode;
    let gap = |encode: &dyn Fn(DVec3) -> DVec2, d: DVec3| {
        let [above, below] = [1e-9, -1e-9].map(|z| encode(d.with_z(z)));
        let across = (above - below).abs();
        // The ends meet, at −2 and 2.
        DVec2::new(across.x.min(4.0 - across.x), across.y).length()
    };
    // The middle, between −y and x, and the ends.
    for d in [DVec3::new(0.7, -0.3, 0.0), DVec3::new(-0.2, 0.8, 0.0)] {
        assert!(gap(&mirrored, d) < 1e-8, "{d}");
        assert!(gap(&printed, d) > 1.0, "{d}: {}", gap(&printed, d));
    }
}

/// With the view (0, 0, −1), the reflection has z = 2n_z² − 1: the printed −x/√(2(1 − z)) is the map of the negated direction.
#[test]
fn the_printed_sphere_map_is_that_of_the_negated_direction() {
    let printed = |d: DVec3| -d.truncate() / (2.0 * (1.0 - d.z)).sqrt();
    for d in super::directions(9, 1000)
        .into_iter()
        .filter(|d| d.z < 0.9 && d.z > -0.9)
    {
        let uv = sphere_map_encode(d);
        let n = uv.extend((1.0 - uv.length_squared()).sqrt());
        let view = DVec3::NEG_Z;
        assert!((view - 2.0 * n.dot(view) * n - d).length() < 1e-13, "{d}");
        assert!((printed(-d) - uv).length() < 1e-13, "{d}");
        assert!((printed(d) - uv).length() > 1e-3 || d.truncate().length() < 1e-3, "{d}");
    }
    // Half of the disc's radius squared is the front.
    assert!((sphere_map_encode(DVec3::X).length_squared() - 0.5).abs() < 1e-15);
}

/// With w = 1 the attributes of a triangle are interpolated affinely; with the L1 norm they are right.
#[test]
fn attributes_need_the_homogeneous_coordinate() {
    let (a, b) = (DVec3::new(1.0, 0.2, 0.3), DVec3::new(0.5, 3.0, 2.0));
    let middle = 0.5 * (a + b);
    let [pa, pb, pm] = [a, b, middle].map(octahedron_encode);
    // Along the line in the map, the middle of the segment is not half way: its weight is that of the norms.
    let share = (pm - pa).length() / (pb - pa).length();
    assert!((share - 0.5).abs() > 0.1);
    let [wa, wb] = [a, b].map(|p| p.abs().element_sum());
    let right = share / wb / (share / wb + (1.0 - share) / wa);
    assert!((right - 0.5).abs() < 1e-14, "{right}");
    assert!(
        (pb - pa).perp_dot(pm - pa).abs() < 1e-15,
        "straight edges stay straight"
    );
}

/// Each octant's map is a matrix.
#[test]
fn matrices_of_octants_are_the_map() {
    for d in super::directions(4, 2000) {
        let signs = octahedron_signs(d.truncate()).extend(if d.z < 0.0 { -1.0 } else { 1.0 });
        let p = 3.0 * d;
        for (layout, uv) in [
            (OctahedronLayout::Quadratic, octahedron_encode(d)),
            (
                OctahedronLayout::Rectangular,
                octahedron_rectangular_encode(d) * DVec2::new(0.5, 1.0),
            ),
        ] {
            let clip = octant_matrix(layout, signs, 0.5, 10.0) * p.extend(1.0);
            assert!((clip.w - p.abs().element_sum()).abs() < 1e-14);
            assert!(
                (clip.truncate().truncate() / clip.w - uv).length() < 1e-15,
                "{d} {uv} {clip}"
            );
        }
    }
    let depth = |w: f64| {
        let clip = octant_matrix(OctahedronLayout::Quadratic, DVec3::ONE, 0.5, 10.0) * DVec3::X.extend(1.0 / w) * w;
        clip.z / clip.w
    };
    assert!(depth(0.5).abs() < 1e-15 && (depth(10.0) - 1.0).abs() < 1e-15);
}
