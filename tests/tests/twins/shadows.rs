//! Omnidirectional shadow maps: device and twin.

use clerestory::raster::{ShadowLayout, shadow_receiver, shadow_texel_radius, shadow_threshold};
use clerestory_tests::random::Random;
use clerestory_tests::twin::{Case, Tolerance, compare};
use clerestory_tests::{twin_kernel, with_gpu};

use crate::{cases, direction, join, ulps, v3};

twin_kernel!(twin_shadows);

fn layout(r: &mut Random) -> (ShadowLayout, u32) {
    (r.choose(&ShadowLayout::ALL), r.choose(&[8, 64, 1024]))
}

fn bits(words: [u32; 2]) -> [f32; 2] {
    words.map(f32::from_bits)
}

fn layout_of(x: &[f64]) -> (ShadowLayout, u32) {
    let [kind, side] = [x[0], x[1]].map(|x| (x as f32).to_bits());
    let layout = ShadowLayout::ALL.into_iter().find(|layout| layout.kind() == kind);
    (layout.expect("layout"), side)
}

#[test]
fn shadow_maps_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table: Vec<Case> = cases(60, |r| {
            let (layout, side) = layout(r);
            join(&[&bits([layout.kind(), side]), &direction(r).to_array()])
        });
        let results = twin_shadows(gpu, 0, &table, &[]);
        let worst = compare("texels", &table, &results, ulps(16.0, 4.0, 0.0), 2..5, |x| {
            let (layout, side) = layout_of(x);
            vec![shadow_texel_radius(layout, v3(x, 2), side)]
        });
        println!("texels: worst error {worst:.3} of what is allowed");
        let table: Vec<Case> = cases(61, |r| {
            let (layout, side) = layout(r);
            let light = r.vector() * r.magnitude(-4, 4);
            let position = light + r.vector() * r.magnitude(-4, 4);
            let width = r.choose(&[0u32, 1, 3]);
            join(&[
                &bits([layout.kind(), side]),
                &r.direction().to_array(),
                &[f32::from_bits(width)],
                &light.to_array(),
                &position.to_array(),
                &r.direction().to_array(),
                &[1e-6 * position.length()],
            ])
        });
        let results = twin_shadows(gpu, 1, &table, &[]);
        let tolerance = Tolerance {
            absolute: 0.0,
            ..ulps(64.0, 16.0, 0.0)
        };
        let worst = compare("receivers", &table, &results, tolerance, 6..16, |x| {
            let (layout, side) = layout_of(x);
            let width = (x[5] as f32).to_bits();
            let r = shadow_receiver(layout, side, width, v3(x, 6), [v3(x, 9), v3(x, 12)], x[15]);
            vec![r.to.x, r.to.y, r.to.z, r.distance]
        });
        println!("receivers: worst error {worst:.3} of what is allowed");
        // Where the plane is seen edge-on within rounding, either side's answer counts: the lesser of two that meet there.
        for (case, result) in table.iter().zip(&results) {
            let x: Vec<f64> = case.0.iter().map(|x| f64::from(*x)).collect();
            let (layout, side) = layout_of(&x);
            let width = case.0[5].to_bits();
            let r = shadow_receiver(layout, side, width, v3(&x, 6), [v3(&x, 9), v3(&x, 12)], x[15]);
            let size = v3(&x, 6).length() + v3(&x, 9).length();
            let (height, threshold) = (f64::from(result.0[4]), f64::from(result.0[5]));
            assert!((height - r.height).abs() < 1e-6 * (size + r.distance), "{case:?}");
            let expected = shadow_threshold(&r, v3(&x, 2));
            // The height's rounding over how steeply the direction falls, as long as that is above rounding itself.
            let fall = -r.normal.dot(v3(&x, 2));
            let allowed = 2e-6 * (size + r.distance) * (1.0 + 1.0 / fall.abs().max(1e-3));
            assert!(
                (threshold - expected).abs() <= allowed || fall.abs() < 1e-3,
                "{case:?}: {threshold} {expected}"
            );
        }
    });
}
