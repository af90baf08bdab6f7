//! Functions that read tables: albedos, cumulative distributions, the environment.

use clerestory::transport::albedo::{AlbedoTable, albedo_average, albedo_layer, albedo_lookup};
use clerestory::transport::distribution::{build_distribution, build_distribution_2d, distribution_sample};
use clerestory::transport::environment::{environment_direction, environment_sample, environment_uv};
use clerestory_tests::twin::{U, compare, trigonometric_error};
use clerestory_tests::{twin_kernel, with_gpu};
use glam::UVec2;

use crate::{cases, direction, join, ulps, unit, v2, v3};

twin_kernel!(twin_tables);

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
        let mut table = cases(15, |r| vec![f32::from_bits(37), unit(r)]);
        for (case, edge) in table.iter_mut().zip(cdf.iter().filter(|c| **c < 1.0)) {
            case.0[1] = *edge;
        }
        for (case, result) in table.iter().zip(twin_tables(gpu, 1, &table, &cdf)) {
            let (entry, probability) = distribution_sample(&cdf, 0, 37, f64::from(case.0[1]));
            assert_eq!(
                (result.bits(0) as usize, result.0[1]),
                (entry, probability as f32),
                "{:?}",
                case.0[1]
            );
            assert!(weights[entry] > 0.0);
        }
    });
}

#[test]
fn environments_agree_with_their_twins() {
    with_gpu(|gpu| {
        let size = UVec2::new(16, 8);
        let weights: Vec<f64> = (0..128).map(|i| f64::from((i * 7) % 13)).collect();
        let cdf = build_distribution_2d("test", size, &weights).unwrap();
        let table = cases(16, |r| {
            join(&[
                &[
                    f32::from_bits(16),
                    f32::from_bits(8),
                    unit(r),
                    unit(r),
                    unit(r),
                    unit(r),
                ],
                &direction(r).to_array(),
            ])
        });
        let results = twin_tables(gpu, 2, &table, &cdf);
        for (case, result) in table.iter().zip(&results) {
            let x = case.0.map(f64::from);
            let (w, texel, _) = environment_sample(&cdf, 0, size, v2(&x, 2), v2(&x, 4));
            assert_eq!([result.bits(4), result.bits(5)], texel.to_array(), "{:?}", case.0);
            let trig = 4.0 * trigonometric_error(gpu);
            assert!((result.vector(0) - w).length() < trig, "{} {w}", result.vector(0));
            let uv = environment_uv(v3(&x, 6));
            let (du, dv) = (
                (f64::from(result.0[6]) - uv.x).abs(),
                (f64::from(result.0[7]) - uv.y).abs(),
            );
            // At the poles the azimuth is not defined, and u is the same at 0 and 1.
            let pole = x[6].hypot(x[8]) < 1e-2;
            assert!((pole || du.min(1.0 - du) < trig) && dv < trig, "{:?}: {uv}", case.0);
            assert!((result.vector(9) - environment_direction(v2(&x, 4))).length() < trig);
        }
    });
}
