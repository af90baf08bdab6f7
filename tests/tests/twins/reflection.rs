//! Fresnel factors, GGX, Phong's lobe and shading normals.

use clerestory::scene::normal_map::mapped_normal;
use clerestory::transport::fresnel::{fresnel_conductor, fresnel_dielectric, fresnel_f0, fresnel_schlick};
use clerestory::transport::ggx::{ggx_d, ggx_g1, ggx_g2, ggx_sample_visible, ggx_visible_pdf};
use clerestory::transport::phong::{phong_eval, phong_pdf, phong_sample};
use clerestory::transport::shading_normal::{adapt_shading_normal, sides_agree};
use clerestory_tests::twin::{Results, Tolerance, U, compare, trigonometric_error};
use clerestory_tests::with_gpu;
use glam::{DVec3, DVec4};

use crate::{cases, check, direction, join, list, shift, twin_math, ulps, unit, upper, v2, v3};

#[test]
fn fresnel_factors_agree_with_their_twins() {
    with_gpu(|gpu| {
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
        check(gpu, "Fresnel", 2, &table, ulps(16.0, 4.0, 16.0 * U), 8, |x| {
            list![
                [fresnel_f0(x[1]), fresnel_dielectric(x[0], x[1])],
                fresnel_schlick(x[0], v3(x, 2)).to_array(),
                fresnel_conductor(x[0], v3(x, 2), v3(x, 5)).to_array(),
            ]
        });
    });
}

#[test]
fn ggx_agrees_with_its_twin() {
    with_gpu(|gpu| {
        let trig = trigonometric_error(gpu);
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
            let units = 8.0 * U;
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
    });
}

#[test]
fn phong_agrees_with_its_twin() {
    with_gpu(|gpu| {
        let trig = trigonometric_error(gpu);
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
            let units = 16.0 * U;
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
fn shading_normals_agree_with_their_twins() {
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
