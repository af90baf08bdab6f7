//! Lobes as boxes: the staircase against closed forms, borders that are wide enough, and lobes over folds and edges.

use super::super::box_lobe::*;
use super::super::prefilter::prefilter_ggx;
use super::super::spherical_sat::SatImage;
use super::super::*;
use super::directions;
use crate::test_random::Random;
use glam::Vec3;
use std::f64::consts::TAU;

const MAPS: [Parametrization; 4] = [
    Parametrization::OctahedronQuadratic,
    Parametrization::OctahedronRectangular,
    Parametrization::EqualArea,
    Parametrization::LatLong,
];

const LOBES: [Lobe; 6] = [
    Lobe::Ggx { alpha: 0.05 },
    Lobe::Ggx { alpha: 0.3 },
    Lobe::Ggx { alpha: 1.0 },
    Lobe::Phong { exponent: 0.0 },
    Lobe::Phong { exponent: 1.0 },
    Lobe::Phong { exponent: 200.0 },
];

fn size(map: Parametrization, rows: u32) -> UVec2 {
    UVec2::new(rows * map.aspect(), rows)
}

/// ∫ (lobe/∫lobe − staircase)² ds over ∫ (lobe/∫lobe)² ds, by midpoints.
fn squared_error(lobe: Lobe, boxes: &[WeightedBox]) -> f64 {
    const STEPS: u32 = 200_000;
    // Even in the fifth root of the solid angle, so that narrow lobes have as many as wide ones.
    let at = |step: f64| TAU * (step / f64::from(STEPS)).powi(5);
    let cells = || {
        (0..STEPS).map(|i| {
            let (from, to) = (at(i.into()), at(f64::from(i) + 1.0));
            (0.5 * (from + to), to - from)
        })
    };
    let whole: f64 = cells().map(|(s, width)| width * lobe.value(s / TAU)).sum();
    let (mut error, mut squares) = (0.0, 0.0);
    for (s, width) in cells() {
        let held = boxes.iter().filter(|one| one.solid_angle > s);
        let stairs: f64 = held.map(|one| one.weight / one.solid_angle).sum();
        let value = lobe.value(s / TAU) / whole;
        error += width * (value - stairs).powi(2);
        squares += width * value * value;
    }
    error / squares
}

#[test]
fn weights_share_the_lobe() {
    for lobe in LOBES {
        for count in 1..=MAX_STEPS {
            let boxes = box_lobe(lobe, count).unwrap();
            let sum: f64 = boxes.iter().map(|one| one.weight).sum();
            assert!(boxes.len() == count && (sum - 1.0).abs() < 1e-12, "{lobe:?}: {sum}");
            assert!(boxes.iter().all(|one| one.weight >= 0.0), "{lobe:?}: {boxes:?}");
            assert!(
                boxes.is_sorted_by(|a, b| a.solid_angle < b.solid_angle) && boxes[count - 1].solid_angle <= TAU + 1e-9,
                "{lobe:?}: {boxes:?}"
            );
            // Rings divide the same staircase: as much within each of its steps.
            let rings = ring_lobe(lobe, count).unwrap();
            let sum: f64 = rings.iter().map(|one| one.weight).sum();
            let whole: f64 = rings.iter().map(|one| one.solid_angle).sum();
            assert!(rings.len() == RING_BOXES[0] + (count - 1) * RING_BOXES[1] && (sum - 1.0).abs() < 1e-12);
            assert!((whole / boxes[count - 1].solid_angle - 1.0).abs() < 1e-12);
            let middle: DVec3 = rings.iter().map(|one| one.weight * one.direction).sum();
            assert!(
                middle.truncate().length() < 1e-12 && middle.z > 0.0,
                "{lobe:?}: {middle}"
            );
            assert!(
                rings
                    .iter()
                    .all(|one| (one.direction.length() - 1.0).abs() < 1e-12 && one.weight >= 0.0)
            );
        }
    }
    for (lobe, count) in [
        (Lobe::Ggx { alpha: 0.0 }, 1),
        (Lobe::Ggx { alpha: f64::NAN }, 1),
        (Lobe::Phong { exponent: -1.0 }, 1),
        (LOBES[0], 0),
        (LOBES[0], MAX_STEPS + 1),
    ] {
        assert!(box_lobe(lobe, count).is_err(), "{lobe:?} {count}");
    }
}

#[test]
fn the_staircase_is_the_best_one() {
    // A lobe that is a box is one.
    let half_space = box_lobe(Lobe::Phong { exponent: 0.0 }, 1).unwrap()[0];
    assert!((half_space.solid_angle / TAU - 1.0).abs() < 1e-12);
    // A cosine falls evenly with the cap: of x = S/2π one step leaves 1/x − 4 + 2x, least at √½; caps are chosen from some hundred.
    let cosine = box_lobe(Lobe::Phong { exponent: 1.0 }, 1).unwrap()[0];
    assert!(
        (cosine.solid_angle / TAU - 0.5f64.sqrt()).abs() < 5e-3,
        "{}",
        cosine.solid_angle / TAU
    );
    for lobe in LOBES.into_iter().filter(|lobe| *lobe != Lobe::Phong { exponent: 0.0 }) {
        let errors: Vec<f64> = [1, 2, 4, 8]
            .map(|count| squared_error(lobe, &box_lobe(lobe, count).unwrap()))
            .to_vec();
        println!("{lobe:?}: {errors:?}");
        // n steps leave 1/n² of the square: of twice the steps a quarter, from a few on. Two levels, the zero outside included, count as
        // one more step.
        for pair in errors.windows(2) {
            assert!(pair[1] < 0.5 * pair[0], "{lobe:?}: {errors:?}");
        }
        assert!(errors[3] < 0.02, "{lobe:?}: {errors:?}");
        // Others do not do better.
        let best = box_lobe(lobe, 3).unwrap();
        let least = squared_error(lobe, &best);
        let mut random = Random(41);
        for _ in 0..20 {
            let mut other = best.clone();
            let one = random.below(3);
            other[one].solid_angle *= 1.0 + 0.2 * f64::from(random.signed());
            let by = 0.1 * f64::from(random.signed());
            other[one].weight += by;
            other[(one + 1) % 3].weight -= by;
            // The grid of caps leaves a hundredth.
            assert!(squared_error(lobe, &other) > 0.98 * least, "{lobe:?}: {other:?}");
        }
    }
}

fn noise(map: Parametrization, rows: u32) -> MapImage {
    let mut random = Random(42);
    let count = size(map, rows).element_product();
    let texels = (0..count).map(|_| Vec3::new(random.unit(), random.unit(), 1e4f32.powf(random.unit())));
    MapImage::new(map, size(map, rows), texels.collect()).unwrap()
}

/// No box of a lobe leaves the border that is said to be enough, and some leave a narrower one.
#[test]
fn borders_hold_the_largest_box() {
    for map in MAPS {
        let image = noise(map, 32);
        let boxes = box_lobe(Lobe::Ggx { alpha: 0.12 }, 3).unwrap();
        let border = sat_border(map, image.size(), &boxes).unwrap();
        let at = |border| SatImage::new(&image, border).unwrap();
        let (wide, enough) = (at(32), at(border));
        // Uniform directions, and those at the map's edges.
        let mut all = directions(43, 500);
        all.extend((0..200).map(|i| {
            let along = f64::from(i) / 199.0;
            let uv = [
                DVec2::new(along, 0.0),
                DVec2::new(1.0, along),
                DVec2::new(along, 1.0),
                DVec2::new(0.0, along),
            ];
            map.decode(MapPoint {
                layer: 0,
                uv: uv[i as usize % 4],
            })
            .unwrap()
        }));
        let worst = |table: &SatImage| {
            let off = |d: &DVec3| {
                let right = wide.sat_lobe(map, *d, &boxes).unwrap();
                ((table.sat_lobe(map, *d, &boxes).unwrap() - right) / right)
                    .abs()
                    .max_element()
            };
            all.iter().map(off).fold(0.0, f64::max)
        };
        // The boxes at the poles of the latitude–longitude map are as wide as it is.
        let bounded = map != Parametrization::LatLong;
        assert_eq!(border < 16, bounded, "{map}: {border}");
        assert!(worst(&enough) < 1e-9, "{map}, {border}: {}", worst(&enough));
        assert!(
            !bounded || worst(&at(border - 2)) > 1e-3,
            "{map}, {border}: {}",
            worst(&at(border - 2))
        );
    }
    let boxes = box_lobe(LOBES[1], 1).unwrap();
    assert!(sat_border(Parametrization::Cube, UVec2::splat(8), &boxes).is_err());
    assert!(sat_border(Parametrization::Sphere, UVec2::splat(8), &boxes).is_err());
}

/// What a lobe sees of light that changes slowly, by how far its direction is from the folds and edges of the map.
#[test]
fn lobes_on_folds_and_edges_are_as_good_as_elsewhere() {
    let light = |d: DVec3| DVec3::new(2.0 + d.x + d.y * d.z, 2.0 + d.z, 2.0 - d.y + d.x * d.x);
    for map in [
        Parametrization::OctahedronQuadratic,
        Parametrization::OctahedronRectangular,
        Parametrization::EqualArea,
    ] {
        let image = MapImage::from_fn(map, size(map, 64), |texel| {
            light(map.texel_direction(size(map, 64), texel).unwrap())
        })
        .unwrap();
        for (alpha, rings) in [(0.1, false), (0.3, false), (0.1, true), (0.3, true)] {
            let lobe = Lobe::Ggx { alpha };
            let boxes = if rings { ring_lobe(lobe, 4) } else { box_lobe(lobe, 4) }.unwrap();
            let border = sat_border(map, image.size(), &boxes).unwrap();
            let table = SatImage::new(&image, border).unwrap();
            // The lobe's own mean at texels of a small map.
            let small = size(map, 24);
            let truth = prefilter_ggx(&image, small, alpha).unwrap();
            let (mut near, mut far) = (Vec::new(), Vec::new());
            for texel in map.texels(small) {
                let d = map.texel_direction(small, texel).unwrap();
                let off = (table.sat_lobe(map, d, &boxes).unwrap() - truth.at(texel).as_dvec3()).length_squared();
                // Folds and edges lie on the planes of the axes.
                let into = if d.abs().min_element() < 0.1 {
                    &mut near
                } else {
                    &mut far
                };
                into.push(off);
            }
            let rms = |all: &[f64]| (all.iter().sum::<f64>() / all.len() as f64).sqrt();
            println!(
                "{map}, α = {alpha}, rings {rings}: {:.2e} near folds, {:.2e} elsewhere",
                rms(&near),
                rms(&far)
            );
            // Boxes bend there, and stay what they are: boxes that ended at the edge would miss up to half of their light.
            assert!(rms(&near) < 3.0 * rms(&far), "{map} {alpha}");
        }
    }
}

/// Under a sun, of which large boxes show the squares: rings are nearer to the lobe than as many steps about one middle.
#[test]
fn rings_follow_the_lobe() {
    let sun = DVec3::new(0.5, 0.7, 0.51).normalize();
    for map in [Parametrization::OctahedronQuadratic, Parametrization::EqualArea] {
        let image = MapImage::from_fn(map, size(map, 96), |texel| {
            let d = map.texel_direction(size(map, 96), texel).unwrap();
            DVec3::splat(1.0 + 100.0 * (300.0 * (d.dot(sun) - 1.0)).exp())
        })
        .unwrap();
        let table = SatImage::new(&image, 96).unwrap();
        for alpha in [0.05, 0.1] {
            let lobe = Lobe::Ggx { alpha };
            let truth = prefilter_ggx(&image, size(map, 16), alpha).unwrap();
            let rms = |boxes: &[WeightedBox]| {
                let off = |texel: Texel| {
                    let d = map.texel_direction(size(map, 16), texel).unwrap();
                    (table.sat_lobe(map, d, boxes).unwrap().x - f64::from(truth.at(texel).x)).powi(2)
                };
                let all: f64 = map.texels(size(map, 16)).map(off).sum();
                (all / 256.0).sqrt()
            };
            let one = rms(&box_lobe(lobe, 1).unwrap());
            let nested = rms(&box_lobe(lobe, 4).unwrap());
            let rings = [1, 2, 4].map(|steps| rms(&ring_lobe(lobe, steps).unwrap()));
            println!("{map}, α = {alpha}: one box {one:.3}, four {nested:.3}, rings {rings:.3?}");
            assert!(
                nested < one && rings[2] < 0.6 * nested && rings[2] < rings[1],
                "{map} {alpha}"
            );
        }
    }
}

#[test]
fn constant_radiance_is_constant_through_every_lobe() {
    for map in MAPS {
        let image = MapImage::from_fn(map, size(map, 16), |_| DVec3::new(0.25, 1.0, 6.0)).unwrap();
        let table = SatImage::new(&image, 8).unwrap();
        for lobe in LOBES {
            let boxes = box_lobe(lobe, 5).unwrap();
            for d in directions(44, 50) {
                let found = table.sat_lobe(map, d, &boxes).unwrap();
                let off = (found / DVec3::new(0.25, 1.0, 6.0) - 1.0).abs().max_element();
                assert!(off < 1e-9, "{map} {lobe:?} {d}: {found}");
            }
        }
        assert!(
            table
                .sat_lobe(map, DVec3::ZERO, &box_lobe(LOBES[0], 1).unwrap())
                .is_none()
        );
    }
}
