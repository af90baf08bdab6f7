//! Forms of a metal's Fresnel factor on the device: their curve in single precision, and chains of evaluations for their cost.
//!
//! The kernel stands by itself and is part of no picture. Bands are independent. Deterministic.

use glam::DVec3;

use super::compensated::compensated_metal;
use super::fresnel_conductor;
use super::rescaled::conductor_f0;
use super::table::{NODES, fresnel_table};
use super::tinted::tinted_metal;
use crate::gpu::shaders::constants;
use crate::gpu::shaders::transport::fresnel_curve as kernel;
use crate::gpu::{Buffer, BufferDesc, BufferView, Category, ComputePipeline, Gpu, Pass};
use crate::scene::ConductorIor;
use crate::scene::metals::artistic::artistic_parameters;
use crate::{Error, Result};

/// What is evaluated, and from what.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CurveForm {
    /// The cosine itself: what a chain costs.
    Nothing,
    /// The exact factor from n and k.
    Exact,
    /// Schlick's curve from n.
    Schlick,
    /// The rescaled curve from n and k.
    Rescaled,
    /// The compensated curve from n, k and two coefficients.
    Compensated,
    /// The rescaled curve from its normal reflectance.
    RescaledF0,
    /// The compensated curve from its normal reflectance and two coefficients.
    CompensatedF0,
    /// The curve with the exponent 6 from its normal reflectance and one coefficient.
    Tinted,
    /// The simplified factor from n and k.
    Simplified,
    /// The simplified factor from its normal reflectance and edge tint, of which n and k are made each time.
    Artistic,
    /// A look-up of the exact factor times the simplified geometric term.
    Table,
}

impl CurveForm {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::Nothing,
        Self::Exact,
        Self::Schlick,
        Self::Rescaled,
        Self::Compensated,
        Self::RescaledF0,
        Self::CompensatedF0,
        Self::Tinted,
        Self::Simplified,
        Self::Artistic,
        Self::Table,
    ];

    const fn number(self) -> u32 {
        match self {
            Self::Nothing => constants::CURVE_NOTHING,
            Self::Exact => constants::CURVE_EXACT,
            Self::Schlick => constants::CURVE_SCHLICK,
            Self::Rescaled => constants::CURVE_RESCALED,
            Self::Compensated => constants::CURVE_COMPENSATED,
            Self::RescaledF0 => constants::CURVE_RESCALED_F0,
            Self::CompensatedF0 => constants::CURVE_COMPENSATED_F0,
            Self::Tinted => constants::CURVE_TINTED,
            Self::Simplified => constants::CURVE_SIMPLIFIED,
            Self::Artistic => constants::CURVE_ARTISTIC,
            Self::Table => constants::CURVE_TABLE,
        }
    }
}

/// Most evaluations of an invocation: below the driver's cap on loops with room to spare.
const CHAIN_MAX: u32 = 4096;

/// From grazing to normal incidence.
const ALL_COSINES: [f32; 2] = [0.0, 1.0];

/// The kernel for one form of one metal.
#[derive(Debug)]
pub struct FresnelCurve {
    pipeline: ComputePipeline<kernel::Kernel>,
    push: kernel::Push,
    table: Buffer,
}

impl FresnelCurve {
    /// Makes the pipeline and what it reads; an invocation makes `chain` evaluations, of which the last is kept.
    ///
    /// # Errors
    /// [`Error::Setting`] for a chain outside 1 to 4096; [`Error::OutOfMemory`].
    pub fn new(gpu: &Gpu, form: CurveForm, ior: &ConductorIor, chain: u32) -> Result<Self> {
        if !(1..=CHAIN_MAX).contains(&chain) {
            return Err(Error::setting("chain", chain, format!("is not in 1..={CHAIN_MAX}")));
        }
        let (eta, k) = (ior.eta.as_dvec3(), ior.k.as_dvec3());
        let [f0, a, alpha] = match form {
            CurveForm::Compensated | CurveForm::CompensatedF0 => compensated_metal(eta, k),
            CurveForm::Tinted => {
                let [f0, b] = tinted_metal(eta, k, false);
                [f0, b, DVec3::ZERO]
            }
            CurveForm::Artistic => {
                let [reflectance, edge_tint] = artistic_parameters(eta, k);
                [reflectance, edge_tint, DVec3::ZERO]
            }
            _ => [conductor_f0(eta, k), DVec3::ZERO, DVec3::ZERO],
        }
        .map(|v| v.as_vec3().to_array());
        let nodes = if form == CurveForm::Table {
            fresnel_table(|c| fresnel_conductor(c, eta, k))
        } else {
            vec![[0.0; 4]; NODES]
        };
        Ok(Self {
            pipeline: gpu.compute_pipeline(&kernel::Spec {
                curve_form: form.number(),
                curve_chain: chain,
            })?,
            push: kernel::Push {
                eta: ior.eta.to_array(),
                count: 0,
                k: ior.k.to_array(),
                f0,
                a,
                alpha,
                cosines: ALL_COSINES,
            },
            table: gpu.buffer_with("Fresnel table", Category::Work, &nodes)?,
        })
    }

    /// Records `count` invocations, the i-th beginning at the cosine i/(count − 1), into as many values of three floats.
    ///
    /// Barriers: earlier uses of the values must have ended. After it they have been written by a compute shader.
    ///
    /// # Errors
    /// [`Error::Setting`] for fewer than two invocations; as [`Pass::dispatch`].
    pub fn record(&self, pass: &mut Pass<'_>, values: BufferView<'_>, count: u32) -> Result<()> {
        self.record_between(pass, values, count, ALL_COSINES)
    }

    fn record_between(&self, pass: &mut Pass<'_>, values: BufferView<'_>, count: u32, cosines: [f32; 2]) -> Result<()> {
        if count < 2 {
            return Err(Error::setting("count", count, "is below 2"));
        }
        let set = kernel::Set0 {
            table: self.table.view(),
            values,
        };
        let push = kernel::Push {
            count,
            cosines,
            ..self.push
        };
        pass.dispatch(&self.pipeline, &[&set], &push, self.pipeline.groups_over(count))
    }

    /// The results of `count` invocations, and their time on the device in seconds.
    ///
    /// # Errors
    /// As [`FresnelCurve::record`], and those of the device.
    pub fn run(&self, gpu: &Gpu, count: u32) -> Result<(Vec<[f32; 3]>, f64)> {
        self.run_between(gpu, count, ALL_COSINES)
    }

    /// One value for each cosine, by a dispatch of its own: cosines need not be evenly spaced.
    ///
    /// # Errors
    /// As [`FresnelCurve::run`].
    pub fn run_at(&self, gpu: &Gpu, cosines: &[f64]) -> Result<Vec<[f32; 3]>> {
        let of = |cosine: &f64| {
            let (values, _) = self.run_between(gpu, 2, [*cosine as f32; 2])?;
            Ok(values[0])
        };
        cosines.iter().map(of).collect()
    }

    fn run_between(&self, gpu: &Gpu, count: u32, cosines: [f32; 2]) -> Result<(Vec<[f32; 3]>, f64)> {
        let bytes = u64::from(count) * size_of::<[f32; 3]>() as u64;
        let values = gpu.buffer(&BufferDesc::storage("Fresnel values", bytes, Category::Work))?;
        let mut recorder = gpu.recorder("Fresnel curve")?;
        recorder.pass("Fresnel curve", |pass| {
            self.record_between(pass, values.view(), count, cosines)
        })?;
        let seconds = recorder.submit()?.wait()?.seconds();
        Ok((gpu.read(values.view(), count as usize)?, seconds))
    }
}
