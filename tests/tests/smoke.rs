//! The shortest way from a scene to a picture, small enough to run under every kind of validation.

use clerestory::film::picture::Picture;
use clerestory::gpu::Gpu;
use clerestory::render::{RenderOptions, render};
use clerestory::scene;
use clerestory_tests::{assert_no_messages, with_gpu};

const SIZE: [u32; 2] = [24, 24];

fn picture(gpu: &Gpu, address: &str, spp: u32) -> Picture {
    let scene = scene::load(address).expect("a generated scene");
    let options = RenderOptions {
        size: SIZE,
        spp,
        ..RenderOptions::default()
    };
    let rendered = render(gpu, &scene, &options).expect("a picture");
    assert_no_messages(gpu);
    assert_eq!(rendered.report.non_finite_samples.total(), 0);
    assert_eq!(rendered.report.samples, [spp, spp]);
    assert!(!rendered.report.stopped_early && rendered.report.counters["rays"] > 0);
    rendered.picture
}

#[test]
fn the_cornell_box_is_finite_and_lit() {
    with_gpu(|gpu| {
        let picture = picture(gpu, "builtin:cornell-box", 2);
        let radiance = picture.require("radiance").expect("radiance");
        let bad = radiance.count_non_finite();
        assert_eq!((bad.nan, bad.infinite), (0, 0));
        assert!(radiance.values().iter().all(|value| *value >= 0.0));
        let lit = radiance
            .pixels()
            .filter(|pixel| pixel.iter().sum::<f32>() > 0.0)
            .count();
        assert!(lit * 2 > picture.pixel_count(), "{lit} pixels are lit");
    });
}

/// Radiance E / (1 − ρ) in every direction: the mean of all pixels within 4.5 standard errors of it, which a right renderer fails once in
/// about 150,000 runs; the seed is fixed.
#[test]
fn a_furnace_has_its_radiance() {
    with_gpu(|gpu| {
        let picture = picture(gpu, "builtin:furnace-box?rho=0.5&emission=0.5", 16);
        let radiance = picture.require("radiance").expect("radiance");
        let values: Vec<f64> = radiance.pixels().map(|pixel| f64::from(pixel[0])).collect();
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
        // Rounding of f32 sums: far below the noise, and the whole error where there is no noise.
        let error = (variance / n).sqrt() + 1e-6;
        assert!((mean - 1.0).abs() < 4.5 * error, "mean {mean}, standard error {error}");
    });
}
