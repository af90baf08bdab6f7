//! Free flight, null collisions and equi-angular sampling.

use clerestory::transport::densest_band::{densest_band, densest_band_flight, passed_second_moment};
use clerestory::transport::medium::{
    FAR_AWAY, attenuated_length, collision_density, equi_angular, equi_angular_helps, equi_angular_pdf,
    equi_angular_sample, sample_free_flight, sample_null_collision,
};
use clerestory_tests::random::Random;
use clerestory_tests::twin::{Tolerance, U, trigonometric_error};
use clerestory_tests::with_gpu;
use glam::DVec3;

use crate::{cases, check, direction, join, list, ulps, unit, v3};

/// Probabilities of the bands, one of them zero now and then.
fn bands(r: &mut Random) -> [f32; 3] {
    let weights = [r.unit(), r.unit() + 0.1, r.choose(&[0.0, 0.3, 1.0])];
    weights.map(|w| w / weights.iter().sum::<f32>())
}

/// Zero or one as the bits of a number, as kernels hand it out.
fn flag(on: bool) -> f64 {
    f64::from(f32::from_bits(u32::from(on)))
}

#[test]
fn free_flight_agrees_with_its_twin() {
    with_gpu(|gpu| {
        let table = cases(21, |r| {
            let sigma_t: [f32; 3] = std::array::from_fn(|_| r.choose(&[0.0, 1e-4, 0.3, 1.0, 7.0, 1e4]));
            let albedo = r.unit();
            let t_max = r.choose(&[1e-3, 0.5, 20.0, FAR_AWAY as f32]);
            join(&[
                &sigma_t.map(|s| s * albedo),
                &sigma_t,
                &bands(r),
                &[t_max, unit(r), unit(r)],
            ])
        });
        // The logarithm has an absolute error near 1, where short flights are: 2^-21 by Vulkan's rules, relative to the mean free path;
        // the exponentials' is relative to their exponent of at most 17.
        let tolerance = Tolerance {
            input_size: 1.0,
            ..ulps(256.0, 8.0, 0.0)
        };
        check(gpu, "free flight", 12, &table, tolerance, 11, |x| {
            let f = sample_free_flight(v3(x, 0), v3(x, 3), v3(x, 6), x[9], [x[10], x[11]]);
            list![
                [f.t, flag(f.collides)],
                f.weight.to_array(),
                f.bands.to_array(),
                [
                    collision_density(v3(x, 3), v3(x, 6), f.t),
                    attenuated_length(x[3], x[9])
                ],
            ]
        });
    });
}

#[test]
fn equi_angular_samples_and_null_collisions_agree_with_their_twins() {
    with_gpu(|gpu| {
        let trig = trigonometric_error(gpu);
        let table = cases(22, |r| {
            let place: [f32; 6] = std::array::from_fn(|_| r.range(-4.0, 4.0));
            let t_max = r.choose(&[0.1, 1.0, 8.0, FAR_AWAY as f32]);
            let real: [f32; 3] = std::array::from_fn(|_| r.choose(&[0.0, 0.2, 0.7, 1.0]));
            let scattered = real.map(|x| 0.5 * x);
            join(&[
                &place[..3],
                &direction(r).to_array(),
                &place[3..],
                &[t_max, unit(r), r.range(0.0, 5.0)],
                &bands(r),
                &real,
                &scattered,
                &[r.choose(&[0.0, 0.1, 1.0, 10.0])],
            ])
        });
        // The angle under which a segment is seen, and its sine and cosine, are each wrong by the device's trigonometric error; of angles of
        // 1/16 and more that is up to 64 times as much of the number that chooses among them. Smaller ones are more exact on drivers
        // whose error is relative there, and looked at by their density in `medium.rs`.
        let tolerance = Tolerance {
            input_size: 1.0,
            ..ulps(64.0, 64.0 * (1.0 + trig / U), trig)
        };
        check(
            gpu,
            "equi-angular samples, null collisions",
            13,
            &table,
            tolerance,
            12,
            |x| {
                let e = equi_angular(v3(x, 0), v3(x, 3), x[9], v3(x, 6));
                let t = equi_angular_sample(e, x[9], x[10]);
                let (collides, bands, weight) =
                    sample_null_collision(v3(x, 15), v3(x, 18), x[10], v3(x, 12), DVec3::ONE);
                list![
                    [
                        e.along,
                        e.off,
                        e.range,
                        t,
                        equi_angular_pdf(e, x[11]) * e.range,
                        flag(collides)
                    ],
                    bands.to_array(),
                    weight.to_array(),
                    [flag(equi_angular_helps(e, x[9], x[21]))],
                ]
            },
        );
    });
}

#[test]
fn flights_by_the_densest_band_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(23, |r| {
            let sigma_t: [f32; 3] = std::array::from_fn(|_| r.choose(&[0.0, 1e-4, 0.3, 1.0, 7.0]));
            let albedo = r.unit();
            let t_max = r.choose(&[1e-3, 0.5, 4.0]);
            join(&[
                &sigma_t.map(|s| s * albedo),
                &sigma_t,
                &[t_max, unit(r), r.range(0.0, 2.0)],
                &bands(r),
            ])
        });
        // As of free flight, with exponents of at most 28.
        let tolerance = Tolerance {
            input_size: 1.0,
            ..ulps(256.0, 8.0, 0.0)
        };
        check(gpu, "flights by the densest band", 19, &table, tolerance, 12, |x| {
            let f = densest_band_flight(v3(x, 0), v3(x, 3), x[6], x[7]);
            list![
                [f.t, flag(f.collides)],
                f.weight.to_array(),
                densest_band(v3(x, 3)).to_array(),
                passed_second_moment(v3(x, 3), v3(x, 9), x[8]).to_array(),
            ]
        });
    });
}
