//! Directions and places belong to each other, and derivatives are those of the direction.

use super::super::*;
use super::{angle, directions};
use crate::test_random::Random;

#[test]
fn directions_come_back_from_their_places() {
    for map in Parametrization::ALL {
        let mut held = 0;
        for d in directions(1, 20_000) {
            let Some(at) = map.encode(3.0 * d) else {
                assert!(map == Parametrization::Nusselt && d.z < 0.0, "{map}: {d}");
                continue;
            };
            held += 1;
            assert!(map.holds(at) || map.is_disc(), "{map}: {d} {at:?}");
            // On the rim of a disc rounding may lead outside it, and roots lose half of the digits.
            let at = MapPoint {
                uv: if map.is_disc() {
                    0.5 + (at.uv - 0.5) * (1.0 - 1e-16)
                } else {
                    at.uv
                },
                ..at
            };
            let Some(back) = map.decode(at) else {
                assert!(
                    map.is_disc() && ((2.0 * at.uv - 1.0).length() - 1.0).abs() < 1e-15,
                    "{map}: {d}"
                );
                continue;
            };
            let bound = match map {
                Parametrization::Sphere => 4e-15 / (1.0 + d.z).max(1e-15).sqrt(),
                Parametrization::Nusselt => 2e-15 / d.z.max(1e-8),
                _ => 4e-15,
            };
            assert!(angle(back, d) <= bound, "{map}: {d} came back as {back}");
            assert!((back.length() - 1.0).abs() < 1e-15 * 8.0, "{map}: {d}");
        }
        assert!(held > 10_000);
        for nothing in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY] {
            assert!(map.encode(nothing).is_none());
        }
    }
}

#[test]
fn places_come_back_from_their_directions() {
    let mut random = Random(2);
    for map in Parametrization::ALL {
        for _ in 0..5_000 {
            let at = MapPoint {
                layer: random.below(map.layers() as usize) as u32,
                uv: DVec2::new(f64::from(random.unit()), f64::from(random.unit())),
            };
            let rim = (2.0 * at.uv - 1.0).length() > 0.999;
            let Some(d) = map.decode(at).filter(|_| !(map.is_disc() && rim)) else {
                continue;
            };
            let back = map.encode(d).unwrap();
            assert_eq!(back.layer, at.layer, "{map}: {at:?}");
            let bound = if map == Parametrization::LatLong {
                1e-15 / at.uv.y.min(1.0 - at.uv.y).max(1e-9)
            } else {
                1e-13
            };
            assert!((back.uv - at.uv).length() < bound.max(1e-13), "{map}: {at:?} {back:?}");
        }
    }
}

#[test]
fn the_poles_and_axes_are_where_they_belong() {
    let at = |map: Parametrization, d: DVec3| map.encode(d).unwrap();
    for map in [
        Parametrization::OctahedronQuadratic,
        Parametrization::EqualArea,
        Parametrization::OctahedronPerspective { c: 2.0 },
    ] {
        assert_eq!(at(map, DVec3::Z).uv, DVec2::splat(0.5));
        assert_eq!(at(map, DVec3::X).uv, DVec2::new(1.0, 0.5));
        assert_eq!(at(map, DVec3::NEG_Y).uv, DVec2::new(0.5, 0.0));
        for (x, y, corner) in [
            (0.0, 0.0, DVec2::ONE),
            (-0.0, 0.0, DVec2::ONE),
            (-1e-300, 0.0, DVec2::Y),
        ] {
            assert_eq!(at(map, DVec3::new(x, y, -1.0)).uv, corner, "{map}");
        }
        for corner in [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE] {
            let d = map.decode(MapPoint { layer: 0, uv: corner }).unwrap();
            assert!(angle(d, DVec3::NEG_Z) < 1e-15, "{map}");
        }
    }
    let rectangle = Parametrization::OctahedronRectangular;
    assert_eq!(at(rectangle, DVec3::Z).uv, DVec2::new(0.25, 0.5));
    assert_eq!(at(rectangle, DVec3::NEG_Z).uv, DVec2::new(0.75, 0.5));
    let latitude = Parametrization::LatLong;
    assert_eq!(at(latitude, DVec3::X).uv, DVec2::new(0.0, 0.5));
    assert_eq!(at(latitude, DVec3::NEG_Y).uv, DVec2::new(0.75, 0.5));
    assert_eq!(
        (at(latitude, DVec3::Z).uv.y, at(latitude, DVec3::NEG_Z).uv.y),
        (0.0, 1.0)
    );
    // The faces of cube images, each by its centre; of equal components z counts before y before x.
    let cube = Parametrization::Cube;
    let axes = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    for (face, axis) in (0..).zip(axes) {
        assert_eq!(
            at(cube, axis),
            MapPoint {
                layer: face,
                uv: DVec2::splat(0.5)
            }
        );
    }
    assert_eq!(at(cube, DVec3::ONE).layer, 4);
    assert_eq!(at(cube, DVec3::new(-1.0, -1.0, 0.5)).layer, 3);
    // The table of the Vulkan specification: the coordinates of +x are −z and −y.
    assert!((at(cube, DVec3::new(1.0, 0.5, -0.25)).uv - DVec2::new(0.625, 0.25)).length() < 1e-15);
}

#[test]
fn derivatives_are_those_of_the_direction() {
    let mut random = Random(3);
    for map in Parametrization::ALL {
        let mut seen = 0;
        while seen < 500 {
            let at = MapPoint {
                layer: random.below(map.layers() as usize) as u32,
                uv: DVec2::new(f64::from(random.unit()), f64::from(random.unit())),
            };
            const H: f64 = 1e-6;
            let moved = |by: DVec2| map.decode(MapPoint { uv: at.uv + by, ..at });
            let ends = [DVec2::X, DVec2::Y].map(|axis| Some((moved(H * axis)? - moved(-H * axis)?) / (2.0 * H)));
            let p = (2.0 * at.uv - 1.0).abs();
            // Second derivatives are large at rims, poles of the equal-area map and folds.
            let near_fold = (p.x + p.y - 1.0).abs() < 1e-3 || p.min_element() < 1e-3 || (p.x - p.y).abs() < 1e-3;
            let wide = map == Parametrization::OctahedronRectangular;
            let q = DVec2::new(4.0 * at.uv.x - 2.0, 2.0 * at.uv.y - 1.0);
            let along = q.x.abs() - 1.0;
            let near_axis = wide && ((along - q.y).abs() < 1e-3 || (along + q.y).abs() < 1e-3);
            let at_rim = p.length() > 0.95
                || (map == Parametrization::EqualArea && (p.length() < 0.05 || p.min_element() > 0.95));
            let ([Some(a), Some(b)], false) = (ends, near_fold || near_axis || at_rim) else {
                continue;
            };
            seen += 1;
            let [along, down] = map.derivatives(at);
            assert!(
                (along - a).length() < 2e-7 && (down - b).length() < 2e-7,
                "{map} {at:?}: {along} {a}, {down} {b}"
            );
            let area = along.cross(down).length();
            let density = map.solid_angle_density(at.uv);
            assert!((area / density - 1.0).abs() < 1e-12, "{map} {at:?}: {area} {density}");
        }
    }
}

/// What the rasterizer draws straight is straight within an octant of the octahedron, and bent in the latitude–longitude map: by a texel in the mean of edges
/// between random places of an octant, and by a quarter of that where they are half as long.
#[test]
fn edges_are_straight_in_octants_and_bent_in_the_latitude_longitude_map() {
    let mut random = Random(26);
    let mut corner = || DVec3::new(random.unit().into(), random.unit().into(), random.unit().into());
    let edges: Vec<[DVec3; 2]> = (0..4000).map(|_| [corner(), corner()]).collect();
    // How far the image of an edge's middle is from the line between those of its ends, texels; of the middle part of each edge.
    let off = |map: Parametrization, size: UVec2, part: f64| {
        let image = |p: DVec3| map.encode(p).unwrap().uv * size.as_dvec2();
        let of = |[a, b]: &[DVec3; 2]| {
            let (middle, half) = (0.5 * (*a + *b), 0.5 * part * (*b - *a));
            let [from, to, at] = [middle - half, middle + half, middle].map(image);
            (at - from).perp_dot((to - from).normalize()).abs()
        };
        edges.iter().map(of).sum::<f64>() / edges.len() as f64
    };
    let straight = off(Parametrization::OctahedronQuadratic, UVec2::splat(128), 1.0);
    assert!(straight < 1e-9, "{straight}");
    let bent = [1.0, 0.5, 0.25].map(|part| off(Parametrization::LatLong, UVec2::new(182, 91), part));
    println!("off the line in the mean: {bent:?} texels");
    assert!((0.8..1.3).contains(&bent[0]), "{bent:?}");
    for pair in bent.windows(2) {
        assert!((3.5..4.5).contains(&(pair[0] / pair[1])), "{bent:?}");
    }
}
