//! Maps of directions: device and twin, and directions through a map and back in f32.

use clerestory::gpu::{BufferDesc, Category, Gpu};
use clerestory::maps::Parametrization;
use clerestory::maps::cube::*;
use clerestory::maps::equal_area::*;
use clerestory::maps::lat_long::*;
use clerestory::maps::level::*;
use clerestory::maps::nusselt::*;
use clerestory::maps::octahedron::*;
use clerestory::maps::packed_direction::*;
use clerestory::maps::paraboloid::*;
use clerestory::maps::sphere_map::*;
use clerestory::maps::topology::*;
use clerestory_tests::random::Random;
use clerestory_tests::shaders::maps_round_trip;
use clerestory_tests::twin::{Case, Tolerance, compare};
use clerestory_tests::{twin_kernel, with_gpu};
use glam::{DVec2, DVec3, IVec2, UVec2, Vec2, Vec3};

use crate::{cases, direction, join, list, shift, ulps, v2, v3};

twin_kernel!(twin_maps);

/// Coordinates, on a fold or an edge now and then.
fn place(r: &mut Random) -> Vec2 {
    let uv = Vec2::new(r.signed(), r.signed());
    match r.below(6) {
        0 => Vec2::new(uv.x, 1.0 - uv.x.abs()),
        1 => Vec2::new(r.choose(&[-1.0, 1.0]), uv.y),
        2 => Vec2::new(uv.x, r.choose(&[0.0, -0.0])),
        _ => uv,
    }
}

/// Coordinates well inside the disc, where roots keep their digits.
fn on_disc(r: &mut Random) -> Vec2 {
    loop {
        let uv = Vec2::new(r.signed(), r.signed());
        if uv.length() < 0.99 {
            return uv;
        }
    }
}

fn check(
    gpu: &Gpu,
    what: &str,
    function: u32,
    table: &[Case],
    tolerance: Tolerance,
    inputs: usize,
    twin: impl Fn(&[f64]) -> Vec<f64>,
) {
    let results = twin_maps(gpu, function, table, &[]);
    let worst = compare(what, table, &results, tolerance, 0..inputs, twin);
    println!("{what}: worst error {worst:.3} of what is allowed");
}

#[test]
fn maps_agree_with_their_twins() {
    with_gpu(|gpu| {
        // Coordinates are subtracted from one.
        let near_one = |absolute: f64| Tolerance {
            input_size: 1.0,
            ..ulps(8.0, 4.0, absolute)
        };
        let table = cases(40, |r| {
            let c = r.choose(&[0.5, 1.0, 2.0]);
            join(&[&direction(r).to_array(), &place(r).to_array(), &[c]])
        });
        check(gpu, "octahedra", 0, &table, near_one(0.0), 5, |x| {
            let (d, uv, c) = (v3(x, 0), v2(x, 3), x[5]);
            let wide = uv * DVec2::new(2.0, 1.0);
            list![
                octahedron_perspective_encode(d, c).to_array(),
                octahedron_perspective_decode(uv, c).to_array(),
                [octahedron_perspective_density(uv, c)],
                octahedron_rectangular_encode(d).to_array(),
                octahedron_rectangular_decode(wide).to_array(),
                [octahedron_rectangular_density(wide)],
            ]
        });
        let table = cases(41, |r| {
            let face = f32::from_bits(r.below(6) as u32);
            join(&[&direction(r).to_array(), &place(r).to_array(), &[face]])
        });
        check(gpu, "faces and discs", 1, &table, ulps(8.0, 4.0, 0.0), 5, |x| {
            let (d, uv, face) = (v3(x, 0), v2(x, 3), (x[5] as f32).to_bits());
            let ((on, at), (side, disc)) = (cube_encode(d), paraboloid_encode(d));
            list![
                at.to_array(),
                [f64::from(on)],
                cube_decode(face, uv).to_array(),
                [cube_density(uv)],
                disc.to_array(),
                [f64::from(side)],
                paraboloid_decode(face & 1, uv).to_array(),
                [paraboloid_density(uv)],
            ]
        });
        let table = cases(42, |r| join(&[&direction(r).to_array(), &on_disc(r).to_array()]));
        check(gpu, "discs with roots", 2, &table, ulps(8.0, 4.0, 0.0), 5, |x| {
            let (d, uv) = (v3(x, 0), v2(x, 3));
            list![
                sphere_map_encode(d).to_array(),
                sphere_map_decode(uv).to_array(),
                [sphere_map_density(uv)],
                nusselt_encode(d).to_array(),
                nusselt_decode(uv).to_array(),
                [nusselt_density(0.5 * uv)],
            ]
        });
        let table = cases(43, |r| join(&[&direction(r).to_array(), &place(r).to_array()]));
        // Cosines and sines are off by 10⁻⁷ each.
        check(gpu, "maps with trigonometry", 3, &table, near_one(4e-7), 5, |x| {
            let (d, uv) = (v3(x, 0), v2(x, 3));
            let unit = 0.5 + 0.5 * uv;
            list![
                lat_long_encode(d).to_array(),
                lat_long_decode(unit).to_array(),
                [lat_long_density(unit)],
                equal_area_encode(d).to_array(),
                equal_area_decode(uv).to_array(),
                [equal_area_density(uv)],
            ]
        });
    });
}

#[test]
fn levels_borders_and_words_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(44, |r| {
            let d = direction(r);
            let by = [r.vector() * r.magnitude(-10, -2), r.vector() * r.magnitude(-10, -2)];
            let near = by.map(|v| (d + v).normalize());
            let n = r.choose(&[16.0, 256.0, 1024.0]);
            let solid_angles = [r.magnitude(-12, 2), r.magnitude(-12, 2)];
            join(&[
                &d.to_array(),
                &by[0].to_array(),
                &by[1].to_array(),
                &near[0].to_array(),
                &near[1].to_array(),
                &[n],
                &solid_angles,
            ])
        });
        let results = twin_maps(gpu, 4, &table, &[]);
        // Logarithms are good to 3 units, near one to 2⁻²¹.
        let log = 4.0 / f64::from(1u32 << 21);
        compare("levels", &table, &results, ulps(8.0, 4.0, log), 0..9, |x| {
            let (d, by) = (v3(x, 0), [v3(x, 3), v3(x, 6)]);
            vec![
                octahedron_level(d, by, x[15]),
                octahedron_rectangular_level(d, by, x[15]),
            ]
        });
        let rest: Vec<_> = results.iter().map(|result| shift(result, 2)).collect();
        // Differences of coordinates cancel: the coordinates count as of size one.
        let of_differences = Tolerance {
            input_size: 1.0,
            ..ulps(8.0, 4.0, log)
        };
        compare("levels", &table, &rest, of_differences, 0..18, |x| {
            vec![
                octahedron_level_folded(v3(x, 0), v3(x, 9), v3(x, 12), x[15]),
                0.5 * (x[16] / x[17]).log2(),
            ]
        });

        let table = cases(45, |r| {
            let n = r.choose(&[2i32, 8, 32]);
            let mut at = |size: i32| (r.below(3 * size as usize) as i32 - size) as f32;
            // Beyond the square as far as it is wide.
            vec![at(n), at(n), 2.0 * n as f32, n as f32]
        });
        for (case, result) in table.iter().zip(twin_maps(gpu, 5, &table, &[])) {
            let x = case.0.map(|x| x as i32);
            let (p, size) = (IVec2::new(x[0], x[1]), IVec2::new(x[2], x[3]));
            let expected = [
                octahedron_wrap(p, IVec2::splat(size.y)),
                octahedron_rectangular_wrap(p, size),
                lat_long_wrap(p, size),
            ];
            let found = [0, 2, 4].map(|i| Vec2::from_slice(&result.0[i..]).as_ivec2());
            assert_eq!(found, expected, "{p} {size}");
        }

        let table = cases(48, |r| {
            let n = r.choose(&[1i32, 2, 7, 32]);
            // Beyond one edge at most, as far as the face is wide.
            let mut p = [r.below(n as usize) as i32, r.below(n as usize) as i32];
            p[r.below(2)] = r.below(3 * n as usize) as i32 - n;
            vec![p[0] as f32, p[1] as f32, f32::from_bits(r.below(6) as u32), n as f32]
        });
        for (case, result) in table.iter().zip(twin_maps(gpu, 7, &table, &[])) {
            let [x, y, face, n] = [case.0[0], case.0[1], case.0[2], case.0[3]];
            let size = UVec2::splat(n as u32);
            let expected = Parametrization::Cube
                .wrap(size, face.to_bits(), x as i32, y as i32)
                .unwrap();
            let found = result.0[..3].iter().map(|v| *v as u32).collect::<Vec<_>>();
            assert_eq!(found, [expected.layer, expected.x, expected.y], "({x}, {y}) of {n}");
        }

        for bits in [8u32, 12, 13, 15, 16] {
            let table = cases(46, |r| {
                let n = direction(r);
                let word = pack_octahedral(r.direction(), bits);
                join(&[&n.to_array(), &[f32::from_bits(bits), f32::from_bits(word)]])
            });
            let results = twin_maps(gpu, 6, &table, &[]);
            for (case, result) in table.iter().zip(&results) {
                let n = Vec3::from_slice(&case.0);
                let word = result.bits(0) | result.bits(1) << 16;
                let angle = unpack_octahedral(word, bits).angle_between(n.as_dvec3());
                let bound = packed_error(bits);
                assert!(angle < bound * (1.0 + bound) + 5e-7, "{bits} {n}: {angle}");
                let back = unpack_octahedral(case.0[4].to_bits(), bits);
                assert!((result.vector(2) - back).length() < 5e-7, "{bits} {n}");
            }
        }
    });
}

/// Directions through a map and back, on the device.
fn round_trip(gpu: &Gpu, map: u32, directions: &[Vec3]) -> Vec<Vec3> {
    let run = || -> clerestory::Result<Vec<Vec3>> {
        let pipeline = gpu.compute_pipeline::<maps_round_trip::Kernel>(&())?;
        let input = gpu.buffer_with("directions", Category::Work, directions)?;
        let bytes = size_of_val(directions) as u64;
        let output = gpu.buffer(&BufferDesc::storage("decoded", bytes, Category::Work))?;
        let direction_count = directions.len() as u32;
        let mut recorder = gpu.recorder("round trip")?;
        recorder.pass("round trip", |pass| {
            let set = maps_round_trip::Set0 {
                map_directions: input.view(),
                map_decoded: output.view(),
            };
            let push = maps_round_trip::Push { map, direction_count };
            pass.dispatch(&pipeline, &[&set], &push, [pipeline.groups_for(direction_count), 1, 1])
        })?;
        recorder.submit()?.wait()?;
        gpu.read(output.view(), directions.len())
    };
    run().unwrap_or_else(|error| panic!("{error}"))
}

/// 10⁶ directions, all of components −1, −0, 0 and 1 and many next to planes and axes among them.
fn many_directions() -> Vec<Vec3> {
    let sides = [-1.0, -0.0, 0.0, 1.0];
    let mut all = Vec::new();
    for x in sides {
        for y in sides {
            all.extend(sides.iter().filter_map(|z| Vec3::new(x, y, *z).try_normalize()));
        }
    }
    let mut random = Random(47);
    while all.len() < 1_000_000 {
        let mut d = random.direction();
        let axis = random.below(3);
        match random.below(8) {
            0 => d[axis] *= random.magnitude(-30, 0),
            1 => {
                d *= random.magnitude(-30, 0);
                d[axis] = random.choose(&[-1.0, 1.0]);
            }
            2 => d[axis] = random.choose(&[-0.0, 0.0]),
            3 => d[axis] = d[(axis + 1) % 3],
            _ => {}
        }
        all.push(d.normalize());
    }
    all
}

#[test]
fn directions_come_back_in_single_precision() {
    with_gpu(|gpu| {
        let directions = many_directions();
        for (index, map) in (0..).zip(Parametrization::ALL) {
            let decoded = round_trip(gpu, index, &directions);
            let (mut worst, mut overall) = (0.0f64, 0.0f64);
            for (d, back) in directions.iter().zip(decoded) {
                let (d, back) = (d.as_dvec3().normalize(), back.as_dvec3());
                if map == Parametrization::Nusselt && d.z < 0.0 {
                    continue;
                }
                let error = d.cross(back).length().atan2(d.dot(back));
                assert!(
                    (back.length() - 1.0).abs() < 1e-5 && error.is_finite(),
                    "{map} {d} {back}"
                );
                overall = overall.max(error);
                let counts = match map {
                    Parametrization::Sphere => d.z > -0.9,
                    Parametrization::Nusselt => d.z > 0.1,
                    _ => true,
                };
                worst = if counts { worst.max(error) } else { worst };
            }
            println!("{map}: {worst:.2e} rad where stated, {overall:.2e} anywhere");
            let bound = match map {
                Parametrization::Sphere => 3e-6,
                // Where z is 0.1, its error is ten times that of x² + y², which has the rounding of the input's length, too.
                Parametrization::Nusselt => 2e-6,
                _ => 1e-6,
            };
            assert!(worst < bound, "{map}: {worst}");
            // At the rim a root halves the digits, √(2⁻²³).
            assert!(overall < bound.max(1e-3), "{map}: {overall}");
        }
        let down = octahedron_encode(DVec3::NEG_Z);
        assert_eq!(down, DVec2::ONE);
    });
}
