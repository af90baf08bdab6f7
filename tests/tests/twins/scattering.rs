//! The whole scattering function: values, densities, samples.

use clerestory::scene::FresnelForm;
use clerestory::transport::albedo::AlbedoTable;
use clerestory::transport::bsdf::{
    BSDF_BECKMANN, BSDF_CLASSIC, BSDF_COMPENSATED_CONDUCTOR, BSDF_COSINE_LOBE, BSDF_EXACT_CONDUCTOR, BSDF_PHONG,
    BSDF_SCHLICK_CONDUCTOR, BSDF_SIMPLIFIED_CONDUCTOR, BSDF_SIMPLIFIED_G, BSDF_SMITH_G, BSDF_TABLE_CONDUCTOR,
    BSDF_TINTED_CONDUCTOR, Bsdf, BsdfContext, BsdfFeatures, GltfFactors, LOBE_ALL, bsdf_eval_pdf, bsdf_gltf,
    bsdf_sample,
};
use clerestory::transport::fresnel::form::MetalFresnel;
use clerestory::transport::fresnel::fresnel_conductor;
use clerestory::transport::fresnel::table::fresnel_table;
use clerestory_tests::random::Random;
use clerestory_tests::twin::{Tolerance, U, compare, trigonometric_error};
use clerestory_tests::{twin_kernel, with_gpu};
use glam::{DVec3, Vec3};

use crate::{cases, ulps, v3};

twin_kernel!(twin_bsdf);

#[test]
fn the_scattering_function_agrees_with_its_twin() {
    with_gpu(|gpu| {
        let metal = (DVec3::new(0.2, 0.4, 1.4), DVec3::new(4.0, 2.4, 1.6));
        let parameters = |form| MetalFresnel::new(form, metal.0, metal.1).parameters();
        let exact = parameters(FresnelForm::Exact);
        // The device has the table, the twin the index that it is of.
        let by_table = [DVec3::ZERO, DVec3::ZERO, parameters(FresnelForm::Table)[2]];
        let forms = [
            (parameters(FresnelForm::Rescaled), BSDF_SCHLICK_CONDUCTOR),
            (parameters(FresnelForm::Compensated), BSDF_COMPENSATED_CONDUCTOR),
            (parameters(FresnelForm::Hoffman), BSDF_TINTED_CONDUCTOR),
            (parameters(FresnelForm::Simplified), BSDF_SIMPLIFIED_CONDUCTOR),
            (by_table, BSDF_TABLE_CONDUCTOR),
        ];
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
                // Metals by colour, index, lobe, and by each form of their Fresnel factor.
                let kind = r.below(3 + forms.len());
                let classic = r.choose(&[
                    0,
                    0,
                    BSDF_CLASSIC,
                    BSDF_CLASSIC | BSDF_BECKMANN,
                    BSDF_CLASSIC | BSDF_COSINE_LOBE | BSDF_SIMPLIFIED_G,
                    BSDF_CLASSIC | BSDF_SMITH_G,
                    BSDF_CLASSIC | BSDF_BECKMANN | BSDF_SMITH_G,
                    BSDF_CLASSIC | BSDF_COSINE_LOBE | BSDF_SMITH_G,
                ]);
                let (parameters, flags) = match kind.checked_sub(3) {
                    Some(form) => forms[form],
                    None => (exact, [0, BSDF_EXACT_CONDUCTOR, BSDF_PHONG][kind]),
                };
                all.extend(parameters.iter().flat_map(|v| v.as_vec3().to_array()));
                // Classical microfacets are those of whole metals.
                if classic != 0 && flags != BSDF_PHONG {
                    (all[3], all[5]) = (1.0, 0.0);
                    all.push(f32::from_bits(flags | classic));
                } else {
                    all.push(f32::from_bits(flags));
                }
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
            let flags = b.flags | (x[21] as f32).to_bits();
            let [conductor_a, conductor_b] = match flags & BSDF_TABLE_CONDUCTOR {
                0 => [v3(x, 12), v3(x, 15)],
                _ => [metal.0, metal.1],
            };
            Bsdf {
                conductor_a,
                conductor_b,
                conductor_c: v3(x, 18),
                flags,
                ..b
            }
        };
        let nodes = fresnel_table(|c| fresnel_conductor(c, metal.0, metal.1));
        let tables = [&context.table.values[..], nodes.as_flattened()].concat();
        // Half vectors of narrow lobes magnify rounding of the directions by 1/α²: the inputs' share of the tolerance carries it.
        let tolerance = ulps(256.0, 8.0, 256.0 * U);
        for same_side in [true, false] {
            let table = make(20 + u64::from(same_side), same_side);
            let results = twin_bsdf(gpu, 0, &table, &tables);
            compare("bsdf_eval_pdf", &table, &results, tolerance, 0..28, |x| {
                if x[21].is_nan() {
                    return vec![0.0; 4];
                }
                let (f, pdf) = bsdf_eval_pdf(&context, &bsdf(x), v3(x, 22), v3(x, 25), LOBE_ALL);
                vec![f.x, f.y, f.z, pdf]
            });
        }
        let table = make(30, true);
        let results = twin_bsdf(gpu, 1, &table, &tables);
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
                let choice = (f64::from(result.0[8]) - s.choice).abs();
                assert!(choice <= 256.0 * bound, "{} {} {:?}", result.0[8], s.choice, case.0);
            }
        }
        assert!(agreed * 1000 >= total * 998, "{agreed} of {total} lobes agree");
    });
}
