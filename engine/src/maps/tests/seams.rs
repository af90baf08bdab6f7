//! Borders and seams: look-ups go over edges as if there were none.

use super::super::topology::*;
use super::super::*;
use super::{angle, directions};
use crate::test_random::Random;
use glam::IVec2;

const BORDERED: [Parametrization; 6] = [
    Parametrization::LatLong,
    Parametrization::Cube,
    Parametrization::OctahedronQuadratic,
    Parametrization::OctahedronRectangular,
    Parametrization::OctahedronPerspective { c: 0.5 },
    Parametrization::EqualArea,
];

/// The border rules: the texel outside is the one inside, by the directions on the edge that both touch.
#[test]
fn border_texels_touch_what_they_repeat() {
    for map in BORDERED {
        for n in [2i32, 8, 9, 16] {
            let size = UVec2::new(n as u32 * map.aspect(), n as u32);
            let (w, h) = (size.x as i32, size.y as i32);
            for layer in 0..map.layers() {
                for i in 0..w.max(h) {
                    for (x, y, edge) in [
                        (w, i, (1.0, f64::from(i) + 0.5)),
                        (-1, i, (0.0, f64::from(i) + 0.5)),
                        (i, h, (f64::from(i) + 0.5, 1.0)),
                        (i, -1, (f64::from(i) + 0.5, 0.0)),
                    ] {
                        let side = x == w || x < 0;
                        if (side && i >= h) || (!side && i >= w) {
                            continue;
                        }
                        let uv = if side {
                            DVec2::new(edge.0, edge.1 / f64::from(h))
                        } else {
                            DVec2::new(edge.0 / f64::from(w), edge.1)
                        };
                        let on_edge = map.decode(MapPoint { layer, uv }).unwrap();
                        let Some(inside) = map.wrap(size, layer, x, y) else {
                            assert!(map == Parametrization::LatLong && w % 2 == 1, "{map}");
                            continue;
                        };
                        // The texel inside has that point of the edge on its own edge: its rectangle's sides come within rounding.
                        let [lower, upper] = inside.bounds(size);
                        let middle = 0.5 * (lower + upper);
                        let sides = [
                            middle.with_x(lower.x),
                            middle.with_x(upper.x),
                            middle.with_y(lower.y),
                            middle.with_y(upper.y),
                        ];
                        let least = sides
                            .map(|uv| {
                                map.decode(MapPoint {
                                    layer: inside.layer,
                                    uv,
                                })
                                .unwrap()
                            })
                            .map(|d| angle(d, on_edge))
                            .into_iter()
                            .fold(f64::INFINITY, f64::min);
                        assert!(least < 1e-7, "{map} {size} ({x}, {y}) -> {inside:?}: {least}");
                    }
                }
            }
        }
    }
}

#[test]
fn rules_are_as_written_at_any_depth() {
    let n = IVec2::splat(8);
    for (outside, inside) in [
        ((8, 3), (7, 4)),
        ((10, 3), (5, 4)),
        ((-1, 0), (0, 7)),
        ((3, 8), (4, 7)),
        ((3, -2), (4, 1)),
        // Corners are the opposite ones' insides.
        ((8, 8), (0, 0)),
        ((-1, -1), (7, 7)),
        ((9, -1), (1, 7)),
    ] {
        assert_eq!(octahedron_wrap(outside.into(), n), IVec2::from(inside), "{outside:?}");
    }
    let n = IVec2::new(16, 8);
    for (outside, inside) in [
        ((16, 3), (0, 3)),
        ((-1, 3), (15, 3)),
        ((2, 8), (13, 7)),
        ((2, -3), (13, 2)),
    ] {
        assert_eq!(
            octahedron_rectangular_wrap(outside.into(), n),
            IVec2::from(inside),
            "{outside:?}"
        );
    }
    assert_eq!(lat_long_wrap(IVec2::new(3, -1), n), IVec2::new(11, 0));
    assert_eq!(
        (border_levels(0), border_levels(1), border_levels(4), border_levels(7)),
        (None, Some(0), Some(2), Some(2))
    );
    let map = Parametrization::OctahedronQuadratic;
    assert!(map.wrap(UVec2::splat(8), 0, 16, 0).is_none() && map.wrap(UVec2::splat(8), 1, 0, 0).is_none());
    assert!(map.wrap(UVec2::new(8, 4), 0, 8, 0).is_none());
    assert!(Parametrization::Cube.wrap(UVec2::splat(8), 0, 8, 8).is_none());
    assert!(Parametrization::Sphere.wrap(UVec2::splat(8), 0, 8, 0).is_none());
}

/// A border of the square layout continues the directions: texel by texel, they are what the map has beyond the edge when the octant's own
/// rule goes on. Wrapping twice leads back.
#[test]
fn wrapping_is_one_to_one() {
    for n in [4i32, 8] {
        let size = IVec2::splat(n);
        for y in -n..2 * n {
            for x in -n..2 * n {
                let inside = octahedron_wrap(IVec2::new(x, y), size);
                assert!(inside.cmpge(IVec2::ZERO).all() && inside.cmplt(size).all(), "{x} {y}");
            }
        }
        // Across one edge and back across the edge it came in by.
        for j in 0..n {
            let inside = octahedron_wrap(IVec2::new(n, j), size);
            assert_eq!(octahedron_wrap(IVec2::new(n, inside.y), size), IVec2::new(n - 1, j));
        }
    }
}

/// For directions 10⁻⁶ apart anywhere, most near seams, the bilinear look-up of (x, y, z) itself differs by less than two texels; with the
/// border it is also near the direction.
#[test]
fn look_ups_are_continuous_over_seams() {
    const N: u32 = 32;
    for map in Parametrization::ALL {
        let size = UVec2::new(N * map.aspect(), N);
        let texel = 2.0 / f64::from(N);
        let look_up = |d: DVec3| -> Option<DVec3> {
            let taps = map.taps(size, d)?;
            let sum: f64 = taps.iter().map(|tap| tap.weight).sum();
            assert!((sum - 1.0).abs() < 1e-14);
            let part = |tap: &taps::Tap| {
                (tap.weight > 0.0).then(|| tap.weight * map.texel_direction(size, tap.texel).unwrap())
            };
            Some(taps.iter().filter_map(part).sum())
        };
        let mut random = Random(6);
        let mut all = directions(6, 2000);
        // On the planes of the folds, of the cube's edges and of the equator.
        for _ in 0..2000 {
            let d = random.direction().as_dvec3();
            let (s, zero) = (d.abs().max_element(), 1e-9);
            all.extend([
                d.with_x(zero).normalize(),
                d.with_y(-zero).normalize(),
                d.with_z(zero).normalize(),
                DVec3::new(s, d.y, s).normalize(),
                DVec3::new(d.x, s, -s).normalize(),
                DVec3::new(zero * d.x, zero * d.y, d.z.signum()).normalize(),
            ]);
        }
        let mut worst = (0.0f64, 0.0f64);
        for d in all {
            let near = (d + 1e-6 * random.vector().as_dvec3()).normalize();
            let (Some(a), Some(b)) = (look_up(d), look_up(near)) else {
                continue;
            };
            worst = (worst.0.max((a - b).length()), worst.1.max((a - d).length()));
        }
        println!(
            "{map}: jump {:.4} texels, off by {:.3} texels",
            worst.0 / texel,
            worst.1 / texel
        );
        let bound = match map {
            // The rim of discs has no border: there a look-up is of the nearest texels.
            _ if map.is_disc() => continue,
            _ => 2.0 * texel,
        };
        assert!(worst.0 < bound && worst.1 < bound, "{map}: {worst:?}");
        if BORDERED.contains(&map) && map != Parametrization::Cube {
            // Continuous: a jump is no larger than the derivative allows. Beyond the cube's corners a texel is missing.
            assert!(worst.0 < 1e-4, "{map}: {worst:?}");
        }
    }
}

/// Borders that are refused are those that have texels without any to repeat.
#[test]
fn borders_are_refused_where_nothing_repeats() {
    for map in Parametrization::ALL {
        for (width, height) in [(8, 8), (7, 7), (16, 8), (9, 4)] {
            let size = UVec2::new(width, height);
            if map.check_size(size).is_err() {
                continue;
            }
            for border in 0..=9 {
                let corners = [-(border as i32), height as i32 + border as i32 - 1];
                // In a middle column, where the cube too has neighbours.
                let repeats = corners.iter().all(|y| map.wrap(size, 0, 2, *y).is_some());
                let is_legal = map.check_border(size, border).is_ok();
                let narrow = border <= width.min(height);
                assert_eq!(is_legal, narrow && (border == 0 || repeats), "{map} {size} {border}");
                let image = MapImage::from_fn(map, size, |_| DVec3::ONE).unwrap();
                assert_eq!(image.to_strip(border).is_ok(), is_legal, "{map} {size} {border}");
            }
        }
    }
}
