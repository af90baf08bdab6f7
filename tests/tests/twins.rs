//! Every shader function that is mathematics against its Rust twin, over tables that hold the edges.
//!
//! How results are judged: `clerestory_tests::twin`. Rounding units allowed, of the result and of the inputs, are about the number of
//! f32 operations on the way; a device whose operations round as they should stays well below.

use clerestory::accel::offset::{SURFACE_SLACK, scene_reach, surface_point};
use clerestory::accel::sphere::{closest_approach, intersect_sphere};
use clerestory::accel::triangle::{intersect_triangle, ray_shear};
use clerestory::film::accumulate::{
    TwoFloat, split, two_float_add, two_float_add_square, two_float_add_two_float, two_product, two_sum,
};
use clerestory::gpu::{BufferDesc, Category, Gpu};
use clerestory::transport::albedo::{AlbedoTable, albedo_average, albedo_layer, albedo_lookup};
use clerestory::transport::bsdf::{
    BSDF_CONDUCTOR, Bsdf, BsdfContext, BsdfFeatures, GltfFactors, LOBE_ALL, bsdf_eval_pdf, bsdf_gltf, bsdf_sample,
};
use clerestory::transport::distribution::{build_distribution, build_distribution_2d, distribution_sample};
use clerestory::transport::environment::{
    environment_direction, environment_pdf, environment_sample, environment_texel_solid_angle, environment_uv,
};
use clerestory::transport::fresnel::{
    fresnel_conductor, fresnel_conductor_average, fresnel_dielectric, fresnel_f0, fresnel_schlick,
};
use clerestory::transport::ggx::{ggx_d, ggx_g1, ggx_g2, ggx_sample_visible, ggx_visible_pdf};
use clerestory::transport::lights::{
    area_to_solid_angle, balance_heuristic, power_heuristic, spot_falloff, triangle_point,
};
use clerestory::transport::phase::{
    henyey_greenstein, henyey_greenstein_sample, phase_direction, schlick_phase, schlick_phase_sample,
};
use clerestory::transport::phong::{phong_eval, phong_pdf, phong_sample};
use clerestory::transport::random::{
    Sampler, SamplerKind, owen_scramble, pcg3d, pcg4d, sample_1d, sample_2d, sampler_bits, sobol_pascal,
};
use clerestory::transport::shading_normal::{adapt_shading_normal, mapped_normal, sides_agree};
use clerestory::transport::warp::{
    cone_pdf, cosine_hemisphere_pdf, orthonormal_basis, square_to_cone, square_to_cosine_hemisphere, square_to_disk,
    square_to_hemisphere, square_to_sphere, square_to_triangle,
};
use clerestory_tests::random::Random;
use clerestory_tests::shaders::twin_random;
use clerestory_tests::shaders::types::{RandomCase, RandomWords};
use clerestory_tests::twin::{Case, Results, Tolerance, compare, trigonometric_error};
use clerestory_tests::{twin_kernel, with_gpu};
use glam::{DVec2, DVec3, DVec4, UVec2, UVec3, UVec4, Vec3};

twin_kernel!(twin_math);
twin_kernel!(twin_tables);
twin_kernel!(twin_bsdf);

const CASES: usize = 1500;
/// The greatest number that samplers return.
const ALMOST_ONE: f32 = 1.0 - 1.0 / 16_777_216.0;
const UNIT_EDGES: [f32; 8] = [0.0, 1.0 / 16_777_216.0, 1e-3, 0.25, 0.5, 0.75, 1.0 - 1e-3, ALMOST_ONE];

fn v2(x: &[f64], i: usize) -> DVec2 {
    DVec2::from_slice(&x[i..])
}

fn v3(x: &[f64], i: usize) -> DVec3 {
    DVec3::from_slice(&x[i..])
}

/// Numbers one after the other.
macro_rules! list {
    ($($part:expr),* $(,)?) => {{
        let mut all: Vec<f64> = Vec::new();
        $(all.extend_from_slice($part.as_ref());)*
        all
    }};
}

/// A number of a sampler, at an edge every third time.
fn unit(random: &mut Random) -> f32 {
    if random.below(3) == 0 {
        random.choose(&UNIT_EDGES)
    } else {
        random.unit()
    }
}

/// A direction, along an axis or near the horizon now and then.
fn direction(random: &mut Random) -> Vec3 {
    match random.below(8) {
        0 => random.choose(&[Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z]),
        1 => {
            let v = random.direction();
            Vec3::new(v.x, v.y, v.z * 1e-4).normalize()
        }
        2 => {
            let v = random.direction();
            Vec3::new(v.x * 1e-3, v.y * 1e-3, v.z.signum()).normalize()
        }
        _ => random.direction(),
    }
}

fn upper(random: &mut Random) -> Vec3 {
    let v = direction(random);
    Vec3::new(v.x, v.y, v.z.abs().max(1e-6))
}

fn cases(seed: u64, mut numbers: impl FnMut(&mut Random) -> Vec<f32>) -> Vec<Case> {
    let mut random = Random(seed);
    (0..CASES).map(|_| Case::new(&numbers(&mut random))).collect()
}

fn join(parts: &[&[f32]]) -> Vec<f32> {
    parts.concat()
}

fn ulps(result: f64, input: f64, absolute: f64) -> Tolerance {
    Tolerance {
        result,
        input,
        input_size: 0.0,
        absolute,
    }
}

#[test]
fn random_numbers_are_equal_bit_for_bit() {
    with_gpu(|gpu| {
        let mut random = Random(1);
        let words = [0, 1, 2, 63, 64, 0x7fff_ffff, 0x8000_0000, u32::MAX];
        let mut word = || {
            if random.below(4) == 0 {
                random.choose(&words)
            } else {
                random.word()
            }
        };
        let table: Vec<RandomCase> = (0..20_000)
            .map(|i| RandomCase {
                pixel: if i < 4096 { 5 } else { word() },
                sample_index: if i < 4096 { i } else { word() },
                dimension: if i < 4096 { 3 } else { word() },
                seed: if i < 4096 { 7 } else { word() },
            })
            .collect();
        for kind in [SamplerKind::Sobol, SamplerKind::Pcg] {
            for (c, r) in table.iter().zip(run_random(gpu, kind, &table)) {
                let mut s = Sampler {
                    pixel: c.pixel,
                    sample_index: c.sample_index,
                    dimension: c.dimension,
                    seed: c.seed,
                };
                let bits = sampler_bits(&s, kind);
                let (one, two) = (sample_1d(&mut s, kind), sample_2d(&mut s, kind));
                let expected = RandomWords {
                    bits,
                    pcg3: pcg3d(UVec3::new(c.pixel, c.sample_index, c.dimension)).to_array(),
                    pcg4: pcg4d(UVec4::new(c.pixel, c.sample_index, c.dimension, c.seed)).to_array(),
                    scrambled: owen_scramble(c.sample_index, c.seed),
                    pascal: sobol_pascal(c.sample_index),
                    one: one as f32,
                    two: [two.x as f32, two.y as f32],
                    next_dimension: s.dimension,
                };
                assert_eq!(r, expected, "{kind:?} {c:?}");
            }
        }
    });
}

fn run_random(gpu: &Gpu, kind: SamplerKind, table: &[RandomCase]) -> Vec<RandomWords> {
    let pipeline = gpu
        .compute_pipeline::<twin_random::Kernel>(&twin_random::Spec {
            sampler_kind: kind as u32,
        })
        .unwrap();
    let input = gpu.buffer_with("cases", Category::Work, table).unwrap();
    let bytes = (table.len() * size_of::<RandomWords>()) as u64;
    let output = gpu
        .buffer(&BufferDesc::storage("results", bytes, Category::Work))
        .unwrap();
    let mut recorder = gpu.recorder("random").unwrap();
    recorder
        .pass("random", |pass| {
            let set = twin_random::Set0 {
                random_cases: input.view(),
                random_results: output.view(),
            };
            let case_count = table.len() as u32;
            pass.dispatch(
                &pipeline,
                &[&set],
                &twin_random::Push { case_count },
                [pipeline.groups_for(case_count), 1, 1],
            )
        })
        .unwrap();
    recorder.submit().unwrap().wait().unwrap();
    gpu.read(output.view(), table.len()).unwrap()
}

#[test]
fn functions_without_tables() {
    with_gpu(|gpu| {
        let trig = trigonometric_error(gpu);
        let run = |what: &str,
                   function: u32,
                   table: Vec<Case>,
                   tolerance: Tolerance,
                   inputs: usize,
                   twin: &dyn Fn(&[f64]) -> Vec<f64>| {
            let results = twin_math(gpu, function, &table, &[]);
            let worst = compare(what, &table, &results, tolerance, 0..inputs, twin);
            println!("{what}: worst error {worst:.3} of what is allowed");
        };
        let mut table = cases(2, |r| vec![unit(r), unit(r)]);
        for (i, u) in UNIT_EDGES.iter().flat_map(|a| UNIT_EDGES.map(|b| [*a, b])).enumerate() {
            table[i] = Case::new(&u);
        }
        let near_edges = Tolerance {
            input_size: 1.0,
            ..ulps(8.0, 2.0, trig)
        };
        run("warps", 0, table, near_edges, 2, &|x| {
            let u = v2(x, 0);
            list![
                square_to_disk(u).to_array(),
                square_to_cosine_hemisphere(u).to_array(),
                square_to_sphere(u).to_array(),
                square_to_hemisphere(u).to_array(),
                square_to_triangle(u).to_array(),
            ]
        });
        let table = cases(3, |r| {
            join(&[
                &[
                    unit(r),
                    unit(r),
                    r.choose(&[2.0, 1.0, 0.5, 1e-3, 1e-7]),
                    r.range(-1.0, 1.0),
                ],
                &direction(r).to_array(),
            ])
        });
        run("cones and bases", 1, table, ulps(8.0, 2.0, trig), 7, &|x| {
            let (t, b) = orthonormal_basis(v3(x, 4));
            list![
                square_to_cone(v2(x, 0), x[2]).to_array(),
                [cone_pdf(x[2]), cosine_hemisphere_pdf(x[3])],
                t.to_array(),
                b.to_array()
            ]
        });
        let table = cases(4, |r| {
            let color = [r.unit(), r.unit(), r.choose(&[0.0, 1.0, 0.5])];
            let k = [r.range(0.0, 8.0), r.choose(&[0.0, 1e-3, 3.0]), r.range(0.0, 2.0)];
            join(&[
                &[
                    r.choose(&[1.0, 0.0, 1e-4, 0.3, 0.9]),
                    r.choose(&[1.5, 1.0 / 1.5, 1.0, 1.33, 0.1, 4.0]),
                ],
                &color,
                &k,
            ])
        });
        run(
            "Fresnel",
            2,
            table,
            ulps(16.0, 4.0, 16.0 * clerestory_tests::twin::U),
            8,
            &|x| {
                list![
                    [fresnel_f0(x[1]), fresnel_dielectric(x[0], x[1])],
                    fresnel_schlick(x[0], v3(x, 2)).to_array(),
                    fresnel_conductor(x[0], v3(x, 2), v3(x, 5)).to_array(),
                ]
            },
        );
        let table = cases(5, |r| {
            let wo = upper(r);
            join(&[
                &wo.to_array(),
                &[r.choose(&[1e-3, 0.01, 0.1, 0.5, 1.0]), unit(r), unit(r)],
                &upper(r).to_array(),
                &[r.range(1e-4, 1.0)],
            ])
        });
        let ggx = twin_math(gpu, 3, &table, &[]);
        for (case, result) in table.iter().zip(&ggx) {
            let x = case.0.map(f64::from);
            let (wo, alpha) = (v3(&x, 0), x[3]);
            let stretch = |v: DVec3, a: f64| DVec3::new(v.x * a, v.y * a, v.z).normalize();
            let h = ggx_sample_visible(wo, alpha, v2(&x, 4));
            // The half vector is a sum of two unit vectors, of length 2 v·h, whose rounding it magnifies; the stretch back by 1/alpha.
            let length = 2.0 * stretch(wo, alpha).dot(stretch(h, 1.0 / alpha));
            // √(1 − z²) near the pole: rounding of 1 − z² by some units becomes its root.
            let z = (1.0 - x[5]) * (1.0 + stretch(wo, alpha).z) - stretch(wo, alpha).z;
            let units = 8.0 * clerestory_tests::twin::U;
            let pole = units.sqrt().min(units / (1.0 - z * z).max(0.0).sqrt());
            let bound = (4.0 * trig + pole) / (length * alpha);
            let difference = (result.vector(0) - h).length();
            assert!(
                difference <= bound,
                "GGX normals: {difference:e} > {bound:e}, inputs {x:?}"
            );
        }
        let ggx: Vec<Results> = ggx.iter().map(|r| shift(r, 3)).collect();
        compare("GGX", &table, &ggx, ulps(32.0, 8.0, 0.0), 0..10, |x| {
            let (wo, alpha, h) = (v3(x, 0), x[3], v3(x, 6));
            vec![
                ggx_d(h, alpha),
                ggx_g1(wo.z, alpha),
                ggx_g2(wo.z, x[9], alpha, false),
                ggx_visible_pdf(wo, h, alpha),
            ]
        });
        let table = cases(6, |r| {
            let (inner, outer) = (r.range(0.5, 1.0), r.range(-1.0, 0.5));
            let mut all = vec![
                r.range(0.1, 9.0),
                r.range(1e-6, 1e6),
                r.choose(&[0.0, -1.0, 1e-9, 0.5, 1.0]),
                r.range(-1.0, 1.0),
                inner,
                outer,
            ];
            all.extend([r.choose(&[0.0, 1e-6, 1.0, 1e6]), r.choose(&[0.0, 1e-6, 1.0, 1e6])]);
            all.extend((0..9).map(|_| r.range(-10.0, 10.0)));
            all.extend([unit(r), unit(r)]);
            all
        });
        run("lights", 4, table, ulps(16.0, 4.0, 0.0), 19, &|x| {
            list![
                [
                    area_to_solid_angle(x[0], x[1], x[2]),
                    spot_falloff(x[3], x[4], x[5]),
                    balance_heuristic(x[6], x[7]),
                    power_heuristic(x[6], x[7]),
                ],
                triangle_point(v3(x, 8), v3(x, 11), v3(x, 14), v2(x, 17)).to_array(),
            ]
        });
        let table = cases(7, |r| {
            let head = [
                r.choose(&[-1.0, 1.0, 0.0, 0.999, 0.3]),
                r.choose(&[0.0, 0.5, -0.5, 0.99, -0.99, 0.05]),
                r.choose(&[0.0, 0.7, -0.99]),
                unit(r),
                unit(r),
            ];
            join(&[&head, &direction(r).to_array()])
        });
        // Henyey and Greenstein's inversion divides a difference of terms near 1 by 2g; |g| is 0.05 or more, or 0, here.
        let tolerance = Tolerance {
            input_size: 1.0,
            ..ulps(32.0, 4.0, trig + 4.0 * clerestory_tests::twin::U / 0.05)
        };
        run("phase functions", 5, table, tolerance, 8, &|x| {
            list![
                [
                    henyey_greenstein(x[0], x[1]),
                    henyey_greenstein_sample(x[1], x[3]),
                    schlick_phase(x[0], x[2]),
                    schlick_phase_sample(x[2], x[3]),
                ],
                phase_direction(v3(x, 5), x[0], x[4]).to_array(),
            ]
        });
        // pow loses log2(exponent) bits.
        let table = cases(8, |r| {
            join(&[
                &[r.unit(), r.unit(), r.unit(), r.choose(&[0.0, 1.0, 7.5, 100.0])],
                &upper(r).to_array(),
                &direction(r).to_array(),
                &[unit(r), unit(r)],
            ])
        });
        let phong = twin_math(gpu, 6, &table, &[]);
        let tolerance = Tolerance {
            input_size: 1.0,
            // A power that underflows is zero, and multiplied by up to a hundred afterwards.
            ..ulps(512.0, 8.0, 200.0 * f64::from(f32::MIN_POSITIVE))
        };
        compare("Phong", &table, &phong, tolerance, 0..10, |x| {
            list![
                phong_eval(v3(x, 0), x[3], v3(x, 4), v3(x, 7)).to_array(),
                [phong_pdf(x[3], v3(x, 4), v3(x, 7))],
            ]
        });
        for (case, result) in table.iter().zip(&phong) {
            let x = case.0.map(f64::from);
            let wo = v3(&x, 4);
            let w = phong_sample(x[3], wo, v2(&x, 10));
            // √(1 − c²) of a power c near 1: its rounding by some units becomes its root.
            let c = w.dot(DVec3::new(-wo.x, -wo.y, wo.z));
            let units = 16.0 * clerestory_tests::twin::U;
            let pole = units.sqrt().min(units / (1.0 - c * c).max(0.0).sqrt());
            let difference = (result.vector(4) - w).length();
            assert!(
                difference <= 4.0 * trig + pole,
                "Phong directions: {difference:e}, inputs {x:?}"
            );
        }
    });
}

#[test]
fn shading_normals() {
    with_gpu(|gpu| {
        let table = cases(9, |r| {
            let wo = direction(r);
            let ng = direction(r);
            let ng = if ng.dot(wo) < 0.0 { -ng } else { ng };
            let tangent = if r.below(4) == 0 {
                [0.0; 3]
            } else {
                direction(r).to_array()
            };
            let texel = [r.unit(), r.unit(), r.range(0.5, 1.0)];
            join(&[
                &direction(r).to_array(),
                &ng.to_array(),
                &wo.to_array(),
                &tangent,
                &[r.choose(&[1.0, -1.0])],
                &texel,
                &[r.choose(&[0.0, 1.0, 0.3])],
            ])
        });
        let results = twin_math(gpu, 7, &table, &[]);
        compare("adapted normals", &table, &results, ulps(16.0, 4.0, 0.0), 0..9, |x| {
            adapt_shading_normal(v3(x, 0), v3(x, 3), v3(x, 6)).to_array().to_vec()
        });
        let shifted: Vec<Results> = results.iter().map(|r| shift(r, 4)).collect();
        compare("mapped normals", &table, &shifted, ulps(16.0, 4.0, 0.0), 0..17, |x| {
            mapped_normal(v3(x, 0), DVec4::from_slice(&x[9..]), v3(x, 13), x[16])
                .to_array()
                .to_vec()
        });
        for (case, result) in table.iter().zip(&results) {
            let x = case.0.map(f64::from);
            let (ns, ng, wi) = (v3(&x, 0), v3(&x, 3), v3(&x, 6));
            if (ns.dot(wi) * ng.dot(wi)).abs() > 1e-7 {
                assert_eq!(result.bits(3) == 1, sides_agree(ns, ng, wi));
            }
        }
    });
}

/// Results from the i-th on.
fn shift(results: &Results, i: usize) -> Results {
    let mut shifted = Results([0.0; 16]);
    shifted.0[..16 - i].copy_from_slice(&results.0[i..]);
    shifted
}

#[test]
fn ray_starts_spheres_and_triangles() {
    with_gpu(|gpu| {
        let table = cases(10, |r| {
            let size = r.choose(&[1e-4, 1.0, 1e5]);
            let place = r.vector() * r.choose(&[0.0, 1.0, 1e5]);
            let mut all: Vec<f32> = (0..3).flat_map(|_| (place + size * r.vector()).to_array()).collect();
            let u = r.unit();
            all.extend([u, r.unit() * (1.0 - u)]);
            all.extend((place - 2.0 * size).to_array());
            all.extend((place + 2.0 * size).to_array());
            for _ in 0..2 {
                all.extend(direction(r).to_array());
            }
            all.extend((place + size * r.vector()).to_array());
            all.extend([size * 1e-6; 3]);
            all
        });
        for (case, result) in table.iter().zip(twin_math(gpu, 8, &table, &[])) {
            let x = case.0.map(f64::from);
            let corner = |i: usize| Vec3::from_slice(&case.0[3 * i..]);
            let vertices = [corner(0), corner(1), corner(2)];
            let reach = scene_reach(
                vertices[0],
                Vec3::from_slice(&case.0[11..]),
                Vec3::from_slice(&case.0[14..]),
            );
            let twin = surface_point(&vertices, [case.0[9], case.0[10]], reach);
            let exact = v3(&x, 0) + (v3(&x, 3) - v3(&x, 0)) * x[9] + (v3(&x, 6) - v3(&x, 0)) * x[10];
            // The point's own bound, without the share that belongs to the triangle test, must hold.
            let bound = twin.error.as_dvec3() - f64::from(SURFACE_SLACK * reach) * 0.999;
            let difference = (result.vector(0) - exact).abs();
            assert!(difference.cmple(bound).all(), "{difference} {bound} {:?}", case.0);
            let error = result.vector(3);
            assert!(
                (error - twin.error.as_dvec3()).abs().cmple(error * 1e-6).all(),
                "{error} {}",
                twin.error
            );
            // The start lies on the side of the direction, as far off as the error says, to the rounding of the position.
            let (normal, towards) = (v3(&x, 17), v3(&x, 20));
            let side = if normal.dot(towards) < 0.0 { -1.0 } else { 1.0 };
            let wanted = result.vector(0) + normal * (side * normal.abs().dot(error));
            if normal.dot(towards).abs() > 1e-6 {
                let rounding = 4.0 * clerestory_tests::twin::U * (wanted.abs() + error.length());
                assert!((result.vector(6) - wanted).abs().cmple(rounding).all(), "{:?}", case.0);
            }
            // Start plus segment is the far point: its normal is zero.
            let end = result.vector(9) + result.vector(12);
            let rounding =
                4.0 * clerestory_tests::twin::U * (end.abs() + result.vector(9).abs() + result.vector(12).abs());
            assert!((end - v3(&x, 23)).abs().cmple(rounding).all(), "{end} {:?}", case.0);
        }

        let table = cases(11, |r| {
            join(&[
                &(5.0 * r.vector()).to_array(),
                &direction(r).to_array(),
                &(5.0 * r.vector()).to_array(),
                &[r.choose(&[0.0, -1.0, 0.1, 2.0, 6.0])],
            ])
        });
        let results = twin_math(gpu, 9, &table, &[]);
        let approach: Vec<Results> = results.iter().map(|r| shift(r, 3)).collect();
        compare(
            "closest approach",
            &table,
            &approach,
            ulps(16.0, 4.0, 16.0 * 5.0 * clerestory_tests::twin::U),
            0..9,
            |x| {
                let a = closest_approach(v3(x, 0), v3(x, 3), v3(x, 6));
                vec![a.t, a.distance_squared]
            },
        );
        let mut hits = 0;
        for (case, result) in table.iter().zip(&results) {
            let x = case.0.map(f64::from);
            let near = closest_approach(v3(&x, 0), v3(&x, 3), v3(&x, 6))
                .distance_squared
                .sqrt();
            let clear = (near - x[9]).abs() > 1e-3;
            match intersect_sphere(v3(&x, 0), v3(&x, 3), v3(&x, 6), x[9]) {
                Some(t) if clear => {
                    hits += 1;
                    // √((r − d)(r + d)) has the slope d/√…: with r − d above 10⁻³ an error of 10u·5 in d becomes below 4·10⁻⁴.
                    assert_eq!(result.bits(0), 1);
                    assert!(
                        (f64::from(result.0[1]) - t[0])
                            .abs()
                            .max((f64::from(result.0[2]) - t[1]).abs())
                            < 4e-4,
                        "{:?}",
                        case.0
                    );
                }
                None if clear || x[9] <= 0.0 => assert_eq!(result.bits(0), 0, "{:?}", case.0),
                _ => {}
            }
        }
        assert!(hits > 100);

        let table = cases(12, |r| {
            let origin = r.vector();
            let corners: Vec<f32> = (0..3).flat_map(|_| r.vector().to_array()).collect();
            let inside = Vec3::from_slice(&corners) * 0.4
                + Vec3::from_slice(&corners[3..]) * 0.3
                + Vec3::from_slice(&corners[6..]) * 0.3;
            let to = if r.below(2) == 0 { inside - origin } else { direction(r) };
            join(&[
                &origin.to_array(),
                &to.to_array(),
                &corners,
                &[r.choose(&[0.0, 0.5]), r.choose(&[1e30, 0.9, f32::INFINITY])],
            ])
        });
        let mut met = 0;
        for (case, result) in table.iter().zip(twin_math(gpu, 10, &table, &[])) {
            let at = |i: usize| Vec3::from_slice(&case.0[i..]);
            let twin = intersect_triangle(
                &ray_shear(at(0), at(3)),
                &[at(6), at(9), at(12)],
                case.0[15],
                case.0[16],
            );
            if gpu.caps().kind == "cpu" {
                assert_eq!(result.bits(0) == 1, twin.is_some(), "{:?}", case.0);
            }
            if let (Some(hit), 1) = (twin, result.bits(0)) {
                met += 1;
                if gpu.caps().kind == "cpu" {
                    assert_eq!(
                        [result.0[1], result.0[2], result.0[3]],
                        [hit.t, hit.u, hit.v],
                        "{:?}",
                        case.0
                    );
                }
            }
        }
        assert!(met > CASES / 4, "{met}");
    });
}

#[test]
fn sums_in_pairs_are_equal_bit_for_bit() {
    with_gpu(|gpu| {
        let table = cases(13, |r| {
            let number = |r: &mut Random| r.range(-1.0, 1.0) * 2f32.powi(r.below(60) as i32 - 30);
            let hi = number(r);
            let other = number(r);
            vec![
                hi,
                hi * r.range(-1.0, 1.0) * 2f32.powi(-25),
                number(r),
                number(r),
                other,
                other * 2f32.powi(-26),
            ]
        });
        for (case, result) in table.iter().zip(twin_math(gpu, 11, &table, &[])) {
            let x = case.0;
            let a = TwoFloat { hi: x[0], lo: x[1] };
            let expected = [
                two_sum(x[2], x[3]),
                split(x[2]),
                two_product(x[2], x[3]),
                two_float_add(a, x[2]),
                two_float_add_two_float(a, TwoFloat { hi: x[4], lo: x[5] }),
                two_float_add_square(a, x[2]),
            ];
            for (i, e) in expected.into_iter().enumerate() {
                assert_eq!(
                    [result.0[2 * i], result.0[2 * i + 1]],
                    [e.hi, e.lo],
                    "function {i} of {x:?}"
                );
            }
        }
    });
}

#[test]
fn tables() {
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
        compare(
            "albedos",
            &table,
            &results,
            ulps(32.0, 4.0, 64.0 * clerestory_tests::twin::U),
            1..4,
            |x| {
                let layer = (x[0] as f32).to_bits() as usize;
                let (at, weight) = albedo_layer(x[3]);
                vec![
                    albedo_lookup(albedos, layer, x[1], x[2]),
                    albedo_average(albedos, layer, x[2]),
                    at as f64 + weight,
                ]
            },
        );

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
            let (w, texel, pdf) = sample_of(&cdf, size, &x);
            assert_eq!([result.bits(4), result.bits(5)], texel.to_array(), "{:?}", case.0);
            let trig = 4.0 * trigonometric_error(gpu);
            assert!((result.vector(0) - w).length() < trig, "{} {w}", result.vector(0));
            assert!(
                (f64::from(result.0[3]) - pdf).abs() <= pdf * 16.0 * trig,
                "{} {pdf}",
                result.0[3]
            );
            let uv = environment_uv(v3(&x, 6));
            let (du, dv) = (
                (f64::from(result.0[6]) - uv.x).abs(),
                (f64::from(result.0[7]) - uv.y).abs(),
            );
            // At the poles the azimuth is not defined, and u is the same at 0 and 1.
            let pole = x[6].hypot(x[8]) < 1e-2;
            assert!((pole || du.min(1.0 - du) < trig) && dv < trig, "{:?}: {uv}", case.0);
            let p = (uv * size.as_dvec2()).fract();
            if p.min(1.0 - p).min_element() > 1e-3 && !pole {
                let pdf = environment_pdf(&cdf, 0, size, v3(&x, 6));
                assert!(
                    (f64::from(result.0[8]) - pdf).abs() <= pdf * 16.0 * trig,
                    "{:?}: {pdf}",
                    case.0
                );
            }
            assert!((result.vector(9) - environment_direction(v2(&x, 4))).length() < trig);
            let solid_angle = environment_texel_solid_angle(size, texel.y);
            assert!((f64::from(result.0[12]) / solid_angle - 1.0).abs() < 16.0 * trig);
        }
    });
}

fn sample_of(cdf: &[f32], size: UVec2, x: &[f64]) -> (DVec3, UVec2, f64) {
    environment_sample(cdf, 0, size, v2(x, 2), v2(x, 4))
}

#[test]
fn the_scattering_function() {
    with_gpu(|gpu| {
        let metal = (DVec3::new(0.2, 0.4, 1.4), DVec3::new(4.0, 2.4, 1.6));
        let average = fresnel_conductor_average(metal.0, metal.1).as_vec3();
        let make = |seed: u64, same_side: bool| {
            cases(seed, |r| {
                let edge = |r: &mut Random| {
                    if r.below(2) == 0 {
                        r.choose(&[0.0f32, 1.0])
                    } else {
                        r.unit()
                    }
                };
                let mut all = vec![
                    r.unit(),
                    r.unit(),
                    1.0,
                    edge(r),
                    r.choose(&[0.0, 0.02, 0.1, 0.3, 0.6, 1.0]),
                    edge(r),
                ];
                all.extend([
                    r.choose(&[0.0, 1.0, 1.33, 1.5, 2.5]),
                    edge(r),
                    r.unit(),
                    1.0,
                    r.range(0.0, 2.0),
                    r.choose(&[0.0, 1.0]),
                ]);
                all.extend(metal.0.as_vec3().to_array());
                all.extend(metal.1.as_vec3().to_array());
                all.extend(average.to_array());
                all.push(f32::from_bits(r.choose(&[0, BSDF_CONDUCTOR])));
                let wo = Vec3::new(r.range(-0.9, 0.9), r.range(-0.4, 0.4), 0.0);
                let wo = (wo + Vec3::Z * r.choose(&[1.0, -1.0]) * r.range(0.02, 1.0)).normalize();
                let mut wi = r.direction();
                if same_side {
                    wi.z = wi.z.abs() * wo.z.signum();
                }
                all.extend(wo.to_array());
                all.extend(wi.to_array());
                all.extend([
                    r.range(0.01, 0.99),
                    r.range(0.01, 0.99),
                    r.unit(),
                    f32::from_bits(LOBE_ALL),
                ]);
                all
            })
        };
        let context = BsdfContext {
            features: BsdfFeatures::ALL,
            table: AlbedoTable::shared(),
        };
        let bsdf = |x: &[f64]| -> Bsdf {
            let b = bsdf_gltf(&GltfFactors {
                base_color: v3(x, 0),
                metallic: x[3],
                roughness: x[4],
                transmission: x[5],
                ior: x[6],
                specular: x[7],
                specular_color: v3(x, 8),
                thickness: x[11],
            });
            Bsdf {
                conductor_eta: v3(x, 12),
                conductor_k: v3(x, 15),
                conductor_average: v3(x, 18),
                flags: b.flags | (x[21] as f32).to_bits(),
                ..b
            }
        };
        // Half vectors of narrow lobes magnify rounding of the directions by 1/α²: the inputs' share of the tolerance carries it.
        let tolerance = ulps(256.0, 8.0, 256.0 * clerestory_tests::twin::U);
        for same_side in [true, false] {
            let table = make(20 + u64::from(same_side), same_side);
            let results = twin_bsdf(gpu, 0, &table, &context.table.values);
            compare("bsdf_eval_pdf", &table, &results, tolerance, 0..28, |x| {
                if x[21].is_nan() {
                    return vec![0.0; 4];
                }
                let (f, pdf) = bsdf_eval_pdf(&context, &bsdf(x), v3(x, 22), v3(x, 25), LOBE_ALL);
                vec![f.x, f.y, f.z, pdf]
            });
        }
        let table = make(30, true);
        let results = twin_bsdf(gpu, 1, &table, &context.table.values);
        let sampled = Tolerance {
            absolute: 16.0 * trigonometric_error(gpu),
            ..tolerance
        };
        let (mut agreed, mut total) = (0, 0);
        for (case, result) in table.iter().zip(&results) {
            let x = case.0.map(f64::from);
            let s = bsdf_sample(&context, &bsdf(&x), v3(&x, 22), v3(&x, 28), LOBE_ALL);
            total += 1;
            // A draw within rounding of the border between two lobes may fall on either side.
            if result.bits(7) != s.flags {
                continue;
            }
            agreed += 1;
            if s.flags != 0 {
                let bound = sampled.absolute;
                assert!(
                    (result.vector(0) - s.wi).length() < 4.0 * bound,
                    "{} {} {:?}",
                    result.vector(0),
                    s.wi,
                    case.0
                );
                // The weight is f |cos| / pdf of the device's own direction; densities are compared above.
                let weight = (result.vector(4) - s.weight).abs().max_element();
                assert!(
                    weight <= 256.0 * bound * s.weight.max_element().max(1.0),
                    "{} {} {:?}",
                    result.vector(4),
                    s.weight,
                    case.0
                );
                assert_eq!(result.0[3] == 0.0, s.pdf == 0.0);
            }
        }
        assert!(agreed * 1000 >= total * 998, "{agreed} of {total} lobes agree");
    });
}
