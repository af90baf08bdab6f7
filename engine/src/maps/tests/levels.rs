//! Levels of detail: no seam, and the mirrored direction only where it helps.

use super::super::level::*;
use super::super::octahedron::*;
use super::super::*;
use crate::test_random::Random;

const TEXELS: f64 = 256.0;

/// A quad about a direction: two tangents of some length.
fn tangents(d: DVec3, turn: f64, lengths: [f64; 2]) -> [DVec3; 2] {
    let (a, b) = d.any_orthonormal_pair();
    let (sin, cos) = turn.sin_cos();
    [lengths[0] * (cos * a + sin * b), lengths[1] * (cos * b - sin * a)]
}

/// The level by the singular values of the exact derivative, from the decode's side.
#[test]
fn octant_derivatives_are_the_inverse_of_the_maps() {
    let mut random = Random(8);
    for _ in 0..2000 {
        let d = random.direction().as_dvec3().normalize();
        let by = tangents(d, f64::from(random.range(0.0, 6.0)), [1e-3, 2e-3]);
        for (map, found, extent) in [
            (
                Parametrization::OctahedronQuadratic,
                octahedron_derivatives(2.0 * d, by.map(|v| 2.0 * v)),
                DVec2::splat(2.0),
            ),
            (
                Parametrization::OctahedronRectangular,
                octahedron_rectangular_derivatives(2.0 * d, by.map(|v| 2.0 * v)),
                DVec2::new(4.0, 2.0),
            ),
        ] {
            let [along, down] = map.derivatives(map.encode(d).unwrap());
            for (uv, v) in found.into_iter().zip(by) {
                let uv = uv / extent;
                assert!((uv.x * along + uv.y * down - v).length() < 1e-15, "{map} {d}");
            }
        }
    }
}

/// Smooth over all seams: neighbouring pixels differ by at most a level, as the kink between octants does.
#[test]
fn the_octants_own_map_has_no_seams() {
    let mut random = Random(9);
    let mut worst = [0.0f64; 2];
    for _ in 0..20_000 {
        let d = random.direction().as_dvec3().normalize();
        // Near the planes of the folds.
        let d = if random.below(2) == 0 {
            d.with_x(1e-6 * d.x).normalize()
        } else {
            d.with_z(1e-6 * d.z).normalize()
        };
        let by = tangents(d, f64::from(random.range(0.0, 6.0)), [1e-3, 1e-3]);
        let near = (d + by[0]).normalize();
        let jump = |level: fn(DVec3, [DVec3; 2], f64) -> f64| (level(d, by, TEXELS) - level(near, by, TEXELS)).abs();
        worst = [
            worst[0].max(jump(octahedron_level)),
            worst[1].max(jump(octahedron_rectangular_level)),
        ];
    }
    println!("{worst:?}");
    assert!(worst.iter().all(|jump| *jump < 1.0), "{worst:?}");
}

/// Differences of coordinates see a huge step where a quad straddles the lower seams; the lesser of two levels repairs it, gated so that
/// a quad on the equator is not taken for a fine one.
#[test]
fn the_mirrored_direction_repairs_the_lower_seams() {
    let plain = |quad: [DVec3; 3]| {
        let [here, across, down] = quad.map(|v| 0.5 * TEXELS * octahedron_encode(v));
        level_of_derivatives(across - here, down - here)
    };
    let ungated = |quad: [DVec3; 3]| plain(quad).min(plain(quad.map(|v| v.with_z(v.z.abs()))));
    let mut random = Random(10);
    let (mut without, mut with) = (0.0f64, [0.0f64; 2]);
    let (mut too_fine, mut too_fine_ungated) = (0.0f64, 0.0f64);
    for i in 0..40_000 {
        let mut d = random.direction().as_dvec3().normalize();
        let seam = i % 2 == 0;
        d = if seam {
            d.with_x(3e-3 * d.x).with_z(-d.z.abs())
        } else {
            d.with_z(3e-3 * d.z)
        }
        .normalize();
        let lengths = if random.below(2) == 0 {
            [0.016, 0.002]
        } else {
            [0.002, 0.016]
        };
        let by = tangents(d, f64::from(random.range(0.0, 6.3)), lengths);
        let quad = [d, (d + by[0]).normalize(), (d + by[1]).normalize()];
        let exact = octahedron_level(d, by, TEXELS);
        let folded = octahedron_level_folded(quad[0], quad[1], quad[2], TEXELS);
        if seam && quad.iter().all(|v| v.z < 0.0) {
            without = without.max(plain(quad) - exact);
            with = [with[0].max(folded - exact), with[1].max(exact - folded)];
        } else if !seam {
            too_fine = too_fine.max(exact - folded);
            too_fine_ungated = too_fine_ungated.max(exact - ungated(quad));
        }
    }
    println!(
        "seams: {without:.2} levels too coarse without, {with:?} with; equator: too fine by {too_fine:.2}, ungated {too_fine_ungated:.2}"
    );
    assert!(without > 3.0 && with[0] < 1.3 && with[1] < 1.3, "{without} {with:?}");
    assert!(
        too_fine < 1.3 && too_fine_ungated > 2.0,
        "{too_fine} {too_fine_ungated}"
    );
}

#[test]
fn cones_have_the_level_of_their_texels() {
    for map in Parametrization::ALL {
        let size = UVec2::new(64 * map.aspect(), 64);
        for d in super::directions(3, 200).into_iter().filter(|d| d.z > 0.1 && d.z < 0.9) {
            let at = map.encode(d).unwrap();
            let texel = map.solid_angle_density(at.uv) / size.as_dvec2().element_product();
            assert!(map.cone_level(size, d, texel).unwrap().abs() < 1e-12);
            assert!((map.cone_level(size, d, 16.0 * texel).unwrap() - 2.0).abs() < 1e-12);
        }
    }
}
