//! A gather on the device: lights in a buffer, points in, radiance out.

use glam::DVec3;

use super::lights::{GatherLights, GatherPoint, GatherSettings, SolidAngleForm, Terms};
use super::{GatherLight, Reflectivity};
use crate::gpu::shaders::constants::PACKED_NORMAL_BITS;
use crate::gpu::shaders::maps::gather as kernel;
use crate::gpu::shaders::types::{GatherPoint as DevicePoint, GatherRecord};
use crate::gpu::{Buffer, BufferDesc, BufferView, Category, ComputePipeline, Gpu, Pass, PipelineInfo};
use crate::maps::is_unit;
use crate::maps::packed_direction::pack_octahedral_nearest;
use crate::{Error, Result};

/// Lights as kernels read them, in their order, with their normals or without.
pub(crate) fn device_lights(lights: &GatherLights, has_normals: bool) -> Vec<GatherRecord> {
    let record = |light: &GatherLight| GatherRecord {
        position: light.position.as_vec3().to_array(),
        area: light.area as f32,
        radiance: light.radiance.as_vec3().to_array(),
        normal: if has_normals {
            pack_octahedral_nearest(light.normal, PACKED_NORMAL_BITS)
        } else {
            0
        },
    };
    lights.lights().iter().map(record).collect()
}

/// Lights on the device, the table of their reflectivities where one is asked for, and the kernel that sums over them. 32 bytes a light, with normals or
/// without.
#[derive(Debug)]
pub struct Gather {
    gpu: Gpu,
    exponent: f32,
    lights: Buffer,
    count: u32,
    table: Option<Buffer>,
    pipeline: ComputePipeline<kernel::Kernel>,
}

impl Gather {
    /// Uploads lights, makes the table, and the pipeline: specialized by the lights' form, terms, and whether there is a table.
    ///
    /// # Errors
    /// [`Error::Setting`] for an exponent below 1 or above 64; [`Error::OutOfMemory`], [`Error::DeviceLost`].
    pub fn new(gpu: &Gpu, lights: &GatherLights, settings: &GatherSettings, exponent: f32) -> Result<Self> {
        // Refuses exponents that no table has, with a table or without.
        let table = Reflectivity::new(f64::from(exponent))?;
        let has_normals = lights.form() == SolidAngleForm::DiscWithNormals;
        let records = device_lights(lights, has_normals);
        let table = settings.cones.then_some(table);
        let upload = |table: Reflectivity| gpu.buffer_with("gather: reflectivities", Category::Light, table.values());
        Ok(Self {
            gpu: gpu.clone(),
            exponent,
            count: records.len() as u32,
            lights: gpu.buffer_with("gather: lights", Category::Light, &records)?,
            table: table.map(upload).transpose()?,
            pipeline: gpu.compute_pipeline(&kernel::Spec {
                gather_form: lights.form().number(),
                gather_five: settings.terms != Terms::All,
                gather_scaled: settings.terms == Terms::Five,
                gather_cones: settings.cones,
            })?,
        })
    }

    /// The kernel with its specialization.
    pub fn info(&self) -> PipelineInfo {
        self.pipeline.info()
    }

    /// Bytes of lights, and of the table.
    pub fn bytes(&self) -> [u64; 2] {
        [self.lights.bytes(), self.table.as_ref().map_or(0, Buffer::bytes)]
    }

    /// Records the gather for `count` points of the type [`DevicePoint`], six numbers each, into three numbers each.
    ///
    /// Barriers: the points must have been made visible to [`Access::COMPUTE`](crate::gpu::Access::COMPUTE), and earlier uses of the values must have
    /// ended. After it the values have been written by a compute shader.
    ///
    /// # Errors
    /// As [`Pass::dispatch`].
    pub fn record(
        &self,
        pass: &mut Pass<'_>,
        points: BufferView<'_>,
        values: BufferView<'_>,
        count: u32,
    ) -> Result<()> {
        let set = kernel::Set0 {
            gather_lights: self.lights.view(),
            // Kernels without a table do not read it.
            gather_table: self.table.as_ref().unwrap_or(&self.lights).view(),
            points,
            values,
        };
        let push = kernel::Push {
            count,
            lights: self.count,
            exponent: self.exponent,
        };
        let groups = self.pipeline.groups_over(count);
        pass.dispatch(&self.pipeline, &[&set], &push, groups)
    }

    /// Radiance of points, in their order: twin [`GatherLights::gather`].
    ///
    /// # Errors
    /// [`Error::Setting`] for a point that is not finite in f32, and an axis that is no unit vector; [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn gather(&self, points: &[GatherPoint]) -> Result<Vec<DVec3>> {
        self.gather_timed(points).map(|(values, _)| values)
    }

    /// The same, with the time of the gather on the device in seconds.
    ///
    /// # Errors
    /// As [`Gather::gather`].
    pub fn gather_timed(&self, points: &[GatherPoint]) -> Result<(Vec<DVec3>, f64)> {
        for (i, point) in points.iter().enumerate() {
            let refused = |cause: &str| Err(Error::setting(format!("point {i}"), format!("{point:?}"), cause));
            if !point.position.as_vec3().is_finite() {
                return refused("is not finite");
            }
            if !is_unit(point.axis) {
                return refused("has an axis that is no unit vector");
            }
        }
        if points.is_empty() {
            return Ok((Vec::new(), 0.0));
        }
        let gpu = &self.gpu;
        let point = |point: &GatherPoint| DevicePoint {
            position: point.position.as_vec3().to_array(),
            axis: point.axis.as_vec3().to_array(),
        };
        let records: Vec<DevicePoint> = points.iter().map(point).collect();
        let records = gpu.buffer_with("gather: points", Category::Work, &records)?;
        let bytes = (points.len() * size_of::<[f32; 3]>()) as u64;
        let values = gpu.buffer(&BufferDesc::storage("gather: values", bytes, Category::Work))?;
        let mut recorder = gpu.recorder("gather")?;
        recorder.pass("gather", |pass| {
            self.record(pass, records.view(), values.view(), points.len() as u32)
        })?;
        let seconds = recorder.submit()?.wait()?.seconds();
        let values: Vec<[f32; 3]> = gpu.read(values.view(), points.len())?;
        let values = values.into_iter().map(|value| DVec3::from_array(value.map(f64::from)));
        Ok((values.collect(), seconds))
    }
}
