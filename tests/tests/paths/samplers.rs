//! What the device's samplers draw, against their densities: chi-square tests of 131,072 draws each from the device's own random numbers.
//!
//! Seeds are fixed. Each check has a false-alarm rate of 10⁻⁶ (`clerestory_tests::statistics`), some forty of them: below 5·10⁻⁵
//! for a driver that was never seen before. Draws of one Sobol' pixel are stratified, so their counts are too even for the test; those are
//! drawn one sample per pixel.

mod scattering;

use std::f64::consts::{PI, TAU};

use clerestory::gpu::Gpu;
use clerestory::scene::Environment;
use clerestory::transport::distribution::build_distribution;
use clerestory::transport::environment::{EnvironmentTables, environment_direction};
use clerestory::transport::ggx::ggx_visible_pdf;
use clerestory::transport::random::SamplerKind;
use clerestory_tests::shaders::types::RandomCase;
use clerestory_tests::statistics::{FALSE_ALARM, chi_square_test, expect_counts};
use clerestory_tests::twin::{Case, random_words};
use clerestory_tests::{twin_kernel, with_gpu};
use glam::{DVec2, DVec3, Vec3};

twin_kernel!(twin_math);
twin_kernel!(twin_tables);

const DRAWS: usize = 1 << 17;
/// Cells along each side of the square.
const SIDE: usize = 32;

/// Pairs of numbers from the device: of slot `dimension`, one per pixel, or many of one pixel.
fn pairs(gpu: &Gpu, kind: SamplerKind, dimension: u32, one_pixel: bool) -> Vec<[f32; 2]> {
    let cases: Vec<RandomCase> = (0..DRAWS as u32)
        .map(|i| RandomCase {
            pixel: if one_pixel { 17 } else { i },
            sample_index: if one_pixel { i } else { 3 },
            dimension,
            seed: 2026,
        })
        .collect();
    let words = random_words(gpu, kind, &cases);
    words.iter().map(|w| w.two).collect()
}

/// Counts of points over an even grid of `rows` × `columns` cells of the unit square.
fn grid(points: impl Iterator<Item = [f64; 2]>, rows: usize, columns: usize) -> Vec<f64> {
    let mut counts = vec![0.0; rows * columns];
    for [x, y] in points {
        let cell = |v: f64, n: usize| ((v * n as f64) as usize).min(n - 1);
        counts[cell(y, rows) * columns + cell(x, columns)] += 1.0;
    }
    counts
}

fn expect_even(what: &str, counts: &[f64]) {
    let expected = vec![DRAWS as f64 / counts.len() as f64; counts.len()];
    expect_counts(what, counts, &expected);
}

fn wide(points: &[[f32; 2]]) -> impl Iterator<Item = [f64; 2]> + '_ {
    points.iter().map(|p| p.map(f64::from))
}

/// The word of a number from the device, whose upper 24 bits it has, in two halves as it travels.
fn halves(u: f32) -> [f32; 2] {
    let bits = (u * 16_777_216.0) as u32;
    [(bits >> 8) as f32, ((bits & 255) << 8) as f32]
}

/// Azimuth of a vector as a share of the circle.
fn turn(x: f64, y: f64) -> f64 {
    (y.atan2(x) / TAU).rem_euclid(1.0)
}

#[test]
fn pairs_fill_the_square_evenly() {
    with_gpu(|gpu| {
        for (what, kind, one_pixel) in [
            ("sobol over pixels", SamplerKind::Sobol, false),
            ("pcg over pixels", SamplerKind::Pcg, false),
            ("pcg over samples", SamplerKind::Pcg, true),
            ("joint sobol over pixels", SamplerKind::JointSobol, false),
        ] {
            let points = pairs(gpu, kind, 4, one_pixel);
            assert!(points.iter().flatten().all(|x| (0.0..1.0).contains(x)), "{what}");
            expect_even(what, &grid(wide(&points), SIDE, SIDE));
            // Neighbours in the order of drawing, and slots, are independent of each other.
            let next = pairs(gpu, kind, 5, one_pixel);
            let across = points.iter().zip(&next).map(|(a, b)| [a[0], b[0]].map(f64::from));
            expect_even(&format!("{what}, two slots"), &grid(across, SIDE, SIDE));
            let along = points.windows(2).map(|w| [w[0][0], w[1][0]].map(f64::from));
            let counts = grid(along.chain([[0.0; 2]]), SIDE, SIDE);
            expect_even(&format!("{what}, neighbours"), &counts);
        }
    });
}

#[test]
fn sobol_samples_of_a_pixel_are_stratified() {
    with_gpu(|gpu| {
        // 2¹⁷ points of a (0, 2)-sequence: exactly one in each elementary interval, whatever the scrambling; the 24 bits of the numbers
        // resolve sides of 2⁻¹⁷.
        let points = pairs(gpu, SamplerKind::Sobol, 4, true);
        for log_rows in [0, 4, 8, 13, 17] {
            let counts = grid(wide(&points), 1 << log_rows, DRAWS >> log_rows);
            assert!(counts.iter().all(|n| *n == 1.0), "2^{log_rows} rows");
        }
    });
}

#[test]
fn warps_keep_areas() {
    with_gpu(|gpu| {
        let points = pairs(gpu, SamplerKind::Pcg, 9, false);
        let cases: Vec<Case> = points.iter().map(|p| Case::new(p)).collect();
        let results = twin_math(gpu, 0, &cases, &[]);
        // Each is brought back to an even square by its own closed form: radius², height and azimuth.
        let disk = results.iter().map(|r| {
            let [x, y] = [r.0[0], r.0[1]].map(f64::from);
            [turn(x, y), x * x + y * y]
        });
        expect_even("disk", &grid(disk, 16, 32));
        let cosine = results.iter().map(|r| {
            let w = r.vector(2);
            [turn(w.x, w.y), w.z * w.z]
        });
        expect_even("cosine hemisphere", &grid(cosine, 16, 32));
        let sphere = results.iter().map(|r| {
            let w = r.vector(5);
            [turn(w.x, w.y), 0.5 * (w.z + 1.0)]
        });
        expect_even("sphere", &grid(sphere, 16, 32));
        let triangle = results.iter().map(|r| {
            // Uniform in the simplex: 1 − (1 − b₁)² and b₂ / (1 − b₁) are independent and even.
            let b = r.vector(11);
            [1.0 - (1.0 - b.y).powi(2), b.z / (1.0 - b.y).max(1e-12)]
        });
        expect_even("triangle", &grid(triangle, 16, 32));
    });
}

#[test]
fn visible_normals_follow_their_density() {
    with_gpu(|gpu| {
        const ROWS: usize = 16;
        const COLUMNS: usize = 24;
        const STEPS: usize = 16;
        let points = pairs(gpu, SamplerKind::Pcg, 11, false);
        for (cos_o, alpha) in [(1.0f64, 0.3f64), (0.5, 0.5), (0.1, 1.0), (0.7, 0.1)] {
            let wo = DVec3::new((1.0 - cos_o * cos_o).sqrt(), 0.0, cos_o);
            let [x, y, z] = wo.as_vec3().to_array();
            let cases: Vec<Case> = points
                .iter()
                .map(|p| Case::new(&[x, y, z, alpha as f32, p[0], p[1]]))
                .collect();
            let results = twin_math(gpu, 3, &cases, &[]);
            // Cells even in azimuth and in the GGX quantile of the height, where the density is smooth: tan²θ = α² q / (1 − q).
            let quantile = |h: DVec3| {
                let tan2 = (h.x * h.x + h.y * h.y) / (h.z * h.z);
                tan2 / (tan2 + alpha * alpha)
            };
            let counts = grid(
                results
                    .iter()
                    .map(|r| [turn(r.0[0].into(), r.0[1].into()), quantile(r.vector(0))]),
                ROWS,
                COLUMNS,
            );
            // ∫ over a cell by the midpoint rule; D cosθ sinθ dθ dφ = dq dφ / 2π. At grazing heights the rest grows as (1 − q)^(−½), which the
            // variable s with 1 − q = s² takes away.
            let expected: Vec<f64> = (0..ROWS * COLUMNS)
                .map(|cell| {
                    let (row, column) = (cell / COLUMNS, cell % COLUMNS);
                    let edge = |row: usize| (1.0 - row as f64 / ROWS as f64).sqrt();
                    let (s0, s1) = (edge(row + 1), edge(row));
                    let sum: f64 = (0..STEPS * STEPS)
                        .map(|i| {
                            let s = s0 + (s1 - s0) * ((i / STEPS) as f64 + 0.5) / STEPS as f64;
                            let phi =
                                TAU * (column as f64 + ((i % STEPS) as f64 + 0.5) / STEPS as f64) / COLUMNS as f64;
                            let tan = alpha * (1.0 - s * s).sqrt() / s;
                            let h = DVec3::new(tan * phi.cos(), tan * phi.sin(), 1.0).normalize();
                            let a2 = alpha * alpha;
                            let d = a2 / (PI * (h.z * h.z * (a2 - 1.0) + 1.0).powi(2));
                            ggx_visible_pdf(wo, h, alpha) / (d * h.z) * 2.0 * s
                        })
                        .sum();
                    sum * (s1 - s0) / (STEPS * STEPS) as f64 * DRAWS as f64 / COLUMNS as f64
                })
                .collect();
            let total: f64 = expected.iter().sum();
            assert!(
                (total / DRAWS as f64 - 1.0).abs() < 2e-3,
                "the density integrates to one: {total}"
            );
            expect_counts(&format!("cos {cos_o}, alpha {alpha}"), &counts, &expected);
        }
    });
}

#[test]
fn lights_are_chosen_by_their_power() {
    with_gpu(|gpu| {
        let powers: Vec<f64> = (0..50)
            .map(|i| if i % 7 == 3 { 0.0 } else { f64::from(1 + i * i % 17) })
            .collect();
        let cdf = build_distribution("lights", &powers).unwrap();
        let points = pairs(gpu, SamplerKind::Pcg, 13, false);
        let cases: Vec<Case> = (points.iter())
            .map(|p| {
                let ([a, b], [c, d]) = (halves(p[0]), halves(p[1]));
                Case::new(&[f32::from_bits(50), a, b, c, d])
            })
            .collect();
        let mut counts = vec![0.0; 50];
        // By quarters of what the choice leaves.
        let mut quarters = vec![0.0; 200];
        for result in twin_tables(gpu, 1, &cases, &cdf) {
            counts[result.bits(0) as usize] += 1.0;
            quarters[result.bits(0) as usize * 4 + (result.0[2] * 4.0) as usize] += 1.0;
        }
        let total: f64 = powers.iter().sum();
        let expected: Vec<f64> = powers.iter().map(|p| p / total * DRAWS as f64).collect();
        expect_counts("lights", &counts, &expected);
        let expected_quarters: Vec<f64> = (0..200).map(|i| expected[i / 4] / 4.0).collect();
        expect_counts("places on lights", &quarters, &expected_quarters);
        // The test would see a choice that is even where it should not be.
        assert!(chi_square_test(&counts, &vec![DRAWS as f64 / 50.0; 50]) < FALSE_ALARM);
    });
}

#[test]
fn environments_are_sampled_by_what_is_looked_up() {
    with_gpu(|gpu| {
        let mut map = Environment::uniform(Vec3::ONE);
        (map.width, map.height) = (8, 4);
        map.radiance = (0..32).map(|i| Vec3::splat(((i * 5) % 11) as f32)).collect();
        let tables = EnvironmentTables::build(&map, true).unwrap();
        let all = EnvironmentTables::build(&map, false).unwrap();
        let words = pairs(gpu, SamplerKind::Pcg, 15, false);
        // Four cells of the test along each side of a texel, even in azimuth and in polar angle.
        const COLUMNS: usize = 32;
        const ROWS: usize = 16;
        const STEPS: usize = 8;
        let draw = |emission: bool, cdf: &[f32]| {
            let floats = [bytemuck::cast_slice(&tables.texels), cdf].concat();
            let cases: Vec<Case> = (words.iter().zip(words.iter().rev()))
                .map(|(w, fresh)| {
                    let [a, b, c, d] = [w[0], w[1], fresh[0], fresh[1]].map(halves);
                    let size = [8, 4].map(f32::from_bits);
                    let rest = [
                        0.0,
                        0.0,
                        0.0,
                        0.0,
                        0.0,
                        tables.left_out,
                        f32::from_bits(emission.into()),
                    ];
                    Case::new(&[&size[..], &a, &b, &c, &d, &rest].concat())
                })
                .collect();
            let directions = twin_tables(gpu, 2, &cases, &floats);
            let points = directions.iter().map(|r| {
                let w = r.vector(0);
                [
                    (turn(-w.z, w.x) + 0.5).rem_euclid(1.0),
                    w.y.clamp(-1.0, 1.0).acos() / PI,
                ]
            });
            grid(points, ROWS, COLUMNS)
        };
        let expected = |density: &dyn Fn(DVec3) -> f64| -> Vec<f64> {
            let cell = |i: usize| {
                let at = |k: usize, first: usize, cells: usize| {
                    (first as f64 + (k as f64 + 0.5) / STEPS as f64) / cells as f64
                };
                let sum: f64 = (0..STEPS * STEPS)
                    .map(|k| {
                        let v = at(k / STEPS, i / COLUMNS, ROWS);
                        let w = environment_direction(DVec2::new(at(k % STEPS, i % COLUMNS, COLUMNS), v));
                        density(w) * (PI * v).sin()
                    })
                    .sum();
                sum * 2.0 * PI * PI / (ROWS * COLUMNS * STEPS * STEPS) as f64 * DRAWS as f64
            };
            (0..ROWS * COLUMNS).map(cell).collect()
        };
        let emission_cdf = tables.emission_cdf.as_ref().unwrap();
        for (what, emission, of, cdf) in [
            ("light above the mean", false, &tables, &tables.cdf),
            ("all light", true, &all, emission_cdf),
        ] {
            let counts = draw(emission, cdf);
            let bilinear = expected(&|w| of.environment_look_up(w).w);
            let total = bilinear.iter().sum::<f64>() / DRAWS as f64;
            assert!((total - 1.0).abs() < 1e-3, "the density integrates to one: {total}");
            expect_counts(what, &counts, &bilinear);
            // The test would see a density that is constant where it should not be.
            assert!(chi_square_test(&counts, &expected(&|_| 0.25 / PI)) < FALSE_ALARM);
        }
    });
}
