//! Solid angles of texels: that they sum to the sphere's, and that they are the integral of the density.

use super::super::*;
use crate::test_random::Random;
use std::f64::consts::PI;

const GAUSS: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 5.0 / 18.0),
    (0.0, 4.0 / 9.0),
    (0.774_596_669_241_483_4, 5.0 / 18.0),
];

#[test]
fn texels_sum_to_the_sphere() {
    for map in Parametrization::ALL {
        for height in [1, 2, 3, 7, 8, 64] {
            for width in [height * map.aspect(), height + 3] {
                let size = UVec2::new(width, height);
                let sum: f64 = map.texels(size).map(|texel| map.texel_solid_angle(size, texel)).sum();
                assert!((sum - map.solid_angle()).abs() < 1e-11, "{map} {size}: {sum}");
            }
        }
        let mut per_layer = vec![0.0; map.layers() as usize];
        let size = UVec2::splat(32);
        for texel in map.texels(size) {
            per_layer[texel.layer as usize] += map.texel_solid_angle(size, texel);
        }
        for layer in &per_layer {
            assert!(
                (layer - map.solid_angle() / f64::from(map.layers())).abs() < 1e-12,
                "{map}"
            );
        }
    }
}

/// Quadrature of the density, adaptive to folds and rims by halving.
fn integral(map: Parametrization, lower: DVec2, upper: DVec2, depth: u32) -> f64 {
    let extent = upper - lower;
    if depth > 0 {
        let middle = 0.5 * (lower + upper);
        return integral(map, lower, middle, depth - 1)
            + integral(map, middle, upper, depth - 1)
            + integral(
                map,
                DVec2::new(middle.x, lower.y),
                DVec2::new(upper.x, middle.y),
                depth - 1,
            )
            + integral(
                map,
                DVec2::new(lower.x, middle.y),
                DVec2::new(middle.x, upper.y),
                depth - 1,
            );
    }
    let mut sum = 0.0;
    for (a, wa) in GAUSS {
        for (b, wb) in GAUSS {
            let uv = lower + extent * (0.5 + 0.5 * DVec2::new(a, b));
            let inside = map.holds(MapPoint { layer: 0, uv });
            sum += if inside {
                wa * wb * map.solid_angle_density(uv)
            } else {
                0.0
            };
        }
    }
    sum * extent.x * extent.y
}

#[test]
fn rectangles_have_the_integral_of_the_density() {
    let mut random = Random(5);
    for map in Parametrization::ALL {
        for _ in 0..20 {
            let corner = |r: &mut Random| DVec2::new(f64::from(r.unit()), f64::from(r.unit()));
            let (a, b) = (corner(&mut random), corner(&mut random));
            let (mut lower, mut upper) = (a.min(b), a.max(b));
            if map.is_disc() && map == Parametrization::Nusselt {
                // The density is not bounded at the rim: inside it.
                (lower, upper) = (0.5 + 0.6 * (lower - 0.5), 0.5 + 0.6 * (upper - 0.5));
            }
            let (exact, found) = (map.rectangle_solid_angle(lower, upper), integral(map, lower, upper, 6));
            // The rim is met with 64 × 3 points across. At folds, which some 200 cells of side up to 1/64 contain, the density's slope changes
            // by up to 60: h³ times a thirtieth of that each.
            let bound = if map.is_disc() { 2e-3 } else { 2e-4 };
            assert!((exact - found).abs() < bound, "{map} {lower} {upper}: {exact} {found}");
        }
    }
    // Of parts, to rounding.
    for map in Parametrization::ALL {
        for _ in 0..200 {
            let [mut x, mut y] = [(); 2].map(|()| [(); 3].map(|()| f64::from(random.unit())));
            x.sort_by(f64::total_cmp);
            y.sort_by(f64::total_cmp);
            let part = |i: usize, j: usize, k: usize, l: usize| {
                map.rectangle_solid_angle(DVec2::new(x[i], y[j]), DVec2::new(x[k], y[l]))
            };
            let parts = part(0, 0, 1, 1) + part(1, 0, 2, 1) + part(0, 1, 1, 2) + part(1, 1, 2, 2);
            assert!((parts - part(0, 0, 2, 2)).abs() < 4e-14, "{map} {x:?} {y:?}");
        }
    }
    // Nusselt's whole rim.
    let map = Parametrization::Nusselt;
    let cap = |r: f64| map.rectangle_solid_angle(DVec2::splat(0.5 - 0.5 * r), DVec2::splat(0.5 + 0.5 * r));
    assert!((cap(1.0) - 2.0 * PI).abs() < 1e-14);
    assert!(cap(0.8) < 2.0 * PI && cap(0.8) > 2.0 * PI * (1.0 - (1.0f64 - 0.64).sqrt()));
}

/// What midpoints give in place of exact solid angles, as the source's tables say.
#[test]
fn midpoint_sums_are_off_as_stated() {
    let off = |map: Parametrization, n: u32| {
        let size = UVec2::new(n * map.aspect(), n);
        let area = 1.0 / size.as_dvec2().element_product();
        let held = map
            .texels(size)
            .map(|texel| texel.centre(size))
            .filter(|at| map.holds(*at));
        let sum: f64 = held.map(|at| map.solid_angle_density(at.uv) * area).sum();
        (sum / map.solid_angle() - 1.0).abs()
    };
    for (n, stated) in [(8, 5.1e-5), (16, 1.8e-6), (64, 7.5e-9)] {
        let found = off(Parametrization::OctahedronQuadratic, n);
        assert!((found / stated - 1.0).abs() < 0.05, "{n}: {found}");
    }
    let worst = |n: u32| {
        let (map, size) = (Parametrization::OctahedronQuadratic, UVec2::splat(n));
        let area = 1.0 / f64::from(n * n);
        let of = |texel: Texel| {
            map.solid_angle_density(texel.centre(size).uv) * area / map.texel_solid_angle(size, texel) - 1.0
        };
        map.texels(size).map(|texel| of(texel).abs()).fold(0.0, f64::max)
    };
    for (n, stated) in [(8, 0.19), (64, 0.03), (512, 0.004)] {
        let found = worst(n);
        assert!((found / stated - 1.0).abs() < 0.2, "{n}: {found}");
    }
    for (map, stated) in [
        (Parametrization::Cube, 1e-6),
        (Parametrization::LatLong, 2e-6),
        (Parametrization::DualParaboloid, 1e-5),
        (Parametrization::Sphere, 2e-5),
        (Parametrization::Nusselt, 5e-4),
    ] {
        // Stated to one digit.
        let found = off(map, 512);
        assert!((found / stated - 1.0).abs() < 0.25, "{map}: {found}");
    }
}
