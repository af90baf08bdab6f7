//! Maps of directions on the device: levels, borders, look-ups, summed-area tables and filtered maps against their twins.

use clerestory::gpu::{Gpu, compute_to_transfer, rw_compute_to_compute, transfer_to_compute};
use clerestory::maps::directional_map::DirectionalMap;
use clerestory::maps::prefilter::{PrefilterGgx, prefilter_ggx};
use clerestory::maps::spherical_sat::{SatNumbers, SatRange, SphericalSat, box_mean, sat_half_width};
use clerestory::maps::{MapImage, Parametrization};
use clerestory_tests::random::Random;
use clerestory_tests::with_gpu;
use glam::{DVec2, DVec3, UVec2, Vec3, Vec4};

const MAPS: [Parametrization; 4] = [
    Parametrization::OctahedronQuadratic,
    Parametrization::OctahedronRectangular,
    Parametrization::EqualArea,
    Parametrization::LatLong,
];

/// Half a unit in the last place of an f32, relatively.
const ROUNDING: f64 = 0.5 * f32::EPSILON as f64;

fn size(map: Parametrization, rows: u32) -> UVec2 {
    UVec2::new(rows * map.aspect(), rows)
}

fn unit(random: &mut Random) -> f32 {
    0.5 + 0.5 * random.signed()
}

fn noise(map: Parametrization, rows: u32) -> MapImage {
    let size = size(map, rows);
    let mut random = Random(31);
    let texels =
        (0..size.element_product()).map(|_| Vec3::new(unit(&mut random), unit(&mut random), unit(&mut random)));
    MapImage::new(map, size, texels.collect()).unwrap()
}

/// A dim sky with a sun of two texels.
fn sunny(map: Parametrization, rows: u32) -> MapImage {
    let dim = noise(map, rows);
    let mut texels: Vec<Vec3> = dim.texels().iter().map(|texel| *texel + 0.5).collect();
    let at = texels.len() / 3;
    texels[at] = Vec3::new(9e4, 8e4, 5e4);
    texels[at + 1] = Vec3::new(5e4, 4e4, 3e4);
    MapImage::new(map, dim.size(), texels).unwrap()
}

fn filled(gpu: &Gpu, image: &MapImage, levels: u32, border: u32) -> DirectionalMap {
    let map = DirectionalMap::new(gpu, image.map(), image.size(), levels, border).unwrap();
    map.upload(0, image).unwrap();
    map.fill_levels().unwrap();
    map
}

fn direction(random: &mut Random) -> Vec3 {
    loop {
        let v = Vec3::new(random.signed(), random.signed(), random.signed());
        if (0.1..1.0).contains(&v.length()) {
            return v.normalize();
        }
    }
}

fn relative(found: Vec3, expected: DVec3) -> f64 {
    ((found.as_dvec3() - expected) / expected).abs().max_element()
}

/// Borders are the bits of what they repeat, in every level and at every width.
#[test]
fn borders_are_texels_of_the_inside() {
    with_gpu(|gpu| {
        for map in MAPS {
            for border in [0, 1, 3] {
                let device = filled(gpu, &noise(map, 16), 3, border);
                for level in 0..3 {
                    let (extent, tile) = device.read_tile(level).unwrap();
                    let (expected, texels) = device.read(level).unwrap().to_strip(border).unwrap();
                    assert_eq!(extent, expected);
                    assert!(tile == texels, "{map}, border {border}, level {level}");
                }
            }
        }
    });
}

/// Each level is the mean by solid angle of the one before, and so keeps the integral over the sphere.
#[test]
fn levels_keep_the_integral() {
    with_gpu(|gpu| {
        for map in MAPS {
            let image = noise(map, 32);
            let device = filled(gpu, &image, 5, 1);
            assert_eq!(device.read(0).unwrap(), image);
            let before = image.integral();
            for level in 1..5 {
                let (fine, coarse) = (device.read(level - 1).unwrap(), device.read(level).unwrap());
                let twin = fine.coarser().unwrap();
                for (found, expected) in coarse.texels().iter().zip(twin.texels()) {
                    // Four weights, four products, six sums of positive terms, a quotient, and the twin's own rounding.
                    let off = relative(*found, expected.as_dvec3());
                    assert!(off < 16.0 * ROUNDING, "{map}, level {level}: {off}");
                }
                let off = ((coarse.integral() - before) / before).abs().max_element();
                assert!(off < 16.0 * f64::from(level) * ROUNDING, "{map}, level {level}: {off}");
            }
        }
    });
}

/// Look-ups are their twin's, with a border and without to the same bits, between levels too.
#[test]
fn look_ups_are_seamless() {
    with_gpu(|gpu| {
        let mut random = Random(32);
        for map in MAPS {
            let image = noise(map, 16);
            let [bordered, bare] = [1, 0].map(|border| filled(gpu, &image, 3, border));
            let mut queries: Vec<Vec4> = (0..600)
                .map(|i| direction(&mut random).extend((i % 9) as f32 * 0.25))
                .collect();
            // Along the seams of the lower half, at both sides.
            queries.extend((0..200).map(|i| {
                let d = direction(&mut random);
                let side = if i % 2 == 0 { 1e-6 } else { -1e-6 };
                Vec3::new(side, d.y, -d.z.abs()).normalize().extend((i % 3) as f32)
            }));
            let found = bordered.look_up(&queries).unwrap();
            assert!(found == bare.look_up(&queries).unwrap(), "{map}");
            let levels: Vec<MapImage> = (0..3).map(|level| bordered.read(level).unwrap()).collect();
            for (query, found) in queries.iter().zip(&found) {
                let d = query.truncate().as_dvec3();
                let (fine, part) = (query.w.floor() as usize, f64::from(query.w.fract()));
                let at = |level: usize| levels[level.min(2)].look_up(d).unwrap();
                let expected = at(fine).lerp(at(fine + 1), part);
                // Places are off by 10⁻⁶ of the map's 16 or 32 texels, and radiance changes by up to 1 a texel along each axis.
                let off = (found.as_dvec3() - expected).abs().max_element();
                assert!(off < 64e-6, "{map} {query}: {found} {expected}");
            }
        }
    });
}

/// What is left of radiance's jump over the seams of the square layout: nothing with a border, much where look-ups stop at the edge.
#[test]
fn seams_hold_no_energy() {
    with_gpu(|gpu| {
        let map = Parametrization::OctahedronQuadratic;
        let image = noise(map, 16);
        let device = filled(gpu, &image, 3, 1);
        let mut random = Random(33);
        for level in 0..3u32 {
            let pairs: Vec<[Vec4; 2]> = (0..256)
                .map(|_| {
                    let d = direction(&mut random);
                    [1e-6, -1e-6].map(|side| Vec3::new(side, d.y, -d.z.abs()).normalize().extend(level as f32))
                })
                .collect();
            let found = device.look_up(pairs.as_flattened()).unwrap();
            let held = device.read(level).unwrap();
            let clamped = |query: Vec4| {
                let at = map.encode(query.truncate().as_dvec3()).unwrap();
                let n = held.size().as_dvec2();
                let p = (at.uv * n).as_uvec2().min(held.size() - 1);
                held.texels()[(p.y * held.size().x + p.x) as usize].as_dvec3()
            };
            let (mut with, mut without) = (0.0, 0.0);
            for (pair, found) in pairs.iter().zip(found.chunks_exact(2)) {
                with += (found[0] - found[1]).as_dvec3().length_squared();
                without += (clamped(pair[0]) - clamped(pair[1])).length_squared();
            }
            let count = pairs.len() as f64;
            let (with, without) = ((with / count).sqrt(), (without / count).sqrt());
            // Twice 10⁻⁶ of slope and the places' error against differences of random texels.
            assert!(with < 64e-6 && without > 0.1, "level {level}: {with} {without}");
        }
    });
}

fn boxes(map: Parametrization, rows: u32, border: u32, random: &mut Random, count: usize) -> Vec<(Vec4, DVec2)> {
    (0..count)
        .map(|_| {
            let d = direction(random);
            let half = (0.5 + f64::from(unit(random)) * f64::from(border)) / f64::from(rows);
            let uv = map.encode(d.as_dvec3()).unwrap().uv;
            (d.extend(half as f32), uv)
        })
        .collect()
}

/// Means of boxes against sums of texels, under a sun; and what numbers are good for.
#[test]
fn tables_hold_means_of_boxes_under_a_sun() {
    with_gpu(|gpu| {
        let mut random = Random(34);
        for map in MAPS {
            let (rows, border) = (32, 12);
            let image = sunny(map, rows);
            let device = filled(gpu, &image, 1, border);
            let queries = boxes(map, rows, border, &mut random, 150);
            let asked: Vec<Vec4> = queries.iter().map(|(query, _)| *query).collect();
            let mut worst = Vec::new();
            for (numbers, subtract) in [
                (SatNumbers::Float, false),
                (SatNumbers::Float, true),
                (SatNumbers::TwoFloat, true),
                (SatNumbers::Fixed, false),
                (SatNumbers::Fixed, true),
            ] {
                let table = SphericalSat::new(gpu, &device, numbers, SatRange::of(&image, subtract)).unwrap();
                table.fill(&device).unwrap();
                let found = table.look_up(&asked).unwrap();
                let mut beyond: f64 = 0.0;
                for ((query, uv), found) in queries.iter().zip(&found) {
                    let half = f64::from(query.w);
                    let expected = box_mean(&image, border, *uv, half);
                    // Places are off by 10⁻⁶ of the map: what that changes, most at the sun's edges.
                    let moved = [(1e-6, 0.0, 0.0), (0.0, 1e-6, 0.0), (0.0, 0.0, 1e-6)].map(|(x, y, h)| {
                        let moved = box_mean(&image, border, *uv + DVec2::new(x, y), half + h);
                        (moved - expected).abs().max_element()
                    });
                    let mean = if subtract { image.integral().max_element() } else { 0.0 };
                    // Nine parts, their weights and the weights' sum, of radiance and, where it was taken off, of the mean.
                    let rounding = 64.0 * ROUNDING * (expected.max_element() + mean);
                    let allowed = 2.0 * moved.iter().sum::<f64>() + rounding;
                    beyond = beyond.max((found.as_dvec3() - expected).abs().max_element() / allowed);
                }
                println!("{map} {numbers:?}, mean off {subtract}: worst {beyond:.3} of what is allowed");
                worst.push((numbers, beyond));
            }
            for (numbers, beyond) in &worst {
                match numbers {
                    SatNumbers::Float => {}
                    _ => assert!(*beyond < 1.0, "{map} {numbers:?}: {beyond}"),
                }
            }
            assert!(
                worst[0].1 > 10.0,
                "plain floats are not known to be enough: {map} {}",
                worst[0].1
            );
        }
    });
}

/// A constant goes through every operation of every map as it is.
#[test]
fn constant_radiance_stays_constant() {
    with_gpu(|gpu| {
        let value = Vec3::new(0.1, 3.0, 2e4);
        let mut random = Random(35);
        for map in MAPS {
            let image = MapImage::from_fn(map, size(map, 16), |_| value.as_dvec3()).unwrap();
            let device = filled(gpu, &image, 3, 4);
            let target = DirectionalMap::new(gpu, map, size(map, 8), 1, 4).unwrap();
            let filter = PrefilterGgx::new(gpu, &device).unwrap();
            let mut recorder = gpu.recorder("filter").unwrap();
            recorder
                .pass("filter", |pass| {
                    filter.record(pass, (&device, 1), (&target, 0), 0.3)?;
                    pass.barrier(&[rw_compute_to_compute(target.texels())]);
                    target.record_border(pass, 0)?;
                    pass.barrier(&[compute_to_transfer(target.texels())]);
                    Ok(())
                })
                .unwrap();
            recorder.submit().unwrap().wait().unwrap();
            for texel in target.read_tile(0).unwrap().1 {
                // Sums of 128 and 64 terms, numerator and denominator.
                assert!(relative(texel, value.as_dvec3()) < 400.0 * ROUNDING, "{map}: {texel}");
            }
            for level in 0..3 {
                for texel in device.read_tile(level).unwrap().1 {
                    assert!(
                        relative(texel, value.as_dvec3()) < 20.0 * ROUNDING,
                        "{map}, level {level}: {texel}"
                    );
                }
            }
            let queries: Vec<Vec4> = (0..300)
                .map(|i| direction(&mut random).extend((i % 5) as f32 * 0.5))
                .collect();
            for found in device.look_up(&queries).unwrap() {
                assert!(relative(found, value.as_dvec3()) < 30.0 * ROUNDING, "{map}: {found}");
            }
            let queries: Vec<Vec4> = queries.iter().map(|q| q.truncate().extend(0.02 + 0.05 * q.w)).collect();
            for numbers in [SatNumbers::TwoFloat, SatNumbers::Fixed] {
                for subtract in [false, true] {
                    let table = SphericalSat::new(gpu, &device, numbers, SatRange::of(&image, subtract)).unwrap();
                    table.fill(&device).unwrap();
                    for found in table.look_up(&queries).unwrap() {
                        assert!(
                            relative(found, value.as_dvec3()) < 64.0 * ROUNDING,
                            "{map} {numbers:?}: {found}"
                        );
                    }
                }
            }
        }
    });
}

/// Filtered maps are their twins.
#[test]
fn filtered_maps_are_sums_over_the_lobe() {
    with_gpu(|gpu| {
        for map in MAPS {
            let image = sunny(map, 16);
            let source = filled(gpu, &image, 1, 1);
            let target = DirectionalMap::new(gpu, map, size(map, 8), 1, 1).unwrap();
            let filter = PrefilterGgx::new(gpu, &source).unwrap();
            for alpha in [0.2f32, 1.0] {
                let mut recorder = gpu.recorder("filter").unwrap();
                recorder
                    .pass("filter", |pass| {
                        pass.barrier(&[transfer_to_compute(target.texels())]);
                        filter.record(pass, (&source, 0), (&target, 0), alpha)?;
                        pass.barrier(&[compute_to_transfer(target.texels())]);
                        Ok(())
                    })
                    .unwrap();
                recorder.submit().unwrap().wait().unwrap();
                let expected = prefilter_ggx(&image, size(map, 8), alpha.into()).unwrap();
                for (found, expected) in target.read(0).unwrap().texels().iter().zip(expected.texels()) {
                    // Directions are off by 4·10⁻⁷, by which the lobe's logarithm changes up to 2/α times as much, at both ends; sums of 16
                    // and 32 terms.
                    let allowed = 4.0 * 4e-7 * 2.0 / f64::from(alpha) + 100.0 * ROUNDING;
                    // At the rim of the half space the cosine goes to 0, relatively without bound: such terms are small beside the sky's.
                    let off = relative(*found, expected.as_dvec3());
                    assert!(off < 4.0 * allowed, "{map} {alpha}: {found} {expected} {off}");
                }
            }
        }
    });
}

#[test]
fn maps_that_cannot_be_are_errors() {
    with_gpu(|gpu| {
        let octahedron = Parametrization::OctahedronQuadratic;
        for (map, size, levels, border) in [
            (Parametrization::Cube, UVec2::splat(8), 1, 0),
            (Parametrization::OctahedronPerspective { c: 2.0 }, UVec2::splat(8), 1, 0),
            (octahedron, UVec2::new(8, 4), 1, 0),
            (octahedron, UVec2::splat(8), 0, 0),
            (octahedron, UVec2::splat(8), 5, 0),
            (octahedron, UVec2::splat(12), 4, 0),
            (octahedron, UVec2::splat(8), 3, 3),
            (octahedron, UVec2::splat(1 << 15), 1, 0),
            (Parametrization::LatLong, UVec2::new(8, 8), 4, 0),
        ] {
            assert!(
                DirectionalMap::new(gpu, map, size, levels, border).is_err(),
                "{map} {size} {levels} {border}"
            );
        }
        let device = DirectionalMap::new(gpu, octahedron, UVec2::splat(8), 2, 1).unwrap();
        assert!(device.upload(2, &noise(octahedron, 2)).is_err() && device.upload(1, &noise(octahedron, 8)).is_err());
        assert!(device.read(2).is_err() && device.size(2).is_none());
        let range = SatRange {
            offset: Vec3::ZERO,
            deviation: f32::INFINITY,
        };
        assert!(SphericalSat::new(gpu, &device, SatNumbers::Fixed, range).is_err());
        assert!(sat_half_width(octahedron, DVec3::ZERO, 1.0).is_none());
    });
}
