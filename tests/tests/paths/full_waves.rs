//! Waves that stay full: slots of paths that have ended take new samples. Pictures are those of whole waves to the bit; passes are fewer, which is counted.

use std::collections::BTreeMap;

use clerestory::film::picture::Layer;
use clerestory::gpu::{DeviceKind, Gpu};
use clerestory::scene::Scene;
use clerestory::techniques::{PathTracer, PathTracerSettings};
use clerestory_tests::render::{builtin, tracer};
use clerestory_tests::with_gpu;

/// An odd number of pixels, so that waves and results end within rows and pixels.
const SIZE: [u32; 2] = [23, 17];
const SAMPLES: u32 = 9;

fn whole() -> PathTracerSettings {
    PathTracerSettings {
        full_waves: false,
        aovs: true,
        ..PathTracerSettings::default()
    }
}

fn full(paths_in_flight: u32) -> PathTracerSettings {
    PathTracerSettings {
        full_waves: true,
        paths_in_flight,
        ..whole()
    }
}

/// Bits of all layers of what is there, by name.
fn layers(tracer: &mut PathTracer) -> BTreeMap<String, Vec<u32>> {
    let (picture, left_out) = tracer.picture().unwrap();
    assert_eq!(left_out.total(), 0);
    let bits = |layer: &Layer| layer.values().iter().map(|value| value.to_bits()).collect();
    let layers = picture.layers().iter();
    layers.map(|layer| (layer.name().to_owned(), bits(layer))).collect()
}

fn expect_same(found: &BTreeMap<String, Vec<u32>>, truth: &BTreeMap<String, Vec<u32>>, what: &str) {
    let mut differ = String::new();
    for (name, truth) in truth {
        let pairs = truth.iter().zip(&found[name]).enumerate();
        let others: Vec<_> = pairs.filter(|(_, (a, b))| a != b).collect();
        if let Some((place, (a, b))) = others.first() {
            let (a, b) = (f32::from_bits(**a), f32::from_bits(**b));
            differ += &format!("{name}: {} of {}, at {place} {b} for {a}; ", others.len(), truth.len());
        }
    }
    assert!(differ.is_empty(), "{what}: {differ}");
}

/// Samples of all pixels together.
fn samples_of(tracer: &mut PathTracer) -> u64 {
    let (picture, _) = tracer.picture().unwrap();
    let samples = picture.require("samples").unwrap();
    samples.values().iter().map(|count| *count as u64).sum()
}

#[test]
fn pictures_are_those_of_whole_waves() {
    with_gpu(|gpu| {
        // Surfaces, and media, whose random numbers are keyed by the bounces that a path has had.
        for address in ["builtin:cornell-box", "builtin:fog-box"] {
            let scene = builtin(address);
            let of = |settings: &PathTracerSettings| {
                let mut tracer = tracer(gpu, &scene, SIZE, settings);
                tracer.render(SAMPLES).unwrap();
                let mut counters = tracer.counters();
                (counters.waves, counters.submissions) = (0, 0);
                (layers(&mut tracer), counters)
            };
            let truth = of(&whole());
            assert!(truth.0["radiance"].iter().any(|bits| f32::from_bits(*bits) > 0.0));
            for paths_in_flight in [0, 64, 192, 1024] {
                let kept_full = of(&full(paths_in_flight));
                assert_eq!(kept_full.1, truth.1, "{address}, {paths_in_flight} paths in flight");
                expect_same(
                    &kept_full.0,
                    &truth.0,
                    &format!("{address}, {paths_in_flight} paths in flight"),
                );
            }
        }
    });
}

/// Passes of a picture: bounces, and all.
fn passes(gpu: &Gpu, scene: &Scene, settings: &PathTracerSettings) -> ([usize; 2], u64) {
    let mut tracer = tracer(gpu, scene, [64, 64], settings);
    let mut counts = [0; 2];
    while let Some(step) = tracer.step(32).unwrap() {
        for timings in &step.timings {
            counts[0] += timings.count("path: extend");
            counts[1] += timings.passes.len();
        }
    }
    (counts, tracer.counters().extend_rays)
}

#[test]
fn passes_follow_from_segments_and_slots() {
    const SLOTS: u32 = 8192;
    with_gpu(|gpu| {
        let scene = builtin("builtin:cornell-box");
        let of = |settings| {
            let settings = PathTracerSettings {
                paths_in_flight: SLOTS,
                aovs: false,
                ..settings
            };
            passes(gpu, &scene, &settings)
        };
        let ((before, segments), (after, same)) = (of(whole()), of(full(0)));
        println!("{before:?} {after:?} {segments}");
        assert_eq!(segments, same);
        // Bounces that a driver watches are as many as it has time for.
        if gpu.caps().kind == DeviceKind::Cpu {
            assert_eq!(before, [384, 1631]);
            assert_eq!(after, [82, 473]);
        }
        assert!(after[0] as u64 >= segments.div_ceil(SLOTS.into()));
    });
}

#[test]
fn what_has_ended_can_be_looked_at_and_more_be_asked_for() {
    with_gpu(|gpu| {
        let scene = builtin("builtin:cornell-box");
        let mut truth = tracer(gpu, &scene, SIZE, &whole());
        truth.render(SAMPLES).unwrap();
        let truth = layers(&mut truth);
        let mut looked_at = tracer(gpu, &scene, SIZE, &full(256));
        let pixels = u64::from(SIZE[0] * SIZE[1]);
        let mut steps = 0;
        for wanted in [2, 3, SAMPLES] {
            let mut before = samples_of(&mut looked_at);
            while let Some(step) = looked_at.step(wanted).unwrap() {
                let there = samples_of(&mut looked_at);
                assert_eq!((there, step.wanted), (step.done, u64::from(wanted) * pixels));
                assert!(there >= before);
                (steps, before) = (steps + 1, there);
            }
            assert_eq!(before, u64::from(wanted) * pixels);
        }
        assert!(steps > 20, "{steps}");
        expect_same(&layers(&mut looked_at), &truth, "looked at");
        // What is under way is forgotten with the view.
        looked_at.set_camera(&scene.cameras[0]).unwrap();
        for _ in 0..3 {
            looked_at.step(SAMPLES).unwrap();
        }
        looked_at.set_camera(&scene.cameras[0]).unwrap();
        looked_at.render(SAMPLES).unwrap();
        expect_same(&layers(&mut looked_at), &truth, "begun anew");
    });
}
