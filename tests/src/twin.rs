//! Runs the kernels that hold shader functions beside their Rust twins, and judges the differences.
//!
//! A result is accepted by mixed forward and backward error: it may differ by some rounding units of the result, plus by as much as the
//! f64 twin itself moves when its inputs move by some rounding units. The second part is what f32 arithmetic can promise where a
//! function is ill-conditioned, and needs no bound written down for each.

use crate::shaders::types::{RandomCase, RandomWords};
use crate::shaders::{constants, twin_random};
use bytemuck::{Pod, Zeroable};
use clerestory::gpu::interface::ComputeShader;
use clerestory::gpu::{BufferDesc, Category, ComputePipeline, DeviceKind, Gpu};
use clerestory::transport::random::SamplerKind;

/// Numbers of a case.
pub const INPUTS: usize = constants::TWIN_INPUTS as usize;
/// Numbers of its results.
pub const OUTPUTS: usize = constants::TWIN_OUTPUTS as usize;

/// Unit roundoff of f32, 2⁻²⁴.
pub const U: f64 = 1.0 / 16_777_216.0;

/// One row of a table; integers travel as bits.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Case(pub [f32; INPUTS]);

impl Case {
    /// A case of its first numbers; the others are zero.
    pub fn new(numbers: &[f32]) -> Self {
        let mut case = Self([0.0; INPUTS]);
        case.0[..numbers.len()].copy_from_slice(numbers);
        case
    }
}

/// What the device computed for a case.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Results(pub [f32; OUTPUTS]);

impl Results {
    /// An integer result.
    pub fn bits(&self, i: usize) -> u32 {
        self.0[i].to_bits()
    }

    /// A vector.
    pub fn vector(&self, i: usize) -> glam::DVec3 {
        glam::Vec3::from_slice(&self.0[i..]).as_dvec3()
    }
}

/// How far results may be from the twin's.
#[derive(Debug, Clone, Copy)]
pub struct Tolerance {
    /// Rounding units of the result.
    pub result: f64,
    /// Rounding units that inputs may have moved by.
    pub input: f64,
    /// Least size that inputs are taken to have when they are moved: 1 for numbers that the function subtracts from 1.
    pub input_size: f64,
    /// Absolute error of the device's trigonometric functions that enter results of size 1.
    pub absolute: f64,
}

/// Absolute error of sine, cosine and arc tangent: 2⁻²⁰ is what the software driver's polynomials keep with room to spare; Vulkan's
/// precision rules allow 2⁻¹¹, which is all that can be asked of other drivers.
pub fn trigonometric_error(gpu: &Gpu) -> f64 {
    if gpu.caps().kind == DeviceKind::Cpu {
        1.0 / 1_048_576.0
    } else {
        1.0 / 2048.0
    }
}

/// Compares the first results of each case with `twin`, which returns as many numbers as there are to compare, and gives the largest error
/// as a share of what is allowed. Of the inputs, those in `inputs` are moved; integers and numbers that only select lie outside.
pub fn compare(
    what: &str,
    cases: &[Case],
    results: &[Results],
    tolerance: Tolerance,
    inputs: std::ops::Range<usize>,
    twin: impl Fn(&[f64]) -> Vec<f64>,
) -> f64 {
    let mut worst = 0.0f64;
    for (case, result) in cases.iter().zip(results) {
        let exact: Vec<f64> = case.0.iter().map(|x| f64::from(*x)).collect();
        let value = twin(&exact);
        let mut allowed: Vec<f64> = value
            .iter()
            .map(|v| tolerance.result * U * v.abs() + tolerance.absolute + f64::from(f32::MIN_POSITIVE))
            .collect();
        for i in inputs.clone() {
            let mut moved = vec![0.0f64; value.len()];
            for sign in [-1.0, 1.0] {
                let mut near = exact.clone();
                near[i] += sign * tolerance.input * U * exact[i].abs().max(tolerance.input_size);
                for (m, (a, b)) in moved.iter_mut().zip(twin(&near).iter().zip(&value)) {
                    *m = m.max((a - b).abs());
                }
            }
            for (a, m) in allowed.iter_mut().zip(moved) {
                *a += m;
            }
        }
        for (i, (v, a)) in value.iter().zip(&allowed).enumerate() {
            let got = f64::from(result.0[i]);
            let difference = (got - v).abs();
            assert!(
                difference <= *a,
                "{what}, result {i}: {got:e}, twin {v:e}, difference {difference:e} > {a:e}, inputs {:?}",
                &case.0
            );
            worst = worst.max(difference / a);
        }
    }
    worst
}

/// Dispatches one invocation per case of a kernel with the three buffers cases, results, table.
pub fn dispatch<K: ComputeShader>(
    gpu: &Gpu,
    spec: &K::Spec,
    cases: &[Case],
    table: &[f32],
    record: impl FnOnce(
        &mut clerestory::gpu::Pass<'_>,
        &ComputePipeline<K>,
        [clerestory::gpu::BufferView<'_>; 3],
    ) -> clerestory::Result<()>,
) -> Vec<Results> {
    let run = || -> clerestory::Result<Vec<Results>> {
        let pipeline = gpu.compute_pipeline::<K>(spec)?;
        let input = gpu.buffer_with("cases", Category::Work, cases)?;
        let bytes = size_of_val(cases) as u64 / 2;
        let output = gpu.buffer(&BufferDesc::storage("results", bytes, Category::Work))?;
        let table = gpu.buffer_with("table", Category::Work, if table.is_empty() { &[0.0] } else { table })?;
        let mut recorder = gpu.recorder("twins")?;
        recorder.pass("twins", |pass| {
            record(pass, &pipeline, [input.view(), output.view(), table.view()])
        })?;
        recorder.submit()?.wait()?;
        gpu.read(output.view(), cases.len())
    };
    run().unwrap_or_else(|error| panic!("{error}"))
}

/// What the device's random functions give for each case.
pub fn random_words(gpu: &Gpu, kind: SamplerKind, table: &[RandomCase]) -> Vec<RandomWords> {
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

/// Defines a function that runs a twin kernel: the generated sets and push constants of each shader are types of their own. With the word `specialized` the
/// function takes the values of the kernel's specialization constants, too.
#[macro_export]
macro_rules! twin_kernel {
    ($name:ident) => {
        fn $name(
            gpu: &clerestory::gpu::Gpu,
            function: u32,
            cases: &[$crate::twin::Case],
            table: &[f32],
        ) -> Vec<$crate::twin::Results> {
            $crate::twin_kernel!($name, specialized);
            $name(gpu, &(), function, cases, table)
        }
    };
    ($name:ident, specialized) => {
        fn $name(
            gpu: &clerestory::gpu::Gpu,
            spec: &<$crate::shaders::$name::Kernel as clerestory::gpu::interface::ComputeShader>::Spec,
            function: u32,
            cases: &[$crate::twin::Case],
            table: &[f32],
        ) -> Vec<$crate::twin::Results> {
            use $crate::shaders::$name as shader;
            let case_count = cases.len() as u32;
            $crate::twin::dispatch::<shader::Kernel>(
                gpu,
                spec,
                cases,
                table,
                |pass, pipeline, [inputs, outputs, table]| {
                    let set = shader::Set0 {
                        twin_inputs: inputs,
                        twin_outputs: outputs,
                        twin_table: table,
                    };
                    let push = shader::Push { function, case_count };
                    pass.dispatch(pipeline, &[&set], &push, [pipeline.groups_for(case_count), 1, 1])
                },
            )
        }
    };
}
