//! Searches in impostors, method by method: ratios, steps, the march, and what is found, in boxes about the map's place.

use clerestory::gpu::Gpu;
use clerestory::maps::impostor::{
    ImpostorHit, ImpostorImage, ImpostorRay, ImpostorScene, ImpostorSettings, SearchMethod, impostor_by_march,
    impostor_by_steps, impostor_ratio, impostor_search,
};
use clerestory_tests::shaders::twin_search::Spec;
use clerestory_tests::twin::{Case, Results, Tolerance, compare};
use clerestory_tests::{twin_kernel, with_gpu};
use glam::{DVec3, Vec3};

use crate::{cases, direction, join, ulps, v3};

twin_kernel!(twin_search, specialized);

/// Half widths of the layers' boxes.
const BOXES: [f32; 2] = [1.0, 1.6];
const LAYERS: u32 = BOXES.len() as u32;
const TOLERANCE: f32 = 0.02;

/// Parts of a search, as the kernel numbers them.
const RATIO: u32 = 0;
const STEPS: u32 = 1;
const MARCH: u32 = 2;
const SEARCH: u32 = 3;

fn scene() -> ImpostorScene<impl Fn(u32, DVec3) -> f64> {
    let distance = |layer: u32, v: DVec3| f64::from(BOXES[layer as usize]) / v.abs().max_element();
    ImpostorScene {
        distance,
        layers: LAYERS,
        extent: extent().map(f64::from),
    }
}

/// Of both layers together.
fn extent() -> [f32; 2] {
    [BOXES[0], 3f32.sqrt() * BOXES[1]]
}

/// Rays from within the smaller box, from its middle and from behind its walls.
fn table(seed: u64) -> Vec<Case> {
    cases(seed, |r| {
        let x = match r.below(10) {
            0 => Vec3::ZERO,
            1 => 1.4 * r.vector(),
            _ => 0.8 * r.vector(),
        };
        let [nearest, farthest] = extent();
        let rest = [nearest, farthest, TOLERANCE, r.range(0.0, 3.0)];
        let layer = f32::from_bits(r.below(LAYERS as usize) as u32);
        join(&[&x.to_array(), &direction(r).to_array(), &rest, &[layer]])
    })
}

/// The ray of a case, and its layer.
fn ray(case: &[f64]) -> (ImpostorRay, u32) {
    let ray = ImpostorRay {
        origin: v3(case, 0),
        direction: v3(case, 3),
    };
    (ray, (case[10] as f32).to_bits())
}

fn exact(case: &Case) -> Vec<f64> {
    case.0.iter().map(|x| f64::from(*x)).collect()
}

fn settings(method: SearchMethod) -> ImpostorSettings {
    ImpostorSettings {
        method,
        steps: if method == SearchMethod::March { 24 } else { 3 },
        bisections: 20,
        tolerance: TOLERANCE,
    }
}

fn run(gpu: &Gpu, method: SearchMethod, function: u32, table: &[Case]) -> Vec<Results> {
    let of = settings(method);
    let spec = Spec {
        impostor_method: method.number(),
        impostor_steps: of.steps,
        impostor_bisections: of.bisections,
        impostor_layers: LAYERS,
        impostor_is_open: true,
    };
    twin_search(gpu, &spec, function, table, &BOXES)
}

/// Lengths of the size of the room; rounding of a guess enters the next one, by secants of any slope.
fn lengths() -> Tolerance {
    Tolerance {
        input_size: 1.0,
        ..ulps(64.0, 8.0, 2e-5)
    }
}

#[test]
fn parts_of_searches_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = table(76);
        for method in SearchMethod::ALL {
            let part = match method {
                SearchMethod::Classical => RATIO,
                SearchMethod::March => MARCH,
                _ => STEPS,
            };
            let results = run(gpu, method, part, &table);
            let twin = |case: &[f64]| {
                let ((ray, layer), scene, settings) = (ray(case), scene(), settings(method));
                vec![match part {
                    RATIO => impostor_ratio(&scene, layer, &ray, case[9]),
                    MARCH => impostor_by_march(&scene, layer, &ray, &settings),
                    _ => impostor_by_steps(&scene, layer, &ray, &settings),
                }]
            };
            let worst = compare(&method.to_string(), &table, &results, lengths(), 0..6, twin);
            println!("{method}: {worst:.3} of what is allowed");
        }
    });
}

/// Which layer has the surface changes where a residual is as large as the tolerance: there rounding chooses.
#[test]
fn searches_agree_with_their_twins() {
    with_gpu(|gpu| {
        let table = table(77);
        for method in SearchMethod::ALL {
            let settings = settings(method);
            let results = run(gpu, method, SEARCH, &table);
            let found = |case: &[f64], tolerance: f32| {
                let settings = ImpostorSettings { tolerance, ..settings };
                impostor_search(&scene(), &ray(case).0, &settings)
            };
            let far = |a: &ImpostorHit, b: &ImpostorHit| {
                a.layer != b.layer
                    || (a.distance - b.distance).abs() > 1e-4 * a.distance.max(1.0)
                    || (a.residual - b.residual).abs() > 1e-4
                    || (a.direction - b.direction).length() > 1e-4
            };
            let mut moved = 0;
            for (case, result) in table.iter().zip(&results) {
                let numbers = exact(case);
                let twin = found(&numbers, TOLERANCE);
                let device = ImpostorHit {
                    direction: result.vector(0),
                    distance: result.0[3].into(),
                    residual: result.0[4].into(),
                    layer: result.bits(5),
                };
                assert!(
                    device.distance <= f64::from(ImpostorImage::NOTHING),
                    "{method} {case:?}"
                );
                if !far(&device, &twin) {
                    continue;
                }
                // It is as sensitive itself: to the tolerance, or to the last digits of the ray.
                let mut is_sensitive = [0.99, 1.01]
                    .iter()
                    .any(|by| far(&found(&numbers, by * TOLERANCE), &twin));
                for i in 0..6 {
                    for by in [-1e-6, 1e-6] {
                        let mut near = numbers.clone();
                        near[i] += by;
                        is_sensitive |= far(&found(&near, TOLERANCE), &twin);
                    }
                }
                moved += 1;
                assert!(is_sensitive, "{method} {case:?}: {device:?} instead of {twin:?}");
            }
            println!("{method}: {moved} of {} are sensitive", table.len());
            assert!(20 * moved < table.len(), "{method}: {moved}");
        }
    });
}
