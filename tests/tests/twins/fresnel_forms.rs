//! Forms of a metal's Fresnel factor, the exact one against the complex form, and the table of it with the geometric term.

use clerestory::scene::metals::{self, artistic::artistic_index};
use clerestory::transport::fresnel::compensated::{fresnel_compensated, fresnel_compensated_average};
use clerestory::transport::fresnel::curve::{CurveForm, FresnelCurve};
use clerestory::transport::fresnel::fresnel_conductor;
use clerestory::transport::fresnel::rescaled::{conductor_f0, fresnel_rescaled, fresnel_schlick_average};
use clerestory::transport::fresnel::simplified::fresnel_simplified;
use clerestory::transport::fresnel::table::{fresnel_table, fresnel_table_lookup, fresnel_tabulated};
use clerestory::transport::fresnel::tinted::fresnel_tinted;
use clerestory::transport::microfacets::{
    beckmann_d, beckmann_g1, beckmann_sample, cook_torrance_g, cosine_lobe_d, cosine_lobe_g1, cosine_lobe_sample,
    kelemen_g, smith_g,
};
use clerestory_tests::random::Random;
use clerestory_tests::twin::{Case, Tolerance, U, compare, trigonometric_error};
use clerestory_tests::{twin_kernel, with_gpu};

use crate::{cases, join, list, shift, twin_math, ulps, v2, v3};

twin_kernel!(twin_fresnel);

fn cosine(r: &mut Random) -> f32 {
    match r.below(4) {
        0 => r.choose(&[0.0, 1.0, 1e-7, 1e-4, 0.999_999]),
        1 => r.unit() * 1e-3,
        _ => r.unit(),
    }
}

fn index(r: &mut Random) -> [f32; 3] {
    [r.range(0.02, 5.0), r.range(0.02, 5.0), r.choose(&[1.0, 0.04, 1.5, 5.0])]
}

fn extinction(r: &mut Random) -> [f32; 3] {
    [
        r.range(0.0, 12.0),
        r.range(0.0, 12.0),
        r.choose(&[0.0, 1e-3, 5.0, 12.0]),
    ]
}

#[test]
fn forms_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(40, |r| {
            let (eta, k) = (index(r), extinction(r));
            let (a, alpha) = (
                [r.range(-0.1, 5.0), r.range(0.0, 1.0), 0.5],
                [r.range(1.0, 12.0), r.range(1.0, 3.0), 1.0],
            );
            join(&[&[cosine(r)], &eta, &k, &[r.unit(), r.unit(), 1.0], &a, &alpha])
        });
        let results = twin_fresnel(gpu, 0, &table, &[]);
        let worst = compare("indices", &table, &results, ulps(32.0, 4.0, 16.0 * U), 0..7, |x| {
            list![
                conductor_f0(v3(x, 1), v3(x, 4)).to_array(),
                fresnel_rescaled(x[0], v3(x, 1), v3(x, 4)).to_array(),
                fresnel_simplified(x[0], v3(x, 1), v3(x, 4)).to_array(),
            ]
        });
        println!("indices: {worst:.3} of what is allowed");
        // A power loses as many units as its exponent, of the size of its base's logarithm: 5 · c (1 − c)^12 by Vulkan's rules for log2 and exp2.
        let tolerance = Tolerance {
            absolute: 4e-6,
            ..ulps(32.0, 4.0, 0.0)
        };
        let results = twin_fresnel(gpu, 1, &table, &[]);
        let worst = compare("terms", &table, &results, tolerance, 0..16, |x| {
            list![
                fresnel_compensated(x[0], v3(x, 7), v3(x, 10), v3(x, 13)).to_array(),
                fresnel_tinted(x[0], v3(x, 7), v3(x, 10)).to_array(),
                fresnel_schlick_average(v3(x, 7)).to_array(),
                fresnel_compensated_average(v3(x, 7), v3(x, 10), v3(x, 13)).to_array(),
            ]
        });
        println!("terms: {worst:.3} of what is allowed");
    });
}

#[test]
fn colours_agree_with_their_twin() {
    with_gpu(|gpu| {
        let table = cases(44, |r| {
            let mut color = |edges: &[f32]| [r.unit(), r.range(0.9, 0.9998), r.choose(edges)];
            join(&[&color(&[0.0, 0.04, 0.5, 1.0]), &color(&[0.0, 0.3, 1.0])])
        });
        let results = twin_fresnel(gpu, 4, &table, &[]);
        // What one lacks to a reflectance near it has no more digits than its input.
        let worst = compare("colours", &table, &results, ulps(32.0, 4.0, 16.0 * U), 0..6, |x| {
            let [eta, k] = artistic_index(v3(x, 0), v3(x, 3));
            list![eta.to_array(), k.to_array()]
        });
        println!("colours: {worst:.3} of what is allowed");
    });
}

/// A million random indices and cosines: within 10⁻⁶ of the f64 twin, which engine/src/transport/fresnel.rs holds to the complex form within 10⁻¹³.
#[test]
fn the_conductor_in_single_precision_is_the_complex_form() {
    with_gpu(|gpu| {
        let mut random = Random(41);
        let table: Vec<Case> = (0..333_334)
            .map(|i| {
                let c = match i % 8 {
                    0 => 1e-6 + random.unit() * 1e-3,
                    1 => random.choose(&[0.0, 1e-7, 1e-6, 1e-4, 1.0]),
                    _ => random.range(1e-6, 1.0),
                };
                let eta = [0, 1, 2].map(|_| random.range(0.02, 5.0));
                let k = [0, 1, 2].map(|_| random.range(0.0, 12.0));
                Case::new(&join(&[&[c, 0.0], &eta, &k]))
            })
            .collect();
        let results = twin_math(gpu, 2, &table, &[]);
        let mut worst = 0.0f64;
        for (case, result) in table.iter().zip(&results) {
            let x = case.0.map(f64::from);
            let exact = fresnel_conductor(x[0], v3(&x, 2), v3(&x, 5));
            worst = worst.max((result.vector(5) - exact).abs().max_element());
        }
        assert!(worst < 1e-6, "{worst:e}");
        println!("conductors: {worst:.2e}");
        // The ends of the range of indices, and beyond them nothing that is no number.
        let ends = [1e-25f32, 1e-6, 1e6].map(|eta| [0.0, 1e6].map(|k| [0.0, 1e-3, 0.5, 1.0].map(|c| (c, eta, k))));
        let ends: Vec<Case> = (ends.as_flattened().as_flattened().iter())
            .map(|&(c, eta, k)| Case::new(&[c, 1.0, eta, eta, eta, k, k, k]))
            .collect();
        for (case, result) in ends.iter().zip(&twin_math(gpu, 2, &ends, &[])) {
            let (x, found) = (case.0.map(f64::from), result.vector(5));
            assert!(found.is_finite(), "{:?}", case.0);
            let exact = fresnel_conductor(x[0], v3(&x, 2), v3(&x, 5));
            assert!(
                x[2] < 1e-6 * 0.99 || (found - exact).abs().max_element() < 1e-5,
                "{:?}: {found} {exact}",
                case.0
            );
        }
        // No interface reflects nothing, at a cosine of 0 too; just above it the root of what rounding leaves of 1 − 1 is all there is.
        let nothing = [0.0, 0.01, 0.5, 1.0].map(|c| Case::new(&[c, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]));
        for result in twin_math(gpu, 2, &nothing, &[]) {
            assert!(result.vector(5).max_element() <= 1e-6, "{}", result.vector(5));
        }
    });
}

#[test]
fn tables_agree_with_their_twin() {
    with_gpu(|gpu| {
        let gold = metals::by_name("gold").expect("metal");
        let (eta, k) = (gold.eta.as_dvec3(), gold.k.as_dvec3());
        let factor = |c| fresnel_conductor(c, eta, k);
        let nodes = fresnel_table(factor);
        let table = cases(42, |r| vec![cosine(r)]);
        let two = [nodes.as_flattened(), nodes.as_flattened()].concat();
        let results = twin_fresnel(gpu, 2, &table, &two);
        // The place in the table comes from a logarithm, with an absolute error of 2⁻²¹: 25 nodes an octave, 2 % from node to node.
        let worst = compare("table", &table, &results, ulps(128.0, 8.0, 0.0), 0..1, |x| {
            fresnel_table_lookup(&nodes, x[0]).to_array().to_vec()
        });
        println!("table: {worst:.3} of what is allowed");
        // By both tables, which are the same.
        let factors: Vec<_> = results.iter().map(|result| shift(result, 3)).collect();
        let worst = compare("factor", &table, &factors, ulps(128.0, 8.0, 0.0), 0..1, |x| {
            let f = fresnel_tabulated(x[0], factor).to_array();
            [f, f].concat()
        });
        println!("factor: {worst:.3} of what is allowed");
    });
}

#[test]
fn microfacets_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = cases(43, |r| {
            let [l, v] = [0, 1].map(|_| {
                let w = r.direction();
                glam::Vec3::new(w.x, w.y, w.z.abs().max(0.02)).normalize()
            });
            let (slope, exponent) = (r.choose(&[0.1, 0.3, 0.5, 1.0]), r.choose(&[5.0, 10.0, 50.0, 200.0]));
            join(&[
                &l.to_array(),
                &v.to_array(),
                &[slope, exponent, r.unit(), r.range(0.0, 0.999)],
            ])
        });
        let results = twin_fresnel(gpu, 3, &table, &[]);
        // Exponents of up to 200 magnify the rounding of the half vector, and Vulkan's exponentials that of their argument.
        let tolerance = Tolerance {
            input_size: 1.0,
            ..ulps(1024.0, 16.0, 1e-30)
        };
        let worst = compare("microfacets", &table, &results, tolerance, 0..8, |x| {
            let (l, v) = (v3(x, 0), v3(x, 3));
            let h = (l + v).normalize();
            vec![
                beckmann_d(h, x[6]),
                cosine_lobe_d(h, x[7]),
                cook_torrance_g(l, v, h),
                kelemen_g(l, h),
                beckmann_g1(l, x[6]),
                cosine_lobe_g1(l, x[7]),
                smith_g(l, v, beckmann_g1(l, x[6]), beckmann_g1(v, x[6])),
            ]
        });
        println!("microfacets: {worst:.3} of what is allowed");
        let trig = trigonometric_error(gpu);
        for (case, result) in table.iter().zip(&results) {
            let x = case.0.map(f64::from);
            let u = v2(&x, 8);
            for (place, expected) in [(7, beckmann_sample(x[6], u)), (10, cosine_lobe_sample(x[7], u))] {
                let difference = (result.vector(place) - expected).length();
                // The sine is a root of what is left of one.
                let sine = (1.0 - expected.z * expected.z).sqrt();
                let bound = 4.0 * trig + (16.0 * U).sqrt().min(16.0 * U / sine);
                assert!(difference <= bound, "{difference:e} > {bound:e}, {x:?}");
            }
        }
    });
}

/// Cosines that are given are those of a curve: the same bits where these are even, and the factor there.
#[test]
fn curves_are_evaluated_at_the_cosines_that_are_given() {
    with_gpu(|gpu| {
        let gold = metals::by_name("gold").expect("metal");
        let curve = FresnelCurve::new(gpu, CurveForm::Exact, &gold, 1).expect("curve");
        let (even, _) = curve.run(gpu, 5).expect("run");
        assert_eq!(curve.run_at(gpu, &[0.0, 0.25, 0.5, 0.75, 1.0]).expect("run"), even);
        for cosine in [0.013, 0.9] {
            let found = curve.run_at(gpu, &[cosine]).expect("run")[0];
            let exact = fresnel_conductor(cosine, gold.eta.as_dvec3(), gold.k.as_dvec3()).to_array();
            for (found, exact) in found.into_iter().zip(exact) {
                assert!((f64::from(found) - exact).abs() < 1e-6, "{cosine}: {found} {exact}");
            }
        }
        assert!(curve.run_at(gpu, &[]).expect("run").is_empty());
    });
}
