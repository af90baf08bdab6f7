//! Every shader function that is mathematics against its Rust twin, over tables that hold the edges.
//!
//! How results are judged: `clerestory_tests::twin`. Rounding units allowed, of the result and of the inputs, are about the number of
//! f32 operations on the way; a device whose operations round as they should stays well below.

mod directions;
mod edges;
mod fresnel_forms;
mod geometry;
mod history;
mod impostors;
mod interleave;
mod light_tree;
mod lights;
mod maps;
mod media;
mod photons;
mod random;
mod raster;
mod reflection;
mod reflective;
mod resampling;
mod scattering;
mod searches;
mod shadows;
mod sums;
mod tables;
mod twin_texture;

use clerestory::gpu::Gpu;
use clerestory_tests::random::Random;
use clerestory_tests::twin::{Case, Results, Tolerance, compare};
use clerestory_tests::twin_kernel;
use glam::{DVec2, DVec3, Vec3};

twin_kernel!(twin_math);

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
use list;

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

/// Results from the i-th on.
fn shift(results: &Results, i: usize) -> Results {
    let mut shifted = Results([0.0; 16]);
    shifted.0[..16 - i].copy_from_slice(&results.0[i..]);
    shifted
}

/// Runs a function over its table and compares all its results.
pub fn check(
    gpu: &Gpu,
    what: &str,
    function: u32,
    table: &[Case],
    tolerance: Tolerance,
    inputs: usize,
    twin: impl Fn(&[f64]) -> Vec<f64>,
) {
    let results = twin_math(gpu, function, table, &[]);
    let worst = compare(what, table, &results, tolerance, 0..inputs, twin);
    println!("{what}: worst error {worst:.3} of what is allowed");
}
