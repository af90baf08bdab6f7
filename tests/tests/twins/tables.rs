//! Functions that read tables: albedos, cumulative distributions, the environment; and choices that give their number back.

use clerestory::scene::Environment;
use clerestory::transport::albedo::{AlbedoTable, albedo_average, albedo_layer, albedo_lookup};
use clerestory::transport::choice::choose_first;
use clerestory::transport::distribution::{build_distribution, distribution_sample};
use clerestory::transport::environment::{EnvironmentTables, environment_direction, environment_uv};
use clerestory::transport::random::unit_float;
use clerestory::transport::warp::linear_sample;
use clerestory_tests::random::Random;
use clerestory_tests::twin::{Tolerance, U, compare, trigonometric_error};
use clerestory_tests::{twin_kernel, with_gpu};
use glam::{DVec4, Vec3};

use crate::{cases, direction, join, ulps, unit, v2, v3};

twin_kernel!(twin_tables);

/// A word as it travels, in two halves.
pub(super) fn halves(word: u32) -> [f32; 2] {
    [(word >> 16) as f32, (word & 0xffff) as f32]
}

fn random_word(r: &mut Random) -> [f32; 2] {
    halves(r.word())
}

pub(super) fn word(x: &[f64], i: usize) -> u32 {
    ((x[i] as u32) << 16) | x[i + 1] as u32
}

#[test]
fn albedos_agree_with_their_twins() {
    with_gpu(|gpu| {
        let albedos = AlbedoTable::shared();
        let table = cases(14, |r| {
            vec![
                f32::from_bits(r.below(9) as u32),
                r.choose(&[0.0, 1e-6, 0.01, 0.5, 0.99, 1.0]),
                r.choose(&[0.0, 9e-4, 1e-3, 0.02, 0.5, 1.0]),
                r.choose(&[0.0, 1.0, 1.33, 1.5, 3.0, 100.0]),
            ]
        });
        let results = twin_tables(gpu, 0, &table, &albedos.values);
        // A node and a weight of the interpolation carry u · 48 of the table's span each.
        compare("albedos", &table, &results, ulps(32.0, 4.0, 64.0 * U), 1..4, |x| {
            let layer = (x[0] as f32).to_bits() as usize;
            let (at, weight) = albedo_layer(x[3]);
            vec![
                albedo_lookup(albedos, layer, x[1], x[2]),
                albedo_average(albedos, layer, x[2]),
                at as f64 + weight,
            ]
        });
    });
}

#[test]
fn distributions_agree_with_their_twins() {
    with_gpu(|gpu| {
        let weights: Vec<f64> = (0..37)
            .map(|i| if i % 5 == 0 { 0.0 } else { f64::from(i * i % 11) + 1e-6 })
            .collect();
        let cdf = build_distribution("test", &weights).unwrap();
        let mut table = cases(15, |r| join(&[&[f32::from_bits(37)], &random_word(r), &random_word(r)]));
        let edges = cdf.iter().filter(|c| **c < 1.0).map(|c| (c / U as f32) as u32);
        let edges = edges.flat_map(|first| [first << 8, (first << 8).wrapping_sub(1)]);
        for (case, edge) in table.iter_mut().zip(edges) {
            case.0[1..3].copy_from_slice(&halves(edge));
        }
        for (case, result) in table.iter().zip(twin_tables(gpu, 1, &table, &cdf)) {
            let x = case.0.map(f64::from);
            let mut place = word(&x, 1);
            let (entry, probability) = distribution_sample(&cdf, 0, 37, &mut place, word(&x, 3));
            assert_eq!(
                (result.bits(0) as usize, result.0[1]),
                (entry, probability as f32),
                "{:?}",
                &case.0[..5]
            );
            assert!(weights[entry] > 0.0);
            // Four roundings of numbers below one, and the step of the word.
            let difference = (f64::from(result.0[2]) - unit_float(place)).abs();
            assert!(
                difference <= 4.0 * U && result.0[2] < 1.0,
                "{:?}: {difference}",
                &case.0[..5]
            );
        }
    });
}

#[test]
fn environments_agree_with_their_twins() {
    with_gpu(|gpu| {
        let mut map = Environment::uniform(Vec3::ONE);
        (map.width, map.height) = (16, 8);
        let radiance = |i: u32| Vec3::new(((i * 7) % 13) as f32, ((i * 5) % 11) as f32, (i % 3) as f32);
        map.radiance = (0..128).map(radiance).collect();
        let tables = EnvironmentTables::build(&map, true).unwrap();
        let emission_cdf = tables.emission_cdf.as_ref().unwrap();
        let make = |emission: u32| {
            cases(16, |r| {
                join(&[
                    &[f32::from_bits(16), f32::from_bits(8)],
                    &random_word(r),
                    &random_word(r),
                    &random_word(r),
                    &random_word(r),
                    &direction(r).to_array(),
                    &[unit(r), unit(r), tables.left_out, f32::from_bits(emission)],
                ])
            })
        };
        let trig = 4.0 * trigonometric_error(gpu);
        // Places in a cell are its size smaller than directions; radiance changes by 13 and density by less than one from side to side.
        let expect = |what: &str, got: [f32; 4], twin: DVec4, case: &[f32]| {
            for (got, twin) in got.into_iter().zip(twin.to_array()) {
                let difference = (f64::from(got) - twin).abs();
                assert!(difference < 16.0 * 13.0 * trig, "{what}: {got} {twin}, {case:?}");
            }
        };
        let floats = [bytemuck::cast_slice(&tables.texels), &emission_cdf[..]].concat();
        let table = make(1);
        for (case, result) in table.iter().zip(twin_tables(gpu, 4, &table, &floats)) {
            let w = v3(&case.0.map(f64::from), 10);
            let difference = (f64::from(result.0[0]) - tables.environment_emission_pdf(w)).abs();
            assert!(
                w.x.hypot(w.z) < 1e-2 || difference < 16.0 * 13.0 * trig,
                "{difference}: {:?}",
                case.0
            );
        }
        for (emission, cdf) in [(false, &tables.cdf), (true, emission_cdf)] {
            let table = make(emission.into());
            let floats = [bytemuck::cast_slice(&tables.texels), &cdf[..]].concat();
            for (case, result) in table.iter().zip(twin_tables(gpu, 2, &table, &floats)) {
                let x = case.0.map(f64::from);
                let (words, fresh) = ([word(&x, 2), word(&x, 4)], [word(&x, 6), word(&x, 8)]);
                let (w, found) = tables.environment_sample(emission, words, fresh);
                assert!(
                    (result.vector(0) - w).length() < trig,
                    "{} {w}: {:?}",
                    result.vector(0),
                    case.0
                );
                let r = result.0;
                expect("sample", [r[3], r[4], r[5], r[6]], found, &case.0);
                let seen = tables.environment_look_up(v3(&x, 10));
                let pole = x[10].hypot(x[12]) < 1e-2;
                if !pole {
                    expect("look-up", [r[7], r[8], r[9], r[10]], seen, &case.0);
                }
                let uv = environment_uv(v3(&x, 10));
                let (du, dv) = ((f64::from(r[11]) - uv.x).abs(), (f64::from(r[12]) - uv.y).abs());
                // At the poles the azimuth is not defined, and u is the same at 0 and 1.
                assert!((pole || du.min(1.0 - du) < trig) && dv < trig, "{:?}: {uv}", case.0);
                assert!((result.vector(13) - environment_direction(v2(&x, 13))).length() < trig);
            }
        }
    });
}

#[test]
fn choices_and_linear_densities_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(17, |r| {
            let ends = [0.0, 1e-20, 0.5, 1.0, 3e30];
            let (p, a) = (unit(r), r.choose(&ends));
            let b = if a == 0.0 {
                r.choose(&ends[1..])
            } else {
                r.choose(&ends)
            };
            vec![unit(r), p, a, b]
        });
        let results = twin_tables(gpu, 3, &table, &[]);
        // Where the number is just beyond the probability, what is left of it is as far off as a step of the two over what they leave.
        let tolerance = Tolerance {
            input_size: 1.0,
            ..ulps(8.0, 2.0, 4.0 * U)
        };
        compare("choices", &table, &results, tolerance, 0..2, |x| {
            let mut u = x[0];
            let first = choose_first(&mut u, x[1]);
            vec![f64::from(u8::from(first)), u, linear_sample(x[0], x[2], x[3])]
        });
    });
}
