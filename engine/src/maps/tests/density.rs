//! The tables of density of T. Engelhardt's thesis (2013, chapters 5 and 7), to the digits given.

use super::super::statistics::anisotropy;
use super::super::*;
use std::f64::consts::PI;

fn ratio(map: Parametrization, d: DVec3) -> f64 {
    map.density_ratio(map.encode(d).unwrap())
}

fn near(found: f64, stated: f64, digits: i32) {
    assert!(
        (found - stated).abs() <= 0.5000001 * 10f64.powi(-digits),
        "{found}, stated {stated}"
    );
}

const OCTAHEDRA: [Parametrization; 2] = [
    Parametrization::OctahedronQuadratic,
    Parametrization::OctahedronRectangular,
];

#[test]
fn extremes_are_where_the_table_says() {
    let (face, edge) = (DVec3::ONE, DVec3::new(1.0, 0.0, 1.0));
    near(ratio(Parametrization::LatLong, DVec3::X), 1.571, 3);
    assert!(ratio(Parametrization::LatLong, DVec3::Z) < 1e-12);
    // Where it is as the mean, in radians of latitude.
    let latitude = 0.8807f64;
    near(
        ratio(
            Parametrization::LatLong,
            DVec3::new(latitude.cos(), 0.0, latitude.sin()),
        ),
        1.0,
        4,
    );
    for d in [DVec3::Z, edge, face, DVec3::X] {
        assert!((ratio(Parametrization::Sphere, d) - 1.0).abs() < 1e-15);
    }
    near(ratio(Parametrization::Cube, DVec3::X), 1.910, 3);
    near(ratio(Parametrization::Cube, edge), 0.675, 3);
    near(ratio(Parametrization::Cube, face), 0.3676, 4);
    near(
        ratio(Parametrization::Cube, DVec3::X) / ratio(Parametrization::Cube, face),
        27f64.sqrt(),
        12,
    );
    assert!((1.0 / ratio(Parametrization::Cube, face) - 2.721).abs() < 1e-3);
    let paraboloid = Parametrization::DualParaboloid;
    near(ratio(paraboloid, DVec3::Z), 2.0, 12);
    near(ratio(paraboloid, DVec3::X), 0.5, 12);
    near(ratio(paraboloid, DVec3::Z) / paraboloid.coverage(), 2.546, 3);
    near(ratio(paraboloid, DVec3::X) / paraboloid.coverage(), 0.637, 3);
    for map in OCTAHEDRA {
        for vertex in [DVec3::X, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z] {
            near(ratio(map, vertex), 1.0 / PI, 12);
        }
        near(ratio(map, face), 27f64.sqrt() / PI, 12);
        near(ratio(map, DVec3::new(-1.0, 1.0, -1.0)), 1.654, 3);
    }
    assert!((ratio(Parametrization::EqualArea, face) - 1.0).abs() < 1e-15);
}

/// Figures 5.1 to 5.4: ratios along a great circle from the pole of the map.
#[test]
fn ratios_along_great_circles_are_those_of_the_figures() {
    let circle = |degrees: u32| {
        let at = f64::from(degrees).to_radians();
        DVec3::new(at.sin(), 0.0, at.cos())
    };
    for degrees in 0..=360 {
        let d = circle(degrees);
        let of = |map| ratio(map, d);
        near(of(Parametrization::LatLong), 0.5 * PI * d.x.abs(), 12);
        near(of(Parametrization::Sphere), 1.0, 12);
        // Through the middles of faces and edges the cube is never off by a factor of two.
        let cube = of(Parametrization::Cube);
        near(cube, 6.0 / PI * d.abs().max_element().powi(3), 12);
        assert!(
            (0.675..1.910).contains(&cube) && cube < 2.0 && 1.0 / cube < 1.482,
            "{degrees}: {cube}"
        );
        // From the middle of a disc to its rim, by ρ = tan of half the angle.
        let rho = d.x.abs() / (1.0 + d.z.abs());
        near(of(Parametrization::DualParaboloid), 2.0 / (1.0 + rho * rho).powi(2), 12);
        for map in OCTAHEDRA {
            // 1/‖p‖³ of the mean π, with p on the octahedron.
            near(of(map), d.abs().element_sum().powi(3) / PI, 12);
        }
    }
    assert!((1.0 / ratio(Parametrization::Cube, DVec3::new(1.0, 0.0, 1.0)) - 1.481).abs() < 1e-3);
}

#[test]
fn statistics_are_those_of_the_table() {
    let of = |map: Parametrization, n: u32| map.density_statistics(UVec2::new(n * map.aspect(), n));
    for (map, min, max, rms) in [
        (Parametrization::LatLong, 0.0, PI / 2.0, 0.483),
        (Parametrization::Sphere, 1.0, 1.0, 0.0),
        (Parametrization::Cube, 0.3675, 1.910, 0.380),
        (Parametrization::DualParaboloid, 0.5, 2.0, 0.408),
        (Parametrization::OctahedronQuadratic, 1.0 / PI, 1.654, 0.327),
        (Parametrization::OctahedronRectangular, 1.0 / PI, 1.654, 0.327),
        (Parametrization::EqualArea, 1.0, 1.0, 0.0),
    ] {
        let found = of(map, 256);
        println!("{map}: {found:?}");
        near(found.rms, rms, 3);
        assert!(
            (found.min_ratio - min).abs() < 0.01 && (found.max_ratio - max).abs() < 0.01,
            "{map}"
        );
        assert!(
            (found.coverage - map.coverage()).abs() < 1e-9 && (found.solid_angle - 4.0 * PI).abs() < 1e-9,
            "{map}"
        );
    }
    let found = of(Parametrization::OctahedronQuadratic, 512);
    assert!(
        (found.min_ratio * PI - 1.0).abs() < 0.01 && (found.max_ratio / 1.654 - 1.0).abs() < 0.01,
        "{found:?}"
    );
    assert!((found.rms - 0.327).abs() < 0.002);
}

#[test]
fn the_perspective_family_is_best_at_one() {
    for (c, min, max, rms) in [
        (0.5, 0.080, 2.149, 0.571),
        (0.5f64.sqrt(), 0.159, 1.779, 0.403),
        (1.0, 1.0 / PI, 1.654, 0.327),
        (2f64.sqrt(), 0.225, 1.801, 0.411),
        (2.0, 0.159, 2.339, 0.621),
    ] {
        let map = Parametrization::OctahedronPerspective { c };
        let found = map.density_statistics(UVec2::splat(256));
        println!("c = {c:.3}: {found:?}");
        // Texels average what varies within them, second order in their size.
        assert!((found.rms - rms).abs() < 0.5e-3 + 1e-4, "{c}: {}", found.rms);
        // Extremes of points, which those of texels approach.
        let (mut least, mut most) = (f64::INFINITY, 0.0f64);
        const STEPS: u32 = 2048;
        for i in 0..=STEPS {
            for (x, y) in [(i, i), (i, 0), (2 * i, i)] {
                let uv = (UVec2::new(x.min(STEPS), y).as_dvec2() / f64::from(STEPS) + 1.0) * 0.5;
                let ratio = map.density_ratio(MapPoint { layer: 0, uv });
                (least, most) = (least.min(ratio), most.max(ratio));
            }
        }
        near(least, min, 3);
        near(most, max, 3);
    }
}

#[test]
fn anisotropies_are_those_of_the_table() {
    let at = |map: Parametrization, d: DVec3| {
        anisotropy(map.texel_derivatives(UVec2::new(map.aspect(), 1), map.encode(d).unwrap()))
    };
    for rho in [0.0, 0.5f64.sqrt(), 0.99] {
        let map = Parametrization::Sphere;
        let uv = DVec2::new(0.5 + 0.5 * rho, 0.5);
        let found = anisotropy(map.derivatives(MapPoint { layer: 0, uv }));
        assert!((found * (1.0 - rho * rho) - 1.0).abs() < 1e-9, "{rho}: {found}");
    }
    for d in [DVec3::Z, DVec3::new(0.3, -0.4, 0.5), DVec3::new(0.3, 0.8, -0.1)] {
        assert!((at(Parametrization::DualParaboloid, d) - 1.0).abs() < 1e-7);
    }
    near(at(Parametrization::Cube, DVec3::ONE), 3f64.sqrt(), 12);
    for map in OCTAHEDRA {
        near(at(map, DVec3::new(1.0, -1.0, -1.0)), 3f64.sqrt(), 12);
        let most = map.density_statistics(UVec2::new(256 * map.aspect(), 256)).anisotropy;
        // At the vertices of the equator, which texels approach.
        assert!((0.0..0.03).contains(&(0.5 * (3.0 + 5f64.sqrt()) - most)), "{most}");
    }
    near(at(Parametrization::OctahedronQuadratic, DVec3::Z), 1.0, 12);
    near(at(Parametrization::OctahedronQuadratic, DVec3::X), 2.618, 3);
}
